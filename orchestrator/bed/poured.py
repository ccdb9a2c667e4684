"""Beds that LIGGGHTS pours: a mould of the bed line, the run, and its packing.

Lengths are in diameters d of the scene, with the toe of the first form at the origin.
"""

from dataclasses import dataclass
from functools import cached_property
from math import radians, tan
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from orchestrator import digits
from orchestrator.bed import deck
from orchestrator.bed.deck import DENSITY, DIAMETER, GRAVITY, WEIGHT, DeckCase
from orchestrator.bed.exposure import places_within, unshadowed
from orchestrator.bed.line import BedLine
from orchestrator.bed.packing import APRON, Packing
from orchestrator.bed.places import Places
from orchestrator.errors import InputError, Noisy, SolverError
from orchestrator.solvers.dem import ENGINE
from orchestrator.study.parts import LogNormal, Range, Sizes
from orchestrator.types import BoolArray, FloatArray

HEAP = 2.0
"""Height of the grains over the line that are cut away, d."""
FILLED = 0.83
"""Part of the area that settled grains fill; it only decides how many are poured."""
FILLED_IN_SPACE = 0.6
"""The same of the volume of a strip."""
LOOSE = 0.3
"""Room of a grain in the air, beside it and over it, in its own diameters: as little as
leaves no order among equal grains, so that they fall no further than need be."""
COLUMNS = 20
"""Columns in a diameter by which free room is looked for."""
CONTACT = {"damping": 0.1, "time_step": 0.2}
"""With more damping, or a longer step, equal spheres jitter and form crystals."""
STIFFNESS = (1e3, 1e4, 1e4)
"""Stiffness K d/W of each stage. The grains fall on soft springs."""
DRAG = (0.0, 5.0, 1.0)
"""Drag of each stage, m sqrt(g/d). After the fall a drag takes the energy of waves that
run up and down the bed, which contacts alone take off slowly. When the bed is cut, a
small drag is enough and lets grains roll into their pockets."""
CALM = (1e-2, 1e-4, 1e-6)
"""Kinetic energy of a grain at which each stage ends, W d. The last is 1e-2 W^2/K,
which is rest to other decks too: in a long bed there is always a grain that still rolls
somewhere."""
LONGEST = 400
"""Time that the grains have in a stage, sqrt(d/g')."""
SETTLING = "settling.csv"
DUMP = "poured.dump"
BED = "bed.csv"
LEAST_LENGTH = 3.0
"""Least length of the forms of a poured bed, d."""
MOST_GRAINS = 100_000
"""Most grains of a poured bed: some hundred megabytes, and half an hour of one core."""
LAYER = np.sin(np.pi / 3)
"""Thickness of a layer, d: as of a lattice."""
NEAR = 0.5
"""Fixed grains whose surfaces are nearer to that of a mobile one are in the case, d."""
LOCAL = 5.0
"""Length of bed before and behind a grain that its height is compared with, d."""
OVERLAP = 0.02
"""Overlap of two grains where the ends of a strip meet, from which on one is left out,
d: springs open a smaller one while the bed settles."""


def drawn_sizes(
    sizes: Sizes | None, diameter: float, count: int, seed: int, dimensions: int
) -> FloatArray:
    """Draw the diameters of grains.

    They are evenly spread over the distribution by number: no bed has more of a size by
    chance. In three dimensions each size takes its share of the volume. In two it takes
    the same share of the area, as on the face of any bed and on every cut through it.

    Parameters
    ----------
    sizes
        The distribution; None for equal grains.
    diameter
        The diameter that the result is over, m.
    count
        Number of grains.
    seed
        Seed of their order.
    dimensions
        2 or 3.

    Returns
    -------
    FloatArray
        Diameters in random order, shape (count,).
    """
    if sizes is None:
        return np.ones(count)
    part = (np.arange(count) + 0.5) / count
    if isinstance(sizes, LogNormal):
        each = sizes.quantile(part, power=dimensions)
    else:
        diameters, fractions = np.array(sizes).T
        number = fractions / diameters**dimensions
        finer = np.cumsum(number) / number.sum()
        # a part that is a class's end belongs to that class, whatever its last digit
        classes = np.searchsorted(finer + digits.SLACK / count, part)
        each = diameters[np.minimum(classes, len(diameters) - 1)] / diameter
    return np.random.default_rng(seed).permutation(digits.all_rounded(each))


