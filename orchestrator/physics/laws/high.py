"""Eq. 4: a grain in a rough turbulent flow."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import DragAndSaffman
from orchestrator.physics.near_bed import rough_gradient, rough_speed
from orchestrator.physics.sphere_drag import SCHILLER_NAUMANN


class High(DragAndSaffman):
    """Schiller and Naumann's drag and Saffman's lift on the logarithmic profile (Eq. 4)."""

    name: ClassVar[str] = "high"
    label: ClassVar[str] = "Eq. 4 (high Re*)"
    reference: ClassVar[str] = (
        "the paper, Eq. 4 with d (du/dz)/ustar under the root of the lift, as its dimension needs; "
        "after C.-H. Ling, J. Hydraul. Eng. 121, 1995"
    )
    reynolds: ClassVar[tuple[float, float]] = (30.0, np.inf)
    protrudes: ClassVar[bool] = True
    sphere = SCHILLER_NAUMANN

    def speed(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Mean speed from z0 to z0 + d, m/s."""
        return np.asarray(np.asarray(ustar, float) * rough_speed(exposure))

    def gradient(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Mean shear from z0 to z0 + d, 1/s."""
        return np.asarray(np.asarray(ustar, float) * rough_gradient(exposure))
