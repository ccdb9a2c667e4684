"""A study file: fluid, grain, bed, flow, protocol and axes in TOML, read into scenes.

The tables at the top hold for every scene. Each ``[[group]]`` overrides some of them, and its
``axes`` span a grid: every combination of the listed values is a scene. Without groups the file
is one group.
"""

import itertools
import math
import os
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from orchestrator.errors import InputError
from orchestrator.runs import assets
from orchestrator.runs.files import opened
from orchestrator.study import sizes
from orchestrator.study.closed_form import resolved
from orchestrator.study.fields import PARTS
from orchestrator.study.parts import UnfitError
from orchestrator.study.profiles import Profiles
from orchestrator.study.refusals import GROUP_KEYS, TOP_KEYS, check_keys, explained
from orchestrator.study.scene import Scene, roughness_length
from orchestrator.study.sizes import Sizes

TIME_LIMIT_S = 3600.0
LONGEST_S = 1e8
"""Three years."""
BED = {"kind": "grain", "roughness": "d/30"}
"""Fields of a bed that a file may leave out."""
MOST_SCENES = 100_000
MOST_BYTES = 2**24
"""Largest study file, bytes: one that lists every scene that there may be is smaller."""
MOST_SEEDS = 1000


@dataclass(frozen=True)
class Group:
    """Scenes of a study that belong together: the points of one experiment.

    Attributes
    ----------
    name : str
        As the file says.
    scenes : tuple of Scene
        In the file's order, each with its force law decided.
    where : str
        Its place in messages: the file, and which group of it.
    """

    name: str
    scenes: tuple[Scene, ...]
    where: str


@dataclass(frozen=True)
class Study:
    """The content of a study file.

    Attributes
    ----------
    name : str
        The file's name without its ending.
    title : str
        A line for the page.
    groups : tuple of Group
        In the file's order; every scene has its force law decided.
    time_limit_s : float
        Wall time after which one solver run counts as hung, s.
    tolerance : float or None
        Relative error that tau_c may have; 0: every scene as it is asked for; None: it is not said.
    cluster : dict
        Settings of the queue that runs the cases, if one does; `cluster.pool` knows them.
    text : str
        The file itself, and the profiles that it names.
    file : str
        Absolute path of the file; empty if the text came from elsewhere.
    """

    name: str
    title: str
    groups: tuple[Group, ...]
    time_limit_s: float
    tolerance: float | None
    cluster: dict[str, Any]
    text: str
    file: str = ""

    @cached_property
    def scenes(self) -> tuple[Scene, ...]:
        """Every scene once, in the file's order."""
        return tuple({scene.id: scene for group in self.groups for scene in group.scenes}.values())


def presets(folders: Iterable[Path] = ()) -> dict[str, Path]:
    """The study files that the package brings by name, with those in some other folders."""
    listed = (path for folder in (assets.presets(), *folders) for path in folder.glob("*.toml"))
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
    if not _is_file(path):
        known = ", ".join(sorted(brought))
        raise InputError(
            "there is no such study file, nor a preset of this name",
            where=source,
            remedy=f"presets: {known}; or give the path of a TOML file",
        )
    try:
        # some editors begin a text with a mark of its encoding
        with opened(path) as stream:
            content = stream.read(MOST_BYTES + 1) or b""  # nothing of what would wait
        text = content.decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"not a readable text file: {error}", where=source) from None
    if len(content) > MOST_BYTES:
        raise InputError(f"it is larger than {MOST_BYTES // 2**20} MiB", where=source)
    # a file's name may be bytes that are no text; the page and the tables are text
    name = os.fsencode(path.stem).decode("utf-8", "replace")
    if name.strip(".") == "":
        raise InputError("a file of dots names no study", where=source, remedy="rename it")
    return replace(parse(text, name=name, where=source), file=str(path.absolute()))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long
        return False


