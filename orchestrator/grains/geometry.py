"""The bed of a scene in grains, and what no flow changes of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from orchestrator import digits
from orchestrator.bed import poured
from orchestrator.bed.cover import cover
from orchestrator.bed.exposure import shadows
from orchestrator.bed.line import BedLine, of_bed
from orchestrator.bed.packing import APRON, Lattice, Packing, places_along
from orchestrator.bed.pile import pile
from orchestrator.bed.places import Places
from orchestrator.bed.poured import PouredBed
from orchestrator.flow.case import FlowCase
from orchestrator.flow.model import FlowModel, of_scene
from orchestrator.flow.stress import WallStress
from orchestrator.grains import peeling, sheltering
from orchestrator.grains.forces import forces
from orchestrator.grains.peeling import (
    COARSE_TABLE,
    FINE_TABLE,
    RANGE,
    Force,
    ForceTable,
)
from orchestrator.grains.sheltering import Shelter
from orchestrator.runs.files import state_of
from orchestrator.study import methods
from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import PileBed, Range
from orchestrator.study.scene import Scene
from orchestrator.types import BoolArray, FloatArray, IntArray

TOE = 0.05
"""Part of the windward face, from its foot, that may be left without loads."""
KINDS = 20
"""Kinds of grains in a bed beyond which their tables of forces have fewer places."""
LONGEST_PACKED = 5000.0
"""Length of a bed, d, beyond which a range that is counted is packed alone, and of
which no grain is packed where no method is asked for."""
MARGIN = 20.0
"""Fixed bed before and behind the grains of such a range, d: twice the way of a grain
that goes."""
DECIMALS = 7
"""Decimals of the lengths, in d, that a poured bed depends on: beds of another scale
share it."""

_covered = cache(cover)


@cache
def _poured(state: tuple[int, ...], directory: Path, *shown: Any) -> Packing:
    """The packing of a poured bed by `poured.read_poured`, from its file in a state."""
    return poured.read_poured(directory, *shown)


def has_rows_along(scene: Scene) -> bool:
    """Tell whether the grains of a pile lie in rows along its bed line.

    The closed form along the bed line (`method.kind` "local") then answers as pivots
    do. Level rows make stairs of a slope, where each step holds the grains of the one
    below it, and each grain of a poured bed has a pocket of its own.

    Returns
    -------
    bool
        Whether they do.
    """
    if not isinstance(scene.bed, PileBed):
        return False
    return scene.bed.packing in ("aligned", "disordered")


@cache
def _packed(ground: BedLine, lattice: Lattice, line: BedLine) -> Packing:
    """A pile of two faces on a bed line, which obstacles before it make longer."""
    packed = pile(ground, lattice)
    _, arc_length = line.nearest(packed.centres)
    return replace(packed, arc_length=arc_length)


def forget_packings() -> None:
    """Forget the packings that beds share within a process."""
    for shared in (_covered, _packed, _poured):
        shared.cache_clear()


def _constant(value: FloatArray, ustar: ArrayLike) -> FloatArray:
    """The level at the friction velocities at which it was computed."""
    del ustar
    return value


@dataclass(frozen=True)
class Geometry:
    """The bed of a scene with a pile: its line, its n grains, and what no flow changes.

    Attributes
    ----------
    scene
        The scene.
    cases
        The directory of the finished runs; only the grains of a poured bed, and the
        flow over a profile, are read there.
    part
        The part of the bed on which grains are packed, a range of x in diameters; by
        default all.
    """

    scene: Scene
    cases: Path | None = None
    part: Range | None = None

    @property
    def bed(self) -> PileBed:
        """The scene's bed."""
        assert isinstance(self.scene.bed, PileBed)
        return self.scene.bed

    @cached_property
    def model(self) -> FlowModel:
        """The flow over it."""
        return of_scene(self.scene)

    @property
    def flow(self) -> FlowCase:
        """The run of the flow, of a scene whose flow is solved."""
        return self.model.cases[0]

    @cached_property
    def line(self) -> BedLine:
        """The bed line, diameters."""
        return self.model.line.scaled(1 / self.scene.grain.diameter)

    @property
    def counts(self) -> str | Range:
        """Which exposed grains are counted; a range of x in diameters."""
        counts = self.bed.counts
        if isinstance(counts, str):
            return counts
        d = self.scene.grain.diameter
        start, end = counts
        return start / d, end / d

    @cached_property
    def packed_line(self) -> BedLine:
        """The part of the bed line with grains, d: of a long bed the counted range."""
        line = self.line
        part = self.part
        is_long = line.x[-2] - line.x[1] > LONGEST_PACKED
        if part is None and is_long and not self.scene.is_poured:
            counts = self.counts
            part = None if isinstance(counts, str) else counts
        if part is None:
            return line
        start, end = part
        return line.part(start - MARGIN, end + MARGIN, APRON)

    @property
    def is_part(self) -> bool:
        """Whether only a part of the bed is packed."""
        return self.packed_line is not self.line

    @property
    def length(self) -> float:
        """Length of bed that has grains, d."""
        if not self.scene.method.may_pack_grains:
            return 0.0
        return self.packed_line.x[-2] - self.packed_line.x[1]

    @property
    def closed_length(self) -> float:
        """Length of a strip whose ends are made one, d.

        It is a whole number, as the fixed grains under it are one d apart.
        """
        return float(math.floor(self.length + digits.SLACK))

    @property
    def surface(self) -> float:
        """Height over the bed line of the centre of an exposed grain, d."""
        return 0.5 + self.bed.roughness / self.scene.grain.diameter

    @cached_property
    def pouring(self) -> tuple[PouredBed, ...]:
        """The run that pours the bed, if one does."""
        if not self.scene.is_poured:
            return ()
        line = self.line
        grain = self.scene.grain
        # the bed does not depend on how far the flow's domain goes on before and behind
        start = max(line.x[0], line.x[1] - APRON)
        end = min(line.x[-1], line.x[-2] + APRON)
        x = tuple(round(place, DECIMALS) for place in (start, *line.x[1:-1], end))
        z = tuple(round(height, DECIMALS) for height in line.z)
        bed = PouredBed(
            line=replace(line, x=x, z=z),
            depth=self.bed.poured_depth,
            surface=round(self.surface, DECIMALS),
            sizes=grain.sizes,
            diameter=grain.diameter if isinstance(grain.sizes, tuple) else 1.0,
            friction_angle_deg=grain.friction_angle_deg,
            seed=self.bed.seed,
            width=self.bed.width,
        )
        bed.check_size()
        return (bed,)

    @cached_property
    def packing(self) -> Packing:
        """The grains' places, in diameters.

        Scenes that differ in their forces alone share them. By the method "local" they
        are places along the bed line, as many as a figure shows. On the windward sides
        of a profile none is counted where the flow runs back without obstacles; where
        these turn it, grains stay in the count.
        """
        packed = self._packing
        if not self.turned or self.cases is None:
            return packed
        sides = self.sides
        arc_length = packed.arc_length
        if sides is not self:
            _, arc_length = sides.line.nearest(packed.centres)
        is_ahead = sides.felt(sides.model.stress(self.cases), arc_length) > 0
        return replace(
            packed,
            windward=packed.windward & is_ahead,
            lee=packed.lee | packed.windward & ~is_ahead,
        )

    @property
    def turned(self) -> bool:
        """Whether the flow has a say in which sides are windward.

        The noise of a profile rises in a wake as well.
        """
        return self.bed.profile is not None and self.bed.counts == "windward"

    @cached_property
    def sides(self) -> "Geometry":
        """The bed whose flow says which sides are windward: it has no obstacles.

        Beds that differ in these alone are compared: they count the same sides.
        """
        if not (self.turned and self.bed.obstacles):
            return self
        return Geometry(self.scene.without_obstacles(), self.cases)

    @property
    def solved(self) -> tuple[FlowCase, ...]:
        """The runs of the flow over the bed, and before it of that of `sides`."""
        if self.sides is self:
            return self.model.cases
        return (*self.sides.model.cases, *self.model.cases)

    @cached_property
    def _packing(self) -> Packing:
        """The packing, on whichever sides the flow runs back."""
        bed = self.bed
        d = self.scene.grain.diameter
        if not self.scene.method.may_pack_grains:
            return places_along(self.line, self.counts)
        for run in self.pouring:
            assert self.cases is not None, "the grains of a poured bed lie in its run"
            directory = self.cases / run.name
            if self.scene.is_followed:
                return poured.joined(
                    directory,
                    self.closed_length,
                    self.surface,
                    self.scene.method.grains.mobile_layers,
                    bed.width,
                )
            return _poured(
                state_of(directory / poured.BED),
                directory,
                self.line,
                self.counts,
                self.surface,
                self.scene.method.grains.mobile_layers,
                bed.width,
            )
        lattice = Lattice(
            bed.entrainment_angle_deg,
            gap=bed.roughness / d,
            pattern=bed.packing,
            mobile_layers=self.scene.method.grains.mobile_layers,
            disorder=bed.disorder if bed.packing == "disordered" else 0.0,
            seed=bed.seed,
        )
        ground = of_bed(bed.model_copy(update={"obstacles": ()})).scaled(1 / d)
        if bed.is_wedge and not self.is_part:
            return _packed(ground, lattice, self.line)
        if self.is_part:
            x = self.packed_line.x
            ground = replace(ground, x=x, z=tuple(ground.height(np.array(x)).tolist()))
        return _covered(self.line, ground, self.counts, lattice)

    @cached_property
    def tangents(self) -> FloatArray:
        """Unit vector downstream along the bed line under each grain, shape (n, 2)."""
        return np.asarray(self.line.tangents[self.line.under(self.packing.centres)])

    @cached_property
    def _placing(self) -> tuple[FloatArray, FloatArray]:
        """Places of the n centres along the bed line, and their heights over it, d."""
        segment, along = self.line.nearest(self.packing.centres)
        return along, self.line.over(self.packing.centres, segment)

    @cached_property
    def _shadows(self) -> tuple[IntArray, IntArray]:
        """Pairs of grains: one that is hidden, and one that hides it."""
        packed = self.packing
        along, height = self._placing
        flat = np.column_stack([along, np.zeros_like(along)])
        places = Places.of(flat, packed.places.xyz[:, 1], packed.width)
        return shadows(places, height, packed.sizes / 2)

    @property
    def is_balanced(self) -> bool:
        """Whether the grains share the stress of the flow."""
        return self.scene.forces.sheltering == "balanced"

    def exposed(self, present: BoolArray) -> BoolArray:
        """Find the grains that meet the flow while some are present.

        Where the grains share its stress these are those, too, that others hid that
        have gone.

        Parameters
        ----------
        present
            Which grains have not left, shape (n,).

        Returns
        -------
        BoolArray
            Which of them meet the flow, shape (n,).
        """
        packed = self.packing
        first = packed.windward | packed.lee
        if not self.is_balanced or present.all():
            return np.asarray(first & present)
        hidden, hiding = self._shadows
        count = len(present)
        was_hidden = np.bincount(hidden, minlength=count) > 0
        is_hidden = np.bincount(hidden[present[hiding]], minlength=count) > 0
        return np.asarray((first | was_hidden & ~is_hidden) & present)

    def gaps(self, exposed: BoolArray) -> FloatArray:
        """Find how high each grain's lowest point is over where the flow begins.

        By `forces.exposure` it is z0, or follows from the grain's own height over the
        local bed.

        Parameters
        ----------
        exposed
            Which grains are exposed, shape (n,).

        Returns
        -------
        FloatArray
            The heights, m, shape (n,).
        """
        z0 = np.full(len(exposed), self.bed.roughness)
        if self.scene.forces.exposure == "alike":
            return z0
        standing = poured.standing(*self._placing, self.packing.sizes, exposed)
        return z0 + standing * self.scene.grain.diameter

    @cached_property
    def patches(self) -> tuple[IntArray, FloatArray]:
        """Number of each grain's patch, and the areas of the patches, d^2."""
        length = self.scene.forces.averaging_length * self.bed.relief
        length /= self.scene.grain.diameter
        return sheltering.patches(self.packing, max(1.0, length))

    def sheltered(self, exposed: BoolArray, chosen: BoolArray) -> Shelter:
        """Find the levels at which the flow begins on the patches of exposed grains.

        Parameters
        ----------
        exposed
            Which grains are exposed, shape (n,).
        chosen
            Those whose patches are asked about, shape (n,).

        Returns
        -------
        Shelter
            The levels.
        """
        scene = self.scene
        patch, areas = self.patches

        def drag(ustar: FloatArray, sizes: FloatArray, gaps: FloatArray) -> FloatArray:
            """Drag on grains of sizes and gaps."""
            law, _ = forces(scene, sizes, gaps)
            return law(ustar)

        return sheltering.balanced(
            drag,
            patch[chosen],
            self.packing.sizes[chosen],
            self.gaps(exposed)[chosen],
            areas * scene.grain.diameter**2,
            diameter=scene.grain.diameter,
            unit=float(closed_form(scene).friction_velocity),
            density=scene.fluid.density,
        )

    def force_tables(
        self, exposed: BoolArray, only: int | None = None
    ) -> dict[int, ForceTable]:
        """Make force tables of exposed grains that may move, over their own weight.

        Parameters
        ----------
        exposed
            Which grains are exposed, shape (n,).
        only
            The grain whose patch is asked about; by default all.

        Returns
        -------
        dict of int to ForceTable
            The tables by the numbers of the grains.
        """
        patch = np.zeros(len(exposed), int)
        if self.is_balanced:
            patch, _ = self.patches
        chosen = exposed if only is None else exposed & (patch == patch[only])
        pushed = chosen & self.packing.mobile
        columns = (self.packing.sizes, self.gaps(exposed), patch)
        rows = np.column_stack([column[pushed] for column in columns])
        # grains that are alike share a table
        kinds, kind_of = np.unique(rows, axis=0, return_inverse=True)
        shelter = self.sheltered(exposed, chosen) if self.is_balanced else None
        tables = self._tables_of(kinds, shelter)
        numbers = np.flatnonzero(pushed).tolist()
        each = zip(numbers, kind_of.tolist(), strict=True)
        return {number: tables[kind] for number, kind in each}

    def _tables_of(
        self, kinds: FloatArray, shelter: Shelter | None
    ) -> Sequence[ForceTable]:
        """The force tables of kinds of grains: rows of size (d), gap (m) and patch."""
        scene = self.scene
        level: Force = np.zeros_like
        if shelter is not None:
            ustar = shelter.ustar
            level = partial(_constant, shelter.levels.T[kinds[:, 2].astype(int)])
        else:
            count = FINE_TABLE if len(kinds) <= KINDS else COARSE_TABLE
            unit = float(closed_form(scene).friction_velocity)
            ustar = unit * np.geomspace(*RANGE, count)
        drag, lift = forces(scene, kinds[:, :1], kinds[:, 1:2], level)
        return ForceTable.of(drag, lift, scene.weight * kinds[:, 0] ** 3, ustar)

    @cached_property
    def pivot_angles_deg(self) -> FloatArray:
        """Angle from the bed's normal over which each counted grain rolls, shape (N,).

        In a plane that of its foremost contact, in space that of the saddle between
        two.
        """
        packed = self.packing
        angles = peeling.pivot_angles_deg(packed.places, packed.sizes, self.tangents)
        return np.asarray(angles[packed.windward])

    @cached_property
    def is_free(self) -> BoolArray:
        """Which counted grains a free way leads out of their places, shape (N,).

        The others wait until one of the contacts that surround them has left.
        """
        packed = self.packing
        held = peeling.surrounded(packed.places, packed.sizes, packed.windward)
        return np.asarray(~held[packed.windward])

    def felt(self, stress: WallStress, s: FloatArray) -> FloatArray:
        """Average a stress as grains feel it.

        Parameters
        ----------
        stress
            The stress along the bed line.
        s
            Arc lengths, d.

        Returns
        -------
        FloatArray
            Signed friction velocity over u*_0 of the mean stress around each.
        """
        rules = self.scene.forces
        d = self.scene.grain.diameter
        length = max(d, rules.averaging_length * self.bed.relief)
        tau = stress.mean_over(s * d, length, rules.stress)
        return digits.all_rounded(np.sign(tau) * np.sqrt(np.abs(tau)))

    def around(self, x: float) -> Self:
        """Take the same bed by pivots, with grains on a part of it alone.

        Parameters
        ----------
        x
            The middle of a part of `LONGEST_PACKED`, m.

        Returns
        -------
        Geometry
            The bed.
        """
        counts = self.counts
        start = self.line.x[1]
        end = self.line.x[-2]
        if not isinstance(counts, str):
            start = max(start, counts[0])
            end = min(end, counts[1])
        if end - start > LONGEST_PACKED:
            place = x / self.scene.grain.diameter
            start = max(start, place - LONGEST_PACKED / 2)
            end = min(end, place + LONGEST_PACKED / 2)
        by_pivots = self.scene.by(methods.PIVOT)
        return type(self)(by_pivots, self.cases, (start, end))

    @property
    def unloaded(self) -> BoolArray:
        """Grains that go without the flow's force though they are exposed."""
        windward = self.packing.windward
        s = self.packing.arc_length
        if self.scene.forces.loaded_grains == "all but crest":
            return np.asarray(windward & (s == s[windward].max()))
        if self.scene.forces.loaded_grains == "all but toe":
            return np.asarray(windward & (s < TOE * self.line.crest_s))
        return np.zeros_like(windward)
