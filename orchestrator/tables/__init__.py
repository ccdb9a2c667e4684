"""The tables of a study: what was asked, what was measured, with units in the columns' names.

Tables of results hold no time and no path of a machine: the same study gives the same bytes
wherever and whenever it runs. What the runs took is in `timings`.
"""

from collections.abc import Container, Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import parquet

from orchestrator.errors import OrchestratorError
from orchestrator.fidelity import decision
from orchestrator.plan import Plan
from orchestrator.runs.folder import Folder
from orchestrator.study.study import Study
from orchestrator.tables import flows as flows_table
from orchestrator.tables import forms, piles, scenes, single, text, wear
from orchestrator.tables.columns import COLUMNS
from orchestrator.tables.scatter import with_scatter
from orchestrator.tables.usable import with_usable

Tables = dict[str, pd.DataFrame]

__all__ = ["COLUMNS", "Tables", "make", "read", "timings", "write"]


def make(study: Study, plan: Plan, cases: Path, done: Container[str]) -> Tables:
    """The tables of a study that have rows, from the cases that are done; in the study's order."""
    piled = ((flow.name, pile) for pile in plan.piles.values() for flow in pile.model.cases)
    flows = {name: pile for name, pile in piled if name in done}
    ready = [
        piles.Answer.read(plan.decisions[scene_id], pile, cases)
        for scene_id, pile in plan.piles.items()
        if pile.is_run(done)
    ]
    cells = [one for one in plan.cells if one.name in done]
    asked = pd.DataFrame(scenes.rows(study, plan))
    thresholds = pd.DataFrame(row for answer in ready for row in piles.threshold_rows(answer))
    grains = pd.DataFrame(single.rows(plan, cells, cases))
    made = {
        "scenes": asked,
        "single_grain": with_usable(grains, asked, study),
        "wall_stress": _concat(piles.wall_stress(flows.values(), cases)),
        "flow": pd.DataFrame(flows_table.row(pile, cases) for pile in flows.values()),
        "pile_grain": _stacked(map(piles.grains, ready)),
        "pile_curve": _stacked(map(piles.curve, ready)),
        "pile_threshold": with_usable(with_scatter(thresholds, asked), asked, study),
        "size_class": pd.DataFrame(row for one in ready for row in piles.size_class_rows(one)),
        "bed_change": _concat(wear.tables(ready)),
        "form": pd.DataFrame(row for one in ready for row in forms.rows(one)),
        "check": pd.DataFrame(_checks(study, plan, cases, done)),
    }
    return {name: table for name, table in made.items() if not table.empty}


def _checks(
    study: Study, plan: Plan, cases: Path, done: Container[str]
) -> Iterator[dict[str, Any]]:
    if study.tolerance:
        ready = decision.ready(plan.piles, plan.checks, done)
        yield from piles.check_rows(plan.decisions, plan.piles, ready, study.tolerance, cases)


def _concat(frames: Iterable[pd.DataFrame]) -> pd.DataFrame:
    listed = list(frames)
    return pd.concat(listed, ignore_index=True) if listed else pd.DataFrame()


def _stacked(parts: Iterable[piles.Columns]) -> pd.DataFrame:
    """The columns of many parts one below the other; not a number where a part lacks a column."""
    listed = list(parts)
    names = dict.fromkeys(name for part in listed for name in part)
    # a table of each part, for pandas to join, would take ten times as long
    return pd.DataFrame(
        {name: np.concatenate([_column(part, name) for part in listed]) for name in names}
    )


def _column(part: piles.Columns, name: str) -> NDArray[Any]:
    return part[name] if name in part else np.full(len(next(iter(part.values()))), np.nan)


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


def write(tables: Mapping[str, pd.DataFrame], folder: Folder, place: str) -> None:
    """Put each table as CSV and as Parquet into a sub-directory, and what the columns mean."""
    for name, table in tables.items():
        folder.put(f"{place}/{name}.csv", text.csv(table))
        folder.put(f"{place}/{name}.parquet", table.to_parquet(index=False))
    used = sorted({str(column) for table in tables.values() for column in table})
    rows = [{"column": column, "meaning": COLUMNS[column]} for column in used]
    folder.put(f"{place}/columns.csv", text.csv(pd.DataFrame(rows)))


def read(folder: Folder, place: str) -> Tables:
    """Read the tables that `write` wrote, and no others.

    Raises
    ------
    OrchestratorError
        If there are none, or one has changed since.
    """
    names = [name for name in folder.written() if fnmatchcase(name, f"{place}/*.parquet")]
    if not names:
        raise OrchestratorError(
            "there are no tables", where=str(folder.root / place), remedy="run the study first"
        )
    return {PurePath(name).stem: _parquet(folder.read(name)) for name in names}


def _parquet(data: bytes) -> pd.DataFrame:
    # pandas' own reader starts threads, which end one in ten busy processes with "terminate called
    # without an active exception" (github.com/apache/arrow/issues/34314)
    file = parquet.ParquetFile(pa.BufferReader(data), pre_buffer=False)
    table: pd.DataFrame = file.read(use_threads=False).to_pandas(use_threads=False)
    return table
