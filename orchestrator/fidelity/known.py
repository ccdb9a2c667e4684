"""Known errors of the fidelities: what `orchestrator ladder` measured, by class.

``calibration/errors.csv`` has the largest error over the scenes of each class. A class
has a known error where at least `LEAST_SCENES` scenes were measured, and a scene of it
where it is within what they were (`orchestrator.fidelity.domain`).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
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
from orchestrator.fidelity.domain import has_measured, unmeasured
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

FOLDER = Path(__file__).with_name("calibration")
LEAST_SCENES = 10  # of a class, for an error to be known
UNBOUND = 10.0  # a rung that was off by so many times a threshold says nothing of it


class Error(NamedTuple):
    """Relative error of tau_c against the reference, at one fraction.

    Attributes
    ----------
    error
        Largest relative difference from the reference.
    uncertainty
        Change of the reference itself when its own numbers were changed; None where
        that was not tried.
    """

    error: float
    uncertainty: float | None

    @property
    def total(self) -> float:
        """Error and known uncertainty: the root of the sum of their squares."""
        return math.hypot(self.error, self.uncertainty or 0.0)


class Measured(NamedTuple):
    """The measured errors of a rung on a class of scenes.

    Attributes
    ----------
    fractions
        Fractions n/N at which they were measured, from the least.
    errors, uncertainties
        What `Error` has, at each of them.
    """

    fractions: tuple[float, ...]
    errors: tuple[float, ...]
    uncertainties: tuple[float | None, ...]

    def at(self, fraction: float) -> Error:
        """Find the error at a fraction; between two that were measured, the larger.

        Parameters
        ----------
        fraction
            Fraction n/N, of those measured or between them.

        Returns
        -------
        Error
            Error and uncertainty.
        """
        index = float(np.interp(fraction, self.fractions, range(len(self.fractions))))
        beside = {math.floor(index), math.ceil(index)}
        found = [Error(self.errors[i], self.uncertainties[i]) for i in beside]
        return max(found, key=lambda one: one.total)


@dataclass(frozen=True)
class Known:
    """Known error of a pile.

    Attributes
    ----------
    parts
        What was measured of its flow and of its grains, as far as these have errors;
        None where nothing is known.
    fractions
        Fractions n/N at which the pile is asked for, and errors were measured.
    """

    parts: tuple[Measured, ...] | None
    fractions: tuple[float, ...] = ()

    def at(self, fraction: float) -> Error:
        """Find the error at a fraction.

        Errors and uncertainties of flow and grains add up by their squares
        (docs/ladder.md).

        Parameters
        ----------
        fraction
            Fraction n/N, of those measured or between them.

        Returns
        -------
        Error
            Error and uncertainty; infinite where they are not known.
        """
        if self.parts is None:
            return Error(math.inf, math.inf)
        parts = [part.at(fraction) for part in self.parts]
        found = Error(
            math.hypot(*(part.error for part in parts)),
            math.hypot(*(part.uncertainty or 0.0 for part in parts)),
        )
        return found if found.total < UNBOUND else Error(math.inf, math.inf)

    @property
    def worst(self) -> Error:
        """The error at the asked fraction at which it is largest."""
        found = map(self.at, self.fractions)
        nothing = Error(math.inf, math.inf)
        return max(found, key=lambda one: one.total, default=nothing)

    @property
    def total(self) -> float:
        """The largest error with its uncertainty, of the asked fractions."""
        return self.worst.total


UNKNOWN = Known(None)


def known(fidelity: Fidelity, scene: Scene) -> Known:
    """Known error of a fidelity on a pile, at each of its fractions.

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
    flow_class, grain_class = scene_class(FLOW, scene), scene_class(GRAINS, scene)
    keys = [(GRAINS, grains.name, grain_class)]
    if flow_class == LEVEL_BED and flow is not FLAT:
        return UNKNOWN
    if flow_class != LEVEL_BED:
        keys.append((FLOW, flow.name, flow_class))
    return _of(keys, scene)


def _of_flow(scene: Scene) -> Known:
    """Known error of the closed form along the bed line of a pile whose grains go on.

    Places along the line are exact; over a level bed so is the flow.
    """
    name = scene_class(FLOW, scene)
    if name == LEVEL_BED:
        return _of([], scene)
    return _of([(FLOW, _no_finer(FLOW, scene).name, name)], scene)


def _of(keys: Iterable[tuple[str, str, str]], scene: Scene) -> Known:
    """Known error of the rungs of a pile on their classes."""
    table = measured()
    parts = []
    for key in keys:
        if key not in table:
            return UNKNOWN
        parts.append(table[key])
    asked = scene.threshold.fractions
    fractions = tuple(one for one in asked if has_measured(scene, one))
    return Known(tuple(parts), fractions)


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


@cache
def measured() -> dict[tuple[str, str, str], Measured]:
    """The measured errors, by part, name of the rung and class of scene.

    What fewer than `LEAST_SCENES` scenes say is left out: a class, or an uncertainty,
    which is None then. Without it nobody knows what the reference is worth: of grains
    nothing is known of the class, of the flow nothing of the reference.
    """
    table = pd.read_csv(FOLDER / "errors.csv").sort_values("fraction")
    is_tried = table["uncertainty_scenes"] >= LEAST_SCENES
    table["uncertainty"] = table["uncertainty"].where(is_tried)
    found: dict[tuple[str, str, str], Measured] = {}
    for (part, rung, name), rows in table.groupby(["part", "rung", "scene_class"]):
        is_bare = rows["uncertainty"].isna().any()
        if is_bare and (part == GRAINS or rung == REFERENCE.name):
            continue
        if rows["scenes"].min() >= LEAST_SCENES:
            uncertainties = rows["uncertainty"].astype(object)
            found[str(part), str(rung), str(name)] = Measured(
                tuple(rows["fraction"]),
                tuple(rows["error"]),
                tuple(uncertainties.where(rows["uncertainty"].notna(), None)),
            )
    return found
