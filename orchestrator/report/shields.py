"""Shields diagrams on axes: published curves, closed forms, points."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.physics import curves as published
from orchestrator.physics.beside import FIELD
from orchestrator.physics.fluids import ALIKE, NUMBERS_OF_PAPER
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import MEASURED_SOURCE, single_beds
from orchestrator.report import labels, style, theory
from orchestrator.report.results import Results, held, split_by, valid
from orchestrator.report.style import Look
from orchestrator.report.theory import BINS, Going, Line
from orchestrator.study import fields
from orchestrator.study.criterion import SUSTAINED
from orchestrator.tables.facts import are_followed, needs_run
from orchestrator.types import BoolArray, FloatArray, IntArray

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
AIR_STYLES = dict(zip(published.AIR, AIR_DASHES, strict=True))
SLOPED = "Shao & Lu 2000"
"""The curve for air of sloping beds: three for each slope would hide the rest."""
RESULT = ("closed form", "points", "points, not usable")
"""Names of artists: lines of the closed form, usable points, others."""
SHOWN = ("alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "force_law")
"""Columns that figures, panels, axes, colours and markers tell apart."""
SERIES = ("nu_m2_s", "force_law", "regime", SHAPE)
"""Columns in which piles agree that a line joins."""
FIELD_REYNOLDS = (8.8, 13.5)
"""Re* of the sites of `FIELD`."""
JUMP, FAR = 1.25, 3.0
"""Least factor of a jump of a curve, and over the steps beside it, in logarithms."""
GOING_DASH = (0, (7, 1.2, 1.5, 1.2))
"""Dash of the curves of grains in sustained motion."""
PUBLISHED = "published curves, see caption"
"""Label of the curves for air and for water, which the caption names by their colours.
"""
MEASURED = "measured, see caption"
"""Label of what was measured in water and in the field, as the caption says."""
DOTTED = "dotted: the force law does not hold"
"""Label of the part of a curve that is dotted."""
GAP = np.full((1, 2), np.nan)
"""A point that interrupts a line."""
BEYOND = 1e6
"""A place above every frame, over the lower end of a bar."""
PANELS_BY = {
    "fraction": "alpha_deg",
    "force_law": "beta_deg",
    "beta_deg": "z0_over_d",
    "alpha_deg": "z0_over_d",
}
"""The column that parts panels, by the column that colours tell apart."""
AXES = labels.RE_AXIS, labels.TAU_AXIS
DEM = ("reynolds", "shields_dem", "shields_low", "shields_high")
"""Columns of a single grain: x, y and the ends of its interval."""
PILE = ("reynolds", "shields", "shields_low", "shields_high")
"""Columns of a pile: x, y and the ends of its interval."""


EQ10 = "eq10"
"""The stress by which the paper computes its piles: Eq. 10 at the first cell."""


class OfStress(NamedTuple):
    """Piles under one stress on their grains, and how their figures differ.

    Attributes
    ----------
    name, title
        Endings of the names and titles of their figures.
    after
        Added to the figure of the paper that a figure follows.
    rows
        The piles.
    """

    name: str
    title: str
    after: str
    rows: pd.DataFrame


def by_stress(piles: pd.DataFrame) -> Iterator[OfStress]:
    """Part piles by the stress on their grains, that of the paper first.

    Parameters
    ----------
    piles
        Piles with the column ``stress``, which is blank where no flow is solved.

    Yields
    ------
    OfStress
        Those by Eq. 10, then all others.
    """
    by_eq10 = piles["stress"] == EQ10
    if by_eq10.any():
        yield OfStress("-eq10", ", stress of Eq. 10", "", piles[by_eq10])
    if not by_eq10.all():
        others = piles[~by_eq10]
        title = ", wall stress" if by_eq10.any() else ""
        yield OfStress("", title, ", by the wall stress", others)


class DiagramSheet(NamedTuple):
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
) -> Iterator[DiagramSheet]:
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
    panels = [part for _, part in split_by(rows, *keys)]

    def most_scenes_first(number: int) -> tuple[int, int]:
        return -panels[number]["scene_id"].nunique(), number

    order = sorted(range(len(panels)), key=most_scenes_first)
    for name, title, chosen in style.pages(order):
        parts = [panels[number] for number in sorted(chosen)]
        is_alone = len(parts) == 1
        tall = 1.3 * height if is_alone else height
        titles = [labels.panel(part.iloc[0], keys) for part in parts]
        made = cache(partial(style.grid, titles, tall, x, y, **layout))
        yield DiagramSheet(name, title, parts, pd.concat(parts), made)


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
        told = [labels.method_names(group), law, *labels.told(group.iloc[0], looks)]
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
    info = labels.info_of(column)
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

    drawn = theory.drawn_laws(rows["force_law"])
    is_sloped = bool((rows["alpha_deg"] > 0).any())
    of_the_points = {
        "laws": "; ".join(labels.value("force_law", name) for name in drawn),
        "is_followed": bool(are_followed(rows).all()),
        "pair": theory.PAIR[0] in drawn,
        "is_open": not valid(rows).all(),
        "viscosities": rows["nu_m2_s"].nunique(),
        "methods": labels.method_names(rows),
        "others": labels.method_names(rows[~is_run]),
        "dem": is_run.any(),
        "stress": _stresses(rows),
        "increment": used("load_increment", 100.0),
        "waiting": used("waiting_time"),
        "criterion": used("displacement_criterion"),
    }
    of_the_lines = {
        "air": ", ".join(theory.air_lines(rows)),
        "wet": not theory.in_gas(rows).all(),
        "sloped": SLOPED if is_sloped else "",
        "curves": "; ".join(curve.name for curve in published.WATER),
        "measured": MEASURED_SOURCE,
        "sites": len(FIELD),
        "bagnold_from": f"{theory.BAGNOLD_FROM:g}",
    }
    return of_the_points | of_the_lines


def _stresses(rows: pd.DataFrame) -> str:
    """The stresses on the grains of some rows, in words."""
    named = sorted(set(rows["stress"].dropna()) or {"wall"})
    return " or ".join(labels.value("stress", name) for name in named)


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


def log_axes(sheet: DiagramSheet, xlim: tuple[float, float]) -> None:
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
            if line.get_gid() not in ("intervals", "single beds"):
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


class DrawnCurve(NamedTuple):
    """A closed form as it is drawn.

    Attributes
    ----------
    label, colour, dash, width
        Its entry in the legend and its look where its law holds.
    points
        Re* and tau, shape (2, n).
    holds, dotted
        Where it is drawn, and where it is dotted since its law does not hold there.
    """

    label: str
    colour: str
    dash: theory.Dash
    width: float
    points: FloatArray
    holds: BoolArray
    dotted: BoolArray

    def draw(self, ax: Axes) -> None:
        """Draw it.

        Parameters
        ----------
        ax
            The panel.
        """
        parts = [(self.label, self.holds, self.dash), (DOTTED, self.dotted, ":")]
        look: Look = {"color": self.colour, "lw": self.width, "gid": RESULT[0]}
        jumps = jumps_of(self.points)
        for label, chosen, dash in parts:
            if chosen.any():
                shown = np.where(chosen, self.points, np.nan)
                shown = np.insert(shown, jumps, np.nan, axis=1)
                ax.plot(*shown, ls=dash, label=label, **look)


def jumps_of(points: FloatArray) -> IntArray:
    """Find where a curve jumps, so that no line is drawn between both sides.

    Parameters
    ----------
    points
        Re* and Shields number along the curve, shape (2, n).

    Returns
    -------
    IntArray
        The numbers of the points behind a jump: of those whose Shields number is
        another one by `JUMP` times, and by `FAR` times the step before and behind.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.abs(np.diff(np.log(points[1])))
    if len(steps) < 3:
        return np.empty(0, np.int64)
    around = np.maximum(
        np.concatenate([steps[1:2], steps[:-1]]), np.append(steps[1:], steps[-2])
    )
    is_jump = (steps > np.log(JUMP)) & (steps > FAR * around)
    return np.flatnonzero(is_jump) + 1


