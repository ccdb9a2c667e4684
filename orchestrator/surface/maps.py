"""Maps of a bed in three dimensions: stress, the wind at which parts move, hours."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, TwoSlopeNorm
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import MaxNLocator

from orchestrator.report import style
from orchestrator.types import BoolArray, FloatArray

CONTOURS = 6
"""Contours of height on a map."""
COLUMNS = 3
"""Maps beside each other in a wide figure, at most."""
MOST_MAPS = 9
"""Maps of a figure, at most."""
PANEL = 3.6
"""Height of a map, at most, inches."""
BESIDE, SCALE, TITLE = 0.8, 1.5, 0.3
"""Room beside all maps, below them with their scale, and above each, inches."""
MOST_NUMBERS = 4
"""Numbers of an axis, at most."""
MARGIN = 0.12
"""Room around the form on a map, over its extent."""
NICE = (1.0, 2.0, 5.0)
"""Round numbers."""


@dataclass(frozen=True)
class MapGrid:
    """The raster of the maps of a bed, in the axes of its file.

    Attributes
    ----------
    x, y
        Its axes, m, rising, of shapes (nx,) and (ny,).
    height
        Heights above the ground, m, of shape (ny, nx).
    is_form
        Where the maps have values.
    """

    x: FloatArray
    y: FloatArray
    height: FloatArray
    is_form: BoolArray

    def of_faces(
        self, faces: pd.DataFrame, columns: Sequence[str]
    ) -> dict[str, FloatArray]:
        """Put values of faces on the raster.

        They are linear between the middles of the faces. Of a wind the inverse is,
        since the wind is infinite where there is no stress.

        Parameters
        ----------
        faces
            Faces with the columns ``x_m`` and ``y_m``.
        columns
            The columns of the values.

        Returns
        -------
        dict
            By column the map, NaN outside the form, of shape (ny, nx).
        """
        from scipy.interpolate import LinearNDInterpolator

        middle = np.array([self.x.mean(), self.y.mean()])
        near = np.hypot(np.ptp(self.x), np.ptp(self.y))
        places = faces[["x_m", "y_m"]].to_numpy(float) - middle
        is_near = np.hypot(*places.T) < near
        values = faces[[*columns]].to_numpy(float)[is_near]
        is_wind = np.array([column.startswith("wind") for column in columns])
        with np.errstate(divide="ignore"):
            given = np.where(is_wind, 1 / values, values)
            of_places = LinearNDInterpolator(places[is_near], given)
            found = of_places(*np.meshgrid(self.x - middle[0], self.y - middle[1]))
            found = np.where(is_wind, 1 / found, found)
        found[~self.is_form] = np.nan
        return {column: found[..., n] for n, column in enumerate(columns)}


@dataclass(frozen=True)
class Map:
    """A map of a figure.

    Attributes
    ----------
    title
        Its title.
    values
        Its values on the grid.
    from_deg
        Where the wind comes from, degrees; None for no arrow.
    mark
        Where motion starts, x and y, m; None for no mark.
    """

    title: str
    values: FloatArray
    from_deg: float | None = None
    mark: tuple[float, float] | None = None


def figure(
    grid: MapGrid,
    maps: Sequence[Map],
    label: str,
    *,
    colours: str = "viridis_r",
    middle: float | None = None,
    width: float = style.NARROW,
) -> Canvas:
    """Draw maps of one quantity, with one scale of colours.

    Parameters
    ----------
    grid
        The raster.
    maps
        The maps, of which the first `MOST_MAPS` are drawn.
    label
        The quantity with its unit.
    colours
        A colour map of matplotlib.
    middle
        Value at the middle of the colours; None for that of the range.
    width
        Width of the drawing, inches; a narrow one has its maps below each other.

    Returns
    -------
    Canvas
        The figure.
    """
    drawn = maps[:MOST_MAPS]
    columns = min(len(drawn), COLUMNS) if width >= style.WIDE else 1
    lines = -(-len(drawn) // columns)
    canvas = _canvas(grid, columns, lines, width)
    panels = canvas.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    norm = _norm([each.values for each in drawn], middle)
    every = panels.ravel().tolist()
    for ax in every[len(drawn) :]:
        ax.remove()
    axes = every[: len(drawn)]
    for ax, each in zip(axes, drawn, strict=True):
        ax.set_facecolor("0.95")
        image = ax.pcolormesh(
            grid.x,
            grid.y,
            each.values,
            cmap=colours,
            norm=norm,
            shading="nearest",
            rasterized=True,
            gid="map",
        )
        _ground(ax, grid)
        ax.set_title(each.title, loc="left")
        if each.from_deg is not None:
            _wind(ax, each.from_deg)
        if each.mark:
            ax.plot(
                *each.mark, "o", mfc="none", color="crimson", ms=7, mew=1.6, gid="start"
            )
    _frame(axes, columns, grid)
    bar = canvas.colorbar(
        image, ax=axes, label=label, location="bottom", shrink=0.8, pad=0.02, aspect=30
    )
    bar.ax.xaxis.set_major_locator(MaxNLocator(6))
    return canvas


def _canvas(grid: MapGrid, columns: int, lines: int, width: float) -> Canvas:
    """A canvas as high as its maps are."""
    (left, right), (bottom, top) = _limits(grid)
    aspect = (right - left) / (top - bottom)
    height = min(PANEL, (width - BESIDE) / (columns * aspect))
    return style.canvas(lines * (height + TITLE) + SCALE, width)


def _norm(values: Sequence[FloatArray], middle: float | None) -> Normalize:
    """The scale of some maps, from all but their highest hundredth."""
    finite = np.concatenate([each[np.isfinite(each)] for each in values])
    if not len(finite):
        return Normalize(0.0, 1.0)
    low, high = float(finite.min()), float(np.quantile(finite, 0.99))
    if middle is None or not low < middle < high:
        return Normalize(low, max(high, low * (1 + 1e-6) + 1e-12))
    return TwoSlopeNorm(middle, low, high)


def _ground(ax: Axes, grid: MapGrid) -> None:
    """Contours of height, of round numbers."""
    highest = float(grid.height.max())
    step = nice(highest / CONTOURS)
    levels = np.arange(step, highest, step)
    look: style.Look = {"colors": "0.15", "linewidths": 0.5, "alpha": 0.7}
    lines = ax.contour(grid.x, grid.y, grid.height, levels, **look)
    ax.clabel(lines, levels[1::2], fmt="%g", fontsize=style.LETTERS)


def nice(length: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above a length.

    Examples
    --------
    >>> [nice(length) for length in (0.7, 23.0, 5.0)]
    [0.5, 20.0, 5.0]

    Parameters
    ----------
    length
        A length of any unit, above 0.

    Returns
    -------
    float
        In the same unit.
    """
    power = 10.0 ** np.floor(np.log10(length) + 1e-9)
    fits = [part * power for part in NICE if part * power <= length * (1 + 1e-9)]
    return float(f"{max(fits):.6g}")


