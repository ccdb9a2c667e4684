"""Winds of a place as people have them: series by the hour, and tables of frequencies.

Whatever the file, what is made of it is the same: the share of time of each direction
and speed. A series is weighed by its times, so that gaps and observations between the
hours count for what they are.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.digits import number as counted
from orchestrator.digits import percent, rounded
from orchestrator.errors import InputError
from orchestrator.study import compass
from orchestrator.study.cells import Marks, TextTable, marks_of, read_cells
from orchestrator.study.heads import name_of
from orchestrator.study.lengths import FEET, LENGTHS, METRE
from orchestrator.study.speeds import SPEED_UNIT, SPEEDS, unit_above
from orchestrator.types import FloatArray

USUAL_HEIGHT = 10.0
"""Height of the winds of weather services, m."""
HOURS_OF_YEAR = 8760.0
"""Hours of a year."""
OFF = 0.01
"""Largest difference of a sum of shares from the whole."""
WINDIEST = 20.0
"""Mean speed above which it is likelier in another unit, m/s: Cape Denison, of the
windiest places, has 19."""
FASTEST = 150.0
"""Largest speed, m/s."""
MISSING = (
    "",
    "na",
    "nan",
    "n/a",
    "null",
    "none",
    "m",
    "-",
    "--",
    "---",
    "missing",
)
"""Words for no observation."""
NO_SPEED = (99.9, 99.99, 999.0, 999.9, 999.99, 9999.0, 9999.9, 32767.0)
"""Numbers for none, where no wind is so strong in the unit of the file."""
SHORT_NO_SPEED = 99.0
"""A number for none that may be a wind: it is one where others are half of it."""
STRONGEST = 40.0
"""Mean speed above which such a number is no wind, m/s."""
VARIABLE = (990.0, 999.0)
"""Numbers for a wind of no direction. Airports write 999 for a variable direction as
for one that was not observed (ISD, NOAA)."""
NO_DIRECTION = (999.9, 9999.0, 32767.0)
"""Numbers for a direction that was not observed, as all below -900."""
FIELDS: Mapping[str, tuple[str, ...]] = {
    "direction": (
        "from",
        "direction",
        "wind direction",
        "winddirection",
        "dir",
        "wind dir",
        "winddir",
        "wd",
        "wdir",
        "dd",
        "drct",
        "wind from direction",
        "direction from",
        "sector",
        "wind sector",
        "sektor",
        "richtung",
        "windrichtung",
        "richting",
        "windrichting",
        "direction du vent",
        "direccion",
        "dirección",
    ),
    "speed": (
        "speed",
        "wind speed",
        "windspeed",
        "mean wind speed",
        "mean speed",
        "wind",
        "ws",
        "wspd",
        "wind spd",
        "ff",
        "fh",
        "sknt",
        "velocity",
        "geschwindigkeit",
        "windgeschwindigkeit",
        "windgeschw",
        "windgeschw.",
        "snelheid",
        "windsnelheid",
        "vitesse",
        "vitesse du vent",
        "velocidad",
    ),
    "share": (
        "share",
        "frequency",
        "freq",
        "percent",
        "percentage",
        "fraction",
        "probability",
        "hours",
        "hrs",
        "stunden",
        "uren",
        "count",
        "counts",
        "occurrences",
        "observations",
        "anzahl",
        "häufigkeit",
        "haeufigkeit",
    ),
    "time": (
        "date",
        "time",
        "datetime",
        "date time",
        "date utc",
        "timestamp",
        "valid",
        "utc",
        "time utc",
        "mess datum",
        "datum",
        "zeit",
        "zeitstempel",
        "yyyymmdd",
        "hh",
        "hour",
        "stunde",
        "uhrzeit",
        "year",
        "yr",
        "jahr",
        "month",
        "mo",
        "monat",
        "day",
        "dy",
        "tag",
        "minute",
        "mi",
        "t",
        "t s",
        "t h",
        "time s",
        "time h",
        "seconds",
    ),
}
"""Names of columns, without units, heights and marks."""
ZONES = ("utc", "gmt", "cet", "mez", "local", "lst", "lt", "z", "")
"""Words for the zone of a time."""
WORDS_OF_TIME = {name for name in FIELDS["time"] if " " not in name} | {*ZONES}
"""Words of which the name of a column of times may be made."""
COUNTS = ("count", "counts", "occurrences", "observations", "anzahl")
OF_HOURS = ("hours", "hrs", "stunden", "uren")
EASTWARD, NORTHWARD = ("u", "u wind", "ugrd"), ("v", "v wind", "vgrd")
"""Parts of the wind towards the east and the north, as models give them."""
HEIGHT = re.compile(
    rf"(?:at|in|@|h ?=)? ?(?<![\d.,])(\d+(?:[.,]\d+)?) ?"
    rf"({'|'.join((*FEET, *METRE))})(?![a-z/]|_s\b)",
    re.IGNORECASE,
)
"""A height in the name of a column: wind_speed_10m, WS50M, speed at 33 ft."""
TENS = re.compile(
    r"[(\[]? ?(?:10'?s? ?(?:of )?(?:deg(?:rees)?|°)|tens of deg\w*) ?[)\]]?"
)
"""A unit of directions: tens of degrees."""
HIGHEST_TEN = 36
"""The north in tens of degrees."""
ABOVE = re.compile(
    r"(?:anemometer|sensor|measure\w*|wind\w*|mess\w*)\W*(?:height|höhe)\W+"
    rf"(?:above ground\W+)?(\d+(?:[.,]\d+)?) ?({'|'.join((*FEET, *METRE))})(?!\w)",
    re.IGNORECASE,
)
"""The height of the winds in a line above a table."""
HEIGHTS = ("z", "height", "höhe", "hoehe", "hoogte")
"""Columns of the height of winds."""
CLASS = re.compile(
    r"([<>≥≤]?)=? ?(\d+(?:[.,]\d+)?)(?: ?(?:-|–|to|bis|\.\.\.|…|_) ?(<?)"
    r"(\d+(?:[.,]\d+)?))? ?(\+?)"
)
"""A class of speeds: 2-4, 2 to 4, <2, >10, 10+."""
TOTALS = ("total", "totals", "sum", "all", "summe", "gesamt", "totaal")
PARTS = 10
"""Speeds over which a class is spread."""
REMEDY = (
    "name the columns: from_deg, speed_m_s and share or hours; or a time, a speed and "
    "a direction, as date,ws,wd; or a direction and classes of speeds, 0-2,2-4,>4"
)
NAMES_REMEDY = (
    f"{REMEDY}; names that are known: {', '.join(FIELDS['direction'][1:9:2])}; "
    f"{', '.join(FIELDS['speed'][:8:2])}; {', '.join(FIELDS['share'][:3])}; "
    "docs/your-files.md has the others"
)
WND = "WND"
"""Column of winds in the hourly files of NOAA."""
ISD_SPEED = "speed (0.1 m/s)"
ISD_LITE = re.compile(r"(1[89]|20)\d\d +\d{1,2} +\d{1,2} +\d{1,2}(?: +-?\d+){8}")
"""A line of ISD-Lite."""
ISD_NAMES = ("year", "month", "day", "hour", "temperature", "dew point", "pressure",
             "direction", ISD_SPEED, "sky", "rain 1 h", "rain 6 h")  # fmt: skip
"""Columns of ISD-Lite, which has no head."""
MANY = 20
"""Directions from which on they may be told to be radians."""
TWICE = 1e-3
"""Largest part of the times that may stand twice: an hour of the end of summer time."""


@dataclass(frozen=True)
class Winds:
    """Shares of time by direction and speed.

    Attributes
    ----------
    rows
        Where the wind comes from, degrees from 0 to 360, speed, m/s, and share of time;
        shares add up to 1. A calm has the speed 0.
    height
        Height of the speeds above the ground, m; None where the file says none.
    understood
        What was understood of the file, in words.
    """

    rows: tuple[tuple[float, float, float], ...]
    height: float | None
    understood: str


def question_of(rows: Iterable[tuple[float, float, float]], name: str) -> str:
    """Ask about winds that are likelier in another unit.

    Parameters
    ----------
    rows
        Direction, speed, m/s, and share of time of each.
    name
        The name of their file.

    Returns
    -------
    str
        The question; empty for none.
    """
    mean = sum(speed * share for _, speed, share in rows)
    if mean <= WINDIEST:
        return ""
    what = f"the wind of {name} is {mean:.3g} m/s in the mean"
    return f"{what}: did you mean km/h, {mean / 3.6:.3g} m/s?"


class _Column(NamedTuple):
    """What the name of a column says."""

    field: str
    unit: str
    height: float | None
    plain: str


@dataclass
class _Sums:
    """Shares of time by direction and speed, while they are added up."""

    of: dict[tuple[float, float], float] = field(default_factory=dict)
    variable: dict[float, float] = field(default_factory=dict)

    def add(self, direction: float | None, speed: float, share: float) -> None:
        """Add the share of a wind; a calm, or a variable one, needs no direction."""
        if direction is None and speed > 0:
            self.variable[speed] = self.variable.get(speed, 0.0) + share
            return
        key = ((direction or 0.0) % 360, speed)
        self.of[key] = self.of.get(key, 0.0) + share

    @property
    def total(self) -> float:
        """The sum of all."""
        return sum(self.of.values()) + sum(self.variable.values())

    def rows(self) -> tuple[tuple[float, float, float], ...]:
        """Direction, speed and share, whose sum is 1; variable winds go to all."""
        made = dict(self.of)
        by_way: dict[float, float] = {}
        for (way, speed), share in self.of.items():
            if speed > 0:
                by_way[way] = by_way.get(way, 0.0) + share
        known = sum(by_way.values())
        for speed, share in self.variable.items():
            for way, part in by_way.items():
                key = (way, speed)
                made[key] = made.get(key, 0.0) + share * part / known
        total = sum(made.values())
        return tuple(
            (way, speed, share / total) for (way, speed), share in made.items()
        )


def read_winds(text: str, where: str) -> Winds:
    """Read the winds of a place.

    Parameters
    ----------
    text
        A series with a time, a speed and a direction in each line; a table of
        directions, speeds and shares, hours or counts; a table of directions over
        classes of speeds, in either order; or a table of WAsP (.tab).
    where
        The file, for messages.

    Returns
    -------
    Winds
        The shares of time.

    Raises
    ------
    InputError
        With the line and the remedy.
    """
    found = _of_wasp(text, where)
    if found is not None:
        return found
    table = _of_isd_lite(text) or _without_wnd(
        read_cells(text, _is_head, where, NAMES_REMEDY), where
    )
    if not table.rows:
        raise InputError("its shares add up to 0: no line has a wind", where, REMEDY)
    columns = [_column(name) for name in table.names]
    return _Reading(table, columns, where).read()


def _column(name: str) -> _Column:
    """What the name of a column says of it."""
    words = TENS.sub(" ", name.strip().lower())
    unit = SPEED_UNIT.search(words.replace("_m_s", " m_s").replace("_km_h", " km_h"))
    bare = words.replace("_m_s", " m_s").replace("_km_h", " km_h")
    if unit:
        bare = bare[: unit.start()] + " " + bare[unit.end() :]
    height = HEIGHT.search(bare) or re.search(r"\b[uv]_?(10|100)\b(())", bare)
    if height:
        bare = bare[: height.start()] + " " + bare[height.end() :]
        if height.re is not HEIGHT:
            bare = words[0]
    bare = re.sub(r"\b(deg|degrees|grad|°|degn)\b|°", " ", bare.replace("_", " "))
    plain = " ".join(re.findall(r"[^\W\d]+", bare))
    of_unit = "%" if re.search(r"%|percent|pct", words) else unit[1] if unit else ""
    at = None
    if height:
        metres = LENGTHS[height[2]] if height[2] else 1.0
        at = rounded(metres * float(height[1].replace(",", ".")))
    found = next((key for key, names in FIELDS.items() if plain in names), "")
    if plain in EASTWARD:
        found = "u"
    elif plain in NORTHWARD:
        found = "v"
    elif not found and {*plain.split()} <= WORDS_OF_TIME and plain not in ZONES:
        found = "time"
    elif not found and words.strip() == "%":
        found = "share"
    return _Column(found, of_unit, at, plain)


def _is_head(cells: Sequence[str]) -> bool:
    """Whether some cells name the columns of winds."""
    columns = [_column(cell) for cell in cells]
    fields = {column.field for column in columns}
    fields |= {"speed", "direction"} if _is_dwd(cells) else set()
    if "direction" in fields and "u" in fields and "v" not in fields:
        return True
    if "direction" in fields and ("speed" in fields or _classes(cells[1:])):
        return True
    if {"u", "v", "time"} <= fields or ("time" in fields and WND in cells):
        return True
    ways = compass.degrees_of([cell for cell in cells[1:] if cell])
    return "speed" in fields and ways is not None


def _is_dwd(cells: Sequence[str]) -> bool:
    """Whether some cells are the head of a file of winds of Germany's service."""
    return {"mess_datum", "f", "d"} <= {cell.strip().lower() for cell in cells}


