"""A study on a real Slurm of two nodes: the same bytes, whatever happens to its jobs."""

import re
import subprocess
from pathlib import Path

import pytest

from tests.cluster.conftest import Start
from tests.cluster.slurm import Slurm, until
from tests.conftest import Command
from tests.faults.bench import processes_in, tables

Bytes = dict[str, bytes]
ON_SLURM = ("study", "small.toml", "--out", "out", "--cluster", "slurm", "--workers", "2")


def _at_work(cases: Path) -> set[str]:
    """Cases that a solver of LIGGGHTS is in the middle of."""
    begun = {path.parent.name for path in cases.glob("pile-*/samples.csv")}
    return begun - {path.parent.name for path in cases.glob("*/done.json")}


def _end(driver: "subprocess.Popen[str]") -> None:
    _, said = driver.communicate(timeout=400)
    assert driver.returncode == 0, said
    assert "Traceback" not in said, said


def test_two_nodes(start: Start, queue: Slurm, tmp_path: Path, local_tables: Bytes) -> None:
    _end(start(*ON_SLURM))
    assert tables(tmp_path / "out") == local_tables
    logs = "".join(path.read_text() for path in (tmp_path / "out" / "jobs").glob("*.err"))
    assert "ON n1" in logs
    assert "ON n2" in logs
    assert not list((tmp_path / "out" / "cases").glob(".*"))
    until(lambda: not queue.jobs(), "the end of the jobs")


def test_a_cancelled_job(start: Start, queue: Slurm, tmp_path: Path, local_tables: Bytes) -> None:
    cases, driver = tmp_path / "out" / "cases", start(*ON_SLURM)
    until(lambda: _at_work(cases), "a solver")
    queue.says("scancel", *queue.jobs())
    _end(driver)
    assert tables(tmp_path / "out") == local_tables
    assert not processes_in(cases)


def test_a_killed_driver(start: Start, tmp_path: Path, local_tables: Bytes) -> None:
    cases, driver = tmp_path / "out" / "cases", start(*ON_SLURM)
    until(lambda: list(cases.glob("pile-*/done.json")) and _at_work(cases), "a second solver")
    before = {path: path.stat().st_mtime_ns for path in cases.glob("*/done.json")}
    driver.kill()
    driver.communicate()
    _end(start(*ON_SLURM))
    assert tables(tmp_path / "out") == local_tables
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert not processes_in(cases)


REFUSED = {
    'memmory = "1GB"': "memmory",
    'queue = "nowhere"': "slurm does not take the job: .*invalid partition",
    'interface = "none0"': "none0",
}


@pytest.mark.parametrize("settings", REFUSED)
def test_settings_without_jobs(start: Start, tmp_path: Path, settings: str) -> None:
    path = tmp_path / "small.toml"
    text = path.read_text().replace('interface = "lo"', "")
    path.write_text(text + ("" if "interface" in settings else 'interface = "lo"\n') + settings)
    driver = start(*ON_SLURM)
    _, printed = driver.communicate(timeout=300)
    assert driver.returncode not in (0, None)
    (line,) = (line for line in printed.splitlines() if line.startswith("orchestrator"))
    assert re.search(REFUSED[settings], line)
    assert "[cluster]" in line
    assert "Traceback" not in printed


def test_without_the_extra_one_line_says_what_to_install(
    tmp_path: Path, orchestrator: Command
) -> None:
    (tmp_path / "x.toml").write_text("grain.diameter = 1e-3\n")
    missing = "raise ModuleNotFoundError('none', name='dask_jobqueue')\n"
    (tmp_path / "dask_jobqueue.py").write_text(missing)  # python -m looks here first
    ended = orchestrator("study", "x.toml", "--cluster", "pbs")
    assert (ended.returncode, ended.stderr.count("\n")) == (2, 1)
    assert "pip install 'dask-jobqueue>=0.9'" in ended.stderr
