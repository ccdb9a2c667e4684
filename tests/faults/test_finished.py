"""Finished studies: their tables are not lost, and no marker vouches for the results of another."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator import plan
from orchestrator.runs import case
from orchestrator.study import study
from tests.conftest import Command, Mount
from tests.faults.bench import HEAD, PILE, Bench, tables, undisturbed


def _lose_cases(out: Path) -> None:
    shutil.rmtree(out / "cases")


def _of_another_version(out: Path) -> None:
    for path in (out / "cases").iterdir():
        path.rename(path.with_name(f"{path.name[:-12]}{'0' * 12}"))
    about = json.loads((out / "study.json").read_text())
    del about["kind"]
    (out / "study.json").write_text(json.dumps(about))


@pytest.mark.parametrize("lose", [_lose_cases, _of_another_version])
def test_tables_without_cases(finished: Bench, lose: Callable[[Path], None]) -> None:
    lose(finished.out)
    before = {path: path.read_bytes() for path in finished.out.rglob("*") if path.is_file()}
    code, printed = finished.command("report")
    assert (code, "the tables stay as they are" in printed) == (1, True)
    after = {path: path.read_bytes() for path in finished.out.rglob("*") if path.is_file()}
    assert {**after, finished.out / ".lock": b""} == {**before, finished.out / ".lock": b""}


def test_a_pruned_study_stays_finished(pile: Bench) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    (cells,), (bed,), (flow,) = (pile.cases(kind) for kind in ("cells", "pile", "flow"))
    whole = sum(path.stat().st_size for path in pile.out.rglob("*") if path.is_file())
    size = float(pile.command("status")[1].partition("size: ")[2].split()[0])
    assert size == pytest.approx(whole / 1e6, abs=0.06)
    code, printed = pile.command("prune")
    assert (code, "pruned: 1 cases" in printed) == (0, True)
    assert {bed.name, flow.name} <= {*re.split(r"[ ,\n]", printed)}  # the page shows them
    assert not list(cells.glob("*.dump"))
    assert "no solver was started" in pile.command("study")[1]
    assert pile.command("report")[0] == 0
    assert tables(pile.out) == tables(pile.undisturbed)
    figures = (
        {path.name for path in (out / "figures").iterdir()} for out in (pile.out, pile.undisturbed)
    )
    assert len({*map(frozenset, figures)}) == 1


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
    finished.out = Path(shutil.copytree(finished.out, disk("size=20M") / "out"))
    fill = "head -c 30000000 /dev/zero >filler 2>/dev/null"
    subprocess.run(["sh", "-c", fill], cwd=finished.out.parent)
    assert list(finished.out.glob("cases/*/*.dump"))
    assert finished.command("prune")[0] == 0
    assert not list(finished.out.glob("cases/*/*.dump"))
    assert all((path / case.DONE).is_file() for path in finished.out.glob("cases/*"))


def test_a_marker_vouches_for_its_own_case_alone(finished: Bench) -> None:
    (here,) = finished.cases("cells")
    text = finished.source.read_text().replace("[7e-4, 1e-3]", "[8e-4, 9e-4, 1e-3]")
    (there,) = undisturbed(finished.folder / "other", text).glob("cases/cells-*")
    identity = (here / case.IDENTITY).read_bytes()
    shutil.rmtree(here)
    shutil.copytree(there, here)
    (here / case.IDENTITY).write_bytes(identity)
    (run,) = plan.make(study.load(str(finished.source))).cells
    assert not case.done_state(run, finished.out / "cases")
    finished.check_finished()


def test_two_files_of_one_name(finished: Bench) -> None:
    other = finished.folder / "b" / "small.toml"
    other.parent.mkdir()
    other.write_text(finished.source.read_text().replace("7e-4", "8e-4"))
    assert finished.command("study")[0] == 0
    code, printed = finished.command("study", other)
    assert (code, "the study of another file, ../small.toml" in printed) == (2, True)
    assert tables(finished.out) == tables(finished.undisturbed)
    # a file that has moved, and then changed, is the same study
    finished.source.unlink()
    assert finished.command("study", other)[0] == 0


def test_a_finished_study_is_answered_without_any_library(
    finished: Bench, orchestrator: Command
) -> None:
    for name in ("numpy", "pandas", "pydantic"):
        text = "raise ImportError('for this test')\n"
        (finished.folder / f"{name}.py").write_text(text)  # python -m looks here first
    ended = orchestrator("study", "small.toml", "--out", "out")
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.endswith(f"{finished.out}/report.html\n")
    assert "One grain of" in ended.stdout
    changed = orchestrator("study", "small.toml", "--out", "out", "--tolerance", "0.1")
    assert changed.returncode == 1
    finished.source.write_text(f"title = 'another'\n{finished.source.read_text()}")
    assert orchestrator("study", "small.toml", "--out", "out").returncode == 1


def test_warnings_that_are_errors_end_no_command(
    tmp_path: Path, orchestrator: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONWARNINGS", "error")
    text = (HEAD + PILE).replace("waiting_time = 3.0", "waiting_time = 2.0")
    (tmp_path / "small.toml").write_text(text)
    ended = orchestrator("study", "small.toml", "--plan")
    assert ended.returncode == 0, ended.stderr
    assert "orchestrator: warning: " in ended.stderr
