"""The number that a reader is told to take: it is the large one, within its band."""

import math
from pathlib import Path

import numpy as np
import pytest

from orchestrator.calculator.answer import grain_card
from orchestrator.calculator.table import thresholds
from orchestrator.physics import verdict
from orchestrator.physics.reported import (
    MEASURED,
    NUMERICAL,
    REPORTED,
    compared_range,
)
from orchestrator.report import answers, labels, sheets, single, words
from orchestrator.report.card import Card, Number, lines
from orchestrator.report.figures import fractions
from orchestrator.report.results import Results
from orchestrator.report.style import Figure
from orchestrator.runs import terminal
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
    # the other numbers stand in the table alone
    assert "In the table, numbers with" in card.source
    assert "In the table" not in answers.card(heap).source
    level = heap.tables["scenes"].assign(bed_shape="flat")
    card = answers.card(changed(heap, pile_threshold=bad, scenes=level))
    assert card.numbers[0].is_measured
    assert "A level bed has θ_c = " in card.source
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
        # nothing of a computed flow that is not usable is left, but the other one is
        np.testing.assert_array_equal(least, np.fmin(rows, rows * 0 + other))
        assert (most[is_known] >= other[is_known]).all()
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


GRAINS = """
grain.density = 2650.0
bed = { kind = "grain" }
axes = { "grain.diameter" = [1e-4, 3e-4, 1e-3, 4e-3], "bed.slope_deg" = [0.0, 15.0] }
"""
PILE = """
grain = { diameter = 1e-3, density = 2650.0 }
method.kind = "pivot"
method.flow.model = "flat"
[bed]
kind = "pile"
slope_deg = 15.0
height = 0.01
"""
STUDIES = {
    "grains in air": f'fluid.kind = "air"\n{GRAINS}',
    "grains in water": f'fluid.kind = "water"\n{GRAINS}',
    "grains in the article's gas": f'fluid.kind = "paper"\n{GRAINS}',
    "grains by many laws": f'fluid.kind = "water"\n{GRAINS}'.replace(
        '"bed.slope_deg" = [0.0, 15.0]', '"forces.law" = ["bridged", "profile", "high"]'
    ),
    "a pile in air": f'fluid.kind = "air"\n{PILE}',
    "a pile in water": f'fluid.kind = "water"\n{PILE}',
    "a pile in the article's gas": f'fluid.kind = "paper"\n{PILE}',
    "a level bed": f'fluid.kind = "water"\n{PILE}'.replace(
        "slope_deg = 15.0\nheight = 0.01", 'shape = "flat"\nlength = 0.02'
    ),
}
"""Studies that need no solver."""


def _check_tables(results: Results) -> int:
    """How many numbers of the tables have an interval; each lies in its own."""
    bands = 0
    for name in ("pile_threshold", "single_grain"):
        table = results.joined(name)
        for before in ("", "first_", "compared_", "compared_first_"):
            for stem, unit in REPORTED.items():
                columns = [
                    f"{before}{stem}{end}{unit}" for end in ("", "_low", "_high")
                ]
                if not {*columns} <= {*table}:
                    continue
                for value, low, high in table[columns].astype(float).to_numpy():
                    if np.isfinite(value):
                        assert _is_within(value, low, high), columns[0]
                        bands += bool(np.isfinite([low, high]).any())
    return bands


def _check_sheet(sheet: sheets.Sheet) -> int:
    """How many cells of the advised column stand before an interval that holds them."""
    heads = [*sheet.frame]
    if sheet.main not in heads:
        return 0
    band = heads[heads.index(sheet.main) + 1]
    if not band.startswith("interval"):
        return 0
    found = 0
    for cell, ends in sheet.frame[[sheet.main, band]].itertuples(index=False):
        low, _, high = ends.partition(" … ")
        if high and cell != "—":
            # all three are rounded to three digits
            assert float(low) * 0.995 <= float(cell) <= float(high) * 1.005, cell
            found += 1
    return found


@pytest.mark.parametrize("name", STUDIES)
def test_what_is_advised_lies_in_its_band_on_card_in_tables_figures_and_terminal(
    name: str, tmp_path: Path
) -> None:
    results = small_study.run(tmp_path, STUDIES[name])
    card = answers.card(results)
    sheet = sheets.short(results)
    assert sheet is not None
    bands = [_check(card), _check_tables(results), _check_sheet(sheet)]
    # what is not usable may have none
    assert all(bands) or card.worth.mark == "bad"
    said = " ".join(terminal.plain(words.answer_text(results)).split())
    for number in card.numbers:
        assert number.interval in said
    bars = 0
    if all(needed in results.tables for needed in fractions.FIGURE.needs):
        for figure in fractions.FIGURE.draw(results):
            bars += _check_bars(figure)
    assert bars or card.worth.mark == "bad" or name.startswith(("grains", "a level"))


def _check_bars(figure: Figure) -> int:
    """How many bars of a figure stand beside a disc of the card, which lies in them."""
    if figure.canvas is None:
        return 0
    found = 0
    for axes in figure.canvas.axes:
        drawn = [(line.get_gid(), np.asarray(line.get_xdata())) for line in axes.lines]
        bars = [x for gid, x in drawn if gid == "interval"]
        for disc in (x for gid, x in drawn if gid == "card"):
            for bar in bars:
                assert _is_within(float(disc[0]), float(bar.min()), float(bar.max()))
                found += 1
    return found
