"""The number that a reader is told to take: it is the large one, within its band."""

import math
from pathlib import Path

import numpy as np
import pytest

from orchestrator.calculator.answer import grain_card
from orchestrator.calculator.table import thresholds
from orchestrator.physics import verdict
from orchestrator.physics.reported import MEASURED, NUMERICAL, compared_range
from orchestrator.report import answers, labels, sheets, single
from orchestrator.report.card import Card, Number, lines
from orchestrator.report.results import Results
from tests import small_study
from tests.report.conftest import changed, only

SIZES = (5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 2e-2)
MEDIA = {
    "air": {"fluid_density": 1.225, "viscosity": 1.46e-5},
    "water": {"fluid_density": 999.1, "viscosity": 1.14e-6},
    "of the article": {"fluid_density": 1.0, "viscosity": 1e-5},
}


def _is_within(value: float, low: float, high: float) -> bool:
    """Whether a number lies in an interval, whose open ends are NaN."""
    slack = 1 + 1e-9
    return not (value * slack < low or value > high * slack)


def _check(card: Card) -> int:
    """How many numbers of a card have an interval; each lies in its own."""
    for number in card.numbers:
        assert _is_within(number.value, number.low, number.high), number
        assert _is_within(number.other, number.other_low, number.other_high), number
    return sum(bool(number.interval) for number in card.numbers)


@pytest.mark.parametrize("medium", MEDIA)
@pytest.mark.parametrize("slope", [0.0, 20.0])
def test_the_large_number_of_a_grain_lies_in_the_band_beside_it(
    medium: str, slope: float
) -> None:
    bands = 0
    for size in SIZES:
        fluid = {name: [value] for name, value in MEDIA[medium].items()}
        points = {"diameter": [size], "density": [2650.0], "slope_deg": [slope]}
        table = thresholds({**points, **fluid}, "auto")
        rows = [
            dict(zip(table, cells, strict=True))
            for cells in zip(*(each.tolist() for each in table.values()), strict=True)
        ]
        bands += _check(grain_card(rows))
    assert bands


AIR = """
fluid.kind = "air"
grain.density = 2650.0
bed = { kind = "grain" }
axes = { "grain.diameter" = [2e-4, 5e-4, 1e-3], "bed.slope_deg" = [0.0, 20.0] }
"""


def test_all_rows_of_a_study_stand_on_one_basis(tmp_path: Path) -> None:
    """One corrected threshold corrects all: a curve of both kinds is none."""
    results = small_study.run(tmp_path, AIR)
    table = results.tables["single_grain"]
    assert set(table["advised"]) == {verdict.MODEL}
    rows = results.joined("single_grain").to_dict("records")
    rows[2]["verdict"] = verdict.CORRECTED
    assert verdict.advised(rows) == verdict.WITH_MEASURED
    rows[3]["compared_level_ustar_m_s"] = math.nan
    # a row without another number keeps its own: both stand in all rows
    assert verdict.advised(rows) == verdict.BOTH
    corrected = changed(
        results, single_grain=table.assign(advised=verdict.WITH_MEASURED)
    )
    card = answers.card(corrected)
    of_row = sheets.single_grains_sheet(corrected).sort_values("compared_wind_10m_m_s")
    assert card.numbers[0].value == of_row["compared_wind_10m_m_s"].iloc[0]
    assert card.numbers[0].other == of_row["wind_10m_m_s"].iloc[0]
    assert card.numbers[0].other_is == single.MODEL_ALONE
    _check(card)
    sheet = sheets.short(corrected)
    assert sheet is not None
    assert sheet.main == "wind at 10 m with θ_c of Shao and Lu, m/s"
    shown = [f"{value:#.3g}" for value in of_row["compared_wind_10m_m_s"]]
    assert sorted(sheet.frame[sheet.main]) == sorted(shown)


