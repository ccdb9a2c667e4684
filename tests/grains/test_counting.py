"""The counting rule, on tracks that are known and on a pile whose grains lift off."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator import pipeline, plan
from orchestrator.grains import counting
from orchestrator.report import bed
from orchestrator.study import study
from orchestrator.study.closed_form import closed_form

GONE = np.nan
LIFT_OFF = """
[fluid]
density = 1.0
viscosity = 1e-5
[grain]
diameter = 5e-4
density = 2500.0
stiffness = 1e3
[flow]
model = "hill"
[forces]
law = "low"
[protocol]
load_increment = 0.05
waiting_time = 6.0
time_step = 0.3
final_fraction = 0.5
fractions = [0.1, 0.3]
[[group]]
name = "lift"
bed = { kind = "pile", height = 0.005, slope_deg = 20.0, mobile_layers = 1, roughness = "d/30" }
"""
"""A pile under Eq. 2 far above its range: lift bears the grains before drag can push them up."""


def _ends(*track: float, falls_out: bool = False) -> tuple[bool, bool, bool]:
    found = counting.count(np.array(track)[:, None], 0.3, falls_out=falls_out)
    return bool(found.moved[-1, 0]), bool(found.fallen[-1, 0]), bool(found.carried[-1, 0])


@pytest.mark.parametrize(
    ("track", "ends"),
    [
        ((0.0, 0.29, 0.29), (False, False, False)),
        ((0.0, 0.3, 0.1), (True, False, False)),  # it came back
        ((0.0, 0.4, GONE), (True, False, False)),  # it went on its way
        ((0.0, -0.3, -0.1), (False, True, False)),  # it lies further down
        ((0.0, -0.3, 0.3), (True, True, False)),  # and goes after all
        ((0.0, -0.4, GONE), (True, True, True)),  # lift took it, backwards
        ((0.0, 0.0, GONE), (True, False, True)),  # straight up within one sample
    ],
)
def test_what_a_track_on_a_pile_counts_as(
    track: tuple[float, ...], ends: tuple[bool, bool, bool]
) -> None:
    assert _ends(*track) == ends


@pytest.mark.parametrize(
    ("track", "ends"),
    [
        ((0.0, 0.4, GONE), (True, False, False)),
        ((0.0, -0.4, GONE), (False, True, False)),
        ((GONE, GONE), (False, True, False)),  # it did not even stay as the bed settled
    ],
)
def test_a_grain_that_leaves_its_cell_upstream_fell(
    track: tuple[float, ...], ends: tuple[bool, bool, bool]
) -> None:
    assert _ends(*track, falls_out=True) == ends


@given(
    st.lists(st.floats(-1, 1) | st.just(GONE), min_size=1, max_size=9),
    st.booleans(),
)
def test_the_rule_is_latched_and_nobody_is_both_moved_and_not(
    track: list[float], falls_out: bool
) -> None:
    found = counting.count(np.array(track)[:, None], 0.3, falls_out=falls_out)
    for state in (found.moved, found.fallen, found.carried):
        assert (np.diff(state[:, 0].astype(int)) >= 0).all()
    assert (found.moved >= found.carried).all()


def test_a_grain_that_rocks_about_the_criterion_has_moved_once() -> None:
    rocks, lies = [0.29, 0.31, 0.29, 0.31, 0.29], [0.0] * 5
    lying, fallen = counting.deck_counts(np.array([rocks, lies]).T, 0.3)
    assert lying.tolist() == [2, 1, 1, 1, 1]
    assert fallen.tolist() == [0] * 5


def test_a_pile_that_lifts_off_has_moved_and_says_so(tmp_path: Path) -> None:
    asked = study.parse(LIFT_OFF, name="lift", where="lift")
    ended = pipeline.run(asked, tmp_path, workers=1)
    assert not ended.failures
    curve = pd.read_csv(tmp_path / "tables" / "pile_curve.csv")
    last = curve.iloc[-1]
    assert last["fallen_upstream"] > 0.3 * last["count"]
    assert last["moved"] >= 0.5 * last["count"]
    assert last["moved"] + last["not_moved"] == last["count"]
    assert last["carried_off"] > 0.9 * last["moved"]
    thresholds = pd.read_csv(tmp_path / "tables" / "pile_threshold.csv")
    assert (thresholds["share_carried_off"] > 0.9).all()
    grains = pd.read_csv(tmp_path / "tables" / "pile_grain.csv")
    assert (grains.loc[grains["carried_off"] == 1, "mode"] == "lifted").all()
    # at the threshold of one grain nothing holds it on the bed
    (scene,) = asked.scenes
    alone = closed_form(scene)
    assert float(alone.lift / alone.drag) > 1 / np.tan(np.radians(20.0))
    # the pictures count as the tables do
    (pile,) = plan.make(asked).piles.values()
    steps = bed.read(pile, tmp_path / "cases")
    assert steps.moved(len(steps.places) - 1) == last["moved"]
