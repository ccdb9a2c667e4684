"""Grain that go on against exact answers: vacuum, terminal speed, linear drag, rebounds."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from orchestrator.physics import cessation, saltation
from orchestrator.physics.cessation import tabulated
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import CLIFT_GAUVIN
from orchestrator.physics.rebound import BEADS, Rebound, on_layer
from orchestrator.physics.saltation import (
    ENDLESS,
    GOES_ON,
    STOPS,
    Gust,
    fate,
    least,
    submerged,
    thresholds,
    under_gust,
)
from orchestrator.types import FloatArray

NO_FLOW = 1e-14
"""A Shields number whose flow moves nothing."""
AIR = {"density": 2650.0, "fluid_density": 1.2, "viscosity": 1.5e-5}
WATER = {"density": 2650.0, "fluid_density": 1000.0, "viscosity": 1e-6}
QUICK = settings(max_examples=20, deadline=None)


@dataclass(frozen=True)
class Recorded(Rebound):
    """A rebound that keeps a list of its impacts: speed, and sine of the angle."""

    impacts: list[tuple[float, float]] = field(default_factory=list)

    def after(
        self, speed: FloatArray, sine: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        self.impacts.append((float(speed[0]), float(sine[0])))
        return super().after(speed, sine)


def first_impact(grain: Grain, speed: float, angle_deg: float) -> tuple[float, float]:
    """Speed and sine of the angle of the first impact in still fluid."""
    # nothing is left of the speed after the rebound, so that the grain stops
    dead = Recorded(whole=(0.0, 0.0), normal=(0.0, 0.0), trapped=0.1, level=0.7)
    assert (
        fate(grain, NO_FLOW, speed=speed, angle_deg=angle_deg, rebound=dead)[0] == STOPS
    )
    return dead.impacts[-1]


@given(speed=st.floats(0.1, 50), angle_deg=st.floats(5, 90))
@QUICK
def test_a_grain_falls_in_vacuum_as_fast_as_it_rose(
    speed: float, angle_deg: float
) -> None:
    fell, sine = first_impact(Grain.of_numbers(1.0, 1e18), speed, angle_deg)
    assert fell == pytest.approx(speed, rel=1e-6)
    assert sine == pytest.approx(np.sin(np.radians(angle_deg)), rel=1e-6)


@given(slope_deg=st.floats(-30, 30), angle_deg=st.floats(20, 90))
@QUICK
def test_gravity_is_tilted_by_the_slope(slope_deg: float, angle_deg: float) -> None:
    # in vacuum a flight takes 2 v_z/cos, in which the speed along the bed falls by sin times it
    slope, angle = np.radians([slope_deg, angle_deg])
    along = np.cos(angle) - 2 * np.sin(angle) * np.tan(slope)
    fell, sine = first_impact(
        Grain.of_numbers(1.0, 1e18, slope_deg=slope_deg), 1.0, angle_deg
    )
    assert fell == pytest.approx(np.hypot(along, np.sin(angle)), rel=1e-6)
    assert fell * sine == pytest.approx(np.sin(angle), rel=1e-6)


@pytest.mark.parametrize(
    ("galileo", "ratio"), [(5.0, 2.65), (127.0, 2.65), (40.0, 50.0)]
)
def test_a_long_fall_ends_at_the_terminal_speed(galileo: float, ratio: float) -> None:
    nu = np.sqrt(ratio) / galileo

    def balance(speed: float) -> float:
        factor = float(CLIFT_GAUVIN.factor(np.array(speed / nu)))
        return float(18 * nu * speed * factor / ratio - 1)

    settling = brentq(balance, 1e-6, 1e3)
    fell, sine = first_impact(Grain.of_numbers(galileo, ratio), 300.0, 90.0)
    assert fell == pytest.approx(settling, rel=1e-4)
    assert sine == pytest.approx(1.0)


@pytest.mark.parametrize("rise", [0.1, 1.0, 5.0])
def test_a_flight_under_linear_drag_is_the_analytic_one(rise: float) -> None:
    # so viscous that the drag is that of Stokes, 18 nu/(s + 1/2)
    galileo, s = 0.03, 1e5
    pull = 18 * np.sqrt(s) / galileo / (s + 0.5)
    weight = s / (s + 0.5)

    def height(time: float) -> float:
        fall = weight / pull
        rise_in_drag = (rise + fall) / pull * -np.expm1(-pull * time)
        return float(rise_in_drag - fall * time)

    landing = brentq(height, rise / weight / 2, 10 * rise)
    decay = np.exp(-pull * landing)
    normal = -weight / pull + (rise + weight / pull) * decay
    fell, sine = first_impact(Grain.of_numbers(galileo, s), rise * np.sqrt(2), 45.0)
    assert fell == pytest.approx(np.hypot(rise * decay, normal), rel=5e-3)
    assert fell * sine == pytest.approx(-normal, rel=5e-3)


def test_elastic_rebounds_in_vacuum_keep_their_energy() -> None:
    elastic = Recorded(whole=(1.0, 0.0), normal=(0.0, -1.0), trapped=1e-3, level=0.7)
    hops = fate(
        Grain.of_numbers(1.0, 1e18), NO_FLOW, speed=2.0, angle_deg=35.0, rebound=elastic
    )
    speeds, sines = np.array(elastic.impacts).T
    assert hops[0] == GOES_ON
    assert len(speeds) > saltation.ALIKE
    np.testing.assert_allclose(speeds, 2.0, rtol=1e-6)
    np.testing.assert_allclose(sines, np.sin(np.radians(35.0)), rtol=1e-6)


@given(speed=st.floats(0.1, 100), sine=st.floats(0, 1))
def test_a_rebound_loses_energy_and_leaves_the_bed(speed: float, sine: float) -> None:
    whole, normal = BEADS.after(np.array([speed]), np.array([sine]))
    assert 0 <= normal[0] <= whole[0] < speed


def test_the_rebound_law_is_near_the_beads_that_were_shot() -> None:
    # Beladjine et al. 2007, beads of 6 mm at 26 m/s: angle in, angle out (degrees), speeds' ratio
    shot = np.array(
        [(10, 21.21, 0.77), (20, 26.68, 0.61), (40, 33.87, 0.43), (60, 40.94, 0.26)]
    )
    into, out, ratio = shot.T
    whole, normal = BEADS.after(np.ones(4), np.sin(np.radians(into)))
    np.testing.assert_allclose(whole, ratio, atol=0.03)
    np.testing.assert_allclose(normal, ratio * np.sin(np.radians(out)), atol=0.04)


def test_a_grain_stops_in_still_water() -> None:
    assert fate(Grain.of_numbers(127.0, 2.65), NO_FLOW)[0] == STOPS


def test_a_trajectory_without_an_end_has_no_threshold(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(saltation, "MOST_STEPS", 20)
    grain = Grain.of_numbers(127.0, 2.65)
    assert fate(grain, 1.0)[0] == ENDLESS
    assert np.isnan(thresholds(grain).steady[0])


def test_what_no_flow_reaches_is_infinite() -> None:
    syrup = thresholds(Grain.of_numbers(1e-3, 2.65))
    assert syrup.steady[0] == np.inf
    assert syrup.cessation[0] == np.inf
    assert thresholds(Grain.of_numbers(127.0, 2.65, slope_deg=-80.0)).cessation[0] == 0


@pytest.mark.long
def test_thresholds_converge_with_the_time_step() -> None:
    # 0.3 mm in air, 1 and 5 mm in water
    grains = Grain.of_numbers([51.0, 127.0, 1423.0], [2208.0, 2.65, 2.65])
    coarse, fine = thresholds(grains), thresholds(grains, steps=3 * saltation.STEPS)
    np.testing.assert_allclose(coarse.steady, fine.steady, rtol=5e-3)
    np.testing.assert_allclose(coarse.cessation, fine.cessation, rtol=2e-2)


def test_the_angle_at_which_a_grain_leaves_hardly_matters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    grains = Grain(diameter=[1e-4, 5e-4], **AIR)
    usual = thresholds(grains).steady
    for angle_deg in (20.0, 60.0):
        monkeypatch.setattr(saltation, "LAUNCH_DEG", angle_deg)
        monkeypatch.setattr(
            saltation,
            "fate",
            lambda *given, angle=angle_deg, **how: fate(
                *given, **{"angle_deg": angle, **how}
            ),
        )
        np.testing.assert_allclose(thresholds(grains).steady, usual, rtol=2e-2)


@pytest.mark.long
def test_answers_are_those_of_an_independent_computation() -> None:
    # made with another program on a grid of 7 %, which is right to that
    d = np.array([0.1, 0.2, 0.3, 0.5, 1.0]) * 1e-3
    air = Grain(diameter=d, **AIR)
    grid = 0.08
    peak = 2.28
    in_gusts = {
        3.0: [0.035, 0.024, 0.019, 0.017, 0.020],
        10.0: [0.027, 0.017, 0.014, 0.012, 0.016],
        30.0: [0.020, 0.014, 0.012, 0.010, 0.013],
    }
    for duration, shields in in_gusts.items():
        np.testing.assert_allclose(under_gust(air, peak, duration), shields, rtol=grid)
    steady = thresholds(air).steady
    np.testing.assert_allclose(steady, [0.045, 0.032, 0.024, 0.020, 0.022], rtol=grid)
    water = Grain(diameter=np.array([0.5, 1.0, 2.0, 5.0]) * 1e-3, **WATER)
    of_water = [0.045, 0.032, 0.038, 0.054]
    np.testing.assert_allclose(thresholds(water).cessation, of_water, rtol=grid)
    np.testing.assert_allclose(under_gust(water, peak, 10.0), of_water, rtol=grid)


def test_thresholds_have_not_changed() -> None:
    grains = Grain.of_numbers(
        [27.75, 109.7, 127.2, 1423.0], [2208.3, 2208.3, 2.65, 2.65]
    )
    found = thresholds(grains)
    np.testing.assert_allclose(
        found.steady, [0.0313, 0.0206, 0.0327, 0.0550], rtol=5e-3
    )
    np.testing.assert_allclose(
        found.cessation, [0.0056, 0.0068, 0.0327, 0.0550], rtol=1e-2
    )


@pytest.mark.long
def test_a_gust_that_lasts_long_gives_the_limit() -> None:
    air = Grain(diameter=np.array([2e-4, 5e-4]), **AIR)
    found = thresholds(air)
    limit = np.maximum(found.steady / 2.28, found.cessation)
    np.testing.assert_allclose(under_gust(air, 2.28, 300.0), limit, rtol=2e-2)
    shorter = [under_gust(air, 2.28, duration) for duration in (3.0, 10.0, 300.0)]
    assert np.all(np.diff(shorter, axis=0) < 1e-4)


def test_a_gust_of_no_duration_is_none() -> None:
    grains = Grain.of_numbers([30.0, 127.0], [2208.0, 2.65])
    steady = thresholds(grains).steady
    np.testing.assert_allclose(under_gust(grains, 3.0, 0.0), steady)
    for part, said in ((0.98, STOPS), (1.02, GOES_ON)):
        assert np.all(
            fate(grains, part * steady, gust=Gust(peak=1.0, duration=5.0)) == said
        )


def some_grains(seed: int, least_galileo: float = 1.0) -> Grain:
    """Forty level and sloping grains within the table."""
    random = np.random.default_rng(seed)
    return Grain.of_numbers(
        np.exp(random.uniform(np.log(least_galileo), np.log(1e4), 40)),
        np.exp(random.uniform(np.log(1.5), np.log(1e4), 40)),
        slope_deg=random.uniform(-20, 20, 40),
    )


@given(seed=st.integers(0, 1000))
@QUICK
def test_thresholds_are_ordered(seed: int) -> None:
    found = tabulated(some_grains(seed))
    assert np.all(found.cessation <= found.steady * 1.001)


@given(seed=st.integers(0, 1000))
@QUICK
def test_a_steeper_bed_needs_more_and_a_denser_grain_less(seed: int) -> None:
    grains = some_grains(seed, least_galileo=5.0)
    usual = tabulated(grains)
    steeper = tabulated(grains.changed(slope_deg=grains.slope_deg + 5))
    denser = tabulated(
        Grain.of_numbers(
            grains.galileo, 2 * grains.density_ratio, slope_deg=grains.slope_deg
        )
    )
    assert np.all(steeper.steady > usual.steady)
    assert np.all(denser.steady < 1.005 * usual.steady)
    assert np.all(denser.cessation < 1.005 * usual.cessation)


def test_what_traps_more_needs_more() -> None:
    grains = Grain.of_numbers([5.0, 127.0], [2.65, 2.65])
    levels = [
        Rebound(BEADS.whole, BEADS.normal, energy, 0.7) for energy in (0.05, 0.12, 0.18)
    ]
    steady = np.array([thresholds(grains, rebound=each).steady for each in levels])
    assert np.all(np.diff(steady, axis=0) > 0)


@pytest.mark.long
def test_the_slope_law_is_that_of_a_friction_angle() -> None:
    # cos a + sin a/tan(phi), with the phi of natural sand, none of which was put in
    slopes_deg = np.array([-20.0, -10.0, 0.0, 10.0, 20.0])
    slopes = np.radians(slopes_deg)
    for d, fluid in ((2.5e-4, AIR), (5e-4, AIR), (1e-3, WATER), (5e-3, WATER)):
        steady = thresholds(Grain(diameter=d, slope_deg=slopes_deg, **fluid)).steady
        ratio = steady / steady[2]
        usual = [
            np.cos(slopes) + np.sin(slopes) / np.tan(np.radians(phi))
            for phi in (32.0, 50.0)
        ]
        assert np.all(ratio[slopes > 0] < usual[0][slopes > 0])
        assert np.all(ratio[slopes < 0] > usual[0][slopes < 0])
        assert np.all(ratio[slopes > 0] > usual[1][slopes > 0])
        assert np.all(ratio[slopes < 0] < usual[1][slopes < 0])


def test_numbers_of_grains_are_those_of_their_definition() -> None:
    grains = Grain(diameter=[1e-3, 2e-3], **WATER, roughness=1e-4, slope_deg=[0.0, 5.0])
    np.testing.assert_allclose(
        grains.galileo, np.sqrt(1.65 * 9.81 * np.array([1, 8]) * 1e-9) / 1e-6
    )
    np.testing.assert_allclose(grains.ratio, [0.1, 0.05])
    assert grains.density_ratio.tolist() == [2.65, 2.65]
    assert len(grains.at(np.array([True, False]))) == 1


def test_the_table_interpolates_within_two_percent() -> None:
    random = np.random.default_rng(1)
    grains = Grain.of_numbers(
        np.exp(random.uniform(np.log(1.0), np.log(5e4), 60)),
        np.exp(random.uniform(np.log(1.5), np.log(5e4), 60)),
        slope_deg=random.uniform(-25, 30, 60),
    )
    direct, table = thresholds(grains), tabulated(grains)
    np.testing.assert_allclose(table.steady, direct.steady, rtol=2e-2)
    off = np.abs(np.log(table.cessation / direct.cessation))
    assert np.median(off) < 5e-3
    assert np.quantile(off, 0.9) < 2e-2


def test_the_table_has_the_nodes_that_are_computed() -> None:
    nodes = (
        cessation.GALILEO_NODES,
        cessation.DENSITY_NODES,
        cessation.SLOPE_NODES_DEG,
    )
    galileo, ratio, slope = (axis[[2, 6, -1, 11]] for axis in nodes)
    grains = Grain.of_numbers(galileo, ratio, slope_deg=slope)
    direct, table = thresholds(grains), tabulated(grains)
    np.testing.assert_allclose(table.steady, direct.steady, rtol=1e-3)
    np.testing.assert_allclose(table.cessation, direct.cessation, rtol=1e-3)


def test_beyond_the_table_thresholds_are_computed() -> None:
    grains = Grain.of_numbers(
        [0.1, 127.0, 127.0], [2.65, 2.65, 1e6], ratio=[1 / 30, 1 / 10, 1 / 30]
    )
    direct, table = thresholds(grains), tabulated(grains)
    np.testing.assert_array_equal(table.steady, direct.steady)
    np.testing.assert_array_equal(table.cessation, direct.cessation)


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_a_grain_rests_on_three_others_and_rises_over_them(size: float) -> None:
    """The centres of the layer are the corners of a triangle of side 1."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])
    reach = (size + 1) / 2
    above = {}
    for name, at in {
        "pocket": corners.mean(axis=0),
        "saddle": corners[:2].mean(axis=0),
        "top": corners[0],
    }.items():
        away = np.linalg.norm(corners - at, axis=1)
        above[name] = np.sqrt(reach**2 - away.min() ** 2)
    rest, barrier = on_layer(np.array(size))
    assert rest == pytest.approx(above["pocket"], rel=1e-12)
    rise = (above["saddle"] + above["top"]) / 2 - above["pocket"]
    assert barrier == pytest.approx(rise / size, rel=1e-12)


