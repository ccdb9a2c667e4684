"""Solvers as real processes: a right one passes, each fault is named, and the run goes on."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from orchestrator import cli
from orchestrator.benchmark import compare, pack
from orchestrator.benchmark.compare import Choice, Limits, split
from orchestrator.errors import InputError
from tests.benchmark.conftest import ROOT
from tests.benchmark.programs import AFTER, RIGHT, SMALL, TAIL, TWO, program, run, verdicts_in
from tests.conftest import Command

SCENE = Choice(patterns=("2-incline-5",))
FAULTS = {
    # limits
    "sleeps": ("time.sleep(1000)", "it did not end within 3 s and was killed"),
    "ignores the end": (
        "import signal; signal.signal(15, signal.SIG_IGN); time.sleep(99)",
        "it did not end within 3 s",
    ),
    "prints": ("while True: print('y' * 4096)", "it printed more than 1 MiB"),
    "a large file": ("Path('f').write_bytes(bytes(10**7))", "File too large"),
    "memory": ("b = bytes([1]) * 10**9", "it ended with 1: MemoryError"),
    # ends
    "exit 1": ("sys.exit('the mesh is inverted')", "it ended with 1: the mesh is inverted"),
    "a core": ("os.abort()", "it ended with 134"),
    "a right answer, but": (AFTER + "sys.exit(3)", "it ended with 3"),
    # files in place of an answer
    "nothing": ("sys.exit(0)", "it wrote no answer.csv"),
    "its directory gone": ("import shutil; shutil.rmtree(out.parent)", "it wrote no answer.csv"),
    "its directory renamed": ("out.parent.rename(out.parent.with_name('x'))", "no answer.csv"),
    "a huge answer": ("out.open('wb').truncate(8 * 2**20)", "more than 4 MiB"),
    "a link": ("out.symlink_to('/etc/passwd')", "is a link or no file"),
    "a pipe": ("os.mkfifo(out)", "is a link or no file"),
    "a directory": ("out.mkdir()", "is a link or no file"),
    # answers that are not whole
    "no text": ("out.write_bytes(b'\\xff\\xfe')", "answer.csv is no table"),
    "zeros": ("out.write_bytes(b'quantity,at,value\\n' + bytes(99))", "line 2: 1 fields|no table"),
    "no head": (AFTER + "out.write_text(text[18:])", "does not begin with quantity,at,value"),
    "a line cut short": (AFTER + "out.write_text(text[:text.rindex(',')])", "line 2: 2 fields"),
    "a file cut short": (AFTER + "out.write_text(text[:-3])", "its last line has no end"),
    "a decimal comma": (AFTER + "out.write_text(text.replace('0.0', '0,0'))", "4 fields"),
    "not a number": (AFTER + "out.write_text(text.replace('0.0', 'nan#'))", "no finite number"),
    "NaN": (
        "out.write_text('quantity,at,value\\nacceleration_over_g,,nan\\n')",
        "no finite number",
    ),
    "infinite": ("out.write_text('quantity,at,value\\na,,-inf\\n')", "no finite number"),
    "an underscore": (AFTER + "out.write_text(text.replace('0.0', '0.0_'))", "no finite number"),
    "other digits": (AFTER + "out.write_text(text.replace('2', '\u0662'))", "no finite number"),
    "twice": (AFTER + "out.write_text(text + text[18:])", "answers acceleration_over_g twice"),
    "another name": (
        AFTER + "out.write_text(text.replace('_g', '_a'))",
        "lacks acceleration_over_g",
    ),
    # wrong numbers
    "30 % high": (
        AFTER + "out.write_text('quantity,at,value\\nacceleration_over_g,,0.0809\\n')",
        "acceleration_over_g is 0.0809, not 0.06225",
    ),
}
"""Bodies of solvers, and what is said of each."""


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_caught_and_named(
    formulas: Path, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compare, "LOG_BYTES", 2**20)
    monkeypatch.setattr(compare, "FILE_BYTES", 8 * 2**20)
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    body, words = FAULTS[name]
    limits = Limits(3.0, SMALL.memory) if "3 s" in words else SMALL
    outcome = run(formulas, tmp_path, body, SCENE, limits)
    (line,) = outcome.failures
    assert re.search(words, line), line
    assert not verdicts_in(tmp_path)["passed"].any()
    assert not list(folder.iterdir())  # its private directory is removed


def test_a_run_goes_on_after_a_fault_and_the_page_is_clean(formulas: Path, tmp_path: Path) -> None:
    bodies = {
        "2-incline-5": "print(chr(27) + '[2J'); sys.exit(1)",
        "2-incline-45": "import shutil; shutil.rmtree(out.parent)",
        "2-incline-75": "out.write_bytes(bytes(99))",
    }
    body = f"body = {bodies!r}.get(solver.json.loads((case / 'scene.json').read_text())['scene'])"
    body += "\nif body:\n    exec(body)\nelse:\n    solver.main(case, out)\n"
    outcome = run(formulas, tmp_path, body, Choice(patterns=("2-incline-*",)))
    passed = verdicts_in(tmp_path)["passed"]
    assert set(passed[~passed].index) == set(bodies)
    assert "\x1b" not in "".join(outcome.failures) + outcome.page.read_text()


def test_each_program_and_cause_is_listed_once(formulas: Path, tmp_path: Path) -> None:
    outcome = run(formulas, tmp_path, "sys.exit(2)", Choice(patterns=("2-incline-*",)))
    assert outcome.failures == ["2-incline-5 and 5 more of kind incline: it ended with 2"]
    verdicts = verdicts_in(tmp_path)
    assert not verdicts["answered"].any()
    assert verdicts[["ratio", "cpu_ratio"]].isna().all(axis=None)
    assert (verdicts["ours_seconds"] > 0).all()
    assert outcome.page.read_text().count("<td>liggghts</td>") == 1


def test_a_solver_gets_its_scene_and_no_expected_answer(formulas: Path, tmp_path: Path) -> None:
    body = (
        "import json; print(json.dumps([sys.argv[1:], os.getcwd(),"
        " sorted(p.name for p in case.iterdir()), sorted(p.name for p in Path('..').iterdir()),"
        " [v for v in os.environ.values() if 'formulas' in v]]))" + TAIL
    )
    assert not run(formulas, tmp_path, body, SCENE).failures
    log = (tmp_path / "results" / "2-incline-5" / "log.txt").read_text()
    words, cwd, files, beside, variables = json.loads(log.splitlines()[0])
    assert words == [f"{cwd}/case", f"{cwd}/answer.csv"]
    assert files == ["ask.csv", "scene.json"]
    assert beside == ["log.txt", "work"]
    assert variables == []


def test_times_and_memory_are_those_of_the_solver(formulas: Path, tmp_path: Path) -> None:
    body = "b = bytes([1]) * 10**8\nstart = time.process_time()\n"
    body += "while time.process_time() < start + 0.5: pass" + TAIL
    run(formulas, tmp_path, body, SCENE)
    used = verdicts_in(tmp_path).loc["2-incline-5"]
    assert 100 < used["peak_mib"] < 160
    assert used["seconds"] > 0.5
    assert used["cpu_s"] > 0.5
    assert used["ratio"] == pytest.approx(used["seconds"] / used["ours_seconds"], rel=1e-4)


def test_a_changed_pack_is_not_used_further(formulas: Path, tmp_path: Path) -> None:
    root = tmp_path / "pack"
    subprocess.run(["cp", "-r", formulas, root], check=True)
    body = f"Path({str(root / 'expected.csv')!r}).open('a').write('x')" + TAIL
    with pytest.raises(InputError, match=r"expected\.csv is not what was exported"):
        run(root, tmp_path, body)
    with pytest.raises(InputError, match=r"expected\.csv is not what was exported"):
        compare.compare(root, [tmp_path / "results"], None, Choice())


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("true {case}", "no {out}"),
        ("no-such-solver {case} {out}", "no program no-such-solver"),
        ("'open {case} {out}", "cannot be read"),
        ("true {case} {out} >log.txt", "no shell reads the command: >log.txt"),
        ("true {case} {out} | tee log", "no shell"),
        ("true {case} {out} && true", "sh -c"),
        ("true {case} {out}; true", "no shell"),
    ],
)
def test_a_command_that_cannot_work(command: str, words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)):
        split(command)


def test_no_shell_reads_the_command(formulas: Path, tmp_path: Path) -> None:
    command = program(tmp_path, TAIL) + " $HOME `touch shell` $(touch shell)"
    compare.run(formulas, command, tmp_path / "results", SCENE, SMALL)
    assert not list(tmp_path.rglob("shell"))


@pytest.mark.parametrize("words", [["--limit", "nan"], ["--memory", "0"], ["--level", "6"]])
def test_options_that_are_refused(
    formulas: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["benchmark", "run", str(formulas), "--solver", RIGHT, *words])
    assert ended.value.code == 2
    assert words[0] in capsys.readouterr().err


def test_levels_and_patterns_in_one_list(
    formulas: Path, tmp_path: Path, orchestrator: Command
) -> None:
    command = ("benchmark", "run", str(formulas), "--solver", RIGHT, "--out", "results")
    scenes = pd.read_csv(formulas / "scenes.csv")["scene"]
    first = scenes[scenes.str.startswith("1-")].iloc[0]
    ended = orchestrator(*command, "--level", "1", "2", "--scene", first, "2-incline-[27]0")
    assert ended.returncode == 0, ended.stderr
    table = pd.read_csv(tmp_path / "results" / "verdicts.csv")
    assert set(table["scene"]) == {first, "2-incline-20", "2-incline-70"}
    again = orchestrator(
        *("benchmark", "compare", str(formulas), "results", "--level", "2"),
        *("--scene", "2-incline-[27]0", "2-incline-5"),
    )
    assert again.returncode == 1
    assert "2-incline-5: it wrote no answer.csv" in again.stderr
    ended = orchestrator("benchmark", "export", "pack", "--level", "1", "2")
    assert ended.returncode == 0, ended.stderr
    assert {name[0] for name in pack.read(tmp_path / "pack").scenes} == {"1", "2"}


def _running(text: str) -> bool:
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if text in (folder / "cmdline").read_text(errors="replace"):
                return True
        except OSError:
            continue
    return False


def test_a_killed_run_leaves_nothing_at_work(formulas: Path, tmp_path: Path) -> None:

    command = program(tmp_path, "time.sleep(100)")
    words = [sys.executable, "-m", "orchestrator", "benchmark", "run", str(formulas)]
    driver = subprocess.Popen(
        [*words, "--solver", command, "--scene", "2-incline-5"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stderr=subprocess.DEVNULL,
    )
    path, end = f"{tmp_path / 'my solver.py'}\0/", time.monotonic() + 120
    while not _running(path) and time.monotonic() < end:
        time.sleep(0.05)
    assert _running(path)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    while _running(path) and time.monotonic() < end:
        time.sleep(0.05)
    assert not _running(path)


def test_what_a_solver_leaves_at_work_ends_with_it(formulas: Path, tmp_path: Path) -> None:
    body = (
        "import subprocess; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(99)',"
    )
    body += f" {str(tmp_path / 'left')!r}])" + TAIL
    assert not run(formulas, tmp_path, body, TWO).failures
    end = time.monotonic() + 60
    while _running(str(tmp_path / "left")) and time.monotonic() < end:
        time.sleep(0.05)
    assert not _running(str(tmp_path / "left"))


def test_a_lost_grain_is_caught(all_levels: Path, tmp_path: Path) -> None:
    body = AFTER + (
        "lines = [line.split(',') for line in text.splitlines()]\n"
        "out.write_text(''.join(f\"{q},{at},{float(v) - 1 if q == 'not_moved' else v}\\n\""
        " for q, at, v in lines))\n"
    )
    (line,) = run(all_levels, tmp_path, body, Choice(patterns=("4-*",))).failures
    assert "the counts do not make N" in line


@pytest.mark.parametrize("count", ["0.5", "-1"])
def test_counts_are_whole(all_levels: Path, tmp_path: Path, count: str) -> None:
    body = AFTER + (
        "head, first, *lines = text.splitlines()\n"
        f"first = first.rpartition(',')[0] + ',{count}'\n"
        "out.write_text('\\n'.join([head, first, *lines, '']))\n"
    )
    (line,) = run(all_levels, tmp_path, body, Choice(patterns=("4-*",))).failures
    assert f"moved at 1 is {count}: it counts grains" in line


@pytest.mark.parametrize("packed", ["all_levels", "poured"])
def test_ours_answers_as_exported(
    packed: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """A solver that knows no kind: only our own runs answer."""
    root = request.getfixturevalue(packed)
    run(root, tmp_path, "sys.exit(2)", Choice(levels=(3, 4, 5)))
    numbers = pd.read_csv(tmp_path / "results" / "comparison.csv")
    assert set(numbers["scene"].str[0]) == set("345" if packed == "all_levels" else "4")
    pd.testing.assert_series_equal(numbers["ours"], numbers["value"], check_names=False, rtol=1e-6)
