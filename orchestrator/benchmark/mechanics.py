"""Entries and tables that the scenes of several levels share."""

from typing import Any

import numpy as np
import pandas as pd

from orchestrator.types import Row


def mechanics(
    d: float, density: float, gravity: float, weight: float, stiffness: float
) -> Row:
    """List the mechanics of a grain in SI units.

    Parameters
    ----------
    d
        Diameter, m.
    density
        Density, kg/m3.
    gravity
        Acceleration of gravity of the submerged grain, m/s2.
    weight
        Submerged weight, N.
    stiffness
        Stiffness of a contact, K d/W.

    Returns
    -------
    dict
        Entries of ``scene.json``.
    """
    return {
        "mass_kg": density * np.pi / 6 * d**3,
        "reduced_gravity_m_s2": gravity,
        "weight_n": weight,
        "spring_n_m": stiffness * weight / d,
        "time_unit_s": float(np.sqrt(d / gravity)),
    }


def three_grains(centres: Any, diameter: Any) -> pd.DataFrame:
    """List two fixed grains and a mobile one.

    Parameters
    ----------
    centres
        X and z of the centres, m, shape (3, 2).
    diameter
        Diameter of all, or of each, m.

    Returns
    -------
    DataFrame
        The table ``grains`` of a scene.
    """
    x, z = centres.T
    kinds = ["fixed", "fixed", "mobile"]
    return pd.DataFrame(
        {"id": [1, 2, 3], "x_m": x, "z_m": z, "d_m": diameter, "kind": kinds}
    )
