"""The figure of the bed that changes: its thresholds, and the bed line as it wears."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.experiments.budget.choices import label
from orchestrator.grains import wear
from orchestrator.grains.pile import Pile
from orchestrator.report import style
from orchestrator.tables.piles import shields

MOST = 4
"""Piles that are drawn; the table has all."""


def draw(piles: Sequence[tuple[Pile, Pile]], cases: Path) -> Canvas:
    """A row for each pile, frozen and changing: θ at each n/N, and its bed line in each round."""
    shown = piles[:MOST]
    figure = style.canvas(1.9 * len(shown) + 0.6)
    grid = figure.subplots(len(shown), 2, squeeze=False)
    for (left, right), (frozen, changing) in zip(grid, shown, strict=True):
        _curve(left, frozen, cases, "0.5", "--")
        _curve(left, changing, cases, "#0072b2", "-")
        left.set(xlim=(0, max(changing.scene.protocol.fractions)), ylabel="Shields number $θ$")
        left.set_ylim(bottom=0)
        _lines(right, changing, cases)
        left.set_title(label(frozen.scene), loc="left", fontsize=8)
    grid[-1, 0].set_xlabel("n/N")
    grid[-1, 1].set_xlabel("x / h")
    samples = [
        Line2D([], [], color="0.5", ls="--", label="flow of the whole pile"),
        Line2D([], [], color="#0072b2", label="flow of the bed as it is"),
    ]
    style.legends(figure, samples, [])
    return figure


def _curve(ax: Axes, pile: Pile, cases: Path, colour: str, dashes: str) -> None:
    whole = pile.packing.count
    count = round(max(pile.scene.protocol.fractions) * whole)
    fractions = np.arange(1, count + 1) / whole
    tau = np.array([one.tau for one in pile.thresholds(cases, fractions.tolist())])
    ax.plot(fractions, shields(pile.scene, tau), color=colour, ls=dashes)


def _lines(ax: Axes, pile: Pile, cases: Path) -> None:
    h, count = pile.line.h, len(pile.flows)
    for number, flow in enumerate(pile.flows):
        line = wear.line(pile, flow, cases)
        colour = colormaps["YlGnBu"](0.35 + 0.65 * number / count)
        ax.plot(np.array(line.x) / h, np.array(line.z) / h, color=colour, lw=0.9)
    start, end = pile.line.x[1] / h, float(pile.line.crest[0]) / h
    ax.set(xlim=(start, end + 0.4), ylabel="z / h")
