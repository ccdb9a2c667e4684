"""Files of heights are read as they stand: names, units, decimal commas, empty cells.

The heap is higher in its south-east: a mirrored, turned or shifted map is another.
"""

import io
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from numpy.typing import NDArray
from PIL import Image
from PIL.TiffImagePlugin import ImageFileDirectory_v2

from orchestrator.errors import InputError
from orchestrator.surface.heights import Surface
from orchestrator.surface.raster import geotiff, read_surface
from orchestrator.surface.raster_units import RasterUnits
from orchestrator.types import FloatArray

EAST, NORTH = 512_300.0, 5_640_800.0
WHERE = "heap.toml: bed.surface"
COLUMNS, ROWS = 44, 36
SCALE, TIE_POINT, KEYS, METADATA, NODATA = 33550, 33922, 34735, 42112, 42113
"""Tags of a GeoTIFF (OGC 19-008r4), GDAL's for its metadata and for empty cells."""
MODEL, PIXEL, SYSTEM, PROJECTED, LENGTH_UNIT, VERTICAL = (
    1024,
    1025,
    2048,
    3072,
    3076,
    4096,
)
"""Keys of a GeoTIFF: kind of the axes, what a pixel is, codes of systems, a unit."""


def heights() -> FloatArray:
    """A heap of 6 m in the south-east and a foot to the west, over cells of 1 m."""
    x, y = np.arange(COLUMNS), np.arange(ROWS)[:, None]
    high = 6.0 - 0.5 * np.hypot(x - 27, y - 14)
    low = 3.0 - 0.5 * np.hypot(x - 14, y - 18)
    return np.asarray(np.round(np.maximum(np.maximum(high, low), 0.0), 2), float)


def points(
    form: str, step: float = 1.0, east: float = EAST, north: float = NORTH
) -> str:
    """A line for each place; `form` has x, y and z."""
    lines = []
    for (row, column), z in np.ndenumerate(heights()):
        x, y = east + step * column, north + step * row
        lines.append(
            form.format(x=x, y=y, z=step * z, comma=f"{z:.2f}".replace(".", ","))
        )
    return "\n".join(lines) + "\n"


def read(folder: Path, text: str | bytes, name: str = "heap.csv") -> Surface:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_surface(path, WHERE)


def check_is_the_heap(found: Surface, step: float = 1.0) -> None:
    """That a surface is the heap, with its axes."""
    assert found.z.shape == (ROWS, COLUMNS)
    assert found.x[0] == pytest.approx(EAST, abs=1e-6)
    assert found.y[0] == pytest.approx(NORTH, abs=1e-6)
    assert found.x[-1] - found.x[0] == pytest.approx(step * (COLUMNS - 1), rel=1e-4)
    assert found.y[-1] - found.y[0] == pytest.approx(step * (ROWS - 1), rel=1e-4)
    assert found.z == pytest.approx(step * heights(), abs=1e-3)


def refused(folder: Path, text: str | bytes, name: str = "heap.csv") -> str:
    """The message for a file."""
    with pytest.raises(InputError) as caught:
        read(folder, text, name)
    message = str(caught.value)
    assert message.startswith(WHERE)
    assert "\n" not in message
    assert caught.value.remedy
    return message


@pytest.mark.parametrize(
    ("head", "form"),
    [
        ("Northing,Easting,Elevation", "{y},{x},{z}"),
        ("Hochwert;Rechtswert;Höhe", "{y};{x};{z}"),
        ("y_m,x_m,z_m", "{y},{x},{z}"),
        ("z x y", "{z} {x} {y}"),
        ("Easting (m),Northing (m),Height [m]", "{x},{y},{z}"),
        ("x [m] y [m] z [m]", "{x} {y} {z}"),
        ("Point,Northing,Easting,Elevation,Code", "A7,{y},{x},{z},ground shot"),
        ("X,Y,Z,code", "{x},{y},{z},GS"),
        ('"x"\t"y"\t"z"\t"class"', "{x}\t{y}\t{z}\t2"),
        ("# x y z", "{x} {y} {z}"),
        ("#x y z", "{x} {y} {z}"),
        ("# x y z", "{x} {y} {z} GS wet"),
        ("//X Y Z", "{x} {y} {z}"),
        ("# north,east,level", "{y}, {x}, {z}"),
        ("# Heap of sand, as measured\n# x y z", "{x} {y} {z}"),
        ("x y z\nm m m", "{x} {y} {z}"),
        ("", "{x} {y} {z} 12"),
        ("", "{x};{y};{z};GS"),
        ("", "{x} {y} {z} GS"),
        ("", "{x}, {y}, {z}"),
    ],
)
def test_columns_are_read_by_their_names(tmp_path: Path, head: str, form: str) -> None:
    check_is_the_heap(read(tmp_path, f"{head}\n{points(form)}".lstrip("\n")))


