"""Friction velocities of rows in the unit that a reader measures a flow in."""

from typing import Any

import pandas as pd

from orchestrator.physics.reported import in_units
from orchestrator.report import single
from orchestrator.report.subjects import ReportedQuantity
from orchestrator.types import FloatArray


def told_by(rows: Any, ustar: Any, told: ReportedQuantity) -> FloatArray:
    """Take friction velocities in the unit of a quantity.

    Parameters
    ----------
    rows
        A threshold with the columns of its scene, or a table of n.
    ustar
        Friction velocities, m/s, shape (n,).
    told
        The quantity.

    Returns
    -------
    ndarray
        In its unit, shape (n,).
    """
    return in_units(ustar, rows)[told.column()]


def compared_over_computed(row: pd.Series) -> float:
    """Compute the ratio of the threshold to compare with to that of one computed grain.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    float
        The ratio of the friction velocities.
    """
    return float(row["compared_level_ustar_m_s"]) / float(row["level_ustar_m_s"])


def advised_over_computed(row: pd.Series) -> float:
    """Compute the ratio of the flows of a bed that a reader should take to its own.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    float
        The ratio of the friction velocities; 1 where the computed ones are advised, and
        on a level bed, whose measured threshold is that of each of its grains.
    """
    told = single.quantity_of_row(row)
    if single.is_level(row) or single.advised_column(row, told) == told.column():
        return 1.0
    return compared_over_computed(row)
