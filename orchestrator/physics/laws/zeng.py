"""Zeng et al.: a fixed sphere at a wall in a shear flow, from direct numerical simulation."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.constants import INVERSE_KARMAN
from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import ForceLaw
from orchestrator.physics.near_bed import bridge, viscous_length

TORQUE_ARM = 2 * 0.944 / (3 * 1.7005) / 2
"""Torque over drag in units of d, 0.185: 0.944 (4 pi mu G R^3) over 1.7005 (6 pi mu G R^2).

Values of a sphere that touches the wall in creeping flow (M. E. O'Neill, 1968; A. J. Goldman et
al., 1967, doi:10.1016/0009-2509(67)80048-4). Both agree with a public table after the second;
1.7005 is also the limit of Zeng's drag.
"""


class Zeng(ForceLaw):
    """Drag and lift on a sphere at a wall in shear; the lift is that in contact with the wall.

    C_D is that of a gap z0 under the grain (their Eqs. 13 and 14), C_L that of no gap (Eq. 19).
    The simulations have a linear profile and no roughness. Here the speed at the centre is bridged
    between that of the linear and that of the logarithmic profile at the height d/2 + z0. Above
    Re* of about 10, where the profile bends, it is an extrapolation.

    The coefficients, the equations' numbers and the limit 5.87 of C_L at Re -> 0 (Leighton and
    Acrivos, 1985) agree with waLBerla (ForcesOnSphereNearPlane), which takes Re from the speed at
    the centre as here. The lift ignores `lift_coefficient`.
    """

    name: ClassVar[str] = "zeng"
    label: ClassVar[str] = "Zeng et al. 2009, no torque"
    reference: ClassVar[str] = (
        "L. Zeng, F. Najjar, S. Balachandar and P. Fischer, Phys. Fluids 21, 033302, 2009"
    )
    drag_law: ClassVar[str] = "Zeng et al."
    drag_end: ClassVar[float] = 200.0

    def speed(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Speed at the grain's centre, m/s."""
        viscous = np.asarray(exposure.viscosity / viscous_length(exposure))
        rough = np.asarray(INVERSE_KARMAN * np.log1p(0.5 / exposure.ratio))
        return bridge(np.asarray(ustar, float), viscous, rough)

    def drag(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Drag, N."""
        e, gap, speed = exposure, exposure.ratio, self.speed(ustar, exposure)
        reynolds = speed * e.diameter / e.viscosity
        wall = 1 + 0.138 * np.exp(-2 * gap) + 9 / (16 * (1 + 2 * gap))
        a = 0.15 - 0.046 * (1 - 0.16 * gap**2) * np.exp(-0.7 * gap)
        b = 0.687 + 0.066 * (1 - 0.76 * gap**2) * np.exp(-(gap**0.9))
        stokes = 3 * np.pi * e.fluid_density * e.viscosity * e.diameter * speed
        return np.asarray(stokes * wall * (1 + a * reynolds**b))

    def lift(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Lift in contact with the wall, N."""
        e, speed = exposure, self.speed(ustar, exposure)
        reynolds = speed * e.diameter / e.viscosity
        coefficient = 3.663 / (reynolds**2 + 0.1173) ** 0.22
        return np.asarray(np.pi / 8 * e.fluid_density * e.diameter**2 * speed**2 * coefficient)


class ZengTorque(Zeng):
    """The same forces, and the torque of the drag about the grain's centre.

    The shear pulls more at the top than at the bottom: in creeping flow the drag acts 0.37 R above
    the centre. That arm is kept at every Reynolds number, for want of one that depends on it.
    """

    name: ClassVar[str] = "zeng-torque"
    label: ClassVar[str] = "Zeng et al. 2009, with torque"
    turns: ClassVar[bool] = True

    def torque(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Torque about the centre, N m."""
        return np.asarray(TORQUE_ARM * exposure.diameter * self.drag(ustar, exposure))
