"""Roughness lengths of the ground by place, from a second raster."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.errors import InputError
from orchestrator.runs.files import digest_text
from orchestrator.surface.raster import read_raster
from orchestrator.types import FloatArray

LARGEST = 10.0
"""Largest roughness length that is no mistake, m."""


@dataclass(frozen=True)
class RoughnessMap:
    """Roughness lengths on a raster; two with one digest are one.

    Attributes
    ----------
    name
        The name of its file.
    x, y
        Axes of the file, m, rising.
    z0
        Roughness lengths, m, of shape (ny, nx), NaN where there is none.
    system
        Coordinate reference system as well-known text; empty without any.
    digest
        SHA-256 of places and lengths.
    understood
        What its file says of its unit, its system and its empty cells.
    """

    name: str = field(compare=False)
    x: FloatArray = field(compare=False, repr=False)
    y: FloatArray = field(compare=False, repr=False)
    z0: FloatArray = field(compare=False, repr=False)
    system: str = field(compare=False, repr=False)
    digest: str
    understood: str = field(default="", compare=False, repr=False)

    def at(self, x: ArrayLike, y: ArrayLike, elsewhere: float) -> FloatArray:
        """Find the roughness length of the cell at each place.

        Parameters
        ----------
        x, y
            Places on the axes of the file, m, which broadcast.
        elsewhere
            Roughness length outside the raster and in its empty cells, m.

        Returns
        -------
        FloatArray
            Roughness lengths, m, of the broadcast shape.
        """
        east, north = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        column = _cells(self.x, east)
        row = _cells(self.y, north)
        inside = (column >= 0) & (column < len(self.x))
        inside &= (row >= 0) & (row < len(self.y))
        found = np.full(east.shape, elsewhere)
        found[inside] = self.z0[row[inside], column[inside]]
        return np.where(np.isnan(found), elsewhere, found)


def _cells(axis: FloatArray, places: FloatArray) -> Any:
    """Numbers of the cells of an axis in which places lie, also beyond its ends."""
    step = (axis[-1] - axis[0]) / (len(axis) - 1)
    return np.floor((places - axis[0]) / step + 0.5).astype(int)


def read_roughness(path: Path, where: str) -> RoughnessMap:
    """Read a raster of roughness lengths.

    Parameters
    ----------
    path
        A GeoTIFF or an ESRI grid.
    where
        The file and the field that names it, for messages.

    Returns
    -------
    RoughnessMap
        The map.

    Raises
    ------
    InputError
        If the file is no such raster, or a number in it no roughness length.
    """
    raster = read_raster(path, where)
    known = raster.z[~np.isnan(raster.z)]
    if not len(known):
        raise InputError("no cell has a roughness", where, "is its nodata right?")
    for value in (float(known.min()), float(known.max())):
        if not 0 < value <= LARGEST:
            what = f"a roughness length of {value:.6g} m"
            remedy = "z0 is above 0, in m; declare the number of empty cells"
            raise InputError(what, where, remedy)
    numbers = [raster.x.tolist(), raster.y.tolist(), raster.z.tolist()]
    digest = digest_text(repr(numbers))
    cells = (raster.x, raster.y, raster.z)
    understood = ", ".join(raster.understood)
    return RoughnessMap(path.name, *cells, raster.system, digest, understood)
