"""A bed in three dimensions: heights on a raster, as a file has them or by a shape.

The axes are those of the file, x to the east and y to the north. Heights are counted
from the ground around the form: a plane, level or with a gentle fall. A heap is what
rises above it.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from math import atan2, degrees, hypot, pi, radians, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.digits import number as counted
from orchestrator.digits import on_grid
from orchestrator.errors import InputError
from orchestrator.study.noise import MEDIAN
from orchestrator.types import BoolArray, FloatArray, IntArray

SPREAD_OF_RASTER = 0.75
SPREAD_OF_SHAPE = 0.5
"""Standard deviation of the smoothing over the length of a cell, of the flow's mesh."""
NODES_OF_SPREAD = 4.0
"""Nodes of a smoothed surface in the standard deviation of its smoothing."""
TRUNCATED = 4.0
"""Standard deviations at which the weights of the smoothing end."""
MOST_NODES = 4_000_000
FEWEST = 8
"""Fewest nodes of a raster along each axis."""
FLAT_RIM = 0.02
TAPERED_RIM = 0.2
"""Largest height of the rim over that of the form which is flat, and which is
tapered."""
TAPER = 10.0
"""Width over which the rim is tapered, over its largest height."""
SPIKE_STEPS = 3.0
SPIKE_RELIEF = 0.05
"""Steps of the raster, and part of the height, which a bad cell is off its
neighbours."""
STEEPEST_DEG = 60.0
"""Slope beyond which no mesh of upright columns follows the bed."""
FORM_NODES = 12
"""Fewest nodes of a raster above half the height of the form."""
OF_GROUND = 0.01
"""Height over that of the form from which a place is a part of it, not of the
ground."""
NOISE = 4.0
"""Standard deviations of the rim's heights off its plane within which a place is
ground, too."""
HEAP = 0.1
"""Height over that of the highest heap from which a rise is a heap, too: twice that of
a bad cell."""
STEEPEST_GROUND_DEG = 5.0
"""Slope of the ground beyond which a heap on it is no heap on level ground."""
HALVINGS = 60
"""Steps in which the plane of a rim is found: all digits."""
TOUCHING = np.ones((3, 3), bool)
"""Nodes that touch one, also at a corner."""
STEPS_OF_SHAPE = 160
"""Steps of the raster of a shape over the width of its base."""
SLIP_DEG = 33.0
"""Slope of a barchan's slip face."""
HORNS = 0.8
"""Length of a barchan's horns beyond its brink, over that of its windward side."""


