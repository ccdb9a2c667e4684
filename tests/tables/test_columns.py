"""Columns: each is declared beside its maker, and the documents are made of that."""

import runpy
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from orchestrator import tables
from orchestrator.report.results import Results
from orchestrator.runs.files import Folder
from orchestrator.tables import TABLES, piles
from orchestrator.tables.answer import Answer
from orchestrator.types import Row
from tests import small_study

PAGE = Path(__file__).parents[2] / "docs" / "columns.py"
BED = """
grain.diameter = 1e-3
bed = { kind = "pile", slope_deg = 15.0, height = 0.01 }
method.kind = "pivot"
"""


def test_every_column_of_a_table_is_declared(results: Results) -> None:
    for name, table in results.tables.items():
        assert {*table} <= TABLES[name].columns.keys(), name


def test_a_column_means_one_thing_in_every_table() -> None:
    known = tables.meanings()
    for name, table in TABLES.items():
        for column, meaning in table.columns.items():
            assert known[column] == meaning, (name, column)


def test_a_column_more_is_one_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its maker it gets into the table, into the file of meanings and the page."""
    name, meaning = "twice_moved", "two times the grains that had moved"
    made: Any = piles.pile_curve

    def with_one_more(answer: Answer) -> Row:
        row: Row = made(answer)
        return {**row, name: 2 * row["moved"]}

    assert not [*tmp_path.iterdir()]
    monkeypatch.setitem(piles.PILE_CURVE, name, meaning)
    monkeypatch.setattr(piles, "pile_curve", with_one_more)
    found = small_study.run(tmp_path, BED).tables
    curve = found["pile_curve"]
    assert curve[name].tolist() == (2 * curve["moved"]).tolist()
    folder = Folder(tmp_path)
    with folder.renewed():
        tables.write_tables(found, folder, "tables")
    written = pd.read_csv(tmp_path / "tables" / "columns.csv", index_col="column")
    assert written.loc[name, "meaning"] == meaning
    page = runpy.run_path(str(PAGE))["text"]()
    of_curve = page.partition("\n## pile_curve\n")[2].partition("\n## ")[0]
    assert f"| `{name}` | {meaning} |" in of_curve
