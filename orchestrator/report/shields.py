"""The Shields diagram: axes, published references, closed-form lines, points with intervals."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.ndimage import grey_closing, grey_opening

from orchestrator.physics import curves
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import BUFFINGTON_MONTGOMERY, MEASURED_SOURCE
from orchestrator.report import labels, measured, style, theory
from orchestrator.report.measured import Fit
from orchestrator.report.page import caption
from orchestrator.report.results import (
    Results,
    by_dem,
    case_names,
    drawable,
    held,
    nearest_fraction,
    split,
    valid,
)
from orchestrator.report.style import Figure, Sample
from orchestrator.study import fields
from orchestrator.types import FloatArray

SHAPES = "os^DvP<X>p8hd*"
"""Markers that are told from each other."""
SHAPE = "marker"
"""The column that holds a row's marker."""
SPIKE = 33
"""Points of the water band, 80 a decade, over which an edge must last."""
AIR_STYLES = ("-.", "--", (0, (1, 1)))
RESULT = ("closed form", "points", "points, law does not hold")
"""Marks of the artists that the limits of the axes must hold."""
WATER = "water curve"
MEASURED = "measured"
AIR = "air: "
BESIDE = 3
"""Markers that one entry of a legend has room for."""
NAME = "shields"
TOLD = ("alpha_deg", "d_m", "z0_over_d", "force_law")
"""Columns that a point tells of its scene."""
FEW = 8
"""Piles of which every fraction is drawn in the one diagram."""
BED = ("beta_deg", "z0_over_d", "alpha_s")
"""Columns of all that a line depends on beside its law, on a flat bed."""
LINES = 3
"""Laws beyond which only those near the measurements are drawn."""


def parted(table: pd.DataFrame, *shown: str) -> tuple[list[str], pd.DataFrame, list[Sample]]:
    """How rows are told apart that agree in all columns that are shown.

    Returns
    -------
    panels : list of str
        The columns that part panels: those of what is asked.
    rows : DataFrame
        The table with a marker for each force law and each variant; a variant is one combination
        of how scenes are answered.
    entries : list of samples
        What the markers of variants mean, for a legend; none where there is one variant.
    """
    columns = labels.varying(table, *shown)
    panels = [column for column in columns if fields.COLUMNS[column].info.about == "question"]
    looks = [column for column in columns if column not in panels]
    # without variants there is a marker for every law, the same in all figures
    laws = [item for item in LAWS if item in {*theory.PAIR, *table["force_law"]} or not looks]
    while looks and len(table[looks].drop_duplicates()) * len(laws) > len(SHAPES):
        panels.append(looks.pop(0))
    variant = pd.Series(0, index=table.index)
    if looks:  # the most frequent variant is the first
        number = table.groupby(looks, dropna=False).ngroup()
        order = number.groupby(number).size().sort_values(ascending=False, kind="stable").index
        variant = number.map({old: new for new, old in enumerate(order)})
    shape = variant * len(laws) + table["force_law"].map(laws.index)
    rows = table.assign(**{SHAPE: shape.map(lambda at: SHAPES[at % len(SHAPES)])})
    entries: list[Sample] = []
    for _, group in rows.groupby(variant) if looks else ():
        # the fields of DEM have no effect on a pile that was answered without it
        label = labels.panel(group.iloc[0], looks) or labels.methods(group)
        shapes = dict.fromkeys(group.sort_values("force_law", ascending=False)[SHAPE])
        entries.append(tuple(_mark(item, "0.2", label) for item in shapes))
    return panels, rows, entries


