"""A bed line that a user has measured: a file with the columns x_m and z_m, read and smoothed."""

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orchestrator.errors import InputError
from orchestrator.runs.files import digest_text

FloatArray = NDArray[np.float64]

COLUMNS = ("x_m", "z_m")
LARGEST = 20_000_000
"""Bytes of a file."""
LARGEST_NUMBER = 1e5
"""Largest coordinate, m."""
FEWEST = 3
"""Points."""
MOST_CORNERS = 3000
"""Most corners of a bed line, each of which is a grid line of the flow's mesh."""
GAP = 20.0
"""A step along x this many times the middle one is a gap, in a profile of `MANY` points."""
MANY = 20
STEEPEST_DEG = 60.0
"""Slope beyond which no mesh of vertical grid lines follows the bed."""
RESOLVED = 4
"""Corners of a smoothed line in its smoothing length."""


@dataclass(frozen=True)
class Profile:
    """A bed line of n points, x rising, that begins at the origin.

    Attributes
    ----------
    name : str
        The file's name.
    x, z : tuple of float
        m, from the first point.
    text : str
        The file itself.
    digest : str
        Digest of the content: all that two profiles differ in.
    lines : tuple of int
        Number of the file's line that has each point; empty for a smoothed line.
    """

    name: str = field(compare=False)
    x: tuple[float, ...]
    z: tuple[float, ...]
    text: str = field(compare=False, repr=False)
    digest: str
    lines: tuple[int, ...] = field(default=(), compare=False, repr=False)

    def __hash__(self) -> int:
        return hash(self.digest)

    def __str__(self) -> str:
        return f"{self.name} ({self.digest[:12]})"

    @property
    def height(self) -> float:
        """From its lowest to its highest point, m."""
        return max(self.z) - min(self.z)

    @property
    def steepest_deg(self) -> float:
        """Slope where it rises most, degrees; 0 where it never does."""
        return max(float(np.degrees(np.arctan(np.diff(self.z) / np.diff(self.x))).max()), 0.0)


@cache
def read(text: str, name: str, where: str, smoothing: float) -> Profile:
    """Read a profile and smooth it.

    Parameters
    ----------
    text : str
        A header and the columns ``x_m`` and ``z_m``; others are left out.
    name, where : str
        What the study file calls it, and its place in messages.
    smoothing : float
        Twice the standard deviation of the Gaussian weights of a mean along x, m; 0 for none.

    Raises
    ------
    InputError
        Naming the file, the line and the remedy.
    """
    if not text.strip():
        raise InputError("the profile is empty", where=where, remedy="write x_m,z_m and points")
    points = list(_points(text, where))
    if len(points) < FEWEST:
        what = f"{len(points)} points make no bed"
        raise InputError(what, where=where, remedy=f"write {FEWEST} at least")
    lines, x, z = (np.array(column) for column in zip(*points, strict=True))
    _check(lines, x, where)
    if smoothing:
        x, z = _smoothed(x, z, smoothing, where)
    _check_line(x, z, None if smoothing else lines, where)
    xs, zs = (tuple((values - values[0]).tolist()) for values in (x, z))
    corners = "\n".join(f"{a!r},{b!r}" for a, b in zip(xs, zs, strict=True))
    numbers = () if smoothing else tuple(lines.tolist())
    return Profile(name, xs, zs, text, digest_text(corners), numbers)


def a_profile(value: object) -> Profile:
    """The value itself, which must be one that has been read."""
    if not isinstance(value, Profile):
        raise ValueError("it should be the name of a file")
    return value


def text_of(path: Path) -> str:
    """The text of a profile's file.

    Raises
    ------
    InputError
        If it is none.
    """
    where, remedy = str(path), "save it as CSV in UTF-8"
    if not os.path.exists(path):
        remedy = "a path is relative to the study file"
        raise InputError("there is no such profile", where=where, remedy=remedy)
    try:
        if path.is_dir():
            raise InputError("a directory, not a profile", where=where, remedy="name the file")
        if not path.is_file():
            raise InputError("not a regular file", where=where, remedy="copy it to one")
        if path.stat().st_size > LARGEST:
            remedy = "leave out points: a bed line needs some in a grain's diameter at most"
            raise InputError(f"larger than {LARGEST // 10**6} MB", where=where, remedy=remedy)
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        raise InputError(f"not a readable text file: {error}", where=where, remedy=remedy) from None
    if "\0" in text:
        raise InputError("binary, not text", where=where, remedy=remedy)
    return text


def _points(text: str, where: str) -> Iterator[tuple[int, float, float]]:
    """Number of the line, x and z of each point."""
    lines = text.replace("\r\n", "\n").split("\n")
    places = _places(lines[0], where)
    for number, line in enumerate(lines[1:], 2):
        if not line.strip():
            if any(later.strip() for later in lines[number:]):
                raise _wrong(where, number, "a blank line", "close the gap, or remove the line")
            return
        cells = line.split(",")
        if len(cells) <= max(places):
            remedy = "write x and z, a comma between them"
            raise _wrong(where, number, f"{len(cells)} values, less than the header names", remedy)
        if len(cells) > len(lines[0].split(",")):
            remedy = "write numbers with a decimal point and commas between them"
            raise _wrong(where, number, f"{len(cells)} values, more than the header names", remedy)
        x, z = (_number(cells[place], where, number) for place in places)
        yield number, x, z


