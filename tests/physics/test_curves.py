"""Reference curves against hand-computed points."""

import numpy as np
import pytest

from orchestrator.physics import curves


@pytest.mark.parametrize(
    ("formula", "x", "theta"),
    [
        # each worked out by hand from the published formula
        (curves.soulsby_whitehouse, 1.0, 0.30 / 2.2 + 0.055 * 0.019801326693),
        (curves.paphitis, 1.0, 0.094 + 0.0475 * (1 - 0.699 * 0.985111939603)),
        (curves.mantz, 0.1, 0.199526231497),
        (curves.van_rijn, 2.0, 0.12),
        (curves.van_rijn, 8.0, 0.14 * 0.264254546),
        (curves.van_rijn, 200.0, 0.055),
        (curves.yalin_karahan, 0.5, 0.123114441334),
        (curves.yalin_karahan, 100.0, 0.045),
        (curves.brownlie, 1.0, 0.22 + 0.06 * 10**-7.7),
    ],
)
def test_curve_at_a_point(formula: curves.Formula, x: float, theta: float) -> None:
    assert float(formula(np.array([x]))[0]) == pytest.approx(theta, rel=1e-6)


def test_points_turn_the_dimensionless_diameter_into_a_reynolds_number() -> None:
    curve = next(c for c in curves.WATER if c.name.startswith("van Rijn"))
    reynolds, theta = curve.points(50)
    dstar = np.geomspace(curve.low, curve.high, 50)
    np.testing.assert_allclose(reynolds, np.sqrt(theta) * dstar**1.5)


def test_iversen_white_solves_its_implicit_equation_on_both_branches() -> None:
    air = curves.Air(density=2650.0, fluid_density=1.2, viscosity=1.5e-5)
    d = np.array([5e-5, 1e-4, 5e-4, 1e-3])
    ustar = curves.iversen_white(d, air)
    reynolds = ustar * d / air.viscosity
    assert reynolds[0] < 10 < reynolds[-1]
    cohesion = 1 + 6e-7 / (air.density * air.gravity * d**2.5)
    scale = np.sqrt(air.density / air.fluid_density * air.gravity * d * cohesion)
    slow = 0.129 * scale / np.sqrt(1.928 * reynolds**0.092 - 1)
    fast = 0.12 * scale * (1 - 0.0858 * np.exp(-0.0617 * (reynolds - 10)))
    np.testing.assert_allclose(ustar, np.where(reynolds <= 10, slow, fast), rtol=1e-9)


def test_air_curves_agree_in_order_of_magnitude_for_sand() -> None:
    air = curves.Air(density=2650.0, fluid_density=1.2, viscosity=1.5e-5)
    found = [float(curve(np.array([2.5e-4]), air)[0]) for curve in curves.AIR.values()]
    assert min(found) > 0.2
    assert max(found) < 0.35
