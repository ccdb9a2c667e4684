"""Channels: their roughness, the depth of a uniform flow, and what is against it.

A slope goes in, depth, mean velocity and discharge come out.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.calculator import BESIDE_CHANNEL, LARGEST_DEPTH
from orchestrator.errors import InputError
from orchestrator.physics.constants import GAS_BELOW, SLOPE
from orchestrator.physics.reported import in_units
from orchestrator.physics.velocity import (
    coarse_roughness,
    depth_mean_speed,
    outer_roughness,
    strickler_speed,
)
from orchestrator.types import BoolArray, FloatArray

MOST = 0.05
"""Steepest slope of a channel: on steeper ones grains weigh in along the bed."""


ROUGHEST = 2.0
"""Largest roughness length of a channel or of the ground, m: that of a city."""
LARGEST_D84 = 10.0
"""Largest d84 of a bed, m: that of the largest blocks of a river."""


def roughnesses(
    grains: Mapping[str, NDArray[Any]], is_channel: BoolArray
) -> dict[str, FloatArray]:
    """Find the roughness lengths of channels, of the ground, and d84 of the beds.

    Parameters
    ----------
    grains
        Parameters of grains, among them ``channel_roughness`` and ``d84`` if these are
        given.
    is_channel
        Whether each lies in a channel, whose depth or slope is known.

    Returns
    -------
    dict of str to ndarray
        ``channel_roughness``, as given, else of a channel a tenth of d84, and that of
        the grain's pocket elsewhere; ``d84`` of channels, as given or the diameter.

    Raises
    ------
    InputError
        For a roughness that is none, or a d84 that is none or of no channel.
    """
    d84 = np.where(is_channel, grains["diameter"], np.nan)
    if "d84" in grains:
        d84 = grains["d84"]
        if not is_channel.all():
            what = "nothing depends on it without a channel"
            remedy = "give a depth or bed_slope, and a liquid"
            raise InputError(what, "threshold: d84", remedy)
        for value in d84[~((d84 > 0) & (d84 <= LARGEST_D84))][:1].tolist():
            what = f"{value:g} m is not above 0 and at most {LARGEST_D84:g} m"
            raise InputError(what, "threshold: d84", "give a length in m")
    roughness = np.where(is_channel, coarse_roughness(d84), grains["roughness"])
    if "channel_roughness" in grains:
        roughness = grains["channel_roughness"]
        is_one = (roughness > 0) & (roughness <= ROUGHEST)
        for value in roughness[~is_one][:1].tolist():
            what = f"{value:g} is no length above 0 and up to {ROUGHEST:g} m"
            remedy = "give z0, a thirtieth of k_s, in m, or a part such as d/10"
            raise InputError(what, "threshold: channel_roughness", remedy)
    return {"channel_roughness": roughness, "d84": d84}


def channel_beside(table: Mapping[str, Any]) -> dict[str, FloatArray]:
    """Find the mean velocities of the same stress and depth by other roughnesses.

    Parameters
    ----------
    table
        The columns of thresholds, depths among them.

    Returns
    -------
    dict of str to ndarray
        The columns of `BESIDE_CHANNEL`; NaN where there is no mean velocity.
    """
    ustar, depth = table["ustar_m_s"], table["depth_m"]

    def by_log_law(roughness: FloatArray) -> FloatArray:
        outer = outer_roughness(roughness, ustar, table["nu_m2_s"])
        return depth_mean_speed(ustar, depth, outer)

    is_known = np.isfinite(table["mean_velocity_m_s"])
    with np.errstate(all="ignore"):
        speeds = (
            by_log_law(coarse_roughness(table["d84_m"])),
            strickler_speed(ustar, depth, table["d_m"], table["g_m_s2"]),
            by_log_law(table["z0_m"]),
        )
    known = [np.where(is_known, speed, np.nan) for speed in speeds]
    return dict(zip(BESIDE_CHANNEL, known, strict=True))


def uniform_flow(table: Mapping[str, Any]) -> dict[str, FloatArray]:
    """Find the depth and the mean velocity of the uniform flow at each threshold.

    The stress of a wide channel of depth h that falls by S is rho g h S, so that
    h = u*^2 / (g S). The slope itself changes the threshold by less than S/tan(phi),
    8 % at most, which is left out.

    Parameters
    ----------
    table
        The columns of thresholds, with `SLOPE` of either sign: a river falls.

    Returns
    -------
    dict of str to ndarray
        The columns of slope, depth, mean velocity and discharge.

    Raises
    ------
    InputError
        In a gas, or for a slope that is 0 or too steep.

    Examples
    --------
    >>> table = {"ustar_m_s": np.array([0.15]), "g_m_s2": 9.81, "z0_m": 1e-3}
    >>> table |= {"depth_m": np.nan, "z0_channel_m": 3e-3, "bed_slope": [-0.005]}
    >>> table |= {"rho_f_kg_m3": np.array([1000.0]), "nu_m2_s": 1e-6}
    >>> print(uniform_flow(table)["depth_m"].round(3))
    [0.459]
    """
    slopes = np.abs(np.asarray(table[SLOPE], float))
    if (table["rho_f_kg_m3"] < GAS_BELOW).any():
        remedy = "give a liquid: fluid.kind water"
        raise InputError("a gas has no depth", "threshold: bed_slope", remedy)
    for value in slopes[~((slopes > 0) & (slopes <= MOST))][:1].tolist():
        what = f"{value:g} is not between 0 and {MOST:g}"
        remedy = "write the fall over the length, such as 0.005"
        raise InputError(what, "threshold: bed_slope", remedy)
    # the slope may be as small as numbers are
    with np.errstate(over="ignore"):
        found = in_units(table["ustar_m_s"], {**table, SLOPE: slopes})
    return {
        SLOPE: slopes,
        "depth_m": found["depth_m"],
        "mean_velocity_m_s": found["mean_velocity_m_s"],
        "discharge_m2_s": found["discharge_m2_s"],
    }


def against_depths(table: Mapping[str, NDArray[Any]]) -> list[str]:
    """Say what is against the depth of each uniform flow.

    Parameters
    ----------
    table
        The columns of thresholds with those of `uniform_flow`.

    Returns
    -------
    list of str
        The reasons; empty where there is none, or no threshold.

    Raises
    ------
    InputError
        If no answer has a depth.
    """
    reasons = [""] * len(table["depth_m"])
    for row, depth in enumerate(table["depth_m"].tolist()):
        # a law without a threshold has its own reason
        if np.isfinite(table["ustar_m_s"][row]):
            reasons[row] = why_no_depth(depth, float(table["d_m"][row]))
    answers = np.flatnonzero(table["answer"]).tolist()
    if all(reasons[row] for row in answers):
        what = reasons[answers[0]]
        is_deep = table["depth_m"][answers[0]] > table["d_m"][answers[0]]
        remedy = f"take a {'steeper' if is_deep else 'gentler'} slope"
        raise InputError(what, "threshold: bed_slope", remedy)
    return reasons


def why_no_depth(depth: float, diameter: float) -> str:
    """Say why a depth is none of a flow over a bed of grains.

    Parameters
    ----------
    depth
        The depth, m.
    diameter
        Diameter of the grains, m.

    Returns
    -------
    str
        The reason; empty for a depth that covers the grains and is no more than
        `calculator.LARGEST_DEPTH`.

    Examples
    --------
    >>> why_no_depth(4e-4, 5e-4)
    'a depth of 0.0004 m does not cover a grain of 0.0005 m'
    """
    if not depth > diameter:
        return f"a depth of {depth:g} m does not cover a grain of {diameter:g} m"
    if depth > LARGEST_DEPTH:
        return f"a depth of {depth:g} m is deeper than {LARGEST_DEPTH:g} m"
    return ""
