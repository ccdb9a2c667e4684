"""The interval of the model's own choices holds the threshold, each end on its side."""

import pytest

from orchestrator.fidelity.spread import spread
from orchestrator.report.results import Results
from orchestrator.study.fields import default_of


def test_the_ends_of_the_model_are_those_of_its_budget(results: Results) -> None:
    rows = results.tables["pile_threshold"].dropna(subset=["shields_model_low"])
    assert len(rows) > 1
    ratios = set()
    for row in rows.to_dict("records"):
        scene = results.plan.decisions[row["scene_id"]].asked
        low, high, *_ = spread(scene, row["fraction"])
        assert 0 < low < 1
        assert row["shields_model_low"] == pytest.approx(row["shields"] * (1 - low))
        assert row["shields_model_high"] == pytest.approx(row["shields"] * (1 + high))
        ratios.add(round(low / high, 3))
    assert ratios != {1.0}  # else exchanged ends would not be seen


def test_a_grain_has_moved_by_the_way_of_the_paper() -> None:
    """Section 3.2 of the paper: displaced at least 0.3 d."""
    assert default_of("threshold.displacement") == 0.3
