"""A map of the bed stress of a hydraulic model over the threshold of a grain.

The stress is read from a raster and divided by the threshold stress tau_c of one grain.
The ratio tau/tau_c is that of the Shields numbers, theta/theta_c, too. The map has
three bands: by the threshold, and by the upper and the lower end of its interval.
"""

from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import Normalize, TwoSlopeNorm
from matplotlib.figure import Figure as Canvas

from orchestrator.calculator import cli
from orchestrator.calculator.answer import grain_card
from orchestrator.digits import FORMAT, plain_number
from orchestrator.errors import InputError
from orchestrator.report import style
from orchestrator.report.card import Card, Number, marked_lines
from orchestrator.report.single import motion_of_grain
from orchestrator.runs import terminal
from orchestrator.runs.files import write_durably
from orchestrator.surface.raster import OpenedRaster, is_empty, opened_raster, rasterio
from orchestrator.types import FloatArray, Row

PASCAL: dict[str, float] = {
    "Pa": 1.0,
    "N/m2": 1.0,
    "kPa": 1e3,
    "dyn/cm2": 0.1,
    "lb/ft2": 47.88025898,
}
"""Units of a stress, in Pa; a pound is that of force."""
SPELT = {
    "pascal": "Pa",
    "pascals": "Pa",
    "n/m^2": "N/m2",
    "n/m²": "N/m2",
    "n m-2": "N/m2",
    "n m**-2": "N/m2",
    "n m^-2": "N/m2",
    "dyne/cm2": "dyn/cm2",
    "dyn/cm^2": "dyn/cm2",
    "dyne/cm^2": "dyn/cm2",
    "lb/ft^2": "lb/ft2",
    "lb/sf": "lb/ft2",
    "lbf/ft2": "lb/ft2",
    "lbf/ft^2": "lb/ft2",
    "lb/sq ft": "lb/ft2",
    "psf": "lb/ft2",
}
"""Other spellings of them, in small letters."""
LARGEST_STRESS = 1e4
"""Stress above which no water acts on a bed, Pa: that of a flow 50 m deep on 2 %."""
BANDS = ("tau/tau_c", "tau/tau_c, low end", "tau/tau_c, high end")
"""Names of the bands of the map; the ends are those of the ratio."""
EARTH_M = 6_371_007.2
"""Radius of the sphere with the area of the Earth, m."""
CELLS_AT_ONCE = 2_000_000
"""Cells that are read at a time."""
MOST_PIXELS = 1200
"""Pixels of the picture along either side, at most: others are left out of it."""
LOOKS = (("black", "-"), ("white", ":"), ("0.3", "--"))
"""Colour and dashes of the line of 1 by each band."""
FINEST, LARGEST = 0.0, 4.0
"""Ends of the colours, at most."""
WHERE = "--stress"


@dataclass
class Summary:
    """What a map has, counted while it is written.

    Attributes
    ----------
    cells, empty
        Number of its cells, and of those without a stress.
    area
        Area of those with a stress, m2, or their number.
    above
        Area above the threshold, by the bands.
    least, most
        Ends of the stress, Pa.
    """

    cells: int = 0
    empty: int = 0
    area: float = 0.0
    above: list[float] = field(default_factory=lambda: [0.0] * len(BANDS))
    least: float = np.inf
    most: float = -np.inf

    def add(self, stress: FloatArray, ratios: FloatArray, areas: FloatArray) -> None:
        """Count some rows of the map.

        Parameters
        ----------
        stress
            Their stress, Pa, NaN in empty cells, shape (rows, columns).
        ratios
            The bands, of shape (3, rows, columns).
        areas
            Area of a cell of each row, m2, shape (rows,).
        """
        has_stress = ~np.isnan(stress)
        self.cells += stress.size
        self.empty += int(np.count_nonzero(~has_stress))
        self.area += float((has_stress.sum(axis=1) * areas).sum())
        for band, ratio in enumerate(ratios):
            self.above[band] += float(((ratio > 1).sum(axis=1) * areas).sum())
        if has_stress.any():
            self.least = min(self.least, float(np.nanmin(stress)))
            self.most = max(self.most, float(np.nanmax(stress)))


