"""Failures that a user can act on: each says what, where and what to do."""

import errno
import shutil

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

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what = what
        self.where = where
        self.remedy = remedy
        super().__init__(what, where, remedy)

    def __str__(self) -> str:
        place = f"{_line(self.where)}: " if self.where else ""
        advice = f" ({_line(self.remedy)})" if self.remedy else ""
        return f"{place}{_line(self.what)}{advice}"


def _line(text: str) -> str:
    """A text that is one line of bearable length on any terminal, whatever a user's file holds."""
    cut = text if len(text) <= MOST else f"{text[: MOST // 2]} ... {text[-MOST // 2 :]}"
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in cut)


class InputError(OrchestratorError):
    """The study file, an option or a value given by the user is not usable."""

    exit_code = 2


class SolverError(OrchestratorError):
    """A solver is missing, or its run did not end as it must."""

    exit_code = 3


class Interrupted(OrchestratorError):  # noqa: N818 - an end, not an error
    """The user stopped the run; the same command continues it."""

    exit_code = 130


def of_system(error: OSError, where: str = "") -> OrchestratorError:
    """The message of a failure of the file system; `where` is used if it does not say itself."""
    # shutil collects what went wrong with each file: the first one tells the story
    said = str(error.args[0][0][2]) if isinstance(error, shutil.Error) else error.strerror
    full = error.errno == errno.ENOSPC or "No space left" in (said or "")
    return OrchestratorError(
        "no space is left on the disk" if full else said or str(error),
        where=where or str(error.filename or ""),
        remedy="make room, then the same command continues" if full else "see the file system",
    )
