"""The flow's force on each grain of a bed, as a function of the undisturbed friction velocity."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from orchestrator.types import FloatArray

Force = Callable[[FloatArray], FloatArray]
"""Size of a force (N) at local friction velocities (m/s) of at least 0."""

RANGE = 1e-4, 1e4
"""Local friction velocities of a table of forces, over that at which a grain goes by itself."""
PLACES, FEWER = 4001, 501
"""Places of a table. Fewer are within 1e-8 of the force law and take a tenth of the time."""


@dataclass(frozen=True)
class Loading:
    """Forces on n grains.

    Attributes
    ----------
    drag, lift : callable
        The force law of the scene: of n local friction velocities, or of one.
    ratio : ndarray, shape (n,)
        Local friction velocity over the undisturbed one; negative where the flow runs back, 0 for
        a grain that carries no force.
    along, outward : ndarray, shape (n, 2)
        Unit vectors downstream along the bed and out of it. Drag follows the flow's direction,
        lift is never negative.
    """

    drag: Force
    lift: Force
    ratio: FloatArray
    along: FloatArray
    outward: FloatArray

    def at(self, ustar0: float) -> FloatArray:
        """Force on each grain (N) at an undisturbed friction velocity (m/s), shape (n, 2)."""
        loaded = self.ratio != 0
        local = np.where(loaded, np.abs(self.ratio), 1.0) * ustar0
        drag, lift = self.drag(local) * np.sign(self.ratio), self.lift(local)
        force = drag[:, None] * self.along + lift[:, None] * self.outward
        return np.where(loaded[:, None], force, 0.0)

    def in_steps(self, flows: Sequence[float]) -> FloatArray:
        """Force on each grain at several undisturbed friction velocities, shape (steps, n, 2)."""
        return np.array([self.at(flow) for flow in flows])


class ForceTable:
    """Drag and lift over the weight (N), tabulated so that thousands of grains ask in turn.

    Between its places each is a power of the friction velocity times a small correction, a cubic
    spline of the logarithms: with all places it reproduces the force laws within 1e-12. `unit` is
    the friction velocity in the middle of the table, m/s.
    """

    def __init__(
        self, drag: Force, lift: Force, weight: float, unit: float, places: int = PLACES
    ) -> None:
        ustar = unit * np.geomspace(*RANGE, places)
        self._log_ustar = np.log(ustar)
        self._forces = np.array([drag(ustar), lift(ustar)]) / weight
        # a law without lift has none anywhere
        logs = np.log(np.where(self._forces > 0, self._forces, 1e-300))
        pieces = CubicSpline(self._log_ustar, logs, axis=1).c
        self._pieces = pieces.transpose(1, 2, 0).copy()

    def reaching(self, drag_arm: float, lift_arm: float, goal: float) -> float:
        """The local friction velocity at which drag and lift times their arms reach a goal, m/s.

        0 where they always do, infinite where they never do.
        """
        moment = drag_arm * self._forces[0] + lift_arm * self._forces[1]
        above = int((moment >= goal).argmax())
        if moment[above] < goal:
            return math.inf
        if above == 0:
            return 0.0
        start, end = self._log_ustar[above - 1 : above + 1].tolist()
        (a, b, c, d), (e, f, g, h) = self._pieces[above - 1].tolist()

        def excess(log_ustar: float) -> float:
            x = log_ustar - start
            drag = math.exp(((a * x + b) * x + c) * x + d)
            lift = math.exp(((e * x + f) * x + g) * x + h)
            return drag_arm * drag + lift_arm * lift - goal

        # round-off at the places themselves
        if excess(start) >= 0 or excess(end) <= 0:
            return math.exp(start if excess(start) >= 0 else end)
        return math.exp(brentq(excess, start, end, xtol=1e-15))