def run_stress_map(options: Namespace) -> int:
    """Map the stress of a raster over the threshold of a grain.

    Parameters
    ----------
    options
        The options of the command `threshold`, with a raster.

    Returns
    -------
    int
        The exit code.

    Raises
    ------
    InputError
        If an option or the raster is refused.
    """
    for form in ("csv", "json"):
        if getattr(options, form):
            remedy = "leave it out: the numbers are in stress_ratio.csv"
            raise InputError("a map is not printed", f"--{form}", remedy)
    rows = _rows(options)
    row = next(each for each in rows if each["answer"])
    path: Path = options.stress
    where = f"{WHERE} {path}"
    out = options.out or Path("results") / f"stress-{path.stem}"
    with opened_raster(path, where) as opened:
        unit, is_told = _unit(opened, options.stress_unit, where)
        summary = _written(opened, row, PASCAL[unit], out, where)
        sizes = _sizes(opened)
        picture = _picture(opened, row, PASCAL[unit])
    write_durably(out / "stress_ratio.png", picture)
    said = _summary(summary, row, unit, sizes)
    text = pd.DataFrame([said]).to_csv(index=False, float_format=FORMAT)
    write_durably(out / "stress_ratio.csv", text)
    card = _card(path.name, summary, rows, sizes)
    print(terminal.shown("\n".join(marked_lines(card))))
    print()
    if not is_told:
        print("The file names no unit: its numbers are taken as Pa (--stress-unit).")
    for name in ("stress_ratio.tif", "stress_ratio.png", "stress_ratio.csv"):
        print(out / name)
    return 0


def _rows(options: Namespace) -> list[Row]:
    """The rows of one grain, by every law."""
    table, axes = cli.table_of(options)
    for name, axis in axes.items():
        if len(axis) > 1:
            remedy = "give one number, and run it for each"
            raise InputError("a map is of one grain", cli.OPTIONS[name], remedy)
    cells = zip(*(column.tolist() for column in table.values()), strict=True)
    rows = [dict(zip(table, row, strict=True)) for row in cells]
    row = next(each for each in rows if each["answer"])
    if not 0 < row["stress_pa"] < np.inf:
        remedy = "choose another grain or slope"
        raise InputError("the grain has no threshold stress", WHERE, remedy)
    return rows


def _unit(opened: OpenedRaster, asked: str | None, where: str) -> tuple[str, bool]:
    """The unit of a stress, and whether the file or the user names it."""
    told = (opened.dataset.units[0] or "").strip()
    if asked is None and not told:
        return "Pa", False
    found = []
    for text, place in ((asked, "--stress-unit"), (told, where)):
        if not text:
            continue
        spelt = {name.lower(): name for name in PASCAL} | SPELT
        unit = spelt.get(text.strip().lower())
        if unit is None:
            what = f"{text!r} is no unit of a stress"
            raise InputError(what, place, f"choose --stress-unit {', '.join(PASCAL)}")
        found.append(unit)
    if len({PASCAL[unit] for unit in found}) > 1:
        what = f"the file says {told}, and --stress-unit {asked}"
        raise InputError(what, where, "leave --stress-unit out, or mend the file")
    return found[0], True


def _sizes(opened: OpenedRaster) -> tuple[FloatArray, str]:
    """The area of a cell of each row, and its unit: m2, or cells."""
    dataset, system = opened.dataset, opened.system
    transform = dataset.transform
    count = dataset.height
    if transform.is_identity:
        return np.ones(count), "cells"
    across = abs(transform.a * transform.e - transform.b * transform.d)
    if system is not None and system.is_geographic:
        edges = transform.f + transform.e * np.arange(count + 1)
        sines = np.sin(np.radians(np.clip(edges, -90, 90)))
        width = float(np.radians(abs(transform.a)))
        return np.abs(np.diff(sines)) * width * EARTH_M**2, "m2"
    metres = opened.units.axes or 1.0
    return np.full(count, across * metres**2), "m2"


