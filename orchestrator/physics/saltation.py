"""Grains that hop over their bed: when one that is in motion keeps hopping.

This is the threshold of cessation, in air the impact threshold. Whether motion starts
and is sustained, by rolling and hopping, is that of `rolling`.

A grain hops over a bed of equal grains, under a flow with the profile
`velocity.law_of_the_wall`: the drag acts on its speed relative to the fluid, the added
mass slows it, gravity is tilted by the slope of the bed. Where it meets the bed it
rebounds by a `Rebound` law, which is that of many rebounds in the mean; a grain that
rebounds with less energy than it needs to leave a pocket is trapped.

All quantities are in units of the diameter d, of ``g' = (1 - rho_f/rho_sol) g`` and of
the mass of the grain. A grain is then its Galileo number Ga = sqrt((s - 1) g d^3)/nu
and its density ratio s = rho_sol/rho_f. The friction velocity is ``sqrt(s theta)``
with the Shields number theta, the viscosity ``sqrt(s)/Ga``. All grains are of shape
(n,).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics import velocity
from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import CLIFT_GAUVIN
from orchestrator.physics.rebound import BEADS, Rebound
from orchestrator.types import BoolArray, FloatArray, IntArray

ADDED_MASS = 0.5
"""Added mass of a sphere, in masses of the fluid that it displaces."""
EXCESS = 1.02
"""Energy of a grain that has just left its pocket, over that which is trapped."""
LAUNCH_DEG = 30.0
"""Angle at which a grain leaves its pocket, degrees.

The thresholds differ by less than 2 % from 20 to 60 degrees.
"""
LEAST, MOST = 1e-4, 10.0
"""Shields numbers between which thresholds are looked for."""
HALVINGS = 14
"""Halvings of the logarithm of that range: they leave 0.07 % of the Shields number."""
STEPS = 12
"""Time steps of a hop, in vacuum; a grain that falls slowly takes more.

Four times as many move thresholds by less than 1 %.
"""
SINKING_STEPS = 4
"""Part of the way to the bed in which a grain sinks that follows the fluid at once."""
MOST_STEPS = 20_000
"""Time steps after which a trajectory has no end."""
MOST_HOPS = 100
"""Hops after which a grain goes on that is not trapped."""
ALIKE = 3
"""Hops in a row that must each be no weaker than the one before, or as strong.