@dataclass(frozen=True)
class PouredBed(DeckCase):
    """The run that pours a bed into a mould of a bed line.

    All scenes with this bed share it. Lengths are in d.

    Attributes
    ----------
    line
        The bed line.
    depth
        Depth of the row of fixed grains under the line, along the vertical.
    surface
        Height over the line, normal to it, above which no centre lies after the cut.
    sizes
        The sizes of the grains; None for equal ones.
    diameter
        The d of a sieve table, m; else 1, for such a bed has no scale.
    friction_angle_deg
        Friction angle of the grains, degrees.
    seed
        Chooses one bed of many.
    width
        Width of a strip with periodic sides; 0 in one plane.
    """

    line: BedLine
    depth: float
    surface: float
    sizes: Sizes | None
    diameter: float
    friction_angle_deg: float
    seed: int
    width: float = 0.0

    kind: ClassVar[str] = "poured"
    template: ClassVar[str] = f"{ENGINE.TEMPLATES}/poured"
    results: ClassVar[tuple[str, ...]] = (SETTLING, DUMP)
    derived: ClassVar[tuple[str, ...]] = (BED,)

    @property
    def parameters(self) -> dict[str, Any]:
        """The bed line, what is poured, and the seed."""
        sizes = self.sizes if isinstance(self.sizes, tuple | None) else str(self.sizes)
        return {
            "x": list(self.line.x),
            "z": list(self.line.z),
            "sizes": sizes,
            "depth": self.depth,
            "surface": self.surface,
            "diameter": self.diameter,
            "friction_angle_deg": self.friction_angle_deg,
            "seed": self.seed,
            "width": self.width,
        }

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s; fitted to planes of 1,000 to 20,000 grains."""
        if self.width:
            return 1 + self._count * 15_000 / 6e6
        return float(0.1 + 0.7 * (self._count / 1000) ** 1.7)

    @property
    def ranks(self) -> int:
        """Processes that the solver is run with."""
        return ENGINE.ranks(self._count)

    def check_size(self) -> None:
        """Refuse a mould that is too short or too large.

        Raises
        ------
        InputError
            If it has no room for a bed, or more grains than a machine bears.
        """
        length = self.line.x[-2] - self.line.x[1]
        if length < LEAST_LENGTH * (1 - 1e-9):
            bed = f"a poured bed of {length:.3g} grains"
            what = f"{bed} has no pockets that are those of a bed"
            raise InputError(what, "bed.length", f"at least {LEAST_LENGTH:g} diameters")
        if self._count > MOST_GRAINS:
            grains = f"about {self._count:.2g} grains"
            what = f"{grains} would be poured, more than {MOST_GRAINS:g}"
            less = "less of bed.poured_depth or bed.width"
            remedy = f"a shorter bed, larger grains, or {less}"
            raise InputError(what, where="bed.packing", remedy=remedy)

    @cached_property
    def _count(self) -> int:
        """Number of grains that rain into the mould."""
        sizes = self._drawn(1000, 0)
        start, end = self.ends
        area = (self.depth + self.surface + HEAP) * (end - start)
        if self.width:
            mean = float(np.pi * np.mean(sizes**3 / 6))
            part = FILLED_IN_SPACE * self.width
        else:
            mean = float(np.pi * np.mean(sizes**2 / 4))
            part = FILLED
        return digits.whole_up(area * part / mean)

    @property
    def dimensions(self) -> int:
        """Dimensions of the bed: three of a strip, else two."""
        return 3 if self.width else 2

    def _drawn(self, count: int, seed: int) -> FloatArray:
        """Diameters of so many of its grains, d."""
        return drawn_sizes(self.sizes, self.diameter, count, seed, self.dimensions)

    @property
    def ends(self) -> tuple[float, float]:
        """Places along x of the walls of the mould: beyond the forms, in the line."""
        x = self.line.x
        return max(x[0], x[1] - APRON), min(x[-1], x[-2] + APRON)

    @property
    def floor(self) -> FloatArray:
        """Centres of the fixed grains: along the line one diameter apart, shape (m, 3).

        Those of a strip lie in two layers, each over the gaps of the other: nothing
        falls through.
        """
        corners_x, corners_z = self.line.corners.T
        along = np.concatenate([[0.0], np.cumsum(self.line.lengths)])
        first, last = np.interp(self.ends, corners_x, along)
        places = np.arange(first + 0.5, last - digits.SLACK, 1.0)
        # where grains fall in their rows depends on whether the columns over them are
        # free
        x = digits.on_grid(np.interp(places, along, corners_x))
        z = digits.on_grid(np.interp(places, along, corners_z) - self.depth)
        if not self.width:
            return np.column_stack([x, np.zeros_like(x), z])
        rows = digits.whole_up(self.width)
        y = np.tile(np.arange(rows) * self.width / rows, len(x))
        upper = np.column_stack([np.repeat(x, rows), y, np.repeat(z, rows)])
        to_the_gaps = np.array([0.5, self.width / rows / 2, -np.sqrt(0.5)])
        return np.vstack([upper, upper + to_the_gaps])

    def rain(self, sizes: FloatArray) -> FloatArray:
        """Find places in the air: rows in which no two grains touch.

        Parameters
        ----------
        sizes
            Diameters of n grains, d.

        Returns
        -------
        FloatArray
            X, y and z of the centres, d, shape (n, 3).
        """
        rng = np.random.default_rng(self.seed)
        chance = rng.uniform(size=(len(sizes), self.dimensions))
        places = np.zeros((len(sizes), 3))
        # with no room to the sides each lane would stay a bed in a plane
        lanes = max(int(self.width / ((1 + LOOSE) * float(sizes.max()))), 1)
        for lane in range(lanes):
            grains = slice(lane, None, lanes)
            in_lane = self._lane(sizes[grains], chance[grains])
            places[grains, 0] = in_lane[:, 0]
            places[grains, 2] = in_lane[:, 1]
            if self.width:
                wide = self.width / lanes
                aside = (chance[grains, 2] - 0.5) * (wide - sizes[grains])
                places[grains, 1] = (lane + 0.5) * wide + aside
        return places

    def _lane(self, sizes: FloatArray, chance: FloatArray) -> FloatArray:
        """X and z of grains that rain in one lane, shape (n, 2)."""
        start, end = self.ends
        room = (1 + LOOSE) * sizes
        margin = float(sizes.max())
        left = start - margin
        tops = np.full(int((end - start + 2 * margin) * COLUMNS) + 2, -np.inf)

        def columns(place: float, radius: float) -> slice:
            """The columns over a grain."""
            low = place - radius - left
            high = place + radius - left
            return slice(int(low * COLUMNS), int(high * COLUMNS) + 1)

        for x, _, z in self.floor:
            under = columns(x, 0.5)
            tops[under] = np.maximum(tops[under], z + 0.5)
        places = np.empty((len(sizes), 2))
        x = start + room[0] * chance[0, 0]
        rain = zip(sizes.tolist(), room.tolist(), strict=True)
        for number, (size, wide) in enumerate(rain):
            beside, over = LOOSE * size * chance[number, :2]
            if x + wide > end:
                x = start + wide * chance[number, 0]
            place = x + beside + size / 2
            under = columns(place, size / 2)
            height = tops[under].max() + over + size / 2
            places[number] = (place, height)
            tops[under] = np.maximum(tops[under], height + size / 2)
            x += wide
        return places

    @cached_property
    def grains(self) -> tuple[FloatArray, FloatArray]:
        """Centres of all grains, the fixed first, and their diameters, d."""
        floor = self.floor
        sizes = self._drawn(self._count, self.seed)
        centres = np.vstack([floor, self.rain(sizes)])
        return centres, np.append(np.ones(len(floor)), sizes)

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains in the air, the walls and the cut."""
        start, end = self.ends
        centres, sizes = self.grains
        parameters: dict[str, float | int | tuple[float, ...]] = {
            "diameter": DIAMETER,
            "smallest": float(sizes.min()),
            "density": DENSITY,
            "gravity": GRAVITY,
            "friction": tan(radians(self.friction_angle_deg)),
            **CONTACT,
            "upstream": start * DIAMETER,
            "downstream": end * DIAMETER,
            "most_looks": LONGEST,
            "width": self.width,
            "ranks": self.ranks,
            "stiffness": STIFFNESS,
            "drag": DRAG,
            "calm": CALM,
        }
        ENGINE.write_parameters(directory, parameters, deck.MEANING)
        self._write_cut(directory)
        margin = float(sizes.max()) + 1
        bounds = np.array([centres.min(axis=0) - margin, centres.max(axis=0) + margin])
        if self.width:
            bounds[:, 1] = (0.0, self.width)
        is_floor = np.arange(len(sizes)) < len(self.floor)
        ENGINE.write_grains(
            directory,
            centres * DIAMETER,
            np.where(is_floor, 1, 2),
            sizes * DIAMETER,
            DENSITY,
            bounds * DIAMETER,
            # neighbours along the bed are near in memory: a fifth less time for 20,000
            np.argsort(centres[:, 0], kind="stable"),
        )

    def _write_cut(self, directory: Path) -> None:
        """Write the line above which grains are cut away, a file for each column."""
        x, z = self.line.corners.T
        run, rise = self.line.tangents.T
        x = x * DIAMETER
        raised = (z[:-1] + self.surface / run) * DIAMETER
        cut = {"x0": x[:-1], "x1": x[1:], "z0": raised, "slope": rise / run}
        for name, values in cut.items():
            ENGINE.write_numbers(directory / f"cut.{name}.txt", values)

    def collect(self, directory: Path) -> None:
        """See that the bed came to rest, and write its grains to ``bed.csv``."""
        ENGINE.check_log(directory)
        where = str(directory / SETTLING)
        last = deck.read_table(directory / SETTLING).groupby("stage").last()
        mean_energy = last["ke"] / last["grains"].clip(lower=1)
        energy = (mean_energy / (WEIGHT * DIAMETER)).to_numpy()
        if len(last) < len(CALM) or not (last["grains"] > 0).all():
            what = "no grain of the poured bed is left"
            remedy = "a gentler slope, or more of bed.poured_depth"
            raise SolverError(what, where, remedy)
        if not np.all(energy < CALM):
            grain = f"{energy[-1]:.2g} W d a grain"
            what = f"the poured bed does not come to rest: {grain}"
            remedy = "a gentler slope, or a larger grain.friction_angle_deg"
            raise Noisy(what, where, remedy)
        _, rows = ENGINE.read_frames(directory / DUMP, ("id", "x", "y", "z"))
        number = rows["id"].to_numpy(np.int64) - 1
        _, sizes = self.grains
        bed = pd.DataFrame({f"{axis}_over_d": rows[axis] / DIAMETER for axis in "xyz"})
        bed["size"] = sizes[number]
        bed["fixed"] = (number < len(self.floor)).astype(int)
        bed.to_csv(directory / BED, index=False, float_format=digits.FORMAT)


