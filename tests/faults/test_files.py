"""Files of a study that are harmed, and files of others in its directory: nothing is lost."""

import hashlib
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator import cli, plan
from orchestrator.errors import SolverError
from orchestrator.runs import case
from orchestrator.runs.files import KEPT, RECORD
from orchestrator.study import study
from tests.faults.bench import Bench, case_of, same_tables

# a file that is not as it was written may be someone's: it is kept, and a warning names it
pytestmark = pytest.mark.filterwarnings("always:.*is not what this program wrote")
Command = Callable[..., tuple[int, str]]


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Command:
    """Run a command on a bench; its exit code and what it printed."""

    def run(word: str, bench: Bench) -> tuple[int, str]:
        source = [str(bench.source), "--out"] if word == "study" else []
        code = cli.main([word, *source, str(bench.out)])
        captured = capsys.readouterr()
        return code, captured.out + captured.err

    return run


def _truncated(share: float) -> Callable[[Path], None]:
    return lambda path: os.truncate(path, int(path.stat().st_size * share))


def _garbage(path: Path) -> None:
    path.write_bytes(b"\x00\xff{]" * 50)


def _directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


HARMS: dict[str, Callable[[Path], None]] = {
    **{f"truncated to {share:.0%}": _truncated(share) for share in (0.0, 0.3, 0.99)},
    "garbage": _garbage,
    "a directory": _directory,
    "removed": Path.unlink,
}
OF_A_STUDY = (
    *("study.json", "report.json", "report.html", RECORD, "figures/shields.svg"),
    *("timings/timings.csv", "tables/scenes.csv", "tables/columns.csv"),
)
OF_CELLS = (
    *(case.IDENTITY, case.DONE, "samples.csv", "passage.dump", "bed.dump"),
    *("load_steps.csv", "motion.csv"),
)
OF_A_PILE = (
    *("flow-*/case.json", "flow-*/done.json", "flow-*/[1-9]*/U", "flow-*/wall_stress.csv"),
    *("pile-*/done.json", "pile-*/motion.csv"),
)


def _heals(bench: Bench, command: Command) -> None:
    assert command("status", bench)[0] in (0, 2, 3)
    code, printed = command("study", bench)
    assert code == 0, printed
    assert same_tables(bench.out, bench.undisturbed)
    assert "no solver was started" in command("study", bench)[1]


@pytest.mark.parametrize("how", HARMS)
def test_harmed_files_are_noticed_and_healed(finished: Bench, how: str, command: Command) -> None:
    (directory,) = case_of(finished.out, "cells")
    (run,) = plan.make(study.load(str(finished.source))).cells
    (finished.out / ".lock").write_text("process 1 on elsewhere\n")
    for path in (directory / name for name in OF_CELLS):
        whole = path.read_bytes()
        HARMS[how](path)
        # a large file that no table needs may be missing, as after `prune`
        is_pruned = how == "removed" and path.suffix == ".dump"
        assert bool(case.done_state(run, directory.parent)) == is_pruned, path.name
        if path.is_dir():
            path.rmdir()
        path.write_bytes(whole)
        assert case.done_state(run, directory.parent)
    case.fail(directory, SolverError("for this test"))
    for path in (
        *(finished.out / name for name in OF_A_STUDY),
        *(directory / name for name in (*OF_CELLS, case.FAILED)),
    ):
        HARMS[how](path)
    _heals(finished, command)


