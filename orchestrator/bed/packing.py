"""The grains of a bed: where they lie, which of them are exposed, and which may move.

A lattice of equal spheres has rows in which the centres are ``2 d cos(beta)`` apart,
each row resting in the pockets of the one below, ``d sin(beta)`` lower. Lengths here
are in diameters d of the scene, with the toe of the first form at the origin; each
grain has a size of its own.
"""

from dataclasses import dataclass

import numpy as np

from orchestrator.bed.exposure import places_within
from orchestrator.bed.line import BedLine
from orchestrator.bed.places import Places
from orchestrator.study.declare import UnfitError
from orchestrator.study.parts import Packing as Pattern
from orchestrator.study.parts import Range
from orchestrator.types import BoolArray, FloatArray

APRON = 10.0
"""Length of the fixed flat bed beyond each toe, diameters."""
PERTURBATION = 1e-6
"""How far a replica's grains lie aside, diameters: it decides which grain of a chain
goes first. A deck has nine digits of each place."""
ELSEWHERE = 'choose another part of the bed, or "all"'
"""What to do where nothing is counted."""
SAMPLES = 2000
"""Places along a bed without grains, as many as a figure shows."""


@dataclass(frozen=True)
class Packing:
    """The grains of a pile, n of them, lengths in diameters; arrays of shape (n,).

    Attributes
    ----------
    centres
        X and z of each centre, shape (n, 2).
    sizes
        The diameters.
    mobile
        Which grains may move; the others are fixed.
    windward
        Which are exposed and counted, by default on windward sides.
    lee
        Which are exposed elsewhere.
    arc_length
        The position along the bed line, which means something for exposed grains.
    across
        Y of each centre; 0 in one plane.
    width
        Width of a strip with periodic sides; 0 in one plane.
    """

    centres: FloatArray
    sizes: FloatArray
    mobile: BoolArray
    windward: BoolArray
    lee: BoolArray
    arc_length: FloatArray
    across: FloatArray | float = 0.0
    width: float = 0.0

    @property
    def places(self) -> Places:
        """The centres in space."""
        return Places.of(self.centres, self.across, self.width)

    @property
    def count(self) -> int:
        """N(d): how many grains are counted."""
        return int(self.windward.sum())


@dataclass(frozen=True)
class Lattice:
    """How the grains of a bed that is not poured are laid; lengths in diameters.

    Attributes
    ----------
    entrainment_angle_deg
        Beta of the lattice, degrees.
    gap
        Height z0/d of the exposed grains' lowest points over the bed line.
    pattern
        Rows along the bed ("aligned"), level ("horizontal"), or along it with random
        gaps ("disordered").
    mobile_layers
        Layers that may move.
    disorder
        The largest random gap in the row below them.
    seed
        Chooses one disordered packing of many: on a lattice 0 is itself, others are its
        replicas.
    """

    entrainment_angle_deg: float
    gap: float
    pattern: Pattern
    mobile_layers: int
    disorder: float = 0.0
    seed: int = 0

    @property
    def beta(self) -> float:
        """Entrainment angle, rad."""
        return float(np.radians(self.entrainment_angle_deg))

    @property
    def uneven(self) -> bool:
        """Whether its rows have random gaps."""
        return self.pattern == "disordered"

    @property
    def layers(self) -> int:
        """Layers that hold mobile grains.

        Of horizontal rows under a slope a grain rests on one that lies deeper below the
        face.
        """
        return self.mobile_layers + (1 if self.pattern == "horizontal" else 0)

    def packed(
        self,
        line: BedLine,
        centres: FloatArray,
        mobile: BoolArray,
        windward: BoolArray,
        lee: BoolArray,
    ) -> Packing:
        """Make the packing of grains on a line; those of a replica lie a little aside.

        Parameters
        ----------
        line
            The bed line.
        centres
            X and z of the grains, shape (n, 2).
        mobile, windward, lee
            As in `Packing`.

        Returns
        -------
        Packing
            The packing.
        """
        aside = PERTURBATION if self.seed and not self.uneven else 0.0
        shift = np.random.default_rng(self.seed).uniform(-aside, aside, centres.shape)
        _, arc_length = line.nearest(centres)
        sizes = np.ones(len(centres))
        return Packing(centres + shift, sizes, mobile, windward, lee, arc_length)


def places_along(line: BedLine, counts: str | Range) -> Packing:
    """Lay places on a bed line: the middles of `SAMPLES` equal counted lengths.

    Parameters
    ----------
    line
        The bed line.
    counts
        Which part is counted, as `BedLine.counted` takes it.

    Returns
    -------
    Packing
        The places, none of them mobile.

    Raises
    ------
    UnfitError
        If no bed is counted.
    """
    ends = [] if isinstance(counts, str) else list(counts)
    for bare in line.bare:
        ends += bare
    finer = line.with_corners(ends)
    corners = np.array(finer.x)
    middle = (corners[1:] + corners[:-1]) / 2
    is_counted = line.counted(counts)[np.searchsorted(line.x, middle) - 1]
    is_counted &= places_within(middle, counts)
    for start, end in line.bare:
        is_counted &= (middle < start) | (middle > end)
    lengths = np.where(is_counted, finer.lengths, 0.0)
    sums = np.concatenate([[0.0], np.cumsum(lengths)])
    if not sums[-1]:
        raise UnfitError("bed.counted", "no bed is counted", ELSEWHERE)
    ways = (np.arange(SAMPLES) + 0.5) / SAMPLES * sums[-1]
    piece = np.searchsorted(sums, ways, side="right") - 1
    arc_length = finer.arc_lengths[piece] + ways - sums[piece]
    x = np.interp(arc_length, finer.arc_lengths, corners)
    none = np.zeros(SAMPLES, bool)
    return Packing(
        centres=np.column_stack([x, line.height(x)]),
        sizes=np.ones(SAMPLES),
        mobile=none,
        windward=~none,
        lee=none,
        arc_length=arc_length,
    )
