"""One law for every Re*: Eqs. 2 and 4 are the same forces on two profiles, bridged here."""

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import DragAndSaffman
from orchestrator.physics.near_bed import bridge, rough_gradient, rough_speed, viscous_length
from orchestrator.physics.sphere_drag import CLIFT_GAUVIN, SCHILLER_NAUMANN

MODEL = "a model of this program: Eqs. 2 and 4 of the paper on a stress that is carried together"


class Bridged(DragAndSaffman):
    """Drag and lift where viscosity and turbulence carry the stress together.

    At the scale of the grain ``ustar^2 = nu V/(d/2 + z0) + (V/c_V)^2`` and
    ``ustar^2 = nu G + (G/c_G)^2``, with c_V and c_G of Eq. 4. No new constant; Re* -> 0 is Eq. 2
    and Re* -> infinity is Eq. 4, both exactly.
    """

    name: ClassVar[str] = "bridged"
    label: ClassVar[str] = "bridged"
    reference: ClassVar[str] = MODEL
    protrudes: ClassVar[bool] = True
    sphere = SCHILLER_NAUMANN

    def speed(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Mean speed around the grain, m/s."""
        viscous = np.asarray(exposure.viscosity / viscous_length(exposure))
        return bridge(np.asarray(ustar, float), viscous, rough_speed(exposure))

    def gradient(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Mean shear around the grain, 1/s."""
        return bridge(np.asarray(ustar, float), exposure.viscosity, rough_gradient(exposure))


class BridgedGravel(Bridged):
    """The bridged flow with a drag that goes on to a particle Reynolds number of 3e5.

    Coarse sand and gravel in water lie beyond Schiller and Naumann's 1000; Clift and Gauvin's drag
    is 5 % above theirs at 800 and tends to C_D = 0.42 with the rest of the drag still falling.
    """

    name: ClassVar[str] = "bridged-gravel"
    label: ClassVar[str] = "bridged, drag of Clift & Gauvin"
    reference: ClassVar[str] = f"{MODEL}; drag: {CLIFT_GAUVIN.reference}"
    sphere = CLIFT_GAUVIN
