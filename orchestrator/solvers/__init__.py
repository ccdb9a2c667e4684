"""The external programs: how each is run, which version it is, and what its end means."""

import os
import re
import shutil
import tempfile
import warnings
from collections.abc import Mapping
from pathlib import Path

from orchestrator.errors import SolverError
from orchestrator.runs.process import run

QUERY_S, QUERY_BYTES = 30.0, 1_000_000  # limits of a program that is asked for its version


def find(name: str, remedy: str) -> str:
    """The path of the program that a name stands for; SolverError if there is none."""
    path = shutil.which(name)
    if path is None:
        raise SolverError(f"the program {name} is not in PATH", remedy=remedy)
    return os.path.abspath(path)


def version(
    name: str, command: str, pattern: str, *, tried: str, env: Mapping[str, str], remedy: str
) -> str:
    """Run a command of a solver that prints its version: what its output has of the pattern.

    A version later than the one `tried` is a warning. Raises SolverError if the program is missing
    or older, does not end within 30 s, or prints nothing that fits.
    """
    path = find(command.split()[0], remedy)
    with tempfile.TemporaryDirectory() as folder:
        words, here, log = [path, *command.split()[1:]], Path(folder), Path(folder, "log")
        ended = run(words, cwd=here, log=log, limit_s=QUERY_S, env=env, output_limit=QUERY_BYTES)
        with log.open("rb") as stream:
            text = stream.read(QUERY_BYTES).decode(errors="replace")
    match = re.search(pattern, text)
    if match is None:
        end = "did not end" if ended.over == "time" else f"ended with {ended.returncode}"
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        telling = [line for line in lines if re.search("(?i)using:|error|cannot|fail", line)]
        line = f"“{[*telling, *lines[-1:]][0]}”" if lines else "nothing"
        raise SolverError(f"{path} is not a known {name}: it {end} and printed {line}", "", remedy)
    number = str(match[match.lastindex or 0])
    least = [int(part) for part in tried.split(".")]
    parts = [int(part) for part in number.split(".")][: len(least)]
    if parts < least:
        raise SolverError(f"{name} {number} is older than {tried}: it does not work", "", remedy)
    if parts > least:
        warnings.warn(f"{name} {number} has not been tried, {tried} has", stacklevel=2)
    return number
