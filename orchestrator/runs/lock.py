"""Who holds a directory: a lock that nobody ever has to take away by hand.

The operating system lets go of it however its holder ends. On a file system without such locks
the holder's note decides instead: its host, its process, and a beat that goes on while it lives.
"""

import contextlib
import errno
import fcntl
import os
import socket
import stat
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import IO

from orchestrator.errors import InputError, OrchestratorError
from orchestrator.runs.files import (
    canonical_json,
    opened,
    read_json,
    remove_empty_directory,
    write_durably,
)

BEAT_S = 10.0
"""Between two beats of a holder on a file system without locks."""
AGREE_S = 1.0
"""Time in which two that wrote their notes at once see whose is the later."""
WAIT_S = 1.0
"""For a lock that another has: less than anybody minds, more than a dying process takes."""
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}


@dataclass(frozen=True)
class Holder:
    """A process, told from every other that ever had its number.

    Attributes
    ----------
    host : str
        Name of its machine.
    pid : int
        Its number there.
    started : str
        The machine's boot, and the process's start in ticks since then.
    beat : int
        Counts up while it lives; on file systems without locks.
    """

    host: str
    pid: int
    started: str
    beat: int = 0

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}"

    def lives(self) -> bool | None:
        """Whether it runs; None if that cannot be seen from this machine."""
        if self.host != socket.gethostname():
            return None
        return _started(self.pid) == self.started


def this_process() -> Holder:
    """The process that asks."""
    return Holder(socket.gethostname(), os.getpid(), _started(os.getpid()))


def _started(pid: int) -> str:
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        # the name of a program, in brackets, may hold anything
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return ""
    return f"{boot} {fields[19].decode()}"


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """Hold a lock file for as long as the block runs.

    Raises
    ------
    OrchestratorError
        If another process holds it.
    """
    with contextlib.ExitStack() as stack:
        stream = stack.enter_context(open_file(path))
        stack.enter_context(_by_system(stream) if _lock(stream, path) else _by_note(path))
        yield


def holder(path: Path) -> Holder | None:
    """Who holds a lock file, as far as can be seen at once; nothing is written."""
    note = _read(path)
    try:
        with opened(path) as stream:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return note or Holder("this machine", 0, "")
    except OSError as error:
        known = note if error.errno in _NO_LOCKS else None
        return known if known and known.lives() is not False else None
    return None


def open_file(path: Path) -> IO[str]:
    """Open a lock file itself: no link to one, nor a pipe, which would wait for a reader.

    Raises
    ------
    InputError
        If it is no file.
    OSError
        If it is a link, or cannot be opened.
    """
    with contextlib.suppress(OSError):
        remove_empty_directory(path)
    if path.is_dir():
        raise InputError("the lock is not a file", where=str(path), remedy="remove it")
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise InputError("the lock is not a file", where=str(path), remedy="remove it")
    return os.fdopen(handle, "r+", encoding="utf-8")


def _lock(stream: IO[str], path: Path) -> bool:
    """Whether the system gave the lock; False where the file system has none to give."""
    started = time.monotonic()
    while True:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            # it may be someone's look at the lock, or what a killed holder started and is ending
            if time.monotonic() - started > WAIT_S:
                raise _refusal(_read(path), path) from None
        except OSError as error:
            if error.errno not in _NO_LOCKS:
                raise
            return False
        time.sleep(0.05)


def _refusal(other: Holder | None, path: Path) -> OrchestratorError:
    return OrchestratorError(
        f"it is in use by {other or 'another process'}",
        where=str(path.parent),
        remedy="wait for its end, or choose another directory with --out",
    )


@contextlib.contextmanager
def _by_system(stream: IO[str]) -> Iterator[None]:
    with contextlib.suppress(OSError):  # a full disk holds no note, but gives the lock
        _write(stream, _text(this_process()))
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            _write(stream, "")


def _write(stream: IO[str], text: str) -> None:
    """Replace the note, unless the file has another name: what that belongs to is not known."""
    if os.fstat(stream.fileno()).st_nlink == 1:
        stream.seek(0)
        stream.truncate()
        stream.write(text)
        stream.flush()


@contextlib.contextmanager
def _by_note(path: Path) -> Iterator[None]:
    other, me = _read(path), this_process()
    if other and (other.lives() or (other.lives() is None and _beats(path, other))):
        raise _refusal(other, path)
    write_durably(path, _text(me))
    time.sleep(AGREE_S)
    if _read(path) != me:
        raise _refusal(_read(path), path)
    over = threading.Event()
    heart = threading.Thread(target=_beat, args=(path, me, over), daemon=True)
    heart.start()
    try:
        yield
    finally:
        over.set()
        heart.join()
        with contextlib.suppress(OSError):
            write_durably(path, "")


def _beat(path: Path, me: Holder, over: threading.Event) -> None:
    count = 0
    while not over.wait(BEAT_S):
        count += 1
        # a full disk must not end the study: the beat goes on when there is room
        with contextlib.suppress(OSError):
            write_durably(path, _text(replace(me, beat=count)))


def _beats(path: Path, other: Holder) -> bool:
    """Whether a holder on another machine lives: its note changes meanwhile."""
    time.sleep(3 * BEAT_S)
    return _read(path) != other


def _text(note: Holder) -> str:
    return canonical_json(asdict(note)) + "\n"


def _read(path: Path) -> Holder | None:
    value = read_json(path)
    try:
        return Holder(**value) if isinstance(value, dict) else None
    except TypeError:
        return None
