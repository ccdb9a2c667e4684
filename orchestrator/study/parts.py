"""The parts of a scene: fluid, grain, bed, flow, forces and protocol; frozen, validated, SI.

Each field is declared here once: its name and default are the study file's, its words and the text
under it are what tables, figures and the reference of study files say of it. Angles are in degrees
and say so in their names; all else is in SI units or in the unit that is declared. Ranges are
limits of nature, not of the methods.
"""

from functools import partial
from math import radians, tan
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, InstanceOf, PlainSerializer, field_validator, model_validator

from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT
from orchestrator.physics.laws import LAWS
from orchestrator.study import sizes
from orchestrator.study.part import Height, Length, List, Part, Roughness, Viscosity, field
from orchestrator.study.part import UnfitError as UnfitError
from orchestrator.study.profile import Profile
from orchestrator.study.shapes import SHAPES, Shape
from orchestrator.study.sizes import Sizes

Turbulence = Literal["kEpsilon", "RNGkEpsilon", "realizableKE", "kOmegaSST"]
Convection = Literal["linearUpwind", "upwind", "limitedLinear"]
Packing = Literal["aligned", "horizontal", "disordered", "poured"]
if TYPE_CHECKING:
    ShapeName = str
else:
    ShapeName = Literal[tuple(SHAPES)]
Range = Annotated[tuple[float, float], List]
Fraction = Annotated[float, Field(ge=1e-6, le=1)]
Update = Annotated[float, Field(ge=0, le=0.5)]
File = Annotated[InstanceOf[Profile], PlainSerializer(lambda profile: profile and profile.digest)]
BEDS = {
    "grain": "one grain on its two fixed neighbours, in an undisturbed boundary layer",
    "pile": "grains of any bed line across the flow: a form, a train of forms, a profile",
}
LAW_LABELS = {"paper": "Eq. 2 or Eq. 4 where each holds, both in the transition"}
LAW_LABELS |= {name: law.label for name, law in LAWS.items()}
COUNTED = {"windward": "on sides that rise", "all": "all"}
SHAPE_MEANINGS = {name: shape.meaning for name, shape in SHAPES.items()}
LEVEL = 4.0  # length of level bed with grains, over the height
LEAST_UPDATE = 0.02  # least part of the grains between two solves of the flow

_pile = partial(field, scope="piles")
_answer = partial(field, scope="piles", about="answer")
_dune = partial(field, scope="dunes", since=True)
_poured = partial(field, scope="poured beds")
_solved = partial(field, scope="solved flows", about="answer")
_dem = partial(field, scope="DEM", about="answer")


class Fluid(Part):
    """The fluid; the default is the paper's air."""

    # from the vapour that ripples a comet to mercury, 13,500, and melts of metals
    density: float = field(
        1.0, "ρ_f", "kg/m³", "rho_f_kg_m3", label="fluid density", ge=1e-7, le=20_000
    )
    """density of the fluid"""
    viscosity: Viscosity = field(1e-5, "ν", "m²/s", "nu_m2_s")
    """kinematic viscosity that the grains feel"""
    # from a small asteroid's to that of a centrifuge
    gravity: float = field(GRAVITY, "g", "m/s²", "g_m_s2", ge=1e-6, le=1e4)
    """acceleration of gravity"""


class Grain(Part):
    """Spheres and their contact law."""

    # smaller ones are carried by Brownian motion, larger ones no flood has moved
    diameter: float = field(..., "d", "m", "d_m", ge=1e-7, le=10)
    """grain diameter"""
    # from aerogels, 0.2, to osmium, 22,600
    density: float = field(
        2500.0, "ρ_sol", "kg/m³", "rho_sol_kg_m3", label="grain density", ge=0.1, le=25_000
    )
    """density of the grains"""
    # from wet ice to grains that hold by more than friction
    friction_angle_deg: float = field(35.0, "φ", "°", "phi_deg", ge=1, le=89)
    """angle of Coulomb's friction between grains"""
    # softer grains sink into one another by a hundredth, harder ones are harder than steel
    stiffness: float = _dem(1e4, "K d/W", ge=1e2, le=1e9)
    """spring constant of a contact, normal and tangential, times the diameter over the weight"""
    damping: float = _dem(0.1, ge=0, le=1)
    """damping ratio of a collision"""
    sizes: Sizes | None = _poured(None, since=True)
    """mixture of a poured bed; by default all grains have the diameter. A sieve table: rows of
    diameter (m, rising) and mass fraction, or the name of a file with columns diameter_m and
    fraction; its d50 is the diameter. Or a log-normal distribution by mass about the diameter,
    { sigma_g = 1.3, smallest = 0.6, largest = 1.7 }, with cut-offs in d, two geometric standard
    deviations by default"""

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        if self.sizes is not None:
            sizes.check(self.sizes, self.diameter)
        return self


