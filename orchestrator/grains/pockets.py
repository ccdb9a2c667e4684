"""Pockets in space: the flow at which a grain begins to roll out between those that it lies on.

A grain at rest on its contacts can bear a force that points into the pyramid of their directions.
Where the resultant of flow and weight leaves it through a side, the grain rolls over the saddle
between the two contacts of that side. In a plane this is the pivot of Eq. 1. Nobody leaves before,
and nobody stands in the way.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed.places import Places
from orchestrator.bed.poured import contacts
from orchestrator.grains.loading import ForceTable, Loading

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

FLAT = 1e-9
"""Contacts whose directions are nearer than this to a plane through the centre lie in it."""


def pivots(
    places: Places, sizes: FloatArray, loading: Loading, tables: Sequence[ForceTable]
) -> FloatArray:
    """The flow at which each grain by itself begins to roll out of its pocket.

    Parameters
    ----------
    places : Places
        Places of n grains, in one unit of length d.
    sizes : ndarray, shape (n,)
        Diameter of each grain, d.
    loading : Loading
        The forces; grains that carry one may leave.
    tables : sequence of ForceTable
        For each grain its force law over its own submerged weight.

    Returns
    -------
    ndarray, shape (n,)
        Undisturbed friction velocity, m/s; 0 of a grain that its contacts do not hold, infinite of
        one that they do not let go.
    """
    found = np.full(len(sizes), np.inf)
    for i, sides in _sides(places, sizes, loading.ratio != 0):
        ratio = float(loading.ratio[i])
        drag = -np.sign(ratio) * _in_plane(sides, loading.along[i])
        lift = -_in_plane(sides, loading.outward[i])
        flows = [tables[i].reaching(*arms) for arms in zip(drag, lift, -sides[:, 2], strict=True)]
        found[i] = min(flows, default=np.inf) / abs(ratio)
    return found


def pivot_angles_deg(places: Places, sizes: FloatArray, along: FloatArray) -> FloatArray:
    """Angle from the bed's normal to which each grain bears a force downstream, shape (n,).

    As a board is tilted until the grain rolls. NaN for a grain that no force along the bed moves.
    """
    found = np.full(len(sizes), np.nan)
    outward = np.column_stack([-along[:, 1], along[:, 0]])
    for i, sides in _sides(places, sizes, np.ones(len(sizes), bool)):
        forward, deep = _in_plane(sides, along[i]), -_in_plane(sides, outward[i])
        ahead = forward < 0
        if ahead.any():
            found[i] = np.degrees(np.arctan2(deep[ahead], -forward[ahead]).min())
    return found


def _sides(
    places: Places, sizes: FloatArray, chosen: BoolArray
) -> Iterator[tuple[int, FloatArray]]:
    """Some grains, each with the inward normals of the pyramid of its contacts, shape (k, 3)."""
    pairs = contacts(places, sizes)
    pairs = np.vstack([pairs, pairs[:, ::-1]])
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    apart = places.apart(*pairs.T)
    directions = apart / np.linalg.norm(apart, axis=1)[:, None]
    ends = np.searchsorted(pairs[:, 0], np.arange(len(sizes) + 1))
    for i in np.flatnonzero(chosen).tolist():
        yield i, _pyramid(directions[ends[i] : ends[i + 1]])


def _pyramid(directions: FloatArray) -> FloatArray:
    """Inward normals of the sides of a pyramid that some directions span, shape (k, 3).

    With fewer than three directions it holds nothing: its one side faces up.
    """
    if len(directions) < 3:
        return np.array([[0.0, 0.0, 1.0]])
    found = []
    for first, second in combinations(range(len(directions)), 2):
        normal = np.cross(directions[first], directions[second])
        others = directions @ normal
        if (others > -FLAT).all() or (others < FLAT).all():
            found.append(normal * (1 if others.sum() > 0 else -1))
    return np.array(found).reshape(-1, 3)


def _in_plane(sides: FloatArray, direction: FloatArray) -> FloatArray:
    """Part of each side's normal along a direction of the plane of the flow, shape (k,)."""
    return np.asarray(sides[:, 0] * direction[0] + sides[:, 2] * direction[1])
