"""Grains that go on: when a grain that has left its pocket keeps hopping over the bed.

A grain hops over a bed of equal grains, under a flow with the profile
`velocity.law_of_the_wall`: the drag acts on its speed relative to the fluid, the added
mass slows it, gravity is tilted by the slope of the bed. Where it meets the bed it
rebounds by a `Rebound` law, which is that of many rebounds in the mean; a grain that
rebounds with less energy than it needs to leave a pocket is trapped.

All quantities are in units of the diameter d, of ``g' = (1 - rho_f/rho_sol) g`` and of
the mass of the grain. A grain is then its Galileo number Ga = sqrt((s - 1) g d^3)/nu
and its density ratio s = rho_sol/rho_f. The friction velocity is ``sqrt(s theta)``
with the Shields number theta, the viscosity ``sqrt(s)/Ga``.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics import velocity
from orchestrator.physics.constants import GRAVITY
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.laws import CLIFT_GAUVIN, SAND_GRAIN
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
        Energy below which the grain stays where it is, in weights times diameters.
    level
        Height of the centre of a grain on the bed above the zero level of the flow, d.

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


@dataclass(frozen=True, init=False, eq=False)
class Grains:
    """Grains, their fluid and their bed, without dimensions.

    Parameters
    ----------
    galileo
        Galileo number sqrt((s - 1) g d^3)/nu.
    density_ratio
        Density of the grain over that of the fluid, s.
    slope_deg
        Slope of the bed, degrees, positive where the flow goes up it.
    roughness
        Roughness length of the bed over the diameter, z0/d.

    Examples
    --------
    >>> sand = Grains.of(2e-4, density=2650.0, fluid_density=1.2, viscosity=1.5e-5)
    >>> print(sand.galileo.round(2), sand.density_ratio.round(1))
    [27.75] [2208.3]
    """

    galileo: FloatArray
    density_ratio: FloatArray
    slope_deg: FloatArray
    roughness: FloatArray

    def __init__(
        self,
        galileo: ArrayLike,
        density_ratio: ArrayLike,
        slope_deg: ArrayLike = 0.0,
        roughness: ArrayLike = 1 / SAND_GRAIN,
    ) -> None:
        given = np.broadcast_arrays(galileo, density_ratio, slope_deg, roughness)
        flat = [np.ravel(array).astype(float) for array in given]
        names = ("galileo", "density_ratio", "slope_deg", "roughness")
        for name, array in zip(names, flat, strict=True):
            # the dataclass is frozen
            object.__setattr__(self, name, array)

    @classmethod
    def of(
        cls,
        diameter: ArrayLike,
        *,
        density: ArrayLike,
        fluid_density: ArrayLike,
        viscosity: ArrayLike,
        slope_deg: ArrayLike = 0.0,
        roughness: ArrayLike | None = None,
        gravity: ArrayLike = GRAVITY,
    ) -> Self:
        """Make the numbers of grains of given sizes.

        Parameters
        ----------
        diameter
            Diameter of the grain, m.
        density, fluid_density
            Densities of the grain and of the fluid, kg/m3.
        viscosity
            Kinematic viscosity of the fluid, m2/s.
        slope_deg
            Slope of the bed, degrees.
        roughness
            Roughness length of the bed, m; by default d/30.
        gravity
            Acceleration of gravity, m/s2.

        Returns
        -------
        Grains
            Their numbers, of the broadcast shape, raveled.
        """
        d = np.asarray(diameter, float)
        ratio = np.asarray(density, float) / np.asarray(fluid_density, float)
        excess = (ratio - 1) * np.asarray(gravity, float)
        galileo = np.sqrt(excess * d**3) / np.asarray(viscosity, float)
        z0 = d / SAND_GRAIN if roughness is None else np.asarray(roughness, float)
        return cls(galileo, ratio, slope_deg, z0 / d)

    def __len__(self) -> int:
        """Number of grains."""
        return len(self.galileo)

    def at(self, places: IntArray | BoolArray) -> "Grains":
        """Pick some of the grains.

        Parameters
        ----------
        places
            Their places, or a mask.

        Returns
        -------
        Grains
            These grains.
        """
        return Grains(
            self.galileo[places],
            self.density_ratio[places],
            self.slope_deg[places],
            self.roughness[places],
        )


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
PEAK = peak_over_mean(0.4, 100)
"""Stress of the gust that decides, over that of the mean flow: 2.28.

