"""From a surface to its maps: a real flow over a coarse cone, and what is made of it."""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import rasterio

from orchestrator import guests, pipeline
from orchestrator.cli import main
from orchestrator.errors import OrchestratorError
from orchestrator.physics.constants import KARMAN
from orchestrator.stockpile import erosion
from orchestrator.surface import onset
from orchestrator.surface.heights import cone

pytestmark = pytest.mark.long

FILE = """
title = "A cone in wind from the west"
[fluid]
kind = "air"
[grain]
diameter = 5e-4
density = 2650.0
[bed]
kind = "surface"
shape = "cone"
height = 10.0
slope_deg = 26.0
[method.flow]
roughness = 0.005
[erosion]
wind = "year.csv"
"""
ROSE = "from_deg,speed_m_s,share\n270,4,0.4\n270,9,0.4\n270,16,0.2\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a cone, whose flow OpenFOAM has solved."""
    root = tmp_path_factory.mktemp("cone")
    (root / "cone.toml").write_text(FILE)
    (root / "year.csv").write_text(ROSE)
    out = root / "out"
    assert main(["study", str(root / "cone.toml"), "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def faces(folder: Path) -> pd.DataFrame:
    """The faces of the form."""
    every = pd.read_csv(folder / "tables" / "faces-1-270.csv")
    return every[every["z_m"] > 0.1]


def test_the_stress_of_a_cone_is_that_of_flow_around_a_hill(
    faces: pd.DataFrame,
) -> None:
    area = faces["area_m2"].sum()
    radius = 10.0 / np.tan(np.radians(26.0))
    slant = np.hypot(radius, 10.0)
    # smoothing widens the toe, and the lowest hundredth is the ground's
    assert area == pytest.approx(np.pi * radius * slant, rel=0.05)
    top = faces.nlargest(20, "z_m")
    lee = faces[(faces["along_m"] > 0.3 * radius) & (faces["across_m"].abs() < 3)]
    assert 1.5 < top["ustar_over_ustar0"].mean() < 3.0
    assert lee["ustar_over_ustar0"].mean() < 1.0
    # both flanks are alike
    left = faces[faces["across_m"] > 0]
    right = faces[faces["across_m"] < 0]
    mean = np.average(left["ustar_over_ustar0"], weights=left["area_m2"])
    other = np.average(right["ustar_over_ustar0"], weights=right["area_m2"])
    assert mean == pytest.approx(other, rel=0.01)


def test_each_face_moves_by_the_closed_form(folder: Path, faces: pd.DataFrame) -> None:
    study = guests.load_study(folder.parent / "cone.toml", None)
    (scene,) = study.scenes
    row = faces.iloc[len(faces) // 3]
    slope, heading = np.array([row["slope_deg"]]), np.array([row["heading_deg"]])
    local = onset.entrained(scene.grain_in_pocket, "bridged", slope, heading)[0]
    wind = onset.wind_of(local / row["ustar_over_ustar0"], 0.005)
    assert row["wind_entrained_m_s"] == pytest.approx(float(wind), rel=1e-6)
    # air is a natural fluid: motion is that of grains in sustained motion
    assert row["wind_m_s"] == row["wind_sustained_m_s"]


def test_motion_starts_where_the_answer_says(
    folder: Path, faces: pd.DataFrame, capsys: pytest.CaptureFixture[str]
) -> None:
    (row,) = pd.read_csv(folder / "tables" / "directions.csv").to_dict("records")
    first = faces.iloc[int(faces["wind_m_s"].to_numpy(float).argmin())]
    assert row["x_m"] == pytest.approx(first["x_m"])
    assert row["y_m"] == pytest.approx(first["y_m"])
    below = faces.loc[faces["wind_m_s"] <= row["starts, m/s"] + 1e-6, "area_m2"]
    assert below.sum() >= 0.01 * faces["area_m2"].sum()
    file = folder.parent / "cone.toml"
    assert main(["study", str(file), "--out", str(folder)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"in a wind of {row['starts, m/s']:.3g} m/s at 10 m from 270°" in said
    # before the sentences stands the card
    card = said.partition("Where the numbers come from: ")[0]
    assert card.startswith("At what wind does this surface start to move")
    assert "hours a year" in card
    words = " ".join(said.split())
    assert "No measured wall stress over such a bed is known to us" in words
    assert "smoothed over" in said


def test_the_hours_of_the_map_are_those_of_the_rose(folder: Path) -> None:
    hours = folder / "maps" / "1-hours_a_year.tif"
    winds = folder / "maps" / "1-wind_m_s-270.tif"
    with rasterio.open(hours) as one, rasterio.open(winds) as other:
        values, wind = one.read(1).astype(float), other.read(1).astype(float)
    is_form = np.isfinite(wind)
    by_hand = 8760 * np.select([wind <= 4, wind <= 9, wind <= 16], [1.0, 0.6, 0.2], 0.0)
    assert values[is_form] == pytest.approx(by_hand[is_form], rel=1e-6)
    assert np.isnan(values[~is_form]).all()


def test_maps_lie_where_the_surface_lies(folder: Path) -> None:
    import pyvista

    body: Any = pyvista.read(folder / "maps" / "1.vtk")
    height = body["height_m"]
    assert height.max() == pytest.approx(body.points[:, 2].max(), rel=1e-6)
    assert np.nanmax(body["ustar_over_ustar0-270"]) > 1.5
    heap = cone(10.0, 26.0)
    by_x = heap.steps[0]
    with rasterio.open(folder / "maps" / "1-ustar_over_ustar0-270.tif") as dataset:
        step, _ = dataset.res
        east, north = dataset.bounds.left, dataset.bounds.top
        values = dataset.read(1)[::-1]
    # cells are nodes of the surface, and the form lies about its middle
    assert step / by_x == pytest.approx(round(step / by_x))
    columns = np.nonzero(np.isfinite(values))[1]
    middle = east + step * (columns.mean() + 0.5)
    assert middle == pytest.approx(0.0, abs=by_x)
    assert north - step * len(values) == pytest.approx(-north, abs=step)


def test_erosion_of_a_cone_stands_beside_that_of_ap42(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = folder.parent / "cone.toml"
    # the directory of the study is not that of its erosion: the plan says so, too
    for more in (["--plan"], []):
        assert main(["erosion", str(file), "--out", str(folder), *more]) != 0
        assert "the directory holds the experiment surface" in capsys.readouterr().err
    # one beside it takes the flow that the study has solved
    out = folder.parent / "erosion"
    assert main(["erosion", str(file), "--out", str(out), "--plan"]) == 0
    plan = capsys.readouterr().out
    assert "1 case: surface 1; to run: none" in plan
    assert f"1 done in {folder}" in plan
    assert not out.exists()
    assert main(["erosion", str(file), "--out", str(out)]) == 0
    captured = capsys.readouterr()
    assert "1 case of other results taken" in captured.err
    (case,) = (folder / "cases").iterdir()
    done = out / "cases" / case.name / "done.json"
    assert done.read_bytes() == (case / "done.json").read_bytes()
    said = captured.out
    assert "g/m²" in said.partition("of dust by the solved flow, with a wind")[0]
    rows = pd.read_csv(out / "tables" / "erosion.csv")
    own = rows[rows["surface"] == "wind from 270°"]
    parts = own[own["part"] != "all"]
    assert parts["share, %"].sum() == pytest.approx(100.0)
    classes = [name for name in map(str, rows) if name.endswith("), %")]
    whole = own[own["part"] == "all"]
    assert len(classes) == len(erosion.CLASSES)
    assert whole[classes].to_numpy(float).sum() == pytest.approx(100.0)


def test_the_results_of_a_surface_are_pruned_and_stay_finished(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = folder.parent / "cone.toml"
    shutil.copytree(folder.parent, tmp_path / "moved")
    out = tmp_path / "moved" / "out"
    (flow,) = (out / "cases").iterdir()
    before = {path.name for path in flow.iterdir()}
    assert main(["prune", str(out)]) == 0
    assert "pruned: 1 cases" in capsys.readouterr().out
    gone = before - {path.name for path in flow.iterdir()}
    # OpenFOAM's last time has the large fields
    assert [name for name in gone if name.isdecimal()]
    tables = {path.name: path.read_bytes() for path in (out / "tables").iterdir()}
    assert main(["study", str(tmp_path / "moved" / file.name), "--out", str(out)]) == 0
    # no solver has made them anew
    assert not gone & {path.name for path in flow.iterdir()}
    again = {path.name: path.read_bytes() for path in (out / "tables").iterdir()}
    assert again == tables


def test_in_water_the_answer_is_a_current(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = FILE.replace('kind = "air"', 'kind = "water"').partition("[erosion]")[0]
    file, out = tmp_path / "cone.toml", tmp_path / "out"
    file.write_text(text)
    # the flow is the same: its viscosity is that of the solve
    shutil.copytree(folder / "cases", out / "cases")
    assert main(["study", str(file), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert said.startswith("At what current does this surface start to move")
    assert "current at 1 m from 270°" in said
    # the masts alone stood in a wind
    words = " ".join(said.split())
    assert words.count("wind") == words.count("wind at the masts of Askervein") > 0
    (flow,) = (out / "cases").iterdir()
    assert flow.name in {path.name for path in (folder / "cases").iterdir()}
    every = pd.read_csv(out / "tables" / "faces-1-270.csv")
    shares = pd.read_csv(out / "tables" / "shares.csv")
    assert not [name for name in (*every, *shares) if "wind" in name]
    study = guests.load_study(file, None)
    grain = study.scenes[0].grain_in_pocket
    row = every[every["z_m"] > 5].iloc[3]
    slope, heading = np.array([row["slope_deg"]]), np.array([row["heading_deg"]])
    local = onset.entrained(grain, "bridged", slope, heading)[0]
    # the law begins at 0 on the ground
    current = local / row["ustar_over_ustar0"] * np.log1p(1 / 0.005) / KARMAN
    assert row["current_entrained_m_s"] == pytest.approx(current, rel=1e-4)
    assert (out / "maps" / "1-current_m_s-270.tif").is_file()
    assert not list((out / "maps").glob("*wind*"))
    page = (out / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "current at 1 m" in page
    assert "wind at 10 m, " not in page
    assert "wind in which" not in page


def test_a_surface_without_a_flow_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "cone.toml").write_text(FILE.partition("[erosion]")[0])
    full = OrchestratorError("no space is left on the disk", "flow-1: mesh")
    monkeypatch.setattr(pipeline, "complete", lambda todo, *_, **__: {"flow-1": full})
    out = tmp_path / "out"
    code = main(["study", str(tmp_path / "cone.toml"), "--out", str(out)])
    said = capsys.readouterr().err
    assert code == full.exit_code
    assert "no space is left on the disk" in said
    assert "reference" not in said


def test_the_page_of_one_surface_names_it_on_the_card_alone(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    heads = re.findall(r'<th scope="col">(.*?)</th>', page)
    assert heads[:3] == [
        "wind from<small>°</small>",
        "starts<small>m/s</small>",
        "first at x<small>m</small>",
    ]
    # the map is narrower than the page, as it has something to show
    assert re.search(r'figures/least.svg"><img[^>]* class="part[ "]', page)
    assert "within 0.06 to 0.13 of the reference speed" in page
