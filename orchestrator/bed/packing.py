"""Where the grains of a bed lie, which of them are exposed, and which may move.

A lattice of equal spheres has rows in which the centres are ``2 d cos(beta)`` apart, each row
resting in the pockets of the one below, ``d sin(beta)`` lower. Lengths here are in diameters d of
the scene, with the foot of the first form at the origin; each grain has a size of its own.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.bed.line import BedLine
from orchestrator.digits import whole_up
from orchestrator.study.parts import Packing as Pattern
from orchestrator.study.parts import Range, UnfitError
from orchestrator.types import BoolArray, FloatArray, IntArray

TIE = 1e-6
"""Neighbours of a lattice lie exactly on the limits below; round-off must not decide, diameters."""
TOUCH = 1e-3  # two grains closer than this touch, of the mean of their diameters
APRON = 10.0  # length of the fixed flat bed beyond each toe, diameters
STRAY = 0.1  # rows of a disordered bed are straight within this, diameters
DISORDERED = 4
"""Least disordered rows: the packing is the same for any number of mobile layers up to it."""
PERTURBATION = 1e-6
"""How far a replica's grains lie aside, diameters: it decides which grain of a chain goes first. A
deck has nine digits of each place."""
LEE_DEPTH = 1.5  # thickness of the fixed lee side, layers: no grain falls through it
SHARP_DEG = 8.0  # bend from which on rows do not follow the bed round a corner
SLIT = 0.15
"""Between neighbours of a row that goes round a bend a gap is at most this wide, diameters."""
ELSEWHERE = 'choose another part of the bed, or "all"'
BARE = 1.0  # grains this near to an obstacle are fixed under its foot, diameters
LOWER = 0.1  # a neighbour bears a grain that stands so much over it, diameters
UNDER = 2  # rows of fixed grains where none is counted: none falls through them
HIDES = (
    4.0  # farthest distance at which a grain hides another one of a lattice, diameters
)
OFFSET = (
    0.125  # largest offset of a grain normal to its row, over the size of the disorder
)
FINE = 0.1  # between two places of a curve at which a row may be opened, diameters
TURNS = 100  # how often a row is opened further; grains that overlap then are left out by `cover`
PLACES = 2000  # places along a bed without grains, as many as a figure shows
ROOM = 1 + 1e-9  # neighbours of a disordered row are at least this far apart, diameters


@dataclass(frozen=True)
class Places:
    """The centres of n grains in one unit of length: along the flow, across it, up; shape (n, 3).

    A strip of some `width` begins again beyond its sides; the width is 0 in one plane.
    """

    xyz: FloatArray
    width: float = 0.0

    @classmethod
    def of(
        cls, centres: FloatArray, across: ArrayLike = 0.0, width: float = 0.0
    ) -> "Places":
        """Places from x and z, shape (n, 2), and y."""
        x, z = centres.T
        y = np.broadcast_to(np.asarray(across, float), x.shape)
        if width:
            y = np.mod(y, width)
            # the remainder of a tiny negative number is rounded to the width itself
            y = np.where(y < width, y, 0.0)
        return cls(np.column_stack([x, y, z]), width)

    def pairs(self, reach: float) -> tuple[IntArray, IntArray, FloatArray]:
        """First and second grain of each of k pairs within a reach, in both orders, (k,).

        Also the vector from the first to the second, the shorter way across the sides, (k, 3).
        """
        pairs = _tree(self.xyz, self.width).query_pairs(reach, output_type="ndarray")
        first, second = np.vstack([pairs, pairs[:, ::-1]]).T
        apart = self.xyz[second] - self.xyz[first]
        apart[:, 1] = across(apart[:, 1], self.width)
        return first, second, apart

    def contacts(self, sizes: FloatArray, touch: float = TOUCH) -> tuple[IntArray, ...]:
        """Pairs as `pairs` gives them whose surfaces are nearer than a part of their mean size."""
        first, second, apart = self.pairs((1 + touch) * float(sizes.max()))
        close = (
            np.linalg.norm(apart, axis=1)
            < (1 + touch) * (sizes[first] + sizes[second]) / 2
        )
        return first[close], second[close], apart[close]


def _tree(points: FloatArray, width: float = 0.0) -> Any:
    from scipy.spatial import cKDTree  # 0.4 s, for which a plan does not wait

    return cKDTree(points, boxsize=np.array([0.0, width, 0.0])[: points.shape[1]])


def across(distance: FloatArray, width: float) -> FloatArray:
    """Distances across the flow, the shorter way in a strip of some width."""
    return distance - width * np.round(distance / width) if width else distance


@dataclass(frozen=True)
class Packing:
    """The grains of a pile, n of them, lengths in diameters; arrays of shape (n,).

    `centres`, shape (n, 2), has x and z of each centre. `mobile` grains may move, the others are
    fixed. `windward` ones are exposed and counted, by default on windward sides, `lee` ones exposed
    elsewhere. `arc_length` is the position along the bed line, which means something for exposed
    grains. `across` is y of each centre and `width` that of a strip with periodic sides; both are 0
    in one plane.
    """

    centres: FloatArray
    sizes: FloatArray
    mobile: BoolArray
    windward: BoolArray
    lee: BoolArray
    arc_length: FloatArray
    across: FloatArray | float = 0.0
    width: float = 0.0

    @property
    def places(self) -> Places:
        """The centres in space."""
        return Places.of(self.centres, self.across, self.width)

    @property
    def count(self) -> int:
        """N(d): how many grains are counted."""
        return int(self.windward.sum())


@dataclass(frozen=True)
class Lattice:
    """How the grains of a bed that is not poured are laid; lengths in diameters.

    beta of the lattice; `gap`, the height z0/d of the exposed grains' lowest points over the bed
    line; rows along the bed ("aligned"), level ("horizontal"), or along it with random gaps
    ("disordered"); layers that may move; the largest random gap in the row below them; a seed that
    chooses one disordered packing of many: on a lattice 0 is itself, others are its replicas.
    """

    entrainment_angle_deg: float
    gap: float
    pattern: Pattern
    mobile_layers: int
    disorder: float = 0.0
    seed: int = 0

    @property
    def beta(self) -> float:
        """Entrainment angle, rad."""
        return float(np.radians(self.entrainment_angle_deg))

    @property
    def uneven(self) -> bool:
        """Whether its rows have random gaps."""
        return self.pattern == "disordered"

    def packed(
        self, line: BedLine, centres: FloatArray, kinds: Iterable[BoolArray]
    ) -> Packing:
        """The mobile, windward and lee grains on a line; those of a replica a little aside."""
        mobile, windward, lee = kinds
        aside = PERTURBATION if self.seed and not self.uneven else 0.0
        shift = np.random.default_rng(self.seed).uniform(-aside, aside, centres.shape)
        arc_length = line.nearest(centres)[1]
        return Packing(
            centres + shift, np.ones(len(centres)), mobile, windward, lee, arc_length
        )


def along(line: BedLine, counts: str | Range) -> Packing:
    """Places on a bed line, none of them mobile: the middles of `PLACES` equal counted lengths.

    `counts` is as `BedLine.counted` takes it; an UnfitError if no bed is counted.
    """
    ends = () if isinstance(counts, str) else counts
    finer = line.with_corners([*ends, *(end for bare in line.bare for end in bare)])
    x, s = np.array(finer.x), finer.arc_lengths
    middle = (x[1:] + x[:-1]) / 2
    chosen = line.counted(counts)[np.searchsorted(line.x, middle) - 1] & within(
        middle, counts
    )
    for start, end in line.bare:
        chosen &= (middle < start) | (middle > end)
    sums = np.concatenate([[0.0], np.cumsum(np.where(chosen, finer.lengths, 0.0))])
    if not sums[-1]:
        raise UnfitError("bed.counted", "no bed is counted", ELSEWHERE)
    ways = (np.arange(PLACES) + 0.5) / PLACES * sums[-1]
    piece = np.searchsorted(sums, ways, side="right") - 1
    arc_length = s[piece] + ways - sums[piece]
    x = np.interp(arc_length, s, x)
    each, none = np.ones(PLACES), np.zeros(PLACES, bool)
    return Packing(
        np.column_stack([x, line.height(x)]), each, none, ~none, none, arc_length
    )


def pile(line: BedLine, lattice: Lattice) -> Packing:
    """Pack a pile of two straight faces: rows of its windward face fill it to the lee one."""
    beta, surface = lattice.beta, 0.5 + lattice.gap
    row_height, faces = np.sin(beta), (line.top - 1, line.top)
    most = whole_up(line.crest[1] / line.tangents[faces[0], 0] / row_height) + 1
    mobile_layers = min(lattice.mobile_layers, most)
    # under a slope's level rows a grain rests on one that lies deeper below the face
    layers = mobile_layers + (lattice.pattern == "horizontal")
    # below the layers that hold mobile grains one is enough: a grain touches no deeper one
    thick = {faces[0]: (layers + 0.5) * row_height, faces[1]: LEE_DEPTH * row_height}
    points = _filling(
        line, replace(lattice, mobile_layers=mobile_layers), surface, thick
    )
    deep = np.array([surface - line.over(points, face) for face in faces])
    depth, level = deep.min(axis=0), points[:, 1] - surface
    shell = (deep[0] < thick[faces[0]]) | (deep[1] < thick[faces[1]])
    inside = (depth >= -(STRAY if lattice.uneven else TIE)) & shell
    below = (level < -TIE) & (depth > 0.5 * row_height) & (level > -1.3)
    kept = inside & ((level >= -TIE) | below)
    top = points[np.argmax(np.where(kept, points[:, 1], -np.inf))]
    kept |= _behind(top, points) & (deep[1] < -TIE)
    body, depth, behind = points[kept], deep[0, kept], deep[1, kept]
    buried = level[kept] < -TIE
    ahead = body[:, 0] <= line.crest[0] + TIE
    free = (
        exposed(body, line.tangents[np.where(ahead, *faces)], slack=lattice.disorder)
        & ~buried
    )
    windward, lee = free & ahead, free & ~ahead
    # on a steep lee side no grain lies by itself
    fallen = (behind < 1) & ~_rests(body)
    mobile = (
        (depth < (mobile_layers - 0.5) * row_height) & ~buried & ~fallen
    ) | windward
    needed = ~buried | _touching(body, mobile)
    apron = _apron(body[needed], surface)
    fixed = np.zeros(len(apron), bool)
    kinds = (np.append(chosen[needed], fixed) for chosen in (mobile, windward, lee))
    return lattice.packed(line, np.vstack([body[needed], apron]), kinds)


def _behind(top: FloatArray, points: FloatArray) -> BoolArray:
    """Which of some places bear a grain from downstream; beyond a steep lee side else none does."""
    x, z = (points - top).T
    return np.asarray((np.hypot(x, z) < 1 + TOUCH) & (x > 0) & (z < -LOWER))


def _filling(
    line: BedLine, lattice: Lattice, surface: float, thick: Mapping[int, float]
) -> FloatArray:
    """Where grains of the pattern may lie in a pile of two faces, one of them on the crest.

    Of all places those are made that are no deeper below a face than it is `thick`, and some more.
    """
    beta, face = lattice.beta, line.tangents[line.top - 1]
    direction = np.array([1.0, 0.0]) if lattice.pattern == "horizontal" else face
    normal = np.array([-direction[1], direction[0]])
    apex = line.crest + np.array([0, surface / face[0]])
    corners = np.array([np.zeros(2), line.toe, line.crest]) - apex
    along, down = (
        corners @ direction / np.cos(beta) / 2,
        -corners @ normal / np.sin(beta),
    )
    rows = np.arange(0, whole_up(down.max()) + 3)
    columns = np.arange(-whole_up(-along.min()) - 3, whole_up(along.max()) + 4)
    offset = (2 * columns + rows[:, None] % 2) * np.cos(beta)
    fall, near = (
        np.broadcast_to(rows[:, None] * np.sin(beta), offset.shape),
        offset < -np.inf,
    )
    for face, most in thick.items():
        out = line.normals[face]
        over = offset * (direction @ out) - fall * (normal @ out)
        near |= np.abs(over + (apex - line.corners[face]) @ out - surface) < most + 1
    points = apex + np.outer(offset[near], direction) - np.outer(fall[near], normal)
    if not lattice.uneven:
        return np.asarray(points)
    uneven = max(lattice.mobile_layers, DISORDERED)
    count = whole_up(line.crest_s / np.cos(beta) / 2) + uneven + 4
    upper = apex + _disordered(count, uneven, lattice) @ np.vstack([direction, normal])
    return np.vstack(
        [upper, points[(apex - points) @ normal > (uneven + 0.5) * np.sin(beta)]]
    )


def _disordered(columns: int, layers: int, lattice: Lattice) -> FloatArray:
    """Rows over a straight one with random gaps: places along and normal to them, shape (n, 2)."""
    rng = np.random.default_rng(lattice.seed)
    size = lattice.disorder
    spacing = 2 * np.cos(lattice.beta) + rng.uniform(0, size, 2 * columns)
    offset = rng.uniform(-OFFSET * size, OFFSET * size, 2 * columns + 1)
    while True:
        lowest = np.column_stack([np.concatenate([[0], np.cumsum(spacing)]), offset])
        rows = _stacked(lowest, layers)
        if not any(np.any(_overlap(row) > 0) for row in rows):
            break
        # where two grains of a row would overlap, the row below them is opened a little
        for above, row in enumerate(rows):
            wide = np.zeros_like(spacing)
            for place in np.flatnonzero(_overlap(row) > 0):
                wide[place : place + layers - above + 1] += _overlap(row)[place]
            spacing = spacing + wide
    return np.asarray(np.vstack(rows) - rows[0][len(rows[0]) // 2])


def _stacked(lowest: FloatArray, layers: int) -> list[FloatArray]:
    """Rows above a lowest one, the uppermost first: each grain rests on two of the row below."""
    rows = [lowest]
    for _ in range(layers):
        apart = np.diff(rows[0], axis=0)
        half = np.hypot(*apart.T)[:, None] / 2
        outward = np.column_stack([-apart[:, 1], apart[:, 0]]) / (2 * half)
        rows.insert(0, rows[0][:-1] + apart / 2 + outward * np.sqrt(1 - half**2))
    return rows


def _overlap(row: FloatArray) -> FloatArray:
    """How much nearer than `ROOM` each two neighbours of a row are."""
    return np.asarray(ROOM - np.hypot(*np.diff(row, axis=0).T))


def _apron(body: FloatArray, surface: float) -> FloatArray:
    """Two flat rows of touching fixed grains, each starting where it touches the pile."""
    drop = np.abs(body[:, 1] - surface)
    near = body[drop < 1]
    clearance = np.sqrt(1 - drop[drop < 1] ** 2)
    steps = np.arange(0, APRON)
    first, last = (near[:, 0] - clearance).min(), (near[:, 0] + clearance).max()
    x = np.concatenate([first - steps, last + steps])
    return np.column_stack([x, np.full(len(x), surface)])


def cover(
    line: BedLine, ground: BedLine, counts: str | Range, lattice: Lattice
) -> Packing:
    """Pack the grains of a bed of any shape; lengths in diameters.

    The line is divided at its sharp corners. Each part has rows of its own, those that are counted
    first; where rows of two parts meet, grains of the later one that would overlap are left out,
    and grains that do not rest on two are fixed. `ground` is the bed line without obstacles,
    `counts` says which exposed grains are counted, as `BedLine.counted` takes it. Raises an
    UnfitError if the bed bends more sharply than grains can follow, or none is counted.
    """
    x = np.array(ground.x)
    x[0], x[-1] = x[1] - APRON, x[-2] + APRON
    top = offset(replace(ground, x=tuple(x.tolist())), 0.5 + lattice.gap)
    segments = top.counted(counts)
    centres = _without_overlaps(list(_rows(top, segments, lattice)))
    under, depth = _depth(top, centres)
    slack = 0.0 if lattice.pattern == "horizontal" else max(SLIT, lattice.disorder)
    seen = exposed(centres, top.tangents[under], slack) & (depth < 1)
    chosen = segments[under] & within(centres[:, 0], counts)
    for start, end in line.bare:
        chosen &= (centres[:, 0] <= start - BARE) | (centres[:, 0] >= end + BARE)
    near = depth < (lattice.mobile_layers - 0.5) * np.sin(lattice.beta)
    mobile = chosen & near & _rests(centres)
    counted = mobile & seen
    if not counted.any():
        raise UnfitError("bed.counted", "no grain is counted", ELSEWHERE)
    needed = mobile | seen | _touching(centres, mobile)
    kinds = (mobile, counted, seen & ~counted)
    return lattice.packed(line, centres[needed], (kind[needed] for kind in kinds))


def offset(line: BedLine, distance: float) -> BedLine:
    """The line at a distance above a line, with its corners; UnfitError if it bends too sharply."""
    bends = np.radians(line.bends_deg) / 2
    ends = np.vstack([line.normals[:1], line.normals, line.normals[-1:]])
    middle = ends[:-1] + ends[1:]
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    x, z = (line.corners + middle * (distance / np.cos(bends))[:, None]).T
    back = np.flatnonzero(np.diff(x) <= 0)
    if len(back):
        what = f"it bends more sharply than a grain at {line.x[back[0]]:.4g} d from the first foot"
        raise UnfitError("bed", what, "smooth it, or choose smaller grains")
    return BedLine(tuple(x.tolist()), tuple(z.tolist()), line.h)


def _rows(top: BedLine, counted: BoolArray, lattice: Lattice) -> Iterator[FloatArray]:
    """Centres of the rows along each part of a line between sharp corners, the counted first."""
    bends = np.flatnonzero(np.abs(top.bends_deg[1:-1]) > SHARP_DEG).tolist()
    ends = [*bends, len(top.lengths) - 1]
    parts = list(zip([0, *(end + 1 for end in bends)], ends, strict=True))
    carries = [bool(counted[first : last + 1].any()) for first, last in parts]
    if lattice.pattern == "horizontal":
        yield _level_rows(top, lattice)
    for turn in (True, False) if lattice.pattern != "horizontal" else (False,):
        for first, last in (
            part for part, has in zip(parts, carries, strict=True) if has == turn
        ):
            points = _rows_along(top, first, last, lattice, turn)
            straight = first == last and lattice.pattern == "aligned"
            yield points[_depth(top, points)[1] >= -(TIE if straight else STRAY)]


def _rows_along(
    top: BedLine, first: int, last: int, lattice: Lattice, counted: bool
) -> FloatArray:
    """Rows under some segments of a line, which end a little beyond them."""
    layers = lattice.mobile_layers + (lattice.pattern == "horizontal")
    rows = layers + 1 if counted else UNDER
    uneven = lattice.uneven and counted
    below = max(rows, DISORDERED + 1 if uneven else rows) - 1
    corners = top.corners[first : last + 2].copy()
    corners[0] -= top.tangents[first] * (2 * layers + 2)
    corners[-1] += top.tangents[last] * (2 * layers + 2)
    curve = offset(BedLine.through(corners, top.h), -below * np.sin(lattice.beta))
    disorder = lattice.disorder if uneven else 0.0
    stacked = _on_a_curve(curve, below, lattice, disorder, lattice.seed + first)
    return np.vstack(stacked[:rows])


def _on_a_curve(
    curve: BedLine, layers: int, lattice: Lattice, size: float, seed: int
) -> list[FloatArray]:
    """Rows over a curve, on which the lowest lies with random gaps, the uppermost first."""
    spacing = 2 * np.cos(lattice.beta)
    count = whole_up(curve.lengths.sum() / spacing) + 1
    rng = np.random.default_rng(seed)
    gaps = rng.uniform(0, size, count) if size else np.zeros(count)
    aside = rng.uniform(-OFFSET * size, OFFSET * size, count + 1)
    close = np.concatenate([[0.0], np.cumsum(spacing + gaps)])
    # the opening belongs to places of the curve: grains that it shifts leave it where it is
    length = 2 * float(close[-1]) + 1
    places = np.linspace(0, length, whole_up(length / FINE) + 1)
    step, opened = places[1] - places[0], np.zeros(len(places))
    arc = curve.arc_lengths - curve.arc_lengths[0]
    for _ in range(TURNS):
        along = np.interp(close, places - np.cumsum(opened), places)
        segment = np.clip(
            np.searchsorted(arc, along, side="right") - 1, 0, len(arc) - 2
        )
        into = (along - arc[segment])[:, None] * curve.tangents[segment]
        lowest = curve.corners[segment] + into + aside[:, None] * curve.normals[segment]
        rows = _stacked(lowest, layers)
        # where two grains of a row would overlap, in a bend, the row below them is opened
        wide = np.zeros(count)
        for above, row in enumerate(rows):
            more = np.maximum(_overlap(row), 0.0)
            for place in range(layers - above + 1):
                opening = wide[place : place + len(more)]
                np.maximum(opening, more, out=opening)
        if not wide.any():
            break
        gap = np.clip(np.searchsorted(along, places) - 1, 0, count - 1)
        opened += np.minimum(1.1 * wide[gap] / np.diff(along)[gap], 0.5) * step
        opened = np.minimum(opened, 0.5 * step)
    return rows


def _level_rows(top: BedLine, lattice: Lattice) -> FloatArray:
    """Level rows under a whole line, near to it; one grain of the uppermost is on the crest."""
    row_height, half = np.sin(lattice.beta), np.cos(lattice.beta)
    layers = lattice.mobile_layers + 1
    thick = (layers + 1) * row_height / np.cos(np.radians(np.abs(top.slopes_deg).max()))
    highest = float(np.max(top.z))
    spacing = 2 * half
    # where a whole number of spacings lies before the crest, its last digit decides nothing
    before = -whole_up(-(top.crest[0] - top.x[0]) / spacing)
    count = whole_up((top.x[-1] - top.x[0]) / spacing)
    x = top.crest[0] + spacing * (np.arange(count) - before)
    parts = []
    for row in range(whole_up((highest - min(top.z)) / row_height) + layers + 2):
        places = np.column_stack(
            [x + row % 2 * half, np.full_like(x, highest - row * row_height)]
        )
        over = top.height(places[:, 0]) - places[:, 1]
        parts.append(places[(over > -1) & (over < thick)])
    points = np.vstack(parts)
    depth = _depth(top, points)[1]
    return np.asarray(points[(depth >= -TIE) & (depth < (layers + 0.5) * row_height)])


def _depth(top: BedLine, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """Nearest segment of each point, and how deep it lies under the line."""
    segment = top.nearest(points)[0]
    depth = -top.over(points, segment)
    # over a top the point may be above the line of the other segment
    for other in (
        np.maximum(segment - 1, 0),
        np.minimum(segment + 1, len(top.lengths) - 1),
    ):
        convex = top.bends_deg[np.maximum(segment, other)] > SHARP_DEG
        beside = -top.over(points, other)
        depth = np.where(convex & (other != segment), np.minimum(depth, beside), depth)
    return segment, depth


def _without_overlaps(groups: list[FloatArray]) -> FloatArray:
    """Points of all groups but those too near to one before them."""
    points = np.vstack(groups)
    near = _tree(points).query_pairs(1 - 2 * TIE, output_type="ndarray")
    kept = np.ones(len(points), bool)
    for first, second in near[np.argsort(near.max(axis=1), kind="stable")].tolist():
        low, high = min(first, second), max(first, second)
        kept[high] &= not kept[low]
    return np.asarray(points[kept])


def exposed(centres: FloatArray, tangents: FloatArray, slack: float = 0.0) -> BoolArray:
    """Which equal grains have no other that is higher along their own normal, within d/2 of it.

    `tangents`, shape (n, 2), has the bed's direction under each. A slit between two grains that is
    narrower than `slack` does not expose the one under it; on such a bed a neighbour that stands
    out by less than `STRAY` hides none.
    """
    # through a gap in the row above, a grain of the row above that may hide one
    first, _, apart = Places.of(centres).pairs(HIDES)
    x, z = apart[:, 0], apart[:, 2]
    tx, tz = tangents[first].T
    hidden = np.abs(x * tx + z * tz) <= 0.5 + slack + TIE
    hidden &= z * tx - x * tz > (STRAY if slack else TIE)
    return np.asarray(np.bincount(first[hidden], minlength=len(centres)) == 0)


def shadows(
    along: Places, height: FloatArray, radii: FloatArray
) -> tuple[IntArray, IntArray]:
    """Pairs of grains of any sizes: one that is hidden, and one that hides it.

    A grain is hidden where the line through its centre, normal to the bed, meets another grain
    whose centre lies higher. `along` has the place of each along the bed and across the flow, its
    third coordinate is 0; `height` is over the bed line.
    """
    first, second, apart = along.pairs(float(radii.max()) + TIE)
    hidden = np.linalg.norm(apart, axis=1) <= radii[second] + TIE
    hidden &= height[second] > height[first] + TIE
    return first[hidden], second[hidden]


def unshadowed(along: Places, height: FloatArray, radii: FloatArray) -> BoolArray:
    """Which grains of any sizes no other hides; arguments as in `shadows`."""
    hidden, _ = shadows(along, height, radii)
    return np.asarray(np.bincount(hidden, minlength=len(height)) == 0)


def _rests(centres: FloatArray) -> BoolArray:
    """Which grains touch one upstream and one downstream that lie no higher, one of them lower."""
    first, _, apart = Places.of(centres).pairs(1 + TOUCH)
    x, z = apart[:, 0], apart[:, 2]
    sides = np.zeros((3, len(centres)), bool)
    for side, beside in zip(sides, (x <= 0, x > 0, z < -LOWER), strict=True):
        side[first[(z <= TOUCH) & beside]] = True
    return np.asarray(sides.all(axis=0))


def _touching(centres: FloatArray, chosen: BoolArray) -> BoolArray:
    """Which grains touch one of the chosen ones, or are one."""
    return np.asarray(_tree(centres[chosen]).query(centres)[0] < 1 + TOUCH)


def within(x: FloatArray, counts: str | Range) -> BoolArray:
    """Which places along x a range contains; words contain all."""
    if isinstance(counts, str):
        return np.ones(len(x), bool)
    return np.asarray((x >= counts[0] - TIE) & (x <= counts[1] + TIE))
