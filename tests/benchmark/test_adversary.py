"""Solvers that mean harm: they learn nothing, break nothing, and outlive nothing."""

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from orchestrator import cli
from orchestrator.benchmark import runner, variants
from orchestrator.benchmark.runner import Choice
from orchestrator.benchmark.solver import split
from orchestrator.errors import InputError
from orchestrator.runs import confined
from tests.benchmark.conftest import NATIVE, ROOT
from tests.benchmark.programs import SMALL, TAIL, TWO, program, run, verdicts_in
from tests.conftest import Command

OPEN = pytest.mark.usefixtures("without_walls")
pytestmark = pytest.mark.usefixtures("nothing_left")


CHEAT = """
import glob
def known(root):
    rows = [line.split(',') for line in open(f'{root}/expected.csv')]
    return {(q, at): value for scene, q, at, value, *_ in rows if scene == name}
name = solver.json.loads((case / 'scene.json').read_text())['scene']
answers = {}
for path in PLACES:
    try:
        answers = answers or known(path)
    except OSError:
        pass
if not answers:
    sys.exit('nothing found')
with out.open('w') as stream:
    stream.write('quantity,at,value\\n')
    for q, at in answers:
        stream.write(f'{q},{at},{answers[q, at]}\\n')
"""
BY_COMMAND = """
words = []
for file in glob.glob('/proc/[0-9]*/cmdline'):
    try:
        words += open(file).read().split(chr(0))
    except OSError:
        pass
PLACES = [word for word in words if word.startswith('/')]
"""


def _cheat(places: str) -> str:
    return CHEAT.replace("for path in PLACES", f"{places}\nfor path in PLACES")


@pytest.mark.usefixtures("walls")
def test_a_cheat_finds_no_expected_answers(formulas: Path, tmp_path: Path) -> None:
    pack = tmp_path / "pack"
    shutil.copytree(formulas, pack)
    places = f"{BY_COMMAND}\nPLACES += [{str(pack)!r}, *glob.glob({str(tmp_path) + '/*'!r})]"
    found = run(pack, tmp_path, _cheat(places))
    assert not verdicts_in(tmp_path)["passed"].any()
    assert "nothing found" in found.failures[0]
    assert "without sight of the pack" in found.page.read_text()


def test_a_cheat_from_the_shell_finds_no_expected_answers(
    formulas: Path, tmp_path: Path, orchestrator: Command
) -> None:
    if not confined.hides():
        pytest.skip("this system has no namespaces for users")
    command = program(tmp_path, _cheat(BY_COMMAND))
    scene = ("--scene", "2-incline-5")
    ended = orchestrator("benchmark", "run", str(formulas), *scene, "--solver", command)
    assert ended.returncode == 1
    assert "nothing found" in ended.stderr


@OPEN
def test_a_cheat_that_sees_the_pack_fails_other_numbers(formulas: Path, tmp_path: Path) -> None:
    choice = Choice(levels=(1,), patterns=("1-0*",))
    found = run(formulas, tmp_path, _cheat(f"PLACES = [{str(formulas)!r}]"), choice)
    verdicts = verdicts_in(tmp_path)
    caught = verdicts["message"].str.contains("it fails the same scene with d_m = ", na=False)
    assert caught.sum() == min(variants.EACH, len(verdicts))
    assert not verdicts.loc[caught, "passed"].any()
    assert "could see the pack with its expected answers" in found.page.read_text()


@pytest.mark.usefixtures("walls")
def test_earlier_answers_and_studies_are_hidden(
    all_levels: Path, finished: Path, tmp_path: Path
) -> None:
    shutil.copytree(finished, tmp_path / "study")
    shutil.copytree(all_levels, tmp_path / "pack")
    choice = Choice(patterns=("2-incline-5",))
    run(tmp_path / "pack", tmp_path, TAIL, choice)
    (tmp_path / "results").rename(tmp_path / "another")
    body = (
        f"seen = [path for name in ('pack', 'study', 'another', 'results') for path in"
        f" Path({str(tmp_path)!r}, name).rglob('*')]\nprint(seen)\nsys.exit(len(seen) + 3)"
    )
    found = run(tmp_path / "pack", tmp_path, body, choice)
    assert "it ended with 3: []" in found.failures[0]


