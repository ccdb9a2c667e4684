"""Writes docs/columns.md from the meanings of columns in the program.

python docs/columns.py > docs/columns.md
"""

from orchestrator.tables import TABLES

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


def text() -> str:
    """Write the page."""
    lines = [f"| [{name}](#{name}) | {table.row} |" for name, table in TABLES.items()]
    for name, table in TABLES.items():
        lines += ["", f"## {name}", "", "| column | meaning |", "|---|---|"]
        for column, meaning in table.columns.items():
            told = meaning.replace("*", r"\*").replace("|", r"\|").replace("<", r"\<")
            lines.append(f"| `{column}` | {told} |")
    return HEAD + "\n".join(lines) + "\n" + END


if __name__ == "__main__":
    print(text(), end="")
