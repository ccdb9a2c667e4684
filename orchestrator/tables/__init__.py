"""The tables of a study: what was asked, what was measured, with units in the names.

Tables of results hold no time and no path of a machine, and numbers of nine digits: the
same study gives the same bytes wherever and whenever it runs. The times of the runs are
in `timings`.
"""

import re
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from csv import writer
from fnmatch import fnmatchcase
from functools import cache, partial
from io import BytesIO, StringIO
from itertools import chain
from math import ceil
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import pandas as pd

from orchestrator import digits
from orchestrator.errors import OrchestratorError
from orchestrator.fidelity.decision import of_unknown_error
from orchestrator.grains.pile import Pile
from orchestrator.physics import beside, verdict
from orchestrator.physics.reported import OF_CHANNELS, REPORTED
from orchestrator.plan import Plan
from orchestrator.runs import second
from orchestrator.runs.files import Folder, digest_text
from orchestrator.study import fields
from orchestrator.study.study import Study
from orchestrator.tables import check, paired, quoted, usable
from orchestrator.tables.answer import Answer
from orchestrator.tables.check import KEYS, contradictions, with_agreement
from orchestrator.tables.classes import SIZE_CLASS
from orchestrator.tables.columns import Listed, several
from orchestrator.tables.dem_checks import CHECK, check_rows
from orchestrator.tables.flows import (
    FLOW,
    SPEED_PROFILE,
    WALL_STRESS,
    flow_row,
    speed_profile,
    wall_stress,
)
from orchestrator.tables.forms import BED_CHANGE, FORM, bed_changes
from orchestrator.tables.piles import PILE_CURVE, PILE_GRAIN, OfPile, of_pile
from orchestrator.tables.quantities import SPEEDS
from orchestrator.tables.quoted import of_classes
from orchestrator.tables.scenes import METHODS, SCENES, method_rows, scene_rows
from orchestrator.tables.single_grains import SINGLE_GRAIN, single_grain_rows
from orchestrator.tables.thresholds import (
    BETWEEN,
    CORRECTED,
    DECIDED,
    PILE_THRESHOLD,
    SMOOTHING,
    STARTS,
)
from orchestrator.tables.usable import Remedies, with_scatter, with_usable
from orchestrator.types import Row

Tables = Mapping[str, pd.DataFrame]
"""Tables by their names."""
PART = 4
"""Piles whose rows are made by one process in one go: neighbours in a study share
packings, and the flows that theirs lie between."""


TIMINGS: Mapping[str, str] = {
    **several("case"),
    "kind": "kind of the case",
    "solver_s": "wall time of the solvers",
    "cpu_s": "processor time of the solvers",
    "outside_s": "wall time of the case outside the solvers",
}
"""Columns of `timings`."""
TABLES: Mapping[str, Listed] = {
    "scenes": Listed(
        "a scene: the values of its fields, and the groups that ask for it",
        (SCENES,),
    ),
    "methods": Listed("a scene: how it was answered, and why", (METHODS,)),
    "single_grain": Listed(
        "a single grain: its threshold",
        (
            SINGLE_GRAIN,
            SPEEDS,
            verdict.COLUMNS,
            beside.MEASURED,
            beside.TESTED,
            quoted.QUOTED,
            quoted.LAWS_OF_INTERVAL,
            quoted.ENDS_OF_COMPARED,
        ),
    ),
    "pile_threshold": Listed(
        "a pile and a fraction n/N: its threshold",
        (
            PILE_THRESHOLD,
            SPEEDS,
            STARTS,
            DECIDED,
            SMOOTHING,
            BETWEEN,
            CORRECTED,
            usable.SCATTER,
            verdict.COLUMNS,
            beside.MEASURED,
            beside.TESTED,
            quoted.QUOTED,
            quoted.FIRST,
            quoted.ENDS_OF_COMPARED,
            quoted.ENDS_OF_COMPARED_FIRST,
        ),
    ),
    "reason": Listed("a reason against a threshold", (usable.REASON,)),
    "pile_curve": Listed(
        "a pile and a load step: the part of the grains that has moved",
        (PILE_CURVE,),
    ),
    "pile_grain": Listed(
        "a grain of a pile: where it lies and when it moved", (PILE_GRAIN,)
    ),
    "size_class": Listed(
        "a size class of a mixture and a fraction: its threshold, hiding",
        (SIZE_CLASS,),
    ),
    "bed_change": Listed(
        "a pile on a bed that changes and a number of moved grains",
        (BED_CHANGE,),
    ),
    "form": Listed("a form of a train and a fraction: its threshold", (FORM,)),
    "flow": Listed("a solved flow", (FLOW,)),
    "wall_stress": Listed("a place on the bed of a solved flow", (WALL_STRESS,)),
    "speed_profile": Listed(
        "a height over a place of the bed of a solved flow: the speed",
        (SPEED_PROFILE,),
    ),
    "paired": Listed(
        "a bed with shelter and a fraction: its threshold over that without shelter",
        (paired.PAIRED,),
    ),
    "check": Listed(
        "a threshold that DEM answered too, as a check of a fast method",
        (CHECK, check.AGREEMENT),
    ),
    "timings": Listed(
        "a case: the times of its run, in `timings/timings.csv`", (TIMINGS,)
    ),
}
"""The tables of a study, in the order in which the documents explain them."""


