"""Files that a study file names: measured bed lines, and sieve tables."""

import csv
import io
import json
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.errors import InputError
from orchestrator.runs.files import digest_text, opened
from orchestrator.study.shapes import SHAPES
from orchestrator.types import FloatArray

LARGEST, LARGEST_NUMBER = 20 * 2**20, 1e5  # bytes of a file, and largest coordinate, m
MOST_CORNERS = 3000  # most corners of a bed line, each of which is a grid line of the flow's mesh
GAP, DENSE = 20.0, 20
"""A step along x this many times the middle one is a gap, in a profile of so many points."""
STEEPEST_DEG = 60.0  # slope beyond which no mesh of vertical grid lines follows the bed
RESOLVED = 4  # corners of a smoothed line in its smoothing length


@dataclass(frozen=True)
class Profile:
    """A bed line of n points, x rising, that begins at the origin."""

    name: str = field(compare=False)  # the file's
    x: tuple[float, ...] = field(compare=False)  # m, from the first point; so is z
    z: tuple[float, ...] = field(compare=False)
    text: str = field(compare=False, repr=False)  # the file itself
    digest: str  # of the corners: two profiles with one digest are one bed

    def __str__(self) -> str:
        return f"{self.name} ({self.digest[:12]})"


@dataclass
class Files:
    """The profiles and sieve tables of a study; a bad one is refused with an `InputError`."""

    folder: Path  # of the study file
    texts: dict[str, str]  # of each file by its name, at first the study's own table `profiles`
    added: str = ""  # TOML with the texts of files: with it a study's text is whole without them

    def bed(self, bed: dict[str, Any], where: str) -> dict[str, Any]:
        """Fields of a bed that names a profile; `where` names the study file in messages."""
        where, name = f"{where}: bed.profile", bed["profile"]
        replaced = ("shape", "height", "slope_deg", *(f for s in SHAPES.values() for f in s.fields))
        for given in bed.keys() & replaced:
            raise InputError(f"it has its own {given}", where, f"leave out bed.{given}")
        smoothing = bed.get("smoothing", 0.0)
        if not isinstance(smoothing, int | float) or not 0 <= smoothing < 1e9:
            smoothing = 0.0  # the declaration of bed.smoothing refuses the value
        place = f"{where}: {self.folder / name}"
        profile = read_profile(self._text(name, place), Path(name).name, place, smoothing)
        steepest = np.degrees(np.arctan(np.diff(profile.z) / np.diff(profile.x))).max()
        height, slope = max(profile.z) - min(profile.z), round(max(float(steepest), 0.0), 2)
        return {"profile": profile, "height": height, "slope_deg": slope}

    def sieve(self, name: str, where: str) -> list[list[float]]:
        """The rows of a sieve table, diameter (m) and fraction."""
        place = f"{where}: grain.sizes: {self.folder / name}"
        return read_columns(self._text(name, place), ("diameter_m", "fraction"), place)[1]

    def _text(self, name: str, where: str) -> str:
        if name not in self.texts:
            self.texts[name] = read_text(self.folder / name, LARGEST, where)
            head = "" if self.added else "\n[profiles]\n"
            # a JSON string is a TOML string, but for the mark of deletion
            text = json.dumps(self.texts[name], ensure_ascii=False).replace("\x7f", "\\u007f")
            self.added += f"{head}{json.dumps(name)} = {text}\n"
        return self.texts[name]


def read_text(path: Path, largest: int, where: str) -> str:
    """The text of a file of the user; `where` names it in messages.

    An `InputError` refuses one that is missing, no regular file, larger than so many bytes, or no
    text in UTF-8.
    """
    try:
        with opened(path) as stream:
            content = stream.read(largest + 1) or b""  # nothing of a file that would wait
        if len(content) > largest:
            raise ValueError(f"larger than {largest // 2**20} MiB")
        text = content.decode("utf-8-sig")  # some editors begin with a mark of the encoding
        if "\0" in text:
            raise ValueError("binary, not text")
    except (OSError, ValueError) as error:
        what = f"not a readable text file: {getattr(error, 'strerror', None) or error}"
        remedy = "it is a text in UTF-8; a path in a study file is relative to that file"
        raise InputError(what, where, remedy) from None
    return text


