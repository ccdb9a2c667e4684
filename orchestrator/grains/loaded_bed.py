"""The bed of a scene under its flow: bed line, packing, stress on the grains, forces."""

from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed import packing, poured
from orchestrator.bed.line import BedLine, of_bed
from orchestrator.bed.packing import APRON, Lattice, Packing, cover
from orchestrator.bed.poured import PouredBed
from orchestrator.errors import InputError
from orchestrator.flow.case import FlowCase
from orchestrator.flow.model import FlowModel, model
from orchestrator.flow.stress import WallStress
from orchestrator.grains import peeling
from orchestrator.grains.loading import FEWER, PLACES, ForceTable, Loading
from orchestrator.study.closed_form import closed_form, forces, on_slopes
from orchestrator.study.parts import PileBed, Range
from orchestrator.study.scene import Scene

FloatArray = NDArray[np.float64]

TOE = 0.05
"""Part of the windward face, from its foot, that `forces.loaded_grains` may leave out."""

MANY = 20
"""Kinds of grains in a bed beyond which their tables of forces have fewer places."""
DIGITS = 9
"""Digits of the lengths, in d, that a poured bed depends on: beds of another scale share it."""

_packed = cache(packing.pile)
_covered = cache(cover)
_poured = cache(poured.read)


@dataclass(frozen=True)
class Face:
    """The exposed windward grains of a pile, N of them, from the toe to the crest.

    Attributes
    ----------
    ids : ndarray of int, shape (N,)
        Ids in the deck.
    arc_length : ndarray, shape (N,)
        Position along the bed line from the windward toe, m.
    speed : ndarray, shape (N,)
        Local friction velocity over the undisturbed one, signed.
    x : ndarray, shape (N,)
        Place downstream of the foot of the first form, m.
    """

    ids: NDArray[np.int64]
    arc_length: FloatArray
    speed: FloatArray
    x: FloatArray


