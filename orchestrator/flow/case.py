"""The flow over one bed line as an OpenFOAM case, and what its last iteration holds."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.metadata import version as installed
from math import cos, log, radians
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator import digits
from orchestrator.bed.line import BedLine, triangle
from orchestrator.errors import Exploded, InputError, SolverError
from orchestrator.flow.foam import (
    BED_FLOW,
    COLUMN_FLOW,
    INTERPOLATED_DIGITS,
    SolvedFlow,
    start_from,
    write_poly_mesh,
)
from orchestrator.flow.mesh import NEAR, Grid, along, extended, growth_far, made_by_gmsh
from orchestrator.flow.stress import WallStress, diagnostics
from orchestrator.physics.constants import KARMAN
from orchestrator.physics.velocity import depth_mean_speed, log_law_speed, log_law_ustar
from orchestrator.runs.case import Case
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.solvers import openfoam
from orchestrator.study.parts import Flow
from orchestrator.study.profile import Profile

WALL_STRESS = "wall_stress.csv"
DIAGNOSTICS = "diagnostics.csv"
SPEED_HEIGHT = 10.0  # height above the flat bed at which U_e is given, h
RESIDUAL, CELLS_ALONG = 2e-4, 150
"""Residual of p at which the mean stress on a pile is within 0.1 % of where it ends, and the cells
along the bed up to which it is."""
FINE = 80  # cells per face from which a flow starts from that on half of them
LEAST_CELL = 0.04
"""Shortest cell along the bed, over the height of the first cells: with cells of a hundredth the
stress upstream was 3 to 12 % off, and up to fourfold with cells of a thousandth."""
MOST_GROWTH = (
    3.0  # largest ratio of neighbouring cells: rows of more do not fit under a crest
)
LEAST_LID = 5.0
"""Lowest lid of a boundary layer, h: under lower ones iterations cycle, and none ends."""
PATCHES = {
    "bed": "wall",
    "sides": "empty",
    "before": "cyclic; neighbourPatch after",
    "after": "cyclic; neighbourPatch before",
    "inlet": "mappedPatch; sampleMode nearestCell; sampleRegion region0; samplePatch none; "
    "offsetMode uniform; offset ({} 0 0)",
}
"""Types of the patches: what enters is what the column before the inlet holds."""
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

    ``height_m`` is the height h of the forms, ``slope_deg`` the steepest slope of the windward
    faces, 0 if there are none. The settings have the roughness, the viscosity and the first cell
    given. The bed line is by default a triangle of the slope and the height, or a flat bed; of a
    measured profile the case gets a copy.
    """

    height_m: float
    slope_deg: float
    settings: Flow
    line: BedLine | None = None
    profile: Profile | None = field(default=None, compare=False)

    kind: ClassVar[str] = "flow"
    template: ClassVar[str] = "openfoam/pile"
    recipe: ClassVar[int] = 9
    results: ClassVar[tuple[str, ...]] = (BED_FLOW, COLUMN_FLOW)
    derived: ClassVar[tuple[str, ...]] = (WALL_STRESS, DIAGNOSTICS)
    bulky: ClassVar[tuple[str, ...]] = (
        *(f"[1-9]*/{name}" for name in FIELDS),
        *(f"[1-9]*/uniform/{name}" for name in ("time", "cumulativeContErr")),
        "[1-9]*/uniform/functionObjects/functionObjectProperties",
    )
    needs_bulky: ClassVar[bool] = True
    made: ClassVar[tuple[str, ...]] = ("log.simpleFoam", "log.wallShearStress")

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
        return float(self.settings.roughness or np.nan)

    @property
    def viscosity_m2_s(self) -> float:
        """Kinematic viscosity of the solve, m2/s."""
        return float(self.settings.viscosity or np.nan)

    @property
    def first_cell_m(self) -> float:
        """Height of the cells on the bed, normal to the windward faces, m; z_e is half of it."""
        return float(self.settings.first_cell_height or np.nan)

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
        line, settings = (
            self.line or triangle(self.slope_deg, self.height_m),
            self.settings,
        )
        ends = (settings.upstream * self.height_m, settings.downstream * self.height_m)
        whole = extended(line, *ends)
        x, z = digits.on_grid(whole.corners, self.height_m).T.tolist()
        bare = digits.on_grid(np.reshape(whole.bare, (-1, 2)), self.height_m).tolist()
        ranges = tuple((start, end) for start, end in bare)
        return replace(whole, x=tuple(x), z=tuple(z), bare=ranges)

    @cached_property
    def grid(self) -> Grid:
        """The grid lines of the mesh along it."""
        return along(
            self.bed_line, self.slope_deg, self.settings.cells_per_face, self.growth
        )

    @cached_property
    def needs(self) -> tuple["FlowCase", ...]:
        """The flow on half the cells, from which that on a fine mesh starts."""
        # from the log layer the residuals end the iterations while a slow mode of the whole domain
        # still decays: at 80 cells a face the stress was off by up to 1.5 %
        cells = self.settings.cells_per_face
        if cells < FINE:
            return ()
        coarser = self.settings.model_copy(update={"cells_per_face": cells // 2})
        return (replace(self, settings=coarser),)

    @property
    def growth(self) -> float:
        """Ratio of neighbouring cells: with twice the cells on a face all are half as long."""
        return float(
            self.settings.expansion_ratio ** (40 / self.settings.cells_per_face)
        )

    @property
    def growth_far(self) -> float:
        """The same far from the forms."""
        return growth_far(self.growth, self.settings.cells_per_face)

    def check_mesh(self) -> None:
        """Refuse settings and bed lines whose mesh cannot be made or not be solved on."""
        if self.growth > MOST_GROWTH:
            what = f"neighbouring cells differ by {self.growth:.3g}, more than {MOST_GROWTH:g}"
            remedy = "lower it, or raise flow.cells_per_face"
            raise InputError(what, where="flow.expansion_ratio", remedy=remedy)
        if not self.settings.depth and self.lid < LEAST_LID:
            what = f"{self.lid:g} is below {LEAST_LID:g} heights of the forms"
            raise InputError(what, where="flow.lid", remedy="raise it")
        shortest, x, end = self.grid.shortest
        if shortest >= LEAST_CELL * self.first_cell_m:
            return
        near = self.first_cell_m
        what = f"at x = {x:.4g} m the mesh needs cells {shortest:.2g} m long, far shorter than its"
        what = f"{what} first cells are high, {near:.2g} m"
        if any(a - near <= end and x <= b + near for a, b in self.bed_line.bare):
            remedy = "make the obstacle larger, leave it out, or lower flow.first_cell_height"
            raise InputError(what, where="bed.obstacles", remedy=remedy)
        where = "bed.profile" if self.profile else "bed"
        raise InputError(
            what, where=where, remedy="take corners apart that nearly coincide"
        )

    @property
    def cost_s(self) -> float:
        """Wall time on one core, s: 0.2 for mesh and start, then 1e6 cell-iterations a second."""
        near, far = min(NEAR, self.lid / 2) * self.height_m, self.growth_far
        up = log(1 + near / self.first_cell_m * (self.growth - 1)) / log(self.growth)
        last = self.first_cell_m * self.growth**up
        up += log(1 + (self.lid * self.height_m - near) / last * (far - 1)) / log(far)
        return 0.2 + self._iterations * sum(self.grid.cells) * up / 1e6

    @property
    def _iterations(self) -> float:
        from_log_law = 1.0 if self.needs else self.settings.cells_per_face / 40.0
        return (80.0 + 0.04 * self.slope_deg**2) * from_log_law

    def share(self, directory: Path) -> float:
        """Iterations over those that are expected, at most nearly all."""
        path = directory / "log.simpleFoam"
        text = (
            path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
        )
        return min(text.count("\nTime = ") / self._iterations, 0.95)

    def versions(self) -> dict[str, str]:
        """The programs that mesh and solve."""
        return {"gmsh": installed("gmsh"), "openfoam": openfoam.version()}

    def write(self, directory: Path, cases: Path) -> None:
        """Write numbers into the template's files, the mesh, and a flow to start from."""
        coarser = [SolvedFlow(cases / flow.name) for flow in self.needs]
        self.write_from(directory, coarser[0] if coarser else None)

    def write_from(self, directory: Path, coarser: SolvedFlow | None) -> None:
        """Write all that; the flow to start from is that on half the cells, else the log layer."""
        settings, lid_m = self.settings, self.lid * self.height_m
        # an iteration carries a change past some twenty cells: with more of them along the bed the
        # flow still changes at a residual at which that over a pile has ended
        residual = RESIDUAL * min(1.0, CELLS_ALONG / sum(self.grid.cells))
        h, closed = self.height_m, settings.top == "closed channel"
        heights = {
            "speedHeight": SPEED_HEIGHT * h,
            "lidHeight": lid_m,
            "columnOffset": -h,
        }
        wall = {"firstCentre": self._first_centre, "roughnessLength": self.roughness_m}
        fluid = {"freeStream": settings.speed, "viscosity": self.viscosity_m2_s}
        models = {
            "turbulence": settings.turbulence_model,
            "convection": settings.convection_scheme,
        }
        ends = {
            "correctors": settings.non_orthogonal_correctors,
            "residual": f"{residual:.3g}",
        }
        every = {
            "top": TOPS[settings.top],
            **heights,
            **wall,
            **fluid,
            **models,
            **ends,
        }
        set_values(directory / "parameters", every)
        form = {
            "slope_deg": self.slope_deg,
            "height": h,
            "lid": lid_m,
            "closed": int(closed),
        }
        cells = {"first_cell": self.first_cell_m, "growth": self.growth}
        set_values(
            directory / "parameters.geo",
            {**form, **cells, "growth_far": self.growth_far},
        )
        self.grid.write(directory / "bed_line.geo")
        if self.profile:
            (directory / "profile.csv").write_text(self.profile.text, encoding="utf-8")
        types = {**PATCHES, "inlet": PATCHES["inlet"].format(-h)}
        types |= {"lid": "wall"} if closed else {}
        (directory / "pile.msh").unlink()  # the mesh of the template
        middles = write_poly_mesh(made_by_gmsh(directory), directory, types)
        x, z = middles[:, 0, 0], middles[..., 2]
        if coarser:
            line, omega = self.bed_line, settings.turbulence_model == "kOmegaSST"
            for name in ("U", "p", "k", "nut", "omega" if omega else "epsilon"):
                values = coarser.at(name, x, z - line.height(x)[:, None], line)
                start_from(directory / "0" / name, values, INTERPOLATED_DIGITS)
        else:
            # a third of the iterations from a uniform flow
            ustar, over = self.ustar0_m_s, np.abs(z.ravel())
            speed = log_law_speed(ustar, over, self.roughness_m)
            start_from(
                directory / "0/U", np.column_stack([speed, 0 * speed, 0 * speed])
            )
            frequency = ustar / (KARMAN * (over + self.roughness_m))
            start_from(directory / "0/epsilon", ustar**2 * frequency)
            start_from(directory / "0/omega", frequency / np.sqrt(0.09))

    @property
    def _first_centre(self) -> float:
        """Height of the centre of the first cells over flat bed, m."""
        return self.first_cell_m / 2 / cos(radians(self.slope_deg))

    def collect(self, directory: Path) -> None:
        """Check the run and write `wall_stress.csv` and `diagnostics.csv`, or say why it failed."""
        openfoam.check_log(directory)
        solved = SolvedFlow(directory)
        solved.check()
        stress = solved.stress(self.roughness_m)
        self._check_stress(stress, directory)
        stress.to_csv(directory / WALL_STRESS)
        approach, reynolds = (
            solved.ustar0 / self.ustar0_m_s,
            self.ustar0_m_s / self.viscosity_m2_s,
        )
        speed = self.mean_speed_over_log_law(solved) if self.settings.depth else None
        bed = (self.slope_deg, self.height_m, self.roughness_m)
        table = diagnostics(stress, approach, reynolds, *bed, mean_speed=speed)
        table.to_csv(directory / DIAGNOSTICS, float_format="%.6g", lineterminator="\n")
        if table.loc["approach_ustar_over_log_law", "sound"] != "yes":
            what = f"on flat bed u* is {approach:.3f} of the log law's: the wall function fails"
            remedy = (
                f"{DIAGNOSTICS} says more; raise the first cell's height or the speed"
            )
            raise SolverError(what, where=str(directory), remedy=remedy)

    def mean_speed_over_log_law(self, solved: SolvedFlow) -> float:
        """The mean speed of a channel in the column before the inlet over that of the log law."""
        closed, depth = self.settings.top == "closed channel", self.lid * self.height_m
        law = depth_mean_speed(solved.ustar0, depth, self.roughness_m, closed=closed)
        return float(solved.column_speed() / law)

    def _check_stress(self, stress: WallStress, directory: Path) -> None:
        if not np.isfinite([stress.tau_wall, stress.ustar_over_ustar0_eq10]).all():
            raise Exploded(
                "the stress on the bed is not a number", where=str(directory)
            )
        line = self.bed_line
        segment = np.clip(
            np.searchsorted(line.x, stress.x_m) - 1, 0, len(line.slopes_deg) - 1
        )
        over = (
            stress.z_e_m
            / np.cos(np.radians(line.slopes_deg[segment]))
            / self._first_centre
        )
        if not 0.98 < over.min() <= over.max() < 1.02:
            what = f"z_e is {over.min():.3g} to {over.max():.3g} of that of the first cells"
            remedy = "lower flow.expansion_ratio, or raise flow.first_cell_height"
            raise SolverError(what, where=str(directory), remedy=remedy)


def set_values(path: Path, values: Mapping[str, object]) -> None:
    """Replace the values in a template's list; its comments stay. Numbers get nine digits."""
    text = path.read_text(encoding="utf-8")
    for name, value in values.items():
        new = digits.text(value) if isinstance(value, float) else value
        text, count = re.subn(rf"(?m)^({name}[ =]+)[^;]+;", rf"\g<1>{new};", text)
        if count != 1:
            raise ValueError(f"{path.name} has {count} entries named {name}")
    path.write_text(text, encoding="utf-8")
