"""Which thresholds may be used, and what speaks against the others."""

from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from orchestrator.report.results import Results
from orchestrator.tables.usable import SMOOTH_BELOW, with_usable

SOUND = {
    "scene_id": "a",
    "alpha_deg": 15.0,
    "d_m": 1e-3,
    "z0_over_d": 1 / 30,
    "nu_m2_s": 1e-5,
    "force_law": "bridged",
    "reynolds": 60.0,
    "shields": 0.05,
    "fraction": 0.3,
    "count": 65,
    "highest_fraction": 0.8,
    "share_carried_off": 0.0,
    "error_estimate": 0.03,
    "u_e_m_s": 10.0,
}
SCENE = {
    "scene_id": "a",
    "rho_f_kg_m3": 1.0,
    "alpha_s": 1.0,
    "h_m": 0.02,
    "relative_size": 1.0,
    "beta_deg": 60.0,
}
NAN = float("nan")


def _judged(tolerance: float | None = None, **changes: Any) -> tuple[bool, str]:
    table, scenes = pd.DataFrame([{**SOUND, **changes}]), pd.DataFrame([SCENE])
    study: Any = SimpleNamespace(tolerance=tolerance)
    row = with_usable(table, scenes, study).iloc[0]
    return bool(row["usable"]), str(row["why_not"])


def test_nothing_speaks_against_a_sound_threshold() -> None:
    assert _judged() == (True, "")
    assert _judged(0.05) == (True, "")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"force_law": "low"}, "Re* 60 is not below 3"),
        ({"force_law": "high", "reynolds": 20.0}, "Re* 20 is below 30"),
        ({"force_law": "high", "reynolds": 400.0}, "Schiller and Naumann"),
        ({"reynolds": 29 * SMOOTH_BELOW}, "hydraulically smooth bed: u* z0/nu 0.16"),
        ({"count": 3}, "0.3 of 3 grains is less than one"),
        ({"row_hold": 2.3}, "hold the first grain up to 2.3 times"),
        ({"share_carried_off": 0.76}, "lift carried off 76% of the moved grains"),
        (
            {"reynolds": NAN, "shields": NAN, "share_carried_off": NAN},
            "not reached: at most 80% of 65 grains moved",
        ),
    ],
)
def test_each_reason_is_named(changes: dict[str, Any], said: str) -> None:
    usable, why = _judged(**changes)
    assert not usable
    assert said in why
    assert ";" not in why


def test_a_known_error_above_the_tolerance_speaks_against_it() -> None:
    for tolerance in (None, 0.05):
        usable, why = _judged(tolerance, error_estimate=NAN)
        assert not usable
        assert why.startswith("no interval")
    assert _judged(0.02) == (False, "known error 3.0% is above the tolerance of 0.02")


def test_a_pile_is_judged_at_its_own_threshold(results: Results) -> None:
    piles = results.joined("pile_threshold")
    laws = {"low": (0.0, 3.0), "high": (30.0, 1e9)}
    for row in piles.to_dict("records"):
        low, high = laws[row["force_law"]]
        if not low <= row["reynolds"] < high:
            assert not row["usable"]
            assert "Re*" in row["why_not"]
    assert piles["usable"].nunique() + piles["why_not"].nunique() > 1


def test_a_single_grain_without_dem_is_judged_by_the_closed_form(results: Results) -> None:
    grains = results.tables["single_grain"].drop(columns=["usable", "why_not"])
    closed = grains.assign(answered_method="pivot", reynolds=NAN)
    study: Any = SimpleNamespace(tolerance=0.1)
    found = with_usable(closed, results.scenes, study)
    assert found["usable"].any()
    assert not found["why_not"].str.contains("did not move").any()
