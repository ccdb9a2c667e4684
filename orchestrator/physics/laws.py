"""The force laws. A new law is a class of this file and an entry in `LAWS`."""

import difflib
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.errors import InputError
from orchestrator.physics import velocity
from orchestrator.physics.constants import INVERSE_KARMAN
from orchestrator.physics.force_law import (
    CLIFT_GAUVIN,
    SCHILLER_NAUMANN,
    STOKES,
    DragAndSaffman,
    Exposure,
    ForceLaw,
    Validity,
)
from orchestrator.types import FloatArray

MODEL = "a model of this program: Eqs. 2 and 4 of the paper on a stress that is carried together"
SAND_GRAIN = 30.0
"""Nikuradse's equivalent sand-grain roughness over z0."""


class Low(DragAndSaffman):
    """Stokes' drag and Saffman's lift on the linear profile u = z ustar^2/nu (Eq. 2)."""

    name: ClassVar[str] = "low"
    label: ClassVar[str] = "Eq. 2 (low Re*)"
    reference: ClassVar[str] = "the paper, Eq. 2, after C.-H. Ling, J. Hydraul. Eng. 121, 1995"
    reynolds: ClassVar[tuple[float, float]] = (0.0, 3.0)
    protrudes: ClassVar[bool] = True
    sphere = STOKES

    def around(self, ustar: ArrayLike, at: Exposure) -> tuple[FloatArray, FloatArray]:
        """Mean speed from z0 to z0 + d, and ustar^2/nu."""
        shear = np.asarray(np.square(ustar) / at.viscosity)
        return shear * velocity.viscous_length(at.diameter, at.gap), shear


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

    def around(self, ustar: ArrayLike, at: Exposure) -> tuple[FloatArray, FloatArray]:
        """Means from z0 to z0 + d."""
        grain = (at.diameter, at.roughness, at.gap)
        speed, shear = velocity.rough_speed(*grain), velocity.rough_gradient(*grain)
        return np.multiply(ustar, speed), np.multiply(ustar, shear)


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

    def around(self, ustar: ArrayLike, at: Exposure) -> tuple[FloatArray, FloatArray]:
        """Means over the height of the grain."""
        u, grain = np.asarray(ustar, float), (at.diameter, at.roughness, at.gap)
        viscous = np.asarray(at.viscosity / velocity.viscous_length(at.diameter, at.gap))
        speed = velocity.bridge(u, viscous, velocity.rough_speed(*grain))
        return speed, velocity.bridge(u, at.viscosity, velocity.rough_gradient(*grain))


class BridgedGravel(Bridged):
    """The bridged flow with a drag that goes on to a particle Reynolds number of 3e5.

    Coarse sand and gravel in water lie beyond Schiller and Naumann's 1000; Clift and Gauvin's drag
    is 5 % above theirs at 800 and tends to C_D = 0.42 with the rest of the drag still falling.
    """

    name: ClassVar[str] = "bridged-gravel"
    label: ClassVar[str] = "bridged, drag of Clift & Gauvin"
    reference: ClassVar[str] = (
        f"{MODEL}; drag: R. Clift and W. H. Gauvin, Can. J. Chem. Eng. 49, 1971, "
        "doi:10.1002/cjce.5450490403"
    )
    sphere = CLIFT_GAUVIN


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

    def around(self, ustar: ArrayLike, at: Exposure) -> tuple[FloatArray, FloatArray]:
        """Means from z0 to z0 + d."""
        # a mean over no height at all is the limit of that over little
        d = np.maximum(at.reynolds(ustar), 1e-100)
        base = at.ratio * d
        speed, shear = velocity.layer(base, base + d, velocity.shift(SAND_GRAIN * base))
        return np.multiply(ustar, speed), np.asarray(np.square(ustar) / at.viscosity * shear)

    def ranges(self, ustar: ArrayLike, at: Exposure) -> tuple[Validity, ...]:
        """The ranges of every law, and that of the correlation of the shift."""
        roughness = SAND_GRAIN * at.ratio * at.reynolds(ustar)
        rough = Validity("roughness ks u*/nu (Cebeci and Chang)", roughness, 0.0, velocity.ROUGHEST)
        return (*super().ranges(ustar, at), rough)


