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
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics import velocity
from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import CLIFT_GAUVIN
from orchestrator.types import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator

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


@dataclass(frozen=True)
class Rebound:
    """What happens in the mean where a grain meets a bed of equal grains.

    At an impact of speed v and angle a with the bed the grain leaves with the speed
    ``(whole[0] - whole[1] sin a) v``, of which ``(normal[0] - normal[1] sin a) v`` is
    normal to the bed.

    Attributes
    ----------
    whole, normal
        Coefficients of the speed, and of its part normal to the bed, over the speed of
        impact.
    trapped
        Energy below which a grain on its like stays where it is, in weights times
        diameters.
    level
        Height of its centre above the zero level of the flow, d.

    Examples
    --------
    >>> speed, normal = BEADS.after(np.array([1.0, 1.0]), np.array([0.0, 0.5]))
    >>> print(speed, normal)
    [0.87 0.51] [0.3   0.225]
    """

    whole: tuple[float, float]
    normal: tuple[float, float]
    trapped: float
    level: float

    def after(
        self,
        speed: FloatArray,
        sine: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Compute the speed after a rebound, and its part normal to the bed.

        Parameters
        ----------
        speed
            Speed of the impact.
        sine
            Sine of the angle of the impact with the bed.

        Returns
        -------
        whole, normal
            Speeds of the broadcast shape; neither is negative, and the part is not
            larger than the whole.
        """
        whole = np.maximum(self.whole[0] - self.whole[1] * sine, 0) * speed
        normal = np.maximum(self.normal[0] - self.normal[1] * sine, 0) * speed
        return whole, np.minimum(normal, whole)

    def on(self, relative_size: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute what traps grains on a bed of others, and how high they lie on it.

        Both change as `on_layer` says from those of a grain on its like. The rebound
        itself is taken to be alike: no measurement of unlike grains is known.

        Parameters
        ----------
        relative_size
            Diameter of each grain over that of the grains of its bed.

        Returns
        -------
        trapped, level
            Energy below which each stays, in its weights times diameters, and height of
            its centre above the zero level, in its diameters; of the same shape.

        Examples
        --------
        >>> trapped, level = BEADS.on(np.array([0.5, 1.0, 2.0]))
        >>> print(trapped.round(3), level.round(3))
        [0.362 0.12  0.037] [0.724 0.7   0.634]
        """
        rest, barrier = on_layer(relative_size)
        of_like, barrier_of_like = on_layer(np.array(1.0))
        trapped = self.trapped * (barrier / barrier_of_like)
        level = (self.level + (rest - of_like)) / relative_size
        return trapped, np.maximum(level, 0.0)


def on_layer(relative_size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute where grains lie on a close-packed layer of others, and what holds them.

    A sphere of D on three of K lies ``sqrt((D + K)^2/4 - K^2/3)`` above their centres.
    On its way out it rises to between the saddle of two, ``sqrt((D + K)^2/4 - K^2/4)``,
    and the top of one, ``(D + K)/2``; the mean of both is taken.

    Parameters
    ----------
    relative_size
        Diameter of each grain over that of the layer's, D/K.

    Returns
    -------
    rest, barrier
        Height of its centre at rest above those of the layer, in K, and how much higher
        it must rise, in D; of the same shape.

    Examples
    --------
    >>> rest, barrier = on_layer(np.array(1.0))
    >>> print(rest.round(4), barrier.round(4))
    0.8165 0.1165
    """
    reach = (relative_size + 1) / 2
    rest = np.sqrt(np.maximum(reach**2 - 1 / 3, 0.0))
    saddle = np.sqrt(np.maximum(reach**2 - 1 / 4, 0.0))
    return np.asarray(rest), np.asarray(((saddle + reach) / 2 - rest) / relative_size)


BEADS = Rebound(whole=(0.87, 0.72), normal=(0.30, 0.15), trapped=0.12, level=0.7)
"""Beads of plastic shot at a bed of the same beads.

M. Beladjine, M. Ammi, L. Oger and A. Valance, Phys. Rev. E 75, 2007. Two public codes
quote its table of angles and speeds, which the law meets within 0.04.
"""

SIMULATED = {
    0.9: Rebound(whole=(0.717, 0.484), normal=(0.293, 0.187), trapped=0.12, level=0.7),
    0.55: Rebound(whole=(0.692, 0.506), normal=(0.252, 0.187), trapped=0.12, level=0.7),
    0.25: Rebound(whole=(0.682, 0.527), normal=(0.225, 0.178), trapped=0.12, level=0.7),
}
"""Spheres thrown at poured beds of the same spheres by LIGGGHTS, by restitution.

The friction coefficient is 0.5. The shots are in ``docs/measured/rebounds.csv``, made
by ``tools/rebound.py``. Nothing takes these laws by default: they say how much hangs on
the rebound.
"""


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


TABLE = Path(__file__).with_name("saltation.csv")
"""Thresholds on beds with z0 = d/30 at nodes, made by ``tools/saltation.py``."""
GALILEO_NODES = np.geomspace(0.3, 1e5, 51)
DENSITY_NODES = np.geomspace(1.1, 1e5, 27)
SLOPE_NODES_DEG = np.linspace(-30.0, 30.0, 13)
"""Nodes of the table."""


ROUGHNESS_TABLE = Path(__file__).with_name("saltation_roughness.csv")
"""Thresholds of cessation on level beds of other roughness, by the same tool."""
OTHER_GALILEO_NODES = np.geomspace(0.3, 1e5, 26)
OTHER_DENSITY_NODES = np.array(
    [1.1, 1.3, 1.6, 2.0, 2.65, 4, 8, 20, 60, 200, 700, 2200, 7000, 2.5e4, 1e5]
)
RATIO_NODES = np.concatenate(
    [np.geomspace(1e-3, 0.01, 5), np.geomspace(0.01, 0.1, 10)[1:]]
)
"""Nodes of that table; the last are of z0/d."""


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


def cessation(grains: Grain) -> FloatArray:
    """Find the thresholds of cessation, also on beds of another roughness, at once.

    That of z0 = d/30 is the table's. On others it has the factor of a level bed of that
    roughness, which is interpolated in logarithms of Galileo number, density ratio and
    z0/d. Of 230 grains at random on level beds this differs from `thresholds` by 0.1 %
    in the median, by 1.2 % or less for 95 % and by 7.5 % at most; of 85 on slopes by 4
    % or less for 95 %, and by 11 % at most. Beyond the tables trajectories are
    followed.

    Parameters
    ----------
    grains
        The grains.

    Returns
    -------
    FloatArray
        Shields numbers, shape (n,), as in `HoppingThresholds`.

    Examples
    --------
    >>> sand = Grain.of_numbers(127.0, 2.65, ratio=[1 / 30, 1 / 10])
    >>> print(cessation(sand).round(3))
    [0.033 0.08 ]
    """
    usual = grains.changed(roughness=grains.diameter / SAND_GRAIN)
    points = np.log([grains.galileo, grains.density_ratio, grains.ratio])
    ends = np.array([[axis[0], axis[-1]] for axis in _OTHER_AXES])
    is_inside = is_tabulated(usual)
    is_inside &= ((points >= ends[:, :1]) & (points <= ends[:, 1:])).all(axis=0)
    found = np.full(len(grains), np.nan)
    inside = np.flatnonzero(is_inside)
    if len(inside):
        of_table = _other_table()
        here = points[:, inside].T
        on_usual = here.copy()
        on_usual[:, 2] = -np.log(SAND_GRAIN)
        factor = np.exp(of_table(here) - of_table(on_usual))
        found[inside] = tabulated(usual.at(inside)).cessation * factor
    outside = np.flatnonzero(~is_inside)
    if len(outside):
        found[outside] = tabulated(grains.at(outside)).cessation
    return found


_OTHER_AXES = (
    np.log(OTHER_GALILEO_NODES),
    np.log(OTHER_DENSITY_NODES),
    np.log(RATIO_NODES),
)


@cache
def _other_table() -> "RegularGridInterpolator":
    """Logarithms of the thresholds of cessation on level beds of other roughness."""
    from scipy.interpolate import RegularGridInterpolator  # slow to import

    numbers = np.loadtxt(ROUGHNESS_TABLE, skiprows=1)
    shape = [len(axis) for axis in _OTHER_AXES]
    return RegularGridInterpolator(_OTHER_AXES, np.log(numbers).reshape(shape))


def tabulated(grains: Grain) -> HoppingThresholds:
    """Find the thresholds of grains from the table, or by `thresholds` where it ends.

    The thresholds are interpolated linearly: their logarithms over the logarithms of
    Galileo number and density ratio, themselves over the slope.

    Parameters
    ----------
    grains
        The grains, which rebound as `BEADS`.

    Returns
    -------
    HoppingThresholds
        The thresholds, arrays of shape (n,).

    Examples
    --------
    1 mm in water, and 0.25 mm in air:

    >>> sand = Grain.of_numbers([127.0, 38.8], [2.65, 2208.0])
    >>> print(tabulated(sand).steady.round(3))
    [0.033 0.028]
    """
    is_inside = is_tabulated(grains)
    found = np.full((2, len(grains)), np.nan)
    found[:, is_inside] = _interpolated(grains.at(is_inside))
    outside = np.flatnonzero(~is_inside)
    if len(outside):
        beyond = _beyond_table(grains.at(outside))
        found[0, outside] = beyond.steady
        found[1, outside] = beyond.cessation
    return HoppingThresholds(steady=found[0], cessation=found[1])


_AXES = (np.log(GALILEO_NODES), np.log(DENSITY_NODES), SLOPE_NODES_DEG)
"""Axes of the table, in which it is linear."""


def _points(grains: Grain) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The places of grains on the axes of the table; NaN where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        galileo = np.log(grains.galileo)
        density = np.log(grains.density_ratio)
    return galileo, density, grains.slope_deg


def is_tabulated(grains: Grain) -> BoolArray:
    """Tell whether the table holds each grain: its bed, its flow and its place.

    Parameters
    ----------
    grains
        The grains.

    Returns
    -------
    ndarray
        Truth values, shape (n,); others take a second for each few grains.

    Examples
    --------
    >>> print(is_tabulated(Grain.of_numbers(38.8, 2208.0, ratio=[1 / 30, 0.1])))
    [ True False]
    """
    is_inside = np.isclose(grains.ratio * SAND_GRAIN, 1, rtol=1e-6, atol=0)
    is_inside &= (grains.fall <= 0) & (grains.relative_size == 1)
    for nodes, point in zip(_AXES, _points(grains), strict=True):
        is_inside &= (point >= nodes[0]) & (point <= nodes[-1])
    return is_inside


def _interpolated(grains: Grain) -> FloatArray:
    """Thresholds of grains that the table holds, of shape (2, n)."""
    galileo, density, slope = _points(grains)
    below = np.searchsorted(SLOPE_NODES_DEG, slope, side="right") - 1
    below = np.minimum(below, len(SLOPE_NODES_DEG) - 2)
    ends = SLOPE_NODES_DEG[below], SLOPE_NODES_DEG[below + 1]
    table = _table()
    gentle, steep = (np.exp(table((galileo, density, end))).T for end in ends)
    part = (slope - ends[0]) / (ends[1] - ends[0])
    return np.asarray(gentle + part * (steep - gentle))


def _beyond_table(grains: Grain) -> HoppingThresholds:
    """The thresholds of grains that the table does not hold, of alike ones once."""
    numbers = (
        grains.galileo,
        grains.density_ratio,
        grains.slope_deg,
        grains.ratio,
        grains.fall,
        grains.relative_size,
    )
    rows = [*zip(*(values.tolist() for values in numbers), strict=True)]
    unlike: dict[tuple[float, ...], int] = {}
    places = [unlike.setdefault(row, len(unlike)) for row in rows]
    found = _of_unlike(tuple(unlike))
    return HoppingThresholds(found.steady[places], found.cessation[places])


@lru_cache(maxsize=64)  # tables, cards and pictures ask for the same grains
def _of_unlike(rows: tuple[tuple[float, ...], ...]) -> HoppingThresholds:
    """The same of grains by the numbers of each."""
    galileo, density_ratio, slope_deg, ratio, fall, relative_size = np.array(rows).T
    grains = Grain.of_numbers(
        galileo,
        density_ratio,
        slope_deg=slope_deg,
        ratio=ratio,
        fall=fall,
        relative_size=relative_size,
    )
    return thresholds(grains)


LOG_OF_NOTHING = -1e300
"""Logarithm of a threshold of 0, which any part of makes one of 0."""


@cache
def _table() -> "RegularGridInterpolator":
    """Logarithms of the thresholds, steady and of cessation, on the table's axes."""
    from scipy.interpolate import RegularGridInterpolator  # slow to import

    both = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    with np.errstate(divide="ignore"):  # of 0, below `LEAST`
        logarithms = np.maximum(np.log(both), LOG_OF_NOTHING)
    shape = [len(nodes) for nodes in _AXES]
    return RegularGridInterpolator(_AXES, logarithms.reshape(*shape, 2))
