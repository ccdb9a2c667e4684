"""Tables as CSV files, and the meanings of their columns."""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from io import BytesIO
from pathlib import Path, PurePath

import pandas as pd

from orchestrator.errors import OrchestratorError
from orchestrator.runs.files import Folder
from orchestrator.study import fields

COLUMNS: dict[str, str] = {
    **pd.read_csv(Path(__file__).with_name("columns.csv"), index_col="column")["meaning"],
    **{column: one.phrase for column, one in fields.COLUMNS.items()},
    **{column: f"{one.phrase}: as it was run" for column, one in fields.ANSWERS.items()},
}
"""Every column of every table, with its meaning; units are in the names."""
BEGINS = ("=", "+", "-", "@", "\t", "\n")
"""Spreadsheets run a cell that begins with one of these as a formula."""
NAMES = ("scene_id", "group", "profile", "case", "flow_case", "why_not")
"""Columns of texts that may look like numbers, or be empty."""


def csv(table: pd.DataFrame, digits: str | None = None) -> str:
    """A table as CSV; a text that would begin a formula gets an apostrophe before it.

    Parameters
    ----------
    table : DataFrame
        The table.
    digits : str, optional
        Format of its numbers, such as ``%.9g``.
    """
    texts = table.select_dtypes(exclude=["number", "bool"])
    return table.assign(**{str(name): texts[name].map(_harmless) for name in texts}).to_csv(
        index=False, float_format=digits
    )


def _harmless(value: object) -> object:
    if not isinstance(value, str):
        return value
    # pandas writes \r without quotes, and a reader takes it for the end of the row
    text = value.replace("\r\n", "\n").replace("\r", "\n")
    if not text.startswith(BEGINS):
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text


def write(tables: Mapping[str, pd.DataFrame], folder: Folder, place: str) -> None:
    """Put each table into a sub-directory of a folder, and the meanings of the columns."""
    for name, table in tables.items():
        folder.put(f"{place}/{name}.csv", csv(table))
    used = sorted({str(column) for table in tables.values() for column in table})
    rows = [{"column": column, "meaning": COLUMNS[column]} for column in used]
    folder.put(f"{place}/columns.csv", csv(pd.DataFrame(rows)))


def read(folder: Folder, place: str) -> dict[str, pd.DataFrame]:
    """Read the tables that `write` wrote, and no others.

    Raises
    ------
    OrchestratorError
        If there are none, or one has changed since.
    """
    files = [name for name in folder.written() if fnmatchcase(name, f"{place}/*.csv")]
    names = {PurePath(file).stem: file for file in files}
    names.pop("columns", None)
    if not names:
        raise OrchestratorError(
            "there are no tables", where=str(folder.root / place), remedy="run the study first"
        )
    return {name: _read(folder.read(file)) for name, file in names.items()}


def _read(data: bytes) -> pd.DataFrame:
    table = pd.read_csv(
        BytesIO(data),
        dtype=dict.fromkeys(NAMES, "str"),
        keep_default_na=False,
        na_values=[""],
    )
    return table.assign(why_not=table["why_not"].fillna("")) if "why_not" in table else table
