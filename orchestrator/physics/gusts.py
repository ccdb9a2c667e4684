"""Gusts: by how much the largest of many turbulent stresses exceeds the mean."""

from math import exp, log1p, sqrt
from statistics import NormalDist

import numpy as np

from orchestrator.types import FloatArray


def peak_over_mean(intensity: float, events: float) -> float:
    """The largest stress of independent events and of the mean flow, over the mean.

    Stresses on a wall under turbulence are close to log-normal: with an intensity I
    (standard deviation over mean) of 0.4 the distribution has a skewness of 1.3,
    measured is 1. With ``sigma^2 = ln(1 + I^2)`` the stress that is exceeded once in n
    events, the characteristic largest value of E. J. Gumbel, Statistics of Extremes,
    1958, is the quantile 1 - 1/n, ``exp(sigma z - sigma^2/2)``, z that of the normal
    distribution. The median of the distribution is below its mean, and so is this
    quantile of few events. The mean stress acts as well, after the events and between
    them: the result is at least 1.

    Parameters
    ----------
    intensity
        0.36 to 0.4 over a flat bed (P. H. Alfredsson et al., Phys. Fluids 31, 1988,
        doi:10.1063/1.866783).
    events
        How many there are while the bed is watched; 1 is no gust.

    Returns
    -------
    float
        The stress over the mean stress, at least 1.

    Examples
    --------
    >>> round(peak_over_mean(0.4, 100), 3)
    2.275
    """
    if events <= 1:
        return 1.0
    variance = log1p(intensity**2)
    normal = NormalDist().inv_cdf(1 - 1 / events)
    quantile = exp(sqrt(variance) * normal - variance / 2)
    return max(quantile, 1.0)


PEAK = peak_over_mean(0.4, 100)
"""Stress of the gust that decides, over that of the mean flow: 2.28.

It is the largest of 100 independent stresses of intensity 0.4.
"""


def gust_stresses(
    intensity: float, events: int, load_steps: int, seed: int
) -> FloatArray:
    """Stress of each event over the mean, in random order for each load step.

    They are evenly spread over the log-normal distribution up to its quantile 1 - 1/n,
    which is `peak_over_mean` where that is above 1.

    Parameters
    ----------
    intensity
        Standard deviation over mean of the stress.
    events
        Number of events of a load step.
    load_steps
        Number of load steps.
    seed
        Seed of the random order.

    Returns
    -------
    FloatArray
        The stresses; shape (load steps, events).

    Examples
    --------
    >>> gust_stresses(0.4, 3, 1, 0).round(2)
    array([[1.1 , 0.79, 0.93]])
    """
    parts = np.linspace(1 / events, 1 - 1 / events, events).tolist()
    normal = np.array([NormalDist().inv_cdf(part) for part in parts])
    variance = log1p(intensity**2)
    stress = np.exp(sqrt(variance) * normal - variance / 2)
    of_steps = np.tile(stress, (load_steps, 1))
    return np.random.default_rng(seed).permuted(of_steps, axis=1)
