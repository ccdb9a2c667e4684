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
STEP = np.sqrt(2)  # ratio of the ends of a class: half a phi; d lies in the middle of one


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
    interval holds the step between two flows and the count's resolution of 1/N. The last two are
    shares of the grains that had moved: carried off, and driven upstream by a reversed flow.
    """

    fraction: float
    ustar0: float
    tau: float
    tau_low: float
    tau_high: float
    carried_off: float
    against_the_flow: float


def sampled(fraction: float, count: int) -> tuple[float, float]:
    """Two fractions of `count` grains between which that of all lies with 80 %, by the binomial.

    Of 5 grains none to four, where 0.3 of all have moved.
    """
    from scipy.special import bdtr

    below = bdtr(np.arange(count + 1), count, fraction)
    low, high = np.searchsorted(below, [OUTSIDE, 1 - OUTSIDE])
    return float(low / count), float((high + 1) / count)


def of_pile(
    motion: Motion,
    speed: FloatArray,
    fraction: float,
    fluid_density: float,
    ends: tuple[float, float] | None = None,
) -> PileThreshold:
    """tau_c of a pile at a fraction; arguments as in `mean_tau`.

    Its interval is that between two fractions `ends`, by default half a grain around it.
    """
    level = first_level(motion, fraction)
    if level is None:
        return PileThreshold(fraction, *(math.nan,) * 6)
    low, high = ends or (fraction - 0.5 / motion.count, fraction + 0.5 / motion.count)
    below = first_level(motion, low) or level
    # where so many were not reached, the interval is open: it ends at the last load step
    above = first_level(motion, high) or len(motion.flow) - 1
    flow = math.sqrt(motion.low[level] * motion.flow[level])

    def stress(at: int, ustar0: float) -> float:
        return fluid_density * float(ustar0) ** 2 * _mean(motion, speed**2, at)

    tau = stress(level, flow)
    # under a higher flow grains move where its stress is lower: their mean may fall
    held = tau, stress(below, motion.low[below]), stress(above, motion.flow[above])
    return PileThreshold(
        fraction=fraction,
        ustar0=flow,
        tau=tau,
        tau_low=min(held),
        tau_high=max(held),
        carried_off=float(motion.carried_off[level] / motion.moved[level]),
        against_the_flow=_mean(motion, speed < 0, level),
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
