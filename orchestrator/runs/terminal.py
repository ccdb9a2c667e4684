"""The process that a user started: its signals, and its standard streams.

The streams may be closed or full.
"""

import errno
import io
import os
import re
import signal
import sys
import textwrap
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn, TextIO

ENDING = (
    signal.SIGINT,
    signal.SIGTERM,
    signal.SIGHUP,
    signal.SIGQUIT,
    signal.SIGUSR1,
    signal.SIGUSR2,
    signal.SIGXCPU,
)
"""The signals by which a user, a closing terminal or a queue asks a command to end.

The last three are a queue's, before it kills, and the system's at a limit of processor
time.
"""
STDERR = 2
"""Number of the standard error's file descriptor."""
STREAMS = {1: "stdout", STDERR: "stderr"}
"""Names of the streams that are written, by their file descriptors."""
BOLD = "\x1b[1m"
PLAIN = "\x1b[0m"
_CODES = re.compile(r"\x1b\[[01]m")
ASCII = str.maketrans(
    {
        "●": "[x]",
        "◐": "[/]",
        "○": "[ ]",
        "…": "...",
        "−": "-",
        "–": "-",
        "×": "x",
        "’": "'",
        "“": '"',
        "”": '"',
        **dict(zip("▁▂▃▄▅▆▇█", "_.-:=+*#", strict=True)),
    }
)
"""What stands for some letters where the output has ASCII alone."""
WIDEST = 79
"""Letters of a line that fits any terminal."""
_interrupted = threading.Event()


def fitted(lines: Iterable[str]) -> str:
    """Break long lines, what follows of each two letters further in.

    Parameters
    ----------
    lines
        The lines.

    Returns
    -------
    str
        The text, without a line end.

    Examples
    --------
    >>> print(fitted(["  a case", "  " + "a word " * 12]))
      a case
      a word a word a word a word a word a word a word a word a word a word a word
        a word
    """
    broken: list[str] = []
    for line in lines:
        indent = line[: len(line) - len(line.lstrip())]
        broken += textwrap.wrap(
            line.strip(),
            WIDEST,
            initial_indent=indent,
            subsequent_indent=f"{indent}  ",
            break_long_words=False,
            break_on_hyphens=False,
        ) or [""]
    return "\n".join(broken)


def listen() -> None:
    """Let each of `ENDING` interrupt the command; one that is ignored stays so.

    Under nohup a closing terminal is ignored.
    """
    _interrupted.clear()
    for number in ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(number: int, frame: object) -> NoReturn:
    """Interrupt the command; afterwards only the keyboard may break into its end.

    A closing terminal sends its signal several times.
    """
    for each in ENDING:
        if each != signal.SIGINT:
            signal.signal(each, signal.SIG_IGN)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    _interrupted.set()
    raise KeyboardInterrupt


def check_signals() -> None:
    """Raise KeyboardInterrupt again if a signal of `ENDING` has come since `listen`.

    Python drops an exception that is raised in a callback of compiled code, such as
    matplotlib's.

    Raises
    ------
    KeyboardInterrupt
        If such a signal has come.
    """
    if _interrupted.is_set():
        raise KeyboardInterrupt


def bold(text: str) -> str:
    """Mark a text to be bold where it is shown by `shown` on a terminal.

    Parameters
    ----------
    text
        The text; an empty one stays so.

    Returns
    -------
    str
        The text with its marks.
    """
    return f"{BOLD}{text}{PLAIN}" if text else text


def plain(text: str) -> str:
    """Take the marks of `bold` from a text.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    str
        The text without them.
    """
    return _CODES.sub("", text)


def shown(text: str) -> str:
    """Write a text as standard output can show it.

    Parameters
    ----------
    text
        The text, with marks of `bold`.

    Returns
    -------
    str
        Bold on a terminal, unless NO_COLOR is set; plain elsewhere, and with other
        letters where the encoding has none.
    """
    if not _takes_codes():
        text = plain(text)
    encoding = str(getattr(sys.stdout, "encoding", None) or "utf-8")
    is_utf = encoding.lower().replace("-", "").startswith("utf")
    return text if is_utf else text.translate(ASCII)


def page_line(page: Path) -> str:
    """Write where a page is; on a terminal the path is a link.

    Parameters
    ----------
    page
        The file of the page.

    Returns
    -------
    str
        The line.
    """
    if not _takes_codes():
        return f"page: {page}"
    address = page.absolute().as_uri()
    return f"page: \x1b]8;;{address}\x1b\\{page}\x1b]8;;\x1b\\"


def _takes_codes() -> bool:
    """Whether standard output is a terminal that may be sent codes."""
    is_terminal = sys.stdout is not None and sys.stdout.isatty()
    is_dumb = os.environ.get("TERM") == "dumb"
    return is_terminal and not is_dumb and not os.environ.get("NO_COLOR")


class StandardStream(io.FileIO):
    """A standard stream that keeps its first failure instead of raising it.

    The study goes on when its answer cannot be printed.

    Attributes
    ----------
    failure
        Why something was lost. It is None if the stream's reader has gone, who misses
        nothing.
    """

    failure: OSError | None = None

    def write(self, data: Any) -> int:
        """Write what can be written; the rest is lost.

        Parameters
        ----------
        data
            The bytes.

        Returns
        -------
        int
            Number of bytes; all of them if some were lost.
        """
        try:
            return super().write(data) or len(data)
        except OSError as error:
            if error.errno != errno.EPIPE and self.failure is None:
                self.failure = error
            return len(data)


def take() -> None:
    """Make standard output and error of this process such streams, open or not."""
    _open_closed_streams()
    for number, name in STREAMS.items():
        given: TextIO | None = getattr(sys, name)
        is_replaced = given is not getattr(sys, f"__{name}__")
        if not is_replaced:
            setattr(
                sys, name, _as_text(StandardStream(number, "w", closefd=False), given)
            )


def _open_closed_streams() -> None:
    """Open standard streams that are closed, so that no file takes their place."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def _as_text(stream: StandardStream, given: TextIO | None) -> TextIO:
    """A text stream in the encoding of the one that it replaces."""
    return io.TextIOWrapper(
        io.BufferedWriter(stream),
        encoding=given.encoding if given else None,
        errors="backslashreplace",
        line_buffering=stream.fileno() == STDERR or stream.isatty(),
    )


def lost() -> OSError | None:
    """Say whether a part of the printed answer is lost.

    Returns
    -------
    OSError or None
        Why it is lost; None if nothing is.
    """
    sys.stdout.flush()
    buffer = getattr(sys.stdout, "buffer", None)
    raw = getattr(buffer, "raw", None)
    return raw.failure if isinstance(raw, StandardStream) else None
