"""Beds that are more than one triangle: where motion starts, the stress, the bed."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.bed.line import BedLine, of_bed
from orchestrator.digits import percent
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import within
from orchestrator.report import counted, labels, single, style, units
from orchestrator.report.figures import FigureKind
from orchestrator.report.figures.fractions import curves_of_card
from orchestrator.report.page import filled
from orchestrator.report.results import Results
from orchestrator.report.solved import FELT, REVERSED, LengthUnit, stress_on
from orchestrator.report.style import (
    ANSWER,
    EDGE,
    FLOW,
    OTHERS,
    PALE,
    Figure,
    Look,
)
from orchestrator.report.subjects import ReportedQuantity, length
from orchestrator.study.profile import WITH_X

Bed = tuple[pd.Series, Pile]
"""A threshold of a bed, and its pile."""
BEDS = 4
"""Most beds of a figure: more do not fit a page."""
BESIDE = 3
"""Most of them that share a line, such as a dune with several fences."""
HIGHEST = 2.6
"""Largest flow that the panel of a bed shows, over that of the first motion."""
NEVER: Look = {"gid": "never", "color": "0.75", "lw": 0.3, "zorder": 0}
GAP = 5.0
"""Two places this many times the middle distance apart are of two stretches."""
LONG = 0.5
"""Least length of a stretch of reversed flow whose ends are marked, heights."""
WIDTHS = (style.WIDE, style.NARROW)
"""Widths of the drawings for a wide and for a narrow page, inches."""
CAPTION = """\
Motion starts where the threshold is lowest.
Above: the {{ told }} at which {{ "the local stress reaches the threshold of a grain on
the local slope" if local else "each counted grain is entrained" }}{{ beside }}. Pale:
numerical error of the method. Grey: never entrained. Middle: signed u* on the bed over
u*₀ of the flat ground upwind; dots: averaged as a grain feels it; S: separation, R:
reattachment. Below: the bed; thick: what is entrained at the flow that is named."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw three panels along each bed: thresholds, stress, bed line.

    Yields
    ------
    Figure
        One figure of the first beds, or none.
    """
    groups = _groups(results)
    if not groups:
        return
    beds = [
        [(row, results.plan.piles[str(row["scene_id"])]) for row in rows]
        for rows in groups
    ]
    piles = [pile for bed in beds for _, pile in bed]
    rows = [row for bed in beds for row, _ in bed]
    names = tuple(dict.fromkeys(run.name for pile in piles for run in pile.runs))
    told = single.quantity_of_row(rows[0]).name
    factors = [curves_of_card(row) for row in rows]
    beside = ""
    if any(len(curves) > 1 for curves in factors):
        beside = f"; thin: {factors[0][-1][1]['label']}"
    is_local = any(pile.length == 0 for pile in piles)
    wide, narrow = (partial(_beds, results, beds, width) for width in WIDTHS)
    yield Figure(
        "where",
        "Where motion starts",
        filled(CAPTION, local=is_local, told=told, beside=beside),
        names,
        wide,
        place="lead",
        narrow=narrow,
    )


def _groups(results: Results) -> list[list[pd.Series]]:
    """A threshold of each bed that is neither the paper's triangle nor level.

    Beds on one line, which differ in their obstacles, stand together, the one that most
    stands on first.
    """
    thresholds = pd.concat([results.exemplars, results.at_fraction])
    thresholds = thresholds.drop_duplicates("scene_id")
    known = set(results.tables["pile_grain"]["scene_id"])
    lines: dict[Any, dict[Any, list[str]]] = {}
    for scene_id, pile in results.plan.piles.items():
        line = _bare_line(pile)
        is_level = np.ptp(line.z) == 0
        if scene_id in known and not pile.bed.is_triangle and not is_level:
            of_line = lines.setdefault(line, {})
            of_line.setdefault(pile.scene.obstacles, []).append(scene_id)
    groups = []
    for of_line in lines.values():
        rows = []
        # an exemplar stands for its bed
        for obstacles in sorted(of_line, key=len, reverse=True):
            scenes = of_line[obstacles]
            found: pd.DataFrame = thresholds[thresholds["scene_id"].isin(scenes)]
            rows.append(found.iloc[0])
        chosen = rows[: BESIDE - 1] + rows[-1:] if len(rows) > BESIDE else rows
        groups.append(chosen)
    return groups[:BEDS]


def _bare_line(pile: Pile) -> BedLine:
    """The line of a bed without its obstacles."""
    if not pile.scene.obstacles:
        return pile.model.line
    return of_bed(pile.scene.without_obstacles().bed)


def _beds(results: Results, beds: Sequence[Sequence[Bed]], width: float) -> Canvas:
    """Three panels for each line of a bed."""
    count = len(beds)
    is_wide = width > style.NARROW
    figure = style.canvas((4.4 if is_wide else 5.2) * count + 0.9, width)
    axes = figure.subplots(3 * count, 1, height_ratios=[1.6, 1.0, 0.8] * count)
    for panels, bed in zip(axes.reshape(-1, 3), beds, strict=True):
        _bed(results, bed, tuple(panels))
    handles = style.samples([*axes])
    names = max((len(str(each.get_label())) for each in handles), default=1)
    columns = max(1, int(width / style.inches(5.0 + 0.57 * names)))
    look: Look = {"loc": "outside lower center", "ncols": min(columns, len(handles))}
    figure.legend(handles=handles, **look)
    return figure


def _bed(results: Results, beds: Sequence[Bed], panels: tuple[Axes, ...]) -> None:
    """The panels of the beds on one line."""
    top, middle, below = panels
    row, pile = beds[0]
    told = single.quantity_of_row(row)
    unit = LengthUnit.of(pile)
    table = results.tables["pile_grain"].sort_values("x_m")
    limits = []
    for place, (each, other) in enumerate(beds):
        grains = table[table["scene_id"] == each["scene_id"]]
        name = _name(beds, place)
        limits.append(_thresholds(top, each, grains, told, unit, place, name))
        _stress(middle, results, other, grains, unit, place)
    top.set_ylim(np.nanmin(limits), np.nanmax(limits))
    top.set_title(_title(results, pile, told), loc="left")
    middle.set_title("u*/u*₀ along the bed", loc="left")
    middle.axhline(0, color="0.4", lw=0.6)
    _line(below, beds, table[table["scene_id"] == row["scene_id"]], told, unit)
    ends = pile.bed.place([pile.model.line.x[1], pile.model.line.x[-2]]).tolist()
    for ax in panels:
        ax.set_xlim(unit.scale * min(ends), unit.scale * max(ends))
    for ax in (top, middle):
        ax.tick_params(labelbottom=False)
    if np.isfinite(row["first_x_m"]) and row["first_ustar0_m_s"] > 0:
        _first(panels, row, pile, told, unit)


def _name(beds: Sequence[Bed], place: int) -> str:
    """What a bed has before it, where several stand on one line."""
    if len(beds) == 1:
        return ""
    obstacles = [str(each) for each in beds[place][1].scene.obstacles]
    return " and ".join(obstacles) or "no obstacle"


def _title(results: Results, pile: Pile, told: ReportedQuantity) -> str:
    """What is above the first panel, and of which bed."""
    bed = pile.bed
    if bed.profile:
        shape = bed.profile.name
    else:
        shape = bed.form.label or bed.shape
        if bed.forms > 1:
            shape = f"{bed.forms} × {shape}"
            if bed.spacing:
                shape += f", {length(bed.spacing)} apart"
    names = results.flow_fields
    first = results.beds("pile").iloc[0]
    values = pd.Series([first[name] for name in names], names, dtype=object)
    told_by = [labels.panel(values, names)] if names else []
    size = labels.value_text("d_m", pile.scene.grain.diameter)
    return ", ".join([f"{told.name}, {told.unit}: {shape}", size, *told_by])


def _thresholds(
    ax: Axes,
    row: pd.Series,
    grains: pd.DataFrame,
    told: ReportedQuantity,
    unit: LengthUnit,
    place: int,
    name: str,
) -> tuple[float, float]:
    """The flow at which each place goes, with a band, and that to compare with.

    Returned are the least and the largest flow that the panel should show.
    """
    goes = np.isfinite(grains["ustar0_m_s"]) & (grains["ustar0_m_s"] > 0)
    x = unit.scale * grains.loc[goes, "x_m"].to_numpy(float)
    ustar = grains.loc[goes, "ustar0_m_s"].to_numpy(float)
    cuts = _parted(x)
    curves = curves_of_card(row)
    if place or name:
        curves = curves[:1]
    (advised, _), *_ = curves
    if place == 0:
        _band(ax, row, x, advised * ustar, told)
    low, high = np.inf, 0.0
    for number, (factor, look) in enumerate(curves):
        flow = units.told_by(row, factor * ustar, told)
        shape: Look = {**look, "gid": "thresholds" if factor == 1 else "measured"}
        if name:
            shape |= {"label": name, **(OTHERS[place - 1] if place else {})}
        elif number:
            shape["lw"] = 1.0
        ax.plot(*_broken(x, flow, cuts), **shape)
        if len(flow):
            least = float(np.nanmin(flow))
            shown = flow[flow < HIGHEST * least]
            low = min(low, 0.65 * least)  # the label of the first motion stands there
            high = max(high, 1.3 * float(np.nanmax(shown, initial=least)))
    # one collection: by the method local these may be hundreds
    if place == 0:
        across = ax.get_xaxis_transform()
        gone = unit.scale * grains.loc[~goes, "x_m"]
        ax.vlines(gone, 0, 1, transform=across, **NEVER)
    return (low, high) if high else (0.0, 1.0)


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


def _stress(
    ax: Axes,
    results: Results,
    pile: Pile,
    grains: pd.DataFrame,
    unit: LengthUnit,
    place: int,
) -> None:
    """The signed u* over the undisturbed one: of the flow, and as grains feel it."""
    colour: Look = OTHERS[place - 1] if place else {"color": ANSWER}
    if pile.solves:
        wall = stress_on(pile, results)
        x = unit.scale * wall["x_m"].to_numpy(float)
        ustar = wall["ustar_over_ustar0_wall"].to_numpy(float)
        ax.plot(x, ustar, lw=1.2, gid="wall", **colour)
        if place == 0:
            ax.fill_between(x, ustar, 0, where=(ustar < 0).tolist(), **REVERSED)
    if pile.solves and place == 0:
        for mark, at in ends_of_reversed(x, ustar, LONG * unit.scale * pile.bed.height):
            look: Look = {"color": ANSWER, "weight": "bold", "ha": "center"}
            ax.plot([at], [0], "o", ms=4, mfc="white", color=ANSWER, gid=mark)
            ax.annotate(mark, (at, 0), (0, 4), textcoords="offset points", **look)
    if place == 0:
        felt = grains["ustar_over_ustar0"]
        ax.plot(unit.scale * grains["x_m"], felt, **{**FELT, "ms": 4})
    ax.margins(y=0.15)


def ends_of_reversed(x: Any, ustar: Any, least: float) -> list[tuple[str, float]]:
    """Find where the flow leaves a bed and where it is back.

    Parameters
    ----------
    x
        Places along the bed, rising with the flow or against it, shape (n,).
    ustar
        Signed friction velocity there, shape (n,).
    least
        Length of the shortest stretch of reversed flow that counts, in the unit of x.

    Returns
    -------
    list of (str, float)
        ``S``, separation, and ``R``, reattachment, with their places between two
        points, where the friction velocity is 0. Flow that runs back at an end of the
        bed has no mark there.
    """
    known = np.isfinite(ustar)
    x, ustar = np.asarray(x, float)[known], np.asarray(ustar, float)[known]
    edges = np.flatnonzero(np.diff((ustar < 0).astype(int)))
    marks = []
    for at in edges:
        share = ustar[at] / (ustar[at] - ustar[at + 1])
        mark = "S" if ustar[at] >= 0 else "R"
        marks.append((mark, float(x[at] + share * (x[at + 1] - x[at]))))
    found = []
    for first, second in pairwise(marks):
        if first[0] == "S" and abs(second[1] - first[1]) >= least:
            found += [first, second]
    return found


def _line(
    ax: Axes,
    beds: Sequence[Bed],
    grains: pd.DataFrame,
    told: ReportedQuantity,
    unit: LengthUnit,
) -> None:
    """The bed with its obstacles, and what has moved at the fraction of the row."""
    row, pile = beds[0]
    bed = pile.bed
    for _, other in beds:
        x = unit.scale * bed.place(other.model.line.x)
        z = unit.scale * bed.level(other.model.line.z)
        ax.fill_between(x, z, z.min() - 0.1 * np.ptp(z), color=style.BED, lw=0)
        ax.plot(x, z, color=EDGE, lw=0.8, gid="bed")
    _obstacles(ax, beds, unit)
    places = grains["x_m"].to_numpy(float)
    has_moved = grains["ustar0_m_s"].to_numpy(float) <= float(row["ustar0_m_s"])
    height = bed.level(pile.model.line.height(bed.along(places)))
    moved = np.where(has_moved, unit.scale * height, np.nan)
    ax.plot(unit.scale * places, moved, color=ANSWER, lw=3.5, gid="moved")
    ax.set_title(f"Bed, {unit.name}{_entrained(row, told)}", loc="left")
    of = bed.profile.name if bed.profile else "from the toe of the first form"
    ax.set(xlabel=f"x, {unit.name}, {of}", ymargin=0.1)
    is_right = pile.scene.flow.towards == WITH_X
    place = (0.99, 0.7) if is_right else (0.01, 0.7)
    ax.annotate(
        "flow →" if is_right else "← flow",
        place,
        xycoords="axes fraction",
        ha="right" if is_right else "left",
        color=FLOW,
        weight="bold",
    )


def _entrained(row: pd.Series, told: ReportedQuantity) -> str:
    """What the thick line on the bed is; empty where the fraction is not reached."""
    flow = float(row[single.advised_column(row, told)])
    if not np.isfinite(flow):
        return ""
    return f"; thick: {percent(row['fraction'])} entrained at {flow:#.3g} {told.unit}"


def _obstacles(ax: Axes, beds: Sequence[Bed], unit: LengthUnit) -> None:
    """The obstacles of all beds on a line, in the colours of these."""
    for place, (_, pile) in enumerate(beds):
        look: Look = OTHERS[place - 1] if place else {"color": ANSWER}
        for obstacle in pile.scene.obstacles:
            along = pile.bed.along(np.array([obstacle.x]))
            foot = float(_bare_line(pile).height(along)[0])
            ends = pile.bed.level(np.array([foot, foot + obstacle.height]))
            x = [unit.scale * obstacle.x] * 2
            color = look["color"]
            ax.plot(x, unit.scale * ends, color=color, lw=2.5, gid="obstacle")


def _first(
    axes: Sequence[Axes],
    row: pd.Series,
    pile: Pile,
    told: ReportedQuantity,
    unit: LengthUnit,
) -> None:
    """Mark the place where motion starts, with its flow."""
    x = unit.scale * float(row["first_x_m"])
    factor = curves_of_card(row)[0][0]
    value = float(units.told_by(row, factor * float(row["first_ustar0_m_s"]), told))
    for ax in axes:
        ax.axvline(x, color=ANSWER, lw=0.8, ls=":", zorder=0.5)
    top = axes[0]
    top.plot([x], [value], "o", color=ANSWER, ms=5, mec="white", gid="start")
    is_left = x < np.mean(top.get_xlim())
    look: Look = {"textcoords": "offset points", "va": "bottom", "color": ANSWER}
    look |= {"ha": "left" if is_left else "right", "weight": "bold", "gid": "first"}
    # it may lie on the curves of other forms
    look["bbox"] = {"fc": "white", "ec": "none", "pad": 1.0, "alpha": 0.8}
    where = counted.place(float(row["first_x_m"]), pile.bed)
    if not pile.bed.profile:
        where = f"{x:.3g}"
    text = f"first motion: {value:#.3g} {told.unit} at {where} {unit.name}"
    apart = (5 if is_left else -5, 3)
    place = (x, 0.0)
    top.annotate(text, place, xycoords=top.get_xaxis_transform(), xytext=apart, **look)


FIGURE = FigureKind(
    order=40,
    draws=draw,
    needs=("pile_grain", "pile_threshold"),
    uses=("wall_stress",),
)
