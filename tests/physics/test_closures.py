"""The closed form against values worked out independently, and its invariants."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.physics import closures
from tests.physics.closures import Closure

AIR = {"density": 2500.0, "fluid_density": 1.0}
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

diameters = st.floats(3.5e-5, 2e-3)
viscosities = st.floats(1e-6, 1e-3)
ratios = st.floats(1 / 60, 1 / 5)
betas = st.floats(5, 60)
either = st.sampled_from(closures.CLOSURES)


@pytest.mark.parametrize(("closure", "d", "alpha", "beta", "part", "nu", "ustar"), INDEPENDENT)
def test_threshold_is_the_root_of_the_printed_equations(
    closure: Closure, d: float, alpha: float, beta: float, part: float, nu: float, ustar: float
) -> None:
    found = closures.threshold(
        closure,
        diameter=d,
        viscosity=nu,
        slope_deg=alpha,
        entrainment_angle_deg=beta,
        roughness=d / part,
        **AIR,
    )
    assert float(found.friction_velocity) == pytest.approx(ustar, rel=1e-12)


def test_eq_3_in_its_printed_form() -> None:
    d, nu, delta, alpha, beta = 1e-4, 1e-3, 1e-5, np.radians(20), np.radians(50)
    found = closures.threshold(
        "low",
        diameter=d,
        viscosity=nu,
        slope_deg=20,
        entrainment_angle_deg=50,
        roughness=delta,
        **AIR,
    )
    geometry = 1 + 2 * delta / d
    lift = closures.LIFT_COEFFICIENT / 2 * found.reynolds * geometry
    printed = (np.pi / 6 * (np.sin(alpha) * np.tan(beta) + np.cos(alpha))) / (
        1.5 * np.pi * geometry * np.tan(beta) + lift
    )
    assert float(found.shields) == pytest.approx(float(printed), rel=1e-12)


@given(
    closure=either, d=diameters, nu=viscosities, ratio=ratios, beta=betas, alpha=st.floats(0, 85)
)
def test_forces_balance_at_the_threshold(
    closure: Closure, d: float, nu: float, ratio: float, beta: float, alpha: float
) -> None:
    slope = min(alpha, 90 - beta)
    found = closures.threshold(
        closure,
        diameter=d,
        viscosity=nu,
        slope_deg=slope,
        entrainment_angle_deg=beta,
        roughness=ratio * d,
        **AIR,
    )
    moment = found.drag * np.sin(np.radians(beta)) + found.lift * np.cos(np.radians(beta))
    weight = closures.weight(diameter=d, **AIR)
    resistance = weight * np.cos(np.radians(slope - beta))
    assert float(moment) == pytest.approx(float(resistance), rel=1e-9)


@given(closure=either, d=diameters, nu=viscosities, ratio=ratios, beta=betas)
def test_threshold_rises_with_slope_up_to_the_entrainment_angle(
    closure: Closure, d: float, nu: float, ratio: float, beta: float
) -> None:
    slopes = np.linspace(0, beta, 20)
    found = closures.threshold(
        closure,
        diameter=d,
        viscosity=nu,
        slope_deg=slopes,
        entrainment_angle_deg=beta,
        roughness=ratio * d,
        **AIR,
    )
    assert np.all(np.diff(found.shields) > 0)


@given(beta=st.floats(1, 60), lean=st.floats(0, 60))
def test_pivot_resistance_is_symmetric_about_the_entrainment_angle(
    beta: float, lean: float
) -> None:
    up = closures.pivot_resistance(beta + lean, beta)
    down = closures.pivot_resistance(beta - lean, beta)
    assert float(up) == pytest.approx(float(down), rel=1e-12)


@given(d=diameters, factor=st.floats(0.1, 10), ratio=ratios, beta=betas, closure=either)
def test_shields_number_depends_on_the_scale_through_the_reynolds_number_alone(
    d: float, factor: float, ratio: float, beta: float, closure: Closure
) -> None:
    # the same d^3 g/nu^2, with another diameter
    angles = {"slope_deg": 10.0, "entrainment_angle_deg": beta}
    nu = 1e-5
    one = closures.threshold(
        closure, diameter=d, viscosity=nu, roughness=ratio * d, **angles, **AIR
    )
    other = closures.threshold(
        closure,
        diameter=d * factor,
        viscosity=nu * factor**1.5,
        roughness=ratio * d * factor,
        **angles,
        **AIR,
    )
    assert float(other.shields) == pytest.approx(float(one.shields), rel=1e-9)
    assert float(other.reynolds) == pytest.approx(float(one.reynolds), rel=1e-9)


@given(
    d=st.floats(1e-5, 1e-2),
    nu=st.floats(1e-7, 1e-2),
    ratio=ratios,
    beta=betas,
    slope=st.floats(0, 30),
    rho=st.floats(1.1, 1e4),
)
def test_never_are_both_closures_valid(
    d: float, nu: float, ratio: float, beta: float, slope: float, rho: float
) -> None:
    low, high = (
        closures.threshold(
            closure,
            diameter=d,
            viscosity=nu,
            slope_deg=slope,
            entrainment_angle_deg=beta,
            roughness=ratio * d,
            density=rho,
            fluid_density=1.0,
        )
        for closure in closures.CLOSURES
    )
    assert not (low.valid and high.valid)
    assert str(closures.regime(low, high)) in ("low", "high", "transition")


@pytest.mark.parametrize(("reynolds", "factor"), [(3, 8.5), (10, 4.3), (30, 2.6)])
def test_the_drags_of_the_two_closures_differ_by_known_factors(
    reynolds: float, factor: float
) -> None:
    d, nu = 1e-4, 1e-5
    where = {"diameter": d, "roughness": d / 30, "fluid_density": 1.0, "viscosity": nu}
    ustar = reynolds * nu / d
    ratio = closures.drag("high", **where)(ustar) / closures.drag("low", **where)(ustar)
    assert max(float(ratio), 1 / float(ratio)) == pytest.approx(factor, rel=0.02)


def test_arrays_broadcast() -> None:
    found = closures.threshold(
        "high",
        diameter=np.array([[1e-3], [5e-4]]),
        viscosity=1e-5,
        slope_deg=np.array([0.0, 15.0, 30.0]),
        entrainment_angle_deg=60.0,
        roughness=np.array([[1e-4], [5e-5]]),
        **AIR,
    )
    assert found.friction_velocity.shape == (2, 3)


def test_eq_10_and_the_form_that_the_rough_wall_uses() -> None:
    # ustar = 0.41 u/ln(11) for z = 10 z0; ln 11 = 2.397895272798
    assert float(closures.log_law_ustar(1.0, 1e-3, 1e-4)) == pytest.approx(0.41 / 2.397895272798)
    printed = closures.log_law_ustar(1.0, 1e-3, 1e-4, printed=True)
    assert float(printed) == pytest.approx(0.41 / 2.302585092994)
    assert float(closures.log_law_ustar(1.0, 5e-5, 1e-4, printed=True)) < 0
