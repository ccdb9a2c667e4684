"""The commands as a user runs them."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.conftest import Command

GRAINS = """
protocol = { load_increment = 0.05 }
[axes]
"grain.diameter" = [7e-4, 1e-3]
"""
ODD = ["with space", """quo"te's""", "accents é"]


def _refused(ended: "subprocess.CompletedProcess[str]", *words: str) -> None:
    assert ended.returncode != 0
    assert "Traceback" not in ended.stderr
    lines = [line for line in ended.stderr.splitlines() if line.startswith("orchestrator")]
    assert len(lines) == 1, ended.stderr
    for word in words:
        assert word in lines[0]


def test_threshold_as_json(orchestrator: Command) -> None:
    arguments = "--diameter 2e-4 --density 2500 --fluid-density 1 --viscosity 1e-5 --slope 15"
    more = "--entrainment-angle 60 --roughness d/30 --json"
    ended = orchestrator("threshold", *arguments.split(), *more.split())
    assert ended.returncode == 0
    found = json.loads(ended.stdout)
    assert found["regime"] == "transition"
    for law_name in ("low", "high"):
        one = found[law_name]
        assert not one["valid"]
        # tau = rho_f u*^2 and Re* = u* d/nu tie the fields together
        assert one["reynolds"] == pytest.approx(one["friction_velocity"] * 2e-4 / 1e-5)
        stress = one["friction_velocity"] ** 2 / (2499 * 9.81 * 2e-4)
        assert one["shields"] == pytest.approx(stress)
        assert one["drag"] > 0
        assert one["lift"] > 0


@pytest.mark.parametrize("option", ["--fluid=1000", "--diam=1e-3"])
def test_no_option_is_abbreviated(orchestrator: Command, option: str) -> None:
    ended = orchestrator("threshold", "--diameter", "1e-3", option)
    assert ended.returncode == 2
    assert option in ended.stderr


@pytest.mark.parametrize("value", ["-1e1", "-10:10:3", "-.5"])
def test_a_negative_number_is_a_value(orchestrator: Command, value: str) -> None:
    _refused(orchestrator("threshold", "--diameter", "1e-3", "--slope", value), "--slope", "0")


def test_threshold_for_people_and_with_a_roughness_in_metres(orchestrator: Command) -> None:
    one = orchestrator("threshold", "--diameter", "1e-3", "--roughness", "1e-4")
    other = orchestrator("threshold", "--diameter", "1e-3", "--roughness", "d/10")
    assert one.stdout == other.stdout
    assert "paper's rule: Eq. 4 (high)" in one.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--diameter", "-1e-3"], ["--diameter", "greater than or equal"]),
        (["--diameter", "0"], ["--diameter", "greater than or equal"]),
        (["--diameter", "nan"], ["--diameter", "finite"]),
        (["--diameter", "1e-3", "--density", "1"], ["--density", "not above"]),
        (["--diameter", "1e-3", "--slope", "31"], ["--slope", "30"]),
        (["--diameter", "1e-3", "--entrainment-angle", "61"], ["--entrainment-angle", "60"]),
        (["--diameter", "1e-3", "--roughness", "rough"], ["--roughness", "d/30"]),
        (["--diameter", "1e-3", "--viscosity", "0"], ["--viscosity", "greater than or equal"]),
        (["--diameter", "1 mm"], ["--diameter", "1 mm"]),
        ([], ["--diameter"]),
    ],
)
def test_threshold_refuses_what_makes_no_sense(
    orchestrator: Command, arguments: list[str], words: list[str]
) -> None:
    _refused(orchestrator("threshold", *arguments), *words)