@pytest.mark.parametrize("how", ["truncated to 30%", "garbage"])
def test_harmed_files_of_a_flow_and_a_pile(pile: Bench, how: str, command: Command) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    paths = [path for name in OF_A_PILE for path in pile.out.glob(f"cases/{name}")]
    assert len(paths) == len(OF_A_PILE)
    for path in paths:
        HARMS[how](path)
    _heals(pile, command)


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """A directory that nobody may touch."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "thesis.txt").write_text("three years of work")
    return tmp_path / "outside"


def _contents(folder: Path) -> dict[str, str]:
    """Every file and link below a directory, with its content."""
    found = {}
    for path in folder.rglob("*"):
        if path.is_symlink():
            found[str(path.relative_to(folder))] = f"-> {os.readlink(path)}"
        elif path.is_file():
            found[str(path.relative_to(folder))] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


ODD = ("two\nlines", os.fsdecode(b"\xff\xfe"), "-rf", "*", "x" * 255, ".x.1.tmp", "a.csv")
"""Names of files of a user, whatever they look like."""


def test_files_of_others_in_every_directory(pile: Bench, outside: Path, command: Command) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    ours, elsewhere = _contents(pile.out).keys(), _contents(outside)
    for folder in [pile.out, *(path for path in pile.out.rglob("*") if path.is_dir())]:
        for name in ODD:
            (folder / name).write_text("mine")
        (folder / "mine" / "deep").mkdir(parents=True)
        (folder / "mine" / "deep" / "notes.txt").write_text("mine")
        (folder / "link").symlink_to(outside)
        (folder / "link.csv").symlink_to(outside / "thesis.txt")
    planted = {name: text for name, text in _contents(pile.out).items() if name not in ours}
    for word in ("status", "study", "report", "prune"):
        assert command(word, pile)[0] == 0, word
        assert planted.items() <= _contents(pile.out).items(), word
        assert not (pile.out / KEPT).exists()
    for path in pile.out.glob("cases/*/done.json"):
        path.unlink()
    assert command("study", pile)[0] == 0
    found = _contents(pile.out)
    for name, text in planted.items():
        assert text in (found.get(name), found.get(f"{KEPT}/{name}")), name
    # in a case that is run again nothing is left that a solver could read
    assert not any(path.name in ODD for path in pile.out.glob("cases/*/**/*"))
    assert not list(pile.out.glob(f"{KEPT}/cases/*/log.*"))
    assert _contents(outside) == elsewhere


@pytest.mark.parametrize(
    "place", ["tables", "cases", "tables/scenes.csv", "report.html", "study.json", ".lock", RECORD]
)
def test_links_are_refused(finished: Bench, outside: Path, command: Command, place: str) -> None:
    path, target = finished.out / place, outside / "moved"
    if path.exists():
        shutil.move(path, target)
    path.symlink_to(target)
    before, inside = _contents(outside), _contents(finished.out)
    for word in ("study", "report", "prune"):
        code, printed = command(word, finished)
        assert code == 2, printed
        assert f"{path}: it is a link" in printed
        assert (_contents(outside), _contents(finished.out)) == (before, inside)


def test_links_in_a_case_are_not_followed(pile: Bench, outside: Path, command: Command) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    (flow,) = case_of(pile.out, "flow")
    mesh = flow / "constant" / "polyMesh"
    shutil.move(mesh, outside / "mesh")
    mesh.symlink_to(outside / "mesh")
    before = _contents(outside)
    case.prune(plan.make(study.load(str(pile.source))).cases[flow.name], pile.out / "cases")
    assert _contents(outside) == before
    (flow / case.DONE).unlink()
    assert command("study", pile)[0] == 0
    assert _contents(outside) == before
    assert (pile.out / KEPT / mesh.relative_to(pile.out)).is_symlink()
    assert same_tables(pile.out, pile.undisturbed)


def test_cases_of_an_earlier_file_are_named_and_kept(finished: Bench, command: Command) -> None:
    (old,) = case_of(finished.out, "cells")
    before, text = _contents(old), finished.source.read_text()
    finished.source.write_text(text.replace("[7e-4, 1e-3]", "[1e-3]"))
    code, printed = command("study", finished)
    assert code == 0, printed
    assert "the study file has changed: 1 cases are not asked for any more" in printed
    for word in ("status", "prune"):
        code, printed = command(word, finished)
        assert code == 0, printed
        assert "not asked for: 1 cases of an earlier study file" in printed
        assert old.name in printed
        assert _contents(old) == before
    finished.source.write_text(text)
    assert "no solver was started" in command("study", finished)[1]
    assert same_tables(finished.out, finished.undisturbed)