It is the largest of 100 independent stresses of intensity 0.4.
"""
STOPS, GOES_ON, ENDLESS = 0, 1, 2
"""What becomes of a grain: it is trapped, goes on, or its trajectory does not end."""


class _Flow:
    """Constant quantities of some grains under their flows, arrays of shape (n,)."""

    def __init__(
        self,
        grains: Grains,
        shields: FloatArray,
        gust: "Gust",
        level: float,
    ) -> None:
        """Make them for Shields numbers, and a height of grains over the zero level."""
        s = grains.density_ratio
        inertia = s / (s + ADDED_MASS)
        slope = np.radians(grains.slope_deg)
        self.level = level
        self.viscosity = np.sqrt(s) / grains.galileo
        self.ustar = np.sqrt(s * shields)
        self.peak_ustar = self.ustar * np.sqrt(gust.peak)
        self.gust_end = np.broadcast_to(np.asarray(gust.duration, float), s.shape)
        self.along = -np.sin(slope) * inertia
        self.normal = np.cos(slope) * inertia
        # Stokes' drag over mass and relative speed
        self.stokes = 18 * self.viscosity / (s + ADDED_MASS)
        self.sand_grain = SAND_GRAIN * grains.roughness

    def keep(self, mask: BoolArray) -> None:
        """Keep some of the grains."""
        for name, value in vars(self).items():
            if name != "level":
                setattr(self, name, value[mask])

    def pull(
        self,
        height: FloatArray,
        along: FloatArray,
        normal: FloatArray,
        ustar: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """The fluid's speed at some heights, and drag over mass and relative speed.

        `along` and `normal` are the speeds of the grains.
        """
        unit = ustar / self.viscosity
        above = (np.maximum(height, 0) + self.level) * unit
        speed = ustar * velocity.law_of_the_wall(above, self.sand_grain * unit)
        reynolds = np.hypot(speed - along, normal) / self.viscosity
        return speed, self.stokes * CLIFT_GAUVIN.factor(reynolds)


class _Motion(NamedTuple):
    """Height and speeds of some grains, arrays of shape (n,)."""

    height: FloatArray
    along: FloatArray
    normal: FloatArray

    def later(
        self,
        flow: _Flow,
        fluid: FloatArray,
        pull: FloatArray,
        time: FloatArray,
    ) -> "_Motion":
        """The motion after a time under a constant linear drag: exact for such a drag.

        `fluid` is the fluid's speed, `pull` the drag over mass and relative speed.
        """
        decay = np.exp(-pull * time)
        reach = -np.expm1(-pull * time) / pull
        along_end = fluid + flow.along / pull
        normal_end = -flow.normal / pull
        return _Motion(
            self.height + normal_end * time + (self.normal - normal_end) * reach,
            along_end + (self.along - along_end) * decay,
            normal_end + (self.normal - normal_end) * decay,
        )

    def time_step(self, step: FloatArray, pull: FloatArray) -> FloatArray:
        """A time step: longer than the given one where a grain sinks at its speed."""
        sinks = (self.normal < 0) & (pull * step > 1)
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
    grains: Grains,
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
    >>> sand = Grains(127.0, 2.65)  # 1 mm in water
    >>> print(fate(sand, 0.01), fate(sand, 0.1))
    [0] [1]
    """
    count = len(grains)
    theta = np.broadcast_to(np.asarray(shields, float), count)
    if speed is None:
        speed = np.sqrt(2 * EXCESS * rebound.trapped)
    flow = _Flow(grains, theta, gust, rebound.level)
    launch = np.broadcast_to(np.asarray(speed, float), count)
    angle = np.radians(angle_deg)
    motion = _Motion(np.zeros(count), launch * np.cos(angle), launch * np.sin(angle))
    found = np.full(count, ENDLESS)
    place = np.arange(count)
    clock = np.zeros(count)
    step = 2 * motion.normal / flow.normal / steps
    hops = np.zeros(count)
    alike = np.zeros(count)
    # speeds after the rebound before, along and normal to the bed
    last = np.zeros((2, count))
    for _ in range(MOST_STEPS):
        in_gust = clock < flow.gust_end
        ustar = np.where(in_gust, flow.peak_ustar, flow.ustar)
        # a step ends where the gust does
        left = np.where(in_gust, flow.gust_end - clock, np.inf)
        fluid, pull = flow.pull(*motion, ustar)
        time = np.minimum(motion.time_step(step, pull), left)
        middle = motion.later(flow, fluid, pull, time / 2)
        fluid, pull = flow.pull(*middle, ustar)
        end = motion.later(flow, fluid, pull, time)
        clock = clock + time
        lands = end.height < 0
        if not lands.any():
            motion = end
            continue
        part = motion.part_at_bed(end, time)
        clock = np.where(lands, clock - (1 - part) * time, clock)
        along = motion.along + part * (end.along - motion.along)
        normal = motion.normal + part * (end.normal - motion.normal)
        impact = np.hypot(along, normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            sine = np.clip(np.nan_to_num(-normal / impact), 0.0, 1.0)
        whole, up = rebound.after(impact, sine)
        on = np.sqrt(whole**2 - up**2) * np.sign(along)
        is_trapped = lands & ((whole**2 / 2 < rebound.trapped) | (on < 0))
        after_gust = lands & (clock >= flow.gust_end)
        now = np.array([on, up])
        is_no_weaker = np.all(now >= last * (1 - SETTLED), axis=0)
        in_a_row = np.where(is_no_weaker, alike + 1, 0)
        alike = np.where(after_gust, in_a_row, alike)
        last = np.where(after_gust, now, last)
        hops = hops + after_gust
        goes_on = after_gust & ~is_trapped & ((alike > ALIKE) | (hops >= MOST_HOPS))
        found[place[is_trapped]] = STOPS
        found[place[goes_on]] = GOES_ON
        motion = _Motion(
            np.where(lands, 0.0, end.height),
            np.where(lands, on, end.along),
            np.where(lands, up, end.normal),
        )
        step = np.where(lands, 2 * up / flow.normal / steps, step)
        is_left = ~(is_trapped | goes_on)
        if is_left.all():
            continue
        if not is_left.any():
            break
        flow.keep(is_left)
        motion = _Motion(*[each[is_left] for each in motion])
        place, clock, step = place[is_left], clock[is_left], step[is_left]
        hops, alike, last = hops[is_left], alike[is_left], last[:, is_left]
    return found


@dataclass(frozen=True, eq=False)
class Thresholds:
    """Shields numbers of the mean flow at which grains go on, arrays of shape (n,).

    Infinite is a threshold that no flow up to `MOST` reaches, NaN one whose
    trajectories do not end, or that lies below `LEAST`.

    Attributes
    ----------
    steady
        A grain that has just left its pocket goes on in a flow without gusts.
    cessation
        A grain that hops already goes on: below it, motion ceases.
    """

    steady: FloatArray
    cessation: FloatArray

    def initiation(self, peak: ArrayLike = 1.0) -> FloatArray:
        """Compute the thresholds at which a gust starts motion that goes on after it.

        The gust lasts longer than the grain needs to gain its speed. The mean stress is
        then the least at which the gust's stress reaches the steady threshold, and the
        mean flow keeps the grain in motion afterwards.

        Parameters
        ----------
        peak
            Stress of the gust over that of the mean flow.

        Returns
        -------
        FloatArray
            Shields numbers of the mean flow, of the broadcast shape.

        Examples
        --------
        >>> of_air = Thresholds(steady=np.array([0.025]), cessation=np.array([0.006]))
        >>> print(of_air.initiation([1.0, 2.5, 10.0]))
        [0.025 0.01  0.006]
        """
        return np.asarray(np.maximum(self.steady / np.asarray(peak), self.cessation))


FAST = 10.0
"""Height, d, whose mean speed a grain has from which motion is to cease."""
GRAZING_DEG = 20.0
"""Angle at which such a grain leaves the bed, degrees: that of a grazing rebound."""


def thresholds(
    grains: Grains,
    *,
    rebound: Rebound = BEADS,
    steps: int = STEPS,
) -> Thresholds:
    """Find the thresholds of grains that go on, steady and of cessation.

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
    Thresholds
        The thresholds, arrays of shape (n,).

    Examples
    --------
    >>> sand = Grains([127.0, 38.8], [2.65, 2208.0])  # 1 mm in water, 0.25 mm in air
    >>> print(thresholds(sand).cessation.round(4))
    [0.0327 0.0057]
    """

    def from_pocket(part: Grains, shields: FloatArray) -> IntArray:
        return fate(part, shields, rebound=rebound, steps=steps)

    def from_motion(part: Grains, shields: FloatArray) -> IntArray:
        return fate(
            part,
            shields,
            speed=_fast(part, shields),
            angle_deg=GRAZING_DEG,
            rebound=rebound,
            steps=steps,
        )

    return Thresholds(least(grains, from_pocket), least(grains, from_motion))


def under_gust(
    grains: Grains,
    peak: float,
    duration: float,
    *,
    rebound: Rebound = BEADS,
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
    rebound
        What happens where a grain meets the bed.

    Returns
    -------
    FloatArray
        Shields numbers of the mean flow, shape (n,), as in `Thresholds`.

    Examples
    --------
    >>> sand = Grains(38.8, 2208.0)  # 0.25 mm in air
    >>> print(under_gust(sand, peak=2.28, duration=10.0).round(3))
    [0.015]
    """
    gust = Gust(peak, duration)
    return least(grains, lambda g, theta: fate(g, theta, gust=gust, rebound=rebound))


def _fast(grains: Grains, shields: FloatArray) -> FloatArray:
    """Speed of the fluid at a height of `FAST`, sqrt(g' d)."""
    unit = np.sqrt(shields) * grains.galileo
    profile = velocity.law_of_the_wall(
        FAST * unit,
        SAND_GRAIN * grains.roughness * unit,
    )
    return np.asarray(np.sqrt(grains.density_ratio * shields) * profile)


def least(
    grains: Grains,
    become: Callable[[Grains, FloatArray], IntArray],
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
        Shields numbers, shape (n,): infinite where the largest, `MOST`, is too small,
        NaN where a trajectory does not end or the least, `LEAST`, is enough.

    Examples
    --------
    >>> print(least(Grains(127.0, 2.65), fate).round(4))  # 1 mm in water
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
    return shields


TABLE = Path(__file__).with_name("saltation.csv")
"""Thresholds on beds with z0 = d/30 at nodes, made by ``tools/saltation.py``."""
GALILEO_NODES = np.geomspace(0.3, 1e5, 51)
DENSITY_NODES = np.geomspace(1.1, 1e5, 27)
SLOPE_NODES_DEG = np.linspace(-30.0, 30.0, 13)
"""Nodes of the table."""


def tabulated(grains: Grains) -> Thresholds:
    """Find the thresholds of grains from the table, or by `thresholds` where it ends.

    The thresholds are interpolated linearly: their logarithms over the logarithms of
    Galileo number and density ratio, themselves over the slope.

    Parameters
    ----------
    grains
        The grains, which rebound as `BEADS`.

    Returns
    -------
    Thresholds
        The thresholds, arrays of shape (n,).

    Examples
    --------
    >>> sand = Grains([127.0, 38.8], [2.65, 2208.0])  # 1 mm in water, 0.25 mm in air
    >>> print(tabulated(sand).steady.round(3))
    [0.033 0.028]
    """
    axes = (np.log(GALILEO_NODES), np.log(DENSITY_NODES), SLOPE_NODES_DEG)
    with np.errstate(divide="ignore", invalid="ignore"):
        places = np.log([grains.galileo, grains.density_ratio])
    points = (*places, grains.slope_deg)
    is_inside = np.isclose(grains.roughness * SAND_GRAIN, 1, rtol=1e-6, atol=0)
    corners = []
    for nodes, point in zip(axes, points, strict=True):
        is_inside &= (point >= nodes[0]) & (point <= nodes[-1])
        # NaN is no place: any interval does, since such a grain is not inside
        place = np.searchsorted(nodes, np.nan_to_num(point), side="right") - 1
        first = np.clip(place, 0, len(nodes) - 2)
        part = (point - nodes[first]) / (nodes[first + 1] - nodes[first])
        corners.append((first, part))
    found = np.full((2, len(grains)), np.nan)
    (galileo, over), (density, across), (slope, up) = corners
    at_slopes = []
    for steeper in (0, 1):
        sums = np.zeros_like(found)
        for further, denser in itertools.product((0, 1), (0, 1)):
            along = over if further else 1 - over
            weight = along * (across if denser else 1 - across)
            value = _table()[:, galileo + further, density + denser, slope + steeper]
            # an infinite or missing threshold counts only where it has a weight
            sums += np.where(weight > 0, weight * value, 0.0)
        at_slopes.append(np.exp(sums))
    gentle, steep = at_slopes
    with np.errstate(invalid="ignore"):
        rise = np.where(gentle == steep, 0.0, up * (steep - gentle))
        between = np.where(up > 0, gentle + rise, gentle)
    found[:, is_inside] = between[:, is_inside]
    outside = np.flatnonzero(~is_inside)
    if len(outside):
        beyond = thresholds(grains.at(outside))
        found[0, outside] = beyond.steady
        found[1, outside] = beyond.cessation
    return Thresholds(steady=found[0], cessation=found[1])


@cache
def _table() -> FloatArray:
    """Logarithms of both thresholds at the nodes: (2, Galileo, density, slope)."""
    shape = (len(GALILEO_NODES), len(DENSITY_NODES), len(SLOPE_NODES_DEG))
    both = np.loadtxt(TABLE, delimiter=",", skiprows=1, unpack=True)
    return np.log(both.reshape(2, *shape))