@pytest.mark.parametrize(
    ("head", "form", "message"),
    [
        ("lat,lon,height", "{y},{x},{z}", "line 1: lat and lon are degrees"),
        ("x_ft,y_ft,z", "{x},{y},{z}", r"line 1: x_ft is in ft, and z names no unit"),
        ("x,y,z_mm", "{x},{y},{z}", r"z_mm is in mm, and x names no unit .*: x \(m\)"),
        ("# in feet\nx,y,z", "{x},{y},{z}", "line 2: a line above speaks of feet"),
        ("# in feet", "{x},{y},{z}", "line 2: a line above speaks of feet"),
        ("easting,northing,x,z", "{x},{y},1,{z}", "line 1: .*x: easting or x"),
        (
            "a,b,c",
            "{x},{y},{z}",
            "line 1: the columns are a, b, c.*name them x, y and z",
        ),
        ("x,y,height_of_plant", "{x},{y},{z}", "name them x, y and z"),
        ("x y z", "{x} {y} {z} 25", "line 2: 4 cells, the head has 3"),
        ("y,x,z,code", "{y},{x}", "line 2: .* is no point"),
        (
            "@File: 4\n# a comment\nEOD",
            "A1 {x} {y} {z}",
            "line 1: '@File: 4' is no point",
        ),
        ("Heap of sand", "{x} {y} {z}", "line 1: the columns are Heap, of, sand"),
        # geodesists call the northing x
        ("x,y,z", "{y},{x},{z}", "northing before easting"),
        ("", "{y} {x} {z}", "northing before easting"),
    ],
)
def test_columns_that_may_be_others_are_refused(
    tmp_path: Path, head: str, form: str, message: str
) -> None:
    text = f"{head}\n{points(form)}".lstrip("\n")
    with pytest.raises(InputError, match=message):
        read(tmp_path, text)
    refused(tmp_path, text)


HEADS = ["", "x;y;z\n", "x y z\n", "x,y,z\n", "x\ty\tz\n"]


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize(
    "form",
    [
        "{x:.0f};{y:.0f};{comma}",
        "{x:.0f} {y:.0f} {comma}",
        "{x:.0f}\t{y:.0f}\t{comma}",
        "{x:.0f},00;{y:.0f},00;{comma}",
    ],
)
def test_decimal_commas_are_read_where_nothing_else_has_a_comma(
    tmp_path: Path, head: str, form: str
) -> None:
    found = read(tmp_path, head + points(form))
    check_is_the_heap(found)
    assert "decimal commas" in found.understood


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize(
    "form", ["{x:.0f},{y:.0f},{comma}", "{x:.0f},50,{y:.0f},50,{comma}"]
)
def test_decimal_commas_between_commas_are_refused(
    tmp_path: Path, head: str, form: str
) -> None:
    message = refused(tmp_path, head + points(form))
    assert "line " in message
    assert "decimal comma" in message or "decimal point" in message


