"""The table of sustained motion: one sphere that rolls and hops over poured beds.

python tools/rolling.py DIRECTORY

A sphere moves over the fixed spheres of a poured bed; docs/model.md, "Rolling and hopping as one motion", has
the equations, and each choice with its source and its effect. LIGGGHTS pours the beds in DIRECTORY, each
once; a C compiler makes the solver, ``rolling/roll.c``. Points of the plan that are not in `POINTS` are computed
one after the other and put there, in an hour of one core for all.

python tools/rolling.py

Without a DIRECTORY the tables of the program are made of the points: `TABLE`, smooth along the Galileo number,
and `FACTORS`.
"""

import ctypes
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import (
    PchipInterpolator,
    RegularGridInterpolator,
    UnivariateSpline,
)
from scipy.optimize import minimize
from scipy.special import expit

from orchestrator.bed.line import BedLine
from orchestrator.bed.poured import BED, PouredBed, joined
from orchestrator.physics import velocity
from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.physics.gusts import PEAK
from orchestrator.physics.laws import CLIFT_GAUVIN
from orchestrator.physics.rolling import COLUMNS, FACTORS, TABLE
from orchestrator.physics.saltation import LEAST, MOST
from orchestrator.runs import engine
from orchestrator.types import BoolArray, FloatArray, IntArray

SOURCE = Path(__file__).with_name("rolling") / "roll.c"
MEASURED = Path(__file__).parents[1] / "docs" / "measured"
POINTS = MEASURED / "rolling.csv"
"""A row for each point: the sphere, the Shields numbers of each share, and their errors."""
LENGTH, WIDTH, DEPTH = 48.0, 8.0, 5.0
"""Of a bed, d."""
CUT = 0.5 + 1 / SAND_GRAIN
"""Height over the level of a bed above which no centre lies, d: as of all poured beds."""
LAYERS = 3
"""Layers of a bed that a sphere may meet, or that the flow may reach."""
FRICTION_ANGLE_DEG = 35.0
"""Of the grains while they are poured."""
SEEDS = (1, 2, 3, 4, 5, 6)
FIRST = 30.0
"""Way downstream in the gust, d."""
WAYS = (10.0, 20.0, 40.0)
"""Ways downstream in the mean flow after it, d; the second is that of the threshold, the others are of its ends."""
PARTS = (0.25, 0.5, 0.75)
"""Parts of the spheres that come each; the second is that of the threshold."""
FRICTION = 0.5
STEP = 1.15
"""Ratio of the Shields numbers that are tried one after the other."""
MOST_TRIED = 24
FEW, MANY = 0.2, 0.8
"""Shares that the numbers that are tried reach beyond."""
USUAL_SLOPE = 8.0
"""A usual steepness of the share over the logarithm; it counts as much as one sphere."""
FLOOR = 0.3
"""Shields number of the mean flow, over that in whose gust half of the spheres come on, below which none is
tried: what it makes of the threshold takes a gust of 7.6 times the mean."""
HEIGHTS = np.append(np.arange(0.0, 6.0, 0.01), np.arange(6.0, 306.0, 0.5))
"""Heights over the zero level at which the solver has the speed of the fluid."""
KNEE = 600
"""Number of the first heights, which are 0.01 apart."""


class _Scene(ctypes.Structure):
    """What the solver calls ``Scene``."""

    _fields_ = (
        ("bed", ctypes.c_void_p),
        ("grains", ctypes.c_int),
        ("length", ctypes.c_double),
        ("width", ctypes.c_double),
        ("size", ctypes.c_double),
        ("ratio", ctypes.c_double),
        ("viscosity", ctypes.c_double),
        ("along", ctypes.c_double),
        ("normal", ctypes.c_double),
        ("fine", ctypes.c_double),
        ("coarse", ctypes.c_double),
        ("fine_count", ctypes.c_int),
        ("coarse_count", ctypes.c_int),
        ("depth", ctypes.c_double),
        ("friction", ctypes.c_double),
        ("restitution", ctypes.c_double),
        ("time_step", ctypes.c_double),
        ("look", ctypes.c_double),
        ("longest", ctypes.c_double),
        ("gust_time", ctypes.c_double),
        ("always", ctypes.c_int),
        ("columns", ctypes.c_int),
        ("rows", ctypes.c_int),
        ("first_of_column", ctypes.c_void_p),
        ("of_column", ctypes.c_void_p),
    )


