"""The flow model of a scene: the stress along its bed line, and the cases that this needs."""

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
from orchestrator.study.scene import Scene

NODES_PER_DECADE, NODES = 2, 4
"""Nodes in each tenfold of z0/h, and how many of them a flow in between is interpolated from."""
FACE_DEG = 2.0  # least slope of a profile whose cells are as fine as on a face


@dataclass(frozen=True)
class FlowModel:
    """A way to find the stress on the bed of a scene with a pile.

    The scene has the undisturbed stress, that of a linear theory, or that of steady turbulent flow
    by OpenFOAM, which scenes that differ in their grains alone share. With `flow.nodes` the flow is
    solved at fixed values of z0/h, which beds of one form share: on one mesh the stress of each
    face is a smooth function of ln z0, and the cubic through the four nodes around it is within
    0.4 % of the solve, where they are half a decade apart.
    """

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

    @cached_property
    def solves(self) -> dict[Scene, float]:
        """The scenes whose flow is solved, with the weight of each; the nearest node comes first.

        A bed so rough that the mesh does not resolve the node above it is solved by itself.
        """
        scene, height, z0 = self.scene, self.line.h, self.scene.solve_roughness
        if scene.flow.model != "solve" or not scene.flow.nodes:
            return {scene: 1.0} if scene.flow.model == "solve" else {}
        place = NODES_PER_DECADE * log10(z0 / height)
        highest = floor(NODES_PER_DECADE * log10(scene.first_cell_height / height))
        if floor(place) + 1 > highest:
            return {_at(scene, z0): 1.0}
        first = min(floor(place) + 1 - NODES // 2, highest + 1 - NODES)
        nodes = sorted(range(first, first + NODES), key=lambda node: abs(node - place))
        solves = [_at(scene, float(f"{height * 10 ** (n / NODES_PER_DECADE):.6g}")) for n in nodes]
        weights = [np.prod([(place - m) / (n - m) for m in nodes if m != n]) for n in nodes]
        return {s: float(w) for s, w in zip(solves, weights, strict=True) if abs(w) > 1e-9}

    @cached_property
    def cases(self) -> tuple[FlowCase, ...]:
        """The runs that it needs; an InputError names the field if one cannot be meshed."""
        return tuple(_case(scene) for scene in self.solves)

    def stress(self, cases: Path) -> WallStress:
        """The stress along the bed; `cases` holds the finished runs."""
        name, z0 = self.scene.flow.model, self.scene.solve_roughness
        if name == "flat":
            return theory.flat(self.line)
        if name != "solve":
            return (theory.hill if name == "hill" else theory.waves)(self.line, z0)
        paths = [cases / run.name / WALL_STRESS for run in self.cases]
        states = [(path, path.stat()) for path in paths]
        first, *others = (_read(path, file.st_size, file.st_mtime_ns) for path, file in states)
        if not others:
            return first
        parts = list(zip((first, *others), self.solves.values(), strict=True))
        names = "tau_wall", "ustar_over_ustar0_eq10", "ustar_over_ustar0_eq10_printed"
        sums = {name: sum(weight * getattr(part, name) for part, weight in parts) for name in names}
        return replace(first, **sums)


def _at(scene: Scene, roughness: float) -> Scene:
    """The scene whose flow is solved at a roughness length, on the mesh of this one."""
    changes = {"roughness": roughness, "nodes": False, "first_cell_height": scene.first_cell_height}
    parts = {name: getattr(scene, name) for name in Scene.model_fields}
    return Scene.model_construct(**{**parts, "flow": scene.flow.model_copy(update=changes)})


@lru_cache(maxsize=256)
def _read(path: Path, size: int, changed_ns: int) -> WallStress:
    """The stress in a file as it is now: hundreds of piles share a flow."""
    return WallStress.from_csv(path)


def _case(scene: Scene) -> FlowCase:
    """The run of a scene whose flow is solved."""
    bed, update = scene.bed, {"roughness": scene.solve_roughness}
    assert isinstance(bed, PileBed)
    update |= {"viscosity": scene.solve_viscosity, "first_cell_height": scene.first_cell_height}
    # on a gentle profile cells are as fine as on flat bed
    slope = bed.slope_deg if bed.slope_deg >= FACE_DEG or not bed.profile else 0.0
    settings = scene.flow.model_copy(update=update)
    return _shared(bed.relief, slope, settings, of_bed(bed), bed.profile)


@cache
def _shared(
    height: float, slope_deg: float, settings: Flow, line: BedLine, profile: Profile | None
) -> FlowCase:
    """One case for all scenes that share it, checked and digested once."""
    case = FlowCase(height, slope_deg, settings, line, profile)
    case.check_mesh()
    return case
