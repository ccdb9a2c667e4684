"""Units of lengths in files of users: their names, and the columns that have them.

A unit stands behind the name of a column, in a line below the names, or in a line above
them that says so of the whole file. All readers ask this module.
"""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from orchestrator.errors import InputError

FOOT, SURVEY_FOOT, INCH = 0.3048, 1200 / 3937, 0.0254
"""The international foot, that of surveys in the United States, and the inch, m."""
METRE = (
    "m",
    "metre",
    "metres",
    "meter",
    "meters",
    "metern",
    "mètre",
    "mètres",
    "metro",
    "metros",
)
FEET = (
    "ft",
    "foot",
    "feet",
    "ift",
    "int ft",
    "intl ft",
    "international foot",
    "international feet",
    "fuß",
    "'",
    "′",
    "pieds",
    "pies",
)
SURVEY_FEET = (
    "usft",
    "ftus",
    "us-ft",
    "us_ft",
    "us ft",
    "sft",
    "us foot",
    "us feet",
    "foot_us",
    "foot us",
    "survey ft",
    "survey feet",
    "us survey ft",
    "us survey foot",
    "us survey feet",
    "u.s. survey foot",
    "u.s. survey feet",
)
INCHES = ("in", "inch", "inches", "zoll", "pouces", "pulgadas", '"', "″", "''")
MICRONS = ("um", "µm", "μm", "micron", "microns", "micrometer", "micrometre")
MILLIMETRES = ("mm", "millimeter", "millimeters", "millimetre", "millimetres")
CENTIMETRES = ("cm", "centimeter", "centimeters", "centimetre", "centimetres")
DECIMETRES = ("dm", "decimeter", "decimeters", "decimetre", "decimetres")
KILOMETRES = ("km", "kilometer", "kilometers", "kilometre", "kilometres")
LENGTHS = {
    **dict.fromkeys(METRE, 1.0),
    **dict.fromkeys(FEET, FOOT),
    **dict.fromkeys(SURVEY_FEET, SURVEY_FOOT),
    **dict.fromkeys(INCHES, INCH),
    **dict.fromkeys(("yd", "yard", "yards"), 3 * FOOT),
    **dict.fromkeys(MICRONS, 1e-6),
    **dict.fromkeys(MILLIMETRES, 1e-3),
    **dict.fromkeys(CENTIMETRES, 1e-2),
    **dict.fromkeys(DECIMETRES, 0.1),
    **dict.fromkeys(KILOMETRES, 1e3),
}
"""Units of lengths by the names that files use, in small letters, m."""
UNIT_NAMES = "|".join(sorted(map(re.escape, LENGTHS), key=len, reverse=True))
"""Their names as a pattern, the longest first."""
OF_ALL = re.compile(
    r"\b(?:(?:length )?units?(?: of length)?|einheit(?:en)?|unités?|unidades)\b"
    rf"(?: are| is)?(?: in)?\W+(?P<one>{UNIT_NAMES})(?![\w.])"
    r"|\b(?:all|lengths|coordinates|dimensions|values)(?: are)?(?: all)?(?: given)?"
    rf" in (?P<other>{UNIT_NAMES})(?![\w.])"
)
"""Words above a table that name the unit of all its lengths."""
OF_SOME = re.compile(r"vertical|horizontal|height|elev|level|depth|\b[xyz]\b")
"""Words of a line that is of some lengths alone."""
OTHERS = sorted(
    (unit for unit in LENGTHS if unit not in (*METRE, "in") and unit[0].isalpha()),
    key=len,
    reverse=True,
)
MENTIONED = re.compile(
    rf"(?<![\w.%])(?<!\d[ -])({'|'.join(map(re.escape, OTHERS))})(?![\w/])"
)
"""Another unit than the metre, which is not that of a number before it."""


class Lengths(NamedTuple):
    """The units of some columns.

    Attributes
    ----------
    axes
        What the columns are called in words: x, y, z.
    units
        Their units as the file names them; the metre where it names none.
    """

    axes: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def factors(self) -> tuple[float, ...]:
        """Their units, m."""
        return tuple(LENGTHS[unit] for unit in self.units)

    @property
    def said(self) -> str:
        """What was understood of them, in words."""
        if len({*self.factors}) == 1:
            return f"in {shown_unit(self.units[0])}"
        each = zip(self.axes, self.units, strict=True)
        return ", ".join(f"{axis} in {shown_unit(unit)}" for axis, unit in each)


def shown_unit(unit: str, base: str = "m") -> str:
    """Show a unit, and how long it is.

    Parameters
    ----------
    unit
        One of `LENGTHS`.
    base
        The unit in which its length is shown.

    Returns
    -------
    str
        The words.

    Examples
    --------
    >>> shown_unit("ft"), shown_unit("metres"), shown_unit("in", "mm")
    ('ft (1 ft = 0.3048 m)', 'm', 'in (1 in = 25.4 mm)')
    """
    size = LENGTHS[unit] / LENGTHS[base]
    return base if size == 1 else f"{unit} (1 {unit} = {size:.7g} {base})"


def lengths_of(
    columns: Sequence[tuple[str, str, str]], before: Iterable[str], place: str
) -> Lengths:
    """Find the units of the columns of lengths of a table.

    Parameters
    ----------
    columns
        Of each its axis, its name, and the unit that this has, empty for none.
    before
        The lines above the names.
    place
        The file and the line of the names, for messages.

    Returns
    -------
    Lengths
        The units. They are metres where the file names none.

    Raises
    ------
    InputError
        If some columns have another unit than the metre and others none, or a line
        above them has another one than they.
    """
    lines = [" ".join(line.lower().split()) for line in before]
    of_all = {unit for line in lines for unit in _of_all(line)}
    given = {unit for _, _, unit in columns if unit}
    sizes = {LENGTHS[unit] for unit in of_all | given}
    if of_all and len(sizes) > 1:
        listed = " and ".join(sorted(of_all | given))
        what = f"which unit: {listed} stand in its head"
        raise InputError(what, place, _remedy(columns))
    if not given and not of_all:
        found = (MENTIONED.search(line) for line in lines)
        unit = next((match[1] for match in found if match), "")
        if unit:
            what = f"a line above speaks of {unit}, and no column names its unit"
            raise InputError(what, place, _remedy(columns))
    common = next(iter(of_all), "")
    units = tuple(unit or common for _, _, unit in columns)
    bare = [name for (_, name, _), unit in zip(columns, units, strict=True) if not unit]
    others = [
        f"{name.strip()} is in {unit}"
        for (_, name, _), unit in zip(columns, units, strict=True)
        if unit and LENGTHS[unit] != 1
    ]
    if bare and others:
        what = f"{others[0]}, and {bare[0].strip()} names no unit"
        raise InputError(what, place, _remedy(columns))
    return Lengths(
        tuple(axis for axis, _, _ in columns), tuple(unit or "m" for unit in units)
    )


def _of_all(line: str) -> list[str]:
    """The units that a line names for all lengths."""
    if OF_SOME.search(line):
        return []
    return [match["one"] or match["other"] for match in OF_ALL.finditer(line)]


def _remedy(columns: Sequence[tuple[str, str, str]]) -> str:
    """How the unit of a column is named."""
    names = [name.strip() for _, name, unit in columns if not unit]
    name = names[0] if names else columns[0][1].strip()
    return f"write the unit of each column behind its name: {name} (m), {name} (ft)"
