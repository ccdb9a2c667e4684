"""The maps of failure: every place is a run, and each run ends in one of five verdicts.

A run that fails says so itself: its verdict is what it noticed. One that ends is compared with the
reference of its place: beyond `WRONG` its answer is wrong, and nothing said so.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator.experiments.stability.maps import Map, Run
from orchestrator.grains import threshold
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.plan import Plan
from orchestrator.runs import case as case_states
from orchestrator.study.scene import Scene

Row = dict[str, Any]

WRONG = 0.05
"""Relative error of tau_c from which an answer counts as wrong."""
VERDICTS = ("exploded", "noisy", "stalled")
"""How a run says that it failed."""


@dataclass(frozen=True)
class Answers:
    """Verdicts from the finished and the failed cases of a plan."""

    planned: Plan
    cases: Path
    done: Mapping[str, Mapping[str, Any]]

    def failure(self, scene: Scene) -> tuple[str, str] | None:
        """How a run that the scene needs failed, and why; None where all of them are done."""
        runs = self._runs(scene)
        lost = next((run for run in runs if run not in self.done), None)
        if lost is None:
            return None
        verdict, why = case_states.ended(self.cases / lost)
        why = why.replace(f"{self.cases}/", "") or "it did not run"
        return verdict if verdict in VERDICTS else "stalled", why

    def _runs(self, scene: Scene) -> list[str]:
        if scene.id in self.planned.piles:
            return [run.name for run in self.planned.piles[scene.id].runs]
        return [one.name for one in self.planned.cells if scene in one.scenes]

    def pile(self, scene: Scene) -> dict[float, PileThreshold]:
        """The thresholds of a pile, by fraction."""
        pile: Pile = self.planned.piles[scene.id]
        found = pile.thresholds(self.cases, scene.protocol.fractions)
        return {one.fraction: one for one in found}

    def grain(self, scene: Scene) -> float:
        """Threshold stress of one grain over that of the closed form."""
        one = next(cells for cells in self.planned.cells if scene in cells.scenes)
        found = threshold.of_grains(Motion.from_csv(self.cases / one.name))
        return float(found.value[one.scenes.index(scene)]) ** 2


@dataclass(frozen=True)
class Judged:
    """A map and what its runs came to.

    Attributes
    ----------
    map : Map
        The map.
    table : DataFrame
        A row for each place: map, x and y, numbers or texts; verdict, "good", "wrong" or one of
        `VERDICTS`; caught, whether the run itself noticed; error, relative and signed, or NaN;
        note, the cause.
    """

    map: Map
    table: pd.DataFrame


def judge(one: Map, answers: Answers) -> Judged:
    """Judge every run of a map."""
    return Judged(one, pd.DataFrame(row for run in one.runs for row in _rows(one, run, answers)))


def _rows(one: Map, run: Run, answers: Answers) -> Iterator[Row]:
    places = [place.label for place in one.x.places] if one.x.is_fraction else [run.x.label]
    lost = next((found for scene in run.scenes if (found := answers.failure(scene))), None)
    if lost:
        verdict, why = lost
        for x in places:
            yield _row(one, x, run, verdict=verdict, caught=True, error=math.nan, note=why)
        return
    for x in places:
        error = _error(one, run, answers, float(x) if one.x.is_fraction else None)
        verdict = "good" if abs(error) <= WRONG else "wrong"
        note = "its reference failed" if math.isnan(error) else ""
        yield _row(one, x, run, verdict=verdict, caught=False, error=error, note=note)


def _row(one: Map, x: float | str, run: Run, **found: Any) -> Row:
    return {"map": one.name, "x": x, "y": run.y.label, **found}


def _error(one: Map, run: Run, answers: Answers, fraction: float | None) -> float:
    """The signed relative error of tau_c that is largest; infinite where one was not reached."""
    if one.judge == "grain":
        found = [answers.grain(scene) - 1 for scene in run.scenes]
    else:
        pairs = zip(run.scenes, run.references, strict=True)
        found = [e for pair in pairs for e in _pile_errors(*pair, answers, fraction)]
    return max(found, key=abs, default=math.nan)


def _pile_errors(
    scene: Scene, reference: Scene, answers: Answers, fraction: float | None
) -> Iterator[float]:
    if answers.failure(reference):
        yield math.nan
        return
    own, other = answers.pile(scene), answers.pile(reference)
    for at in own if fraction is None else (fraction,):
        if math.isnan(own[at].tau) and math.isnan(other[at].tau):
            continue
        error = own[at].tau / other[at].tau - 1
        yield error if not math.isnan(error) else math.inf
