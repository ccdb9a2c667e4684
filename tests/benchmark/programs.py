"""Solvers of the tests: the example but for something."""

import shlex
import sys
from pathlib import Path

from tests.benchmark.conftest import NATIVE

HEAD = """
import math, os, sys, time
from pathlib import Path
sys.path.insert(0, {native!r})
import solver
case, out = map(Path, sys.argv[1:])
"""
TAIL = "\nsys.exit(solver.main(case, out))\n"
AFTER = "\ncode = solver.main(case, out)\ntext = out.read_text()\n"
"""What follows changes the answer of the right solver."""


def program(folder: Path, body: str) -> str:
    """A solver that is the example but for something."""
    path = folder / "my solver.py"
    path.write_text(HEAD.format(native=str(NATIVE)) + body)
    return f"{shlex.join([sys.executable, str(path)])} {{case}} {{out}}"