def test_a_study_of_single_grains_and_the_same_again(orchestrator: Command, tmp_path: Path) -> None:
    (tmp_path / "grains.toml").write_text(GRAINS)
    first = orchestrator("study", "grains.toml", "--out", "out")
    assert first.returncode == 0, first.stderr
    *said, last = first.stdout.splitlines()
    assert said[0].split() == [
        "slope",
        "d",
        "forces",
        "by",
        "τ_c",
        "interval",
        "u*₀,",
        "m/s",
        "usable",
    ]
    assert "DEM" in said[1]
    assert any(line.startswith("One grain of 0.7 mm") for line in said)
    assert re.search(r"\[1/1\] done .* of the work, about \d+ s left", first.stderr)
    assert "drawing" in first.stderr
    page = Path(last)
    assert page == tmp_path / "out" / "report.html"
    assert page.is_file()
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")}
    again = orchestrator("study", "grains.toml", "--out", "out", path="/nowhere")
    assert again.returncode == 0, again.stderr
    assert "no solver was started" in again.stderr
    after = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")}
    touched = {path.name for path in after if after[path] != before.get(path)}
    assert touched <= {"study.json", ".lock"}


def test_a_plan_says_what_would_run_and_runs_nothing(orchestrator: Command, tmp_path: Path) -> None:
    (tmp_path / "grains.toml").write_text(GRAINS)
    ended = orchestrator("study", "grains.toml", "--out", "out", "--plan", path="/nowhere")
    assert ended.returncode == 0, ended.stderr
    assert "2 scenes" in ended.stdout
    assert "1 case, 1 to run" in ended.stdout
    assert "cells: 1, 1 to run" in ended.stdout
    assert "expected: about" in ended.stdout
    assert not (tmp_path / "out").exists()
    (tmp_path / "steep.toml").write_text("grain.diameter = 1e-3\nbed.slope_deg = 50.0")
    _refused(orchestrator("study", "steep.toml", "--plan"), "steep.toml", "slope_deg")


def test_the_same_study_elsewhere_gives_the_same_tables(
    orchestrator: Command, tmp_path: Path
) -> None:
    (tmp_path / "grains.toml").write_text(GRAINS)
    for name in ("one", "another place"):
        assert orchestrator("study", "grains.toml", "--out", name).returncode == 0
    one, other = (tmp_path / name / "tables" for name in ("one", "another place"))
    assert {path.name for path in one.iterdir()} == {path.name for path in other.iterdir()}
    for path in one.iterdir():
        assert path.read_bytes() == (other / path.name).read_bytes()


@pytest.mark.parametrize("name", ODD)
def test_odd_names_work(orchestrator: Command, tmp_path: Path, name: str) -> None:
    (tmp_path / f"{name}.toml").write_text(GRAINS)
    ended = orchestrator("study", f"{name}.toml", "--out", name)
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / name / "report.html").is_file()
    status = orchestrator("status", name)
    assert status.returncode == 0, status.stderr
    assert "1 done" in status.stdout


def test_a_study_that_is_not_there(orchestrator: Command) -> None:
    _refused(orchestrator("study", "no-such-study"), "no-such-study", "first-look")


def test_an_output_directory_that_holds_something_else(
    orchestrator: Command, tmp_path: Path
) -> None:
    (tmp_path / "grains.toml").write_text(GRAINS)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("do not touch")
    _refused(orchestrator("study", "grains.toml", "--out", "mine"), "mine", "not a study", "--out")
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.txt"]
    _refused(orchestrator("study", "grains.toml", "--out", "mine/thesis.txt"), "thesis.txt")
    _refused(orchestrator("status", "mine"), "mine", "no study")


def test_an_output_directory_that_cannot_be_made(orchestrator: Command, tmp_path: Path) -> None:
    (tmp_path / "grains.toml").write_text(GRAINS)
    _refused(orchestrator("study", "grains.toml", "--out", "/proc/study"), "/proc/study", "--out")


def test_a_missing_solver(orchestrator: Command, tmp_path: Path) -> None:
    (tmp_path / "grains.toml").write_text(GRAINS)
    ended = orchestrator("study", "grains.toml", "--out", "out", path="/nowhere")
    _refused(ended, "liggghts", "apt-get install")


