"""What sites refuse, by a queue of commands that refuses it, and the files of the guide for them.

The commands run the jobs on this machine; `test_cluster.py` has a real Slurm.
"""

import importlib
import importlib.util
import os
import re
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from orchestrator.errors import OrchestratorError
from orchestrator.runs import cluster, engine, processors
from orchestrator.runs.case import Case
from orchestrator.runs.queues import Queue
from tests.waiting import HANGS_S, until

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("dask_jobqueue") is None, reason="without dask-jobqueue"
)
GUIDE = Path(__file__).parents[2] / "docs" / "cluster.md"
SMALL = {"cores": 1, "memory": "500MB", "interface": "lo"}
SITES = {
    "No `--mem`": ("", "--mem", "--mem is not allowed: nodes are whole"),
    "`--mem-per-cpu`": ("--mem-per-cpu=2G", "--mem=", "--mem-per-cpu is missing"),
    "An account": ("-A p1234", "nothing", "Invalid account or account/partition"),
    "A partition": ("-p batch", "nothing", "invalid partition specified: none"),
    "Whole nodes": ("--exclusive", "--cpus-per-task", "jobs are of whole nodes"),
}
"""Of each site what a job must ask for, what it must not, and what it is told else."""
SBATCH = """#!/bin/sh
head=$(grep '^#SBATCH' "$1")
has() { printf '%s\\n' "$head" | grep -q -e "$1"; }
if ! has "{must}" || has "{must_not}"; then
    echo "sbatch: error: {told}" >&2
    exit 1
fi
job=$((4711 + $(ls {root}/jobs | wc -l)))
log=$(printf '%s\\n' "$head" | sed -n "s/^#SBATCH -e //p" | sed "s/%J/$job/")
cp "$1" {root}/script-$job
{run}
echo $! >{root}/jobs/$job
echo "Submitted batch job $job"
"""
RUN = 'setsid sh {root}/script-$job >/dev/null 2>"$log" &'
WAIT = "true &"
SCANCEL = """#!/bin/sh
for job; do kill -KILL -- "-$(cat {root}/jobs/$job)" 2>/dev/null; done
exit 0
"""
SQUEUE = """#!/bin/sh
for job in $(ls {root}/jobs); do echo "$job PENDING, AssocMaxJobsLimit"; done
echo "9999 RUNNING, None"
"""


