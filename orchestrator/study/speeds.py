"""Units of speeds in files of winds: their names, and lines above a table with one.

A line above the names of the columns may say in which unit the speeds are. It is taken
where it can mean nothing else, and asked about where it may.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from orchestrator.errors import InputError
from orchestrator.study.cells import COMMENT
from orchestrator.study.lengths import FOOT

SPEEDS: Mapping[str, float] = {
    **dict.fromkeys(("0.1 m/s", "0,1 m/s", "1/10 m/s", "dm/s"), 0.1),
    "cm/s": 0.01,
    **dict.fromkeys(
        (
            "m/s",
            "m s-1",
            "m.s-1",
            "m s^-1",
            "m s⁻¹",
            "ms-1",
            "m_s",
            "m/sec",
            "mps",
            "metres per second",
            "meters per second",
        ),
        1.0,
    ),
    **dict.fromkeys(
        (
            "km/h",
            "km_h",
            "km/hr",
            "km h-1",
            "kmh",
            "kph",
            "kilometres per hour",
            "kilometers per hour",
        ),
        1 / 3.6,
    ),
    **dict.fromkeys(("knots", "knot", "kts", "kt", "kn", "knoten"), 1852 / 3600),
    **dict.fromkeys(("mph", "mi/h", "miles per hour"), 0.44704),
    **dict.fromkeys(("ft/s", "ft/sec", "fps", "feet per second"), FOOT),
}
"""Units of speeds by the names that files use, in small letters, m/s."""
_UNIT = "|".join(map(re.escape, SPEEDS))
SPEED_UNIT = re.compile(
    rf"(?<![a-z0-9])[(\[]?({_UNIT})[)\]]?(?![a-z0-9])", re.IGNORECASE
)
"""A unit of speeds."""
_BEHIND_NUMBER = re.compile(r"(?<![^\W\d_])\d+(?:[.,]\d+)? ?$")
"""A number, whose unit that behind it is: a speed, and no unit of others."""
_OF_SPEEDS = re.compile(
    r"\b(?:\w*speeds?|\w*winds?|units?|values|ws|wspd|ff|velocit(?:y|ies)|einheit(?:en)?"
    r"|\w*geschwindigkeit(?:en)?|\w*snelheid|eenheid|unités?|vitesses?|unidades"
    r"|velocidad(?:es)?)\b"
)
"""Words of a line that is of the speeds of a table."""
_OF_OTHERS = re.compile(
    r"gust|böe|stoot|rafale|ráfaga|peak|\bmax|\bminimum|current|threshold|start"
    r"|calm|resol|accura|precis|error|convert|\bfrom\b|\bnot?\b|origin|below"
    r"|above(?! (?:the )?(?:ground|sea|surface))"
)
"""Words of a line that may be of others, or of a unit that was."""
_NOT_KNOWN = re.compile(r"\b(?:beaufort|bft|tenths?|zehntel|tienden?|dixièmes?)\b")
"""Units of speeds that are not read."""


class SpeedLine(NamedTuple):
    """A line above a table with a unit of speeds.

    Attributes
    ----------
    line
        Its number, from 1.
    unit
        One of `SPEEDS`, or another word, which is not read.
    is_certain
        Whether it is that of the speeds of the table and of nothing else.
    """

    line: int
    unit: str
    is_certain: bool


def unit_above(
    before: Iterable[str], named: str, column: str, where: str
) -> tuple[str, int] | None:
    """Find the unit of speeds that the lines above a table name.

    Parameters
    ----------
    before
        The lines above the names of its columns.
    named
        The unit that a column of speeds has by its name; empty for none.
    column
        That name.
    where
        The file, for messages.

    Returns
    -------
    tuple or None
        The unit, one of `SPEEDS`, and the number of the line; None where no line names
        the unit of all speeds.

    Raises
    ------
    InputError
        If a line contradicts the column, two units are named, or it is not certain of
        what a unit is.
    """
    found = [each for at, line in enumerate(before, 1) for each in _units(line, at)]
    certain = [each for each in found if each.is_certain and each.unit in SPEEDS]
    of_first = SPEEDS[certain[0].unit] if certain else 1.0
    remedy = f"name it behind the column: {column} (km/h), and mend the line"
    for each in certain[1:]:
        if SPEEDS[each.unit] != of_first:
            what = f"which unit have the speeds: {certain[0].unit} or {each.unit}?"
            raise InputError(what, f"{where}: line {each.line}", remedy)
    if certain and named and SPEEDS[named] != of_first:
        what = f"speeds in {certain[0].unit}, and {column!r} is in {named}"
        remedy = "leave the unit that is right"
        raise InputError(what, f"{where}: line {certain[0].line}", remedy)
    if certain:
        return certain[0].unit, certain[0].line
    for each in () if named else found:
        if SPEEDS.get(each.unit) != 1:
            what = f"it speaks of {each.unit}, and {column!r} names no unit"
            remedy = f"write the unit of its speeds behind it: {column} (m/s)"
            raise InputError(what, f"{where}: line {each.line}", remedy)
    return None


def _units(line: str, at: int) -> Iterator[SpeedLine]:
    """The units of speeds that a line names, but for those of a number."""
    words = " ".join(COMMENT.sub("", line).lower().split())
    found = [
        match
        for match in SPEED_UNIT.finditer(words)
        if not _BEHIND_NUMBER.search(words[: match.start(1)])
    ]
    is_of_speeds = bool(_OF_SPEEDS.search(words))
    other = _NOT_KNOWN.search(words)
    if other and (found or is_of_speeds):
        yield SpeedLine(at, other[0], False)
        return
    is_certain = is_of_speeds and not _OF_OTHERS.search(words)
    for match in found:
        is_alone = match[0] == words
        yield SpeedLine(at, match[1], is_certain or is_alone)
