"""The one maker of thresholds of grains: both criteria, gusts, and what laws object."""

import numpy as np
import pytest

from orchestrator.physics import rolling
from orchestrator.physics.beside import ENTRAINED, SUSTAINED
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import PEAK
from orchestrator.physics.laws import LAWS
from orchestrator.physics.onset import against_law, of_grains

SIZES = np.array([2e-5, 3e-4, 2e-3, 2e-2])


SAND = Grain(
    diameter=SIZES,
    density=2650.0,
    fluid_density=1000.0,
    viscosity=1e-6,
    entrainment_angle_deg=60.0,
)
"""Quartz of some sizes in water."""


@pytest.mark.parametrize("law", LAWS)
def test_a_grain_that_goes_on_needs_the_larger_of_two_mean_stresses(law: str) -> None:
    leaving = of_grains(SAND, law, ENTRAINED)
    both = of_grains(SAND, law, SUSTAINED)
    assert both.criteria is not None
    going = rolling.sustained(SAND).initiation(PEAK)
    in_gust = leaving.shields / PEAK
    assert both.shields == pytest.approx(np.maximum(in_gust, going))
    decides = both.criteria.columns()["decides"]
    assert ((decides == SUSTAINED) == (going >= in_gust)).all()


def test_gusts_lower_the_mean_stress_and_not_the_forces() -> None:
    calm = of_grains(SAND, "bridged")
    gusty = of_grains(SAND, "bridged", gust=[np.nan, 1.0, 2.0, 3.0])
    assert gusty.shields == pytest.approx(calm.shields / [1.0, 1.0, 2.0, 3.0])
    assert gusty.drag == pytest.approx(calm.drag)
    assert gusty.valid.tolist() == calm.valid.tolist()


def test_numbers_of_a_threshold_agree() -> None:
    sloping = SAND.changed(slope_deg=10.0)
    for criterion in (ENTRAINED, SUSTAINED):
        at = of_grains(sloping, "bridged", criterion)
        assert sloping.shields(at.friction_velocity) == pytest.approx(at.shields)
        assert sloping.ustar_at(at.shields) == pytest.approx(at.friction_velocity)
        assert at.reynolds == pytest.approx(at.friction_velocity * SIZES / 1e-6)


def test_what_a_law_objects_is_data() -> None:
    at = of_grains(SAND, "low")
    reasons = at.reasons()
    assert [not each for each in reasons] == at.valid.tolist()
    assert {each.code for of_grain in reasons for each in of_grain} == {"law"}
    # where a law goes on in another, that is the remedy
    coarse = SAND.at(slice(3, 4)).changed(diameter=0.05, roughness=0.05 / 30)
    (ends,) = of_grains(coarse, "bridged").reasons()
    assert [each.remedy for each in ends] == ['choose forces.law = "bridged-gravel"']
    # without a threshold no law is beyond its range
    assert against_law("low", coarse, np.array([np.inf])) == [[]]
