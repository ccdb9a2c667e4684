"""Thresholds from motion: of single grains, of a pile at a fraction, of a mixture's classes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from orchestrator.digits import DIGITS
from orchestrator.grains.motion import Motion
from orchestrator.types import BoolArray, FloatArray

OUTSIDE = 0.1  # part of samples beyond each end of the interval of a size class
STEP = np.sqrt(
    2
)  # ratio of the ends of a class: half a phi; d lies in the middle of one
EQUAL_MOBILITY = 2.0
"""Exponent m of the parts D_i^-m of size classes that move where all sizes are as mobile.

Measured hiding is that of equal dimensionless transport W*_i. It is as the part of the
class that moves in a time, times its diameter and the length of a step. A step is some
100 diameters of the grain (H. A. Einstein, 1950, from memory), so that the part is as
1/D_i^2; with one length for all it would be as 1/D_i.
"""


@dataclass(frozen=True)
class Thresholds:
    """Flows at which grains moved, arrays of shape (N,); NaN where a grain never moved.

    At `low` a grain had not yet moved, at `high` it had; `value` is their geometric mean.
    """

    value: FloatArray
    low: FloatArray
    high: FloatArray


def of_grains(motion: Motion) -> Thresholds:
    """The deck's flow at which each counted grain moved."""
    moved = motion.level > 0
    low = np.where(moved, motion.low[motion.level], np.nan)
    high = np.where(moved, motion.flow[motion.level], np.nan)
    return Thresholds(np.sqrt(low * high), low, high)


def mean_tau(motion: Motion, speed: FloatArray, fluid_density: float) -> FloatArray:
    """Mean wall stress on the grains that had moved by each load step, Pa, shape (levels + 1,).

    It is NaN before any had. Of `speed`, the local friction velocity over the undisturbed one of
    the N counted grains, only the size matters; the density is in kg/m3.
    """
    moved, squares = motion.moved, np.bincount(motion.level, speed**2, len(motion.flow))
    squares[0] = 0.0  # those that never move
    mean = np.where(moved > 0, np.cumsum(squares) / np.maximum(moved, 1), np.nan)
    return np.asarray(fluid_density * motion.flow**2 * mean)


@dataclass(frozen=True)
class PileThreshold:
    """The flow at which a fraction n/N of a pile's grains has moved; NaN if it was not reached.

    `ustar0` is the undisturbed friction velocity, m/s; `tau` is tau_c, Pa: the mean over the grains
    that have moved of the stress that drives each along its own way, whichever way that is. Its
    interval, from `tau_low` to `tau_high`, holds the step between two flows and the count's
    resolution of 1/N. An end that is not known is NaN: the interval is open there. Of a fraction
    that was not reached the lower end is known. The last two are shares of the grains that had
    moved: carried off, and driven upstream by a reversed flow.
    """

    fraction: float
    ustar0: float
    tau: float
    tau_low: float
    tau_high: float
    carried_off: float
    against_the_flow: float


def within(value: Any, error: Any) -> tuple[Any, Any]:
    """Ends of the interval of a reference from which a value is off by at most an error.

    Parameters
    ----------
    value
        A number, or an array of numbers.
    error
        For each, or for all, the largest difference from the reference over the reference,
        ``|value/reference - 1|``.

    Returns
    -------
    low, high
        ``value/(1 + error)`` and ``value/(1 - error)``. From an error of 1 on the value says
        nothing of how large the reference may be: the upper end is NaN. So are both where the
        error is NaN.
    """
    part = 1 - np.asarray(error, float)
    with np.errstate(divide="ignore"):
        high = np.where(part > 0, value / part, np.nan)
    return value / (1 + error), high


def sampled(fraction: float, count: int) -> tuple[float, float]:
    """Two parts of `count` grains between which a threshold of all lies with 80 %, by the binomial.

    Where a fraction of all grains has moved, fewer than the first part of `count` that were picked
    at random have moved with 10 %, and more than the second with 10 %: of 5 grains none to three,
    where 0.3 of all have. A first part of 0 and a second above 1 are no bounds.
    """
    from scipy.special import bdtr

    below = bdtr(np.arange(count + 1), count, fraction)
    low, high = np.searchsorted(below, [OUTSIDE, 1 - OUTSIDE])
    return float(low / count), float((high + 1) / count)


