"""Hills over which others measured the flow: computed beside measured."""

from collections.abc import Iterator
from typing import get_args

import pandas as pd
from matplotlib.axes import Axes

from orchestrator.report import labels, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.results import Results, measured_hills
from orchestrator.report.solved import USTAR
from orchestrator.report.style import Figure
from orchestrator.study.method import Turbulence

MODEL_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
MODELS = dict(zip(get_args(Turbulence), MODEL_COLOURS, strict=True))
"""Colours of the turbulence models."""
CAPTION = """\
Hills of the wind-tunnel experiment RUSHIL, each with the flow of every turbulence
model. Curves: signed friction velocity along the bed over the undisturbed one. Under
them: where the flow runs back, as computed (bars) and as measured (black bar; the line
is its end). The experiment found no reversed flow behind the two gentler hills. The
stress on the bed was not measured. The table flow has the numbers and the source of the
measured ones."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw hills over which others measured the flow: computed beside measured.

    Yields
    ------
    Figure
        One figure with a panel for each hill, or none.
    """
    listed = list(measured_hills(results))
    if not listed:
        return
    flows = pd.concat([rows for _, rows in listed])
    titles = []
    for half_length, rows in listed:
        titles.append(
            f"half length {half_length:g} h, {rows['alpha_deg'].iloc[0]:.3g}°"
        )
    figure, axes = style.grid(titles, 2.1, "x/h from the crest", USTAR, 1)
    label = "measured end of the reversed flow"
    if not flows["measured_verified"].all():
        label += " (unverified)"
    for ax, (_, rows) in zip(axes, listed, strict=True):
        _draw_hill(ax, results, rows)
        end = rows["measured_reattachment_over_h"].iloc[0]
        if end > 0:
            ax.axvline(end, color="black", lw=1.2, gid="measured", label=label)
        ax.axhline(0, color="0.4", lw=0.6)
    axes[0].set_xlim(-9, 13)
    used = set(flows["turbulence_model"])
    colours = []
    for name, colour in MODELS.items():
        if name in used:
            colours.append(style.entry(labels.value("turbulence_model", name), colour))
    style.legends_below(figure, colours, style.samples(axes))
    cases = tuple(flows["flow_case"])
    title = "Hills that others measured"
    text = " ".join(CAPTION.split())
    yield Figure("hills", title, text, cases, figure, place="lead")


def _draw_hill(ax: Axes, results: Results, rows: pd.DataFrame) -> None:
    """The stress on one hill and the reversed flow behind it, by turbulence model."""
    table = results.tables["wall_stress"]
    for place, (_, row) in enumerate(rows.iterrows()):
        stress = table[table["flow_case"] == row["flow_case"]]
        line = results.flows[row["flow_case"]].model.line
        x = (stress["x_m"].to_numpy(float) - line.crest[0]) / line.h
        colour = MODELS[row["turbulence_model"]]
        ax.plot(x, stress["ustar_over_ustar0_wall"], lw=1.0, gid="stress", color=colour)
        ends = [row["separation_over_h"], row["reattachment_over_h"]]
        level = -0.7 - 0.15 * place
        ax.plot(ends, [level, level], lw=3, gid="reversed flow", color=colour)


FIGURE = FigureKind(order=30, draws=draw, needs=("flow",), uses=("wall_stress",))
