"""Threshold methods: each says who moved at which flow, and which cases it needs for that."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from orchestrator.grains import wear
from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile_case import PileCase
from orchestrator.grains.wear import Worn, WornFlow
from orchestrator.runs.case import Case


@dataclass(frozen=True)
class Method(ABC):
    """A way to find out when the windward grains of a bed move."""

    bed: LoadedBed

    @property
    def cases(self) -> tuple[Case, ...]:
        """The runs that it needs besides those of the flow over the whole pile."""
        return ()

    @abstractmethod
    def motion(self, cases: Path) -> Motion:
        """Motion of the windward grains; `cases` holds the finished runs."""

    def last(self, cases: Path) -> Worn:
        """The grains of a bed that changes, when the last round has ended."""
        raise NotImplementedError


class Pivot(Method):
    """The closed form: each grain by itself under its own stress. All roll."""

    def motion(self, cases: Path) -> Motion:
        """Motion at the flows of Eq. 3 or 5."""
        return Motion.of_flows(self.bed.alone(self.bed.face(cases).speed))


class Peeling(Method):
    """Pivots that free one another, without dynamics. All roll."""

    @property
    def cases(self) -> tuple[WornFlow, ...]:
        """The flows over a bed that changes."""
        found: tuple[WornFlow, ...] = ()
        for _ in range(1, wear.rounds(self.bed.scene)):
            before = found[-1] if found else self.bed.flow
            found += (WornFlow(self.bed.scene, before, None),)
        return found

    def motion(self, cases: Path) -> Motion:
        """Motion at the flows that `orchestrator.grains.peeling` finds."""
        if self.bed.scene.protocol.update:
            return Motion.of_flows(self.last(cases).left[self.bed.packing.windward])
        return Motion.of_flows(self.bed.leaving(self.bed.ustar_over_ustar0(cases)))

    def last(self, cases: Path) -> Worn:
        """The grains of a bed that changes, when the last round has ended."""
        flow = self.cases[-1] if self.cases else self.bed.flow
        return wear.peeled(self.bed, flow, cases)


class Dem(Method):
    """A run of LIGGGHTS under a flow that is raised in steps."""

    @property
    def cases(self) -> tuple[Case, ...]:
        """The run; on a bed that changes a run for each flow, which goes on from the last one."""
        found: list[Case] = []
        for run in self.runs:
            found += [run] if run.flow is None else [run.flow, run]
        return tuple(found)

    @cached_property
    def runs(self) -> tuple[PileCase, ...]:
        """The runs of LIGGGHTS."""
        scene, run = self.bed.scene, PileCase(self.bed.scene)
        found = [run]
        for _ in range(1, wear.rounds(scene)):
            flow = WornFlow(scene, run.flow or self.bed.flow, run)
            found.append(run := PileCase(scene, flow, run))
        return tuple(found)

    def motion(self, cases: Path) -> Motion:
        """The motion that the finished run left."""
        found = [Motion.from_csv(cases / run.name) for run in self.runs]
        if len(found) == 1:
            return found[0]
        windward = self.bed.packing.windward
        begun = (wear.grains(self.bed, run.flow or self.bed.flow, cases) for run in self.runs)
        there = (worn.there[windward] for worn in begun)
        return Motion.chained(list(zip(there, found, strict=True)))

    def last(self, cases: Path) -> Worn:
        """The grains of a bed that changes, when the last round has ended."""
        return Worn.from_csv(cases / self.runs[-1].name)


METHODS: dict[str, type[Method]] = {"pivot": Pivot, "peeling": Peeling, "dem": Dem}
"""The methods by what a study file calls them, cheap to dear."""