@cache
def solver() -> Any:
    """Compile the solver, and load it."""
    with tempfile.TemporaryDirectory() as folder:
        compiled, library = Path(folder) / "roll.o", Path(folder) / "roll.so"
        fast = ["cc", "-O3", "-ffast-math", "-fPIC", "-c", "-o", compiled, SOURCE]
        subprocess.run(fast, check=True)
        # a library that is linked as fast, too, rounds the least numbers of the whole
        # process to 0 once it is loaded
        linked = ["cc", "-shared", "-o", library, compiled, "-lm"]
        subprocess.run(linked, check=True)
        return ctypes.CDLL(str(library))


@dataclass(frozen=True, eq=False)
class Bed:
    """A fixed bed whose ends and sides are one.

    Attributes
    ----------
    centres
        Centres of its grains, in diameters of the sphere, shape (n, 3).
    sides
        Length and width, in the same unit.
    sizes
        Diameters of its grains, in the same unit, shape (n,).
    seed
        Chooses the places at which spheres are laid on it.
    """

    centres: FloatArray
    sides: tuple[float, float]
    sizes: FloatArray
    seed: int

    def of_sphere(self, relative_size: float) -> "Bed":
        """The same bed in the unit of a sphere so much larger than its grains."""
        length, width = self.sides
        return Bed(
            np.ascontiguousarray(self.centres / relative_size),
            (length / relative_size, width / relative_size),
            self.sizes / relative_size,
            self.seed,
        )

    @cached_property
    def grains(self) -> FloatArray:
        """Its grains as the solver has them: centres and diameters, shape (n, 4)."""
        return np.column_stack([self.centres, self.sizes])

    @cached_property
    def columns(self) -> tuple[int, int, IntArray, IntArray]:
        """Numbers of columns of about 1 by 1, and the grains of each as the solver has them."""
        counts = np.maximum(np.array(self.sides).astype(int), 1)
        flat = self.centres[:, :2]
        place = np.floor(flat * counts / self.sides).astype(int) % counts
        cell = place[:, 0] * counts[1] + place[:, 1]
        order = np.argsort(cell, kind="stable")
        first = np.searchsorted(cell[order], np.arange(counts.prod() + 1))
        return int(counts[0]), int(counts[1]), first.astype("i4"), order.astype("i4")

    def places(self, count: int) -> FloatArray:
        """Places at which so many spheres are laid on it, shape (count, 2)."""
        random = np.random.default_rng(self.seed)
        return np.ascontiguousarray(random.uniform(size=(count, 2)) * self.sides)


@dataclass(frozen=True)
class Sphere:
    """A sphere, its fluid and its bed, by numbers without dimensions.

    Attributes
    ----------
    galileo, density_ratio, slope_deg, relative_size
        As of a `Grain`.
    roughness
        Roughness length over the diameter of the bed's grains.
    shallow
        Fall of the surface over s - 1: the flow is ``theta/shallow`` diameters deep.
    friction, restitution
        Of its contacts with the bed.
    settles
        Whether it comes to rest in a still fluid before the gust.
    first
        Way in the gust, d.
    lowered
        By how much the zero level is lowered below that of the balance, d.
    gust_time
        How long the gust lasts at most, sqrt(d/g'). Where it ends, a sphere that has
        not come the first way goes on in the mean flow as well.
    """

    galileo: float
    density_ratio: float
    slope_deg: float = 0.0
    relative_size: float = 1.0
    roughness: float = 1 / SAND_GRAIN
    shallow: float = 0.0
    friction: float = FRICTION
    restitution: float = 0.0
    settles: bool = False
    first: float = FIRST
    lowered: float = 0.0
    gust_time: float = np.inf

    @property
    def viscosity(self) -> float:
        """Kinematic viscosity, sqrt(g' d^3)."""
        return float(np.sqrt(self.density_ratio) / self.galileo)

    def depth(self, shields: float) -> float:
        """Depth of a mean flow, d."""
        return shields / self.shallow if self.shallow > 0 else np.inf

    def speed(self, height: FloatArray, shields: float, depth: float) -> FloatArray:
        """Speed of a flow at heights over its zero level, sqrt(g' d)."""
        ustar = np.sqrt(self.density_ratio * shields)
        unit = ustar / self.viscosity
        above = np.maximum(height, 0)
        sand_grain = SAND_GRAIN * self.roughness / self.relative_size * unit
        rise = velocity.law_of_the_wall(above * unit, sand_grain)
        lag = velocity.shallow_defect(np.minimum(above / depth, 1))
        return np.asarray(ustar * np.maximum(rise - lag, 0))

    def level(self, bed: Bed, shields: float, depth: float) -> float:
        """Height at which the drags on a bed at rest add up to the stress of a flow, d."""
        heights = bed.centres[:, 2]
        low, high = float(heights.min()), float(heights.max() + bed.sizes.max())
        stress = self.density_ratio * shields * bed.sides[0] * bed.sides[1]
        for _ in range(24):
            middle = (low + high) / 2
            speed = self.speed(heights - middle, shields, depth)
            factor = CLIFT_GAUVIN.factor(speed * bed.sizes / self.viscosity)
            drags = 3 * np.pi * self.viscosity * bed.sizes * speed * factor
            if drags.sum() > stress:
                low = middle
            else:
                high = middle
        return middle - self.lowered


