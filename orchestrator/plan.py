"""From scenes to cases: which runs a study needs, shared where scenes agree."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError
from orchestrator.fidelity import decision, limits
from orchestrator.fidelity.decision import NO_BOUND, Bound, Decision, by_default, decide
from orchestrator.grains.cells import SingleGrainCase, batches
from orchestrator.grains.pile import Pile
from orchestrator.runs.case import Case, done_state, failure
from orchestrator.runs.progress import human
from orchestrator.study.closed_form import law_holds, regime_of
from orchestrator.study.parts import PileBed
from orchestrator.study.study import Study

START_S, SCENE_S, GRAIN_S = 2.0, 4e-3, 4e-5
"""Times of tables and figures on each scene, and on each grain of a bed without a run, s: measured
on `first-look`, `ripples` and `paper --tolerance 0.2`, two cores."""
BYTES = {"flow": 2.9e6, "pile": 1.8e6, "cells": 1.5e6}
"""Mean size of a case of the preset `paper`, by its kind; of any other, `OTHER_BYTES`."""
OTHER_BYTES = 2e6


@dataclass(frozen=True)
class Plan:
    """How the scenes of a study are answered, and by which cases.

    Attributes
    ----------
    decisions, piles, checks : dict
        By the id of the scene that was asked for: how it is answered, and why; its pile; a pile by
        DEM that checks an answer without DEM.
    cells : tuple of SingleGrainCase
        Each answers all of its scenes.
    cases : dict of str to Case
        Every run once, by name, a case after those whose results it needs.
    """

    decisions: dict[str, Decision]
    piles: dict[str, Pile]
    cells: tuple[SingleGrainCase, ...]
    checks: dict[str, Pile]
    cases: dict[str, Case]

    @property
    def drawing_s(self) -> float:
        """Expected time of tables, figures and the grains that move without a run, s."""
        lines = (pile.line.arc_lengths for pile in self.piles.values() if not pile.method.cases)
        lengths = sum(float(s[-2] - s[1]) for s in lines)
        return START_S + SCENE_S * len(self.decisions) + GRAIN_S * lengths

    def done(
        self, directory: Path, names: Iterable[str] | None = None
    ) -> dict[str, dict[str, Any]]:
        """The markers of the cases that are done, by name; their results are checked.

        Only some of the cases are looked at if their names are given.
        """
        cases = [self.cases[name] for name in (self.cases if names is None else names)]
        with ThreadPoolExecutor() as pool:  # gigabytes of results are read
            states = list(pool.map(lambda case: done_state(case, directory), cases))
        return {case.name: state for case, state in zip(cases, states, strict=True) if state}


def make(study: Study, above: Mapping[str, Bound] | None = None, cases: Path | None = None) -> Plan:
    """Decide how each scene of a study is answered, and list the cases that it needs.

    Parameters
    ----------
    study : Study
        With a tolerance, each scene is answered on the cheapest levels that are known to meet it;
        with one of 0, as it is asked; without one, `by_default`.
    above : mapping, optional
        By scene id: levels that turned out to be not good enough.
    cases : Path, optional
        Where the runs are, or will be; the grains of a poured bed are read from there.

    Raises
    ------
    InputError
        If a scene is beyond a limit of the methods, or asks for a flow that cannot be solved; with
        the field.
    """
    limits.check_study(study)
    bounds = {scene.id: (above or {}).get(scene.id, NO_BOUND) for scene in study.scenes}
    decisions = {
        scene.id: by_default(scene, bounds[scene.id])
        if study.tolerance is None
        else decide(scene, study.tolerance, bounds[scene.id])
        for scene in study.scenes
    }
    return of(decisions, study.name, study.tolerance, cases)


def of(
    decisions: Mapping[str, Decision],
    name: str,
    tolerance: float | None = None,
    cases: Path | None = None,
) -> Plan:
    """List the cases that some decisions need; `name` names the study in messages.

    With a tolerance, answers without DEM are checked by it.
    """
    checked = decision.checks(decisions, tolerance) if tolerance else {}
    piles, checks = (
        {
            asked: Pile(answer.scene, cases)
            for asked, answer in answers.items()
            if isinstance(answer.scene.bed, PileBed)
        }
        for answers in (decisions, checked)
    )
    grains = {
        answer.scene.id: answer.scene
        for asked, answer in decisions.items()
        if asked not in piles and answer.scene.protocol.method == "dem"
    }
    cells = tuple(batches(grains.values()))
    try:
        runs = [run for pile in (*piles.values(), *checks.values()) for run in pile.runs]
    except InputError as error:
        place = f"{name}: {error.where}"
        raise InputError(error.what, where=place, remedy=error.remedy) from None
    listed = {case.name: case for case in (*runs, *cells)}
    first = {name: case for name, case in listed.items() if not case.needs}
    return Plan(dict(decisions), piles, cells, checks, {**first, **listed})


def settled(study: Study, directory: Path) -> Plan:
    """The plan after the runs that are done: dearer levels where one failed or DEM overrules it."""
    above: dict[str, Bound] = {}
    while True:
        plan = make(study, above, directory)
        more = {
            asked: Bound(*answer.levels, f"a run on {answer.levels.text} failed")
            for asked, answer in plan.decisions.items()
            if answer.levels and not answer.is_as_asked and asked in plan.piles
            if any(failure(directory / run.name) for run in plan.piles[asked].runs)
        }
        if study.tolerance:
            answers = plan.decisions, plan.piles, plan.checks
            done = plan.done(directory)
            more |= decision.overruled(*answers, study.tolerance, directory, done)
        if not more:
            return plan
        above |= more


def forecast(study: Study, plan: Plan, missing: Sequence[Case], workers: int) -> Iterator[str]:
    """Lines of text: scenes with their regimes, cases by kind, expected time and disk."""
    yield f"{study.title}: {_number(len(study.scenes), 'scene')}"
    for group in study.groups:
        regimes = Counter(str(regime_of(scene)) for scene in group.scenes)
        laws = Counter(scene.forces.law for scene in group.scenes)
        outside = sum(not law_holds(scene) for scene in group.scenes)
        yield (
            f"  {group.name}: {_number(len(group.scenes), 'scene')}; regimes: {_counted(regimes)}; "
            f"force laws: {_counted(laws)}"
            + (f"; in {outside} the law does not hold for a single grain" if outside else "")
        )
    for why, count in Counter(answer.why for answer in plan.decisions.values()).most_common():
        yield f"  {count} answered: {why}"
    todo = Counter(case.kind for case in missing)
    yield f"{_number(len(plan.cases), 'case')}, {len(missing)} to run"
    for kind, count in Counter(case.kind for case in plan.cases.values()).items():
        yield f"  {kind}: {count}, {todo[kind]} to run"
    # a chain of cases takes at least the sum of its times, however many run beside it
    walls = {case.name: case.cost_s / min(case.ranks, workers) for case in missing}
    chains = (sum(walls.get(run.name, 0.0) for run in (case, *case.needs)) for case in missing)
    runs = max(sum(case.cost_s for case in missing) / workers, max(chains, default=0.0))
    size = sum(BYTES.get(case.kind, OTHER_BYTES) for case in missing)
    yield (
        f"expected: about {human(runs + plan.drawing_s)} with {_number(workers, 'worker')}, "
        f"{human(plan.drawing_s)} of them for tables and figures; {size / 1e6:.0f} MB"
    )


def _number(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _counted(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.most_common())