A grain with so many goes on.
"""
SETTLED = 1e-4
"""Relative difference up to which two hops are as strong as each other."""


class Gust(NamedTuple):
    """A gust: the stress of the flow is larger for a time, then that of the mean flow.

    Attributes
    ----------
    peak
        Its stress over that of the mean flow.
    duration
        How long it lasts, in sqrt(d/g'); one for all grains, or one for each.
    """

    peak: ArrayLike = 1.0
    duration: ArrayLike = 0.0


CALM = Gust()
"""No gust."""
STOPS, GOES_ON, ENDLESS = 0, 1, 2
"""What becomes of a grain: it is trapped, goes on, or its trajectory does not end."""


class _Pull(NamedTuple):
    """What acts on some grains, arrays of shape (n,).

    Speed of the `fluid`, `drag` over mass and relative speed, and gravity `along` the
    bed and `normal` to it.
    """

    fluid: FloatArray
    drag: FloatArray
    along: FloatArray
    normal: FloatArray


class _Flow:
    """Constant quantities of some grains under their flows, arrays of shape (n,)."""

    def __init__(
        self,
        grains: Grain,
        shields: FloatArray,
        gust: "Gust",
        rebound: Rebound,
    ) -> None:
        """Make them for Shields numbers, a gust and a law of rebound."""
        s = grains.density_ratio
        inertia = s / (s + ADDED_MASS)
        slope = np.radians(grains.slope_deg)
        self.trapped, self.level = rebound.on(grains.relative_size)
        self.viscosity = np.sqrt(s) / grains.galileo
        self.ustar = np.sqrt(s * shields)
        self.peak_ustar = self.ustar * np.sqrt(gust.peak)
        self.gust_end = np.broadcast_to(np.asarray(gust.duration, float), s.shape)
        self.along = -np.sin(slope) * inertia
        self.normal = np.cos(slope) * inertia
        # Stokes' drag over mass and relative speed
        self.stokes = 18 * self.viscosity / (s + ADDED_MASS)
        self.sand_grain = SAND_GRAIN * grains.ratio
        with np.errstate(divide="ignore"):
            depth = shields * (s - 1) / np.maximum(grains.fall, 0)
        # gravity without buoyancy, over that of a grain under water
        self.dry = s / (s - 1)
        self.depth = depth

    def keep(self, mask: BoolArray) -> None:
        """Keep some of the grains."""
        for name, value in vars(self).items():
            setattr(self, name, value[mask])

    def pull(
        self,
        height: FloatArray,
        along: FloatArray,
        normal: FloatArray,
        ustar: FloatArray,
    ) -> _Pull:
        """What acts on grains at some heights that have some speeds."""
        unit = ustar / self.viscosity
        above = np.maximum(height, 0) + self.level
        covered = self.depth - above
        if (covered >= 0.5).all():
            middle = above
            area = weight = np.ones_like(above)
        else:
            # a grain that stands out of the water has drag and buoyancy below it
            top = np.clip(covered, -0.5, 0.5)
            area, volume = submerged(top)
            middle = above + (top - 0.5) / 2
            weight = volume + (1 - volume) * self.dry
        part = np.minimum(middle / self.depth, 1.0)
        rise = velocity.law_of_the_wall(middle * unit, self.sand_grain * unit)
        speed = ustar * np.maximum(rise - velocity.shallow_defect(part), 0)
        reynolds = np.hypot(speed - along, normal) / self.viscosity
        drag = self.stokes * area * CLIFT_GAUVIN.factor(reynolds)
        return _Pull(speed, drag, weight * self.along, weight * self.normal)


def submerged(top: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the parts of a sphere that lie below the surface of the water.

    Parameters
    ----------
    top
        Height of the surface over the centre, d, between -0.5 and 0.5.

    Returns
    -------
    area, volume
        Parts of the cross-section and of the volume that are below; the area is never
        zero.

    Examples
    --------
    >>> area, volume = submerged(np.array([0.0, 0.25, 0.5]))
    >>> print(area.round(3), volume.round(3))
    [0.5   0.804 1.   ] [0.5   0.844 1.   ]
    """
    up = 2 * top
    segment = np.arccos(-up) + up * np.sqrt(np.maximum(1 - up**2, 0))
    area = np.maximum(segment / np.pi, 1e-9)
    volume = (2 + 3 * up - up**3) / 4
    return np.asarray(area), np.asarray(volume)


class _Motion(NamedTuple):
    """Height and speeds of some grains, arrays of shape (n,)."""

    height: FloatArray
    along: FloatArray
    normal: FloatArray

    def later(
        self,
        pull: _Pull,
        time: FloatArray,
    ) -> "_Motion":
        """The motion after a time, exact for a drag that is linear and constant."""
        decay = np.exp(-pull.drag * time)
        reach = -np.expm1(-pull.drag * time) / pull.drag
        along_end = pull.fluid + pull.along / pull.drag
        normal_end = -pull.normal / pull.drag
        return _Motion(
            self.height + normal_end * time + (self.normal - normal_end) * reach,
            along_end + (self.along - along_end) * decay,
            normal_end + (self.normal - normal_end) * decay,
        )

    def time_step(self, step: FloatArray, drag: FloatArray) -> FloatArray:
        """A time step: longer than the given one where a grain sinks at its speed."""
        sinks = (self.normal < 0) & (drag * step > 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            to_bed = self.height / -self.normal
        return np.where(sinks, np.maximum(step, to_bed / SINKING_STEPS), step)

    def part_at_bed(self, end: "_Motion", time: FloatArray) -> FloatArray:
        """Part of a time step after which a grain that lands meets the bed.

        The height is taken as a parabola through start, initial speed and end.
        """
        slope = self.normal * time
        bend = end.height - self.height - slope
        root = np.sqrt(np.maximum(slope**2 - 4 * bend * self.height, 0))
        # of the two forms of the root each is right where the other loses its digits
        with np.errstate(divide="ignore", invalid="ignore"):
            rising = -(slope + root) / (2 * bend)
            falling = 2 * self.height / (root - slope)
        part = np.where(slope > 0, rising, falling)
        return np.asarray(np.clip(np.nan_to_num(part, nan=1.0), 0.0, 1.0))


def fate(
    grains: Grain,
    shields: ArrayLike,
    *,
    speed: ArrayLike | None = None,
    angle_deg: float = LAUNCH_DEG,
    gust: Gust = CALM,
    rebound: Rebound = BEADS,
    steps: int = STEPS,
) -> IntArray:
    """Follow grains over their beds and say what becomes of each.

    A grain goes on when, after the gust, its hops grow or stay as they are, or when it
    has made `MOST_HOPS` of them.

    Parameters
    ----------
    grains
        The grains.
    shields
        Shields number of the mean flow.
    speed
        Speed at which the grains leave the bed, sqrt(g' d); by default that of grains
        that have just left their pockets.
    angle_deg
        Angle at which they leave it, degrees.
    gust
        The gust, which begins when they leave.
    rebound
        What happens where a grain meets the bed.
    steps
        Time steps of a hop.

    Returns
    -------
    IntArray
        For each grain `STOPS`, `GOES_ON` or `ENDLESS`, shape (n,).

    Examples
    --------
    >>> sand = Grain.of_numbers(127.0, 2.65)  # 1 mm in water
    >>> print(fate(sand, 0.01), fate(sand, 0.1))
    [0] [1]
    """
    count = len(grains)
    theta = np.broadcast_to(np.asarray(shields, float), count)
    flow = _Flow(grains, theta, gust, rebound)
    if speed is None:
        speed = np.sqrt(2 * EXCESS * flow.trapped)
    launch = np.broadcast_to(np.asarray(speed, float), count)
    angle = np.radians(angle_deg)
    start = _Motion(np.zeros(count), launch * np.cos(angle), launch * np.sin(angle))
    hopping = _Hopping(flow, start, steps)
    found = np.full(count, ENDLESS)
    for _ in range(MOST_STEPS):
        lands, impact = hopping.fly()
        if not lands.any():
            continue
        is_trapped, goes_on = hopping.bounce(lands, impact, rebound)
        found[hopping.place[is_trapped]] = STOPS
        found[hopping.place[goes_on]] = GOES_ON
        is_left = ~(is_trapped | goes_on)
        if not is_left.any():
            break
        hopping.keep(is_left)
    return found


class _Hopping:
    """Grains that are neither trapped nor known to go on, arrays of shape (n,).

    Their `place` among all, their `motion`, the time on the `clock` since they left,
    the time `step` of their hop, the number of their `hops` after the gust, how many of
    these in a row are `alike`, and the `last` speeds along the bed and off it.
    """

    def __init__(self, flow: _Flow, start: _Motion, steps: int) -> None:
        """Begin with grains that leave the bed; a hop in vacuum takes some steps."""
        count = len(start.height)
        self.flow = flow
        self.steps = steps
        self.motion = start
        self.place = np.arange(count)
        self.clock = np.zeros(count)
        self.step = self._step(start.normal)
        self.hops = np.zeros(count)
        self.alike = np.zeros(count)
        self.last_along = np.zeros(count)
        self.last_normal = np.zeros(count)

    def _step(self, normal: FloatArray) -> FloatArray:
        """The time step of a hop that begins with a speed off the bed."""
        return 2 * normal / self.flow.normal / self.steps

    def fly(self) -> tuple[BoolArray, _Motion]:
        """Go on by a time step: which grains land, and how they meet the bed then."""
        flow = self.flow
        start = self.motion
        in_gust = self.clock < flow.gust_end
        ustar = np.where(in_gust, flow.peak_ustar, flow.ustar)
        # a step ends where the gust does
        left = np.where(in_gust, flow.gust_end - self.clock, np.inf)
        pull = flow.pull(*start, ustar)
        time = np.minimum(start.time_step(self.step, pull.drag), left)
        middle = start.later(pull, time / 2)
        end = start.later(flow.pull(*middle, ustar), time)
        self.motion = end
        self.clock = self.clock + time
        lands = end.height < 0
        if not lands.any():
            return lands, end
        part = start.part_at_bed(end, time)
        self.clock = np.where(lands, self.clock - (1 - part) * time, self.clock)
        along = start.along + part * (end.along - start.along)
        normal = start.normal + part * (end.normal - start.normal)
        return lands, _Motion(np.zeros(len(part)), along, normal)

    def bounce(
        self,
        lands: BoolArray,
        impact: _Motion,
        rebound: Rebound,
    ) -> tuple[BoolArray, BoolArray]:
        """Rebound those that land: which of them are trapped, and which go on."""
        speed = np.hypot(impact.along, impact.normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            sine = np.clip(np.nan_to_num(-impact.normal / speed), 0.0, 1.0)
        whole, up = rebound.after(speed, sine)
        on = np.sqrt(whole**2 - up**2) * np.sign(impact.along)
        flying = self.motion
        self.motion = _Motion(
            np.where(lands, 0.0, flying.height),
            np.where(lands, on, flying.along),
            np.where(lands, up, flying.normal),
        )
        self.step = np.where(lands, self._step(up), self.step)
        is_trapped = lands & ((whole**2 / 2 < self.flow.trapped) | (on < 0))
        after_gust = lands & (self.clock >= self.flow.gust_end)
        self._count(after_gust, on, up)
        is_steady = (self.alike > ALIKE) | (self.hops >= MOST_HOPS)
        return is_trapped, after_gust & ~is_trapped & is_steady

    def _count(self, ends: BoolArray, along: FloatArray, normal: FloatArray) -> None:
        """Count the hops that have ended, and those no weaker than the one before."""
        is_as_far = along >= self.last_along * (1 - SETTLED)
        is_as_high = normal >= self.last_normal * (1 - SETTLED)
        in_a_row = np.where(is_as_far & is_as_high, self.alike + 1, 0)
        self.alike = np.where(ends, in_a_row, self.alike)
        self.last_along = np.where(ends, along, self.last_along)
        self.last_normal = np.where(ends, normal, self.last_normal)
        self.hops = self.hops + ends

    def keep(self, mask: BoolArray) -> None:
        """Keep some of the grains."""
        if mask.all():
            return
        self.flow.keep(mask)
        self.motion = _Motion(*[each[mask] for each in self.motion])
        self.place = self.place[mask]
        self.clock = self.clock[mask]
        self.step = self.step[mask]
        self.hops = self.hops[mask]
        self.alike = self.alike[mask]
        self.last_along = self.last_along[mask]
        self.last_normal = self.last_normal[mask]


@dataclass(frozen=True, eq=False)
class HoppingThresholds:
    """Shields numbers of the mean flow in which grains hop on, arrays of shape (n,).

    A threshold of 0 lies below `LEAST`: such grains go on in any flow. Infinite is one
    that no flow up to `MOST` reaches, NaN one that is not known, since trajectories do
    not end.

    Attributes
    ----------
    steady
        A grain that has just left its pocket goes on in a flow without gusts.
    cessation
        A grain that hops already goes on: below it, motion ceases.
    """

    steady: FloatArray
    cessation: FloatArray


FAST = 10.0
"""Height, d, whose mean speed a grain has from which motion is to cease."""
GRAZING_DEG = 20.0
"""Angle at which such a grain leaves the bed, degrees: that of a grazing rebound."""


def thresholds(
    grains: Grain,
    *,
    rebound: Rebound = BEADS,
    steps: int = STEPS,
) -> HoppingThresholds:
    """Find the thresholds of grains in sustained motion, steady and of cessation.

    Parameters
    ----------
    grains
        The grains.
    rebound
        What happens where a grain meets the bed.
    steps
        Time steps of a hop.

    Returns
    -------
    HoppingThresholds
        The thresholds, arrays of shape (n,).

    Examples
    --------
    1 mm in water, and 0.25 mm in air:

    >>> sand = Grain.of_numbers([127.0, 38.8], [2.65, 2208.0])
    >>> print(thresholds(sand).cessation.round(4))
    [0.0327 0.0057]
    """

    def from_pocket(part: Grain, shields: FloatArray) -> IntArray:
        return fate(part, shields, rebound=rebound, steps=steps)

    ceasing = cessation_thresholds(grains, rebound=rebound, steps=steps)
    return HoppingThresholds(least(grains, from_pocket), ceasing)


def cessation_thresholds(
    grains: Grain, *, rebound: Rebound = BEADS, steps: int = STEPS
) -> FloatArray:
    """Find the thresholds at which grains in motion stop, without those of starting.

    Parameters
    ----------
    grains
        The grains.
    rebound
        What happens where a grain meets the bed.
    steps
        Time steps of a hop.

    Returns
    -------
    FloatArray
        Shields numbers, shape (n,), as in `HoppingThresholds`.

    Examples
    --------
    >>> print(cessation_thresholds(Grain.of_numbers(127.0, 2.65)).round(4))
    [0.0327]
    """

    def from_motion(part: Grain, shields: FloatArray) -> IntArray:
        return fate(
            part,
            shields,
            speed=_fast(part, shields),
            angle_deg=GRAZING_DEG,
            rebound=rebound,
            steps=steps,
        )

    return least(grains, from_motion)


def under_gust(
    grains: Grain,
    peak: float,
    duration: float,
) -> FloatArray:
    """Find the thresholds at which a grain goes on after a gust of a given duration.

    Parameters
    ----------
    grains
        The grains.
    peak
        Stress of the gust over that of the mean flow.
    duration
        How long the gust lasts, sqrt(d/g').

    Returns
    -------
    FloatArray
        Shields numbers of the mean flow, shape (n,), as in `HoppingThresholds`.

    Examples
    --------
    >>> sand = Grain.of_numbers(38.8, 2208.0)  # 0.25 mm in air
    >>> print(under_gust(sand, peak=2.28, duration=10.0).round(3))
    [0.015]
    """
    gust = Gust(peak, duration)
    return least(grains, lambda g, theta: fate(g, theta, gust=gust))


def _fast(grains: Grain, shields: FloatArray) -> FloatArray:
    """Speed of the fluid at a height of `FAST`, sqrt(g' d)."""
    unit = np.sqrt(shields) * grains.galileo
    profile = velocity.law_of_the_wall(
        FAST * unit,
        SAND_GRAIN * grains.ratio * unit,
    )
    return np.asarray(np.sqrt(grains.density_ratio * shields) * profile)


def least(
    grains: Grain,
    become: Callable[[Grain, FloatArray], IntArray],
) -> FloatArray:
    """Find the least Shields number at which each grain goes on, by bisection.

    Parameters
    ----------
    grains
        The grains.
    become
        What becomes of grains under Shields numbers, such as `fate`.

    Returns
    -------
    FloatArray
        Shields numbers, shape (n,): 0 where the least, `LEAST`, is enough, infinite
        where the largest, `MOST`, is too small, NaN, not known, where a trajectory does
        not end.

    Examples
    --------
    >>> print(least(Grain.of_numbers(127.0, 2.65), fate).round(4))  # 1 mm in water
    [0.0327]
    """
    count = len(grains)
    low = np.full(count, np.log(LEAST))
    high = np.full(count, np.log(MOST))
    at_ends = [become(grains, np.exp(end)) for end in (low, high)]
    is_ended = (at_ends[0] != ENDLESS) & (at_ends[1] != ENDLESS)
    is_between = (at_ends[0] == STOPS) & (at_ends[1] == GOES_ON)
    for _ in range(HALVINGS):
        places = np.flatnonzero(is_between & is_ended)
        if not len(places):
            break
        middle = (low[places] + high[places]) / 2
        found = become(grains.at(places), np.exp(middle))
        goes_on = found == GOES_ON
        low[places] = np.where(goes_on, low[places], middle)
        high[places] = np.where(goes_on, middle, high[places])
        is_ended[places] &= found != ENDLESS
    shields = np.where(is_between, np.exp((low + high) / 2), np.nan)
    shields[at_ends[1] == STOPS] = np.inf
    shields[~is_ended] = np.nan
    shields[at_ends[0] == GOES_ON] = 0.0
    return shields