def poured(seed: int) -> PouredBed:
    """The run that pours the bed of a seed, of equal grains."""
    line = BedLine((-10.0, 0.0, LENGTH, LENGTH + 10.0), (0.0, 0.0, 0.0, 0.0), 1.0)
    return PouredBed(line, DEPTH, CUT, None, 1.0, FRICTION_ANGLE_DEG, seed, WIDTH)


def beds(directory: Path, seeds: Sequence[int] = SEEDS) -> list[Bed]:
    """Pour the beds that are not there, and read all."""
    found = []
    for seed in seeds:
        case = poured(seed)
        if not (directory / case.name / BED).exists():
            engine.execute(case, directory, 1200.0)
        packed = joined(directory / case.name, LENGTH, CUT, LAYERS, WIDTH)
        centres = np.ascontiguousarray(packed.places.xyz)
        found.append(Bed(centres, (LENGTH, WIDTH), packed.sizes, seed))
    return found


def ways(
    sphere: Sphere,
    over: Sequence[Bed],
    shields: tuple[float, float],
    count: int,
    then: float = WAYS[-1],
) -> tuple[FloatArray, FloatArray]:
    """Follow spheres over beds: how far each comes in a gust, and in the mean flow after it.

    Parameters
    ----------
    sphere
        The sphere.
    over
        The beds, in its diameters.
    shields
        Shields number in the gust, and that of the mean flow.
    count
        Number of spheres over each bed.
    then
        Way in the mean flow after which none is followed further, d; in the gust it is
        the first way.

    Returns
    -------
    in_gust, after
        The ways, d, shape (spheres,); the second is 0 of one that does not come the first.
    """
    found = [_over(sphere, bed, shields, count, then) for bed in over]
    return np.concatenate([a for a, _ in found]), np.concatenate([b for _, b in found])


def _over(
    sphere: Sphere, bed: Bed, shields: tuple[float, float], count: int, then: float
) -> tuple[FloatArray, FloatArray]:
    """The same over one bed."""
    s, nu = sphere.density_ratio, sphere.viscosity
    slope = np.radians(sphere.slope_deg)
    depth = sphere.depth(shields[1])
    flows = [sphere.speed(HEIGHTS, each, depth) for each in shields]
    levels = [sphere.level(bed, each, depth) for each in shields]
    still = np.zeros(len(HEIGHTS))
    scale = float(np.interp(0.8, HEIGHTS, flows[1])) + 1e-9
    columns, rows, first, order = bed.columns
    scene = _Scene(
        bed=bed.grains.ctypes.data,
        grains=len(bed.centres),
        length=bed.sides[0],
        width=bed.sides[1],
        size=float(bed.sizes.max()),
        ratio=s,
        viscosity=nu,
        along=-np.sin(slope),
        normal=-np.cos(slope),
        fine=HEIGHTS[1],
        coarse=HEIGHTS[-1] - HEIGHTS[-2],
        fine_count=KNEE + 1,
        coarse_count=len(HEIGHTS) - KNEE,
        depth=min(depth, 1e30),
        friction=sphere.friction,
        restitution=sphere.restitution,
        # a sphere that creeps has a longer step
        time_step=max(0.02, 0.02 / (scale + s / (18 * nu))),
        look=max(4.0, 1 / scale),
        longest=200 + 5000 / scale,
        gust_time=min(sphere.gust_time, 1e30),
        always=int(np.isfinite(sphere.gust_time)),
        columns=columns,
        rows=rows,
        first_of_column=first.ctypes.data,
        of_column=order.ctypes.data,
    )
    places = bed.places(count)
    in_gust, after = np.zeros(count), np.zeros(count)
    solver().roll(
        ctypes.byref(scene),
        count,
        _pointer(places),
        int(sphere.settles),
        _pointer(still),
        _pointer(flows[0]),
        ctypes.c_double(levels[0]),
        _pointer(flows[1]),
        ctypes.c_double(levels[1]),
        ctypes.c_double(sphere.first),
        ctypes.c_double(then),
        _pointer(in_gust),
        _pointer(after),
    )
    return in_gust, after


