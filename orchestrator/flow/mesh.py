"""The mesh of a flow case: its grid lines along the bed, and the hexahedra that gmsh makes of them.

The grid lines are vertical. Each corner of the bed line is one of them; between two corners the
cells are a geometric series. They are shortest at sharp tops, where the stress has its peaks.
"""

import threading
from dataclasses import dataclass, replace
from math import expm1, inf, log, radians, tan
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from orchestrator.bed.line import BedLine
from orchestrator.digits import FORMAT, whole_up
from orchestrator.errors import SolverError
from orchestrator.types import FloatArray

if TYPE_CHECKING:
    import meshio

SHARP_DEG = 8.0
"""Least bend of the bed that is a corner, not a part of a curve."""
CELLS_ON_OBSTACLE = 8
"""Cells in the height of an obstacle, along the bed beside it."""
TOP = 0.35
"""Length of the cells at sharp tops over the mean of a face: a grain's stress is averaged over h/40
there."""
NEAR = 4.0
"""Beyond this, h before and behind the forms and above the bed, cells grow by `FAR`."""
FAR = 1.3
"""Ratio of neighbouring cells there, with 40 cells on a face."""
LEVEL_CELLS = 8
"""A level piece of this many cells at least is divided in the middle: cells grow towards it."""
GROUPS = frozenset({"air", "bed", "lid", "inlet", "outlet", "sides"})
"""Physical groups of the mesh; all but `air` become patches."""
ARGUMENTS = ["gmsh", "-v", "0", "-no_signal_handler"]
"""PETSc, a part of gmsh, would take all signals: a hang-up would end this process."""
LINE_HEAD = """// The bed line from the inlet to the outlet: x and z of each corner, m;
// cells from it to the next one, and the ratio of each of these to the one upstream of it.
"""
_GMSH = threading.Lock()  # gmsh has one global state
_QUADRANGLE, _HEXAHEDRON = 3, 5  # gmsh's types of elements


@dataclass(frozen=True)
class Grid:
    """The pieces between the corners of a bed line (m), with one more where a piece was divided.

    Each piece has a number of cells, and the length of a cell over that of the one upstream of it.
    """

    line: BedLine
    cells: tuple[int, ...]
    ratio: tuple[float, ...]

    @property
    def shortest(self) -> tuple[float, float, float]:
        """Length of the shortest cell and the two ends of its piece, m."""
        pieces = zip(self.cells, self.ratio, np.diff(self.line.x).tolist(), strict=True)
        shorter = [
            _first((n, max(ratio, 1 / ratio)), length) for n, ratio, length in pieces
        ]
        piece = int(np.argmin(shorter))
        return shorter[piece], self.line.x[piece], self.line.x[piece + 1]

    def write(self, path: Path) -> None:
        """Write the bed line and the cells along it as `pile.geo` includes them."""
        rows = zip(
            self.line.x, self.line.z, (*self.cells, 0), (*self.ratio, 1.0), strict=True
        )
        form = f"  {FORMAT}, {FORMAT}, %d, {FORMAT}"
        lines = ",\n".join(form % row for row in rows)
        path.write_text(f"{LINE_HEAD}bed_line() = {{\n{lines}\n}};\n", encoding="utf-8")


def growth_far(growth: float, cells_per_face: int) -> float:
    """Ratio of neighbouring cells far from the forms."""
    return max(growth, float(FAR ** (40 / cells_per_face)))


def extended(line: BedLine, upstream: float, downstream: float) -> BedLine:
    """A line with flat bed of some lengths, m, before and behind it in place of its own."""
    return replace(
        line, x=(line.x[1] - upstream, *line.x[1:-1], line.x[-2] + downstream)
    )


