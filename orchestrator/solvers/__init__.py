"""The external programs: how they run, which version they are, what their end means."""

import os
import re
import shutil
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

from orchestrator.errors import SolverError
from orchestrator.runs.process import Ended, run

QUERY_S = 30.0
"""Time that a program may take to print its version, s."""
QUERY_BYTES = 1_000_000
"""Most that it may print, bytes."""
_TELLING = "(?i)using:|error|cannot|fail"
"""Pattern of the lines that say best what a program is, or why it failed."""


def find_program(name: str, remedy: str) -> str:
    """Find a program.

    Parameters
    ----------
    name
        Name of the program.
    remedy
        What the user can do if there is none.

    Returns
    -------
    str
        Its absolute path.

    Raises
    ------
    SolverError
        If no program of that name is in PATH.
    """
    path = shutil.which(name)
    if path is None:
        raise SolverError(f"the program {name} is not in PATH", remedy=remedy)
    return os.path.abspath(path)


def version(
    name: str,
    command: str,
    pattern: str,
    *,
    tried: str,
    env: Mapping[str, str],
    remedy: str,
) -> str:
    """Ask a solver for its version; one that is later than the one tried is a warning.

    Parameters
    ----------
    name
        Name of the solver, for messages.
    command
        Its command that prints the version, with arguments.
    pattern
        Regular expression of the version in what it prints. The version is the group
        that matches last, or the whole match.
    tried
        Version that the tests ran with, numbers with points between.
    env
        Variables that are added to the environment.
    remedy
        What the user can do if the solver is missing or another program.

    Returns
    -------
    str
        The version.

    Raises
    ------
    SolverError
        If the program is missing or older, does not end within 30 s, or prints nothing
        that fits.
    """
    program, *arguments = command.split()
    path = find_program(program, remedy)
    ended, text = _answer([path, *arguments], env)
    match = re.search(pattern, text)
    if match is None:
        end = _end_in_words(ended, text)
        raise SolverError(f"{path} is not a known {name}: it {end}", "", remedy)
    number = str(match[match.lastindex or 0])
    least = _parts(tried)
    parts = _parts(number)[: len(least)]
    if parts < least:
        what = f"{name} {number} is older than {tried}: it does not work"
        raise SolverError(what, "", remedy)
    if parts > least:
        what = f"{name} {number} has not been tried, {tried} has"
        warnings.warn(what, stacklevel=2)
    return number


def _answer(command: Sequence[str], env: Mapping[str, str]) -> tuple[Ended, str]:
    """Run a command in an empty directory; how it ended, and what it printed."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "log")
        ended = run(
            command,
            cwd=Path(folder),
            log=log,
            limit_s=QUERY_S,
            env=env,
            output_limit=QUERY_BYTES,
        )
        with log.open("rb") as stream:
            text = stream.read(QUERY_BYTES).decode(errors="replace")
    return ended, text


def _end_in_words(ended: Ended, text: str) -> str:
    """How a program ended, and the line that it printed which says most."""
    end = f"ended with {ended.returncode}"
    if ended.over == "time":
        end = "did not end"
    stripped = [line.strip() for line in text.splitlines()]
    lines = [line for line in stripped if line]
    if not lines:
        return f"{end} and printed nothing"
    telling = [line for line in lines if re.search(_TELLING, line)]
    line = telling[0] if telling else lines[-1]
    return f"{end} and printed “{line}”"


def _parts(number: str) -> list[int]:
    """The numbers of a version."""
    return [int(part) for part in number.split(".")]
