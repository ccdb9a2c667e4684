"""The bed of a scene in grains, and the forces of the flow on them."""

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
from orchestrator.errors import InputError
from orchestrator.flow.case import FlowCase
from orchestrator.flow.model import FlowModel, of_scene
from orchestrator.flow.stress import WallStress
from orchestrator.grains import peeling, sheltering
from orchestrator.grains.peeling import (
    COARSE_TABLE,
    FINE_TABLE,
    RANGE,
    Force,
    ForceTable,
    Loading,
)
from orchestrator.grains.sheltering import Shelter
from orchestrator.physics import threshold
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import LIFT_OFF, check_known, root, thresholds_of
from orchestrator.runs.files import state_of
from orchestrator.study import methods
from orchestrator.study.closed_form import closed_form, single_grain
from orchestrator.study.criterion import SUSTAINED, peak_of, sustaining
from orchestrator.study.declare import UnfitError
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
LOOSE = 1e-4
"""Threshold over that of the scene's grain, below which a grain lies loose: at the
limiting slope round-off leaves it 1e-8. Tables of forces begin there."""
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


def forget_loads() -> None:
    """Forget what beds and grains share within a process.

    The time that a bed takes afterwards is what it takes alone, whatever was asked
    before.
    """
    for shared in (_covered, _packed, _poured):
        shared.cache_clear()
    _LAST.clear()
    threshold.forget()


def forces(
    scene: Scene,
    sizes: ArrayLike = 1.0,
    gaps: ArrayLike | None = None,
    level: Force = np.zeros_like,
) -> tuple[Force, Force]:
    """Make drag and lift on exposed grains of a resolved scene.

    Parameters
    ----------
    scene
        The scene.
    sizes
        Diameters over that of the scene.
    gaps
        Heights of the grains' lowest points above the bed's level, m; by default z0.
    level
        Height above that, m, at which the flow begins, a function of the friction
        velocity, m/s; by default 0.

    Returns
    -------
    drag, lift
        Forces, N, as functions of local friction velocities, m/s.
    """
    law = LAWS[scene.forces.law]
    grain = single_grain(scene)
    diameters = grain.diameter * np.asarray(sizes, float)
    heights = np.asarray(grain.roughness if gaps is None else gaps, float)

    def exposed(ustar: ArrayLike) -> Grain:
        return grain.changed(diameter=diameters, gap=heights - level(ustar))

    def drag(ustar: ArrayLike) -> FloatArray:
        return law.drag(ustar, exposed(ustar))

    def lift(ustar: ArrayLike) -> FloatArray:
        return law.lift(ustar, exposed(ustar))

    return drag, lift


def _constant(value: FloatArray, ustar: ArrayLike) -> FloatArray:
    """The level at the friction velocities at which it was computed."""
    del ustar
    return value


