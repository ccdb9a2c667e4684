"""External programs: one run in a process group of its own, limited, logged, never orphaned."""

import contextlib
import os
import resource
import select
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from orchestrator.errors import Interrupted

POLL_S, GRACE_S = 0.1, 2.0
"""Time between two looks at a program, and between SIGTERM and SIGKILL."""
TRIES = 3
"""Runs of a program that is killed from outside. One killed three times is out of memory, say."""
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
"""The shell that becomes the program. Its standard input is a pipe whose other end only the driver
holds: a process beside the program reads it, and kills the group when the driver has ended."""


class Ended(NamedTuple):
    """How a program ended: `returncode` as `subprocess` gives it, and `seconds` of wall time.

    `cpu_s` is the processor time of the program and all that it waited for, s; 0 if it was killed.
    `over` is the limit at which it was killed, "time" or "output", or empty.
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
    """Run a program to its end in a process group of its own, with both its outputs in `log`.

    The whole group is killed when the program has ended, when this process ends in whatever way,
    and at the first limit: `limit_s` of wall time, s, `output_limit` of the log's size and
    `file_limit` of any file that is written, bytes. `stop`, set by another thread, ends the run by
    Interrupted. `env` is added to this process's environment; None removes a variable. A program
    that is killed from outside is started again, `tries` times in all.
    """
    # OpenFOAM takes its case directory from PWD, not from getcwd; a relative PATH would be
    # another one in another working directory
    path = os.pathsep.join(map(os.path.abspath, os.get_exec_path()))
    given = {**os.environ, "PATH": path, "PWD": str(cwd), **(env or {})}
    blocks = "" if file_limit is None else str(file_limit // 512)
    for _ in range(tries):
        began, over, cpu_s = time.monotonic(), "", 0.0
        with log.open("wb") as stream, contextlib.ExitStack() as stack:
            process = subprocess.Popen(
                ["sh", "-c", _GUARD, "sh", blocks, *command],
                cwd=cwd,
                stdin=subprocess.PIPE,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                env={name: value for name, value in given.items() if value is not None},
            )
            stack.callback(_end_group, process)
            end, handle = select.poll(), os.pidfd_open(process.pid)
            stack.callback(os.close, handle)
            end.register(handle, select.POLLIN)  # at the end: no core is spent on asking
            while not over and not end.poll(1000 * POLL_S):
                if stop is not None and stop.is_set():
                    raise Interrupted("stopped", remedy="the same command continues")
                if time.monotonic() > began + limit_s:
                    over = "time"
                elif os.fstat(stream.fileno()).st_size > output_limit:
                    over = "output"
            if not over:
                _, status, usage = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
                cpu_s = usage.ru_utime + usage.ru_stime
                # one that prints fast may end by the limit of a file's size before it is asked
                over = "output" if os.fstat(stream.fileno()).st_size > output_limit else ""
        ended = Ended(process.returncode, time.monotonic() - began, cpu_s, over)
        # a shell reports 128 + n of a program that signal n ended
        code = -ended.returncode if ended.returncode < 0 else ended.returncode - 128
        if over or code not in _OUTSIDE:
            break
    return ended


def _end_group(process: "subprocess.Popen[bytes]") -> None:
    """Kill what is left of a program's group; a program that still runs is asked first."""
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
    """The last 200 letters of the last line of a log; nothing where it holds none."""
    with contextlib.suppress(OSError), log.open("rb") as stream:
        # a log may be of any size
        stream.seek(max(0, stream.seek(0, os.SEEK_END) - 2**16))
        return stream.read().decode(errors="replace").strip().rpartition("\n")[2][-200:]
    return ""


def shortage() -> str:
    """The limit of the shell that is too low for a small study, or nothing: libraries crash."""
    for what, number, least, unit, option in (
        ("open files", resource.RLIMIT_NOFILE, 64, 1, "n"),
        ("memory", resource.RLIMIT_AS, 2_000_000, 1024, "v"),
    ):
        soft, _ = resource.getrlimit(number)
        if soft != resource.RLIM_INFINITY and soft < least * unit:
            return f"the limit of {what} is {soft // unit}: raise it, ulimit -{option} {least}"
    return ""
