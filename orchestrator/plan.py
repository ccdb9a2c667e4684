"""From scenes to cases: which runs a study needs, shared where scenes agree."""

from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError
from orchestrator.fidelity import checks, rungs
from orchestrator.grains.cells import CellsCase, batches
from orchestrator.grains.pile import Pile
from orchestrator.runs.case import Case, done_state, failure
from orchestrator.study.scene import PileBed, Scene
from orchestrator.study.study import Study


@dataclass(frozen=True)
class Plan:
    """How the scenes of a study are answered, and by which cases.

    Attributes
    ----------
    answers : dict of str to Scene
        By the id of the scene that was asked for: the scene as it is answered.
    piles : dict of str to Pile
        By the same id.
    cells : tuple of CellsCase
        Each answers all of its scenes.
    checks : dict of str to Pile
        Piles by DEM that check answers without it, by the id of the scene asked for.
    cases : dict of str to Case
        Every run once, by name, a case after those whose results it needs.
    """

    answers: dict[str, Scene]
    piles: dict[str, Pile]
    cells: tuple[CellsCase, ...]
    checks: dict[str, Pile]
    cases: dict[str, Case]

    def done(
        self, directory: Path, names: Iterable[str] | None = None
    ) -> dict[str, dict[str, Any]]:
        """The markers of the cases that are done, by name; their results are checked.

        Only some of the cases are looked at if their names are given.
        """
        asked = [self.cases[name] for name in (self.cases if names is None else names)]
        with ThreadPoolExecutor() as pool:  # gigabytes of results are read
            states = pool.map(lambda one: done_state(one, directory), asked)
        return {one.name: state for one, state in zip(asked, states, strict=True) if state}


def make(study: Study, escalated: Mapping[str, Mapping[rungs.Part, str]] | None = None) -> Plan:
    """The cases that a study needs.

    Parameters
    ----------
    study : Study
        With a tolerance, each scene is answered on the cheapest rungs that are known to meet it.
    escalated : mapping, optional
        By scene id: rungs that turned out to be not good enough.

    Raises
    ------
    InputError
        If a scene asks for a flow that cannot be solved; with the study and the field.
    """
    tolerance, above = study.tolerance, escalated or {}
    if tolerance is None:
        return of({scene.id: scene for scene in study.scenes}, study.name)
    chosen = {
        scene.id: rungs.choose(scene, tolerance, above=above.get(scene.id))
        for scene in study.scenes
    }
    return of(chosen, study.name, tolerance)


def of(answers: Mapping[str, Scene], name: str, tolerance: float | None = None) -> Plan:
    """The cases that answer some scenes; `name` names the study in messages.

    With a tolerance, answers without DEM are checked by it.
    """
    piles = {
        asked: Pile(scene) for asked, scene in answers.items() if isinstance(scene.bed, PileBed)
    }
    grains = (scene for scene in answers.values() if not isinstance(scene.bed, PileBed))
    cells = tuple(batches({s.id: s for s in grains if s.protocol.method == "dem"}.values()))
    checked = checks.plan(piles, tolerance) if tolerance else {}
    try:
        ordered = [run for pile in (*piles.values(), *checked.values()) for run in pile.runs]
    except InputError as error:
        place = f"{name}: {error.where}"
        raise InputError(error.what, where=place, remedy=error.remedy) from None
    return Plan(dict(answers), piles, cells, checked, _in_order([*ordered, *cells]))


def settled(study: Study, directory: Path) -> Plan:
    """The plan after what the runs say: dearer rungs where one failed or DEM overrules it."""
    escalated: dict[str, checks.Above] = {}
    while True:
        planned = make(study, escalated)
        if study.tolerance is None:
            return planned
        done = planned.done(directory)
        more = {
            **_failed(planned, directory),
            **checks.overruled(planned.piles, planned.checks, study.tolerance, directory, done),
        }
        if not more:
            return planned
        escalated |= more


def _failed(planned: Plan, directory: Path) -> dict[str, checks.Above]:
    """The piles that were not asked for as they are and whose runs failed, with their rungs."""
    return {
        asked: rungs.names(pile.scene)
        for asked, pile in planned.piles.items()
        if pile.scene.id != asked and any(failure(directory / run.name) for run in pile.runs)
    }


def _in_order(cases: Iterable[Case]) -> dict[str, Case]:
    """Every case once, those that others need first."""
    listed = {case.name: case for case in cases}
    first = {name: case for name, case in listed.items() if not case.needs}
    return {**first, **listed}
