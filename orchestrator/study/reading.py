"""The tables of a study file: read, spread over its axes, and refused in its words.

Files on all kinds of beds are read alike.
"""

import difflib
import itertools
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Protocol, TypeVar

from pydantic import Field, ValidationError

from orchestrator.digits import enumerated
from orchestrator.errors import InputError, shown, suggestion
from orchestrator.physics import fluids
from orchestrator.study import units
from orchestrator.study.accepted import Taken, at_path
from orchestrator.study.declare import Part, UnfitError
from orchestrator.study.fields import FIDELITY, PARTS, default_of, table_of
from orchestrator.study.keys import Table, Tables
from orchestrator.study.profile import LARGEST_NUMBER
from orchestrator.study.source import Source, decoded, find, read_bytes

TIME_LIMIT_S = 3600.0
MOST_BYTES = 2**24
"""Largest study file: one that lists so many scenes is smaller."""
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
CONFIRMED = "write units_confirmed = true at the top of the study file"
"""What accepts a bed of an unusual size."""


class Point(Protocol):
    """A scene of any kind of beds: one point of a study."""

    @property
    def id(self) -> str:
        """What tells it from every other scene."""


Made = TypeVar("Made", bound=Point)
Hint = Callable[[Sequence[str], str], tuple[str, str] | None]
"""Says of the path of an unknown key, and of the kind of its bed, what is wrong and
what to do; None where it is no more than unknown."""


class Given(Part):
    """The tables of a file, which are validated scene by scene."""

    fluid: Table = Field(default={})
    grain: Table = Field(default={})
    bed: Table = Field(default={})
    flow: Table = Field(default={})
    forces: Table = Field(default={})
    method: Table = Field(default={})
    axes: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(default={})


class Inputs(NamedTuple):
    """A study file as it was read.

    Attributes
    ----------
    path
        The file.
    text
        Its text.
    digest
        SHA-256 of its bytes.
    tables
        The tables in it.
    """

    path: Path
    text: str
    digest: str
    tables: dict[str, Any]

    def source(
        self, named: Mapping[str, str | None], tolerance: float | None = None
    ) -> Source:
        """Say what a study was read from.

        Parameters
        ----------
        named
            SHA-256 of the files that it names, by their names.
        tolerance
            The tolerance that was given in place of the file's.

        Returns
        -------
        Source
            The file and the digests of all.
        """
        digests = {**named, self.path.name: self.digest}
        return Source(str(self.path.absolute()), digests, tolerance)


def read(source: str | Path) -> Inputs:
    """Read a study file by its path, or a preset by its name.

    Parameters
    ----------
    source
        The path or the name.

    Returns
    -------
    Inputs
        The file with its tables.

    Raises
    ------
    InputError
        For a file that is not there or no TOML.
    """
    path = find(source)
    content = read_bytes(path, MOST_BYTES, str(source))
    text = decoded(content, str(source))
    return Inputs(path, text, sha256(content).hexdigest(), tables_of(text, str(path)))


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
    # the parser quotes the character as Python would
    said = error.replace(r"character '\n'", "end of a line")
    return InputError(f"not TOML: {said}", where, remedy)


def at_points(
    tables: Mapping[str, Table], axes: Mapping[str, list[Any]], where: str
) -> Iterator[tuple[tuple[Any, ...], Tables]]:
    """Write each combination of the axes' values into the tables of a file.

    Parameters
    ----------
    tables
        The tables by their names.
    axes
        The values by the names of their fields, such as ``grain.diameter``.
    where
        The file, for messages.

    Yields
    ------
    point
        The values.
    tables
        The tables with them.

    Raises
    ------
    InputError
        For an axis that is not of a field in one of the tables.
    """
    for name in axes:
        if table_of(name) not in tables:
            first = name.partition(".")[0]
            remedy = 'write "grain.diameter" = [1e-4, 1e-3]'
            what = "not a table and a field of it"
            raise InputError(what, f"{where}: axes.{first}", remedy)
    for point in itertools.product(*axes.values()):
        made = {name: dict(table) for name, table in tables.items()}
        for name, value in zip(axes, point, strict=True):
            table, _, field = name.rpartition(".")
            made[table][field] = value
        yield point, made


