"""Finished studies: their tables are not lost, and no marker vouches for the results of another."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator import cli, plan
from orchestrator.runs import case
from orchestrator.study import study
from tests.conftest import Mount
from tests.faults.bench import HEAD, ORCHESTRATOR, PILE, ROOT, Bench, case_of, same_tables

Capsys = pytest.CaptureFixture[str]


def _lose_cases(out: Path) -> None:
    shutil.rmtree(out / "cases")


def _of_another_version(out: Path) -> None:
    for path in (out / "cases").iterdir():
        path.rename(path.with_name(f"{path.name[:-12]}{'0' * 12}"))
    about = json.loads((out / "study.json").read_text())
    del about["kind"]
    (out / "study.json").write_text(json.dumps(about))


@pytest.mark.parametrize("lose", [_lose_cases, _of_another_version])
def test_tables_without_cases(
    finished: Bench, lose: Callable[[Path], None], capsys: Capsys
) -> None:
    lose(finished.out)
    before = {path: path.read_bytes() for path in finished.out.rglob("*") if path.is_file()}
    assert cli.main(["report", str(finished.out)]) == 1
    assert "the tables stay as they are" in capsys.readouterr().err
    after = {path: path.read_bytes() for path in finished.out.rglob("*") if path.is_file()}
    assert {**after, finished.out / ".lock": b""} == {**before, finished.out / ".lock": b""}


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def test_a_pruned_study_stays_finished(pile: Bench, capsys: Capsys) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    (cells,) = case_of(pile.out, "cells")
    assert cli.main(["status", str(pile.out)]) == 0
    size = float(capsys.readouterr().out.partition("size: ")[2].split()[0])
    assert size == pytest.approx(_size(pile.out) / 1e6, abs=0.06)
    assert cli.main(["prune", str(pile.out)]) == 0
    printed = capsys.readouterr().out
    assert "pruned: 1 cases" in printed
    # the page shows the pile and its flow
    assert all(next(case_of(pile.out, kind)).name in printed for kind in ("pile", "flow"))
    assert not list(cells.glob("*.dump"))
    assert cli.main(["study", str(pile.source), "--out", str(pile.out)]) == 0
    assert "no solver was started" in capsys.readouterr().err
    assert cli.main(["report", str(pile.out)]) == 0
    assert same_tables(pile.out, pile.undisturbed)
    names = [
        {path.name for path in (out / "figures").iterdir()} for out in (pile.out, pile.undisturbed)
    ]
    assert names[0] == names[1]


def test_every_case_can_be_pruned_and_run_again_by_hand(pile: Bench) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    cases = pile.out / "cases"
    for run in plan.make(study.load(str(pile.source))).cases.values():
        case.prune(run, cases)
        assert case.done_state(run, cases)
        assert not case.is_whole(run, cases)
        subprocess.run(["./Allrun"], cwd=cases / run.name, check=True)
        assert case.is_whole(run, cases)
        assert case.done_state(run, cases)
        (cases / run.name / case.DONE).unlink()
        case.prune(run, cases)  # it is not done: nothing is dropped
        assert list((cases / run.name).glob("*.dump")) or run.kind == "flow"


def test_prune_makes_room_on_a_full_disk(finished: Bench, disk: Mount) -> None:
    out = disk("size=20M") / "out"
    shutil.copytree(finished.out, out)
    fill = "head -c 30000000 /dev/zero >filler 2>/dev/null"
    subprocess.run(["sh", "-c", fill], cwd=out.parent)
    assert list(out.glob("cases/*/*.dump"))
    assert cli.main(["prune", str(out)]) == 0
    assert not list(out.glob("cases/*/*.dump"))
    assert all((path / case.DONE).is_file() for path in out.glob("cases/*"))


def test_a_marker_vouches_for_its_own_case_alone(finished: Bench) -> None:
    (here,) = case_of(finished.out, "cells")
    other, out = finished.folder / "other.toml", finished.folder / "other"
    other.write_text(finished.source.read_text().replace("[7e-4, 1e-3]", "[8e-4, 9e-4, 1e-3]"))
    assert cli.main(["study", str(other), "--out", str(out)]) == 0
    (there,) = case_of(out, "cells")
    identity = (here / case.IDENTITY).read_bytes()
    shutil.rmtree(here)
    shutil.copytree(there, here)
    (here / case.IDENTITY).write_bytes(identity)
    (run,) = plan.make(study.load(str(finished.source))).cells
    assert not case.done_state(run, finished.out / "cases")
    finished.check_finished()


def test_two_files_of_one_name(finished: Bench, capsys: Capsys) -> None:
    other = finished.folder / "b" / "small.toml"
    other.parent.mkdir()
    other.write_text(finished.source.read_text().replace("7e-4", "8e-4"))
    for source, code in ((finished.source, 0), (other, 2)):
        assert cli.main(["study", str(source), "--out", str(finished.out)]) == code
    assert "the study of another file, ../small.toml" in capsys.readouterr().err
    assert same_tables(finished.out, finished.undisturbed)
    # a file that has moved, and then changed, is the same study
    finished.source.unlink()
    assert cli.main(["study", str(other), "--out", str(finished.out)]) == 0


def _command(folder: Path, *words: str, **variables: str) -> "subprocess.CompletedProcess[str]":
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
    return subprocess.run(
        words, cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )


def test_a_finished_study_is_answered_without_any_library(finished: Bench) -> None:
    for name in ("numpy", "pandas", "pydantic"):
        (finished.folder / f"{name}.py").write_text("raise ImportError('for this test')\n")
    words, path = (
        (*ORCHESTRATOR, "study", "small.toml", "--out", "out"),
        f"{finished.folder}:{ROOT}",
    )
    ended = _command(finished.folder, *words, PYTHONPATH=path)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.endswith(f"{finished.out}/report.html\n")
    assert "One grain of" in ended.stdout
    for change in (["--tolerance", "0.1"], []):
        if not change:
            finished.source.write_text(f"title = 'another'\n{finished.source.read_text()}")
        assert _command(finished.folder, *words, *change, PYTHONPATH=path).returncode == 1


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
