"""The answer in words and tables: every row has its scene, its interval and its doubts."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator.physics import verdict
from orchestrator.report import answers, labels, lines, remarks, sheets, shields
from orchestrator.report.figures import bed
from orchestrator.report.figures import shields as overview
from orchestrator.report.results import Results
from orchestrator.report.shields import LABEL, SHAPE
from orchestrator.study import fields
from orchestrator.tables.quoted import reported
from tests import small_study
from tests.report.conftest import changed, copies, legend_of, only

SHOWN = ("alpha_deg", "d_m")
OF_MODEL = f"{sheets.TAU_INTERVAL} by the model"
"""The interval of the small study: both numbers of the article's gas are in its table."""


@pytest.fixture
def table() -> pd.DataFrame:
    """Piles of two slopes, by two numbers of layers and two stiffnesses."""
    columns = "alpha_deg", "mobile_layers", "stiffness", "load_increment", "seed"
    rows = [
        (15, 1, 1e3, 0.02, 1),
        (15, 2, 1e3, 0.03, 2),
        (15, 1, 1e4, 0.02, 3),
        (25, 1, 1e3, 0.02, 4),
    ]
    return pd.DataFrame(rows, columns=columns).assign(d_m=1e-3, force_law="high")


def test_fields_that_tell_rows_apart(table: pd.DataFrame) -> None:
    assert labels.varying(table, *SHOWN) == ["stiffness", "mobile_layers"]
    assert labels.varying(table, *SHOWN, "mobile_layers") == ["stiffness"]
    assert labels.varying(table.iloc[[0, 3]], *SHOWN) == []
    # the method comes before the fields that it alone has
    methods = {
        "alpha_deg": 0.0,
        "rho_f_kg_m3": [1000.0, 1000.0, 1.2, 1000.0],
        "stiffness": [np.nan, np.nan, np.nan, 1e3],
        "method": ["pivot", "peeling", "peeling", "dem"],
        "update": [np.nan, 0.0, 0.0, 0.0],
    }
    assert labels.varying(pd.DataFrame(methods), "alpha_deg") == [
        "rho_f_kg_m3",
        "method",
    ]


def test_what_is_asked_parts_panels_and_what_answers_has_markers(
    table: pd.DataFrame,
) -> None:
    asked = table.assign(
        stiffness=1e3, packing=["aligned", "aligned", "horizontal", "aligned"]
    )
    panels, rows = shields.parted(asked.assign(method="dem"), *SHOWN)
    assert panels == ["packing"]
    assert rows[SHAPE].tolist() == ["o", "s", "o", "o"]
    names = [text.rpartition(", ")[2] for text in rows[LABEL]]
    assert names == [
        "mobile layers = 1",
        "mobile layers = 2",
        *["mobile layers = 1"] * 2,
    ]


def test_markers_are_few_enough_to_be_told_apart(table: pd.DataFrame) -> None:
    """Beyond seven the last fields have none, and labels say which of them differ."""
    base = table.iloc[:1].assign(method="dem")
    for count, labels_of in ((4, 4), (12, 1)):
        copies = [base.assign(mobile_layers=i + 1) for i in range(count)]
        panels, rows = shields.parted(pd.concat(copies, ignore_index=True), *SHOWN)
        assert panels == []
        assert rows[SHAPE].nunique() == rows[LABEL].nunique() == labels_of
    assert rows[LABEL].iloc[0].endswith("several mobile layers")
    many = [
        base.assign(method=method, mobile_layers=i + 1)
        for method, count in (("dem", 6), ("pivot", 1), ("peeling", 1))
        for i in range(count)
    ]
    _, rows = shields.parted(pd.concat(many, ignore_index=True), *SHOWN)
    assert rows.groupby(LABEL)["method"].unique().str.len().tolist() == [1, 1, 1]
    named = rows[LABEL].str.contains("several mobile layers")
    assert named.tolist() == [True] * 6 + [False] * 2


def test_a_fitted_function_is_not_called_measured() -> None:
    (head,) = (
        head
        for head, columns in sheets.SPANS_OF_SIZES.items()
        if "hiding_wilcock_crowe" in columns
    )
    assert head == "fitted (Wilcock & Crowe 2003)"


def test_page_lists_every_parameter(results: Results) -> None:
    rows = {row[2]: row[3:] for row in sheets.parameters(results).to_numpy().tolist()}
    used = [column for column in fields.COLUMNS if results.scenes[column].notna().any()]
    assert rows.keys() >= {fields.COLUMNS[column].name or column for column in used}
    assert rows["method.flow.first_cell_height"][0] == "default"


def test_the_picture_is_of_the_scene_that_the_sentence_is_about(
    results: Results,
) -> None:
    """Of a pile in water that is usable and one in air that is not, whatever their order."""
    air = {
        "rho_f_kg_m3": 1.2,
        "usable": False,
        "why_not": "smooth",
        "method": "dem",
    }
    water = {
        "rho_f_kg_m3": 1e3,
        "usable": True,
        "why_not": "",
        "method": "peeling",
    }
    for both in ((air, water), (water, air)):
        study = copies(results, *both)
        row, _ = next(bed.chosen(study))
        assert row["rho_f_kg_m3"] == 1e3
        (figure,) = bed.FIGURE.draw(study)
        assert "1000 kg/m³" in figure.title
        first = answers.card(study).numbers[0]
        assert (first.unit, "ρ_f = 1000 kg/m³" in first.meaning) == ("Pa", True)