def about(rows: pd.DataFrame) -> dict[str, Any]:
    """The values of the captions of a figure that follow from its rows."""
    if rows.empty:
        return {}
    names = [labels.value("force_law", name) for name in theory.drawn(rows["force_law"])]
    facts: dict[str, Any] = {
        "laws": "; ".join(names),
        "pair": bool(rows["force_law"].isin(theory.PAIR).any()),
        "hollow": not valid(rows).all(),
        "viscosities": rows["nu_m2_s"].nunique(),
        "methods": labels.methods(rows),
    }
    dem = rows["answered_method"] == "dem"
    for name, column, scale in (
        ("increment", "load_increment", 100.0),
        ("criterion", "displacement_criterion", 1.0),
        ("waiting", "waiting_time", 1.0),
    ):
        values = sorted(set(rows.loc[dem, f"answered_{column}"] * scale))
        facts[name] = ", ".join(f"{value:.6g}" for value in values)
    return {**facts, "dem": bool(dem.any()), "others": labels.methods(rows[~dem])}


def references(scenes: pd.DataFrame, sloped: bool = False) -> dict[str, Any]:
    """The values of captions about the published curves beside some scenes."""
    air = theory.air_lines(scenes)
    return {
        "air": ", ".join(air),
        "wet": not air or not theory.in_gas(scenes).all(),
        "sloped": theory.SLOPED if sloped else "",
        "curves": "; ".join(curve.name for curve in curves.WATER),
        "measured": MEASURED_SOURCE,
        "bagnold_from": f"{theory.BAGNOLD_FROM:g}",
    }


def prepare(
    axes: Sequence[Axes], panels: Sequence[pd.DataFrame], xlim: tuple[float, float]
) -> None:
    """Logarithmic axes of panels; the transition where the rows of one have the paper's laws.

    Call it when all else is drawn; the axes share their limits.
    """
    marks = (*RESULT, WATER, MEASURED)
    lines = [line for ax in axes for line in ax.lines]
    shown = [item for item in lines if (gid := str(item.get_gid())) in marks or gid.startswith(AIR)]
    xy = np.concatenate([np.asarray(line.get_xydata(), float) for line in shown])
    tau = xy[(xy[:, 0] >= xlim[0]) & (xy[:, 0] <= xlim[1]) & (xy[:, 1] > 0), 1]
    for ax, rows in zip(axes, panels, strict=True):
        ax.set(xscale="log", yscale="log", ylabel=labels.TAU_AXIS)
        ax.set(xlim=xlim, ylim=(tau.min() / 1.6, tau.max() * 2.2))
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
        shade_transition(ax, rows)
    label_lowest(axes, labels.RE_AXIS)


def label_lowest(axes: Sequence[Axes], label: str) -> None:
    """Name and number the x axis of the lowest panel of each column; panels go row by row."""
    lowest = {}
    for ax in axes:
        place = ax.get_subplotspec()
        lowest[place.colspan.start if place else 0] = ax
    for ax in lowest.values():
        ax.set_xlabel(label)
        ax.tick_params(axis="x", which="both", labelbottom=True)


def shade_transition(ax: Axes, rows: pd.DataFrame) -> None:
    """Shade where neither law of the paper holds, as far as the axes show it."""
    left, right = ax.get_xlim()
    ax.set_xlim(left, right)
    if not rows["force_law"].isin(theory.PAIR).any():
        return
    low, high = (LAWS[name].reynolds for name in theory.PAIR)
    left, right = max(left, low[1]), min(right, high[0])
    if left < right:
        ax.axvspan(left, right, color="0.93", zorder=0, gid="transition")
        if right > 1.5 * left:
            style.note(ax, float(np.sqrt(left * right)), "transition")


def mark_drag_law(axes: Sequence[Axes], panels: Sequence[pd.DataFrame]) -> None:
    """A line where the drag law of Eq. 4 ends, if the axes reach it and that law is drawn."""
    for ax, rows in zip(axes, panels, strict=True):
        limit = theory.drag_law_limit(float(rows["z0_over_d"].iloc[0]))
        if rows["force_law"].isin(theory.PAIR).any() and ax.get_xlim()[1] > limit:
            look: style.Look = {"color": "0.4", "lw": 0.7, "ls": (0, (4, 2)), "zorder": 0.5}
            ax.axvline(limit, gid="drag law limit", **look)
            style.upright_note(ax, limit / 1.04, "drag law ends", at="bottom")