class Points(NamedTuple):
    """Thresholds as they are drawn.

    Attributes
    ----------
    rows
        Rows with the columns `SHAPE` and `LABEL`.
    colour, size
        Colour of all markers, and their size, points.
    columns
        Columns of x, of y and of both ends of its interval.
    are_joined
        Whether lines join beds that differ in the diameter alone.
    """

    rows: pd.DataFrame
    colour: str
    columns: Sequence[str]
    size: float = 4.2
    are_joined: bool = False

    def draw(self, ax: Axes) -> list[tuple[Line2D, BoolArray]]:
        """Draw them, open where a threshold is not usable, with their intervals.

        Parameters
        ----------
        ax
            The panel.

        Returns
        -------
        list of (line, mask)
            Each group of markers, and which rows it shows.
        """
        if self.are_joined:
            _join_piles(ax, self.rows, self.colour)
        return _draw_points(ax, self.rows, self.colour, self.columns, self.size)


def diagram(
    ax: Axes,
    scenes: pd.DataFrame,
    xlim: tuple[float, float],
    curves: Iterable[DrawnCurve],
    points: Iterable[Points],
    slopes: Mapping[Any, str] | None = None,
) -> list[tuple[Line2D, pd.DataFrame]]:
    """Draw a Shields diagram.

    Parameters
    ----------
    ax
        The panel.
    scenes
        The scenes that it shows, for whose fluids published curves are drawn.
    xlim
        The range of Re*.
    curves, points
        What is drawn over these.
    slopes
        Colours by slope, where these tell the curves for air apart.

    Returns
    -------
    list of (line, rows)
        Each group of markers, and the rows that it shows.
    """
    _draw_published(ax, scenes, xlim, slopes)
    for curve in curves:
        curve.draw(ax)
    drawn = []
    for each in points:
        drawn += [(line, each.rows[mask]) for line, mask in each.draw(ax)]
    return drawn


