"""The mesh of a flow over a surface: hexahedra in columns that stand on the bed.

The axes of the mesh are those of the wind: x downstream, y to the left of it seen from
above, z upwards from the flat ground. The columns are vertical, and the lowest cell of
each has the same height normal to the bed under it, since the wall function of a rough
bed needs one height. One slab of columns stands apart ahead of the inlet: the flow that
enters develops in it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from orchestrator import digits
from orchestrator.flow.foam import patch_types, write_poly_mesh
from orchestrator.flow.mesh import cells_in, growing, ratio_of
from orchestrator.types import FloatArray, IntArray

Heights = Callable[[FloatArray, FloatArray], FloatArray]
"""Height of a bed above the flat ground, m, at places x and y, m, of one shape."""

LID = 10.0
"""Height of the lid above the flat ground, in heights of the form."""
UPSTREAM, DOWNSTREAM, ASIDE = 6.0, 16.0, 7.0
"""Flat ground from the inlet to the form, from it to the outlet, and on either side."""
FIRST_CELL = 1 / 40
"""Height of the cells on the bed, in heights of the form."""
STEEPEST = 2.0
"""Largest tangent of a slope along which a first cell is made higher: 63 degrees."""


@dataclass(frozen=True)
class Level:
    """How fine a mesh is.

    Attributes
    ----------
    name
        Name of the level.
    per_radius
        Cells along the radius of the circle with the area of the form.
    per_height
        Cells that are as long as the form is high, at least.
    growth
        Ratio of neighbouring cells upwards, and along the wind outside the form.
    growth_across
        The same across the wind.
    most_cells
        Most cells of a mesh: those of a wide form are longer than the two lengths ask.
    ranks
        Processes that share the mesh.
    """

    name: str
    per_radius: float
    per_height: float
    growth: float
    growth_across: float
    most_cells: int
    ranks: int = 1


COARSE = Level("coarse", 12, 4, 1.15, 1.2, 110_000)
STANDARD = Level("standard", 18, 6, 1.1, 1.15, 280_000, ranks=2)
LEVELS = {level.name: level for level in (COARSE, STANDARD)}
"""The levels by their names."""


class Sizes(NamedTuple):
    """Ends of a form along and across the wind.

    Attributes
    ----------
    start, end
        Of the form along the wind, m.
    right, left
        Of the form across the wind, m; the left lies at the larger coordinate.
    """

    start: float
    end: float
    right: float
    left: float


def wind_axes(from_deg: float) -> FloatArray:
    """Find the axes of a wind.

    Parameters
    ----------
    from_deg
        Where the wind comes from, degrees from north (+y) towards east (+x).

    Returns
    -------
    FloatArray
        Unit vectors along the wind, downstream, and across it, to the left seen from
        above: shape (2, 2), in the axes of the file, x east and y north.

    Examples
    --------
    >>> wind_axes(270.0).tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    angle = np.radians(from_deg)
    east, north = -np.sin(angle), -np.cos(angle)
    return np.round([[east, north], [-north, east]], 12) + 0.0


def axis(
    start: float, end: float, cell: float, before: float, behind: float, growth: float
) -> FloatArray:
    """Place grid lines along one axis.

    Parameters
    ----------
    start, end
        The part with even cells, m.
    cell
        Their length, at most, m.
    before, behind
        Lengths before and behind that part, m, where the cells grow.
    growth
        Ratio of neighbouring cells there, at most.

    Returns
    -------
    FloatArray
        The grid lines, rising, m.
    """
    count = digits.whole_up((end - start) / cell)
    even = np.linspace(start, end, count + 1)
    cell = (end - start) / count
    # the first cell outside is longer already
    ahead = growing(before, cell * growth, growth).ends(before)
    after = growing(behind, cell * growth, growth).ends(behind)
    return np.concatenate([start - ahead[::-1], even, end + after])


def grid_lines(
    form: Sizes, height: float, cell: float, level: Level
) -> tuple[FloatArray, FloatArray]:
    """Place the grid lines over a form and the flat ground around it.

    Parameters
    ----------
    form
        Ends of the form along and across the wind, m.
    height
        Height of the form, m.
    cell
        Length of the cells over the form, m.
    level
        How fine the mesh is.

    Returns
    -------
    along
        The grid lines along the wind, rising, m.
    across
        Those across it, m.
    """
    before, behind, aside = UPSTREAM * height, DOWNSTREAM * height, ASIDE * height
    along = axis(form.start, form.end, cell, before, behind, level.growth)
    across = axis(form.right, form.left, cell, aside, aside, level.growth_across)
    return along, across


def rows(height: float, first_cell: float, level: Level) -> int:
    """Count the cells of a column.

    Parameters
    ----------
    height
        Height of the form, m.
    first_cell
        Height of the lowest cell, m.
    level
        How fine the mesh is.

    Returns
    -------
    int
        The number.
    """
    return cells_in(LID * height, first_cell, level.growth)


