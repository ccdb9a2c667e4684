"""Strips whose grains DEM follows: thresholds of load steps, beside the closed form, and the stored rows."""

import numpy as np
import pandas as pd
import pytest

from orchestrator.lab import followed


def _steps(sustained: list[int], dropped: int, seed: int = 1) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "set": "water",
            "seed": seed,
            "dropped_grains": dropped,
            "stiffness": 1e3,
            "galileo": 127.0,
            "density_ratio": 2.65,
            "shields": [0.04, 0.01, 0.02],
            "exposed": 100,
            "moved": 50,
            "sustained": [sustained[2], sustained[0], sustained[1]],
            "level_over_d": 0.1,
            "gust_level_over_d": 0.1,
        }
    )


def test_the_threshold_is_where_one_exposed_grain_in_twenty_keeps_moving() -> None:
    steps = pd.concat(
        [
            _steps([0, 4, 5], dropped=0),
            _steps([0, 5, 0], dropped=4),
            _steps([0, 4, 4], dropped=0, seed=2),
        ]
    )
    found = followed.strip_thresholds(steps)
    first, dropped, never = found.to_dict("records")
    assert (first["shields_low"], first["shields_high"]) == (0.02, 0.04)
    assert first["shields"] == pytest.approx(np.sqrt(0.02 * 0.04))
    assert (dropped["shields_low"], dropped["shields_high"]) == (0.01, 0.02)
    assert never["shields_low"] == 0.04
    assert np.isnan(never["shields"])


def test_each_threshold_is_called_what_it_is_and_stands_beside_the_closed_form() -> (
    None
):
    steps = pd.concat([_steps([0, 4, 5], 0), _steps([0, 5, 0], 4)])
    cut, sustained = followed.compare_strips(steps).to_dict("records")
    assert cut["threshold"] == followed.CUT
    assert sustained["threshold"] == followed.DROPPED
    # 1 mm of quartz in water: sustained motion decides, and ends where it begins
    assert cut["sustained"] == pytest.approx(0.027, abs=1e-3)
    assert cut["entrained"] < cut["sustained"]
    assert cut["cessation"] == pytest.approx(cut["sustained"])
    assert cut["over_closed_form"] == pytest.approx(cut["shields"] / cut["sustained"])


def test_the_stored_strips_start_above_the_closed_form_and_go_on_below_it_in_air() -> (
    None
):
    steps = followed.stored_strips()
    assert (steps["sustained"] >= 0).all()
    compared = followed.compare_strips(steps)
    in_air = compared[compared["set"].str.startswith("air")]
    over = in_air.groupby("threshold")["over_closed_form"]
    assert over.min()[followed.CUT] > 1.2
    assert over.max()[followed.DROPPED] < 1.0
