"""Files that a study file names: measured bed lines, and sieve tables."""

import csv
import io
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.digits import on_grid
from orchestrator.errors import InputError
from orchestrator.runs.files import digest_text, opened
from orchestrator.study.noise import needed_smoothing
from orchestrator.study.shapes import SHAPES
from orchestrator.study.units import number
from orchestrator.types import FloatArray

LARGEST, LARGEST_NUMBER = 20 * 2**20, 1e5  # bytes of a file, and largest coordinate, m
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


@dataclass(frozen=True)
class Profile:
    """A bed line of n points that begins at the origin.

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
    """

    name: str = field(compare=False)  # the file's
    x: tuple[float, ...] = field(compare=False)  # m, from the first point; so is z
    z: tuple[float, ...] = field(compare=False)
    text: str = field(compare=False, repr=False)  # the file itself
    digest: str  # of the corners: two profiles with one digest are one bed
    needs: float = field(default=0.0, compare=False)  # smoothing for its noise, m

    def __str__(self) -> str:
        return f"{self.name} ({self.digest[:12]})"

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
        return _fields(read_profile(self.text, self.name, self.name, length))


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


@dataclass
class Files:
    """The files that a study names: profiles and sieve tables.

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

    def bed(self, bed: dict[str, Any], where: str) -> dict[str, Any]:
        """Fields of a bed that names a profile.

        Parameters
        ----------
        bed
            The table of the bed; its `profile` is the name of a file.
        where
            The study file, for messages.

        Returns
        -------
        The profile, and the height (m) and the slope (degrees) that follow from it.

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
        profile = read_profile(text, Path(name).name, place, smoothing)
        return _fields(profile)

    def sieve(self, name: str, where: str) -> list[list[float]]:
        """Read a sieve table.

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
        """
        where = f"{where}: grain.sizes"
        place = self._place(name, where)
        text = self._text(name, where)
        return read_columns(text, ("diameter_m", "fraction"), place)[1]

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


def read_bytes(path: Path, largest: int, where: str) -> bytes:
    """Read a file of the user.

    Parameters
    ----------
    path
        The file.
    largest
        Largest size, bytes.
    where
        Its name in messages.

    Returns
    -------
    bytes
        The content.

    Raises
    ------
    InputError
        For a file that is missing, no regular one, or larger.
    """
    try:
        with opened(path) as stream:
            content = stream.read(largest + 1) or b""  # None of a file that would wait
    except (OSError, ValueError) as error:
        raise _unreadable(error, where) from None
    if len(content) > largest:
        raise _unreadable(ValueError(f"larger than {largest // 2**20} MiB"), where)
    return content


def decoded(content: bytes, where: str) -> str:
    """Decode a file of the user.

    Parameters
    ----------
    content
        The content, text in UTF-8.
    where
        Its name in messages.

    Returns
    -------
    str
        The text.

    Raises
    ------
    InputError
        For any other content.
    """
    try:
        # some editors begin with a mark of the encoding
        text = content.decode("utf-8-sig")
    except ValueError as error:
        raise _unreadable(error, where) from None
    if "\0" in text:
        raise _unreadable(ValueError("binary, not text"), where)
    return text


def _unreadable(error: Exception, where: str) -> InputError:
    why = getattr(error, "strerror", None) or error
    remedy = "it is a text in UTF-8; a path in a study file is relative to that file"
    return InputError(f"not a readable text file: {why}", where, remedy)


