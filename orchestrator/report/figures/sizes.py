"""The sizes of a mixture: the stress that moves each, beside the measured hiding."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator.digits import percent
from orchestrator.physics.grain import Grain
from orchestrator.report import answers, sheets, style, theory
from orchestrator.report.figures import FigureKind
from orchestrator.report.results import Results, case_names
from orchestrator.report.style import ANSWER, INK, PALE, Figure, Look

DISC: Look = {"ls": "", "marker": "o", "color": ANSWER, "ms": 6, "label": "computed"}
RING: Look = {**DISC, "mfc": "white", "mew": 1.4, "label": "fewer than ten grains"}
SQUARE: Look = {"ls": "", "marker": "s", "color": INK, "ms": 5}
SQUARE["label"] = "fitted to measurements"
OPEN: Look = {"ls": "", "marker": style.RIGHT, "ms": style.ARROW, "mfc": "none"}
OPEN |= {"color": ANSWER, "zorder": 1.5}
TOGETHER: Look = {"color": ANSWER, "lw": 1, "ls": ":", "zorder": 0.5}
TOGETHER["label"] = "all sizes together"
CAPTION = (
    "Orange: computed, with the sampling interval of so few grains; rings: fewer than "
    "ten grains. Squares: the function that Wilcock and Crowe (2003) fitted to "
    "transport, at the measured stress of d50. Dotted: all sizes together. An "
    "arrow is an interval without an upper end."
)


def draw(results: Results) -> Iterator[Figure]:
    """Draw the stress that moves each size of the mixture of the card.

    Yields
    ------
    Figure
        One figure, or none.
    """
    rows = results.exemplars
    if rows.empty or theory.are_many(results) or sheets.sizes_sheet(results) is None:
        return
    row = rows.iloc[0]
    classes = results.joined("size_class")
    here = classes[classes["fraction"] == row["fraction"]]
    here = here[here["scene_id"] == row["scene_id"]].sort_values("size_over_d")
    title = f"The stress that moves {percent(row['fraction'])} of each size"
    drawing = _sizes(row, here)
    names = case_names(rows[:1])
    yield Figure("sizes", title, CAPTION, names, drawing, place="under")


def _sizes(row: pd.Series, here: pd.DataFrame) -> Canvas:
    """A line for each size: its interval, its stress, and the measured one."""
    weight = Grain.of_table(row).layer_weight * here["size_over_d"].to_numpy(float)
    value = weight * here["shields_own"].to_numpy(float)
    low = weight * here["shields_own_low"].to_numpy(float)
    high = weight * here["shields_own_high"].to_numpy(float)
    compared = [answers.hidden_stress(row, size) for size in here["size_over_d"]]
    at = float(row["rho_f_kg_m3"]) * float(row["ustar0_m_s"]) ** 2
    top = 1.15 * np.nanmax([*value[np.isfinite(value)], *compared, at])
    places = np.arange(len(here))[::-1]
    canvas = style.canvas(1.3 + 0.26 * len(here), style.NARROW)
    ax = canvas.subplots()
    is_open = np.isnan(high)
    right = np.where(is_open, value, high)
    ax.hlines(places, np.nan_to_num(low), right, color=PALE, lw=8, zorder=1)
    ax.plot(value[is_open], places[is_open], **OPEN)
    few = here["few"].to_numpy(bool)
    ax.plot(value[~few], places[~few], **DISC)
    if np.isfinite(value[few]).any():
        ax.plot(value[few], places[few], **RING)
    ax.plot(compared, places, **SQUARE)
    ax.axvline(at, **TOGETHER)
    ax.set_yticks(places, _names(float(row["d_m"]), here))
    ax.set(xlim=(0, top), ylim=(-0.6, len(here) - 0.4), xlabel="stress on the bed, Pa")
    handles = style.samples([ax])
    canvas.legend(handles=handles, loc="outside lower center", ncols=2)
    return canvas


def _names(d: float, here: pd.DataFrame) -> list[str]:
    """Each size with the number of its grains."""
    names = []
    for size, count in zip(here["size_over_d"], here["count"], strict=True):
        grains = f"{count:.0f} grains" if count != 1 else "1 grain"
        names.append(f"{1e3 * d * size:.3g} mm, {grains}")
    return names


FIGURE = FigureKind(order=80, draws=draw, needs=("size_class", "pile_threshold"))
