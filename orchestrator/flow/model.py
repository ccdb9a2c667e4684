"""Flow models: each gives the stress along a bed line, and says which cases it needs for that."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from math import floor, log10
from pathlib import Path

import numpy as np

from orchestrator.bed.line import BedLine, of_bed
from orchestrator.flow import theory
from orchestrator.flow.case import SPEED_HEIGHT, WALL_STRESS, FlowCase
from orchestrator.flow.stress import WallStress
from orchestrator.physics.velocity import log_law_speed
from orchestrator.study.parts import Flow, PileBed
from orchestrator.study.profile import Profile
from orchestrator.study.scene import BUILDABLE_DEG, Scene

NODES_PER_DECADE, NODES = 2, 4
"""Nodes in each tenfold of z0/h, and how many of them a flow in between is interpolated from."""


@dataclass(frozen=True)
class FlowModel(ABC):
    """A way to find the stress on the bed of a scene with a pile."""

    scene: Scene

    @property
    def line(self) -> BedLine:
        """The bed line, m."""
        assert isinstance(self.scene.bed, PileBed)
        return of_bed(self.scene.bed)

    @property
    def lid_speed_ratio(self) -> float:
        """U_e over u*_0: the approaching flow's speed at 10 h over its friction velocity."""
        return float(log_law_speed(1.0, SPEED_HEIGHT * self.line.h, self.scene.solve_roughness))

    @property
    def cases(self) -> tuple[FlowCase, ...]:
        """The runs that it needs; an InputError names the field if one cannot be meshed."""
        return tuple(run for solve in self.solves for run in solve.cases)

    @property
    def solves(self) -> "tuple[Solved, ...]":
        """The solved flows that it is made of."""
        return ()

    @abstractmethod
    def stress(self, cases: Path) -> WallStress:
        """The stress along the bed; `cases` holds the finished runs."""


class Theory(FlowModel):
    """The undisturbed stress, or a linear theory of the flow over low hills or waves."""

    def stress(self, cases: Path) -> WallStress:
        """The stress by `theory.flat`, `theory.hill` or `theory.waves`."""
        name, z0 = self.scene.flow.model, self.scene.solve_roughness
        if name == "flat":
            return theory.flat(self.line)
        return (theory.hill if name == "hill" else theory.waves)(self.line, z0)


class Solved(FlowModel):
    """Steady turbulent flow by OpenFOAM; scenes that differ in their grains alone share it."""

    @property
    def solves(self) -> "tuple[Solved, ...]":
        """Itself."""
        return (self,)

    @property
    def cases(self) -> tuple[FlowCase, ...]:
        """The run."""
        scene, bed = self.scene, self.scene.bed
        assert isinstance(bed, PileBed)
        settings = scene.flow.model_copy(
            update={
                "roughness": scene.solve_roughness,
                "viscosity": scene.solve_viscosity,
                "first_cell_height": scene.first_cell_height,
            }
        )
        # on a gentler profile cells are as fine as on flat bed
        slope = bed.slope_deg if bed.slope_deg >= BUILDABLE_DEG[0] else 0.0
        return (_shared(bed.relief, slope, settings, self.line, bed.profile),)

    def stress(self, cases: Path) -> WallStress:
        """The stress that the finished run left."""
        path = cases / self.cases[0].name / WALL_STRESS
        file = path.stat()
        return _read(path, file.st_size, file.st_mtime_ns)


class Interpolated(FlowModel):
    """The flow between solves at fixed values of z0/h, which beds of one form share.

    On one mesh the stress of each face is a smooth function of ln z0. The cubic through the four
    nodes around it is within 0.4 % of the solve, where they are half a decade apart.
    """

    @cached_property
    def weights(self) -> "dict[Solved, float]":
        """The weight of each solve, that of the nearest node first.

        A bed so rough that the mesh does not resolve the node above it is solved by itself.
        """
        scene, height, z0 = self.scene, self.line.h, self.scene.solve_roughness
        place = NODES_PER_DECADE * log10(z0 / height)
        highest = floor(NODES_PER_DECADE * log10(scene.first_cell_height / height))
        if floor(place) + 1 > highest:
            return {_at(scene, z0): 1.0}
        first = min(floor(place) + 1 - NODES // 2, highest + 1 - NODES)
        nodes = sorted(range(first, first + NODES), key=lambda node: abs(node - place))
        solves = [_at(scene, float(f"{height * 10 ** (n / NODES_PER_DECADE):.6g}")) for n in nodes]
        weights = [np.prod([(place - m) / (n - m) for m in nodes if m != n]) for n in nodes]
        return {s: float(w) for s, w in zip(solves, weights, strict=True) if abs(w) > 1e-9}

    @property
    def solves(self) -> tuple[Solved, ...]:
        """The solves at the nodes."""
        return tuple(self.weights)

    def stress(self, cases: Path) -> WallStress:
        """The stress between the nodes, cubic in ln z0."""
        parts = [(solve.stress(cases), weight) for solve, weight in self.weights.items()]
        names = "tau_wall", "ustar_over_ustar0_eq10", "ustar_over_ustar0_eq10_printed"
        sums = {name: sum(weight * getattr(part, name) for part, weight in parts) for name in names}
        return replace(parts[0][0], **sums)


def _at(scene: Scene, roughness: float) -> Solved:
    """The solve at a roughness length, on the mesh of the scene."""
    changes = {"roughness": roughness, "nodes": False, "first_cell_height": scene.first_cell_height}
    parts = {name: getattr(scene, name) for name in Scene.model_fields}
    return Solved(Scene(**{**parts, "flow": scene.flow.model_copy(update=changes)}))


@lru_cache(maxsize=256)
def _read(path: Path, size: int, changed_ns: int) -> WallStress:
    """The stress in a file as it is now: hundreds of piles share a flow."""
    return WallStress.from_csv(path)


@cache
def _shared(
    height: float, slope_deg: float, settings: Flow, line: BedLine, profile: Profile | None
) -> FlowCase:
    """One case for all scenes that share it, checked and digested once."""
    case = FlowCase(height, slope_deg, settings, line, profile)
    case.check_mesh()
    return case


def model(scene: Scene) -> FlowModel:
    """The flow model that a scene of a pile asks for."""
    if scene.flow.model != "solve":
        return Theory(scene)
    return Interpolated(scene) if scene.flow.nodes else Solved(scene)
