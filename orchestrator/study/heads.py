"""Heads of the tables that users give: what surveyors call the columns."""

import re
from collections.abc import Sequence
from typing import NamedTuple

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
METRE = ("m", "metre", "metres", "meter", "meters")
UNITS = {
    **dict.fromkeys(METRE, 1.0),
    **dict.fromkeys(("ft", "foot", "feet", "ift"), 0.3048),
    **dict.fromkeys(("usft", "ftus", "us-ft", "us_ft", "sft"), 1200 / 3937),
    **dict.fromkeys(
        ("um", "µm", "μm", "micron", "microns", "micrometer", "micrometre"), 1e-6
    ),
    **dict.fromkeys(("mm", "millimeter", "millimetre", "millimetres"), 1e-3),
    "cm": 1e-2,
    "dm": 0.1,
    "km": 1e3,
}
"""Units that a name may end with, m."""
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
_UNIT = "|".join(sorted(map(re.escape, UNITS), key=len, reverse=True))
_DATUM = "|".join(sorted(map(re.escape, DATUMS), key=len, reverse=True))
UNIT = re.compile(rf"[ _,/]*[(\[] *({_UNIT}) *[)\]]$|(?: in|[ _,/])[ _,/]*({_UNIT})$")
WITH_DATUM = re.compile(
    rf"(?:^|[ _,]*[(\[] *|[ _,]+)(?P<unit>{_UNIT})?(?(unit)[ +_,.]*|\+?)"
    rf"(?:ü\. ?|ue\. ?|über |above |a\. ?|to )?(?P<datum>{_DATUM}) *[)\]]?$"
)
"""A unit and a datum at the end of a name, or as a whole name."""
UNIT_CELL = re.compile(
    rf"[(\[ ]*(?:{_UNIT}|%|mass ?%|wt ?%|g|kg|phi|φ|-|m/s|km/h|kn|kt|kts|knots|mph|"
    rf"deg|degrees|°|h|hours|(?:{_UNIT})[ +]*(?:{_DATUM}))[)\] ]*"
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

    @property
    def is_in_metres(self) -> bool:
        """Whether no other unit than the metre stands there."""
        return not self.unit or self.unit in METRE


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
        plain = _plain(name[: levelled.start()])
        plain = "level" if plain in ("", "h") else plain
        return Name(plain, levelled["unit"] or "", levelled["datum"].upper())
    unit = UNIT.search(name)
    if unit is None:
        return Name(_plain(name), "")
    return Name(_plain(name[: unit.start()]), unit[1] or unit[2])


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


def in_metres(names: Sequence[str]) -> str:
    """Say how columns in another unit are to be given.

    Parameters
    ----------
    names
        Cells of a head.

    Returns
    -------
    str
        The advice; empty where no column has another unit.
    """
    for cell in names:
        unit = name_of(cell).unit
        if unit and unit not in METRE:
            return f"multiply {cell.strip()} by {UNITS[unit]:.7g}: lengths are in m"
    return ""


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
