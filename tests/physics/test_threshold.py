"""Thresholds of single grains under any force law: known values, and their invariants."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from orchestrator.errors import InputError
from orchestrator.physics import curves
from orchestrator.physics import threshold as physics
from orchestrator.physics.constants import LIFT_COEFFICIENT
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS, Bridged
from orchestrator.physics.threshold import (
    Threshold,
    check_known,
    least_ustar,
    root,
    shields_at,
    threshold,
)
from orchestrator.surface.across import threshold_across
from orchestrator.types import FloatArray, IntArray

few = settings(max_examples=30, deadline=None)
every_law = pytest.mark.parametrize("name", LAWS)
ratios = st.floats(1 / 60, 1 / 5)
betas = st.floats(5, 60)
diameters = st.floats(3.5e-5, 2e-3)

# Root of the moment balance (third of Eqs. 1) with the forces as first printed (Eq. 2; Eq. 4 with
# V_f by quadrature of the profile), by an arbitrary-precision root finder at 50 digits.
INDEPENDENT = [
    ("low", 5e-5, 0, 60, 30, 1e-5, 0.25580768642034),
    ("low", 1e-3, 0, 45, 10, 1e-3, 1.35707693484772),
    ("low", 1e-4, 30, 50, 30, 1e-3, 0.557460808643586),
    ("high", 1e-3, 0, 60, 30, 1e-5, 0.833007199705443),
    ("high", 7e-4, 15, 60, 10, 1e-5, 1.17223668827337),
    ("high", 1e-3, 20, 50, 30, 1e-5, 1.20632632568727),
]


SAND = Grain(
    diameter=1e-3,
    density=2650.0,
    roughness=1e-4,
    fluid_density=1000.0,
    viscosity=1e-6,
)
UNIT = np.full(4, SAND.ustar(1.0))
"""A grain in water, and friction velocities of four such grains at Re* = 1, m/s."""


def of_air(
    name: str, d: ArrayLike, ratio: float, alpha: ArrayLike, beta: float, nu: ArrayLike
) -> Threshold:
    grain = Grain(
        diameter=d,
        density=2500.0,
        roughness=np.multiply(ratio, d),
        fluid_density=1.0,
        viscosity=nu,
        slope_deg=alpha,
        entrainment_angle_deg=beta,
    )
    return threshold(LAWS[name], grain)


def water(d: float, beta: float = 50, law: str = "bridged") -> Threshold:
    return threshold(
        LAWS[law],
        SAND.changed(diameter=d, roughness=d / 30, entrainment_angle_deg=beta),
    )


@pytest.mark.parametrize(
    ("name", "d", "alpha", "beta", "part", "nu", "ustar"), INDEPENDENT
)
def test_threshold_is_the_root_of_the_printed_equations(
    name: str, d: float, alpha: float, beta: float, part: float, nu: float, ustar: float
) -> None:
    found = of_air(name, d, 1 / part, alpha, beta, nu)
    assert float(found.friction_velocity) == pytest.approx(ustar, rel=1e-12)


def test_bridged_thresholds_in_water_and_air() -> None:
    # computed for the specification, by another program
    for d, theta, curve in (
        (1e-4, 0.0701, 0.0771),
        (5e-4, 0.0348, 0.0308),
        (2e-3, 0.0410, 0.0399),
    ):
        assert float(water(d).shields) == pytest.approx(theta, abs=5e-5)
        dstar = np.array(d * (1.65 * 9.81 / 1e-12) ** (1 / 3))
        assert float(curves.soulsby_whitehouse(dstar)) == pytest.approx(curve, abs=5e-5)
    for d, theta, reynolds in ((1e-4, 0.0499, 3.5), (5e-4, 0.0362, 33.3)):
        found = of_air("bridged", d, 1 / 30, 15, 60, 1e-5)
        assert float(found.shields) == pytest.approx(theta, abs=5e-5)
        assert float(found.reynolds) == pytest.approx(reynolds, abs=0.05)
        assert bool(found.valid)


def test_the_bridged_curve_dips_between_the_regimes_and_leaves_soulsby_below_one() -> (
    None
):
    reynolds, theta = next(c for c in curves.WATER if "Soulsby" in c.name).points(2000)
    own = shields_at(
        LAWS["bridged"], reynolds, roughness_ratio=1 / 30, entrainment_angle_deg=50
    )
    assert 10 < reynolds[np.argmin(own)] < 30
    assert own.min() == pytest.approx(0.0319, abs=2e-4)
    ratio = own / theta
    sand = (reynolds > 1) & (reynolds < 150)
    assert 0.85 < ratio[sand].min() < ratio[sand].max() < 1.2
    assert np.interp([0.5, 0.1], reynolds, ratio) == pytest.approx(
        [0.66, 0.41], abs=0.01
    )


@every_law
@few
@given(
    d=diameters,
    ratio=ratios,
    beta=betas,
    slope=st.floats(0, 30),
    nu=st.floats(1e-6, 1e-3),
)
def test_moments_balance_at_the_threshold(
    name: str, d: float, ratio: float, beta: float, slope: float, nu: float
) -> None:
    found = of_air(name, d, ratio, slope, beta, nu)
    b = np.radians(beta)
    moment = found.drag * np.sin(b) + found.lift * np.cos(b)
    submerged = np.pi / 6 * d**3 * 2499 * 9.81
    resistance = submerged * physics.pivot_resistance(slope, beta)
    assert float(moment) == pytest.approx(float(resistance), rel=1e-12)
    angles = {"entrainment_angle_deg": beta, "slope_deg": slope}
    curve = shields_at(LAWS[name], found.reynolds, roughness_ratio=ratio, **angles)
    assert float(curve) == pytest.approx(float(found.shields), rel=1e-12)


@pytest.mark.parametrize("beta", [45.0, 52.0, 60.0, 75.0])
def test_the_pull_of_the_contact_that_opens_has_its_arm(beta: float) -> None:
    """F_a sin(2 beta): at 60 degrees alone that is F_a sin(beta)."""
    d, slope, cohesion = 2e-4, 12.0, 3e-4
    grain = Grain(
        diameter=d,
        density=2650.0,
        fluid_density=1.2,
        viscosity=1.5e-5,
        slope_deg=slope,
        entrainment_angle_deg=beta,
        cohesion=cohesion,
    )
    found = physics.threshold(LAWS["bridged"], grain)
    b = np.radians(beta)
    moment = float(found.drag * np.sin(b) + found.lift * np.cos(b))
    of_weight = np.pi / 6 * d**3 * (2650 - 1.2) * 9.81 * np.cos(np.radians(slope) - b)
    # two spheres touch at each side: the arm of the pull is d sin(beta) cos(beta)
    assert moment - of_weight == pytest.approx(
        2 * cohesion * d * np.sin(b) * np.cos(b), rel=1e-9
    )


@every_law
def test_an_array_of_grains_is_its_grains_in_turn(name: str) -> None:
    d, slope = np.array([[5e-5], [3e-4], [2e-3]]), np.array([0.0, 10.0, 25.0])
    many = of_air(name, d, 0.1, slope, 60, 1e-5)
    assert many.friction_velocity.shape == many.valid.shape == many.drag.shape == (3, 3)
    for i, j in np.ndindex(3, 3):
        single = of_air(
            name, float(d[i, 0]), 0.1, float(slope[j]), 60, 1e-5
        ).friction_velocity
        assert float(many.friction_velocity[i, j]) == pytest.approx(
            float(single), rel=1e-14
        )


@every_law
@few
@given(d=diameters, ratio=ratios, beta=betas, factor=st.floats(1.05, 3))
def test_thresholds_rise_with_slope_weight_and_the_depth_of_the_pocket(
    name: str, d: float, ratio: float, beta: float, factor: float
) -> None:
    slopes = np.linspace(0, beta, 9)
    up = of_air(name, d, ratio, slopes, beta, 1e-5).friction_velocity
    assert np.all(np.diff(up) > 0)
    grain = Grain(
        diameter=d,
        density=2500.0 * factor,
        roughness=ratio * d,
        fluid_density=1.0,
        viscosity=1e-5,
        entrainment_angle_deg=beta,
    )
    heavy = threshold(LAWS[name], grain)
    assert float(heavy.friction_velocity) > up[0]
    assert float(of_air(name, d, ratio, 0, beta - 4, 1e-5).friction_velocity) > up[0]


def test_without_resistance_a_grain_moves_at_once() -> None:
    found = threshold(
        LAWS["bridged"],
        SAND.changed(
            density=np.array([2650.0, 900.0, 2650.0, np.nan]),
            slope_deg=np.array([-50.0, 0.0, 0.0, 0.0]),
            entrainment_angle_deg=45.0,
        ),
    )
    ustar = found.friction_velocity
    np.testing.assert_array_equal(ustar == 0, [True, True, False, False])
    np.testing.assert_array_equal(np.isnan(ustar), [False, False, False, True])
    np.testing.assert_array_equal(found.valid, [False, False, True, False])


@every_law
def test_a_grain_without_resistance_moves_at_once_under_any_law(name: str) -> None:
    found = of_air(name, 1e-3, 0.1, -60.0, 45.0, 1e-5)
    assert float(found.friction_velocity) == float(found.drag) == 0
    assert not bool(found.valid)


def test_a_grain_that_no_flow_moves_has_an_infinite_threshold() -> None:
    # a grain without lift, in a pocket that is bottomless for a drag
    grain = SAND.changed(lift_coefficient=0.0, entrainment_angle_deg=0)
    found = threshold(LAWS["bridged"], grain)
    assert float(found.friction_velocity) == float(found.shields) == np.inf
    assert not bool(found.valid)


def test_a_lift_beyond_the_weight_ends_the_pivot() -> None:
    """Up a slope the lift can pass the weight before the drag turns the grain."""
    for lift, reason in ((10.0, "lift over the weight"), (1.615, "")):
        grain = Grain(
            diameter=5e-4,
            density=2650.0,
            fluid_density=1.2,
            viscosity=1.5e-5,
            slope_deg=20,
            entrainment_angle_deg=50,
            lift_coefficient=lift,
        )
        found = threshold(LAWS["bridged"], grain)
        assert bool(found.valid) == (not reason)
        (texts,) = physics.why_not(LAWS["bridged"], found.friction_velocity, grain)
        assert physics.why_not(
            LAWS["bridged"], found.friction_velocity, grain, lifts=False
        ) == [[]]
        assert reason in "".join(texts)
        assert bool(texts) == bool(reason)


def test_a_small_grain_hides_between_its_neighbours() -> None:
    # between neighbours that touch the top of a grain of d/4 is level with theirs
    assert float(physics.standing_out(0.25, 60.0)) == pytest.approx(0, abs=1e-12)
    assert float(physics.standing_out(1.0, 60.0)) == pytest.approx(np.sqrt(0.75))
    sizes = np.array([0.1, 0.2, 0.5, 1.0, 3.0, 10.0])
    assert np.all(np.diff(physics.standing_out(sizes, 60.0)) > 0)


def test_unreached_is_infinite_and_no_need_of_flow_is_zero() -> None:
    along = np.array([-1.0, 0.0, 1.0, 1.0])
    target = np.array([1e-6, 1e-6, 0.0, -1e-6])

    def excess(ustar: FloatArray, at: IntArray) -> FloatArray:
        return np.asarray(LAWS["bridged"].drag(ustar, SAND) * along[at] - target[at])

    np.testing.assert_array_equal(least_ustar(excess, UNIT), [np.inf, np.inf, 0, 0])


def test_of_several_roots_it_is_the_least() -> None:
    # lift against drag: the lift is above a quarter of the drag for Re* of about 2 to 1000
    law = LAWS["bridged"]
    flows = SAND.ustar(np.geomspace(1e-3, 1e4, 4001))

    def total(ustar: FloatArray) -> FloatArray:
        return np.asarray(law.lift(ustar, SAND) - 0.25 * law.drag(ustar, SAND))

    target = 0.5 * total(flows).max()
    above = np.flatnonzero(total(flows) >= target)
    assert above[-1] < len(flows) - 1
    (found,) = least_ustar(lambda ustar, at: total(ustar) - target, UNIT[:1])
    assert flows[above[0] - 1] <= found <= flows[above[0]]


def test_the_regime_is_that_of_the_ranges_of_eqs_2_and_4_and_gravel_is_high() -> None:
    d, nu = np.geomspace(3e-5, 2e-2, 60), np.array([[1e-6], [1e-5], [1e-3]])
    low, high = (of_air(name, d, 1 / 30, 5.0, 60.0, nu) for name in ("low", "high"))
    found = physics.regime(low, high)
    np.testing.assert_array_equal(found == "low", low.reynolds < 3)
    np.testing.assert_array_equal(found == "high", high.reynolds >= 30)
    assert (found[1, -1], bool(high.valid[1, -1])) == ("high", False)


def test_eq_3_in_its_printed_form() -> None:
    ratio = 0.1
    alpha = np.radians(20)
    beta = np.radians(50)
    found = of_air("low", 1e-4, ratio, 20.0, 50.0, 1e-3)
    geometry = 1 + 2 * ratio
    lift = LIFT_COEFFICIENT / 2 * found.reynolds * geometry
    weight = np.pi / 6 * (np.sin(alpha) * np.tan(beta) + np.cos(alpha))
    printed = weight / (1.5 * np.pi * geometry * np.tan(beta) + lift)
    assert float(found.shields) == pytest.approx(float(printed), rel=1e-12)


@given(beta=betas, lean=st.floats(0, 60))
def test_the_resistance_of_a_pivot_is_symmetric_about_the_entrainment_angle(
    beta: float, lean: float
) -> None:
    up = physics.pivot_resistance(beta + lean, beta)
    down = physics.pivot_resistance(beta - lean, beta)
    assert float(up) == pytest.approx(float(down), rel=1e-12)


def test_a_lift_lowers_the_threshold() -> None:
    grain = SAND.changed(diameter=3e-4, roughness=1e-5, entrainment_angle_deg=50)
    without_lift = threshold(LAWS["bridged"], grain.changed(lift_coefficient=0.0))
    lifted = water(3e-4).friction_velocity
    assert float(lifted) < float(without_lift.friction_velocity)


def test_a_root_that_is_not_found_is_not_known() -> None:
    """The last place tried was told as the root."""
    target = np.array([0.5, 8.0, 100.0])

    def cubes(x: FloatArray, at: IntArray) -> FloatArray:
        return np.where(x > 1.5, np.nan, x**3 - target[at])

    found = root(cubes, np.zeros(3), np.array([1.0, 4.0, 1.0]))
    assert found[0] == pytest.approx(0.5 ** (1 / 3), rel=1e-12)
    assert np.isnan(found[1:]).all()


class Blind(Bridged):
    """A law that does not know its drag above a friction velocity."""

    def drag(self, ustar: ArrayLike, at: Grain) -> FloatArray:
        u = np.asarray(ustar, float)
        return np.asarray(np.where(u > 0.2, np.nan, super().drag(u, at)))


def test_what_a_law_does_not_know_is_neither_never_nor_at_once() -> None:
    sand = SAND.changed(fluid_density=1.2, viscosity=1.5e-5, entrainment_angle_deg=60.0)
    slopes = np.array([0.0, -29.9, -40.0])  # not known, known, at once
    law = Blind()
    along = threshold(law, sand.changed(slope_deg=slopes)).friction_velocity
    across = threshold_across(law, sand.changed(slope_deg=-slopes), 180.0)
    for found in (along, across):
        assert np.isnan(found[0])
        assert 0 < found[1] < 0.2
        assert found[2] == 0
        with pytest.raises(InputError, match="from which flow 1 of 3 leave"):
            check_known(found, "blind")
        check_known(found[1:], "blind")


def test_the_numbers_of_grains_cannot_be_written() -> None:
    sizes = np.array([1e-3, 2e-3])
    water = np.full(2, 1000.0)
    grains = Grain(diameter=sizes, fluid_density=water, viscosity=1e-6)
    for numbers in (grains.diameter, grains.viscosity):
        with pytest.raises(ValueError, match="read-only"):
            numbers[0] = 1.0
    sizes[0] = 1.0  # that of whoever gave it can


def test_a_grain_on_another_bed_has_the_gap_of_that_bed() -> None:
    rougher = SAND.changed(roughness=2e-4)
    assert float(rougher.gap) == 2e-4
    assert float(rougher.changed(diameter=2e-3).gap) == 2e-4
    assert float(SAND.changed(roughness=2e-4, gap=1e-5).gap) == 1e-5
