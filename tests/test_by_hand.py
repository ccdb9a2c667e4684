"""Cases that are run by hand: the same again, and after a change."""

import shutil
import subprocess
from pathlib import Path

import pytest

from orchestrator.report.results import Results
from orchestrator.runs.case import Case

CHANGES = {
    "pile": ("parameters.liggghts", "rest_energy equal 1e-06", "rest_energy equal 0.0"),
    "flow": ("parameters", "freeStream       10.0;", "freeStream       11.0;"),
}


def copied(results: Results, kind: str, to: Path) -> tuple[Case, Path]:
    """A case of the small study, and a copy of its directory."""
    (pile,) = results.plan.piles.values()
    case = pile.flow if kind == "flow" else pile.case
    return case, Path(shutil.copytree(results.cases / case.name, to / kind))


def derived(case: Case, directory: Path) -> list[str]:
    return [name for name in case.derived if (directory / name).exists()]


def run(directory: Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(["./Allrun"], cwd=directory, capture_output=True, text=True, timeout=300)


def test_the_same_again_keeps_its_results(results: Results, tmp_path: Path) -> None:
    case, mine = copied(results, "pile", tmp_path)
    made = derived(case, mine)
    assert "motion.csv" in made
    ended = run(mine)
    assert ended.returncode == 0, ended.stderr
    assert derived(case, mine) == made
    assert (mine / "README.md").is_file()


@pytest.mark.parametrize("kind", CHANGES)
def test_a_changed_case_leaves_nothing_of_the_run_before(
    results: Results, tmp_path: Path, kind: str
) -> None:
    case, mine = copied(results, kind, tmp_path)
    assert derived(case, mine)
    name, old, new = CHANGES[kind]
    text = (mine / name).read_text(encoding="utf-8")
    assert old in text
    (mine / name).write_text(text.replace(old, new), encoding="utf-8")
    ended = run(mine)
    assert ended.returncode == 1
    assert any(made in ended.stderr for made in case.derived)
    assert derived(case, mine) == []
    (mine / "results.sha256").unlink()
    assert run(mine).returncode == 0
