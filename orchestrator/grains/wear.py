"""The bed that changes: grains leave in rounds, each under its own flow.

Without `threshold.update` the flow over the initial pile acts until the last grain has
gone, as in the paper, and nothing here is asked. With it the flow is solved after each
round over the bed that is left, and what is left goes on under its forces.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator.bed.line import BedLine
from orchestrator.flow.case import FlowCase
from orchestrator.flow.run import WALL_STRESS
from orchestrator.flow.stress import WallStress
from orchestrator.grains.bed_state import BedState, sunk
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.loads import Loads, under
from orchestrator.runs.case import Case
from orchestrator.solvers import openfoam
from orchestrator.study.scene import BEYOND_ASKED, READ_LATER, Scene


@dataclass(frozen=True)
class WornFlow(Case):
    """The flow over a worn bed, after a round under another flow.

    Attributes
    ----------
    scene
        The scene of the pile.
    before
        The flow of the round before.
    run
        The run of LIGGGHTS in which grains left in that round; None if they left by
        peeling.
    """

    scene: Scene
    before: "FlowCase | WornFlow"
    run: Case | None
    kind: ClassVar[str] = "worn"
    template: ClassVar[str] = FlowCase.template
    results: ClassVar[tuple[str, ...]] = FlowCase.results
    derived: ClassVar[tuple[str, ...]] = FlowCase.derived
    bulky: ClassVar[tuple[str, ...]] = FlowCase.bulky

    @cached_property
    def geometry(self) -> Geometry:
        """The bed of the pile."""
        return Geometry(self.scene)

    @property
    def needs(self) -> tuple[Case, ...]:
        """The flow and the run of the round before, and the run that poured the bed."""
        runs = () if self.run is None else (self.run,)
        if self.geometry.sides is not self.geometry:
            # which of the grains have left is asked of those that are counted
            runs = (*self.geometry.sides.model.cases, *runs)
        return (self.before, *runs, *self.geometry.pouring)

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        return self.scene.described(exclude=READ_LATER)

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s: that of the whole pile."""
        return self.geometry.flow.cost_s

    def versions(self) -> dict[str, str]:
        """The programs that mesh and solve."""
        return self.geometry.flow.versions()

    def write(self, directory: Path, cases: Path) -> None:
        """Draw the bed line through the grains that are there, and mesh it."""
        if self.run is None:
            worn = peeled(Geometry(self.scene, cases), self.before, cases)
        else:
            worn = BedState.from_csv(cases / self.run.name)
        worn.to_csv(directory)
        self._over(worn, cases).write_from(directory, None)

    def said(self, directory: Path) -> str:
        """Say whether the flow took a second try, as any flow's."""
        return openfoam.second_try(directory)

    def collect(self, directory: Path) -> None:
        """Check the run and write the stress and the diagnostics, as any flow's."""
        self._over(BedState.from_csv(directory), directory.parent).collect(directory)

    def _over(self, worn: BedState, cases: Path) -> FlowCase:
        """The flow over what is left of the bed."""
        line = sunk(Geometry(self.scene, cases), worn).scaled(self.scene.grain.diameter)
        return replace(self.geometry.flow, line=line)


FlowRun = FlowCase | WornFlow


def rounds(scene: Scene) -> int:
    """Count the flows that act on a pile until its last fraction has moved.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    int
        How many there are.
    """
    update = scene.threshold.update
    return ceil(max(scene.threshold.fractions) / update - 1e-9) if update else 1


def goal_part(scene: Scene, flow: FlowRun | None) -> float:
    """The part of the counted grains that has moved when the round of a flow ends.

    The last round goes on a little beyond the largest fraction that is asked for, whose
    interval ends where half a grain more has moved.

    Parameters
    ----------
    scene
        The scene of a pile.
    flow
        The flow of the round; None over the whole pile.

    Returns
    -------
    float
        The part, of 1.
    """
    number = 1
    while isinstance(flow, WornFlow):
        flow = flow.before
        number += 1
    part = number * scene.threshold.update
    if number == rounds(scene):
        part = max(part, min(max(scene.threshold.fractions) + BEYOND_ASKED, 1.0))
    return round(part, 9)


def goal(geometry: Geometry, flow: FlowRun | None) -> int:
    """Count the grains that have moved when the round of a flow ends.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round; None over the whole pile.

    Returns
    -------
    int
        How many counted grains that are.
    """
    return ceil(goal_part(geometry.scene, flow) * geometry.packing.count - 1e-9)


def state(geometry: Geometry, flow: FlowRun, cases: Path) -> BedState:
    """Find the grains as they were when the round of a flow began.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round.
    cases
        The directory of the finished runs.

    Returns
    -------
    BedState
        The grains.
    """
    if isinstance(flow, WornFlow):
        return BedState.from_csv(cases / flow.name)
    return BedState.whole(geometry.packing)


def line(geometry: Geometry, flow: FlowRun, cases: Path) -> BedLine:
    """Find the bed line of the round of a flow.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round.
    cases
        The directory of the finished runs.

    Returns
    -------
    BedLine
        The line, d.
    """
    if isinstance(flow, WornFlow):
        return sunk(geometry, state(geometry, flow, cases))
    return geometry.line


def loads(geometry: Geometry, flow: FlowRun, cases: Path) -> Loads:
    """Put the grains under the flow of a round.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round.
    cases
        The directory of the finished runs.

    Returns
    -------
    Loads
        The grains that are there.
    """
    stress = WallStress.from_csv(cases / flow.name / WALL_STRESS)
    if not isinstance(flow, WornFlow):
        return under(geometry, stress)
    worn = line(geometry, flow, cases), state(geometry, flow, cases).present
    return under(geometry, stress, *worn)


def peeled(geometry: Geometry, flow: FlowRun, cases: Path) -> BedState:
    """Find the grains at the end of a round in which they leave by peeling.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round.
    cases
        The directory of the finished runs.

    Returns
    -------
    BedState
        The grains.
    """
    worn = state(geometry, flow, cases)
    under = loads(geometry, flow, cases)
    windward = geometry.packing.windward
    reached = worn.left[np.isfinite(worn.left)].max(initial=0.0)
    flows = np.full(len(windward), np.inf)
    rolling = under.leaving()
    flows[windward] = np.maximum(np.minimum(rolling, under.lifting(rolling)), reached)
    flows[~worn.present] = np.inf
    least = goal(geometry, flow) - worn.moved
    # those that one grain frees at its flow leave with it
    last = 0.0
    if least > 0:
        last = np.sort(flows)[least - 1]
    leave = np.isfinite(flows) & (flows <= last)
    speed = np.where(worn.present, under.ratio, worn.speed)
    places = np.where(leave[:, None], np.nan, worn.places)
    return BedState(places, np.where(leave, flows, worn.left), speed)
