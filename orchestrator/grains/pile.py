"""A pile of grains and its answer: the bed under its flow, with the scene's threshold method."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.grains.method import METHODS, Method
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile_case import PileCase
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

    @property
    def case(self) -> PileCase:
        """The run of LIGGGHTS, of a scene that asks for DEM."""
        (case,) = self.method.cases
        return case

    def motion(self, cases: Path) -> Motion:
        """What the windward grains do; `cases` holds the finished runs."""
        return self.method.motion(cases)
