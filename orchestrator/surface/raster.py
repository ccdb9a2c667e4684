"""Files of heights on a raster, and maps as GeoTIFF.

Heights are read from XYZ, ESRI ASCII grid, GeoTIFF and STL.
"""

import io
import itertools
import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.errors import InputError
from orchestrator.study.heads import METRE as METRES
from orchestrator.study.source import decoded, read_bytes
from orchestrator.study.units import number
from orchestrator.surface import epsg
from orchestrator.surface.heights import (
    FEWEST,
    MOST_NODES,
    Raster,
    Surface,
    Tags,
    checked,
)
from orchestrator.surface.points import read_points
from orchestrator.types import FloatArray

if TYPE_CHECKING:
    from PIL.Image import Image

LARGEST = 2**28
"""Most bytes of a file."""
STL_HEAD, STL_TRIANGLE = 84, 50
"""Bytes of the head of a binary STL file, and of each of its triangles."""
SCALE, TIE_POINT, TRANSFORMATION = 33550, 33922, 34264
KEYS, KEY_NUMBERS, KEY_TEXTS = 34735, 34736, 34737
METADATA, NODATA = 42112, 42113
"""Tags of a GeoTIFF (OGC 19-008r4), GDAL's for its metadata, and for cells without a
height."""
MODEL, PIXEL, LENGTH_UNIT, HEIGHT_UNIT = 1024, 1025, 3076, 4099
PROJECTED, VERTICAL = 3072, 4096
"""Keys of a GeoTIFF: kind of the axes, what a pixel is, units, and EPSG codes of the
coordinate systems on the ground and of the heights."""
DEGREES, POINT, METRE = 2, 2, 9001
FEET = {9002: 0.3048, 9003: 1200 / 3937}
"""Units of a GeoTIFF in feet, m."""
FOOT = 0.305
"""All feet to three digits, m."""
GRID_KEYS = ("ncols", "nrows", "cellsize")
CORNERS, CENTRES = ("xllcorner", "yllcorner"), ("xllcenter", "yllcenter")
EMPTY = "nodata_value"
"""Keys of the head of an ESRI grid."""
ONE_OF = (("cellsize", "dx"), ("cellsize", "dy"), *zip(CENTRES, CORNERS, strict=True))
"""Keys of a grid of which one alone may stand there."""
NEAR_EMPTY = 1e-6
"""Largest difference of an empty cell from the number of empty cells, over that."""
DEEPEST, HIGHEST = 9000.0, 1e9
"""Depth below which and height above which no ground lies, m, in whatever unit."""
UNNAMED_EMPTY = "-9999"
"""What stands in an empty cell of a grid whose head does not say it."""
UNIT_OF_WKT = re.compile(r'UNIT\["([^"]+)",\s*(\d+\.?\d*(?:[eE][+-]?\d+)?)')
UNIT_OF_ARCINFO = re.compile(r"^\s*z?units\s+(\w+)", re.IGNORECASE | re.MULTILINE)
"""Units in a file .prj: their names, and in well-known text their size."""
UNIT_OFF = 1e-4
"""Largest difference of a unit from the metre, m: the German legal metre."""
UNSAID = "no"
"""Arc/Info's word for no unit of the heights."""
LARGEST_PROJECTION = 2**20
"""Most bytes of a file .prj."""
FORMATS = ".tif .tiff (GeoTIFF), .asc (ESRI), .xyz .csv .txt (x y z), .stl"
BARE_TAGS: Tags = {
    KEYS: (1, 1, 0, 1, PIXEL, 0, 1, 1),
}
"""Keys of a map without a place on the Earth: its pixels are areas."""


def read_surface(path: Path, where: str) -> Surface:
    """Read the file of a surface.

    Parameters
    ----------
    path
        The file; its ending says what it is.
    where
        The file and the field that names it, for messages.

    Returns
    -------
    Surface
        The surface.

    Raises
    ------
    InputError
        If the file is no surface, with the place and the remedy.
    """
    if not path.is_file():
        remedy = "a path in a study file is relative to that file"
        raise InputError("there is no such file", where, remedy)
    content = read_bytes(path, LARGEST, where)
    ending = path.suffix.lower()
    if ending in (".tif", ".tiff"):
        raster = _of_geotiff(content, path.name, where)
    elif ending == ".asc":
        _check_projection(path.with_suffix(".prj"), where)
        raster = _of_grid(decoded(content, where), path.name, where)
    elif ending in (".xyz", ".csv", ".txt"):
        raster = read_points(decoded(content, where), path.name, where)
    elif ending == ".stl":
        _check_stl(content, where)
        raster = _of_triangles(path, where)
    else:
        what = f"the ending {ending!r} is of no surface"
        raise InputError(what, where, f"endings: {FORMATS}")
    _check_heights(raster.z, where)
    return checked(raster, where)