def meanings() -> dict[str, str]:
    """Look up what every column of every table is.

    Returns
    -------
    dict of str to str
        The meanings, by the names of the columns, which end with units.
    """
    return {
        name: text for table in TABLES.values() for name, text in table.columns.items()
    }


FORMULA = r"(?='*(?:[=@\t\n]|[+-](?![\d.]+(?:e[+-]?\d+)?$|inf$)))"
"""What follows the beginning of a text that spreadsheets run as a formula; no number is
one. Such a text is written behind one more apostrophe."""
NAMES = ("scene_id", "group", "profile", "case", "flow_case", "why_not")
"""Columns of texts that may look like numbers, or be empty."""


def make_tables(study: Study, plan: Plan, cases: Path, done: Container[str]) -> Tables:
    """Make the tables of a study from the cases that are done.

    Parameters
    ----------
    study
        The study.
    plan
        Its decisions and cases.
    cases
        The directory of the cases.
    done
        Names of the cases that are done.

    Returns
    -------
    dict of str to DataFrame
        The tables that have rows, in the study's order.
    """
    flows: dict[str, Pile] = {}
    answered = {}
    for scene_id, pile in plan.piles.items():
        for name, solve in pile.solves.items():
            if name in done:
                flows[name] = solve
        if pile.is_run(done):
            answered[scene_id] = pile
    answer_of = partial(_answer, plan, cases, done)
    told = _of_piles([*answered], answer_of)
    scenes = pd.DataFrame(scene_rows(study, plan))
    methods = pd.DataFrame(method_rows(plan))
    asked = with_methods(scenes, methods)
    grains = _single_grains(plan, cases, done)
    thresholds = with_scatter(_listed(each.thresholds for each in told), asked)
    checks = with_agreement(pd.DataFrame(check_rows(plan, cases, done)), thresholds)
    beds = with_usable(
        thresholds,
        asked,
        study.tolerance,
        contradictions(checks),
        _remedies(plan, thresholds, study.tolerance),
    )
    lone = with_usable(grains, asked, study.tolerance)
    curves = _stacked(each.curve for each in told)
    classes = _listed(each.classes for each in told)
    made = {
        "scenes": scenes,
        "methods": methods,
        "single_grain": lone.table,
        "wall_stress": _stacked(wall_stress(pile, cases) for pile in flows.values()),
        "speed_profile": _stacked(
            speed_profile(pile, cases) for pile in flows.values()
        ),
        "flow": pd.DataFrame([flow_row(pile, cases) for pile in flows.values()]),
        "pile_grain": _stacked(each.grains for each in told),
        "pile_curve": curves,
        "pile_threshold": beds.table,
        "reason": pd.concat([beds.reasons, lone.reasons], ignore_index=True),
        "size_class": of_classes(classes, beds.table),
        "bed_change": _stacked(bed_changes(answered, answer_of)),
        "form": _listed(each.forms for each in told),
        "paired": paired.paired(beds.table, curves, asked),
        "check": checks,
    }
    return {name: table for name, table in made.items() if not table.empty}


