"""The flow over one bed line as an OpenFOAM case, and what its last iteration holds."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import cos, log, radians
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator import digits
from orchestrator.bed.line import BedLine, PorousFence, triangle
from orchestrator.errors import InputError, SolverError
from orchestrator.flow.fence import fence_cells, write_fences
from orchestrator.flow.foam import (
    INTERPOLATED_DIGITS,
    SolvedFlow,
    flow_in,
    ordered,
    patch_types,
    start_from,
    write_poly_mesh,
    write_zones,
)
from orchestrator.flow.mesh import (
    NEAR,
    Grid,
    along,
    extended,
    growth_far,
    made_by_gmsh,
)
from orchestrator.flow.profiles import PROFILES, profiles, write_profiles
from orchestrator.flow.run import Approach, OpenFoamCase, set_values
from orchestrator.flow.stress import (
    MEAN_SPEED_ERROR,
    Diagnostic,
    WallStress,
    near_one,
    reattachment,
)
from orchestrator.physics.velocity import depth_mean_speed
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.study.method import FlowMethod
from orchestrator.study.parts import Flow
from orchestrator.study.profile import Profile
from orchestrator.types import FloatArray

RESIDUAL = 2e-4
"""Residual of p at which the mean stress on a pile is within 0.1 % of where it ends."""
CELLS_ALONG = 150
"""Cells along the bed up to which it is."""
FINE = 80
"""Cells of a face from which a flow starts from that on half of them."""
USUAL_CELLS = 40
"""Cells of a face for which the growth of cells and the iterations are given."""
LEAST_CELL = 0.04
"""Shortest cell along the bed, over the height of the first cells.