def draw_branch(ax: Axes, branch: theory.Branch, colour: str, dash: theory.Dash) -> None:
    """A closed-form line, dotted where its law does not hold but the study has grains."""
    for chosen, look, width in ((branch.valid, dash, 1.1), (branch.continued, ":", 0.9)):
        if chosen.any():
            x, y = (np.where(chosen, a, np.nan) for a in (branch.reynolds, branch.shields))
            ax.plot(x, y, ls=look, color=colour, lw=width, gid=RESULT[0])


def draw_points(
    ax: Axes, rows: pd.DataFrame, colour: str, columns: tuple[str, str, str, str]
) -> None:
    """Intervals and the rows' own markers, by the columns of x, y and its ends.

    Hollow where a threshold is not usable.
    """
    rows = rows[rows[columns[1]].notna()]
    x, y, low, high = (rows[column].to_numpy(float) for column in columns)
    # as one line with gaps: bars and caps by themselves take three times as long
    places, ends = np.repeat(x, 3), np.column_stack([low, high, np.full_like(low, np.nan)]).ravel()
    look: style.Look = {"color": colour, "lw": 0.8, "solid_capstyle": "butt", "gid": "intervals"}
    ax.plot(places, ends, marker="_", ms=5, mew=0.7, zorder=2.5, **look)
    solid, shapes = valid(rows).to_numpy(), rows[SHAPE].to_numpy(str)
    for marker in sorted(set(shapes.tolist())):
        for filled, gid in ((True, RESULT[1]), (False, RESULT[2])):
            group = (solid == filled) & (shapes == marker)
            if group.any():
                face = colour if filled else "white"
                ax.plot(
                    x[group], y[group], marker, mfc=face, mec=colour, mew=0.8, zorder=3, gid=gid
                )


def draw_water(ax: Axes) -> list[Artist]:
    """Published curves for water with their band, and measured medians with their ranges.

    Returns
    -------
    list of Artist
        The entries of a legend.
    """
    gap = np.full((1, 2), np.nan)
    lines = [part for item in curves.WATER for part in (np.column_stack(item.points()), gap)]
    ax.plot(*np.concatenate(lines).T, color=style.WATER, lw=0.4, zorder=1, gid=WATER)
    reynolds = np.geomspace(0.01, 1000, 400)
    low, high = theory.water_band(reynolds)
    there = np.isfinite(low)
    at = np.flatnonzero(there)
    # a curve that begins far from the others is a line alone until it comes near them
    low, high = (np.interp(np.arange(len(reynolds)), at, edge[at]) for edge in (low, high))
    low, high = grey_closing(low, size=(SPIKE,)), grey_opening(high, size=(SPIKE,))
    band: style.Look = {"color": style.WATER, "alpha": 0.45, "lw": 0}
    ax.fill_between(reynolds, low, high, where=there.tolist(), zorder=1, gid="water band", **band)
    bins = BUFFINGTON_MONTGOMERY
    x, y = [item.middle for item in bins], [item.median for item in bins]
    look: style.Look = {"color": "black", "lw": 0.7, "zorder": 2.2, "gid": MEASURED}
    ax.vlines(x, [item.tenth for item in bins], [item.ninetieth for item in bins], **look)
    ax.hlines(y, [item.low for item in bins], [item.high for item in bins], **look)
    ax.plot(x, y, "s", ms=3.5, **look)
    label = "measured in water: median, 10 to 90 %"
    return [
        Patch(label="water: spread of published curves", gid=WATER, **band),
        Line2D([], [], color="black", lw=0.7, marker="s", ms=3.5, label=label, gid=MEASURED),
    ]


