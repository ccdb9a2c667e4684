"""The velocity that OpenFOAM found, on a grid of points."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.solvers.openfoam import read_last_time

FloatArray = NDArray[np.float64]
Window = tuple[float, float, float, float]
"""Left, right, bottom, top."""


def velocity(case: Path, window: Window, shape: tuple[int, int]) -> FloatArray:
    """The velocity of a finished case on a grid.

    Parameters
    ----------
    case : Path
        Its directory.
    window : tuple of float
        Left, right, bottom and top of the grid, m.
    shape : tuple of int
        Rows and columns.

    Returns
    -------
    ndarray, shape (rows, columns, 3)
        m/s, rows upwards; NaN outside the mesh.
    """
    import pyvista  # half a second: only a study with piles waits for it

    _, cells = read_last_time(case, "bed", ["U"])
    mesh = cells.cell_data_to_point_data()
    left, right, bottom, top = window
    rows, columns = shape
    middle = (mesh.bounds[2] + mesh.bounds[3]) / 2
    spacing = ((right - left) / (columns - 1), 1.0, (top - bottom) / (rows - 1))
    grid = pyvista.ImageData(
        dimensions=(columns, 1, rows), spacing=spacing, origin=(left, middle, bottom)
    )
    found: Any = grid.sample(mesh)
    inside = np.asarray(found["vtkValidPointMask"], bool)
    known = np.where(inside[:, None], np.asarray(found.point_data["U"], float), np.nan)
    return known.reshape(rows, columns, 3)