def along(line: BedLine, slope_deg: float, cells_per_face: int, growth: float) -> Grid:
    """The grid along a bed line (m); `growth` is the ratio of neighbouring cells beside the form.

    A face of the slope as high as the form has `cells_per_face` cells; 0 stands for no face.
    """
    face = line.h / tan(radians(slope_deg)) if slope_deg else 4 * line.h
    cell = face / cells_per_face
    # a face has a short cell at its sharp top, and this at its foot
    face_ratio = ratio_of(cells_per_face, TOP * cell, face)
    foot = TOP * cell * face_ratio ** (cells_per_face - 1) if slope_deg else cell
    ends = (line.x[1] - NEAR * line.h, line.x[-2] + NEAR * line.h)
    inside = [x for x in ends if line.x[0] + cell < x < line.x[-1] - cell]
    line = _divided(line.with_corners(inside), cell)
    sizes = _sizes(line, cell, foot, max(growth, face_ratio))
    lengths = np.diff(line.x)
    inner = [
        _piece(*one)
        for one in zip(lengths[1:-1], sizes[1:-2], sizes[2:-1], strict=True)
    ]
    far = growth_far(growth, cells_per_face)
    up, ratio_up = _away(lengths[0], _first(inner[0], lengths[1]), far)
    last, ratio_last = inner[-1]
    down = _away(lengths[-1], _first((last, 1 / ratio_last), lengths[-2]), far)
    pieces = [(up, 1 / ratio_up), *inner, down]
    return Grid(line, tuple(n for n, _ in pieces), tuple(r for _, r in pieces))


def ratio_of(cells: int, first: float, length: float) -> float:
    """The ratio, at least 1, at which `cells` cells that begin with `first` fill a length."""
    if cells < 2 or first * cells >= length:
        return 1.0

    def beyond(ratio: float) -> float:
        return first * float(expm1(cells * log(ratio))) / (ratio - 1) - length

    from scipy.optimize import brentq  # a third of a second, for which no page waits

    # the last cell alone would fill the length at the upper end
    return float(
        brentq(beyond, 1 + 1e-9, (length / first) ** (1 / (cells - 1)), xtol=1e-15)
    )


def _divided(line: BedLine, cell: float) -> BedLine:
    """The line with a corner in the middle of pieces whose cells shall grow from both ends."""
    lengths, bends = np.diff(line.x), line.bends_deg
    level = np.abs(np.diff(line.z)) < 1e-9 * line.h
    level &= lengths > LEVEL_CELLS * cell
    ridge = (bends[:-1] > SHARP_DEG) & (bends[1:] > SHARP_DEG)
    chosen = np.flatnonzero((level | ridge)[1:-1]) + 1
    return line.with_corners([(line.x[i] + line.x[i + 1]) / 2 for i in chosen])


def _sizes(line: BedLine, cell: float, foot: float, growth: float) -> FloatArray:
    """Length of the cells at each corner, m; the ends of the line have none of their own."""
    x, z, bends, lengths = (
        np.array(line.x),
        np.array(line.z),
        line.bends_deg,
        np.diff(line.x),
    )
    sizes = np.full(len(x), cell)
    sizes[bends > SHARP_DEG] = TOP * cell
    sizes[bends < -SHARP_DEG] = foot
    # in the middle of level bed, and at the ends, as long as the growth allows
    level = np.abs(np.diff(z)) < 1e-9 * line.h
    sizes[1:-1][(np.abs(bends[1:-1]) < 1e-9) & level[1:] & level[:-1]] = inf
    sizes[[0, -1]] = inf
    for start, end in line.bare:
        on_it = (x >= start - 1e-12) & (x <= end + 1e-12)
        sizes[on_it] = np.minimum(sizes[on_it], np.ptp(z[on_it]) / CELLS_ON_OBSTACLE)
    sizes[1:-1] = np.minimum(sizes[1:-1], np.minimum(lengths[:-1], lengths[1:]))
    for i in range(1, len(sizes)):
        sizes[i] = min(sizes[i], sizes[i - 1] + (growth - 1) * lengths[i - 1])
    for i in range(len(sizes) - 2, -1, -1):
        sizes[i] = min(sizes[i], sizes[i + 1] + (growth - 1) * lengths[i])
    return sizes


