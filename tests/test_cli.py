"""The commands as a user runs them, in processes of their own, and their messages."""

import ast
import errno
import os
import re
import shlex
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from orchestrator import cli, pipeline, plan, tables
from orchestrator.benchmark import commands as benchmark
from orchestrator.errors import LONGEST, Fault, InputError, of_exception
from orchestrator.runs import files, workspace
from orchestrator.runs.workspace import EXPERIMENT, Workspace
from orchestrator.study.study import Study
from tests.conftest import Command

GRAINS = """
method.grains.load_increment = 0.05
[axes]
"grain.diameter" = [7e-4, 1e-3]
"""


def refused(ended: "subprocess.CompletedProcess[str]", *words: str) -> None:
    """See that a command ended with one line that has some words."""
    assert ended.returncode != 0
    assert "Traceback" not in ended.stderr
    lines = [
        line for line in ended.stderr.splitlines() if line.startswith("orchestrator")
    ]
    assert len(lines) == 1, ended.stderr
    assert all(word in lines[0] for word in words), lines


def imitation(folder: Path, script: str) -> str:
    """A PATH on which `liggghts` is a shell script that ends with a run of the real one."""
    program = folder / "bin" / "liggghts"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\n{script}\nexec {shutil.which("liggghts")} "$@"\n')
    program.chmod(0o755)
    return f"{program.parent}:{os.environ['PATH']}"


@pytest.fixture
def grains(tmp_path: Path) -> str:
    (tmp_path / "grains.toml").write_text(GRAINS)
    return "grains.toml"


def test_the_help_of_each_command_has_two_examples_and_its_page(
    capsys: pytest.CaptureFixture[str],
) -> None:
    commands = [*cli.commands(), *benchmark.PARTS]
    for command in [command.name for command in commands]:
        with pytest.raises(SystemExit):
            cli.main([*command.split(), "--help"])
        text = capsys.readouterr().out
        lines = re.findall(r"(?m)^  orchestrator (.+)$", text)
        assert len(lines) == 2, command
        for line in lines:
            assert line.startswith(command)
            words = shlex.split(line.partition(" > ")[0])
            cli.parser().parse_args(words)  # it ends the program where words are wrong
        (page,) = re.findall(r"(?m)^explained in (\S+)$", text)
        name = command.split()[0]
        page_text = (Path(__file__).parents[1] / page).read_text(encoding="utf-8")
        assert re.search(rf"orchestrator {name}|`{name}[ `]", page_text), command


@pytest.mark.long
def test_a_study_of_single_grains_and_the_same_again(
    orchestrator: Command, tmp_path: Path, grains: str
) -> None:
    plan = orchestrator("study", grains, "--out", "out", "--plan", path="/nowhere")
    for words in ("2 scenes", "1 case: cells 1; to run: cells 1", "expected: about"):
        assert words in plan.stdout
    assert not (tmp_path / "out").exists()
    first = orchestrator("study", grains, "--out", "out")
    assert first.returncode == 0, first.stderr
    last = first.stdout.split("\n")[-2].removeprefix("page: ")
    assert first.stdout.startswith("At what wind does a grain start to move")
    (shared,) = [line for line in first.stdout.splitlines() if "all rows" in line]
    assert "with a correction" in shared
    assert "Shields number" in first.stdout
    assert re.search(r"\[1/1\] done .* of the work, about \d+ s left", first.stderr)
    assert Path(last) == tmp_path / "out" / "report.html"
    assert Path(last).is_file()
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")}
    again = orchestrator("study", grains, "--out", "out", path="/nowhere")
    assert again.returncode == 0, again.stderr
    assert "no solver was started" in again.stderr
    assert again.stdout == first.stdout
    after = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")}
    touched = {path.name for path in after if after[path] != before.get(path)}
    assert touched <= {"study.json", ".lock"}
    assert orchestrator("report", "out").stdout == first.stdout
    odd = """odd "quo'tes" é"""
    shutil.copy(tmp_path / grains, tmp_path / f"{odd}.toml")
    assert orchestrator("study", f"{odd}.toml", "--out", odd).returncode == 0
    assert "1 done" in orchestrator("status", odd).stdout
    for path in (tmp_path / "out" / "tables").iterdir():
        assert (tmp_path / odd / "tables" / path.name).read_bytes() == path.read_bytes()