def _remedies(
    plan: Plan, thresholds: pd.DataFrame, tolerance: float | None
) -> Remedies:
    """What helps where the numerical error of a threshold is not known."""
    found = {}
    if not thresholds.empty:
        unknown = thresholds[thresholds["numerical_error"].isna()]
        for scene, fraction in unknown[KEYS].itertuples(index=False):
            decision = plan.decisions[scene]
            remedy = of_unknown_error(decision, fraction, tolerance)
            found[str(scene), float(fraction)] = remedy
    return found


def _answer(plan: Plan, cases: Path, done: Container[str], scene_id: str) -> Answer:
    """The answer to the scene of a pile whose runs are done."""
    smoothed = _smoothed(plan, scene_id, done)
    return Answer(plan.decisions[scene_id], plan.piles[scene_id], cases, smoothed)


def _of_piles(
    answered: Sequence[str], answer_of: Callable[[str], Answer]
) -> list[OfPile]:
    """The rows of each pile, in which grains without a run move, by two processes."""

    def of_part(part: int) -> list[OfPile]:
        chosen = answered[PART * part : PART * (part + 1)]
        return [of_pile(answer_of(scene_id)) for scene_id in chosen]

    parts = second.shared(of_part, ceil(len(answered) / PART))
    return [*chain.from_iterable(parts)]


def _single_grains(plan: Plan, cases: Path, done: Container[str]) -> pd.DataFrame:
    """The rows of the single grains whose cells are done."""
    cells = [cell for cell in plan.cells if cell.name in done]
    return pd.DataFrame(single_grain_rows(plan, cells, cases))


