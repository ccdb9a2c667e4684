"""Standard streams that are closed, full or without a reader: the study goes on."""

import subprocess
import sys

import pytest

from tests.faults.bench import Bench, same_tables
from tests.faults.ledger import Ledger

FULL = "No space left on device"
STREAMS: dict[str, tuple[str, int]] = {
    "no stderr": ("2>&-", 0),
    "no stdout": (">&-", 0),
    "no stream at all": ("<&- >&- 2>&-", 0),
    "a full stderr": ("2>/dev/full", 0),
    "a full stdout": (">/dev/full", 1),
    "both full": (">/dev/full 2>&1", 1),
    "a reader of both that goes": ("2>&1 | head -n 1", 0),
    "a reader of stderr that goes": ("2>&1 >page | true", 0),
    "letters of another alphabet": (">page 2>said", 0),
}
"""What a shell is told, and the exit code of a study that is whole: 1 where an answer is lost."""


@pytest.mark.parametrize("name", STREAMS)
def test_a_study_ends_well_whatever_its_streams(cells: Bench, ledger: Ledger, name: str) -> None:
    told, expected = STREAMS[name]
    with ledger.fault(name, "streams"):
        driver = f"'{sys.executable}' -m orchestrator study small.toml --out out {told}"
        ended = subprocess.run(
            ["bash", "-o", "pipefail", "-c", driver],
            cwd=cells.folder,
            env=cells.environment | {"PYTHONIOENCODING": "ascii:strict"},
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert ended.returncode == expected, ended.stderr
        assert "Traceback" not in ended.stdout + ended.stderr
        assert (FULL in ended.stderr) == (name == "a full stdout")
        assert same_tables(cells.out, cells.undisturbed)
        cells.check_finished()


LIGGGHTS = "#!/bin/sh\n[ $1 = -h ] && echo LIGGGHTS-PUBLIC 3.8.0\n"
"""It says its version, and fails."""


def test_a_failed_case_is_told_by_the_exit_code_alone(cells: Bench, ledger: Ledger) -> None:
    program = cells.folder / "liggghts"
    program.write_text(LIGGGHTS)
    program.chmod(0o755)
    driver = f"PATH=$PWD:$PATH '{sys.executable}' -m orchestrator study small.toml --out out"
    with ledger.fault("a failure with full streams", "streams"):
        command = ["bash", "-c", f"{driver} >/dev/full 2>&-"]
        ended = subprocess.run(command, cwd=cells.folder, env=cells.environment)
        assert ended.returncode == 3
        cells.check_finished()


@pytest.mark.parametrize(("told", "expected"), [(">/dev/full", 1), (">&-", 0), ("| true", 0)])
def test_an_answer_that_is_lost_is_a_failure_and_a_reader_that_goes_is_none(
    cells: Bench, told: str, expected: int
) -> None:
    command = f"'{sys.executable}' -m orchestrator threshold --diameter 1e-3 {told}"
    ended = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        env=cells.environment,
        capture_output=True,
        text=True,
    )
    assert ended.returncode == expected, told
    assert ended.stderr.count("\n") == expected