def on_slopes(scene: Scene, slopes_deg: FloatArray) -> FloatArray:
    """Find the friction velocity at which a grain would leave on other slopes.

    Parameters
    ----------
    scene
        The scene.
    slopes_deg
        Slopes, degrees, shape (N,).

    Returns
    -------
    FloatArray
        Friction velocities, m/s, shape (N,); 0 on slopes down which a grain rolls by
        itself, the limiting slope among them.
    """
    slopes, place = np.unique(np.round(slopes_deg, 9), return_inverse=True)
    grains = single_grain(scene).changed(slope_deg=slopes)
    peaks = thresholds_of(scene.forces.law, grains).friction_velocity
    check_known(peaks, scene.forces.law)
    speeds = peaks / np.sqrt(scene.gust)
    is_loose = speeds < LOOSE * float(closed_form(scene).friction_velocity)
    return np.where(is_loose, 0.0, speeds)[place]


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

    def under(
        self,
        stress: WallStress,
        line: BedLine | None = None,
        present: BoolArray | None = None,
    ) -> "Loads":
        """Put the grains under a stress.

        Parameters
        ----------
        stress
            The stress along the bed line.
        line
            The line that the bed has worn down to, if it has.
        present
            Which grains have not left yet, shape (n,); by default all.

        Returns
        -------
        Loads
            The grains under the stress.
        """
        s = self.packing.arc_length
        if line is not None:
            x = np.interp(s, self.line.arc_lengths, self.line.x)
            s = np.interp(x, line.x, line.arc_lengths)
        ratio = np.where(self._unloaded, 0, self.felt(stress, s))
        if present is None:
            present = np.ones(len(ratio), bool)
        return Loads(self, ratio, present)

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

    def interlocking(self, cases: Path) -> float:
        """Find by how much the grains of a lattice's rows hold one another.

        It is 1 on a poured bed and on a pile of two faces, whose rows end at the crest.
        Where no method has packed the bed, grains are packed around the place where
        motion starts.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        float
            The flow (u*_0) at which the first counted grain leaves by peeling, over the
            least at which one of them moves by itself, at least 1; NaN if no grain can
            lie there.
        """
        if self.scene.is_poured or self.bed.is_wedge:
            return 1.0
        is_packed = self.scene.method.may_pack_grains
        if not is_packed and self.scene.threshold.criterion == SUSTAINED:
            # places along the line are of single exposed grains
            return 1.0
        loads = self.loads(cases)
        if is_packed:
            return loads.interlocking()
        alone = loads.alone()
        place = int(np.argmin(np.where(alone > 0, alone, np.inf)))
        x = float(self.packing.centres[self.packing.windward, 0][place])
        try:
            part = self.around(x * self.scene.grain.diameter)
            return part.loads(cases).interlocking()
        except (InputError, UnfitError):
            return math.nan

    def loads(self, cases: Path) -> "Loads":
        """Put the grains under the flow of the whole bed.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        Loads
            The grains under the flow.
        """
        stress = self.model.stress(cases)
        for geometry, under, loads in _LAST:
            if geometry is self and under is stress:
                return loads
        loads = self.under(stress)
        _LAST[:] = [(self, stress, loads)]
        return loads

    @property
    def _unloaded(self) -> BoolArray:
        """Grains that go without the flow's force though they are exposed."""
        windward = self.packing.windward
        s = self.packing.arc_length
        if self.scene.forces.loaded_grains == "all but crest":
            return np.asarray(windward & (s == s[windward].max()))
        if self.scene.forces.loaded_grains == "all but toe":
            return np.asarray(windward & (s < TOE * self.line.crest_s))
        return np.zeros_like(windward)


