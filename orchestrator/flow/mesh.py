"""The mesh of a flow case: made by gmsh from the case's own `pile.geo`, and checked."""

import re
import threading
from dataclasses import dataclass
from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.errors import SolverError
from orchestrator.flow.grid import Grid

GROUPS = frozenset({"air", "bed", "lid", "inlet", "outlet", "sides"})
"""Physical groups of the mesh; all but `air` become patches."""

ARGUMENTS = ["gmsh", "-v", "0", "-no_signal_handler"]
"""The last is for PETSc, a part of gmsh that would take all signals: a hang-up would end this
process, even under nohup. The one before keeps gmsh quiet about it."""

_GMSH = threading.Lock()  # gmsh has one global state
_TOLERANCE = 0.01
_QUAD, _HEXAHEDRON = 3, 5  # gmsh's element types

LINE_HEAD = """// The bed line from the inlet to the outlet: x and z of each corner, m;
// cells from it to the next one, and the ratio of each of these to the one upstream of it.
"""

Points = NDArray[np.float64]
Cells = NDArray[np.int64]


@dataclass(frozen=True)
class Mesh:
    """The mesh of a pile.

    Attributes
    ----------
    points : (P, 3) array
        Nodes, m.
    cells : (C, 8) array
        Nodes of each hexahedron, in the order of VTK.
    bed : (F, 4) array
        Nodes of the faces of the bed.
    """

    points: Points
    cells: Cells
    bed: Cells


def write_line(grid: Grid, path: Path) -> None:
    """Write the bed line and the cells along it as `pile.geo` includes them."""
    rows = zip(grid.line.x, grid.line.z, (*grid.cells, 0), (*grid.ratio, 1.0), strict=True)
    lines = ",\n".join(f"  {x!r}, {z!r}, {cells}, {ratio!r}" for x, z, cells, ratio in rows)
    path.write_text(f"{LINE_HEAD}bed_line() = {{\n{lines}\n}};\n", encoding="utf-8")


def write_mesh(directory: Path) -> None:
    """Mesh a case: `pile.geo` with what it includes becomes `pile.msh`, ASCII 2.2.

    The mesh must hold hexahedra only, none of them inverted, the physical groups in `GROUPS`, and
    first cells of the height `first_cell` (normal to the windward faces) within 1 %.

    Parameters
    ----------
    directory : Path
        The case; any thread may call, one at a time makes its mesh.

    Raises
    ------
    SolverError
        If gmsh fails, or the mesh is not the one asked for.
    """
    gmsh = _gmsh()
    with _GMSH:
        # the default installs a signal handler, which only the main thread may
        gmsh.initialize(ARGUMENTS, readConfigFiles=False, interruptible=False)
        try:
            _check(_generated(gmsh, directory), directory)
            gmsh.write(str(directory / "pile.msh"))
        finally:
            gmsh.finalize()


def _gmsh() -> Any:
    try:
        import gmsh
    except OSError as error:
        raise SolverError(
            f"gmsh does not load: {error}",
            remedy="install the Debian packages libglu1-mesa libxft2 libxcursor1 libxinerama1",
        ) from error
    return gmsh


def _generated(gmsh: Any, directory: Path) -> Mesh:
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(directory / "pile.geo"))
        gmsh.model.mesh.generate(3)
    except Exception as error:  # gmsh raises nothing narrower
        raise _unusable(f"gmsh failed: {error}", directory) from error
    groups = {gmsh.model.getPhysicalName(*group): group for group in gmsh.model.getPhysicalGroups()}
    missing = GROUPS - groups.keys()
    if missing:
        raise _unusable(f"without the physical groups {sorted(missing)}", directory)
    if list(gmsh.model.mesh.getElementTypes(3)) != [_HEXAHEDRON]:
        raise _unusable("not of hexahedra only", directory)
    return _arrays(gmsh, groups["bed"])


def _arrays(gmsh: Any, bed: tuple[int, int]) -> Mesh:
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    place[tags] = np.arange(len(tags))
    surfaces = gmsh.model.getEntitiesForPhysicalGroup(*bed)
    quads = [gmsh.model.mesh.getElementsByType(_QUAD, int(surface))[1] for surface in surfaces]
    return Mesh(
        points=coordinates.reshape(-1, 3),
        cells=place[gmsh.model.mesh.getElementsByType(_HEXAHEDRON)[1]].reshape(-1, 8),
        bed=place[np.concatenate(quads)].reshape(-1, 4),
    )


def _check(mesh: Mesh, directory: Path) -> None:
    inverted = int(np.count_nonzero(smallest_jacobian(mesh.points, mesh.cells) <= 0.0))
    if inverted:
        raise _unusable(f"with {inverted} inverted cells", directory)
    _check_first_cells(first_cell_heights(mesh), directory)


def smallest_jacobian(points: Points, cells: Cells) -> NDArray[np.float64]:
    """Smallest determinant of the edges that meet at a corner, for each hexahedron.

    Parameters
    ----------
    points : (P, 3) array
        Nodes, m.
    cells : (C, 8) array
        Nodes of each cell, in the order of VTK.

    Returns
    -------
    (C,) array
        m3; positive where the cell is convex and not inverted.
    """
    ahead = [1, 2, 3, 0, 7, 4, 5, 6]
    behind = [3, 0, 1, 2, 5, 6, 7, 4]
    across = [4, 5, 6, 7, 0, 1, 2, 3]
    corners = points[cells]
    edges = [corners[:, to] - corners for to in (ahead, behind, across)]
    determinants = np.einsum("cij,cij->ci", np.cross(edges[0], edges[1]), edges[2])
    return np.asarray(determinants.min(axis=1), dtype=np.float64)


def first_cell_heights(mesh: Mesh) -> NDArray[np.float64]:
    """Vertical extent of the cells on the bed, m; shape (faces of the bed,)."""
    on_bed = np.zeros(len(mesh.points), dtype=bool)
    on_bed[mesh.bed] = True
    below = on_bed[mesh.cells]
    lowest = below.sum(axis=1) == 4
    heights = np.where(below[lowest], -1.0, 1.0) * mesh.points[mesh.cells[lowest], 2]
    return np.asarray(heights.sum(axis=1) / 4.0, dtype=np.float64)


def _check_first_cells(heights: NDArray[np.float64], directory: Path) -> None:
    asked = _shape(directory)
    vertical = asked["first_cell"] / cos(radians(asked["slope_deg"]))
    off = float(np.abs(heights / vertical - 1.0).max(initial=0.0))
    if not heights.size or off > _TOLERANCE:
        raise _unusable(f"with first cells {off:.0%} off the height asked for", directory)


def _shape(directory: Path) -> dict[str, float]:
    text = (directory / "parameters.geo").read_text(encoding="utf-8")
    return {name: float(value) for name, value in re.findall(r"(?m)^(\w+) = ([^;]+);", text)}


def _unusable(how: str, directory: Path) -> SolverError:
    return SolverError(
        f"no usable mesh: {how}",
        where=str(directory / "pile.msh"),
        remedy="check the slope, the height and the first cell in parameters.geo",
    )
