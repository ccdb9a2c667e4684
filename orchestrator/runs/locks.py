"""Locks: which file one is, who holds it, since when, and how it is freed.

The system frees a lock however its holder ends. A file system without locks, such as
Lustre mounted without flock, has the file itself in their place: the one who makes it
holds it, and one who is killed on another machine leaves it behind.
"""

import contextlib
import errno
import fcntl
import os
import re
import socket
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

from filelock import FileLock, SoftFileLock, Timeout

from orchestrator.errors import OrchestratorError
from orchestrator.runs import files

AT_ONCE_S = 1.0
"""Time that the lock of a process which is ending may take to be free, s."""
PATIENCE_S = 60.0
"""Time of waiting until a line says for whom, s; until the next it is twice as long."""
_RECORD = re.compile(r"(\d+)\n([^\n]+)\n(\d+\n)?")
"""What a file has that stands in for a lock: number and machine of its process."""


def holder(path: Path) -> str:
    """Say who holds a lock, and since when.

    Parameters
    ----------
    path
        The file of the lock.

    Returns
    -------
    str
        Its process and machine, as the file says, and the time of the file.
    """
    who = ""
    since = 0.0
    with contextlib.suppress(OSError):
        who = path.read_text(encoding="utf-8", errors="replace")
        since = path.stat().st_mtime
    record = _RECORD.fullmatch(who)
    if record is not None:
        who = f"process {record[1]} on {_machine(record[2])}"
    who = " ".join(who.split()) or "another process"
    if not since:
        return who
    stamp = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(since))
    return f"{who} since {stamp}"


def _machine(recorded: str) -> str:
    """The name of a machine, without what a record adds to tell containers apart."""
    return re.split(r"[^\w.-]", recorded, maxsplit=1)[0] or recorded


@contextlib.contextmanager
def lock_held(
    path: Path,
    *,
    limit_s: float,
    else_: str,
    say: Callable[[str], None] = lambda line: print(line, file=sys.stderr),
) -> Iterator[None]:
    """Hold a lock for a block, or say who holds it.

    Parameters
    ----------
    path
        The file of the lock.
    limit_s
        Time to wait for it, s.
    else_
        What a user can do other than free it, for the message.
    say
        Receives a line about each minute or more of waiting, and one where the file
        system has no locks.

    Yields
    ------
    None
        While it is held.

    Raises
    ------
    OrchestratorError
        If another holds it; it names the file, the holder and how it is freed.
    OSError
        If the file cannot be made.
    """
    lock = FileLock(path)
    _acquire(lock, path, limit_s, else_, say)
    has_locks = not isinstance(lock, SoftFileLock)
    if has_locks:
        # a full disk holds no note, but gives the lock
        with contextlib.suppress(OSError):
            path.write_text(f"process {os.getpid()} on {socket.gethostname()}\n")
    else:
        what = "this file system has no locks: the file stands in for one"
        say(f"{path}: {what}, and stays if this process is killed")
    try:
        yield
    finally:
        if has_locks:
            with contextlib.suppress(OSError):
                os.truncate(path, 0)
        lock.release()


def _acquire(
    lock: FileLock,
    path: Path,
    limit_s: float,
    else_: str,
    say: Callable[[str], None],
) -> None:
    """Take a lock within a time, with a word at each time that it takes."""
    began = time.monotonic()
    patience_s = PATIENCE_S
    while True:
        left_s = limit_s - (time.monotonic() - began)
        try:
            with warnings.catch_warnings():
                # that it stands in for one is said below
                warnings.filterwarnings("ignore", "flock not supported")
                lock.acquire(timeout=max(0.0, min(patience_s, left_s)))
        except Timeout:
            if left_s <= patience_s:
                raise _in_use(path, else_) from None
            waits = f"waits for {path}, in use by {holder(path)}"
            say(f"{waits}; {_freed(path)}")
            patience_s *= 2
        else:
            return


def _in_use(path: Path, else_: str) -> OrchestratorError:
    """The failure to get a lock."""
    what = f"it is in use by {holder(path)}; its lock is {path}"
    return OrchestratorError(what, str(path.parent), f"{else_}; {_freed(path)}")


def _freed(path: Path) -> str:
    """How a lock is freed that a process which has ended has left."""
    return f"if that process does not run any more, remove {path}"


def is_held(path: Path) -> bool:
    """Whether a running process holds a lock; nothing is written.

    Parameters
    ----------
    path
        The file of the lock.

    Returns
    -------
    bool
        Whether one does. A file that stands in for a lock is held unless its process
        was on this machine and is gone.
    """
    try:
        with files.opened(path) as stream:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError as error:
        return error.errno == errno.ENOSYS and _stands_in(path)
    return False


def _stands_in(path: Path) -> bool:
    """Whether a file that stands in for a lock is that of a process that may run."""
    with contextlib.suppress(OSError):
        record = _RECORD.fullmatch(path.read_text(encoding="utf-8", errors="replace"))
        if record is not None:
            is_here = _machine(record[2]) == socket.gethostname()
            return not (is_here and not Path("/proc", record[1]).exists())
    return False
