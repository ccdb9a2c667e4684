"""Places of a dune: the beach before its toe, and foot, slope and brink by height."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator.grains.pile import Pile
from orchestrator.types import FloatArray

BEACH = 5.0
"""Length of the beach before the toe, in heights of the form."""
ENDS = {"foot": (0.0, 0.25), "slope": (0.25, 0.75), "brink": (0.75, 1.0 + 1e-9)}
"""Ends of the other places, in parts of the height of the windward side."""
PARTS = {"a tenth": 0.1, "half": 0.5}
"""Parts of a place whose flows are told."""
PLACES_IN_WORDS = (
    "beach: the ground before the toe, five heights long, taken level; foot, slope and "
    "brink: the windward side up to a quarter, to three quarters and to the top of its "
    "height"
)


@dataclass(frozen=True)
class DunePlace:
    """A place of a bed.

    Attributes
    ----------
    name
        Its name.
    ustar0
        Undisturbed friction velocities at which its parts move, m/s; infinite where no
        flow moves one.
    length
        Their lengths along the bed, m.
    """

    name: str
    ustar0: FloatArray
    length: FloatArray

    def at(self, part: float) -> float:
        """Find the friction velocity at which a part of the place moves.

        Parameters
        ----------
        part
            The part of its length.

        Returns
        -------
        float
            The undisturbed friction velocity, m/s; infinite where none is enough.

        Examples
        --------
        >>> foot = DunePlace("foot", np.array([0.3, 0.2]), np.array([1.0, 1.0]))
        >>> foot.at(0.1), foot.at(0.6)
        (0.2, 0.3)
        """
        order = np.argsort(self.ustar0)
        moved = np.cumsum(self.length[order]) / self.length.sum()
        return float(self.ustar0[order][np.searchsorted(moved, part * (1 - 1e-12))])


def places_of(
    pile: Pile, grains: pd.DataFrame, level: float, cases: Path
) -> list[DunePlace]:
    """Find the places of a bed.

    Parameters
    ----------
    pile
        The bed.
    grains
        Its rows of the table ``pile_grain``.
    level
        Threshold friction velocity of a grain on a level bed, m/s.
    cases
        The directory of the finished cases.

    Returns
    -------
    list of Place
        The places that have ground, or grains that are counted.
    """
    line = pile.model.line
    stress = pile.stress(cases)
    is_beach = (stress.s_m < 0) & (stress.s_m >= -BEACH * pile.bed.height)
    for each in pile.bed.obstacles:
        is_beach &= np.abs(stress.x_m - each.x) > each.reach
    with np.errstate(divide="ignore"):
        ustar0 = level / np.abs(stress.ustar_over_ustar0_wall[is_beach])
    found = [DunePlace("beach", ustar0, stress.length_m[is_beach])]
    s = grains["s_m"].to_numpy(float)
    z = np.interp(s, stress.s_m, stress.z_m)
    foot, crest = np.interp([0.0, line.crest_s], stress.s_m, stress.z_m)
    part = (z - foot) / (crest - foot)
    on_way = (s >= 0) & (s <= line.crest_s * (1 + 1e-9))
    flows = grains["ustar0_m_s"].fillna(np.inf).to_numpy(float)
    for name, (low, high) in ENDS.items():
        here = on_way & (part >= low) & (part < high)
        found.append(DunePlace(name, flows[here], _lengths(s)[here]))
    return [place for place in found if len(place.ustar0)]


def _lengths(s: FloatArray) -> FloatArray:
    """The length along the bed that stands for each grain."""
    order = np.argsort(s)
    lengths = np.empty_like(s)
    lengths[order] = np.gradient(s[order]) if len(s) > 1 else 1.0
    return lengths
