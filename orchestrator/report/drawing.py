"""Drawings below the answer card, in the colours of the page, for two widths.

Each is drawn twice, for a page and for a telephone; the style of the page shows one.
"""

import re
from collections.abc import Callable
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import LogLocator, NullFormatter

from orchestrator.report import single, style
from orchestrator.report.subjects import Quantity

WIDE = 1136
NARROW = 360
"""Widths of a drawing, px."""
PX = 1 / 100
"""Inches of a px at the resolution of the drawings."""
TEXT = 9.4
"""Size of text, points: 13 px."""
SMALL = 8.7
"""Size of the numbers of axes, points: 12 px."""
COLOURS = {
    "#c24e00": "answer",
    "#f7ddc8": "pale",
    "#0072b2": "flow",
    "#1d1d1b": "ink",
    "#57534c": "soft",
    "#d8d3c7": "line",
    "#767676": "none",
    "#dccfae": "sand",
    "#8d7f5c": "edge",
    "#fefefe": "ground",
}
"""Colours of drawings, and their names in the style of the page."""
ANSWER = "#c24e00"
PALE = "#f7ddc8"
FLOW = "#0072b2"
INK = "#1d1d1b"
SOFT = "#57534c"
LINE = "#d8d3c7"
NONE = "#767676"
SAND = "#dccfae"
EDGE = "#8d7f5c"
GROUND = "#fefefe"
RC: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.size": TEXT,
    "text.color": INK,
    "axes.edgecolor": LINE,
    "axes.labelcolor": INK,
    "xtick.color": LINE,
    "ytick.color": LINE,
    "xtick.labelcolor": SOFT,
    "ytick.labelcolor": SOFT,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "axes.titlesize": TEXT,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 4,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "grid.color": LINE,
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "savefig.transparent": True,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
}
"""Settings of drawings beside those of all figures."""


class Head(NamedTuple):
    """A picture below a card.

    Attributes
    ----------
    draw
        Draws it, for a width that is narrow or not.
    title
        What it shows, for who cannot see it.
    caption
        A sentence or two below it.
    """

    draw: Callable[[bool], Canvas]
    title: str
    caption: str


def written(head: Head) -> Markup:
    """Write a picture as HTML, drawn for both widths.

    Parameters
    ----------
    head
        The picture.

    Returns
    -------
    Markup
        Two SVG drawings, of which the style shows one.
    """
    drawings = []
    with matplotlib.rc_context(RC):
        for name, narrow in (("wide", False), ("narrow", True)):
            drawings.append(_svg(head.draw(narrow), head.title, name))
    return Markup("\n").join(drawings)


def _svg(canvas: Canvas, title: str, name: str) -> Markup:
    """The SVG of a drawing with the colours of the page."""
    text = style.svg(canvas).decode("utf-8")
    svg = text[text.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    # two drawings on one page have names of their own
    svg = re.sub(r'(id="|url\(#|href="#)', rf"\g<1>{name}-", svg)
    for colour, variable in COLOURS.items():
        svg = svg.replace(colour, f"var(--{variable})")
    svg = re.sub(r'(<svg [^>]*?)width="[^"]*" ', r"\1", svg, count=1)
    svg = re.sub(r'(<svg [^>]*?)height="[^"]*" ', r"\1", svg, count=1)
    svg = svg.replace("font-family: 'DejaVu Sans'", "font-family: inherit")
    label = f'<svg class="draw {name}" role="img" aria-label="{Markup.escape(title)}"'
    return Markup(svg.replace("<svg", label, 1))


def figure(narrow: bool, height: float) -> Canvas:
    """Make an empty drawing of one of the widths.

    Parameters
    ----------
    narrow
        Whether it is for a telephone.
    height
        Its height, px.

    Returns
    -------
    Figure
        The drawing.
    """
    width = NARROW if narrow else WIDE
    return Canvas(figsize=(width * PX, height * PX), dpi=100)


def margins(
    canvas: Canvas, left: float, right: float, top: float, bottom: float
) -> None:
    """Set the margins of a drawing.

    Parameters
    ----------
    canvas
        The drawing.
    left, right, top, bottom
        The margins, px.
    """
    width, height = canvas.get_size_inches() / PX
    canvas.subplots_adjust(
        left=left / width,
        right=1 - right / width,
        top=1 - top / height,
        bottom=bottom / height,
    )


def log_sizes(ax: Axes) -> None:
    """Set plain numbers at 1, 2 and 5 on a logarithmic axis of sizes.

    Parameters
    ----------
    ax
        The axes.
    """
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())


def in_units(row: pd.Series, ustar: Any, told: Quantity) -> Any:
    """Convert friction velocities to the quantity that a flow is told by.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.
    ustar
        Friction velocities, m/s, shape (n,).
    told
        The quantity.

    Returns
    -------
    ndarray
        In its unit, shape (n,).
    """
    return np.array([single.in_unit(row, float(one), told) for one in ustar])


def ratio(row: pd.Series) -> float:
    """Compute the measured over the computed threshold of one grain on a level bed.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    float
        The ratio of the friction velocities.
    """
    return float(row["measured_level_ustar_m_s"]) / float(row["level_ustar_m_s"])
