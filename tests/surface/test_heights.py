"""Tests of beds in three dimensions: shapes, files, what is refused, maps as GeoTIFF."""

from math import pi, radians, tan
from pathlib import Path

import numpy as np
import pytest
import rasterio

from orchestrator.errors import InputError
from orchestrator.surface.heights import (
    Raster,
    Surface,
    barchan,
    checked,
    cone,
    oval,
)
from orchestrator.surface.raster import geotiff, read_surface
from orchestrator.types import FloatArray

EAST, NORTH = 512_000.0, 5_640_000.0
WHERE = "pile.toml: bed.surface"
CORNER = "xllcorner 0\nyllcorner 0\n"
WHOLE = (
    "ncols 9\nnrows 9\ncellsize {}\nxllcorner {}\nyllcorner 0\n" + 9 * f"{9 * '0 '}\n"
)
"""An ESRI grid of level ground."""


def hill(rows: int = 60, columns: int = 80, step: float = 0.5) -> Raster:
    """A smooth hill, 6 m high, on a rim at 100 m above the sea."""
    x = np.linspace(EAST, EAST + step * (columns - 1), columns)
    y = np.linspace(NORTH, NORTH + step * (rows - 1), rows)
    from_middle = np.hypot(x - x.mean(), (y - y.mean())[:, None])
    z = 100.0 + 6.0 * np.exp(-((from_middle / 4.0) ** 2))
    return Raster("hill.xyz", x, y, z)


def with_heights(of: Raster, z: FloatArray) -> Raster:
    return Raster(of.name, of.x, of.y, z, of.system)


def written(folder: Path, of: Raster, ending: str) -> Path:
    """The raster in a file of each kind."""
    path = folder / f"hill{ending}"
    if ending == ".tif":
        path.write_bytes(geotiff(of.x, of.y, of.z, ""))
    elif ending == ".asc":
        step = of.x[1] - of.x[0]
        head = f"ncols {len(of.x)}\nnrows {len(of.y)}\n"
        corner = f"xllcorner {float(of.x[0] - step / 2)!r}\nyllcorner {float(of.y[0] - step / 2)!r}\n"
        head += f"{corner}cellsize {float(step)!r}\nNODATA_value -9999\n"
        filled = np.where(np.isnan(of.z), -9999.0, of.z)[::-1]
        lines = [" ".join(map(repr, row)) for row in filled.tolist()]
        path.write_text(head + "\n".join(lines))
    else:
        x, y = np.meshgrid(of.x, of.y)
        points = np.column_stack([x.ravel(), y.ravel(), of.z.ravel()])
        kept = points[~np.isnan(points[:, 2])]
        np.random.default_rng(1).shuffle(kept)
        np.savetxt(path, kept, fmt="%.12g", header="x y z", comments="")
    return path


def steepest_deg(surface: Surface) -> float:
    by_y, by_x = np.gradient(surface.z, *surface.steps[::-1])
    return float(np.degrees(np.arctan(np.hypot(by_x, by_y))).max())


def test_a_cone_has_the_volume_and_the_slope_of_a_cone() -> None:
    pile = cone(11.4, 38.0)
    radius = 11.4 / tan(radians(38.0))
    assert pile.relief == pytest.approx(11.4, abs=1e-12)
    assert pile.volume == pytest.approx(pi * radius**2 * 11.4 / 3, rel=1e-3)
    assert steepest_deg(pile) == pytest.approx(38.0, abs=0.01)
    angles = np.radians(np.arange(0, 360, 15))
    for part in (0.25, 0.5, 0.75):
        east = part * radius * np.sin(angles)
        north = part * radius * np.cos(angles)
        heights = pile.at(east, north)
        assert heights == pytest.approx((1 - part) * 11.4, rel=2e-3)


def test_an_oval_has_the_volume_of_its_parts() -> None:
    height, slope, length, width = 10.0, 40.0, 30.0, 12.0
    pile = oval(height, slope, length, width)
    run = height / tan(radians(slope))
    top, foot = width / 2, width / 2 + run
    ends = pi * height / 3 * (foot**2 + foot * top + top**2)
    middle = (length - width) * height * (top + foot)
    assert pile.volume == pytest.approx(ends + middle, rel=1e-3)
    assert steepest_deg(pile) == pytest.approx(slope, abs=0.1)
    assert pile.at(0.0, length / 2 - 0.3) == pytest.approx(height, rel=1e-3)


