"""The parts of a scene: fluid, grain, bed, flow and protocol; frozen, validated, SI.

Each field is declared here once: its name and default are the study file's, its `Info` and the
text under it are what tables, figures and the reference of study files say of it. Angles are in
degrees and say so in their names; all else is in SI units or in the unit that is declared.
"""

from math import radians, tan
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PlainSerializer,
    PlainValidator,
    field_validator,
    model_validator,
)

from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT
from orchestrator.physics.laws import LAWS
from orchestrator.study import sizes
from orchestrator.study.info import Info
from orchestrator.study.profile import Profile, a_profile
from orchestrator.study.ranges import (
    Damping,
    Density,
    Diameter,
    EntrainmentAngle,
    FluidDensity,
    FrictionAngle,
    Gravity,
    Height,
    LeeSlope,
    Length,
    LiftCoefficient,
    OverHeight,
    RelativeSize,
    Roughness,
    Slope,
    Speed,
    Stiffness,
    Viscosity,
)
from orchestrator.study.sizes import Sizes

Fraction = Annotated[float, Field(ge=1e-6, le=1)]
Packing = Literal["aligned", "horizontal", "disordered", "poured"]
Stress = Literal["wall", "eq10"]
Method = Literal["dem", "peeling", "pivot"]
Model = Literal["solve", "waves", "hill", "flat"]
Top = Literal["open water", "closed channel", "boundary layer"]
Turbulence = Literal["kEpsilon", "RNGkEpsilon", "realizableKE", "kOmegaSST"]
Convection = Literal["linearUpwind", "upwind", "limitedLinear"]
Forced = Literal["exposed", "all but crest", "all but toe"]
Standing = Literal["alike", "protrusion"]
Shape = Literal[
    "triangle", "dune", "cosine", "gaussian", "rushil", "trapezoid", "step up", "step down", "flat"
]
Range = tuple[float, float]
File = Annotated[
    Profile, PlainValidator(a_profile), PlainSerializer(lambda profile: profile and profile.digest)
]
BEDS = {
    "grain": "one grain on its two fixed neighbours, in an undisturbed boundary layer",
    "pile": "grains of any bed line across the flow: a form, a train of forms, a profile",
}


class UnfitError(ValueError):
    """Two fields of a scene that do not go together: which, why and what would."""

    def __init__(self, field: str, what: str, remedy: str) -> None:
        self.field, self.what, self.remedy = field, what, remedy
        super().__init__(f"{field}: {what} ({remedy})")


class Part(BaseModel):
    """Base of a scene's parts: immutable, exact types, no unknown keys, no NaN."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )

    @field_validator("*", mode="after")
    @classmethod
    def _without_minus_zero(cls, value: Any) -> Any:
        """Make one number of 0.0 and -0.0, which are equal: else they are two scenes."""
        return value + 0.0 if isinstance(value, float) else value


class Fluid(Part):
    """The fluid; the default is the paper's air."""

    density: Annotated[FluidDensity, Info("fluid density", "ρ_f", "kg/m³", "rho_f_kg_m3")] = 1.0
    """density of the fluid"""
    viscosity: Annotated[Viscosity, Info("viscosity", "ν", "m²/s", "nu_m2_s")] = 1e-5
    """kinematic viscosity that the grains feel"""
    gravity: Annotated[Gravity, Info("gravity", "g", "m/s²", "g_m_s2")] = GRAVITY
    """acceleration of gravity"""


