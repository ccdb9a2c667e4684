"""Sizes of the grains of a mixture: a sieve table, or a log-normal distribution by mass."""

from math import log
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from scipy.special import ndtr, ndtri

FloatArray = NDArray[np.float64]

Sieve = tuple[tuple[float, float], ...]
"""Classes of a sieve table: diameter, m, rising, and fraction of the mass."""
LARGEST_RATIO = 10.0
"""Largest ratio of the largest to the smallest grain: neighbour lists reach as far as two of the
largest, so that their length, and the time of a run, rise with its square."""
HEAD = ("diameter_m", "fraction")
"""Columns of a file with a sieve table."""
SUM = 1e-6
"""How far from 1 the fractions of a sieve table may add up."""


class LogNormal(BaseModel):
    """A log-normal distribution by mass, whose median is the grain diameter."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    sigma_g: Annotated[float, Field(ge=1.001, le=3)]
    smallest: Annotated[float | None, Field(ge=0.1, le=1)] = None
    largest: Annotated[float | None, Field(ge=1, le=10)] = None

    @property
    def ends(self) -> tuple[float, float]:
        """Cut-offs over the median; by default two geometric standard deviations."""
        return self.smallest or self.sigma_g**-2, self.largest or self.sigma_g**2

    def __str__(self) -> str:
        low, high = self.ends
        return f"log-normal, sigma_g {self.sigma_g:g}, {low:.3g} to {high:.3g} d50"


Sizes = LogNormal | Sieve


def fault(sizes: Sizes) -> str | None:
    """A fault of a mixture, if there is one."""
    if isinstance(sizes, LogNormal):
        low, high = sizes.ends
        return None if high / low <= LARGEST_RATIO else _too_wide(high / low)
    diameters, fractions = np.array(sizes).T
    if not np.all(np.diff(diameters) > 0):
        return "the diameters do not rise from row to row"
    if abs(fractions.sum() - 1) > SUM:
        return f"the mass fractions add up to {fractions.sum():.6g}, not to 1"
    ratio = diameters[-1] / diameters[0]
    return None if ratio <= LARGEST_RATIO else _too_wide(ratio)


def _too_wide(ratio: float) -> str:
    return (
        f"the largest grain is {ratio:.3g} times the smallest; the neighbour lists of LIGGGHTS bear"
        f" {LARGEST_RATIO:g}"
    )


def percentile(sizes: Sizes | None, diameter: float, part: float) -> float:
    """Diameter that a part of the mass is finer than, m; straight in its logarithm between classes.

    Parameters
    ----------
    sizes : LogNormal, sequence of classes, or None
        None of equal grains.
    diameter : float
        Diameter of equal grains, or the median of a log-normal distribution, m.
    part : float
        0 ... 1.
    """
    if sizes is None:
        return diameter
    if isinstance(sizes, LogNormal):
        return diameter * float(_cut(sizes, part, power=0))
    diameters, fractions = np.array(sizes).T
    finer = np.cumsum(fractions) - fractions / 2
    found = np.exp(np.interp(part, finer, np.log(diameters)))
    # the exponential of a logarithm is not the number itself to the last digit
    return float(f"{found:.12g}")


def largest(sizes: Sizes | None, diameter: float) -> float:
    """The largest grain of a mixture over one diameter; 1 of equal grains."""
    if sizes is None:
        return 1.0
    return sizes.ends[1] if isinstance(sizes, LogNormal) else sizes[-1][0] / diameter


def smallest(sizes: Sizes | None, diameter: float) -> float:
    """The smallest grain of a mixture over one diameter; 1 of equal grains."""
    if sizes is None:
        return 1.0
    return sizes.ends[0] if isinstance(sizes, LogNormal) else sizes[0][0] / diameter


def drawn(sizes: Sizes | None, diameter: float, count: int, seed: int) -> FloatArray:
    """Diameters of some grains over one diameter, in random order, shape (count,).

    They are evenly spread over the distribution by number, so that no bed has more of a size than
    it should by chance.
    """
    part = (np.arange(count) + 0.5) / count
    if sizes is None:
        return np.ones(count)
    if isinstance(sizes, LogNormal):
        found = _cut(sizes, part, power=3)
    else:
        diameters, fractions = np.array(sizes).T
        number = fractions / diameters**3
        classes = np.searchsorted(np.cumsum(number) / number.sum(), part)
        found = diameters[np.minimum(classes, len(diameters) - 1)] / diameter
    return np.random.default_rng(seed).permutation(found)


def _cut(sizes: LogNormal, part: ArrayLike, *, power: int) -> FloatArray:
    """Quantiles over the median by mass: of the mass for a power of 0, of the number for 3."""
    width = log(sizes.sigma_g)
    middle = -power * width**2
    low, high = (ndtr((log(end) - middle) / width) for end in sizes.ends)
    found = np.exp(middle + width * ndtri(low + np.asarray(part) * (high - low)))
    return np.asarray(np.clip(found, *sizes.ends))


def read(value: Any) -> Sizes | None:
    """Sizes as a study file writes them: a table of rows, or that of a log-normal distribution.

    Raises
    ------
    ValueError
        Saying what is wrong.
    """
    if value is None or isinstance(value, LogNormal):
        return value
    if isinstance(value, dict):
        try:
            return LogNormal.model_validate(value)
        except ValidationError as error:
            first = error.errors()[0]
            raise ValueError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from None
    rows = [_row(row) for row in value] if isinstance(value, list | tuple) else []
    if not rows:
        raise ValueError("neither rows [diameter, mass fraction] nor { sigma_g = ... }")
    return tuple(rows)


def of_csv(text: str) -> list[list[float]]:
    """The rows of a sieve table in a file: diameter and mass fraction, under a line that says so.

    Raises
    ------
    ValueError
        Naming the line.
    """
    head, *lines = text.lstrip("\ufeff").splitlines() or [""]
    if [name.strip() for name in head.split(",")] != list(HEAD):
        raise ValueError(f"line 1 is not {','.join(HEAD)}")
    rows = []
    for number, line in enumerate(lines, 2):
        if line.strip():
            try:
                rows.append([float(cell) for cell in line.split(",")])
            except ValueError:
                raise ValueError(f"line {number} is no row of two numbers") from None
    return rows


def _row(row: Any) -> tuple[float, float]:
    if not isinstance(row, list | tuple) or len(row) != 2:
        raise ValueError("a row is not [diameter, mass fraction]")
    if not all(isinstance(one, int | float) and 0 < one < 100 for one in row):
        raise ValueError("a diameter (m) or a mass fraction is no number above 0")
    diameter, fraction = (float(one) for one in row)
    return diameter, fraction
