"""Hills that others measured, from their study file to the figure."""

import numpy as np
import pytest

from orchestrator.report import flows
from orchestrator.report.results import Results
from tests import small_study

STEEP = """
title = "A hill"
grain = { diameter = 4.71e-3 }
protocol = { method = "pivot" }
[bed]
kind = "pile"
shape = "rushil"
slope_deg = 26.175
height = 0.117
roughness = 1.57e-4
[flow]
cells_per_face = 12
[axes]
"flow.turbulence_model" = ["kEpsilon", "RNGkEpsilon"]
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return small_study.run(tmp_path_factory.mktemp("hills"), STEEP)


def test_a_steep_hill_separates_where_it_was_measured_to(results: Results) -> None:
    """On a coarse mesh too, the flow leaves behind the top and is back within 4 to 9 heights."""
    table = results.tables["flow"]
    assert (table["measured_reattachment_over_h"] == 6.5).all()
    assert not table["measured_verified"].any()
    assert table["measured_source"].str.contains("unverified").all()
    assert table["separation_over_h"].between(0.1, 2).all()
    assert table["reattachment_over_h"].between(4, 9).all()
    assert table["ustar_mean"].between(1.2, 1.5).all()


def test_computed_stands_beside_measured(results: Results) -> None:
    (figure,) = flows.hills(results)
    assert figure.canvas
    lines = [line for axes in figure.canvas.axes for line in axes.lines]
    (measured_,) = (line for line in lines if line.get_gid() == "measured")
    np.testing.assert_array_equal(np.asarray(measured_.get_xdata()), 6.5)
    ends = [np.asarray(one.get_xdata())[1] for one in lines if one.get_gid() == "reversed flow"]
    np.testing.assert_allclose(ends, results.tables["flow"]["reattachment_over_h"])
    tops = [np.max(np.asarray(one.get_ydata())) for one in lines if one.get_gid() == "stress"]
    np.testing.assert_allclose(tops, results.tables["flow"]["ustar_largest"])
