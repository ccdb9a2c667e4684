"""Piles by DEM that check the cheap answers of a study with a tolerance.

Of the piles of each slope, packing and closure that were answered without DEM, the one that DEM
answers fastest is answered by it as well, on a flow that is not a cheap one either. Where the two
differ by more than the tolerance, all of them go to dearer rungs.
"""

import math
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from orchestrator.fidelity import rungs
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold, of_pile
from orchestrator.study.scene import PileBed, Scene

Above = Mapping[rungs.Part, str]
CHEAP: Above = {"flow": "coarse", "grains": "peeling"}
"""The dearest rungs that need a check; it is made on dearer ones."""


def group(scene: Scene) -> str:
    """What the piles of one check have in common."""
    assert isinstance(scene.bed, PileBed)
    return f"{scene.bed.slope_deg:g} deg, {scene.bed.packing}, {scene.flow.closure}"


def plan(piles: Mapping[str, Pile], tolerance: float) -> dict[str, Pile]:
    """The checks of piles that are answered without DEM; by the id of the scene asked for."""
    groups: dict[str, list[tuple[float, str, Pile]]] = {}
    for asked, pile in piles.items():
        if pile.scene.protocol.method != "dem":
            by_dem = Pile(_by_dem(pile.scene, tolerance))
            groups.setdefault(group(pile.scene), []).append((by_dem.case.cost_s, asked, by_dem))
    cheapest = (min(members, key=lambda one: one[:2]) for members in groups.values())
    return {asked: pile for _, asked, pile in cheapest}


def _by_dem(scene: Scene, tolerance: float) -> Scene:
    asked = rungs.changed(scene, {"protocol.method": "dem", "flow.model": "solve"})
    return rungs.choose(asked, tolerance, above=CHEAP)


@dataclass(frozen=True)
class Comparison:
    """A cheap answer and DEM's, at one fraction of one pile."""

    cheap: PileThreshold
    dem: PileThreshold
    agree: bool


def compare(cheap: Pile, check: Pile, tolerance: float, cases: Path) -> Iterator[Comparison]:
    """Compare a pile's two answers at each fraction, from the finished cases.

    They agree where the cheap one lies in the interval of DEM, widened by the tolerance, or where
    neither reaches the fraction.
    """
    density = cheap.scene.fluid.density
    answers = [(pile.motion(cases), pile.face(cases).speed) for pile in (cheap, check)]
    for fraction in cheap.scene.protocol.fractions:
        own, dem = (of_pile(motion, speed, fraction, density) for motion, speed in answers)
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
        if all(run.name in done for run in (*check.runs, *piles[asked].runs))
    }


def overruled(
    piles: Mapping[str, Pile],
    checks: Mapping[str, Pile],
    tolerance: float,
    cases: Path,
    done: Container[str],
) -> dict[str, Above]:
    """For each pile of a group whose check disagrees, the rungs that are not good enough."""
    lost = {
        group(piles[asked].scene)
        for asked, check in ready(piles, checks, done).items()
        if not all(one.agree for one in compare(piles[asked], check, tolerance, cases))
    }
    return {
        asked: rungs.names(pile.scene)
        for asked, pile in piles.items()
        if pile.scene.protocol.method != "dem" and group(pile.scene) in lost
    }