def scenes_at(
    tables: Mapping[str, Table],
    axes: Mapping[str, list[Any]],
    where: str,
    make: Callable[[Tables], Made],
    numbers: "Numbers",
) -> Iterator[Made]:
    """Make a scene of each combination of the axes' values.

    Parameters
    ----------
    tables
        The tables by their names.
    axes
        The values by the names of their fields.
    where
        The file, for messages.
    make
        Makes the scene of the tables at one point.
    numbers
        The numbers that are asked about, to which those of these scenes are added.

    Yields
    ------
    object
        The scene.

    Raises
    ------
    InputError
        For a scene that is refused, with the questions on its numbers, and for one that
        the axes have a second time.
    """
    points: dict[str, tuple[Any, ...]] = {}
    for point, made in at_points(tables, axes, where):
        numbers.add(made)
        try:
            scene = make(made)
        except InputError as error:
            raise units.hinted(error, numbers.asked) from None
        same = points.setdefault(scene.id, point)
        if same is not point:
            one = ", ".join(map(str, same))
            other = ", ".join(map(str, point))
            what = f"{one} and {other} are one scene"
            raise InputError(what, f"{where}: axes", "list each value once")
        yield scene


@dataclass
class Numbers:
    """The numbers in tables of scenes that are asked about, as they are written.

    Attributes
    ----------
    sieve
        Reads the sieve table of a file.
    """

    sieve: Callable[[str], list[list[float]]] | None = None
    _points: list[dict[str, float | None]] = field(default_factory=list)
    _sieves: dict[str, list[float]] = field(default_factory=dict)

    def add(self, tables: Mapping[str, Table]) -> None:
        """Take note of the numbers of one scene, which may be wrong.

        Parameters
        ----------
        tables
            Its tables by their names.
        """
        given = {name: dict(tables.get(name, {})) for name in PARTS}
        with suppress(InputError):
            given["fluid"] = fluids.numbers_of(given["fluid"])
        numbers: dict[str, float | None] = {}
        for name in ASKED:
            table, _, key = name.partition(".")
            value = given[table].get(key, default_of(name))
            is_usual = _is_number(value) and abs(value) < LARGEST_NUMBER
            numbers[name] = value if is_usual else None
        self._points.append(numbers)
        sizes = given["grain"].get("sizes")
        if sizes is not None and str(sizes) not in self._sieves:
            self._sieves[str(sizes)] = self._diameters(sizes)

    def _diameters(self, sizes: Any) -> list[float]:
        """The diameters of a sieve table, as far as they are numbers."""
        with suppress(InputError):
            if isinstance(sizes, str) and self.sieve is not None:
                sizes = self.sieve(sizes)
        if not isinstance(sizes, list):
            return []
        firsts = [row[0] for row in sizes if isinstance(row, list) and row]
        return [*filter(_is_number, firsts)]

    @property
    def asked(self) -> list[units.NumberRemark]:
        """What is said of the numbers."""
        values: dict[str, list[float]] = {}
        for name in ASKED:
            each = (numbers[name] for numbers in self._points)
            # what is left open, or follows from a file, is no number
            values[name] = [value for value in each if value is not None]
        asked = units.questions(values, {})
        for diameters in self._sieves.values():
            asked += units.of_sieve(diameters)
        return asked