def _class_of(cell: str) -> tuple[float, float] | None:
    """The ends of a class of speeds; None of another cell."""
    bare = SPEED_UNIT.sub("", cell.lower()).strip(" ()[]")
    bare = re.sub(r"^(ws|speed|v|u) ?", "", bare)
    if bare in compass.CALMS:
        return 0.0, 0.0
    found = CLASS.fullmatch(bare)
    if found is None:
        return None
    first = float(found[2].replace(",", "."))
    if found[4]:
        return first, float(found[4].replace(",", "."))
    if found[1] in ("<", "≤"):
        return 0.0, first
    if found[1] in (">", "≥") or found[5]:
        return first, math.inf
    return None


def _classes(cells: Sequence[str]) -> bool:
    """Whether some cells are classes of speeds, but for a total."""
    given = [cell for cell in cells if cell and cell.lower() not in TOTALS]
    return len(given) > 1 and all(_class_of(cell) is not None for cell in given)


@dataclass
class _Reading:
    """A table of winds while it is read."""

    table: TextTable
    columns: Sequence[_Column]
    where: str

    def read(self) -> Winds:
        """Its winds."""
        self.sums = _Sums()
        self.said: list[str] = []
        self.notes: dict[str, int] = {}
        self.is_knmi = self._has("yyyymmdd") and self._has("fh")
        fields = {column.field: at for at, column in enumerate(self.columns)}
        if _is_dwd(self.table.names):
            lower = [name.strip().lower() for name in self.table.names]
            fields |= {"speed": lower.index("f"), "direction": lower.index("d")}
        if "direction" in fields and "u" in fields and "v" not in fields:
            fields["speed"] = fields.pop("u")
        if "direction" in fields and "speed" in fields:
            self._check_once("direction")
            self._check_once("speed")
            if "share" in fields:
                return self._of_shares(fields)
            if "time" in fields:
                return self._of_series(fields)
            what = "it has speeds and directions, and neither a time nor a share"
            raise InputError(what, f"{self.where}: line {self.table.head}", REMEDY)
        if {"u", "v"} <= fields.keys():
            return self._of_series(fields)
        return self._of_classes()

    def _has(self, plain: str) -> bool:
        """Whether a column has a name."""
        return any(column.plain == plain for column in self.columns)

    def _check_once(self, name: str) -> None:
        """Refuse two columns that may be the same thing."""
        called = [
            self.table.names[at]
            for at, column in enumerate(self.columns)
            if column.field == name
        ]
        if len(called) > 1 and self.is_knmi:
            return
        if len(called) > 1:
            what = f"which column is the {name}: {' or '.join(called)}?"
            place = f"{self.where}: line {self.table.head}"
            raise InputError(what, place, "leave one, or name the others otherwise")

    def _place(self, line: int) -> str:
        """A line in messages."""
        return f"{self.where}: line {line}"

    # units and heights

    def _factor(self, at: int) -> float:
        """The unit of a column of speeds, m/s, which is said."""
        column = self.columns[at]
        name = self.table.names[at]
        unit = column.unit
        by = ""
        if not unit and self.is_knmi:
            unit, by = "0.1 m/s", ", as KNMI gives them"
        elif not unit and column.plain == "sknt":
            unit, by = "knots", ", by its name"
        elif not unit and column.plain == "wspd" and self._has("coco"):
            unit, by = "km/h", ", as Meteostat gives them"
        elif not unit and _is_dwd(self.table.names):
            unit, by = "m/s", ", as Germany's service gives them"
        if unit and unit not in SPEEDS:
            place = self._place(self.table.head)
            raise InputError(f"{name}: speeds in {unit}", place, "name m/s or km/h")
        above = unit_above(self.table.before, unit, name, self.where)
        if not unit and above:
            unit, by = above[0], f", by line {above[1]}"
        elif not unit:
            unit, by = "m/s", ", since it names no unit"
        shown = unit.replace("_", "/")
        self.said.append(f"speeds from {name!r} in {shown}{by}")
        return SPEEDS[unit]

    def _height(self, columns: Iterable[int]) -> float | None:
        """The height that names of columns, or a column of heights, say."""
        told = (self.columns[at].height for at in columns)
        named = {height for height in told if height is not None}
        for found in ABOVE.finditer("\n".join(self.table.before)):
            metres = LENGTHS[found[2].lower()]
            named.add(rounded(metres * float(found[1].replace(",", "."))))
        for at, name in enumerate(self.table.names):
            called = name_of(name)
            if called.plain in HEIGHTS and not called.datum:
                cells = {cell for cell in self.table.column(at) if cell}
                if len(cells) > 1:
                    what = f"{name}: heights from {min(cells)} to {max(cells)}"
                    raise InputError(what, self.where, "give winds of one height")
                metres = LENGTHS[called.unit or "m"]
                heights = {self._number(cell, name, self.where) for cell in cells}
                named |= {rounded(metres * height) for height in heights}
        if len(named) > 1:
            listed = " and ".join(
                f"{height:g} m" for height in sorted(named, key=float)
            )
            what = f"its columns are of {listed}"
            raise InputError(what, self.where, "leave those of one height")
        return next(iter(named)) if named else None

    def _number(self, cell: str, name: str, place: str) -> float:
        """The number in a cell."""
        try:
            return self.marks.number(cell)
        except ValueError as error:
            raise InputError(f"{name}: {error}", place, REMEDY) from None

    def _marks_of(self, columns: Iterable[int]) -> Marks:
        """How the numbers of some columns are written."""
        try:
            return marks_of(cell for at in columns for cell in self.table.column(at))
        except ValueError as error:
            raise InputError(str(error), self.where, REMEDY) from None

    # one wind in each line

    def _speed(self, cell: str, factor: float, name: str, place: str) -> float | None:
        """A speed, m/s; None without an observation."""
        if cell.lower() in MISSING:
            return None
        value = self._number(cell, name, place)
        is_mark = value in self.no_speed and factor * value > STRONGEST
        if is_mark or value <= -9 or math.isnan(value):
            self._note(name, f"{value:g}", "no speed")
            return None
        speed = rounded(factor * value)
        if not 0 <= speed <= FASTEST:
            what = f"{name} {value:g}"
            raise InputError(what, place, f"winds in m/s, 0 to {FASTEST:g}")
        return speed

    def _direction(self, cell: str, name: str, place: str) -> float | None:
        """A direction, degrees; None for a variable one, or none."""
        bare = cell.lower()
        if bare in MISSING or bare in compass.CALMS or bare in compass.VARIABLE:
            return None
        if bare in self.ways:
            return self.ways[bare]
        value = self._number(cell, name, place)
        if value in VARIABLE:
            self._note(name, f"{value:g}", "a variable or unknown direction")
            return None
        if _is_no_direction(value):
            self._note(name, f"{value:g}", "no observation of a direction")
            return None
        if self.is_knmi and value == 0:
            return None  # a calm at the end of an hour
        value *= 10.0 if TENS.search(name.lower()) else 1.0
        if not -360 <= value <= 360:
            what = f"{name} {value:g}"
            raise InputError(what, place, "degrees from north over east, 0 to 360")
        return value % 360

    def _note(self, name: str, cell: str, what: str) -> None:
        """Take note of a number that stands for something else."""
        key = f"{cell} in {name!r} stands for {what}"
        self.notes[key] = self.notes.get(key, 0) + 1

    def _named_ways(self, cells: Sequence[str]) -> None:
        """Find what the names of sectors mean, whose letters depend on the language."""
        given = [cell for cell in dict.fromkeys(map(str.lower, cells)) if cell]
        words = [
            cell
            for cell in given
            if re.search(r"[^\W\d]", cell)
            and cell not in MISSING
            and cell not in compass.CALMS
            and cell not in compass.VARIABLE
        ]
        self.ways: Mapping[str, float] = {}
        if not words:
            return
        found = compass.degrees_of(words)
        if found is None:
            unknown = compass.unknown(words)
            what = f"{unknown!r} is no direction that is told from the others"
            remedy = f"write degrees, or {', '.join(compass.ENGLISH[::2])}"
            raise InputError(what, self.where, remedy)
        self.ways = dict(zip(words, found, strict=True))
        self.said.append(f"{counted(len(words), 'sector')} by their names")

    def _winds(
        self, fields: Mapping[str, int]
    ) -> Iterator[tuple[int, list[str], float | None, float | None]]:
        """Number and cells of each line, its direction and its speed."""
        if "direction" not in fields:
            yield from self._of_parts(fields)
            return
        way, fast = fields["direction"], fields["speed"]
        if self.is_knmi:
            fast = [column.plain for column in self.columns].index("fh")
        self._named_ways(self.table.column(way))
        self.marks = self._marks_of([fast, way, *filter(None, [fields.get("share")])])
        factor = self._factor(fast)
        self._tell_marks(self.table.column(fast))
        self.height = self._height([fast, way])
        self._check_degrees(self.table.column(way), self.table.names[way])
        if TENS.search(self.table.names[way].lower()):
            self.said.append(f"directions from {self.table.names[way]!r} in tens of °")
        for line, cells in self.table.rows:
            cells += [""] * (len(self.columns) - len(cells))
            place = self._place(line)
            speed = self._speed(cells[fast], factor, self.table.names[fast], place)
            direction = self._direction(cells[way], self.table.names[way], place)
            yield line, cells, direction, speed

    def _tell_marks(self, cells: Sequence[str]) -> None:
        """Tell by the other speeds which numbers stand for none."""
        self.no_speed: tuple[float, ...] = NO_SPEED
        values = []
        for cell in cells:
            try:
                values.append(self.marks.number(cell))
            except ValueError:
                continue
        known = [v for v in values if v not in (*NO_SPEED, SHORT_NO_SPEED)]
        if known and max(known) < SHORT_NO_SPEED / 2:
            self.no_speed = (*NO_SPEED, SHORT_NO_SPEED)

    def _of_parts(
        self, fields: Mapping[str, int]
    ) -> Iterator[tuple[int, list[str], float | None, float | None]]:
        """The same of winds by their parts towards east and north."""
        east, north = fields["u"], fields["v"]
        self.marks = self._marks_of([east, north])
        factor = self._factor(east)
        self.height = self._height([east, north])
        self.said.append("directions from the parts u and v")
        for line, cells in self.table.rows:
            cells += [""] * (len(self.columns) - len(cells))
            place = self._place(line)
            if {cells[east].lower(), cells[north].lower()} & {*MISSING}:
                yield line, cells, None, None
                continue
            given = {
                at: self._number(cells[at], self.table.names[at], place)
                for at in (east, north)
            }
            none = [at for at, value in given.items() if _is_no_part(value, factor)]
            if none:
                first = none[0]
                self._note(self.table.names[first], f"{given[first]:g}", "no speed")
                yield line, cells, None, None
                continue
            u, v = (factor * value for value in given.values())
            speed = rounded(math.hypot(u, v))
            if speed > FASTEST:
                yield line, cells, None, None
                continue
            way = math.degrees(math.atan2(-u, -v)) % 360
            yield line, cells, rounded(way), speed

    def _check_degrees(self, cells: Sequence[str], name: str) -> None:
        """Ask about directions that are likelier in radians."""
        values = []
        for cell in cells:
            try:
                values.append(self.marks.number(cell))
            except ValueError:
                continue
        is_whole = all(value == round(value) for value in values)
        if len(values) >= MANY and 0 < max(values) <= 2 * math.pi and not is_whole:
            what = f"{name} is {max(values):g} at most: did you mean radians?"
            raise InputError(what, self.where, "multiply it by 57.29578")
        known = [value for value in values if 0 <= value <= 360]
        is_low = is_whole and len(known) >= MANY and max(known) <= HIGHEST_TEN
        if is_low and not TENS.search(name.lower()):
            what = f"{name} is {max(known):g} at most: did you mean tens of degrees?"
            remedy = f"name it {name} (10 deg), or {name} (deg)"
            if not re.search(r"deg|°|grad", name.lower()):
                raise InputError(what, self.where, remedy)

    # the kinds of tables

    def _of_shares(self, fields: Mapping[str, int]) -> Winds:
        """The winds of a table of shares, hours or counts."""
        at = fields["share"]
        name = self.table.names[at]
        for line, cells, direction, speed in self._winds(fields):
            place = self._place(line)
            share = self._number(cells[at].rstrip("% "), name, place)
            if not share >= 0:
                raise InputError(f"{name} {share:g}", place, "a part of the time")
            if speed is None:
                what = f"{self.table.names[fields['speed']]}: there is no number"
                raise InputError(what, place, "a calm has the speed 0")
            self.sums.add(direction, speed, share)
        self._check_total(self.columns[at].plain, self.columns[at].unit)
        return self._made()

    def _check_total(self, plain: str, unit: str) -> None:
        """Refuse shares whose sum is no whole."""
        total = self.sums.total
        if not total > 0:
            raise InputError("its shares add up to 0", self.where, REMEDY)
        if plain in COUNTS:
            self.said.append(f"{total:.9g} observations")
            return
        years = max(round(total / HOURS_OF_YEAR), 1)
        wholes = {"parts": 1.0, "per cent": 100.0, "hours": years * HOURS_OF_YEAR}
        if plain in OF_HOURS:
            wholes = {"hours": wholes["hours"]}
        elif unit == "%":
            wholes = {"per cent": 100.0}
        for word, whole in wholes.items():
            if abs(total / whole - 1) <= OFF:
                self.said.append(f"shares in {word}, {total:.6g} in all")
                return
        listed = "1, 100 or the 8760 hours of a year"
        if len(wholes) == 1:
            listed = f"{next(iter(wholes.values())):g}"
        what = f"its shares add up to {total:.6g}, not to {listed}"
        remedy = "add the calms, with a speed of 0, or divide the shares by their sum"
        raise InputError(what, self.where, remedy)

    def _of_series(self, fields: Mapping[str, int]) -> Winds:
        """The winds of a series."""
        winds = list(self._winds(fields))
        hours, first, last = _hours_of(self.table, self.columns, self.where)
        order = np.argsort(hours, kind="stable")
        weights, step, span = self._weights(hours, order)
        covered = variable = 0.0
        for (_, cells, direction, speed), weight in zip(
            (winds[at] for at in order), weights, strict=True
        ):
            is_unknown = direction is None and self._lacks_direction(cells, fields)
            if speed is None or (speed > 0 and is_unknown):
                continue
            covered += weight
            variable += weight if direction is None and speed > 0 else 0.0
            self.sums.add(direction, speed, float(weight))
        if not covered:
            raise InputError("no line has a wind", self.where, REMEDY)
        gaps = max(span - covered, 0.0)
        told = [f"{first} to {last} in steps of {_long(step)}"]
        told.append(f"{covered:.6g} hours with a wind, {gaps:.4g} without")
        if span < (1 - 2 * OFF) * HOURS_OF_YEAR:
            told.append("less than a year: seasons may be missing")
        if variable:
            part = percent(variable / covered)
            told.append(f"{part} without a direction, spread over all directions")
        self.said += told
        return self._made()

    def _lacks_direction(self, cells: Sequence[str], fields: Mapping[str, int]) -> bool:
        """Whether the cell of a direction is a number for none that was observed."""
        try:
            return _is_no_direction(self.marks.number(cells[fields["direction"]]))
        except (KeyError, ValueError):
            return False

    def _weights(
        self, hours: FloatArray, order: "np.ndarray[tuple[int], np.dtype[np.intp]]"
    ) -> tuple[FloatArray, float, float]:
        """The time that each line stands for, the usual step and all time, h."""
        sorted_hours = hours[order]
        steps = np.diff(sorted_hours)
        if not len(steps) or not (steps > 0).any():
            what = "one time is no series"
            raise InputError(what, self.where, "give a line for each hour")
        same = int((steps == 0).sum())
        if same > TWICE * len(steps) + 1:
            at = int(order[int(np.argmin(steps > 0)) + 1])
            line = self.table.rows[at][0]
            what = f"{counted(same, 'time')} stand twice, the first in this line"
            remedy = "leave one station and one line for each time"
            raise InputError(what, self._place(line), remedy)
        step = float(np.median(steps[steps > 0]))
        weights = np.minimum(np.append(steps, step), step)
        span = float(sorted_hours[-1] - sorted_hours[0]) + step
        return weights, step, span

    def _of_classes(self) -> Winds:
        """The winds of a table of directions over classes of speeds."""
        names = self.table.names
        firsts = self.table.column(0)
        is_turned = not _classes(names[1:])
        of_classes, of_ways = (firsts, names[1:]) if is_turned else (names[1:], firsts)
        self.marks = self._marks_of(range(1, len(names)))
        self._named_ways([way for way in of_ways if way.lower() not in TOTALS])
        unit = next(
            filter(None, (self.columns[0].unit, *map(_unit_of, of_classes))), ""
        )
        unit = "" if unit == "%" else unit
        above = unit_above(self.table.before, unit, of_classes[0], self.where)
        by = "" if unit else ", since they name no unit"
        if not unit and above:
            unit, by = above[0], f", by line {above[1]}"
        factor = SPEEDS.get(unit, 1.0)
        self.said.append(f"classes of speeds in {unit or 'm/s'}{by}, spread evenly")
        self.height = self._height([0])
        for line, cells in self.table.rows:
            if cells[0].lower() in TOTALS:
                continue
            for at, cell in enumerate(cells[1 : len(names)], 1):
                head = names[at]
                if head.lower() in TOTALS or cell.lower() in MISSING:
                    continue
                one, other = (cells[0], head) if is_turned else (head, cells[0])
                share = self._number(cell.rstrip("% "), head, self._place(line))
                if not share >= 0:
                    place = self._place(line)
                    raise InputError(f"{head}: {share:g}", place, "a part of the time")
                self._add_class(one, other, share, factor, line)
        self._check_total("", "")
        return self._made()

    def _add_class(
        self, word: str, way: str, share: float, factor: float, line: int
    ) -> None:
        """Add a share of a class of speeds."""
        ends = _class_of(word)
        is_calm = way.lower() in compass.CALMS
        if ends is None and not is_calm:
            what = f"{word!r} is no class of speeds"
            raise InputError(what, self._place(line), "write its ends: 2-4, <2, >10")
        if is_calm or ends is None or ends == (0.0, 0.0):
            self.sums.add(None, 0.0, share)
            return
        direction = self._direction(way, "direction", self._place(line))
        low, high = ends
        if math.isinf(high):
            open_end = f"those above {low:g} taken at {low:g}"
            if open_end not in self.said:
                self.said.append(open_end)
            self.sums.add(direction, rounded(factor * low), share)
            return
        for part in range(PARTS):
            speed = low + (high - low) * (part + 0.5) / PARTS
            self.sums.add(direction, rounded(factor * speed), share / PARTS)

    def _made(self) -> Winds:
        """The winds, with what was understood."""
        if self.sums.variable and not any(speed > 0 for _, speed in self.sums.of):
            what = "no wind has a direction"
            raise InputError(what, self.where, REMEDY)
        rows = self.sums.rows()
        blows = [speed for _, speed, _ in rows if speed > 0]
        calms = sum(share for _, speed, share in rows if speed == 0)
        mean = sum(speed * share for _, speed, share in rows)
        most = max(blows, default=0.0)
        if self.marks.said:
            self.said.append(self.marks.said)
        self.said += [
            f"{note}, {counted(count, 'line')}" for note, count in self.notes.items()
        ]
        self.said.append(
            f"calm {percent(calms)} of the time, mean {mean:.3g} m/s, at most "
            f"{most:.3g} m/s"
        )
        return Winds(rows, self.height, "; ".join(self.said))


