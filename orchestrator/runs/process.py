"""External programs: one run in a process group of its own, limited, logged, never orphaned."""

import contextlib
import ctypes
import errno
import os
import re
import resource
import select
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from orchestrator.errors import Interrupted, OrchestratorError, SolverError
from orchestrator.runs import terminal

GRACE_S = 2.0
"""Time between SIGTERM and SIGKILL."""
POLL_S = 0.1
DISK_S = 5.0
"""Time between two looks at the space on the disk; a program is ended if two find it full."""
ROOM = 2**16
"""Space that must be left on the disk, bytes."""
TRIES = 3
"""Runs of a program that is killed from outside. One killed three times is no accident: it is out
of memory, say."""
LAST_LETTERS = 200
"""Largest part of a log's last line that a message repeats."""
TAIL = 2**16
"""Part of a log in which its last line is looked for, bytes: a log may be of any size."""
_OUTSIDE = {signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP}
"""Signals that come from outside; those of a crash would come again."""
_SET_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux."""
_GUARD = """
exec 9<&0 </dev/null
( trap '' TERM INT HUP QUIT; ( read -r _ <&9; kill -KILL 0 ) >/dev/null 2>&1 & )
exec 9<&-
[ -z "$1" ] || ulimit -f "$1" || exit
shift
exec "$@"
"""
"""The shell that becomes the program. Its standard input is a pipe whose other end only the driver
holds: a process beside the program reads it, and kills the group when the driver has ended."""


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
        Processor time of the program and all that it waited for, s; 0 if it was killed.
    over : str
        The limit at which it was killed: "time", "output" or "disk"; empty if it ended by itself.
    peak_mib : float
        Memory of its largest process, MiB; 0 if it was killed.
    """

    returncode: int
    seconds: float
    cpu_s: float
    over: str = ""
    peak_mib: float = 0.0

    @property
    def timed_out(self) -> bool:
        """Whether it was killed at its time limit."""
        return self.over == "time"

    @property
    def may_pass(self) -> bool:
        """Whether its end may not come again: it was killed from outside, and did not fail."""
        # a shell reports 128 + n of a program that signal n ended
        code = -self.returncode if self.returncode < 0 else self.returncode - 128
        return code in _OUTSIDE and not self.over