def _windows(opened: OpenedRaster) -> Iterator[Any]:
    """Windows of some whole rows, which cover a raster."""
    dataset = opened.dataset
    rows = max(1, CELLS_AT_ONCE // dataset.width)
    window = rasterio(WHERE).windows.Window
    for first in range(0, dataset.height, rows):
        count = min(rows, dataset.height - first)
        yield window(0, first, dataset.width, count)


def _stress(opened: OpenedRaster, unit: float, where: str, **part: Any) -> FloatArray:
    """The stress of a part of a raster, Pa, NaN in empty cells."""
    dataset, empty = opened.dataset, opened.empty
    try:
        stored = dataset.read(1, masked=True, **part)
    except rasterio(WHERE).errors.RasterioError as error:
        what = f"its cells are not readable: {error}"
        raise InputError(what, where, "is the file cut off?") from None
    values = np.ma.getdata(stored).astype(float)
    lacks = np.ma.getmaskarray(stored) | is_empty(values, empty) | np.isnan(values)
    stress = unit * (values * dataset.scales[0] + dataset.offsets[0])
    stress[lacks] = np.nan
    _check(stress, values, where)
    return np.asarray(stress)


def _check(stress: FloatArray, stored: FloatArray, where: str) -> None:
    """Refuse numbers that are no stress."""
    with np.errstate(invalid="ignore"):
        is_wrong = (stress < 0) | (stress > LARGEST_STRESS)
    if not is_wrong.any():
        return
    value = float(stored[is_wrong][0])
    count = int(np.count_nonzero(is_wrong & (stored == value)))
    if value < 0 or abs(value) > 1e30:
        what = f"{value:.9g} in {count} cells looks like a cell without a stress"
        remedy = f"declare it: gdal_edit -a_nodata {value:.9g}, or NODATA_value in .asc"
    else:
        what = f"a stress of {float(stress[is_wrong][0]):.4g} Pa is beyond all beds"
        remedy = "is it in another unit, or a height? --stress-unit names the unit"
    raise InputError(what, where, remedy)


def _ratios(stress: FloatArray, row: Row) -> FloatArray:
    """The bands of a map, NaN where there is no stress or no interval."""
    ends = (row["stress_pa"], row["stress_high_pa"], row["stress_low_pa"])
    return np.stack([stress / end for end in ends])


def _written(
    opened: OpenedRaster, row: Row, unit: float, out: Path, where: str
) -> Summary:
    """Write the map as a GeoTIFF, and count what it has."""
    dataset, system = opened.dataset, opened.system
    _check_kind(dataset, where)
    library = rasterio(WHERE)
    areas, _ = _sizes(opened)
    summary = Summary()
    profile = {
        "driver": "GTiff",
        "width": dataset.width,
        "height": dataset.height,
        "count": len(BANDS),
        "dtype": "float32",
        "nodata": np.nan,
        "compress": "lzw",
        "crs": system,
        "transform": dataset.transform,
        "bigtiff": "if_safer",
    }
    with library.MemoryFile() as memory:
        with memory.open(**profile) as written:
            for window in _windows(opened):
                stress = _stress(opened, unit, where, window=window)
                ratios = _ratios(stress, row)
                written.write(ratios.astype(np.float32), window=window)
                first = window.row_off
                summary.add(stress, ratios, areas[first : first + window.height])
            for band, name in enumerate(BANDS, 1):
                written.set_band_description(band, name)
                written.set_band_unit(band, "1")
            written.update_tags(
                threshold_stress_pa=FORMAT % row["stress_pa"],
                threshold_stress_low_pa=FORMAT % row["stress_low_pa"],
                threshold_stress_high_pa=FORMAT % row["stress_high_pa"],
                diameter_m=FORMAT % row["d_m"],
            )
        content = bytes(memory.read())
    if summary.empty == summary.cells:
        raise InputError("no cell has a stress", where, "is its nodata value right?")
    out.mkdir(parents=True, exist_ok=True)
    write_durably(out / "stress_ratio.tif", content)
    return summary


def _check_kind(dataset: Any, where: str) -> None:
    """Refuse a raster of several bands, and pictures."""
    kinds = {*dataset.dtypes}
    if dataset.count != 1:
        what = f"it has {dataset.count} bands"
        remedy = "write the one of the stress: gdal_translate -b 1"
        raise InputError(what, where, remedy)
    if kinds & {"uint8", "int8"} or any(kind.startswith("complex") for kind in kinds):
        what = f"its cells are {', '.join(kinds)}, a picture"
        raise InputError(what, where, "export the stress as 32-bit numbers")


def _summary(
    summary: Summary, row: Row, unit: str, sizes: tuple[FloatArray, str]
) -> Row:
    """The row of the table of a map."""
    area_of = "area_m2" if sizes[1] == "m2" else "cells_with_stress"
    above_of = "area_above_1" if sizes[1] == "m2" else "cells_above_1"
    ending = "_m2" if sizes[1] == "m2" else ""
    middle, low, high = summary.above
    has_interval = bool(np.isfinite(row["stress_low_pa"]))
    return {
        "d_m": row["d_m"],
        "force_law": row["law"],
        "threshold_stress_pa": row["stress_pa"],
        "threshold_stress_low_pa": row["stress_low_pa"],
        "threshold_stress_high_pa": row["stress_high_pa"],
        "threshold_shields": row["shields"],
        "verdict": row["verdict"],
        "why_not": row["why_not"],
        "unit_of_file": unit,
        "least_stress_pa": summary.least,
        "most_stress_pa": summary.most,
        "cells": summary.cells,
        "empty_cells": summary.empty,
        area_of: summary.area,
        f"{above_of}{ending}": middle,
        f"{above_of}_low{ending}": low if has_interval else np.nan,
        f"{above_of}_high{ending}": high if has_interval else np.nan,
    }


def _card(
    name: str, summary: Summary, rows: list[Row], sizes: tuple[FloatArray, str]
) -> Card:
    """The answer card of a map."""
    of_grain = grain_card(rows)
    row = next(each for each in rows if each["answer"])
    has_interval = bool(np.isfinite(row["stress_low_pa"]))
    middle, low, high = (100 * above / summary.area for above in summary.above)
    unit = sizes[1]
    scale, shown = 1.0, "cells"
    if unit == "m2":
        scale, shown = (1e-6, "km²") if summary.area > 1e6 else (1.0, "m²")
    nan = float("nan")
    numbers = (
        Number(
            middle,
            "%",
            "of the bed has a stress above the threshold",
            f"{100 * summary.empty / summary.cells:.3g} % of the cells are empty",
            low=low if has_interval else nan,
            high=high if has_interval else nan,
            interval_of="by the ends of the interval of the threshold",
        ),
        Number(
            scale * summary.above[0],
            shown,
            "its area",
            f"of {plain_number(scale * summary.area, 4)} {shown} with a stress of "
            f"{summary.least:.3g} … {summary.most:.3g} Pa",
            low=scale * summary.above[1] if has_interval else nan,
            high=scale * summary.above[2] if has_interval else nan,
        ),
        of_grain.numbers[-1],
    )
    return Card(
        f"Where on {name} does {motion_of_grain(row)}?",
        of_grain.scene,
        numbers,
        of_grain.source,
        of_grain.worth,
    )


def _picture(opened: OpenedRaster, row: Row, unit: float) -> bytes:
    """The picture of a map: its ratio, and lines of 1 by the threshold and its ends."""
    dataset = opened.dataset
    most = max(dataset.width, dataset.height)
    step = max(1.0, most / MOST_PIXELS)
    shape = (max(1, round(dataset.height / step)), max(1, round(dataset.width / step)))
    stress = _stress(opened, unit, WHERE, out_shape=shape)
    ratios = _ratios(stress, row)
    with style.settings(style.LETTERS):
        canvas = _drawn(opened, ratios)
        return style.as_png(canvas)


def _drawn(opened: OpenedRaster, ratios: FloatArray) -> Canvas:
    """The drawing of a map."""
    ratio = ratios[0]
    extent, labels = _extent(opened.dataset)
    aspect = abs(extent[3] - extent[2]) / abs(extent[1] - extent[0])
    width = style.WIDE
    height = min(max(0.75 * width * aspect, 2.0), 1.4 * width)
    canvas = style.canvas(height, width)
    ax = canvas.subplots()
    ax.set_facecolor("0.9")
    highest = min(float(np.nanquantile(ratio, 0.99)), LARGEST)
    norm: Normalize = Normalize(FINEST, max(highest, 1e-9))
    if highest > 1:
        norm = TwoSlopeNorm(1.0, FINEST, highest)
    image = ax.imshow(
        ratio,
        cmap="RdBu_r" if highest > 1 else "Blues_r",
        norm=norm,
        extent=extent,
        interpolation="nearest",
    )
    for band, (colour, dashes) in zip(ratios, LOOKS, strict=True):
        known = band[np.isfinite(band)]
        if len(known) and known.min() < 1 < known.max() and min(band.shape) > 1:
            look: style.Look = {"colors": colour, "linestyles": dashes}
            look |= {"linewidths": 0.8, "origin": "upper", "extent": extent}
            ax.contour(band, [1.0], **look)
    ax.set(xlabel=labels[0], ylabel=labels[1])
    ax.ticklabel_format(useOffset=False, style="plain")
    ax.tick_params(axis="x", rotation=30)
    words = "lines: τ_b = τ_c (full), its upper (dotted) and lower end (dashed)\n"
    words += "grey: no stress"
    canvas.colorbar(image, ax=ax, label="τ_b/τ_c = θ/θ_c", shrink=0.8, extend="max")
    ax.set_title(words, loc="left")
    return canvas


def _extent(
    dataset: Any,
) -> tuple[tuple[float, float, float, float], tuple[str, str]]:
    """Ends of a map, and what its axes are: cells, where these are turned."""
    transform = dataset.transform
    if transform.is_identity or transform.b or transform.d:
        ends = (0.0, float(dataset.width), float(dataset.height), 0.0)
        return ends, ("column", "row")
    left, bottom, right, top = dataset.bounds
    return (left, right, bottom, top), ("x", "y (north)")
