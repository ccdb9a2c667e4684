"""The grains of a pile of two straight faces.

Lengths are in diameters d of the scene, with the toe of the pile at the origin.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from orchestrator.bed.exposure import LOWER, STRAY, TIE, exposed, rests, touching
from orchestrator.bed.line import BedLine
from orchestrator.bed.packing import APRON, Lattice, Packing
from orchestrator.bed.places import TOUCH
from orchestrator.bed.rows import DISORDERED, OFFSET, overlaps, stacked
from orchestrator.digits import whole_up
from orchestrator.types import BoolArray, FloatArray, IntArray

LEE_DEPTH = 1.5
"""Thickness of the fixed lee side, layers: no grain falls through it."""


def pile(line: BedLine, lattice: Lattice) -> Packing:
    """Pack a pile of two straight faces.

    Rows of its windward face fill it to the lee one.

    Parameters
    ----------
    line
        The bed line.
    lattice
        How the grains lie.

    Returns
    -------
    Packing
        The packing.
    """
    row_height = np.sin(lattice.beta)
    thickness = line.crest[1] / line.tangents[line.top - 1, 0]
    layers = min(lattice.mobile_layers, whole_up(thickness / row_height) + 1)
    lattice = replace(lattice, mobile_layers=layers)
    # below the layers that hold mobile grains one is enough: a grain touches no deeper
    # one
    thick = (lattice.layers + 0.5) * row_height
    thick_lee = LEE_DEPTH * row_height
    surface = 0.5 + lattice.gap
    points = _filling(
        line, lattice, surface, {line.top - 1: thick, line.top: thick_lee}
    )
    depths = _Depths.of(line, points, surface)
    depth = np.minimum(depths.windward, depths.lee)
    is_inside = depth >= -(STRAY if lattice.uneven else TIE)
    is_inside &= (depths.windward < thick) | (depths.lee < thick_lee)
    level = depths.level
    is_below = (level < -TIE) & (depth > 0.5 * row_height) & (level > -1.3)
    kept = is_inside & ((level >= -TIE) | is_below)
    top = points[np.argmax(np.where(kept, points[:, 1], -np.inf))]
    kept |= _behind(top, points) & (depths.lee < -TIE)
    return _with_roles(line, lattice, points[kept], depths.chosen(kept), surface)


class _Depths(NamedTuple):
    """Depths of grains below the two faces of a pile, and heights over the flat bed."""

    windward: FloatArray
    lee: FloatArray
    level: FloatArray

    @classmethod
    def of(cls, line: BedLine, points: FloatArray, surface: float) -> "_Depths":
        """Depths of points; the highest centres are `surface` over the line."""
        windward = surface - line.over(points, line.top - 1)
        lee = surface - line.over(points, line.top)
        return cls(windward, lee, points[:, 1] - surface)

    def chosen(self, kept: BoolArray) -> "_Depths":
        """The depths of some of the grains."""
        return _Depths(self.windward[kept], self.lee[kept], self.level[kept])


def _with_roles(
    line: BedLine, lattice: Lattice, body: FloatArray, depths: _Depths, surface: float
) -> Packing:
    """The grains of a pile that are needed, and which of them move and count."""
    is_buried = depths.level < -TIE
    is_ahead = body[:, 0] <= line.crest[0] + TIE
    tangents = line.tangents[np.where(is_ahead, line.top - 1, line.top)]
    is_free = exposed(body, tangents, slack=lattice.disorder) & ~is_buried
    windward = is_free & is_ahead
    lee = is_free & ~is_ahead
    # on a steep lee side no grain lies by itself
    has_fallen = (depths.lee < 1) & ~rests(body)
    row_height = np.sin(lattice.beta)
    is_near = depths.windward < (lattice.mobile_layers - 0.5) * row_height
    mobile = (is_near & ~is_buried & ~has_fallen) | windward
    needed = ~is_buried | touching(body, mobile)
    apron = _apron(body[needed], surface)
    fixed = np.zeros(len(apron), bool)
    return lattice.packed(
        line,
        np.vstack([body[needed], apron]),
        mobile=np.append(mobile[needed], fixed),
        windward=np.append(windward[needed], fixed),
        lee=np.append(lee[needed], fixed),
    )


def _behind(top: FloatArray, points: FloatArray) -> BoolArray:
    """Which places bear a grain from downstream: none else does at a steep lee side."""
    x, z = (points - top).T
    return np.asarray((np.hypot(x, z) < 1 + TOUCH) & (x > 0) & (z < -LOWER))


def _filling(
    line: BedLine, lattice: Lattice, surface: float, thick: Mapping[int, float]
) -> FloatArray:
    """Where grains of the pattern may lie in a pile of two faces, one on the crest.

    Of all places those are made that are no deeper below a face than it is `thick`, and
    some more.
    """
    pattern = _Pattern.of(line, lattice, surface)
    faces = []
    for number, most in thick.items():
        from_corner = pattern.apex - line.corners[number]
        faces.append(_Face(line.normals[number], from_corner, surface, most + 1))
    points = pattern.near(faces, line)
    if not lattice.uneven:
        return points
    layers = max(lattice.mobile_layers, DISORDERED)
    count = whole_up(line.crest_s / pattern.half / 2) + layers + 4
    axes = np.vstack([pattern.direction, pattern.normal])
    upper = pattern.apex + _disordered(count, layers, lattice) @ axes
    depth = (pattern.apex - points) @ pattern.normal
    return np.vstack([upper, points[depth > (layers + 0.5) * pattern.row_height]])


class _Face(NamedTuple):
    """A face of a pile: its normal, the apex from its corner, the filled depth.

    The highest centres are `surface` over it.
    """

    normal: FloatArray
    from_corner: FloatArray
    surface: float
    most: float


class _Pattern(NamedTuple):
    """Rows of a lattice below an apex; the places of a row are two `half` apart."""

    apex: FloatArray
    direction: FloatArray
    normal: FloatArray
    half: float
    row_height: float

    @classmethod
    def of(cls, line: BedLine, lattice: Lattice, surface: float) -> "_Pattern":
        """The rows of a pile of two faces."""
        face = line.tangents[line.top - 1]
        direction = np.array([1.0, 0.0]) if lattice.pattern == "horizontal" else face
        normal = np.array([-direction[1], direction[0]])
        apex = line.crest + np.array([0, surface / face[0]])
        return cls(apex, direction, normal, np.cos(lattice.beta), np.sin(lattice.beta))

    def near(self, faces: Sequence[_Face], line: BedLine) -> FloatArray:
        """Places near a face of a pile, shape (n, 2)."""
        rows, columns = self._range(line)
        places = [self._within(face, rows, columns) for face in faces]
        row, column = np.unique(np.concatenate(places), axis=0).T
        offset = (2 * column + row % 2) * self.half
        fall = row * self.row_height
        is_near = np.zeros(offset.shape, bool)
        for face in faces:
            over = offset * (self.direction @ face.normal)
            over -= fall * (self.normal @ face.normal)
            over = over + face.from_corner @ face.normal - face.surface
            is_near |= np.abs(over) < face.most
        into = np.outer(offset[is_near], self.direction)
        return np.asarray(self.apex + into - np.outer(fall[is_near], self.normal))

    def _range(self, line: BedLine) -> tuple[IntArray, IntArray]:
        """Numbers of the rows and columns that a pile may have."""
        corners = np.array([np.zeros(2), line.toe, line.crest]) - self.apex
        along = corners @ self.direction / self.half / 2
        down = -corners @ self.normal / self.row_height
        rows = np.arange(0, whole_up(down.max()) + 3)
        columns = np.arange(-whole_up(-along.min()) - 3, whole_up(along.max()) + 4)
        return rows, columns

    def _within(self, face: _Face, rows: IntArray, columns: IntArray) -> IntArray:
        """Row and column of the places near a face, and of some more."""
        # distance of the place (row, column) over the face: a column + b row + c
        along = float(self.direction @ face.normal)
        first = face.from_corner @ face.normal - face.surface
        first = first - rows * self.row_height * float(self.normal @ face.normal)
        first = first + rows % 2 * self.half * along
        return _columns_within(first, 2 * self.half * along, face.most, columns)


def _columns_within(
    first: FloatArray, step: float, most: float, columns: IntArray
) -> IntArray:
    """Row and column of all places that are within a distance of a face, and some more.

    The distance in column 0 of each row is `first`, and from one column to the next it
    grows by `step`. Of a pile of thousands of grains these are few of all its places.
    """
    low = np.full(len(first), columns[0])
    high = np.full(len(first), columns[-1])
    if abs(step) < TIE:  # the rows go along the face
        high = np.where(np.abs(first) < most + 1, high, columns[0] - 1)
    else:
        middle = -first / step
        reach = most / abs(step) + 2
        low = np.clip(np.floor(middle - reach), columns[0], columns[-1] + 1).astype(int)
        high = np.clip(np.ceil(middle + reach), columns[0] - 1, columns[-1]).astype(int)
    counts = np.maximum(high - low + 1, 0)
    row = np.repeat(np.arange(len(first)), counts)
    into = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.column_stack([row, low[row] + into])


def _disordered(columns: int, layers: int, lattice: Lattice) -> FloatArray:
    """Rows over a straight one with random gaps: places along and normal, (n, 2)."""
    rng = np.random.default_rng(lattice.seed)
    size = lattice.disorder
    spacing = 2 * np.cos(lattice.beta) + rng.uniform(0, size, 2 * columns)
    offset = rng.uniform(-OFFSET * size, OFFSET * size, 2 * columns + 1)
    while True:
        lowest = np.column_stack([np.concatenate([[0], np.cumsum(spacing)]), offset])
        rows = stacked(lowest, layers)
        if not any(np.any(overlaps(row) > 0) for row in rows):
            break
        # where two grains of a row would overlap, the row below them is opened a little
        for above, row in enumerate(rows):
            overlap = overlaps(row)
            wide = np.zeros_like(spacing)
            for place in np.flatnonzero(overlap > 0):
                wide[place : place + layers - above + 1] += overlap[place]
            spacing = spacing + wide
    return np.asarray(np.vstack(rows) - rows[0][len(rows[0]) // 2])


def _apron(body: FloatArray, surface: float) -> FloatArray:
    """Two flat rows of touching fixed grains, each from where it touches the pile."""
    drop = np.abs(body[:, 1] - surface)
    is_near = drop < 1
    near = body[is_near, 0]
    clearance = np.sqrt(1 - drop[is_near] ** 2)
    steps = np.arange(0, APRON)
    first = (near - clearance).min()
    last = (near + clearance).max()
    x = np.concatenate([first - steps, last + steps])
    return np.column_stack([x, np.full(len(x), surface)])
