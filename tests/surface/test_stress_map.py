"""Maps of a bed stress over the threshold, by the command `threshold --stress`."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import rasterio
from PIL import Image
from rasterio.transform import Affine

import orchestrator
from orchestrator import cli
from orchestrator.surface.raster import opened_raster
from orchestrator.types import FloatArray

GRAIN = ["--fluid", "water", "--diameter", "1e-3", "--density", "2650"]
UTM = Affine(2.0, 0.0, 5e5, 0.0, -3.0, 5.6e6)
"""Cells of 2 m by 3 m."""
EMPTY = -9999.0
STRESS = np.array(
    [
        [0.10, 0.20, 0.30, EMPTY],
        [0.40, 0.50, 3.00, EMPTY],
        [0.60, 0.00, 0.44, 5.00],
    ]
)
"""Pa; asymmetric, so that no turn and no mirror is the same map."""


def threshold_pa() -> tuple[float, float, float]:
    """The threshold stress of the grain, and the ends of its interval."""
    row = orchestrator.threshold(1e-3, fluid="water", density=2650.0).iloc[0]
    low, high = row["stress_low_pa"], row["stress_high_pa"]
    return float(row["stress_pa"]), float(low), float(high)


def write(
    path: Path,
    stress: FloatArray = STRESS,
    *,
    crs: str | None = "EPSG:25832",
    transform: Affine = UTM,
    nodata: float | None = EMPTY,
    unit: str = "Pa",
    scale: float = 1.0,
    offset: float = 0.0,
) -> Path:
    """Write a raster of stress."""
    rows, columns = stress.shape
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=columns,
        height=rows,
        count=1,
        dtype="float32",
        crs=crs,
        transform=transform,
        nodata=nodata,
    ) as dataset:
        dataset.write(stress.astype(np.float32), 1)
        if unit:
            dataset.set_band_unit(1, unit)
        if scale != 1:
            dataset.scales = (scale,)
        if offset:
            dataset.offsets = (offset,)
    return path


def mapped(path: Path, out: Path, *words: str) -> tuple[Any, Any]:
    """The bands of the map of a raster, and its summary."""
    assert (
        cli.main(
            ["threshold", *GRAIN, "--stress", str(path), "--out", str(out), *words]
        )
        == 0
    )
    with rasterio.open(out / "stress_ratio.tif") as dataset:
        bands = dataset.read()
    return bands, pd.read_csv(out / "stress_ratio.csv").iloc[0]


def test_the_map_is_the_stress_over_the_threshold_and_its_ends(tmp_path: Path) -> None:
    path = write(tmp_path / "tau.tif")
    bands, _ = mapped(path, tmp_path / "out")
    stress = np.where(STRESS == EMPTY, np.nan, STRESS)
    middle, low, high = threshold_pa()
    for band, end in zip(bands, (middle, high, low), strict=True):
        np.testing.assert_allclose(band, stress / end, rtol=1e-6)
    with rasterio.open(tmp_path / "out" / "stress_ratio.tif") as dataset:
        assert dataset.crs.to_epsg() == 25832
        assert dataset.transform == UTM
        ends = ("tau/tau_c", "tau/tau_c, low end", "tau/tau_c, high end")
        assert dataset.descriptions == ends
        assert np.isnan(dataset.nodata)
        assert float(dataset.tags()["threshold_stress_pa"]) == pytest.approx(middle)
    with Image.open(tmp_path / "out" / "stress_ratio.png") as picture:
        assert min(picture.size) > 100


def test_the_area_above_the_threshold_has_an_interval(tmp_path: Path) -> None:
    bands, summary = mapped(write(tmp_path / "tau.tif"), tmp_path / "out")
    above = [int((band > 1).sum()) for band in bands]
    assert above[1] < above[0] < above[2]
    found = [summary[f"area_above_1{end}_m2"] for end in ("", "_low", "_high")]
    assert found == [6.0 * count for count in above]
    assert summary["area_m2"] == 60.0
    assert (summary["cells"], summary["empty_cells"]) == (12, 2)
    assert (summary["least_stress_pa"], summary["most_stress_pa"]) == (0.0, 5.0)


def test_degrees_have_the_area_of_their_latitude(tmp_path: Path) -> None:
    """A degree by a degree at 60 north is half as wide as at the equator."""
    full = np.full((1, 2), 9.0)
    areas = []
    for name, north in (("equator.tif", 0.5), ("north.tif", 60.5)):
        transform = Affine(1.0, 0.0, 8.0, 0.0, -1.0, north)
        path = write(tmp_path / name, full, crs="EPSG:4326", transform=transform)
        _, summary = mapped(path, tmp_path / f"out-{name}")
        areas.append(float(summary["area_above_1_m2"]))
    # 111.19 km by 111.19 km on the sphere, twice
    assert areas[0] == pytest.approx(2 * 111_194.9**2, rel=1e-4)
    assert areas[1] / areas[0] == pytest.approx(0.5, rel=1e-3)


def test_feet_are_feet_of_the_system(tmp_path: Path) -> None:
    path = write(tmp_path / "tau.tif", crs="EPSG:2277")  # Texas, US survey feet
    _, summary = mapped(path, tmp_path / "out")
    assert summary["area_m2"] == pytest.approx(60 * (1200 / 3937) ** 2, rel=1e-9)


@pytest.mark.parametrize(
    ("unit", "words", "pascal"),
    [
        ("psf", [], 47.88025898),
        ("", ["--stress-unit", "kPa"], 1000.0),
        ("N/m^2", [], 1.0),
        ("", ["--stress-unit", "dyn/cm2"], 0.1),
        ("lb/ft2", ["--stress-unit", "psf"], 47.88025898),
    ],
)
def test_units_are_read_in_pascal(
    unit: str, words: list[str], pascal: float, tmp_path: Path
) -> None:
    stress = np.array([[0.5, 2.0]])
    path = write(tmp_path / "tau.tif", stress / pascal, unit=unit)
    bands, summary = mapped(path, tmp_path / "out", *words)
    np.testing.assert_allclose(bands[0], stress / threshold_pa()[0], rtol=1e-6)
    assert summary["most_stress_pa"] == pytest.approx(2.0, rel=1e-6)


def test_a_file_without_a_unit_is_said_to_be_taken_as_pascal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mapped(write(tmp_path / "told.tif"), tmp_path / "a")
    printed = capsys.readouterr().out
    assert "taken as Pa" not in printed
    assert printed.startswith("Where on told.tif does a grain of ")
    mapped(write(tmp_path / "untold.tif", unit=""), tmp_path / "b")
    assert "names no unit: its numbers are taken as Pa" in capsys.readouterr().out


def test_scaled_numbers_and_empty_cells_of_other_digits_are_read(
    tmp_path: Path,
) -> None:
    stress = np.array([[5.0, -3.4028230607e38], [20.0, 5.0]])
    path = write(tmp_path / "tau.tif", stress, nodata=-3.4028234664e38, scale=0.1)
    bands, summary = mapped(path, tmp_path / "out")
    assert summary["empty_cells"] == 1
    expected = np.array([[0.5, np.nan], [2.0, 0.5]]) / threshold_pa()[0]
    np.testing.assert_allclose(bands[0], expected, rtol=1e-6)


def test_the_offset_of_scaled_numbers_is_in_pascal(tmp_path: Path) -> None:
    stored = np.array([[5.0, 20.0]])
    path = write(tmp_path / "tau.tif", stored, scale=0.1, offset=1.5)
    _, summary = mapped(path, tmp_path / "out")
    assert summary["least_stress_pa"] == pytest.approx(2.0, rel=1e-6)
    assert summary["most_stress_pa"] == pytest.approx(3.5, rel=1e-6)


def test_the_picture_has_north_at_its_top(tmp_path: Path) -> None:
    from orchestrator.surface import stress_map

    with rasterio.open(write(tmp_path / "tau.tif")) as dataset:
        ends, names = stress_map._extent(dataset)
    # left, right, bottom, top
    assert ends == (5e5, 5e5 + 8, 5.6e6 - 9, 5.6e6)
    assert names == ("x", "y (north)")


def test_an_esri_grid_is_the_same_map(tmp_path: Path) -> None:
    stress = np.tile(STRESS, (3, 2))
    lines = ["ncols 8", "nrows 9", "xllcorner 0", "yllcorner 0", "cellsize 2"]
    lines += ["NODATA_value -9999"]
    lines += [" ".join(f"{value:g}" for value in row) for row in stress]
    path = tmp_path / "tau.asc"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    bands, summary = mapped(path, tmp_path / "out")
    same, _ = mapped(write(tmp_path / "tau.tif", stress), tmp_path / "other")
    np.testing.assert_allclose(bands, same, rtol=1e-6)
    assert summary["area_m2"] == 4.0 * 60


def test_many_rows_are_read_in_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from orchestrator.surface import stress_map

    whole, at_once = mapped(write(tmp_path / "tau.tif"), tmp_path / "a")
    monkeypatch.setattr(stress_map, "CELLS_AT_ONCE", 5)
    parts, by_row = mapped(tmp_path / "tau.tif", tmp_path / "b")
    np.testing.assert_array_equal(whole, parts)
    assert at_once.equals(by_row)
    # rows of degrees have an area each
    wide = Affine(20.0, 0.0, 0.0, 0.0, -20.0, 80.0)
    path = write(tmp_path / "deg.tif", crs="EPSG:4326", transform=wide)
    _, by_row = mapped(path, tmp_path / "c")
    monkeypatch.undo()
    _, at_once = mapped(path, tmp_path / "d")
    assert at_once.equals(by_row)


@pytest.mark.parametrize(
    ("words", "given", "said"),
    [
        ([], {"nodata": None}, "-9999 in 2 cells looks like a cell without a stress"),
        ([], {"unit": "m"}, "'m' is no unit of a stress"),
        (["--stress-unit", "psf"], {}, "the file says Pa, and --stress-unit psf"),
        ([], {"stress": 1e6 * np.ones((2, 2))}, "1e+06 Pa is beyond all beds"),
        ([], {"stress": np.full((2, 2), EMPTY)}, "no cell has a stress"),
        (["--json"], {}, "--json: a map is not printed"),
        (["--slope", "0:10:2"], {}, "--slope: a map is of one grain"),
    ],
)
def test_what_is_no_map_is_refused_in_a_line(
    words: list[str],
    given: dict[str, Any],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = write(tmp_path / "tau.tif", **given)
    place = ["--stress", str(path), "--out", str(tmp_path / "out")]
    assert cli.main(["threshold", *GRAIN, *place, *words]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert message.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_bands_and_options_without_a_raster_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["threshold", *GRAIN, "--stress-unit", "Pa"]) == 2
    assert "--stress FILE" in capsys.readouterr().err
    assert cli.main(["threshold", *GRAIN, "--stress", str(tmp_path / "no.tif")]) == 2
    assert "there is no such file" in capsys.readouterr().err


def test_a_small_grid_of_stress_is_a_map(tmp_path: Path) -> None:
    """A surface asks for eight heights along each axis; a map of stress is of any size."""
    head = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
    path = tmp_path / "small.asc"
    path.write_text(f"{head}0.1 0.2 0.3\n0.4 0.5 0.6\n", encoding="utf-8")
    with opened_raster(path, "stress") as opened:
        assert opened.dataset.read(1).tolist() == [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