WRITTEN = {
    "quoted commas": ('"{x:.0f}","{y:.0f}","{comma}"', "decimal commas"),
    "Swiss thousands": ("512'{column:03.0f};5'640'{row:03.0f};{z:.2f}", ""),
    "points of thousands": (
        "512.{column:03.0f};5.640.{row:03.0f};{comma}",
        "decimal commas and points that mark thousands",
    ),
    "commas of thousands": (
        '"512,{column:03.0f}","5,640,{row:03.0f}",{z:.2f}',
        "commas that mark thousands",
    ),
    "thin blanks": ("512\u202f{column:03.0f};5\u202f640\u202f{row:03.0f};{z:.2f}", ""),
    "a code with a point": ("{x:.0f};{y:.0f};{comma};G.1", "decimal commas"),
    "a code with a comma": ("{x:.0f};{y:.0f};{comma};wet, soft", "decimal commas"),
    "commas and a point in one column": ("{x:.1f};{y:.1f};{z:.2f}", ""),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_numbers_are_read_as_they_are_written(tmp_path: Path, name: str) -> None:
    form, said = WRITTEN[name]
    lines = []
    for (row, column), z in np.ndenumerate(heights()):
        cells = {"x": EAST + column, "y": NORTH + row, "z": z}
        cells |= {"column": 300 + column, "row": 800 + row}
        lines.append(form.format(comma=f"{z:.2f}".replace(".", ","), **cells))
    found = read(tmp_path, "x;y;z\n" + "\n".join(lines) + "\n")
    check_is_the_heap(found)
    assert said in found.understood


@pytest.mark.parametrize(
    ("form", "message"),
    [
        ("{x:.0f};{y:.0f};{z:.3f}", r"'\d,\d{3}' may be"),
        (
            "{x:.1f};{y:.1f};{z:.2f}",
            r"line \d+: .* has a point, other cells commas|both",
        ),
    ],
)
def test_commas_that_may_mean_two_things_are_asked_about(
    tmp_path: Path, form: str, message: str
) -> None:
    text = "x;y;z\n" + points(form)
    if ".0f" in form:
        # 1,250 m of a survey in millimetres or a height of 1.250 m: none begins with 0
        text = text.replace(";0.", ";1.").replace(".", ",")
    else:
        text = text.replace(";0.00\n", ";0,00\n")
    with pytest.raises(InputError, match=message):
        read(tmp_path, text)
    refused(tmp_path, text)


@pytest.mark.parametrize(
    ("head", "form", "said"),
    [
        ("E;N;RL (m AHD)", "", ""),
        ("Easting,Northing,Elevation (m NAP)", "{x},{y},{z}", "levels above NAP"),
        ("POINT_X,POINT_Y,Level (mAOD)", "{x},{y},{z}", "levels above AOD"),
        ("Rechtswert;Hochwert;m ü. NHN", "{x};{y};{z}", "levels above NHN"),
        ("East North RL", "{x} {y} {z}", "heights from 'RL'"),
        ("x_coord,y_coord,bed_level", "{x},{y},{z}", "heights from 'bed_level'"),
        ("", "{x} {y} {z}", "its first three columns are x, y and z"),
    ],
)
def test_the_answer_says_what_was_understood(
    tmp_path: Path, head: str, form: str, said: str
) -> None:
    if not form:
        message = refused(tmp_path, f"{head}\n{points('{x};{y};{z}')}")
        # the names that are known stand in the refusal
        assert "easting" in message
        assert "hochwert" in message
        assert "elevation" in message
        return
    found = read(tmp_path, f"{head}\n{points(form)}".lstrip("\n"))
    check_is_the_heap(found)
    assert said in found.understood
    assert "44 x 36 heights, 1 m by 1 m apart; x 512300 to 512343 m" in found.understood
    assert "heights 0 to 6 m; no cell without a height" in found.understood


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("Station,Offset,Elevation", "along a line, not on a map"),
        ("Easting,Northing,Depth", "depths go down"),
    ],
)
def test_columns_that_are_no_places_and_heights_are_refused(
    tmp_path: Path, head: str, message: str
) -> None:
    assert message in refused(tmp_path, f"{head}\n{points('{x},{y},{z}')}")


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "cp1252"])
@pytest.mark.parametrize("name", ["heap.csv", "heap.txt"])
def test_texts_of_other_encodings_are_read(
    tmp_path: Path, encoding: str, name: str
) -> None:
    text = "Rechtswert;Hochwert;Höhe\r\n" + points("{x};{y};{z}").replace("\n", "\r\n")
    check_is_the_heap(read(tmp_path, text.encode(encoding), name))


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        (b"PK\x03\x04" + bytes(40), "heap.csv", "a workbook of a spreadsheet"),
        (b"\x1f\x8b" + bytes(40), "heap.xyz", "it is compressed .unpack"),
        (b"LASF", "heap.las", "the ending '.las' is of no surface .a cloud of points"),
        (b"\x89HDF", "heap.grd", "gdal_translate makes a .tif of it"),
    ],
)
def test_files_that_are_no_texts_are_refused_for_what_they_are(
    tmp_path: Path, content: bytes, name: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read(tmp_path, content, name)
    refused(tmp_path, content, name)


def test_a_text_is_what_it_holds_whatever_its_ending(tmp_path: Path) -> None:
    check_is_the_heap(read(tmp_path, points("{x} {y} {z}"), "points.asc"))
    check_is_the_heap(read(tmp_path, grid("cellsize 1\n"), "grid.txt"))
    check_is_the_heap(read(tmp_path, grid("cellsize 1\n"), "grid.xyz"))


def test_a_foot_behind_the_points_is_refused_with_its_line(tmp_path: Path) -> None:
    text = "@File_Version: 4\n" + points("{x} {y} {z}") + "EOD\n"
    message = refused(tmp_path, text)
    assert f"line {COLUMNS * ROWS + 2}: 'EOD' is no point" in message


def test_one_line_with_a_decimal_comma_is_refused(tmp_path: Path) -> None:
    # a whole height has no comma
    lines = ("x,y,z\n" + points("{x:.0f},{y:.0f},{z:.0f}")).splitlines()
    lines[700] += ",25"
    message = refused(tmp_path, "\n".join(lines))
    assert "line 701: 4 cells, the head has 3: a decimal comma?" in message


def test_cells_of_a_foot_in_millimetres_are_on_a_grid(tmp_path: Path) -> None:
    found = read(tmp_path, "x y z\n" + points("{x:.3f} {y:.3f} {z:.4f}", 0.3048))
    assert found.steps == pytest.approx((0.3048, 0.3048), rel=1e-4)
    check_is_the_heap(found, 0.3048)


def tif(
    values: NDArray[Any],
    keys: dict[int, int] | None = None,
    half: float = 0.5,
    **items: str | float,
) -> bytes:
    """A GeoTIFF with keys and with items of GDAL's metadata, written tag by tag."""
    directory = ImageFileDirectory_v2()
    corner = (EAST - half, NORTH + ROWS - 1 + half)
    types = {SCALE: 12, TIE_POINT: 12, KEYS: 3, METADATA: 2, NODATA: 2}
    tags: dict[int, Any] = {
        SCALE: (1.0, 1.0, 0.0),
        TIE_POINT: (0.0, 0.0, 0.0, *corner, 0.0),
    }
    if keys:
        entries = [part for key in sorted(keys) for part in (key, 0, 1, keys[key])]
        tags[KEYS] = (1, 1, 0, len(keys), *entries)
    if items:
        listed = [
            f'<Item name="{role.upper()}" sample="0" role="{role}">{value}</Item>'
            for role, value in items.items()
        ]
        tags[METADATA] = f"<GDALMetadata>{''.join(listed)}</GDALMetadata>\n"
        tags[NODATA] = "-32768"
    for tag, value in tags.items():
        directory.tagtype[tag] = types[tag]
        directory[tag] = value
    stream = io.BytesIO()
    image = Image.fromarray(np.ascontiguousarray(values[::-1]))
    image.save(stream, "TIFF", tiffinfo=directory)
    return stream.getvalue()


@pytest.mark.parametrize(("scale", "offset"), [(0.1, 0.0), (0.01, 0.0), (0.01, 120.0)])
def test_scale_and_offset_of_a_geotiff_are_applied(
    tmp_path: Path, scale: float, offset: float
) -> None:
    rounded = np.round(heights() / scale) * scale
    stored = np.round(heights() / scale).astype(np.int16)
    stored[0, :3] = -32768  # beyond the rim, before it is scaled
    found = read(tmp_path, tif(stored, scale=scale, offset=offset), "heap.tif")
    assert found.z - offset == pytest.approx(rounded, abs=1e-6)
    assert "continued as level ground over 3 cells" in found.said[-1]


def test_packed_heights_use_all_numbers_of_their_type(tmp_path: Path) -> None:
    # 3 m are 0: the ground is far below 0, and no cell is empty
    stored = np.round((heights() - 3) / 1e-4).astype(np.int16)
    assert stored.min() < -29_000
    found = read(tmp_path, tif(stored, scale=1e-4, offset=3.0), "heap.tif")
    assert found.z == pytest.approx(heights(), abs=1e-4)


@pytest.mark.parametrize(
    ("items", "message"),
    [
        ({"unittype": "fathom"}, "its heights are in fathom, of unknown length"),
        ({"scale": "0"}, "its scale is 0"),
        ({"offset": "nan"}, "its offset nan"),
    ],
)
def test_metadata_in_which_no_length_stands_is_refused(
    tmp_path: Path, items: dict[str, str], message: str
) -> None:
    content = tif(heights().astype(np.float32), None, 0.5, **items)
    assert message in refused(tmp_path, content, "heap.tif")


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("ft", 0.3048), ("US survey foot", 1200 / 3937), ("cm", 0.01), ("feet", 0.3048)],
)
def test_the_unit_of_a_band_is_applied_and_said(
    tmp_path: Path, unit: str, metres: float
) -> None:
    content = tif((heights() / metres).astype(np.float32), unittype=unit)
    found = read(tmp_path, content, "heap.tif")
    assert found.z == pytest.approx(heights(), abs=1e-4)
    assert (found.x[0], found.y[0]) == (EAST, NORTH)
    assert f"heights in {unit.lower()} (1 " in found.understood


