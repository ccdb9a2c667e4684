"""The bed of a scene: one grain on its neighbours, or grains under a bed line."""

from math import radians, tan
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, InstanceOf, PlainSerializer, field_validator

from orchestrator.study.part import Height, Info, Length, Part, Roughness, unless
from orchestrator.study.profile import Profile
from orchestrator.study.shapes import SHAPES, Shape

Packing = Literal["aligned", "horizontal", "disordered", "poured"]
if TYPE_CHECKING:
    ShapeName = str
else:
    ShapeName = Literal[tuple(SHAPES)]
Range = tuple[float, float]
File = Annotated[InstanceOf[Profile], PlainSerializer(lambda profile: profile and profile.digest)]
BEDS = {
    "grain": "one grain on its two fixed neighbours, in an undisturbed boundary layer",
    "pile": "grains of any bed line across the flow: a form, a train of forms, a profile",
}
LEVEL = 4.0
"""Length of level bed with grains, over the height."""


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


class Bed(Part):
    """Common fields of all beds. Subclasses add the grains."""

    slope_deg: Annotated[float, Field(ge=0, lt=90), Info("slope", "α", "°", "alpha_deg")] = 0.0
    """slope of the bed; the flow goes up it"""
    # at 60 the two grains below touch, at 0 the grain falls between them
    entrainment_angle_deg: Annotated[
        float, Field(ge=1, le=60), Info("entrainment angle", "β", "°", "beta_deg")
    ] = 60.0
    """angle at which a grain leaves its pocket: the neighbours below it are 2 d cos β apart"""
    roughness: Annotated[Roughness, Info("roughness length", "z_0", "m", "z0_m")]
    """roughness length of the bed; a study file may write a part of the diameter of the bed's
    grains: "d/30" """
    # a smaller grain falls through the pores of a bed, a larger one lies on many grains
    relative_size: Annotated[
        float,
        Field(ge=0.1, le=10),
        unless(1.0),
        Info("relative size", "D/d", scope="single grains"),
    ] = 1.0
    """diameter of a single grain over that of its two neighbours, which lie as far apart as equal
    grains do: 2 d cos β"""


class GrainBed(Bed):
    """One grain on its two fixed neighbours, in an undisturbed boundary layer (paper, 3.1)."""

    kind: Annotated[Literal["grain"], Info("bed", column="bed", choices=BEDS)] = "grain"
    """what the bed is made of"""


class PileBed(Bed):
    """Grains across the flow, under a bed line of any shape (the paper's, 3.2, is a triangle)."""

    kind: Annotated[Literal["pile"], Info("bed", column="bed", choices=BEDS)]
    """what the bed is made of"""
    height: Annotated[Height, Info("height", "h", "m", "h_m", scope="piles")] = 0.02
    """height of the forms that the flow goes over; that of a profile follows from it, and over a
    flat bed with obstacles the flow is measured in the height of the tallest"""
    shape: Annotated[
        ShapeName,
        unless("triangle"),
        Info(
            "shape",
            column="bed_shape",
            scope="piles",
            choices={name: shape.meaning for name, shape in SHAPES.items()},
        ),
    ] = "triangle"
    """shape of a form; `slope_deg` is that of its windward side, of a curve where it is steepest"""
    windward: Annotated[
        Literal["straight", "curved"],
        unless("straight"),
        Info(
            "windward side",
            scope="dunes",
            choices={"straight": "one slope", "curved": "half a wave of a cosine"},
        ),
    ] = "straight"
    """windward side of a dune"""
    lee_slope_deg: Annotated[
        Annotated[float, Field(gt=0, le=60)] | None,
        unless(None),
        Info("lee slope", unit="°", scope="piles"),
    ] = None
    """slope of a straight lee side or a step down; by default that of the windward side, 30 of a
    dune and a step down"""
    brink_radius: Annotated[
        float, Field(ge=0, le=1e3), unless(0.0), Info("brink radius", unit="m", scope="dunes")
    ] = 0.0
    """radius with which a dune's brink is rounded; 0 leaves it sharp"""
    length: Annotated[
        Length | None, unless(None), Info("length", unit="m", scope="beds with level parts")
    ] = None
    """length of level bed with grains: of a trapezoid's top, of a flat bed, before or behind a
    step; by default 4 h"""
    forms: Annotated[int, Field(ge=1, le=100), unless(1), Info("forms", scope="piles")] = 1
    """number of forms in a train"""
    spacing: Annotated[Length | None, unless(None), Info("spacing", unit="m", scope="piles")] = None
    """from one form of a train to the next; by default they touch"""
    profile: Annotated[File | None, unless(None), Info("profile", scope="piles")] = None
    """file with the bed line, in place of a shape: columns x_m and z_m; a path is relative to the
    study file"""
    smoothing: Annotated[
        float, Field(ge=0, le=1e3), unless(0.0), Info("smoothing", unit="m", scope="profiles")
    ] = 0.0
    """length over which a noisy profile is smoothed"""
    obstacles: Annotated[tuple[Obstacle, ...], unless(()), Info("obstacles", scope="piles")] = ()
    """fences, blocks and half-cylinders on the bed, which carry no grains: tables with `kind`, `x`,
    `height` and, of a block, `length`"""
    counted: Annotated[
        Literal["windward", "all"] | Range | None,
        unless(None),
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
        Field(ge=3, le=100),
        unless(6.0),
        Info("depth of the mould", unit="d", scope="poured beds"),
    ] = 6.0
    """depth of a poured bed under the bed line, along the vertical, to a row of fixed grains"""
    width: Annotated[
        float,
        Field(ge=0, le=50),
        unless(0.0),
        Info("width of the strip", unit="d", scope="poured beds", about="answer"),
    ] = 0.0
    """width of a poured bed across the flow, a strip in space with periodic sides: at least 3 of
    its largest grains; 0 is one layer of grains in the plane of the flow"""
    seed: Annotated[
        int, Field(ge=0, le=10**9), Info("seed", scope="random beds and replicas", about="replica")
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
        stands = [one.height for one in self.obstacles]
        flat = self.shape == "flat" and not self.profile
        return max(stands) if flat and stands else self.height

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
