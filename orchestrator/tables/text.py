"""A table as the text of a file."""

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
    harmless = {str(name): _column(texts[name]) for name in texts}
    return table.assign(**harmless).to_csv(index=False, float_format=digits)


def _column(texts: pd.Series) -> pd.Series:
    """Thousands of rows share few texts."""
    named = (value for value in texts.unique() if isinstance(value, str))
    changed = {text: safe for text in named if (safe := _harmless(text)) != text}
    return texts.map(lambda value: changed.get(value, value)) if changed else texts


def _harmless(text: str) -> str:
    # pandas writes \r without quotes, and a reader takes it for the end of the row
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.startswith(BEGINS):
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text