def _is_no_direction(value: float) -> bool:
    """Whether a number stands for a direction that was not observed."""
    return value in NO_DIRECTION or value <= -900 or math.isnan(value)


def _is_no_part(value: float, factor: float) -> bool:
    """Whether a part of a wind is a number for none, of either sign."""
    is_mark = abs(value) in (*NO_SPEED, SHORT_NO_SPEED)
    return is_mark and factor * abs(value) > STRONGEST


def _unit_of(cell: str) -> str:
    """The unit of speeds in a cell; empty without one."""
    found = SPEED_UNIT.search(cell.lower())
    return found[1] if found else ""


def _long(hours: float) -> str:
    """A step of time in words."""
    if hours < 1:
        return f"{60 * hours:.3g} minutes"
    return f"{hours:.3g} h"


DIGITS = {8: "%Y%m%d", 10: "%Y%m%d%H", 12: "%Y%m%d%H%M", 14: "%Y%m%d%H%M%S"}
"""Times that are written in digits alone, by their number."""
UNIX = 10
"""Digits of the seconds since 1970 that a Unix time is."""
PARTS_OF_TIME: Mapping[str, tuple[str, ...]] = {
    "year": ("year", "yr", "jahr"),
    "month": ("month", "mo", "monat"),
    "day": ("day", "dy", "tag"),
    "hour": ("hour", "hh", "stunde"),
    "minute": ("minute", "mi"),
}
SECONDS = ("t", "t s", "t h", "time", "time s", "time h", "seconds")
"""Columns that may be of seconds, or of hours."""
TIME_REMEDY = "write times as 2024-01-31T13:00"


