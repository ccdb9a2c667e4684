"""Files of heights on a raster, and maps as GeoTIFF.

rasterio reads GeoTIFF and ESRI ASCII grids, and writes the maps.
"""

import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.digits import number as number_of
from orchestrator.errors import InputError
from orchestrator.extras import imported
from orchestrator.study.cells import COMMENT, Marks, marks_of
from orchestrator.study.empty import EMPTY_WORDS, looks_empty
from orchestrator.study.lengths import LENGTHS
from orchestrator.study.source import decoded, read_bytes
from orchestrator.study.units import number
from orchestrator.surface.heights import (
    MOST_NODES,
    STEEPEST_DEG,
    Raster,
    Surface,
    checked,
)
from orchestrator.surface.points import read_points
from orchestrator.surface.raster_units import (
    UNIT_OF_ARCINFO,
    RasterUnits,
    units_of,
    units_of_arcinfo,
)
from orchestrator.surface.triangles import read_triangles
from orchestrator.types import BoolArray, FloatArray

LARGEST = 2**28
"""Most bytes of a file."""
LARGEST_PROJECTION = 2**20
"""Most bytes of a file .prj."""
NEEDED: Mapping[str, frozenset[str]] = {
    "ncols": frozenset(),
    "nrows": frozenset(),
    "xllcorner": frozenset({"xllcenter"}),
    "yllcorner": frozenset({"yllcenter"}),
    "cellsize": frozenset({"dx", "dy"}),
}
"""Keys that the head of an ESRI grid must have, and those that stand for each."""
STEPS = ("cellsize", "dx", "dy")
EMPTY = "nodata_value"
"""The key for what stands in cells without a height."""
GRID_KEYS = (*NEEDED, "xllcenter", "yllcenter", "dx", "dy", EMPTY)
SYNONYMS = {
    **dict.fromkeys(("cell_size", "cell", "resolution", "xycellsize"), "cellsize"),
    **dict.fromkeys(("xdim", "cellsize_x", "xcellsize", "cellsizex"), "dx"),
    **dict.fromkeys(("ydim", "cellsize_y", "ycellsize", "cellsizey"), "dy"),
    **dict.fromkeys(("xll", "xcorner", "xllcorner_m", "xll_corner"), "xllcorner"),
    **dict.fromkeys(("yll", "ycorner", "yllcorner_m", "yll_corner"), "yllcorner"),
    **dict.fromkeys(("xllcentre", "xll_center", "xcenter"), "xllcenter"),
    **dict.fromkeys(("yllcentre", "yll_center", "ycenter"), "yllcenter"),
    **dict.fromkeys(("cols", "columns", "ncol", "nx"), "ncols"),
    **dict.fromkeys(("rows", "nrow", "ny"), "nrows"),
    **dict.fromkeys(
        ("nodata", "no_data", "no_data_value", "nodatavalue", "null", "missing"), EMPTY
    ),
}
"""Other names for the keys of a grid."""
GRASS_KEYS = ("north", "south", "east", "west")
"""Keys of the head of a grid of GRASS, which has edges in place of a corner."""
UNNAMED_EMPTY = "-9999"
"""What stands in them by the format where the key is missing."""
GRID_REMEDY = "numbers with a decimal point, spaces between them"
OF_EMPTY = re.compile(
    rf"(?<!\S)(?:{'|'.join(map(re.escape, EMPTY_WORDS))})(?!\S)", re.IGNORECASE
)
"""The words that stand for no number, in a text."""
NEAR_EMPTY = 1e-6
"""Largest difference of an empty cell from the number of empty cells, over that: it is
written in decimal, with fewer digits in the head of a file or in its cells."""
FORMAT_OF = {"GTiff": "GeoTIFF", "AAIGrid": "ESRI grid"}
"""Formats by GDAL's names for them."""
TEXTS = (".asc", ".xyz", ".csv", ".txt")
OTHER_ENDINGS = {
    **dict.fromkeys((".las", ".laz"), "a cloud of points: grid it with pdal; "),
    **dict.fromkeys((".gz", ".zip"), "unpack it; "),
    **dict.fromkeys((".xls", ".xlsx", ".ods"), "save its sheet as CSV; "),
    **dict.fromkeys(
        (".img", ".vrt", ".grd", ".dem", ".hgt", ".bil", ".flt", ".nc"),
        "gdal_translate makes a .tif of it; ",
    ),
}
"""What helps with files of other endings."""
FORMATS = ".tif .tiff (GeoTIFF), .asc (ESRI), .xyz .csv .txt (x y z), .stl"
POINT_REMEDY = "leave such points out"
DECLARED = {
    ".tif": "declare it: gdal_edit -a_nodata {:.9g}",
    ".asc": "declare it in the head: NODATA_value {:.9g}",
}
"""What declares a number to be that of empty cells, by the ending of the file."""


