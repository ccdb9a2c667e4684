"""One scene: a fluid, its grains, their bed, the flow and the protocol."""

import re
from functools import cached_property
from itertools import pairwise
from math import acos, cos, degrees, radians
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from orchestrator.physics.constants import KARMAN
from orchestrator.physics.laws import LAWS
from orchestrator.physics.log_law import log_law_ustar
from orchestrator.physics.threshold import weight
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.study.parts import (
    Bed,
    Flow,
    Fluid,
    Forces,
    Grain,
    GrainBed,
    Part,
    PileBed,
    Protocol,
    UnfitError,
)
from orchestrator.study.profile import Profile
from orchestrator.study.sizes import Sizes, largest, percentile

BUILDABLE_DEG = (2.0, 60.0)
"""Slopes of piles that can be meshed and packed."""
SOLVE_VISCOSITY = 1e-5
"""Kinematic viscosity at which flows are solved, m2/s, where it is low enough for their cells."""
VISCOUS_CELLS = 2.5
"""Height of the first cell over nu/(kappa u*_0): at its centre the flow is turbulent."""
LEAST_DEPTH = 3.0
"""Least depth of a channel, heights of the forms: the rows of its mesh are level at half of it."""
MOST_POURED_STIFFNESS = 1e5
"""K d/W of a deck on a poured bed, ten times that of the pouring: contacts give back 0.05 W d."""
LEAST_WIDTH = 3.0
"""Least width of a strip, diameters of its largest grain: none touches another from both sides."""
MOST_GRAINS = 1e5
"""Largest length of a bed, diameters."""
NARROWEST_OVER_D, NARROWEST_OVER_CELL = 0.1, 0.05
"""Least distance of two points of a profile, over the diameter and over the height of the first
cell. Nearer ones make columns of cells in which the flow does not converge: on a triangle of 15 deg
a second point at 0.05 of the first cell moves thresholds by 1 to 2 %, at 0.0002 by half."""
ROUGHEST = 1 / 3
"""Largest z0 over the diameter of the bed's grains. Sparse spheres have about 1/7, the largest
ratio measured; above 1/3 a grain would lie where the mean flow of the log law is at rest."""
FORMS = ("triangle", "dune", "cosine", "gaussian", "rushil", "trapezoid")
FIELDS_OF_SHAPES = {
    "windward": ("dune",),
    "brink_radius": ("dune",),
    "lee_slope_deg": ("triangle", "dune", "trapezoid", "step down"),
    "length": ("trapezoid", "step up", "step down", "flat"),
    "forms": FORMS,
    "spacing": FORMS,
}
"""Fields that some shapes alone have."""


