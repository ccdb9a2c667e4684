"""Run an experiment in a directory of its own, to its tables and its page."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from orchestrator import pipeline
from orchestrator.experiments import ladder, maps, naive, ranking, stability
from orchestrator.fidelity import limits
from orchestrator.pipeline import Finished
from orchestrator.plan import of
from orchestrator.report import settings
from orchestrator.runs import case as case_states
from orchestrator.runs.case import Case
from orchestrator.runs.claim import EXPERIMENT
from orchestrator.runs.folder import Folder
from orchestrator.runs.workspace import DRAWN, Workspace
from orchestrator.study.study import TIME_LIMIT_S, Study


def run_ladder(study: Study, out: Path, *, workers: int) -> Finished:
    """Measure what each level costs and how far it is off, on the piles of a study.

    Raises
    ------
    InputError
        If the study has no pile that is answered by DEM or is beyond a limit of the methods, or the
        directory cannot be used.
    SolverError
        If a solver is missing.
    """
    limits.check_study(study)
    beside = naive.answers(naive.small(study))
    planned = of({**ladder.answers(study), **beside}, study.name)
    space = Workspace(out.absolute())
    with space.held(EXPERIMENT, "ladder") as folder:
        space.describe(EXPERIMENT, "ladder", list(planned.cases))
        todo = pipeline.missing(planned, space)
        failures = (
            pipeline.complete(todo, space, workers=workers, limit_s=study.time_limit_s)
            if todo
            else {}
        )
        states = planned.done(space.cases)
        found = ladder.points(study, planned, space.cases, states)
        tables = {
            "points": ranking.with_front(ranking.errors(found)),
            "levels": ranking.known(found),
            "naive": naive.costs(
                {name: planned.piles[name] for name in beside},
                planned.piles[ladder.fast(study)],
                space.cases,
                {name: state["cpu_s"] for name, state in states.items()},
            ),
        }
        with settings.own(), folder.renewed(*DRAWN):
            from orchestrator.experiments import pages

            _write(tables, folder)
            pages.write_ladder(tables, space, case_states.programs(space.cases))
    return Finished(space.page, len(todo), failures)


def run_stability(out: Path, *, workers: int) -> Finished:
    """Run every map and say where each method fails.

    Raises
    ------
    InputError
        If the directory cannot be used.
    SolverError
        If a solver is missing.
    """
    drawn = maps.load_all()
    planned = stability.plan(drawn)
    space = Workspace(out.absolute())
    with space.held(EXPERIMENT, "stability") as folder:
        space.describe(EXPERIMENT, "stability", list(planned.cases))
        todo = {
            name: one
            for name, one in pipeline.missing(planned, space).items()
            if not _is_verdict(one, space)
        }
        if todo:
            pipeline.complete(todo, space, workers=workers, limit_s=TIME_LIMIT_S)
        answers = stability.Answers(planned, space.cases, planned.done(space.cases))
        judged = {one.name: stability.judge(one, answers) for one in drawn}
        table = pd.concat(judged.values(), ignore_index=True)
        with settings.own(), folder.renewed(*DRAWN):
            from orchestrator.experiments import pages

            _write({"maps": table}, folder)
            pages.write_stability(drawn, judged, space, case_states.programs(space.cases))
    return Finished(space.page, len(todo), {})


def _is_verdict(one: Case, space: Workspace) -> bool:
    """Whether the case failed in a way that is an answer: it would do so again."""
    return case_states.ended(space.cases / one.name)[0] in stability.VERDICTS


def _write(tables: Mapping[str, pd.DataFrame], folder: Folder) -> None:
    for name, table in tables.items():
        folder.put(f"tables/{name}.csv", table.to_csv(index=False))
