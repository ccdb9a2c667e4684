"""Maps of failure as grids of cells, and the sheet of all of them."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle

from orchestrator.experiments.stability import Judged, Map
from orchestrator.report import style
from orchestrator.report.style import Look

VERDICTS = {
    "good": ("#8cc5e8", "black", "G"),
    "noisy": ("#f4ea7a", "black", "N"),
    "wrong": ("#e0803a", "black", "W"),
    "stalled": ("#c8c8c8", "black", "S"),
    "exploded": ("#5b2a52", "white", "X"),
}
"""Colour of the cell and of its letter, and the letter, from the best to the worst verdict."""
FOUND: Look = {"color": "black", "lw": 1.8, "solid_capstyle": "round"}
OPEN: Look = {"color": "black", "lw": 1.0, "ls": (0, (1, 1.5))}
PER_ROW = 2
"""Maps side by side on a sheet."""
AROUND, LINE = 0.62, 0.115
"""Height of a map's title and the words on its axis, and of a line of text, inches."""


@dataclass(frozen=True)
class Size:
    """How large a map is drawn: height of a cell, inches; letters in a line; its font."""

    cell: float
    letters: int
    font: float

    def words(self, shown: Map) -> tuple[str, str]:
        """The question and the limits of a map, in lines."""
        limit = f"Limit: {' '.join(shown.limits)}" if shown.limits else ""
        return textwrap.fill(shown.question, self.letters), textwrap.fill(limit, self.letters)


SINGLE = Size(cell=0.42, letters=115, font=9)
ON_SHEET = Size(cell=0.31, letters=44, font=6.5)


