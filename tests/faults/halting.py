"""The command line, which halts when it first opens a file whose path fits a pattern.

    python -m tests.faults.halting PATTERN study small.toml ...

It stops itself, as SIGSTOP from outside would, but at a known place: whatever a test then does
to it or to its files happens in the midst of that work, on a machine of any speed.
"""

import os
import runpy
import signal
import sys
import threading
from fnmatch import fnmatchcase


def _halt_at(pattern: str) -> None:
    """Stop this process when it first opens such a file, before the file is opened."""
    met = threading.Lock()

    def look(event: str, arguments: tuple[object, ...]) -> None:
        if event != "open" or not isinstance(arguments[0], str | os.PathLike):
            return
        fits = fnmatchcase(str(arguments[0]), pattern)
        if fits and met.acquire(blocking=False):
            # to this thread: it does not go on even by one step
            signal.pthread_kill(threading.get_ident(), signal.SIGSTOP)

    sys.addaudithook(look)


if __name__ == "__main__":
    _, pattern, *words = sys.argv
    _halt_at(pattern)
    sys.argv[:] = ["orchestrator", *words]
    runpy.run_module("orchestrator", run_name="__main__", alter_sys=True)
