"""A study file: fluid, grain, bed, flow, protocol and axes in TOML, read into scenes.

The tables at the top hold for every scene. Each ``[[group]]`` overrides some of them, and its
``axes`` span a grid: every combination of the listed values is a scene.
"""

import difflib
import itertools
import math
import os
import re
import tomllib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError

from orchestrator.errors import InputError
from orchestrator.physics import fluids
from orchestrator.study import units
from orchestrator.study.closed_form import resolved
from orchestrator.study.fidelities import AUTO, fields_of
from orchestrator.study.fields import PARTS
from orchestrator.study.parts import List, Part, PileBed, Sizes, UnfitError, percentile
from orchestrator.study.profile import LARGEST_NUMBER, Files, decoded, read_bytes
from orchestrator.study.scene import Scene, roughness_length
from orchestrator.study.shapes import SHAPES
from orchestrator.study.source import Source, find, presets

TIME_LIMIT_S = 3600.0
BED = {
    "kind": "grain",
    "roughness": "d/30",
}  # fields of a bed that a file may leave out
LEVEL_HEIGHT = 20.0
"""Diameters that stand for the height of a level bed. Its length is four heights by default: level
beds of all grains are alike."""
NO_TOLERANCE = 'leave it out; protocol.method = "dem" answers by DEM'
MOST_SCENES, MOST_BYTES = 100_000, 2**24  # a file that lists so many scenes is smaller
GONE_KEYS = {
    "flow.nodes": (
        "flows are no longer interpolated between roughness lengths",
        "leave it out; beds that are alike share a flow with one flow.roughness, in m",
    ),
}
"""Keys that study files had before: what became of them, and what to write now."""
GONE_VALUES = {
    ("flow.model", "hill"): (
        "the linear theory of one low hill is gone",
        'write "waves", the linear theory of each wavelength, or "solve"',
    ),
}
"""Values that keys of study files had before: what became of them, and what to write now."""
UNKNOWN, MISSING = "unknown key", "is missing"
Table = dict[str, Any]
Wind = Annotated[float, Field(gt=0, le=150)]
MIXTURE: TypeAdapter[Sizes | None] = TypeAdapter(Sizes | None)


def _not_zero(tolerance: float | None) -> float | None:
    """Refuse a tolerance that no levels are within."""
    if tolerance is not None and tolerance <= 0:
        what = (
            f"{tolerance:g} is not above 0: no levels are known to be without an error"
        )
        raise UnfitError("tolerance", what, NO_TOLERANCE)
    return tolerance


class _Tables(Part):
    """The tables of a file or of a group, which are validated scene by scene."""

    fluid: Table = Field(default={})
    grain: Table = Field(default={})
    bed: Table = Field(default={})
    flow: Table = Field(default={})
    forces: Table = Field(default={})
    protocol: Table = Field(default={})
    axes: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(default={})
    seeds: int | None = Field(default=None, ge=0, le=1000)


class Erosion(Part):
    """What `orchestrator erosion` asks of a stockpile: winds and the threshold of its surface."""

    fastest_mile: Annotated[tuple[Wind, ...], List, Field(min_length=1)] = (20.0,)
    """fastest mile of each time between two disturbances, wind at 10 m, m/s; by default a gale"""
    threshold: float | str | None = None
    """friction velocity, m/s, or a material in the table of AP-42; by default the closed form"""


class _Group(_Tables):
    name: str = ""


class _File(_Tables):
    title: str = ""
    time_limit: float = Field(
        default=TIME_LIMIT_S, gt=0, le=1e8
    )  # s, at most three years
    tolerance: Annotated[float | None, AfterValidator(_not_zero), Field(lt=1)] = None
    cluster: Table = Field(default={})
    profiles: dict[str, str] = Field(default={})
    erosion: Erosion = Erosion()
    group: Annotated[tuple[_Group, ...], List, Field(min_length=1)] | None = None


@dataclass(frozen=True)
class Group:
    """Scenes of a study that belong together: the points of one experiment."""

    name: str
    scenes: tuple[Scene, ...]  # in the file's order, each with its force law decided
    where: str  # its place in messages: the file, and which group of it


