"""Where the grains of a bed lie, which of them are exposed, and which may move.

A lattice of equal spheres has rows in which the centres are ``2 d cos(beta)`` apart,
each row resting in the pockets of the one below, ``d sin(beta)`` lower. Lengths here
are in diameters d of the scene, with the toe of the first form at the origin; each
grain has a size of its own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.bed.line import BedLine
from orchestrator.digits import whole_up
from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import Packing as Pattern
from orchestrator.study.parts import Range
from orchestrator.types import BoolArray, FloatArray, IntArray

TIE = 1e-6
"""Neighbours of a lattice lie exactly on the limits below; round-off must not decide,
diameters."""
TOUCH = 1e-3
"""Two grains closer than this touch, of the mean of their diameters."""
APRON = 10.0
"""Length of the fixed flat bed beyond each toe, diameters."""
STRAY = 0.1
"""Rows of a disordered bed are straight within this, diameters."""
DISORDERED = 4
"""Least disordered rows: the packing is the same for any number of mobile layers up to
it."""
PERTURBATION = 1e-6
"""How far a replica's grains lie aside, diameters: it decides which grain of a chain
goes first. A deck has nine digits of each place."""
LEE_DEPTH = 1.5
"""Thickness of the fixed lee side, layers: no grain falls through it."""
SHARP_ROW_DEG = 8.0
"""Bend from which on rows do not follow the bed round a corner."""
SLIT = 0.15
"""Between neighbours of a row that goes round a bend a gap is at most this wide,
diameters."""
ELSEWHERE = 'choose another part of the bed, or "all"'
"""What to do where nothing is counted."""
BARE = 1.0
"""Grains this near to an obstacle are fixed under its foot, diameters."""
LOWER = 0.1
"""A neighbour bears a grain that stands so much over it, diameters."""
UNDER = 2
"""Rows of fixed grains where none is counted: none falls through them."""
HIDES = 4.0
"""Farthest distance at which a grain hides another one of a lattice, diameters."""
OFFSET = 0.125
"""Largest offset of a grain normal to its row, over the size of the disorder."""
FINE = 0.1
"""Distance between two places of a curve at which a row may be opened, diameters."""
TURNS = 100
"""How often a row is opened further; `cover` leaves out grains that overlap then."""
SAMPLES = 2000
"""Places along a bed without grains, as many as a figure shows."""
ROOM = 1 + 1e-9
"""Neighbours of a disordered row are at least this far apart, diameters."""


@dataclass(frozen=True)
class Places:
    """The centres of n grains in one unit of length.

    Attributes
    ----------
    xyz
        Along the flow, across it, up; shape (n, 3).
    width
        Width of a strip that begins again beyond its sides; 0 in one plane.
    """

    xyz: FloatArray
    width: float = 0.0

    @classmethod
    def of(
        cls, centres: FloatArray, across: ArrayLike = 0.0, width: float = 0.0
    ) -> "Places":
        """Make places.

        Parameters
        ----------
        centres
            X and z, shape (n, 2).
        across
            Y of all, or of each, shape (n,).
        width
            Width of the strip.

        Returns
        -------
        Places
            The places, across the flow between 0 and the width.
        """
        x, z = centres.T
        y = np.broadcast_to(np.asarray(across, float), x.shape)
        if width:
            y = np.mod(y, width)
            # the remainder of a tiny negative number is rounded to the width itself
            y = np.where(y < width, y, 0.0)
        return cls(np.column_stack([x, y, z]), width)

    def pairs(self, reach: float) -> tuple[IntArray, IntArray, FloatArray]:
        """Find the k pairs of grains within a reach, each in both orders.

        Parameters
        ----------
        reach
            The largest distance.

        Returns
        -------
        first, second
            The grains, shape (k,).
        apart
            The vector from the first to the second, the shorter way across the sides,
            shape (k, 3).
        """
        pairs = _tree(self.xyz, self.width).query_pairs(reach, output_type="ndarray")
        first, second = np.vstack([pairs, pairs[:, ::-1]]).T
        apart = self.xyz[second] - self.xyz[first]
        apart[:, 1] = across(apart[:, 1], self.width)
        return first, second, apart

    def contacts(self, sizes: FloatArray, touch: float = TOUCH) -> tuple[IntArray, ...]:
        """Find the pairs of grains that touch.

        Parameters
        ----------
        sizes
            Diameters, shape (n,).
        touch
            Largest distance of two surfaces, over the mean of their diameters.

        Returns
        -------
        tuple
            As `pairs` gives them.
        """
        first, second, apart = self.pairs((1 + touch) * float(sizes.max()))
        distance = np.linalg.norm(apart, axis=1)
        is_close = distance < (1 + touch) * (sizes[first] + sizes[second]) / 2
        return first[is_close], second[is_close], apart[is_close]


def _tree(points: FloatArray, width: float = 0.0) -> Any:
    """A tree of points, which begins again beyond the sides of a strip."""
    from scipy.spatial import cKDTree  # 0.4 s, for which a plan does not wait

    return cKDTree(points, boxsize=np.array([0.0, width, 0.0])[: points.shape[1]])


def across(distance: FloatArray, width: float) -> FloatArray:
    """Find the shorter way across the flow.

    Parameters
    ----------
    distance
        Distances across the flow.
    width
        Width of the strip; 0 in one plane.

    Returns
    -------
    FloatArray
        The shorter distances.
    """
    if not width:
        return distance
    return distance - width * np.round(distance / width)


@dataclass(frozen=True)
class Packing:
    """The grains of a pile, n of them, lengths in diameters; arrays of shape (n,).

    Attributes
    ----------
    centres
        X and z of each centre, shape (n, 2).
    sizes
        The diameters.
    mobile
        Which grains may move; the others are fixed.
    windward
        Which are exposed and counted, by default on windward sides.
    lee
        Which are exposed elsewhere.
    arc_length
        The position along the bed line, which means something for exposed grains.
    across
        Y of each centre; 0 in one plane.
    width
        Width of a strip with periodic sides; 0 in one plane.
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

    Attributes
    ----------
    entrainment_angle_deg
        Beta of the lattice, degrees.
    gap
        Height z0/d of the exposed grains' lowest points over the bed line.
    pattern
        Rows along the bed ("aligned"), level ("horizontal"), or along it with random
        gaps ("disordered").
    mobile_layers
        Layers that may move.
    disorder
        The largest random gap in the row below them.
    seed
        Chooses one disordered packing of many: on a lattice 0 is itself, others are its
        replicas.
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

    @property
    def layers(self) -> int:
        """Layers that hold mobile grains.

        Of horizontal rows under a slope a grain rests on one that lies deeper below the
        face.
        """
        return self.mobile_layers + (1 if self.pattern == "horizontal" else 0)

    def packed(
        self,
        line: BedLine,
        centres: FloatArray,
        mobile: BoolArray,
        windward: BoolArray,
        lee: BoolArray,
    ) -> Packing:
        """Make the packing of grains on a line; those of a replica lie a little aside.

        Parameters
        ----------
        line
            The bed line.
        centres
            X and z of the grains, shape (n, 2).
        mobile, windward, lee
            As in `Packing`.

        Returns
        -------
        Packing
            The packing.
        """
        aside = PERTURBATION if self.seed and not self.uneven else 0.0
        shift = np.random.default_rng(self.seed).uniform(-aside, aside, centres.shape)
        _, arc_length = line.nearest(centres)
        sizes = np.ones(len(centres))
        return Packing(centres + shift, sizes, mobile, windward, lee, arc_length)


