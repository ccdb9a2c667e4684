"""Piles by DEM that check the answers without DEM of a study with a tolerance.

Of the piles of each slope, packing and force law that the tool chose to answer without DEM, the one
that DEM answers fastest is answered by it as well, on a flow that is not a cheap one either. Where
the two differ by more than the tolerance, all of them go to dearer levels.
"""

import math
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from orchestrator.fidelity.decision import Bound, Decision, decide
from orchestrator.fidelity.levels import changed, solved_model
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene

CHEAP = Bound({"flow": "coarse", "grains": "peeling"}, "it checks answers without DEM")
"""The dearest levels that need a check; it is made on dearer ones."""


def group(scene: Scene) -> str:
    """The key that the piles of one check share."""
    assert isinstance(scene.bed, PileBed)
    return f"{scene.bed.slope_deg:g} deg, {scene.bed.packing}, {scene.forces.law}"


def decisions(answers: Mapping[str, Decision], tolerance: float) -> dict[str, Decision]:
    """Decide on the checks of the piles that the tool chose to answer without DEM.

    Parameters
    ----------
    answers : mapping of str to Decision
        By the id of the scene asked for.
    tolerance : float
        Relative error of tau_c.

    Returns
    -------
    dict of str to Decision
        By the id of the scene asked for whose answer it checks.
    """
    groups: dict[str, list[tuple[float, str, Decision]]] = {}
    for asked, answer in answers.items():
        if _needs_check(answer):
            check = _by_dem(answer.scene, tolerance)
            member = (Pile(check.scene).case.cost_s, asked, check)
            groups.setdefault(group(answer.scene), []).append(member)
    cheapest = (min(members, key=lambda one: one[:2]) for members in groups.values())
    return {asked: check for _, asked, check in cheapest}


def _needs_check(answer: Decision) -> bool:
    is_pile = isinstance(answer.scene.bed, PileBed)
    return is_pile and not answer.is_as_asked and answer.scene.protocol.method != "dem"


def _by_dem(scene: Scene, tolerance: float) -> Decision:
    asked = changed(scene, {"protocol.method": "dem", "flow.model": solved_model(scene)})
    return decide(asked, tolerance, CHEAP)


@dataclass(frozen=True)
class Comparison:
    """An answer without DEM and DEM's, at one fraction of one pile."""

    cheap: PileThreshold
    dem: PileThreshold
    agree: bool


def compare(cheap: Pile, check: Pile, tolerance: float, cases: Path) -> Iterator[Comparison]:
    """Compare a pile's two answers at each fraction, from the finished cases.

    They agree where the one without DEM lies in the interval of DEM, widened by the tolerance, or
    where neither reaches the fraction.
    """
    fractions = cheap.scene.protocol.fractions
    answers = (pile.thresholds(cases, fractions) for pile in (cheap, check))
    for own, dem in zip(*answers, strict=True):
        within = dem.tau_low * (1 - tolerance) <= own.tau <= dem.tau_high * (1 + tolerance)
        neither = math.isnan(own.tau) and math.isnan(dem.tau)
        yield Comparison(own, dem, within or neither)


def ready(
    piles: Mapping[str, Pile], checks: Mapping[str, Pile], done: Container[str]
) -> dict[str, Pile]:
    """The checks whose runs are done, and those of the answers that they check."""
    return {
        asked: check
        for asked, check in checks.items()
        if check.is_run(done) and piles[asked].is_run(done)
    }


def overruled(
    answers: Mapping[str, Decision],
    piles: Mapping[str, Pile],
    checks: Mapping[str, Pile],
    tolerance: float,
    cases: Path,
    done: Container[str],
) -> dict[str, Bound]:
    """For each pile of a group whose check disagrees, the levels that are not good enough."""
    lost = {
        group(piles[asked].scene)
        for asked, check in ready(piles, checks, done).items()
        if not all(one.agree for one in compare(piles[asked], check, tolerance, cases))
    }
    return {
        asked: Bound(answer.levels, f"DEM overruled {answer.levels_text}")
        for asked, answer in answers.items()
        if _needs_check(answer) and group(answer.scene) in lost
    }
