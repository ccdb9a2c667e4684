"""What every force law must do: limits, units, order, ranges; and the registry."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from orchestrator.errors import InputError
from orchestrator.physics.exposure import Exposure
from orchestrator.physics.laws import LAWS, law
from orchestrator.physics.near_bed import bridge
from tests.physics import closures

NAMES = (
    "low",
    "high",
    "bridged",
    "bridged-gravel",
    "profile",
    "claudin-andreotti",
    "zeng",
    "zeng-torque",
)
FORCES = ("drag", "lift", "torque")
every_law = pytest.mark.parametrize("name", NAMES)
ratios = st.floats(1 / 60, 1 / 5)


def unit(ratio: float = 1 / 30) -> Exposure:
    """A grain of d = rho = nu = 1, so that ustar is Re*."""
    return Exposure(1.0, ratio, 1.0, 1.0)


def test_the_registry_holds_each_law_under_its_own_name() -> None:
    assert tuple(LAWS) == NAMES
    assert all(law(name).name == name for name in NAMES)
    assert len({one.label for one in LAWS.values()}) == len(NAMES)
    assert all(one.reference for one in LAWS.values())


@pytest.mark.parametrize("name", ["", "paper", "Bridged ", "brigded"])
def test_an_unknown_name_is_answered_with_the_known_ones(name: str) -> None:
    with pytest.raises(InputError) as caught:
        law(name)
    assert all(known in str(caught.value) for known in NAMES)
    assert ("did you mean bridged?" in str(caught.value)) == (name in ("Bridged ", "brigded"))


@pytest.mark.parametrize("closure", closures.CLOSURES)
def test_eqs_2_and_4_are_those_of_the_closures(closure: closures.Closure) -> None:
    d, nu = np.geomspace(3e-5, 2e-3, 7), np.array([[1e-6], [1e-5], [1e-3]])
    ustar = np.array([[[1e-3]], [[0.3]], [[5.0]]])
    flow: dict[str, ArrayLike] = {
        "diameter": d,
        "roughness": d / 20,
        "fluid_density": 1.2,
        "viscosity": nu,
    }
    exposure = Exposure(**flow, lift_coefficient=2.0)
    drag = closures.drag(closure, **flow)(ustar)
    lift = closures.lift(closure, **flow, lift_coefficient=2.0)(ustar)
    for found, exact in (
        (LAWS[closure].drag(ustar, exposure), drag),
        (LAWS[closure].lift(ustar, exposure), lift),
    ):
        np.testing.assert_allclose(found, np.broadcast_to(exact, (3, 3, 7)), rtol=1e-13)
    assert not np.any(LAWS[closure].torque(ustar, exposure))


@pytest.mark.parametrize("ratio", [1 / 30, 1 / 10])
@pytest.mark.parametrize("name", ["bridged", "bridged-gravel", "profile"])
def test_laws_of_every_reynolds_number_tend_to_eq_2(name: str, ratio: float) -> None:
    # what is left is the drag's own inertia, 0.15 (V d/nu)^0.687, and falls as Re*^1.37
    for reynolds, within in ((1e-1, 5e-3), (1e-3, 1e-5), (1e-6, 1e-9)):
        for force in ("drag", "lift"):
            value = getattr(LAWS[name], force)(reynolds, unit(ratio))
            exact = getattr(LAWS["low"], force)(reynolds, unit(ratio))
            assert float(value) == pytest.approx(float(exact), rel=within)


@pytest.mark.parametrize(("ratio", "worst"), [(1 / 30, 1.0), (1 / 10, 0.6)])
def test_the_bridged_law_tends_to_eq_4_as_one_over_re(ratio: float, worst: float) -> None:
    for reynolds in (1e3, 1e4, 1e6):
        for force in ("drag", "lift"):
            value = getattr(LAWS["bridged"], force)(reynolds, unit(ratio))
            exact = getattr(LAWS["high"], force)(reynolds, unit(ratio))
            assert -11 * worst / reynolds < float(value / exact) - 1 < -4 * worst / reynolds


@given(reynolds=st.floats(1e-6, 1e6), viscous=st.floats(1e-3, 1e3), rough=st.floats(1, 50))
def test_the_root_of_the_bridge_is_right_to_the_last_digits(
    reynolds: float, viscous: float, rough: float
) -> None:
    with localcontext() as context:
        context.prec = 60
        u, a, c = Decimal(reynolds), Decimal(viscous), Decimal(rough)
        exact = (-a + (a * a + 4 * u * u / (c * c)).sqrt()) * c * c / 2
    found = bridge(np.array(reynolds), np.array(viscous), np.array(rough))
    assert float(found) == pytest.approx(float(exact), rel=1e-15)


@every_law
@settings(deadline=None)
@given(ratio=ratios, low=st.floats(1e-6, 1e20), factor=st.floats(1.001, 100))
def test_no_force_falls_while_the_flow_rises(
    name: str, ratio: float, low: float, factor: float
) -> None:
    ustar = np.array([0.0, low, low * factor])
    for force in FORCES:
        values = getattr(LAWS[name], force)(ustar, unit(ratio))
        assert values[0] == 0
        assert np.all(np.diff(values) > 0) or not np.any(values)
    assert np.all(np.diff(LAWS[name].speed(ustar, unit(ratio))) > 0)


@every_law
@settings(deadline=None)
@given(
    ratio=ratios,
    reynolds=st.floats(1e-3, 1e4),
    d=st.floats(1e-6, 1.0),
    nu=st.floats(1e-7, 1e-2),
    rho=st.floats(0.01, 1e4),
)
def test_forces_scale_with_rho_nu_squared_at_a_reynolds_number(
    name: str, ratio: float, reynolds: float, d: float, nu: float, rho: float
) -> None:
    grain = Exposure(d, ratio * d, rho, nu)
    ustar = grain.ustar(reynolds)
    for force, scale in (("drag", rho * nu**2), ("lift", rho * nu**2), ("torque", rho * nu**2 * d)):
        value = float(getattr(LAWS[name], force)(ustar, grain))
        model = float(getattr(LAWS[name], force)(reynolds, unit(ratio)))
        assert value == pytest.approx(model * scale, rel=1e-10)


@pytest.mark.parametrize(
    ("name", "ratio", "reynolds", "why"),
    [
        ("low", 1 / 30, 2.99, ""),
        ("low", 1 / 30, 3.0, "Re* 3 is not below 3"),
        ("high", 1 / 30, 30.0, ""),
        ("high", 1 / 30, 29.9, "Re* 29.9 is below 30"),
        # the end of Schiller and Naumann's drag: V d/nu = 1000
        ("high", 1 / 30, 156.9, ""),
        ("high", 1 / 30, 157.1, "particle Reynolds number (Schiller and Naumann)"),
        ("high", 1 / 10, 244.1, ""),
        ("high", 1 / 10, 244.4, "particle Reynolds number"),
        ("bridged", 1 / 30, 1e-6, ""),
        ("bridged", 1 / 30, 162.7, ""),
        ("bridged", 1 / 30, 163.0, "not below 1000"),
        ("bridged-gravel", 1 / 30, 4e4, ""),
        ("bridged-gravel", 1 / 30, 5e4, "particle Reynolds number (Clift and Gauvin)"),
        ("profile", 1 / 10, 197.0, ""),
        ("profile", 1 / 10, 1000.0, "roughness ks u*/nu (Cebeci and Chang) 3000"),
        ("zeng", 1 / 30, 34.7, ""),
        ("zeng", 1 / 30, 34.8, "not below 200"),
        ("claudin-andreotti", 1 / 30, 1e5, ""),
        ("bridged", 1 / 30, np.nan, "Re* is not a number"),
    ],
)
def test_a_law_says_where_it_holds_and_why_not(
    name: str, ratio: float, reynolds: float, why: str
) -> None:
    said = LAWS[name].why_not(reynolds, unit(ratio))
    assert why in said
    assert bool(said) == bool(why)
    assert bool(LAWS[name].valid(reynolds, unit(ratio))) == (not why)


def test_validity_is_an_array_and_both_bounds_are_told() -> None:
    valid = LAWS["high"].valid(np.array([1.0, 100.0, 1000.0]), unit())
    np.testing.assert_array_equal(valid, [False, True, False])
    said = LAWS["profile"].why_not(3000.0, unit())
    assert "Schiller" in said
    assert "Cebeci" in said
