"""The bed line: the bottom of the flow as a polyline, made of forms and obstacles.

Lengths are in any one unit: metres for the flow, diameters for a packing. The toe of
the first form is at x = 0, where the arc length s is zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import pi, radians, tan
from typing import NamedTuple

import numpy as np

from orchestrator.digits import DIGITS
from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import Obstacle, PileBed, Range
from orchestrator.types import BoolArray, FloatArray, IntArray

UPSTREAM = 10.0
"""Flat bed before the forms, in heights of them."""
DOWNSTREAM = 20.0
"""Flat bed behind the forms, in heights of them."""
SIDE_DEG = 75.0
"""Slope of an obstacle's sides: the grid lines of the mesh are vertical, and so no side
is."""
FENCE = 0.1
"""Thickness of a fence at its top, of its height."""
CHORDS = 16
"""Chords of a half-cylinder."""
LEVEL_DEG = 1e-6
"""Slope from which on a segment rises."""
MOST_PAIRS = 10**6
"""Most pairs of a point and a segment that are compared at a time."""
FOOT_STEPS = 50
"""Steps in which the foot of a side is found: it is steeper than any bed, which
converges."""


class PorousFence(NamedTuple):
    """A fence through which the flow goes, and under which the bed goes on.

    Attributes
    ----------
    start, end
        Where it begins and ends along x; it is as thick as a solid one at its top.
    height
        Its height over the bed.
    porosity
        Open part of it.
    """

    start: float
    end: float
    height: float
    porosity: float

    @property
    def thickness(self) -> float:
        """From one side to the other, in the unit of the line."""
        return self.end - self.start

    def scaled(self, factor: float) -> "PorousFence":
        """Write it in another unit of length.

        Parameters
        ----------
        factor
            The old unit over the new one.

        Returns
        -------
        PorousFence
            The same fence.
        """
        lengths = (self.start * factor, self.end * factor, self.height * factor)
        return PorousFence(*lengths, self.porosity)


@dataclass(frozen=True)
class BedLine:
    """A bed line of n corners, which go downstream.

    Attributes
    ----------
    x
        Places of the corners downstream of the toe of the first form.
    z
        Their heights above the flat bed before it.
    h
        The height of the forms, in which domain, mesh and averaging are measured.
    bare
        The ranges of x of obstacles, which carry no grains.
    fences
        The porous fences, whose ranges are among those: they are no part of the line.
    """

    x: tuple[float, ...]
    z: tuple[float, ...]
    h: float
    bare: tuple[tuple[float, float], ...] = ()
    fences: tuple[PorousFence, ...] = ()

    @classmethod
    def through(cls, corners: FloatArray, h: float) -> "BedLine":
        """Make the line through some corners.

        Parameters
        ----------
        corners
            X and z of the corners, shape (n, 2).
        h
            The height of the forms.

        Returns
        -------
        BedLine
            The line.
        """
        x, z = np.transpose(corners).tolist()
        return cls(tuple(x), tuple(z), h)

    def scaled(self, factor: float) -> "BedLine":
        """Write the line in another unit of length.

        Parameters
        ----------
        factor
            The old unit over the new one.

        Returns
        -------
        BedLine
            The same line.
        """
        x = tuple(place * factor for place in self.x)
        z = tuple(height * factor for height in self.z)
        bare = tuple((start * factor, end * factor) for start, end in self.bare)
        fences = tuple(fence.scaled(factor) for fence in self.fences)
        return BedLine(x, z, self.h * factor, bare, fences)

    def with_corners(self, places: Sequence[float]) -> "BedLine":
        """Add corners in which the line does not bend.

        Parameters
        ----------
        places
            Their places along x.

        Returns
        -------
        BedLine
            The same line.
        """
        return self._at(np.union1d(self.x, places))

    def _at(self, x: FloatArray) -> "BedLine":
        """The line with other corners on it."""
        return replace(self, x=tuple(x.tolist()), z=tuple(self.height(x).tolist()))

    def part(self, start: float, end: float, beyond: float) -> "BedLine":
        """Cut the line.

        Parameters
        ----------
        start, end
            Ends of the part along x; they are moved into the inner part of the line.
        beyond
            Length of the bed that is kept before and behind it.

        Returns
        -------
        BedLine
            The part.
        """
        start = max(start, self.x[1])
        end = min(end, self.x[-2])
        inner = [x for x in self.x[1:-1] if start < x < end]
        return self._at(np.array([start - beyond, start, *inner, end, end + beyond]))

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
        """Slope of each segment, positive where the bed rises, shape (n - 1,)."""
        slopes = np.degrees(np.arctan2(self.tangents[:, 1], self.tangents[:, 0]))
        # a bed of 15 degrees has a bend of 15 degrees, and not of a last digit more
        return np.asarray(np.round(slopes, DIGITS))

    @cached_property
    def bends_deg(self) -> FloatArray:
        """Bend at each corner, positive at a top; 0 at the ends; shape (n,)."""
        return np.concatenate([[0.0], -np.diff(self.slopes_deg), [0.0]])

    @cached_property
    def arc_lengths(self) -> FloatArray:
        """Arc length of each corner from the toe of the first form, shape (n,)."""
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
        """Position of the corner where the form ends, shape (2,)."""
        falls = np.flatnonzero(np.diff(self.z) < 0)
        last = falls[-1] + 1 if len(falls) else -1
        return np.asarray(self.corners[last])

    def height(self, x: FloatArray) -> FloatArray:
        """Find the height of the line.

        Parameters
        ----------
        x
            Places along x.

        Returns
        -------
        FloatArray
            The heights, of the same shape.
        """
        return np.asarray(np.interp(x, self.x, self.z))

    def counted(self, counts: str | Range) -> BoolArray:
        """Find the segments that carry counted grains.

        Parameters
        ----------
        counts
            "windward" for those that rise, "all" for every one, or a range of x.

        Returns
        -------
        BoolArray
            Which segments, shape (n - 1,); none of the two at the ends.
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
        """Find the segment under each of some points over the bed.

        Parameters
        ----------
        points
            X and z of the points, shape (m, 2).

        Returns
        -------
        IntArray
            The nearest segments, at a top those on the points' own side, shape (m,).
        """
        segment, s = self.nearest(points)
        near = 1e-9 * self.lengths.max()
        is_at_end = s >= self.arc_lengths[segment + 1] - near
        is_behind = points[:, 0] > self.corners[segment + 1, 0] + near
        last = len(self.lengths) - 1
        return np.asarray(np.minimum(segment + (is_at_end & is_behind), last))

    def over(self, points: FloatArray, segment: IntArray | int) -> FloatArray:
        """Find how far points are over the straight lines of segments.

        Parameters
        ----------
        points
            X and z of the points, shape (m, 2).
        segment
            The segment of all, or of each, shape (m,).

        Returns
        -------
        FloatArray
            The distances along the segments' normals, shape (m,).
        """
        x, z = (points - self.corners[segment]).T
        normal_x, normal_z = self.normals[segment].T
        return np.asarray(x * normal_x + z * normal_z)

    def roof(self, clearance: float) -> tuple[float, FloatArray]:
        """Find two planes that are everywhere so far above the forms.

        Parameters
        ----------
        clearance
            The distance.

        Returns
        -------
        slope
            Slope of both planes, degrees.
        ridge
            X and z of the ridge, shape (2,).
        """
        inner = self.corners[1:-1]
        ridge = inner[np.argmax(inner[:, 1])]
        apart = inner[inner[:, 0] != ridge[0]] - ridge
        steep = np.abs(np.arctan2(-apart[:, 1], np.abs(apart[:, 0]))).min()
        above = np.array([0, clearance / np.cos(steep)])
        return float(np.degrees(steep)), ridge + above

    def nearest(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Find the place on the line nearest to each of some points.

        If two are as near, the higher place counts.

        Parameters
        ----------
        points
            X and z of the points, shape (m, 2).

        Returns
        -------
        segment
            The segment of each place, shape (m,).
        s
            Its arc length, shape (m,).
        """
        segment = np.empty(len(points), np.int64)
        s = np.empty(len(points))
        tie = 1e-9 * self.lengths.max()
        blocks = len(points) * len(self.lengths) // MOST_PAIRS + 1
        for block in np.array_split(np.arange(len(points)), blocks):
            here = points[block, None]
            away = here - self.corners[:-1]
            along = np.einsum("mnk,nk->mn", away, self.tangents)
            along = np.clip(along, 0.0, self.lengths)
            places = self.corners[:-1] + along[..., None] * self.tangents
            distance = np.linalg.norm(here - places, axis=2)
            is_tied = distance <= distance.min(axis=1, keepdims=True) + tie
            chosen = np.argmax(np.where(is_tied, places[..., 1], -np.inf), axis=1)
            segment[block] = chosen
            s[block] = self.arc_lengths[chosen] + along[np.arange(len(block)), chosen]
        return segment, s


@cache
def of_bed(bed: PileBed) -> BedLine:
    """Make the bed line that a pile's bed asks for.

    Returns
    -------
    BedLine
        The line, m.

    Raises
    ------
    UnfitError
        If the forms of a train overlap.
    """
    if bed.profile:
        corners = np.column_stack([bed.profile.x, bed.profile.z])
    else:
        corners = _train(bed.form.corners(bed), bed.forms, bed.spacing)
    # the line of a bed does not depend on which obstacle is written first
    in_order = sorted(bed.obstacles, key=lambda obstacle: obstacle.x)
    for obstacle in in_order:
        start = obstacle.x - obstacle.reach
        end = obstacle.x + obstacle.reach
        if start < corners[0, 0]:
            corners = np.vstack([[start, corners[0, 1]], corners])
        if end > corners[-1, 0]:
            corners = np.vstack([corners, [end, corners[-1, 1]]])
    line = between_flats(corners, bed.relief)
    for obstacle in in_order:
        add = _with_porous if obstacle.is_porous else _with_obstacle
        line = add(line, obstacle)
    return line


@cache
def triangle(slope_deg: float, height: float) -> BedLine:
    """Make a pile with two faces of one slope, the paper's bed.

    Parameters
    ----------
    slope_deg
        Slope of the faces, degrees; of 0 it is the flat bed.
    height
        Height of the pile.

    Returns
    -------
    BedLine
        The line, in the unit of the height.
    """
    if slope_deg:
        face = height / tan(radians(slope_deg))
        top = height
    else:
        face = 4 * height
        top = 0.0
    return between_flats(np.array([[0, 0], [face, top], [2 * face, 0]]), height)


def between_flats(corners: FloatArray, height: float) -> BedLine:
    """Make a line with flat bed before and behind some corners.

    Parameters
    ----------
    corners
        X and z of the corners, shape (n, 2).
    height
        The height of the forms.

    Returns
    -------
    BedLine
        The line.
    """
    before = corners[0] - np.array([UPSTREAM * height, 0.0])
    behind = corners[-1] + np.array([DOWNSTREAM * height, 0.0])
    return BedLine.through(np.vstack([before, corners, behind]), height)


def _train(form: FloatArray, count: int, spacing: float | None) -> FloatArray:
    """Several forms in a row, the toe of each a spacing behind that of the last."""
    length = float(form[-1, 0])
    spacing = spacing or length
    if count > 1 and spacing < length * (1 - 1e-9):
        what = f"forms {length:g} m long overlap at {spacing:g} m"
        remedy = "raise it, or leave it out: they touch then"
        raise UnfitError("bed.spacing", what, remedy)
    forms = [form + np.array([place * spacing, 0]) for place in range(count)]
    corners = np.vstack(forms)
    # forms that touch share a corner
    is_apart = np.append(True, np.diff(corners[:, 0]) > 1e-9 * spacing)
    return np.asarray(corners[is_apart])


def _with_obstacle(line: BedLine, obstacle: Obstacle) -> BedLine:
    """The line over an obstacle, whose sides go down to where they meet the bed."""
    middle = np.array([obstacle.x, float(line.height(np.array(obstacle.x)))])
    outline = _outline(obstacle) + middle
    start = _foot(line, outline[0], -1)
    end = _foot(line, outline[-1], 1)
    corners = line.corners
    before = corners[corners[:, 0] < start[0]]
    behind = corners[corners[:, 0] > end[0]]
    parts = np.vstack([before, start, outline, end, behind])
    bare = (float(start[0]), float(end[0]))
    whole = BedLine.through(parts, line.h)
    return replace(whole, bare=(*line.bare, bare), fences=line.fences)


def _with_porous(line: BedLine, fence: Obstacle) -> BedLine:
    """The line under a porous fence, with a corner at each of its sides."""
    half = FENCE * fence.height / 2
    ends = (fence.x - half, fence.x + half)
    porous = PorousFence(*ends, fence.height, fence.porosity)
    whole = line.with_corners(ends)
    return replace(whole, bare=(*line.bare, ends), fences=(*line.fences, porous))


def _foot(line: BedLine, top: FloatArray, way: int) -> FloatArray:
    """Where a side that goes down, upstream (-1) or downstream (1), meets the bed."""
    x = float(top[0])
    for _ in range(FOOT_STEPS):
        depth = top[1] - line.height(np.array(x))
        x = float(top[0] + way * depth / tan(radians(SIDE_DEG)))
    return np.array([x, float(line.height(np.array(x)))])


def _outline(obstacle: Obstacle) -> FloatArray:
    """Corners of an obstacle above its sides, from the middle of its foot, (n, 2)."""
    height = obstacle.height
    if obstacle.kind == "half-cylinder":
        # where the circle is steeper than the sides they go straight down
        first = radians(90 - SIDE_DEG)
        angles = np.linspace(pi - first, first, CHORDS + 1)
        return height * np.column_stack([np.cos(angles), np.sin(angles)])
    length = obstacle.length or height
    if obstacle.kind == "fence":
        length = FENCE * height
    return np.array([[-length / 2, height], [length / 2, height]])
