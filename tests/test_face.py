"""The public Python face: what it gives is what commands and tables say."""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import orchestrator
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.physics.laws import LAWS
from tests.waiting import HANGS_S


def test_three_names_are_public_and_importing_them_is_cheap() -> None:
    assert dir(orchestrator) == ["__version__", "open", "run", "threshold"]
    code = "import sys, orchestrator; sys.exit('pandas' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=HANGS_S).returncode == 0
    with pytest.raises(AttributeError, match="nothing"):
        orchestrator.nothing  # noqa: B018


HINT = """
import orchestrator
try:
    orchestrator.run("pile.toml")
except Exception as error:
    print(error)
"""


def test_a_key_of_the_bed_of_a_guest_is_explained_in_a_new_python(
    tmp_path: Path,
) -> None:
    text = "grain.diameter = 1e-3\nbed.kind = 'pile'\nflow.from_deg = 90.0\n"
    (tmp_path / "pile.toml").write_text(text)
    command = [sys.executable, "-c", HINT]
    ended = subprocess.run(
        command, cwd=tmp_path, capture_output=True, timeout=HANGS_S, check=True
    )
    assert b"flow.from_deg: beds in three dimensions alone have it" in ended.stdout


def test_thresholds_of_arrays_have_a_row_for_each_point() -> None:
    d = np.array([1e-4, 2e-4, 1e-3])
    line = orchestrator.threshold(d, slope_deg=15.0)
    assert line["d_m"].tolist() == d.tolist()
    assert set(line["law"]) == {"bridged"}
    assert line["ustar_m_s"].iloc[1] == pytest.approx(0.4259, rel=1e-3)
    grid = orchestrator.threshold(
        d[:, None], slope_deg=np.array([0.0, 15.0]), roughness="d/10"
    )
    assert len(grid) == 6
    assert grid["z0_m"].to_numpy() == pytest.approx(grid["d_m"] / 10)
    every = orchestrator.threshold(2e-4, law=None)
    assert every["law"].is_unique
    assert {*every["law"]} == {*LAWS}


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"law": "nonsense"}, "nonsense"),
        ({"depth": "x"}, "depth"),
        ({"density": "2650"}, "density"),
        ({"density": True}, "density"),
        ({"density": []}, "the arrays have no point"),
        ({"depth": [[1.0], [1.0, 2.0]]}, "depth"),
        ({"density": [2e3, 3e3], "slope_deg": [0, 1, 2]}, "broadcast"),
    ],
)
def test_a_bad_argument_gets_one_clear_error(
    arguments: dict[str, Any], name: str
) -> None:
    with pytest.raises(InputError, match=name):
        orchestrator.threshold(1e-3, **arguments)
    with pytest.warns(UserWarning, match="did you mean 0.1 mm, diameter 0.0001"):
        orchestrator.threshold(0.1, fluid="water", density=2650.0)


def test_a_study_from_its_file_to_a_figure(tmp_path: Path) -> None:
    file, out = tmp_path / "grains.toml", tmp_path / "out"
    file.write_text(
        'method.grains.load_increment = 0.05\naxes."grain.diameter" = [7e-4, 1e-3]'
    )
    with pytest.raises(InputError, match="workers"):
        orchestrator.run(file, out=out, workers=0)
    for tolerance in (-1.0, float("nan")):
        with pytest.raises(InputError, match="tolerance"):
            orchestrator.run(file, out=out, tolerance=tolerance)
    with pytest.raises(OrchestratorError):
        orchestrator.open(tmp_path)
    ran, opened = orchestrator.run(file, out=out, workers=1), orchestrator.open(out)
    assert ran.page == opened.page
    assert opened.page.is_file()
    rows = opened.thresholds
    assert rows["d_m"].tolist() == [7e-4, 1e-3]
    assert rows["usable"].all()
    assert set(opened.tables) == {"scenes", "methods", "single_grain"}
    first = [*rows][: [*rows].index("why_not") + 1]
    assert first[:3] == ["d_m", "alpha_deg", "wind_10m_m_s"]
    assert {"wind_10m_low_m_s", "wind_10m_high_m_s", "interval_of"} < {*first}
    assert len(first) < 18
    assert {"usable", "why_not", "shields_dem", "ustar0_m_s"} < {*first}
    assert rows["why_not"].isna().all()
    assert "shields" in repr(opened.plot)
    assert repr(opened.plot) in repr(opened)
    assert all(
        "Grains of 0.7 mm to 1 mm" in said
        for said in (opened.answer, opened._repr_html_())
    )
    assert repr(opened).splitlines()[1:2] == ["2 scenes; 2 of 2 thresholds are usable"]
    (name,) = set(rows["case"])
    assert opened.case(name) == opened.case("cells") == out / "cases" / name
    with pytest.raises(InputError, match="0 cases begin with"):
        opened.case("flow")
    (ax,) = opened.plot.shields().axes
    assert ax.get_xscale() == "log"


