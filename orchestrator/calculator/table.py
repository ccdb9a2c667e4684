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
from orchestrator.physics.threshold import (
    AUTO,
    LAWS_OF,
    PAPER,
    default_laws,
    regime,
    threshold,
    why_not,
)
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.types import FloatArray, Row

Table = dict[str, NDArray[Any]]  # columns of equal length by name


def thresholds(points: Mapping[str, Any], answer: str = AUTO) -> Table:
    """Thresholds of single grains under every force law.

    Parameters
    ----------
    points
        Sequences of equal length by keys of `PARAMETERS`. A parameter that is left out has
        its default, and the depth none.
    answer
        The law that is asked for, ``auto`` for the default law, or the paper's rule.

    Returns
    -------
    A row for each point and law, point by point. A gas has winds, a liquid of a given depth
    a mean velocity where its flow is turbulent; the others are NaN. ``answer`` is whether
    the law is one of those asked for.

    Raises
    ------
    InputError
        For a law or a depth that is none, a point that is no scene, or if no law holds
        anywhere.
    """
    if answer not in (AUTO, PAPER):
        try:
            law(answer)
        except InputError as error:
            remedy = f"{error.remedy}, {AUTO}, {PAPER}"
            raise InputError(error.what, "threshold: law", remedy) from None
    count = len(points["diameter"])
    grains = _grains(points, count)
    d, density = grains["diameter"], grains["fluid_density"]
    depth = grains["depth"]
    if "depth" in points:
        _check_depth(depth, d, density)
    exposure = Exposure(
        d,
        grains["roughness"],
        density,
        grains["viscosity"],
        grains["lift_coefficient"],
    )
    rest = {name: grains[name] for name in ("density", "slope_deg", "gravity")}
    pivot = {
        "entrainment_angle_deg": grains["entrainment_angle_deg"],
        "cohesion": grains["cohesion"],
    }
    known = {each.column: grains[name] for name, each in PARAMETERS.items()}
    liquid_depth = np.where(density < GAS_BELOW, np.nan, depth)
    blocks = []
    with np.errstate(
        all="ignore"
    ):  # numbers beyond all floats end as laws that do not hold
        by_law = {
            n: threshold(each, exposure, **rest, **pivot) for n, each in LAWS.items()
        }
        regimes = regime(by_law["low"], by_law["high"]).astype(object)
        picked = _picked(answer, regimes, by_law["bridged"].friction_velocity, exposure)
        for name, at in by_law.items():
            ustar = at.friction_velocity
            block: Table = {"law": np.full(count, name, object)}
            # columns that are no attribute of a threshold follow below
            block |= {
                c: getattr(at, key, density) for c, (key, _) in QUANTITIES.items()
            }
            block |= measurable_speeds(
                ustar,
                roughness=grains["roughness"],
                density=density,
                viscosity=grains["viscosity"],
                depth=liquid_depth,
            )
            block["stress_pa"] = density * ustar**2
            block["valid"] = at.valid
            reasons = why_not(LAWS[name], ustar, exposure, **rest)
            block["why_not"] = np.array(reasons, object)
            block["regime"] = regimes
            block |= beside({**known, **block, "force_law": block["law"]})
            block["answer"] = np.array([name in laws for laws in picked])
            blocks.append(block)
    table = {column: np.repeat(values, len(LAWS)) for column, values in known.items()}
    for column in blocks[0]:
        table[column] = np.stack([block[column] for block in blocks], axis=1).ravel()
    if not table["valid"].any():
        remedy = "are all numbers in SI units?"
        raise InputError("no force law holds", "threshold", remedy)
    return table


def _check_depth(depth: FloatArray, d: FloatArray, density: FloatArray) -> None:
    """Refuse a depth that does not cover the grains, or that of a gas."""
    remedy = "give the depth of a liquid, in m; of water: fluid.kind water"
    if not (depth > d).all():
        what = f"a depth of {depth.min():g} m does not cover a grain of {d.max():g} m"
        raise InputError(what, "threshold: depth", remedy)
    if (density < GAS_BELOW).all():
        raise InputError(f"{density[0]:g} kg/m3 is a gas", "threshold: depth", remedy)


def _picked(
    answer: str, regimes: NDArray[Any], ustar: FloatArray, exposure: Exposure
) -> list[tuple[str, ...]]:
    """The laws that answer each point; `ustar` is that of its threshold under `bridged`."""
    if answer == PAPER:
        return [LAWS_OF[regime] for regime in regimes]
    if answer == AUTO:
        names = default_laws(ustar, exposure)
        return [(name,) for name in np.broadcast_to(names, len(regimes)).tolist()]
    return [(answer,)] * len(regimes)


def _grains(points: Mapping[str, Any], count: int) -> Table:
    """All parameters as numbers.

    A point that may be beyond a limit is made a scene, which refuses it or warns; no other point.
    """
    given = {
        name: points.get(name, [each.default] * count)
        for name, each in PARAMETERS.items()
    }
    lengths = [*map(_length, given["roughness"], given["diameter"])]
    grains = {
        name: np.array(x, float) for name, x in {**given, "roughness": lengths}.items()
    }
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
    part = re.fullmatch(r"d/([1-9]\d*(?:\.\d+)?)", z0, re.ASCII)
    return (
        float(f"{diameter / float(part[1]):.12g}") if part else np.nan
    )  # digits as in a scene