def run(
    command: Sequence[str],
    *,
    cwd: Path,
    log: Path,
    limit_s: float,
    stop: threading.Event | None = None,
    env: Mapping[str, str | None] | None = None,
    output_limit: int | None = None,
    file_limit: int | None = None,
    tries: int = 1,
    fds: Sequence[int] = (),
) -> Ended:
    """Run a program to its end in a process group of its own, and keep its output.

    The whole group is killed when the program has ended, when this process ends in whatever way,
    and at the first limit that is reached.

    Parameters
    ----------
    command : sequence of str
        The program and its arguments; no shell reads them.
    cwd, log : Path
        Working directory; file that takes both output streams.
    limit_s : float
        Limit of wall time, s.
    stop : threading.Event, optional
        Set by another thread to end the program early.
    env : mapping, optional
        Added to this process's environment; None removes a variable.
    output_limit : int, optional
        Limit of the log's size, bytes.
    file_limit : int, optional
        Limit of the size of each file that the program writes, bytes.
    tries : int, optional
        Number of runs in all if the program is killed from outside; it must start afresh each time.
    fds : sequence of int, optional
        Open files that it inherits beside its output.

    Raises
    ------
    Interrupted
        If `stop` was set; the program has ended by then.
    """
    # OpenFOAM takes its case directory from PWD, not from getcwd; a relative PATH would be
    # another one in another working directory
    given = {**os.environ, "PATH": _search_path(), "PWD": str(cwd), **(env or {})}
    blocks = "" if file_limit is None else str(file_limit // 512)
    for _ in range(tries):
        began, over, usage = time.monotonic(), "", None
        with log.open("wb") as stream:
            process = subprocess.Popen(
                ["sh", "-c", _GUARD, "sh", blocks, *command],
                cwd=cwd,
                stdin=subprocess.PIPE,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                pass_fds=fds,
                env={name: value for name, value in given.items() if value is not None},
            )
            try:
                over = _wait(process, began + limit_s, stop, stream, output_limit, cwd)
                if not over:
                    _, status, usage = os.wait4(process.pid, 0)
                    process.returncode = os.waitstatus_to_exitcode(status)
            finally:
                _end_group(process)
        cpu_s = usage.ru_utime + usage.ru_stime if usage else 0.0
        peak_mib = usage.ru_maxrss / 1024 if usage else 0.0
        ended = Ended(process.returncode, time.monotonic() - began, cpu_s, over, peak_mib)
        if not ended.may_pass:
            break
    return ended


def _wait(
    process: "subprocess.Popen[bytes]",
    deadline: float,
    stop: threading.Event | None,
    log: BinaryIO,
    output_limit: int | None,
    cwd: Path,
) -> str:
    """Wait until a program has ended, or return the limit that it has reached."""
    looked, was_full = time.monotonic(), False
    with _end_of(process) as end:
        while not end.poll(1000 * POLL_S):
            if stop is not None and stop.is_set():
                raise Interrupted("stopped", remedy="the same command continues")
            now = time.monotonic()
            if now > deadline:
                return "time"
            if output_limit is not None and os.fstat(log.fileno()).st_size > output_limit:
                return "output"
            if now > looked + DISK_S:
                is_full = _is_full(cwd)
                if is_full and was_full:
                    return "disk"
                looked, was_full = now, is_full
    return ""


def _is_full(folder: Path) -> bool:
    """Whether no room is left on the disk, or within the quota, of a folder."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            os.posix_fallocate(file.fileno(), 0, ROOM)
    except OSError as error:
        return error.errno in (errno.ENOSPC, errno.EDQUOT)
    return False


@contextlib.contextmanager
def _end_of(process: "subprocess.Popen[bytes]") -> Iterator[select.poll]:
    """A handle that becomes ready when a program ends: no core is spent on asking."""
    handle = os.pidfd_open(process.pid)
    end = select.poll()
    end.register(handle, select.POLLIN)
    try:
        yield end
    finally:
        os.close(handle)


def _end_group(process: "subprocess.Popen[bytes]") -> None:
    """Kill what is left of a program's group; a program that still runs is asked first."""
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(GRACE_S)
    # the guard is in the group until now, so its number is of no other group
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    assert process.stdin
    process.stdin.close()
    process.wait()


def _search_path() -> str:
    return os.pathsep.join(map(os.path.abspath, os.get_exec_path()))


def last_words(log: Path) -> str:
    """The end of the last line of a log; nothing where it holds none."""
    try:
        with log.open("rb") as stream:
            return last_line(stream)
    except OSError:
        return ""


def last_line(stream: BinaryIO) -> str:
    """The end of the last line of an open log."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - TAIL))
    lines = stream.read().decode(errors="replace").strip().splitlines()
    return lines[-1][-LAST_LETTERS:] if lines else ""


QUERY_S = 30.0
"""Time limit of a program that is asked for its version, s."""
QUERY_BYTES = 1_000_000


@dataclass(frozen=True)
class Reply:
    """Output and end of a program that was asked for its version.

    Attributes
    ----------
    text : str
        Text of both streams; bytes that are not UTF-8 are replaced.
    returncode : int
        As `subprocess` gives it: negative where a signal ended the program.
    """

    text: str
    returncode: int

    @property
    def gist(self) -> str:
        """How it ended and its most telling line, for a message."""
        lines = [line.strip() for line in self.text.splitlines() if line.strip()]
        telling = (line for line in lines if re.search(r"error|cannot|fail", line, re.IGNORECASE))
        line = next(telling, lines[-1] if lines else "")
        how = (
            f"was killed by {signal.Signals(-self.returncode).name}"
            if self.returncode < 0
            else f"ended with {self.returncode}"
        )
        return f"it {how} and printed {f'“{line}”' if line else 'nothing'}"


def find(name: str, *, remedy: str) -> str:
    """The path of the program that a name stands for.

    Raises
    ------
    SolverError
        If there is none that may be run.
    """
    path = shutil.which(name)
    if path:
        return os.path.abspath(path)
    for place in (Path(folder, name).absolute() for folder in os.get_exec_path()):
        if place.is_file():
            raise SolverError(f"{place} may not be run", remedy=f"chmod +x {place}")
    raise SolverError(f"the program {name} is not in PATH", remedy=remedy)


def ask(path: str, *arguments: str, env: Mapping[str, str | None] | None = None) -> Reply:
    """Run a program that ends at once, and return what it prints.

    Raises
    ------
    SolverError
        If it does not end.
    """
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "log")
        ended = run(
            [path, *arguments],
            cwd=Path(folder),
            log=log,
            limit_s=QUERY_S,
            env=env,
            output_limit=QUERY_BYTES,
        )
        with log.open("rb") as stream:
            text = stream.read(QUERY_BYTES).decode(errors="replace")
    if ended.timed_out:
        raise SolverError(
            f"{' '.join([path, *arguments])} did not end within {QUERY_S:g} s",
            remedy="try it by hand: what does it wait for?",
        )
    return Reply(text, ended.returncode)


LEAST = {
    "open files": (resource.RLIMIT_NOFILE, 64, "ulimit -n", 1),
    "memory": (resource.RLIMIT_AS, 2_000_000, "ulimit -v", 1024),
}
"""The limit, its least value, the command that sets it, and the size of its unit. A small study on
two cores took 40 files; and 1.9e6 kB of addresses, of which it used a tenth."""


def shortages() -> Iterator[OrchestratorError]:
    """The limits of the shell that are too low for a study: libraries crash beyond them."""
    for what, (number, least, command, unit) in LEAST.items():
        soft, _ = resource.getrlimit(number)
        if soft != resource.RLIM_INFINITY and soft < least * unit:
            yield OrchestratorError(
                f"the limit of {what} is {soft // unit}, less than a study needs",
                remedy=f"{command} {least}, or more",
            )


def follow(parent: int) -> None:
    """Make this forked process end with its parent, and leave the signals of a user to that."""
    for number in terminal.ENDING:
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    ctypes.CDLL(None).prctl(_SET_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
