"""The tables of a study file: read, spread over its axes, and refused in its words.

Files on beds in a plane (`study`) and in three dimensions (`surface_study`) are read
alike.
"""

import difflib
import itertools
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Any

from pydantic import Field, ValidationError

from orchestrator.errors import InputError
from orchestrator.physics import fluids
from orchestrator.study import units
from orchestrator.study.declare import Part, UnfitError
from orchestrator.study.fields import FIDELITY, PARTS, default_of, table_of
from orchestrator.study.keys import Table, Tables
from orchestrator.study.profile import LARGEST_NUMBER

TIME_LIMIT_S = 3600.0
MOST_BYTES = 2**24
"""Largest study file: one that lists so many scenes is smaller."""
UNKNOWN = "unknown key"
MISSING = "is missing"
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
TAGS = ("", "rows", "float", "str")
"""Names of the members of unions, which are no keys."""
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
    return InputError(f"not TOML: {error}", where, remedy)


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


def values_of(scenes: Sequence[Any]) -> dict[str, list[float]]:
    """List the values of the fields `ASKED` in some scenes.

    Parameters
    ----------
    scenes
        The scenes.

    Returns
    -------
    dict
        Values by the names of the fields.
    """
    values: dict[str, list[float]] = {}
    for name in ASKED:
        part, _, field = name.partition(".")
        each = [getattr(getattr(scene, part), field, None) for scene in scenes]
        # what is left open is no number, and a bed of one grain has no lee side
        values[name] = [value for value in each if value is not None]
    return values


def with_questions(refusal: InputError, tables: Tables, where: str) -> InputError:
    """Put a refusal behind questions on the numbers that it may come from.

    Parameters
    ----------
    refusal
        The refusal of a scene.
    tables
        The tables of the scene.
    where
        The file, for messages.

    Returns
    -------
    InputError
        The refusal as it is where there is no such question.
    """
    if refusal.what in (UNKNOWN, MISSING):
        return refusal
    asked = units.questions(_values_in(tables), {})
    return units.first(asked, refusal, where, ASKED)


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
    keys: Mapping[str, Sequence[str]],
    hint: Hint,
) -> InputError:
    """Refuse a file's tables, for the first thing that is wrong in them.

    Parameters
    ----------
    error
        What pydantic says of them.
    where
        The file, for messages.
    tables
        The tables that a file may have.
    keys
        The keys at its top under the empty name, and those of a ``group``.
    hint
        What is said of an unknown key.

    Returns
    -------
    InputError
        The refusal.
    """
    # a misspelt key says more than the field that is missing because of it
    first = min(
        error.errors(),
        key=lambda e: e["type"] != "extra_forbidden" and "sizes" not in e["loc"],
    )
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, UnfitError):
        return InputError(cause.what, f"{where}: {cause.field}", cause.remedy)
    path = [*first["loc"]]
    own = keys[""]
    if path[0] == "group" and len(path) > 2:
        where = place_of(where, int(path[1]))
        path = path[2:]
        own = keys["group"]
    branch = ""
    if path[0] == "bed" and path[1:] and path[1] in ("grain", "pile"):
        branch = str(path.pop(1))
    names = [str(step) for step in path if step not in TAGS]
    name = ".".join(names)
    value = first.get("input")
    place = f"{where}: {name}"
    if first["type"] == "missing":
        return InputError(MISSING, place, "add it to the file")
    if first["type"] != "extra_forbidden":
        return _not_accepted(value, first["msg"], place)
    known = hint(names, branch)
    if known is not None:
        what, remedy = known
        return InputError(what, place, remedy)
    return InputError(UNKNOWN, place, _meant(names, value, own, tables))


def _not_accepted(value: Any, message: str, place: str) -> InputError:
    """The refusal of a value, in the words of a study file."""
    remedy = message.lower().replace("dictionary", "table").replace("tuple", "list")
    if "an instance of" in remedy:
        remedy = "write the name of a file, in quotes"
    if isinstance(value, str):
        remedy = units.meant(value) or remedy
    return InputError(f"{value!r} is not accepted", place, remedy)


def _meant(
    names: Sequence[str],
    value: Any,
    keys: Sequence[str],
    tables: Mapping[str, type[Part]],
) -> str:
    """The key that an unknown one is nearest to, or the page that lists all.

    Of an unknown table its name is compared first, then the keys in it.
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
    words = [names[-1], *(value if isinstance(value, dict) else ())]
    for word in words:
        for near in difflib.get_close_matches(word, written, n=1):
            return f"did you mean {written[near]}?"
    return "known keys: docs/study-file.md"