def rasterio(where: str) -> Any:
    """Import rasterio.

    Parameters
    ----------
    where
        The file and the field that needs it, for messages.

    Returns
    -------
    module
        rasterio.

    Raises
    ------
    InputError
        If it is not installed, with the extra of the package that has it.
    """
    return imported("rasterio", "gis", where)


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
    ending = path.suffix.lower().replace(".tiff", ".tif")
    if ending == ".tif":
        raster = _of_geotiff(path, where)
    elif ending in TEXTS:
        text = decoded(read_bytes(path, LARGEST, where), where, is_data=True)
        # a text is what it holds: agencies call both .asc, and both .txt
        if _is_grid(text, ending):
            raster = _of_grid(path, text, where)
        else:
            raster = read_points(text, path.name, where)
    elif ending == ".stl":
        raster = read_triangles(path, LARGEST, where)
    else:
        what = f"the ending {ending!r} is of no surface"
        remedy = OTHER_ENDINGS.get(ending, "")
        raise InputError(what, where, f"{remedy}endings: {FORMATS}")
    _check_heights(raster, DECLARED.get(ending, POINT_REMEDY), where)
    return checked(raster, where)


def _is_grid(text: str, ending: str) -> bool:
    """Whether a text is a grid, and no list of points."""
    first = next(
        (
            line
            for line in text.splitlines()
            if line.strip() and not COMMENT.match(line)
        ),
        "",
    )
    words = re.split(r"[\s:=]+", first.strip())
    if _key_of(words[0]) in (*GRID_KEYS, *GRASS_KEYS) and len(words) == 2:
        return True
    try:
        are_numbers = len([float(word) for word in words]) > 2
    except ValueError:
        are_numbers = False
    return ending == ".asc" and not are_numbers


def _check_heights(raster: Raster, remedy: str, where: str) -> None:
    """Refuse heights that no ground has, and that stand for no height."""
    # marks are numbers of the file, which may have another unit
    z = raster.z[np.isfinite(raster.z)] / raster.unit
    if not z.size:
        return
    value, count = looks_empty(z, max(raster.steps) / raster.unit, STEEPEST_DEG)
    if count:
        cells = number_of(count, "cell")
        what = f"{value:.6g} in {cells} looks like a cell without a height"
        raise InputError(what, where, remedy.format(value))


@contextmanager
def opened_raster(path: Path, where: str) -> Iterator["OpenedRaster"]:
    """Open a GeoTIFF or an ESRI grid, of whatever quantity.

    Parameters
    ----------
    path
        The file; its ending says what it is.
    where
        The file and the field that names it, for messages.

    Yields
    ------
    Opened
        The file.

    Raises
    ------
    InputError
        If it is neither, or cannot be read.
    """
    if not path.is_file():
        raise InputError("there is no such file", where, "a GeoTIFF, or .asc")
    ending = path.suffix.lower()
    if ending == ".asc":
        text = decoded(read_bytes(path, LARGEST, where), where, is_data=True)
        with _grid(path, text, where) as opened:
            yield opened
    elif ending in (".tif", ".tiff"):
        with _opened(path, "GTiff", where) as dataset:
            units = units_of(dataset.crs, where)
            yield OpenedRaster(dataset, dataset.crs, dataset.nodata, units)
    else:
        what = f"the ending {ending!r} is of no raster"
        raise InputError(what, where, "endings: .tif .tiff (GeoTIFF), .asc (ESRI)")


class OpenedRaster(NamedTuple):
    """A raster as rasterio opens it.

    Attributes
    ----------
    dataset
        The file.
    system
        Its coordinate reference system; None without one.
    empty
        The number of its empty cells; None where no number stands for them.
    units
        The units of its axes and of its heights, as far as it says them.
    said
        What was understood of a text, in words.
    """

    dataset: Any
    system: Any
    empty: float | None
    units: RasterUnits
    said: tuple[str, ...] = ()


