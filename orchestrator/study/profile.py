"""Files that a study file names: measured bed lines, and sieve tables."""

import csv
import io
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.digits import on_grid, rounded
from orchestrator.errors import InputError
from orchestrator.runs.files import digest_file, digest_text
from orchestrator.study.heads import (
    ALONG,
    HEIGHT,
    UNITS,
    in_metres,
    is_passing,
    is_size,
    more_cells,
    name_of,
)
from orchestrator.study.noise import needed_smoothing
from orchestrator.study.shapes import SHAPES
from orchestrator.study.source import decoded, read_bytes
from orchestrator.study.units import number
from orchestrator.types import FloatArray

LARGEST, LARGEST_NUMBER = 20 * 2**20, 1e5  # bytes of a file, and largest number, m
LARGEST_X = 1e7
"""Largest x of a profile, m: eastings and northings of maps."""
ALSO = {"x_m": ALONG, "z_m": HEIGHT}
"""What surveyors call the columns of a profile, with or without the unit m."""
CLASSES = ("diameter_m", "fraction")
"""Columns of a sieve table of classes."""
PASSING = ("sieve_mm", "passing_percent")
"""Columns of a sieve table as laboratories write it."""
NO_PAN = "leave out the line of the pan, and end with the sieve that nothing passes"
SIEVE_REMEDY = (
    f"the first line must be {','.join(PASSING)} (what passes each sieve, mm) or "
    f"{','.join(CLASSES)} (in m), or names with another unit of length, as Sieve (um); "
    f"then numbers; {NO_PAN}"
)
MOST_CORNERS = (
    3000  # most corners of a bed line, each of which is a grid line of the flow's mesh
)
GAP, DENSE = 20.0, 20
"""A step along x this many times the middle one is a gap, in a profile of so many
points."""
STEEPEST_DEG = 60.0  # slope beyond which no mesh of vertical grid lines follows the bed
RESOLVED = 4  # corners of a smoothed line in its smoothing length
LOWEST = 1e-6  # least of the two lengths below, over that of the line
OVER = (
    0.5  # each of the two lengths whose means give the slope of a line, over its height
)

T = TypeVar("T")
WITH_X, AGAINST_X = "+x", "-x"
"""Where the flow goes in the file of a profile."""


@dataclass(frozen=True)
class Profile:
    """A bed line of n points that begins at the origin and goes on with the flow.

    Two profiles with one digest are one bed.

    Attributes
    ----------
    name
        The name of the file.
    x, z
        Places and heights of the points from the first one, m; x rises.
    text
        The file itself.
    digest
        Digest of the corners.
    needs
        Smoothing that the noise of the points needs, m.
    origin
        Place and height of the first point in the file, m. It is the first that the
        flow meets.
    towards
        Where the flow goes in the file: "+x" or "-x".
    """

    name: str = field(compare=False)  # the file's
    x: tuple[float, ...] = field(compare=False)  # m, from the first point; so is z
    z: tuple[float, ...] = field(compare=False)
    text: str = field(compare=False, repr=False)  # the file itself
    digest: str  # of the corners: two profiles with one digest are one bed
    needs: float = field(default=0.0, compare=False)  # smoothing for its noise, m
    origin: tuple[float, float] = field(default=(0.0, 0.0), compare=False)
    towards: str = field(default=WITH_X, compare=False)

    def __str__(self) -> str:
        return f"{self.name} ({self.digest[:12]})"

    @property
    def sign(self) -> int:
        """1 where the flow goes towards +x of the file, -1 towards -x."""
        return -1 if self.towards == AGAINST_X else 1

    def place(self, x: ArrayLike) -> FloatArray:
        """Find the places of the file.

        Parameters
        ----------
        x
            Distances along x from the first point, with the flow, m, of any shape.

        Returns
        -------
        ndarray
            x of the file, m, of the same shape.
        """
        return self.origin[0] + self.sign * np.asarray(x, float)

    def along(self, x: ArrayLike) -> FloatArray:
        """Find the distances of places of the file from the first point.

        Parameters
        ----------
        x
            x of the file, m, of any shape.

        Returns
        -------
        ndarray
            Distances along x, with the flow, to nine digits of the length, m.
        """
        away = self.sign * (np.asarray(x, float) - self.origin[0])
        return on_grid(away, self.x[-1])

    def smoothed(self, length: float) -> dict[str, Any]:
        """Make the fields of a bed with the points smoothed over another length.

        Parameters
        ----------
        length
            The length, m.

        Returns
        -------
        dict
            Values by the names of the fields.
        """
        return _fields(
            read_profile(self.text, self.name, self.name, length, self.towards)
        )