@pytest.mark.parametrize(
    ("head", "form"),
    [
        ("x_ft,y_ft,z_ft", "{x},{y},{z}"),
        ("x y z\nft ft ft", "{x} {y} {z}"),
        ("# Units: ft\n# x y z", "{x} {y} {z}"),
        ("# all coordinates in feet", "{x} {y} {z}"),
        ("Northing (ft),Easting (ft),Elevation (NAVD88 ft)", "{y},{x},{z}"),
    ],
)
def test_points_in_feet_become_metres(tmp_path: Path, head: str, form: str) -> None:
    text = f"{head}\n{points(form)}"
    found = read(tmp_path, text)
    assert found.z == pytest.approx(0.3048 * heights(), abs=1e-9)
    assert found.x[0] == pytest.approx(0.3048 * EAST)
    assert found.y[-1] == pytest.approx(0.3048 * (NORTH + ROWS - 1))
    assert "(1 f" in found.understood
    assert "= 0.3048 m)" in found.understood
    # a mark of empty cells is a number of the file
    said = refused(
        tmp_path, text.replace(",0.0\n", ",-9999\n", 1).replace(" 0.0\n", " -9999\n", 1)
    )
    assert "-9999 in 1 cell looks like a cell without a height" in said


@pytest.mark.parametrize("cell", ["", "NA", "nan", "null", "-"])
def test_a_place_without_a_height_is_one(tmp_path: Path, cell: str) -> None:
    text = "x,y,z\n" + points("{x},{y},{z}").replace(",0.0\n", f",{cell}\n", 2)
    found = read(tmp_path, text)
    check_is_the_heap(found)
    assert "2 cells without a height" in found.understood
    assert "continued as level ground over 2 cells" in found.said[-1]


def test_comments_above_a_grid_are_no_keys(tmp_path: Path) -> None:
    text = "# Höhen in m\n" + grid("cellsize 1\n")
    check_is_the_heap(read(tmp_path, text.encode("cp1252"), "heap.asc"))
    check_is_the_heap(read(tmp_path, text, "heap.txt"))


