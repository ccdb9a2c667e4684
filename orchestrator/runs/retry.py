"""Run a program again, a few times, if something outside of it ended it."""

import signal
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

from orchestrator.runs import process
from orchestrator.runs.process import Ended

MOST = 3
"""Tries in all. What kills a program three times in a row is no accident: out of memory, say."""
_OUTSIDE = {signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP}
"""Signals that come from outside; those of a crash would come again."""


def run(
    command: Sequence[str],
    *,
    cwd: Path,
    log: Path,
    limit_s: float,
    stop: threading.Event | None = None,
    env: Mapping[str, str] | None = None,
) -> Ended:
    """Run a program as `orchestrator.runs.process.run` does; again if its end can pass.

    The program must start afresh each time, as ``Allrun`` does.

    Returns
    -------
    Ended
        The end of the last try; the seconds are its own.
    """
    tries = 0
    while True:
        ended = process.run(command, cwd=cwd, log=log, limit_s=limit_s, stop=stop, env=env)
        tries += 1
        if tries == MOST or not can_pass(ended):
            return ended


def can_pass(ended: Ended) -> bool:
    """Whether a program ended by what may not come again: killed, not crashed, failed or hung."""
    # a shell says 128 + n of a program that signal n ended
    code = -ended.returncode if ended.returncode < 0 else ended.returncode - 128
    return code in _OUTSIDE and not ended.timed_out
