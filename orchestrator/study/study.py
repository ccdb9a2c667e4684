"""A study file: the tables of what is asked, of the method, and axes, read into scenes.

The tables at the top hold for every scene. Each ``[[group]]`` overrides some of them,
and its ``axes`` span a grid: every combination of the listed values is a scene.
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
from orchestrator.study.declare import List, Part, UnfitError
from orchestrator.study.fidelities import AUTO, fields_of
from orchestrator.study.fields import FIDELITY, PARTS, SEED, default_of, table_of
from orchestrator.study.keys import (
    GONE_KEYS,
    GONE_VALUES,
    Table,
    Tables,
    by_name,
    check_moved,
    nested,
)
from orchestrator.study.parts import PileBed, Sizes, percentile
from orchestrator.study.profile import (
    LARGEST_NUMBER,
    WITH_X,
    Files,
    decoded,
    read_bytes,
)
from orchestrator.study.scene import Scene, roughness_length
from orchestrator.study.shapes import SHAPES
from orchestrator.study.source import Source, find, presets

TIME_LIMIT_S = 3600.0
BED = {"kind": "grain", "roughness": "d/30"}
"""Fields of a bed that a file may leave out."""
POURED_LAYERS = 4
"""Mobile layers of a poured bed: the fewest that are near the reference
(docs/poured.md)."""
LEVEL_HEIGHT = 20.0
"""Diameters that stand for the height of a level bed. Its length is four heights by
default: level beds of all grains are alike."""
NO_TOLERANCE = 'leave it out; method.kind = "dem" answers by DEM'
MOST_SCENES = 100_000
MOST_BYTES = 2**24
"""Largest study file: one that lists so many scenes is smaller."""
UNKNOWN = "unknown key"
MISSING = "is missing"
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
    threshold: Table = Field(default={})
    method: Table = Field(default={})
    axes: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(default={})
    seeds: int | None = Field(default=None, ge=0, le=1000)


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


TABLES: Mapping[str, type[Part]] = {**PARTS, "erosion": Erosion}
"""The tables of a study file."""


class _Group(_Tables):
    name: str = ""


class _File(_Tables):
    title: str = ""
    time_limit: float = Field(
        default=TIME_LIMIT_S, gt=0, le=1e8
    )  # s, at most three years
    tolerance: Annotated[float | None, AfterValidator(_not_zero), Field(lt=1)] = None
    units_confirmed: bool = False
    cluster: Table = Field(default={})
    profiles: dict[str, str] = Field(default={})
    erosion: Erosion = Erosion()
    group: Annotated[tuple[_Group, ...], List, Field(min_length=1)] | None = None


@dataclass(frozen=True)
class Group:
    """Scenes of a study that belong together: the points of one experiment.

    Attributes
    ----------
    name
        Its name.
    scenes
        Its scenes in the file's order.
    where
        Its place in messages: the file, and which group of it.
    """

    name: str
    scenes: tuple[Scene, ...]  # in the file's order, each with its force law decided
    where: str  # its place in messages: the file, and which group of it


@dataclass(frozen=True)
class Study:
    """The content of a study file.

    Attributes
    ----------
    name
        The name of the file, without its ending.
    title
        The title.
    groups
        The groups of scenes.
    time_limit_s
        Wall time after which one solver run counts as hung, s.
    tolerance
        Relative error that tau_c may have; None if none is given.
    cluster
        Settings of the queue that runs the cases.
    erosion
        Winds and threshold of `orchestrator erosion`.
    text
        The file itself, and the texts of the files that it names.
    units_confirmed
        Whether the file says that the units of its numbers are meant.
    source
        Where the text came from; None if it was no file.
    """

    name: str  # the file's, without its ending
    title: str
    groups: tuple[Group, ...]
    time_limit_s: float  # wall time after which one solver run counts as hung, s
    tolerance: float | None
    """Relative error that tau_c may have; None: not given."""
    cluster: dict[str, Any]  # settings of the queue that runs the cases
    erosion: Erosion  # winds and threshold of `orchestrator erosion`
    text: str
    """The file itself, and the texts of the files that it names."""
    source: Source | None = None
    """None if the text came from elsewhere."""
    units_confirmed: bool = False
    """Whether numbers that are usual in another unit are meant as they are."""

    @property
    def file(self) -> str:
        """Absolute path of the study file; empty if the text came from elsewhere."""
        return self.source.file if self.source else ""

    @cached_property
    def scenes(self) -> tuple[Scene, ...]:
        """Every scene once, in the file's order."""
        found = {}
        for group in self.groups:
            found.update({scene.id: scene for scene in group.scenes})
        return tuple(found.values())

    @cached_property
    def questions(self) -> tuple[str, ...]:
        """Questions on numbers that are usual in another unit; of a preset none."""
        asked = units.questions(_values_of(self.scenes), {})
        for sizes in dict.fromkeys(scene.grain.sizes for scene in self.scenes):
            if isinstance(sizes, tuple):
                asked += units.of_sieve([diameter for diameter, _ in sizes])
        if self.units_confirmed:
            asked = [one for one in asked if "?" not in one]  # remarks are left
        if not asked:
            return ()
        for preset in presets().values():
            if self.text == preset.read_text(encoding="utf-8"):
                return ()
        return tuple(asked)


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
    # the diameter of a sieve table follows from its rows, the slope of a profile from
    # its points
    single = [
        scene.grain for scene in scenes if not isinstance(scene.grain.sizes, tuple)
    ]
    values["grain.diameter"] = [grain.diameter for grain in single]
    beds = [scene.bed for scene in scenes]
    given = [bed for bed in beds if not (isinstance(bed, PileBed) and bed.profile)]
    values["bed.slope_deg"] = [bed.slope_deg for bed in given]
    return values


