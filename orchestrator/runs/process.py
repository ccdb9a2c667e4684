"""External programs: each in a process group of its own, limited, never orphaned."""

import contextlib
import os
import resource
import select
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

from orchestrator.errors import Interrupted

POLL_S = 0.1
"""Time between two looks at a program, s."""
GRACE_S = 2.0
"""Time between SIGTERM and SIGKILL, s."""
TRIES = 3
"""Runs of a program that is killed from outside.

One that is killed three times is out of memory, say.
"""
LAST_BYTES = 2**16
"""Bytes at the end of a log in which its last line is looked for."""
LAST_LETTERS = 200
"""Letters of that line that are told."""
_OUTSIDE = {signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP}
"""Signals that come from outside; those of a crash would come again."""
_GUARD = """
exec 9<&0 </dev/null
( trap '' TERM INT HUP QUIT; ( read -r _ <&9; kill -KILL 0 ) >/dev/null 2>&1 & )
exec 9<&-
[ -z "$1" ] || ulimit -f "$1" || exit
shift
exec "$@"
"""
"""The shell that becomes the program.

Its standard input is a pipe whose other end only the driver holds: a process beside the
program reads it, and kills the group when the driver has ended.
"""


class Ended(NamedTuple):
    """How a program ended.

    Attributes
    ----------
    returncode
        Exit code as `subprocess` gives it: less than 0 for a signal.
    seconds
        Wall time, s.
    cpu_s
        Processor time of the program and all that it waited for, s; 0 if it was killed.
    over
        The limit at which it was killed, "time" or "output", or empty.
    """

    returncode: int
    seconds: float
    cpu_s: float
    over: str = ""


