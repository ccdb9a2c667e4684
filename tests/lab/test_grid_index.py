"""Order, limit and index of sequences whose own are known."""

import math

import pytest

from orchestrator.lab.grid_index import (
    HIGHEST_ORDER,
    SAFETY,
    Orders,
    judge,
    observed_order,
)

SCHEMES = Orders(0.5, 2.1)
HALVED = (4.0, 2.0, 1.0)
FLOOR = 1e-9
NONE = "not in the range"


def _manufactured(
    sizes: tuple[float, float, float], order: float, limit: float, slope: float
) -> tuple[float, float, float]:
    """Values whose error is `slope` times the size to the power of the order."""
    coarse, medium, fine = (limit + slope * size**order for size in sizes)
    return coarse, medium, fine


@pytest.mark.parametrize("order", [0.6, 1.0, 1.5, 2.0])
@pytest.mark.parametrize("slope", [-0.02, 0.02])
# grids whose ratios are not alike, as of 40, 61 and 130 cells
@pytest.mark.parametrize("sizes", [HALVED, (1 / 40, 1 / 61, 1 / 130), (9.0, 3.0, 1.0)])
def test_a_known_order_and_its_limit_are_found(
    sizes: tuple[float, float, float], slope: float, order: float
) -> None:
    values = _manufactured(sizes, order, 3.0, slope)
    found = judge(sizes, values, SCHEMES, FLOOR)
    assert found.verdict == "in the range"
    assert found.order == pytest.approx(order, rel=1e-6)
    assert found.limit == pytest.approx(3.0, rel=1e-9)
    for value in values:
        assert found.gci(value) == pytest.approx(SAFETY * abs(3.0 / value - 1))


def test_the_index_is_that_of_celik_on_halved_cells() -> None:
    """Of the last change and the order alone: 1.25 e / (r^p - 1)."""
    coarse, medium, fine = 1.30, 1.10, 1.02
    found = judge(HALVED, (coarse, medium, fine), SCHEMES, FLOOR)
    order = math.log2((coarse - medium) / (medium - fine))
    change = (medium - fine) / fine
    assert found.order == pytest.approx(order)
    assert found.gci(fine) == pytest.approx(1.25 * change / (2**order - 1))


@pytest.mark.parametrize(
    ("values", "verdict", "why"),
    [
        ((1.0, 1.2, 1.1), NONE, "the values oscillate"),
        ((1.1, 0.9, 1.1), NONE, "the values oscillate"),
        ((1.0, 1.1, 1.3), NONE, "the changes grow"),
        # as many per cent each time: order 0
        ((1.0, 1.1, 1.2), NONE, "the changes grow"),
        ((1.0, 1.0, 1.2), NONE, "the changes grow"),
        # what the stress at a sharp crest does
        ((1.9937, 2.0890, 2.1780), NONE, "order 0.099"),
        ((1.8, 1.01, 1.0), NONE, "order 6.3"),
        ((1.0, 1.0, 1.0), "settled", "the last change is within 1e-07 %"),
        ((1.0, math.nan, 1.0), "not known", "a value is missing"),
        ((1.0, 1.1, math.inf), "not known", "a value is missing"),
        ((0.0, 0.0, 0.0), "not known", "a value is missing"),
    ],
)
def test_values_out_of_the_range_have_no_order_and_no_index(
    values: tuple[float, float, float], verdict: str, why: str
) -> None:
    found = judge(HALVED, values, SCHEMES, FLOOR)
    assert (found.verdict, found.why) == (verdict, why)
    assert math.isnan(found.order)
    assert math.isnan(found.limit)
    assert math.isnan(found.gci(1.0))


def test_changes_that_the_solver_leaves_have_no_order() -> None:
    values = _manufactured(HALVED, 1.0, 1.0, 1e-3)
    assert judge(HALVED, values, SCHEMES, 1e-4).verdict == "in the range"
    assert judge(HALVED, values, SCHEMES, 2e-3).verdict == "settled"
    # one large change before a small one has settled, too
    assert judge(HALVED, (1.5, 1.001, 1.0), SCHEMES, 2e-3).verdict == "settled"


def test_where_no_order_is_expected_none_is_given() -> None:
    values = _manufactured(HALVED, 1.0, 1.0, 0.1)
    found = judge(HALVED, values, None, FLOOR)
    assert (found.verdict, found.why) == (NONE, "no order is expected")


def test_the_search_for_an_order_has_ends() -> None:
    assert observed_order(HALVED, 0.5) == 0.0
    assert observed_order(HALVED, 2.0**30) == HIGHEST_ORDER
    assert observed_order(HALVED, 8.0) == pytest.approx(3.0)
