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
LOOSE = 0.3
"""Room of a grain in the air, beside it and over it, in its own diameters: as little as leaves no
order among equal grains, so that they fall no further than need be."""
COLUMNS = 20
"""Columns in a diameter by which the room is found that is still free."""


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

    def count(self, mean_area: float) -> int:
        """How many grains of a mean square of the diameters (d2) fill it, with the heap."""
        start, end = self.ends
        fill = (self.depth + self.surface + HEAP) * (end - start) * FILLED
        return int(np.ceil(fill / (np.pi / 4 * mean_area)))

    def rain(self, sizes: FloatArray, seed: int) -> FloatArray:
        """Places in the air of the grains that fill the mould, none touching another.

        They lie row upon row, each over what is already there, at a place of its room that the
        seed decides.

        Parameters
        ----------
        sizes : ndarray, shape (n,)
            Their diameters, d.
        seed : int
            Of the places, and of where each row begins.

        Returns
        -------
        ndarray, shape (n, 2)
        """
        (start, end), room = self.ends, (1 + LOOSE) * sizes
        chance = np.random.default_rng(seed).uniform(size=(len(sizes), 2))
        tops = _Tops(start, end, float(sizes.max()))
        for x, z in self.floor:
            tops.put(x - 0.5, x + 0.5, z + 0.5)
        places = np.empty((len(sizes), 2))
        x = start + room[0] * chance[0, 0]
        for number, (size, wide) in enumerate(zip(sizes.tolist(), room.tolist(), strict=True)):
            beside, over = LOOSE * size * chance[number]
            if x + wide > end:
                x = start + wide * chance[number, 0]
            place = x + beside + size / 2
            height = tops.over(place - size / 2, place + size / 2) + over + size / 2
            places[number] = place, height
            tops.put(place - size / 2, place + size / 2, height + size / 2)
            x += wide
        return places


class _Tops:
    """Height of the highest grain so far over each of many columns."""

    def __init__(self, start: float, end: float, margin: float) -> None:
        self.start = start - margin
        self.height = np.full(int((end - start + 2 * margin) * COLUMNS) + 2, -np.inf)

    def over(self, first: float, last: float) -> float:
        """The highest of a stretch along x."""
        return float(self.height[self._columns(first, last)].max())

    def put(self, first: float, last: float, height: float) -> None:
        """Put a grain whose top is at a height over a stretch."""
        columns = self._columns(first, last)
        self.height[columns] = np.maximum(self.height[columns], height)

    def _columns(self, first: float, last: float) -> slice:
        low, high = ((place - self.start) * COLUMNS for place in (first, last))
        return slice(int(low), int(high) + 1)


def rows_of(segments: FloatArray) -> Iterator[tuple[str, list[float]]]:
    """The segments of a cut by the names of the deck's files."""
    yield from zip(("x0", "x1", "z0", "slope"), segments.T.tolist(), strict=True)
