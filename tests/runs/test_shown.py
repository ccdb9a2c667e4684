"""What a terminal and a file are sent of an answer."""

import io
import sys
from pathlib import Path

import pytest

from orchestrator.runs import terminal

TEXT = f"  {terminal.bold('15.0 m/s')}  12.9 … 27.6\n  ◐ Usable ▁█"


class Screen(io.StringIO):
    """A standard output that may be a terminal."""

    def __init__(self, is_terminal: bool, encoding: str) -> None:
        super().__init__()
        self._is_terminal = is_terminal
        self._name = encoding

    def isatty(self) -> bool:
        return self._is_terminal

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return self._name


@pytest.fixture
def clean(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    return monkeypatch


def test_a_terminal_alone_has_codes(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    clean.setattr(sys, "stdout", Screen(True, "utf-8"))
    assert terminal.shown(TEXT) == TEXT
    assert page.as_uri() in terminal.page_line(page)
    for name, value in (("NO_COLOR", "1"), ("TERM", "dumb")):
        with clean.context() as one:
            one.setenv(name, value)
            assert terminal.shown(TEXT) == terminal.plain(TEXT)
            assert terminal.page_line(page) == f"page: {page}"
    # an empty NO_COLOR says nothing
    clean.setenv("NO_COLOR", "")
    assert terminal.shown(TEXT) == TEXT
    clean.setattr(sys, "stdout", Screen(False, "utf-8"))
    assert "\x1b" not in terminal.shown(TEXT) + terminal.page_line(page)
    assert "15.0 m/s" in terminal.shown(TEXT)


def test_letters_that_an_output_lacks_are_written_otherwise(
    clean: pytest.MonkeyPatch,
) -> None:
    clean.setattr(sys, "stdout", Screen(False, "ascii"))
    assert terminal.shown(TEXT) == "  15.0 m/s  12.9 ... 27.6\n  [/] Usable _#"
