"""Heads of the tables that users give: what surveyors call the columns."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from orchestrator.study.lengths import UNIT_NAMES

EAST = (
    "x",
    "easting",
    "east",
    "rechtswert",
    "ostwert",
    "x coord",
    "x coordinate",
    "point x",
)
NORTH = (
    "y",
    "northing",
    "north",
    "hochwert",
    "nordwert",
    "y coord",
    "y coordinate",
    "point y",
)
HEIGHT = (
    "z",
    "z coord",
    "z coordinate",
    "point z",
    "elevation",
    "elev",
    "elev.",
    "height",
    "level",
    "altitude",
    "rl",
    "r.l.",
    "reduced level",
    "bed level",
    "bed elevation",
    "ground level",
    "ground elevation",
    "surface elevation",
    "existing grade",
    "ground",
    "höhe",
    "hoehe",
    "geländehöhe",
    "sohlhöhe",
    "hoogte",
    "cote",
    "cota",
    "quota",
)
DEPTHS = ("depth", "tiefe", "diepte", "profondeur", "profundidad", "sounding")
"""Columns of lengths downwards, which are no heights."""
DEGREES = ("longitude", "long", "lon", "lng", "latitude", "lat")
"""Columns of angles on the Earth."""
ALONG_LINE = (
    "chainage",
    "ch",
    "ch.",
    "chain.",
    "distance",
    "dist",
    "dist.",
    "station",
    "sta",
    "sta.",
    "stationing",
    "stationierung",
    "offset",
    "abstand",
    "distanz",
    "afstand",
    "distancia",
)
"""Columns of the places along a line of levels."""
ALONG = (*EAST, *NORTH[1:], *ALONG_LINE)
"""Columns of the places along a profile, which goes any way over the ground."""
DATUMS = (
    "nap",
    "aod",
    "odn",
    "odm",
    "od",
    "ahd",
    "nhn",
    "nn",
    "navd88",
    "navd 88",
    "ngvd29",
    "ngvd 29",
    "amsl",
    "masl",
    "msl",
    "asl",
    "mllw",
    "mlw",
    "lat",
    "cd",
    "taw",
    "dng",
    "ln02",
    "lhn95",
    "ngf",
    "ign69",
    "rh2000",
    "rh 2000",
    "dvr90",
    "nn2000",
    "n2000",
    "evrf2007",
    "egm96",
    "egm2008",
    "wgs84",
    "cgvd28",
    "cgvd2013",
    "nzvd2016",
    "dhhn92",
    "dhhn2016",
)
"""Surfaces from which levels are counted, as they stand behind a unit."""
_DATUM = "|".join(sorted(map(re.escape, DATUMS), key=len, reverse=True))
UNIT = re.compile(
    rf"[ _,/]*[(\[] *(?:in )?({UNIT_NAMES}) *[)\]]$|"
    rf"(?: in|[ _,/-])[ _,/]*({UNIT_NAMES})[)\]]?$"
)
WITH_DATUM = re.compile(
    rf"(?:^|[ _,]*[(\[] *|[ _,]+)(?P<unit>{UNIT_NAMES})?(?(unit)[ +_,.]*|\+?)"
    rf"(?:ü\. ?|ue\. ?|über |above |a\. ?|to )?(?P<datum>{_DATUM}) *[)\]]?$"
)
"""A unit and a datum at the end of a name, or as a whole name."""
UNIT_CELL = re.compile(
    rf"[(\[ ]*(?:{UNIT_NAMES}|%|mass ?%|wt ?%|g|kg|phi|φ|-|m/s|km/h|kn|kt|kts|knots|"
    rf"mph|deg|degrees|°|h|hours|(?:{UNIT_NAMES})[ +]*(?:{_DATUM}))[)\] ]*"
)
"""A cell of a line of units below the names."""


class Name(NamedTuple):
    """The name of a column.

    Attributes
    ----------
    plain
        The name in small letters, without its unit.
    unit
        The unit that it has, as it stands there; empty without one.
    datum
        The surface from which levels are counted, in capitals; empty without one.
    """

    plain: str
    unit: str
    datum: str = ""


def name_of(cell: str) -> Name:
    """Read the name of a column.

    Parameters
    ----------
    cell
        A cell of the head of a table.

    Returns
    -------
    Name
        The name, its unit and its datum. A unit with a datum alone is a level.

    Examples
    --------
    >>> name_of("Easting (m)")[:2], name_of("z_ft")[:2]
    (('easting', 'm'), ('z', 'ft'))
    >>> name_of("Level (mAOD)")
    Name(plain='level', unit='m', datum='AOD')
    """
    name = " ".join(cell.strip().lower().split())
    levelled = WITH_DATUM.search(name)
    if levelled and (levelled["unit"] or levelled.start()):
        return _level(name, levelled, levelled["unit"] or "")
    found = UNIT.search(name)
    if found is None:
        return Name(_plain(name), "")
    unit, rest = found[1] or found[2], name[: found.start()]
    # the datum may stand before the unit: Elevation (NAVD88, ft)
    levelled = WITH_DATUM.search(rest)
    return _level(rest, levelled, unit) if levelled else Name(_plain(rest), unit)


def _level(name: str, levelled: re.Match[str], unit: str) -> Name:
    """The name of a column of levels above a datum."""
    plain = _plain(name[: levelled.start()])
    plain = "level" if plain in ("", "h") else plain
    return Name(plain, unit, levelled["datum"].upper())


def _plain(name: str) -> str:
    """A name without the blanks and lines between its words."""
    bare = name.replace("_", " ").strip(" (")
    return bare.removesuffix(" above datum").strip()


def one_word(names: Sequence[str]) -> str:
    """List names of columns in a message: those of one word, not shortened.

    Parameters
    ----------
    names
        The names.

    Returns
    -------
    str
        The names between commas.
    """
    return ", ".join(name for name in names if not re.search(r"[ .]", name))


def more_cells(cells: int, of_head: int) -> str:
    """Say that a line has more cells than the head of its table.

    Parameters
    ----------
    cells
        How many cells the line has.
    of_head
        How many the head has, or the first line of a table without one.

    Returns
    -------
    str
        What is wrong with the line.
    """
    what = f"{cells} cells, the head has {of_head}"
    return f"{what}: a decimal comma? Write a decimal point"
