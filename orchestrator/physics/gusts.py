"""Gusts: by how much the largest of many turbulent stresses exceeds the mean."""

from math import exp, log1p, sqrt
from statistics import NormalDist

import numpy as np

from orchestrator.types import FloatArray


def peak_over_mean(intensity: float, events: float) -> float:
    """The stress that is exceeded once in n independent events, over the mean stress.

    Stresses on a wall under turbulence are close to log-normal: with an intensity I (standard
    deviation over mean) of 0.4 the distribution has a skewness of 1.3, measured is 1. With
    ``sigma^2 = ln(1 + I^2)`` the quantile 1 - 1/n is ``exp(sigma z - sigma^2/2)``, z that of the
    normal distribution.

    Parameters
    ----------
    intensity
        0.36 to 0.4 over a flat bed (P. H. Alfredsson et al., Phys. Fluids 31, 1988,
        doi:10.1063/1.866783).
    events
        How many there are while the bed is watched; 1 is no gust.
    """
    if events <= 1:
        return 1.0
    variance = log1p(intensity**2)
    return exp(sqrt(variance) * NormalDist().inv_cdf(1 - 1 / events) - variance / 2)


def gust_stresses(intensity: float, events: int, load_steps: int, seed: int) -> FloatArray:
    """Stress of each event over the mean, in random order for each load step, (steps, events).

    They are evenly spread over the log-normal distribution up to `peak_over_mean`.
    """
    parts = np.linspace(1 / events, 1 - 1 / events, events).tolist()
    variance, normal = log1p(intensity**2), NormalDist()
    stress = np.exp([sqrt(variance) * normal.inv_cdf(part) - variance / 2 for part in parts])
    return np.random.default_rng(seed).permuted(np.tile(stress, (load_steps, 1)), axis=1)
