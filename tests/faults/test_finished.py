"""Finished studies: their tables are not lost, and no marker vouches for the results of another."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from orchestrator import cli, plan
from orchestrator.runs import case
from orchestrator.study import study
from tests.faults.bench import HEAD, PILE, Bench, case_of, same_tables


@pytest.fixture
def finished(cells: Bench) -> Bench:
    shutil.copytree(cells.undisturbed, cells.out)
    return cells


def _lose_cases(out: Path) -> None:
    shutil.rmtree(out / "cases")


def _of_another_version(out: Path) -> None:
    for path in (out / "cases").iterdir():
        path.rename(path.with_name(f"{path.name[:-12]}{'0' * 12}"))
    about = json.loads((out / "study.json").read_text())
    del about["kind"]
    (out / "study.json").write_text(json.dumps(about))


@pytest.mark.parametrize("lose", [_lose_cases, _of_another_version])
def test_tables_whose_cases_are_not_here_are_kept(
    finished: Bench, lose: Callable[[Path], None], capsys: pytest.CaptureFixture[str]
) -> None:
    lose(finished.out)
    before = {path: path.read_bytes() for path in finished.out.rglob("*") if path.is_file()}
    assert cli.main(["report", str(finished.out)]) == 1
    assert "the tables stay as they are" in capsys.readouterr().err
    after = {path: path.read_bytes() for path in finished.out.rglob("*") if path.is_file()}
    assert {**after, finished.out / ".lock": b""} == {**before, finished.out / ".lock": b""}


@pytest.fixture
def full_disk(finished: Bench) -> Iterator[Path]:
    """A file system without any room that holds the finished study."""
    disk = finished.folder / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=20M", "tmpfs", str(disk)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("a file system can be mounted by root alone")
    shutil.copytree(finished.out, disk / "out")
    subprocess.run(
        ["sh", "-c", "head -c 30000000 /dev/zero >filler"], cwd=disk, stderr=subprocess.DEVNULL
    )
    yield disk / "out"
    subprocess.run(["umount", str(disk)], check=True)


def test_prune_makes_room_on_a_full_disk(
    full_disk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert list(full_disk.glob("cases/*/*.dump"))
    assert cli.main(["prune", str(full_disk)]) == 0, capsys.readouterr().err
    assert not list(full_disk.glob("cases/*/*.dump"))
    assert all((path / case.DONE).is_file() for path in full_disk.glob("cases/*"))


def test_a_marker_vouches_for_its_own_case_alone(
    finished: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    (here,) = case_of(finished.out, "cells")
    source = finished.folder / "small.toml"
    other_file = finished.folder / "other.toml"
    other_file.write_text(source.read_text().replace("[7e-4, 1e-3]", "[8e-4, 9e-4, 1e-3]"))
    assert cli.main(["study", str(other_file), "--out", str(finished.folder / "other")]) == 0
    (there,) = case_of(finished.folder / "other", "cells")
    identity = (here / case.IDENTITY).read_bytes()
    shutil.rmtree(here)
    shutil.copytree(there, here)
    (here / case.IDENTITY).write_bytes(identity)
    (run,) = plan.make(study.load(str(source))).cells
    assert not case.is_done(run, finished.out / "cases")
    assert cli.main(["study", str(source), "--out", str(finished.out)]) == 0
    assert same_tables(finished.out, finished.undisturbed)
    capsys.readouterr()


def test_two_files_of_one_name_do_not_share_a_directory(
    finished: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    source = finished.folder / "small.toml"
    (finished.folder / "b").mkdir()
    other = finished.folder / "b" / "small.toml"
    other.write_text(source.read_text().replace("7e-4", "8e-4"))
    assert cli.main(["study", str(source), "--out", str(finished.out)]) == 0
    assert cli.main(["study", str(other), "--out", str(finished.out)]) == 2
    assert "the study of another file, ../small.toml" in capsys.readouterr().err
    assert same_tables(finished.out, finished.undisturbed)
    # a file that has moved, and then changed, is the same study
    source.unlink()
    assert cli.main(["study", str(other), "--out", str(finished.out)]) == 0


def _command(folder: Path, *words: str, **variables: str) -> "subprocess.CompletedProcess[str]":
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), **variables}
    return subprocess.run(
        words, cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )


ORCHESTRATOR = (sys.executable, "-m", "orchestrator")


def test_warnings_that_are_errors_end_no_command(tmp_path: Path) -> None:
    text = (HEAD + PILE).replace("waiting_time = 3.0", "waiting_time = 2.0")
    (tmp_path / "small.toml").write_text(text)
    words = (*ORCHESTRATOR, "study", "small.toml", "--plan")
    ended = _command(tmp_path, *words, PYTHONWARNINGS="error")
    assert ended.returncode == 0, ended.stderr
    assert "orchestrator: warning: " in ended.stderr


def test_a_shortage_of_threads_is_one_line(tmp_path: Path) -> None:
    script = (
        "import sys, threading; from orchestrator import cli, pipeline\n"
        'def start(thread): raise RuntimeError("can\'t start new thread")\n'
        "threading.Thread.start = start\n"
        "sys.exit(cli.main(['study', '--out', 'out']))"
    )
    ended = _command(tmp_path, sys.executable, "-c", script)
    assert ended.returncode == 1
    assert ended.stderr.count("\n") == 1
    assert "no more threads can be started" in ended.stderr


@pytest.mark.parametrize("value", ["abc", "", "9" * 40])
def test_the_date_of_a_build_stays_and_harms_no_command(tmp_path: Path, value: str) -> None:
    script = "import orchestrator, os; print(os.environ['SOURCE_DATE_EPOCH'])"
    ended = _command(tmp_path, sys.executable, "-c", script, SOURCE_DATE_EPOCH=value)
    assert ended.stdout == f"{value}\n"
    ended = _command(tmp_path, *ORCHESTRATOR, "study", "--plan", SOURCE_DATE_EPOCH=value)
    assert ended.returncode == 0, ended.stderr
