"""Rows of equal grains, each of which rests in the pockets of the row below it.

Lengths are in diameters d of the scene.
"""

import numpy as np

from orchestrator.types import FloatArray

DISORDERED = 4
"""Least disordered rows: the packing is the same for any number of mobile layers up to
it."""
OFFSET = 0.125
"""Largest offset of a grain normal to its row, over the size of the disorder."""
ROOM = 1 + 1e-9
"""Neighbours of a disordered row are at least this far apart, diameters."""


def stacked(lowest: FloatArray, layers: int) -> list[FloatArray]:
    """Stack rows on a lowest one: each grain rests on two of the row below.

    Parameters
    ----------
    lowest
        X and z of its grains, d, shape (n, 2).
    layers
        How many rows are above it.

    Returns
    -------
    list
        X and z of the grains of each row, the uppermost first; that of m grains has
        shape (m, 2).
    """
    rows = [lowest]
    for _ in range(layers):
        apart = np.diff(rows[0], axis=0)
        half = np.hypot(*apart.T)[:, None] / 2
        outward = np.column_stack([-apart[:, 1], apart[:, 0]]) / (2 * half)
        rows.insert(0, rows[0][:-1] + apart / 2 + outward * np.sqrt(1 - half**2))
    return rows


def overlaps(row: FloatArray) -> FloatArray:
    """Find how much nearer than `ROOM` each two neighbours of a row are.

    Parameters
    ----------
    row
        X and z of its grains, d, shape (n, 2).

    Returns
    -------
    FloatArray
        The overlaps, d, negative where neighbours are farther apart; shape (n - 1,).
    """
    return np.asarray(ROOM - np.hypot(*np.diff(row, axis=0).T))
