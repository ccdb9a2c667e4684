"""Solvers as real processes, their results and pages: faults are named, nothing foreign is lost."""

import io
import json
import os
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from orchestrator.benchmark import compare, pack
from orchestrator.benchmark.compare import Options, split
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.runs import workspace
from tests.benchmark.conftest import (
    AFTER,
    RIGHT,
    SCENE,
    TAIL,
    program,
    run,
    seal,
    verdicts_in,
)
from tests.conftest import Command
from tests.report.test_page import Page

CHOICE = Options(patterns=("[24]-*",))
HIGH = 1.3
"""A factor on thresholds that no interval holds."""
INCLINE = "quantity,at,value\nacceleration_over_g,,0.06225\n"
FAULTS = {
    # limits
    "while True: print('y' * 4096)": "it printed more than 1 MiB",
    "Path('f').write_bytes(bytes(10**7))": "File too large",
    "b = bytes([1]) * 10**9": "it ended with 1: MemoryError",
    # ends
    "print(chr(27) + '[2J'); sys.exit('the mesh is inverted')": "1: the mesh is inverted",
    AFTER + "sys.exit(3)": "it ended with 3",
    AFTER + "sys.exit(4)": "it ended with 4",
    # files in place of an answer
    "sys.exit(0)": "it wrote no answer.csv",
    "sys.exit(2)": "it ended with 2",
    "out.open('wb').truncate(8 * 2**20)": "more than 4 MiB",
    "os.mkfifo(out)": "it wrote no answer.csv",
    # answers that are not whole
    "out.write_bytes(b'\\xff\\xfe')": "answer.csv: 'utf-8' codec",
    AFTER + "out.write_text(text[18:])": "it does not begin with quantity,at,value",
    AFTER + "out.write_text(text[:text.rindex(',')] + '\\n')": "line 12, ",
    AFTER + "out.write_text(text[:-3])": "its last line has no end",
    "out.write_text('quantity,at,value\\na,,-inf\\n')": "finite number",
    AFTER + "out.write_text(text + text[18:])": "is answered twice",
    AFTER + "out.write_text(text.replace('ustar', 'speed'))": "lacks ustar_m_s",
    # wrong numbers
    AFTER
    + "out.write_text(text.replace('ustar_m_s,,', 'ustar_m_s,,9'))": "ustar_m_s is 91.4.*, not 1.4",
}
"""Bodies of solvers, and what is said of each."""


