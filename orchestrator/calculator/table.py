"""Thresholds of many single grains under every force law, as one table."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.calculator.parameters import GAS_BELOW, MOST_POINTS, PARAMETERS
from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.physics.force_law import Exposure, ForceLaw
from orchestrator.physics.laws import LAWS, law
from orchestrator.physics.threshold import LAWS_OF, Threshold, regime, threshold, why_not
from orchestrator.physics.velocity import depth_mean_speed, log_law_speed, smooth_wall_roughness
from orchestrator.study.closed_form import PAPER, SingleGrain, single_grain
from orchestrator.study.scene import Scene
from orchestrator.study.study import make_scene

DEEPEST = 2e4
"""Largest depth of a liquid, m: twice the deepest sea."""
LAMINAR_BELOW = 2000.0
"""U D/nu below which open water may be laminar, and has no logarithmic profile."""


def check_law(name: str, where: str = "threshold: law") -> None:
    """See that a name is that of a force law or the paper's rule.

    Raises
    ------
    InputError
        If it is neither; it lists the names that there are.
    """
    if name == PAPER:
        return
    try:
        law(name)
    except InputError as error:
        raise InputError(error.what, where=where, remedy=f"{error.remedy}, {PAPER}") from None


def thresholds(points: pd.DataFrame, answer: str = "bridged") -> pd.DataFrame:
    """Thresholds of single grains under every force law.

    Parameters
    ----------
    points : DataFrame
        A row for each point; its columns are keys of `PARAMETERS`. A parameter that is left out
        has its default, and the depth none.
    answer : str
        A force law, or ``paper`` for the paper's rule.

    Returns
    -------
    DataFrame
        A row for each point and law, point by point: the parameters, ``law``, the columns of
        `QUANTITIES`, ``valid`` and ``why_not``, ``regime``, and ``answer``, whether the law is one
        of those that are asked for. A gas has winds, a liquid of a given depth a mean velocity
        where its flow is turbulent; the others are NaN.

    Raises
    ------
    InputError
        For a point that is no scene, a depth that is none, more than 100,000 points, or if no law
        holds at any point.
    """
    if len(points) > MOST_POINTS:
        what = f"{len(points)} points are more than {MOST_POINTS}"
        raise InputError(what, where="threshold", remedy="ask in parts")
    grains = pd.DataFrame(
        [single_grain(_scene(point)) for point in points.to_dict("records")],
        columns=SingleGrain._fields,
    )
    grains["depth"] = points["depth"].to_numpy(float) if "depth" in points else np.nan
    if "depth" in points:
        _check_depth(grains)
    exposure = Exposure(*(grains[name] for name in SingleGrain._fields[:5]))
    others = {name: grains[name].to_numpy() for name in SingleGrain._fields[5:]}
    # numbers beyond all floats end as laws that do not hold
    with np.errstate(all="ignore"):
        by_law = {name: threshold(each, exposure, **others) for name, each in LAWS.items()}
        blocks = {name: _columns(LAWS[name], by_law[name], exposure, grains) for name in LAWS}
    regimes = regime(by_law["low"], by_law["high"])
    given = pd.DataFrame({each.column: grains[name] for name, each in PARAMETERS.items()})
    picked = {key: laws if answer == PAPER else (answer,) for key, laws in LAWS_OF.items()}
    table = pd.concat(
        given.assign(
            law=name,
            **block,
            regime=regimes,
            answer=[name in picked[key] for key in regimes.tolist()],
        )
        for name, block in blocks.items()
    ).sort_index(kind="stable", ignore_index=True)
    if not table["valid"].any():
        what, remedy = "no force law holds", "are all numbers in SI units?"
        raise InputError(what, where="threshold", remedy=remedy)
    return table


def _scene(point: Mapping[Any, Any]) -> Scene:
    parts: dict[str, dict[str, Any]] = {name: {} for name in Scene.model_fields}
    for name in SingleGrain._fields:
        part, _, field = PARAMETERS[name].field.partition(".")
        value = point.get(name, PARAMETERS[name].default)
        if value is not None:
            parts[part][field] = value
    scene = make_scene(parts, "threshold")
    limits.check(scene, "threshold")
    return scene


def _check_depth(grains: pd.DataFrame) -> None:
    depth, d, density = grains["depth"], grains["diameter"], grains["fluid_density"]
    what, remedy = "", "give the depth of the liquid in m"
    if (depth > DEEPEST).any():
        what = f"{depth.max():g} m is deeper than any liquid, {DEEPEST:g} m"
    elif (bad := ~(depth > d)).any():
        what = f"a depth of {depth[bad].iloc[0]:g} m does not cover a grain of {d[bad].iloc[0]:g} m"
    elif (density < GAS_BELOW).all():
        what = f"{density[0]:g} kg/m3 is a gas, and a depth is a liquid's"
        remedy = "leave it out, or set fluid.density and fluid.viscosity; water: 1000, 1e-6"
    if what:
        raise InputError(what, where="threshold: depth", remedy=remedy)


def _columns(
    here: ForceLaw, found: Threshold, exposure: Exposure, grains: pd.DataFrame
) -> dict[str, Any]:
    """The columns of one law, each of shape (n,)."""
    ustar = found.friction_velocity
    density, viscosity = grains["fluid_density"].to_numpy(), grains["viscosity"].to_numpy()
    z0 = np.maximum(grains["roughness"], smooth_wall_roughness(ustar, viscosity))
    gas, depth = density < GAS_BELOW, grains["depth"].to_numpy()
    mean = depth_mean_speed(ustar, depth, z0)
    turbulent = mean * depth / viscosity >= LAMINAR_BELOW
    rest = {name: grains[name].to_numpy() for name in ("density", "slope_deg", "gravity")}
    return {
        "ustar_m_s": ustar,
        "wind_1m_m_s": np.where(gas, log_law_speed(ustar, 1.0, z0), np.nan),
        "wind_10m_m_s": np.where(gas, log_law_speed(ustar, 10.0, z0), np.nan),
        "mean_velocity_m_s": np.where(~gas & turbulent, mean, np.nan),
        "stress_pa": density * ustar**2,
        "shields": found.shields,
        "reynolds": found.reynolds,
        "drag_n": found.drag,
        "lift_n": found.lift,
        "valid": found.valid,
        "why_not": np.array(why_not(here, ustar, exposure, **rest), object),
    }
