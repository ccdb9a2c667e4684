"""The signals by which a user, a closing terminal or a queue asks a command to end."""

import signal
from typing import NoReturn

ENDING = (
    *(signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT),
    *(signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU),
)
"""The last three are a queue's, before it kills, and the system's at a limit of processor time."""


def listen() -> None:
    """Let each of them interrupt the command; one that is ignored, as under nohup, stays so."""
    for number in ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(number: int, frame: object) -> NoReturn:
    # a closing terminal asks several times: only the keyboard may break into the end of the command
    for each in ENDING:
        signal.signal(each, signal.SIG_DFL if each == signal.SIGINT else signal.SIG_IGN)
    raise KeyboardInterrupt
