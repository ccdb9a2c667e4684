"""Cases in the jobs of a queue: Slurm, PBS and the others that dask-jobqueue knows."""

import contextlib
import logging
import math
import shlex
import sys
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError, OrchestratorError
from orchestrator.extras import imported
from orchestrator.runs import engine, locks, process
from orchestrator.runs.case import Case, done_state, names_in
from orchestrator.runs.engine import Pool
from orchestrator.runs.files import PACKAGE
from orchestrator.runs.queues import SYSTEMS, Queue

EXTRA = "cluster"
"""The extra of the package with dask-jobqueue."""
AHEAD = 2
"""Cases handed to a job for each core.

No core waits for the next case while this process is busy.
"""
LOST_S = 5.0
"""Time without a sign of life after which a worker is lost, s.

Its job is asked for again.
"""
PATIENCE_S = 60.0
"""Time without a job that has begun until a line says so, s.

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
        _await_first(client, Path(logs))
        yield Pool(
            executor=client.get_executor(pure=False),
            task=partial(execute_unless_done, cases=cases, limit_s=limit_s),
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
    return {
        **queue.settings,
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


def execute_unless_done(case: Case, cases: Path, limit_s: float) -> float:
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

    Returns
    -------
    float
        Its time, s.
    """
    lock = _lock_of(case.name, cases)
    # the other one's solver is killed after that time; what it leaves is read quickly
    waits_s = 2 * limit_s
    else_ = "wait for its end, then give the same command again"
    with locks.held(lock, limit_s=waits_s, else_=else_):
        state = done_state(case, cases)
        if state:
            return float(state["wall_s"])
        return engine.execute(case, cases, limit_s)


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
            remedy=f"see [cluster] in the study file; {machine}",
        ) from None


def _await_first(client: Any, logs: Path) -> None:
    """Wait for the first job to begin; where that takes long, say so."""
    patience_s = PATIENCE_S
    while True:
        try:
            client.wait_for_workers(1, timeout=patience_s)
            return
        except TimeoutError:
            hint = _last_words_of_jobs(logs) or "ask the queue"
            waited = f"no job has begun for {patience_s:.0f} s"
            print(f"{waited}; {hint}", file=sys.stderr)
            patience_s *= 2


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