@dataclass(frozen=True)
class Plane:
    """The ground around a form: a plane.

    Attributes
    ----------
    height
        Its height at a place, m.
    east, north
        Its rise to the east and to the north, m/m.
    x, y
        The place, m.
    """

    height: float = 0.0
    east: float = 0.0
    north: float = 0.0
    x: float = 0.0
    y: float = 0.0

    def at(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Give its heights.

        Parameters
        ----------
        x, y
            Places, m, which broadcast.

        Returns
        -------
        FloatArray
            Heights, m, of the broadcast shape.
        """
        rise = self.east * (x - self.x) + self.north * (y - self.y)
        return np.asarray(self.height + rise)

    @property
    def fall(self) -> float:
        """Its fall along the steepest way down, m/m."""
        return hypot(self.east, self.north)

    @property
    def towards_deg(self) -> float:
        """Where it falls to, degrees from north (+y) over east (+x)."""
        return degrees(atan2(-self.east, -self.north)) % 360

    def __str__(self) -> str:
        return f"{100 * self.fall:.2g} % towards {self.towards_deg:.0f}°"


class Heap(NamedTuple):
    """A part of a surface that rises from the ground, apart from all others.

    Attributes
    ----------
    x, y
        The middle of its extent, m.
    height
        Height of its highest place above the ground, m.
    radius
        Distance from the middle within which the whole heap lies, m.
    """

    x: float
    y: float
    height: float
    radius: float


@dataclass(frozen=True)
class Surface:
    """Heights of a bed on a raster with equal steps.

    Two surfaces with one digest are one.

    Attributes
    ----------
    name
        The name of the file or of the shape.
    x, y
        Axes of the raster, m, rising, of shapes (nx,) and (ny,): east and north.
    z
        Heights as the file has them, m, of shape (ny, nx).
    ground
        The ground around the form.
    spread
        Standard deviation of the smoothing, in cells of the flow's mesh.
    said
        What was done to the heights, in words.
    system
        Coordinate reference system as well-known text; empty without any.
    noise
        Standard deviation of the heights of the rim off the ground, m.
    digest
        SHA-256 of the axes, of the heights above the ground and of the smoothing.
    understood
        What was understood of its file, in words; empty of a shape.
    """

    name: str = field(compare=False)
    x: FloatArray = field(compare=False, repr=False)
    y: FloatArray = field(compare=False, repr=False)
    z: FloatArray = field(compare=False, repr=False)
    ground: Plane = field(compare=False)
    spread: float = field(compare=False)
    said: tuple[str, ...] = field(compare=False)
    system: str = field(compare=False, repr=False)
    noise: float = field(compare=False)
    digest: str
    understood: str = field(default="", compare=False)

    def __str__(self) -> str:
        return f"{self.name} ({self.digest[:12]})"

    @property
    def steps(self) -> tuple[float, float]:
        """Steps of the raster along x and along y, m."""
        along_x = float(np.ptp(self.x)) / (len(self.x) - 1)
        along_y = float(np.ptp(self.y)) / (len(self.y) - 1)
        return along_x, along_y

    @property
    def extent(self) -> tuple[float, float]:
        """Lengths of the raster along x and along y, m."""
        return float(np.ptp(self.x)), float(np.ptp(self.y))

    @cached_property
    def above(self) -> FloatArray:
        """Heights above the ground, m, of shape (ny, nx)."""
        return self.z - self.ground.at(self.x, self.y[:, None])

    @property
    def relief(self) -> float:
        """Height of the highest place above the ground, m."""
        return float(self.above.max())

    @property
    def foot(self) -> float:
        """Height above the ground from which a place is a part of the form, m."""
        return max(OF_GROUND * self.relief, NOISE * self.noise)

    @cached_property
    def is_form(self) -> BoolArray:
        """Whether each node is off the ground, of shape (ny, nx).

        These are heaps, low rises beside them, and pits.
        """
        return self._opened(np.abs(self.above) > self.foot)

    def _opened(self, is_off: BoolArray) -> BoolArray:
        """Nodes off the ground without single ones, which are beyond any noise."""
        from scipy.ndimage import binary_opening

        if not self.noise:
            return is_off
        return np.asarray(binary_opening(is_off, TOUCHING))

    @cached_property
    def heap_numbers(self) -> IntArray:
        """Number of the heap of each node, from 1, of shape (ny, nx); 0 on the ground.

        A heap is a connected part of the form that rises high enough; the highest is
        the first.
        """
        from scipy.ndimage import label, maximum

        parts, count = label(self._opened(self.above > self.foot), TOUCHING)
        tops = np.asarray(maximum(self.above, parts, range(1, count + 1)), float)
        order = np.argsort(-tops, kind="stable")
        highest = order[tops[order] >= HEAP * self.relief]
        numbers = np.zeros(count + 1, int)
        numbers[1 + highest] = np.arange(1, len(highest) + 1)
        return np.asarray(numbers[parts])

    @cached_property
    def heaps(self) -> tuple[Heap, ...]:
        """The heaps in the order of their numbers."""
        found = []
        for number in range(1, int(self.heap_numbers.max()) + 1):
            is_heap = self.heap_numbers == number
            x, y = self._middle(is_heap)
            height = float(self.above[is_heap].max())
            found.append(Heap(x, y, height, self._radius(is_heap, x, y)))
        return tuple(found)

    def heap_at(self, x: FloatArray, y: FloatArray) -> IntArray:
        """Find the heaps on which places lie, by the nodes nearest to them.

        Parameters
        ----------
        x, y
            Places in the axes of the file, m, of one shape.

        Returns
        -------
        IntArray
            Number of the heap of each place; 0 on the ground.
        """
        along_x, along_y = self.steps
        column = np.rint((x - self.x[0]) / along_x).astype(int)
        row = np.rint((y - self.y[0]) / along_y).astype(int)
        rows, columns = self.z.shape
        is_inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        found = np.zeros(np.shape(x), int)
        found[is_inside] = self.heap_numbers[row[is_inside], column[is_inside]]
        return found

    @cached_property
    def centre(self) -> tuple[float, float]:
        """The middle of the form's extent along x and along y, m."""
        return self._middle(self.is_form)

    @cached_property
    def radius(self) -> float:
        """Distance from the centre within which the whole form lies, m."""
        return self._radius(self.is_form, *self.centre)

    def _middle(self, is_part: BoolArray) -> tuple[float, float]:
        """The middle of the extent of some nodes along x and along y, m."""
        of_x = self.x[is_part.any(axis=0)]
        of_y = self.y[is_part.any(axis=1)]
        return float(of_x[0] + of_x[-1]) / 2, float(of_y[0] + of_y[-1]) / 2

    def _radius(self, is_part: BoolArray, x: float, y: float) -> float:
        """Distance from a place within which some nodes lie, m."""
        rows, columns = np.nonzero(is_part)
        return float(np.hypot(self.x[columns] - x, self.y[rows] - y).max())

    @property
    def volume(self) -> float:
        """Volume above the ground, m3."""
        along_x, along_y = self.steps
        return float(self.above.sum()) * along_x * along_y

    @cached_property
    def _coefficients(self) -> FloatArray:
        """Coefficients of the cubic splines through the heights above the ground."""
        from scipy.ndimage import spline_filter

        return np.asarray(spline_filter(self.above, order=3))

    def at(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Interpolate heights by cubic splines.

        Parameters
        ----------
        x, y
            Places on the axes of the file, m, which broadcast.

        Returns
        -------
        FloatArray
            Heights above the ground, m, of the broadcast shape; 0 outside the raster.
        """
        from scipy.ndimage import map_coordinates

        along_x, along_y = self.steps
        east, north = np.broadcast_arrays(x, y)
        column = (east.ravel() - self.x[0]) / along_x
        row = (north.ravel() - self.y[0]) / along_y
        found = map_coordinates(
            self._coefficients, [row, column], order=3, prefilter=False
        )
        return np.asarray(found.reshape(east.shape))

    def spread_over(self, cells: float) -> "Surface":
        """The same heights, to be smoothed over another length.

        Parameters
        ----------
        cells
            Standard deviation of the smoothing, in cells of the flow's mesh.

        Returns
        -------
        Surface
            The surface.
        """
        return surface_of(
            self.name,
            self.x,
            self.y,
            self.z,
            self.ground,
            cells,
            self.said,
            self.system,
            self.noise,
        )

    def smoothed(self, cell_m: float) -> "Surface":
        """Smooth the heights to the cells of a mesh.

        They become means with Gaussian weights, whose standard deviation is `spread`
        cells, on a raster that is no finer than these need.

        Parameters
        ----------
        cell_m
            Horizontal length of the cells, m.

        Returns
        -------
        Surface
            The smoothed surface; where it ends it is at the height of the ground.
        """
        from scipy.ndimage import gaussian_filter

        deviation = self.spread * cell_m
        sigmas = deviation / np.array(self.steps[::-1])
        # the weights reach beyond the raster, over the ground
        rows, columns = np.ceil(TRUNCATED * sigmas).astype(int)
        wide = np.pad(self.above, ((rows, rows), (columns, columns)))
        smooth = gaussian_filter(wide, sigmas, truncate=TRUNCATED, mode="constant")
        y = _beyond(self.y, rows)[:: _thinning(sigmas[0])]
        x = _beyond(self.x, columns)[:: _thinning(sigmas[1])]
        thin = smooth[:: _thinning(sigmas[0]), :: _thinning(sigmas[1])]
        said = (*self.said, f"smoothed over {2 * deviation:.3g} m, to the cells")
        heights = thin + self.ground.at(x, y[:, None])
        return surface_of(
            self.name, x, y, heights, self.ground, self.spread, said, self.system
        )


def _beyond(axis: FloatArray, nodes: int) -> FloatArray:
    """An axis with so many nodes more at each of its ends."""
    step = float(np.ptp(axis)) / (len(axis) - 1)
    before = axis[0] - step * np.arange(nodes, 0, -1)
    after = axis[-1] + step * np.arange(1, nodes + 1)
    return np.concatenate([before, axis, after])


def _thinning(sigma: float) -> int:
    """How many nodes of a smoothed raster one node may stand for."""
    return max(int(sigma / NODES_OF_SPREAD), 1)


def surface_of(
    name: str,
    x: FloatArray,
    y: FloatArray,
    z: FloatArray,
    ground: Plane,
    spread: float,
    said: tuple[str, ...] = (),
    system: str = "",
    noise: float = 0.0,
) -> Surface:
    """Make a surface of its heights, with its digest.

    Parameters
    ----------
    name
        Name of the file or the shape.
    x, y
        Axes of the raster to the east and to the north, m, shapes (nx,) and (ny,).
    z
        Heights as the file has them, m, shape (ny, nx).
    ground
        The ground around the form.
    spread
        Standard deviation of the smoothing, in cells of the flow's mesh.
    said
        What was done to the heights, in words.
    system
        Coordinate reference system as well-known text; empty without any.
    noise
        Standard deviation of the heights of the rim off the ground, m.

    Returns
    -------
    Surface
        The surface.
    """
    above = z - ground.at(x, y[:, None])
    relief = float(above.max())
    of_rim = float(on_grid(noise, relief, 6))
    digest = sha256(f"{spread:g} {of_rim!r}".encode())
    for part in (x - x[0], y - y[0], above):
        digest.update(on_grid(part, relief).astype("<f8").tobytes())
    return Surface(
        name, x, y, z, ground, spread, said, system, noise, digest.hexdigest()
    )


@dataclass(frozen=True)
class Raster:
    """Heights of a file as they are read, NaN where it has none.

    Attributes
    ----------
    name
        The name of the file.
    x, y
        Axes, m, rising, of shapes (nx,) and (ny,).
    z
        Heights, m, of shape (ny, nx).
    system
        Coordinate reference system as well-known text; empty without any.
    understood
        What its file says of its columns, its unit, its system and its empty cells.
    unit
        The unit in which its file has the heights, m.
    """

    name: str
    x: FloatArray
    y: FloatArray
    z: FloatArray
    system: str = ""
    understood: tuple[str, ...] = ()
    unit: float = 1.0

    @property
    def steps(self) -> tuple[float, float]:
        """Steps along x and along y, m."""
        along_x = float(np.ptp(self.x)) / (len(self.x) - 1)
        along_y = float(np.ptp(self.y)) / (len(self.y) - 1)
        return along_x, along_y

    @property
    def said(self) -> str:
        """What was understood of the file, in words, with its extent."""
        empty = int(np.isnan(self.z).sum())
        cells = counted(empty, "cell")
        words = [
            *self.understood,
            f"{len(self.x)} x {len(self.y)} heights, "
            "{:.4g} m by {:.4g} m apart".format(*self.steps),
            f"x {self.x[0]:.9g} to {self.x[-1]:.9g} m, "
            f"y {self.y[0]:.9g} to {self.y[-1]:.9g} m",
            f"heights {np.nanmin(self.z):.6g} to {np.nanmax(self.z):.6g} m",
            f"{cells} without a height" if empty else "no cell without a height",
        ]
        return "; ".join(words)


def checked(raster: Raster, where: str) -> Surface:
    """Make a surface of the raster of a file.

    The rim of what the file covers is the ground, a plane with a gentle fall at most. A
    rim that is nearly plane is tapered to it; cells without a height beyond the rim are
    ground.

    Parameters
    ----------
    raster
        The heights of the file.
    where
        The file and the field that names it, for messages.

    Returns
    -------
    Surface
        The surface; it says what was done to it.

    Raises
    ------
    InputError
        If the raster is no bed of the flow, with the place and the remedy.
    """
    _check_size(raster, where)
    is_outside = _outside(raster, where)
    is_rim = _rim(is_outside)
    ground = _ground(raster, is_rim)
    _check_fall(ground, where)
    heights = ground.at(raster.x, raster.y[:, None])
    above = np.where(is_outside, 0.0, raster.z - heights)
    relief = float(above.max())
    _check_relief(relief, -float(above.min()), where)
    _check_units(raster, above, where)
    _check_cells(raster, above, where)
    rim = np.where(is_rim, above, 0.0)
    noise = _noise(above[is_rim])
    said = (
        *_said_of_fall(raster, ground, relief),
        *_check_noise(noise, relief, where),
        *_check_rim(raster, rim, relief, where),
    )
    if is_outside.any():
        count = int(is_outside.sum())
        said = (
            *said,
            f"continued as level ground over {count} cells without a height around it",
        )
    width = TAPER * float(np.abs(rim).max())
    tapered = above * _taper(raster, is_outside, width)
    surface = surface_of(
        raster.name,
        raster.x,
        raster.y,
        tapered + heights,
        ground,
        SPREAD_OF_RASTER,
        said,
        raster.system,
        noise,
    )
    _check_slopes(surface, where)
    return replace(surface, understood=raster.said)


def _ground(raster: Raster, is_rim: BoolArray) -> Plane:
    """The plane from which the heights of a rim are least off, in the sum of sizes.

    As their median would, it leaves out what a part of the rim is off: the foot of a
    form, a ramp to its side.
    """
    rows, columns = np.nonzero(is_rim)
    middle_x = float(raster.x[0] + raster.x[-1]) / 2
    middle_y = float(raster.y[0] + raster.y[-1]) / 2
    length = max(float(np.ptp(raster.x)), float(np.ptp(raster.y)))
    east = (raster.x[columns] - middle_x) / length
    north = (raster.y[rows] - middle_y) / length
    terms = np.column_stack([np.ones_like(east), east, north])
    level, by_x, by_y = _fit(terms, raster.z[is_rim])
    return Plane(level, by_x / length, by_y / length, middle_x, middle_y)


def _fit(terms: FloatArray, values: FloatArray) -> list[float]:
    """Factors of terms, shape (n, k), whose sum is least off the values, shape (n,)."""
    whole = float(np.ptp(values))
    least = whole
    found = np.array([np.median(values), *np.zeros(terms.shape[1] - 1)])
    for _ in range(HALVINGS if whole else 0):
        # squares over sizes are sizes; the sizes that count as 0 shrink to all digits
        off = np.abs(values - terms @ found)
        root = 1 / np.sqrt(np.maximum(off, least))
        found = np.linalg.lstsq(terms * root[:, None], values * root)[0]
        least = max(least / 2, 1e-12 * whole)
    return [float(factor) for factor in found]


def _check_fall(ground: Plane, where: str) -> None:
    """Refuse ground so steep that a heap on it is no heap on level ground."""
    steepest = tan(radians(STEEPEST_GROUND_DEG))
    if ground.fall > steepest:
        what = f"its ground falls by {ground}, by more than {100 * steepest:.1f} %"
        remedy = (
            "is the rim of the raster ground? Heaps on steeper slopes are not solved"
        )
        raise InputError(what, where, remedy)


def _said_of_fall(raster: Raster, ground: Plane, relief: float) -> tuple[str, ...]:
    """What is said of the fall of the ground, if it is worth a word."""
    drop = abs(ground.east) * np.ptp(raster.x) + abs(ground.north) * np.ptp(raster.y)
    if drop <= OF_GROUND * relief:
        return ()
    what = f"put on level ground: its own falls by {ground}, {drop:.3g} m in all"
    return (f"{what}, and was taken off",)


def _check_noise(noise: float, relief: float, where: str) -> tuple[str, ...]:
    """Refuse ground too rough to tell a form from it; what is said of other ground."""
    foot = NOISE * noise
    if foot > TAPERED_RIM * relief:
        what = f"its rim is off a plane by {noise:.3g} m in standard deviation"
        what = (
            f"{what}, the form is {relief:.3g} m high: it is not told from the ground"
        )
        remedy = "crop the raster to the form with even ground around it"
        raise InputError(what, where, remedy)
    if foot > OF_GROUND * relief:
        return (f"taken for ground below {foot:.2g} m, by the noise of its rim",)
    return ()


def _noise(rim: FloatArray) -> float:
    """Standard deviation of the heights of a rim off the ground, by their median size.

    Ramps to the form's sides, which a rim may have, do not count in it.
    """
    return float(np.median(np.abs(rim))) / MEDIAN


def _place(raster: Raster, row: int, column: int) -> str:
    """A place of a raster in words."""
    return f"x = {raster.x[column]:.9g} m, y = {raster.y[row]:.9g} m"


def _check_size(raster: Raster, where: str) -> None:
    """Refuse a raster of too few or too many cells."""
    rows, columns = raster.z.shape
    size = f"{columns} x {rows} cells"
    if min(rows, columns) < FEWEST:
        what = f"{size} are no surface"
        raise InputError(what, where, f"give {FEWEST} along each axis at least")
    if raster.z.size > MOST_NODES:
        what = f"{size} are more than {MOST_NODES}"
        remedy = "resample it to larger cells, with gdalwarp -tr"
        raise InputError(what, where, remedy)


def _outside(raster: Raster, where: str) -> BoolArray:
    """The cells without a height that reach the edge.

    A hole is refused with its place.
    """
    from scipy.ndimage import label

    is_empty = ~np.isfinite(raster.z)
    rows, columns = np.nonzero(np.isinf(raster.z))
    if len(rows):
        place = _place(raster, rows[0], columns[0])
        remedy = "mark cells without a height as NODATA"
        raise InputError(f"the height at {place} is infinite", where, remedy)
    if is_empty.all():
        raise InputError("no cell has a height", where, "is its NODATA value right?")
    numbered, _ = label(is_empty)
    edges = [numbered[0], numbered[-1], numbered[:, 0], numbered[:, -1]]
    at_edge = np.setdiff1d(np.concatenate(edges), [0])
    is_outside = np.isin(numbered, at_edge)
    rows, columns = np.nonzero(is_empty & ~is_outside)
    if len(rows):
        place = _place(raster, rows[0], columns[0])
        what = f"a hole at {place}; {len(rows)} cells have no height"
        remedy = "fill them, with gdal_fillnodata.py"
        raise InputError(what, where, remedy)
    return np.asarray(is_outside)


def _rim(is_outside: BoolArray) -> BoolArray:
    """The cells with a height beside the edge or beside a cell outside."""
    from scipy.ndimage import binary_erosion

    is_inside = ~is_outside
    return np.asarray(is_inside & ~binary_erosion(is_inside, TOUCHING))


def _check_relief(relief: float, depth: float, where: str) -> None:
    """Refuse a surface that is no form on the ground."""
    if relief <= max(depth, 0.0):
        what = f"it is {relief:.3g} m higher than its rim, and {depth:.3g} m deeper"
        raise InputError(what, where, "a form must rise from the ground around it")


def _check_units(raster: Raster, above: FloatArray, where: str) -> None:
    """Refuse a form whose sides are too steep in the median: a matter of units."""
    by_y, by_x = np.gradient(above, raster.y, raster.x)
    steepness = np.hypot(by_x, by_y)[above > above.max() / 4]
    slope = float(np.degrees(np.arctan(np.median(steepness))))
    if slope > STEEPEST_DEG:
        what = f"its slopes are {slope:.0f} deg in the median, above {STEEPEST_DEG:g}"
        remedy = "are x, y and z all in m? None may be in degrees, feet or millimetres"
        raise InputError(what, where, remedy)


def _check_cells(raster: Raster, above: FloatArray, where: str) -> None:
    """Refuse single cells off all their neighbours, and forms of few cells."""
    from scipy.ndimage import median_filter

    relief = float(above.max())
    off = np.abs(above - median_filter(above, size=3))
    step = float(np.ptp(raster.x)) / (len(raster.x) - 1)
    most = max(SPIKE_STEPS * step, SPIKE_RELIEF * relief)
    row, column = np.unravel_index(int(off.argmax()), off.shape)
    if off[row, column] > most:
        place = _place(raster, int(row), int(column))
        what = f"the cell at {place} is {off[row, column]:.4g} m off its neighbours"
        remedy = "replace it by their mean, or mark it as NODATA and fill it"
        raise InputError(what, where, remedy)
    nodes = int((above > relief / 2).sum())
    if nodes < FORM_NODES:
        what = f"only {nodes} cells are above half its height of {relief:.4g} m"
        remedy = "give a raster of smaller cells"
        raise InputError(what, where, remedy)


def _check_rim(
    raster: Raster, rim: FloatArray, relief: float, where: str
) -> tuple[str, ...]:
    """Refuse a rim that is no plane; what is said of one that is nearly so."""
    worst = int(np.abs(rim).argmax())
    row, column = np.unravel_index(worst, rim.shape)
    off = abs(float(rim[row, column]))
    if off > TAPERED_RIM * relief:
        place = _place(raster, int(row), int(column))
        what = f"its rim is not even: at {place} it is {off:.3g} m off its plane"
        what = f"{what}, the form is {relief:.3g} m high"
        remedy = "take more of the even ground around the form"
        raise InputError(what, where, remedy)
    if off > FLAT_RIM * relief:
        return (f"tapered to even ground at its rim, which is up to {off:.3g} m off",)
    return ()


def _taper(raster: Raster, is_outside: BoolArray, width: float) -> FloatArray:
    """Weights that fall to 0 at the rim over a width, m, of two steps at least."""
    from scipy.ndimage import distance_transform_edt

    if not width:
        return np.ones(raster.z.shape)
    step_x = float(np.ptp(raster.x)) / (len(raster.x) - 1)
    step_y = float(np.ptp(raster.y)) / (len(raster.y) - 1)
    inside = np.pad(~is_outside, 1)
    distance = distance_transform_edt(inside, sampling=(step_y, step_x))[1:-1, 1:-1]
    least = max(step_x, step_y)
    part = np.clip((distance - least) / max(width, 2 * least), 0.0, 1.0)
    return np.asarray((1 - np.cos(pi * part)) / 2)


def _check_slopes(surface: Surface, where: str) -> None:
    """Refuse slopes that no mesh follows.

    The noise of single cells is taken out before.
    """
    from scipy.ndimage import gaussian_filter

    along_x, along_y = surface.steps
    deviation = 0.1 * min(surface.relief, surface.radius)
    sigmas = deviation / np.array([along_y, along_x])
    smooth = gaussian_filter(surface.above, sigmas, mode="nearest")
    by_y, by_x = np.gradient(smooth, along_y, along_x)
    slopes = np.degrees(np.arctan(np.hypot(by_x, by_y)))
    row, column = np.unravel_index(int(slopes.argmax()), slopes.shape)
    steepest = float(slopes[row, column])
    if steepest > STEEPEST_DEG:
        place = f"x = {surface.x[column]:.9g} m, y = {surface.y[row]:.9g} m"
        what = f"a slope of {steepest:.0f} deg at {place}, above {STEEPEST_DEG:g}"
        remedy = "are x, y and z all in m? A wall or an overhang is no bed"
        raise InputError(what, where, remedy)


def cone(height: float, slope_deg: float) -> Surface:
    """Make a cone.

    Parameters
    ----------
    height
        Its height, m.
    slope_deg
        Its slope, degrees.

    Returns
    -------
    Surface
        The cone, its axis at the origin.

    Examples
    --------
    >>> pile = cone(10.0, 45.0)
    >>> round(pile.relief, 6), round(pile.volume / (1000 * pi / 3), 2)
    (10.0, 1.0)
    """
    radius = height / tan(radians(slope_deg))
    x, y = _axes(radius, radius)
    distance = np.hypot(x, y[:, None])
    z = np.maximum(height - distance * tan(radians(slope_deg)), 0.0)
    return surface_of("cone", x, y, z, Plane(), SPREAD_OF_SHAPE)


def oval(height: float, slope_deg: float, length: float, width: float) -> Surface:
    """Make an oval pile with a flat top: a straight middle between two round ends.

    Parameters
    ----------
    height
        Its height, m.
    slope_deg
        Slope of its sides, degrees.
    length, width
        Length of its flat top along y, and width along x, m; the length is the larger.

    Returns
    -------
    Surface
        The pile, its middle at the origin.

    Examples
    --------
    >>> pile = oval(10.0, 45.0, 30.0, 10.0)
    >>> round(pile.relief, 6), round(float(pile.at(0.0, 14.9)), 1)
    (10.0, 10.0)
    """
    half = (length - width) / 2
    foot = width / 2 + height / tan(radians(slope_deg))
    x, y = _axes(foot, foot + half)
    beyond = np.maximum(np.abs(y) - half, 0.0)
    distance = np.hypot(x, beyond[:, None])
    rise = (foot - distance) * tan(radians(slope_deg))
    z = np.clip(rise, 0.0, height)
    return surface_of("oval", x, y, z, Plane(), SPREAD_OF_SHAPE)


def barchan(height: float, slope_deg: float) -> Surface:
    """Make a dune in the form of a barchan, which wind from the west has made.

    Its windward side is a paraboloid, its brink a parabola across the wind, and its
    slip face has the slope `SLIP_DEG` along the normal of the brink.

    Parameters
    ----------
    height
        Height of its brink in the middle, m.
    slope_deg
        Slope of the windward side at its toe, where it is steepest, degrees.

    Returns
    -------
    Surface
        The dune, the middle of its brink at the origin.

    Examples
    --------
    >>> dune = barchan(3.0, 10.0)
    >>> round(dune.relief, 6), bool(dune.centre[0] < 0)
    (3.0, True)
    """
    length = 2 * height / tan(radians(slope_deg))
    horn = HORNS * length
    # at its ends the brink meets the ground: there the paraboloid is at 0
    half_width = length * np.sqrt(1 - HORNS**2)
    x, y = _axes(length, length)
    windward = height * (1 - (x / length) ** 2 - (y[:, None] / length) ** 2)
    brink = horn * (y / half_width) ** 2
    turn = 2 * horn * y / half_width**2
    height_there = height * (1 - (brink / length) ** 2 - (y / length) ** 2)
    fall = tan(radians(SLIP_DEG)) / np.sqrt(1 + turn**2)
    behind = x - brink[:, None]
    slip = height_there[:, None] - fall[:, None] * behind
    z = np.where(behind > 0, np.minimum(windward, slip), windward)
    return surface_of("barchan", x, y, np.maximum(z, 0.0), Plane(), SPREAD_OF_SHAPE)


def _axes(half_x: float, half_y: float) -> tuple[FloatArray, FloatArray]:
    """Axes about the origin over a base of some half widths, with ground around."""
    step = 2 * min(half_x, half_y) / STEPS_OF_SHAPE
    axes = []
    for half in (half_x, half_y):
        nodes = int(np.ceil(half / step)) + 2
        axes.append(np.linspace(-step * nodes, step * nodes, 2 * nodes + 1))
    return axes[0], axes[1]
