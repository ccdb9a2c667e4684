"""Files of others in a study's directory, and links out of it: nothing of theirs is lost."""

import contextlib
import hashlib
import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator import cli, plan
from orchestrator.runs import case
from orchestrator.runs.files import KEPT, RECORD
from orchestrator.study import study
from tests.faults.bench import Bench, case_of, ended, none_left_in, same_tables, wait_for
from tests.faults.ledger import Ledger

pytestmark = pytest.mark.filterwarnings("always:.*is not what this program wrote")
ODD = ("two\nlines", os.fsdecode(b"\xff\xfe"), "-rf", "*", "x" * 255, ".x.1.tmp", "a.csv")
"""Names of files that are none of ours, whatever they look like."""


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str]]:
    """Run a command; its exit code and what it said, which is no traceback."""

    def run(command: str, bench: Bench, *more: str) -> tuple[int, str]:
        out = [str(bench.out)]
        source = [str(bench.folder / "small.toml"), "--out"] if command == "study" else []
        code = cli.main([command, *source, *out, *more])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return code, captured.out + captured.err

    return run


Said = Callable[..., tuple[int, str]]


def _copied(bench: Bench) -> Path:
    """Give a bench its undisturbed study, and the directory outside that nobody may touch."""
    shutil.copytree(bench.undisturbed, bench.out)
    outside = bench.folder / "outside"
    outside.mkdir()
    (outside / "thesis.txt").write_text("three years of work")
    return outside


def _contents(folder: Path) -> dict[bytes, str]:
    """Every file and link below a directory, with what is in it."""
    found = {}
    for path, folders, files in os.walk(folder):
        for one in (Path(path) / name for name in (*folders, *files)):
            name = os.fsencode(one.relative_to(folder))
            if one.is_symlink():
                found[name] = f"-> {os.readlink(one)}"
            elif one.is_file():
                found[name] = hashlib.sha256(one.read_bytes()).hexdigest()
    return found


def _plant(folder: Path, outside: Path) -> dict[bytes, str]:
    """Put files, directories and links of a user into a directory and all below it."""
    before = _contents(folder).keys()
    for path in [folder, *(one for one in folder.rglob("*") if one.is_dir())]:
        for name in ODD:
            (path / name).write_text(f"mine: {name!a}")
        (path / "mine" / "deep").mkdir(parents=True)
        (path / "mine" / "deep" / "notes.txt").write_text("mine")
        (path / "link").symlink_to(outside)
        (path / "link.csv").symlink_to(outside / "thesis.txt")
    return {name: value for name, value in _contents(folder).items() if name not in before}


def _is_there(planted: dict[bytes, str], out: Path) -> bool:
    """Whether all that was planted is where it was, or is kept aside as it was."""
    found, kept = _contents(out), f"{KEPT}/".encode()
    return all(
        value in (found.get(name), found.get(kept + name)) for name, value in planted.items()
    )


def test_files_in_every_directory_of_a_study(pile: Bench, ledger: Ledger, said: Said) -> None:
    outside = _copied(pile)
    planted, before = _plant(pile.out, outside), _contents(outside)
    for command in ("status", "study", "report", "prune"):
        with ledger.fault("files of others", command):
            code, text = said(command, pile)
            assert code == 0, text
            found = _contents(pile.out)
            assert {name: found.get(name) for name in planted} == planted
            assert not (pile.out / KEPT).exists()
    with ledger.fault("files of others", "each case again"):
        for path in pile.out.glob("cases/*/done.json"):
            path.unlink()
        code, text = said("study", pile)
        assert code == 0, text
        assert _is_there(planted, pile.out)
        # in a case that is run again nothing is left that a solver could read
        assert not any(path.name in ODD for path in pile.out.glob("cases/*/**/*"))
        assert not list(pile.out.glob(f"{KEPT}/cases/*/log.*"))
    assert _contents(outside) == before


def _link(path: Path, outside: Path) -> None:
    """Move something outside and leave a link to it."""
    target = outside / f"moved {path.name}"
    if path.exists():
        shutil.move(path, target)
    path.symlink_to(target)


