"""A study file: the tables of what is asked, of the method, and axes, read into scenes.

The tables at the top hold for every scene. Each ``[[group]]`` overrides some of them,
and its ``axes`` span a grid: every combination of the listed values is a scene.
"""

import itertools
import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from numbers import Real
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, Generic

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError
from typing_extensions import TypeVar

from orchestrator.errors import InputError, shown, suggestion
from orchestrator.study import units
from orchestrator.study.closed_form import resolved
from orchestrator.study.declare import List, Part, UnfitError, info_of
from orchestrator.study.fidelities import AUTO, fields_of
from orchestrator.study.fields import (
    FIELDS,
    PARTS,
    PROFILE,
    SEED,
    Quantity,
    default_of,
    inner_fields,
)
from orchestrator.study.hints import HINTS
from orchestrator.study.keys import Table, Tables, by_name, nested
from orchestrator.study.models import FLAT
from orchestrator.study.own_errors import OwnErrors
from orchestrator.study.parts import Erosion, PileBed, Sizes, percentile
from orchestrator.study.profile import WITH_X, Files
from orchestrator.study.reading import (
    CONFIRMED,
    TIME_LIMIT_S,
    Given,
    Hint,
    Numbers,
    Point,
    explained,
    fluid_of,
    place_of,
    read,
    scenes_at,
    tables_of,
)
from orchestrator.study.scene import Scene, roughness_length
from orchestrator.study.scopes import APPLIES, BY
from orchestrator.study.shapes import SHAPES
from orchestrator.study.sieve import SieveTable
from orchestrator.study.source import Source, presets
from orchestrator.study.written import toml_of

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
MIXTURE: TypeAdapter[Sizes | None] = TypeAdapter(Sizes | None)


def _not_zero(tolerance: float | None) -> float | None:
    """Refuse a tolerance that no levels are within."""
    if tolerance is not None and tolerance <= 0:
        what = (
            f"{tolerance:g} is not above 0: no levels are known to be without an error"
        )
        raise UnfitError("tolerance", what, NO_TOLERANCE)
    return tolerance


class _Tables(Given):
    """The tables of a file or of a group."""

    threshold: Table = Field(default={})
    seeds: int | None = Field(default=None, ge=0, le=1000)


TABLES: Mapping[str, type[Part]] = {**PARTS, "erosion": Erosion}
"""The tables of a study file."""


class _Group(_Tables):
    name: str = ""


class File(_Tables):
    """The keys at the top of a study file; its tables are read scene by scene."""

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


S = TypeVar("S", bound=Point, default=Scene)
"""The scenes of a kind of beds, by default those of the core."""


def _alone(scenes: Sequence[S]) -> Iterator[Sequence[S]]:
    """Take each scene alone, which answers itself.

    Parameters
    ----------
    scenes
        The scenes.

    Yields
    ------
    sequence of Point
        One of them.
    """
    for scene in scenes:
        yield [scene]


def _as_read(data: Mapping[str, Any], where: str, files: Files) -> Mapping[str, Any]:
    """Take the tables of a study file as they are: the kind of beds names no files.

    Parameters
    ----------
    data
        The tables.
    where
        The name of the study file.
    files
        Reads the files that it names.

    Returns
    -------
    mapping
        The tables.
    """
    del where, files
    return data


@dataclass(frozen=True)
class Kind(Generic[S]):
    """A kind of beds: how a study file on them becomes scenes.

    The core has `PLANE`, a guest may offer another one.

    Attributes
    ----------
    tables
        The tables of such a file.
    make
        Makes a scene of its tables, the name of the file for messages (`where`) and the
        files that the tables may name (`files`).
    check
        Refuses beds that are likelier in millimetres, and what does not go together,
        by the keys at the top, the groups, and the name of the file; returns what is
        asked of files that stand beside the tables of a scene.
    hint
        What is said of an unknown key.
    fields
        Fields that are refused where they have no effect.
    resolved
        Decides what the scenes of a study leave open: the scenes that answer each.
    with_files
        Reads the files that are named beside the tables of a scene: the tables of the
        file with what was read in place of names.
    file
        The keys at the top of such a file.
    without
        Those that beds in a plane alone have.
    most
        Most scenes of a study.
    """

    tables: Mapping[str, type[Part]]
    make: Callable[..., S]
    check: "Callable[[File, Sequence[Group[S]], str], list[units.NumberRemark]]"
    hint: Hint
    fields: Sequence[Quantity] = ()
    resolved: Callable[[Sequence[S]], Iterator[Sequence[S]]] = _alone
    with_files: Callable[[Mapping[str, Any], str, Files], Mapping[str, Any]] = _as_read
    file: type[File] = File
    without: Sequence[str] = ()
    most: int = MOST_SCENES

    def explained(self, error: ValidationError, where: str) -> InputError:
        """Refuse a file's tables, for the first thing that is wrong in them.

        Parameters
        ----------
        error
            What pydantic says of them.
        where
            The file, for messages.

        Returns
        -------
        InputError
            The refusal.
        """
        tops: dict[str, type[Part]] = {"": self.file, "group": _Group}
        return explained(error, where, self.tables, tops, self.hint)


