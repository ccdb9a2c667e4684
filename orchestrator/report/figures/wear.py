"""Beds that change beside frozen ones."""

from collections.abc import Iterator

import pandas as pd
from matplotlib.axes import Axes

from orchestrator.report import labels, shields, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.results import Results, split_by
from orchestrator.report.style import Figure, Look

FROZEN: Look = {"ls": "--", "lw": 0.9, "label": "flow over the initial pile"}
WORN: Look = {"lw": 1.3, "label": "flow over the updated bed"}
APART: Look = {"ls": "", "marker": "o", "ms": 4, "label": "first 5 % apart"}
CAPTION = (
    "The threshold at which n grains are entrained, as the mean stress on them. "
    "Dashed: the flow over the initial pile acts until the last grain is entrained, as "
    "in the paper. Solid: after each further part of the grains the bed line is drawn "
    "anew through those that remain, and the flow is solved over it. "
    "Dot: the place from which the two differ by more than 5 %. "
    "By DEM one load step changes θ by twice the load increment."
)


def draw(results: Results) -> Iterator[Figure]:
    """Draw beds that change beside the frozen ones.

    Yields
    ------
    Figure
        Figures with panels by slope, packing and method.
    """
    rows = results.joined("bed_change")
    colours = style.palette("d_m", sorted(set(rows["d_m"])))
    keys = ["alpha_deg", "packing", "method"]
    for sheet in shields.sheets(rows, keys, 2.1, "n/N", labels.TAU_AXIS):
        _, axes = sheet.panels()
        for ax, part in zip(axes, sheet.parts, strict=True):
            for (d, _), of_pile in split_by(part, "d_m", "scene_id"):
                _draw_wear(ax, of_pile, colours[float(str(d))])
        # the panels share both axes
        axes[0].set(xlim=(0, None), ylim=(0, None))
        cases = []
        for scene_id in sheet.rows["scene_id"].unique():
            cases.append(results.plan.piles[scene_id].runs[-1].name)
        yield Figure(
            name=f"wear{sheet.name}",
            title=f"Fixed bed and updated bed{sheet.title}",
            caption=CAPTION,
            cases=tuple(cases),
            drawing=shields.legends(sheet, "d_m", colours),
        )


def _draw_wear(ax: Axes, rows: pd.DataFrame, colour: str) -> None:
    """Draw the curves of one pile as it was, and as it is when grains have gone."""
    fraction = rows["fraction_moved"]
    ax.plot(fraction, rows["shields_frozen"], color=colour, **FROZEN)
    ax.plot(fraction, rows["shields"], color=colour, **WORN)
    end = rows[fraction == rows["holds_until"]]
    ax.plot(end["fraction_moved"], end["shields"], color=colour, **APART)


FIGURE = FigureKind(order=120, draws=draw, needs=("bed_change",))
