"""Thresholds from motion: of single grains, of piles, of the classes of a mixture."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from orchestrator.digits import DIGITS
from orchestrator.grains.motion import Motion
from orchestrator.types import BoolArray, FloatArray

OUTSIDE = 0.1
"""Part of samples beyond each end of the interval of a size class."""
STEP = np.sqrt(2)
"""Ratio of the ends of a size class, half a phi; d lies in the middle of one."""
COUNT_SLACK = 1e-9
"""Grains by which a fraction of all may miss a whole number."""
EQUAL_MOBILITY = 2.0
"""Exponent m of the parts D_i^-m of size classes that move where all are as mobile.

Measured hiding is that of equal dimensionless transport W*_i. It is as the part of the
class that moves in a time, times its diameter and the length of a step. A step is some
100 diameters of the grain (H. A. Einstein, 1950, from memory), so that the part is as
1/D_i^2; with one length for all it would be as 1/D_i.
"""
MOBILITIES = (1.0, EQUAL_MOBILITY)
"""Exponents m between which hiding is read: steps of one length for all, and steps as
the diameter. Which of the two grains take is not known."""
READ_PART = 0.03
"""Part of the grains of d at which hiding is read, at most: a reference transport is
far less, and the first balance of the drags holds for few grains that have gone."""
MOST_PART = 0.06
"""Largest part of a class at which it is read."""
FEWEST_READ = 2.0
"""Least number of grains that such a part of a class is."""


@dataclass(frozen=True)
class Thresholds:
    """Flows at which grains moved, NaN where a grain never moved.

    Attributes
    ----------
    value
        The geometric mean of the other two; shape (N,), as theirs.
    low
        The last flow at which a grain had not yet moved.
    high
        The first at which it had.
    """

    value: FloatArray
    low: FloatArray
    high: FloatArray


def of_grains(motion: Motion) -> Thresholds:
    """Find the deck's flow at which each counted grain moved.

    Parameters
    ----------
    motion
        The motion of the grains.

    Returns
    -------
    Thresholds
        In the deck's unit of flow.
    """
    moved = motion.load_step > 0
    low = np.where(moved, motion.low[motion.load_step], np.nan)
    high = np.where(moved, motion.flow[motion.load_step], np.nan)
    return Thresholds(np.sqrt(low * high), low, high)


def mean_tau(motion: Motion, speed: FloatArray, fluid_density: float) -> FloatArray:
    """Mean wall stress on the grains that had moved by each load step.

    Parameters
    ----------
    motion
        The motion of the N counted grains.
    speed
        Local friction velocity of each over the undisturbed one; only the size
        matters. Shape (N,).
    fluid_density
        Density of the fluid, kg/m3.

    Returns
    -------
    FloatArray
        The stress, Pa, NaN before any had; shape (load steps + 1,).
    """
    moved = motion.moved
    squares = np.bincount(motion.load_step, speed**2, len(motion.flow))
    squares[0] = 0.0  # those that never move
    mean = np.where(moved > 0, np.cumsum(squares) / np.maximum(moved, 1), np.nan)
    return np.asarray(fluid_density * motion.flow**2 * mean)


@dataclass(frozen=True)
class PileThreshold:
    """The flow at which a fraction of a pile's grains has moved.

    Numbers are NaN if it was not reached, but for the lower end of the interval.

    Attributes
    ----------
    fraction
        The fraction n/N.
    ustar0
        The undisturbed friction velocity, m/s.
    tau
        The threshold stress tau_c, Pa: the mean over the grains that have moved of the
        stress that drives each along its own way, whichever way that is.
    tau_low, tau_high
        Its interval, Pa, which holds the step between two flows and the count's
        resolution of 1/N. An end that is not known is NaN: the interval is open there.
    carried_off
        Share of the grains that had moved and were carried off.
    against_the_flow
        Share of those that a reversed flow had driven upstream.
    """

    fraction: float
    ustar0: float
    tau: float
    tau_low: float
    tau_high: float
    carried_off: float
    against_the_flow: float


def within(value: Any, error: Any) -> tuple[Any, Any]:
    """Interval of a reference from which a value is off by at most an error.

    Parameters
    ----------
    value
        A number, or an array of numbers.
    error
        For each, or for all, the largest difference from the reference over the
        reference, ``|value/reference - 1|``.

    Returns
    -------
    low, high
        ``value/(1 + error)`` and ``value/(1 - error)``. From an error of 1 on the value
        says nothing of how large the reference may be: the upper end is NaN. So are
        both where the error is NaN.
    """
    part = 1 - np.asarray(error, float)
    with np.errstate(divide="ignore"):
        high = np.where(part > 0, value / part, np.nan)
    return value / (1 + error), high


def sampled(fraction: float, count: int) -> tuple[float, float]:
    """Two parts of some grains between which a threshold of all lies with 80 %.

    By the binomial distribution. Where a fraction of all grains has moved, fewer than
    the first part of some that were picked at random have moved with 10 %, and more
    than the second with 10 %: of 5 grains none to three, where 0.3 of all have. A first
    part of 0 and a second above 1 are no bounds.

    Parameters
    ----------
    fraction
        The fraction of all grains.
    count
        Number of the grains that were picked.

    Returns
    -------
    low, high : float
        The two parts.

    Examples
    --------
    >>> sampled(0.3, 5)
    (0.0, 0.8)
    """
    from scipy.special import bdtr

    below = bdtr(np.arange(count + 1), count, fraction)
    low, high = np.searchsorted(below, [OUTSIDE, 1 - OUTSIDE])
    return float(low / count), float((high + 1) / count)


def of_all(moved: int, count: int) -> tuple[float, float]:
    """Part of all grains that have moved if so many of a sample have, with 80 %.

    The binomial interval of C. J. Clopper and E. S. Pearson, Biometrika 26, 1934.

    Parameters
    ----------
    moved
        How many of the sample have moved.
    count
        How many the sample has.

    Returns
    -------
    low, high : float
        Ends of the interval of the part.

    Examples
    --------
    >>> low, high = of_all(0, 2)
    >>> low, round(high, 2)
    (0.0, 0.68)
    """
    from scipy.special import betaincinv

    low = 0.0
    if moved > 0:
        low = float(betaincinv(moved, count - moved + 1, OUTSIDE))
    high = 1.0
    if moved < count:
        high = float(betaincinv(moved + 1, count - moved, 1 - OUTSIDE))
    return low, high


def of_pile(
    motion: Motion,
    speed: FloatArray,
    fraction: float,
    fluid_density: float,
    ends: tuple[float, float] | None = None,
) -> PileThreshold:
    """tau_c of a pile at a fraction.

    Parameters
    ----------
    motion, speed, fluid_density
        As in `mean_tau`.
    fraction
        The fraction n/N.
    ends
        Two fractions, between which the interval lies, by default half a grain around
        it. It is open below if the first is 0, and above where so many grains had not
        moved by the last flow.

    Returns
    -------
    PileThreshold
        The threshold.
    """
    half = 0.5 / motion.count
    least, most = ends or (max(fraction - half, half), fraction + half)
    tau_low, tau_high = _interval(motion, speed, fluid_density, (least, fraction, most))
    load_step = first_load_step(motion, fraction)
    if load_step is None:
        nan = math.nan
        return PileThreshold(fraction, nan, nan, tau_low, tau_high, nan, nan)
    ustar0 = math.sqrt(motion.low[load_step] * motion.flow[load_step])
    return PileThreshold(
        fraction=fraction,
        ustar0=ustar0,
        tau=_stress(motion, speed, fluid_density, load_step, ustar0),
        tau_low=tau_low,
        tau_high=tau_high,
        carried_off=float(motion.carried_off[load_step] / motion.moved[load_step]),
        against_the_flow=_mean(motion, speed < 0, load_step),
    )


def _interval(
    motion: Motion,
    speed: FloatArray,
    fluid_density: float,
    fractions: tuple[float, float, float],
) -> tuple[float, float]:
    """Ends of the interval of tau_c, Pa, from a lower fraction to a higher one."""
    least, fraction, most = fractions
    last = len(motion.flow) - 1
    below = first_load_step(motion, least)
    load_step = first_load_step(motion, fraction)
    above = first_load_step(motion, most)
    upper = last
    if above is not None:
        upper = above
    # under a higher flow grains move where its stress is lower: their mean may fall
    held = [_stress(motion, speed, fluid_density, upper, motion.flow[upper])]
    if below is not None:
        held.append(_stress(motion, speed, fluid_density, below, motion.low[below]))
    if load_step is not None:
        ustar0 = math.sqrt(motion.low[load_step] * motion.flow[load_step])
        held.append(_stress(motion, speed, fluid_density, load_step, ustar0))
    high = math.nan
    if above is not None:
        high = max(held)
    is_open_below = least <= 0 or last == 0
    if is_open_below:
        return math.nan, high
    return min(held), high


def _stress(
    motion: Motion,
    speed: FloatArray,
    fluid_density: float,
    load_step: int,
    ustar0: float,
) -> float:
    """Mean stress at a flow on the grains that have moved by a load step, Pa."""
    squares = speed**2
    mean = _mean(motion, squares, load_step)
    if math.isnan(mean):  # before any has moved it is that on all
        mean = float(squares.mean())
    return fluid_density * float(ustar0) ** 2 * mean


def first_load_step(motion: Motion, fraction: float) -> int | None:
    """Find the first load step by whose end a fraction of the grains had moved.

    Parameters
    ----------
    motion
        The motion of the grains.
    fraction
        The fraction.

    Returns
    -------
    int, or None
        Number of the load step; None if it was not reached.
    """
    needed = max(math.ceil(fraction * motion.count - COUNT_SLACK), 1)
    reached = np.flatnonzero(motion.fraction * motion.count >= needed - COUNT_SLACK)
    if not len(reached):
        return None
    return int(reached[0])


def _mean(motion: Motion, values: NDArray[Any], load_step: int) -> float:
    """Mean over the grains that have moved; NaN before any has."""
    moved = values[motion.moved_by(load_step)]
    if not len(moved):
        return math.nan
    return float(moved.mean())


class SizeClass(NamedTuple):
    """Counted grains between two sizes.

    Attributes
    ----------
    number
        Number of the class; the class around d has 0.
    size
        Geometric mean diameter of its grains, d.
    chosen
        Which of the grains are in it; shape (N,).
    """

    number: int
    size: float
    chosen: BoolArray


def classes(sizes: FloatArray) -> Iterator[SizeClass]:
    """Divide counted grains into size classes.

    Parameters
    ----------
    sizes
        Their sizes, d; shape (N,).

    Yields
    ------
    SizeClass
        The classes that have grains, rising.
    """
    # a size on the border of two classes is in one of them, whatever its last digit
    number = np.rint(np.round(np.log(sizes) / np.log(STEP), DIGITS)).astype(int)
    for index in np.unique(number).tolist():
        chosen = number == index
        mean = float(np.exp(np.log(sizes[chosen]).mean()))
        yield SizeClass(index, mean, chosen)


def at_size(size: float, sizes: FloatArray, stress: FloatArray) -> float:
    """The threshold stress of a size between two classes, by a power law of the size.

    Parameters
    ----------
    size
        The size, d.
    sizes
        Sizes of the classes, d, rising; shape (k,).
    stress
        Threshold stress of each, Pa; shape (k,).

    Returns
    -------
    float
        The stress, Pa. It is NaN where no class is as small or none as large, and where
        one of the two classes beside the size has no threshold, or grains that lie
        loose.

    Examples
    --------
    >>> import numpy as np
    >>> round(at_size(2.0, np.array([1.0, 4.0]), np.array([1.0, 2.0])), 3)
    1.414
    """
    above = int(np.searchsorted(sizes, size))
    # the same class if one is as large
    below = int(np.searchsorted(sizes, size, side="right")) - 1
    if below < 0 or above == len(sizes):
        return math.nan
    pair = [below, above]
    if not np.all(stress[pair] > 0):
        return math.nan
    logarithm = np.interp(np.log(size), np.log(sizes[pair]), np.log(stress[pair]))
    return float(np.exp(logarithm))


def hiding_exponent(
    shields: FloatArray, sizes: FloatArray, counted: BoolArray, mobility: float
) -> float:
    """Find the exponent p of theta_i ~ D_i^p over the size classes of grains.

    Each class is read at the flow that has moved the part ``part D_i^-mobility`` of its
    counted grains, where `part` is `READ_PART`, or less where that of the smallest
    grains would be above `MOST_PART`.

    Parameters
    ----------
    shields
        Shields number, by its own diameter, at which each grain moves; shape (N,).
    sizes
        Diameters, d; shape (N,).
    counted
        Which of the grains count; shape (N,).
    mobility
        Exponent m of the parts, one of `MOBILITIES` or between them.

    Returns
    -------
    float
        The exponent: -1 where all sizes move at one stress, 0 where each moves as if it
        were alone. It is NaN where fewer than two classes have `FEWEST_READ` grains to
        be read by.

    Examples
    --------
    >>> import numpy as np
    >>> sizes = np.repeat([0.75, 1.0, 1.4], 1000)
    >>> stress = np.tile(np.linspace(0.01, 1.0, 1000), 3)
    >>> every = np.ones(3000, bool)
    >>> round(hiding_exponent(stress / sizes, sizes, every, 0.0), 3)
    -1.0
    """
    read = []
    for each in classes(sizes):
        own = np.sort(shields[each.chosen & counted])
        if READ_PART * each.size**-mobility * len(own) >= FEWEST_READ:
            read.append((each.size, own))
    smallest = min((size for size, _ in read), default=1.0)
    part = min(READ_PART, MOST_PART * smallest**mobility)
    points = []
    for size, own in read:
        # by its flow at least that part of the grains has moved, as in tables
        moved = math.ceil(part * size**-mobility * len(own) - COUNT_SLACK)
        points.append((size, own[moved - 1]))
    if len(points) < 2:
        return math.nan
    ln_size, ln_shields = np.log(np.array(points)).T
    slope, _ = np.polyfit(ln_size, ln_shields, 1)
    return float(slope)
