"""The starts for a native solver, in Python and C++, on the packs that they are for."""

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import pipeline
from orchestrator.benchmark import runner
from orchestrator.benchmark.runner import Choice
from orchestrator.runs.confined import Limits
from orchestrator.runs.workspace import Workspace
from tests.benchmark.conftest import NATIVE
from tests.benchmark.programs import TAIL, program

NATIVES = {"python": f"{shlex.join([sys.executable, str(NATIVE / 'solver.py')])}", "c++": ""}


def _compiled(folder: Path) -> Path:
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("there is no g++")
    program = folder / "solver"
    source = NATIVE / "solver.cpp"
    subprocess.run([compiler, "-std=c++17", "-Wall", "-Werror", "-o", program, source], check=True)
    return program


def test_the_example_passes(all_levels: Path, tmp_path: Path) -> None:
    levels = Choice(levels=(1, 2, 4))
    found = runner.run(
        all_levels, program(tmp_path, TAIL), tmp_path / "results", levels, Limits(seconds=60.0)
    )
    assert found.failures == []
    verdicts = pd.read_csv(tmp_path / "results" / "verdicts.csv")
    assert set(verdicts["level"]) == {1, 2, 4}
    assert (verdicts["seconds"] > 0).all()
    assert (verdicts["peak_mib"] > 1).all()
    assert verdicts.loc[verdicts["level"] > 1, "ratio"].gt(0).all()
    exact = verdicts[verdicts["level"] == 1]
    assert (exact["worst"] < 1e-8).all()
    numbers = pd.read_csv(tmp_path / "results" / "comparison.csv")
    assert numbers.loc[numbers["scene"].str.startswith("2-incline"), "ours"].notna().all()


@pytest.mark.parametrize("language", NATIVES)
def test_the_native_examples_know_the_pivots_of_a_poured_bed(
    poured: Path, tmp_path: Path, language: str
) -> None:
    command = NATIVES[language] or f"{_compiled(tmp_path)}"
    choice = Choice(patterns=("4-*",))
    command = f"{command} {{case}} {{out}}"
    runner.run(poured, command, tmp_path / "results", choice, Limits(seconds=60.0))
    _, planned = pipeline.reopen(Workspace(poured.parent / "study"))
    (pile,) = planned.piles.values()
    assert pile.cases is not None
    grains = pd.read_csv(next(poured.glob("scenes/4-*/grains.csv")))
    assert grains["d_m"].nunique() > 10
    flows = pd.read_csv(next(poured.glob("scenes/4-*/load_steps.csv")))["ustar0_m_s"].to_numpy()
    alone = pile.alone(pile.face(pile.cases).speed)
    numbers = pd.read_csv(tmp_path / "results" / "comparison.csv")
    moved = numbers[numbers["quantity"] == "moved"]
    assert moved["found"].max() > 3
    for step, count in zip(moved["at"].astype(int), moved["found"], strict=True):
        assert count == (alone <= flows[step]).sum()


def test_the_start_in_c(formulas: Path, tmp_path: Path) -> None:
    found = runner.run(
        formulas,
        f"{_compiled(tmp_path)} {{case}} {{out}}",
        tmp_path / "results",
        Choice(levels=(1,), patterns=("1-[01]*",)),
        Limits(seconds=60.0),
    )
    assert found.failures == []