def read_columns(
    text: str, names: tuple[str, str], where: str
) -> tuple[list[int], list[list[float]]]:
    """Two columns of a CSV file with a header.

    Blank lines and other columns are left out.

    Parameters
    ----------
    text
        The file.
    names
        The names of the columns, in metres or without a unit.
    where
        The file, for messages.

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
        reader.fieldnames = _header(reader.fieldnames or (), names)
        for row in reader:
            pair = [_cell(row, name) for name in names]
            if None in row:
                count = len(reader.fieldnames)
                more = len(row[None])
                what = f"{count + more} cells, the header has {count}"
                raise ValueError(f"{what}: a decimal comma? Write a decimal point")
            lines.append(reader.line_num)
            values.append(pair)
    except (ValueError, csv.Error) as error:
        remedy = f"the first line must be {','.join(names)}, then numbers"
        if names[0].endswith("_m"):
            remedy = f"{remedy} in m"
        place = f"{where}: line {reader.line_num or 1}"
        raise InputError(str(error), place, remedy) from None
    return lines, values


def _header(cells: Sequence[str], names: tuple[str, str]) -> list[str]:
    """The names of the columns in the header.

    It is a ValueError unless each is there once.
    """
    header = [cell.strip() for cell in cells]
    if all(header.count(name) == 1 for name in names):
        return header
    what = f"not one column {names[0]} and one {names[1]} in {','.join(header)!r}"
    if len(header) == 1 and ";" in header[0]:
        what = f"{what}: commas between the cells, no semicolons"
    raise ValueError(what)


def _cell(row: Mapping[str | None, Any], name: str) -> float:
    """The number in a cell; a ValueError for any other text."""
    text = row[name]
    if text is None or not text.strip():
        raise ValueError(f"the cell of {name} is empty")
    try:
        value = number(text)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if not abs(value) <= LARGEST_NUMBER:
        raise ValueError(
            f"{name}: {text.strip()} is not a number up to {LARGEST_NUMBER:g}"
        )
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
def read_profile(text: str, name: str, where: str, smoothing: float) -> Profile:
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
    needs = needed_smoothing(x, z)
    more = "give bed.smoothing, a length in m"
    if smoothing:
        more = "raise bed.smoothing"
    elif needs:
        more = f"give bed.smoothing = {needs:g} m"
    corners = _count_of_corners(x, smoothing, more, refusal)
    if smoothing:
        x, z = _smoothed(x, z, smoothing, max(corners, DENSE))
    _check_heights(x, z, more, refusal)
    # to nine digits of the length: means are known no better, and the name of a bed is
    # its corners
    length = np.ptp(x)
    xs = tuple(on_grid(x - x[0], length).tolist())
    zs = tuple(on_grid(z - z[0], length).tolist())
    lines_of_corners = [f"{a!r},{b!r}" for a, b in zip(xs, zs, strict=True)]
    digest = digest_text("\n".join(lines_of_corners))
    return Profile(name, xs, zs, text, digest, needs)


def _check_steps(x: FloatArray, refusal: _Refusal) -> None:
    """Refuse points that do not follow each other along x, and a gap between them."""
    steps = np.diff(x)
    back = int(np.argmin(steps > 0))
    if steps[back] <= 0:
        place = f"{x[back + 1]:g} m"
        what = f"x does not rise to {place}: unsorted, twice the same, or an overhang"
        remedy = "sort the lines by x, with one height for each place"
        raise refusal.at(back + 1, what, remedy)
    widest = int(np.argmax(steps))
    middle = float(np.median(steps))
    if len(x) >= DENSE and steps[widest] > GAP * middle:
        gap = f"a gap of {steps[widest]:g} m after x = {x[widest]:g} m"
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


def _check_heights(x: FloatArray, z: FloatArray, more: str, refusal: _Refusal) -> None:
    """Refuse a line that is level or too steep; `more` is the remedy against noise."""
    if np.ptp(z) == 0:
        what = "level: it has no height to measure by"
        raise refusal.whole(what, 'ask for shape = "flat" with a height')
    slopes = np.degrees(np.arctan2(np.diff(z), np.diff(x)))
    steep = int(np.argmax(np.abs(slopes)))
    if abs(slopes[steep]) > STEEPEST_DEG:
        slope = f"{slopes[steep]:.0f} deg at x = {x[steep]:g} m"
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
