"""Files of a directory of ours, and files of others in it: which are replaced, removed, kept."""

import os
from pathlib import Path

import pytest

from orchestrator.errors import InputError
from orchestrator.runs import workspace
from orchestrator.runs.files import KEPT, RECORD, Folder

MINE = pytest.mark.filterwarnings("ignore:.*not what this program wrote")


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    root = tmp_path / "out"
    root.mkdir()
    return Folder(root)


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    path = tmp_path / "outside"
    path.mkdir()
    (path / "a.csv").write_text("precious")
    return path


def test_what_was_put_is_put_again(folder: Folder) -> None:
    folder.put("tables/a.csv", "one")
    folder.put("tables/a.csv", "two")
    assert (folder.root / "tables" / "a.csv").read_text() == "two"
    assert folder.is_whole()
    assert not (folder.root / KEPT).exists()


@pytest.mark.parametrize("name", ["a.csv", "tables/a.csv"])
def test_what_others_wrote_is_kept_aside_and_told(folder: Folder, name: str) -> None:
    for count, place in enumerate((KEPT, f"{KEPT}-2")):
        path = folder.root / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"mine {count}")
        with pytest.warns(UserWarning, match=name):
            folder.put(name, "ours")
        assert path.read_text() == "ours"
        assert (folder.root / place / name).read_text() == f"mine {count}"


@MINE
def test_what_is_no_file_is_kept_aside(folder: Folder) -> None:
    for name, make in (("pipe", os.mkfifo), ("full", os.mkdir), ("empty", os.mkdir)):
        make(folder.root / name)
    (folder.root / "full" / "notes.txt").write_text("mine")
    (folder.root / "tables").write_text("a file where a directory goes")
    for name in ("pipe", "full", "empty", "tables/a.csv"):
        folder.put(name, "ours")
        assert (folder.root / name).read_text() == "ours"
    kept = folder.root / KEPT
    assert {path.name for path in kept.iterdir()} == {"pipe", "full", "tables"}
    assert (kept / "full" / "notes.txt").read_text() == "mine"
    # where that file is now, no directory can be
    (folder.root / "tables" / "a.csv").write_text("mine")
    folder.put("tables/a.csv", "ours")
    assert (folder.root / f"{KEPT}-2" / "tables" / "a.csv").read_text() == "mine"


@pytest.mark.parametrize("link", ["tables", "tables/a.csv", KEPT, RECORD])
def test_no_link_is_followed(folder: Folder, outside: Path, link: str) -> None:
    path = folder.root / link
    (folder.root / "tables").mkdir()
    if path.is_dir():
        path.rmdir()
    path.symlink_to(outside if path.suffix not in (".csv", ".sha256") else outside / "a.csv")
    if link == KEPT:
        (folder.root / "tables" / "a.csv").write_text("mine")
    with pytest.raises(InputError, match="link") as caught:
        folder.put("tables/a.csv", "ours")
    assert str(path) in str(caught.value)
    assert path.is_symlink()
    assert {one.name: one.read_text() for one in outside.iterdir()} == {"a.csv": "precious"}


@pytest.mark.parametrize("name", ["../a.csv", "/a.csv", "tables/../../a.csv", "..", "."])
def test_no_name_leads_out(folder: Folder, name: str) -> None:
    with pytest.raises(InputError, match="out of the directory"):
        folder.put(name, "ours")
    with pytest.raises(InputError):
        folder.clear(name, lambda _: True)


def test_files_that_are_not_put_anew_are_removed_if_they_are_ours(folder: Folder) -> None:
    for name in ("tables/a.csv", "tables/b.csv", "tables/c.csv", "figures/a.png"):
        folder.put(name, "one")
    (folder.root / "tables" / "c.csv").write_text("changed")
    (folder.root / "tables" / "mine.csv").write_text("mine")
    with folder.renewed("tables"):
        folder.put("tables/a.csv", "two")
    tables = {path.name: path.read_text() for path in (folder.root / "tables").iterdir()}
    assert tables == {"a.csv": "two", "c.csv": "changed", "mine.csv": "mine"}
    assert set(folder.written()) == {"tables/a.csv", "figures/a.png"}


def test_nothing_is_removed_where_drawing_failed(folder: Folder) -> None:
    folder.put("tables/a.csv", "one")
    with pytest.raises(ValueError, match="for this test"), folder.renewed():
        raise ValueError("for this test")
    assert folder.is_whole()


@MINE
def test_a_cleared_directory_leaves_what_is_not_ours(folder: Folder, outside: Path) -> None:
    scene = folder.root / "scene"
    (scene / "deep").mkdir(parents=True)
    (scene / "answer.csv").write_text("ours")
    (scene / "deep" / "log.txt").write_text("ours")
    (scene / "deep" / "notes.txt").write_text("mine")
    (scene / "link").symlink_to(outside)
    assert folder.clear("scene", {"answer.csv", "deep/log.txt"}.__contains__) == scene
    assert not scene.exists()
    kept = folder.root / KEPT / "scene"
    assert {str(path.relative_to(kept)) for path in kept.rglob("*")} >= {"deep/notes.txt", "link"}
    assert not (kept / "answer.csv").exists()
    assert not (kept / "deep" / "log.txt").exists()
    assert (outside / "a.csv").read_text() == "precious"


@pytest.mark.parametrize("harm", [b"", b"\x00\xff{]" * 50, b"0" * 64])
@MINE
def test_without_its_record_nothing_is_lost(folder: Folder, harm: bytes) -> None:
    folder.put("tables/a.csv", "one")
    (folder.root / RECORD).write_bytes(harm)
    folder.put("tables/a.csv", "two")
    assert (folder.root / KEPT / "tables" / "a.csv").read_text() == "one"
    assert folder.is_whole()


def test_a_directory_belongs_to_one_thing(tmp_path: Path) -> None:
    root = tmp_path / "out"
    for _ in range(2):
        with workspace.claimed(root, workspace.RESULTS, "mine") as folder:
            folder.put("comparison.csv", "one")
    for kind, name in (
        (workspace.RESULTS, "yours"),
        (workspace.STUDY, "mine"),
        (workspace.PACK, "mine"),
    ):
        with (
            pytest.raises(InputError, match=r"holds the benchmark of the solver mine, not"),
            workspace.claimed(root, kind, name),
        ):
            pass
    assert folder.is_whole()


def test_a_directory_of_others_is_not_entered(tmp_path: Path, outside: Path) -> None:
    for kind in workspace.KINDS:
        with pytest.raises(InputError, match=r"a\.csv"), workspace.claimed(outside, kind, "mine"):
            pass
        (tmp_path / "new").mkdir()
        (tmp_path / "new" / kind.marker).write_text('{"title": "something else"}')
        with (
            pytest.raises(InputError, match=kind.marker),
            workspace.claimed(tmp_path / "new", kind, "mine"),
        ):
            pass
        (tmp_path / "new" / kind.marker).unlink()
        (tmp_path / "new").rmdir()
    assert [path.name for path in outside.iterdir()] == ["a.csv"]
