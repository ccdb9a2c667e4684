"""Ratios of thresholds with shelter to those without, with their own interval."""

import numpy as np
import pandas as pd
import pytest

from orchestrator.tables.paired import PAIRED, paired

FLOW = {
    "rho_f_kg_m3": 1.2,
    "nu_m2_s": 1.5e-5,
    "g_m_s2": 9.81,
    "z0_m": 2e-5,
    "depth_m": np.nan,
    "flow_top": "boundary layer",
}
FLOWS = np.linspace(0.2, 0.6, 41)


def _curve(scene_id: str, first: float) -> pd.DataFrame:
    """Grains of which one more moves at each hundredth of a flow from a first on."""
    moved = np.clip(np.round((FLOWS - first) * 100) + 1, 0, 30)
    return pd.DataFrame({"scene_id": scene_id, "ustar0_m_s": FLOWS, "moved": moved})


def _study(*beds: tuple[str, str, float, int]) -> tuple[pd.DataFrame, ...]:
    """Thresholds, curves and scenes of beds: name, obstacles, first flow, seed."""
    rows, curves, scenes = [], [], []
    for name, obstacles, first, seed in beds:
        own = {"obstacles": obstacles, "spacing": np.nan, "forms": 1, "seed": seed}
        scenes.append({"scene_id": name, "method": "peeling", **own, **FLOW})
        curves.append(_curve(name, first))
        rows.append(
            {
                "scene_id": name,
                "fraction": 0.3,
                "count": 30,
                "ustar0_m_s": first + 0.08,
                "first_ustar0_m_s": first,
                "reason": "" if not obstacles else "error not known",
            }
        )
    return pd.DataFrame(rows), pd.concat(curves), pd.DataFrame(scenes)


def test_a_ratio_has_a_paired_interval_of_one_grain_each() -> None:
    found = paired(*_study(("a", "", 0.25, 0), ("b", "fence", 0.30, 0)))
    assert [*found] == [*PAIRED]
    assert found["scene_id"].tolist() == ["b", "b"]
    assert found["without_id"].tolist() == ["a", "a"]
    (at, first) = (found[found["fraction"] == 0.3], found[found["fraction"].isna()])
    assert at["ustar0_ratio"].item() == pytest.approx(0.38 / 0.33)
    assert at["stress_ratio"].item() == pytest.approx((0.38 / 0.33) ** 2)
    # a grain less of one and a grain more of the other
    assert at["ustar0_ratio_low"].item() == pytest.approx(0.36 / 0.34, rel=1e-6)
    assert at["ustar0_ratio_high"].item() == pytest.approx(0.39 / 0.31, rel=1e-6)
    assert first["ustar0_ratio"].item() == pytest.approx(0.30 / 0.25)
    # the numerical error of both is one: it has no effect on their ratio
    assert found["ratio_usable"].all()
    # the wind over the same ground has nearly the ratio of the friction velocity
    assert at["wind_10m_ratio"].item() == pytest.approx(0.38 / 0.33, rel=0.02)


def test_the_interval_of_replicates_holds_every_pair() -> None:
    study = _study(
        ("a", "", 0.25, 1),
        ("b", "fence", 0.30, 1),
        ("c", "", 0.24, 2),
        ("d", "fence", 0.34, 2),
    )
    found = paired(*study)
    at = found[found["fraction"] == 0.3]
    assert at["pairs"].tolist() == [2, 2]
    assert at["ustar0_ratio"].nunique() == 1
    ratios = (0.38 / 0.33, 0.42 / 0.32)
    assert at["ustar0_ratio"].iloc[0] == pytest.approx(np.sqrt(np.prod(ratios)))
    assert at["ustar0_ratio_low"].iloc[0] < min(ratios)
    assert at["ustar0_ratio_high"].iloc[0] > max(ratios)
    # a reason that is not of the numerical error is one against the ratio
    rows, curves, scenes = study
    bad = rows.assign(reason=["", "law", "", "error not known"])
    assert not paired(bad, curves, scenes)["ratio_usable"].any()


def test_beds_without_a_bare_one_have_no_ratio() -> None:
    assert paired(*_study(("a", "wall", 0.25, 0), ("b", "fence", 0.3, 0))).empty
    assert paired(*_study(("a", "", 0.25, 0), ("b", "", 0.3, 1))).empty
