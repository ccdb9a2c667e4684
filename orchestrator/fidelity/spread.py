"""The model's own spread: what the choices are worth that all fidelity levels share.

``calibration/budget.csv`` holds what ``orchestrator budget`` measured: for each class of scenes,
choice and fraction, how far its alternatives lower and raise a threshold.
"""

import csv
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

from orchestrator.fidelity import calibration
from orchestrator.study.scene import Scene


@dataclass(frozen=True)
class Share:
    """Effect of one choice on a threshold.

    Attributes
    ----------
    choice : str
        Its name.
    low, high : float
        How far its alternatives lower and raise the Shields number, relative, at least 0.
    """

    choice: str
    low: float
    high: float


@dataclass(frozen=True)
class Spread:
    """Effect of all shared choices together.

    Attributes
    ----------
    low, high : float
        How far they lower and raise the Shields number of a threshold, relative; NaN where nothing
        is known.
    dominant : str
        The choice with the widest share; empty where nothing is known.
    """

    low: float
    high: float
    dominant: str


FROZEN = "frozen bed"
"""The choice that the flow of the whole pile acts until the last grain has gone."""
STATED = frozenset(
    ("packing", "roughness length", "entrainment angle", "friction angle", "lift coefficient")
)
"""Choices that a study file states: their shares say what its values are worth, not what its model
is."""
UNKNOWN = Spread(math.nan, math.nan, "")


def together(values: Iterable[float]) -> float:
    """Shares of choices that have nothing to do with one another, as one: their root sum square."""
    return math.hypot(*values)


def spread(scene: Scene, fraction: float) -> Spread:
    """The spread of the threshold of a pile at a fraction of its grains."""
    shares = _shares(scene, fraction)
    return _of(shares) if shares else UNKNOWN


def of_choice(scene: Scene, fraction: float, choice: str) -> float:
    """How far one choice is known to move the threshold, down or up, relative; else NaN."""
    found = (max(one.low, one.high) for one in _shares(scene, fraction) if one.choice == choice)
    return next(found, math.nan)


def _shares(scene: Scene, fraction: float) -> tuple[Share, ...]:
    rows = _measured().get(calibration.model_class(scene), {})
    # between the fractions that were measured the nearest one speaks
    return rows[min(rows, key=lambda known: abs(known - fraction))] if rows else ()


def floor(scene: Scene) -> float:
    """Half the model's interval of a pile whose file's values are sure, relative; NaN if not known.

    It is the smallest over the fractions: an error of the numerics below it buys nothing.
    """
    return _floor(_measured().get(calibration.model_class(scene), {}))


@cache
def lowest_floor() -> float:
    """The smallest floor of all kinds of scenes that were measured, relative."""
    return min(map(_floor, _measured().values()))


def _floor(rows: Mapping[float, tuple[Share, ...]]) -> float:
    known = (_of(tuple(one for one in row if one.choice not in STATED)) for row in rows.values())
    return min(((one.low + one.high) / 2 for one in known), default=math.nan)


def _of(shares: tuple[Share, ...]) -> Spread:
    # nothing falls below zero, however many choices lower it
    low = min(together(one.low for one in shares), 1.0)
    high = together(one.high for one in shares)
    return Spread(low, high, max(shares, key=lambda one: one.low + one.high).choice)


@cache
def _measured() -> dict[str, dict[float, tuple[Share, ...]]]:
    """The measured shares, by class of scenes, then by fraction."""
    found: dict[str, dict[float, tuple[Share, ...]]] = {}
    with (calibration.FOLDER / "budget.csv").open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            share = Share(row["choice"], float(row["shields_low"]), float(row["shields_high"]))
            by_fraction = found.setdefault(row["model_class"], {})
            fraction = float(row["fraction"])
            by_fraction[fraction] = (*by_fraction.get(fraction, ()), share)
    return found