def missing(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """List the columns that tables lack which this version always writes.

    Parameters
    ----------
    tables
        The tables of a study.

    Returns
    -------
    list of str
        The columns; there are some where another version wrote the tables.
    """
    reported = {*verdict.COLUMNS, "interval_of", "advised"}
    for stem, unit in REPORTED.items():
        if stem not in OF_CHANNELS:
            ends = (stem, f"{stem}_low", f"{stem}_high", f"compared_{stem}")
            reported |= {name + unit for name in ends}
    columns = {
        "scenes": {*fields.OF_QUESTION, "gust"},
        "methods": {*fields.OF_METHOD},
        "pile_threshold": reported,
        "single_grain": reported,
    }
    lacking: dict[str, None] = {}
    for name, known in columns.items():
        if name in tables:
            lacking |= dict.fromkeys(sorted(known - {*tables[name]}))
    return [*lacking]


def with_methods(scenes: pd.DataFrame, methods: pd.DataFrame) -> pd.DataFrame:
    """List every scene once, with how it is answered.

    Parameters
    ----------
    scenes
        The table ``scenes``.
    methods
        The table ``methods``.

    Returns
    -------
    DataFrame
        The columns of both.
    """
    # a directory of an earlier version has a row for each group
    once = scenes.drop_duplicates("scene_id")
    # one block: columns may be added to more than a hundred others
    return once.merge(methods, on="scene_id", how="left").copy()


def with_scenes(table: pd.DataFrame, scenes: pd.DataFrame) -> pd.DataFrame:
    """Join a table with the columns of its rows' scenes.

    Parameters
    ----------
    table
        The table.
    scenes
        Every scene once, as `with_methods` lists them.

    Returns
    -------
    DataFrame
        Its rows whose scenes are there, with the columns of theirs that it lacks.
    """
    columns = scenes.columns.difference(table.columns, sort=False)
    of_scenes = scenes[["scene_id", *columns]]
    # one block: columns may be added to more than a hundred others
    return table.merge(of_scenes, on="scene_id", validate="many_to_one").copy()


def _smoothed(plan: Plan, scene_id: str, done: Container[str]) -> dict[float, Pile]:
    """The beds of a scene with other smoothing that are done, by its factor."""
    piles = plan.smoothings.get(scene_id, {})
    return {factor: pile for factor, pile in piles.items() if pile.is_run(done)}


def _listed(parts: Iterable[Iterable[Row]]) -> pd.DataFrame:
    """The rows of all parts below each other."""
    return pd.DataFrame(chain.from_iterable(parts))


def _stacked(parts: Iterable[Row]) -> pd.DataFrame:
    """The columns of many parts one below the other; NaN where a part lacks a column.

    Numbers and texts are repeated along the arrays of their part. `concat` takes ten
    times as long.
    """
    blocks = []
    for part in parts:
        arrays = np.broadcast_arrays(*part.values())
        blocks.append(dict(zip(part, arrays, strict=True)))
    names = dict.fromkeys(name for block in blocks for name in block)
    columns = {}
    for name in names:
        values = []
        for block in blocks:
            if name in block:
                values.append(block[name])
            else:
                shape = next(iter(block.values())).shape
                values.append(np.full(shape, np.nan))
        columns[name] = np.concatenate(values)
    return pd.DataFrame(columns)


def timings(plan: Plan, states: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """List the times of the finished cases.

    Parameters
    ----------
    plan
        The plan of the study.
    states
        The states of the finished cases, by name.

    Returns
    -------
    DataFrame
        Wall and processor time of the solver, and the time outside of it, s.
    """
    times = []
    for name, state in states.items():
        solver_s = state["solver_s"]
        row = {
            "case": name,
            "kind": plan.cases[name].kind,
            "solver_s": solver_s,
            "cpu_s": state["cpu_s"],
            "outside_s": state["wall_s"] - solver_s,
        }
        times.append(row)
    return pd.DataFrame(times, columns=[*TIMINGS])


def csv(table: pd.DataFrame, form: str = "") -> str:
    """Write a table as CSV, in which no text is one of `FORMULA`.

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
        A line for the names of the columns, and one for each row; nothing stands where
        a number is NaN or a value is None.

    Examples
    --------
    >>> table = pd.DataFrame({"d_m": [1e-3, float("nan")], "name": ["=1+1", "sand"]})
    >>> print(csv(table), end="")
    d_m,name
    0.001,'=1+1
    ,sand
    """
    # pandas takes twice as long: it writes equal numbers anew
    columns = [[_harmless(str(name)), *_written(table[name], form)] for name in table]
    text = StringIO()
    writer(text, lineterminator="\n").writerows(zip(*columns, strict=True))
    return text.getvalue()


def _written(column: "pd.Series[Any]", form: str) -> Iterable[str]:
    """The values of a column as texts; each different number is written once."""
    values = column.to_numpy()
    if values.dtype.kind not in "biuf":
        return [_text(value, form) for value in column.tolist()]
    codes, bits = pd.factorize(values.view(f"i{values.itemsize}"))
    each = [_text(value, form) for value in bits.view(values.dtype).tolist()]
    return np.array(each, object)[codes]


def _text(value: Any, form: str) -> str:
    """A value as it stands in a file."""
    is_missing = value is None or value != value
    if is_missing:
        return ""
    if not isinstance(value, float):
        return _harmless(str(value))
    return form % value if form else digits.text(value)


@cache
def _harmless(text: str) -> str:
    """A text that no spreadsheet runs as a formula."""
    # a reader takes \r without quotes for the end of the row
    lines = re.sub(r"\r\n?", "\n", text)
    return f"'{lines}" if re.match(FORMULA, lines) else lines


def _as_it_was(text: Any) -> Any:
    """A text of a table without the apostrophe that it was written behind."""
    if isinstance(text, str) and re.match(f"'{FORMULA}", text):
        return text[1:]
    return text


def write_tables(
    tables: Mapping[str, pd.DataFrame], folder: Folder, place: str
) -> dict[str, str]:
    """Write tables, and the meanings of their columns.

    Parameters
    ----------
    tables
        The tables, by name.
    folder
        The directory of the study.
    place
        Its sub-directory for the tables.

    Returns
    -------
    dict of str to str
        The digest of each table as it is written, by name.
    """
    used: set[str] = set()
    digests_of = {}
    for name, table in tables.items():
        text = csv(table)
        folder.put(f"{place}/{name}.csv", text)
        digests_of[name] = digest_text(text)
        used.update(map(str, table))
    known = meanings()
    listed = [(column, known[column]) for column in sorted(used)]
    table = pd.DataFrame(listed, columns=["column", "meaning"])
    folder.put(f"{place}/columns.csv", csv(table))
    return digests_of


def read_tables(folder: Folder, place: str) -> Tables:
    """Read the tables that `write_tables` wrote.

    Parameters
    ----------
    folder
        The directory of the study.
    place
        Its sub-directory of the tables.

    Returns
    -------
    dict of str to DataFrame
        The tables, by name.

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
