"""Where grains of a lattice lie, which are exposed and may move, and what must not change that."""

import tracemalloc
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.bed.cover import cover, offset
from orchestrator.bed.exposure import unshadowed
from orchestrator.bed.line import between_flats, of_bed, triangle
from orchestrator.bed.packing import Lattice, Packing
from orchestrator.bed.pile import pile
from orchestrator.bed.places import Places
from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import Packing as Pattern
from orchestrator.types import BoolArray, FloatArray
from tests.bed.test_line import BEDS, H, bed

D, GAP = 1e-3, 1 / 30
PATTERNS = [pattern for pattern in get_args(Pattern) if pattern != "poured"]
slopes, heights = st.floats(10, 30), st.floats(6, 25)
patterns = st.sampled_from(PATTERNS)


def _lattice(pattern: Pattern = "aligned", **changes: Any) -> Lattice:
    disorder = 0.05 if pattern == "disordered" else 0.0
    return replace(
        Lattice(60.0, GAP, pattern, mobile_layers=2, disorder=disorder), **changes
    )


def _pile(
    slope: float, height: float, pattern: Pattern = "aligned", **changes: Any
) -> Packing:
    return pile(triangle(slope, height), _lattice(pattern, **changes))


def _covered(name: str, pattern: Pattern = "aligned", **fields: Any) -> Packing:
    shape = bed(**{**BEDS[name], **fields})
    ground = of_bed(shape.model_copy(update={"obstacles": ()})).scaled(1 / D)
    counts = shape.counts
    counts = counts if isinstance(counts, str) else (counts[0] / D, counts[1] / D)
    return cover(of_bed(shape).scaled(1 / D), ground, counts, _lattice(pattern))


def _check(bed: Packing) -> None:
    """No grain overlaps another, and each that may move rests on two, one of them lower."""
    x, z = (bed.centres[None, :, i] - bed.centres[:, None, i] for i in (0, 1))
    apart = np.hypot(x, z) + 9 * np.eye(len(x))
    assert apart.min() > 1 - 1e-5
    # in a row along 30 degrees one of the two is level with the grain
    bears: BoolArray = (apart < 1 + 1e-3) & (z < 1e-3)
    for side in (x <= 0, x > 0, z < -1e-6):
        assert np.any(bears & side, axis=1)[bed.mobile].all()
    assert bed.mobile[bed.windward].all()
    assert not (bed.windward & bed.lee).any()


@pytest.mark.parametrize("beta", [60.0, 59.5, 50.0])
def test_through_the_gaps_of_a_row_the_next_is_exposed_and_no_other(
    beta: float,
) -> None:
    line = triangle(15.0, 10.0)
    bed = pile(line, _lattice(entrainment_angle_deg=beta, mobile_layers=3))
    shown = line.over(bed.centres[bed.windward], line.top - 1)
    rows = np.unique(np.round((0.5 + GAP - shown) / np.sin(np.radians(beta))))
    assert rows.tolist() == ([0] if beta == 60 else [0, 1])


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("name", BEDS)
def test_grains_of_any_bed_do_not_overlap_and_mobile_ones_rest(
    name: str, pattern: Pattern
) -> None:
    _check(_covered(name, pattern))


@settings(max_examples=20, deadline=None)
@given(slope=slopes, height=heights, pattern=patterns, seed=st.integers(0, 10**6))
def test_grains_of_a_pile_do_not_overlap_and_mobile_ones_rest(
    slope: float, height: float, pattern: Pattern, seed: int
) -> None:
    packed = _pile(slope, height, pattern, seed=seed if pattern == "disordered" else 0)
    if pattern != "disordered":
        _check(packed)
    overlapping, touching = (
        packed.places.contacts(packed.sizes, t)[0] for t in (-1e-9, 1e-6)
    )
    assert not packed.mobile[overlapping].any()
    assert (
        np.bincount(touching, minlength=len(packed.sizes))[packed.mobile] >= 2
    ).all()


