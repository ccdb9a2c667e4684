"""The threshold of motion of one exposed grain that rolls over its downstream neighbour."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT
from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import Bound, ForceLaw
from orchestrator.physics.root import friction_velocity_at

LIFT_OFF = 1 + 1e-9
"""Lift over the weight normal to the bed from which a grain leaves without rolling: on level bed
with no drag the pivot itself is at 1."""


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
        Whether the law holds there: its range of Re*, that of its drag, and no lift-off.
    """

    friction_velocity: FloatArray
    reynolds: FloatArray
    shields: FloatArray
    drag: FloatArray
    lift: FloatArray
    valid: NDArray[np.bool_]


def weight(
    *,
    diameter: ArrayLike,
    density: ArrayLike,
    fluid_density: ArrayLike,
    gravity: ArrayLike = GRAVITY,
) -> FloatArray:
    """Submerged weight W of a grain, N."""
    excess = np.asarray(density, float) - np.asarray(fluid_density, float)
    volume = np.pi / 6 * np.asarray(diameter, float) ** 3
    return np.asarray(volume * excess * np.asarray(gravity, float))


def pivot_resistance(slope_deg: ArrayLike, entrainment_angle_deg: ArrayLike) -> FloatArray:
    """Moment over W that the flow needs about the pivot: cos(alpha - beta) (Eq. 1)."""
    lean = np.radians(np.asarray(slope_deg, float) - np.asarray(entrainment_angle_deg, float))
    return np.asarray(np.cos(lean))


def standing_out(relative_size: ArrayLike, entrainment_angle_deg: ArrayLike) -> FloatArray:
    """Part of a single grain's height that lies above the tops of its two neighbours.

    Parameters
    ----------
    relative_size : array_like
        D/d, its diameter over that of the neighbours, whose centres are 2 d cos(beta) apart.
    entrainment_angle_deg : array_like
        beta.
    """
    size = np.asarray(relative_size, float)
    half = np.cos(np.radians(np.asarray(entrainment_angle_deg, float)))
    centre = np.sqrt(np.maximum(((1 + size) / 2) ** 2 - half**2, 0.0))
    return np.asarray((centre + size / 2 - 0.5) / size)


def lift_bound(
    lift: ArrayLike,
    exposure: Exposure,
    *,
    density: ArrayLike,
    slope_deg: ArrayLike,
    gravity: ArrayLike = GRAVITY,
) -> Bound:
    """The bound of the pivot: a lift (N) below the part of the weight that is normal to the bed.

    A greater lift carries the grain off before it can roll.
    """
    e = exposure
    submerged = weight(
        diameter=e.diameter, density=density, fluid_density=e.fluid_density, gravity=gravity
    )
    normal = submerged * np.cos(np.radians(np.asarray(slope_deg, float)))
    with np.errstate(divide="ignore", invalid="ignore"):
        return Bound("lift over the weight normal to the bed", lift / normal, -np.inf, LIFT_OFF)


def threshold(
    law: ForceLaw,
    exposure: Exposure,
    *,
    density: ArrayLike,
    slope_deg: ArrayLike,
    entrainment_angle_deg: ArrayLike,
    gravity: ArrayLike = GRAVITY,
) -> Threshold:
    """Threshold of one grain on its two neighbours under a force law.

    Solves ``f_d sin(beta) + f_l cos(beta) + T/(d/2) = W cos(alpha - beta)``, the third of Eqs. 1
    with the torque T of the flow about the grain's centre, for the least u*.

    Parameters
    ----------
    law : ForceLaw
        The forces.
    exposure : Exposure
        The grains and the fluid.
    density : array_like
        Density of the grain, kg/m3.
    slope_deg : array_like
        alpha, positive where the flow goes up the slope.
    entrainment_angle_deg : array_like
        beta.
    gravity : array_like
        g, m/s2.

    Returns
    -------
    Threshold
        Inputs are not validated here; a resistance that is not positive gives NaN, and a grain
        that no flow moves an infinite friction velocity.
    """
    e, beta = exposure, np.radians(np.asarray(entrainment_angle_deg, float))
    of_grain = {"density": density, "fluid_density": e.fluid_density, "gravity": gravity}
    submerged = weight(diameter=e.diameter, **of_grain)
    ustar = friction_velocity_at(
        law,
        e,
        submerged * pivot_resistance(slope_deg, entrainment_angle_deg),
        along=np.sin(beta),
        outward=np.cos(beta),
        turning=2 / e.diameter,
    )
    # where no flow moves the grain the forces are those of an infinite one: not a number
    with np.errstate(invalid="ignore"):
        lift = law.lift(ustar, e)
        rolls = lift_bound(lift, e, density=density, slope_deg=slope_deg, gravity=gravity).holds
        return Threshold(
            friction_velocity=ustar,
            reynolds=e.reynolds(ustar),
            shields=np.asarray(e.fluid_density * (ustar * e.diameter) ** 2 * np.pi / 6 / submerged),
            drag=law.drag(ustar, e),
            lift=lift,
            valid=law.valid(ustar, e) & rolls,
        )


def shields_at(
    law: ForceLaw,
    reynolds: ArrayLike,
    *,
    roughness_ratio: ArrayLike,
    entrainment_angle_deg: ArrayLike,
    slope_deg: ArrayLike = 0.0,
    lift_coefficient: ArrayLike = LIFT_COEFFICIENT,
) -> FloatArray:
    """Threshold Shields number at a friction Reynolds number: a law's curve in the Shields diagram.

    No fluid and no grain is needed, since in units of d, nu and rho_f the moment of the forces
    depends on Re*, z0/d and the angles alone.
    """
    unit = Exposure(1.0, roughness_ratio, 1.0, 1.0, lift_coefficient)
    ustar = np.asarray(reynolds, float)
    beta = np.radians(np.asarray(entrainment_angle_deg, float))
    moment = law.drag(ustar, unit) * np.sin(beta) + law.lift(ustar, unit) * np.cos(beta)
    moment = moment + 2 * law.torque(ustar, unit)
    resistance = np.pi / 6 * pivot_resistance(slope_deg, entrainment_angle_deg)
    return np.asarray(resistance * ustar**2 / moment)
