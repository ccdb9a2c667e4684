"""Thresholds under any force law: against known values, and their invariants."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from orchestrator.physics import curves
from orchestrator.physics.exposure import Exposure
from orchestrator.physics.laws import LAWS
from orchestrator.physics.regime import LAWS_OF, regime
from orchestrator.physics.root import friction_velocity_at
from orchestrator.physics.threshold import (
    Threshold,
    pivot_resistance,
    shields_at,
    threshold,
    weight,
)
from tests.physics import closures

few = settings(max_examples=30, deadline=None)
every_law = pytest.mark.parametrize("name", LAWS)
ratios = st.floats(1 / 60, 1 / 5)
betas = st.floats(5, 60)
diameters = st.floats(3.5e-5, 2e-3)


def water(d: float, beta: float = 50, law: str = "bridged") -> Threshold:
    where = Exposure(d, d / 30, 1000.0, 1e-6)
    return threshold(LAWS[law], where, density=2650.0, slope_deg=0, entrainment_angle_deg=beta)


# computed for the specification, by another program
@pytest.mark.parametrize(
    ("d", "theta", "curve"),
    [(1e-4, 0.0701, 0.0771), (5e-4, 0.0348, 0.0308), (2e-3, 0.0410, 0.0399)],
)
def test_bridged_thresholds_in_water(d: float, theta: float, curve: float) -> None:
    assert float(water(d).shields) == pytest.approx(theta, abs=5e-5)
    dstar = np.array(d * (1.65 * 9.81 / 1e-12) ** (1 / 3))
    assert float(curves.soulsby_whitehouse(dstar)) == pytest.approx(curve, abs=5e-5)


@pytest.mark.parametrize(("d", "theta", "reynolds"), [(1e-4, 0.0499, 3.5), (5e-4, 0.0362, 33.3)])
def test_bridged_thresholds_in_air(d: float, theta: float, reynolds: float) -> None:
    found = threshold(
        LAWS["bridged"],
        Exposure(d, d / 30, 1.0, 1e-5),
        density=2500.0,
        slope_deg=15,
        entrainment_angle_deg=60,
    )
    assert float(found.shields) == pytest.approx(theta, abs=5e-5)
    assert float(found.reynolds) == pytest.approx(reynolds, abs=0.05)
    assert bool(found.valid)


def test_the_bridged_curve_dips_between_the_regimes_and_is_level_below() -> None:
    reynolds = np.geomspace(1e-4, 150, 400)
    theta = shields_at(LAWS["bridged"], reynolds, roughness_ratio=1 / 30, entrainment_angle_deg=50)
    assert 10 < reynolds[np.argmin(theta)] < 30
    assert theta.min() == pytest.approx(0.0319, abs=2e-4)
    assert theta[0] == pytest.approx(0.0873, abs=2e-4)


def test_bridged_and_soulsby_whitehouse_part_below_a_reynolds_number_of_one() -> None:
    reynolds, theta = next(c for c in curves.WATER if "Soulsby" in c.name).points(2000)
    own = shields_at(LAWS["bridged"], reynolds, roughness_ratio=1 / 30, entrainment_angle_deg=50)
    ratio = own / theta
    sand = (reynolds > 1) & (reynolds < 150)
    assert 0.85 < ratio[sand].min() < ratio[sand].max() < 1.2
    assert float(np.interp(0.5, reynolds, ratio)) == pytest.approx(0.66, abs=0.01)
    assert float(np.interp(0.1, reynolds, ratio)) == pytest.approx(0.41, abs=0.01)


@pytest.mark.parametrize("closure", closures.CLOSURES)
def test_thresholds_under_eqs_2_and_4_are_those_of_the_closed_form(
    closure: closures.Closure,
) -> None:
    rng = np.random.default_rng(7)
    d, part = 10 ** rng.uniform(-4.5, -2.5, 500), rng.uniform(5, 60, 500)
    nu = 10 ** rng.uniform(-6, -3, 500)
    grain: dict[str, ArrayLike] = {
        "density": rng.uniform(1.5, 5000, 500),
        "slope_deg": rng.uniform(-20, 60, 500),
        "entrainment_angle_deg": rng.uniform(1, 60, 500),
    }
    flow: dict[str, ArrayLike] = {
        "diameter": d,
        "roughness": d / part,
        "fluid_density": 1.2,
        "viscosity": nu,
    }
    found = threshold(LAWS[closure], Exposure(**flow), **grain)
    exact = closures.threshold(closure, **flow, **grain)
    for field in ("friction_velocity", "reynolds", "shields", "drag", "lift"):
        np.testing.assert_allclose(getattr(found, field), getattr(exact, field), rtol=1e-12)
    beyond = LAWS[closure].particle_reynolds(exact.friction_velocity, Exposure(**flow)) >= 1000
    np.testing.assert_array_equal(found.valid, exact.valid & ~(beyond & (closure == "high")))


@every_law
@few
@given(d=diameters, ratio=ratios, beta=betas, slope=st.floats(0, 30), nu=st.floats(1e-6, 1e-3))
def test_moments_balance_at_the_threshold(
    name: str, d: float, ratio: float, beta: float, slope: float, nu: float
) -> None:
    law, where = LAWS[name], Exposure(d, ratio * d, 1.0, nu)
    found = threshold(law, where, density=2500.0, slope_deg=slope, entrainment_angle_deg=beta)
    b, u = np.radians(beta), found.friction_velocity
    moment = found.drag * np.sin(b) + found.lift * np.cos(b) + 2 * law.torque(u, where) / d
    resistance = weight(diameter=d, density=2500.0, fluid_density=1.0) * pivot_resistance(
        slope, beta
    )
    assert float(moment) == pytest.approx(float(resistance), rel=1e-12)
    curve = shields_at(
        law,
        found.reynolds,
        roughness_ratio=ratio,
        entrainment_angle_deg=beta,
        slope_deg=slope,
    )
    assert float(curve) == pytest.approx(float(found.shields), rel=1e-12)


@every_law
def test_an_array_of_grains_is_the_grains_one_by_one(name: str) -> None:
    d = np.array([[5e-5], [3e-4], [2e-3]])
    slope = np.array([0.0, 10.0, 25.0])
    where = {"fluid_density": 1.0, "viscosity": 1e-5}
    grain = {"density": 2500.0, "entrainment_angle_deg": 60.0}
    many = threshold(LAWS[name], Exposure(d, d / 10, **where), slope_deg=slope, **grain)
    assert many.friction_velocity.shape == many.valid.shape == many.drag.shape == (3, 3)
    for i, j in np.ndindex(3, 3):
        exposure = Exposure(d[i, 0], d[i, 0] / 10, **where)
        one = threshold(LAWS[name], exposure, slope_deg=slope[j], **grain)
        assert one.friction_velocity.shape == ()
        single = float(one.friction_velocity)
        assert float(many.friction_velocity[i, j]) == pytest.approx(single, rel=1e-14)


@every_law
@few
@given(d=diameters, ratio=ratios, beta=betas, factor=st.floats(1.05, 3))
def test_thresholds_rise_with_slope_weight_and_the_depth_of_the_pocket(
    name: str, d: float, ratio: float, beta: float, factor: float
) -> None:
    law, where = LAWS[name], Exposure(d, ratio * d, 1.0, 1e-5)
    slopes = np.linspace(0, beta, 9)
    grain = {"density": 2500.0, "entrainment_angle_deg": beta}
    up = threshold(law, where, slope_deg=slopes, **grain).friction_velocity
    assert np.all(np.diff(up) > 0)
    heavy = threshold(law, where, slope_deg=0, **{**grain, "density": 2500.0 * factor})
    assert float(heavy.friction_velocity) > up[0]
    deeper = threshold(law, where, slope_deg=0, **{**grain, "entrainment_angle_deg": beta - 4})
    assert float(deeper.friction_velocity) > up[0]


@every_law
@few
@given(d=diameters, factor=st.floats(0.1, 10), ratio=ratios, beta=betas)
def test_the_shields_number_depends_on_the_scale_through_the_reynolds_number_alone(
    name: str, d: float, factor: float, ratio: float, beta: float
) -> None:
    grain = {"density": 2500.0, "slope_deg": 10.0, "entrainment_angle_deg": beta}
    one = threshold(LAWS[name], Exposure(d, ratio * d, 1.0, 1e-5), **grain)
    # the same d^3 g/nu^2 with another diameter
    large = Exposure(factor * d, ratio * factor * d, 1.0, 1e-5 * factor**1.5)
    other = threshold(LAWS[name], large, **grain)
    assert float(other.shields) == pytest.approx(float(one.shields), rel=1e-11)
    assert float(other.reynolds) == pytest.approx(float(one.reynolds), rel=1e-11)


def test_a_torque_and_a_lift_both_lower_the_threshold() -> None:
    bare = water(3e-4, law="zeng").friction_velocity
    assert float(water(3e-4, law="zeng-torque").friction_velocity) < float(bare)
    smooth = threshold(
        LAWS["bridged"],
        Exposure(3e-4, 1e-5, 1000.0, 1e-6, 0.0),
        density=2650.0,
        slope_deg=0,
        entrainment_angle_deg=50,
    )
    assert float(water(3e-4).friction_velocity) < float(smooth.friction_velocity)


def test_without_resistance_there_is_no_threshold() -> None:
    found = threshold(
        LAWS["bridged"],
        Exposure(1e-3, 1e-4, 1000.0, 1e-6),
        density=np.array([2650.0, 900.0, 2650.0, np.nan]),
        slope_deg=np.array([-50.0, 0.0, 0.0, 0.0]),
        entrainment_angle_deg=45.0,
    )
    np.testing.assert_array_equal(np.isnan(found.shields), [True, True, False, True])
    np.testing.assert_array_equal(found.valid, [False, False, True, False])


def test_a_grain_that_no_flow_moves_has_an_infinite_threshold() -> None:
    found = threshold(
        LAWS["claudin-andreotti"],  # it has no lift, and the pocket is bottomless for a drag
        Exposure(1e-3, 1e-4, 1000.0, 1e-6),
        density=2650.0,
        slope_deg=0.0,
        entrainment_angle_deg=0.0,
    )
    assert float(found.friction_velocity) == float(found.shields) == np.inf
    assert not bool(found.valid)


def test_gravel_is_beyond_one_drag_and_within_another() -> None:
    assert not bool(water(0.02).valid)
    gravel = water(0.02, law="bridged-gravel")
    assert bool(gravel.valid)
    assert 300 < float(gravel.reynolds) < 5000


@every_law
def test_ten_thousand_grains_take_well_under_a_second(name: str) -> None:
    rng = np.random.default_rng(0)
    d = 10 ** rng.uniform(-4.5, -2.5, 10_000)
    where = Exposure(d, d * rng.uniform(1 / 60, 1 / 5, d.size), 1.0, 1e-5)
    grain = {"density": 2500.0, "slope_deg": 10.0, "entrainment_angle_deg": 50.0}
    start = time.process_time()
    found = threshold(LAWS[name], where, **grain)
    assert time.process_time() - start < 1
    assert np.all(np.isfinite(found.friction_velocity))


class TestFrictionVelocityAt:
    where = Exposure(1e-3, 1e-4, 1000.0, 1e-6)

    def test_the_local_flow_is_the_undisturbed_one_sped_up(self) -> None:
        ratio = np.array([0.5, 1.0, 1.6])
        found = friction_velocity_at(LAWS["bridged"], self.where, 1e-6, speed_up=ratio)
        np.testing.assert_allclose(found * ratio, np.full(3, found[1]), rtol=1e-14)

    def test_a_flow_that_runs_backwards_turns_drag_and_torque_but_not_lift(self) -> None:
        law, sums = LAWS["zeng-torque"], {"along": -0.8, "outward": 0.5, "turning": -100.0}
        back = friction_velocity_at(law, self.where, 1e-6, speed_up=-0.7, **sums)
        forth = friction_velocity_at(
            law, self.where, 1e-6, along=0.8, outward=0.5, turning=100.0, speed_up=0.7
        )
        assert float(back) == pytest.approx(float(forth), rel=1e-14)

    def test_what_is_never_reached_is_infinite_and_what_needs_no_flow_is_not_a_number(
        self,
    ) -> None:
        given = {"along": np.array([-1.0, 1.0, 1.0, 1.0]), "speed_up": np.array([1, 0, 1, 1.0])}
        target = np.array([1e-6, 1e-6, 0.0, -1e-6])
        found = friction_velocity_at(LAWS["bridged"], self.where, target, **given)
        np.testing.assert_array_equal(found, [np.inf, np.inf, np.nan, np.nan])

    def test_of_several_roots_it_is_the_least(self) -> None:
        # lift against drag: between Re* of about 2 and 1000 alone the lift is a quarter of the drag
        law, weights = LAWS["bridged"], {"along": -0.25, "outward": 1.0}
        flows = self.where.ustar(np.geomspace(1e-3, 1e4, 4001))
        total = law.lift(flows, self.where) - 0.25 * law.drag(flows, self.where)
        target = 0.5 * total.max()
        above = np.flatnonzero(total >= target)
        assert above[-1] < len(flows) - 1
        found = float(friction_velocity_at(law, self.where, target, **weights))
        assert flows[above[0] - 1] <= found <= flows[above[0]]

    def test_a_grain_that_is_pushed_and_lifted_goes_where_the_sum_says(self) -> None:
        law = LAWS["low"]
        found = friction_velocity_at(law, self.where, 2e-6, along=0.3, outward=0.9)
        reached = 0.3 * law.drag(found, self.where) + 0.9 * law.lift(found, self.where)
        assert float(reached) == pytest.approx(2e-6, rel=1e-14)


def test_the_regime_is_that_of_the_closures_and_gravel_is_high() -> None:
    d = np.geomspace(3e-5, 2e-2, 60)
    nu = np.array([[1e-6], [1e-5], [1e-3]])
    flow: dict[str, ArrayLike] = {
        "diameter": d,
        "roughness": d / 30,
        "fluid_density": 1.0,
        "viscosity": nu,
    }
    grain: dict[str, ArrayLike] = {
        "density": 2500.0,
        "slope_deg": 5.0,
        "entrainment_angle_deg": 60.0,
    }
    low, high = (threshold(LAWS[name], Exposure(**flow), **grain) for name in ("low", "high"))
    old = (closures.threshold(name, **flow, **grain) for name in closures.CLOSURES)
    found = regime(low, high)
    np.testing.assert_array_equal(found, closures.regime(*old))
    assert set(np.unique(found)) == set(LAWS_OF)
    assert found[1, -1] == "high"
    assert not high.valid[1, -1]
    assert all(name in LAWS for names in LAWS_OF.values() for name in names)


def test_two_regimes_at_once_are_refused() -> None:
    nothing = np.array(1.0)
    slow = Threshold(nothing, nothing, nothing, nothing, nothing, np.array(True))
    fast = Threshold(nothing, 40 * nothing, nothing, nothing, nothing, np.array(True))
    with pytest.raises(ArithmeticError):
        regime(slow, fast)
