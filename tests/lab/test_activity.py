"""Time in motion in gusts: limits, a simulation, and the measured sites."""

import numpy as np
import pytest
from scipy.special import ndtr

from orchestrator.lab import activity


def test_with_one_threshold_it_is_the_time_above_it() -> None:
    sigma = np.sqrt(np.log1p(0.4**2))
    mean = np.array([0.05, 0.1, 0.2])
    above = ndtr(-(np.log(0.1 / mean) + sigma**2 / 2) / sigma)
    found = activity.active_fraction(mean, 0.1, 0.1, 0.4)
    np.testing.assert_allclose(found, above, rtol=1e-9)


def test_two_thresholds_lie_between_each_alone_and_grow_with_the_wind() -> None:
    mean = np.geomspace(1e-3, 10, 41)
    low, both, high = (
        activity.active_fraction(mean, *ends)
        for ends in ((0.08, 0.08), (0.08, 0.13), (0.13, 0.13))
    )
    assert (high <= both + 1e-12).all()
    assert (both <= low + 1e-12).all()
    assert (np.diff(both) >= -1e-12).all()
    assert both[0] == pytest.approx(0, abs=1e-9)
    assert both[-1] == pytest.approx(1, abs=1e-9)


def test_it_is_the_time_that_a_simulated_stress_has_sand_in_motion() -> None:
    chance = np.random.default_rng(1)
    step, count = 0.01, 400_000
    noise = np.sqrt(1 - np.exp(-2 * step)) * chance.standard_normal(count)
    sigma = np.sqrt(np.log1p(0.4**2))
    z, moving, moved = 0.0, False, 0
    low, high = ((np.log(end / 0.1) + sigma**2 / 2) / sigma for end in (0.085, 0.133))
    decay = float(np.exp(-step))
    for kick in noise:
        z = decay * z + kick
        moving = z > (low if moving else high)
        moved += moving
    expected = float(activity.active_fraction(0.1, 0.085, 0.133))
    # 4,000 times of relaxation; the stress jumps a little in a step
    assert moved / count == pytest.approx(expected, abs=0.03)


def test_the_sites_have_their_thresholds_and_every_measured_bin() -> None:
    rows = activity.compare_activity()
    assert len(rows) == 43
    found = activity.activity_summary(rows)
    is_measured = found["thresholds"] == "measured"
    measured, model = found[is_measured], found[~is_measured]
    (oceano,) = measured[measured["site"] == "Oceano"].to_dict("records")
    assert oceano["stops_pa"] == pytest.approx(0.085, abs=5e-4)
    assert oceano["starts_pa"] == pytest.approx(0.133, abs=5e-4)
    assert oceano["half_active_measured_pa"] == pytest.approx(0.121, abs=5e-4)
    # the measured thresholds give the measured half activity within a tenth there
    assert oceano["half_active_pa"] == pytest.approx(0.121, rel=0.1)
    # the model's motion stops earlier than measured, and it starts later
    for end, sign in (("stops_pa", -1), ("starts_pa", 1)):
        apart = model[end].to_numpy(float) - measured[end].to_numpy(float)
        assert (sign * apart > 0).all(), end
