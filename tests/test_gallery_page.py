"""The script of docs/gallery.md, on results that are made up."""

import importlib.util
import shutil
from pathlib import Path

import pytest
from PIL import Image

SCRIPT = Path(__file__).parents[1] / "tools" / "gallery.py"


@pytest.mark.skipif(not shutil.which("chromium"), reason="it draws by chromium")
def test_the_page_of_the_gallery_is_made_of_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = importlib.util.spec_from_file_location("gallery", SCRIPT)
    assert spec
    assert spec.loader
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    pictures = tmp_path / "docs" / "figures"
    presets = tmp_path / "orchestrator" / "study" / "presets"
    figures = tmp_path / "runs" / "first-look" / "figures"
    for folder in (pictures, presets, figures):
        folder.mkdir(parents=True)
    (presets / "first-look.toml").touch()
    red = '<rect width="300" height="200" fill="red"/>'
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 200">{red}</svg>'
    (figures / script.SHOWN["first-look"]).write_text(svg, encoding="utf-8")
    answer = "When does it move?\n\n  1 m/s  wind\n\nall rows: α = 15°\npage: /here/report.html\n"
    (tmp_path / "runs" / "first-look.txt").write_text(answer, encoding="utf-8")
    monkeypatch.setattr(script, "ROOT", tmp_path)
    monkeypatch.setattr(script, "PICTURES", pictures)
    monkeypatch.setattr(script, "SHOWN", {"first-look": script.SHOWN["first-look"]})
    script.main(tmp_path / "runs")
    page = (tmp_path / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert "## first-look" in page
    assert "When does it move?\n\n  1 m/s  wind\n```" in page
    assert "all rows" not in page
    # a card at its head leads to the section
    small = "figures/gallery-first-look-small.png"
    assert f"[![first-look]({small})](#first-look)" in page
    assert "<br>When does it move?" in page
    with Image.open(tmp_path / "docs" / small) as picture:
        assert picture.size == script.SMALL
    with Image.open(pictures / "gallery-first-look.png") as picture:
        assert picture.convert("RGB").getpixel((5, 5)) == (255, 0, 0)
