"""Eq. 2: a grain in a viscous flow."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import DragAndSaffman
from orchestrator.physics.near_bed import viscous_length
from orchestrator.physics.sphere_drag import STOKES


class Low(DragAndSaffman):
    """Stokes' drag and Saffman's lift on the linear profile u = z ustar^2/nu (Eq. 2)."""

    name: ClassVar[str] = "low"
    label: ClassVar[str] = "Eq. 2 (low Re*)"
    reference: ClassVar[str] = "the paper, Eq. 2, after C.-H. Ling, J. Hydraul. Eng. 121, 1995"
    reynolds: ClassVar[tuple[float, float]] = (0.0, 3.0)
    protrudes: ClassVar[bool] = True
    sphere = STOKES

    def speed(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Mean speed from z0 to z0 + d, m/s."""
        u = np.asarray(ustar, float)
        return np.asarray(u**2 * viscous_length(exposure) / exposure.viscosity)

    def gradient(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """ustar^2/nu, 1/s."""
        return np.asarray(np.asarray(ustar, float) ** 2 / exposure.viscosity)
