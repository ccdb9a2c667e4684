"""External programs: their output, limits and ends, and what they answer about their version."""

import itertools
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

from orchestrator import solvers
from orchestrator.errors import Interrupted, SolverError
from orchestrator.runs import process
from orchestrator.runs.process import Ended
from orchestrator.solvers import doctor, liggghts, openfoam
from tests.waiting import HANGS_S, until

ROOT = Path(__file__).parents[2]
Put = Callable[[str], Path]
Patch = pytest.MonkeyPatch
FAMILY = "trap '' TERM; sleep 100000 & echo $! >child; wait; wait"
"""A program and its child, which hear no SIGTERM and end by no other than SIGKILL."""


def _sh(folder: Path, script: str, **options: object) -> Ended:
    options = {"limit_s": HANGS_S, **options}
    return process.run(["sh", "-c", script], cwd=folder, log=folder / "log", **options)  # type: ignore[arg-type]


def _is_written(file: Path) -> bool:
    """Whether a file is there, with its line."""
    return file.is_file() and file.read_text().endswith("\n")


def _has_ended(pid: int) -> bool:
    """Whether the process of a number has ended."""
    try:
        return bool(psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return True


def _await_end(file: Path) -> None:
    """Wait until the process whose number a file holds has ended."""
    pid = int(file.read_text())
    until(lambda: _has_ended(pid))


def _clock(file: Path) -> SimpleNamespace:
    """A clock that stands until a file is written; then each look is beyond every limit."""
    looks = itertools.count(2 * HANGS_S, 2 * HANGS_S)
    return SimpleNamespace(monotonic=lambda: next(looks) if _is_written(file) else 0.0)


def test_output_exit_code_and_environment(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setenv("FIRST", "1")
    monkeypatch.setenv("SECOND", "2")
    script = "echo $FIRST $SECOND $THIRD $PWD; echo err >&2; exit 3"
    ended = _sh(tmp_path, script, env={"SECOND": None, "THIRD": "3"})
    assert (ended.returncode, ended.over) == (3, "")
    assert (tmp_path / "log").read_text() == f"1 3 {tmp_path}\nerr\n"


LIMITS: dict[str, tuple[str, dict[str, float], str]] = {
    "time": (FAMILY, {}, "time"),
    "output": (FAMILY.replace("wait", "yes", 1), {"output_limit": 10_000}, "output"),
    "none": ("sleep 100000 & echo $! >child", {}, ""),
}


@pytest.mark.parametrize("limit", LIMITS)
def test_all_of_a_group_is_ended(
    tmp_path: Path, monkeypatch: Patch, limit: str
) -> None:
    script, options, over = LIMITS[limit]
    if limit == "time":
        monkeypatch.setattr(process, "time", _clock(tmp_path / "child"))
    assert _sh(tmp_path, script, **options).over == over
    _await_end(tmp_path / "child")


def test_a_file_may_not_grow_beyond_its_limit(tmp_path: Path) -> None:
    ended = _sh(tmp_path, "exec head -c 1000000 /dev/zero >file", file_limit=100_000)
    assert ended.returncode != 0
    assert (tmp_path / "file").stat().st_size <= 100_000


def test_a_stop_ends_the_program(tmp_path: Path) -> None:
    stop, child = threading.Event(), tmp_path / "child"

    def set_at_work() -> None:
        until(lambda: _is_written(child))
        stop.set()

    threading.Thread(target=set_at_work).start()
    with pytest.raises(Interrupted):
        _sh(tmp_path, FAMILY, stop=stop)
    _await_end(child)


def test_a_killed_driver_leaves_nothing_at_work(tmp_path: Path) -> None:
    script = (
        "from pathlib import Path; from orchestrator.runs import process;"
        "process.run(['sh', '-c', 'sleep 100000 & echo $! >child; echo $$ >pid; wait'],"
        f" cwd=Path('.').absolute(), log=Path('log').absolute(), limit_s={HANGS_S})"
    )
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    driver = subprocess.Popen([sys.executable, "-c", script], cwd=tmp_path, env=env)

    def goes_on() -> None:
        assert driver.poll() is None

    until(lambda: _is_written(tmp_path / "pid"), goes_on)
    driver.kill()
    driver.wait()
    for name in ("pid", "child"):
        _await_end(tmp_path / name)


RUNS = {
    "kill -KILL $$": process.TRIES,
    "exit 143": process.TRIES,
    "kill -SEGV $$": 1,
    "exit 1": 1,
}


@pytest.mark.parametrize("script", RUNS)
def test_a_program_that_is_killed_from_outside_runs_again(
    tmp_path: Path, script: str
) -> None:
    _sh(tmp_path, f"echo >>runs; {script}", tries=process.TRIES)
    assert len((tmp_path / "runs").read_text()) == RUNS[script]


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
    "sleep 100000 & echo '{stated}'",
)
REFUSALS = {
    "exit 4": "it ended with 4 and printed nothing",
    "echo 'error while loading shared libraries: libnone.so'; exit 127": "printed “error while",
    "kill -SEGV $$": "it ended with -11",
    FAMILY.replace("child", '"$CHILD"'): "it did not end",
}


@pytest.fixture(params=VERSIONS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def put(tmp_path: Path, name: str, monkeypatch: Patch) -> Put:
    """Put a program of a name in front of the real one; no time ends its answer."""
    monkeypatch.setattr(solvers, "QUERY_S", HANGS_S)

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
def test_no_version_is_refused(
    put: Put, name: str, script: str, tmp_path: Path, monkeypatch: Patch
) -> None:
    child = tmp_path / "child"
    monkeypatch.setenv("CHILD", str(child))
    path = put(script)
    if "CHILD" in script:
        monkeypatch.setattr(process, "time", _clock(child))
    with pytest.raises(SolverError, match=REFUSALS[script]) as caught:
        VERSIONS[name]()
    assert str(caught.value).startswith(str(path))
    if "CHILD" in script:
        _await_end(child)


def test_the_home_of_another_openfoam(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.setenv("WM_PROJECT_DIR", str(tmp_path))
    with pytest.raises(SolverError, match=f"unset WM_PROJECT_DIR, which is {tmp_path}"):
        VERSIONS["simpleFoam"]()
    monkeypatch.setenv("WM_PROJECT_DIR", "")
    assert VERSIONS["simpleFoam"]() == openfoam.TRIED


def test_the_doctor_names_a_solver_that_is_broken(
    put: Put, name: str, monkeypatch: Patch
) -> None:
    path = put("exit 1")
    monkeypatch.setattr(doctor, "LIBRARIES", ("numpy",))
    uncached = {"OpenFOAM": VERSIONS["simpleFoam"], "LIGGGHTS": VERSIONS["liggghts"]}
    monkeypatch.setattr(doctor, "SOLVERS", uncached)
    findings = list(doctor.examine())
    solver = "OpenFOAM" if name == "simpleFoam" else "LIGGGHTS"
    (bad,) = [finding for finding in findings if not finding.good]
    assert bad.what == solver
    assert str(path) in bad.text
    lines = doctor.findings_text(findings).splitlines()
    assert [line for line in lines if line.startswith("NOT")] == [
        f"NOT  {solver:<12} {bad.text}"
    ]