def _hours_of(
    table: TextTable, columns: Sequence[_Column], where: str
) -> tuple[FloatArray, str, str]:
    """The time of each line, h, and the first and the last in words."""
    places = {column.plain: at for at, column in enumerate(columns)}
    of_part = {
        part: next((places[name] for name in names if name in places), None)
        for part, names in PARTS_OF_TIME.items()
    }
    if of_part["year"] is not None and of_part["month"] is not None:
        return _of_parts_of_time(table, of_part, where)
    called = [at for at, column in enumerate(columns) if column.field == "time"]
    hour = of_part["hour"]
    dates = [at for at in called if at != hour]
    joined = [" ".join(cells).strip() for _, cells in table.cells(dates)]
    name = table.names[dates[0]] if dates else ""
    numbers = _all_numbers(joined)
    if numbers is not None and columns[dates[0]].plain in SECONDS:
        unit = 1.0 if re.search(r"[_( ]h(ours)?\b", name.lower()) else 1 / 3600
        said = (f"{numbers.min() * unit:.6g} h", f"{numbers.max() * unit:.6g} h")
        return numbers * unit, *said
    times = _times(joined, table, where)
    hours = (times - pd.Timestamp(0, tz="UTC")).to_numpy() / np.timedelta64(1, "h")
    if hour is not None and dates:
        of_day = [cell.partition(":")[0] for cell in table.column(hour)]
        more = _all_numbers(of_day)
        if more is None:
            raise InputError(f"{table.names[hour]}: no hours", where, TIME_REMEDY)
        hours = hours + more
    return _told(np.asarray(hours, float))


