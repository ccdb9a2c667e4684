"""Numbers and words that stand for no number in files of users."""

import math

import numpy as np

from orchestrator.types import FloatArray

EMPTY_WORDS = ("null", "nan", "*", "na", "n/a", "none", "-", "--", "---")
"""Words that stand in place of a number."""
EMPTY_MARKS = np.array(
    [99, 999, 9999, 99999, 999999, 9999999, 32767, 32768, 65535, 99.9, 99.99, 999.25,
     999.9, 999.99, 9999.9, 9999.99]
)  # fmt: skip
"""Numbers of one sign or the other that stand for no number in many files."""
ISOLATED = 10.0
"""How many times the range of all others a number that stands for none is off them, if
it stands several times."""
LOWEST_GROUND, HIGHEST_GROUND = -9000.0, 1e9
"""Below and above which no ground lies, in whatever unit of lengths."""


def looks_empty(
    values: FloatArray, step: float, slope_deg: float, lowest: float = LOWEST_GROUND
) -> tuple[float, int]:
    """Find a number of a column that stands for none.

    It is a height that no ground has, or a number so far off all others that no slope
    leads to it, if files use it so or it stands several times.

    Parameters
    ----------
    values
        The numbers in the unit of their file, all finite.
    step
        The distance between two of them, in that unit.
    slope_deg
        The steepest slope of a bed, degrees.
    lowest
        Below which no such number lies.

    Returns
    -------
    tuple
        The number, and how often it stands there; 0 times where none does.

    Examples
    --------
    >>> looks_empty(np.array([0.0, 1.0, 2.0, -9999.0]), 1.0, 60.0)
    (-9999.0, 1)
    """
    for value in (float(values.min()), float(values.max())):
        others = values[values != value]
        count = int(values.size - others.size)
        is_ground = lowest <= value <= HIGHEST_GROUND
        if not is_ground or _is_isolated(value, count, others, step, slope_deg):
            return value, count
    return math.nan, 0


def _is_isolated(
    value: float, count: int, others: FloatArray, step: float, slope_deg: float
) -> bool:
    """Whether a height is off all others as one that stands for none."""
    if not others.size:
        return False
    off = min(abs(value - float(others.min())), abs(value - float(others.max())))
    spread = float(np.ptp(others))
    if off <= max(spread, step * math.tan(math.radians(slope_deg))):
        return False
    # a height in another unit has been multiplied, and has other last digits
    is_mark = np.isclose(abs(value), EMPTY_MARKS, rtol=1e-9, atol=0.0).any()
    return bool(is_mark) or (count > 1 and off > ISOLATED * spread > 0)
