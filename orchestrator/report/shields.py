"""The Shields diagram: axes, published references, closed-form lines, points with intervals."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.ndimage import grey_closing, grey_opening

from orchestrator.physics import curves
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import MEASURED_SOURCE
from orchestrator.report import labels, measured, style, theory
from orchestrator.report.measured import BINS, Fit
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
from orchestrator.report.style import Figure, Look, Sample
from orchestrator.study import fields

SHAPES = "os^DvP<X>p8hd*"
SHAPE = "marker"
"""The column that holds a row's marker."""
SPIKE = 33
"""Points of the water band, 80 a decade, over which an edge must last."""
AIR_STYLES = ("-.", "--", (0, (1, 1)))
RESULT = ("closed form", "points", "points, law does not hold")
WATER, MEASURED, AIR = "water curve", "measured", "air: "
"""Marks of artists, by which the limits of the axes and the legends know them."""
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

    Returns the columns that part panels, which are those of what is asked; the table with a marker
    for each force law and each variant, one combination of how scenes are answered; and what the
    markers of the variants mean, for a legend, where there are several.
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
        variant = number.map({old: new for new, old in enumerate(number.value_counts().index)})
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
    dem = rows["answered_method"] == "dem"

    def used(column: str, scale: float = 1.0) -> str:
        values = sorted(set(rows.loc[dem, f"answered_{column}"] * scale))
        return ", ".join(f"{value:.6g}" for value in values)

    return {
        "laws": "; ".join(
            labels.value("force_law", name) for name in theory.drawn(rows["force_law"])
        ),
        "pair": rows["force_law"].isin(theory.PAIR).any(),
        "hollow": not valid(rows).all(),
        "viscosities": rows["nu_m2_s"].nunique(),
        "methods": labels.methods(rows),
        "others": labels.methods(rows[~dem]),
        "dem": dem.any(),
        "increment": used("load_increment", 100.0),
        "criterion": used("displacement_criterion"),
        "waiting": used("waiting_time"),
    }


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
    lines = [line for ax in axes for line in ax.lines]
    marks = (*RESULT, WATER, MEASURED, AIR)
    shown = [line for line in lines if str(line.get_gid()).startswith(marks)]
    x, tau = np.concatenate([np.asarray(line.get_xydata(), float) for line in shown]).T
    tau = tau[(x >= xlim[0]) & (x <= xlim[1]) & (tau > 0)]
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
    low, high = (LAWS[name].reynolds for name in theory.PAIR)
    left, right = max(left, low[1]), min(right, high[0])
    if left < right and rows["force_law"].isin(theory.PAIR).any():
        ax.axvspan(left, right, color="0.93", zorder=0, gid="transition")
        if right > 1.5 * left:
            centre: Look = {"ha": "center", "va": "top", "transform": ax.get_xaxis_transform()}
            ax.text(float(np.sqrt(left * right)), 0.97, "transition", **centre, **style.NOTE)


def mark_drag_law(axes: Sequence[Axes], panels: Sequence[pd.DataFrame]) -> None:
    """A line where the drag law of Eq. 4 ends, if the axes reach it and that law is drawn."""
    for ax, rows in zip(axes, panels, strict=True):
        limit = theory.drag_law_limit(float(rows["z0_over_d"].iloc[0]))
        if rows["force_law"].isin(theory.PAIR).any() and ax.get_xlim()[1] > limit:
            look: Look = {"color": "0.4", "lw": 0.7, "ls": (0, (4, 2)), "zorder": 0.5}
            ax.axvline(limit, gid="drag law limit", **look)
            style.upright_note(ax, limit / 1.04, "drag law ends", at="bottom")


def draw_branch(ax: Axes, branch: theory.Branch, colour: str, dash: theory.Dash) -> None:
    """A closed-form line, dotted where its law does not hold but the study has grains."""
    for chosen, look, width in ((branch.valid, dash, 1.1), (branch.continued, ":", 0.9)):
        if chosen.any():
            x, y = (np.where(chosen, a, np.nan) for a in (branch.reynolds, branch.shields))
            ax.plot(x, y, ls=look, color=colour, lw=width, gid=RESULT[0])


