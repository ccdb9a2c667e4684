"""Heads of the tables that users give: what surveyors call the columns."""

import re
from collections.abc import Sequence
from typing import NamedTuple

EAST = ("x", "easting", "east", "rechtswert", "ostwert")
NORTH = ("y", "northing", "north", "hochwert", "nordwert")
HEIGHT = (
    "z",
    "elevation",
    "height",
    "level",
    "altitude",
    "höhe",
    "hoehe",
)
DEGREES = ("longitude", "long", "lon", "lng", "latitude", "lat")
"""Columns of angles on the Earth."""
ALONG = (*EAST, *NORTH[1:], "chainage", "distance", "station")
"""Columns of the places along a profile, which goes any way over the ground."""
SIZE = (
    "sieve",
    "sieve size",
    "size",
    "grain size",
    "particle size",
    "diameter",
    "opening",
    "aperture",
    "sieb",
    "siebweite",
    "maschenweite",
    "korngröße",
    "durchmesser",
)
"""Columns of the openings of sieves or of the diameters of classes."""
PASSES = ("passing", "finer", "durchgang", "siebdurchgang")
"""Columns of the part of the mass that passes a sieve, in per cent."""
PER_CENT = re.compile(r"[(\[ _]*(per ?cent|pct|%)[)\] _]*")
METRE = ("m", "metre", "metres", "meter", "meters")
UNITS = {
    **dict.fromkeys(METRE, 1.0),
    **dict.fromkeys(("ft", "foot", "feet", "ift"), 0.3048),
    **dict.fromkeys(("usft", "ftus", "us-ft", "us_ft", "sft"), 1200 / 3937),
    **dict.fromkeys(("um", "µm", "μm"), 1e-6),
    "mm": 1e-3,
    "cm": 1e-2,
    "dm": 0.1,
    "km": 1e3,
}
"""Units that a name may end with, m."""
UNIT = re.compile(
    rf"[ _,]*[(\[] *({'|'.join(UNITS)}) *[)\]]$|[ _,]+({'|'.join(UNITS)})$"
)


class Name(NamedTuple):
    """The name of a column.

    Attributes
    ----------
    plain
        The name in small letters, without its unit.
    unit
        The unit that it has, as it stands there; empty without one.
    """

    plain: str
    unit: str

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
        The name and its unit.

    Examples
    --------
    >>> name_of("Easting (m)"), name_of("z_ft")
    (Name(plain='easting', unit='m'), Name(plain='z', unit='ft'))
    """
    name = cell.strip().lower()
    unit = UNIT.search(name)
    if unit is None:
        return Name(name, "")
    return Name(name[: unit.start()], unit[1] or unit[2])


def is_size(cell: str) -> bool:
    """Tell whether a column has sizes of grains in a unit that its name states.

    Parameters
    ----------
    cell
        A cell of the head of a table.

    Returns
    -------
    bool
        Whether it has.
    """
    name = name_of(cell)
    return name.plain in SIZE and bool(name.unit)


def is_passing(cell: str) -> bool:
    """Tell whether a column has the per cent that passes a sieve.

    Parameters
    ----------
    cell
        A cell of the head of a table.

    Returns
    -------
    bool
        Whether it has.

    Examples
    --------
    >>> [is_passing(cell) for cell in ("Passing (%)", "% finer", "passing")]
    [True, True, False]
    """
    name, marks = PER_CENT.subn("", cell.strip().lower())
    return name in PASSES and marks == 1


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
