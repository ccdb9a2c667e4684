"""Tests of study files on beds in three dimensions."""

import sys
from pathlib import Path

import numpy as np
import pytest

from orchestrator import guests
from orchestrator.errors import InputError
from orchestrator.study import study as plane
from orchestrator.study.study import PLANE
from orchestrator.surface.heights import cone
from orchestrator.surface.raster import geotiff
from orchestrator.surface.study import SurfaceStudy, rose_of

FILE = """
[fluid]
kind = "air"
[grain]
diameter = 1e-3
[bed]
kind = "surface"
shape = "cone"
height = 10
slope_deg = 30
[axes]
"flow.from_deg" = [0, 90.0]
"""


def load(folder: Path, text: str) -> SurfaceStudy:
    path = folder / "pile.toml"
    path.write_text(text)
    found: SurfaceStudy = guests.load_study(path, None)
    return found


def test_a_file_is_a_scene_for_each_direction(tmp_path: Path) -> None:
    study = load(tmp_path, FILE)
    assert [scene.flow.from_deg for scene in study.scenes] == [0.0, 90.0]
    assert study.scenes[0].heights == cone(10.0, 30.0)
    # z0 is d/30 of its grains, and the fluid is air of 15 degrees
    assert study.scenes[0].solve_roughness == pytest.approx(1e-3 / 30)
    assert study.scenes[0].fluid.density == pytest.approx(1.225, abs=0.01)
    assert study.scenes[0].law == "bridged"


def test_a_raster_and_a_rose_are_read_beside_the_file(tmp_path: Path) -> None:
    heap = cone(10.0, 30.0)
    (tmp_path / "heap.tif").write_bytes(geotiff(heap.x, heap.y, heap.z, ""))
    (tmp_path / "year.csv").write_text("from_deg,speed_m_s,share\n0,5,1\n")
    text = FILE.replace('shape = "cone"\nheight = 10\nslope_deg = 30', "{}")
    text += '[erosion]\nwind = "year.csv"\n'
    study = load(tmp_path, text.format('surface = "heap.tif"'))
    assert rose_of(study) is not None
    assert study.scenes[0].heights.z == pytest.approx(heap.z, abs=1e-5)
    assert study.scenes[0].heights.said == ()
    names = {"pile.toml", "heap.tif", "year.csv"}
    assert study.source is not None
    assert set(study.source.digests) == names


GROUPS = """
[[group]]
name = "gentle"
bed.slope_deg = 20
[[group]]
name = "steep"
axes = { "grain.diameter" = [5e-4, 1e-3] }
"""


def test_surfaces_have_groups_as_every_study(tmp_path: Path) -> None:
    study = load(tmp_path, FILE + GROUPS)
    assert [group.name for group in study.groups] == ["gentle", "steep"]
    gentle, steep = study.groups
    assert {scene.bed.slope_deg for scene in gentle.scenes} == {20.0}
    # the directions are those of the top
    assert [scene.flow.from_deg for scene in gentle.scenes] == [0.0, 90.0]
    assert len(steep.scenes) == 4
    assert len(study.scenes) == 6


