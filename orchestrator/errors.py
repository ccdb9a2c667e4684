"""Failures that a user can act on: each says what, where and what to do."""

import difflib
import errno
import os
import shutil
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

MOST = 400
"""Characters of a message's place, cause and remedy, each."""


class OrchestratorError(Exception):
    """A failure with a place and a remedy; the command line prints it without a traceback.

    Parameters
    ----------
    what : str
        What went wrong, in one sentence.
    where : str, optional
        The file, field or case that it happened in.
    remedy : str, optional
        What the user can do about it.
    """

    exit_code = 1

    def __init__(self, what: str, where: str = "", remedy: str = "") -> None:
        self.what = what
        self.where = where
        self.remedy = remedy
        super().__init__(what, where, remedy)

    def __str__(self) -> str:
        place = f"{one_line(self.where)}: " if self.where else ""
        advice = f" ({one_line(self.remedy)})" if self.remedy else ""
        return f"{place}{one_line(self.what)}{advice}"


def one_line(text: str) -> str:
    """A text that is one line of bearable length on any terminal, whatever a user's file holds."""
    return printable(text if len(text) <= MOST else f"{text[: MOST // 2]} ... {text[-MOST // 2 :]}")


def printable(text: str) -> str:
    """A text that moves no cursor, and that any file can hold: no control letters, no bytes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class InputError(OrchestratorError):
    """The study file, an option or a value given by the user is not usable."""

    exit_code = 2


class SolverError(OrchestratorError):
    """A solver is missing, or its run did not end as it must."""

    exit_code = 3
    ended: ClassVar[str] = "failed"
    """One word for the kind of end."""


class Exploded(SolverError):  # noqa: N818 - an end, not an error
    """A run whose numbers grow without bound."""

    ended = "exploded"


class Noisy(SolverError):  # noqa: N818
    """A run whose grains never come to rest."""

    ended = "noisy"


class Stalled(SolverError):  # noqa: N818
    """A run that hangs or circles without an end."""

    ended = "stalled"


class Interrupted(OrchestratorError):  # noqa: N818 - an end, not an error
    """The user stopped the run; the same command continues it."""

    exit_code = 130


_REMEDIES = {
    errno.ENOSPC: "make room, then the same command continues",
    errno.EDQUOT: "make room, then the same command continues",
    errno.EACCES: "see its owner and mode, and those of its directory: ls -ld",
    errno.EPERM: "is it immutable, or another user's? See lsattr -d and ls -ld",
    errno.EMFILE: "raise the limit: ulimit -n 1024",
    errno.ENFILE: "too many files are open on this machine",
    errno.ENOMEM: "free memory, or raise its limit: ulimit -v",
    errno.EAGAIN: "too many processes? See ulimit -u",
    errno.ENAMETOOLONG: "choose a shorter path",
}


def of_system(error: OSError, where: str = "") -> OrchestratorError:
    """The message of a failure of the file system, at `where` or the file that it tells itself."""
    # shutil collects what went wrong with each file: the first one tells the story
    said = str(error.args[0][0][2]) if isinstance(error, shutil.Error) else error.strerror
    full = error.errno == errno.ENOSPC or "No space left" in (said or "")
    number = errno.ENOSPC if full else error.errno
    return OrchestratorError(
        "no space is left on the disk" if full else said or str(error),
        where=where or _path(error.filename),
        remedy=_REMEDIES.get(number or 0, "see the file system"),
    )


def _path(name: str | bytes | int | None) -> str:
    """A file's name as a text; of an open file only its number is known."""
    return "" if name is None or isinstance(name, int) else os.fsdecode(name)


def is_of_import(error: BaseException) -> bool:
    """Whether an exception came from a module that was being imported."""
    frames = traceback.extract_tb(error.__traceback__)
    return isinstance(error, SyntaxError) or any(one.name == "<module>" for one in frames)


_NO_THREAD = "can't start new thread"


def is_of_shortage(error: Exception) -> bool:
    """Whether memory or threads are lacking, or a library does not load."""
    return isinstance(error, MemoryError | ImportError) or _NO_THREAD in str(error)


def of_shortage(error: Exception) -> OrchestratorError:
    """The message of memory or threads that are lacking, or of a library that does not load."""
    if _NO_THREAD in str(error):
        return OrchestratorError(
            "no more threads can be started", remedy="fewer --workers, or a higher limit: ulimit -u"
        )
    if not isinstance(error, MemoryError) and "failed to map" not in str(error):
        return OrchestratorError(
            f"a library does not load: {error}", remedy="`orchestrator doctor` says what is missing"
        )
    return OrchestratorError(
        "there is not enough memory", remedy="fewer --workers, or a higher limit: ulimit -v"
    )


def of_fault(error: Exception, where: str) -> OrchestratorError:
    """The message of an exception that nobody foresaw: a fault of this program."""
    frames = traceback.extract_tb(error.__traceback__)
    at = f" at {Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""
    return OrchestratorError(
        f"a fault of this program: {type(error).__name__}: {error}{at}",
        where=where,
        remedy="report it, with the study file",
    )


def unknown_key(
    key: str, known: Sequence[str], where: str, elsewhere: Sequence[tuple[str, str]] = ()
) -> InputError:
    """The message of a key that nothing knows, with the key that was meant as the remedy.

    Keys of other places come with how they are written there: one of the same name is meant, else
    the nearest here, else the nearest there.
    """
    close = [written for name, written in elsewhere if name == key]
    close = close or difflib.get_close_matches(key, known, n=1)
    near = difflib.get_close_matches(key, [name for name, _ in elsewhere], n=1, cutoff=0.7)
    close = close or [written for name, written in elsewhere if name in near]
    hint = (
        f"did you mean {' or '.join(close)}?"
        if close
        else f"known keys: {', '.join(sorted(known))}"
    )
    return InputError("unknown key", where=where, remedy=hint)
