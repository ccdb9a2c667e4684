"""Cases in the jobs of a queue: Slurm, PBS and the others that dask-jobqueue knows."""

import contextlib
import logging
import math
import shlex
import subprocess
import sys
import threading
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError, OrchestratorError
from orchestrator.extras import imported
from orchestrator.runs import engine, locks, process, processors
from orchestrator.runs.case import Case, done_state, names_in
from orchestrator.runs.engine import Pool
from orchestrator.runs.files import PACKAGE
from orchestrator.runs.queues import REASONS, SYSTEMS, Queue

EXTRA = "cluster"
"""The extra of the package with dask-jobqueue."""
AHEAD = 2
"""Cases handed to a job for each core.

No core waits for the next case while this process is busy.
"""
ONE_PROCESS = 8
"""Cores of a job up to which one process of Python hands them to solvers.

Those of more are shared by several: a case that takes two cores needs both of one.
"""
LOST_S = 5.0
"""Time without a sign of life after which a worker is lost, s.

Its job is asked for again.
"""
LOOK_S = 1.0
"""Time between two looks whether a job runs, s."""
ASKED_S = 20.0
"""Time that a queue may take to say why jobs wait, s."""
PATIENCE_S = 60.0
"""Time without a job that runs until a line says why, s.

Until the next line it is twice as long.
"""


@contextlib.contextmanager
def pool(queue: Queue, cases: Path, *, workers: int, limit_s: float) -> Iterator[Pool]:
    """Make a pool of the jobs of a queue; a job that is lost is asked for again.

    Parameters
    ----------
    queue
        The queue.
    cases
        Directory of the cases.
    workers
        Number of solvers that run at a time.
    limit_s
        Time that a solver may take, s.

    Yields
    ------
    Pool
        The pool.

    Raises
    ------
    InputError
        If the settings make no jobs, or dask-jobqueue is not installed.
    OrchestratorError
        If the queue does not take the jobs.
    """
    dask = imported("dask", EXTRA, "--cluster")
    jobqueue = imported("dask_jobqueue", EXTRA, "--cluster")
    distributed = imported("distributed", EXTRA, "--cluster")
    cases.mkdir(exist_ok=True)
    kind = getattr(jobqueue, SYSTEMS[queue.system])
    name = queue.settings.get("config_name", kind.job_cls.config_name)
    # dask's own configuration of this queue, and over it the study's settings
    given = {**dask.config.get(f"jobqueue.{name}"), **queue.settings}
    logs = str(queue.settings.get("log_directory", cases.parent / "jobs"))
    dask.config.set({"distributed.deploy.lost-worker-timeout": f"{LOST_S}s"})
    cluster = _made(kind, _settings(queue, given, logs))
    cores = int(given["cores"])
    jobs = math.ceil(workers / cores)
    with cluster, distributed.Client(cluster) as client:
        _submit(cluster, jobs, queue.system, distributed.Status.failed)
        print(f"asked {queue.system} for {jobs} jobs; logs: {logs}", file=sys.stderr)
        # at least as many jobs as at most: it only makes up for those that are lost
        cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
        task = partial(execute_unless_done, cases=cases, limit_s=limit_s, cores=cores)
        with _waits_told(cluster, queue.system, Path(logs)):
            yield Pool(
                executor=client.get_executor(pure=False),
                task=task,
                places=AHEAD * jobs * cores,
                lost=(distributed.KilledWorker,),
            )
    for case in names_in(cases):
        _lock_of(case, cases).unlink(missing_ok=True)


def _settings(queue: Queue, given: Mapping[str, Any], logs: str) -> dict[str, Any]:
    """Arguments of dask-jobqueue's class: those of the study, and ours beside them."""
    # a job begins in an environment of its own, which need not have this package
    folder = shlex.quote(str(PACKAGE.parent))
    prologue = [f"export PYTHONPATH={folder}:$PYTHONPATH"]
    prologue += given.get("job_script_prologue") or []
    scheduler = {
        "dashboard": False,
        "dashboard_address": ":0",
        **queue.settings.get("scheduler_options", {}),
    }
    processes = given.get("processes")
    if processes is None and int(given["cores"] or 0) <= ONE_PROCESS:
        processes = 1
    return {
        **queue.settings,
        "processes": processes,
        "python": given.get("python") or shlex.quote(sys.executable),
        "log_directory": logs,
        "job_script_prologue": prologue,
        "scheduler_options": scheduler,
    }


def _made(kind: Any, settings: Mapping[str, Any]) -> Any:
    """A cluster of dask-jobqueue; an InputError if it cannot be made."""
    try:
        return kind(**settings)
    except (TypeError, ValueError, RuntimeError, OSError) as error:
        first_line = str(error).splitlines()[0]
        configuration = "dask's own configuration of jobqueue"
        raise InputError(
            f"these settings make no jobs: {first_line}",
            where="cluster",
            remedy=f"see [cluster] in the study file, and {configuration}",
        ) from None