def read_raster(path: Path, where: str) -> Raster:
    """Read a raster of one quantity in m, whatever it is.

    Parameters
    ----------
    path
        A GeoTIFF or an ESRI grid.
    where
        The file and the field that names it, for messages.

    Returns
    -------
    Raster
        Its cells, NaN where these are empty.

    Raises
    ------
    InputError
        If it is no such raster, or its axes are not in m.
    """
    with opened_raster(path, where) as opened:
        _check_band(opened.dataset, where)
        units = opened.units.with_band(opened.dataset.units[0], where)
        # what is no height has its own unit, or the metre
        raster = _raster(opened, path.name, units, units.heights or "m", where)
        return replace(raster, understood=units.said)


def is_empty(values: FloatArray, empty: float | None) -> BoolArray:
    """Tell which cells of a raster have the number of empty ones.

    Parameters
    ----------
    values
        The numbers as they are stored.
    empty
        The number of empty cells; None for none.

    Returns
    -------
    ndarray
        Truth values, of the same shape.
    """
    if empty is None:
        return np.zeros(np.shape(values), bool)
    return np.isclose(values, empty, rtol=NEAR_EMPTY, atol=0.0)


def _of_geotiff(path: Path, where: str) -> Raster:
    """The raster of a GeoTIFF of one band."""
    with opened_raster(path, where) as opened:
        dataset = opened.dataset
        _check_band(dataset, where)
        units = opened.units.with_band(dataset.units[0], where)
        words = [f"a GeoTIFF of {dataset.dtypes[0]}, {_said_of_empty(dataset.nodata)}"]
        if (dataset.scales[0], dataset.offsets[0]) != (1.0, 0.0):
            scale, offset = dataset.scales[0], dataset.offsets[0]
            words.append(f"its numbers times {scale:g} plus {offset:g} are heights")
        raster = _raster(opened, path.name, units, units.of_heights(where), where)
    said = _said_of_system(dataset.crs, units)
    return replace(raster, understood=(*words, said, *units.said))


def _said_of_empty(empty: float | str | None) -> str:
    """What is said of the mark of empty cells."""
    if empty is None:
        return "which declares no number for empty cells"
    mark = empty if isinstance(empty, str) else f"{empty:.9g}"
    return f"{mark} in empty cells"


def _said_of_system(system: Any, units: RasterUnits) -> str:
    """What is said of a coordinate reference system; without one lengths are in m."""
    if not system and units.said:
        return "no coordinate system"
    if not system:
        return "no coordinate system: lengths taken for m"
    code = system.to_epsg()
    name = f"EPSG:{code}" if code else system.to_dict(projjson=True)["name"]
    return f"in {name}"


def _opened(path: Path | str, driver: str, where: str, **options: str) -> Any:
    """A file as rasterio opens it; an `InputError` for one that is no such raster."""
    library = rasterio(where)
    with warnings.catch_warnings():
        # without a place on the Earth it has no transform, which is refused
        warnings.simplefilter("ignore", library.errors.NotGeoreferencedWarning)
        try:
            return library.open(path, driver=driver, **options)
        except library.errors.RasterioError:
            what = f"no readable {FORMAT_OF[driver]}: it is cut off, or another kind"
            remedy = "write it anew, with gdal_translate"
            raise InputError(f"{what} of file", where, remedy) from None


def _check_band(dataset: Any, where: str) -> None:
    """Refuse pictures, and more cells than a surface has."""
    pixels = ", ".join(dict.fromkeys(dataset.dtypes))
    is_picture = pixels in ("uint8", "int8") or pixels.startswith("complex")
    if dataset.count != 1 or is_picture:
        what = f"its pixels are {dataset.count} x {pixels}, a picture, not heights"
        remedy = "export the elevation model: one band of 16-bit, 32-bit or 64-bit"
        raise InputError(what, where, f"{remedy} numbers")
    if dataset.width * dataset.height > MOST_NODES:
        what = f"{dataset.width} x {dataset.height} cells, over {MOST_NODES}"
        remedy = "resample it to larger cells, with gdalwarp -tr"
        raise InputError(what, where, remedy)
    scale, offset = dataset.scales[0], dataset.offsets[0]
    if not (scale and np.isfinite([scale, offset]).all()):
        what = f"its scale is {scale:g}, and its offset {offset:g}"
        raise InputError(what, where, "GDAL's scale of a band is a number other than 0")


