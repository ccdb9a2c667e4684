"""The uniform flow of a channel at the threshold: slope in, depth and velocity out."""

import numpy as np

from orchestrator.calculator.table import Table, judge, why_no_depth
from orchestrator.errors import InputError
from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.velocity import measurable_speeds

MOST = 0.05
"""Steepest slope of a channel: on steeper ones grains weigh in along the bed."""
COLUMN = "bed_slope"
"""Column of the slope at which the channel falls."""


def add_depth(table: Table, bed_slope: float, has_depth: bool) -> None:
    """Add the depth and the mean velocity of the uniform flow at each threshold.

    The stress of a wide channel of depth h that falls by S is rho g h S, so that
    h = u*^2 / (g S). The slope itself changes the threshold by less than S/tan(phi),
    8 % at most, which is left out. A threshold whose flow would not cover the grain, is
    deeper than any, or may be laminar is marked as not valid, as where a depth is
    given.

    Parameters
    ----------
    table
        The table of `table.thresholds`; it gets the column `COLUMN` and new depths and
        mean velocities.
    bed_slope
        The slope, of either sign: a river falls.
    has_depth
        Whether a depth was given.

    Raises
    ------
    InputError
        In a gas, with a depth, for a slope that is 0 or too steep, or where no answer
        has a depth.

    Examples
    --------
    >>> from orchestrator.calculator.table import thresholds
    >>> water = {"fluid_density": [1000.0], "viscosity": [1e-6], "density": [2650.0]}
    >>> table = thresholds({"diameter": [0.03], **water})
    >>> add_depth(table, -0.005, has_depth=False)
    >>> is_answer = table["answer"].astype(bool)
    >>> ratio = 9810 * table["depth_m"] * 0.005 / table["stress_pa"]
    >>> print(ratio[is_answer].round(6))
    [1.]
    """
    slope = abs(bed_slope)
    if has_depth:
        remedy = "leave --depth out: it follows from the slope"
        raise InputError("both a depth and a bed slope", "--bed-slope", remedy)
    if (table["rho_f_kg_m3"] < GAS_BELOW).any():
        remedy = "add --fluid water"
        raise InputError("a gas has no depth", "--bed-slope", remedy)
    if not 0 < slope <= MOST:
        what = f"{bed_slope:g} is not between 0 and {MOST:g}"
        remedy = "write the fall over the length, such as 0.005"
        raise InputError(what, "--bed-slope", remedy)
    ustar = table["ustar_m_s"]
    # the slope may be as small as numbers are
    with np.errstate(over="ignore"):
        depth = ustar**2 / (table["g_m_s2"] * slope)
        speeds = measurable_speeds(
            ustar,
            roughness=table["z0_m"],
            fluid_density=table["rho_f_kg_m3"],
            viscosity=table["nu_m2_s"],
            depth=depth,
            closed=False,
        )
    table[COLUMN] = np.full(len(ustar), slope)
    table["depth_m"] = depth
    table["mean_velocity_m_s"] = speeds["mean_velocity_m_s"]
    judge(table, _of_depths(table))


def _of_depths(table: Table) -> list[str]:
    """What is against each depth; refuse a table in which no answer has one."""
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
