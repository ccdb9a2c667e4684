"""The process that a user started: its signals, and standard streams that may be closed or full."""

import errno
import io
import os
import signal
import sys
import threading
from typing import Any, NoReturn, TextIO

ENDING = (
    *(signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT),
    *(signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU),
)
"""The signals by which a user, a closing terminal or a queue asks a command to end. The last three
are a queue's, before it kills, and the system's at a limit of processor time."""
_interrupted = threading.Event()


def listen() -> None:
    """Let each of `ENDING` interrupt the command; an ignored one, as under nohup, stays so."""
    _interrupted.clear()
    for number in ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(number: int, frame: object) -> NoReturn:
    # a closing terminal asks several times: only the keyboard may break into the end of the command
    for each in ENDING:
        signal.signal(each, signal.SIG_DFL if each == signal.SIGINT else signal.SIG_IGN)
    _interrupted.set()
    raise KeyboardInterrupt


def check() -> None:
    """Raise KeyboardInterrupt again if a signal of `ENDING` has come since `listen`.

    Python drops an exception that is raised in a callback of compiled code, such as matplotlib's.
    """
    if _interrupted.is_set():
        raise KeyboardInterrupt


class Stream(io.FileIO):
    """A standard stream that keeps its first failure instead of raising it: the study goes on."""

    failure: OSError | None = None
    """Why something was lost; None if its reader has gone, who misses nothing."""

    def write(self, data: Any) -> int:
        """Write what can be written; the rest is lost."""
        try:
            return super().write(data) or len(data)
        except OSError as error:
            if error.errno != errno.EPIPE:
                self.failure = self.failure or error
            return len(data)


def take() -> None:
    """Make the standard output and error of this process such streams, open or not."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:  # closed: else the next file that is opened would be written into
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for number, name in ((1, "stdout"), (2, "stderr")):
        given: TextIO | None = getattr(sys, name)
        if given is getattr(sys, f"__{name}__"):
            stream, encoding = Stream(number, "w", closefd=False), given.encoding if given else None
            buffer, by_line = io.BufferedWriter(stream), number == 2 or stream.isatty()
            text = io.TextIOWrapper(buffer, encoding, "backslashreplace", line_buffering=by_line)
            setattr(sys, name, text)


def lost() -> OSError | None:
    """Why a part of the printed answer is lost, if it is."""
    sys.stdout.flush()
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    return raw.failure if isinstance(raw, Stream) else None