class Scene(Part):
    """One point of a study.

    Raises
    ------
    pydantic.ValidationError
        Naming each field that is missing, unknown, of the wrong type or out of range.
    """

    fluid: Fluid = Fluid()
    grain: Grain
    bed: Annotated[GrainBed | PileBed, Field(discriminator="kind")]
    flow: Flow = Flow()
    forces: Forces = Forces()
    protocol: Protocol = Protocol()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        check_density(self.grain.density, self.fluid.density)
        bed_grains = self.grain.diameter / self.bed.relative_size
        check_roughness(self.bed, bed_grains * largest(self.grain.sizes, self.grain.diameter))
        check_method(self.forces.law, self.protocol.method)
        if self.grain.sizes is not None and not self.is_poured:
            what = "a lattice has equal grains: a mixture needs a poured bed"
            raise UnfitError("grain.sizes", what, 'bed.packing = "poured", or leave it out')
        if isinstance(self.bed, PileBed) and self.bed.width:
            self._check_strip(self.bed)
        if self.is_poured and self.protocol.method == "dem":
            check_poured_stiffness(self.grain.stiffness)
        if self.forces.exposure == "protrusion":
            check_protrusion(self.forces.law, is_poured=self.is_poured)
        if isinstance(self.bed, PileBed):
            check_pile(self.bed, self.grain.diameter)
            check_top(self.flow, self.bed)
            if self.flow.model == "solve":
                check_mesh(self.bed.relief, self.first_cell_height)
            if self.bed.profile:
                cell = self.first_cell_height if self.flow.model == "solve" else 0.0
                check_points(self.bed.profile, self.grain.diameter, cell)
        else:
            check_grain(self.bed, self.grain.diameter)
        if self.protocol.update:
            self._check_update()
        return self

    def _check_strip(self, bed: PileBed) -> None:
        """A strip in space is poured, wider than its grains, and known to few methods."""
        if bed.packing != "poured":
            what = "a lattice is one layer in the plane of the flow"
            raise UnfitError("bed.width", what, 'bed.packing = "poured", or leave it out')
        least = LEAST_WIDTH * largest(self.grain.sizes, self.grain.diameter)
        if bed.width < least:
            what = f"{bed.width:g} d is less than {LEAST_WIDTH:g} of the largest grains"
            raise UnfitError(
                "bed.width", what, f"at least {least:.4g}, or 0 for a bed in the plane"
            )
        if self.protocol.method == "peeling":
            what = "the method peeling knows grains in the plane of the flow alone"
            raise UnfitError("bed.width", what, 'protocol.method = "dem" or "pivot", or width 0')
        if self.protocol.update:
            what = "a bed that changes is one layer in the plane of the flow"
            raise UnfitError("bed.width", what, "leave it or protocol.update out")

    def _check_update(self) -> None:
        """A bed that changes needs a flow that sees a row go, and grains that free others."""
        never = "leave it out"
        if not isinstance(self.bed, PileBed):
            raise UnfitError("protocol.update", "a single grain leaves no bed that changes", never)
        if self.flow.model != "solve":
            what = f'the flow model "{self.flow.model}" knows no bed that changes'
            raise UnfitError("protocol.update", what, f'flow.model = "solve", or {never}')
        if self.protocol.method == "pivot":
            what = "each grain by itself frees no other"
            raise UnfitError("protocol.update", what, f'the method "peeling" or "dem", or {never}')
        if self.first_cell_height > self.grain.diameter:
            what = f"the first cell, {self.first_cell_height:g} m, is higher than a grain"
            remedy = f"set flow.first_cell_height to at most the diameter, or {never}"
            raise UnfitError("protocol.update", what, remedy)

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
        return float(
            weight(
                diameter=self.grain.diameter,
                density=self.grain.density,
                fluid_density=self.fluid.density,
                gravity=self.fluid.gravity,
            )
        )

    @property
    def limiting_slope_deg(self) -> float:
        """Slope beyond which a grain slides or rolls back without any flow, degrees."""
        return min(self.grain.friction_angle_deg, 90 - self.pocket_angle_deg)

    @property
    def pocket_angle_deg(self) -> float:
        """Angle at which a grain leaves its pocket, degrees: beta, of equal grains."""
        if self.bed.relative_size == 1.0:
            return self.bed.entrainment_angle_deg
        return degrees(acos(pocket_cosine(self.bed)))

    @property
    def solve_roughness(self) -> float:
        """z0 at which the flow over a pile is solved, m."""
        return self.flow.roughness or self.bed.roughness

    @property
    def first_cell_height(self) -> float:
        """Height of the flow's first cell on the bed of a pile, m."""
        assert isinstance(self.bed, PileBed)
        if self.flow.first_cell_height:
            return self.flow.first_cell_height
        viscous = (self.flow.viscosity or 0.0) / self._eddy_viscosity
        return default_first_cell_height(self.bed.relief, self.solve_roughness, viscous)

    @property
    def solve_viscosity(self) -> float:
        """Kinematic viscosity at which the flow over a pile is solved, m2/s."""
        if self.flow.viscosity:
            return self.flow.viscosity
        most = self._eddy_viscosity * self.first_cell_height / VISCOUS_CELLS
        return min(SOLVE_VISCOSITY, float(f"{most:.3g}"))

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


def check_roughness(bed: Bed, diameter: float) -> None:
    """The roughness length belongs to the grains of the bed, the largest of which are given."""
    if bed.roughness > ROUGHEST * diameter * (1 + 1e-9):
        what = f"z0 = {bed.roughness:g} m is above a third of the bed's grains of {diameter:g} m"
        raise UnfitError("bed.roughness", f"{what}, rougher than any grains lie", "typical: d/30")


