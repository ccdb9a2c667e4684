"""The solvers of examples/ on packs: plain Python, C++, LAMMPS, YADE, and a flow of its own."""

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator import pipeline
from orchestrator.benchmark import compare
from orchestrator.benchmark.compare import Options, Outcome
from orchestrator.grains.loads import loads_of
from orchestrator.runs.workspace import Workspace
from tests.benchmark.conftest import NATIVE, RIGHT, ROOT

EXAMPLES = ROOT / "examples"
ENGINES = {
    "lmp": f"{shlex.join([sys.executable, f'{EXAMPLES}/lammps/solve.py'])} {{case}} {{out}}",
    "yade": f"yade -n -x -j1 {shlex.quote(f'{EXAMPLES}/yade/solve.py')} {{case}} {{out}}",
}
CHECKS = (
    "2-collision-0.1",
    "2-incline-20",
    "2-incline-70",
    "2-sliding-2",
    "2-passing-2",
)


def _run(pack: Path, folder: Path, command: str, *scenes: str) -> Outcome:
    return compare.run(pack, command, folder / "results", Options(patterns=scenes))


@pytest.fixture(params=["python", "c++"])
def native(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The command of each start for a native solver."""
    if request.param == "python":
        return RIGHT
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("there is no g++")
    program, source = tmp_path / "solver", NATIVE / "solver.cpp"
    subprocess.run(
        [compiler, "-std=c++17", "-Wall", "-Werror", "-o", program, source], check=True
    )
    return f"{program} {{case}} {{out}}"


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    """The command of each engine that is installed."""
    program: str = request.param
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    return ENGINES[program]


def test_the_native_starts_know_the_formulas(
    formulas: Path, tmp_path: Path, native: str
) -> None:
    assert _run(formulas, tmp_path, native, "1-*-d0.2mm-z0.1d-*").failures == []
    verdicts = pd.read_csv(tmp_path / "results" / "verdicts.csv")
    assert len(verdicts) > 3
    assert (verdicts["worst"] < 1e-6).all()


@pytest.mark.long
def test_the_small_pack_is_answered_at_all_levels(tmp_path: Path) -> None:
    """The pack of the repository: a native start knows all but the levels of the flow."""
    root = tmp_path / "pack"
    shutil.copytree(ROOT / "benchmark" / "small", root)
    result = _run(root, tmp_path, RIGHT, "*")
    assert result.failures == []


def test_the_native_starts_know_the_pivots_of_a_poured_bed(
    poured: Path, tmp_path: Path, native: str
) -> None:
    _run(poured, tmp_path, native, "4-*")
    _, planned = pipeline.reopen(Workspace(poured.parent / "study"))
    (pile,) = planned.piles.values()
    assert pile.cases is not None
    grains = pd.read_csv(next(poured.glob("scenes/4-*/grains.csv")))
    assert grains["d_m"].nunique() > 10
    flows = pd.read_csv(next(poured.glob("scenes/4-*/load_steps.csv")))[
        "ustar0_m_s"
    ].to_numpy()
    alone = loads_of(pile, pile.cases).alone()
    numbers = pd.read_csv(tmp_path / "results" / "comparison.csv")
    moved = numbers[numbers["quantity"] == "moved"]
    assert moved["answer"].max() > 3
    for step, count in zip(moved["at"].astype(int), moved["answer"], strict=True):
        assert count == (alone <= flows[step]).sum()


@pytest.mark.long
def test_an_engine_agrees(
    all_levels: Path, lift_off: Path, poured: Path, tmp_path: Path, engine: str
) -> None:
    assert _run(all_levels, tmp_path, engine, *CHECKS, "2-grain*", "4-*").failures == []
    verdicts = pd.read_csv(tmp_path / "results" / "verdicts.csv")
    assert set(verdicts["kind"]) == {
        "collision",
        "incline",
        "sliding",
        "passing",
        "pivot",
        "pile",
    }
    assert (verdicts.loc[verdicts["kind"] == "incline", "worst"] < 1e-3).all()
    for other in (lift_off, poured):
        assert _run(other, tmp_path / other.parent.name, engine, "4-*").failures == []


def test_the_bed_of_lammps_runs_by_hand(tmp_path: Path) -> None:
    if shutil.which("lmp") is None:
        pytest.skip("lmp is not installed")
    folder = tmp_path / "lammps"
    shutil.copytree(EXAMPLES / "lammps", folder)
    subprocess.run(
        ["lmp", "-in", "in.bed"], cwd=folder, check=True, capture_output=True
    )
    frames = (folder / "track.dump").read_text().split("ITEM: TIMESTEP\n")[1:]
    x = [float(frame.split()[-2]) for frame in frames]
    load_steps = [
        int(line) for line in (folder / "samples.csv").read_text().split()[1:]
    ]
    # W/tan(60 degrees) lies between the forces of load steps 2 and 3
    moved = [
        step
        for step, now in zip(load_steps, x[1:], strict=True)
        if now - x[0] >= 0.3e-3
    ]
    assert min(moved) == 3


@pytest.mark.long
@pytest.mark.parametrize("z0", [3.3e-6, 1e-4])
def test_the_flow_keeps_the_stress_on_a_flat_bed(
    z0: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES / "flow"))
    import rans  # type: ignore[import-not-found]

    h = 0.02
    x = np.linspace(0.0, 40 * h, 11)
    heights = 20 * h * (1.1 ** np.arange(41) - 1) / (1.1**40 - 1)
    flow = rans.solve(x, heights, np.zeros(len(x)), 0.4, z0, 1e-5)
    assert flow.ratio == pytest.approx(1.0, abs=1e-4)
    assert flow.own == pytest.approx(1.0, abs=0.015)


@pytest.mark.long
def test_the_flow_on_a_pile_is_that_of_openfoam(
    all_levels: Path, tmp_path: Path
) -> None:
    command = f"{shlex.join([sys.executable, f'{EXAMPLES}/flow/answer.py'])} {{case}} {{out}} 0.5"
    assert _run(all_levels, tmp_path, command, "[35]-*").failures == []
    numbers = pd.read_csv(tmp_path / "results" / "comparison.csv").set_index("quantity")
    mean = numbers.loc[["windward_mean"]].iloc[0]
    assert mean["answer"] == pytest.approx(mean["value"], rel=0.03)
