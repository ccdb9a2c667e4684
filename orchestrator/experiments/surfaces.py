"""Study files of a bed in three dimensions: ``[bed] kind = "surface"``.

Such a bed has no packing of grains: each of its faces has one exposed grain in its
pocket. What a grain by grain answer needs is refused here.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, InstanceOf, ValidationError

from orchestrator.bed import surface
from orchestrator.bed.raster import read_surface
from orchestrator.bed.surface import Surface
from orchestrator.errors import InputError
from orchestrator.physics import fluids
from orchestrator.physics.fluids import PAPER as PAPER_FLUID
from orchestrator.physics.threshold import (
    AUTO,
    PAPER,
    SingleGrain,
    default_laws,
    thresholds_of,
)
from orchestrator.runs.files import digest_file
from orchestrator.study import units
from orchestrator.study.declare import List, Part
from orchestrator.study.keys import Table
from orchestrator.study.method import Turbulence
from orchestrator.study.parts import Fluid, Forces
from orchestrator.study.profile import decoded, read_bytes
from orchestrator.study.rose import Rose, read_rose
from orchestrator.study.scene import roughness_length
from orchestrator.study.source import Source, find
from orchestrator.study.study import (
    MOST_BYTES,
    at_points,
    check_once,
    meant,
    not_accepted,
    tables_of,
)

Shape = Literal["cone", "oval", "barchan"]
Positive = Annotated[float, Field(gt=0, le=1e4)]
Wind = Annotated[float, Field(gt=0, le=150)]
KIND = "surface"
MOST_FLOWS = 360
LARGEST_ROSE = 2**22
"""Most bytes of a wind rose."""
OVAL_LENGTH = 3.0
"""Length of the flat top of an oval over its height, where none is given."""
OF_GRAINS = {
    "bed": (
        *("packing", "counted", "mobile_layers", "disorder", "poured_depth", "width_d"),
        *("seed", "forms", "spacing", "profile", "lee_slope_deg"),
    ),
    "grain": ("sizes", "stiffness", "damping"),
    "forces": ("exposure", "sheltering", "stress", "averaging_length", "loaded_grains"),
    "flow": ("depth", "top", "gusts", "lid", "model", "cells_per_face"),
    "threshold": ("fractions", "update", "displacement"),
}
"""Fields of beds of grains in a plane that a surface has not, by table."""


class SurfaceGrain(Part):
    """The grain that lies exposed on each face."""

    diameter: float = Field(ge=1e-7, le=10)
    """grain diameter, m"""
    density: float = Field(default=2500.0, ge=0.1, le=25_000)
    """density of the grains, kg/m3"""
    cohesion: float = Field(default=0.0, ge=0, le=1e3)
    """pull of a contact over the diameter, N/m"""


class SurfaceBed(Part):
    """Heights on a raster: a file, or a shape with a height and a slope."""

    kind: Literal["surface"]
    """what the bed is made of"""
    surface: str | None = None
    """file with heights; its path is relative to the study file"""
    shape: Shape | None = None
    """a shape in place of a file"""
    height: Positive | None = None
    """height of a shape, m"""
    slope_deg: Annotated[float, Field(ge=1, le=60)] | None = None
    """slope of a cone or of an oval's sides; of a barchan at its toe, degrees"""
    length: Positive | None = None
    """length of an oval's flat top along y, m; by default three heights"""
    width: Positive | None = None
    """width of an oval's flat top along x, m; by default one height"""
    smoothing_cells: Annotated[float, Field(ge=0.25, le=10)] | None = None
    """standard deviation over which heights are smoothed, in cells of the flow's mesh;
    by default 0.75 of a file and 0.5 of a shape"""
    roughness: Annotated[float, Field(ge=1e-12, le=10)]
    """roughness length of the bed, m, or a part of the diameter, "d/30" """
    entrainment_angle_deg: float = Field(default=60.0, ge=1, le=60)
    """angle at which a grain leaves its pocket, degrees"""


class SurfaceFlow(Part):
    """The wind over the bed."""

    from_deg: float = Field(default=270.0, ge=0, lt=360)
    """where the wind comes from, degrees from north (+y) over east (+x)"""


class SurfaceForces(Part):
    """How a grain feels the flow."""

    law: str = AUTO
    """force law"""
    lift_coefficient: float = Forces.model_fields["lift_coefficient"].default
    """lift coefficient"""


