"""Places of grains in one plane, or in a strip whose two sides are one: what lies near what."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Places:
    """The centres of n grains, in one unit of length.

    Attributes
    ----------
    xyz : ndarray, shape (n, 3)
        Along the flow, across it, up.
    width : float
        From one side of a strip to the other, beyond which it begins again; 0 in one plane.
    """

    xyz: FloatArray
    width: float = 0.0

    @classmethod
    def of(cls, centres: FloatArray, across: ArrayLike = 0.0, width: float = 0.0) -> "Places":
        """Places from x and z, shape (n, 2), and y."""
        x, z = centres.T
        y = np.broadcast_to(np.asarray(across, float), x.shape)
        return cls(np.column_stack([x, np.mod(y, width) if width else y, z]), width)

    def apart(self, first: IntArray, second: IntArray) -> FloatArray:
        """Vectors from some grains to others, the shorter way across the sides, shape (k, 3)."""
        found = self.xyz[second] - self.xyz[first]
        found[..., 1] = across(found[..., 1], self.width)
        return np.asarray(found)

    def tree(self, chosen: NDArray[np.bool_] | slice = slice(None)) -> cKDTree:
        """A search tree of the grains, or of some of them."""
        return cKDTree(self.xyz[chosen], boxsize=np.array([0.0, self.width, 0.0]))


def across(distance: FloatArray, width: float) -> FloatArray:
    """Distances across the flow, the shorter way in a strip of some width."""
    return distance - width * np.round(distance / width) if width else distance