def _piece(length: float, start: float, end: float) -> tuple[int, float]:
    """Cells, and their ratio, of a piece whose first and last cells are about `start` and `end`."""
    first, last = min(start, end), max(start, end)
    if last >= length:
        return 1, 1.0
    ratio = (length - first) / (length - last)
    count = length / first if ratio - 1 < 1e-9 else 1 + log(last / first) / log(ratio)
    cells = max(whole_up(count), 1)
    if cells < 3 or ratio - 1 < 1e-6 or first * cells >= length:
        return cells, 1.0
    ratio = ratio_of(cells, first, length)
    return cells, ratio if start <= end else 1 / ratio


def _away(length: float, first: float, growth: float) -> tuple[int, float]:
    """Cells that begin with `first` and grow until they fill a length."""
    cells = whole_up(log(1 + length * (growth - 1) / first) / log(growth))
    return cells, ratio_of(cells, first, length)


def _first(piece: tuple[int, float], length: float) -> float:
    """Length of the first cell of a piece; its cells are a geometric series."""
    cells, ratio = piece
    if ratio < 1:
        return _first((cells, 1 / ratio), length) * ratio ** (1 - cells)
    return (
        length / cells
        if ratio == 1
        else length * (ratio - 1) / float(expm1(cells * log(ratio)))
    )


def made_by_gmsh(directory: Path) -> "meshio.Mesh":
    """The mesh of a case, which gmsh makes of `pile.geo` and the files that it includes.

    Its cell sets are the faces of each patch. Any thread may call; one at a time makes its mesh.
    Raises a SolverError if gmsh fails, cells are inverted or no hexahedra, or one of `GROUPS` is
    missing.
    """
    import meshio

    try:
        import gmsh
    except OSError as error:
        remedy = (
            "install the Debian packages libglu1-mesa libxft2 libxcursor1 libxinerama1"
        )
        raise SolverError(f"gmsh does not load: {error}", remedy=remedy) from error
    with _GMSH:
        # the default installs a signal handler, which only the main thread may
        gmsh.initialize(ARGUMENTS, readConfigFiles=False, interruptible=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.open(str(directory / "pile.geo"))
            model, mesh = gmsh.model, gmsh.model.mesh
            mesh.generate(3)
            names = {
                model.getPhysicalName(*group) for group in model.getPhysicalGroups()
            }
            if missing := GROUPS - names:
                raise ValueError(f"without the physical groups {sorted(missing)}")
            if list(mesh.getElementTypes(3)) != [_HEXAHEDRON]:
                raise ValueError("not of hexahedra only")
            tags, cells = mesh.getElementsByType(_HEXAHEDRON)
            if (mesh.getElementQualities(tags, "minSICN") <= 0).any():
                raise ValueError("with inverted cells")
            nodes, points, _ = mesh.getNodes()
            number, patches = np.empty(int(nodes.max()) + 1, np.int64), {}
            number[nodes] = np.arange(len(nodes))
            for group in model.getPhysicalGroups(2):
                faces = model.getEntitiesForPhysicalGroup(*group)
                quads = [mesh.getElementsByType(_QUADRANGLE, face)[1] for face in faces]
                corners = number[np.concatenate(quads)].reshape(-1, 4)
                patches[model.getPhysicalName(*group)] = corners
            ends = np.cumsum([len(corners) for corners in patches.values()])
            rows = np.split(np.arange(ends[-1]), ends[:-1])
            sets = {name: [None, of] for name, of in zip(patches, rows, strict=True)}
            sides, hexahedra = (
                np.concatenate([*patches.values()]),
                number[cells].reshape(-1, 8),
            )
            blocks = [("hexahedron", hexahedra), ("quad", sides)]
            return meshio.Mesh(points.reshape(-1, 3), blocks, cell_sets=sets)
        except Exception as error:  # gmsh raises nothing narrower
            remedy = "check the slope, the height and the first cell in parameters.geo"
            where = str(directory / "pile.geo")
            raise SolverError(f"no usable mesh: {error}", where, remedy) from error
        finally:
            gmsh.finalize()
