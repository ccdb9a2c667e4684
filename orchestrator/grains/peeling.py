"""Peeling: which grain rolls away at which flow, without dynamics, each one freeing the next.

A grain leaves when the resultant of flow and weight passes beyond its foremost contact: it then
rolls over that neighbour, and over whatever it meets on its way until it is displaced by the
marker. A grain whose way is blocked has to wait until the blocking one is gone, or for the flow
that lifts it over. The flow's forces stay as they were, as in the deck; rolling needs no friction.
With one grain on two neighbours this is the pivot of Eq. 1.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from orchestrator.grains.loading import ForceTable, Loading

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Place = tuple[float, float]

TOUCH = 1e-3
"""Two grains closer than this touch, of the mean of their diameters."""
REACH = 1.4
"""Only grains whose surfaces are this near can touch one on its way to the displacement criterion,
of its own diameter."""
MOST_STEPS = 8
"""Neighbours that a grain may roll over on its way; more would be a grain that is caught."""


class Disc(NamedTuple):
    """A grain in the plane."""

    x: float
    z: float
    radius: float

    @property
    def place(self) -> Place:
        """Its centre."""
        return self.x, self.z

    def seen(self, side: float) -> "Disc":
        """The grain as it is seen from the front, 1, or from behind, -1."""
        return Disc(self.x * side, self.z, self.radius)


def flows(
    centres: FloatArray,
    sizes: FloatArray,
    loading: Loading,
    tables: Sequence[ForceTable],
    *,
    along: FloatArray,
    marker: float,
    there: BoolArray | None = None,
) -> FloatArray:
    """The flow at which each grain leaves.

    Parameters
    ----------
    centres : ndarray, shape (n, 2)
        x and z of each grain, in one unit of length d.
    sizes : ndarray, shape (n,)
        Diameter of each grain, d.
    loading : Loading
        The forces; grains that carry one may leave.
    tables : sequence of ForceTable
        For each grain its force law over its own submerged weight.
    along : ndarray, shape (n, 2)
        Unit vectors along the bed, the way that the flow pushes the grain.
    marker : float
        Displacement along it that counts as motion, of the grain's own diameter.
    there : ndarray of bool, shape (n,), optional
        The grains that are there; by default all.

    Returns
    -------
    ndarray, shape (n,)
        Undisturbed friction velocity, m/s; infinite for grains that never leave.
    """
    grains = [Disc(*row) for row in np.column_stack([centres, sizes / 2]).tolist()]
    present = np.ones(len(centres), bool) if there is None else there.copy()
    near = dict(_neighbours(centres, sizes, present & (loading.ratio != 0)))
    ratio, tangents = loading.ratio.tolist(), loading.along.tolist()
    normals, ups = loading.outward.tolist(), along.tolist()
    left = np.full(len(centres), np.inf)

    next_flow = np.full(len(centres), np.inf)
    ways: dict[int, list[Disc]] = {}

    def sample(i: int) -> None:
        # a grain that is pushed upstream is seen from behind, where that is downstream
        side = math.copysign(1.0, ratio[i])
        others = {grains[k].seen(side): grains[k] for k in near[i] if present[k]}
        push = _Push(tables[i], ratio[i], tangents[i], normals[i]).seen(side)
        climb = _Climb(grains[i].seen(side), list(others), push, _seen(ups[i], side), marker)
        next_flow[i], way = climb.needed()
        ways[i] = [others[one] for one in way]

    for i in near:
        sample(i)
    reached = 0.0
    while np.isfinite(lowest := float(next_flow.min())):
        i = int(next_flow.argmin())
        # a grain that is freed late leaves at once
        reached = max(reached, lowest)
        left[i], next_flow[i], present[i] = reached, np.inf, False
        for k in near[i]:
            # whom it would not have rolled over was not on its way
            if k in near and present[k] and grains[i] in ways[k]:
                sample(k)
    return left


def pivots(
    centres: FloatArray,
    sizes: FloatArray,
    loading: Loading,
    tables: Sequence[ForceTable],
) -> FloatArray:
    """The flow at which each grain by itself begins to roll over its foremost contact.

    Arguments and result as in `flows`: nobody leaves before, nobody stands in the way.
    """
    grains = [Disc(*row) for row in np.column_stack([centres, sizes / 2]).tolist()]
    found = np.full(len(centres), np.inf)
    for i, near in _neighbours(centres, sizes, loading.ratio != 0):
        side = math.copysign(1.0, loading.ratio[i])
        push = _Push(tables[i], *(float(loading.ratio[i]), loading.along[i], loading.outward[i]))
        others = [grains[k].seen(side) for k in near]
        climb = _Climb(grains[i].seen(side), others, push.seen(side), loading.along[i], 0.0)
        found[i] = climb.first()
    return found


def pivot_angles_deg(centres: FloatArray, sizes: FloatArray, along: FloatArray) -> FloatArray:
    """Angle of each grain's foremost contact from the normal of the bed, shape (n,).

    NaN for a grain that touches none. Arguments as in `flows`.
    """
    grains = [Disc(*row) for row in np.column_stack([centres, sizes / 2]).tolist()]
    found = np.full(len(centres), np.nan)
    for i, near in _neighbours(centres, sizes, np.ones(len(centres), bool)):
        pivot = foremost(grains[i], [grains[k] for k in near])
        if pivot:
            slope = math.atan2(along[i, 1], along[i, 0])
            found[i] = math.degrees(_lean(grains[i].place, pivot.place) - slope)
    return found


def foremost(grain: Disc, others: Sequence[Disc]) -> Disc | None:
    """The contact of a grain that lies farthest round towards downstream, from below."""
    here = grain.place
    touching = (
        k for k in others if math.dist(k.place, here) < (1 + TOUCH) * (grain.radius + k.radius)
    )
    return max(touching, key=lambda k: _lean(here, k.place), default=None)


def _neighbours(
    centres: FloatArray, sizes: FloatArray, chosen: BoolArray
) -> Iterator[tuple[int, list[int]]]:
    """Some grains, each with those within its reach, in order of their numbers."""
    order = np.argsort(centres[:, 0], kind="stable")
    (x, z), own = centres[order].T, sizes[order]
    ranks = np.flatnonzero(chosen[order])
    far = REACH * own + (own + own.max()) / 2
    first, last = (np.searchsorted(x, x[ranks] + side * far[ranks]) for side in (-1, 1))
    for rank, a, b in zip(ranks.tolist(), first.tolist(), last.tolist(), strict=True):
        apart = np.hypot(x[a:b] - x[rank], z[a:b] - z[rank])
        near = apart < REACH * own[rank] + (own[a:b] + own[rank]) / 2
        near[rank - a] = False
        yield int(order[rank]), np.sort(order[a:b][near]).tolist()


@dataclass(frozen=True)
class _Push:
    """The flow's force on one grain."""

    table: ForceTable
    ratio: float
    tangent: Sequence[float]
    normal: Sequence[float]

    def seen(self, side: float) -> "_Push":
        """The force as it is seen from the front, 1, or from behind, -1."""
        # from behind, downstream along the bed is the other way
        back = [self.tangent[0], self.tangent[1] * side]
        return _Push(self.table, self.ratio * side, back, _seen(self.normal, side))

    def flow_to_reach(self, x: float, z: float, goal: float) -> float:
        """The flow at which the force over W along a direction reaches a goal."""
        drag_arm = (self.tangent[0] * x + self.tangent[1] * z) * math.copysign(1.0, self.ratio)
        lift_arm = self.normal[0] * x + self.normal[1] * z
        return self.table.reaching(drag_arm, lift_arm, goal) / abs(self.ratio)