class SurfaceMethod(Part):
    """How the flow is solved: the table ``[method.flow]``."""

    level: Literal["coarse", "standard"] = "coarse"
    """how fine the mesh is"""
    roughness: Annotated[float, Field(ge=1e-12, le=10)] | None = None
    """roughness length at which the flow is solved, m; by default the bed's"""
    speed: float = Field(default=10.0, ge=1e-6, le=1e3)
    """speed ten heights above the ground at which the flow is solved, m/s"""
    viscosity: Annotated[float, Field(ge=1e-8, le=1e3)] | None = None
    """kinematic viscosity of the solve, m2/s"""
    turbulence_model: Turbulence = "kEpsilon"
    """OpenFOAM's turbulence model"""
    first_cell_height: Positive | None = None
    """height of the cells on the bed, m; by default h/40"""


class SurfaceErosion(Part):
    """What is asked of the wind."""

    fastest_mile: Annotated[tuple[Wind, ...], List, Field(min_length=1)] = (20.0,)
    """fastest mile of each time between two disturbances, wind at 10 m, m/s"""
    threshold: float | str | None = None
    """friction velocity of every face, m/s, or a material of AP-42; by default the
    closed form"""
    wind: str | None = None
    """wind rose, a CSV file with the columns from_deg, speed_m_s and share"""


