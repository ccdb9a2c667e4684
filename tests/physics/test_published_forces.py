"""The laws against the numbers that their authors or others computed."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from orchestrator.physics.constants import KARMAN, LIFT_COEFFICIENT
from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.laws import LAWS
from orchestrator.physics.laws.zeng import TORQUE_ARM
from orchestrator.physics.rough_wall import layer, shear, shift
from orchestrator.physics.sphere_drag import CLIFT_GAUVIN, SCHILLER_NAUMANN


def unit(ratio: float = 1 / 30) -> Exposure:
    return Exposure(1.0, ratio, 1.0, 1.0)


def test_clift_and_gauvin_go_on_where_schiller_and_naumann_end() -> None:
    ratio = CLIFT_GAUVIN.factor(np.array(800.0)) / SCHILLER_NAUMANN.factor(np.array(800.0))
    assert float(ratio) == pytest.approx(1.046, abs=5e-4)
    reynolds = np.array([1e3, 1e4, 1e5])
    printed = 24 / reynolds * (1 + 0.15 * reynolds**0.687) + 0.42 / (1 + 42500 * reynolds**-1.16)
    np.testing.assert_allclose(24 / reynolds * CLIFT_GAUVIN.factor(reynolds), printed, rtol=1e-13)
    # the plateau of the standard drag curve of a sphere
    assert np.all((printed > 0.38) & (printed < 0.51))
    assert float(CLIFT_GAUVIN.factor(np.array(0.0))) == 1


def _coefficients(reynolds: float, ratio: float) -> tuple[float, float]:
    """C_D and C_L of Zeng's law where the speed at the centre has a Reynolds number."""
    law, exposure = LAWS["zeng"], unit(ratio)
    ustar = 1e-3
    for _ in range(200):
        speed = float(law.speed(ustar, exposure))
        ustar *= (reynolds / speed) ** 0.5
    area = np.pi / 8 * reynolds**2
    return float(law.drag(ustar, exposure)) / area, float(law.lift(ustar, exposure)) / area


def test_zeng_touching_the_wall_in_creeping_flow() -> None:
    # Goldman, Cox and Brenner: 1.7005 times Stokes; Leighton and Acrivos: C_L 5.87
    drag, lift = _coefficients(1e-4, 1e-9)
    assert drag * 1e-4 / 24 == pytest.approx(1.7005, abs=1e-3)
    assert lift == pytest.approx(5.87, abs=5e-3)


@pytest.mark.parametrize(
    ("reynolds", "simulated", "within"), [(2, 2.653, 0.012), (10, 1.305, 0.02), (200, 0.338, 0.06)]
)
def test_zeng_fits_the_lift_that_was_simulated_and_saffman_is_above(
    reynolds: float, simulated: float, within: float
) -> None:
    assert _coefficients(reynolds, 1e-9)[1] == pytest.approx(simulated, rel=within)
    # Saffman's lift in the same linear shear: the speed at the centre is G d/2
    saffman = LIFT_COEFFICIENT * reynolds * np.sqrt(2 * reynolds) / (np.pi / 8 * reynolds**2)
    assert 1.21 < saffman / simulated < 1.56


def test_the_torque_acts_as_a_drag_above_the_centre() -> None:
    one, other, at = LAWS["zeng-torque"], LAWS["zeng"], unit()
    arm = one.torque(2.0, at) / one.drag(2.0, at)
    assert float(arm) == pytest.approx(TORQUE_ARM)
    assert pytest.approx(0.37, abs=5e-4) == 2 * TORQUE_ARM
    assert float(one.drag(2.0, at)) == float(other.drag(2.0, at))
    assert float(one.lift(2.0, at)) == float(other.lift(2.0, at))
    assert float(other.torque(2.0, at)) == 0


def test_claudin_and_andreotti_in_both_limits() -> None:
    law = LAWS["claudin-andreotti"]
    # creeping: 25/24 of Stokes' drag at the speed of the linear profile at d/2
    slow = 25 / 24 * 3 * np.pi * 1e-10 / 2
    assert float(law.drag(1e-5, unit())) == pytest.approx(slow, rel=1e-4)
    # rough: C_D = 1 at the speed of the logarithm at d/2
    fast = np.pi / 8 * (1e5 * np.log(16) / 0.4) ** 2
    assert float(law.drag(1e5, unit())) == pytest.approx(fast, rel=0.02)


