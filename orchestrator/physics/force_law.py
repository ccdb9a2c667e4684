"""Force laws: the forces of the flow on an exposed grain, and the range that they hold in."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.constants import LIFT_COEFFICIENT
from orchestrator.physics.velocity import smooth_wall_roughness
from orchestrator.types import BoolArray, FloatArray

SUBLAYER = 5.0
"""Thickness of the viscous sublayer, wall units."""
SMOOTH_END = 1.25
"""Largest speed over that above a smooth wall; for z0 = d/1000 it is at most 1.2."""


@dataclass(frozen=True, init=False, eq=False)
class Exposure:
    """An exposed grain and the fluid around it in SI units; the fields broadcast together.

    Laws with a lift of their own ignore the `lift_coefficient` alpha_s of Eqs. 2 and 4. `gap` is
    the height of the grain's lowest point over the level at which the flow begins, by default z0;
    laws that do not `protrude` ignore it.
    """

    diameter: FloatArray
    roughness: FloatArray
    fluid_density: FloatArray
    viscosity: FloatArray
    lift_coefficient: FloatArray
    gap: FloatArray

    def __init__(
        self,
        diameter: ArrayLike,
        roughness: ArrayLike,
        fluid_density: ArrayLike,
        viscosity: ArrayLike,
        lift_coefficient: ArrayLike = LIFT_COEFFICIENT,
        gap: ArrayLike | None = None,
    ) -> None:
        height = roughness if gap is None else gap
        given = (diameter, roughness, fluid_density, viscosity, lift_coefficient, height)
        for name, value in zip(self.__dataclass_fields__, given, strict=True):
            object.__setattr__(self, name, np.asarray(value, float))

    @property
    def fields(self) -> tuple[FloatArray, ...]:
        """The six fields in their order, for calls that pass them on as arguments."""
        return tuple(getattr(self, name) for name in self.__dataclass_fields__)

    def zeros(self, ustar: ArrayLike) -> FloatArray:
        """Zeros of the shape that the fields and a friction velocity broadcast to."""
        return np.zeros(np.broadcast_shapes(np.shape(ustar), *(f.shape for f in self.fields)))

    @property
    def ratio(self) -> FloatArray:
        """Roughness length over diameter, z0/d."""
        return np.asarray(self.roughness / self.diameter)

    def reynolds(self, ustar: ArrayLike) -> FloatArray:
        """Friction Reynolds number Re* = ustar d/nu of a friction velocity (m/s)."""
        return np.asarray(np.asarray(ustar, float) * self.diameter / self.viscosity)

    def ustar(self, reynolds: ArrayLike) -> FloatArray:
        """Friction velocity (m/s) of a friction Reynolds number."""
        return np.asarray(np.asarray(reynolds, float) * self.viscosity / self.diameter)


@dataclass(frozen=True)
class SphereDrag:
    """Drag of a sphere in a uniform stream, C_D = (24/Re) factor(Re), for Re = V d/nu < highest."""

    name: str
    factor: Callable[[FloatArray], FloatArray]
    highest: float

    def force(self, speed: FloatArray, at: Exposure) -> FloatArray:
        """Drag (N) of a stream at a speed (m/s): 3 pi rho nu d V factor."""
        stokes = 3 * np.pi * at.fluid_density * at.viscosity * at.diameter * speed
        return np.asarray(stokes * self.factor(speed * at.diameter / at.viscosity))


def _schiller_naumann(reynolds: FloatArray) -> FloatArray:
    return np.asarray(1 + 0.15 * reynolds**0.687)


def _clift_gauvin(reynolds: FloatArray) -> FloatArray:
    # 0.42/(1 + 42500 Re^-1.16) over 24/Re, multiplied out so that Re = 0 needs no division by it
    newton = 0.42 / 24 * reynolds**2.16 / (reynolds**1.16 + 42500)
    return np.asarray(_schiller_naumann(reynolds) + newton)


STOKES = SphereDrag("Stokes", np.ones_like, np.inf)
"""The drag of Eq. 2, which ends with the range of Re* of that equation."""
SCHILLER_NAUMANN = SphereDrag("Schiller and Naumann", _schiller_naumann, 1000.0)
"""The drag of Eq. 4 (Z. VDI 77, 1933), in common use up to Re = 1000."""
CLIFT_GAUVIN = SphereDrag("Clift and Gauvin", _clift_gauvin, 3e5)
"""Schiller and Naumann's drag and a term of inertia, up to the drag crisis at 3e5. Coefficients and
limit agree in several public codes."""


@dataclass(frozen=True)
class Validity:
    """The range of one quantity in which a law holds: low <= value < high."""

    quantity: str
    value: FloatArray
    low: float
    high: float

    @property
    def holds(self) -> BoolArray:
        """Whether the quantity is in its range; NaN is not."""
        return np.asarray((self.value >= self.low) & (self.value < self.high))

    def text(self, value: float) -> str:
        """Which limit a value is beyond, in words; empty for one in the range."""
        if self.low <= value < self.high:
            return ""
        if np.isnan(value):
            return f"{self.quantity} is not a number"
        side = f"below {self.low:g}" if value < self.low else f"not below {self.high:g}"
        return f"{self.quantity} {float(f'{value:.3g}'):g} is {side}"


def reasons(ranges: Iterable[Validity], count: int) -> list[str]:
    """The limits that each of some grains is beyond, in words; empty where all ranges hold."""
    texts = [map(each.text, np.broadcast_to(each.value, count).tolist()) for each in ranges]
    return ["; ".join(filter(None, row)) for row in zip(*texts, strict=True)]


class ForceLaw(ABC):
    """Drag along the bed, lift normal to it and a torque, as functions of the friction velocity.

    All methods are vectorised: `ustar` (m/s, >= 0) and the fields of the exposure broadcast.
    """

    name: ClassVar[str]
    """Key of the registry and of study files."""
    label: ClassVar[str]
    """Name in legends."""
    reference: ClassVar[str]
    """Source, with a DOI where one could be verified."""
    unverified: ClassVar[str] = ""
    """What its source did not confirm. Such a law takes part in no score; no answer is usable."""
    reynolds: ClassVar[tuple[float, float]] = (0.0, np.inf)
    """Range of Re* in which the law holds: low <= Re* < high."""
    drag_law: ClassVar[str] = "the drag law"
    drag_end: ClassVar[float] = np.inf
    """Particle Reynolds number at which the drag law ends."""
    turns: ClassVar[bool] = False
    """Whether the flow also turns the grain about its centre."""
    protrudes: ClassVar[bool] = False
    """Whether a grain's own height over the bed matters to its forces."""

    @abstractmethod
    def speed(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Speed of the flow that the drag is computed with, m/s."""

    @abstractmethod
    def drag(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Drag in the direction of the flow, N."""

    @abstractmethod
    def lift(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Lift away from the bed, N."""

    def torque(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Torque of the flow about the grain's centre, forwards, N m; none by default."""
        return at.zeros(ustar)

    def particle_reynolds(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Particle Reynolds number V d/nu."""
        speed = self.speed(ustar, at)
        return np.asarray(speed * at.diameter / at.viscosity)

    def speed_over_smooth(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Speed of the flow over that with the roughness length of a smooth wall added to z0.

        A smooth wall bounds the speed over a bed that is far smoother than its grains are large.
        1 where the grain lies within the viscous sublayer, Re* < 5.
        """
        reynolds = at.reynolds(ustar)
        with np.errstate(all="ignore"):
            wall = smooth_wall_roughness(np.maximum(ustar, at.ustar(SUBLAYER)), at.viscosity)
            rest = (at.fluid_density, at.viscosity, at.lift_coefficient, at.gap)
            smooth = Exposure(at.diameter, at.roughness + wall, *rest)
            over = self.speed(ustar, at) / self.speed(ustar, smooth)
        return np.asarray(np.where(reynolds < SUBLAYER, 1.0, over))

    def ranges(self, ustar: ArrayLike, at: Exposure) -> tuple[Validity, ...]:
        """The ranges that the law holds in; a law with more of them adds its own."""
        reynolds = at.reynolds(ustar)
        particle = self.particle_reynolds(ustar, at)
        over = self.speed_over_smooth(ustar, at)
        return (
            Validity("Re*", reynolds, *self.reynolds),
            Validity(f"particle Reynolds number ({self.drag_law})", particle, 0.0, self.drag_end),
            Validity("speed over that above a smooth wall", over, 0.0, SMOOTH_END),
        )

    def valid(self, ustar: ArrayLike, at: Exposure) -> BoolArray:
        """Whether the law holds: in its range of Re* and in all its other ranges."""
        every = (each.holds for each in self.ranges(ustar, at))
        return np.asarray(np.logical_and.reduce(np.broadcast_arrays(*every)))


class DragAndSaffman(ForceLaw):
    """Drag of a sphere and Saffman's lift on a speed and a shear: the forces of Eqs. 2 and 4.

    P. G. Saffman, J. Fluid Mech. 22, 1965, doi:10.1017/S0022112065000824, with the coefficient of
    its correction of 1968. A law names a sphere's drag and gives the flow around the grain.
    """

    sphere: ClassVar[SphereDrag]

    def __init_subclass__(cls) -> None:
        """Take the name and the end of the drag from the sphere's."""
        super().__init_subclass__()
        cls.drag_law, cls.drag_end = cls.sphere.name, cls.sphere.highest

    @abstractmethod
    def around(self, ustar: ArrayLike, at: Exposure) -> tuple[FloatArray, FloatArray]:
        """Mean speed (m/s) and shear (1/s) of the flow around the grain."""

    def speed(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Mean speed of the flow around the grain, m/s."""
        return self.around(ustar, at)[0]

    def drag(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Drag of the sphere at the speed of the flow around it, N."""
        return self.sphere.force(self.speed(ustar, at), at)

    def lift(self, ustar: ArrayLike, at: Exposure) -> FloatArray:
        """Saffman's lift, N: alpha_s rho sqrt(nu) d^2 V sqrt(du/dz).

        Eq. 4 prints the root of ``(du/dz)/ustar``; its dimension needs ``d (du/dz)/ustar``.
        """
        scale = at.lift_coefficient * at.fluid_density * np.sqrt(at.viscosity) * at.diameter**2
        speed, shear = self.around(ustar, at)
        return np.asarray(scale * speed * np.sqrt(shear))
