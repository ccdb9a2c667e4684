"""Many force laws: where each is within what was measured in water."""

from collections.abc import Iterator

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.report import labels, style, theory
from orchestrator.report.figures import FigureKind
from orchestrator.report.results import Results
from orchestrator.report.style import ANSWER, FLOW, NONE, RANGE, Figure

CAPTION = (
    "Thick: Re* at which the law is between the tenth and the ninetieth percentile of "
    "the flumes; thin: where it answers. Orange: the nearest law. At the right: its "
    "median misfit, as a factor of the measured medians."
)


def draw(results: Results) -> Iterator[Figure]:
    """Draw the ranges of Re* in which laws are within what was measured in water.

    Yields
    ------
    Figure
        One figure, of more laws than dashes tell apart.
    """
    best = theory.best(theory.ranked(results))
    if len(best) > theory.MANY:
        title = "Where each force law is within what flumes measured"
        yield Figure("laws", title, CAPTION, (), _laws(best), place="lead")


def _laws(best: list[theory.Line]) -> Canvas:
    """A row for each law, the nearest one above."""
    canvas = style.canvas(0.8 + 0.28 * len(best), style.NARROW)
    ax = canvas.subplots()
    rising = best[::-1]
    for place, line in enumerate(rising):
        _row(ax, place, line, ANSWER if line is best[0] else FLOW)
    names = [labels.value("force_law", line.law) for line in rising]
    ax.set_yticks(range(len(best)), names)
    ax.set(xscale="log", xlim=(theory.BINS[0].low, theory.BINS[-1].high))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set(ylim=(-0.6, len(best) - 0.4), xlabel="Re*")
    return canvas


def _row(ax: Axes, place: int, line: theory.Line, colour: str) -> None:
    """The ranges of a law, and its factor."""
    answered = line.holds(theory.GRID) & line.near(theory.GRID)
    for low, high in theory.ranges(answered):
        ax.hlines(place, low, high, color=NONE if colour == FLOW else ANSWER, lw=1.0)
    for low, high in theory.ranges(line.met):
        ax.hlines(place, low, high, color=colour, lw=6)
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
    ax.axhline(place, color=RANGE, lw=0.6, zorder=0)


FIGURE = FigureKind(order=10, draws=draw, uses=("single_grain",))
