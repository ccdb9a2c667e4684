"""The flow over one pile as an OpenFOAM case."""

import re
from dataclasses import asdict, dataclass
from importlib.metadata import version as installed
from math import isfinite, log, radians, tan
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator.errors import Exploded, InputError, SolverError
from orchestrator.flow import diagnostics
from orchestrator.flow.diagnostics import Diagnostic
from orchestrator.flow.mesh import write_mesh
from orchestrator.flow.stress import WallStress, read_openfoam, undisturbed_ustar
from orchestrator.runs.case import Case
from orchestrator.solvers import openfoam
from orchestrator.study.parts import Convection, Turbulence
from orchestrator.study.scene import BUILDABLE_DEG

WALL_STRESS = "wall_stress.csv"
DIAGNOSTICS = "diagnostics.csv"
LID_OVER_HEIGHT = 10.0
MESH = (
    *("boundary", "faces", "neighbour", "owner", "points", "sets/air"),
    *("cellZones", "faceZones", "pointZones"),
)
"""Files of a mesh that gmshToFoam makes."""
FIELDS = ("U", "epsilon", "k", "nut", "omega", "p", "phi", "wallShearStress")
"""Of the last iteration; epsilon or omega, as the turbulence model has it."""


@dataclass(frozen=True)
class FlowCase(Case):
    """Steady turbulent flow over a triangular pile, or over a flat bed.

    The flow's u*/u*_0 depends on the slope, on z0/h, on the mesh, and hardly on U_e and nu.

    Parameters
    ----------
    slope_deg : float
        Slope of both faces, 5 to 40 degrees; 0 leaves a flat bed in the domain of a pile.
    height_m : float
        Height h of the pile, m; the lid is at 10 h.
    roughness_m : float
        Roughness length z0 of the bed, m.
    speed_m_s : float
        U_e, the speed of the approaching flow at the lid, m/s.
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
        Of the pressure for cells that are not orthogonal, in each iteration.

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

    kind: ClassVar[str] = "flow"
    template: ClassVar[str] = "openfoam/pile"
    recipe: ClassVar[int] = 4
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
        "log.gmshToFoam",
        "log.simpleFoam",
        "constant/polyMesh/sed??????",  # a killed sed's
    )

    def __post_init__(self) -> None:
        self._check_numbers()
        self._check_mesh()

    def _check_numbers(self) -> None:
        for name, value in self.parameters.items():
            if isinstance(value, str) or (
                value == 0 and name in ("slope_deg", "non_orthogonal_correctors")
            ):
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

    @property
    def parameters(self) -> dict[str, Any]:
        """The fields, as JSON; SI units, degrees."""
        whole = {
            name: int(getattr(self, name))
            for name in ("cells_per_face", "non_orthogonal_correctors")
        }
        fields = asdict(self).items()
        return {n: v if isinstance(v, str) else float(v) for n, v in fields} | whole

    @property
    def ustar0_m_s(self) -> float:
        """Friction velocity u*_0 of the approaching flow, m/s."""
        return undisturbed_ustar(self.speed_m_s, LID_OVER_HEIGHT * self.height_m, self.roughness_m)

    @property
    def cost_s(self) -> float:
        """Wall time on one core, s: 0.2 for the start, then 8e5 cell-iterations a second.

        Measured on 5 to 40 degrees: 100 iterations at small slopes to 160 at the steepest.
        """
        iterations = (100.0 + 0.04 * self.slope_deg**2) * self.cells_per_face / 40.0
        return 0.2 + iterations * self._cells() / 8e5

    def _cells(self) -> float:
        """How many cells `pile.geo` makes, about."""
        expansion_ratio = self.expansion_ratio ** (40.0 / self.cells_per_face)
        face = 1.0 / tan(radians(self.slope_deg)) if self.slope_deg else 4.0
        toe = 1.7 * face / self.cells_per_face
        beside = _grown(10.0 / toe, expansion_ratio) + _grown(20.0 / toe, expansion_ratio)
        up = _grown(LID_OVER_HEIGHT * self.height_m / self.first_cell_m, expansion_ratio)
        return (2 * self.cells_per_face + beside) * up

    def versions(self) -> dict[str, str]:
        """The programs that mesh and solve."""
        return {"gmsh": installed("gmsh"), "openfoam": openfoam.version()}

    def write(self, directory: Path, cases: Path) -> None:
        """Write the case's numbers into the template's files, and mesh the pile."""
        _set_values(
            directory / "parameters",
            freeStream=self.speed_m_s,
            lidHeight=LID_OVER_HEIGHT * self.height_m,
            roughnessLength=self.roughness_m,
            viscosity=self.viscosity_m2_s,
            turbulence=self.turbulence_model,
            convection=self.convection_scheme,
            correctors=self.non_orthogonal_correctors,
        )
        _set_values(
            directory / "parameters.geo",
            slope_deg=self.slope_deg,
            height=self.height_m,
            first_cell=self.first_cell_m,
            cells_per_face=self.cells_per_face,
            growth_at_40=self.expansion_ratio,
        )
        write_mesh(directory)

    def collect(self, directory: Path) -> None:
        """Check the run and write `wall_stress.csv` and `diagnostics.csv`.

        Raises
        ------
        SolverError
            If the run failed or did not converge, or if the stress is not usable; as `Exploded` or
            `Stalled` where that is how it ended.
        """
        openfoam.check_log(directory)
        stress = read_openfoam(directory)
        self._check_stress(stress, directory)
        stress.to_csv(directory / WALL_STRESS)
        found = diagnostics.of(
            stress,
            slope_deg=self.slope_deg,
            height=self.height_m,
            roughness=self.roughness_m,
            reynolds=self.ustar0_m_s / self.viscosity_m2_s,
        )
        diagnostics.to_csv(found, directory / DIAGNOSTICS)
        self._check_upstream(found["upstream_ustar_over_ustar0"], directory)

    def _check_stress(self, stress: WallStress, directory: Path) -> None:
        if not np.isfinite([stress.tau_wall, stress.ustar_over_ustar0_eq10]).all():
            raise Exploded("the stress on the bed is not a number", where=str(directory))
        low, high = stress.z_e_m.min(), stress.z_e_m.max()
        # flat parts of the bed have it larger by 1/cos(slope)
        if not 0.48 * self.first_cell_m < low <= high < 0.7 * self.first_cell_m:
            raise SolverError(
                f"z_e goes from {low:g} to {high:g} m, with first cells of {self.first_cell_m:g} m",
                where=str(directory),
                remedy="remove the case and run it again",
            )

    def _check_upstream(self, upstream: Diagnostic, directory: Path) -> None:
        if not upstream.sound:
            raise SolverError(
                f"on the undisturbed bed u* is {upstream.value:.3f} u*_0: the wall's log law fails",
                where=str(directory),
                remedy=f"{DIAGNOSTICS} says more; raise the first cell's height or the speed",
            )


def _grown(length_over_first: float, expansion_ratio: float) -> float:
    """How many cells that grow by `growth` fill a length."""
    return log(1.0 + length_over_first * (expansion_ratio - 1.0)) / log(expansion_ratio)


def _set_values(path: Path, **values: float | str) -> None:
    """Replace the values in a template's list; its comments stay."""
    text = path.read_text(encoding="utf-8")
    for name, value in values.items():
        text, found = re.subn(rf"(?m)^({name}[ =]+)[^;]+;", rf"\g<1>{value};", text)
        if found != 1:
            raise ValueError(f"{path.name} has {found} entries named {name}")
    path.write_text(text, encoding="utf-8")
