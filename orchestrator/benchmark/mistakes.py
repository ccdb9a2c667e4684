"""The likely cause of wrong numbers: what a known mistake would have answered instead."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark import exact
from orchestrator.physics.force_law import Exposure
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import threshold

CLOSE = 2e-3
"""Relative: a ratio this close to that of a known mistake is taken for it."""
SOFT = 1e-2
"""The same where soft springs start a grain early."""
STEADY = 1e-3
"""Ratios that differ less than this are one factor."""
FEWEST = 3
"""Places at which a factor must hold to be called one."""
EXACT = 1e-5
"""Relative: a formula with a known mistake is met this closely; dry and submerged weight differ by
2e-4 in air."""
FEW = 0.05
"""Part of N: counts this close to those of a known mistake are taken for it."""
ANGLES = {math.pi / 180: "degrees taken for radians", 180 / math.pi: "radians taken for degrees"}
SPHERE, DISC, SHELL = 2 / 5, 1 / 2, 2 / 3
"""Moments of inertia over m r^2."""
CRITERIA = (0.1, 0.2, 0.5)
"""Values taken for the displacement criterion by mistake, d."""
GRAVITIES = (9.8, 9.80665, 10.0)
"""Values taken for g by mistake, m/s2."""
DERIVED = ("reynolds", "shields")
"""Quantities that follow from the threshold's u*."""
Told = Mapping[str, Any]
Bodies = tuple[tuple[float, str], ...]


def hint(told: Told, rows: pd.DataFrame, wrong: pd.DataFrame) -> str:
    """The likely cause of wrong numbers, or nothing.

    Parameters
    ----------
    told : mapping
        The parameters of the scene.
    rows : DataFrame
        All its answers: columns ``quantity``, ``at``, ``value`` (expected) and ``found``.
    wrong : DataFrame
        Those that are wrong, the one first that is told of.
    """
    kind, quantity = str(told["kind"]), str(wrong["quantity"].iloc[0])
    if not np.isfinite(wrong["found"]).all():
        return ""
    with np.errstate(all="ignore"):  # a mistake may make numbers that are none
        cause = _formula(told, wrong) if kind == "closed-form" else _counting(rows, wrong)
        same = rows[rows["quantity"] == quantity]
        return cause or _factor(kind, told, quantity, (same["found"] / same["value"]).tolist())


