"""Study files of a bed in three dimensions: ``[bed] kind = "surface"``.

What a grain by grain answer needs is refused here.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from orchestrator.errors import InputError
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.study import units
from orchestrator.study.declare import Part, UnfitError
from orchestrator.study.fields import PARTS as IN_A_PLANE
from orchestrator.study.keys import Table, nested
from orchestrator.study.parts import Drag, Fluid
from orchestrator.study.profile import Files
from orchestrator.study.reading import CONFIRMED, fluid_of
from orchestrator.study.scene import roughness_length
from orchestrator.study.source import decoded, read_bytes
from orchestrator.study.study import File, Group, Kind, Study
from orchestrator.surface.ground import read_roughness
from orchestrator.surface.heights import Surface
from orchestrator.surface.parts import (
    SurfaceBed,
    SurfaceErosion,
    SurfaceFlow,
    SurfaceFlowMethod,
    SurfaceGrain,
    SurfaceMethod,
    SurfaceScene,
)
from orchestrator.surface.raster import rasterio, read_surface
from orchestrator.surface.rose import Rose, read_rose

MOST_FLOWS = 360
LARGEST_ROSE = 2**27
"""Most bytes of a wind rose."""
TABLES: Mapping[str, type[Part]] = {
    "fluid": Fluid,
    "grain": SurfaceGrain,
    "bed": SurfaceBed,
    "flow": SurfaceFlow,
    "forces": Drag,
    "method": SurfaceMethod,
    "method.flow": SurfaceFlowMethod,
    "erosion": SurfaceErosion,
}
"""The tables of a study file on a surface."""
SurfaceStudy = Study[SurfaceScene]


class _File(File):
    """The keys at the top of a study file on a surface."""

    erosion: SurfaceErosion = SurfaceErosion()


def _with_files(data: Mapping[str, Any], where: str, files: Files) -> Mapping[str, Any]:
    """The tables of a file with its wind rose."""
    rasterio(f"{where}: bed.kind")  # maps are written at the end of hours of runs
    erosion = data.get("erosion")
    if not isinstance(erosion, dict) or not isinstance(erosion.get("wind"), str):
        return data
    rose = files.once(erosion["wind"], f"{where}: erosion.wind", _rose)
    return {**data, "erosion": {**erosion, "wind": rose}}


def _scene(tables: Mapping[str, Table], where: str, files: Files) -> SurfaceScene:
    """The scene of some tables; an `InputError` for the first thing that is wrong."""
    made = {name: dict(table) for name, table in tables.items()}
    bed = made["bed"]
    bed.setdefault("roughness", "d/30")
    diameter = made["grain"].get("diameter")
    made["fluid"] = fluid_of(made["fluid"], where)
    name = bed.get("surface")
    if isinstance(name, str):
        bed["surface"] = files.once(name, f"{where}: bed.surface", _named(name))
    flow = made["method.flow"]
    ground = flow.get("roughness_map")
    if isinstance(ground, str):
        field = f"{where}: method.flow.roughness_map"
        flow["roughness_map"] = files.once(ground, field, read_roughness)
    try:
        if isinstance(bed["roughness"], str) and isinstance(diameter, float | int):
            bed["roughness"] = roughness_length(bed["roughness"], diameter)
        return SurfaceScene.model_validate(nested(made))
    except UnfitError as error:
        raise InputError(error.what, f"{where}: {error.field}", error.remedy) from None
    except ValidationError as error:
        raise SURFACES.explained(error, where) from None


def _check(
    file: File, groups: Sequence[Group[SurfaceScene]], where: str
) -> list[units.NumberRemark]:
    """Refuse surfaces that are likelier in millimetres, and roses over liquids.

    Returned are questions on the wind rose.
    """
    assert isinstance(file.erosion, SurfaceErosion)
    rose = file.erosion.wind
    for group in groups:
        for scene in group.scenes:
            if not file.units_confirmed:
                _check_size(scene.bed, group.where)
            if rose and scene.fluid.density >= GAS_BELOW:
                what = "the fluid is a liquid, and a wind rose is of air"
                raise InputError(what, f"{where}: erosion.wind", "leave it out")
    return [units.NumberRemark(rose.question)] if rose and rose.question else []


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


SURFACES: Kind[SurfaceScene] = Kind(
    TABLES,
    _scene,
    _check,
    _hint,
    with_files=_with_files,
    file=_File,
    without=("threshold", "seeds", "tolerance", "cluster", "profiles"),
    most=MOST_FLOWS,
)
"""Beds in three dimensions."""


def rose_of(study: SurfaceStudy) -> Rose | None:
    """Find the wind rose of a study.

    Parameters
    ----------
    study
        The study.

    Returns
    -------
    Rose or None
        The rose; None if none is named.
    """
    assert isinstance(study.erosion, SurfaceErosion)
    return study.erosion.wind


def _rose(path: Path, where: str) -> Rose:
    """The wind rose of a file."""
    content = read_bytes(path, LARGEST_ROSE, where)
    return read_rose(decoded(content, where, is_data=True), path.name, where)


def _named(name: str) -> Callable[[Path, str], Surface]:
    """Reads a surface, which is called as the study file calls its file."""
    return lambda path, where: replace(read_surface(path, where), name=name)


def _check_size(bed: SurfaceBed, where: str) -> None:
    """Refuse a surface that is likelier in millimetres."""
    heights = bed.heights
    asked = units.ask_about_bed(heights.name, max(heights.extent), heights.relief)
    if asked:
        field = "surface" if bed.surface else "height"
        remedy = f"write lengths in m, or {CONFIRMED} if it is so large"
        raise InputError(asked, f"{where}: bed.{field}", remedy)