@pytest.mark.long
def test_faults_are_caught_and_named(
    formulas: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One run goes on after each fault; each cause is listed once."""
    monkeypatch.setattr(compare, "LOG_BYTES", 2**20)
    monkeypatch.setattr(compare, "FILE_BYTES", 8 * 2**20)
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    names = [name for name in pack.read_pack(formulas).scenes if name[0] == "1"][
        : len(FAULTS) + 1
    ]
    bodies = dict(zip(names, FAULTS, strict=False))
    body = f"body = {bodies!r}.get(solver.json.loads((case / 'scene.json').read_text())['scene'])"
    body += "\nif body:\n    exec(body)\nelse:\n    solver.main(case, out)\n"
    outcome = run(formulas, tmp_path, body, SCENE._replace(patterns=names))
    verdicts = verdicts_in(tmp_path)
    for name, text in bodies.items():
        assert re.search(FAULTS[text], str(verdicts.loc[name, "message"])), text
    assert verdicts["passed"].tolist() == [False] * len(FAULTS) + [True]
    assert verdicts["answered"].tolist() == [False] * (len(FAULTS) - 1) + [True] * 2
    assert f"{names[4]} and 1 more of kind closed-form: it ended with 3" in str(
        outcome.failures
    )
    assert outcome.failures[-1] == "and 5 more: see verdicts.csv"
    assert re.search(
        "FAILED my solver: of .* 1 passed, .* failed, 1 declined", outcome.summary
    )
    assert "\x1b" not in "".join(outcome.failures) + outcome.page.read_text()
    assert not list(folder.iterdir())  # the private directories are removed


def test_a_solver_that_does_not_end_is_killed(formulas: Path, tmp_path: Path) -> None:
    hanging = SCENE._replace(seconds=1.0)
    outcome = run(formulas, tmp_path, "while True:\n    pass\n", hanging)
    (line,) = outcome.failures
    assert "it did not end within 1 s and was killed" in line


@pytest.mark.long
def test_counts_make_n(all_levels: Path, tmp_path: Path) -> None:
    body = AFTER + (
        "head, *rows = [line.split(',') for line in text.splitlines()]\n"
        "rows = [[q, at, str(float(v) - (q == 'not_moved'))] for q, at, v in rows]\n"
        "out.write_text('\\n'.join(map(','.join, [head, *rows, ['']])))\n"
    )
    (line,) = run(all_levels, tmp_path, body, Options(patterns=("4-*",))).failures
    assert "the counts do not make N" in line


def test_a_solver_gets_its_scene_alone_and_its_use_is_measured(
    formulas: Path, tmp_path: Path
) -> None:
    body = (
        "import json; print(json.dumps([sys.argv[1:], os.getcwd(),"
        " sorted(p.name for p in case.iterdir()), sorted(p.name for p in Path('..').iterdir()),"
        " [v for v in os.environ.values() if 'formulas' in v]]))\n"
        "b = bytes([1]) * 10**8\nstart = time.process_time()\n"
        "while time.process_time() < start + 0.5: pass" + TAIL
    )
    assert not run(formulas, tmp_path, body).failures
    log = (tmp_path / "results" / "2-incline-5" / "log.txt").read_text()
    words, cwd, files, beside, variables = json.loads(log.splitlines()[0])
    assert words == [f"{cwd}/case", f"{cwd}/answer.csv"]
    assert (files, beside, variables) == (
        ["ask.csv", "scene.json"],
        ["log.txt", "work"],
        [],
    )
    used = verdicts_in(tmp_path).loc["2-incline-5"]
    assert 100 < used["peak_mib"] < 160
    assert min(used["seconds"], used["cpu_s"]) > 0.5
    assert used["ratio"] == pytest.approx(
        used["seconds"] / used["ours_seconds"], rel=1e-4
    )


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("true {case}", "no {out}"),
        ("no-such-solver {case} {out}", "no program no-such-solver"),
        ("true {case} {out} >log.txt", "no shell reads the command: >log.txt"),
        ("true {case} {out}; true", "sh -c"),
    ],
)
def test_a_command_that_cannot_work(command: str, words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)):
        split(command)


@pytest.mark.long
@pytest.mark.parametrize("packed", ["all_levels", "poured"])
def test_ours_answers_as_exported(
    packed: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """A solver that knows no kind, and so has failed: only our own runs answer."""
    choice = Options(levels=(3, 4, 5))
    assert run(
        request.getfixturevalue(packed), tmp_path, "sys.exit(2)", choice
    ).failures
    numbers = pd.read_csv(tmp_path / "results" / "comparison.csv")
    assert set(numbers["scene"].str[0]) == set("345" if packed == "all_levels" else "4")
    pd.testing.assert_series_equal(
        numbers["ours"], numbers["value"], check_names=False, rtol=1e-6
    )


@pytest.fixture(scope="module")
def right(all_levels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the example, which passes."""
    out = tmp_path_factory.mktemp("results") / "right"
    outcome = compare.run(all_levels, RIGHT, out, CHOICE._replace(name="right"))
    assert outcome.failures == []
    assert (
        "PASSED right: of 17 scenes 17 passed, 0 failed, 0 declined" in outcome.summary
    )
    return out


@pytest.fixture
def wrong(right: Path, tmp_path: Path) -> Path:
    """The same with thresholds of the pile that are too high, and stated time steps."""
    out = tmp_path / "wrong_one"
    shutil.copytree(right, out)
    (out / "benchmark.json").write_text(
        '{"kind": "benchmark of the solver", "name": "b"}'
    )
    (path,) = out.glob("4-*/answer.csv")
    table = pd.read_csv(path, dtype={"at": str})
    table.loc[table["quantity"] == "shields", "value"] *= HIGH
    path.write_text(table.to_csv(index=False) + "steps,,1000\n")
    return out


@pytest.mark.long
def test_two_solvers_on_one_page(
    all_levels: Path, right: Path, wrong: Path, tmp_path: Path, orchestrator: Command
) -> None:
    words = ("benchmark", "compare", str(all_levels), str(right), str(wrong))
    ended = orchestrator(*words, "--scene", *CHOICE.patterns, "--out", "both")
    assert ended.returncode == 1
    assert re.match("orchestrator: wrong_one: 4-.*shields", ended.stderr)
    both = tmp_path / "both"
    assert ended.stdout.splitlines()[-1] == str(both / "comparison.html")
    parsed = Page((both / "comparison.html").read_text(encoding="utf-8"))
    assert parsed.texts["title"] == "Against the pack “pack”: right, wrong_one"
    assert (
        "FAILED wrong_one: of 17 scenes 16 passed, 1 failed, 0 declined" in parsed.text
    )
    assert "wrong_one" in parsed.texts["th"]
    assert " ** " in parsed.text  # a threshold beyond its tolerance
    assert {*os.listdir(both / "figures")} >= {
        "moved.png",
        "shields.png",
        "speed-accuracy.png",
    }
    # the page of one solver lies with its answers
    outcome = compare.compare(all_levels, [wrong], None, CHOICE)
    assert outcome.page == wrong / "comparison.html"


def _refused(
    pack_of: Path, out: Path, words: str, command: str = "true {case} {out}"
) -> None:
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(OrchestratorError, match=words):
        compare.run(pack_of, command, out, SCENE)
    assert {
        path: path.read_bytes() for path in out.rglob("*") if path.is_file()
    } == before


def test_results_go_nowhere_else(
    all_levels: Path, formulas: Path, tmp_path: Path
) -> None:
    mine, same, copy = (tmp_path / name for name in ("mine", "again/mine", "copy"))
    for folder in (mine, same):
        (folder / "2-incline-5").mkdir(parents=True)
        (folder / "2-incline-5" / "thesis.tex").write_text("mine\n")
    shutil.copytree(formulas, copy)
    (tmp_path / "link").symlink_to(formulas)
    _refused(formulas, copy, "holds the benchmark pack")
    for out, words in (
        (formulas / "results", "may not lie in the pack"),
        (tmp_path / "link" / "results", "may not lie in the pack"),
        (mine, "something that is not a (benchmark|comparison).*2-incline-5"),
        (all_levels.parent / "study", r"holds .*(study|cases)"),
    ):
        _refused(formulas, out, words)
        with pytest.raises(InputError, match=words):
            compare.compare(formulas, [mine], out, SCENE)
    for results, words in (
        ([mine, same], "two solvers have the name mine"),
        ([mine, tmp_path / "nowhere"], "no such directory"),
    ):
        with pytest.raises(InputError, match=words):
            compare.compare(formulas, results, tmp_path / "both", SCENE)
    assert not (tmp_path / "both").exists()


def test_results_of_another_solver_or_pack_stay(
    formulas: Path, all_levels: Path, tmp_path: Path
) -> None:
    root, results = tmp_path / "pack", tmp_path / "results"
    shutil.copytree(formulas, root)
    run(root, tmp_path, TAIL)
    _refused(root, results, "holds the benchmark of the solver .*, not")
    _refused(all_levels, results, "answers to another pack", program(tmp_path, TAIL))
    with workspace.claimed(results, workspace.RESULTS, program(tmp_path, TAIL)):
        _refused(root, results, "it is in use by", program(tmp_path, TAIL))
    # a solver that changes the pack
    body = f"Path({str(root / 'expected.csv')!r}).open('a').write('x')" + TAIL
    shutil.rmtree(results)
    with pytest.raises(InputError, match=r"expected\.csv is not what was exported"):
        run(root, tmp_path, body)


def test_answers_to_another_pack_are_not_compared(
    formulas: Path, all_levels: Path, tmp_path: Path
) -> None:
    """Scenes of two packs have equal names; a pack that is exported again has equal questions."""
    run(all_levels, tmp_path, TAIL)
    results = tmp_path / "results"
    before = sorted(results.rglob("*"))
    with pytest.raises(
        InputError, match=r"answers to another pack.*formulas.*with the pack that"
    ):
        compare.compare(formulas, [results], tmp_path / "page", SCENE)
    assert not (tmp_path / "page").exists()
    assert sorted(results.rglob("*")) == before

    again = tmp_path / "again"
    shutil.copytree(all_levels, again)
    (again / "expected.csv").write_text(
        (again / "expected.csv").read_text().replace(",0.01,", ",0.02,")
    )
    seal(again)
    assert not compare.compare(again, [results], tmp_path / "page", SCENE).failures


def test_answers_of_which_no_pack_is_noted_are_said_to_be(
    formulas: Path, tmp_path: Path
) -> None:
    """By hand nothing tells which pack was answered: scenes of two packs have equal names."""
    answers = tmp_path / "by hand"
    for name in ("2-incline-5", "of-another-pack"):
        (answers / name).mkdir(parents=True)
        (answers / name / "answer.csv").write_text(INCLINE)
    told = compare.compare(formulas, [answers], tmp_path / "page", SCENE)
    where = f"taken for answers to “{formulas.name}”"
    for said in (told.summary, told.page.read_text()):
        assert "by hand: nothing in its directory tells which pack was answered" in said
        assert f"{where}, which has no scene for 1 of 2 of them" in said
    shutil.rmtree(answers / "of-another-pack")
    told = compare.compare(formulas, [answers], tmp_path / "page", SCENE)
    assert where in told.summary
    assert "has no scene" not in told.summary
    # run notes the pack
    summary = run(formulas, tmp_path, TAIL).summary
    assert "which pack" not in summary
    again = compare.compare(formulas, [tmp_path / "results"], None, SCENE)
    assert "which pack" not in again.summary + again.page.read_text()


def test_a_comparison_stays_where_another_pack_has_the_same_name(
    formulas: Path, all_levels: Path, tmp_path: Path
) -> None:
    packs = []
    for source in (formulas, all_levels):
        packs.append(tmp_path / source.parent.name / "pack")
        shutil.copytree(source, packs[-1])
    answers = tmp_path / "by hand" / "2-incline-5"
    answers.mkdir(parents=True)
    (answers / "answer.csv").write_text(INCLINE)
    page = compare.compare(packs[0], [answers.parent], tmp_path / "page", SCENE).page
    text = page.read_text()
    with pytest.raises(InputError, match=r"comparison with another pack, .*formulas"):
        compare.compare(packs[1], [answers.parent], tmp_path / "page", SCENE)
    assert page.read_text() == text
    # a pack that was moved is the one that it was
    packs[0].rename(tmp_path / "pack")
    compare.compare(tmp_path / "pack", [answers.parent], tmp_path / "page", SCENE)


def test_a_run_says_one_line_for_each_level(
    formulas: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    choice = Options(patterns=("2-incline-*", "1-*-d0.2mm-z0.1d-*", "2-sliding-5"))
    run(formulas, tmp_path, TAIL, choice)
    levels = [name[0] for name in pack.read_pack(formulas).chosen((), choice.patterns)]
    lines = [f"level 1: {levels.count('1')} scenes", "level 2: 7 scenes"]
    assert capsys.readouterr().err.splitlines() == lines


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (os.fsdecode(b"\xff"), INCLINE),
        ("\x1b[2J", "\ufeff" + INCLINE),
        ("\u6c99", INCLINE.replace(",", ", ")),
        ("$\\frac{$", INCLINE.replace("\n", "\r\n")),
    ],
    ids=ascii,
)
@pytest.mark.filterwarnings("error")
def test_forms_of_answers_and_names_of_solvers(
    formulas: Path, tmp_path: Path, name: str, text: str
) -> None:
    """Answers of others, whose times are of any kind; nothing is written beside them."""
    root = tmp_path / name / "pack" / name
    shutil.copytree(formulas, root)
    results = tmp_path / name / "2-incline-5"
    for folder in (results / "2-incline-5", results / "ours" / "2-incline-5"):
        folder.mkdir(parents=True)
        (folder / "answer.csv").write_bytes(text.encode())
        (folder / "used.json").write_text(
            '{"seconds": 0, "cpu_s": -1, "peak_mib": "1"}'
        )
    before = sorted(results.rglob("*"))
    outcome = compare.compare(root, [results], tmp_path / "page", SCENE)
    assert not outcome.failures
    assert "\x1b" not in outcome.summary + outcome.page.read_text(encoding="utf-8")
    assert sorted(results.rglob("*")) == before