def draw_air(ax: Axes, scenes: pd.DataFrame) -> list[Artist]:
    """The curves for air over a horizontal bed; returns their entries for a legend."""
    entries: list[Artist] = []
    lines = theory.air_lines(scenes)
    for (name, (x, y)), dash in zip(lines.items(), AIR_STYLES, strict=False):
        look: style.Look = {"color": style.AIR, "ls": dash, "lw": 0.9, "gid": AIR + name}
        ax.plot(x, y, zorder=1.5, **look)
        entries.append(Line2D([], [], label=f"air: {name}", **look))
    return entries


def draw_sloped_air(ax: Axes, scenes: pd.DataFrame, colour: str) -> list[Artist]:
    """One curve for air times the slope factor; three for each slope would hide the rest."""
    name = theory.SLOPED
    lines = theory.air_lines(scenes, float(scenes["alpha_deg"].iloc[0]))
    if name not in lines:
        return []
    ax.plot(*lines[name], color=colour, ls="--", lw=0.7, zorder=1.5, gid=AIR + name)
    # a colour that means one slope says nothing of the others
    shown = colour if colour == style.AIR else "0.2"
    label = f"air: {name} × slope factor"
    return [Line2D([], [], color=shown, ls="--", lw=0.7, label=label, gid=AIR + name)]


def line_entries(rows: pd.DataFrame, dashes: Mapping[str, theory.Dash]) -> list[Artist]:
    """Legend of the closed form's line styles, for the laws of some rows."""
    pair = {theory.PAIR[0]: "Eqs. 3, 5"} if theory.PAIR[0] in dashes else {}
    others = {item: labels.value("force_law", item) for item in dashes if item not in theory.PAIR}
    look: style.Look = {"color": "0.2", "gid": RESULT[0]}
    entries: list[Artist] = [
        Line2D([], [], lw=1.1, ls=dashes[name], label=f"closed form: {label}", **look)
        for name, label in {**pair, **others}.items()
    ]
    if not valid(rows).all():
        dotted = "dotted: the force law does not hold"
        entries.append(Line2D([], [], lw=0.9, ls=":", label=dotted, **look))
    return entries


def point_entries(rows: pd.DataFrame, variants: Sequence[Sample] = ()) -> list[Sample]:
    """Legend of the markers that some rows need: by which methods, with which forces.

    One law needs no entry of its own where the variants of how it was answered have theirs.
    """
    names = [name for name in LAWS if (rows["force_law"] == name).any()]
    entries: list[Sample] = []
    for name in names if len(names) > 1 or not variants else ():
        group = rows[rows["force_law"] == name]
        label = f"{labels.methods(group)}, {labels.value('force_law', name)}"
        shapes = sorted(set(group[SHAPE]))
        shapes = shapes if len(shapes) <= BESIDE else [group[SHAPE].mode()[0]]
        marks = tuple(_mark(item, "0.2", label) for item in shapes)
        entries.append(marks if len(marks) > 1 else marks[0])
    if not valid(rows).all():
        shape = rows.loc[~valid(rows), SHAPE].iloc[0]
        entries.append(_mark(shape, "white", "hollow: not usable, see why_not"))
    return entries


def _mark(shape: str, face: str, label: str) -> Line2D:
    return Line2D([], [], ls="", marker=shape, mec="0.2", mfc=face, mew=0.8, label=label)


def within(axes: Sequence[Axes], entries: Sequence[Artist]) -> list[Artist]:
    """The entries of a legend of whose lines or bars a part is in a frame; call it at the end."""
    seen = set()
    for ax in axes:
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        for line in ax.lines:
            x, y = np.asarray(line.get_xydata(), float).T
            if ((x >= left) & (x <= right) & (y >= low) & (y <= high)).any():
                seen.add(line.get_gid())
        for bars in ax.collections:
            for path in bars.get_paths() if isinstance(bars, LineCollection) else []:
                x, y = np.asarray(path.vertices, float).T
                if x.max() >= left and x.min() <= right and y.max() >= low and y.min() <= high:
                    seen.add(bars.get_gid())
    return [item for item in entries if item.get_gid() in seen]


