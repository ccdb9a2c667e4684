"""The friction velocity at which the forces on a grain reach a given moment."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize.elementwise import find_root

from orchestrator.physics.exposure import Exposure, FloatArray
from orchestrator.physics.force_law import ForceLaw

LADDER = np.geomspace(1e-9, 1e9, 37)
"""Friction Reynolds numbers between which the first root is looked for.

A sum that is above its target for less than one rung, half a decade, is missed; the sum of a pivot
rises throughout.
"""


def friction_velocity_at(
    law: ForceLaw,
    exposure: Exposure,
    target: ArrayLike,
    *,
    along: ArrayLike = 1.0,
    outward: ArrayLike = 0.0,
    turning: ArrayLike = 0.0,
    speed_up: ArrayLike = 1.0,
) -> FloatArray:
    """The least undisturbed friction velocity at which a sum of the forces reaches a target.

    The sum is ``along drag + outward lift + turning torque`` at the local friction velocity, which
    is `speed_up` times the undisturbed one. Where the flow runs backwards (`speed_up` < 0) drag
    and torque change their sign. About a contact, `along` and `outward` are the arms of drag and
    lift over a length, `turning` is one over it, and the target is the moment of the weight alike.

    Parameters
    ----------
    law : ForceLaw
        The forces.
    exposure : Exposure
        The grains.
    target : array_like
        What is to be reached, N.
    along, outward : array_like
        Weights of drag and lift.
    turning : array_like
        Weight of the torque, 1/m.
    speed_up : array_like
        Local over undisturbed friction velocity, signed.

    Returns
    -------
    ndarray
        Friction velocity, m/s, in the broadcast shape; NaN where the target is not positive, since
        such a grain needs no flow, and infinite where no flow reaches it.
    """
    local = np.asarray(speed_up, float)
    weights = (np.sign(local) * along, np.asarray(outward), np.sign(local) * turning)
    given = (*exposure.fields, *weights, np.asarray(target, float), np.abs(local))
    arrays = np.broadcast_arrays(*given)
    shape = arrays[0].shape
    *args, ratio = (np.ravel(array).astype(float) for array in arrays)

    def excess(ustar: FloatArray, *grain: FloatArray) -> FloatArray:
        here, (a, b, c, goal) = Exposure(*grain[:6]), grain[6:]
        sum_ = law.drag(ustar, here) * a + law.lift(ustar, here) * b + law.torque(ustar, here) * c
        return np.asarray(sum_ - goal)

    found = np.where(args[-1] > 0, np.inf, np.nan)
    low, high = np.zeros_like(ratio), np.full_like(ratio, np.nan)
    open_ = np.flatnonzero(args[-1] > 0)
    unit = args[3] / args[0]
    # a ladder from below, since the sum need not rise everywhere if a weight is negative
    for rung in LADDER:
        at = rung * unit[open_]
        reached = excess(at, *(arg[open_] for arg in args)) >= 0
        high[open_[reached]] = at[reached]
        open_, at = open_[~reached], at[~reached]
        low[open_] = at
        if not len(open_):
            break
    where = np.flatnonzero(np.isfinite(high))
    if len(where):
        some = tuple(arg[where] for arg in args)
        found[where] = find_root(excess, (low[where], high[where]), args=some).x
    with np.errstate(divide="ignore"):
        return np.asarray((found / ratio).reshape(shape))
