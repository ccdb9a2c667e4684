"""The studies that faults are injected into."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import Shared
from tests.faults.bench import CELLS, HEAD, PILE, Bench, begun, undisturbed


@pytest.fixture
def pile(tmp_path: Path, finished_pile: Path) -> Iterator[Bench]:
    """The study of a pile and two cells, not begun."""
    with begun(tmp_path, HEAD + CELLS + PILE, finished_pile) as bench:
        yield bench


@pytest.fixture
def cells(tmp_path: Path, shared: Shared) -> Iterator[Bench]:
    """The study of two cells, not begun."""
    with shared("cells") as folder:
        finished = undisturbed(folder, HEAD + CELLS)
    with begun(tmp_path, HEAD + CELLS, finished) as bench:
        yield bench


@pytest.fixture
def finished(cells: Bench) -> Bench:
    """The study of two cells, finished."""
    shutil.copytree(cells.undisturbed, cells.out)
    return cells
