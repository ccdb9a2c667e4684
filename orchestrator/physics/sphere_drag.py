"""Drag laws of a sphere in a uniform stream, each as a factor on Stokes' drag with its range."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from orchestrator.physics.exposure import Exposure, FloatArray


@dataclass(frozen=True)
class SphereDrag:
    """A drag law C_D = (24/Re) factor(Re), Re = V d/nu.

    Attributes
    ----------
    name : str
        Authors.
    factor : callable
        Factor on Stokes' drag, of the particle Reynolds number; 1 at zero.
    highest : float
        Particle Reynolds number at which the law ends.
    reference : str
        Where it was published.
    """

    name: str
    factor: Callable[[FloatArray], FloatArray]
    highest: float
    reference: str

    def force(self, speed: FloatArray, exposure: Exposure) -> FloatArray:
        """Drag (N) of a stream at a speed (m/s): 3 pi rho nu d V factor."""
        e = exposure
        stokes = 3 * np.pi * e.fluid_density * e.viscosity * e.diameter * speed
        return np.asarray(stokes * self.factor(speed * e.diameter / e.viscosity))


def _schiller_naumann(reynolds: FloatArray) -> FloatArray:
    return np.asarray(1 + 0.15 * reynolds**0.687)


def _clift_gauvin(reynolds: FloatArray) -> FloatArray:
    # 0.42/(1 + 42500 Re^-1.16) over 24/Re, multiplied out so that Re = 0 needs no division by it
    newton = 0.42 / 24 * reynolds**2.16 / (reynolds**1.16 + 42500)
    return np.asarray(_schiller_naumann(reynolds) + newton)


STOKES = SphereDrag("Stokes", np.ones_like, np.inf, "G. G. Stokes, 1851")
"""The drag of Eq. 2; what ends it is the range of Re* of that equation."""

SCHILLER_NAUMANN = SphereDrag(
    "Schiller and Naumann",
    _schiller_naumann,
    1000.0,
    "L. Schiller and A. Naumann, Z. VDI 77, 1933",
)
"""The drag of Eq. 4; the paper's expression, which is in common use up to Re = 1000."""

CLIFT_GAUVIN = SphereDrag(
    "Clift and Gauvin",
    _clift_gauvin,
    3e5,
    "R. Clift and W. H. Gauvin, Can. J. Chem. Eng. 49, 1971, doi:10.1002/cjce.5450490403",
)
"""Schiller and Naumann's drag and a term of inertia, up to the drag crisis.

The coefficients, the DOI and the limit of 3e5 agree in several public codes that cite it; the
article itself was not at hand.
"""
