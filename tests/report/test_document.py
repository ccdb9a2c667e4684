"""The page of an experiment: all of its parts, in need of nothing else."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator.report import document, style
from orchestrator.report.document import Section
from orchestrator.report.style import Figure
from orchestrator.runs.files import Folder
from tests.report.test_page import Page

TITLE = "Speed & <accuracy>"


@pytest.fixture
def written(tmp_path: Path) -> Path:
    figures = []
    for name in ("first", "second"):
        canvas = style.canvas(1.0)
        canvas.subplots().plot([0, 1])
        figures.append(Figure(name, f"The {name}", f"What <{name}> shows.", (), canvas))
    table = pd.DataFrame({"level": ["a", "b"], "tau_c": [0.123456, np.nan], "same": [True, False]})
    sections = [
        Section("What was run", "One V_f.\n\nAnother <b>paragraph</b>.", figures[:1]),
        Section("Found", "", figures[1:], [document.sheet(table)], ["No more than <this>."]),
    ]
    document.write(TITLE, sections, Folder(tmp_path), "page.html", {"liggghts": "3.8"})
    return tmp_path / "page.html"


def test_page_holds_all_of_its_sections(written: Path) -> None:
    parsed = Page(written.read_text(encoding="utf-8"))
    assert parsed.texts["title"] == parsed.texts["h1"] == TITLE
    assert parsed.texts["h2"] == "What was runFoundBehind this page"
    assert parsed.texts["h3"] == "Figure 1. The firstFigure 2. The second"
    for said in ("Another <b>paragraph</b>.", "What <second> shows.", "No more than <this>."):
        assert said in parsed.text
    cells = parsed.texts["td"]
    assert cells.startswith("a0.1235yesb—no")
    assert "liggghts3.8" in cells
    assert "matplotlib" in cells


def test_page_needs_nothing_else(written: Path) -> None:
    html = written.read_text(encoding="utf-8")
    parsed = Page(html)
    assert [src.split(",")[0] for src in parsed.all("img", "src")] == ["data:image/png;base64"] * 2
    assert "default-src 'none'" in html
    assert not any("://" in href for href in parsed.all("a", "href"))
    files = {path.name for path in (written.parent / "figures").iterdir()}
    assert files == {"first.png", "first.svg", "second.png", "second.svg"}