@dataclass(frozen=True)
class Study:
    """The content of a study file."""

    name: str  # the file's, without its ending
    title: str
    groups: tuple[Group, ...]
    time_limit_s: float  # wall time after which one solver run counts as hung, s
    tolerance: float | None
    """Relative error that tau_c may have; None: not given."""
    cluster: dict[str, Any]  # settings of the queue that runs the cases
    erosion: Erosion  # winds and threshold of `orchestrator erosion`
    text: str  # the file itself, and the texts of the files that it names
    source: Source | None = None  # None: the text came from elsewhere

    @property
    def file(self) -> str:
        """Absolute path of the study file; empty if the text came from elsewhere."""
        return self.source.file if self.source else ""

    @cached_property
    def scenes(self) -> tuple[Scene, ...]:
        """Every scene once, in the file's order."""
        return tuple(
            {
                scene.id: scene for group in self.groups for scene in group.scenes
            }.values()
        )

    @cached_property
    def questions(self) -> tuple[str, ...]:
        """Questions on numbers that are usual in another unit; of a preset none."""
        asked = units.questions(_values_of(self.scenes), {})
        profiles = {}
        for scene in self.scenes:
            if isinstance(scene.bed, PileBed) and scene.bed.profile:
                profiles[scene.bed.profile] = scene.bed.height
        for profile, height in profiles.items():
            asked += units.of_profile(profile.name, profile.x[-1], height)
        for sizes in dict.fromkeys(scene.grain.sizes for scene in self.scenes):
            if isinstance(sizes, tuple):
                asked += units.of_sieve([diameter for diameter, _ in sizes])
        if not asked:
            return ()
        texts = [path.read_text(encoding="utf-8") for path in presets().values()]
        return () if self.text in texts else tuple(asked)


ASKED = (
    "grain.diameter",
    "grain.density",
    "grain.cohesion",
    "fluid.density",
    "fluid.viscosity",
    "fluid.gravity",
    "bed.slope_deg",
    "bed.entrainment_angle_deg",
    "bed.lee_slope_deg",
    "flow.depth",
    "forces.lift_coefficient",
)
"""The fields that are asked about where their numbers are usual in another unit."""


def _values_of(scenes: Sequence[Scene]) -> dict[str, list[float]]:
    """The values of the fields `ASKED` in some scenes."""
    values: dict[str, list[float]] = {}
    for name in ASKED:
        part, _, field = name.partition(".")
        each = [getattr(getattr(scene, part), field, None) for scene in scenes]
        # what is left open is no number, and a bed of one grain has no lee side
        values[name] = [value for value in each if value is not None]
    # the diameter of a sieve table follows from its rows, the slope of a profile from its points
    single = [
        scene.grain for scene in scenes if not isinstance(scene.grain.sizes, tuple)
    ]
    values["grain.diameter"] = [grain.diameter for grain in single]
    beds = [scene.bed for scene in scenes]
    given = [bed for bed in beds if not (isinstance(bed, PileBed) and bed.profile)]
    values["bed.slope_deg"] = [bed.slope_deg for bed in given]
    return values


def _values_in(parts: Mapping[str, Table]) -> dict[str, list[float]]:
    """The values of the fields `ASKED` in the tables of one scene, which may be wrong."""
    given = {name: dict(parts.get(name, {})) for name in PARTS}
    with suppress(InputError):
        given["fluid"] = fluids.numbers_of(given["fluid"])
    values = {}
    for field in ASKED:
        part, _, name = field.partition(".")
        value = given[part].get(name, PARTS[part].model_fields[name].default)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        values[field] = [value] if is_number and abs(value) < LARGEST_NUMBER else []
    return values


def _sieve_in(parts: Mapping[str, Table], files: Files, where: str) -> list[float]:
    """The diameters of a sieve table in the tables of one scene, which may be wrong."""
    sizes = parts.get("grain", {}).get("sizes")
    with suppress(InputError):
        if isinstance(sizes, str):
            sizes = files.sieve(sizes, where)
    rows = sizes if isinstance(sizes, list) else []
    firsts = [row[0] for row in rows if isinstance(row, list) and row]
    return [value for value in firsts if isinstance(value, int | float)]