With cells of a hundredth the stress upstream was 3 to 12 % off, and up to fourfold with
cells of a thousandth."""
MOST_GROWTH = 3.0
"""Largest ratio of neighbouring cells: rows of more do not fit under a crest."""
LEAST_LID = 5.0
"""Lowest lid of a boundary layer, h: under lower ones iterations do not end."""
Z_E_ERROR = 0.02
"""Largest relative difference of z_e from half of the height of the first cells."""
CELL_ITERATIONS_PER_S = 1e6
START_S = 0.2
"""Time that mesh and start take, s."""
TOPS = {"boundary layer": "layer", "open water": "open", "closed channel": "closed"}
"""Words of the template for the top of the flow."""


@dataclass(frozen=True)
class FlowCase(OpenFoamCase[WallStress]):
    """Steady turbulent flow over a bed line, in a boundary layer or in a channel.

    The flow's u*/u*_0 depends on the shape, on z0/h, on the mesh, and hardly on U_e and
    nu. The slope of a channel drives it: a force on the water that u*_0^2 on each wall
    balances over a flat bed. The speed at 10 h is that of the log law with this u*_0,
    and need not be within the depth.

    Attributes
    ----------
    height_m
        Height h of the forms, m.
    slope_deg
        Steepest slope of the windward faces, degrees; 0 if there are none.
    settings
        The numbers of the solve, with the roughness, the viscosity and the first cell
        given.
    line
        The bed line, m; by default a triangle of the slope and the height, or a flat
        bed.
    profile
        A measured profile, of which the case gets a copy.
    above
        What is above the flow; it has no gusts.
    """

    height_m: float
    slope_deg: float
    settings: FlowMethod
    line: BedLine | None = None
    profile: Profile | None = field(default=None, compare=False)
    above: Flow = field(default_factory=Flow)

    kind: ClassVar[str] = "flow"
    derived: ClassVar[tuple[str, ...]] = (*OpenFoamCase.derived, PROFILES)
    needs_bulky: ClassVar[bool] = True
    mesher: ClassVar[str] = "gmsh"

    @property
    def parameters(self) -> dict[str, Any]:
        """The settings, the height and the slope, and a digest of the bed line."""
        # a flow without a porous fence is called as before there were any
        fences = self.bed_line.fences
        return {
            **({"fences": list(map(list, fences))} if fences else {}),
            **self.settings.model_dump(mode="json", exclude={"between"}),
            **self.above.model_dump(mode="json"),
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
        """Height of the cells on the bed, along its normal, m: twice z_e."""
        return float(self.settings.first_cell_height or np.nan)

    @property
    def lid(self) -> float:
        """Height of the lid, or depth of a channel, over the flat bed, h."""
        if self.above.depth:
            return self.above.depth / self.height_m
        return self.settings.lid

    @property
    def lid_m(self) -> float:
        """The same, m."""
        return self.lid * self.height_m

    @property
    def is_closed(self) -> bool:
        """Whether the flow has a wall above it."""
        return self.above.top == "closed channel"

    @property
    def approach(self) -> Approach:
        """The approaching flow, whose speed at 10 h need not be within the depth."""
        return Approach(
            self.settings.speed, self.height_m, self.roughness_m, self.viscosity_m2_s
        )

    @property
    def bed_line(self) -> BedLine:
        """The bed line, m, from the inlet to the outlet."""
        line = self.line or triangle(self.slope_deg, self.height_m)
        upstream = self.settings.upstream * self.height_m
        downstream = self.settings.downstream * self.height_m
        whole = extended(line, upstream, downstream)
        x, z = digits.on_grid(whole.corners, self.height_m).T.tolist()
        bare = digits.on_grid(np.reshape(whole.bare, (-1, 2)), self.height_m).tolist()
        ranges = tuple((start, end) for start, end in bare)
        fences = []
        for fence in whole.fences:
            lengths = digits.on_grid(fence[:3], self.height_m).tolist()
            start, end, height = lengths
            fences.append(PorousFence(start, end, height, fence.porosity))
        return replace(whole, x=tuple(x), z=tuple(z), bare=ranges, fences=tuple(fences))

    @cached_property
    def grid(self) -> Grid:
        """The grid lines of the mesh along it."""
        cells = self.settings.cells_per_face
        return along(self.bed_line, self.slope_deg, cells, self.growth)

    @cached_property
    def needs(self) -> tuple["FlowCase", ...]:
        """The flow on half the cells, from which that on a fine mesh starts."""
        # From the log layer the residuals end the iterations while a slow mode of the
        # whole domain still decays: at 80 cells a face the stress was off by up to 1.5
        # %.
        cells = self.settings.cells_per_face
        if cells < FINE:
            return ()
        coarser = self.settings.model_copy(update={"cells_per_face": cells // 2})
        return (replace(self, settings=coarser),)

    @property
    def growth(self) -> float:
        """Ratio of neighbouring cells: with twice the cells all are half as long."""
        exponent = USUAL_CELLS / self.settings.cells_per_face
        return float(self.settings.expansion_ratio**exponent)

    @property
    def growth_far(self) -> float:
        """The same far from the forms."""
        return growth_far(self.growth, self.settings.cells_per_face)

    def check_mesh(self) -> None:
        """Refuse settings and bed lines whose mesh cannot be made or not be solved on.

        Raises
        ------
        InputError
            If they are; it names the field.
        """
        if self.growth > MOST_GROWTH:
            ratio = f"{self.growth:.3g}, more than {MOST_GROWTH:g}"
            what = f"neighbouring cells differ by {ratio}"
            remedy = "lower it, or raise method.flow.cells_per_face"
            raise InputError(what, where="method.flow.expansion_ratio", remedy=remedy)
        if not self.above.depth and self.lid < LEAST_LID:
            what = f"{self.lid:g} is below {LEAST_LID:g} heights of the forms"
            raise InputError(what, where="method.flow.lid", remedy="raise it")
        shortest, start, end = self.grid.shortest
        if shortest >= LEAST_CELL * self.first_cell_m:
            return
        place = float(self.profile.place(start)) if self.profile else start
        what = (
            f"at x = {place:.9g} m the mesh needs cells {shortest:.2g} m long, far"
            f" shorter than its first cells are high, {self.first_cell_m:.2g} m"
        )
        if self._is_at_obstacle(start, end):
            where = "bed.obstacles"
            remedy = (
                "make the obstacle larger, leave it out,"
                " or lower method.flow.first_cell_height"
            )
        else:
            where = "bed.profile" if self.profile else "bed"
            remedy = "take corners apart that nearly coincide"
        raise InputError(what, where=where, remedy=remedy)

    def _is_at_obstacle(self, start: float, end: float) -> bool:
        """Whether a part of the bed, m, is within a first cell of an obstacle."""
        near = self.first_cell_m
        for foot, other_foot in self.bed_line.bare:
            if foot - near <= end and start <= other_foot + near:
                return True
        return False

    @property
    def cost_s(self) -> float:
        """Wall time on one core, s."""
        near = min(NEAR, self.lid / 2) * self.height_m
        over_first = near / self.first_cell_m
        up = log(1 + over_first * (self.growth - 1)) / log(self.growth)
        last = self.first_cell_m * self.growth**up
        over_last = (self.lid_m - near) / last
        up += log(1 + over_last * (self.growth_far - 1)) / log(self.growth_far)
        cells = self.grid.cells * up
        return START_S + self.iterations * cells / CELL_ITERATIONS_PER_S

    @property
    def iterations(self) -> float:
        """Expected number of iterations."""
        from_coarser_flow = 80.0 + 0.04 * self.slope_deg**2
        if self.needs:
            return from_coarser_flow
        return from_coarser_flow * (self.settings.cells_per_face / USUAL_CELLS)

    def write(self, directory: Path, cases: Path) -> None:
        """Write numbers into the template's files, the mesh, and a flow to start from.

        Parameters
        ----------
        directory
            The case, a copy of the template.
        cases
            The directory of all cases, with those that this one needs.
        """
        coarser = [SolvedFlow(cases / flow.name) for flow in self.needs]
        self.write_from(directory, coarser[0] if coarser else None)

    def write_from(self, directory: Path, coarser: SolvedFlow | None) -> None:
        """Write the inputs with a flow to start from.

        Parameters
        ----------
        directory
            The case, a copy of the template.
        coarser
            The flow on half the cells; None for the log layer.
        """
        self.write_parameters(directory, self._solver_values())
        set_values(directory / "parameters.geo", self._mesh_values())
        self.grid.write(directory / "bed_line.geo")
        if self.profile:
            (directory / "profile.csv").write_text(self.profile.text, encoding="utf-8")
        types = {**patch_types(-self.height_m), "sides": "empty"}
        if self.is_closed:
            types["lid"] = "wall"
        mesh = made_by_gmsh(directory)
        cells, middles = ordered(mesh)
        patches = {}
        for name, rows in mesh.cell_sets_dict.items():
            patches[name] = mesh.cells_dict["quad"][rows["quad"]]
        write_poly_mesh(directory, mesh.points, cells, patches, types)
        self._write_fences(directory, mesh.points[cells], middles)
        if coarser:
            self._start_from_flow(directory / "0", middles, coarser)
        else:
            heights = np.abs(middles[..., 2].ravel())
            self.approach.start(directory / "0", heights)

    def _write_fences(
        self, directory: Path, corners: FloatArray, middles: FloatArray
    ) -> None:
        """Write the porous fences, if there are any: their cells and their losses."""
        line = self.bed_line
        if not line.fences:
            return
        uppermost = np.argsort(corners[..., 2], axis=1)[:, -4:, None]
        upper = np.take_along_axis(corners, uppermost, axis=1).mean(axis=1)
        tops = (upper[:, 2] - line.height(upper[:, 0])).reshape(middles.shape[:2])
        fences = fence_cells(line, middles, tops)
        write_zones(directory, {one.name: one.cells for one in fences})
        write_fences(directory, fences)

    def _solver_values(self) -> dict[str, object]:
        """Values of the template's ``parameters``."""
        # An iteration carries a change past some twenty cells: with more of them along
        # the bed the flow still changes at a residual at which that over a pile has
        # ended.
        residual = RESIDUAL * min(1.0, CELLS_ALONG / self.grid.cells)
        return {
            "top": TOPS[self.above.top],
            "lidHeight": self.lid_m,
            "approachOffset": -self.height_m,
            "firstCentre": self._first_centre,
            "turbulence": self.settings.turbulence_model,
            "convection": self.settings.convection_scheme,
            "correctors": self.settings.non_orthogonal_correctors,
            "residual": f"{residual:.3g}",
        }

    def _mesh_values(self) -> dict[str, object]:
        """Values of the template's ``parameters.geo``."""
        return {
            "slope_deg": self.slope_deg,
            "height": self.height_m,
            "lid": self.lid_m,
            "closed": int(self.is_closed),
            "first_cell": self.first_cell_m,
            "growth": self.growth,
            "growth_far": self.growth_far,
        }

    def _start_from_flow(
        self, fields: Path, middles: FloatArray, coarser: SolvedFlow
    ) -> None:
        """Let the fields start from a flow over the same bed."""
        line = self.bed_line
        x = middles[:, 0, 0]
        heights = middles[..., 2] - line.height(x)[:, None]
        model = self.settings.turbulence_model
        rate = "omega" if model == "kOmegaSST" else "epsilon"
        for name in ("U", "p", "k", "nut", rate):
            values = coarser.at(name, x, heights, line)
            start_from(fields / name, values, INTERPOLATED_DIGITS)

    @property
    def _first_centre(self) -> float:
        """Height of the centre of the first cells over flat bed, m."""
        return self.first_cell_m / 2 / cos(radians(self.slope_deg))

    def stress(self, directory: Path) -> tuple[WallStress, float]:
        """Read the stress on the bed, as every flow's."""
        solved = flow_in(directory)
        solved.check()
        stress = solved.stress(self.roughness_m)
        self._check_first_cells(stress, directory)
        return stress, solved.ustar0

    def collect(self, directory: Path) -> None:
        """Check the run and write its tables, as every flow's, and its profiles."""
        super().collect(directory)
        found = profiles(flow_in(directory), self.bed_line)
        write_profiles(found, directory / PROFILES)

    def own_diagnostics(
        self, stress: WallStress, ustar0: float, directory: Path
    ) -> dict[str, Diagnostic]:
        """Collect where the flow reattaches, and the mean speed of a channel."""
        found = {
            "reattachment_over_h": reattachment(stress, self.slope_deg, self.height_m)
        }
        if self.above.depth:
            speed = flow_in(directory).column_speed()
            ratio = self.mean_speed_over_log_law(speed, ustar0)
            found["mean_speed_over_log_law"] = near_one(ratio, MEAN_SPEED_ERROR)
        return found

    def mean_speed_over_log_law(self, speed: float, ustar0: float) -> float:
        """The mean speed of a channel over that of the log law.

        Parameters
        ----------
        speed
            Mean speed in the column before the inlet, m/s.
        ustar0
            Friction velocity there, m/s.

        Returns
        -------
        float
            The ratio.
        """
        law = depth_mean_speed(
            ustar0, self.lid_m, self.roughness_m, closed=self.is_closed
        )
        return float(speed / law)

    def _check_first_cells(self, stress: WallStress, directory: Path) -> None:
        """Refuse first cells of another height."""
        line = self.bed_line
        segment = np.searchsorted(line.x, stress.x_m) - 1
        segment = np.clip(segment, 0, len(line.slopes_deg) - 1)
        slope = np.radians(line.slopes_deg[segment])
        over = stress.z_e_m / np.cos(slope) / self._first_centre
        is_right = over.min() > 1 - Z_E_ERROR and over.max() < 1 + Z_E_ERROR
        if not is_right:
            span = f"{over.min():.3g} to {over.max():.3g}"
            what = f"z_e is {span} of that of the first cells"
            lower = "lower method.flow.expansion_ratio"
            remedy = f"{lower}, or raise method.flow.first_cell_height"
            raise SolverError(what, where=str(directory), remedy=remedy)
