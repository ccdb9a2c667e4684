"""The public Python face: what it gives is what commands and tables say."""

import math
import subprocess
import sys
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
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
    assert dir(orchestrator) == ["__version__", "open", "run", "threshold"]
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


NUMBERS: list[Any] = [np.longdouble, Decimal, Fraction]
NO_NUMBERS: list[Any] = ["x", {}, 1j, [[1.0], [1.0, 2.0]]]
BAD: list[tuple[Callable[..., object], dict[str, Any], str]] = [
    *((orchestrator.threshold, {"law": law}, "law") for law in (5, ["bridged"])),
    *((orchestrator.threshold, {"depth": bad}, "depth") for bad in NO_NUMBERS),
    (orchestrator.threshold, {"depth": []}, "without values"),
    (orchestrator.threshold, {"density": [2e3, 3e3], "slope_deg": [0, 1, 2]}, "broadcast"),
    *((orchestrator.run, {"workers": n}, "workers") for n in (math.nan, -1, 0, 1.5, "2")),
    *((orchestrator.run, {"out": out}, "out") for out in (5, "a\0b")),
    *((orchestrator.run, {"tolerance": x}, "tolerance") for x in ("x", math.nan, -1)),
]


@pytest.mark.parametrize(("function", "arguments", "name"), BAD)
def test_a_bad_argument_gets_one_clear_error(
    function: Callable[..., object], arguments: dict[str, Any], name: str
) -> None:
    first = "first-look" if function is orchestrator.run else 1e-3
    with pytest.raises(InputError, match=name):
        function(first, **arguments)


@pytest.mark.parametrize("directory", [5, None, "a\0b"])
def test_what_is_no_path_is_refused(directory: object) -> None:
    for function in (orchestrator.run, orchestrator.open):
        with pytest.raises(InputError, match="path"):
            function(directory)  # type: ignore[arg-type]


def test_numbers_of_any_type_and_numpy_settings_give_the_same() -> None:
    exact = orchestrator.threshold(1e-3, roughness=1e-4, density=2650.0)
    with np.errstate(all="raise"):
        for number in NUMBERS:
            found = orchestrator.threshold(1e-3, roughness=number("1e-4"), density=number(2650))
            pd.testing.assert_frame_equal(found, exact, rtol=1e-12)


def test_a_study_from_its_file_to_a_figure(tmp_path: Path) -> None:
    (tmp_path / "grains.toml").write_text(GRAINS)
    ran = orchestrator.run(tmp_path / "grains.toml", out=tmp_path / "out", workers=1)
    found = orchestrator.open(tmp_path / "out")
    assert ran.page == found.page
    assert ran == ran
    assert {ran, ran} == {ran}
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
