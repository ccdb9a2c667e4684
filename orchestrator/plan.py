"""From scenes to cases: which runs a study needs, shared where scenes agree."""

from collections.abc import Iterable, Mapping
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
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import Study

START_S, SCENE_S, GRAIN_S = 2.0, 4e-3, 4e-5
"""Times of tables and figures on each scene, and on each grain of a bed without a run, s: read
off `first-look`, `ripples` and `paper --tolerance 0.2` on two cores."""


@dataclass(frozen=True)
class Plan:
    """How the scenes of a study are answered, and by which cases.

    Attributes
    ----------
    decisions : dict of str to Decision
        By the id of the scene that was asked for: how it is answered, and why.
    piles : dict of str to Pile
        By the same id.
    cells : tuple of CellsCase
        Each answers all of its scenes.
    checks : dict of str to Pile
        Piles by DEM that check answers without it, by the id of the scene asked for.
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
        """Expected time from the last run to the page, s.

        The tables and the figures of a scene, and the grains that move without a run.
        """
        piles = (pile for pile in self.piles.values() if not pile.method.cases)
        lengths = (float(pile.line.arc_lengths[-2] - pile.line.arc_lengths[1]) for pile in piles)
        return START_S + SCENE_S * len(self.decisions) + GRAIN_S * sum(lengths)

    def runs(self, asked: str) -> tuple[Case, ...]:
        """The cases that the answer to a pile is read from; none for a single grain."""
        return self.piles[asked].runs if asked in self.piles else ()

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
    bounds = above or {}
    decisions = {
        scene.id: _decide(scene, study.tolerance, bounds.get(scene.id, NO_BOUND))
        for scene in study.scenes
    }
    return of(decisions, study.name, study.tolerance, cases)


def _decide(scene: Scene, tolerance: float | None, above: Bound) -> Decision:
    return by_default(scene, above) if tolerance is None else decide(scene, tolerance, above)


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
    piles, check_piles = _piles(decisions, cases), _piles(checked, cases)
    grains = (one.scene for one in decisions.values() if not isinstance(one.scene.bed, PileBed))
    cells = tuple(batches({s.id: s for s in grains if s.protocol.method == "dem"}.values()))
    try:
        ordered = [run for pile in (*piles.values(), *check_piles.values()) for run in pile.runs]
    except InputError as error:
        place = f"{name}: {error.where}"
        raise InputError(error.what, where=place, remedy=error.remedy) from None
    return Plan(dict(decisions), piles, cells, check_piles, _in_order([*ordered, *cells]))


def _piles(decisions: Mapping[str, Decision], cases: Path | None) -> dict[str, Pile]:
    return {
        asked: Pile(one.scene, cases)
        for asked, one in decisions.items()
        if isinstance(one.scene.bed, PileBed)
    }


def settled(study: Study, directory: Path) -> Plan:
    """The plan after what the runs say: dearer levels where one failed or DEM overrules it."""
    above: dict[str, Bound] = {}
    while True:
        planned = make(study, above, directory)
        more = _failed(planned, directory)
        if study.tolerance:
            more |= _overruled(planned, study.tolerance, directory)
        if not more:
            return planned
        above |= more


def _failed(planned: Plan, directory: Path) -> dict[str, Bound]:
    """The piles that are not answered as they were asked and whose runs failed."""
    return {
        asked: Bound(*answer.levels, f"a run on {answer.levels.text} failed")
        for asked, answer in planned.decisions.items()
        if answer.levels
        and not answer.is_as_asked
        and any(failure(directory / run.name) for run in planned.runs(asked))
    }


def _overruled(planned: Plan, tolerance: float, directory: Path) -> dict[str, Bound]:
    done = planned.done(directory)
    found = (planned.decisions, planned.piles, planned.checks)
    return decision.overruled(*found, tolerance, directory, done)


def _in_order(cases: Iterable[Case]) -> dict[str, Case]:
    """Every case once, those that others need first."""
    listed = {case.name: case for case in cases}
    first = {name: case for name, case in listed.items() if not case.needs}
    return {**first, **listed}
