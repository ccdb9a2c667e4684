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

    def depth(self, points: FloatArray, segment: int) -> FloatArray:
        """Signed distance of points (m, 2) below the straight line of a segment, shape (m,)."""
        return np.asarray(-(points - self.corners[segment]) @ self.normals[segment])

    def nearest(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """The segment nearest to each of m points, and the arc length of the nearest place on it.

        Of two that are as near the one further up counts: the face, where it meets the flat bed.
        """
        along = np.einsum("mnk,nk->mn", points[:, None] - self.corners[:-1], self.tangents)
        along = np.clip(along, 0.0, self.lengths)
        places = self.corners[:-1] + along[..., None] * self.tangents
        distance = np.linalg.norm(points[:, None] - places, axis=2)
        tied = distance <= distance.min(axis=1, keepdims=True) + 1e-9 * self.lengths.max()
        chosen = np.argmax(np.where(tied, places[..., 1], -np.inf), axis=1)
        rows = np.arange(len(points))
        return chosen, np.asarray(self.arc_lengths[chosen] + along[rows, chosen])
