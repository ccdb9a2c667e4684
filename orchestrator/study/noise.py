"""Noise of the points of a measured bed line, and the smoothing that it needs.

A point that is off by sigma tilts the line to its neighbours at a distance dx by
sigma sqrt(2)/dx. The mesh has a grid line at each point, so that the flow feels
these slopes. A mean with Gaussian weights of the standard deviation L/2, L being
`bed.smoothing`, leaves of them ::

    sigma sqrt(dx / (4 sqrt(pi))) (L/2)^(-3/2)

It is the standard deviation of the slope of a sum of independent errors weighted by
the derivative of a Gaussian, whose square has the integral 1/(4 sqrt(pi) (L/2)^3).
"""

import math

import numpy as np

from orchestrator.types import FloatArray

FEWEST = 20  # points from which their noise can be told from the shape of a bed
APART = 0.25
"""Distance of the points, over the height of the bed line, beyond which their
differences are its shape: the mesh has three cells there on a slope of 15 degrees."""
SLOPE = 0.01
"""Slope of the noise that may be left: it moves the flow at which motion starts by 1 %,
a slope of 0.02 by 1 to 4 %, of 0.1 by 23 to 26 % (docs/own-profile.md)."""
MEDIAN = 0.674490  # of the size of a normal variate, over its standard deviation


def standard_deviation(x: FloatArray, z: FloatArray) -> float:
    """Standard deviation of the errors of points, from what each is off its neighbours.

    A point is compared with the cubic through its two neighbours on either side, so
    that slope and curvature of the bed do not count. The median of the sizes stands for
    all: corners of the bed are few.

    Parameters
    ----------
    x, z
        At least five points, x rising, shape (n,), m.

    Returns
    -------
    float
        The standard deviation, m.
    """
    offsets = np.array([-2, -1, 1, 2])
    middle = np.arange(2, len(x) - 2)
    neighbours = middle[:, None] + offsets
    away = x[neighbours] - x[middle, None]
    weights = np.ones_like(away)
    for one in range(len(offsets)):
        for other in range(len(offsets)):
            if one != other:
                weights[:, one] *= away[:, other] / (away[:, other] - away[:, one])
    off = z[middle] - (weights * z[neighbours]).sum(axis=1)
    sizes = np.abs(off) / np.sqrt(1 + (weights**2).sum(axis=1))
    return float(np.median(sizes)) / MEDIAN


def needed_smoothing(x: FloatArray, z: FloatArray) -> float:
    """The smoothing that leaves the noise of points a slope of `SLOPE`.

    Parameters
    ----------
    x, z
        The points as they were measured, x rising, shape (n,), m.

    Returns
    -------
    float
        `bed.smoothing`, m, of two digits; 0 where the points have no such noise.
    """
    if len(x) < FEWEST:
        return 0.0
    distance = float(np.median(np.diff(x)))
    if distance > APART * np.ptp(z):
        return 0.0
    sigma = standard_deviation(x, z)
    if sigma * math.sqrt(2) / distance <= SLOPE:
        return 0.0
    width = (sigma / SLOPE) ** (2 / 3) * (distance / (4 * math.sqrt(math.pi))) ** (
        1 / 3
    )
    return float(f"{2 * width:.2g}")
