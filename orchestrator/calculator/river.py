"""The depth of a channel whose uniform flow starts motion, and what is against it.

A slope goes in, depth and mean velocity come out.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orchestrator.calculator import LARGEST_DEPTH
from orchestrator.errors import InputError
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.reported import SLOPE, in_units
from orchestrator.types import FloatArray

MOST = 0.05
"""Steepest slope of a channel: on steeper ones grains weigh in along the bed."""


def uniform_flow(table: Mapping[str, Any], bed_slope: float) -> dict[str, FloatArray]:
    """Find the depth and the mean velocity of the uniform flow at each threshold.

    The stress of a wide channel of depth h that falls by S is rho g h S, so that
    h = u*^2 / (g S). The slope itself changes the threshold by less than S/tan(phi),
    8 % at most, which is left out.

    Parameters
    ----------
    table
        The columns of thresholds.
    bed_slope
        The slope, of either sign: a river falls.

    Returns
    -------
    dict of str to ndarray
        The columns of slope, depth and mean velocity.

    Raises
    ------
    InputError
        In a gas, or for a slope that is 0 or too steep.

    Examples
    --------
    >>> table = {"ustar_m_s": np.array([0.15]), "g_m_s2": 9.81, "z0_m": 1e-3}
    >>> table |= {"depth_m": np.nan}
    >>> table |= {"rho_f_kg_m3": np.array([1000.0]), "nu_m2_s": 1e-6}
    >>> print(uniform_flow(table, -0.005)["depth_m"].round(3))
    [0.459]
    """
    slope = abs(bed_slope)
    if (table["rho_f_kg_m3"] < GAS_BELOW).any():
        remedy = "add --fluid water"
        raise InputError("a gas has no depth", "--bed-slope", remedy)
    if not 0 < slope <= MOST:
        what = f"{bed_slope:g} is not between 0 and {MOST:g}"
        remedy = "write the fall over the length, such as 0.005"
        raise InputError(what, "--bed-slope", remedy)
    slopes = np.full(np.shape(table["ustar_m_s"]), slope)
    # the slope may be as small as numbers are
    with np.errstate(over="ignore"):
        found = in_units(table["ustar_m_s"], {**table, SLOPE: slopes})
    return {
        SLOPE: slopes,
        "depth_m": found["depth_m"],
        "mean_velocity_m_s": found["mean_velocity_m_s"],
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
        raise InputError(what, "--bed-slope", remedy)
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
