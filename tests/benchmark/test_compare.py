"""Results and pages: of a solver and a pack, several solvers side by side, nothing foreign lost."""

import os
import shutil
from pathlib import Path

import pandas as pd
import pytest

from orchestrator.benchmark import compare, pack, page
from orchestrator.benchmark.compare import Choice, Limits
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.runs import workspace
from tests.benchmark.programs import RIGHT, SMALL, TAIL, TWO, program, run
from tests.conftest import Command
from tests.report.test_page import Page

CHOICE = Choice(patterns=("4-*", "2-incline-20"))
HIGH = 1.3
"""A factor on thresholds that no interval holds."""
INCLINE = "quantity,at,value\nacceleration_over_g,,0.06225\n"


@pytest.fixture(scope="module")
def right(all_levels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a solver that passes."""
    out = tmp_path_factory.mktemp("results") / "right"
    assert compare.run(all_levels, RIGHT, out, CHOICE, Limits()).failures == []
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
    outcome = compare.compare(all_levels, [right, wrong], tmp_path / "both", CHOICE)
    (failure,) = outcome.failures
    assert failure.startswith("wrong_one: 4-")
    assert "shields" in failure
    parsed = Page(outcome.page.read_text(encoding="utf-8"))
    assert parsed.texts["title"] == "Against the pack “all”: right, wrong_one"
    assert "3 of 4 scenes passed" in parsed.text
    assert "wrong one over ours" in parsed.texts["th"]
    figures = {path.stem for path in (tmp_path / "both" / "figures").glob("*.png")}
    assert figures == {"moved", "shields", "speed-accuracy"}
    for name in ("comparison.csv", "verdicts.csv"):
        table = pd.read_csv(tmp_path / "both" / name)
        assert table["solver"].unique().tolist() == ["right", "wrong_one"]
        assert table.groupby("solver").size().nunique() == 1
    assert "wrong_one" not in (wrong / "comparison.html").read_text()


def test_tables_of_thresholds_and_costs(all_levels: Path, right: Path, wrong: Path) -> None:
    chosen = pack.read(all_levels)
    solvers = [compare.judge(chosen, CHOICE.names(chosen), one) for one in (right, wrong)]
    table = page.thresholds(chosen, solvers)
    assert table.columns.tolist() == [
        "scene", "pile", "n/N", "ours", "right", "wrong_one", "interval",
    ]  # fmt: skip
    assert set(table["pile"]) == {"20°, d = 1 mm, aligned"}
    assert table["n/N"].tolist()[:2] == ["10%", "30%"]
    assert not table["ours"].str.contains("*", regex=False).any()
    assert not table["right"].str.contains("**", regex=False).any()
    assert table["wrong_one"].str.endswith(" **").all()
    ratio = table["wrong_one"].str.split().str[0].astype(float) / (
        table["right"].str.split().str[0].astype(float)
    )
    assert ratio.to_list() == pytest.approx([HIGH] * len(ratio), rel=0.02)
    (row,) = page.costs(chosen, solvers).to_dict("records")
    kinds = pd.read_csv(chosen.directory(row["scene"]) / "grains.csv")["kind"]
    mobile = kinds.isin(["mobile", "counted", "pushed"]).sum()
    assert row["mobile"] == mobile < len(kinds)
    assert row["right over ours"] == pytest.approx(row["right, s"] / row["ours, s"])
    assert row["wrong_one, M/s"] == pytest.approx(mobile * 1e-3 / row["wrong_one, s"])
    assert row["ours, M/s"] > 0.001
    assert "right, M/s" not in row  # it states no time steps
    ours = compare.ours(solvers).verdicts.set_index("kind").loc["pile"]
    assert ours["worst"] < 1e-6  # the expected answer is our own run
    assert ours["steps"] > 1000


def test_where_the_page_lies_and_how_the_command_ends(
    all_levels: Path, right: Path, wrong: Path, orchestrator: Command, tmp_path: Path
) -> None:
    def ends(*arguments: str | Path) -> tuple[int, str, str]:
        words = ("benchmark", "compare", str(all_levels), *map(str, arguments))
        ended = orchestrator(*words, "--scene", *CHOICE.patterns)
        return ended.returncode, ended.stdout, ended.stderr

    other = tmp_path / "other"
    shutil.copytree(right, other)
    code, printed, failed = ends(right, other)
    assert code == 0, failed
    assert printed.splitlines()[-1].endswith("results/benchmark-all/comparison.html")
    code, printed, failed = ends(right, wrong, "--out", "both")
    assert code == 1
    assert printed.splitlines()[-1].endswith("both/comparison.html")
    assert failed.startswith("orchestrator: wrong_one: 4-")
    # alone it is not named, and the page lies with its answers
    code, printed, failed = ends(wrong)
    assert code == 1
    assert printed.splitlines()[-1] == str(wrong / "comparison.html")
    assert failed.startswith("orchestrator: 4-")


def test_results_that_cannot_be_compared(all_levels: Path, right: Path, tmp_path: Path) -> None:
    same = tmp_path / "again" / "right"
    shutil.copytree(right, same)
    former = tmp_path / "former"
    (former / "1-24d39a55a2ad").mkdir(parents=True)
    out = tmp_path / "both"
    for results, words in (
        ([right, same], "two solvers have the name right"),
        ([right, right / "ours"], "two solvers have the name ours"),
        ([right, tmp_path / "nowhere"], "no such directory"),
        ([former], "schema 1.*Old and new names"),
    ):
        with pytest.raises(InputError, match=words):
            compare.compare(all_levels, results, out, CHOICE)
    assert not out.exists()


def _refused(formulas: Path, out: Path, words: str, command: str = "true {case} {out}") -> None:
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(OrchestratorError, match=words):
        compare.run(formulas, command, out, TWO, SMALL)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_results_go_nowhere_else(formulas: Path, finished: Path, tmp_path: Path) -> None:
    mine, study, copy = (tmp_path / name for name in ("mine", "study", "pack"))
    (mine / "2-incline-5").mkdir(parents=True)
    (mine / "2-incline-5" / "thesis.tex").write_text("mine\n")
    shutil.copytree(finished, study)
    shutil.copytree(formulas, copy)
    (tmp_path / "link").symlink_to(formulas)
    _refused(formulas, mine, "something that is not a benchmark.*2-incline-5")
    _refused(formulas, study, r"holds .*(study|cases)")
    _refused(formulas, copy, "holds the benchmark pack")
    _refused(formulas, formulas / "results", "may not lie in the pack")
    _refused(formulas, tmp_path / "link" / "results", "may not lie in the pack")
    for out, words in (
        (tmp_path / "link" / "results", "may not lie in the pack"),
        (mine, "something that is not"),
        (study, r"holds .*(study|cases)"),
    ):
        with pytest.raises(InputError, match=words):
            compare.compare(formulas, [mine], out, TWO)


def test_results_of_another_solver_or_pack_stay(
    formulas: Path, all_levels: Path, tmp_path: Path
) -> None:
    run(formulas, tmp_path, TAIL)
    results = tmp_path / "results"
    _refused(formulas, results, "holds the benchmark of the solver .*, not")
    with pytest.raises(InputError, match="answers to another pack"):
        run(all_levels, tmp_path, TAIL)
    run(formulas, tmp_path, TAIL)
    with (
        workspace.claimed(results, workspace.RESULTS, program(tmp_path, TAIL)),
        pytest.raises(OrchestratorError, match=r"is held|being run|is in use|holds it"),
    ):
        run(formulas, tmp_path, TAIL)


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


@pytest.mark.parametrize(
    "text", ["[]", '{"error": []}', '{"seconds": 0, "cpu_s": -1}', '{"seconds": 1e999}']
)
def test_results_of_a_stranger(formulas: Path, tmp_path: Path, text: str) -> None:
    given = tmp_path / "given"
    for place in (given / "2-incline-5", given / "ours" / "2-incline-5"):
        place.mkdir(parents=True)
        (place / "answer.csv").write_text(INCLINE)
        (place / "used.json").write_text(text)
    before = sorted(given.rglob("*"))
    choice = Choice(patterns=("2-incline-5",))
    outcome = compare.compare(formulas, [given], tmp_path / "page", choice)
    assert outcome.failures == []
    assert sorted(given.rglob("*")) == before
    (given / "ours" / "2-incline-5" / "answer.csv").write_text("junk")
    with pytest.raises(InputError, match=r"ours/2-incline-5/answer\.csv"):
        compare.compare(formulas, [given], tmp_path / "page", choice)


@pytest.mark.parametrize(
    "text", ["\ufeff" + INCLINE, INCLINE.replace(",", ", "), INCLINE.replace("\n", "\r\n")]
)
@pytest.mark.parametrize("name", [os.fsdecode(b"\xff"), "\x1b[2J", "\u6c99", "$\\frac{"], ids=ascii)
@pytest.mark.filterwarnings("error")
def test_forms_of_answers_and_names_of_solvers(
    formulas: Path, tmp_path: Path, name: str, text: str
) -> None:
    root = tmp_path / name / "pack" / name
    shutil.copytree(formulas, root)
    folder = tmp_path / name / "2-incline-5"
    folder.mkdir()
    (folder / "answer.csv").write_bytes(text.encode())
    choice = Choice(patterns=("2-incline-5",))
    outcome = compare.compare(root, [folder.parent], tmp_path / "page", choice)
    assert not outcome.failures
    assert "\x1b" not in outcome.summary + outcome.page.read_text(encoding="utf-8")
