"""The mesh of a flow case: its grid lines along the bed, and the hexahedra by gmsh.

The grid lines are vertical. Each corner of the bed line is one of them; between two
corners the cells are a geometric series. They are shortest at sharp tops, where the
stress has its peaks.
"""

import threading
from dataclasses import dataclass, replace
from functools import cache
from math import inf, log, radians, tan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.bed.line import BedLine
from orchestrator.digits import FORMAT, whole_up
from orchestrator.errors import SolverError
from orchestrator.types import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    import meshio

CORNER_DEG = 8.0
"""Least bend of the bed, degrees, that is a corner and not a part of a curve."""
CELLS_ON_OBSTACLE = 8
"""Cells in the height of an obstacle, along the bed beside it."""
CELLS_IN_FENCE = 2
"""Cells from one side of a porous fence to the other, at least."""
TOP = 0.35
"""Length of the cells at sharp tops over the mean of a face: the stress of a grain is
averaged over h/40 there."""
NEAR = 4.0
"""Distance before and behind the forms and above the bed, h, beyond which cells grow by
`FAR`."""
FAR = 1.3
"""Ratio of neighbouring cells there, with 40 cells on a face."""
LEVEL_CELLS = 8
"""A level piece of this many cells at least is divided in the middle: cells grow
towards it."""
LEVEL = 1e-9
"""Rise of a piece, h, below which it is level."""
NO_BEND_DEG = 1e-9
"""Bend, degrees, below which the bed does not bend."""
ALIKE = 1e-6
"""Growth of the cells of a piece below which they are alike."""
STEADY = 1e-9
"""Difference from 1 below which a ratio of cells is 1."""
GROUPS = frozenset({"air", "bed", "lid", "inlet", "outlet", "sides"})
"""Physical groups of the mesh; all but `air` become patches."""
ARGUMENTS = ["gmsh", "-v", "0", "-no_signal_handler"]
"""PETSc, a part of gmsh, would take all signals: a hang-up would end this process."""
LINE_HEAD = (
    "// The bed line from the inlet to the outlet: x and z of each corner, m;\n"
    "// cells from it to the next one, and the ratio of each of these to the one"
    " upstream of it.\n"
)
_GMSH = threading.Lock()
"""gmsh has one global state."""
_QUADRANGLE = 3
_HEXAHEDRON = 5
"""Types of elements, as gmsh numbers them."""


class Piece(NamedTuple):
    """Cells between two corners, a geometric series.

    Attributes
    ----------
    cells
        How many there are.
    ratio
        Length of a cell over that of the one upstream of it.
    """

    cells: int
    ratio: float

    def ends(self, length: float) -> FloatArray:
        """Ends of the cells.

        Parameters
        ----------
        length
            Length of all cells together.

        Returns
        -------
        FloatArray
            Their distances from the start of the first cell, in the same unit.

        Examples
        --------
        >>> Piece(3, 2.0).ends(7.0).tolist()
        [1.0, 3.0, 7.0]
        """
        over_first = np.cumsum(self.ratio ** np.arange(self.cells))
        return np.asarray(over_first * length / over_first[-1])

    def reversed(self) -> "Piece":
        """The same cells, seen from their other end.

        Returns
        -------
        Piece
            The cells.
        """
        return Piece(self.cells, 1 / self.ratio)


@dataclass(frozen=True)
class Grid:
    """The grid lines along a bed line.

    Attributes
    ----------
    line
        The bed line, m, with one more corner where a piece was divided.
    pieces
        The cells between each two corners.
    """

    line: BedLine
    pieces: tuple[Piece, ...]

    @property
    def cells(self) -> int:
        """Number of the cells along the bed."""
        return sum(piece.cells for piece in self.pieces)

    @property
    def shortest(self) -> tuple[float, float, float]:
        """Length of the shortest cell and the two ends of its piece, m."""
        cells = []
        for piece, length in zip(self.pieces, np.diff(self.line.x), strict=True):
            cells.append(np.diff(piece.ends(length), prepend=0.0).min())
        at = int(np.argmin(cells))
        return float(cells[at]), self.line.x[at], self.line.x[at + 1]

    def write(self, path: Path) -> None:
        """Write the bed line and the cells along it as `mesh.geo` includes them.

        Parameters
        ----------
        path
            The file.
        """
        form = f"  {FORMAT}, {FORMAT}, %d, {FORMAT}"
        behind_the_last = Piece(0, 1.0)
        pieces = (*self.pieces, behind_the_last)
        rows = zip(self.line.x, self.line.z, pieces, strict=True)
        lines = ",\n".join(form % (x, z, *piece) for x, z, piece in rows)
        path.write_text(f"{LINE_HEAD}bed_line() = {{\n{lines}\n}};\n", encoding="utf-8")


