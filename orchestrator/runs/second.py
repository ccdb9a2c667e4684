"""A second process of this program, which shares pieces of work with it."""

import ctypes
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from orchestrator.runs import processors
from orchestrator.runs.terminal import ENDING

FORK = "fork"
"""The way to start it that needs neither imports nor copies of what is read."""
PR_SET_PDEATHSIG = 1
"""Option of Linux' prctl: the signal that a process gets when its parent dies."""
Result = TypeVar("Result")


def shared(work: Callable[[int], Result], count: int) -> list[Result]:
    """Do pieces of work in this process, and in a second one if a processor is free.

    Each process takes the next piece that none has taken. The second one changes
    nothing in this one: it gives back its results, which can be pickled. If it dies,
    this one does its pieces.

    Parameters
    ----------
    work
        Does a piece by its number.
    count
        Number of pieces.

    Returns
    -------
    list
        The results, in the order of the pieces.
    """
    can_fork = FORK in multiprocessing.get_all_start_methods()
    if count < 2 or not can_fork or processors.usable_count() < 2:
        return [work(number) for number in range(count)]
    context: Any = multiprocessing.get_context(FORK)
    taken = context.Value("i", 0)

    def all_left() -> dict[int, Result]:
        found: dict[int, Result] = {}
        while True:
            with taken.get_lock():
                number = int(taken.value)
                taken.value += 1
            if number >= count:
                return found
            found[number] = work(number)

    results, given = context.Pipe(duplex=False)
    # what waits to be printed would be printed by both
    sys.stdout.flush()
    second = context.Process(target=_serve, args=(all_left, given), daemon=True)
    second.start()
    given.close()
    try:
        found = all_left()
        # the end of the file: it died
        with suppress(EOFError, OSError):
            found |= results.recv()
    finally:
        second.kill()
        second.join()
    return [found[n] if n in found else work(n) for n in range(count)]


def _serve(work: Callable[[], object], given: Any) -> None:
    """Work in the second process, which ends with the first."""
    for number in ENDING:
        signal.signal(number, signal.SIG_DFL)
    # the first one is interrupted by the keyboard, and ends this one
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    first = multiprocessing.parent_process()
    if first is not None and os.getppid() == first.pid:
        # the first one does a piece that fails here, and says why it fails
        with suppress(Exception):
            given.send(work())
