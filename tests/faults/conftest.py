"""The studies that faults are injected into, and the count of the faults."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests.faults.bench import CELLS, HEAD, PILE, Bench
from tests.faults.ledger import Ledger

LEDGER = Ledger()


@pytest.fixture(scope="session")
def ledger() -> Ledger:
    return LEDGER


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    if LEDGER.runs:
        assert config.cache
        path = LEDGER.write(config.cache.mkdir("faults"))
        terminalreporter.section(f"faults, {path}")
        terminalreporter.write_line(LEDGER.table().to_string(index=False))


def _undisturbed(folder: Path, text: str) -> Path:
    (folder / "small.toml").write_text(text)
    bench = Bench(folder, folder / "out")
    code, said = bench.study()
    assert code == 0, said
    return bench.out


@pytest.fixture(scope="session")
def finished_pile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study of a pile and two cells, undisturbed."""
    return _undisturbed(tmp_path_factory.mktemp("pile"), HEAD + CELLS + PILE)


@pytest.fixture(scope="session")
def finished_cells(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study of two cells, undisturbed."""
    return _undisturbed(tmp_path_factory.mktemp("cells"), HEAD + CELLS)


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
