"""Files of points: a line with x, y and z for each place of a grid, in any order.

Columns are read by their names, where a head has them.
"""

import csv
import io
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

import numpy as np

from orchestrator.errors import InputError
from orchestrator.study.cells import (
    COMMENT,
    Marks,
    is_of_units,
    marks_of,
    with_units,
)
from orchestrator.study.empty import EMPTY_WORDS
from orchestrator.study.heads import (
    ALONG_LINE,
    DEGREES,
    DEPTHS,
    EAST,
    HEIGHT,
    NORTH,
    more_cells,
    name_of,
    one_word,
)
from orchestrator.study.lengths import Lengths, lengths_of
from orchestrator.study.units import number
from orchestrator.surface.heights import FEWEST, MOST_NODES, Raster
from orchestrator.types import FloatArray, IntArray

AXES = {"x": EAST, "y": NORTH, "z": HEIGHT}
"""What the columns of each axis are called."""
CERTAIN = (
    *(name for name in EAST if "x" not in name),
    *(name for name in NORTH if "y" not in name),
)
"""Names that say which way a column goes; geodesists call the northing x."""
OFF_GRID = 0.1
"""Largest distance of a point from its place on a grid, in steps."""
NORTHINGS, EASTINGS = 1e6, 1e5
"""Northings of maps lie above the one, eastings between the two, m."""
POINT_REMEDY = "x, y and z in m, with a decimal point"
NAMES_REMEDY = (
    "name them x, y and z, or easting, northing and height, all in m; known are "
    f"{one_word(EAST)}; {one_word(NORTH)}; {one_word(HEIGHT)}"
)
DECIMAL_COMMA = re.compile(r"(?<![\d,])(?:0|\d{4,}),\d|\d,(?:\d{1,2}|\d{4,})(?![\d,])")
"""A comma that can only be a decimal mark."""


def read_points(text: str, name: str, where: str) -> Raster:
    """Read the points of a raster.

    Parameters
    ----------
    text
        The file: numbers between commas, semicolons, tabs or blanks, and maybe a head
        with the names of the columns.
    name
        The name of the file.
    where
        The file and the field that names it, for messages.

    Returns
    -------
    Raster
        Heights on the grid of the points, NaN where there is none.

    Raises
    ------
    InputError
        With the line and the remedy.
    """
    lines = _Lines(text.splitlines(), where)
    layout = lines.layout()
    lines.check_cells(layout)
    marks = Marks()
    points = _numbers(text, layout)
    if points is None:
        points, marks = _with_marks(text, lines, layout)
    is_place = np.isfinite(points[:, :2]).all(axis=1)
    if not is_place.all():
        what = "x or y is not a number"
        raise lines.refusal(layout, int(is_place.argmin()), what, POINT_REMEDY)
    if len(points) < FEWEST**2:
        what = f"{len(points)} points are no surface"
        raise InputError(what, where, "x, y and z in m, a point in each line")
    points *= layout.units.factors
    _check_order(points, layout, where)
    raster = _on_grid(points, lines, layout, name)
    said = (*layout.said, *filter(None, [marks.said]))
    return replace(raster, understood=said, unit=layout.units.factors[2])


