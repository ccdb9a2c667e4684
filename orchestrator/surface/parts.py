"""What is asked of a bed in three dimensions, and how its flow is solved.

Such a bed has no packing of grains: each of its faces has one exposed grain in its
pocket.
"""

from functools import cached_property
from typing import Annotated, Any, Literal, Self, get_args

import numpy as np
from pydantic import Field, InstanceOf, model_validator

from orchestrator.physics.grain import Grain
from orchestrator.physics.threshold import AUTO, PAPER, usual_law
from orchestrator.runs.files import canonical_json, digest_text
from orchestrator.study.declare import Height, Part, Roughness, UnfitError, Viscosity
from orchestrator.study.declare import field as declared
from orchestrator.study.method import Turbulence
from orchestrator.study.parts import LAW_LABELS, Drag, Erosion, Fluid, Sphere
from orchestrator.surface.ground import RoughnessMap
from orchestrator.surface.heights import Surface, barchan, cone, oval
from orchestrator.surface.rose import Rose

Shape = Literal["cone", "oval", "barchan"]
OVAL_LENGTH = 3.0
"""Length of the flat top of an oval over its height, where none is given."""
ROUGHEST = 1 / 20
"""Largest roughness length over the height of a form: its elements would stand out of
the cells."""


class SurfaceGrain(Sphere):
    """The sphere that lies exposed on each face: its size, its weight, its cohesion."""

    cohesion: float = declared(0.0, unit="N/m", ge=0, le=1e3)
    """pull of a contact over the diameter"""


class SurfaceBed(Part):
    """Heights on a raster: a file, or a shape with a height and a slope."""

    kind: Literal["surface"]
    """what the bed is made of
    - surface: heights over a plane, on a raster or of a shape"""
    surface: InstanceOf[Surface] | None = None
    """file with heights, .tif, .asc, .xyz, .csv or .stl; its path is relative to the
    study file"""
    shape: Shape | None = None
    """a shape in place of a file
    - cone: a cone
    - oval: a heap with a flat top, straight in the middle and round at its ends
    - barchan: a dune that wind from the west has made"""
    height: Height | None = declared(None, symbol="h", unit="m")
    """height of a shape"""
    slope_deg: Annotated[float, Field(ge=1, le=60)] | None = declared(None, unit="°")
    """slope of a cone or of an oval's sides; of a barchan at its toe"""
    length: Height | None = declared(None, unit="m")
    """length of an oval's flat top along y; by default three heights"""
    width: Height | None = declared(None, unit="m")
    """width of an oval's flat top along x; by default one height"""
    smoothing_cells: Annotated[float, Field(ge=0.25, le=10)] | None = declared(
        None, unit="cells of the flow"
    )
    """standard deviation over which heights are smoothed; by default 0.75 of a file and
    0.5 of a shape"""
    roughness: Roughness = declared(..., symbol="z_0", unit="m")
    """roughness length of the bed, or a part of the diameter, "d/30" """
    entrainment_angle_deg: float = declared(60.0, symbol="β", unit="°", ge=1, le=60)
    """angle at which a grain leaves its pocket"""

    @cached_property
    def heights(self) -> Surface:
        """Heights of the file or of the shape, with their smoothing."""
        found = self.surface or self._of_shape()
        if self.smoothing_cells is None:
            return found
        return found.spread_over(self.smoothing_cells)

    def _of_shape(self) -> Surface:
        """Heights of the shape."""
        height, slope = self.height, self.slope_deg
        assert height is not None
        assert slope is not None
        if self.shape == "cone":
            return cone(height, slope)
        if self.shape == "barchan":
            return barchan(height, slope)
        return oval(height, slope, *self.top)

    @property
    def top(self) -> tuple[float, float]:
        """Length and width of an oval's flat top, m."""
        assert self.height is not None
        return self.length or OVAL_LENGTH * self.height, self.width or self.height

    @model_validator(mode="after")
    def _is_one_surface(self) -> Self:
        """Refuse a file with fields of a shape, and a shape that is not whole."""
        if (self.surface is None) == (self.shape is None):
            what = "give either a file or a shape"
            names = " | ".join(f'"{name}"' for name in get_args(Shape))
            remedy = f'bed.surface = "pile.tif", or bed.shape = {names}'
            raise UnfitError("bed.surface", what, remedy)
        if self.shape is None:
            self._refuse("a file has its own", "height", "slope_deg", "length", "width")
            return self
        for name in ("height", "slope_deg"):
            if getattr(self, name) is None:
                what = f"a {self.shape} needs it"
                raise UnfitError(f"bed.{name}", what, "add it to the file")
        if self.shape != "oval":
            self._refuse(f"a {self.shape} has none", "length", "width")
        elif self.top[0] < self.top[1]:
            what = "it is less than the width"
            raise UnfitError("bed.length", what, "the long side is along y")
        return self

    def _refuse(self, what: str, *names: str) -> None:
        """Refuse fields that are given."""
        for name in names:
            if getattr(self, name) is not None:
                raise UnfitError(f"bed.{name}", what)


class SurfaceFlow(Part):
    """The wind over the bed."""

    from_deg: float = declared(270.0, unit="°", ge=0, lt=360)
    """where the wind comes from, from north (+y) over east (+x)"""


