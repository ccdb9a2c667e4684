"""Flows between others: the stress on a bed as a smooth function of its roughness.

Over one bed, on one mesh, the stress over the undisturbed one is smooth in ln(z0). The
polynomial in ln(z0) through `LEAST_FLOWS` or more, each at most `APART` times as rough
as the one before it, is within 0.1 % of the solved flow over piles of 15 to 30 degrees
(docs/flow.md). How far it is off is found from the solved flows alone: each of them but
the first and the last is left out, and put between those that remain.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil, log

import numpy as np

from orchestrator.flow.stress import Measure, WallStress
from orchestrator.study.method import LEAST_FLOWS
from orchestrator.types import FloatArray

APART = 2.0
"""Ratio of neighbouring roughnesses up to which the error is below `MOST_ERROR`."""
MOST_ERROR = 0.005
"""Relative error of tau up to which no more flows are solved."""
RISES = 1e-3
"""Least slope of a face that the flow goes up."""


def nodes(roughnesses: Sequence[float]) -> tuple[float, ...]:
    """Choose the roughnesses of some flows at which they are solved.

    Parameters
    ----------
    roughnesses
        Roughness lengths, m.

    Returns
    -------
    tuple of float
        Those of them nearest to equal steps in their logarithm, rising: the first and
        the last are among them. All, where no flow would be saved.
    """
    each = np.unique(np.asarray(roughnesses, float))
    span = log(each[-1] / each[0]) / log(APART)
    count = max(LEAST_FLOWS, ceil(span - 1e-9) + 1)
    if len(each) <= count:
        return tuple(each.tolist())
    steps = np.linspace(log(each[0]), log(each[-1]), count)
    nearest = np.abs(np.log(each)[:, None] - steps).argmin(axis=0)
    chosen = np.unique(nearest)
    if len(chosen) < LEAST_FLOWS:
        return tuple(each.tolist())
    return tuple(each[chosen].tolist())


def stress(roughness: float, solved: Mapping[float, WallStress]) -> WallStress:
    """Find the stress on a bed from that on the same bed with other roughness.

    Parameters
    ----------
    roughness
        The roughness length, m.
    solved
        The stress of solved flows on the same mesh, by their roughness lengths, m.

    Returns
    -------
    WallStress
        The stress on each face.
    """
    each = [*solved.values()]
    at = log(roughness)
    return replace(
        each[0],
        tau_wall=_between(at, solved, [one.tau_wall for one in each]),
        ustar_over_ustar0_eq10=_between(
            at, solved, [one.ustar_over_ustar0_eq10 for one in each]
        ),
    )


def _between(
    at: float, solved: Mapping[float, WallStress], values: Sequence[FloatArray]
) -> FloatArray:
    """The polynomial in ln(z0) through values on the faces of a bed."""
    from scipy.interpolate import BarycentricInterpolator

    return np.asarray(BarycentricInterpolator(np.log([*solved]), values)(at))


def error(solved: Mapping[float, WallStress], measure: Measure) -> float:
    """Measure how far the stress between solved flows is off.

    Parameters
    ----------
    solved
        The stress of solved flows on one mesh, by their roughness lengths, m.
    measure
        ``"wall"`` or ``"eq10"``.

    Returns
    -------
    float
        The largest relative error of tau at a flow that is left out, on windward faces
        and on all others with more than the undisturbed stress: in a wake, whose stress
        changes its sign, no relative error is small. It is more than that with all
        flows, which are less far apart.
    """
    rising = sorted(solved)
    largest = 0.0
    for left_out in rising[1:-1]:
        flow = solved[left_out]
        rest = {z0: solved[z0] for z0 in rising if z0 != left_out}
        made = stress(left_out, rest).tau(measure)
        tau = flow.tau(measure)
        felt = (np.gradient(flow.z_m, flow.x_m) > RISES) | (tau > 1)
        off = np.abs(made[felt] / tau[felt] - 1)
        largest = max(largest, float(off.max(initial=0.0)))
    return largest