def read_poured(
    directory: Path,
    line: BedLine,
    counts: str | Range,
    surface: float,
    mobile_layers: int,
    width: float = 0.0,
) -> Packing:
    """Read the packing of a finished case `PouredBed`; lengths in d.

    Parameters
    ----------
    directory
        The directory of the case.
    line
        The bed line of the flow.
    counts
        Which exposed grains are counted, as `BedLine.counted` takes it.
    surface
        Height of the highest centres over the line.
    mobile_layers
        Layers that may move.
    width
        Width of a strip; 0 in one plane.

    Returns
    -------
    Packing
        The mobile grains and the fixed ones near them.

    Raises
    ------
    InputError
        If no grain is counted.
    """
    rows = deck.read_table(directory / BED)
    centres = rows[["x_over_d", "z_over_d"]].to_numpy(float)
    sizes = rows["size"].to_numpy(float)
    is_poured = rows["fixed"].to_numpy() == 0
    segment, along = line.nearest(centres)
    height = line.over(centres, segment)
    places = Places.of(centres, rows["y_over_d"].to_numpy(float), width)
    y = places.xyz[:, 1]
    is_free = is_poured & _is_exposed(along, height, y, sizes, width)
    on_form = (segment > 0) & (segment < len(line.lengths) - 1)
    mobile = surface - height < (mobile_layers - 0.5) * LAYER
    mobile = is_poured & (mobile | is_free) & on_form
    counted = (
        is_free & line.counted(counts)[segment] & places_within(centres[:, 0], counts)
    )
    _check_counted(counted)
    needed = mobile | _near_to(mobile, places, sizes)
    # along the bed; the fixed ones last, for a deck must not lose the grain of its
    # highest id
    kept = np.lexsort((along, ~mobile))
    kept = kept[needed[kept]]
    return Packing(
        centres=centres[kept],
        sizes=sizes[kept],
        mobile=mobile[kept],
        windward=counted[kept],
        lee=(is_free & on_form & ~counted)[kept],
        arc_length=along[kept],
        across=y[kept],
        width=width,
    )


