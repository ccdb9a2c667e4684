"""A pile of grains and its answer: the bed under its flow, with the scene's threshold method."""

from collections.abc import Container, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from orchestrator.grains.loaded_bed import Face, LoadedBed
from orchestrator.grains.method import METHODS, Dem, Method
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile_case import PileCase
from orchestrator.grains.threshold import PileThreshold, of_pile
from orchestrator.grains.wear import Flow, WornFlow
from orchestrator.runs.case import Case


@dataclass(frozen=True)
class Pile(LoadedBed):
    """The pile of a scene."""

    @cached_property
    def method(self) -> Method:
        """How its threshold is found."""
        return METHODS[self.scene.protocol.method](self)

    @cached_property
    def runs(self) -> tuple[Case, ...]:
        """The cases that its answer is read from, those of the flow first."""
        return (*self.model.cases, *self.pouring, *self.method.cases)

    def is_run(self, done: Container[str]) -> bool:
        """Whether all of its runs are among those that are done, by name."""
        return all(run.name in done for run in self.runs)

    @property
    def by_dem(self) -> bool:
        """Whether LIGGGHTS moves its grains."""
        return isinstance(self.method, Dem)

    @property
    def case(self) -> PileCase:
        """The last run of LIGGGHTS, of a scene that asks for DEM."""
        assert isinstance(self.method, Dem)
        return self.method.runs[-1]

    @property
    def flows(self) -> tuple[Flow, ...]:
        """The runs of the flow, one after another on a bed that changes."""
        worn = (run for run in self.method.cases if isinstance(run, WornFlow))
        return (*self.model.cases, *worn)

    def face(self, cases: Path) -> Face:
        """The windward grains, each with the stress on it; on a bed that changes, as it moved."""
        found = super().face(cases)
        if not self.scene.protocol.update:
            return found
        return replace(found, speed=self.method.last(cases).speed[self.packing.windward])

    def motion(self, cases: Path) -> Motion:
        """Motion of the windward grains; `cases` holds the finished runs."""
        return self.method.motion(cases)

    def thresholds(self, cases: Path, fractions: Iterable[float]) -> list[PileThreshold]:
        """Its thresholds at some n/N; `cases` holds the finished runs."""
        motion, speed = self.motion(cases), self.face(cases).speed
        return [of_pile(motion, speed, one, self.scene.fluid.density) for one in fractions]
