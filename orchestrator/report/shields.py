"""Shields diagrams of a study, of single grains and of piles; DEM over closed form."""

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
from orchestrator.physics.beside import FIELD
from orchestrator.physics.fluids import ALIKE, NUMBERS_OF_PAPER
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import MEASURED_SOURCE
from orchestrator.report import labels, style, theory
from orchestrator.report.page import caption
from orchestrator.report.results import (
    Results,
    case_names,
    drawable,
    held,
    split,
    valid,
)
from orchestrator.report.style import Figure, Look
from orchestrator.report.theory import BINS, Line
from orchestrator.study import fields
from orchestrator.study.criterion import GOES_ON
from orchestrator.tables.facts import needs_run
from orchestrator.types import BoolArray, FloatArray

SHAPES = "os^DvP<X>p8hd*"
"""Markers, in the order in which rows take them."""
MOST_LOOKS = 7
"""Markers that a reader tells apart; what would need more is named beside them."""
SHAPE = "marker"
"""The column that holds a row's marker."""
LABEL = "label"
"""The column that holds the meaning of a row's marker."""
REYNOLDS = np.geomspace(1e-4, 1e6, 601)
"""Re* at which lines are drawn; the axes cut them."""
AIR_DASHES = ("-.", "--", (0, (1, 1)))
AIR_STYLES = dict(zip(curves.AIR, AIR_DASHES, strict=True))
SLOPED = "Shao & Lu 2000"
"""The curve for air of sloping beds: three for each slope would hide the rest."""
RESULT = ("closed form", "points", "points, not usable")
"""Names of artists: lines of the closed form, usable points, others."""
NAME = "shields"
TOLD = ("alpha_deg", "d_m", "z0_over_d", "force_law")
"""Columns that the text of a point always tells of its scene."""
FEW = 8
"""Number of piles up to which every fraction is drawn in the one diagram."""
LINES = 3
"""Number of laws beyond which only those near the measurements are drawn."""
SHOWN = ("alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "force_law")
"""Columns that figures, panels, axes, colours and markers tell apart."""
SERIES = ("nu_m2_s", "force_law", "regime", SHAPE)
"""Columns in which piles agree that a line joins."""
FIELD_REYNOLDS = (8.8, 13.5)
"""Re* of the sites of `FIELD`."""
GOING_DASH = (0, (7, 1.2, 1.5, 1.2))
"""Dash of the curves of grains that go on."""
DOTTED = "dotted: the force law does not hold"
"""Label of the part of a curve that is dotted."""
GAP = np.full((1, 2), np.nan)
"""A point that interrupts a line."""
BEYOND = 1e6
"""A place above every frame, over the lower end of a bar."""
AXES = labels.RE_AXIS, labels.TAU_AXIS
DEM = ("reynolds", "shields_dem", "shields_low", "shields_high")
"""Columns of a single grain: x, y and the ends of its interval."""
PILE = ("reynolds", "shields", "shields_low", "shields_high")
"""Columns of a pile: x, y and the ends of its interval."""


class Sheet(NamedTuple):
    """Panels of one figure, and the rows that they show.

    Attributes
    ----------
    name, title
        Endings of the figure's name and of its title.
    parts
        Rows of each panel.
    rows
        Rows of all panels.
    panels
        Makes the figure and its panels, once.
    """

    name: str
    title: str
    parts: list[pd.DataFrame]
    rows: pd.DataFrame
    panels: Callable[[], tuple[Canvas, list[Axes]]]


def sheets(
    rows: pd.DataFrame, keys: list[str], height: float, x: str, y: str, **layout: Any
) -> Iterator[Sheet]:
    """Figures of panels by some columns, those of the most scenes first.

    Parameters
    ----------
    rows
        Rows with the columns ``scene_id`` and those of `keys`.
    keys
        Columns in which the rows of a panel agree.
    height
        Height of a panel, inches.
    x, y
        Labels of the axes.
    **layout
        Further arguments of `style.grid`.

    Yields
    ------
    Sheet
        One for each figure.
    """
    panels = [part for _, part in split(rows, *keys)]

    def most_scenes_first(number: int) -> tuple[int, int]:
        return -panels[number]["scene_id"].nunique(), number

    order = sorted(range(len(panels)), key=most_scenes_first)
    for name, title, chosen in style.pages(order):
        parts = [panels[number] for number in sorted(chosen)]
        is_alone = len(parts) == 1
        tall = 1.3 * height if is_alone else height
        titles = [labels.panel(part.iloc[0], keys) for part in parts]
        made = cache(partial(style.grid, titles, tall, x, y, **layout))
        yield Sheet(name, title, parts, pd.concat(parts), made)


def parted(table: pd.DataFrame, *shown: str) -> tuple[list[str], pd.DataFrame]:
    """Tell rows apart that agree in all columns that are shown.

    Parameters
    ----------
    table
        The rows.
    *shown
        Columns that a figure shows.

    Returns
    -------
    panels : list of str
        The columns that part panels: those of what is asked.
    rows : pandas.DataFrame
        The table with a marker and its label for each force law and each combination
        of how scenes are answered. At more than `MOST_LOOKS` of these the last fields
        have no markers; the labels name those that differ.
    """
    columns = labels.varying(table, *shown)
    panels = [name for name in columns if name in fields.OF_QUESTION]
    looks = [name for name in columns if name not in panels]
    while looks and _combinations(table, looks).ngroups > len(SHAPES):
        panels.append(looks.pop(0))
    together = []
    while looks and _combinations(table, looks).ngroups > MOST_LOOKS:
        together.append(looks.pop())
    if looks:
        shape = _combinations(table, looks).ngroup()
    else:
        # without variants a law has the same marker in all figures
        shape = table["force_law"].map(list(LAWS).index)
    names = {}
    for number, group in table.groupby(shape):
        law = labels.value("force_law", group["force_law"].iloc[0])
        told = [labels.methods(group), law, *labels.told(group.iloc[0], looks)]
        told += [f"several {_name_of(one)}" for one in together if _differs(group[one])]
        names[number] = ", ".join(dict.fromkeys(told))
    markers = dict(enumerate(SHAPES))
    added = {SHAPE: shape.map(markers), LABEL: shape.map(names)}
    return panels, table.assign(**added)


def _differs(column: pd.Series) -> bool:
    """Whether a column has more than one value."""
    return column.nunique(dropna=False) > 1


def _name_of(column: str) -> str:
    """The symbol of a column, or its label where it has none."""
    info = labels.words(column)
    return info.symbol or info.label


def _combinations(table: pd.DataFrame, looks: list[str]) -> Any:
    """The rows of a table by some columns and by the force law."""
    return table.groupby([*looks, "force_law"], dropna=False)


def about(rows: pd.DataFrame) -> dict[str, Any]:
    """Find what the caption of a figure says of its rows.

    Parameters
    ----------
    rows
        The rows.

    Returns
    -------
    dict
        Values for the macros of ``captions.j2``; empty without rows.
    """
    if rows.empty:
        return {}
    is_run = needs_run(rows)

    def used(column: str, scale: float = 1.0) -> str:
        values = rows.loc[is_run, column] * scale
        return ", ".join(f"{value:.6g}" for value in sorted(set(values)))

    drawn = theory.drawn(rows["force_law"])
    is_sloped = bool((rows["alpha_deg"] > 0).any())
    of_the_points = {
        "laws": "; ".join(labels.value("force_law", name) for name in drawn),
        "pair": theory.PAIR[0] in drawn,
        "hollow": not valid(rows).all(),
        "viscosities": rows["nu_m2_s"].nunique(),
        "methods": labels.methods(rows),
        "others": labels.methods(rows[~is_run]),
        "dem": is_run.any(),
        "increment": used("load_increment", 100.0),
        "waiting": used("waiting_time"),
        "criterion": used("displacement_criterion"),
    }
    of_the_lines = {
        "air": ", ".join(theory.air_lines(rows)),
        "wet": not theory.in_gas(rows).all(),
        "sloped": SLOPED if is_sloped else "",
        "curves": "; ".join(curve.name for curve in curves.WATER),
        "measured": MEASURED_SOURCE,
        "bagnold_from": f"{theory.BAGNOLD_FROM:g}",
    }
    return of_the_points | of_the_lines


def ends(scenes: pd.DataFrame, *drawn: pd.DataFrame) -> tuple[float, float]:
    """Find the ends of an axis of Re*.

    Parameters
    ----------
    scenes
        Scenes, whose single grains it holds.
    *drawn
        Rows that are drawn on it.

    Returns
    -------
    low, high : float
        The ends.
    """
    shown = [rows["reynolds"] for rows in drawn if len(rows)]
    reach = np.concatenate([theory.span(scenes), *shown])
    return float(reach.min()) / 2, float(reach.max()) * 2


def prepare(sheet: Sheet, xlim: tuple[float, float]) -> None:
    """Set logarithmic axes over all lines in a range of Re*, when all is drawn.

    Parameters
    ----------
    sheet
        The panels.
    xlim
        The range.
    """
    _, axes = sheet.panels()
    x, tau = _points_of(axes)
    is_shown = (x >= xlim[0]) & (x <= xlim[1]) & (tau > 0)
    ylim = tau[is_shown].min() / 1.6, tau[is_shown].max() * 2.2
    for ax, rows in zip(axes, sheet.parts, strict=True):
        ax.set(xscale="log", yscale="log", xlim=xlim, ylim=ylim)
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
        shade_transition(ax, rows)


def _points_of(axes: Sequence[Axes]) -> Any:
    """The x and y of all lines of some panels, but for those of intervals."""
    found = []
    for ax in axes:
        for line in ax.lines:
            if line.get_gid() != "intervals":
                found.append(np.asarray(line.get_xydata(), float))
    return np.concatenate(found).T


def shade_transition(ax: Axes, rows: pd.DataFrame) -> None:
    """Shade where neither law of the paper holds, if some rows have them.

    Parameters
    ----------
    ax
        The panel, whose range of Re* is set.
    rows
        The rows that it shows.
    """
    low, high = ax.get_xlim()
    viscous, rough = (LAWS[name].reynolds for name in theory.PAIR)
    left = max(viscous[1], low)
    right = min(rough[0], high)
    if left < right and rows["force_law"].isin(theory.PAIR).any():
        ax.axvspan(left, right, color="0.93", zorder=0, gid="transition")
        has_room = right > 1.5 * left
        if has_room:
            middle = float(np.sqrt(left * right))
            across = ax.get_xaxis_transform()
            place: Look = {"ha": "center", "va": "top", "transform": across}
            ax.text(middle, 0.97, "transition", **place, **style.NOTE)
    ax.set_xlim(low, high)


def draw_line(
    ax: Axes,
    line: Line,
    label: str,
    colour: str,
    dash: theory.Dash,
    width: float = 1.1,
) -> None:
    """Draw a closed-form line, dotted where the study has grains beyond its law.

    Parameters
    ----------
    ax
        The panel.
    line
        The line.
    label
        Its entry in the legend.
    colour, dash
        Its look where the law holds.
    width
        Its width, points.
    """
    holds = line.holds(REYNOLDS)
    is_dotted = line.near(REYNOLDS) & ~holds
    points = np.array([REYNOLDS, line.tau(REYNOLDS)])
    look: Look = {"color": colour, "lw": width}
    _draw_curve(ax, points, {label: (holds, dash), DOTTED: (is_dotted, ":")}, look)


def _draw_curve(
    ax: Axes,
    points: FloatArray,
    parts: Mapping[str, tuple[BoolArray, theory.Dash]],
    look: Look,
) -> None:
    """The parts of a curve, each where it is chosen and with its dash, by its label."""
    for label, (chosen, dash) in parts.items():
        if chosen.any():
            shown = np.where(chosen, points, np.nan)
            ax.plot(*shown, gid=RESULT[0], ls=dash, label=label, **look)


def draw_points(
    ax: Axes,
    rows: pd.DataFrame,
    colour: str,
    columns: Sequence[str],
    size: float = 4.2,
) -> list[tuple[Line2D, BoolArray]]:
    """Intervals and the rows' own markers, hollow where a threshold is not usable.

    Parameters
    ----------
    ax
        The panel.
    rows
        Rows with the columns `SHAPE` and `LABEL`.
    colour
        Colour of all markers.
    columns
        Columns of x, of y and of both ends of its interval.
    size
        Size of a marker, points.

    Returns
    -------
    list of (line, mask)
        Each group of markers, and which rows it shows.
    """
    x, y, low, high = (rows[column].to_numpy(float) for column in columns)
    _draw_intervals(ax, x, low, high, colour, size)
    usable = valid(rows).to_numpy()
    shape = rows[SHAPE].to_numpy(str)
    drawn = []
    for marker, label in sorted(set(zip(rows[SHAPE], rows[LABEL], strict=True))):
        look: Look = {
            "ls": "",
            "marker": marker,
            "ms": size,
            "color": colour,
            "mew": 0.8,
        }
        solid = (shape == marker) & usable
        (line,) = ax.plot(
            x[solid], y[solid], zorder=3, gid=RESULT[1], label=label, **look
        )
        drawn.append((line, solid))
        hollow = (shape == marker) & ~usable
        if hollow.any():
            look |= {"gid": RESULT[2], "mfc": "white"}
            look |= {"label": "hollow: not usable, see why_not"}
            (line,) = ax.plot(x[hollow], y[hollow], zorder=3, **look)
            drawn.append((line, hollow))
    return drawn


def _draw_intervals(
    ax: Axes, x: Any, low: Any, high: Any, colour: str, size: float
) -> None:
    """Bars with caps, as one line with gaps: singly they take three times as long.

    A bar without an upper end leaves the frame.
    """
    high = np.where(np.isnan(high), BEYOND * low, high)
    ends = np.column_stack([low, high, np.full_like(low, np.nan)]).ravel()
    bar: Look = {"color": colour, "lw": 0.8, "solid_capstyle": "butt", "alpha": 0.5}
    caps: Look = {"marker": "_", "ms": size + 0.8, "mew": 0.7}
    ax.plot(np.repeat(x, 3), ends, zorder=2.5, gid="intervals", **bar, **caps)


def draw_published(
    ax: Axes, scenes: pd.DataFrame, xlim: tuple[float, float], colours: Any = None
) -> None:
    """Draw published curves: for air, and those and measurements for water.

    On slopes one curve for air is drawn, times the slope factor, in the colours of the
    slopes; of beds that slope in a gas nothing for water is.

    Parameters
    ----------
    ax
        The panel.
    scenes
        The scenes that it shows.
    xlim
        The range of Re*.
    colours
        Colours by slope.
    """
    is_sloped = bool((scenes["alpha_deg"] > 0).any())
    for alpha in sorted(set(scenes["alpha_deg"])):
        for name, points in theory.air_lines(scenes, alpha).items():
            if is_sloped and name != SLOPED:
                continue
            # the caption names the curves, in the order of their dashes
            label = (
                f"air: {name} × slope factor" if is_sloped else "air: published curves"
            )
            colour = colours[alpha] if colours else style.AIR
            look: Look = {"color": colour, "ls": AIR_STYLES[name], "lw": 0.8}
            ax.plot(*points, label=label, zorder=1.5, **look)
    is_air = theory.in_gas(scenes).all()
    densities = scenes["rho_f_kg_m3"]
    is_of_paper = np.isclose(densities, NUMBERS_OF_PAPER[0], rtol=ALIKE, atol=0).any()
    if is_air and not is_sloped:
        _draw_field(ax, xlim)
    # the paper sets its own gas beside water
    if not is_air or (is_of_paper and not is_sloped):
        _draw_water(ax, xlim)


def _draw_field(ax: Axes, xlim: tuple[float, float]) -> None:
    """Shields numbers of the sites in the field, over the Re* that they have."""
    low, high = FIELD_REYNOLDS
    if high < xlim[0] or low > xlim[1]:
        return
    look: Look = {"color": "black", "lw": 1.6, "zorder": 2.2}
    label = f"air: measured at {len(FIELD)} sites in the field"
    gaps = [(low, theta, high, theta, np.nan, np.nan) for theta in FIELD]
    points = np.array(gaps).reshape(-1, 2)
    ax.plot(*points.T, gid="field", label=label, **look)


def _draw_water(ax: Axes, xlim: tuple[float, float]) -> None:
    """Published curves for water, and the measurements with medians within two ends."""
    lines = []
    for curve in curves.WATER:
        lines += [np.column_stack(curve.points()), GAP]
    thin: Look = {"color": style.WATER, "lw": 0.7, "zorder": 1}
    ax.plot(*np.concatenate(lines).T, label="water: published curves", **thin)
    bins = [item for item in BINS if xlim[0] < item.middle < xlim[1]]
    x = np.array([item.middle for item in bins])
    y = np.array([item.median for item in bins])
    dark: Look = {"color": "black", "lw": 0.7, "zorder": 2.2}
    tenths = [item.tenth for item in bins]
    ninetieths = [item.ninetieth for item in bins]
    ax.vlines(x, tenths, ninetieths, **dark)
    ax.hlines(y, [item.low for item in bins], [item.high for item in bins], **dark)
    ax.plot(x, y, "s", ms=3.5, label="measured in water: median, 10 to 90 %", **dark)


def legends(sheet: Sheet, column: str, colours: Mapping[Any, str]) -> Canvas:
    """Write legends: of colours above the panels, of all labels below them.

    Parameters
    ----------
    sheet
        The panels.
    column
        The column that colours tell apart.
    colours
        Colours by its values.

    Returns
    -------
    Figure
        The figure.
    """
    canvas, axes = sheet.panels()
    used = set(sheet.rows[column])
    top = []
    for value, colour in colours.items():
        if value in used:
            top.append(style.entry(labels.plain(column, value), colour))
    style.legends(canvas, top, style.samples(axes))
    return canvas


def single_grains(results: Results) -> pd.DataFrame:
    """List the single grains under a held flow.

    Grains under a ramp of the flow are left out: a ramp gives no threshold.

    Parameters
    ----------
    results
        The study.

    Returns
    -------
    DataFrame
        Their scenes, with the thresholds of those that moved in DEM.
    """
    scenes = results.beds("grain")
    answers = results.joined("single_grain")
    if answers.empty:
        answers = pd.DataFrame(columns=["scene_id", *DEM, "ustar_m_s", "usable"])
    own = ("scene_id", "criterion")
    extra = [name for name in answers if name not in scenes or name in own]
    scenes = scenes[held(scenes)].drop(columns="criterion", errors="ignore")
    return scenes.merge(answers[extra], how="left", on="scene_id")


def draw(results: Results) -> Iterator[Figure]:
    """Draw the one diagram of a study: piles, single grains, laws and measurements.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        One figure, or none.
    """
    piles = shown_piles(results)
    grains = _grains_on_the_least_slope(results)
    lines = _lines(results)
    if not lines and piles.empty and grains.empty:
        return
    scenes = results.scenes
    panels = cache(partial(style.grid, [""], 3.5, *AXES))
    sheet = Sheet("", "", [scenes], scenes, panels)
    canvas, (ax,) = panels()
    xlim = ends(scenes, piles, grains)
    draw_published(ax, scenes.assign(alpha_deg=0.0), xlim)
    points = _draw_answers(ax, grains, piles, results)
    names = _draw_lines(ax, lines, pd.concat([grains, piles]))
    prepare(sheet, xlim)
    _overview_legends(canvas, ax)
    text = caption(
        "overview",
        piles=about(piles),
        grains=about(grains),
        fractions=", ".join(f"{fraction:.0%}" for fraction in _fractions(piles)),
        names="; ".join(names),
        about={**about(scenes), "sloped": ""},
    )
    title = "Extended Shields diagram"
    yield Figure(
        NAME,
        title,
        text,
        case_names(piles, grains),
        canvas,
        data=points,
        leads=True,
        tables=_tables(piles, grains),
    )


def _tables(piles: pd.DataFrame, grains: pd.DataFrame) -> tuple[str, ...]:
    """The tables of the rows that are drawn."""
    rows = {"pile_threshold": piles, "single_grain": grains}
    return tuple(name for name, drawn in rows.items() if len(drawn))


def _fractions(piles: pd.DataFrame) -> list[float]:
    """The fractions of piles, rising."""
    return sorted(set(piles.get("fraction", [])))


def _draw_answers(
    ax: Axes, grains: pd.DataFrame, piles: pd.DataFrame, results: Results
) -> dict[str, list[list[str]]]:
    """The points of single grains and of piles, and what the page says of each."""
    shades = style.palette("alpha_deg", results.values("alpha_deg"))
    points = _draw_kind(ax, grains, "single grain", DEM, "o", 2.4, shades, 0)
    percents = ", ".join(f"{100 * fraction:g}" for fraction in _fractions(piles))
    name = f"bed at n/N = {percents} %"
    return points | _draw_kind(ax, piles, name, PILE, "s", 3.6, shades, len(points))


def _overview_legends(canvas: Canvas, ax: Axes) -> None:
    """Legends of the laws above the one diagram, of all else below it."""
    samples = style.samples([ax])
    of_laws = [one for one in samples if one.get_gid() == RESULT[0]]
    others = [one for one in samples if one.get_gid() != RESULT[0]]
    style.legends(canvas, of_laws, others)


def _draw_lines(ax: Axes, lines: Sequence[Line], answers: pd.DataFrame) -> list[str]:
    """The curves of what is answered, by its criteria; their names.

    Where no curve of grains that go on is known, that of their pockets stands there.
    """
    names = []
    going: list[theory.Going] = []
    criteria = set(answers.get("criterion", []))
    if GOES_ON in criteria:
        going = theory.going_on(answers.assign(alpha_deg=0.0))
    for curve in going:
        _draw_going(ax, curve, curve.name, theory.look(curve.law)[0])
        names.append(curve.name)
    if going and criteria == {GOES_ON}:
        return names
    laws_so_far: list[str] = []
    for line in lines:
        # a law on another bed has a thinner line
        width = 1.4 / (1 + laws_so_far.count(line.law))
        name = line.name
        if GOES_ON in criteria:
            name = f"{name}: {theory.LEAVING}"
        draw_line(ax, line, name, *theory.look(line.law), width)
        laws_so_far.append(line.law)
        names.append(name)
    return names


def _draw_going(ax: Axes, curve: theory.Going, label: str, colour: str) -> None:
    """A curve of grains that go on, dotted where its law does not hold."""
    points = np.array([curve.reynolds, curve.tau])
    parts = {label: (curve.holds, GOING_DASH), DOTTED: (~curve.holds, ":")}
    _draw_curve(ax, points, parts, {"color": colour, "lw": 1.6})


def _grains_on_the_least_slope(results: Results) -> pd.DataFrame:
    """The single grains of the one diagram."""
    grains = _few_exact(single_grains(results))
    grains = grains[drawable(grains, "reynolds", "shields_dem")]
    is_least: pd.Series[bool] = grains["alpha_deg"] == grains["alpha_deg"].min()
    return grains[is_least]


def _few_exact(grains: pd.DataFrame) -> pd.DataFrame:
    """Single grains, of which few that the closed form answered are points as well."""
    if grains.empty or len(grains) > FEW:
        return grains
    is_exact = ~needs_run(grains)
    exact = {
        "shields_dem": "shields_closed_form",
        "reynolds": "reynolds_closed_form",
        "ustar_m_s": "ustar_closed_form_m_s",
    }
    filled = {
        column: grains[column].where(~is_exact, grains[by])
        for column, by in exact.items()
    }
    return grains.assign(**filled)


def _draw_kind(
    ax: Axes,
    rows: pd.DataFrame,
    name: str,
    columns: Sequence[str],
    shape: str,
    size: float,
    shades: Mapping[Any, str],
    number: int,
) -> dict[str, list[list[str]]]:
    """Points of one kind, by slope; what the page says of each, by its group.

    `number` is that of the first group: the page's script finds points by these names.
    """
    texts: dict[str, list[list[str]]] = {}
    if rows.empty:
        return texts
    known = [*TOLD, "fraction"] if "fraction" in rows else [*TOLD]
    telling = [*TOLD, *labels.varying(rows, *known)]
    for (alpha,), part in split(rows, "alpha_deg"):
        label = f"{name}, {labels.plain('alpha_deg', alpha)}"
        marked = part.assign(**{SHAPE: shape, LABEL: label})
        for line, drawn in draw_points(ax, marked, shades[alpha], columns, size):
            group = f"{NAME}-{number + len(texts)}"
            line.set_gid(group)
            texts[group] = [
                _texts(row, columns, telling) for _, row in marked[drawn].iterrows()
            ]
    return texts


def shown_piles(results: Results) -> pd.DataFrame:
    """List the thresholds of piles that the one diagram shows.

    Parameters
    ----------
    results
        The study.

    Returns
    -------
    DataFrame
        The thresholds at all fractions of few piles, and at one fraction of many.
    """
    rows = results.joined("pile_threshold")
    if rows.empty:
        return rows
    if rows["scene_id"].nunique() > FEW:
        rows = results.at_fraction
    return rows[drawable(rows, "reynolds", "shields")]


def _lines(results: Results) -> list[Line]:
    """The closed form on a flat bed: the laws of piles on their least and largest z0/d.

    Other laws have one line, on the bed that fits the measurements best; the two laws
    of the paper are one model, on one bed.
    """
    flat = theory.lines(results.beds("pile").assign(alpha_deg=0.0))
    beds = [line.bed for line in flat]
    lines = [line for line in flat if line.bed in (beds[0], beds[-1])]
    drawn = {line.law for line in lines}
    others = [
        line for line in theory.best(theory.ranked(results)) if line.law not in drawn
    ]
    bed_of_pair = next((line.bed for line in others if line.law in theory.PAIR), None)
    near = [line for line in others if line.decades > 0]
    chosen = near if near and len(others) > LINES else others
    for line in chosen:
        if bed_of_pair and line.law in theory.PAIR:
            line = replace(line, bed=bed_of_pair)
        lines.append(line)
    return lines


def _texts(row: pd.Series, columns: Sequence[str], telling: Sequence[str]) -> list[str]:
    """What the page says of a point: scene, threshold, why it is not usable, case."""
    value, low, high = (row[name] for name in columns[1:])
    threshold = f"τ_c = {value:.4g}"
    if pd.notna(low) or pd.notna(high):
        threshold += f" ({labels.interval(low, high, 4, 'g')})"
    if "fraction" in row:
        threshold += f" at n/N = {row['fraction']:.0%}"
    ustar = row["ustar0_m_s"] if "ustar0_m_s" in row else row["ustar_m_s"]
    threshold += f", u*₀ = {ustar:.3g} m/s"
    case = row["case"] if isinstance(row["case"], str) else ""
    scene = ", ".join(labels.told(row, telling))
    return [scene, threshold, str(row["why_not"]), case]


def singles(results: Results) -> Iterator[Figure]:
    """Draw Figs. 5 to 8: on a flat bed by entrainment angle or law, and on slopes.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        A figure for each.
    """
    grains = single_grains(results)
    flat = grains[grains["alpha_deg"] == 0]
    has_dem = bool(grains["shields_dem"].notna().any())
    kind = "dem" if has_dem else "closed-form"
    ending = "closed form and DEM" if has_dem else "closed form"
    colours: dict[Any, str]
    has_many_laws = len(set(theory.dashes(flat["force_law"]).values())) > theory.MANY
    if has_many_laws:
        colours = {law: theory.look(law)[0] for law in theory.drawn(flat["force_law"])}
        for (ratio,), group in split(flat, "z0_over_d"):
            written = labels.ratio_of(float(str(ratio)), "d")
            title = f"Force laws on a horizontal bed, z₀ = {written}"
            yield from _diagrams(
                group, "force_law", colours, f"shields-{written}", title
            )
    elif len(flat):
        colours = style.palette("beta_deg", results.values("beta_deg"))
        title = f"One grain on a horizontal bed: {ending}"
        yield from _diagrams(flat, "beta_deg", colours, f"{kind}-horizontal", title)
    colours = style.palette("alpha_deg", results.values("alpha_deg"))
    for (beta,), group in split(grains, "beta_deg"):
        if (group["alpha_deg"] > 0).any():
            name = f"{kind}-slope-beta{beta:g}"
            title = f"One grain on a slope, β = {beta:g}°: {ending}"
            yield from _diagrams(group, "alpha_deg", colours, name, title)


def piles(results: Results) -> Iterator[Figure]:
    """Make the extended Shields diagrams by slope, as Figs. 15 and 16 of the paper.

    Parameters
    ----------
    results
        The study.

    Yields
    ------
    Figure
        The figures for each z0/d.
    """
    every = results.joined("pile_threshold")
    if every.empty:
        return
    reached = every[drawable(every, "reynolds", "shields")]
    if reached.empty:
        return
    colours = style.palette("fraction", sorted(set(reached["fraction"])))
    has_one_slope = reached["alpha_deg"].nunique() == 1
    # the one diagram shows all of few piles on one slope
    is_shown = has_one_slope and every["scene_id"].nunique() <= FEW
    smoothest = reached["z0_over_d"].min()
    for (ratio,), rows in split(reached, "z0_over_d"):
        written = labels.ratio_of(float(str(ratio)), "d")
        name = f"extended-shields-{written}"
        title = f"Thresholds of beds by slope, z₀ = {written}"
        for figure in _diagrams(rows, "fraction", colours, name, title):
            fold = figure.fold or is_shown or ratio != smoothest
            yield replace(figure, fold=fold)


PANELS_BY = {
    "fraction": "alpha_deg",
    "force_law": "beta_deg",
    "beta_deg": "z0_over_d",
    "alpha_deg": "z0_over_d",
}
"""The column that parts panels, by the column that colours tell apart."""


def _diagrams(
    rows: pd.DataFrame, by: str, colours: Mapping[Any, str], name: str, title: str
) -> Iterator[Figure]:
    """Single grains with or without thresholds by DEM, or piles, and closed forms."""
    columns = PILE if by == "fraction" else DEM
    every = rows[rows[columns[1]].notna()]
    # the closed form depends on nothing else that a panel does not show
    known = "fraction" if by == "fraction" else "beta_deg"
    choices, every = parted(every, *SHOWN, known)
    # to part a hundred columns takes long
    narrow = [*SHOWN, *columns, by, "regime", "usable", SHAPE, LABEL]
    narrow = list(dict.fromkeys(narrow))
    stem = name.replace("/", "").replace(" ", "")
    for sheet in sheets(rows, [PANELS_BY[by], *choices], 2.5, *AXES):
        shown = every[every["scene_id"].isin(sheet.rows["scene_id"])]
        text = caption("diagram", by=by, about=about(sheet.rows), answers=about(shown))
        is_further = bool(sheet.name)
        yield Figure(
            stem + sheet.name,
            title + sheet.title,
            text,
            case_names(shown),
            partial(_draw_diagram, sheet, shown, narrow, by, colours),
            fold=is_further or by == "alpha_deg",
            tables=("pile_threshold" if by == "fraction" else "single_grain",),
        )


def _draw_diagram(
    sheet: Sheet,
    shown: pd.DataFrame,
    narrow: list[str],
    by: str,
    colours: Mapping[Any, str],
) -> Canvas:
    """The panels of a diagram: published curves, the closed form, points."""
    xlim = ends(sheet.rows, shown)
    dashes = theory.dashes(sheet.rows["force_law"])
    for ax, part in zip(sheet.panels()[1], sheet.parts, strict=True):
        draw_published(ax, part, xlim, colours if by == "alpha_deg" else None)
        _draw_laws(ax, part, by, colours, dashes)
        here = shown.loc[shown["scene_id"].isin(part["scene_id"]), narrow]
        for (value,), group in split(here, by):
            if by == "fraction":
                _join_piles(ax, group, colours[value])
            draw_points(ax, group, colours[value], PILE if by == "fraction" else DEM)
    prepare(sheet, xlim)
    return legends(sheet, by, {} if by == "force_law" else colours)


def _draw_laws(
    ax: Axes,
    part: pd.DataFrame,
    by: str,
    colours: Mapping[Any, str],
    dashes: Mapping[str, theory.Dash],
) -> None:
    """The closed form of each law by the criteria of the answers.

    They are in the colours of the laws or of the column `by`.
    """
    criteria = set(part["criterion"].dropna())
    going = theory.going_on(part) if GOES_ON in criteria else []
    for curve in going:
        name = labels.value("force_law", curve.law)
        colour = _colour_of(curve, by, colours)
        _draw_going(ax, curve, f"closed form: {name}, {theory.GOING}", colour)
    if going and criteria == {GOES_ON}:
        return
    for line in theory.lines(part):
        name = labels.value("force_law", line.law)
        dash = theory.look(line.law)[1]
        if by != "force_law":
            dash = dashes[line.law]
            if line.law in theory.PAIR:
                name = "Eqs. 3, 5"
        if GOES_ON in criteria:
            name = f"{name}, {theory.LEAVING}"
        draw_line(ax, line, f"closed form: {name}", _colour_of(line, by, colours), dash)


def _colour_of(line: Line | theory.Going, by: str, colours: Mapping[Any, str]) -> str:
    """The colour of a law, or of the value of the column `by` that its bed has."""
    if by == "force_law":
        return theory.look(line.law)[0]
    bed = dict(zip(theory.BED, line.bed, strict=True))
    return colours.get(bed.get(by), "0.2")


def _join_piles(ax: Axes, group: pd.DataFrame, colour: str) -> None:
    """Lines through piles that differ in the diameter alone; others are a scatter."""
    joined = []
    for _, series in split(group, *SERIES):
        if series["d_m"].is_unique:
            points = series.sort_values("reynolds")[["reynolds", "shields"]]
            joined.append(np.vstack([points, GAP]))
    if joined:
        ax.plot(*np.concatenate(joined).T, color=colour, lw=0.6, zorder=2)


def accuracy(results: Results) -> Iterator[Figure]:
    """Draw u* of DEM over that of the closed form, for each increment of load steps.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        A figure for each page of panels.
    """
    dem = single_grains(results)
    dem = dem[dem["ustar_m_s"].notna()]
    if dem.empty:
        return
    exact = dem["ustar_closed_form_m_s"]
    over = {
        "value": dem["ustar_m_s"] / exact,
        "low": dem["ustar_low_m_s"] / exact,
        "high": dem["ustar_high_m_s"] / exact,
    }
    choices, rows = parted(dem.assign(**over), *SHOWN, "beta_deg", "load_increment")
    colours = style.palette("alpha_deg", results.values("alpha_deg"))
    keys = ["load_increment", *choices]
    axes = labels.RE_AXIS, "u* of DEM over closed form"
    for sheet in sheets(rows, keys, 2.1, *axes, columns=1, sharey=False):
        text = caption(
            "accuracy", about=about(sheet.rows), deviations=_deviations(sheet.rows)
        )
        yield Figure(
            f"accuracy{sheet.name}",
            f"DEM over closed form{sheet.title}",
            text,
            case_names(sheet.rows),
            partial(_draw_accuracy, sheet, rows, colours),
            fold=True,
            tables=("single_grain",),
        )


def _deviations(rows: pd.DataFrame) -> str:
    """How far DEM is off at most, where the force law holds and where it does not."""
    far = (rows["value"] - 1).abs()
    holds = valid(rows)
    found = []
    if holds.any():
        found.append(f"{far[holds].max():.2%} where its law holds")
    if not holds.all():
        found.append(f"{far[~holds].max():.2%} where it does not")
    return ", ".join(found)


def _draw_accuracy(
    sheet: Sheet, rows: pd.DataFrame, colours: Mapping[Any, str]
) -> Canvas:
    """The panels of u* of DEM over that of the closed form."""
    _, axes = sheet.panels()
    for ax, part in zip(axes, sheet.parts, strict=True):
        ax.axhline(1, color="0.3", lw=0.8, zorder=1)
        for (alpha,), group in split(part, "alpha_deg"):
            draw_points(ax, group, colours[alpha], ("reynolds", "value", "low", "high"))
        farthest = float(np.nanmax(np.abs(part[["value", "low", "high"]] - 1)))
        ax.set(xscale="log", ylim=(1 - 1.6 * farthest, 1 + 1.6 * farthest))
    for ax in axes:
        style.plain_ticks(ax.xaxis)
        shade_transition(ax, rows)
    return legends(sheet, "alpha_deg", colours)