def _raster(
    opened: OpenedRaster, name: str, units: RasterUnits, of_cells: str, where: str
) -> Raster:
    """The raster of a band in m, its rows from south to north."""
    dataset = opened.dataset
    x, y = _axes(dataset, where)
    library = rasterio(where)
    try:
        stored = dataset.read(1, masked=True)
    except library.errors.RasterioError as error:
        what = f"its heights are not readable: {error}"
        raise InputError(what, where, "is the file cut off?") from None
    values = np.ma.getdata(stored).astype(float)
    lacks = np.ma.getmaskarray(stored) | is_empty(values, opened.empty)
    heights = values * dataset.scales[0] + dataset.offsets[0]
    heights[lacks] = np.nan
    step = units.of_axes(where)
    system = opened.system.to_wkt() if opened.system else ""
    unit = LENGTHS[of_cells]
    return Raster(name, step * x, step * y, unit * heights[::-1], system, unit=unit)


def _axes(dataset: Any, where: str) -> tuple[FloatArray, FloatArray]:
    """The axes of a raster, to the middles of its cells, in its unit."""
    step_x, turn_x, west, turn_y, down, north = dataset.transform[:6]
    if dataset.transform.is_identity:
        what = "it says nothing of the size of its pixels"
        raise InputError(what, where, "export it with a world file, or as .asc")
    if turn_x or turn_y:
        remedy = "turn its axes to x and y, with gdalwarp"
        raise InputError("its axes are turned", where, remedy)
    if not (step_x > 0 > down and np.isfinite([step_x, down, west, north]).all()):
        what = f"its cells are {step_x:g} x {-down:g} m at x = {west:g} m"
        raise InputError(what, where, "rows run from north to south: gdalwarp")
    x = west + step_x * (np.arange(dataset.width) + 0.5)
    south = north + down * dataset.height
    return x, south - down * (np.arange(dataset.height) + 0.5)


def _of_grid(path: Path, text: str, where: str) -> Raster:
    """The raster of an ESRI ASCII grid, or of one of GRASS."""
    with _grid(path, text, where) as opened:
        units = opened.units
        raster = _raster(opened, path.name, units, units.of_heights(where), where)
    return replace(raster, understood=(*opened.said, *units.said))


@contextmanager
def _grid(path: Path, text: str, where: str) -> Iterator[OpenedRaster]:
    """An ESRI ASCII grid, or one of GRASS, as rasterio opens it."""
    system, units = _system_beside(path.with_suffix(".prj"), where)
    text, marks = _with_points(text, where)
    grid = _check_grid(text, where)
    by = "" if grid.is_declared else " by the format"
    marks_of_empty = f"{_said_of_empty(grid.empty)}{by}"
    if grid.words:
        marks_of_empty = f"{marks_of_empty}, and {', '.join(grid.words)}"
    said = [f"a grid with {marks_of_empty}", _said_of_system(system, units)]
    if marks.said:
        said.insert(1, marks.said)
    empty = None if isinstance(grid.empty, str) else grid.empty
    memory = rasterio(where).MemoryFile(grid.text.encode(), ext=".asc")
    # numbers as they are written: 32-bit ones have seven digits
    precise = {"DATATYPE": "Float64"}
    with memory, _opened(memory.name, "AAIGrid", where, **precise) as dataset:
        yield OpenedRaster(dataset, system, empty, units, tuple(said))


def _with_points(text: str, where: str) -> tuple[str, Marks]:
    """The text of a grid with decimal points, and how its numbers are written."""
    if "," not in text:
        return text, Marks()
    words = [word for line in text.splitlines() for word in line.split()]
    try:
        marks = marks_of(words)
        if marks.decimal == "." and not marks.thousands:
            return text, marks
        mark = marks.thousands
        bare = text.replace(mark, "") if mark else text
        return bare.replace(marks.decimal, "."), marks
    except ValueError as error:
        of_commas = (i for i, line in enumerate(text.splitlines(), 1) if "," in line)
        place = f"{where}: line {next(of_commas)}"
        raise InputError(str(error), place, GRID_REMEDY) from None


