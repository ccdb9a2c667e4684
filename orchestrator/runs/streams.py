"""Standard streams that may be closed, full or without a reader: none of that ends a study."""

import codecs
import errno
import io
import os
import sys
from typing import Any, TextIO

LETTERS = "orchestrator.letters"
"""The way to write what an encoding has no letter for, by its name."""


class Stream(io.FileIO):
    """A standard stream that keeps its first failure instead of raising it.

    Attributes
    ----------
    failure : OSError or None
        Why something was lost; None if its reader has gone, who misses nothing.
    """

    failure: OSError | None = None

    def write(self, data: Any) -> int:
        """Write what can be written; the rest is lost."""
        try:
            return super().write(data) or len(data)
        except OSError as error:
            if error.errno != errno.EPIPE:
                self.failure = self.failure or error
            return len(data)


def take() -> None:
    """Make the standard output and error of this process such streams, whatever it was given."""
    _open_closed()
    codecs.register_error(LETTERS, _letters)
    if sys.stdout is sys.__stdout__:
        sys.stdout = _text(1, sys.stdout)
    if sys.stderr is sys.__stderr__:
        sys.stderr = _text(2, sys.stderr)


def lost() -> OSError | None:
    """Why a part of what was printed for the user is lost, if it is."""
    sys.stdout.flush()
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    return raw.failure if isinstance(raw, Stream) else None


def _open_closed() -> None:
    """Give closed streams to nobody: else the next file that is opened is written into."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def _text(number: int, given: TextIO | None) -> TextIO:
    stream = Stream(number, "w", closefd=False)
    if given is not None:
        given.flush()
    return io.TextIOWrapper(
        io.BufferedWriter(stream),
        encoding=given.encoding if given is not None else "utf-8",
        errors=LETTERS,
        line_buffering=number == 2 or stream.isatty(),
    )


def _letters(error: UnicodeError) -> tuple[str | bytes, int]:
    """Bytes of a file's name as they are, and letters that the encoding has not as numbers."""
    try:
        return codecs.lookup_error("surrogateescape")(error)
    except UnicodeError:
        return codecs.backslashreplace_errors(error)
