"""External programs: their output, limits and ends, and what they answer about their version."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from orchestrator.errors import Interrupted, SolverError
from orchestrator.runs import process
from orchestrator.runs.process import Ended
from orchestrator.solvers import doctor, liggghts, openfoam, programs
from tests.conftest import Mount

ROOT = Path(__file__).parents[2]
Put = Callable[[str], Path]
Patch = pytest.MonkeyPatch


def _sh(folder: Path, script: str, **options: object) -> Ended:
    options = {"limit_s": 30.0, **options}
    return process.run(["sh", "-c", script], cwd=folder, log=folder / "log", **options)  # type: ignore[arg-type]


def _has_ended(pid: int) -> bool:
    for _ in range(200):
        if not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
            return True
        time.sleep(0.05)
    return False


def test_output_exit_code_and_environment(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setenv("FIRST", "1")
    monkeypatch.setenv("SECOND", "2")
    script = "echo $FIRST $SECOND $THIRD $PWD; echo err >&2; exit 3"
    ended = _sh(tmp_path, script, env={"SECOND": None, "THIRD": "3"})
    assert (ended.returncode, ended.over) == (3, "")
    assert (tmp_path / "log").read_text() == f"1 3 {tmp_path}\nerr\n"


FAMILY = "sleep 60 & echo $! >child; trap '' TERM; wait; wait"


@pytest.mark.parametrize(
    ("script", "options", "over"),
    [
        (FAMILY, {"limit_s": 0.3}, "time"),
        (f"yes & {FAMILY}", {"output_limit": 10_000}, "output"),
        ("sleep 60 & echo $! >child", {}, ""),
    ],
)
def test_all_of_a_group_is_ended(
    tmp_path: Path, script: str, options: dict[str, float], over: str
) -> None:
    assert _sh(tmp_path, script, **options).over == over
    assert _has_ended(int((tmp_path / "child").read_text()))


def test_a_file_may_not_grow_beyond_its_limit(tmp_path: Path) -> None:
    ended = _sh(tmp_path, "exec head -c 1000000 /dev/zero >file", file_limit=100_000)
    assert ended.returncode != 0
    assert (tmp_path / "file").stat().st_size <= 100_000


def test_a_full_disk_ends_a_program(disk: Mount, monkeypatch: Patch) -> None:
    monkeypatch.setattr(process, "DISK_S", 0.2)
    script = "head -c 10000000 /dev/zero >file; while :; do sleep 0.1; done"
    assert _sh(disk("size=1M"), script).over == "disk"


def test_a_stop_ends_the_program(tmp_path: Path) -> None:
    stop = threading.Event()
    threading.Timer(0.3, stop.set).start()
    with pytest.raises(Interrupted):
        _sh(tmp_path, FAMILY, stop=stop)
    assert _has_ended(int((tmp_path / "child").read_text()))


def test_a_killed_driver_leaves_nothing_at_work(tmp_path: Path) -> None:
    script = (
        "from pathlib import Path; from orchestrator.runs import process;"
        "process.run(['sh', '-c', 'sleep 60 & echo $! >child; echo $$ >pid; wait; sleep 60'],"
        " cwd=Path('.').absolute(), log=Path('log').absolute(), limit_s=60)"
    )
    driver = subprocess.Popen(
        [sys.executable, "-c", script], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    pid = tmp_path / "pid"
    while not (pid.is_file() and pid.read_text().strip()):
        assert driver.poll() is None
        time.sleep(0.05)
    driver.kill()
    driver.wait()
    assert all(_has_ended(int((tmp_path / name).read_text())) for name in ("pid", "child"))


@pytest.mark.parametrize(
    ("script", "runs"), [("kill -KILL $$", 3), ("exit 143", 3), ("kill -SEGV $$", 1), ("exit 1", 1)]
)
def test_a_killed_program_runs_again(tmp_path: Path, script: str, runs: int) -> None:
    _sh(tmp_path, f"echo >>runs; {script}", tries=process.TRIES)
    assert len((tmp_path / "runs").read_text()) == runs


VERSIONS: dict[str, Callable[[], str]] = {
    "simpleFoam": openfoam.version.__wrapped__,
    "liggghts": liggghts.version.__wrapped__,
}
STATED = {
    "simpleFoam": "Using: OpenFOAM-v1912 (see www.OpenFOAM.com)",
    "liggghts": "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0)",
}
ANSWERS = (
    "printf '\\377\\376 \\300\\n'; echo '{stated}'",
    "echo '{stated}' >&2; head -c 30000000 /dev/zero; exit 3",
    "sleep 1000 & echo '{stated}'",
)
REFUSALS = {
    "exit 4": "it ended with 4 and printed nothing",
    "echo 'error while loading shared libraries: libnone.so'; exit 127": "printed “error while",
    "kill -SEGV $$": "it ended with -11",
}


@pytest.fixture(params=VERSIONS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def put(tmp_path: Path, name: str, monkeypatch: Patch) -> Put:
    """Put a program of a name in front of the real one."""

    def put(script: str) -> Path:
        path = tmp_path / name
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
        return path

    return put


@pytest.mark.parametrize("script", ANSWERS)
def test_a_version_among_other_output(put: Put, name: str, script: str) -> None:
    put(script.format(stated=STATED[name]))
    assert VERSIONS[name]() in STATED[name]


@pytest.mark.parametrize("script", REFUSALS)
def test_no_version_is_refused(put: Put, name: str, script: str) -> None:
    path = put(script)
    with pytest.raises(SolverError, match=REFUSALS[script]) as caught:
        VERSIONS[name]()
    assert str(caught.value).startswith(str(path))


def test_no_answer(put: Put, name: str, tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setattr(programs, "QUERY_S", 0.5)
    put(f"cd {tmp_path}; {FAMILY}")
    with pytest.raises(SolverError, match=r"did not end within 0\.5 s"):
        VERSIONS[name]()
    assert _has_ended(int((tmp_path / "child").read_text()))


def test_the_home_of_another_openfoam(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setenv("WM_PROJECT_DIR", str(tmp_path))
    with pytest.raises(SolverError, match=f"WM_PROJECT_DIR={tmp_path} .*unset WM_PROJECT_DIR"):
        VERSIONS["simpleFoam"]()
    monkeypatch.setenv("WM_PROJECT_DIR", "")
    assert VERSIONS["simpleFoam"]() in openfoam.TRIED


def test_the_doctor_names_a_solver_that_is_broken(put: Put, name: str) -> None:
    put("exit 1")
    openfoam.version.cache_clear()
    liggghts.version.cache_clear()
    findings = list(doctor.examine())
    assert sum(not finding.good for finding in findings) == 1
    assert len(doctor.text(findings).splitlines()) == len(findings)
