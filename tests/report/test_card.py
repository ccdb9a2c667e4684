"""The answer card: its numbers, its text, and what they are computed from."""

import math

import numpy as np
import pandas as pd
import pytest

from orchestrator.physics import verdict
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import PEAK, peak_over_mean
from orchestrator.physics.reported import in_units
from orchestrator.physics.threshold import thresholds_of
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.report import answers, figures, shields, single, style, units
from orchestrator.report.card import Card, Number, Worth, lines
from orchestrator.report.figures import fractions
from orchestrator.report.figures import grain as of_one
from orchestrator.report.figures import shields as overview
from orchestrator.report.results import Results
from tests.report.conftest import axes_of, changed, copies, legend_of, only

WIND = Number(13.44, "m/s", "wind", low=9.947, high=13.44, other=9.683)
WORTH = Worth("care", "usable, with a correction", "Take the measured value.")


def test_ends_have_the_digits_of_their_number() -> None:
    assert (WIND.figure, WIND.interval, WIND.beside) == ("13.4", "9.9 … 13.4", "9.7")
    stress = Number(19.2, "Pa", "", last=38.0, low=math.nan, high=40.0)
    assert (stress.figure, stress.interval) == ("19.2–38.0", "below 40.0, open")
    alike = Number(0.1719, "Pa", "", low=0.1717, high=0.1721)
    assert (alike.figure, alike.interval) == ("0.17", "0.1717 … 0.1721")
    count = Number(7, "of 17", "claims", decimals=0)
    assert (count.figure, count.interval, count.beside) == ("7", "", "")


def test_a_card_has_at_most_three_numbers() -> None:
    with pytest.raises(ValueError, match="at most 3"):
        Card("?", "", (WIND,) * 4, "", WORTH)


def test_a_terminal_has_all_that_a_card_has() -> None:
    card = Card("At which wind?", "One grain.", (WIND,), "wind tunnels", WORTH)
    said = [*lines(card)]
    assert all(len(line) < 80 for line in said)
    text = " ".join(" ".join(said).split())
    for part in ("At which wind?", "13.4 m/s", "9.9 … 13.4", "9.7"):
        assert part in text
    assert "◐ Usable, with a correction. Take the measured value." in text


def test_measured_is_the_same_flow_with_the_measured_threshold(
    results: Results,
) -> None:
    """u*_0 goes with the threshold of a grain, the wind with u*_0 by the log law."""
    rows = only(results, "pile").joined("pile_threshold")
    ratio = rows["compared_level_ustar_m_s"] / rows["level_ustar_m_s"]
    np.testing.assert_allclose(rows["compared_ustar0_m_s"], ratio * rows["ustar0_m_s"])
    row = rows.iloc[0]
    (wind,) = measurable_speeds(
        [row["compared_ustar0_m_s"]],
        roughness=row["z0_m"],
        fluid_density=row["rho_f_kg_m3"],
        viscosity=row["nu_m2_s"],
        depth=math.nan,
    )["wind_10m_m_s"]
    assert row["compared_wind_10m_m_s"] == pytest.approx(wind)
    root = np.sqrt(rows["shields_low"] / rows["shields"])
    np.testing.assert_allclose(rows["ustar0_low_m_s"], root * rows["ustar0_m_s"])
    stress = rows["rho_f_kg_m3"] * rows["ustar0_high_m_s"] ** 2
    np.testing.assert_allclose(rows["stress_high_pa"], stress)


def test_a_grain_that_is_within_what_was_measured_needs_no_correction(
    results: Results,
) -> None:
    first = only(results, "grain").joined("single_grain").iloc[0]
    row = {str(name): value for name, value in first.items()}
    row["ustar0_m_s"] = row["ustar_m_s"]
    row["shields"] = row["shields_closed_form"]
    # a curve alone is no measurement
    row["tested_rows"] = 0
    row["measured_rows"] = 0
    row["compared_level_ustar_m_s"] = row["level_ustar_m_s"]
    assert verdict.verdict(row, []) == verdict.CORRECTED
    # an answer below its own interval is not within what was measured
    theta = row["shields"]
    row["tested_rows"] = 20
    row["tested_low"], row["tested_high"] = theta / 2, 2 * theta
    assert verdict.verdict(row, []) == verdict.USABLE
    row["tested_low"] = 1.1 * theta
    assert verdict.verdict(row, []) == verdict.CORRECTED
    row["compared_level_ustar_m_s"] = math.nan
    assert verdict.verdict(row, []) == verdict.COMPARED
    # a correction has an upper limit
    for factor, limit in ((1.9, 0), (2.1, 1)):
        row["compared_level_ustar_m_s"] = factor * row["level_ustar_m_s"]
        against = [*verdict.of_measurements(row, is_closed=True)]
        assert [each.code for each in against] == ["correction"] * limit
    reason = verdict.Reason("law", "Re* 9 is not below 3", 'choose "bridged"')
    columns = verdict.columns([row], [[reason]])
    worth = single.worth({**row, **{name: cell[0] for name, cell in columns.items()}})
    assert (worth.mark, worth.word) == ("bad", "not usable: Re* 9 is not below 3")
    assert worth.advice == 'Choose "bridged".'


