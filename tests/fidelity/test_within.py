"""How often numerical errors held: the table beside DEM, on thresholds made by hand."""

import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

TOOLS = Path(__file__).parents[2] / "tools"


def _thresholds(shields: list[float], **columns: object) -> pd.DataFrame:
    """Thresholds of five piles at one fraction, all by DEM but the last."""
    about = {
        "scene_id": [*"abcde"],
        "fraction": 0.3,
        "packing": ["aligned", "aligned", "aligned", "poured", "aligned"],
        "case": ["pile-1", "pile-2", "pile-3", "poured-4", "flow-5"],
        "shields": shields,
    }
    return pd.DataFrame({**about, **columns}).set_index(["scene_id", "fraction"])


def test_errors_are_counted_where_both_reached_the_fraction_and_dem_moved_grains(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(TOOLS)
    rows = runpy.run_path(str(TOOLS / "within.py"))["rows"]
    by_dem = _thresholds([0.05, 0.05, 0.05, 0.05, 0.05])
    by_dem["case"] = ["pile-1", "pile-2", "pile-3", "pile-4", None]
    answers = _thresholds(
        [0.051, 0.054, 0.07, np.nan, 0.05],
        numerical_error=[0.03, 0.04, np.nan, 0.1, 0.01],
        usable=[True, True, False, False, True],
    )
    all_, new, aligned = rows(by_dem, answers, 0.05, ["a", "z"])
    assert all_["piles"] == "all"
    assert aligned == {**all_, "piles": "aligned"}
    assert new["thresholds"] == 2
    assert new["error_known"] == 1
    assert new["within_the_error"] == 0
    assert all_["thresholds"] == 3
    assert all_["error_known"] == 2
    # 2 % off with an error of 3 %; 8 % off with one of 4 %
    assert all_["within_the_error"] == 1
    assert all_["known_within_the_tolerance"] == 2
    assert all_["within_the_tolerance_of_dem"] == 1
    assert all_["largest_difference_of_these"] == pytest.approx(0.08)
    assert all_["within_5_percent_of_dem"] == 1
    assert all_["usable"] == 2
