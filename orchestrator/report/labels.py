"""How values are written in figures and on the page, and which tell rows apart."""

import re
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.digits import metres, plain_number
from orchestrator.report.card import apart
from orchestrator.report.subjects import name_of_fluid
from orchestrator.study import fields
from orchestrator.study.declare import Info

RE_AXIS = "Re* = u* d/ν"
TAU_AXIS = r"critical Shields number $θ_c$"
WIDTH = 52
"""Letters of a line over a panel."""
DIGEST = re.compile(r" \([0-9a-f]{12}\)$")
"""What stands behind the file of a profile in tables."""
OTHERS = {
    "fraction": Info("fraction entrained", "n/N", "%"),
    "by": Info("by"),
    "asked": Info("method asked for"),
}
"""Words of columns of tables that are no fields."""
FLUID = "rho_f_kg_m3"
"""The column that tells fluids apart; air and water are told by their names."""
NAMED = ("obstacles",)
"""Columns whose texts say themselves what they are."""
OF_METHODS = {"DEM", "DEM of piles", "DEM and peeling", "DEM and peeling of piles"}
"""Scopes of fields that have no effect by other methods."""


def info_of(column: str) -> Info:
    """Look up the words of a column.

    Parameters
    ----------
    column
        Name of a field's column, or one of `OTHERS`.

    Returns
    -------
    Info
        Its label, symbol, unit and choices.
    """
    if column in OTHERS:
        return OTHERS[column]
    return fields.COLUMNS[column].info


def head_of(column: str) -> str:
    """Name a column in the head of a table and in a question.

    Parameters
    ----------
    column
        Name of the column.

    Returns
    -------
    str
        Its label; of the density of the fluid ``fluid``, since cells have a name there.
    """
    return "fluid" if column == FLUID else info_of(column).label


def value_text(column: str, value: Any) -> str:
    """Write a value with its symbol or its label.

    Parameters
    ----------
    column
        Name of the column.
    value
        A number in SI units, degrees or parts, one of the column's choices, or NaN.

    Returns
    -------
    str
        The text.

    Examples
    --------
    >>> value_text("d_m", 7e-4)
    'd = 0.7 mm'
    """
    info = info_of(column)
    if isinstance(value, str):
        named = _named(column, value)
        if column not in NAMED:
            named = f"{info.label} {named}"
        return info.choices.get(value, named)
    if pd.isna(value):
        return f"no {info.label}"
    symbol = info.symbol.replace("_0", "₀") or info.label
    return f"{symbol} = {amount(float(value), info.unit)}"


def value(column: str, value: Any) -> str:
    """Write a value without its symbol.

    Parameters
    ----------
    column
        Name of the column.
    value
        A number in SI units, degrees or parts, one of the column's choices, or NaN.

    Returns
    -------
    str
        The text.

    Examples
    --------
    >>> value("alpha_deg", 15.0)
    '15°'
    """
    info = info_of(column)
    if isinstance(value, str):
        return info.choices.get(value, _named(column, value))
    if pd.isna(value):
        return "none"
    return amount(value, info.unit)


def _named(column: str, value: str) -> str:
    """A text of a column; a profile by its file alone, without its digest."""
    return DIGEST.sub("", value) if column == "profile" else value


def cells(rows: pd.DataFrame, columns: Sequence[str]) -> dict[str, list[str]]:
    """Write columns of a table as a reader sees them.

    Parameters
    ----------
    rows
        The table.
    columns
        Names of the columns.

    Returns
    -------
    dict of str to list of str
        The texts of the values, by the labels of the columns.
    """
    written = {}
    for column in columns:
        texts = [value(column, item) for item in rows[column]]
        if column == FLUID:
            texts = [_fluid(row) or value(column, row[column]) for row in _each(rows)]
        if len({*texts}) < rows[column].nunique():
            texts = [str(item) for item in rows[column]]
        written[head_of(column)] = texts
    return written


def _each(rows: pd.DataFrame) -> list[pd.Series]:
    """The rows of a table."""
    return [row for _, row in rows.iterrows()]


def _fluid(row: pd.Series) -> str:
    """Air or water, where the fluid of a row is one of them; else nothing."""
    density, viscosity = row.get(FLUID), row.get("nu_m2_s")
    if density is None or viscosity is None or pd.isna(viscosity):
        return ""
    return name_of_fluid(float(density), float(viscosity))


def told(row: pd.Series, columns: Sequence[str]) -> list[str]:
    """Write the values of a row with their symbols.

    Parameters
    ----------
    row
        A row of a table.
    columns
        Names of the columns.

    Returns
    -------
    list of str
        The texts, without those of values that the row does not have.
    """
    texts = []
    for column in columns:
        if column == FLUID and _fluid(row):
            texts.append(f"in {_fluid(row)}")
            continue
        is_list = column == "obstacles"
        if is_list or pd.notna(row[column]):
            texts.append(value_text(column, row[column]))
    return texts