def draw_points(
    ax: Axes, rows: pd.DataFrame, colour: str, columns: tuple[str, str, str, str], size: float = 4.2
) -> list[tuple[Line2D, pd.DataFrame]]:
    """Intervals and the rows' own markers, by the columns of x, y and its ends.

    Hollow where a threshold is not usable. Returns the rows of each group of markers.
    """
    rows = rows[rows[columns[1]].notna()]
    x, y, low, high = (rows[column].to_numpy(float) for column in columns)
    # as one line with gaps: bars and caps by themselves take three times as long
    ends = np.column_stack([low, high, np.full_like(low, np.nan)]).ravel()
    look: Look = {"color": colour, "lw": 0.8, "solid_capstyle": "butt", "gid": "intervals"}
    ax.plot(np.repeat(x, 3), ends, marker="_", ms=size + 0.8, mew=0.7, zorder=2.5, **look)
    drawn, markers, usable = [], rows[SHAPE].to_numpy(str), valid(rows).to_numpy()
    for marker, solid in sorted(set(zip(markers.tolist(), usable.tolist(), strict=True))):
        at = (markers == marker) & (usable == solid)
        look = {"ls": "", "marker": marker, "ms": size, "mec": colour, "mew": 0.8, "zorder": 3}
        look |= {"mfc": colour, "gid": RESULT[1]} if solid else {"mfc": "white", "gid": RESULT[2]}
        drawn.append((ax.plot(x[at], y[at], **look)[0], rows[at]))
    return drawn


def draw_water(ax: Axes) -> list[Artist]:
    """Published curves for water, measured medians with their ranges; the entries of a legend."""
    gap = np.full((1, 2), np.nan)
    lines = [part for item in curves.WATER for part in (np.column_stack(item.points()), gap)]
    ax.plot(*np.concatenate(lines).T, color=style.WATER, lw=0.4, zorder=1, gid=WATER)
    reynolds = np.geomspace(0.01, 1000, 400)
    low, high = theory.water_band(reynolds)
    covered = np.isfinite(low)
    at = np.flatnonzero(covered)
    # a curve that begins far from the others is a line alone until it comes near them
    low, high = (np.interp(np.arange(len(reynolds)), at, edge[at]) for edge in (low, high))
    low, high = grey_closing(low, size=(SPIKE,)), grey_opening(high, size=(SPIKE,))
    band: Look = {"color": style.WATER, "alpha": 0.45, "lw": 0}
    ax.fill_between(reynolds, low, high, where=covered.tolist(), zorder=1, gid="water band", **band)
    x, y = measured.MIDDLES, measured.MEDIANS
    look: Look = {"color": "black", "lw": 0.7, "gid": MEASURED}
    ax.vlines(
        x, [item.tenth for item in BINS], [item.ninetieth for item in BINS], zorder=2.2, **look
    )
    ax.hlines(y, [item.low for item in BINS], [item.high for item in BINS], zorder=2.2, **look)
    ax.plot(x, y, "s", ms=3.5, zorder=2.2, **look)
    label = "measured in water: median, 10 to 90 %"
    return [
        Patch(label="water: spread of published curves", gid=WATER, **band),
        Line2D([], [], marker="s", ms=3.5, label=label, **look),
    ]


def draw_air(ax: Axes, scenes: pd.DataFrame) -> list[Artist]:
    """The curves for air over a horizontal bed; returns their entries for a legend."""
    lines, entries = theory.air_lines(scenes), []
    for (name, (x, y)), dash in zip(lines.items(), AIR_STYLES, strict=False):
        look: Look = {"color": style.AIR, "ls": dash, "lw": 0.9, "gid": AIR + name}
        ax.plot(x, y, zorder=1.5, **look)
        entries.append(Line2D([], [], label=f"air: {name}", **look))
    return [*entries]