def growth_far(growth: float, cells_per_face: int) -> float:
    """Ratio of neighbouring cells far from the forms.

    Parameters
    ----------
    growth
        The ratio beside them.
    cells_per_face
        Cells of a face as high as the form.

    Returns
    -------
    float
        The ratio.
    """
    return max(growth, float(FAR ** (40 / cells_per_face)))


def extended(line: BedLine, upstream: float, downstream: float) -> BedLine:
    """A line with another length of flat bed at its ends.

    Parameters
    ----------
    line
        The bed line, m.
    upstream, downstream
        Lengths of the flat bed before and behind it, m, in place of its own.

    Returns
    -------
    BedLine
        The line.
    """
    start = line.x[1] - upstream
    end = line.x[-2] + downstream
    return replace(line, x=(start, *line.x[1:-1], end))


@cache  # flows of many roughnesses share it
def along(line: BedLine, slope_deg: float, cells_per_face: int, growth: float) -> Grid:
    """The grid along a bed line.

    Parameters
    ----------
    line
        The bed line, m.
    slope_deg
        Slope of a face, degrees; 0 stands for no face.
    cells_per_face
        Cells of a face of this slope that is as high as the form.
    growth
        Ratio of neighbouring cells beside the form.

    Returns
    -------
    Grid
        The grid.
    """
    face = line.h / tan(radians(slope_deg)) if slope_deg else 4 * line.h
    cell = face / cells_per_face
    # A face has a short cell at its sharp top, and this one at its foot.
    face_ratio = float(ratio_of(cells_per_face, TOP * cell, face))
    foot = cell
    if slope_deg:
        foot = TOP * cell * face_ratio ** (cells_per_face - 1)
    ends = (line.x[1] - NEAR * line.h, line.x[-2] + NEAR * line.h)
    inside = [x for x in ends if line.x[0] + cell < x < line.x[-1] - cell]
    line = _divided(line.with_corners(inside), cell)
    sizes = _sizes(line, cell, foot, max(growth, face_ratio))
    lengths = np.diff(line.x)
    inner = _pieces(lengths[1:-1], sizes[1:-2], sizes[2:-1])
    far = growth_far(growth, cells_per_face)
    first_cell = inner[0].ends(lengths[1])[0]
    upstream = growing(lengths[0], first_cell, far)
    last_cell = inner[-1].reversed().ends(lengths[-2])[0]
    downstream = growing(lengths[-1], last_cell, far)
    return Grid(line, (upstream.reversed(), *inner, downstream))


def ratio_of(cells: ArrayLike, first: ArrayLike, length: ArrayLike) -> FloatArray:
    """The ratios of neighbouring cells that fill lengths.

    Parameters
    ----------
    cells
        How many cells there are in each length.
    first
        Length of the first one.
    length
        The length that they fill, in the same unit. The three broadcast.

    Returns
    -------
    FloatArray
        The ratios, below 1 where even cells would not find room. It is 1 for a cell
        alone, and where the first cell is as long as the whole.

    Examples
    --------
    >>> ratio_of(3, 1.0, [7.0, 3.0, 1.75]).round(9).tolist()
    [2.0, 1.0, 0.5]
    """
    from scipy.optimize.elementwise import find_root  # slow to import: no page waits

    count, start, whole = np.broadcast_arrays(
        np.asarray(cells, float), np.asarray(first, float), np.asarray(length, float)
    )
    ratios = np.ones(count.shape)
    grow = (count > 1) & (start < whole)
    given = count[grow], start[grow] / whole[grow]
    # An endless series fills the length at the lower end, the last cell alone at the
    # upper one.
    ends = 1 - given[1], given[1] ** (1 / (1 - given[0]))
    ratios[grow] = find_root(_beyond, ends, args=given).x
    # Cells that fill all but the last digits of a length are alike.
    return np.where(np.abs(ratios - 1) < STEADY, 1.0, ratios)


