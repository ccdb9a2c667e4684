"""A study file: fluid, grain, bed, flow, protocol and axes in TOML, read into scenes.

The tables at the top hold for every scene. Each ``[[group]]`` overrides some of them, and its
``axes`` span a grid: every combination of the listed values is a scene. Without groups the file
is one group.
"""

import itertools
import math
import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from orchestrator.errors import InputError, unknown_key
from orchestrator.study import sizes
from orchestrator.study.closed_form import resolved
from orchestrator.study.fields import PARTS
from orchestrator.study.part import UnfitError
from orchestrator.study.parts import PileBed
from orchestrator.study.profile import Files, read_text
from orchestrator.study.scene import Scene, roughness_length

PRESETS = Path(__file__).parent / "presets"
TIME_LIMIT_S = 3600.0
LONGEST_S = 1e8
"""Longest time limit: three years."""
BED = {"kind": "grain", "roughness": "d/30"}
"""Fields of a bed that a file may leave out."""
MOST_SCENES = 100_000
MOST_BYTES = 2**24
"""Largest study file, bytes: one that lists every scene that there may be is smaller."""
MOST_SEEDS = 1000
GROUP_KEYS = (*PARTS, "axes", "name", "seeds")
TOP_KEYS = (
    *(*PARTS, "axes", "title", "time_limit", "tolerance", "cluster", "group", "profiles"),
    "seeds",
)
RENAMED = {
    "flow.closure": "forces.law",
    "flow.lift_coefficient": "forces.lift_coefficient",
    "flow.stress": "forces.stress",
    "flow.average": "forces.averaging_length",
    "flow.forced": "forces.loaded_grains",
    "flow.growth": "flow.expansion_ratio",
    "flow.correctors": "flow.non_orthogonal_correctors",
    "flow.turbulence": "flow.turbulence_model",
    "flow.convection": "flow.convection_scheme",
    "protocol.step": "protocol.load_increment",
    "protocol.quiet": "protocol.waiting_time",
    "protocol.marker": "protocol.displacement_criterion",
    "protocol.until": "protocol.final_fraction",
    "protocol.timestep": "protocol.time_step",
}
"""Former names of keys, with the present ones."""


@dataclass(frozen=True)
class Group:
    """Scenes of a study that belong together: the points of one experiment."""

    name: str
    scenes: tuple[Scene, ...]
    """In the file's order, each with its force law decided."""
    where: str
    """Its place in messages: the file, and which group of it."""


@dataclass(frozen=True)
class Study:
    """The content of a study file."""

    name: str
    """The file's name without its ending."""
    title: str
    """A line for the page."""
    groups: tuple[Group, ...]
    """In the file's order."""
    time_limit_s: float
    """Wall time after which one solver run counts as hung, s."""
    tolerance: float | None
    """Relative error that tau_c may have; 0: every scene as it is asked for; None: not given."""
    cluster: dict[str, Any]
    """Settings of the queue that runs the cases, if one does; `cluster.pool` knows them."""
    text: str
    """The file itself, and the profiles that it names."""
    file: str = ""
    """Absolute path of the file; empty if the text came from elsewhere."""

    @cached_property
    def scenes(self) -> tuple[Scene, ...]:
        """Every scene once, in the file's order."""
        return tuple({scene.id: scene for group in self.groups for scene in group.scenes}.values())


def presets(folders: Iterable[Path] = ()) -> dict[str, Path]:
    """The study files that the package brings by name, with those in some other folders."""
    listed = (path for folder in (PRESETS, *folders) for path in folder.glob("*.toml"))
    return {path.stem: path for path in sorted(listed)}


def load(source: str, folders: Iterable[Path] = ()) -> Study:
    """Read a study file, or a preset by its name.

    Parameters
    ----------
    source : str
        The file's path, or the preset's name.
    folders : iterable of Path
        Other folders with presets.

    Raises
    ------
    InputError
        Naming the file, the field and the remedy.
    """
    brought = presets(folders)
    path = brought.get(source, Path(source))
    if not os.path.isfile(path):
        raise InputError(
            "there is no such study file, nor a preset of this name",
            where=source,
            remedy=f"presets: {', '.join(sorted(brought))}; or give the path of a TOML file",
        )
    text = read_text(path, MOST_BYTES, source)
    # a file's name may be bytes that are no text; the page and the tables are text
    name = os.fsencode(path.stem).decode("utf-8", "replace")
    if name.strip(".") == "":
        raise InputError("a file of dots names no study", where=source, remedy="rename it")
    return replace(parse(text, name=name, where=source), file=str(path.absolute()))


