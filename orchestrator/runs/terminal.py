"""The process that a user started: its signals, and its standard streams.

The streams may be closed or full.
"""

import errno
import io
import os
import signal
import sys
import threading
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
_interrupted = threading.Event()


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
