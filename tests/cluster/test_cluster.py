"""A study on a real Slurm of two nodes: the same bytes, whatever happens to its jobs."""

import os
import subprocess
from pathlib import Path

import pytest

from tests.cluster.conftest import Start
from tests.cluster.slurm import Slurm, until
from tests.faults.bench import ORCHESTRATOR, ROOT, processes_in, tables

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
    cases = tmp_path / "out" / "cases"
    driver = start(*ON_SLURM)
    until(lambda: _at_work(cases), "a solver")
    first = set(queue.jobs())
    queue.says("scancel", *first)
    _end(driver)
    assert tables(tmp_path / "out") == local_tables
    assert not processes_in(cases)


def test_a_killed_driver(start: Start, tmp_path: Path, local_tables: Bytes) -> None:
    cases = tmp_path / "out" / "cases"
    driver = start(*ON_SLURM)
    until(lambda: list(cases.glob("pile-*/done.json")) and _at_work(cases), "a second solver")
    before = {path: path.stat().st_mtime_ns for path in cases.glob("*/done.json")}
    driver.kill()
    driver.communicate()
    _end(start(*ON_SLURM))
    assert tables(tmp_path / "out") == local_tables
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert not processes_in(cases)


def _refused(driver: "subprocess.Popen[str]", *words: str) -> None:
    _, said = driver.communicate(timeout=300)
    assert driver.returncode not in (0, None)
    assert "Traceback" not in said, said
    lines = [line for line in said.splitlines() if line.startswith("orchestrator")]
    assert len(lines) == 1, said
    for word in words:
        assert word in lines[0]


def test_a_directory_of_any_name(start: Start, tmp_path: Path, local_tables: Bytes) -> None:
    name, study = "it's a pâth of $HOME", tmp_path / "small.toml"
    command = ("study", "small.toml", "--out", name, *ON_SLURM[4:])
    _refused(start(*command), "cluster.log_directory", "'$'")
    study.write_text(f'{study.read_text()}log_directory = "{tmp_path}/logs"\n')
    _end(start(*command))
    assert tables(tmp_path / name) == local_tables
    assert list((tmp_path / "logs").glob("*.err"))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ('memmory = "1GB"', ["memmory", "[cluster]"]),
        ('queue = "nowhere"', ["slurm does not take the job", "invalid partition"]),
        ('interface = "none0"', ["none0", "[cluster]"]),
    ],
)
def test_settings_without_jobs(
    start: Start, tmp_path: Path, settings: str, words: list[str]
) -> None:
    path = tmp_path / "small.toml"
    text = path.read_text().replace('interface = "lo"', "")
    path.write_text(text + ("" if "interface" in settings else 'interface = "lo"\n') + settings)
    _refused(start(*ON_SLURM), *words)


def test_without_the_extra_one_line_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text("grain.diameter = 1e-3\n")
    # stands before any that is installed
    missing = "raise ModuleNotFoundError('none', name='dask_jobqueue')\n"
    (tmp_path / "dask_jobqueue.py").write_text(missing)
    command = [*ORCHESTRATOR, "study", "x.toml", "--cluster", "pbs"]
    env = {**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}"}
    ended = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True)
    assert ended.returncode == 2
    assert len(ended.stderr.splitlines()) == 1
    assert "pip install 'dask-jobqueue>=0.9'" in ended.stderr
