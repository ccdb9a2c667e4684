"""Study files written from dictionaries."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.errors import InputError

OF_TABLES = ("group",)
"""Keys whose values are lists of tables."""


def toml_of(tables: Mapping[str, Any], where: str) -> str:
    """Write the text of a study file from a dictionary.

    Parameters
    ----------
    tables
        The tables of a study file. Values are those of TOML, numbers and arrays of
        numpy, paths, and series of pandas.
    where
        What the dictionary is called in messages.

    Returns
    -------
    str
        The text.

    Raises
    ------
    InputError
        For a key that is no text, and a value that TOML does not have.

    Examples
    --------
    >>> print(toml_of({"title": "Sand", "grain": {"diameter": 1e-3}}, "study"))
    title = "Sand"
    [grain]
    diameter = 0.001
    """
    lines = []
    inner = []
    for key, value in _items(tables, where):
        place = f"{where}: {key}"
        if isinstance(value, Mapping):
            inner.append(f"[{_key(key)}]")
            inner += _lines(value, place)
        elif key in OF_TABLES and isinstance(value, Sequence):
            for number, each in enumerate(value):
                inner.append(f"[[{_key(key)}]]")
                inner += _lines(each, f"{place}[{number}]")
        else:
            lines.append(f"{_key(key)} = {_value(value, place)}")
    return "\n".join([*lines, *inner])


def _items(tables: Any, where: str) -> list[tuple[str, Any]]:
    """The keys of a table with their values; None is left out."""
    if not isinstance(tables, Mapping):
        raise InputError(f"{tables!r} is no dictionary", where, "write one of a table")
    for key in tables:
        if not isinstance(key, str):
            raise InputError(f"{key!r} is no key", where, "write the text of a field")
    return [(key, value) for key, value in tables.items() if value is not None]


def _lines(table: Any, where: str) -> list[str]:
    """The lines of a table, tables in it in one line each."""
    lines = []
    for key, value in _items(table, where):
        lines.append(f"{_key(key)} = {_value(value, f'{where}.{key}')}")
    return lines


def _key(key: str) -> str:
    """A key, in quotes where it needs them."""
    is_bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if is_bare else _text(key)


def _text(text: str) -> str:
    """A text in quotes: that of JSON is that of TOML, but for the mark of deletion."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any, where: str) -> str:
    """A value in TOML."""
    if isinstance(value, np.generic | np.ndarray) or hasattr(value, "to_numpy"):
        value = np.asarray(value).tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str | Path):
        return _text(str(value))
    if isinstance(value, Mapping):
        parts = [
            f"{_key(key)} = {_value(each, f'{where}.{key}')}"
            for key, each in _items(value, where)
        ]
        return f"{{{', '.join(parts)}}}"
    if isinstance(value, Sequence):
        return f"[{', '.join(_value(each, where) for each in value)}]"
    what = f"{value!r} is no value of a study file"
    raise InputError(what, where, "write a number, a text, or a list of them")
