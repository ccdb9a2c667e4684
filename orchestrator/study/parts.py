"""The parts of what is asked.

They are fluid, grain, bed, flow above, forces, and what counts as motion.

Every part is frozen and validated. How the question is answered is in `method`.
"""

from functools import partial
from math import log, radians, tan
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
import pydantic
from numpy.typing import ArrayLike
from pydantic import Field, InstanceOf, PlainSerializer, model_validator

from orchestrator.digits import metres, rounded
from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT
from orchestrator.physics.fluids import PAPER
from orchestrator.physics.laws import DEFAULT, LAWS
from orchestrator.study.declare import (
    Fraction,
    Height,
    Length,
    List,
    Part,
    Roughness,
    UnfitError,
    Viscosity,
    field,
)
from orchestrator.study.profile import WITH_X, Profile
from orchestrator.study.shapes import SHAPES, Shape
from orchestrator.types import FloatArray

LAW_LABELS = {
    "auto": (
        f"{DEFAULT}, or {LAWS[DEFAULT].extended_by} where the drag law of {DEFAULT} "
        "ends"
    ),
    "paper": "Eq. 2 or Eq. 4 where each holds, both in the transition",
    **{name: law.label for name, law in LAWS.items()},
}
SHAPE_MEANINGS = {name: shape.meaning for name, shape in SHAPES.items()}
Packing = Literal["aligned", "horizontal", "disordered", "poured"]
if TYPE_CHECKING:
    ShapeName = str
    LawName = str
else:
    ShapeName, LawName = Literal[tuple(SHAPES)], Literal[tuple(LAW_LABELS)]
Range = Annotated[tuple[float, float], List]
Wind = Annotated[float, Field(gt=0, le=150)]
"""Up to the fastest tornadoes, m/s."""
File = Annotated[
    InstanceOf[Profile], PlainSerializer(lambda profile: profile and profile.digest)
]


MOST_POROUS = 0.9
"""Most open part of a fence: one of 0.99 on level ground changes so little that the
residuals, which are over the change, do not fall."""


class LogNormal(Part):
    """A log-normal distribution by mass, whose median is the grain diameter."""

    sigma_g: Annotated[float, Field(ge=1.001, le=3)]
    smallest: Annotated[float | None, Field(ge=0.1, le=1)] = None
    largest: Annotated[float | None, Field(ge=1, le=10)] = None

    @property
    def ends(self) -> tuple[float, float]:
        """Cut-offs over the median; by default two geometric standard deviations."""
        return self.smallest or self.sigma_g**-2, self.largest or self.sigma_g**2

    def quantile(self, part: ArrayLike, *, power: int) -> FloatArray:
        """Compute the diameter that a part is below.

        Parameters
        ----------
        part
            Part of the distribution, 0 to 1.
        power
            0 for parts of the mass; for parts of the number 3 where masses, 2 where
            areas in a plane are so distributed.

        Returns
        -------
        FloatArray
            Diameter over the median, of the shape of the part.
        """
        from scipy.special import ndtr, ndtri

        width = log(self.sigma_g)
        middle = -power * width**2
        low, high = (ndtr((log(end) - middle) / width) for end in self.ends)
        sizes = np.exp(middle + width * ndtri(low + np.asarray(part) * (high - low)))
        return np.asarray(np.clip(sizes, *self.ends))

    def __str__(self) -> str:
        low, high = self.ends
        return f"log-normal, sigma_g {self.sigma_g:g}, {low:.3g} to {high:.3g} d50"


_Number = Annotated[float, Field(gt=0, lt=100)]
_Rows = tuple[Annotated[tuple[_Number, _Number], List], ...]
Sieve = Annotated[_Rows, Field(min_length=1), List, pydantic.Tag("rows")]
"""Classes of a sieve table: diameter, m, rising, and fraction of the mass."""
_kind = pydantic.Discriminator(
    lambda value: "rows" if isinstance(value, list | tuple) else ""
)
Sizes = Annotated[Annotated[LogNormal, pydantic.Tag("")] | Sieve, _kind]
"""In a study file ``[[5e-4, 0.4], [1e-3, 0.6]]``, or ``{ sigma_g = 1.3 }``."""
_pile = partial(field, scope="piles")
_dune = partial(field, scope="dunes")
_poured = partial(field, scope="poured beds")