@dataclass(frozen=True)
class LoadedBed:
    """The bed of a scene of a pile, and the flow's forces on its n grains.

    Attributes
    ----------
    scene : Scene
        A scene with a pile.
    cases : Path or None
        Holds the finished runs; only the grains of a poured bed are read from there.
    """

    scene: Scene
    cases: Path | None = field(default=None, compare=False)

    @property
    def bed(self) -> PileBed:
        """The scene's bed."""
        assert isinstance(self.scene.bed, PileBed)
        return self.scene.bed

    @cached_property
    def model(self) -> FlowModel:
        """The flow over it."""
        return model(self.scene)

    @property
    def flow(self) -> FlowCase:
        """The run of the flow, of a scene whose flow is solved."""
        (case,) = self.model.cases
        return case

    @cached_property
    def line(self) -> BedLine:
        """The bed line, diameters."""
        return self.model.line.scaled(1 / self.scene.grain.diameter)

    @property
    def surface(self) -> float:
        """Height over the bed line of the centre of an exposed grain, d."""
        return 0.5 + self.bed.roughness / self.scene.grain.diameter

    @property
    def counts(self) -> str | Range:
        """Which exposed grains are counted; a range of x in diameters."""
        counts, d = self.bed.counts, self.scene.grain.diameter
        return counts if isinstance(counts, str) else (counts[0] / d, counts[1] / d)

    @cached_property
    def pouring(self) -> tuple[PouredBed, ...]:
        """The run that pours the bed, if one does."""
        if not self.scene.is_poured:
            return ()
        line, grain = self.line, self.scene.grain
        # the bed does not depend on how far the flow's domain goes on before and behind it
        ends = (max(line.x[0], line.x[1] - APRON), min(line.x[-1], line.x[-2] + APRON))
        x = tuple(round(v, DIGITS) for v in (ends[0], *line.x[1:-1], ends[1]))
        z = tuple(round(v, DIGITS) for v in line.z)
        bed = PouredBed(
            line=replace(line, x=x, z=z),
            depth=self.bed.poured_depth,
            surface=round(self.surface, DIGITS),
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
        """The grains' places, in diameters; scenes that differ in their forces alone share them."""
        bed, d, counts = self.bed, self.scene.grain.diameter, self.counts
        for run in self.pouring:
            assert self.cases is not None, "a poured bed is known when its run is done"
            return _poured(
                self.cases / run.name,
                self.line,
                counts,
                surface=self.surface,
                mobile_layers=bed.mobile_layers,
                width=bed.width,
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
        if bed.is_wedge:
            found = _packed(ground, lattice)
            # an obstacle before it makes the way along the bed longer
            return replace(found, arc_length=self.line.nearest(found.centres)[1])
        return _covered(self.line, ground, counts, lattice)

    @cached_property
    def tangents(self) -> FloatArray:
        """Unit vector downstream along the bed line under each grain, shape (n, 2)."""
        return np.asarray(self.line.tangents[self.line.under(self.packing.centres)])

    def downflow(self, ratio: FloatArray) -> FloatArray:
        """Unit vector along the bed, the way that the flow pushes each grain, shape (n, 2).

        `ratio` is what `ustar_over_ustar0` gives.
        """
        return np.where(ratio < 0, -1.0, 1.0)[:, None] * self.tangents

    @property
    def normals(self) -> FloatArray:
        """Unit vector out of the bed under each grain, shape (n, 2)."""
        return np.column_stack([-self.tangents[:, 1], self.tangents[:, 0]])

    def stress(self, cases: Path) -> WallStress:
        """The stress along the bed; `cases` holds the finished runs of the flow."""
        return self.model.stress(cases)

    def ustar_over_ustar0(self, cases: Path) -> FloatArray:
        """Signed friction velocity that drives each grain over the undisturbed one.

        Parameters
        ----------
        cases : Path
            Holds the finished flow case, if the stress is that of one.

        Returns
        -------
        ndarray, shape (n,)
            Ratio for the mean stress around each grain; positive is downstream.
        """
        return self.ratio(self.stress(cases), self.line)

    def ratio(self, stress: WallStress, line: BedLine) -> FloatArray:
        """The same under the stress along a line (d) that the bed may have worn down to."""
        how, d = self.scene.forces, self.scene.grain.diameter
        length = max(d, how.averaging_length * self.bed.relief)
        s = self.packing.arc_length
        if line is not self.line:
            x = np.interp(s, self.line.arc_lengths, self.line.x)
            s = np.interp(x, line.x, line.arc_lengths)
        tau = stress.mean_over(s * d, length, how.stress)
        return np.where(self._forgotten, 0, np.sign(tau) * np.sqrt(np.abs(tau)))

    @property
    def _forgotten(self) -> NDArray[np.bool_]:
        """Grains that go without the flow's force though they are exposed."""
        windward, s = self.packing.windward, self.packing.arc_length
        if self.scene.forces.loaded_grains == "all but crest":
            return np.asarray(windward & (s == s[windward].max()))
        if self.scene.forces.loaded_grains == "all but toe":
            return np.asarray(windward & (s < TOE * self.line.crest_s))
        return np.zeros_like(windward)

    def loading(self, ratio: FloatArray) -> Loading:
        """The forces on the grains; `ratio` as `ustar_over_ustar0` gives it.

        Exposed grains that may move carry a force.
        """
        pushed = self.packing.mobile & (self.packing.windward | self.packing.lee)
        drag, lift = forces(self.scene, self.packing.sizes, self.gaps)
        return Loading(drag, lift, np.where(pushed, ratio, 0.0), self.tangents, self.normals)

    @cached_property
    def gaps(self) -> FloatArray:
        """Height of each grain's lowest point over the level where the flow begins, m, shape (n,).

        By `forces.exposure` it is z0, or follows from the grain's own height over the local bed.
        """
        z0 = np.full(len(self.packing.sizes), self.bed.roughness)
        if self.scene.forces.exposure == "alike":
            return z0
        return z0 + poured.standing(self.packing, self.line) * self.scene.grain.diameter

    @cached_property
    def force_tables(self) -> list[ForceTable]:
        """For each of the n grains, its forces over its own weight; of some use where it is pushed.

        All grains that are not share the table of a grain of d.
        """
        unit, weight = float(closed_form(self.scene).friction_velocity), self.scene.weight
        packed = self.packing
        pushed = packed.mobile & (packed.windward | packed.lee)
        sizes = np.where(pushed, packed.sizes, 1.0).tolist()
        kinds = list(zip(sizes, np.where(pushed, self.gaps, self.gaps[0]).tolist(), strict=True))
        places = PLACES if len(set(kinds)) <= MANY else FEWER
        tables = {
            (size, gap): ForceTable(
                *forces(self.scene, size, gap), weight * size**3, unit, places=places
            )
            for size, gap in set(kinds)
        }
        return [tables[kind] for kind in kinds]

    def face(self, cases: Path) -> Face:
        """The windward grains and the stress on them, from the finished flow case."""
        chosen = self.packing.windward
        return Face(
            ids=np.flatnonzero(chosen) + 1,
            arc_length=self.packing.arc_length[chosen] * self.scene.grain.diameter,
            speed=self.ustar_over_ustar0(cases)[chosen],
            x=self.packing.centres[chosen, 0] * self.scene.grain.diameter,
        )

    def alone(self, speed: FloatArray) -> FloatArray:
        """Undisturbed friction velocity at which each windward grain moves by itself, m/s.

        In a lattice where its stress reaches that of Eq. 3 or 5, in a poured bed where it begins to
        roll out of its own pocket. Where the flow runs back it pushes the grain upstream. Infinite
        for grains without flow.
        """
        counted = self.packing.windward
        if self.pouring:
            ratio = np.zeros(len(self.packing.sizes))
            ratio[counted] = speed
            packed, pushes = self.packing, (self.loading(ratio), self.force_tables)
            found = peeling.pivots(packed.places, packed.sizes, *pushes)
            return np.asarray(found[counted])
        slopes = np.degrees(np.arctan2(self.tangents[counted, 1], self.tangents[counted, 0]))
        threshold = on_slopes(self.scene, np.where(speed < 0, -slopes, slopes))
        return np.where(speed != 0, threshold / np.where(speed != 0, np.abs(speed), 1), np.inf)

    @cached_property
    def pivot_angles_deg(self) -> FloatArray:
        """Angle from the bed's normal over which each counted grain has to roll, shape (N,).

        In a plane that of its foremost contact, in space that of the saddle between two.
        """
        packed = self.packing
        found = peeling.pivot_angles_deg(packed.places, packed.sizes, self.tangents)
        return np.asarray(found[packed.windward])

    def leaving(self, ratio: FloatArray, there: NDArray[np.bool_] | None = None) -> FloatArray:
        """Undisturbed friction velocity at which each windward grain leaves by peeling, m/s.

        Parameters
        ----------
        ratio : ndarray, shape (n,)
            Local friction velocity over the undisturbed one, signed.
        there : ndarray of bool, shape (n,), optional
            The grains that are there; by default all.
        """
        found = peeling.flows(
            self.packing.places,
            self.packing.sizes,
            self.loading(ratio),
            self.force_tables,
            self.scene.protocol.displacement_criterion,
            there,
        )
        return np.asarray(found[self.packing.windward])

    def row_hold(self, cases: Path) -> float:
        """By how much the grains of a lattice's rows hold one another, a ratio of at least 1.

        The flow (u*_0) at which the first counted grain leaves by peeling, over that at which the
        same grain moves by itself; `cases` holds the finished runs of the flow. It is 1 where the
        first grain of a row has none before it, as at a sharp crest, and on a poured bed.
        """
        if self.pouring or self.bed.is_wedge:
            return 1.0
        ratio = self.ustar_over_ustar0(cases)
        leaving, alone = self.leaving(ratio), self.alone(ratio[self.packing.windward])
        first = int(leaving.argmin())
        return max(float(leaving[first] / alone[first]), 1.0) if alone[first] > 0 else 1.0

    def pivot_thresholds(self, speed: FloatArray) -> FloatArray:
        """The same, sorted, shape (N,).

        Raises
        ------
        InputError
            If no grain feels a flow.
        """
        if not np.any(speed != 0):
            raise InputError(
                "no counted grain feels a flow",
                where=f"scene {self.scene.id}: flow",
                remedy="look at the flow case; the mesh or the stress is wrong",
            )
        return np.sort(self.alone(speed))