def curves_of(
    lines: Iterable[Line],
    going: Sequence[Going],
    criteria: Iterable[str],
    name: Callable[[Line | Going], str],
    look: Callable[[Line | Going], tuple[str, theory.Dash, float]],
) -> Iterator[DrawnCurve]:
    """Make the curves of what is answered, by its criteria.

    Where no curve of sustained motion is known, that of entrainment stands there.

    Parameters
    ----------
    lines
        The closed forms of grains that are entrained.
    going
        Those of grains in sustained motion.
    criteria
        The criteria of the answers.
    name
        Names a curve without its criterion.
    look
        Gives its colour, dash and width.

    Yields
    ------
    Curve
        The curves.
    """
    asked = set(criteria)
    for curve in going:
        colour, _, width = look(curve)
        points = np.array([curve.reynolds, curve.tau])
        label = f"{name(curve)}, {theory.GOING}"
        yield DrawnCurve(
            label, colour, GOING_DASH, width, points, curve.holds, ~curve.holds
        )
    if going and asked == {SUSTAINED}:
        return
    for line in lines:
        label = name(line)
        if SUSTAINED in asked:
            label = f"{label}, {theory.LEAVING}"
        holds = line.holds(REYNOLDS)
        dotted = line.near(REYNOLDS) & ~holds
        points = np.array([REYNOLDS, line.tau(REYNOLDS)])
        yield DrawnCurve(label, *look(line), points, holds, dotted)


def _draw_points(
    ax: Axes,
    rows: pd.DataFrame,
    colour: str,
    columns: Sequence[str],
    size: float,
) -> list[tuple[Line2D, BoolArray]]:
    """Intervals and the rows' own markers; groups of markers with what they show."""
    x, y, low, high = (rows[column].to_numpy(float) for column in columns)
    _draw_intervals(ax, x, (low, y, high), colour, size)
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
        is_open = (shape == marker) & ~usable
        if is_open.any():
            look |= {"gid": RESULT[2], "mfc": "white"}
            look |= {"label": "open: not usable"}
            (line,) = ax.plot(x[is_open], y[is_open], zorder=3, **look)
            drawn.append((line, is_open))
    return drawn


def _draw_intervals(
    ax: Axes, x: Any, interval: tuple[Any, Any, Any], colour: str, size: float
) -> None:
    """Bars with caps, as one line with gaps: singly they take three times as long.

    An interval, by its lower end, its number and its upper end, that has no upper end
    has an arrow from the number.
    """
    low, y, high = interval
    is_open = np.isnan(high) & np.isfinite(low)
    if is_open.any():
        arrow: Look = {"ls": "", "marker": style.UP, "ms": style.ARROW}
        arrow |= {"color": colour, "mfc": "none", "mew": 0.8, "alpha": 0.5}
        ax.plot(x[is_open], y[is_open], zorder=2.5, gid="open intervals", **arrow)
    high = np.where(is_open, y, high)
    ends = np.column_stack([low, high, np.full_like(low, np.nan)]).ravel()
    bar: Look = {"color": colour, "lw": 0.8, "solid_capstyle": "butt", "alpha": 0.5}
    caps: Look = {"marker": "_", "ms": size + 0.8, "mew": 0.7}
    ax.plot(np.repeat(x, 3), ends, zorder=2.5, gid="intervals", **bar, **caps)