def _check_projection(path: Path, where: str) -> None:
    """Refuse a grid beside whose file a coordinate system in another unit stands."""
    if not path.is_file():
        return
    where = f"{where}: {path.name}"
    text = decoded(read_bytes(path, LARGEST_PROJECTION, where), where)
    units = [(name, float(size)) for name, size in UNIT_OF_WKT.findall(text)]
    is_projected = any(word in text for word in ("PROJCS", "PROJCRS", "LOCAL_CS"))
    lengths = [unit for unit in units if not (is_projected and _is_angle(unit[0]))]
    off = [(name, size) for name, size in lengths if abs(size - 1) > UNIT_OFF]
    for name in UNIT_OF_ARCINFO.findall(text):
        if name.lower() not in (UNSAID, *METRES):
            off.append((name, 0.0))
    for name, size in off:
        what = f"its lengths are in {name}"
        remedy = "project it to metres, with gdalwarp -t_srs EPSG:326NN, NN the zone"
        if size and not _is_angle(name):
            remedy = f"multiply them by {size:.7g}: they must be in m"
        raise InputError(what, where, remedy)


def _is_angle(unit: str) -> bool:
    """Whether a unit of a coordinate system is of an angle."""
    return unit.lower().startswith(("deg", "grad", "rad"))


def _check_heights(z: FloatArray, where: str) -> None:
    """Refuse heights that no ground has, and that stand for no height."""
    for value in (float(np.nanmin(z, initial=0.0)), float(np.nanmax(z, initial=0.0))):
        if not -DEEPEST <= value <= HIGHEST and np.isfinite(value):
            what = f"{value:.6g} in {int((z == value).sum())} cells"
            what = f"{what} looks like a cell without a height"
            remedy = "leave such points out, or name the number as NODATA: gdal_edit"
            raise InputError(what, where, f"{remedy} -a_nodata, or the head of an .asc")


def _of_grid(text: str, name: str, where: str) -> Raster:
    """The raster of an ESRI ASCII grid, whose rows run from north to south."""
    lines = text.splitlines()
    header, empty = _head_of_grid(lines, where)
    columns = header["ncols"]
    rows = header["nrows"]
    before = len(header) + bool(empty)
    values = _numbers(lines[before:], before, empty, where)
    is_whole = columns % 1 == 0 and columns * rows == len(values)
    if not (is_whole and min(columns, rows) >= FEWEST):
        what = f"{len(values)} heights, not {columns:.9g} x {rows:.9g}"
        remedy = f"nrows lines of ncols numbers, {FEWEST} of each at least"
        raise InputError(what, where, remedy)
    widths = {len(line.split()) for line in lines[before:] if line.strip()}
    if widths == {rows} and rows != columns:
        what = f"its lines have {rows:.9g} numbers, and ncols is {columns:.9g}"
        raise InputError(what, where, "are ncols and nrows exchanged?")
    heights = np.array(values).reshape(int(rows), int(columns))[::-1]
    heights = _without(heights, empty or UNNAMED_EMPTY)
    x = _axis_of_grid("x", int(columns), header, where)
    y = _axis_of_grid("y", int(rows), header, where)
    return Raster(name, x, y, heights)


def _without(heights: FloatArray, empty: str) -> FloatArray:
    """Heights with NaN in the cells that have the number of empty cells.

    It is written in decimal, with fewer digits in the head of a file or in its cells.
    """
    if not _is_number(empty):
        return heights
    is_empty = np.isclose(heights, number(empty), rtol=NEAR_EMPTY, atol=0.0)
    return np.where(is_empty, np.nan, heights)