def parse(text: str, *, name: str, where: str) -> Study:
    """Make a study of a TOML file's text; `where` names the file in messages.

    Only scenes that cannot be built are refused; a plan refuses those beyond the methods' limits.

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
    check_keys(data, TOP_KEYS, where)
    limit = data.get("time_limit", TIME_LIMIT_S)
    check_time(limit, f"{where}: time_limit")
    title = data.get("title", name)
    if not isinstance(title, str):
        raise InputError("the title is not a text", where=f"{where}: title")
    profiles = Profiles(Path(where).parent, dict(_table(data, "profiles", where)))
    groups = tuple(_resolved(list(_groups(data, where, profiles))))
    tolerance = data.get("tolerance")
    if tolerance is not None:
        check_tolerance(tolerance, f"{where}: tolerance")
    cluster = _table(data, "cluster", where)
    return Study(name, title, groups, float(limit), tolerance, cluster, text + profiles.added)


def check_time(value: Any, where: str) -> None:
    """A time limit is one that a machine can wait for.

    Raises
    ------
    InputError
        If it is not.
    """
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 < value <= LONGEST_S:
        raise InputError(
            f"{value!r} is not a time in seconds",
            where=where,
            remedy=f"above 0, and at most {LONGEST_S:g}",
        )


def check_tolerance(value: Any, where: str) -> None:
    """A tolerance is a relative error below 1.

    Raises
    ------
    InputError
        If it is not.
    """
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value < 1:
        raise InputError(
            f"{value!r} is not a relative error from 0 to below 1",
            where=where,
            remedy="0.05 allows tau_c to be 5 % off, 0 takes every scene as it is asked",
        )


def _groups(data: Mapping[str, Any], where: str, profiles: Profiles) -> Iterator[Group]:
    listed = data.get("group", [{}])
    is_list = isinstance(listed, list) and listed
    if not is_list or not all(isinstance(item, dict) for item in listed):
        raise InputError(
            "not a list of tables", where=f"{where}: group", remedy="write [[group]] for each"
        )
    count = 0
    for number, item in enumerate(listed, 1):
        place = f"{where}: group {number}" if "group" in data else where
        check_keys(item, GROUP_KEYS, place)
        merged = {part: _merged(data, item, part, place) for part in (*PARTS, "axes")}
        if seeds := _seeds(item.get("seeds", data.get("seeds", 0)), f"{place}: seeds"):
            merged["axes"] = {**merged["axes"], "bed.seed": seeds}
        _check_axes(merged["axes"], place)
        count += math.prod(map(len, merged["axes"].values()))
        if count > MOST_SCENES:
            what = f"more than {MOST_SCENES} scenes in the study"
            raise InputError(what, where=f"{place}: axes", remedy="shorten the lists")
        scenes = tuple(_scenes(merged, place, profiles))
        yield Group(str(item.get("name", f"group {number}")), scenes, place)


def _seeds(count: Any, where: str) -> list[int]:
    """The seeds of beds that differ in nothing else; none where a file asks for none."""
    if type(count) is not int or not 0 <= count <= MOST_SEEDS:
        what = "it is no number of beds"
        raise InputError(what, where=where, remedy=f"at most {MOST_SEEDS}: seeds = 5 takes 0 to 4")
    return list(range(count))


def _resolved(groups: Sequence[Group]) -> Iterator[Group]:
    """The groups with a force law for each of their scenes; for all of them at once."""
    each = resolved([scene for group in groups for scene in group.scenes])
    for group in groups:
        decided = itertools.islice(each, len(group.scenes))
        yield replace(group, scenes=tuple(itertools.chain.from_iterable(decided)))


def _merged(
    data: Mapping[str, Any], item: Mapping[str, Any], part: str, where: str
) -> dict[str, Any]:
    return {**_table(data, part, where), **_table(item, part, where)}


def _table(data: Mapping[str, Any], name: str, where: str) -> dict[str, Any]:
    table = data.get(name, {})
    if not isinstance(table, dict):
        raise InputError(
            f"{table!r} is not a table", where=f"{where}: {name}", remedy=f"write [{name}]"
        )
    return table


def _check_axes(axes: Mapping[str, Any], where: str) -> None:
    """See that each axis is a list of values of a field."""
    for key, values in axes.items():
        part, dot, field = key.partition(".")
        if part not in PARTS or not dot or not field:
            raise InputError(
                "an axis is named by its table and field",
                where=f"{where}: axes.{key}",
                remedy='for instance "grain.diameter" = [1e-4, 1e-3]',
            )
        if not isinstance(values, list) or not values:
            raise InputError(
                f"{values!r} is not a list of values",
                where=f"{where}: axes.{key}",
                remedy="write [first, second, ...]",
            )


def _scenes(tables: Mapping[str, dict[str, Any]], where: str, profiles: Profiles) -> list[Scene]:
    grid = list(itertools.product(*tables["axes"].values()))
    scenes = [make_scene(parts, where, profiles) for parts in _points(tables, grid)]
    if len(grid) > 1:
        _check_distinct(scenes, grid, where)
    return scenes


def _check_distinct(scenes: list[Scene], grid: list[tuple[Any, ...]], where: str) -> None:
    """See that each combination of values is a scene of its own."""
    points: dict[str, tuple[Any, ...]] = {}
    for scene, point in zip(scenes, grid, strict=True):
        same = points.setdefault(scene.id, point)
        if same is not point:
            said, again = (", ".join(map(str, values)) for values in (same, point))
            raise InputError(
                f"{said} and {again} are one scene",
                where=f"{where}: axes",
                remedy="list each value once",
            )


def _points(
    tables: Mapping[str, dict[str, Any]], grid: list[tuple[Any, ...]]
) -> Iterator[dict[str, dict[str, Any]]]:
    places = [key.partition(".")[::2] for key in tables["axes"]]
    for point in grid:
        parts = {part: dict(tables[part]) for part in PARTS}
        for (part, field), value in zip(places, point, strict=True):
            parts[part][field] = value
        yield parts


def make_scene(
    parts: Mapping[str, dict[str, Any]], where: str, profiles: Profiles | None = None
) -> Scene:
    """Validate the tables of one scene; `where` names the file in messages.

    Raises
    ------
    InputError
        For the first thing wrong: the file, the field and the remedy.
    """
    bed = {**BED, **parts["bed"]}
    if profiles and bed["kind"] == "pile" and isinstance(bed.get("profile"), str):
        bed |= profiles.bed(bed, where)
    grain = parts["grain"]
    if profiles and isinstance(grain.get("sizes"), str):
        grain = {**grain, "sizes": profiles.sieve(grain["sizes"], where)}
    try:
        mixture, grain = _mixture(grain)
        if diameter := _of_the_bed(grain.get("diameter"), bed.get("relative_size", 1.0)):
            bed["roughness"] = roughness_length(bed["roughness"], diameter, mixture)
        return Scene.model_validate({**parts, "grain": grain, "bed": bed})
    except UnfitError as error:
        raise InputError(error.what, where=f"{where}: {error.field}", remedy=error.remedy) from None
    except ValidationError as error:
        raise explained(error, where) from None


def _mixture(grain: dict[str, Any]) -> tuple[Sizes | None, dict[str, Any]]:
    """The sizes of a bed's grains, None where they are equal; the grain, a sieve's with its d50."""
    try:
        found = sizes.read(grain.get("sizes"))
    except ValueError:
        return None, {"diameter": 1e-3, **grain}  # the model will refuse the sizes
    if not isinstance(found, tuple):
        return found, grain
    return found, {"diameter": sizes.percentile(found, 1.0, 0.5), **grain}


def _of_the_bed(diameter: Any, relative_size: Any) -> float:
    """Diameter of the grains that make the bed rough, m; 0 where the model will refuse it."""
    if not isinstance(diameter, int | float) or abs(diameter) >= sys.float_info.max:
        return 0.0
    # the model will refuse a size that is none
    is_size = isinstance(relative_size, int | float) and 1e-3 < relative_size < 1e3
    return float(diameter / relative_size) if is_size else float(diameter)