@settings(max_examples=30, deadline=None)
@given(slope=slopes, height=heights)
def test_aligned_grains_cover_the_windward_face_one_by_one(
    slope: float, height: float
) -> None:
    bed, line = _pile(slope, height), triangle(slope, height)
    s = np.sort(bed.arc_length[bed.windward])
    # the crest grain sits over the crest itself, a little downstream of its own normal's foot
    np.testing.assert_allclose(np.diff(s)[:-1], 1.0, atol=1e-9)
    assert 1 - 0.6 * np.tan(np.radians(slope)) < s[-1] - s[-2] < 1
    assert s[-1] == pytest.approx(height / np.sin(np.radians(slope)))
    # the lowest grain's centre is at least as high as those of the flat bed
    assert abs(bed.count - height / np.sin(np.radians(slope))) <= 2
    over = line.over(bed.centres[bed.windward], line.top - 1)
    np.testing.assert_allclose(over, 0.5 + GAP, atol=1e-9)
    # the paper's: 0.02 m at 15 deg is 77.27 diameters of 1 mm, the first grain half a grain up it
    assert [_pile(15.0, height).count for height in (20.0, 200.0)] == [78, 773]


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_grains_on_the_face_do_not_depend_on_how_many_layers_may_move(
    pattern: Pattern,
) -> None:
    faces = []
    for layers in (1, 2, 4):
        packed = _pile(20.0, 15.0, pattern, mobile_layers=layers)
        assert packed.windward[packed.centres[:, 1].argmax()]
        faces.append(packed.centres[packed.windward])
    np.testing.assert_array_equal(faces, [faces[0]] * 3)


def test_a_high_pile_is_packed_without_the_places_inside_of_it() -> None:
    """A pile of 4000 grains took 8 GB, and one of 12,000 all the memory there was."""
    tracemalloc.start()
    high = _pile(15.0, 1000.0)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert high.count == pytest.approx(1000 / np.sin(np.radians(15)), abs=2)
    assert peak < 1e5 * high.count


def test_which_part_is_counted() -> None:
    windward, everything = _covered("triangle"), _covered("triangle", counted="all")
    part = _covered("triangle", counted=(0.02, 0.04))
    assert (
        windward.centres[windward.windward, 0].max()
        < H / np.tan(np.radians(15)) / D + 1
    )
    assert everything.count > 1.8 * windward.count
    assert part.count == pytest.approx(20 / np.cos(np.radians(15)), abs=1)
    x = part.centres[part.windward, 0] * D
    assert 0.02 <= x.min() <= x.max() <= 0.04
    assert _covered("apart").count == pytest.approx(3 * windward.count, abs=3)
    # no grain moves at an obstacle
    beside = _covered("block on it")
    ((start, end),) = of_bed(bed(**BEDS["block on it"])).scaled(1 / D).bare
    x = beside.centres[beside.mobile, 0]
    assert not ((x > start - 1) & (x < end + 1)).any()
    assert beside.count < windward.count


def test_beds_that_no_row_of_grains_fits_are_refused() -> None:
    with pytest.raises(UnfitError, match=r"bed.counted: no grain is counted"):
        _covered("step down", counted="windward")
    trough = of_bed(bed(forms=40, shape="cosine", height=2e-3, slope_deg=50.0)).scaled(
        1 / D
    )
    with pytest.raises(UnfitError, match="more sharply than a grain at"):
        offset(trough, 3.0)


def _unshadowed(
    x: FloatArray, z: FloatArray, r: FloatArray, y: Any = 0.0, w: Any = 0
) -> BoolArray:
    places = Places.of(np.column_stack([x, np.zeros_like(x)]), y, w)
    return unshadowed(places, z, r)


def test_a_grain_under_the_flank_of_a_larger_one_is_not_exposed() -> None:
    along, height, radii = np.array([[0.0, 0.7, 2.0], [1.0, 0.5, 0.5], [1.0, 0.3, 0.5]])
    assert _unshadowed(along, height, radii).tolist() == [True, False, True]
    assert _unshadowed(along, height, radii / 2).all()
    # equal grains are exposed alike by the rule of lattices
    line, lattice = triangle(20.0, 12.0), _pile(20.0, 12.0)
    segment, along = line.nearest(lattice.centres)
    free = _unshadowed(along, line.over(lattice.centres, segment), lattice.sizes / 2)
    face = (segment == line.top - 1) & (along < line.crest_s - 1) & (along > 1)
    np.testing.assert_array_equal(free[face], lattice.windward[face])


