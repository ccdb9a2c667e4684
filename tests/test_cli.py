"""The commands as a user runs them, in processes of their own, and their messages."""

import errno
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from orchestrator.errors import (
    LONGEST,
    Fault,
    InputError,
    OrchestratorError,
    of_exception,
    of_system,
    unknown_key,
)
from tests.conftest import Command

GRAINS = """
protocol = { load_increment = 0.05 }
[axes]
"grain.diameter" = [7e-4, 1e-3]
"""
ODD = ["with space", """quo"te's""", "accents é"]


def refused(ended: "subprocess.CompletedProcess[str]", *words: str) -> None:
    """See that a command ended with one line that has some words."""
    assert ended.returncode != 0
    assert "Traceback" not in ended.stderr
    lines = [line for line in ended.stderr.splitlines() if line.startswith("orchestrator")]
    assert len(lines) == 1, ended.stderr
    for word in words:
        assert word in lines[0]


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


@pytest.mark.parametrize("option", ["--fluid=1000", "--diam=1e-3"])
def test_no_option_is_abbreviated(orchestrator: Command, option: str) -> None:
    ended = orchestrator("threshold", "--diameter", "1e-3", option)
    assert ended.returncode == 2
    assert option in ended.stderr


@pytest.mark.parametrize("value", ["-1e1", "-10:10:3", "-.5"])
def test_a_negative_number_is_a_value(orchestrator: Command, value: str) -> None:
    refused(orchestrator("threshold", "--diameter", "1e-3", "--slope", value), "--slope", "0")


def test_a_study_of_single_grains_and_the_same_again(
    orchestrator: Command, tmp_path: Path, grains: str
) -> None:
    first = orchestrator("study", grains, "--out", "out")
    assert first.returncode == 0, first.stderr
    head, row, *_, last = first.stdout.splitlines()
    assert "τ_c" in head
    assert "DEM" in row
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


def test_a_plan_says_what_would_run_and_runs_nothing(
    orchestrator: Command, tmp_path: Path, grains: str
) -> None:
    ended = orchestrator("study", grains, "--out", "out", "--plan", path="/nowhere")
    assert ended.returncode == 0, ended.stderr
    for words in ("2 scenes", "1 case, 1 to run", "cells: 1, 1 to run", "expected: about"):
        assert words in ended.stdout
    assert not (tmp_path / "out").exists()
    (tmp_path / "steep.toml").write_text("grain.diameter = 1e-3\nbed.slope_deg = 50.0")
    refused(orchestrator("study", "steep.toml", "--plan"), "steep.toml", "slope_deg")


@pytest.mark.parametrize("name", ODD)
def test_a_study_of_any_name_gives_the_same_tables(
    orchestrator: Command, tmp_path: Path, grains: str, name: str
) -> None:
    shutil.copy(tmp_path / grains, tmp_path / f"{name}.toml")
    for source, out in ((grains, "plain"), (f"{name}.toml", name)):
        ended = orchestrator("study", source, "--out", out)
        assert ended.returncode == 0, ended.stderr
    assert "1 done" in orchestrator("status", name).stdout
    plain = {path.name: path.read_bytes() for path in (tmp_path / "plain" / "tables").iterdir()}
    odd = {path.name: path.read_bytes() for path in (tmp_path / name / "tables").iterdir()}
    assert odd == plain


def test_what_cannot_be_run_or_written_is_refused(
    orchestrator: Command, tmp_path: Path, grains: str
) -> None:
    refused(orchestrator("study", "no-such-study"), "no-such-study", "first-look")
    thesis = tmp_path / "mine" / "thesis.txt"
    thesis.parent.mkdir()
    thesis.write_text("do not touch")
    refused(orchestrator("study", grains, "--out", "mine"), "mine", "not a study", "--out")
    assert list(thesis.parent.iterdir()) == [thesis]
    refused(orchestrator("study", grains, "--out", str(thesis)), "thesis.txt")
    refused(orchestrator("study", grains, "--out", "/proc/study"), "/proc/study", "--out")
    refused(orchestrator("status", "mine"), "mine", "no study")
    missing = orchestrator("study", grains, "--out", "out", path="/nowhere")
    refused(missing, "liggghts", "apt-get install")


