"""The parameters of a deck that say how the grains touch and how the flow is raised."""

import math

import numpy as np
from numpy.typing import NDArray

from orchestrator.study.parts import Grain, Protocol
from orchestrator.study.sizes import smallest

FloatArray = NDArray[np.float64]

SAMPLING_INTERVAL = 0.5
"""Time between two samples of the grains, sqrt(d/g')."""
SETTLE = 10.0
"""Time in which the bed settles before the first load step, sqrt(d/g')."""
POURED_DRAG = 2.0
"""Drag of a still fluid in which a poured bed settles, m sqrt(g'/d): its springs may be softer than
those of the pouring, and without a drag a pile of 25 degrees was not at rest at the end."""
SETTLE_FLOW = math.sqrt(0.5)
"""Flow of the settling over that of the first load step: about half of its force. Without any, a
bed at its limiting slope would not come to rest."""
START = 0.9
"""Flow of the first load step over that of the first threshold by the pivot law."""
STIR = 0.02
"""A counted grain that is no further from its place lies there, d: it is left out of the dump.
With a small displacement criterion, or small grains, it is less."""
AWAY = 10.0
"""A counted grain that has come so far along the bed is gone, d: those that it could still meet
have left before it."""
BEYOND = 1.2
"""The last load step's flow over that at which the pivot law says that enough grains have moved."""


def contact(grain: Grain, protocol: Protocol) -> dict[str, float]:
    """The contact law's dimensionless numbers."""
    return {
        "friction": math.tan(math.radians(grain.friction_angle_deg)),
        "stiffness": grain.stiffness,
        "damping": grain.damping,
        "time_step": protocol.time_step,
    }


def flows(first: float, last: float, step: float) -> FloatArray:
    """The flow of the settling, then those of load steps that rise by one factor.

    Parameters
    ----------
    first, last : float
        Flow of the first load step, and the least that the last one must reach.
    step : float
        Relative rise from one load step to the next.
    """
    count = 1 + math.ceil(math.log(last / first) / math.log1p(step))
    rising = first * (1 + step) ** np.arange(count)
    return np.concatenate([[SETTLE_FLOW * first], rising])


def raising(
    protocol: Protocol, enough: int, *, smallest: float = 1.0, is_poured: bool = False
) -> dict[str, float | int]:
    """How the deck waits at a load step, looks at the grains and goes on to the next.

    Parameters
    ----------
    protocol : Protocol
        Protocol of the scene.
    enough : int
        The sequence of load steps ends early when no more than this many grains still lie.
    smallest : float
        Diameter of the smallest grain that may move, d.
    is_poured : bool
        Whether the bed was poured, and so on springs of its own.
    """
    return {
        "waiting_time": protocol.waiting_time,
        "sampling_interval": SAMPLING_INTERVAL,
        "settle": SETTLE,
        "settle_drag": POURED_DRAG if is_poured else 0.0,
        "displacement_criterion": protocol.displacement_criterion,
        "stir": min(STIR, protocol.displacement_criterion * smallest / 2),
        "away": AWAY,
        "enough": enough,
    }


def poured_cost_s(
    load_steps: float, grains: float, exposed: float, rules: Protocol, grain: Grain
) -> float:
    """Expected time of one core for a deck of a poured bed, s: 6e6 grain-steps a second.

    The more grains are exposed, the more often one passes before all have waited: load steps of
    2000 took four times as long as those of 100. The smallest grain sets the time step.
    """
    hold = rules.waiting_time * (1 + exposed / 700)
    small = math.pow(smallest(grain.sizes, grain.diameter), 1.5)
    return _cost_s(load_steps * hold / small, grains, 6e6, rules, grain.stiffness)


def run_cost_s(load_steps: float, grains: int, protocol: Protocol, stiffness: float) -> float:
    """Expected time of one core, s: holds of twice the waiting time, 4.5e7 grain-steps a second.

    Measured on piles of 30 to 770 counted grains and 150 single ones, on one core: holds are
    shorter and steps dearer than that.
    """
    return _cost_s(load_steps * 2 * protocol.waiting_time, grains, 4.5e7, protocol, stiffness)


def _cost_s(time: float, grains: float, rate: float, rules: Protocol, stiffness: float) -> float:
    """Time of one core for a run of so many sqrt(d/g'), at a rate of grain-steps a second."""
    return 0.1 + time * math.sqrt(stiffness) / rules.time_step * grains / rate