class Fluid(Part):
    """A kind of fluid, or its numbers.

    The kinds are "water", "seawater" and "air", with `temperature_deg_c` (15), and
    "paper", the paper's gas of 1 kg/m³ and 1e-5 m²/s, which is no air of 15 °C.

    In the paper's gas a grain has moved when it has left its pocket; in all other
    fluids, whatever their numbers, when it also keeps moving (`threshold.criterion`).
    A file that gives neither a kind nor a density nor a viscosity is of the paper's
    gas. One that gives a number has a fluid by its numbers, unless it writes "paper" as
    well.
    """

    kind: Literal["paper"] | None = field(None, column="fluid")
    """"paper" for the paper's gas; the other kinds stand for their numbers"""
    # from the vapour that ripples a comet to mercury, 13,500, and melts of metals
    density: float = field(
        1.0,
        symbol="ρ_f",
        unit="kg/m³",
        column="rho_f_kg_m3",
        label="fluid density",
        ge=1e-7,
        le=2e4,
    )
    """density of the fluid"""
    viscosity: Viscosity = field(1e-5, symbol="ν", unit="m²/s", column="nu_m2_s")
    """kinematic viscosity that the grains feel"""
    gravity: float = field(
        GRAVITY, symbol="g", unit="m/s²", column="g_m_s2", ge=1e-6, le=1e4
    )
    """acceleration of gravity"""

    @model_validator(mode="before")
    @classmethod
    def _is_of_paper(cls, given: Any) -> Any:
        """Take the paper's gas where nothing is said of the fluid."""
        told = {"kind", "density", "viscosity"}
        if isinstance(given, dict) and not told & given.keys():
            return {**given, "kind": PAPER}
        return given

    @property
    def is_paper(self) -> bool:
        """Whether it is the paper's gas, by its name."""
        return self.kind == PAPER


class Sphere(Part):
    """A grain of any bed: its size and its weight."""

    # smaller ones are carried by Brownian motion, larger ones no flood has moved
    diameter: float = field(..., symbol="d", unit="m", column="d_m", ge=1e-7, le=10)
    """grain diameter"""
    # from aerogels, 0.2, to osmium, 22,600
    density: float = field(
        2500.0,
        symbol="ρ_sol",
        unit="kg/m³",
        column="rho_sol_kg_m3",
        label="grain density",
        ge=0.1,
        le=25_000,
    )
    """density of the grains"""


class GrainPart(Sphere):
    """Spheres: their size, their weight, their friction and cohesion."""

    friction_angle_deg: float = field(
        35.0, symbol="φ", unit="°", column="phi_deg", ge=1, le=89
    )
    """angle of Coulomb's friction between grains"""
    cohesion: float = field(0.0, unit="N/m", column="cohesion_n_m", ge=0, le=1e3)
    """pull of a contact over the diameter, of two sizes over their harmonic mean; by
    pivots and peeling alone"""
    sizes: Sizes | None = _poured(None, also="the name of a file, in quotes")
    """mixture of a poured bed, by mass, in one plane by area: a sieve table, rows of
    diameter (m, rising) and fraction or a file of these or of what passes or stays on
    sieves (docs/your-files.md), whose d50 is the diameter; or log-normal,
    { sigma_g = 1.3, smallest = 0.6, largest = 1.7 }, cut off in d, by default at two
    geometric standard deviations"""


class Drag(Part):
    """The forces of the flow on an exposed grain of any bed."""

    law: LawName = field(
        "auto", label="force law", column="force_law", choices=LAW_LABELS
    )
    """drag and lift on an exposed grain"""
    lift_coefficient: float = field(
        LIFT_COEFFICIENT, symbol="α_s", column="alpha_s", ge=0, le=100
    )
    """lift coefficient"""