class Site:
    """A queue of commands, first in PATH, that refuses what a site refuses."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = root
        (root / "jobs").mkdir(parents=True)
        monkeypatch.setenv("PATH", f"{root}{os.pathsep}{os.environ['PATH']}")
        self._write("scancel", SCANCEL)
        self._write("squeue", SQUEUE)

    def asks(self, must: str, must_not: str, told: str, run: str = RUN) -> None:
        """Have `sbatch` refuse jobs without one directive, and those with another."""
        run = run.replace("{root}", str(self.root))
        self._write("sbatch", SBATCH, must=must, must_not=must_not, told=told, run=run)

    def _write(self, name: str, text: str, **words: str) -> None:
        for word, value in {**words, "root": str(self.root)}.items():
            text = text.replace(f"{{{word}}}", value)
        (self.root / name).write_text(text)
        (self.root / name).chmod(0o755)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    return Site(tmp_path / "queue", monkeypatch)


def _files_of_the_guide() -> dict[str, dict[str, Any]]:
    """The study files of the guide, by the headings above them."""
    found = {}
    parts = re.split(r"(?m)^### ", GUIDE.read_text(encoding="utf-8"))[1:]
    for part in parts:
        block = re.search(r"```toml\n(.*?)```", part, flags=re.DOTALL)
        if block is not None:
            found[part.splitlines()[0]] = tomllib.loads(block[1])["cluster"]
    return found


def _ran(settings: dict[str, Any], folder: Path) -> int:
    """The process of a task that a job of these settings has run."""
    queue = Queue("slurm", settings)
    with cluster.pool(queue, folder / "cases", workers=1, limit_s=HANGS_S) as pool:
        return int(pool.executor.submit(os.getpid).result())


def test_the_guide_has_a_file_for_each_site() -> None:
    assert _files_of_the_guide().keys() == SITES.keys()


@pytest.mark.parametrize("name", SITES)
def test_a_site_takes_the_jobs_of_its_file_and_no_others(
    site: Site, tmp_path: Path, name: str
) -> None:
    site.asks(*SITES[name])
    with pytest.raises(OrchestratorError) as refused:
        _ran(SMALL, tmp_path)
    message = str(refused.value)
    assert f"sbatch: error: {SITES[name][2]}" in message
    assert message.isprintable()
    assert "docs/cluster.md" in message
    settings = {**_files_of_the_guide()[name], **SMALL}
    assert _ran(settings, tmp_path) != os.getpid()


@pytest.mark.parametrize(
    ("settings", "run", "told"),
    [
        ({}, WAIT, "slurm says: job 4711 PENDING, AssocMaxJobsLimit"),
        (
            {"job_script_prologue": ["echo no such module >&2; exit 1"]},
            RUN,
            "dask-worker-4711.err says: no such module",
        ),
    ],
    ids=["waits in the queue", "ends before Python starts"],
)
def test_a_job_that_never_runs_says_why(
    site: Site,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    settings: dict[str, Any],
    run: str,
    told: str,
) -> None:
    site.asks("", "nothing", "", run)
    monkeypatch.setattr(cluster, "PATIENCE_S", 0.5)
    monkeypatch.setattr(cluster, "LOOK_S", 0.1)
    queue = Queue("slurm", {**SMALL, **settings})
    printed = ""

    def is_told() -> bool:
        nonlocal printed
        printed += capsys.readouterr().err
        return told in printed

    with cluster.pool(queue, tmp_path / "cases", workers=1, limit_s=HANGS_S):
        until(is_told)
    assert re.search(r"no job has run for \d+ s; ", printed)
    assert "9999" not in printed


@pytest.mark.parametrize(
    ("threads", "cores", "usable", "expected"),
    [(8, 8, 8, 8), (8, 8, 4, 4), (4, 16, 16, 4), (4, 16, 8, 2), (1, 4, 1, 1)],
)
def test_a_job_with_fewer_cores_than_it_asked_for_runs_fewer_solvers(
    monkeypatch: pytest.MonkeyPatch,
    threads: int,
    cores: int,
    usable: int,
    expected: int,
) -> None:
    monkeypatch.setattr(processors, "usable_count", lambda: usable)
    held: list[int] = []
    monkeypatch.setattr(engine, "Cores", held.append)
    cluster._share_of.__wrapped__(threads, cores)
    assert held == [expected]


def test_jobs_have_as_many_cores_as_solvers_and_settings_of_the_study_come_first(
    site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import dask

    # its defaults are there before others are set
    importlib.import_module("dask_jobqueue")
    site.asks("", "nothing", "")
    queue = Queue("slurm", {**SMALL, "cores": 2})
    with (
        dask.config.set({"jobqueue.slurm.cores": 5}),
        cluster.pool(queue, tmp_path / "cases", workers=3, limit_s=HANGS_S) as pool,
    ):
        # two cases ahead for each of the four cores
        assert pool.places == 8
    assert "asked slurm for 2 jobs" in capsys.readouterr().err


def test_a_case_that_another_job_has_done_does_not_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def runs(*_: object, **__: object) -> float:
        raise AssertionError

    monkeypatch.setattr(cluster, "done_state", lambda *_: {"wall_s": "7.5"})
    monkeypatch.setattr(engine, "execute", runs)
    case = cast(Case, SimpleNamespace(name="case"))
    assert cluster.execute_unless_done(case, tmp_path, 1.0, 1) == 7.5
