"""Drag, lift and threshold of one exposed grain: Eqs. 1-5 and 10 of the paper, vectorised.

Every force is a sum of powers of the friction velocity, ``sum_k c_k ustar**p_k``: another way to
write Eqs. 2 to 5 than that of the package, which the tests hold the package to.

Arguments are arrays or numbers in SI units that broadcast together; angles are in degrees. The
roughness length z0 stands for the gap delta under the grain as well (delta = z0).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Closure = Literal["low", "high"]
Regime = Literal["low", "high", "transition"]
FloatArray = NDArray[np.float64]

CLOSURES: tuple[Closure, Closure] = ("low", "high")
LOW_BELOW = 3.0
"""Eqs. 2 and 3 hold for Re* < 3."""
HIGH_FROM = 30.0
"""Eqs. 4 and 5 hold for Re* >= 30."""
INVERSE_KARMAN = 2.5
"""The paper's 1/kappa in the velocity profile around the grain."""
KARMAN = 0.41
"""von Karman's constant in Eq. 10 and in the flow."""
LIFT_COEFFICIENT = 1.615
"""Saffman's 6.46 for the radius, over 4 for the squared diameter."""
GRAVITY = 9.81


@dataclass(frozen=True)
class Powers:
    """A force as a sum of powers of the friction velocity.

    Attributes
    ----------
    coefficients : tuple of ndarray
        One array per term, N/(m/s)**p.
    exponents : tuple of float
        The powers p.
    """

    coefficients: tuple[FloatArray, ...]
    exponents: tuple[float, ...]

    def __call__(self, ustar: ArrayLike) -> FloatArray:
        """Force at a friction velocity (m/s), N."""
        speed = np.asarray(ustar, float)
        terms = zip(self.coefficients, self.exponents, strict=True)
        return np.asarray(sum(c * speed**p for c, p in terms), float)


def drag(
    closure: Closure,
    *,
    diameter: ArrayLike,
    roughness: ArrayLike,
    fluid_density: ArrayLike,
    viscosity: ArrayLike,
) -> Powers:
    """Drag on an exposed grain along the bed, Eq. 2 (low) or Eq. 4 (high)."""
    d, z0, rho, nu = _arrays(diameter, roughness, fluid_density, viscosity)
    if closure == "low":
        return Powers((1.5 * np.pi * (1 + 2 * z0 / d) * rho * d**2,), (2.0,))
    ratio = mean_speed_ratio(d, z0)
    viscous = 3 * np.pi * rho * nu * d * ratio
    return Powers((viscous, viscous * 0.15 * (ratio * d / nu) ** 0.687), (1.0, 1.687))


def lift(
    closure: Closure,
    *,
    diameter: ArrayLike,
    roughness: ArrayLike,
    fluid_density: ArrayLike,
    viscosity: ArrayLike,
    lift_coefficient: ArrayLike = LIFT_COEFFICIENT,
) -> Powers:
    """Lift on an exposed grain normal to the bed, Eq. 2 (low) or Eq. 4 (high).

    Eq. 4 prints the root of ``(du/dz)/ustar``; its dimension needs ``d (du/dz)/ustar``, as here.
    """
    d, z0, rho, nu = _arrays(diameter, roughness, fluid_density, viscosity)
    a = np.asarray(lift_coefficient, float)
    if closure == "low":
        return Powers((a / 2 * (1 + 2 * z0 / d) * rho * d**3 / nu,), (3.0,))
    gradient = INVERSE_KARMAN * np.log1p(d / z0)
    factor = a * mean_speed_ratio(d, z0) * np.sqrt(gradient * nu) * rho * d**1.5
    return Powers((factor,), (1.5,))


def mean_speed_ratio(diameter: ArrayLike, roughness: ArrayLike) -> FloatArray:
    """V_f/ustar of the logarithmic profile, averaged from z0 to z0 + d."""
    r = np.asarray(roughness, float) / np.asarray(diameter, float)
    return np.asarray(INVERSE_KARMAN * ((1 + r) * np.log1p(1 / r) - 1), float)


def weight(
    *,
    diameter: ArrayLike,
    density: ArrayLike,
    fluid_density: ArrayLike,
    gravity: ArrayLike = GRAVITY,
) -> FloatArray:
    """Submerged weight W of a grain, N."""
    d, rho, rho_f, g = _arrays(diameter, density, fluid_density, gravity)
    return np.pi / 6 * d**3 * (rho - rho_f) * g


def pivot_resistance(slope_deg: ArrayLike, entrainment_angle_deg: ArrayLike) -> FloatArray:
    """What the pivot's moment balance asks of the flow, over W: cos(alpha - beta) (Eq. 1)."""
    lean = np.radians(np.asarray(slope_deg, float) - np.asarray(entrainment_angle_deg, float))
    return np.asarray(np.cos(lean), float)


