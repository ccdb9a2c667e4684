"""Tables of text as people write them: what stands between cells, and their numbers.

A comma is a decimal mark in one file and marks thousands in another. What the cells of
a file mean is told by all of them: one cell that can only be the one decides.
"""

import csv
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from orchestrator.errors import InputError
from orchestrator.study.heads import UNIT_CELL, more_cells
from orchestrator.study.units import number

COMMENT = re.compile(r"^\s*(#|//|%|!)+\s*")
SIEVE_NUMBER = re.compile(r"\s*#\d+\s*[,;\t]")
"""A line that begins with the number of a sieve, and is no comment."""
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars", ",": "commas"}
"""What may stand between cells, in words."""
LOOKED_AT = 40
"""Lines by which it is told what stands between cells."""
LONGEST_HEAD = 200
"""Most lines before the names of the columns."""
BLANKS = "\u00a0\u2009\u202f'’"
"""Marks of thousands that are no decimal mark: thin blanks, the Swiss apostrophe."""
_GROUPED = rf"[+-]?\d{{1,3}}(?:[{BLANKS} ]\d{{3}})+"
BLANK_GROUPS = re.compile(rf"{_GROUPED}(?:[.,]\d*)?")
DECIMAL = re.compile(
    rf"[+-]?\d*,\d+(?:e[+-]?\d+)?|[+-]?\d{{1,3}}(?:\.\d{{3}})+,\d+|{_GROUPED},\d+",
    re.IGNORECASE,
)
"""A number that may have a decimal comma."""
EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A number whose comma may be a decimal mark or mark thousands."""
POINT_GROUPS = re.compile(r"[+-]?\d{1,3}(?:\.\d{3}){2,}")
"""A number whose points can only mark thousands."""
COMMA_GROUPS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+\.\d*|[+-]?\d{1,3}(?:,\d{3}){2,}")
"""A number whose commas can only mark thousands."""
POINT = re.compile(r"[+-]?\d*\.\d*(?:e[+-]?\d+)?", re.IGNORECASE)
"""A number with one point."""


class Marks(NamedTuple):
    """How the numbers of a file are written.

    Attributes
    ----------
    decimal
        The decimal mark.
    thousands
        What marks thousands, beside blanks and apostrophes; empty for nothing.
    """

    decimal: str = "."
    thousands: str = ""

    @property
    def said(self) -> str:
        """What is said of them; empty for a decimal point."""
        words = []
        if self.decimal == ",":
            words.append("decimal commas")
        if self.thousands:
            mark = {",": "commas", ".": "points"}[self.thousands]
            words.append(f"{mark} that mark thousands")
        return " and ".join(words)

    def number(self, text: str) -> float:
        """Read a number.

        Parameters
        ----------
        text
            The cell.

        Returns
        -------
        float
            The number.

        Raises
        ------
        ValueError
            With what the cell may mean.

        Examples
        --------
        >>> Marks(",", ".").number("1.234,5"), Marks().number("1'234.5")
        (1234.5, 1234.5)
        """
        cell = text.strip().replace("−", "-")
        if BLANK_GROUPS.fullmatch(cell):
            cell = re.sub(f"[{BLANKS} ]", "", cell)
        if self.thousands:
            cell = cell.replace(self.thousands, "")
        if self.decimal != ".":
            if "." in cell:
                # the file has commas: a point in it is no decimal mark
                raise ValueError(f"{text.strip()!r} has a point, other cells commas")
            cell = cell.replace(self.decimal, ".")
        return number(cell)


def marks_of(cells: Iterable[str]) -> Marks:
    """Tell how the numbers of a file are written.

    Parameters
    ----------
    cells
        All cells that are to be numbers; others say nothing.

    Returns
    -------
    Marks
        The marks.

    Raises
    ------
    ValueError
        If they may mean two things, or contradict each other.

    Examples
    --------
    >>> marks_of(["1,234", "0,5"])
    Marks(decimal=',', thousands='')
    >>> marks_of(["1,234", "0.5"])
    Marks(decimal='.', thousands=',')
    """
    found: dict[str, str] = {}
    for cell in map(str.strip, cells):
        if "," not in cell and cell.count(".") != 1 and "." not in cell:
            continue
        if COMMA_GROUPS.fullmatch(cell):
            found.setdefault("commas of thousands", cell)
        elif EITHER.fullmatch(cell):
            found.setdefault("either", cell)
        elif DECIMAL.fullmatch(cell):
            found.setdefault("decimal commas", cell)
            if "." in cell:
                found.setdefault("points of thousands", cell)
        elif POINT_GROUPS.fullmatch(cell):
            found.setdefault("points of thousands", cell)
        elif POINT.fullmatch(cell):
            found.setdefault("points", cell)
    return _decided(found)


def _decided(found: dict[str, str]) -> Marks:
    """The marks by the first cell of each kind."""
    commas, points = found.get("decimal commas"), found.get("points")
    comma_groups = found.get("commas of thousands")
    point_groups = found.get("points of thousands")
    if commas or point_groups:
        other = comma_groups or (points if not point_groups else None)
        if other:
            one = commas or point_groups
            raise ValueError(
                f"both {one!r} and {other!r} stand there: which is the decimal mark"
            )
        return Marks(",", "." if point_groups else "")
    if comma_groups:
        return Marks(".", ",")
    if "either" in found:
        cell = found["either"]
        if points and len(points.rpartition(".")[2]) != 3:
            return Marks(".", ",")
        decimal, whole = cell.replace(",", "."), cell.replace(",", "")
        raise ValueError(f"{cell!r} may be {decimal} or {whole}: write one of them")
    return Marks()


def separator_of(lines: Sequence[str]) -> str | None:
    """Tell what stands between the cells of some lines.

    Parameters
    ----------
    lines
        Lines of a file, from its first one.

    Returns
    -------
    str or None
        One of `SEPARATORS`, or None for blanks.
    """
    looked_at = [COMMENT.sub("", line) for line in lines if line.strip()][:LOOKED_AT]
    last = looked_at[len(looked_at) // 2 :]
    for mark in ";\t|":
        if last and all(mark in line for line in last):
            return mark
    with_blanks = [line for line in last if _has_numbers_between_blanks(line)]
    has_commas = any("," in line for line in last)
    return "," if has_commas and len(with_blanks) < len(last) else None


def _has_numbers_between_blanks(line: str) -> bool:
    """Whether a line has numbers with blanks between them and no comma behind one."""
    words = line.split()
    return len(words) > 1 and all(
        re.fullmatch(r"[+-]?[\d.,]*\d(e[+-]?\d+)?|nan", word, re.IGNORECASE)
        for word in words
    )


def split_cells(line: str, separator: str | None) -> list[str]:
    """Divide a line into its cells.

    Parameters
    ----------
    line
        The line.
    separator
        What stands between its cells; None for blanks.

    Returns
    -------
    list of str
        The cells, without blanks around them; empty ones at the end are kept.
    """
    if separator is None:
        # a unit in brackets belongs to the name before it
        bare = re.sub(r"\s+(?=[(\[])", "_", line)
        return [cell.strip("\"'") for cell in bare.split()]
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


@dataclass(frozen=True)
class TextTable:
    """A table of a text, whose first lines may be no part of it.

    Attributes
    ----------
    names
        The names of its columns, with the units that stand below them.
    head
        Number of the line with the names, from 1.
    rows
        Number and cells of each line behind it; blank lines and comments are left out.
    separator
        What stands between its cells; None for blanks.
    before
        The lines before the names.
    """

    names: tuple[str, ...]
    head: int
    rows: tuple[tuple[int, list[str]], ...]
    separator: str | None
    before: tuple[str, ...] = ()

    def column(self, place: int) -> list[str]:
        """Give the cells of a column; a missing one is empty.

        Parameters
        ----------
        place
            The place of the column, from 0.

        Returns
        -------
        list of str
            The cells.
        """
        return [cells[place] if place < len(cells) else "" for _, cells in self.rows]

    def cells(self, places: Sequence[int]) -> Iterator[tuple[int, list[str]]]:
        """Give number and cells of each line, of some columns.

        Parameters
        ----------
        places
            The places of the columns, from 0.

        Yields
        ------
        tuple
            The number of the line, and a cell for each column.
        """
        for line, cells in self.rows:
            yield line, [cells[at] if at < len(cells) else "" for at in places]

    def without_foot(self) -> "TextTable":
        """Leave out the words behind its last number, such as an end of file.

        Returns
        -------
        TextTable
            The table to its last line that has a digit.
        """
        last = len(self.rows)
        while last and not any(
            re.search(r"\d", cell) for cell in self.rows[last - 1][1]
        ):
            last -= 1
        return replace(self, rows=self.rows[:last])


def read_cells(
    text: str, is_head: Callable[[Sequence[str]], bool], where: str, remedy: str
) -> TextTable:
    """Read the table of a text.

    Parameters
    ----------
    text
        The text.
    is_head
        Tells whether some cells are the names of its columns.
    where
        The file, for messages.
    remedy
        What the names must be, in words.

    Returns
    -------
    TextTable
        The table.

    Raises
    ------
    InputError
        If no line has the names, or a line has more cells than they are.
    """
    lines = text.splitlines()
    separator = separator_of(lines)
    for place, line in enumerate(lines[:LONGEST_HEAD]):
        for mark in dict.fromkeys([separator, ";", "\t", ",", None]):
            names = split_cells(COMMENT.sub("", line), mark)
            if not is_head(names):
                continue
            inner = separator if _is_data(lines[place + 1 :], separator) else mark
            # a comment may speak of columns without being their names
            if not COMMENT.match(line) or _fits(lines[place + 1 :], names, inner):
                return _table(lines, place, names, inner, where)
    first, shown = next(
        ((i, line) for i, line in enumerate(lines, 1) if line.strip()), (1, "")
    )
    what = f"no names of columns that are known, in {shown.strip()!r}"
    raise InputError(what, f"{where}: line {first}", remedy)


def _fits(lines: Sequence[str], names: Sequence[str], separator: str | None) -> bool:
    """Whether the next line that is no comment has a cell for each name."""
    for line in lines:
        if line.strip() and not COMMENT.match(line):
            return len(split_cells(line, separator)) >= len(names)
    return True


def _is_data(lines: Sequence[str], separator: str | None) -> bool:
    """Whether the next line with cells has several by a separator."""
    for line in lines:
        if line.strip():
            return len(split_cells(line, separator)) > 1
    return False


def _table(
    lines: Sequence[str],
    place: int,
    names: list[str],
    separator: str | None,
    where: str,
) -> TextTable:
    """The table below its names, which stand in a line, from 0."""
    while names and not names[-1]:
        names.pop()
    rows: list[tuple[int, list[str]]] = []
    for number_of_line, line in enumerate(lines[place + 1 :], place + 2):
        is_comment = COMMENT.match(line) and not SIEVE_NUMBER.match(line)
        if not line.strip() or is_comment:
            continue
        cells = split_cells(line, separator)
        if not any(cells):
            continue
        if not rows and is_of_units(cells):
            names = with_units(names, cells)
            continue
        more = cells[len(names) :]
        if any(map(_may_be_number, more)):
            at = f"{where}: line {number_of_line}"
            remedy = "as many cells as the first line has"
            raise InputError(more_cells(len(cells), len(names)), at, remedy)
        rows.append((number_of_line, cells))
    return TextTable(
        tuple(names), place + 1, tuple(rows), separator, tuple(lines[:place])
    )


def is_of_units(cells: Sequence[str]) -> bool:
    """Tell whether a line below the names of columns has units alone.

    Parameters
    ----------
    cells
        Its cells.

    Returns
    -------
    bool
        Whether each that is not empty is a unit.
    """
    given = [cell for cell in cells if cell]
    return bool(given) and all(UNIT_CELL.fullmatch(cell.lower()) for cell in given)


def with_units(names: Sequence[str], cells: Sequence[str]) -> list[str]:
    """Write units that stand below names behind these.

    Parameters
    ----------
    names
        The names of columns.
    cells
        The units below them; some may be empty.

    Returns
    -------
    list of str
        The names with their units in brackets.
    """
    units = [*cells, *[""] * len(names)]
    return [
        f"{name} ({unit.strip('()[] ')})" if unit else name
        for name, unit in zip(names, units, strict=False)
    ]


def _may_be_number(cell: str) -> bool:
    """Whether a cell begins as a number does."""
    return re.match(r"[+-]?[.,]?\d", cell) is not None
