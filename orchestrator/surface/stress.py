"""The stress that the flow puts on a surface, on the faces of its mesh."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from orchestrator.flow.stress import Stress
from orchestrator.surface.mesh import Columns
from orchestrator.types import FloatArray


@dataclass(frozen=True, eq=False)
class SurfaceStress(Stress):
    """Stress on each face of a bed, ordered along the wind, then across it.

    Stresses are kinematic and in units of u*_0^2, the stress of the undisturbed flow.

    Attributes
    ----------
    x_m, y_m
        Middle of each face in the axes of the file, m, shape (F,).
    z_m
        Its height above the flat ground, m, shape (F,).
    along_m, across_m
        The same place in the axes of the wind, from the middle of the form downstream
        and to the left, m, shape (F,).
    area_m2
        Area of the face, m2, shape (F,).
    z_e_m
        Distance of the first cell's centre from the face along its normal, m,
        shape (F,).
    normal
        Unit vector upwards, normal to the face, in the axes of the file, shape (F, 3).
    tau
        Stress of the flow on the face, along the face, in the axes of the file,
        shape (F, 3).
    tau_along, tau_across
        Its components along and across the wind, shape (F,).
    """

    shown: ClassVar[tuple[str, ...]] = ("ustar_over_ustar0",)
    x_m: FloatArray
    y_m: FloatArray
    z_m: FloatArray
    along_m: FloatArray
    across_m: FloatArray
    area_m2: FloatArray
    z_e_m: FloatArray
    normal: FloatArray
    tau: FloatArray
    tau_along: FloatArray
    tau_across: FloatArray

    @classmethod
    def of_faces(
        cls, mesh: Columns, tau: FloatArray, axes: FloatArray, centre: FloatArray
    ) -> "SurfaceStress":
        """Put the stresses of a mesh's faces in their places.

        Parameters
        ----------
        mesh
            The mesh.
        tau
            Stress on each face of its bed in the axes of the wind, over that of the
            approaching flow: first those on the slab, shape (n, 3).
        axes
            Unit vectors along and across the wind in the axes of the file, (2, 2).
        centre
            Place of the mesh's origin in the axes of the file, m, shape (2,).

        Returns
        -------
        SurfaceStress
            Those behind the inlet.
        """
        middles, normals, areas = faces_of(mesh)
        tau = tau[mesh.shape[1] :]
        first = mesh.middles[1:, :, 0].reshape(-1, 3)
        z_e = ((first - middles) * normals).sum(axis=1)
        x, y = (centre + middles[:, :2] @ axes).T
        along, across, above = middles.T
        return cls(
            x_m=x,
            y_m=y,
            z_m=above,
            along_m=along,
            across_m=across,
            area_m2=areas,
            z_e_m=z_e,
            normal=_turned(normals, axes),
            tau=_turned(tau, axes),
            tau_along=tau[:, 0],
            tau_across=tau[:, 1],
        )

    @property
    def ustar_over_ustar0(self) -> FloatArray:
        """Friction velocity of the stress over that of the approaching flow, (F,)."""
        return np.asarray(np.sqrt(np.linalg.norm(self.tau, axis=1)))


def _turned(vectors: FloatArray, axes: FloatArray) -> FloatArray:
    """Vectors in the axes of the wind as the axes of the file have them, (n, 3)."""
    return np.column_stack([vectors[:, :2] @ axes, vectors[:, 2]])


def faces_of(mesh: Columns) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Measure the faces of a bed behind the inlet.

    A face is divided into four triangles about the mean of its corners.

    Parameters
    ----------
    mesh
        The mesh.

    Returns
    -------
    middles
        Centres of the faces in the axes of the mesh, m, shape (F, 3).
    normals
        Unit vectors upwards, shape (F, 3).
    areas
        Sums of the areas of the four triangles, m2, shape (F,).
    """
    bed = mesh.corners[2:, :, 0]
    corners = np.stack([bed[:-1, :-1], bed[1:, :-1], bed[1:, 1:], bed[:-1, 1:]])
    corners = corners.reshape(4, -1, 3)
    mean = corners.mean(axis=0)
    following = np.roll(corners, -1, axis=0)
    triangles = np.cross(following - corners, mean - corners) / 2
    sizes = np.linalg.norm(triangles, axis=2)
    areas = sizes.sum(axis=0)
    thirds = (corners + following + mean) / 3
    middles = (thirds * sizes[..., None]).sum(axis=0) / areas[:, None]
    vectors = triangles.sum(axis=0)
    normals = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    return middles, normals, areas
