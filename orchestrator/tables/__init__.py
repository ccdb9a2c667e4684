"""The tables of a study: what was asked, what was measured, with units in the columns' names.

Tables of results hold no time and no path of a machine, and numbers of nine digits: the same study
gives the same bytes wherever and whenever it runs. The times of the runs are in `timings`.
"""

import re
from collections.abc import Container, Iterable, Mapping
from csv import writer
from fnmatch import fnmatchcase
from functools import cache
from io import BytesIO, StringIO
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import pandas as pd

from orchestrator import digits
from orchestrator.errors import OrchestratorError
from orchestrator.grains.pile import Pile
from orchestrator.plan import Plan
from orchestrator.runs.files import Folder
from orchestrator.study import fields
from orchestrator.study.study import Study
from orchestrator.tables import rows
from orchestrator.tables.check import contradictions, with_agreement
from orchestrator.tables.usable import with_scatter, with_usable
from orchestrator.types import Row

Tables = dict[str, pd.DataFrame]

COLUMNS: dict[str, str] = {
    **pd.read_csv(Path(__file__).with_name("columns.csv"), index_col="column")[
        "meaning"
    ],
    **{column: one.phrase for column, one in fields.COLUMNS.items()},
    **{
        column: f"{one.phrase}: as it was run" for column, one in fields.ANSWERS.items()
    },
}
"""Every column of every table, with its meaning; units are in the names."""
FORMULA = r"(?='*(?:[=@\t\n]|[+-](?![\d.]+(?:e[+-]?\d+)?$|inf$)))"
"""What follows the beginning of a text that spreadsheets run as a formula; no number is one. Such a
text is written behind one more apostrophe."""
NAMES = ("scene_id", "group", "profile", "case", "flow_case", "why_not")
"""Columns of texts that may look like numbers, or be empty."""


def make(study: Study, plan: Plan, cases: Path, done: Container[str]) -> Tables:
    """The tables of a study that have rows, from the cases that are done; in the study's order."""
    flows = {
        name: solve
        for pile in plan.piles.values()
        for name, solve in pile.solves.items()
    }
    flows = {name: solve for name, solve in flows.items() if name in done}
    answers = [
        rows.Answer(
            plan.decisions[scene_id], pile, cases, _smoothed(plan, scene_id, done)
        )
        for scene_id, pile in plan.piles.items()
        if pile.is_run(done)
    ]
    asked = pd.DataFrame(rows.scenes(study, plan))
    cells = [cell for cell in plan.cells if cell.name in done]
    grains = pd.DataFrame(rows.single_grain(plan, cells, cases))
    thresholds = pd.DataFrame(
        row for answer in answers for row in rows.pile_threshold(answer)
    )
    thresholds = with_scatter(thresholds, asked)
    checks = with_agreement(pd.DataFrame(rows.check(plan, cases, done)), thresholds)
    made = {
        "scenes": asked,
        "single_grain": with_usable(grains, asked, study.tolerance),
        "wall_stress": _stacked(
            rows.wall_stress(pile, cases) for pile in flows.values()
        ),
        "flow": pd.DataFrame(rows.flow(pile, cases) for pile in flows.values()),
        "pile_grain": _stacked(map(rows.pile_grain, answers)),
        "pile_curve": _stacked(map(rows.pile_curve, answers)),
        "pile_threshold": with_usable(
            thresholds, asked, study.tolerance, contradictions(checks)
        ),
        "size_class": pd.DataFrame(
            row for one in answers for row in rows.size_class(one)
        ),
        "bed_change": _stacked(rows.bed_changes(answers)),
        "form": pd.DataFrame(row for one in answers for row in rows.forms(one)),
        "check": checks,
    }
    return {name: table for name, table in made.items() if not table.empty}


def _smoothed(plan: Plan, scene_id: str, done: Container[str]) -> dict[float, Pile]:
    """The beds of a scene with other smoothing that are done, by its factor."""
    piles = plan.smoothings.get(scene_id, {})
    return {factor: pile for factor, pile in piles.items() if pile.is_run(done)}