def _places(header: str, where: str) -> tuple[int, int]:
    names = [name.strip().strip('"') for name in header.split(",")]
    for name in COLUMNS:
        if names.count(name) > 1:
            raise _wrong(where, 1, f"two columns {name}", "name one of them otherwise")
        if name not in names:
            other = name.replace("_m", "_mm")
            remedy = "the first line shall be x_m,z_m: metres, commas between columns"
            if other in names:
                remedy = f"divide {other} by 1000 and name it {name}"
            raise _wrong(where, 1, f"no column {name} in {header[:60]!r}", remedy)
    return names.index("x_m"), names.index("z_m")


def _number(cell: str, where: str, line: int) -> float:
    if not cell.strip():
        raise _wrong(where, line, "an empty value", "close the gap, or cut the file there")
    try:
        # float also takes underscores and the digits of other alphabets
        value = float(cell) if cell.isascii() and "_" not in cell else float("none")
    except ValueError:
        remedy = "write it with a decimal point, in metres"
        raise _wrong(where, line, f"{cell[:30]!r} is not a number", remedy) from None
    if not math.isfinite(value):
        raise _wrong(
            where, line, f"{cell.strip()} is not a place", "close the gap, or cut the file there"
        )
    if abs(value) > LARGEST_NUMBER:
        raise _wrong(where, line, f"{value:g} m is no place on a bed", "write metres")
    return value


def _check(lines: NDArray[np.int64], x: FloatArray, where: str) -> None:
    """See that x rises without gaps from each point to the next."""
    steps = np.diff(x)
    if (steps < 0).all():
        remedy = "turn the lines round"
        raise _wrong(where, int(lines[1]), "x falls: the profile runs upstream", remedy)
    if (steps <= 0).any():
        place = int(np.argmax(steps <= 0)) + 1
        what = f"x goes back to {x[place]:g} m: unsorted, or an overhang"
        remedy = "sort the lines by x; cut an overhang to one height for each place"
        if steps[place - 1] == 0:
            what, remedy = f"x = {x[place]:g} m again", "a place has one height: keep one line"
        raise _wrong(where, int(lines[place]), what, remedy)
    widest, middle = int(np.argmax(steps)), float(np.median(steps))
    if len(x) >= MANY and steps[widest] > GAP * middle:
        what = f"a gap of {steps[widest]:g} m after x = {x[widest]:g} m; others are {middle:g} m"
        raise _wrong(where, int(lines[widest + 1]), what, "fill it with points")


def _smoothed(
    x: FloatArray, z: FloatArray, length: float, where: str
) -> tuple[FloatArray, FloatArray]:
    """Weighted means at places a part of the length apart."""
    if length > np.ptp(x) / 4:
        raise InputError(
            f"smoothing over {length:g} m leaves nothing of {np.ptp(x):g} m",
            where=where,
            remedy="lower bed.smoothing",
        )
    if np.ptp(x) * RESOLVED > length * MOST_CORNERS:
        raise InputError(
            f"smoothing over {length:g} m of {np.ptp(x):g} m leaves over {MOST_CORNERS} points",
            where=where,
            remedy="raise bed.smoothing",
        )
    count = max(int(np.ceil(np.ptp(x) / length * RESOLVED)), MANY)
    # beyond its ends the line goes on as turned about them: they stay where they are
    around = np.concatenate([2 * x[0] - x[:0:-1], x, 2 * x[-1] - x[-2::-1]])
    heights = np.concatenate([2 * z[0] - z[:0:-1], z, 2 * z[-1] - z[-2::-1]])
    # each point stands for the bed half-way to its neighbours
    share = np.gradient(around)
    places = np.linspace(x[0], x[-1], count + 1)
    first, last = np.searchsorted(around, [places - 2 * length, places + 2 * length])
    found = np.interp(places, x, z)
    for i, (low, high) in enumerate(zip(first, last, strict=True)):
        weight = share[low:high] * np.exp(-2 * ((around[low:high] - places[i]) / length) ** 2)
        if high > low:
            found[i] = weight @ heights[low:high] / weight.sum()
    return places, found


def _check_line(x: FloatArray, z: FloatArray, lines: NDArray[np.int64] | None, where: str) -> None:
    """See that a mesh can follow the line; `lines` of a smoothed one are not known."""
    more = "raise bed.smoothing" if lines is None else "give bed.smoothing, a length in m"
    if len(x) > MOST_CORNERS:
        what = f"{len(x)} points, more than the {MOST_CORNERS} that a mesh has"
        raise InputError(what, where=where, remedy=more)
    if np.ptp(z) == 0:
        remedy = 'ask for shape = "flat" with a height'
        raise InputError("level: it has no height to measure by", where=where, remedy=remedy)
    slopes = np.degrees(np.arctan2(np.diff(z), np.diff(x)))
    steep = int(np.argmax(np.abs(slopes)))
    if abs(slopes[steep]) > STEEPEST_DEG:
        line = "" if lines is None else f": line {lines[steep + 1]}"
        what = f"{slopes[steep]:.0f} deg at x = {x[steep]:g} m, above {STEEPEST_DEG:g}"
        remedy = f"{more}; check that x and z are both in m"
        raise InputError(what, where=f"{where}{line}", remedy=remedy)


def _wrong(where: str, line: int, what: str, remedy: str) -> InputError:
    return InputError(what, where=f"{where}: line {line}", remedy=remedy)