@pytest.mark.parametrize(("version", "word"), [("3.4.1", "older"), ("4.1.0", "tried")])
def test_other_versions_of_the_solver(
    orchestrator: Command, tmp_path: Path, grains: str, version: str, word: str
) -> None:
    text = f"LIGGGHTS (Version LIGGGHTS-PUBLIC {version}, compiled)"
    path = imitation(tmp_path, f'[ "$1" = -h ] && echo "{text}" && exit')
    ended = orchestrator("study", grains, "--out", "out", path=path)
    assert word in ended.stderr
    assert (ended.returncode == 0) == (version == "4.1.0"), ended.stderr


def test_an_interrupted_study_leaves_no_child_and_is_continued(
    orchestrator: Command, tmp_path: Path, grains: str
) -> None:
    slow = GRAINS.replace("load_increment = 0.05", "load_increment = 1e-4, waiting_time = 60.0")
    (tmp_path / grains).write_text(slow)
    driver = subprocess.Popen(
        [sys.executable, "-m", "orchestrator", "study", grains, "--out", "out"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent.parent)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while driver.poll() is None and not list(tmp_path.glob("out/cases/*/samples.csv")):
        time.sleep(0.05)
    children = psutil.Process(driver.pid).children(recursive=True)
    refused(orchestrator("study", grains, "--out", "out"), str(driver.pid))
    driver.send_signal(signal.SIGINT)
    _, errors = driver.communicate(timeout=300)
    assert driver.returncode == 130
    assert "the same command continues" in errors
    assert "Traceback" not in errors
    assert children
    assert not psutil.wait_procs(children, timeout=30)[1]
    assert "1 unfinished" in orchestrator("status", "out").stdout
    (tmp_path / grains).write_text(GRAINS)
    assert orchestrator("study", grains, "--out", "out").returncode == 0


def test_a_failed_case_is_named_and_the_others_are_finished(
    orchestrator: Command, tmp_path: Path, grains: str
) -> None:
    # the deck with the first friction angle gets a line that LIGGGHTS refuses
    script = (
        '[ "$1" = -h ] || ! grep -q "friction equal 0.57" parameters.liggghts'
        " || echo nonsense >>parameters.liggghts"
    )
    (tmp_path / grains).write_text(GRAINS + '"grain.friction_angle_deg" = [30.0, 35.0]\n')
    ended = orchestrator("study", grains, "--out", "out", path=imitation(tmp_path, script))
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


def test_doctor_finds_the_solvers(orchestrator: Command) -> None:
    ended = orchestrator("doctor")
    assert ended.returncode == 0, ended.stdout
    missing = orchestrator("doctor", path="/nowhere")
    assert missing.returncode == 1
    assert "apt-get install --no-install-recommends liggghts" in missing.stdout


def test_a_message_is_one_printable_line() -> None:
    error = InputError("is negative", where="a.toml: grain.diameter", remedy="raise it")
    assert str(error) == "a.toml: grain.diameter: is negative (raise it)"
    text = str(InputError("a\x1b[2J\n\x9b" + "b" * 10_000))
    assert text.isprintable()
    assert len(text) < LONGEST + 40


def test_any_exception_has_a_message() -> None:
    plain = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "file")
    assert str(of_system(plain)).startswith("file: no space is left on the disk")
    many = shutil.Error([("a", "b", f"{plain}"), ("c", "d", f"{plain}")])
    assert str(of_system(many, "case")).startswith("case: no space is left on the disk")
    assert "file: Permission denied" in str(
        of_exception(OSError(errno.EACCES, "Permission denied", "file"), "case")
    )
    assert "ulimit -v" in str(of_exception(MemoryError()))
    assert "ulimit -u" in str(of_exception(RuntimeError("can't start new thread")))
    assert "doctor" in str(of_exception(ImportError("libgmsh.so")))
    assert of_exception(KeyboardInterrupt()).exit_code == 130
    known = OrchestratorError("known")
    assert of_exception(known) is known
    assert isinstance(of_exception(ZeroDivisionError("x"), "case"), Fault)


@pytest.mark.parametrize(
    ("key", "meant"), [("densty", "density"), ("depth", "flow.depth"), ("x", "known keys")]
)
def test_an_unknown_key_gets_the_one_that_was_meant(key: str, meant: str) -> None:
    error = unknown_key(key, ["density", "viscosity"], "a.toml", [("depth", "flow.depth")])
    assert meant in error.remedy