class _Grid(NamedTuple):
    """A grid as its reader takes it.

    Attributes
    ----------
    text
        The grid, with the keys of ESRI.
    empty
        The number of empty cells, or a word.
    is_declared
        Whether the head has it.
    words
        Words in cells that stand for no number, and are not that of the head.
    """

    text: str
    empty: float | str
    is_declared: bool
    words: tuple[str, ...]


def _check_grid(text: str, where: str) -> _Grid:
    """Refuse a grid that its reader would take for another one.

    It takes a word for 0, a decimal comma for a point, an unknown key for none, and a
    file that is cut off for a whole one.
    """
    lines = text.splitlines()
    head, before = _head_of_grid(lines, where)
    given = dict(head)
    is_declared = EMPTY in head
    empty = head.pop(EMPTY, UNNAMED_EMPTY)
    sizes = _sizes_in_head(head, where)
    is_word = empty.lower() in EMPTY_WORDS
    widths = _widths(lines[before:], before, where)
    _check_counts(widths, sizes["ncols"], sizes["nrows"], where)
    body = "\n".join(lines[before:])
    found = dict.fromkeys(OF_EMPTY.findall(body))
    if is_word or found:
        body = OF_EMPTY.sub("nan", body)
    if is_word:
        given[EMPTY] = "nan"
    written = "".join(f"{key} {value}\n" for key, value in given.items())
    mark = empty if is_word else _number(empty, f"{where}: {EMPTY}")
    words = tuple(word for word in found if word.lower() != empty.lower())
    return _Grid(f"{written}{body}\n", mark, is_declared, words)


def _sizes_in_head(head: Mapping[str, str], where: str) -> dict[str, float]:
    """The numbers of a head by their keys."""
    sizes = {key: _number(word, f"{where}: {key}") for key, word in head.items()}
    for key, value in sizes.items():
        is_step = key in STEPS
        if not np.isfinite(value) or (is_step and value <= 0):
            remedy = "a length above 0" if is_step else "a number"
            raise InputError(f"{key} {value:g}", where, remedy)
    return sizes


def _check_counts(widths: list[int], columns: float, rows: float, where: str) -> None:
    """Refuse a grid whose lines have other counts of numbers than its head."""
    if columns % 1 or columns * rows != sum(widths):
        what = f"{sum(widths)} numbers, not {columns:.9g} x {rows:.9g}"
        raise InputError(what, where, "nrows lines of ncols numbers")
    if {*widths} == {rows} and rows != columns:
        what = f"its lines have {rows:.9g} numbers, and ncols is {columns:.9g}"
        raise InputError(what, where, "are ncols and nrows exchanged?")


def _key_of(word: str) -> str:
    """The key of a grid that a word is, or the word itself in small letters."""
    key = word.lower().rstrip(":=")
    return SYNONYMS.get(key, key)


def _head_of_grid(lines: list[str], where: str) -> tuple[dict[str, str], int]:
    """The words at the head of a grid by their keys, and how many lines it has."""
    head: dict[str, str] = {}
    before = 0
    for line in lines:
        words = re.split(r"[\s:=]+", line.strip().strip(":="))
        if not words[0] or COMMENT.match(line):
            before += 1
            continue
        is_mark = words[0].lower() in EMPTY_WORDS and ":" not in line
        if not words[0][0].isalpha() or is_mark or len(words) != 2:
            break
        key = _key_of(words[0])
        if key in head:
            raise InputError(f"{key} stands twice", where, "remove one of the lines")
        if key not in (*GRID_KEYS, *GRASS_KEYS):
            what = f"{words[0]} is no key of a grid"
            remedy = f"its head has {', '.join(GRID_KEYS)}; or {', '.join(GRASS_KEYS)}"
            raise InputError(what, where, remedy)
        head[key] = words[1]
        before += 1
    if any(key in head for key in GRASS_KEYS):
        head = _of_edges(head, where)
    for one, others in NEEDED.items():
        if one in head and others & head.keys():
            what = f"its head has {one} and {' and '.join(others & head.keys())}"
            raise InputError(what, where, "leave one of the two")
        if one not in head and not (others and others <= head.keys()):
            remedy = "its head has ncols, nrows, xllcorner, yllcorner, cellsize"
            raise InputError(f"{one} is missing", where, remedy)
    return head, before


