"""The flow around a grain that stands higher or lower than z0 above the bed."""

import numpy as np
import pytest
from scipy.integrate import quad

from orchestrator.physics import near_bed
from orchestrator.physics.exposure import Exposure
from orchestrator.physics.laws import LAWS

D, Z0 = 1e-3, 1e-3 / 30
FLUID = (1000.0, 1e-6, 1.615)


@pytest.mark.parametrize("law", [one for one in LAWS.values() if one.protrudes])
def test_a_grain_at_z0_feels_the_same_to_the_last_digit(law: object) -> None:
    alike, given = Exposure(D, Z0, *FLUID), Exposure(D, Z0, *FLUID, gap=[Z0, Z0])
    ustar = np.geomspace(1e-3, 1, 7)[:, None]
    for force in ("drag", "lift"):
        one, other = (getattr(law, force)(ustar, where) for where in (alike, given))
        np.testing.assert_array_equal(np.broadcast_to(one, (7, 2)), other)
    # without a jump beside it
    beside = Exposure(D, Z0, *FLUID, gap=Z0 * (1 + 1e-9))
    np.testing.assert_allclose(near_bed.rough_speed(beside), near_bed.rough_speed(alike), rtol=1e-8)


@pytest.mark.parametrize("gap", [-0.6 * D, -0.1 * D, 0.0, 0.2 * D, 1.5 * D])
def test_speeds_are_means_over_the_height_of_the_grain(gap: float) -> None:
    where = Exposure(D, Z0, *FLUID, gap=gap)
    mean, _ = quad(lambda z: 2.5 * np.log(max(z, Z0) / Z0), gap, gap + D, points=[Z0], limit=200)
    assert near_bed.rough_speed(where) == pytest.approx(mean / D, rel=1e-6)
    linear, _ = quad(lambda z: max(z, 0.0), gap, gap + D, points=[0.0])
    assert near_bed.viscous_length(where) == pytest.approx(linear / D, rel=1e-6)


def test_the_higher_a_grain_stands_the_more_it_feels() -> None:
    where = Exposure(D, Z0, *FLUID, gap=np.linspace(-1.2, 1, 12) * D)
    drag = LAWS["bridged"].drag(0.03, where)
    assert (drag >= 0).all()
    assert np.isfinite(drag).all()
    assert (np.diff(drag[1:]) > 0).all()
    assert drag[0] < 1e-6 * drag[-1]
