"""The tables of a study: what was asked, what was measured, with units in the columns' names.

Tables of results hold no time and no path of a machine: the same study gives the same bytes
wherever and whenever it runs. The times of the runs are in `timings`.
"""

from collections.abc import Container, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.plan import Plan
from orchestrator.study.study import Study
from orchestrator.tables import piles, scenes
from orchestrator.tables.text import COLUMNS, csv, read, write
from orchestrator.tables.usable import with_scatter, with_usable

Tables = dict[str, pd.DataFrame]

__all__ = ["COLUMNS", "Tables", "csv", "make", "read", "timings", "write"]


def make(study: Study, plan: Plan, cases: Path, done: Container[str]) -> Tables:
    """The tables of a study that have rows, from the cases that are done; in the study's order."""
    flows = {
        flow.name: pile
        for pile in plan.piles.values()
        for flow in pile.model.cases
        if flow.name in done
    }
    answers = [
        piles.Answer.read(plan.decisions[scene_id], pile, cases)
        for scene_id, pile in plan.piles.items()
        if pile.is_run(done)
    ]
    cells = [cell for cell in plan.cells if cell.name in done]
    asked = pd.DataFrame(scenes.rows(study, plan))
    grains = pd.DataFrame(scenes.single_grains(plan, cells, cases))
    thresholds = pd.DataFrame(row for answer in answers for row in piles.threshold_rows(answer))
    made = {
        "scenes": asked,
        "single_grain": with_usable(grains, asked, study),
        "wall_stress": _stacked(scenes.wall_stress(pile, cases) for pile in flows.values()),
        "flow": pd.DataFrame(scenes.flow(pile, cases) for pile in flows.values()),
        "pile_grain": _stacked(map(piles.grains, answers)),
        "pile_curve": _stacked(map(piles.curve, answers)),
        "pile_threshold": with_usable(with_scatter(thresholds, asked), asked, study),
        "size_class": pd.DataFrame(row for one in answers for row in piles.size_class_rows(one)),
        "bed_change": _stacked(piles.bed_changes(answers)),
        "form": pd.DataFrame(row for one in answers for row in piles.forms(one)),
        "check": pd.DataFrame(piles.check_rows(study, plan, cases, done)),
    }
    return {name: table for name, table in made.items() if not table.empty}


def _stacked(parts: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """The columns of many parts one below the other; not a number where a part lacks a column.

    Numbers and texts are repeated along the arrays of their part. Ten times as fast as a
    concatenation of tables.
    """
    arrays = [dict(zip(part, np.broadcast_arrays(*part.values()), strict=True)) for part in parts]
    names = dict.fromkeys(name for part in arrays for name in part)
    return pd.DataFrame(
        {
            name: np.concatenate(
                [
                    part.get(name, np.full(next(iter(part.values())).shape, np.nan))
                    for part in arrays
                ]
            )
            for name in names
        }
    )


def timings(plan: Plan, states: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """Wall times of the finished cases, from their states by name."""
    return pd.DataFrame(
        {
            "case": name,
            "kind": plan.cases[name].kind,
            "solver_s": state["solver_s"],
            "cpu_s": state["cpu_s"],
            "outside_s": state["wall_s"] - state["solver_s"],
        }
        for name, state in states.items()
    )
