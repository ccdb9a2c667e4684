"""The grid lines of the mesh along a bed line: where cells are short, and how they grow.

The grid lines are vertical. Each corner of the bed line is one of them; between two corners the
cells are a geometric series. They are shortest at sharp tops, where the stress has its peaks.
"""

from dataclasses import dataclass, replace
from math import ceil, expm1, inf, log, radians, tan

import numpy as np
from scipy.optimize import brentq

from orchestrator.bed.line import BedLine
from orchestrator.types import FloatArray

SHARP_DEG = 8.0
"""Bend of the bed from which on a corner is a corner, not a part of a curve."""
CELLS_ON_OBSTACLE = 8
"""Cells in the height of an obstacle, along the bed beside it."""
TOP = 0.35
"""Length of the cells at sharp tops over the mean of a face: a grain's stress is averaged over h/40
there."""
NEAR = 4.0
"""Beyond this, h before and behind the forms and above the bed, cells grow by `FAR`."""
FAR = 1.3
"""Ratio of neighbouring cells there, with 40 cells on a face."""
LEVEL_CELLS = 8
"""A level piece of this many cells at least is divided in the middle: cells grow towards it."""


@dataclass(frozen=True)
class Grid:
    """The pieces between n corners of a bed line.

    Attributes
    ----------
    line : BedLine
        The bed line, m; with more corners than it was asked for where pieces were divided.
    cells : tuple of int, n - 1
        Cells of each piece.
    ratio : tuple of float, n - 1
        Length of a cell over that of the one upstream of it.
    """

    line: BedLine
    cells: tuple[int, ...]
    ratio: tuple[float, ...]

    @property
    def shortest(self) -> tuple[float, float, float]:
        """Length of the shortest cell and the two ends of its piece, m."""
        pieces = zip(self.cells, self.ratio, np.diff(self.line.x).tolist(), strict=True)
        shorter = [_first((n, max(ratio, 1 / ratio)), length) for n, ratio, length in pieces]
        piece = int(np.argmin(shorter))
        return shorter[piece], self.line.x[piece], self.line.x[piece + 1]


def growth_far(growth: float, cells_per_face: int) -> float:
    """Ratio of neighbouring cells far from the forms."""
    return max(growth, float(FAR ** (40 / cells_per_face)))


def extended(line: BedLine, upstream: float, downstream: float) -> BedLine:
    """A line with flat bed of some lengths, m, before and behind it in place of its own."""
    x = (line.x[1] - upstream, *line.x[1:-1], line.x[-2] + downstream)
    return replace(line, x=x)


def along(line: BedLine, *, slope_deg: float, cells_per_face: int, growth: float) -> Grid:
    """The grid along a bed line that begins and ends with flat bed.

    Parameters
    ----------
    line : BedLine
        m.
    slope_deg : float
        Slope of the face that has `cells_per_face` cells if it is as high as the form; 0: none.
    cells_per_face : int
        Their number.
    growth : float
        Ratio of neighbouring cells beside the form.
    """
    face = line.h / tan(radians(slope_deg)) if slope_deg else 4 * line.h
    cell = face / cells_per_face
    # a face has a short cell at its sharp top, and this at its foot
    face_ratio = ratio_of(cells_per_face, TOP * cell, face)
    foot = TOP * cell * face_ratio ** (cells_per_face - 1)
    if not slope_deg:
        foot = cell
    near = NEAR * line.h
    ends = (line.x[1] - near, line.x[-2] + near)
    inside = [x for x in ends if line.x[0] + cell < x < line.x[-1] - cell]
    line = _divided(line.with_corners(inside), cell)
    sizes = _sizes(line, cell, foot, max(growth, face_ratio))
    lengths = np.diff(line.x)
    inner = [_piece(*one) for one in zip(lengths[1:-1], sizes[1:-2], sizes[2:-1], strict=True)]
    up, down = _first(inner[0], lengths[1]), _last(inner[-1], lengths[-2])
    far = growth_far(growth, cells_per_face)
    before, behind = _away(lengths[0], up, far), _away(lengths[-1], down, far)
    pieces = [(before[0], 1 / before[1]), *inner, behind]
    return Grid(line, tuple(n for n, _ in pieces), tuple(r for _, r in pieces))