def steepest_deg(profile: Profile, height: float) -> float:
    """The steepest slope up which a bed line goes for as far as it is high.

    It is that of the line's means over two stretches of `OVER` heights, one behind the
    other. The noise of single points does not count in it, nor does a face shorter than
    the two.

    Parameters
    ----------
    profile
        The bed line, m.
    height
        From its lowest to its highest point, m.

    Returns
    -------
    float
        The slope, degrees; 0 of a line that rises nowhere.
    """
    x, z = np.array(profile.x), np.array(profile.z)
    # round-off says nothing of the slope of a line that is hardly high
    length = max(OVER * height, LOWEST * (x[-1] - x[0]))
    length = min(length, (x[-1] - x[0]) / 4)
    areas = np.concatenate([[0.0], np.cumsum((z[1:] + z[:-1]) / 2 * np.diff(x))])
    slopes = np.diff(z) / np.diff(x)

    def area(places: FloatArray) -> FloatArray:
        first = np.clip(
            np.searchsorted(x, places, side="right") - 1, 0, len(slopes) - 1
        )
        into = places - x[first]
        return np.asarray(areas[first] + into * (z[first] + slopes[first] * into / 2))

    steps = length * np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    middles = np.unique(x[:, None] + steps)
    middles = np.clip(middles, x[0] + length, x[-1] - length)
    ahead = area(middles + length) - area(middles)
    behind = area(middles) - area(middles - length)
    steepest = float(((ahead - behind) / length**2).max())
    return float(np.degrees(np.arctan(max(steepest, 0.0))))


def _fields(profile: Profile) -> dict[str, Any]:
    """The profile of a bed, and its height (m) and slope (degrees), which follow."""
    height = max(profile.z) - min(profile.z)
    slope = round(steepest_deg(profile, height), 2)
    return {"profile": profile, "height": height, "slope_deg": slope}


def _from_first_point(bed: Mapping[str, Any], profile: Profile) -> dict[str, Any]:
    """The places in the table of a bed, from the first point of its profile.

    Values of a wrong type are left to the validation of the scene.
    """
    moved: dict[str, Any] = {}
    counted = bed.get("counted")
    if isinstance(counted, list) and all(map(_is_number, counted)):
        moved["counted"] = profile.along(counted)[:: profile.sign].tolist()
    obstacles = bed.get("obstacles")
    if isinstance(obstacles, list):
        moved["obstacles"] = [_moved(one, profile) for one in obstacles]
    return moved


def _moved(obstacle: Any, profile: Profile) -> Any:
    """The table of an obstacle with its place from the first point of a profile."""
    if not isinstance(obstacle, dict) or not _is_number(obstacle.get("x")):
        return obstacle
    return obstacle | {"x": float(profile.along(obstacle["x"]))}


