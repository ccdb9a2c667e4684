"""Force laws: the forces of the flow on an exposed grain, and their ranges.

A new law is a subclass of `ForceLaw` and an entry in `LAWS`. It takes part in the
interval of an answer only where its class says so.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.errors import InputError
from orchestrator.physics import velocity
from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.physics.grain import Grain
from orchestrator.types import BoolArray, FloatArray

_EQUATIONS = "Eqs. 2 and 4 of the paper"
MODEL = f"a model of this program: {_EQUATIONS} on a stress that is carried together"
"""Source of the laws that this program adds to those of the paper."""
SUBLAYER = 5.0
"""Thickness of the viscous sublayer, wall units."""
SMOOTH_END = 1.25
"""Largest speed over that above a smooth wall; it is at most 1.2 for z0 = d/1000."""


@dataclass(frozen=True)
class SphereDrag:
    """Drag of a sphere in a uniform stream, C_D = (24/Re) factor(Re).

    Attributes
    ----------
    name
        Name of the drag law, for messages.
    factor
        Drag over Stokes' drag as a function of the particle Reynolds number
        Re = V d/nu.
    highest
        Particle Reynolds number at which the drag law ends.

    Examples
    --------
    >>> sand = Grain(
    ...     diameter=1e-3, roughness=1e-3 / 30, fluid_density=1000.0, viscosity=1e-6
    ... )
    >>> print(f"{SCHILLER_NAUMANN.force(np.array(0.1), sand):.3e}")
    4.287e-06
    """

    name: str
    factor: Callable[[FloatArray], FloatArray]
    highest: float

    def force(self, speed: FloatArray, at: Grain) -> FloatArray:
        """Compute the drag of a stream: 3 pi rho nu d V factor.

        Parameters
        ----------
        speed
            Speed V of the stream, m/s.
        at
            The sphere and the fluid.

        Returns
        -------
        FloatArray
            Drag, N, of the broadcast shape.
        """
        stokes = 3 * np.pi * at.fluid_density * at.viscosity * at.diameter * speed
        return np.asarray(stokes * self.factor(speed * at.diameter / at.viscosity))


def _schiller_naumann(reynolds: FloatArray) -> FloatArray:
    """Drag over Stokes' drag after Schiller and Naumann."""
    return np.asarray(1 + 0.15 * reynolds**0.687)


def _clift_gauvin(reynolds: FloatArray) -> FloatArray:
    """Drag over Stokes' drag after Clift and Gauvin.

    Their term 0.42/(1 + 42500 Re^-1.16) of C_D is multiplied out over 24/Re, so that
    Re = 0 needs no division by it.
    """
    newton = 0.42 / 24 * reynolds**2.16 / (reynolds**1.16 + 42500)
    return np.asarray(_schiller_naumann(reynolds) + newton)


STOKES = SphereDrag("Stokes", np.ones_like, np.inf)
"""The drag of Eq. 2, which ends with the range of Re* of that equation."""
SCHILLER_NAUMANN = SphereDrag("Schiller and Naumann", _schiller_naumann, 1000.0)
"""The drag of Eq. 4 (Z. VDI 77, 1933), in common use up to Re = 1000."""
CLIFT_GAUVIN = SphereDrag("Clift and Gauvin", _clift_gauvin, 3e5)
"""Schiller and Naumann's drag and a term of inertia, up to the drag crisis at 3e5.

Coefficients and limit agree in several public codes.
"""


@dataclass(frozen=True)
class Validity:
    """The range of one quantity in which a law holds: low <= value < high.

    Attributes
    ----------
    quantity
        Name of the quantity, for messages.
    value
        Its values, an array of any shape.
    low, high
        The range.

    Examples
    --------
    >>> reynolds = Validity("Re*", np.array([2.0, 40.0]), 0.0, 3.0)
    >>> print(reynolds.holds)
    [ True False]
    >>> reynolds.text(40.0)
    'Re* 40 is not below 3'
    """

    quantity: str
    value: FloatArray
    low: float
    high: float

    @property
    def holds(self) -> BoolArray:
        """Whether the quantity is in its range; NaN is not."""
        return np.asarray((self.value >= self.low) & (self.value < self.high))

    def text(self, value: float) -> str:
        """Say which limit a value is beyond.

        Parameters
        ----------
        value
            A value of the quantity.

        Returns
        -------
        str
            The limit in words; empty for a value in the range.
        """
        if self.low <= value < self.high:
            return ""
        if np.isnan(value):
            return f"{self.quantity} is not a number"
        side = f"below {self.low:g}" if value < self.low else f"not below {self.high:g}"
        three_digits = float(f"{value:.3g}")
        return f"{self.quantity} {three_digits:g} is {side}"


