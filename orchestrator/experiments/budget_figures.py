"""The tornado of the shared choices, and the bed that changes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from orchestrator.experiments.budget import ENDS, QUANTITIES
from orchestrator.experiments.experiment import label
from orchestrator.fidelity.calibration import together
from orchestrator.grains.pile import Pile
from orchestrator.grains.pile import line as bed_line
from orchestrator.report import style
from orchestrator.tables.piles import shields

MOST_PILES = 4
"""Piles whose wear is drawn; the table has all."""
BLUE, ORANGE = "#0072b2", "#d55e00"
LABELS = ("Shields number $θ$", "undisturbed friction velocity $u^*_0$")
BAR = 0.38
"""Height of a bar; a choice has two, 1 apart from the next."""


def tornado(shared: pd.DataFrame) -> Canvas:
    """The chart of one scene: the largest share of each choice over the fractions.

    Parameters
    ----------
    shared : DataFrame
        Rows of `budget.shares` of one scene.
    """
    largest = shared.groupby("choice", sort=False)[ENDS].max()
    largest = largest.loc[largest.max(axis=1).sort_values().index]
    total = [*together(largest, "shields"), *together(largest, "ustar0")]
    rows = pd.concat([largest, pd.DataFrame([total], columns=ENDS, index=["all together"])])
    figure = style.canvas(0.28 * len(rows) + 1.0)
    ax = figure.subplots()
    for offset, name, colour in zip((BAR / 2, -BAR / 2), QUANTITIES, (BLUE, ORANGE), strict=True):
        low, high = 100 * rows[f"{name}_low"], 100 * rows[f"{name}_high"]
        places = np.arange(len(rows)) + offset
        ax.barh(places, low + high, BAR, left=-low, color=colour, lw=0)
    ax.axvline(0.0, color="0.2", lw=0.8)
    ax.axhline(len(largest) - 0.5, color="0.7", lw=0.6)
    ax.set_yticks(range(len(rows)), list(rows.index))
    ax.set_xlabel("change of the threshold, %")
    ax.grid(axis="x", lw=0.4, color="0.85")
    looks = zip((BLUE, ORANGE), LABELS, strict=True)
    style.legends(figure, [Patch(color=colour, label=text) for colour, text in looks], [])
    return figure


def curves(piles: Sequence[tuple[Pile, Pile]], cases: Path) -> Canvas:
    """A row for each pile, frozen and changing: θ at each n/N, and its bed line in each round."""
    shown = piles[:MOST_PILES]
    figure = style.canvas(1.9 * len(shown) + 0.6)
    grid = figure.subplots(len(shown), 2, squeeze=False)
    for (left, right), (frozen, changing) in zip(grid, shown, strict=True):
        for pile, colour, dashes in ((frozen, "0.5", "--"), (changing, BLUE, "-")):
            whole = pile.packing.count
            count = round(max(pile.scene.protocol.fractions) * whole)
            fractions = np.arange(1, count + 1) / whole
            tau = np.array([row.tau for row in pile.thresholds(cases, fractions.tolist())])
            left.plot(fractions, shields(pile.scene, tau), color=colour, ls=dashes)
        left.set(xlim=(0, max(changing.scene.protocol.fractions)), ylabel="Shields number $θ$")
        left.set_ylim(bottom=0)
        left.set_title(label(frozen.scene), loc="left", fontsize=8)
        h, rounds = changing.line.h, changing.flows
        for number, flow in enumerate(rounds):
            line = bed_line(changing, flow, cases)
            shade = colormaps["YlGnBu"](0.35 + 0.65 * number / len(rounds))
            right.plot(np.array(line.x) / h, np.array(line.z) / h, color=shade, lw=0.9)
        end = float(changing.line.crest[0]) / h + 0.4
        right.set(xlim=(changing.line.x[1] / h, end), ylabel="z / h")
    grid[-1, 0].set_xlabel("n/N")
    grid[-1, 1].set_xlabel("x / h")
    samples = [
        Line2D([], [], color="0.5", ls="--", label="flow of the whole pile"),
        Line2D([], [], color=BLUE, label="flow of the bed as it is"),
    ]
    style.legends(figure, samples, [])
    return figure