@pytest.mark.parametrize(
    ("width", "free", "contacts"), [(4.0, [False, True], 2), (0.0, [True, True], 0)]
)
def test_a_grain_across_the_sides_covers_and_touches(
    width: float, free: list[bool], contacts: int
) -> None:
    x, z, y = np.zeros(2), np.array([0.0, 0.9]), np.array([0.1, 3.8])
    assert _unshadowed(x, z, np.full(2, 0.5), y, width).tolist() == free
    places = Places.of(np.column_stack([x, z]), y, width)
    assert len(places.contacts(np.ones(2))[0]) == contacts


@pytest.mark.parametrize("y", [-1e-17, -5e-324, 0.0, 6.0, -6.0, 6.0 - 1e-15, 12.0])
def test_a_grain_on_the_seam_of_a_strip_touches_those_beside_it(y: float) -> None:
    centres = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.0]])
    aside = float(np.sqrt(0.75))
    places = Places.of(centres, np.array([y, aside, -aside]), 6.0)
    assert (places.xyz[:, 1] < 6.0).all()
    first, second, _ = places.contacts(np.ones(3))
    assert second[first == 0].tolist() == [1, 2]


def test_no_last_digit_decides_which_grains_a_range_counts() -> None:
    shape = bed(shape="flat", slope_deg=0.0, height=0.02, length=0.04)
    line = of_bed(shape).scaled(1 / D)
    whole = cover(line, line, "all", _lattice())
    x = whole.centres[whole.windward, 0]
    start, end = float(x[5]), float(x[20])
    for ends in ((np.nextafter(start, 99), np.nextafter(end, 0)), (start, end)):
        assert cover(line, line, ends, _lattice()).count == 16


@pytest.mark.parametrize("slope", [10.0, 15.0, 25.0, 30.0])
@pytest.mark.parametrize("lee", [30.0, 35.0, 45.0, 55.0, 60.0])
def test_no_grain_falls_down_a_steep_lee_side(slope: float, lee: float) -> None:
    up, down = (12.0 / np.tan(np.radians(each)) for each in (slope, lee))
    line = between_flats(np.array([[0.0, 0.0], [up, 12.0], [up + down, 0.0]]), 12.0)
    for pattern in ("aligned", "horizontal"):
        bed = pile(line, _lattice(pattern))
        _check(bed)
        assert bed.mobile[bed.centres[:, 1].argmax()]


@pytest.mark.parametrize("name", ["curved dune", "cosine", "gaussian", "flat", "train"])
def test_exposed_grains_follow_the_bed_one_by_one(name: str) -> None:
    """They lie z0 under the bed line, and a diameter apart along it."""
    covered = _covered(name)
    line = of_bed(bed(**BEDS[name])).scaled(1 / D)
    centres = covered.centres[covered.windward]
    segment, along = line.nearest(centres)
    np.testing.assert_allclose(line.over(centres, segment), 0.5 + GAP, atol=0.1)
    apart = np.diff(np.sort(along))
    assert np.median(apart) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("beta", [60.0, 52.0])
@pytest.mark.parametrize("pattern", ["aligned", "horizontal"])
def test_rows_of_a_pile_begin_at_its_crest(pattern: Pattern, beta: float) -> None:
    """Exact places: rows 2 cos(beta) apart within, sin(beta) from one to the next.

    The uppermost grain stands over the crest, so high that the centres of a row along
    the face lie half a grain and z0 over it, and each row below is shifted by half.
    """
    slope, height = 20.0, 12.0
    line = triangle(slope, height)
    packed = pile(line, _lattice(pattern, entrainment_angle_deg=beta))
    tilt = np.radians(slope if pattern == "aligned" else 0.0)
    along = np.array([np.cos(tilt), np.sin(tilt)])
    down = np.array([np.sin(tilt), -np.cos(tilt)])
    top = np.array([height / np.tan(np.radians(slope)), height])
    top[1] += (0.5 + GAP) / np.cos(np.radians(slope))
    apart = packed.centres - top
    apart = apart[packed.mobile & (apart[:, 0] <= 1e-9)]
    assert len(apart) > 20
    assert np.hypot(*apart.T).min() == pytest.approx(0, abs=1e-9)
    row = apart @ down / np.sin(np.radians(beta))
    place = apart @ along / np.cos(np.radians(beta))
    assert row == pytest.approx(np.round(row), abs=1e-6)
    assert place == pytest.approx(np.round(place), abs=1e-6)
    # places of even rows are even, of odd rows odd
    assert not ((np.round(row) + np.round(place)) % 2).any()
    assert len(np.unique(np.round(row))) > (1 if pattern == "aligned" else 5)
