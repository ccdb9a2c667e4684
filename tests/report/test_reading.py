"""How pages are read: a legend, a verdict beside each number, names and units whole."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from orchestrator import gallery
from orchestrator.report import answers, labels, noted, sheets, single
from orchestrator.report import page as pages
from orchestrator.report.card import Card, Number, Worth
from orchestrator.report.page import Section, page_text
from orchestrator.report.results import Results
from orchestrator.report.sheets import Sheet
from orchestrator.runs.files import Folder
from orchestrator.runs.workspace import STUDY
from tests.report.conftest import copies

WATER = {"rho_f_kg_m3": 1000.0, "nu_m2_s": 1e-6}
AIR = {"rho_f_kg_m3": 1.225, "nu_m2_s": 1.46e-5}
CARD = Card(
    "How strong is it?",
    "a cone",
    (Number(9.74, "m/s", "wind", "u* = 3", low=8.5, high=math.nan),),
    "computed",
    Worth("care", "usable, to compare", "Compare."),
)


def experiment(out: Path, *content: Any) -> str:
    """The page of an experiment with a card, in its directory."""
    sections = [Section("", [CARD, *content])]
    pages.write_experiment("A cone", sections, Folder(out), "report.html", {}, 3.0)
    return (out / "report.html").read_text(encoding="utf-8")


def test_every_page_leads_to_how_it_is_read(page: Path, tmp_path: Path) -> None:
    cone = tmp_path / "cone"
    cone.mkdir()
    made = [page.read_text(encoding="utf-8"), experiment(cone)]
    (cone / STUDY.marker).write_text("{}", encoding="utf-8")
    made.append(gallery.write_gallery(tmp_path).read_text(encoding="utf-8"))
    for html in made:
        assert html.count('href="#how-to-read"') == 1
        assert html.count('id="how-to-read"') == 1
        (foot,) = re.findall(r"(?s)<footer>(.*?)</footer>", html)
        assert "orchestrator 0" in foot
        assert "How to read this page" in foot


def test_a_page_explains_what_it_has_and_nothing_else(tmp_path: Path) -> None:
    html = experiment(tmp_path)
    assert "The large number is the one to take" in html
    assert "In figures orange" not in html
    assert "In tables the bold column" not in html
    of_tables = experiment(tmp_path, Sheet("", pd.DataFrame({"slope": ["1°"]})))
    assert "In tables the bold column" in of_tables


def test_each_card_has_a_verdict_below_its_numbers(page: Path) -> None:
    html = page.read_text(encoding="utf-8")
    (card,) = re.findall(r'(?s)<div class="card.*?</section>', html)
    numbers = [found.start() for found in re.finditer(r'<div class="number', card)]
    assert numbers
    (verdict,) = re.finditer(r'<p class="worth">.*?<b class="(good|care|bad)">', card)
    assert verdict.start() > max(numbers)


def test_the_card_of_an_experiment_is_read_again(tmp_path: Path) -> None:
    experiment(tmp_path)
    read = noted.read(tmp_path)
    assert read is not None
    assert read.title == "A cone"
    (number,) = read.card.numbers
    assert (number.figure, number.interval) == ("9.7", "above 8.5, open")
    assert read.card.worth == CARD.worth
    assert noted.read(tmp_path / "none") is None


def test_a_gallery_has_the_answer_of_an_experiment(tmp_path: Path) -> None:
    cone = tmp_path / "cone"
    cone.mkdir()
    experiment(cone)
    (cone / STUDY.marker).write_text("{}", encoding="utf-8")
    html = gallery.write_gallery(tmp_path).read_text(encoding="utf-8")
    assert "this is the experiment" not in html
    for told in ("A cone", "9.7 <small>m/s", "Usable, to compare"):
        assert told in html


@pytest.mark.parametrize(
    ("text", "whole"),
    [
        ("5.6 … 9.4 m/s", "5.6\u00a0…\u00a09.4\u00a0m/s"),
        ("by −4 … +9 %", "by −4\u00a0…\u00a0+9\u00a0%"),
        ("30 % of 1 mm sand", "30\u00a0% of 1\u00a0mm sand"),
        ("α = 15°", "α\u00a0=\u00a015°"),
        ("write `update = 0.1`", "write <code>update = 0.1</code>"),
    ],
)
def test_no_line_ends_within_a_number_and_its_unit(text: str, whole: str) -> None:
    assert pages.typeset(text) == whole


def test_a_symbol_has_no_capital() -> None:
    assert pages.sentence("τ_b of the flow") == "τ_b of the flow"
    assert pages.sentence("by the model") == "By the model"
    assert pages.sentence("a finer mesh") == "A finer mesh"
    card = pages.fill(
        "page.html.j2",
        title="",
        above="",
        foot="",
        sections=[Section("", [CARD])],
        links={},
        is_paper=False,
    )
    assert "u*\u00a0= 3" in card or "u* = 3" in card
    assert "U*" not in card


def test_air_and_water_are_told_by_their_names() -> None:
    rows = pd.DataFrame([AIR, WATER, {"rho_f_kg_m3": 1000.0, "nu_m2_s": 1e-4}])
    (head, cells), *_ = labels.cells(rows, ["rho_f_kg_m3"]).items()
    assert (head, cells) == ("fluid", ["air", "water", "1000 kg/m³"])
    assert labels.told(rows.iloc[0], ["rho_f_kg_m3"]) == ["in air"]
    assert labels.told(rows.iloc[2], ["rho_f_kg_m3"]) == ["ρ_f = 1000 kg/m³"]


def test_the_first_motion_in_air_is_a_stress_beside_water(results: Results) -> None:
    study = copies(results, AIR, WATER)
    sheet = sheets.short(study)
    assert sheet is not None
    assert sheet.main.startswith("bed shear stress")
    first = sheet.frame[sheet.frame[sheets.PART].str.startswith(sheets.FIRST_MOTION)]
    assert len(first) == 2
    assert set(first["fluid"]) == {"air", "water"}
    values = first[sheet.main].astype(float)
    assert np.isfinite(values).all()


def test_terms_are_those_of_the_heads() -> None:
    wind = pd.DataFrame(columns=["wind at 10 m, m/s", "verdict"])
    assert sheets.terms_of(wind, is_of_beds=False) == ()
    interval = pd.DataFrame(columns=["interval of θ_c"])
    (term,) = sheets.terms_of(interval, is_of_beds=False)
    assert term.startswith("Shields number θ: τ_b/")
    (of_beds,) = sheets.terms_of(interval, is_of_beds=True)
    assert of_beds.startswith("Shields number θ: the mean wall stress on the entrained")


def _body_of(sheet: Sheet) -> str:
    """The rows of a table on a page of its own."""
    html = pages.fill(
        "page.html.j2",
        title="",
        above="",
        foot="",
        sections=[Section("", [sheet])],
        links={},
        is_paper=False,
    )
    return html[html.index("<tbody>") :]


def test_a_row_whose_seeds_are_all_not_usable_is_grey() -> None:
    frame = pd.DataFrame(
        {
            "slope": ["1°", "2°", "3°"],
            "wind, m/s": ["1", "2", "3"],
            "verdict": ["0 of 3 seeds usable", "2 of 3 seeds usable", "not usable (1)"],
        }
    )
    sheet = Sheet("", frame, file="tables/a.csv", main="wind, m/s")
    body = _body_of(sheet)
    rows = re.findall(r"<tr( class=\"unusable\")?>", body)
    assert [bool(row) for row in rows] == [True, False, True]


def test_a_narrow_table_keeps_names_answer_interval_and_verdict() -> None:
    frame = pd.DataFrame(
        {
            "fluid": ["air", "water"],
            "method": ["pivot", "peeling"],
            "fraction entrained": ["10 %", "30 %"],
            "wind, m/s": ["1", "2"],
            "interval, m/s": ["0 … 2", "1 … 3"],
            "θ_c": ["0.1", "0.2"],
            "verdict": ["usable", "usable"],
        }
    )
    sheet = Sheet("", frame, file="tables/a.csv", main="wind, m/s")
    row = _body_of(sheet).split("</tr>")[0]
    assert '<span class="all">air, pivot, 10\u00a0%</span>' in row
    kept = re.findall(r"<td(?: class=\"main\")?>(.*?)</td>", row)
    assert kept == ["1", "0\u00a0…\u00a02", "usable"]


def test_the_source_tells_of_each_number_of_the_card(results: Results) -> None:
    card = answers.card(results)
    said = card.source
    assert "The model’s numbers are computed with the force law" in said
    names = {each.value_is or each.other_is for each in card.numbers if each.beside}
    for name in names - {single.MODEL, single.MODEL_ALONE}:
        assert f"Numbers {name}" in said


def test_a_legend_of_nothing_has_the_document() -> None:
    assert "docs/result-page.md" in page_text("reading", of=set())
