"""The bed line: the bottom of the flow as a polyline, and how one is made of forms and obstacles.

Lengths are in any one unit: metres for the flow, diameters for a packing. The foot of the first
form is at x = 0, where the arc length s is zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import pi, radians, tan

import numpy as np

from orchestrator.digits import DIGITS
from orchestrator.study.parts import Obstacle, PileBed, Range, UnfitError
from orchestrator.types import BoolArray, FloatArray, IntArray

UPSTREAM, DOWNSTREAM = 10.0, 20.0
"""Flat bed before and behind the forms, in heights of them."""
SIDE_DEG = 75.0
"""Slope of an obstacle's sides: the grid lines of the mesh are vertical, and so no side is."""
FENCE = 0.1  # thickness of a fence at its top, of its height
CHORDS = 16  # chords of a half-cylinder
LEVEL_DEG = 1e-6  # slope from which on a segment rises
PLACES = 10**6  # most pairs of a point and a segment that are compared at a time


@dataclass(frozen=True)
class BedLine:
    """A bed line of n corners, which go downstream.

    `x` is downstream of the foot of the first form, `z` above the flat bed before it; `h`, the
    height of the forms, is that in which domain, mesh and averaging are measured; `bare` has the
    ranges of x of obstacles, which carry no grains.
    """

    x: tuple[float, ...]
    z: tuple[float, ...]
    h: float
    bare: tuple[tuple[float, float], ...] = ()

    @classmethod
    def through(cls, corners: FloatArray, h: float) -> "BedLine":
        """The line through some corners, shape (n, 2)."""
        x, z = np.transpose(corners).tolist()
        return cls(tuple(x), tuple(z), h)

    def scaled(self, factor: float) -> "BedLine":
        """The same line in another unit of length."""
        x, z = (tuple(v * factor for v in values) for values in (self.x, self.z))
        bare = tuple((start * factor, end * factor) for start, end in self.bare)
        return BedLine(x, z, self.h * factor, bare)

    def with_corners(self, places: Sequence[float]) -> "BedLine":
        """The same line with more corners, in which it does not bend."""
        x = np.union1d(self.x, places)
        return replace(self, x=tuple(x.tolist()), z=tuple(self.height(x).tolist()))

    def part(self, start: float, end: float, beyond: float) -> "BedLine":
        """The line between two places of its inner part, and some of the bed beyond them."""
        start, end = max(start, self.x[1]), min(end, self.x[-2])
        inner = (x for x in self.x[1:-1] if start < x < end)
        x = np.array([start - beyond, start, *inner, end, end + beyond])
        return replace(self, x=tuple(x.tolist()), z=tuple(self.height(x).tolist()))

    @cached_property
    def corners(self) -> FloatArray:
        """X and z of the corners, shape (n, 2)."""
        return np.column_stack([self.x, self.z])

    @cached_property
    def lengths(self) -> FloatArray:
        """Length of each segment, shape (n - 1,)."""
        return np.asarray(np.hypot(*np.diff(self.corners, axis=0).T))

    @cached_property
    def tangents(self) -> FloatArray:
        """Unit vector downstream along each segment, shape (n - 1, 2)."""
        return np.asarray(np.diff(self.corners, axis=0) / self.lengths[:, None])

    @cached_property
    def normals(self) -> FloatArray:
        """Unit vector out of the bed of each segment, shape (n - 1, 2)."""
        return np.column_stack([-self.tangents[:, 1], self.tangents[:, 0]])

    @cached_property
    def slopes_deg(self) -> FloatArray:
        """Slope of each segment, positive where the bed rises downstream, shape (n - 1,)."""
        slopes = np.degrees(np.arctan2(self.tangents[:, 1], self.tangents[:, 0]))
        # a bed of 15 degrees has a bend of 15 degrees, and not of a last digit more
        return np.asarray(np.round(slopes, DIGITS))

    @cached_property
    def bends_deg(self) -> FloatArray:
        """Bend at each corner, positive at a top; 0 at the ends; shape (n,)."""
        return np.concatenate([[0.0], -np.diff(self.slopes_deg), [0.0]])

    @cached_property
    def arc_lengths(self) -> FloatArray:
        """Arc length of each corner from the foot of the first form, shape (n,)."""
        along = np.concatenate([[0.0], np.cumsum(self.lengths)])
        return np.asarray(along - np.interp(0, self.x, along))

    @property
    def top(self) -> int:
        """Number of the highest corner, the crest, and of the segment behind it."""
        return int(np.argmax(self.z))

    @property
    def crest(self) -> FloatArray:
        """Position of the crest, shape (2,)."""
        return np.asarray(self.corners[self.top])

    @property
    def crest_s(self) -> float:
        """Arc length of the crest."""
        return float(self.arc_lengths[self.top])

    @property
    def toe(self) -> FloatArray:
        """Position of the corner where the form ends and the flat bed goes on, shape (2,)."""
        falls = np.flatnonzero(np.diff(self.z) < 0)
        return np.asarray(self.corners[falls[-1] + 1 if len(falls) else -1])

    def height(self, x: FloatArray) -> FloatArray:
        """Height of the line at some places along x."""
        return np.asarray(np.interp(x, self.x, self.z))

    def counted(self, counts: str | Range) -> BoolArray:
        """Which segments carry counted grains, shape (n - 1,); none of the two at the ends.

        Those that rise for "windward", every one for "all", or those within a range of x.
        """
        inner = np.zeros(len(self.lengths), bool)
        inner[1:-1] = True
        if counts == "windward":
            return np.asarray(inner & (self.slopes_deg > LEVEL_DEG))
        if isinstance(counts, str):
            return inner
        x = np.array(self.x)
        return np.asarray(inner & (x[1:] > counts[0]) & (x[:-1] < counts[1]))

    def under(self, points: FloatArray) -> IntArray:
        """The segment under each of some points over the bed; at a top that on their own side."""
        segment, s = self.nearest(points)
        near = 1e-9 * self.lengths.max()
        last = s >= self.arc_lengths[segment + 1] - near
        behind = last & (points[:, 0] > self.corners[segment + 1, 0] + near)
        return np.asarray(np.minimum(segment + behind, len(self.lengths) - 1))

    def over(self, points: FloatArray, segment: IntArray | int) -> FloatArray:
        """Distance of points (m, 2) over the straight lines of segments, shape (m,)."""
        (x, z), (nx, nz) = (points - self.corners[segment]).T, self.normals[segment].T
        return np.asarray(x * nx + z * nz)

    def roof(self, clearance: float) -> tuple[float, FloatArray]:
        """Slope (degrees) and ridge of two planes that are everywhere this far above the forms."""
        inner = self.corners[1:-1]
        ridge = inner[np.argmax(inner[:, 1])]
        apart = inner[inner[:, 0] != ridge[0]] - ridge
        steep = np.abs(np.arctan2(-apart[:, 1], np.abs(apart[:, 0]))).min()
        return float(np.degrees(steep)), ridge + np.array(
            [0, clearance / np.cos(steep)]
        )

    def nearest(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """The segment nearest to each of m points, and the arc length of the nearest place on it.

        If two are as near, the higher place counts.
        """
        segment, s = np.empty(len(points), np.int64), np.empty(len(points))
        blocks = len(points) * len(self.lengths) // PLACES + 1
        for block in np.array_split(np.arange(len(points)), blocks):
            away = points[block, None] - self.corners[:-1]
            along = np.clip(
                np.einsum("mnk,nk->mn", away, self.tangents), 0.0, self.lengths
            )
            places = self.corners[:-1] + along[..., None] * self.tangents
            distance = np.linalg.norm(points[block, None] - places, axis=2)
            tied = (
                distance
                <= distance.min(axis=1, keepdims=True) + 1e-9 * self.lengths.max()
            )
            chosen = np.argmax(np.where(tied, places[..., 1], -np.inf), axis=1)
            segment[block] = chosen
            s[block] = self.arc_lengths[chosen] + along[np.arange(len(block)), chosen]
        return segment, s


@cache
def of_bed(bed: PileBed) -> BedLine:
    """The bed line that a pile's bed asks for, m; an UnfitError if the forms of a train overlap."""
    if bed.profile:
        corners = np.column_stack([bed.profile.x, bed.profile.z])
    else:
        corners = _train(bed.form.corners(bed), bed.forms, bed.spacing)
    for obstacle in bed.obstacles:
        start, end = obstacle.x - obstacle.reach, obstacle.x + obstacle.reach
        if start < corners[0, 0]:
            corners = np.vstack([[start, corners[0, 1]], corners])
        if end > corners[-1, 0]:
            corners = np.vstack([corners, [end, corners[-1, 1]]])
    line = between_flats(corners, bed.relief)
    for obstacle in sorted(bed.obstacles, key=lambda obstacle: obstacle.x):
        line = _with_obstacle(line, obstacle)
    return line


@cache
def triangle(slope_deg: float, height: float) -> BedLine:
    """A pile with two faces of one slope (degrees), the paper's bed; of slope 0 the flat bed."""
    face = height / tan(radians(slope_deg)) if slope_deg else 4 * height
    top = height if slope_deg else 0.0
    return between_flats(np.array([[0, 0], [face, top], [2 * face, 0]]), height)


def between_flats(corners: FloatArray, height: float) -> BedLine:
    """A line with flat bed before and behind some corners."""
    (x_first, z_first), (x_last, z_last) = corners[[0, -1]]
    before, behind = (
        (x_first - UPSTREAM * height, z_first),
        (x_last + DOWNSTREAM * height, z_last),
    )
    return BedLine.through(np.vstack([before, corners, behind]), height)


def _train(form: FloatArray, count: int, spacing: float | None) -> FloatArray:
    """Several forms in a row, the foot of each a spacing behind that of the one before."""
    length = float(form[-1, 0])
    spacing = spacing or length
    if count > 1 and spacing < length * (1 - 1e-9):
        what = f"forms {length:g} m long overlap at {spacing:g} m"
        raise UnfitError(
            "bed.spacing", what, "raise it, or leave it out: they touch then"
        )
    corners = np.vstack(
        [form + np.array([place * spacing, 0]) for place in range(count)]
    )
    # forms that touch share a corner
    return np.asarray(corners[np.append(True, np.diff(corners[:, 0]) > 1e-9 * spacing)])


def _with_obstacle(line: BedLine, obstacle: Obstacle) -> BedLine:
    """The line over an obstacle, whose sides go down to where they meet the bed."""
    middle = np.array([obstacle.x, float(line.height(np.array(obstacle.x)))])
    outline = _outline(obstacle) + middle
    start, end = _foot(line, outline[0], -1), _foot(line, outline[-1], 1)
    x, corners = line.corners[:, 0], line.corners
    parts = [corners[x < start[0]], start, outline, end, corners[x > end[0]]]
    whole = BedLine.through(np.vstack(parts), line.h)
    return replace(whole, bare=(*line.bare, (float(start[0]), float(end[0]))))


def _foot(line: BedLine, top: FloatArray, way: int) -> FloatArray:
    """Where a side that goes down from a point, upstream (-1) or downstream (1), meets the bed."""
    x = float(top[0])
    for _ in range(50):  # the side is steeper than any bed: this converges
        x = float(
            top[0] + way * (top[1] - line.height(np.array(x))) / tan(radians(SIDE_DEG))
        )
    return np.array([x, float(line.height(np.array(x)))])


def _outline(obstacle: Obstacle) -> FloatArray:
    """The corners of an obstacle above its sides, around the middle of its foot, shape (n, 2)."""
    if obstacle.kind == "half-cylinder":
        # where the circle is steeper than the sides they go straight down
        first = radians(90 - SIDE_DEG)
        angles = np.linspace(pi - first, first, CHORDS + 1)
        return obstacle.height * np.column_stack([np.cos(angles), np.sin(angles)])
    height = obstacle.height
    length = FENCE * height if obstacle.kind == "fence" else obstacle.length or height
    return np.array([[-length / 2, height], [length / 2, height]])