def parse(text: str, *, name: str, where: str) -> Study:
    """Make a study of the text of a TOML file.

    Only scenes that cannot be built are refused; a plan refuses those beyond the methods' limits.

    Parameters
    ----------
    text, name : str
        The text, and the name of the study.
    where : str
        Path of the file, for messages; profiles are looked for in its folder.

    Raises
    ------
    InputError
        Naming the file, the field and the remedy.
    """
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise InputError("tables or lists are nested too deeply", where=where) from None
    except ValueError as error:
        raise InputError(f"not TOML: {error}", where=where) from None
    _check_keys(data, TOP_KEYS, where)
    limit, title = data.get("time_limit", TIME_LIMIT_S), data.get("title", name)
    if isinstance(limit, bool) or not isinstance(limit, int | float) or not 0 < limit <= LONGEST_S:
        what, remedy = f"{limit!r} is not a time in seconds", f"above 0, and at most {LONGEST_S:g}"
        raise InputError(what, where=f"{where}: time_limit", remedy=remedy)
    if not isinstance(title, str):
        raise InputError("the title is not a text", where=f"{where}: title")
    files = Files(Path(where).parent, _table(data, "profiles", where))
    groups = list(_groups(data, where, files))
    # force laws are found for the scenes of all groups at once
    under_laws = resolved([scene for group in groups for scene in group.scenes])
    groups = [
        Group(g.name, tuple(itertools.chain(*itertools.islice(under_laws, len(g.scenes)))), g.where)
        for g in groups
    ]
    if (tolerance := data.get("tolerance")) is not None:
        check_tolerance(tolerance, f"{where}: tolerance")
    cluster = _table(data, "cluster", where)
    return Study(name, title, tuple(groups), float(limit), tolerance, cluster, text + files.added)


def check_tolerance(value: Any, where: str) -> None:
    """See that a tolerance is a relative error below 1; else an `InputError`."""
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value < 1:
        what = f"{value!r} is not a relative error from 0 to below 1"
        remedy = "0.05 allows tau_c to be 5 % off, 0 takes every scene as it is asked"
        raise InputError(what, where=where, remedy=remedy)


def _groups(data: Mapping[str, Any], where: str, files: Files) -> Iterator[Group]:
    """The groups of a file, with their scenes as they are asked for."""
    listed, count = data.get("group", [{}]), 0
    is_list = isinstance(listed, list) and listed
    if not is_list or not all(isinstance(item, dict) for item in listed):
        what, remedy = "not a list of tables", "write [[group]] for each"
        raise InputError(what, where=f"{where}: group", remedy=remedy)
    for number, item in enumerate(listed, 1):
        place = f"{where}: group {number}" if "group" in data else where
        _check_keys(item, GROUP_KEYS, place)
        tables = {
            part: {**_table(data, part, place), **_table(item, part, place)}
            for part in (*PARTS, "axes")
        }
        for key, values in tables["axes"].items():
            part, dot, field = key.partition(".")
            what, remedy = "", 'for instance "grain.diameter" = [1e-4, 1e-3]'
            if part not in PARTS or not dot or not field:
                what = "an axis is named by its table and field"
            elif not isinstance(values, list) or not values:
                what = f"{values!r} is not a list of values"
            if what:
                raise InputError(what, where=f"{place}: axes.{key}", remedy=remedy)
        seeds = item.get("seeds", data.get("seeds", 0))
        if type(seeds) is not int or not 0 <= seeds <= MOST_SEEDS:
            what, remedy = "it is no number of beds", f"at most {MOST_SEEDS}: 5 takes seeds 0 to 4"
            raise InputError(what, where=f"{place}: seeds", remedy=remedy)
        if seeds:
            tables["axes"]["bed.seed"] = list(range(seeds))
        count += math.prod(map(len, tables["axes"].values()))
        if count > MOST_SCENES:
            what = f"more than {MOST_SCENES} scenes in the study"
            raise InputError(what, where=f"{place}: axes", remedy="shorten the lists")
        scenes = tuple(_scenes(tables, place, files))
        yield Group(str(item.get("name", f"group {number}")), scenes, place)


