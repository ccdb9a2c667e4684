"""Sheltering: the level at which the flow begins, so that the drags on a bed add up to its stress.

A force law gives the drag on a grain that stands alone. The drags on all exposed grains of a bed
would add up to several times the stress of the flow. So on each patch of the bed the level at which
the flow begins is raised until they do not: ``sum of drag_i(u*, gap_i - level) = tau x area``. The
level is the only unknown. Grains that stand clear keep most of their drag, those between them lose
it. Where the drags do not reach the stress, as on a grain alone on a plane, nothing changes.

A patch is a stretch of the bed that stays. When one of its grains has gone, those that it hid are
exposed and take part in a new balance.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.bed.packing import Packing
from orchestrator.digits import SLACK
from orchestrator.physics.threshold import root
from orchestrator.types import FloatArray, IntArray

GRAINS = 10
"""Fewest exposed grains of a patch. From 3 to all 200 grains of a strip in one patch, its
thresholds at 5 to 20 % of the grains move by up to 12 %."""
RANGE, PLACES = (1e-2, 1e2), 81
"""Local friction velocities between which a level is known, over one of their middle; beyond them
it stays as it is there. Between two places the drags add up to the stress within 1e-4."""
Drag = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""Drag (N) at a local friction velocity (m/s) on grains of sizes (d) and gaps (m)."""


def patches(packing: Packing, length: float) -> tuple[IntArray, FloatArray]:
    """Number of each of n grains' patch along a bed, (n,), and area of each patch, d^2.

    A patch has at least a length (d), and `GRAINS` exposed grains; in one plane it is one d wide.
    """
    s = np.sort(packing.arc_length[packing.windward | packing.lee])
    # half of the way to the next grain belongs to each
    middle = (s[1:] + s[:-1]) / 2
    alone = len(s) < 2
    first, last = (
        (-np.inf, np.inf) if alone else (2 * s[0] - middle[0], 2 * s[-1] - middle[-1])
    )
    edges, starts = np.concatenate([[first], middle, [last]]), [0]
    for i in range(1, len(s)):
        begun = starts[-1]
        many = i - begun >= GRAINS and len(s) - i >= GRAINS
        # in a lattice a patch may be just that long
        behind, before = edges[i] - edges[begun], edges[-1] - edges[i]
        if many and min(behind, before) >= length - SLACK:
            starts.append(i)
    patch = np.searchsorted(edges[starts[1:]], packing.arc_length, side="right")
    return patch, np.diff(edges[[*starts, len(s)]]) * (packing.width or 1.0)


@dataclass(frozen=True)
class Shelter:
    """The level at which the flow begins on each patch of a bed.

    `levels`, m, shape (places, patches), are those at the local friction velocities `ustar`, m/s.
    """

    ustar: FloatArray
    levels: FloatArray

    @cached_property
    def _pieces(self) -> FloatArray:
        """Coefficients of the splines of ln u*, shape (4, places - 1, patches)."""
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(np.log(self.ustar), self.levels).c)

    def level(self, ustar: ArrayLike, patch: ArrayLike) -> FloatArray:
        """Level over the bed's own (m) at local friction velocities (m/s) on patches."""
        known = np.clip(ustar, self.ustar[0], self.ustar[-1])
        place = np.clip(np.searchsorted(self.ustar, known) - 1, 0, len(self.ustar) - 2)
        a, b, c, d = self._pieces[:, place, np.asarray(patch)]
        x = np.log(known / self.ustar[place])
        return np.asarray(((a * x + b) * x + c) * x + d)


def balanced(
    drag: Drag,
    patch: IntArray,
    sizes: FloatArray,
    gaps: FloatArray,
    areas: FloatArray,
    *,
    diameter: float,
    unit: float,
    density: float,
) -> Shelter:
    """Find the levels at which the drags on each patch add up to the stress on its area.

    Exposed grains, n, have the number of their `patch`, `sizes` (d) and `gaps` (m) from the bed's
    own level to their lowest points, shape (n,). `areas`, m2, are those of all patches, `diameter`
    is d, m, `unit` the middle of the local friction velocities, m/s, `density` the fluid's, kg/m3.
    """
    order = np.argsort(patch, kind="stable")
    sizes, gaps = sizes[order], gaps[order]
    known, starts, place = np.unique(
        patch[order], return_index=True, return_inverse=True
    )
    ustar = unit * np.geomspace(*RANGE, PLACES)[:, None]
    stress = density * ustar**2 * areas[known]

    def excess(level: FloatArray) -> FloatArray:
        """Of the root of the drags over that of the stress, which is almost straight."""
        forces = drag(ustar, sizes, gaps - level[:, place])
        return np.asarray(np.sqrt(np.add.reduceat(forces, starts, axis=1) / stress) - 1)

    levels = np.zeros((PLACES, len(areas)))
    if len(known):
        # at the top of its highest grain the flow misses a patch
        top = np.maximum.reduceat(gaps + sizes * diameter, starts)
        low, high = np.zeros_like(stress), np.broadcast_to(top, stress.shape)
        crowded = excess(low) > 0
        levels[:, known] = root(lambda at: np.where(crowded, excess(at), at), low, high)
    return Shelter(ustar[:, 0], levels)