@dataclass(frozen=True, eq=False)
class Columns:
    """A mesh of hexahedra in columns over a bed.

    Attributes
    ----------
    x, y
        Grid lines along and across the wind, rising, m.
    bed
        Height of the bed at each of their crossings, m, shape (len(x), len(y)).
    lid
        Height of the lid, m.
    first_cell
        Height of the lowest cells normal to the bed, m.
    count
        Number of cells of a column.
    slab
        Length of the slab of columns ahead of the inlet, and its distance from it, m.
    """

    x: FloatArray
    y: FloatArray
    bed: FloatArray
    lid: float
    first_cell: float
    count: int
    slab: float

    @classmethod
    def over(
        cls,
        heights: Heights,
        x: FloatArray,
        y: FloatArray,
        *,
        height: float,
        first_cell: float,
        count: int,
    ) -> "Columns":
        """Make the mesh over a bed.

        Parameters
        ----------
        heights
            Height of the bed; flat ground, at 0, at the inlet.
        x, y
            Grid lines along and across the wind, rising, m.
        height
            Height of the form, m.
        first_cell
            Height of the lowest cells normal to the bed, m.
        count
            Number of cells of a column.

        Returns
        -------
        Columns
            The mesh.
        """
        x = digits.on_grid(x, height)
        y = digits.on_grid(y, height)
        along, across = np.meshgrid(x, y, indexing="ij")
        bed = digits.on_grid(heights(along, across), height)
        return cls(x, y, bed, LID * height, first_cell, count, slab=height)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Cells along the wind, with the slab, across it and upwards."""
        return len(self.x), len(self.y) - 1, self.count

    @property
    def cells(self) -> int:
        """Number of all cells."""
        along, across, up = self.shape
        return along * across * up

    @cached_property
    def levels(self) -> FloatArray:
        """Heights of the corners over each crossing, m, (len(x), len(y), count + 1)."""
        slope_x, slope_y = np.gradient(self.bed, self.x, self.y)
        steepness = np.minimum(np.hypot(slope_x, slope_y), STEEPEST)
        first = self.first_cell * np.sqrt(1 + steepness**2)
        length = self.lid - self.bed
        ratio = ratio_of(self.count, first, length)
        powers = ratio[..., None] ** np.arange(self.count)
        heights = np.cumsum(powers, axis=-1)
        heights *= (length / heights[..., -1])[..., None]
        whole = np.insert(heights, 0, 0.0, axis=-1) + self.bed[..., None]
        return digits.on_grid(whole, self.slab)

    @cached_property
    def corners(self) -> FloatArray:
        """The corners of all cells, m, with the slab's two planes first.

        Shape (len(x) + 2, len(y), count + 1, 3).
        """
        inlet = self.x[0]
        planes = [inlet - 1.5 * self.slab, inlet - 0.5 * self.slab]
        x = np.concatenate([planes, self.x])
        z = np.concatenate([self.levels[[0, 0]], self.levels])
        whole = np.empty((*z.shape, 3))
        whole[..., 0] = x[:, None, None]
        whole[..., 1] = self.y[:, None]
        whole[..., 2] = z
        return whole

    @property
    def middles(self) -> FloatArray:
        """Means of the corners of each cell, m, shape (*shape, 3)."""
        return self._means(self.corners)

    @property
    def over_bed(self) -> FloatArray:
        """Heights of these means over the bed, m, of the mesh's shape."""
        heights = self.corners[..., 2]
        return self._means(heights - heights[:, :, :1])

    @staticmethod
    def _means(corners: FloatArray) -> FloatArray:
        """Mean over the corners of each cell."""
        means = (corners[:-1] + corners[1:]) / 2
        means = (means[:, :-1] + means[:, 1:]) / 2
        means = (means[:, :, :-1] + means[:, :, 1:]) / 2
        return np.delete(means, 1, axis=0)  # between the slab and the inlet are none

    def write(self, directory: Path) -> None:
        """Write the mesh into a case that has none.

        Parameters
        ----------
        directory
            Directory of the case.
        """
        points = self.corners.reshape(-1, 3)
        types = patch_types(-self.slab)
        write_poly_mesh(directory, points, self.hexahedra, self.patches, types)

    @cached_property
    def _planes(self) -> tuple[IntArray, IntArray]:
        """Numbers of the corners on the upstream and downstream sides of the cells.

        Each has the shape (planes of cells, len(y), count + 1).
        """
        points = np.arange(self.corners[..., 0].size).reshape(self.corners.shape[:3])
        ahead = np.delete(points[:-1], 1, axis=0)
        behind = np.delete(points[1:], 1, axis=0)
        return ahead, behind

    @property
    def hexahedra(self) -> IntArray:
        """Numbers of the corners of each cell, upstream and downstream, (n, 8)."""
        # so the cyclic sides of the slab begin at corners that face each other
        fronts = [_across(planes) for planes in self._planes]
        return np.concatenate(fronts, axis=-1).reshape(-1, 8)

    @property
    def patches(self) -> dict[str, IntArray]:
        """Numbers of the corners of each face of each patch."""
        ahead, behind = self._planes
        sides = [_between(ahead[:, side], behind[:, side]) for side in (0, -1)]
        patches = {
            "bed": _between(ahead[..., 0], behind[..., 0]),
            "lid": _between(ahead[..., -1], behind[..., -1]),
            "before": _across(ahead[0]),
            "after": _across(behind[0]),
            "inlet": _across(ahead[1]),
            "outlet": _across(behind[-1]),
            "sides": np.stack(sides),
        }
        return {name: quads.reshape(-1, 4) for name, quads in patches.items()}


def _across(planes: IntArray) -> IntArray:
    """The quadrilaterals of planes across the wind, seen from downstream."""
    return _between(planes[..., :-1, :], planes[..., 1:, :])


def _between(one: IntArray, other: IntArray) -> IntArray:
    """The quadrilaterals between two lines of corners."""
    ends = [one[..., :-1], other[..., :-1], other[..., 1:], one[..., 1:]]
    return np.stack(ends, axis=-1)
