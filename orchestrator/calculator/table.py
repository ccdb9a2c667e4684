"""Thresholds of many grains under every force law, as one table: the core of `threshold`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.calculator.parameters import DEPTH, SCENE
from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import Bound, ForceLaw
from orchestrator.physics.laws import LAWS, law
from orchestrator.physics.log_law import depth_mean_speed, log_law_speed
from orchestrator.physics.regime import LAWS_OF, Regime, regime
from orchestrator.physics.threshold import Threshold, lift_bound, threshold
from orchestrator.study.scene import Scene
from orchestrator.study.study import make_scene

PAPER = "paper"
"""The paper's rule: Eq. 2 or Eq. 4 where each holds, both in the transition."""
GAS_BELOW = 100.0
"""Density that tells gases from liquids, kg/m3: Venus has 65 at its ground."""
DEEPEST = 2e4
"""Largest depth of a liquid, m: twice the deepest sea."""
Values = Mapping[str, FloatArray]


@dataclass(frozen=True)
class Quantity:
    """A quantity of a threshold: its name in JSON, its column, and words for people."""

    name: str
    column: str
    label: str
    unit: str = ""


WINDS = (
    Quantity("wind_speed_1_m", "wind_1m_m_s", "wind at 1 m", "m/s"),
    Quantity("wind_speed_10_m", "wind_10m_m_s", "wind at 10 m", "m/s"),
)
MEAN_VELOCITY = Quantity("mean_velocity", "mean_velocity_m_s", "mean velocity", "m/s")
QUANTITIES = (
    Quantity("friction_velocity", "ustar_m_s", "u*", "m/s"),
    *WINDS,
    MEAN_VELOCITY,
    Quantity("stress", "stress_pa", "stress", "Pa"),
    Quantity("shields", "shields", "Shields"),
    Quantity("reynolds", "reynolds", "Re*"),
    Quantity("drag", "drag_n", "drag", "N"),
    Quantity("lift", "lift_n", "lift", "N"),
)


def known_law(name: str) -> str:
    """The name of a force law or of the paper's rule.

    Raises
    ------
    InputError
        If it is neither; it lists those that there are.
    """
    if name == PAPER:
        return name
    try:
        return law(name).name
    except InputError as error:
        raise InputError(error.what, remedy=f"{error.remedy}, {PAPER}") from None


def thresholds(points: pd.DataFrame, answer: str = "bridged") -> pd.DataFrame:
    """Thresholds of motion of single grains, each under every force law.

    Parameters
    ----------
    points : DataFrame
        One row for each grain, with columns named as the `PARAMETERS` (SI units, degrees). Those
        that are absent have their default; a roughness may be a text such as ``d/30``.
    answer : str
        The law whose rows are marked as the answer; ``paper`` marks those of the paper's rule.

    Returns
    -------
    DataFrame
        One row for each point and law, units in the columns' names: the parameters, ``law``, the
        `QUANTITIES`, ``valid``, ``why_not``, ``regime`` and ``answer``. A gas has winds, a liquid
        of a given depth a mean velocity; the others are NaN.

    Raises
    ------
    InputError
        For a point that is no scene, a depth that is none, or if no law holds at any point.
    """
    scenes = [_scene(point) for point in points.to_dict("records")]
    given = {p.name: np.array([attrgetter(p.field)(one) for one in scenes]) for p in SCENE}
    given[DEPTH.name] = _depths(points, given)
    # numbers beyond all floats end as laws that do not hold
    with np.errstate(all="ignore"):
        found = {name: _threshold(one, given) for name, one in LAWS.items()}
        blocks = [_told(LAWS[name], found[name], given) for name in LAWS]
    regimes = regime(found["low"], found["high"])
    columns = {p.column: np.repeat(given[p.name], len(LAWS)) for p in (*SCENE, DEPTH)}
    columns["law"] = np.tile(list(LAWS), len(scenes))
    for name in blocks[0]:
        columns[name] = np.stack([block[name] for block in blocks], axis=1).ravel()
    columns["regime"] = np.repeat(regimes, len(LAWS))
    picked = {one: [name in _picked(answer, one) for name in LAWS] for one in LAWS_OF}
    columns["answer"] = np.array([picked[one] for one in regimes.tolist()]).ravel()
    table = pd.DataFrame(columns)
    if not table["valid"].any():
        raise InputError(
            "no force law holds", where="threshold", remedy="are all numbers in SI units?"
        )
    return table


