"""The picture of several beds or grains: thresholds over a number that varies."""

import math
from collections.abc import Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.report import labels, sheets, single
from orchestrator.report.drawing import (
    ANSWER,
    GROUND,
    INK,
    NONE,
    PALE,
    Head,
    figure,
    log_sizes,
    margins,
)
from orchestrator.report.style import Look
from orchestrator.report.subjects import Quantity

MOST_SERIES = 4
"""Curves of a sweep that a drawing tells apart."""
DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1, 2)))
APART = 15.0
"""Least distance of the names of curves, px."""
POINTS_OF_PX = 0.72
"""Points of a px of a drawing."""
MOST_TICKS = 6
"""Sizes that an axis names each."""
MARKERS = "osD^"
"""Dashes and markers of the curves of a sweep."""


def sweep(rows: pd.DataFrame) -> Head | None:
    """Draw thresholds over the size, or over the first other number that varies.

    Parameters
    ----------
    rows
        Thresholds with the columns of their scenes.

    Returns
    -------
    Head or None
        The picture; None where no number varies, or too many do.
    """
    told = sheets.quantity(rows)
    column = _across(rows)
    if column is None:
        return None
    others = [name for name in labels.varying(rows, column) if name != "fraction"]
    series = _series(rows, others)
    if len(series) > MOST_SERIES or len(rows) < 2:
        return None
    info = labels.words(column)
    scale = 1e3 if info.unit == "m" else 1.0
    unit = "mm" if info.unit == "m" else info.unit
    what = f"{info.label}, {unit}".rstrip(", ")
    title = f"The {told.name} that moves each, against the {info.label}"
    caption = (
        "Orange: computed, with its interval; rings: not usable. Dashed: with the "
        "measured threshold of one grain."
    )

    def draw(narrow: bool) -> Canvas:
        canvas = figure(narrow, 300)
        ax = canvas.subplots()
        margins(canvas, 40, 12 if narrow else 190, 24, 38)
        for number, (_, part) in enumerate(series):
            _draw_series(ax, part, told, column, scale, number)
        if column == "d_m":
            log_sizes(ax)
            sizes = (scale * rows[column]).unique()
            if len(sizes) <= MOST_TICKS:
                ax.set_xticks(sizes)
        ax.set_ylim(0, None)
        if not narrow:
            _names(ax, series, column, scale)
        ax.set_xlabel(what)
        ax.set_title(f"{told.name.capitalize()} that moves it, {told.unit}")
        return canvas

    return Head(draw, title, caption)


def _names(
    ax: Axes, series: Sequence[tuple[str, pd.DataFrame]], column: str, scale: float
) -> None:
    """The names of the curves at their ends, apart from one another."""
    ends = []
    for name, part in series:
        end = part.sort_values(column).iloc[-1]
        if name:
            ends.append((float(end["told"]), scale * float(end[column]), name))
    ends.sort()
    lowest = -math.inf
    look: Look = {"textcoords": "offset points", "va": "center"}
    look |= {"color": ANSWER, "annotation_clip": False}
    for y, x, name in ends:
        place = float(ax.transData.transform((x, y))[1])
        shown = max(place, lowest + APART)
        lowest = shown
        # points of a drawing whose px are of 1/100 inch
        up = (shown - place) * POINTS_OF_PX
        ax.annotate(name, (x, y), xytext=(10, up), **look)


def _across(rows: pd.DataFrame) -> str | None:
    """The column along which a sweep is drawn: the size, else a number that varies."""
    if rows["d_m"].nunique() > 1:
        return "d_m"
    for name in labels.varying(rows, "bed"):
        is_number = pd.api.types.is_numeric_dtype(rows[name])
        if is_number and rows[name].nunique() > 2:
            return name
    return None


def _series(
    rows: pd.DataFrame, others: Sequence[str]
) -> list[tuple[str, pd.DataFrame]]:
    """The parts of a sweep that agree in all but one column, with their names."""
    told = sheets.quantity(rows)
    values = [
        single.in_unit(row, float(row["ustar0_m_s"]), told)
        for _, row in rows.iterrows()
    ]
    rows = rows.assign(told=values)
    if not others:
        return [("", rows)]
    parts = []
    for _, part in rows.groupby(list(others), dropna=False, sort=False):
        parts.append((", ".join(labels.told(part.iloc[0], others)), part))
    return parts


def _draw_series(
    ax: Axes,
    part: pd.DataFrame,
    told: Quantity,
    column: str,
    scale: float,
    number: int,
) -> None:
    """A curve of a sweep: computed, with intervals and hollow points, and measured."""
    part = part.sort_values(column)
    x = scale * part[column].to_numpy(float)
    y = part["told"].to_numpy(float)
    dash = DASHES[number]
    ax.plot(x, y, color=ANSWER, lw=1.5, ls=dash)
    low = part[told.column("_low")].to_numpy(float)
    high = part[told.column("_high")].to_numpy(float)
    ax.vlines(x, low, high, color=PALE, lw=6, zorder=1)
    usable = part["usable"].to_numpy(bool)
    marker = MARKERS[number]
    ax.plot(x[usable], y[usable], marker, color=ANSWER, ms=6)
    ax.plot(x[~usable], y[~usable], marker, color=NONE, mfc=GROUND, ms=6)
    measured = [
        single.in_unit(row, single.measured_ustar(row, row["ustar0_m_s"]), told)
        for _, row in part.iterrows()
    ]
    ax.plot(x, measured, color=INK, lw=1.2, ls=(0, (4, 2)), zorder=1.5)