Beds = Mapping[str, Callable[[], Kind[Any]]]
"""Kinds of beds that guests offer, by their words for `bed.kind`."""


@dataclass(frozen=True)
class Group(Generic[S]):
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
    scenes: tuple[S, ...]  # in the file's order, each with its force law decided
    where: str  # its place in messages: the file, and which group of it


@dataclass(frozen=True)
class Study(Generic[S]):
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
    source
        Where the text came from; None if it was no file.
    errors
        The numerical errors by which it is answered; None for those of the package.
    asked
        What is said of numbers that are usual in another unit.
    understood
        What was understood of each file that it names, in words, by name.
    sieves
        The sieve tables that it names, by their classes.
    kind
        The kind of its beds.
    """

    name: str  # the file's, without its ending
    title: str
    groups: tuple[Group[S], ...]
    time_limit_s: float  # wall time after which one solver run counts as hung, s
    tolerance: float | None
    """Relative error that tau_c may have; None: not given."""
    cluster: dict[str, Any]  # settings of the queue that runs the cases
    erosion: Erosion  # winds and threshold of `orchestrator erosion`
    text: str
    """The file itself, and the texts of the files that it names."""
    source: Source | None = None
    """None if the text came from elsewhere."""
    errors: OwnErrors | None = None
    """None: those of the package."""
    asked: tuple[units.NumberRemark, ...] = ()
    """What is said of numbers that are usual in another unit; of a preset nothing."""
    understood: Mapping[str, str] = field(default_factory=dict, compare=False)
    sieves: Mapping[tuple[tuple[float, float], ...], SieveTable] = field(
        default_factory=dict, compare=False
    )
    kind: Kind[S] = field(kw_only=True, compare=False, repr=False)

    @property
    def file(self) -> str:
        """Absolute path of the study file; empty if the text came from elsewhere."""
        return self.source.file if self.source else ""

    @cached_property
    def scenes(self) -> tuple[S, ...]:
        """Every scene once, in the file's order."""
        found: dict[str, S] = {}
        for group in self.groups:
            found.update({scene.id: scene for scene in group.scenes})
        return tuple(found.values())

    def with_errors(self, errors: OwnErrors | None) -> "Study[S]":
        """Answer it by other numerical errors than those of the package.

        Parameters
        ----------
        errors
            The errors; None for those of the package.

        Returns
        -------
        Study
            The study.

        Raises
        ------
        InputError
            For a study of beds that have no such errors.
        """
        if errors is not None and self.kind is not PLANE:
            what = "a ladder measures the errors of beds in a plane, not of this study"
            raise InputError(what, "--errors", "leave it out")
        source = self.source and replace(self.source, errors=errors)
        return replace(self, source=source, errors=errors)

    @property
    def questions(self) -> tuple[str, ...]:
        """What is said of numbers that are usual in another unit, in words."""
        return tuple(one.text for one in self.asked)


