"""Lines beside thresholds: published curves, the closed form, and how it meets measurements."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import BUFFINGTON_MONTGOMERY
from orchestrator.physics.onset import of_grains
from orchestrator.physics.threshold import shields_at
from orchestrator.report import answers, shields, theory
from orchestrator.report.figures import shields as overview
from orchestrator.report.results import Results
from orchestrator.report.theory import Line, LineConditions

BED = LineConditions(0.0, 50.0, 1 / 30, 1.615)
MIDDLES = np.array([one.middle for one in BUFFINGTON_MONTGOMERY])


def bridged(first: float = 0.01, last: float = 1e3) -> Line:
    return Line("bridged", BED, first, last)


def test_factors_are_those_of_the_law_from_the_medians() -> None:
    tau = shields_at(
        LAWS["bridged"], MIDDLES, roughness_ratio=1 / 30, entrainment_angle_deg=50.0
    )
    for at, one in enumerate(BUFFINGTON_MONTGOMERY):
        factor = bridged().factors[at]
        # below Re* 0.3 are a dozen measurements, from 163 on the drag has no law
        if 0.3 < one.middle < 163:
            assert factor == pytest.approx(
                max(tau[at] / one.median, one.median / tau[at])
            )
        else:
            assert np.isnan(factor)
    assert bridged().median_factor == pytest.approx(1.19, abs=0.01)
    assert bridged().worst == pytest.approx((1.62, 0.548), abs=0.01)


@pytest.mark.parametrize("law", LAWS)
def test_ranges_are_where_a_law_is_between_the_percentiles(law: str) -> None:
    line = Line(law, BED, 0.01, 1e3)
    inside = np.zeros(len(theory.GRID), bool)
    for low, high in theory.ranges(line.met):
        inside |= (low < theory.GRID) & (high > theory.GRID)
    tau, holds = line.tau(theory.GRID), line.holds(theory.GRID)
    for x, y, valid, found in zip(theory.GRID, tau, holds, inside, strict=True):
        (one,) = [b for b in BUFFINGTON_MONTGOMERY if b.low <= x < b.high]
        assert found == (valid and one.tenth <= y <= one.ninetieth)
    decades = sum(np.log10(high / low) for low, high in theory.ranges(line.met))
    assert line.decades == pytest.approx(decades)


def test_only_where_the_study_has_grains_is_a_law_judged() -> None:
    narrow = bridged(5.0, 8.0)
    ((low, high),) = theory.ranges(narrow.met)
    assert (low, high) == pytest.approx((5.0, 8.0), rel=0.01)
    assert np.isfinite(narrow.factors).sum() == 1
    nowhere = bridged(400.0, 500.0)
    assert theory.ranges(nowhere.met) == []
    assert theory.theory_sheet([nowhere]).iloc[0].tolist()[3:] == [
        "nowhere",
        "0.0",
        "—",
        "—",
    ]


def test_a_grain_that_lies_loose_is_no_answer_of_a_line() -> None:
    steep = Line("bridged", LineConditions(0.0, 100.0, 1 / 30, 1.615), 0.01, 1e3)
    assert (steep.tau(MIDDLES) <= 0).any()
    assert np.isnan(steep.answers(MIDDLES)).all()
    assert np.isnan(steep.factors).all()
    assert theory.theory_sheet([steep]).iloc[0].tolist()[3:] == [
        "nowhere",
        "0.0",
        "—",
        "—",
    ]


def test_laws_that_answer_at_few_re_are_not_compared_with_the_curves_for_air(
    results: Results,
) -> None:
    """Eq. 2 and Eq. 4 hold below 3 and from 30 on: their median factor was infinite."""
    low = Line("low", BED, 1.7, 55.0)
    high = Line("high", BED, 1.7, 55.0)
    (found,) = theory._nearest_in_air(results, [low, high])
    assert found.text.startswith("None of the 2 combinations can be compared")
    assert "inf" not in found.text
    (found,) = theory._nearest_in_air(results, [low, bridged(0.1, 170.0)])
    assert "nearest in water has no threshold at half of these Re*" in found.text
    assert "inf" not in found.text
    (found,) = theory._nearest_in_air(results, [bridged(), bridged(0.1, 170.0)])
    assert "nearest in water has " in found.text
    assert found.factor <= found.of_first
    assert "inf" not in found.text


def test_the_card_of_many_laws_has_the_range_and_both_misfits(results: Results) -> None:
    best = [bridged(), bridged(0.1, 170.0), Line("low", BED, 0.1, 3.0)]
    findings = theory._nearest_in_air(results, best)
    decades, water, air = answers._numbers_of_laws(best, findings)
    assert decades.value == best[0].decades >= best[1].decades
    assert f"over {best[1].decades:.1f}" in decades.note
    assert (water.figure, water.unit) == (f"× {best[0].median_factor:.2f}", "")
    assert air.value == findings[0].of_first
    assert f"{findings[0].factor:.2f}" in air.note
    # without curves for air there is no such number
    assert len([*answers._numbers_of_laws(best, [])]) == 2


@pytest.fixture
def bed(results: Results) -> pd.DataFrame:
    """Grains on one flat bed."""
    flat = results.beds("grain").query("alpha_deg == 0 and beta_deg == 60")
    return flat[flat["z0_over_d"] == 0.1]


def test_closed_form_lines_are_solid_where_their_equation_holds(
    bed: pd.DataFrame,
) -> None:
    reynolds = np.geomspace(1e-3, 1e4, 800)
    low, high = theory.measured_lines(bed)
    assert (low.law, high.law) == ("low", "high")
    assert (low.holds(reynolds) == (reynolds < LAWS["low"].reynolds[1])).all()
    ends = reynolds[high.holds(reynolds)]
    # the drag law of Eq. 4 ends at a particle Reynolds number of 1000
    assert ends[[0, -1]] == pytest.approx([30, 245], rel=0.03)
    dotted = low.near(reynolds) & ~low.holds(reynolds)
    assert 3 <= reynolds[dotted].min() < reynolds[dotted].max() < 30


@pytest.mark.parametrize("law", LAWS)
def test_grains_of_every_law_lie_on_its_line(law: str, bed: pd.DataFrame) -> None:
    scenes = bed.assign(force_law=law)
    (line,) = [one for one in theory.measured_lines(scenes) if one.law == law]
    exact = of_grains(Grain.of_table(scenes), law)
    assert line.tau(exact.reynolds) == pytest.approx(exact.shields, rel=1e-6)
    assert (line.holds(exact.reynolds) == exact.valid).all()
    assert (line.first, line.last) == (exact.reynolds.min(), exact.reynolds.max())


@pytest.fixture
def several(results: Results, bed: pd.DataFrame) -> Results:
    """A study of the grains of one flat bed by three laws, and of piles."""
    grains = []
    for name in ("low", "bridged", "profile"):
        ids = bed["scene_id"] + name
        grains.append(bed.assign(force_law=name, scene_id=ids, law_holds=True))
    scenes = pd.concat([*grains, results.beds("pile")], ignore_index=True)
    kept = {name: results.tables[name] for name in ("pile_threshold", "wall_stress")}
    named = results.tables["methods"].columns.difference(["scene_id"])
    of_method = ["scene_id", *named]
    asked = scenes.drop(columns=of_method[1:])
    tables = {**kept, "scenes": asked, "methods": scenes[of_method]}
    return replace(results, tables=tables)


def test_many_laws_have_colours_of_their_own(several: Results) -> None:
    (figure,) = overview.draw(several)
    assert figure.canvas is not None
    (ax,) = figure.canvas.axes
    lines = [line for line in ax.lines if line.get_gid() == shields.RESULT[0]]
    colours = {line.get_color() for line in lines}
    met = [fit.law for fit in theory.best(theory.ranked(several)) if fit.decades > 0]
    assert len(met) > 1
    assert len(colours) == len(set(met))
    assert colours == {theory.look(name)[0] for name in met}
    (medians,) = (line for line in ax.lines if line.get_gid() == "medians")
    assert np.asarray(medians.get_ydata()).tolist() == theory.MEDIANS.tolist()
