"""Published thresholds to compare with: a band for water, lines for air."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.physics import curves
from orchestrator.physics.curves import Air
from orchestrator.report.theory import sweep

FloatArray = NDArray[np.float64]

LEAST_CURVES = 2
"""The band is drawn only where at least this many curves were published for."""
BAGNOLD_FROM = 3.5
"""Bagnold's A is 0.1 above this Re* only; it rises below."""
SLOPED = "Shao & Lu 2000"
"""The curve for air that is drawn for sloping beds."""
GAS_RATIO = 100.0
"""Least rho_sol/rho_f of a fluid that curves for air may be compared with."""


@dataclass(frozen=True)
class Band:
    """The spread of the curves for water; arrays of one shape, NaN outside their common ranges."""

    reynolds: FloatArray
    low: FloatArray
    high: FloatArray


def water_band(reynolds: FloatArray) -> Band:
    """Lowest and highest of the published curves at each Re* that at least two of them cover."""
    logs = np.log(reynolds)
    rows = []
    for curve in curves.WATER:
        x, theta = curve.points(2000)
        rows.append(np.exp(np.interp(logs, np.log(x), np.log(theta), left=np.nan, right=np.nan)))
    table = np.array(rows)
    enough = np.isfinite(table).sum(axis=0) >= LEAST_CURVES
    inside = np.where(np.isfinite(table), table, [[np.inf]])
    low = np.where(enough, inside.min(axis=0), np.nan)
    high = np.where(enough, np.where(np.isfinite(table), table, -np.inf).max(axis=0), np.nan)
    return Band(reynolds, low, high)


def in_gas(scenes: pd.DataFrame) -> "pd.Series[bool]":
    """Which scenes may be compared with curves for air."""
    return scenes["rho_sol_kg_m3"] >= GAS_RATIO * scenes["rho_f_kg_m3"]


def air_lines(
    scenes: pd.DataFrame, slope_deg: float = 0.0
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Re* and theta_c of the curves for air, by name, for the grains and the gas of some scenes.

    The slope's factor of physics is on u*. Of several gases it is that of the least viscosity;
    empty where there is none.
    """
    scenes = scenes[in_gas(scenes)]
    if scenes.empty:
        return {}
    one = scenes.iloc[int(scenes["nu_m2_s"].argmin())]
    air = Air(one["rho_sol_kg_m3"], one["rho_f_kg_m3"], one["nu_m2_s"], one["g_m_s2"])
    d = sweep(scenes)
    factor = curves.slope_factor_on_ustar(np.asarray(slope_deg), one["phi_deg"])
    lines = {
        name: air.shields_diagram(d, factor * _ustar(name, air, tuple(d))) for name in curves.AIR
    }
    x, y = lines["Bagnold 1941"]
    lines["Bagnold 1941"] = x[x >= BAGNOLD_FROM], y[x >= BAGNOLD_FROM]
    return lines


@cache  # one of the curves is found by iteration, for each panel and slope of a figure anew
def _ustar(name: str, air: Air, diameters: tuple[float, ...]) -> FloatArray:
    """Threshold friction velocity of a curve for air over a horizontal bed, m/s."""
    return curves.AIR[name](np.array(diameters), air)
