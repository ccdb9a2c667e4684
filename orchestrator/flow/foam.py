"""Mesh and fields as files of OpenFOAM: written before a run, read after it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed.deck import read_texts
from orchestrator.bed.line import BedLine
from orchestrator.digits import DIGITS, FORMAT, on_grid
from orchestrator.errors import SolverError
from orchestrator.flow.stress import WallStress
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.types import FloatArray, IntArray

BED_FLOW, COLUMN_FLOW = "bed_flow.csv", "column_flow.csv"
"""What is read of a solved flow, as the template's ``wallShearStress.awk`` describes it."""
READ_ERROR = 1e-5
"""Most that these tables may be off the fields, of the largest value: they have six digits."""
SIDES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
"""Corners of the sides of a hexahedron, seen from outside against the clock."""
VECTOR = f"({FORMAT} {FORMAT} {FORMAT})"
INTERPOLATED_DIGITS = 6
"""Digits of a field that is interpolated from another flow: fewer than those which the
fields of two processors share."""
_HEAD = "FoamFile\n{{\n    version 2.0;\n    format ascii;\n    class {};\n    object {};\n}}\n\n"
_END = "// ***"
_WITHOUT_BRACKETS = str.maketrans("()", "  ")


def listed(values: FloatArray | IntArray, item: str) -> str:
    """A list with an item of a format such as ``"4(%d %d %d %d)"`` for each value or row."""
    text = f"{item}\n" * len(values) % tuple(values.ravel().tolist())
    return f"{len(values)}\n(\n{text})\n"


def read_list(path: Path, after: str = "", kind: type = float) -> NDArray[Any]:
    """The first list of a file, or the first behind some text, shape (n, numbers of an item).

    Whole numbers, of the kind int, are read seven times as fast as others. Raises a SolverError if
    the file is missing or not whole.
    """
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    start = text.find("\n(\n", max(text.find(after), 0)) if after in text else -1
    if start < 0 or _END not in text[-100:]:
        what = f"the results are not whole: {path.name}"
        raise SolverError(
            what, where=str(path), remedy="is the disk full? Run the case again"
        )
    count = int(text[:start].rsplit(maxsplit=1)[-1])
    numbers = text[start + 3 : text.find("\n)", start)].translate(_WITHOUT_BRACKETS)
    return np.fromstring(numbers, kind, sep=" ").reshape(count, -1)


def write_poly_mesh(mesh: Any, directory: Path, types: Mapping[str, str]) -> FloatArray:
    """Write the ``constant/polyMesh`` of a case from a `meshio.Mesh` of hexahedra one cell thick.

    Its cell sets become the patches, of the given types with their entries, else "patch"; ``bed``
    has one face for each column of cells. Returned are the middles of the cells in their order, m:
    downstream, in a column upwards; shape (columns, cells of a column, 3).
    """
    points, cells, quads = (
        mesh.points,
        mesh.cells_dict["hexahedron"],
        mesh.cells_dict["quad"],
    )
    patches = {name: quads[rows["quad"]] for name, rows in mesh.cell_sets_dict.items()}
    middles = points[cells].mean(axis=1)
    columns = np.argsort(middles[:, 0]).reshape(len(patches["bed"]), -1)
    columns = np.take_along_axis(
        columns, np.argsort(middles[columns, 2], axis=1), axis=1
    )
    faces = cells[columns.ravel()][:, SIDES].reshape(-1, 4)
    owner = np.repeat(np.arange(len(cells)), len(SIDES))

    def key(corners: IntArray) -> IntArray:
        """A number for the lowest three corners, which no other side has."""
        a, b, c, _ = np.sort(corners, axis=1).T
        return np.asarray((a * len(points) + b) * len(points) + c)

    keys = key(faces)
    order = np.argsort(keys, kind="stable")
    twins = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    inner, outer = order[twins], order[twins + 1]
    inside = np.lexsort(
        (owner[outer], owner[inner])
    )  # as OpenFOAM orders the faces of cells
    chosen, neighbour = [inner[inside]], owner[outer[inside]]
    sizes = {}
    for name, quads in patches.items():
        chosen.append(np.sort(order[np.searchsorted(keys[order], key(quads))]))
        sizes[name] = len(quads)
    at = np.concatenate(chosen)
    write_faces(directory, points, faces[at], owner[at], neighbour, sizes, types)
    return np.asarray(middles[columns])