class Forces(Drag):
    """How the grains feel the flow."""

    stress: Literal["wall", "eq10"] = field("wall", scope="solved flows")
    """stress on the bed: at the wall, or at the first cell
    - wall: wall stress
    - eq10: stress of Eq. 10"""
    averaging_length: float = field(
        1 / 40,
        unit="h",
        scope="flows that change along the bed, and shared stress",
        ge=1e-4,
        le=100,
    )
    """least length of bed that a grain's stress is averaged on: the crest's own never
    converges with the mesh"""
    loaded_grains: Literal["exposed", "all but crest", "all but toe"] = _pile("exposed")
    """grains of a pile that feel the flow's force
    - exposed: all exposed grains
    - all but crest: exposed grains but for the topmost one
    - all but toe: exposed grains but for those on the lowest 5 % of the face"""
    exposure: Literal["alike", "protrusion"] = _poured("alike")
    """height at which the flow meets a grain
    - alike: every exposed grain stands z₀ above the bed, as in the paper
    - protrusion: each stands at its own height over the local bed"""
    sheltering: Literal["none", "balanced"] = _pile("none")
    """how the exposed grains of a pile share the stress of the flow
    - none: each feels the flow as if it stood alone, as in the paper
    - balanced: drags on a patch add up to its stress, by peeling or updates anew as
      grains leave"""


class Gusts(Part):
    """Peaks of the turbulent stress."""

    intensity: Annotated[float, Field(gt=0, le=1)]
    """standard deviation of the stress over its mean"""
    events: Annotated[int, Field(ge=2, le=10**9)]
    """how many independent events there are while the bed is watched"""
    duration: float = field(1.0, scope="DEM of piles", ge=0.05, le=1e4)
    """how long each lasts, √(d/g′); by default as an eddy of 3 d takes to pass in
    water"""

    def __str__(self) -> str:
        long = f"{self.duration:g} √(d/g′) long"
        return f"{self.events} of intensity {self.intensity:g}, {long}"


class Flow(Part):
    """What flows above the bed: its top, its depth and its gusts."""

    gusts: Gusts | None = field(None)
    """peaks of the turbulent stress, { intensity = 0.4, events = 100, duration = 1 }:
    independent, log-normal events, by default none; by pivots and peeling the largest
    acts, by DEM of piles all in each load step, each for a duration in √(d/g′), by
    default 1, of an eddy of 3 d in water"""
    top: Literal["open water", "closed channel", "boundary layer"] = field(
        "boundary layer", column="flow_top", label="top of the flow"
    )
    """what the flow has above
    - open water: a level surface without stress
    - closed channel: a wall as rough as the bed
    - boundary layer: the log layer goes on above"""
    depth: Length | None = field(None, symbol="D", unit="m", column="depth_m")
    """depth of open water or of a closed channel over the flat bed, at least three
    heights of forms and obstacles, over a level bed three of the largest grains"""
    towards: Literal["+x", "-x"] = field(
        WITH_X, label="the flow goes towards", scope="profiles"
    )
    """where the flow goes along x of the profile's file
    - +x: towards larger x
    - -x: towards smaller x"""


class Obstacle(Part):
    """An obstacle across the flow, which carries no grains."""

    kind: Literal["fence", "block", "half-cylinder"]
    """what it is; all have steep sides, none is upright"""
    x: float
    """place of its middle, downstream of the toe of the first form; with a profile its
    x"""
    height: Height
    """height over the bed"""
    length: Length | None = None
    """length of a block; by default its height"""
    porosity: float = field(0.0, ge=0, le=MOST_POROUS)
    """open part of a fence; of 0 it is solid"""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.porosity and self.kind != "fence":
            what = f"a {self.kind} of porosity {self.porosity:g}"
            raise UnfitError(
                "bed.obstacles", what, "a fence alone is porous: leave it out"
            )
        if self.length and self.kind != "block":
            what = f"a {self.kind} with a length of {metres(self.length)}"
            raise UnfitError(
                "bed.obstacles", what, "a block alone has a length: leave it out"
            )
        return self

    @property
    def is_porous(self) -> bool:
        """Whether the flow goes through it, too."""
        return self.porosity > 0

    @property
    def reach(self) -> float:
        """From its middle to the foot of its sides on level bed, at most, m."""
        sides = {"fence": 0.4, "block": 0.3, "half-cylinder": 1.1}
        reach = sides[self.kind] * self.height
        if self.kind == "block":
            reach += (self.length or self.height) / 2
        return reach

    def __str__(self) -> str:
        what = f"{self.kind} {metres(self.height)} high at x = {metres(self.x)}"
        if self.length:
            what += f", {metres(self.length)} long"
        if self.is_porous:
            return f"{what}, porosity {100 * self.porosity:.3g} %"
        return f"{what}, solid" if self.kind == "fence" else what


