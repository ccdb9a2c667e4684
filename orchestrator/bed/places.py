"""Where the centres of grains are in space, and which of them are near."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.types import FloatArray, IntArray

TOUCH = 1e-3
"""Two grains closer than this touch, of the mean of their diameters."""


@dataclass(frozen=True)
class Places:
    """The centres of n grains in one unit of length.

    Attributes
    ----------
    xyz
        Along the flow, across it, up; shape (n, 3).
    width
        Width of a strip that begins again beyond its sides; 0 in one plane.
    """

    xyz: FloatArray
    width: float = 0.0

    @classmethod
    def of(
        cls, centres: FloatArray, across: ArrayLike = 0.0, width: float = 0.0
    ) -> "Places":
        """Make places.

        Parameters
        ----------
        centres
            X and z, shape (n, 2).
        across
            Y of all, or of each, shape (n,).
        width
            Width of the strip.

        Returns
        -------
        Places
            The places, across the flow between 0 and the width.
        """
        x, z = centres.T
        y = np.broadcast_to(np.asarray(across, float), x.shape)
        if width:
            y = np.mod(y, width)
            # the remainder of a tiny negative number is rounded to the width itself
            y = np.where(y < width, y, 0.0)
        return cls(np.column_stack([x, y, z]), width)

    def pairs(self, reach: float) -> tuple[IntArray, IntArray, FloatArray]:
        """Find the k pairs of grains within a reach, each in both orders.

        Parameters
        ----------
        reach
            The largest distance.

        Returns
        -------
        first, second
            The grains, shape (k,).
        apart
            The vector from the first to the second, the shorter way across the sides,
            shape (k, 3).
        """
        pairs = tree(self.xyz, self.width).query_pairs(reach, output_type="ndarray")
        first, second = np.vstack([pairs, pairs[:, ::-1]]).T
        apart = self.xyz[second] - self.xyz[first]
        apart[:, 1] = across(apart[:, 1], self.width)
        return first, second, apart

    def contacts(self, sizes: FloatArray, touch: float = TOUCH) -> tuple[IntArray, ...]:
        """Find the pairs of grains that touch.

        Parameters
        ----------
        sizes
            Diameters, shape (n,).
        touch
            Largest distance of two surfaces, over the mean of their diameters.

        Returns
        -------
        tuple
            As `pairs` gives them.
        """
        first, second, apart = self.pairs((1 + touch) * float(sizes.max()))
        distance = np.linalg.norm(apart, axis=1)
        is_close = distance < (1 + touch) * (sizes[first] + sizes[second]) / 2
        return first[is_close], second[is_close], apart[is_close]


def tree(points: FloatArray, width: float = 0.0) -> Any:
    """Make a tree of points, which begins again beyond the sides of a strip.

    Parameters
    ----------
    points
        The points, shape (n, 2) or (n, 3).
    width
        Width of the strip; 0 in one plane.

    Returns
    -------
    scipy.spatial.cKDTree
        The tree.
    """
    from scipy.spatial import cKDTree  # 0.4 s, for which a plan does not wait

    return cKDTree(points, boxsize=np.array([0.0, width, 0.0])[: points.shape[1]])


def across(distance: FloatArray, width: float) -> FloatArray:
    """Find the shorter way across the flow.

    Parameters
    ----------
    distance
        Distances across the flow.
    width
        Width of the strip; 0 in one plane.

    Returns
    -------
    FloatArray
        The shorter distances.
    """
    if not width:
        return distance
    return distance - width * np.round(distance / width)