def load(source: str | Path, tolerance: float | None = None) -> Study:
    """Read a study file by its path, or a preset by its name.

    Parameters
    ----------
    source
        The path or the name.
    tolerance
        Relative error that tau_c may have, in place of the file's.

    Raises
    ------
    InputError
        With the file, the field and the remedy.
    """
    path = find(source)
    if tolerance is not None and not 0 < tolerance < 1:
        what = f"{tolerance!r} is not a relative error above 0 and below 1"
        raise InputError(
            what, "tolerance", f"0.05 allows tau_c to be 5 % off; or {NO_TOLERANCE}"
        )
    content = read_bytes(path, MOST_BYTES, str(source))
    text = decoded(content, str(source))
    files = Files(path.parent)
    # a file's name may be bytes that are no text; the page and the tables are text
    name = os.fsencode(path.stem).decode("utf-8", "replace")
    study = parse(text, name=name, where=str(path), files=files)
    digests = {**files.digests, path.name: sha256(content).hexdigest()}
    origin = Source(str(path.absolute()), digests, tolerance)
    study = replace(study, source=origin)
    if tolerance is not None:
        study = replace(study, tolerance=tolerance)
    if study.questions:
        warnings.warn("; ".join(study.questions), stacklevel=2)
    return study


def parse(text: str, *, name: str, where: str, files: Files | None = None) -> Study:
    """Make a study of the text of a TOML file.

    Only scenes that cannot be built are refused; a plan refuses those beyond the methods'
    limits.

    Parameters
    ----------
    text
        The study file.
    name
        Its name, without its ending.
    where
        Its path, for messages.
    files
        The files that it may name, by default those of its folder.

    Raises
    ------
    InputError
        With the field and the remedy.
    """
    try:
        file = _File.model_validate(tomllib.loads(text))
    except ValidationError as error:
        raise _explained(error, where) from None
    except (ValueError, RecursionError) as error:
        raise _not_toml(str(error), text, where) from None
    if files is None:
        files = Files(Path(where).parent)
    files.carried = dict(file.profiles)
    tables = file.group or (_Group(),)
    places = [where]
    if file.group:
        places = [f"{where}: group {number}" for number in range(1, len(tables) + 1)]
    listed: list[list[Scene]] = []
    count = 0
    for table, place in zip(tables, places, strict=True):
        axes = _axes(file, table, place)
        count += math.prod(map(len, axes.values()))
        if count > MOST_SCENES:
            what = f"more than {MOST_SCENES} scenes in the study"
            raise InputError(what, f"{place}: axes", "shorten the lists")
        parts = {n: {**getattr(file, n), **getattr(table, n)} for n in PARTS}
        listed.append([*_scenes(parts, axes, place, files)])
    # force laws are found for the scenes of all groups at once
    laws = resolved([*itertools.chain(*listed)])
    groups = []
    for number, (table, place) in enumerate(zip(tables, places, strict=True), 1):
        count = len(listed[number - 1])
        scenes = tuple(itertools.chain(*itertools.islice(laws, count)))
        groups.append(Group(table.name or f"group {number}", scenes, place))
    return Study(
        name=name,
        title=file.title or name,
        groups=tuple(groups),
        time_limit_s=file.time_limit,
        tolerance=file.tolerance,
        cluster=file.cluster,
        erosion=file.erosion,
        text=text + files.added,
    )


def _axes(file: "_File", table: "_Group", where: str) -> dict[str, list[Any]]:
    """The axes of a group, with the seeds that it asks for."""
    axes = {**file.axes, **table.axes}
    seeds = file.seeds if table.seeds is None else table.seeds
    if not seeds:
        return axes
    if "bed.seed" in {**axes, **{f"bed.{key}": 0 for key in {**file.bed, **table.bed}}}:
        what = f"it asks for the seeds 0 to {seeds - 1}, and bed.seed for others"
        raise InputError(what, f"{where}: seeds", "leave out one of the two")
    axes["bed.seed"] = [*range(seeds)]
    return axes


