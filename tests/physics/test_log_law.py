"""Speeds that a field user measures, against the profile that they come from."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from orchestrator.physics.log_law import depth_mean_speed, log_law_speed, log_law_ustar
from tests.physics import closures

speeds = st.floats(1e-3, 50)
roughness = st.floats(1e-6, 1e-2)


@given(speed=speeds, height=st.floats(0.02, 20), z0=roughness)
def test_speed_and_friction_velocity_are_inverse(speed: float, height: float, z0: float) -> None:
    ustar = log_law_ustar(speed, height, z0)
    assert float(log_law_speed(ustar, height, z0)) == pytest.approx(speed, rel=1e-13)
    assert float(ustar) == pytest.approx(
        float(closures.log_law_ustar(speed, height, z0)), rel=1e-14
    )


def test_eq_10_as_printed_changes_its_sign_below_z0() -> None:
    # ustar = 0.41 u/ln 10 at ten z0
    assert float(log_law_ustar(1.0, 1e-3, 1e-4, printed=True)) == pytest.approx(0.41 / np.log(10))
    assert float(log_law_ustar(1.0, 5e-5, 1e-4, printed=True)) < 0
    assert float(log_law_ustar(1.0, 5e-5, 1e-4)) > 0


def test_a_threshold_of_sand_is_a_wind_of_known_strength() -> None:
    # 0.25 mm sand moves at about ustar = 0.22 m/s; z0 = d/30
    wind = log_law_speed(0.22, np.array([1.0, 10.0]), 2.5e-4 / 30)
    np.testing.assert_allclose(wind, 0.22 / 0.41 * np.log([120001, 1200001]))
    assert np.all((wind > 6) & (wind < 8))


@pytest.mark.parametrize("depth", [0.05, 1.0, 5.0])
def test_the_depth_mean_is_the_mean_of_the_profile(depth: float) -> None:
    z0 = 1e-4
    total = quad(lambda z: float(log_law_speed(0.05, z, z0)), 0, depth, epsrel=1e-12)[0]
    assert float(depth_mean_speed(0.05, depth, z0)) == pytest.approx(total / depth, rel=1e-9)


def test_depths_broadcast() -> None:
    found = depth_mean_speed(np.array([[0.02], [0.04]]), np.array([0.1, 1.0, 2.0]), 1e-5)
    assert found.shape == (2, 3)
    assert np.all(np.diff(found, axis=1) > 0)
    np.testing.assert_allclose(found[1], 2 * found[0])