LATE = """
import subprocess
subprocess.Popen([sys.executable, '-c', 'import time\\nwhile True:\\n    time.sleep(0.05)\\n'
    '    try: open(' + repr(str(out)) + ', "w").write("late")\\n    except OSError: pass'],
    start_new_session=True)
"""


@pytest.mark.parametrize("walled", [True, False])
def test_a_daemon_does_not_reach_the_answer(
    formulas: Path, tmp_path: Path, walled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not walled:
        monkeypatch.setattr(confined, "hides", lambda: False)
    found = run(formulas, tmp_path, LATE + TAIL)
    assert [line for line in found.failures if "quantity,at,value" not in line] == []
    texts = [path.read_text() for path in (tmp_path / "results").glob("*/answer.csv")]
    time.sleep(0.3)
    for path, text in zip((tmp_path / "results").glob("*/answer.csv"), texts, strict=True):
        assert path.read_text() == text
    assert str(tmp_path / "tmp") not in _commands()


def _commands() -> str:
    found = []
    for pid in filter(str.isdecimal, os.listdir("/proc")):
        try:
            found.append(Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace"))
        except OSError:
            continue
    return "\n".join(found)


@OPEN
def test_a_solver_that_changes_the_pack_stops_the_run(formulas: Path, tmp_path: Path) -> None:
    root = tmp_path / "pack"
    shutil.copytree(formulas, root)
    body = f"Path({str(root / 'expected.csv')!r}).open('a').write('x')" + TAIL
    with pytest.raises(InputError, match=r"changed expected.csv of the pack.*not used further"):
        run(root, tmp_path, body)
    with pytest.raises(InputError, match=r"expected.csv is not what was exported"):
        runner.compare(root, [tmp_path / "results"], None, Choice())


@pytest.mark.usefixtures("walls")
def test_a_solver_cannot_change_the_pack(formulas: Path, tmp_path: Path) -> None:
    root = tmp_path / "pack"
    shutil.copytree(formulas, root)
    body = f"Path({str(root / 'expected.csv')!r}).open('a').write('x')" + TAIL
    found = run(root, tmp_path, body)
    assert "expected.csv" in found.failures[0]
    assert (root / "expected.csv").read_bytes() == (formulas / "expected.csv").read_bytes()


OTHER = {
    "its words": "other.write_text('quantity,at,value\\n')",
    "a link": "other.unlink(); other.symlink_to(goal)",
    "a pipe": "other.unlink(); os.mkfifo(other)",
    "a directory": "other.unlink(); other.mkdir(); (other / 'more').touch()",
    "nothing": "other.unlink()",
    "its time too": (
        "state = other.stat(); other.write_text(' ' * state.st_size);"
        " os.utime(other, ns=(state.st_atime_ns, state.st_mtime_ns))"
    ),
}


@OPEN
@pytest.mark.filterwarnings("ignore:.*is not what this program wrote")
def test_an_answer_is_put_back(formulas: Path, tmp_path: Path) -> None:
    """Each scene but the first changes the answer to the first, which it has to find whole."""
    foreign = tmp_path / "thesis.tex"
    foreign.write_text("mine\n")
    first, *later = (f"2-incline-{angle}" for angle in (5, 20, 45, 60, 70, 75))
    harms = dict(zip([*later, "2-passing-2"], OTHER.values(), strict=True))
    other = tmp_path / "results" / first / "answer.csv"
    whole = "quantity,at,value\nacceleration_over_g,,0.0"
    body = f"goal, other, harms = Path({str(foreign)!r}), Path({str(other)!r}), {harms!r}\n"
    body += "harm = harms.get(solver.json.loads((case / 'scene.json').read_text())['scene'])\n"
    body += "if harm:\n    assert not other.is_symlink()\n"
    body += f"    assert other.read_text().startswith({whole!r})\n    exec(harm)\n"
    run(formulas, tmp_path, body + TAIL, Choice(patterns=(first, *harms)))
    verdicts = verdicts_in(tmp_path)
    assert verdicts["passed"].to_dict() == {first: True, **dict.fromkeys(harms, False)}
    said = set(verdicts.loc[[*harms], "message"])
    assert said == {f"it changed the answer of {first}, which was put back"}
    assert foreign.read_text() == "mine\n"
    assert not other.is_symlink()
    assert other.read_text().startswith(whole)


@OPEN
def test_a_scene_that_became_a_link_is_not_written_through(formulas: Path, tmp_path: Path) -> None:
    foreign = tmp_path / "mine"
    foreign.mkdir()
    (foreign / "answer.csv").write_text("mine\n")
    body = f"import shutil; folder = Path({str(tmp_path / 'results' / '2-incline-5')!r})\n"
    body += "if '2-incline-20' in (case / 'scene.json').read_text():\n"
    body += f"    shutil.rmtree(folder); folder.symlink_to({str(foreign)!r})\n"
    with pytest.raises(InputError, match="2-incline-5: it is a link to"):
        run(formulas, tmp_path, body + TAIL)
    assert {p.name: p.read_text() for p in foreign.iterdir()} == {"answer.csv": "mine\n"}


def test_a_solver_that_lies_where_it_may_not_see(formulas: Path, tmp_path: Path) -> None:
    pack = tmp_path / "pack"
    shutil.copytree(formulas, pack)
    shutil.copy(NATIVE / "solver.py", pack / "solver.py")
    with pytest.raises(InputError, match=r"solver\.py lies in .*, which is hidden from the solver"):
        runner.run(pack, f"python3 {pack}/solver.py {{case}} {{out}}", None, TWO, SMALL)


@pytest.mark.parametrize(
    ("tail", "words"),
    [
        (">log.txt", "no shell reads the command: >log.txt"),
        ("| tee log", "no shell reads the command: |"),
        ("&& true", "no shell reads the command: &&"),
        ("2>&1", "sh -c"),
    ],
)
def test_a_command_for_a_shell_is_refused(tail: str, words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)):
        split(f"true {{case}} {{out}} {tail}")
    split("true -c 'import this;' {case} {out}")


def test_a_program_that_may_not_be_run(tmp_path: Path) -> None:
    path = tmp_path / "solver"
    path.write_text("#!/bin/sh\n")
    with pytest.raises(InputError, match=r"solver may not be run \(chmod \+x"):
        split(f"{path} {{case}} {{out}}")


@pytest.mark.parametrize("limit", ["nan", "-1", "0", "inf", "soon"])
@pytest.mark.parametrize("option", ["--limit", "--memory"])
def test_limits_that_are_none(
    formulas: Path, capsys: pytest.CaptureFixture[str], option: str, limit: str
) -> None:
    words = ["benchmark", "run", str(formulas), "--solver", "true {case} {out}", option, limit]
    with pytest.raises(SystemExit) as ended:
        cli.main(words)
    assert ended.value.code == 2
    assert option in capsys.readouterr().err


def test_a_killed_run_leaves_nothing_at_work(formulas: Path, tmp_path: Path) -> None:
    command = program(tmp_path, "time.sleep(100)")
    words = [sys.executable, "-m", "orchestrator", "benchmark", "run", str(formulas)]
    driver = subprocess.Popen(
        [*words, "--solver", command, "--scene", "2-incline-5"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path / "tmp")},
        stderr=subprocess.PIPE,
        text=True,
    )
    path = str(tmp_path / "my solver.py")
    end = time.monotonic() + 60
    while f"\0{path}\0{tmp_path / 'tmp'}" not in _commands() and time.monotonic() < end:
        time.sleep(0.1)
    assert path in _commands()
    driver.send_signal(signal.SIGKILL)
    driver.communicate()
    while path in _commands() and time.monotonic() < end:
        time.sleep(0.1)
    assert path not in _commands()
    shutil.rmtree(tmp_path / "tmp")
    (tmp_path / "tmp").mkdir()


def test_what_a_run_says_of_its_walls(formulas: Path, tmp_path: Path) -> None:
    run(formulas, tmp_path, TAIL)
    told = json.loads((tmp_path / "results" / "benchmark.json").read_text())
    assert told["hidden"] is confined.hides()
    assert shlex.split(told["name"])[0] == sys.executable
