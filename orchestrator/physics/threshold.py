"""The threshold of motion of one exposed grain that rolls over its neighbour."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.errors import InputError
from orchestrator.physics.constants import GRAIN_COLUMNS, GRAVITY, LIFT_COEFFICIENT
from orchestrator.physics.laws import (
    DEFAULT,
    LAWS,
    Exposure,
    ForceLaw,
    Validity,
    reasons,
)
from orchestrator.types import BoolArray, FloatArray, IntArray

Regime = Literal["low", "high", "transition"]
LAWS_OF: dict[Regime, tuple[str, ...]] = {
    "low": ("low",),
    "high": ("high",),
    "transition": ("low", "high"),
}
"""Names of the laws that the paper's rule picks in each regime."""
AUTO = "auto"
"""The default force law: `DEFAULT`, or that which it goes on with."""
PAPER = "paper"
"""The paper's rule as a force law: Eq. 2 or Eq. 4 where each holds, else both."""
RUNGS = np.geomspace(1e-9, 1e9, 37)
"""Friction Reynolds numbers between which the first root is looked for.

A sum that is above its target for less than half a decade is missed; the sum of a pivot
rises throughout.
"""
LIFT_OFF = 1 + 1e-6
"""Lift over the weight normal to the bed from which a grain leaves without rolling.

On a level bed without drag the pivot itself is at 1, but for the ninth digit of its
friction velocity.
"""


@dataclass(frozen=True)
class Threshold:
    """The threshold of motion of one grain, or of each of many.

    The arrays have the broadcast shape of the inputs.

    Attributes
    ----------
    friction_velocity
        u*, m/s.
    reynolds
        Re* = u* d/nu.
    shields
        tau_c/((rho_sol - rho_f) g d).
    drag, lift
        The forces there, N.
    valid
        Whether the law holds there: its range of Re*, that of its drag, no lift-off.
    """

    friction_velocity: FloatArray
    reynolds: FloatArray
    shields: FloatArray
    drag: FloatArray
    lift: FloatArray
    valid: BoolArray

    def grain(self, index: int) -> "Threshold":
        """Pick one grain of a list.

        Parameters
        ----------
        index
            Its place in the list: the arrays are of shape (n,).

        Returns
        -------
        Threshold
            Its threshold, with arrays of shape ().
        """
        return Threshold(
            friction_velocity=self.friction_velocity[index],
            reynolds=self.reynolds[index],
            shields=self.shields[index],
            drag=self.drag[index],
            lift=self.lift[index],
            valid=self.valid[index],
        )


def weight(
    *,
    diameter: ArrayLike,
    density: ArrayLike,
    fluid_density: ArrayLike,
    gravity: ArrayLike = GRAVITY,
) -> FloatArray:
    """Compute the submerged weight W of a grain.

    Parameters
    ----------
    diameter
        Diameter of the grain, m.
    density, fluid_density
        Densities of the grain and of the fluid, kg/m3.
    gravity
        Acceleration of gravity, m/s2.

    Returns
    -------
    FloatArray
        Submerged weight, N, of the broadcast shape.

    Examples
    --------
    >>> print(f"{weight(diameter=1e-3, density=2650.0, fluid_density=1000.0):.3e}")
    8.475e-06
    """
    excess = np.asarray(density, float) - np.asarray(fluid_density, float)
    volume = np.pi / 6 * np.asarray(diameter, float) ** 3
    return np.asarray(volume * excess * np.asarray(gravity, float))


def pivot_resistance(
    slope_deg: ArrayLike,
    entrainment_angle_deg: ArrayLike,
) -> FloatArray:
    """Compute the moment of the weight about the pivot: cos(alpha - beta) (Eq. 1).

    Parameters
    ----------
    slope_deg
        Slope alpha of the bed, degrees, positive where the flow goes up it.
    entrainment_angle_deg
        Entrainment angle beta, degrees.

    Returns
    -------
    FloatArray
        Moment over W d/2 that the flow needs, of the broadcast shape.

    Examples
    --------
    >>> print(pivot_resistance([0.0, 15.0], 60.0).round(4))
    [0.5    0.7071]
    """
    slope = np.asarray(slope_deg, float)
    lean = np.radians(slope - np.asarray(entrainment_angle_deg, float))
    return np.asarray(np.cos(lean))


