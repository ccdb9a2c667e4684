"""From scenes to cases: which runs a study needs, shared where scenes agree."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.case import Case, done_state
from orchestrator.errors import InputError
from orchestrator.grains.cells import CellsCase, batches
from orchestrator.grains.pile import PileCase
from orchestrator.scene import PileBed
from orchestrator.study import Study


@dataclass(frozen=True)
class Plan:
    """The cases of a study.

    Attributes
    ----------
    piles : dict of str to PileCase
        By the id of the scene that each answers.
    cells : tuple of CellsCase
        Each answers all of its scenes.
    cases : dict of str to Case
        Every case once, by name, a case after those whose results it needs.
    """

    piles: dict[str, PileCase]
    cells: tuple[CellsCase, ...]
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


def make(study: Study) -> Plan:
    """The cases that a study needs.

    Raises
    ------
    InputError
        If a scene asks for a flow that cannot be solved; with the study and the field.
    """
    piles = {s.id: PileCase(s) for s in study.scenes if isinstance(s.bed, PileBed)}
    cells = tuple(batches(s for s in study.scenes if not isinstance(s.bed, PileBed)))
    try:
        ordered: list[Case] = [need for pile in piles.values() for need in pile.needs]
    except InputError as error:
        place = f"{study.name}: {error.where}"
        raise InputError(error.what, where=place, remedy=error.remedy) from None
    return Plan(piles, cells, {case.name: case for case in (*ordered, *cells, *piles.values())})
