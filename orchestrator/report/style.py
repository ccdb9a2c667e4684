"""How all figures look: settings, sizes, colours by meaning, legends, files."""

import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from io import BytesIO
from typing import Any, Literal, TypeVar

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import to_hex
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.ticker import LogLocator, NullFormatter

from orchestrator.report import plotted
from orchestrator.report.field import is_field
from orchestrator.runs.files import Folder

RC: dict[Any, Any] = {
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    # numbers at minor ticks stand in line with those at major ones
    "xtick.minor.pad": 5,
    "ytick.minor.pad": 5,
    # matplotlib brings it: no font of the machine is used
    "font.sans-serif": ["DejaVu Sans"],
    "axes.linewidth": 0.6,
    "axes.titley": 1.0,  # else matplotlib looks for ticks above each panel
    "lines.linewidth": 1.2,
    "lines.markersize": 4.2,
    "mathtext.fontset": "dejavusans",
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "svg.hashsalt": "orchestrator",
    "figure.dpi": 200,
}
"""Settings that differ from matplotlib's defaults."""
SIZES = [name for name in RC if name.endswith("size") and name != "lines.markersize"]
"""Settings that are sizes of letters."""
WIDTH = 7.0
"""Width of a figure of an experiment, across two columns of a paper, inches."""
NARROW = 4.4
"""Width of a drawing that a narrow page shows whole, with letters to read, inches."""
WIDE = 9.2
"""Width of the same figure for a wide page, where it has a drawing of its own, inches.
"""
LETTERS = 11.0
"""Size of the letters of these two, points: 12 pixels on a page of 400."""
SIDES = (5.6, 1.1)
"""Margins of panels, left and right, in sizes of a letter."""
UNDER = 3.8
"""Height of the numbers and the label of an x axis, in sizes of a letter."""
LINE = 1.6
"""Height of a line of a title or a legend, in sizes of a letter."""
PANELS = 4
"""Largest number of panels of a figure."""
SHADES = {
    "beta_deg": ("viridis", 0.0, 0.85),
    "nu_m2_s": ("viridis", 0.0, 0.85),
    "alpha_deg": ("plasma", 0.0, 0.82),
    "fraction": ("YlGnBu", 0.35, 1.0),
    "d_m": ("turbo", 0.05, 0.95),
}
"""Colour maps of quantities that rise in steps; of diameters, if there are many."""
IN_ONE_CLIP = re.compile(
    rb'(<g clip-path="[^"]*">)\s*<use [^>]*/>\s*</g>'
    rb"(?:\s*\1\s*<use [^>]*/>\s*</g>)+"
)
"""Points of a drawing that follow each other, each in a group of its own."""
IN_ONE_STYLE = re.compile(
    rb'<use [^>]*? style="((?:(?!(?<!-)opacity)[^"])*)"/>'
    rb'(?:\s*<use [^>]*? style="\1"/>)+'
)
"""Points that have the same style, but for an opacity, which of a group is another."""
FIGURES = "figures"
"""The folder of the figures, in a directory of results."""
DIAMETERS = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#56b4e9",
    "#e69f00",
    "#555555",
    "#7b3294",
)
"""Colours of a few diameters."""
WATER = "#74aed6"
AIR = "#8c6d46"
BED = "#d9c9a3"
EDGE = "#8d7f5c"
"""The line on a bed."""
ANSWER = "#c24e00"
"""What is computed."""
PALE = "#f7ddc8"
"""The interval of what is computed."""
FLOW = "#0072b2"
"""The flow, and other models."""
INK = "#1d1d1b"
"""What was measured, or is computed with what was measured."""
MEASURED: Any = (0, (4, 2))
"""Dash of such lines."""
NONE = "#767676"
"""What is out of range, or not usable."""
RANGE = "#d8d3c7"
"""A range of measurements, and flow that runs back."""
Panel = TypeVar("Panel")
Look = dict[str, Any]
"""Properties of an artist."""
_ARROW = np.array([[0, 0], [0, 1], [-0.18, 0.72], [0, 1], [0.18, 0.72]])
_STROKES = [Path.MOVETO, Path.LINETO, Path.MOVETO, Path.LINETO, Path.LINETO]
ARROW = 36.0
"""Size of a marker of an open interval: its arrow is half of it long, points."""
UP, RIGHT = (Path(points, _STROKES) for points in (_ARROW, _ARROW[:, ::-1]))
"""Markers of intervals that are open above, or to the right: arrows of one length."""
NOTE: Look = {"color": "0.35", "gid": "note"}
OTHERS: tuple[Look, ...] = (
    {"color": FLOW, "ls": (0, (5, 2))},
    {"color": INK, "ls": (0, (1.5, 1.5))},
    {"color": NONE, "ls": (0, (6, 2, 1.5, 2))},
)
"""Looks of what stands beside a solid line in the colour of the answer."""