def _values_in(tables: Mapping[str, Table]) -> dict[str, list[float]]:
    """The values of the fields `ASKED` in tables of one scene, maybe wrong ones."""
    given = {name: dict(tables.get(name, {})) for name in PARTS}
    with suppress(InputError):
        given["fluid"] = fluids.numbers_of(given["fluid"])
    values: dict[str, list[float]] = {}
    for name in ASKED:
        table, _, field = name.partition(".")
        value = given[table].get(field, default_of(name))
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        values[name] = []
        if is_number and abs(value) < LARGEST_NUMBER:
            values[name].append(value)
    return values


def _sieve_in(parts: Mapping[str, Table], files: Files, where: str) -> list[float]:
    """The diameters of a sieve table in the tables of one scene, which may be wrong."""
    sizes = parts.get("grain", {}).get("sizes")
    with suppress(InputError):
        if isinstance(sizes, str):
            sizes = files.sieve(sizes, where)
    if not isinstance(sizes, list):
        return []
    firsts = [row[0] for row in sizes if isinstance(row, list) and row]
    return [value for value in firsts if isinstance(value, int | float)]


def load(source: str | Path, tolerance: float | None = None) -> Study:
    """Read a study file by its path, or a preset by its name.

    Parameters
    ----------
    source
        The path or the name.
    tolerance
        Relative error that tau_c may have, in place of the file's.

    Returns
    -------
    Study
        The study.

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

    Only scenes that cannot be built are refused; a plan refuses those beyond the
    methods' limits.

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

    Returns
    -------
    Study
        The study.

    Raises
    ------
    InputError
        With the field and the remedy.
    """
    data = tables_of(text, where)
    _check_keys(data, where)
    try:
        file = _File.model_validate(data)
    except ValidationError as error:
        raise _explained(error, where) from None
    if files is None:
        files = Files(Path(where).parent)
    files.carried = dict(file.profiles)
    groups = _groups(file, where, files)
    if not file.units_confirmed:
        _check_profiles(groups)
    return Study(
        name=name,
        title=file.title or name,
        groups=groups,
        time_limit_s=file.time_limit,
        tolerance=file.tolerance,
        cluster=file.cluster,
        erosion=file.erosion,
        text=text + files.added,
        units_confirmed=file.units_confirmed,
    )


def _check_profiles(groups: Sequence[Group]) -> None:
    """Refuse profiles that are likelier in millimetres."""
    for group in groups:
        for scene in group.scenes:
            bed = scene.bed
            if not isinstance(bed, PileBed) or not bed.profile:
                continue
            asked = units.of_profile(bed.profile.name, bed.profile.x[-1], bed.height)
            if asked:
                confirmed = "write units_confirmed = true at the top of the study file"
                remedy = f"divide x_m and z_m by 1000, or {confirmed} if it is so large"
                raise InputError(asked, f"{group.where}: bed.profile", remedy)