def draw(results: Results) -> Iterator[Figure]:
    """The one diagram of a study: its piles, single grains, laws and measurements in one frame."""
    piles, grains, lines = shown_piles(results), _shown_grains(results), _lines(results)
    if not lines and piles.empty and grains.empty:
        return
    scenes, figure = results.scenes, style.canvas(4.4)
    ax = figure.subplots()
    published = [*draw_water(ax), *draw_air(ax, scenes)]
    groups: dict[str, list[list[str]]] = {}
    shades = style.palette("alpha_deg", results.values("alpha_deg"))
    entries = []
    reach, taus = [*theory.span(scenes)], []
    for rows, name, column in ((grains, "single grain", "shields_dem"), (piles, "pile", "shields")):
        if len(rows):
            entries += _points(ax, groups, rows, name, column, shades)
            reach += rows["reynolds"].tolist()
            taus += rows[column].tolist()
    low, high = min(reach) / 1.6, max(reach) * 1.6
    reynolds = np.geomspace(low / 2, high * 2, theory.POINTS)
    for at, fit in enumerate(lines):
        # a law on another bed has a thinner line
        width = 1.4 / (1 + [item.law for item in lines[:at]].count(fit.law))
        entries.append(_law(ax, fit, reynolds, width))
    prepare([ax], [scenes], (low, high))
    bottom, top = ax.get_ylim()
    ax.set_ylim(min([bottom, *(t / 1.4 for t in taus)]), max([top, *(1.4 * t for t in taus)]))
    style.plain_ticks(ax.yaxis)
    style.legends(figure, [], [*entries, *within([ax], published)])
    text = caption(
        "overview",
        piles=about(piles),
        grains=about(grains),
        fractions=", ".join(f"{f:.0%}" for f in sorted(set(piles["fraction"])))
        if len(piles)
        else "",
        names="; ".join(fit.name for fit in lines),
        lines=references(scenes),
    )
    cases = case_names(piles, grains)
    yield Figure(NAME, "Extended Shields diagram", text, cases, figure, data=groups)


def shown_piles(results: Results) -> pd.DataFrame:
    """The thresholds of piles that are drawn: of many piles at one fraction."""
    rows = results.joined("pile_threshold")
    if rows.empty:
        return rows
    if rows["scene_id"].nunique() > FEW:
        rows = rows[rows["fraction"] == nearest_fraction(rows)]
    return rows[drawable(rows, "reynolds", "shields")]


def _shown_grains(results: Results) -> pd.DataFrame:
    """Single grains that moved in DEM under a held flow, on the study's least slope."""
    grains = by_dem(results.joined("single_grain"))
    if grains.empty:
        return grains
    here = held(grains) & (grains["alpha_deg"] == grains["alpha_deg"].min())
    chosen: pd.DataFrame = grains[here & drawable(grains, "reynolds", "shields_dem")]
    return chosen


def _lines(results: Results) -> list[Fit]:
    """The closed form of a flat bed as lines, of no other roughness than the points beside them.

    The laws of piles have lines for the entrainment angle and the z0/d of the piles, of many z0/d
    for the least and the largest. Other laws have one line, on the bed that fits the measurements
    best. The two laws of the paper are one model: both have the same bed.
    """
    beds = [group for _, group in split(results.beds("pile").assign(alpha_deg=0.0), *BED)]
    of_piles = [
        Fit(name, theory.bed_of(group), *theory.span(group))
        for group in (beds if len(beds) <= 2 else [beds[0], beds[-1]])
        for name in theory.drawn(group["force_law"])
    ]
    best = measured.best(measured.fits(results))
    best = best if len(best) <= LINES else [fit for fit in best if fit.decades > 0] or best
    shared = next((fit.bed for fit in best if fit.law in theory.PAIR), None)
    drawn = {fit.law for fit in of_piles}
    others = [
        replace(fit, bed=shared) if shared and fit.law in theory.PAIR else fit
        for fit in best
        if fit.law not in drawn
    ]
    return [*of_piles, *others]


