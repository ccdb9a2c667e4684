"""The studies that faults are injected into, and a file system of their own."""

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.conftest import Shared
from tests.faults.bench import CELLS, HEAD, PILE, Bench, undisturbed

Mount = Callable[[str], Path]


@pytest.fixture(scope="session")
def finished_cells(shared: Shared) -> Path:
    """A finished study of two cells, undisturbed."""
    with shared("cells") as folder:
        return undisturbed(folder, HEAD + CELLS)


@pytest.fixture
def pile(tmp_path: Path, finished_pile: Path) -> Iterator[Bench]:
    """The study of a pile and two cells, not begun."""
    (tmp_path / "small.toml").write_text(HEAD + CELLS + PILE)
    with closing(Bench(tmp_path, finished_pile)) as bench:
        yield bench


@pytest.fixture
def cells(tmp_path: Path, finished_cells: Path) -> Iterator[Bench]:
    """The study of two cells, not begun."""
    (tmp_path / "small.toml").write_text(HEAD + CELLS)
    with closing(Bench(tmp_path, finished_cells)) as bench:
        yield bench


@pytest.fixture
def finished(cells: Bench) -> Bench:
    """The study of two cells, finished."""
    shutil.copytree(cells.undisturbed, cells.out)
    return cells


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Mount]:
    """Mount a file system of its own with some options, or mount it anew with others."""
    folder = tmp_path / "disk"

    def mount(options: str) -> Path:
        again = "remount," if folder.exists() else ""
        folder.mkdir(exist_ok=True)
        command = ["mount", "-t", "tmpfs", "-o", again + options, "tmpfs", str(folder)]
        if os.geteuid() != 0 or subprocess.run(command, capture_output=True).returncode:
            folder.rmdir()
            pytest.skip("a file system can be mounted by root alone")
        return folder

    yield mount
    if folder.exists():
        subprocess.run(["umount", "-l", str(folder)], check=True)
