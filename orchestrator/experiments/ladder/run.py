"""Run the ladder in a directory of its own, to its tables and its page."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from orchestrator import pipeline, plan
from orchestrator.errors import OrchestratorError
from orchestrator.experiments import tables
from orchestrator.experiments.ladder import naive, pairs, ranking
from orchestrator.fidelity import limits
from orchestrator.fidelity.decision import Decision
from orchestrator.pipeline import Finished
from orchestrator.plan import Plan
from orchestrator.report import settings
from orchestrator.runs.case import programs
from orchestrator.runs.claim import EXPERIMENT
from orchestrator.runs.workspace import MARKERS, Workspace
from orchestrator.study.study import Study

Decisions = Mapping[str, Decision]


def run(study: Study, out: Path, *, workers: int) -> Finished:
    """Measure what each level costs and how far it is off, on the piles of a study.

    Raises
    ------
    InputError
        If the study has no pile that is answered by DEM or is beyond a limit of the methods, or the
        directory cannot be used.
    SolverError
        If a solver is missing.
    OrchestratorError
        If no reference ran to its end.
    """
    limits.check_study(study)
    routes, asked = naive.decisions(naive.small(study)), pairs.decisions(study)
    space = Workspace(out.absolute())
    planned = plan.of({**asked, **routes}, study.name, cases=space.cases)
    with space.held(EXPERIMENT, "ladder") as folder:
        space.describe(EXPERIMENT, "ladder", list(planned.cases))
        todo = pipeline.missing(planned, space)
        failures = pipeline.complete(todo, space, workers=workers, limit_s=study.time_limit_s)
        made = _tables(asked, routes, planned, space.cases)
        with settings.own(), folder.renewed(but=MARKERS):
            from orchestrator.experiments.ladder import page

            tables.write(made, folder)
            page.write(made, space, programs(space.cases, planned.cases))
    return Finished(space.page, len(todo), failures)


def _tables(
    asked: Decisions, routes: Decisions, planned: Plan, cases: Path
) -> dict[str, pd.DataFrame]:
    cpu_s = {name: state["cpu_s"] for name, state in planned.done(cases).items()}
    piles = planned.piles
    points = pairs.points(asked, piles, cases, cpu_s)
    compared = ranking.errors(points)
    if compared.empty:
        raise OrchestratorError(
            "no reference ran to its end: no error is known",
            where=str(cases.parent),
            remedy="`orchestrator status` names the causes; the same command continues",
        )
    fast = piles[pairs.key_of(asked, naive.FAST)]
    return {
        "points": ranking.with_front(compared),
        "levels": ranking.known(points),
        "naive": naive.costs({name: piles[name] for name in routes}, fast, cases, cpu_s),
    }