Place = Literal["lead", "under", "", "folded"]
"""Where a page has a figure: below its card, below that, among all, or on demand."""


@dataclass(frozen=True)
class Figure:
    """A drawing, its words, and the directories of the cases behind it.

    Attributes
    ----------
    name
        Stem of its file.
    title
        Its heading.
    caption
        What it shows; folded away where it has a `lead`.
    cases
        Names of the cases behind it.
    drawing
        A drawing of matplotlib, or a function that draws it; None where it is an image.
    image
        What a page shows, SVG or PNG; empty until it is made.
    data
        Data for the page's script, a pointer or a slider; None if there are none.
    place
        Where the page of a study has it; the first of several that lead does.
    follows
        The figure of the paper that it follows, such as ``Fig. 15``; mostly none.
    part
        Its width over that of the page.
    narrow
        The same for a narrow page, where that has a drawing of its own.
    narrow_image
        What a narrow page shows, SVG; empty where it shows the same.
    tables
        The tables that it is drawn from.
    numbers
        The numbers that it shows, as CSV; empty until it is drawn, or without any.
    has_png
        Whether a file of it as PNG is beside the SVG.
    lead
        The sentence under it that is never folded, where its caption is long.
    has_field
        Whether a PNG that the page shows has a field of colours.
    """

    name: str
    title: str
    caption: str
    cases: tuple[str, ...]
    drawing: Canvas | Callable[[], Canvas] | None
    image: bytes = b""
    data: Any = None
    place: Place = ""
    follows: str = ""
    part: float = 1.0
    tables: tuple[str, ...] = ()
    narrow: Callable[[], Canvas] | None = None
    narrow_image: bytes = b""
    numbers: str = ""
    has_png: bool = False
    lead: str = ""
    has_field: bool = False

    @classmethod
    def of_both_widths(
        cls, name: str, title: str, caption: str, draw: Callable[[float], Canvas]
    ) -> "Figure":
        """Make a figure that is drawn anew for a narrow page.

        Parameters
        ----------
        name, title, caption
            As those of the figure.
        draw
            Draws it in a width, inches.

        Returns
        -------
        Figure
            The figure, as wide as a page, without cases.
        """
        wide, narrow = (partial(draw, width) for width in (WIDE, NARROW))
        return cls(name, title, caption, (), wide, narrow=narrow)

    @cached_property
    def canvas(self) -> Canvas | None:
        """The drawing, made when it is asked for."""
        return self.drawing() if callable(self.drawing) else self.drawing


def settings(letters: float | None = None) -> AbstractContextManager[None]:
    """Draw by matplotlib's defaults and `RC` alone, not by a matplotlibrc.

    Parameters
    ----------
    letters
        Size of all letters, points; by default those of `RC`.

    Returns
    -------
    context manager
        The settings hold while its block runs.
    """
    defaults: dict[Any, Any] = dict(matplotlib.rcParamsDefault)
    del defaults["backend"]  # figures are made without a window
    sizes: dict[Any, Any] = dict.fromkeys(SIZES, letters) if letters else {}
    return matplotlib.rc_context({**defaults, **RC, **sizes})


