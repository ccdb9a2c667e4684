"""Mean velocities against quadrature of their profiles."""

from decimal import Decimal, localcontext
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from orchestrator.physics.constants import KARMAN
from orchestrator.physics.velocity import (
    bridge,
    depth_mean_speed,
    law_of_the_wall,
    layer,
    log_law_speed,
    log_law_ustar,
    measurable_speeds,
    outer_roughness,
    rough_gradient,
    rough_speed,
    shear,
    shift,
    viscous_length,
)

D, Z0 = 1e-3, 1e-3 / 30
DIAMETER, ROUGHNESS = np.array(D), np.array(Z0)


@given(speed=st.floats(1e-3, 50), height=st.floats(0.02, 20), z0=st.floats(1e-6, 1e-2))
def test_speed_and_friction_velocity_are_inverse(
    speed: float, height: float, z0: float
) -> None:
    ustar = log_law_ustar(speed, height, z0)
    assert float(ustar) == pytest.approx(
        0.41 * speed / np.log((height + z0) / z0), rel=1e-10
    )
    assert float(log_law_speed(ustar, height, z0)) == pytest.approx(speed, rel=1e-13)


def test_viscosity_adds_to_the_roughness_of_a_bed_that_is_not_rough() -> None:
    z0 = outer_roughness([1e-6, 2e-4], 0.01, 1e-6)  # u* z0/nu 0.01 and 2
    np.testing.assert_allclose(z0, [1e-6 + 1e-6 / 0.09, 2e-4 + 1e-6 / 0.09])
    # rough, no flow, no threshold
    np.testing.assert_array_equal(
        outer_roughness(2.4e-4, [0.01, 0.0, np.nan], 1e-6), 2.4e-4
    )


def test_eq_10_has_the_profile_of_the_rough_wall_also_below_z0() -> None:
    for height in (1e-3, 5e-5):
        exact = 0.41 / np.log(height / 1e-4 + 1)
        assert float(log_law_ustar(1.0, height, 1e-4)) == pytest.approx(exact)


@pytest.mark.parametrize("depth", [0.05, 1.0, 5.0])
def test_the_depth_mean_is_the_mean_of_the_profile(depth: float) -> None:
    total = quad(lambda z: float(log_law_speed(0.05, z, 1e-4)), 0, depth, epsrel=1e-12)[
        0
    ]
    assert float(depth_mean_speed(0.05, depth, 1e-4)) == pytest.approx(
        total / depth, rel=1e-9
    )


@pytest.mark.parametrize("depth", [0.05, 1.0])
def test_a_closed_channel_has_the_profile_of_half_its_depth_on_each_wall(
    depth: float,
) -> None:
    half = depth / 2
    total = quad(lambda z: float(log_law_speed(0.05, z, 1e-4)), 0, half, epsrel=1e-12)
    found = depth_mean_speed(0.05, depth, 1e-4, closed=[True, False])
    assert float(found[0]) == pytest.approx(total[0] / half, rel=1e-9)
    assert found[0] < found[1]


@pytest.mark.parametrize("gap", [-0.6 * D, -0.1 * D, 0.0, Z0, 0.2 * D, 1.5 * D])
def test_speeds_and_shears_are_means_over_the_height_of_the_grain(gap: float) -> None:
    height = np.array(gap)
    mean, _ = quad(
        lambda z: 2.5 * np.log(max(z, Z0) / Z0), gap, gap + D, points=[Z0], limit=200
    )
    assert rough_speed(DIAMETER, ROUGHNESS, height) == pytest.approx(mean / D, rel=1e-6)
    linear, _ = quad(lambda z: max(z, 0.0), gap, gap + D, points=[0.0])
    assert viscous_length(DIAMETER, height) == pytest.approx(linear / D, rel=1e-6)
    rise = 2.5 * (np.log((gap + D) / Z0) - np.log(max(gap, Z0) / Z0))
    assert rough_gradient(DIAMETER, ROUGHNESS, height) == pytest.approx(
        rise / D, rel=1e-9
    )


@given(
    reynolds=st.floats(1e-6, 1e6), viscous=st.floats(1e-3, 1e3), rough=st.floats(1, 50)
)
def test_the_root_of_the_bridge_is_right_to_the_last_digits(
    reynolds: float, viscous: float, rough: float
) -> None:
    with localcontext() as context:
        context.prec = 60
        u, a, c = Decimal(reynolds), Decimal(viscous), Decimal(rough)
        exact = (-a + (a * a + 4 * u * u / (c * c)).sqrt()) * c * c / 2
    found = bridge(np.array(reynolds), np.array(viscous), np.array(rough))
    assert float(found) == pytest.approx(float(exact), rel=1e-15)


