"""Speed and shear of the flow around a grain that lies a gap z0 above the bed.

Fig. 3 of the paper has two profiles: linear in a viscous flow, logarithmic in a rough one. Between
them viscosity and turbulence carry the stress together, at the scale of the grain.
"""

import numpy as np

from orchestrator.physics.constants import INVERSE_KARMAN
from orchestrator.physics.exposure import Exposure, FloatArray

HIDDEN = 1e-9
"""Part of a grain that the flow meets at least: one below its level feels next to nothing."""


def _met(exposure: Exposure, level: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The height of the lowest point that the flow meets, and the part of the diameter above it.

    The flow begins at some level, m.
    """
    bottom = np.maximum(exposure.gap, level)
    part = 1 - (bottom - exposure.gap) / exposure.diameter
    return bottom, np.maximum(part, HIDDEN)


def viscous_length(exposure: Exposure) -> FloatArray:
    """Mean height at which the flow meets the grain, m, for the linear profile of Eq. 2.

    The height of its centre d/2 + z0 where it lies z0 above the bed. The mean viscous speed is
    ustar^2/nu times it.
    """
    bottom, part = _met(exposure, np.zeros(()))
    return np.asarray(part * (part * exposure.diameter / 2 + bottom))


def rough_speed(exposure: Exposure) -> FloatArray:
    """V_f/ustar of Eq. 4: the logarithmic profile averaged from z0 to z0 + d.

    For a grain that stands higher or lower the profile is averaged over its own height.
    """
    r = exposure.ratio
    alike = INVERSE_KARMAN * ((1 + r) * np.log1p(1 / r) - 1)
    bottom, part = _met(exposure, exposure.roughness)
    low = bottom / exposure.roughness
    high = low + part / r
    own = INVERSE_KARMAN * (r * (high * np.log(high) - low * np.log(low)) - part)
    return np.asarray(np.where(exposure.gap == exposure.roughness, alike, np.maximum(own, HIDDEN)))


def rough_gradient(exposure: Exposure) -> FloatArray:
    """(du/dz)/ustar of Eq. 4, averaged alike, 1/m."""
    bottom, part = _met(exposure, exposure.roughness)
    met = np.log1p(part * exposure.diameter / bottom)
    alike = np.log1p(1 / exposure.ratio)
    own = np.where(exposure.gap == exposure.roughness, alike, met)
    return np.asarray(INVERSE_KARMAN * own / exposure.diameter)


def bridge(ustar: FloatArray, viscous: FloatArray, rough: FloatArray) -> FloatArray:
    """The positive root x of ``ustar^2 = viscous x + (x/rough)^2``.

    It is written without the difference of two near numbers, so that it is right to the last
    digits where either term is negligible.

    Parameters
    ----------
    ustar : ndarray
        Friction velocity, m/s.
    viscous : ndarray
        Stress over density that viscosity carries at x = 1: nu over a length for a speed (m/s),
        nu for a gradient (m2/s).
    rough : ndarray
        x/ustar where turbulence carries the stress alone.
    """
    return np.asarray(2 * ustar**2 / (viscous + np.hypot(viscous, 2 * ustar / rough)))


def saffman_lift(speed: FloatArray, gradient: FloatArray, exposure: Exposure) -> FloatArray:
    """Lift of Eqs. 2 and 4, N: alpha_s rho sqrt(nu) d^2 V sqrt(du/dz).

    Eq. 4 prints the root of ``(du/dz)/ustar``; its dimension needs ``d (du/dz)/ustar``, as here.
    """
    e = exposure
    scale = e.lift_coefficient * e.fluid_density * np.sqrt(e.viscosity) * e.diameter**2
    return np.asarray(scale * speed * np.sqrt(gradient))
