"""Flows over surfaces beside others: which they are, and the table that they gave."""

import numpy as np
import pytest

from orchestrator.surface import TRUTH, cards, onset, truth
from orchestrator.surface.mesh import STANDARD


def test_the_command_has_each_comparison() -> None:
    assert tuple(truth.PARTS) == TRUTH
    assert set(truth.stored()["part"]) == set(TRUTH)
    planned = truth.Truth(("ridge", "interval")).planned.cases
    # the section that the ridge is compared with runs first
    assert next(iter(planned)).startswith("flow-")
    assert sum(case.ranks for case in truth.interval_flows().values()) == 7
    assert truth.interval_flows()["standard level"].level == STANDARD


def test_a_ridge_in_three_dimensions_is_within_a_hundredth_of_its_section() -> None:
    table = truth.stored()
    ridge = table[table["part"] == "ridge"]
    assert len(ridge) == 4
    ratio = ridge["value"] / ridge["compared_with"]
    assert np.abs(ratio - 1).max() < 0.01


def test_turned_axes_leave_the_flow_as_it_is() -> None:
    table = truth.stored()
    turned = table[table["part"] == "turn"]
    ratio = turned["value"] / turned["compared_with"]
    is_square = turned["case"] == "by 90 deg"
    assert np.abs(ratio[is_square] - 1).max() < 0.01
    assert np.abs(ratio - 1).max() < 0.03


@pytest.mark.parametrize("share", [onset.STARTS, cards.HALF])
def test_the_interval_of_a_wind_is_that_of_the_flows(share: float) -> None:
    low, high = cards.factors_of_wind(share)
    table = truth.stored()
    is_meant = table["quantity"] == cards.EXCEEDED[share]
    rows = table[(table["part"] == "interval") & is_meant]
    for value, beside in zip(rows["value"], rows["compared_with"], strict=True):
        assert low <= beside / value <= high
    assert 0.7 < low <= 1 <= high < 1.5
