"""The table of scenes: what was asked, and how it was answered."""

from collections.abc import Iterator
from typing import Any

from orchestrator.plan import Plan
from orchestrator.study import fields
from orchestrator.study.closed_form import law_holds
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study

Row = dict[str, Any]

POINT = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law", "regime")
"""Columns by which a scene is found in a figure; tables of results have them too."""


def rows(study: Study, plan: Plan) -> Iterator[Row]:
    """A row for each scene of each group, in the study's order."""
    cell_of = {scene.id: one.name for one in plan.cells for scene in one.scenes}
    for group in study.groups:
        for asked in group.scenes:
            decision, pile = plan.decisions[asked.id], plan.piles.get(asked.id)
            scene = decision.scene
            runs = [one.name for one in pile.runs] if pile else [cell_of.get(scene.id)]
            yield {
                "scene_id": asked.id,
                "group": group.name,
                **fields.asked(asked),
                **fields.answered(scene),
                "law_holds": law_holds(asked),
                "why": decision.why,
                "case": runs[-1] if scene.protocol.method == "dem" else None,
                "flow_case": pile.flow.name if pile and pile.model.cases else None,
            }


def point(scene: Scene) -> Row:
    """The columns by which a scene is found in a figure."""
    return {column: fields.COLUMNS[column].asked(scene) for column in POINT}