def tables_of(text: str, where: str) -> dict[str, Any]:
    """Read the tables of a TOML file.

    Parameters
    ----------
    text
        The file.
    where
        Its path, for messages.

    Returns
    -------
    dict of str to object
        The tables, as TOML's parser gives them.

    Raises
    ------
    InputError
        With the line, and how to write the number in it.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise _not_toml(str(error), text, where) from None


def _groups(file: _File, where: str, files: Files) -> tuple[Group, ...]:
    """The groups of a study with their scenes, the force law of each decided."""
    tables_of = file.group or (_Group(),)
    places = [where]
    if file.group:
        places = [_place(where, number) for number in range(len(file.group))]
    listed: list[list[Scene]] = []
    count = 0
    for group, place in zip(tables_of, places, strict=True):
        axes = _axes(file, group, place)
        count += math.prod(map(len, axes.values()))
        if count > MOST_SCENES:
            what = f"more than {MOST_SCENES} scenes in the study"
            raise InputError(what, f"{place}: axes", "shorten the lists")
        tables = by_name(dict(file))
        for part, table in by_name(dict(group)).items():
            tables[part] |= table
        listed.append([*_scenes(tables, axes, place, files)])
    # force laws are found for the scenes of all groups at once
    laws = resolved([*itertools.chain(*listed)])
    groups = []
    for number, group in enumerate(tables_of):
        scenes: list[Scene] = []
        for _ in listed[number]:
            scenes += next(laws)
        name = group.name or f"group {number + 1}"
        groups.append(Group(name, tuple(scenes), places[number]))
    return tuple(groups)


def _place(where: str, group: int) -> str:
    """The place of a group in messages; `group` counts from 0."""
    return f"{where}: group {group + 1}"


def _check_keys(data: Mapping[str, Any], where: str) -> None:
    """Refuse keys that study files had before, at the top and in the groups."""
    check_moved(data, where)
    groups = data.get("group")
    if not isinstance(groups, list):
        return
    for number, group in enumerate(groups):
        if isinstance(group, dict):
            check_moved(group, _place(where, number))


def _axes(file: "_File", table: "_Group", where: str) -> dict[str, list[Any]]:
    """The axes of a group, with the seeds that it asks for."""
    axes = {**file.axes, **table.axes}
    seeds = table.seeds
    if seeds is None:
        seeds = file.seeds
    if not seeds:
        return axes
    if SEED in axes or "seed" in file.bed or "seed" in table.bed:
        what = f"it asks for the seeds 0 to {seeds - 1}, and {SEED} for others"
        raise InputError(what, f"{where}: seeds", "leave out one of the two")
    axes[SEED] = [*range(seeds)]
    return axes


def _scenes(
    tables: Tables, axes: Mapping[str, list[Any]], where: str, files: Files
) -> Iterator[Scene]:
    """A scene for each combination of the axes' values.

    Each must be a scene of its own.
    """
    for name in axes:
        if table_of(name) not in PARTS:
            first = name.partition(".")[0]
            remedy = 'write "grain.diameter" = [1e-4, 1e-3]'
            what = "not a table and a field of it"
            raise InputError(what, f"{where}: axes.{first}", remedy)
    points: dict[str, tuple[Any, ...]] = {}
    for point, made in at_points(tables, axes):
        scene = _scene_at(made, where, files)
        check_once(points, scene.id, point, where)
        yield scene


def at_points(
    tables: Mapping[str, Table], axes: Mapping[str, list[Any]]
) -> Iterator[tuple[tuple[Any, ...], Tables]]:
    """Write each combination of the axes' values into the tables of a file.

    Parameters
    ----------
    tables
        The tables by their names.
    axes
        The values by the names of their fields, such as ``grain.diameter``.

    Yields
    ------
    point
        The values.
    tables
        The tables with them.
    """
    for point in itertools.product(*axes.values()):
        made = {name: dict(table) for name, table in tables.items()}
        for name, value in zip(axes, point, strict=True):
            table, _, field = name.rpartition(".")
            made[table][field] = value
        yield point, made


def check_once(
    points: dict[Any, tuple[Any, ...]], scene: Any, point: tuple[Any, ...], where: str
) -> None:
    """Refuse a scene that the axes have a second time.

    Parameters
    ----------
    points
        The values of the axes by the scenes before, to which this one is added.
    scene
        The scene, or its id.
    point
        Its values.
    where
        The file, for messages.

    Raises
    ------
    InputError
        With both values.
    """
    same = points.setdefault(scene, point)
    if same is not point:
        one = ", ".join(map(str, same))
        other = ", ".join(map(str, point))
        what = f"{one} and {other} are one scene"
        raise InputError(what, f"{where}: axes", "list each value once")


def _scene_at(tables: Tables, where: str, files: Files) -> Scene:
    """A scene; a refusal stands behind questions on numbers in another unit."""
    try:
        return make_scene(tables, where, files)
    except InputError as error:
        if error.what in (UNKNOWN, MISSING):
            raise
        asked = units.of_sieve(_sieve_in(tables, files, where))
        if asked:  # the diameter and all that depends on it follow from the table
            raise units.first(asked, error, where, ()) from None
        asked = units.questions(_values_in(tables), {})
        raise units.first(asked, error, where, ASKED) from None


def make_scene(
    tables: Mapping[str, Table], where: str, files: Files | None = None
) -> Scene:
    """Validate the tables of one scene.

    A part of the diameter such as d/30 is worked out, and so are the d50 of a sieve
    table, the numbers of a fluid's kind and those of a fidelity.

    Parameters
    ----------
    tables
        The tables by the names of `fields.PARTS`; one may be missing.
    where
        The file, for messages.
    files
        The files that the tables may name.

    Returns
    -------
    Scene
        The scene.

    Raises
    ------
    InputError
        For the first thing that is wrong.
    """
    made = {name: dict(tables.get(name, {})) for name in PARTS}
    for name in tables.keys() - PARTS.keys():
        made[name] = dict(tables[name])
    bed = made["bed"]
    _name_shape(bed, where)
    is_flat = bed.get("shape") == "flat"
    is_level = is_flat and not (bed.get("profile") or bed.get("obstacles"))
    _write_method(made, is_level, where)
    try:
        made["fluid"] = fluids.numbers_of(made["fluid"])
    except InputError as error:
        raise InputError(error.what, f"{where}: {error.where}", error.remedy) from None
    if files:
        _read_files(made, files, where)
    try:
        _write_lengths(made["grain"], bed, is_level)
        return Scene.model_validate(nested(made))
    except UnfitError as error:
        raise InputError(error.what, f"{where}: {error.field}", error.remedy) from None
    except ValidationError as error:
        raise _explained(error, where) from None


def _name_shape(bed: Table, where: str) -> None:
    """Write the kind and the shape of a bed, whose kind may name the shape."""
    for key, default in BED.items():
        bed.setdefault(key, default)
    kind = bed["kind"]
    if kind in [*SHAPES] and bed.get("shape", kind) == kind:
        bed["kind"] = "pile"
        bed["shape"] = kind
    elif kind == "surface":
        what = "a bed in three dimensions is answered by study and erosion alone"
        raise InputError(what, f"{where}: bed.kind", "see docs/surface.md")
    elif kind not in ("grain", "pile"):
        remedy = f"write grain, pile, or a shape: {', '.join(SHAPES)}"
        raise InputError(f"{kind!r} is no bed", f"{where}: bed.kind", remedy)


def _write_method(tables: Tables, is_level: bool, where: str) -> None:
    """Write the numbers of a fidelity, and those that follow from the bed."""
    bed = tables["bed"]
    fidelity = tables["method"].pop("fidelity", AUTO)
    if fidelity != AUTO:
        for name, value in fields_of(fidelity, bed, where).items():
            table, _, field = name.rpartition(".")
            # over a level bed there is nothing to solve
            if not (is_level and table == "method.flow"):
                tables[table].setdefault(field, value)
    if is_level:
        tables["method.flow"].setdefault("model", "flat")
    if bed.get("packing") == "poured":
        tables["method.grains"].setdefault("mobile_layers", POURED_LAYERS)


def _read_files(tables: Tables, files: Files, where: str) -> None:
    """Write what the files say that the tables name."""
    bed = tables["bed"]
    grain = tables["grain"]
    if bed["kind"] == "pile" and isinstance(bed.get("profile"), str):
        bed.update(files.bed(bed, where, str(tables["flow"].get("towards", WITH_X))))
    if isinstance(grain.get("sizes"), str):
        grain["sizes"] = files.sieve(grain["sizes"], where)


def _write_lengths(grain: Table, bed: Table, is_level: bool) -> None:
    """Write the lengths that follow from the grains.

    They are d50, the height of a level bed, and the roughness.
    """
    # values of a wrong type or range are left to the validation of the scene
    with suppress(ValidationError, KeyError, TypeError, OverflowError):
        mixture = MIXTURE.validate_python(grain.get("sizes"))
        if isinstance(mixture, tuple):
            grain.setdefault("diameter", percentile(mixture, 1.0, 0.5))
        if is_level and bed.get("height", 1.0) > 0:
            # it has no height of its own; digits as those that a file has
            bed["height"] = float(f"{LEVEL_HEIGHT * grain['diameter']:.12g}")
        if isinstance(bed["roughness"], str):
            d = grain["diameter"]
            relative = bed.get("relative_size", 1.0)
            if isinstance(relative, int | float) and 1e-3 < relative < 1e3:
                d /= relative
            bed["roughness"] = roughness_length(bed["roughness"], d, mixture)


def value_of(scene: Scene, name: str) -> Any:
    """Find the value of a field of a scene.

    Parameters
    ----------
    scene
        The scene.
    name
        The name of the field in a study file.

    Returns
    -------
    Any
        The value.
    """
    return attrgetter(name)(scene)


def changed(scene: Scene, fields: Mapping[str, Any]) -> Scene:
    """Make a scene with some fields changed.

    Parameters
    ----------
    scene
        The scene.
    fields
        New values by the names of the fields in a study file.

    Returns
    -------
    Scene
        The scene.

    Raises
    ------
    InputError
        For a value that a field cannot have.
    """
    tables = {name: dict(attrgetter(name)(scene)) for name in PARTS}
    # the tables within the method stand beside it
    for name in PARTS:
        outer, _, inner = name.rpartition(".")
        if outer:
            del tables[outer][inner]
    for name, value in fields.items():
        table, _, field = name.rpartition(".")
        # a name without a table is refused as one
        tables.setdefault(table or name, {})[field] = value
    return make_scene(tables, "fields that are changed")


def _not_toml(error: str, text: str, where: str) -> InputError:
    """The refusal of a file that is no TOML.

    It says how to write the number in its line.
    """
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
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, UnfitError):
        return InputError(cause.what, f"{where}: {cause.field}", cause.remedy)
    path = [*first["loc"]]
    keys = [*_File.model_fields]
    if path[0] == "group" and len(path) > 2:
        where = _place(where, int(path[1]))
        path = path[2:]
        keys = [*_Group.model_fields]
    branch = ""
    if path[0] == "bed" and len(path) > 1:
        branch = str(path.pop(1))
    # tags of unions are no keys
    names = [str(step) for step in path if step not in ("", "rows")]
    name = ".".join(names)
    value = first.get("input")
    gone = _gone(name, value, where)
    if gone is not None:
        return gone
    place = f"{where}: {name}"
    if first["type"] == "missing":
        return InputError(MISSING, place, "add it to the file")
    if first["type"] != "extra_forbidden":
        return not_accepted(value, first["msg"], place)
    if branch == "grain" and names[-1] in PileBed.model_fields:
        remedy = 'a pile has it: kind = "pile"'
        return InputError("a bed of one grain has none", place, remedy)
    return InputError(UNKNOWN, place, meant(names, keys, TABLES))


def _gone(name: str, value: Any, where: str) -> InputError | None:
    """The refusal of a key or a value that study files had before.

    It is None for any other.
    """
    if name in GONE_KEYS:
        what, remedy = GONE_KEYS[name]
        return InputError(what, f"{where}: {name}", remedy)
    if isinstance(value, str) and (name, value) in GONE_VALUES:
        what, remedy = GONE_VALUES[name, value]
        return InputError(f"{value!r}: {what}", f"{where}: {name}", remedy)
    return None


def not_accepted(value: Any, message: str, place: str) -> InputError:
    """Refuse a value, in the words of a study file.

    Parameters
    ----------
    value
        The value.
    message
        What pydantic says of it.
    place
        The file and the field.

    Returns
    -------
    InputError
        The refusal.
    """
    remedy = message.lower().replace("dictionary", "table").replace("tuple", "list")
    if isinstance(value, str):
        remedy = units.meant(value) or remedy
    return InputError(f"{value!r} is not accepted", place, remedy)


def meant(
    names: Sequence[str], keys: Sequence[str], tables: Mapping[str, type[Part]]
) -> str:
    """Find the key that an unknown one is nearest to.

    Parameters
    ----------
    names
        The path of the unknown key.
    keys
        The keys of the file or of the group.
    tables
        The tables that they may be in.

    Returns
    -------
    str
        A question; where no key is near, the page that lists all.
    """
    here = ".".join(names[:-1])
    written = {}
    for key in keys:
        if key not in tables:
            written[key] = f"{key}, above the first table"
    for table in reversed([*tables]):
        for field in tables[table].model_fields:
            written[field] = f"{table}.{field}"
    if "method" in tables:
        written["fidelity"] = FIDELITY
    if here in tables:
        keys = [*tables[here].model_fields]
    for key in keys:
        written[key] = key
    close = difflib.get_close_matches(names[-1], written, n=1)
    if not close:
        return "known keys: docs/study-file.md"
    return f"did you mean {written[close[0]]}?"
