"""Small texts beside points, where they cover neither each other nor a point."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import Normal, Stroke
from matplotlib.text import Annotation, Text
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

DISTANCES = (5.0, 9.0, 14.0, 20.0, 28.0, 38.0, 50.0, 64.0, 80.0, 98.0)
"""From a point to its text, points; the nearest free place is taken."""
LEADER_FROM = 10.0
"""Distance from which a thin line leads from the text to its point."""
DIRECTIONS = np.radians([25, -25, 155, -155, 90, -90, 0, 180, 55, -55, 125, -125])
MARGIN = 1.5
"""Around a text, and half the width of a point, points."""


@dataclass(frozen=True)
class Tag:
    """A text and the point that it names, in the data's units."""

    text: str
    x: float
    y: float
    colour: str


def write(ax: Axes, tags: Sequence[Tag], points: FloatArray, size: float) -> None:
    """Write texts beside their points.

    Parameters
    ----------
    ax : Axes
        With its limits set; its figure is laid out.
    tags : sequence of Tag
        In the order in which they choose their places.
    points : ndarray, shape (n, 2)
        All points that no text shall cover, in the data's units.
    size : float
        Size of the font.
    """
    figure = ax.get_figure(root=True)
    assert figure is not None
    unit = 72 / figure.dpi
    frame = np.asarray(ax.get_window_extent().extents) * unit
    dots = ax.transData.transform(points) * unit if len(points) else np.empty((0, 2))
    taken = [np.concatenate([dot - 2 * MARGIN, dot + 2 * MARGIN]) for dot in dots]
    for tag in tags:
        drawn = _drawn(ax, tag, size)
        extent = Text.get_window_extent(drawn)
        place = ax.transData.transform((tag.x, tag.y)) * unit
        shape = np.array([extent.width, extent.height]) * unit + 2 * MARGIN
        corner, distance = _free(place, shape, np.array(taken), frame)
        taken.append(np.concatenate([corner, corner + shape]))
        drawn.set_position(tuple(corner + MARGIN - place))
        if distance < LEADER_FROM and drawn.arrow_patch:
            drawn.arrow_patch.set_visible(False)


def _drawn(ax: Axes, tag: Tag, size: float) -> Annotation:
    return ax.annotate(
        tag.text,
        (tag.x, tag.y),
        (0, 0),
        textcoords="offset points",
        fontsize=size,
        color="0.1",
        zorder=5,
        gid="tag",
        in_layout=False,
        path_effects=[Stroke(linewidth=1.8, foreground="white"), Normal()],
        arrowprops={"arrowstyle": "-", "lw": 0.4, "color": tag.colour, "shrinkA": 0, "shrinkB": 2},
    )


def _free(
    place: FloatArray, shape: FloatArray, taken: FloatArray, frame: FloatArray
) -> tuple[FloatArray, float]:
    """The lower left corner of the best box near a place, and its distance from that."""
    return min(
        _candidates(place, shape), key=lambda at: _covered(at[0], shape, taken, frame) + at[1]
    )


def _candidates(place: FloatArray, shape: FloatArray) -> Iterator[tuple[FloatArray, float]]:
    for distance in DISTANCES:
        for angle in DIRECTIONS:
            way = np.array([np.cos(angle), np.sin(angle)])
            # the box lies beyond its nearest point, on the side that the direction points to
            yield place + distance * way + shape * (np.sign(np.round(way, 3)) - 1) / 2, distance


def _covered(corner: FloatArray, shape: FloatArray, taken: FloatArray, frame: FloatArray) -> float:
    """Penalty of a box for points it covers and for leaving the frame; large against distances."""
    low, high = corner, corner + shape
    outside = np.maximum(frame[:2] - low, 0).sum() + np.maximum(high - frame[2:], 0).sum()
    if not len(taken):
        return float(1e3 * outside)
    overlap = np.minimum(high, taken[:, 2:]) - np.maximum(low, taken[:, :2])
    area = np.maximum(overlap, 0).prod(axis=1).sum()
    return float(1e3 * outside + 1e2 * area)
