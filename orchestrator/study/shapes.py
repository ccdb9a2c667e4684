"""The shapes of a form on the bed.

Each has a name, its fields, and its corners.

The corners of a form, shape (n, 2), go downstream from its foot at the origin to its
toe, m. A new shape is one entry of `SHAPES`; mesh, packing, checks, classes of known
errors, words of the page and the study file ask it. A field of the bed that no shape
has yet is declared beside the others, in `PileBed`.
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
        What a study file calls it.
    meaning
        What it is, in words.
    word
        What a question calls a bed of it, such as "pile".
    corners
        Makes the corners of one form of a bed.
    fields
        Fields of the bed that not all shapes have, and this one has.
    label
        What figures call it, where that is not the name.
    plural
        The plural of `word`, where that is not the word with an s.
    rises
        Whether it has a windward side, whose slope is the bed's.
    is_level
        Whether there is nothing to go over: its height only scales its length.
    is_curved
        Whether its sides are curves, without an edge at which a row of grains ends.
    is_wedge
        Whether it is two straight faces that meet in an edge, unless a field of the bed
        bends them.
    has_measured_flow
        Whether the flow over it was measured, at the slopes of `measured`.
    lee_slope_deg
        Slope of the lee side by default, degrees; None is that of the windward side.
    counted
        Exposed grains that count by default.
    """

    name: str
    meaning: str
    word: str
    corners: Callable[[Form], FloatArray]
    fields: tuple[str, ...] = ()
    label: str = ""
    plural: str = ""
    rises: bool = True
    is_level: bool = False
    is_curved: bool = False
    is_wedge: bool = False
    has_measured_flow: bool = False
    lee_slope_deg: float | None = None
    counted: Literal["windward", "all"] = "windward"

    @property
    def words(self) -> str:
        """What a question calls several beds of it."""
        return self.plural or f"{self.word}s"


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


def _step_up(bed: Form) -> FloatArray:
    """Level bed behind a face up to it."""
    height, length = bed.height, bed.level_length
    face = height / tan(radians(bed.slope_deg))
    return np.array([[0, 0], [face, height], [face + length, height]])


def _level(bed: Form) -> FloatArray:
    return np.array([[0, 0], [bed.level_length, 0]])


def _step_down(bed: Form) -> FloatArray:
    """Level bed before a face down from it."""
    foot = bed.level_length + bed.height / tan(radians(bed.lee_slope or 90))
    return np.vstack([_level(bed), [foot, -bed.height]])


TRAIN, LEE, LEVEL = ("forms", "spacing"), ("lee_slope_deg",), ("length",)
SLIP_FACE_DEG = 30.0
"""Lee slope of a dune and of a step down."""
_LISTED = (
    Shape(
        name="triangle",
        meaning="two straight faces",
        word="pile",
        corners=_faces,
        fields=TRAIN + LEE,
        is_wedge=True,
    ),
    Shape(
        name="dune",
        meaning="a windward side and a slip face",
        word="dune",
        corners=_dune,
        fields=("windward", "brink_radius", *TRAIN, *LEE),
        is_wedge=True,
        lee_slope_deg=SLIP_FACE_DEG,
    ),
    Shape(
        name="cosine",
        meaning="one wave of a cosine, trough to trough",
        word="hill",
        corners=_cosine,
        fields=TRAIN,
        label="wave of a cosine",
        is_curved=True,
    ),
    Shape(
        name="gaussian",
        meaning="a Gaussian hill",
        word="hill",
        corners=_gaussian,
        fields=TRAIN,
        label="Gaussian hill",
        is_curved=True,
    ),
    Shape(
        name="rushil",
        meaning="a hill of the wind tunnel RUSHIL",
        word="hill",
        corners=_rushil,
        fields=TRAIN,
        label="hill of RUSHIL",
        is_curved=True,
        has_measured_flow=True,
    ),
    Shape(
        name="trapezoid",
        meaning="two straight faces and a level top",
        word="pile with a level top",
        corners=_trapezoid,
        fields=LEVEL + TRAIN + LEE,
        plural="piles with a level top",
    ),
    Shape(
        name="step up",
        meaning="a straight face up to higher ground",
        word="step",
        corners=_step_up,
        fields=LEVEL,
    ),
    Shape(
        name="step down",
        meaning="a straight face down to lower ground",
        word="step",
        corners=_step_down,
        fields=LEVEL + LEE,
        rises=False,
        lee_slope_deg=SLIP_FACE_DEG,
        counted="all",
    ),
    Shape(
        name="flat",
        meaning="level bed",
        word="level bed",
        corners=_level,
        fields=LEVEL,
        rises=False,
        is_level=True,
        counted="all",
    ),
)
SHAPES = {shape.name: shape for shape in _LISTED}
"""All shapes, by what a study file calls them."""
