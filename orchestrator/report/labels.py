"""How values are written in figures and on the page."""

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


def words(column: str) -> Info:
    """The words of a column."""
    return FRACTION if column == "fraction" else fields.COLUMNS[column].info


def written(column: str, value: Any) -> str:
    """A value with its symbol, as panels and legends say it."""
    info = words(column)
    return _said(info, value, f"${math_of(info.symbol)}$" if info.symbol else "", power_of_ten)


def plain(column: str, value: Any) -> str:
    """A value with its symbol where there is no mathematics."""
    info = words(column)
    return _said(info, value, text_of(info.symbol), "{:g}".format)


def _said(info: Info, value: Any, symbol: str, number: Callable[[float], str]) -> str:
    if isinstance(value, str):
        return info.choices.get(value, f"{info.label} {value}")
    if pd.isna(value):
        return f"no {info.label}"
    return f"{symbol or info.label} = {amount(float(value), info.unit, number)}"


def value(column: str, value: Any) -> str:
    """A value alone."""
    info = words(column)
    if isinstance(value, str):
        return info.choices.get(value, value)
    return "none" if pd.isna(value) else amount(value, info.unit)


def told(row: pd.Series, columns: Sequence[str]) -> list[str]:
    """The values that a row has to tell, with their symbols, where there is no mathematics."""
    return [plain(column, row[column]) for column in columns if is_told(column, row[column])]


def is_told(column: str, value: Any) -> bool:
    """Whether a row has a value to tell: one without obstacles has none of them."""
    return bool(pd.notna(value)) or column in LISTS


def text_of(symbol: str) -> str:
    """A symbol where there is no mathematics."""
    return symbol.replace("_0", "₀")


def math_of(symbol: str) -> str:
    """A symbol for mathematics: its index in braces."""
    return re.sub(r"_(\w+)", r"_{\1}", symbol)


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
    """The methods that answered some rows."""
    known = fields.ANSWERS["answered_method"].info.choices
    return ", ".join(name for key, name in known.items() if (rows["answered_method"] == key).any())


def panel(row: pd.Series, columns: Sequence[str]) -> str:
    """Values that all rows of a panel or a marker share; fields without effect are left out.

    It is broken into lines that fit beside another panel.
    """
    shared = (column for column in columns if is_told(column, row[column]))
    said = ", ".join(written(column, row[column]) for column in shared)
    return textwrap.fill(said, WIDTH, break_long_words=False)
