"""A solver's answer to a scene: one CSV file, taken only if it is whole."""

import csv
import difflib
import errno
import math
import os
import stat
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import pandas as pd

from orchestrator.errors import OrchestratorError

COLUMNS = ("quantity", "at", "value")
FILE = "answer.csv"
MOST = 4 * 2**20
"""Size of an answer, bytes: more numbers than any pack asks."""
LARGEST = 1e30
"""Largest number in SI units, or without a unit."""
Key = tuple[str, str]
"""Quantity, and the text of its `at` with seven digits."""
COUNTS = ("moved", "not_moved", "carried_off")
"""Whole numbers, which may be small."""
STEPS: Key = ("steps", "")
"""Quantity that a solver may add to any answer: its number of time steps."""


class AnswerError(OrchestratorError):
    """An answer that cannot be used."""


def key(quantity: str, at: str) -> Key:
    """The same for every way in which a solver may write the number `at`."""
    return quantity, f"{float(at):.7g}" if at.strip() else ""


def keys(asked: pd.DataFrame) -> list[Key]:
    """The keys of the numbers that are asked, by the columns ``quantity`` and ``at``."""
    return [key(q, at) for q, at in zip(asked["quantity"], asked["at"], strict=True)]


def read(path: Path, asked: pd.DataFrame, count: float | None) -> dict[Key, float]:
    """Read an answer.

    Parameters
    ----------
    path : Path
        The file.
    asked : DataFrame
        Columns ``quantity`` and ``at``.
    count : float or None
        How many grains are counted, where the scene says so.

    Raises
    ------
    AnswerError
        Naming what is wrong with it.
    """
    found = numbers(path)
    _check_complete(found, keys(asked))
    _check_counts(found, count)
    return found


def numbers(path: Path) -> dict[Key, float]:
    """The numbers of an answer, whatever was asked.

    Raises
    ------
    AnswerError
        If the file is missing or not whole.
    """
    return parsed(content(path))


def parsed(text: bytes) -> dict[Key, float]:
    """The numbers of an answer that was read.

    Raises
    ------
    AnswerError
        If it is not whole.
    """
    try:
        # some programs begin a text with a mark of its encoding
        return dict(_rows(text.decode("utf-8-sig")))
    except UnicodeDecodeError:
        raise AnswerError(f"{FILE} is no text") from None
    except csv.Error as error:
        raise AnswerError(f"{FILE} is no table: {error}") from None


def content(path: Path | str, *, folder: int | None = None) -> bytes:
    """The bytes of an answer; a program that means harm may have put anything there.

    Parameters
    ----------
    path : Path or str
        The file.
    folder : int, optional
        An open directory that the path starts from.

    Raises
    ------
    AnswerError
        If there is no file, or it is too large to be an answer.
    """
    try:
        # a pipe must not be waited for, nor a link followed to what another program wrote
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=folder)
    except FileNotFoundError:
        raise AnswerError(f"it wrote no {FILE}") from None
    except OSError as error:
        why = "it is a link" if error.errno == errno.ELOOP else error.strerror
        raise AnswerError(f"{FILE} cannot be read: {why}") from None
    try:
        state = os.fstat(handle)
        if not stat.S_ISREG(state.st_mode):
            raise AnswerError(f"{FILE} is no file")
        if state.st_size > MOST:
            size = state.st_size / 2**20
            raise AnswerError(f"{FILE} has {size:.0f} MiB, more than {MOST // 2**20}")
        return os.read(handle, MOST)
    finally:
        os.close(handle)


def _rows(text: str) -> list[tuple[Key, float]]:
    lines = text.splitlines()
    if not lines or tuple(word.strip() for word in lines[0].split(",")) != COLUMNS:
        start = f"begins with {lines[0][:60]!r}" if lines else "is empty"
        raise AnswerError(f"{FILE} {start}, not with {','.join(COLUMNS)}")
    rows = [_row(number, row) for number, row in enumerate(csv.reader(lines[1:]), 2) if row]
    if not text.endswith("\n"):
        raise AnswerError(f"{FILE} is cut short: line {len(lines)} has no end")
    counts = Counter(found for found, _ in rows)
    twice = next((one for one, count in counts.items() if count > 1), None)
    if twice:
        raise AnswerError(f"{FILE} answers {_said(twice)} twice")
    return rows


def _row(number: int, row: Sequence[str]) -> tuple[Key, float]:
    if len(row) != len(COLUMNS):
        why = "is cut short" if len(row) < len(COLUMNS) else "has decimal commas, or another form"
        raise AnswerError(f"{FILE} {why}: line {number} has {len(row)} of 3 fields")
    try:
        where = key(row[0].strip(), row[1])
        value = _number(row[2])
    except ValueError:
        raise AnswerError(f"{FILE}, line {number}: {','.join(row)!r} holds no number") from None
    if not math.isfinite(value):
        raise AnswerError(f"{FILE}, line {number}: {_said(where)} is {row[2].strip()}, not finite")
    if abs(value) > LARGEST:
        raise AnswerError(f"{FILE}, line {number}: {_said(where)} is {value:g}, which nothing is")
    return where, value


def _number(text: str) -> float:
    if "_" in text or not text.isascii():  # Python reads more than other programs write
        raise ValueError(text)
    return float(text)


def _check_complete(found: Mapping[Key, float], asked: Sequence[Key]) -> None:
    missing = [one for one in asked if one not in found]
    if not missing:
        return
    extra = {quantity for quantity, _ in found} - {quantity for quantity, _ in asked}
    like = difflib.get_close_matches(missing[0][0], sorted(extra), n=1, cutoff=0.5)
    hint = f"; is {like[0]} meant?" if like else ""
    more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
    raise AnswerError(f"{FILE} lacks {_said(missing[0])}{more}{hint}")


def _check_counts(found: Mapping[Key, float], count: float | None) -> None:
    total = found.get(("count", ""), count)
    for one, n in found.items():
        if one[0] in COUNTS and not (n >= 0 and n.is_integer()):
            raise AnswerError(f"{_said(one)} is {n:g}: it counts grains")
    moved = sorted(
        (float(at), n) for (quantity, at), n in found.items() if quantity == "moved" and at
    )
    for (_, before), (load_step, n) in pairwise(moved):
        if n < before:
            raise AnswerError(
                f"moved falls from {before:g} to {n:g} at load step {load_step:g}: a grain that "
                f"has moved "
                "has moved for ever"
            )
    for (quantity, at), n in found.items():
        gone = found.get(("moved", at), 0.0)
        if quantity == "not_moved" and total is not None and gone + n != total:
            lost = "are lost" if gone + n < total else "are too many"
            raise AnswerError(
                f"grains {lost}: {gone:g} moved and {n:g} not, at load step {at}, of {total:g}"
            )
        if quantity == "carried_off" and n > gone:
            raise AnswerError(
                f"{n:g} grains are carried off at load step {at}, of {gone:g} that moved"
            )


def _said(one: Key) -> str:
    return f"{one[0]} at {one[1]}" if one[1] else one[0]
