"""The rows of scenes: their fields, and how each was answered."""

from collections.abc import Iterator, Mapping
from math import nan

from orchestrator.plan import Plan
from orchestrator.study import fields
from orchestrator.study.closed_form import law_holds
from orchestrator.study.study import Study
from orchestrator.tables.columns import phrases, several
from orchestrator.types import Row

SCENES: Mapping[str, str] = {
    **several("scene_id"),
    "group": "groups of the study file that ask for the scene",
    **phrases(*fields.OF_QUESTION),
    "gust": "largest over mean stress of the gusts of the flow; empty without gusts",
    "law_holds": (
        "whether the force law holds at the threshold of a single grain of the scene"
    ),
    **several("case", "flow_case"),
}
"""Columns of `scenes`."""


def scene_rows(study: Study, plan: Plan) -> Iterator[Row]:
    """List the scenes: what they ask, the groups that ask it, the cases that answer it.

    Parameters
    ----------
    study
        The study.
    plan
        Its plan.

    Yields
    ------
    dict
        A row for each scene, in the study's order.
    """
    cell_of = {scene.id: cell.name for cell in plan.cells for scene in cell.scenes}
    groups: dict[str, dict[str, None]] = {}
    scenes_by_id = {}
    for group in study.groups:
        for asked in group.scenes:
            scenes_by_id[asked.id] = asked
            groups.setdefault(asked.id, {})[group.name] = None
    for asked in scenes_by_id.values():
        decision = plan.decisions[asked.id]
        scene = decision.scene
        case = cell_of.get(scene.id)
        flow_case = None
        pile = plan.piles.get(asked.id)
        if pile:
            case = pile.last_run
            if pile.model.cases:
                flow_case = "; ".join(run.name for run in pile.model.cases)
        yield {
            "scene_id": asked.id,
            "group": "; ".join(groups[asked.id]),
            **fields.question(asked),
            "gust": asked.gust if asked.flow.gusts else nan,
            "law_holds": law_holds(asked),
            "case": case if scene.method.facts.needs_run else None,
            "flow_case": flow_case,
        }


METHODS: Mapping[str, str] = {
    **several("scene_id"),
    "asked": (
        "fields of the method that the scene does not leave at their defaults, by "
        "their names in the table [method]; auto: none"
    ),
    "fidelity": "fidelity of the answer; empty for a single grain",
    "error_estimate": (
        "known relative error of flow and grains together, at the asked fraction at "
        "which it is largest; empty where it is not known"
    ),
    "why": "reason for the method and the flow by which the scene was answered",
    **phrases(*fields.OF_METHOD),
}
"""Columns of `methods`."""


def method_rows(plan: Plan) -> Iterator[Row]:
    """List how each scene is answered.

    Parameters
    ----------
    plan
        The plan of the study.

    Yields
    ------
    dict
        A row for each scene, with the fields of its method as they are used.
    """
    for scene_id, decision in plan.decisions.items():
        yield {
            "scene_id": scene_id,
            "asked": fields.written(decision.asked),
            "fidelity": decision.fidelity.name if decision.fidelity else None,
            "error_estimate": decision.error_estimate,
            "why": decision.why,
            **fields.method(decision.scene),
        }
