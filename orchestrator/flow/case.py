"""The flow over one bed line as an OpenFOAM case."""

import re
from dataclasses import dataclass, field, fields
from functools import cached_property
from importlib.metadata import version as installed
from math import cos, isfinite, log, radians
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator.bed.line import BedLine, triangle
from orchestrator.errors import Exploded, InputError, SolverError
from orchestrator.flow import diagnostics
from orchestrator.flow.diagnostics import Diagnostic
from orchestrator.flow.grid import NEAR, Grid, along, extended, growth_far
from orchestrator.flow.mesh import write_line, write_mesh
from orchestrator.flow.solved import SolvedFlow
from orchestrator.flow.stress import WallStress, undisturbed_ustar
from orchestrator.runs.case import Case
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.solvers import openfoam
from orchestrator.study.parts import Convection, Turbulence
from orchestrator.study.profile import Profile
from orchestrator.study.scene import BUILDABLE_DEG
from orchestrator.types import FloatArray

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
MESH = (
    *("boundary", "faces", "neighbour", "owner", "points", "sets/air", "sets/approach"),
    *("cellZones", "faceZones", "pointZones"),
)
"""Files of a mesh that gmshToFoam makes."""
FIELDS = ("U", "epsilon", "k", "nut", "omega", "p", "phi", "wallShearStress")
"""Fields of the last iteration; epsilon or omega, as the turbulence model has it."""