@dataclass(frozen=True)
class Loads:
    """The n grains of a bed under a flow, and the flows at which they move by geometry.

    Attributes
    ----------
    geometry
        The bed.
    ratio
        Signed friction velocity of the mean stress around each over u*_0, shape (n,).
    present
        Those that have not left yet, shape (n,).
    """

    geometry: Geometry
    ratio: FloatArray
    present: BoolArray

    @cached_property
    def exposed(self) -> BoolArray:
        """Which grains meet the flow, shape (n,)."""
        return self.geometry.exposed(self.present)

    @cached_property
    def loading(self) -> Loading:
        """The forces on the grains: exposed ones that may move carry one."""
        bed = self.geometry
        level: Force = np.zeros_like
        if bed.is_balanced:
            patch, _ = bed.patches
            shelter = bed.sheltered(self.exposed, self.exposed)
            level = partial(shelter.level, patch=patch)
        drag, lift = forces(bed.scene, bed.packing.sizes, bed.gaps(self.exposed), level)
        normals = np.column_stack([-bed.tangents[:, 1], bed.tangents[:, 0]])
        # a gust acts everywhere alike
        carries = self.exposed & bed.packing.mobile
        ratio = np.where(carries, self.ratio * np.sqrt(bed.scene.gust), 0.0)
        return Loading(drag, lift, ratio, bed.tangents, normals)

    @cached_property
    def tables(self) -> dict[int, ForceTable]:
        """Force tables of the exposed grains that may move, by their numbers."""
        return self.geometry.force_tables(self.exposed)

    @property
    def along(self) -> FloatArray:
        """Unit vector along the bed, as the flow pushes each grain, shape (n, 2)."""
        return np.where(self.ratio < 0, -1.0, 1.0)[:, None] * self.geometry.tangents

    def alone(self) -> FloatArray:
        """Find the flow at which each counted grain moves by itself.

        In a lattice where its stress reaches that of Eq. 3 or 5, in a poured bed where
        it begins to roll out of its own pocket. Where the flow runs back it pushes the
        grain upstream.

        Returns
        -------
        FloatArray
            Undisturbed friction velocities, m/s, shape (N,); infinite for grains
            without flow.

        Raises
        ------
        InputError
            If no grain feels a flow.
        """
        bed = self.geometry
        packed = bed.packing
        counted = packed.windward
        if not np.any(self.ratio[counted] != 0):
            what = "no counted grain feels a flow"
            where = f"scene {bed.scene.id}: flow"
            raise InputError(what, where, "the mesh or the stress is wrong")
        if bed.pouring:
            ratio = np.where(counted, self.loading.ratio, 0.0)
            loading = replace(self.loading, ratio=ratio)
            flows = peeling.pivots(
                packed.places, packed.sizes, loading, self.tables, bed.scene.bond
            )
            return digits.all_rounded(flows[counted])
        if bed.is_balanced:
            return self._undisturbed(self._by_tables())
        return self._undisturbed(on_slopes(bed.scene, self._slopes_deg))

    @property
    def _slopes_deg(self) -> FloatArray:
        """Slope that the flow goes up at each counted grain, degrees, shape (N,)."""
        counted = self.geometry.packing.windward
        x, z = self.geometry.tangents[counted].T
        slopes = np.degrees(np.arctan2(z, x))
        return np.asarray(np.where(self.ratio[counted] < 0, -slopes, slopes))

    def sustained(self) -> tuple[FloatArray, FloatArray]:
        """Find the flows from which counted grains go on, and their gust.

        Returns
        -------
        flows, over
            Undisturbed friction velocities of the mean flow, m/s, and the friction
            velocity of the gust in which a grain leaves over that of the mean flow,
            shape (N,). A grain that goes on in any flow has 0.
        """
        scene = self.geometry.scene
        packed = self.geometry.packing
        sizes = packed.sizes[packed.windward]
        shields = sustaining(scene, self._slopes_deg, sizes)
        grain = single_grain(scene)
        ustar = grain.changed(diameter=grain.diameter * sizes).ustar_at(shields)
        # the loads have the scene's own gusts already
        over = np.sqrt(peak_of(scene) / scene.gust)
        return self._undisturbed(ustar), np.full(len(sizes), over)

    def _undisturbed(self, local: FloatArray) -> FloatArray:
        """Undisturbed friction velocity to local ones of counted grains, m/s, (N,)."""
        ratio = np.abs(self.ratio[self.geometry.packing.windward])
        flows = np.full(len(ratio), np.inf)
        return digits.all_rounded(np.divide(local, ratio, out=flows, where=ratio > 0))

    def _by_tables(self) -> FloatArray:
        """Local mean u* (m/s) at which each counted grain of a lattice rolls.

        By drag and lift of the tables of forces, as in peeling.
        """
        scene = self.geometry.scene
        beta = np.radians(scene.pocket_angle_deg)
        drag_arm = float(np.sin(beta))
        lift_arm = float(np.cos(beta))
        held = scene.bond * np.sin(2 * beta)
        goals = np.cos(np.radians(self._slopes_deg) - beta) + held
        numbers = np.flatnonzero(self.geometry.packing.windward).tolist()
        local = []
        for number, goal in zip(numbers, goals.tolist(), strict=True):
            local.append(self.tables[number].reaching(drag_arm, lift_arm, goal))
        return np.asarray(np.array(local) / np.sqrt(scene.gust))

    def leaving(self) -> FloatArray:
        """Find the flow at which each counted grain leaves by peeling.

        Where the grains share the stress, those that are left share it anew after each
        that leaves; under DEM, whose forces a run keeps, they do not.

        Returns
        -------
        FloatArray
            Undisturbed friction velocities, m/s, shape (N,).
        """
        return self._leaving

    @cached_property
    def _leaving(self) -> FloatArray:
        """These flows, found once."""
        bed = self.geometry
        packed = bed.packing
        loading = self.loading
        renew = None
        if bed.is_balanced and bed.scene.method.facts.renews_balance:
            there = self.present.copy()
            ratio = np.where(packed.mobile, self.ratio * np.sqrt(bed.scene.gust), 0.0)
            loading = replace(loading, ratio=ratio)

            def renew(gone: int) -> dict[int, ForceTable]:
                """The tables on the patch of a grain that has gone."""
                there[gone] = False
                return bed.force_tables(bed.exposed(there), gone)

        flows = peeling.leaving(
            packed.places,
            packed.sizes,
            loading,
            self.tables,
            bed.scene.threshold.displacement,
            self.present,
            bed.scene.bond,
            renew,
        )
        return digits.all_rounded(flows[packed.windward])

    def lifting(self, rolling: FloatArray) -> FloatArray:
        """Find the flow at which lift takes each counted grain off.

        It then bears the weight normal to the bed, and what the contacts of a pocket
        pull.

        Parameters
        ----------
        rolling
            Flow at which each grain leaves by rolling, m/s, shape (N,).

        Returns
        -------
        FloatArray
            Undisturbed friction velocities, m/s, shape (N,); infinite for a grain that
            leaves before.
        """
        bed = self.geometry
        scene = bed.scene
        counted = bed.packing.windward
        pulled = 2 * scene.bond * np.sin(np.radians(scene.pocket_angle_deg))
        hold = pulled + bed.tangents[:, 0]
        hold *= scene.weight * bed.packing.sizes**3
        ratio = np.abs(self.ratio) * np.sqrt(scene.gust)
        highest = RANGE[1] * float(closed_form(scene).friction_velocity)
        last = np.full(len(ratio), highest)
        with np.errstate(divide="ignore", invalid="ignore"):
            last[counted] = np.minimum(rolling * ratio[counted], last[counted])
            # to climb straight up is to lift
            is_lifted = counted & (self.loading.lift(last) > hold / LIFT_OFF)
            if not is_lifted.any():
                return np.full_like(rolling, np.inf)
            lifted = np.flatnonzero(is_lifted)

            def excess(ustar: FloatArray, at: IntArray) -> FloatArray:
                """Lift on some of these grains less what holds them, N."""
                every = last.copy()
                every[lifted[at]] = ustar
                return np.asarray((self.loading.lift(every) - hold)[lifted[at]])

            local = np.full_like(last, np.inf)
            bounds = RANGE[0] * last[lifted], LIFT_OFF * last[lifted]
            local[lifted] = root(excess, *bounds)
            flows = (local / ratio)[counted]
        first = np.minimum(digits.all_rounded(flows), rolling)
        return np.where(np.isfinite(flows), first, np.inf)

    def interlocking(self) -> float:
        """Find by how much the grains of a lattice's rows hold one another.

        Grains that lie loose say nothing of it.

        Returns
        -------
        float
            The flow (u*_0) at which the first counted grain leaves by peeling over that
            of pivots; infinite where the row never lets one go.
        """
        alone = self._undisturbed(self._by_tables())
        leaving = self.leaving()
        first_alone = _least(np.minimum(alone, self.lifting(alone)))
        first = _least(np.minimum(leaving, self.lifting(leaving)))
        if math.isinf(first_alone):
            return 1.0
        return max(first / first_alone, 1.0)


def _least(flows: FloatArray) -> float:
    """The least flow above that of loose grains, 0; infinite if there is none."""
    return float(flows[flows > 0].min(initial=np.inf))


_LAST: list[tuple[Geometry, WallStress, Loads]] = []
"""The bed that was put under a flow last, with its grains there: what a table says of a
pile is asked for one after the other. More would fill the memory."""
