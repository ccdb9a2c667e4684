"""The grains of a bed under a flow, and the flows at which they move by geometry."""

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from orchestrator import digits
from orchestrator.bed.line import BedLine
from orchestrator.errors import InputError
from orchestrator.flow.stress import WallStress
from orchestrator.grains import peeling
from orchestrator.grains.forces import forces, on_slopes
from orchestrator.grains.geometry import Geometry, forget_packings
from orchestrator.grains.peeling import (
    RANGE,
    Force,
    ForceTable,
    Loading,
)
from orchestrator.physics import threshold
from orchestrator.physics.threshold import LIFT_OFF, root
from orchestrator.study.closed_form import closed_form, single_grain
from orchestrator.study.criterion import SUSTAINED, peak_of, sustaining
from orchestrator.study.declare import UnfitError
from orchestrator.types import BoolArray, FloatArray, IntArray

_LAST: list[tuple[Geometry, WallStress, "Loads"]] = []
"""The bed that was put under a flow last, with its grains there: what a table says of a
pile is asked for one after the other. More would fill the memory."""


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


def under(
    geometry: Geometry,
    stress: WallStress,
    line: BedLine | None = None,
    present: BoolArray | None = None,
) -> Loads:
    """Put the grains under a stress.

    Parameters
    ----------
    geometry
        The bed.
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
    s = geometry.packing.arc_length
    if line is not None:
        x = np.interp(s, geometry.line.arc_lengths, geometry.line.x)
        s = np.interp(x, line.x, line.arc_lengths)
    ratio = np.where(geometry.unloaded, 0, geometry.felt(stress, s))
    if present is None:
        present = np.ones(len(ratio), bool)
    return Loads(geometry, ratio, present)


def loads_of(geometry: Geometry, cases: Path) -> Loads:
    """Put the grains under the flow of the whole bed.

    Parameters
    ----------
    geometry
        The bed.
    cases
        The directory of the finished runs.

    Returns
    -------
    Loads
        The grains under the flow.
    """
    stress = geometry.model.stress(cases)
    for bed, flow, loads in _LAST:
        if bed is geometry and flow is stress:
            return loads
    loads = under(geometry, stress)
    _LAST[:] = [(geometry, stress, loads)]
    return loads


def interlocking(geometry: Geometry, cases: Path) -> float:
    """Find by how much the grains of a lattice's rows hold one another.

    It is 1 on a poured bed and on a pile of two faces, whose rows end at the crest.
    Where no method has packed the bed, grains are packed around the place where
    motion starts.

    Parameters
    ----------
    geometry
        The bed.
    cases
        The directory of the finished runs.

    Returns
    -------
    float
        The flow (u*_0) at which the first counted grain leaves by peeling, over the
        least at which one of them moves by itself, at least 1; NaN if no grain can
        lie there.
    """
    if geometry.scene.is_poured or geometry.bed.is_wedge:
        return 1.0
    is_packed = geometry.scene.method.may_pack_grains
    if not is_packed and geometry.scene.threshold.criterion == SUSTAINED:
        # places along the line are of single exposed grains
        return 1.0
    loads = loads_of(geometry, cases)
    if is_packed:
        return loads.interlocking()
    alone = loads.alone()
    place = int(np.argmin(np.where(alone > 0, alone, np.inf)))
    x = float(geometry.packing.centres[geometry.packing.windward, 0][place])
    try:
        part = geometry.around(x * geometry.scene.grain.diameter)
        return loads_of(part, cases).interlocking()
    except (InputError, UnfitError):
        return math.nan


def forget_loads() -> None:
    """Forget what beds and grains share within a process.

    The time that a bed takes afterwards is what it takes alone, whatever was asked
    before.
    """
    forget_packings()
    _LAST.clear()
    threshold.forget()
