"""Rows of touching spheres that are not a lattice: random gaps and offsets below, pockets above."""

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed.line import BedLine

FloatArray = NDArray[np.float64]

OFFSET = 0.125
"""Largest offset of a grain normal to its row, over the size of the disorder."""
FINE = 0.1
"""Between two places of a curve at which a row may be opened, diameters."""
MOST_TURNS = 100
"""How often a row is opened further; whoever overlaps then is left out by `cover`."""
TOUCH = 1 + 1e-9
"""Neighbours of a row are at least this far apart, diameters."""


def rows(columns: int, layers: int, *, beta: float, size: float, seed: int) -> list[FloatArray]:
    """Rows of a disordered bed, the uppermost first.

    The lowest row has random gaps between its grains, up to `size`, and random offsets normal to
    it. Each grain of a row above rests in the pocket of two grains of the row below it.

    Parameters
    ----------
    columns : int
        Grains of the lowest row on either side of the middle.
    layers : int
        How many rows lie on the lowest one.
    beta : float
        Entrainment angle of the lattice that is disturbed, rad.
    size : float
        Largest gap, diameters.
    seed : int
        The same seed gives the same bed.

    Returns
    -------
    list of ndarray, shape (n, 2)
        Along the rows and normal to them, diameters; the middle grain of the uppermost is at 0.
    """
    rng = np.random.default_rng(seed)
    spacing = 2 * np.cos(beta) + rng.uniform(0, size, 2 * columns)
    offset = rng.uniform(-OFFSET * size, OFFSET * size, 2 * columns + 1)
    found = _stack(spacing, offset, layers)
    # where two grains of a row would overlap, the row below them is opened a little
    while any(np.any(_overlap(row) > 0) for row in found):
        for above, row in enumerate(found):
            wide = np.zeros_like(spacing)
            for place in np.flatnonzero(_overlap(row) > 0):
                wide[place : place + layers - above + 1] += _overlap(row)[place]
            spacing = spacing + wide
        found = _stack(spacing, offset, layers)
    middle = found[0][len(found[0]) // 2]
    return [row - middle for row in found]


def rows_on(
    curve: BedLine, count: int, layers: int, *, spacing: float, size: float, seed: int
) -> list[FloatArray]:
    """Rows along a curve, the uppermost first; the lowest lies on the curve.

    Where two grains of a row would overlap, on the inside of a bend, the row below them is opened.

    Parameters
    ----------
    curve : BedLine
        Diameters.
    count, layers : int
        Grains of the lowest row, and rows above it.
    spacing, size : float
        Distance of two neighbours of the lowest row, and the largest gap that is added to it.
    seed : int
        The same seed gives the same bed.
    """
    rng = np.random.default_rng(seed)
    gaps = rng.uniform(0, size, count) if size else np.zeros(count)
    aside = rng.uniform(-OFFSET * size, OFFSET * size, count + 1)
    close = np.concatenate([[0.0], np.cumsum(spacing + gaps)])
    # the opening belongs to places of the curve: grains that it shifts leave it where it is
    length = 2 * float(close[-1]) + 1
    places = np.linspace(0, length, int(np.ceil(length / FINE)) + 1)
    opened = np.zeros(len(places))
    for _ in range(MOST_TURNS):
        along = np.interp(close, places - np.cumsum(opened), places)
        found = [_on(curve, along, aside)]
        for _ in range(layers):
            found.insert(0, _pockets(found[0]))
        wide = np.zeros(count)
        for above, row in enumerate(found):
            more = np.maximum(_overlap(row), 0.0)
            for place in range(layers - above + 1):
                there = wide[place : place + len(more)]
                np.maximum(there, more, out=there)
        if not wide.any():
            break
        steps = places[1] - places[0]
        gap = np.clip(np.searchsorted(along, places) - 1, 0, count - 1)
        opened += np.minimum(1.1 * wide[gap] / np.diff(along)[gap], 0.5) * steps
        opened = np.minimum(opened, 0.5 * steps)
    return found


def _on(curve: BedLine, along: FloatArray, aside: FloatArray) -> FloatArray:
    """Places on a curve by the distance from its beginning, and so far aside."""
    arc = curve.arc_lengths - curve.arc_lengths[0]
    segment = np.clip(np.searchsorted(arc, along, side="right") - 1, 0, len(arc) - 2)
    into = (along - arc[segment])[:, None] * curve.tangents[segment]
    return np.asarray(curve.corners[segment] + into + aside[:, None] * curve.normals[segment])


def _stack(spacing: FloatArray, offset: FloatArray, layers: int) -> list[FloatArray]:
    lowest = np.column_stack([np.concatenate([[0], np.cumsum(spacing)]), offset])
    found = [lowest]
    for _ in range(layers):
        found.insert(0, _pockets(found[0]))
    return found


def _pockets(row: FloatArray) -> FloatArray:
    """Centres of grains that rest on each two neighbours of a row."""
    apart = np.diff(row, axis=0)
    half = np.hypot(*apart.T)[:, None] / 2
    outward = np.column_stack([-apart[:, 1], apart[:, 0]]) / (2 * half)
    return np.asarray(row[:-1] + apart / 2 + outward * np.sqrt(1 - half**2))


def _overlap(row: FloatArray) -> FloatArray:
    return np.asarray(TOUCH - np.hypot(*np.diff(row, axis=0).T))
