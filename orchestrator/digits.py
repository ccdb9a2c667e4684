"""Numbers with as many digits as mean something, so that all processors have the same.

The vector units of two processors, and two C libraries, differ in the last digit of a
sine, an exponential or a sum. A bed of grains is chaotic: with another last digit it is
another bed. So what a solver is given, what the name of a case is made of, and what
decides between two branches is rounded to nine digits where it is made, and tables are
written with nine. Two processors then differ only where a number lies within their
last digits of the middle between two numbers of nine digits, once in some ten millions.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.types import FloatArray

DIGITS = 9
FORMAT = f"%.{DIGITS}g"
"""Format of a number in an input of a solver."""
SLACK = 1e-6
"""How near a ratio is to a whole number that it stands for.

Where a length is a whole number of others, its last digit must not add one.
"""


def rounded(value: float) -> float:
    """Round a number to nine digits.

    Parameters
    ----------
    value
        Any number; NaN and infinity stay what they are.

    Returns
    -------
    float
        The number that its nine digits stand for.

    Examples
    --------
    >>> rounded(0.1 + 0.2)
    0.3
    """
    return float(FORMAT % value)


def text(value: float) -> str:
    """Write a number with nine digits at most, and a point.

    Parameters
    ----------
    value
        Any number.

    Returns
    -------
    str
        As few digits as tell the rounded number from its neighbours.

    Examples
    --------
    >>> text(2 / 3), text(15.0)
    ('0.666666667', '15.0')
    """
    return repr(rounded(value))


def all_rounded(values: ArrayLike) -> FloatArray:
    """Round each of some numbers to nine digits of its own.

    Parameters
    ----------
    values
        Numbers in an array of any shape.

    Returns
    -------
    FloatArray
        The rounded numbers, of the same shape.

    Examples
    --------
    >>> all_rounded([1 / 3, 1e-17 / 3]).tolist()
    [0.333333333, 3.33333333e-18]
    """
    array = np.asarray(values, float)
    each = [float(FORMAT % value) for value in array.ravel().tolist()]
    return np.array(each).reshape(array.shape)


def on_grid(values: ArrayLike, unit: float = 0.0, digits: int = DIGITS) -> FloatArray:
    """Round numbers that have one unit to some digits of that unit.

    Of coordinates, differences and components a small one is known no better than a
    large one: its own ninth digit may be the last digit of what it is a difference of.

    Parameters
    ----------
    values
        Numbers in an array of any shape.
    unit
        A number whose leading digit counts as the first one; by default the largest of
        the values.
    digits
        How many digits are left.

    Returns
    -------
    FloatArray
        The rounded numbers, of the same shape, none of them -0.0.

    Examples
    --------
    >>> on_grid([10.0, 3e-17, 1 / 3]).tolist()
    [10.0, 0.0, 0.3333333]
    """
    array = np.asarray(values, float)
    unit = unit or float(np.abs(array).max(initial=0.0))
    if not unit:
        return np.zeros_like(array)
    # the slack makes one decade of 0.1 and of the next smaller number
    decimals = digits - 1 - int(np.floor(np.log10(unit) + SLACK))
    return np.round(array, decimals) + 0.0


def whole_up(value: float) -> int:
    """Count up to a whole number, but for `SLACK`.

    Parameters
    ----------
    value
        A ratio.

    Returns
    -------
    int
        The least whole number that is not below it, or is below it by `SLACK` at most.

    Examples
    --------
    >>> whole_up(0.3 / 0.1), whole_up(0.7 / 0.1), whole_up(7.1)
    (3, 7, 8)
    """
    return int(np.ceil(value - SLACK))


def number(count: int, noun: str) -> str:
    """Write how many things there are.

    Parameters
    ----------
    count
        How many.
    noun
        What they are, in the singular.

    Returns
    -------
    str
        The number with its noun.

    Examples
    --------
    >>> number(1, "case"), number(3, "case")
    ('1 case', '3 cases')
    """
    if count == 1:
        return f"{count} {noun}"
    return f"{count} {noun}s"


def enumerated(words: Sequence[str]) -> str:
    """Write several things one after the other.

    Parameters
    ----------
    words
        What they are.

    Returns
    -------
    str
        The words, with "and" before the last.

    Examples
    --------
    >>> enumerated(["slope"]), enumerated(["slope", "size", "law"])
    ('slope', 'slope, size and law')
    """
    return " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def percent(part: float, decimals: int = 0) -> str:
    """Write a part of a whole in percent.

    Parameters
    ----------
    part
        The part; 1 is the whole.
    decimals
        Digits behind the point.

    Returns
    -------
    str
        Percent, whole by default.

    Examples
    --------
    >>> percent(0.3), percent(0.057, 1)
    ('30 %', '5.7 %')
    """
    return f"{100 * part:.{decimals}f} %"


def signed_percent(change: float) -> str:
    """Write a relative change in percent.

    Parameters
    ----------
    change
        The change; 1 is as much again.

    Returns
    -------
    str
        Whole percent with its sign.

    Examples
    --------
    >>> signed_percent(-0.76), signed_percent(0.4)
    ('−76 %', '+40 %')
    """
    return f"{change:+.0%}".replace("%", " %").replace("-", "−")


RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Digits of an exponent."""


def plain_number(value: float, digits: int = 3) -> str:
    """Write a number for a reader.

    Parameters
    ----------
    value
        The number.
    digits
        Digits that matter.

    Returns
    -------
    str
        Below a thousandth and from a hundred thousand on with a power of ten.

    Examples
    --------
    >>> [plain_number(value) for value in (1e-5, 1.4607e-5, -0.05, 11923.0)]
    ['1.0 × 10⁻⁵', '1.46 × 10⁻⁵', '−0.05', '11900']
    """
    if value == 0 or not np.isfinite(value) or 1e-3 <= abs(value) < 1e5:
        return f"{float(f'{value:.{digits}g}'):.15g}".replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    whole, _, rest = mantissa.partition(".")
    rest = rest.rstrip("0") or "0"
    power = str(int(exponent)).translate(RAISED)
    return f"{whole}.{rest} × 10{power}".replace("-", "−")


def metres(value: float, digits: int = 3) -> str:
    """Write a length for a reader: in metres from 1 m on, else in millimetres.

    Parameters
    ----------
    value
        The length, m.
    digits
        Digits that matter.

    Returns
    -------
    str
        The text.

    Examples
    --------
    >>> metres(40.0), metres(3e-4), metres(-0.05)
    ('40 m', '0.3 mm', '−50 mm')
    """
    if abs(value) >= 1:
        return f"{plain_number(value, digits)} m"
    return f"{plain_number(1e3 * value, digits)} mm"
