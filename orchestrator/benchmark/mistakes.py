"""What a wrong number looks like: the ratio to the expected one tells many causes."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

CLOSE = 2e-3
"""Relative: a ratio this close to that of a known mistake is taken for it."""
STEADY = 1e-3
"""Ratios that differ less than this are one factor."""
FEWEST = 3
"""Places at which a factor must hold to be called one."""
ANGLES = {math.pi / 180: "degrees taken for radians", 180 / math.pi: "radians taken for degrees"}
SPHERE, DISC, SHELL = 2 / 5, 1 / 2, 2 / 3
"""Moments of inertia over m r^2."""


def hint(kind: str, told: Mapping[str, Any], quantity: str, ratios: Sequence[float]) -> str:
    """The likely cause of wrong numbers of a quantity, or nothing.

    Parameters
    ----------
    kind : str
        Of the scene.
    told : mapping
        Its parameters.
    quantity : str
        What is wrong.
    ratios : sequence of float
        Answers over expected values, of all its places.
    """
    if not ratios or not all(math.isfinite(r) for r in ratios):
        return ""
    first = sorted(ratios)[len(ratios) // 2]
    steady = max(ratios) - min(ratios) <= STEADY * abs(first)
    if not steady:
        return ""
    for ratio, cause in (*_of_kind(kind, told, quantity), *_units()):
        if abs(first / ratio - 1) < CLOSE:
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


def _of_kind(kind: str, told: Mapping[str, Any], quantity: str) -> Iterator[tuple[float, str]]:
    bodies = ((DISC, "the inertia of a disc"), (SHELL, "the inertia of a hollow sphere"))
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
