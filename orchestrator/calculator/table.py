"""Thresholds of many single grains under every force law, as one table."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.calculator import GAS_BELOW, MOST_POINTS, PARAMETERS
from orchestrator.errors import InputError
from orchestrator.fidelity import limits
from orchestrator.physics.force_law import Exposure
from orchestrator.physics.laws import LAWS, law
from orchestrator.physics.threshold import LAWS_OF, regime, threshold, why_not
from orchestrator.physics.velocity import depth_mean_speed, log_law_speed, smooth_wall_roughness
from orchestrator.study.closed_form import PAPER, SingleGrain, single_grain
from orchestrator.study.fields import PARTS
from orchestrator.study.scene import Scene
from orchestrator.study.study import make_scene
from orchestrator.types import FloatArray

LAMINAR_BELOW = 2000.0
"""U D/nu below which open water may be laminar, and has no logarithmic profile."""


def check_law(name: str, where: str = "threshold: law") -> None:
    """Refuse a name, by an `InputError`, that is neither a force law's nor the paper's rule."""
    try:
        _ = name == PAPER or law(name)
    except InputError as error:
        raise InputError(error.what, where, f"{error.remedy}, {PAPER}") from None


def thresholds(points: pd.DataFrame, answer: str = "bridged") -> pd.DataFrame:
    """Thresholds of single grains under every force law.

    `points` has a row for each point and keys of `PARAMETERS` as columns; a parameter that is left
    out has its default, and the depth none. `answer` is a force law, or ``paper`` for the paper's
    rule. The table has a row for each point and law, point by point: the parameters, ``law``, the
    columns of `QUANTITIES`, ``valid`` and ``why_not``, ``regime``, and ``answer``, whether the law
    is one of those asked for. A gas has winds, a liquid of a given depth a mean velocity where its
    flow is turbulent; the others are NaN.

    Raises
    ------
    InputError
        For a point that is no scene, a depth that is none, more than 100,000 points, or if no law
        holds at any point.
    """
    if len(points) > MOST_POINTS:
        what = f"{len(points)} points are more than {MOST_POINTS}"
        raise InputError(what, "threshold", "ask in parts")
    rows = [single_grain(_scene(point)) for point in points.to_dict("records")]
    grains = pd.DataFrame(rows, columns=SingleGrain._fields)
    grains["depth"] = points["depth"].to_numpy(float) if "depth" in points else np.nan
    if "depth" in points:
        depth, d, rho = grains["depth"], grains["diameter"], grains["fluid_density"]
        if not (depth > d).all():
            what = f"a depth of {depth.min():g} m does not cover a grain of {d.max():g} m"
            raise InputError(what, "threshold: depth", "give the depth of the liquid in m")
        if (rho < GAS_BELOW).all():
            what, remedy = f"{rho[0]:g} kg/m3 is a gas", "set fluid.density and fluid.viscosity"
            raise InputError(what, "threshold: depth", f"{remedy}; water: 1000, 1e-6")
    exposure = Exposure(*(grains[name] for name in SingleGrain._fields[:5]))
    rest = {name: grains[name].to_numpy() for name in SingleGrain._fields[5:]}
    given = pd.DataFrame({each.column: grains[name] for name, each in PARAMETERS.items()})
    with np.errstate(all="ignore"):  # numbers beyond all floats end as laws that do not hold
        by_law = {name: threshold(each, exposure, **rest) for name, each in LAWS.items()}
        del rest["entrainment_angle_deg"]
        regimes = regime(by_law["low"], by_law["high"])
        blocks = []
        for name, at in by_law.items():
            ustar, names = at.friction_velocity, (name,) if answer == name else ()
            picked = [name in (LAWS_OF[each] if answer == PAPER else names) for each in regimes]
            results = _results(ustar, grains) | {
                "shields": at.shields,
                "reynolds": at.reynolds,
                "drag_n": at.drag,
                "lift_n": at.lift,
                "valid": at.valid,
                "why_not": np.array(why_not(LAWS[name], ustar, exposure, **rest), object),
            }
            blocks.append(given.assign(law=name, **results, regime=regimes, answer=picked))
    table = pd.concat(blocks).sort_index(kind="stable", ignore_index=True)
    if not table["valid"].any():
        raise InputError("no force law holds", "threshold", "are all numbers in SI units?")
    return table


def _scene(point: Mapping[Any, Any]) -> Scene:
    parts: dict[str, dict[str, Any]] = {name: {} for name in PARTS}
    for name in SingleGrain._fields:
        part, _, field = PARAMETERS[name].field.partition(".")
        if (value := point.get(name, PARAMETERS[name].default)) is not None:
            parts[part][field] = value
    scene = make_scene(parts, "threshold")
    limits.check(scene, "threshold")
    return scene


def _results(ustar: FloatArray, grains: pd.DataFrame) -> dict[str, FloatArray]:
    """What follows from u* (m/s), of shape (n,): speeds of the flow and the stress on the bed."""
    rho, nu, depth = (grains[name].to_numpy() for name in ("fluid_density", "viscosity", "depth"))
    z0 = np.maximum(grains["roughness"], smooth_wall_roughness(ustar, nu))
    mean = depth_mean_speed(ustar, depth, z0)
    turbulent = mean * depth / nu >= LAMINAR_BELOW
    return {
        "ustar_m_s": ustar,
        "wind_1m_m_s": np.where(rho < GAS_BELOW, log_law_speed(ustar, 1.0, z0), np.nan),
        "wind_10m_m_s": np.where(rho < GAS_BELOW, log_law_speed(ustar, 10.0, z0), np.nan),
        "mean_velocity_m_s": np.where((rho >= GAS_BELOW) & turbulent, mean, np.nan),
        "stress_pa": rho * ustar**2,
    }
