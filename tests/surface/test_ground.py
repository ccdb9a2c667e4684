"""Roughness lengths of the ground from a second raster."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

from orchestrator.errors import InputError
from orchestrator.flow.foam import BED_FLOW
from orchestrator.guests import load_study
from orchestrator.runs import case
from orchestrator.surface.case import SurfaceFlowCase
from orchestrator.surface.ground import RoughnessMap, read_roughness
from orchestrator.surface.heights import cone
from orchestrator.surface.pipeline import flow_of
from orchestrator.types import FloatArray
from tests.conftest import Shared
from tests.surface.test_case import SMALL, Flat, hill, solved, stress_of

Z0 = np.array([[0.001, 0.002, np.nan], [0.004, 0.005, 0.006]])
"""Rows from south to north; asymmetric."""


def written(path: Path, north_first: FloatArray, nodata: float = -1.0) -> Path:
    """Write a raster of 10 m cells whose south-west corner is at 100, 200."""
    rows, columns = north_first.shape
    transform = Affine(10.0, 0, 100.0, 0, -10.0, 200.0 + 10.0 * rows)
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=columns,
        height=rows,
        count=1,
        dtype="float64",
        nodata=nodata,
        crs="EPSG:25832",
        transform=transform,
    ) as dataset:
        dataset.write(np.nan_to_num(north_first, nan=nodata), 1)
    return path


def test_each_place_has_the_length_of_its_cell(tmp_path: Path) -> None:
    found = read_roughness(written(tmp_path / "z0.tif", Z0[::-1]), "z0")
    x = [100.1, 109.9, 110.1, 105.0, 125.0, 125.0, 99.0, 105.0]
    y = [200.1, 209.9, 205.0, 215.0, 219.0, 205.0, 205.0, 221.0]
    expected = [0.001, 0.001, 0.002, 0.004, 0.006, 0.03, 0.03, 0.03]
    assert found.at(x, y, 0.03).tolist() == expected


def test_the_same_lengths_at_other_places_are_another_map(tmp_path: Path) -> None:
    path = written(tmp_path / "z0.tif", Z0)
    digests = {read_roughness(path, "z0").digest}
    for east, north in ((110.0, 220.0), (100.0, 230.0)):
        with rasterio.open(path, "r+") as dataset:
            dataset.transform = Affine(10.0, 0, east, 0, -10.0, north)
        digests.add(read_roughness(path, "z0").digest)
    assert len(digests) == 3


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        (np.array([[0.01, 0.0]]), "a roughness length of 0 m"),
        (np.array([[0.01, -9999.0]]), "-9999"),
        (np.array([[0.01, 30.0]]), "a roughness length of 30 m"),
        (np.array([[np.nan, np.nan]]), "no cell has a roughness"),
    ],
)
def test_what_is_no_roughness_is_refused(
    numbers: FloatArray, said: str, tmp_path: Path
) -> None:
    path = written(tmp_path / "z0.tif", numbers)
    with pytest.raises(InputError, match=said):
        read_roughness(path, "z0")


def of_north(north: float, south: float, extent: float = 400.0) -> RoughnessMap:
    """A map with one length in the north and another in the south."""
    axis = np.linspace(-extent, extent, 201)
    z0 = np.where(axis[:, None] > 0, north, south) * np.ones(len(axis))
    return RoughnessMap("z0.tif", axis, axis, z0, "", f"{north} {south}")


def flow(ground: RoughnessMap | None, from_deg: float = 270.0) -> SurfaceFlowCase:
    surface = hill()
    return SurfaceFlowCase(
        surface, from_deg, 10.0, 0.004, 1e-5, SMALL, roughness_map=ground
    )


@pytest.mark.parametrize("from_deg", [270.0, 90.0, 0.0, 225.0])
def test_faces_have_the_lengths_of_their_places_whatever_the_wind(
    from_deg: float,
) -> None:
    one = flow(of_north(0.02, 0.001, 60.0), from_deg)
    lengths = one.ground_roughness()
    assert set(np.unique(lengths)) == {0.001, 0.004, 0.02}
    assert np.all(lengths[0] == 0.004)
    middles = one.mesh.middles[:, :, 0, :2]
    # unit vectors along and across the wind: east and north of each place
    north = middles @ one.axes[:, 1] + one.surface.centre[1]
    east = middles @ one.axes[:, 0] + one.surface.centre[0]
    inside = np.maximum(np.abs(east), np.abs(north)) < 55
    inside[0] = False
    assert np.all(lengths[inside & (north > 1)] == 0.02)
    assert np.all(lengths[inside & (north < -1)] == 0.001)


def test_the_slab_before_the_inlet_has_the_ground_of_the_approaching_flow() -> None:
    one = flow(of_north(0.02, 0.001))
    lengths = one.ground_roughness()
    assert {*lengths[0].tolist()} == {one.roughness_m}
    assert {*lengths[1].tolist()} >= {0.02, 0.001}


def test_the_wall_has_the_friction_velocity_of_each_length(tmp_path: Path) -> None:
    one = flow(of_north(0.02, 0.001))
    directory = case.prepare(one, tmp_path)
    text = (directory / "0" / "nut").read_text(encoding="utf-8")
    assert text.count("nonuniform") == 1
    assert text.index("\n    bed\n") < text.index("nonuniform") < text.index("sides\n")
    lid = text[: text.index("\n    bed\n")]
    assert "#eval{ $firstCentre/" in lid
    listed = text.split("nonuniform List<scalar>")[1].split("(")[1].split(")")[0]
    at_wall = np.array(listed.split(), float)
    centre = one.first_cell / 2
    kappa = 0.41 * (centre + 0.004) / centre
    of_wall = kappa / np.log((centre + at_wall) / at_wall)
    z0 = one.ground_roughness().ravel()
    np.testing.assert_allclose(of_wall, 0.41 / np.log((centre + z0) / z0), rtol=1e-6)


def test_a_map_is_a_part_of_the_name_of_a_case_and_none_changes_no_name() -> None:
    plain = flow(None)
    assert "roughness_map" not in plain.parameters
    names = {plain.name, *(flow(of_north(z0, 0.001)).name for z0 in (0.01, 0.02))}
    assert len(names) == 3


STUDY = """\
[fluid]
kind = "air"
[grain]
diameter = 1e-3
density = 2650.0
[bed]
kind = "surface"
shape = "cone"
height = 1.0
slope_deg = 20.0
[method.flow]
roughness = 0.001
roughness_map = "z0.tif"
"""


def test_a_study_names_a_map(tmp_path: Path) -> None:
    file = tmp_path / "cone.toml"
    file.write_text(STUDY, encoding="utf-8")
    with pytest.raises(InputError, match=r"roughness_map.*there is no such file"):
        load_study(file, None)
    written(tmp_path / "z0.tif", np.full((2, 3), 0.01))
    with pytest.raises(InputError, match=r"roughness_map.*no cell on the form"):
        load_study(file, None)
    near = Affine(1.0, 0, -5.0, 0, -1.0, 5.0)
    ids = []
    for z0 in (0.01, 0.02, 0.2):
        path = written(tmp_path / "z0.tif", np.full((10, 10), z0))
        with rasterio.open(path, "r+") as dataset:
            dataset.transform = near
        if z0 == 0.2:
            with pytest.raises(InputError, match=r"0\.2 m on a form 1 m high"):
                load_study(file, None)
            continue
        (scene,) = load_study(file, None).scenes
        ids.append(scene.id)
        ground = flow_of(scene).roughness_map
        assert ground is not None
        assert float(ground.z0.max()) == z0
        assert "z0.tif" in scene.name
    without = STUDY.replace('roughness_map = "z0.tif"\n', "")
    file.write_text(without, encoding="utf-8")
    (scene,) = load_study(file, None).scenes
    assert len({*ids, scene.id}) == 3
    assert flow_of(scene).roughness_map is None


def test_a_map_of_one_length_is_the_flow_without_a_map(shared: Shared) -> None:
    same = of_north(0.004, 0.004)
    plain = (solved(flow(None), shared) / BED_FLOW).read_bytes()
    assert (solved(flow(same), shared) / BED_FLOW).read_bytes() == plain


def stepped(upstream: float, downstream: float) -> RoughnessMap:
    """A map whose ground changes at x = -25 m, for wind from the west."""
    axis = np.linspace(-2000.0, 2000.0, 401)
    z0 = np.where(axis > -30, downstream, upstream) * np.ones(len(axis))[:, None]
    return RoughnessMap("z0.tif", axis, axis, z0, "", f"{upstream} {downstream}")


def test_the_wind_before_the_inlet_knows_nothing_of_the_ground_behind(
    shared: Shared,
) -> None:
    """The stress is of the values of nut, and not of the lengths that stand before them."""
    plain = flow(None)
    rough = replace(plain, roughness_map=stepped(0.004, 0.02))
    _, ustar0 = plain.stress(solved(plain, shared))
    _, of_rough = rough.stress(solved(rough, shared))
    assert of_rough == pytest.approx(ustar0, rel=2e-3)


@pytest.mark.parametrize(("before", "behind"), [(0.004, 0.02), (0.02, 0.004)])
def test_behind_a_step_the_stress_overshoots_and_comes_back(
    before: float, behind: float, shared: Shared
) -> None:
    """Up from smooth to rough, down from rough to smooth (Bradley 1968)."""
    flat = Flat(**vars(replace(hill(), digest="flat")))
    one = SurfaceFlowCase(
        flat,
        270.0,
        10.0,
        before,
        1e-5,
        SMALL,
        first_cell_m=0.4,
        roughness_map=stepped(before, behind),
    )
    stress = stress_of(one, shared)

    def at(near: float, far: float) -> float:
        here = (stress.along_m > near) & (stress.along_m < far)
        return float(stress.tau_along[here].mean())

    up = 1 if behind > before else -1
    assert at(-200, -60) == pytest.approx(1.0, abs=0.01)
    first, then, far = at(-25, -15), at(0, 15), at(100, 200)
    assert up * first > up * then > up * far > up * 1.0
    # the stress of ground that is equally rough everywhere, far behind
    assert abs(np.log(first)) > 1.2 * abs(np.log(far))


def test_ground_at_the_inlet_is_that_of_the_approaching_wind(tmp_path: Path) -> None:
    """The map reaches the inlet from the west with 0.01 m; from the east it does not."""
    file = tmp_path / "cone.toml"
    text = STUDY + "speed = 10.0\n[flow]\nfrom_deg = {}\n"
    path = written(tmp_path / "z0.tif", np.full((40, 60), 0.01))
    with rasterio.open(path, "r+") as dataset:
        dataset.transform = Affine(10.0, 0, -600.0, 0, -10.0, 200.0)
    file.write_text(text.format(270.0), encoding="utf-8")
    (scene,) = load_study(file, None).scenes
    with pytest.raises(InputError, match=r"from 270°.*0\.01 m.*wind 0\.001 m"):
        flow_of(scene)
    file.write_text(text.format(90.0), encoding="utf-8")
    (scene,) = load_study(file, None).scenes
    assert flow_of(scene).roughness_map is not None


@pytest.mark.long
def test_rough_ground_has_more_stress_and_shields_what_is_behind(
    shared: Shared,
) -> None:
    """The north is rougher: wind from the west has more stress there."""
    one = replace(flow(of_north(0.012, 0.004)), surface=cone(10.0, 15.0))
    stress = stress_of(one, shared)
    ahead = stress.along_m < -50
    north = stress.tau_along[ahead & (stress.y_m > 20)].mean()
    south = stress.tau_along[ahead & (stress.y_m < -20)].mean()
    assert north > 1.3 * south
    assert south == pytest.approx(1.0, abs=0.1)
