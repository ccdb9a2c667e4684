"""The decision how a scene is answered: its fidelity levels, their known error, the reason.

A study with a tolerance is answered on the cheapest levels that are known to meet it. Of the piles
of each slope, packing and force law that are answered without DEM, the cheapest by DEM is answered
by DEM as well; where the two differ by more than the tolerance, all of them go to higher levels.
"""

import itertools
import math
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

from orchestrator.fidelity import calibration
from orchestrator.fidelity.calibration import UNKNOWN, Known
from orchestrator.fidelity.levels import (
    FLAT,
    FLOW,
    GRAINS,
    PEELING,
    Level,
    Pair,
    changed,
    level,
    pair_of,
)
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.study import fields
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

LEAST_HELD = 6.0
"""Waiting time, sqrt(d/g'), from which load steps hold the flow. Shorter ones make a ramp, whose
rate is a part of what is asked."""


@dataclass(frozen=True)
class Decision:
    """How a scene is answered.

    Attributes
    ----------
    asked, scene : Scene
        As the study asks for it, and as it is answered.
    levels : Pair or None
        The fidelity levels of a pile; None for a single grain.
    known : Known
        The error of tau_c on these levels and its uncertainty.
    why : str
        The reason, for people.
    by_default : bool
        Whether the study file left the levels open.
    """

    asked: Scene
    scene: Scene
    levels: Pair | None
    known: Known
    why: str
    by_default: bool = False

    @property
    def is_as_asked(self) -> bool:
        """Whether the scene is answered as the study asks for it."""
        return self.scene == self.asked

    @property
    def error_estimate(self) -> float | None:
        """The known error with its uncertainty; None where it is not known."""
        return self.known.total if math.isfinite(self.known.total) else None

    @property
    def is_unchecked(self) -> bool:
        """Whether it is a pile that the tool chose to answer without DEM."""
        method = self.scene.protocol.method
        return self.levels is not None and not self.is_as_asked and method != "dem"


class Bound(NamedTuple):
    """The highest levels that are not good enough for a scene, and why: higher ones are chosen."""

    flow: Level | None = None
    grains: Level | None = None
    because: str = ""


NO_BOUND = Bound()
THEORY = level("flow", "waves")
"""Above it the flow is solved."""
CHECK = Bound(level("flow", "coarse"), PEELING, "it checks answers without DEM")
"""Above it are the levels that check an answer without DEM."""
NONE_WITHIN = "cheapest whose error is below the uncertainty of the reference: none is"
"""How the reason begins where no levels meet the tolerance."""


def decide(scene: Scene, tolerance: float | None, above: Bound = NO_BOUND) -> Decision:
    """Choose the cheapest levels that are known to be within a tolerance of the best ones.

    Parameters
    ----------
    scene : Scene
        Resolved.
    tolerance : float or None
        Relative error of tau_c at the scene's fractions, the uncertainty of the reference
        included; None or 0: the scene as it is asked.
    above : Bound, optional
        Levels that turned out to be not good enough.

    Returns
    -------
    Decision
        Where no levels are within the tolerance, on the cheapest whose error is below the
        uncertainty of their reference; as asked where nothing is known, or where the way to the
        answer is a part of what is asked.
    """
    if not tolerance:
        return as_asked(scene)
    # the levels approximate DEM in a held, solved flow
    rules, model, bed = scene.protocol, scene.flow.model, scene.bed
    if rules.method != "dem":
        return as_asked(scene, f"the study asks for the method {rules.method}")
    if model not in ("solve", _best_model(scene)):
        return as_asked(scene, f"the study asks for the flow model {model}")
    if rules.update:
        why = "the study asks for a bed that changes, for which no error is known"
        return as_asked(scene, why)
    if rules.waiting_time < LEAST_HELD:
        return as_asked(scene, "the study asks for a ramp of the flow")
    if not isinstance(bed, PileBed):
        if bed.slope_deg > bed.entrainment_angle_deg:
            return as_asked(scene, "a slope beyond the entrainment angle: the closed form is off")
        exact = changed(scene, {"protocol.method": "pivot"})
        why = "the closed form is exact for a single grain in a held flow"
        return Decision(scene, exact, None, UNKNOWN, why)
    if name := calibration.unmeasured(scene):
        return as_asked(scene, f"no error is known for {name}: as the study asks")
    offered = (tuple(level for level in part if level.takes(scene)) for part in (FLOW, GRAINS))
    pair, why = _cheapest(*offered, *calibration.scene_classes(scene), above, tolerance)
    why = f"{why}; {above.because}" if above.because else why
    return on_levels(scene, pair, why) if pair else as_asked(scene, why)


def by_default(scene: Scene, above: Bound = NO_BOUND) -> Decision:
    """The decision on a scene of a study that says nothing about how to answer.

    A pile whose file sets no field about the answer is answered on the cheapest levels whose known
    error is below the model's own spread. The flow is solved: a theory of it needs a tolerance. The
    spread is the lowest of all classes of scenes, so that all scenes in one figure are answered
    alike. Single grains, poured beds, classes without a measured spread, and all that sets a field
    about the answer are answered as asked.
    """
    names = (q.name.partition(".") for q in fields.FIELDS if q.info.about == "answer")
    is_set = any(name in getattr(scene, part).model_fields_set for part, _, name in names)
    if is_set or scene.is_poured or not isinstance(scene.bed, PileBed):
        return as_asked(scene)
    if math.isnan(calibration.floor(calibration.model_class(scene))):
        return as_asked(scene)
    floor = calibration.lowest_floor()
    chosen = decide(scene, floor, above._replace(flow=above.flow or THEORY))
    if chosen.is_as_asked or not chosen.levels:
        return chosen
    which = "cheapest" if chosen.known.total <= floor else NONE_WITHIN
    why = f"chosen by default: {which} within the model's own spread of {floor:.0%}"
    because = f"; {above.because}" if above.because else ""
    return replace(chosen, why=why + because, by_default=True)