def joined(
    directory: Path, length: float, surface: float, layers: int, width: float
) -> Packing:
    """Read a strip of a finished case `PouredBed`, and make its two ends one.

    Where grains of both ends overlap, those that overlap most are left out.

    Parameters
    ----------
    directory
        The directory of the case.
    length
        Length of the strip from x = 0, d; a whole number, as the fixed grains are d
        apart.
    surface
        Height of the highest centres over the level bed, d.
    layers
        Layers that may move.
    width
        Width of the strip, d.

    Returns
    -------
    Packing
        The mobile grains, of which the exposed ones are counted, and a layer under
        them.
    """
    bed = deck.read_table(directory / BED)
    xyz = bed[["x_over_d", "y_over_d", "z_over_d"]].to_numpy(float)
    is_within = (xyz[:, 0] >= 0) & (xyz[:, 0] < length)
    is_within &= surface - xyz[:, 2] < (layers + 1.5) * LAYER
    xyz = xyz[is_within]
    sizes = bed["size"].to_numpy(float)[is_within]
    is_floor = bed["fixed"].to_numpy(bool)[is_within]
    sides = np.array([length, width])
    xyz[:, :2] = np.mod(xyz[:, :2], sides)
    kept = _without_overlaps(xyz, sizes, is_floor, sides)
    xyz = xyz[kept]
    sizes = sizes[kept]
    is_near_top = surface - xyz[:, 2] < (layers - 0.5) * LAYER
    mobile = is_near_top & ~is_floor[kept]
    flat = np.column_stack([xyz[:, 0], np.zeros(len(xyz))])
    places = Places.of(flat, xyz[:, 1], width)
    exposed = unshadowed(places, xyz[:, 2], sizes / 2) & mobile
    return Packing(
        centres=xyz[:, [0, 2]],
        sizes=sizes,
        mobile=mobile,
        windward=exposed,
        lee=np.zeros_like(exposed),
        arc_length=xyz[:, 0],
        across=xyz[:, 1],
        width=width,
    )