def load(source: str | Path, tolerance: float | None = None) -> Study:
    """Read a study file of the core's beds by its path, or a preset by its name.

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
    return load_any(source, tolerance, {})


def load_any(source: str | Path, tolerance: float | None, beds: Beds) -> Study[Any]:
    """Read a study file, also on the beds of guests.

    Parameters
    ----------
    source
        The path of the file, or the name of a preset.
    tolerance
        Relative error that tau_c may have, in place of the file's.
    beds
        What guests offer.

    Returns
    -------
    Study
        The study, of the kind that its beds have.

    Raises
    ------
    InputError
        With the file, the field and the remedy.
    """
    _check_tolerance(tolerance)
    inputs = read(source)
    files = Files(inputs.path.parent)
    # a file's name may be bytes that are no text; the page and the tables are text
    name = os.fsencode(inputs.path.stem).decode("utf-8", "replace")
    kind = _kind_of(inputs.tables, beds)
    study = _study(kind, inputs.tables, inputs.text, name, str(inputs.path), files)
    study = replace(study, source=inputs.source(files.digests, tolerance))
    return _asked(study, tolerance)


def of_dictionary(
    tables: Mapping[str, Any], name: str, tolerance: float | None = None
) -> Study:
    """Make a study of a dictionary in place of a file.

    Parameters
    ----------
    tables
        The tables of a study file. Files that it names are those of the working
        directory.
    name
        The name of the study.
    tolerance
        Relative error that tau_c may have, in place of the dictionary's.

    Returns
    -------
    Study
        The study.

    Raises
    ------
    InputError
        With the field and the remedy.
    """
    _check_tolerance(tolerance)
    where = "the dictionary"
    files = Files(Path())
    text = toml_of(tables, where)
    study = _study(PLANE, tables_of(text, where), text, name, where, files)
    return _asked(study, tolerance)


def _check_tolerance(tolerance: float | None) -> None:
    """Refuse a tolerance that is none."""
    given: Any = tolerance  # Python gives what it likes
    is_number = isinstance(given, Real) and not isinstance(given, bool)
    if given is not None and not (is_number and 0 < given < 1):
        what = f"{tolerance!r} is not a relative error above 0 and below 1"
        raise InputError(
            what, "tolerance", f"0.05 allows tau_c to be 5 % off; or {NO_TOLERANCE}"
        )


def _asked(study: Study[S], tolerance: float | None) -> Study[S]:
    """A study with the tolerance that is asked for; its questions are warnings."""
    if tolerance is not None:
        study = replace(study, tolerance=tolerance)
    if study.questions:
        warnings.warn("; ".join(study.questions), stacklevel=4)
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
    if files is None:
        files = Files(Path(where).parent)
    return _study(PLANE, tables_of(text, where), text, name, where, files)


def _study(
    kind: Kind[S],
    data: Mapping[str, Any],
    text: str,
    name: str,
    where: str,
    files: Files,
) -> Study[S]:
    """The study of the tables of a file, whose beds are of a kind."""
    for place, table in _levels(data, where):
        for key in table.keys() & {*kind.without}:
            what = "beds in a plane alone have it"
            remedy = 'leave it out, or bed.kind = "pile"'
            raise InputError(what, f"{place}: {key}", remedy)
    try:
        file = kind.file.model_validate(kind.with_files(data, where, files))
    except ValidationError as error:
        raise kind.explained(error, where) from None
    files.carried = dict(file.profiles)
    numbers = Numbers(partial(files.sieve, where=where))
    groups = _groups(kind, file, where, files, numbers)
    asked = numbers.asked + kind.check(file, groups, where)
    if file.units_confirmed:
        asked = [one for one in asked if not one.is_question]
    if any(text == path.read_text(encoding="utf-8") for path in presets().values()):
        asked = []
    return Study(
        name=name,
        title=file.title or name,
        groups=groups,
        time_limit_s=file.time_limit,
        tolerance=file.tolerance,
        cluster=file.cluster,
        erosion=file.erosion,
        text=text + files.added,
        asked=tuple(asked),
        understood=dict(files.understood),
        sieves=dict(files.sieves),
        kind=kind,
    )


def _kind_of(data: Mapping[str, Any], beds: Beds) -> Kind[Any]:
    """The kind of the beds of a file, or of its first group that has one."""
    for _, table in _levels(data, ""):
        bed = table.get("bed")
        word = bed.get("kind") if isinstance(bed, dict) else None
        if isinstance(word, str) and word in beds:
            return beds[word]()
    return PLANE


def _levels(
    data: Mapping[str, Any], where: str
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The top of a file and its groups, with their places; what is none is left out."""
    yield where, data
    groups = data.get("group")
    for number, table in enumerate(groups if isinstance(groups, list) else ()):
        if isinstance(table, dict):
            yield place_of(where, number), table


def _groups(
    kind: Kind[S], file: File, where: str, files: Files, numbers: Numbers
) -> tuple[Group[S], ...]:
    """The groups of a study with their scenes, the force law of each decided."""
    tables_of = file.group or (_Group(),)
    places = [where]
    if file.group:
        places = [place_of(where, number) for number in range(len(file.group))]
    parts = [name for name in kind.tables if name != "erosion"]
    listed: list[list[S]] = []
    count = 0
    for group, place in zip(tables_of, places, strict=True):
        axes = _axes(file, group, place)
        tables = by_name(dict(file), parts)
        own = by_name(dict(group), parts)
        for part, table in own.items():
            tables[part] |= table
        _list_profiles(tables["bed"], axes, files, place)
        count += math.prod(map(len, axes.values()))
        if count > kind.most:
            what = f"more than {kind.most} scenes in the study"
            raise InputError(what, f"{place}: axes", "shorten the lists")
        make = partial(kind.make, where=place, files=files)
        listed.append([*scenes_at(tables, axes, place, make, numbers)])
        _check_effect(kind.fields, own, listed[-1], place)
    every = [*itertools.chain(*listed)]
    _check_effect(kind.fields, by_name(dict(file), parts), every, where)
    # force laws are found for the scenes of all groups at once
    laws = kind.resolved(every)
    groups = []
    for number, group in enumerate(tables_of):
        scenes: list[S] = []
        for _ in listed[number]:
            scenes += next(laws)
        name = group.name or f"group {number + 1}"
        groups.append(Group(name, tuple(scenes), places[number]))
    return tuple(groups)


