"""Run what is missing of a plan's cases, many at a time and none twice, and show the progress."""

import concurrent.futures
import contextlib
import heapq
import math
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import partial
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Self

from orchestrator.errors import Interrupted, OrchestratorError, SolverError, of_exception
from orchestrator.runs import case as case_states
from orchestrator.runs import process
from orchestrator.runs.case import Case

POLL_S, LOOK_S = 0.2, 1.0
"""Time between two looks at the pool, and at how far the running cases are, s."""
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Threads of a solver's process: solvers hold all cores, and more threads would take others'."""


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

    Further threads prepare cases and read results while solvers hold all cores. An exception ends
    all children before it goes on.
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
    # sh: a disk may forbid to run files, or know no right to
    start = partial(process.run, ["sh", "Allrun"], cwd=directory, log=log, env=ONE_THREAD)
    try:
        with cores.held(case.ranks) if cores else contextlib.nullcontext():
            ended = start(limit_s=limit_s, stop=stop, tries=process.TRIES)
        began = time.monotonic()
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


def run(
    todo: Mapping[str, Case],
    pool: Pool,
    report: Callable[[Case, float, OrchestratorError | None], None],
    watch: Callable[[Collection[Case]], None] = lambda _: None,
) -> dict[str, OrchestratorError]:
    """Run the cases that are not done, by name; return why cases failed, or need one that did.

    Of the cases whose needs have ended, the one with the most expensive chain of cases behind it
    starts first. `report` receives each case that has ended, its time, s, and its failure; `watch`,
    a few times a second, the cases that run. SolverError is raised if the pool lacks a program,
    Interrupted if it is stopped.
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

    def lost(error: BaseException, where: str) -> SolverError:
        what = f"the processes that ran it were lost: {error}"
        return SolverError(what, where, "the logs of their jobs say more: out of memory, or time?")

    def settle(case: Case, seconds: float = 0.0, error: OrchestratorError | None = None) -> None:
        if error:
            failed[case.name] = error
        report(case, seconds, error)
        sorter.done(case.name)

    kinds = {case.kind: case for case in todo.values()}.values()
    for looked in [pool.executor.submit(case.versions) for case in kinds]:
        try:
            looked.result()
        except pool.lost as fault:
            raise lost(fault, "the first look at the solvers") from None
    while sorter.is_active():
        for name in sorter.get_ready():
            heapq.heappush(ready, (-chains[name], places[name], name))
        while ready and len(running) < pool.places:
            case = todo[heapq.heappop(ready)[-1]]
            if need_failed := next((n.name for n in case.needs if n.name in failed), None):
                settle(case, error=SolverError(f"it needs {need_failed}, which failed", case.name))
            else:
                running[pool.executor.submit(pool.task, case)] = case
        if running:
            # a wait without a limit would not let the main thread see a signal
            first = concurrent.futures.FIRST_COMPLETED
            ended, _ = concurrent.futures.wait(running, timeout=POLL_S, return_when=first)
            watch(running.values())
            for future in ended:
                case, error = running.pop(future), future.exception()
                if isinstance(error, pool.lost):
                    settle(case, error=lost(error, case.name))
                elif isinstance(error, Exception) and not isinstance(error, Interrupted):
                    # a fault in the reading of one case costs that case, not the study
                    settle(case, error=of_exception(error, case.name))
                else:
                    settle(case, future.result())
    return failed


class Display:
    """Shows how far a study is: a bar on a terminal, elsewhere a line for each case that ends.

    The cases share so many cores as `workers`; `after_s` is expected after the last of them, s.
    `done` is the share of the work that is done, 0 to 1, and `left_s` the time until all is, s.
    """

    def __init__(self, todo: Collection[Case], cases: Path, workers: int, after_s: float) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        self._cases, self._workers, self._after_s = cases, workers, after_s
        self._whole_s = self._left_s = sum(case.cost_s for case in todo)
        self._expected_s = self._took_s = 0.0  # costs and times of the cases that have ended
        self._going_s: dict[str, float] = {}
        self._count, self._ended, self._looked = len(todo), 0, -math.inf
        self._console = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
        ended, text = TextColumn("{task.fields[ended]} cases"), TextColumn("{task.description}")
        self._bar = Progress(ended, BarColumn(), text, console=self._console)
        self._task = self._bar.add_task("", total=1.0, ended="")
        self._show()

    def __enter__(self) -> Self:
        if sys.stderr.isatty():
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar.live.is_started:
            self._bar.stop()

    def __call__(self, case: Case, seconds: float, error: OrchestratorError | None) -> None:
        """Take note of a case that has ended."""
        self._ended += 1
        self._going_s.pop(case.name, None)
        self._left_s -= case.cost_s
        if not error:
            self._expected_s += case.cost_s
            self._took_s += seconds * case.ranks
        state, text = "failed" if error else "done", self._show()
        self._console.print(f"[{self._ended}/{self._count}] {state}  {case.name}  {text}")
        if error:
            self._console.print(f"  {error}")

    def watch(self, running: Collection[Case]) -> None:
        """Look how far the running cases are, once a second, for the bar of a terminal."""
        if sys.stderr.isatty() and time.monotonic() > self._looked + LOOK_S:
            self._looked = time.monotonic()
            shares = {case: case.share(self._cases / case.name) for case in running}
            self._going_s = {case.name: share * case.cost_s for case, share in shares.items()}
            self._show()

    def _show(self) -> str:
        """Show on the bar how far the study is; the same in words."""
        whole_s = self._whole_s / self._workers + self._after_s
        left_s = max(0.0, self._left_s - sum(self._going_s.values())) / self._workers
        pace = self._took_s / self._expected_s if self._took_s else 1.0
        self.left_s = pace * left_s + self._after_s
        self.done = 1 - (left_s + self._after_s) / whole_s if whole_s else 1.0
        text = f"{self.done:.0%} of the work, about {human(self.left_s)} left"
        ended = f"{self._ended}/{self._count}"
        self._bar.update(self._task, completed=self.done, ended=ended, description=text)
        return text


def human(seconds: float) -> str:
    """A time for people."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
