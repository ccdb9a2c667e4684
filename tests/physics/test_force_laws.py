"""Every force law: limits, units, order, range; and the values that their authors printed."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.errors import InputError
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import (
    CLIFT_GAUVIN,
    LAWS,
    SCHILLER_NAUMANN,
    Bridged,
    law,
    reasons,
)
from orchestrator.physics.threshold import shields_at

FORCES = ("drag", "lift")
every_law = pytest.mark.parametrize("name", LAWS)
ratios = st.floats(1 / 60, 1 / 5)


def unit(ratio: float = 1 / 30) -> Grain:
    """A grain of d = rho = nu = 1, so that ustar is Re*."""
    return Grain(diameter=1.0, roughness=ratio, fluid_density=1.0, viscosity=1.0)


@pytest.mark.parametrize("part", [5, 20, 60])
def test_the_forces_of_eqs_2_and_4(part: int) -> None:
    d, rho, a = np.geomspace(3e-5, 2e-3, 7), 1.2, 2.0
    nu, u = np.array([[1e-6], [1e-5], [1e-3]]), np.array([[[1e-3]], [[0.3]], [[5.0]]])
    r = 1 / part
    at = Grain(
        diameter=d, roughness=r * d, fluid_density=rho, viscosity=nu, lift_coefficient=a
    )
    low, high = LAWS["low"], LAWS["high"]
    stokes = 1.5 * np.pi * (1 + 2 * r) * rho * (d * u) ** 2 * np.ones_like(nu)
    np.testing.assert_allclose(low.drag(u, at), stokes)
    np.testing.assert_allclose(
        low.lift(u, at), a / 2 * (1 + 2 * r) * rho * (d * u) ** 3 / nu
    )
    speed = 2.5 * ((1 + r) * np.log1p(1 / r) - 1) * u
    drag = 3 * np.pi * rho * nu * d * speed * (1 + 0.15 * (speed * d / nu) ** 0.687)
    np.testing.assert_allclose(high.drag(u, at), drag)
    lift = a * rho * np.sqrt(nu) * d**2 * speed * np.sqrt(2.5 * u / d * np.log1p(1 / r))
    np.testing.assert_allclose(high.lift(u, at), lift)


def test_laws_of_every_reynolds_number_tend_to_eqs_2_and_4() -> None:
    every = ("bridged", "bridged-gravel", "profile")
    # the difference is the drag's own inertia, 0.15 (V d/nu)^0.687, and falls as Re*^1.37
    ends = [
        (name, "low", *end) for name in every for end in ((1e-3, 1e-5), (1e-6, 1e-9))
    ]
    # and here it falls as 4 to 11 over Re*
    ends += [("bridged", "high", 1e4, 11e-4), ("bridged", "high", 1e6, 11e-6)]
    for name, limit, reynolds, within in ends:
        for force, ratio in product(("drag", "lift"), (1 / 30, 1 / 10)):
            value, exact = (
                getattr(LAWS[n], force)(reynolds, unit(ratio)) for n in (name, limit)
            )
            assert float(value) == pytest.approx(float(exact), rel=within)


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
    grain = Grain(diameter=d, roughness=ratio * d, fluid_density=rho, viscosity=nu)
    ustar = grain.ustar(reynolds)
    scale = rho * nu**2
    for force in FORCES:
        value = float(getattr(LAWS[name], force)(ustar, grain))
        model = float(getattr(LAWS[name], force)(reynolds, unit(ratio)))
        assert value == pytest.approx(model * scale, rel=1e-10)


@pytest.mark.parametrize("name", [name for name, one in LAWS.items() if one.protrudes])
def test_the_higher_a_grain_stands_the_more_it_feels(name: str) -> None:
    at = Grain(
        diameter=1e-3,
        roughness=1e-3 / 30,
        fluid_density=1000.0,
        viscosity=1e-6,
        gap=np.linspace(-1.2, 1, 12) * 1e-3,
    )
    drag = LAWS[name].drag(0.03, at)
    assert np.isfinite(drag).all()
    assert (np.diff(drag[1:]) > 0).all()
    assert 0 <= drag[0] < 1e-6 * drag[-1]


@pytest.mark.parametrize(
    ("name", "ratio", "reynolds", "why"),
    [
        ("low", 1 / 30, 3.0, "Re* 3 is not below 3"),
        ("high", 1 / 30, 30.0, ""),
        ("high", 1 / 30, 29.9, "Re* 29.9 is below 30"),
        # the end of Schiller and Naumann's drag: V d/nu = 1000
        ("high", 1 / 30, 156.9, ""),
        ("high", 1 / 30, 157.1, "particle Reynolds number (Schiller and Naumann)"),
        ("bridged", 1 / 30, 162.7, ""),
        ("bridged", 1 / 30, 163.0, "not below 1000"),
        ("bridged", 1e-9, 50.0, "speed over that above a smooth wall"),
        ("bridged-gravel", 1 / 30, 4e4, ""),
        ("bridged-gravel", 1 / 30, 5e4, "particle Reynolds number (Clift and Gauvin)"),
        ("profile", 1 / 10, 197.0, ""),
        ("profile", 1 / 10, 1000.0, "roughness ks u*/nu (Cebeci and Chang) 3000"),
        ("bridged", 1 / 30, np.nan, "Re* is not a number"),
    ],
)
def test_a_law_names_the_ranges_that_it_is_beyond(
    name: str, ratio: float, reynolds: float, why: str
) -> None:
    (texts,) = reasons(LAWS[name].ranges(reynolds, unit(ratio)), 1)
    assert why in "; ".join(texts)
    assert bool(texts) == bool(why)
    assert bool(LAWS[name].valid(reynolds, unit(ratio))) == (not why)


def test_clift_and_gauvin_go_on_where_schiller_and_naumann_end() -> None:
    ratio = CLIFT_GAUVIN.factor(np.array(800.0)) / SCHILLER_NAUMANN.factor(
        np.array(800.0)
    )
    assert float(ratio) == pytest.approx(1.046, abs=5e-4)
    reynolds = np.array([1e3, 1e4, 1e5])
    printed = 24 / reynolds * (1 + 0.15 * reynolds**0.687) + 0.42 / (
        1 + 42500 * reynolds**-1.16
    )
    np.testing.assert_allclose(
        24 / reynolds * CLIFT_GAUVIN.factor(reynolds), printed, rtol=1e-13
    )
    # the plateau of the standard drag curve of a sphere
    assert np.all((printed > 0.38) & (printed < 0.51))


PAGE = Path(__file__).parents[2] / "docs" / "model.md"


@every_law
def test_the_table_of_the_model_page_has_what_a_law_gives(name: str) -> None:
    text = PAGE.read_text(encoding="utf-8")
    section = text.split("### The laws side by side")[1]
    cells = [
        line.strip("|\n ").split(" | ")
        for line in section.splitlines()
        if "| `" in line
    ]
    rows = {law.strip("`"): numbers for law, *numbers in cells}
    assert set(rows) == set(LAWS)
    assert any(
        line.startswith("### ") and f"`{name}`" in line for line in text.splitlines()
    )
    reynolds = np.array([0.1, 1, 3, 10, 30, 100])
    theta = shields_at(
        LAWS[name], reynolds, roughness_ratio=1 / 30, entrainment_angle_deg=60
    )
    assert [f"{value:.4f}" for value in theta] == [
        cell.strip("()") for cell in rows[name]
    ]
    holds = LAWS[name].valid(reynolds, unit())
    assert [not cell.startswith("(") for cell in rows[name]] == holds.tolist()


def test_the_registry_holds_each_law_under_its_own_name() -> None:
    assert all(law(name).name == name for name in LAWS)
    assert len({each.label for each in LAWS.values()}) == len(LAWS)
    assert all(each.reference for each in LAWS.values())


@pytest.mark.parametrize(("name", "is_near"), [("brigded", True), ("newton", False)])
def test_an_unknown_law_is_answered_with_the_known_ones(
    name: str, is_near: bool
) -> None:
    with pytest.raises(InputError) as caught:
        law(name)
    text = str(caught.value)
    assert all(known in text for known in LAWS)
    assert ("did you mean bridged?" in text) == is_near


def test_no_subclass_takes_part_in_the_interval_unless_it_says_so() -> None:
    assert Bridged.in_interval
    assert not type("Weaker", (Bridged,), {"name": "weaker"}).in_interval  # type: ignore[attr-defined]
