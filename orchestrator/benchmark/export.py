"""The scenes of a pack, from a study."""

import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from orchestrator import pipeline, plan, tables
from orchestrator.benchmark import exact, measured, ours, pack
from orchestrator.benchmark.problem import Problem
from orchestrator.errors import InputError
from orchestrator.plan import Plan
from orchestrator.runs import case
from orchestrator.runs.workspace import Workspace
from orchestrator.solvers import liggghts
from orchestrator.study import study
from orchestrator.study.study import Study

LEVELS = (1, 2, 3, 4, 5)
FORMULAS = (1, 2)
"""Levels that need no finished study."""
DEFAULT = "first-look"
"""The study whose single grains are exported where none is named."""


def export(root: Path, source: Path | None, levels: Sequence[int]) -> int:
    """Write a pack, and return how many scenes it has.

    Parameters
    ----------
    root : Path
        Where it goes.
    source : Path or None
        Directory of a finished study. Without one the answers are formulas: levels 1 and 2.
    levels : sequence of int
        Which levels; empty for all that can be had.

    Raises
    ------
    InputError
        If a level needs a study, or the study is not finished, not answered as it asks, or asks for
        beds that change or lie in space.
    """
    if source is None:
        return _formulas(root, levels or FORMULAS)
    space = Workspace(source.absolute())
    asked, planned = pipeline.reopen(space)
    if not all(one.is_as_asked for one in planned.decisions.values()):
        raise InputError(
            f"its scenes were answered within a tolerance of {asked.tolerance:g}, not as they ask",
            where=str(source),
            remedy="run the study without a tolerance into another directory",
        )
    if any(scene.protocol.update for scene in asked.scenes):
        raise InputError(
            "a pack holds one flow over each bed, and this bed changes under it",
            where=f"{source}: protocol.update",
            remedy="run the study without it into another directory",
        )
    if any(pile.bed.width for pile in planned.piles.values()):
        raise InputError(
            "a pack holds grains in the plane of the flow, and this bed is a strip in space",
            where=f"{source}: bed.width",
            remedy="run the study without it into another directory",
        )
    finished = Finished(asked, planned, space)
    problems = list(finished.problems(levels or LEVELS))
    return pack.write(
        root, problems, (asked.name, asked.text), case.programs(space.cases, planned.cases)
    )


def _formulas(root: Path, levels: Sequence[int]) -> int:
    lacking = sorted(set(levels) - set(FORMULAS))
    if lacking:
        raise InputError(
            f"level {lacking[0]} needs the answers of a finished study",
            where="--level",
            remedy="name its directory with --from",
        )
    asked = study.load(DEFAULT)
    programs = {"liggghts": liggghts.version()} if 2 in levels and _has_decks() else {}
    return pack.write(
        root, formulas(asked, plan.make(asked), levels, {}), (asked.name, asked.text), programs
    )


def formulas(
    asked: Study, planned: Plan, levels: Sequence[int], found: Mapping[str, float]
) -> Iterator[Problem]:
    """Levels 1 and 2; `found` holds the DEM's thresholds by scene, m/s, as far as there are any."""
    grains = [scene for scene in asked.scenes if scene.id not in planned.piles]
    if 1 in levels:
        yield from (exact.closed_form(scene) for scene in grains)
    if 2 in levels:
        yield from _answered(exact.checks())
        for scene in filter(exact.has_pivot, grains):
            yield exact.pivot(scene, found.get(scene.id, float("nan")))


def _has_decks() -> bool:
    return shutil.which(liggghts.PROGRAM) is not None


def _answered(checks: Iterator[Problem]) -> Iterator[Problem]:
    """The checks of the contact law with what our decks give, where LIGGGHTS is installed."""
    if not _has_decks():
        yield from checks
        return
    with tempfile.TemporaryDirectory() as folder:
        for one in checks:
            given, took = ours.check(one.kind, one.parameters, Path(folder) / one.kind)
            found = given.set_index(["quantity", "at"])["value"]
            keys = pd.MultiIndex.from_frame(one.expected[["quantity", "at"]])
            told = one.expected.assign(ours=found.reindex(keys).to_numpy(float))
            yield replace(one, expected=told, seconds=took.seconds)


class Finished:
    """A study whose cases are done, as scenes of a pack."""

    def __init__(self, asked: Study, planned: Plan, space: Workspace) -> None:
        """Read the study's tables.

        Raises
        ------
        InputError
            If they are not there, or of another version.
        """
        self.asked, self.planned, self.cases = asked, planned, space.cases
        if not space.drawn.is_file():
            raise InputError(
                "the study is not finished", where=str(space.root), remedy="run it to its end"
            )
        self.tables = tables.read(space.folder, "tables")
        told = self.tables["scenes"]
        self._check_cases(set(told["case"]) | set(told["flow_case"].dropna()), space.root)
        times = tables.read(space.folder, "timings")["timings"]
        self.seconds: dict[str, float] = dict(zip(times["case"], times["solver_s"], strict=True))

    def _check_cases(self, told: set[str], root: Path) -> None:
        poured = {run.name for pile in self.planned.piles.values() for run in pile.pouring}
        if told | poured != set(self.planned.cases):
            raise InputError(
                "the study was run by another version of the program: its cases are others",
                where=str(root),
                remedy="run it again",
            )

    def problems(self, levels: Sequence[int]) -> Iterator[Problem]:
        """The scenes at some levels."""
        thresholds: Any = self.tables.get("single_grain")
        found = {} if thresholds is None else thresholds.set_index("scene_id")["ustar_m_s"]
        yield from map(self._timed, formulas(self.asked, self.planned, levels, dict(found)))
        piles = measured.answered(self.planned.piles.values(), self.tables, self.cases)
        # neither a theory's stress nor a channel's is a question at levels 3 and 5
        solved = [one for one in piles if one.pile.model.cases and not one.pile.scene.flow.depth]
        if 3 in levels:
            of_flow = {one.pile.flow.name: one for one in solved}
            for name, one in of_flow.items():
                yield replace(measured.flow(one), seconds=self.seconds[name])
        for one in piles if 4 in levels else ():
            yield replace(measured.pile(one), seconds=self.seconds[one.pile.case.name])
        # how grains lie on other beds is told by level 4 alone, grain by grain
        triangles = [one for one in solved if one.pile.bed.is_triangle]
        for one in triangles if 5 in levels else ():
            both = self.seconds[one.pile.case.name] + self.seconds[one.pile.flow.name]
            yield replace(measured.line(one), seconds=both)

    def _timed(self, problem: Problem) -> Problem:
        """Cells share a run: each has its part of the time."""
        for one in self.planned.cells if problem.kind == "pivot" else ():
            if any(scene.id == problem.name for scene in one.scenes):
                return replace(problem, seconds=self.seconds[one.name] / len(one.scenes))
        return problem
