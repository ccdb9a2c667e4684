"""What a study tells of its flows where one has no wind, and beds have one fraction."""

from pathlib import Path

from orchestrator.report import page, remarks, sheets
from tests import small_study

TEXT = """
grain.diameter = 1e-3
bed = { kind = "pile", slope_deg = 10.0, height = 0.01 }
method = { kind = "pivot", flow = { model = "flat" } }
threshold.fractions = [0.3]
"""
SHALLOW = """flow = { top = "closed channel", depth = 0.1 }
axes = { "forces.law" = ["bridged", "profile"] }
"""


def test_a_gas_in_a_low_channel_is_told_by_its_mean_velocity(tmp_path: Path) -> None:
    results = small_study.run(tmp_path, SHALLOW + TEXT)
    sheet = sheets.short(results)
    assert sheet is not None
    assert (sheet.frame["mean velocity, m/s"].astype(float) > 0).all()
    heads = [each.head for each in remarks.remarks(results)]
    assert not any("bare, level ground" in head for head in heads)


def test_a_table_of_one_fraction_has_a_row_for_it_alone(tmp_path: Path) -> None:
    sheet = sheets.short(small_study.run(tmp_path, TEXT))
    assert sheet is not None
    assert len(sheet.frame) == 1
    assert sheets.PART not in sheet.frame
    assert "fraction entrained: 30 %" in sheet.shared


def test_a_page_of_no_cases_tells_of_none(tmp_path: Path) -> None:
    results = small_study.run(tmp_path, TEXT)
    told = str(page.page_text("files", results=results, case=""))
    assert "columns.csv" in told
    assert "Allrun" not in told
