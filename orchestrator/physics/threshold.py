"""The threshold of motion of one exposed grain that rolls over its downstream neighbour."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT
from orchestrator.physics.laws import LAWS, Exposure, ForceLaw, Validity, reasons
from orchestrator.types import BoolArray, FloatArray

Regime = Literal["low", "high", "transition"]
LAWS_OF: dict[Regime, tuple[str, ...]]
LAWS_OF = {"low": ("low",), "high": ("high",), "transition": ("low", "high")}
"""Names of the laws that the paper's rule picks in each regime."""
PAPER = "paper"
"""The paper's rule as a force law: Eq. 2 or Eq. 4 where each holds, both in the transition."""
RUNGS = np.geomspace(1e-9, 1e9, 37)
"""Friction Reynolds numbers between which the first root is looked for. A sum that is above its
target for less than half a decade is missed; the sum of a pivot rises throughout."""
LIFT_OFF = 1 + 1e-9
"""Lift over the weight normal to the bed from which a grain leaves without rolling: on level bed
without drag the pivot itself is at 1."""


@dataclass(frozen=True)
class Threshold:
    """The threshold of motion of one grain; all arrays have the broadcast shape of the inputs.

    u* (m/s), Re* = u* d/nu, tau_c/((rho_sol - rho_f) g d), the forces there (N), and whether the
    law holds there: its range of Re*, that of its drag, and no lift-off.
    """

    friction_velocity: FloatArray
    reynolds: FloatArray
    shields: FloatArray
    drag: FloatArray
    lift: FloatArray
    valid: BoolArray


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

    Its diameter is D/d times that of the neighbours, whose centres are 2 d cos(beta) apart.
    """
    size = np.asarray(relative_size, float)
    half = np.cos(np.radians(np.asarray(entrainment_angle_deg, float)))
    centre = np.sqrt(np.maximum(((1 + size) / 2) ** 2 - half**2, 0.0))
    return np.asarray((centre + size / 2 - 0.5) / size)


def friction_velocity_at(
    law: ForceLaw,
    exposure: Exposure,
    target: ArrayLike,
    *,
    along: ArrayLike = 1.0,
    outward: ArrayLike = 0.0,
    turning: ArrayLike = 0.0,
    speed_up: ArrayLike = 1.0,
) -> FloatArray:
    """The least undisturbed friction velocity at which a sum of the forces reaches a target.

    The sum is ``along drag + outward lift + turning torque`` at the local friction velocity, which
    is `speed_up` times the undisturbed one. Where the flow runs backwards (`speed_up` < 0) drag
    and torque change their sign. About a contact, `along` and `outward` are the arms of drag and
    lift over a length, `turning` is one over it (1/m), and the target (N) is the moment of the
    weight alike. Returned are m/s in the broadcast shape: NaN where the target is not positive,
    since such a grain needs no flow, and infinite where no flow reaches it.
    """
    local = np.asarray(speed_up, float)
    weights = (np.sign(local) * along, np.asarray(outward), np.sign(local) * turning)
    given = (*exposure.fields, *weights, np.asarray(target, float), np.abs(local))
    arrays = np.broadcast_arrays(*given)
    shape = arrays[0].shape
    *args, ratio = (np.ravel(array).astype(float) for array in arrays)

    def excess(ustar: FloatArray, *grain: FloatArray) -> FloatArray:
        here, (a, b, c, goal) = Exposure(*grain[:6]), grain[6:]
        sum_ = law.drag(ustar, here) * a + law.lift(ustar, here) * b + law.torque(ustar, here) * c
        return np.asarray(sum_ - goal)

    found = np.where(args[-1] > 0, np.inf, np.nan)
    low, high = np.zeros_like(ratio), np.full_like(ratio, np.nan)
    left = np.flatnonzero(args[-1] > 0)
    unit = args[3] / args[0]
    # rungs from below, since the sum need not rise everywhere if a weight is negative
    for rung in RUNGS:
        at = rung * unit[left]
        reached = excess(at, *(arg[left] for arg in args)) >= 0
        high[left[reached]] = at[reached]
        left, at = left[~reached], at[~reached]
        low[left] = at
        if not len(left):
            break
    solved = np.flatnonzero(np.isfinite(high))
    if len(solved):
        grains = [arg[solved] for arg in args]
        found[solved] = root(lambda ustar: excess(ustar, *grains), low[solved], high[solved])
    with np.errstate(divide="ignore"):
        return np.asarray((found / ratio).reshape(shape))


def root(function: Callable[[FloatArray], FloatArray], a: FloatArray, b: FloatArray) -> FloatArray:
    """The roots between bounds of different signs (Chandrupatla, Adv. Eng. Softw. 28, 1997).

    scipy's `find_root` does the same, after an import of 0.4 s.
    """
    fa, fb, t = function(a), function(b), np.full_like(a, 0.5)
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(100):
            x = a + t * (b - a)
            fx = function(x)
            same = np.sign(fx) == np.sign(fa)
            c, fc = np.where(same, a, b), np.where(same, fa, fb)
            b, fb = np.where(same, b, a), np.where(same, fb, fa)
            a, fa = x, fx
            best = np.where(np.abs(fa) < np.abs(fb), a, b)
            least = 2 * np.finfo(float).eps * np.abs(best) / np.abs(b - a)
            if np.all((least > 0.5) | (fa == 0) | (fb == 0)):
                break
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            inverse = fa / (fb - fa) * fc / (fb - fc)
            inverse += (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            is_safe = (phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi)
            t = np.clip(np.where(is_safe, inverse, 0.5), least, 1 - least)
    return best


def threshold(
    law: ForceLaw,
    exposure: Exposure,
    *,
    density: ArrayLike,
    slope_deg: ArrayLike,
    entrainment_angle_deg: ArrayLike,
    gravity: ArrayLike = GRAVITY,
    cohesion: ArrayLike = 0.0,
) -> Threshold:
    """Threshold of one grain on its two neighbours under a force law.

    Solves ``f_d sin(beta) + f_l cos(beta) + T/(d/2) = W cos(alpha - beta) + F_a sin(2 beta)``, the
    third of Eqs. 1 with the torque T of the flow about the grain's centre and the pull
    F_a = cohesion x d (N/m) of the contact that opens, for the least u*.

    The slope alpha is positive where the flow goes up it. Inputs are not validated here; a
    resistance that is not positive gives NaN, and a grain that no flow moves an infinite friction
    velocity.
    """
    e, beta = exposure, np.radians(np.asarray(entrainment_angle_deg, float))
    grain = {"density": density, "fluid_density": e.fluid_density, "gravity": gravity}
    submerged = weight(diameter=e.diameter, **grain)
    moment = submerged * pivot_resistance(slope_deg, entrainment_angle_deg)
    moment = moment + np.asarray(cohesion, float) * e.diameter * np.sin(2 * beta)
    arms = {"along": np.sin(beta), "outward": np.cos(beta), "turning": 2 / e.diameter}
    ustar = friction_velocity_at(law, e, moment, **arms)
    # where no flow moves the grain the forces are those of an infinite one: not a number
    with np.errstate(invalid="ignore"):
        lift = law.lift(ustar, e)
        rolls = _lift_range(lift, submerged, slope_deg).holds
        return Threshold(
            friction_velocity=ustar,
            reynolds=e.reynolds(ustar),
            shields=np.asarray(e.fluid_density * (ustar * e.diameter) ** 2 * np.pi / 6 / submerged),
            drag=law.drag(ustar, e),
            lift=lift,
            valid=law.valid(ustar, e) & rolls,
        )


def why_not(
    law: ForceLaw,
    ustar: FloatArray,
    exposure: Exposure,
    *,
    density: ArrayLike | None = None,
    slope_deg: ArrayLike = 0.0,
    gravity: ArrayLike = GRAVITY,
) -> list[str]:
    """Reasons against the thresholds u* (m/s) of some grains under a law, in words; empty if none.

    Parameters are those of `threshold`; without a density the weight, and with it a lift-off, is
    left out.
    """
    ranges = [*law.ranges(ustar, exposure)]
    if density is not None:
        e = exposure
        grain = {"density": density, "fluid_density": e.fluid_density, "gravity": gravity}
        submerged = weight(diameter=e.diameter, **grain)
        ranges.append(_lift_range(law.lift(ustar, e), submerged, slope_deg))
    return reasons(ranges, np.size(ustar))


def _lift_range(lift: FloatArray, submerged: FloatArray, slope_deg: ArrayLike) -> Validity:
    """Range of the pivot: a greater lift carries the grain off before it can roll."""
    normal = submerged * np.cos(np.radians(np.asarray(slope_deg, float)))
    with np.errstate(divide="ignore", invalid="ignore"):
        over = np.asarray(lift / normal)
    return Validity("lift over the weight normal to the bed", over, -np.inf, LIFT_OFF)


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


def regime(low: Threshold, high: Threshold) -> NDArray[np.str_]:
    """Which of Eqs. 2 and 4 holds at its own threshold: ``low``, ``high`` or ``transition``.

    The ranges of Re* decide, Re* < 3 and Re* >= 30, and not the end of the drag of Eq. 4: gravel is
    in the high regime, if beyond its drag law.
    """
    slow, fast = low.reynolds < LAWS["low"].reynolds[1], high.reynolds >= LAWS["high"].reynolds[0]
    return np.where(slow, "low", np.where(fast, "high", "transition"))


class SingleGrain(NamedTuple):
    """All quantities that the closed form depends on, SI units and degrees."""

    diameter: float
    roughness: float
    fluid_density: float
    viscosity: float
    lift_coefficient: float
    density: float
    slope_deg: float
    entrainment_angle_deg: float
    gravity: float
    cohesion: float = 0.0


_CACHE: dict[tuple[str, tuple[float, ...]], Threshold] = {}


def thresholds_of(name: str, grains: Sequence[tuple[float, ...]]) -> list[Threshold]:
    """The thresholds of grains (as `SingleGrain`) under a force law, each of shape ()."""
    keys = [(name, tuple(grain)) for grain in grains]
    if new := [key for key in dict.fromkeys(keys) if key not in _CACHE]:
        columns = np.array([grain for _, grain in new]).T
        rest = dict(zip(SingleGrain._fields[5:], columns[5:], strict=True))
        columnwise = threshold(LAWS[name], Exposure(*columns[:5]), **rest)
        rows = zip(*vars(columnwise).values(), strict=True)
        _CACHE.update(zip(new, (Threshold(*row) for row in rows), strict=True))
    return [_CACHE[key] for key in keys]
