"""Solvers of the tests: the example but for something."""

import shlex
import sys
from pathlib import Path

import pandas as pd

from orchestrator.benchmark import compare
from orchestrator.benchmark.compare import Choice, Limits, Outcome
from tests.benchmark.conftest import NATIVE

SMALL = Limits(seconds=60.0, memory=2**29)
TWO = Choice(patterns=("2-incline-5", "2-incline-20"))
RIGHT = f"{shlex.join([sys.executable, str(NATIVE / 'solver.py')])} {{case}} {{out}}"
"""Command of the example."""
HEAD = """
import math, os, sys, time
from pathlib import Path
sys.path.insert(0, {native!r})
import solver
case, out = map(Path, sys.argv[1:])
"""
TAIL = "\nsys.exit(solver.main(case, out))\n"
AFTER = "\ncode = solver.main(case, out)\ntext = out.read_text()\n"
"""Beginning of a body that changes the answer of the right solver."""


def program(folder: Path, body: str) -> str:
    """The command of a solver that is the example but for something."""
    path = folder / "my solver.py"
    path.write_text(HEAD.format(native=str(NATIVE)) + body)
    return f"{shlex.join([sys.executable, str(path)])} {{case}} {{out}}"


def run(
    pack: Path, folder: Path, body: str, choice: Choice = TWO, limits: Limits = SMALL
) -> Outcome:
    """Run a solver of such a body on a pack, into `results` of a folder."""
    return compare.run(pack, program(folder, body), folder / "results", choice, limits)


def verdicts_in(folder: Path) -> pd.DataFrame:
    """The verdicts of that run, by scene."""
    return pd.read_csv(folder / "results" / "verdicts.csv").set_index("scene")
