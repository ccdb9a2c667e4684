"""Thresholds from motion: of single grains, of a pile at a fraction, of a mixture's classes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.grains.motion import Motion
from orchestrator.types import BoolArray, FloatArray

STEP = np.sqrt(2)
"""Ratio of the ends of a class: half a phi; d lies in the middle of one."""


@dataclass(frozen=True)
class Thresholds:
    """Values that the load steps enclose, arrays of one shape; NaN where a grain never moved.

    Attributes
    ----------
    value : ndarray
        The geometric mean of `low` and `high`.
    low, high : ndarray
        At `low` it had not yet happened, at `high` it had.
    """

    value: FloatArray
    low: FloatArray
    high: FloatArray


def of_grains(motion: Motion) -> Thresholds:
    """The deck's flow at which each counted grain moved, shape (N,)."""
    moved = motion.level > 0
    low = np.where(moved, motion.low[motion.level], np.nan)
    high = np.where(moved, motion.flow[motion.level], np.nan)
    return Thresholds(np.sqrt(low * high), low, high)


@dataclass(frozen=True)
class Curve:
    """How a pile answers to the flow; arrays over the load steps, shape (levels + 1,).

    Attributes
    ----------
    ustar0 : ndarray
        Undisturbed friction velocity, m/s.
    fraction : ndarray
        n/N that had moved by the end of the load step.
    mean_tau : ndarray
        Mean over the grains that had moved of the wall stress's size, Pa; NaN before any had.
    """

    ustar0: FloatArray
    fraction: FloatArray
    mean_tau: FloatArray


def curve(motion: Motion, speed: FloatArray, fluid_density: float) -> Curve:
    """The fraction that moved and the mean stress on it, at each load step.

    Parameters
    ----------
    motion : Motion
        Motion of the N windward grains.
    speed : ndarray, shape (N,)
        Local friction velocity over the undisturbed one; only its size matters.
    fluid_density : float
        kg/m3.
    """
    stress = speed**2
    mean = np.array([_mean(motion, stress, level) for level in range(len(motion.flow))])
    return Curve(motion.flow, motion.fraction, fluid_density * motion.flow**2 * mean)


@dataclass(frozen=True)
class PileThreshold:
    """The flow at which a fraction of a pile's grains has moved.

    Attributes
    ----------
    fraction : float
        n/N.
    ustar0 : float
        Undisturbed friction velocity, m/s; NaN if the fraction was not reached.
    tau, tau_low, tau_high : float
        tau_c and its interval, Pa: the mean over the grains that have moved of the stress that
        drives each along its own way, whichever way that is. The interval holds the step between
        two flows and the count's resolution of 1/N.
    carried_off : float
        Share of the grains that had moved which were carried off.
    against_the_flow : float
        Share of the grains that had moved which a reversed flow drove upstream.
    """

    fraction: float
    ustar0: float
    tau: float
    tau_low: float
    tau_high: float
    carried_off: float
    against_the_flow: float


def of_pile(
    motion: Motion, speed: FloatArray, fraction: float, fluid_density: float
) -> PileThreshold:
    """tau_c of a pile at a fraction; arguments as in `curve`."""
    level = first_level(motion, fraction)
    if level is None:
        return PileThreshold(fraction, *(math.nan,) * 6)
    half_a_grain = 0.5 / motion.count
    below = first_level(motion, fraction - half_a_grain) or level
    # where half a grain more was not reached, the interval is open: it ends at the last load step
    above = first_level(motion, fraction + half_a_grain) or len(motion.flow) - 1
    flow = math.sqrt(motion.low[level] * motion.flow[level])

    def stress(at: int, ustar0: float) -> float:
        return fluid_density * float(ustar0) ** 2 * _mean(motion, speed**2, at)

    return PileThreshold(
        fraction=fraction,
        ustar0=flow,
        tau=stress(level, flow),
        tau_low=stress(below, motion.low[below]),
        tau_high=stress(above, motion.flow[above]),
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


@dataclass(frozen=True)
class SizeClass:
    """The counted grains between two sizes.

    Attributes
    ----------
    number : int
        0 for the class around d.
    size : float
        Geometric mean of their diameters, d.
    chosen : ndarray of bool, shape (N,)
        Which of the counted grains they are.
    """

    number: int
    size: float
    chosen: BoolArray


def classes(sizes: FloatArray) -> Iterator[SizeClass]:
    """The classes that some counted grains are in, rising; sizes in d, shape (N,)."""
    number = np.rint(np.log(sizes) / np.log(STEP)).astype(int)
    for index in np.unique(number).tolist():
        chosen = number == index
        yield SizeClass(index, float(np.exp(np.log(sizes[chosen]).mean())), chosen)
