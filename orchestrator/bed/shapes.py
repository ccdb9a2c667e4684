"""Makers of bed lines."""

from functools import cache
from math import radians, tan

from orchestrator.bed.line import BedLine

UPSTREAM, DOWNSTREAM = 10.0, 20.0
"""Flat bed before and behind a form, in heights of it."""


@cache
def triangle(slope_deg: float, height: float) -> BedLine:
    """A pile with two faces of one slope (degrees) across the flow, the paper's bed."""
    face = height / tan(radians(slope_deg))
    x = (-UPSTREAM * height, 0.0, face, 2 * face, 2 * face + DOWNSTREAM * height)
    return BedLine(x, (0.0, 0.0, height, 0.0, 0.0))
