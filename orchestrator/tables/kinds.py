"""What the tested thresholds were of that those of a bed are like."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from orchestrator.physics.beside import GRAIN, STRIP, SUSTAINED
from orchestrator.study.methods import METHODS
from orchestrator.study.shapes import SHAPES

INTERLOCKED = 1.05
"""u*_0 of the first grain in its row, over that of the grain alone, from which the row
holds it."""
LEAST_LENGTH = 20.0
"""Length of the strips whose intervals were found, d: shorter ones have too few
grains."""
OF_KIND = (
    "bed",
    "bed_shape",
    "profile",
    "obstacles",
    "width",
    "sizes",
    "method",
    "sheltering",
    "counted",
    "loaded_grains",
    "length",
    "h_m",
    "d_m",
    "criterion",
    "decides",
    "interlocking",
)
"""Columns that tell whether a bed is a strip, or one of grains that move alone."""


def tested_as(table: Any) -> list[str]:
    """Say what the tested thresholds were of that some are like.

    Parameters
    ----------
    table
        A table, or a mapping of columns, of thresholds with those of `OF_KIND` that
        they have; one without beds is of single grains.

    Returns
    -------
    list of str
        For each threshold `GRAIN`, `STRIP`, or nothing.
    """
    if "bed" not in table:
        return [GRAIN] * len(table["reynolds"])
    return [_kind(row) for row in _rows_of(table)]


def _kind(row: Mapping[str, Any]) -> str:
    """What one threshold is like."""
    if row.get("bed", "grain") == "grain" or _is_alone(row):
        return GRAIN
    return STRIP if _is_strip(row) else ""


def _rows_of(table: Any) -> Iterator[dict[str, Any]]:
    """The rows of a table, with the columns of `OF_KIND` that it has."""
    names = [name for name in OF_KIND if name in table]
    columns = [np.asarray(table[name], object) for name in names]
    for row in zip(*columns, strict=True):
        # what a table lacks is NaN, which is true
        known = (None if value != value else value for value in row)
        yield dict(zip(names, known, strict=True))


def _is_alone(row: Mapping[str, Any]) -> bool:
    """Whether the grains of a pile go on as single exposed ones would.

    They do where no grains are packed, in the closed form. Equal grains in rows do
    where going on holds them longest, or where the row does not hold its first grain.
    """
    if row.get("criterion") != SUSTAINED:
        return False
    if not METHODS[row["method"]].packs_grains:
        return True
    if row["sizes"] or row["width"] or row["sheltering"] != "none":
        return False
    held = row.get("interlocking")
    is_free = held is not None and held < INTERLOCKED
    return is_free or row.get("decides") == SUSTAINED


def _is_strip(row: Mapping[str, Any]) -> bool:
    """Whether a bed is a level strip like those tested, all of whose grains count."""
    # the strips that were tested have grains that leave
    if row.get("criterion") == SUSTAINED:
        return False
    # a profile and obstacles have a text
    is_level = SHAPES[row["bed_shape"]].is_level
    if not is_level or row["profile"] or row["obstacles"]:
        return False
    if row["counted"] not in (None, "all"):
        return False
    method = METHODS[row["method"]]
    is_by_pivots = method.packs_grains and not method.has_contacts
    if not row["width"] or not is_by_pivots:
        return False
    if row["loaded_grains"] != "exposed":
        return False
    length = row["length"] or 4 * row["h_m"]
    return bool(length / row["d_m"] > LEAST_LENGTH * (1 - 1e-2))