@pytest.mark.parametrize(
    ("of_group", "message"),
    [
        ("seeds = 3", "group 1: seeds: beds in a plane alone have it"),
        ('bed.kind = "pile"', "bed.kind: 'pile' is not accepted"),
        ("bed.slope_deg = 61", "bed.slope_deg: 61 is not accepted"),
    ],
)
def test_a_group_of_other_beds_is_refused(
    tmp_path: Path, of_group: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        load(tmp_path, f"{FILE}[[group]]\n{of_group}\n")


def test_surfaces_of_the_same_heights_are_one_scene(tmp_path: Path) -> None:
    heap = cone(10.0, 30.0)
    for name in ("one.tif", "other.tif"):
        (tmp_path / name).write_bytes(geotiff(heap.x, heap.y, heap.z, ""))
    text = FILE.replace('shape = "cone"\nheight = 10\nslope_deg = 30\n', "")
    text += '"bed.surface" = ["one.tif", "other.tif"]\n'
    with pytest.raises(InputError, match=r"axes: .* are one scene"):
        load(tmp_path, text)


def test_other_commands_refuse_a_surface() -> None:
    with pytest.raises(InputError, match="answered by study and erosion alone"):
        plane.load("cone")


def test_smoothing_of_more_cells_is_another_surface(tmp_path: Path) -> None:
    text = FILE.replace("height = 10\n", "height = 10\nsmoothing_cells = 1.5\n")
    more = load(tmp_path, text).scenes[0].heights
    usual = load(tmp_path, FILE).scenes[0].heights
    assert more.digest != usual.digest
    assert more.smoothed(1.0).relief < usual.smoothed(1.0).relief


@pytest.mark.parametrize("name", ["cone", "oval", "barchan"])
def test_the_presets_are_studies(name: str) -> None:
    study = guests.load_study(name, None)
    assert study.scenes[0].bed.shape == name
    assert study.questions == ()


@pytest.mark.parametrize("name", ["stockpile", "first-look"])
def test_other_studies_are_none_of_surfaces(name: str) -> None:
    assert guests.load_study(name, None).kind is PLANE


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("height = 10", "", "bed.height: a cone needs it"),
        ('shape = "cone"', 'shape = "pyramid"', "bed.shape: 'pyramid' is not accepted"),
        ('shape = "cone"', "", "bed.surface: give either a file or a shape"),
        ("height = 10", "height = 10\nlength = 3", "bed.length: a cone has none"),
        (
            '"flow.from_deg"',
            '"flow.to_deg"',
            r"flow.to_deg: unknown key \(did you mean from",
        ),
        ("[0, 90.0]", "[0, 400]", "flow.from_deg: 400 is not accepted"),
        ("diameter = 1e-3", "", "grain.diameter: is missing"),
        (
            "diameter = 1e-3",
            'diameter = "1 mm"',
            "grain.diameter: '1 mm' is not accepted",
        ),
        (
            "diameter = 1e-3",
            "diameter = 1e-3\ndensity = 1.0",
            r"grain.density: not above the fluid's \(raise it.*; 1 kg/m3: did you mean 1 g/cm3",
        ),
        (
            "height = 10",
            'height = 10\npacking = "aligned"',
            "bed.packing: beds in a plane alone have it",
        ),
        (
            "height = 10",
            "height = 10\nhight = 3",
            r"bed.hight: unknown key \(did you mean height",
        ),
        ("[axes]", "[axis]", r"axis: unknown key \(did you mean axes"),
        ("[0, 90.0]", "[0, 0.0]", "axes: 0 and 0.0 are one scene"),
        (
            "height = 10",
            "height = 10\nobstacles = [[-3.0, 2.0, 0.1]]",
            "bed.obstacles: a surface has no fences",
        ),
        (
            'shape = "cone"\nheight = 10\nslope_deg = 30',
            'surface = "none.tif"',
            "bed.surface: .*none.tif: there is no such file",
        ),
        ("height = 10", "height = 10\nroughness = 2.0", "method.flow.roughness: 2 m"),
        (
            "[axes]",
            '[method]\nkind = "dem"\n[axes]',
            "method.kind: beds in a plane alone have it",
        ),
        (
            "[axes]",
            '[forces]\nlaw = "paper"\n[axes]',
            "forces.law: 'paper' is no law of a surface",
        ),
        (
            "[axes]",
            '[forces]\nlaw = "briged"\n[axes]',
            "forces.law: 'briged' is not accepted",
        ),
        ("[axes]", "[threshold]\n[axes]", "threshold: beds in a plane alone have it"),
        ('"flow.from_deg"', '"from_deg"', "axes.from_deg: not a table and a field"),
        ("height = 10", 'height = 10\nroughness = "k/30"', "bed.roughness: 'k/30' is"),
        (
            "height = 10",
            "height = 10\nsurface = 3",
            r"bed.surface: 3 is not accepted \(write the name of a file",
        ),
        (
            "[axes]",
            "[erosion]\nthreshold = nan\n[axes]",
            "erosion.threshold: nan is not accepted",
        ),
        ("[axes]", "[method]\nflow = 3\n[axes]", "method.flow: 3 is not accepted"),
        (
            "diameter = 1e-3",
            "diameter = 15.0",
            "grain.diameter: 15.0 is not accepted .*; 15 m: did you mean 15 mm",
        ),
        (
            'shape = "cone"',
            'shape = "oval"\nlength = 3.0\nwidth = 5.0',
            "bed.length: it is less than the width",
        ),
        (
            "[axes]",
            '[erosion]\nwind = "none.csv"\n[axes]',
            "erosion.wind: .*none.csv: not a readable text file",
        ),
    ],
)
def test_wrong_fields_are_refused_with_their_names(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert old in FILE
    with pytest.raises(InputError, match=message) as caught:
        load(tmp_path, FILE.replace(old, new))
    assert str(caught.value).startswith(str(tmp_path / "pile.toml"))
    assert caught.value.remedy


def test_a_confirmed_unit_is_not_asked_about(tmp_path: Path) -> None:
    text = FILE.replace("[fluid]", "[forces]\nlift_coefficient = 6.5\n[fluid]")
    with pytest.warns(match="6.5: did you mean Saffman's"):
        (asked,) = load(tmp_path, text).questions
    assert asked.startswith("6.5: did you mean Saffman's")
    assert load(tmp_path, f"units_confirmed = true\n{text}").questions == ()


def test_a_hole_in_a_raster_names_file_and_field(tmp_path: Path) -> None:
    heap = cone(10.0, 30.0)
    heap.z[80, 80] = np.nan
    (tmp_path / "heap.tif").write_bytes(geotiff(heap.x, heap.y, heap.z, ""))
    shape = 'shape = "cone"\nheight = 10\nslope_deg = 30'
    with pytest.raises(InputError, match=r"bed.surface: .*heap.tif: a hole at x = "):
        load(tmp_path, FILE.replace(shape, 'surface = "heap.tif"'))


def of_file(folder: Path, scale: float, slope_deg: float = 30.0) -> str:
    """A study file on an XYZ file of a cone, which says nothing of units."""
    heap = cone(10.0, slope_deg)
    x, y = np.meshgrid(heap.x, heap.y)
    points = scale * np.column_stack([x.ravel(), y.ravel(), heap.z.ravel()])
    np.savetxt(folder / "heap.xyz", points, fmt="%.9g")
    shape = 'shape = "cone"\nheight = 10\nslope_deg = 30'
    return FILE.replace(shape, 'surface = "heap.xyz"')


def test_a_surface_that_is_likelier_in_millimetres_is_to_be_confirmed(
    tmp_path: Path,
) -> None:
    text = of_file(tmp_path, 1000.0)
    asked = r"bed.surface: heap.xyz is .* 1e\+04 m high: did you mean mm, .* 10 m high?"
    with pytest.raises(InputError, match=asked) as caught:
        load(tmp_path, text)
    assert "units_confirmed = true" in str(caught.value.remedy)
    confirmed = load(tmp_path, f"units_confirmed = true\n{text}")
    assert confirmed.scenes[0].heights.relief == pytest.approx(1e4)


def test_the_name_of_a_file_says_which_lengths_were_understood(tmp_path: Path) -> None:
    # heights of 33 ft over lengths in feet have the slopes of 10 m: nothing tells them
    scene = load(tmp_path, of_file(tmp_path, 1 / 0.3048)).scenes[0]
    width = f"{np.ptp(cone(10.0, 30.0).x) / 0.3048:.4g}"
    assert scene.name.startswith(f"heap.xyz, {width} m by {width} m, 32.81 m high")


def test_a_wind_rose_over_water_is_refused(tmp_path: Path) -> None:
    (tmp_path / "year.csv").write_text("from_deg,speed_m_s,share\n0,5,1\n")
    text = FILE.replace('"air"', '"water"') + '[erosion]\nwind = "year.csv"\n'
    with pytest.raises(InputError, match=r"erosion\.wind: the fluid is a liquid"):
        load(tmp_path, text)


def test_a_wind_that_is_likelier_in_another_unit_is_asked_about(tmp_path: Path) -> None:
    (tmp_path / "year.csv").write_text("from_deg,speed_m_s,share\n0,36,0.9\n0,0,0.1\n")
    with pytest.warns(match="did you mean km/h"):
        study = load(tmp_path, FILE + '[erosion]\nwind = "year.csv"\n')
    (asked,) = study.questions
    assert asked == (
        "the wind of year.csv is 32.4 m/s in the mean: did you mean km/h, 9 m/s?"
    )


def test_without_rasterio_a_study_is_refused_before_it_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rasterio", None)
    with pytest.raises(InputError, match=r"bed\.kind: it needs the extra \[gis\]"):
        load(tmp_path, FILE)