@pytest.mark.long
def test_what_cannot_be_run_or_written_is_refused(
    orchestrator: Command, tmp_path: Path, grains: str
) -> None:
    refused(orchestrator("study", "no-such-study"), "no-such-study", "first-look")
    (tmp_path / "steep.toml").write_text("grain.diameter = 1e-3\nbed.slope_deg = 50.0")
    refused(orchestrator("study", "steep.toml", "--plan"), "steep.toml", "slope_deg")
    thesis = tmp_path / "mine" / "thesis.txt"
    thesis.parent.mkdir()
    thesis.write_text("do not touch")
    refused(
        orchestrator("study", grains, "--out", "mine"), "mine", "not a study", "--out"
    )
    assert list(thesis.parent.iterdir()) == [thesis]
    refused(orchestrator("study", grains, "--out", str(thesis)), "thesis.txt")
    refused(
        orchestrator("study", grains, "--out", "/proc/study"), "/proc/study", "--out"
    )
    refused(orchestrator("status", "mine"), "mine", "no study")
    missing = orchestrator("study", grains, "--out", "out", path="/nowhere")
    refused(missing, "liggghts", "apt-get install")
    doctor = orchestrator("doctor", path="/nowhere")
    assert doctor.returncode == 1
    assert "apt-get install --no-install-recommends liggghts" in doctor.stdout
    assert orchestrator("doctor").returncode == 0


@pytest.mark.parametrize(("version", "word"), [("3.4.1", "older"), ("4.1.0", "tried")])
def test_other_versions_of_the_solver(
    orchestrator: Command, tmp_path: Path, grains: str, version: str, word: str
) -> None:
    text = f"LIGGGHTS (Version LIGGGHTS-PUBLIC {version}, compiled)"
    path = imitation(tmp_path, f'[ "$1" = -h ] && echo "{text}" && exit')
    ended = orchestrator("study", grains, "--out", "out", path=path)
    assert word in ended.stderr
    assert (ended.returncode == 0) == (version == "4.1.0"), ended.stderr


def test_a_failed_case_is_named_and_the_others_are_finished(
    orchestrator: Command, tmp_path: Path, grains: str
) -> None:
    # the deck with the first friction angle gets a line that LIGGGHTS refuses
    script = (
        '[ "$1" = -h ] || ! grep -q "friction equal 0.57" parameters.liggghts'
        " || echo nonsense >>parameters.liggghts"
    )
    (tmp_path / grains).write_text(
        GRAINS + '"grain.friction_angle_deg" = [30.0, 35.0]\n'
    )
    ended = orchestrator(
        "study", grains, "--out", "out", path=imitation(tmp_path, script)
    )
    assert ended.returncode == 3
    assert "Traceback" not in ended.stderr
    assert "ERROR" in ended.stderr
    status = orchestrator("status", "out")
    assert status.returncode == 3
    assert "1 done" in status.stdout
    assert "1 failed" in status.stdout
    assert orchestrator("report", "out").returncode == 3
    assert "ERROR" in (tmp_path / "out" / "report.html").read_text()
    again = orchestrator("study", grains, "--out", "out")
    assert again.returncode == 0, again.stderr


def test_a_finished_experiment_has_a_page_and_is_not_to_be_continued(
    tmp_path: Path,
) -> None:
    space = Workspace(tmp_path)
    space.describe(EXPERIMENT, "erosion", ["pile-1"], {})
    text, _ = workspace.status(space.root)
    assert text.startswith("experiment erosion: 0 done, 0 unfinished, 1 not begun")
    assert "the same command continues it" in text
    space.page.touch()
    assert "the same command continues it" in workspace.status(space.root)[0]
    case = space.cases / "pile-1"
    case.mkdir(parents=True)
    (case / "done.json").write_text('{"id": "1"}')
    text, has_failed = workspace.status(space.root)
    assert f"page: {space.page}" in text
    assert "continues" not in text
    assert not has_failed


def test_report_on_an_experiment_says_the_command_that_draws_it(tmp_path: Path) -> None:
    space = Workspace(tmp_path / "out")
    space.root.mkdir()
    space.describe(EXPERIMENT, "ladder", [], {"file": "../mine.toml"})
    (tmp_path / "mine.toml").touch()
    file = re.escape(str(tmp_path / "mine.toml"))
    place = re.escape(str(space.root))
    with pytest.raises(InputError, match=f"orchestrator ladder {file} --out {place}"):
        pipeline.redraw(space.root)


