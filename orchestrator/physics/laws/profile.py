"""The forces of Eqs. 2 and 4 on one velocity profile, from the sublayer to the rough wall."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import Bound, DragAndSaffman
from orchestrator.physics.rough_wall import ROUGHEST, layer, shift
from orchestrator.physics.sphere_drag import SCHILLER_NAUMANN

SAND_GRAIN = 30.0
"""Nikuradse's equivalent sand-grain roughness over z0."""


class Profile(DragAndSaffman):
    """Schiller and Naumann's drag and Saffman's lift on van Driest's profile over a rough wall.

    Speed and shear are averaged from z0 to z0 + d as in Eqs. 2 and 4, with ks = 30 z0. Re* -> 0 is
    Eq. 2 exactly; Eq. 4 is not reached, since the correlation of the shift ends before.
    """

    name: ClassVar[str] = "profile"
    label: ClassVar[str] = "profile (van Driest)"
    reference: ClassVar[str] = (
        "E. R. van Driest, 1956; J. Rotta, 1962; T. Cebeci and K. C. Chang, 1978, as in "
        "code_saturne, cs_wall_functions_2scales_vdriest"
    )
    sphere = SCHILLER_NAUMANN

    def speed(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Mean speed around the grain, m/s."""
        u = np.asarray(ustar, float)
        return np.asarray(u * _around(u, exposure)[0])

    def gradient(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Mean shear around the grain, 1/s."""
        u = np.asarray(ustar, float)
        return np.asarray(u**2 / exposure.viscosity * _around(u, exposure)[1])

    def bounds(self, ustar: ArrayLike, exposure: Exposure) -> tuple[Bound, ...]:
        """The bounds of every law, and that of the correlation of the shift."""
        roughness = SAND_GRAIN * exposure.ratio * exposure.reynolds(ustar)
        rough = Bound("roughness ks u*/nu (Cebeci and Chang)", roughness, 0.0, ROUGHEST)
        return (*super().bounds(ustar, exposure), rough)


def _around(ustar: FloatArray, exposure: Exposure) -> tuple[FloatArray, FloatArray]:
    """Mean speed and shear around the grain in wall units."""
    # a mean over no height at all is the limit of that over little
    d = np.maximum(exposure.reynolds(ustar), 1e-100)
    base = exposure.ratio * d
    return layer(base, base + d, shift(SAND_GRAIN * base))