def _is_number(value: Any) -> bool:
    """Whether a value of a study file is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


@dataclass
class Files:
    """The files that a study names, each read once.

    Attributes
    ----------
    folder
        Folder of the study file; None for a study that is whole without its files, as a
        directory of results or a pack keeps it. Then no file is read.
    carried
        Texts that the study brings itself, in its table ``[profiles]``, by name.
    digests
        SHA-256 of each file that was asked for, by name; None of one that is carried.
    added
        TOML with the texts of the files that were read: with it the text of a study is
        whole without them.
    """

    folder: Path | None
    carried: dict[str, str] = field(default_factory=dict)
    digests: dict[str, str | None] = field(default_factory=dict)
    added: str = ""
    _read: dict[str, str] = field(default_factory=dict)
    _made: dict[str, Any] = field(default_factory=dict)

    def bed(self, bed: dict[str, Any], where: str, towards: str) -> dict[str, Any]:
        """Fields of a bed that names a profile.

        Parameters
        ----------
        bed
            The table of the bed; its `profile` is the name of a file. A range of
            `counted` and `obstacles` have x of that file.
        where
            The study file, for messages.
        towards
            Where the flow goes in the file, "+x" or "-x".

        Returns
        -------
        The profile, the height (m) and the slope (degrees) that follow from it, and the
        range and the obstacles with x from its first point.

        Raises
        ------
        InputError
            If the file is no bed line, or the table has a field that the profile
            replaces.
        """
        where, name = f"{where}: bed.profile", bed["profile"]
        of_shapes = (field for shape in SHAPES.values() for field in shape.fields)
        for given in bed.keys() & {"shape", "height", "slope_deg", *of_shapes}:
            raise InputError(f"it has its own {given}", where, f"leave out bed.{given}")
        smoothing = bed.get("smoothing", 0.0)
        if not isinstance(smoothing, int | float) or not 0 <= smoothing < 1e9:
            smoothing = 0.0  # the declaration of bed.smoothing refuses the value
        place = self._place(name, where)
        text = self._text(name, where)
        profile = read_profile(text, Path(name).name, place, smoothing, towards)
        return _fields(profile) | _from_first_point(bed, profile)

    def sieve(self, name: str, where: str) -> list[list[float]]:
        """Read a sieve table: classes, or the per cent that passes each sieve.

        Parameters
        ----------
        name
            The name of the file.
        where
            The study file, for messages.

        Returns
        -------
        list of list
            Rows of diameter, m, and fraction of the mass.

        Raises
        ------
        InputError
            If the file is no sieve table.
        """
        where = f"{where}: grain.sizes"
        place = self._place(name, where)
        text = self._text(name, where)
        head = next(csv.reader(text.splitlines()[:1]), [])
        cells = [cell.strip() for cell in head]
        sizes = [*filter(is_size, cells)]
        passing = [*filter(is_passing, cells)]
        if len(sizes) == len(passing) == 1:
            unit = UNITS[name_of(sizes[0]).unit] / UNITS["mm"]
            names = (sizes[0], passing[0])
            lines, rows = read_columns(text, names, place, SIEVE_REMEDY)
            in_mm = [[rounded(unit * size), part] for size, part in rows]
            return _classes(lines, in_mm, place)
        parts = [cell for cell in cells if cell.lower() == CLASSES[1]]
        names = CLASSES
        if len(sizes) == len(parts) == 1:
            names = (sizes[0], parts[0])
        lines, rows = read_columns(text, names, place, SIEVE_REMEDY)
        unit = UNITS[name_of(names[0]).unit]
        if unit != 1:
            rows = [[rounded(unit * size), part] for size, part in rows]
        _check_rows(lines, rows, place)
        return rows

    def once(self, name: str, where: str, read: Callable[[Path, str], T]) -> T:
        """Read a file that a study cannot carry.

        Parameters
        ----------
        name
            The name of the file.
        where
            The study file and the field that names it, for messages.
        read
            Reads the file at a path; its second argument is the place for messages.

        Returns
        -------
        object
            What is read.

        Raises
        ------
        InputError
            If the study is to be whole without its files.
        """
        place = self._place(name, where)
        if self.folder is None:
            what = "no study carries it in its table [profiles]"
            raise InputError(what, place, "read the study file itself")
        if name not in self._made:
            self._made[name] = read(self.folder / name, place)
            self.digests[name] = digest_file(self.folder / name)
        made: T = self._made[name]
        return made

    def _place(self, name: str, where: str) -> str:
        """The path of a file, for messages."""
        return f"{where}: {name if self.folder is None else self.folder / name}"

    def _text(self, name: str, where: str) -> str:
        """The text of a file by its name; `where` is the field that names it."""
        if name in self._read:
            return self._read[name]
        place = self._place(name, where)
        if name not in self.carried:
            self._read[name] = self._of_file(name, place)
            return self._read[name]
        if self.folder is not None and os.path.lexists(self.folder / name):
            what = "it is a file, and its text is in the table [profiles] too"
            raise InputError(what, place, "remove one of the two")
        self.digests[name] = None
        self._read[name] = self.carried[name]
        return self._read[name]

    def _of_file(self, name: str, where: str) -> str:
        if self.folder is None or self.carried:
            what = "its text is not in the table [profiles] of the study"
            raise InputError(what, where, "add it there, or remove the table")
        content = read_bytes(self.folder / name, LARGEST, where)
        text = decoded(content, where)
        self.digests[name] = sha256(content).hexdigest()
        # a JSON string is a TOML string, but for the mark of deletion
        string = json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
        if not self.added:
            self.added = "\n[profiles]\n"
        self.added += f"{json.dumps(name)} = {string}\n"
        return text


def _check_rows(lines: list[int], rows: list[list[float]], where: str) -> None:
    """Refuse a class that has no size, or a fraction below 0."""
    for line, (diameter, fraction) in zip(lines, rows, strict=True):
        place = f"{where}: line {line}"
        if not diameter > 0:
            what = f"{CLASSES[0]}: {diameter:g} is no size"
            raise InputError(what, place, "diameters are in m, above 0")
        if not fraction >= 0:
            what = f"{CLASSES[1]}: {fraction:g} is no part of the mass"
            raise InputError(what, place, "fractions are from 0 to 1")


def _classes(
    lines: list[int], rows: list[list[float]], where: str
) -> list[list[float]]:
    """The classes between sieves, of the per cent of the mass that passes each.

    A class has the geometric mean of its two sieves as diameter, m.
    """
    for line, (sieve, percent) in zip(lines, rows, strict=True):
        place = f"{where}: line {line}"
        if not sieve > 0:
            what = f"{PASSING[0]}: {sieve:g} is no sieve"
            raise InputError(what, place, f"openings are in mm, above 0; {NO_PAN}")
        if not 0 <= percent <= 100:
            what = f"{PASSING[1]}: {percent:g} is no part of the mass"
            raise InputError(what, place, "per cent that pass are from 0 to 100")
    if len(rows) < 2:
        remedy = "begin with the sieve that all pass, end with one that nothing passes"
        raise InputError("one class lies between two sieves", where, remedy)
    ordered = sorted(zip(rows, lines, strict=True))
    (_, none), line = ordered[0]
    if none != 0:
        what = f"{none:g} % pass the smallest sieve, not 0"
        remedy = f"add a finer one that nothing passes, if only by its size; {NO_PAN}"
        raise InputError(what, f"{where}: line {line}", remedy)
    (_, whole), line = ordered[-1]
    if whole != 100:
        what = f"{whole:g} % pass the largest sieve, not 100"
        remedy = "begin with the sieve that all pass"
        raise InputError(what, f"{where}: line {line}", remedy)
    classes = []
    for ((smaller, below), _), ((larger, above), line) in pairwise(ordered):
        if above < below or larger == smaller:
            what = f"{above:g} % pass {larger:g} mm, and {below:g} % {smaller:g} mm"
            place = f"{where}: line {line}"
            raise InputError(what, place, "a larger sieve lets more pass")
        if above > below:
            diameter = 1e-3 * math.sqrt(smaller * larger)
            classes.append([rounded(diameter), rounded((above - below) / 100)])
    return classes


def read_columns(
    text: str, names: tuple[str, str], where: str, remedy: str = ""
) -> tuple[list[int], list[list[float]]]:
    """Two columns of a CSV file with a header.

    Blank lines and other columns are left out.

    Parameters
    ----------
    text
        The file.
    names
        The names of the columns; those of a profile may have others, see `ALSO`.
    where
        The file, for messages.
    remedy
        What the first line must be, in words; by default the two names.

    Returns
    -------
    The number of each line, and its two values.

    Raises
    ------
    InputError
        With the line and the remedy.
    """
    reader = csv.DictReader(io.StringIO(text))
    lines, values = [], []
    try:
        reader.fieldnames = [cell.strip() for cell in reader.fieldnames or ()]
        columns = [_column(reader.fieldnames, name, names) for name in names]
        for row in reader:
            pair = [_cell(row, column) for column in columns]
            if None in row:
                cells = len(reader.fieldnames) + len(row[None])
                raise ValueError(more_cells(cells, len(reader.fieldnames)))
            lines.append(reader.line_num)
            values.append(pair)
    except (ValueError, csv.Error) as error:
        remedy = (
            remedy or f"the first line must be {','.join(names)}, then numbers in m"
        )
        place = f"{where}: line {reader.line_num or 1}"
        raise InputError(str(error), place, remedy) from None
    return lines, values


def _column(header: Sequence[str], name: str, names: tuple[str, str]) -> str:
    """What a header calls a column, by its own name or by one of `ALSO`.

    It is a ValueError unless just one column is meant.
    """
    if header.count(name) == 1:
        return name
    meant = [cell for cell in header if _is_called(cell, ALSO.get(name, ()))]
    if name not in header and len(meant) == 1:
        return meant[0]
    if name not in header and len(meant) > 1:
        listed = " or ".join(meant)
        raise ValueError(f"which column is {name}: {listed}? Name that one {name}")
    what = f"not one column {names[0]} and one {names[1]} in {','.join(header)!r}"
    if len(header) == 1 and ";" in header[0]:
        what = f"{what}: commas between the cells, no semicolons"
    in_another_unit = in_metres(header)
    if in_another_unit and names[0] in ALSO:
        what = f"{what}: {in_another_unit}"
    raise ValueError(what)


def _is_called(cell: str, names: Sequence[str]) -> bool:
    """Whether a column has one of some names, and no other unit than m."""
    name = name_of(cell)
    return name.plain in names and name.is_in_metres


def _cell(row: Mapping[str | None, Any], name: str) -> float:
    """The number in a cell; a ValueError for any other text."""
    largest = LARGEST_NUMBER
    if name == "x_m" or _is_called(name, ALSO["x_m"]):
        largest = LARGEST_X
    text = row[name]
    if text is None or not text.strip():
        raise ValueError(f"the cell of {name} is empty")
    try:
        value = number(text)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if not abs(value) <= largest:
        raise ValueError(f"{name}: {text.strip()} is not a number up to {largest:g}")
    return value


@dataclass(frozen=True)
class _Refusal:
    """How the file of a profile is refused: its place, and the line of each point.

    Without lines the file is refused as a whole: points of a smoothed line are not in
    it.
    """

    where: str
    lines: Sequence[int]

    def at(self, point: int, what: str, remedy: str) -> InputError:
        """The refusal of a point."""
        if not self.lines:
            return self.whole(what, remedy)
        return InputError(what, f"{self.where}: line {self.lines[point]}", remedy)

    def whole(self, what: str, remedy: str) -> InputError:
        """The refusal of the whole line."""
        return InputError(what, self.where, remedy)


@cache
def read_profile(
    text: str, name: str, where: str, smoothing: float, towards: str = WITH_X
) -> Profile:
    """Read a profile and smooth it.

    Parameters
    ----------
    text
        CSV with the columns ``x_m`` and ``z_m``.
    name
        The name of the file.
    where
        The file, for messages.
    smoothing
        Twice the standard deviation of the Gaussian weights of a mean along x, m; 0
        for none.
    towards
        Where the flow goes in the file, "+x" or "-x".

    Returns
    -------
    Profile
        The bed line, its points in the order in which the flow meets them.

    Raises
    ------
    InputError
        With the line and the remedy.
    """
    lines, points = read_columns(text, ("x_m", "z_m"), where)
    refusal = _Refusal(where, () if smoothing else lines)
    if len(points) < 3:
        raise refusal.whole(f"{len(points)} points make no bed", "write 3 at least")
    x, z = np.array(points).T
    _check_steps(x, refusal)
    sign = 1
    if towards == AGAINST_X:
        # turned before all else, so that a bed is what its mirror image is in the
        # opposite flow
        sign = -1
        x, z = -x[::-1], z[::-1]
        refusal = _Refusal(refusal.where, refusal.lines[::-1])
    origin = (float(sign * x[0]) + 0.0, float(z[0]))
    # to nine digits of the length: means are known no better, and the name of a bed is
    # its corners; before means are taken, which a last digit would change
    length = np.ptp(x)
    x = on_grid(x - x[0], length)
    needs = needed_smoothing(x, z)
    more = "give bed.smoothing, a length in m"
    if smoothing:
        more = "raise bed.smoothing"
    elif needs:
        more = f"give bed.smoothing = {needs:g} m"
    corners = _count_of_corners(x, smoothing, more, refusal)
    if smoothing:
        x, z = _smoothed(x, z, smoothing, max(corners, DENSE))
    _check_heights(x, z, more, refusal, origin[0] + sign * x)
    xs = tuple(on_grid(x, length).tolist())
    zs = tuple(on_grid(z - z[0], length).tolist())
    lines_of_corners = [f"{a!r},{b!r}" for a, b in zip(xs, zs, strict=True)]
    digest = digest_text("\n".join(lines_of_corners))
    return Profile(name, xs, zs, text, digest, needs, origin, towards)


def _check_steps(x: FloatArray, refusal: _Refusal) -> None:
    """Refuse points that do not follow each other along x, and a gap between them."""
    steps = np.diff(x)
    back = int(np.argmin(steps > 0))
    if steps[back] <= 0:
        place = f"{x[back + 1]:.9g} m"
        what = f"x does not rise to {place}: unsorted, twice the same, or an overhang"
        remedy = "sort the lines by x, with one height for each place"
        raise refusal.at(back + 1, what, remedy)
    widest = int(np.argmax(steps))
    middle = float(np.median(steps))
    if len(x) >= DENSE and steps[widest] > GAP * middle:
        gap = f"a gap of {steps[widest]:g} m after x = {x[widest]:.9g} m"
        what = f"{gap}; others are {middle:g} m"
        raise refusal.at(widest + 1, what, "fill it with points")


def _count_of_corners(
    x: FloatArray, smoothing: float, more: str, refusal: _Refusal
) -> int:
    """The number of corners of a line; `more` is the remedy if these are too many."""
    length = float(np.ptp(x))
    count = float(len(x))
    if smoothing:
        count = length / smoothing * RESOLVED
    if smoothing > length / 4:
        what = f"smoothing over {smoothing:g} m leaves nothing of {length:g} m"
        raise refusal.whole(what, "lower bed.smoothing")
    if count > MOST_CORNERS:
        what = f"{count:.0f} points, more than the {MOST_CORNERS} that a mesh has"
        raise refusal.whole(what, more)
    return int(np.ceil(count))


def _check_heights(
    x: FloatArray, z: FloatArray, more: str, refusal: _Refusal, places: FloatArray
) -> None:
    """Refuse a line that is level or too steep; `more` is the remedy against noise.

    The file has its points at other `places`.
    """
    if np.ptp(z) == 0:
        what = "level: it has no height to measure by"
        raise refusal.whole(what, 'ask for shape = "flat" with a height')
    slopes = np.degrees(np.arctan2(np.diff(z), np.diff(x)))
    steep = int(np.argmax(np.abs(slopes)))
    if abs(slopes[steep]) > STEEPEST_DEG:
        slope = f"{slopes[steep]:.0f} deg at x = {places[steep]:.9g} m"
        what = f"{slope}, above {STEEPEST_DEG:g}"
        remedy = f"{more}; check that x and z are both in m"
        raise refusal.at(steep + 1, what, remedy)


def _turned_about_ends(values: FloatArray) -> FloatArray:
    """Coordinates that go on beyond both ends of a line, turned about these."""
    before = 2 * values[0] - values[:0:-1]
    behind = 2 * values[-1] - values[-2::-1]
    return np.concatenate([before, values, behind])


def _smoothed(
    x: FloatArray, z: FloatArray, length: float, count: int
) -> tuple[FloatArray, FloatArray]:
    """Weighted means at the ends of `count` equal steps."""
    # beyond its ends the line goes on as turned about them: they stay where they are
    around = _turned_about_ends(x)
    heights = _turned_about_ends(z)
    # each point stands for the bed half-way to its neighbours
    share = np.gradient(around)
    places = np.linspace(x[0], x[-1], count + 1)
    first, last = np.searchsorted(around, [places - 2 * length, places + 2 * length])
    means = np.interp(places, x, z)
    for i, (low, high) in enumerate(zip(first, last, strict=True)):
        weight = share[low:high] * np.exp(
            -2 * ((around[low:high] - places[i]) / length) ** 2
        )
        if high > low:
            means[i] = weight @ heights[low:high] / weight.sum()
    return places, means