def run(
    command: Sequence[str],
    *,
    cwd: Path,
    log: Path,
    limit_s: float,
    stop: threading.Event | None = None,
    env: Mapping[str, str | None] | None = None,
    output_limit: float = float("inf"),
    file_limit: int | None = None,
    tries: int = 1,
) -> Ended:
    """Run a program to its end in a process group of its own.

    The whole group is killed when the program has ended, when this process ends in
    whatever way, and at the first limit.

    Parameters
    ----------
    command
        The program and its arguments.
    cwd
        Directory that it runs in.
    log
        File that receives both its outputs.
    limit_s
        Wall time that it may take, s.
    stop
        An event that another thread sets to end the run.
    env
        Variables that are added to this process's environment; None removes one.
    output_limit
        Bytes that the log may hold.
    file_limit
        Bytes that any file may hold which the program writes.
    tries
        How often the program is started in all if it is killed from outside.

    Returns
    -------
    Ended
        How the last of these runs ended.

    Raises
    ------
    Interrupted
        If `stop` was set.
    """
    # sh takes the limit of a file's size in blocks of 512 bytes
    blocks = "" if file_limit is None else str(file_limit // 512)
    guarded = ["sh", "-c", _GUARD, "sh", blocks, *command]
    environment = _environment(cwd, env or {})
    limits = _Limits(limit_s, output_limit)
    for _ in range(tries):
        ended = _run_once(guarded, cwd, log, environment, limits, stop)
        if ended.over or not _is_killed_from_outside(ended.returncode):
            break
    return ended


@dataclass(frozen=True)
class _Limits:
    """Limits of a run: wall time, s, and size of the log, bytes."""

    seconds: float
    output: float

    def is_too_long(self, log: BinaryIO) -> bool:
        """Whether a log is beyond its limit."""
        return os.fstat(log.fileno()).st_size > self.output


def _environment(cwd: Path, env: Mapping[str, str | None]) -> dict[str, str]:
    """The environment of a program that runs in a directory."""
    # a relative PATH would be another one in another working directory
    folders = [os.path.abspath(folder) for folder in os.get_exec_path()]
    given: dict[str, str | None] = {
        **os.environ,
        "PATH": os.pathsep.join(folders),
        # OpenFOAM takes its case directory from PWD, not from getcwd
        "PWD": str(cwd),
        **env,
    }
    return {name: value for name, value in given.items() if value is not None}


def _run_once(
    command: Sequence[str],
    cwd: Path,
    log: Path,
    environment: Mapping[str, str],
    limits: _Limits,
    stop: threading.Event | None,
) -> Ended:
    """Start a program, wait for its end or a limit, and end its group."""
    began = time.monotonic()
    cpu_s = 0.0
    with log.open("wb") as stream, contextlib.ExitStack() as stack:
        process = subprocess.Popen(
            command,
            cwd=cwd,
            stdin=subprocess.PIPE,
            stdout=stream,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env=environment,
        )
        stack.callback(_end_group, process)
        over = _wait(process, stream, limits, stop)
        if not over:
            cpu_s = _collect(process)
            # one that prints fast may end by the limit of a file's size before it is
            # asked
            over = "output" if limits.is_too_long(stream) else ""
    return Ended(process.returncode, time.monotonic() - began, cpu_s, over)


def _wait(
    process: "subprocess.Popen[bytes]",
    log: BinaryIO,
    limits: _Limits,
    stop: threading.Event | None,
) -> str:
    """Wait for the end of a program; the limit that it met before, or empty."""
    ends_at = time.monotonic() + limits.seconds
    handle = os.pidfd_open(process.pid)
    try:
        # the handle tells the end: no core is spent on asking
        end = select.poll()
        end.register(handle, select.POLLIN)
        while not end.poll(1000 * POLL_S):
            if stop is not None and stop.is_set():
                raise Interrupted("stopped", remedy="the same command continues")
            if time.monotonic() > ends_at:
                return "time"
            if limits.is_too_long(log):
                return "output"
    finally:
        os.close(handle)
    return ""


def _collect(process: "subprocess.Popen[bytes]") -> float:
    """Take the exit code of a program that has ended, and its processor time, s."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime


def _is_killed_from_outside(returncode: int) -> bool:
    """Whether an exit code is that of a program that was killed from outside."""
    number = -returncode
    if returncode >= 0:
        # a shell reports 128 + n of a program that signal n ended
        number = returncode - 128
    return number in _OUTSIDE


def _end_group(process: "subprocess.Popen[bytes]") -> None:
    """Kill what is left of a program's group; a program that runs is asked first."""
    with contextlib.suppress(ProcessLookupError, subprocess.TimeoutExpired):
        if process.returncode is None:
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(GRACE_S)
    with contextlib.suppress(ProcessLookupError):
        # the guard is in the group until now, so its number is of no other group
        os.killpg(process.pid, signal.SIGKILL)
    assert process.stdin
    process.stdin.close()
    process.wait()


def last_words(log: Path) -> str:
    """Read the end of a log, which may be of any size.

    Parameters
    ----------
    log
        The log.

    Returns
    -------
    str
        The last 200 letters of its last line; empty where it holds none.
    """
    with contextlib.suppress(OSError), log.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(0, size - LAST_BYTES))
        text = stream.read().decode(errors="replace").strip()
        _, _, line = text.rpartition("\n")
        return line[-LAST_LETTERS:]
    return ""


class _Needed(NamedTuple):
    """A limit of the shell: its name, the least that a small study needs, and its unit.

    `option` is that of the shell's ``ulimit``.
    """

    name: str
    number: int
    least: int
    unit_bytes: int
    option: str


_NEEDED = (
    _Needed("open files", resource.RLIMIT_NOFILE, 64, 1, "n"),
    _Needed("memory", resource.RLIMIT_AS, 2_000_000, 1024, "v"),
)


def shortage() -> str:
    """Look for a limit of the shell that is too low: libraries crash at it.

    Returns
    -------
    str
        The first limit that is too low for a small study, and the command that raises
        it; empty if there is none.
    """
    for needed in _NEEDED:
        soft, _ = resource.getrlimit(needed.number)
        if soft == resource.RLIM_INFINITY:
            continue
        if soft < needed.least * needed.unit_bytes:
            found = f"the limit of {needed.name} is {soft // needed.unit_bytes}"
            return f"{found}: raise it, ulimit -{needed.option} {needed.least}"
    return ""
