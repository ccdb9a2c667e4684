"""The bed of a scene in grains, and the flow's forces on them: what each needs to move."""

import math
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from orchestrator import digits
from orchestrator.bed import packing, poured
from orchestrator.bed.line import BedLine, of_bed
from orchestrator.bed.packing import APRON, Lattice, Packing, Places
from orchestrator.bed.poured import PouredBed
from orchestrator.errors import InputError
from orchestrator.flow.case import FlowCase
from orchestrator.flow.model import FlowModel
from orchestrator.flow.stress import WallStress
from orchestrator.grains import peeling, sheltering
from orchestrator.grains.peeling import FEWER, PLACES, RANGE, Force, ForceTable, Loading
from orchestrator.grains.sheltering import Shelter
from orchestrator.physics import threshold
from orchestrator.physics.laws import LAWS, Exposure
from orchestrator.physics.threshold import LIFT_OFF, root, thresholds_of
from orchestrator.runs.files import state_of
from orchestrator.study.closed_form import closed_form, single_grain
from orchestrator.study.parts import PileBed, Range, UnfitError
from orchestrator.study.scene import Scene
from orchestrator.types import BoolArray, FloatArray, IntArray

TOE = 0.05  # part of the windward face, from its foot, that `forces.loaded_grains` may leave out
KINDS = (
    20  # kinds of grains in a bed beyond which their tables of forces have fewer places
)
LONG = 5000.0
"""Length of a bed, d, beyond which a range that is counted is packed alone, and of which no grain
is packed where no method is asked for."""
MARGIN = 20.0
"""Fixed bed before and behind the grains of such a range, d: twice the way of a grain that goes."""
LOOSE = 1e-4
"""Threshold over that of the scene's grain, below which a grain lies loose: at the limiting slope
round-off leaves it 1e-8. Tables of forces begin there."""
DECIMALS = 7
"""Decimals of the lengths, in d, that a poured bed depends on: beds of another scale share it."""

_covered = cache(packing.cover)


@cache
def _poured(state: tuple[int, ...], directory: Path, *shown: Any) -> Packing:
    """The packing of a poured bed by `poured.read`, from its file in the state that it has."""
    return poured.read(directory, *shown)


def has_rows_along(scene: Scene) -> bool:
    """Whether the grains of a pile lie in rows along its bed line, all in like pockets.

    The closed form along the bed line (`protocol.method` "local") then answers as pivots do.
    Level rows make stairs of a slope, where each step holds the grains of the one below it,
    and each grain of a poured bed has a pocket of its own.
    """
    if not isinstance(scene.bed, PileBed):
        return False
    return scene.bed.packing in ("aligned", "disordered")


@cache
def _packed(ground: BedLine, lattice: Lattice, line: BedLine) -> Packing:
    """A pile of two faces on a bed line: obstacles before it make the way along that longer."""
    packed = packing.pile(ground, lattice)
    return replace(packed, arc_length=line.nearest(packed.centres)[1])


def forget() -> None:
    """Forget what beds and grains share within a process.

    The time that a bed takes afterwards is what it takes alone, whatever was asked before.
    """
    for shared in (_covered, _packed, _poured):
        shared.cache_clear()
    threshold.forget()


def forces(
    scene: Scene,
    sizes: ArrayLike = 1.0,
    gaps: ArrayLike | None = None,
    level: Force = np.zeros_like,
) -> tuple[Force, Force]:
    """Drag and lift on exposed grains of a resolved scene.

    `sizes` are diameters over that of the scene; `gaps` are heights of the grains' lowest points
    above the bed's level, m, by default z0; `level` is the height above that (m) at which the flow
    begins, a function of the friction velocity (m/s), by default 0.
    """
    law, grain = LAWS[scene.forces.law], single_grain(scene)
    given = (grain.diameter * np.asarray(sizes, float), *grain[1:5])
    heights = np.asarray(grain.roughness if gaps is None else gaps, float)

    def drag(ustar: ArrayLike) -> FloatArray:
        return law.drag(ustar, Exposure(*given, heights - level(ustar)))

    def lift(ustar: ArrayLike) -> FloatArray:
        return law.lift(ustar, Exposure(*given, heights - level(ustar)))

    return drag, lift


