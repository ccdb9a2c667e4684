"""The answer card: its numbers, its text, and what they are computed from."""

import math

import numpy as np
import pytest

from orchestrator.physics.velocity import measurable_speeds
from orchestrator.report import answers, head, shields, single
from orchestrator.report.card import Card, Number, Worth, lines
from orchestrator.report.results import Results
from tests.report.conftest import changed, copies, legend_of, only

WIND = Number(13.44, "m/s", "wind", low=9.947, high=13.44, measured=9.683)
WORTH = Worth("care", "usable, with a correction", "Take the measured value.")


def test_ends_have_the_digits_of_their_number() -> None:
    assert (WIND.figure, WIND.interval, WIND.beside) == ("13.4", "9.9 … 13.4", "9.7")
    stress = Number(19.2, "Pa", "", last=38.0, low=math.nan, high=40.0)
    assert (stress.figure, stress.interval) == ("19.2–38.0", "below 40.0")
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
    for part in ("At which wind?", "13.4 m/s", "9.9 … 13.4", "9.7 wind"):
        assert part in text
    assert "◐ Usable, with a correction: take the measured value." in text


def test_measured_is_the_same_flow_with_the_measured_threshold(
    results: Results,
) -> None:
    """u*_0 goes with the threshold of a grain, the wind with u*_0 by the log law."""
    rows = only(results, "pile").joined("pile_threshold")
    ratio = rows["measured_level_ustar_m_s"] / rows["level_ustar_m_s"]
    np.testing.assert_allclose(rows["measured_ustar0_m_s"], ratio * rows["ustar0_m_s"])
    row = rows.iloc[0]
    (wind,) = measurable_speeds(
        [row["measured_ustar0_m_s"]],
        roughness=row["z0_m"],
        fluid_density=row["rho_f_kg_m3"],
        viscosity=row["nu_m2_s"],
        depth=math.nan,
    )["wind_10m_m_s"]
    assert row["measured_wind_10m_m_s"] == pytest.approx(wind)
    root = np.sqrt(rows["shields_low"] / rows["shields"])
    np.testing.assert_allclose(rows["ustar0_low_m_s"], root * rows["ustar0_m_s"])
    stress = rows["rho_f_kg_m3"] * rows["ustar0_high_m_s"] ** 2
    np.testing.assert_allclose(rows["stress_high_pa"], stress)


def test_a_grain_that_is_within_what_was_measured_needs_no_correction(
    results: Results,
) -> None:
    row = only(results, "grain").joined("single_grain").iloc[0].copy()
    row["ustar0_m_s"] = row["ustar_m_s"]
    row["usable"] = True
    row["tested_rows"] = 0
    row["measured_rows"] = 0
    row["measured_level_ustar_m_s"] = row["level_ustar_m_s"]
    assert single.worth(row).mark == "good"
    row["measured_level_ustar_m_s"] = 1.2 * row["level_ustar_m_s"]
    assert single.worth(row).mark == "care"
    row["usable"] = False
    row["why_not"] = "Re* 9 is not below 3; choose forces.law = bridged"
    worth = single.worth(row)
    assert (worth.mark, worth.word) == ("bad", "not usable: Re* 9 is not below 3")
    assert worth.advice == "Choose forces.law = bridged."


def test_an_air_study_shows_what_was_measured_in_air(results: Results) -> None:
    air = copies(results, {"rho_f_kg_m3": 1.2, "reynolds": 10.0})
    (figure,) = shields.draw(air)
    said = legend_of(figure)
    assert "air: measured at 3 sites in the field" in said
    assert not [label for label in said if "water" in label]
    assert len(said) <= 14
    assert figure.canvas
    assert all(len(one.texts) <= 7 for one in figure.canvas.legends)
    # the paper's own gas stands beside water, as in the paper
    (paper,) = shields.draw(only(results, "pile"))
    assert [label for label in legend_of(paper) if "water" in label]


def test_pictures_are_drawn_for_two_widths_in_the_colours_of_the_page(
    results: Results,
) -> None:
    heap = only(results, "pile")
    assert head.of(heap) is None
    chosen = head.below(heap)
    assert chosen is not None
    html = head.written(chosen)
    assert html.count("<svg") == 2
    assert 'class="draw wide"' in html
    assert 'class="draw narrow"' in html
    assert "var(--answer)" in html
    assert "#c24e00" not in html
    place = answers.card(heap).numbers[0]
    row = heap.joined("pile_threshold").iloc[0]
    assert place.value == pytest.approx(1e3 * row["first_x_m"])


def test_motion_starts_within_the_interval_of_its_place(results: Results) -> None:
    heap = only(results, "pile")
    table = heap.tables["pile_threshold"]
    wide = changed(heap, methods=heap.tables["methods"].assign(error_estimate=0.5))
    narrow = changed(heap, methods=heap.tables["methods"].assign(error_estimate=0.0))
    ends = []
    for each in (narrow, wide):
        place = answers.card(each).numbers[0]
        assert place.low <= place.value <= place.high
        ends.append((place.low, place.high))
    assert ends[1][0] < ends[0][0]
    assert len(table)