def _told(hours: FloatArray) -> tuple[FloatArray, str, str]:
    """Times, and the first and the last in words."""
    ends = [
        f"{pd.Timestamp(0) + pd.Timedelta(hours=float(end)):%Y-%m-%d %H:%M}"
        for end in (hours.min(), hours.max())
    ]
    return hours, ends[0], ends[1]


def _of_parts_of_time(
    table: TextTable, of_part: Mapping[str, int | None], where: str
) -> tuple[FloatArray, str, str]:
    """Times from a column each for the year, the month, the day and the hour."""
    given = {part: at for part, at in of_part.items() if at is not None}
    frame = pd.DataFrame({part: table.column(at) for part, at in given.items()})
    numbers = frame.apply(pd.to_numeric, errors="coerce")
    numbers["day"] = numbers.get("day", 1)
    times = pd.to_datetime(numbers[["year", "month", "day"]], errors="coerce")
    hours = (times - pd.Timestamp(0)).to_numpy() / np.timedelta64(1, "h")
    for part, unit in (("hour", 1.0), ("minute", 1 / 60)):
        if part in numbers:
            hours = hours + numbers[part].to_numpy(float) * unit
    hours = np.asarray(hours, float)
    if np.isnan(hours).any():
        line = table.rows[int(np.isnan(hours).argmax())][0]
        raise InputError("it has no date", f"{where}: line {line}", TIME_REMEDY)
    return _told(hours)