@dataclass(frozen=True)
class Threshold:
    """The threshold of motion of one grain; all arrays have the broadcast shape of the inputs.

    Attributes
    ----------
    friction_velocity : ndarray
        u* at the threshold, m/s.
    reynolds : ndarray
        Friction Reynolds number u* d/nu.
    shields : ndarray
        tau_c/((rho_sol - rho_f) g d).
    drag, lift : ndarray
        Forces on the grain at the threshold, N.
    valid : ndarray of bool
        Whether the closure holds at this Reynolds number.
    """

    friction_velocity: FloatArray
    reynolds: FloatArray
    shields: FloatArray
    drag: FloatArray
    lift: FloatArray
    valid: NDArray[np.bool_]


def threshold(
    closure: Closure,
    *,
    diameter: ArrayLike,
    density: ArrayLike,
    fluid_density: ArrayLike,
    viscosity: ArrayLike,
    slope_deg: ArrayLike,
    entrainment_angle_deg: ArrayLike,
    roughness: ArrayLike,
    lift_coefficient: ArrayLike = LIFT_COEFFICIENT,
    gravity: ArrayLike = GRAVITY,
) -> Threshold:
    """Threshold of one grain on its two neighbours, Eq. 3 (low) or Eq. 5 (high) solved for u*.

    The slope is positive where the flow goes up it. Inputs are not validated here; a resistance
    that is not positive gives NaN.
    """
    d, rho, rho_f, nu = _arrays(diameter, density, fluid_density, viscosity)
    flow = {"diameter": d, "roughness": roughness, "fluid_density": rho_f, "viscosity": nu}
    dragging = drag(closure, **flow)
    lifting = lift(closure, **flow, lift_coefficient=lift_coefficient)
    beta = np.radians(np.asarray(entrainment_angle_deg, float))
    moment = Powers(
        (
            *(c * np.sin(beta) for c in dragging.coefficients),
            *(c * np.cos(beta) for c in lifting.coefficients),
        ),
        dragging.exponents + lifting.exponents,
    )
    w = weight(diameter=d, density=rho, fluid_density=rho_f, gravity=gravity)
    ustar = invert(moment, w * pivot_resistance(slope_deg, entrainment_angle_deg))
    reynolds = ustar * d / nu
    return Threshold(
        friction_velocity=ustar,
        reynolds=reynolds,
        shields=rho_f * ustar**2 / ((rho - rho_f) * np.asarray(gravity, float) * d),
        drag=dragging(ustar),
        lift=lifting(ustar),
        valid=reynolds < LOW_BELOW if closure == "low" else reynolds >= HIGH_FROM,
    )


def invert(force: Powers, target: ArrayLike) -> FloatArray:
    """The friction velocity at which a force reaches a target (N), m/s.

    A sum of powers is convex and rising in log-log coordinates, so that Newton's iteration there
    converges from any start.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        goal = np.log(np.asarray(target, float))
        offsets = [np.log(c) for c in force.coefficients]
        x = np.zeros(np.broadcast_shapes(goal.shape, *(o.shape for o in offsets)))
        for _ in range(60):
            terms = [o + p * x for o, p in zip(offsets, force.exponents, strict=True)]
            value = np.logaddexp.reduce(np.stack(np.broadcast_arrays(*terms)))
            weights = [np.exp(term - value) for term in terms]
            step = (value - goal) / sum(
                p * w for p, w in zip(force.exponents, weights, strict=True)
            )
            x = x - step
            if not np.any(np.abs(step) > 1e-15 * (1 + np.abs(x))):
                break
    return np.exp(x)


def regime(low: Threshold, high: Threshold) -> NDArray[np.str_]:
    """Which closure holds at its own threshold: ``low``, ``high`` or, for neither, ``transition``.

    Raises
    ------
    ArithmeticError
        If both hold somewhere; no such grain is known.
    """
    if np.any(low.valid & high.valid):
        raise ArithmeticError("both closures are valid for one grain")
    return np.where(low.valid, "low", np.where(high.valid, "high", "transition"))


def log_law_ustar(
    speed: ArrayLike, height: ArrayLike, roughness: ArrayLike, *, printed: bool = False
) -> FloatArray:
    """Eq. 10: friction velocity (m/s) from the tangential speed at a height above the bed.

    The rough wall's own profile is ``ln((z + z0)/z0)``; the paper prints ``ln(z/z0)``, which
    changes its sign below z0.
    """
    u, z, z0 = _arrays(speed, height, roughness)
    return KARMAN * u / (np.log(z / z0) if printed else np.log1p(z / z0))


def _arrays(*values: ArrayLike) -> tuple[FloatArray, ...]:
    return tuple(np.asarray(value, float) for value in values)
