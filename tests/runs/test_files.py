"""Directories of results: files of this program, files of others, and links."""

import os
from pathlib import Path

import pytest

from orchestrator.errors import InputError
from orchestrator.runs import workspace
from orchestrator.runs.files import RECORD, Folder


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


def test_only_names_that_were_put_are_replaced_or_removed(folder: Folder) -> None:
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
    assert tables == {"a.csv": "two", "mine.csv": "mine"}
    assert folder.written().keys() == {"tables/a.csv"}
    with pytest.raises(ValueError, match="for this test"), folder.renewed():
        raise ValueError("for this test")
    assert folder.is_whole()
    assert (folder.root / "study.json").is_file()


def test_directories_in_the_place_of_files_and_the_reverse_are_refused(
    folder: Folder,
) -> None:
    for name in ("full", "empty"):
        (folder.root / name).mkdir()
    (folder.root / "full" / "notes.txt").write_text("mine")
    (folder.root / "tables").write_text("a file where a directory goes")
    folder.put("empty", "ours")
    assert (folder.root / "empty").read_text() == "ours"
    with pytest.raises(InputError, match="full: a directory is where"):
        folder.put("full", "ours")
    for name in ("tables/a.csv", "tables/deep/a.csv"):
        with pytest.raises(InputError, match="a file is where this program writes a"):
            folder.put(name, "ours")
    assert (folder.root / "full" / "notes.txt").read_text() == "mine"
    assert (folder.root / "tables").read_text() == "a file where a directory goes"


@pytest.mark.parametrize("link", ["tables", "tables/a.csv", RECORD])
def test_no_link_is_followed(folder: Folder, outside: Path, link: str) -> None:
    path = folder.root / link
    (folder.root / "tables").mkdir()
    if path.is_dir():
        path.rmdir()
    path.symlink_to(
        outside if path.suffix not in (".csv", ".sha256") else outside / "a.csv"
    )
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
        lambda: folder.clear(name),
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


@pytest.mark.parametrize("harm", [b"", b"\xff\xfe not a record\n"])
def test_a_harmed_record_is_written_again(folder: Folder, harm: bytes) -> None:
    folder.put("tables/a.csv", "one")
    (folder.root / RECORD).write_bytes(harm)
    folder.put("tables/a.csv", "two")
    assert (folder.root / "tables" / "a.csv").read_text() == "two"
    assert folder.written().keys() == {"tables/a.csv"}
    assert folder.is_whole()


def test_a_cleared_directory_is_gone_and_no_link_in_it_is_followed(
    folder: Folder, outside: Path
) -> None:
    scene = folder.root / "scene"
    (scene / "deep").mkdir(parents=True)
    (scene / "answer.csv").write_text("ours")
    (scene / "deep" / "notes.txt").write_text("mine")
    (scene / "link").symlink_to(outside)
    assert folder.clear("scene") == scene
    assert list(folder.root.iterdir()) == []
    assert (outside / "a.csv").read_text() == "precious"
    scene.write_text("a file where the directory goes")
    folder.clear("scene").mkdir()


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


def test_a_pipe_in_the_place_of_a_file_is_replaced(folder: Folder) -> None:
    os.mkfifo(folder.root / "pipe")
    folder.put("pipe", "ours")
    assert (folder.root / "pipe").read_text() == "ours"
