"""Shields diagrams: that of a study, those of single grains and of piles; DEM over closed form."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.physics import curves
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import MEASURED_SOURCE
from orchestrator.report import labels, style, theory
from orchestrator.report.page import caption
from orchestrator.report.results import Results, case_names, drawable, held, split, valid
from orchestrator.report.style import Figure, Look
from orchestrator.report.theory import BINS, Line
from orchestrator.study import fields
from orchestrator.types import BoolArray

SHAPES = "os^DvP<X>p8hd*"
SHAPE, LABEL = "marker", "label"
"""The columns that hold a row's marker and its meaning."""
REYNOLDS = np.geomspace(1e-4, 1e6, 601)  # Re* at which lines are drawn; axes cut them
AIR_STYLES = dict(zip(curves.AIR, ("-.", "--", (0, (1, 1))), strict=True))
SLOPED = "Shao & Lu 2000"
"""The curve for air that is drawn for sloping beds: three for each slope would hide the rest."""
RESULT = ("closed form", "points", "points, not usable")  # marks of artists
NAME = "shields"
TOLD = ("alpha_deg", "d_m", "z0_over_d", "force_law")  # columns that a point tells of its scene
FEW = 8  # piles of which every fraction is drawn in the one diagram
LINES = 3  # laws beyond which only those near the measurements are drawn
SHOWN = ("alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "force_law")
"""Columns that figures, panels, axes, colours and markers tell apart."""
SERIES = ("nu_m2_s", "force_law", "regime", SHAPE)  # columns in which piles agree that a line joins
GAP = np.full((1, 2), np.nan)
AXES = labels.RE_AXIS, labels.TAU_AXIS
DEM = ("reynolds", "shields_dem", "shields_dem_low", "shields_dem_high")
PILE = ("reynolds", "shields", "shields_low", "shields_high")


class Sheet(NamedTuple):
    """Endings of a figure's name and title, rows of each panel and of all; `panels` makes it."""

    name: str
    title: str
    parts: list[pd.DataFrame]
    rows: pd.DataFrame
    panels: Callable[[], tuple[Canvas, list[Axes]]]


def sheets(
    rows: pd.DataFrame, keys: list[str], height: float, x: str, y: str, **layout: Any
) -> Iterator[Sheet]:
    """Figures of panels by some columns, those of the most scenes first; labels of the axes."""
    panels = [part for _, part in split(rows, *keys)]
    order = sorted(range(len(panels)), key=lambda i: (-panels[i]["scene_id"].nunique(), i))
    for name, title, chosen in style.pages(order):
        parts = [panels[i] for i in sorted(chosen)]
        tall = height * (1.3 if len(parts) == 1 else 1.0)
        titles = [labels.panel(part.iloc[0], keys) for part in parts]
        made = cache(partial(style.grid, titles, tall, x, y, **layout))
        yield Sheet(name, title, parts, pd.concat(parts), made)


def parted(table: pd.DataFrame, *shown: str) -> tuple[list[str], pd.DataFrame]:
    """How rows are told apart that agree in all columns that are shown.

    Returns the columns that part panels, which are those of what is asked, and the table with a
    marker and its label for each force law and each combination of how scenes are answered.
    """
    columns = labels.varying(table, *shown)
    panels = [column for column in columns if fields.COLUMNS[column].info.about == "question"]
    looks = [column for column in columns if column not in panels]
    while looks and table.groupby([*looks, "force_law"], dropna=False).ngroups > len(SHAPES):
        panels.append(looks.pop(0))
    # without variants a law has the same marker in all figures
    shape = table["force_law"].map(list(LAWS).index)
    if looks:
        shape = table.groupby([*looks, "force_law"], dropna=False).ngroup()
    names = {}
    for number, group in table.groupby(shape):
        law = labels.value("force_law", group["force_law"].iloc[0])
        told = (labels.methods(group), law, *labels.told(group.iloc[0], looks))
        names[number] = ", ".join(dict.fromkeys(told))
    added = {SHAPE: shape.map(dict(enumerate(SHAPES))), LABEL: shape.map(names)}
    return panels, table.assign(**added)


def about(rows: pd.DataFrame) -> dict[str, Any]:
    """The values of the captions of a figure that follow from its rows."""
    if rows.empty:
        return {}
    dem = rows["answered_method"] == "dem"

    def used(column: str, scale: float = 1.0) -> str:
        values = sorted(set(rows.loc[dem, f"answered_{column}"] * scale))
        return ", ".join(f"{value:.6g}" for value in values)

    drawn, others = theory.drawn(rows["force_law"]), labels.methods(rows[~dem])
    return {
        "laws": "; ".join(labels.value("force_law", name) for name in drawn),
        "pair": theory.PAIR[0] in drawn,
        "hollow": not valid(rows).all(),
        "viscosities": rows["nu_m2_s"].nunique(),
        **{"methods": labels.methods(rows), "others": others, "dem": dem.any()},
        **{"increment": used("load_increment", 100.0), "waiting": used("waiting_time")},
        "criterion": used("displacement_criterion"),
        # of the lines beside them
        "air": ", ".join(theory.air_lines(rows)),
        "wet": not theory.in_gas(rows).all(),
        "sloped": SLOPED if (rows["alpha_deg"] > 0).any() else "",
        "curves": "; ".join(curve.name for curve in curves.WATER),
        **{"measured": MEASURED_SOURCE, "bagnold_from": f"{theory.BAGNOLD_FROM:g}"},
    }


def ends(scenes: pd.DataFrame, *drawn: pd.DataFrame) -> tuple[float, float]:
    """Ends of an axis of Re* around the single grains of some scenes and rows that are drawn."""
    shown = (rows["reynolds"] for rows in drawn if len(rows))
    reach = np.concatenate([theory.span(scenes), *shown])
    return float(reach.min()) / 2, float(reach.max()) * 2


def prepare(sheet: Sheet, xlim: tuple[float, float]) -> None:
    """Logarithmic axes over a range of Re* and all lines in it; call it when all is drawn."""
    shown = [line for ax in sheet.panels()[1] for line in ax.lines if line.get_gid() != "intervals"]
    x, tau = np.concatenate([np.asarray(line.get_xydata(), float) for line in shown]).T
    tau = tau[(x >= xlim[0]) & (x <= xlim[1]) & (tau > 0)]
    for ax, rows in zip(sheet.panels()[1], sheet.parts, strict=True):
        ax.set(xscale="log", yscale="log", xlim=xlim, ylim=(tau.min() / 1.6, tau.max() * 2.2))
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
        shade_transition(ax, rows)


def shade_transition(ax: Axes, rows: pd.DataFrame) -> None:
    """Shade where neither law of the paper holds, if some rows have them and the axes show it."""
    (_, left), (right, _) = (LAWS[name].reynolds for name in theory.PAIR)
    low, high = ax.get_xlim()
    left, right = max(left, low), min(right, high)
    if left < right and rows["force_law"].isin(theory.PAIR).any():
        ax.axvspan(left, right, color="0.93", zorder=0, gid="transition")
        if right > 1.5 * left:
            centre: Look = {"ha": "center", "va": "top", "transform": ax.get_xaxis_transform()}
            ax.text(float(np.sqrt(left * right)), 0.97, "transition", **centre, **style.NOTE)
    ax.set_xlim(low, high)


def draw_line(
    ax: Axes, line: Line, label: str, colour: str, dash: theory.Dash, width: float = 1.1
) -> None:
    """A closed-form line, dotted where its law does not hold but the study has grains."""
    tau, holds = line.tau(REYNOLDS), line.holds(REYNOLDS)
    dotted = line.near(REYNOLDS) & ~holds, ":", "dotted: the force law does not hold"
    for chosen, style_, name in ((holds, dash, label), dotted):
        if chosen.any():
            look: Look = {"color": colour, "lw": width, "ls": style_, "label": name}
            ax.plot(*np.where(chosen, (REYNOLDS, tau), np.nan), gid=RESULT[0], **look)


def draw_points(
    ax: Axes, rows: pd.DataFrame, colour: str, columns: Sequence[str], size: float = 4.2
) -> list[tuple[Line2D, BoolArray]]:
    """Intervals and the rows' own markers, by the columns of x, y and its ends.

    Hollow where a threshold is not usable. Returns which rows each group of markers shows.
    """
    x, y, low, high = (rows[column].to_numpy(float) for column in columns)
    # as one line with gaps: bars and caps by themselves take three times as long
    ends = np.column_stack([low, high, np.full_like(low, np.nan)]).ravel()
    look: Look = {"color": colour, "lw": 0.8, "solid_capstyle": "butt", "gid": "intervals"}
    look |= {"marker": "_", "ms": size + 0.8, "mew": 0.7, "alpha": 0.5}
    ax.plot(np.repeat(x, 3), ends, zorder=2.5, **look)
    drawn, usable, shape = [], valid(rows).to_numpy(), rows[SHAPE].to_numpy(str)
    for marker, label in sorted(set(zip(rows[SHAPE], rows[LABEL], strict=True))):
        for solid in (True, False):
            at = (shape == marker) & (usable == solid)
            look = {"ls": "", "marker": marker, "ms": size, "color": colour, "mew": 0.8}
            told: Look = {"gid": RESULT[2], "label": "hollow: not usable, see why_not"}
            look |= {"gid": RESULT[1], "label": label} if solid else {**told, "mfc": "white"}
            if solid or at.any():
                drawn.append((ax.plot(x[at], y[at], zorder=3, **look)[0], at))
    return drawn


def draw_published(
    ax: Axes, scenes: pd.DataFrame, xlim: tuple[float, float], colours: Any = None
) -> None:
    """Curves for air, and unless the bed slopes in a gas those and measurements for water.

    Measurements are drawn whose median is within some ends of the axis. On slopes one curve for air
    is drawn, times the slope factor, in the colours of the slopes.
    """
    sloped = bool((scenes["alpha_deg"] > 0).any())
    for alpha in sorted(set(scenes["alpha_deg"])):
        for name, points in theory.air_lines(scenes, alpha).items():
            if name == SLOPED or not sloped:
                label = f"air: {name}" + " × slope factor" * sloped
                colour = colours[alpha] if colours else style.AIR
                look: Look = {"color": colour, "ls": AIR_STYLES[name], "lw": 0.8, "zorder": 1.5}
                ax.plot(*points, label=label, **look)
    if sloped and theory.in_gas(scenes).all():
        return
    lines = [part for item in curves.WATER for part in (np.column_stack(item.points()), GAP)]
    look = {"color": style.WATER, "lw": 0.7, "zorder": 1, "label": "water: published curves"}
    ax.plot(*np.concatenate(lines).T, **look)
    bins = [item for item in BINS if xlim[0] < item.middle < xlim[1]]
    x, y = np.array([(item.middle, item.median) for item in bins]).reshape(-1, 2).T
    look = {"color": "black", "lw": 0.7, "zorder": 2.2}
    ax.vlines(x, [item.tenth for item in bins], [item.ninetieth for item in bins], **look)
    ax.hlines(y, [item.low for item in bins], [item.high for item in bins], **look)
    ax.plot(x, y, "s", ms=3.5, label="measured in water: median, 10 to 90 %", **look)


def legends(sheet: Sheet, column: str, colours: Mapping[Any, str]) -> Canvas:
    """Legends of the colours of a column above the panels, of all labels below them; the figure."""
    canvas, axes = sheet.panels()
    used = set(sheet.rows[column])
    top = [style.entry(labels.plain(column, v), c) for v, c in colours.items() if v in used]
    style.legends(canvas, top, style.samples(axes))
    return canvas


def single_grains(results: Results) -> pd.DataFrame:
    """Single grains under a held flow, with the thresholds of those that moved in DEM.

    Ramps of the flow are left out: they give no threshold.
    """
    scenes, answers = results.beds("grain"), results.joined("single_grain")
    if answers.empty:
        answers = pd.DataFrame(columns=["scene_id", *DEM, "ustar_m_s", "usable"])
    extra = [column for column in answers if column not in scenes or column == "scene_id"]
    return scenes[held(scenes)].merge(answers[extra], how="left", on="scene_id")


def draw(results: Results) -> Iterator[Figure]:
    """The one diagram of a study: its piles, single grains, laws and measurements in one frame."""
    piles, grains, lines = shown_piles(results), single_grains(results), _lines(results)
    # of single grains those on the least slope
    grains = grains[drawable(grains, "reynolds", "shields_dem")]
    grains = grains[grains["alpha_deg"] == grains["alpha_deg"].min()]
    if not lines and piles.empty and grains.empty:
        return
    scenes = results.scenes
    sheet = Sheet("", "", [scenes], scenes, cache(partial(style.grid, [""], 3.5, *AXES)))
    (ax,) = sheet.panels()[1]
    xlim = ends(scenes, piles, grains)
    draw_published(ax, scenes.assign(alpha_deg=0.0), xlim)
    shades: dict[Any, str] = style.palette("alpha_deg", results.values("alpha_deg"))
    points: dict[str, list[list[str]]] = {}
    kinds = ((grains, "single grain", DEM, "o", 2.4), (piles, "bed", PILE, "s", 3.6))
    for rows, name, columns, shape, size in kinds:
        if rows.empty:
            continue
        telling = [*TOLD, *(labels.varying(rows, *TOLD, *({"fraction"} & set(rows))))]
        if "fraction" in rows:
            shares = sorted(set(100 * rows["fraction"]))
            name += f" at n/N = {', '.join(f'{share:g}' for share in shares)} %"
        for (alpha,), part in split(rows, "alpha_deg"):
            label = f"{name}, {labels.plain('alpha_deg', alpha)}"
            marked = part.assign(**{SHAPE: shape, LABEL: label})
            for line, drawn in draw_points(ax, marked, shades[alpha], columns, size):
                line.set_gid(f"{NAME}-{len(points)}")  # by which the page's script finds the points
                texts = [_texts(row, columns, telling) for _, row in marked[drawn].iterrows()]
                points[f"{NAME}-{len(points)}"] = texts
    for at, closed in enumerate(lines):
        # a law on another bed has a thinner line
        width = 1.4 / (1 + [item.law for item in lines[:at]].count(closed.law))
        draw_line(ax, closed, closed.name, *theory.look(closed.law), width)
    prepare(sheet, xlim)
    canvas = legends(sheet, "alpha_deg", {})
    text = caption(
        "overview",
        piles=about(piles),
        grains=about(grains),
        fractions=", ".join(f"{f:.0%}" for f in sorted(set(piles.get("fraction", [])))),
        names="; ".join(line.name for line in lines),
        about={**about(scenes), "sloped": ""},
    )
    cases = case_names(piles, grains)
    title = "Extended Shields diagram"
    yield Figure(NAME, title, text, cases, canvas, data=points, leads=True)


def shown_piles(results: Results) -> pd.DataFrame:
    """The thresholds of piles that are drawn: of many piles at one fraction."""
    rows = results.joined("pile_threshold")
    if rows.empty:
        return rows
    rows = results.at_fraction if rows["scene_id"].nunique() > FEW else rows
    return rows[drawable(rows, "reynolds", "shields")]


def _lines(results: Results) -> list[Line]:
    """The closed form on a flat bed: the laws of piles on their least and largest z0/d.

    Other laws have one line, on the bed that fits the measurements best; the two laws of the paper
    are one model, on one bed.
    """
    flat = theory.lines(results.beds("pile").assign(alpha_deg=0.0))
    beds = [line.bed for line in flat]
    lines = [line for line in flat if line.bed in (beds[0], beds[-1])]
    drawn = {line.law for line in lines}
    others = [line for line in theory.best(theory.ranked(results)) if line.law not in drawn]
    near = [line for line in others if line.decades > 0] if len(others) > LINES else []
    pair = next((line.bed for line in others if line.law in theory.PAIR), None)
    for line in near or others:
        lines.append(replace(line, bed=pair) if pair and line.law in theory.PAIR else line)
    return lines


def _texts(row: pd.Series, columns: Sequence[str], telling: Sequence[str]) -> list[str]:
    """What the page says of a point: its scene, its threshold, why it is not usable, its case."""
    value, low, high = (row[name] for name in columns[1:])
    interval = f" ({low:.4g} … {high:.4g})" if pd.notna(low) else ""
    ustar = row["ustar0_m_s"] if "ustar0_m_s" in row else row["ustar_m_s"]
    where = f" at n/N = {row['fraction']:.0%}" if "fraction" in row else ""
    threshold = f"τ_c = {value:.4g}{interval}{where}, u*₀ = {ustar:.3g} m/s"
    case = row["case"] if isinstance(row["case"], str) else ""
    return [", ".join(labels.told(row, telling)), threshold, str(row["why_not"]), case]


def singles(results: Results) -> Iterator[Figure]:
    """Figs. 5 to 8: on a flat bed by entrainment angle, or by law if there are many; on slopes."""
    grains = single_grains(results)
    flat = grains[grains["alpha_deg"] == 0]
    colours: dict[Any, str] = style.palette("beta_deg", results.values("beta_deg"))
    dem = bool(grains["shields_dem"].notna().any())
    kind, ending = "dem" if dem else "closed-form", ": closed form" + " and DEM" * dem
    if len(set(theory.dashes(flat["force_law"]).values())) > theory.MANY:
        colours = {name: theory.look(name)[0] for name in theory.drawn(flat["force_law"])}
        for (ratio,), group in split(flat, "z0_over_d"):
            written = labels.ratio_of(float(str(ratio)), "d")
            title = f"Force laws on a horizontal bed, z₀ = {written}"
            yield from _diagrams(group, "force_law", colours, f"shields-{written}", title)
    elif len(flat):
        title = f"One grain on a horizontal bed{ending}"
        yield from _diagrams(flat, "beta_deg", colours, f"{kind}-horizontal", title)
    colours = style.palette("alpha_deg", results.values("alpha_deg"))
    for (beta,), group in split(grains, "beta_deg"):
        if (group["alpha_deg"] > 0).any():
            title = f"One grain on a slope, β = {beta:g}°{ending}"
            yield from _diagrams(group, "alpha_deg", colours, f"{kind}-slope-beta{beta:g}", title)


def piles(results: Results) -> Iterator[Figure]:
    """Figs. 15 and 16, the extended Shields diagram by slope, figures for each z0/d."""
    every = results.joined("pile_threshold")
    reached = every[drawable(every, "reynolds", "shields")] if len(every) else every
    colours = style.palette("fraction", sorted(set(reached["fraction"]))) if len(reached) else {}
    for (ratio,), rows in split(reached, "z0_over_d"):
        written = labels.ratio_of(float(str(ratio)), "d")
        name, title = f"extended-shields-{written}", f"Thresholds of beds by slope, z₀ = {written}"
        for figure in _diagrams(rows, "fraction", colours, name, title):
            # the one diagram shows all of few piles on one slope
            same = reached["alpha_deg"].nunique() == 1 and every["scene_id"].nunique() <= FEW
            fold = figure.fold or same or ratio != reached["z0_over_d"].min()
            yield replace(figure, fold=fold)


def _diagrams(
    rows: pd.DataFrame, by: str, colours: Mapping[Any, str], name: str, title: str
) -> Iterator[Figure]:
    """Single grains with or without thresholds by DEM, or piles, beside the closed form."""
    piles, by_law = by == "fraction", by == "force_law"
    columns = PILE if piles else DEM
    every = rows[rows[columns[1]].notna()]
    # the closed form depends on nothing else that a panel does not show
    choices, every = parted(every, *SHOWN, "fraction" if piles else "beta_deg")
    keys = [{"fraction": "alpha_deg", "force_law": "beta_deg"}.get(by, "z0_over_d"), *choices]
    # to part a hundred columns takes long
    narrow = [*dict.fromkeys((*SHOWN, *columns, by, "regime", "usable", SHAPE, LABEL))]

    def draw(sheet: Sheet, shown: pd.DataFrame) -> Canvas:
        dashes, xlim = theory.dashes(sheet.rows["force_law"]), ends(sheet.rows, shown)
        for ax, part in zip(sheet.panels()[1], sheet.parts, strict=True):
            draw_published(ax, part, xlim, colours if by == "alpha_deg" else None)
            for line in theory.lines(part):
                label, look = labels.value("force_law", line.law), theory.look(line.law)
                if not by_law:
                    label = "Eqs. 3, 5" if line.law in theory.PAIR else label
                    shade = colours.get(dict(zip(theory.BED, line.bed, strict=True)).get(by), "0.2")
                    look = shade, dashes[line.law]
                draw_line(ax, line, f"closed form: {label}", *look)
            here = shown.loc[shown["scene_id"].isin(part["scene_id"]), narrow]
            for (value,), group in split(here, by):
                # piles that differ in more than d are a scatter, not a line
                joined = [
                    np.vstack([series.sort_values("reynolds")[["reynolds", "shields"]], GAP])
                    for _, series in split(group if piles else here[:0], *SERIES)
                    if series["d_m"].is_unique
                ]
                if joined:
                    ax.plot(*np.concatenate(joined).T, color=colours[value], lw=0.6, zorder=2)
                draw_points(ax, group, colours[value], columns)
        prepare(sheet, xlim)
        return legends(sheet, by, {} if by_law else colours)

    for sheet in sheets(rows, keys, 2.5, *AXES):
        shown = every[every["scene_id"].isin(sheet.rows["scene_id"])]
        stem, fold = name.replace("/", "").replace(" ", ""), bool(sheet.name) or by == "alpha_deg"
        text = caption("diagram", by=by, about=about(sheet.rows), answers=about(shown))
        names = stem + sheet.name, title + sheet.title
        drawing = partial(draw, sheet, shown)
        yield Figure(*names, text, case_names(shown), drawing, fold=fold)


def accuracy(results: Results) -> Iterator[Figure]:
    """u* of DEM over that of the closed form, a panel for each increment of the load steps."""
    dem = single_grains(results)
    dem = dem[dem["ustar_m_s"].notna()]
    if dem.empty:
        return
    exact = dem["ustar_closed_form_m_s"]
    names = {"value": "ustar_m_s", "low": "ustar_low_m_s", "high": "ustar_high_m_s"}
    rows = dem.assign(**{name: dem[column] / exact for name, column in names.items()})
    choices, rows = parted(rows, *SHOWN, "beta_deg", "load_increment")
    colours: dict[Any, str] = style.palette("alpha_deg", results.values("alpha_deg"))
    axes = labels.RE_AXIS, "u* of DEM over closed form"
    keys = ["load_increment", *choices]

    def draw(sheet: Sheet) -> Canvas:
        for ax, part in zip(sheet.panels()[1], sheet.parts, strict=True):
            ax.axhline(1, color="0.3", lw=0.8, zorder=1)
            for (alpha,), group in split(part, "alpha_deg"):
                draw_points(ax, group, colours[alpha], ("reynolds", "value", "low", "high"))
            reach = 1.6 * float(np.nanmax(np.abs(part[["value", "low", "high"]] - 1)))
            ax.set(xscale="log", ylim=(1 - reach, 1 + reach))
        for ax in sheet.panels()[1]:
            style.plain_ticks(ax.xaxis)
            shade_transition(ax, rows)
        return legends(sheet, "alpha_deg", colours)

    for sheet in sheets(rows, keys, 2.1, *axes, columns=1, sharey=False):
        far, holds = (sheet.rows["value"] - 1).abs(), valid(sheet.rows)
        named = ((holds, "where its law holds"), (~holds, "where it does not"))
        deviations = ", ".join(f"{far[at].max():.2%} {where}" for at, where in named if at.any())
        text = caption("accuracy", about=about(sheet.rows), deviations=deviations)
        name, title = f"accuracy{sheet.name}", f"DEM over closed form{sheet.title}"
        drawing = partial(draw, sheet)
        yield Figure(name, title, text, case_names(sheet.rows), drawing, fold=True)
