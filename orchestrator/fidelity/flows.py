"""Which flows of a study are solved, and which lie between solved ones.

Piles that differ in their roughness alone have flows of one family: one bed and one
mesh. Where a study has a tolerance, some flows of a large family are solved, and the
others are put between them (`orchestrator.flow.between`). Where the solved ones show
that this is off by more than `between.MOST_ERROR`, all are solved.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from orchestrator.fidelity.decision import Decision, Decisions
from orchestrator.flow import between
from orchestrator.flow.case import FlowCase
from orchestrator.flow.model import FlowModel, of_scene
from orchestrator.runs.case import done_state
from orchestrator.study.parts import PileBed
from orchestrator.study.study import changed

FIELD = "method.flow.between"


def shared(answers: Decisions, checks: Decisions) -> tuple[Decisions, Decisions]:
    """Put flows between others where a family of flows is large.

    Parameters
    ----------
    answers, checks
        Decisions by the ids of the asked scenes.

    Returns
    -------
    answers, checks : dict of str to Decision
        The same with the scenes that answer now.
    """
    families: dict[FlowCase, set[float]] = {}
    for answer in (*answers.values(), *checks.values()):
        flow = _flow(answer)
        if flow is not None:
            families.setdefault(_family(flow), set()).add(flow.roughness_m)
    nodes = {each: between.nodes([*found]) for each, found in families.items()}

    def put(answer: Decision) -> Decision:
        flow = _flow(answer)
        if flow is None:
            return answer
        solved = nodes[_family(flow)]
        return answer if flow.roughness_m in solved else _with(answer, solved)

    return _each(put, answers), _each(put, checks)


def solved(
    answers: Decisions, checks: Decisions, cases: Path
) -> tuple[Decisions, Decisions] | None:
    """Solve the flows that finished ones show not to lie between them.

    Parameters
    ----------
    answers, checks
        Decisions by the ids of the asked scenes.
    cases
        The directory of the runs.

    Returns
    -------
    answers, checks : dict of str to Decision
        The same with the scenes that answer now; None where there are no such flows.
    """
    off: dict[object, bool] = {}
    for answer in (*answers.values(), *checks.values()):
        model = _between(answer)
        if model and _solves(model) not in off:
            off[_solves(model)] = _is_off(model, cases)
    if not any(off.values()):
        return None

    def solve(answer: Decision) -> Decision:
        model = _between(answer)
        return _with(answer, ()) if model and off[_solves(model)] else answer

    return _each(solve, answers), _each(solve, checks)


def lying(answers: Iterable[Decision]) -> set[FlowCase]:
    """List the flows that are not solved, each once.

    Parameters
    ----------
    answers
        The decisions of a study.

    Returns
    -------
    set of FlowCase
        The flows as they would be solved.
    """
    found = set()
    for answer in answers:
        if model := _between(answer):
            family = _family(model.cases[0])
            roughness = {"roughness": answer.scene.solve_roughness}
            settings = family.settings.model_copy(update=roughness)
            found.add(replace(family, settings=settings))
    return found


def _each(change: Callable[[Decision], Decision], group: Decisions) -> Decisions:
    """Decisions with each of them changed."""
    return {key: change(each) for key, each in group.items()}


def _flow(answer: Decision) -> FlowCase | None:
    """The flow of a pile that is solved once, over a bed that does not change.

    Of piles whose windward grains are counted: no error is measured in a wake.
    """
    scene = answer.scene
    bed = scene.bed
    if not isinstance(bed, PileBed) or scene.threshold.update:
        return None
    if bed.counts != "windward":
        return None
    if not scene.method.flow.facts.is_solved or scene.method.flow.between:
        return None
    (flow,) = of_scene(scene).cases
    return flow


def _family(flow: FlowCase) -> FlowCase:
    """What a flow has in common with those that differ in their roughness alone."""
    without = flow.settings.model_copy(update={"roughness": None})
    return replace(flow, settings=without)


def _between(answer: Decision) -> FlowModel | None:
    """The flow of a pile that was put between others."""
    scene = answer.scene
    is_put = isinstance(scene.bed, PileBed) and scene.method.flow.between
    if not is_put or answer.asked.method.flow.between:
        return None
    return of_scene(scene)


def _solves(model: FlowModel) -> tuple[object, ...]:
    """The solved flows between which a flow lies, and how their stress is read."""
    return (model.scene.forces.stress, *model.cases)


def _is_off(model: FlowModel, cases: Path) -> bool:
    """Whether finished flows show that no other lies between them."""
    if not all(done_state(flow, cases) for flow in model.cases):
        return False
    return model.error(cases) > between.MOST_ERROR


def _with(answer: Decision, roughnesses: tuple[float, ...]) -> Decision:
    """A decision with other roughness lengths between which its flow lies."""
    return replace(answer, scene=changed(answer.scene, {FIELD: roughnesses}))