class Grain(Part):
    """Equal spheres and their contact law."""

    diameter: Annotated[Diameter, Info("diameter", "d", "m", "d_m")]
    """grain diameter"""
    density: Annotated[Density, Info("grain density", "ρ_sol", "kg/m³", "rho_sol_kg_m3")] = 2500.0
    """density of the grains"""
    friction_angle_deg: Annotated[FrictionAngle, Info("friction angle", "φ", "°", "phi_deg")] = 35.0
    """angle of Coulomb's friction between grains"""
    stiffness: Annotated[Stiffness, Info("stiffness", "K d/W", scope="DEM", about="answer")] = 1e4
    """spring constant of a contact, normal and tangential, times the diameter over the weight"""
    damping: Annotated[Damping, Info("damping", scope="DEM", about="answer")] = 0.1
    """damping ratio of a collision"""
    sizes: Annotated[
        Sizes | None,
        # scenes of equal grains are what they were before there were mixtures
        Field(exclude_if=lambda value: value is None),
        Info("sizes", scope="poured beds"),
    ] = None
    """mixture of a poured bed; by default all grains have the diameter. A sieve table: rows of
    diameter (m, rising) and mass fraction, or the name of a file with columns diameter_m and
    fraction; its d50 is the diameter. Or a log-normal
    distribution by mass about the diameter, { sigma_g = 1.3, smallest = 0.6, largest = 1.7 }, with
    cut-offs in d, two geometric standard deviations by default"""

    @field_validator("sizes", mode="before")
    @classmethod
    def _sizes_of_a_file(cls, value: Any) -> Any:
        try:
            return sizes.read(value)
        except ValueError as error:
            remedy = "write [[5e-4, 0.4], [1e-3, 0.6]], or { sigma_g = 1.3 }"
            raise UnfitError("grain.sizes", str(error), remedy) from None

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        if self.sizes is None:
            return self
        if what := sizes.fault(self.sizes):
            raise UnfitError("grain.sizes", what, "look at the rows")
        median = sizes.percentile(self.sizes, self.diameter, 0.5)
        if isinstance(self.sizes, tuple) and abs(self.diameter / median - 1) > 1e-9:
            what = f"the d50 of grain.sizes is {median:.9g} m"
            raise UnfitError("grain.diameter", what, "leave it out")
        return self


class Bed(Part):
    """What every bed has. Subclasses say which grains it is made of."""

    slope_deg: Annotated[Slope, Info("slope", "α", "°", "alpha_deg")] = 0.0
    """slope of the bed; the flow goes up it"""
    entrainment_angle_deg: Annotated[
        EntrainmentAngle, Info("entrainment angle", "β", "°", "beta_deg")
    ] = 60.0
    """angle at which a grain leaves its pocket: the neighbours below it are 2 d cos β apart"""
    roughness: Annotated[Roughness, Info("roughness length", "z_0", "m", "z0_m")]
    """roughness length of the bed; a study file may write a part of the diameter of the bed's
    grains: "d/30" """
    relative_size: Annotated[
        RelativeSize,
        # scenes of equal grains are what they were before there was another
        Field(exclude_if=lambda value: value == 1.0),
        Info("relative size", "D/d", scope="single grains"),
    ] = 1.0
    """diameter of a single grain over that of its two neighbours, which lie as far apart as equal
    grains do: 2 d cos β"""


class GrainBed(Bed):
    """One grain on its two fixed neighbours, in an undisturbed boundary layer (paper, 3.1)."""

    kind: Annotated[Literal["grain"], Info("bed", column="bed", choices=BEDS)] = "grain"
    """what the bed is made of"""


class Obstacle(Part):
    """An obstacle across the flow, which carries no grains."""

    kind: Literal["fence", "block", "half-cylinder"]
    """what it is; all have steep sides, none is upright"""
    x: float
    """place of its middle, downstream of the foot of the first form"""
    height: Height
    """height over the bed"""
    length: Length | None = None
    """length of a block; by default its height"""

    @property
    def reach(self) -> float:
        """From its middle to the foot of its sides on level bed, at most, m."""
        return {"fence": 0.4, "block": 0.3, "half-cylinder": 1.1}[self.kind] * self.height + (
            (self.length or self.height) / 2 if self.kind == "block" else 0.0
        )

    def __str__(self) -> str:
        length = f", {self.length:g} m long" if self.length else ""
        return f"{self.kind} of {self.height:g} m at {self.x:g} m{length}"


SLIP_FACE_DEG = 30.0
LEAST_UPDATE = 0.02
LEVEL = 4.0


def _unless(default: Any) -> Any:
    """A field that a scene's digest leaves out where it says nothing: triangles keep their ids."""
    return Field(exclude_if=lambda value: value == default)


