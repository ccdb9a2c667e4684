"""One scene: a fluid, its grains, their bed, the flow and the protocol."""

import re
from functools import cached_property
from itertools import pairwise
from math import acos, cos, degrees, radians
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from orchestrator.physics.constants import KARMAN
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import weight
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.study import sizes
from orchestrator.study.part import Part, UnfitError
from orchestrator.study.parts import Bed, Flow, Fluid, Forces, Grain, GrainBed, PileBed, Protocol
from orchestrator.study.shapes import SHAPES

BUILDABLE_DEG = (2.0, 60.0)  # slopes of piles that can be meshed and packed
SOLVE_VISCOSITY = 1e-5  # at which flows are solved, m2/s, where it is low enough for their cells
VISCOUS_CELLS = 2.5  # first cell over nu/(kappa u*_0): at its centre the flow is turbulent
LEAST_DEPTH = 3.0
"""Least depth of a flow over the height of forms and obstacles: the rows of its mesh are level at
half of it."""
MOST_POURED_STIFFNESS = 1e5
"""K d/W of a deck on a poured bed, ten times that of the pouring: grains that lie in one another by
1e-3 d are thrown apart by stiffer springs."""
LEAST_WIDTH = 3.0
"""Least width of a strip, diameters of its largest grain: none touches another from both sides."""
MOST_GRAINS = 1e5  # largest length of a bed, diameters
NARROWEST_OVER_D, NARROWEST_OVER_CELL = 0.1, 0.05
"""Least distance of two points of a profile, over the diameter and over the height of the first
cell. Nearer ones make columns of cells in which the flow does not converge: on a triangle of 15 deg
a second point at 0.05 of the first cell moves thresholds by 1 to 2 %, at 0.0002 by half."""
ROUGHEST = 1 / 3  # largest z0 over the diameter of the bed's grains; measured are up to 1/7
LEAST_UPDATE = 0.02  # least part of the grains between two solves of the flow