def _pointer(array: FloatArray) -> ctypes.c_void_p:
    """Where the numbers of an array lie."""
    return ctypes.c_void_p(array.ctypes.data)


Shares = Callable[[float], tuple[int, IntArray]]
"""Of a Shields number: how many spheres there are, and how many of them come each of some ways."""


def crossings(shares: Shares, guess: float, floor: float = LEAST) -> FloatArray:
    """Find the Shields numbers at which each of the `PARTS` of the spheres comes each way.

    Numbers are tried from a guess on until the shares are below `FEW` and above `MANY`.

    Returns
    -------
    ndarray
        The numbers, and the standard error of the logarithm of the second, shape (ways, parts + 1):
        `floor`, or 0 if that is `LEAST`, where it is enough, infinite where none is.
    """
    tried: dict[int, tuple[int, IntArray]] = {}

    def share(step: int) -> FloatArray:
        if step not in tried:
            tried[step] = shares(guess * STEP**step)
        count, passed = tried[step]
        return np.asarray(passed / max(count, 1))

    low = high = 0
    while (share(low) > FEW).any() and _goes_on(guess * STEP**low, floor, tried):
        low -= 1
    while (share(high) < MANY).any() and _goes_on(guess * STEP**high, floor, tried):
        high += 1
    for step in range(low, high):
        share(step)
    steps = sorted(tried)
    logs = np.log(guess) + np.log(STEP) * np.array(steps)
    counts = np.array([tried[step][0] for step in steps])
    passed = np.array([tried[step][1] for step in steps])
    return np.array([quantiles(logs, counts, each, floor) for each in passed.T])


def _goes_on(
    shields: float, floor: float, tried: dict[int, tuple[int, IntArray]]
) -> bool:
    """Whether further numbers are tried."""
    return floor < shields < MOST and len(tried) < MOST_TRIED


def quantiles(
    logs: FloatArray, counts: IntArray, passed: IntArray, floor: float
) -> FloatArray:
    """Find the Shields numbers of the `PARTS` by a logistic curve, and the error of the second."""
    share = passed / np.maximum(counts, 1)
    if share[0] > 0.5:
        least = 0.0 if floor == LEAST else floor
        return np.append(np.full(len(PARTS), least), 0.0)
    if not (share >= 0.5).any():
        return np.append(np.full(len(PARTS), np.inf), np.nan)
    used = _near(share)
    x, n, k = logs[used], counts[used], passed[used]

    def unlikely(at: FloatArray) -> float:
        part = np.clip(expit(np.exp(at[1]) * (x - at[0])), 1e-9, 1 - 1e-9)
        prior = (at[1] - np.log(USUAL_SLOPE)) ** 2 / 2
        return float(prior - np.sum(k * np.log(part) + (n - k) * np.log1p(-part)))

    middle = logs[np.argmax(share >= 0.5)]
    start = np.array([middle, np.log(USUAL_SLOPE)])
    best = minimize(unlikely, start, method="BFGS")
    parts = np.array(PARTS)
    found = np.exp(best.x[0] + np.log(parts / (1 - parts)) / np.exp(best.x[1]))
    if floor > LEAST:
        found = np.maximum(found, floor)
    return np.append(found, float(np.sqrt(best.hess_inv[0, 0])))


