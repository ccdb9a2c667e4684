"""How values are written in figures and on the page, and which of them tell rows apart."""

import re
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.study import fields
from orchestrator.study.parts import Info

RE_AXIS = "Re* = u* d/ν"
TAU_AXIS = r"threshold Shields number $τ_c$"
WIDTH = 52
"""Letters of a line over a panel."""
OTHERS = {
    **{"fraction": Info("n/N", "n/N", "%"), "by": Info("by")},
    "answered_method": fields.ANSWERS["answered_method"].info,
}
"""Words of columns of tables that are no fields."""
OF_METHODS = {"DEM", "DEM of piles", "DEM and peeling", "DEM and peeling of piles"}
"""Scopes of fields that have no effect by other methods."""


def words(column: str) -> Info:
    """The words of a column."""
    return OTHERS[column] if column in OTHERS else fields.COLUMNS[column].info


def plain(column: str, value: Any) -> str:
    """A value with its symbol or its label, such as ``d = 0.7 mm``."""
    info = words(column)
    if isinstance(value, str):
        return info.choices.get(value, f"{info.label} {value}")
    if pd.isna(value):
        return f"no {info.label}"
    return f"{info.symbol.replace('_0', '₀') or info.label} = {amount(float(value), info.unit)}"


def value(column: str, value: Any) -> str:
    """A value without its symbol."""
    info = words(column)
    if isinstance(value, str):
        return info.choices.get(value, value)
    return "none" if pd.isna(value) else amount(value, info.unit)


def cells(rows: pd.DataFrame, columns: Sequence[str]) -> dict[str, list[str]]:
    """Columns of a table with their values and heads as a reader sees them."""
    return {
        words(name).label: [value(name, item) for item in rows[name]]
        for name in columns
    }


def told(row: pd.Series, columns: Sequence[str]) -> list[str]:
    """The values of a row with their symbols, without those that the row does not have."""
    shown = [
        name for name in columns if pd.notna(row[name]) or name == "obstacles"
    ]  # a list
    return [plain(name, row[name]) for name in shown]


def panel(row: pd.Series, columns: Sequence[str]) -> str:
    """The values of a row as a title, broken into lines that fit beside another panel."""
    text = textwrap.fill(", ".join(told(row, columns)), WIDTH, break_long_words=False)
    return re.sub(r"(\w)_(\w+) =", r"$\1_{\2}$ =", text)  # an index in mathematics


def amount(value: float, unit: str) -> str:
    """A value with its unit; one in metres that is below 1 m is written in millimetres."""
    if unit in ("d", "h"):
        return ratio_of(value, unit)
    if unit == "m" and abs(value) >= 1:
        return f"{value:.4g} m"
    factor, written = {"m": (1e3, " mm"), "%": (100.0, " %"), "°": (1.0, "°")}.get(
        unit, (0.0, "")
    )
    return f"{factor * value:.4g}{written}" if factor else f"{value:g} {unit}".rstrip()


def interval(low: float, high: float, form: str = "#.3g") -> str:
    """An interval as a text; one with an end that is not known (NaN, infinite) is open there."""
    ends = [format(float(end), form) for end in (low, high) if np.isfinite(end)]
    if len(ends) == 2:
        return " … ".join(dict.fromkeys(ends))
    if np.isfinite(low):
        return f"above {ends[0]}"
    if np.isfinite(high):
        return f"below {ends[0]}"
    return "—"


def ratio_of(ratio: float, length: str) -> str:
    """A length over another, such as ``d/30``."""
    whole = round(1 / ratio)
    is_whole = abs(1 - whole * ratio) < 1e-3 and whole <= 1000
    return f"{length}/{whole}" if is_whole else f"{ratio:.3g} {length}"


def methods(rows: pd.DataFrame) -> str:
    """The methods that answered rows of a table."""
    names = fields.ANSWERS["answered_method"].info.choices
    return ", ".join(
        name for key, name in names.items() if (rows["answered_method"] == key).any()
    )


def varying(table: pd.DataFrame, *shown: str) -> list[str]:
    """The fields in which rows differ that agree in all columns that are shown, seeds left out.

    Of fields that vary together one is enough: questions, the method, fields of some methods.
    """

    def rank(column: str) -> int:
        info = fields.COLUMNS[column].info
        of_answer = (
            3 if info.about != "question" else 2 if info.scope in OF_METHODS else 0
        )
        return 1 if column == "method" else of_answer

    columns = [name for name in fields.others(table, *shown) if name in fields.COLUMNS]
    columns = [name for name in columns if fields.COLUMNS[name].info.about != "replica"]
    listed: list[str] = []
    groups = table.groupby(list(shown), dropna=False).ngroup().to_numpy()
    for column in sorted(columns, key=rank):
        codes, values = pd.factorize(table[column], use_na_sentinel=False)
        finer, names = pd.factorize(groups * len(values) + codes)
        if len(names) > groups.max(initial=-1) + 1:
            listed.append(column)
            groups = finer
    return listed