def _beyond(ratio: FloatArray, count: FloatArray, first: FloatArray) -> FloatArray:
    """How far cells reach beyond a length of 1."""
    are_alike = ratio == 1
    growth = np.where(are_alike, 1.0, ratio - 1)
    over_first = np.expm1(count * np.log(ratio)) / growth
    return np.asarray(first * np.where(are_alike, count, over_first) - 1)


def _is_level(line: BedLine) -> BoolArray:
    """Which pieces of a line are level."""
    return np.asarray(np.abs(np.diff(line.z)) < LEVEL * line.h)


def _divided(line: BedLine, cell: float) -> BedLine:
    """The line with a corner in the middle of long level pieces and of ridges."""
    bends = line.bends_deg
    is_long = np.diff(line.x) > LEVEL_CELLS * cell
    is_ridge = (bends[:-1] > CORNER_DEG) & (bends[1:] > CORNER_DEG)
    chosen = (_is_level(line) & is_long) | is_ridge
    inner = np.flatnonzero(chosen[1:-1]) + 1
    middles = [(line.x[at] + line.x[at + 1]) / 2 for at in inner]
    return line.with_corners(middles)


def _sizes(line: BedLine, cell: float, foot: float, growth: float) -> FloatArray:
    """Length of the cells at each corner, m; without one of their own at the ends."""
    x = np.array(line.x)
    z = np.array(line.z)
    bends = line.bends_deg
    lengths = np.diff(line.x)
    sizes = np.full(len(x), cell)
    sizes[bends > CORNER_DEG] = TOP * cell
    sizes[bends < -CORNER_DEG] = foot
    # In the middle of level bed, and at the ends, as long as the growth allows.
    level = _is_level(line)
    inside_level = (np.abs(bends[1:-1]) < NO_BEND_DEG) & level[1:] & level[:-1]
    sizes[1:-1][inside_level] = inf
    sizes[[0, -1]] = inf
    porous = {(fence.start, fence.end): fence for fence in line.fences}
    for start, end in line.bare:
        on_it = (x >= start - 1e-12) & (x <= end + 1e-12)
        own = np.ptp(z[on_it]) / CELLS_ON_OBSTACLE
        if (start, end) in porous:
            own = porous[start, end].thickness / CELLS_IN_FENCE
        sizes[on_it] = np.minimum(sizes[on_it], own)
    shorter_piece = np.minimum(lengths[:-1], lengths[1:])
    sizes[1:-1] = np.minimum(sizes[1:-1], shorter_piece)
    for i in range(1, len(sizes)):
        sizes[i] = min(sizes[i], sizes[i - 1] + (growth - 1) * lengths[i - 1])
    for i in range(len(sizes) - 2, -1, -1):
        sizes[i] = min(sizes[i], sizes[i + 1] + (growth - 1) * lengths[i])
    return sizes


def _pieces(lengths: FloatArray, starts: FloatArray, ends: FloatArray) -> list[Piece]:
    """The pieces whose first and last cells are about `starts` and `ends`."""
    counts = []
    for length, start, end in zip(lengths, starts, ends, strict=True):
        counts.append(_count(length, min(start, end), max(start, end)))
    shorter = np.minimum(starts, ends)
    cells = np.array(counts)
    ratios = ratio_of(cells, shorter, lengths)
    ratios[(cells < 3) | (ratios < 1 + ALIKE)] = 1.0
    falling = starts > ends
    ratios[falling] = 1 / ratios[falling]
    return list(map(Piece, counts, ratios.tolist()))


def _count(length: float, shorter: float, longer: float) -> int:
    """How many cells fill a length, if they grow from one to the other."""
    if longer >= length:
        return 1
    ratio = (length - shorter) / (length - longer)
    if ratio - 1 < STEADY:
        count = length / shorter
    else:
        count = 1 + log(longer / shorter) / log(ratio)
    return max(whole_up(count), 1)