def _by_quadrature(base: float, top: float, moved: float) -> tuple[float, float]:
    """Mean speed and shear of van Driest's profile, independently of the tables."""

    def slope(z: float) -> float:
        length = KARMAN * (z + moved) * (1 - np.exp(-(z + moved) / 26))
        return float(2 / (1 + np.sqrt(1 + 4 * length**2)))

    below = quad(slope, 0, base, epsrel=1e-12, epsabs=0)[0]
    rise = first = 0.0
    for a, b in pairwise(np.geomspace(base, top, 12)):
        rise += quad(slope, a, b, epsrel=1e-12, epsabs=0)[0]
        first += quad(lambda z: (top - z) * slope(z), a, b, epsrel=1e-12, epsabs=0)[0]
    return below + first / (top - base), rise / (top - base)


@pytest.mark.parametrize("reynolds", [1e-3, 0.3, 5.0, 40.0, 500.0, 2000.0, 1e9, 1e20])
@pytest.mark.parametrize("ratio", [1 / 60, 1 / 10])
def test_the_profile_is_the_integral_of_its_shear(
    reynolds: float, ratio: float
) -> None:
    base = np.array(ratio * reynolds)
    moved = shift(30 * base)
    exact = _by_quadrature(float(base), float(base + reynolds), float(moved))
    np.testing.assert_allclose(layer(base, base + reynolds, moved), exact, rtol=1e-9)


def test_far_from_the_wall_the_shear_is_that_of_the_logarithm() -> None:
    assert float(shear(np.array(1e4))) == pytest.approx(1 / (KARMAN * 1e4), rel=2e-4)


def test_the_shift_of_a_smooth_wall_is_none_and_it_sets_in_continuously() -> None:
    assert not np.any(shift(np.linspace(0, 4.5, 50)))
    assert 0 < float(shift(np.array(4.54))) < 0.01
    assert float(shift(np.array(70.0))) == pytest.approx(0.9 * np.sqrt(70), rel=1e-3)


def test_winds_are_those_of_the_log_law_at_1_and_10_metres() -> None:
    ustar, z0 = 0.6, 5e-3  # a rough bed: no viscosity adds to it
    found = measurable_speeds(
        ustar, roughness=z0, fluid_density=1.2, viscosity=1.5e-5, depth=np.nan
    )
    for height, name in ((1.0, "wind_1m_m_s"), (10.0, "wind_10m_m_s")):
        exact = ustar / 0.41 * np.log((height + z0) / z0)
        assert float(found[name]) == pytest.approx(exact, rel=1e-9)


def test_a_threshold_of_sand_is_a_wind_of_known_strength() -> None:
    # sand of 0.25 mm moves at about u* = 0.22 m/s; z0 = d/30
    wind = log_law_speed(0.22, np.array([1.0, 10.0]), 2.5e-4 / 30)
    np.testing.assert_allclose(wind, 0.22 / 0.41 * np.log([120001, 1200001]))
    assert np.all((wind > 6) & (wind < 8))


def test_law_of_the_wall_is_linear_at_a_smooth_wall_and_logarithmic_far_from_it() -> (
    None
):
    smooth = np.array(0.0)
    np.testing.assert_allclose(
        law_of_the_wall(np.array([1e-4, 1e-2, 0.1]), smooth),
        [1e-4, 1e-2, 0.1],
        rtol=0.02,
    )
    y = np.array([200.0, 1e4, 1e6])
    np.testing.assert_allclose(
        law_of_the_wall(y, smooth), np.log(y) / KARMAN + 5.6, rtol=0.01
    )


def test_law_of_the_wall_is_near_van_driests_profile() -> None:
    # of thin layers about each height
    y = np.geomspace(0.5, 1e4, 30)
    van_driest, _ = layer(0.99 * y, 1.01 * y, np.array(0.0))
    np.testing.assert_allclose(law_of_the_wall(y, np.array(0.0)), van_driest, rtol=0.07)


@pytest.mark.parametrize(
    ("k", "level"),
    [
        (0.1, -0.25),
        (1.0, 5.5),
        (3.0, 8.24),
        (10.0, 9.58),
        (30.0, 9.11),
        (100.0, 8.48),
        (1e4, 8.48),
    ],
)
def test_roughness_lowers_the_law_of_the_wall_as_nikuradse_has_it(
    k: float, level: float
) -> None:
    # J. Nikuradse, VDI-Forschungsheft 361, 1933: u/u* = 2.5 ln(z/k_s) + level for sand of k_s
    y = 1e3 * max(k, 1.0)
    far = float(law_of_the_wall(np.array(y), np.array(k)))
    assert far - np.log(y / k) / KARMAN == pytest.approx(level, abs=0.45)
