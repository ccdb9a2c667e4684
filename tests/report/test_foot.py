"""The end of a page: its date, and the variable that sets it."""

from pathlib import Path

import pytest

from orchestrator import pipeline
from orchestrator.study import study

TEXT = 'grain = { diameter = 1e-3 }\nbed.kind = "grain"\nmethod.kind = "pivot"\n'


def page(out: Path) -> bytes:
    """The page of a grain that needs no solver."""
    pipeline.run(study.parse(TEXT, name="one", where="one"), out, workers=1)
    return (out / "report.html").read_bytes()


def test_a_page_has_the_date_that_the_variable_sets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1767225600")
    first = page(tmp_path / "first")
    assert b"2026-01-01 00:00 UTC" in first
    assert page(tmp_path / "second") == first
