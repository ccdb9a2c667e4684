"""What the threshold methods do: which runs they need, and when grains move.

Their facts are in `orchestrator.study.methods`.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

from orchestrator.grains import wear
from orchestrator.grains.bed_state import BedState
from orchestrator.grains.followed import FollowedCase
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.loads import loads_of
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile_case import PileCase
from orchestrator.grains.wear import FlowRun, WornFlow
from orchestrator.runs.case import Case
from orchestrator.study import methods
from orchestrator.study.methods import ThresholdMethod


@dataclass(frozen=True)
class Method:
    """A way to find out when the counted grains of a bed move.

    Each method is a subclass.

    Attributes
    ----------
    geometry
        The pile.
    """

    geometry: Geometry
    facts: ClassVar[ThresholdMethod]

    @property
    def cases(self) -> tuple[Case, ...]:
        """The runs that it needs besides those of the flow over the whole pile."""
        return ()

    def motion(self, cases: Path) -> Motion:
        """Find the motion of the counted grains.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        Motion
            When each of them moved.
        """
        raise NotImplementedError

    def last(self, cases: Path) -> BedState:
        """Find the grains of a bed that changes when the last round has ended.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        BedState
            The grains.
        """
        raise NotImplementedError


class Pivot(Method):
    """The closed form: each grain moves by itself under its own stress.

    Attributes
    ----------
    geometry
        The pile.
    """

    facts: ClassVar[ThresholdMethod] = methods.PIVOT

    def motion(self, cases: Path) -> Motion:
        """Motion at the flows of Eq. 3 or 5, or at those that lift a grain before."""
        loads = loads_of(self.geometry, cases)
        return Motion.of_flows(rolling := loads.alone(), loads.lifting(rolling))


class Local(Pivot):
    """The closed form along the bed line: places take the part of grains.

    Attributes
    ----------
    geometry
        The pile.
    """

    facts: ClassVar[ThresholdMethod] = methods.LOCAL


class Peeling(Method):
    """Pivots that free one another, without dynamics.

    A grain that lift takes off frees none.

    Attributes
    ----------
    geometry
        The pile.
    """

    facts: ClassVar[ThresholdMethod] = methods.PEELING

    @property
    def cases(self) -> tuple[WornFlow, ...]:
        """The flows over a bed that changes."""
        scene = self.geometry.scene
        runs: list[WornFlow] = []
        for _ in range(1, wear.rounds(scene)):
            before = runs[-1] if runs else self.geometry.flow
            runs.append(WornFlow(scene, before, None))
        return tuple(runs)

    def motion(self, cases: Path) -> Motion:
        """Motion at the flows that `orchestrator.grains.peeling` finds."""
        if self.geometry.scene.threshold.update:
            left = self.last(cases).left
            return Motion.of_flows(left[self.geometry.packing.windward])
        loads = loads_of(self.geometry, cases)
        rolling = loads.leaving()
        return Motion.of_flows(rolling, loads.lifting(rolling))

    def last(self, cases: Path) -> BedState:
        """The grains of a bed that changes, when the last round has ended."""
        flow: FlowRun = self.geometry.flow
        runs = self.cases
        if runs:
            flow = runs[-1]
        return wear.peeled(self.geometry, flow, cases)


class Dem(Method):
    """A run of LIGGGHTS under a flow that is raised in steps.

    Attributes
    ----------
    geometry
        The pile.
    """

    facts: ClassVar[ThresholdMethod] = methods.DEM

    @property
    def cases(self) -> tuple[Case, ...]:
        """The run.

        A bed that changes has a run for each flow, which goes on from the last one.
        """
        if self.geometry.scene.is_followed:
            return (FollowedCase(self.geometry.scene),)
        return tuple(
            case for run in self.runs for case in (run.flow, run) if case is not None
        )

    @cached_property
    def runs(self) -> tuple[PileCase, ...]:
        """The runs of LIGGGHTS."""
        scene = self.geometry.scene
        runs = [PileCase(scene)]
        for _ in range(1, wear.rounds(scene)):
            before = runs[-1]
            flow = WornFlow(scene, before.flow or self.geometry.flow, before)
            runs.append(PileCase(scene, flow, before))
        return tuple(runs)

    def motion(self, cases: Path) -> Motion:
        """The motion that the finished runs left."""
        if self.geometry.scene.is_followed:
            (followed,) = self.cases
            return Motion.from_csv(cases / followed.name)
        motions = [Motion.from_csv(cases / run.name) for run in self.runs]
        if len(motions) == 1:
            return motions[0]
        windward = self.geometry.packing.windward
        parts = []
        for run, part in zip(self.runs, motions, strict=True):
            begun = wear.state(self.geometry, run.flow or self.geometry.flow, cases)
            parts.append((begun.present[windward], part))
        return Motion.chained(parts)

    def last(self, cases: Path) -> BedState:
        """The grains of a bed that changes, when the last round has ended."""
        return BedState.from_csv(cases / self.runs[-1].name)


METHODS: dict[ThresholdMethod, type[Method]]
METHODS = {method.facts: method for method in (Local, Pivot, Peeling, Dem)}
"""The method that each word of a study file asks for, by its facts."""
