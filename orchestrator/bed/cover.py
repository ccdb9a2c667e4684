"""The grains of a bed of any shape, in rows along it or level.

Lengths are in diameters d of the scene, with the toe of the first form at the origin.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from orchestrator.bed.exposure import (
    STRAY,
    TIE,
    exposed,
    places_within,
    rests,
    touching,
)
from orchestrator.bed.line import BedLine
from orchestrator.bed.packing import APRON, ELSEWHERE, Lattice, Packing
from orchestrator.bed.places import tree
from orchestrator.bed.rows import DISORDERED, OFFSET, overlaps, stacked
from orchestrator.digits import whole_up
from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import Range
from orchestrator.types import BoolArray, FloatArray, IntArray

SHARP_ROW_DEG = 8.0
"""Bend from which on rows do not follow the bed round a corner."""
SLIT = 0.15
"""Between neighbours of a row that goes round a bend a gap is at most this wide,
diameters."""
BARE = 1.0
"""Grains this near to an obstacle are fixed under its foot, diameters."""
UNDER = 2
"""Rows of fixed grains where none is counted: none falls through them."""
FINE = 0.1
"""Distance between two places of a curve at which a row may be opened, diameters."""
TURNS = 100
"""How often a row is opened further; `cover` leaves out grains that overlap then."""


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
    mobile = chosen & is_near & rests(centres)
    windward = mobile & seen
    lee = seen & ~windward
    if not windward.any():
        raise UnfitError("bed.counted", "no grain is counted", ELSEWHERE)
    needed = mobile | seen | touching(centres, mobile)
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
        rows = stacked(_beside(curve, along, aside), layers)
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
        overlap = np.maximum(overlaps(row), 0.0)
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
    near = tree(points).query_pairs(1 - 2 * TIE, output_type="ndarray")
    kept = np.ones(len(points), bool)
    order = np.argsort(near.max(axis=1), kind="stable")
    for pair in near[order].tolist():
        kept[max(pair)] &= not kept[min(pair)]
    return np.asarray(points[kept])