def test_each_fluid_has_a_row_and_a_sentence(results: Results) -> None:
    fluids: list[dict[str, Any]] = [
        {"rho_f_kg_m3": rho, "d_m": 1e-3 * (1 + n), "usable": True}
        for rho in (1.2, 1e3)
        for n in range(sheets.MOST_ROWS)
    ]
    study = copies(results, *fluids)
    sheet = sheets.short(study)
    assert sheet is not None
    assert len(sheet.frame) == 2
    card = answers.card(study)
    assert "a gas of 1.2 kg/m³" in card.scene
    assert "a liquid of 1000 kg/m³" in card.scene


def test_seeds_are_one_row_with_one_number(results: Results) -> None:
    thetas = (0.04, 0.05, 0.09)
    wind = float(results.at_fraction["wind_10m_m_s"].iloc[0])
    ends = {
        "wind_10m_low_m_s": wind * np.sqrt(0.04 / 0.06),
        "wind_10m_high_m_s": wind * np.sqrt(0.09 / 0.06),
    }
    seeds = (
        {"seed": n, "packing": "disordered", "shields": t, **ends}
        for n, t in enumerate(thetas)
    )
    study = copies(results, *seeds)
    sheet = sheets.short(study)
    assert sheet is not None
    assert set(sheet.frame[sheets.VERDICT]) == {"3 of 3 seeds usable"}
    # one number, as on the card, in an interval that holds those of all
    assert set(sheet.frame[f"{sheets.TAU_HEAD} by the model"]) == {"0.0600"}
    share = answers.card(study).numbers[0]
    assert "it contains 3 replicates" in share.interval_of
    # a wind goes nearly with the root of the Shields number
    shown = (share.other_low / share.other, share.other_high / share.other)
    assert shown == pytest.approx(np.sqrt([0.04 / 0.06, 0.09 / 0.06]), rel=0.02)


def test_a_study_of_single_grains_has_an_answer_too(results: Results) -> None:
    grains = only(results, "grain")
    card = answers.card(grains)
    assert card.question.startswith("At what wind does a grain start to move, by")
    rows = sheets.single_grains_sheet(grains)
    # a viscosity is a fluid: no number spans two of them
    assert len(card.numbers) == rows["nu_m2_s"].nunique()
    assert f"{rows['usable'].sum()} of {len(rows)} thresholds" in card.worth.word
    least = card.numbers[0]
    without = grains.tables["single_grain"].assign(method="pivot", ustar_m_s=np.nan)
    exact = changed(grains, single_grain=without)
    sheet = sheets.short(exact)
    assert sheet is not None
    assert "by closed form" in sheet.shared
    # nobody followed the grains: where the law holds the answer is the exact one
    told = answers.card(exact).numbers[0]
    values = [
        each.value if math.isnan(each.other) else each.other for each in (told, least)
    ]
    assert values[0] == pytest.approx(values[1], rel=0.01)


def test_a_threshold_that_is_not_usable_says_so(results: Results) -> None:
    bad = results.tables["pile_threshold"].assign(
        usable=False, verdict="not usable", why_not="Re* 2 is below 30"
    )
    against = bad[["scene_id", "fraction", "why_not"]].assign(reason="law", remedy="")
    study = changed(results, pile_threshold=bad, reason=against)
    worth = answers.card(study).worth
    assert (worth.mark, worth.word) == ("bad", "not usable: Re* 2 is below 30")
    heads = [remark.head for remark in remarks.remarks(study)]
    assert "Usable: 0 of 4 thresholds." in heads
    sheet = sheets.short(study)
    assert sheet is not None
    assert "not usable (1)" in sheet.shared
    # the rows have no cell for a verdict that they all have
    assert sheet.is_grey
    usable = sheets.short(results)
    assert usable is not None
    assert not usable.is_grey
    assert sheet.notes == ("Re* 2 is below 30",)
    # a number that is not usable is grey, with its reason on the card
    assert all(number.is_grey for number in answers.card(study).numbers)


def test_over_rougher_ground_a_weaker_wind_has_the_same_friction_velocity(
    results: Results,
) -> None:
    """u = u*/0.41 ln(z/z0): a larger z0 has a larger u* in one wind."""
    heap = only(results, "pile")
    said = remarks.over_ground(heap.exemplars).text
    row = heap.exemplars.iloc[0]
    # of the number that the card advises
    ustar = row["compared_ustar0_m_s"]
    winds = [ustar / 0.41 * np.log(10 / z0) for z0 in (1e-4, 1e-3)]
    winds.insert(0, float(row["compared_wind_10m_m_s"]))
    assert winds == sorted(winds, reverse=True)
    for speed in (ustar, *winds):
        assert f"{speed:#.3g} m/s" in said
    # over grains that are as rough as such ground the wind is no weaker
    rough = heap.exemplars.assign(z0_m=2e-4, advised=verdict.MODEL)
    said = remarks.over_ground(reported(rough)).text
    assert "0.1 mm" not in said
    assert f"{row['ustar0_m_s'] / 0.41 * np.log(10 / 1e-3):#.3g} m/s" in said