def _numbers(text: str, layout: "_Layout") -> FloatArray | None:
    """The points of a text with decimal points; None if a cell is no number."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # an empty file is refused below
            return np.loadtxt(
                io.BytesIO(text.encode()),
                delimiter=layout.separator,
                quotechar='"',
                skiprows=layout.first,
                usecols=layout.columns,
                ndmin=2,
            )
    except ValueError:
        return None


def _with_marks(
    text: str, lines: "_Lines", layout: "_Layout"
) -> tuple[FloatArray, Marks]:
    """The points of a text with other numbers, and how these are written."""
    if "." not in text and DECIMAL_COMMA.search(text) and layout.separator != ",":
        # no comma marks thousands where another one is a decimal mark
        points = _numbers(text.replace(",", "."), layout)
        if points is not None:
            return points, Marks(",")
    cells = [each for _, each in lines.points(layout)]
    x, y, z = layout.columns
    if any(len(each) <= max(x, y) for each in cells):
        raise lines.wrong(layout)
    if any(len(each) <= z and layout.separator is None for each in cells):
        raise lines.wrong(layout)  # which of the cells is missing nobody knows
    rows = [[each[x], each[y], each[z] if len(each) > z else ""] for each in cells]
    for row in rows:
        if row[2].lower() in ("", *EMPTY_WORDS):
            row[2] = "nan"  # a place without a height
    try:
        marks = marks_of(cell for row in rows for cell in row)
    except ValueError as error:
        raise InputError(str(error), lines.where, POINT_REMEDY) from None
    found = np.empty((len(rows), 3))
    for at, row in enumerate(rows):
        try:
            found[at] = [marks.number(cell) for cell in row]
        except ValueError as error:
            raise lines.refusal(layout, at, str(error), POINT_REMEDY) from None
    return found, marks


class _Layout(NamedTuple):
    """How the lines of a file of points are to be read."""

    separator: str | None
    """What stands between two cells; None for blanks."""
    first: int
    """The place of the first point's line, from 0."""
    columns: tuple[int, int, int]
    """The places of x, y and z in a line."""
    names: tuple[str, ...]
    """The names of all columns; empty without a head."""
    cells: int
    """How many cells a line has at most."""
    units: Lengths
    """The units of x, y and z."""

    @property
    def said(self) -> tuple[str, ...]:
        """What was understood of its columns, in words."""
        if not self.names:
            return (f"its first three columns are x, y and z, {self.units.said}",)
        x, y, z = (self.names[column].strip() for column in self.columns)
        words = [f"x from {x!r}, y from {y!r}, heights from {z!r}, {self.units.said}"]
        datum = name_of(z).datum
        if datum:
            words.append(f"levels above {datum}")
        return tuple(words)


