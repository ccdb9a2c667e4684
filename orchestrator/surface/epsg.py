"""Units of coordinate systems of the EPSG registry, by their codes.

`epsg_units.csv` lists the systems in another unit than the metre, of version 11.022 of
the registry. Those on the ground are of the axes, the vertical ones of the heights.
"""

import csv
from functools import cache
from pathlib import Path

TABLE = Path(__file__).with_name("epsg_units.csv")
PROJECTED, VERTICAL = "projected", "vertical"


@cache
def _ranges() -> tuple[tuple[str, int, int, float], ...]:
    """What is listed: the axes, the first and the last code, and the unit, m."""
    with TABLE.open(encoding="utf-8", newline="") as stream:
        return tuple(
            (row["axes"], int(row["first"]), int(row["last"]), float(row["metres"]))
            for row in csv.DictReader(stream)
        )


def unit_of(axes: str, code: int | None) -> float:
    """Find the unit of a coordinate system.

    Parameters
    ----------
    axes
        `PROJECTED` or `VERTICAL`.
    code
        Its code; None for a system that has none.

    Returns
    -------
    float
        The unit, m; 1 of a system that is not listed.

    Examples
    --------
    >>> unit_of("projected", 32632), unit_of("projected", 2273)
    (1.0, 0.3048)
    """
    for kind, first, last, metres in _ranges():
        if kind == axes and code is not None and first <= code <= last:
            return metres
    return 1.0