def _lock_of(case: str, cases: Path) -> Path:
    """The lock of a case, by its name."""
    return cases / f".{case}.lock"


def execute_unless_done(case: Case, cases: Path, limit_s: float, cores: int) -> float:
    """Run one case on a machine of the cluster, unless it is done by now.

    A worker that was given up as lost, or one of an earlier study, may still be at work
    on the case: this one waits for its end.

    Parameters
    ----------
    case
        The case.
    cases
        Directory of the cases.
    limit_s
        Time that the solver may take, s.
    cores
        The cores that a job asks for.

    Returns
    -------
    float
        Its time, s.
    """
    from distributed import get_worker

    lock = _lock_of(case.name, cases)
    # the other one's solver is killed after that time; what it leaves is read quickly
    waits_s = 2 * limit_s
    else_ = "wait for its end, then give the same command again"
    with locks.lock_held(lock, limit_s=waits_s, else_=else_):
        state = done_state(case, cases)
        if state:
            return float(state["wall_s"])
        share = _share_of(get_worker().state.nthreads, cores)
        return engine.execute(case, cases, limit_s, cores=share)


@cache
def _share_of(threads: int, cores: int) -> engine.Cores:
    """The cores that a process of a job gives to solvers.

    They are those of its threads, or fewer where the machine has given fewer to the job
    than it asked for.
    """
    given = processors.usable_count() * threads // cores
    return engine.Cores(max(1, min(threads, given)))


def _submit(cluster: Any, jobs: int, system: str, failed: object) -> None:
    """Ask for the jobs, and wait until the queue has taken them.

    `failed` is the status of a job that does not begin.
    """
    # a connection that closes with its job is no news, but is logged with a traceback
    logging.getLogger("distributed.batched").setLevel(logging.WARNING)
    while len(cluster.worker_spec) < jobs:
        cluster.worker_spec.update(cluster.new_worker_spec())
    try:
        # not `scale`, which only logs what the queue answers
        cluster.sync(lambda: cluster)
    except (RuntimeError, OSError, ValueError) as error:
        for job in cluster.workers.values():
            # else the cluster's end trips over jobs that never began
            job.status = failed
        cause = " ".join(str(error).split())
        machine = "this machine must be one that may submit jobs"
        raise OrchestratorError(
            f"{system} does not take the job: {cause}",
            where="--cluster",
            remedy=f"see [cluster] in the study file, docs/cluster.md; {machine}",
        ) from None


@contextlib.contextmanager
def _waits_told(cluster: Any, system: str, logs: Path) -> Iterator[None]:
    """Say from time to time why no job runs, while there is none."""
    over = threading.Event()

    def watch() -> None:
        patience_s = PATIENCE_S
        since = time.monotonic()
        while not over.wait(LOOK_S):
            waited_s = time.monotonic() - since
            if cluster.scheduler.workers:
                patience_s, since = PATIENCE_S, time.monotonic()
            elif waited_s > patience_s:
                ids = [job.job_id for job in [*cluster.workers.values()]]
                hint = why_waiting(system, ids, logs)
                print(f"no job has run for {waited_s:.0f} s; {hint}", file=sys.stderr)
                patience_s *= 2

    thread = threading.Thread(target=watch, daemon=True, name="queue")
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def why_waiting(system: str, ids: Collection[str | None], logs: Path) -> str:
    """Say why jobs do not run, in the words of the queue and of their logs.

    Parameters
    ----------
    system
        One of `SYSTEMS`.
    ids
        Their numbers.
    logs
        The directory of their logs.

    Returns
    -------
    str
        The words; what to do where there are none.
    """
    said = [
        f"{system} says: job {line}"
        for line in _asked(REASONS.get(system, ()))
        if line.partition(" ")[0] in ids
    ]
    last = _last_words_of_jobs(logs)
    return "; ".join([*said, *([last] if last else [])]) or "ask the queue"


def _asked(command: Sequence[str]) -> list[str]:
    """The lines that a command of the queue prints; none if it does not work."""
    if not command:
        return []
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        return subprocess.check_output(
            command, text=True, timeout=ASKED_S, stderr=subprocess.DEVNULL
        ).splitlines()
    return []


def _last_words_of_jobs(logs: Path) -> str:
    """The end of the newest log of a job that says something; empty if none does."""
    newest = sorted(logs.glob("*"), key=_time_of_change, reverse=True)
    for path in newest:
        text = process.last_words(path)
        if text:
            return f"{path.name} says: {text}"
    return ""


def _time_of_change(path: Path) -> float:
    """Time of the last change of a file, s."""
    return path.stat().st_mtime