def _wind(ax: Axes, from_deg: float) -> None:
    """An arrow along the wind, in the upper left corner."""
    angle = np.radians(from_deg)
    half = 0.09 * np.array([-np.sin(angle), -np.cos(angle)])
    middle = np.array([0.13, 0.87])
    _arrow(ax, tuple(middle - half), tuple(middle + half))


def _arrow(ax: Axes, start: tuple[float, ...], end: tuple[float, ...]) -> None:
    """An arrow between two places in parts of the panel."""
    ax.annotate(
        "",
        xy=(end[0], end[1]),
        xytext=(start[0], start[1]),
        xycoords="axes fraction",
        textcoords="axes fraction",
        arrowprops={"arrowstyle": "-|>", "color": "black", "lw": 1.0},
        gid="arrow",
    )


def _limits(grid: MapGrid) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ends of a map along x and along y, m: the form, and room for arrows above it."""
    rows, places = np.nonzero(grid.is_form)
    east, north = grid.x[places], grid.y[rows]
    room = MARGIN * max(float(np.ptp(east)), float(np.ptp(north)))
    along_x = (float(east.min()) - room, float(east.max()) + room)
    return along_x, (float(north.min()) - room, float(north.max()) + 2 * room)


def _frame(axes: Sequence[Axes], columns: int, grid: MapGrid) -> None:
    """Limits and labels of the maps; a scale and the north on the first of them."""
    first = axes[0]
    along_x, along_y = _limits(grid)
    first.set_xlim(along_x)
    first.set_ylim(along_y)
    last = columns * ((len(axes) - 1) // columns)
    for number, ax in enumerate(axes):
        ax.set_aspect("equal")
        ax.ticklabel_format(useOffset=False, style="plain")
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_locator(MaxNLocator(MOST_NUMBERS))
        if number % columns == 0:
            ax.set_ylabel("y, m (north)")
        if number >= last:
            ax.set_xlabel("x, m (east)")
    _scale(first)


def _scale(ax: Axes) -> None:
    """A bar of round length below, and the north above it, in the right corner."""
    low, high = ax.get_xlim()
    bottom, top = ax.get_ylim()
    length = nice((high - low) / 4)
    right = high - 0.05 * (high - low)
    level = bottom + 0.06 * (top - bottom)
    ax.plot([right - length, right], [level, level], color="black", lw=2, gid="scale")
    words: style.Look = {"ha": "center", "va": "bottom"}
    ax.text(
        right - length / 2, level + 0.015 * (top - bottom), f"{length:g} m", **words
    )
    _arrow(ax, (0.93, 0.8), (0.93, 0.93))
    ax.text(0.93, 0.935, "N", transform=ax.transAxes, **words)


@dataclass(frozen=True)
class ShareCurve:
    """The fraction of a surface above threshold against the wind of one direction.

    Attributes
    ----------
    title
        The direction in words.
    moving
        Fractions at the winds of the figure.
    leaving
        Those of grains that are entrained without a gust; empty where these are alike.
    """

    title: str
    moving: FloatArray
    leaving: FloatArray


@dataclass(frozen=True)
class Mark:
    """A wind that is named at the first curve, with its interval.

    Attributes
    ----------
    wind, low, high
        The wind and the ends of its interval, m/s.
    share
        The fraction of the surface.
    words
        What it is.
    """

    wind: float
    low: float
    high: float
    share: float
    words: str


FIRST: style.Look = {"color": style.ANSWER, "lw": 2.0, "zorder": 3}
LAST: style.Look = {"color": style.FLOW, "ls": (0, (5, 2)), "zorder": 2}
BETWEEN: style.Look = {"color": "0.7", "lw": 0.8, "zorder": 1}
"""Looks of the directions that move first and last, and of all others."""


LOW = 0.1
"""Fraction of the surface up to which a mark is named below the curve."""


def shares(
    curves: Sequence[ShareCurve],
    winds: FloatArray,
    speed: str,
    marks: Sequence[Mark],
    flat: float,
) -> Canvas:
    """Draw the fraction of a surface that is above threshold against the wind.

    Parameters
    ----------
    curves
        A curve for each direction, the one that moves first at the beginning.
    winds
        The winds, m/s.
    speed
        What they are, in words.
    marks
        Winds of the first curve that are named.
    flat
        The wind in which flat ground moves, m/s.

    Returns
    -------
    Canvas
        The figure.
    """
    axes = (f"{speed}, m/s", "surface above threshold, %")
    canvas, (ax,) = style.grid([""], 3.4, *axes)
    first, *others = curves
    ax.plot(winds, 100 * first.moving, label=f"{first.title}, the first", **FIRST)
    if len(first.leaving):
        look = {**FIRST, "ls": ":"}
        words = "the same, entrained without a gust"
        ax.plot(winds, 100 * first.leaving, label=words, **look)
    for place, each in enumerate(others, 1):
        is_last = place == len(others)
        look = LAST if is_last else BETWEEN
        label = f"{each.title}, the last" if is_last else "directions between"
        ax.plot(winds, 100 * each.moving, label=label, **look)
    ax.axvline(flat, color="0.4", lw=0.8, ls=":")
    where = ax.get_xaxis_transform()
    words = f" flat ground {flat:.3g}"
    ax.text(flat, 0.97, words, transform=where, color="0.3", va="top")
    for mark in marks:
        _mark(ax, mark)
    ax.set(xlim=(0, float(winds[-1])), ylim=(0, 100))
    has_several = others or len(first.leaving)
    style.legends_below(canvas, [], style.samples([ax]) if has_several else [])
    return canvas


def _mark(ax: Axes, mark: Mark) -> None:
    """A point of the first curve with its interval and its number."""
    y = 100 * mark.share
    off = [[mark.wind - mark.low], [mark.high - mark.wind]]
    look: style.Look = {"color": style.ANSWER, "zorder": 4, "clip_on": False}
    ax.errorbar([mark.wind], [y], xerr=off, fmt="o", ms=6, capsize=3, **look)
    # below the curve where that begins, else above it
    is_low = mark.share < LOW
    ax.annotate(
        f"{mark.words} {mark.wind:.3g}",
        (mark.high if is_low else mark.low, y),
        xytext=(6, 4) if is_low else (-6, 4),
        textcoords="offset points",
        ha="left" if is_low else "right",
        color=style.ANSWER,
        weight="bold",
    )
