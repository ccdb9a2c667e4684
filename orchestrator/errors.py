"""Failures that a user can act on: each says what, where and what to do."""

import errno
import os
import shutil
import traceback
from pathlib import Path
from typing import ClassVar

LONGEST = 400
"""Characters of a message's place, cause and remedy, each."""
_FULL = (errno.ENOSPC, errno.EDQUOT)
_REMEDIES = dict.fromkeys(_FULL, "make room, then the same command continues") | {
    errno.EMFILE: "raise the limit: ulimit -n 1024",
    errno.ENOMEM: "free memory, or raise its limit: ulimit -v",
    errno.EAGAIN: "too many processes? See ulimit -u",
}


class OrchestratorError(Exception):
    """A failure that is printed without a traceback: what went wrong, where, and the remedy."""

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

    def __init_subclass__(cls) -> None:
        cls.ended = cls.__name__.lower()


class Exploded(SolverError):  # noqa: N818
    """A run whose numbers grow without bound."""


class Noisy(SolverError):  # noqa: N818
    """A run whose grains never come to rest."""


class Stalled(SolverError):  # noqa: N818
    """A run that hangs or circles without an end."""


class Interrupted(OrchestratorError):  # noqa: N818
    """The user stopped the run; the same command continues it."""

    exit_code = 130


def of_exception(error: BaseException, where: str = "") -> OrchestratorError:
    """The message of any exception: of the system, of a shortage, of a library, or a `Fault`."""
    if isinstance(error, OrchestratorError):
        return error
    if isinstance(error, KeyboardInterrupt):
        return Interrupted("stopped; the same command continues")
    if isinstance(error, OSError):
        # shutil collects the failure of each file: the first one is given
        text = str(error.args[0][0][2]) if isinstance(error, shutil.Error) else error.strerror
        number = errno.ENOSPC if "No space left" in (text or "") else error.errno or 0
        what = "no space is left on the disk" if number == errno.ENOSPC else text or str(error)
        file = "" if isinstance(error.filename, int | None) else os.fsdecode(error.filename)
        return OrchestratorError(what, file or where, _REMEDIES.get(number, ""))
    frames = traceback.extract_tb(error.__traceback__)
    is_at_import = any(frame.name == "<module>" for frame in frames)
    if "can't start new thread" in str(error):
        what, remedy = "no more threads can be started", "fewer --workers, or ulimit -u"
    elif isinstance(error, MemoryError) or (is_at_import and "failed to map" in str(error)):
        what, remedy = "there is not enough memory", "fewer --workers, or ulimit -v"
    elif isinstance(error, ImportError | SyntaxError) or is_at_import:
        what, remedy = f"a library does not load: {error}", "`orchestrator doctor` says which"
    else:
        at = f" at {Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""
        what = f"a fault of this program: {type(error).__name__}: {error}{at}"
        return Fault(what, where, "report it, with the study file")
    return OrchestratorError(what, where, remedy)
