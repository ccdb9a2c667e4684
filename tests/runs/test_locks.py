"""Who holds a lock, since when, and how it is freed, with locks and without."""

import errno
import fcntl
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from filelock import FileLock, Timeout

from orchestrator.errors import OrchestratorError
from orchestrator.runs import locks
from orchestrator.runs.workspace import LOCK, STUDY, Workspace, claimed
from tests.waiting import HANGS_S

ROOT = Path(__file__).parents[2]
SINCE = r"since \d{4}-\d\d-\d\d \d\d:\d\d:\d\d"


@pytest.fixture
def without_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system that implements no flock, as Lustre may be mounted."""

    def flock(*_: object) -> None:
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(fcntl, "flock", flock)


def _refusal(root: Path) -> str:
    with pytest.raises(OrchestratorError) as raised, claimed(root, STUDY, "a"):
        pass
    return str(raised.value)


REFUSED_AFTER_S = 0.5
"""Limit of a wait whose end is tested: the lock is held until then, and longer."""


def _is_whole(message: str, path: Path, who: str) -> None:
    """See that a message names file, holder, time and remedy in one line."""
    assert re.search(rf"in use by {who} {SINCE}; its lock is {path} ", message), message
    assert f"remove {path})" in message
    assert "--out" in message
    assert "\\n" not in message
    assert message.isprintable()


def test_a_lock_that_is_held_says_by_whom_and_since_when(tmp_path: Path) -> None:
    with claimed(tmp_path / "a", STUDY, "a"):
        assert Workspace(tmp_path / "a").is_held()
        here = rf"process {os.getpid()} on \S+"
        _is_whole(_refusal(tmp_path / "a"), tmp_path / "a" / LOCK, here)
    assert not Workspace(tmp_path / "a").is_held()
    # a file that nobody holds names nobody
    assert (tmp_path / "a" / LOCK).read_text() == ""
    with claimed(tmp_path / "a", STUDY, "a"):
        pass


def test_a_file_system_without_locks(
    tmp_path: Path, without_locks: None, capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "a"
    with claimed(root, STUDY, "a"):
        told = f"{root / LOCK}: this file system has no locks"
        assert capsys.readouterr().err.count(told) == 1
        assert Workspace(root).is_held()
        # a file that names nobody is taken for garbage after two seconds: it must not
        long_ago = time.time() - HANGS_S
        os.utime(root / LOCK, (long_ago, long_ago))
        here = rf"process {os.getpid()} on \S+"
        _is_whole(_refusal(root), root / LOCK, here)
    assert not (root / LOCK).exists()
    assert not Workspace(root).is_held()


def test_a_lock_left_by_a_killed_driver_of_another_machine(
    tmp_path: Path, without_locks: None
) -> None:
    root = tmp_path / "a"
    root.mkdir()
    (root / LOCK).write_text("4242\nnode17\n")
    assert Workspace(root).is_held()
    _is_whole(_refusal(root), root / LOCK, "process 4242 on node17")
    (root / LOCK).unlink()
    with claimed(root, STUDY, "a"):
        pass


KILLED = """
import errno, fcntl, os, pathlib, sys
from orchestrator.runs import workspace
def flock(*_):
    raise OSError(errno.ENOSYS, "Function not implemented")
fcntl.flock = flock
with workspace.claimed(pathlib.Path(sys.argv[1]), workspace.STUDY, "a"):
    os.kill(os.getpid(), 9)
"""


def test_a_lock_left_by_a_killed_driver_of_this_machine(
    tmp_path: Path, without_locks: None
) -> None:
    root = tmp_path / "a"
    killed = subprocess.run(
        [sys.executable, "-c", KILLED, str(root)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=HANGS_S,
    )
    assert killed.returncode == -signal.SIGKILL
    assert (root / LOCK).read_text()
    assert not Workspace(root).is_held()
    with claimed(root, STUDY, "a"):
        pass


def test_no_wait_is_without_a_word(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(locks, "PATIENCE_S", 0.05)
    path = tmp_path / "lock"
    said: list[str] = []

    def again() -> None:
        with locks.lock_held(
            path, limit_s=REFUSED_AFTER_S, else_="else", say=said.append
        ):
            pass

    with locks.lock_held(path, limit_s=HANGS_S, else_="", say=said.append):
        assert not said
        with pytest.raises(OrchestratorError, match=r"in use by process \d+ on "):
            again()
    assert len(said) >= 2
    for line in said:
        assert re.fullmatch(
            rf"waits for {path}, in use by process {os.getpid()} on \S+ {SINCE};"
            rf" if that process does not run any more, remove {path}",
            line,
        )
    again()


def test_a_note_of_any_content_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    assert locks.holder(path) == "another process"
    for text in ("", "\n\n", "two\nlines of\nsomething", "\x00\n"):
        path.write_text(text)
        assert "\n" not in locks.holder(path)


def test_no_lock_is_waited_for_beyond_its_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    waited_s = [0.0]
    # a minute, two, four, and what is left of the limit
    waits_s = [60.0, 120.0, 240.0, 80.0]

    def wait(_: object, timeout: float) -> None:
        waited_s.append(timeout)
        raise Timeout(str(tmp_path / "lock"))

    clock = SimpleNamespace(monotonic=lambda: sum(waited_s))
    clock.strftime, clock.localtime = time.strftime, time.localtime
    monkeypatch.setattr(locks, "time", clock)
    monkeypatch.setattr(FileLock, "acquire", wait)
    said: list[str] = []
    with (
        pytest.raises(OrchestratorError),
        locks.lock_held(
            tmp_path / "lock", limit_s=sum(waits_s), else_="", say=said.append
        ),
    ):
        pass
    assert waited_s == [0.0, *waits_s]
    assert len(said) == 3