def read_columns(
    text: str, names: tuple[str, str], where: str
) -> tuple[list[int], list[list[float]]]:
    """Two columns of a CSV file with a header; blank lines and other columns are left out.

    Returned are the number of each line and its two values. An `InputError` names the line.
    """
    reader = csv.DictReader(io.StringIO(text))
    lines, values = [], []
    try:
        header = reader.fieldnames = [name.strip() for name in reader.fieldnames or ()]
        if any(header.count(name) != 1 for name in names):
            raise ValueError(f"not one column {names[0]} and one {names[1]}")
        for row in reader:
            pair = [float(row[name] or "") for name in names]
            is_number = all(abs(value) <= LARGEST_NUMBER for value in pair)
            if None in row or None in row.values() or not is_number:
                raise ValueError(f"not a number up to {LARGEST_NUMBER:g} for each column")
            lines.append(reader.line_num)
            values.append(pair)
    except (ValueError, csv.Error) as error:
        remedy = f"the first line is {','.join(names)}: metres, decimal points, commas between"
        raise InputError(str(error), f"{where}: line {reader.line_num or 1}", remedy) from None
    return lines, values


@cache
def read_profile(text: str, name: str, where: str, smoothing: float) -> Profile:
    """Read a profile and smooth it.

    The text is CSV with the columns ``x_m`` and ``z_m``; `where` names it in messages. `smoothing`
    is twice the standard deviation of the Gaussian weights of a mean along x, m; 0 for none. An
    `InputError` names the line and the remedy.
    """
    lines, points = read_columns(text, ("x_m", "z_m"), where)
    x, z = np.array(points).reshape(-1, 2).T

    def refuse(what: str, remedy: str, point: int | None = None) -> None:
        place = where if point is None or smoothing else f"{where}: line {lines[point]}"
        raise InputError(what, place, remedy)

    if len(x) < 3:
        refuse(f"{len(x)} points make no bed", "write 3 at least")
    steps, length = np.diff(x), float(np.ptp(x))
    back, widest, middle = int(np.argmin(steps > 0)), int(np.argmax(steps)), float(np.median(steps))
    if steps[back] <= 0:
        what = f"x does not rise to {x[back + 1]:g} m: unsorted, twice the same, or an overhang"
        refuse(what, "sort the lines by x, with one height for each place", back + 1)
    if len(x) >= DENSE and steps[widest] > GAP * middle:
        what = f"a gap of {steps[widest]:g} m after x = {x[widest]:g} m; others are {middle:g} m"
        refuse(what, "fill it with points", widest + 1)
    more = "raise bed.smoothing" if smoothing else "give bed.smoothing, a length in m"
    if smoothing > length / 4:
        refuse(
            f"smoothing over {smoothing:g} m leaves nothing of {length:g} m", "lower bed.smoothing"
        )
    count = length / smoothing * RESOLVED if smoothing else len(x)
    if count > MOST_CORNERS:
        refuse(f"{count:.0f} points, more than the {MOST_CORNERS} that a mesh has", more)
    if smoothing:
        x, z = _smoothed(x, z, smoothing, max(int(np.ceil(count)), DENSE))
    if np.ptp(z) == 0:
        refuse("level: it has no height to measure by", 'ask for shape = "flat" with a height')
    slopes = np.degrees(np.arctan2(np.diff(z), np.diff(x)))
    steep = int(np.argmax(np.abs(slopes)))
    if abs(slopes[steep]) > STEEPEST_DEG:
        what = f"{slopes[steep]:.0f} deg at x = {x[steep]:g} m, above {STEEPEST_DEG:g}"
        refuse(what, f"{more}; check that x and z are both in m", steep + 1)
    xs, zs = (tuple((values - values[0]).tolist()) for values in (x, z))
    corners = "\n".join(f"{a!r},{b!r}" for a, b in zip(xs, zs, strict=True))
    return Profile(name, xs, zs, text, digest_text(corners))


def _smoothed(
    x: FloatArray, z: FloatArray, length: float, count: int
) -> tuple[FloatArray, FloatArray]:
    """Weighted means at the ends of `count` equal steps."""
    # beyond its ends the line goes on as turned about them: they stay where they are
    around, heights = (
        np.concatenate([2 * v[0] - v[:0:-1], v, 2 * v[-1] - v[-2::-1]]) for v in (x, z)
    )
    share = np.gradient(around)  # each point stands for the bed half-way to its neighbours
    places = np.linspace(x[0], x[-1], count + 1)
    first, last = np.searchsorted(around, [places - 2 * length, places + 2 * length])
    means = np.interp(places, x, z)
    for i, (low, high) in enumerate(zip(first, last, strict=True)):
        weight = share[low:high] * np.exp(-2 * ((around[low:high] - places[i]) / length) ** 2)
        if high > low:
            means[i] = weight @ heights[low:high] / weight.sum()
    return places, means
