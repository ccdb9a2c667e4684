"""The threshold of motion of one exposed grain that rolls over its neighbour."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.errors import InputError
from orchestrator.physics.constants import LIFT_COEFFICIENT
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import (
    DEFAULT,
    LAWS,
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

    @classmethod
    def together(
        cls, found: Sequence["Threshold"], shape: tuple[int, ...]
    ) -> "Threshold":
        """Put thresholds of one grain each into one of a shape.

        Parameters
        ----------
        found
            The thresholds, each of shape ().
        shape
            The shape.

        Returns
        -------
        Threshold
            All of them.
        """
        arrays = {}
        for each in fields(cls):
            values = np.array([getattr(one, each.name) for one in found])
            arrays[each.name] = values.reshape(shape)
        return cls(**arrays)

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


def threshold(law: ForceLaw, grain: Grain) -> Threshold:
    """Find the threshold of each grain on its two neighbours under a force law.

    Solves ``f_d sin(beta) + f_l cos(beta) = W cos(alpha - beta) + F_a sin(2 beta)``,
    the third of Eqs. 1 with the pull F_a = cohesion x d of the contact that opens, for
    the least u*. Inputs are not validated here.

    Parameters
    ----------
    law
        The force law.
    grain
        The grains.

    Returns
    -------
    Threshold
        The threshold, of the shape of the grains. Where the resistance is not positive
        the friction velocity is 0, where no flow moves the grain infinite, where it is
        not known NaN. Only a friction velocity above 0 is valid.

    Examples
    --------
    >>> sand = Grain(
    ...     diameter=1e-3,
    ...     density=2650.0,
    ...     fluid_density=1000.0,
    ...     viscosity=1e-6,
    ...     slope_deg=[0.0, 15.0],
    ...     entrainment_angle_deg=60.0,
    ... )
    >>> print(threshold(LAWS["bridged"], sand).shields.round(4))
    [0.0242 0.0346]
    """
    ustar = _least(law, grain.flat).reshape(grain.shape)
    # where no flow moves the grain the forces are those of an infinite one: NaN
    with np.errstate(invalid="ignore"):
        lift = law.lift(ustar, grain)
        rolls = _lift_range(lift, grain).holds
        return Threshold(
            friction_velocity=ustar,
            reynolds=grain.reynolds(ustar),
            shields=grain.shields(ustar),
            drag=law.drag(ustar, grain),
            lift=lift,
            valid=law.valid(ustar, grain) & rolls & (ustar > 0),
        )


def _least(law: ForceLaw, grains: Grain) -> FloatArray:
    """The least friction velocity of the pivot, m/s, shape (n,)."""
    beta = np.radians(grains.entrainment_angle_deg)
    of_weight = grains.weight * pivot_resistance(
        grains.slope_deg, grains.entrainment_angle_deg
    )
    held = of_weight + grains.cohesion * grains.diameter * np.sin(2 * beta)

    def excess(ustar: FloatArray, places: IntArray) -> FloatArray:
        """Moment over d/2 less that which holds, N."""
        at = grains.at(places)
        drag = law.drag(ustar, at) * np.sin(beta[places])
        lift = law.lift(ustar, at) * np.cos(beta[places])
        return np.asarray(drag + lift - held[places])

    return least_ustar(excess, grains.ustar(1.0))


def why_not(
    law: ForceLaw, ustar: FloatArray, grain: Grain, *, lifts: bool = True
) -> list[list[str]]:
    """Say why thresholds of some grains do not hold under a law.

    Parameters
    ----------
    law
        The force law.
    ustar
        Threshold friction velocities, m/s, of shape (n,) or ().
    grain
        The grains.
    lifts
        Whether a lift that carries a grain off before it rolls is a reason.

    Returns
    -------
    list of list of str
        For each grain the reasons in words.

    Examples
    --------
    >>> sand = Grain(
    ...     diameter=1e-3, density=2650.0, fluid_density=1000.0, viscosity=1e-6
    ... )
    >>> why_not(LAWS["low"], np.array([0.002, 0.02]), sand)
    [[], ['Re* 20 is not below 3']]
    """
    ranges = list(law.ranges(ustar, grain))
    if lifts:
        ranges.append(_lift_range(law.lift(ustar, grain), grain))
    return reasons(ranges, np.size(ustar))


def _lift_range(lift: FloatArray, grain: Grain) -> Validity:
    """Range of the pivot: a greater lift carries the grain off before it can roll."""
    normal = grain.weight * np.cos(np.radians(grain.slope_deg))
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
        Critical Shields number, of the broadcast shape.

    Examples
    --------
    >>> pocket = {"roughness_ratio": 1 / 30, "entrainment_angle_deg": 60}
    >>> print(shields_at(LAWS["bridged"], [1.0, 10.0, 100.0], **pocket).round(4))
    [0.0507 0.0253 0.0334]
    """
    unit = Grain(
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


def default_laws(ustar: ArrayLike, grain: Grain) -> NDArray[np.str_]:
    """Choose the law that answers a grain for which none is asked.

    Parameters
    ----------
    ustar
        Friction velocity of its threshold under the law `DEFAULT`, m/s.
    grain
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
    >>> sizes = Grain(diameter=[1e-3, 3e-2], **water)
    >>> default_laws([0.018, 0.25], sizes).tolist()
    ['bridged', 'bridged-gravel']
    """
    default = LAWS[DEFAULT]
    with np.errstate(invalid="ignore"):  # no flow moves the grain: its u* is infinite
        reynolds = default.particle_reynolds(ustar, grain)
    has_ended = reynolds >= default.drag_end
    return np.where(has_ended, default.extended_by, default.name)


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
    >>> pocket = {"density": 2650.0, "entrainment_angle_deg": 60.0}
    >>> sand = Grain(diameter=[5e-5, 1e-3], roughness=[5e-6, 1e-4], **pocket, **water)
    >>> print(regime(*(threshold(LAWS[name], sand) for name in ("low", "high"))))
    ['low' 'transition']
    """
    _, low_end = LAWS["low"].reynolds
    high_start, _ = LAWS["high"].reynolds
    is_low = low.reynolds < low_end
    is_high = high.reynolds >= high_start
    return np.select([is_low, is_high], ["low", "high"], "transition")


_ANSWERS: dict[tuple[str, tuple[float, ...]], Threshold] = {}
"""Thresholds that were found, by the name of the law and the row of the grain."""


def thresholds_of(name: str, grain: Grain) -> Threshold:
    """Find the thresholds of grains under a force law, each once.

    Many grains at once take a hundredth of the time that they take one by one.

    Parameters
    ----------
    name
        Name of the force law.
    grain
        The grains.

    Returns
    -------
    Threshold
        Their thresholds, of the shape of the grains.

    Examples
    --------
    >>> sand = Grain(
    ...     diameter=1e-3,
    ...     density=2650.0,
    ...     fluid_density=1000.0,
    ...     viscosity=1e-6,
    ...     entrainment_angle_deg=60.0,
    ... )
    >>> print(thresholds_of("bridged", sand).shields.round(4))
    0.0242
    """
    keys = [(name, row) for row in grain.rows]
    new = [key for key in dict.fromkeys(keys) if key not in _ANSWERS]
    if new:
        found = threshold(LAWS[name], Grain.of_rows([row for _, row in new]))
        for place, key in enumerate(new):
            _ANSWERS[key] = found.grain(place)
    return Threshold.together([_ANSWERS[key] for key in keys], grain.shape)


def usual_law(grain: Grain) -> str:
    """Choose the force law that answers a grain for which none is asked.

    Parameters
    ----------
    grain
        The grain, of shape ().

    Returns
    -------
    str
        Its name.

    Examples
    --------
    >>> water = {"fluid_density": 1000.0, "viscosity": 1e-6}
    >>> pocket = {"density": 2650.0, "entrainment_angle_deg": 60.0}
    >>> usual_law(Grain(diameter=1e-3, **pocket, **water))
    'bridged'
    """
    at = thresholds_of(DEFAULT, grain)
    return str(default_laws(at.friction_velocity, grain))


def forget() -> None:
    """Forget the thresholds that were found: the time of the next is its own.

    Examples
    --------
    >>> forget()
    """
    _ANSWERS.clear()
