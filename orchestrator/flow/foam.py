"""Mesh and fields as files of OpenFOAM: written before a run, read after it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed.deck import read_texts
from orchestrator.bed.line import BedLine
from orchestrator.digits import DIGITS, FORMAT, on_grid, rounded
from orchestrator.errors import SolverError
from orchestrator.flow.stress import WallStress
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.runs.files import state_of
from orchestrator.types import FloatArray, IntArray

BED_FLOW = "bed_flow.csv"
"""Stress and speed of each face of the bed, by ``wallShearStress.awk``."""
COLUMN_FLOW = "column_flow.csv"
"""Mean speed in the column before the inlet, by the same program."""
READ_ERROR = 1e-5
"""Most that these tables may be off the fields, of the largest value: they have six
digits."""
SIDES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [3, 7, 6, 2], [0, 4, 7, 3]]
)
"""Corners of the sides of a hexahedron, seen from outside against the clock."""
VECTOR = f"({FORMAT} {FORMAT} {FORMAT})"
INTERPOLATED_DIGITS = 6
"""Digits of a field that is interpolated from another flow: fewer than those which the
fields of two processors share."""
_HEAD = (
    "FoamFile\n{{\n    version 2.0;\n    format ascii;\n"
    "    class {};\n    object {};\n}}\n\n"
)
_END = "// ***"
_WITHOUT_BRACKETS = str.maketrans("()", "  ")


def listed(values: FloatArray | IntArray, item: str) -> str:
    """Write a list of OpenFOAM.

    Parameters
    ----------
    values
        A value or a row for each item.
    item
        Format of an item.

    Returns
    -------
    str
        The list.

    Examples
    --------
    >>> import numpy as np
    >>> print(listed(np.array([[1, 2], [3, 4]]), "2(%d %d)"), end="")
    2
    (
    2(1 2)
    2(3 4)
    )
    """
    text = f"{item}\n" * len(values) % tuple(values.ravel().tolist())
    return f"{len(values)}\n(\n{text})\n"


def read_list(
    path: Path, after: str = "", then: str = "", kind: type = float
) -> NDArray[Any]:
    """Read the first list of a file, or the first behind some text.

    Parameters
    ----------
    path
        The file.
    after
        The text.
    then
        A second one behind it, after which the list comes.
    kind
        Type of the numbers; whole numbers are read seven times as fast as others.

    Returns
    -------
    ndarray
        The numbers, shape (n, numbers of an item).

    Raises
    ------
    SolverError
        If the file is missing or not whole.
    """
    text = ""
    if path.is_file():
        text = path.read_text(encoding="utf-8", errors="replace")
    start = -1
    place = text.find(after)
    place = text.find(then, place) if place >= 0 else place
    if place >= 0:
        start = text.find("\n(\n", place)
    if start < 0 or _END not in text[-100:]:
        what = f"the results are not whole: {path.name}"
        remedy = "is the disk full? Run the case again"
        raise SolverError(what, where=str(path), remedy=remedy)
    count = int(text[:start].rsplit(maxsplit=1)[-1])
    end = text.find("\n)", start)
    numbers = text[start + 3 : end].translate(_WITHOUT_BRACKETS)
    return np.fromstring(numbers, kind, sep=" ").reshape(count, -1)


def ordered(mesh: Any) -> tuple[IntArray, FloatArray]:
    """Order the cells of a mesh, one cell thick, for OpenFOAM.

    Parameters
    ----------
    mesh
        A `meshio.Mesh` of hexahedra. Its cell sets are the patches; ``bed`` has one
        face for each column of cells.

    Returns
    -------
    cells
        Corners of the cells, downstream, in a column upwards; shape (cells, 8).
    middles
        Middles of the cells, m; shape (columns, cells of a column, 3).
    """
    cells = mesh.cells_dict["hexahedron"]
    middles = mesh.points[cells].mean(axis=1)
    count = len(mesh.cell_sets_dict["bed"]["quad"])
    columns = np.argsort(middles[:, 0]).reshape(count, -1)
    upwards = np.argsort(middles[columns, 2], axis=1)
    columns = np.take_along_axis(columns, upwards, axis=1)
    return cells[columns.ravel()], middles[columns]


def write_poly_mesh(
    directory: Path,
    points: FloatArray,
    cells: IntArray,
    patches: Mapping[str, IntArray],
    types: Mapping[str, str],
) -> None:
    """Write the ``constant/polyMesh`` of a case, which has none yet.

    Parameters
    ----------
    directory
        The case.
    points
        Corners of the cells, m, shape (n, 3).
    cells
        The eight points of each cell: those of one side, seen from within against the
        clock, then the points of the other side beyond each.
    patches
        The four points of each face of a patch, in any order.
    types
        Type of a patch with its entries; a patch that is left out is a "patch".
    """
    faces = _Faces.of(cells, patches, len(points))
    boundary = []
    start = len(faces.neighbour)
    for name, quads in patches.items():
        entries = f"type {types.get(name, 'patch')}; nFaces {len(quads)}"
        boundary.append(f"    {name} {{ {entries}; startFace {start}; }}\n")
        start += len(quads)
    patch_list = f"{len(boundary)}\n(\n{''.join(boundary)})\n"
    folder = directory / "constant/polyMesh"
    folder.mkdir(parents=True)
    _write(folder / "points", "vectorField", listed(points, VECTOR))
    _write(folder / "faces", "faceList", listed(faces.corners, "4(%d %d %d %d)"))
    _write(folder / "owner", "labelList", listed(faces.owner, "%d"))
    _write(folder / "neighbour", "labelList", listed(faces.neighbour, "%d"))
    _write(folder / "boundary", "polyBoundaryMesh", patch_list)


def write_zones(directory: Path, zones: Mapping[str, IntArray]) -> None:
    """Write zones of cells into the ``constant/polyMesh`` of a case.

    Parameters
    ----------
    directory
        The case.
    zones
        The numbers of the cells of each.
    """
    listing = [
        f"{name} {{ type cellZone; cellLabels List<label> {listed(cells, '%d')}; }}\n"
        for name, cells in zones.items()
    ]
    text = f"{len(listing)}\n(\n{''.join(listing)})\n"
    _write(directory / "constant/polyMesh/cellZones", "regIOobject", text)


def patch_types(offset: float) -> dict[str, str]:
    """Types of the patches of a flow whose approach develops before the inlet.

    Parameters
    ----------
    offset
        From the inlet to the middle of the cells before it, whose flow enters there, m.

    Returns
    -------
    dict of str to str
        The type with its entries of each that is no plain patch.
    """
    sampled = f"offsetMode uniform; offset ({rounded(offset)} 0 0)"
    return {
        "bed": "wall",
        "before": "cyclic; neighbourPatch after",
        "after": "cyclic; neighbourPatch before",
        "inlet": "mappedPatch; sampleMode nearestCell; sampleRegion region0; "
        f"samplePatch none; {sampled}",
    }


class _Faces(NamedTuple):
    """The faces of a mesh in the order of OpenFOAM: those inside, then each patch."""

    corners: IntArray
    owner: IntArray
    neighbour: IntArray

    @classmethod
    def of(
        cls, cells: IntArray, patches: Mapping[str, IntArray], points: int
    ) -> "_Faces":
        """The faces of hexahedra, of which those of the patches are given."""
        corners = cells[:, SIDES].reshape(-1, 4)
        owner = np.repeat(np.arange(len(cells)), len(SIDES))
        keys = _keys(corners, points)
        order = np.argsort(keys, kind="stable")
        sorted_keys = keys[order]
        twins = np.flatnonzero(sorted_keys[1:] == sorted_keys[:-1])
        inner = order[twins]
        outer = order[twins + 1]
        # OpenFOAM orders the faces inside by their cells.
        inside = np.lexsort((owner[outer], owner[inner]))
        chosen = [inner[inside]]
        for quads in patches.values():
            on_patch = order[np.searchsorted(sorted_keys, _keys(quads, points))]
            chosen.append(np.sort(on_patch))
        at = np.concatenate(chosen)
        return cls(corners[at], owner[at], owner[outer[inside]])


def _keys(corners: IntArray, points: int) -> IntArray:
    """A number for the lowest three corners of each face, which no other face has."""
    a, b, c, _ = np.sort(corners, axis=1).T
    return np.asarray((a * points + b) * points + c)


def _write(path: Path, kind: str, text: str) -> None:
    """Write a file of OpenFOAM with its head and its end."""
    whole = f"{_HEAD.format(kind, path.name)}{text}\n{_END}\n"
    path.write_text(whole, encoding="utf-8")


def start_from(path: Path, values: FloatArray, digits: int = DIGITS) -> None:
    """Let a field in ``0/`` start from some values.

    Parameters
    ----------
    path
        The file of the field.
    values
        A value or a vector for each cell.
    digits
        Digits of each value, or of the largest component of all vectors.
    """
    if values.ndim > 1 and values.shape[1] > 1:
        # A component that is nothing but round-off has no digits of its own.
        values = on_grid(values, digits=digits)
        field = f"nonuniform List<vector>\n{listed(values, VECTOR)};"
    else:
        field = f"nonuniform List<scalar>\n{listed(values, f'%.{digits}g')};"
    text = path.read_text(encoding="utf-8")
    entry = f"internalField {field}"
    text = re.sub(r"internalField [^;]+;", lambda _: entry, text)
    path.write_text(text, encoding="utf-8")


def set_roughness(path: Path, lengths: FloatArray, digits: int = DIGITS) -> None:
    """Give each face of the bed a roughness length of its own, in the file ``0/nut``.

    Parameters
    ----------
    path
        The file, in which the patch of the bed has one length.
    lengths
        The lengths that the wall function takes, m, in the order of the faces.
    digits
        Digits of each.
    """
    text = path.read_text(encoding="utf-8")
    start = text.index("\n    bed\n")
    entry = f"z0 nonuniform List<scalar>\n{listed(lengths, f'%.{digits}g')};"
    bed, count = re.subn(
        r"z0 +uniform #eval\{[^}]*\};", lambda _: entry, text[start:], count=1
    )
    assert count == 1, "the template has one length for the bed"
    path.write_text(text[:start] + bed, encoding="utf-8")


class BedMesh(NamedTuple):
    """The mesh of a case.

    Attributes
    ----------
    faces
        Corners of the bed's faces, m; shape (F, 4, 3).
    cells
        The cell on each of them; shape (F,).
    middles
        Middles of all cells, m; shape (N, 3).
    """

    faces: FloatArray
    cells: IntArray
    middles: FloatArray


@dataclass(frozen=True)
class SolvedFlow:
    """The last iteration of an OpenFOAM case that `Allrun` has run in.

    The approaching flow develops in the column before the inlet, on the rows of the
    mesh.

    Attributes
    ----------
    directory
        The case. Each method and property raises a SolverError if there are no results,
        or a file is not whole.
    """

    directory: Path

    def at(
        self, name: str, x: FloatArray, heights: FloatArray, bed: BedLine
    ) -> FloatArray:
        """A field at the middles of the cells of another mesh over the same bed.

        The field is linear along the rows of cells, and in a column linear in the
        logarithm of the height.

        Parameters
        ----------
        name
            Name of the field.
        x
            Places of the columns of the other mesh, m; shape (C,).
        heights
            Heights of its cells over the bed, m; shape (C, cells of a column).
        bed
            The bed line, m.

        Returns
        -------
        FloatArray
            A row for each cell; shape (cells, components).
        """
        middles = self.mesh.middles
        rows = self._rows(bed)
        places = middles[::rows, 0]
        above = (middles[:, 2] - bed.height(middles[:, 0])).reshape(-1, rows)
        values = self.velocity if name == "U" else self.field(name)
        values = values.reshape(len(places), rows, -1)
        old = np.dstack([np.log(above), values])
        after = np.clip(np.searchsorted(places, x), 1, len(places) - 1)
        part = (x - places[after - 1]) / np.diff(places)[after - 1]
        part = part[:, None, None]
        columns = (1 - part) * old[after - 1] + part * old[after]
        fields = []
        for up, column in zip(np.log(heights), columns, strict=True):
            components = [np.interp(up, column[:, 0], c) for c in column[:, 1:].T]
            fields.append(np.column_stack(components))
        return np.concatenate(fields)

    def _rows(self, bed: BedLine) -> int:
        """Number of cells of a column."""
        return int(np.argmax(np.diff(self.mesh.middles[:, 0]) > 1e-9 * bed.h)) + 1

    def column(self, bed: BedLine) -> FloatArray:
        """Find the middles of the cells of the column before the inlet, upwards.

        Parameters
        ----------
        bed
            The bed line, m.

        Returns
        -------
        FloatArray
            The middles, m; shape (cells of a column, 3).
        """
        return self.mesh.middles[: self._rows(bed)]

    @property
    def last_iteration(self) -> Path:
        """The directory with the fields of the last iteration that was written."""
        names = [path.name for path in self.directory.glob("[1-9]*") if path.is_dir()]
        iterations = [int(name) for name in names if name.isdecimal()]
        if not iterations:
            raise SolverError("no results", str(self.directory), "run ./Allrun there")
        return self.directory / str(max(iterations))

    def field(self, name: str, patch: str = "") -> FloatArray:
        """Values of a field in the cells, or on the faces of a patch.

        Parameters
        ----------
        name
            Name of the field.
        patch
            Name of the patch.

        Returns
        -------
        FloatArray
            The values, shape (n, components).
        """
        path = self.last_iteration / name
        if not patch:
            return read_list(path, "internalField   nonuniform")
        # a rough wall has a list of lengths before that of its values
        return read_list(path, f"\n    {patch}\n", "\n        value ")

    @cached_property
    def mesh(self) -> BedMesh:
        """The mesh."""
        folder = self.directory / "constant/polyMesh"
        faces = read_list(folder / "faces", kind=int)
        owner = read_list(folder / "owner", kind=int)[:, 0]
        neighbour = read_list(folder / "neighbour", kind=int)[:, 0]
        # The corners of each face come behind their number.
        corners = read_list(folder / "points")[faces[:, 1:]]
        # The mean of a hexahedron's corners is that of the means of its sides.
        parts = corners.mean(axis=1) / len(SIDES)
        middles = np.zeros((owner.max() + 1, 3))
        np.add.at(middles, owner, parts)
        np.add.at(middles, neighbour, parts[: len(neighbour)])
        boundary = (folder / "boundary").read_text(encoding="utf-8")
        match = re.search(r"\bbed\b[^}]*nFaces\s+(\d+);\s+startFace\s+(\d+);", boundary)
        if match is None:
            what = "a mesh without a bed"
            raise SolverError(what, where=str(folder), remedy="mesh it again")
        start = int(match[2])
        bed = slice(start, start + int(match[1]))
        return BedMesh(corners[bed], owner[bed], middles)

    @cached_property
    def velocity(self) -> FloatArray:
        """The velocity in each cell, m/s, shape (n, 3)."""
        return self.field("U")

    @cached_property
    def wall_shear(self) -> FloatArray:
        """Kinematic stress of each face of the bed on the flow, m2/s2, shape (n, 3)."""
        return self.field("wallShearStress", "bed")

    @cached_property
    def _on_bed(self) -> tuple[FloatArray, FloatArray]:
        """Of each face of the bed the stress, m2/s2, and the velocity over it, m/s.

        Both are along the face and positive downstream.
        """
        table = read_texts(self.directory / BED_FLOW)
        return table["tau_m2_s2"].astype(float), table["u_m_s"].astype(float)

    @cached_property
    def _ends(self) -> tuple[FloatArray, FloatArray]:
        """Upstream and downstream ends of each face of the bed, m; shape (F, 3)."""
        corners = self.mesh.faces
        downstream = np.argsort(corners[..., 0], axis=1)[..., None]
        corners = np.take_along_axis(corners, downstream, axis=1)
        return corners[:, :2].mean(axis=1), corners[:, 2:].mean(axis=1)

    def check(self) -> None:
        """See that the tables of the flow are those of its mesh and of its fields.

        Raises
        ------
        SolverError
            If they are not.
        """
        stress, speed = self._on_bed
        are_right = self._fit(-self.wall_shear, stress)
        are_right = are_right and self._fit(self.velocity[self.mesh.cells], speed)
        if not are_right:
            what = f"{BED_FLOW} is not of these fields"
            where = str(self.directory)
            raise SolverError(what, where=where, remedy="run ./Allrun there")

    def _fit(self, field: FloatArray, values: FloatArray) -> bool:
        """Whether some values are the parts of a field along the faces of the bed."""
        starts, ends = self._ends
        lengths = np.linalg.norm(ends - starts, axis=1)
        tangents = (ends - starts) / lengths[:, None]
        expected = (field * tangents).sum(axis=1)
        if len(values) != len(expected):
            return False
        most = READ_ERROR * np.abs(expected).max()
        return bool(np.all(np.abs(values - expected) <= most))

    @cached_property
    def ustar0(self) -> float:
        """Friction velocity in the column before the inlet, m/s."""
        stress, _ = self._on_bed
        first = np.argmin(self.mesh.faces[..., 0].mean(axis=1))
        tau = float(stress[first])
        if not tau > 0:
            what = "no flow in the column before the inlet"
            raise SolverError(what, where=str(self.directory))
        return float(np.sqrt(tau))

    def stress(self, z0: float) -> WallStress:
        """Stress along the bed over that of the approaching flow.

        Parameters
        ----------
        z0
            Roughness length of the bed, m.

        Returns
        -------
        WallStress
            The stress on the faces of the bed behind the column before the inlet.
        """
        order = np.argsort(self.mesh.faces[..., 0].mean(axis=1))
        starts, ends = (places[order] for places in self._ends)
        on_wall, speed = (values[order] for values in self._on_bed)
        middles = self.mesh.middles[self.mesh.cells[order]]
        centres = (starts + ends) / 2.0
        lengths = np.linalg.norm(ends - starts, axis=1)
        tangents = (ends - starts) / lengths[:, None]
        normals = np.column_stack(
            [-tangents[:, 2], np.zeros(len(lengths)), tangents[:, 0]]
        )
        toe = int(np.argmin(np.abs(starts[:, 0])))
        s = np.cumsum(lengths) - lengths[:toe].sum() - lengths / 2.0
        z_e = ((middles - centres) * normals).sum(axis=1)
        eq10 = log_law_ustar(speed, z_e, z0) / self.ustar0
        # The first face is that of the column before the inlet.
        return WallStress(
            s_m=s[1:],
            x_m=centres[1:, 0],
            z_m=centres[1:, 2],
            length_m=lengths[1:],
            z_e_m=z_e[1:],
            tau_wall=(on_wall / self.ustar0**2)[1:],
            ustar_over_ustar0_eq10=eq10[1:],
        )

    def column_speed(self) -> float:
        """Mean speed in the column before the inlet.

        Returns
        -------
        float
            The speed, m/s.
        """
        table = read_texts(self.directory / COLUMN_FLOW)
        return float(table["mean_velocity_m_s"][0])


def flow_in(directory: Path) -> SolvedFlow:
    """Find the flow in the directory of a case, as its files are now.

    Parameters
    ----------
    directory
        The case.

    Returns
    -------
    SolvedFlow
        The flow; its mesh, which takes a fifth of a second, and its velocity are read
        once for all who ask.

    Raises
    ------
    SolverError
        If there are no results.
    """
    mesh = directory / "constant/polyMesh"
    last = SolvedFlow(directory).last_iteration
    read = [directory / BED_FLOW, *(last / name for name in ("U", "wallShearStress"))]
    read += [mesh / name for name in ("points", "faces", "owner")]
    states = tuple(state_of(path) if path.is_file() else () for path in read)
    return _flow_of(directory, states)


@lru_cache(maxsize=16)
def _flow_of(directory: Path, states: tuple[tuple[int, ...], ...]) -> SolvedFlow:
    """The flow in the directory while its files are in these states."""
    del states
    return SolvedFlow(directory)