def _head_of_grid(lines: list[str], where: str) -> tuple[dict[str, float], str]:
    """The numbers at the head of a grid by their keys, a line for each.

    Apart from them: what stands in an empty cell, which may be a word.
    """
    header: dict[str, float] = {}
    empty = ""
    for line in lines:
        words = line.split()
        if len(words) != 2 or not words[0][0].isalpha():
            break
        key = words[0].lower()
        if key in header or (key == EMPTY and empty):
            raise InputError(f"{key} stands twice", where, "remove one of the lines")
        if key == EMPTY:
            empty = words[1]
            continue
        if key not in {*GRID_KEYS, *itertools.chain.from_iterable(ONE_OF)}:
            known = ", ".join((*GRID_KEYS, *CORNERS, *CENTRES, EMPTY))
            what = f"{words[0]} is no key of a grid"
            raise InputError(what, where, f"its head has {known}")
        header[key] = _number(words[1], f"{where}: {words[0]}")
    for key in GRID_KEYS:
        if key not in header:
            remedy = "its head has ncols, nrows, xllcorner, yllcorner, cellsize"
            raise InputError(f"{key} is missing", where, remedy)
    for one, other in ONE_OF:
        if one in header and other in header:
            what = f"its head has {one} and {other}"
            raise InputError(what, where, "leave one of the two")
    return header, empty


def _axis_of_grid(
    axis: str, count: int, header: dict[str, float], where: str
) -> FloatArray:
    """The centres of the cells of a grid along an axis, m."""
    step = header["cellsize"]
    if not 0 < step < np.inf:
        raise InputError(f"cellsize {step:g}", where, "it is in m, above 0")
    start = header.get(f"{axis}llcenter")
    if start is None:
        start = header.get(f"{axis}llcorner", 0.0) + step / 2
    if not np.isfinite(start):
        raise InputError(f"{axis}llcorner {start:g}", where, "it is in m")
    return _steps(start, step, count)


def _numbers(lines: list[str], before: int, empty: str, where: str) -> list[float]:
    """The numbers of some lines; `before` lines of the file stand before them.

    The word of empty cells is NaN.
    """
    values: list[float] = []
    for count, line in enumerate(lines, before + 1):
        words = line.split()
        if empty and not _is_number(empty):
            words = ["nan" if word == empty else word for word in words]
        try:
            values.extend(map(number, words))
        except ValueError:
            bad = next(word for word in words if not _is_number(word))
            place = f"{where}: line {count}"
            remedy = "numbers with a decimal point, spaces between them"
            raise InputError(f"{bad!r} is no number", place, remedy) from None
    return values


def _is_number(word: str) -> bool:
    """Whether a word is a number."""
    try:
        number(word)
    except ValueError:
        return False
    return True


def _number(word: str, where: str) -> float:
    """The number that a word is; an `InputError` for any other word."""
    if not _is_number(word):
        raise InputError(f"{word!r} is no number", where, "with a decimal point")
    return number(word)


def _of_triangles(path: Path, where: str) -> Raster:
    """The raster of an STL file: its vertices, seen from above, interpolated."""
    from scipy.interpolate import LinearNDInterpolator

    points = _seen_from_above(path, where)
    _, counts = np.unique(points[:, :2], axis=0, return_counts=True)
    if counts.max() > 1:
        twice = points[np.repeat(counts > 1, counts)][0]
        what = f"x = {twice[0]:.9g} m, y = {twice[1]:.9g} m has two heights"
        raise InputError(what, where, "a wall or an overhang is no bed")
    start = points.min(axis=0)
    extent = np.ptp(points, axis=0)
    step = float(np.sqrt(extent[0] * extent[1] / len(points)))
    east = np.linspace(0.0, extent[0], round(extent[0] / step) + 1)
    north = np.linspace(0.0, extent[1], round(extent[1] / step) + 1)
    of_places = LinearNDInterpolator(points[:, :2] - start[:2], points[:, 2])
    heights = of_places(*np.meshgrid(east, north))
    return Raster(path.name, start[0] + east, start[1] + north, heights)


def _check_stl(content: bytes, where: str) -> None:
    """Refuse a file that is no whole STL: its reader would write pages of its own."""
    triangles = int.from_bytes(content[80:84], "little")
    is_binary = len(content) == STL_HEAD + STL_TRIANGLE * triangles
    is_text = content.lstrip()[:5] == b"solid" and b"endsolid" in content
    if not (is_binary or is_text):
        remedy = "is it an STL file of a surface, seen from above?"
        raise InputError("it is no whole STL file", where, remedy)


