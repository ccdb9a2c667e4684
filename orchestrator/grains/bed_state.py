"""The state of a bed that changes: where its grains are, and its bed line.

The bed line sinks by as much as the upper sides of the grains have.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator import digits
from orchestrator.bed import deck
from orchestrator.bed.line import BedLine
from orchestrator.bed.packing import Packing
from orchestrator.grains.geometry import Geometry
from orchestrator.types import BoolArray, FloatArray

GRAINS = "grains.csv"
"""The grains when a bed line was drawn, in the case of the flow over it; at the end of
a run of LIGGGHTS, in its case."""
EDGE = 2.0  # length over which the edge of a bared part is rounded, d
SPACING = 0.25  # spacing of the places at which the height of the grains is taken, d
NEAREST = 0.25
"""Least distance along x of a new corner from those of the bed line, d: corners that
nearly coincide make cells that are far too short."""
LEVEL = 1e-6  # a bed that is less above the flat bed lies on it, d
FAR = 1e9


@dataclass(frozen=True)
class BedState:
    """The n grains of a pile that wears, at one time.

    Attributes
    ----------
    places
        x and z of the centres, d, shape (n, 2); NaN for a grain that has gone.
    left
        Undisturbed friction velocity at which a counted grain has moved, m/s, shape
        (n,); infinite for all others.
    speed
        Signed local friction velocity over the undisturbed one, shape (n,), at that
        time or when the grain was last there.
    """

    places: FloatArray
    left: FloatArray
    speed: FloatArray

    @classmethod
    def whole(cls, packing: Packing) -> "BedState":
        """Make the grains as they were packed.

        Returns
        -------
        BedState
            The grains, none of which has left.
        """
        count = len(packing.centres)
        return cls(packing.centres, np.full(count, np.inf), np.zeros(count))

    @property
    def present(self) -> BoolArray:
        """Which grains have not gone, shape (n,)."""
        return ~np.isnan(self.places[:, 0])

    @property
    def moved(self) -> int:
        """How many counted grains have moved."""
        return int(np.isfinite(self.left).sum())

    def to_csv(self, directory: Path) -> None:
        """Write ``grains.csv``.

        Parameters
        ----------
        directory
            The directory of the case.
        """
        table = pd.DataFrame(self.places, columns=["x_d", "z_d"])
        table = table.assign(moved_at_m_s=self.left, ustar_over_ustar0=self.speed)
        table.index = pd.RangeIndex(1, len(table) + 1, name="id")
        table.to_csv(directory / GRAINS, float_format=digits.FORMAT)

    @classmethod
    def from_csv(cls, directory: Path) -> "BedState":
        """Read what `to_csv` wrote.

        Parameters
        ----------
        directory
            The directory of the case.

        Returns
        -------
        BedState
            The grains.
        """
        values = deck.read_table(directory / GRAINS).to_numpy(float)
        return cls(values[:, 1:3], values[:, 3], values[:, 4])


def sunk(geometry: Geometry, worn: BedState) -> BedLine:
    """Make the bed line over worn grains.

    It is lower by as much as their upper sides are on average.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    worn
        The grains.

    Returns
    -------
    BedLine
        The line, d.
    """
    line = geometry.line
    x = np.arange(line.x[1] - EDGE, line.x[-2] + EDGE - digits.SLACK, SPACING)
    depth = _depth(geometry, worn, x)
    finer = line.with_corners(_bends(line, x, depth).tolist())
    whole = np.array(finer.z)
    z = whole - np.interp(finer.x, x, depth, left=0.0, right=0.0)
    ground = min(line.z[0], line.z[-1])
    # a form wears down to the flat bed around it, unless counted grains lie as low
    low = np.maximum(line.z[1:], line.z[:-1]) <= ground + LEVEL
    low |= np.minimum(line.z[1:], line.z[:-1]) < ground - LEVEL
    if not (low & line.counted(geometry.counts)).any():
        z = np.maximum(z, np.minimum(whole, ground))
    inside = (np.array(finer.x) > line.x[1]) & (np.array(finer.x) < line.x[-2])
    return replace(finer, z=tuple(np.where(inside, z, whole).tolist()))


def _depth(geometry: Geometry, worn: BedState, x: FloatArray) -> FloatArray:
    """How much lower the upper sides of worn grains are at some places, d, averaged."""
    packed = geometry.packing
    present = worn.present
    before = _tops(packed.centres, packed.sizes / 2, x)
    after = _tops(worn.places[present], packed.sizes[present] / 2, x)
    window = np.ones(round(EDGE / SPACING)) * SPACING / EDGE
    return np.convolve(before - after, window, mode="same")


def _bends(line: BedLine, x: FloatArray, depth: FloatArray) -> FloatArray:
    """Places of new corners, one per diameter, where the depth at `x` changes, d."""
    step = round(EDGE / 2 / SPACING)
    is_steep = np.abs(np.gradient(depth)) > 1e-3
    changes = np.convolve(is_steep, np.ones(2 * step + 1), mode="same") > 0
    places = x[changes & (np.arange(len(x)) % step == 0)]
    apart = np.abs(places[:, None] - line.x).min(axis=1) > NEAREST + digits.SLACK
    return np.asarray(places[apart & (places > line.x[0]) & (places < line.x[-1])])


def _tops(centres: FloatArray, radii: FloatArray, x: FloatArray) -> FloatArray:
    """Height of the grains' upper sides at some places, d.

    It is far below where there are no grains.
    """
    tops = np.full(len(x), -FAR)
    for (xc, zc), radius in zip(centres.tolist(), radii.tolist(), strict=True):
        # as wide as half the way to the next: the gaps of a row do not count
        ends = np.array([xc - 2 * radius, xc + 2 * radius])
        first, last = np.searchsorted(x, ends - digits.SLACK)
        tops[first:last] = np.maximum(tops[first:last], zc + radius)
    return tops