def _near(share: FloatArray) -> slice:
    """The shares that are neither none nor all, and the one before and after them."""
    between: BoolArray = (share > 0.03) & (share < 0.97)
    places = np.flatnonzero(between)
    if not len(places):
        return slice(None)
    return slice(max(int(places[0]) - 1, 0), int(places[-1]) + 2)


def point(
    sphere: Sphere, over: Sequence[Bed], guess: tuple[float, float], count: int
) -> dict[str, float]:
    """Compute a point: the Shields numbers of a flow that starts spheres, and that they go on in.

    Parameters
    ----------
    sphere
        The sphere.
    over
        The beds, in diameters of their grains.
    guess
        About what both are.
    count
        Number of spheres over each bed.

    Returns
    -------
    dict
        `start_25`, `start_50` and `start_75` of the first way, by the share in per cent; `after_10_25`,
        `after_20_50` and `after_40_75` of the second, by way and share; errors of two logarithms.
    """
    sized = [bed.of_sphere(sphere.relative_size) for bed in over]

    def started(shields: float) -> tuple[int, IntArray]:
        in_gust, _ = ways(sphere, sized, (shields, shields / PEAK), count, then=0.0)
        return len(in_gust), np.array([np.count_nonzero(in_gust >= sphere.first)])

    start = crossings(started, guess[0])[0]
    is_known = 0 < start[1] < np.inf
    least_gust = start[1] if is_known else 0.0

    def went_on(shields: float) -> tuple[int, IntArray]:
        # a gust that starts less than half of the spheres is none that decides
        gust = max(PEAK * shields, least_gust)
        in_gust, after = ways(sphere, sized, (gust, shields), count)
        is_on = in_gust >= sphere.first
        far = [np.count_nonzero(after[is_on] >= way) for way in WAYS]
        return int(is_on.sum()), np.array(far)

    floor = max(FLOOR * least_gust / PEAK, LEAST)
    after = crossings(went_on, max(guess[1], 2 * floor), floor)
    found = {f"start_{100 * part:g}": start[n] for n, part in enumerate(PARTS)}
    for n, (way, part) in enumerate(zip(WAYS, PARTS, strict=True)):
        found[f"after_{way:g}_{100 * part:g}"] = after[n, n]
    return found | {"start_error": start[-1], "after_error": after[1, -1]}


KEYS = (
    "galileo",
    "density_ratio",
    "slope_deg",
    "relative_size",
    "roughness",
    "shallow",
)
"""Columns of a point that say what it is of, attributes of `Sphere`."""
GALILEO = np.geomspace(0.3, 1e5, 22)
"""Galileo numbers of level beds of quartz in water, and in air."""
FEWER = np.geomspace(0.3, 1e5, 11)
"""Those of level beds at other density ratios."""
OF_FACTORS = np.geomspace(0.3, 1e5, 9)
"""Those of the factors of slope, size and roughness."""
OF_SHALLOW = (100.0, 3e3, 7e4)
DENSITY = (1.1, 1.3, 1.65, 2.65, 5.0, 12.0, 40.0, 150.0, 600.0, 2200.0, 1e4, 1e5, 1e6)
"""Density ratios."""
WATER, AIR = 2.65, 2200.0
"""Those of quartz."""
SLOPES_DEG = (-20.0, 20.0, -10.0, 10.0, -30.0, 30.0)
SHALLOW = (0.01, 0.03, 0.06, 0.12, 0.24)
SIZES = (0.35, 0.6, 1.6, 2.83)
ROUGHNESS = (0.1, 0.3)
COUNT = 64
"""Spheres over each of the beds. Points that were computed first have 16."""


def plan() -> Iterator[Sphere]:
    """The points, each beside the one before."""
    for chain, galileo in chains():
        for each in galileo[::-1]:
            yield Sphere(each, **chain)


