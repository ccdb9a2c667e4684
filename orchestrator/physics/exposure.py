"""The surroundings of an exposed grain: all that its force depends on besides the flow's stress."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.physics.constants import LIFT_COEFFICIENT

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, init=False, eq=False)
class Exposure:
    """An exposed grain and the fluid around it; the fields broadcast together.

    Parameters
    ----------
    diameter : array_like
        d, m.
    roughness : array_like
        Roughness length z0 of the bed, m; it stands for the gap delta under the grain as well.
    fluid_density : array_like
        rho_f, kg/m3.
    viscosity : array_like
        Kinematic viscosity nu, m2/s.
    lift_coefficient : array_like
        alpha_s of Eqs. 2 and 4; laws with a lift of their own ignore it.
    gap : array_like, optional
        Height of the grain's lowest point over the level at which the flow begins, m; by default
        z0. Laws that do not `protrude` ignore it.
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

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape that the fields broadcast to."""
        return np.broadcast_shapes(*(field.shape for field in self.fields))

    def take(self, number: int) -> "Exposure":
        """One grain of those that the fields broadcast to."""
        return Exposure(*(np.broadcast_to(field, self.shape)[..., number] for field in self.fields))

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
