"""The flow model of a scene: the stress along its bed line, and the cases it needs."""

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import ClassVar, NamedTuple

from orchestrator.bed.line import BedLine, of_bed
from orchestrator.flow import between, theory
from orchestrator.flow.case import FlowCase
from orchestrator.flow.run import SPEED_HEIGHT, WALL_STRESS
from orchestrator.flow.stress import Measure, WallStress
from orchestrator.physics.velocity import log_law_speed
from orchestrator.runs.files import state_of
from orchestrator.study import models
from orchestrator.study.method import FlowMethod
from orchestrator.study.parts import Flow, PileBed
from orchestrator.study.profile import Profile
from orchestrator.study.scene import Scene

FACE_DEG = 2.0
"""Least slope of a profile, degrees, whose cells are as fine as those on a face."""


@dataclass(frozen=True)
class FlowModel:
    """A way to find the stress on the bed of a scene with a pile.

    Each model is a subclass, with its facts in `orchestrator.study.models`.

    Attributes
    ----------
    scene
        The scene.
    """

    scene: Scene
    facts: ClassVar[models.FlowModel]

    @property
    def line(self) -> BedLine:
        """The bed line, m."""
        assert isinstance(self.scene.bed, PileBed)
        return of_bed(self.scene.bed)

    @property
    def lid_speed_ratio(self) -> float:
        """U_e over u*_0: speed of the approaching flow at 10 h over its u*."""
        height = SPEED_HEIGHT * self.line.h
        return float(log_law_speed(1.0, height, self.scene.solve_roughness))

    @property
    def cases(self) -> tuple[FlowCase, ...]:
        """The run that it needs, if the flow is solved.

        Raises
        ------
        InputError
            If the flow cannot be meshed; it names the field.
        """
        return ()

    @property
    def is_between(self) -> bool:
        """Whether the flow is not solved, and lies between others that are."""
        return len(self.cases) > 1

    def error(self, cases: Path) -> float:
        """Measure how far a flow that lies between others is off.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        float
            The relative error of tau, of `between.error`; 0 of one that does not.
        """
        del cases
        return 0.0

    def stress(self, cases: Path) -> WallStress:
        """The stress along the bed.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        WallStress
            The stress on each face of the bed, over the undisturbed one.
        """
        raise NotImplementedError


class Solve(FlowModel):
    """Steady turbulent flow, which scenes that differ in their grains alone share.

    Attributes
    ----------
    scene
        The scene.
    """

    facts: ClassVar[models.FlowModel] = models.SOLVE

    @cached_property
    def cases(self) -> tuple[FlowCase, ...]:
        """The run of OpenFOAM, or those of the roughnesses that it lies between."""
        between = self.scene.method.flow.between
        if not between:
            return (_case(self.scene, self.scene.solve_roughness),)
        return tuple(_case(self.scene, roughness) for roughness in between)

    def stress(self, cases: Path) -> WallStress:
        """The stress that the finished run left, or that between those of some."""
        runs = self._finished(cases)
        if len(runs) == 1:
            return _read(*runs[0][1:])
        return _stress_between(self.scene.solve_roughness, runs)

    def error(self, cases: Path) -> float:
        """Measure how far the stress between solved flows is off; 0 if it is solved."""
        runs = self._finished(cases)
        if len(runs) == 1:
            return 0.0
        return _error_between(self.scene.forces.stress, runs)

    def _finished(self, cases: Path) -> "tuple[_Finished, ...]":
        """The files of the finished runs as they are now."""
        paths = [(run, cases / run.name / WALL_STRESS) for run in self.cases]
        return tuple(
            _Finished(run.roughness_m, path, state_of(path)) for run, path in paths
        )


class Waves(FlowModel):
    """Linear theory.

    Attributes
    ----------
    scene
        The scene.
    """

    facts: ClassVar[models.FlowModel] = models.WAVES

    def stress(self, cases: Path) -> WallStress:
        """The stress of all wavelengths of the bed line."""
        del cases
        return theory.waves(self.line, self.scene.solve_roughness)


class Flat(FlowModel):
    """The undisturbed stress.

    Attributes
    ----------
    scene
        The scene.
    """

    facts: ClassVar[models.FlowModel] = models.FLAT

    def stress(self, cases: Path) -> WallStress:
        """The stress of a flat bed, on each face."""
        del cases
        return theory.flat(self.line)


MODELS: dict[models.FlowModel, type[FlowModel]]
MODELS = {model.facts: model for model in (Solve, Waves, Flat)}


def of_scene(scene: Scene) -> FlowModel:
    """Find the flow model of a scene.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    FlowModel
        The model.
    """
    return MODELS[scene.method.flow.facts](scene)


class _Finished(NamedTuple):
    """A finished run: its roughness length, m, and the file that it left.

    `state` says which file that is: another has another one.
    """

    roughness_m: float
    path: Path
    state: tuple[int, ...]


@lru_cache(maxsize=256)
def _read(path: Path, state: tuple[int, ...]) -> WallStress:
    """The stress in a file as it is now: hundreds of piles share a flow."""
    return WallStress.from_csv(path)


def _solved(runs: tuple[_Finished, ...]) -> dict[float, WallStress]:
    """The stress that each finished run left, by its roughness length, m."""
    return {run.roughness_m: _read(run.path, run.state) for run in runs}


@lru_cache(maxsize=256)
def _stress_between(roughness: float, runs: tuple[_Finished, ...]) -> WallStress:
    """The stress that lies between those of some runs: piles share it, too."""
    return between.stress(roughness, _solved(runs))


@lru_cache(maxsize=256)
def _error_between(measure: Measure, runs: tuple[_Finished, ...]) -> float:
    """How far the stress between those of some runs is off."""
    return between.error(_solved(runs), measure)


def _case(scene: Scene, roughness: float) -> FlowCase:
    """The run of a scene whose flow is solved, with a roughness length, m."""
    bed = scene.bed
    assert isinstance(bed, PileBed)
    numbers = {
        "roughness": roughness,
        "viscosity": scene.solve_viscosity,
        "first_cell_height": scene.first_cell_height,
        "between": (),
    }
    settings = scene.method.flow.model_copy(update=numbers)
    above = scene.flow.model_copy(update={"gusts": None})
    slope = bed.slope_deg
    if bed.profile and slope < FACE_DEG:
        # On a gentle profile cells are as fine as on flat bed.
        slope = 0.0
    return _shared(bed.relief, slope, settings, above, of_bed(bed), bed.profile)


@cache
def _shared(
    height: float,
    slope_deg: float,
    settings: FlowMethod,
    above: Flow,
    line: BedLine,
    profile: Profile | None,
) -> FlowCase:
    """One case for all scenes that share it, checked and digested once."""
    case = FlowCase(height, slope_deg, settings, line, profile, above)
    case.check_mesh()
    return case