def _seen_from_above(path: Path, where: str) -> FloatArray:
    """The vertices of the triangles of an STL file that are seen from above, (n, 3)."""
    import meshio

    remedy = "is it an STL file of a surface, seen from above?"
    try:
        with warnings.catch_warnings():
            # the count of triangles that it reads in a text overflows
            warnings.simplefilter("ignore")
            mesh = meshio.stl.read(path)
        triangles = mesh.cells_dict["triangle"]
    except Exception as error:  # a reader of another library raises what it likes
        what = str(error) or "its lines are not whole triangles"
        raise InputError(f"not readable: {what}", where, remedy) from None
    if not np.isfinite(mesh.points).all():
        raise InputError("a vertex is not a number", where, remedy)
    corners = mesh.points.astype(float)[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    up = np.abs(normal[:, 2])
    if (counts > 1).all():
        # the sides and the bottom of a closed body are no bed; the normals of a body
        # with a volume below 0 are inwards
        volume = (corners[:, 0] * normal).sum()
        up = np.sign(volume) * normal[:, 2]
    is_upper = up > 1e-6 * np.linalg.norm(normal, axis=1)
    points = np.unique(corners[is_upper].reshape(-1, 3), axis=0)
    if len(points) < FEWEST**2:
        raise InputError(f"{len(points)} vertices are no surface", where, remedy)
    return points


def _of_geotiff(content: bytes, name: str, where: str) -> Raster:
    """The raster of a GeoTIFF of one band."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            # Pillow warns of large images; the size is checked here
            warnings.simplefilter("ignore")
            image = Image.open(io.BytesIO(content), formats=["TIFF"])
            if image.width * image.height > MOST_NODES:
                what = f"{image.width} x {image.height} cells, over {MOST_NODES}"
                remedy = "resample it to larger cells, with gdalwarp -tr"
                raise InputError(what, where, remedy)
            image.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        what = f"no readable GeoTIFF: {error}"
        if isinstance(error, UnidentifiedImageError):
            what = "no readable GeoTIFF: it is cut off, or another kind of file"
        remedy = "heights are one band: gdal_translate -b 1 -ot Float32"
        raise InputError(what, where, remedy) from None
    if len(image.getbands()) != 1 or image.mode in ("P", "1", "L"):
        what = f"its pixels are {image.mode}, a picture, not heights"
        raise InputError(what, where, "export the elevation model, not its picture")
    heights = np.array(image, float)[::-1]
    tags: Any = getattr(image, "tag_v2", {})
    kept = {key: tags[key] for key in (KEYS, KEY_NUMBERS, KEY_TEXTS) if key in tags}
    heights = _without(heights, str(tags.get(NODATA, "")).strip("\0 "))
    _check_units(_keys(kept), where)
    heights = _in_metres(heights, _metadata(tags, where), where)
    along_x, along_y = _geotiff_axes(image, kept, where)
    return Raster(name, along_x, along_y, heights, kept)


def _keys(tags: Mapping[int, Any]) -> dict[int, int]:
    """The keys of a GeoTIFF whose value is a short integer."""
    table = np.array(tags.get(KEYS, ()), int)
    entries = table[4 : 4 * (len(table) // 4)].reshape(-1, 4)
    found = {}
    for key, place, _, value in entries.tolist():
        if place == 0:
            found[key] = value
    return found


def _check_units(keys: Mapping[int, int], where: str) -> None:
    """Refuse a GeoTIFF whose axes or heights are not in metres."""
    if keys.get(MODEL) == DEGREES:
        what = "its axes are degrees of longitude and latitude"
        remedy = "project it to metres, with gdalwarp -t_srs EPSG:326NN, NN the zone"
        raise InputError(what, where, remedy)
    for unit_key, system, kind, axes in (
        (LENGTH_UNIT, PROJECTED, epsg.PROJECTED, "axes"),
        (HEIGHT_UNIT, VERTICAL, epsg.VERTICAL, "heights"),
    ):
        unit = keys.get(unit_key)
        what = f"its {axes} are in feet"
        if unit is None:
            # the unit is that of the coordinate system
            metres = epsg.unit_of(kind, keys.get(system))
            of_unit = "feet" if round(metres, 3) == FOOT else f"units of {metres:g} m"
            what = f"it is in EPSG:{keys.get(system)}, whose {axes} are in {of_unit}"
        elif unit == METRE or unit in FEET:
            metres = FEET.get(unit, 1.0)
        else:
            what = f"its {axes} are in the unit EPSG:{unit}, not metres"
            raise InputError(what, where, "project it to metres, with gdalwarp -t_srs")
        if metres != 1:
            remedy = f"multiply them by {metres:.7g}: they must be in m"
            raise InputError(what, where, remedy)


def _metadata(tags: Mapping[int, Any], where: str) -> dict[str, str]:
    """What GDAL says of the heights of a GeoTIFF: scale, offset and unit."""
    text = str(tags.get(METADATA, "")).strip("\0 \n")
    if not text:
        return {}
    try:
        items = ElementTree.fromstring(text).iter("Item")
    except ElementTree.ParseError as error:
        what = f"GDAL's metadata are not readable: {error}"
        raise InputError(what, where, "write it anew, with gdal_translate") from None
    return {item.get("role", ""): (item.text or "").strip() for item in items}


def _in_metres(
    heights: FloatArray, metadata: Mapping[str, str], where: str
) -> FloatArray:
    """Heights by the scale and the offset with which they are stored."""
    unit = metadata.get("unittype", "")
    if unit.lower() not in ("", *METRES):
        what = f"its heights are in {unit}"
        raise InputError(what, where, "they must be in m: gdal_calc")
    found = {}
    for role, usual in (("scale", "1"), ("offset", "0")):
        text = metadata.get(role, usual)
        value = number(text) if _is_number(text) else np.nan
        if not np.isfinite(value) or (role == "scale" and not value):
            what = f"its {role} is {text!r}"
            raise InputError(what, where, f"GDAL's {role} of a band is a number")
        found[role] = value
    return np.asarray(heights * found["scale"] + found["offset"])


def _geotiff_axes(
    image: "Image", tags: Mapping[int, Any], where: str
) -> tuple[FloatArray, FloatArray]:
    """The axes of a GeoTIFF, to the middles of its pixels."""
    x0, y0, step_x, step_y = _geotiff_corner(getattr(image, "tag_v2", {}), where)
    if min(step_x, step_y) <= 0:
        what = f"its pixels are {step_x:g} x {step_y:g} m"
        raise InputError(what, where, "rows run from north to south: gdalwarp")
    half = 0.0 if _keys(tags).get(PIXEL) == POINT else 0.5
    # the first row is the northernmost
    south = y0 - step_y * (image.height - 1 + half)
    along_x = _steps(x0 + step_x * half, step_x, image.width)
    return along_x, _steps(south, step_y, image.height)


def _geotiff_corner(
    tags: Mapping[int, Any], where: str
) -> tuple[float, float, float, float]:
    """Place of the first pixel's corner or middle, and steps along x and y, m."""
    if TRANSFORMATION in tags:
        step_x, turn_x, _, x0, turn_y, down, _, y0 = tags[TRANSFORMATION][:8]
        if turn_x or turn_y:
            remedy = "turn its axes to x and y, with gdalwarp"
            raise InputError("its axes are turned", where, remedy)
        return x0, y0, step_x, -down
    if SCALE in tags and TIE_POINT in tags:
        step_x, step_y = tags[SCALE][:2]
        column, row, _, x0, y0, _ = tags[TIE_POINT][:6]
        return x0 - column * step_x, y0 + row * step_y, step_x, step_y
    what = "it says nothing of the size of its pixels"
    remedy = "export it with a scale and a tie point, or as .asc"
    raise InputError(what, where, remedy)


def _steps(start: float, step: float, count: int) -> FloatArray:
    """An axis of equal steps."""
    return np.asarray(start + step * np.arange(count), float)


def geotiff(
    x: FloatArray,
    y: FloatArray,
    values: ArrayLike,
    tags: Tags,
) -> bytes:
    """Write a map as a GeoTIFF of 32-bit numbers, for a GIS.

    Parameters
    ----------
    x, y
        Axes to the middles of its cells, m, rising, of shapes (nx,) and (ny,).
    values
        The map, of shape (ny, nx), NaN where it has no value.
    tags
        Tags of the GeoTIFF that the bed was read from; empty without any.

    Returns
    -------
    bytes
        The file.
    """
    from PIL import Image
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    step_x = float(np.ptp(x)) / (len(x) - 1)
    step_y = float(np.ptp(y)) / (len(y) - 1)
    kept = {**BARE_TAGS, **tags}
    half = 0.0 if _keys(kept).get(PIXEL) == POINT else 0.5
    corner = (float(x[0]) - half * step_x, float(y[-1]) + half * step_y)
    directory = ImageFileDirectory_v2()
    types = {KEYS: 3, KEY_NUMBERS: 12, KEY_TEXTS: 2, NODATA: 2}
    types |= {SCALE: 12, TIE_POINT: 12}
    kept |= {
        SCALE: (step_x, step_y, 0.0),
        TIE_POINT: (0.0, 0.0, 0.0, *corner, 0.0),
        NODATA: "nan",
    }
    for key, value in kept.items():
        directory.tagtype[key] = types[key]
        directory[key] = value
    rows = np.asarray(values, np.float32)[::-1]
    stream = io.BytesIO()
    image = Image.fromarray(np.ascontiguousarray(rows))
    image.save(stream, "TIFF", tiffinfo=directory, compression="tiff_lzw")
    return stream.getvalue()