def _integral(base: float, top: float, moved: float) -> tuple[float, float]:
    """Mean speed and shear by quadrature of the profile, independently of the tables."""

    def slope(z: float) -> float:
        length = KARMAN * (z + moved) * (1 - np.exp(-(z + moved) / 26))
        return float(2 / (1 + np.sqrt(1 + 4 * length**2)))

    knots = np.concatenate([[0], np.geomspace(base, top, 12)])
    below = quad(slope, 0, base, epsrel=1e-12, epsabs=0)[0]
    pairs = list(pairwise(knots[1:]))
    rise = sum(quad(slope, a, b, epsrel=1e-12, epsabs=0)[0] for a, b in pairs)
    first = sum(
        quad(lambda z: (top - z) * slope(z), a, b, epsrel=1e-12, epsabs=0)[0] for a, b in pairs
    )
    return below + first / (top - base), rise / (top - base)


@pytest.mark.parametrize("reynolds", [1e-3, 0.3, 5.0, 40.0, 500.0, 2000.0])
@pytest.mark.parametrize("ratio", [1 / 60, 1 / 10])
def test_the_profile_is_the_integral_of_its_shear(reynolds: float, ratio: float) -> None:
    base = ratio * reynolds
    moved = shift(np.array(30 * base))
    found = layer(np.array(base), np.array(base + reynolds), moved)
    np.testing.assert_allclose(found, _integral(base, base + reynolds, float(moved)), rtol=1e-10)


@pytest.mark.parametrize("reynolds", [1e9, 1e10, 1e20])
def test_the_profile_goes_on_above_its_table(reynolds: float) -> None:
    base, moved = np.array(reynolds / 30), shift(np.array(reynolds))
    found = layer(base, base + reynolds, moved)
    exact = _integral(float(base), float(base + reynolds), float(moved))
    np.testing.assert_allclose(found, exact, rtol=1e-9)


def test_the_shift_of_a_smooth_wall_is_none_and_it_sets_in_continuously() -> None:
    assert not np.any(shift(np.linspace(0, 4.5, 50)))
    assert 0 < float(shift(np.array(4.54))) < 0.01
    assert float(shift(np.array(70.0))) == pytest.approx(0.9 * np.sqrt(70), rel=1e-3)


def test_far_from_the_wall_the_shear_is_that_of_the_logarithm() -> None:
    assert float(shear(np.array(1e4))) == pytest.approx(1 / (KARMAN * 1e4), rel=2e-4)


# Threshold Shields numbers at beta 60 and 45 and ks = d, computed before this program had the law;
# the grain lay on the wall then (no gap), which raises them by 4 to 10 % against a gap of d/30.
BEFORE = {
    60: (0.064, 0.054, 0.038, 0.019, 0.019, 0.028),
    45: (0.109, 0.088, 0.058, 0.028, 0.029, 0.043),
}


@pytest.mark.parametrize("beta", [60, 45])
def test_thresholds_of_the_profile_as_computed_before(beta: int) -> None:
    reynolds = np.array([0.1, 1, 3, 10, 30, 100])
    speed, slope = layer(0 * reynolds, reynolds, shift(reynolds))
    drag = SCHILLER_NAUMANN.force(speed * reynolds, unit())
    lift = LIFT_COEFFICIENT * speed * reynolds * np.sqrt(slope) * reynolds
    theta = _threshold(reynolds, drag, lift, beta)
    np.testing.assert_allclose(theta, BEFORE[beta], atol=8e-4)
    law, gap = LAWS["profile"], unit()
    with_gap = _threshold(reynolds, law.drag(reynolds, gap), law.lift(reynolds, gap), beta)
    assert np.all((with_gap < 0.98 * theta) & (with_gap > 0.9 * theta))


def _threshold(
    reynolds: FloatArray, drag: FloatArray, lift: FloatArray, beta_deg: float
) -> FloatArray:
    beta = np.radians(beta_deg)
    moment = drag * np.sin(beta) + lift * np.cos(beta)
    return np.asarray(np.pi / 6 * np.cos(beta) * reynolds**2 / moment)
