"""Study files of a bed in three dimensions: ``[bed] kind = "surface"``.

What a grain by grain answer needs is refused here.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path

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
    TIME_LIMIT_S,
    Given,
    Numbers,
    explained,
    fluid_of,
    read,
    scenes_at,
)
from orchestrator.study.scene import roughness_length
from orchestrator.study.source import Source, decoded, read_bytes
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
    questions
        What is said of numbers that are usual in another unit.
    source
        What it was read from.
    """

    name: str
    title: str
    scenes: tuple[SurfaceScene, ...]
    erosion: SurfaceErosion
    rose: Rose | None
    time_limit_s: float
    questions: tuple[str, ...]
    source: Source

    @property
    def file(self) -> str:
        """Absolute path of the study file."""
        return self.source.file


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
    inputs = read(source)
    where = str(inputs.path)
    bed = inputs.tables.get("bed")
    if not isinstance(bed, dict) or bed.get("kind") != KIND:
        return None
    rasterio(f"{where}: bed.kind")  # maps are written at the end of hours of runs
    try:
        file = _File.model_validate(inputs.tables)
    except ValidationError as error:
        raise _explained(error, where) from None
    files = _Files(inputs.path.parent, where)
    rose = None
    if file.erosion.wind is not None:
        rose = files.rose(file.erosion.wind)
    numbers = Numbers()
    scenes = tuple(_scenes(file, files, numbers))
    if rose and any(scene.fluid.density >= GAS_BELOW for scene in scenes):
        what = "the fluid is a liquid, and a wind rose is of air"
        raise InputError(what, f"{where}: erosion.wind", "leave it out")
    asked = numbers.asked
    if rose and rose.question:
        asked.append(units.Remark(rose.question))
    if file.units_confirmed:
        asked = [one for one in asked if not one.is_question]
    name = inputs.path.stem
    return SurfaceStudy(
        name=name,
        title=file.title or name,
        scenes=scenes,
        erosion=file.erosion,
        rose=rose,
        time_limit_s=file.time_limit,
        questions=tuple(one.text for one in asked),
        source=inputs.source(files.digests),
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


def _scenes(file: _File, files: _Files, numbers: Numbers) -> Iterator[SurfaceScene]:
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
    make = partial(_scene, files=files)
    for scene in scenes_at(
        tables, file.axes, where, make, numbers, lambda scene: scene
    ):
        if not file.units_confirmed:
            _check_size(scene.bed, where)
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
