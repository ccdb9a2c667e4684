"""Cases that are run by hand: the same again, and after a change."""

import shutil
import subprocess
from pathlib import Path

from orchestrator.report.results import Results
from orchestrator.runs.case import Case


def _copied(case: Case, cases: Path, to: Path) -> Path:
    shutil.copytree(cases / case.name, to)
    return to


def _derived(case: Case, directory: Path) -> list[str]:
    return [name for name in case.derived if (directory / name).exists()]


def _change(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def _run(directory: Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(["./Allrun"], cwd=directory, capture_output=True, text=True, timeout=300)


def test_the_same_again_keeps_what_was_made_of_it(results: Results, tmp_path: Path) -> None:
    (pile,) = results.plan.piles.values()
    mine = _copied(pile.case, results.cases, tmp_path / "pile")
    made = _derived(pile.case, mine)
    assert "motion.csv" in made
    ended = _run(mine)
    assert ended.returncode == 0, ended.stderr
    assert _derived(pile.case, mine) == made
    assert (mine / "README.md").is_file()


def test_a_changed_pile_leaves_nothing_of_the_run_before(results: Results, tmp_path: Path) -> None:
    (pile,) = results.plan.piles.values()
    mine = _copied(pile.case, results.cases, tmp_path / "pile")
    _change(mine / "parameters.liggghts", "waiting_time equal 6.0", "waiting_time equal 7.0")
    ended = _run(mine)
    assert ended.returncode == 1
    assert "motion.csv" in ended.stderr
    assert _derived(pile.case, mine) == []
    (mine / "results.sha256").unlink()
    (mine / "motion.csv").write_text("old")
    assert _run(mine).returncode == 0
    assert _derived(pile.case, mine) == []


def test_a_changed_flow_leaves_nothing_of_the_run_before(results: Results, tmp_path: Path) -> None:
    (pile,) = results.plan.piles.values()
    mine = _copied(pile.flow, results.cases, tmp_path / "flow")
    assert _derived(pile.flow, mine) == list(pile.flow.derived)
    _change(mine / "parameters", "freeStream       10.0;", "freeStream       11.0;")
    ended = _run(mine)
    assert ended.returncode == 1
    assert "wall_stress.csv" in ended.stderr
    assert _derived(pile.flow, mine) == []
