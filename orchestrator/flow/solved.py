"""The results of a solved flow, which are read once, and the stress that they put on the bed."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from orchestrator.errors import SolverError
from orchestrator.flow.stress import Array, WallStress, undisturbed_ustar
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.solvers.openfoam import read_last_time, read_numbers

if TYPE_CHECKING:
    import pyvista


@dataclass(frozen=True)
class SolvedFlow:
    """The last iteration of an OpenFOAM case.

    The approaching flow develops in the column before the inlet, on the rows of the mesh. The
    numbers have seven digits, which is what VTK hands on.

    Attributes
    ----------
    directory : Path
        A case that `Allrun` has run in; its `parameters` give U_e and z0.

    Raises
    ------
    SolverError
        By each property, if the case holds no results.
    """

    directory: Path

    @cached_property
    def _read(self) -> "tuple[pyvista.PolyData, pyvista.UnstructuredGrid]":
        return read_last_time(self.directory, "bed", ["U", "wallShearStress"])

    @cached_property
    def _numbers(self) -> dict[str, float]:
        return read_numbers(self.directory / "parameters")

    def stress(self) -> WallStress:
        """Stress along the bed; u*_0 is that of the column before the inlet.

        Raises
        ------
        SolverError
            If nothing flows in the column.
        """
        (bed, air), z0 = self._read, self._numbers["roughnessLength"]
        faces = _Faces.of(bed)
        z_e, u_t = _first_cells(air, faces)
        stress = np.asarray(bed.cell_data["wallShearStress"], dtype=np.float64)[faces.order]
        # OpenFOAM's is the stress of the bed on the flow
        tau = -_along(stress, faces.tangents)
        if not tau[0] > 0:
            raise SolverError("no flow in the column before the inlet", where=str(self.directory))
        ustar0, own = float(np.sqrt(tau[0])), slice(1, None)
        printed = log_law_ustar(u_t, z_e, z0, printed=True)
        return WallStress(
            s_m=faces.s_m[own],
            x_m=faces.centres[own, 0],
            z_m=faces.centres[own, 2],
            length_m=faces.lengths[own],
            z_e_m=z_e[own],
            tau_wall=tau[own] / ustar0**2,
            ustar_over_ustar0_eq10=log_law_ustar(u_t, z_e, z0)[own] / ustar0,
            ustar_over_ustar0_eq10_printed=printed[own] / ustar0,
        )

    def approach_ustar(self) -> float:
        """Friction velocity in the column before the inlet over that of the log law.

        It is 1 but for what the rows of the mesh do to the log law.
        """
        (bed, _), numbers = self._read, self._numbers
        first = int(np.argmin(bed.cell_centers().points[:, 0]))
        tau = -float(bed.cell_data["wallShearStress"][first, 0])
        heights = numbers["speedHeight"], numbers["roughnessLength"]
        return float(np.sqrt(max(tau, 0.0))) / undisturbed_ustar(numbers["freeStream"], *heights)

    def column_speed(self) -> float:
        """Mean speed in the column before the inlet, m/s."""
        _, air = self._read
        corners = np.asarray(air.points, dtype=np.float64)[air.cell_connectivity.reshape(-1, 8)]
        x = corners[:, :, 0].mean(axis=1)
        column = x < x.min() + 1e-6 * np.ptp(x)
        height = np.ptp(corners[column, :, 2], axis=1)
        speed = np.asarray(air.cell_data["U"], dtype=np.float64)[column, 0]
        return float(np.average(speed, weights=height))


@dataclass(frozen=True)
class _Faces:
    """Geometry of the faces of the bed, ordered downstream; vectors of shape (F, 3)."""

    order: NDArray[np.intp]
    centres: Array
    tangents: Array
    lengths: Array
    s_m: Array

    @classmethod
    def of(cls, bed: "pyvista.PolyData") -> "_Faces":
        corners = np.asarray(bed.points, dtype=np.float64)[bed.regular_faces]
        order = np.argsort(corners[:, :, 0].mean(axis=1))
        corners = np.take_along_axis(
            corners[order], np.argsort(corners[order, :, 0], axis=1)[:, :, None], axis=1
        )
        starts, ends = corners[:, :2].mean(axis=1), corners[:, 2:].mean(axis=1)
        lengths = np.linalg.norm(ends - starts, axis=1)
        toe = int(np.argmin(np.abs(starts[:, 0])))
        s_end = np.cumsum(lengths) - lengths[:toe].sum()
        return cls(
            order=order,
            centres=(starts + ends) / 2.0,
            tangents=(ends - starts) / lengths[:, None],
            lengths=lengths,
            s_m=s_end - lengths / 2.0,
        )

    @property
    def normals(self) -> Array:
        """Unit normals into the flow."""
        tangents = self.tangents
        return np.stack([-tangents[:, 2], np.zeros(len(tangents)), tangents[:, 0]], axis=1)


def _first_cells(air: "pyvista.UnstructuredGrid", faces: _Faces) -> tuple[Array, Array]:
    """Distance from the bed, and speed along it, of the centre of the cell on each face."""
    just_above = faces.centres + 1e-2 * faces.lengths.min() * faces.normals
    found = np.atleast_1d(air.find_containing_cell(just_above))
    if (found < 0).any():
        raise SolverError("a face of the bed has no cell above it", remedy="mesh the case again")
    hexahedra = air.cell_connectivity.reshape(-1, 8)
    corners = np.asarray(air.points, dtype=np.float64)[hexahedra[found]]
    heights = _along(corners.mean(axis=1) - faces.centres, faces.normals)
    speeds = _along(np.asarray(air.cell_data["U"], dtype=np.float64)[found], faces.tangents)
    return heights, speeds


def _along(vectors: Array, directions: Array) -> Array:
    return np.asarray(np.einsum("fi,fi->f", vectors, directions))
