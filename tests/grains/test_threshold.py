"""Thresholds and curves from a motion that is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.grains import threshold
from orchestrator.grains.motion import Motion

# ten grains, four holds: two move in the 1st, three in the 2nd, none in the 3rd, four in the 4th
FLOW = np.array([0.9, 1.0, 1.1, 1.2, 1.3])
LEVEL = np.array([1, 1, 2, 2, 2, 4, 4, 4, 4, 0])
SPEED = np.array([2.0, 2.0, 1.5, 1.5, 1.5, 1.0, 1.0, 1.0, 1.0, -0.5])
NONE = np.zeros(10, int)
NOBODY = np.zeros(10, bool)
MOTION = Motion(FLOW, LEVEL, NONE, NOBODY, NONE)
DENSITY = 1.2


def test_thresholds_of_grains_lie_between_two_holds() -> None:
    found = threshold.of_grains(MOTION)
    np.testing.assert_allclose(found.low[[0, 2, 5]], [0.9, 1.0, 1.2])
    np.testing.assert_allclose(found.high[[0, 2, 5]], [1.0, 1.1, 1.3])
    assert np.isnan(found.value[9])


def test_curve_holds_the_mean_stress_of_what_has_moved() -> None:
    np.testing.assert_allclose(MOTION.fraction, [0, 0.2, 0.5, 0.5, 0.9])
    found = threshold.mean_tau(MOTION, SPEED, DENSITY)
    mean = [math.nan, 4.0, (2 * 4 + 3 * 2.25) / 5, (2 * 4 + 3 * 2.25) / 5, (8 + 6.75 + 4) / 9]
    np.testing.assert_allclose(found, DENSITY * FLOW**2 * mean)


def test_threshold_of_a_pile_at_a_fraction() -> None:
    # all of the first load step were carried off, and two of the three of the second
    carried = Motion(FLOW, LEVEL, NONE, np.arange(10) < 4, NONE)
    shares = [threshold.of_pile(carried, SPEED, n, DENSITY).carried_off for n in (0.1, 0.4, 0.95)]
    np.testing.assert_allclose(shares, [1.0, 0.8, np.nan])
    # 40 % is first reached in the second hold, by five of ten
    found = threshold.of_pile(MOTION, SPEED, 0.4, DENSITY)
    assert found.ustar0 == pytest.approx(math.sqrt(1.1))
    assert found.tau == pytest.approx(DENSITY * 1.1 * 2.95)
    assert found.tau_low == pytest.approx(DENSITY * 1.0 * 2.95)
    assert found.tau_high == pytest.approx(DENSITY * 1.21 * 2.95)


def test_the_interval_holds_the_counts_resolution() -> None:
    # half a grain more than 50 % asks for the fourth hold
    found = threshold.of_pile(MOTION, SPEED, 0.5, DENSITY)
    assert found.tau == pytest.approx(DENSITY * 1.1 * 2.95)
    assert found.tau_high == pytest.approx(DENSITY * 1.69 * 18.75 / 9)


def test_grains_that_a_reversed_flow_drives_upstream_count_with_the_size_of_their_stress() -> None:
    forward, back = (threshold.of_pile(MOTION, way * SPEED, 0.9, DENSITY) for way in (1, -1))
    assert back.tau == forward.tau > 0
    assert (forward.against_the_flow, back.against_the_flow) == (0, 1)
    curve = threshold.mean_tau(MOTION, np.where(LEVEL == 1, -SPEED, SPEED), DENSITY)
    assert (curve[1:] > 0).all()
    some = threshold.of_pile(MOTION, np.where(LEVEL == 1, -SPEED, SPEED), 0.5, DENSITY)
    assert some.against_the_flow == 0.4


@settings(deadline=None)
@given(
    level=st.lists(st.integers(0, 4), min_size=2, max_size=50),
    fraction=st.floats(0.01, 1),
)
def test_intervals_enclose_their_value_where_the_stress_is_uniform(
    level: list[int], fraction: float
) -> None:
    motion = Motion(FLOW, np.array(level), *(np.zeros(len(level), int),) * 3)
    found = threshold.of_pile(motion, np.ones(len(level)), fraction, 1.0)
    if math.isnan(found.tau):
        assert motion.fraction[-1] < fraction
    else:
        assert found.tau_low < found.tau < found.tau_high


def test_every_grain_is_in_one_class_within_half_a_step() -> None:
    sizes = np.random.default_rng(1).lognormal(0, 0.4, 500)
    found = list(threshold.classes(sizes))
    np.testing.assert_array_equal(np.sum([one.chosen for one in found], axis=0), 1)
    for one in found:
        own = sizes[one.chosen] / threshold.STEP**one.number
        assert own.max() <= threshold.STEP**0.5
        assert own.min() >= threshold.STEP**-0.5


def test_a_class_is_at_its_threshold_when_its_own_grains_have_moved() -> None:
    sizes = np.array([0.7, 0.7, 1.0, 1.0])
    motion = Motion.of_flows(np.array([1.0, 3.0, 2.0, np.inf]))
    small, middle = (motion.of(one.chosen) for one in threshold.classes(sizes))
    speed = np.ones(2)
    assert threshold.of_pile(small, speed, 1.0, 1.0).ustar0 == 3.0
    assert threshold.of_pile(middle, speed, 0.5, 1.0).ustar0 == 2.0
    assert np.isnan(threshold.of_pile(middle, speed, 1.0, 1.0).ustar0)
