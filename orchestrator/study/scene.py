"""One scene: a fluid, its grains, their bed, the flow and the protocol; frozen, validated, SI.

The fields' names and defaults are the study file's too. Angles are in degrees and say so in their
names; everything else is in SI units or, where the comment says so, in units of the grain.
"""

import re
from functools import cached_property
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import weight
from orchestrator.runs.files import canonical_json, digest_text

Positive = Annotated[float, Field(gt=0)]
Packing = Literal["aligned", "horizontal", "disordered"]
Stress = Literal["wall", "eq10"]
Method = Literal["dem", "peeling", "pivot"]
Model = Literal["solve", "hill", "flat"]
Turbulence = Literal["kEpsilon", "RNGkEpsilon", "realizableKE", "kOmegaSST"]
Convection = Literal["linearUpwind", "upwind", "limitedLinear"]
Forced = Literal["exposed", "all but crest", "all but toe"]
BUILDABLE_DEG = (2.0, 60.0)
"""Slopes of piles that can be meshed and packed."""


class Part(BaseModel):
    """Base of a scene's parts: immutable, exact types, no unknown keys, no NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Fluid(Part):
    """The fluid; the default is the paper's air."""

    density: Positive = 1.0
    """rho_f, kg/m3"""
    viscosity: Positive = 1e-5
    """nu, kinematic, m2/s"""
    gravity: Positive = GRAVITY
    """g, m/s2"""


class Grain(Part):
    """Equal spheres and their contact law."""

    diameter: Positive
    """d, m"""
    density: Positive = 2500.0
    """rho_sol, kg/m3"""
    friction_angle_deg: Annotated[float, Field(gt=0, lt=90)] = 35.0
    """phi, Coulomb's"""
    stiffness: Annotated[float, Field(ge=1e2, le=1e9)] = 1e4
    """K d/W of the contact's spring, normal and tangential"""
    damping: Annotated[float, Field(ge=0, le=1)] = 0.1
    """damping ratio of a collision"""


class Bed(Part):
    """What every bed has. Subclasses say which grains it is made of."""

    slope_deg: Annotated[float, Field(ge=0, lt=90)] = 0.0
    """alpha; the flow goes up the slope"""
    entrainment_angle_deg: Annotated[float, Field(gt=0, le=60)] = 60.0
    """beta; the neighbours below a grain are 2 d cos(beta) apart"""
    roughness: Positive
    """z0, m; a study file may say "d/30" """


class GrainBed(Bed):
    """One grain on its two fixed neighbours, in an undisturbed boundary layer (paper, 3.1)."""

    kind: Literal["grain"] = "grain"


class PileBed(Bed):
    """A triangular pile of grains across the flow (paper, 3.2)."""

    kind: Literal["pile"]
    height: Positive = 0.02
    """h of the flow's bed line, m"""
    packing: Packing = "aligned"
    """rows along the windward slope, level rows, or rows along the slope with random gaps"""
    disorder: Annotated[float, Field(gt=0, le=0.2)] = 0.02
    """largest gap between two grains of the row under the four uppermost, d; if disordered"""
    seed: Annotated[int, Field(ge=0)] = 0
    """which of the many disordered packings; of a lattice 0 is itself, any other a twin with grains
    up to 1e-9 d aside: what its thresholds differ by is decided by round-off"""
    mobile_layers: Annotated[int, Field(ge=1, le=1000)] = 2
    """layers of the windward face that may move; below them the grains are fixed"""

    @property
    def is_twin(self) -> bool:
        """Whether it is a lattice but for shifts that matter to nothing but round-off."""
        return self.packing != "disordered" and self.seed > 0


class Flow(Part):
    """The flow over the bed, and how a grain feels it."""

    model: Model = "solve"
    """of a pile's flow: OpenFOAM; linear theory of a low hill; or u* = u*_0 as on a flat bed"""
    speed: Positive = 10.0
    """U_e at which the flow over a pile is solved, m/s; it is then scaled"""
    viscosity: Positive = 1e-5
    """nu of that solve, m2/s: the wall is rough, the fluid's own nu moves only the grain's Re*"""
    first_cell_height: Positive | None = None
    """of the mesh on the bed, m; default: `default_first_cell_height`"""
    cells_per_face: Annotated[int, Field(ge=10, le=400)] = 40
    """of the mesh along each face of the pile"""
    growth: Annotated[float, Field(gt=1, le=2)] = 1.1
    """of the mesh: ratio of neighbouring cells up from the bed and away from the pile, with 40
    along a face; it follows their number"""
    roughness: Positive | None = None
    """z0 of the solve, m, for beds of nearly the same one to share it; default: the bed's"""
    turbulence: Turbulence = "kEpsilon"
    """OpenFOAM's model of it"""
    convection: Convection = "linearUpwind"
    """OpenFOAM's scheme for the convection of U"""
    correctors: Annotated[int, Field(ge=0, le=5)] = 1
    """of the pressure for cells that are not orthogonal, in each iteration"""
    closure: str = "auto"
    """force law of the grains; auto: the paper's, Eq. 2 or Eq. 4 where each holds, else both"""
    lift_coefficient: Annotated[float, Field(ge=0)] = LIFT_COEFFICIENT
    """alpha_s"""
    stress: Stress = "wall"
    """the flow's wall stress, or Eq. 10 at the first cell"""
    average: Positive = 1 / 40
    """least bed length, over h, that a grain's stress is averaged on: the crest's own value never
    converges with the mesh"""
    forced: Forced = "exposed"
    """exposed grains of a pile that carry the flow's force: all, or without the topmost one, or
    without those on the lowest 5 % of the windward face"""

    @field_validator("closure")
    @classmethod
    def _is_known(cls, value: str) -> str:
        if value not in ("auto", *LAWS):
            known = ", ".join(("auto", *LAWS))
            raise UnfitError("flow.closure", f"unknown force law {value!r}", f"known: {known}")
        return value


