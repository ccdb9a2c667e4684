"""A table as the text of a file."""

from typing import Any

import pandas as pd

BEGINS = ("=", "+", "-", "@", "\t", "\n")
"""Spreadsheets run a cell that begins with one of these as a formula."""


def csv(table: pd.DataFrame, digits: str | None = None) -> str:
    """A table as CSV. No name that someone gave begins a formula: it gets an apostrophe.

    Parameters
    ----------
    table : DataFrame
        The table.
    digits : str, optional
        Format of its numbers, such as ``%.9g``.
    """
    texts = table.select_dtypes(exclude=["number", "bool"])
    harmless = {str(name): texts[name].map(_harmless) for name in texts}
    return table.assign(**harmless).to_csv(index=False, float_format=digits)


def _harmless(value: Any) -> Any:
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
