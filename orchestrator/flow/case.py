"""The flow over one bed line as an OpenFOAM case, and what its last iteration holds."""

import re
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version as installed
from math import cos, log, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from orchestrator.bed.line import BedLine, triangle
from orchestrator.errors import Exploded, InputError, SolverError
from orchestrator.flow.mesh import NEAR, Grid, along, extended, growth_far, write_mesh
from orchestrator.flow.stress import RANGE, WallStress, diagnostics, judged
from orchestrator.physics.velocity import depth_mean_speed, log_law_ustar
from orchestrator.runs.case import Case
from orchestrator.runs.files import canonical_json, digest_text, write_durably
from orchestrator.solvers import openfoam
from orchestrator.study.parts import Flow
from orchestrator.study.profile import Profile
from orchestrator.types import FloatArray

if TYPE_CHECKING:
    import pyvista

WALL_STRESS = "wall_stress.csv"
DIAGNOSTICS = "diagnostics.csv"
SPEED_HEIGHT = 10.0
"""Height above the flat bed at which U_e is given, h."""
RESIDUAL, CELLS_ALONG = 2e-4, 150
"""Residual of p at which the mean stress on a pile is within 0.1 % of where it ends, and the cells
along the bed up to which it is."""
LEAST_CELL = 0.04
"""Shortest cell along the bed, over the height of the first cells: with cells of a hundredth the
stress upstream was 3 to 12 % off, and up to fourfold with cells of a thousandth."""
MOST_GROWTH = 3.0
"""Largest ratio of neighbouring cells: rows of more do not fit under a crest."""
LEAST_LID = 5.0
"""Lowest lid of a boundary layer, h: under lower ones iterations cycle, and none ends."""
MEAN_SPEED_ERROR = 0.1
"""Largest relative difference of a channel's mean speed, before the inlet, from the log law's."""
MESH = (
    *("boundary", "faces", "neighbour", "owner", "points", "sets/air", "sets/approach"),
    *("cellZones", "faceZones", "pointZones"),
)
"""Files of a mesh that gmshToFoam makes."""
FIELDS = ("U", "epsilon", "k", "nut", "omega", "p", "phi", "wallShearStress")
"""Fields of the last iteration; epsilon or omega, as the turbulence model has it."""
TOPS = {"boundary layer": "layer", "open water": "open", "closed channel": "closed"}
"""Words of the template for the top of the flow."""


