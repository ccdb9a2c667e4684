"""The paper's rule: Eq. 2 or Eq. 4, each where it holds, both in the transition between them."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import Threshold

Regime = Literal["low", "high", "transition"]

LAWS_OF: dict[Regime, tuple[str, ...]] = {
    "low": ("low",),
    "high": ("high",),
    "transition": ("low", "high"),
}
"""Names of the laws that the paper's rule picks in each regime."""


def regime(low: Threshold, high: Threshold) -> NDArray[np.str_]:
    """Which of Eqs. 2 and 4 holds at its own threshold: ``low``, ``high`` or ``transition``.

    The ranges of Re* alone decide, Re* < 3 and Re* >= 30, and not where the drag of Eq. 4 ends:
    gravel is in the high regime, if beyond its drag law.

    Raises
    ------
    ArithmeticError
        If both hold somewhere; no such grain is known.
    """
    slow, fast = LAWS["low"].covers(low.reynolds), LAWS["high"].covers(high.reynolds)
    if np.any(slow & fast):
        raise ArithmeticError("both force laws hold for one grain")
    return np.where(slow, "low", np.where(fast, "high", "transition"))
