"""Tables as files: they come back as they were, and hold no formula for a spreadsheet."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from orchestrator import tables
from orchestrator.errors import OrchestratorError
from orchestrator.runs.files import Folder

FORMULAS = [
    "=1+1",
    "+A1",
    "-A1",
    "@SUM(A1)",
    "\t=1",
    "\r=1",
    "=cmd|' /C calc'!A0",
    "-rf",
]


def test_no_name_is_a_formula_and_all_else_is_as_it_is() -> None:
    written = tables.csv(pd.DataFrame({"group": FORMULAS, "d_m": -1.5}))
    escaped = [f"'{name}".replace("\r", "\n") for name in FORMULAS]
    assert written == pd.DataFrame({"group": escaped, "d_m": -1.5}).to_csv(index=False)
    table = pd.DataFrame(
        {"name": ["sand", "", None, "1-A", "'x", "-3.5", "+1e-3", "-inf"]}
    )
    assert tables.csv(table) == table.to_csv(index=False)
    assert "-1.0000," in tables.csv(
        pd.DataFrame({"number": [-1.0], "truth": True}), "%.4f"
    )


def test_tables_come_back(tmp_path: Path) -> None:
    table = pd.DataFrame(
        {
            # ids and names that look like numbers or like none
            "scene_id": ["0195b034e2ac", "123456789012", "12345e678901"],
            "group": ["NA", "007", "-15 deg"],
            "flow_case": ["=1", "'=1", "''+a"],
            "bed": ["'x", "@", np.nan],
            "reynolds": np.random.default_rng(0).normal(size=3),
            "shields": [0.0, np.nan, np.inf],
            "count": [1, 2, 3],
            "usable": [True, False, True],
            "why_not": ["", "lift, and more", ""],
        }
    )
    folder = Folder(tmp_path)
    with folder.renewed():
        tables.write_tables({"single_grain": table}, folder, "tables")
    assert list(tables.read_tables(folder, "tables")) == ["single_grain"]
    again = tables.read_tables(folder, "tables")["single_grain"]
    pd.testing.assert_frame_equal(again, table)
    written = pd.read_csv(tmp_path / "tables" / "columns.csv")
    known = tables.meanings()
    assert written["column"].tolist() == sorted(map(str, table))
    assert written["meaning"].tolist() == [known[each] for each in written["column"]]
    with pytest.raises(OrchestratorError, match="no tables"):
        tables.read_tables(folder, "elsewhere")


def test_a_column_can_be_added_to_a_wide_table(tmp_path: Path) -> None:
    """Pandas warned of each that was added to tables of more than a hundred columns."""
    folder = Folder(tmp_path)
    wide = pd.DataFrame({f"c{number}": [1.0] for number in range(150)})
    folder.put("tables/scenes.csv", tables.csv(wide))
    assert tables.read_tables(folder, "tables")["scenes"].assign(more=1.0).shape == (
        1,
        151,
    )
