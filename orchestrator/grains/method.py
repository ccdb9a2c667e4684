"""Threshold methods: each says who moved at which flow, and which cases it needs for that."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path

from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile_case import PileCase


@dataclass(frozen=True)
class Method(ABC):
    """A way to find out when the windward grains of a bed move."""

    bed: LoadedBed

    @property
    def cases(self) -> tuple[PileCase, ...]:
        """The runs that it needs besides those of the flow."""
        return ()

    @abstractmethod
    def motion(self, cases: Path) -> Motion:
        """What the windward grains do; `cases` holds the finished runs."""


class Pivot(Method):
    """The closed form: each grain by itself under its own stress. All roll."""

    def motion(self, cases: Path) -> Motion:
        """Motion at the flows of Eq. 3 or 5."""
        return Motion.of_flows(self.bed.alone(self.bed.face(cases).speed))


class Peeling(Method):
    """Pivots that free one another, without dynamics. All roll."""

    def motion(self, cases: Path) -> Motion:
        """Motion at the flows that `orchestrator.grains.peeling` finds."""
        return Motion.of_flows(self.bed.leaving(self.bed.ustar_over_ustar0(cases)))


class Dem(Method):
    """A run of LIGGGHTS under a flow that is raised in steps."""

    @property
    def cases(self) -> tuple[PileCase, ...]:
        """The run."""
        return (PileCase(self.bed.scene),)

    def motion(self, cases: Path) -> Motion:
        """The motion that the finished run left."""
        (case,) = self.cases
        return Motion.from_csv(cases / case.name)


METHODS: dict[str, type[Method]] = {"pivot": Pivot, "peeling": Peeling, "dem": Dem}
"""The methods by what a study file calls them, cheap to dear."""
