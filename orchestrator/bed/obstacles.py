"""Obstacles on a bed line: fences, blocks and half-cylinders, which carry no grains."""

from collections.abc import Sequence
from dataclasses import replace
from math import pi, radians, tan

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed.line import BedLine
from orchestrator.study.parts import Obstacle

FloatArray = NDArray[np.float64]

SIDE_DEG = 75.0
"""Slope of the sides: the grid lines of the flow's mesh are vertical, and so no side is."""
FENCE = 0.1
"""Thickness of a fence at its top, of its height."""
CHORDS = 16
"""Chords of a half-cylinder."""


def with_obstacles(line: BedLine, obstacles: Sequence[Obstacle]) -> BedLine:
    """The line over a bed and the obstacles on it."""
    for one in sorted(obstacles, key=lambda one: one.x):
        line = _with_one(line, one)
    return line


def _with_one(line: BedLine, one: Obstacle) -> BedLine:
    middle = np.array([one.x, float(line.height(np.array(one.x)))])
    outline = OUTLINES[one.kind](one) + middle
    # its sides go on down to the bed, which they meet a little further out where it falls
    start, end = _foot(line, outline[0], -1), _foot(line, outline[-1], 1)
    corners = line.corners
    before, behind = corners[corners[:, 0] < start[0]], corners[corners[:, 0] > end[0]]
    x, z = np.vstack([before, start, outline, end, behind]).T
    bare = (*line.bare, (float(start[0]), float(end[0])))
    return replace(line, x=tuple(x.tolist()), z=tuple(z.tolist()), bare=bare)


def _foot(line: BedLine, top: FloatArray, way: int) -> FloatArray:
    """Where a side that goes down from a point, upstream or downstream, meets the bed."""
    x = float(top[0])
    for _ in range(50):  # the side is steeper than any bed: this converges
        x = float(top[0] + way * (top[1] - line.height(np.array(x))) / tan(radians(SIDE_DEG)))
    return np.array([x, float(line.height(np.array(x)))])


def _box(length: float, height: float) -> FloatArray:
    return np.array([[-length / 2, height], [length / 2, height]])


def _half_cylinder(one: Obstacle) -> FloatArray:
    """A polygon; below where the circle is steeper than the sides they go straight down."""
    first = radians(90 - SIDE_DEG)
    angles = np.linspace(pi - first, first, CHORDS + 1)
    return one.height * np.column_stack([np.cos(angles), np.sin(angles)])


OUTLINES = {
    "fence": lambda one: _box(FENCE * one.height, one.height),
    "block": lambda one: _box(one.length or one.height, one.height),
    "half-cylinder": _half_cylinder,
}
"""Their outlines above the sides, around the middle of their foot."""