@dataclass(frozen=True)
class FlowCase(Case):
    """Steady turbulent flow over a bed line, in a boundary layer or in a channel.

    The flow's u*/u*_0 depends on the shape, on z0/h, on the mesh, and hardly on U_e and nu. The
    slope of a channel drives it: a force on the water that u*_0^2 on each wall balances over a flat
    bed. The speed at 10 h is that of the log law with this u*_0, and need not be within the depth.

    Parameters
    ----------
    height_m : float
        Height h of the forms, m.
    slope_deg : float
        Slope of the windward faces, where they are steepest; 0 if there are none.
    settings : Flow
        Fields of the study file, with the roughness, the viscosity and the first cell given.
    line : BedLine, optional
        The bed line, m; by default a triangle of the slope and the height, or a flat bed.
    profile : Profile, optional
        The measured profile of the line, for a copy of it in the case.
    """

    height_m: float
    slope_deg: float
    settings: Flow
    line: BedLine | None = None
    profile: Profile | None = field(default=None, compare=False)

    kind: ClassVar[str] = "flow"
    template: ClassVar[str] = "openfoam/pile"
    recipe: ClassVar[int] = 7
    results: ClassVar[tuple[str, ...]] = tuple(f"[1-9]*/{field}" for field in FIELDS)
    derived: ClassVar[tuple[str, ...]] = (WALL_STRESS, DIAGNOSTICS)
    bulky: ClassVar[tuple[str, ...]] = (
        *results,
        *(f"[1-9]*/uniform/{name}" for name in ("time", "cumulativeContErr")),
        "[1-9]*/uniform/functionObjects/functionObjectProperties",
        *(f"constant/polyMesh/{name}" for name in MESH),
        "postProcessing/wallShearStress/*/wallShearStress.dat",
    )
    made: ClassVar[tuple[str, ...]] = (
        # the run itself writes the approaching flow into them
        *(f"0/{field}" for field in ("U", "epsilon", "k", "nut", "omega", "p")),
        "log.gmshToFoam",
        "log.setExprFields",
        "log.simpleFoam",
        "constant/polyMesh/sed??????",  # a killed sed's
    )

    @property
    def parameters(self) -> dict[str, Any]:
        """The settings, the height and the slope, and a digest of the bed line."""
        return {
            **self.settings.model_dump(mode="json"),
            "height": float(self.height_m),
            "slope_deg": float(self.slope_deg),
            "bed_line": digest_text(canonical_json(self.bed_line.corners.tolist())),
        }

    @property
    def roughness_m(self) -> float:
        """Roughness length z0 of the bed, m."""
        assert self.settings.roughness
        return self.settings.roughness

    @property
    def viscosity_m2_s(self) -> float:
        """Kinematic viscosity of the solve, m2/s."""
        assert self.settings.viscosity
        return self.settings.viscosity

    @property
    def first_cell_m(self) -> float:
        """Height of the cells on the bed, normal to the windward faces, m; z_e is half of it."""
        assert self.settings.first_cell_height
        return self.settings.first_cell_height

    @property
    def lid(self) -> float:
        """Height of the lid, or depth of a channel, over the flat bed, h."""
        depth = self.settings.depth
        return depth / self.height_m if depth else self.settings.lid

    @property
    def ustar0_m_s(self) -> float:
        """Friction velocity u*_0 of the approaching flow, m/s."""
        height = SPEED_HEIGHT * self.height_m
        return float(log_law_ustar(self.settings.speed, height, self.roughness_m))

    @property
    def bed_line(self) -> BedLine:
        """The bed line, m, from the inlet to the outlet."""
        line, settings = self.line or triangle(self.slope_deg, self.height_m), self.settings
        ends = (settings.upstream * self.height_m, settings.downstream * self.height_m)
        return extended(line, *ends)

    @cached_property
    def grid(self) -> Grid:
        """The grid lines of the mesh along it."""
        cells = self.settings.cells_per_face
        return along(
            self.bed_line, slope_deg=self.slope_deg, cells_per_face=cells, growth=self.growth
        )

    @property
    def growth(self) -> float:
        """Ratio of neighbouring cells: with twice the cells on a face all are half as long."""
        return float(self.settings.expansion_ratio ** (40 / self.settings.cells_per_face))

    @property
    def growth_far(self) -> float:
        """The same far from the forms."""
        return growth_far(self.growth, self.settings.cells_per_face)

    def check_mesh(self) -> None:
        """Refuse settings and bed lines whose mesh cannot be made or not be solved on.

        Raises
        ------
        InputError
            With the field of the study file: ``bed.obstacles`` where an obstacle is far smaller
            than the first cells, else the bed line or a field of the flow.
        """
        if self.growth > MOST_GROWTH:
            raise InputError(
                f"with {self.settings.cells_per_face} cells per face neighbouring cells differ by"
                f" {self.growth:.3g}, more than {MOST_GROWTH:g}",
                where="flow.expansion_ratio",
                remedy="lower it, or raise flow.cells_per_face",
            )
        if not self.settings.depth and self.lid < LEAST_LID:
            raise InputError(
                f"{self.lid:g} is below {LEAST_LID:g} heights of the forms",
                where="flow.lid",
                remedy="raise it",
            )
        shortest, x, end = self.grid.shortest
        if shortest >= LEAST_CELL * self.first_cell_m:
            return
        near = self.first_cell_m
        small = any(a - near <= end and x <= b + near for a, b in self.bed_line.bare)
        raise InputError(
            f"at x = {x:.4g} m the mesh needs cells {shortest:.2g} m long, far shorter than its"
            f" first cells are high, {self.first_cell_m:.2g} m",
            where="bed.obstacles" if small else "bed.profile" if self.profile else "bed",
            remedy="make the obstacle larger, leave it out, or lower flow.first_cell_height"
            if small
            else "take corners apart that nearly coincide",
        )

    @property
    def cost_s(self) -> float:
        """Wall time on one core, s: 0.4 for mesh and start, then 6e5 cell-iterations a second.

        Measured on 5 to 40 degrees: 100 iterations at small slopes to 160 at the steepest.
        """
        near, far = min(NEAR, self.lid / 2) * self.height_m, self.growth_far
        up = log(1 + near / self.first_cell_m * (self.growth - 1)) / log(self.growth)
        last = self.first_cell_m * self.growth**up
        up += log(1 + (self.lid * self.height_m - near) / last * (far - 1)) / log(far)
        return 0.4 + self._iterations * sum(self.grid.cells) * up / 6e5

    @property
    def _iterations(self) -> float:
        return (100.0 + 0.04 * self.slope_deg**2) * self.settings.cells_per_face / 40.0

    def share(self, directory: Path) -> float:
        """Iterations over those that are expected, at most nearly all."""
        path = directory / "log.simpleFoam"
        text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
        return min(text.count("\nTime = ") / self._iterations, 0.95)

    def versions(self) -> dict[str, str]:
        """The programs that mesh and solve."""
        return {"gmsh": installed("gmsh"), "openfoam": openfoam.version()}

    def write(self, directory: Path, cases: Path) -> None:
        """Write the case's numbers into the template's files, and mesh it."""
        settings, lid_m = self.settings, self.lid * self.height_m
        # an iteration carries a change past some twenty cells: with more of them along the bed the
        # flow still changes at a residual at which that over a pile has ended
        residual = RESIDUAL * min(1.0, CELLS_ALONG / sum(self.grid.cells))
        set_values(
            directory / "parameters",
            top=TOPS[settings.top],
            freeStream=settings.speed,
            speedHeight=SPEED_HEIGHT * self.height_m,
            lidHeight=lid_m,
            columnOffset=-self.height_m,
            firstCentre=self._first_centre,
            roughnessLength=self.roughness_m,
            viscosity=self.viscosity_m2_s,
            turbulence=settings.turbulence_model,
            convection=settings.convection_scheme,
            correctors=settings.non_orthogonal_correctors,
            residual=f"{residual:.3g}",
        )
        set_values(
            directory / "parameters.geo",
            slope_deg=self.slope_deg,
            height=self.height_m,
            lid=lid_m,
            closed=int(settings.top == "closed channel"),
            first_cell=self.first_cell_m,
            growth=self.growth,
            growth_far=self.growth_far,
        )
        self.grid.write(directory / "bed_line.geo")
        if self.profile:
            (directory / "profile.csv").write_text(self.profile.text, encoding="utf-8")
        write_mesh(directory)

    @property
    def _first_centre(self) -> float:
        """Height of the centre of the first cells over flat bed, m."""
        return self.first_cell_m / 2 / cos(radians(self.slope_deg))

    def collect(self, directory: Path) -> None:
        """Check the run and write `wall_stress.csv` and `diagnostics.csv`.

        Raises
        ------
        SolverError
            If the run failed or did not converge, or if the stress is not usable; as `Exploded` or
            `Stalled` where that is how it ended.
        """
        openfoam.check_log(directory)
        solved = SolvedFlow(directory)
        stress = solved.stress()
        self._check_stress(stress, directory)
        stress.to_csv(directory / WALL_STRESS)
        table = diagnostics(
            stress,
            approach=solved.approach_ustar(),
            slope_deg=self.slope_deg,
            height=self.height_m,
            roughness=self.roughness_m,
            reynolds=self.ustar0_m_s / self.viscosity_m2_s,
        )
        if self.settings.depth:
            ratio = self.mean_speed_over_log_law(solved)
            table.loc["mean_speed_over_log_law", RANGE] = (
                *(ratio, 1 - MEAN_SPEED_ERROR, 1 + MEAN_SPEED_ERROR),
            )
            table = judged(table)
        text = table.to_csv(float_format="%.6g", lineterminator="\n")
        write_durably(directory / DIAGNOSTICS, text)
        approach = table.loc["approach_ustar_over_log_law"]
        if approach["sound"] != "yes":
            raise SolverError(
                f"on flat bed u* is {approach['value']:.3f} of the log law's: the wall function"
                " fails",
                where=str(directory),
                remedy=f"{DIAGNOSTICS} says more; raise the first cell's height or the speed",
            )

    def mean_speed_over_log_law(self, solved: "SolvedFlow") -> float:
        """The mean speed of a channel in the column before the inlet over that of the log law."""
        ustar, depth = solved.approach_ustar() * self.ustar0_m_s, self.lid * self.height_m
        closed = self.settings.top == "closed channel"
        law = depth_mean_speed(ustar, depth, self.roughness_m, closed=closed)
        return float(solved.column_speed() / law)

    def _check_stress(self, stress: WallStress, directory: Path) -> None:
        if not np.isfinite([stress.tau_wall, stress.ustar_over_ustar0_eq10]).all():
            raise Exploded("the stress on the bed is not a number", where=str(directory))
        line = self.bed_line
        segment = np.clip(np.searchsorted(line.x, stress.x_m) - 1, 0, len(line.slopes_deg) - 1)
        over = stress.z_e_m / np.cos(np.radians(line.slopes_deg[segment])) / self._first_centre
        if not 0.98 < over.min() <= over.max() < 1.02:
            raise SolverError(
                f"z_e is {over.min():.3g} to {over.max():.3g} of that of the first cells",
                where=str(directory),
                remedy="the mesh is not that of the parameters: lower flow.expansion_ratio, or"
                " raise flow.first_cell_height",
            )


