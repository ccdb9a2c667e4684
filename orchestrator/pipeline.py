"""A study from its file to its page: plan, run what is missing, tables, figures."""

from dataclasses import dataclass
from pathlib import Path

from orchestrator import __version__, case, cluster, engine, plan, report, tables
from orchestrator.case import Case
from orchestrator.cluster import Queue
from orchestrator.errors import OrchestratorError
from orchestrator.files import (
    canonical_json,
    digest_file,
    digest_files,
    digest_text,
    read_json,
    write_json,
)
from orchestrator.plan import Plan
from orchestrator.progress import Display
from orchestrator.study import Study, parse
from orchestrator.workspace import Workspace


@dataclass(frozen=True)
class Finished:
    """What a study came to.

    Attributes
    ----------
    page : Path
        The page.
    started : int
        How many cases were run.
    failures : dict of str to OrchestratorError
        The cases that failed, with why.
    """

    page: Path
    started: int
    failures: dict[str, OrchestratorError]


def run(study: Study, out: Path, *, workers: int, queue: Queue | None = None) -> Finished:
    """Run a study, or what is missing of it.

    Parameters
    ----------
    study : Study
        What to run.
    out : Path
        Its directory; a study that is there already is continued.
    workers : int
        Cases at a time.
    queue : Queue, optional
        Of the cluster that runs them; without it, this machine does.

    Raises
    ------
    InputError
        If the directory cannot be used.
    SolverError
        If a solver is missing or too old.
    Interrupted
        If the user stopped it; every child has ended.
    """
    planned = plan.make(study)
    space = Workspace(out.absolute())
    space.claim(study.name, study.text, list(planned.cases))
    with space.held():
        done = planned.done(space.cases)
        todo = {name: one for name, one in planned.cases.items() if name not in done}
        if not todo and _is_drawn(study, planned, space):
            return Finished(space.page, 0, {})
        failures = {}
        if todo:
            failures = complete(
                todo, space, workers=workers, limit_s=study.time_limit_s, queue=queue
            )
        draw(study, planned, space, failures)
        return Finished(space.page, len(todo), failures)


def complete(
    todo: dict[str, Case],
    space: Workspace,
    *,
    workers: int,
    limit_s: float,
    queue: Queue | None = None,
) -> dict[str, OrchestratorError]:
    """Run cases, with a display of how far they are; the failures by the cases' names."""
    opened = (
        cluster.pool(queue, space.cases, workers=workers, limit_s=limit_s)
        if queue
        else engine.local(space.cases, workers=workers, limit_s=limit_s)
    )
    with opened as pool, Display(list(todo.values()), workers) as display:
        engine.check_solvers(todo.values(), pool)
        return engine.run(todo, pool, display)


def redraw(out: Path) -> Finished:
    """Make tables, figures and page again from the cases that are done."""
    space = Workspace(out.absolute())
    about = space.description()
    study = parse(about["study"], name=about["name"], where=str(out))
    planned = plan.make(study)
    with space.held():
        causes = {name: case.failure(space.cases / name) for name in planned.cases}
        failures = {name: OrchestratorError(why) for name, why in causes.items() if why}
        draw(study, planned, space, failures)
    return Finished(space.page, 0, failures)


def draw(
    study: Study, planned: Plan, space: Workspace, failures: dict[str, OrchestratorError]
) -> None:
    """Write tables, figures and page, and last the marker that says of which cases."""
    space.drawn.unlink(missing_ok=True)
    states = planned.done(space.cases)
    results = tables.make(study, planned, space.cases, states)
    times = tables.timings(planned, states)
    tables.write(results, space.tables)
    tables.write({"timings": times}, space.root / "timings")
    causes = {name: str(error) for name, error in failures.items()}
    report.write(study, planned, results, times, causes, space.root)
    if not failures:
        written = [path for path in space.tables.iterdir() if path.is_file()]
        files = digest_files([*written, space.page], root=space.root)
        write_json(space.drawn, {"of": _origin(study, planned), "sha256": files})


def _origin(study: Study, planned: Plan) -> str:
    """Digest of all that the tables and figures are made of."""
    cases = [one.id for one in planned.cases.values()]
    return digest_text(canonical_json([__version__, study.text, cases]))


def _is_drawn(study: Study, planned: Plan, space: Workspace) -> bool:
    state = read_json(space.drawn)
    try:
        return (
            isinstance(state, dict)
            and state["of"] == _origin(study, planned)
            and all(digest_file(space.root / name) == sha for name, sha in state["sha256"].items())
        )
    except (KeyError, AttributeError, OSError):
        return False
