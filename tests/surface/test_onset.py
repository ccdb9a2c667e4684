"""Where a bed in three dimensions moves: slopes, headings, shares and hours."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.physics import rolling
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import PEAK
from orchestrator.physics.threshold import thresholds_of
from orchestrator.surface import onset
from orchestrator.surface.onset import Shares

SAND = Grain(
    diameter=5e-4,
    roughness=5e-4 / 30,
    fluid_density=1.2,
    viscosity=1.5e-5,
    lift_coefficient=1.615,
    density=2650.0,
    slope_deg=0.0,
    entrainment_angle_deg=60.0,
    gravity=9.81,
)


@given(
    slope_deg=st.floats(0.1, 60.0),
    aspect_deg=st.floats(0.0, 360.0),
    heading_deg=st.floats(0.0, 180.0),
)
def test_slope_and_heading_come_back_from_vectors(
    slope_deg: float, aspect_deg: float, heading_deg: float
) -> None:
    b, a, c = np.radians([slope_deg, aspect_deg, heading_deg])
    level = np.array([np.cos(a), np.sin(a), 0.0])
    normal = np.array([-np.sin(b) * level[0], -np.sin(b) * level[1], np.cos(b)])
    up = np.cos(b) * level + [0.0, 0.0, np.sin(b)]
    aside = np.cross(normal, up)
    tau = 2.5 * (np.cos(c) * up + np.sin(c) * aside)
    found = onset.headings_deg(normal[None], tau[None])
    assert onset.slopes_deg(normal[None])[0] == pytest.approx(slope_deg, abs=1e-6)
    assert found[0] == pytest.approx(heading_deg, abs=1e-4)


def test_a_level_face_has_the_threshold_of_a_level_bed() -> None:
    level = np.zeros(1)
    exact = thresholds_of("bridged", SAND)
    found = onset.entrained(SAND, "bridged", level, level + 90.0)
    assert found[0] == pytest.approx(float(exact.friction_velocity), rel=1e-12)


def test_grains_go_on_by_the_slope_along_the_stress() -> None:
    slopes = np.array([20.0, 20.0, 20.0])
    headings = np.array([0.0, 90.0, 180.0])
    excess = (SAND.density / SAND.fluid_density - 1) * 9.81 * SAND.diameter
    leaving = onset.entrained(SAND, "bridged", slopes, headings)
    found = onset.sustained(SAND, leaving, slopes, headings)
    grains = SAND.changed(slope_deg=[20.0, 0.0, -20.0])
    going = rolling.sustained(grains).initiation(PEAK)
    # the gust must turn the grain over its neighbours, and it must go on after that
    shields = np.maximum(leaving**2 / excess / PEAK, going)
    assert found == pytest.approx(np.sqrt(shields * excess))


def test_a_face_without_stress_never_moves() -> None:
    found = onset.undisturbed(np.array([0.3, 0.3]), np.array([0.0, 1.5]))
    assert found.tolist() == [np.inf, pytest.approx(0.2)]


def test_shares_are_those_of_the_areas() -> None:
    wind = np.array([8.0, 5.0, np.inf, 6.0])
    shares = Shares.of(wind, np.array([1.0, 2.0, 4.0, 1.0]))
    assert shares.at([4.9, 5.0, 7.0, 100.0]).tolist() == [0.0, 0.25, 0.375, 0.5]
    assert shares.wind_for(0.25) == 5.0
    assert shares.wind_for(0.26) == 6.0
    assert shares.wind_for(0.6) == np.inf


def test_hours_of_a_rose_add_up_to_a_year() -> None:
    rows = []
    for direction in (0.0, 90.0):
        for speed, share in ((2.0, 0.3), (8.0, 0.15), (14.0, 0.05)):
            rows.append((direction, direction, 0.0, speed, share))
    columns = ["first_deg", "second_deg", "second_part", "speed_m_s", "share"]
    rose = pd.DataFrame(rows, columns=columns)
    always = np.zeros(1)
    assert onset.hours({0.0: always, 90.0: always}, rose)[0] == pytest.approx(8760.0)
    winds = np.array([2.0, 2.1, 8.0, 14.0, 14.1, np.inf, np.nan])
    never = np.full(7, np.inf)
    parts = np.array([0.5, 0.2, 0.2, 0.05, 0.0, 0.0, np.nan])
    found = onset.hours({0.0: winds, 90.0: never}, rose)
    assert found == pytest.approx(8760.0 * parts, nan_ok=True)
    # a threshold twice as high is reached as one in winds half as strong
    twice = onset.hours({0.0: winds / 2, 90.0: never}, rose, 2.0)
    assert twice == pytest.approx(found, nan_ok=True)


def test_between_two_flows_the_friction_velocity_is_linear() -> None:
    """Half-way between 4 and 12 m/s the bed feels the mean of both, 6 m/s."""
    row = {"first_deg": 0.0, "second_deg": 90.0, "second_part": 0.5, "share": 1.0}
    winds = {0.0: np.array([4.0, 4.0]), 90.0: np.array([12.0, np.inf])}
    for speed, hours in ((5.9, [0, 0]), (6.1, [8760, 0]), (8.1, [8760, 8760])):
        rose = pd.DataFrame([{**row, "speed_m_s": speed}])
        assert onset.hours(winds, rose).tolist() == hours