def _points(
    ax: Axes,
    groups: dict[str, list[list[str]]],
    rows: pd.DataFrame,
    name: str,
    column: str,
    shades: Mapping[float, str],
) -> list[Artist]:
    """Points with intervals: colours are slopes, hollow is not usable.

    `groups` gets, by the mark of each group of points, the texts of each point: its scene, its
    threshold with the interval, why it is not usable, its case. Returns the entries of a legend.
    """
    shape, size = ("o", 2.4) if name == "single grain" else (SHAPES[1], 3.6)
    extra = labels.varying(rows, *(item for item in (*TOLD, "fraction") if item in rows))
    ends = [f"{column}_low", f"{column}_high"]
    for (alpha, usable), group in split(rows.assign(valid=valid(rows)), "alpha_deg", "valid"):
        colour, gid = shades[float(str(alpha))], f"{NAME}-{len(groups)}"
        x, y, low, high = (group[c].to_numpy(float) for c in ("reynolds", column, *ends))
        ax.vlines(x, low, high, color=colour, lw=0.6, zorder=2.5)
        face = colour if usable else "white"
        look: style.Look = {"marker": shape, "ms": size, "mec": colour, "mew": 0.6, "mfc": face}
        ax.plot(x, y, ls="", zorder=3, gid=gid, **look)
        groups[gid] = [_texts(row, column, extra) for _, row in group.iterrows()]
    if name == "pile" and rows["fraction"].nunique() == 1:
        name += f" at n/N = {rows['fraction'].iloc[0]:.0%}"
    entries: list[Artist] = []
    for alpha, colour in shades.items():
        if (rows["alpha_deg"] == alpha).any():
            label = f"{name}, {labels.plain('alpha_deg', alpha)}"
            entries.append(Line2D([], [], ls="", marker=shape, color=colour, ms=4, label=label))
    if not valid(rows).all():
        entries.append(_mark(shape, "white", f"{name}, hollow: not usable"))
    return entries


def _texts(row: pd.Series, column: str, extra: Sequence[str]) -> list[str]:
    value, low, high = (row[name] for name in (column, f"{column}_low", f"{column}_high"))
    interval = f" ({low:.4g} … {high:.4g})" if pd.notna(low) else ""
    ustar = row["ustar0_m_s"] if "ustar0_m_s" in row else row["ustar_m_s"]
    where = f" at n/N = {row['fraction']:.0%}" if "fraction" in row else ""
    threshold = f"τ_c = {value:.4g}{interval}{where}, u*₀ = {ustar:.3g} m/s"
    case = row["case"] if isinstance(row["case"], str) else ""
    return [", ".join(labels.told(row, (*TOLD, *extra))), threshold, str(row["why_not"]), case]


def _law(ax: Axes, fit: Fit, reynolds: FloatArray, width: float) -> Line2D:
    """The line of a law on one bed; returns its entry for a legend."""
    colour, dash = theory.look(fit.law)
    tau = theory.shields(fit.law, reynolds, fit.bed)
    holds = theory.law_holds(fit.law, reynolds, fit.bed)
    look: style.Look = {"color": colour, "gid": RESULT[0]}
    ax.plot(reynolds, np.where(holds, tau, np.nan), ls=dash, lw=width, **look)
    if fit.law not in theory.PAIR:
        ax.plot(reynolds, np.where(holds, np.nan, tau), ls=":", lw=0.9, **look)
    return Line2D([], [], color=colour, ls=dash, lw=width, label=fit.name)