class SurfaceScene(Part):
    """One surface under the wind of one direction."""

    fluid: Fluid = Fluid()
    grain: SurfaceGrain
    bed: SurfaceBed
    flow: SurfaceFlow = SurfaceFlow()
    forces: SurfaceForces = SurfaceForces()
    method: SurfaceMethod = SurfaceMethod()
    heights: InstanceOf[Surface]
    """the surface that the bed names"""

    @property
    def solve_roughness(self) -> float:
        """Roughness length at which the flow is solved, m."""
        return self.method.roughness or self.bed.roughness

    @property
    def is_natural(self) -> bool:
        """Whether its fluid is not the paper's, in which nothing is measured."""
        return (self.fluid.density, self.fluid.viscosity) != PAPER_FLUID[:2]

    @property
    def grain_in_pocket(self) -> SingleGrain:
        """The grain of a level face."""
        return SingleGrain(
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
        grain = self.grain_in_pocket
        (at,) = thresholds_of("bridged", [grain])
        return str(default_laws(at.friction_velocity, grain.exposure))

    @property
    def name(self) -> str:
        """The bed in a few words."""
        bed = self.bed
        words = [bed.surface or str(bed.shape), f"{self.heights.relief:.4g} m high"]
        if bed.slope_deg is not None:
            words.append(f"{bed.slope_deg:g}°")
        words.append(f"z₀ {1e3 * self.solve_roughness:.3g} mm")
        return ", ".join(words)


PARTS: Mapping[str, type[Part]] = {
    "fluid": Fluid,
    "grain": SurfaceGrain,
    "bed": SurfaceBed,
    "flow": SurfaceFlow,
    "forces": SurfaceForces,
    "method.flow": SurfaceMethod,
}
"""Those of them that a scene has."""
TABLES: Mapping[str, type[Part]] = {**PARTS, "erosion": SurfaceErosion}
"""The tables of a study file on a surface."""


class _File(Part):
    """The tables of a file, which are validated scene by scene."""

    title: str = ""
    time_limit: float = Field(default=3600.0, gt=0, le=1e8)
    fluid: Table = Field(default={})
    grain: Table = Field(default={})
    bed: Table
    flow: Table = Field(default={})
    forces: Table = Field(default={})
    method: Table = Field(default={})
    erosion: SurfaceErosion = SurfaceErosion()
    axes: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(default={})


@dataclass(frozen=True)
class SurfaceStudy:
    """The content of a study file on a surface.

    Attributes
    ----------
    name, title
        The name of the file without its ending, and its title.
    scenes
        A scene for each combination of the axes' values.
    erosion
        Winds and threshold.
    rose
        The wind rose, if one is named.
    time_limit_s
        Wall time after which one run of the solver counts as hung, s.
    source
        What it was read from.
    """

    name: str
    title: str
    scenes: tuple[SurfaceScene, ...]
    erosion: SurfaceErosion
    rose: Rose | None
    time_limit_s: float
    source: Source

    @property
    def file(self) -> str:
        """Absolute path of the study file."""
        return self.source.file

    @cached_property
    def questions(self) -> tuple[str, ...]:
        """Questions on numbers that are usual in another unit."""
        values = {
            "grain.diameter": [scene.grain.diameter for scene in self.scenes],
            "grain.density": [scene.grain.density for scene in self.scenes],
            "fluid.density": [scene.fluid.density for scene in self.scenes],
            "fluid.viscosity": [scene.fluid.viscosity for scene in self.scenes],
            "grain.cohesion": [scene.grain.cohesion for scene in self.scenes],
        }
        return tuple(units.questions(values, {}))


def load(source: str | Path) -> SurfaceStudy | None:
    """Read a study file on a surface.

    Parameters
    ----------
    source
        The path of the file, or the name of a preset.

    Returns
    -------
    SurfaceStudy or None
        The study; None if the bed of the file is no surface.

    Raises
    ------
    InputError
        With the file, the field and the remedy.
    """
    path = find(source)
    content = read_bytes(path, MOST_BYTES, str(source))
    where = str(path)
    tables = tables_of(decoded(content, str(source)), where)
    bed = tables.get("bed")
    if not isinstance(bed, dict) or bed.get("kind") != KIND:
        return None
    try:
        file = _File.model_validate(tables)
    except ValidationError as error:
        raise _explained(error, where, "") from None
    reader = _Files(path.parent, where)
    rose = None
    if file.erosion.wind is not None:
        rose = reader.rose(file.erosion.wind)
    scenes = tuple(_scenes(file, reader))
    digests = {**reader.digests, path.name: sha256(content).hexdigest()}
    return SurfaceStudy(
        name=path.stem,
        title=file.title or path.stem,
        scenes=scenes,
        erosion=file.erosion,
        rose=rose,
        time_limit_s=file.time_limit,
        source=Source(str(path.absolute()), digests),
    )


class _Files:
    """The files that a study file on a surface names, each read once."""

    def __init__(self, folder: Path, where: str) -> None:
        self.folder = folder
        self.where = where
        self.digests: dict[str, str | None] = {}
        self._surfaces: dict[str, Surface] = {}

    def surface(self, name: str) -> Surface:
        """The surface of a file."""
        path = self.folder / name
        if name not in self._surfaces:
            where = f"{self.where}: bed.surface: {path}"
            self._surfaces[name] = read_surface(path, where)
            self.digests[name] = digest_file(path)
        return self._surfaces[name]

    def rose(self, name: str) -> Rose:
        """The wind rose of a file."""
        path = self.folder / name
        where = f"{self.where}: erosion.wind: {path}"
        content = read_bytes(path, LARGEST_ROSE, where)
        self.digests[name] = sha256(content).hexdigest()
        return read_rose(decoded(content, where), path.name, where)


def _scenes(file: _File, files: _Files) -> Iterator[SurfaceScene]:
    """A scene for each combination of the axes' values."""
    where = files.where
    count = math.prod(map(len, file.axes.values()))
    if count > MOST_FLOWS:
        what = f"{count} combinations, more than {MOST_FLOWS}"
        raise InputError(what, f"{where}: axes", "shorten the lists")
    for key in file.axes:
        table, _, name = key.rpartition(".")
        if table not in PARTS or name not in PARTS[table].model_fields:
            remedy = meant(key.split("."), [], PARTS)
            raise InputError("no field of a surface", f"{where}: axes.{key}", remedy)
    points: dict[SurfaceScene, tuple[Any, ...]] = {}
    for point, tables in at_points(_tables(file, where), file.axes):
        scene = _scene(tables, files)
        check_once(points, scene, point, where)
        yield scene


def _tables(file: _File, where: str) -> dict[str, Table]:
    """The tables of a file by their names, a copy of each."""
    method = dict(file.method)
    flow = method.pop("flow", {})
    if method or not isinstance(flow, dict):
        what = "a surface has [method.flow] alone"
        raise InputError(what, f"{where}: method", f"leave out {', '.join(method)}")
    tables = {name: dict(getattr(file, name)) for name in PARTS if "." not in name}
    tables["method.flow"] = dict(flow)
    return tables


def _scene(tables: dict[str, Table], files: _Files) -> SurfaceScene:
    """The scene of some tables; an `InputError` for the first thing that is wrong."""
    where = files.where
    try:
        fluid = fluids.numbers_of(tables["fluid"])
    except InputError as error:
        raise InputError(error.what, f"{where}: {error.where}", error.remedy) from None
    bed = tables["bed"]
    diameter = tables["grain"].get("diameter")
    bed.setdefault("roughness", "d/30")
    if isinstance(bed["roughness"], str) and isinstance(diameter, float):
        bed["roughness"] = roughness_length(bed["roughness"], diameter)
    for table in ("bed", "flow", "grain", "method.flow"):
        # an angle or a length may be written without a point
        for name, value in tables[table].items():
            if type(value) is int:
                tables[table][name] = float(value)
    parts: dict[str, Part] = {}
    for name, part in PARTS.items():
        given = fluid if name == "fluid" else tables[name]
        try:
            parts[name] = part.model_validate(given)
        except ValidationError as error:
            raise _explained(error, where, name) from None
    checked_bed = parts["bed"]
    assert isinstance(checked_bed, SurfaceBed)
    heights = _heights(checked_bed, files)
    method = parts.pop("method.flow")
    scene = SurfaceScene.model_validate({**parts, "method": method, "heights": heights})
    _check(scene, where)
    return scene


def _heights(bed: SurfaceBed, files: _Files) -> Surface:
    """The surface that a bed names: of its file, or its shape."""
    where = files.where
    if (bed.surface is None) == (bed.shape is None):
        what = "give either a file or a shape"
        remedy = f'bed.surface = "pile.tif", or bed.shape = {" | ".join(_names())}'
        raise InputError(what, f"{where}: bed.surface", remedy)
    if bed.surface is None:
        found = _of_shape(bed, where)
    else:
        for name in ("height", "slope_deg", "length", "width"):
            if getattr(bed, name) is not None:
                what = "a file has its own"
                raise InputError(what, f"{where}: bed.{name}", "leave it out")
        found = files.surface(bed.surface)
    if bed.smoothing_cells is None:
        return found
    return found.spread_over(bed.smoothing_cells)


def _of_shape(bed: SurfaceBed, where: str) -> Surface:
    """The surface of a shape."""
    if bed.height is None or bed.slope_deg is None:
        name = "height" if bed.height is None else "slope_deg"
        what = f"a {bed.shape} needs it"
        raise InputError(what, f"{where}: bed.{name}", "add it to the file")
    if bed.shape == "oval":
        length = bed.length or OVAL_LENGTH * bed.height
        width = bed.width or bed.height
        if length < width:
            what = f"{length:g} m is less than the width of {width:g} m"
            raise InputError(what, f"{where}: bed.length", "the long side is along y")
        return surface.oval(bed.height, bed.slope_deg, length, width)
    for name in ("length", "width"):
        if getattr(bed, name) is not None:
            what = f"a {bed.shape} has none"
            raise InputError(what, f"{where}: bed.{name}", "it is of: oval")
    if bed.shape == "cone":
        return surface.cone(bed.height, bed.slope_deg)
    return surface.barchan(bed.height, bed.slope_deg)


def _names() -> Sequence[str]:
    """The names of the shapes."""
    return [f'"{name}"' for name in get_args(Shape)]


def _check(scene: SurfaceScene, where: str) -> None:
    """Refuse fields that do not go together."""
    if scene.grain.density <= scene.fluid.density:
        what = "not above the fluid's"
        remedy = "raise it, or lower fluid.density"
        raise InputError(what, f"{where}: grain.density", remedy)
    laws = get_args(Forces.model_fields["law"].annotation)
    if scene.forces.law not in laws or scene.forces.law == PAPER:
        what = f"{scene.forces.law!r} is no law of a surface"
        listed = ", ".join(law for law in laws if law != PAPER)
        raise InputError(what, f"{where}: forces.law", f"choose one of: {listed}")
    if scene.solve_roughness > scene.heights.relief / 20:
        what = (
            f"{scene.solve_roughness:g} m on a form {scene.heights.relief:.3g} m high"
        )
        remedy = "lower it: its elements would stand out of the cells"
        raise InputError(what, f"{where}: method.flow.roughness", remedy)


def _explained(error: ValidationError, where: str, table: str) -> InputError:
    """The refusal of a file's tables, for the first thing that is wrong in them."""
    first = min(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
    path = [str(step) for step in first["loc"]]
    name = ".".join([*filter(None, [table]), *path])
    place = f"{where}: {name}"
    if first["type"] == "missing":
        return InputError("is missing", place, "add it to the file")
    if first["type"] == "extra_forbidden":
        if path[-1] == "obstacles":
            remedy = (
                "leave it out; the preset stockpile has fences on sections of piles"
            )
            return InputError("a surface has no fences", place, remedy)
        if path[-1] in OF_GRAINS.get(table, ()):
            remedy = 'leave it out, or bed.kind = "pile"'
            return InputError("beds in a plane alone have it", place, remedy)
        keys = [*_File.model_fields] if not table and len(path) == 1 else []
        return InputError("unknown key", place, meant(name.split("."), keys, TABLES))
    return not_accepted(first.get("input"), first["msg"], place)
