"""Single grains by DEM over the closed form."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator.digits import percent
from orchestrator.report import labels, shields, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import Results, case_names, split_by, valid
from orchestrator.report.shields import SHOWN, DiagramSheet, Points
from orchestrator.report.style import Figure

LEAD = (
    "Critical friction velocity by DEM over that of the closed form with the same "
    "forces; at 1 both agree."
)
"""What stands under the drawing."""
CAPTION = """\
{% from "captions.j2" import laws, protocol, is_open %} Friction velocity at the
threshold by DEM over that of the closed form with the same forces: {{ laws(about) }}. A
bar runs from the load step without motion to the one with motion: it holds 1 where the
two methods agree. Panels may differ in scale. Largest deviation: {{ deviations }}. {{
protocol(about) }} {{ is_open(about) }}"""
OVER = ("reynolds", "value", "low", "high")
"""Columns of x, y and the ends of its interval."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw u* of DEM over that of the closed form, for each increment of load steps.

    Yields
    ------
    Figure
        A figure for each page of panels.
    """
    dem = shields.diagram_rows(results)
    dem = dem[dem["ustar_m_s"].notna()]
    if dem.empty:
        return
    exact = dem["ustar_closed_form_m_s"]
    over = {
        "value": dem["ustar_m_s"] / exact,
        "low": dem["ustar_low_m_s"] / exact,
        "high": dem["ustar_high_m_s"] / exact,
    }
    choices, rows = shields.parted(
        dem.assign(**over), *SHOWN, "beta_deg", "load_increment"
    )
    colours = style.palette("alpha_deg", results.values("alpha_deg"))
    keys = ["load_increment", *choices]
    axes = labels.RE_AXIS, "u* of DEM over closed form"
    for sheet in shields.sheets(rows, keys, 2.1, *axes, columns=1, sharey=False):
        about = shields.about(sheet.rows)
        text = filled(CAPTION, about=about, deviations=_deviations(sheet.rows))
        yield Figure(
            f"accuracy{sheet.name}",
            f"DEM over closed form{sheet.title}",
            text,
            case_names(sheet.rows),
            partial(_draw_accuracy, sheet, rows, colours),
            place="folded",
            lead=LEAD,
        )


def _deviations(rows: pd.DataFrame) -> str:
    """How far DEM is off at most, where the force law holds and where it does not."""
    far = (rows["value"] - 1).abs()
    holds = valid(rows)
    found = []
    if holds.any():
        found.append(f"{percent(far[holds].max(), 2)} where its law holds")
    if not holds.all():
        found.append(f"{percent(far[~holds].max(), 2)} where it does not")
    return ", ".join(found)


def _draw_accuracy(
    sheet: DiagramSheet, rows: pd.DataFrame, colours: Mapping[Any, str]
) -> Canvas:
    """The panels of u* of DEM over that of the closed form."""
    _, axes = sheet.panels()
    for ax, part in zip(axes, sheet.parts, strict=True):
        ax.axhline(1, color="0.3", lw=0.8, zorder=1)
        for (alpha,), group in split_by(part, "alpha_deg"):
            Points(group, colours[alpha], OVER).draw(ax)
        farthest = float(np.nanmax(np.abs(part[["value", "low", "high"]] - 1)))
        ax.set(xscale="log", ylim=(1 - 1.6 * farthest, 1 + 1.6 * farthest))
    for ax in axes:
        style.plain_ticks(ax.xaxis)
        shields.shade_transition(ax, rows)
    return shields.legends(sheet, "alpha_deg", colours)


FIGURE = FigureKind(order=150, draws=draw, needs=("single_grain",))
