"""Finished studies: their tables stay, and no edited study gets the answer of another."""

import json
import os
import re
import shutil
import subprocess
from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import orchestrator as face
from orchestrator import cli, plan
from orchestrator.commands.study import answer_finished
from orchestrator.errors import InputError
from orchestrator.report.figures import shields
from orchestrator.report.results import Results
from orchestrator.report.style import Figure
from orchestrator.runs import case
from orchestrator.study import study
from tests.conftest import Command, Mount
from tests.faults.bench import HEAD, PILE, Bench, tables, undisturbed

# the mesh of the small study is so coarse that it is warned of
pytestmark = pytest.mark.filterwarnings("ignore:method.flow.cells_per_face")


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
    before = {
        path: path.read_bytes() for path in finished.out.rglob("*") if path.is_file()
    }
    code, printed = finished.command("report")
    assert (code, "the tables stay as they are" in printed) == (1, True)
    after = {
        path: path.read_bytes() for path in finished.out.rglob("*") if path.is_file()
    }
    assert {**after, finished.out / ".lock": b""} == {
        **before,
        finished.out / ".lock": b"",
    }


def test_a_pruned_study_stays_finished(pile: Bench) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    (cells,), (bed,), (flow,) = (pile.cases(kind) for kind in ("cells", "pile", "flow"))
    whole = sum(path.stat().st_size for path in pile.out.rglob("*") if path.is_file())
    size = float(pile.command("status")[1].partition("size: ")[2].split()[0])
    assert size == pytest.approx(whole / 1e6, abs=0.06)
    code, printed = pile.command("prune")
    assert (code, "pruned: 1 cases" in printed) == (0, True)
    assert {bed.name, flow.name} <= {
        *re.split(r"[ ,\n]", printed)
    }  # the page shows them
    assert not list(cells.glob("*.dump"))
    assert "no solver was started" in pile.command("study")[1]
    assert pile.command("report")[0] == 0
    assert tables(pile.out) == tables(pile.undisturbed)
    figures = (
        {path.name for path in (out / "figures").iterdir()}
        for out in (pile.out, pile.undisturbed)
    )
    assert len({*map(frozenset, figures)}) == 1


def test_every_case_can_be_pruned_and_run_again_by_hand(pile: Bench) -> None:
    shutil.copytree(pile.undisturbed, pile.out)
    cases = pile.out / "cases"
    for run in plan.make(study.load(str(pile.source))).cases.values():
        case.prune_case(run, cases)
        assert case.done_state(run, cases)
        assert not case.is_whole(run, cases)
        subprocess.run(["./Allrun"], cwd=cases / run.name, check=True)
        assert case.is_whole(run, cases)
        assert case.done_state(run, cases)
        (cases / run.name / case.DONE).unlink()
        case.prune_case(run, cases)  # it is not done: nothing is dropped
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
    assert code == 2
    assert "the study small of another file, ../small.toml" in printed
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
    assert ended.stdout.endswith(f"\npage: {finished.out}/report.html\n")
    assert "At what wind does a grain start to move" in ended.stdout
    changed = orchestrator("study", "small.toml", "--out", "out", "--tolerance", "0.1")
    assert changed.returncode == 1
    finished.source.write_text(f"title = 'another'\n{finished.source.read_text()}")
    assert orchestrator("study", "small.toml", "--out", "out").returncode == 1


EDITED = """title = "first"
tolerance = 0.3
grain = { diameter = 1e-3 }
threshold.fractions = [0.1]
method.kind = "pivot"
[fluid]
kind = "water"
[[group]]
name = "profile"
bed = { kind = "pile", profile = "scan.csv" }
method.flow.model = "waves"
[group.axes]
"grain.density" = [2650.0, 3000.0]
[[group]]
name = "sieve"
bed = { kind = "flat", length = 0.02, packing = "poured" }
grain = { diameter = 1e-3, sizes = "sieve.csv" }
[[group]]
name = "grain"
[group.forces]
law = "profile"
"""
SCAN = "x_m,z_m\n0,0\n0.04,0.01\n0.06,0\n"
SIEVE = "diameter_m,fraction\n8e-4,0.5\n1.25e-3,0.5\n"
LINES = EDITED.splitlines(keepends=True)


def _is_finished(file: Path, out: Path, tolerance: float | None = None) -> bool:
    options = Namespace(source=str(file), out=out, tolerance=tolerance, errors=None)
    return bool(answer_finished(options))


