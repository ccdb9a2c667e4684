"""Known errors of the fidelities: what `orchestrator ladder` measured, by class.

``calibration/errors.csv`` has the largest error over the scenes of each class. A class
has a known error where at least `LEAST_SCENES` scenes were measured, and a scene of it
where it is within what they were (`orchestrator.fidelity.domain`).
"""

import math
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from orchestrator.fidelity.classes import (
    FLOW,
    GRAINS,
    LEVEL_BED,
    scene_class,
)
from orchestrator.fidelity.domain import unmeasured
from orchestrator.fidelity.fidelities import (
    FIDELITIES,
    FLAT,
    LOCAL,
    OWN,
    OWN_NUMBERS,
    REFERENCE,
    Fidelity,
    Rung,
)
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray

FOLDER = Path(__file__).with_name("calibration")
LEAST_SCENES = 10  # of a class, for an error to be known
UNBOUND = 10.0  # a rung that was off by so many times a threshold says nothing of it


class Known(NamedTuple):
    """Known relative error of tau_c against the reference.

    Attributes
    ----------
    error
        Largest relative difference from the reference.
    uncertainty
        Change of the reference itself when its own numbers were changed; NaN where
        that was not tried.
    """

    error: float
    uncertainty: float

    @property
    def total(self) -> float:
        """Error and known uncertainty: the root of the sum of their squares."""
        return math.hypot(self.error, float(np.nan_to_num(self.uncertainty)))


UNKNOWN = Known(math.inf, math.inf)


def known(fidelity: Fidelity, scene: Scene) -> Known:
    """Known error of a fidelity on a pile, at the fraction where it is largest.

    Errors and uncertainties of flow and grains add up by their squares
    (docs/ladder.md).

    Parameters
    ----------
    fidelity
        The fidelity. That of a scene with numbers of its own has, for flow and grains
        each, the error of the costliest fidelity that is no finer.
    scene
        The pile as it is asked for, or as it is answered where it has its own numbers.

    Returns
    -------
    Known
        `UNKNOWN` where nothing was measured.
    """
    if unmeasured(scene):
        return UNKNOWN
    if fidelity is LOCAL:
        return _of_flow(scene)
    flow = fidelity.flow_over(scene)
    grains = fidelity.grains
    if fidelity is REFERENCE:
        # nothing finer was run beside its flow
        flow = _no_finer(FLOW, fidelity.answer(scene))
    elif fidelity is OWN_NUMBERS:
        flow = _no_finer(FLOW, scene)
        grains = _no_finer(GRAINS, scene)
    return _of_classes(
        flow, grains, scene_class(FLOW, scene), scene_class(GRAINS, scene)
    )


def _of_flow(scene: Scene) -> Known:
    """Known error of the closed form along the bed line of a pile whose grains go on.

    Places along the line are exact; over a level bed so is the flow.
    """
    name = scene_class(FLOW, scene)
    if name == LEVEL_BED:
        return Known(0.0, 0.0)
    found = measured().get((FLOW, _no_finer(FLOW, scene).name, name))
    if found is None:
        return UNKNOWN
    return _worst(*found)


def _no_finer(part: str, scene: Scene) -> Rung:
    """The costliest measured rung no finer than a scene's method; `OWN` without one."""
    if part == FLOW and scene_class(FLOW, scene) == LEVEL_BED:
        return FLAT if FLAT.describes(scene) else OWN
    name = scene_class(part, scene)
    for one in FIDELITIES[::-1]:
        rung = one.flow if part == FLOW else one.grains
        if (part, rung.name, name) in measured() and rung.describes(
            scene, or_finer=True
        ):
            return rung
    return OWN


@cache  # a study has thousands of scenes of a few classes
def _of_classes(flow: Rung, grains: Rung, flow_class: str, grain_class: str) -> Known:
    """Known error of two rungs on two classes; unknown where it has no bound."""
    keys = [(GRAINS, grains.name, grain_class)]
    if flow_class == LEVEL_BED and flow is not FLAT:
        return UNKNOWN
    if flow_class != LEVEL_BED:
        keys.append((FLOW, flow.name, flow_class))
    table = measured()
    if not all(key in table for key in keys):
        return UNKNOWN
    # both parts at each fraction, and the worst fraction
    parts = np.array([table[key] for key in keys])
    errors = np.hypot.reduce(parts[:, 0])
    uncertainties = np.hypot.reduce(np.nan_to_num(parts[:, 1]))
    found = _worst(errors, uncertainties)
    return found if found.total < UNBOUND else UNKNOWN


def _worst(errors: FloatArray, uncertainties: FloatArray) -> Known:
    """Error and uncertainty at the fraction where both together are largest."""
    both = np.hypot(errors, np.nan_to_num(uncertainties))
    worst = int(np.argmax(both))
    return Known(float(errors[worst]), float(uncertainties[worst]))


@cache
def measured() -> dict[tuple[str, str, str], FloatArray]:
    """The measured errors, by part, name of the rung and class of scene.

    Each is an array with the rows error and uncertainty, and a column for each
    fraction. What fewer than `LEAST_SCENES` scenes say is left out: a class, or an
    uncertainty, which is NaN then. Without it nobody knows what the reference is worth:
    of grains nothing is known of the class, of the flow nothing of the reference.
    """
    table = pd.read_csv(FOLDER / "errors.csv").sort_values("fraction")
    is_tried = table["uncertainty_scenes"] >= LEAST_SCENES
    table["uncertainty"] = table["uncertainty"].where(is_tried)
    found: dict[tuple[str, str, str], FloatArray] = {}
    for (part, rung, name), rows in table.groupby(["part", "rung", "scene_class"]):
        is_bare = rows["uncertainty"].isna().any()
        if is_bare and (part == GRAINS or rung == REFERENCE.name):
            continue
        if rows["scenes"].min() >= LEAST_SCENES:
            numbers = rows[["error", "uncertainty"]].to_numpy(float).T
            found[str(part), str(rung), str(name)] = numbers
    return found