def write_faces(
    directory: Path,
    points: FloatArray,
    faces: IntArray,
    owner: IntArray,
    neighbour: IntArray,
    patches: Mapping[str, int],
    types: Mapping[str, str],
) -> None:
    """Write the ``constant/polyMesh`` of a case, which has none yet.

    Parameters
    ----------
    directory
        Directory of the case.
    points
        Corners of the cells, m, shape (n, 3).
    faces
        The four points of each side of a cell, seen against the clock from where its
        owner is not; the inner ones first, in OpenFOAM's order, then those of each
        patch.
    owner
        Cell of each face.
    neighbour
        The other cell of each inner face.
    patches
        Numbers of faces by the names of the patches, in their order.
    types
        Types of patches with their entries; one that is not named is a "patch".
    """
    boundary = []
    start = len(neighbour)
    for name, count in patches.items():
        entries = f"type {types.get(name, 'patch')}; nFaces {count}"
        boundary.append(f"    {name} {{ {entries}; startFace {start}; }}\n")
        start += count
    folder = directory / "constant/polyMesh"
    folder.mkdir(parents=True)
    for name, kind, text in (
        ("points", "vectorField", listed(points, VECTOR)),
        ("faces", "faceList", listed(faces, "4(%d %d %d %d)")),
        ("owner", "labelList", listed(owner, "%d")),
        ("neighbour", "labelList", listed(neighbour, "%d")),
        ("boundary", "polyBoundaryMesh", f"{len(boundary)}\n(\n{''.join(boundary)})\n"),
    ):
        whole = f"{_HEAD.format(kind, name)}{text}\n{_END}\n"
        (folder / name).write_text(whole, encoding="utf-8")


def start_from(path: Path, values: FloatArray, digits: int = DIGITS) -> None:
    """Let a field in ``0/`` start from a value or a vector of each cell, with some digits."""
    if values.ndim > 1 and values.shape[1] > 1:
        # a component that is nothing but round-off has no digits of its own
        values = on_grid(values, digits=digits)
        field = f"nonuniform List<vector>\n{listed(values, VECTOR)};"
    else:
        field = f"nonuniform List<scalar>\n{listed(values, f'%.{digits}g')};"
    text = path.read_text(encoding="utf-8")
    field = f"internalField {field}"
    path.write_text(
        re.sub(r"internalField [^;]+;", lambda _: field, text), encoding="utf-8"
    )