def _draw_published(
    ax: Axes,
    scenes: pd.DataFrame,
    xlim: tuple[float, float],
    colours: Mapping[Any, str] | None,
) -> None:
    """Draw published curves: for air, and those and measurements for water.

    On slopes one curve for air is drawn, times the slope factor, in the colours of the
    slopes; of beds that slope in a gas nothing for water is.
    """
    is_sloped = bool((scenes["alpha_deg"] > 0).any())
    for alpha in sorted(set(scenes["alpha_deg"])):
        for name, points in theory.air_lines(scenes, alpha).items():
            if is_sloped and name != SLOPED:
                continue
            colour = colours[alpha] if colours else style.AIR
            look: Look = {"color": colour, "ls": AIR_STYLES[name], "lw": 0.8}
            ax.plot(*points, label=PUBLISHED, zorder=1.5, **look)
    is_air = theory.in_gas(scenes).all()
    if is_air and not is_sloped:
        _draw_field(ax, xlim)
    if not is_air or (_has_gas_of_paper(scenes) and not is_sloped):
        _draw_water(ax, xlim)


def draw_single_beds(ax: Axes, scenes: pd.DataFrame) -> None:
    """Draw every measured bed behind all else, in the fluids that scenes have.

    Parameters
    ----------
    ax
        The panel.
    scenes
        The scenes.
    """
    is_gas = set(theory.in_gas(scenes))
    look: Look = {"ls": "", "marker": "o", "ms": 2.2, "color": "0.72", "mew": 0}
    for in_gas in sorted(is_gas | ({False} if _has_gas_of_paper(scenes) else set())):
        ax.plot(*single_beds(in_gas=in_gas), gid="single beds", zorder=0.5, **look)


def _has_gas_of_paper(scenes: pd.DataFrame) -> bool:
    """Whether some scenes have the gas that the paper sets beside water."""
    densities = scenes["rho_f_kg_m3"]
    is_of_paper = np.isclose(densities, NUMBERS_OF_PAPER[0], rtol=ALIKE, atol=0)
    return bool(is_of_paper.any())


def _draw_field(ax: Axes, xlim: tuple[float, float]) -> None:
    """Shields numbers of the sites in the field, over the Re* that they have."""
    low, high = FIELD_REYNOLDS
    if high < xlim[0] or low > xlim[1]:
        return
    look: Look = {"color": "black", "lw": 1.6, "zorder": 2.2}
    gaps = [(low, theta, high, theta, np.nan, np.nan) for theta in FIELD]
    points = np.array(gaps).reshape(-1, 2)
    ax.plot(*points.T, gid="field", label=MEASURED, **look)


def _draw_water(ax: Axes, xlim: tuple[float, float]) -> None:
    """Published curves for water, and the measurements with medians within two ends."""
    lines = []
    for curve in published.WATER:
        lines += [np.column_stack(curve.points()), GAP]
    thin: Look = {"color": style.WATER, "lw": 0.7, "zorder": 1}
    ax.plot(*np.concatenate(lines).T, label=PUBLISHED, gid="water", **thin)
    bins = [item for item in BINS if xlim[0] < item.middle < xlim[1]]
    x = np.array([item.middle for item in bins])
    y = np.array([item.median for item in bins])
    dark: Look = {"color": "black", "lw": 0.7, "zorder": 2.2}
    tenths = [item.tenth for item in bins]
    ninetieths = [item.ninetieth for item in bins]
    ax.vlines(x, tenths, ninetieths, **dark)
    ax.hlines(y, [item.low for item in bins], [item.high for item in bins], **dark)
    ax.plot(x, y, "s", ms=3.5, label=MEASURED, gid="medians", **dark)