@dataclass(frozen=True)
class _Lines:
    """The lines of a file of points."""

    lines: Sequence[str]
    where: str

    def place(self, line: int) -> str:
        """A line in messages; they are counted from 0."""
        return f"{self.where}: line {line + 1}"

    def layout(self) -> _Layout:
        """How the lines are to be read, by the head and the first point."""
        heads: list[_Head] = []
        has_names = False
        for place, line in enumerate(self.lines):
            is_comment = COMMENT.match(line) is not None
            cells = _cells(COMMENT.sub("", line))
            has_numbers = not is_comment and any(map(_is_number, cells))
            if has_numbers and (has_names or _begins(cells[0])):
                return self._of(place, heads)
            heads.append((place, cells, is_comment))
            has_names = has_names or _named(heads[-1:]) is not None
        for place, cells, is_comment in heads:
            named = _named([(place, cells, is_comment)])
            if cells and not (is_comment or named):
                what = f"{self.lines[place].strip()!r} is no point"
                raise InputError(what, self.place(place), POINT_REMEDY)
        raise InputError("it has no points", self.where, POINT_REMEDY)

    def _of(self, first: int, heads: Sequence["_Head"]) -> _Layout:
        """The layout of a file whose first point is in a line behind some heads."""
        separator = _separator(self.lines[first])
        count = len(_split(self.lines[first], separator))
        head = _named(heads)
        for place, cells, is_comment in heads:
            is_row = len(cells) == count
            likely = is_row and (not is_comment or len(_axes(cells)) > 1)
            if head is None and (likely or (is_row and _degrees(cells)[1:])):
                raise self._unnamed(place, cells)
        if head is None:
            self._check_bare(first, separator, count)
            bare = [(axis, f"column {at}", "") for at, axis in enumerate(AXES, 1)]
            units = lengths_of(bare, self.lines[:first], self.place(first))
            return _Layout(separator, first, (0, 1, 2), (), count, units)
        place, names, _ = head
        below = next((each for each in heads if each[0] > place and each[1]), None)
        if below and is_of_units(below[1]):
            names = with_units(names, below[1])
        columns = self._columns(place, names)
        named = [
            (axis, names[column], name_of(names[column]).unit)
            for axis, column in zip(AXES, columns, strict=True)
        ]
        units = lengths_of(named, self.lines[:place], self.place(place))
        return _Layout(separator, first, columns, tuple(names), len(names), units)

    def _columns(self, place: int, names: Sequence[str]) -> tuple[int, int, int]:
        """The columns of x, y and z by their names, which stand in a line."""
        columns = []
        for axis, called in _axes(names).items():
            if len(called) > 1:
                listed = " or ".join(names[column].strip() for column in called)
                what = f"which column is {axis}: {listed}"
                remedy = f"name that one {axis}, and the other otherwise"
                raise InputError(f"{what}?", self.place(place), remedy)
            columns.append(called[0])
        x, y, z = columns
        return x, y, z

    def _unnamed(self, place: int, cells: Sequence[str]) -> InputError:
        """The refusal of a head that does not say which columns are x, y and z."""
        angles = _degrees(cells)
        if angles:
            what = f"{' and '.join(angles)} are degrees"
            remedy = "project them to metres, with gdaltransform -t_srs EPSG:326NN"
            return InputError(what, self.place(place), remedy)
        what = f"the columns are {', '.join(cells)}"
        plain = {name_of(cell).plain for cell in cells}
        if plain & {*ALONG_LINE}:
            what = f"{what}: along a line, not on a map"
            remedy = "give easting and northing, from which winds have a direction"
            return InputError(what, self.place(place), remedy)
        if plain & {*DEPTHS} and not plain & {*HEIGHT}:
            what = f"{what}: depths go down"
            remedy = "give heights: levels of the water less depths"
            return InputError(what, self.place(place), remedy)
        remedy = f"{NAMES_REMEDY}, or remove the line"
        return InputError(what, self.place(place), remedy)

    def _check_bare(self, first: int, separator: str | None, count: int) -> None:
        """Refuse a first point without a head whose commas may be decimal ones."""
        if separator == "," and count > 3:
            what = f"{count} cells between commas: is one a decimal comma?"
            remedy = "write a decimal point, or a first line with the columns' names"
            raise InputError(what, self.place(first), remedy)

    def check_cells(self, layout: _Layout) -> None:
        """Refuse the first line with more cells than the head that may be numbers."""
        for place, line in enumerate(islice(self.lines, layout.first, None)):
            if layout.separator is None:
                is_short = len(line.split()) <= layout.cells
            else:
                is_short = line.count(layout.separator) < layout.cells
            if is_short:
                continue
            cells = _split(line, layout.separator)
            # a word behind the columns takes nothing from a number
            if any(map(_begins, cells[layout.cells :])):
                where = self.place(layout.first + place)
                what = more_cells(len(cells), layout.cells)
                raise InputError(what, where, POINT_REMEDY)

    def points(self, layout: _Layout) -> Iterator[tuple[int, list[str]]]:
        """Place and cells of the line of each point."""
        for place, line in enumerate(islice(self.lines, layout.first, None)):
            cells = _split(line, layout.separator)
            if cells:
                yield layout.first + place, cells

    def refusal(
        self, layout: _Layout, point: int, what: str, remedy: str
    ) -> InputError:
        """The refusal of a point; they are counted from 0."""
        place, _ = next(islice(self.points(layout), point, None))
        return InputError(what, self.place(place), remedy)

    def wrong(self, layout: _Layout) -> InputError:
        """The refusal of the first line that is no point."""
        for place, cells in self.points(layout):
            if len(cells) <= max(layout.columns):
                what = f"{self.lines[place].strip()!r} is no point"
                return InputError(what, self.place(place), POINT_REMEDY)
            for column in layout.columns:
                try:
                    number(cells[column])
                except ValueError as error:
                    return InputError(str(error), self.place(place), POINT_REMEDY)
        return InputError("its lines are no points", self.where, POINT_REMEDY)


_Head = tuple[int, list[str], bool]
"""A line before the points: its place, its cells, and whether it is a comment."""


def _named(heads: Sequence[_Head]) -> _Head | None:
    """The last head that names all axes; None without one.

    A comment does so in as many words as there are axes, or with each name once.
    """
    for head in reversed(heads):
        _, cells, is_comment = head
        called = _axes(cells)
        is_once = all(len(columns) == 1 for columns in called.values())
        if len(called) == len(AXES) and (is_once or not is_comment):
            return head
    return None


def _axes(cells: Sequence[str]) -> dict[str, list[int]]:
    """The places of the columns of each axis that some cells name."""
    found = {}
    for axis, names in AXES.items():
        called = [i for i, cell in enumerate(cells) if name_of(cell).plain in names]
        if called:
            found[axis] = called
    return found


def _degrees(cells: Sequence[str]) -> list[str]:
    """The cells that name angles on the Earth."""
    return [cell for cell in cells if name_of(cell).plain in DEGREES]


def _separator(line: str) -> str | None:
    """What stands between the cells of a line; None for blanks."""
    if ";" in line:
        return ";"
    cells = line.split(",")
    # numbers with blanks between them have decimal commas
    are_cells = all(len(c.split()) < 2 or not _are_numbers(c) for c in cells)
    if len(cells) > 2 and are_cells:
        return ","
    if line.count("\t") > 1 and all(map(str.strip, line.split("\t"))):
        return "\t"
    return None


