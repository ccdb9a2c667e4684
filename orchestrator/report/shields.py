"""The Shields diagram: axes, what is known of them, closed-form lines and points with intervals."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from scipy.ndimage import grey_closing, grey_opening

from orchestrator.physics import curves
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import BUFFINGTON_MONTGOMERY
from orchestrator.report import labels, laws, reference, style
from orchestrator.report.apart import SHAPE
from orchestrator.report.results import valid
from orchestrator.report.theory import Branch, drag_law_limit

FloatArray = NDArray[np.float64]

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


def prepare(
    axes: Sequence[Axes], panels: Sequence[pd.DataFrame], xlim: tuple[float, float]
) -> None:
    """Logarithmic axes of panels; the transition where the rows of one have the paper's laws.

    Call it when all else is drawn; the axes share their limits.
    """
    low, high = _extent(axes, xlim)
    for ax, rows in zip(axes, panels, strict=True):
        ax.set(xscale="log", yscale="log", ylabel=labels.TAU_AXIS)
        ax.set(xlim=xlim, ylim=(low / 1.6, high * 2.2))
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
        shade_transition(ax, rows)
    label_lowest(axes, labels.RE_AXIS)


def _extent(axes: Sequence[Axes], xlim: tuple[float, float]) -> tuple[float, float]:
    """Least and largest tau that is drawn between two Re*, of what the limits must hold."""
    marks = (*RESULT, WATER, MEASURED)
    every = [(line, str(line.get_gid())) for ax in axes for line in ax.lines]
    chosen = [line.get_xydata() for line, gid in every if gid in marks or gid.startswith(AIR)]
    xy = np.concatenate([np.asarray(line, float) for line in chosen])
    tau = xy[(xy[:, 0] >= xlim[0]) & (xy[:, 0] <= xlim[1]), 1]
    return float(np.nanmin(tau)), float(np.nanmax(tau))


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
    if not rows["force_law"].isin(laws.PAIR).any():
        return
    low, high = (LAWS[name].reynolds for name in laws.PAIR)
    left, right = max(left, low[1]), min(right, high[0])
    if left < right:
        ax.axvspan(left, right, color="0.93", zorder=0, gid="transition")
        if right > 1.5 * left:
            style.note(ax, float(np.sqrt(left * right)), "transition")


def mark_drag_law(axes: Sequence[Axes], panels: Sequence[pd.DataFrame]) -> None:
    """A line where the drag law of Eq. 4 ends, if the axes reach it and that law is drawn."""
    for ax, rows in zip(axes, panels, strict=True):
        limit = drag_law_limit(float(rows["z0_over_d"].iloc[0]))
        if not rows["force_law"].isin(laws.PAIR).any() or ax.get_xlim()[1] <= limit:
            continue
        ax.axvline(limit, color="0.4", lw=0.7, ls=(0, (4, 2)), zorder=0.5, gid="drag law limit")
        style.upright_note(ax, limit / 1.04, "drag law ends", at="bottom")


def draw_branches(
    ax: Axes, branches: Sequence[Branch], colour: str, dashes: Mapping[str, laws.Dash]
) -> None:
    """Closed-form lines, dashed by law; dotted where it does not hold but the study has grains."""
    for branch in branches:
        own = dashes[branch.law]
        for chosen, look, width in ((branch.valid, own, 1.1), (branch.continued, ":", 0.9)):
            if chosen.any():
                x, y = (np.where(chosen, a, np.nan) for a in (branch.reynolds, branch.shields))
                ax.plot(x, y, ls=look, color=colour, lw=width, gid=RESULT[0])


def draw_points(
    ax: Axes, rows: pd.DataFrame, colour: str, columns: tuple[str, str, str, str]
) -> None:
    """Intervals and the rows' own markers, by the columns of x, y and its ends.

    Hollow where the force law does not hold.
    """
    rows = rows[rows[columns[1]].notna()]
    x, y, low, high = (rows[column].to_numpy(float) for column in columns)
    draw_intervals(ax, x, low, high, colour)
    solid, shapes = valid(rows).to_numpy(), rows[SHAPE].to_numpy(str)
    for marker in sorted(set(shapes.tolist())):
        for filled, gid in ((True, RESULT[1]), (False, RESULT[2])):
            some = (solid == filled) & (shapes == marker)
            if some.any():
                face = colour if filled else "white"
                ax.plot(x[some], y[some], marker, mfc=face, mec=colour, mew=0.8, zorder=3, gid=gid)


def draw_intervals(ax: Axes, x: FloatArray, a: FloatArray, b: FloatArray, colour: str) -> None:
    """Vertical bars with caps from one end to the other."""
    # as one line with gaps: bars and caps by themselves take three times as long
    places, ends = np.repeat(x, 3), np.column_stack([a, b, np.full_like(a, np.nan)]).ravel()
    look: style.Look = {"color": colour, "lw": 0.8, "solid_capstyle": "butt", "gid": "intervals"}
    ax.plot(places, ends, marker="_", ms=5, mew=0.7, zorder=2.5, **look)


def draw_water(ax: Axes) -> list[Artist]:
    """The published curves for water and their band; returns its entry for a legend."""
    gap = np.full((1, 2), np.nan)
    lines = [part for one in curves.WATER for part in (np.column_stack(one.points()), gap)]
    ax.plot(*np.concatenate(lines).T, color=style.WATER, lw=0.4, zorder=1, gid=WATER)
    band = reference.water_band(np.geomspace(0.01, 1000, 400))
    look: style.Look = {"color": style.WATER, "alpha": 0.45, "lw": 0}
    # a curve that begins far from the others is a line alone until it comes near them
    low = grey_closing(_filled(band.low), size=(SPIKE,))
    high = grey_opening(_filled(band.high), size=(SPIKE,))
    known = np.isfinite(band.low).tolist()
    ax.fill_between(band.reynolds, low, high, where=known, zorder=1, gid="water band", **look)
    return [Patch(label="water: spread of published curves", gid=WATER, **look)]


def _filled(edge: FloatArray) -> FloatArray:
    """With the nearest values where an edge has none."""
    known = np.flatnonzero(np.isfinite(edge))
    return np.interp(np.arange(len(edge)), known, edge[known])


def draw_measured(ax: Axes) -> list[Artist]:
    """Measured medians with their ranges of Re* and of tau; returns their entry for a legend."""
    bins = BUFFINGTON_MONTGOMERY
    x, y = [one.middle for one in bins], [one.median for one in bins]
    look: style.Look = {"color": "black", "lw": 0.7, "zorder": 2.2, "gid": MEASURED}
    ax.vlines(x, [one.tenth for one in bins], [one.ninetieth for one in bins], **look)
    ax.hlines(y, [one.low for one in bins], [one.high for one in bins], **look)
    ax.plot(x, y, "s", ms=3.5, **look)
    label = "measured: median, 10 to 90 %"
    return [Line2D([], [], color="black", lw=0.7, marker="s", ms=3.5, label=label, gid=MEASURED)]


def draw_air(ax: Axes, scenes: pd.DataFrame) -> list[Artist]:
    """The curves for air over a horizontal bed; returns their entries for a legend."""
    entries: list[Artist] = []
    lines = reference.air_lines(scenes)
    for (name, (x, y)), look in zip(lines.items(), AIR_STYLES, strict=False):
        own: style.Look = {"color": style.AIR, "ls": look, "lw": 0.9, "gid": AIR + name}
        ax.plot(x, y, zorder=1.5, **own)
        entries.append(Line2D([], [], label=f"air: {name}", **own))
    return entries


def draw_sloped_air(ax: Axes, scenes: pd.DataFrame, colour: str) -> list[Artist]:
    """One curve for air times the slope factor; three for each slope would hide the rest."""
    name = reference.SLOPED
    lines = reference.air_lines(scenes, float(scenes["alpha_deg"].iloc[0]))
    if name not in lines:
        return []
    ax.plot(*lines[name], color=colour, ls="--", lw=0.7, zorder=1.5, gid=AIR + name)
    label = f"air: {name} × slope factor"
    # a colour that means one slope says nothing of the others
    shown = colour if colour == style.AIR else "0.2"
    return [Line2D([], [], color=shown, ls="--", lw=0.7, label=label, gid=AIR + name)]


def line_entries(rows: pd.DataFrame, dashes: Mapping[str, laws.Dash]) -> list[Artist]:
    """Legend of the closed form's line styles, for the laws of some rows."""
    named = {name: labels.value("force_law", name) for name in dashes if name not in laws.PAIR}
    pair = {laws.PAIR[0]: "Eqs. 3, 5"} if laws.PAIR[0] in dashes else {}
    own: style.Look = {"color": "0.2", "gid": RESULT[0]}
    entries: list[Artist] = [
        Line2D([], [], lw=1.1, ls=dashes[name], label=f"closed form: {label}", **own)
        for name, label in {**pair, **named}.items()
    ]
    if not valid(rows).all():
        dotted = "dotted: the force law does not hold"
        entries.append(Line2D([], [], lw=0.9, ls=":", label=dotted, **own))
    return entries


