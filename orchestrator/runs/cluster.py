"""Cases in the jobs of a queue: Slurm, PBS and the others that dask-jobqueue knows."""

import contextlib
import fcntl
import importlib
import inspect
import math
import shlex
import shutil
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from orchestrator.errors import InputError, OrchestratorError, unknown_key
from orchestrator.runs import assets, engine, lock, process
from orchestrator.runs.case import Case, done_state, names_in
from orchestrator.runs.engine import Pool

SYSTEMS = {
    "htcondor": "HTCondorCluster",
    "lsf": "LSFCluster",
    "moab": "MoabCluster",
    "oar": "OARCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "slurm": "SLURMCluster",
}
"""Names of the queues, and dask-jobqueue's classes for them."""
OURS = {
    "self",
    "scheduler",
    "name",
    "n_workers",
    "job_cls",
    "loop",
    "asynchronous",
    "scheduler_cls",
}
"""Arguments of those classes that are no settings of a queue."""
AHEAD = 2
"""Cases handed to a job for each core: no core waits for the next while this process is busy."""
LOST_S = 5.0
"""A worker that was not heard of for this long is gone: its job is asked for again."""
AWKWARD = frozenset(" \t\n'\"\\$`%#")
"""Characters of a path that the head of a job's script cannot hold."""
PATIENCE_S = 60.0
"""After this long without a job that has begun, a line says so; after twice as long again."""


@dataclass(frozen=True)
class Queue:
    """Where jobs are asked for, and how.

    Attributes
    ----------
    system : str
        One of SYSTEMS.
    settings : mapping
        The table ``[cluster]`` of the study file: arguments of dask-jobqueue's class.
    """

    system: str
    settings: Mapping[str, Any] = field(default_factory=dict)


@contextlib.contextmanager
def pool(queue: Queue, cases: Path, *, workers: int, limit_s: float) -> Iterator[Pool]:
    """Jobs of a queue, for as long as the block runs; a job that is lost is asked for again.

    Parameters
    ----------
    queue : Queue
        Where the jobs are asked for.
    cases : Path
        The directory of the study's cases, which all machines see.
    workers : int
        How many solvers run at a time, in as many jobs as that takes.
    limit_s : float
        Wall time after which a run counts as hung, s.

    Raises
    ------
    InputError
        If a setting is missing or wrong.
    OrchestratorError
        If the queue does not take the jobs.
    """
    jobqueue, distributed = _libraries()
    kind = getattr(jobqueue, SYSTEMS[queue.system])
    cases.mkdir(exist_ok=True)
    settings = _settings(kind, queue.settings, cases.parent)
    with _opened(kind, settings) as cluster, distributed.Client(cluster) as client:
        cores = _cores(kind, settings)
        jobs = math.ceil(workers / cores)
        _submit(cluster, jobs, queue.system)
        print(
            f"asked {queue.system} for {jobs} jobs; logs: {settings['log_directory']}",
            file=sys.stderr,
        )
        # at least as many jobs as at most: it only makes up for those that are lost
        cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
        _await_first(client, Path(settings["log_directory"]))
        yield Pool(
            client.get_executor(pure=False),
            partial(execute_alone, cases=cases, limit_s=limit_s),
            places=AHEAD * jobs * cores,
            lost=(distributed.KilledWorker,),
        )
    for name in names_in(cases):
        (cases / f".{name}.lock").unlink(missing_ok=True)


def execute_alone(case: Case, cases: Path, limit_s: float) -> float:
    """Run one case on a machine of the cluster, unless it is done by now; what it took, s.

    A worker that was given up as lost may still be at work on it, and so may be one of an earlier
    study's: until that has ended, this one waits.
    """
    with lock.open_file(cases / f".{case.name}.lock") as stream:
        # a file system without locks leaves it to the queue to end what it cancelled
        with contextlib.suppress(OSError):
            fcntl.flock(stream, fcntl.LOCK_EX)
        state = done_state(case, cases)
        return float(state["wall_s"]) if state else engine.execute(case, cases, limit_s)


def _libraries() -> tuple[Any, Any]:
    try:
        return importlib.import_module("dask_jobqueue"), importlib.import_module("distributed")
    except ImportError as error:
        raise InputError(
            f"a cluster needs the package's extra [cluster]: {error.name} is not installed",
            where="--cluster",
            remedy="pip install 'dask-jobqueue>=0.9', with the Python that runs this",
        ) from None


