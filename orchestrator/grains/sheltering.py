"""Sheltering: the level at which the flow begins, so that the drags on a bed add up to its stress.

A force law gives the drag on a grain that stands alone. The drags on all exposed grains of a bed
would add up to several times the stress of the flow. So on each patch of the bed the level at which
the flow begins is raised until they do not: ``sum of drag_i(u*, gap_i - level) = tau x area``. The
level is the only unknown. Grains that stand clear keep most of their drag, those between them lose
it. Where the drags do not reach the stress, as on a grain alone on a plane, nothing changes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from orchestrator.bed.packing import Packing
from orchestrator.physics.threshold import root
from orchestrator.types import FloatArray, IntArray

GRAINS = 10
"""Fewest exposed grains of a patch. From 3 to all 200 grains of a strip in one patch, its
thresholds at 5 to 20 % of the grains move by up to 12 %."""
RANGE, PLACES = (1e-4, 1e4), 161
"""Local friction velocities between which a level is known, over one of their middle."""
Drag = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""Drag (N) at a local friction velocity (m/s) on grains of sizes (d) and gaps (m)."""


def patches(packing: Packing, length: float) -> tuple[IntArray, FloatArray]:
    """Divide the exposed grains of a bed into patches, one after another along it.

    Parameters
    ----------
    packing : Packing
        The bed, n grains.
    length : float
        Least length of a patch, d; it has at least `GRAINS` grains, too.

    Returns
    -------
    patch : ndarray, shape (n,)
        Number of each grain's patch; -1 of a grain that is not exposed.
    area : ndarray, shape (patches,)
        Area of bed that each patch has, d^2. In one plane the bed is one d wide.
    """
    exposed = np.flatnonzero(packing.windward | packing.lee)
    s = packing.arc_length[exposed]
    order = np.argsort(s, kind="stable")
    s, exposed = s[order], exposed[order]
    patch = np.full(len(packing.sizes), -1)
    # half of the way to the next grain belongs to each
    middle = (s[1:] + s[:-1]) / 2
    alone = len(s) < 2
    first, last = (-np.inf, np.inf) if alone else (2 * s[0] - middle[0], 2 * s[-1] - middle[-1])
    edges, starts = np.concatenate([[first], middle, [last]]), [0]
    for i in range(1, len(s)):
        begun = starts[-1]
        enough = i - begun >= GRAINS and edges[i] - edges[begun] >= length
        if enough and len(s) - i >= GRAINS and edges[-1] - edges[i] >= length:
            starts.append(i)
    for number, (begin, end) in enumerate(zip(starts, [*starts[1:], len(s)], strict=True)):
        patch[exposed[begin:end]] = number
    return patch, np.diff(edges[[*starts, len(s)]]) * (packing.width or 1.0)


class Level:
    """The level (m) over the bed's own at which the flow begins, of local u* (m/s): a table."""

    def __init__(self, ustar: FloatArray, level: FloatArray) -> None:
        self._spline = CubicSpline(np.log(ustar), level)

    def __call__(self, ustar: ArrayLike) -> FloatArray:
        """The level at some friction velocities, in their shape."""
        return np.asarray(self._spline(np.log(ustar)))


@dataclass(frozen=True)
class Shelter:
    """The level at which the flow begins on each patch of a bed with n grains.

    `patch`, shape (n,), has the number of each grain's patch in `levels`; -1 of a grain that is not
    exposed.
    """

    patch: IntArray
    levels: tuple[Level, ...]

    def of_grains(self, ustar: ArrayLike) -> FloatArray:
        """Level (m) for each grain at its own local friction velocity (m/s), shape (n,)."""
        local = np.broadcast_to(np.asarray(ustar, float), self.patch.shape)
        level = np.zeros(len(self.patch))
        for number, each in enumerate(self.levels):
            chosen = self.patch == number
            level[chosen] = each(local[chosen])
        return level


def balanced(
    drag: Drag,
    packing: Packing,
    gaps: FloatArray,
    diameter: float,
    *,
    length: float,
    unit: float,
    density: float,
) -> Shelter:
    """Find the levels at which the drags on each patch add up to the stress on its area.

    Parameters
    ----------
    drag : callable
        Drag (N) of a force law at local friction velocities (m/s), sizes (d) and gaps (m).
    packing : Packing
        The bed, n grains.
    gaps : ndarray, shape (n,)
        Height of each grain's lowest point over the bed's own level, m.
    diameter, length : float
        d, m; least length of a patch, d.
    unit, density : float
        Middle of the local friction velocities, m/s; fluid density, kg/m3.
    """
    patch, areas = patches(packing, length)
    ustar = unit * np.geomspace(*RANGE, PLACES)
    known: dict[tuple[bytes, ...], Level] = {}
    levels = []
    for number, area in enumerate(np.round(areas, 9)):
        chosen = patch == number
        sizes, heights = packing.sizes[chosen], gaps[chosen]
        key = sizes.tobytes(), heights.tobytes(), area.tobytes()
        if key not in known:
            height = _level(drag, sizes, heights, density * area * diameter**2, diameter, ustar)
            known[key] = Level(ustar, height)
        levels.append(known[key])
    return Shelter(patch, tuple(levels))


def _level(
    drag: Drag,
    sizes: FloatArray,
    gaps: FloatArray,
    mass: float,
    diameter: float,
    ustar: FloatArray,
) -> FloatArray:
    """The level (m) at each u* at which the drags are `mass` (density x area) x u*^2, or 0."""

    def excess(level: FloatArray, speed: FloatArray) -> FloatArray:
        forces = drag(speed[:, None], sizes, gaps - level[:, None])
        return np.asarray(forces.sum(axis=1) / (mass * speed**2) - 1)

    top = float((gaps + sizes * diameter).max())
    low, high = np.zeros_like(ustar), np.full_like(ustar, top)
    level = np.zeros_like(ustar)
    # an infinite area belongs to a grain alone
    crowded = np.flatnonzero(excess(low, ustar) > 0)
    if len(crowded):
        speeds = ustar[crowded]
        level[crowded] = root(lambda at: excess(at, speeds), low[crowded], high[crowded])
    return level
