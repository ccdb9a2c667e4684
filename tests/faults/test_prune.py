"""Finished studies made small: what is dropped, and that nothing is lost by it."""

import shutil
import subprocess
from pathlib import Path

import pytest

from orchestrator import cli, plan
from orchestrator.plan import Plan
from orchestrator.runs import case
from orchestrator.runs.files import read_json
from orchestrator.study import study
from tests.faults.bench import Bench, case_of, same_tables


def _planned(bench: Bench) -> Plan:
    return plan.make(study.load(str(bench.folder / "small.toml")))


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def test_a_pruned_study_is_finished_and_its_page_is_the_same(
    pile: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    (cells,) = case_of(pile.out, "cells")
    before = _size(cells)
    assert cli.main(["prune", str(pile.out)]) == 0
    said = capsys.readouterr().out
    assert "pruned: 1 cases" in said
    # the page shows the pile and its flow
    assert all(next(case_of(pile.out, kind)).name in said for kind in ("pile", "flow"))
    assert not list(cells.glob("*.dump"))
    assert case.size(cells, read_json(cells / case.DONE) or {}) == _size(cells) < before
    assert cli.main(["study", str(pile.folder / "small.toml"), "--out", str(pile.out)]) == 0
    assert "no solver was started" in capsys.readouterr().err
    assert cli.main(["report", str(pile.out)]) == 0
    assert same_tables(pile.out, pile.undisturbed)
    figures = {path.name for path in (pile.undisturbed / "figures").iterdir()}
    assert {path.name for path in (pile.out / "figures").iterdir()} == figures


def test_status_tells_the_sizes(pile: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    cli.main(["status", str(pile.undisturbed)])
    (line,) = [one for one in capsys.readouterr().out.splitlines() if one.startswith("size: ")]
    total = float(line.split()[1])
    assert line.split()[2] == "MB"
    assert total == pytest.approx(_size(pile.undisturbed) / 1e6, rel=0.01)
    assert all(f"{kind} cases" in line for kind in ("flow", "pile", "cells"))


def test_every_case_can_be_pruned_and_run_again_by_hand(pile: Bench) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    cases = pile.out / "cases"
    for one in _planned(pile).cases.values():
        case.prune(one, cases)
        assert case.is_done(one, cases)
        assert not case.is_whole(one, cases)
        assert not list((cases / one.name).glob("*.dump"))
        assert not (cases / one.name / "constant" / "polyMesh").exists()
        copy = pile.folder / f"{one.kind} by hand"
        shutil.copytree(cases / one.name, copy)
        subprocess.run(["./Allrun"], cwd=copy, check=True)
        subprocess.run(["sha256sum", "--quiet", "-c", case.CHECKSUMS], cwd=copy, check=True)
        # the files are back in the case itself: it is whole again
        shutil.rmtree(cases / one.name)
        shutil.copytree(copy, cases / one.name)
        assert case.is_whole(one, cases)
        assert case.is_done(one, cases)


def test_pictures_of_pruned_cases_are_left_out(
    pile: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    for one in _planned(pile).cases.values():
        case.prune(one, pile.out / "cases")
    assert cli.main(["report", str(pile.out)]) == 0, capsys.readouterr().err
    assert same_tables(pile.out, pile.undisturbed)


def test_a_prune_that_was_killed_is_ended_by_the_next(cells: Bench) -> None:
    shutil.copytree(cells.undisturbed, cells.out)
    (one,) = _planned(cells).cells
    cases = cells.out / "cases"
    kept = (cases / one.name / "passage.dump").read_bytes()
    case.prune(one, cases)
    # as it is before the first file goes
    (cases / one.name / "passage.dump").write_bytes(kept)
    assert case.is_done(one, cases)
    case.prune(one, cases)
    assert not list((cases / one.name).glob("*.dump"))
    assert case.is_done(one, cases)


def test_a_pruned_file_that_came_back_wrong_is_noticed(cells: Bench) -> None:
    shutil.copytree(cells.undisturbed, cells.out)
    (one,) = _planned(cells).cells
    case.prune(one, cells.out / "cases")
    (cells.out / "cases" / one.name / "passage.dump").write_text("half a run by hand")
    assert not case.is_done(one, cells.out / "cases")


def test_a_case_that_is_not_done_is_not_pruned(cells: Bench) -> None:
    shutil.copytree(cells.undisturbed, cells.out)
    (one,) = _planned(cells).cells
    directory = cells.out / "cases" / one.name
    (directory / case.DONE).unlink()
    case.prune(one, cells.out / "cases")
    assert (directory / "passage.dump").is_file()