@pytest.mark.parametrize(("version", "word"), [("3.4.1", "older"), ("4.1.0", "tried")])
def test_other_versions_of_the_solver(
    orchestrator: Command, tmp_path: Path, version: str, word: str
) -> None:
    # a program that says another version, and otherwise is the real one
    folder = tmp_path / "bin"
    folder.mkdir()
    program = folder / "liggghts"
    said = f"LIGGGHTS (Version LIGGGHTS-PUBLIC {version}, compiled)"
    program.write_text(
        f'#!/bin/sh\n[ "$1" = -h ] && echo "{said}" && exit\nexec {shutil.which("liggghts")} "$@"\n'
    )
    program.chmod(0o755)
    (tmp_path / "grains.toml").write_text(GRAINS)
    path = f"{folder}:{os.environ['PATH']}"
    ended = orchestrator("study", "grains.toml", "--out", "out", path=path)
    assert word in ended.stderr
    assert (ended.returncode == 0) == (version == "4.1.0"), ended.stderr


def test_an_interrupted_study_leaves_no_child_and_is_continued(
    orchestrator: Command, tmp_path: Path
) -> None:
    slow = GRAINS.replace("load_increment = 0.05", "load_increment = 1e-4, waiting_time = 60.0")
    (tmp_path / "grains.toml").write_text(slow)
    root = Path(__file__).parent.parent
    driver = subprocess.Popen(
        [sys.executable, "-m", "orchestrator", "study", "grains.toml", "--out", "out"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(root)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for _ in range(400):
        if list(tmp_path.glob("out/cases/*/samples.csv")):
            break
        time.sleep(0.05)
    second = orchestrator("study", "grains.toml", "--out", "out")
    _refused(second, str(driver.pid))
    driver.send_signal(signal.SIGINT)
    _, said = driver.communicate(timeout=300)
    assert driver.returncode == 130
    assert "the same command continues" in said
    assert "Traceback" not in said
    assert not _running_in(tmp_path)
    assert "1 unfinished" in orchestrator("status", "out").stdout
    (tmp_path / "grains.toml").write_text(GRAINS)
    assert orchestrator("study", "grains.toml", "--out", "out").returncode == 0


def _running_in(folder: Path) -> list[str]:
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and Path(os.readlink(entry / "cwd")).is_relative_to(folder):
                found.append((entry / "cmdline").read_text())
        except OSError:
            continue
    return found


def test_a_failed_case_is_told_and_the_others_are_finished(
    orchestrator: Command, tmp_path: Path
) -> None:
    folder = tmp_path / "bin"
    folder.mkdir()
    program = folder / "liggghts"
    real = shutil.which("liggghts")
    # the deck with the first friction angle gets a line that LIGGGHTS refuses
    program.write_text(
        "#!/bin/sh\n"
        '[ "$1" = -h ] || ! grep -q "friction equal 0.57" parameters.liggghts'
        " || echo nonsense >>parameters.liggghts\n"
        f'exec {real} "$@"\n'
    )
    program.chmod(0o755)
    (tmp_path / "grains.toml").write_text(GRAINS + '"grain.friction_angle_deg" = [30.0, 35.0]\n')
    path = f"{folder}:{os.environ['PATH']}"
    ended = orchestrator("study", "grains.toml", "--out", "out", path=path)
    assert ended.returncode == 3
    assert "Traceback" not in ended.stderr
    assert "ERROR" in ended.stderr
    status = orchestrator("status", "out")
    assert status.returncode == 3
    assert "1 done" in status.stdout
    assert "1 failed" in status.stdout
    redrawn = orchestrator("report", "out")
    assert redrawn.returncode == 3
    assert "ERROR" in (tmp_path / "out" / "report.html").read_text()
    again = orchestrator("study", "grains.toml", "--out", "out")
    assert again.returncode == 0, again.stderr


def test_doctor_finds_the_solvers(orchestrator: Command) -> None:
    ended = orchestrator("doctor")
    assert ended.returncode == 0, ended.stdout
    assert "LIGGGHTS" in ended.stdout
    missing = orchestrator("doctor", path="/nowhere")
    assert missing.returncode == 1
    assert "apt-get install --no-install-recommends liggghts" in missing.stdout
