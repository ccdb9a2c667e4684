"""Flow models: each gives the stress along a bed line, and says which cases it needs for that."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

from orchestrator.bed.line import BedLine, of_bed
from orchestrator.flow import theory
from orchestrator.flow.case import SPEED_HEIGHT, WALL_STRESS, FlowCase
from orchestrator.flow.stress import WallStress
from orchestrator.physics.velocity import log_law_speed
from orchestrator.study.parts import Flow, PileBed
from orchestrator.study.profile import Profile
from orchestrator.study.scene import BUILDABLE_DEG, Scene


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
        return float(log_law_speed(1.0, SPEED_HEIGHT * self.line.h, self.scene.solve_roughness))

    @property
    def cases(self) -> tuple[FlowCase, ...]:
        """The runs that it needs.

        Raises
        ------
        InputError
            If one cannot be meshed, naming the field of the study file.
        """
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
    return Solved(scene) if scene.flow.model == "solve" else Theory(scene)
