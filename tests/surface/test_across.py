"""Tests of thresholds under a stress at an angle to the slope, against exact answers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orchestrator.physics.constants import LIFT_COEFFICIENT
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import threshold
from orchestrator.surface.across import slope_along_deg, threshold_across

SAND: dict[str, float] = {"density": 2650.0, "entrainment_angle_deg": 55.0}
REPOSE_DEG = 35.0
"""Slope at which the grains of `SAND` roll by themselves, 90 degrees less the angle."""
ROUGH = [name for name in LAWS if name != "low"]


def grain(lift: float = LIFT_COEFFICIENT) -> Grain:
    return Grain(
        diameter=1e-3,
        roughness=1e-3 / 30,
        fluid_density=1000.0,
        viscosity=1e-6,
        lift_coefficient=lift,
        **SAND,
    )


@pytest.mark.parametrize("name", ROUGH)
@pytest.mark.parametrize("cohesion", [0.0, 1e-3])
@pytest.mark.parametrize("heading_deg", [0.0, 180.0])
def test_along_the_slope_it_is_the_threshold_of_the_pivot(
    name: str, cohesion: float, heading_deg: float
) -> None:
    slopes = np.linspace(0.0, REPOSE_DEG - 0.5, 40)
    signed = slopes if heading_deg == 0 else -slopes
    sand = grain().changed(cohesion=cohesion)
    found = threshold_across(LAWS[name], sand.changed(slope_deg=slopes), heading_deg)
    exact = threshold(LAWS[name], sand.changed(slope_deg=signed)).friction_velocity
    assert np.abs(found / exact - 1).max() < 1e-12


@given(
    slope_deg=st.floats(0.0, REPOSE_DEG - 0.01),
    heading_deg=st.floats(-180.0, 180.0),
)
def test_without_lift_the_drag_is_that_of_brooks(
    slope_deg: float, heading_deg: float
) -> None:
    law = LAWS["bridged"]
    at = grain(lift=0.0)
    slopes = [0.0, slope_deg]
    ustar = threshold_across(law, at.changed(slope_deg=slopes), heading_deg)
    on_level, on_slope = law.drag(ustar, at)
    b, c, p = np.radians([slope_deg, heading_deg, REPOSE_DEG])
    under = np.cos(b) ** 2 - (np.sin(c) * np.sin(b) / np.tan(p)) ** 2
    brooks = np.cos(c) * np.sin(b) / np.tan(p) + np.sqrt(under)
    assert on_slope / on_level == pytest.approx(brooks, rel=1e-9, abs=1e-9)


@given(slope_deg=st.floats(0.1, REPOSE_DEG - 0.1), heading_deg=st.floats(0.0, 180.0))
def test_both_sides_are_alike_and_turning_downhill_needs_less(
    slope_deg: float, heading_deg: float
) -> None:
    law = LAWS["bridged"]
    turned = heading_deg + (180.0 - heading_deg) / 2
    headings = [heading_deg, -heading_deg, turned]
    sand = grain().changed(slope_deg=slope_deg)
    left, right, further = threshold_across(law, sand, headings)
    assert left == pytest.approx(right, rel=1e-12)
    assert further <= left * (1 + 1e-12)


def test_on_a_slope_of_repose_grains_are_loose_whatever_the_heading() -> None:
    slopes = [REPOSE_DEG - 0.1, REPOSE_DEG + 0.1]
    headings = np.array([[0.0], [90.0], [180.0]])
    sand = grain().changed(slope_deg=slopes)
    found = threshold_across(LAWS["bridged"], sand, headings)
    assert (found[:, 0] > 0).all()
    assert (found[:, 1] == 0).all()
    # a stress down the slope has next to nothing to do
    assert found[2, 0] < 0.1 * found[0, 0]


def test_the_slope_along_a_stress_is_the_rise_in_its_direction() -> None:
    slope, heading = np.radians([30.0, 70.0])
    # a unit step along the stress in the plane of the bed rises by this
    rise = np.sin(slope) * np.cos(heading)
    assert np.sin(np.radians(slope_along_deg(30.0, 70.0))) == pytest.approx(rise)