class Stream(io.StringIO):
    """A stream that may be a terminal."""

    def __init__(self, is_terminal: bool) -> None:
        super().__init__()
        self.is_terminal = is_terminal

    def isatty(self) -> bool:
        return self.is_terminal


def test_one_line_on_a_terminal_says_how_far_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    levels = {"1-a": 1, "1-b": 1, "4-c": 4}
    for is_terminal in (True, False):
        stream = Stream(is_terminal)
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setenv("TERM", "xterm")
        assert list(compare.shown(levels)) == [*levels]
        text = stream.getvalue()
        if is_terminal:
            assert "3/3 scenes" in text
            assert "level 4: 4-c" in text
            assert text.count("\n") <= 1
        else:
            assert text == "level 1: 2 scenes\nlevel 4: 1 scene\n"


LEVEL_1 = Options((1,), seconds=60.0)


def _answers(pack_of: Path, place: Path, changed: Callable[..., float]) -> Path:
    """The expected answers of level 1, each changed by quantity and scene."""
    expected = pack.read_pack(pack_of).expected
    of_level = expected[expected["scene"].str.startswith("1-")]
    for name, rows in of_level.groupby("scene"):
        lines = []
        for _, part in rows.groupby("at"):
            values = part.set_index("quantity")["value"]
            for row in part.itertuples():
                answer = changed(row.quantity, values)
                lines.append(f"{row.quantity},{row.at},{answer!r}\n")
        (place / str(name)).mkdir(parents=True)
        (place / str(name) / "answer.csv").write_text(
            "quantity,at,value\n" + "".join(lines)
        )
    return place


