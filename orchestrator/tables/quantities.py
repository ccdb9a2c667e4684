"""Numbers of a scene that several tables have."""

from collections.abc import Mapping
from math import nan
from typing import Any

import numpy as np

from orchestrator.physics.reported import every_unit
from orchestrator.study import fields
from orchestrator.study.criterion import ENTRAINED
from orchestrator.study.scene import Scene
from orchestrator.types import Row

POINT = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law", "regime")
"""Columns by which a scene is found in a figure; tables of results have them too."""

ALONE: Row = {
    "criterion": ENTRAINED,
    "shields_entrained": nan,
    "shields_sustained": nan,
    "shields_sustained_low": nan,
    "shields_sustained_high": nan,
    "shields_cessation": nan,
    "decides": ENTRAINED,
}
"""Columns of the criterion of a single grain that only leaves its pocket."""


def point(scene: Scene) -> Row:
    """Make the columns by which a scene is found in a figure.

    Returns
    -------
    dict
        Its columns `POINT`.
    """
    return {column: fields.COLUMNS[column].used(scene) for column in POINT}


SPEEDS: Mapping[str, str] = {
    "wind_1m_m_s": "undisturbed wind 1 m above the flat bed of a gas, by the log law",
    "wind_10m_m_s": "undisturbed wind 10 m above the flat bed of a gas, by the log law",
    "current_1m_m_s": (
        "undisturbed current 1 m above the flat bed of a liquid, by the log law"
    ),
    "mean_velocity_m_s": (
        "mean velocity of the undisturbed flow over the depth of a channel, by the log "
        "law; empty where it may be laminar"
    ),
    "discharge_m2_s": (
        "mean velocity times depth of a channel: discharge for each metre of width"
    ),
}
"""Columns of the speeds of undisturbed flows."""


def speeds(scene: Scene, ustar: float) -> Row:
    """Make the columns `SPEEDS` of an undisturbed flow.

    Parameters
    ----------
    scene
        The scene with its flow and fluid.
    ustar
        Friction velocity of the flow, m/s.

    Returns
    -------
    dict
        Its columns.
    """
    flow = scene.flow
    fluid = scene.fluid
    undisturbed = {
        "rho_f_kg_m3": fluid.density,
        "nu_m2_s": fluid.viscosity,
        "z0_m": scene.bed.roughness,
        "depth_m": flow.depth or np.nan,
        "flow_top": flow.top,
    }
    speeds = every_unit(ustar, undisturbed)
    row = {}
    for column in SPEEDS:
        if np.isfinite(speeds.get(column, nan)):
            row[column] = float(speeds[column])
    mean = row.get("mean_velocity_m_s")
    if mean:
        row["discharge_m2_s"] = mean * (flow.depth or 0.0)
    return row


def shields(scene: Scene, tau: Any) -> Any:
    """Make a Shields number of a stress.

    Parameters
    ----------
    scene
        The scene with its grain.
    tau
        Stress, Pa, a number or an array.

    Returns
    -------
    float or ndarray
        The stress over (rho_sol - rho_f) g d.
    """
    return tau * np.pi / 6 * scene.grain.diameter**2 / scene.weight


def reynolds(scene: Scene, tau: Any) -> Any:
    """Make the particle Reynolds number of a stress.

    Parameters
    ----------
    scene
        The scene with its grain and fluid.
    tau
        Stress, Pa, a number or an array.

    Returns
    -------
    float or ndarray
        Re* = u* d/nu.
    """
    ustar = np.sqrt(tau / scene.fluid.density)
    return ustar * scene.grain.diameter / scene.fluid.viscosity