def _scenes(
    tables: Mapping[str, Table], axes: Mapping[str, list[Any]], where: str, files: Files
) -> Iterator[Scene]:
    """A scene for each combination of the axes' values; each must be a scene of its own."""
    keys = [key.partition(".") for key in axes]
    for part, _, name in keys:
        if part not in PARTS or not name:
            what, remedy = (
                "not a table and a field of it",
                'write "grain.diameter" = [1e-4, 1e-3]',
            )
            raise InputError(what, f"{where}: axes.{part}", remedy)
    points: dict[str, tuple[Any, ...]] = {}
    for point in itertools.product(*axes.values()):
        parts = {part: dict(tables[part]) for part in PARTS}
        for (part, _, name), value in zip(keys, point, strict=True):
            parts[part][name] = value
        try:
            scene = make_scene(parts, where, files)
        except InputError as error:
            if error.what in (UNKNOWN, MISSING):
                raise
            asked = units.of_sieve(_sieve_in(parts, files, where))
            if asked:  # the diameter and all that depends on it follow from the table
                raise units.first(asked, error, where, ()) from None
            asked = units.questions(_values_in(parts), {})
            raise units.first(asked, error, where, ASKED) from None
        if (same := points.setdefault(scene.id, point)) is not point:
            what = f"{', '.join(map(str, same))} and {', '.join(map(str, point))} are one scene"
            raise InputError(what, f"{where}: axes", "list each value once")
        yield scene


def make_scene(
    parts: Mapping[str, Table], where: str, files: Files | None = None
) -> Scene:
    """Validate the tables of one scene, by their names; `where` names the file in messages.

    A part of the diameter such as d/30 is worked out, and so are the d50 of a sieve table and the
    numbers of a fluid's kind. `files` are those that the tables may name. The first thing wrong
    raises an `InputError`.
    """
    tables = {name: dict(parts.get(name, {})) for name in PARTS}
    bed, grain, flow, fluid = (
        tables[name] for name in ("bed", "grain", "flow", "fluid")
    )
    for key, default in BED.items():
        bed.setdefault(key, default)
    kind = bed["kind"]
    if kind in [*SHAPES] and bed.get("shape", kind) == kind:
        bed |= {"kind": "pile", "shape": kind}
    elif kind not in ("grain", "pile"):
        remedy = f"write grain, pile, or a shape: {', '.join(SHAPES)}"
        raise InputError(f"{kind!r} is no bed", f"{where}: bed.kind", remedy)
    is_level = bed.get("shape") == "flat" and not (
        bed.get("profile") or bed.get("obstacles")
    )
    fidelity = tables["protocol"].pop("fidelity", AUTO)
    if fidelity != AUTO:
        for name, value in fields_of(fidelity, bed, where).items():
            part, _, key = name.partition(".")
            if not (is_level and part == "flow"):
                tables[part].setdefault(key, value)
    if is_level:
        flow.setdefault("model", "flat")  # over a level bed there is nothing to solve
    if bed.get("packing") == "poured":
        bed.setdefault(
            "mobile_layers", 4
        )  # the cheapest near the reference: docs/poured.md
    try:
        fluid = fluids.numbers_of(fluid)
    except InputError as error:
        raise InputError(error.what, f"{where}: {error.where}", error.remedy) from None
    if files and bed["kind"] == "pile" and isinstance(bed.get("profile"), str):
        bed.update(files.bed(bed, where))
    if files and isinstance(grain.get("sizes"), str):
        grain["sizes"] = files.sieve(grain["sizes"], where)
    try:
        # values of a wrong type or range are left to the validation of the scene
        with suppress(ValidationError, KeyError, TypeError, OverflowError):
            mixture = MIXTURE.validate_python(grain.get("sizes"))
            if isinstance(mixture, tuple):
                grain.setdefault("diameter", percentile(mixture, 1.0, 0.5))
            if is_level and bed.get("height", 1.0) > 0:
                # it has no height of its own; digits as those that a file has
                bed["height"] = float(f"{LEVEL_HEIGHT * grain['diameter']:.12g}")
            if isinstance(bed["roughness"], str):
                relative = bed.get("relative_size", 1.0)
                is_size = isinstance(relative, int | float) and 1e-3 < relative < 1e3
                d = grain["diameter"] / (relative if is_size else 1.0)
                bed["roughness"] = roughness_length(bed["roughness"], d, mixture)
        return Scene.model_validate({**parts, **tables, "fluid": fluid})
    except UnfitError as error:
        raise InputError(error.what, f"{where}: {error.field}", error.remedy) from None
    except ValidationError as error:
        raise _explained(error, where) from None


