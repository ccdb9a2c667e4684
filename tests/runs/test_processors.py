"""As many cases run at a time as there are processors that the process may use."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from orchestrator.runs import processors

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def eight(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that is bound to eight processors of a larger machine, in no job."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)
    for of_job, names in processors.JOBS:
        for name in (of_job, *names):
            monkeypatch.delenv(name or "none", raising=False)


def _written(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


V2 = "sys/fs/cgroup"
V1 = "sys/fs/cgroup/cpu,cpuacct"
DOCKER = {f"{V1}/cpu.cfs_quota_us": "300000\n", f"{V1}/cpu.cfs_period_us": "100000\n"}


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({}, 8),
        ({"proc/self/cgroup": "0::/\n", f"{V2}/cpu.max": "max 100000\n"}, 8),
        ({"proc/self/cgroup": "0::/\n", f"{V2}/cpu.max": "200000 100000\n"}, 2),
        ({"proc/self/cgroup": "0::/\n", f"{V2}/cpu.max": "250000 100000\n"}, 2),
        ({"proc/self/cgroup": "0::/\n", f"{V2}/cpu.max": "50000 100000\n"}, 1),
        ({"proc/self/cgroup": "0::/\n", f"{V2}/cpu.max": "9900000 100000\n"}, 8),
        # the limit of a group that this one is in holds, too
        (
            {
                "proc/self/cgroup": "0::/job_1/step_0\n",
                f"{V2}/job_1/cpu.max": "400000 100000\n",
                f"{V2}/job_1/step_0/cpu.max": "max 100000\n",
            },
            4,
        ),
        ({"proc/self/cgroup": "4:cpu,cpuacct:/\n", **DOCKER}, 3),
        # the path is that of the machine, what is mounted is the group itself
        (
            {"proc/self/cgroup": "3:memory:/a\n4:cpu,cpuacct:/docker/0a1b\n", **DOCKER},
            3,
        ),
        (
            {
                "proc/self/cgroup": "4:cpu:/a\n",
                "sys/fs/cgroup/cpu/a/cpu.cfs_quota_us": "-1\n",
                "sys/fs/cgroup/cpu/a/cpu.cfs_period_us": "100000\n",
            },
            8,
        ),
    ],
)
def test_the_quota_of_a_control_group_counts(
    tmp_path: Path, files: dict[str, str], expected: int
) -> None:
    assert processors.usable_count(_written(tmp_path, files)) == expected


@pytest.mark.parametrize(
    ("job", "expected"),
    [
        ({"SLURM_CPUS_PER_TASK": "4", "SLURM_CPUS_ON_NODE": "6"}, 4),
        ({"SLURM_CPUS_ON_NODE": "6"}, 6),
        ({"SLURM_CPUS_ON_NODE": "128"}, 8),
        ({"SLURM_CPUS_PER_TASK": ""}, 8),
        ({"PBS_JOBID": "12.server", "NCPUS": "4"}, 4),
        ({"PBS_JOBID": "12.server", "PBS_NUM_PPN": "3"}, 3),
        ({"NCPUS": "4"}, 8),
        ({"JOB_ID": "12", "NSLOTS": "5"}, 5),
        ({"LSB_JOBID": "12", "LSB_DJOB_NUMPROC": "6"}, 6),
        ({"SLURM_CPUS_PER_TASK": "0"}, 1),
    ],
)
def test_the_processors_of_a_job_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, job: dict[str, str], expected: int
) -> None:
    for name, value in job.items():
        monkeypatch.setenv(name, value)
    assert processors.usable_count(tmp_path) == expected


def test_a_system_that_binds_no_process_has_all_processors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 5)
    assert processors.usable_count(tmp_path) == 5


COMMAND = """
from orchestrator import cli
raise SystemExit(cli.main(["study", "first-look", "--plan"]))
"""
FACE = """
from orchestrator import face, pipeline
def run(*_, workers):
    raise SystemExit(print(f"with {workers} worker"))
pipeline.run = run
face.run("first-look")
"""


BOUND = "import os; os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])\n"


@pytest.mark.parametrize("code", [COMMAND, FACE], ids=["command", "python"])
@pytest.mark.parametrize(
    ("before", "job"),
    [(BOUND, {}), ("", {"SLURM_CPUS_PER_TASK": "1"})],
    ids=["bound", "in a job"],
)
def test_a_study_has_a_worker_for_each_processor_that_it_may_use(
    tmp_path: Path, code: str, before: str, job: dict[str, str]
) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", before + code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), **job},
        capture_output=True,
        text=True,
        check=False,
    )
    assert re.search(r"with 1 worker\b", ended.stdout), ended