def test_columns_of_points_may_differ_in_their_units(tmp_path: Path) -> None:
    found = read(tmp_path, "x_m,y_m,z_mm\n" + points("{x},{y},{z}"))
    assert found.z == pytest.approx(1e-3 * heights(), abs=1e-9)
    assert "x in m, y in m, z in mm (1 mm = 0.001 m)" in found.understood


def test_metres_of_gdals_metadata_are_metres(tmp_path: Path) -> None:
    content = tif(heights().astype(np.float32), unittype="metre")
    check_is_the_heap(read(tmp_path, content, "heap.tif"))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({PROJECTED: 2277}, "axes are in US survey foot by EPSG:2277, and nothing"),
        ({PROJECTED: 6494}, "axes are in foot by EPSG:6494, and nothing says"),
        ({PROJECTED: 22300}, "axes are in kilometre by EPSG:22300, and nothing"),
    ],
)
def test_a_system_in_another_unit_says_nothing_of_heights(
    tmp_path: Path, keys: dict[int, int], message: str
) -> None:
    content = tif(heights().astype(np.float32), {MODEL: 1, **keys})
    said = refused(tmp_path, content, "heap.tif")
    assert message in said
    assert "gdal_edit -units ft, or m" in said


@pytest.mark.parametrize(
    ("keys", "unit", "axes", "up"),
    [
        ({PROJECTED: 2277}, "US survey foot", 1200 / 3937, 1200 / 3937),
        ({PROJECTED: 6494}, "m", 0.3048, 1.0),
        ({PROJECTED: 22300}, "m", 1000.0, 1.0),
        ({PROJECTED: 32632, VERTICAL: 6360}, "", 1.0, 1200 / 3937),
        ({PROJECTED: 2277, VERTICAL: 6360}, "", 1200 / 3937, 1200 / 3937),
    ],
)
def test_units_of_a_coordinate_system_are_applied(
    tmp_path: Path, keys: dict[int, int], unit: str, axes: float, up: float
) -> None:
    items: dict[str, str | float] = {"unittype": unit} if unit else {}
    values = (heights() * axes / up).astype(np.float32)
    content = tif(values, {MODEL: 1, **keys}, 0.5, **items)
    found = read(tmp_path, content, "heap.tif")
    assert found.z == pytest.approx(axes * heights(), rel=1e-5)
    assert found.x[0] == pytest.approx(axes * EAST)
    assert found.y[0] == pytest.approx(axes * NORTH)
    # a map of it lies where the raster lies, in the unit of its system
    with (
        rasterio.MemoryFile(geotiff(found.x, found.y, found.z, found.system)) as memory,
        memory.open() as dataset,
    ):
        assert dataset.crs.to_wkt() == found.system
        corner = (dataset.bounds.left, dataset.bounds.top)
    assert corner == pytest.approx((EAST - 0.5, NORTH + ROWS - 0.5), abs=1e-3)


def test_a_band_that_contradicts_its_system_is_asked_about() -> None:
    units = RasterUnits("EPSG:32632+6360", 1.0, "metre", "us survey foot")
    with pytest.raises(InputError, match=r"in m, by EPSG:32632\+6360 in us survey"):
        units.with_band("m", WHERE)
    assert units.with_band("US survey foot", WHERE) == units


@pytest.mark.parametrize("code", [32632, 25832, 2056, 2154, 6493, 27700, 5514, 3857])
def test_a_coordinate_system_in_metres_needs_no_key_of_its_unit(
    tmp_path: Path, code: int
) -> None:
    keys = {MODEL: 1, PROJECTED: code, VERTICAL: 7837}
    content = tif(heights().astype(np.float32), keys)
    found = read(tmp_path, content, "heap.tif")
    check_is_the_heap(found)
    assert rasterio.crs.CRS.from_wkt(found.system).to_epsg() == code


@pytest.mark.parametrize(
    "compress", ["none", "lzw", "deflate", "zstd", "lzma", "packbits"]
)
@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("predictor", [1, 3])
def test_each_compression_is_read_in_tiles(
    tmp_path: Path, compress: str, dtype: str, predictor: int
) -> None:
    path = tmp_path / "heap.tif"
    profile = {
        "driver": "GTiff",
        "count": 1,
        "dtype": dtype,
        "width": COLUMNS,
        "height": ROWS,
        "transform": rasterio.Affine(1, 0, EAST - 0.5, 0, -1, NORTH + ROWS - 0.5),
        "tiled": True,
        "blockxsize": 16,
        "blockysize": 16,
        "compress": compress,
    }
    if compress in ("lzw", "deflate", "zstd"):
        profile["predictor"] = predictor
    with rasterio.open(path, "w", **profile) as dataset:
        dataset.write(heights()[::-1].astype(dtype), 1)
    found = read_surface(path, WHERE)
    check_is_the_heap(found)
    if dtype == "float64":
        assert (found.z == heights()).all()