def _all_numbers(cells: Sequence[str]) -> FloatArray | None:
    """The numbers that cells are; None if one is none."""
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError:
        return None


def _times(cells: Sequence[str], table: TextTable, where: str) -> pd.DatetimeIndex:
    """The times that cells are."""
    first = next(filter(None, cells), "")
    options: dict[str, object] = {"errors": "coerce", "utc": True}
    if all(re.fullmatch(r"\d+", cell) for cell in cells) and len(first) in DIGITS:
        made = pd.to_datetime(cells, format=DIGITS[len(first)], **options)  # type: ignore[call-overload]
        if len(first) == UNIX and made.isna().any():
            seconds = np.array(cells, float)
            made = pd.to_datetime(seconds, unit="s", **options)  # type: ignore[call-overload]
    elif re.match(r"\d{4}-\d{1,2}-\d{1,2}|\d{4}/\d{1,2}", first):
        made = pd.to_datetime(cells, format="mixed", **options)  # type: ignore[call-overload]
    else:
        order = _order_of_days(cells, where)
        made = pd.to_datetime(
            cells,
            format="mixed",
            dayfirst=order,
            **options,  # type: ignore[call-overload]
        )
    times = pd.DatetimeIndex(made)
    if times.isna().any():
        at = int(times.isna().argmax())
        what = f"{cells[at]!r} is no time"
        raise InputError(what, f"{where}: line {table.rows[at][0]}", TIME_REMEDY)
    return times


