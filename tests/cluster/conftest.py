"""A Slurm of two nodes for the tests of this folder, and a study to run on it."""

import importlib.util
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.cluster import slurm
from tests.cluster.slurm import Slurm
from tests.conftest import Shared
from tests.faults.bench import ORCHESTRATOR, ROOT, tables, undisturbed

STUDY = """
time_limit = 100
[protocol]
load_increment = 0.006
waiting_time = 3.0
[grain]
diameter = 1e-3
stiffness = 1e3
[bed]
kind = "pile"
height = 0.01
slope_deg = 15.0
mobile_layers = 1
packing = "disordered"
[flow]
cells_per_face = 20
[axes]
"bed.seed" = [1, 2, 3]
[cluster]
cores = 1
memory = "500MB"
interface = "lo"
"""
Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture(scope="session")
def queue(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Slurm]:
    """Two nodes of one core."""
    lacking = slurm.missing()
    if importlib.util.find_spec("dask_jobqueue") is None:
        lacking.append("dask-jobqueue")
    if lacking:
        stop = pytest.fail if os.environ.get("SKIP_NOTHING") else pytest.skip
        stop(f"without {', '.join(lacking)}; `sh tools/setup.sh test` installs all")
    with slurm.running(tmp_path_factory.mktemp("slurm") / "root", nodes=2, cores=1) as started:
        yield started


@pytest.fixture
def start(tmp_path: Path, queue: Slurm) -> Iterator[Start]:
    """Start the command line in a process of its own that finds the queue."""
    started: list[subprocess.Popen[str]] = []
    (tmp_path / "small.toml").write_text(STUDY)
    env, pipe = {**queue.environment, "PYTHONPATH": str(ROOT)}, subprocess.PIPE

    def run(*arguments: str) -> "subprocess.Popen[str]":
        command = [*ORCHESTRATOR, *arguments]
        started.append(
            subprocess.Popen(command, cwd=tmp_path, env=env, stdout=pipe, stderr=pipe, text=True)
        )
        return started[-1]

    yield run
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture(scope="session")
def local_tables(shared: Shared) -> dict[str, bytes]:
    """The tables of the study as this machine alone makes them."""
    with shared("local") as folder:
        return tables(undisturbed(folder, STUDY))