class Scene(Part):
    """One point of a study; a `pydantic.ValidationError` names each field that is wrong."""

    fluid: Fluid = Fluid()
    grain: Grain
    bed: Annotated[GrainBed | PileBed, Field(discriminator="kind")]
    flow: Flow = Flow()
    forces: Forces = Forces()
    protocol: Protocol = Protocol()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        grain, bed, law, protocol = self.grain, self.bed, LAWS.get(self.forces.law), self.protocol
        d, z0, is_raised = grain.diameter, bed.roughness, self.forces.exposure == "protrusion"
        if grain.sizes is not None:
            sizes.check(grain.sizes, d)
        if grain.density <= self.fluid.density:
            what = f"{grain.density:g} kg/m3 is not above the fluid's {self.fluid.density:g} kg/m3"
            raise UnfitError("grain.density", what, "raise it, or lower fluid.density")
        bed_grains = d / bed.relative_size * sizes.extremes(grain.sizes, d)[1]
        if z0 > ROUGHEST * bed_grains * (1 + 1e-9) or z0 >= d:
            what = f"{z0:g} m is above a third of the bed's grains of {bed_grains:g} m, or above d"
            raise UnfitError("bed.roughness", what, "typical: d/30")
        if law and law.turns and protocol.method != "pivot":
            what = (
                f"{law.name} turns the grain about its centre, which {protocol.method} leaves out"
            )
            raise UnfitError("forces.law", what, 'choose the method "pivot", or another law')
        if law and is_raised and not law.protrudes:
            names = ", ".join(name for name, each in LAWS.items() if each.protrudes)
            raise UnfitError("forces.exposure", f"{law.name} knows none", f"laws that do: {names}")
        width = bed.width if isinstance(bed, PileBed) else 0.0
        of_poured = {"grain.sizes": grain.sizes, "forces.exposure": is_raised, "bed.width": width}
        for name, value in of_poured.items():
            if value and not self.is_poured:
                raise UnfitError(
                    name, "it is of poured beds", 'bed.packing = "poured", or leave it out'
                )
        if self.is_poured and protocol.method == "dem" and grain.stiffness > MOST_POURED_STIFFNESS:
            what = f"springs of {grain.stiffness:.3g} W/d throw poured grains apart"
            raise UnfitError("grain.stiffness", what, f"at most {MOST_POURED_STIFFNESS:g}")
        if 0 < protocol.update < LEAST_UPDATE:
            remedy = f"each update is a solve of the flow: 0, or at least {LEAST_UPDATE:g}"
            raise UnfitError("protocol.update", f"{protocol.update:g} of the grains", remedy)
        if isinstance(bed, PileBed):
            self._check_bed(bed)
            self._check_flow(bed)
        elif pocket_cosine(bed) >= 1:
            what = f"a grain of {bed.relative_size:g} d falls between its neighbours"
            raise UnfitError("bed.relative_size", what, "raise it, or bed.entrainment_angle_deg")
        elif protocol.update:
            raise UnfitError("protocol.update", "a single grain leaves no bed that changes")
        return self

    def _check_bed(self, bed: PileBed) -> None:
        d, profile, (low, high) = self.grain.diameter, bed.profile, BUILDABLE_DEG
        least = LEAST_WIDTH * sizes.extremes(self.grain.sizes, d)[1]
        if bed.width and (self.protocol.method == "peeling" or self.protocol.update):
            raise UnfitError("bed.width", "peeling and protocol.update know beds in a plane alone")
        if 0 < bed.width < least:
            remedy = f"at least {least:.4g}, or 0: a bed in the plane"
            raise UnfitError("bed.width", "less than three of the largest grains", remedy)
        if bed.relative_size != 1:
            raise UnfitError("bed.relative_size", "it is of a single grain on its neighbours")
        if bed.spacing and bed.forms == 1:
            raise UnfitError("bed.spacing", "one form has no neighbour", "raise bed.forms")
        if bed.height < 5 * d:
            what = f"{bed.height:g} m is less than five grains of {d:g} m"
            raise UnfitError("bed.height", what, "raise bed.height, or lower grain.diameter")
        for obstacle, other in pairwise(sorted(bed.obstacles, key=lambda each: each.x)):
            if other.x - obstacle.x < obstacle.reach + other.reach:
                raise UnfitError("bed.obstacles", f"{obstacle} and {other} overlap", "move one")
        if profile is None:
            if bed.form.rises and not low <= bed.slope_deg <= high:
                what, remedy = (
                    f"a pile of {bed.slope_deg:g} deg",
                    f"choose {low:g} ... {high:g} deg",
                )
                raise UnfitError("bed.slope_deg", what, remedy)
            if bed.slope_deg and not bed.form.rises:
                raise UnfitError("bed.slope_deg", f"the shape {bed.shape} does not rise")
            if bed.smoothing:
                raise UnfitError("bed.smoothing", "it is of a profile")
            for name, declared in PileBed.model_fields.items():
                shapes = [shape for shape, facts in SHAPES.items() if name in facts.fields]
                if shapes and bed.shape not in shapes and getattr(bed, name) != declared.default:
                    remedy = f"leave it out; it is of: {', '.join(shapes)}"
                    raise UnfitError(f"bed.{name}", f"the shape {bed.shape} has none", remedy)
        elif (length := profile.x[-1]) > MOST_GRAINS * d:
            what = f"{length:g} m are {length / d:.0f} grains of {d:g} m"
            raise UnfitError("bed.profile", what, "are its columns in mm? or cut a part out of it")
        else:
            steps = np.hypot(np.diff(profile.x), np.diff(profile.z))
            near, cell = int(np.argmin(steps)), self.first_cell_height
            cells = NARROWEST_OVER_CELL * cell if self.flow.model == "solve" else 0.0
            if steps[near] < (least := max(NARROWEST_OVER_D * d, cells)):
                what = f"{profile.name}, x = {profile.x[near + 1]:.6g} m: nearer than {least:.2g} m"
                remedy = "leave out a point, or raise bed.smoothing"
                raise UnfitError("bed.profile", f"{what} to the point before it", remedy)

    def _check_flow(self, bed: PileBed) -> None:
        flow, cell, update = self.flow, self.first_cell_height, self.protocol.update
        depth = flow.depth or flow.lid * bed.relief
        highest = max([bed.relief, *(obstacle.height for obstacle in bed.obstacles)])
        if (flow.top == "boundary layer") == bool(flow.depth):
            what = f"{flow.top} {'has none' if flow.depth else 'needs one, in m'}"
            raise UnfitError("flow.depth", what, 'only "open water" and "closed channel" have one')
        if depth < LEAST_DEPTH * highest:
            what = f"{depth:g} m is less than {LEAST_DEPTH:g} heights of the forms or obstacles"
            raise UnfitError("flow.depth" if flow.depth else "flow.lid", what, "raise it")
        if flow.depth and flow.model not in ("solve", "flat"):
            raise UnfitError("flow.model", "the theories have no top", 'choose "solve" or "flat"')
        if flow.model == "solve" and cell > bed.relief / 4:
            what = f"{cell:g} m is above a quarter of the pile's {bed.relief:g} m"
            raise UnfitError("flow.first_cell_height", what, "lower it, or raise bed.height")
        if update and (flow.nodes or flow.model != "solve" or self.protocol.method == "pivot"):
            remedy = 'flow.model "solve" without nodes and the method "dem", or leave it out'
            raise UnfitError(
                "protocol.update", "this flow or method knows no bed that changes", remedy
            )
        if update and cell > self.grain.diameter:
            what = f"the first cell, {cell:g} m, is higher than a grain"
            raise UnfitError("protocol.update", what, "lower flow.first_cell_height")

    @cached_property
    def id(self) -> str:
        """Digest of the scene's canonical JSON."""
        return digest_text(canonical_json(self.model_dump(mode="json")))[:12]

    @property
    def is_poured(self) -> bool:
        """Whether its bed is poured by LIGGGHTS."""
        return isinstance(self.bed, PileBed) and self.bed.packing == "poured"

    @property
    def reduced_gravity(self) -> float:
        """Gravity of the submerged grain, g' = g (rho_sol - rho_f)/rho_sol, m/s2."""
        return self.fluid.gravity * (1 - self.fluid.density / self.grain.density)

    @property
    def weight(self) -> float:
        """Submerged weight W of a grain, N."""
        fluid = {"fluid_density": self.fluid.density, "gravity": self.fluid.gravity}
        return float(weight(diameter=self.grain.diameter, density=self.grain.density, **fluid))

    @property
    def limiting_slope_deg(self) -> float:
        """Slope beyond which a grain slides or rolls back without any flow, degrees."""
        return min(self.grain.friction_angle_deg, 90 - self.pocket_angle_deg)

    @property
    def pocket_angle_deg(self) -> float:
        """Angle at which a grain leaves its pocket, degrees: beta, of equal grains."""
        is_equal = self.bed.relative_size == 1.0
        beta = self.bed.entrainment_angle_deg
        return beta if is_equal else degrees(acos(pocket_cosine(self.bed)))

    @property
    def solve_roughness(self) -> float:
        """z0 at which the flow over a pile is solved, m."""
        return self.flow.roughness or self.bed.roughness

    @property
    def first_cell_height(self) -> float:
        """Height of the flow's first cell on the bed of a pile, m."""
        assert isinstance(self.bed, PileBed)
        viscous = (self.flow.viscosity or 0.0) / self._eddy_viscosity
        default = default_first_cell_height(self.bed.relief, self.solve_roughness, viscous)
        return self.flow.first_cell_height or default

    @property
    def solve_viscosity(self) -> float:
        """Kinematic viscosity at which the flow over a pile is solved, m2/s."""
        most = self._eddy_viscosity * self.first_cell_height / VISCOUS_CELLS
        return self.flow.viscosity or min(SOLVE_VISCOSITY, float(f"{most:.3g}"))

    @property
    def _eddy_viscosity(self) -> float:
        """Eddy viscosity of the undisturbed flow of the solve over the height, kappa u*_0, m/s."""
        assert isinstance(self.bed, PileBed)
        height = 10 * self.bed.relief
        return KARMAN * float(log_law_ustar(self.flow.speed, height, self.solve_roughness))