EXCHANGED = {"drag_n": "lift_n", "lift_n": "drag_n"}


@pytest.mark.parametrize(
    ("changed", "quantity", "looks_like"),
    [
        (
            lambda name, values: (
                float(values[name]) * (1.03 if name == "drag_n" else 1)
            ),
            "drag_n",
            "a constant factor, 1.03",
        ),
        (
            lambda name, values: float(values[name]) * (1e3 if name == "lift_n" else 1),
            "lift_n",
            "a constant factor, 1000: unit?",
        ),
        (
            lambda name, values: float(values[EXCHANGED.get(name, name)]),
            "lift_n",
            "the expected drag_n: exchanged columns?",
        ),
        (
            lambda name, values: (
                float(values[name]) + (0.02 if name == "ustar_m_s" else 0)
            ),
            "ustar_m_s",
            "a shift, +0.02",
        ),
        (lambda name, values: float(values[name]), "drag_n", ""),
    ],
)
def test_what_is_off_in_all_answers_to_a_quantity_is_named(
    formulas: Path,
    tmp_path: Path,
    changed: Callable[..., float],
    quantity: str,
    looks_like: str,
) -> None:
    theirs = _answers(formulas, tmp_path / "theirs", changed)
    out = tmp_path / "page"
    outcome = compare.compare(formulas, [theirs], out, LEVEL_1)
    table = pd.read_csv(out / "quantities.csv", keep_default_na=False)
    row = table.set_index("quantity").loc[quantity]
    assert row["looks like"] == looks_like
    numbers = pd.read_csv(out / "comparison.csv")
    error = numbers.loc[numbers["quantity"] == quantity, "error"].median()
    assert row["error, %"] == pytest.approx(100 * error, rel=1e-4, abs=1e-9)
    said = f"theirs: {quantity} of closed-form: {looks_like}"
    assert (said in outcome.summary) is bool(looks_like)
    assert (
        looks_like in (out / "comparison.html").read_text("utf-8")
    ) or not looks_like