def test_a_sphere_is_submerged_by_parts_that_add_up() -> None:
    top = np.linspace(-0.5, 0.5, 2001)
    area, volume = submerged(top)
    # the volume is the integral of the discs, and half of either is below the middle
    disc = np.pi * (0.25 - top**2)
    summed = np.cumsum((disc[1:] + disc[:-1]) / 2 * np.diff(top)) / (np.pi / 6)
    np.testing.assert_allclose(volume[1:], summed, atol=1e-6)
    chord = 2 * np.sqrt(0.25 - top**2)
    covered = np.cumsum((chord[1:] + chord[:-1]) / 2 * np.diff(top)) / (np.pi / 4)
    np.testing.assert_allclose(area[1:], covered, atol=1e-4)
    assert (area[1000], volume[1000]) == pytest.approx((0.5, 0.5))


def test_grains_in_a_shallow_flow_need_more_stress_and_in_a_deep_one_as_much() -> None:
    falls = np.array([0.0, 1e-6, 0.02, 0.2])
    found = thresholds(Grain.of_numbers(5000.0, 2.65, fall=falls)).cessation
    assert found[1] == pytest.approx(found[0], rel=1e-3)
    assert (np.diff(found[1:]) > 0).all()


def test_alike_grains_beyond_the_table_are_followed_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    counts = []

    def followed(grains: Grain) -> saltation.HoppingThresholds:
        counts.append(len(grains))
        size = np.asarray(grains.galileo)
        return saltation.HoppingThresholds(size, 2 * size)

    monkeypatch.setattr(cessation, "thresholds", followed)
    rough = Grain.of_numbers([40.0, 50.0, 40.0, 40.0], 2208.0, ratio=0.0917)
    for _ in range(2):
        found = cessation.tabulated(rough)
        assert found.steady == pytest.approx([40.0, 50.0, 40.0, 40.0])
        assert found.cessation == pytest.approx([80.0, 100.0, 80.0, 80.0])
    assert counts == [2]
    cessation._of_unlike.cache_clear()


