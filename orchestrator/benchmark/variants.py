"""Scenes with numbers that are drawn for one run: there a table of the pack's answers is wrong."""

import random
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark import answer, exact
from orchestrator.benchmark.answer import AnswerError
from orchestrator.benchmark.mistakes import formulas
from orchestrator.benchmark.problem import Problem, expectations, mechanics, place
from orchestrator.benchmark.problem import exact as exactly
from orchestrator.benchmark.verdict import within

EACH = 3
"""Scenes of a kind that are asked again with other numbers."""
VARIED = ("d_m", "alpha_deg", "damping", "incline_deg", "force_n")
"""The numbers that are changed."""
LITTLE, MUCH = (0.01, 0.03), (0.15, 0.3)
"""Changes of a number, relative: they tell, with a tolerance of 1e-6 and of 1 %."""
Told = Mapping[str, Any]


def drawn(scenes: Mapping[str, Told], names: Iterable[str]) -> set[str]:
    """The scenes that are asked again: some of each kind whose answers depend on a formula."""
    kinds: dict[str, list[str]] = {}
    for name in names:
        if has_variant(scenes[name]):
            kinds.setdefault(str(scenes[name]["kind"]), []).append(name)
    some = (random.sample(of, min(EACH, len(of))) for of in kinds.values())
    return {name for of in some for name in of}


def has_variant(told: Told) -> bool:
    """Whether the answers to a scene with other numbers are known."""
    return told["kind"] in MAKERS


def variant(told: Told) -> Problem | None:
    """The scene, under its own name, with one or two numbers changed; None where it has none.

    A pack may come from anywhere: its numbers may be such that a formula gives none.
    """
    with np.errstate(all="ignore"):
        made = MAKERS[str(told["kind"])](told)
    name = str(told["scene"]).partition("-")[2]
    return replace(made, name=name) if np.isfinite(made.expected["value"]).all() else None


def changes(told: Told, other: Told) -> str:
    """The numbers of a variant that are no others' consequence."""
    names = [name for name in VARIED if name in other and told.get(name) != other[name]]
    return ", ".join(f"{name} = {other[name]:.6g}" for name in names)


def wrong(expected: pd.DataFrame, given: bytes) -> str:
    """Quantities of an answer beyond the expectations, if any."""
    try:
        found = answer.parsed(given)
    except AnswerError as error:
        return error.what
    numbers = np.array([found.get(key, np.nan) for key in answer.keys(expected)])
    off = expected["tolerance"].notna() & ~within(numbers, expected, expected["tolerance"])
    if not off.any():
        return ""
    first = int(off.to_numpy().argmax())
    row = expected.iloc[first]
    return f"{row['quantity']} is {numbers[first]:.6g}, not {row['value']:.6g}"


def _closed_form(told: Told) -> Problem:
    size, slope = 1 + random.uniform(*LITTLE), 1 - random.uniform(*LITTLE)
    grain = {"d_m": told["d_m"] * size, "z0_m": told["z0_m"] * size}
    changed = {**told, **grain, "alpha_deg": told["alpha_deg"] * slope}
    weight = told["weight_n"] * size**3
    gravity, stiffness = told["reduced_gravity_m_s2"], told.get("stiffness", 1e4)
    changed |= mechanics(changed["d_m"], told["rho_sol_kg_m3"], gravity, weight, stiffness)
    formula = formulas(changed)
    ustar = formula("ustar_m_s", "")
    places = [place(float(f"{x * ustar:.4g}")) for x in exact.FLOWS]
    asked = [(quantity, at) for quantity in ("drag_n", "lift_n") for at in places]
    asked += [(quantity, "") for quantity in ("ustar_m_s", "reynolds", "shields")]
    rows = [exactly(q, formula(q, at), exact.FORMULA, at) for q, at in asked]
    head = ("schema", "scene", "level", "kind")
    numbers = {name: value for name, value in changed.items() if name not in head}
    return Problem(1, "", "closed-form", numbers, {}, expectations(rows))


MAKERS: dict[str, Callable[[Told], Problem]] = {
    "closed-form": _closed_form,
    "collision": lambda told: exact.collision(told["damping"] * (1 - random.uniform(*MUCH))),
    "incline": lambda told: exact.incline(told["incline_deg"] * (1 - random.uniform(*MUCH))),
    "passing": lambda told: exact.passing(exact.push_of(told) * (1 + random.uniform(*MUCH))),
}
"""Parameters that make a variant, by kind; the start of a sliding grain has no effect."""