def test_scenes_that_were_not_run_are_no_failures(
    formulas: Path, tmp_path: Path
) -> None:
    theirs = _answers(
        formulas, tmp_path / "theirs", lambda name, all_: float(all_[name])
    )
    outcome = compare.compare(formulas, [theirs], tmp_path / "page", Options())
    names = pack.read_pack(formulas).scenes
    done = sum(name.startswith("1-") for name in names)
    assert outcome.failures == []
    line = f"PASSED theirs: of {len(names)} scenes {done} passed, 0 failed, 0 declined"
    assert f"{line}, {len(names) - done} not run" in outcome.summary
    # a scene that was run and has no answer has failed, and so has who ran none
    (theirs / "2-incline-5").mkdir()
    outcome = compare.compare(formulas, [theirs], tmp_path / "page", Options())
    assert outcome.failures == ["theirs: 2-incline-5: it wrote no answer.csv"]
    (tmp_path / "none").mkdir()
    outcome = compare.compare(
        formulas, [tmp_path / "none"], tmp_path / "page", Options()
    )
    assert "0 passed" in outcome.summary
    assert outcome.failures


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("steps,,-3", "steps is -3, no number of time steps"),
        ("steps,,2.5", "steps is 2.5, no number of time steps"),
        ("mass_kg,,1", "answer.csv has mass_kg, which was not asked"),
        ("steps,,12", ""),
    ],
)
def test_an_answer_to_no_question_is_refused(
    formulas: Path, tmp_path: Path, line: str, why: str
) -> None:
    body = AFTER + f"out.write_text(text + {line!r} + chr(10))\nsys.exit(code)\n"
    outcome = run(formulas, tmp_path, body)
    assert [one.rpartition(": ")[2] for one in outcome.failures] == (
        [why] if why else []
    )


def test_two_solvers_are_compared_where_one_was_run_by_default(
    formulas: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    first = compare.run(formulas, RIGHT, None, SCENE)
    others = compare.run(formulas, RIGHT, tmp_path / "b", SCENE._replace(name="b"))
    assert not first.failures + others.failures
    both = [first.page.parent, others.page.parent]
    outcome = compare.compare(formulas, both, None, SCENE)
    assert outcome.page.parent == tmp_path / "results" / f"comparison-{formulas.name}"
