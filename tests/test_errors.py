"""Messages of failures: what, where, remedy, in one line."""

import errno
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from orchestrator.errors import InputError, of_system
from orchestrator.runs.workspace import Status, status_text
from tests.conftest import Command


def test_a_name_moves_no_cursor() -> None:
    status = Status("a\x1b[2J\nb", False, (), (), ("c\x9b",), {"d": "\r"}, None, {}, {})
    text = status_text(status)
    assert all(c.isprintable() or c == "\n" for c in text)
    assert "study a\\x1b[2J\\nb: " in text


def test_a_message_says_what_where_and_what_to_do() -> None:
    error = InputError("is negative", where="a.toml: grain.diameter", remedy="raise it")
    assert str(error) == "a.toml: grain.diameter: is negative (raise it)"


def test_a_full_disk_is_called_so() -> None:
    plain = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "file")
    assert str(of_system(plain)).startswith("file: no space is left on the disk")
    many = shutil.Error([("a", "b", f"{plain}"), ("c", "d", f"{plain}")])
    assert str(of_system(many, "case")).startswith("case: no space is left on the disk")
    other = OSError(errno.EACCES, "Permission denied", "file")
    assert "file: Permission denied" in str(of_system(other))


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of its own with 2 MiB."""
    folder = tmp_path / "small"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=2M", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True).returncode:
        pytest.skip("a file system can be mounted by root alone")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_study_on_a_full_disk_is_continued_when_there_is_room(
    orchestrator: Command, tmp_path: Path, small_disk: Path
) -> None:
    study = 'protocol = { load_increment = 0.02 }\n[axes]\n"grain.diameter" = [7e-4, 1e-3]\n'
    (tmp_path / "grains.toml").write_text(study)
    filler = small_disk / "filler"
    filler.write_bytes(b"0" * (2 * 2**20 - 2**17))
    out = small_disk / "out"
    ended = orchestrator("study", "grains.toml", "--out", str(out))
    assert ended.returncode != 0
    assert "Traceback" not in ended.stderr
    assert "no space is left" in ended.stderr or "disk is full" in ended.stderr
    subprocess.run(["mount", "-o", "remount,size=100M", str(small_disk)], check=True)
    again = orchestrator("study", "grains.toml", "--out", str(out))
    assert again.returncode == 0, again.stderr
    undisturbed = orchestrator("study", "grains.toml", "--out", "elsewhere")
    assert undisturbed.returncode == 0
    for path in (out / "tables").iterdir():
        assert path.read_bytes() == (tmp_path / "elsewhere" / "tables" / path.name).read_bytes()
