"""The half widths of the package, from the errors of single scenes.

python tools/calibration.py
python tools/calibration.py results/ladder/tables/scene_errors.csv beside.csv

The second form first puts the errors of runs of the ladder and those of
`tools/beside_dem.py` together, as docs/measured/scene_errors.csv.
"""

import sys
from pathlib import Path

import pandas as pd

from orchestrator.fidelity.classes import FLOW
from orchestrator.fidelity.measured import FOLDER
from orchestrator.lab import calibration
from orchestrator.lab.ladder import AGAIN_OF, RUNGS
from orchestrator.study.models import SOLVE
from orchestrator.tables import csv

STORED = Path(__file__).parents[1] / "docs" / "measured" / "scene_errors.csv"
UNSOLVED = [
    rung.name for rung in RUNGS[FLOW] if rung.sets["method.flow.model"] != SOLVE.name
]
"""Rungs of the flow that no fidelity has: the ladder alone compares them."""
ABOUT = ["part", "rung", "scene_class", "pile", "geometry", "cost_core_s"]


def wide(rows: pd.DataFrame) -> pd.DataFrame:
    """Put the fractions of each scene into one row.

    Parameters
    ----------
    rows
        A row for each fraction.

    Returns
    -------
    DataFrame
        A row for each part, rung and pile, with a column for each fraction.
    """
    # of two criteria of motion, which share their runs, each fraction has the larger
    one = ["part", "rung", "scene_class", "pile"]
    costs = rows.groupby(one)["cost_core_s"].transform("mean").fillna(0.0)
    table = rows.assign(cost_core_s=costs).pivot(
        index=ABOUT, columns="fraction", values="error"
    )
    return table.sort_index().reset_index()


def long(table: pd.DataFrame) -> pd.DataFrame:
    """Read the stored errors: a row for each fraction.

    Parameters
    ----------
    table
        The stored table.

    Returns
    -------
    DataFrame
        The rows.
    """
    rows = table.melt(ABOUT, var_name="fraction", value_name="error")
    return rows.assign(fraction=rows["fraction"].astype(float))


def main() -> None:
    """Write the half widths, and before them what they are made of."""
    if sys.argv[1:]:
        rows = pd.concat(map(pd.read_csv, sys.argv[1:]), ignore_index=True)
        STORED.write_text(
            csv(wide(rows[~rows["rung"].isin(UNSOLVED)])), encoding="utf-8"
        )
    table = calibration.half_widths(long(pd.read_csv(STORED)), AGAIN_OF)
    (FOLDER / "errors.csv").write_text(csv(table), encoding="utf-8")


if __name__ == "__main__":
    main()
