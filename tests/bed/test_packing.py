"""Where grains lie, which are exposed, and what must not change that."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.bed import packing
from orchestrator.bed.shapes import triangle
from orchestrator.study.parts import Packing as Pattern

PATTERNS: tuple[Pattern, Pattern] = ("aligned", "horizontal")
slopes = st.floats(10, 30)
heights = st.floats(6, 25)


def _pile(
    slope: float, height: float, pattern: Pattern = "aligned", seed: int = 0
) -> packing.Packing:
    return packing.pile(
        triangle(slope, height),
        entrainment_angle_deg=60.0,
        gap=1 / 30,
        pattern=pattern,
        mobile_layers=2,
        seed=seed,
    )


def _distances(centres: packing.FloatArray) -> packing.FloatArray:
    gaps = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    return np.asarray(gaps + 9 * np.eye(len(centres)))


@settings(max_examples=30, deadline=None)
@given(slope=slopes, height=heights, pattern=st.sampled_from(PATTERNS))
def test_grains_never_overlap(slope: float, height: float, pattern: Pattern) -> None:
    assert _distances(_pile(slope, height, pattern).centres).min() > 1 - 1e-9


@settings(max_examples=30, deadline=None)
@given(slope=slopes, height=heights, pattern=st.sampled_from(PATTERNS))
def test_every_mobile_grain_rests_on_two_below_it(
    slope: float, height: float, pattern: Pattern
) -> None:
    bed = _pile(slope, height, pattern)
    touching = _distances(bed.centres) < 1 + 1e-6
    lower = bed.centres[None, :, 1] < bed.centres[:, None, 1] - 1e-6
    level = np.abs(bed.centres[None, :, 1] - bed.centres[:, None, 1]) <= 1e-6
    supports = (touching & lower).sum(axis=1)
    # in a row along 30 deg one of the two supports is level with the grain
    assert np.all((supports + (touching & level).sum(axis=1))[bed.mobile] >= 2)
    assert np.all(supports[bed.mobile] >= 1)


@settings(max_examples=30, deadline=None)
@given(slope=slopes, height=heights)
def test_aligned_grains_cover_the_windward_face_one_by_one(slope: float, height: float) -> None:
    bed = _pile(slope, height)
    s = np.sort(bed.arc_length[bed.windward])
    # the crest grain sits over the crest itself, a little downstream of its own normal's foot
    np.testing.assert_allclose(np.diff(s)[:-1], 1.0, atol=1e-9)
    assert 1 - 0.6 * np.tan(np.radians(slope)) < s[-1] - s[-2] < 1
    assert s[-1] == pytest.approx(height / np.sin(np.radians(slope)))
    # the lowest grain's centre is at least as high as those of the flat bed
    assert abs(bed.count - height / np.sin(np.radians(slope))) <= 2


@settings(max_examples=30, deadline=None)
@given(slope=slopes, height=heights)
def test_exposed_grains_lie_their_gap_above_the_bed_line(slope: float, height: float) -> None:
    bed, line = _pile(slope, height), triangle(slope, height)
    depth = line.depth(bed.centres[bed.windward], line.windward)
    np.testing.assert_allclose(-depth, 0.5 + 1 / 30, atol=1e-9)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_twin_has_the_grains_of_its_lattice_but_for_a_billionth(pattern: Pattern) -> None:
    lattice, replica, other = (_pile(20.0, 15.0, pattern, seed) for seed in (0, 1, 2))
    for one in (replica, other):
        np.testing.assert_array_equal(one.windward, lattice.windward)
        np.testing.assert_array_equal(one.mobile, lattice.mobile)
        aside = np.abs(one.centres - lattice.centres)
        assert 0 < aside[lattice.windward].min() <= aside.max() <= packing.PERTURBATION
    assert not np.array_equal(replica.centres, other.centres)


@settings(max_examples=20, deadline=None)
@given(slope=slopes, pattern=st.sampled_from(PATTERNS), seed=st.integers(0, 2**32 - 1))
def test_shifts_of_a_billionth_of_a_diameter_change_no_exposed_grain(
    slope: float, pattern: Pattern, seed: int
) -> None:
    bed, line = _pile(slope, 15.0, pattern), triangle(slope, 15.0)
    shift = np.random.default_rng(seed).uniform(-1e-9, 1e-9, bed.centres.shape)
    before = packing.exposed(bed.centres, line)
    after = packing.exposed(bed.centres + shift, line)
    np.testing.assert_array_equal(before, after)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_crest_grain_is_windward_exposed_and_mobile(pattern: Pattern) -> None:
    bed = _pile(20.0, 12.0, pattern)
    top = int(bed.centres[:, 1].argmax())
    assert bed.windward[top]
    assert bed.mobile[top]


def test_counts_of_the_papers_pile() -> None:
    # 0.02 m at 15 deg is 77.27 diameters of 1 mm of face, the first grain half a grain up it
    assert _pile(15.0, 20.0).count == 78
    assert _pile(15.0, 200.0).count == 773


def test_exposed_and_mobile_grains() -> None:
    bed = _pile(15.0, 20.0)
    assert not np.any(bed.windward & bed.lee)
    assert np.all(bed.mobile[bed.windward])
    # two layers of 78 and 77 grains, less what has no place at the toe and the crest
    assert int(bed.mobile.sum()) == pytest.approx(2 * bed.count, abs=4)


def test_horizontal_packing_is_a_stair() -> None:
    bed = _pile(20.0, 12.0, "horizontal")
    z = bed.centres[bed.windward][:, 1]
    steps = np.unique(np.round(z, 6))
    np.testing.assert_allclose(np.diff(steps), np.sin(np.radians(60)), atol=1e-6)


def test_arc_length_runs_over_the_crest() -> None:
    line = triangle(30.0, 10.0)
    points = np.array([[0.0, 0.0], line.crest, [2 * line.crest[0], 0.0]])
    np.testing.assert_allclose(line.nearest(points)[1], [0.0, 20.0, 40.0], atol=1e-12)


def _disordered(slope: float, seed: int, size: float = 0.05) -> packing.Packing:
    return packing.pile(
        triangle(slope, 15.0),
        entrainment_angle_deg=60.0,
        gap=1 / 30,
        pattern="disordered",
        mobile_layers=2,
        disorder=size,
        seed=seed,
    )


@settings(max_examples=30, deadline=None)
@given(slope=slopes, seed=st.integers(0, 10**6), size=st.floats(1e-4, 0.2))
def test_disordered_mobile_grains_rest_on_two_and_overlap_with_none(
    slope: float, seed: int, size: float
) -> None:
    bed = _disordered(slope, seed, size)
    gaps = _distances(bed.centres)
    assert gaps[bed.mobile].min() > 1 - 1e-9
    assert np.all((gaps < 1 + 1e-6).sum(axis=1)[bed.mobile] >= 2)


@settings(max_examples=20, deadline=None)
@given(slope=slopes, seed=st.integers(0, 10**6))
def test_disorder_hardly_changes_how_many_are_exposed(slope: float, seed: int) -> None:
    bed = _disordered(slope, seed)
    assert bed.count == pytest.approx(_pile(slope, 15.0).count, abs=3)
    top = int(bed.centres[:, 1].argmax())
    assert bed.windward[top]


def test_a_seed_is_one_packing() -> None:
    same = _disordered(20.0, 3).centres
    np.testing.assert_array_equal(same, _disordered(20.0, 3).centres)
    assert not np.array_equal(same, _disordered(20.0, 4).centres)


@pytest.mark.parametrize("pattern", ["aligned", "horizontal", "disordered"])
def test_the_grains_on_the_face_do_not_depend_on_how_many_layers_may_move(pattern: Pattern) -> None:
    faces = []
    for layers in (1, 2, 4):
        found = packing.pile(
            triangle(20.0, 15.0),
            entrainment_angle_deg=60.0,
            gap=1 / 30,
            pattern=pattern,
            mobile_layers=layers,
            disorder=0.05,
            seed=3 if pattern == "disordered" else 0,
        )
        faces.append(found.centres[found.windward])
    np.testing.assert_array_equal(faces[0], faces[1])
    np.testing.assert_array_equal(faces[0], faces[2])


def test_no_pile_has_more_rows_than_its_height() -> None:
    line = triangle(20.0, 10.0)
    most, more = (
        packing.pile(
            line, entrainment_angle_deg=60.0, gap=1 / 30, pattern="aligned", mobile_layers=n
        )
        for n in (20, 1000)
    )
    np.testing.assert_array_equal(most.mobile, more.mobile)
