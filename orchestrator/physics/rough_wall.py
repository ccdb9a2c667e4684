"""The mean velocity at a rough wall from its sublayer up, with van Driest's damped mixing length.

In wall units (y = z ustar/nu): ``U' + l^2 U'^2 = 1``, ``l = 0.41 y (1 - exp(-y/26))``; roughness
shifts y by D of Rotta (1962) in the correlation of Cebeci and Chang (1978). The shear depends on
z + D alone, so that two integrals, tabulated once, serve every grain.

The form and the constants 0.9 and 6 agree with code_saturne (cs_wall_functions), which cites the
same authors; 26 is the value commonly quoted of van Driest. The originals were not at hand.
"""

from functools import cache

import numpy as np
from scipy.interpolate import BPoly, PPoly

from orchestrator.physics.constants import KARMAN
from orchestrator.physics.exposure import FloatArray

DAMPING = 26.0
"""van Driest's A+."""
ROUGHEST = 2000.0
"""ks ustar/nu up to which the correlation of the shift is in use."""
SMOOTHEST, TALLEST = 1e-3, 1e9
"""Wall units between which the integrals are tabulated.

Below, the speed is y to 16 digits; above, the shear is that of the log law to 9.
"""
STEP = 0.03
"""Step of the table in ln y: interpolation errs by less than 1e-12, relative."""


def shift(roughness: FloatArray) -> FloatArray:
    """Shift D of the wall in wall units, of ks ustar/nu; none below 4.535, where it is smooth."""
    k = roughness
    rotta = 0.9 * (np.sqrt(k) - k * np.exp(-k / 6))
    # the correlation is positive again below 1.9, where nothing is meant by it
    return np.where(k > 4, np.maximum(rotta, 0), 0)


def layer(base: FloatArray, top: FloatArray, moved: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean speed and mean shear between two heights.

    Parameters
    ----------
    base, top : ndarray
        Heights above the bed, wall units, base < top.
    moved : ndarray
        The shift of the wall, wall units.

    Returns
    -------
    tuple of ndarray
        U/ustar and nu U'/ustar^2.
    """
    depth = top - base
    speed = (_summed(top + moved) - _summed(base + moved)) / depth - _speed(moved)
    return speed, (_speed(top + moved) - _speed(base + moved)) / depth


def shear(y: FloatArray) -> FloatArray:
    """Shear nu U'/ustar^2 at a distance from the shifted wall (wall units)."""
    return 2 / (1 + np.sqrt(1 + 4 * _mixing_length(y) ** 2))


def _mixing_length(y: FloatArray) -> FloatArray:
    return -KARMAN * y * np.expm1(-y / DAMPING)


def _speed(y: FloatArray) -> FloatArray:
    """Integral of the shear from the shifted wall."""
    table = _tables()[0](np.log(np.clip(y, SMOOTHEST, TALLEST)))
    return np.where(y < SMOOTHEST, y, table + _log_above(y))


def _summed(y: FloatArray) -> FloatArray:
    """Integral of the speed from the shifted wall."""
    table = _tables()[1](np.log(np.clip(y, SMOOTHEST, TALLEST)))
    above = np.maximum(y - TALLEST, 0) * (_tables()[0](np.log(TALLEST)) - 1 / KARMAN)
    return np.where(y < SMOOTHEST, y**2 / 2, table + above + y * _log_above(y))


def _log_above(y: FloatArray) -> FloatArray:
    """Addition of the log law to the speed at the end of the table."""
    return np.log(np.maximum(y / TALLEST, 1)) / KARMAN


@cache
def _tables() -> tuple[PPoly, PPoly]:
    """Speed and its integral, as polynomials of ln y with two exact derivatives at each node."""
    x = np.arange(np.log(SMOOTHEST), np.log(TALLEST) + 2 * STEP, STEP)
    y, g = np.exp(x), shear(np.exp(x))
    root, weight = np.polynomial.legendre.leggauss(12)
    width = np.diff(y)[:, None]
    inside = y[:-1, None] + width * (root + 1) / 2
    area = weight * width / 2 * shear(inside)
    f = SMOOTHEST + np.concatenate([[0], np.cumsum(area.sum(axis=1))])
    # integration by parts: what the shear inside of an interval adds to the integral of the speed
    rise = f[:-1] * width[:, 0] + (area * (y[1:, None] - inside)).sum(axis=1)
    h = SMOOTHEST**2 / 2 + np.concatenate([[0], np.cumsum(rise)])
    length = _mixing_length(y)
    slope = -KARMAN * np.expm1(-y / DAMPING) + KARMAN * y / DAMPING * np.exp(-y / DAMPING)
    bend = -2 * length * slope * g**2 / np.sqrt(1 + 4 * length**2)
    first = np.stack([f, y * g, y * g + y**2 * bend], axis=1)
    second = np.stack([h, y * f, y * f + y**2 * g], axis=1)
    return _polynomials(x, first), _polynomials(x, second)


def _polynomials(x: FloatArray, derivatives: FloatArray) -> PPoly:
    # the power basis is evaluated several times faster than Bernstein's
    return PPoly.from_bernstein_basis(BPoly.from_derivatives(x, derivatives))
