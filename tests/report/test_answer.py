"""What is said in words of a study's thresholds."""

import math

import pandas as pd
import pytest

from orchestrator.report import words


def _piles(low: float, high: float) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "shields": [0.05, math.nan],
            "shields_model_low": [0.05 * (1 - low), math.nan],
            "shields_model_high": [0.05 * (1 + high), math.nan],
            "model_share": ["packing", "packing"],
        }
    )


def test_a_tolerance_below_the_models_interval_is_told() -> None:
    (said,) = words._tolerance(_piles(0.3, 1.1), 0.05)
    assert "tolerance of 5% is about numerics" in said
    assert "−30% … +110%, most by packing" in said


@pytest.mark.parametrize(
    ("low", "high", "tolerance"),
    [(0.3, 1.1, None), (0.04, 0.02, 0.05), (math.nan, math.nan, 0.05)],
)
def test_nothing_is_told_of_others(low: float, high: float, tolerance: float | None) -> None:
    assert not list(words._tolerance(_piles(low, high), tolerance))


def test_what_the_frozen_bed_is_known_to_move_is_told() -> None:
    piles = pd.DataFrame({"fraction": [0.1, 0.3, 0.7, 0.7], "frozen_bed": [0, 0.06, 0.2, math.nan]})
    (said,) = words._frozen(piles)
    assert "2 of 4 thresholds" in said
    assert "up to 20%, from n/N = 30% on" in said
    assert not list(words._frozen(piles[:1]))
