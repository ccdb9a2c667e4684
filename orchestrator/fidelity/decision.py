"""The decision how a scene is answered: its fidelity levels, their known error, the reason."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

from orchestrator.fidelity import calibration, levels, spread
from orchestrator.fidelity.calibration import UNKNOWN, Known
from orchestrator.fidelity.levels import FLAT, LEVELS, Levels, Part, changed
from orchestrator.study import fields
from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

QUIET_ENOUGH = 6.0
"""A protocol that waits at least this long, sqrt(d/g'), holds the flow; a faster one is a ramp, and
its rate is a part of what is asked."""
LIFT_OFF = 0.95
"""Lift over the weight at a grain's own threshold from which it lifts off before it rolls: of the
piles of the preset `paper` those below 0.93 roll, those above 0.98 are carried off."""


@dataclass(frozen=True)
class Decision:
    """How a scene is answered.

    Attributes
    ----------
    asked, scene : Scene
        As the study asks for it, and as it is answered.
    levels : mapping of str to str
        The fidelity level of each part of a pile, by name; empty for a single grain.
    known : Known
        The error of tau_c on these levels and its uncertainty, at the fraction of the scene where
        the two together are largest; infinite where it is not known.
    why : str
        The reason, for people.
    by_default : bool
        Whether the study file left the levels open.
    """

    asked: Scene
    scene: Scene
    levels: Levels
    known: Known
    why: str
    by_default: bool = False

    @property
    def is_as_asked(self) -> bool:
        """Whether the scene is answered as the study asks for it."""
        return self.scene == self.asked

    @property
    def levels_text(self) -> str:
        """The names of the levels in one text."""
        return " | ".join(self.levels.values())

    @property
    def error_estimate(self) -> float | None:
        """The known error with its uncertainty; None where it is not known."""
        return self.known.total if math.isfinite(self.known.total) else None


@dataclass(frozen=True)
class Bound:
    """Levels that are not good enough for a scene: dearer ones are chosen.

    Attributes
    ----------
    levels : mapping of str to str
        By part, the name of the dearest one that is not.
    because : str
        What they fail in, for people.
    """

    levels: Levels
    because: str


LIFTED = Bound({"grains": "peeling"}, "the lift carries grains off, which DEM alone shows")
NO_BOUND = Bound({}, "")
DEAREST_THEORY = "waves"
"""Level of the flow above which it is solved."""
NONE = "cheapest that errs less than the reference is uncertain: none is"
"""How the reason begins where no levels are within a tolerance."""


def decide(scene: Scene, tolerance: float | None, above: Bound | None = None) -> Decision:
    """Choose the cheapest levels that are known to be within a tolerance of the dearest ones.

    Parameters
    ----------
    scene : Scene
        Resolved.
    tolerance : float or None
        Relative error of tau_c at each of the scene's fractions, the uncertainty of the reference
        included; None or 0: the scene as it is asked.
    above : Bound, optional
        Levels that turned out to be not good enough.

    Returns
    -------
    Decision
        Where none is within the tolerance, on the cheapest levels that err less than their
        reference is uncertain; as asked where nothing is known, or where the way to the answer is
        a part of what is asked.
    """
    if not tolerance:
        return as_asked(scene)
    if why := _asks_for(scene):
        return as_asked(scene, why)
    if not isinstance(scene.bed, PileBed):
        exact = changed(scene, {"protocol.method": "pivot"})
        why = "the closed form is exact for a single grain in a held flow"
        return Decision(scene, exact, {}, UNKNOWN, why)
    bound = above or _own_bound(scene)
    named, why = _cheapest(
        tuple((part, calibration.scene_class(part, scene)) for part in LEVELS),
        scene.protocol.fractions,
        tuple(bound.levels.items()),
        tolerance,
    )
    why = f"{why}; {bound.because}" if bound.because else why
    return on_levels(scene, dict(named), why) if named else as_asked(scene, why)


def by_default(scene: Scene, above: Bound | None = None) -> Decision:
    """The decision on a scene of a study that says nothing of how to answer.

    A pile whose file sets no field about the answer is answered on the cheapest levels whose known
    error is below the model's own spread. The flow is solved: whoever wants a theory of it names a
    tolerance. The bound is one for all kinds of scenes, so that what stands in one figure was found
    in one way. All else is answered as asked: single grains, poured beds, and what is set.
    """
    if not leaves_open(scene):
        return as_asked(scene)
    floor = spread.lowest_floor()
    bound = above or _own_bound(scene)
    chosen = decide(scene, floor, Bound({"flow": DEAREST_THEORY, **bound.levels}, bound.because))
    if chosen.is_as_asked or not chosen.levels:
        return chosen
    which = "cheapest" if chosen.known.total <= floor else NONE
    why = f"chosen by default: {which} within the model's own spread of {floor:.0%}"
    because = f"; {bound.because}" if bound.because else ""
    return replace(chosen, why=why + because, by_default=True)


def leaves_open(scene: Scene) -> bool:
    """Whether the study file of a pile sets none of the fields that are about the answer."""
    if not isinstance(scene.bed, PileBed) or scene.is_poured:
        return False
    return not any(
        field in getattr(scene, part).model_fields_set
        for one in fields.FIELDS
        if one.info.about == "answer"
        for part, _, field in (one.name.partition("."),)
    )


def as_asked(scene: Scene, why: str = "as the study asks") -> Decision:
    """The decision to answer a scene as it is."""
    if not isinstance(scene.bed, PileBed):
        return Decision(scene, scene, {}, UNKNOWN, why)
    held = levels.holding(scene)
    return Decision(scene, scene, held, _known(scene, held), why)


def on_levels(scene: Scene, named: Levels, why: str) -> Decision:
    """The decision to answer a pile on some levels."""
    answered = scene
    for part, name in named.items():
        answered = levels.level(part, name).answer(answered)
    return Decision(scene, answered, named, _known(scene, named), why)


def _known(scene: Scene, named: Levels) -> Known:
    classes = {part: calibration.scene_class(part, scene) for part in named}
    found = calibration.known(named, classes, scene.protocol.fractions)
    return max(found, key=lambda one: one.total)


def _asks_for(scene: Scene) -> str:
    """How a scene wants to be answered; empty where the tool may choose.

    It may where DEM in a held, solved flow is asked for, which is what the levels approximate. Over
    a level bed no flow is solved.
    """
    if scene.protocol.method != "dem":
        return f"the study asks for the method {scene.protocol.method}"
    if scene.flow.model not in ("solve", levels.solved_model(scene)):
        return f"the study asks for the flow model {scene.flow.model}"
    if scene.protocol.update:
        return "the study asks for a bed that changes, for which no error is known"
    if scene.protocol.waiting_time < QUIET_ENOUGH:
        return "the study asks for a ramp of the flow"
    return ""


def _own_bound(scene: Scene) -> Bound:
    return LIFTED if lifts_off(scene) else NO_BOUND


def lifts_off(scene: Scene) -> bool:
    """Whether the lift carries a grain off before it rolls, which DEM alone shows."""
    return float(closed_form(scene).lift) >= LIFT_OFF * scene.weight


Named = tuple[tuple[Part, str], ...]
"""The items of a mapping by part, in a form that can be cached by."""


@cache  # a study has thousands of scenes of a few classes
def _cheapest(
    classes: Named, fractions: tuple[float, ...], above: Named, tolerance: float
) -> tuple[Named, str]:
    """A level for each part, and why; no levels where nothing is known."""
    offered = _pairs(classes, fractions, dict(above))
    pairs = sorted(offered, key=lambda pair: pair.known.cost_core_s)
    within = next((pair for pair in pairs if pair.known.total <= tolerance), None)
    if within:
        return within.levels, "cheapest within the tolerance"
    best = min(pairs, key=lambda pair: pair.known.total, default=None)
    if best is None or math.isinf(best.known.total):
        return (), "no error is known: as the study asks"
    # against a reference that is no better known, a dearer pair is not known to be nearer
    enough = next(pair for pair in pairs if pair.known.error <= best.known.total)
    return enough.levels, f"{NONE} within the tolerance"


class _Pair(NamedTuple):
    levels: Named
    known: Known


def _pairs(classes: Named, fractions: tuple[float, ...], above: Levels) -> Iterator[_Pair]:
    parts = [part for part, _ in classes]
    offered = (_above(part, found, above.get(part)) for part, found in classes)
    for names in itertools.product(*offered):
        named = tuple(zip(parts, names, strict=True))
        found = calibration.known(dict(named), dict(classes), fractions)
        yield _Pair(named, max(found, key=lambda one: one.total))


def _above(part: Part, scene_class: str, name: str | None) -> list[str]:
    """The levels above one; over a level bed there is no other flow."""
    if scene_class == calibration.LEVEL:
        return [FLAT]
    listed = [one.name for one in LEVELS[part]]
    start = 0 if name is None else listed.index(name) + 1
    return [one.name for one in LEVELS[part][start:] if one.same_model]
