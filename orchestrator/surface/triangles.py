"""Files of triangles (STL): the heights of their vertices, seen from above."""

import warnings
from pathlib import Path

import numpy as np

from orchestrator.errors import InputError
from orchestrator.study.source import read_bytes
from orchestrator.surface.heights import FEWEST, Raster
from orchestrator.types import FloatArray

HEAD, TRIANGLE = 84, 50
"""Bytes of the head of a binary file, and of each of its triangles."""
REMEDY = "is it an STL file of a surface, seen from above?"


def read_triangles(path: Path, largest: int, where: str) -> Raster:
    """Read the vertices that are seen from above, and interpolate between them.

    Parameters
    ----------
    path
        The file.
    largest
        Most bytes of it.
    where
        The file and the field that names it, for messages.

    Returns
    -------
    Raster
        Heights on a raster with as many cells as there are vertices.

    Raises
    ------
    InputError
        If the file is no surface, with the place and the remedy.
    """
    from scipy.interpolate import LinearNDInterpolator

    _check_whole(read_bytes(path, largest, where), where)
    points = _seen_from_above(path, where)
    _, counts = np.unique(points[:, :2], axis=0, return_counts=True)
    if counts.max() > 1:
        twice = points[np.repeat(counts > 1, counts)][0]
        what = f"x = {twice[0]:.9g} m, y = {twice[1]:.9g} m has two heights"
        raise InputError(what, where, "a wall or an overhang is no bed")
    start = points.min(axis=0)
    extent = np.ptp(points, axis=0)
    step = float(np.sqrt(extent[0] * extent[1] / len(points)))
    east = np.linspace(0.0, extent[0], round(extent[0] / step) + 1)
    north = np.linspace(0.0, extent[1], round(extent[1] / step) + 1)
    of_places = LinearNDInterpolator(points[:, :2] - start[:2], points[:, 2])
    heights = of_places(*np.meshgrid(east, north))
    return Raster(path.name, start[0] + east, start[1] + north, heights)


def _check_whole(content: bytes, where: str) -> None:
    """Refuse a file that is no whole STL: its reader would write pages of its own."""
    triangles = int.from_bytes(content[80:84], "little")
    is_binary = len(content) == HEAD + TRIANGLE * triangles
    is_text = content.lstrip()[:5] == b"solid" and b"endsolid" in content
    if not (is_binary or is_text):
        raise InputError("it is no whole STL file", where, REMEDY)


def _seen_from_above(path: Path, where: str) -> FloatArray:
    """The vertices of the triangles of an STL file that are seen from above, (n, 3)."""
    import meshio

    try:
        with warnings.catch_warnings():
            # the count of triangles that it reads in a text overflows
            warnings.simplefilter("ignore")
            mesh = meshio.stl.read(path)
        triangles = mesh.cells_dict["triangle"]
    except Exception as error:  # a reader of another library raises what it likes
        what = str(error) or "its lines are not whole triangles"
        raise InputError(f"not readable: {what}", where, REMEDY) from None
    if not np.isfinite(mesh.points).all():
        raise InputError("a vertex is not a number", where, REMEDY)
    corners = mesh.points.astype(float)[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    up = np.abs(normal[:, 2])
    if (counts > 1).all():
        # the sides and the bottom of a closed body are no bed; the normals of a body
        # with a volume below 0 are inwards
        volume = (corners[:, 0] * normal).sum()
        up = np.sign(volume) * normal[:, 2]
    is_upper = up > 1e-6 * np.linalg.norm(normal, axis=1)
    points = np.unique(corners[is_upper].reshape(-1, 3), axis=0)
    if len(points) < FEWEST**2:
        raise InputError(f"{len(points)} vertices are no surface", where, REMEDY)
    return points