@dataclass(frozen=True)
class _Climb:
    """The way of one grain over its neighbours; lengths in d, forces over its weight."""

    start: Disc
    others: Sequence[Disc]
    push: _Push
    along: Sequence[float]
    marker: float

    def first(self) -> float:
        """The least flow at which it begins to roll over its foremost contact; 0 without any."""
        pivot = self._foremost()
        return self._flow_to_leave(self.start.place, pivot) if pivot else 0.0

    def needed(self) -> tuple[float, list[Disc]]:
        """The least flow that takes it to the criterion, and the neighbours that it rolls over."""
        place, pivot = self.start.place, self._foremost()
        flow, way = 0.0, []
        while pivot is not None:
            way.append(pivot)
            if len(way) > MOST_STEPS:
                return math.inf, way
            flow = max(flow, self._flow_to_leave(place, pivot))
            met = self._next(place, pivot)
            if met is None or math.isinf(flow):
                break
            place, pivot = met
        return flow, way

    def _foremost(self) -> Disc | None:
        return foremost(self.start, self.others)

    def _reach(self, other: Disc) -> float:
        """Distance of the centres where the grain touches another."""
        return self.start.radius + other.radius

    def _flow_to_leave(self, place: Place, pivot: Disc) -> float:
        """The flow at which the resultant passes through the contact: no moment about it."""
        lean = _lean(place, pivot.place)
        return self.push.flow_to_reach(math.cos(lean), math.sin(lean), math.sin(lean))

    def _next(self, place: Place, pivot: Disc) -> tuple[Place, Disc] | None:
        """Where the grain, rolling over its pivot, meets another before the criterion; which."""
        turned = math.atan2(place[1] - pivot.z, place[0] - pivot.x)
        meetings = [m for m in self._meetings(pivot) if -1.0 < m[0] < turned - 1e-9]
        if not meetings:
            return None
        angle, met = max(meetings)
        arm = self._reach(pivot)
        at = (pivot.x + arm * math.cos(angle), pivot.z + arm * math.sin(angle))
        start = self.start.place
        travel = sum((a - b) * t for a, b, t in zip(at, start, self.along, strict=True))
        own = 2 * self.start.radius
        return (at, met) if travel < (self.marker - 1e-9) * own else None

    def _meetings(self, pivot: Disc) -> Iterator[tuple[float, Disc]]:
        """Direction from the pivot at which a grain on it would touch another, for each other."""
        arm = self._reach(pivot)
        for other in self.others:
            apart, touch = math.dist(other.place, pivot.place), self._reach(other)
            if abs(arm - touch) < apart < arm + touch:
                direction = math.atan2(other.z - pivot.z, other.x - pivot.x)
                cosine = (arm * arm + apart * apart - touch * touch) / (2 * arm * apart)
                angle = direction + math.acos(cosine)
                yield (angle if angle <= math.pi else angle - 2 * math.pi), other


def _seen(vector: Sequence[float], side: float) -> list[float]:
    return [vector[0] * side, vector[1]]


def _lean(place: Place, neighbour: Place) -> float:
    """Direction to a neighbour: 0 below, pi/2 level and downstream."""
    return math.atan2(neighbour[0] - place[0], place[1] - neighbour[1])
