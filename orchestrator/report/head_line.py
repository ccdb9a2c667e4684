"""The picture of one bed along its line: thresholds, stress, and the line itself."""

import math
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.digits import percent
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import within
from orchestrator.report import single
from orchestrator.report.drawing import (
    ANSWER,
    EDGE,
    FLOW,
    GROUND,
    INK,
    LINE,
    PALE,
    SAND,
    SOFT,
    Head,
    figure,
    in_units,
    margins,
    ratio,
)
from orchestrator.report.flows import stress_on
from orchestrator.report.results import Results
from orchestrator.report.style import Look
from orchestrator.report.subjects import Quantity, place_of_file
from orchestrator.study.profile import WITH_X

HIGHEST = 2.6
"""Largest flow that the panel of a bed shows, over that of the first motion."""


def along(row: pd.Series, pile: Pile, results: Results) -> Head:
    """Draw three panels over the bed line: thresholds, stress, the line.

    Parameters
    ----------
    row
        The threshold of the card, with the columns of its scene.
    pile
        The bed.
    results
        The study with its tables.

    Returns
    -------
    Head
        The picture.
    """
    told = single.quantity(row)
    x = float(row["first_x_m"])
    value = single.in_unit(row, single.known(row["first_ustar0_m_s"]), told)
    place = _place(x, pile)
    title = (
        f"Three panels along the bed: the {told.name} that moves each place, lowest "
        f"at {place}; the stress of the flow on the bed; the bed line"
    )
    caption = (
        f"Motion starts where the curve of the {told.name} is lowest: at {place}, "
        f"{value:.3g} {told.unit}. Orange: computed, with the known error of the "
        "method as a band; dashed: with the measured threshold. Shaded: the flow runs "
        "back."
    )

    def draw(narrow: bool) -> Canvas:
        canvas = figure(narrow, 400 if narrow else 372)
        heights = [150, 80, 70] if narrow else [160, 66, 70]
        axes = canvas.subplots(3, 1, sharex=True, height_ratios=heights)
        margins(canvas, 38, 8, 22, 24)
        canvas.subplots_adjust(hspace=0.42)
        _thresholds_along(axes[0], row, pile, results, told, narrow)
        _stress_along(axes[1], row, pile, results, narrow)
        _line(axes[2], row, pile, results, told, narrow)
        line = pile.model.line
        axes[0].set_xlim(*sorted(pile.bed.place([line.x[1], line.x[-2]]).tolist()))
        for ax in axes:
            ax.axvline(x, color=ANSWER, lw=0.9, ls=(0, (2, 2)), zorder=1)
        return canvas

    return Head(draw, title, caption)


def _place(x: float, pile: Pile) -> str:
    """A place with its unit, of a profile with the digits that matter."""
    profile = pile.bed.profile
    if profile:
        return f"x = {place_of_file(x, profile)} m"
    return f"{x:.4g} m"


def grains_of(row: pd.Series, results: Results) -> pd.DataFrame:
    """The counted places or grains of a bed, by their place.

    Parameters
    ----------
    row
        The threshold of a bed with the columns of its scene.
    results
        The study with its tables.

    Returns
    -------
    DataFrame
        A row for each place or grain.
    """
    grains = results.tables["pile_grain"]
    here: pd.DataFrame = grains[grains["scene_id"] == row["scene_id"]]
    return here.sort_values("x_m")


def _parted(x: Any) -> Any:
    """Where a line along places has to be interrupted: before a gap."""
    steps = np.diff(x)
    return np.flatnonzero(steps > 5 * np.median(steps)) + 1 if len(steps) else []


def _thresholds_along(
    ax: Axes, row: pd.Series, pile: Pile, results: Results, told: Quantity, narrow: bool
) -> None:
    """The flow at which each place goes, with a band, and by the measured threshold."""
    grains = grains_of(row, results)
    grains = grains[np.isfinite(grains["ustar0_m_s"]) & (grains["ustar0_m_s"] > 0)]
    x = grains["x_m"].to_numpy(float)
    ustar = grains["ustar0_m_s"].to_numpy(float)
    computed = in_units(row, ustar, told)
    measured = in_units(row, ratio(row) * ustar, told)
    first = float(np.nanmin(computed))
    cuts = _parted(x)
    _band(ax, row, x, ustar, told)
    ax.plot(*_broken(x, measured, cuts), color=INK, lw=1.2, ls=(0, (4, 2)))
    ax.plot(*_broken(x, computed, cuts), color=ANSWER, lw=2)
    ax.plot([row["first_x_m"]], [first], "o", color=ANSWER, ms=7, mec=GROUND)
    shown = computed[computed < HIGHEST * first]
    least = float(np.nanmin(np.append(measured, first)))
    ax.set_ylim(0.85 * least, 1.5 * float(np.nanmax(shown, initial=first)))
    where = "" if narrow else " here"
    ax.set_title(f"{told.name.capitalize()} that moves the bed{where}, {told.unit}")
    _names_above(ax, narrow)
    x_first = float(row["first_x_m"])
    is_left = x_first < (x[0] + x[-1]) / 2
    text = f"{_place(x_first, pile)}, {first:.3g} {told.unit}"
    ax.annotate(
        text if narrow else f"motion starts here: {text}",
        (x_first, 1.0),
        xycoords=ax.get_xaxis_transform(),
        xytext=(6 if is_left else -6, -3),
        textcoords="offset points",
        ha="left" if is_left else "right",
        va="top",
        color=ANSWER,
        weight="bold",
    )


