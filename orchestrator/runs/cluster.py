"""Cases in the jobs of a queue: Slurm, PBS and the others that dask-jobqueue knows."""

import contextlib
import logging
import math
import shlex
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from filelock import FileLock

from orchestrator.errors import InputError, OrchestratorError
from orchestrator.runs import engine, process
from orchestrator.runs.case import PACKAGE, Case, done_state, names_in
from orchestrator.runs.engine import Pool

_NAMES = ("HTCondor", "LSF", "Moab", "OAR", "PBS", "SGE", "SLURM")
SYSTEMS = {name.lower(): f"{name}Cluster" for name in _NAMES}
"""Names of the queues, and dask-jobqueue's classes for them."""
AHEAD = 2
"""Cases handed to a job for each core: no core waits for the next while this process is busy."""
LOST_S = 5.0
"""Time after which a worker without a sign of life is lost, and its job is asked for again, s."""
PATIENCE_S = 60.0
"""Time without a job that has begun until a line says so, s; the next line takes twice as long."""


@dataclass(frozen=True)
class Queue:
    """One of `SYSTEMS`, and the table ``[cluster]`` of the study file: arguments of its class."""

    system: str
    settings: Mapping[str, Any] = field(default_factory=dict)


@contextlib.contextmanager
def pool(queue: Queue, cases: Path, *, workers: int, limit_s: float) -> Iterator[Pool]:
    """Jobs of a queue that run so many solvers at a time; a job that is lost is asked for again.

    Wrong settings are an InputError, and jobs that the queue does not take an OrchestratorError.
    """
    try:
        dask, jobqueue, distributed = map(import_module, ("dask", "dask_jobqueue", "distributed"))
    except ImportError as error:
        what = f"a cluster needs the package's extra [cluster]: {error.name} is not installed"
        remedy = "pip install 'dask-jobqueue>=0.9', with the Python that runs this"
        raise InputError(what, where="--cluster", remedy=remedy) from None
    kind = getattr(jobqueue, SYSTEMS[queue.system])
    cases.mkdir(exist_ok=True)
    logs = str(queue.settings.get("log_directory", cases.parent / "jobs"))
    name = queue.settings.get("config_name", kind.job_cls.config_name)
    given = {**dask.config.get(f"jobqueue.{name}"), **queue.settings}
    # a job begins in an environment of its own, where this package need not be installed
    path = f"export PYTHONPATH={shlex.quote(str(PACKAGE.parent))}:$PYTHONPATH"
    scheduler = {"dashboard": False, "dashboard_address": ":0"}
    settings = {
        **queue.settings,
        "python": given.get("python") or shlex.quote(sys.executable),
        "log_directory": logs,
        "job_script_prologue": [path, *(given.get("job_script_prologue") or [])],
        "scheduler_options": {**scheduler, **queue.settings.get("scheduler_options", {})},
    }
    dask.config.set({"distributed.deploy.lost-worker-timeout": f"{LOST_S}s"})
    try:
        cluster = kind(**settings)
    except (TypeError, ValueError, RuntimeError, OSError) as error:
        what = f"these settings make no jobs: {str(error).splitlines()[0]}"
        remedy = "see [cluster] in the study file, and dask's own configuration of jobqueue"
        raise InputError(what, where="cluster", remedy=remedy) from None
    jobs = math.ceil(workers / int(given["cores"]))
    with cluster, distributed.Client(cluster) as client:
        _submit(cluster, jobs, queue.system, distributed.Status.failed)
        print(f"asked {queue.system} for {jobs} jobs; logs: {logs}", file=sys.stderr)
        # at least as many jobs as at most: it only makes up for those that are lost
        cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
        _await_first(client, Path(logs))
        task = partial(execute_unless_done, cases=cases, limit_s=limit_s)
        places, executor = AHEAD * jobs * int(given["cores"]), client.get_executor(pure=False)
        yield Pool(executor, task, places, (distributed.KilledWorker,))
    for name in names_in(cases):
        (cases / f".{name}.lock").unlink(missing_ok=True)


def execute_unless_done(case: Case, cases: Path, limit_s: float) -> float:
    """Run one case on a machine of the cluster, unless it is done by now; its time, s.

    A worker that was given up as lost, or one of an earlier study, may still be at work on the
    case: this one waits for its end.
    """
    with FileLock(cases / f".{case.name}.lock"):
        state = done_state(case, cases)
        return float(state["wall_s"]) if state else engine.execute(case, cases, limit_s)


def _submit(cluster: Any, jobs: int, system: str, failed: object) -> None:
    """Ask for the jobs, and wait until the queue has taken them."""
    # a connection that closes with its job is no news: distributed logs it with a traceback
    logging.getLogger("distributed.batched").setLevel(logging.WARNING)
    while len(cluster.worker_spec) < jobs:
        cluster.worker_spec.update(cluster.new_worker_spec())
    try:
        # not `scale`, which only logs what the queue answers
        cluster.sync(lambda: cluster)
    except (RuntimeError, OSError, ValueError) as error:
        for job in cluster.workers.values():
            job.status = failed  # else the cluster's end trips over jobs that never began
        what = f"{system} does not take the job: {' '.join(str(error).split())}"
        remedy = "see [cluster] in the study file; this machine must be one that may submit jobs"
        raise OrchestratorError(what, "--cluster", remedy) from None


def _await_first(client: Any, logs: Path) -> None:
    """Wait for the first job to begin; where that takes long, repeat the end of its log."""
    patience = PATIENCE_S
    while True:
        try:
            client.wait_for_workers(1, timeout=patience)
            return
        except TimeoutError:
            newest = sorted(logs.glob("*"), key=lambda path: path.stat().st_mtime, reverse=True)
            words = ((path.name, process.last_words(path)) for path in newest)
            hint = next((f"{name} says: {text}" for name, text in words if text), "ask the queue")
            print(f"no job has begun for {patience:.0f} s; {hint}", file=sys.stderr)
            patience *= 2