def test_a_barchan_points_its_horns_downwind() -> None:
    dune = barchan(3.0, 10.0)
    assert dune.relief == pytest.approx(3.0, abs=1e-9)
    by_x = np.gradient(dune.z, dune.steps[0], axis=1)
    # along the middle it rises at most by its slope, and falls by that of its slip face
    middle = by_x[len(dune.y) // 2]
    assert np.degrees(np.arctan(middle.max())) == pytest.approx(10.0, abs=0.2)
    assert np.degrees(np.arctan(-middle.min())) == pytest.approx(33.0, abs=0.2)
    is_form = dune.is_form
    east_of_middle = dune.x[is_form[len(dune.y) // 2]].max()
    east_of_horns = dune.x[is_form.any(axis=0)].max()
    assert east_of_horns > east_of_middle + 3.0


def test_smoothing_keeps_volume_and_takes_the_top_down() -> None:
    pile = cone(10.0, 35.0)
    smooth = pile.smoothed(1.5)
    assert smooth.volume == pytest.approx(pile.volume, rel=1e-6)
    assert 9.0 < smooth.relief < 9.7
    assert smooth.said == ("smoothed over 1.5 m, to the cells",)
    assert smooth.at(100.0, 0.0) == 0
    # on a plane side the mean is the height itself
    assert smooth.at(7.0, 0.0) == pytest.approx(pile.at(7.0, 0.0), rel=8e-3)


def test_a_surface_is_known_by_its_heights_above_the_ground() -> None:
    one = checked(hill(), WHERE)
    higher = checked(with_heights(hill(), hill().z + 50.0), WHERE)
    wider = checked(hill(step=0.51), WHERE)
    assert one.digest == higher.digest
    assert one == higher
    assert one.digest != wider.digest


@pytest.mark.parametrize("ending", [".tif", ".asc", ".xyz", ".csv"])
def test_each_kind_of_file_gives_the_same_surface(tmp_path: Path, ending: str) -> None:
    exact = checked(hill(), WHERE)
    found = read_surface(written(tmp_path, hill(), ending), WHERE)
    assert found.x == pytest.approx(exact.x, abs=1e-6)
    assert found.y == pytest.approx(exact.y, abs=1e-6)
    # a GeoTIFF has seven digits, of a height of 100 m
    assert found.z == pytest.approx(exact.z, abs=2e-5)
    assert found.relief == pytest.approx(6.0, rel=0.01)
    assert found.centre == pytest.approx((hill().x.mean(), hill().y.mean()), abs=0.01)


def test_an_stl_file_gives_its_surface(tmp_path: Path) -> None:
    import pyvista

    of = hill()
    x, y = np.meshgrid(of.x - EAST, of.y - NORTH)
    grid = pyvista.StructuredGrid(x, y, of.z)
    surface = grid.extract_surface(algorithm="dataset_surface").triangulate()
    path = tmp_path / "hill.stl"
    surface.save(path)
    found = read_surface(path, WHERE)
    assert found.volume == pytest.approx(checked(of, WHERE).volume, rel=5e-3)
    places = np.linspace(10.0, 25.0, 20)
    exact = checked(of, WHERE).at(EAST + places, NORTH + 15.0)
    assert found.at(places, 15.0) == pytest.approx(exact, abs=0.05)


def test_a_map_as_geotiff_comes_back_to_the_bit(tmp_path: Path) -> None:
    system = rasterio.crs.CRS.from_epsg(32632)
    of = hill()
    values = of.z.astype(np.float32)
    values[3:6, 4] = np.nan
    path = tmp_path / "map.tif"
    path.write_bytes(geotiff(of.x, of.y, values, system.to_wkt()))
    with rasterio.open(path) as dataset:
        assert np.array_equal(dataset.read(1)[::-1], values, equal_nan=True)
        assert np.isnan(dataset.nodata)
        assert dataset.crs == system
        # the middle of the first cell is the north-western node
        assert dataset.xy(0, 0) == pytest.approx((of.x[0], of.y[-1]), abs=1e-6)
    values[3:6, 4] = 100.0
    path.write_bytes(geotiff(of.x, of.y, values, system.to_wkt()))
    again = read_surface(path, WHERE)
    assert again.x == pytest.approx(of.x, abs=1e-6)
    assert again.y == pytest.approx(of.y, abs=1e-6)
    # what is read from a map keeps its place on the Earth
    assert rasterio.crs.CRS.from_wkt(again.system) == system


def test_maps_without_a_place_on_the_earth_have_no_system(tmp_path: Path) -> None:
    path = tmp_path / "map.tif"
    path.write_bytes(geotiff(hill().x, hill().y, hill().z, ""))
    assert read_surface(path, WHERE).system == ""


def test_a_hole_is_refused_with_its_place() -> None:
    of = hill()
    of.z[30, 40:42] = np.nan
    with pytest.raises(InputError) as caught:
        checked(of, WHERE)
    message = str(caught.value)
    assert message.startswith(WHERE)
    assert "a hole at x = 512020 m, y = 5640015 m; 2 cells have no height" in message
    assert "gdal_fillnodata" in message


def test_cells_without_a_height_around_the_form_are_ground() -> None:
    of = hill()
    from_middle = np.hypot(of.x - of.x.mean(), (of.y - of.y.mean())[:, None])
    of.z[from_middle > 13.0] = np.nan
    found = checked(of, WHERE)
    assert np.isfinite(found.z).all()
    assert found.relief == pytest.approx(6.0, rel=0.01)
    assert "continued as level ground over" in found.said[-1]


def test_a_rim_that_is_nearly_even_is_tapered_and_said() -> None:
    of = hill()
    bend = 1.6 * ((of.x - of.x.mean()) / np.ptp(of.x)) ** 2
    found = checked(with_heights(of, of.z + bend), WHERE)
    assert "tapered to even ground at its rim" in found.said[-1]
    for edge in (found.above[0], found.above[-1], found.above.T[0], found.above.T[-1]):
        assert edge == pytest.approx(0.0, abs=1e-9)


def heaps(fall: float = 0.0, north: float = 0.0, noise: float = 0.0) -> Raster:
    """Cones of 6 and 4 m, apart from each other, on ground that falls."""
    x, y = np.arange(41.0), np.arange(49.0)
    z = np.zeros((49, 41))
    for east, along, height in ((14.0, 18.0, 6.0), (28.0, 34.0, 4.0)):
        distance = np.hypot(x - east, (y - along)[:, None])
        z = np.maximum(z, height - distance * tan(radians(30.0)))
    z += np.random.default_rng(1).normal(0.0, noise, z.shape)
    z += fall * x + north * y[:, None]
    # a file has millimetres
    return Raster("heaps.xyz", x, y, z.round(3))


def cells(surface: Surface) -> int:
    return int(surface.is_form.sum())


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("fall", [0.005, 0.01, 0.02, 0.04, 0.05, -0.03])
def test_ground_that_falls_takes_nothing_of_a_heap(fall: float, noise: float) -> None:
    level = checked(heaps(noise=noise), WHERE)
    along_x = checked(heaps(fall, noise=noise), WHERE)
    across = checked(heaps(fall / 2, -fall, noise), WHERE)
    for found in (along_x, across):
        # the plane that fits a rim follows its fall to the millimetres of the file: at
        # the foot of 30 deg these are 0.01 cells, on each of some 100 cells around it
        assert cells(found) == pytest.approx(cells(level), abs=2)
        # as far as a heap of 880 m3 on 480 m2 is higher by 1 mm
        assert found.volume == pytest.approx(level.volume, rel=2e-3)
        assert found.relief == pytest.approx(level.relief, abs=2e-3)
    size = f"{100 * abs(fall):.1f}".removesuffix("0").removesuffix(".")
    if not noise:
        towards = 270 if fall > 0 else 90
        said = f"put on level ground: its own falls by {size} % towards {towards}°, "
        assert (
            along_x.said[0] == f"{said}{abs(40 * fall):.3g} m in all, and was taken off"
        )
        assert across.ground.towards_deg == pytest.approx(
            (270 if fall > 0 else 90) + np.degrees(np.arctan(2)), abs=0.1
        )


def test_noise_of_the_ground_takes_the_lowest_ring_of_a_heap_alone() -> None:
    even = checked(heaps(), WHERE)
    rough = checked(heaps(fall=0.03, noise=0.05), WHERE)
    # four standard deviations, 0.2 m, are 0.35 m of a foot of 30 deg, and the lowest
    # hundredth of an even heap is ground, too
    lost = (
        (rough.foot - even.foot)
        / tan(radians(30.0))
        * 2
        * pi
        * (6 + 4)
        / tan(radians(30.0))
    )
    assert cells(even) - cells(rough) == pytest.approx(lost, abs=0.03 * cells(even))
    assert rough.volume == pytest.approx(even.volume, rel=5e-3)
    assert f"taken for ground below {rough.foot:.2g} m" in "; ".join(rough.said)
    assert rough.noise == pytest.approx(0.05, rel=0.2)


def test_a_ramp_at_the_rim_does_not_tilt_the_ground() -> None:
    of = heaps(fall=0.02)
    ramp = 0.8 * np.exp(-(((of.y - 30.0) / 6.0) ** 2))
    of.z[:, 0] += ramp
    of.z[:, 1] += 0.5 * ramp
    found = checked(of, WHERE)
    assert found.ground.east == pytest.approx(0.02, rel=1e-3)
    assert found.ground.north == pytest.approx(0.0, abs=2e-5)


def test_each_heap_has_its_own_height_and_base() -> None:
    first, second = checked(heaps(fall=0.02), WHERE).heaps
    foot = 0.06 / tan(radians(30.0))
    for heap, place, height in ((first, (14, 18), 6.0), (second, (28, 34), 4.0)):
        assert (heap.x, heap.y) == pytest.approx(place, abs=0.5)
        assert heap.height == pytest.approx(height, abs=2e-3)
        assert heap.radius == pytest.approx(height / tan(radians(30)) - foot, abs=1.0)


def test_heaps_that_touch_are_one_and_low_rises_are_none() -> None:
    of = heaps()
    # a saddle of 1 m between the two, and a rise of 0.5 m far from them
    along = np.clip(((of.x - 14) * 14 + (of.y[:, None] - 18) * 16) / 452, 0, 1)
    off = np.hypot(of.x - 14 - 14 * along, of.y[:, None] - 18 - 16 * along)
    saddle = np.maximum(of.z, 1.0 - 0.5 * off)
    assert len(checked(with_heights(of, saddle), WHERE).heaps) == 1
    off = np.hypot(of.x - 34, of.y[:, None] - 10)
    rise = np.maximum(of.z, 0.5 - 0.2 * off)
    found = checked(with_heights(of, rise), WHERE)
    assert len(found.heaps) == 2
    assert cells(found) > int((found.heap_numbers > 0).sum())


def test_places_belong_to_the_heap_below_them() -> None:
    found = checked(heaps(), WHERE)
    edge = 14.0 + 6 / tan(radians(30.0))
    x = np.array([14.2, 28.0, edge - 0.6, edge + 0.6, 90.0])
    y = np.array([18.0, 34.3, 18.0, 18.0, -5.0])
    assert found.heap_at(x, y).tolist() == [1, 2, 1, 0, 0]


def wall(z: FloatArray) -> FloatArray:
    """Heights of a level form with sides of 80 degrees on a raster of a hill."""
    of = hill()
    from_middle = np.hypot(of.x - of.x.mean(), (of.y - of.y.mean())[:, None])
    return np.asarray(z.min() + 12 / (1 + np.exp(2 * (from_middle - 8))))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda z: z + 2 * np.outer(*(np.linspace(0, 1, n) ** 4 for n in z.shape)),
            "its rim is not even: at x = 5120",
        ),
        (
            lambda z: z + np.linspace(-3, 3, 80),
            "its ground falls by 15 % towards 270°, by more than 8.7 %",
        ),
        (
            lambda z: (
                z + 0.45 * np.add.outer(*(np.sin(np.arange(n) / 3) for n in z.shape))
            ),
            "its rim is off a plane by 0.* it is not told from the ground",
        ),
        (lambda z: 1000 * z, "its slopes are 90 deg in the median, above 60"),
        (lambda z: 20 * (z - 100), "its slopes are 87 deg .*x, y and z all in m?"),
        (wall, "a slope of 7. deg at x = 5120.* A wall or an overhang is no bed"),
        (lambda z: np.full_like(z, 100.0), "it is 0 m higher than its rim"),
        (lambda z: 200.0 - z, "m higher than its rim, and 5.95 m deeper"),
    ],
)
def test_heights_that_are_no_bed_are_refused(change: object, message: str) -> None:
    assert callable(change)
    with pytest.raises(InputError, match=message) as caught:
        checked(with_heights(hill(), change(hill().z)), WHERE)
    assert str(caught.value).startswith(WHERE)
    assert caught.value.remedy


