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
FILLED_IN_SPACE = 0.6
"""The same of the volume of a strip."""
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
        Bed line of the flow.
    depth : float
        Depth of the row of fixed grains under the line, along the vertical.
    surface : float
        Height over the line, normal to it, above which no centre lies after the cut.
    width : float
        Width of a strip with periodic sides; 0 of a bed in one plane.
    """

    line: BedLine
    depth: float
    surface: float
    width: float = 0.0

    @property
    def ends(self) -> tuple[float, float]:
        """Places along x of the two walls: beyond the forms, within the line."""
        x = self.line.x
        return max(x[0], x[1] - APRON), min(x[-1], x[-2] + APRON)

    @property
    def floor(self) -> FloatArray:
        """Centres of the fixed grains: along the line one diameter apart, shape (m, 3).

        Those of a strip lie in two layers, each over the gaps of the other: nothing falls through.
        """
        x, z = self.line.corners.T
        along = np.concatenate([[0.0], np.cumsum(self.line.lengths)])
        first, last = np.interp(self.ends, x, along)
        places = np.arange(first + 0.5, last, 1.0)
        upper = self._across(np.interp(places, along, x), np.interp(places, along, z) - self.depth)
        if not self.width:
            return upper
        pitch = self.width / np.ceil(self.width)
        return np.vstack([upper, upper + np.array([0.5, pitch / 2, -np.sqrt(0.5)])])

    def _across(self, x: FloatArray, z: FloatArray) -> FloatArray:
        """Places repeated across the flow, at most one diameter apart."""
        if not self.width:
            return np.column_stack([x, np.zeros_like(x), z])
        rows = int(np.ceil(self.width))
        y = np.tile(np.arange(rows) * self.width / rows, len(x))
        return np.column_stack([np.repeat(x, rows), y, np.repeat(z, rows)])

    @property
    def segments(self) -> FloatArray:
        """The cut: place x of each segment's start and end, height there, rise; shape (k, 4)."""
        (x, z), tangents = self.line.corners.T, self.line.tangents
        raised = z[:-1] + self.surface / tangents[:, 0]
        return np.column_stack([x[:-1], x[1:], raised, tangents[:, 1] / tangents[:, 0]])

    def count(self, mean: float) -> int:
        """How many grains fill it, with the heap.

        Their discs have a mean area in d2, in a strip the spheres a mean volume in d3.
        """
        start, end = self.ends
        part = FILLED_IN_SPACE * self.width if self.width else FILLED
        return int(np.ceil((self.depth + self.surface + HEAP) * (end - start) * part / mean))

    def rain(self, sizes: FloatArray, seed: int) -> FloatArray:
        """Places in the air of the grains that fill the mould, none touching another.

        They lie row upon row, each over what is already there, at a place of its room that the
        seed decides; in a strip in lanes along the flow.

        Parameters
        ----------
        sizes : ndarray, shape (n,)
            Their diameters, d.
        seed : int
            Seed of the places, and of the offset of each row.

        Returns
        -------
        ndarray, shape (n, 3)
        """
        chance = np.random.default_rng(seed).uniform(size=(len(sizes), 3 if self.width else 2))
        places = np.zeros((len(sizes), 3))
        # with no room to the sides each lane would stay a bed in a plane
        lanes = max(int(self.width / ((1 + LOOSE) * float(sizes.max()))), 1)
        for lane in range(lanes):
            own = slice(lane, None, lanes)
            places[own, 0], places[own, 2] = self._lane(sizes[own], chance[own]).T
            if self.width:
                wide, free = self.width / lanes, self.width / lanes - sizes[own]
                places[own, 1] = (lane + 0.5) * wide + (chance[own, 2] - 0.5) * free
        return places

    def _lane(self, sizes: FloatArray, chance: FloatArray) -> FloatArray:
        """X and z of grains that rain in one lane, shape (n, 2)."""
        (start, end), room = self.ends, (1 + LOOSE) * sizes
        tops = _Tops(start, end, float(sizes.max()))
        for x, _, z in self.floor:
            tops.put(x - 0.5, x + 0.5, z + 0.5)
        places = np.empty((len(sizes), 2))
        x = start + room[0] * chance[0, 0]
        for number, (size, wide) in enumerate(zip(sizes.tolist(), room.tolist(), strict=True)):
            beside, over = LOOSE * size * chance[number, :2]
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