def _cells(line: str) -> list[str]:
    """The cells of a line of a head, or of a point, by its own separator."""
    separator = _separator(line)
    if separator is None:
        # a unit in brackets belongs to the name before it
        line = re.sub(r"\s+(?=[(\[])", "_", line)
    return _split(line, separator)


def _split(line: str, separator: str | None) -> list[str]:
    """The cells of a line, without empty ones at its end."""
    bare = line.split("#", 1)[0].strip()
    if separator is None:
        return [cell.strip("\"'") for cell in bare.split()]
    cells = next(csv.reader([bare], delimiter=separator, skipinitialspace=True), [])
    while cells and not cells[-1].strip():
        cells.pop()
    return [cell.strip() for cell in cells]


def _begins(cell: str) -> bool:
    """Whether a cell begins as a number does."""
    return re.match(r"[+-]?\.?\d|nan\b|[+-]?inf\b", cell, re.IGNORECASE) is not None


def _is_number(cell: str) -> bool:
    """Whether a cell is a number, which may have a decimal comma."""
    try:
        number(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _are_numbers(text: str) -> bool:
    """Whether the words of a text are numbers."""
    return all(map(_is_number, text.split()))


def _check_order(points: FloatArray, layout: _Layout, where: str) -> None:
    """Refuse x and y that are likelier a northing and an easting.

    The names x and y are no answer: geodesists call the northing x.
    """
    x, y = points[:, 0], points[:, 1]
    names = {name_of(name).plain for name in layout.names}
    is_certain = bool(names & {*CERTAIN})
    is_turned = x.min() > NORTHINGS and EASTINGS < y.min() <= y.max() < NORTHINGS
    if is_turned and not is_certain:
        what = f"x is {x[0]:.9g} and y {y[0]:.9g}: northing before easting?"
        remedy = "name the columns in the first line: northing, easting, height"
        raise InputError(what, where, f"{remedy}; or easting, northing, height")


def _on_grid(points: FloatArray, lines: _Lines, layout: _Layout, name: str) -> Raster:
    """The raster of points that lie on a grid, NaN where there is none."""
    along_x, column = _grid_axis(points[:, 0], "x", lines, layout)
    along_y, row = _grid_axis(points[:, 1], "y", lines, layout)
    if len(along_x) * len(along_y) > MOST_NODES:
        what = f"{len(along_x)} x {len(along_y)} cells are more than {MOST_NODES}"
        raise InputError(what, lines.where, "put them on a grid of larger cells")
    _, first, counts = np.unique(
        row * len(along_x) + column, return_index=True, return_counts=True
    )
    if counts.max() > 1:
        twice = first[int(counts.argmax())]
        x, y = points[twice, :2]
        what = f"x = {x:.9g} m, y = {y:.9g} m has two heights"
        remedy = "leave one height for each place"
        raise lines.refusal(layout, int(twice), what, remedy)
    heights = np.full((len(along_y), len(along_x)), np.nan)
    heights[row, column] = points[:, 2]
    return Raster(name, along_x, along_y, heights)


def _grid_axis(
    values: FloatArray, axis: str, lines: _Lines, layout: _Layout
) -> tuple[FloatArray, IntArray]:
    """An axis of equal steps through some values, and the place of each on it.

    Values are rounded as the file writes them: the least step alone is not that of the
    grid.
    """
    found, of_value = np.unique(values, return_inverse=True)
    steps = np.diff(found)
    least = float(steps.min(initial=np.inf))
    places = np.concatenate([[0], np.cumsum(np.round(steps / least))]).astype(int)
    count = int(places[-1]) + 1
    step = float(np.ptp(found)) / max(count - 1, 1)
    even = np.linspace(found[0], found[-1], count) if count <= MOST_NODES else found
    off = np.abs(found - even[places]) if count <= MOST_NODES else steps
    worst = int(off.argmax())
    if count > MOST_NODES or off[worst] > OFF_GRID * step:
        what = f"{axis} = {found[worst]:.9g} m is on no grid of {step:.4g} m"
        remedy = "put the points on a grid of equal steps, with gdal_grid"
        point = int(np.argmax(of_value == worst))
        raise lines.refusal(layout, point, what, remedy)
    return even, places[of_value]
