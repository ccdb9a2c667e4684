"""Run the maps in a directory of their own, to their table and their page."""

from pathlib import Path

import pandas as pd

from orchestrator import pipeline, plan
from orchestrator.experiments import tables
from orchestrator.experiments.stability import maps, verdicts
from orchestrator.fidelity.decision import as_asked
from orchestrator.pipeline import Finished
from orchestrator.plan import Plan
from orchestrator.report import settings
from orchestrator.runs import case
from orchestrator.runs.case import programs
from orchestrator.runs.claim import EXPERIMENT
from orchestrator.runs.workspace import MARKERS, Workspace
from orchestrator.study.study import TIME_LIMIT_S


def run(out: Path, *, workers: int) -> Finished:
    """Run every map and say where each method fails.

    Raises
    ------
    InputError
        If the directory cannot be used.
    SolverError
        If a solver is missing.
    """
    drawn = maps.load_all()
    planned = planned_for(drawn)
    space = Workspace(out.absolute())
    with space.held(EXPERIMENT, "stability") as folder:
        space.describe(EXPERIMENT, "stability", list(planned.cases))
        missing = pipeline.missing(planned, space)
        todo = {name: one for name, one in missing.items() if not _is_verdict(space.cases / name)}
        pipeline.complete(todo, space, workers=workers, limit_s=TIME_LIMIT_S)
        answers = verdicts.Answers(planned, space.cases, planned.done(space.cases))
        judged = [verdicts.judge(one, answers) for one in drawn]
        found = pd.concat([one.table for one in judged], ignore_index=True)
        with settings.own(), folder.renewed(but=MARKERS):
            from orchestrator.experiments.stability import page

            tables.write({"maps": found}, folder)
            page.write(judged, space, programs(space.cases, planned.cases))
    return Finished(space.page, len(todo), {})


def planned_for(drawn: list[maps.Map]) -> Plan:
    """The runs of some maps, those that they share once."""
    scenes = (
        scene
        for one in drawn
        for run in one.runs
        for scene in (*run.scenes, *(run.references if one.judge == "pile" else ()))
    )
    return plan.of({scene.id: as_asked(scene) for scene in scenes}, "stability")


def _is_verdict(directory: Path) -> bool:
    """Whether the case failed in a way that is an answer: it would do so again."""
    return case.ended(directory)[0] in verdicts.VERDICTS