def test_both_numbers_of_the_articles_pile_stand_on_its_card(results: Results) -> None:
    heap = only(results, "pile")
    row = heap.joined("pile_threshold").iloc[0]
    assert row["advised"] == verdict.BOTH
    card = answers.card(heap)
    number = card.numbers[0]
    assert number.is_pair
    assert (number.value, number.other) == pytest.approx(
        tuple(heap.exemplars.iloc[0][["compared_wind_10m_m_s", "wind_10m_m_s"]])
    )
    assert _check(card)
    # the terminal has the same numbers and intervals
    said = " ".join(" ".join(lines(card)).split())
    for part in (number.figure, number.interval, number.beside, number.other_interval):
        assert part in said
    # and so has the table
    sheet = sheets.short(heap)
    assert sheet is not None
    (line,) = sheet.frame[sheet.frame[sheets.PART] == "30 %"].to_dict("records")
    assert line[sheet.main] == f"{number.value:#.3g}"
    assert line["interval, m/s"] == labels.interval(number.low, number.high)
    model = labels.interval(number.other_low, number.other_high)
    assert line["interval by the model, m/s"] == model


def test_a_number_that_is_not_usable_is_grey_beside_what_was_measured(
    results: Results,
) -> None:
    heap = only(results, "pile")
    bad = heap.tables["pile_threshold"].assign(
        usable=False, verdict=verdict.UNUSABLE, why_not="it is", remedy=""
    )
    card = answers.card(changed(heap, pile_threshold=bad))
    # the flow over a pile is computed: nothing beside it is measured
    assert [number.is_grey for number in card.numbers] == [True] * len(card.numbers)
    level = heap.tables["scenes"].assign(bed_shape="flat")
    card = answers.card(changed(heap, pile_threshold=bad, scenes=level))
    assert card.numbers[0].is_measured
    assert not card.numbers[0].is_grey
    assert card.numbers[1].is_grey


@pytest.mark.parametrize("usable", [True, False])
@pytest.mark.parametrize("of", [MEASURED, NUMERICAL])
def test_the_band_of_a_corrected_flow_holds_all_that_is_known(
    of: str, usable: bool
) -> None:
    random = np.random.default_rng(52)
    count = 400
    own = random.uniform(0.1, 1.0, count)
    other = own * random.uniform(0.5, 2.0, count)
    low = np.where(random.random(count) < 0.2, np.nan, own * 0.9)
    high = np.where(random.random(count) < 0.2, np.nan, own * 1.2)
    rows = np.where(random.random(count) < 0.5, np.nan, other * 0.8)
    columns = {
        "ustar0_low_m_s": low,
        "ustar0_high_m_s": high,
        "compared_ustar0_m_s": other,
        "measured_ustar0_low_m_s": rows,
        "measured_ustar0_high_m_s": 2 * rows,
        "interval_of": np.full(count, of, object),
    }
    least, most = compared_range(columns, own, np.full(count, usable))
    is_known = np.isfinite(rows)
    assert (
        least[is_known & np.isfinite(least)] <= rows[is_known & np.isfinite(least)]
    ).all()
    if not usable:
        # nothing of a computed flow that is not usable is left
        np.testing.assert_array_equal(least, rows)
        return
    is_open = np.isnan(low) & np.isfinite(high)
    assert np.isnan(least[is_open]).all()
    closed = np.isfinite(low) & np.isfinite(high)
    for value in (own, other):
        assert (least[closed] <= value[closed]).all()
        assert (most[closed] >= value[closed]).all()
    scale = 1.0 if of == MEASURED else other / own
    assert (least[closed] <= (low * scale)[closed] * (1 + 1e-12)).all()


def test_a_range_of_fluids_is_no_number(tmp_path: Path) -> None:
    """The least of water and the most of air say nothing together."""
    text = """
grain = { diameter = 1e-3, density = 2650.0 }
bed = { kind = "grain" }
group = [
  { name = "water", fluid = { kind = "water" } },
  { name = "air", fluid = { kind = "air" } },
]
"""
    results = small_study.run(tmp_path, text)
    numbers: tuple[Number, ...] = answers.card(results).numbers
    assert len(numbers) == 2
    assert all(math.isnan(number.last) for number in numbers)
    assert ["lowest" in number.meaning for number in numbers] == [False, False]
