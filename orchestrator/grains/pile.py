"""A pile of grains under the flow over it: one case of LIGGGHTS for each scene."""

from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed import packing
from orchestrator.errors import InputError
from orchestrator.flow import theory
from orchestrator.flow.case import WALL_STRESS, FlowCase
from orchestrator.flow.stress import WallStress
from orchestrator.grains import deck, motion, peeling, protocol, rest
from orchestrator.grains.case import GrainCase
from orchestrator.grains.motion import Motion
from orchestrator.runs.case import Case
from orchestrator.study.scene import PileBed, Scene

FloatArray = NDArray[np.float64]

MARGIN = 3.0
"""From the outermost grains to the walls of the box, and from a face to the height at which a
grain in flight is gone, diameters."""
TOE = 0.05
"""Of the windward face: its lowest part, of the knob `flow.forced`."""

FIELD_OF = {
    "height_m": "bed.height",
    "roughness_m": "bed.roughness",
    "speed_m_s": "flow.speed",
    "viscosity_m2_s": "flow.viscosity",
    "first_cell_m": "flow.first_cell_height",
    "cells_per_face": "flow.cells_per_face",
    "growth": "flow.growth",
    "correctors": "flow.correctors",
}
"""What a study file calls the fields of a flow case."""


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
    """

    ids: NDArray[np.int64]
    arc_length: FloatArray
    speed: FloatArray


_packed = cache(packing.pile)


@cache
def _flow_case(**fields: Any) -> FlowCase:
    """One case for all scenes that share it, checked and digested once."""
    return FlowCase(**fields)


@dataclass(frozen=True)
class PileCase(GrainCase):
    """The grains of one pile."""

    scene: Scene
    kind: ClassVar[str] = "pile"
    recipe: ClassVar[int] = 8

    @property
    def bed(self) -> PileBed:
        """The scene's bed."""
        assert isinstance(self.scene.bed, PileBed)
        return self.scene.bed

    @cached_property
    def flow(self) -> FlowCase:
        """The solved flow that gives the stress; scenes that differ in their grains alone share it.

        Where the stress is that of a theory, its u*_0 and U_e are the theory's too.
        """
        try:
            return _flow_case(
                slope_deg=self.bed.slope_deg,
                height_m=self.bed.height,
                roughness_m=self.scene.solve_roughness,
                speed_m_s=self.scene.flow.speed,
                viscosity_m2_s=self.scene.flow.viscosity,
                first_cell_m=self.scene.first_cell_height,
                cells_per_face=self.scene.flow.cells_per_face,
                growth=self.scene.flow.growth,
                turbulence=self.scene.flow.turbulence,
                convection=self.scene.flow.convection,
                correctors=self.scene.flow.correctors,
            )
        except InputError as error:
            field = FIELD_OF.get(error.where, error.where)
            raise InputError(error.what, where=field, remedy=error.remedy) from None

    @property
    def needs(self) -> tuple[Case, ...]:
        """The flow, where it is solved."""
        return (self.flow,) if self.scene.flow.model == "solve" else ()

    @property
    def runs(self) -> tuple[Case, ...]:
        """The cases that its answer is read from: the flow's and, by DEM, its own."""
        return (*self.needs, self) if self.scene.protocol.method == "dem" else self.needs

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        return self.scene.model_dump(mode="json", exclude={"protocol": {"fractions"}})

    @property
    def cost_s(self) -> float:
        """Expected wall time, s."""
        rules = self.scene.protocol
        count = self.bed.height / np.sin(np.radians(self.bed.slope_deg)) / self.scene.grain.diameter
        # the whole pile is half its rows thick on average
        layers = min(self.bed.mobile_layers, self.bed.height / self.scene.grain.diameter / 2)
        grains = count * (layers + 3)
        holds = np.log(3.5) / np.log1p(rules.step)
        return protocol.run_cost_s(holds, int(grains), rules, self.scene.grain.stiffness)

    @cached_property
    def triangle(self) -> packing.Triangle:
        """The bed line, in diameters."""
        return packing.Triangle(self.bed.slope_deg, self.bed.height / self.scene.grain.diameter)

    @cached_property
    def packing(self) -> packing.Packing:
        """The grains' places, in diameters; scenes that differ in their forces alone share them."""
        return _packed(
            self.triangle,
            entrainment_angle_deg=self.bed.entrainment_angle_deg,
            gap=self.bed.roughness / self.scene.grain.diameter,
            pattern=self.bed.packing,
            mobile_layers=self.bed.mobile_layers,
            disorder=self.bed.disorder if self.bed.packing == "disordered" else 0.0,
            seed=self.bed.seed,
        )

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains with their forces, and the holds of the protocol."""
        speed = self.ustar_over_ustar0(cases)
        rules = self.scene.protocol
        thresholds = np.sort(self._peeled(speed))
        if not 0 < thresholds[0] < np.inf or self.scene.flow.forced != "exposed":
            # a bed that rolls by itself, or is blocked until its grains push: the deck will tell
            thresholds = self.pivot_thresholds(speed[self.packing.windward])
        last = thresholds[int(np.ceil(rules.until * self.packing.count)) - 1]
        if not np.isfinite(last):
            last = thresholds[np.isfinite(thresholds)].max(initial=2 * thresholds[0])
        d, grains = self.scene.grain.diameter, self._grains(speed)
        ceiling = (MARGIN + 0.5) / np.cos(np.radians(self.bed.slope_deg))
        parameters = {
            "diameter": d,
            "density": self.scene.grain.density,
            "gravity": self.scene.reduced_gravity,
            **protocol.contact(self.scene.grain, rules),
            **protocol.raising(rules, int((1 - rules.until) * self.packing.count + 1e-9)),
            "slope": self.bed.slope_deg,
            "ceiling_x": self.triangle.crest[0] * d,
            "ceiling_z": (self.triangle.crest[1] + ceiling) * d,
            "behind": grains.last_mobile + protocol.AWAY * d,
        }
        first, last = protocol.START * thresholds[0], protocol.BEYOND * last
        holds = protocol.holds(first, last, rules.step)
        deck.write(directory, grains, parameters, holds, margin=MARGIN * d)

    def collect(self, directory: Path) -> None:
        """Check the run and write what each windward grain did to ``motion.csv``."""
        self.check(directory)
        grain = self.scene.grain
        rest.check(directory, self._bare, self.scene.weight, grain.stiffness, all_rest=True)
        found = motion.read(directory, self._bare, self.scene.protocol.marker, falls_out=False)
        found.to_csv(directory, self._bare)

    def motion(self, cases: Path) -> Motion:
        """What the windward grains do, by the scene's method; from the finished cases.

        Only the deck shows how a grain moves: without it, all roll.
        """
        if self.scene.protocol.method == "dem":
            return Motion.from_csv(cases / self.name)
        speed = self.ustar_over_ustar0(cases)
        if self.scene.protocol.method == "pivot":
            return Motion.of_flows(self._alone(speed[self.packing.windward]))
        return Motion.of_flows(self._peeled(speed))

    def _peeled(self, speed: FloatArray) -> FloatArray:
        """Undisturbed friction velocity at which each windward grain leaves by peeling, m/s."""
        grains = self._grains(speed)
        flows = peeling.flows(
            self.packing.centres,
            grains.kind >= deck.COUNTED,
            grains.force,
            weight=self.scene.weight,
            along=self.triangle.tangent,
            marker=self.scene.protocol.marker,
        )
        return np.asarray(flows[self.packing.windward])

    def face(self, cases: Path) -> Face:
        """The windward grains and the stress on them, from the finished flow case."""
        chosen = self.packing.windward
        return Face(
            ids=np.flatnonzero(chosen) + 1,
            arc_length=self.packing.arc_length[chosen] * self.scene.grain.diameter,
            speed=self.ustar_over_ustar0(cases)[chosen],
        )

    def pivot_thresholds(self, speed: FloatArray) -> FloatArray:
        """Undisturbed friction velocity at which each grain's own stress reaches Eq. 3 or 5, m/s.

        Sorted, shape (N,); infinite for grains in flow that runs back.
        """
        if not np.any(speed > 0):
            raise InputError(
                "no grain of the windward face feels a flow up the slope",
                where=f"scene {self.scene.id}: flow",
                remedy="look at the flow case; the mesh or the stress is wrong",
            )
        return np.sort(self._alone(speed))

    def _alone(self, speed: FloatArray) -> FloatArray:
        alone = float(self.scene.closed_form(self.scene.closure).friction_velocity)
        return np.where(speed > 0, alone / np.where(speed > 0, speed, 1), np.inf)

    def stress(self, cases: Path) -> WallStress:
        """The flow's stress along the bed: of the finished flow case, or of the scene's theory."""
        bed = self.bed
        match self.scene.flow.model:
            case "flat":
                return theory.flat(bed.slope_deg, bed.height)
            case "hill":
                return theory.hill(bed.slope_deg, bed.height, self.scene.solve_roughness)
            case "solve":
                return WallStress.from_csv(cases / self.flow.name / WALL_STRESS)

    def ustar_over_ustar0(self, cases: Path) -> FloatArray:
        """Signed friction velocity that drives each grain over the undisturbed one.

        Parameters
        ----------
        cases : Path
            Holds the finished flow case, if the stress is that of one.

        Returns
        -------
        ndarray, shape (grains of the packing,)
            Of the mean stress around each grain; positive is downstream.
        """
        flow, d = self.scene.flow, self.scene.grain.diameter
        length = max(d, flow.average * self.bed.height)
        tau = self.stress(cases).mean_over(self.packing.arc_length * d, length, flow.stress)
        return np.where(self._forgotten, 0, np.sign(tau) * np.sqrt(np.abs(tau)))

    @property
    def _forgotten(self) -> NDArray[np.bool_]:
        """Grains that go without the flow's force though they are exposed."""
        windward, s = self.packing.windward, self.packing.arc_length
        if self.scene.flow.forced == "all but crest":
            return np.asarray(windward & (s == s[windward].max()))
        if self.scene.flow.forced == "all but toe":
            return np.asarray(windward & (s < TOE * np.linalg.norm(self.triangle.crest)))
        return np.zeros_like(windward)

    def _grains(self, speed: FloatArray) -> deck.GrainTable:
        """The grains of the deck, with the flow's forces."""
        lee, up = self.packing.lee[:, None], self.triangle.tangent
        along = np.where(lee, up * [1, -1], up)
        outward = np.where(lee, *reversed(self.triangle.normals))
        force = deck.force_table(*self.scene.powers(), speed, along, outward)
        force[:, self._bare.kind < deck.COUNTED] = 0
        return replace(self._bare, force=force)

    @cached_property
    def _bare(self) -> deck.GrainTable:
        """The grains of the deck, without forces."""
        bed, d = self.packing, self.scene.grain.diameter
        kind = np.select(
            [~bed.mobile, bed.windward, bed.lee],
            [deck.FIXED, deck.COUNTED, deck.PUSHED],
            deck.MOBILE,
        )
        x, z = bed.centres.T * d
        return deck.GrainTable(
            position=np.column_stack([x, np.zeros_like(x), z]),
            kind=kind,
            along=np.tile(self.triangle.tangent, (len(x), 1)),
            force=np.zeros((len(deck.POWERS), len(x), 2)),
            diameter=d,
            density=self.scene.grain.density,
        )
