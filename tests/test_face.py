"""The public Python face: what it gives is what commands and tables say."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import orchestrator
from orchestrator import cli
from orchestrator.errors import InputError, OrchestratorError

GRAINS = """
protocol = { load_increment = 0.05 }
[axes]
"grain.diameter" = [7e-4, 1e-3]
"""


def test_three_names_are_public_and_importing_them_is_cheap() -> None:
    assert sorted(orchestrator.__all__) == ["open", "run", "threshold"]
    code = "import sys, orchestrator; sys.exit('pandas' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0
    with pytest.raises(AttributeError, match="nothing"):
        orchestrator.nothing  # noqa: B018


def test_thresholds_of_arrays_have_a_row_for_each_point() -> None:
    d = np.array([1e-4, 2e-4, 1e-3])
    one = orchestrator.threshold(d, slope_deg=15.0)
    assert one["d_m"].tolist() == d.tolist()
    assert set(one["law"]) == {"bridged"}
    assert one["ustar_m_s"].iloc[1] == pytest.approx(0.4259, rel=1e-3)
    grid = orchestrator.threshold(d[:, None], slope_deg=np.array([0.0, 15.0]), roughness="d/10")
    assert len(grid) == 6
    assert grid["z0_m"].to_numpy() == pytest.approx(grid["d_m"] / 10)
    every = orchestrator.threshold(2e-4, law=None)
    assert every["law"].is_unique
    assert len(every) > 5
    with pytest.raises(InputError, match="nonsense"):
        orchestrator.threshold(2e-4, law="nonsense")


def test_a_study_from_its_file_to_a_figure(tmp_path: Path) -> None:
    (tmp_path / "grains.toml").write_text(GRAINS)
    ran = orchestrator.run(tmp_path / "grains.toml", out=tmp_path / "out", workers=1)
    found = orchestrator.open(tmp_path / "out")
    assert ran.page == found.page
    assert found.page.is_file()
    rows = found.thresholds
    assert rows["d_m"].tolist() == [7e-4, 1e-3]
    assert rows["usable"].all()
    assert set(found.tables) == {"scenes", "single_grain"}
    assert "One grain of 0.7 mm" in found.answer
    (name,) = set(rows["case"])
    assert found.case(name) == found.case("cells") == tmp_path / "out" / "cases" / name
    with pytest.raises(InputError, match="0 cases begin with"):
        found.case("flow")
    (ax,) = found.plot.shields().axes
    assert ax.get_xscale() == "log"


def test_a_gallery_has_a_card_for_each_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("one", "two & more"):
        text = GRAINS.replace("7e-4, 1e-3", "1e-3")
        (tmp_path / "study.toml").write_text(f"title = '{name}'\n{text}")
        orchestrator.run(tmp_path / "study.toml", out=tmp_path / "all" / name, tolerance=0.1)
    (tmp_path / "all" / "no study").mkdir()
    assert cli.main(["gallery", str(tmp_path / "all")]) == 0
    page = Path(capsys.readouterr().out.splitlines()[-1])
    html = page.read_text(encoding="utf-8")
    assert html.count("<article>") == 2
    assert '<a href="two%20%26%20more/report.html">two &amp; more</a>' in html
    assert html.count("One grain of 1 mm on 0° starts to move at u* ") == 2
    assert html.count("data:image/svg+xml;base64,") == 2
    assert cli.main(["gallery", str(tmp_path / "all" / "no study")]) == 2
    assert "no study with a page" in capsys.readouterr().err


def test_what_is_no_study_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OrchestratorError):
        orchestrator.open(tmp_path)
