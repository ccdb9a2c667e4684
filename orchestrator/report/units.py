"""Friction velocities of rows in the unit that a reader measures a flow in."""

from typing import Any

import numpy as np
import pandas as pd

from orchestrator.report import single
from orchestrator.report.subjects import Quantity
from orchestrator.types import FloatArray


def of_row(row: pd.Series, ustar: Any, told: Quantity) -> FloatArray:
    """Convert several friction velocities of one row.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.
    ustar
        Friction velocities, m/s, shape (n,).
    told
        The quantity.

    Returns
    -------
    ndarray
        In its unit, shape (n,).
    """
    return np.array([single.in_unit(row, float(one), told) for one in ustar])


def of_rows(rows: pd.DataFrame, ustar: Any, told: Quantity) -> FloatArray:
    """Convert a friction velocity of each row.

    Parameters
    ----------
    rows
        Thresholds with the columns of their scenes.
    ustar
        Friction velocities, m/s, shape (n,).
    told
        The quantity.

    Returns
    -------
    ndarray
        In its unit, shape (n,).
    """
    pairs = zip(rows.to_dict("records"), ustar, strict=True)
    return np.array([single.in_unit(row, float(one), told) for row, one in pairs])


def measured_over_computed(row: pd.Series) -> float:
    """Compute the measured over the computed threshold of one grain on a level bed.

    Parameters
    ----------
    row
        A threshold with the columns of its scene.

    Returns
    -------
    float
        The ratio of the friction velocities.
    """
    return float(row["measured_level_ustar_m_s"]) / float(row["level_ustar_m_s"])