def draw_sloped_air(ax: Axes, scenes: pd.DataFrame, colour: str) -> list[Artist]:
    """One curve for air times the slope factor; three for each slope would hide the rest."""
    name = theory.SLOPED
    lines = theory.air_lines(scenes, float(scenes["alpha_deg"].iloc[0]))
    if name not in lines:
        return []
    look: Look = {"ls": "--", "lw": 0.7, "gid": AIR + name}
    ax.plot(*lines[name], color=colour, zorder=1.5, **look)
    # a colour that means one slope says nothing of the others
    shown = colour if colour == style.AIR else "0.2"
    return [Line2D([], [], color=shown, label=f"air: {name} × slope factor", **look)]


def line_entries(rows: pd.DataFrame, dashes: Mapping[str, theory.Dash]) -> list[Artist]:
    """Legend of the closed form's line styles, for the laws of some rows."""
    names = {item: labels.value("force_law", item) for item in dashes if item not in theory.PAIR}
    names = {theory.PAIR[0]: "Eqs. 3, 5", **names} if theory.PAIR[0] in dashes else names
    listed = [(f"closed form: {label}", dashes[name]) for name, label in names.items()]
    if not valid(rows).all():
        listed.append(("dotted: the force law does not hold", ":"))
    look: Look = {"color": "0.2", "lw": 1.1, "gid": RESULT[0]}
    return [Line2D([], [], ls=dash, label=label, **look) for label, dash in listed]


def point_entries(rows: pd.DataFrame, variants: Sequence[Sample] = ()) -> list[Sample]:
    """Legend of the markers of some rows: by which methods, with which forces, if not one law."""
    names = [name for name in LAWS if (rows["force_law"] == name).any()]
    entries: list[Sample] = []
    for name in names if len(names) > 1 or not variants else ():
        group = rows[rows["force_law"] == name]
        label = f"{labels.methods(group)}, {labels.value('force_law', name)}"
        shapes = sorted(set(group[SHAPE]))
        shapes = shapes if len(shapes) <= BESIDE else [group[SHAPE].mode()[0]]
        entries.append(tuple(_mark(item, "0.2", label) for item in shapes))
    if not valid(rows).all():
        shape = rows.loc[~valid(rows), SHAPE].iloc[0]
        entries.append(_mark(shape, "white", "hollow: not usable, see why_not"))
    return entries


def _mark(shape: str, face: str, label: str, edge: str = "0.2") -> Line2D:
    return Line2D([], [], ls="", marker=shape, mec=edge, mfc=face, mew=0.8, label=label)


def within(axes: Sequence[Axes], entries: Sequence[Artist]) -> list[Artist]:
    """The entries of a legend of whose lines a part is in a frame; call it at the end."""
    seen = set()
    for ax in axes:
        for line in ax.lines:
            inside = ax.viewLim.count_contains(np.asarray(line.get_xydata(), float))
            seen |= {line.get_gid()} if inside else set()
    return [item for item in entries if item.get_gid() in seen]