def on_slopes(scene: Scene, slopes_deg: FloatArray) -> FloatArray:
    """Friction velocity at which the grain of a scene would leave on other slopes, m/s.

    It is 0 on slopes down which a grain rolls by itself, the limiting slope among them.
    """
    slopes, place = np.unique(np.round(slopes_deg, 9), return_inverse=True)
    grain = single_grain(scene)
    grains = [grain._replace(slope_deg=slope) for slope in slopes.tolist()]
    each = [
        answer.friction_velocity for answer in thresholds_of(scene.forces.law, grains)
    ]
    speeds = np.nan_to_num(np.array(each, float), nan=0.0, posinf=np.inf) / np.sqrt(
        scene.gust
    )
    is_loose = speeds < LOOSE * float(closed_form(scene).friction_velocity)
    return np.where(is_loose, 0.0, speeds)[place]


@dataclass(frozen=True)
class Geometry:
    """The bed of a scene with a pile: its line, its n grains, and what no flow changes.

    `cases` is the directory of the finished runs; only the grains of a poured bed are read there.
    Grains are packed on the whole bed, or on a `part` of it, a range of x in diameters.
    """

    scene: Scene
    cases: Path | None = field(default=None, compare=False)
    part: Range | None = None

    @property
    def bed(self) -> PileBed:
        """The scene's bed."""
        assert isinstance(self.scene.bed, PileBed)
        return self.scene.bed

    @cached_property
    def model(self) -> FlowModel:
        """The flow over it."""
        return FlowModel(self.scene)

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
        counts, d = self.bed.counts, self.scene.grain.diameter
        return counts if isinstance(counts, str) else (counts[0] / d, counts[1] / d)

    @cached_property
    def packed_line(self) -> BedLine:
        """The part of the bed line with grains, d: all but of a long bed with a counted range."""
        line, part = self.line, self.part
        is_long = line.x[-2] - line.x[1] > LONG
        if part is None and is_long and not self.scene.is_poured:
            part = None if isinstance(self.counts, str) else self.counts
        if part is None:
            return line
        return line.part(part[0] - MARGIN, part[1] + MARGIN, APRON)

    @property
    def is_part(self) -> bool:
        """Whether only a part of the bed is packed."""
        return self.packed_line is not self.line

    @property
    def length(self) -> float:
        """Length of bed that has grains, d."""
        by_grains = self.scene.protocol.method != "local"
        return (self.packed_line.x[-2] - self.packed_line.x[1]) * by_grains

    @property
    def surface(self) -> float:
        """Height over the bed line of the centre of an exposed grain, d."""
        return 0.5 + self.bed.roughness / self.scene.grain.diameter

    @cached_property
    def pouring(self) -> tuple[PouredBed, ...]:
        """The run that pours the bed, if one does."""
        if not self.scene.is_poured:
            return ()
        line, grain = self.line, self.scene.grain
        # the bed does not depend on how far the flow's domain goes on before and behind it
        ends = (max(line.x[0], line.x[1] - APRON), min(line.x[-1], line.x[-2] + APRON))
        x = tuple(round(v, DECIMALS) for v in (ends[0], *line.x[1:-1], ends[1]))
        z = tuple(round(v, DECIMALS) for v in line.z)
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
        """The grains' places, in diameters; scenes that differ in their forces alone share them.

        By the method "local" they are places along the bed line, as many as a figure shows. On the
        windward sides of a profile none is counted where the flow runs back.
        """
        packed = self._packing
        if self.turned and self.cases is not None:
            ahead = self.felt(self.model.stress(self.cases), packed.arc_length) > 0
            windward, lee = (
                packed.windward & ahead,
                packed.lee | packed.windward & ~ahead,
            )
            packed = replace(packed, windward=windward, lee=lee)
        return packed

    @property
    def turned(self) -> bool:
        """Whether the flow has a say in which sides are windward: noise rises in a wake as well."""
        return self.bed.profile is not None and self.bed.counts == "windward"

    @cached_property
    def _packing(self) -> Packing:
        bed, d = self.bed, self.scene.grain.diameter
        if self.scene.protocol.method == "local":
            return packing.along(self.line, self.counts)
        for run in self.pouring:
            assert self.cases is not None, "the grains of a poured bed lie in its run"
            directory = self.cases / run.name
            return _poured(
                state_of(directory / poured.BED),
                directory,
                self.line,
                self.counts,
                self.surface,
                bed.mobile_layers,
                bed.width,
            )
        lattice = Lattice(
            bed.entrainment_angle_deg,
            gap=bed.roughness / d,
            pattern=bed.packing,
            mobile_layers=bed.mobile_layers,
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
        packed, (along, height) = self.packing, self._placing
        flat = np.column_stack([along, np.zeros_like(along)])
        places = Places.of(flat, packed.places.xyz[:, 1], packed.width)
        return packing.shadows(places, height, packed.sizes / 2)

    @property
    def is_balanced(self) -> bool:
        """Whether the grains share the stress of the flow."""
        return self.scene.forces.sheltering == "balanced"

    def exposed(self, present: BoolArray) -> BoolArray:
        """Which grains meet the flow while some are present, shape (n,).

        Where the grains share its stress these are those, too, that others hid that have gone.
        """
        packed = self.packing
        first = packed.windward | packed.lee
        if not self.is_balanced or present.all():
            return np.asarray(first & present)
        (hidden, hiding), count = self._shadows, len(present)
        freed = np.bincount(hidden, minlength=count) > 0
        freed &= np.bincount(hidden[present[hiding]], minlength=count) == 0
        return np.asarray((first | freed) & present)

    def gaps(self, exposed: BoolArray) -> FloatArray:
        """Height of each grain's lowest point over the level where the flow begins, m, shape (n,).

        By `forces.exposure` it is z0, or follows from the grain's own height over the local bed.
        """
        z0 = np.full(len(exposed), self.bed.roughness)
        if self.scene.forces.exposure == "alike":
            return z0
        standing = poured.standing(*self._placing, self.packing.sizes, exposed)
        return z0 + standing * self.scene.grain.diameter

    @cached_property
    def patches(self) -> tuple[IntArray, FloatArray]:
        """Number of each grain's patch, and the areas of the patches, d^2."""
        length = (
            self.scene.forces.averaging_length
            * self.bed.relief
            / self.scene.grain.diameter
        )
        return sheltering.patches(self.packing, max(1.0, length))

    def sheltered(self, exposed: BoolArray, chosen: BoolArray) -> Shelter:
        """The levels at which the flow begins on the patches of some of the exposed grains."""
        scene, (patch, areas), d = self.scene, self.patches, self.scene.grain.diameter

        def drag(ustar: FloatArray, sizes: FloatArray, gaps: FloatArray) -> FloatArray:
            return forces(scene, sizes, gaps)[0](ustar)

        given = patch[chosen], self.packing.sizes[chosen], self.gaps(exposed)[chosen]
        unit, density = float(closed_form(scene).friction_velocity), scene.fluid.density
        return sheltering.balanced(
            drag, *given, areas * d**2, diameter=d, unit=unit, density=density
        )

    def force_tables(
        self, exposed: BoolArray, only: int | None = None
    ) -> dict[int, ForceTable]:
        """Force tables of exposed grains that may move, over their own weight, by their numbers.

        `only` those on the patch of one grain.
        """
        scene, unit = self.scene, float(closed_form(self.scene).friction_velocity)
        patch, _ = (
            self.patches if self.is_balanced else (np.zeros(len(exposed), int), None)
        )
        chosen = exposed if only is None else exposed & (patch == patch[only])
        pushed = chosen & self.packing.mobile
        columns = self.packing.sizes, self.gaps(exposed), patch
        rows = np.column_stack([column[pushed] for column in columns])
        kinds, place = np.unique(rows, axis=0, return_inverse=True)
        sizes, gaps, patch = kinds[:, :1], kinds[:, 1:2], kinds[:, 2:].astype(int)
        level: Force = np.zeros_like
        ustar = unit * np.geomspace(*RANGE, PLACES if len(kinds) <= KINDS else FEWER)
        if self.is_balanced:
            shelter = self.sheltered(exposed, chosen)
            ustar, level = shelter.ustar, lambda _: shelter.levels.T[patch[:, 0]]
        laws = forces(scene, sizes, gaps, level)
        tables = ForceTable.of(*laws, scene.weight * sizes[:, 0] ** 3, ustar)
        each = zip(np.flatnonzero(pushed).tolist(), place.tolist(), strict=True)
        return {number: tables[kind] for number, kind in each}

    @cached_property
    def pivot_angles_deg(self) -> FloatArray:
        """Angle from the bed's normal over which each counted grain has to roll, shape (N,).

        In a plane that of its foremost contact, in space that of the saddle between two.
        """
        packed = self.packing
        angles = peeling.pivot_angles_deg(packed.places, packed.sizes, self.tangents)
        return np.asarray(angles[packed.windward])

    def under(
        self,
        stress: WallStress,
        line: BedLine | None = None,
        present: BoolArray | None = None,
    ) -> "Loads":
        """The grains under the stress along the bed line, or along the line it has worn down to.

        `present`, shape (n,), has the grains that have not left yet; by default all.
        """
        s = self.packing.arc_length
        if line is not None:
            x = np.interp(s, self.line.arc_lengths, self.line.x)
            s = np.interp(x, line.x, line.arc_lengths)
        ratio = np.where(self._unloaded, 0, self.felt(stress, s))
        return Loads(
            self, ratio, np.ones(len(ratio), bool) if present is None else present
        )

    def felt(self, stress: WallStress, s: FloatArray) -> FloatArray:
        """Signed friction velocity over u*_0 of the mean stress around some arc lengths, d."""
        how, d = self.scene.forces, self.scene.grain.diameter
        length = max(d, how.averaging_length * self.bed.relief)
        tau = stress.mean_over(s * d, length, how.stress)
        return digits.all_rounded(np.sign(tau) * np.sqrt(np.abs(tau)))

    def around(self, x: float) -> Self:
        """The same bed by pivots, with grains on a part of it alone, of `LONG` around x in m."""
        line, counts = self.line, self.counts
        start, end = line.x[1], line.x[-2]
        if not isinstance(counts, str):
            start, end = max(start, counts[0]), min(end, counts[1])
        if end - start > LONG:
            place = x / self.scene.grain.diameter
            start, end = max(start, place - LONG / 2), min(end, place + LONG / 2)
        parts = {name: getattr(self.scene, name) for name in Scene.model_fields}
        parts["protocol"] = self.scene.protocol.model_copy(update={"method": "pivot"})
        return type(self)(Scene(**parts), self.cases, (start, end))

    def row_hold(self, cases: Path) -> float:
        """By how much the grains of a lattice's rows hold one another, a ratio of at least 1.

        The flow (u*_0) at which the first counted grain leaves by peeling, over the least at which
        one of them moves by itself. It is 1 on a poured bed and on a pile of two faces, whose rows
        end at the crest. Where no method has packed the bed, grains are packed around the place
        where motion starts; NaN if none can lie there.
        """
        if self.scene.is_poured or self.bed.is_wedge:
            return 1.0
        loads = self.loads(cases)
        if self.scene.protocol.method != "local":
            return loads.row_hold()
        alone = loads.alone()
        place = int(np.argmin(np.where(alone > 0, alone, np.inf)))
        x = float(self.packing.centres[self.packing.windward, 0][place])
        try:
            part = self.around(x * self.scene.grain.diameter)
            return part.loads(cases).row_hold()
        except (InputError, UnfitError):
            return math.nan

    def loads(self, cases: Path) -> "Loads":
        """The grains under the flow of the whole bed, from the directory of the finished runs."""
        return self.under(self.model.stress(cases))

    @property
    def _unloaded(self) -> BoolArray:
        """Grains that go without the flow's force though they are exposed."""
        windward, s = self.packing.windward, self.packing.arc_length
        if self.scene.forces.loaded_grains == "all but crest":
            return np.asarray(windward & (s == s[windward].max()))
        if self.scene.forces.loaded_grains == "all but toe":
            return np.asarray(windward & (s < TOE * self.line.crest_s))
        return np.zeros_like(windward)


@dataclass(frozen=True)
class Loads:
    """The n grains of a bed under a flow, and the flows at which they move by their geometry.

    `ratio`, (n,), is the signed friction velocity of the mean stress around each over u*_0;
    `present`, (n,), has those that have not left yet.
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
            patch, shelter = bed.patches[0], bed.sheltered(self.exposed, self.exposed)
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
        """Unit vector along the bed, the way that the flow pushes each grain, shape (n, 2)."""
        return np.where(self.ratio < 0, -1.0, 1.0)[:, None] * self.geometry.tangents

    def alone(self) -> FloatArray:
        """Undisturbed friction velocity at which each counted grain moves by itself, m/s, (N,).

        In a lattice where its stress reaches that of Eq. 3 or 5, in a poured bed where it begins to
        roll out of its own pocket. Where the flow runs back it pushes the grain upstream. Infinite
        for grains without flow; an InputError if no grain feels one.
        """
        bed, counted = self.geometry, self.geometry.packing.windward
        speed = self.ratio[counted]
        if not np.any(speed != 0):
            where, remedy = (
                f"scene {bed.scene.id}: flow",
                "the mesh or the stress is wrong",
            )
            raise InputError(
                "no counted grain feels a flow", where=where, remedy=remedy
            )
        if bed.pouring:
            places, sizes = bed.packing.places, bed.packing.sizes
            loading = replace(
                self.loading, ratio=np.where(counted, self.loading.ratio, 0.0)
            )
            flows = peeling.pivots(places, sizes, loading, self.tables, bed.scene.bond)
            return digits.all_rounded(flows[counted])
        if bed.is_balanced:
            return self._undisturbed(self._by_tables())
        return self._undisturbed(on_slopes(bed.scene, self._slopes_deg))

    @property
    def _slopes_deg(self) -> FloatArray:
        """Slope that the flow goes up at each counted grain, degrees, shape (N,)."""
        bed, counted = self.geometry, self.geometry.packing.windward
        slopes = np.degrees(
            np.arctan2(bed.tangents[counted, 1], bed.tangents[counted, 0])
        )
        return np.asarray(np.where(self.ratio[counted] < 0, -slopes, slopes))

    def _undisturbed(self, local: FloatArray) -> FloatArray:
        """The undisturbed friction velocity to local ones of the counted grains, m/s, (N,)."""
        ratio = np.abs(self.ratio[self.geometry.packing.windward])
        flows = np.full(len(ratio), np.inf)
        return digits.all_rounded(np.divide(local, ratio, out=flows, where=ratio > 0))

    def _by_tables(self) -> FloatArray:
        """Local mean u* (m/s) at which each counted grain of a lattice rolls on its slope.

        By drag and lift of the tables of forces, as in peeling, without a torque of the law.
        """
        bed, scene = self.geometry, self.geometry.scene
        beta, tables = np.radians(scene.pocket_angle_deg), self.tables
        goals = np.cos(np.radians(self._slopes_deg) - beta) + scene.bond * np.sin(
            2 * beta
        )
        arms = float(np.sin(beta)), float(np.cos(beta))
        numbers = np.flatnonzero(bed.packing.windward)
        each = zip(numbers.tolist(), goals.tolist(), strict=True)
        local = [tables[number].reaching(*arms, goal) for number, goal in each]
        return np.asarray(np.array(local) / np.sqrt(scene.gust))

    def leaving(self) -> FloatArray:
        """Undisturbed friction velocity at which each counted grain leaves by peeling, m/s, (N,).

        Where the grains share the stress, those that are left share it anew after each that leaves;
        under DEM, whose forces a run keeps, they do not.
        """
        bed, packed, loading, renew = (
            self.geometry,
            self.geometry.packing,
            self.loading,
            None,
        )
        if bed.is_balanced and bed.scene.protocol.method == "peeling":
            there = self.present.copy()
            ratio = np.where(packed.mobile, self.ratio * np.sqrt(bed.scene.gust), 0.0)
            loading = replace(loading, ratio=ratio)

            def renew(gone: int) -> dict[int, ForceTable]:
                there[gone] = False
                return bed.force_tables(bed.exposed(there), gone)

        given = packed.places, packed.sizes, loading, self.tables
        criterion, bond = bed.scene.protocol.displacement_criterion, bed.scene.bond
        flows = peeling.flows(*given, criterion, self.present, bond, renew)
        return digits.all_rounded(flows[packed.windward])

    def lifting(self, rolling: FloatArray) -> FloatArray:
        """Undisturbed friction velocity at which lift takes each counted grain off, m/s, (N,).

        It then bears the weight normal to the bed, and what the contacts of a pocket pull. Infinite
        for a grain that leaves before, at the flow `rolling`, (N,).
        """
        bed, scene, counted = (
            self.geometry,
            self.geometry.scene,
            self.geometry.packing.windward,
        )
        hold = (
            2 * scene.bond * np.sin(np.radians(scene.pocket_angle_deg))
            + bed.tangents[:, 0]
        )
        hold *= scene.weight * bed.packing.sizes**3
        ratio = np.abs(self.ratio) * np.sqrt(scene.gust)
        last = np.full(
            len(ratio), RANGE[1] * float(closed_form(scene).friction_velocity)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            last[counted] = np.minimum(rolling * ratio[counted], last[counted])
            # to climb straight up is to lift
            lifted = counted & (self.loading.lift(last) > hold / LIFT_OFF)
            if not lifted.any():
                return np.full_like(rolling, np.inf)
            bounds = RANGE[0] * last, LIFT_OFF * last
            local = root(lambda ustar: self.loading.lift(ustar) - hold, *bounds)
            flows = np.where(lifted, local / ratio, np.inf)[counted]
        return np.where(
            np.isfinite(flows), np.minimum(digits.all_rounded(flows), rolling), np.inf
        )

    def row_hold(self) -> float:
        """The flow (u*_0) at which the first counted grain leaves by peeling over that of pivots.

        Grains that lie loose say nothing of it. It is infinite where the row never lets one go.
        """
        alone, leaving = self._undisturbed(self._by_tables()), self.leaving()
        first_alone = _least(np.minimum(alone, self.lifting(alone)))
        first = _least(np.minimum(leaving, self.lifting(leaving)))
        if math.isinf(first_alone):
            return 1.0
        return max(first / first_alone, 1.0)


def _least(flows: FloatArray) -> float:
    """The least flow above that of loose grains, 0; infinite if there is none."""
    return float(flows[flows > 0].min(initial=np.inf))
