"""The studies that faults are injected into."""

import shutil
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.conftest import Shared
from tests.faults.bench import CELLS, HEAD, PILE, Bench, undisturbed


@pytest.fixture
def pile(tmp_path: Path, finished_pile: Path) -> Iterator[Bench]:
    """The study of a pile and two cells, not begun."""
    (tmp_path / "small.toml").write_text(HEAD + CELLS + PILE)
    with closing(Bench(tmp_path, finished_pile)) as bench:
        yield bench


@pytest.fixture
def cells(tmp_path: Path, shared: Shared) -> Iterator[Bench]:
    """The study of two cells, not begun."""
    (tmp_path / "small.toml").write_text(HEAD + CELLS)
    with shared("cells") as folder:
        finished = undisturbed(folder, HEAD + CELLS)
    with closing(Bench(tmp_path, finished)) as bench:
        yield bench


@pytest.fixture
def finished(cells: Bench) -> Bench:
    """The study of two cells, finished."""
    shutil.copytree(cells.undisturbed, cells.out)
    return cells