class Forces(Part):
    """How the grains feel the flow."""

    law: str = field("bridged", label="force law", column="force_law", choices=LAW_LABELS)
    """drag and lift on an exposed grain"""
    # from none to sixty times Saffman's
    lift_coefficient: float = field(LIFT_COEFFICIENT, "α_s", "", "alpha_s", ge=0, le=100)
    """lift coefficient"""
    stress: Literal["wall", "eq10"] = _pile("wall", choices=["wall stress", "stress of Eq. 10"])
    """how the stress on the bed is read off the flow: at the wall, or at the first cell"""
    # from far below a cell of any mesh to several piles
    averaging_length: float = _pile(1 / 40, unit="h", ge=1e-4, le=100)
    """least length of bed that a grain's stress is averaged on: the crest's own value never
    converges with the mesh"""
    loaded_grains: Literal["exposed", "all but crest", "all but toe"] = _pile(
        "exposed",
        choices={
            "exposed": "all exposed grains",
            "all but crest": "exposed grains but for the topmost one",
            "all but toe": "exposed grains but for those on the lowest 5 % of the face",
        },
    )
    """grains of a pile that feel the flow's force"""
    exposure: Literal["alike", "protrusion"] = _poured(
        "alike",
        since=True,
        choices=[
            "every exposed grain stands z₀ above the bed, as in the paper",
            "each stands at its own height over the local bed",
        ],
    )
    """height at which the flow meets a grain"""

    @field_validator("law")
    @classmethod
    def _is_in_registry(cls, value: str) -> str:
        if value not in LAW_LABELS:
            known = f"known: {', '.join(LAW_LABELS)}"
            raise UnfitError("forces.law", f"unknown force law {value!r}", known)
        return value


class Protocol(Part):
    """How the threshold is found; by DEM the flow rises in load steps."""

    method: Literal["dem", "peeling", "pivot"] = field(
        "dem", label="threshold method", about="answer", choices=["DEM", "peeling", "pivot"]
    )
    """how the threshold is found: the pivot of each grain by itself, peeling (pivots that free one
    another), or DEM"""
    load_increment: float = _dem(0.02, "Δu*/u*", ge=1e-4, le=0.2)
    """relative rise of u* from one load step to the next"""
    waiting_time: float = _dem(10.0, unit="√(d/g′)", ge=1, le=1e4)
    """time without a passage of the displacement criterion that ends a load step without rest"""
    displacement_criterion: float = _dem(0.3, "", "d", scope="DEM and peeling", ge=1e-3, le=0.5)
    """displacement along the bed from which a grain counts as moved"""
    final_fraction: Fraction = _dem(0.9, label="last fraction", scope="DEM of piles")
    """fraction of the exposed grains that should have moved by the last load step"""
    fractions: Annotated[tuple[Fraction, ...], List] = _pile(
        (0.1, 0.3, 0.5, 0.7), "n/N", column="-", min_length=1
    )
    """fractions of the exposed grains at which the thresholds of a pile are reported"""
    time_step: float = _dem(0.2, unit="√(m/K)", ge=1e-3, le=2)
    """time step of the grains' integration"""
    update: Update = field(
        0.0, "", "of N", label="update of the bed", scope="DEM and peeling of piles", since=True
    )
    """part of the counted grains after which the bed line is drawn anew through the grains that are
    there, and the flow solved over it, until the last of the fractions; 0 keeps the flow of the
    whole pile, as in the paper"""

    @model_validator(mode="after")
    def _updates_are_few(self) -> Self:
        if 0 < self.update < LEAST_UPDATE:
            remedy = f"each update is a solve of the flow: 0, or at least {LEAST_UPDATE:g}"
            raise UnfitError("protocol.update", f"{self.update:g} of the grains", remedy)
        return self


