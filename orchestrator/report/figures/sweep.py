"""Several beds or grains: thresholds over a number that varies."""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.report import answers, labels, sheets, single, style, theory
from orchestrator.report.figures import FigureKind
from orchestrator.report.results import Results, case_names
from orchestrator.report.style import ANSWER, INK, MEASURED, NONE, PALE, Figure
from orchestrator.report.subjects import ReportedQuantity

MOST_SERIES = 4
"""Curves of a sweep that a drawing tells apart."""
DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1, 2)))
MARKERS = "osD^"
"""Dashes and markers of the curves of a sweep."""
MOST_TICKS = 6
"""Sizes that an axis names each."""
CAPTION = (
    "Orange: computed, with its interval; rings: not usable. Dashed, black: with the "
    "measured θ_c of one grain, or with that of a formula."
)


def draw(results: Results) -> Iterator[Figure]:
    """Draw thresholds over the size, or over the first other number that varies.

    Yields
    ------
    Figure
        Of several beds, or else of several grains, one figure; none where no number
        varies, or too many do.
    """
    if theory.are_many(results) or answers.is_of_hills(results):
        return
    if results.joined("pile_threshold").empty:
        rows = sheets.single_grains_sheet(results)
        is_one = rows.empty or answers.is_one_grain(rows)
    else:
        rows = results.exemplars
        is_one = rows.empty or not answers.are_several_beds(results.at_fraction)
    column = None if is_one else _across(rows)
    if column is None or len(rows) < 2 or sheets.sizes_sheet(results) is not None:
        return
    series = _series(rows, column)
    if len(series) > MOST_SERIES:
        return
    told = sheets.quantity_of_rows(rows)
    title = (
        f"The {told.name} that moves each, against the {labels.info_of(column).label}"
    )
    place: style.Place = "under" if "fraction" in rows else "lead"
    drawing = _sweep(series, column, told)
    yield Figure("sweep", title, CAPTION, case_names(rows), drawing, place=place)


def _sweep(
    series: Sequence[tuple[str, pd.DataFrame]], column: str, told: ReportedQuantity
) -> Canvas:
    """The curves over a column."""
    info = labels.info_of(column)
    scale = 1e3 if info.unit == "m" else 1.0
    unit = "mm" if info.unit == "m" else info.unit
    is_one = len(series) == 1
    canvas = style.canvas(2.4 + 0.23 * len(series), style.NARROW)
    ax = canvas.subplots()
    sizes: set[float] = set()
    for number, (name, part) in enumerate(series):
        _draw_series(ax, part, told, column, scale, number, name)
        sizes |= set(scale * part[column])
    if column == "d_m":
        style.log_sizes(ax)
        if len(sizes) <= MOST_TICKS:
            ax.set_xticks(sorted(sizes))
    ax.set(ylim=(0, None), xlabel=f"{info.label}, {unit}".rstrip(", "))
    ax.set_ylabel(f"{told.name}, {told.unit}")
    handles = style.samples([ax])
    columns = len(handles) if is_one else 1
    canvas.legend(handles=handles, loc="outside lower center", ncols=columns)
    return canvas


def _across(rows: pd.DataFrame) -> str | None:
    """The column along which a sweep is drawn: the size, else a number that varies."""
    if rows["d_m"].nunique() > 1:
        return "d_m"
    for name in labels.varying(rows, "bed"):
        is_number = pd.api.types.is_numeric_dtype(rows[name])
        if is_number and rows[name].nunique() > 2:
            return name
    return None


def _series(rows: pd.DataFrame, column: str) -> list[tuple[str, pd.DataFrame]]:
    """The parts of a sweep that agree in all but one column, with their names."""
    others = [name for name in labels.varying(rows, column) if name != "fraction"]
    if not others:
        return [("computed", rows)]
    parts = []
    for _, part in rows.groupby(others, dropna=False, sort=False):
        parts.append((", ".join(labels.told(part.iloc[0], others)), part))
    return parts


def _draw_series(
    ax: Axes,
    part: pd.DataFrame,
    told: ReportedQuantity,
    column: str,
    scale: float,
    number: int,
    name: str,
) -> None:
    """A curve of a sweep: computed, with intervals and open points, and measured."""
    part = part.sort_values(column)
    x = scale * part[column].to_numpy(float)
    y = part[told.column()].to_numpy(float)
    look = {"ls": DASHES[number], "label": name}
    ax.plot(x, y, color=ANSWER, lw=1.5, **look)
    low = part[told.column("_low")].to_numpy(float)
    high = part[told.column("_high")].to_numpy(float)
    ax.vlines(x, low, high, color=PALE, lw=5, zorder=1)
    usable = part["usable"].to_numpy(bool)
    marker = MARKERS[number]
    ax.plot(x[usable], y[usable], marker, color=ANSWER, ms=5)
    ax.plot(x[~usable], y[~usable], marker, color=NONE, mfc="white", ms=5)
    compared = part[f"compared_{told.column()}"].to_numpy(float)
    every = (row for _, row in part.iterrows())
    name = single.with_threshold(*every) if number == 0 else "_"
    ax.plot(x, compared, color=INK, lw=1.1, ls=MEASURED, zorder=1.5, label=name)


FIGURE = FigureKind(order=90, draws=draw, uses=("pile_threshold", "single_grain"))