def point_entries(rows: pd.DataFrame, variants: Sequence[style.Sample] = ()) -> list[style.Sample]:
    """Legend of the markers that some rows need: by which methods, with which forces.

    One law needs no entry of its own where the variants of how it was answered have theirs.
    """
    names = [name for name in LAWS if (rows["force_law"] == name).any()]
    found: list[style.Sample] = []
    if len(names) > 1 or not variants:
        for law_name in names:
            own = rows[rows["force_law"] == law_name]
            label = f"{labels.methods(own)}, {labels.value('force_law', law_name)}"
            found.append(_marks(own, label))
    if not valid(rows).all():
        shape = rows.loc[~valid(rows), SHAPE].iloc[0]
        found.append(_mark(shape, "white", "hollow: not usable, see why_not"))
    return found


def _marks(rows: pd.DataFrame, label: str) -> style.Sample:
    """The markers of some rows beside each other; of many the one that most rows have."""
    shapes = sorted(set(rows[SHAPE]))
    if len(shapes) > BESIDE:
        shapes = [rows[SHAPE].mode()[0]]
    marks = tuple(_mark(one, "0.2", label) for one in shapes)
    return marks if len(marks) > 1 else marks[0]


def _mark(shape: str, face: str, label: str) -> Line2D:
    return Line2D([], [], ls="", marker=shape, mec="0.2", mfc=face, mew=0.8, label=label)


def within(axes: Sequence[Axes], entries: Sequence[Artist]) -> list[Artist]:
    """The entries of a legend of whose lines or bars a part is in a frame; call it at the end."""
    seen = {gid for ax in axes for gid in _within(ax)}
    return [one for one in entries if one.get_gid() in seen]


def _within(ax: Axes) -> Iterator[str | None]:
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    for line in ax.lines:
        x, y = np.asarray(line.get_xydata(), float).T
        if ((x >= left) & (x <= right) & (y >= low) & (y <= high)).any():
            yield line.get_gid()
    for bars in ax.collections:
        for path in bars.get_paths() if isinstance(bars, LineCollection) else []:
            x, y = np.asarray(path.vertices, float).T
            if x.max() >= left and x.min() <= right and y.max() >= low and y.min() <= high:
                yield bars.get_gid()
