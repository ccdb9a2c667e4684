"""Panels and markers, which tell the rows of a figure apart beyond its axes and colours."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.lines import Line2D

from orchestrator.physics.laws import LAWS
from orchestrator.report import labels
from orchestrator.report.laws import PAIR
from orchestrator.report.style import Sample
from orchestrator.study import fields

SHAPES = "os^DvP<X>p8hd*"
"""Markers that are told from each other."""
SHAPE = "marker"
"""The column that holds a row's marker."""
METHOD = "method"
OF_METHODS = {"DEM", "DEM of piles", "DEM and peeling", "DEM and peeling of piles"}
"""Scopes of fields that have no effect by other methods."""


def varying(table: pd.DataFrame, *shown: str) -> list[str]:
    """The fields in which rows differ that agree in all columns that are shown.

    One of several fields that vary together is enough: the question comes before the method, and
    the method before the fields that only some methods have. Which of many alike a row is does not
    count.
    """
    found: list[str] = []
    told = table.groupby(list(shown), dropna=False).ngroup().to_numpy()
    for column in sorted(fields.others(table, *shown), key=_rank):
        if column in fields.COLUMNS and fields.COLUMNS[column].info.about != "replica":
            codes, values = pd.factorize(table[column], use_na_sentinel=False)
            finer, groups = pd.factorize(told * len(values) + codes)
            if len(groups) > told.max(initial=-1) + 1:
                found.append(column)
                told = finer
    return found


def _rank(column: str) -> int:
    if column == METHOD or column not in fields.COLUMNS:
        return 1
    info = fields.COLUMNS[column].info
    if info.about == "question":
        return 2 if info.scope in OF_METHODS else 0
    return 3


def _count(table: pd.DataFrame, columns: Sequence[str]) -> int:
    return len(table[list(columns)].drop_duplicates())


def parted(table: pd.DataFrame, *shown: str) -> tuple[list[str], pd.DataFrame, list[Sample]]:
    """How rows are told apart that agree in all columns that are shown.

    Returns
    -------
    panels : list of str
        The columns that part panels: those of what is asked.
    rows : DataFrame
        The table with a marker for each force law and each variant; a variant is one combination
        of how scenes are answered.
    entries : list of samples
        What the markers of variants mean, for a legend; none where there is one variant.
    """
    found = varying(table, *shown)
    panels = [column for column in found if fields.COLUMNS[column].info.about == "question"]
    looks = [column for column in found if column not in panels]
    # without variants there is a marker for every law, the same in all figures
    laws = [name for name in LAWS if name in {*PAIR, *table["force_law"]} or not looks]
    while looks and _count(table, looks) * len(laws) > len(SHAPES):
        panels.append(looks.pop(0))
    variant = _variant(table, looks)
    shape = variant * len(laws) + table["force_law"].map(laws.index)
    rows = table.assign(**{SHAPE: shape.map(lambda at: SHAPES[at % len(SHAPES)])})
    entries = [_entry(own, looks) for _, own in rows.groupby(variant)] if looks else []
    return panels, rows, entries


def _variant(table: pd.DataFrame, looks: Sequence[str]) -> "pd.Series[int]":
    """The number of each row's variant; the most frequent is the first."""
    if not looks:
        return pd.Series(0, index=table.index)
    number = table.groupby(list(looks), dropna=False).ngroup()
    order = number.groupby(number).size().sort_values(ascending=False, kind="stable").index
    return number.map({old: new for new, old in enumerate(order)})


def _entry(rows: pd.DataFrame, looks: Sequence[str]) -> Sample:
    # the fields of DEM have no effect on a pile that was answered without it
    label = labels.panel(rows.iloc[0], looks) or labels.methods(rows)
    markers = dict.fromkeys(rows.sort_values("force_law", ascending=False)[SHAPE])
    return tuple(Line2D([], [], ls="", marker=m, color="0.2", label=label) for m in markers)
