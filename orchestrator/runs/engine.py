"""Run what is missing of a plan's cases: many at a time, wherever a pool runs them, none twice."""

import concurrent.futures
import contextlib
import heapq
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import partial
from graphlib import TopologicalSorter
from pathlib import Path

from orchestrator.errors import Interrupted, OrchestratorError, SolverError, of_exception
from orchestrator.runs import case as case_states
from orchestrator.runs import process
from orchestrator.runs.case import Case

POLL_S = 0.2
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Threads of a solver's process: solvers hold all cores, and more threads would take others'."""


@dataclass(frozen=True)
class Outcome:
    """How a case ended, in how many seconds (0: not known); without an error, it is done."""

    case: Case
    seconds: float = 0.0
    error: OrchestratorError | None = None


@dataclass(frozen=True)
class Pool:
    """Where cases run, `places` of them at a time: an executor of threads or processes.

    `task` runs a case and returns its time, s; the executor raises one of `lost` for a case whose
    process it lost for good.
    """

    executor: Executor
    task: Callable[[Case], float]
    places: int
    lost: tuple[type[Exception], ...] = ()


class Cores:
    """The cores of this machine; the first solver in the queue is served first.

    Else one that needs two would wait for ever while others take each core that falls free.
    """

    def __init__(self, count: int) -> None:
        self._count, self._free = count, threading.Semaphore(count)
        self._queue = threading.Lock()

    @contextlib.contextmanager
    def held(self, wanted: int) -> Iterator[None]:
        """Hold as many cores as are wanted, or all where there are fewer."""
        taken = min(wanted, self._count)
        with self._queue:
            for _ in range(taken):
                self._free.acquire()
        try:
            yield
        finally:
            self._free.release(taken)


@contextlib.contextmanager
def local(cases: Path, *, workers: int, limit_s: float) -> Iterator[Pool]:
    """Threads of this process, whose solvers take so many cores as there are workers.

    While solvers hold all cores, other threads prepare the next cases and read what the last ones
    left, so that no solver waits for Python. An exception ends all children before it goes on.
    """
    stop = threading.Event()
    task = partial(execute, cases=cases, limit_s=limit_s, stop=stop, cores=Cores(workers))
    places = 2 * workers
    with concurrent.futures.ThreadPoolExecutor(places, thread_name_prefix="case") as threads:
        try:
            yield Pool(threads, task, places)
        except BaseException:
            stop.set()
            threads.shutdown(cancel_futures=True)
            raise


def execute(
    case: Case,
    cases: Path,
    limit_s: float,
    stop: threading.Event | None = None,
    cores: Cores | None = None,
) -> float:
    """Run one case, whose needs are done, to its marker of being done; its time, s.

    The solver holds `cores` while it runs, and the wait for them is not counted. `stop` ends the
    run early by Interrupted. SolverError is raised if the solver died, did not end within `limit_s`
    or gave results that cannot be trusted; the case's directory is left for inspection.
    """
    began = time.monotonic()
    directory = case_states.prepare(case, cases)
    outside_s, log = time.monotonic() - began, directory / case_states.LOG
    try:
        with cores.held(case.ranks) if cores else contextlib.nullcontext():
            ended = process.run(
                ["sh", "Allrun"],  # a disk may forbid to run files, or know no right to
                cwd=directory,
                log=log,
                limit_s=limit_s,
                stop=stop,
                env=ONE_THREAD,
                tries=process.TRIES,
            )
        began = time.monotonic()
        if ended.over == "disk":
            what = "no space is left on the disk, and the solver did not end"
            raise SolverError(what, str(directory), "make room, then the same command continues")
        if ended.over:
            what = f"the solver did not end within {limit_s:g} s and was killed"
            remedy = "see its logs; raise time_limit in the study file if it was still at work"
            raise SolverError(what, str(directory), remedy)
        # the case's own look at its logs knows more than the exit code: it comes first
        case.collect(directory)
        if ended.returncode != 0:
            raise SolverError(f"./Allrun ended with {ended.returncode}", str(log), "see it")
        wall_s = outside_s + ended.seconds + time.monotonic() - began
        times = {"solver_s": ended.seconds, "cpu_s": ended.cpu_s, "wall_s": wall_s}
        case_states.finish(case, directory, **times)
    except SolverError as error:
        case_states.fail(directory, error)
        raise
    return wall_s


def check_solvers(cases: Iterable[Case], pool: Pool) -> None:
    """See that the programs of some cases are where a pool runs them; else SolverError."""
    kinds = {case.kind: case for case in cases}.values()
    for future in [pool.executor.submit(case.versions) for case in kinds]:
        try:
            future.result()
        except pool.lost as error:
            raise _loss(error, "the first look at the solvers") from None


def run(
    todo: Mapping[str, Case],
    pool: Pool,
    report: Callable[[Outcome], None],
    watch: Callable[[Collection[Case]], None] = lambda _: None,
) -> dict[str, OrchestratorError]:
    """Run cases that are not done yet; return those that failed, or need one that did, with why.

    A case, by name in `todo`, starts once those that it needs have ended. Of the cases that may
    start, the one with the most expensive chain of cases behind it is the first. `report` receives
    the outcome of each case, and `watch`, a few times a second, the cases that run. Interrupted is
    raised if the pool is stopped.
    """
    needs = {name: {need.name for need in case.needs} & todo.keys() for name, case in todo.items()}
    behind, chains = dict.fromkeys(todo, 0.0), {}  # costs, s, of the cases that wait for each
    for name in reversed([*TopologicalSorter(needs).static_order()]):
        chains[name] = todo[name].cost_s + behind[name]
        for need in needs[name]:
            behind[need] = max(behind[need], chains[name])
    sorter = TopologicalSorter(needs)
    sorter.prepare()
    ready: list[tuple[float, int, str]] = []
    places = {name: place for place, name in enumerate(todo)}
    running: dict[Future[float], Case] = {}
    failed: dict[str, OrchestratorError] = {}

    def settle(case: Case, seconds: float = 0.0, error: OrchestratorError | None = None) -> None:
        if error:
            failed[case.name] = error
        report(Outcome(case, seconds, error))
        sorter.done(case.name)

    while sorter.is_active():
        for name in sorter.get_ready():
            heapq.heappush(ready, (-chains[name], places[name], name))
        while ready and len(running) < pool.places:
            case = todo[heapq.heappop(ready)[-1]]
            lost = next((need.name for need in case.needs if need.name in failed), None)
            if lost:
                settle(case, error=SolverError(f"it needs {lost}, which failed", case.name))
            else:
                running[pool.executor.submit(pool.task, case)] = case
        if running:
            # a wait without a limit would not let the main thread see a signal
            ended, _ = concurrent.futures.wait(
                running, timeout=POLL_S, return_when=concurrent.futures.FIRST_COMPLETED
            )
            watch(running.values())
            for future in ended:
                case, fault = running.pop(future), future.exception()
                if isinstance(fault, pool.lost):
                    settle(case, error=_loss(fault, case.name))
                elif isinstance(fault, Exception) and not isinstance(fault, Interrupted):
                    # a fault in the reading of one case costs that case, not the study
                    settle(case, error=of_exception(fault, case.name))
                else:
                    settle(case, future.result())
    return failed


def _loss(error: Exception, where: str) -> SolverError:
    what = f"the processes that ran it were lost: {error}"
    return SolverError(what, where, "the logs of their jobs say more: out of memory, or of time?")
