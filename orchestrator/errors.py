"""Failures that a user can act on: each says what, where and what to do."""

import difflib
import errno
import os
import re
import shutil
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import ClassVar

LONGEST = 400
"""Characters of a message's place, cause and remedy, each."""
_MAKE_ROOM = "make room, then the same command continues"
_REMEDIES = {
    errno.ENOSPC: _MAKE_ROOM,
    errno.EDQUOT: _MAKE_ROOM,
    errno.EMFILE: "raise the limit: ulimit -n 1024",
    errno.ENOMEM: "free memory, or raise its limit: ulimit -v",
    errno.EAGAIN: "too many processes? See ulimit -u",
}
"""What a user can do about an error of the operating system, by its number."""


class OrchestratorError(Exception):
    """A failure that is printed as one line, without a traceback.

    Parameters
    ----------
    what
        What went wrong.
    where
        The place: a file, a field of the study file, an option, a directory.
    remedy
        What the user can do.

    Attributes
    ----------
    exit_code
        Exit code of the command that ends with this failure.

    Examples
    --------
    >>> print(OrchestratorError("is negative", "a.toml: grain.diameter", "raise it"))
    a.toml: grain.diameter: is negative (raise it)
    """

    exit_code = 1

    def __init__(self, what: str, where: str = "", remedy: str = "") -> None:
        self.what = what
        self.where = where
        self.remedy = remedy
        super().__init__(what, where, remedy)

    def __str__(self) -> str:
        text = one_line(self.what)
        if self.where:
            text = f"{one_line(self.where)}: {text}"
        if self.remedy:
            text = f"{text} ({one_line(self.remedy)})"
        return text


def suggestion(word: str, known: Iterable[str]) -> str:
    """Suggest a known word for one that may be misspelt.

    Parameters
    ----------
    word
        What was written.
    known
        What could be meant.

    Returns
    -------
    str
        A question; empty where none is near.

    Examples
    --------
    >>> suggestion("watr", ["air", "water"]), suggestion("AIR", ["air", "water"])
    ('did you mean water?', 'did you mean air?')
    """
    spelt = {one.casefold(): one for one in known}
    for near in difflib.get_close_matches(word.casefold(), spelt, n=1):
        return f"did you mean {spelt[near]}?"
    return ""


def shown(value: object) -> str:
    """Write a value as a study file has it.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Its text.

    Examples
    --------
    >>> shown(True), shown({"a": [1, "x"]}), shown("x")
    ('true', "{ a = [1, 'x'] }", "'x'")
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        items = ", ".join(f"{key} = {shown(each)}" for key, each in value.items())
        return f"{{ {items} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(shown, value))}]"
    # TOML has dates, too
    return repr(value) if isinstance(value, str | int | float) else str(value)


def one_line(text: str) -> str:
    r"""Shorten a text to one line of printable characters.

    Parameters
    ----------
    text
        Any text, of any length.

    Returns
    -------
    str
        The text as `printable` makes it. Of a text with more than `LONGEST`
        characters the middle is left out.

    Examples
    --------
    >>> one_line("two\nlines")
    'two lines'
    >>> one_line("a" * 500).count("a")
    400
    """
    if len(text) > LONGEST:
        half = LONGEST // 2
        text = f"{text[:half]} ... {text[-half:]}"
    return printable(text)


def printable(text: str) -> str:
    r"""Escape control characters and bytes that are no text, for any terminal.

    Line ends and tabs become a blank.

    Parameters
    ----------
    text
        Any text.

    Returns
    -------
    str
        The text with printable characters alone.

    Examples
    --------
    >>> print(printable("red: \x1b[31m"))
    red: \x1b[31m
    """
    line = re.sub(r"\s*[\t\n\v\f\r]\s*", " ", text)
    return "".join(_escaped(character) for character in line)


def _escaped(character: str) -> str:
    """A character itself if it is printable, else its escape sequence."""
    if character.isprintable():
        return character
    return character.encode("unicode_escape").decode()


class InputError(OrchestratorError):
    """The study file, an option or a value given by the user is not usable."""

    exit_code = 2


class Fault(OrchestratorError):  # noqa: N818
    """An exception that nobody foresaw: a fault of this program."""


class SolverError(OrchestratorError):
    """A solver is missing, or its run did not end as it must.

    Attributes
    ----------
    ended
        The kind of its end: "failed", or the name of a subclass in lower case.
    """

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
    """Describe any exception to the user.

    Parameters
    ----------
    error
        The exception: of this program, of the operating system, of a library.
    where
        The place, for exceptions that do not name one.

    Returns
    -------
    OrchestratorError
        The exception itself if it is one, else one with a cause and a remedy. It is
        a `Fault` if the exception is of no kind that a user can act on.

    Examples
    --------
    >>> print(of_exception(FileNotFoundError(2, "No such file", "a.csv")))
    a.csv: No such file
    """
    if isinstance(error, OrchestratorError):
        return error
    if isinstance(error, KeyboardInterrupt):
        return Interrupted("stopped; the same command continues")
    if isinstance(error, OSError):
        return _of_the_system(error, where)
    return _of_the_program(error, where)


def _of_the_system(error: OSError, where: str) -> OrchestratorError:
    """Describe an error of the operating system, with the remedy for its number."""
    text = error.strerror
    if isinstance(error, shutil.Error):
        # shutil collects the failure of each file: the first one is given
        text = str(error.args[0][0][2])
    number = error.errno or 0
    if "No space left" in (text or ""):
        number = errno.ENOSPC
    what = text or str(error)
    if number == errno.ENOSPC:
        what = "no space is left on the disk"
    # some errors have a file descriptor, or nothing, in the place of a name
    if not isinstance(error.filename, int | None):
        where = os.fsdecode(error.filename) or where
    return OrchestratorError(what, where, _REMEDIES.get(number, ""))


def _of_the_program(error: BaseException, where: str) -> OrchestratorError:
    """Describe a shortage of memory or threads, a broken library, or a fault."""
    frames = traceback.extract_tb(error.__traceback__)
    is_at_import = any(frame.name == "<module>" for frame in frames)
    is_unmapped = is_at_import and "failed to map" in str(error)
    if "can't start new thread" in str(error):
        what = "no more threads can be started"
        return OrchestratorError(what, where, "fewer --workers, or ulimit -u")
    if isinstance(error, MemoryError) or is_unmapped:
        what = "there is not enough memory"
        return OrchestratorError(what, where, "fewer --workers, or ulimit -v")
    if isinstance(error, ImportError | SyntaxError) or is_at_import:
        what = f"a library does not load: {error}"
        return OrchestratorError(what, where, "`orchestrator doctor` says which")
    what = f"a fault of this program: {type(error).__name__}: {error}"
    if frames:
        last = frames[-1]
        what = f"{what} at {Path(last.filename).name}, line {last.lineno}"
    return Fault(what, where, "report it, with the study file")
