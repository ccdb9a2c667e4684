"""The numbers that a drawing shows, as a table of its own."""

import re
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

from orchestrator.tables import FORMULA
from orchestrator.types import FloatArray

EMPTY = np.empty((0, 2))
HEAD = "panel,curve,x axis,x,y axis,y"
"""The columns of the table of a figure."""


def numbers(canvas: Canvas) -> str:
    """Write the points of all curves of a drawing.

    Parameters
    ----------
    canvas
        The drawing.

    Returns
    -------
    str
        CSV with the columns of `HEAD`: a row for each point of a line, of a group of
        markers, of a bar and of the edge of a band, with six digits. Empty where a
        drawing has none.
    """
    rows: list[str] = []
    labels = [_labels(ax) for ax in canvas.axes]
    for number, ax in enumerate(canvas.axes):
        x, y = (own or _first(labels, at) for at, own in enumerate(labels[number]))
        panel = ax.get_title(loc="left") or str(number + 1)
        for name, points in _curves(ax):
            start = f"{_quoted(panel)},{_quoted(name)},{_quoted(x)},"
            middle = f",{_quoted(y)},"
            for a, b in points[np.isfinite(points).all(axis=1)].tolist():
                rows.append(f"{start}{a:.6g}{middle}{b:.6g}")
    return "\n".join([HEAD, *rows, ""]) if rows else ""


def _labels(ax: Axes) -> tuple[str, str]:
    """The labels of the axes of a panel."""
    return ax.get_xlabel(), ax.get_ylabel()


def _first(labels: Sequence[tuple[str, str]], at: int) -> str:
    """The label that panels share: those inside of a figure have none."""
    return next((each[at] for each in labels if each[at]), "")


def _curves(ax: Axes) -> Iterator[tuple[str, FloatArray]]:
    """What a panel shows, by name, in the units of its axes."""
    for artist in (*ax.lines, *ax.collections, *ax.patches):
        points = _points(artist, ax)
        if points is not None and len(points):
            yield _name(artist), points


def _points(artist: Artist, ax: Axes) -> FloatArray | None:
    """The points of an artist; None where it is not on the axes of its panel."""
    if isinstance(artist, PathCollection):
        return np.asarray(artist.get_offsets(), float)
    if not artist.get_transform().contains_branch(ax.transData):
        return None
    if isinstance(artist, Line2D):
        return np.asarray(artist.get_xydata(), float)
    if isinstance(artist, LineCollection):
        return _joined(artist.get_segments())
    if isinstance(artist, PolyCollection):
        return _joined([path.vertices for path in artist.get_paths()])
    if isinstance(artist, Rectangle):
        return np.asarray(artist.get_bbox().get_points(), float)
    return None


def _joined(parts: Sequence[ArrayLike]) -> FloatArray:
    """The points of all parts."""
    whole = [np.asarray(part, float).reshape(-1, 2) for part in parts]
    return np.concatenate([EMPTY, *whole])


def _name(artist: Artist) -> str:
    """What a curve is called: by its label, or else by the name of its group."""
    label = str(artist.get_label())
    if label and not label.startswith("_"):
        return label
    return str(artist.get_gid() or "")


def _quoted(text: str) -> str:
    """A text as a cell: on one line, without the marks of formulas."""
    plain = " ".join(text.replace("$", "").split())
    if re.match(FORMULA, plain):
        plain = f"'{plain}"
    if any(mark in plain for mark in ',"'):
        return '"' + plain.replace('"', '""') + '"'
    return plain
