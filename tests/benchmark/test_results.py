"""Directories of results: of one solver and one pack, and never through a link."""

import os
import re
import shutil
from pathlib import Path

import pandas as pd
import pytest

from orchestrator.benchmark import answer, runner
from orchestrator.benchmark.answer import AnswerError
from orchestrator.benchmark.runner import Choice
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.runs import workspace
from tests.benchmark.programs import SMALL, TAIL, TWO, program, run


def _refused(formulas: Path, out: Path, words: str, command: str = "true {case} {out}") -> None:
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(OrchestratorError, match=words):
        runner.run(formulas, command, out, TWO, SMALL)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_results_go_nowhere_else(formulas: Path, finished: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    (mine / "2-incline-5").mkdir(parents=True)
    (mine / "2-incline-5" / "thesis.tex").write_text("mine\n")
    _refused(formulas, mine, "something that is not a benchmark.*2-incline-5")
    study = tmp_path / "study"
    shutil.copytree(finished, study)
    _refused(formulas, study, r"holds .*(study|cases)")
    pack = tmp_path / "pack"
    shutil.copytree(formulas, pack)
    _refused(formulas, pack, "holds the benchmark pack")
    _refused(formulas, formulas / "results", "may not lie in the pack")
    (tmp_path / "link").symlink_to(formulas)
    _refused(formulas, tmp_path / "link" / "results", "may not lie in the pack")
    with pytest.raises(InputError, match="may not lie in the pack"):
        runner.compare(formulas, [mine], tmp_path / "link" / "results", TWO)
    with pytest.raises(InputError, match="something that is not"):
        runner.compare(formulas, [mine], mine, TWO)
    with pytest.raises(InputError, match=r"holds .*(study|cases)"):
        runner.compare(formulas, [mine], study, TWO)


def test_results_of_another_solver_or_pack_stay(
    formulas: Path, all_levels: Path, tmp_path: Path
) -> None:
    run(formulas, tmp_path, TAIL)
    results = tmp_path / "results"
    _refused(formulas, results, "holds the benchmark of the solver .*, not")
    with pytest.raises(InputError, match="answers to another pack"):
        run(all_levels, tmp_path, TAIL)
    run(formulas, tmp_path, TAIL)
    (results / ".lock").unlink()
    with workspace.claimed(results, workspace.RESULTS, program(tmp_path, TAIL)):
        with pytest.raises(OrchestratorError, match=r"is held|being run|is in use|holds it"):
            run(formulas, tmp_path, TAIL)
        with pytest.raises(OrchestratorError, match=r"is held|being run|is in use|holds it"):
            runner.compare(formulas, [results], None, TWO)


@pytest.mark.filterwarnings("ignore:.*is not what this program wrote")
def test_files_of_the_user_survive_in_results(formulas: Path, tmp_path: Path) -> None:
    run(formulas, tmp_path, TAIL)
    results = tmp_path / "results"
    (results / "2-incline-5" / "notes.txt").write_text("mine\n")
    (results / "figures" / "mine.png").write_text("mine\n")
    (results / "comparison.csv").unlink()
    (results / "comparison.csv").write_text("mine\n")
    run(formulas, tmp_path, TAIL)
    kept = {p.name for p in results.rglob("*") if p.is_file() and p.read_bytes() == b"mine\n"}
    assert kept == {"notes.txt", "mine.png", "comparison.csv"}
    (results / "figures").rename(tmp_path / "away")
    (results / "figures").symlink_to(tmp_path / "away")
    with pytest.raises(InputError, match="figures: it is a link"):
        run(formulas, tmp_path, TAIL)


def test_answers_of_others_are_not_written_to(formulas: Path, tmp_path: Path) -> None:
    given = tmp_path / "given"
    run(formulas, tmp_path, TAIL)
    shutil.copytree(tmp_path / "results" / "2-incline-5", given / "2-incline-5")
    before = sorted(given.rglob("*"))
    found = runner.compare(formulas, [given], tmp_path / "page", Choice(patterns=("2-incline-5",)))
    assert found.failures == []
    assert sorted(given.rglob("*")) == before
    assert "nothing is known of how its answers were made" in found.page.read_text()


@pytest.fixture(scope="module")
def one_answer(formulas: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a solver that passes, of one scene."""
    folder = tmp_path_factory.mktemp("one")
    assert not run(formulas, folder, TAIL, Choice(patterns=("2-incline-5",))).failures
    return folder / "results"


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{",
        "3",
        '{"error": []}',
        '{"seconds": 0, "cpu_s": 0}',
        '{"cpu_s": -1}',
        '{"seconds": "x"}',
        f'{{"seconds": {10**400}}}',
    ],
)
def test_results_of_a_stranger(formulas: Path, one_answer: Path, tmp_path: Path, text: str) -> None:
    given = tmp_path / "given"
    shutil.copytree(one_answer, given)
    for path in given.rglob("used.json"):
        path.write_text(text)
    found = runner.compare(formulas, [given], None, Choice(patterns=("2-incline-5",)))
    assert len(found.failures) <= 1
    (given / "ours" / "2-incline-5" / "answer.csv").write_text("junk")
    with pytest.raises(InputError, match=r"ours/2-incline-5/answer\.csv"):
        runner.compare(formulas, [given], None, Choice(patterns=("2-incline-5",)))


INCLINE = "quantity,at,value\nacceleration_over_g,,0.06225\n"
FORMS = {
    "a mark of its encoding": ("\ufeff" + INCLINE, ""),
    "spaces": (INCLINE.replace(",", ", "), ""),
    "lines of another system": (INCLINE.replace("\n", "\r\n"), ""),
    "a decimal comma": (INCLINE.replace("0.0", "0,0"), "decimal commas"),
    "too few fields": ("quantity,at,value\nacceleration_over_g,0.06225\n", "cut short"),
    "an underscore": (INCLINE.replace("0.06", "0.0_6"), "holds no number"),
    "digits of another alphabet": (INCLINE.replace("2", "\u0662"), "holds no number"),
    "Fortran": (INCLINE.replace("0.06225", "6.225D-02"), "holds no number"),
    "a number that nothing is": (INCLINE.replace("0.06", "1e308"), "not finite|which nothing is"),
}


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.filterwarnings("error")
def test_the_form_of_an_answer(formulas: Path, tmp_path: Path, name: str) -> None:
    text, words = FORMS[name]
    folder = tmp_path / "given" / "2-incline-5"
    folder.mkdir(parents=True)
    (folder / "answer.csv").write_bytes(text.encode())
    choice = Choice(patterns=("2-incline-5",))
    failures = runner.compare(formulas, [folder.parent], tmp_path / "page", choice).failures
    assert bool(failures) == bool(words)
    assert re.search(words, "".join(failures))


@pytest.mark.parametrize("name", [os.fsdecode(b"\xff"), "\x1b[2J", "\u6c99", "$\\frac{"], ids=ascii)
@pytest.mark.filterwarnings("error")
def test_names_of_solvers_and_packs_are_drawn_as_they_are(
    formulas: Path, tmp_path: Path, name: str
) -> None:
    shutil.copytree(formulas, tmp_path / name / "pack" / name)
    folder = tmp_path / name / "2-incline-5"
    folder.mkdir()
    (folder / "answer.csv").write_text(INCLINE)
    choice = Choice(patterns=("2-incline-5",))
    root = tmp_path / name / "pack" / name
    found = runner.compare(root, [folder.parent], tmp_path / "page", choice)
    assert not found.failures
    assert "\x1b" not in found.summary + found.page.read_text(encoding="utf-8")


@pytest.mark.parametrize("count", [0.5, -1.0])
def test_counts_are_whole(tmp_path: Path, count: float) -> None:
    asked = pd.DataFrame({"quantity": ["moved", "not_moved"], "at": ["1", "1"]})
    path = tmp_path / "answer.csv"
    path.write_text(f"quantity,at,value\nmoved,1,{count}\nnot_moved,1,{2 - count}\n")
    with pytest.raises(AnswerError, match=f"moved at 1 is {count:g}: it counts grains"):
        answer.read(path, asked, 2.0)