def ratio_of(cells: int, first: float, length: float) -> float:
    """The ratio, at least 1, at which `cells` cells that begin with `first` fill a length."""
    if cells < 2 or first * cells >= length:
        return 1.0

    def beyond(ratio: float) -> float:
        return first * float(expm1(cells * log(ratio))) / (ratio - 1) - length

    # the last cell alone would fill the length at the upper end
    return float(brentq(beyond, 1 + 1e-9, (length / first) ** (1 / (cells - 1)), xtol=1e-15))


def _divided(line: BedLine, cell: float) -> BedLine:
    """The line with a corner in the middle of pieces whose cells shall grow from both ends."""
    lengths, bends = np.diff(line.x), line.bends_deg
    level = np.abs(np.diff(line.z)) < 1e-9 * line.h
    level &= lengths > LEVEL_CELLS * cell
    ridge = (bends[:-1] > SHARP_DEG) & (bends[1:] > SHARP_DEG)
    chosen = np.flatnonzero((level | ridge)[1:-1]) + 1
    return line.with_corners([(line.x[i] + line.x[i + 1]) / 2 for i in chosen])


def _sizes(line: BedLine, cell: float, foot: float, growth: float) -> FloatArray:
    """Length of the cells at each corner, m; the ends of the line have none of their own."""
    bends = line.bends_deg
    sizes = np.full(len(line.x), cell)
    sizes[bends > SHARP_DEG] = TOP * cell
    sizes[bends < -SHARP_DEG] = foot
    # in the middle of level bed, and at the ends, as long as the growth allows
    middle = np.abs(bends) < 1e-9
    z = np.array(line.z)
    middle[1:-1] &= (np.abs(np.diff(z)[1:]) < 1e-9 * line.h) & (
        np.abs(np.diff(z)[:-1]) < 1e-9 * line.h
    )
    middle[[0, -1]] = True
    sizes[middle] = inf
    for start, end in line.bare:
        there = (np.array(line.x) >= start - 1e-12) & (np.array(line.x) <= end + 1e-12)
        sizes[there] = np.minimum(sizes[there], np.ptp(z[there]) / CELLS_ON_OBSTACLE)
    lengths = np.diff(line.x)
    sizes[1:-1] = np.minimum(sizes[1:-1], np.minimum(lengths[:-1], lengths[1:]))
    for i in range(1, len(sizes)):
        sizes[i] = min(sizes[i], sizes[i - 1] + (growth - 1) * lengths[i - 1])
    for i in range(len(sizes) - 2, -1, -1):
        sizes[i] = min(sizes[i], sizes[i + 1] + (growth - 1) * lengths[i])
    return sizes


def _piece(length: float, start: float, end: float) -> tuple[int, float]:
    """Cells, and their ratio, of a piece whose first and last cells are about as asked."""
    first, last = min(start, end), max(start, end)
    if last >= length:
        return 1, 1.0
    ratio = (length - first) / (length - last)
    count = length / first if ratio - 1 < 1e-9 else 1 + log(last / first) / log(ratio)
    cells = max(ceil(count - 1e-6), 1)
    if cells < 3 or ratio - 1 < 1e-6 or first * cells >= length:
        return cells, 1.0
    ratio = ratio_of(cells, first, length)
    return cells, ratio if start <= end else 1 / ratio


def _away(length: float, first: float, growth: float) -> tuple[int, float]:
    """Cells that begin with `first` and grow until they fill a length."""
    cells = ceil(log(1 + length * (growth - 1) / first) / log(growth))
    return cells, ratio_of(cells, first, length)


def _first(piece: tuple[int, float], length: float) -> float:
    """Length of the first cell of a piece; its cells are a geometric series."""
    cells, ratio = piece
    if ratio < 1:
        return _first((cells, 1 / ratio), length) * ratio ** (1 - cells)
    return length / cells if ratio == 1 else length * (ratio - 1) / float(expm1(cells * log(ratio)))


def _last(piece: tuple[int, float], length: float) -> float:
    cells, ratio = piece
    return _first((cells, 1 / ratio), length)