@dataclass(frozen=True)
class SolvedFlow:
    """The last iteration of an OpenFOAM case that `Allrun` has run in.

    The approaching flow develops in the column before the inlet, on the rows of the mesh. Each
    method and property raises a SolverError if there are no results, or a file is not whole.
    """

    directory: Path

    def at(
        self, name: str, x: FloatArray, heights: FloatArray, bed: BedLine
    ) -> FloatArray:
        """A field of a study's case at the middles of the cells of another mesh over the same bed.

        In m, x (columns,) and heights over the bed (columns, cells); a row of the result for each.
        The field is linear along the rows of cells, in a column in the logarithm of the height.
        """
        middles, values = self.mesh[2], self.field(name)
        rows = int(np.argmax(np.diff(middles[:, 0]) > 1e-9 * bed.h)) + 1
        places = middles[::rows, 0]
        above = (middles[:, 2] - bed.height(middles[:, 0])).reshape(-1, rows)
        old = np.dstack([np.log(above), values.reshape(len(places), rows, -1)])
        after = np.clip(np.searchsorted(places, x), 1, len(places) - 1)
        part = ((x - places[after - 1]) / np.diff(places)[after - 1])[:, None, None]
        columns = (1 - part) * old[after - 1] + part * old[after]
        pairs = zip(np.log(heights), columns, strict=True)
        fields = (
            [np.interp(up, old[:, 0], c) for c in old[:, 1:].T] for up, old in pairs
        )
        return np.concatenate([np.column_stack(each) for each in fields])

    @property
    def last_iteration(self) -> Path:
        """The directory with the fields of the last iteration, of those that were written."""
        names = (path.name for path in self.directory.glob("[1-9]*") if path.is_dir())
        iterations = [int(name) for name in names if name.isdecimal()]
        if not iterations:
            raise SolverError("no results", str(self.directory), "run ./Allrun there")
        return self.directory / str(max(iterations))

    def field(self, name: str, patch: str = "") -> FloatArray:
        """Values of a field in the cells, or on the faces of a patch, shape (n, components)."""
        after = f"\n    {patch}\n" if patch else "internalField   nonuniform"
        return read_list(self.last_iteration / name, after)

    @cached_property
    def mesh(self) -> tuple[FloatArray, IntArray, FloatArray]:
        """Corners of the bed's faces (n, 4, 3), the cells on them (n,), middles of all cells, m."""
        folder = self.directory / "constant/polyMesh"
        files = (folder / name for name in ("faces", "owner", "neighbour"))
        faces, owner, neighbour = (read_list(file, kind=int) for file in files)
        # the corners of each face come behind their number
        corners = read_list(folder / "points")[faces[:, 1:]]
        owner, neighbour = owner[:, 0], neighbour[:, 0]
        # the mean of a hexahedron's corners is that of the means of its sides
        middles = np.zeros((owner.max() + 1, 3))
        np.add.at(middles, owner, corners.mean(axis=1) / len(SIDES))
        np.add.at(
            middles, neighbour, corners[: len(neighbour)].mean(axis=1) / len(SIDES)
        )
        boundary = (folder / "boundary").read_text(encoding="utf-8")
        match = re.search(r"\bbed\b[^}]*nFaces\s+(\d+);\s+startFace\s+(\d+);", boundary)
        if match is None:
            raise SolverError(
                "a mesh without a bed", where=str(folder), remedy="mesh it again"
            )
        count, start = map(int, match.groups())
        bed = slice(start, start + count)
        return corners[bed], owner[bed], middles

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
        stress, speed = (table[name].astype(float) for name in ("tau_m2_s2", "u_m_s"))
        return stress, speed

    @cached_property
    def _ends(self) -> tuple[FloatArray, FloatArray]:
        """Upstream and downstream ends of each face of the bed, m, each of shape (n, 3)."""
        corners = self.mesh[0]
        across = np.argsort(corners[..., 0], axis=1)[..., None]
        corners = np.take_along_axis(corners, across, axis=1)
        return corners[:, :2].mean(axis=1), corners[:, 2:].mean(axis=1)

    def check(self) -> None:
        """See that the tables of the flow are those of its mesh and of its fields."""
        starts, ends = self._ends
        tangents = (ends - starts) / np.linalg.norm(ends - starts, axis=1)[:, None]
        fields = -self.wall_shear, self.velocity[self.mesh[1]]
        for field, values in zip(fields, self._on_bed, strict=True):
            expected = (field * tangents).sum(axis=1)
            most = READ_ERROR * np.abs(expected).max()
            if len(values) != len(expected) or not np.all(
                np.abs(values - expected) <= most
            ):
                what = f"{BED_FLOW} is not of these fields"
                raise SolverError(
                    what, where=str(self.directory), remedy="run ./Allrun there"
                )

    @cached_property
    def ustar0(self) -> float:
        """Friction velocity in the column before the inlet, m/s."""
        tau = float(self._on_bed[0][np.argmin(self.mesh[0][..., 0].mean(axis=1))])
        if not tau > 0:
            raise SolverError(
                "no flow in the column before the inlet", where=str(self.directory)
            )
        return float(np.sqrt(tau))

    def stress(self, z0: float) -> WallStress:
        """Stress along the bed, of a roughness length z0 (m), over that of the approaching flow."""
        corners, cells, middles = self.mesh
        # faces in the order of the flow; those of the study begin behind the column before the
        # inlet
        order = np.argsort(corners[..., 0].mean(axis=1))
        starts, ends = (places[order] for places in self._ends)
        centres, lengths = (starts + ends) / 2.0, np.linalg.norm(ends - starts, axis=1)
        tangents = (ends - starts) / lengths[:, None]
        toe = int(np.argmin(np.abs(starts[:, 0])))
        s = np.cumsum(lengths) - lengths[:toe].sum() - lengths / 2.0
        normals = np.column_stack([-tangents[:, 2], np.zeros(len(s)), tangents[:, 0]])
        z_e = ((middles[cells[order]] - centres) * normals).sum(axis=1)
        on_wall, u_t = (values[order] for values in self._on_bed)
        tau = on_wall / self.ustar0**2
        eq10 = [
            log_law_ustar(u_t, z_e, z0, printed=as_printed)
            for as_printed in (False, True)
        ]
        ustar = [velocity / self.ustar0 for velocity in eq10]
        columns = (s, centres[:, 0], centres[:, 2], lengths, z_e, tau, *ustar)
        return WallStress(*(values[1:] for values in columns))

    def column_speed(self) -> float:
        """Mean speed in the column before the inlet, m/s."""
        return float(read_texts(self.directory / COLUMN_FLOW)["mean_velocity_m_s"][0])
