"""A case that is run by hand says so where its solver did not come to its end.

Solvers end with 0 in many of these cases: what they have said counts.
"""

import os
import subprocess
from pathlib import Path

import pytest

from tests.flow.conftest import copied

TABLES = ("wall_stress.csv", "diagnostics.csv")


def by_hand(case: Path, folder: Path, program: str, script: str) -> tuple[int, str]:
    """The exit code and the errors of `Allrun` with another solver of that name."""
    stub = folder / "bin" / program
    stub.parent.mkdir()
    stub.write_text(f"#!/bin/sh\n{script}\n")
    stub.chmod(0o755)
    path = f"{stub.parent}{os.pathsep}{os.environ['PATH']}"
    ended = subprocess.run(
        ["./Allrun"],
        cwd=case,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
    )
    return ended.returncode, ended.stderr


@pytest.mark.parametrize(
    ("said", "code", "expected"),
    [
        ("SIMPLE solution converged in 5 iterations", 0, 0),
        ("Time = 3000", 0, 1),
        ("", 0, 1),
        ("SIMPLE solution converged in 5 iterations", 3, 3),
    ],
)
def test_a_flow_that_did_not_converge(
    tmp_path: Path, said: str, code: int, expected: int
) -> None:
    case = copied(tmp_path)
    for name in TABLES:
        (case / name).write_text("of the run before\n")
    script = f"echo '{said}'; echo End; exit {code}"
    returned, errors = by_hand(case, tmp_path, "simpleFoam", script)
    assert returned == expected
    assert ("simpleFoam failed, see log.simpleFoam" in errors) == (expected != 0)
    # without digests of results none of the tables is of this run
    assert not any((case / name).exists() for name in TABLES)