def _stacked(parts: Iterable[Row]) -> pd.DataFrame:
    """The columns of many parts one below the other; not a number where a part lacks a column.

    Numbers and texts are repeated along the arrays of their part. `concat` takes ten times as long.
    """
    arrays = [
        dict(zip(part, np.broadcast_arrays(*part.values()), strict=True))
        for part in parts
    ]
    empty = [np.full(next(iter(part.values())).shape, np.nan) for part in arrays]
    columns = {}
    for name in dict.fromkeys(name for part in arrays for name in part):
        values = [part.get(name, nan) for part, nan in zip(arrays, empty, strict=True)]
        columns[name] = np.concatenate(values)
    return pd.DataFrame(columns)


def timings(plan: Plan, states: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """Wall times of the finished cases, from their states by name."""
    rows = [
        (
            name,
            plan.cases[name].kind,
            it["solver_s"],
            it["cpu_s"],
            it["wall_s"] - it["solver_s"],
        )
        for name, it in states.items()
    ]
    return pd.DataFrame(
        rows, columns=["case", "kind", "solver_s", "cpu_s", "outside_s"]
    )


def csv(table: pd.DataFrame, form: str = "") -> str:
    """A table as CSV, in which no text is one of `FORMULA`.

    Parameters
    ----------
    table
        Its columns have numbers, texts or None.
    form
        Format of its numbers that are not whole, such as ``%.6g``; by default they have
        nine digits, as few as tell them from their neighbours, and a point.

    Returns
    -------
    str
        A line for the names of the columns, and one for each row; nothing stands where a
        number is NaN or a value is None.
    """
    # pandas takes twice as long: it writes equal numbers anew
    columns = [[_harmless(str(name)), *_written(table[name], form)] for name in table]
    text = StringIO()
    writer(text, lineterminator="\n").writerows(zip(*columns, strict=True))
    return text.getvalue()


def _written(column: "pd.Series[Any]", form: str) -> Iterable[str]:
    values = column.to_numpy()
    if values.dtype.kind not in "biuf":
        return [_text(value, form) for value in column.tolist()]
    codes, bits = pd.factorize(values.view(f"i{values.itemsize}"))
    each = [_text(value, form) for value in bits.view(values.dtype).tolist()]
    return np.array(each, object)[codes]


def _text(value: Any, form: str) -> str:
    if value is None or value != value:
        return ""
    if not isinstance(value, float):
        return _harmless(str(value))
    return form % value if form else digits.text(value)


@cache
def _harmless(text: str) -> str:
    # a reader takes \r without quotes for the end of the row
    lines = re.sub(r"\r\n?", "\n", text)
    return f"'{lines}" if re.match(FORMULA, lines) else lines


def _as_it_was(text: Any) -> Any:
    """A text of a table without the apostrophe that it was written behind, if it was."""
    if isinstance(text, str) and re.match(f"'{FORMULA}", text):
        return text[1:]
    return text


def write(tables: Mapping[str, pd.DataFrame], folder: Folder, place: str) -> None:
    """Put each table into a sub-directory of a folder, and the meanings of the columns."""
    for name, table in tables.items():
        folder.put(f"{place}/{name}.csv", csv(table))
    used = sorted({str(column) for table in tables.values() for column in table})
    meanings = pd.DataFrame(
        {"column": used, "meaning": [COLUMNS[column] for column in used]}
    )
    folder.put(f"{place}/columns.csv", csv(meanings))


def read(folder: Folder, place: str) -> Tables:
    """Read the tables that `write` wrote.

    Raises
    ------
    OrchestratorError
        If there are none, or if one has changed.
    """
    tables = {}
    for file in folder.written():
        name = PurePath(file).stem
        if fnmatchcase(file, f"{place}/*.csv") and name != "columns":
            tables[name] = _table(folder.read(file))
    if not tables:
        where = str(folder.root / place)
        raise OrchestratorError("there are no tables", where, "run the study first")
    return tables


def _table(content: bytes) -> pd.DataFrame:
    """A table from its file."""
    texts: dict[Any, Any] = dict.fromkeys(NAMES, "str")
    table = pd.read_csv(
        BytesIO(content), dtype=texts, keep_default_na=False, na_values=[""]
    )
    for column in table.select_dtypes(["object", "string"]):
        if table[column].str.startswith("'").any():
            table[column] = table[column].map(_as_it_was)
    if "why_not" in table:
        table["why_not"] = table["why_not"].fillna("")
    # one block: columns may be added to more than a hundred others
    return table.copy()