def _band(ax: Axes, row: pd.Series, x: Any, ustar: Any, told: Quantity) -> None:
    """What is within the known error of the method at each place."""
    error = single.known(row["first_known_error"])
    if not (math.isfinite(error) and error < 1):
        return
    least, most = within(1.0, error)
    low = in_units(row, ustar * math.sqrt(least), told)
    high = in_units(row, ustar * math.sqrt(most), told)
    for part in np.split(np.arange(len(x)), _parted(x)):
        ax.fill_between(x[part], low[part], high[part], color=PALE, lw=0)


def _names_above(ax: Axes, narrow: bool) -> None:
    """The names of the two curves above their panel; a narrow one has a caption."""
    if narrow:
        return
    look: Look = {"transform": ax.transAxes, "ha": "right", "va": "bottom"}
    ax.text(1.0, 1.03, "- - -  with the measured threshold", color=INK, **look)
    ax.text(0.77, 1.03, "——  computed", color=ANSWER, weight="bold", **look)


def _broken(x: Any, y: Any, cuts: Any) -> tuple[Any, Any]:
    """A line with gaps before some of its points."""
    return np.insert(x, cuts, np.nan), np.insert(y, cuts, np.nan)


def _stress_along(
    ax: Axes, row: pd.Series, pile: Pile, results: Results, narrow: bool
) -> None:
    """The stress on the bed over that of the undisturbed flow."""
    table = pd.DataFrame()
    if pd.notna(row["flow_case"]):
        table = stress_on(pile, results)
    if len(table):
        x = table["x_m"].to_numpy(float)
        ustar = table["ustar_over_ustar0_wall"].to_numpy(float)
    else:
        grains = grains_of(row, results)
        x = grains["x_m"].to_numpy(float)
        ustar = grains["ustar_over_ustar0"].to_numpy(float)
    stress = np.sign(ustar) * ustar**2
    ax.fill_between(x, stress, 0, where=(stress < 0).tolist(), color=LINE, lw=0)
    ax.plot(x, stress, color=FLOW, lw=1.5)
    ax.axhline(0, color=SOFT, lw=0.8)
    what = "Stress on the bed ÷ that upwind"
    long = "Stress of the flow on the bed, over that on the flat ground upwind"
    ax.set_title(what if narrow else long, color=FLOW)


def _line(
    ax: Axes, row: pd.Series, pile: Pile, results: Results, told: Quantity, narrow: bool
) -> None:
    """The bed line, with the part that has moved at the fraction of the card."""
    bed = pile.bed
    x = bed.place(pile.model.line.x)
    z = bed.level(pile.model.line.z)
    low = float(z.min())
    ax.fill_between(x, z, low - 0.08 * np.ptp(z), color=SAND, lw=0)
    ax.plot(x, z, color=EDGE, lw=1)
    grains = grains_of(row, results)
    places = grains["x_m"].to_numpy(float)
    has_moved = grains["ustar0_m_s"].to_numpy(float) <= float(row["ustar0_m_s"])
    height = bed.level(pile.model.line.height(bed.along(places)))
    ax.plot(*_moved(places, height, has_moved), color=ANSWER, lw=3.5)
    part = percent(row["fraction"])
    flow = single.in_unit(row, float(row["ustar0_m_s"]), told)
    told_at = f"orange: the {part} that moves by {flow:.3g} {told.unit}"
    ax.set_title("Bed line, m" if narrow else f"Bed line, m; {told_at}")
    ax.set_ylim(low - 0.08 * np.ptp(z), None)
    along = "x, m" if bed.profile else "m along the bed"
    ax.set_xlabel(along if narrow else "")
    _arrow(ax, pile)


def _arrow(ax: Axes, pile: Pile) -> None:
    """Where the flow goes, at the end of the bed that it comes from."""
    look: Look = {"xycoords": "axes fraction", "color": FLOW, "weight": "bold"}
    if pile.scene.flow.towards == WITH_X:
        ax.annotate("→ flow", (0.01, 0.7), **look)
    else:
        ax.annotate("flow ←", (0.99, 0.7), ha="right", **look)


def _moved(x: Any, y: Any, has_moved: Any) -> tuple[Any, Any]:
    """A line along the places that have moved, with gaps where others lie between."""
    return x, np.where(has_moved, y, np.nan)