@dataclass(frozen=True)
class Cells:
    """A map's table as a grid; of several runs in one place the worst is shown."""

    judged: Judged

    @cached_property
    def table(self) -> pd.DataFrame:
        """The rows that are shown, with their column and row in the grid."""
        table = self.judged.table.dropna(subset=["x", "y", "verdict"])
        rank = table["verdict"].map(list(VERDICTS).index)
        table = table.assign(rank=rank).sort_values("rank", kind="stable")
        table = table.drop_duplicates(["x", "y"], keep="last")
        places = {axis: {v: i for i, v in enumerate(self.values(axis))} for axis in "xy"}
        return table.assign(column=table["x"].map(places["x"]), row=table["y"].map(places["y"]))

    def values(self, axis: str) -> list[Any]:
        """Places on an axis: numbers in rising order, texts in the order in which they come."""
        values = list(dict.fromkeys(self.judged.table.dropna(subset=["x", "y", "verdict"])[axis]))
        return values if any(isinstance(value, str) for value in values) else sorted(values)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns; an empty map has one of each."""
        return max(len(self.values("y")), 1), max(len(self.values("x")), 1)

    def border(self) -> Iterator[tuple[tuple[int, int], tuple[int, int], bool]]:
        """Edges of good cells: two ends, and whether the run beyond was not good.

        An edge beyond which nothing was run is no boundary that was found.
        """
        rows: Any = self.table.itertuples(index=False)
        verdict = {(row.column, row.row): row.verdict for row in rows}
        for (x, y), here in verdict.items():
            for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)) if here == "good" else ():
                beyond = verdict.get((x + dx, y + dy))
                start = x + max(dx, 0), y + max(dy, 0)
                end = start[0] + abs(dy), start[1] + abs(dx)
                if beyond != "good":
                    yield start, end, beyond is not None


def draw(judged: Judged) -> Canvas:
    """One map in a figure of its own."""
    cells = Cells(judged)
    rows, columns = cells.shape
    figure = style.canvas(_height([cells], SINGLE) + 0.5)
    ax = figure.subplots()
    ax.set_box_aspect(SINGLE.cell * rows / min(columns, 6.0))
    _panel(ax, cells, SINGLE)
    style.legends(figure, *_entries([cells]))
    return figure


def sheet(judged: Sequence[Judged]) -> Canvas:
    """Many maps as small multiples, in their order."""
    listed = [Cells(one) for one in judged]
    lines = [listed[first : first + PER_ROW] for first in range(0, len(listed), PER_ROW)]
    figure = style.canvas(sum(_height(line, ON_SHEET) for line in lines) + 0.6)
    ratios = [max(cells.shape[0] for cells in line) for line in lines] or None
    grid = figure.subplots(max(len(lines), 1), PER_ROW, squeeze=False, height_ratios=ratios)
    for ax in grid.ravel()[len(listed) :]:
        ax.set_axis_off()
    for ax, cells in zip(grid.ravel(), listed, strict=False):
        _panel(ax, cells, ON_SHEET)
    style.legends(figure, *_entries(listed))
    return figure


def _height(line: Sequence[Cells], size: Size) -> float:
    """Height of some maps side by side, with the words above and below them, inches."""
    words = [size.words(cells.judged.map) for cells in line]
    sides = zip(*words, strict=True)
    lines = sum(max([text.count("\n") + bool(text) for text in side]) for side in sides)
    rows = max(cells.shape[0] for cells in line)
    return float(size.cell * rows + AROUND + LINE * lines)


def _panel(ax: Axes, cells: Cells, size: Size) -> None:
    rows: Any = cells.table.itertuples(index=False)
    for row in rows:
        _cell(ax, row.column, row.row, row, size.font)
    for (x0, y0), (x1, y1), found in cells.border():
        look = FOUND if found else OPEN
        ax.plot([x0, x1], [y0, y1], zorder=3, gid="border", clip_on=False, **look)
    ax.set(xlim=(0, cells.shape[1]), ylim=(0, cells.shape[0]))
    for axis, values in ((ax.xaxis, cells.values("x")), (ax.yaxis, cells.values("y"))):
        axis.set_ticks(np.arange(len(values)) + 0.5, [_written(value) for value in values])
    ax.tick_params(length=0)
    ax.spines[:].set_color("0.75")
    shown = cells.judged.map
    ax.set(xlabel=shown.x.label, ylabel=shown.y.label)
    if cells.table.empty:
        ax.text(0.5, 0.5, "nothing was run", ha="center", va="center", **style.NOTE)
    question, limit = size.words(shown)
    lines = question.count("\n") + bool(question)
    ax.set_title(shown.title, loc="left", pad=4 + 72 * LINE * lines)
    for text, y, offset, side in ((question, 1, 3, "bottom"), (limit, 0, -27, "top")):
        ax.annotate(
            text, (0, y), (0, offset), "axes fraction", "offset points", va=side, **style.NOTE
        )


def _cell(ax: Axes, x: int, y: int, row: Any, font: float) -> None:
    colour, ink, letter = VERDICTS[row.verdict]
    ax.add_patch(Rectangle((x, y), 1, 1, fc=colour, ec="white", lw=1, gid=row.verdict))
    known = np.isfinite(row.error)
    middle: Look = {"color": ink, "ha": "center", "va": "center"}
    height = y + (0.71 if known else 0.5)
    ax.text(x + 0.5, height, letter, fontsize=font, weight="bold", **middle)
    if known:
        text = percent(float(row.error))
        ax.text(x + 0.5, y + 0.3, text, fontsize=font - 1.2, gid="error", **middle)
    if row.caught:  # a filled corner
        corner = [(x + 0.78, y + 0.97), (x + 0.97, y + 0.97), (x + 0.97, y + 0.6)]
        ax.add_patch(Polygon(corner, fc=ink, lw=0, gid="caught"))


def percent(error: float) -> str:
    """A signed error, to two digits at most."""
    size = 100 * abs(error)
    if size >= 1000:
        return f"{'+' if error > 0 else '−'}{size / 100:.0f}×"
    text = f"{100 * error:+.0f}" if size >= 9.95 else f"{100 * error:+.1f}"
    return f"{text} %".replace("-", "−")


def _written(value: object) -> str:
    if isinstance(value, str):
        return value
    number = float(str(value))
    plain = number <= 0 or 1e-3 <= number < 1e5
    return f"{number:g}" if plain else f"{number:.3g}".replace("e-0", "e-").replace("e+0", "e")


def _entries(listed: Sequence[Cells]) -> tuple[list[Artist], list[Artist]]:
    """Legends of the colours and of the looks that are drawn."""
    table = pd.concat([cells.table for cells in listed]) if listed else pd.DataFrame()
    used = set(table["verdict"]) if len(table) else set()
    colours: list[Artist] = [
        Patch(fc=colour, ec="white", label=f"{letter}: {verdict}")
        for verdict, (colour, _, letter) in VERDICTS.items()
        if verdict in used
    ]
    ends = {found for cells in listed for *_, found in cells.border()}
    looks: list[Artist] = []
    for found, text, look in (
        (True, "end of what is good", FOUND),
        (False, "good; not tried beyond", OPEN),
    ):
        if found in ends:
            looks.append(Line2D([], [], label=text, **look))
    if len(table) and table["caught"].any():
        corner: Look = {"ls": "", "marker": (3, 0, 45), "color": "black", "ms": 5}
        looks.append(Line2D([], [], label="corner: the tool notices by itself", **corner))
    return colours, looks