class ClaudinAndreotti(ForceLaw):
    """Drag (pi/8) rho d^2 (sqrt(C) U + s sqrt(nu U/d))^2 at the speed U of the grain's centre.

    ``ustar^2 = 2 nu U/d + (0.4/ln(1 + d/(2 z0)))^2 U^2``: the bridge of `bridged`, on the speed at
    d/2. C = 1 is the drag coefficient of natural grains in a rough flow (a sphere's is 0.44), and
    s = 5 near Stokes' sqrt(24). They take z0 = d/30; the roughness is the scene's here. There is no
    lift. No stored copy of the article or of a code with these equations was found.
    """

    name: ClassVar[str] = "claudin-andreotti"
    label: ClassVar[str] = "Claudin & Andreotti 2006 (unverified)"
    reference: ClassVar[str] = (
        "P. Claudin and B. Andreotti, Earth Planet. Sci. Lett. 252, 2006, arXiv:cond-mat/0603656"
    )
    unverified: ClassVar[str] = "its equations are quoted from memory"
    drag_coefficients: ClassVar[tuple[float, float]] = (1.0, 5.0)
    karman: ClassVar[float] = 0.4

    def speed(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Speed at the height d/2, m/s."""
        viscous = np.asarray(2 * at.viscosity / at.diameter)
        rough = np.asarray(np.log1p(0.5 / at.ratio) / self.karman)
        return velocity.bridge(np.asarray(ustar, float), viscous, rough)

    def drag(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Drag, N."""
        u, (rough, viscous) = self.speed(ustar, at), self.drag_coefficients
        root = np.sqrt(rough) * u + viscous * np.sqrt(at.viscosity * u / at.diameter)
        return np.asarray(np.pi / 8 * at.fluid_density * at.diameter**2 * root**2)

    def lift(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """No lift, N."""
        return at.zeros(ustar)


class Zeng(ForceLaw):
    """Drag and lift on a sphere at a wall in shear; the lift is that in contact with the wall.

    C_D is that of a gap z0 under the grain (their Eqs. 13 and 14), C_L that of no gap (Eq. 19).
    The simulations have a linear profile and no roughness. Here the speed at the centre is bridged
    between that of the linear and that of the logarithmic profile at the height d/2 + z0. Above
    Re* of about 10, where the profile bends, it is an extrapolation. The lift ignores
    `lift_coefficient`.

    The coefficients, the equations' numbers and the limit 5.87 of C_L at Re -> 0 (Leighton and
    Acrivos, 1985) agree with waLBerla (ForcesOnSphereNearPlane), which takes Re from the speed at
    the centre as here.
    """

    name: ClassVar[str] = "zeng"
    label: ClassVar[str] = "Zeng et al. 2009, no torque"
    reference: ClassVar[str] = (
        "L. Zeng, F. Najjar, S. Balachandar and P. Fischer, Phys. Fluids 21, 033302, 2009"
    )
    drag_law: ClassVar[str] = "Zeng et al."
    drag_end: ClassVar[float] = 200.0

    def speed(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Speed at the grain's centre, m/s."""
        viscous = np.asarray(at.viscosity / velocity.viscous_length(at.diameter, at.gap))
        rough = np.asarray(INVERSE_KARMAN * np.log1p(0.5 / at.ratio))
        return velocity.bridge(np.asarray(ustar, float), viscous, rough)

    def drag(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Drag, N."""
        gap, speed = at.ratio, self.speed(ustar, at)
        reynolds = speed * at.diameter / at.viscosity
        wall = 1 + 0.138 * np.exp(-2 * gap) + 9 / (16 * (1 + 2 * gap))
        a = 0.15 - 0.046 * (1 - 0.16 * gap**2) * np.exp(-0.7 * gap)
        b = 0.687 + 0.066 * (1 - 0.76 * gap**2) * np.exp(-(gap**0.9))
        stokes = 3 * np.pi * at.fluid_density * at.viscosity * at.diameter * speed
        return np.asarray(stokes * wall * (1 + a * reynolds**b))

    def lift(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Lift in contact with the wall, N."""
        speed = self.speed(ustar, at)
        reynolds = speed * at.diameter / at.viscosity
        coefficient = 3.663 / (reynolds**2 + 0.1173) ** 0.22
        return np.asarray(np.pi / 8 * at.fluid_density * at.diameter**2 * speed**2 * coefficient)


class ZengTorque(Zeng):
    """The same forces, and the torque of the drag about the grain's centre.

    The shear pulls more at the top than at the bottom: the drag of a sphere that touches the wall
    in creeping flow acts 0.37 R above the centre, 0.944 (4 pi mu G R^3) over 1.7005 (6 pi mu G R^2)
    (M. E. O'Neill, 1968; A. J. Goldman et al., 1967, doi:10.1016/0009-2509(67)80048-4). Both
    numbers agree with a public table after the second; 1.7005 is also the limit of Zeng's drag.
    The arm is kept at every Reynolds number.
    """

    name: ClassVar[str] = "zeng-torque"
    label: ClassVar[str] = "Zeng et al. 2009, with torque"
    turns: ClassVar[bool] = True
    arm: ClassVar[float] = 2 * 0.944 / (3 * 1.7005) / 2
    """Torque over drag, d."""

    def torque(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Torque about the centre, N m."""
        return np.asarray(self.arm * at.diameter * self.drag(ustar, at))


_EVERY = (Low, High, Bridged, BridgedGravel, Profile, ClaudinAndreotti, Zeng, ZengTorque)
LAWS: dict[str, ForceLaw] = {law_class.name: law_class() for law_class in _EVERY}
"""Every force law by its name."""


def law(name: str) -> ForceLaw:
    """The force law of a name.

    Raises
    ------
    InputError
        If no law has that name; it lists the laws.
    """
    if name in LAWS:
        return LAWS[name]
    close = difflib.get_close_matches(name, LAWS, n=1)
    hint = f"did you mean {close[0]}? " if close else ""
    raise InputError(f"unknown force law {name!r}", remedy=f"{hint}known laws: {', '.join(LAWS)}")
