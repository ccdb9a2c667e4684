"""Files of a study that are harmed, and files of others in its directory."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator import plan
from orchestrator.errors import SolverError
from orchestrator.runs import case
from orchestrator.runs.files import RECORD, digest_file
from orchestrator.study import study
from tests.faults.bench import Bench, tables

# the mesh of the small study is so coarse that it is warned of
pytestmark = pytest.mark.filterwarnings("ignore:method.flow.cells_per_face")


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
    *(
        "flow-*/case.json",
        "flow-*/done.json",
        "flow-*/[1-9]*/U",
        "flow-*/wall_stress.csv",
    ),
    *("pile-*/done.json", "pile-*/motion.csv"),
)


def _heals(bench: Bench) -> None:
    assert bench.command("status")[0] in (0, 2, 3)
    code, printed = bench.command("study")
    assert code == 0, printed
    assert tables(bench.out) == tables(bench.undisturbed)
    assert "no solver was started" in bench.command("study")[1]


@pytest.mark.parametrize("how", HARMS)
def test_harmed_files_are_noticed_and_healed(finished: Bench, how: str) -> None:
    (directory,) = finished.cases("cells")
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
    _heals(finished)


@pytest.mark.parametrize("how", ["truncated to 30%", "garbage"])
def test_harmed_files_of_a_flow_and_a_pile(pile: Bench, how: str) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    paths = [path for name in OF_A_PILE for path in pile.out.glob(f"cases/{name}")]
    assert len(paths) == len(OF_A_PILE)
    for path in paths:
        HARMS[how](path)
    _heals(pile)


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """A directory that nobody may touch."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "thesis.txt").write_text("three years of work")
    return tmp_path / "outside"


def _contents(folder: Path) -> dict[str, str]:
    """Every file and link below a directory, with its content."""
    contents = {}
    for path in folder.rglob("*"):
        if path.is_symlink():
            contents[str(path.relative_to(folder))] = f"-> {os.readlink(path)}"
        elif path.is_file():
            contents[str(path.relative_to(folder))] = digest_file(path)
    return contents


ODD = (
    "two\nlines",
    os.fsdecode(b"\xff\xfe"),
    "-rf",
    "*",
    "x" * 255,
    ".x.1.tmp",
    "a.csv",
)
"""Names of files of a user, whatever they look like."""


def test_files_of_others_in_every_directory(pile: Bench, outside: Path) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    ours, elsewhere = _contents(pile.out).keys(), _contents(outside)
    for folder in [pile.out, *(path for path in pile.out.rglob("*") if path.is_dir())]:
        for name in ODD:
            (folder / name).write_text("mine")
        (folder / "mine" / "deep").mkdir(parents=True)
        (folder / "mine" / "deep" / "notes.txt").write_text("mine")
        (folder / "link").symlink_to(outside)
        (folder / "link.csv").symlink_to(outside / "thesis.txt")
    planted = {
        name: text for name, text in _contents(pile.out).items() if name not in ours
    }
    for word in ("status", "study", "report", "prune"):
        assert pile.command(word)[0] == 0, word
        assert planted.items() <= _contents(pile.out).items(), word
    markers = [*pile.out.glob("cases/*/done.json")]
    assert markers
    for path in markers:
        path.unlink()
    assert pile.command("study")[0] == 0
    after = _contents(pile.out)
    of_cases = tuple(f"cases/{path.parent.name}/" for path in markers)
    for name, text in planted.items():
        # in a case that is run again nothing is left that a solver could read
        expected = None if name.startswith(of_cases) else text
        assert after.get(name) == expected, name
    assert _contents(outside) == elsewhere


@pytest.mark.parametrize(
    "place",
    [
        "tables",
        "cases",
        "tables/scenes.csv",
        "report.html",
        "study.json",
        ".lock",
        RECORD,
    ],
)
def test_links_are_refused(finished: Bench, outside: Path, place: str) -> None:
    path, target = finished.out / place, outside / "moved"
    if path.exists():
        shutil.move(path, target)
    path.symlink_to(target)
    before, inside = _contents(outside), _contents(finished.out)
    for word in ("study", "report", "prune"):
        code, printed = finished.command(word)
        assert code == 2, printed
        assert f"{path}: it is a link" in printed
        assert (_contents(outside), _contents(finished.out)) == (before, inside)


def test_links_in_a_case_are_not_followed(pile: Bench, outside: Path) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    (flow,) = pile.cases("flow")
    mesh = flow / "constant" / "polyMesh"
    shutil.move(mesh, outside / "mesh")
    mesh.symlink_to(outside / "mesh")
    before = _contents(outside)
    case.prune_case(
        plan.make(study.load(str(pile.source))).cases[flow.name], pile.out / "cases"
    )
    assert _contents(outside) == before
    (flow / case.DONE).unlink()
    assert pile.command("study")[0] == 0
    assert _contents(outside) == before
    assert not mesh.is_symlink()
    assert tables(pile.out) == tables(pile.undisturbed)


def test_cases_of_an_earlier_file_are_named_and_kept(finished: Bench) -> None:
    (old,) = finished.cases("cells")
    before, text = _contents(old), finished.source.read_text()
    finished.source.write_text(text.replace("[7e-4, 1e-3]", "[1e-3]"))
    code, printed = finished.command("study")
    assert code == 0, printed
    assert "the study file has changed: 1 case is not asked for any more" in printed
    for word in ("status", "prune"):
        code, printed = finished.command(word)
        assert code == 0, printed
        assert "not asked for: 1 cases of an earlier study file" in printed
        assert old.name in printed
        assert _contents(old) == before
    finished.source.write_text(text)
    assert "no solver was started" in finished.command("study")[1]
    assert tables(finished.out) == tables(finished.undisturbed)