def reasons(ranges: Iterable[Validity], count: int) -> list[list[str]]:
    """Say which limits each of some grains is beyond.

    Parameters
    ----------
    ranges
        The ranges of a law for these grains; their values broadcast to (count,).
    count
        Number of grains.

    Returns
    -------
    list of list of str
        For each grain the limits in words; none where all ranges hold.

    Examples
    --------
    >>> reasons([Validity("Re*", np.array([2.0, 40.0]), 0.0, 3.0)], 2)
    [[], ['Re* 40 is not below 3']]
    """
    texts_by_range = []
    for each in ranges:
        values = np.broadcast_to(each.value, count).tolist()
        texts_by_range.append([each.text(value) for value in values])
    texts_by_grain = zip(*texts_by_range, strict=True)
    return [[text for text in texts if text] for texts in texts_by_grain]


class ForceLaw(ABC):
    """Drag along the bed and lift normal to it, as functions of u*.

    All methods are vectorised: the friction velocity `ustar` (m/s, >= 0) and the fields
    of the grain `at` broadcast, and the results have the broadcast shape. Whether a
    law is `in_interval` is a keyword of its class, which no subclass inherits.

    Attributes
    ----------
    name
        Key of the registry and of study files.
    label
        Name in legends.
    reference
        Source, with a DOI where one could be verified.
    reynolds
        Range of the friction Reynolds number, low <= Re* < high.
    drag_law
        Name of the drag law, for messages.
    drag_end
        Particle Reynolds number at which the drag law ends.
    extended_by
        Name of the law of the same flow whose drag law goes on there; empty for none.
    protrudes
        Whether a grain's own height over the bed matters.
    in_interval
        Whether its threshold takes part in the interval of a single grain, which is the
        range of such laws where nothing was measured.

    Examples
    --------
    >>> sand = Grain(
    ...     diameter=1e-3, roughness=1e-3 / 30, fluid_density=1000.0, viscosity=1e-6
    ... )
    >>> print(f"{LAWS['bridged'].drag(0.02, sand):.3e}")
    3.958e-06
    """

    name: ClassVar[str]
    label: ClassVar[str]
    reference: ClassVar[str]
    reynolds: ClassVar[tuple[float, float]] = (0.0, np.inf)
    drag_law: ClassVar[str] = "the drag law"
    drag_end: ClassVar[float] = np.inf
    extended_by: ClassVar[str] = ""
    protrudes: ClassVar[bool] = False
    in_interval: ClassVar[bool]

    def __init_subclass__(cls, *, in_interval: bool = False) -> None:
        super().__init_subclass__()
        cls.in_interval = in_interval

    @abstractmethod
    def speed(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        """Compute the speed of the flow that the drag is computed with.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.
        at
            The grain and the fluid.

        Returns
        -------
        FloatArray
            Speed, m/s.
        """

    @abstractmethod
    def drag(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        """Compute the drag in the direction of the flow.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.
        at
            The grain and the fluid.

        Returns
        -------
        FloatArray
            Drag, N.
        """

    @abstractmethod
    def lift(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        """Compute the lift away from the bed.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.
        at
            The grain and the fluid.

        Returns
        -------
        FloatArray
            Lift, N.
        """

    def particle_reynolds(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        """Compute the particle Reynolds number V d/nu.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.
        at
            The grain and the fluid.

        Returns
        -------
        FloatArray
            Particle Reynolds number.
        """
        speed = self.speed(ustar, at)
        return np.asarray(speed * at.diameter / at.viscosity)

    def speed_over_smooth(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        """Compare the speed of the flow with that above a smooth wall.

        A smooth wall bounds the speed over a bed that is far smoother than its grains
        are large. Its roughness length is added to z0.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.
        at
            The grain and the fluid.

        Returns
        -------
        FloatArray
            Speed over that above a smooth wall. It is 1 where the grain lies within
            the viscous sublayer, Re* < 5.
        """
        reynolds = at.reynolds(ustar)
        with np.errstate(all="ignore"):
            above_sublayer = np.maximum(ustar, at.ustar(SUBLAYER))
            wall = velocity.smooth_wall_roughness(above_sublayer, at.viscosity)
            smooth = at.changed(roughness=at.roughness + wall, gap=at.gap)
            over = self.speed(ustar, at) / self.speed(ustar, smooth)
        return np.asarray(np.where(reynolds < SUBLAYER, 1.0, over))

    def ranges(self, ustar: ArrayLike, at: Grain) -> tuple[Validity, ...]:
        """List the ranges that the law holds in; a law with more of them adds its own.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.
        at
            The grain and the fluid.

        Returns
        -------
        tuple of Validity
            The ranges of Re*, of the drag law, and of the speed over a smooth wall.
        """
        reynolds = at.reynolds(ustar)
        particle = self.particle_reynolds(ustar, at)
        over = self.speed_over_smooth(ustar, at)
        of_drag = f"particle Reynolds number ({self.drag_law})"
        return (
            Validity("Re*", reynolds, *self.reynolds),
            Validity(of_drag, particle, 0.0, self.drag_end),
            Validity("speed over that above a smooth wall", over, 0.0, SMOOTH_END),
        )

    def valid(self, ustar: ArrayLike, at: Grain) -> BoolArray:
        """Say whether the law holds: in its range of Re* and in all its other ranges.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.
        at
            The grain and the fluid.

        Returns
        -------
        BoolArray
            Whether the law holds.
        """
        holds = [each.holds for each in self.ranges(ustar, at)]
        return np.asarray(np.logical_and.reduce(np.broadcast_arrays(*holds)))


class DragAndSaffman(ForceLaw):
    """Drag of a sphere and Saffman's lift, the forces of Eqs. 2 and 4.

    P. G. Saffman, J. Fluid Mech. 22, 1965, doi:10.1017/S0022112065000824, with the
    coefficient of its correction of 1968. A law names a sphere's drag and gives speed
    and shear of the flow around the grain.

    Attributes
    ----------
    sphere
        The drag of the sphere.
    """

    sphere: ClassVar[SphereDrag]

    def __init_subclass__(cls, *, in_interval: bool = False) -> None:
        """Take the name and the end of the drag from the sphere's."""
        super().__init_subclass__(in_interval=in_interval)
        cls.drag_law = cls.sphere.name
        cls.drag_end = cls.sphere.highest

    @abstractmethod
    def around(self, ustar: ArrayLike, at: Grain) -> tuple[FloatArray, FloatArray]:
        """Compute speed and shear of the flow around the grain.

        Parameters
        ----------
        ustar
            Friction velocity, m/s.
        at
            The grain and the fluid.

        Returns
        -------
        speed, shear
            Mean speed, m/s, and mean shear, 1/s.
        """

    def speed(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        """Mean speed of the flow around the grain, m/s."""
        speed, _ = self.around(ustar, at)
        return speed

    def drag(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        """Drag of the sphere at the speed of the flow around it, N."""
        return self.sphere.force(self.speed(ustar, at), at)

    def lift(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        """Saffman's lift, N: alpha_s rho sqrt(nu) d^2 V sqrt(du/dz).

        Eq. 4 prints the root of ``(du/dz)/ustar``; its dimension needs
        ``d (du/dz)/ustar``.
        """
        coefficient = at.lift_coefficient * at.fluid_density
        scale = coefficient * np.sqrt(at.viscosity) * at.diameter**2
        speed, shear = self.around(ustar, at)
        return np.asarray(scale * speed * np.sqrt(shear))


class Low(DragAndSaffman, in_interval=True):
    """Stokes' drag and Saffman's lift on the linear profile u = z u*^2/nu (Eq. 2)."""

    name = "low"
    label = "Eq. 2 (low Re*)"
    reference = "the paper, Eq. 2, after C.-H. Ling, J. Hydraul. Eng. 121, 1995"
    reynolds = (0.0, 3.0)
    protrudes = True
    sphere = STOKES

    def around(self, ustar: ArrayLike, at: Grain) -> tuple[FloatArray, FloatArray]:
        """Mean speed from z0 to z0 + d, and ustar^2/nu."""
        shear = np.asarray(np.square(ustar) / at.viscosity)
        speed = shear * velocity.viscous_length(at.diameter, at.gap)
        return speed, shear


class High(DragAndSaffman, in_interval=True):
    """Schiller and Naumann's drag and Saffman's lift on the log profile (Eq. 4)."""

    name = "high"
    label = "Eq. 4 (high Re*)"
    reference = (
        "the paper, Eq. 4 with d (du/dz)/ustar under the root of the lift, as its "
        "dimension needs; after C.-H. Ling, J. Hydraul. Eng. 121, 1995"
    )
    reynolds = (30.0, np.inf)
    protrudes = True
    sphere = SCHILLER_NAUMANN

    def around(self, ustar: ArrayLike, at: Grain) -> tuple[FloatArray, FloatArray]:
        """Mean speed and shear from z0 to z0 + d."""
        speed = velocity.rough_speed(at.diameter, at.roughness, at.gap)
        shear = velocity.rough_gradient(at.diameter, at.roughness, at.gap)
        return np.multiply(ustar, speed), np.multiply(ustar, shear)


class Bridged(DragAndSaffman, in_interval=True):
    """Drag and lift where viscosity and turbulence carry the stress together.

    At the scale of the grain ``ustar^2 = nu V/(d/2 + z0) + (V/c_V)^2`` and
    ``ustar^2 = nu G + (G/c_G)^2``, with c_V and c_G of Eq. 4. No new constant; Re* -> 0
    is Eq. 2 and Re* -> infinity is Eq. 4, both exactly.
    """

    name = "bridged"
    label = "bridged"
    extended_by = "bridged-gravel"
    reference = MODEL
    protrudes = True
    sphere = SCHILLER_NAUMANN

    def around(self, ustar: ArrayLike, at: Grain) -> tuple[FloatArray, FloatArray]:
        """Mean speed and shear over the height of the grain."""
        u = np.asarray(ustar, float)
        viscous_length = velocity.viscous_length(at.diameter, at.gap)
        viscous_speed = np.asarray(at.viscosity / viscous_length)
        rough_speed = velocity.rough_speed(at.diameter, at.roughness, at.gap)
        rough_shear = velocity.rough_gradient(at.diameter, at.roughness, at.gap)
        speed = velocity.bridge(u, viscous_speed, rough_speed)
        shear = velocity.bridge(u, at.viscosity, rough_shear)
        return speed, shear


class BridgedGravel(Bridged, in_interval=True):
    """The bridged flow with a drag that goes on to a particle Reynolds number of 3e5.

    Coarse sand and gravel in water lie beyond Schiller and Naumann's 1000; Clift and
    Gauvin's drag is 5 % above theirs at 800 and tends to C_D = 0.42 with the rest of
    the drag still falling.
    """

    name = "bridged-gravel"
    extended_by = ""
    label = "bridged, drag of Clift & Gauvin"
    reference = (
        f"{MODEL}; drag: R. Clift and W. H. Gauvin, Can. J. Chem. Eng. 49, 1971, "
        "doi:10.1002/cjce.5450490403"
    )
    sphere = CLIFT_GAUVIN


class ProfileLaw(DragAndSaffman, in_interval=True):
    """Drag and lift on van Driest's profile over a rough wall.

    The drag is Schiller and Naumann's, the lift Saffman's. Speed and shear are averaged
    from z0 to z0 + d as in Eqs. 2 and 4, with ks = 30 z0. Re* -> 0 is Eq. 2 exactly;
    Eq. 4 is not reached, since the correlation of the shift ends before.
    """

    name = "profile"
    label = "profile (van Driest)"
    reference = (
        "E. R. van Driest, 1956; J. Rotta, 1962; T. Cebeci and K. C. Chang, 1978, as "
        "in code_saturne, cs_wall_functions_2scales_vdriest"
    )
    sphere = SCHILLER_NAUMANN

    def around(self, ustar: ArrayLike, at: Grain) -> tuple[FloatArray, FloatArray]:
        """Mean speed and shear from z0 to z0 + d."""
        # a mean over no height at all is the limit of that over little
        height = np.maximum(at.reynolds(ustar), 1e-100)
        base = at.ratio * height
        moved = velocity.shift(SAND_GRAIN * base)
        speed, shear = velocity.layer(base, base + height, moved)
        unit_shear = np.square(ustar) / at.viscosity
        return np.multiply(ustar, speed), np.asarray(unit_shear * shear)

    def ranges(self, ustar: ArrayLike, at: Grain) -> tuple[Validity, ...]:
        """The ranges of every law, and that of the correlation of the shift."""
        roughness = SAND_GRAIN * at.ratio * at.reynolds(ustar)
        of_shift = "roughness ks u*/nu (Cebeci and Chang)"
        rough = Validity(of_shift, roughness, 0.0, velocity.ROUGHEST)
        return (*super().ranges(ustar, at), rough)


_EVERY: tuple[ForceLaw, ...] = (
    Low(),
    High(),
    Bridged(),
    BridgedGravel(),
    ProfileLaw(),
)
LAWS: dict[str, ForceLaw] = {each.name: each for each in _EVERY}
"""Every force law by its name."""
DEFAULT = Bridged.name
"""The law where none is asked for, up to the end of its drag; then `extended_by`."""


def law(name: str) -> ForceLaw:
    """Look up a force law.

    Parameters
    ----------
    name
        Name of the law, as in study files.

    Returns
    -------
    ForceLaw
        The law.

    Raises
    ------
    InputError
        If no law has that name; the message lists the laws.

    Examples
    --------
    >>> law("bridged").label
    'bridged'
    """
    if name not in LAWS:
        remedy = f"known laws: {', '.join(LAWS)}"
        near = get_close_matches(name, LAWS, n=1)
        if near:
            remedy = f"did you mean {near[0]}? {remedy}"
        raise InputError(f"unknown force law {name!r}", remedy=remedy)
    return LAWS[name]
