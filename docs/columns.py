"""Writes docs/columns.md from the meanings of columns in the program.

python docs/columns.py > docs/columns.md
"""

from pathlib import Path

import pandas as pd

from orchestrator import tables
from orchestrator.study.fields import OF_METHOD, OF_QUESTION

LISTED = Path(__file__).with_name("columns.csv")
"""The columns of each table, in their order; `FIELDS` stands for those that are fields of
a study file."""
FIELDS = {"scenes": OF_QUESTION, "methods": OF_METHOD}
"""The columns of fields, by the table that has them."""
TABLES = {
    "scenes": "a scene: the values of its fields, and the groups that ask for it",
    "methods": "a scene: how it was answered, and why",
    "single_grain": "a single grain: its threshold",
    "pile_threshold": "a pile and a fraction n/N: its threshold",
    "reason": "a reason against a threshold",
    "pile_curve": "a pile and a load step: the part of the grains that has moved",
    "pile_grain": "a grain of a pile: where it lies and when it moved",
    "size_class": "a size class of a mixture and a fraction: its threshold, hiding",
    "bed_change": "a pile on a bed that changes and a number of moved grains",
    "form": "a form of a train and a fraction: its threshold",
    "flow": "a solved flow",
    "wall_stress": "a place on the bed of a solved flow",
    "check": "a threshold that DEM answered too, as a check of a fast method",
    "timings": "a case: the times of its run, in `timings/timings.csv`",
}
"""Tables of a study, with what a row is."""
HEAD = """\
# Columns of the tables

`results/NAME/tables/` has the tables of a study as CSV files; `study.tables` has them in Python. A study has those tables that belong to its
question. The names of columns end with their SI units: `_m` is metres, `_m_s` metres per second, `_pa` pascals, `_deg` degrees. A column
without a unit is a number, a text or a truth value. An empty cell means that there is no such value. `columns.csv` beside the tables
explains the columns that they have.

This page is written by `python docs/columns.py` from the descriptions in the program. A table has those of its columns that belong to the
question of the study. Columns that several tables have are explained in each of them.

| table | a row is |
|---|---|
"""
END = """
## Where to go next

- [glossary.md](glossary.md): the terms.
- [python.md](python.md): the tables in Python.
"""


def listed() -> pd.DataFrame:
    """The columns of each table, a row for each."""
    rows = []
    for table, column in pd.read_csv(LISTED).itertuples(index=False):
        columns = FIELDS[table] if column == "FIELDS" else (column,)
        rows += [{"table": table, "column": each} for each in columns]
    return pd.DataFrame(rows)


def text() -> str:
    """Write the page."""
    every = listed()
    lines = [f"| [{name}](#{name}) | {row} |" for name, row in TABLES.items()]
    for name in TABLES:
        lines += ["", f"## {name}", "", "| column | meaning |", "|---|---|"]
        for column in every.loc[every["table"] == name, "column"]:
            meaning = tables.COLUMNS[column]
            told = meaning.replace("*", r"\*").replace("|", r"\|").replace("<", r"\<")
            lines.append(f"| `{column}` | {told} |")
    return HEAD + "\n".join(lines) + "\n" + END


if __name__ == "__main__":
    print(text(), end="")