class Bed(Part):
    """Common fields of all beds. Subclasses add the grains."""

    slope_deg: float = field(0.0, symbol="α", unit="°", column="alpha_deg", ge=0, lt=90)
    """slope of the bed; the flow goes up it"""
    # at 60 the two grains below touch, at 0 the grain falls between them
    entrainment_angle_deg: float = field(
        60.0, symbol="β", unit="°", column="beta_deg", ge=1, le=60
    )
    """angle at which a grain leaves its pocket, between neighbours 2 d cos β apart"""
    roughness: Roughness = field(
        ...,
        symbol="z_0",
        unit="m",
        column="z0_m",
        label="roughness length",
        also='a part of the diameter, "d/30"',
    )
    """roughness length of the bed, or a part of the diameter of its grains, "d/30" """
    # a smaller grain falls through the pores of a bed, a larger one lies on many grains
    relative_size: float = field(
        1.0, symbol="D/d", scope="single grains", ge=0.1, le=10
    )
    """diameter of a single grain over that of its two neighbours"""


class GrainBed(Bed):
    """One grain on its two fixed neighbours (section 3.1 of the paper).

    The boundary layer around it is undisturbed.
    """

    kind: Literal["grain"] = "grain"


class PileBed(Bed):
    """Grains across the flow, under a bed line of any shape.

    That of the paper, section 3.2, is a triangle.
    """

    kind: Literal["pile"] = field(label="bed", column="bed")
    """what the bed is made of
    - grain: one grain on its two fixed neighbours, in an undisturbed boundary layer
    - pile: grains under any bed line: a form, a train of forms, a profile"""
    height: Height = _pile(0.02, symbol="h", unit="m", column="h_m")
    """height of the forms; that of a profile follows. A flat bed has none: with
    obstacles lengths in h are heights of the tallest, without any they are of 20
    diameters, whatever is given"""
    shape: ShapeName = _pile("triangle", column="bed_shape", choices=SHAPE_MEANINGS)
    """shape of a form, which `kind` may name too; `slope_deg` is that of its windward
    side, of a curve where it is steepest"""
    windward: Literal["straight", "curved"] = _dune("straight", label="windward side")
    """windward side of a dune
    - straight: one slope
    - curved: half a wave of a cosine"""
    lee_slope_deg: float | None = field(
        None, unit="°", scope="beds with a straight lee side", gt=0, le=60
    )
    """slope of a straight lee side or a step down; by default the windward side's, 30
    of a dune and a step down"""
    brink_radius: float = _dune(0.0, unit="m", ge=0, le=1e3)
    """radius with which a dune's brink is rounded; 0 leaves it sharp"""
    length: Length | None = field(None, unit="m", scope="beds with level parts")
    """length of level bed with grains: a trapezoid's top, a flat bed, before or behind
    a step; by default 4 h, of a flat bed 80 diameters"""
    forms: int = field(1, scope="shapes of trains", ge=1, le=100)
    """number of forms in a train"""
    spacing: Length | None = field(None, scope="shapes of trains", unit="m")
    """from one form of a train to the next; by default they touch"""
    profile: File | None = _pile(None)
    """file with the bed line, in place of a shape: columns x_m and z_m; of a folder
    each file .csv or .txt is a bed; its path is relative to the study file"""
    smoothing: float = field(0.0, unit="m", scope="profiles", ge=0, le=1e3)
    """length over which a noisy profile is smoothed"""
    obstacles: Annotated[tuple[Obstacle, ...], List] = _pile((), read="obstacles")
    """fences, blocks and half-cylinders, which carry no grains: tables with `kind`,
    `x`, `height`, of a block `length`, and of a fence `porosity`, its open part, of
    which 0 is solid"""
    counted: Literal["windward", "all"] | Range | None = _pile(
        None, label="counted grains", read="counts"
    )
    """exposed grains that are counted, or their range of x, with a profile that of its
    file, which on a bed of more than 5000 grains is packed alone; by default those of
    windward sides, of a flat bed and a step down all
    - windward: on sides that rise, of a profile where the flow goes up them
    - all: all"""
    packing: Packing = _pile("aligned")
    """pattern of the pile's grains
    - aligned: rows along the slope
    - horizontal: horizontal rows, which make stairs of the faces
    - disordered: rows along the slope with random gaps
    - poured: poured by LIGGGHTS into a mould of the bed line, settled and cut to it"""
    disorder: float = field(0.02, unit="d", scope="disordered piles", ge=1e-6, le=0.2)
    """largest gap between two grains of the row under the four uppermost"""
    poured_depth: float = _poured(
        6.0, unit="d", label="depth of the mould", ge=3, le=100
    )
    """vertical depth of a poured bed under the bed line, to a row of fixed grains"""
    width: float = _poured(0.0, unit="d", label="width of the strip", ge=0, le=50)
    """width of a strip of poured grains with periodic sides, at least 3 of the largest;
    0 is one layer in the plane of the flow"""
    dropped_grains: int = field(0, scope="strips that DEM follows", ge=0, le=1000)
    """grains that are dropped on a strip as each load step begins, from 5 d over it: 0
    asks when the bed starts as it was cut, a few whether the motion that they begin is
    sustained; they are not counted"""
    seed: int = field(0, scope="random beds and replicas", ge=0, le=10**9)
    """which of the many random packings; of a lattice 0 is itself, any other a replica
    with grains up to 1e-6 d aside"""

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
        return self.length or 4.0 * self.height

    @property
    def relief(self) -> float:
        """Height of what the flow goes over, m.

        It is that of the forms, on a flat bed that of its obstacles.
        """
        if self.form.is_level and not self.profile and self.obstacles:
            return max(each.height for each in self.obstacles)
        return self.height

    @property
    def highest(self) -> float:
        """Height of the highest form or obstacle, m."""
        return max([self.relief, *(each.height for each in self.obstacles)])

    @property
    def counts(self) -> str | Range:
        """Which exposed grains are counted.

        Of a profile the default depends on no slope of its points, which smoothing
        changes.
        """
        if self.counted:
            return self.counted
        return "windward" if self.profile else self.form.counted

    def place(self, x: ArrayLike) -> FloatArray:
        """Find places of the user: of a profile those of its file.

        Parameters
        ----------
        x
            x of the bed line, m, of any shape.

        Returns
        -------
        ndarray
            x as the user has it, m, of the same shape.
        """
        if self.profile:
            return self.profile.place(x)
        return np.asarray(x, float)

    def along(self, x: ArrayLike) -> FloatArray:
        """Find x of the bed line, of places that `place` gives.

        Parameters
        ----------
        x
            x as the user has it, m, of any shape.

        Returns
        -------
        ndarray
            x of the bed line, m, of the same shape.
        """
        if self.profile:
            return self.profile.along(x)
        return np.asarray(x, float)

    def level(self, z: ArrayLike) -> FloatArray:
        """Find heights of the user: of a profile those of its file.

        Parameters
        ----------
        z
            z of the bed line, m, of any shape.

        Returns
        -------
        ndarray
            z as the user has it, m, of the same shape.
        """
        up = self.profile.origin[1] if self.profile else 0.0
        return up + np.asarray(z, float)

    @property
    def is_level(self) -> bool:
        """Whether the flow finds nothing on it that it has to go over or round."""
        return self.form.is_level and not self.profile and not self.obstacles

    @property
    def shape_name(self) -> str:
        """Name of its shape; of a bed that is read from a file ``profile``."""
        return "profile" if self.profile else self.shape

    @property
    def is_triangle(self) -> bool:
        """Whether it is the paper's bed.

        That is one triangle of two equal faces, of which the windward one is counted.
        """
        is_equal = self.lee_slope == self.slope_deg
        return self.is_wedge and is_equal and not self.obstacles

    @property
    def is_wedge(self) -> bool:
        """Whether it is one form of two straight faces.

        Grains on the windward one are counted.
        """
        if not self.form.is_wedge or self.is_bent:
            return False
        if self.forms > 1 or self.profile or self.counts != "windward":
            return False
        base = sum(
            self.height / tan(radians(slope))
            for slope in (self.slope_deg, self.lee_slope)
        )
        return not any(
            o.x + o.reach > 0 and o.x - o.reach < base for o in self.obstacles
        )

    @property
    def is_bent(self) -> bool:
        """Whether straight faces of its shape are curved or rounded."""
        return self.windward == "curved" or bool(self.brink_radius)

    @property
    def is_replica(self) -> bool:
        """Whether it is a lattice but for shifts that change round-off alone."""
        return self.packing in ("aligned", "horizontal") and self.seed > 0