def test_numbers_with_units_are_refused_with_what_to_write() -> None:
    for text, written in {"0.25 mm": "0.00025", "0,25": "0.25"}.items():
        with pytest.raises(InputError, match=f"write {written}"):
            orchestrator.threshold(text)


def test_the_page_opens_files_as_it_says(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    root = Path(orchestrator.__file__).parent.parent
    page = (root / "docs" / "python.md").read_text("utf-8")
    (code,) = re.findall(r"```python\n(import meshio.*?)```", page, re.DOTALL)
    monkeypatch.chdir(root)
    exec(code, {})
    *_, counted, columns = capsys.readouterr().out.splitlines()
    assert int(counted.split()[0]) > 1000
    assert columns == "['material', 'ustar_m_s', 'z0_m', 'sure']"


def test_the_index_of_what_is_given_is_that_of_the_answer() -> None:
    """On a filtered or shuffled frame an assignment paired the wrong rows."""
    sand = pd.DataFrame({"d_m": [2e-4, 5e-4, 1e-3, 2e-3]}, index=[7, 3, 9, 1])
    sand["u"] = orchestrator.threshold(sand["d_m"])["ustar_m_s"]
    for size, found in zip(sand["d_m"], sand["u"], strict=True):
        assert found == orchestrator.threshold(size)["ustar_m_s"][0]
    part = sand[sand["d_m"] > 3e-4]
    # also from another parameter, from a frame, and with a row for each law
    beside = orchestrator.threshold(1e-3, roughness=part["d_m"] / 30)
    assert beside.index.tolist() == [3, 9, 1]
    assert orchestrator.threshold(part[["d_m"]]).index.tolist() == [3, 9, 1]
    laws = orchestrator.threshold(part["d_m"], law=None)
    assert laws.index.tolist() == np.repeat([3, 9, 1], laws["law"].nunique()).tolist()
    assert orchestrator.threshold(part["d_m"].to_numpy()).index.tolist() == [0, 1, 2]
    grid = orchestrator.threshold(part["d_m"], slope_deg=[[0.0], [10.0]])
    assert grid.index.tolist() == [*range(6)]
    with pytest.raises(InputError, match="roughness: its index is not that of diam"):
        orchestrator.threshold(part["d_m"], roughness=(sand["d_m"] / 30).head(3))


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: orchestrator.threshold(1e-3, law=["low", "high"]), "law: .* no name"),  # type: ignore[arg-type]
        (lambda: orchestrator.threshold(1e-3, law=5), "law: 5 is no name"),  # type: ignore[arg-type]
        (lambda: orchestrator.threshold(1e-3, fluid=["air"]), "fluid: .* no name"),  # type: ignore[arg-type]
        (lambda: orchestrator.threshold(1e-3, criterion=1), "criterion: 1 is no name"),  # type: ignore[arg-type]
        (lambda: orchestrator.run("first-look", tolerance="0.1"), "tolerance: '0.1'"),  # type: ignore[arg-type]
        (lambda: orchestrator.run("first-look", workers="2"), "workers: '2' is no"),  # type: ignore[arg-type]
        (lambda: orchestrator.run("first-look", workers=1.5), "workers: 1.5 is no"),  # type: ignore[arg-type]
        (lambda: orchestrator.run("first-look", workers=True), "workers: True is no"),
        (lambda: orchestrator.run(5), "source: 5 is no path"),  # type: ignore[arg-type]
        (lambda: orchestrator.run("first-look", out=5), "out: 5 is no path"),  # type: ignore[arg-type]
        (lambda: orchestrator.open(1), "directory: 1 is no path"),  # type: ignore[arg-type]
    ],
)
def test_arguments_of_another_type_are_refused(
    call: Callable[[], object], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        call()
