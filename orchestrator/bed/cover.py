"""Grains on a bed line of any shape: rows along it, level rows, or rows with random gaps.

The line is divided at its sharp corners. Each part has rows of its own, those that are counted
first; where rows of two parts meet, grains of the later one that would overlap are left out, and
grains that do not rest on two are fixed. Lengths are in diameters.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from orchestrator.bed.disorder import rows_on
from orchestrator.bed.line import BedLine
from orchestrator.bed.packing import APRON, DISORDERED, STRAY, TIE, Packing, replica
from orchestrator.study.parts import Packing as Pattern
from orchestrator.study.parts import Range, UnfitError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

SHARP_DEG = 8.0
"""Bend from which on rows do not follow the bed round a corner."""
LEVEL_DEG = 1e-6
SLIT = 0.15
"""Between neighbours of a row that goes round a bend a gap is at most this wide, diameters."""
BARE = 1.0
"""Grains this near to an obstacle are fixed under its foot, diameters."""
TOUCH = 1e-3
"""Two grains closer than this touch, diameters."""
LOWER = 0.1
"""A neighbour bears a grain that stands so much over it, diameters."""
UNDER = 2
"""Rows of fixed grains where none is counted: none falls through them."""


@dataclass(frozen=True)
class Part:
    """A part of the bed between two sharp corners: its segments, and whether it is counted."""

    first: int
    last: int
    counted: bool


def cover(
    line: BedLine,
    ground: BedLine,
    counts: str | Range,
    *,
    entrainment_angle_deg: float,
    gap: float,
    pattern: Pattern,
    mobile_layers: int,
    disorder: float = 0.0,
    seed: int = 0,
) -> Packing:
    """Pack the grains of a bed.

    Parameters
    ----------
    line : BedLine
        Bed line of the flow, diameters.
    ground : BedLine
        The same without obstacles.
    counts : {"windward", "all"} or (float, float)
        Which exposed grains are counted: those of segments that rise, all, or a range of x.
    entrainment_angle_deg, gap, pattern, mobile_layers, disorder, seed
        As `packing.pile` takes them.

    Raises
    ------
    UnfitError
        If the bed bends more sharply than grains can follow, or none is counted.
    """
    beta = np.radians(entrainment_angle_deg)
    layers = mobile_layers + (pattern == "horizontal")
    top = offset(_between_aprons(ground), 0.5 + gap)
    segments = counted_segments(top, counts)
    rows = _Rows(top, float(beta), pattern, layers, disorder, seed)
    centres = _without_overlaps(list(rows.parts(segments)))
    under, depth = _depth(top, centres)
    even = pattern != "disordered"
    slack = (SLIT if pattern == "aligned" else TIE) if even else max(SLIT, disorder)
    seen = exposed(centres, top.tangents[under], slack, STRAY if slack > TIE else TIE)
    there = segments[under] & within(centres[:, 0], counts) & ~_near(centres[:, 0], line.bare)
    seen &= depth < 1
    near = depth < (mobile_layers - 0.5) * np.sin(beta)
    mobile = there & near & _rests(centres)
    counted = mobile & seen
    if not counted.any():
        raise UnfitError("bed.counted", "no grain is counted", "choose another part of the bed")
    needed = mobile | seen | _touching(centres, mobile)
    centres, counted, mobile, seen = (each[needed] for each in (centres, counted, mobile, seen))
    return Packing(
        centres=centres + replica(len(centres), seed if even else 0),
        sizes=np.ones(len(centres)),
        mobile=mobile,
        windward=counted,
        lee=seen & ~counted,
        arc_length=line.nearest(centres)[1],
    )


def counted_segments(line: BedLine, counts: str | Range) -> BoolArray:
    """Which segments of a line are counted, but for its ends."""
    inner = np.zeros(len(line.x) - 1, bool)
    inner[1:-1] = True
    if counts == "windward":
        return np.asarray(inner & (line.slopes_deg > LEVEL_DEG))
    if counts == "all":
        return inner
    x = np.array(line.x)
    return np.asarray(inner & (x[1:] > float(counts[0])) & (x[:-1] < float(counts[1])))


def offset(line: BedLine, distance: float) -> BedLine:
    """The line at a distance above a line, with the corners that it has.

    Raises
    ------
    UnfitError
        If it bends more sharply than that.
    """
    bends = np.radians(line.bends_deg) / 2
    normals = np.vstack([line.normals[:1], line.normals])
    following = np.vstack([line.normals, line.normals[-1:]])
    middle = normals + following
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    x, z = (line.corners + middle * (distance / np.cos(bends))[:, None]).T
    back = np.flatnonzero(np.diff(x) <= 0)
    if len(back):
        raise UnfitError(
            "bed",
            f"it bends more sharply than a grain at {line.x[back[0]]:.4g} d from the first foot",
            "smooth it, or choose smaller grains",
        )
    return BedLine(tuple(x.tolist()), tuple(z.tolist()), line.h)


def exposed(centres: FloatArray, tangents: FloatArray, slack: float, stray: float) -> BoolArray:
    """Which grains have no other that is higher along their own normal, within d/2 of it.

    Parameters
    ----------
    centres, tangents : ndarray, shape (n, 2)
        Places of the grains, and the bed's direction under each.
    slack : float
        A slit between two grains that is narrower does not expose the one under it.
    stray : float
        A neighbour that stands out by less hides none.
    """
    free = np.ones(len(centres), bool)
    for one, other in _both_ways(centres, 1.6):
        apart = centres[other] - centres[one]
        along = np.einsum("ij,ij->i", apart, tangents[one])
        higher = apart[:, 1] * tangents[one, 0] - apart[:, 0] * tangents[one, 1]
        free[one[(np.abs(along) <= 0.5 + slack + TIE) & (higher > stray)]] = False
    return free


@dataclass(frozen=True)
class _Rows:
    """Rows of grains along the parts of a line on which the uppermost centres lie."""

    top: BedLine
    beta: float
    pattern: Pattern
    layers: int
    disorder: float
    seed: int

    def parts(self, counted: BoolArray) -> Iterator[FloatArray]:
        """Centres of each part in turn, those of the counted ones first."""
        found = sorted(_parts(self.top, counted), key=lambda part: not part.counted)
        if self.pattern == "horizontal":
            yield self._level(float(np.max(self.top.z)))
            found = [part for part in found if not part.counted]
        for part in found:
            points = self._on(part)
            yield points[_depth(self.top, points)[1] >= -self._stray(part)]

    def _stray(self, part: Part) -> float:
        straight = part.first == part.last and self.pattern == "aligned"
        return TIE if straight else STRAY

    def _on(self, part: Part) -> FloatArray:
        """Rows along one part."""
        rows = self.layers + 1 if part.counted else UNDER
        uneven = self.pattern == "disordered" and part.counted
        below = max(rows, DISORDERED + 1 if uneven else rows) - 1
        curve = (
            offset(self._alone(part), -below * np.sin(self.beta)) if below else self._alone(part)
        )
        spacing = 2 * np.cos(self.beta)
        count = int(np.ceil(curve.lengths.sum() / spacing)) + 1
        disorder = self.disorder if uneven else 0.0
        stacked = rows_on(
            curve, count, below, spacing=spacing, size=disorder, seed=self.seed + part.first
        )
        return np.vstack(stacked[:rows])

    def _alone(self, part: Part) -> BedLine:
        """The part by itself, a little longer at both ends."""
        corners = self.top.corners[part.first : part.last + 2]
        more = 2 * self.layers + 2
        first, last = self.top.tangents[[part.first, part.last]] * more
        x, z = np.vstack([corners[0] - first, corners[1:-1], corners[-1] + last]).T
        return BedLine(tuple(x.tolist()), tuple(z.tolist()), self.top.h)

    def _level(self, highest: float) -> FloatArray:
        """Level rows under the whole line, near to it."""
        high = float(np.sin(self.beta))
        rows = np.arange(0, np.ceil((highest - min(self.top.z)) / high) + self.layers + 2)
        x = np.arange(self.top.x[0], self.top.x[-1], 2 * np.cos(self.beta))
        peak = self.top.crest[0]
        x += (peak - x[0]) % (2 * np.cos(self.beta))
        thick = (self.layers + 1) * high / np.cos(np.radians(np.abs(self.top.slopes_deg).max()))
        found = []
        for row in rows.tolist():
            z, places = highest - row * high, x + (row % 2) * np.cos(self.beta)
            over = self.top.height(places) - z
            found.append(
                np.column_stack([places, np.full(len(x), z)])[(over > -1) & (over < thick)]
            )
        points = np.vstack(found)
        depth = _depth(self.top, points)[1]
        return points[(depth >= -TIE) & (depth < (self.layers + 0.5) * high)]


def _parts(line: BedLine, counted: BoolArray) -> Iterator[Part]:
    """The parts between sharp corners; where counting begins or ends there is a corner, too."""
    bends = np.abs(line.bends_deg[1:-1]) > SHARP_DEG
    ends = np.flatnonzero(bends)
    first = 0
    for last in [*ends.tolist(), len(line.x) - 2]:
        yield Part(first, last, bool(counted[first : last + 1].any()))
        first = last + 1


def _between_aprons(line: BedLine) -> BedLine:
    """A line with less flat bed before and behind it."""
    x = np.array(line.x)
    x[0], x[-1] = x[1] - APRON, x[-2] + APRON
    return BedLine(tuple(x.tolist()), line.z, line.h, line.bare)


def _depth(top: BedLine, points: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Nearest segment of each point, and how deep it lies under the line."""
    segment = top.nearest(points)[0]
    apart = points - top.corners[segment]
    depth = -np.einsum("ij,ij->i", apart, top.normals[segment])
    # over a top the point may be above the line of the other segment
    for other in (np.maximum(segment - 1, 0), np.minimum(segment + 1, len(top.lengths) - 1)):
        corner = np.maximum(segment, other)
        convex = top.bends_deg[corner] > SHARP_DEG
        beside = -np.einsum("ij,ij->i", points - top.corners[other], top.normals[other])
        depth = np.where(convex & (other != segment), np.minimum(depth, beside), depth)
    return segment, np.asarray(depth)