PLACES = (
    *("tables", "timings", "figures", "cases", "tables/scenes.csv"),
    *("figures/*.svg", "timings/timings.csv", "report.html", "report.json"),
    *("study.json", ".lock", RECORD, "tables/gone.csv"),
)


@pytest.mark.parametrize("place", PLACES)
def test_links_out_of_a_study(cells: Bench, ledger: Ledger, said: Said, place: str) -> None:
    outside = _copied(cells)
    path = next(cells.out.glob(place), cells.out / place)
    _link(path, outside)
    if not path.exists():
        with (cells.out / RECORD).open("a") as record:
            record.write(f"{'0' * 64}  {place}\n")
    before, inside = _contents(outside), _contents(cells.out)
    for command in ("study", "report", "prune"):
        with ledger.fault("a link out of the study", command):
            code, text = said(command, cells)
            assert code == 2, text
            assert len(text.strip().splitlines()) == 1
            assert str(path) in text
            assert "remove the link" in text
            assert _contents(outside) == before
            assert _contents(cells.out) == inside


def test_links_in_a_case(pile: Bench, ledger: Ledger, said: Said) -> None:
    outside = _copied(pile)
    (flow,) = case_of(pile.out, "flow")
    places = [next(flow.glob(name)) for name in ("constant/polyMesh",)]
    one = plan.make(study.load(str(pile.folder / "small.toml"))).cases[flow.name]
    for path in places:
        with ledger.fault("a link out of a case", "prune"):
            _link(path, outside)
            before = _contents(outside)
            case.prune(one, pile.out / "cases")
            assert case.is_done(one, pile.out / "cases")
            assert _contents(outside) == before
    with ledger.fault("a link out of a case", "again"):
        (flow / case.DONE).unlink()
        code, text = said("study", pile)
        assert code == 0, text
        assert _contents(outside) == before
        assert (pile.out / KEPT / places[0].relative_to(pile.out)).is_symlink()
        assert same_tables(pile.out, pile.undisturbed)


def _full_directory(path: Path) -> None:
    path.mkdir()
    (path / "thesis.txt").write_text("mine")


def _file(path: Path) -> None:
    path.write_text("mine")


OBJECTS: dict[str, Callable[[Path], None]] = {
    "a full directory": _full_directory,
    "a file": _file,
}
OURS = (
    *("report.html", "report.json", "study.json", RECORD, "tables/scenes.csv"),
    *("tables", "figures", "timings"),
)


@pytest.mark.parametrize("what", OBJECTS)
def test_other_things_in_our_places(cells: Bench, ledger: Ledger, said: Said, what: str) -> None:
    """Where our files and directories go stands something else; all of it is kept."""
    _copied(cells)
    places = [
        place
        for place in OURS
        if not (what == "a full directory" and "." not in place)
        and not (what != "a full directory" and place == "tables/scenes.csv")
    ]
    with contextlib.ExitStack() as faults:
        for place in places:
            faults.enter_context(ledger.fault(what, place))
            path = cells.out / place
            shutil.rmtree(path) if path.is_dir() else path.unlink()
            OBJECTS[what](path)
        code, text = said("study", cells)
        assert code == 0, text
        assert same_tables(cells.out, cells.undisturbed)
        assert all((cells.out / place).exists() for place in places)
        for place in places:
            kept = cells.out / KEPT / place
            assert os.path.lexists(kept), place
            assert f"{cells.out / place} is not" in text
            if kept.is_dir() and what == "a full directory":
                assert (kept / "thesis.txt").read_text() == "mine"
    code, text = said("study", cells)
    assert "no solver was started" in text
    assert not (cells.out / f"{KEPT}-2").exists()


def test_second_names_of_our_files(cells: Bench, ledger: Ledger, said: Said) -> None:
    """A copy by hard links, as some programs for backups make it, stays what it was."""
    outside = _copied(cells)
    (cells.out / ".lock").write_text("")
    shutil.copytree(cells.out, outside / "backup", copy_function=os.link)
    before = _contents(outside)
    for command in ("study", "report", "prune"):
        with ledger.fault("hard links to all files", command):
            assert said(command, cells)[0] == 0
            assert _contents(outside) == before
    with ledger.fault("hard links to all files", "each case again"):
        for path in cells.out.glob("cases/*/done.json"):
            path.unlink()
        assert said("study", cells)[0] == 0
        assert _contents(outside) == before
    assert not (cells.out / KEPT).exists()