def standing_out(
    relative_size: ArrayLike,
    entrainment_angle_deg: ArrayLike,
) -> FloatArray:
    """Compute the part of a grain's height that lies above its two neighbours' tops.

    Parameters
    ----------
    relative_size
        Diameter of the grain over that of its neighbours, D/d.
    entrainment_angle_deg
        Entrainment angle beta, degrees: the centres of the neighbours are 2 d cos(beta)
        apart.

    Returns
    -------
    FloatArray
        That part, of the broadcast shape; negative for a grain that lies deeper.

    Examples
    --------
    >>> print(standing_out([0.5, 1.0], 60.0).round(4))
    [0.618 0.866]
    """
    size = np.asarray(relative_size, float)
    half_gap = np.cos(np.radians(np.asarray(entrainment_angle_deg, float)))
    squared_height = ((1 + size) / 2) ** 2 - half_gap**2
    centre = np.sqrt(np.maximum(squared_height, 0.0))
    return np.asarray((centre + size / 2 - 0.5) / size)


class Excess(Protocol):
    """A function of some of n grains: what forces have beyond that which holds."""

    def __call__(self, x: FloatArray, places: IntArray, /) -> FloatArray:
        """Compute it for the grains at some places, each for its own x."""
        ...


def root(function: Excess, low: FloatArray, high: FloatArray) -> FloatArray:
    """Find a root of each of n grains.

    Parameters
    ----------
    function
        The function.
    low, high
        Bounds of different signs, shape (n,).

    Returns
    -------
    FloatArray
        The roots, shape (n,), right to the last digits; NaN, not known, where none is
        found.

    Examples
    --------
    >>> squares = np.array([2.0, 3.0])
    >>> found = root(lambda x, at: x**2 - squares[at], np.zeros(2), np.full(2, 4.0))
    >>> print(found.round(6))
    [1.414214 1.732051]
    """
    from scipy.optimize.elementwise import find_root  # slow to import: no page waits

    if not len(low):
        return np.zeros(0)

    def of_floats(x: FloatArray, places: FloatArray) -> FloatArray:
        """The function of places that became floats as all arguments do."""
        return function(x, places.astype(int))

    found = find_root(of_floats, (low, high), args=(np.arange(len(low)),))
    return np.where(found.success, found.x, np.nan)


def least_ustar(excess: Excess, unit: FloatArray) -> FloatArray:
    """Find the least friction velocity at which forces move each grain.

    `RUNGS` are climbed from below, since the excess need not rise everywhere; the root
    is between the first that is enough and the one before.

    Parameters
    ----------
    excess
        The forces beyond what holds the grains.
    unit
        Friction velocity of each grain at Re* = 1, m/s, shape (n,).

    Returns
    -------
    FloatArray
        Friction velocities, m/s, shape (n,): 0 where no flow is needed, infinite where
        none is enough, NaN where that is not known, since the excess is NaN on the way.

    Examples
    --------
    >>> held = np.array([4.0, 0.0, np.inf, np.nan])
    >>> print(least_ustar(lambda u, at: u**2 - held[at], np.ones(4)))
    [ 2.  0. inf nan]
    """
    at_rest = excess(np.zeros_like(unit), np.arange(len(unit)))
    found = np.where(at_rest >= 0, 0.0, np.inf)
    found[np.isnan(at_rest)] = np.nan
    low = np.zeros_like(unit)
    high = np.full_like(unit, np.nan)
    left = np.flatnonzero(at_rest < 0)
    for rung in RUNGS:
        ustar = rung * unit[left]
        beyond = excess(ustar, left)
        found[left[np.isnan(beyond)]] = np.nan
        is_enough = beyond >= 0
        high[left[is_enough]] = ustar[is_enough]
        is_short = beyond < 0
        left = left[is_short]
        low[left] = ustar[is_short]
        if not len(left):
            break
    between = np.flatnonzero(np.isfinite(high))
    found[between] = root(
        lambda ustar, at: excess(ustar, between[at]), low[between], high[between]
    )
    return found