def set_values(path: Path, **values: float | str) -> None:
    """Replace the values in a template's list; its comments stay."""
    text = path.read_text(encoding="utf-8")
    for name, value in values.items():
        text, count = re.subn(rf"(?m)^({name}[ =]+)[^;]+;", rf"\g<1>{value};", text)
        if count != 1:
            raise ValueError(f"{path.name} has {count} entries named {name}")
    path.write_text(text, encoding="utf-8")


@dataclass(frozen=True)
class SolvedFlow:
    """The last iteration of an OpenFOAM case.

    The approaching flow develops in the column before the inlet, on the rows of the mesh. The
    numbers have seven digits, as VTK hands them on.

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
    def _fields(self) -> "tuple[pyvista.PolyData, pyvista.UnstructuredGrid]":
        return openfoam.read_last_time(self.directory, "bed", ["U", "wallShearStress"])

    @cached_property
    def _numbers(self) -> dict[str, float]:
        return openfoam.read_numbers(self.directory / "parameters")

    def stress(self) -> WallStress:
        """Stress along the bed; u*_0 is that of the column before the inlet.

        Raises
        ------
        SolverError
            If nothing flows in the column.
        """
        (bed, air), z0 = self._fields, self._numbers["roughnessLength"]
        # corners of the faces, downstream, each with its two upstream ones first
        corners = np.asarray(bed.points, dtype=np.float64)[bed.regular_faces]
        order = np.argsort(corners[:, :, 0].mean(axis=1))
        across = np.argsort(corners[order, :, 0], axis=1)[:, :, None]
        corners = np.take_along_axis(corners[order], across, axis=1)
        starts, ends = corners[:, :2].mean(axis=1), corners[:, 2:].mean(axis=1)
        centres, lengths = (starts + ends) / 2.0, np.linalg.norm(ends - starts, axis=1)
        tangents = (ends - starts) / lengths[:, None]
        toe = int(np.argmin(np.abs(starts[:, 0])))
        s = np.cumsum(lengths) - lengths[:toe].sum() - lengths / 2.0
        normals = np.column_stack([-tangents[:, 2], np.zeros(len(s)), tangents[:, 0]])
        # the cell on each face
        above = np.atleast_1d(air.find_containing_cell(centres + 1e-2 * lengths.min() * normals))
        if (above < 0).any():
            raise SolverError("a face of the bed has no cell above it", remedy="mesh it again")
        cells = _corners(air)[above].mean(axis=1)
        z_e = _along(cells - centres, normals)
        u_t = _along(np.asarray(air.cell_data["U"], dtype=np.float64)[above], tangents)
        # OpenFOAM's is the stress of the bed on the flow
        shear = np.asarray(bed.cell_data["wallShearStress"], dtype=np.float64)[order]
        tau = -_along(shear, tangents)
        if not tau[0] > 0:
            raise SolverError("no flow in the column before the inlet", where=str(self.directory))
        ustar0, bed_of_study = float(np.sqrt(tau[0])), slice(1, None)
        columns = {
            "s_m": s,
            "x_m": centres[:, 0],
            "z_m": centres[:, 2],
            "length_m": lengths,
            "z_e_m": z_e,
            "tau_wall": tau / ustar0**2,
            "ustar_over_ustar0_eq10": log_law_ustar(u_t, z_e, z0) / ustar0,
            "ustar_over_ustar0_eq10_printed": log_law_ustar(u_t, z_e, z0, printed=True) / ustar0,
        }
        return WallStress(**{name: values[bed_of_study] for name, values in columns.items()})

    def approach_ustar(self) -> float:
        """Friction velocity in the column before the inlet over that of the log law.

        It is 1 but for the difference that the rows of the mesh make to the log law.
        """
        (bed, _), numbers = self._fields, self._numbers
        first = int(np.argmin(bed.cell_centers().points[:, 0]))
        tau = -float(bed.cell_data["wallShearStress"][first, 0])
        law = [numbers[name] for name in ("freeStream", "speedHeight", "roughnessLength")]
        return float(np.sqrt(max(tau, 0.0)) / log_law_ustar(*law))

    def column_speed(self) -> float:
        """Mean speed in the column before the inlet, m/s."""
        _, air = self._fields
        corners = _corners(air)
        x = corners[:, :, 0].mean(axis=1)
        column = x < x.min() + 1e-6 * np.ptp(x)
        height = np.ptp(corners[column, :, 2], axis=1)
        speed = np.asarray(air.cell_data["U"], dtype=np.float64)[column, 0]
        return float(np.average(speed, weights=height))


def _corners(air: "pyvista.UnstructuredGrid") -> FloatArray:
    """Corners of the cells, m, shape (cells, 8, 3)."""
    cells = air.cell_connectivity.reshape(-1, 8)
    return np.asarray(np.asarray(air.points, dtype=np.float64)[cells])


def _along(vectors: FloatArray, directions: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("fi,fi->f", vectors, directions))
