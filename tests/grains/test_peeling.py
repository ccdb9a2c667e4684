"""Peeling: exact where the pivot is, blocked where a neighbour stands in the way."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.bed.packing import Places
from orchestrator.grains import peeling
from orchestrator.grains.peeling import ForceTable, Loading
from orchestrator.types import FloatArray

CRITERION = 0.3


def _flows(
    centres: FloatArray, drag: FloatArray, *, slope_deg: float = 0.0, lift: float = 0.0
) -> FloatArray:
    """Forces drag flow**2 along the bed, lift times that normal to it, over W; 0 drag is fixed."""
    alpha = math.radians(slope_deg)
    along = np.tile([math.cos(alpha), math.sin(alpha)], (len(centres), 1))
    outward = np.tile([-math.sin(alpha), math.cos(alpha)], (len(centres), 1))

    def square(ustar: FloatArray) -> FloatArray:
        return ustar**2

    def lifting(ustar: FloatArray) -> FloatArray:
        return lift * ustar**2

    loading = Loading(square, lifting, np.sqrt(drag), along, outward)
    table = ForceTable(square, lifting, weight=1.0, unit=1.0)
    tables = [table] * len(centres)
    return peeling.flows(Places.of(centres), np.ones(len(centres)), loading, tables, CRITERION)


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_a_grain_of_another_size_leaves_at_the_angle_of_its_own_pocket(size: float) -> None:
    half = math.sqrt(((1 + size) / 2) ** 2 - 0.25)
    centres, sizes = np.array([[0.0, half], [-0.5, 0], [0.5, 0]]), np.array([size, 1.0, 1.0])
    loading = Loading(
        np.square,
        np.zeros_like,
        np.array([1.0, 0, 0]),
        *np.tile(np.eye(2), (3, 1, 1)).transpose(1, 0, 2),
    )
    tables = [ForceTable(np.square, np.zeros_like, weight=1.0, unit=1.0)] * 3
    alone = peeling.pivots(Places.of(centres), sizes, loading, tables)
    found = peeling.flows(Places.of(centres), sizes, loading, tables, CRITERION)
    assert found[0] == alone[0] == pytest.approx(math.sqrt(0.5 / half), rel=1e-9)


def _row(count: int, beta_deg: float, slope_deg: float) -> tuple[FloatArray, int]:
    """Exposed grains in the pockets of a fixed row, along a slope; how many."""
    alpha, beta = math.radians(slope_deg), math.radians(beta_deg)
    along = np.array([math.cos(alpha), math.sin(alpha)])
    outward = np.array([-along[1], along[0]])
    upper = np.outer(2 * math.cos(beta) * np.arange(count), along)
    lower = np.outer(math.cos(beta) * (2 * np.arange(count + 1) - 1), along)
    return np.vstack([upper, lower - math.sin(beta) * outward]), count


@pytest.mark.parametrize("slope_deg", [-20.0, 0.0, 20.0])
def test_a_flow_that_runs_back_is_the_flow_over_the_turned_bed(slope_deg: float) -> None:
    centres, count = _row(5, 60, slope_deg)
    alpha = math.radians(slope_deg)
    along = np.tile([math.cos(alpha), math.sin(alpha)], (len(centres), 1))
    outward = np.column_stack([-along[:, 1], along[:, 0]])
    ratio = np.append(np.linspace(1.5, 0.5, count), np.zeros(count + 1))
    tables = [ForceTable(np.square, np.square, weight=1.0, unit=1.0)] * len(centres)
    sizes, turn = np.ones(len(centres)), np.array([-1.0, 1.0])

    def leaving(places: FloatArray, by: FloatArray, way: FloatArray, out: FloatArray) -> FloatArray:
        loading = Loading(np.square, np.square, by, way, out)
        return peeling.flows(Places.of(places), sizes, loading, tables, CRITERION)

    back = leaving(centres, -ratio, along, outward)
    turned = leaving(centres * turn, ratio, -along * turn, outward * turn)
    np.testing.assert_allclose(back, turned, rtol=1e-12)
    assert np.isfinite(back[:count]).all()


@settings(deadline=None)
@given(
    slope_deg=st.floats(0, 29),
    beta_deg=st.floats(45, 60),
    drag=st.floats(0.1, 10),
    lift=st.floats(0, 3),
)
def test_one_grain_leaves_at_the_pivot_of_eq_1(
    slope_deg: float, beta_deg: float, drag: float, lift: float
) -> None:
    centres, _ = _row(1, beta_deg, slope_deg)
    found = _flows(centres, np.array([drag, 0.0, 0.0]), slope_deg=slope_deg, lift=lift)
    alpha, beta = math.radians(slope_deg), math.radians(beta_deg)
    moment = drag * (math.sin(beta) + lift * math.cos(beta))
    assert found[0] == pytest.approx(math.sqrt(math.cos(alpha - beta) / moment), rel=1e-9)
    assert np.isinf(found[1:]).all()


def test_a_row_empties_from_its_end_where_the_stress_is_highest() -> None:
    centres, count = _row(6, 60, 15)
    drag = np.append(np.linspace(0.5, 1.5, count), np.zeros(count + 1))
    found = _flows(centres, drag, slope_deg=15)[:count]
    alone = np.sqrt(math.cos(math.radians(45)) / (drag[:count] * math.sin(math.radians(60))))
    np.testing.assert_allclose(found, alone, rtol=1e-9)
    assert (np.diff(found) < 0).all()


def test_a_grain_waits_for_the_one_in_front_that_feels_less() -> None:
    centres, count = _row(2, 60, 15)
    drag = np.array([2.0, 1.0, 0, 0, 0])
    found = _flows(centres, drag, slope_deg=15)[:count]
    assert found[0] == found[1]


def test_a_fixed_neighbour_in_front_has_to_be_climbed() -> None:
    # a grain between two level neighbours: drag alone never lifts it over, lift does
    centres = np.array([[0, 0], [1, 0], [-0.5, -math.sqrt(3) / 2], [0.5, -math.sqrt(3) / 2]])
    drag = np.array([1.0, 0, 0, 0])
    assert math.isinf(_flows(centres, drag)[0])
    assert _flows(centres, drag, lift=0.25)[0] == pytest.approx(2.0)