def _factor(kind: str, told: Told, quantity: str, ratios: Sequence[float]) -> str:
    """The cause of a quantity that is wrong by one factor at all places."""
    first = sorted(ratios)[len(ratios) // 2]
    if not max(ratios) - min(ratios) <= STEADY * abs(first):
        return ""
    for ratio, cause in (*_of_kind(kind, told, quantity), *_units()):
        if abs(first / ratio - 1) < (SOFT if kind == "passing" else CLOSE):
            return cause
    if len(ratios) >= FEWEST:
        return f"{100 * (first - 1):+.3g} % at each of {len(ratios)} places: one factor is wrong"
    return ""


def _units() -> Iterator[tuple[float, str]]:
    for power in (1, 2, 3, 6, 9):
        yield 10.0**power, f"10^{power} times too large: another unit"
        yield 10.0**-power, f"10^{power} times too small: another unit"
    yield from ANGLES.items()
    yield -1.0, "the sign is turned"


def _of_kind(kind: str, told: Told, quantity: str) -> Iterator[tuple[float, str]]:
    bodies = ((DISC, "the inertia of a disc"), (SHELL, "the inertia of a hollow sphere"))
    if quantity == "reynolds":
        yield 0.5, "it is that of the radius"
    if kind == "incline":
        a, friction = math.radians(told["incline_deg"]), math.tan(math.radians(told["phi_deg"]))
        rolls = math.tan(a) < (1 + 1 / SPHERE) * friction
        right = math.sin(a) / (1 + SPHERE) if rolls else math.sin(a) - friction * math.cos(a)
        yield math.sin(a) / right, "there is no friction"
        for inertia, cause in bodies:
            yield math.sin(a) / (1 + inertia) / right, cause
    if kind == "sliding" and quantity == "speed_over_start":
        yield 1 + SPHERE, "there is no friction"
    if kind == "sliding":
        for inertia, cause in bodies:
            yield (1 + SPHERE) / (1 + inertia), cause
    if kind == "collision":
        zeta = told["damping"]
        root = math.sqrt(1 - zeta**2)
        right = math.exp(-zeta / root * (math.pi - 2 * math.asin(zeta)))
        yield math.exp(-zeta / root * math.pi) / right, "the contact pulls before it ends"
        yield 1 / right, "there is no damping"
    if kind == "passing":
        yield from _passing(told, bodies)


def _passing(told: Told, bodies: Bodies) -> Iterator[tuple[float, str]]:
    criterion = told["displacement_criterion"]
    push = exact.push_of(told)
    right = exact.passing_time(push, criterion)
    for other in CRITERIA:
        cause = f"a grain counts as moved at {other:g} d, not at {criterion:g} d"
        yield exact.passing_time(push, other) / right, cause
    for inertia, cause in (*bodies, (0.0, "there is no friction, or the grain does not turn")):
        yield exact.passing_time(push, criterion, inertia) / right, cause


def _formula(told: Told, wrong: pd.DataFrame) -> str:
    """The changed parameter with which the formulas of level 1 give the wrong numbers."""
    own = wrong[~wrong["quantity"].isin(DERIVED)]
    used = own if len(own) else wrong
    for cause, change in _changes(told):
        answer = formulas({**told, **change})
        expected = [answer(q, at) for q, at in zip(used["quantity"], used["at"], strict=True)]
        matters = not np.allclose(used["value"], expected, rtol=EXACT, atol=0)
        if matters and np.allclose(used["found"], expected, rtol=EXACT, atol=0):
            return cause
    return ""


def _changes(told: Told) -> Iterator[tuple[str, Told]]:
    yield "there is no lift", {"alpha_s": 0.0}
    own = LAWS[told["force_law"]].label
    for name, law in LAWS.items():
        yield f"the forces are those of {law.label}, not of {own}", {"force_law": name}
    yield "the sign of the slope is turned", {"alpha_deg": -told["alpha_deg"]}
    yield "the slope is left out", {"alpha_deg": 0.0}
    submerged = 1 - told["rho_f_kg_m3"] / told["rho_sol_kg_m3"]
    yield (
        "the weight is that of the dry grain, not of the submerged one",
        {"g_m_s2": told["g_m_s2"] / submerged},
    )
    yield "the radius is taken for the diameter", {"d_m": told["d_m"] / 2}
    yield (
        "the entrainment angle is counted from the other side",
        {"beta_deg": 90 - told["beta_deg"]},
    )
    yield "the slope is converted to radians twice", {"alpha_deg": math.radians(told["alpha_deg"])}
    yield "the lift coefficient is that for the radius", {"alpha_s": 4 * told["alpha_s"]}
    for g in GRAVITIES:
        yield f"g is {g:g}, not {told['g_m_s2']:g} m/s2", {"g_m_s2": g}


def formulas(told: Told) -> Callable[[str, str], float]:
    """The formulas of level 1."""
    law = LAWS[told["force_law"]]
    around = ("d_m", "z0_m", "rho_f_kg_m3", "nu_m2_s", "alpha_s")
    exposure = Exposure(*(told[name] for name in around))
    found = threshold(
        law,
        exposure,
        density=told["rho_sol_kg_m3"],
        slope_deg=told["alpha_deg"],
        entrainment_angle_deg=told["beta_deg"],
        gravity=told["g_m_s2"],
    )
    forces = {"drag_n": law.drag, "lift_n": law.lift}
    thresholds = {
        "ustar_m_s": found.friction_velocity,
        "reynolds": found.reynolds,
        "shields": found.shields,
    }
    return lambda q, at: float(forces[q](float(at), exposure) if at else thresholds[q])


def _counting(rows: pd.DataFrame, wrong: pd.DataFrame) -> str:
    """Guess the counting rule behind a pile's counts."""
    of = {name: own.set_index("at") for name, own in rows.groupby("quantity")}
    if "carried_off" not in of or "moved" not in wrong["quantity"].to_numpy():
        return ""
    moved, carried = of["moved"], of["carried_off"]["value"]
    last = carried.index[-1]
    total = moved.loc[last, "value"] + of["not_moved"].loc[last, "value"]
    without = moved.loc[last, "value"] - carried[last]
    if abs(moved.loc[last, "found"] - without) <= FEW * total:
        return "grains that were carried off are not counted as moved"
    return ""
