"""A study from its file to its page: plan, run what is missing, tables, figures."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from orchestrator import paper, plan, report, tables
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.plan import Plan
from orchestrator.report.results import Results
from orchestrator.runs import case, cluster, engine, terminal, workspace
from orchestrator.runs.case import Case
from orchestrator.runs.cluster import Queue
from orchestrator.runs.files import text_of
from orchestrator.runs.workspace import STATE, STUDY, Workspace, claimed, read_marker
from orchestrator.study.profile import Files
from orchestrator.study.study import Study, parse

Failures = Mapping[str, OrchestratorError]
States = Mapping[str, Any]


class Finished(NamedTuple):
    """Outcome of a command.

    Attributes
    ----------
    page
        Where the page is.
    started
        Number of cases that were run.
    failures
        The cases that failed, with why.
    answer
        The answer in words and a short table.
    undrawn
        A line for each figure that could not be drawn.
    """

    page: Path
    started: int
    failures: Failures
    answer: str = ""
    undrawn: Sequence[str] = ()


def run(
    study: Study, out: Path, *, workers: int, queue: Queue | None = None
) -> Finished:
    """Run a study, or what is missing of it, in a directory; `workers` cases at a time.

    A queue of a cluster runs the cases in place of this machine. An `InputError` says that the
    study cannot be answered or the directory not be used, a `SolverError` that a solver is missing
    or too old; after `Interrupted`, by the user, every child has ended.
    """
    space = Workspace(out.absolute())
    # what cannot be answered is refused before anything is written
    planned = plan.make(study, cases=space.cases)
    with claimed(space.root, STUDY, study.name):
        changed = _describe(space, study, planned)
        states = planned.done(space.cases)
        todo = planned.missing(space.cases, states)
        rest = {"queue": queue, "after_s": planned.drawing_s}
        failed = complete(
            todo, space, workers=workers, limit_s=study.time_limit_s, **rest
        )
        failures = _with_advice(failed, planned)
        if todo:
            states |= planned.done(space.cases, but=states)
        else:
            print("every case was done already; no solver was started", file=sys.stderr)
        answer = space.answer(planned.ids)
        undrawn: Sequence[str] = ()
        if todo or answer is None:
            print("drawing tables, figures and page", file=sys.stderr)
            answer, undrawn = _draw(study, planned, space, states, failures, False)
        if changed and (left := space.left(planned.cases)):
            what = f"the study file has changed: {len(left)} cases are not asked for any more"
            print(f"{what}; `orchestrator status {out}` names them", file=sys.stderr)
        return Finished(space.page, len(todo), failures, answer, undrawn)


def _with_advice(failures: Failures, planned: Plan) -> Failures:
    """Failures with what to do where levels were chosen: the scenes can be answered otherwise."""
    advised = dict(failures)
    for name in planned.chosen & failures.keys():
        error = failures[name]
        remedies = filter(None, (error.remedy, plan.BY_DEM))
        advised[name] = type(error)(error.what, error.where, "; or ".join(remedies))
    return advised


def _describe(space: Workspace, study: Study, planned: Plan) -> bool:
    """Write into the directory what is asked for; whether it is something else than before."""
    about = {"study": study.text, "tolerance": study.tolerance}
    before = read_marker(space.root, STUDY)
    changed = any(before.get(key, value) != value for key, value in about.items())
    source = study.source.described(space.root) if study.source else {}
    other = _file_of(before)
    is_other = other not in ("", source.get("file", ""))
    if changed and is_other and (space.root / other).is_file():
        what = f"the directory holds the study of another file, {other}"
        raise InputError(what, str(space.root), "choose another with --out")
    space.describe(STUDY, study.name, list(planned.cases), **about, source=source)
    return changed


def _file_of(about: Mapping[str, Any]) -> str:
    """The study file that a directory was made for, by its description; empty for none."""
    source = about.get("source")
    return str(source.get("file", "")) if isinstance(source, dict) else ""


def complete(
    todo: dict[str, Case],
    space: Workspace,
    *,
    workers: int,
    limit_s: float,
    **settings: Any,
) -> Failures:
    """Run cases, each for `limit_s` at most, show their progress, and give the failures.

    Settings are a `queue`, and the time `after_s` that is expected after the runs, s.
    """
    if not todo:
        return {}
    queue, after_s = settings.get("queue"), settings.get("after_s", 0.0)
    pools = partial(cluster.pool, queue) if queue else engine.local
    opened = pools(space.cases, workers=workers, limit_s=limit_s)
    with (
        opened as pool,
        engine.Display(todo.values(), space.cases, workers, after_s) as display,
    ):
        return engine.run(todo, pool, display, display.watch)


def reopen(space: Workspace) -> tuple[Study, Plan]:
    """The study that a directory was made for, and its plan; an `InputError` if it holds none."""
    about = space.description()
    if "study" not in about:
        what, remedy = (
            f"this is the experiment {about['name']}",
            "its own command draws it again",
        )
        raise InputError(what, str(space.root), remedy)
    # its text has those of the files that it names
    files = Files(None)
    study = parse(
        about["study"], name=about["name"], where=str(space.root), files=files
    )
    study = replace(study, tolerance=about.get("tolerance"))
    return study, plan.make(study, space.cases)


def redraw(out: Path, *, every: bool = False) -> Finished:
    """Make tables, figures and page anew from the cases that are done; `every` figure, or most."""
    space = Workspace(out.absolute())
    study, planned = reopen(space)
    with claimed(space.root, STUDY, study.name, new=False):
        states = planned.done(space.cases)
        space.check_cases_of_tables(states)
        causes = {name: case.failure(space.cases / name)[1] for name in planned.cases}
        failed = {name: OrchestratorError(why) for name, why in causes.items() if why}
        failures = _with_advice(failed, planned)
        answer, undrawn = _draw(study, planned, space, states, failures, every)
        return Finished(space.page, 0, failures, answer, undrawn)


def prune(directory: Path) -> str:
    """Drop the large files of finished cases, but for those that the page is drawn from."""
    space = Workspace(directory.absolute())
    study, planned = reopen(space)
    with claimed(space.root, STUDY, study.name, new=False):
        done = planned.done(space.cases)
        made = tables.make(study, planned, space.cases, done)
        shown = report.drawn_from(Results(study, planned, made, space.cases))
        return workspace.prune(
            space, {n: planned.cases[n] for n in done}, {c.name for c in shown}
        )


def _draw(
    study: Study,
    planned: Plan,
    space: Workspace,
    done: States,
    failures: Failures,
    every: bool,
) -> tuple[str, Sequence[str]]:
    """Write tables, figures and page, and last the marker of what they are made of.

    Returned are the answer, and a line for each figure that could not be drawn. Where a case
    failed or a figure is missing there is no marker: the same command draws all again.
    """
    space.drop(STATE)
    states = {name: done[name] for name in planned.cases if name in done}
    made = tables.make(study, planned, space.cases, states)
    results = Results(study, planned, made, space.cases)
    times = tables.timings(planned, states)
    causes = {name: str(error) for name, error in failures.items()}
    guests = paper.cards(study, made)
    with space.renewed():
        tables.write(made, space, "tables")
        tables.write({"timings": times}, space, "timings")
        answer = report.said(results, guests)
        try:
            undrawn = report.write(results, causes, space, guests, every)
        except (
            BaseException
        ):  # no memory for a picture, or an interrupt: the answer is found
            print(answer, file=sys.stderr)
            raise
    terminal.check()
    if not failures and not undrawn:
        state = {**space.drawn_of(planned.ids), "answer": answer}
        space.note(STATE, text_of(state))
    return answer, undrawn