class ThresholdPart(Part):
    """What is counted as motion, and at which parts of the grains."""

    displacement: float = field(
        0.3,
        unit="d",
        column="displacement_criterion",
        label="displacement criterion",
        scope="DEM and peeling",
        ge=1e-3,
        le=0.5,
    )
    """displacement along the bed from which a grain counts as moved"""
    criterion: Literal["auto", "entrained", "sustained"] = field("auto")
    """what a grain must do
    - auto: entrained in the paper's gas (`fluid.kind`); in every other fluid sustained,
      or entrained where a field of the scene rules it out: a mixture, gusts, shared
      stress, a bed that changes, the laws of the paper, a single grain by DEM
    - entrained: leave its pocket in the flow, as in the paper
    - sustained: leave it in a gust of 2.28 times the mean stress, and go on after it"""
    fractions: Annotated[tuple[Fraction, ...], List] = _pile(
        (0.1, 0.3, 0.5, 0.7), symbol="n/N", column="-", min_length=1
    )
    """fractions of the exposed grains at which the thresholds of a pile are reported"""
    update: Annotated[float, Field(ge=0, le=0.5)] = field(
        0.0,
        unit="of N",
        label="update of the bed",
        scope="DEM and peeling of piles",
    )
    """part of the counted grains after which the flow is solved over the bed line of
    the remaining ones, up to the last fraction; 0 keeps the first flow, as in the
    paper"""