def of_all(moved: int, count: int) -> tuple[float, float]:
    """Part of all grains that have moved if so many of a sample have, with 80 %.

    The binomial interval of C. J. Clopper and E. S. Pearson, Biometrika 26, 1934: of none of 2
    grains 0 to 0.68.
    """
    from scipy.special import betaincinv

    low = betaincinv(moved, count - moved + 1, OUTSIDE) if moved else 0.0
    high = betaincinv(moved + 1, count - moved, 1 - OUTSIDE) if moved < count else 1.0
    return float(low), float(high)


def of_pile(
    motion: Motion,
    speed: FloatArray,
    fraction: float,
    fluid_density: float,
    ends: tuple[float, float] | None = None,
) -> PileThreshold:
    """tau_c of a pile at a fraction; arguments as in `mean_tau`.

    Its interval is that between two fractions `ends`, by default half a grain around it. It is
    open below if the first is 0, and above where so many grains had not moved by the last flow.
    """
    half = 0.5 / motion.count
    least, most = ends or (max(fraction - half, half), fraction + half)
    last = len(motion.flow) - 1
    squares = speed**2

    def stress(level: int, ustar0: float) -> float:
        mean = _mean(motion, squares, level)
        if math.isnan(mean):  # before any has moved it is that on all
            mean = float(squares.mean())
        return fluid_density * float(ustar0) ** 2 * mean

    level = first_level(motion, fraction)
    below = first_level(motion, least)
    above = first_level(motion, most)
    upper = last if above is None else above
    # under a higher flow grains move where its stress is lower: their mean may fall
    held = [stress(upper, motion.flow[upper])]
    if below is not None:
        held.append(stress(below, motion.low[below]))
    ustar0 = tau = carried_off = against_the_flow = math.nan
    if level is not None:
        ustar0 = math.sqrt(motion.low[level] * motion.flow[level])
        tau = stress(level, ustar0)
        held.append(tau)
        carried_off = float(motion.carried_off[level] / motion.moved[level])
        against_the_flow = _mean(motion, speed < 0, level)
    tau_low = min(held)
    if least <= 0 or last == 0:
        tau_low = math.nan
    tau_high = max(held)
    if above is None:
        tau_high = math.nan
    return PileThreshold(
        fraction, ustar0, tau, tau_low, tau_high, carried_off, against_the_flow
    )


def first_level(motion: Motion, fraction: float) -> int | None:
    """The first load step by whose end a fraction of the grains had moved, if any."""
    needed = max(math.ceil(fraction * motion.count - 1e-9), 1)
    reached = np.flatnonzero(motion.fraction * motion.count >= needed - 1e-9)
    return int(reached[0]) if len(reached) else None


def _mean(motion: Motion, values: NDArray[Any], level: int) -> float:
    """Mean over the grains that have moved; NaN before any has."""
    moved = values[motion.moved_by(level)]
    return float(moved.mean()) if len(moved) else math.nan


class SizeClass(NamedTuple):
    """Counted grains between two sizes: which of the N, and the geometric mean diameter, d.

    The class around d has the number 0.
    """

    number: int
    size: float
    chosen: BoolArray


def classes(sizes: FloatArray) -> Iterator[SizeClass]:
    """The classes that some counted grains are in, rising; sizes in d, shape (N,)."""
    # a size on the border of two classes is in one of them, whatever its last digit
    number = np.rint(np.round(np.log(sizes) / np.log(STEP), DIGITS)).astype(int)
    for index in np.unique(number).tolist():
        chosen = number == index
        yield SizeClass(index, float(np.exp(np.log(sizes[chosen]).mean())), chosen)


def at_size(size: float, sizes: FloatArray, stress: FloatArray) -> float:
    """The threshold stress of a size between two classes, Pa, by a power law of the size.

    `sizes` of the classes rise, `stress` has the threshold stress of each, Pa, both of shape (k,).
    It is NaN where no class is as small or none as large, and where one of the two classes beside
    the size has no threshold, or grains that lie loose.
    """
    above = int(np.searchsorted(sizes, size))
    below = (
        int(np.searchsorted(sizes, size, side="right")) - 1
    )  # the same class if one is as large
    if below < 0 or above == len(sizes):
        return math.nan
    pair = [below, above]
    if not np.all(stress[pair] > 0):
        return math.nan
    return float(
        np.exp(np.interp(np.log(size), np.log(sizes[pair]), np.log(stress[pair])))
    )
