"""Sizes of the grains of a mixture: a sieve table, or a log-normal distribution by mass."""

from math import log
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from scipy.special import ndtr, ndtri

from orchestrator.study.part import UnfitError
from orchestrator.types import FloatArray

Sieve = tuple[tuple[float, float], ...]
"""Classes of a sieve table: diameter, m, rising, and fraction of the mass."""
LARGEST_RATIO = 10.0
"""Largest ratio of the largest to the smallest grain: the lists of neighbours in DEM reach as far
as two of the largest, so that their length, and the time of a run, rise with its square."""
SUM = 1e-6
"""Largest difference of the sum of a sieve table's fractions from 1."""
OFF_MEDIAN = 0.01
"""Largest difference of a log-normal mixture's d50 from the diameter, relative: Shields numbers and
a roughness length of d/30 take the diameter."""


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

    def quantile(self, part: ArrayLike, *, power: int) -> FloatArray:
        """Diameter over the median that a part of the mass (power 0) or number (3) is below."""
        width = log(self.sigma_g)
        middle = -power * width**2
        low, high = (ndtr((log(end) - middle) / width) for end in self.ends)
        sizes = np.exp(middle + width * ndtri(low + np.asarray(part) * (high - low)))
        return np.asarray(np.clip(sizes, *self.ends))

    def __str__(self) -> str:
        low, high = self.ends
        return f"log-normal, sigma_g {self.sigma_g:g}, {low:.3g} to {high:.3g} d50"


Sizes = LogNormal | Sieve


def read(value: Any) -> Sizes | None:
    """Sizes as a study file writes them: a list of rows, or a table with ``sigma_g``.

    Raises
    ------
    UnfitError
        If the value is neither.
    """

    def refused(what: str) -> UnfitError:
        remedy = "write [[5e-4, 0.4], [1e-3, 0.6]], or { sigma_g = 1.3 }"
        return UnfitError("grain.sizes", what, remedy)

    if value is None or isinstance(value, LogNormal):
        return value
    if isinstance(value, dict):
        try:
            return LogNormal.model_validate(value)
        except ValidationError as error:
            first = error.errors()[0]
            raise refused(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from None
    if not isinstance(value, list | tuple) or not value:
        raise refused("neither rows [diameter, mass fraction] nor { sigma_g = ... }")
    for row in value:
        if not isinstance(row, list | tuple) or len(row) != 2:
            raise refused("a row is not [diameter, mass fraction]")
        if not all(isinstance(number, int | float) and 0 < number < 100 for number in row):
            raise refused("a diameter (m) or a mass fraction is no number above 0")
    return tuple((float(diameter), float(fraction)) for diameter, fraction in value)


def check(sizes: Sizes, diameter: float) -> None:
    """See that a mixture is one that can be poured, and that the diameter (m) is its median.

    Raises
    ------
    UnfitError
        If it is not.
    """
    what, field, remedy = "", "grain.sizes", "look at the rows"
    median = percentile(sizes, diameter, 0.5)
    if isinstance(sizes, LogNormal):
        if abs(median / diameter - 1) > OFF_MEDIAN:
            what = f"between these cut-offs d50 is {median:.4g} m, not the diameter"
            remedy = "write smallest = 1/largest"
    else:
        diameters, fractions = np.array(sizes).T
        if not np.all(np.diff(diameters) > 0):
            what = "the diameters do not rise from row to row"
        elif abs(fractions.sum() - 1) > SUM:
            what = f"the mass fractions add up to {fractions.sum():.6g}, not to 1"
        elif abs(diameter / median - 1) > 1e-9:
            field, remedy = "grain.diameter", "leave it out"
            what = f"the d50 of grain.sizes is {median:.9g} m"
    low, high = extremes(sizes, diameter)
    if not what and (ratio := high / low) > LARGEST_RATIO:
        what = f"the largest grain is {ratio:.3g} times the smallest, more than {LARGEST_RATIO:g}"
    if what:
        raise UnfitError(field, what, remedy)


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
        return diameter * float(sizes.quantile(part, power=0))
    diameters, fractions = np.array(sizes).T
    finer = np.cumsum(fractions) - fractions / 2
    # the exponential of a logarithm is not the number itself to the last digit
    return float(f"{np.exp(np.interp(part, finer, np.log(diameters))):.12g}")


def extremes(sizes: Sizes | None, diameter: float) -> tuple[float, float]:
    """The smallest and the largest grain of a mixture over one diameter; both 1 of equal grains."""
    if sizes is None:
        return 1.0, 1.0
    if isinstance(sizes, LogNormal):
        return sizes.ends
    return sizes[0][0] / diameter, sizes[-1][0] / diameter


def drawn(sizes: Sizes | None, diameter: float, count: int, seed: int) -> FloatArray:
    """Diameters of some grains over one diameter, in random order, shape (count,).

    They are evenly spread over the distribution by number, so that no bed has more of a size than
    it should by chance.
    """
    part = (np.arange(count) + 0.5) / count
    if sizes is None:
        return np.ones(count)
    if isinstance(sizes, LogNormal):
        each = sizes.quantile(part, power=3)
    else:
        diameters, fractions = np.array(sizes).T
        number = fractions / diameters**3
        classes = np.searchsorted(np.cumsum(number) / number.sum(), part)
        each = diameters[np.minimum(classes, len(diameters) - 1)] / diameter
    return np.random.default_rng(seed).permutation(each)