def check_known(ustar: FloatArray, law: str) -> None:
    """Refuse friction velocities some of which are not known.

    Parameters
    ----------
    ustar
        Friction velocities at which grains leave, m/s; NaN where that is not known.
    law
        Name of the force law.

    Raises
    ------
    InputError
        If one is NaN: it is neither that of a grain that lies loose nor of one that
        never leaves.

    Examples
    --------
    >>> check_known(np.array([0.0, 0.3, np.inf]), "bridged")
    """
    unknown = int(np.count_nonzero(np.isnan(ustar)))
    if unknown:
        what = f"{law} does not know from which flow {unknown} of {ustar.size} leave"
        raise InputError(what, "forces.law", "choose another law")


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
    """Find the threshold of one grain on its two neighbours under a force law.

    Solves ``f_d sin(beta) + f_l cos(beta) = W cos(alpha - beta) + F_a sin(2 beta)``,
    the third of Eqs. 1 with the pull F_a = cohesion x d of the contact that opens, for
    the least u*. Inputs are not validated here.

    Parameters
    ----------
    law
        The force law.
    exposure
        The grain and the fluid.
    density
        Density of the grain, kg/m3.
    slope_deg
        Slope alpha of the bed, degrees, positive where the flow goes up it.
    entrainment_angle_deg
        Entrainment angle beta, degrees.
    gravity
        Acceleration of gravity, m/s2.
    cohesion
        Pull of a contact over the diameter, N/m.

    Returns
    -------
    Threshold
        The threshold, of the broadcast shape. Where the resistance is not positive the
        friction velocity is 0, where no flow moves the grain infinite, where it is not
        known NaN. Only a friction velocity above 0 is valid.

    Examples
    --------
    >>> sand = Exposure(
    ...     diameter=1e-3, roughness=1e-3 / 30, fluid_density=1000.0, viscosity=1e-6
    ... )
    >>> angles = {"slope_deg": [0.0, 15.0], "entrainment_angle_deg": 60.0}
    >>> found = threshold(LAWS["bridged"], sand, density=2650.0, **angles)
    >>> print(found.shields.round(4))
    [0.0242 0.0346]
    """
    beta = np.radians(np.asarray(entrainment_angle_deg, float))
    submerged = weight(
        diameter=exposure.diameter,
        density=density,
        fluid_density=exposure.fluid_density,
        gravity=gravity,
    )
    of_weight = submerged * pivot_resistance(slope_deg, entrainment_angle_deg)
    pull = np.asarray(cohesion, float) * exposure.diameter
    ustar = _least(law, exposure, beta, of_weight + pull * np.sin(2 * beta))
    # where no flow moves the grain the forces are those of an infinite one: NaN
    with np.errstate(invalid="ignore"):
        lift = law.lift(ustar, exposure)
        rolls = _lift_range(lift, submerged, slope_deg).holds
        stress_area = exposure.fluid_density * (ustar * exposure.diameter) ** 2
        return Threshold(
            friction_velocity=ustar,
            reynolds=exposure.reynolds(ustar),
            shields=np.asarray(stress_area * np.pi / 6 / submerged),
            drag=law.drag(ustar, exposure),
            lift=lift,
            valid=law.valid(ustar, exposure) & rolls & (ustar > 0),
        )


def _least(
    law: ForceLaw, exposure: Exposure, beta: FloatArray, held: FloatArray
) -> FloatArray:
    """The least friction velocity of the pivot, m/s, for moments over d/2 (N)."""
    given = np.broadcast_arrays(*exposure.fields.values(), beta, held)
    *fields, angle, moment = [np.ravel(array).astype(float) for array in given]
    grains = Exposure(**dict(zip(exposure.fields, fields, strict=True)))

    def excess(ustar: FloatArray, places: IntArray) -> FloatArray:
        at = grains.at(places)
        drag = law.drag(ustar, at) * np.sin(angle[places])
        lift = law.lift(ustar, at) * np.cos(angle[places])
        return np.asarray(drag + lift - moment[places])

    found = least_ustar(excess, grains.ustar(1.0))
    return np.asarray(found.reshape(given[0].shape))


