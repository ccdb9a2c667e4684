"""The scatter over seeds, from thresholds that are known."""

import numpy as np
import pandas as pd
import pytest

from orchestrator.tables.usable import with_scatter


def _tables() -> tuple[pd.DataFrame, pd.DataFrame]:
    # three seeds of one disordered pile, one regular pile of the same slope, one of another, and
    # two of level rows: a lattice and its replica
    shields = [0.95, 1.0, 1.05, 2.0, 3.0, 1.8, 2.2]
    thresholds = pd.DataFrame(
        {
            "scene_id": list("abcdefg"),
            "alpha_deg": [15.0, 15.0, 15.0, 15.0, 30.0, 15.0, 15.0],
            "force_law": "high",
            "fraction": 0.5,
            "d_m": 1e-3,
            "z0_over_d": 0.1,
            "nu_m2_s": 1e-5,
            "stress": "wall",
            "share_carried_off": 0.0,
            "shields": shields,
            "shields_low": np.multiply(shields, 0.98),
            "shields_high": np.multiply(shields, 1.02),
        }
    )
    scenes = pd.DataFrame(
        {
            "scene_id": list("abcdefg"),
            "group": "piles",
            "case": [f"pile-{name}" for name in "abcdefg"],
            "packing": [*["disordered"] * 3, "aligned", "aligned", "horizontal", "horizontal"],
            "disorder": [*[0.02] * 3, *[np.nan] * 4],
            "seed": [0.0, 1.0, 2.0, np.nan, np.nan, np.nan, 1.0],
            "alpha_deg": thresholds["alpha_deg"],
            "stiffness": 1e3,
        }
    )
    return thresholds, scenes


def test_half_the_range_widens_the_interval_of_piles_of_the_same_slope() -> None:
    found = with_scatter(*_tables()).set_index("scene_id")
    assert found.loc["d", "scatter"] == pytest.approx(0.05)
    assert found.loc["d", "shields_low"] == pytest.approx(2.0 * 0.98 * 0.95)
    assert found.loc["d", "shields_high"] == pytest.approx(2.0 * 1.02 * 1.05)


def test_twins_of_level_rows_scatter_by_themselves() -> None:
    found = with_scatter(*_tables()).set_index("scene_id")
    assert found.loc[["f", "g"], "scatter"].tolist() == pytest.approx([0.1, 0.1])
    assert found.loc["f", "shields_low"] == pytest.approx(1.8 * 0.98 * 0.9)


def test_piles_that_lift_off_widen_no_others() -> None:
    thresholds, scenes = _tables()
    lifted = thresholds.assign(share_carried_off=[1.0] * 3 + [0.0] * 4)
    found = with_scatter(lifted, scenes).set_index("scene_id")
    assert found.loc[["a", "b", "c"], "scatter"].tolist() == pytest.approx([0.05] * 3)
    assert found["scatter"].isna()["d"]
    assert found.loc["d", "shields_low"] == pytest.approx(2.0 * 0.98)


def test_piles_that_differ_in_more_than_the_seed_are_no_scatter() -> None:
    thresholds, scenes = _tables()
    found = with_scatter(thresholds, scenes.assign(stiffness=range(7)))
    assert found["scatter"].isna().all()


def test_without_seeds_there_is_no_scatter() -> None:
    found = with_scatter(*_tables()).set_index("scene_id")
    assert found["scatter"].isna()["e"]
    assert found.loc["e", "shields_low"] == pytest.approx(3.0 * 0.98)


def test_one_seed_is_not_a_range() -> None:
    thresholds, scenes = _tables()
    found = with_scatter(thresholds.iloc[[0, 3]], scenes)
    assert found["scatter"].isna().all()


def test_no_piles_no_table() -> None:
    assert with_scatter(pd.DataFrame(), pd.DataFrame()).empty
