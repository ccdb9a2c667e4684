"""Thresholds of many single grains under every force law, as one table."""

import re
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.calculator import PARAMETERS, QUANTITIES
from orchestrator.errors import InputError
from orchestrator.physics.beside import beside
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.laws import LAWS, Exposure, law
from orchestrator.physics.threshold import LAWS_OF, PAPER, regime, threshold, why_not
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.types import Row

Table = dict[str, NDArray[Any]]  # columns of equal length by name


def thresholds(points: Mapping[str, Any], answer: str = "bridged") -> Table:
    """Thresholds of single grains under every force law; `answer` is one, or the paper's rule.

    `points` has sequences of equal length by keys of `PARAMETERS`; a parameter that is left out has
    its default, and the depth none. The table has a row for each point and law, point by point.
    A gas has winds, a liquid of a given depth a mean velocity where its flow is turbulent; the
    others are NaN. ``answer`` is whether the law is one of those asked for.

    Raises
    ------
    InputError
        For a law or a depth that is none, a point that is no scene, or if no law holds anywhere.
    """
    try:
        _ = answer == PAPER or law(answer)
    except InputError as error:
        raise InputError(error.what, "threshold: law", f"{error.remedy}, {PAPER}") from None
    grains = _grains(points, count := len(points["diameter"]))
    depth, d, rho = grains["depth"], grains["diameter"], grains["fluid_density"]
    if "depth" in points and not ((depth > d).all() and (rho >= GAS_BELOW).any()):
        what = f"a depth of {depth.min():g} m does not cover a grain of {d.max():g} m"
        what = what if not (depth > d).all() else f"{rho[0]:g} kg/m3 is a gas"
        remedy = "give the depth of a liquid, in m; of water: fluid.kind water"
        raise InputError(what, "threshold: depth", remedy)
    exposure = Exposure(
        d, grains["roughness"], rho, grains["viscosity"], grains["lift_coefficient"]
    )
    rest = {name: grains[name] for name in ("density", "slope_deg", "gravity")}
    known = {each.column: grains[name] for name, each in PARAMETERS.items()}
    beta, blocks = grains["entrainment_angle_deg"], []
    liquid_depth = np.where(rho < GAS_BELOW, np.nan, depth)
    with np.errstate(all="ignore"):  # numbers beyond all floats end as laws that do not hold
        by_law = {
            name: threshold(
                each, exposure, entrainment_angle_deg=beta, cohesion=grains["cohesion"], **rest
            )
            for name, each in LAWS.items()
        }
        regimes = regime(by_law["low"], by_law["high"]).astype(object)
        picked = [LAWS_OF[each] if answer == PAPER else (answer,) for each in regimes]
        for name, at in by_law.items():
            numbers: Table = {c: getattr(at, key, rho) for c, (key, _) in QUANTITIES.items()}
            numbers |= measurable_speeds(
                at.friction_velocity,
                roughness=grains["roughness"],
                density=rho,
                viscosity=grains["viscosity"],
                depth=liquid_depth,
            )
            numbers |= {"stress_pa": rho * at.friction_velocity**2}
            reasons = why_not(LAWS[name], at.friction_velocity, exposure, **rest)
            block: Table = {"law": np.full(count, name, object), **numbers}
            block |= {"valid": at.valid, "why_not": np.array(reasons, object), "regime": regimes}
            block |= beside({**known, **block, "force_law": block["law"]})
            blocks.append({**block, "answer": np.array([name in laws for laws in picked])})
    table = {each.column: np.repeat(grains[name], len(LAWS)) for name, each in PARAMETERS.items()}
    for column in blocks[0]:
        table[column] = np.stack([block[column] for block in blocks], axis=1).ravel()
    if not table["valid"].any():
        raise InputError("no force law holds", "threshold", "are all numbers in SI units?")
    return table


def _grains(points: Mapping[str, Any], count: int) -> Table:
    """All parameters as numbers.

    A point that may be beyond a limit is made a scene, which refuses it or warns; no other point.
    """
    given = {name: points.get(name, [each.default] * count) for name, each in PARAMETERS.items()}
    lengths = [*map(_length, given["roughness"], given["diameter"])]
    grains = {name: np.array(x, float) for name, x in {**given, "roughness": lengths}.items()}
    is_safe = grains["density"] > grains["fluid_density"]
    is_safe &= grains["roughness"] <= 0.3 * grains["diameter"]
    for name, each in PARAMETERS.items():
        low, high = each.ordinary
        is_safe &= (name == "depth") | (grains[name] >= low) & (grains[name] <= high)
    for index in np.flatnonzero(~is_safe):
        from orchestrator.fidelity import limits
        from orchestrator.physics.threshold import SingleGrain
        from orchestrator.study.closed_form import single_grain
        from orchestrator.study.study import make_scene

        parts: dict[str, Row] = defaultdict(dict)
        for name in SingleGrain._fields:
            part, _, field = PARAMETERS[name].field.partition(".")
            value = given[name][index]
            parts[part][field] = value if isinstance(value, str) else float(value)
        scene = make_scene({**parts, "protocol": {"method": "pivot"}}, "threshold")
        limits.check(scene, "threshold")
        for name, number in single_grain(scene)._asdict().items():
            grains[name][index] = number
    return grains


def _length(z0: Any, diameter: float) -> float:
    """A roughness length, m, of a number or a text such as ``d/30``; NaN of any other text."""
    if not isinstance(z0, str):
        return float(z0)
    part = re.fullmatch(r"d/([1-9]\d*(?:\.\d+)?)", z0)
    return float(f"{diameter / float(part[1]):.12g}") if part else np.nan  # digits as in a scene
