"""The band for water, the lines for air, and the closed form as lines."""

import numpy as np
import pandas as pd
import pytest

from orchestrator.physics import curves
from orchestrator.physics.laws import LAWS
from orchestrator.report import theory
from orchestrator.report.results import Results


def test_band_holds_every_curve_within_its_range() -> None:
    for curve in curves.WATER:
        reynolds, theta = curve.points(2000)
        low, high = theory.water_band(reynolds)
        common = np.isfinite(low)
        assert common.sum() > 1500
        inside = (theta > 0.998 * low) & (theta < 1.002 * high)
        # curves made of pieces jump where these meet
        assert inside[common].mean() > 0.995


def test_band_is_the_envelope_of_the_curves_that_cover_a_place() -> None:
    place = np.array([0.02, 0.1, 5.0, 50.0])
    found = []
    for curve in curves.WATER:
        reynolds, theta = curve.points(4000)
        found.append(np.interp(place, reynolds, theta, left=np.nan, right=np.nan))
    low, high = theory.water_band(place)
    assert low == pytest.approx(np.nanmin(found, axis=0), rel=2e-3)
    assert high == pytest.approx(np.nanmax(found, axis=0), rel=2e-3)


def test_air_needs_a_gas(results: Results) -> None:
    grains = results.beds("grain")
    assert set(theory.air_lines(grains)) == set(curves.AIR)
    assert theory.air_lines(grains.assign(rho_f_kg_m3=1000.0)) == {}


@pytest.fixture
def bed(results: Results) -> pd.DataFrame:
    """Grains on one flat bed."""
    flat = results.beds("grain").query("alpha_deg == 0 and beta_deg == 60")
    return flat[flat["z0_over_d"] == 0.1]


def test_closed_form_lines_are_solid_where_their_equation_holds(bed: pd.DataFrame) -> None:
    low, high = theory.branches(bed)
    assert (low.law, high.law) == ("low", "high")
    assert (low.valid == (low.reynolds < LAWS["low"].reynolds[1])).all()
    inside = high.reynolds < theory.drag_law_limit(0.1)
    assert (high.valid == ((high.reynolds >= LAWS["high"].reynolds[0]) & inside)).all()
    assert not (low.valid & low.continued).any()
    assert low.valid.any()
    assert low.continued.any()


@pytest.mark.parametrize("law", LAWS)
def test_grains_of_every_law_lie_on_its_line(law: str, bed: pd.DataFrame) -> None:
    scenes = bed.assign(force_law=law)
    (line,) = [one for one in theory.branches(scenes) if one.law == law]
    exact = theory.thresholds(scenes, law)
    reynolds = np.array([one.reynolds for one in exact])
    read = np.interp(np.log(reynolds), np.log(line.reynolds), np.log(line.shields))
    assert np.exp(read) == pytest.approx([one.shields for one in exact], rel=1e-3)
    held = np.interp(reynolds, line.reynolds, line.valid)
    assert (held == [one.valid for one in exact])[(held == 0) | (held == 1)].all()


def test_the_fluid_does_not_move_a_line(bed: pd.DataFrame) -> None:
    air = theory.branches(bed)[0]
    water = theory.branches(bed.assign(rho_f_kg_m3=1000.0, nu_m2_s=1e-6))[0]
    read = np.interp(air.reynolds, water.reynolds, water.shields, left=np.nan, right=np.nan)
    both = np.isfinite(read)
    assert both.sum() > 100
    assert air.shields[both] == pytest.approx(read[both], rel=1e-3)


@pytest.mark.parametrize(("ratio", "limit"), [(1 / 30, 155.0), (1 / 10, 245.0)])
def test_drag_law_ends(ratio: float, limit: float) -> None:
    assert theory.drag_law_limit(ratio) == pytest.approx(limit, rel=0.02)
