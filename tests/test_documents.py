"""Documents that must follow the code: the citation, and the links between pages."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from orchestrator import __version__, plan
from orchestrator.study import study

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_citation_has_the_version_of_the_package() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(r"(?m)^version: (.+)$", text).group(1) == __version__  # type: ignore[union-attr]


def test_the_index_names_every_page() -> None:
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    missing = [page.name for page in PAGES[1:] if f"({page.name})" not in index]
    assert missing == ["README.md"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    found = re.findall(r"\]\(([^)#:\s]*)(#[^)\s]*)?\)", page.read_text(encoding="utf-8"))
    for target, anchor in found:
        there = page.parent / target if target else page
        assert there.exists(), target
        if anchor:
            titles = re.findall(r"(?m)^#+ (.+)$", there.read_text(encoding="utf-8"))
            assert anchor[1:] in [slug(title) for title in titles], anchor


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


def test_the_first_picture_is_of_the_preset_that_make_study_runs() -> None:
    drawn = (ROOT / "docs" / "first-look.svg").read_text(encoding="utf-8")
    piles = plan.make(study.load("first-look")).piles.values()
    shown = max(piles, key=lambda pile: pile.scene.grain.diameter)
    grains = drawn[drawn.index('class="grains"') :].count("<circle")
    assert grains == shown.packing.mobile.sum()
    assert f"α = {shown.scene.bed.slope_deg:g}°, d = 1 mm" in drawn


def test_the_example_runs(tmp_path: Path) -> None:
    script = ROOT / "docs" / "example.py"
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    ended = subprocess.run(
        [sys.executable, script], cwd=tmp_path, env=env, capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr
    assert "One grain of 0.2 mm on 10°" in ended.stdout
    assert "<svg" in (tmp_path / "shields.svg").read_text(encoding="utf-8")


def slug(title: str) -> str:
    """The anchor that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
