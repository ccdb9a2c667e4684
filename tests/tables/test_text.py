"""Tables as files: what a spreadsheet would run as a formula."""

import csv
import io
import math

import pandas as pd
import pytest

from orchestrator.tables import text

FORMULAS = ["=1+1", "+A1", "-A1", "@SUM(A1)", "\t=1", "\r=1", "=cmd|' /C calc'!A0", "-rf"]


@pytest.mark.parametrize("name", FORMULAS)
def test_no_name_is_a_formula(name: str) -> None:
    written = text.csv(pd.DataFrame({"group": [name], "d_m": [-1.5]}))
    ((_, _), (group, number)) = csv.reader(io.StringIO(written, newline=""))
    assert (group, float(number)) == ("'" + name.replace("\r", "\n"), -1.5)


def test_all_else_is_as_it_is() -> None:
    table = pd.DataFrame(
        {
            "name": ["sand", "", None, "1-A", "'x"],
            "at": ["-3.5", "+1e-3", "-inf", "", "7"],
            "number": [-1.0, math.nan, -math.inf, 0.0, 1e-300],
            "truth": [True, False, True, False, True],
        }
    )
    assert text.csv(table) == table.to_csv(index=False)
    assert "-1.0000," in text.csv(table, "%.4f")
