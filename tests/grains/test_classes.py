"""Size classes: every counted grain is in one, and a class moves as its grains do."""

import numpy as np

from orchestrator.grains import classes, threshold
from orchestrator.grains.motion import Motion


def test_every_grain_is_in_one_class_within_half_a_step() -> None:
    sizes = np.random.default_rng(1).lognormal(0, 0.4, 500)
    found = list(classes.classes(sizes))
    np.testing.assert_array_equal(np.sum([one.chosen for one in found], axis=0), 1)
    for one in found:
        own = sizes[one.chosen] / classes.STEP**one.number
        assert own.max() <= classes.STEP**0.5
        assert own.min() >= classes.STEP**-0.5


def test_a_class_is_at_its_threshold_when_its_own_grains_have_moved() -> None:
    sizes = np.array([0.7, 0.7, 1.0, 1.0])
    motion = Motion.of_flows(np.array([1.0, 3.0, 2.0, np.inf]))
    small, middle = (classes.of(motion, one.chosen) for one in classes.classes(sizes))
    speed = np.ones(2)
    assert threshold.of_pile(small, speed, 1.0, 1.0).ustar0 == 3.0
    assert threshold.of_pile(middle, speed, 0.5, 1.0).ustar0 == 2.0
    assert np.isnan(threshold.of_pile(middle, speed, 1.0, 1.0).ustar0)
