"""Measured thresholds and pivots, published curves, and how the laws compare with them."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator.lab.validate import IVERSEN_WHITE
from orchestrator.physics import curves
from orchestrator.physics.beside import FIELD, MEASURED, beside
from orchestrator.physics.grain import Grain
from orchestrator.physics.measured import (
    BUFFINGTON_MONTGOMERY,
    MEASURED_BEDS,
    VISUAL,
    egiazaroff_hiding,
    kirchner_pivot,
    single_beds,
    wilcock_crowe_hiding,
)


def test_every_measured_bed_has_a_place_in_one_of_two_diagrams() -> None:
    table = pd.read_csv(MEASURED_BEDS)
    table = table[table["set"] != IVERSEN_WHITE].reset_index(drop=True)
    parts = [single_beds(in_gas=in_gas) for in_gas in (False, True)]
    assert len(table) == sum(len(reynolds) for reynolds, _ in parts) == 594
    reynolds, shields = parts[0]
    row = table.iloc[0]
    assert shields[0] == row["shields"]
    excess = (row["rho_sol_kg_m3"] - row["rho_f_kg_m3"]) / row["rho_f_kg_m3"]
    speed = math.sqrt(shields[0] * excess * 9.81 * row["d_m"])
    assert reynolds[0] == pytest.approx(speed * row["d_m"] / row["nu_m2_s"])
    assert len(parts[1][0]) == (table["rho_f_kg_m3"] < 100).sum() == 3


def test_the_bins_follow_each_other_and_are_those_of_the_rows() -> None:
    assert sum(b.count for b in BUFFINGTON_MONTGOMERY) == 240
    for bins in (BUFFINGTON_MONTGOMERY, VISUAL):
        assert all(one.high == other.low for one, other in pairwise(bins))
        assert all(
            b.low < b.middle < b.high and b.tenth < b.median < b.ninetieth for b in bins
        )
    rows = pd.read_csv(MEASURED_BEDS)
    excess = (rows["rho_sol_kg_m3"] / rows["rho_f_kg_m3"] - 1) * 9.81 * rows["d_m"]
    reynolds = np.sqrt(rows["shields"] * excess) * rows["d_m"] / rows["nu_m2_s"]
    for one in VISUAL:
        here = (
            (rows["set"] == "flumes, visual")
            & (reynolds >= one.low)
            & (reynolds < one.high)
        )
        theta = sorted(rows["shields"][here])
        n, found = len(theta), (one.count, one.median, one.tenth, one.ninetieth)
        assert found == pytest.approx(
            (n, np.median(theta), theta[n // 10], theta[9 * n // 10])
        )
    assert sorted(rows["shields"][rows["set"] == "wind, field"]) == sorted(FIELD)


def test_what_was_measured_stands_beside_a_threshold() -> None:
    fluids = {
        "rho_f_kg_m3": [1e3, 1e3, 1.22, 0.02],
        "nu_m2_s": [1e-6, 1e-6, 1.5e-5, 5e-4],
    }
    rows = {
        "reynolds": [5.0, 2e3, 10.0, 1.0],
        "d_m": [3.5e-4, 0.05, 3.5e-4, 1e-4],
        **fluids,
    }
    bed: dict[str, Any] = {
        "rho_sol_kg_m3": 2650.0,
        "g_m_s2": 9.81,
        "shields": 0.02,
        "force_law": "none",
    }
    bed |= {
        "alpha_deg": 0.0,
        "beta_deg": 60.0,
        "z0_m": 1e-5,
        "alpha_s": 1.0,
        "cohesion_n_m": 0.0,
    }
    table = pd.DataFrame(rows).assign(**bed)
    curve, median, *_, count = (beside(table)[name] for name in MEASURED)
    np.testing.assert_array_equal(count, [46, 0, 3, 0])
    np.testing.assert_array_equal(median, [0.0395, np.nan, 0.0126, np.nan])
    # Soulsby and Whitehouse at D* 8.853; Shao and Lu's u* is 0.317 m/s for this sand in air
    water = float(curves.soulsby_whitehouse(np.array(8.853)))
    air = 1.22 * 0.317**2 / ((2650 - 1.22) * 9.81 * 3.5e-4)
    assert curve[[0, 2]] == pytest.approx([water, air], rel=0.01)
    # the curve is one of the Earth's air: on Mars nothing was measured
    assert np.isnan(curve[3])


def test_pivots_and_hiding_of_a_natural_bed() -> None:
    np.testing.assert_allclose(90 - kirchner_pivot([0, 30, 100]), [60, 45, 10])
    assert float(kirchner_pivot(50, 2.0)) == pytest.approx(55 * 2**-0.3)
    assert float(wilcock_crowe_hiding(1.0)) == 1
    assert float(egiazaroff_hiding(1.0)) == pytest.approx(1)
    size = np.array([0.2, 0.5, 2.0, 5.0])
    assert np.all(np.diff(wilcock_crowe_hiding(size)) > 0)
    assert np.all(np.diff(egiazaroff_hiding(size)) < 0)
    # b = 0.67/(1 + e^0.5) at half the mean, tends to 0.67 for the largest
    assert float(wilcock_crowe_hiding(0.5)) == pytest.approx(
        0.5 ** (0.67 / 3.718281828459045)
    )
    assert float(wilcock_crowe_hiding(20.0)) == pytest.approx(20**0.67, rel=1e-6)
    assert np.all(np.isnan(egiazaroff_hiding([0.01, 1 / 19.01])))
    assert float(egiazaroff_hiding(2.0)) == pytest.approx(
        (2.944438979 / 3.637586160) ** 2
    )


def test_curves_at_points() -> None:
    # each worked out by hand from the published formula
    for formula, x, theta in (
        (curves.soulsby_whitehouse, 1.0, 0.30 / 2.2 + 0.055 * 0.019801326693),
        (curves.paphitis, 1.0, 0.094 + 0.0475 * (1 - 0.699 * 0.985111939603)),
        (curves.mantz, 0.1, 0.199526231497),
        (curves.van_rijn, 2.0, 0.12),
        (curves.van_rijn, 8.0, 0.14 * 0.264254546),
        (curves.van_rijn, 200.0, 0.055),
        (curves.yalin_karahan, 0.5, 0.123114441334),
        (curves.yalin_karahan, 100.0, 0.045),
        (curves.brownlie, 1.0, 0.22 + 0.06 * 10**-7.7),
    ):
        assert float(formula(np.array([x]))[0]) == pytest.approx(theta, rel=1e-6)


def test_iversen_white_solves_its_implicit_equation_on_both_branches() -> None:
    d = np.array([5e-5, 1e-4, 5e-4, 1e-3])
    air = Grain(diameter=d, density=2650.0, fluid_density=1.2, viscosity=1.5e-5)
    ustar = curves.iversen_white(air)
    reynolds = ustar * d / air.viscosity
    assert reynolds[0] < 10 < reynolds[-1]
    cohesion = 1 + 6e-7 / (air.density * air.gravity * d**2.5)
    scale = np.sqrt(air.density / air.fluid_density * air.gravity * d * cohesion)
    slow = 0.129 * scale / np.sqrt(1.928 * reynolds**0.092 - 1)
    fast = 0.12 * scale * (1 - 0.0858 * np.exp(-0.0617 * (reynolds - 10)))
    np.testing.assert_allclose(ustar, np.where(reynolds <= 10, slow, fast), rtol=1e-9)


def test_points_turn_the_dimensionless_diameter_into_a_reynolds_number() -> None:
    (curve,) = [each for each in curves.WATER if each.name.startswith("van Rijn")]
    reynolds, theta = curve.points(50)
    dstar = np.geomspace(curve.low, curve.high, 50)
    np.testing.assert_allclose(theta, curves.van_rijn(dstar))
    np.testing.assert_allclose(reynolds, np.sqrt(theta) * dstar**1.5)


def test_curves_for_air_agree_in_order_of_magnitude_for_sand() -> None:
    sand = Grain(diameter=2.5e-4, density=2650.0, fluid_density=1.2, viscosity=1.5e-5)
    found = [float(curve(sand)) for curve in curves.AIR.values()]
    assert 0.2 < min(found) < max(found) < 0.35
