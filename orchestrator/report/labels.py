"""How values are written in figures and on the page, and which of them tell rows apart."""

import math
import re
import textwrap
from collections.abc import Callable, Sequence
from typing import Any

import pandas as pd

from orchestrator.study import fields
from orchestrator.study.part import Info

RE_AXIS = r"$Re^\star = u^\star d/\nu$"
TAU_AXIS = r"$\tau = \tau_c^\star/\left((\rho_{sol}-\rho_f)\,g\,d\right)$"
WIDTH = 60
"""Letters of a line over a panel."""
LISTS = ("obstacles",)
"""Columns of fields that are lists: an empty cell is an empty list."""
FRACTION = Info("fraction", "n/N", "%")
"""The fraction of grains at which a threshold is read; no field of its own."""
OF_METHODS = {"DEM", "DEM of piles", "DEM and peeling", "DEM and peeling of piles"}
"""Scopes of fields that have no effect by other methods."""


def words(column: str) -> Info:
    """The words of a column."""
    return FRACTION if column == "fraction" else fields.COLUMNS[column].info


def written(column: str, value: Any) -> str:
    """A value with its symbol in mathematics, for panels and legends."""
    symbol = re.sub(r"_(\w+)", r"_{\1}", words(column).symbol)
    return _with_symbol(column, value, f"${symbol}$" if symbol else "", power_of_ten)


def plain(column: str, value: Any) -> str:
    """A value with its symbol, without mathematics."""
    return _with_symbol(column, value, words(column).symbol.replace("_0", "₀"), "{:g}".format)


def _with_symbol(column: str, value: Any, symbol: str, number: Callable[[float], str]) -> str:
    info = words(column)
    if isinstance(value, str):
        return info.choices.get(value, f"{info.label} {value}")
    if pd.isna(value):
        return f"no {info.label}"
    return f"{symbol or info.label} = {amount(float(value), info.unit, number)}"


def value(column: str, value: Any) -> str:
    """A value without its symbol."""
    info = words(column)
    if isinstance(value, str):
        return info.choices.get(value, value)
    return "none" if pd.isna(value) else amount(value, info.unit)


def told(row: pd.Series, columns: Sequence[str]) -> list[str]:
    """The values of a row with their symbols, without those that the row does not have."""
    return [plain(column, row[column]) for column in columns if is_told(column, row[column])]


def is_told(column: str, value: Any) -> bool:
    """Whether a row has a value; an empty list is one."""
    return bool(pd.notna(value)) or column in LISTS


def panel(row: pd.Series, columns: Sequence[str]) -> str:
    """The values of a row as a title, broken into lines that fit beside another panel."""
    shared = (column for column in columns if is_told(column, row[column]))
    text = ", ".join(written(column, row[column]) for column in shared)
    return textwrap.fill(text, WIDTH, break_long_words=False)


def amount(value: float, unit: str, number: Callable[[float], str] = "{:g}".format) -> str:
    """A value with its unit; one in metres is written in millimetres."""
    match unit:
        case "m":
            return millimetres(value)
        case "d" | "h":
            return ratio_of(value, unit)
        case "%":
            return f"{100 * value:.3g} %"
        case "°":
            return f"{value:.4g}°"
    wide = value and not 1e-3 < abs(value) < 1e5
    return f"{number(value) if wide else f'{value:g}'} {unit}".rstrip()


def ratio_of(ratio: float, length: str) -> str:
    """A length over another, such as ``d/30``."""
    part = 1 / ratio
    whole = round(part)
    return f"{length}/{whole}" if abs(part - whole) < 1e-3 * part else f"{ratio:.3g} {length}"


def millimetres(metres: float) -> str:
    """A length, such as ``0.7 mm``."""
    return f"{metres * 1e3:.6g} mm"


def power_of_ten(value: float) -> str:
    """A number for mathematics, such as ``$10^{-5}$``."""
    exponent = math.floor(math.log10(value) + 1e-12)
    factor = f"{value / 10**exponent:.4g}"
    head = "" if factor == "1" else rf"{factor}\times "
    return f"${head}10^{{{exponent}}}$"


def methods(rows: pd.DataFrame) -> str:
    """The methods that answered rows of a table."""
    names = fields.ANSWERS["answered_method"].info.choices
    return ", ".join(name for key, name in names.items() if (rows["answered_method"] == key).any())


def varying(table: pd.DataFrame, *shown: str) -> list[str]:
    """The fields in which rows differ that agree in all columns that are shown.

    One of several fields that vary together is enough: questions come first, then the method, then
    fields that only some methods have. The seed of one packing among many does not count.
    """

    def rank(column: str) -> int:
        if column == "method" or column not in fields.COLUMNS:
            return 1
        info = fields.COLUMNS[column].info
        return 3 if info.about != "question" else 2 if info.scope in OF_METHODS else 0

    listed: list[str] = []
    groups = table.groupby(list(shown), dropna=False).ngroup().to_numpy()
    for column in sorted(fields.others(table, *shown), key=rank):
        if column in fields.COLUMNS and fields.COLUMNS[column].info.about != "replica":
            codes, values = pd.factorize(table[column], use_na_sentinel=False)
            finer, names = pd.factorize(groups * len(values) + codes)
            if len(names) > groups.max(initial=-1) + 1:
                listed.append(column)
                groups = finer
    return listed