@pytest.fixture(scope="module")
def edited(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished study that names a profile and a sieve table."""
    folder = tmp_path_factory.mktemp("edited")
    (folder / "scan.csv").write_text(SCAN)
    (folder / "sieve.csv").write_text(SIEVE)
    (folder / "edited.toml").write_text(EDITED)
    face.run(folder / "edited.toml", out=folder / "out", workers=2)
    return folder


def _edits() -> dict[str, str]:
    """The study file with something in it deleted, added or changed."""
    made = {"empty": "", "a blank line at the end": EDITED + "\n"}
    made["the last byte"] = EDITED[:-1]
    made["a comment"] = EDITED + "# a comment\n"
    made["line ends"] = EDITED.replace("\n", "\r\n")
    made["order of groups"] = "".join([*LINES[:6], *LINES[12:], *LINES[6:12]])
    made["a group twice"] = "".join([*LINES, *LINES[15:]])
    made["a table of texts"] = EDITED + "\n[profiles]\n"
    made["one digit"] = EDITED.replace("0.02", "0.03")
    for first in range(len(LINES)):
        made[f"from line {first + 1} to the end"] = "".join(LINES[:first])
        made[f"line {first + 1}"] = "".join(LINES[:first] + LINES[first + 1 :])
        made[f"to line {first + 1}"] = "".join(LINES[first + 1 :])
    return made


EDITS = _edits()


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_study_is_not_answered_with_the_old_answer(
    name: str, edited: Path
) -> None:
    """A deleted end, even an empty file, was once answered with the old answer."""
    file, out = edited / "edited.toml", edited / "out"
    stamp = file.stat()
    assert _is_finished(file, out)
    try:
        file.write_bytes(EDITS[name].encode())
        # a copy may keep the time of its original
        os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
        assert not _is_finished(file, out)
    finally:
        file.write_text(EDITED)
    assert _is_finished(file, out)


@pytest.mark.parametrize("name", ["scan.csv", "sieve.csv"])
def test_a_file_that_a_study_names_is_a_part_of_it(name: str, edited: Path) -> None:
    file, out = edited / "edited.toml", edited / "out"
    named = edited / name
    content, stamp = named.read_bytes(), named.stat()
    swapped = (SIEVE if name == "scan.csv" else SCAN).encode()
    alike = content.replace(b"1", b"2", 1)  # of the same size
    for other in (b"", content[:-1], content + b"\n", alike, swapped, None):
        named.unlink()
        if other is not None:
            named.write_bytes(other)
            os.utime(named, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
        assert not _is_finished(file, out)
        named.write_bytes(content)
        assert _is_finished(file, out)


def test_tolerance_and_place_are_parts_of_the_question(
    edited: Path, tmp_path: Path
) -> None:
    file, out = edited / "edited.toml", edited / "out"
    assert _is_finished(file, out)
    for tolerance in (0.05, 0.3, float("nan")):
        assert not _is_finished(file, out, tolerance)
    # a copy of file and directory together is finished, another file is not
    copy = tmp_path / "copy"
    shutil.copytree(edited, copy)
    assert _is_finished(copy / "edited.toml", copy / "out")
    (copy / "other").mkdir()
    shutil.move(copy / "edited.toml", copy / "other" / "edited.toml")
    assert not _is_finished(copy / "other" / "edited.toml", copy / "out")


def test_a_figure_that_failed_is_drawn_the_next_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The page without it once counted as finished."""
    file, out = tmp_path / "t.toml", tmp_path / "out"
    file.write_text("grain.diameter = 1e-3\nmethod.kind = 'pivot'\n")

    def fail(results: Results) -> Iterator[Figure]:
        raise MemoryError("for this test")

    words = ["study", str(file), "--out", str(out)]
    figure = shields.FIGURE
    monkeypatch.setattr(shields, "FIGURE", replace(figure, draws=fail))
    for _ in range(2):
        assert cli.main(words) == 1
        printed = capsys.readouterr()
        assert "shields: MemoryError: for this test" in printed.err
        assert "the same command draws it again" in printed.err
        assert "At what wind does a grain of 1 mm start to move?" in printed.out
        assert "MemoryError: for this test" in (out / "report.html").read_text()
        assert not (out / "figures" / "shields.svg").exists()
        assert not _is_finished(file, out)
    monkeypatch.setattr(shields, "FIGURE", figure)
    assert cli.main(words) == 0
    assert "no solver was started" in capsys.readouterr().err
    assert "MemoryError" not in (out / "report.html").read_text()
    assert (out / "figures" / "shields.svg").is_file()
    assert _is_finished(file, out)


def test_the_command_and_python_answer_an_edited_study_alike(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "t.toml", tmp_path / "out"
    whole = "grain.diameter = 1e-3\nmethod.kind = 'pivot'\n[forces]\nlaw = 'profile'\n"
    cut = whole.partition("[forces]")[0]
    answers: list[str] = []
    for text in (whole, cut):
        file.write_text(text)
        for place in (tmp_path / f"new{len(answers)}", out):
            assert cli.main(["study", str(file), "--out", str(place)]) == 0
            printed = capsys.readouterr().out
            answers.append(face.run(file, out=place).answer)
            assert printed == f"{answers[-1]}\npage: {place / 'report.html'}\n"
    assert answers[0] == answers[1] != answers[2] == answers[3]
    file.write_text("")
    assert cli.main(["study", str(file), "--out", str(out)]) == 2
    assert "grain.diameter: is missing" in capsys.readouterr().err


def test_the_text_of_a_file_comes_from_one_place(tmp_path: Path) -> None:
    """The table of texts once won over the file, silently."""
    file, out = tmp_path / "t.toml", tmp_path / "out"
    body = "grain.diameter = 1e-3\nbed = { kind = 'pile', profile = 'scan.csv' }\n"
    body += "method.flow.model = 'waves'\nmethod.kind = 'pivot'\n"
    file.write_text(f"{body}[profiles]\n'scan.csv' = '''{SCAN}'''\n")
    face.run(file, out=out)
    assert _is_finished(file, out)
    (tmp_path / "scan.csv").write_text(SCAN.replace("0.01", "0.012"))
    assert not _is_finished(file, out)
    with pytest.raises(InputError, match=r"scan.csv: it is a file, and its text is in"):
        study.load(file)
    # a directory of results has the texts of its files, and reads none
    assert len(face.open(out).thresholds)
    file.write_text(f"{body}[profiles]\n'other.csv' = ''\n")
    with pytest.raises(InputError, match="its text is not in the table"):
        study.load(file)


def test_warnings_that_are_errors_end_no_command(
    tmp_path: Path, orchestrator: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONWARNINGS", "error")
    text = (HEAD + PILE).replace("waiting_time = 6.0", "waiting_time = 2.0")
    (tmp_path / "small.toml").write_text(text)
    ended = orchestrator("study", "small.toml", "--plan")
    assert ended.returncode == 0, ended.stderr
    assert "orchestrator: warning: " in ended.stderr