def pocket_cosine(bed: Bed) -> float:
    """Cosine of the angle at which a single grain leaves its pocket; above 1 it falls through.

    Its neighbours' centres are 2 d cos(beta) apart and (D + d)/2 from its own.
    """
    return 2 * cos(radians(bed.entrainment_angle_deg)) / (1 + bed.relative_size)


def default_first_cell_height(height: float, roughness: float, viscous: float = 0.0) -> float:
    """Height of the first cell on the bed of a pile, m.

    The finer the better, but its centre z_e must not lie in the roughness, and where the eddy
    viscosity is below the molecular one, `viscous` = nu/(kappa u*_0), the flow is not turbulent.
    h/4 is the end.
    """
    return min(max(height / 40, 2.5 * roughness, VISCOUS_CELLS * viscous), height / 4)


def roughness_length(text: str, diameter: float, mixture: sizes.Sizes | None = None) -> float:
    """A roughness in metres from a part of the diameter (m) such as ``"d/30"``.

    In a mixture d is the median; ``"d84/30"`` is a part of the diameter that 84 % of the mass are
    finer than.
    """
    match = re.fullmatch(r"\s*d([1-9]\d)?\s*/\s*(\d+(?:\.\d+)?)\s*", text)
    if not match or float(match[2]) == 0:
        raise UnfitError("bed.roughness", f"{text!r} is not a length", 'write metres, or "d/30"')
    # rounded, so that d/10 of one grain and d/30 of another are one length and share a flow
    size = sizes.percentile(mixture, diameter, int(match[1]) / 100) if match[1] else diameter
    return float(f"{size / float(match[2]):.12g}")