def draw(results: Results) -> Iterator[Figure]:
    """The one diagram of a study: its piles, single grains, laws and measurements in one frame."""
    piles, grains, lines = shown_piles(results), _shown_grains(results), _lines(results)
    if not lines and piles.empty and grains.empty:
        return
    scenes, figure = results.scenes, style.canvas(4.4)
    ax = figure.subplots()
    published = [*draw_water(ax), *draw_air(ax, scenes)]
    shades = style.palette("alpha_deg", results.values("alpha_deg"))
    entries: list[Artist] = []
    points: list[tuple[Line2D, list[list[str]]]] = []
    reach = [*theory.span(scenes)]
    for rows, name, column in ((grains, "single grain", "shields_dem"), (piles, "pile", "shields")):
        if len(rows):
            entries += _points(ax, points, rows, name, column, shades)
            reach += rows["reynolds"].tolist()
    low, high = min(reach) / 1.6, max(reach) * 1.6
    reynolds = np.geomspace(low / 2, high * 2, theory.POINTS)
    for at, fit in enumerate(lines):
        # a law on another bed has a thinner line
        width = 1.4 / (1 + [item.law for item in lines[:at]].count(fit.law))
        colour, dash = theory.look(fit.law)
        holds = theory.law_holds(fit.law, reynolds, fit.bed)
        tau = theory.shields(fit.law, reynolds, fit.bed)
        look: Look = {"color": colour, "gid": RESULT[0]}
        ax.plot(reynolds, np.where(holds, tau, np.nan), ls=dash, lw=width, **look)
        if fit.law not in theory.PAIR:
            ax.plot(reynolds, np.where(holds, np.nan, tau), ls=":", lw=0.9, **look)
        entries.append(Line2D([], [], ls=dash, lw=width, label=fit.name, **look))
    prepare([ax], [scenes], (low, high))
    groups = {f"{NAME}-{number}": texts for number, (_, texts) in enumerate(points)}
    for gid, (line, _) in zip(groups, points, strict=True):
        line.set_gid(gid)  # by which the page's script finds the points
    style.legends(figure, [], [*entries, *within([ax], published)])
    text = caption(
        "overview",
        piles=about(piles),
        grains=about(grains),
        fractions=", ".join(f"{f:.0%}" for f in sorted(set(piles.get("fraction", [])))),
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
    lines = [
        Fit(name, theory.bed_of(group), *theory.span(group))
        for group in (beds if len(beds) <= 2 else [beds[0], beds[-1]])
        for name in theory.drawn(group["force_law"])
    ]
    best = [
        fit
        for fit in measured.best(measured.fits(results))
        if fit.law not in {f.law for f in lines}
    ]
    near = [fit for fit in best if fit.decades > 0] if len(best) > LINES else []
    pair = next((fit.bed for fit in best if fit.law in theory.PAIR), None)
    for fit in near or best:
        bed = pair if pair and fit.law in theory.PAIR else fit.bed
        lines.append(Fit(fit.law, bed, fit.first, fit.last))
    return lines


def _points(
    ax: Axes,
    points: list[tuple[Line2D, list[list[str]]]],
    rows: pd.DataFrame,
    name: str,
    column: str,
    shades: Mapping[float, str],
) -> list[Artist]:
    """Points with intervals: colours are slopes, hollow is not usable; the entries of a legend.

    `points` gets each group of points with their texts: the scene of a point, its threshold with
    the interval, why it is not usable, its case.
    """
    shape, size = ("o", 2.4) if name == "single grain" else (SHAPES[1], 3.6)
    telling = (*TOLD, *labels.varying(rows, *TOLD, *({"fraction"} & set(rows))))
    for (alpha,), part in split(rows.assign(**{SHAPE: shape}), "alpha_deg"):
        columns = ("reynolds", column, f"{column}_low", f"{column}_high")
        for line, group in draw_points(ax, part, shades[float(str(alpha))], columns, size):
            points.append((line, [_texts(row, column, telling) for _, row in group.iterrows()]))
    if name == "pile" and rows["fraction"].nunique() == 1:
        name += f" at n/N = {rows['fraction'].iloc[0]:.0%}"
    entries: list[Artist] = [
        _mark(shape, colour, f"{name}, {labels.plain('alpha_deg', alpha)}", colour)
        for alpha, colour in shades.items()
        if (rows["alpha_deg"] == alpha).any()
    ]
    hollow = [_mark(shape, "white", f"{name}, hollow: not usable")]
    return entries if rows["usable"].all() else [*entries, *hollow]


def _texts(row: pd.Series, column: str, telling: Sequence[str]) -> list[str]:
    value, low, high = (row[name] for name in (column, f"{column}_low", f"{column}_high"))
    interval = f" ({low:.4g} … {high:.4g})" if pd.notna(low) else ""
    ustar = row["ustar0_m_s"] if "ustar0_m_s" in row else row["ustar_m_s"]
    where = f" at n/N = {row['fraction']:.0%}" if "fraction" in row else ""
    threshold = f"τ_c = {value:.4g}{interval}{where}, u*₀ = {ustar:.3g} m/s"
    case = row["case"] if isinstance(row["case"], str) else ""
    return [", ".join(labels.told(row, telling)), threshold, str(row["why_not"]), case]