def test_the_table_knows_zero_from_what_is_not_known() -> None:
    """Its empty nodes were grains in sustained motion in any flow."""
    steep = Grain.of_numbers([500.0, 500.0], [1e5, 9e4], slope_deg=[-30.0, -29.0])
    found = tabulated(steep)
    assert np.isfinite([found.steady, found.cessation]).all()
    assert found.cessation[0] == 0
    endless = least(steep, lambda g, theta: np.full(len(g), ENDLESS))
    assert np.isnan(endless).all()


def test_the_table_of_roughness_is_the_trajectories(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At nodes to the digits that are written, between them to some per cent."""
    places = (12, 4, 5), (20, 11, 9), (17, 11, 13), (6, 2, 0)
    galileo, density, ratio = np.array(
        [
            (
                cessation.OTHER_GALILEO_NODES[one],
                cessation.OTHER_DENSITY_NODES[two],
                cessation.RATIO_NODES[three],
            )
            for one, two, three in places
        ]
    ).T
    nodes = Grain.of_numbers(galileo, density, ratio=ratio)
    written = np.exp(
        cessation._other_table()(np.log(np.column_stack([galileo, density, ratio])))
    )
    followed = saltation.cessation_thresholds(nodes)
    np.testing.assert_allclose(written, followed, rtol=2e-3)
    between = Grain.of_numbers(
        [55.0, 130.0, 900.0, 40.0],
        [2.65, 2.65, 2.65, 2208.0],
        ratio=[0.004, 0.05, 0.02, 0.07],
    )
    followed = saltation.cessation_thresholds(between)
    monkeypatch.setattr(saltation, "fate", None)  # nothing is followed
    np.testing.assert_allclose(cessation.cessation(between), followed, rtol=0.03)


def test_cessation_is_the_table_of_the_usual_roughness_and_follows_beyond() -> None:
    usual = Grain.of_numbers([40.0, 127.0], [2208.0, 2.65], slope_deg=[0.0, 12.0])
    np.testing.assert_allclose(
        cessation.cessation(usual), tabulated(usual).cessation, rtol=1e-12
    )
    rough = Grain.of_numbers(127.0, 2.65, ratio=0.2)
    np.testing.assert_array_equal(
        cessation.cessation(rough), saltation.cessation_thresholds(rough)
    )