class SurfaceFlowMethod(Part):
    """How the flow over the bed is solved."""

    level: Literal["coarse", "standard"] = declared(
        "coarse",
        choices={
            "coarse": "some 100,000 cells, on one core",
            "standard": "some 250,000 cells, on two cores",
        },
    )
    """how fine the mesh is"""
    roughness: Roughness | None = declared(None, symbol="z_0", unit="m")
    """roughness length at which the flow is solved; by default the bed's"""
    roughness_map: InstanceOf[RoughnessMap] | None = None
    """raster of roughness lengths of the ground, .tif or .asc, m; its empty cells, what
    lies outside and the approaching wind have `roughness`"""
    speed: float = declared(10.0, symbol="U_e", unit="m/s", ge=1e-6, le=1e3)
    """speed ten heights above the ground at which the flow is solved"""
    viscosity: Viscosity | None = declared(None, symbol="ν", unit="m²/s")
    """kinematic viscosity of the solve"""
    turbulence_model: Turbulence = "kEpsilon"
    """OpenFOAM's turbulence model"""
    first_cell_height: Height | None = declared(None, unit="m")
    """height of the cells on the bed; by default h/40"""


class SurfaceMethod(Part):
    """How a surface is answered."""

    flow: SurfaceFlowMethod = SurfaceFlowMethod()


class SurfaceErosion(Erosion):
    """What is asked of the wind, and by the command `erosion`."""

    wind: InstanceOf[Rose] | None = None
    """winds of the place, a text file: a series with a time, a speed and a direction in
    each line, or a table of frequencies (docs/your-files.md)"""
    wind_height: Annotated[float, Field(ge=0.1, le=1000)] | None = declared(
        None, unit="m"
    )
    """height of these winds above the ground, from which they go to 10 m by the log law
    over the roughness length of the ground; by default that in the file, or 10 m"""


class SurfaceScene(Part):
    """One surface under the wind of one direction."""

    fluid: Fluid = Fluid()
    grain: SurfaceGrain
    bed: SurfaceBed
    flow: SurfaceFlow = SurfaceFlow()
    forces: Drag = Drag()
    method: SurfaceMethod = SurfaceMethod()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        """Refuse fields that do not go together."""
        if self.grain.density <= self.fluid.density:
            what = "not above the fluid's"
            remedy = "raise it, or lower fluid.density"
            raise UnfitError("grain.density", what, remedy)
        if self.forces.law == PAPER:
            what = f"{PAPER!r} is no law of a surface"
            listed = ", ".join(law for law in LAW_LABELS if law != PAPER)
            raise UnfitError("forces.law", what, f"choose one of: {listed}")
        relief = self.heights.relief
        if self.solve_roughness > ROUGHEST * relief:
            what = f"{self.solve_roughness:g} m on a form {relief:.3g} m high"
            remedy = "lower it: its elements would stand out of the cells"
            raise UnfitError("method.flow.roughness", what, remedy)
        self._check_map()
        return self

    def _check_map(self) -> None:
        """Refuse a map of roughness that does not belong to the bed."""
        ground = self.method.flow.roughness_map
        if ground is None:
            return
        field = "method.flow.roughness_map"
        largest = float(np.nanmax(ground.z0))
        if largest > ROUGHEST * self.heights.relief:
            what = f"{largest:g} m on a form {self.heights.relief:.3g} m high"
            raise UnfitError(field, what, "its elements would stand out of the cells")
        system = self.heights.system
        if ground.system and system and ground.system != system:
            what = "its coordinate system is not that of the surface"
            raise UnfitError(field, what, "bring it there, with gdalwarp -t_srs")
        x, y = np.meshgrid(self.heights.x, self.heights.y)
        known = ground.at(x, y, np.nan)[self.heights.is_form]
        if np.isnan(known).all():
            what = "it has no cell on the form"
            remedy = "both rasters have their places in one coordinate system"
            raise UnfitError(field, what, remedy)

    @property
    def id(self) -> str:
        """What tells it from every other scene: its fields, and its heights."""
        rasters: Any = {"bed": {"surface"}, "method": {"flow": {"roughness_map"}}}
        parts = [self.model_dump(mode="json", exclude=rasters), self.heights.digest]
        ground = self.method.flow.roughness_map
        if ground:
            parts.append(ground.digest)
        return digest_text(canonical_json(parts))[:12]

    @property
    def heights(self) -> Surface:
        """Heights of the bed."""
        return self.bed.heights

    @property
    def solve_roughness(self) -> float:
        """Roughness length at which the flow is solved, m."""
        return self.method.flow.roughness or self.bed.roughness

    @property
    def is_natural(self) -> bool:
        """Whether its fluid is not the paper's gas, in which nothing is measured."""
        return not self.fluid.is_paper

    @property
    def grain_in_pocket(self) -> Grain:
        """The grain of a level face."""
        return Grain(
            diameter=self.grain.diameter,
            roughness=self.bed.roughness,
            fluid_density=self.fluid.density,
            viscosity=self.fluid.viscosity,
            lift_coefficient=self.forces.lift_coefficient,
            density=self.grain.density,
            slope_deg=0.0,
            entrainment_angle_deg=self.bed.entrainment_angle_deg,
            gravity=self.fluid.gravity,
            cohesion=self.grain.cohesion,
        )

    @property
    def law(self) -> str:
        """The force law that answers: where none is asked for, one that holds."""
        if self.forces.law != AUTO:
            return self.forces.law
        return usual_law(self.grain_in_pocket)

    @property
    def name(self) -> str:
        """The bed in a few words."""
        words = [self.heights.name]
        if self.bed.surface is not None:
            # nothing in most files says that their numbers are metres
            words.append("{:.4g} m by {:.4g} m".format(*self.heights.extent))
        words.append(f"{self.heights.relief:.4g} m high")
        if self.bed.slope_deg is not None:
            words.append(f"{self.bed.slope_deg:g}°")
        words.append(f"z₀ {1e3 * self.solve_roughness:.3g} mm")
        if self.method.flow.roughness_map:
            words.append(f"z₀ by place of {self.method.flow.roughness_map.name}")
        return ", ".join(words)