class PileBed(Bed):
    """Grains across the flow, under a bed line of any shape (the paper's, 3.2, is a triangle)."""

    kind: Annotated[Literal["pile"], Info("bed", column="bed", choices=BEDS)]
    """what the bed is made of"""
    height: Annotated[Height, Info("height", "h", "m", "h_m", scope="piles")] = 0.02
    """height of the forms that the flow goes over; that of a profile follows from it"""
    shape: Annotated[
        Shape,
        _unless("triangle"),
        Info(
            "shape",
            column="bed_shape",
            scope="piles",
            choices={
                "triangle": "two straight faces",
                "dune": "a windward side and a slip face",
                "cosine": "one wave of a cosine, from trough to trough",
                "gaussian": "a Gaussian hill",
                "rushil": "a hill of the wind-tunnel experiment RUSHIL, level at its feet",
                "trapezoid": "two straight faces and a level top",
                "step up": "a straight face up to higher ground",
                "step down": "a straight face down to lower ground",
                "flat": "level bed",
            },
        ),
    ] = "triangle"
    """shape of a form; `slope_deg` is that of its windward side, of a curve where it is steepest"""
    windward: Annotated[
        Literal["straight", "curved"],
        _unless("straight"),
        Info(
            "windward side",
            scope="dunes",
            choices={"straight": "one slope", "curved": "half a wave of a cosine"},
        ),
    ] = "straight"
    """windward side of a dune"""
    lee_slope_deg: Annotated[
        LeeSlope | None, _unless(None), Info("lee slope", unit="°", scope="piles")
    ] = None
    """slope of a straight lee side or a step down; by default that of the windward side, 30 of a
    dune and a step down"""
    brink_radius: Annotated[
        float, Field(ge=0, le=1e3), _unless(0.0), Info("brink radius", unit="m", scope="dunes")
    ] = 0.0
    """radius with which a dune's brink is rounded; 0 leaves it sharp"""
    length: Annotated[
        Length | None, _unless(None), Info("length", unit="m", scope="beds with level parts")
    ] = None
    """length of level bed with grains: of a trapezoid's top, of a flat bed, before or behind a
    step; by default 4 h"""
    forms: Annotated[int, Field(ge=1, le=100), _unless(1), Info("forms", scope="piles")] = 1
    """number of forms in a train"""
    spacing: Annotated[Length | None, _unless(None), Info("spacing", unit="m", scope="piles")] = (
        None
    )
    """from one form of a train to the next; by default they touch"""
    profile: Annotated[File | None, _unless(None), Info("profile", scope="piles")] = None
    """file with the bed line, in place of a shape: columns x_m and z_m; a path is relative to the
    study file"""
    smoothing: Annotated[
        float, Field(ge=0, le=1e3), _unless(0.0), Info("smoothing", unit="m", scope="profiles")
    ] = 0.0
    """length over which a noisy profile is smoothed"""
    obstacles: Annotated[tuple[Obstacle, ...], _unless(()), Info("obstacles", scope="piles")] = ()
    """fences, blocks and half-cylinders on the bed, which carry no grains: tables with `kind`, `x`,
    `height` and, of a block, `length`"""
    counted: Annotated[
        Literal["windward", "all"] | Range | None,
        _unless(None),
        Info(
            "counted grains",
            scope="piles",
            choices={"windward": "on sides that rise", "all": "all"},
        ),
    ] = None
    """exposed grains that are counted, or the range of x in which; by default those of windward
    sides, all of a flat bed, a step down and a profile"""
    packing: Annotated[
        Packing,
        Info(
            "packing",
            scope="piles",
            choices={
                "aligned": "rows along the slope",
                "horizontal": "level rows",
                "disordered": "random gaps",
                "poured": "poured by LIGGGHTS into a mould of the bed line, settled and cut to it",
            },
        ),
    ] = "aligned"
    """pattern of the pile's grains; random gaps are between grains of rows along the slope"""
    disorder: Annotated[
        float, Field(ge=1e-6, le=0.2), Info("disorder", unit="d", scope="disordered piles")
    ] = 0.02
    """largest gap between two grains of the row under the four uppermost"""
    poured_depth: Annotated[
        float,
        Field(ge=3, le=100, exclude_if=lambda value: value == 6.0),
        Info("depth of the mould", unit="d", scope="poured beds"),
    ] = 6.0
    """depth of a poured bed under the bed line, along the vertical, to a row of fixed grains"""
    seed: Annotated[
        int,
        Field(ge=0, le=10**9),
        Info("seed", scope="random beds and replicas", about="replica"),
    ] = 0
    """which of the many disordered or poured packings; of a lattice 0 is itself, any other a
    replica with grains up to 1e-9 d aside, so that replicas differ by round-off alone"""
    mobile_layers: Annotated[
        int, Field(ge=1, le=1000), Info("mobile layers", scope="piles", about="answer")
    ] = 2
    """layers of the windward face that may move; below them the grains are fixed"""

    @field_validator("obstacles", "counted", mode="before")
    @classmethod
    def _tuple_of_a_list(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value

    @property
    def lee_slope(self) -> float:
        """Slope of a straight lee side, degrees."""
        steep = self.shape in ("dune", "step down")
        return self.lee_slope_deg or (SLIP_FACE_DEG if steep else self.slope_deg)

    @property
    def level_length(self) -> float:
        """Length of level bed with grains, m."""
        return self.length or LEVEL * self.height

    @property
    def counts(self) -> str | Range:
        """Which exposed grains are counted."""
        everywhere = self.profile or self.shape in ("flat", "step down")
        return self.counted or ("all" if everywhere else "windward")

    @property
    def is_level(self) -> bool:
        """Whether the flow finds nothing on it that it has to go over or round."""
        return self.shape == "flat" and not self.profile and not self.obstacles

    @property
    def is_triangle(self) -> bool:
        """Whether it is the paper's bed: one triangle of two equal faces, the windward counted."""
        equal = self.shape == "triangle" and self.lee_slope == self.slope_deg
        return self.is_wedge and equal and not self.obstacles

    @property
    def is_wedge(self) -> bool:
        """Whether it is one form of two straight faces, of which the windward one is counted."""
        faces = self.shape == "triangle" or (
            self.shape == "dune" and self.windward == "straight" and not self.brink_radius
        )
        one = faces and self.forms == 1 and not self.profile and self.counts == "windward"
        return one and not any(
            o.x + o.reach > 0 and o.x - o.reach < self._base for o in self.obstacles
        )

    @property
    def _base(self) -> float:
        """Length of a form of straight faces, m."""
        return sum(self.height / tan(radians(slope)) for slope in (self.slope_deg, self.lee_slope))

    @property
    def is_replica(self) -> bool:
        """Whether it is a lattice but for shifts that matter to nothing but round-off."""
        return self.packing in ("aligned", "horizontal") and self.seed > 0


class Flow(Part):
    """The flow over the bed, and how a grain feels it."""

    model: Annotated[
        Model,
        Info(
            "flow model",
            column="flow_model",
            scope="piles",
            about="answer",
            choices={
                "solve": "OpenFOAM",
                "waves": "linear theory with A and B of each wavelength (Fourrière et al. 2010)",
                "hill": "linear theory with A and B of one low hill (Kroy et al. 2002)",
                "flat": "log law of a flat bed, u* = u*₀",
            },
        ),
    ] = "solve"
    """where the stress on a pile comes from"""
    speed: Annotated[
        Speed,
        Info("speed of the solve", "U_e", "m/s", "solve_u_e_m_s", "solved flows", "answer"),
    ] = 10.0
    """speed 10 h above the flat bed at which the flow over a pile is solved; the stress is scaled
    from it"""
    viscosity: Annotated[
        Viscosity,
        Info("viscosity of the solve", "ν", "m²/s", "solve_nu_m2_s", "solved flows", "answer"),
    ] = 1e-5
    """kinematic viscosity of that solve: the wall is rough, the fluid's own moves only the grain's
    Re*"""
    first_cell_height: Annotated[
        Length | None,
        Info(
            "first cell",
            unit="m",
            column="first_cell_m",
            scope="solved flows",
            about="answer",
            read="first_cell_height",
        ),
    ] = None
    """height of the mesh's cells on the bed; by default h/40, more on a very rough bed, 2.5 z₀, and
    where the flow in them would not be turbulent"""
    cells_per_face: Annotated[
        int, Field(ge=10, le=400), Info("cells per face", scope="solved flows", about="answer")
    ] = 40
    """cells of the mesh along each face of the pile"""
    expansion_ratio: Annotated[
        float, Field(ge=1.01, le=2), Info("expansion ratio", scope="solved flows", about="answer")
    ] = 1.1
    """ratio of neighbouring cells up from the bed and away from the pile, with 40 cells along a
    face; it follows their number"""
    roughness: Annotated[
        Roughness | None,
        Info(
            "roughness length of the solve",
            "z_0",
            "m",
            "solve_z0_m",
            scope="piles",
            about="answer",
            read="solve_roughness",
        ),
    ] = None
    """roughness length at which the flow is found, for beds of nearly the same one to share it; by
    default the bed's"""
    turbulence_model: Annotated[
        Turbulence,
        Info(
            "turbulence model",
            scope="solved flows",
            about="answer",
            choices={
                "kEpsilon": "k-ε",
                "RNGkEpsilon": "RNG k-ε",
                "realizableKE": "realizable k-ε",
                "kOmegaSST": "k-ω SST",
            },
        ),
    ] = "kEpsilon"
    """OpenFOAM's turbulence model"""
    convection_scheme: Annotated[
        Convection, Info("convection scheme", scope="solved flows", about="answer")
    ] = "linearUpwind"
    """OpenFOAM's scheme for the convection of U"""
    top: Annotated[
        Top,
        _unless("boundary layer"),
        Info(
            "top of the flow",
            column="flow_top",
            scope="piles",
            choices={
                "open water": "a level surface without stress",
                "closed channel": "a wall as rough as the bed",
                "boundary layer": "the log layer goes on above",
            },
        ),
    ] = "boundary layer"
    """what the flow has above"""
    depth: Annotated[
        Length | None, _unless(None), Info("depth", "D", "m", "depth_m", scope="piles")
    ] = None
    """depth of open water or of a closed channel over the flat bed"""
    lid: Annotated[
        float,
        Field(ge=3, le=1000, exclude_if=lambda value: value == 100.0),
        Info("lid", unit="h", scope="solved flows", about="answer"),
    ] = 100.0
    """height of a boundary layer's lid above the flat bed; the flow there is that of the
    undisturbed log layer"""
    upstream: Annotated[
        float,
        Field(ge=3, le=1000, exclude_if=lambda value: value == 80.0),
        Info("flat bed upstream", unit="h", scope="solved flows", about="answer"),
    ] = 80.0
    """flat bed from the inlet to the forms"""
    downstream: Annotated[
        float,
        Field(ge=3, le=1000, exclude_if=lambda value: value == 100.0),
        Info("flat bed downstream", unit="h", scope="solved flows", about="answer"),
    ] = 100.0
    """flat bed from the forms to the outlet"""
    non_orthogonal_correctors: Annotated[
        int,
        Field(ge=0, le=5),
        Info("non-orthogonal correctors", scope="solved flows", about="answer"),
    ] = 1
    """repeated solves of the pressure for cells that are not orthogonal, in each iteration"""


class Forces(Part):
    """How the grains feel the flow."""

    law: Annotated[
        str,
        Info(
            "force law",
            column="force_law",
            choices={
                "paper": "Eq. 2 or Eq. 4 where each holds, both in the transition",
                **{name: law.label for name, law in LAWS.items()},
            },
        ),
    ] = "bridged"
    """drag and lift on an exposed grain"""
    lift_coefficient: Annotated[
        LiftCoefficient, Info("lift coefficient", "α_s", column="alpha_s")
    ] = LIFT_COEFFICIENT
    """lift coefficient"""
    stress: Annotated[
        Stress,
        Info(
            "stress",
            scope="piles",
            choices={"wall": "wall stress", "eq10": "stress of Eq. 10"},
        ),
    ] = "wall"
    """how the stress on the bed is read off the flow: at the wall, or at the first cell"""
    averaging_length: Annotated[OverHeight, Info("averaging length", unit="h", scope="piles")] = (
        1 / 40
    )
    """least length of bed that a grain's stress is averaged on: the crest's own value never
    converges with the mesh"""
    loaded_grains: Annotated[
        Forced,
        Info(
            "loaded grains",
            scope="piles",
            choices={
                "exposed": "all exposed grains",
                "all but crest": "exposed grains but for the topmost one",
                "all but toe": "exposed grains but for those on the lowest 5 % of the face",
            },
        ),
    ] = "exposed"
    """grains of a pile that feel the flow's force"""

    exposure: Annotated[
        Standing,
        _unless("alike"),
        Info(
            "exposure",
            scope="poured beds",
            choices={
                "alike": "every exposed grain stands z₀ above the bed, as in the paper",
                "protrusion": "each stands at its own height over the local bed",
            },
        ),
    ] = "alike"
    """height at which the flow meets a grain"""

    @field_validator("law")
    @classmethod
    def _is_known(cls, value: str) -> str:
        if value not in ("paper", *LAWS):
            known = ", ".join(("paper", *LAWS))
            raise UnfitError("forces.law", f"unknown force law {value!r}", f"known: {known}")
        return value


class Protocol(Part):
    """How the threshold is found; by DEM the flow rises in load steps."""

    method: Annotated[
        Method,
        Info(
            "threshold method",
            about="answer",
            choices={
                "dem": "DEM",
                "peeling": "peeling",
                "pivot": "pivot",
            },
        ),
    ] = "dem"
    """how the threshold is found: the pivot of each grain by itself, peeling (pivots that free one
    another), or DEM"""
    load_increment: Annotated[
        float, Field(ge=1e-4, le=0.2), Info("load increment", "Δu*/u*", scope="DEM", about="answer")
    ] = 0.02
    """relative rise of u* from one load step to the next"""
    waiting_time: Annotated[
        float,
        Field(ge=1, le=1e4),
        Info("waiting time", unit="√(d/g′)", scope="DEM", about="answer"),
    ] = 10.0
    """time without a passage of the displacement criterion that ends a load step"""
    displacement_criterion: Annotated[
        float,
        Field(ge=1e-3, le=0.5),
        Info("displacement criterion", unit="d", scope="DEM and peeling", about="answer"),
    ] = 0.3
    """displacement along the bed from which a grain counts as moved"""
    final_fraction: Annotated[
        Fraction, Info("last fraction", scope="DEM of piles", about="answer")
    ] = 0.9
    """fraction of the exposed grains that should have moved by the last load step"""
    fractions: Annotated[
        tuple[Fraction, ...],
        Field(min_length=1),
        Info("fractions", "n/N", column="-", scope="piles"),
    ] = (0.1, 0.3, 0.5, 0.7)
    """fractions of the exposed grains at which the thresholds of a pile are reported"""
    time_step: Annotated[
        float, Field(ge=1e-3, le=2), Info("time step", unit="√(m/K)", scope="DEM", about="answer")
    ] = 0.2
    """time step of the grains' integration"""
    update: Annotated[
        float,
        Field(ge=0, le=0.5),
        _unless(0.0),
        Info("update of the bed", unit="of N", scope="DEM and peeling of piles"),
    ] = 0.0
    """part of the counted grains after which the bed line is drawn anew through the grains that are
    there, and the flow solved over it, until the last of the fractions; 0 keeps the flow of the
    whole pile, as in the paper"""

    @model_validator(mode="after")
    def _updates_are_few(self) -> Self:
        if 0 < self.update < LEAST_UPDATE:
            what = f"{self.update:g} of the grains: each update is a solve of the flow"
            raise UnfitError("protocol.update", what, f"0, or at least {LEAST_UPDATE:g}")
        return self

    @field_validator("fractions", mode="before")
    @classmethod
    def _tuple_of_a_list(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value