def _is_number(value: Any) -> bool:
    """Whether a value of a study file is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def fluid_of(table: Table, where: str) -> Table:
    """Write the numbers of a fluid in place of its kind.

    Parameters
    ----------
    table
        The table ``[fluid]``.
    where
        The file, for messages.

    Returns
    -------
    dict
        The table with the numbers.

    Raises
    ------
    InputError
        For a kind that has no formulas, and for what is given twice.
    """
    try:
        return fluids.numbers_of(table)
    except InputError as error:
        raise InputError(error.what, f"{where}: {error.where}", error.remedy) from None


def place_of(where: str, group: int) -> str:
    """Name the place of a group in messages.

    Parameters
    ----------
    where
        The file.
    group
        Number of the group, from 0.

    Returns
    -------
    str
        The place.
    """
    return f"{where}: group {group + 1}"


def explained(
    error: ValidationError,
    where: str,
    tables: Mapping[str, type[Part]],
    tops: Mapping[str, type[Part]],
    hint: Hint,
) -> InputError:
    """Refuse a file's tables, for the first thing that is wrong in them.

    Other fields that are not accepted are named behind it.

    Parameters
    ----------
    error
        What pydantic says of them.
    where
        The file, for messages.
    tables
        The tables that a file may have.
    tops
        The keys at its top under the empty name, and those of a ``group``.
    hint
        What is said of an unknown key.

    Returns
    -------
    InputError
        The refusal.
    """
    # a misspelt key says more than the field that is missing because of it
    found = sorted(
        error.errors(),
        key=lambda e: e["type"] != "extra_forbidden" and "sizes" not in e["loc"],
    )
    first = found[0]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, UnfitError):
        return InputError(cause.what, f"{where}: {cause.field}", cause.remedy)
    path, top = [*first["loc"]], tops[""]
    if path[0] == "group" and len(path) > 2:
        where = place_of(where, int(path[1]))
        path, top = path[2:], tops["group"]
    value = first.get("input")
    if first["type"] == "extra_forbidden":
        name, within = at_path(top, tables, path[:-1])
        key = f"{name}.{path[-1]}" if name else str(path[-1])
        known = hint(key.split("."), _branch(path))
        what, remedy = known or ("", _meant(key, value, within, top, tables))
        return InputError(what or "unknown key", f"{where}: {key}", remedy)
    name, taken = at_path(top, tables, path)
    if first["type"] == "missing":
        return InputError("is missing", f"{where}: {name}", "add it to the file")
    others = dict.fromkeys(_other(each, name, top, tables) for each in found)
    others.pop("", None)
    remedy = _remedy(value, taken, first["msg"])
    if others:
        remedy += f"; not accepted either: {enumerated([*others])}"
    return InputError(f"{shown(value)} is not accepted", f"{where}: {name}", remedy)


def _branch(path: Sequence[str | int]) -> str:
    """The kind of bed that a path leads through, if any."""
    is_named = path[:1] == ["bed"] and path[1:2] and path[1] in ("grain", "pile")
    return str(path[1]) if is_named else ""


def _remedy(value: object, taken: Taken | None, message: str) -> str:
    """What to write in place of a value that is not accepted."""
    said = f"write {taken.said}" if taken and taken.said else message
    if not isinstance(value, str):
        return said
    near = suggestion(value, taken.words) if taken else ""
    if near:
        said = f"{near} Else {said}"
    return units.meant(value) or said


def _other(
    error: Mapping[str, Any], first: str, top: type[Part], tables: Mapping[str, Any]
) -> str:
    """The field of another value that is not accepted; empty for what is none."""
    path = error["loc"]
    if error["type"] in ("missing", "extra_forbidden", "value_error"):
        return ""
    if path[:1] == ("group",):
        return ""
    name, taken = at_path(top, tables, path)
    if taken and taken.also and isinstance(error["input"], str):
        return ""  # it was not worked out, for want of what it is a part of
    name = name.partition("[")[0]
    return "" if name == first.partition("[")[0] else name


def _meant(
    unknown: str,
    value: Any,
    within: Taken | None,
    top: type[Part],
    tables: Mapping[str, type[Part]],
) -> str:
    """The key that an unknown one is nearest to, or those that there are.

    Of an unknown table its name is compared first, then the keys in it.
    """
    here, _, last = unknown.rpartition(".")
    if within and here not in tables:
        keys = within.keys
        return suggestion(last, keys) or f"known keys: {enumerated(keys)}"
    written = {}
    for key in top.model_fields:
        if key not in tables:
            written[key] = f"{key}, above the first table"
    for table in reversed([*tables]):
        for key in tables[table].model_fields:
            written[key] = f"{table}.{key}"
    if "method" in tables:
        written["fidelity"] = FIDELITY
    for key in tables.get(here, top).model_fields:
        written[key] = key
    words = [last, *(value if isinstance(value, dict) else ())]
    for word in words:
        for near in difflib.get_close_matches(word, written, n=1):
            return f"did you mean {written[near]}?"
    return "known keys: docs/study-file.md"