def growing(length: float, first: float, growth: float) -> Piece:
    """Cells that begin with one and grow until they fill a length.

    Parameters
    ----------
    length
        The length.
    first
        Length of the first cell, in the same unit.
    growth
        Ratio of neighbouring cells, at most.

    Returns
    -------
    Piece
        The cells.
    """
    cells = cells_in(length, first, growth)
    return Piece(cells, max(float(ratio_of(cells, first, length)), 1.0))


def cells_in(length: float, first: float, growth: float) -> int:
    """Count the cells that fill a length if they begin with one and grow.

    Parameters
    ----------
    length
        The length.
    first
        Length of the first cell, in the same unit.
    growth
        Ratio of neighbouring cells, at most.

    Returns
    -------
    int
        How many there are.

    Examples
    --------
    >>> cells_in(7.0, 1.0, 2.0), cells_in(6.0, 1.0, 2.0)
    (3, 3)
    """
    return max(whole_up(log(1 + length * (growth - 1) / first) / log(growth)), 1)


def made_by_gmsh(directory: Path) -> "meshio.Mesh":
    """The mesh of a case, which gmsh makes of `mesh.geo` and what it includes.

    Any thread may call; one at a time makes its mesh.

    Parameters
    ----------
    directory
        The case.

    Returns
    -------
    meshio.Mesh
        Hexahedra, and quadrangles on the sides; its cell sets are the faces of each
        patch.

    Raises
    ------
    SolverError
        If gmsh fails, cells are inverted or no hexahedra, or one of `GROUPS` is
        missing.
    """
    try:
        import gmsh
    except OSError as error:
        packages = "libglu1-mesa libxft2 libxcursor1 libxinerama1"
        remedy = f"install the Debian packages {packages}"
        raise SolverError(f"gmsh does not load: {error}", remedy=remedy) from error
    with _GMSH:
        # The default installs a signal handler, which only the main thread may.
        gmsh.initialize(ARGUMENTS, readConfigFiles=False, interruptible=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.open(str(directory / "mesh.geo"))
            gmsh.model.mesh.generate(3)
            return _checked(gmsh.model)
        except Exception as error:  # gmsh raises nothing narrower
            remedy = "check the slope, the height and the first cell in parameters.geo"
            where = str(directory / "mesh.geo")
            raise SolverError(f"no usable mesh: {error}", where, remedy) from error
        finally:
            gmsh.finalize()


def _checked(model: Any) -> "meshio.Mesh":
    """The mesh that gmsh holds; ValueError if it is not one that a case can use."""
    import meshio

    names = {model.getPhysicalName(*group) for group in model.getPhysicalGroups()}
    missing = GROUPS - names
    if missing:
        raise ValueError(f"without the physical groups {sorted(missing)}")
    if list(model.mesh.getElementTypes(3)) != [_HEXAHEDRON]:
        raise ValueError("not of hexahedra only")
    tags, cells = model.mesh.getElementsByType(_HEXAHEDRON)
    if (model.mesh.getElementQualities(tags, "minSICN") <= 0).any():
        raise ValueError("with inverted cells")
    nodes, points, _ = model.mesh.getNodes()
    number = np.empty(int(nodes.max()) + 1, np.int64)
    number[nodes] = np.arange(len(nodes))
    patches = {}
    for group in model.getPhysicalGroups(2):
        patches[model.getPhysicalName(*group)] = number[_quadrangles(model, group)]
    sets = {}
    start = 0
    for name, corners in patches.items():
        end = start + len(corners)
        sets[name] = [None, np.arange(start, end)]
        start = end
    sides = np.concatenate([*patches.values()])
    blocks = [("hexahedron", number[cells].reshape(-1, 8)), ("quad", sides)]
    return meshio.Mesh(points.reshape(-1, 3), blocks, cell_sets=sets)


def _quadrangles(model: Any, group: tuple[int, int]) -> IntArray:
    """Nodes of the quadrangles of a physical group, as gmsh numbers them."""
    faces = model.getEntitiesForPhysicalGroup(*group)
    quads = [model.mesh.getElementsByType(_QUADRANGLE, face)[1] for face in faces]
    return np.concatenate(quads).reshape(-1, 4)
