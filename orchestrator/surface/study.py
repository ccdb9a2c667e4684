"""Study files of a bed in three dimensions: ``[bed] kind = "surface"``.

What a grain by grain answer needs is refused here.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from orchestrator.errors import InputError
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.runs.files import digest_file
from orchestrator.study import units
from orchestrator.study.declare import Part, UnfitError
from orchestrator.study.fields import PARTS as IN_A_PLANE
from orchestrator.study.keys import Table, Tables
from orchestrator.study.parts import Drag, Fluid
from orchestrator.study.reading import (
    CONFIRMED,
    MOST_BYTES,
    TIME_LIMIT_S,
    Given,
    at_points,
    check_once,
    explained,
    fluid_of,
    tables_of,
    values_of,
    with_questions,
)
from orchestrator.study.scene import roughness_length
from orchestrator.study.source import Source, decoded, find, read_bytes
from orchestrator.surface.heights import Surface
from orchestrator.surface.parts import (
    SurfaceBed,
    SurfaceErosion,
    SurfaceFlow,
    SurfaceFlowMethod,
    SurfaceGrain,
    SurfaceScene,
)
from orchestrator.surface.raster import rasterio, read_surface
from orchestrator.surface.rose import Rose, read_rose

KIND = "surface"
MOST_FLOWS = 360
LARGEST_ROSE = 2**22
"""Most bytes of a wind rose."""
PARTS: Mapping[str, type[Part]] = {
    "fluid": Fluid,
    "grain": SurfaceGrain,
    "bed": SurfaceBed,
    "flow": SurfaceFlow,
    "forces": Drag,
    "method.flow": SurfaceFlowMethod,
}
"""The tables of a scene on a surface."""
TABLES: Mapping[str, type[Part]] = {**PARTS, "erosion": SurfaceErosion}
"""The tables of a study file on a surface."""


class _File(Given):
    title: str = ""
    time_limit: float = Field(default=TIME_LIMIT_S, gt=0, le=1e8)
    units_confirmed: bool = False
    erosion: SurfaceErosion = SurfaceErosion()


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
    units_confirmed
        Whether the file says that the units of its numbers are meant.
    source
        What it was read from.
    """

    name: str
    title: str
    scenes: tuple[SurfaceScene, ...]
    erosion: SurfaceErosion
    rose: Rose | None
    time_limit_s: float
    units_confirmed: bool
    source: Source

    @property
    def file(self) -> str:
        """Absolute path of the study file."""
        return self.source.file

    @cached_property
    def questions(self) -> tuple[str, ...]:
        """Questions on numbers that are usual in another unit."""
        asked = units.questions(values_of(self.scenes), {})
        if self.rose and self.rose.question:
            asked.append(self.rose.question)
        if self.units_confirmed:
            asked = [one for one in asked if "?" not in one]  # remarks are left
        return tuple(asked)


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
    rasterio(f"{where}: bed.kind")  # maps are written at the end of hours of runs
    try:
        file = _File.model_validate(tables)
    except ValidationError as error:
        raise _explained(error, where) from None
    files = _Files(path.parent, where)
    rose = None
    if file.erosion.wind is not None:
        rose = files.rose(file.erosion.wind)
    scenes = tuple(_scenes(file, files))
    if rose and any(scene.fluid.density >= GAS_BELOW for scene in scenes):
        what = "the fluid is a liquid, and a wind rose is of air"
        raise InputError(what, f"{where}: erosion.wind", "leave it out")
    digests = {**files.digests, path.name: sha256(content).hexdigest()}
    return SurfaceStudy(
        name=path.stem,
        title=file.title or path.stem,
        scenes=scenes,
        erosion=file.erosion,
        rose=rose,
        time_limit_s=file.time_limit,
        units_confirmed=file.units_confirmed,
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
            self._surfaces[name] = replace(read_surface(path, where), name=name)
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
    tables = {name: dict(getattr(file, name)) for name in SurfaceScene.model_fields}
    # what is no table stays, and the validation refuses it
    is_whole = isinstance(tables["method"].get("flow"), dict)
    tables["method.flow"] = tables["method"].pop("flow") if is_whole else {}
    points: dict[SurfaceScene, tuple[Any, ...]] = {}
    for point, made in at_points(tables, file.axes, where):
        try:
            scene = _scene(made, files)
        except InputError as error:
            raise with_questions(error, made, where) from None
        if not file.units_confirmed:
            _check_size(scene.bed, where)
        check_once(points, scene, point, where)
        yield scene


def _scene(tables: Tables, files: _Files) -> SurfaceScene:
    """The scene of some tables; an `InputError` for the first thing that is wrong."""
    where = files.where
    bed = tables["bed"]
    bed.setdefault("roughness", "d/30")
    diameter = tables["grain"].get("diameter")
    try:
        if isinstance(bed["roughness"], str) and isinstance(diameter, float | int):
            bed["roughness"] = roughness_length(bed["roughness"], diameter)
    except UnfitError as error:
        raise InputError(error.what, f"{where}: {error.field}", error.remedy) from None
    if isinstance(bed.get("surface"), str):
        bed["surface"] = files.surface(bed["surface"])
    flow = tables["method.flow"]
    given: Table = {name: tables[name] for name in SurfaceScene.model_fields}
    given["fluid"] = fluid_of(tables["fluid"], where)
    given["method"] = {"flow": flow, **tables["method"]}
    try:
        return SurfaceScene.model_validate(given)
    except ValidationError as error:
        raise _explained(error, where) from None


def _check_size(bed: SurfaceBed, where: str) -> None:
    """Refuse a surface that is likelier in millimetres."""
    heights = bed.heights
    asked = units.of_bed(heights.name, max(heights.extent), heights.relief)
    if asked:
        field = "surface" if bed.surface else "height"
        remedy = f"write lengths in m, or {CONFIRMED} if it is so large"
        raise InputError(asked, f"{where}: bed.{field}", remedy)


def _explained(error: ValidationError, where: str) -> InputError:
    """The refusal of a file's tables, for the first thing that is wrong in them."""
    return explained(error, where, TABLES, {"": [*_File.model_fields]}, _hint)


def _hint(names: Sequence[str], branch: str) -> tuple[str, str] | None:
    """Say which tables and fields beds in a plane alone have."""
    del branch
    *table, name = names
    if names[-2:] == ["bed", "obstacles"]:
        remedy = "leave it out; the preset stockpile has fences on sections of piles"
        return "a surface has no fences", remedy
    part = IN_A_PLANE.get(".".join(table))
    if name in IN_A_PLANE or (part is not None and name in part.model_fields):
        return "beds in a plane alone have it", 'leave it out, or bed.kind = "pile"'
    return None