def _settings(kind: Any, given: Mapping[str, Any], root: Path) -> dict[str, Any]:
    """Arguments for dask-jobqueue: the settings given, and those that no study needs to give."""
    known = _known(kind)
    for key in given:
        if key not in known:
            raise unknown_key(key, sorted(known), f"cluster.{key}")
    import dask

    # a job begins in an environment of its own, where this package need not be installed
    path = shlex.quote(str(assets.PACKAGE.parent))
    python = dask.config.get(f"jobqueue.{_configuration(kind, given)}.python", None)
    prologue = [f"export PYTHONPATH={path}:$PYTHONPATH", *given.get("job_script_prologue", [])]
    scheduler = {"dashboard": False, "dashboard_address": ":0"} | given.get("scheduler_options", {})
    logs = str(given.get("log_directory", root / "jobs"))
    _check_logs(logs)
    return {
        "python": python or shlex.quote(sys.executable),
        **given,
        "log_directory": logs,
        "job_script_prologue": prologue,
        "scheduler_options": scheduler,
    }


def _check_logs(directory: str) -> None:
    found = sorted(AWKWARD.intersection(directory))
    if found:
        raise InputError(
            f"jobs cannot write logs into {directory}: it has {' '.join(map(repr, found))} in it",
            where="cluster.log_directory",
            remedy="name a directory without these there; the study's own may stay as it is",
        )


def _known(kind: Any) -> set[str]:
    classes = (*kind.__mro__, *kind.job_cls.__mro__)
    inits = [one.__init__ for one in classes if one.__module__.startswith("dask_jobqueue")]
    return {name for init in inits for name in inspect.signature(init).parameters} - OURS


def _opened(kind: Any, settings: Mapping[str, Any]) -> Any:
    import dask

    submit = kind.job_cls.submit_command.split()[0]
    if not shutil.which(submit):
        raise OrchestratorError(
            f"there is no {submit} on this machine",
            where="--cluster",
            remedy="run the command on a machine that may ask the queue for jobs",
        )
    dask.config.set({"distributed.deploy.lost-worker-timeout": f"{LOST_S}s"})
    try:
        return kind(**settings)
    except (TypeError, ValueError, RuntimeError, OSError) as error:
        raise InputError(
            f"these settings make no jobs: {str(error).splitlines()[0]}",
            where="cluster",
            remedy="see [cluster] in the study file, and dask's own configuration of jobqueue",
        ) from None


def _cores(kind: Any, settings: Mapping[str, Any]) -> int:
    import dask

    name = _configuration(kind, settings)
    return int(settings.get("cores") or dask.config.get(f"jobqueue.{name}.cores"))


def _configuration(kind: Any, settings: Mapping[str, Any]) -> str:
    """Name of a queue in dask's own configuration."""
    return str(settings.get("config_name", kind.job_cls.config_name))


def _await_first(client: Any, logs: Path) -> None:
    """Wait for the first job to begin; where that takes long, say so, and what its log says."""
    patience = PATIENCE_S
    while True:
        try:
            client.wait_for_workers(1, timeout=patience)
            return
        except TimeoutError:
            said = _last_words(logs)
            print(f"no job has begun for {patience:.0f} s; {said}", file=sys.stderr)
            patience *= 2


def _last_words(logs: Path) -> str:
    """The last line of the newest log that holds one."""
    newest = sorted(logs.glob("*"), key=lambda path: path.stat().st_mtime, reverse=True)
    said = ((path.name, process.last_words(path)) for path in newest)
    return next((f"{name} says: {words}" for name, words in said if words), "ask the queue why")


def _submit(cluster: Any, jobs: int, system: str) -> None:
    """Ask for the jobs, and wait until the queue has taken them."""
    from distributed import Status

    while len(cluster.worker_spec) < jobs:
        cluster.worker_spec.update(cluster.new_worker_spec())
    try:
        # not `scale`, which only logs what the queue answers
        cluster.sync(lambda: cluster)
    except (RuntimeError, OSError, ValueError) as error:
        for job in cluster.workers.values():
            # else the cluster's end trips over jobs that never began
            job.status = Status.failed
        said = " ".join(str(error).split())
        raise OrchestratorError(
            f"{system} does not take the job: {said}",
            where="--cluster",
            remedy="see [cluster] in the study file",
        ) from None
