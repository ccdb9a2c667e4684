"""How the threshold of a grain depends on its size within a mixture, as it was published."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

SMALLEST = 0.4
"""Relative size below which Egiazaroff's curve, which runs to infinity at 1/19, means nothing."""


def wilcock_crowe(relative_size: ArrayLike) -> FloatArray:
    """Shields number of a size over that of the mean size, by Wilcock and Crowe (2003).

    P. R. Wilcock and J. C. Crowe, J. Hydraul. Eng. 129, 2003: the reference stress goes with
    ``(D/D_m)^b``, ``b = 0.67/(1 + exp(1.5 - D/D_m))``.
    """
    ratio = np.asarray(relative_size, float)
    return np.asarray(ratio ** (0.67 / (1 + np.exp(1.5 - ratio)) - 1))


def egiazaroff(relative_size: ArrayLike) -> FloatArray:
    """Shields number of a size over that of the mean size, by Egiazaroff (1965).

    I. V. Egiazaroff, J. Hydraul. Div. 91, 1965, from secondary sources; NaN for sizes too small.
    """
    ratio = np.asarray(relative_size, float)
    known = np.where(ratio >= SMALLEST, ratio, np.nan)
    return np.asarray((np.log(19) / np.log(19 * known)) ** 2)


def kirchner_pivot_deg(percentile: ArrayLike, relative_size: ArrayLike = 1.0) -> FloatArray:
    """Friction (pivot) angle of a grain on a natural bed, degrees.

    J. W. Kirchner et al., Sedimentology 37, 1990, as a public code has it: the n-th percentile is
    ``(30 + 0.5 n) (D/D50)^-0.3``.
    """
    ratio = np.asarray(relative_size, float)
    return np.asarray((30 + 0.5 * np.asarray(percentile, float)) * ratio**-0.3)