def _order_of_days(cells: Sequence[str], where: str) -> bool:
    """Whether days stand before months."""
    found = [re.match(r"(\d{1,2})([./-])(\d{1,2})[./-]\d{2,4}", cell) for cell in cells]
    parts = [match for match in found if match]
    if not parts or any(match[2] == "." for match in parts):
        return True
    if any(int(match[1]) > 12 for match in parts):
        return True
    if any(int(match[3]) > 12 for match in parts):
        return False
    what = f"{cells[0]!r}: does the day or the month stand first?"
    raise InputError(what, where, TIME_REMEDY)


def _of_isd_lite(text: str) -> TextTable | None:
    """A table of ISD-Lite (NOAA), which has no head; None for another text."""
    lines = text.splitlines()
    first = next((line for line in lines if line.strip()), "")
    if not ISD_LITE.fullmatch(first.strip()):
        return None
    rows = tuple((at, line.split()) for at, line in enumerate(lines, 1) if line.strip())
    return TextTable(ISD_NAMES, 1, rows, None)


def _without_wnd(table: TextTable, where: str) -> TextTable:
    """A table with a direction and a speed in place of the column WND of ISD (NOAA).

    Its cells have the direction, its quality, the type, the speed, and its quality.
    """
    if WND not in table.names:
        return table
    at = table.names.index(WND)
    rows = []
    for line, cells in table.rows:
        parts = cells[at].split(",") if at < len(cells) else []
        if len(parts) != 5:
            what = f"{WND} has a direction, a speed and three marks in a cell"
            raise InputError(what, f"{where}: line {line}", 'as "270,1,N,0046,1"')
        way, _, kind, speed, _ = parts
        is_calm = kind == "C"
        way = "VRB" if kind == "V" else way.replace("999", "9999")
        of_wind = ["", "0"] if is_calm else [way, speed]
        rows.append((line, [*cells[:at], *cells[at + 1 :], *of_wind]))
    names = (*table.names[:at], *table.names[at + 1 :])
    return replace(table, names=(*names, "direction", ISD_SPEED), rows=tuple(rows))


