"""Units of rasters: what a coordinate system, a band or a file beside a grid says."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from orchestrator.errors import InputError
from orchestrator.study.lengths import LENGTHS, shown_unit

UNIT_OF_ARCINFO = re.compile(r"^\s*(z?)units\s+(\w+)", re.IGNORECASE | re.MULTILINE)
"""Units of heights, with a z, and of axes in a file .prj of Arc/Info."""
UNSAID = "no"
"""Its word for no unit of the heights."""
UNIT_OFF = 1e-4
"""Largest difference of a unit from the metre, m: the German legal metre."""


class RasterUnits(NamedTuple):
    """The units of a raster, as far as its file says them.

    Attributes
    ----------
    name
        What says them: a coordinate system, or a file beside the raster.
    axes
        The unit of its axes, m; 0 for angles, None where nothing says it.
    axes_unit
        The same by its name.
    heights
        The name of the unit of its heights, one of `LENGTHS`; empty where nothing says
        it.
    """

    name: str = ""
    axes: float | None = None
    axes_unit: str = ""
    heights: str = ""

    def with_band(self, unit: str | None, where: str) -> "RasterUnits":
        """Give the same with the unit of its band.

        Parameters
        ----------
        unit
            The unit, as the file writes it.
        where
            The file and the field that names it, for messages.

        Returns
        -------
        RasterUnits
            The units.

        Raises
        ------
        InputError
            For an unknown unit, and for one that contradicts the coordinate system.
        """
        if not unit:
            return self
        known = unit_named(unit)
        if known is None:
            what = f"its heights are in {unit}, of unknown length"
            raise InputError(what, where, "gdal_edit -units m, or ft, in, cm, mm")
        if self.heights and not _is_near(LENGTHS[known], LENGTHS[self.heights]):
            what = f"its heights are in {unit}, by {self.name} in {self.heights}"
            raise InputError(what, where, "mend one of them: gdal_edit -units")
        return self._replace(heights=known)

    def of_axes(self, where: str) -> float:
        """Give the unit of its axes.

        Parameters
        ----------
        where
            The file and the field that names it, for messages.

        Returns
        -------
        float
            The unit, m; 1 where nothing says it.

        Raises
        ------
        InputError
            If they are angles.
        """
        if self.axes == 0:
            what = f"by {self.name} its axes are degrees of longitude and latitude"
            remedy = (
                "project it to metres, with gdalwarp -t_srs EPSG:326NN, NN the zone"
            )
            raise InputError(what, where, remedy)
        if self.axes is None or _is_near(self.axes, 1.0):
            return 1.0
        return self.axes

    def of_heights(self, where: str) -> str:
        """Give the unit of its heights.

        Parameters
        ----------
        where
            The file and the field that names it, for messages.

        Returns
        -------
        str
            One of `LENGTHS`: the metre where nothing says another unit of its axes, or
            of them.

        Raises
        ------
        InputError
            If its axes are in another unit than the metre, and nothing says that of its
            heights.
        """
        axes = self.of_axes(where)
        if self.heights or _is_near(axes, 1.0):
            return self.heights or "m"
        what = f"its axes are in {self.axes_unit} by {self.name}"
        what = f"{what}, and nothing says the unit of its heights"
        remedy = "gdal_edit -units ft, or m; of an .asc make a .tif with gdal_translate"
        raise InputError(what, where, remedy)

    @property
    def said(self) -> tuple[str, ...]:
        """What was understood of them, in words; a metre and no more is not said."""
        words = []
        if self.axes and not _is_near(self.axes, 1.0):
            words.append(f"axes in {self.axes_unit}, {self.axes:.7g} m each")
        if self.heights and LENGTHS[self.heights] != 1:
            words.append(f"heights in {shown_unit(self.heights)}")
        return tuple(words) or (("in m",) if self.name else ())


def unit_named(word: str) -> str | None:
    """Find a unit of lengths.

    Parameters
    ----------
    word
        Its name as a file writes it.

    Returns
    -------
    str or None
        Its name in `LENGTHS`.
    """
    name = word.strip().lower()
    return next((each for each in (name, f"{name}s") if each in LENGTHS), None)


def _is_near(one: float, other: float) -> bool:
    """Whether two units are one, but for the German legal metre."""
    return abs(one / other - 1) <= UNIT_OFF


def units_of(system: Any, where: str, file: str = "") -> RasterUnits:
    """Find the units that a coordinate system says.

    Parameters
    ----------
    system
        The system, as rasterio has it; None without one.
    where
        The file and the field that names it, for messages.
    file
        The name of the file beside the raster that has it, if it is in one.

    Returns
    -------
    RasterUnits
        The units.

    Raises
    ------
    InputError
        For heights in an unknown unit.
    """
    if system is None:
        return RasterUnits()
    described = system.to_dict(projjson=True)
    code = system.to_epsg()
    name = f"EPSG:{code}" if code else described["name"]
    found = RasterUnits(f"{name} in {file}" if file else name)
    for quantity, unit, metres in _units(described):
        if quantity == "axes":
            found = found._replace(axes=metres or 0.0, axes_unit=unit)
            continue
        known = "m" if metres and _is_near(metres, 1.0) else unit_named(unit)
        if known is None or metres is None or not _is_near(LENGTHS[known], metres):
            what = f"by {found.name} its heights are in {unit}, of unknown length"
            raise InputError(what, where, "they must be in m: gdalwarp -t_srs")
        found = found._replace(heights=known)
    return found


def _units(described: Mapping[str, Any]) -> Iterator[tuple[str, str, float | None]]:
    """What the axes of a system measure, their units, and these in m; None of angles.

    The system is described by PROJJSON.
    """
    parts = described.get("components") or [described.get("source_crs", described)]
    for part in parts:
        quantity = "heights" if part["type"] == "VerticalCRS" else "axes"
        for axis in part["coordinate_system"]["axis"]:
            unit = axis["unit"]
            if isinstance(unit, str):
                yield quantity, unit, 1.0 if unit == "metre" else None
            else:
                is_angle = unit["type"] == "AngularUnit"
                metres = None if is_angle else unit["conversion_factor"]
                yield quantity, unit["name"], metres


def units_of_arcinfo(text: str, name: str, where: str) -> RasterUnits:
    """Read the units in a file .prj of Arc/Info.

    Parameters
    ----------
    text
        The file.
    name
        Its name.
    where
        The file and the field that names it, for messages.

    Returns
    -------
    RasterUnits
        The units.

    Raises
    ------
    InputError
        For an unknown unit.
    """
    found = RasterUnits(name)
    for is_of_heights, word in UNIT_OF_ARCINFO.findall(text):
        if word.lower() == UNSAID:
            continue
        unit = unit_named(word)
        if unit is None and not word.lower().startswith(("dd", "deg", "dms")):
            what = f"its lengths are in {word}, of unknown length"
            raise InputError(what, where, "project it to metres, with gdalwarp -t_srs")
        if is_of_heights:
            found = found._replace(heights=unit or "")
        else:
            found = found._replace(axes=LENGTHS[unit] if unit else 0.0, axes_unit=word)
    return found