def _without_overlaps(
    xyz: FloatArray, sizes: FloatArray, is_floor: BoolArray, sides: FloatArray
) -> BoolArray:
    """Which grains are left where the ends of a strip meet; the whole floor is."""
    from scipy.spatial import cKDTree  # slow to import

    tree = cKDTree(xyz, boxsize=np.append(sides, 0.0))
    first, second = tree.query_pairs(float(sizes.max()), output_type="ndarray").T
    apart = xyz[second] - xyz[first]
    is_across = np.abs(apart[:, 0]) > sides[0] / 2
    apart[:, :2] -= sides * np.round(apart[:, :2] / sides)
    overlap = (sizes[first] + sizes[second]) / 2 - np.linalg.norm(apart, axis=1)
    overlap = np.where(is_across & (overlap > OVERLAP), overlap, 0.0)
    kept = np.ones(len(sizes), bool)
    while True:
        total = np.bincount(first, overlap, len(sizes))
        total += np.bincount(second, overlap, len(sizes))
        total[is_floor] = 0.0
        worst = int(np.argmax(digits.all_rounded(total)))
        if not total[worst]:
            return kept
        kept[worst] = False
        overlap[(first == worst) | (second == worst)] = 0.0


def _check_counted(counted: BoolArray) -> None:
    """Refuse a bed none of whose grains is counted."""
    if not counted.any():
        what = "no grain of the poured bed is exposed where grains are counted"
        remedy = "choose another part of the bed, or another bed.seed"
        raise InputError(what, "bed.counted", remedy)


def _is_exposed(
    along: FloatArray,
    height: FloatArray,
    across: FloatArray,
    sizes: FloatArray,
    width: float,
) -> BoolArray:
    """Which grains no other one hides, on the bed drawn out straight."""
    on_the_bed = np.column_stack([along, np.zeros_like(along)])
    return unshadowed(Places.of(on_the_bed, across, width), height, sizes / 2)


def _near_to(chosen: BoolArray, places: Places, sizes: FloatArray) -> BoolArray:
    """Which grains have their surface within `NEAR` of that of a chosen one."""
    first, second, apart = places.pairs(float(sizes.max()) + NEAR)
    gap = np.linalg.norm(apart, axis=1) - (sizes[first] + sizes[second]) / 2
    is_near = np.zeros(len(sizes), bool)
    is_near[first[chosen[second] & (gap < NEAR)]] = True
    return is_near


def standing(
    along: FloatArray, height: FloatArray, sizes: FloatArray, exposed: BoolArray
) -> FloatArray:
    """Find how much higher each grain lies than a mean exposed grain.

    The mean is that of the exposed centres within `LOCAL` along the bed, less half of
    d.

    Parameters
    ----------
    along, height
        Places of the centres along the bed line and over it, d, shape (n,).
    sizes
        Diameters, d, shape (n,).
    exposed
        Which grains are exposed, shape (n,).

    Returns
    -------
    FloatArray
        The heights, d, shape (n,); 0 for grains that are not exposed.
    """
    order = np.argsort(along[exposed], kind="stable")
    place = along[exposed][order]
    sums = np.append(0, np.cumsum(height[exposed][order]))
    first = np.searchsorted(place, along - LOCAL)
    last = np.searchsorted(place, along + LOCAL)
    level = (sums[last] - sums[first]) / np.maximum(last - first, 1)
    return np.asarray(np.where(exposed, height - sizes / 2 - (level - 0.5), 0.0))