def _of_wasp(text: str, where: str) -> Winds | None:
    """The winds of a table of WAsP; None for a text that is none.

    A line each has a title, a place with a height, the number of sectors, and their
    frequencies in per cent; then the upper end of each class of speeds and how many in
    a thousand of each sector it has.
    """
    lines = [line.split() for line in text.splitlines() if line.strip()]
    if len(lines) < 6:
        return None
    place, counts, shares = (_all_numbers(line) for line in lines[1:4])
    if place is None or counts is None or shares is None:
        return None
    if len(place) != 3 or len(counts) != 3 or len(shares) != counts[0]:
        return None
    sectors, factor, turn = int(counts[0]), float(counts[1]), float(counts[2])
    sums = _Sums()
    low = 0.0
    for number_of_line, line in enumerate(lines[4:], 5):
        row = _all_numbers(line)
        if row is None or len(row) != sectors + 1 or not row[0] > low:
            what = f"a class of speeds has {sectors + 1} numbers, the first rising"
            raise InputError(what, f"{where}: line {number_of_line}", "a table of WAsP")
        for sector, (part, share) in enumerate(zip(row[1:], shares, strict=True)):
            way = (turn + 360 * sector / sectors) % 360
            for step in range(PARTS):
                speed = factor * (low + (row[0] - low) * (step + 0.5) / PARTS)
                sums.add(way, rounded(speed), float(part * share) / 1e5 / PARTS)
        low = float(row[0])
    if not abs(sums.total - 1) <= 2 * OFF:
        what = f"its shares add up to {sums.total:.6g}, not to 1"
        raise InputError(what, where, "per cent by sector, and per mille in each")
    height = float(place[2])
    said = f"a table of WAsP of {counted(sectors, 'sector')}, classes spread evenly"
    return Winds(sums.rows(), height or None, said)
