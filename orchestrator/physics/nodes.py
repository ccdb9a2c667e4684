"""A table of numbers at nodes of some axes, which is linear between them.

SciPy has the same interpolation, but to import it takes longer than a command that
reads such a table for a few grains.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from orchestrator.types import FloatArray


@dataclass(frozen=True, eq=False)
class Nodes:
    """Numbers at the nodes of a grid.

    Attributes
    ----------
    axes
        The nodes of each axis, rising, at least two.
    numbers
        Some numbers at each node: one axis after the other, and the numbers last.
    """

    axes: Sequence[FloatArray]
    numbers: FloatArray

    def at(self, *point: FloatArray) -> FloatArray:
        """Interpolate between the nodes around each of n points.

        Parameters
        ----------
        *point
            The places of the points on each axis, arrays of shape (n,), which are not
            beyond its ends.

        Returns
        -------
        FloatArray
            The numbers of each point, which come first: shape (m, n). NaN where a place
            is NaN.

        Examples
        --------
        >>> squares = Nodes([np.array([0.0, 1.0, 3.0])], np.array([[0.0], [1], [9]]))
        >>> print(squares.at(np.array([0.5, 1.0, 2.0, np.nan])))
        [[0.5 1.  5.  nan]]
        """
        sides = []
        for nodes, place in zip(self.axes, point, strict=True):
            below = np.searchsorted(nodes, place, side="right") - 1
            below = np.clip(below, 0, len(nodes) - 2)
            part = (place - nodes[below]) / (nodes[below + 1] - nodes[below])
            sides.append(((below, 1 - part), (below + 1, part)))
        found = np.zeros(1)
        for corner in product(*sides):
            weight = np.ones(1)
            for _, part in corner:
                weight = weight * part
            node = tuple(each for each, _ in corner)
            found = found + self.numbers[node] * weight[:, None]
        return np.asarray(found.T)
