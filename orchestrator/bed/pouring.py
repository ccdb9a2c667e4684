"""Pouring a bed: a mould of the bed line, and the grains that rain into it.

Lengths are in diameters d of the scene, with the foot of the form at the origin.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed.line import BedLine

FloatArray = NDArray[np.float64]

APRON = 10.0
"""Length of the bed that is poured before and behind the forms, d."""
HEAP = 2.0
"""Height of the grains over the line that are cut away, d."""
FILLED = 0.83
"""Part of the area that grains fill when they have settled; it only says how many are poured."""
PITCH = 1.05
"""Distance of the grains in the air, in diameters of the largest."""


@dataclass(frozen=True)
class Mould:
    """A mould that follows a bed line, and the line that the bed in it is cut to.

    Attributes
    ----------
    line : BedLine
        Of the flow.
    depth : float
        Of the row of fixed grains under the line, along the vertical.
    surface : float
        Height over the line, normal to it, above which no centre lies after the cut.
    """

    line: BedLine
    depth: float
    surface: float

    @property
    def ends(self) -> tuple[float, float]:
        """Places along x of the two walls: beyond the forms, within the line."""
        x = self.line.x
        return max(x[0], x[1] - APRON), min(x[-1], x[-2] + APRON)

    @property
    def floor(self) -> FloatArray:
        """Centres of the fixed grains: along the line one diameter apart, shape (m, 2)."""
        x, z = self.line.corners.T
        along = np.concatenate([[0.0], np.cumsum(self.line.lengths)])
        first, last = np.interp(self.ends, x, along)
        places = np.arange(first + 0.5, last, 1.0)
        return np.column_stack(
            [np.interp(places, along, x), np.interp(places, along, z) - self.depth]
        )

    @property
    def segments(self) -> FloatArray:
        """The cut: place x of each segment's start and end, height there, rise; shape (k, 4)."""
        (x, z), tangents = self.line.corners.T, self.line.tangents
        raised = z[:-1] + self.surface / tangents[:, 0]
        return np.column_stack([x[:-1], x[1:], raised, tangents[:, 1] / tangents[:, 0]])

    def rain(self, mean_area: float, largest: float, seed: int) -> FloatArray:
        """Places in the air of the grains that fill the mould, none touching another.

        Parameters
        ----------
        mean_area : float
            Mean square of their diameters, d2.
        largest : float
            Diameter of the largest, d.
        seed : int
            Of the shifts that keep equal grains from falling into a perfect lattice.

        Returns
        -------
        ndarray, shape (n, 2)
        """
        pitch = PITCH * largest
        start, end = self.ends
        columns = np.arange(start + pitch / 2, end - pitch / 2, pitch)
        fill = (self.depth + self.surface + HEAP) * (end - start) * FILLED
        rows = int(np.ceil(fill / (np.pi / 4 * mean_area) / len(columns)))
        column, row = np.meshgrid(columns, np.arange(1, rows + 1))
        z = self.line.height(column) - self.depth + 0.5 + pitch * row
        shift = (PITCH - 1) / 2 * largest
        jitter = np.random.default_rng(seed).uniform(-shift, shift, column.shape)
        return np.column_stack([(column + jitter).ravel(), z.ravel()])


def rows_of(segments: FloatArray) -> Iterator[tuple[str, list[float]]]:
    """The segments of a cut by the names of the deck's files."""
    yield from zip(("x0", "x1", "z0", "slope"), segments.T.tolist(), strict=True)