def percentile(sizes: Sizes | None, diameter: float, part: float) -> float:
    """Compute the diameter that a part of the mass is finer than.

    It is straight in its logarithm between classes.

    Parameters
    ----------
    sizes
        The mixture; None for equal grains.
    diameter
        That of equal grains, or the median of a log-normal distribution, m.
    part
        Part of the mass, 0 to 1.

    Returns
    -------
    float
        The diameter, m.
    """
    if sizes is None:
        return diameter
    if isinstance(sizes, LogNormal):
        return rounded(diameter * float(sizes.quantile(part, power=0)))
    diameters, fractions = np.array(sizes).T
    finer = np.cumsum(fractions) - fractions / 2
    # the exponential of a logarithm is not the number itself to the last digit
    return rounded(np.exp(np.interp(part, finer, np.log(diameters))))


def extremes(sizes: Sizes | None, diameter: float) -> tuple[float, float]:
    """Find the smallest and the largest grain of a mixture.

    Parameters
    ----------
    sizes
        The mixture; None for equal grains.
    diameter
        A diameter, m.

    Returns
    -------
    smallest, largest : float
        Diameters over the given one; both 1 of equal grains.
    """
    if isinstance(sizes, LogNormal):
        return sizes.ends
    return (sizes[0][0] / diameter, sizes[-1][0] / diameter) if sizes else (1.0, 1.0)


class Erosion(Part):
    """What `orchestrator erosion` asks of a stockpile.

    It is the winds and the threshold of its surface.
    """

    fastest_mile: Annotated[tuple[Wind, ...], List, Field(min_length=1)] = (20.0,)
    """fastest mile of each time between two disturbances, wind at 10 m, m/s; by default
    a gale"""
    threshold: float | str | None = None
    """friction velocity, m/s, or a material in the table of AP-42; by default the
    closed form"""
