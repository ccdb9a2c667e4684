"""The threshold of motion of a grain where the stress meets the slope at an angle.

On a bed in three dimensions the flow goes up, down and across slopes. A grain in a
pocket that is alike all around leaves it when the moment of the forces along the bed,
drag and the weight's component together, exceeds that of the forces normal to it:
N. H. Brooks, discussion of Boundary shear stress in curved trapezoidal channels,
J. Hydraul. Div. ASCE 89 (HY3), 1963; W. Wu, Computational River Dynamics, 2007,
Eq. 3.46. Lift and cohesion are added here as the pivot of Eq. 1 has them.
"""

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import ForceLaw
from orchestrator.physics.threshold import least_ustar
from orchestrator.types import FloatArray, IntArray


def slope_along_deg(slope_deg: ArrayLike, heading_deg: ArrayLike) -> FloatArray:
    """Compute the slope that a flow meets in its own direction.

    Parameters
    ----------
    slope_deg
        Steepest slope of the bed, degrees.
    heading_deg
        Angle between the stress and the direction straight up the slope, degrees.

    Returns
    -------
    FloatArray
        Slope along the stress, degrees, negative where it goes down.

    Examples
    --------
    >>> print(slope_along_deg(30.0, [0.0, 90.0, 180.0]).round(9))
    [ 30.   0. -30.]
    """
    rise = np.sin(np.radians(np.asarray(slope_deg, float)))
    ahead = np.cos(np.radians(np.asarray(heading_deg, float)))
    return np.asarray(np.degrees(np.arcsin(rise * ahead)))


def threshold_across(law: ForceLaw, grain: Grain, heading_deg: ArrayLike) -> FloatArray:
    """Find the threshold of a grain under a stress at an angle to the slope.

    With the slope b, the heading c between the stress and the direction up the slope,
    and the entrainment angle beta, the grain leaves where

    ``|F| sin(beta) = (W cos(b) - f_l) cos(beta) + F_a sin(2 beta)``

    and F is the sum of two forces along the bed: drag, and the weight's W sin(b)
    straight down the slope. Without lift the drag over that on a level bed is ``cos(c)
    sin(b)/tan(p) + sqrt(cos(b)^2 - sin(c)^2 sin(b)^2/tan(p)^2)`` with ``p = 90 deg -
    beta``, which is that of Brooks. Straight up and down the slope it is that of
    `orchestrator.physics.threshold.threshold`, but where lift lets the grain roll back
    down a slope that the flow goes up.

    Parameters
    ----------
    law
        The force law.
    grain
        The grains, on the steepest slope b of the bed, at least 0.
    heading_deg
        Angle c between the stress and the direction straight up the slope, degrees.

    Returns
    -------
    FloatArray
        Threshold friction velocity, m/s, of the broadcast shape: 0 on a slope down
        which the grain rolls without a flow, infinite where no flow moves it, NaN where
        that is not known.

    Examples
    --------
    >>> from orchestrator.physics.laws import LAWS
    >>> sand = Grain(
    ...     diameter=1e-3,
    ...     density=2650.0,
    ...     fluid_density=1000.0,
    ...     viscosity=1e-6,
    ...     slope_deg=20.0,
    ...     entrainment_angle_deg=60.0,
    ... )
    >>> print(threshold_across(LAWS["bridged"], sand, [0.0, 90.0, 180.0]).round(5))
    [0.02468 0.01624 0.01177]
    """
    heading = np.radians(np.asarray(heading_deg, float))
    shape = np.broadcast_shapes(grain.shape, heading.shape)
    heading = np.broadcast_to(heading, shape).ravel()
    grains = grain.changed(slope_deg=np.broadcast_to(grain.slope_deg, shape)).flat
    slope = np.radians(grains.slope_deg)
    beta = np.radians(grains.entrainment_angle_deg)
    along = grains.weight * np.sin(slope) * np.sin(beta)
    down = along * np.cos(heading)
    aside = along * np.sin(heading)
    pull = grains.cohesion * grains.diameter * np.sin(2 * beta)
    held = grains.weight * np.cos(slope) * np.cos(beta) + pull

    def excess(ustar: FloatArray, places: IntArray) -> FloatArray:
        """Moment over d/2 along the bed less that which holds, N."""
        at = grains.at(places)
        drag = law.drag(ustar, at) * np.sin(beta[places]) - down[places]
        lift = law.lift(ustar, at) * np.cos(beta[places])
        return np.asarray(np.hypot(drag, aside[places]) + lift - held[places])

    found = least_ustar(excess, grains.ustar(1.0))
    return found.reshape(shape)