def inches(letters: float) -> float:
    """A length in sizes of a letter, of the settings that hold, in inches.

    Parameters
    ----------
    letters
        The length, in sizes of a letter.

    Returns
    -------
    float
        The length in inches.
    """
    return letters * float(matplotlib.rcParams["font.size"]) / 72


def palette(column: str, values: Sequence[float]) -> dict[float, str]:
    """Choose a colour for each value of a column, the same in every figure of a study.

    Parameters
    ----------
    column
        ``d_m``, or another key of `SHADES`.
    values
        All values of the study.

    Returns
    -------
    dict of float to str
        Colours in hexadecimal, by value.
    """
    if column == "d_m" and len(values) <= len(DIAMETERS):
        return dict(zip(values, DIAMETERS, strict=False))
    name, first, last = SHADES[column]
    step = (last - first) / max(len(values) - 1, 1)
    colours = {}
    for place, value in enumerate(values):
        colours[value] = to_hex(colormaps[name](first + place * step))
    return colours


def canvas(height: float, width: float = WIDTH) -> Canvas:
    """Make an empty figure.

    Parameters
    ----------
    height
        Its height, inches.
    width
        Its width, inches; by default that of the page.

    Returns
    -------
    matplotlib.figure.Figure
        The figure, laid out when it is drawn.
    """
    return Canvas(figsize=(width, height), layout="compressed")


