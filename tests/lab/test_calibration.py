"""Half widths from the errors of single scenes: how many they hold, and what is pooled."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.fidelity.classes import FLOW, GRAINS
from orchestrator.lab import calibration


@given(
    n=st.integers(9, 200),
    seed=st.integers(0, 2**32 - 1),
    spread=st.sampled_from(["normal", "uniform", "lognormal"]),
)
@settings(max_examples=200, deadline=None)
def test_a_half_width_is_the_least_with_the_rank_of_its_share(
    n: int, seed: int, spread: str
) -> None:
    sizes = np.abs(getattr(np.random.default_rng(seed), spread)(size=n))
    share = calibration.confidence(n)
    width = calibration.half_width(sizes, share)
    within = int((sizes <= width).sum())
    assert within >= (n + 1) * share - 1e-9
    assert within - 1 < (n + 1) * share


def test_of_few_scenes_less_is_held() -> None:
    """Nineteen are needed for 95 %: the largest of n is a bound of n in n + 1."""
    assert calibration.confidence(19) == 0.95
    assert calibration.confidence(18) == 0.9
    sizes = np.arange(1.0, 20.0)
    assert calibration.half_width(sizes, 0.95) == sizes.max()
    assert calibration.half_width(np.arange(1.0, 40.0), 0.95) == 38.0
    assert math.isnan(calibration.half_width(np.array([]), 0.9))


def test_a_half_width_holds_the_share_of_scenes_that_it_states() -> None:
    """Of scenes that were not measured, on which nothing was fitted."""
    rng = np.random.default_rng(1)
    held = []
    for _ in range(2000):
        *known, new = np.abs(rng.standard_t(3, size=41))
        width = calibration.half_width(np.array(known), calibration.confidence(40))
        held.append(new <= width)
    assert np.mean(held) == pytest.approx(39 / 41, abs=0.015)


def test_the_coverage_is_that_of_geometries_that_were_left_out() -> None:
    sizes = np.array([1.0] * 30 + [5.0] * 10)
    alike = np.array([0, 1, 2, 3, 4, 5, 6, 7, 8, 9] * 4)
    assert calibration.coverage(sizes, alike) == 1.0
    # all large ones are of one geometry: without it they are outside
    apart = np.array([0, 1, 2] * 10 + [9] * 10)
    assert calibration.coverage(sizes, apart) == 0.75
    assert math.isnan(calibration.coverage(sizes, np.zeros(40)))


def test_classes_that_do_not_differ_are_pooled_and_others_are_not() -> None:
    rng = np.random.default_rng(3)
    sizes = {name: np.abs(rng.normal(size=20)) for name in ("a", "b", "c")}
    assert calibration.pools(sizes) == [("a", "b", "c")]
    wide = 10 * sizes["a"]
    assert calibration.pools({**sizes, "d": wide}) == [("a", "b", "c"), ("d",)]
    two = {**sizes, "d": wide, "e": wide}
    assert calibration.pools(two) == [("a", "b", "c"), ("d", "e")]


def test_equal_classes_are_seldom_parted() -> None:
    rng = np.random.default_rng(4)
    parted = 0
    for _ in range(300):
        sizes = {name: np.abs(rng.normal(size=15)) for name in "abcd"}
        parted += len(calibration.pools(sizes)) > 1
    # four classes are each compared with three others and with all of them
    assert parted / 300 < 16 * calibration.CHANCE


def test_small_piles_and_the_limiting_slope_are_of_one_family() -> None:
    assert calibration.family(FLOW, "wall, limiting slope, small") == "wall"
    rows = calibration.family(GRAINS, "aligned, small")
    assert calibration.family(GRAINS, "disordered up to 0.02 d") == rows
    assert calibration.family(GRAINS, "horizontal") == "horizontal"
    assert calibration.family(FLOW, "wall, channel") == "wall, channel"


def test_what_was_not_run_is_empty() -> None:
    rows = [
        {
            "part": part,
            "rung": "quick",
            "scene_class": "wall",
            "geometry": str(i),
            "fraction": 0.1,
            "error": 0.01 * i,
            "cost_core_s": 1.0,
        }
        for part in (FLOW, GRAINS)
        for i in range(12)
    ]
    again = [{**row, "rung": "again"} for row in rows if row["part"] == GRAINS]
    table = calibration.half_widths(
        pd.DataFrame([*rows, *again]), {FLOW: "again", GRAINS: "again"}
    )
    quick = table[table["rung"] == "quick"].set_index("part")
    assert quick["uncertainty"].isna().to_dict() == {FLOW: True, GRAINS: False}
    assert quick.loc[FLOW, "uncertainty_scenes"] == 0
    assert quick.loc[GRAINS, "uncertainty"] == pytest.approx(0.11)
    assert quick.loc[GRAINS, "uncertainty_scenes"] == 12
    assert (quick["confidence"] == 0.9).all()
