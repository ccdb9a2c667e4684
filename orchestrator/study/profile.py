"""Files that a study file names: measured bed lines, sieve tables and others."""

import json
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.digits import number as counted
from orchestrator.digits import on_grid
from orchestrator.errors import InputError
from orchestrator.runs.files import digest_file, digest_text
from orchestrator.study.cells import Marks, TextTable, marks_of, read_cells
from orchestrator.study.empty import EMPTY_WORDS, LOWEST_GROUND, looks_empty
from orchestrator.study.heads import (
    ALONG,
    DEGREES,
    DEPTHS,
    EAST,
    HEIGHT,
    NORTH,
    name_of,
    one_word,
)
from orchestrator.study.lengths import Lengths, lengths_of
from orchestrator.study.noise import needed_smoothing
from orchestrator.study.shapes import SHAPES
from orchestrator.study.sieve import SieveTable, read_sieve
from orchestrator.study.source import beds_in, decoded, read_bytes
from orchestrator.types import FloatArray

LARGEST, LARGEST_NUMBER = 20 * 2**20, 1e5  # bytes of a file, and largest number, m
LARGEST_X = 1e7
"""Largest x of a profile, m: eastings and northings of maps."""
COLUMNS = {"x_m": ALONG, "z_m": HEIGHT}
"""What surveyors call the columns of a profile, with or without the unit m."""
PROFILE_REMEDY = "the first line must be x_m,z_m, then numbers in m"
KNOWN_NAMES = (
    f"x_m,z_m, or for x {one_word(ALONG)}; for z {one_word(HEIGHT)}; unit and datum "
    "may follow: Level (mAOD)"
)
STATION = re.compile(r"(\d+)\+(\d+(?:\.\d*)?)")
"""A station: what stands behind the sign has as many digits as the length before it has
zeros."""
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


class Understood(Protocol):
    """What is read of a file, and says how."""

    @property
    def understood(self) -> str:
        """What was understood, in words."""


