"""Numbers and ranges of the command line: ``2e-4``, ``d/30``, ``1e-4:2e-3:20``."""

import itertools
import math
import re
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from orchestrator.calculator.parameters import ROUGHNESS, Parameter
from orchestrator.errors import InputError

MOST_POINTS = 100_000
FORM = "write FIRST:LAST:COUNT, such as 1e-4:2e-3:20"

Value = float | str
"""A number, or a part of the diameter such as ``d/30``."""


def values(parameter: Parameter, text: str) -> list[Value]:
    """The values that a text gives to a parameter.

    Parameters
    ----------
    parameter : Parameter
        Whether it takes parts of the diameter, and how a range of it is spaced.
    text : str
        A number; or a range ``FIRST:LAST:COUNT``, both ends included.

    Raises
    ------
    InputError
        If it is neither.
    """
    parts = text.split(":")
    if len(parts) == 1:
        return [text if parameter is ROUGHNESS and _shares(parts) else _number(text, parameter)]
    if len(parts) != 3:
        raise InputError(f"{text!r} is not a range", remedy=FORM)
    ends, count = parts[:2], parts[2]
    if parameter is ROUGHNESS and (shares := _shares(ends)):
        return [f"d/{1 / share:.12g}" for share in _spaced(shares, count, text, geometric=True)]
    numbers = [_number(end, parameter) for end in ends]
    return [*_spaced(numbers, count, text, geometric=parameter.geometric)]


def grid(axes: Mapping[str, Sequence[Value]]) -> pd.DataFrame:
    """Every combination of the values, the last axis fastest; one column for each axis.

    Raises
    ------
    InputError
        If there are more than 100,000.
    """
    count = math.prod(len(axis) for axis in axes.values())
    if count > MOST_POINTS:
        raise InputError(
            f"the ranges have {count} points together, more than {MOST_POINTS}",
            where="threshold",
            remedy="lower a COUNT",
        )
    return pd.DataFrame(itertools.product(*axes.values()), columns=list(axes))


def _spaced(ends: Sequence[float], count_text: str, text: str, *, geometric: bool) -> list[float]:
    (first, last), count = ends, _number(count_text)
    if not (math.isfinite(first) and math.isfinite(last)):
        raise InputError(f"{text!r} does not end at finite numbers", remedy=FORM)
    if not first < last:
        raise InputError(f"{text!r} does not rise from its first to its last value", remedy=FORM)
    if not count.is_integer() or count < 2:
        raise InputError(f"{count_text!r} is not a count of values from 2 up", remedy=FORM)
    if count > MOST_POINTS:
        raise InputError(f"{count_text} values are more than {MOST_POINTS}", remedy="lower COUNT")
    space = np.geomspace if geometric and first > 0 else np.linspace
    # a range wider than all floats ends in values that the scene refuses
    with np.errstate(all="ignore"):
        return [float(value) for value in space(first, last, int(count))]


def _number(text: str, parameter: Parameter | None = None) -> float:
    try:
        return float(text)
    except ValueError:
        remedy = "write a number in SI units, such as 2e-4; or a range FIRST:LAST:COUNT"
        if parameter is ROUGHNESS:
            remedy = 'write metres, or a part of the diameter as "d/30"; or a range of either'
        raise InputError(f"{text!r} is not a number", remedy=remedy) from None


def _shares(texts: Sequence[str]) -> list[float]:
    """The parts of the diameter that texts such as ``d/30`` mean; none if one means none."""
    matches = [re.fullmatch(r"\s*d\s*/\s*(\d+(?:\.\d+)?)\s*", text) for text in texts]
    numbers = [float(match[1]) for match in matches if match]
    sound = len(numbers) == len(texts) and all(0 < number < math.inf for number in numbers)
    return [1 / number for number in numbers] if sound else []