def value_of(scene: Scene, name: str) -> Any:
    """The value of a field, named as in a study file."""
    return attrgetter(name)(scene)


def changed(scene: Scene, fields: Mapping[str, Any]) -> Scene:
    """A scene with some fields changed; an `InputError` for a value that a field cannot have."""
    parts: dict[str, dict[str, Any]] = {
        name: dict(getattr(scene, name)) for name in PARTS
    }
    for name, value in fields.items():
        part, _, field = name.partition(".")
        parts.setdefault(part, {})[field] = value
    return make_scene(parts, "fields that are changed")


def _not_toml(error: str, text: str, where: str) -> InputError:
    """The refusal of a file that is no TOML, with how to write the number in its line."""
    remedy = ""
    place = re.search(r"\(at line (\d+), column \d+\)", error)
    if place:
        line = text.splitlines()[int(place[1]) - 1]
        value = line.partition("=")[2].partition("#")[0]
        remedy = units.meant(value)
    return InputError(f"not TOML: {error}", where, remedy)


def _explained(error: ValidationError, where: str) -> InputError:
    """The refusal of a file's tables, for the first thing that is wrong in them."""
    # a misspelt key says more than the field that is missing because of it
    first = min(
        error.errors(),
        key=lambda e: e["type"] != "extra_forbidden" and "sizes" not in e["loc"],
    )
    if isinstance(cause := first.get("ctx", {}).get("error"), UnfitError):
        return InputError(cause.what, f"{where}: {cause.field}", cause.remedy)
    path, keys = [*first["loc"]], [*_File.model_fields]
    if path[0] == "group" and len(path) > 2:
        where, path, keys = (
            f"{where}: group {int(path[1]) + 1}",
            path[2:],
            [*_Group.model_fields],
        )
    branch = path.pop(1) if path[0] == "bed" and path[1:] else ""
    path = [step for step in path if step not in ("", "rows")]
    name, key = ".".join(map(str, path)), str(path[-1])
    place, value = f"{where}: {name}", first.get("input")
    if name in GONE_KEYS:
        what, remedy = GONE_KEYS[name]
        return InputError(what, place, remedy)
    if isinstance(value, str) and (name, value) in GONE_VALUES:
        what, remedy = GONE_VALUES[name, value]
        return InputError(f"{value!r}: {what}", place, remedy)
    if first["type"] == "missing":
        return InputError(MISSING, place, "add it to the file")
    if first["type"] != "extra_forbidden":
        remedy = (
            first["msg"].lower().replace("dictionary", "table").replace("tuple", "list")
        )
        if isinstance(value, str):
            remedy = units.meant(value) or remedy
        return InputError(f"{value!r} is not accepted", place, remedy)
    if branch == "grain" and key in PileBed.model_fields:
        return InputError(
            "a bed of one grain has none", place, 'a pile has it: kind = "pile"'
        )
    here = str(path[0]) if path[1:] else ""
    tables: dict[str, type[Part]] = {**PARTS, "erosion": Erosion}
    written = {
        name: f"{name}, above the first table" for name in keys if name not in tables
    }
    written |= {
        n: f"{part}.{n}"
        for part in reversed([*tables])
        for n in tables[part].model_fields
    }
    written |= {name: name for name in (tables[here].model_fields if here else keys)}
    close = difflib.get_close_matches(key, written, n=1)
    listed = "known keys: docs/study-file.md"
    return InputError(
        UNKNOWN, place, f"did you mean {written[close[0]]}?" if close else listed
    )