def panel(row: pd.Series, columns: Sequence[str]) -> str:
    """Write the values of a row as the title of a panel.

    Parameters
    ----------
    row
        A row of a table.
    columns
        Names of the columns.

    Returns
    -------
    str
        Lines that fit beside another panel, with indices in mathematics.
    """
    text = textwrap.fill(", ".join(told(row, columns)), WIDTH, break_long_words=False)
    return re.sub(r"(\w)_(\w+) =", r"$\1_{\2}$ =", text)


def amount(value: float, unit: str) -> str:
    """Write a value with its unit.

    Parameters
    ----------
    value
        A number of the unit; of ``%`` a part of 1.
    unit
        Its unit.

    Returns
    -------
    str
        The text; a length that is below 1 m is in millimetres.

    Examples
    --------
    >>> amount(0.07464, "m"), amount(0.3, "%"), amount(1 / 30, "d")
    ('74.64 mm', '30 %', 'd/30')
    """
    if unit in ("d", "h"):
        return ratio_in_words(value, unit)
    if unit == "m":
        return metres(value, 4)
    if unit == "%":
        return f"{plain_number(100.0 * value, 4)} %"
    if unit == "°":
        return f"{plain_number(value, 4)}°"
    return f"{plain_number(value, 6)} {unit}".rstrip()


def interval(low: float, high: float, digits: int = 3, form: str = "#g") -> str:
    """Write an interval.

    Parameters
    ----------
    low, high
        Its ends; one that is not known (NaN, infinite) leaves it open there.
    digits, form
        How a number is written, as of `card.apart`.

    Returns
    -------
    str
        The text; ends that would be written alike have more digits.

    Examples
    --------
    >>> interval(0.1, 0.2), interval(0.1, float("nan")), interval(0.1713, 0.1714)
    ('0.100 … 0.200', 'above 0.100', '0.1713 … 0.1714')
    """
    if np.isfinite(low) and np.isfinite(high):
        return apart(low, high, digits, form)
    one = f"{form[:-1]}.{digits}{form[-1]}"
    if np.isfinite(low):
        return f"above {low:{one}}"
    if np.isfinite(high):
        return f"below {high:{one}}"
    return "—"


def ratio_in_words(ratio: float, length: str) -> str:
    """Write a length over another.

    Parameters
    ----------
    ratio
        The ratio.
    length
        Symbol of the other length.

    Returns
    -------
    str
        A part such as ``d/30`` where it is one, else a multiple.

    Examples
    --------
    >>> ratio_in_words(1 / 30, "d"), ratio_in_words(2.5, "h")
    ('d/30', '2.5 h')
    """
    whole = round(1 / ratio)
    is_part = abs(1 - whole * ratio) < 1e-3 and whole <= 1000
    return f"{length}/{whole}" if is_part else f"{ratio:.3g} {length}"


def method_names(rows: pd.DataFrame) -> str:
    """Name the methods that answered rows of a table.

    Parameters
    ----------
    rows
        The rows, with a column ``method``.

    Returns
    -------
    str
        The methods' labels, in the order in which they are declared.
    """
    used = set(rows["method"])
    choices = fields.COLUMNS["method"].info.choices
    return ", ".join(label for method, label in choices.items() if method in used)


def varying(table: pd.DataFrame, *shown: str) -> list[str]:
    """Find the fields that tell rows apart which agree in all columns that are shown.

    Of fields that vary together one is enough: questions come before the method, and
    that before the fields of some methods. Seeds are left out.

    Parameters
    ----------
    table
        The rows.
    shown
        Names of the columns that are shown anyway.

    Returns
    -------
    list of str
        Names of further columns.
    """
    columns = fields.others(table, "seed", *shown)
    if "asked" in table:
        columns.append("asked")
    listed: list[str] = []
    groups = table.groupby(list(shown), dropna=False).ngroup().to_numpy()
    for column in sorted(columns, key=_rank):
        codes, values = pd.factorize(table[column], use_na_sentinel=False)
        finer, names = pd.factorize(groups * len(values) + codes)
        if len(names) > groups.max(initial=-1) + 1:
            listed.append(column)
            groups = finer
    return listed


def _rank(column: str) -> int:
    """Place of a field among those that tell rows apart; the lowest comes first."""
    if column == "profile":  # the beds of a series are called by their files
        return -1
    if column == "method":
        return 1
    if column == "asked":
        return 4
    if column in fields.OF_METHOD:
        return 3
    return 2 if fields.COLUMNS[column].info.scope in OF_METHODS else 0
