"""Thresholds in the units that a report quotes: speeds and stresses, with intervals.

Beside each stands what a measured threshold gives: the same flow, with the measured
threshold of one grain on a level bed in place of the computed one.
"""

import re
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.physics import saltation
from orchestrator.physics.beside import GOES_ON
from orchestrator.physics.constants import GAS_BELOW, GRAIN_COLUMNS
from orchestrator.physics.gusts import peak_over_mean
from orchestrator.physics.threshold import SingleGrain, thresholds_of
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.types import FloatArray

ENDS = ("_low", "_high")
"""Endings of the columns of an interval, before the unit."""
SPEEDS = ("wind_10m", "mean_velocity")
"""Speeds of which the interval and the measured value are told, without the unit."""
GUSTS = re.compile(r"(\d+) of intensity (\S+),")
"""Events and intensity in the words of the column ``gusts``."""


def quoted(rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Compute the columns that reports quote.

    The ends of an interval of the Shields number are those of a stress: u*_0 goes with
    its root. Measured values are u*_0 times the ratio of the measured friction velocity
    of one grain on a level bed to the computed one. On a level bed under its
    undisturbed flow every grain has the measured threshold itself.

    Parameters
    ----------
    rows
        Thresholds of piles or of single grains, with the columns of their scenes and
        those of `beside`.

    Returns
    -------
    dict of str to ndarray
        Stress of the undisturbed flow, Pa; ends of u*_0, of the wind at 10 m, of the
        mean velocity (m/s) and of that stress; the same with the measured threshold.
        NaN where there is none.
    """
    ustar = _ustar(rows)
    density = rows["rho_f_kg_m3"].to_numpy(float)
    columns = {"stress_pa": density * ustar**2}
    for end, at in zip(ENDS, _interval(rows, ustar), strict=True):
        columns |= _in_units(rows, at, end)
    level = grain_ustar(rows.assign(alpha_deg=0.0))
    measured = {}
    for name in ("curve", "median", "low", "high"):
        theta = rows[f"measured_{name}"].to_numpy(float)
        measured[name] = np.sqrt(theta * _weight(rows) / density)
    best = measured["curve"]
    is_liquid = density >= GAS_BELOW
    has_rows = is_liquid & np.isfinite(measured["median"])
    best = np.where(has_rows, measured["median"], best)
    columns["level_ustar_m_s"] = level
    columns["measured_level_ustar_m_s"] = best
    is_flat = _is_flat(rows)
    for name, of_grain in {
        "": best,
        "_low": measured["low"],
        "_high": measured["high"],
    }.items():
        there = np.where(is_flat, of_grain, ustar * of_grain / level)
        columns |= {f"measured_{k}": v for k, v in _in_units(rows, there, name).items()}
    if "first_ustar0_m_s" in rows:
        first = rows["first_ustar0_m_s"].to_numpy(float)
        columns["measured_first_ustar0_m_s"] = np.where(
            is_flat, best, first * best / level
        )
    return columns


def _ustar(rows: pd.DataFrame) -> FloatArray:
    """Friction velocity of the undisturbed flow at each threshold, m/s."""
    if "ustar0_m_s" in rows:
        return rows["ustar0_m_s"].to_numpy(float)
    is_dem = (rows["method"] == "dem").to_numpy()
    return np.where(is_dem, rows["ustar_m_s"], rows["ustar_closed_form_m_s"])


def _interval(rows: pd.DataFrame, ustar: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Ends of the friction velocity, m/s; of a pile by its Shields number."""
    if "shields_low" not in rows:
        low = rows["ustar_low_m_s"].to_numpy(float)
        high = rows["ustar_high_m_s"].to_numpy(float)
        return low, high
    theta = rows["shields"].to_numpy(float)
    with np.errstate(invalid="ignore", divide="ignore"):
        low = ustar * np.sqrt(rows["shields_low"].to_numpy(float) / theta)
        high = ustar * np.sqrt(rows["shields_high"].to_numpy(float) / theta)
    return low, high


def _in_units(rows: pd.DataFrame, ustar: FloatArray, end: str) -> dict[str, FloatArray]:
    """A friction velocity (m/s) with its speeds and its stress, by column."""
    speeds = _speeds_of(rows, ustar)
    density = rows["rho_f_kg_m3"].to_numpy(float)
    columns = {
        f"ustar0{end}_m_s": ustar,
        f"stress{end}_pa": density * ustar**2,
    }
    for name in SPEEDS:
        columns[f"{name}{end}_m_s"] = speeds[f"{name}_m_s"]
    return columns


def _speeds_of(rows: pd.DataFrame, ustar: FloatArray) -> dict[str, FloatArray]:
    """The measurable speeds of undisturbed flows of some friction velocities, m/s."""
    is_closed = (rows["flow_top"] == "closed channel").to_numpy()
    parts = []
    for closed in (False, True):
        speeds = measurable_speeds(
            ustar,
            roughness=rows["z0_m"].to_numpy(float),
            fluid_density=rows["rho_f_kg_m3"].to_numpy(float),
            viscosity=rows["nu_m2_s"].to_numpy(float),
            depth=rows["depth_m"].to_numpy(float),
            closed=closed,
        )
        parts.append(speeds)
    is_open, is_shut = parts
    return {
        name: np.where(is_closed, is_shut[name], column)
        for name, column in is_open.items()
    }


def _weight(rows: pd.DataFrame) -> FloatArray:
    """Weight of a layer of grains under the fluid, (rho_sol - rho_f) g d, Pa."""
    excess = rows["rho_sol_kg_m3"] - rows["rho_f_kg_m3"]
    return (excess * rows["g_m_s2"] * rows["d_m"]).to_numpy(float)


def grain_ustar(rows: pd.DataFrame) -> FloatArray:
    """Compute the threshold of one grain by each row's law, criterion and gusts.

    Parameters
    ----------
    rows
        Rows with the columns `GRAIN_COLUMNS`, ``force_law`` and ``gusts``; without
        ``criterion`` grains leave their pockets.

    Returns
    -------
    ndarray
        Friction velocity of the mean flow on the slope of each row, m/s, shape (n,).
    """
    found = np.full(len(rows), np.nan)
    for law in rows["force_law"].unique():
        is_of_law = (rows["force_law"] == law).to_numpy()
        of_law = rows.loc[is_of_law, list(GRAIN_COLUMNS.values())]
        grains = [SingleGrain.of_row(row) for row in of_law.to_dict("records")]
        at = [each.friction_velocity for each in thresholds_of(str(law), grains)]
        found[is_of_law] = np.array(at, float)
    gust = _gusts(rows)
    leaving = found / np.sqrt(np.nan_to_num(gust, nan=1.0))
    if "criterion" not in rows:
        return leaving
    is_going_on = (rows["criterion"] == GOES_ON).to_numpy()
    if not is_going_on.any():
        return leaving
    peak = np.nan_to_num(gust, nan=saltation.PEAK)[is_going_on]
    # those that only leave their pockets are not followed over their beds
    going = rows[is_going_on]
    leaving[is_going_on] = _going_on(going, found[is_going_on], peak)
    return leaving


def _gusts(rows: pd.DataFrame) -> FloatArray:
    """Largest over mean stress of the gusts of each row; NaN without gusts."""
    told = rows.get("gusts", pd.Series(None, rows.index, dtype=object))
    found = told.astype(object).map(_gust, na_action="ignore")
    return np.asarray(found, float)


def _gust(told: str) -> float:
    """Largest over mean stress of gusts that a table has as words."""
    parts = GUSTS.match(told)
    assert parts
    return peak_over_mean(float(parts[2]), float(parts[1]))


def hoppers(rows: pd.DataFrame) -> saltation.Grains:
    """Make the single grains of rows as they hop over their beds.

    Parameters
    ----------
    rows
        Rows with the columns `GRAIN_COLUMNS`, n of them.

    Returns
    -------
    Grains
        The n grains.
    """
    return saltation.Grains.of(
        rows["d_m"],
        density=rows["rho_sol_kg_m3"],
        fluid_density=rows["rho_f_kg_m3"].to_numpy(float),
        viscosity=rows["nu_m2_s"],
        slope_deg=rows["alpha_deg"],
        roughness=rows["z0_m"],
        gravity=rows["g_m_s2"],
    )


def _going_on(rows: pd.DataFrame, leaving: FloatArray, peak: FloatArray) -> FloatArray:
    """The same of grains that go on, from the steady flow that turns them over."""
    density = rows["rho_f_kg_m3"].to_numpy(float)
    per_shields = _weight(rows) / density
    grains = hoppers(rows)
    further = saltation.tabulated(grains).initiation(peak)
    steady = leaving**2 / per_shields
    found = saltation.motion(steady, further, saltation.hops(grains), peak)
    return np.asarray(np.sqrt(found.shields * per_shields))


def _is_flat(rows: pd.DataFrame) -> Any:
    """Whether each bed is level, so that its flow has one stress everywhere."""
    if "bed_shape" not in rows:
        return np.zeros(len(rows), bool)
    is_flat = (rows["bed_shape"] == "flat") & rows["profile"].isna()
    return is_flat.to_numpy()
