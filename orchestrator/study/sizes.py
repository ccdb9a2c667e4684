"""Sizes of the grains of a mixture: a sieve table, or a log-normal distribution by mass."""

from math import log
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Discriminator, Field, Tag

from orchestrator.study.part import List, Part, UnfitError
from orchestrator.types import FloatArray

LARGEST_RATIO = 10.0
"""Largest ratio of the largest to the smallest grain: the lists of neighbours in DEM reach as far
as two of the largest, so that their length, and the time of a run, rise with its square."""
SUM, OFF_MEDIAN = 1e-6, 0.01
"""Largest difference of the sum of a sieve table's fractions from 1, and of a log-normal mixture's
d50 from the diameter, relative: Shields numbers and a roughness length of d/30 take the latter."""


class LogNormal(Part):
    """A log-normal distribution by mass, whose median is the grain diameter."""

    sigma_g: Annotated[float, Field(ge=1.001, le=3)]
    smallest: Annotated[float | None, Field(ge=0.1, le=1)] = None
    largest: Annotated[float | None, Field(ge=1, le=10)] = None

    @property
    def ends(self) -> tuple[float, float]:
        """Cut-offs over the median; by default two geometric standard deviations."""
        return self.smallest or self.sigma_g**-2, self.largest or self.sigma_g**2

    def quantile(self, part: ArrayLike, *, power: int) -> FloatArray:
        """Diameter over the median that a part of the mass (power 0) or number (3) is below."""
        from scipy.special import ndtr, ndtri

        width = log(self.sigma_g)
        middle = -power * width**2
        low, high = (ndtr((log(end) - middle) / width) for end in self.ends)
        sizes = np.exp(middle + width * ndtri(low + np.asarray(part) * (high - low)))
        return np.asarray(np.clip(sizes, *self.ends))

    def __str__(self) -> str:
        low, high = self.ends
        return f"log-normal, sigma_g {self.sigma_g:g}, {low:.3g} to {high:.3g} d50"


_Number = Annotated[float, Field(gt=0, lt=100)]
Sieve = tuple[Annotated[tuple[_Number, _Number], List], ...]
"""Classes of a sieve table: diameter, m, rising, and fraction of the mass."""
Sizes = Annotated[
    Annotated[LogNormal, Tag("log-normal")]
    | Annotated[Sieve, Field(min_length=1), List, Tag("rows")],
    Discriminator(lambda value: "log-normal" if isinstance(value, dict | LogNormal) else "rows"),
]
"""In a study file ``[[5e-4, 0.4], [1e-3, 0.6]]``, or ``{ sigma_g = 1.3 }``."""


def check(sizes: Sizes, diameter: float) -> None:
    """Refuse, by an `UnfitError`, a mixture that cannot be poured, or with another d50 (m)."""
    median, (low, high) = percentile(sizes, diameter, 0.5), extremes(sizes, diameter)
    if isinstance(sizes, LogNormal) and abs(median / diameter - 1) > OFF_MEDIAN:
        what = f"between these cut-offs d50 is {median:.4g} m, not the diameter"
        raise UnfitError("grain.sizes", what, "write smallest = 1/largest")
    if isinstance(sizes, tuple):
        diameters, fractions = np.array(sizes).T
        if not np.all(np.diff(diameters) > 0) or abs(fractions.sum() - 1) > SUM:
            what = (
                f"diameters do not rise, or mass fractions add up to {fractions.sum():.6g}, not 1"
            )
            raise UnfitError("grain.sizes", what, "look at the rows")
        if abs(diameter / median - 1) > 1e-9:
            raise UnfitError("grain.diameter", f"the d50 of grain.sizes is {median:.9g} m")
    if high / low > LARGEST_RATIO:
        what = f"the largest grain is {high / low:.3g} times the smallest"
        raise UnfitError("grain.sizes", what, f"at most {LARGEST_RATIO:g}")


def percentile(sizes: Sizes | None, diameter: float, part: float) -> float:
    """Diameter that a part (0 ... 1) of the mass is finer than, m.

    It is straight in its logarithm between classes. `diameter` is that of equal grains, where
    `sizes` is None, or the median of a log-normal distribution, m.
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
    if isinstance(sizes, LogNormal):
        return sizes.ends
    return (sizes[0][0] / diameter, sizes[-1][0] / diameter) if sizes else (1.0, 1.0)


def drawn(sizes: Sizes | None, diameter: float, count: int, seed: int) -> FloatArray:
    """Diameters of some grains over one diameter, in random order, shape (count,).

    They are evenly spread over the distribution by number: no bed has more of a size by chance.
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