def _scenes(tables: Mapping[str, dict[str, Any]], where: str, files: Files) -> Iterator[Scene]:
    """A scene for each combination of the axes' values; each must be a scene of its own."""
    points: dict[str, tuple[Any, ...]] = {}
    for point in itertools.product(*tables["axes"].values()):
        parts = {part: dict(tables[part]) for part in PARTS}
        for key, value in zip(tables["axes"], point, strict=True):
            part, _, field = key.partition(".")
            parts[part][field] = value
        scene = make_scene(parts, where, files)
        same = points.setdefault(scene.id, point)
        if same is not point:
            texts = (", ".join(map(str, values)) for values in (same, point))
            what = f"{' and '.join(texts)} are one scene"
            raise InputError(what, where=f"{where}: axes", remedy="list each value once")
        yield scene


def _table(data: Mapping[str, Any], name: str, where: str) -> dict[str, Any]:
    table = data.get(name, {})
    if not isinstance(table, dict):
        what = f"{table!r} is not a table"
        raise InputError(what, where=f"{where}: {name}", remedy=f"write [{name}]")
    return dict(table)


def make_scene(
    parts: Mapping[str, dict[str, Any]], where: str, files: Files | None = None
) -> Scene:
    """Validate the tables of one scene.

    Parameters
    ----------
    parts : mapping
        The tables by their names; d/30 of a diameter is filled in, and the d50 of a sieve table.
    where : str
        Names the file in messages.
    files : Files, optional
        The files that the tables may name.

    Raises
    ------
    InputError
        For the first thing wrong: the file, the field and the remedy.
    """
    bed, grain = {**BED, **parts["bed"]}, dict(parts["grain"])
    if files and bed["kind"] == "pile" and "profile" in bed:
        bed |= files.bed(bed, where)
    if files and isinstance(grain.get("sizes"), str):
        grain["sizes"] = files.sieve(grain["sizes"], where)
    try:
        mixture = sizes.read(grain.get("sizes"))
        if isinstance(mixture, tuple):
            grain.setdefault("diameter", sizes.percentile(mixture, 1.0, 0.5))
        diameter, relative = grain.get("diameter"), bed.get("relative_size", 1.0)
        # other values are refused where the fields are declared
        if isinstance(diameter, int | float) and abs(diameter) < 1e300:
            if isinstance(relative, int | float) and 1e-3 < relative < 1e3:
                diameter = diameter / relative
            bed["roughness"] = roughness_length(bed["roughness"], diameter, mixture)
        return Scene.model_validate({**parts, "grain": grain, "bed": bed})
    except UnfitError as error:
        raise InputError(error.what, where=f"{where}: {error.field}", remedy=error.remedy) from None
    except ValidationError as error:
        raise _explained(error, where) from None


def _check_keys(table: Mapping[str, Any], keys: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in keys:
            raise unknown_key(key, keys, f"{where}: {key}", _elsewhere(""))


def _explained(error: ValidationError, where: str) -> InputError:
    """The refusal of a scene's tables, for the first thing that is wrong in them."""
    # a misspelt key says more than the field that is missing because of it
    first = min(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, UnfitError):
        return InputError(cause.what, where=f"{where}: {cause.field}", remedy=cause.remedy)
    path = [str(step) for step in first["loc"]]
    is_grain = path[:2] == ["bed", "grain"]
    if path[0] == "bed" and path[1:2] in (["grain"], ["pile"]):
        del path[1]  # the branch of the union, not a key of the file
    field = ".".join(path)
    place = f"{where}: {field}"
    if first["type"] == "missing":
        return InputError("is missing", where=place, remedy="add it to the file")
    if first["type"] != "extra_forbidden":
        remedy = first["msg"].lower().replace("input should", "it should")
        return InputError(f"{first.get('input')!r} is not accepted", where=place, remedy=remedy)
    if field in RENAMED:
        return InputError("a former name", where=place, remedy=f"write {RENAMED[field]}")
    if is_grain and path[1] in PileBed.model_fields:
        what, remedy = "unknown key of a bed of one grain", 'a pile has it: write kind = "pile"'
        return InputError(what, where=place, remedy=remedy)
    keys = list(PARTS[path[0]].model_fields if path[1:] else PARTS)
    return unknown_key(path[-1], keys, place, _elsewhere(path[0]))


def _elsewhere(here: str) -> list[tuple[str, str]]:
    """The keys of all tables but one, with how a message writes them."""
    tables = ((part, model.model_fields) for part, model in PARTS.items() if part != here)
    fields = [(name, f"{part}.{name}") for part, names in tables for name in names]
    top = (key for key in TOP_KEYS if key not in PARTS)
    return [*fields, *((key, f"{key}, above the first table") for key in top)]