def test_the_command_that_draws_an_experiment_names_no_file_that_is_not_there(
    tmp_path: Path,
) -> None:
    space = Workspace(tmp_path / "moved" / "out")
    space.root.mkdir(parents=True)
    space.describe(EXPERIMENT, "surface", [], {"file": "../mine.toml"})
    with pytest.raises(InputError) as caught:
        pipeline.redraw(space.root)
    message = str(caught.value)
    assert "orchestrator study FILE --out" in message
    assert f"FILE is mine.toml, which is not in {tmp_path / 'moved'}" in message


def test_no_message_has_an_escaped_line_end() -> None:
    for module in files.PACKAGE.rglob("*.py"):
        tree = ast.parse(module.read_text(encoding="utf-8"))
        for said in ast.walk(tree):
            is_said = isinstance(said, ast.Call) and getattr(said.func, "id", "") in (
                *("print", "say"),
                *("OrchestratorError", "InputError", "SolverError", "Remark"),
            )
            for part in (
                ast.walk(said) if is_said or isinstance(said, ast.Raise) else ()
            ):
                text = part.value if isinstance(part, ast.Constant) else ""
                assert "\\n" not in str(text), (module.name, getattr(said, "lineno", 0))


def test_any_failure_has_a_message_of_one_printable_line() -> None:
    error = InputError("is negative", where="a.toml: grain.diameter", remedy="raise it")
    assert str(error) == "a.toml: grain.diameter: is negative (raise it)"
    assert of_exception(error) is error
    text = str(InputError("a\x1b[2J\n\x9b" + "b" * 10_000))
    assert text.isprintable()
    assert len(text) < LONGEST + 40
    told = str(InputError("one\n two\r\n\tthree", "a\nb", "c\nd"))
    assert told == "a b: one two three (c d)"
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "file")
    for failure, words in (
        (full, "file: no space is left on the disk"),
        (
            shutil.Error([("a", "b", str(full))] * 2),
            "case: no space is left on the disk",
        ),
        (OSError(errno.EACCES, "Permission denied", "file"), "file: Permission denied"),
        (MemoryError(), "ulimit -v"),
        (RuntimeError("can't start new thread"), "ulimit -u"),
        (ImportError("libgmsh.so"), "doctor"),
    ):
        assert words in str(of_exception(failure, "case"))
    assert of_exception(KeyboardInterrupt()).exit_code == 130
    assert isinstance(of_exception(ZeroDivisionError("x"), "case"), Fault)


def test_a_study_without_cases_does_not_say_that_they_were_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "waves.toml"
    file.write_text(
        "fluid = { kind = 'air' }\ngrain = { diameter = 1e-3 }\n"
        "bed = { kind = 'pile', shape = 'dune', slope_deg = 10.0, height = 0.05 }\n"
        "method = { kind = 'local', flow = { model = 'waves' } }\n"
    )
    words = ["study", str(file), "--out", str(tmp_path / "out")]
    assert cli.main(words) == 0
    first = capsys.readouterr()
    assert "its answer needs no case; no solver was started" in first.err
    assert "done already" not in first.err
    assert cli.main(words) == 0
    again = capsys.readouterr()
    assert "done already" not in again.err
    assert "no solver was started" in again.err
    assert again.out == first.out


def test_report_draws_also_what_results_that_are_read_again_show_to_be_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only then are flows that were added on the way known to be asked for."""
    file = tmp_path / "waves.toml"
    file.write_text(
        "fluid = { kind = 'air' }\ngrain = { diameter = 1e-3 }\n"
        "bed = { kind = 'pile', shape = 'dune', slope_deg = 10.0, height = 0.05 }\n"
        "method = { kind = 'local', flow = { model = 'waves' } }\n"
    )
    out = tmp_path / "out"
    assert cli.main(["study", str(file), "--out", str(out)]) == 0
    refined: list[plan.Plan] = []
    drawn: list[plan.Plan] = []
    made_of = tables.make_tables

    def one_more(made: plan.Plan, cases: Path) -> plan.Plan:
        refined.append(made)
        return replace(made) if len(refined) == 1 else made

    def make_tables(study: Study, made: plan.Plan, *more: Any) -> tables.Tables:
        drawn.append(made)
        return made_of(study, made, *more)

    monkeypatch.setattr(plan, "refined", one_more)
    monkeypatch.setattr(tables, "make_tables", make_tables)
    capsys.readouterr()
    pipeline.redraw(out)
    first, second = refined
    assert [made is second for made in drawn] == [True]
    assert first is not second
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("drawing tables  0% of the work, about ")
    assert said[-1] == "all is drawn  100% of the work"