@pytest.mark.parametrize("empty", [-3.4028234663852886e38, -9999.0, 1e30, np.nan])
@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_declared_empty_cells_of_a_geotiff_have_no_height(
    tmp_path: Path, empty: float, dtype: str
) -> None:
    path = tmp_path / "heap.tif"
    values = heights().astype(dtype)
    values[-1, :3] = empty
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        count=1,
        dtype=dtype,
        width=COLUMNS,
        height=ROWS,
        transform=rasterio.Affine(1, 0, EAST - 0.5, 0, -1, NORTH + ROWS - 0.5),
        nodata=empty,
    ) as dataset:
        dataset.write(values[::-1], 1)
    found = read_surface(path, WHERE)
    check_is_the_heap(found)
    assert "continued as level ground over 3 cells" in found.said[-1]


def grid(head: str, empty: str = "", change: Callable[[str], str] = str) -> str:
    """An ESRI grid whose first three cells of the northernmost row have no height."""
    rows = [[f"{z:.2f}" for z in row] for row in heights()[::-1]]
    if empty:
        rows[0][:3] = [empty] * 3
    body = "\n".join(" ".join(row) for row in rows)
    corner = f"xllcenter {EAST}\nyllcenter {NORTH}\n"
    return change(f"ncols {COLUMNS}\nnrows {ROWS}\n{corner}{head}{body}\n")


@pytest.mark.parametrize(
    ("mark", "empty"),
    [
        ("-9999", "-9999.000"),
        ("-3.4028230607370965254e+38", "-3.402823e+38"),
        ("null", "null"),
        ("nan", "nan"),
        ("1.70141e+38", "1.701410009187828e+38"),
    ],
)
def test_empty_cells_of_a_grid_are_those_of_its_mark(
    tmp_path: Path, mark: str, empty: str
) -> None:
    text = grid(f"cellsize 1\nNODATA_value {mark}\n", empty)
    found = read(tmp_path, text, "heap.asc")
    check_is_the_heap(found)
    assert "continued as level ground over 3 cells" in found.said[-1]


@pytest.mark.parametrize(
    "head", ["cell_size 1\n", "xdim 1\nydim 1\n", "CELLSIZE: 1\n", "cellsize = 1\n",
             "cellsize_x 1\ncellsize_y 1\n", "cellsize\t1\nnodata -9999\n"]
)  # fmt: skip
def test_other_names_for_the_keys_of_a_grid_are_known(
    tmp_path: Path, head: str
) -> None:
    check_is_the_heap(read(tmp_path, grid(head), "heap.asc"))


def test_a_grid_of_grass_is_read_by_its_edges(tmp_path: Path) -> None:
    body = grid("cellsize 1\n", "*").split("cellsize 1\n")[1]
    head = (
        f"north: {NORTH + ROWS - 0.5}\nsouth: {NORTH - 0.5}\neast: {EAST + COLUMNS - 0.5}\n"
        f"west: {EAST - 0.5}\nrows: {ROWS}\ncols: {COLUMNS}\n"
    )
    found = read(tmp_path, head + body, "heap.asc")
    check_is_the_heap(found)
    assert "* in empty cells; no coordinate system" in found.understood
    assert "3 cells without a height" in found.understood
    said = refused(tmp_path, head.replace("north", "south", 1) + body, "heap.asc")
    assert "south stands twice" in said


def test_a_grid_with_decimal_commas_is_read(tmp_path: Path) -> None:
    text = grid("cellsize 1\nNODATA_value -9999\n", "-9999").replace(".", ",")
    found = read(tmp_path, text, "heap.asc")
    check_is_the_heap(found)
    assert "decimal commas" in found.understood
    assert "-9999 in empty cells;" in found.understood


@pytest.mark.parametrize("head", ["", "NODATA_value -9999\n"])
@pytest.mark.parametrize("word", ["NA", "nan", "null", "*"])
def test_words_in_empty_cells_need_no_declaration(
    tmp_path: Path, head: str, word: str
) -> None:
    found = read(tmp_path, grid(f"cellsize 1\n{head}", word), "heap.asc")
    check_is_the_heap(found)
    assert f", and {word};" in found.understood
    assert "3 cells without a height" in found.understood


@pytest.mark.parametrize(
    ("mark", "count"),
    [(-99.0, 1), (999.0, 1), (9999.0, 2), (-999.0, 1), (32767.0, 1), (-500.0, 3)],
)
def test_a_number_far_off_all_others_is_asked_about(
    tmp_path: Path, mark: float, count: int
) -> None:
    values = heights()
    values[-1, :count] = mark
    rows = [" ".join(f"{z:.2f}" for z in row) for row in values[::-1]]
    head = grid("cellsize 1\n").split("0.00")[0]
    said = refused(tmp_path, head + "\n".join(rows) + "\n", "heap.asc")
    cells = "1 cell" if count == 1 else f"{count} cells"
    assert f"{mark:g} in {cells} looks like a cell without a height" in said
    assert f"NODATA_value {mark:g}" in said


