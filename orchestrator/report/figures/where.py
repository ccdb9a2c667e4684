"""Beds that are more than one triangle: where motion starts, the stress, the bed."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.digits import percent
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import within
from orchestrator.report import answers, counted, labels, single, style, units
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import Results
from orchestrator.report.solved import FELT, REVERSED, stress_on
from orchestrator.report.style import (
    ANSWER,
    EDGE,
    FLOW,
    INK,
    MEASURED,
    PALE,
    Figure,
    Look,
)
from orchestrator.report.subjects import ReportedQuantity
from orchestrator.study.profile import WITH_X

BEDS = 4
"""Most beds of a figure: more do not fit a page."""
HIGHEST = 2.6
"""Largest flow that the panel of a bed shows, over that of the first motion."""
COMPUTED: Look = {
    "label": "computed",
    "gid": "thresholds",
    "color": ANSWER,
    "lw": 1.5,
}
BESIDE: Look = {
    "gid": "measured",
    "color": INK,
    "lw": 1.0,
    "ls": MEASURED,
}
NEVER: Look = {"gid": "never", "color": "0.75", "lw": 0.3, "zorder": 0}
GAP = 5.0
"""Two places this many times the middle distance apart are of two stretches."""
CAPTION = """\
Each bed has three panels. Above: the {{ told }} at which {{ "the local stress reaches
the threshold of a grain on the local slope" if local else "each counted grain goes" }}.
Orange: computed, with the numerical error of the method as a band. Dashed: {{
beside }} of one grain. Motion starts where the curve is lowest. Grey: what
never goes. Middle: the stress on the bed over that on the flat ground upwind; the dots
are averaged as a grain feels it. Where the flow runs back, which is shaded, it pushes
grains upstream. Below: the bed line; thick: what has moved by the flow of the tables at
the part that is named."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw three panels along each bed: thresholds, stress, bed line.

    Yields
    ------
    Figure
        One figure of the first beds, or none.
    """
    rows = _rows(results)[:BEDS]
    if not rows:
        return
    piles = [results.plan.piles[str(row["scene_id"])] for row in rows]
    names = tuple(dict.fromkeys(run.name for pile in piles for run in pile.runs))
    is_local = any(pile.length == 0 for pile in piles)
    is_one = not answers.are_several_beds(results.at_fraction)
    leads = is_one or is_local or bool(piles[0].bed.profile)
    told = single.quantity_of_row(rows[0]).name
    beside = single.with_threshold(*rows)
    yield Figure(
        "where",
        "Where motion starts",
        filled(CAPTION, local=is_local, told=told, beside=beside),
        names,
        _beds(results, rows, piles),
        place="lead" if leads else "",
    )


def _rows(results: Results) -> list[pd.Series]:
    """A threshold of each bed that is neither the paper's triangle nor level."""
    thresholds = pd.concat([results.exemplars, results.at_fraction])
    thresholds = thresholds.drop_duplicates("scene_id")
    known = set(results.tables["pile_grain"]["scene_id"])
    lines: dict[Any, list[str]] = {}
    for scene_id, pile in results.plan.piles.items():
        line = pile.model.line
        is_level = np.ptp(line.z) == 0
        if scene_id in known and not pile.bed.is_triangle and not is_level:
            lines.setdefault(line, []).append(scene_id)
    rows = []
    for scenes in lines.values():
        # an exemplar stands for its bed
        found: pd.DataFrame = thresholds[thresholds["scene_id"].isin(scenes)]
        rows.append(found.iloc[0])
    return rows


def _beds(results: Results, rows: Sequence[pd.Series], piles: Sequence[Pile]) -> Canvas:
    """Three panels for each bed."""
    count = len(rows)
    figure = style.canvas(3.0 * count + 0.5)
    axes = figure.subplots(3 * count, 1, height_ratios=[1.6, 0.8, 0.7] * count)
    for panels, row, pile in zip(axes.reshape(-1, 3), rows, piles, strict=True):
        _bed(results, row, pile, tuple(panels))
    style.legends_below(figure, [], style.samples([*axes]))
    return figure


def _bed(
    results: Results, row: pd.Series, pile: Pile, panels: tuple[Axes, ...]
) -> None:
    """The panels of a bed."""
    top, middle, below = panels
    grains = results.tables["pile_grain"]
    grains = grains[grains["scene_id"] == row["scene_id"]].sort_values("x_m")
    told = single.quantity_of_row(row)
    _thresholds(top, row, grains, told)
    top.set_title(_title(results, pile), loc="left")
    _stress(middle, results, pile, grains)
    _line(below, row, pile, grains, told)
    ends = pile.bed.place([pile.model.line.x[1], pile.model.line.x[-2]])
    low, high = sorted(ends.tolist())
    for ax in panels:
        ax.set_xlim(low, high)
    for ax in (top, middle):
        ax.tick_params(labelbottom=False)
    if np.isfinite(row["first_x_m"]) and row["first_ustar0_m_s"] > 0:
        _first(panels, row, pile, told)


def _title(results: Results, pile: Pile) -> str:
    """A bed by its shape, height, obstacles, and the fields in which flows differ."""
    bed = pile.bed
    if bed.profile:
        shape = bed.profile.name
    else:
        shape = bed.form.label or bed.shape
        if bed.forms > 1:
            shape = f"{bed.forms} × {shape}"
    names = ["alpha_deg", "d_m", *results.flow_fields]
    first = results.beds("pile").iloc[0]
    values = pd.Series([first[name] for name in names], names, dtype=object)
    values["alpha_deg"] = bed.slope_deg
    values["d_m"] = pile.scene.grain.diameter
    obstacles = [str(obstacle) for obstacle in pile.scene.obstacles]
    title = [shape, f"h = {bed.height:.3g} m", *obstacles, labels.panel(values, names)]
    return ", ".join(title)


def _thresholds(
    ax: Axes, row: pd.Series, grains: pd.DataFrame, told: ReportedQuantity
) -> None:
    """The flow at which each place goes, with a band, and that to compare with."""
    goes = np.isfinite(grains["ustar0_m_s"]) & (grains["ustar0_m_s"] > 0)
    x = grains.loc[goes, "x_m"].to_numpy(float)
    ustar = grains.loc[goes, "ustar0_m_s"].to_numpy(float)
    computed = units.told_by(row, ustar, told)
    factor = units.compared_over_computed(row)
    compared = units.told_by(row, factor * ustar, told)
    cuts = _parted(x)
    _band(ax, row, x, ustar, told)
    ax.plot(*_broken(x, compared, cuts), label=single.with_threshold(row), **BESIDE)
    ax.plot(*_broken(x, computed, cuts), **COMPUTED)
    # one collection: by the method local these may be hundreds
    across = ax.get_xaxis_transform()
    ax.vlines(grains.loc[~goes, "x_m"], 0, 1, transform=across, **NEVER)
    if len(x):
        first = float(np.nanmin(computed))
        shown = computed[computed < HIGHEST * first]
        low = 0.85 * float(np.nanmin([*compared, first]))
        ax.set_ylim(low, 1.5 * float(np.nanmax(shown, initial=first)))
    ax.set_ylabel(f"{told.name}, {told.unit}")


def _band(ax: Axes, row: pd.Series, x: Any, ustar: Any, told: ReportedQuantity) -> None:
    """What is within the numerical error of the method at each place."""
    error = single.known_number(row["first_numerical_error"])
    if not (math.isfinite(error) and error < 1):
        return
    least, most = within(1.0, error)
    low = units.told_by(row, ustar * math.sqrt(least), told)
    high = units.told_by(row, ustar * math.sqrt(most), told)
    for part in np.split(np.arange(len(x)), _parted(x)):
        ax.fill_between(x[part], low[part], high[part], color=PALE, lw=0)


def _parted(x: Any) -> Any:
    """Where a line along places has to be interrupted: before a gap."""
    steps = np.diff(x)
    return np.flatnonzero(steps > GAP * np.median(steps)) + 1 if len(steps) else []


def _broken(x: Any, y: Any, cuts: Any) -> tuple[Any, Any]:
    """A line with gaps before some of its points."""
    return np.insert(x, cuts, np.nan), np.insert(y, cuts, np.nan)


def _stress(ax: Axes, results: Results, pile: Pile, grains: pd.DataFrame) -> None:
    """The stress over the undisturbed one: of the flow, and as grains feel it."""
    if pile.solves:
        wall = stress_on(pile, results)
        x = wall["x_m"].to_numpy(float)
        stress = _signed_square(wall["ustar_over_ustar0_wall"])
        ax.plot(x, stress, color=FLOW, lw=1.2, label="stress on the bed", gid="wall")
        ax.fill_between(x, stress, 0, where=(stress < 0).tolist(), **REVERSED)
    felt = _signed_square(grains["ustar_over_ustar0"])
    ax.plot(grains["x_m"], felt, **{**FELT, "ms": 4})
    ax.axhline(0, color="0.4", lw=0.6)
    ax.set_ylabel("stress ratio")


def _signed_square(ustar: pd.Series) -> Any:
    """Stresses of friction velocities that are negative where the flow runs back."""
    values = ustar.to_numpy(float)
    return np.sign(values) * values**2


def _line(
    ax: Axes, row: pd.Series, pile: Pile, grains: pd.DataFrame, told: ReportedQuantity
) -> None:
    """The bed line, with the part that has moved at the fraction of the row."""
    bed = pile.bed
    x = bed.place(pile.model.line.x)
    z = bed.level(pile.model.line.z)
    low = z.min() - 0.1 * np.ptp(z)
    ax.fill_between(x, z, low, color=style.BED, lw=0)
    ax.plot(x, z, color=EDGE, lw=0.8, gid="bed")
    places = grains["x_m"].to_numpy(float)
    has_moved = grains["ustar0_m_s"].to_numpy(float) <= float(row["ustar0_m_s"])
    height = bed.level(pile.model.line.height(bed.along(places)))
    moved = np.where(has_moved, height, np.nan)
    ax.plot(places, moved, color=ANSWER, lw=3, gid="moved")
    where = "x, m, from the toe of the first form"
    if bed.profile:
        where = f"x of {bed.profile.name}, m"
    part = percent(row["fraction"])
    if np.isfinite(row["ustar0_m_s"]):
        flow = float(row[told.column()])
        where += f"; thick: the {part} that moves by {flow:.3g} {told.unit}"
    ax.set(xlabel=where, ylabel="z, m", ylim=(low, None))
    arrow: Look = {"xycoords": "axes fraction", "color": FLOW, "weight": "bold"}
    if pile.scene.flow.towards == WITH_X:
        ax.annotate("→ flow", (0.01, 0.75), **arrow)
    else:
        ax.annotate("flow ←", (0.99, 0.75), ha="right", **arrow)


def _first(
    axes: Sequence[Axes], row: pd.Series, pile: Pile, told: ReportedQuantity
) -> None:
    """Mark the place where motion starts, with its flow."""
    x = float(row["first_x_m"])
    value = float(row[f"first_{told.column()}"])
    for ax in axes:
        ax.axvline(x, color=ANSWER, lw=0.8, ls=":", zorder=0.5)
    top = axes[0]
    top.plot([x], [value], "o", color=ANSWER, ms=5, mec="white", gid="start")
    is_left = x < np.mean(top.get_xlim())
    look: Look = {"textcoords": "offset points", "va": "top", "color": ANSWER}
    look |= {"ha": "left" if is_left else "right", "weight": "bold", "gid": "first"}
    # it may lie on the curves of other forms
    look["bbox"] = {"fc": "white", "ec": "none", "pad": 1.0, "alpha": 0.8}
    text = (
        f"motion starts at x = {counted.place(x, pile.bed)} m, {value:.3g} {told.unit}"
    )
    place = (x, 1.0)
    apart = (5 if is_left else -5, -3)
    top.annotate(text, place, xycoords=top.get_xaxis_transform(), xytext=apart, **look)


FIGURE = FigureKind(
    order=40,
    draws=draw,
    needs=("pile_grain", "pile_threshold"),
    uses=("wall_stress",),
)
