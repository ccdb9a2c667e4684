"""Run the budget in a directory of its own, to its tables and its page."""

from collections.abc import Container, Mapping
from pathlib import Path

import pandas as pd

from orchestrator import pipeline, plan
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.experiments import tables
from orchestrator.experiments.budget import shares
from orchestrator.experiments.budget.choices import label
from orchestrator.fidelity import limits
from orchestrator.pipeline import Finished
from orchestrator.plan import Plan
from orchestrator.report import settings
from orchestrator.runs.case import programs
from orchestrator.runs.claim import EXPERIMENT
from orchestrator.runs.workspace import MARKERS, Workspace
from orchestrator.study.study import Study


def run(study: Study, out: Path, *, workers: int) -> Finished:
    """Change each shared choice alone, on the piles of a study, and draw what that moves.

    Raises
    ------
    InputError
        If the study has no pile or one is beyond a limit of the methods, or the directory cannot
        be used.
    SolverError
        If a solver is missing.
    OrchestratorError
        If no run came to its end.
    """
    limits.check_study(study)
    asked = shares.decisions(study)
    if not asked:
        raise InputError(
            "there is no pile in this study",
            where=study.name,
            remedy='give a group `bed.kind = "pile"`',
        )
    space = Workspace(out.absolute())
    planned = plan.of(asked, study.name, cases=space.cases)
    with space.held(EXPERIMENT, "budget") as folder:
        space.describe(EXPERIMENT, "budget", list(planned.cases))
        todo = pipeline.missing(planned, space)
        failures = pipeline.complete(todo, space, workers=workers, limit_s=study.time_limit_s)
        done = planned.done(space.cases)
        ready = {key: pile for key, pile in planned.piles.items() if pile.is_run(done)}
        moved = shares.changes(study, ready, space.cases)
        if moved.empty:
            raise OrchestratorError(
                "no run came to its end: no share is known",
                where=str(out),
                remedy="`orchestrator status` names the causes; the same command continues",
            )
        shared = shares.shares(moved)
        made = {"changes": moved, "shares": shared, "budget": shares.known(shared)}
        lost = _lost(planned, ready, failures)
        with settings.own(), folder.renewed(but=MARKERS):
            from orchestrator.experiments.budget import page

            tables.write(made, folder)
            worn = list(shares.worn(study, ready))
            page.write(made, lost, worn, space, programs(space.cases, planned.cases))
    return Finished(space.page, len(todo), _of_the_scenes(planned, failures))


def _lost(
    planned: Plan, ready: Container[str], failures: Mapping[str, OrchestratorError]
) -> pd.DataFrame:
    """The alternatives that have no answer, and why: a flow model may refuse a bed."""
    rows = [
        {
            "scene": label(decision.asked),
            "alternative": shares.name_of(key),
            "why": "; ".join(failures[run.name].what for run in runs if run.name in failures),
        }
        for key, decision in planned.decisions.items()
        for runs in (planned.piles[key].runs,)
        if key not in ready
    ]
    return pd.DataFrame(rows).drop_duplicates() if rows else pd.DataFrame()


def _of_the_scenes(
    planned: Plan, failures: dict[str, OrchestratorError]
) -> dict[str, OrchestratorError]:
    """The failures that leave a scene without any share."""
    needed = {
        run.name
        for key, pile in planned.piles.items()
        if shares.name_of(key) == shares.BASE
        for run in pile.runs
    }
    return {name: error for name, error in failures.items() if name in needed}
