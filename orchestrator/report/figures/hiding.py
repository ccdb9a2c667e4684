"""Hiding and exposure: thresholds of size classes over that of the median size."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from orchestrator.physics import measured
from orchestrator.report import shields, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.results import Results, case_names, split_by
from orchestrator.report.style import Figure, Look
from orchestrator.types import FloatArray

HIDING_AXES = ("dᵢ/d₅₀", "$θ_c$ of the size over that of d₅₀")


def _wilcock_crowe(size: FloatArray) -> Any:
    """Shields number of a size over that of d50, by Wilcock and Crowe."""
    return measured.wilcock_crowe_hiding(size) / size


def _one_stress(size: FloatArray) -> Any:
    """Shields number of a size over that of d50 if equal mobility."""
    return 1 / size


HIDING: tuple[tuple[str, Callable[[Any], Any], str], ...] = (
    ("Wilcock and Crowe", _wilcock_crowe, "-"),
    ("Egiazaroff", measured.egiazaroff_hiding, "--"),
    ("equal mobility", _one_stress, ":"),
)
"""Published functions of the size: label, function and dash of a line."""
LEAD = (
    "Critical Shields number of each size class in its own diameter, over that at d₅₀."
)
"""What stands under the drawing."""
CAPTION = (
    "The Shields number of a size class, in its own diameter, at which a fraction of "
    "its exposed grains has moved, over that at d₅₀, which lies between two classes. "
    "Markers: geometric mean over the beds of the study. Bars: the range of these "
    "beds, and the part that the number of grains in the class leaves to chance (80 "
    "%); an arrow where too few grains give no upper bound. Open: fewer "
    "than ten grains. Lines: published hiding functions, which are for flow over beds "
    "in space and for transport rates, not for first motion."
)


def draw(results: Results) -> Iterator[Figure]:
    """Draw thresholds of size classes over that of the median size, by method.

    Yields
    ------
    Figure
        One figure, of a study with mixtures.
    """
    rows = results.joined("size_class")
    is_known = rows["hiding"].notna() & (rows["size_over_d"] != 1)
    if not is_known.any():
        return
    keys = ["method"]
    (sheet,) = shields.sheets(rows, keys, 2.7, *HIDING_AXES)
    colours = style.palette("fraction", sorted(set(rows["fraction"])))
    known = rows[["hiding", "hiding_low", "hiding_high"]].to_numpy(float)
    known = known[np.isfinite(known) & (known > 0)]
    _, axes = sheet.panels()
    for ax, part in zip(axes, sheet.parts, strict=True):
        part = part[part["hiding"] > 0]
        for (fraction,), of_fraction in split_by(part, "fraction"):
            _draw_classes(ax, of_fraction, colours[float(str(fraction))])
        sizes = part["size_over_d"]
        ratio = np.geomspace(min(sizes.min(), 0.5), max(sizes.max(), 2), 99)
        for label, formula, dash in HIDING:
            ax.plot(ratio, formula(ratio), color="0.3", ls=dash, lw=1, label=label)
        ax.set(xscale="log", yscale="log", ylim=(known.min() / 1.5, 1.5 * known.max()))
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
    yield Figure(
        name="hiding",
        title="Hiding and exposure of sizes",
        caption=CAPTION,
        cases=case_names(rows),
        drawing=shields.legends(sheet, "fraction", colours),
        lead=LEAD,
    )


def _draw_classes(ax: Axes, rows: pd.DataFrame, colour: str) -> None:
    """Draw the means of size classes with intervals, open where grains are few."""
    number = np.rint(np.log(rows["size_over_d"]) / np.log(np.sqrt(2)))
    logs = rows[["size_over_d", "hiding"]].map(np.log)
    mean = np.exp(logs.groupby(number).mean())
    classes = rows.groupby(number)
    # a lower end that is not known is beyond the frame; an upper one has an arrow
    low = classes["hiding_low"].min(skipna=False).fillna(0.0)
    high = classes["hiding_high"].max(skipna=False)
    is_open = high.isna()
    high = high.where(~is_open, mean["hiding"])
    arrow: Look = {"ls": "", "marker": style.UP, "ms": style.ARROW, "mfc": "none"}
    above = mean[is_open]
    ax.plot(above["size_over_d"], above["hiding"], color=colour, alpha=0.5, **arrow)
    ax.errorbar(
        mean["size_over_d"],
        mean["hiding"],
        # of one class the mean is an end but for its last digit
        yerr=[
            (mean["hiding"] - low).clip(lower=0.0),
            (high - mean["hiding"]).clip(lower=0.0),
        ],
        marker="o",
        ms=4,
        lw=0.8,
        capsize=2,
        color=colour,
    )
    few = mean[classes["few"].any()]
    ax.plot(few["size_over_d"], few["hiding"], "o", ms=3, color="white", zorder=3)


FIGURE = FigureKind(order=140, draws=draw, needs=("size_class",))
