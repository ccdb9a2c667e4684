"""Grains on beds of all shapes: no overlaps, support, exposure, and what is counted."""

from typing import Any

import numpy as np
import pytest

from orchestrator.bed import packing
from orchestrator.bed.cover import cover, offset
from orchestrator.bed.shapes import of_bed, triangle
from orchestrator.study.parts import Packing as Pattern
from orchestrator.study.parts import UnfitError
from tests.bed.test_shapes import SHAPES, H, bed

D = 1e-3
GAP = 1 / 30


def covered(name: str, pattern: Pattern = "aligned", **fields: Any) -> packing.Packing:
    shape = bed(**{**SHAPES[name], **fields})
    ground = of_bed(shape.model_copy(update={"obstacles": ()})).scaled(1 / D)
    counts = shape.counts
    return cover(
        of_bed(shape).scaled(1 / D),
        ground,
        counts if isinstance(counts, str) else (counts[0] / D, counts[1] / D),
        entrainment_angle_deg=60.0,
        gap=GAP,
        pattern=pattern,
        mobile_layers=2,
        disorder=0.02 if pattern == "disordered" else 0.0,
        seed=0,
    )


@pytest.mark.parametrize("pattern", ["aligned", "horizontal", "disordered"])
@pytest.mark.parametrize("name", SHAPES)
def test_grains_do_not_overlap_and_mobile_ones_rest_on_two(name: str, pattern: Pattern) -> None:
    found = covered(name, pattern)
    apart = np.linalg.norm(found.centres[:, None] - found.centres[None], axis=2)
    np.fill_diagonal(apart, 9.0)
    assert apart.min() > 1 - 1e-5
    x, z = (found.centres[None, :, i] - found.centres[:, None, i] for i in (0, 1))
    holds = (apart < 1 + 1e-3) & (z < 1e-3)
    rests = (holds & (x <= 0)).any(axis=1) & (holds & (x > 0)).any(axis=1)
    assert rests[found.mobile].all()
    assert (holds & (z < -0.1)).any(axis=1)[found.mobile].all()
    assert found.mobile[found.windward].all()
    assert not (found.windward & found.lee).any()


@pytest.mark.parametrize("name", ["curved dune", "cosine", "gaussian", "flat", "train"])
def test_exposed_grains_follow_the_bed_one_by_one(name: str) -> None:
    found = covered(name)
    line = of_bed(bed(**SHAPES[name])).scaled(1 / D)
    segment, along = line.nearest(found.centres[found.windward])
    height = np.einsum(
        "ij,ij->i", found.centres[found.windward] - line.corners[segment], line.normals[segment]
    )
    np.testing.assert_allclose(height, 0.5 + GAP, atol=0.1)
    steps = np.diff(np.sort(along))
    assert np.median(steps) == pytest.approx(1.0, abs=0.02)


def test_a_triangle_is_packed_as_by_its_own_packing() -> None:
    by_itself = packing.pile(
        triangle(15.0, H).scaled(1 / D),
        entrainment_angle_deg=60.0,
        gap=GAP,
        pattern="aligned",
        mobile_layers=2,
    )
    assert abs(covered("triangle").count - by_itself.count) <= 1


def test_which_part_is_counted() -> None:
    windward, everything = covered("triangle"), covered("triangle", counted="all")
    some = covered("triangle", counted=(0.02, 0.04))
    assert windward.centres[windward.windward, 0].max() < H / np.tan(np.radians(15)) / D + 1
    assert everything.count > 1.8 * windward.count
    assert some.count == pytest.approx(20 / np.cos(np.radians(15)), abs=1)
    x = some.centres[some.windward, 0] * D
    assert 0.02 <= x.min() <= x.max() <= 0.04


def test_no_grain_moves_at_an_obstacle() -> None:
    found = covered("block on it")
    ((start, end),) = of_bed(bed(**SHAPES["block on it"])).scaled(1 / D).bare
    x = found.centres[found.mobile, 0]
    assert not ((x > start - 1) & (x < end + 1)).any()
    assert found.count < covered("triangle").count


def test_a_train_counts_what_its_forms_count() -> None:
    assert covered("apart").count == pytest.approx(3 * covered("triangle").count, abs=3)


def test_a_bed_that_bends_more_sharply_than_a_grain_is_refused() -> None:
    ridged = bed(shape="dune", brink_radius=1e-4)
    assert offset(of_bed(ridged), 1e-4)
    trough = bed(forms=40, shape="cosine", height=2e-3, slope_deg=50.0)
    with pytest.raises(UnfitError, match="more sharply than a grain at"):
        offset(of_bed(trough).scaled(1 / D), 3.0)


def test_nothing_to_count_is_refused() -> None:
    with pytest.raises(UnfitError, match=r"bed.counted: no grain is counted"):
        covered("step down", counted="windward")