def why_not(
    law: ForceLaw,
    ustar: FloatArray,
    exposure: Exposure,
    *,
    density: ArrayLike | None = None,
    slope_deg: ArrayLike = 0.0,
    gravity: ArrayLike = GRAVITY,
) -> list[list[str]]:
    """Say why thresholds of some grains do not hold under a law.

    Parameters
    ----------
    law
        The force law.
    ustar
        Threshold friction velocities, m/s, of shape (n,) or ().
    exposure
        The grains and the fluid.
    density
        Density of the grains, kg/m3. Without it the weight, and with it a lift-off, is
        left out.
    slope_deg
        Slope of the bed, degrees, positive where the flow goes up it.
    gravity
        Acceleration of gravity, m/s2.

    Returns
    -------
    list of list of str
        For each grain the reasons in words.

    Examples
    --------
    >>> sand = Exposure(
    ...     diameter=1e-3, roughness=1e-3 / 30, fluid_density=1000.0, viscosity=1e-6
    ... )
    >>> why_not(LAWS["low"], np.array([0.002, 0.02]), sand)
    [[], ['Re* 20 is not below 3']]
    """
    ranges = list(law.ranges(ustar, exposure))
    if density is not None:
        submerged = weight(
            diameter=exposure.diameter,
            density=density,
            fluid_density=exposure.fluid_density,
            gravity=gravity,
        )
        lift = law.lift(ustar, exposure)
        ranges.append(_lift_range(lift, submerged, slope_deg))
    return reasons(ranges, np.size(ustar))


def _lift_range(
    lift: FloatArray,
    submerged: FloatArray,
    slope_deg: ArrayLike,
) -> Validity:
    """Range of the pivot: a greater lift carries the grain off before it can roll."""
    normal = submerged * np.cos(np.radians(np.asarray(slope_deg, float)))
    with np.errstate(divide="ignore", invalid="ignore"):
        over = np.asarray(lift / normal)
    quantity = "lift over the weight normal to the bed"
    return Validity(quantity, over, -np.inf, LIFT_OFF)


def shields_at(
    law: ForceLaw,
    reynolds: ArrayLike,
    *,
    roughness_ratio: ArrayLike,
    entrainment_angle_deg: ArrayLike,
    slope_deg: ArrayLike = 0.0,
    lift_coefficient: ArrayLike = LIFT_COEFFICIENT,
) -> FloatArray:
    """Compute a law's curve in the Shields diagram.

    No fluid and no grain is needed, since in units of d, nu and rho_f the moment of the
    forces depends on Re*, z0/d and the angles alone.

    Parameters
    ----------
    law
        The force law.
    reynolds
        Friction Reynolds number Re* at the threshold.
    roughness_ratio
        Roughness length over diameter, z0/d.
    entrainment_angle_deg
        Entrainment angle beta, degrees.
    slope_deg
        Slope of the bed, degrees, positive where the flow goes up it.
    lift_coefficient
        Coefficient alpha_s of Eqs. 2 and 4.

    Returns
    -------
    FloatArray
        Threshold Shields number, of the broadcast shape.

    Examples
    --------
    >>> pocket = {"roughness_ratio": 1 / 30, "entrainment_angle_deg": 60}
    >>> print(shields_at(LAWS["bridged"], [1.0, 10.0, 100.0], **pocket).round(4))
    [0.0507 0.0253 0.0334]
    """
    unit = Exposure(
        diameter=1.0,
        roughness=roughness_ratio,
        fluid_density=1.0,
        viscosity=1.0,
        lift_coefficient=lift_coefficient,
    )
    ustar = np.asarray(reynolds, float)
    beta = np.radians(np.asarray(entrainment_angle_deg, float))
    of_drag = law.drag(ustar, unit) * np.sin(beta)
    of_lift = law.lift(ustar, unit) * np.cos(beta)
    resistance = np.pi / 6 * pivot_resistance(slope_deg, entrainment_angle_deg)
    return np.asarray(resistance * ustar**2 / (of_drag + of_lift))


