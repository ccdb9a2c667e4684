"""Speed and shear of the flow around a grain that lies a gap z0 above the bed.

Fig. 3 of the paper has two profiles: linear in a viscous flow, logarithmic in a rough one. Between
them viscosity and turbulence carry the stress together, at the scale of the grain.
"""

import numpy as np

from orchestrator.physics.constants import INVERSE_KARMAN
from orchestrator.physics.exposure import Exposure, FloatArray


def viscous_length(exposure: Exposure) -> FloatArray:
    """Height of the grain's centre d/2 + z0, m: the mean viscous speed is ustar^2/nu times it."""
    return np.asarray(exposure.diameter / 2 + exposure.roughness)


def rough_speed(exposure: Exposure) -> FloatArray:
    """V_f/ustar of Eq. 4: the logarithmic profile averaged from z0 to z0 + d."""
    r = exposure.ratio
    return np.asarray(INVERSE_KARMAN * ((1 + r) * np.log1p(1 / r) - 1))


def rough_gradient(exposure: Exposure) -> FloatArray:
    """(du/dz)/ustar of Eq. 4, averaged alike, 1/m."""
    return np.asarray(INVERSE_KARMAN * np.log1p(1 / exposure.ratio) / exposure.diameter)


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
