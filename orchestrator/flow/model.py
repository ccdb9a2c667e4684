"""Flow models: each gives the stress along a bed line, and says which cases it needs for that."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from orchestrator.bed.line import BedLine, of_bed
from orchestrator.errors import InputError
from orchestrator.flow import theory
from orchestrator.flow.case import SPEED_HEIGHT, WALL_STRESS, FlowCase
from orchestrator.flow.channel import ChannelFlow
from orchestrator.flow.stress import WallStress, undisturbed_ustar
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import BUILDABLE_DEG, Scene

FIELD_OF = {
    "height_m": "bed.height",
    "roughness_m": "bed.roughness",
    "speed_m_s": "flow.speed",
    "viscosity_m2_s": "flow.viscosity",
    "first_cell_m": "flow.first_cell_height",
    "cells_per_face": "flow.cells_per_face",
    "expansion_ratio": "flow.expansion_ratio",
    "lid": "flow.lid",
    "upstream": "flow.upstream",
    "downstream": "flow.downstream",
    "non_orthogonal_correctors": "flow.non_orthogonal_correctors",
}
"""Names in a study file of the parameters of a flow case."""


@dataclass(frozen=True)
class FlowModel(ABC):
    """A way to find the stress on the bed of a scene.

    Parameters
    ----------
    scene : Scene
        A scene with a pile.
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
        height = SPEED_HEIGHT * self.line.h
        return 1 / undisturbed_ustar(1.0, height, self.scene.solve_roughness)

    @property
    def cases(self) -> tuple[FlowCase, ...]:
        """The runs that it needs."""
        return ()

    @abstractmethod
    def stress(self, cases: Path) -> WallStress:
        """The stress along the bed; `cases` holds the finished runs."""


class Flat(FlowModel):
    """The undisturbed stress everywhere, as on a flat bed."""

    def stress(self, cases: Path) -> WallStress:
        """Tau = tau_0."""
        return theory.flat(self.line)


class Hill(FlowModel):
    """Linear theory of the flow over a low hill."""

    def stress(self, cases: Path) -> WallStress:
        """The stress by `theory.hill`."""
        return theory.hill(self.line, self.scene.solve_roughness)


class Waves(FlowModel):
    """Linear theory of the flow over low waves, each wavelength by itself."""

    def stress(self, cases: Path) -> WallStress:
        """The stress by `theory.waves`."""
        return theory.waves(self.line, self.scene.solve_roughness)


class Solved(FlowModel):
    """Steady turbulent flow by OpenFOAM; scenes that differ in their grains alone share it."""

    @property
    def case(self) -> FlowCase:
        """The run.

        Raises
        ------
        InputError
            If it cannot be built, naming the field of the study file.
        """
        bed, flow = self.scene.bed, self.scene.flow
        assert isinstance(bed, PileBed)
        channel = {} if flow.depth is None else {"closed": flow.top == "closed channel"}
        try:
            return _shared(
                **channel,
                line=self.line,
                profile=bed.profile,
                lid=flow.depth / bed.relief if flow.depth else flow.lid,
                upstream=flow.upstream,
                downstream=flow.downstream,
                # on a gentler profile cells are as fine as on flat bed
                slope_deg=bed.slope_deg if bed.slope_deg >= BUILDABLE_DEG[0] else 0.0,
                height_m=bed.relief,
                roughness_m=self.scene.solve_roughness,
                speed_m_s=flow.speed,
                viscosity_m2_s=self.scene.solve_viscosity,
                first_cell_m=self.scene.first_cell_height,
                cells_per_face=flow.cells_per_face,
                expansion_ratio=flow.expansion_ratio,
                turbulence_model=flow.turbulence_model,
                convection_scheme=flow.convection_scheme,
                non_orthogonal_correctors=flow.non_orthogonal_correctors,
            )
        except InputError as error:
            field = FIELD_OF.get(error.where, error.where)
            raise InputError(error.what, where=field, remedy=error.remedy) from None

    @property
    def cases(self) -> tuple[FlowCase, ...]:
        """The run."""
        return (self.case,)

    def stress(self, cases: Path) -> WallStress:
        """The stress that the finished run left."""
        path = cases / self.case.name / WALL_STRESS
        found = path.stat()
        return _read(path, found.st_size, found.st_mtime_ns)


@lru_cache(maxsize=256)
def _read(path: Path, size: int, changed_ns: int) -> WallStress:
    """The stress in a file as it is now: hundreds of piles share a flow."""
    return WallStress.from_csv(path)


@cache
def _shared(**fields: Any) -> FlowCase:
    """One case for all scenes that share it, checked and digested once."""
    case = ChannelFlow(**fields) if "closed" in fields else FlowCase(**fields)
    case.check_grid()
    return case


MODELS: dict[str, type[FlowModel]] = {
    "flat": Flat,
    "hill": Hill,
    "waves": Waves,
    "solve": Solved,
}
"""The models by what a study file calls them, cheap to dear."""


def model(scene: Scene) -> FlowModel:
    """The flow model that a scene of a pile asks for."""
    return MODELS[scene.flow.model](scene)