def chains() -> Iterator[tuple[dict[str, float], Sequence[float]]]:
    """What the points of a chain have alike, and their Galileo numbers."""
    for s in (WATER, AIR):
        yield {"density_ratio": s}, GALILEO
    for shallow in SHALLOW:
        # an open flow of quartz in water falls as its bed does
        slope = -float(np.degrees(np.arcsin(shallow * (WATER - 1))))
        chain = {"density_ratio": WATER, "slope_deg": slope, "shallow": shallow}
        yield chain, OF_SHALLOW
    for slope in SLOPES_DEG:
        yield {"density_ratio": WATER, "slope_deg": slope}, OF_FACTORS
    for s in sorted(set(DENSITY) - {WATER, AIR}, key=lambda s: abs(np.log(s / 40))):
        yield {"density_ratio": s}, FEWER
    for slope in SLOPES_DEG:
        yield {"density_ratio": AIR, "slope_deg": slope}, OF_FACTORS
    for s in (WATER, AIR):
        for roughness in ROUGHNESS:
            yield {"density_ratio": s, "roughness": roughness}, OF_FACTORS
        for size in SIZES:
            # how much deeper a small sphere lies in the flow depends on the viscous sublayer
            yield {"density_ratio": s, "relative_size": size}, FEWER


def main(directory: Path) -> None:
    """Compute the points of the plan that are not there, and put them to the others."""
    over = beds(directory)
    rows = pd.read_csv(POINTS).to_dict("records") if POINTS.exists() else []
    guess = (0.09, 0.045)
    for sphere in plan():
        key = {name: getattr(sphere, name) for name in KEYS}
        same = [
            row for row in rows if all(np.isclose(row[k], key[k], 1e-6) for k in key)
        ]
        if not same:
            same = [key | point(sphere, over, guess, COUNT)]
            rows += same
            pd.DataFrame(rows).to_csv(POINTS, index=False, float_format="%.9g")
            print(*(f"{value:.4g}" for value in same[0].values()), flush=True)
        found = same[0]["start_50"], same[0]["after_20_50"]
        if min(found) > 0 and max(found) < MOST:
            guess = found


NODES = np.geomspace(GALILEO[0], GALILEO[-1], 45)
DENSITY_NODES = np.geomspace(DENSITY[0], DENSITY[-1], 31)
"""Nodes of the table of the program."""
NUMBERS = tuple(name for names in COLUMNS.values() for name in names)
"""Columns of the table of the program."""
USUAL = {
    "slope_deg": 0.0,
    "shallow": 0.0,
    "relative_size": 1.0,
    "roughness": 1 / SAND_GRAIN,
}
"""What a level bed has of what factors are of."""
LEAST_ERROR = 0.01
"""Least standard error of a logarithm: that of another sample of beds and places."""


def table(points: pd.DataFrame) -> pd.DataFrame:
    """Make the table of level beds, smooth along the Galileo number.

    The logarithm of each number is a smoothing spline over that of the Galileo number, as stiff as the errors
    of the points allow, and a monotone interpolation over that of the density ratio.
    """
    level = of_level(points)
    smooth = np.empty((len(NODES), len(DENSITY), len(NUMBERS)))
    for column, (_, rows) in enumerate(level.groupby("density_ratio")):
        # a point may have been computed twice
        rows = rows.sort_values("galileo")
        for number, name in enumerate(NUMBERS):
            smooth[:, column, number] = _along(rows, name, NODES)
    of_density = PchipInterpolator(np.log(DENSITY), smooth, axis=1)
    found = np.exp(of_density(np.log(DENSITY_NODES)))
    # where a number was not looked for further down, its ends are noise
    low, middle, high = np.moveaxis(found.reshape(*found.shape[:2], 3, 2), 2, 0)
    found = np.concatenate(
        [np.minimum(low, middle), middle, np.maximum(high, middle)], 2
    )
    rows = pd.MultiIndex.from_product([NODES, DENSITY_NODES], names=KEYS[:2]).to_frame(
        index=False
    )
    made = pd.DataFrame(found.reshape(-1, len(NUMBERS)), columns=list(NUMBERS))
    return pd.concat([rows, made], axis=1)


def of_level(points: pd.DataFrame) -> pd.DataFrame:
    """Those of the points that are of level beds, deep flows, and grains among their like."""
    is_usual = [np.isclose(points[name], value) for name, value in USUAL.items()]
    return points[np.all(is_usual, axis=0)]


def _along(rows: pd.DataFrame, name: str, galileo: FloatArray) -> FloatArray:
    """Logarithm of a number of some points, smooth, at Galileo numbers."""
    means = np.log(rows[name]).groupby(np.log(rows["galileo"]).round(6)).mean()
    error = np.full(len(means), LEAST_ERROR)
    spline = UnivariateSpline(means.index, means, 1 / error, s=len(means))
    return np.asarray(spline(np.log(galileo)))