def grid(
    titles: Sequence[str],
    height: float,
    x: str,
    y: str,
    columns: int = 1,
    *,
    sharey: bool = True,
    width: float = NARROW,
) -> tuple[Canvas, list[Axes]]:
    """Make a figure of panels, which all share x.

    Its margins are fixed: to measure all texts takes as long as to draw them.

    Parameters
    ----------
    titles
        The title of each panel.
    height
        Height of a panel, inches.
    x, y
        Labels of the axes.
    columns
        Panels beside each other, at most.
    sharey
        Whether all panels share y.
    width
        Its width, inches.

    Returns
    -------
    figure : matplotlib.figure.Figure
        The figure.
    axes : list of Axes
        Its panels, in the order of their titles.
    """
    columns = min(len(titles), columns)
    lines = -(-len(titles) // columns)
    left, right = (inches(side) for side in SIDES)
    above = 0.0
    if any(titles):
        lines_of_titles = max(title.count("\n") + 1 for title in titles)
        above = inches(LINE) * lines_of_titles + right
    between = 2 * right if sharey else left + right
    wide = (width - left - right - (columns - 1) * between) / columns
    figure = Canvas(figsize=(width, lines * height + (lines - 1) * above))
    figure.subplots_adjust(
        left=left / width,
        bottom=0.0,
        right=1 - right / width,
        top=1.0,
        wspace=between / wide,
        hspace=above / height,
    )
    extend(figure, above + right, inches(UNDER))
    grid_of_axes = figure.subplots(
        lines, columns, sharex=True, sharey=sharey, squeeze=False
    )
    every = grid_of_axes.ravel()
    axes: list[Axes] = list(every[: len(titles)])
    for unused in every[len(titles) :]:
        unused.remove()
    for lowest in axes[-columns:]:
        lowest.tick_params(axis="x", which="both", labelbottom=True)
        lowest.set_xlabel(x)
    for leftmost in axes[::columns]:
        leftmost.set_ylabel(y)
    for ax, title in zip(axes, titles, strict=True):
        ax.set_title(title, loc="left")
    return figure, axes


def extend(figure: Canvas, above: float, below: float) -> None:
    """Make a figure of fixed margins higher.

    Parameters
    ----------
    figure
        The figure.
    above, below
        What is added above and below its panels, inches.
    """
    height = figure.get_figheight()
    places = figure.subplotpars
    bottom = places.bottom * height + below
    top = (1 - places.top) * height + above
    whole = height + above + below
    figure.set_figheight(whole)
    figure.subplots_adjust(bottom=bottom / whole, top=1 - top / whole)


def pages(panels: Sequence[Panel]) -> Iterator[tuple[str, str, Sequence[Panel]]]:
    """Share panels out among figures, at most `PANELS` to each.

    Parameters
    ----------
    panels
        The panels.

    Yields
    ------
    name, title : str
        Endings of the figure's name and title; of the first figure empty.
    panels : sequence
        Its panels.
    """
    for number, start in enumerate(range(0, len(panels), PANELS)):
        shown = panels[start : start + PANELS]
        if number == 0:
            yield "", "", shown
        else:
            yield f"-{number + 1}", f", more panels ({number})", shown


def legends_below(
    figure: Canvas, colours: Sequence[Artist], looks: Sequence[Artist]
) -> None:
    """Place the legend of colours above the panels and all other samples below them.

    Parameters
    ----------
    figure
        The figure.
    colours
        Samples of colours; a single one is left out.
    looks
        Samples of lines and marks.
    """
    # one colour tells nothing apart
    several = colours if len(colours) > 1 else []
    above = _legend(figure, several, 6, "outside upper center")
    below = _legend(figure, looks, 3, "outside lower center")
    if not figure.get_layout_engine():
        extend(figure, above, below)


def _legend(figure: Canvas, items: Sequence[Artist], most: int, place: str) -> float:
    """Place a legend of at most so many columns; its height, inches."""
    if not items:
        return 0.0
    fits = int((figure.get_figwidth() / inches(1.0) - 6.0) / 0.6)
    for item in items:
        item.set_label("\n".join(textwrap.wrap(str(item.get_label()), fits)))
    longest = max(len(str(item.get_label())) for item in items)
    wide = inches(5.0 + 0.57 * longest)  # a sample, and letters
    columns = max(1, min(most, int(figure.get_figwidth() / wide)))
    look: Look = {"handles": items, "loc": place, "ncols": columns}
    figure.legend(**look)
    more = sum(str(item.get_label()).count("\n") for item in items)
    lines = -(-len(items) // columns) + more
    return inches(lines * LINE + SIDES[1])


def samples(axes: Sequence[Axes]) -> list[Artist]:
    """Collect the entries of a legend.

    Parameters
    ----------
    axes
        The panels.

    Returns
    -------
    list of Artist
        One for each label of what is in a frame; dark where those of a label differ in
        colour.
    """
    entries: dict[str, Any] = {}
    for ax in axes:
        for item in (*ax.collections, *ax.lines):
            label = str(item.get_label())
            if label.startswith("_") or not _is_in_frame(item, ax):
                continue
            before = entries.setdefault(label, copy(item))
            if isinstance(item, Line2D) and before.get_color() != item.get_color():
                before.set(color="0.2", markeredgecolor="0.2")
                if before.get_markerfacecolor() != "white":
                    before.set_markerfacecolor("0.2")
    for label, sample in entries.items():
        sample.set_label(label.replace("θ_c", "$θ_c$"))
    return list(entries.values())


def _is_in_frame(item: Artist, ax: Axes) -> bool:
    """Whether a point of a line is in the frame of its panel.

    Other artists and empty lines are.
    """
    if not isinstance(item, Line2D):
        return True
    points = np.asarray(item.get_xydata(), float)
    return not len(points) or bool(ax.viewLim.count_contains(points))


def entry(label: str, colour: str) -> Line2D:
    """Make a legend's sample of a colour.

    Parameters
    ----------
    label
        What has the colour.
    colour
        The colour.

    Returns
    -------
    Line2D
        The sample.
    """
    return Line2D([], [], color=colour, lw=2.5, label=label)


def plain_ticks(axis: Axis) -> None:
    """Write numbers such as 0.01 or 20 on a logarithmic axis: at 1, 2 and 5.

    Parameters
    ----------
    axis
        The axis, whose limits are set.
    """
    low, high = axis.get_view_interval()
    is_short = high < 5 * low
    axis.set_minor_locator(LogLocator(subs=range(2, 9) if is_short else (2, 5)))
    axis.set_major_formatter("{x:g}")
    # numbers beside each other take more room
    decades = 3.5 if axis is axis.axes.yaxis else 2.3
    has_room = high < 10**decades * low
    axis.set_minor_formatter("{x:g}" if has_room else NullFormatter())


def log_sizes(ax: Axes) -> None:
    """Set plain numbers at 1, 2 and 5 on a logarithmic x axis of sizes.

    Parameters
    ----------
    ax
        The panel.
    """
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())


def saved(figure: Figure, folder: Folder, *, png: bool = False) -> Figure:
    """Draw a figure and put it into a directory of results, as SVG.

    Parameters
    ----------
    figure
        The figure.
    folder
        The directory.
    png
        Whether it is put as PNG, too, which is its image then.

    Returns
    -------
    Figure
        The figure with its image.
    """
    raster = b""
    if png and figure.canvas is not None:
        raster = as_png(figure.canvas)
        folder.put(f"{FIGURES}/{figure.name}.png", raster)
        figure.canvas.set_layout_engine("none")  # it is laid out now
    made = drawn_as(figure)
    folder.put(f"{FIGURES}/{figure.name}.svg", made.image)
    if made.numbers:
        folder.put(f"{FIGURES}/{figure.name}.csv", made.numbers)
    return replace(
        made,
        image=raster or made.image,
        has_png=bool(raster),
        has_field=is_field(made.image),
    )


def drawn_as(figure: Figure) -> Figure:
    """Draw a figure as SVG.

    Returns
    -------
    Figure
        The figure with its image, in place of the drawing.
    """
    canvas = figure.canvas  # `savefig` would draw twice, once for the layout alone
    if canvas is None:
        return replace(figure, drawing=None)
    return replace(
        figure,
        drawing=None,
        narrow=None,
        image=svg(canvas),
        narrow_image=svg(figure.narrow()) if figure.narrow else b"",
        part=round(min(float(canvas.get_figwidth()) / WIDTH, 1.0), 3),
        numbers=figure.numbers or plotted.numbers(canvas),
    )


def as_png(drawn: Canvas) -> bytes:
    """Draw a figure as PNG.

    Parameters
    ----------
    drawn
        The figure.

    Returns
    -------
    bytes
        The image.
    """
    out = BytesIO()
    agg: Any = FigureCanvasAgg(drawn)
    agg.print_png(out, metadata={"Software": None})
    return out.getvalue()


def svg(drawn: Canvas) -> bytes:
    """Write a drawing as SVG, the same bytes each time.

    Parameters
    ----------
    drawn
        The drawing.

    Returns
    -------
    bytes
        The SVG.
    """
    out = BytesIO()
    canvas: Any = FigureCanvasSVG(drawn)
    canvas.print_svg(out, metadata={"Date": None})
    # hundredths of a point are enough; a scale stays as it is
    text = re.sub(rb"(?<!\(0)(\.\d\d)\d{2,}", rb"\1", out.getvalue())
    text = IN_ONE_CLIP.sub(_in_one_group, text)
    text = IN_ONE_STYLE.sub(_with_one_style, text)
    return re.sub(rb"\n +", b"\n", text)


def _in_one_group(found: re.Match[bytes]) -> bytes:
    """Points in one group that have a group each."""
    points = re.findall(rb"<use [^>]*/>", found[0])
    return b"\n".join([found[1], *points, b"</g>"])


def _with_one_style(found: re.Match[bytes]) -> bytes:
    """Points in a group with their style, which each of them has."""
    style = b' style="' + found[1] + b'"'
    points = found[0].replace(style, b"")
    return b"<g" + style + b">" + points + b"</g>"
