"""Failures that a user can act on: each says what, where and what to do."""

import difflib
import errno
import os
import shutil
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

LONGEST = 400
"""Characters of a message's place, cause and remedy, each."""
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
        self.what, self.where, self.remedy = what, where, remedy
        super().__init__(what, where, remedy)

    def __str__(self) -> str:
        place = f"{one_line(self.where)}: " if self.where else ""
        advice = f" ({one_line(self.remedy)})" if self.remedy else ""
        return f"{place}{one_line(self.what)}{advice}"


def one_line(text: str) -> str:
    """A text as one line of at most `LONGEST` printable characters, the middle left out."""
    half = LONGEST // 2
    return printable(text if len(text) <= LONGEST else f"{text[:half]} ... {text[-half:]}")


def printable(text: str) -> str:
    """A text with control characters and bytes that are no text escaped, for any terminal."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class InputError(OrchestratorError):
    """The study file, an option or a value given by the user is not usable."""

    exit_code = 2


class Fault(OrchestratorError):  # noqa: N818
    """An exception that nobody foresaw: a fault of this program."""


class SolverError(OrchestratorError):
    """A solver is missing, or its run did not end as it must; `ended` is the kind of its end."""

    exit_code = 3
    ended: ClassVar[str] = "failed"


class Exploded(SolverError):  # noqa: N818
    """A run whose numbers grow without bound."""

    ended = "exploded"


class Noisy(SolverError):  # noqa: N818
    """A run whose grains never come to rest."""

    ended = "noisy"


class Stalled(SolverError):  # noqa: N818
    """A run that hangs or circles without an end."""

    ended = "stalled"


class Interrupted(OrchestratorError):  # noqa: N818
    """The user stopped the run; the same command continues it."""

    exit_code = 130


def of_system(error: OSError, where: str = "") -> OrchestratorError:
    """The message of a failure of the system, at `where` or the file that the error names."""
    # shutil collects the failure of each file: the first one is given
    text = str(error.args[0][0][2]) if isinstance(error, shutil.Error) else error.strerror
    if error.errno == errno.ENOSPC or "No space left" in (text or ""):
        text, remedy = "no space is left on the disk", _REMEDIES[errno.ENOSPC]
    else:
        remedy = _REMEDIES.get(error.errno or 0, "see the file system")
    name = error.filename
    place = where or ("" if name is None or isinstance(name, int) else os.fsdecode(name))
    return OrchestratorError(text or str(error), place, remedy)


def of_exception(error: BaseException, where: str = "") -> OrchestratorError:
    """The message of any exception: of the system, of a shortage, of a library, or a `Fault`."""
    frames = traceback.extract_tb(error.__traceback__)
    is_at_import = any(frame.name == "<module>" for frame in frames)
    if isinstance(error, OrchestratorError):
        return error
    if isinstance(error, KeyboardInterrupt):
        # OpenBLAS raises SIGINT where it can start no thread
        reason = "; or no thread can be started: see ulimit -u" if is_at_import else ""
        return Interrupted(f"stopped; the same command continues{reason}")
    if isinstance(error, OSError):
        return of_system(error, "" if error.filename else where)
    if "can't start new thread" in str(error):
        what, remedy = "no more threads can be started", "fewer --workers, or ulimit -u"
    elif isinstance(error, MemoryError) or (is_at_import and "failed to map" in str(error)):
        what, remedy = "there is not enough memory", "fewer --workers, or ulimit -v"
    elif isinstance(error, ImportError | SyntaxError) or is_at_import:
        what = f"a library does not load: {error}"
        remedy = "`orchestrator doctor` says what is missing"
    else:
        at = f" at {Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""
        what = f"a fault of this program: {type(error).__name__}: {error}{at}"
        return Fault(what, where, "report it, with the study file")
    return OrchestratorError(what, where, remedy)


def unknown_key(
    key: str, known: Sequence[str], where: str, elsewhere: Sequence[tuple[str, str]] = ()
) -> InputError:
    """The message of an unknown key, with the key that was probably meant as the remedy.

    `elsewhere` has keys of other places, each with the way it is written there. A key of the same
    name is suggested first, then the nearest of `known`, then the nearest of the others.
    """
    same = [written for name, written in elsewhere if name == key]
    there = difflib.get_close_matches(key, [name for name, _ in elsewhere], n=1, cutoff=0.7)
    near = [written for name, written in elsewhere if name in there]
    close = same or difflib.get_close_matches(key, known, n=1) or near
    meant, listed = f"did you mean {' or '.join(close)}?", f"known keys: {', '.join(sorted(known))}"
    return InputError("unknown key", where, meant if close else listed)