def check_grain(bed: Bed, diameter: float) -> None:
    """A single grain must stand out of the roughness and lie on its neighbours."""
    if bed.roughness >= diameter:
        raise UnfitError("bed.roughness", "z0 is not below the grain's diameter", "typical: d/30")
    if pocket_cosine(bed) >= 1:
        raise UnfitError(
            "bed.relative_size",
            f"a grain of {bed.relative_size:g} d falls between neighbours that are"
            f" {2 * cos(radians(bed.entrainment_angle_deg)):.3g} d apart",
            "raise it, or bed.entrainment_angle_deg",
        )


def check_density(density: float, fluid_density: float) -> None:
    """A grain must sink."""
    if density <= fluid_density:
        raise UnfitError(
            "grain.density",
            f"{density:g} kg/m3 is not above the fluid's {fluid_density:g} kg/m3",
            "the grain would float; raise it, or lower fluid.density",
        )


def check_method(law: str, method: str) -> None:
    """A grain feels forces in DEM and in peeling, no torque."""
    if law in LAWS and LAWS[law].turns and method != "pivot":
        raise UnfitError(
            "forces.law",
            f"{law} turns the grain about its centre, which the method {method} leaves out",
            'choose the method "pivot", or a force law without torque',
        )


def check_poured_stiffness(stiffness: float) -> None:
    """Grains that are poured lie in one another as far as their stiffness then lets them."""
    if stiffness > MOST_POURED_STIFFNESS:
        raise UnfitError(
            "grain.stiffness",
            f"poured grains lie in one another by some 1e-3 d: springs of {stiffness:.3g} W/d throw"
            " them apart",
            f"at most {MOST_POURED_STIFFNESS:g}",
        )


def check_protrusion(law: str, *, is_poured: bool) -> None:
    """Grains stand at heights of their own on a poured bed alone, under some laws."""
    if not is_poured:
        what = "the grains of a lattice stand alike"
        raise UnfitError("forces.exposure", what, 'bed.packing = "poured", or leave it out')
    if law in LAWS and not LAWS[law].protrudes:
        known = ", ".join(name for name, one in LAWS.items() if one.protrudes)
        what = f"{law} knows no height of a grain over the bed"
        raise UnfitError("forces.exposure", what, f"laws that do: {known}")


def check_pile(bed: PileBed, diameter: float) -> None:
    """Refuse piles whose mesh or packing cannot be built."""
    if bed.relative_size != 1:
        raise UnfitError(
            "bed.relative_size", "it is of a single grain on its neighbours", "leave it out"
        )
    if not bed.profile:
        check_shape(bed)
    elif (length := bed.profile.x[-1]) > MOST_GRAINS * diameter:
        what = f"{length:g} m are {length / diameter:.0f} grains of {diameter:g} m"
        raise UnfitError("bed.profile", what, "are its columns in mm? or cut a part out of it")
    for one, other in pairwise(sorted(bed.obstacles, key=lambda one: one.x)):
        if other.x - one.x < one.reach + other.reach:
            what = f"{one} and {other} overlap"
            raise UnfitError("bed.obstacles", what, "move one of them")
    if bed.height < 5 * diameter:
        raise UnfitError(
            "bed.height",
            f"{bed.height:g} m is less than five grains of {diameter:g} m",
            "a pile needs some rows, and lengths on a flat bed are parts of it: raise bed.height or"
            " lower grain.diameter",
        )


def check_points(profile: Profile, diameter: float, first_cell: float) -> None:
    """Two points of a profile lie no nearer to one another than grains and mesh can follow."""
    steps = np.hypot(np.diff(profile.x), np.diff(profile.z))
    near = int(np.argmin(steps))
    least = max(NARROWEST_OVER_D * diameter, NARROWEST_OVER_CELL * first_cell)
    if steps[near] < least:
        line = f"line {profile.lines[near + 1]}, " if profile.lines else ""
        raise UnfitError(
            "bed.profile",
            f"{profile.name}, {line}x = {profile.x[near + 1]:.6g} m: {steps[near]:.2g} m from the"
            f" point before it, nearer than {least:.2g} m",
            f"leave out one of the two, or {'give' if line else 'raise'} bed.smoothing",
        )


