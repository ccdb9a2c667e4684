"""Claudin and Andreotti's drag of natural grains, without a lift."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import ForceLaw
from orchestrator.physics.near_bed import bridge

KARMAN = 0.4
"""As they have it."""
ROUGH_DRAG = 1.0
"""C, the drag coefficient of natural grains in a rough flow; a sphere's is 0.44."""
VISCOUS_DRAG = 5.0
"""s; s^2 = 24 would be Stokes' drag."""


class ClaudinAndreotti(ForceLaw):
    """Drag (pi/8) rho d^2 (sqrt(C) U + s sqrt(nu U/d))^2 at the speed U of the grain's centre.

    ``ustar^2 = 2 nu U/d + (0.4/ln(1 + d/(2 z0)))^2 U^2``: the same bridge between the regimes as
    that of `bridged`, on the speed at d/2. They take z0 = d/30; the roughness is the scene's here.

    Quoted from memory and not confirmed: no stored copy of the article or of a code with these
    equations was found. That s^2 is near Stokes' 24 and that the speed has the right two limits
    is all that supports them here.
    """

    name: ClassVar[str] = "claudin-andreotti"
    label: ClassVar[str] = "Claudin & Andreotti 2006 (unverified)"
    unverified: ClassVar[str] = "its equations are quoted from memory"
    reference: ClassVar[str] = (
        "P. Claudin and B. Andreotti, Earth Planet. Sci. Lett. 252, 2006, arXiv:cond-mat/0603656"
    )

    def speed(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Speed at the height d/2, m/s."""
        viscous = np.asarray(2 * exposure.viscosity / exposure.diameter)
        rough = np.asarray(np.log1p(0.5 / exposure.ratio) / KARMAN)
        return bridge(np.asarray(ustar, float), viscous, rough)

    def drag(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Drag, N."""
        e, u = exposure, self.speed(ustar, exposure)
        root = np.sqrt(ROUGH_DRAG) * u + VISCOUS_DRAG * np.sqrt(e.viscosity * u / e.diameter)
        return np.asarray(np.pi / 8 * e.fluid_density * e.diameter**2 * root**2)

    def lift(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """No lift, N."""
        return np.zeros(np.broadcast_shapes(np.shape(ustar), exposure.shape))
