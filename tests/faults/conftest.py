"""The studies that faults are injected into, and the count of the faults."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Shared
from tests.faults.bench import CELLS, HEAD, PILE, Bench, undisturbed
from tests.faults.ledger import Ledger

LEDGER = Ledger()


@pytest.fixture(scope="session")
def ledger() -> Ledger:
    return LEDGER


def pytest_sessionfinish(session: pytest.Session) -> None:
    # a process among several has a place for what it tells the one that started it
    if (output := getattr(session.config, "workeroutput", None)) is not None:
        output["ledger"] = LEDGER.told()


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    LEDGER.hear(getattr(node, "workeroutput", {}).get("ledger", []))


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    if LEDGER.runs:
        assert config.cache
        path = LEDGER.write(config.cache.mkdir("faults"))
        terminalreporter.section(f"faults, {path}")
        terminalreporter.write_line(LEDGER.table().to_string(index=False))


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
