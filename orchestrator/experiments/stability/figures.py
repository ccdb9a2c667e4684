"""Maps of failure: where in a plane of two parameters a run is good, and what happens elsewhere."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle

from orchestrator.experiments.stability.maps import Map
from orchestrator.experiments.stability.verdicts import Judged
from orchestrator.report import style
from orchestrator.report.style import Look

VERDICTS: dict[str, tuple[str, str, str]] = {
    "good": ("#8cc5e8", "G", "good"),
    "noisy": ("#f4ea7a", "N", "noisy"),
    "wrong": ("#e0803a", "W", "wrong"),
    "stalled": ("#c8c8c8", "S", "stalled"),
    "exploded": ("#5b2a52", "X", "exploded"),
}
"""Colour, letter and name, from the best to the worst."""
FOUND: Look = {"color": "black", "lw": 1.8, "solid_capstyle": "round"}
OPEN: Look = {"color": "black", "lw": 1.0, "ls": (0, (1, 1.5))}


@dataclass(frozen=True)
class Size:
    """How large a map is drawn: height of a cell, inches; letters in a line of text; its font."""

    cell: float
    letters: int
    font: float


ALONE = Size(cell=0.42, letters=115, font=9)
ON_SHEET = Size(cell=0.31, letters=44, font=6.5)
PER_ROW = 2
"""Maps side by side on a sheet."""
AROUND, LINE = 0.62, 0.115
"""Height of a map's title and the words on its axis, and of a line of text, inches."""


def draw(judged: Judged) -> Canvas:
    """One map in a figure of its own; of several runs in one place the worst is shown."""
    cells = Cells(judged)
    figure = style.canvas(_height([cells], ALONE) + 0.5)
    ax = figure.subplots()
    rows, columns = cells.shape
    ax.set_box_aspect(ALONE.cell * rows / min(columns, 6.0))
    _panel(ax, cells, ALONE)
    style.legends(figure, _colour_entries([cells]), _look_entries([cells]))
    return figure


def sheet(judged: Sequence[Judged]) -> Canvas:
    """Many maps as small multiples, in their order."""
    listed = [Cells(one) for one in judged]
    lines = [listed[first : first + PER_ROW] for first in range(0, len(listed), PER_ROW)]
    figure = style.canvas(sum(_height(line, ON_SHEET) for line in lines) + 0.6)
    ratios = [max(cells.shape[0] for cells in line) for line in lines]
    grid = figure.subplots(max(len(lines), 1), PER_ROW, squeeze=False, height_ratios=ratios or None)
    for ax in grid.ravel()[len(listed) :]:
        ax.set_axis_off()
    for ax, cells in zip(grid.ravel(), listed, strict=False):
        _panel(ax, cells, ON_SHEET)
    style.legends(figure, _colour_entries(listed), _look_entries(listed))
    return figure


def _height(line: "Sequence[Cells]", size: Size) -> float:
    """Height of some maps side by side, with the words above and below them, inches."""
    words = [_filled(cells.map, size) for cells in line]
    above, below = (
        max(pair[side].count("\n") + bool(pair[side]) for pair in words) for side in (0, 1)
    )
    rows = max(cells.shape[0] for cells in line)
    return size.cell * rows + AROUND + LINE * (above + below)


def _filled(shown: Map, size: Size) -> tuple[str, str]:
    """The question and the limit, in lines."""
    limit = f"Limit: {' '.join(shown.limits)}" if shown.limits else ""
    return textwrap.fill(shown.question, size.letters), textwrap.fill(limit, size.letters)