T = TypeVar("T", bound=Understood)
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
    understood
        What was understood of the file, in words.
    """

    name: str = field(compare=False)  # the file's
    x: tuple[float, ...] = field(compare=False)  # m, from the first point; so is z
    z: tuple[float, ...] = field(compare=False)
    text: str = field(compare=False, repr=False)  # the file itself
    digest: str  # of the corners: two profiles with one digest are one bed
    needs: float = field(default=0.0, compare=False)  # smoothing for its noise, m
    origin: tuple[float, float] = field(default=(0.0, 0.0), compare=False)
    towards: str = field(default=WITH_X, compare=False)
    understood: str = field(default="", compare=False)

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
    understood
        What was understood of each file, in words, by name.
    sieves
        The sieve tables that were read, by their classes.
    """

    folder: Path | None
    carried: dict[str, str] = field(default_factory=dict)
    digests: dict[str, str | None] = field(default_factory=dict)
    added: str = ""
    understood: dict[str, str] = field(default_factory=dict)
    sieves: dict[tuple[tuple[float, float], ...], SieveTable] = field(
        default_factory=dict
    )
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
        self.understood[name] = profile.understood
        return _fields(profile) | _from_first_point(bed, profile)

    def series(self, name: str, where: str) -> list[str]:
        """List the profiles that a name stands for.

        Parameters
        ----------
        name
            The name of a file, or of a folder of profiles.
        where
            The study file, for messages.

        Returns
        -------
        list of str
            The name itself, or of a folder those of the files in it.

        Raises
        ------
        InputError
            If a folder has no profile.
        """
        start = f"{name.rstrip('/')}/"
        carried = [each for each in self.carried if each.startswith(start)]
        if carried:
            self.digests[name] = None
            return carried
        if self.folder is None or not os.path.isdir(self.folder / name):
            return [name]
        place = f"{where}: bed.profile: {self.folder / name}"
        try:
            names = beds_in(self.folder / name)
        except OSError as error:
            raise InputError(f"{error.strerror}", place, "may it be read?") from None
        if not names:
            remedy = "a folder of profiles has files .csv, one for each bed"
            raise InputError("there is no profile in it", place, remedy)
        self.digests[name] = digest_text("\n".join(names))
        return [f"{start}{each}" for each in names]

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

        Raises
        ------
        InputError
            If the file is no sieve table.
        """
        where = f"{where}: grain.sizes"
        sieve = read_sieve(self._text(name, where), self._place(name, where))
        self.understood[name] = sieve.said
        self.sieves[sieve.rows] = sieve
        return [[*row] for row in sieve.rows]

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
        self.understood[name] = made.understood
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
        text = decoded(content, where, is_data=True)
        self.digests[name] = sha256(content).hexdigest()
        # a JSON string is a TOML string, but for the mark of deletion
        string = json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
        if not self.added:
            self.added = "\n[profiles]\n"
        self.added += f"{json.dumps(name)} = {string}\n"
        return text


@dataclass(frozen=True)
class _Points:
    """The points of a profile in the order of its x, and what was understood.

    Attributes
    ----------
    lines
        Number of the line of each.
    values
        x and z of each, m.
    understood
        The words.
    """

    lines: list[int]
    values: list[tuple[float, float]]
    understood: str


def _points_of(text: str, where: str) -> _Points:
    """The points of a profile; an `InputError` with the line and the remedy.

    Blank lines, comments and other columns are left out. Points against x are turned.
    """
    if not text.strip():
        raise InputError("it is empty", f"{where}: line 1", PROFILE_REMEDY)
    whole = read_cells(text, _names_both, where, _remedy_of(text))
    table = whole.without_foot()
    place = f"{where}: line {table.head}"
    try:
        columns = [_column(table, name) for name in COLUMNS]
        _check_line(table, columns[0])
    except ValueError as error:
        raise InputError(str(error), place, PROFILE_REMEDY) from None
    names = [table.names[at] for at in columns]
    named = [
        (axis, name, name_of(name).unit)
        for axis, name in zip(("x", "z"), names, strict=True)
    ]
    units = lengths_of(named, table.before, place)
    marks, lines, given = _given(table, columns, where)
    values = _in_metres(given, lines, names, units, where)
    understood = _understood(names, units, marks, values)
    foot = len(whole.rows) - len(table.rows)
    if foot:
        understood += f"; {counted(foot, 'line')} of words behind its points left out"
    return _in_order(lines, values, understood)


def _given(
    table: TextTable, columns: Sequence[int], where: str
) -> tuple[Marks, list[int], list[tuple[float, float]]]:
    """How numbers are written, the line of each point, and its x and z of the file."""
    try:
        marks = marks_of(cell for at in columns for cell in table.column(at))
    except ValueError as error:
        raise InputError(str(error), where, PROFILE_REMEDY) from None
    names = [table.names[at] for at in columns]
    lines, given = [], []
    for line, cells in table.cells(columns):
        try:
            x, z = (
                _number(cell, name, marks)
                for cell, name in zip(cells, names, strict=True)
            )
        except ValueError as error:
            remedy = _remedy_of_line(cells)
            raise InputError(str(error), f"{where}: line {line}", remedy) from None
        lines.append(line)
        given.append((x, z))
    return marks, lines, given


def _remedy_of_line(cells: Sequence[str]) -> str:
    """What helps a line that is no point."""
    if any(cell.lower() in EMPTY_WORDS for cell in cells):
        return "remove such lines, or write the numbers"
    if re.match(r"[+-]?[.,]?\d", cells[0]) or not cells[0]:
        return PROFILE_REMEDY
    return "remove the line, if it is no point; or write its numbers"


def _in_metres(
    given: Sequence[tuple[float, float]],
    lines: Sequence[int],
    names: Sequence[str],
    units: Lengths,
    where: str,
) -> list[tuple[float, float]]:
    """Points in m; an `InputError` for one that stands for none, or is beyond all."""
    if not given:
        return []
    table = np.array(given)
    of_x, of_z = units.factors
    step = float(np.abs(np.diff(table[:, 0])).max(initial=0.0)) * of_x / of_z
    # of a place along the line no slope says what is far off
    for at, most, lowest in ((0, 0.0, -np.inf), (1, step, LOWEST_GROUND)):
        value, count = looks_empty(table[:, at], most, STEEPEST_DEG, lowest)
        if count:
            line = lines[int((table[:, at] == value).argmax())]
            points = counted(count, "point")
            what = f"{names[at]}: {value:g} in {points} looks like an empty cell"
            remedy = "remove such lines, or write the numbers"
            raise InputError(what, f"{where}: line {line}", remedy)
    table = table * units.factors
    for at, most in ((0, LARGEST_X), (1, LARGEST_NUMBER)):
        is_beyond = np.abs(table[:, at]) > most
        if is_beyond.any():
            point = int(is_beyond.argmax())
            what = f"{names[at]}: {given[point][at]:g} is not a number up to {most:g} m"
            raise InputError(what, f"{where}: line {lines[point]}", PROFILE_REMEDY)
    return [(float(x), float(z)) for x, z in table]


def _in_order(
    lines: list[int], values: list[tuple[float, float]], understood: str
) -> _Points:
    """Points by their x: those of a line that was levelled against it are turned."""
    xs = [x for x, _ in values]
    if len(xs) > 1 and all(b < a for a, b in pairwise(xs)):
        understood += "; its lines go against x, and were turned"
        return _Points(lines[::-1], values[::-1], understood)
    return _Points(lines, values, understood)


def _understood(
    names: Sequence[str],
    units: Lengths,
    marks: Marks,
    values: Sequence[tuple[float, float]],
) -> str:
    """What was understood of the points of a profile, in words."""
    along, up = names
    datum = name_of(up).datum
    words = [f"x from {along!r}, z from {up!r}, {units.said}"]
    if datum:
        words.append(f"levels above {datum}")
    if marks.said:
        words.append(marks.said)
    if values:
        xs, zs = zip(*values, strict=True)
        words.append(
            f"{counted(len(values), 'point')}, x {min(xs):.9g} to {max(xs):.9g} m, "
            f"z {min(zs):.6g} to {max(zs):.6g} m"
        )
    return "; ".join(words)


def _names_both(cells: Sequence[str]) -> bool:
    """Whether some cells name the places along a line, and its heights."""
    plain = [name_of(cell).plain for cell in cells]
    return all(any(name in called for name in plain) for called in COLUMNS.values())


def _remedy_of(text: str) -> str:
    """What helps a file without names that are known, by what it seems to have."""
    first = next(line for line in text.splitlines() if line.strip())
    words = {word.lower() for word in re.findall(r"[^\W\d_]+", first)}
    if words & {*DEPTHS}:
        return f"depths go down: write heights; {KNOWN_NAMES}"
    if words & {*DEGREES}:
        return f"degrees are no lengths; {KNOWN_NAMES}"
    return KNOWN_NAMES


def _column(table: TextTable, name: str) -> int:
    """The column of the table that has the places, or the heights.

    It is a ValueError unless just one column is meant.
    """
    names = table.names
    if names.count(name) == 1:
        return names.index(name)
    meant = [
        at for at, cell in enumerate(names) if name_of(cell).plain in COLUMNS[name]
    ]
    # a column of one number, as the offset of a line of levels, says nothing of it
    varying = [at for at in meant if len({*table.column(at)}) > 1]
    found = varying or meant
    if len(found) == 1:
        return found[0]
    listed = " or ".join(names[at] for at in found)
    raise ValueError(f"which column is {name}: {listed}? Name that one {name}")


def _check_line(table: TextTable, along: int) -> None:
    """Refuse a line whose other axis of a map varies, too."""
    axis = name_of(table.names[along]).plain
    if axis not in EAST:
        return
    for at, name in enumerate(table.names):
        if name_of(name).plain in NORTH and len({*table.column(at)}) > 1:
            both = f"{table.names[along]} or {name}"
            what = f"which column is x_m: {both}"
            raise ValueError(f"{what}? Name that one x_m, or add one of the chainage")


def _number(text: str, name: str, marks: Marks) -> float:
    """The number in a cell, in the unit of its column; a ValueError for other texts."""
    cell = text.strip()
    if not cell:
        raise ValueError(f"the cell of {name} is empty")
    if cell.lower() in EMPTY_WORDS:
        raise ValueError(f"{name}: {cell} looks like an empty cell")
    station = STATION.fullmatch(cell)
    if station:
        return _station(station, name)
    try:
        value = marks.number(text)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if not np.isfinite(value):
        raise ValueError(f"{name}: {cell} is not a number up to {LARGEST_X:g}")
    return value


def _station(station: re.Match[str], name: str) -> float:
    """The length of a station in the unit of its column.

    1+250.5 is of kilometres. One of hundreds may be of feet: without a unit it is a
    ValueError.
    """
    whole, behind = station[1], station[2]
    digits = len(behind.partition(".")[0])
    if digits == 3 or (digits == 2 and name_of(name).unit):
        return 10.0**digits * int(whole) + float(behind)
    what = f"{name}: {station[0]} may count hundreds of feet or of metres"
    raise ValueError(f"{what}: write the unit behind its name, {name} (ft) or (m)")


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
    points = _points_of(text, where)
    refusal = _Refusal(where, () if smoothing else points.lines)
    if len(points.values) < 3:
        what = f"{len(points.values)} points make no bed"
        raise refusal.whole(what, "write 3 at least")
    x, z = np.array(points.values).T
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
    return Profile(
        name, xs, zs, text, digest, needs, origin, towards, points.understood
    )


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
