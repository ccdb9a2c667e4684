"""LAMMPS and YADE through the door, where they are installed: three programs, one answer."""

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from orchestrator.benchmark import runner
from orchestrator.benchmark.report import Found
from orchestrator.benchmark.runner import Choice
from orchestrator.runs.confined import Limits
from tests.benchmark.conftest import ROOT

EXAMPLES = ROOT / "examples"
COMMANDS = {
    "lmp": f"{shlex.join([sys.executable, f'{EXAMPLES}/lammps/solve.py'])} {{case}} {{out}}",
    "yade": f"yade -n -x -j1 {shlex.quote(f'{EXAMPLES}/yade/solve.py')} {{case}} {{out}}",
}
CHECKS = ("2-collision-0.1", "2-incline-20", "2-incline-70", "2-sliding-2", "2-passing-2")


@pytest.fixture(params=COMMANDS)
def command(request: pytest.FixtureRequest) -> str:
    """The command of each program that is installed."""
    program: str = request.param
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    return COMMANDS[program]


def _run(pack: Path, folder: Path, command: str, *scenes: str) -> Found:
    choice, limits = Choice(patterns=scenes), Limits(seconds=300.0)
    return runner.run(pack, command, folder / "results", choice, limits)


def test_a_foreign_solver_agrees(all_levels: Path, tmp_path: Path, command: str) -> None:
    pivots = "2-[0-9a-f]" + 11 * "[0-9a-f]"
    found = _run(all_levels, tmp_path, command, *CHECKS, pivots, "4-*")
    assert found.failures == []
    verdicts = pd.read_csv(tmp_path / "results" / "verdicts.csv")
    assert set(verdicts["kind"]) == {"collision", "incline", "sliding", "passing", "pivot", "pile"}
    assert (verdicts.loc[verdicts["kind"] == "incline", "worst"] < 1e-3).all()


def test_a_foreign_solver_agrees_on_lift_off(lift_off: Path, tmp_path: Path, command: str) -> None:
    assert _run(lift_off, tmp_path, command).failures == []


def test_a_foreign_solver_agrees_on_a_poured_mixture(
    poured: Path, tmp_path: Path, command: str
) -> None:
    assert _run(poured, tmp_path, command, "4-*").failures == []


def test_a_foreign_solver_declines_what_it_is_not_for(
    formulas: Path, tmp_path: Path, command: str
) -> None:
    first = min(path.name for path in (formulas / "scenes").glob("1-*"))
    found = _run(formulas, tmp_path, command, first)
    assert all("it ended with 2" in line for line in found.failures)
    assert found.failures


def test_the_bed_of_lammps_runs_by_hand(tmp_path: Path) -> None:
    if shutil.which("lmp") is None:
        pytest.skip("lmp is not installed")
    folder = tmp_path / "lammps"
    shutil.copytree(EXAMPLES / "lammps", folder)
    subprocess.run(["lmp", "-in", "in.bed"], cwd=folder, check=True, capture_output=True)
    frames = (folder / "track.dump").read_text().split("ITEM: TIMESTEP\n")[1:]
    x = [float(frame.split()[-2]) for frame in frames]
    load_steps = [int(line) for line in (folder / "samples.csv").read_text().split()[1:]]
    # W/tan(60 degrees) lies between the forces of load steps 2 and 3
    moved = [
        load_step for load_step, now in zip(load_steps, x[1:], strict=True) if now - x[0] >= 0.3e-3
    ]
    assert min(moved) == 3
