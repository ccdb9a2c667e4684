"""A study from its file to its page: plan, run what is missing, tables, figures."""

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from orchestrator import guests, plan, report, tables
from orchestrator.command import say
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.plan import Plan
from orchestrator.report.results import Results
from orchestrator.runs import case, cluster, engine, reuse, terminal, workspace
from orchestrator.runs.case import Case
from orchestrator.runs.engine import Display
from orchestrator.runs.files import write_durably
from orchestrator.runs.queues import Queue
from orchestrator.runs.workspace import EXPERIMENT, STATE, STUDY, Workspace, claimed
from orchestrator.study.own_errors import noted
from orchestrator.study.profile import Files
from orchestrator.study.study import Study, parse

Failures = Mapping[str, OrchestratorError]
States = Mapping[str, Any]
OF_TABLES = 0.5
"""Share of the time after the last case that tables take, nearly."""


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
    marked
        The answer in words and a short table, with the marks of `terminal.bold`.
    undrawn
        A line for each figure that could not be drawn.
    """

    page: Path
    started: int
    failures: Failures
    marked: str = ""
    undrawn: Sequence[str] = ()

    @property
    def answer(self) -> str:
        """The answer without marks."""
        return terminal.plain(self.marked)

    def tell(self) -> int:
        """Print the answer, the failures, and last the page.

        Returns
        -------
        int
            The exit code of the command.
        """
        if self.marked:
            print(terminal.shown(self.marked))
        for name, error in self.failures.items():
            say(f"{name} failed: {error}")
        if self.undrawn:
            say("the page lacks a figure; the same command draws it again")
        print(terminal.page_line(self.page))
        if self.failures:
            return 3
        return 1 if self.undrawn else 0


def run(
    study: Study, out: Path, *, workers: int, queue: Queue | None = None
) -> Finished:
    """Run a study, or what is missing of it, in a directory.

    Parameters
    ----------
    study
        The study.
    out
        The directory.
    workers
        Number of cases at a time.
    queue
        The queue of a cluster, which runs the cases in place of this machine.

    Returns
    -------
    Finished
        What came out.

    Raises
    ------
    InputError
        If the study cannot be answered or the directory not be used.
    SolverError
        If a solver is missing or too old.
    Interrupted
        If the user ended it; every child has ended.
    """
    space = Workspace(out.absolute())
    # what cannot be answered is refused before anything is written
    planned = plan.make(study, cases=space.cases)
    shown = Display(space.cases, workers, planned.drawing_s)
    with claimed(space.root, STUDY, study.name), shown as display:
        changed = _describe(study, planned, space)
        planned, states, failures, started = _completed(
            study, planned, space, queue, display
        )
        if not started and planned.cases:
            print("every case was done already; no solver was started", file=sys.stderr)
        elif not started:
            print("its answer needs no case; no solver was started", file=sys.stderr)
        answer = space.answer(planned.ids)
        undrawn: Sequence[str] = ()
        if started or answer is None:
            answer, undrawn = _draw(
                study, planned, space, states, failures, display, every=False
            )
        left = space.left(planned.cases) if changed else []
        if left:
            what = f"{len(left)} cases are not asked for any more"
            names = "names them"
            if len(left) == 1:
                what, names = "1 case is not asked for any more", "names it"
            what = f"the study file has changed: {what}"
            print(f"{what}; `orchestrator status {out}` {names}", file=sys.stderr)
        return Finished(space.page, started, failures, answer, undrawn)


def _completed(
    study: Study,
    planned: Plan,
    space: Workspace,
    queue: Queue | None,
    display: Display,
) -> tuple[Plan, dict[str, Any], Failures, int]:
    """Run what is missing, and what the finished flows show to be missing.

    Returned are the plan then, the states of its finished cases, the failures, and how
    many cases were started.
    """
    failed: dict[str, OrchestratorError] = {}
    started = 0
    while True:
        states = reuse.done(planned.cases, space.cases)
        missing = planned.missing(space.cases, states)
        todo = {name: case for name, case in missing.items() if name not in failed}
        found = complete(todo, space, display, limit_s=study.time_limit_s, queue=queue)
        failed |= found
        started += len(todo)
        if todo:
            states |= reuse.done(todo, space.cases)
        refined = plan.refined(planned, space.cases)
        if refined is planned:
            return planned, states, _with_advice(failed, planned), started
        planned = refined
        _describe(study, planned, space)


def _describe(study: Study, planned: Plan, space: Workspace) -> bool:
    """Note in its directory which study this is, and with which cases.

    Returned is whether it was another one before.
    """
    return space.describe(
        STUDY,
        study.name,
        planned.cases,
        study.source.described(space.root) if study.source else {},
        study=study.text,
        tolerance=study.tolerance,
        errors=study.errors.described(space.root) if study.errors else None,
    )


def _with_advice(failures: Failures, planned: Plan) -> Failures:
    """Failures with what to do where the scenes can be answered otherwise."""
    advised = dict(failures)
    for name in planned.chosen & failures.keys():
        error = failures[name]
        remedies = filter(None, (error.remedy, plan.BY_DEM))
        advised[name] = type(error)(error.what, error.where, "; or ".join(remedies))
    return advised


def complete(
    todo: dict[str, Case],
    space: Workspace,
    display: Display,
    *,
    limit_s: float,
    queue: Queue | None = None,
) -> Failures:
    """Run cases, and show their progress.

    Parameters
    ----------
    todo
        The cases by their names.
    space
        The directory of results.
    display
        Shows the progress of the command.
    limit_s
        Most time of a case, s.
    queue
        The queue of a cluster, which runs the cases in place of this machine.

    Returns
    -------
    dict of str to OrchestratorError
        The cases that failed, with why.
    """
    if not todo:
        return {}
    display.add(todo.values())
    pools = partial(cluster.pool, queue) if queue else engine.local
    with pools(space.cases, workers=display.workers, limit_s=limit_s) as pool:
        return engine.run(todo, pool, display, display.watch)


def reopen(space: Workspace) -> tuple[Study, Plan]:
    """Read the study that a directory was made for.

    Parameters
    ----------
    space
        The directory.

    Returns
    -------
    study, plan
        The study and its plan.

    Raises
    ------
    InputError
        If it holds none.
    """
    about = space.description()
    where = str(space.root)
    if "study" not in about:
        what = f"this is the experiment {about['name']}"
        raise InputError(what, where, f"to draw it again: {_again(about, space.root)}")
    # its text has those of the files that it names
    files = Files(None)
    study = parse(about["study"], name=about["name"], where=where, files=files)
    study = replace(study, tolerance=about.get("tolerance"))
    study = study.with_errors(noted(about.get("errors"), space.root))
    return study, plan.make(study, space.cases)


def _again(about: Mapping[str, Any], root: Path) -> str:
    """The command of an experiment, with the file that it is on, and its directory."""
    command = f"orchestrator {workspace.COMMANDS.get(about['name'], about['name'])}"
    source = about.get("source")
    if not isinstance(source, dict) or "file" not in source:
        return f"{command} --out {root}"
    file = Path(os.path.normpath(root / str(source["file"])))
    if file.is_file():
        return f"{command} {file} --out {root}"
    # the results were moved without it
    where = f"FILE is {file.name}, which is not in {file.parent}"
    return f"{command} FILE --out {root}; {where}"


def redraw(out: Path, *, every: bool = False) -> Finished:
    """Make tables, figures and page anew from the cases that are done.

    Parameters
    ----------
    out
        The directory.
    every
        Whether to draw also the figures that the page folds away.

    Returns
    -------
    Finished
        What came out.
    """
    space = Workspace(out.absolute())
    study, planned = reopen(space)
    with claimed(space.root, STUDY, study.name, new=False):
        states = reuse.done(planned.cases, space.cases)
        # flows that another version has read say only now whether others are needed
        while (refined := plan.refined(planned, space.cases)) is not planned:
            planned = refined
            states = reuse.done(planned.cases, space.cases)
        space.check_cases_of_tables(states)
        failed = {}
        for name in planned.cases:
            _, why = case.failure(space.cases / name)
            if why:
                failed[name] = OrchestratorError(why)
        failures = _with_advice(failed, planned)
        with Display(space.cases, 1, planned.drawing_s) as display:
            answer, undrawn = _draw(
                study, planned, space, states, failures, display, every=every
            )
        return Finished(space.page, 0, failures, answer, undrawn)


def film(out: Path, file: Path) -> Path:
    """Write the grains of a study's bed under its rising flow as an animation.

    Parameters
    ----------
    out
        The directory of the study.
    file
        The GIF.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If it is no GIF, cannot be written, or the study has no bed of grains.
    """
    from orchestrator.report import movie  # it imports matplotlib

    movie.check(file)
    space = Workspace(out.absolute())
    study, planned = reopen(space)
    done = reuse.done(planned.cases, space.cases)
    made = tables.make_tables(study, planned, space.cases, done)
    content = movie.of_study(Results(study, planned, made, space.cases))
    try:
        write_durably(file, content)
    except OSError as error:
        what = f"the animation cannot be written: {error.strerror or error}"
        raise InputError(what, str(file), "name another file") from None
    return file


def prune(directory: Path) -> str:
    """Drop the large files of finished cases, but for those of the page's figures.

    Parameters
    ----------
    directory
        The directory of the study or of the experiment.

    Returns
    -------
    str
        What was dropped, in words.
    """
    space = Workspace(directory.absolute())
    about = space.description()
    if "study" not in about:
        # tables and pictures of experiments are made of results alone
        with claimed(space.root, EXPERIMENT, about["name"], new=False):
            ids = {name: case.id_of(space.cases / name) for name in about["cases"]}
            return workspace.prune_cases(space, ids, ())
    study, planned = reopen(space)
    with claimed(space.root, STUDY, study.name, new=False):
        done = reuse.done(planned.cases, space.cases)
        made = tables.make_tables(study, planned, space.cases, done)
        results = Results(study, planned, made, space.cases)
        drawn = report.drawn_from(results, guests.figures())
        kept = {case.name for case in drawn}
        return workspace.prune_cases(
            space, {name: planned.ids[name] for name in done}, kept
        )


def _draw(
    study: Study,
    planned: Plan,
    space: Workspace,
    done: States,
    failures: Failures,
    display: Display,
    *,
    every: bool,
) -> tuple[str, Sequence[str]]:
    """Write tables, figures and page, and last the marker of what they are made of.

    Returned are the answer, and a line for each figure that could not be drawn. Where a
    case failed or a figure is missing there is no marker: the same command draws all
    again.
    """
    space.drop(STATE)
    states = {name: done[name] for name in planned.cases if name in done}
    display.drawing(0.0, "tables")
    made = tables.make_tables(study, planned, space.cases, states)
    results = Results(study, planned, made, space.cases)
    times = tables.timings(planned, states)
    causes = {name: str(error) for name, error in failures.items()}
    cards = guests.cards(study, made)
    display.drawing(OF_TABLES, "figures and page")
    with space.renewed():
        written = tables.write_tables(made, space, "tables")
        tables.write_tables({"timings": times}, space, "timings")
        answer = report.said(results, cards, marked=True)
        try:
            rooms = guests.figures()
            undrawn = report.write(
                results, causes, space, cards, every, rooms, written, times
            )
        except BaseException:
            # no memory for a picture, or an interrupt: the answer is found
            print(terminal.plain(answer), file=sys.stderr)
            raise
    terminal.check_signals()
    if not failures and not undrawn:
        space.note_answer(planned.ids, terminal.plain(answer))
    if not undrawn:
        display.end()
    return answer, undrawn