class Cells:
    """A map's table as a grid: the values of both axes, rising, and what lies at each place."""

    def __init__(self, judged: Judged) -> None:
        self.map = judged.map
        known = judged.table.dropna(subset=["x", "y", "verdict"])
        self.xs, self.ys = _values(known["x"]), _values(known["y"])
        badness = list(VERDICTS)
        order = known["verdict"].map(badness.index).argsort(kind="stable")
        self._at: dict[tuple[int, int], Any] = {
            (self.xs.index(row.x), self.ys.index(row.y)): row
            for row in known.iloc[order.to_numpy()].itertuples(index=False)
        }

    def __iter__(self) -> Iterator[tuple[int, int, Any]]:
        return ((x, y, row) for (x, y), row in self._at.items())

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns; an empty map has one of each."""
        return max(len(self.ys), 1), max(len(self.xs), 1)

    def verdict(self, x: int, y: int) -> str | None:
        """Verdict at a place; None where nothing was run."""
        row = self._at.get((x, y))
        return None if row is None else str(row.verdict)

    def border(self) -> Iterator[tuple[tuple[int, int], tuple[int, int], bool]]:
        """Edges of good cells: two ends, and whether the run beyond was not good.

        An edge beyond which nothing was run is no boundary that was found.
        """
        for x, y, row in self:
            if row.verdict != "good":
                continue
            for dx, dy, ends in (
                (-1, 0, ((x, y), (x, y + 1))),
                (1, 0, ((x + 1, y), (x + 1, y + 1))),
                (0, -1, ((x, y), (x + 1, y))),
                (0, 1, ((x, y + 1), (x + 1, y + 1))),
            ):
                beyond = self.verdict(x + dx, y + dy)
                if beyond != "good":
                    yield *ends, beyond is not None


def _values(column: pd.Series) -> list[Any]:
    """Numbers in rising order, texts in the order in which they come."""
    found = list(dict.fromkeys(column))
    return found if any(isinstance(value, str) for value in found) else sorted(found)


def _panel(ax: Axes, cells: Cells, size: Size) -> None:
    for x, y, row in cells:
        _cell(ax, x, y, row, size.font)
    for (x0, y0), (x1, y1), found in cells.border():
        look = FOUND if found else OPEN
        ax.plot([x0, x1], [y0, y1], zorder=3, gid="border", clip_on=False, **look)
    ax.set(xlim=(0, cells.shape[1]), ylim=(0, cells.shape[0]))
    ax.set_xticks(np.arange(len(cells.xs)) + 0.5, [_written(value) for value in cells.xs])
    ax.set_yticks(np.arange(len(cells.ys)) + 0.5, [_written(value) for value in cells.ys])
    ax.tick_params(length=0)
    ax.spines[:].set_color("0.75")
    ax.set(xlabel=cells.map.x.label, ylabel=cells.map.y.label)
    if not (cells.xs and cells.ys):
        ax.text(0.5, 0.5, "nothing was run", ha="center", va="center", **style.NOTE)
    _words(ax, cells.map, size)


def _words(ax: Axes, shown: Map, size: Size) -> None:
    """The question above the map, under its title; the limit below."""
    question, limit = _filled(shown, size)
    lines = question.count("\n") + bool(question)
    ax.set_title(shown.title, loc="left", pad=4 + 72 * LINE * lines)
    for text, y, offset, side in ((question, 1, 3, "bottom"), (limit, 0, -27, "top")):
        ax.annotate(
            text, (0, y), (0, offset), "axes fraction", "offset points", va=side, **style.NOTE
        )


def _cell(ax: Axes, x: int, y: int, row: Any, font: float) -> None:
    colour, letter, _ = VERDICTS[row.verdict]
    ax.add_patch(Rectangle((x, y), 1, 1, fc=colour, ec="white", lw=1, gid=row.verdict))
    ink = "white" if np.dot(to_rgb(colour), (0.3, 0.59, 0.11)) < 0.45 else "black"
    known = np.isfinite(row.error)
    ax.text(
        x + 0.5, y + (0.71 if known else 0.5), letter, fontsize=font, weight="bold", color=ink,
        ha="center", va="center",
    )  # fmt: skip
    if known:
        text = percent(float(row.error))
        ax.text(
            x + 0.5, y + 0.3, text, fontsize=font - 1.2, color=ink, ha="center", va="center",
            gid="error",
        )  # fmt: skip
    if row.caught:
        _flag(ax, x, y, ink)


def _flag(ax: Axes, x: int, y: int, ink: str) -> None:
    """A filled corner: the tool noticed."""
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


def _colour_entries(listed: Sequence[Cells]) -> list[Artist]:
    used = {row.verdict for cells in listed for _, _, row in cells}
    return [
        Patch(fc=colour, ec="white", label=f"{letter}: {name}")
        for verdict, (colour, letter, name) in VERDICTS.items()
        if verdict in used
    ]


def _look_entries(listed: Sequence[Cells]) -> list[Artist]:
    found = {known for cells in listed for *_, known in cells.border()}
    entries: list[Artist] = []
    if True in found:
        entries.append(Line2D([], [], label="end of what is good", **FOUND))
    if False in found:
        entries.append(Line2D([], [], label="good; not tried beyond", **OPEN))
    if any(row.caught for cells in listed for _, _, row in cells):
        look: Look = {"ls": "", "marker": (3, 0, 45), "color": "black", "ms": 5}
        entries.append(Line2D([], [], label="corner: the tool notices by itself", **look))
    return entries