def _check_effect(
    fields: Sequence[Quantity], tables: Tables, scenes: Sequence[Any], where: str
) -> None:
    """Refuse a field that is written for some scenes, and has an effect on none."""
    for each in fields:
        table, _, key = each.name.rpartition(".")
        value = tables[table].get(key, default_of(each.name))
        if isinstance(value, list):
            value = tuple(value)
        if value != default_of(each.name) and not any(map(each.applies, scenes)):
            raise _without_effect(f"{where}: {each.name}", each.info.scope)
        if isinstance(value, dict):
            _check_inner(each.name, value, scenes, where)


def _check_inner(name: str, table: Table, scenes: Sequence[Any], where: str) -> None:
    """Refuse a key of a field that is a table, if it has an effect on no scene."""
    for key, declared in inner_fields(name).items():
        scope = info_of(declared).scope
        is_written = table.get(key, declared.default) != declared.default
        if is_written and not any(map(APPLIES[scope], scenes)):
            raise _without_effect(f"{where}: {name}.{key}", scope)


def _without_effect(place: str, scope: str) -> InputError:
    """The refusal of what has an effect on other scenes alone."""
    what = f"it has an effect on {scope} alone"
    return InputError(what, place, f"leave it out, or {BY[scope]}")


def _axes(file: File, table: "_Group", where: str) -> dict[str, list[Any]]:
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


def _list_profiles(
    bed: Table, axes: dict[str, list[Any]], files: Files, where: str
) -> None:
    """Write an axis of profiles in place of the folders that have them."""
    given = axes.get(PROFILE, [bed.get("profile")])
    if not any(isinstance(name, str) for name in given):
        return
    listed: list[Any] = []
    for name in given:
        listed += files.series(name, where) if isinstance(name, str) else [name]
    if listed != given:
        axes[PROFILE] = listed


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
    level_shapes = [shape.name for shape in SHAPES.values() if shape.is_level]
    is_flat = bed.get("shape") in level_shapes
    is_level = is_flat and not (bed.get("profile") or bed.get("obstacles"))
    _write_method(made, is_level, where)
    made["fluid"] = fluid_of(made["fluid"], where)
    if files:
        _read_files(made, files, where)
    try:
        _write_lengths(made["grain"], bed, is_level)
        return Scene.model_validate(nested(made))
    except UnfitError as error:
        raise InputError(error.what, f"{where}: {error.field}", error.remedy) from None
    except ValidationError as error:
        raise PLANE.explained(error, where) from None


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
        near = suggestion(str(kind), ["grain", "pile", "surface", *SHAPES])
        if near:
            remedy = f"{near} Else {remedy}"
        what = f"{shown(kind)} is no kind of bed"
        raise InputError(what, f"{where}: bed.kind", remedy)


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
        tables["method.flow"].setdefault("model", FLAT.name)
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


def _check_profiles(
    file: File, groups: Sequence[Group], where: str
) -> list[units.NumberRemark]:
    """Refuse profiles that are likelier in millimetres."""
    del where
    for group in () if file.units_confirmed else groups:
        for scene in group.scenes:
            bed = scene.bed
            if not isinstance(bed, PileBed) or not bed.profile:
                continue
            asked = units.ask_about_bed(bed.profile.name, bed.profile.x[-1], bed.height)
            if asked:
                remedy = f"divide x_m and z_m by 1000, or {CONFIRMED} if it is so large"
                raise InputError(asked, f"{group.where}: bed.profile", remedy)
    return []


def _hint(names: Sequence[str], branch: str) -> tuple[str, str] | None:
    """Say which beds have a field that is of no bed of this kind."""
    *table, name = names
    if branch == "grain" and name in PileBed.model_fields:
        return "a bed of one grain has none", 'a pile has it: kind = "pile"'
    told = (hint(".".join(table), name) for hint in HINTS)
    return next(filter(None, told), None)


PLANE = Kind(TABLES, make_scene, _check_profiles, _hint, FIELDS, resolved)
"""Beds in a plane: a grain on two others, and piles."""