class Protocol(Part):
    """How the threshold is found; by DEM the flow is raised in steps and held at each."""

    method: Method = "dem"
    """dem; peeling, without dynamics; or pivot, each grain by itself (Eq. 3 or 5)"""
    step: Annotated[float, Field(gt=0, le=0.2)] = 0.02
    """relative rise of u* from one hold to the next"""
    quiet: Annotated[float, Field(ge=1)] = 10.0
    """a hold ends when no grain has passed the marker for this long, in sqrt(d/g')"""
    marker: Annotated[float, Field(gt=0, le=0.5)] = 0.3
    """a grain has moved when displaced by this along the bed, in d"""
    until: Annotated[float, Field(gt=0, le=1)] = 0.9
    """the flow is raised until this fraction should have moved"""
    fractions: tuple[Annotated[float, Field(gt=0, le=1)], ...] = (0.1, 0.3, 0.5, 0.7)
    """n/N at which the thresholds of a pile are reported"""
    timestep: Annotated[float, Field(gt=0, le=2)] = 0.2
    """of the grains' integration, in sqrt(m/K)"""

    @field_validator("fractions", mode="before")
    @classmethod
    def _tuple_of_a_list(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value


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
    protocol: Protocol = Protocol()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        check_density(self.grain.density, self.fluid.density)
        if isinstance(self.bed, PileBed):
            check_pile(self.bed, self.grain.diameter)
            check_mesh(self.bed.height, self.first_cell_height)
        elif self.bed.roughness >= self.grain.diameter:
            raise UnfitError(
                "bed.roughness", "z0 is not below the grain's diameter", "typical: d/30"
            )
        return self

    @cached_property
    def id(self) -> str:
        """Digest of the scene's canonical JSON."""
        return digest_text(canonical_json(self.model_dump(mode="json")))[:12]

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
        return min(self.grain.friction_angle_deg, 90 - self.bed.entrainment_angle_deg)

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
        return default_first_cell_height(self.bed.height, self.solve_roughness)


class UnfitError(ValueError):
    """Two fields of a scene that do not go together: which, why and what would."""

    def __init__(self, field: str, what: str, remedy: str) -> None:
        self.field, self.what, self.remedy = field, what, remedy
        super().__init__(f"{field}: {what} ({remedy})")


def check_density(density: float, fluid_density: float) -> None:
    """A grain must sink."""
    if density <= fluid_density:
        raise UnfitError(
            "grain.density",
            f"{density:g} kg/m3 is not above the fluid's {fluid_density:g} kg/m3",
            "the grain would float; raise it, or lower fluid.density",
        )


def check_pile(bed: PileBed, diameter: float) -> None:
    """What meshes and packings of piles can be built at all."""
    low, high = BUILDABLE_DEG
    if not low <= bed.slope_deg <= high:
        raise UnfitError(
            "bed.slope_deg", f"a pile of {bed.slope_deg:g} deg", f"choose {low:g} ... {high:g} deg"
        )
    if bed.height < 5 * diameter:
        raise UnfitError(
            "bed.height",
            f"{bed.height:g} m is less than five grains of {diameter:g} m",
            "a pile needs some rows: raise bed.height or lower grain.diameter",
        )


def check_mesh(height: float, first_cell_height: float) -> None:
    """The mesh must resolve the pile."""
    if first_cell_height > height / 4:
        raise UnfitError(
            "flow.first_cell_height",
            f"{first_cell_height:g} m is above a quarter of the pile's {height:g} m",
            "lower it, or raise bed.height",
        )


def default_first_cell_height(height: float, roughness: float) -> float:
    """Height of the first cell on the bed of a pile, m.

    Its centre z_e must be 10 z0 from the bed, or the log law fails; at 15 z0 the friction velocity
    of a flat bed comes out within 1.5 %, at 10 z0 within 1.9 %. It must resolve the pile as well:
    from h/20 on the former has to do, and h/4 is the end.
    """
    rough = min(30 * roughness, max(height / 20, 20 * roughness))
    return min(max(height / 40, rough), height / 4)


def roughness_length(value: Any, diameter: float) -> Any:
    """A roughness in metres, from a number or from a part of the diameter such as ``"d/30"``."""
    if not isinstance(value, str):
        return value
    match = re.fullmatch(r"\s*d\s*/\s*(\d+(?:\.\d+)?)\s*", value)
    if not match or float(match[1]) == 0:
        raise UnfitError("bed.roughness", f"{value!r} is not a length", 'write metres, or "d/30"')
    # rounded, so that d/10 of one grain and d/30 of another are one length and share a flow
    return float(f"{diameter / float(match[1]):.12g}")