def factors(points: pd.DataFrame) -> pd.DataFrame:
    """Make the factors of slope, shallow flow, size and roughness, those of level beds over a `table`.

    Each is a smoothing spline over the logarithm of the Galileo number, as stiff as the errors of the points
    allow; it is 1 for the usual value. That of a shallow flow is over a deep one on the same slope, in water,
    and taken at every density ratio.
    """
    rows: list[dict[str, Any]] = []
    for kind, usual in USUAL.items():
        others = [name for name in USUAL if name not in {kind, "slope_deg"}]
        is_kind = ~np.isclose(points[kind], usual)
        for name in others:
            is_kind &= np.isclose(points[name], USUAL[name])
        part = _over_level(points[is_kind], points)
        if kind == "shallow":
            of_slopes = pd.DataFrame(rows)
            for name in ("start", "after"):
                part[name] /= _of_slope(of_slopes, part, name)
            part = pd.concat([part, part.assign(density_ratio=AIR)])
        for s in part["density_ratio"].unique():
            ones = {"galileo": OF_FACTORS, "start": 1.0, "after": 1.0}
            found = [(usual, pd.DataFrame(ones))]
            for value, of_value in part[part["density_ratio"] == s].groupby(kind):
                numbers = {name: _smooth(of_value, name) for name in ("start", "after")}
                found.append((value, pd.DataFrame({"galileo": OF_FACTORS, **numbers})))
            for value, numbers in found:
                given = numbers.assign(kind=kind, value=value, density_ratio=s)
                rows += given.to_dict("records")
    made = pd.DataFrame(rows).sort_values(["kind", "value", "galileo", "density_ratio"])
    return made[["kind", "value", "galileo", "density_ratio", "start", "after"]]


def _over_level(part: pd.DataFrame, points: pd.DataFrame) -> pd.DataFrame:
    """Some points with `start` and `after`, both numbers over those of level beds, and their errors."""
    level = of_level(points)
    made = part.assign(start=np.nan, after=np.nan)
    for s in part["density_ratio"].unique():
        here = made["density_ratio"] == s
        alike = level[np.isclose(level["density_ratio"], s)]
        for name, column in (("start", "start_50"), ("after", "after_20_50")):
            of_level_bed = np.exp(_along(alike, column, part.loc[here, "galileo"]))
            made.loc[here, name] = part.loc[here, column] / of_level_bed
    # where none was tried below, the other number says how it changes
    is_floor = part["after_20_50"] < 1.02 * FLOOR / PEAK * part["start_50"]
    for end in ("", "_error"):
        made[f"after{end}"] = made[f"after{end}"].mask(is_floor, made[f"start{end}"])
    return made


def _of_slope(rows: pd.DataFrame, part: pd.DataFrame, name: str) -> FloatArray:
    """The factors of the slopes of some points in water."""
    rows = rows[(rows["kind"] == "slope_deg") & (rows["density_ratio"] == WATER)]
    grid = rows.pivot(index="value", columns="galileo", values=name)
    axes = (grid.index.to_numpy(), np.log(grid.columns.to_numpy(float)))
    at = RegularGridInterpolator(axes, grid.to_numpy())
    return np.asarray(at(np.column_stack([part["slope_deg"], np.log(part["galileo"])])))


def _smooth(rows: pd.DataFrame, name: str) -> FloatArray:
    """A factor of the points of one value, smooth, at the Galileo numbers of the factors."""
    rows = rows.sort_values("galileo")
    x, factor = np.log(rows["galileo"]), rows[name]
    error = factor * np.maximum(rows[f"{name}_error"], LEAST_ERROR)
    spline = UnivariateSpline(
        x, factor, 1 / error, k=min(3, len(rows) - 1), s=len(rows)
    )
    at = np.clip(np.log(OF_FACTORS), x.min(), x.max())
    return np.maximum(spline(at), 0)


def make_tables() -> None:
    """Write the tables of the program."""
    points = pd.read_csv(POINTS)
    table(points).to_csv(TABLE, index=False, float_format="%.4g")
    factors(points).to_csv(FACTORS, index=False, float_format="%.4g")


if __name__ == "__main__":
    if sys.argv[1:]:
        main(Path(sys.argv[1]))
    else:
        make_tables()
