"""Run one external program: in its own session, logged, limited in time, never orphaned."""

import contextlib
import ctypes
import os
import select
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from orchestrator.errors import Interrupted
from orchestrator.runs import signals

GRACE_S = 2.0
POLL_S = 0.1
LAST_LETTERS = 200
"""Most of a log's last line that a message repeats."""
TAIL = 2**16
"""Part of a log in which its last line is looked for, bytes: a log may be of any size."""
_SET_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux."""


@dataclass(frozen=True)
class Ended:
    """How a program ended.

    Attributes
    ----------
    returncode : int
        As `subprocess` gives it: negative where a signal ended the program.
    seconds : float
        Wall time, s.
    cpu_s : float
        Processor time of it and all that it waited for, s; 0 if it was killed.
    timed_out : bool
        Whether it was killed at its time limit.
    """

    returncode: int
    seconds: float
    cpu_s: float
    timed_out: bool


def run(
    command: Sequence[str],
    *,
    cwd: Path,
    log: Path,
    limit_s: float,
    stop: threading.Event | None = None,
    env: Mapping[str, str] | None = None,
    fds: Sequence[int] = (),
) -> Ended:
    """Run a program to its end and keep what it says.

    Parameters
    ----------
    command : sequence of str
        The program and its arguments; no shell reads them.
    cwd, log : Path
        Working directory; file that takes both output streams.
    limit_s : float
        Wall time after which the program and all it started are killed, s.
    stop : threading.Event, optional
        Set by another thread to end the program early.
    env : mapping, optional
        Added to this process's environment.
    fds : sequence of int, optional
        Open files that it gets beside its output.

    Raises
    ------
    Interrupted
        If `stop` was set; the program has ended by then.
    """
    started = time.monotonic()
    with log.open("wb") as stream:
        process = subprocess.Popen(
            [*_dies_with_its_parent(), *command],
            cwd=cwd,
            stdin=subprocess.DEVNULL,
            stdout=stream,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            pass_fds=fds,
            # OpenFOAM takes its case directory from PWD, not from getcwd
            env={**os.environ, "PATH": _search_path(), "PWD": str(cwd), **(env or {})},
        )
        try:
            cpu_s = _wait(process, started + limit_s, stop)
        except BaseException:
            end_group(process)
            raise
    seconds = time.monotonic() - started
    return Ended(process.returncode, seconds, cpu_s or 0.0, timed_out=cpu_s is None)


def _wait(
    process: "subprocess.Popen[bytes]", deadline: float, stop: threading.Event | None
) -> float | None:
    """Wait for a program's end; its processor time, or None if it had to be killed."""
    # asking again and again whether it has ended would take a core from it, and see it late
    with end_of(process) as end:
        while not end.poll(1000 * POLL_S):
            if stop is not None and stop.is_set():
                raise Interrupted("stopped", remedy="the same command continues")
            if time.monotonic() > deadline:
                end_group(process)
                return None
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime


@contextlib.contextmanager
def end_of(process: "subprocess.Popen[bytes]") -> Iterator[select.poll]:
    """A handle that becomes ready when a program ends."""
    handle = os.pidfd_open(process.pid)
    end = select.poll()
    end.register(handle, select.POLLIN)
    try:
        yield end
    finally:
        os.close(handle)


def end_group(process: "subprocess.Popen[bytes]") -> None:
    """End a program and all that it started: ask first, then kill."""
    for request in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, request)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(GRACE_S)
    process.wait()


def _search_path() -> str:
    """PATH, which means the same in another working directory."""
    return os.pathsep.join(map(os.path.abspath, os.get_exec_path()))


def last_words(log: Path) -> str:
    """The end of the last line of a log; nothing where it holds none."""
    try:
        with log.open("rb") as stream:
            return last_line(stream)
    except OSError:
        return ""


def last_line(stream: BinaryIO) -> str:
    """The same of an open log."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - TAIL))
    lines = stream.read().decode(errors="replace").strip().splitlines()
    return lines[-1][-LAST_LETTERS:] if lines else ""


def _dies_with_its_parent() -> list[str]:
    """Without this a killed driver leaves its solver running; util-linux has it since 2.33."""
    setpriv = shutil.which("setpriv")
    return [setpriv, "--pdeathsig", "KILL", "--"] if setpriv else []


def follow(parent: int) -> None:
    """Make this forked process end with its parent, and leave the signals of a user to that."""
    for number in signals.ENDING:
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    ctypes.CDLL(None).prctl(_SET_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
