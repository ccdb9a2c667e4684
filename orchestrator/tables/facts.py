"""Facts of the threshold methods that rows of a table name."""

from typing import Any

import pandas as pd

from orchestrator.study.methods import METHODS


def needs_run(rows: pd.DataFrame) -> "pd.Series[bool]":
    """Tell which rows a run of grains has answered.

    Parameters
    ----------
    rows
        Rows with the column ``method`` of their answers.

    Returns
    -------
    Series
        Truth values; all others are answered in closed form.
    """
    runs = {name: method.needs_run for name, method in METHODS.items()}
    return rows["method"].map(runs).astype(bool)


def has_contacts(rows: pd.DataFrame) -> "pd.Series[bool]":
    """Tell in which rows a grain that left freed others.

    Parameters
    ----------
    rows
        Rows with the column ``method`` of their answers.

    Returns
    -------
    Series
        Truth values; in all others each grain is taken by itself.
    """
    frees = {name: method.has_contacts for name, method in METHODS.items()}
    return rows["method"].map(frees).astype(bool)


def packs_grains(row: Any) -> bool:
    """Tell whether the threshold of a pile is of packed grains, not of places.

    Parameters
    ----------
    row
        A row with the column ``method`` of its answer.

    Returns
    -------
    bool
        Whether it is.
    """
    return METHODS[row["method"]].packs_grains


def are_followed(rows: pd.DataFrame) -> "pd.Series[bool]":
    """Tell on which beds DEM follows the grains, whose drag is of no force law.

    Parameters
    ----------
    rows
        Rows with the columns of their scenes.

    Returns
    -------
    Series
        Truth values.
    """
    # the field has an effect on such beds alone, and its cell is blank on others
    return rows["dropped_grains"].notna()
