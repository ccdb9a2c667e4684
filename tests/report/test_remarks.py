"""Caveats of an answer: of which bed it is told, and where intervals change."""

from pathlib import Path

import pandas as pd

from orchestrator.fidelity import crest
from orchestrator.report import answers, labels, remarks, sheets
from orchestrator.report.results import Results
from tests import small_study
from tests.report.conftest import changed, copies, only
from tests.tables.test_quoted import SEEDS_IN_WATER, TWO_BEDS

EXAMPLE = "Example: "


def test_a_remark_that_is_told_of_one_of_several_names_it(results: Results) -> None:
    """It had the caveats of one scene for a thousand."""
    heap = only(results, "pile")
    sizes = [{"d_m": d, "usable": True} for d in (1e-3, 2e-3)]
    of_one = [each.text for each in remarks.remarks(heap)]
    assert not any(EXAMPLE in text for text in of_one)
    said = [each.text for each in remarks.remarks(copies(results, *sizes))]
    told = [text.partition(EXAMPLE)[2] for text in said if EXAMPLE in text]
    assert len(told) == 2
    assert set(told) <= {"d = 1 mm.", "d = 2 mm."}


def test_a_remark_says_where_the_interval_changes_its_width(tmp_path: Path) -> None:
    heap = small_study.run(tmp_path, SEEDS_IN_WATER)
    heads = [each.head for each in remarks.remarks(heap)]
    table = heap.tables["pile_threshold"]
    jumped = table["fraction"] > 0.4
    wider = table.assign(
        reynolds=[8.0, 9.0, 11.0, 12.0] * 3,
        tested_low=0.02,
        tested_high=pd.Series(0.1, table.index).where(~jumped, 0.3),
    )
    (said,) = [
        each.text
        for each in remarks.remarks(changed(heap, pile_threshold=wider))
        if each.head == "The width of the interval changes with Re*."
    ]
    assert said.startswith("From Re* 9 to 11 the ratio of its ends goes from 5 to 15:")
    assert "The width of the interval changes with Re*." not in heads


def test_a_scene_of_two_groups_has_one_row(tmp_path: Path) -> None:
    groups = "".join(f'[[group]]\nname = "{name}"\n' for name in ("a", "b"))
    text = f"""
method.kind = "pivot"
grain = {{ diameter = 1e-3 }}
{groups}bed.slope_deg = 10.0
[[group]]
name = "c"
"""
    tables = small_study.run(tmp_path, text).tables
    assert tables["scenes"]["group"].tolist() == ["a; c", "b"]
    assert tables["scenes"]["scene_id"].is_unique
    merged = tables["single_grain"].merge(tables["scenes"], on="scene_id")
    assert len(merged) == 2


def test_a_table_of_one_row_tells_the_part_that_has_moved_once(
    results: Results,
) -> None:
    heap = only(results, "pile")
    table = heap.tables["pile_threshold"]
    one = changed(heap, pile_threshold=table[table["fraction"] == 0.3].head(1))
    sheet = sheets.short(
        changed(
            one,
            pile_threshold=one.tables["pile_threshold"].assign(
                first_ustar0_m_s=float("nan")
            ),
        )
    )
    assert sheet is not None
    told = " ".join(sheet.shared)
    assert told.count("30 %") == 1
    assert "n/N" not in told


def test_figures_say_which_tables_they_are_drawn_from(page: Path) -> None:
    html = page.read_text(encoding="utf-8")
    for name in ("pile_threshold", "single_grain", "pile_curve"):
        assert f'href="tables/{name}.csv"' in html
    assert "Drawn from" in html


def test_two_beds_are_the_two_numbers_of_the_card_and_one_is_one(
    tmp_path: Path,
) -> None:
    from orchestrator.report import answers

    both = small_study.run(tmp_path, TWO_BEDS)
    numbers = answers.card(both).numbers
    assert [one.meaning.split()[0] for one in numbers[:2]] == ["lowest", "highest"]
    table = both.tables["pile_threshold"]
    first = table["scene_id"].iloc[0]
    usable = table["scene_id"] == first
    alone = table.assign(
        usable=usable, why_not=table["why_not"].where(usable, "it is known to be wrong")
    )
    numbers = answers.card(changed(both, pile_threshold=alone)).numbers
    assert len(numbers) == 2
    assert numbers[0].meaning.startswith(
        "threshold bed shear stress, 30 % entrained: d"
    )


def test_a_pile_with_an_edge_is_told_what_its_mesh_is_worth(
    results: Results, tmp_path: Path
) -> None:
    pile = only(results, "pile")
    assert remarks.SHARP_CREST in remarks.remarks(pile)
    moved = crest.told(crest.FIRST_GRAIN)
    assert [one for one in answers.card(pile).numbers if moved in one.note]
    poured = small_study.run(tmp_path, SEEDS_IN_WATER)
    assert remarks.SHARP_CREST not in remarks.remarks(poured)
    assert not [one for one in answers.card(poured).numbers if moved in one.note]


def test_grains_that_dem_follows_are_answered_by_no_force_law(results: Results) -> None:
    heap = only(results, "pile")
    scenes = heap.tables["scenes"]
    table = heap.tables["pile_threshold"].assign(level_ustar_m_s=0.324)
    table = table.assign(compared_level_ustar_m_s=0.3)
    law = labels.value("force_law", scenes["force_law"].iloc[0])
    told = {}
    for dropped in (None, 0):
        of = changed(
            heap, scenes=scenes.assign(dropped_grains=dropped), pile_threshold=table
        )
        (said,) = [
            each
            for each in remarks.remarks(of)
            if "predicts the threshold" in each.head
        ]
        sheet = sheets.short(of)
        assert sheet is not None
        told[dropped] = said.head, said.text, " ".join(sheet.shared)
    head, text, shared = told[None]
    assert head.startswith("The model overpredicts")
    assert f"the force law {law} has a" in text
    assert law in shared
    head, text, shared = told[0]
    assert head.startswith("The closed form of one grain overpredicts")
    assert head.endswith(" by a factor of 1.08.")
    assert "Grains that DEM follows have no force law" in text
    assert law not in shared