def test_an_air_study_shows_what_was_measured_in_air(results: Results) -> None:
    air = copies(results, {"rho_f_kg_m3": 1.2, "reynolds": 10.0})
    (figure,) = overview.draw(air)
    said = legend_of(figure)
    assert shields.MEASURED in said
    shown = {line.get_gid() for ax in axes_of(figure) for line in ax.lines}
    assert "field" in shown
    assert "water" not in shown
    assert figure.canvas
    assert all(len(one.texts) <= 7 for one in figure.canvas.legends)
    # the paper's own gas stands beside water, as in the paper
    (paper,) = overview.draw(only(results, "pile"))
    assert "water" in {line.get_gid() for ax in axes_of(paper) for line in ax.lines}


def test_the_growth_of_motion_fits_a_narrow_page(results: Results) -> None:
    growth = next(fractions.draw(only(results, "pile")))
    assert growth.canvas
    assert growth.canvas.get_figwidth() == style.NARROW
    # in a gas no threshold was measured at this Re*: a formula stands beside it
    assert "with $θ_c$ of Shao and Lu" in legend_of(growth)


def test_one_bed_has_its_picture_and_its_growth_at_the_head(results: Results) -> None:
    heap = only(results, "pile")
    places: dict[str, str] = {}
    for kind in figures.kinds():
        places |= {figure.name: figure.place for figure in kind.draw(heap)}
    assert places["bed-alpha15"] == "lead"
    assert places["share"] == "under"
    assert not {"where", "sweep", "sizes", "grain", "laws"} & places.keys()
    *_, place = answers.card(heap).numbers
    row = heap.joined("pile_threshold").iloc[0]
    assert place.value == pytest.approx(1e3 * row["first_x_m"])


def test_the_growth_of_motion_passes_through_the_answer(results: Results) -> None:
    heap = only(results, "pile")
    (figure, *_) = fractions.FIGURE.draw(heap)
    (ax,) = axes_of(figure)
    of_both = [line for line in ax.lines if not line.get_gid()]
    measured, computed = of_both
    (card,) = [line for line in ax.lines if line.get_gid() == "card"]
    (model,) = [line for line in ax.lines if line.get_gid() == "model"]
    row = heap.exemplars.iloc[0]
    curve = heap.tables["pile_curve"]
    told = single.quantity_of_row(row)
    assert np.asarray(computed.get_xdata()) == pytest.approx(
        units.told_by(row, curve["ustar0_m_s"], told)
    )
    assert np.asarray(computed.get_ydata()).tolist() == curve["fraction_moved"].tolist()
    ratio = units.compared_over_computed(row)
    assert np.asarray(measured.get_xdata()) == pytest.approx(
        units.told_by(row, ratio * curve["ustar0_m_s"], told)
    )
    ((flow, part),) = np.asarray(card.get_xydata(), float)
    number = answers.card(heap).numbers[0]
    assert flow == pytest.approx(number.value)
    assert part == row["fraction"]
    # in the article's gas both numbers have equal right
    assert number.is_pair
    assert np.asarray(model.get_xdata())[0] == pytest.approx(number.other)


def test_motion_starts_within_the_interval_of_its_place(results: Results) -> None:
    heap = only(results, "pile")
    table = heap.tables["pile_threshold"]
    # no error was measured at the first of so many grains
    assert table["first_numerical_error"].isna().all()
    assert math.isnan(answers.card(heap).numbers[-1].low)
    wide = changed(heap, pile_threshold=table.assign(first_numerical_error=0.5))
    narrow = changed(heap, pile_threshold=table.assign(first_numerical_error=0.0))
    ends = []
    for each in (narrow, wide):
        place = answers.card(each).numbers[-1]
        assert place.low <= place.value <= place.high
        ends.append((place.low, place.high))
    assert ends[1][0] < ends[0][0]
    assert len(table)


