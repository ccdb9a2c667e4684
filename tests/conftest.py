"""What several tests share."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator import assets
from orchestrator.solvers import process

Deck = Callable[..., str]


@pytest.fixture
def run_check(tmp_path: Path) -> Deck:
    """Run one of the check decks with LIGGGHTS and return what it said."""
    shutil.copytree(assets.templates() / "liggghts", tmp_path / "liggghts")

    def run(deck: str, **variables: float) -> str:
        folder = tmp_path / "liggghts" / "checks"
        command = ["stdbuf", "-o0", "liggghts", "-in", deck, "-nocite", "-log", "none"]
        for name, value in variables.items():
            command += ["-var", name, repr(value)]
        log = folder / "log.check"
        ended = process.run(command, cwd=folder, log=log, limit_s=60)
        said = log.read_text()
        assert ended.returncode == 0, said
        assert "the check has ended" in said
        return said

    return run