@pytest.mark.parametrize("place", ["figures/*.svg", "timings/*.csv"])
@pytest.mark.parametrize("harm", ["removed", "changed"])
def test_drawings_that_are_gone_are_drawn_again(
    cells: Bench, ledger: Ledger, said: Said, place: str, harm: str
) -> None:
    _copied(cells)
    path = next(cells.out.glob(place))
    whole = path.read_bytes()
    with ledger.fault(f"a drawing that is {harm}", place):
        if harm == "removed":
            path.unlink()
        else:
            path.write_bytes(b"my own words")
        code, text = said("study", cells)
        assert code == 0, text
        assert path.read_bytes()[:8] == whole[:8]
        if harm == "changed":
            kept = cells.out / KEPT / path.relative_to(cells.out)
            assert kept.read_bytes() == b"my own words"
        state = (cells.out / "report.json").stat().st_mtime_ns
        assert "no solver was started" in said("study", cells)[1]
        assert (cells.out / "report.json").stat().st_mtime_ns == state


def test_a_directory_of_another_thing_is_refused(
    cells: Bench, ledger: Ledger, capsys: pytest.CaptureFixture[str]
) -> None:
    _copied(cells)
    source, other = cells.folder / "small.toml", cells.folder / "other.toml"
    shutil.copy(source, other)
    before = _contents(cells.out)
    pack = cells.folder / "pack"
    assert cli.main(["benchmark", "export", str(pack), "--level", "1"]) == 0
    capsys.readouterr()
    for words, kind in (
        (["study", str(other), "--out"], "the study other"),
        (["stability", "--out"], "the experiment stability"),
        (["ladder", "--out"], "the experiment ladder"),
        (["benchmark", "export", "--level", "1"], "the benchmark pack "),
    ):
        with ledger.fault("a directory of another thing", words[0]):
            assert cli.main([*words, str(cells.out)]) == 2
            text = capsys.readouterr().err
            assert f"{cells.out}: the directory holds the study small, not {kind}" in text
            assert _contents(cells.out) == before
    with ledger.fault("a directory of another thing", "a pack"):
        assert cli.main(["study", str(source), "--out", str(pack)]) == 2
        assert "the directory holds the benchmark pack" in capsys.readouterr().err


def test_cases_of_an_earlier_file_are_named_and_kept(
    cells: Bench, ledger: Ledger, said: Said
) -> None:
    _copied(cells)
    (old,) = (path.name for path in case_of(cells.out, "cells"))
    before = _contents(cells.out / "cases" / old)
    source = cells.folder / "small.toml"
    text = source.read_text()
    with ledger.fault("a changed study file", "study"):
        source.write_text(text.replace("[7e-4, 1e-3]", "[1e-3]"))
        code, heard = said("study", cells)
        assert code == 0, heard
        assert "the study file has changed: 1 cases are not asked for any more" in heard
        assert "has changed" not in said("study", cells)[1]
    for command in ("status", "prune"):
        with ledger.fault("a changed study file", command):
            code, heard = said(command, cells)
            assert code == 0, heard
            assert "not asked for: 1 cases of an earlier study file" in heard
            assert old in heard
            assert _contents(cells.out / "cases" / old) == before
    with ledger.fault("a changed study file", "back"):
        source.write_text(text)
        assert "no solver was started" in said("study", cells)[1]
        assert same_tables(cells.out, cells.undisturbed)


def test_a_directory_that_vanishes(pile: Bench, ledger: Ledger) -> None:
    with ledger.fault("a directory that vanishes", "grains"):
        driver = pile.start()
        assert wait_for(lambda: any(pile.out.glob("cases/*/log.liggghts")), driver)
        for _ in range(50):  # its solvers may be at work on it
            shutil.rmtree(pile.out, ignore_errors=True)
            time.sleep(0.01)
        code, text = ended(driver)
        assert code in (1, 2, 3), text
        assert str(pile.out) in text or "cells-" in text
        assert none_left_in(pile.folder)
        shutil.rmtree(pile.out, ignore_errors=True)
        pile.check_finished()