def _of_edges(head: Mapping[str, str], where: str) -> dict[str, str]:
    """The head of a grid of GRASS with the keys of ESRI."""
    for key in (*GRASS_KEYS, "ncols", "nrows"):
        if key not in head:
            remedy = f"its head has {', '.join(GRASS_KEYS)}, rows and cols"
            raise InputError(f"{key} is missing", where, remedy)
    north, south, east, west, columns, rows = (
        _number(head[key], f"{where}: {key}") for key in (*GRASS_KEYS, "ncols", "nrows")
    )
    if not (north > south and east > west and columns >= 1 and rows >= 1):
        what = f"north {north:g}, south {south:g}, east {east:g}, west {west:g}"
        raise InputError(what, where, "north lies above south, and east above west")
    made = {
        "ncols": head["ncols"],
        "nrows": head["nrows"],
        "xllcorner": head["west"],
        "yllcorner": head["south"],
        "dx": repr((east - west) / columns),
        "dy": repr((north - south) / rows),
    }
    return made | ({EMPTY: head[EMPTY]} if EMPTY in head else {"nodata_value": "*"})


def _widths(lines: list[str], before: int, where: str) -> list[int]:
    """How many heights each line has; `before` lines stand before them in the file."""
    widths = []
    for place, line in enumerate(lines, before + 1):
        words = line.split()
        for each in words:
            if each.lower() not in EMPTY_WORDS:
                _number(each, f"{where}: line {place}")
        if words:
            widths.append(len(words))
    return widths


def _number(word: str, where: str) -> float:
    """The number that a word is; an `InputError` for any other word."""
    try:
        return number(word)
    except ValueError:
        remedy = GRID_REMEDY
        raise InputError(f"{word!r} is no number", where, remedy) from None


def _system_beside(path: Path, where: str) -> tuple[Any, RasterUnits]:
    """The coordinate reference system in the file .prj beside a grid, and its units.

    It is None without the file, and where the file is of the old kind of Arc/Info.
    """
    if not path.is_file():
        return None, RasterUnits()
    library = rasterio(where)
    where = f"{where}: {path.name}"
    text = decoded(read_bytes(path, LARGEST_PROJECTION, where), where, is_data=True)
    if UNIT_OF_ARCINFO.search(text):
        return None, units_of_arcinfo(text, path.name, where)
    try:
        with library.Env():  # what PROJ says goes nowhere else
            system = library.crs.CRS.from_wkt(text, morph_from_esri_dialect=True)
    except library.errors.CRSError:
        what = "it is no coordinate system in well-known text"
        raise InputError(what, where, "remove it, if all lengths are in m") from None
    return system, units_of(system, where, path.name)


def geotiff(x: FloatArray, y: FloatArray, values: ArrayLike, system: str) -> bytes:
    """Write a map as a GeoTIFF of 32-bit numbers, for a GIS.

    Parameters
    ----------
    x, y
        Axes to the middles of its cells, m, rising, of shapes (nx,) and (ny,).
    values
        The map, of shape (ny, nx), NaN where it has no value.
    system
        Coordinate reference system as well-known text; empty without any.

    Returns
    -------
    bytes
        The file.
    """
    library = rasterio("maps")
    rows = np.asarray(values, np.float32)[::-1]
    # the axes of a map have the unit of its system
    unit = 1.0
    if system:
        unit = units_of(library.crs.CRS.from_wkt(system), "maps").of_axes("maps")
    x, y = x / unit, y / unit
    step_x = float(np.ptp(x)) / (len(x) - 1)
    step_y = float(np.ptp(y)) / (len(y) - 1)
    west, north = float(x[0]) - step_x / 2, float(y[-1]) + step_y / 2
    with library.MemoryFile() as memory:
        with memory.open(
            driver="GTiff",
            width=len(x),
            height=len(y),
            count=1,
            dtype="float32",
            nodata=np.nan,
            compress="lzw",
            crs=system or None,
            transform=library.Affine(step_x, 0.0, west, 0.0, -step_y, north),
        ) as dataset:
            dataset.write(rows, 1)
        return bytes(memory.read())
