"""Programs on the path, and what they answer about their version."""

import os
import re
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from orchestrator.errors import SolverError
from orchestrator.runs.process import run

QUERY_S, QUERY_BYTES = 30.0, 1_000_000
"""Limits of a program that is asked for its version."""


class Reply(NamedTuple):
    """Text of both streams of a program, and how it ended with its most telling line."""

    text: str
    gist: str


def ask(path: str, *arguments: str, env: Mapping[str, str | None] | None = None) -> Reply:
    """Run a program that ends at once, for what it prints; SolverError if it does not end."""
    command = [path, *arguments]
    with tempfile.TemporaryDirectory() as folder:
        here, log = Path(folder), Path(folder, "log")
        ended = run(command, cwd=here, log=log, limit_s=QUERY_S, env=env, output_limit=QUERY_BYTES)
        with log.open("rb") as stream:
            text = stream.read(QUERY_BYTES).decode(errors="replace")
    if ended.over == "time":
        what = f"{' '.join(command)} did not end within {QUERY_S:g} s"
        raise SolverError(what, remedy="try it by hand: what does it wait for?")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    telling = [line for line in lines if re.search("error|cannot|fail", line, re.IGNORECASE)]
    line = f"“{[*telling, *lines[-1:]][0]}”" if lines else "nothing"
    return Reply(text, f"it ended with {ended.returncode} and printed {line}")


def find(name: str, *, remedy: str) -> str:
    """The path of the program that a name stands for; SolverError if there is none."""
    path = shutil.which(name)
    if path is None:
        raise SolverError(f"the program {name} is not in PATH", remedy=remedy)
    return os.path.abspath(path)
