"""A case that is run by hand says so where its solver did not come to its end.

Solvers end with 0 in many of these cases: what they have said counts.
"""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from orchestrator.runs.case import templates
from orchestrator.solvers.liggghts import LAST_WORDS
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


DERIVED = {
    "bed": ("load_steps.csv", "motion.csv"),
    "poured": ("bed.csv",),
    "rebound": (),
}


@pytest.mark.parametrize(
    ("said", "code", "expected", "told"),
    [
        (LAST_WORDS, 0, 0, ""),
        ("", 0, 1, "LIGGGHTS stopped before the end of the deck, see log.liggghts"),
        ("ERROR: Lost atoms", 0, 1, "stopped before the end of the deck"),
        (LAST_WORDS, 3, 3, ""),
    ],
)
@pytest.mark.parametrize("template", DERIVED)
def test_a_deck_that_did_not_come_to_its_end(
    tmp_path: Path, template: str, said: str, code: int, expected: int, told: str
) -> None:
    folder = templates() / "liggghts" / template
    case = Path(shutil.copytree(folder, tmp_path / "case"))
    for name in DERIVED[template]:
        (case / name).write_text("of the run before\n")
    script = f"echo '{said}'; exit {code}"
    returned, errors = by_hand(case, tmp_path, "liggghts", script)
    assert returned == expected
    assert told in errors
    assert bool(errors) == bool(told)
    if expected:
        assert not any((case / name).exists() for name in DERIVED[template])


def test_a_bed_that_does_not_come_to_rest(tmp_path: Path) -> None:
    """It has met no flow: the counts of a run before are not its own."""
    folder = templates() / "liggghts" / "bed"
    case = Path(shutil.copytree(folder, tmp_path / "case"))
    (case / "load_steps.csv").write_text("of the run before\n")
    script = f"echo 'the bed does not come to rest'; echo '{LAST_WORDS}'"
    returned, errors = by_hand(case, tmp_path, "liggghts", script)
    assert returned == 1
    assert "the bed does not come to rest, and met no flow: see settling.csv" in errors
    assert not (case / "load_steps.csv").exists()