def places_along(line: BedLine, counts: str | Range) -> Packing:
    """Lay places on a bed line: the middles of `SAMPLES` equal counted lengths.

    Parameters
    ----------
    line
        The bed line.
    counts
        Which part is counted, as `BedLine.counted` takes it.

    Returns
    -------
    Packing
        The places, none of them mobile.

    Raises
    ------
    UnfitError
        If no bed is counted.
    """
    ends = [] if isinstance(counts, str) else list(counts)
    for bare in line.bare:
        ends += bare
    finer = line.with_corners(ends)
    corners = np.array(finer.x)
    middle = (corners[1:] + corners[:-1]) / 2
    is_counted = line.counted(counts)[np.searchsorted(line.x, middle) - 1]
    is_counted &= places_within(middle, counts)
    for start, end in line.bare:
        is_counted &= (middle < start) | (middle > end)
    lengths = np.where(is_counted, finer.lengths, 0.0)
    sums = np.concatenate([[0.0], np.cumsum(lengths)])
    if not sums[-1]:
        raise UnfitError("bed.counted", "no bed is counted", ELSEWHERE)
    ways = (np.arange(SAMPLES) + 0.5) / SAMPLES * sums[-1]
    piece = np.searchsorted(sums, ways, side="right") - 1
    arc_length = finer.arc_lengths[piece] + ways - sums[piece]
    x = np.interp(arc_length, finer.arc_lengths, corners)
    none = np.zeros(SAMPLES, bool)
    return Packing(
        centres=np.column_stack([x, line.height(x)]),
        sizes=np.ones(SAMPLES),
        mobile=none,
        windward=~none,
        lee=none,
        arc_length=arc_length,
    )


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
    has_fallen = (depths.lee < 1) & ~_rests(body)
    row_height = np.sin(lattice.beta)
    is_near = depths.windward < (lattice.mobile_layers - 0.5) * row_height
    mobile = (is_near & ~is_buried & ~has_fallen) | windward
    needed = ~is_buried | _touching(body, mobile)
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
        rows = _stacked(lowest, layers)
        if not any(np.any(_overlap(row) > 0) for row in rows):
            break
        # where two grains of a row would overlap, the row below them is opened a little
        for above, row in enumerate(rows):
            overlap = _overlap(row)
            wide = np.zeros_like(spacing)
            for place in np.flatnonzero(overlap > 0):
                wide[place : place + layers - above + 1] += overlap[place]
            spacing = spacing + wide
    return np.asarray(np.vstack(rows) - rows[0][len(rows[0]) // 2])


def _stacked(lowest: FloatArray, layers: int) -> list[FloatArray]:
    """Rows above a lowest one, the uppermost first: each grain rests on two below."""
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


def cover(
    line: BedLine, ground: BedLine, counts: str | Range, lattice: Lattice
) -> Packing:
    """Pack the grains of a bed of any shape; lengths in diameters.

    The line is divided at its sharp corners. Each part has rows of its own, those that
    are counted first; where rows of two parts meet, grains of the later one that would
    overlap are left out, and grains that do not rest on two are fixed.

    Parameters
    ----------
    line
        The bed line.
    ground
        The bed line without obstacles.
    counts
        Which exposed grains are counted, as `BedLine.counted` takes it.
    lattice
        How the grains lie.

    Returns
    -------
    Packing
        The packing.

    Raises
    ------
    UnfitError
        If the bed bends more sharply than grains can follow, or none is counted.
    """
    x = np.array(ground.x)
    x[0] = x[1] - APRON
    x[-1] = x[-2] + APRON
    top = offset(replace(ground, x=tuple(x.tolist())), 0.5 + lattice.gap)
    is_counted = top.counted(counts)
    centres = _without_overlaps(list(_rows(top, is_counted, lattice)))
    under, depth = _depth(top, centres)
    slack = 0.0 if lattice.pattern == "horizontal" else max(SLIT, lattice.disorder)
    seen = exposed(centres, top.tangents[under], slack) & (depth < 1)
    chosen = is_counted[under] & places_within(centres[:, 0], counts)
    for start, end in line.bare:
        chosen &= (centres[:, 0] <= start - BARE) | (centres[:, 0] >= end + BARE)
    is_near = depth < (lattice.mobile_layers - 0.5) * np.sin(lattice.beta)
    mobile = chosen & is_near & _rests(centres)
    windward = mobile & seen
    lee = seen & ~windward
    if not windward.any():
        raise UnfitError("bed.counted", "no grain is counted", ELSEWHERE)
    needed = mobile | seen | _touching(centres, mobile)
    return lattice.packed(
        line,
        centres[needed],
        mobile=mobile[needed],
        windward=windward[needed],
        lee=lee[needed],
    )


def offset(line: BedLine, distance: float) -> BedLine:
    """Move a line along its normals.

    Parameters
    ----------
    line
        The line.
    distance
        The distance, positive upwards.

    Returns
    -------
    BedLine
        The line at that distance, with as many corners.

    Raises
    ------
    UnfitError
        If it bends too sharply.
    """
    half_bends = np.radians(line.bends_deg) / 2
    normals = np.vstack([line.normals[:1], line.normals, line.normals[-1:]])
    middle = normals[:-1] + normals[1:]
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    x, z = (line.corners + middle * (distance / np.cos(half_bends))[:, None]).T
    back = np.flatnonzero(np.diff(x) <= 0)
    if len(back):
        place = f"{line.x[back[0]]:.4g} d from the first foot"
        what = f"it bends more sharply than a grain at {place}"
        raise UnfitError("bed", what, "smooth it, or choose smaller grains")
    return BedLine(tuple(x.tolist()), tuple(z.tolist()), line.h)


def _rows(top: BedLine, counted: BoolArray, lattice: Lattice) -> Iterator[FloatArray]:
    """Centres of the rows of each part between sharp corners, the counted first."""
    is_sharp = np.abs(top.bends_deg[1:-1]) > SHARP_ROW_DEG
    lasts = [*np.flatnonzero(is_sharp).tolist(), len(top.lengths) - 1]
    firsts = [0, *(last + 1 for last in lasts[:-1])]
    of_counted: list[tuple[int, int]] = []
    of_others: list[tuple[int, int]] = []
    for first, last in zip(firsts, lasts, strict=True):
        is_counted = bool(counted[first : last + 1].any())
        (of_counted if is_counted else of_others).append((first, last))
    if lattice.pattern == "horizontal":
        yield _level_rows(top, lattice)
    else:
        for first, last in of_counted:
            yield _rows_of_part(top, first, last, lattice, True)
    for first, last in of_others:
        yield _rows_of_part(top, first, last, lattice, False)


def _rows_of_part(
    top: BedLine, first: int, last: int, lattice: Lattice, counted: bool
) -> FloatArray:
    """The grains of the rows under some segments of a line that are below it."""
    points = _rows_along(top, first, last, lattice, counted)
    is_straight = first == last and lattice.pattern == "aligned"
    _, depth = _depth(top, points)
    return np.asarray(points[depth >= -(TIE if is_straight else STRAY)])


def _rows_along(
    top: BedLine, first: int, last: int, lattice: Lattice, counted: bool
) -> FloatArray:
    """Rows under some segments of a line, which end a little beyond them."""
    layers = lattice.layers
    rows = layers + 1 if counted else UNDER
    is_uneven = lattice.uneven and counted
    below = max(rows, DISORDERED + 1) - 1 if is_uneven else rows - 1
    corners = top.corners[first : last + 2].copy()
    corners[0] -= top.tangents[first] * (2 * layers + 2)
    corners[-1] += top.tangents[last] * (2 * layers + 2)
    curve = offset(BedLine.through(corners, top.h), -below * np.sin(lattice.beta))
    disorder = lattice.disorder if is_uneven else 0.0
    stacked = _on_a_curve(curve, below, lattice, disorder, lattice.seed + first)
    return np.vstack(stacked[:rows])


def _on_a_curve(
    curve: BedLine, layers: int, lattice: Lattice, size: float, seed: int
) -> list[FloatArray]:
    """Rows over a curve, the lowest on it with random gaps; the uppermost first."""
    spacing = 2 * np.cos(lattice.beta)
    count = whole_up(curve.lengths.sum() / spacing) + 1
    rng = np.random.default_rng(seed)
    gaps = rng.uniform(0, size, count) if size else np.zeros(count)
    aside = rng.uniform(-OFFSET * size, OFFSET * size, count + 1)
    close = np.concatenate([[0.0], np.cumsum(spacing + gaps)])
    # the opening belongs to places of the curve: grains that it shifts leave it there
    length = 2 * float(close[-1]) + 1
    places = np.linspace(0, length, whole_up(length / FINE) + 1)
    step = places[1] - places[0]
    opened = np.zeros(len(places))
    for _ in range(TURNS):
        along = np.interp(close, places - np.cumsum(opened), places)
        rows = _stacked(_beside(curve, along, aside), layers)
        wide = _openings(rows, layers, count)
        if not wide.any():
            break
        gap = np.clip(np.searchsorted(along, places) - 1, 0, count - 1)
        opened += np.minimum(1.1 * wide[gap] / np.diff(along)[gap], 0.5) * step
        opened = np.minimum(opened, 0.5 * step)
    return rows


def _beside(curve: BedLine, along: FloatArray, aside: FloatArray) -> FloatArray:
    """Points along a curve and normal to it, shape (n, 2)."""
    arc = curve.arc_lengths - curve.arc_lengths[0]
    segment = np.searchsorted(arc, along, side="right") - 1
    segment = np.clip(segment, 0, len(arc) - 2)
    into = (along - arc[segment])[:, None] * curve.tangents[segment]
    out = aside[:, None] * curve.normals[segment]
    return np.asarray(curve.corners[segment] + into + out)


def _openings(rows: list[FloatArray], layers: int, count: int) -> FloatArray:
    """By how much the gaps of the lowest row are too narrow for the rows above it."""
    wide = np.zeros(count)
    for above, row in enumerate(rows):
        # in a bend two grains of a row would overlap
        overlap = np.maximum(_overlap(row), 0.0)
        for place in range(layers - above + 1):
            under = slice(place, place + len(overlap))
            wide[under] = np.maximum(wide[under], overlap)
    return wide


def _level_rows(top: BedLine, lattice: Lattice) -> FloatArray:
    """Level rows under a whole line, near it; one grain of the uppermost is on top."""
    row_height = np.sin(lattice.beta)
    half = np.cos(lattice.beta)
    layers = lattice.mobile_layers + 1
    steepest = np.radians(np.abs(top.slopes_deg).max())
    thick = (layers + 1) * row_height / np.cos(steepest)
    highest = float(np.max(top.z))
    x = _level_row(top, 2 * half)
    parts = []
    for row in range(whole_up((highest - min(top.z)) / row_height) + layers + 2):
        z = np.full_like(x, highest - row * row_height)
        places = np.column_stack([x + row % 2 * half, z])
        over = top.height(places[:, 0]) - places[:, 1]
        parts.append(places[(over > -1) & (over < thick)])
    points = np.vstack(parts)
    _, depth = _depth(top, points)
    return np.asarray(points[(depth >= -TIE) & (depth < (layers + 0.5) * row_height)])


def _level_row(top: BedLine, spacing: float) -> FloatArray:
    """Places of a level row along a whole line, one of them under its crest."""
    # where a whole number of spacings lies before the crest, its last digit decides
    # nothing
    before = -whole_up(-(top.crest[0] - top.x[0]) / spacing)
    count = whole_up((top.x[-1] - top.x[0]) / spacing)
    return np.asarray(top.crest[0] + spacing * (np.arange(count) - before))


def _depth(top: BedLine, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """Nearest segment of each point, and how deep it lies under the line."""
    segment, _ = top.nearest(points)
    depth = -top.over(points, segment)
    before = np.maximum(segment - 1, 0)
    behind = np.minimum(segment + 1, len(top.lengths) - 1)
    # over a top the point may be above the line of the other segment
    for other in (before, behind):
        is_top = top.bends_deg[np.maximum(segment, other)] > SHARP_ROW_DEG
        is_over_two = is_top & (other != segment)
        beside = -top.over(points, other)
        depth = np.where(is_over_two, np.minimum(depth, beside), depth)
    return segment, depth


def _without_overlaps(groups: list[FloatArray]) -> FloatArray:
    """Points of all groups but those too near to one before them."""
    points = np.vstack(groups)
    near = _tree(points).query_pairs(1 - 2 * TIE, output_type="ndarray")
    kept = np.ones(len(points), bool)
    order = np.argsort(near.max(axis=1), kind="stable")
    for pair in near[order].tolist():
        kept[max(pair)] &= not kept[min(pair)]
    return np.asarray(points[kept])


def exposed(centres: FloatArray, tangents: FloatArray, slack: float = 0.0) -> BoolArray:
    """Find the equal grains that no other hides.

    A grain is hidden by another one that is higher along its own normal, within d/2 of
    it.

    Parameters
    ----------
    centres
        X and z of the grains, d, shape (n, 2).
    tangents
        The bed's direction under each, shape (n, 2).
    slack
        A slit between two grains that is narrower does not expose the one under it; on
        such a bed a neighbour that stands out by less than `STRAY` hides none.

    Returns
    -------
    BoolArray
        Which grains, shape (n,).
    """
    # through a gap in the row above, a grain of the row above that may hide one
    first, _, apart = Places.of(centres).pairs(HIDES)
    x = apart[:, 0]
    z = apart[:, 2]
    tx, tz = tangents[first].T
    hidden = np.abs(x * tx + z * tz) <= 0.5 + slack + TIE
    hidden &= z * tx - x * tz > (STRAY if slack else TIE)
    return np.asarray(np.bincount(first[hidden], minlength=len(centres)) == 0)


def shadows(
    along: Places, height: FloatArray, radii: FloatArray
) -> tuple[IntArray, IntArray]:
    """Find the grains of any sizes that others hide.

    A grain is hidden where the line through its centre, normal to the bed, meets
    another grain whose centre lies higher.

    Parameters
    ----------
    along
        The place of each along the bed and across the flow; the third coordinate is 0.
    height
        Their heights over the bed line, shape (n,).
    radii
        Their radii, shape (n,).

    Returns
    -------
    hidden, hides
        Pairs of a grain and of one that hides it, shape (k,).
    """
    first, second, apart = along.pairs(float(radii.max()) + TIE)
    hidden = np.linalg.norm(apart, axis=1) <= radii[second] + TIE
    hidden &= height[second] > height[first] + TIE
    return first[hidden], second[hidden]


def unshadowed(along: Places, height: FloatArray, radii: FloatArray) -> BoolArray:
    """Find the grains of any sizes that no other hides.

    Parameters
    ----------
    along, height, radii
        As in `shadows`.

    Returns
    -------
    BoolArray
        Which grains, shape (n,).
    """
    hidden, _ = shadows(along, height, radii)
    return np.asarray(np.bincount(hidden, minlength=len(height)) == 0)


def _rests(centres: FloatArray) -> BoolArray:
    """Which grains touch one upstream and one downstream, none higher, one lower."""
    first, _, apart = Places.of(centres).pairs(1 + TOUCH)
    x = apart[:, 0]
    z = apart[:, 2]
    rests = np.ones(len(centres), bool)
    for is_beside in (x <= 0, x > 0, z < -LOWER):
        has_one = np.zeros(len(centres), bool)
        has_one[first[(z <= TOUCH) & is_beside]] = True
        rests &= has_one
    return rests


def _touching(centres: FloatArray, chosen: BoolArray) -> BoolArray:
    """Which grains touch one of the chosen ones, or are one."""
    distance, _ = _tree(centres[chosen]).query(centres)
    return np.asarray(distance < 1 + TOUCH)


def places_within(x: FloatArray, counts: str | Range) -> BoolArray:
    """Find the places that a range contains.

    Parameters
    ----------
    x
        Places along x.
    counts
        The range; words contain all.

    Returns
    -------
    BoolArray
        Which places.
    """
    if isinstance(counts, str):
        return np.ones(len(x), bool)
    start, end = counts
    return np.asarray((x >= start - TIE) & (x <= end + TIE))