def test_a_plain_at_another_level_is_no_empty_cell(tmp_path: Path) -> None:
    """A heap on ground at 0 m, whose lowest face is far above it, as coarse cells are."""
    values = np.zeros((12, 12))
    values[4:8, 4:8] = 3.0
    values[5:7, 5:7] = 4.0
    lines = [
        f"{2.5 * column} {2.5 * row} {z}" for (row, column), z in np.ndenumerate(values)
    ]
    found = read(tmp_path, "\n".join(lines) + "\n")
    assert found.relief == 4.0


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("cellsize 1\ndy 2\n", "cellsize and dy .*leave one of the two"),
        ("cellsize 1\nxllcorner 3\n", "xllcorner and xllcenter .*leave one"),
        ("dx 1\n", "cellsize is missing"),
        ("cellsize 1\nxllmiddle 3\n", "xllmiddle is no key of a grid"),
    ],
)
def test_a_head_that_contradicts_itself_is_refused(
    tmp_path: Path, head: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read(tmp_path, grid(head), "heap.asc")
    refused(tmp_path, grid(head), "heap.asc")


@pytest.mark.parametrize("missing", ["ncols", "nrows", "xllcenter", "yllcenter"])
def test_a_head_that_is_not_whole_is_refused(tmp_path: Path, missing: str) -> None:
    lines = grid("cellsize 1\n").splitlines()
    text = "\n".join(line for line in lines if not line.startswith(missing))
    said = refused(tmp_path, text, "heap.asc")
    assert f"{missing.replace('center', 'corner')} is missing" in said


def test_cells_of_a_grid_may_have_a_step_along_each_axis(tmp_path: Path) -> None:
    found = read(tmp_path, grid("dx 1\ndy 2\n"), "heap.asc")
    assert found.steps == pytest.approx((1.0, 2.0))
    assert (found.x[0], found.y[0]) == (EAST, NORTH)
    assert found.z == pytest.approx(heights())


def test_a_grid_without_a_number_of_empty_cells_has_the_formats(tmp_path: Path) -> None:
    found = read(tmp_path, grid("cellsize 1\n", "-9999"), "heap.asc")
    assert "lengths taken for m; 44 x 36 heights" in found.understood
    check_is_the_heap(found)
    assert "continued as level ground over 3 cells" in found.said[-1]


def test_a_mark_of_the_encoding_is_no_part_of_a_grid(tmp_path: Path) -> None:
    text = "\ufeff" + grid("cellsize 1\n")
    check_is_the_heap(read(tmp_path, text, "heap.asc"))


@pytest.mark.parametrize("word", ["1_0", "\u0661", "0,5"])
def test_numbers_of_a_grid_are_those_of_all_files(tmp_path: Path, word: str) -> None:
    def with_word(text: str) -> str:
        return text.replace("0.00", word, 1)

    line = grid("cellsize 1\n", change=with_word).splitlines()
    number = next(place for place, text in enumerate(line, 1) if word in text)
    said = refused(tmp_path, grid("cellsize 1\n", change=with_word), "heap.asc")
    assert f"line {number}" in said
    assert repr(word) in said
    said = refused(tmp_path, grid(f"cellsize {word}\n"), "heap.asc")
    assert repr(word) in said


def test_exchanged_counts_of_a_grid_are_refused(tmp_path: Path) -> None:
    def exchanged(text: str) -> str:
        head = f"ncols {COLUMNS}\nnrows {ROWS}\n"
        return text.replace(head, f"ncols {ROWS}\nnrows {COLUMNS}\n")

    message = refused(tmp_path, grid("cellsize 1\n", change=exchanged), "heap.asc")
    assert f"its lines have {COLUMNS} numbers, and ncols is {ROWS}" in message
    # lines may end anywhere
    wrapped = grid("cellsize 1\n").replace(" 0.00 0.00 0.00\n", " 0.00\n0.00 0.00\n")
    check_is_the_heap(read(tmp_path, wrapped, "heap.asc"))


def projection(code: int, version: str = "WKT1_ESRI") -> str:
    """The text of a file .prj."""
    return str(rasterio.crs.CRS.from_epsg(code).to_wkt(version=version))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            projection(2277),
            "in US survey foot by .*heap.prj, and nothing says the unit",
        ),
        (projection(2277, "WKT2_2019"), "survey foot by EPSG:2277 in heap.prj, and"),
        (projection(4326), "heap.prj its axes are degrees"),
        (projection(4326, "WKT2_2019"), "heap.prj its axes are degrees"),
        (projection(32632)[:90], "heap.prj: it is no coordinate system"),
        ("Projection STATEPLANE\nUnits FEET\n", "in FEET by heap.prj, and nothing"),
        ("Projection STATEPLANE\nUnits FEET\nZunits NO\n", "in FEET by heap.prj, and"),
        ("Projection UTM\nUnits FATHOMS\n", "heap.prj: .*in FATHOMS"),
        (
            "Projection GEOGRAPHIC\nUnits DD\nZunits METERS\n",
            "heap.prj its axes are deg",
        ),
    ],
)
def test_a_projection_beside_a_grid_is_not_overlooked(
    tmp_path: Path, text: str, message: str
) -> None:
    (tmp_path / "heap.prj").write_text(text)
    with pytest.raises(InputError, match=message):
        read(tmp_path, grid("cellsize 1\n"), "heap.asc")


