"""Published hiding functions: 1 at the mean size, and their known limits."""

import numpy as np
import pytest

from orchestrator.physics import hiding


def test_the_mean_size_is_its_own_measure() -> None:
    assert hiding.wilcock_crowe(1.0) == pytest.approx(1.0, rel=1e-12)
    assert hiding.egiazaroff(1.0) == pytest.approx(1.0, rel=1e-12)


def test_small_grains_hide_and_large_ones_stand_out() -> None:
    ratio = np.geomspace(0.4, 5, 30)
    for formula in (hiding.wilcock_crowe, hiding.egiazaroff):
        assert (np.diff(formula(ratio)) < 0).all()
    # exponents of the stress: 0.12 for the finest, 0.67 for the coarsest
    step = np.array([1e-3, 1.001e-3])
    fine = np.diff(np.log(hiding.wilcock_crowe(step)))[0] / np.log(1.001) + 1
    assert fine == pytest.approx(0.67 / (1 + np.exp(1.5)), rel=1e-2)
    assert np.isnan(hiding.egiazaroff(0.1))


def test_pivots_of_natural_beds() -> None:
    assert hiding.kirchner_pivot_deg(50) == pytest.approx(55)
    assert hiding.kirchner_pivot_deg(0, 2.0) == pytest.approx(30 * 2**-0.3)
