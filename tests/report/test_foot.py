"""The end of a page: its date, and the variable that sets it."""

from pathlib import Path

import pytest

from orchestrator import pipeline
from orchestrator.study import study

TEXT = 'grain = { diameter = 1e-3 }\nbed.kind = "grain"\nmethod.kind = "pivot"\n'


def page(out: Path, text: str = TEXT) -> bytes:
    """The page of a grain that needs no solver."""
    pipeline.run(study.parse(text, name="one", where="one"), out, workers=1)
    return (out / "report.html").read_bytes()


def test_a_page_has_the_date_that_the_variable_sets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1767225600")
    first = page(tmp_path / "first")
    assert b"2026-01-01 00:00 UTC" in first
    assert page(tmp_path / "second") == first


def test_a_study_keeps_the_date_on_which_it_was_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1767225600")
    page(tmp_path)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1770000000")
    (tmp_path / "report.json").unlink()
    assert b"2026-01-01 00:00 UTC" in page(tmp_path)
    # another question is of the day on which it is asked
    other = page(tmp_path, TEXT.replace("1e-3", "2e-3"))
    assert b"2026-02-02 02:40 UTC" in other
    assert b"2026-01-01" not in other
