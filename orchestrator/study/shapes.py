"""The shapes of a form on the bed.

Each has a name, its fields, and its corners.

The corners of a form, shape (n, 2), go downstream from its foot at the origin to its
toe, m. A new shape is one entry of `SHAPES`; mesh, packing, checks, labels and the
study file follow.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, exp, pi, radians, sin, sqrt, tan
from typing import Literal, Protocol

import numpy as np

from orchestrator.physics.measured import rushil_aspect, rushil_form
from orchestrator.types import FloatArray

CHORDS, ARC_DEG = 40, 2.0
"""Chords of a windward side that is a curve, and the bend between two of a rounded
brink."""
GAUSSIAN_END = 3.5
"""Where a Gaussian hill is cut, standard deviations: it is let down by 0.2 % of its
height."""


class Form(Protocol):
    """What the corners of a form follow from: fields of a bed, lengths in m."""

    @property
    def shape(self) -> str:
        """Name of the shape."""

    @property
    def height(self) -> float:
        """Height of the form."""

    @property
    def slope_deg(self) -> float:
        """Slope of its windward side, degrees."""

    @property
    def lee_slope(self) -> float:
        """Slope of its lee side, degrees."""

    @property
    def level_length(self) -> float:
        """Length of its level part."""

    @property
    def windward(self) -> str:
        """Whether the windward side is straight or curved."""

    @property
    def brink_radius(self) -> float:
        """Radius of its brink."""


@dataclass(frozen=True)
class Shape:
    """The facts of one shape.

    Attributes
    ----------
    name
        Its name.
    meaning
        What it is, in words.
    corners
        Makes the corners of one form of a bed.
    fields
        Fields of the bed that not all shapes have, and this one has.
    label
        What figures call it, where that is not the name.
    rises
        Whether it has a windward side, whose slope is the bed's.
    lee_slope_deg
        Slope of the lee side by default, degrees; None is that of the windward side.
    counted
        Exposed grains that count by default.
    """

    name: str
    meaning: str
    corners: Callable[[Form], FloatArray]  # of one form of a bed
    fields: tuple[
        str, ...
    ] = ()  # of the bed that not all shapes have, and this one has
    label: str = ""  # in figures, where that is not the name
    rises: bool = True  # whether it has a windward side, whose slope is the bed's
    lee_slope_deg: float | None = None  # by default; None: that of the windward side
    counted: Literal["windward", "all"] = "windward"  # exposed grains, by default


def _faces(bed: Form) -> FloatArray:
    """Two straight faces."""
    up, down = (
        bed.height / tan(radians(slope)) for slope in (bed.slope_deg, bed.lee_slope)
    )
    return np.array([[0, 0], [up, bed.height], [up + down, 0]])


def _trapezoid(bed: Form) -> FloatArray:
    foot, crest, toe = _faces(bed)
    return np.array([foot, crest, *np.add([crest, toe], [bed.level_length, 0])])


def _dune(bed: Form) -> FloatArray:
    """A windward side, straight or curved, and a slip face.

    Its brink is sharp or rounded.
    """
    if bed.windward == "curved":
        t = np.linspace(0, 1, CHORDS + 1)
        face = bed.height / tan(radians(bed.slope_deg))
        windward = np.column_stack(
            [pi / 2 * face * t, bed.height / 2 * (1 - np.cos(pi * t))]
        )
    else:
        windward = _faces(bed)[:2]
    slip = windward[-1] + [bed.height / tan(radians(bed.lee_slope)), -bed.height]
    corners = np.vstack([windward, slip])
    return _rounded(corners, bed.brink_radius) if bed.brink_radius else corners


def _rounded(corners: FloatArray, radius: float) -> FloatArray:
    """A dune with an arc in place of its brink.

    It touches the line before and behind it.
    """
    brink = len(corners) - 2
    steps = np.diff(corners, axis=0)
    rise = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    behind = rise[brink]
    # the arc begins on the chord from which it can reach the slip face
    for first in range(brink - 1, -1, -1):
        start, direction = corners[first], rise[first]
        ways = np.array(
            [[cos(direction), -cos(behind)], [sin(direction), -sin(behind)]]
        )
        meet = start + np.linalg.solve(ways, corners[brink] - start)[0] * ways[:, 0]
        cut = radius * tan((direction - behind) / 2)
        if cut <= np.hypot(*(meet - start)):
            break
    count = int(np.ceil(np.degrees(direction - behind) / ARC_DEG)) + 1
    angles = np.linspace(direction, behind, count)
    begin = meet - cut * np.array([cos(direction), sin(direction)])
    centre = begin + radius * np.array([sin(direction), -cos(direction)])
    arc = centre + radius * np.column_stack([-np.sin(angles), np.cos(angles)])
    # no sliver between a corner and the arc
    near = np.hypot(*(arc[0] - corners[first])) < np.hypot(*(arc[1] - arc[0])) / 2
    return np.vstack(
        [corners[: first + (not near or not first)], arc, corners[brink + 1 :]]
    )


def _cosine(bed: Form) -> FloatArray:
    t = np.linspace(0, 1, 2 * CHORDS + 1)
    length = pi * bed.height / tan(radians(bed.slope_deg))
    return np.column_stack([length * t, bed.height / 2 * (1 - np.cos(2 * pi * t))])


def _gaussian(bed: Form) -> FloatArray:
    t = np.linspace(-GAUSSIAN_END, GAUSSIAN_END, 3 * CHORDS + 1)
    deviation = bed.height / tan(radians(bed.slope_deg)) / sqrt(exp(1))
    end = exp(-(GAUSSIAN_END**2) / 2)
    z = bed.height * (np.exp(-(t**2) / 2) - end) / (1 - end)
    return np.column_stack([deviation * (t + GAUSSIAN_END), z])


def _rushil(bed: Form) -> FloatArray:
    x, z = rushil_form(rushil_aspect(bed.slope_deg))
    return bed.height * np.column_stack([x - x[0], z])


def _level(bed: Form) -> FloatArray:
    """Level bed, behind a face up to it or before a face down from it."""
    height, length = bed.height, bed.level_length
    if bed.shape == "step up":
        face = height / tan(radians(bed.slope_deg))
        return np.array([[0, 0], [face, height], [face + length, height]])
    level = np.array([[0, 0], [length, 0]])
    down = [length + height / tan(radians(bed.lee_slope or 90)), -height]
    return np.vstack([level, down]) if bed.shape == "step down" else level


TRAIN, LEE, LEVEL = ("forms", "spacing"), ("lee_slope_deg",), ("length",)
DUNE = ("windward", "brink_radius", *TRAIN, *LEE)
SLIP_FACE_DEG = 30.0  # lee slope of a dune and of a step down
DOWN: tuple[bool, float, Literal["all"]] = (False, SLIP_FACE_DEG, "all")
_LISTED = (
    Shape("triangle", "two straight faces", _faces, TRAIN + LEE),
    Shape(
        "dune",
        "a windward side and a slip face",
        _dune,
        DUNE,
        lee_slope_deg=SLIP_FACE_DEG,
    ),
    Shape(
        "cosine",
        "one wave of a cosine, trough to trough",
        _cosine,
        TRAIN,
        "wave of a cosine",
    ),
    Shape("gaussian", "a Gaussian hill", _gaussian, TRAIN, "Gaussian hill"),
    Shape(
        "rushil", "a hill of the wind tunnel RUSHIL", _rushil, TRAIN, "hill of RUSHIL"
    ),
    Shape(
        "trapezoid",
        "two straight faces and a level top",
        _trapezoid,
        LEVEL + TRAIN + LEE,
    ),
    Shape("step up", "a straight face up to higher ground", _level, LEVEL),
    Shape(
        "step down",
        "a straight face down to lower ground",
        _level,
        LEVEL + LEE,
        "",
        *DOWN,
    ),
    Shape("flat", "level bed", _level, LEVEL, rises=False, counted="all"),
)
SHAPES = {
    shape.name: shape for shape in _LISTED
}  # all shapes, by what a study file calls them
