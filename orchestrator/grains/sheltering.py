"""Sheltering: the level at which the flow begins between the grains of a bed.

A force law gives the drag on a grain that stands alone. The drags on all exposed grains
of a bed would add up to several times the stress of the flow. On each patch of the bed
the level at which the flow begins is therefore raised until the drags add up to the
stress: ``sum of drag_i(u*, gap_i - level) = tau x area``. The level is the only
unknown. Grains that stand clear keep most of their drag; grains between them lose it.
Where the drags do not reach the stress, as on a single grain on a plane, the level is
that of the bed.

The patches of a bed do not change. When a grain of a patch has gone, the grains that it
hid are exposed, and a new balance is made with them.
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
"""Fewest exposed grains of a patch. From 3 to all 200 grains of a strip in one patch,
its thresholds at 5 to 20 % of the grains move by up to 12 %."""
RANGE = (1e-2, 1e2)
"""Local friction velocities between which a level is known, over one of their middle;
beyond them it stays as it is there."""
SPEEDS = 81
"""Local friction velocities at which it is found: between two of them the drags add up
to the stress within 1e-4."""
Drag = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""Drag (N) at a local friction velocity (m/s) on grains of sizes (d) and gaps (m)."""


def patches(packing: Packing, length: float) -> tuple[IntArray, FloatArray]:
    """Divide a bed into patches.

    Parameters
    ----------
    packing
        The grains of the bed, n.
    length
        Least length of a patch, d. It also has at least `GRAINS` exposed grains; in one
        plane it is one d wide.

    Returns
    -------
    patch
        Number of the patch of each grain; shape (n,).
    areas
        Area of each patch, d^2.
    """
    s = np.sort(packing.arc_length[packing.windward | packing.lee])
    # half of the way to the next grain belongs to each
    middle = (s[1:] + s[:-1]) / 2
    first = -np.inf
    last = np.inf
    if len(s) > 1:
        first = 2 * s[0] - middle[0]
        last = 2 * s[-1] - middle[-1]
    edges = np.concatenate([[first], middle, [last]])
    starts = [0]
    for i in range(1, len(s)):
        begun = starts[-1]
        has_grains = i - begun >= GRAINS and len(s) - i >= GRAINS
        shorter = min(edges[i] - edges[begun], edges[-1] - edges[i])
        # in a lattice a patch may be just that long
        if has_grains and shorter >= length - SLACK:
            starts.append(i)
    patch = np.searchsorted(edges[starts[1:]], packing.arc_length, side="right")
    lengths = np.diff(edges[[*starts, len(s)]])
    return patch, lengths * (packing.width or 1.0)


@dataclass(frozen=True)
class Shelter:
    """The level at which the flow begins on each patch of a bed.

    Attributes
    ----------
    ustar
        Local friction velocities, m/s; shape (speeds,).
    levels
        The levels there, m; shape (speeds, patches).
    """

    ustar: FloatArray
    levels: FloatArray

    @cached_property
    def _pieces(self) -> FloatArray:
        """Coefficients of the splines of ln u*, shape (4, speeds - 1, patches)."""
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(np.log(self.ustar), self.levels).c)

    def level(self, ustar: ArrayLike, patch: ArrayLike) -> FloatArray:
        """Level of the flow over the bed's own.

        Parameters
        ----------
        ustar
            Local friction velocities, m/s.
        patch
            Numbers of patches. The two broadcast.

        Returns
        -------
        FloatArray
            The levels, m.
        """
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
    """Find the levels at which the drags on each patch add up to its stress.

    Parameters
    ----------
    drag
        The drag on grains that stand alone.
    patch
        Number of the patch of each exposed grain; shape (n,).
    sizes
        Their sizes, d; shape (n,).
    gaps
        Heights of their lowest points over the bed's own level, m; shape (n,).
    areas
        Areas of all patches, m2.
    diameter
        The diameter d, m.
    unit
        The middle of the local friction velocities, m/s.
    density
        Density of the fluid, kg/m3.

    Returns
    -------
    Shelter
        The levels.
    """
    order = np.argsort(patch, kind="stable")
    sizes = sizes[order]
    gaps = gaps[order]
    known, starts, place = np.unique(
        patch[order], return_index=True, return_inverse=True
    )
    ustar = unit * np.geomspace(*RANGE, SPEEDS)[:, None]
    stress = density * ustar**2 * areas[known]

    def excess(level: FloatArray) -> FloatArray:
        """Root of the drags over that of the stress, less 1: almost straight."""
        forces = drag(ustar, sizes, gaps - level[:, place])
        return np.asarray(np.sqrt(np.add.reduceat(forces, starts, axis=1) / stress) - 1)

    levels = np.zeros((SPEEDS, len(areas)))
    if len(known):
        # at the top of its highest grain the flow misses a patch
        top = np.maximum.reduceat(gaps + sizes * diameter, starts)
        balanced = np.zeros_like(stress)
        # grains that are not crowded stay at the bed's own level
        row, column = np.nonzero(excess(balanced) > 0)

        def beyond(level: FloatArray, at: IntArray) -> FloatArray:
            """The excess of some crowded patches at some friction velocities."""
            every = np.zeros_like(stress)
            every[row[at], column[at]] = level
            return excess(every)[row[at], column[at]]

        balanced[row, column] = root(beyond, np.zeros(len(row)), top[column])
        levels[:, known] = balanced
    return Shelter(ustar[:, 0], levels)
