"""What a field of a study file takes, in words, by its declaration.

Messages are made of it, so that none has the words of the library that validates.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from orchestrator.digits import enumerated
from orchestrator.study.declare import Info, info_of

FEW_KEYS = 6
"""Keys of a table that a message names."""
UNITS = {"°": ", in degrees", "of N": " of N"}
"""Words for units, behind a number, where they are not their symbols."""
PLURAL = {"a number": "numbers", "a whole number": "whole numbers"}
"""Words for the items of a list."""


@dataclass(frozen=True)
class Taken:
    """What is taken at one place of a study file.

    Attributes
    ----------
    kind
        Its type, as it is declared.
    rules
        Rules of its range, and words of its field.
    """

    kind: Any
    rules: tuple[Any, ...] = ()

    @property
    def words(self) -> list[str]:
        """The words that it may be, where it has some."""
        words = []
        for kind, _ in _members(self.kind, self.rules):
            if get_origin(kind) is Literal:
                words += [word for word in get_args(kind) if isinstance(word, str)]
        return words

    @property
    def keys(self) -> list[str]:
        """The keys of the table that it may be."""
        keys: dict[str, None] = {}
        for kind, _ in _members(self.kind, self.rules):
            if _is_table(kind):
                keys |= dict.fromkeys(kind.model_fields)
        return [*keys]

    @property
    def said(self) -> str:
        """What it may be, in words."""
        alternatives = [*_alternatives(self.kind, self.rules)]
        unit = self._info.unit
        if unit and alternatives and alternatives[0].startswith(tuple(PLURAL)):
            alternatives[0] += UNITS.get(unit, f", in {unit}")
        return ", or ".join(filter(None, [*dict.fromkeys(alternatives), self.also]))

    @property
    def also(self) -> str:
        """What a study file may have in place of its value, in words."""
        return self._info.also

    @property
    def _info(self) -> Info:
        """The words of its field."""
        return next((rule for rule in self.rules if isinstance(rule, Info)), Info())

    def at(self, step: str | int) -> "Taken | None":
        """Find what it has at a key, or at a place of a list.

        Parameters
        ----------
        step
            The key or the place.

        Returns
        -------
        Taken or None
            None where it has none: the library names members of unions, too.
        """
        for kind, rules in _members(self.kind, self.rules):
            if isinstance(step, str) and _is_table(kind) and step in kind.model_fields:
                return of_field(kind.model_fields[step])
            if isinstance(step, int) and get_origin(kind) is tuple:
                return Taken(get_args(kind)[0], tuple(map(_of_item, rules)))
            if isinstance(step, str) and get_origin(kind) is dict:
                return Taken(get_args(kind)[1])
        return None


def of_field(declared: FieldInfo) -> Taken:
    """Find what a field takes.

    Parameters
    ----------
    declared
        Its declaration.

    Returns
    -------
    Taken
        Its type with its rules and its words.
    """
    rules = (*declared.metadata, info_of(declared))
    return Taken(declared.annotation, rules)


def at_path(
    top: type[BaseModel],
    tables: Mapping[str, type[BaseModel]],
    path: Sequence[str | int],
) -> tuple[str, Taken | None]:
    """Follow the path of a value to what is taken there.

    Parameters
    ----------
    top
        The keys above the first table.
    tables
        The tables by their names.
    path
        Keys, places in lists, and names of members of unions.

    Returns
    -------
    name : str
        The path as a study file has it.
    taken : Taken or None
        What is taken there; None of an unknown key.
    """
    name = ""
    taken: Taken | None = None
    for step in path:
        longer = f"{name}.{step}" if name else str(step)
        if longer in tables:
            name, taken = longer, Taken(tables[longer])
            continue
        inner = taken.at(step) if taken else None
        if taken is None and step in top.model_fields:
            inner = of_field(top.model_fields[str(step)])
        if inner is None:
            continue
        taken = inner
        name = f"{name}[{step + 1}]" if isinstance(step, int) else longer
    return name, taken


def _of_item(rule: Any) -> Any:
    """The rule of a list for its items: what stands for the list is none for them."""
    return replace(rule, also="") if isinstance(rule, Info) else rule


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _members(kind: Any, rules: Sequence[Any]) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """The types that a union has, each with its own rules and those of all."""
    origin = get_origin(kind)
    if origin is Annotated:
        inner, *more = get_args(kind)
        own: list[Any] = []
        for rule in more:
            own += rule.metadata if isinstance(rule, FieldInfo) else [rule]
        yield from _members(inner, (*own, *rules))
    elif origin in (Union, UnionType):
        for each in get_args(kind):
            yield from _members(each, rules)
    elif kind is not NoneType:
        yield kind, tuple(rules)


def _alternatives(kind: Any, rules: Sequence[Any]) -> Iterator[str]:
    """What each member of a type is, in words."""
    for each, own in _members(kind, rules):
        yield _alternative(each, own)


def _alternative(kind: Any, rules: Sequence[Any]) -> str:
    """What a type is, in words."""
    if get_origin(kind) is Literal:
        words = [f'"{word}"' for word in get_args(kind)]
        return f"one of {', '.join(words)}" if len(words) > 1 else words[0]
    if get_origin(kind) is tuple:
        return _list(get_args(kind), rules)
    if get_origin(kind) is list:
        return "a list of values, in brackets"
    if kind in (float, int):
        return f"a {'whole ' if kind is int else ''}number{_range(rules)}"
    if _is_table(kind):
        keys = [*kind.model_fields]
        is_short = len(keys) <= FEW_KEYS
        return f"a table with {enumerated(keys)}" if is_short else "a table"
    if kind is dict or get_origin(kind) is dict:
        return "a table"
    # what is read from a file is a type of its own
    return {bool: "true or false", str: "a text, in quotes"}.get(
        kind, "the name of a file, in quotes"
    )


def _list(items: Sequence[Any], rules: Sequence[Any]) -> str:
    """What a list is, in words."""
    if items[-1] is not Ellipsis:
        return f"a list of two numbers{_range(rules)}"
    has_one = any(isinstance(rule, MinLen) for rule in rules)
    listed = "a list of one or more" if has_one else "a list of"
    if get_origin(next(_members(items[0], ()))[0]) is tuple:
        return f"{listed} rows of two numbers"
    said = next(_alternatives(items[0], rules))
    for one, several in PLURAL.items():
        if said.startswith(one):
            return f"{listed} {several}{said.removeprefix(one)}"
    return f"{listed} tables{said.removeprefix('a table')}"


ENDS: Mapping[type, tuple[str, str]] = {
    Ge: ("ge", "from"),
    Gt: ("gt", "above"),
    Le: ("le", "to"),
    Lt: ("lt", "below"),
}
"""The rules of a range: the name of the number, and the word before it."""


def _range(rules: Iterable[Any]) -> str:
    """The range of a number, in words."""
    said = [
        f"{word} {getattr(rule, name):g}"
        for kind, (name, word) in ENDS.items()
        for rule in rules
        if isinstance(rule, kind)
    ]
    # "from 0 to 9", but "from 0, below 9"
    between = ", " if "below" in "".join(said[1:]) else " "
    return f" {between.join(said)}" if said else ""