def _scene(point: Mapping[Any, Any]) -> Scene:
    parts: dict[str, dict[str, Any]] = {name: {} for name in Scene.model_fields}
    for parameter in SCENE:
        part, _, field = parameter.field.partition(".")
        value = point.get(parameter.name, parameter.default)
        if value is not None:
            parts[part][field] = value
    scene = make_scene(parts, "threshold")
    limits.check(scene, "threshold")
    return scene


def _depths(points: pd.DataFrame, given: Values) -> FloatArray:
    if DEPTH.name not in points:
        return np.full(len(points), np.nan)
    depths = points[DEPTH.name].to_numpy(float)
    bad = ~(depths > given["diameter"])
    where = f"threshold: {DEPTH.name}"
    if (depths > DEEPEST).any():
        raise InputError(
            f"{depths.max():g} m is deeper than any liquid, {DEEPEST:g} m",
            where=where,
            remedy="give the depth of the liquid in m",
        )
    if bad.any():
        raise InputError(
            f"a depth of {depths[bad][0]:g} m does not cover a grain of"
            f" {given['diameter'][bad][0]:g} m",
            where=where,
            remedy="give the depth of the liquid in m",
        )
    if np.all(_is_gas(given)):
        raise InputError(
            f"{given['fluid_density'][0]:g} kg/m3 is a gas, and a depth is a liquid's",
            where=where,
            remedy="leave it out, or set fluid.density and fluid.viscosity; water: 1000, 1e-6",
        )
    return depths


def _is_gas(given: Values) -> NDArray[np.bool_]:
    return given["fluid_density"] < GAS_BELOW


def _exposure(given: Values) -> Exposure:
    told = {name: given[name] for name in Exposure.__dataclass_fields__ if name in given}
    return Exposure(**told)


def _threshold(here: ForceLaw, given: Values) -> Threshold:
    others = ("density", "slope_deg", "entrainment_angle_deg", "gravity")
    return threshold(here, _exposure(given), **{name: given[name] for name in others})


def _told(here: ForceLaw, found: Threshold, given: Values) -> dict[str, Any]:
    """The columns of one law."""
    ustar, z0, gas = found.friction_velocity, given["roughness"], _is_gas(given)
    told = {
        "friction_velocity": ustar,
        "wind_speed_1_m": np.where(gas, log_law_speed(ustar, 1.0, z0), np.nan),
        "wind_speed_10_m": np.where(gas, log_law_speed(ustar, 10.0, z0), np.nan),
        "mean_velocity": np.where(gas, np.nan, depth_mean_speed(ustar, given["depth"], z0)),
        "stress": given["fluid_density"] * ustar**2,
        "shields": found.shields,
        "reynolds": found.reynolds,
        "drag": found.drag,
        "lift": found.lift,
    }
    exposed = _exposure(given)
    lifted = {name: given[name] for name in ("density", "slope_deg", "gravity")}
    bounds = (*here.bounds(ustar, exposed), lift_bound(found.lift, exposed, **lifted))
    why = _why_not(bounds, len(ustar))
    columns: dict[str, Any] = {one.column: told[one.name] for one in QUANTITIES}
    return {**columns, "valid": found.valid, "why_not": np.array(why, dtype=object)}


def _why_not(bounds: Sequence[Bound], count: int) -> list[str]:
    """As `ForceLaw.why_not`, of many grains."""
    reasons: list[list[str]] = [[] for _ in range(count)]
    for bound in bounds:
        for index in np.flatnonzero(~bound.holds):
            reasons[index].append(str(replace(bound, value=bound.value[index])))
    return ["; ".join(said) for said in reasons]


def _picked(answer: str, here: Regime) -> tuple[str, ...]:
    return LAWS_OF[here] if answer == PAPER else (answer,)
