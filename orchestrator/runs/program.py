"""A program of somebody else's: where it is, and what it says when it is asked."""

import errno
import os
import re
import select
import shutil
import signal
import subprocess
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from orchestrator.errors import SolverError, of_system
from orchestrator.runs.process import end_group, end_of

MOST_SAID = 1_000_000
"""Bytes that are listened to; some have a banner in front of what they are asked."""
LIMIT_S = 30.0
_STARTS = {
    errno.ENOEXEC: "is it a script without #! in its first line, or of another kind of machine?",
    errno.ENOENT: "is the interpreter there that its first line names?",
}


@dataclass(frozen=True)
class Said:
    """Output and end of a program.

    Attributes
    ----------
    text : str
        Text of both streams; bytes that are no UTF-8 are replaced.
    returncode : int
        As `subprocess` gives it: negative where a signal ended the program.
    """

    text: str
    returncode: int

    @property
    def gist(self) -> str:
        """How it ended and its telling line, for a message."""
        lines = [line.strip() for line in self.text.splitlines() if line.strip()]
        telling = (line for line in lines if re.search(r"error|cannot|fail", line, re.IGNORECASE))
        line = next(telling, lines[-1] if lines else "")
        how = (
            f"was killed by {signal.Signals(-self.returncode).name}"
            if self.returncode < 0
            else f"ended with {self.returncode}"
        )
        return f"it {how} and said {f'“{line}”' if line else 'nothing'}"


def find(name: str, *, remedy: str) -> str:
    """The path of the program that a name stands for.

    Raises
    ------
    SolverError
        If there is none that may be run.
    """
    path = shutil.which(name)
    if path:
        return os.path.abspath(path)
    for found in (Path(folder, name).absolute() for folder in os.get_exec_path()):
        if found.is_file():
            raise SolverError(f"{found} may not be run", remedy=f"chmod +x {found}")
    raise SolverError(f"the program {name} is not in PATH", remedy=remedy)


def ask(path: str, *arguments: str, env: Mapping[str, str]) -> Said:
    """Run a program that answers at once, in an environment, and listen.

    Raises
    ------
    SolverError
        If it does not start, or does not end.
    """
    try:
        process = subprocess.Popen(
            [path, *arguments],
            env=env,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    except OSError as error:
        raise _not_started(path, error) from None
    with process:
        try:
            said = _listen(process, time.monotonic() + LIMIT_S)
        finally:
            end_group(process)
    if said is None:
        raise SolverError(
            f"{' '.join([path, *arguments])} did not end within {LIMIT_S:g} s",
            remedy="try it by hand: what does it wait for?",
        )
    return Said(said.decode("utf-8", "replace"), process.returncode)


def _not_started(path: str, error: OSError) -> SolverError:
    known = of_system(error, path)
    return SolverError(
        f"{path} does not start: {known.what}", remedy=_STARTS.get(error.errno or 0, known.remedy)
    )


def _listen(process: "subprocess.Popen[bytes]", deadline: float) -> bytes | None:
    """Output of a program until its end, or until it is enough; None if it goes on too long."""
    assert process.stdout
    stream, said = process.stdout.fileno(), b""
    # what it has started may hold the stream open when it has ended itself
    with end_of(process) as end:
        end.register(stream, select.POLLIN)
        while len(said) < MOST_SAID:
            ready = dict(end.poll(1000 * max(0.0, deadline - time.monotonic())))
            if not ready:
                return None
            part = os.read(stream, MOST_SAID) if stream in ready else b""
            said += part
            if stream not in ready:
                break
            if not part:
                end.unregister(stream)
    return said
