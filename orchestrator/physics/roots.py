"""Roots of many functions at once, one for each grain.

SciPy has the same method, but to import it takes several times as long as a command
that finds the thresholds of a few grains.
"""

from typing import Protocol

import numpy as np

from orchestrator.types import FloatArray, IntArray

LEAST = float(np.finfo(float).smallest_normal)
"""Value of a function that is 0 but for the last digits of its terms."""
DIGITS = 4 * float(np.finfo(float).eps)
"""Distance of the bounds, over the root, at which it is right to the last digits."""
MOST = 2100
"""Steps after which no root is found: halvings from the largest to the least number."""


class Excess(Protocol):
    """A function of some of n grains: what forces have beyond that which holds."""

    def __call__(self, x: FloatArray, places: IntArray, /) -> FloatArray:
        """Compute it for the grains at some places, each for its own x."""
        ...


def root(function: Excess, low: FloatArray, high: FloatArray) -> FloatArray:
    """Find a root of each of n grains.

    The method is that of Chandrupatla (Advances in Engineering Software 28, 145-149,
    1997): inverse quadratic interpolation through the last three points where these
    show a function without a bend, else a halving of the bounds.

    Parameters
    ----------
    function
        The function.
    low, high
        Bounds of different signs, shape (n,).

    Returns
    -------
    FloatArray
        The roots, shape (n,), right to the last digits; NaN, not known, where the signs
        are the same or the function is NaN on the way.

    Examples
    --------
    >>> squares = np.array([2.0, 3.0])
    >>> found = root(lambda x, at: x**2 - squares[at], np.zeros(2), np.full(2, 4.0))
    >>> print(found.round(6))
    [1.414214 1.732051]
    """
    found = np.full(len(low), np.nan)
    places = np.arange(len(low))
    ends = function(low, places), function(high, places)
    # three points: the newest, the nearest of the other sign, and the one before
    x = np.array([low, high, high], float)
    f = np.array([*ends, ends[1]], float)
    for _ in range(MOST):
        best, distance = _nearest(x, f)
        is_known = np.sign(f[0]) * np.sign(f[1]) <= 0
        is_zero = np.min(np.abs(f[:2]), axis=0) <= LEAST
        has_ended = is_known & (is_zero | (distance > 1))
        found[places[has_ended]] = best[has_ended]
        left = is_known & ~has_ended
        if not left.any():
            break
        x, f, places = x[:, left], f[:, left], places[left]
        part = np.clip(_part(x, f), distance[left] / 2, 1 - distance[left] / 2)
        new = x[0] + part * (x[1] - x[0])
        value = function(new, places)
        order = np.where(np.sign(value) == np.sign(f[0]), [[1], [0]], [[0], [1]])
        x = np.vstack([new, np.take_along_axis(x, order, axis=0)])
        f = np.vstack([value, np.take_along_axis(f, order, axis=0)])
    return found


def _nearest(x: FloatArray, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The bound that is nearest to the root, and its last digits over their width."""
    best = np.where(np.abs(f[0]) < np.abs(f[1]), x[0], x[1])
    with np.errstate(divide="ignore"):
        return best, (DIGITS * np.abs(best) + 4 * LEAST) / np.abs(x[1] - x[0])


def _part(x: FloatArray, f: FloatArray) -> FloatArray:
    """Where the next point lies on the way from the first point to the second one."""
    with np.errstate(divide="ignore", invalid="ignore"):
        place = (x[0] - x[1]) / (x[2] - x[1])
        value = (f[0] - f[1]) / (f[2] - f[1])
        far = (x[2] - x[0]) / (x[1] - x[0])
        inverse = f[0] / (f[0] - f[1]) * f[2] / (f[2] - f[1])
        inverse -= far * f[0] / (f[2] - f[0]) * f[1] / (f[1] - f[2])
        is_straight = (1 - np.sqrt(1 - place) < value) & (value < np.sqrt(place))
    return np.where(is_straight, inverse, 0.5)
