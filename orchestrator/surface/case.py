"""The flow over a surface from one direction as an OpenFOAM case."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator.bed.deck import read_texts
from orchestrator.digits import rounded
from orchestrator.errors import SolverError, Stalled
from orchestrator.flow.foam import BED_FLOW, SolvedFlow, set_roughness
from orchestrator.flow.run import Approach, OpenFoamCase
from orchestrator.flow.stress import Diagnostic
from orchestrator.surface import mesh
from orchestrator.surface.ground import RoughnessMap
from orchestrator.surface.heights import Surface
from orchestrator.surface.mesh import COARSE, Columns, Level, Sizes
from orchestrator.surface.stress import SurfaceStress
from orchestrator.types import FloatArray

RESIDUAL = 1e-4
"""Residual of p at which the mean stress on a hill is within 0.1 % of where it ends."""
RESIDUAL_OF_K = 3e-3
"""Residual of k that ends the iterations with it."""
MOST_ITERATIONS = 400
"""Iterations at which a flow is taken for one that cycles; others need 100 to 280."""
ITERATIONS = 120
"""Iterations that a flow takes."""
SPEED = 3.5e5
"""Cells times iterations that a core does in a second."""
DIRECTIONS_DEG = np.arange(0.0, 180.0, 15.0)
"""Directions of which the one with the largest mesh decides how long the cells are."""


def form_places(surface: Surface) -> FloatArray:
    """Find the nodes of a surface that are a part of the form.

    Returns
    -------
    FloatArray
        Their places from its centre, m, shape (n, 2).
    """
    rows, columns = np.nonzero(surface.is_form)
    places = np.column_stack([surface.x[columns], surface.y[rows]])
    return np.asarray(places - np.array(surface.centre))


def mesh_sizes(places: FloatArray, from_deg: float) -> Sizes:
    """Find the ends of a form along and across a wind.

    Parameters
    ----------
    places
        Places of the form, m, shape (n, 2).
    from_deg
        Where the wind comes from, degrees.

    Returns
    -------
    Sizes
        The ends, m.
    """
    along, across = mesh.wind_axes(from_deg) @ places.T
    ends = (along.min(), along.max(), across.min(), across.max())
    return Sizes(*(rounded(float(end)) for end in ends))


def cell_length(surface: Surface, level: Level) -> float:
    """Find how long the cells over a form are, whatever the direction of the wind.

    Parameters
    ----------
    surface
        The surface as it was read.
    level
        How fine the mesh is.

    Returns
    -------
    float
        The length, m: as the level has it, or longer where the mesh would have more
        cells than the level allows.
    """
    places = form_places(surface)
    step_x, step_y = surface.steps
    radius = np.sqrt(len(places) * step_x * step_y / np.pi)
    height = surface.relief
    length = min(float(radius) / level.per_radius, height / level.per_height)
    forms = [mesh_sizes(places, float(angle)) for angle in DIRECTIONS_DEG]
    up = mesh.rows(height, mesh.FIRST_CELL * height, level)
    while max(_cells(form, height, length, level) for form in forms) * up > (
        level.most_cells
    ):
        length *= 1.02
    return rounded(length)


def _cells(form: Sizes, height: float, cell: float, level: Level) -> int:
    """Columns of cells of the mesh over a form."""
    x, y = mesh.grid_lines(form, height, cell, level)
    return len(x) * (len(y) - 1)


@dataclass(frozen=True)
class SurfaceFlowCase(OpenFoamCase[SurfaceStress]):
    """Steady turbulent flow of a boundary layer over a surface from one direction.

    The flow's u*/u*_0 depends on the shape, on the direction, on z0/h and on the mesh,
    and hardly on the speed and the viscosity.

    Attributes
    ----------
    surface
        The surface as it was read.
    from_deg
        Where the wind comes from, degrees from north (+y) towards east (+x).
    speed_m_s
        Speed at ten heights of the form above the flat ground, U_e, m/s.
    roughness_m
        Roughness length z0 of the bed, m.
    viscosity_m2_s
        Kinematic viscosity, m2/s.
    level
        How fine the mesh is.
    turbulence_model
        OpenFOAM's turbulence model.
    convection_scheme
        OpenFOAM's scheme for the convection of U.
    first_cell_m
        Height of the cells on the bed, normal to it, m; by default h/40.
    roughness_map
        Roughness lengths of the ground by place; None where all of it has z0.
    """

    surface: Surface
    from_deg: float
    speed_m_s: float
    roughness_m: float
    viscosity_m2_s: float
    level: Level = COARSE
    turbulence_model: str = "kEpsilon"
    convection_scheme: str = "linearUpwind"
    first_cell_m: float | None = None
    roughness_map: RoughnessMap | None = None

    kind: ClassVar[str] = "surface"
    mesher: ClassVar[str] = "numpy"
    of_template: ClassVar[tuple[str, ...]] = (*OpenFoamCase.of_template, "*.geo")

    @property
    def parameters(self) -> dict[str, Any]:
        """All that the flow depends on."""
        # a flow without a map is called as before there were maps
        ground = self.roughness_map
        of_map = {"roughness_map": ground.digest} if ground else {}
        return {
            **of_map,
            "surface": self.surface.digest,
            "height": rounded(self.height_m),
            "from_deg": float(self.from_deg),
            "speed": float(self.speed_m_s),
            "roughness": float(self.roughness_m),
            "viscosity": float(self.viscosity_m2_s),
            "level": vars(self.level),
            "turbulence_model": self.turbulence_model,
            "convection_scheme": self.convection_scheme,
            "first_cell": self.first_cell,
        }

    @property
    def height_m(self) -> float:
        """Height h of the form above the flat ground, m."""
        return self.surface.relief

    @property
    def first_cell(self) -> float:
        """Height of the cells on the bed, normal to it, m; z_e is half of it."""
        return rounded(self.first_cell_m or mesh.FIRST_CELL * self.height_m)

    @property
    def approach(self) -> Approach:
        """The approaching flow."""
        return Approach(
            self.speed_m_s, self.height_m, self.roughness_m, self.viscosity_m2_s
        )

    @property
    def iterations(self) -> float:
        """Expected number of iterations, whatever the surface."""
        return ITERATIONS

    @property
    def axes(self) -> FloatArray:
        """Unit vectors along and across the wind in the axes of the file, (2, 2)."""
        return mesh.wind_axes(self.from_deg)

    @cached_property
    def cell_m(self) -> float:
        """Length of the cells over the form, m."""
        return cell_length(self.surface, self.level)

    @property
    def mesh(self) -> Columns:
        """The mesh over the smoothed surface, in the axes of the wind."""
        return _mesh_of(self)

    def heights(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Find heights of the smoothed surface.

        Parameters
        ----------
        x, y
            Places in the axes of the wind, m, of one shape.

        Returns
        -------
        FloatArray
            Heights above the flat ground, m.
        """
        turned = np.stack([x, y], axis=-1) @ self.axes
        east, north = np.moveaxis(turned + np.array(self.surface.centre), -1, 0)
        return self.surface.smoothed(self.cell_m).at(east, north)

    @property
    def ranks(self) -> int:
        """Processes that share the mesh."""
        return self.level.ranks

    @property
    def cost_s(self) -> float:
        """Time of one core, s; cells by what a mesh of the level has at most."""
        return self.level.most_cells * ITERATIONS / SPEED

    def write(self, directory: Path, cases: Path) -> None:
        """Write parameters, the mesh and a flow to start from."""
        values = {
            "sides": "slip",
            "lidHeight": self.mesh.lid,
            "approachOffset": -self.mesh.slab,
            "firstCentre": self.first_cell / 2,
            "turbulence": self.turbulence_model,
            "convection": self.convection_scheme,
            "residual": f"{RESIDUAL:.3g}",
            "residualOfK": f"{RESIDUAL_OF_K:.3g}",
            "iterations": MOST_ITERATIONS,
            "ranks": self.ranks,
        }
        self.write_parameters(directory, values)
        self.mesh.write(directory)
        self.approach.start(directory / "0", self.mesh.over_bed.ravel())
        if self.roughness_map:
            set_roughness(directory / "0" / "nut", self._lengths_at_wall())

    def ground_roughness(self) -> FloatArray:
        """Find the roughness length of each face of the bed, m.

        Returns
        -------
        FloatArray
            The lengths, of the shape of the mesh's columns; those of the slab ahead of
            the inlet are of the approaching flow.
        """
        along, across, _ = self.mesh.shape
        if self.roughness_map is None:
            return np.full((along, across), self.roughness_m)
        turned = self.mesh.middles[:, :, 0, :2] @ self.axes
        east, north = np.moveaxis(turned + np.array(self.surface.centre), -1, 0)
        found = self.roughness_map.at(east, north, self.roughness_m)
        found[0] = self.roughness_m
        return found

    def _lengths_at_wall(self) -> FloatArray:
        """What the wall function takes for the roughness lengths, as its template says.

        Its kappa is one for all faces, that of the approaching flow; with it the
        friction velocity of the log law is that of each length.
        """
        centre = self.first_cell / 2
        over = (centre + self.roughness_m) / centre
        lengths = self.ground_roughness().ravel()
        return np.asarray(centre / ((1 + centre / lengths) ** over - 1))

    def collect(self, directory: Path) -> None:
        """Check the run and write its tables, or say why it failed."""
        try:
            super().collect(directory)
        except Stalled as error:
            remedy = "raise bed.smoothing_cells, which smooths the surface"
            what = f"{error.what}: the flow cycles"
            raise Stalled(what, error.where, remedy) from None

    def own_diagnostics(
        self, stress: SurfaceStress, ustar0: float, directory: Path
    ) -> dict[str, Diagnostic]:
        """Collect the heights of the first cells, the reversed flow and the mesh."""
        over = stress.z_e_m / (self.first_cell / 2)
        reversed_area = stress.area_m2[stress.tau_along < 0].sum()
        return {
            "least_z_e_over_nominal": Diagnostic(float(over.min()), sound_from=0.7),
            "most_z_e_over_nominal": Diagnostic(float(over.max()), sound_to=1.5),
            "reversed_area_m2": Diagnostic(float(reversed_area)),
            "cells": Diagnostic(self.mesh.cells),
            "shortest_cell_m": Diagnostic(float(np.diff(self.mesh.x).min())),
        }

    def velocity(self, directory: Path) -> FloatArray:
        """Read the velocity in the cells, in the axes of the wind.

        Parameters
        ----------
        directory
            Directory of the case, with its bulky files.

        Returns
        -------
        FloatArray
            The velocity, m/s, of the shape of the mesh's `middles`.

        Raises
        ------
        SolverError
            If it is missing or not whole.
        """
        values = SolvedFlow(directory).field("U")
        return values.reshape(*self.mesh.shape, 3)

    def stress(self, directory: Path) -> tuple[SurfaceStress, float]:
        """Read the stress on the bed, as every flow's."""
        columns = read_texts(directory / BED_FLOW)
        ustar0 = float(columns["ustar0_m_s"][0])
        parts = [columns[f"tau_{axis}"].astype(float) for axis in ("x", "y", "z")]
        tau = np.column_stack(parts)
        along, across, _ = self.mesh.shape
        if len(tau) != along * across:
            what = f"{BED_FLOW} has {len(tau)} faces, not those of this mesh"
            raise SolverError(what, str(directory), "run the case again")
        centre = np.array(self.surface.centre)
        return SurfaceStress.of_faces(self.mesh, tau, self.axes, centre), ustar0


# the meshes of many directions would take 50 MB each
@lru_cache(maxsize=2)
def _mesh_of(one: SurfaceFlowCase) -> Columns:
    """The mesh of a case."""
    form = mesh_sizes(form_places(one.surface), one.from_deg)
    x, y = mesh.grid_lines(form, one.height_m, one.cell_m, one.level)
    return Columns.over(
        one.heights,
        x,
        y,
        height=one.height_m,
        first_cell=one.first_cell,
        count=mesh.rows(one.height_m, one.first_cell, one.level),
    )