def default_laws(ustar: ArrayLike, exposure: Exposure) -> NDArray[np.str_]:
    """Choose the law that answers a grain for which none is asked.

    Parameters
    ----------
    ustar
        Friction velocity of its threshold under the law `DEFAULT`, m/s.
    exposure
        The grain and its fluid.

    Returns
    -------
    NDArray[np.str_]
        ``bridged``, or ``bridged-gravel`` where the particle Reynolds number is not
        below the end of the drag law of `bridged`, of the broadcast shape. The two
        differ by 5 % in the drag there.

    Examples
    --------
    >>> water = {"fluid_density": 1000.0, "viscosity": 1e-6}
    >>> sizes = Exposure(diameter=[1e-3, 3e-2], roughness=[1e-3 / 30, 1e-3], **water)
    >>> default_laws([0.018, 0.25], sizes).tolist()
    ['bridged', 'bridged-gravel']
    """
    default = LAWS[DEFAULT]
    with np.errstate(invalid="ignore"):  # no flow moves the grain: its u* is infinite
        reynolds = default.particle_reynolds(ustar, exposure)
    has_ended = reynolds >= default.drag_end
    return np.where(has_ended, default.goes_on, default.name)


def regime(low: Threshold, high: Threshold) -> NDArray[np.str_]:
    """Say which of Eqs. 2 and 4 holds at its own threshold.

    The ranges of Re* decide, Re* < 3 and Re* >= 30, and not the end of the drag of Eq.
    4: gravel is in the high regime, if beyond its drag law.

    Parameters
    ----------
    low, high
        Thresholds of the same grains by Eq. 2 and by Eq. 4.

    Returns
    -------
    NDArray[np.str_]
        ``low``, ``high`` or ``transition``, of the shape of the thresholds.

    Examples
    --------
    >>> water = {"fluid_density": 1000.0, "viscosity": 1e-6}
    >>> sand = Exposure(diameter=[5e-5, 1e-3], roughness=[5e-6, 1e-4], **water)
    >>> pocket = {"density": 2650.0, "slope_deg": 0.0, "entrainment_angle_deg": 60.0}
    >>> print(regime(*(threshold(LAWS[n], sand, **pocket) for n in ("low", "high"))))
    ['low' 'transition']
    """
    _, low_end = LAWS["low"].reynolds
    high_start, _ = LAWS["high"].reynolds
    is_low = low.reynolds < low_end
    is_high = high.reynolds >= high_start
    return np.select([is_low, is_high], ["low", "high"], "transition")


@dataclass(frozen=True, kw_only=True)
class SingleGrain:
    """All quantities that the closed form depends on.

    Attributes
    ----------
    diameter, roughness
        Diameter of the grain and roughness length of the bed, m.
    fluid_density, viscosity
        Density, kg/m3, and kinematic viscosity, m2/s, of the fluid.
    lift_coefficient
        Coefficient alpha_s of Eqs. 2 and 4.
    density
        Density of the grain, kg/m3.
    slope_deg, entrainment_angle_deg
        Slope of the bed and entrainment angle, degrees.
    gravity
        Acceleration of gravity, m/s2.
    cohesion
        Pull of a contact over the diameter, N/m.
    """

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

    @classmethod
    def of_row(cls, row: Mapping[Any, Any]) -> "SingleGrain":
        """Make the grain of a row of a table.

        Parameters
        ----------
        row
            A row with the columns `GRAIN_COLUMNS`.

        Returns
        -------
        SingleGrain
            The grain.

        Examples
        --------
        >>> sand = {"d_m": 1e-3, "rho_sol_kg_m3": 2650.0, "cohesion_n_m": 0.0}
        >>> water = {"rho_f_kg_m3": 1000.0, "nu_m2_s": 1e-6, "g_m_s2": 9.81}
        >>> bed = {"z0_m": 1e-4, "alpha_deg": 0.0, "beta_deg": 60.0, "alpha_s": 1.6}
        >>> SingleGrain.of_row({**sand, **water, **bed}).density
        2650.0
        """
        numbers = {}
        for name, column in GRAIN_COLUMNS.items():
            numbers[name] = float(row[column])
        return cls(**numbers)

    @property
    def exposure(self) -> Exposure:
        """The grain and the fluid around it, as the force laws take them."""
        return Exposure(
            diameter=self.diameter,
            roughness=self.roughness,
            fluid_density=self.fluid_density,
            viscosity=self.viscosity,
            lift_coefficient=self.lift_coefficient,
        )