def _without_overlaps(groups: list[FloatArray]) -> FloatArray:
    """Points of all groups but those too near to one before them."""
    points = np.vstack(groups)
    near = cKDTree(points).query_pairs(1 - 2 * TIE, output_type="ndarray")
    kept = np.ones(len(points), bool)
    for first, second in near[np.argsort(near.max(axis=1), kind="stable")].tolist():
        low, high = min(first, second), max(first, second)
        kept[high] &= not kept[low]
    return np.asarray(points[kept])


def _both_ways(centres: FloatArray, reach: float) -> Iterator[tuple[NDArray[np.int64], ...]]:
    """Pairs of grains within a reach, in both orders."""
    one, other = cKDTree(centres).query_pairs(reach, output_type="ndarray").T
    yield one, other
    yield other, one


def _rests(centres: FloatArray) -> BoolArray:
    """Which grains touch one upstream and one downstream that lie no higher, one of them lower."""
    sides = np.zeros((3, len(centres)), bool)
    for one, other in _both_ways(centres, 1 + TOUCH):
        apart = centres[other] - centres[one]
        below = apart[:, 1] <= TOUCH
        under = apart[:, 1] < -LOWER
        for side, beside in enumerate((apart[:, 0] <= 0, apart[:, 0] > 0, under)):
            sides[side, one[below & beside]] = True
    return np.asarray(sides.all(axis=0))


def _touching(centres: FloatArray, chosen: BoolArray) -> BoolArray:
    """Which grains touch one of the chosen ones."""
    found = np.zeros(len(centres), bool)
    for one, other in _both_ways(centres, 1 + TOUCH):
        found[one[chosen[other]]] = True
    return found


def within(x: FloatArray, counts: str | Range) -> BoolArray:
    """Which places along x a range holds; words hold all."""
    if isinstance(counts, str):
        return np.ones(len(x), bool)
    return np.asarray((x >= counts[0]) & (x <= counts[1]))


def _near(x: FloatArray, bare: tuple[tuple[float, float], ...]) -> BoolArray:
    found = np.zeros(len(x), bool)
    for start, end in bare:
        found |= (x > start - BARE) & (x < end + BARE)
    return found
