"""How many times cheaper a route is than the naive one."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Patch

from orchestrator.report import style
from orchestrator.report.style import Look

MEASURED: Look = {"fc": "#0072b2", "ec": "#0072b2", "lw": 0.8}
EXTRAPOLATED: Look = {"fc": "white", "ec": "#0072b2", "lw": 0.8, "hatch": "////"}
UNITS = {"years": 3.156e7, "days": 86400.0, "h": 3600.0, "min": 60.0}


def draw(routes: pd.DataFrame) -> Canvas:
    """How many times cheaper each route is than the naive one.

    Parameters
    ----------
    routes : DataFrame
        route, core_s, extrapolated; the first row is the naive route. A NaN was not measured.
    """
    figure = style.canvas(0.34 * len(routes) + 0.75)
    ax = figure.subplots()
    factor = float(routes["core_s"].iloc[0]) / routes["core_s"].to_numpy(float)
    ax.set(xscale="log", xlabel="times cheaper than the naive route")
    rows: Any = routes.itertuples(index=False)
    for y, (row, gain) in enumerate(zip(rows, factor, strict=True)):
        _bar(ax, y, float(gain), float(row.core_s), bool(row.extrapolated))
    ax.set_yticks(range(len(routes)), routes["route"])
    ax.invert_yaxis()
    known = factor[np.isfinite(factor)]
    # the texts beyond the bars need a third of the width
    ax.set_xlim(known.min(initial=0.8), known.max(initial=10.0) ** 1.5)
    ax.spines[["top", "right"]].set_visible(False)
    if routes["extrapolated"].any():
        style.legends(figure, [], [Patch(label="extrapolated, not run", **EXTRAPOLATED)])
    return figure


def _bar(ax: Axes, y: int, gain: float, cost: float, extrapolated: bool) -> None:
    if not np.isfinite(gain):
        ax.text(1, y, " not measured", va="center", **style.NOTE)
        return
    look = EXTRAPOLATED if extrapolated else MEASURED
    ax.barh(y, gain - 1, left=1, height=0.62, gid="gain", **look)
    ax.axvline(1, color="0.3", lw=0.6)
    text = f" {_rounded(gain)} × ({duration(cost)})"
    ax.text(max(gain, 1), y, text, va="center", fontsize=7, gid="gain's text")


def duration(seconds: float) -> str:
    """A time of one core, in the unit that suits it."""
    for unit, size in UNITS.items():
        if seconds >= 1.5 * size:
            return f"{_rounded(seconds / size)} {unit}"
    return f"{_rounded(seconds)} s"


def _rounded(value: float) -> str:
    """A number to two digits, such as 0.35, 12 or 46 000."""
    return f"{float(f'{value:.2g}'):,.0f}".replace(",", " ") if value >= 10 else f"{value:.2g}"