def test_a_study_in_wind_says_what_rougher_ground_changes(tmp_path: Path) -> None:
    text = 'fluid.kind = "air"\n[grain]\ndiameter = 2.5e-4\ndensity = 2650.0\n'
    asked = remarks.remarks(small_study.run(tmp_path, text))
    (said,) = [each.text for each in asked if each.head.startswith("The wind is that")]
    assert "stronger" not in said
    # in the wind in which u* is 0.256 m/s over this sand, by docs/beach.md
    assert "0.256 m/s is a wind of 8.38 m/s" in said
    assert "7.18 m/s where z₀ is 0.1 mm" in said


def test_an_interval_without_an_end_is_written_so(results: Results) -> None:
    thresholds = results.tables["pile_threshold"]
    study = changed(results, pile_threshold=thresholds.assign(shields_high=np.nan))
    sheet = sheets.short(study)
    assert sheet is not None
    lows = [f"above {low:#.3g}" for low in thresholds["shields_low"]]
    assert sheet.frame[OF_MODEL].tolist() == ["—", *lows]
    (figure,) = overview.draw(study)
    said = " ".join(text[1] for group in figure.data.values() for text in group)
    assert all(f"(above {low:.4g})" in said for low in thresholds["shields_low"])
    # a range of several is open as the widest of them
    half = thresholds.assign(
        shields_high=thresholds["shields_high"].where(np.array([True, False] * 2))
    )
    ranges = sheets.short(
        copies(changed(results, pile_threshold=half), *({"seed": n} for n in (0, 1)))
    )
    assert ranges is not None
    is_open = [text.startswith("above") for text in ranges.frame[OF_MODEL]]
    assert is_open == [False, True] * 2
    # where no error is known neither end is
    none = thresholds.assign(shields_low=np.nan, shields_high=np.nan)
    sheet = sheets.short(changed(results, pile_threshold=none))
    assert sheet is not None
    assert OF_MODEL not in sheet.frame


def test_sizes_of_a_mixture_say_what_so_few_grains_leave_open() -> None:
    ends = {
        "shields_own_low": [0.02, np.nan, np.nan],
        "shields_own_high": [0.04, 0.05, np.nan],
    }
    assert [
        labels.interval(low, high, 2, "g")
        for low, high in zip(*ends.values(), strict=True)
    ] == ["0.02 … 0.04", "below 0.05", "—"]
    assert labels.interval(0.02, np.inf, 2, "g") == "above 0.02"


def test_no_interval_is_one_bare_number() -> None:
    """It read as no uncertainty at all."""
    assert labels.interval(0.0391, 0.0392, 2, "g") == "0.0391 … 0.0392"
    assert labels.interval(0.17, 0.17, 2, "g") == "0.17 … 0.17"


def test_every_point_says_its_scene_interval_and_case(results: Results) -> None:
    (figure,) = overview.draw(results)
    assert figure.canvas is not None
    (ax,) = figure.canvas.axes
    drawn = {line.get_gid(): line for line in ax.lines}
    said = [text for group in figure.data.values() for text in group]
    piles, grains = results.tables["pile_threshold"], results.tables["single_grain"]
    assert len(said) == len(piles) + (grains["alpha_deg"] == 0).sum()
    for gid, group in figure.data.items():
        assert len(np.asarray(drawn[gid].get_xdata())) == len(group)
    for row in piles.to_dict("records"):
        value = f"θ_c = {row['shields']:.4g} ({row['shields_low']:.4g} … {row['shields_high']:.4g})"
        (text,) = [one for one in said if one[1].startswith(value)]
        assert text[0].startswith("α = 15°, d = 1 mm, z₀ = d/30")
        assert text[2:] == [row["why_not"], row["case"]]


def test_the_lines_beside_piles_have_the_roughness_of_the_piles(
    results: Results,
) -> None:
    """Single grains on d/10 fit the measurements better; the piles are on d/30."""
    (figure,) = overview.draw(results)
    lines = [text for text in legend_of(figure) if text.startswith("Eq.")]
    assert len(lines) == 2
    assert all(text.endswith("β = 60°, z₀ = d/30") for text in lines)


def test_long_heads_and_cells_of_a_table_stand_on_several_lines() -> None:
    rows = [("10 %", "no: the error is not known"), ("30 %", "")]
    assert lines.table(rows, ("part that moves", "usable"), widths=(9, 12)) == [
        "part that  usable",
        "moves",
        "10 %       no: the",
        "           error is not",
        "           known",
        "30 %",
    ]
    # what a user wrote is no markup
    assert lines.table([("[red]a[/red]",)]) == ["[red]a[/red]"]