_ANSWERS: dict[tuple[str, SingleGrain], Threshold] = {}
"""Thresholds that were found, by the name of the law and the grain."""


def thresholds_of(name: str, grains: Sequence[SingleGrain]) -> list[Threshold]:
    """Find the thresholds of grains under a force law, each once.

    Many grains at once take a hundredth of the time that they take one by one.

    Parameters
    ----------
    name
        Name of the force law.
    grains
        The grains.

    Returns
    -------
    list of Threshold
        Their thresholds, each of shape ().

    Examples
    --------
    >>> water = {"fluid_density": 1000.0, "viscosity": 1e-6}
    >>> bed = {"roughness": 1e-4, "slope_deg": 0.0, "entrainment_angle_deg": 60.0}
    >>> sand = {"diameter": 1e-3, "density": 2650.0, "lift_coefficient": 1.615}
    >>> grain = SingleGrain(**sand, **bed, **water, gravity=9.81)
    >>> print(thresholds_of("bridged", [grain])[0].shields.round(4))
    0.0418
    """
    keys = [(name, grain) for grain in grains]
    new = [key for key in dict.fromkeys(keys) if key not in _ANSWERS]
    if new:
        found = _threshold_of_all(name, [grain for _, grain in new])
        for place, key in enumerate(new):
            _ANSWERS[key] = found.grain(place)
    return [_ANSWERS[key] for key in keys]


def usual_law(grain: SingleGrain) -> str:
    """Choose the force law that answers a grain for which none is asked.

    Parameters
    ----------
    grain
        The grain.

    Returns
    -------
    str
        Its name.

    Examples
    --------
    >>> water = {"fluid_density": 1000.0, "viscosity": 1e-6}
    >>> bed = {"roughness": 1e-4, "slope_deg": 0.0, "entrainment_angle_deg": 60.0}
    >>> sand = {"diameter": 1e-3, "density": 2650.0, "lift_coefficient": 1.615}
    >>> usual_law(SingleGrain(**sand, **bed, **water, gravity=9.81))
    'bridged'
    """
    (at,) = thresholds_of(DEFAULT, [grain])
    return str(default_laws(at.friction_velocity, grain.exposure))


def forget() -> None:
    """Forget the thresholds that were found: the time of the next is its own.

    Examples
    --------
    >>> forget()
    """
    _ANSWERS.clear()


def _threshold_of_all(name: str, grains: Sequence[SingleGrain]) -> Threshold:
    """The thresholds of n grains under a force law, of shape (n,)."""
    numbers: dict[str, FloatArray] = {}
    for field in GRAIN_COLUMNS:
        numbers[field] = np.array([getattr(grain, field) for grain in grains], float)
    exposure = Exposure(
        diameter=numbers["diameter"],
        roughness=numbers["roughness"],
        fluid_density=numbers["fluid_density"],
        viscosity=numbers["viscosity"],
        lift_coefficient=numbers["lift_coefficient"],
    )
    return threshold(
        LAWS[name],
        exposure,
        density=numbers["density"],
        slope_deg=numbers["slope_deg"],
        entrainment_angle_deg=numbers["entrainment_angle_deg"],
        gravity=numbers["gravity"],
        cohesion=numbers["cohesion"],
    )
