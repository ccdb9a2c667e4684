"""Run what is missing of a plan's cases, many at a time, and show the progress."""

import concurrent.futures
import contextlib
import heapq
import math
import sys
import threading
import time
from collections.abc import Callable, Collection, Container, Iterator, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import partial
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Self

from orchestrator.errors import (
    Interrupted,
    OrchestratorError,
    SolverError,
    of_exception,
)
from orchestrator.runs import case as case_states
from orchestrator.runs import process
from orchestrator.runs.case import Case
from orchestrator.runs.process import Ended

POLL_S = 0.2
"""Time between two looks at the pool, s."""
LOOK_S = 1.0
"""Time between two looks at how far the running cases are, s."""
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
}
"""Threads of a solver's process.

Solvers hold all cores, and more threads would take others'.
"""


@dataclass(frozen=True)
class Pool:
    """Where cases run.

    Attributes
    ----------
    executor
        An executor of threads or processes.
    task
        Runs a case and returns its time, s.
    places
        Number of cases that run at a time.
    lost
        Exceptions of the executor for a case whose process it lost for good.
    """

    executor: Executor
    task: Callable[[Case], float]
    places: int
    lost: tuple[type[Exception], ...] = ()


class Cores:
    """The cores of this machine; the first solver in the queue is served first.

    Else one that needs two would wait for ever while others take each core that falls
    free.

    Parameters
    ----------
    count
        Number of cores.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._free = threading.Semaphore(count)
        self._queue = threading.Lock()

    @contextlib.contextmanager
    def held(self, wanted: int) -> Iterator[None]:
        """Hold as many cores as are wanted, or all where there are fewer.

        Parameters
        ----------
        wanted
            Number of cores.

        Yields
        ------
        None
            While the cores are held.
        """
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
    """Make a pool of threads of this process.

    Further threads prepare cases and read results while solvers hold all cores. An
    exception ends all children before it goes on.

    Parameters
    ----------
    cases
        Directory of the cases.
    workers
        Number of cores that the solvers take.
    limit_s
        Time that a solver may take, s.

    Yields
    ------
    Pool
        The pool.
    """
    stop = threading.Event()
    task = partial(
        execute,
        cases=cases,
        limit_s=limit_s,
        stop=stop,
        cores=Cores(workers),
    )
    places = 2 * workers
    executor = concurrent.futures.ThreadPoolExecutor(places, thread_name_prefix="case")
    with executor:
        try:
            yield Pool(executor, task, places)
        except BaseException:
            stop.set()
            executor.shutdown(cancel_futures=True)
            raise


def execute(
    case: Case,
    cases: Path,
    limit_s: float,
    stop: threading.Event | None = None,
    cores: Cores | None = None,
) -> float:
    """Run one case, whose needs are done, to its marker of being done.

    Parameters
    ----------
    case
        The case.
    cases
        Directory of the cases.
    limit_s
        Time that the solver may take, s.
    stop
        An event that another thread sets to end the run.
    cores
        The cores that the solver holds while it runs; the wait for them is not counted.

    Returns
    -------
    float
        Its time, s.

    Raises
    ------
    SolverError
        If the solver died, did not end within its time or gave results that cannot be
        trusted. The case's directory is left for inspection.
    Interrupted
        If `stop` was set.
    """
    began = time.monotonic()
    directory = case_states.prepare(case, cases)
    prepared_s = time.monotonic() - began
    held = cores.held(case.ranks) if cores else contextlib.nullcontext()
    try:
        with held:
            ended = _solve(directory, limit_s, stop)
        began = time.monotonic()
        # the case's own look at its logs knows more than the exit code: it comes first
        case.collect(directory)
        if ended.returncode != 0:
            what = f"./Allrun ended with {ended.returncode}"
            raise SolverError(what, str(directory / case_states.LOG), "see it")
        wall_s = prepared_s + ended.seconds + time.monotonic() - began
        case_states.finish(
            case,
            directory,
            solver_s=ended.seconds,
            cpu_s=ended.cpu_s,
            wall_s=wall_s,
        )
    except SolverError as error:
        case_states.fail(directory, error)
        raise
    return wall_s


def _solve(directory: Path, limit_s: float, stop: threading.Event | None) -> Ended:
    """Run the `Allrun` of a case; SolverError if it does not end within its time."""
    ended = process.run(
        # sh: a disk may forbid to run files, or know no right to
        ["sh", "Allrun"],
        cwd=directory,
        log=directory / case_states.LOG,
        env=ONE_THREAD,
        limit_s=limit_s,
        stop=stop,
        tries=process.TRIES,
    )
    if ended.over:
        what = f"the solver did not end within {limit_s:g} s and was killed"
        longer = "raise time_limit in the study file if it was still at work"
        raise SolverError(what, str(directory), f"see its logs; {longer}")
    return ended


def run(
    todo: Mapping[str, Case],
    pool: Pool,
    report: Callable[[Case, float, OrchestratorError | None], None],
    watch: Callable[[Collection[Case]], None] = lambda _: None,
) -> dict[str, OrchestratorError]:
    """Run the cases that are not done.

    Of the cases whose needs have ended, the one with the most expensive chain of cases
    behind it starts first.

    Parameters
    ----------
    todo
        The cases, by name.
    pool
        Where they run.
    report
        Receives each case that has ended, its time, s, and its failure.
    watch
        Receives a few times a second the cases that run.

    Returns
    -------
    dict
        Why cases failed, or need one that did, by name.

    Raises
    ------
    SolverError
        If the pool lacks a program.
    Interrupted
        If it is stopped.
    """
    _check_programs(todo.values(), pool)
    order = _Order(todo)
    running: dict[Future[float], Case] = {}
    failed: dict[str, OrchestratorError] = {}

    def settle(case: Case, seconds: float, error: OrchestratorError | None) -> None:
        if error is not None:
            failed[case.name] = error
        report(case, seconds, error)
        order.done(case)

    while order.is_active():
        order.refill()
        while order.has_ready() and len(running) < pool.places:
            case = order.first()
            error = _failure_of_needs(case, failed)
            if error is not None:
                settle(case, 0.0, error)
            else:
                running[pool.executor.submit(pool.task, case)] = case
        if running:
            ended = _await_any(running)
            watch(running.values())
            for future in ended:
                case = running.pop(future)
                seconds, error = _outcome(future, case, pool)
                settle(case, seconds, error)
    return failed


class _Order:
    """The order of cases: which are ready, and which of these starts first.

    It is the one with the most expensive chain of cases behind it, and of equal ones
    the first in the plan.
    """

    def __init__(self, todo: Mapping[str, Case]) -> None:
        self._todo = todo
        self._places = {name: place for place, name in enumerate(todo)}
        needs = {name: _needs_among(case, todo) for name, case in todo.items()}
        self._chain_s = _chain_costs(todo, needs)
        self._sorter = TopologicalSorter(needs)
        self._sorter.prepare()
        self._ready: list[tuple[float, int, str]] = []

    def is_active(self) -> bool:
        """Whether cases have not ended."""
        return self._sorter.is_active()

    def refill(self) -> None:
        """Take note of the cases whose needs have ended since."""
        for name in self._sorter.get_ready():
            entry = (-self._chain_s[name], self._places[name], name)
            heapq.heappush(self._ready, entry)

    def has_ready(self) -> bool:
        """Whether a case can start."""
        return bool(self._ready)

    def first(self) -> Case:
        """Take the case that starts first."""
        _, _, name = heapq.heappop(self._ready)
        return self._todo[name]

    def done(self, case: Case) -> None:
        """Take note of a case that has ended."""
        self._sorter.done(case.name)


def _needs_among(case: Case, todo: Mapping[str, Case]) -> set[str]:
    """Names of the cases to be run that a case needs."""
    return {need.name for need in case.needs if need.name in todo}


def _chain_costs(
    todo: Mapping[str, Case],
    needs: Mapping[str, set[str]],
) -> dict[str, float]:
    """Cost of each case and of the most expensive chain that waits for it, s."""
    behind_s = dict.fromkeys(todo, 0.0)
    chain_s = {}
    names = list(TopologicalSorter(needs).static_order())
    for name in reversed(names):
        chain_s[name] = todo[name].cost_s + behind_s[name]
        for need in needs[name]:
            behind_s[need] = max(behind_s[need], chain_s[name])
    return chain_s


def _check_programs(cases: Collection[Case], pool: Pool) -> None:
    """Ask for the programs of each kind of case, where the cases run."""
    by_kind = {case.kind: case for case in cases}
    asked = [pool.executor.submit(case.versions) for case in by_kind.values()]
    for future in asked:
        try:
            future.result()
        except pool.lost as error:
            raise _lost(error, "the first look at the solvers") from None


def _failure_of_needs(
    case: Case,
    failed: Mapping[str, OrchestratorError],
) -> OrchestratorError | None:
    """The failure of a case that needs one that failed."""
    for need in case.needs:
        if need.name in failed:
            return SolverError(f"it needs {need.name}, which failed", case.name)
    return None


def _await_any(running: Collection[Future[float]]) -> set[Future[float]]:
    """Those that have ended, after a short wait for the first."""
    ended, _ = concurrent.futures.wait(
        running,
        # a wait without a limit would not let the main thread see a signal
        timeout=POLL_S,
        return_when=concurrent.futures.FIRST_COMPLETED,
    )
    return ended


def _outcome(
    future: Future[float],
    case: Case,
    pool: Pool,
) -> tuple[float, OrchestratorError | None]:
    """Time of a case that has ended, s, and its failure.

    An exception that stops the whole run is raised.
    """
    error = future.exception()
    if isinstance(error, pool.lost):
        return 0.0, _lost(error, case.name)
    if isinstance(error, Exception) and not isinstance(error, Interrupted):
        # a fault in the reading of one case costs that case, not the study
        return 0.0, of_exception(error, case.name)
    return future.result(), None


def _lost(error: BaseException, where: str) -> SolverError:
    """The failure of a case whose process the pool lost for good."""
    what = f"the processes that ran it were lost: {error}"
    remedy = "the logs of their jobs say more: out of memory, or time?"
    return SolverError(what, where, remedy)


class Display:
    """Shows how far a command is, from its first case to its page.

    On a terminal it is one bar, elsewhere a line for each case that ends and for each
    part of the drawing. Cases that are found to be missing on the way are added: the
    share that is done stays, and the rest takes longer.

    Parameters
    ----------
    cases
        Directory of the cases.
    workers
        Number of cores that the cases share.
    after_s
        Time that is expected after the last case, s.
    failing
        Names of the cases of which it is told why they failed; None for all.

    Attributes
    ----------
    workers
        Number of cores that the cases share.
    done
        Share of the work that is done, 0 to 1.
    left_s
        Time until all is done, s.
    """

    done: float
    left_s: float

    def __init__(
        self,
        cases: Path,
        workers: int,
        after_s: float,
        failing: Container[str] | None = None,
    ) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        self._cases = cases
        self.workers = workers
        self._after_s = after_s
        self._failing = failing
        # costs of the cases that have not ended
        self._left_s = 0.0
        # costs and times of the cases that have ended
        self._expected_s = 0.0
        self._took_s = 0.0
        # parts of the costs of running cases that are done, by name
        self._going_s: dict[str, float] = {}
        # share of the drawing that is done
        self._drawn = 0.0
        # share that was done when cases were last added, and time of the rest, s
        self._before = 0.0
        self._rest_s = after_s
        self._count = 0
        self._ended = 0
        self._looked = -math.inf
        self.done = 0.0
        self._console = Console(
            stderr=True,
            highlight=False,
            markup=False,
            soft_wrap=True,
        )
        # without a thread of its own: a second process draws, see `runs.second`
        self._bar = Progress(
            TextColumn("{task.fields[ended]} cases"),
            BarColumn(),
            TextColumn("{task.description}"),
            console=self._console,
            auto_refresh=False,
        )
        self._task = self._bar.add_task("", total=1.0, ended="")
        self._show()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar.live.is_started:
            self._bar.stop()

    def add(self, todo: Collection[Case]) -> None:
        """Take note of cases that are to be run.

        Parameters
        ----------
        todo
            The cases.
        """
        self._before = self.done
        self._count += len(todo)
        self._left_s += sum(case.cost_s for case in todo)
        self._rest_s = self._left_s / self.workers + self._after_s
        self._start()
        self._show()

    def __call__(
        self,
        case: Case,
        seconds: float,
        error: OrchestratorError | None,
    ) -> None:
        """Take note of a case that has ended."""
        self._ended += 1
        self._going_s.pop(case.name, None)
        self._left_s -= case.cost_s
        if error is None:
            self._expected_s += case.cost_s
            self._took_s += seconds * case.ranks
        state = "failed" if error else "done"
        left = self._show()
        line = f"[{self._ended}/{self._count}] {state}  {case.name}  {left}"
        self._console.print(line)
        is_told = self._failing is None or case.name in self._failing
        told = str(error) if error and is_told else ""
        if error is None:
            told = case_states.said_of(self._cases / case.name)
        if told:
            self._console.print(f"  {told}")

    def watch(self, running: Collection[Case]) -> None:
        """Look how far the running cases are, once a second, for the bar of a terminal.

        Parameters
        ----------
        running
            The cases that run.
        """
        is_due = time.monotonic() > self._looked + LOOK_S
        if not (sys.stderr.isatty() and is_due):
            return
        self._looked = time.monotonic()
        self._going_s = {}
        for case in running:
            share = case.share(self._cases / case.name)
            self._going_s[case.name] = share * case.cost_s
        self._show()

    def drawing(self, part: float, what: str) -> None:
        """Say what is made of the cases, now that all have ended.

        Parameters
        ----------
        part
            Share of the time after the last case that is over.
        what
            What is made next, in words.
        """
        self._drawn = part
        self._start()
        text = self._show()
        self._console.print(f"drawing {what}  {text}")

    def end(self) -> None:
        """Say that all is done."""
        self._drawn = 1.0
        self._console.print(f"all is drawn  {self._show()}")

    def _start(self) -> None:
        """Show the bar, on a terminal."""
        if sys.stderr.isatty() and not self._bar.live.is_started:
            self._bar.start()

    def _show(self) -> str:
        """Show on the bar how far the command is; the same in words."""
        waiting_s = max(0.0, self._left_s - sum(self._going_s.values()))
        cases_s = waiting_s / self.workers
        after_s = (1 - self._drawn) * self._after_s
        pace = self._took_s / self._expected_s if self._took_s else 1.0
        self.left_s = pace * cases_s + after_s
        share = (cases_s + after_s) / self._rest_s if self._rest_s else 0.0
        self.done = 1 - (1 - self._before) * share
        text = f"{self.done:.0%} of the work"
        if self.left_s:
            text += f", about {human(self.left_s)} left"
        self._bar.update(
            self._task,
            completed=self.done,
            ended=f"{self._ended}/{self._count}",
            description=text,
            refresh=self._bar.live.is_started,
        )
        return text


def human(seconds: float) -> str:
    """Write a time for people.

    Parameters
    ----------
    seconds
        The time, s.

    Returns
    -------
    str
        The time in seconds, minutes or hours.

    Examples
    --------
    >>> human(75), human(150), human(9000)
    ('75 s', '2 min', '2.5 h')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
