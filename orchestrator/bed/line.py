"""The bed line: the bottom of the flow as a polyline, which mesh, packing and stress ask.

Lengths are in any one unit: metres for the flow, diameters for a packing. Makers put the foot of
the first form at x = 0, where the arc length s is zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


SOME = 50
"""Points whose nearest places are looked for at a time."""


@dataclass(frozen=True)
class BedLine:
    """A bed line of n corners, which go downstream.

    Attributes
    ----------
    x, z : tuple of float
        Corners: downstream of the foot of the first form, above the flat bed before it.
    h : float
        Height of the forms, in which domain, mesh and averaging are measured.
    bare : tuple of (float, float)
        Ranges of x of obstacles, which carry no grains.
    """

    x: tuple[float, ...]
    z: tuple[float, ...]
    h: float
    bare: tuple[tuple[float, float], ...] = ()

    def scaled(self, factor: float) -> "BedLine":
        """The same line in another unit of length."""
        x, z = (tuple(v * factor for v in values) for values in (self.x, self.z))
        bare = tuple((start * factor, end * factor) for start, end in self.bare)
        return BedLine(x, z, self.h * factor, bare)

    def with_corners(self, places: Sequence[float]) -> "BedLine":
        """The same line with more corners, in which it does not bend."""
        x = np.union1d(self.x, places)
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
        return np.degrees(np.arctan2(self.tangents[:, 1], self.tangents[:, 0]))

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
        """Number of the highest corner, the crest."""
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

    @property
    def windward(self) -> int:
        """Number of the segment that rises to the crest."""
        return self.top - 1

    @property
    def lee(self) -> int:
        """Number of the segment that falls behind the crest."""
        return self.top

    def height(self, x: FloatArray) -> FloatArray:
        """Height of the line at some places along x."""
        return np.asarray(np.interp(x, self.x, self.z))

    def under(self, points: FloatArray) -> IntArray:
        """The segment under each of some points over the bed; at a top that on their own side."""
        segment, s = self.nearest(points)
        last = s >= self.arc_lengths[segment + 1] - 1e-9 * self.lengths.max()
        behind = last & (points[:, 0] > self.corners[segment + 1, 0] + 1e-9 * self.lengths.max())
        return np.asarray(np.minimum(segment + behind, len(self.lengths) - 1))

    def roof(self, clearance: float) -> tuple[float, FloatArray]:
        """Slope (degrees) and ridge of two planes that are everywhere this far above the forms."""
        inner = self.corners[1:-1]
        ridge = inner[np.argmax(inner[:, 1])]
        apart = inner[inner[:, 0] != ridge[0]] - ridge
        steep = np.abs(np.arctan2(-apart[:, 1], np.abs(apart[:, 0]))).min()
        return float(np.degrees(steep)), ridge + np.array([0, clearance / np.cos(steep)])

    def depth(self, points: FloatArray, segment: int) -> FloatArray:
        """Signed distance of points (m, 2) below the straight line of a segment, shape (m,)."""
        return np.asarray(-(points - self.corners[segment]) @ self.normals[segment])

    def nearest(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """The segment nearest to each of m points, and the arc length of the nearest place on it.

        If two are as near, the one further up counts: the face, where it meets the flat bed.
        """
        order = np.argsort(points[:, 0], kind="stable")
        chosen, arc_length = np.empty(len(points), np.int64), np.empty(len(points))
        for some in np.array_split(order, max(len(points) // SOME, 1)):
            chosen[some], arc_length[some] = self._nearest(points[some])
        return chosen, arc_length

    def _nearest(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """The same for a few neighbours, among the segments that can be near to them."""
        x, away = points[:, 0], np.abs(points[:, 1] - self.height(points[:, 0])).max()
        low = max(int(np.searchsorted(self.x, x.min() - away)) - 1, 0)
        high = int(np.searchsorted(self.x, x.max() + away, side="right")) + 1
        # points beyond an end are nearest to the segment there
        low, high = min(low, len(self.lengths) - 1), max(high, 2)
        corners, tangents = self.corners[low : high - 1][: len(self.lengths) - low], self.tangents
        tangents, lengths = tangents[low : high - 1], self.lengths[low : high - 1]
        along = np.einsum("mnk,nk->mn", points[:, None] - corners, tangents)
        along = np.clip(along, 0.0, lengths)
        places = corners + along[..., None] * tangents
        distance = np.linalg.norm(points[:, None] - places, axis=2)
        tied = distance <= distance.min(axis=1, keepdims=True) + 1e-9 * self.lengths.max()
        chosen = np.argmax(np.where(tied, places[..., 1], -np.inf), axis=1)
        rows = np.arange(len(points))
        return chosen + low, np.asarray(self.arc_lengths[chosen + low] + along[rows, chosen])
