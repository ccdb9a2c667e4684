"""Every file that a study keeps its state or results in, harmed in every way."""

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from orchestrator import cli, plan
from orchestrator.errors import SolverError
from orchestrator.runs import case
from orchestrator.study import study
from tests.faults.bench import Bench, case_of, same_tables
from tests.faults.ledger import Ledger

Harm = Callable[[Path], None]
# a file that is not as it was written may be someone's: it is kept, and a line says so
pytestmark = pytest.mark.filterwarnings("ignore:.*is not what this program wrote")


def _truncated(share: float) -> Harm:
    def harm(path: Path) -> None:
        os.truncate(path, int(path.stat().st_size * share))

    return harm


def _garbage(path: Path) -> None:
    path.write_bytes(b"\x00\xff{]" * 50)


def _directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


HARMS: dict[str, Harm] = {
    **{f"truncated to {share:.0%}": _truncated(share) for share in (0.1, 0.3, 0.5, 0.7, 0.99)},
    "emptied": _truncated(0),
    "garbage": _garbage,
    "a directory": _directory,
    "removed": Path.unlink,
}
OF_A_STUDY = (
    "study.json",
    ".lock",
    "report.json",
    "report.html",
    "written.sha256",
    "figures/shields.svg",
    "timings/timings.csv",
    "tables/scenes.csv",
    "tables/single_grain.csv",
    "tables/columns.csv",
)
OF_CELLS = (
    "case.json",
    "done.json",
    "samples.csv",
    "passage.dump",
    "bed.dump",
    "load_steps.csv",
    "motion.csv",
)
OF_A_PILE = (
    "flow-*/case.json",
    "flow-*/done.json",
    "flow-*/[1-9]*/U",
    "flow-*/wall_stress.csv",
    "pile-*/done.json",
    "pile-*/motion.csv",
)


def _again(bench: Bench, capsys: pytest.CaptureFixture[str]) -> str:
    """Ask for the study's state and for the study; what was said."""
    source, out = bench.folder / "small.toml", bench.out
    assert cli.main(["status", str(out)]) in (0, 2, 3)
    assert cli.main(["study", str(source), "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    assert same_tables(out, bench.undisturbed)
    return said.err


@contextlib.contextmanager
def _faults(ledger: Ledger, paths: Sequence[Path]) -> Iterator[None]:
    with contextlib.ExitStack() as stack:
        for path in paths:
            stack.enter_context(ledger.fault("a harmed file", path.name))
        yield


def _heals(bench: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    _again(bench, capsys)
    assert "no solver was started" in _again(bench, capsys)


@pytest.mark.parametrize("how", HARMS)
def test_harmed_files_of_the_study(
    cells: Bench, ledger: Ledger, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(cells.undisturbed, cells.out)
    (cells.out / ".lock").write_text('{"host": "elsewhere", "pid": 1, "started": ""}\n')
    paths = [cells.out / name for name in OF_A_STUDY]
    with _faults(ledger, paths):
        for path in paths:
            HARMS[how](path)
        _heals(cells, capsys)


@pytest.mark.parametrize("how", HARMS)
def test_harmed_files_of_a_case(
    cells: Bench, ledger: Ledger, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each is noticed alone, and all of them are healed together."""
    shutil.copytree(cells.undisturbed, cells.out)
    (directory,) = case_of(cells.out, "cells")
    paths = [directory / name for name in OF_CELLS]
    with _faults(ledger, paths):
        for path in paths:
            whole = path.read_bytes()
            HARMS[how](path)
            # a large file that no table needs may be missing, as after `prune`
            assert _done(cells) == (how == "removed" and path.suffix == ".dump"), path.name
            if path.is_dir():
                path.rmdir()
            path.write_bytes(whole)
            assert _done(cells)
        for path in paths:
            HARMS[how](path)
        _heals(cells, capsys)


def _done(bench: Bench) -> bool:
    (one,) = plan.make(study.load(str(bench.folder / "small.toml"))).cells
    return case.is_done(one, bench.out / "cases")


@pytest.mark.parametrize("how", HARMS)
def test_a_harmed_note_of_failure(
    cells: Bench, ledger: Ledger, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(cells.undisturbed, cells.out)
    (directory,) = case_of(cells.out, "cells")
    path = directory / case.FAILED
    with _faults(ledger, [path]):
        (directory / case.DONE).unlink()
        case.fail(directory, SolverError("for this test"))
        HARMS[how](path)
        code = cli.main(["status", str(cells.out)])
        assert code == (0 if how in ("removed", "a directory") else 3)
        if how == "emptied":
            _heals(cells, capsys)
        else:
            assert not _done(cells)


@pytest.mark.parametrize("how", ["truncated to 50%", "garbage"])
def test_harmed_files_of_a_flow_and_a_pile(
    pile: Bench, ledger: Ledger, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    paths = [path for name in OF_A_PILE for path in pile.out.glob(f"cases/{name}")]
    assert len(paths) == len(OF_A_PILE)
    with _faults(ledger, paths):
        for path in paths:
            HARMS[how](path)
        _heals(pile, capsys)
