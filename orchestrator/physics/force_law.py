"""The seam of the force laws: what the flow does to an exposed grain at a friction velocity."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.near_bed import saffman_lift
from orchestrator.physics.sphere_drag import SphereDrag

SUBLAYER = 5.0
"""Thickness of the viscous sublayer, wall units."""
SMOOTH_END = 1.25
"""Speed over that above a smooth wall from which a law's logarithm is of no wall: it is at most
1.2 for z0 = d/1000."""


@dataclass(frozen=True)
class Bound:
    """A range of one quantity in which a law holds: low <= value < high."""

    quantity: str
    value: FloatArray
    low: float
    high: float

    @property
    def holds(self) -> NDArray[np.bool_]:
        """Whether the quantity is in its range; not a number is not."""
        return np.asarray((self.value >= self.low) & (self.value < self.high))

    def __str__(self) -> str:
        value = float(self.value)
        if np.isnan(value):
            return f"{self.quantity} is not a number"
        side = f"below {self.low:g}" if value < self.low else f"not below {self.high:g}"
        return f"{self.quantity} {float(f'{value:.3g}'):g} is {side}"


class ForceLaw(ABC):
    """Drag along the bed, lift normal to it and a torque, as functions of the friction velocity.

    All methods are vectorised: `ustar` (m/s, >= 0) and the fields of the exposure broadcast.

    Attributes
    ----------
    name : str
        Key of the registry and of study files.
    label : str
        For legends.
    reference : str
        Source, with a DOI where one could be verified.
    reynolds : tuple of float
        Range of Re* in which the law holds: low <= Re* < high.
    drag_law, drag_end : str, float
        Whose drag it is and the particle Reynolds number at which that ends.
    turns : bool
        Whether the flow also turns the grain about its centre.
    protrudes : bool
        Whether a grain's own height over the bed matters to its forces.
    unverified : str
        What of the law was not confirmed by its source; empty if all was. An unverified law takes
        part in no score, and its answers are not usable.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    reference: ClassVar[str]
    reynolds: ClassVar[tuple[float, float]] = (0.0, np.inf)
    drag_law: ClassVar[str] = "the drag law"
    drag_end: ClassVar[float] = np.inf
    turns: ClassVar[bool] = False
    protrudes: ClassVar[bool] = False
    unverified: ClassVar[str] = ""

    @abstractmethod
    def speed(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Speed of the flow that the drag is computed with, m/s."""

    @abstractmethod
    def drag(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Drag in the direction of the flow, N."""

    @abstractmethod
    def lift(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Lift away from the bed, N."""

    def torque(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Torque of the flow about the grain's centre, forwards, N m; none by default."""
        return np.zeros(np.broadcast_shapes(np.shape(ustar), exposure.shape))

    def particle_reynolds(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Particle Reynolds number V d/nu."""
        speed = self.speed(ustar, exposure)
        return np.asarray(speed * exposure.diameter / exposure.viscosity)

    def covers(self, reynolds: ArrayLike) -> NDArray[np.bool_]:
        """Whether friction Reynolds numbers lie in the range of the law."""
        return Bound("Re*", np.asarray(reynolds, float), *self.reynolds).holds

    def bounds(self, ustar: ArrayLike, exposure: Exposure) -> tuple[Bound, ...]:
        """The ranges that the law holds in; a law with more of them adds its own."""
        particle = self.particle_reynolds(ustar, exposure)
        over = self.speed_over_smooth(ustar, exposure)
        return (
            Bound("Re*", exposure.reynolds(ustar), *self.reynolds),
            Bound(f"particle Reynolds number ({self.drag_law})", particle, 0.0, self.drag_end),
            Bound("speed over that above a smooth wall (z0 = 0.11 nu/u*)", over, 0.0, SMOOTH_END),
        )

    def speed_over_smooth(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Speed of the flow over that with the roughness length of a smooth wall added to z0.

        z0 = 0.11 nu/u* is that of a smooth wall (Nikuradse, VDI Forschungsheft 356, 1932); it
        bounds the speed over a bed that is far smoother than its grains are large. 1 where the
        grain lies within the viscous sublayer, Re* < 5.
        """
        e, reynolds = exposure, np.asarray(exposure.reynolds(ustar))
        with np.errstate(all="ignore"):
            z0 = e.roughness + 0.11 * e.diameter / np.maximum(reynolds, SUBLAYER)
            smooth = Exposure(
                e.diameter, z0, e.fluid_density, e.viscosity, e.lift_coefficient, e.gap
            )
            over = self.speed(ustar, e) / self.speed(ustar, smooth)
        return np.asarray(np.where(reynolds < SUBLAYER, 1.0, over))

    def valid(self, ustar: ArrayLike, exposure: Exposure) -> NDArray[np.bool_]:
        """Whether the law holds: in its range of Re* and in all others of its bounds."""
        every = np.broadcast_arrays(*(b.holds for b in self.bounds(ustar, exposure)))
        return np.asarray(np.logical_and.reduce(every))

    def why_not(self, ustar: float, exposure: Exposure) -> str:
        """The bounds that one grain is beyond, in words; empty if the law holds."""
        return "; ".join(str(b) for b in self.bounds(ustar, exposure) if not b.holds)


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
    def gradient(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Shear of the flow that the lift is computed with, 1/s."""

    def drag(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Drag of the sphere at the speed of the flow around it, N."""
        return self.sphere.force(self.speed(ustar, exposure), exposure)

    def lift(self, ustar: ArrayLike, exposure: Exposure) -> FloatArray:
        """Saffman's lift at that speed and shear, N."""
        return saffman_lift(self.speed(ustar, exposure), self.gradient(ustar, exposure), exposure)