def test_a_height_that_is_infinite_is_no_missing_one() -> None:
    of = hill()
    of.z[0, 0] = np.inf
    with pytest.raises(InputError, match="the height at x = 512000 m, y = 5640000 m"):
        checked(of, WHERE)


def test_a_bad_cell_is_refused_with_its_place() -> None:
    of = hill()
    of.z[10, 20] += 40.0
    with pytest.raises(InputError, match="cell at x = 512010 m, y = 5640005 m is 40"):
        checked(of, WHERE)


def test_a_form_of_few_cells_is_refused() -> None:
    with pytest.raises(InputError, match="cells are above half its height"):
        checked(hill(10, 12, 3.0), WHERE)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.xyz", "x y z\n1 2 3\n1 2 q\n", "line 3"),
        ("a.xyz", "0 0 0\n", "1 points are no surface"),
        ("a.xyz", "z x q\n1 2 3\n", "line 1: the columns are z, x, q"),
        ("a.xyz", "1 2 3\ninf 2 3\n", "line 2: x or y is not a number"),
        (
            "a.asc",
            CORNER + "ncols 9.5\nnrows 9\ncellsize 1\n1 2 3\n",
            "3 numbers, not 9.5 x 9",
        ),
        ("a.asc", WHOLE.format("inf", 0), "cellsize inf"),
        ("a.asc", WHOLE.format(1, "nan"), "xllcorner nan"),
        ("a.asc", CORNER + "ncols 9\nnrows 9\n1 2\n", "cellsize is missing"),
        ("a.asc", "ncols 9\nnrows 9\nncols 8\n1 2\n", "ncols stands twice"),
        (
            "a.asc",
            CORNER + "ncols 9\nnrows 9\ncellsize 1\n1 2 x\n",
            "line 6: 'x' is no number",
        ),
        (
            "a.asc",
            CORNER + "ncols 9\nnrows 9\ncellsize 1\n1 2 3\n",
            "3 numbers, not 9 x 9",
        ),
        ("a.tif", "no picture", "GeoTIFF: it is cut off, or another kind of file"),
        ("a.stl", "no triangles", "it is no whole STL file"),
        ("a.las", "points", "'.las' is of no surface"),
    ],
)
def test_files_that_are_no_raster_are_refused(
    tmp_path: Path, name: str, content: str, message: str
) -> None:
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InputError, match=message) as caught:
        read_surface(path, WHERE)
    assert str(caught.value).startswith(WHERE)
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("vertex", "message"),
    [
        ("1 0 zz", "could not convert string to float: 'zz'"),
        ("1 0 nan", "a vertex is not a number"),
        ("1 0", "not readable"),
        ("1 0 0", "3 vertices are no surface"),
    ],
)
def test_a_damaged_text_of_stl_is_refused_in_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], vertex: str, message: str
) -> None:
    triangle = f"""solid hill
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex {vertex}
vertex 0 1 0
endloop
endfacet
endsolid hill
"""
    path = tmp_path / "hill.stl"
    path.write_text(triangle)
    with pytest.raises(InputError, match=message):
        read_surface(path, WHERE)
    # no reader of another library says anything of its own
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("is_inward", [False, True])
def test_the_sides_and_the_bottom_of_a_closed_body_are_no_bed(
    tmp_path: Path, is_inward: bool
) -> None:
    import pyvista

    of = hill()
    x, y = np.meshgrid(of.x - EAST, of.y - NORTH)
    east, north = (np.stack([part, part], axis=-1) for part in (x, y))
    heights = np.stack([0 * of.z - 100, of.z], axis=-1)
    # some programs write the normals of a body inwards
    order = slice(None, None, -1 if is_inward else 1)
    body = pyvista.StructuredGrid(east, north, heights[..., order])
    path = tmp_path / "hill.stl"
    body.extract_surface(algorithm="dataset_surface").triangulate().save(path)
    found = read_surface(path, WHERE)
    assert found.volume == pytest.approx(checked(of, WHERE).volume, rel=5e-3)
    assert found.ground.height == pytest.approx(100.0, abs=0.1)


def test_points_off_the_grid_are_refused_with_their_line(tmp_path: Path) -> None:
    path = written(tmp_path, hill(), ".xyz")
    lines = path.read_text().splitlines()
    x, y, z = lines[7].split()
    lines[7] = f"{float(x) + 0.21} {y} {z}"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match="is on no grid"):
        read_surface(path, WHERE)


def test_a_picture_is_refused(tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "hill.tif"
    Image.new("RGB", (20, 20)).save(path)
    with pytest.raises(InputError, match="a picture, not heights"):
        read_surface(path, WHERE)
