"""Run what is missing of a plan's cases: in parallel, each after what it needs, none twice."""

import concurrent.futures
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path

from orchestrator import case as case_states
from orchestrator.case import Case
from orchestrator.errors import Interrupted, OrchestratorError, SolverError, of_system
from orchestrator.solvers import process

LOG = "log.Allrun"
POLL_S = 0.2


@dataclass(frozen=True)
class Outcome:
    """How a case ended: without an error, it is done."""

    case: Case
    error: OrchestratorError | None = None


Report = Callable[[Outcome], None]


def execute(case: Case, cases: Path, limit_s: float, stop: threading.Event) -> None:
    """Run one case from its inputs to its marker of being done.

    Raises
    ------
    SolverError
        If the solver died, hung or gave results that cannot be trusted; the case's directory is
        left for inspection.
    Interrupted
        If `stop` was set.
    """
    started = time.monotonic()
    directory = case_states.prepare(case, cases)
    try:
        ended = process.run(
            ["./Allrun"], cwd=directory, log=directory / LOG, limit_s=limit_s, stop=stop
        )
        _check(case, directory, ended, limit_s)
        case_states.finish(
            case, directory, solver_s=ended.seconds, wall_s=time.monotonic() - started
        )
    except SolverError as error:
        case_states.fail(directory, error)
        raise


def _check(case: Case, directory: Path, ended: process.Ended, limit_s: float) -> None:
    if ended.timed_out:
        raise SolverError(
            f"the solver did not end within {limit_s:g} s and was killed",
            where=str(directory),
            remedy="see its logs; raise time_limit in the study file if it was still at work",
        )
    # the case's own look at its logs knows more than the exit code: it comes first
    case.collect(directory)
    if ended.returncode != 0:
        raise SolverError(
            f"./Allrun ended with {ended.returncode}", where=str(directory / LOG), remedy="see it"
        )


def run(
    todo: Mapping[str, Case],
    cases: Path,
    *,
    workers: int,
    limit_s: float,
    report: Report,
) -> dict[str, OrchestratorError]:
    """Run cases that are not done yet.

    Parameters
    ----------
    todo : mapping of str to Case
        By name; what a case needs is either here too or done already.
    cases : Path
        The directory of the study's cases.
    workers : int
        How many at a time.
    limit_s : float
        Wall time after which a run counts as hung, s.
    report : callable
        Told of each case as it ends.

    Returns
    -------
    dict of str to OrchestratorError
        The cases that failed, with why; what needed them is among them.

    Raises
    ------
    Interrupted
        By SIGINT or SIGTERM, after every child has ended.
    """
    stop = threading.Event()
    with concurrent.futures.ThreadPoolExecutor(workers, thread_name_prefix="case") as pool:
        try:
            return _drive(pool, dict(todo), cases, limit_s, stop, report)
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            raise


def _drive(
    pool: Executor,
    waiting: dict[str, Case],
    cases: Path,
    limit_s: float,
    stop: threading.Event,
    report: Report,
) -> dict[str, OrchestratorError]:
    running: dict[Future[None], Case] = {}
    failed: dict[str, OrchestratorError] = {}
    while waiting or running:
        for case in _ready(waiting, running, failed):
            running[pool.submit(execute, case, cases, limit_s, stop)] = waiting.pop(case.name)
        # a wait without a limit would not let the main thread see a signal
        ended, _ = concurrent.futures.wait(
            running, timeout=POLL_S, return_when=concurrent.futures.FIRST_COMPLETED
        )
        for future in ended:
            outcome = _outcome(running.pop(future), future)
            if outcome.error:
                failed[outcome.case.name] = outcome.error
            report(outcome)
        _give_up(waiting, failed, report)
    return failed


def _ready(
    waiting: Mapping[str, Case],
    running: Mapping[Future[None], Case],
    failed: Mapping[str, OrchestratorError],
) -> list[Case]:
    """Cases whose needs are met, the dearest first; those they wait for count with their cost."""
    open_names = {*waiting, *(case.name for case in running.values()), *failed}
    ready = [c for c in waiting.values() if not any(n.name in open_names for n in c.needs)]
    behind = {name: _cost_behind(name, waiting) for name in (c.name for c in ready)}
    return sorted(ready, key=lambda case: -(case.cost_s + behind[case.name]))


def _cost_behind(name: str, waiting: Mapping[str, Case]) -> float:
    costs = (c.cost_s for c in waiting.values() if any(n.name == name for n in c.needs))
    return max(costs, default=0.0)


def _outcome(case: Case, future: Future[None]) -> Outcome:
    try:
        future.result()
        return Outcome(case)
    except Interrupted:
        raise
    except OrchestratorError as error:
        return Outcome(case, error)
    except OSError as error:
        return Outcome(case, of_system(error, case.name))


def _give_up(
    waiting: dict[str, Case], failed: dict[str, OrchestratorError], report: Report
) -> None:
    for case in list(waiting.values()):
        lost = next((need for need in case.needs if need.name in failed), None)
        if lost:
            error = SolverError(f"it needs {lost.name}, which failed", where=case.name)
            failed[case.name] = error
            report(Outcome(waiting.pop(case.name), error))
