"""The logarithmic law between friction velocity and the speeds that a field user measures."""

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.constants import KARMAN
from orchestrator.physics.exposure import FloatArray


def log_law_ustar(
    speed: ArrayLike, height: ArrayLike, roughness: ArrayLike, *, printed: bool = False
) -> FloatArray:
    """Eq. 10: friction velocity (m/s) from the tangential speed at a height above the bed.

    The rough wall's own profile is ``ln((z + z0)/z0)``; the paper prints ``ln(z/z0)``, which
    changes its sign below z0.
    """
    return np.asarray(KARMAN * np.asarray(speed, float) / _log(height, roughness, printed=printed))


def log_law_speed(ustar: ArrayLike, height: ArrayLike, roughness: ArrayLike) -> FloatArray:
    """Mean speed (m/s) at a height over a bed of roughness length z0 (m), the inverse of Eq. 10.

    It is the wind at 1 m or 10 m over a flat bed whose roughness is that of its grains: with
    anything else that is rough upwind, or with grains in the air, it is another.
    """
    return np.asarray(np.asarray(ustar, float) / KARMAN * _log(height, roughness))


def smooth_wall_roughness(ustar: ArrayLike, viscosity: ArrayLike) -> FloatArray:
    """Roughness length of a hydraulically smooth wall, 0.11 nu/u*, m (Nikuradse 1933).

    A wall has the larger of this length and that of its grains.
    """
    return np.asarray(0.11 * np.asarray(viscosity, float) / np.asarray(ustar, float))


def depth_mean_speed(ustar: ArrayLike, depth: ArrayLike, roughness: ArrayLike) -> FloatArray:
    """Depth-averaged speed (m/s) of wide open water of a depth (m) with that profile up to its top.

    The mean of ``ln((z + z0)/z0)`` from 0 to h is ``(1 + z0/h) ln(1 + h/z0) - 1``. For a river
    u* = sqrt(g h S) belongs to it, S the slope of its surface.
    """
    part = np.asarray(roughness, float) / np.asarray(depth, float)
    mean = (1 + part) * _log(depth, roughness) - 1
    return np.asarray(np.asarray(ustar, float) / KARMAN * mean)


def _log(height: ArrayLike, roughness: ArrayLike, *, printed: bool = False) -> FloatArray:
    over = np.asarray(height, float) / np.asarray(roughness, float)
    return np.asarray(np.log(over) if printed else np.log1p(over))