class Flow(Part):
    """The flow over the bed, and how a grain feels it."""

    model: Literal["solve", "waves", "hill", "flat"] = _answer(
        "solve",
        label="flow model",
        column="flow_model",
        choices=[
            "OpenFOAM",
            "linear theory with A and B of each wavelength (Fourrière et al. 2010)",
            "linear theory with A and B of one low hill (Kroy et al. 2002)",
            "log law of a flat bed, u* = u*₀",
        ],
    )
    """where the stress on a pile comes from"""
    speed: float = _solved(
        10.0, "U_e", "m/s", "solve_u_e_m_s", label="speed of the solve", ge=1e-6, le=1e3
    )
    """speed 10 h above the flat bed at which the flow over a pile is solved; the stress is scaled
    from it"""
    viscosity: Viscosity | None = _solved(
        None, "ν", "m²/s", "solve_nu_m2_s", label="viscosity of the solve", read="solve_viscosity"
    )
    """kinematic viscosity of that solve: the wall is rough, the fluid's own moves only the grain's
    Re*; by default 1e-5, or less where the flow in the first cells would not be turbulent"""
    first_cell_height: Length | None = _solved(
        None, "", "m", "first_cell_m", label="first cell", read="first_cell_height"
    )
    """height of the mesh's cells on the bed; by default h/40, more on a very rough bed, 2.5 z₀, and
    where the viscosity of the solve is given and the flow in them would not be turbulent"""
    cells_per_face: int = _solved(40, ge=10, le=400)
    """cells of the mesh along each face of the pile"""
    expansion_ratio: float = _solved(1.1, ge=1.01, le=2)
    """ratio of neighbouring cells up from the bed and away from the pile, with 40 cells along a
    face; it follows their number"""
    roughness: Roughness | None = _answer(
        None,
        "z_0",
        "m",
        "solve_z0_m",
        label="roughness length of the solve",
        read="solve_roughness",
    )
    """roughness length at which the flow is found, for beds of nearly the same one to share it; by
    default the bed's"""
    nodes: bool = _solved(False, label="nodes of z₀", since=True)
    """whether the flow is interpolated in ln z₀, face by face, between solves at fixed values of
    z₀/h, which beds of one form share"""
    turbulence_model: Turbulence = _solved(
        "kEpsilon", choices=["k-ε", "RNG k-ε", "realizable k-ε", "k-ω SST"]
    )
    """OpenFOAM's turbulence model"""
    convection_scheme: Convection = _solved("linearUpwind")
    """OpenFOAM's scheme for the convection of U"""
    top: Literal["open water", "closed channel", "boundary layer"] = _pile(
        "boundary layer",
        label="top of the flow",
        column="flow_top",
        since=True,
        choices=[
            "a level surface without stress",
            "a wall as rough as the bed",
            "the log layer goes on above",
        ],
    )
    """what the flow has above"""
    depth: Length | None = _pile(None, "D", "m", "depth_m", since=True)
    """depth of open water or of a closed channel over the flat bed"""
    lid: float = _solved(100.0, unit="h", since=True, ge=3, le=1000)
    """height of a boundary layer's lid above the flat bed; the flow there is that of the
    undisturbed log layer"""
    upstream: float = _solved(80.0, label="flat bed upstream", unit="h", since=True, ge=3, le=1000)
    """flat bed from the inlet to the forms"""
    downstream: float = _solved(
        100.0, label="flat bed downstream", unit="h", since=True, ge=3, le=1000
    )
    """flat bed from the forms to the outlet"""
    non_orthogonal_correctors: int = _solved(1, label="non-orthogonal correctors", ge=0, le=5)
    """repeated solves of the pressure for cells that are not orthogonal, in each iteration"""


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
        sides = {"fence": 0.4, "block": 0.3, "half-cylinder": 1.1}[self.kind] * self.height
        return sides + ((self.length or self.height) / 2 if self.kind == "block" else 0.0)

    def __str__(self) -> str:
        length = f", {self.length:g} m long" if self.length else ""
        return f"{self.kind} of {self.height:g} m at {self.x:g} m{length}"


class Bed(Part):
    """Common fields of all beds. Subclasses add the grains."""

    slope_deg: float = field(0.0, "α", "°", "alpha_deg", ge=0, lt=90)
    """slope of the bed; the flow goes up it"""
    # at 60 the two grains below touch, at 0 the grain falls between them
    entrainment_angle_deg: float = field(60.0, "β", "°", "beta_deg", ge=1, le=60)
    """angle at which a grain leaves its pocket: the neighbours below it are 2 d cos β apart"""
    roughness: Roughness = field(..., "z_0", "m", "z0_m", label="roughness length")
    """roughness length of the bed; a study file may write a part of the diameter of the bed's
    grains: "d/30" """
    # a smaller grain falls through the pores of a bed, a larger one lies on many grains
    relative_size: float = field(1.0, "D/d", scope="single grains", since=True, ge=0.1, le=10)
    """diameter of a single grain over that of its two neighbours, which lie as far apart as equal
    grains do: 2 d cos β"""


class GrainBed(Bed):
    """One grain on its two fixed neighbours, in an undisturbed boundary layer (paper, 3.1)."""

    kind: Literal["grain"] = field("grain", label="bed", column="bed", choices=BEDS)
    """what the bed is made of"""