def check_top(flow: Flow, bed: PileBed) -> None:
    """The top of the flow is well above the forms and the obstacles."""
    height = bed.relief
    top = flow.depth or flow.lid * height
    for obstacle in bed.obstacles:
        if top < LEAST_DEPTH * obstacle.height:
            what = f"{obstacle} under a flow {top:g} m deep"
            remedy = f"at most a part of 1/{LEAST_DEPTH:g} of that, or raise the depth or flow.lid"
            raise UnfitError("bed.obstacles", what, remedy)
    if flow.top == "boundary layer":
        if flow.depth:
            remedy = 'leave it out, or choose flow.top = "open water"'
            raise UnfitError("flow.depth", "a boundary layer has none", remedy)
        return
    if not flow.depth:
        raise UnfitError("flow.depth", f"the depth of {flow.top} is missing", "give it, in m")
    if flow.depth < LEAST_DEPTH * height:
        what = f"{flow.depth:g} m is less than {LEAST_DEPTH:g} heights of the forms, {height:g} m"
        raise UnfitError("flow.depth", what, "raise it, or lower bed.height")
    if flow.model not in ("solve", "flat"):
        what = f"the theory {flow.model} is of a flow without a top"
        raise UnfitError("flow.model", what, 'choose "solve" or "flat"')


def check_shape(bed: PileBed) -> None:
    """Check the forms and their grains."""
    low, high = BUILDABLE_DEG
    rises = bed.shape not in ("flat", "step down")
    if rises and not low <= bed.slope_deg <= high:
        raise UnfitError(
            "bed.slope_deg", f"a pile of {bed.slope_deg:g} deg", f"choose {low:g} ... {high:g} deg"
        )
    if bed.smoothing:
        raise UnfitError("bed.smoothing", "it is of a profile", "leave it out")
    for field, shapes in FIELDS_OF_SHAPES.items():
        if getattr(bed, field) != PileBed.model_fields[field].default and bed.shape not in shapes:
            what = f"{_a(bed.shape)} has none"
            raise UnfitError(f"bed.{field}", what, f"leave it out; it is of: {', '.join(shapes)}")
    if not rises and bed.slope_deg:
        raise UnfitError("bed.slope_deg", f"{_a(bed.shape)} does not rise", "leave it out")
    if bed.spacing and bed.forms == 1:
        raise UnfitError("bed.spacing", "one form has no neighbour", "raise bed.forms")


def _a(shape: str) -> str:
    return f"a {shape}" if shape != "flat" else "a flat bed"


def check_mesh(height: float, first_cell_height: float) -> None:
    """The mesh must resolve the pile."""
    if first_cell_height > height / 4:
        raise UnfitError(
            "flow.first_cell_height",
            f"{first_cell_height:g} m is above a quarter of the pile's {height:g} m",
            "lower it, or raise bed.height",
        )


def default_first_cell_height(height: float, roughness: float, viscous: float = 0.0) -> float:
    """Height of the first cell on the bed of a pile, m.

    The finer the better, but its centre z_e must not lie in the roughness, and where the eddy
    viscosity is below the molecular one, `viscous` = nu/(kappa u*_0), the flow is not turbulent.
    h/4 is the end.
    """
    return min(max(height / 40, 2.5 * roughness, VISCOUS_CELLS * viscous), height / 4)


def roughness_length(value: Any, diameter: float, mixture: Sizes | None = None) -> Any:
    """A roughness in metres, from a number or from a part of the diameter such as ``"d/30"``.

    In a mixture d is the median; ``"d84/30"`` is a part of the diameter that 84 % of the mass are
    finer than.
    """
    if not isinstance(value, str):
        return value
    match = re.fullmatch(r"\s*d([1-9]\d)?\s*/\s*(\d+(?:\.\d+)?)\s*", value)
    if not match or float(match[2]) == 0:
        raise UnfitError("bed.roughness", f"{value!r} is not a length", 'write metres, or "d/30"')
    # rounded, so that d/10 of one grain and d/30 of another are one length and share a flow
    of = percentile(mixture, diameter, int(match[1]) / 100) if match[1] else diameter
    return float(f"{of / float(match[2]):.12g}")