@pytest.mark.parametrize(
    ("text", "axes", "up"),
    [
        ("Projection STATEPLANE\nZunits FEET\nUnits FEET\n", 0.3048, 0.3048),
        ("Projection UTM\nZunits CENTIMETERS\nUnits METERS\n", 1.0, 0.01),
        (
            projection(2277, "WKT2_2019").join(
                [
                    'COMPOUNDCRS["both",',
                    ',VERTCRS["NAVD88 height (ftUS)",VDATUM["North American Vertical Datum 1988"],CS[vertical,1],AXIS["up",up],LENGTHUNIT["US survey foot",0.304800609601219]]]',
                ]
            ),
            1200 / 3937,
            1200 / 3937,
        ),
    ],
)
def test_units_beside_a_grid_are_applied(
    tmp_path: Path, text: str, axes: float, up: float
) -> None:
    (tmp_path / "heap.prj").write_text(text)
    content = grid("cellsize 1\n")
    if axes != up:
        head, body = content.split("cellsize 1\n")
        body = "\n".join(
            " ".join(f"{100 * float(z):.0f}" for z in row.split())
            for row in body.splitlines()
        )
        content = f"{head}cellsize 1\n{body}\n"
    found = read(tmp_path, content, "heap.asc")
    assert found.z == pytest.approx(axes * heights(), rel=1e-6)
    assert found.x[0] == pytest.approx(axes * EAST)
    assert found.steps == pytest.approx((axes, axes))
    assert "lengths taken for m" not in found.understood


@pytest.mark.parametrize(
    "text",
    [
        projection(32632),
        projection(32632, "WKT2_2019"),
        projection(29373),  # the German legal metre is 1.00001 m
        "Projection UTM\nZunits NO\nUnits METERS\n",
        'LOCAL_CS["none"]',
    ],
)
def test_a_grid_beside_a_projection_in_metres_is_read(
    tmp_path: Path, text: str
) -> None:
    (tmp_path / "heap.prj").write_text(text)
    check_is_the_heap(read(tmp_path, grid("cellsize 1\n"), "heap.asc"))


def test_cells_that_look_empty_are_refused(tmp_path: Path) -> None:
    low = heights()
    low[-1, :3] = -32768
    lines = points("{x} {y} {z}").splitlines()
    lines[-1] = f"{EAST + COLUMNS - 1} {NORTH + ROWS - 1} -9999"
    files: dict[str, tuple[str | bytes, str]] = {
        "heap.tif": (tif(low.astype(np.int16)), "-32768 in 3 cells"),
        "float.tif": (tif(np.where(low < 0, -3.4028235e38, low).astype(np.float32)), "-3.40282e"),
        "heap.xyz": ("\n".join(lines), "-9999 in 1 cell "),
        "heap.asc": (grid("cellsize 1\n", "-32768"), "-32768 in 3 cells"),
    }  # fmt: skip
    remedies = {
        "heap.tif": "gdal_edit -a_nodata -32768",
        "float.tif": "gdal_edit -a_nodata -3.40282347e+38",
        "heap.xyz": "leave such points out",
        "heap.asc": "NODATA_value -32768",
    }
    for name, (content, message) in files.items():
        said = refused(tmp_path, content, name)
        assert message in said
        assert "looks like a cell without a height" in said
        assert remedies[name] in said


@pytest.mark.parametrize(("pixel", "half"), [(1, 0.5), (2, 0.0)])
def test_the_top_of_a_geotiff_is_where_it_stands(
    tmp_path: Path, pixel: int, half: float
) -> None:
    # by hand: the tie point is the north-western corner of an area, or its middle
    keys = {MODEL: 1, PIXEL: pixel, PROJECTED: 32632}
    content = tif(heights().astype(np.float32), keys, half)
    found = read(tmp_path, content, "heap.tif")
    check_is_the_heap(found)
    row, column = np.unravel_index(int(found.z.argmax()), found.z.shape)
    assert (found.x[column], found.y[row]) == (EAST + 27, NORTH + 14)


def test_axes_in_degrees_are_refused(tmp_path: Path) -> None:
    content = tif(heights().astype(np.float32), {MODEL: 2, SYSTEM: 4326})
    assert "degrees of longitude" in refused(tmp_path, content, "heap.tif")


def test_a_geotiff_that_is_cut_off_is_refused_in_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    content = tif(heights().astype(np.float32))
    for size in (60, len(content) // 2):
        refused(tmp_path, content[:size], "heap.tif")
    # no reader of another library says anything of its own
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["heap.tif", "heap.asc"])
def test_without_the_extra_one_line_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setitem(sys.modules, "rasterio", None)
    content = (
        tif(heights().astype(np.float32))
        if name == "heap.tif"
        else grid("cellsize 1\n")
    )
    said = refused(tmp_path, content, name)
    assert "the extra [gis]: rasterio is not installed" in said
    assert "pip install 'rasterio>=1.4'" in said