class PileBed(Bed):
    """Grains across the flow, under a bed line of any shape (the paper's, 3.2, is a triangle)."""

    kind: Literal["pile"] = field(label="bed", column="bed", choices=BEDS)
    """what the bed is made of"""
    height: Height = _pile(0.02, "h", "m", "h_m")
    """height of the forms that the flow goes over; that of a profile follows from it, and over a
    flat bed with obstacles the flow is measured in the height of the tallest"""
    shape: ShapeName = _pile("triangle", column="bed_shape", since=True, choices=SHAPE_MEANINGS)
    """shape of a form; `slope_deg` is that of its windward side, of a curve where it is steepest"""
    windward: Literal["straight", "curved"] = _dune(
        "straight", label="windward side", choices=["one slope", "half a wave of a cosine"]
    )
    """windward side of a dune"""
    lee_slope_deg: float | None = _pile(None, unit="°", since=True, gt=0, le=60)
    """slope of a straight lee side or a step down; by default that of the windward side, 30 of a
    dune and a step down"""
    brink_radius: float = _dune(0.0, "", "m", ge=0, le=1e3)
    """radius with which a dune's brink is rounded; 0 leaves it sharp"""
    length: Length | None = field(None, "", "m", scope="beds with level parts", since=True)
    """length of level bed with grains: of a trapezoid's top, of a flat bed, before or behind a
    step; by default 4 h"""
    forms: int = _pile(1, since=True, ge=1, le=100)
    """number of forms in a train"""
    spacing: Length | None = _pile(None, unit="m", since=True)
    """from one form of a train to the next; by default they touch"""
    profile: File | None = _pile(None, since=True)
    """file with the bed line, in place of a shape: columns x_m and z_m; a path is relative to the
    study file"""
    smoothing: float = field(0.0, "", "m", scope="profiles", since=True, ge=0, le=1e3)
    """length over which a noisy profile is smoothed"""
    obstacles: Annotated[tuple[Obstacle, ...], List] = _pile((), since=True)
    """fences, blocks and half-cylinders on the bed, which carry no grains: tables with `kind`, `x`,
    `height` and, of a block, `length`"""
    counted: Literal["windward", "all"] | Range | None = _pile(
        None, label="counted grains", since=True, choices=COUNTED
    )
    """exposed grains that are counted, or the range of x in which; by default those of windward
    sides, all of a flat bed, a step down and a profile"""
    packing: Packing = _pile(
        "aligned",
        choices=[
            "rows along the slope",
            "level rows",
            "random gaps",
            "poured by LIGGGHTS into a mould of the bed line, settled and cut to it",
        ],
    )
    """pattern of the pile's grains; random gaps are between grains of rows along the slope"""
    disorder: float = field(0.02, "", "d", scope="disordered piles", ge=1e-6, le=0.2)
    """largest gap between two grains of the row under the four uppermost"""
    poured_depth: float = _poured(
        6.0, label="depth of the mould", unit="d", since=True, ge=3, le=100
    )
    """depth of a poured bed under the bed line, along the vertical, to a row of fixed grains"""
    width: float = _poured(
        0.0, "", "d", label="width of the strip", about="answer", since=True, ge=0, le=50
    )
    """width of a poured bed across the flow, a strip in space with periodic sides: at least 3 of
    its largest grains; 0 is one layer of grains in the plane of the flow"""
    seed: int = field(0, scope="random beds and replicas", about="replica", ge=0, le=10**9)
    """which of the many disordered or poured packings; of a lattice 0 is itself, any other a
    replica with grains up to 1e-9 d aside, so that replicas differ by round-off alone"""
    mobile_layers: int = _answer(2, ge=1, le=1000)
    """layers of the windward face that may move; below them the grains are fixed"""

    @property
    def form(self) -> Shape:
        """The facts of its shape."""
        return SHAPES[self.shape]

    @property
    def lee_slope(self) -> float:
        """Slope of a straight lee side, degrees."""
        return self.lee_slope_deg or self.form.lee_slope_deg or self.slope_deg

    @property
    def level_length(self) -> float:
        """Length of level bed with grains, m."""
        return self.length or LEVEL * self.height

    @property
    def relief(self) -> float:
        """Height of what the flow goes over, m: of the forms, on a flat bed of its obstacles."""
        is_flat = self.shape == "flat" and not self.profile and self.obstacles
        return max(each.height for each in self.obstacles) if is_flat else self.height

    @property
    def counts(self) -> str | Range:
        """Which exposed grains are counted."""
        return self.counted or ("all" if self.profile else self.form.counted)

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
        straight = self.windward == "straight" and not self.brink_radius  # of a dune
        faces = self.shape in ("triangle", "dune") and straight
        if not faces or self.forms > 1 or self.profile or self.counts != "windward":
            return False
        base = sum(self.height / tan(radians(slope)) for slope in (self.slope_deg, self.lee_slope))
        return not any(o.x + o.reach > 0 and o.x - o.reach < base for o in self.obstacles)

    @property
    def is_replica(self) -> bool:
        """Whether it is a lattice but for shifts that matter to nothing but round-off."""
        return self.packing in ("aligned", "horizontal") and self.seed > 0
