"""The figure of the bed that changes: who has left at which flow, and the bed line as it wears."""

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.experiments.budget.choices import label
from orchestrator.experiments.budget.wear import LAST, Wear
from orchestrator.report import style

MOST = 4
"""Piles that are drawn; the table has all."""


def draw(piles: Sequence[Wear]) -> Canvas:
    """A row for each pile: its curve of n/N, and its bed line after each tenth."""
    shown = piles[:MOST]
    figure = style.canvas(1.9 * len(shown) + 0.6)
    grid = figure.subplots(len(shown), 2, squeeze=False)
    for (left, right), one in zip(grid, shown, strict=True):
        _curves(left, one)
        _lines(right, one)
        left.set_title(label(one.bed.scene), loc="left", fontsize=8)
    grid[-1, 0].set_xlabel("undisturbed friction velocity $u^*_0$, m/s")
    grid[-1, 1].set_xlabel("x / h")
    samples = [
        Line2D([], [], color="0.5", ls="--", label="flow of the whole pile"),
        Line2D([], [], color="#0072b2", label="flow of the bed as it is"),
    ]
    style.legends(figure, samples, [])
    return figure


def _curves(ax: Axes, one: Wear) -> None:
    count = one.bed.packing.count
    worn = one.left[one.bed.packing.windward]
    for flows, colour, style_of in ((one.frozen, "0.5", "--"), (worn, "#0072b2", "-")):
        known = np.sort(flows[np.isfinite(flows)])[: int(LAST * count) + 1]
        moved = np.arange(1, len(known) + 1) / count
        ax.step(known, moved, where="post", color=colour, ls=style_of)
    ax.set(ylim=(0, LAST), ylabel="n/N")


def _lines(ax: Axes, one: Wear) -> None:
    h = one.lines[0].h
    for number, line in enumerate(one.lines):
        colour = colormaps["YlGnBu"](0.35 + 0.65 * number / len(one.lines))
        ax.plot(np.array(line.x) / h, np.array(line.z) / h, color=colour, lw=0.9)
    start, end = one.lines[0].x[1] / h, float(one.lines[0].crest[0]) / h
    ax.set(xlim=(start, end + 0.4), ylabel="z / h")