def test_the_first_motion_has_an_interval_in_its_unit(results: Results) -> None:
    heap = only(results, "pile")
    row = heap.joined("pile_threshold").iloc[0]
    first = row["first_wind_10m_m_s"]
    assert math.isnan(row["first_wind_10m_low_m_s"])
    assert math.isnan(row["first_wind_10m_high_m_s"])
    assert math.isnan(answers.card(heap).numbers[1].other_low)
    ends = {
        "first_wind_10m_low_m_s": 0.9 * first,
        "first_wind_10m_high_m_s": 1.1 * first,
    }
    known = heap.tables["pile_threshold"].assign(**ends)
    number = answers.card(changed(heap, pile_threshold=known)).numbers[1]
    assert number.other_low < number.other < number.other_high
    beside: dict[str, float | str] = {"tested_rows": 20.0, "tested_held": 0.8}
    beside |= {"interval_of": "measured thresholds"}
    beside |= {"first_wind_10m_low_m_s": first / 2}
    beside |= {"first_wind_10m_high_m_s": 2 * first}
    table = heap.tables["pile_threshold"].assign(**beside, advised="model")
    tested = answers.card(changed(heap, pile_threshold=table)).numbers[1]
    assert "80 % of 20 measured" in tested.interval_of
    # a stress goes with the square of the friction velocity, and of the wind
    assert tested.low == pytest.approx(tested.value / 2, rel=0.1)
    assert tested.high == pytest.approx(2 * tested.value, rel=0.1)


def test_the_answer_of_a_picture_is_that_of_the_card() -> None:
    """By force law and by size, of a grain that must go on and of one that leaves."""
    asked: dict[str, float | str] = {
        "d_m": 2.5e-4,
        "z0_m": 2.5e-4 / 30,
        "rho_f_kg_m3": 1.225,
        "nu_m2_s": 1.46e-5,
        "alpha_s": 1.615,
        "rho_sol_kg_m3": 2650.0,
        "alpha_deg": 0.0,
        "beta_deg": 60.0,
        "g_m_s2": 9.81,
        "cohesion_n_m": 0.0,
        "force_law": "bridged",
    }
    leaves = answers.by_law(pd.Series(asked))["bridged"][0]
    by_law = answers.by_law(pd.Series({**asked, "criterion": "sustained"}))
    goes_on, holds = by_law["bridged"]
    steady = thresholds_of("bridged", Grain.of_table(asked))
    assert leaves == pytest.approx(float(steady.friction_velocity))
    # a gust of 2.28 times the mean stress turns it over
    gust = leaves / math.sqrt(PEAK)
    assert goes_on == pytest.approx(gust)
    assert holds
    peak = peak_over_mean(0.4, 100)
    under = answers.by_law(pd.Series({**asked, "gust": peak}))["bridged"][0]
    assert under == pytest.approx(leaves / math.sqrt(peak))


@pytest.mark.parametrize("width", [style.WIDE, style.NARROW])
@pytest.mark.parametrize("measured", [0.7, 1.0, 1.4])
def test_labels_of_the_picture_of_a_grain_lie_on_no_points(
    results: Results, measured: float, width: float
) -> None:
    grain = only(results, "grain").joined("single_grain").iloc[0].copy()
    # of this roughness the thresholds of grains in sustained motion are tabulated
    grain["z0_m"] = grain["d_m"] / 30
    ustar = grain["ustar_m_s"]
    columns = in_units(ustar, grain)
    columns |= in_units(measured * ustar, grain, before="compared_")
    grain = pd.Series({**grain, **columns})
    with style.settings(style.LETTERS):
        canvas = of_one.grain_panels(grain, width)
        canvas.draw_without_rendering()
    for ax in canvas.axes:
        labels = [text for text in ax.texts if text.get_text()]
        assert labels
        for label in labels:
            box = label.get_window_extent()
            assert canvas.bbox.x0 <= box.x0
            assert box.x1 <= canvas.bbox.x1
            for line in ax.lines:
                if line.get_marker() == "None":
                    continue
                points = ax.transData.transform(line.get_xydata())
                assert not any(box.contains(x, y) for x, y in points)
