"""Numerical errors of the fidelities: what is known of a pile.

A class has a known numerical error where at least `LEAST_SCENES` scenes were
measured, and a scene of it where it is within what they were
(`orchestrator.fidelity.domain`).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property

from orchestrator.fidelity import measured
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
from orchestrator.fidelity.measured import NOTHING, Error, Measured, together
from orchestrator.study.methods import METHODS
from orchestrator.study.scene import Scene

UNBOUND = 10.0  # a rung that was off by so many times a threshold says nothing of it


@dataclass(frozen=True)
class Known:
    """Numerical error of a pile.

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
            return NOTHING
        found = _together_at(self.parts, fraction)
        return found if found.total < UNBOUND else NOTHING

    @cached_property
    def worst(self) -> Error:
        """The error at the asked fraction at which it is largest."""
        found = map(self.at, self.fractions)
        return max(found, key=lambda one: one.total, default=NOTHING)

    @property
    def total(self) -> float:
        """The largest error with its uncertainty, of the asked fractions."""
        return self.worst.total


@cache  # thousands of piles share a few errors
def _together_at(parts: tuple[Measured, ...], fraction: float) -> Error:
    """The error of flow and grains together at a fraction."""
    return together(tuple(part.at(fraction) for part in parts))


UNKNOWN = Known(None)


def known(fidelity: Fidelity, scene: Scene) -> Known:
    """Numerical error of a fidelity on a pile, at each of its fractions.

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
    if unmeasured(scene, by_dem=_is_by_dem(fidelity, scene)):
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


def _is_by_dem(fidelity: Fidelity, scene: Scene) -> bool:
    """Whether a fidelity moves the grains of a scene in time."""
    kind = fidelity.grains.sets.get("method.kind", scene.method.kind)
    return kind in METHODS and METHODS[kind].is_resolved_in_time


def _of_flow(scene: Scene) -> Known:
    """Numerical error of the closed form along the bed line, in sustained motion.

    Places along the line are exact; over a level bed so is the flow.
    """
    name = scene_class(FLOW, scene)
    if name == LEVEL_BED:
        return _of([], scene)
    return _of([(FLOW, _no_finer(FLOW, scene).name, name)], scene)


def _of(keys: Iterable[tuple[str, str, str]], scene: Scene) -> Known:
    """Numerical error of the rungs of a pile on their classes."""
    table = measured.errors()
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
        if (part, rung.name, name) in measured.errors() and rung.describes(
            scene, or_finer=True
        ):
            return rung
    return OWN
