"""The picture of many force laws: where each is within what was measured in water."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.report import labels, theory
from orchestrator.report.drawing import (
    ANSWER,
    FLOW,
    LINE,
    NONE,
    Head,
    figure,
    margins,
)


def laws(best: Sequence[theory.Line]) -> Head:
    """Draw the ranges of Re* in which laws are within what was measured in water.

    Parameters
    ----------
    best
        The best line of each law, the nearest one first.

    Returns
    -------
    Head
        The picture.
    """
    title = "Where each force law is within what flumes measured, by Re*"
    caption = (
        "Thick: Re* at which the law is between the tenth and the ninetieth percentile "
        "of the flumes; thin: where it answers. Orange: the nearest law. At the right: "
        "its factor from the measured medians, in the median."
    )

    def draw(narrow: bool) -> Canvas:
        canvas = figure(narrow, 44 + 30 * len(best))
        ax = canvas.subplots()
        margins(canvas, 118 if narrow else 250, 64, 24, 24)
        for place, line in enumerate(reversed(best)):
            _row(ax, place, line, ANSWER if line is best[0] else FLOW)
        names = []
        for line in reversed(best):
            names.append(line.law if narrow else labels.value("force_law", line.law))
        ax.set_yticks(range(len(best)), names)
        ax.set_xscale("log")
        ax.set_xlim(theory.BINS[0].low, theory.BINS[-1].high)
        ax.xaxis.set_major_formatter("{x:g}")
        ax.set_ylim(-0.6, len(best) - 0.4)
        long = "Re* at which it is within what flumes measured, of all where they did"
        ax.set_title("Re* within measurements" if narrow else long)
        return canvas

    return Head(draw, title, caption)


def _row(ax: Axes, place: int, line: theory.Line, colour: str) -> None:
    """The ranges of a law, and its factor."""
    answered = line.holds(theory.GRID) & line.near(theory.GRID)
    for low, high in theory.ranges(answered):
        ax.hlines(place, low, high, color=NONE if colour == FLOW else ANSWER, lw=1.2)
    for low, high in theory.ranges(line.met):
        ax.hlines(place, low, high, color=colour, lw=9)
    ax.annotate(
        f"{line.median_factor:.2f} ×",
        (1.0, place),
        xycoords=ax.get_yaxis_transform(),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        color=colour,
        weight="bold" if colour == ANSWER else "normal",
    )
    ax.axhline(place, color=LINE, lw=0.6, zorder=0)
