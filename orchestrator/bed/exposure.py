"""Which grains of a bed others hide, touch or bear.

Lengths are in diameters d of the scene.
"""

import numpy as np

from orchestrator.bed.places import TOUCH, Places, tree
from orchestrator.study.parts import Range
from orchestrator.types import BoolArray, FloatArray, IntArray

TIE = 1e-6
"""Neighbours of a lattice lie exactly on the limits below; round-off must not decide,
diameters."""
STRAY = 0.1
"""Rows of a disordered bed are straight within this, diameters."""
LOWER = 0.1
"""A neighbour bears a grain that stands so much over it, diameters."""
HIDES = 4.0
"""Farthest distance at which a grain hides another one of a lattice, diameters."""


def exposed(centres: FloatArray, tangents: FloatArray, slack: float = 0.0) -> BoolArray:
    """Find the equal grains that no other hides.

    A grain is hidden by another one that is higher along its own normal, within d/2 of
    it.

    Parameters
    ----------
    centres
        X and z of the grains, d, shape (n, 2).
    tangents
        The bed's direction under each, shape (n, 2).
    slack
        A slit between two grains that is narrower does not expose the one under it; on
        such a bed a neighbour that stands out by less than `STRAY` hides none.

    Returns
    -------
    BoolArray
        Which grains, shape (n,).
    """
    # through a gap in the row above, a grain of the row above that may hide one
    first, _, apart = Places.of(centres).pairs(HIDES)
    x = apart[:, 0]
    z = apart[:, 2]
    tx, tz = tangents[first].T
    hidden = np.abs(x * tx + z * tz) <= 0.5 + slack + TIE
    hidden &= z * tx - x * tz > (STRAY if slack else TIE)
    return np.asarray(np.bincount(first[hidden], minlength=len(centres)) == 0)


def shadows(
    along: Places, height: FloatArray, radii: FloatArray
) -> tuple[IntArray, IntArray]:
    """Find the grains of any sizes that others hide.

    A grain is hidden where the line through its centre, normal to the bed, meets
    another grain whose centre lies higher.

    Parameters
    ----------
    along
        The place of each along the bed and across the flow; the third coordinate is 0.
    height
        Their heights over the bed line, shape (n,).
    radii
        Their radii, shape (n,).

    Returns
    -------
    hidden, hides
        Pairs of a grain and of one that hides it, shape (k,).
    """
    first, second, apart = along.pairs(float(radii.max()) + TIE)
    hidden = np.linalg.norm(apart, axis=1) <= radii[second] + TIE
    hidden &= height[second] > height[first] + TIE
    return first[hidden], second[hidden]


def unshadowed(along: Places, height: FloatArray, radii: FloatArray) -> BoolArray:
    """Find the grains of any sizes that no other hides.

    Parameters
    ----------
    along, height, radii
        As in `shadows`.

    Returns
    -------
    BoolArray
        Which grains, shape (n,).
    """
    hidden, _ = shadows(along, height, radii)
    return np.asarray(np.bincount(hidden, minlength=len(height)) == 0)


def rests(centres: FloatArray) -> BoolArray:
    """Find the grains that touch one upstream and one downstream.

    None of the two is higher, and one of them is lower.

    Parameters
    ----------
    centres
        X and z of equal grains, d, shape (n, 2).

    Returns
    -------
    BoolArray
        Which grains, shape (n,).
    """
    first, _, apart = Places.of(centres).pairs(1 + TOUCH)
    x = apart[:, 0]
    z = apart[:, 2]
    rests = np.ones(len(centres), bool)
    for is_beside in (x <= 0, x > 0, z < -LOWER):
        has_one = np.zeros(len(centres), bool)
        has_one[first[(z <= TOUCH) & is_beside]] = True
        rests &= has_one
    return rests


def touching(centres: FloatArray, chosen: BoolArray) -> BoolArray:
    """Find the grains that touch one of the chosen ones, or are one.

    Parameters
    ----------
    centres
        X and z of equal grains, d, shape (n, 2).
    chosen
        The chosen ones, shape (n,).

    Returns
    -------
    BoolArray
        Which grains, shape (n,).
    """
    distance, _ = tree(centres[chosen]).query(centres)
    return np.asarray(distance < 1 + TOUCH)


def places_within(x: FloatArray, counts: str | Range) -> BoolArray:
    """Find the places that a range contains.

    Parameters
    ----------
    x
        Places along x.
    counts
        The range; words contain all.

    Returns
    -------
    BoolArray
        Which places.
    """
    if isinstance(counts, str):
        return np.ones(len(x), bool)
    start, end = counts
    return np.asarray((x >= start - TIE) & (x <= end + TIE))