@dataclass(frozen=True)
class FlowCase(Case):
    """Steady turbulent flow over a bed line.

    The flow's u*/u*_0 depends on the shape, on z0/h, on the mesh, and hardly on U_e and nu.

    Parameters
    ----------
    slope_deg : float
        Slope of the windward faces, where they are steepest; 0 if there are none.
    height_m : float
        Height h of the forms, m.
    roughness_m : float
        Roughness length z0 of the bed, m.
    speed_m_s : float
        U_e, the speed of the approaching flow at 10 h above the flat bed, m/s.
    viscosity_m2_s : float
        Kinematic viscosity, m2/s.
    first_cell_m : float
        Height of the cells on the bed, normal to the faces of the pile, m; z_e is half of it.
        The stress depends on it: `default_first_cell_height` is the choice of the studies.
    cells_per_face : int
        Cells along each face of the pile; the others follow.
    expansion_ratio : float
        Ratio of neighbouring cells up from the bed and away from the pile, with 40 cells on a face;
        it follows the number of cells, so that twice of these is a mesh twice as fine.
    turbulence_model : str
        OpenFOAM's model of it: kEpsilon, RNGkEpsilon, realizableKE or kOmegaSST.
    convection_scheme : str
        Scheme for the convection of U: linearUpwind, upwind or limitedLinear.
    non_orthogonal_correctors : int
        Repeated pressure solves in each iteration, for cells that are not orthogonal.
    lid, upstream, downstream : float
        Height of the lid above the flat bed, flat bed before and behind the forms, in h.
    line : BedLine, optional
        The bed line, m; by default a triangle of the slope and the height, or a flat bed.
    profile : Profile, optional
        The measured profile that the line is of, for a copy of it in the case.

    Raises
    ------
    InputError
        If the case cannot be built.
    """

    slope_deg: float
    height_m: float
    roughness_m: float
    speed_m_s: float
    viscosity_m2_s: float
    first_cell_m: float
    cells_per_face: int = 40
    expansion_ratio: float = 1.1
    turbulence_model: Turbulence = "kEpsilon"
    convection_scheme: Convection = "linearUpwind"
    non_orthogonal_correctors: int = 1
    lid: float = 100.0
    upstream: float = 80.0
    downstream: float = 100.0
    line: BedLine | None = None
    profile: Profile | None = field(default=None, compare=False)

    least_lid: ClassVar[float] = 5.0
    """Lowest lid, h: under lower ones iterations cycle, and none ends."""
    kind: ClassVar[str] = "flow"
    template: ClassVar[str] = "openfoam/pile"
    recipe: ClassVar[int] = 6
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

    def __post_init__(self) -> None:
        self._check_numbers()
        self._check_mesh()

    def _check_numbers(self) -> None:
        for name, value in self._plain.items():
            if isinstance(value, str) or value is None:
                continue
            if value == 0 and name in ("slope_deg", "non_orthogonal_correctors", "closed"):
                continue
            if not isfinite(value) or value <= 0.0:
                raise InputError(f"{value!r} is not a positive number", where=name)

    def _check_mesh(self) -> None:
        low, high = BUILDABLE_DEG
        if self.slope_deg != 0.0 and not low <= self.slope_deg <= high:
            raise InputError(
                f"{self.slope_deg:g} is neither 0 nor within {low:g} to {high:g} degrees",
                where="slope_deg",
            )
        if not 8 <= self.cells_per_face <= 400:
            raise InputError(
                f"{self.cells_per_face} is not within 8 to 400", where="cells_per_face"
            )
        if not 1.0 < self.expansion_ratio <= 2.0:
            raise InputError(
                f"{self.expansion_ratio:g} is not within 1 to 2", where="expansion_ratio"
            )
        if self.first_cell_m > self.height_m / 4.0:
            raise InputError(
                f"{self.first_cell_m:g} m is above h/4 = {self.height_m / 4:g} m",
                where="first_cell_m",
            )

        if self.growth > MOST_GROWTH:
            raise InputError(
                f"with {self.cells_per_face} cells per face neighbouring cells differ by"
                f" {self.growth:.3g}, more than {MOST_GROWTH:g}",
                where="expansion_ratio",
                remedy="lower it, or raise cells_per_face",
            )
        if self.lid < self.least_lid:
            raise InputError(
                f"{self.lid:g} is below {self.least_lid:g} heights of the forms", where="lid"
            )

    def check_grid(self) -> None:
        """Refuse a bed line with details that the cells on the bed cannot resolve.

        Raises
        ------
        InputError
            If a cell along the bed is far shorter than the first cells are high; the field is
            ``bed.obstacles`` where an obstacle is that small, else ``bed``.
        """
        shortest, x, end = self.grid.shortest
        if shortest >= LEAST_CELL * self.first_cell_m:
            return
        near = self.first_cell_m
        small = any(a - near <= end and x <= b + near for a, b in self.bed_line.bare)
        line = "bed.profile" if self.profile else "bed"
        raise InputError(
            f"at x = {x:.4g} m the mesh needs cells {shortest:.2g} m long, far shorter than its"
            f" first cells are high, {self.first_cell_m:.2g} m",
            where="bed.obstacles" if small else line,
            remedy="make the obstacle larger, leave it out, or lower flow.first_cell_height"
            if small
            else "take corners apart that nearly coincide",
        )

    @property
    def parameters(self) -> dict[str, Any]:
        """The fields, as JSON; SI units, degrees."""
        whole = {
            name: int(getattr(self, name))
            for name in ("cells_per_face", "non_orthogonal_correctors")
        }
        plain = self._plain.items()
        numbers = {n: v if isinstance(v, str) else float(v) for n, v in plain}
        corners = digest_text(canonical_json(self.bed_line.corners.tolist()))
        return {**numbers, **whole, "bed_line": corners}

    @property
    def _plain(self) -> dict[str, Any]:
        """Its numbers and words."""
        names = (one.name for one in fields(self) if one.name not in ("line", "profile"))
        return {name: getattr(self, name) for name in names}

    @property
    def bed_line(self) -> BedLine:
        """The bed line, m, from the inlet to the outlet."""
        line = self.line or triangle(self.slope_deg, self.height_m)
        return extended(line, self.upstream * self.height_m, self.downstream * self.height_m)

    @cached_property
    def grid(self) -> Grid:
        """The grid lines of the mesh along it."""
        return along(
            self.bed_line,
            slope_deg=self.slope_deg,
            cells_per_face=self.cells_per_face,
            growth=self.growth,
        )

    @property
    def growth(self) -> float:
        """Ratio of neighbouring cells: with twice the cells on a face all are half as long."""
        return float(self.expansion_ratio ** (40 / self.cells_per_face))

    @property
    def growth_far(self) -> float:
        """The same far from the forms."""
        return growth_far(self.growth, self.cells_per_face)

    @property
    def ustar0_m_s(self) -> float:
        """Friction velocity u*_0 of the approaching flow, m/s."""
        return undisturbed_ustar(self.speed_m_s, SPEED_HEIGHT * self.height_m, self.roughness_m)

    @property
    def cost_s(self) -> float:
        """Wall time on one core, s: 0.4 for mesh and start, then 6e5 cell-iterations a second.

        Measured on 5 to 40 degrees: 100 iterations at small slopes to 160 at the steepest.
        """
        return 0.4 + self._iterations * self._cells() / 6e5

    @property
    def _residual(self) -> float:
        """Residual of p at which iterations end.

        An iteration carries a change past some twenty cells: with more of them along the bed the
        flow still goes on to change at a residual at which that over a pile has ended.
        """
        return RESIDUAL * min(1.0, CELLS_ALONG / sum(self.grid.cells))

    @property
    def _iterations(self) -> float:
        return (100.0 + 0.04 * self.slope_deg**2) * self.cells_per_face / 40.0

    def share(self, directory: Path) -> float:
        """Iterations over those that are expected, at most nearly all."""
        log = directory / "log.simpleFoam"
        text = log.read_text(encoding="utf-8", errors="replace") if log.is_file() else ""
        return min(text.count("\nTime = ") / self._iterations, 0.95)

    def _cells(self) -> float:
        """How many cells `pile.geo` makes, about."""
        near, far = min(NEAR, self.lid / 2) * self.height_m, self.growth_far
        up = log(1 + near / self.first_cell_m * (self.growth - 1)) / log(self.growth)
        last = self.first_cell_m * self.growth**up
        up += log(1 + (self.lid * self.height_m - near) / last * (far - 1)) / log(far)
        return sum(self.grid.cells) * up

    def versions(self) -> dict[str, str]:
        """The programs that mesh and solve."""
        return {"gmsh": installed("gmsh"), "openfoam": openfoam.version()}

    def write(self, directory: Path, cases: Path) -> None:
        """Write the case's numbers into the template's files, and mesh it."""
        set_values(
            directory / "parameters",
            freeStream=self.speed_m_s,
            speedHeight=SPEED_HEIGHT * self.height_m,
            lidHeight=self.lid * self.height_m,
            columnOffset=-self.height_m,
            firstCentre=self.first_cell_m / 2 / cos(radians(self.slope_deg)),
            roughnessLength=self.roughness_m,
            viscosity=self.viscosity_m2_s,
            turbulence=self.turbulence_model,
            convection=self.convection_scheme,
            correctors=self.non_orthogonal_correctors,
            residual=f"{self._residual:.3g}",
        )
        set_values(
            directory / "parameters.geo",
            slope_deg=self.slope_deg,
            height=self.height_m,
            lid=self.lid * self.height_m,
            first_cell=self.first_cell_m,
            growth=self.growth,
            growth_far=self.growth_far,
        )
        self._write_top(directory)
        write_line(self.grid, directory / "bed_line.geo")
        if self.profile:
            (directory / "profile.csv").write_text(self.profile.text, encoding="utf-8")
        write_mesh(directory)

    def _write_top(self, directory: Path) -> None:
        """Write what is above the flow; of a boundary layer there is nothing more to say."""

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
        found = diagnostics.of(
            stress,
            approach=solved.approach_ustar(),
            slope_deg=self.slope_deg,
            height=self.height_m,
            roughness=self.roughness_m,
            reynolds=self.ustar0_m_s / self.viscosity_m2_s,
        )
        diagnostics.to_csv({**found, **self.of_the_top(solved)}, directory / DIAGNOSTICS)
        self._check_approach(found["approach_ustar_over_log_law"], directory)

    def of_the_top(self, solved: SolvedFlow) -> dict[str, Diagnostic]:
        """Diagnostics of what is above the flow."""
        return {}

    def _check_stress(self, stress: WallStress, directory: Path) -> None:
        if not np.isfinite([stress.tau_wall, stress.ustar_over_ustar0_eq10]).all():
            raise Exploded("the stress on the bed is not a number", where=str(directory))
        lowest = self.first_cell_m / 2 / np.cos(np.radians(self.slope_deg))
        over = stress.z_e_m / np.cos(np.radians(self._slopes_deg(stress.x_m))) / lowest
        if not 0.98 < over.min() <= over.max() < 1.02:
            raise SolverError(
                f"z_e is {over.min():.3g} to {over.max():.3g} of what the first cells should have",
                where=str(directory),
                remedy="remove the case and run it again",
            )

    def _slopes_deg(self, x: FloatArray) -> FloatArray:
        """Slope of the bed at some places, degrees."""
        line = self.bed_line
        segment = np.searchsorted(line.x, x) - 1
        return np.asarray(line.slopes_deg[np.clip(segment, 0, len(line.slopes_deg) - 1)])

    def _check_approach(self, approach: Diagnostic, directory: Path) -> None:
        if not approach.sound:
            raise SolverError(
                f"on flat bed u* is {approach.value:.3f} of the log law's: the wall function fails",
                where=str(directory),
                remedy=f"{DIAGNOSTICS} says more; raise the first cell's height or the speed",
            )


def set_values(path: Path, **values: float | str) -> None:
    """Replace the values in a template's list; its comments stay."""
    text = path.read_text(encoding="utf-8")
    for name, value in values.items():
        text, found = re.subn(rf"(?m)^({name}[ =]+)[^;]+;", rf"\g<1>{value};", text)
        if found != 1:
            raise ValueError(f"{path.name} has {found} entries named {name}")
    path.write_text(text, encoding="utf-8")
