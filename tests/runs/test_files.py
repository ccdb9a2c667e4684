"""Directories of results: files of this program, files of others, and links."""

import os
from pathlib import Path

import pytest

from orchestrator.errors import InputError
from orchestrator.runs import workspace
from orchestrator.runs.files import KEPT, RECORD, Folder


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    (tmp_path / "out").mkdir()
    return Folder(tmp_path / "out")


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    path = tmp_path / "outside"
    path.mkdir()
    (path / "a.csv").write_text("precious")
    return path


def test_only_files_that_were_put_are_replaced_or_removed(folder: Folder) -> None:
    for name in ("tables/a.csv", "tables/b.csv", "tables/c.csv"):
        folder.put(name, "one")
    folder.note("study.json", "{}")
    (folder.root / "tables" / "c.csv").write_text("changed")
    (folder.root / "tables" / "mine.csv").write_text("mine")
    with folder.renewed():
        folder.put("tables/a.csv", "two")
    tables = {
        path.name: path.read_text() for path in (folder.root / "tables").iterdir()
    }
    assert tables == {"a.csv": "two", "c.csv": "changed", "mine.csv": "mine"}
    assert folder.written().keys() == {"tables/a.csv"}
    with pytest.raises(ValueError, match="for this test"), folder.renewed():
        raise ValueError("for this test")
    assert folder.is_whole()
    assert (folder.root / "study.json").is_file()
    assert not (folder.root / KEPT).exists()


@pytest.mark.filterwarnings("ignore:.*not what this program wrote")
def test_directories_in_the_place_of_files_and_the_reverse_are_kept(
    folder: Folder,
) -> None:
    for name in ("full", "empty"):
        (folder.root / name).mkdir()
    (folder.root / "full" / "notes.txt").write_text("mine")
    (folder.root / "tables").write_text("a file where a directory goes")
    for name in ("full", "empty", "tables/a.csv"):
        folder.put(name, "ours")
        assert (folder.root / name).read_text() == "ours"
    kept = folder.root / KEPT
    assert {path.name for path in kept.iterdir()} == {"full", "tables"}
    assert (kept / "full" / "notes.txt").read_text() == "mine"
    # where that file is now, no directory can be
    (folder.root / "tables" / "a.csv").write_text("mine")
    with pytest.warns(
        UserWarning, match=r"out/tables/a\.csv is not what this program wrote"
    ):
        folder.put("tables/a.csv", "ours")
    assert (folder.root / f"{KEPT}-2" / "tables" / "a.csv").read_text() == "mine"


@pytest.mark.parametrize("link", ["tables", "tables/a.csv", KEPT, RECORD])
def test_no_link_is_followed(folder: Folder, outside: Path, link: str) -> None:
    path = folder.root / link
    (folder.root / "tables").mkdir()
    if path.is_dir():
        path.rmdir()
    path.symlink_to(
        outside if path.suffix not in (".csv", ".sha256") else outside / "a.csv"
    )
    if link == KEPT:
        (folder.root / "tables" / "a.csv").write_text("mine")
    with pytest.raises(InputError, match=f"{path}: it is a link"):
        folder.put("tables/a.csv", "ours")
    assert path.is_symlink()
    assert {file.name: file.read_text() for file in outside.iterdir()} == {
        "a.csv": "precious"
    }


@pytest.mark.parametrize(
    "name", ["../a.csv", "/a.csv", "tables/../../a.csv", "..", "."]
)
def test_no_name_leads_out(folder: Folder, name: str) -> None:
    for write in (
        lambda: folder.put(name, "ours"),
        lambda: folder.clear(name, lambda _: True),
    ):
        with pytest.raises(InputError, match="out of the directory"):
            write()


def test_a_directory_belongs_to_one_kind_and_one_name(
    tmp_path: Path, outside: Path
) -> None:
    root, kinds = tmp_path / "out", workspace.KINDS
    for _ in range(2):
        with workspace.claimed(root, workspace.RESULTS, "mine") as folder:
            folder.put("comparison.csv", "one")
    for kind, name in (
        (kinds[0], "mine"),
        (workspace.RESULTS, "yours"),
        (kinds[-1], "mine"),
    ):
        holds = pytest.raises(
            InputError, match=r"holds the benchmark of the solver mine, not"
        )
        with holds, workspace.claimed(root, kind, name):
            pass
    assert folder.is_whole()
    for kind in kinds:
        new = tmp_path / kind.word
        new.mkdir()
        (new / kind.marker).write_text('{"title": "something else"}')
        for place, named in ((outside, r"a\.csv"), (new, kind.marker)):
            with (
                pytest.raises(InputError, match=named),
                workspace.claimed(place, kind, "mine"),
            ):
                pass
    assert [path.name for path in outside.iterdir()] == ["a.csv"]


@pytest.mark.filterwarnings("ignore:.*not what this program wrote")
@pytest.mark.parametrize("harm", [b"", b"\xff\xfe not a record\n"])
def test_without_its_record_nothing_is_lost(folder: Folder, harm: bytes) -> None:
    folder.put("tables/a.csv", "one")
    (folder.root / RECORD).write_bytes(harm)
    folder.put("tables/a.csv", "two")
    assert (folder.root / KEPT / "tables" / "a.csv").read_text() == "one"
    assert folder.is_whole()


@pytest.mark.filterwarnings("ignore:.*not what this program wrote")
def test_a_cleared_directory_leaves_what_is_not_ours(
    folder: Folder, outside: Path
) -> None:
    scene = folder.root / "scene"
    (scene / "deep").mkdir(parents=True)
    (scene / "answer.csv").write_text("ours")
    (scene / "deep" / "log.txt").write_text("ours")
    (scene / "deep" / "notes.txt").write_text("mine")
    (scene / "link").symlink_to(outside)
    ours = {"answer.csv", "deep/log.txt"}
    assert folder.clear("scene", ours.__contains__) == scene
    assert not scene.exists()
    kept = folder.root / KEPT / "scene"
    found = {path.relative_to(kept).as_posix() for path in kept.rglob("*")}
    assert found == {"deep", "deep/notes.txt", "link"}
    assert (outside / "a.csv").read_text() == "precious"


def test_another_name_of_a_file_keeps_its_content(
    folder: Folder, outside: Path
) -> None:
    folder.put("tables/a.csv", "one")
    second = outside / "second"
    for name in ("tables/a.csv", RECORD):
        os.link(folder.root / name, second)
        before = second.read_bytes()
        folder.put("tables/a.csv", f"two {name}")
        assert second.read_bytes() == before
        second.unlink()
    assert not (folder.root / KEPT).exists()


@pytest.mark.filterwarnings("ignore:.*not what this program wrote")
def test_a_pipe_in_the_place_of_a_file_is_kept(folder: Folder) -> None:
    os.mkfifo(folder.root / "pipe")
    folder.put("pipe", "ours")
    assert (folder.root / "pipe").read_text() == "ours"
    assert (folder.root / KEPT / "pipe").is_fifo()
