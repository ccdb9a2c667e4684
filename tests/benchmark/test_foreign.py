"""LAMMPS and YADE through the door, where they are installed: three programs, one answer."""

import shutil
import sys
from pathlib import Path

import pandas as pd
import pytest

from orchestrator.benchmark import runner
from orchestrator.benchmark.runner import Choice
from tests.benchmark.conftest import ROOT

EXAMPLES = ROOT / "examples"
COMMANDS = {
    "lmp": f"'{sys.executable}' '{EXAMPLES}/lammps/solve.py' {{case}} {{out}}",
    "yade": f"yade -n -x -j1 '{EXAMPLES}/yade/solve.py' {{case}} {{out}}",
}
CHECKS = ("2-collision-0.1", "2-incline-20", "2-incline-70", "2-sliding-2")


@pytest.mark.parametrize("program", COMMANDS)
def test_a_foreign_solver_agrees(all_levels: Path, tmp_path: Path, program: str) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    pivots = "2-[0-9a-f]" + 11 * "[0-9a-f]"
    choice = Choice(patterns=(*CHECKS, pivots, "4-*"))
    found = runner.run(all_levels, COMMANDS[program], tmp_path / "results", choice, 300.0)
    assert found.failures == []
    verdicts = pd.read_csv(tmp_path / "results" / "verdicts.csv")
    assert set(verdicts["kind"]) == {"collision", "incline", "sliding", "pivot", "pile"}
    assert (verdicts.loc[verdicts["kind"] == "incline", "worst"] < 1e-3).all()


@pytest.mark.parametrize("program", COMMANDS)
def test_a_foreign_solver_declines_what_it_is_not_for(
    formulas: Path, tmp_path: Path, program: str
) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    choice = Choice(patterns=(min(path.name for path in (formulas / "scenes").glob("1-*")),))
    found = runner.run(formulas, COMMANDS[program], tmp_path / "results", choice, 60.0)
    assert all("it ended with 2" in line for line in found.failures)
    assert found.failures
