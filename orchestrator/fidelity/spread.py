"""The spread of the model: what choices move that all fidelities share.

``calibration/budget.csv`` has what `orchestrator budget` measured.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.digits import number, percent
from orchestrator.fidelity.measured import FOLDER, LEAST_SCENES
from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

VISCOUS = 3.0
"""Re* below which a bed is smooth."""
ROUGH = 30.0
"""Re* from which a bed is rough."""
FROZEN = "frozen bed"
"""The choice that the flow over the initial pile acts until the last grain has left."""
STATED = (
    "packing",
    "roughness length",
    "entrainment angle",
    "friction angle",
    "lift coefficient",
)
"""Choices whose values a study file states."""


class Spread(NamedTuple):
    """How far the choices of all fidelities lower and raise a Shields number, relative.

    Attributes
    ----------
    low, high
        All choices together, down and up.
    dominant
        The choice whose interval is the widest.
    frozen_bed
        How far a bed that changes moves the number at most.
    """

    low: float = math.nan
    high: float = math.nan
    dominant: str = ""
    frozen_bed: float = math.nan


def model_class(scene: Scene) -> str:
    """Name the class of scenes on which the shared choices have the same effect.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    str
        The class.
    """
    bed = scene.bed
    assert isinstance(bed, PileBed)
    reynolds = float(closed_form(scene).reynolds)
    regime = "rough"
    if reynolds < VISCOUS:
        regime = "viscous"
    elif reynolds < ROUGH:
        regime = "transitional"
    words = [bed.packing, regime]
    if not bed.is_triangle:
        words.append(bed.shape_name)
    return ", ".join(words)


def spread(scene: Scene, fraction: float) -> Spread:
    """Look up the spread of the threshold of a pile.

    What the frozen bed does is the largest of the scenes of the class; it is not known
    of a bed that changes already, nor of a flow that is not solved. Of a strip that DEM
    follows, whose grains go on after a gust or stop, no choice was changed: the spread
    of piles is none of it.

    Parameters
    ----------
    scene
        The scene of a pile.
    fraction
        Fraction n/N of the counted grains.

    Returns
    -------
    Spread
        The spread; NaN where it is not known.
    """
    if scene.is_followed:
        return Spread()
    of_class = _spread(model_class(scene), fraction)
    if scene.threshold.update or not scene.method.flow.facts.is_solved:
        return of_class._replace(frozen_bed=math.nan)
    return of_class


@cache
def _spread(model: str, fraction: float) -> Spread:
    """The spread of a class, at the measured fraction that is nearest."""
    rows = _budget().query("model_class == @model").set_index("choice")
    apart = (rows["fraction"] - fraction).abs()
    shares = rows.loc[apart == apart.min(), ["shields_low", "shields_high"]]
    if shares.empty:
        return Spread()
    frozen_bed = float(shares.max(axis=1).get(FROZEN, math.nan))
    return Spread(
        *combined_shares(shares), str(shares.sum(axis=1).idxmax()), frozen_bed
    )


def combined_shares(
    shares: pd.DataFrame, quantity: str = "shields"
) -> tuple[float, float]:
    """Combine shares of independent choices by their squares.

    Nothing falls below zero, however many choices lower it.

    Parameters
    ----------
    shares
        A row for each choice, with its shares down and up.
    quantity
        The quantity that the shares are of.

    Returns
    -------
    low, high : float
        The shares of all choices, down and up.
    """
    low, high = (
        float(np.hypot.reduce(shares[f"{quantity}_{end}"])) for end in ("low", "high")
    )
    return min(low, 1.0), high


class Floor(NamedTuple):
    """Error below which the model's uncertainty hides the numerics.

    Attributes
    ----------
    error
        Half the interval of the choices that no study file states, the smallest over
        the fractions and the classes of beds of one kind.
    scenes
        The number of beds that it was measured on.
    """

    error: float
    scenes: int

    def __str__(self) -> str:
        return f"{percent(self.error)}, measured on {number(self.scenes, 'bed')}"


@cache
def floors() -> dict[str, Floor]:
    """Find the errors below which the model's uncertainty hides the numerics, by class.

    Poured beds and lattices are a kind each: of one class two beds were measured.

    Returns
    -------
    dict of str to Floor
        The floors of the classes of each kind of which at least `LEAST_SCENES` beds
        were measured.
    """
    unstated = _budget()[~_budget()["choice"].isin(STATED)]
    kinds: dict[bool, dict[str, Floor]] = {}
    for model, rows in unstated.groupby("model_class"):
        halves = [
            sum(combined_shares(part)) / 2 for _, part in rows.groupby("fraction")
        ]
        floor = Floor(min(halves), int(rows["scenes"].min()))
        is_poured = str(model).startswith("poured")
        kinds.setdefault(is_poured, {})[str(model)] = floor
    found: dict[str, Floor] = {}
    for classes in kinds.values():
        least = min(floor.error for floor in classes.values())
        pooled = Floor(least, sum(floor.scenes for floor in classes.values()))
        if pooled.scenes >= LEAST_SCENES:
            found |= dict.fromkeys(classes, pooled)
    return found


@cache
def _budget() -> pd.DataFrame:
    return pd.read_csv(FOLDER / "budget.csv")