def panels(
    rows: pd.DataFrame, by: str, colours: Mapping[Any, str], height: float = 2.5
) -> Iterator[tuple[DiagramSheet, pd.DataFrame, Callable[[], Canvas]]]:
    """Shields diagrams of single grains or of piles, with closed forms, in panels.

    Parameters
    ----------
    rows
        Single grains with or without thresholds by DEM, or piles.
    by
        The column that colours tell apart, of `PANELS_BY`.
    colours
        Colours by its values.
    height
        Height of a panel, inches.

    Yields
    ------
    sheet : Sheet
        The panels of a figure.
    shown : DataFrame
        The rows that are points in them.
    draw : callable
        Draws it.
    """
    columns = PILE if by == "fraction" else DEM
    every = rows[rows[columns[1]].notna()]
    # the closed form depends on nothing else that a panel does not show
    known = "fraction" if by == "fraction" else "beta_deg"
    choices, every = parted(every, *SHOWN, known)
    # to part a hundred columns takes long
    narrow = ["scene_id", *SHOWN, *columns, by, "regime", "usable", SHAPE, LABEL]
    narrow = list(dict.fromkeys(narrow))
    for sheet in sheets(rows, [PANELS_BY[by], *choices], height, *AXES):
        shown = every[every["scene_id"].isin(sheet.rows["scene_id"])]
        yield sheet, shown, partial(_draw_panels, sheet, shown[narrow], by, colours)


def _draw_panels(
    sheet: DiagramSheet, shown: pd.DataFrame, by: str, colours: Mapping[Any, str]
) -> Canvas:
    """The panels of a figure."""
    xlim = ends(sheet.rows, shown)
    dashes = theory.dashes(sheet.rows["force_law"])
    slopes = colours if by == "alpha_deg" else None
    for ax, part in zip(sheet.panels()[1], sheet.parts, strict=True):
        here = shown[shown["scene_id"].isin(part["scene_id"])]
        points = []
        for (value,), group in split_by(here, by):
            columns = PILE if by == "fraction" else DEM
            is_joined = by == "fraction"
            points.append(Points(group, colours[value], columns, are_joined=is_joined))
        curves = _curves_of_part(part, by, colours, dashes)
        diagram(ax, part, xlim, curves, points, slopes)
    log_axes(sheet, xlim)
    return legends(sheet, by, {} if by == "force_law" else colours)


def _curves_of_part(
    part: pd.DataFrame,
    by: str,
    colours: Mapping[Any, str],
    dashes: Mapping[str, theory.Dash],
) -> Iterator[DrawnCurve]:
    """The closed forms of a panel, in the colours of the laws or of the column `by`."""
    criteria = set(part["criterion"].dropna())
    going = theory.sustained_curves(part) if SUSTAINED in criteria else []

    def name(each: Line | Going) -> str:
        is_told = by == "force_law" or each.law not in theory.PAIR
        law = labels.value("force_law", each.law) if is_told else "Eqs. 3, 5"
        return f"closed form: {law}"

    def look(each: Line | Going) -> tuple[str, theory.Dash, float]:
        width = 1.6 if isinstance(each, Going) else 1.1
        colour, dash = theory.look(each.law)
        if by == "force_law":
            return colour, dash, width
        bed = dict(zip(theory.BED, each.bed, strict=True))
        return colours.get(bed.get(by), "0.2"), dashes.get(each.law), width

    return curves_of(theory.measured_lines(part), going, criteria, name, look)


def _join_piles(ax: Axes, group: pd.DataFrame, colour: str) -> None:
    """Lines through piles that differ in the diameter alone; others are a scatter."""
    joined = []
    for _, series in split_by(group, *SERIES):
        if series["d_m"].is_unique:
            points = series.sort_values("reynolds")[["reynolds", "shields"]]
            joined.append(np.vstack([points, GAP]))
    if joined:
        ax.plot(*np.concatenate(joined).T, color=colour, lw=0.6, zorder=2)


def legends(sheet: DiagramSheet, column: str, colours: Mapping[Any, str]) -> Canvas:
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
            top.append(style.entry(labels.value_text(column, value), colour))
    style.legends_below(canvas, top, style.samples(axes))
    return canvas


def diagram_rows(results: Results) -> pd.DataFrame:
    """List the single grains under a held flow.

    Grains under a flow that rises steadily are left out: it gives no threshold.

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
