"""Maps of failure as grids of cells, and the sheet of all of them."""

import textwrap
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle

from orchestrator.experiments.stability import Map
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
BORDERS: dict[bool, tuple[str, Look]] = {
    True: ("end of what is good", {"color": "black", "lw": 1.8, "solid_capstyle": "round"}),
    False: ("good; not tried beyond", {"color": "black", "lw": 1.0, "ls": (0, (1, 1.5))}),
}
"""Edges of good cells: whether the run beyond was not good, or nothing was run."""
AROUND, LINE = 0.62, 0.115
"""Height of a map's title and the words on its axis, and of a line of text, inches."""


class Size(NamedTuple):
    """How large maps are drawn: side by side, height of a cell (inches), letters a line, font."""

    beside: int
    cell: float
    letters: int
    font: float


SINGLE, SHEET = Size(1, 0.42, 115, 9), Size(2, 0.31, 44, 6.5)


def draw(one: Map, table: pd.DataFrame) -> Canvas:
    """One map in a figure of its own; `table` is as `stability.judge` gives it."""
    figure = _drawn([one], [table], SINGLE)
    rows, columns = (table[axis].dropna().nunique() or 1 for axis in ("y", "x"))
    figure.axes[0].set_box_aspect(SINGLE.cell * rows / min(columns, 6.0))
    return figure


def sheet(maps: Sequence[Map], tables: Sequence[pd.DataFrame]) -> Canvas:
    """Many maps as small multiples, in their order."""
    return _drawn(maps, tables, SHEET)


def _drawn(maps: Sequence[Map], tables: Sequence[pd.DataFrame], size: Size) -> Canvas:
    words = []
    for one in maps:
        limit = f"Limit: {' '.join(one.limits)}" if one.limits else ""
        texts = (one.data["question"], limit)
        words.append([textwrap.fill(text, size.letters) for text in texts])
    starts = range(0, len(maps), size.beside) or range(1)
    heights, ratios = [], []
    for start in starts:
        line = slice(start, start + size.beside)
        count = max((table["y"].dropna().nunique() for table in tables[line]), default=1) or 1
        lines = sum(max(map(_lines, side), default=0) for side in zip(*words[line], strict=True))
        heights.append(size.cell * count + AROUND + LINE * lines)
        ratios.append(count)
    figure = style.canvas(sum(heights) + 0.55)
    grid = figure.subplots(len(starts), size.beside, squeeze=False, height_ratios=ratios)
    for ax in grid.ravel()[len(maps) :]:
        ax.set_axis_off()
    shown = [_placed(table) for table in tables]
    for ax, one, table, text in zip(grid.ravel(), maps, shown, words, strict=False):
        _panel(ax, one, table, size.font)
        ax.set_title(one.data["title"], loc="left", pad=4 + 72 * LINE * _lines(text[0]))
        places = ((1, 3, "bottom"), (0, -27, "top"))
        for said, (y, offset, side) in zip(text, places, strict=True):
            place = (0, y), (0, offset), "axes fraction", "offset points"
            ax.annotate(said, *place, va=side, **style.NOTE)
    used = {verdict for table in shown for verdict in table["verdict"]}
    colours = [
        Patch(fc=colour, ec="white", label=f"{letter}: {verdict}")
        for verdict, (colour, _, letter) in VERDICTS.items()
        if verdict in used
    ]
    ends = {found for table in shown for *_, found in _border(table)}
    looks = [
        Line2D([], [], label=text, **look)
        for found, (text, look) in BORDERS.items()
        if found in ends
    ]
    if any(table["caught"].any() for table in shown):
        corner: Look = {"ls": "", "marker": (3, 0, 45), "color": "black", "ms": 5}
        looks.append(Line2D([], [], label="corner: the tool notices by itself", **corner))
    style.legends(figure, colours, looks)
    return figure


def _lines(text: str) -> int:
    return text.count("\n") + bool(text)


def _placed(table: pd.DataFrame) -> pd.DataFrame:
    """The rows with a place, with its column and row; of several in one place the worst."""
    rows = table.dropna(subset=["x", "y", "verdict"])
    worst = rows["verdict"].map(list(VERDICTS).index).sort_values(kind="stable").index
    shown = rows.loc[worst].drop_duplicates(["x", "y"], keep="last")
    for axis, name in (("x", "column"), ("y", "row")):
        values = list(dict.fromkeys(rows[axis]))  # texts as they come, numbers rising
        values = values if any(isinstance(v, str) for v in values) else sorted(values)
        shown[name] = [values.index(value) for value in shown[axis]]
    return shown


def _panel(ax: Axes, one: Map, table: pd.DataFrame, font: float) -> None:
    """The cells of a map: colour, letter, error, and a corner where the run itself noticed."""
    cells: Any = table.itertuples(index=False)
    for cell in cells:
        x, y = cell.column, cell.row
        colour, ink, letter = VERDICTS[cell.verdict]
        ax.add_patch(Rectangle((x, y), 1, 1, fc=colour, ec="white", lw=1, gid=cell.verdict))
        known = np.isfinite(cell.error)
        middle: Look = {"color": ink, "ha": "center", "va": "center"}
        height = y + (0.71 if known else 0.5)
        ax.text(x + 0.5, height, letter, fontsize=font, weight="bold", **middle)
        if known:
            text = percent(float(cell.error))
            ax.text(x + 0.5, y + 0.3, text, fontsize=font - 1.2, gid="error", **middle)
        if cell.caught:
            corner = [(x + 0.78, y + 0.97), (x + 0.97, y + 0.97), (x + 0.97, y + 0.6)]
            ax.add_patch(Polygon(corner, fc=ink, lw=0, gid="caught"))
    for start, end, found in _border(table):
        look = BORDERS[found][1]
        ends = zip(start, end, strict=True)
        ax.plot(*ends, zorder=3, gid="border", clip_on=False, **look)
    for axis, name, place in ((ax.xaxis, "x", "column"), (ax.yaxis, "y", "row")):
        values = table.drop_duplicates(place).sort_values(place)[name]
        axis.set_ticks(np.arange(len(values)) + 0.5, [_written(value) for value in values])
        axis.set_label_text(one.data[name]["label"])
        axis.set_view_interval(0, max(len(values), 1), ignore=True)
    ax.tick_params(length=0)
    ax.spines[:].set_color("0.75")
    if table.empty:
        ax.text(0.5, 0.5, "nothing was run", ha="center", va="center", **style.NOTE)


def _border(table: pd.DataFrame) -> Iterator[tuple[tuple[int, int], tuple[int, int], bool]]:
    """Edges of good cells: two ends, and whether the run beyond was not good.

    An edge beyond which nothing was run is no boundary that was found.
    """
    cells: Any = table.itertuples(index=False)
    verdict = {(cell.column, cell.row): cell.verdict for cell in cells}
    for (x, y), here in verdict.items():
        for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)) if here == "good" else ():
            beyond = verdict.get((x + dx, y + dy))
            start = x + max(dx, 0), y + max(dy, 0)
            if beyond != "good":
                yield start, (start[0] + abs(dy), start[1] + abs(dx)), beyond is not None


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