def as_asked(scene: Scene, why: str = "as the study asks") -> Decision:
    """The decision to answer a scene as it is."""
    if not isinstance(scene.bed, PileBed):
        return Decision(scene, scene, None, UNKNOWN, why)
    pair, name = pair_of(scene), calibration.unmeasured(scene)
    if name and name not in why:
        why = f"{why}; no error is known for {name}"
    return Decision(scene, scene, pair, calibration.known(pair, scene), why)


def on_levels(scene: Scene, pair: Pair, why: str) -> Decision:
    """The decision to answer a pile on a pair of levels."""
    return Decision(scene, pair.answer(scene), pair, calibration.known(pair, scene), why)


def _best_model(scene: Scene) -> str:
    """The flow model of the best levels: over a level bed no flow is solved."""
    return "flat" if isinstance(scene.bed, PileBed) and scene.bed.is_level else "solve"


@cache  # a study has thousands of scenes of a few classes
def _cheapest(
    flow: tuple[Level, ...],
    grains: tuple[Level, ...],
    flow_classes: tuple[str, ...],
    grain_classes: tuple[str, ...],
    above: Bound,
    tolerance: float,
) -> tuple[Pair | None, str]:
    """The cheapest pair of some levels, and why; None where nothing is known."""
    offered = []
    for levels, bound in ((flow, above.flow), (grains, above.grains)):
        start = levels.index(bound) + 1 if bound in levels else 0
        offered.append([level for level in levels[start:] if level.same_model])
    if flow_classes == (calibration.LEVEL_BED,):
        offered[0] = [FLAT]
    known = {
        Pair(*pair): calibration.known_of_classes(*pair, flow_classes, grain_classes)
        for pair in itertools.product(*offered)
    }
    pairs = sorted(known, key=lambda pair: known[pair].cost_core_s)
    for pair in pairs:
        if known[pair].total <= tolerance:
            return pair, "cheapest within the tolerance"
    best = min((error.total for error in known.values()), default=math.inf)
    if math.isinf(best):
        return None, "no error is known: as the study asks"
    # errors below the uncertainty of the reference cannot be ranked
    enough = next(pair for pair in pairs if known[pair].error <= best)
    return enough, f"{NONE_WITHIN} within the tolerance"


def _check_group(scene: Scene) -> tuple[float, str, str]:
    """The key that the piles of one check share."""
    assert isinstance(scene.bed, PileBed)
    return scene.bed.slope_deg, scene.bed.packing, scene.forces.law


def checks(answers: Mapping[str, Decision], tolerance: float) -> dict[str, Decision]:
    """The decisions on the piles by DEM that check answers without it.

    Both are by the id of the scene asked for; the tolerance is the relative error of tau_c.
    """
    groups: dict[object, list[tuple[float, str, Decision]]] = {}
    for asked, answer in answers.items():
        if answer.is_unchecked:
            scene = answer.scene
            dem = changed(scene, {"protocol.method": "dem", "flow.model": _best_model(scene)})
            check = decide(dem, tolerance, CHECK)
            member = (Pile(check.scene).case.cost_s, asked, check)
            groups.setdefault(_check_group(scene), []).append(member)
    cheapest = (min(members, key=lambda member: member[:2]) for members in groups.values())
    return {asked: check for _, asked, check in cheapest}


class Comparison(NamedTuple):
    """An answer without DEM and that of DEM, at one fraction of one pile."""

    cheap: PileThreshold
    dem: PileThreshold
    agree: bool


def compare(cheap: Pile, check: Pile, tolerance: float, cases: Path) -> Iterator[Comparison]:
    """Compare a pile's two answers at each fraction, from the finished cases.

    They agree where the answer without DEM lies in the interval of DEM, widened by the tolerance,
    or where neither reaches the fraction.
    """
    answers = (pile.thresholds(cases, cheap.scene.protocol.fractions) for pile in (cheap, check))
    for answer, dem in zip(*answers, strict=True):
        within = dem.tau_low * (1 - tolerance) <= answer.tau <= dem.tau_high * (1 + tolerance)
        neither = math.isnan(answer.tau) and math.isnan(dem.tau)
        yield Comparison(answer, dem, within or neither)


def ready(
    piles: Mapping[str, Pile], checking: Mapping[str, Pile], done: Container[str]
) -> dict[str, Pile]:
    """The checks whose runs are done, and those of the answers that they check."""
    both = {asked: (piles[asked], check) for asked, check in checking.items()}
    return {key: pair[1] for key, pair in both.items() if all(pile.is_run(done) for pile in pair)}


def overruled(
    answers: Mapping[str, Decision],
    piles: Mapping[str, Pile],
    checking: Mapping[str, Pile],
    tolerance: float,
    cases: Path,
    done: Container[str],
) -> dict[str, Bound]:
    """For each pile of a group whose check disagrees, the levels that are not good enough."""
    lost = {
        _check_group(check.scene)
        for asked, check in ready(piles, checking, done).items()
        if not all(row.agree for row in compare(piles[asked], check, tolerance, cases))
    }
    return {
        asked: Bound(*answer.levels, f"DEM overruled {answer.levels.text}")
        for asked, answer in answers.items()
        if answer.levels and answer.is_unchecked and _check_group(answer.scene) in lost
    }
