"""The tornado chart: what each shared choice does to a threshold, the largest first."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Patch

from orchestrator.fidelity.spread import together
from orchestrator.report import style

TOGETHER = "all together"
COLOURS = {"shields": "#0072b2", "ustar0": "#d55e00"}
LABELS = {"shields": "Shields number $θ$", "ustar0": "undisturbed friction velocity $u^*_0$"}
BAR = 0.38
"""Height of a bar; a choice has two, 1 apart from the next."""


def draw(shared: pd.DataFrame) -> Canvas:
    """The chart of one scene.

    Parameters
    ----------
    shared : DataFrame
        Rows of `shares` of one scene: the largest share over the fractions is drawn.
    """
    ends = [column for column in shared if str(column).endswith(("_low", "_high"))]
    largest = shared.groupby("choice", sort=False)[ends].max()
    largest = largest.loc[largest.max(axis=1).sort_values().index]
    total = pd.DataFrame({name: [together(largest[name])] for name in ends}, index=[TOGETHER])
    figure = style.canvas(0.28 * (len(largest) + 1) + 1.0)
    ax = figure.subplots()
    rows = pd.concat([largest, total])
    for offset, name in ((BAR / 2, "shields"), (-BAR / 2, "ustar0")):
        _bars(ax, 100 * rows, name, offset)
    ax.axvline(0.0, color="0.2", lw=0.8)
    ax.axhline(len(largest) - 0.5, color="0.7", lw=0.6)
    ax.set_yticks(range(len(rows)), list(rows.index))
    ax.set_xlabel("change of the threshold, %")
    ax.grid(axis="x", lw=0.4, color="0.85")
    samples = [Patch(color=COLOURS[name], label=LABELS[name]) for name in COLOURS]
    style.legends(figure, samples, [])
    return figure


def _bars(ax: Axes, rows: pd.DataFrame, name: str, offset: float) -> None:
    low, high = rows[f"{name}_low"], rows[f"{name}_high"]
    places = [number + offset for number in range(len(rows))]
    ax.barh(places, low + high, BAR, left=-low, color=COLOURS[name], lw=0)
