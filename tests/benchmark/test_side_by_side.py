"""Several solvers on one page: each by its name, none lost, and the exit code of the worst."""

import shlex
import shutil
import sys
from pathlib import Path

import pandas as pd
import pytest

from orchestrator.benchmark import pack, runner, sheets, verdict
from orchestrator.benchmark.runner import Choice
from orchestrator.errors import InputError
from orchestrator.runs.confined import Limits
from tests.benchmark.conftest import NATIVE
from tests.conftest import Command
from tests.report.test_page import Page

COMMAND = f"{shlex.join([sys.executable, str(NATIVE / 'solver.py')])} {{case}} {{out}}"
CHOICE = Choice(patterns=("4-*", "2-incline-20"))
HIGH = 1.3
"""A factor on thresholds that no interval holds."""


@pytest.fixture(scope="module")
def right(all_levels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a solver that passes."""
    out = tmp_path_factory.mktemp("results") / "right"
    assert runner.run(all_levels, COMMAND, out, CHOICE, Limits(seconds=60.0)).failures == []
    return out


@pytest.fixture
def wrong(right: Path, tmp_path: Path) -> Path:
    """The same with thresholds of the pile that are too high, and stated time steps."""
    out = tmp_path / "wrong_one"
    shutil.copytree(right, out)
    (path,) = out.glob("4-*/answer.csv")
    table = pd.read_csv(path, dtype={"at": str})
    table.loc[table["quantity"] == "shields", "value"] *= HIGH
    path.write_text(table.to_csv(index=False) + "steps,,1000\n")
    return out


def test_two_solvers_on_one_page(
    all_levels: Path, right: Path, wrong: Path, tmp_path: Path
) -> None:
    found = runner.compare(all_levels, [right, wrong], tmp_path / "both", CHOICE)
    (failure,) = found.failures
    assert failure.startswith("wrong_one: 4-")
    assert "shields" in failure
    assert found.page == tmp_path / "both" / "comparison.html"
    parsed = Page(found.page.read_text(encoding="utf-8"))
    assert parsed.texts["title"] == "Against the pack “all”: right, wrong_one"
    assert "3 of 4 scenes passed" in parsed.text
    assert "wrong one over ours" in parsed.texts["th"]
    figures = {path.stem for path in (tmp_path / "both" / "figures").glob("*.png")}
    assert figures == {"moved", "shields", "speed-accuracy"}
    for name in ("comparison.csv", "verdicts.csv"):
        table = pd.read_csv(tmp_path / "both" / name)
        assert table["solver"].unique().tolist() == ["right", "wrong_one"]
        assert table.groupby("solver").size().nunique() == 1
    # what each has of its own is untouched
    assert not (wrong / "comparison.html").read_text().count("wrong_one")


def test_thresholds_side_by_side(all_levels: Path, right: Path, wrong: Path) -> None:
    chosen = pack.read(all_levels)
    contenders = [verdict.compared(chosen, CHOICE.of(chosen), one) for one in (right, wrong)]
    table = sheets.thresholds(chosen, contenders)
    assert table.columns.tolist() == [
        "scene", "pile", "n/N", "ours", "right", "wrong_one", "interval",
    ]  # fmt: skip
    assert set(table["pile"]) == {"20°, d = 1 mm, aligned"}
    assert table["n/N"].tolist()[:2] == ["10%", "30%"]
    assert not table["ours"].str.contains("*", regex=False).any()
    assert not table["right"].str.contains("**", regex=False).any()
    assert table["wrong_one"].str.endswith(" **").all()
    value = table["wrong_one"].str.split().str[0].astype(float)
    assert value.to_list() == pytest.approx(
        (HIGH * table["right"].str.split().str[0].astype(float)).to_list(), rel=0.02
    )


def test_costs_of_piles(all_levels: Path, right: Path, wrong: Path) -> None:
    chosen = pack.read(all_levels)
    contenders = [verdict.compared(chosen, CHOICE.of(chosen), one) for one in (right, wrong)]
    table = sheets.costs(chosen, contenders)
    (row,) = table.to_dict("records")
    kinds = pd.read_csv(chosen.directory(row["scene"]) / "grains.csv")["kind"]
    mobile = kinds.isin(["mobile", "counted", "pushed"]).sum()
    assert row["mobile"] == mobile < len(kinds)
    assert row["right over ours"] == pytest.approx(row["right, s"] / row["ours, s"])
    assert row["wrong_one, M/s"] == pytest.approx(mobile * 1e-3 / row["wrong_one, s"])
    # LIGGGHTS says its steps, the right solver does not
    assert row["ours, M/s"] > 0.001
    assert "right, M/s" not in table


def test_ours_is_one_more_of_them(all_levels: Path, right: Path) -> None:
    chosen = pack.read(all_levels)
    own = verdict.ours([verdict.compared(chosen, CHOICE.of(chosen), right)])
    pile = next(v for v in own.verdicts if v.kind == "pile")
    assert own.name == "ours"
    assert pile.worst < 1e-6  # the expected answer is our own run
    assert pile.cpu_s > 0
    assert pile.steps > 1000


def test_results_that_cannot_be_compared(all_levels: Path, right: Path, tmp_path: Path) -> None:
    same = tmp_path / "again" / "right"
    shutil.copytree(right, same)
    with pytest.raises(InputError, match="two solvers have the name right"):
        runner.compare(all_levels, [right, same], tmp_path / "both", CHOICE)
    with pytest.raises(InputError, match="two solvers have the name ours"):
        runner.compare(all_levels, [right, right / "ours"], tmp_path / "both", CHOICE)
    with pytest.raises(InputError, match="no such directory"):
        runner.compare(all_levels, [right, tmp_path / "nowhere"], tmp_path / "both", CHOICE)
    assert not (tmp_path / "both").exists()


def test_exit_codes_and_places(
    all_levels: Path, right: Path, wrong: Path, orchestrator: Command, tmp_path: Path
) -> None:
    patterns = [word for pattern in CHOICE.patterns for word in ("--scene", pattern)]

    def compare(*arguments: str | Path) -> tuple[int, str, str]:
        words = ("benchmark", "compare", str(all_levels), *map(str, arguments), *patterns)
        ended = orchestrator(*words)
        return ended.returncode, ended.stdout, ended.stderr

    other = tmp_path / "other"
    shutil.copytree(right, other)
    code, said, failed = compare(right, other)
    assert code == 0, failed
    assert said.splitlines()[-1] == "results/benchmark-all/comparison.html"
    code, said, failed = compare(right, wrong, "--out", "both")
    assert code == 1
    assert said.splitlines()[-1] == "both/comparison.html"
    assert failed.startswith("orchestrator: wrong_one: 4-")
    # alone it is not named, and the page lies with its answers
    code, said, failed = compare(wrong)
    assert code == 1
    assert said.splitlines()[-1] == str(wrong / "comparison.html")
    assert failed.startswith("orchestrator: 4-")
    same = tmp_path / "again" / "right"
    shutil.copytree(right, same)
    code, _, failed = compare(right, same)
    assert code == 2
    assert "two solvers have the name right" in failed
