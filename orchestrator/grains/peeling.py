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

import numpy as np
from numpy.typing import NDArray

from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.grains.loading import ForceTable, Loading
from orchestrator.study.closed_form import closed_form

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Place = tuple[float, float]

TOUCH = 1e-3
"""Two grains closer than this touch, d."""
REACH = 2.4
"""Only grains this near can touch one on its way to the displacement criterion, d."""
MOST_STEPS = 8
"""Neighbours that a grain may roll over on its way; more would be a grain that is caught."""


def of_bed(bed: LoadedBed, ratio: FloatArray) -> FloatArray:
    """Undisturbed friction velocity at which each windward grain leaves, m/s, shape (N,).

    Parameters
    ----------
    bed : LoadedBed
        The bed.
    ratio : ndarray, shape (n,)
        Local friction velocity over the undisturbed one, signed.
    """
    scene, loading = bed.scene, bed.loading(ratio)
    alone = float(closed_form(scene).friction_velocity)
    found = flows(
        bed.packing.centres,
        loading,
        ForceTable(loading.drag, loading.lift, scene.weight, alone),
        along=bed.tangents,
        marker=scene.protocol.displacement_criterion,
    )
    return np.asarray(found[bed.packing.windward])


def flows(
    centres: FloatArray,
    loading: Loading,
    table: ForceTable,
    *,
    along: FloatArray,
    marker: float,
) -> FloatArray:
    """The flow at which each grain leaves.

    Parameters
    ----------
    centres : ndarray, shape (n, 2)
        x and z of each grain, diameters.
    loading : Loading
        The forces; grains that carry one may leave.
    table : ForceTable
        Its force law over the submerged weight.
    along : ndarray, shape (n, 2)
        Unit vectors downstream along the bed.
    marker : float
        Displacement along it that counts as motion, diameters.

    Returns
    -------
    ndarray, shape (n,)
        Undisturbed friction velocity, m/s; infinite for grains that never leave.
    """
    places = [(x, z) for x, z in centres.tolist()]
    near = dict(_neighbours(centres, loading.ratio != 0))
    ratio, tangents = loading.ratio.tolist(), loading.along.tolist()
    normals, ups = loading.outward.tolist(), along.tolist()
    present = np.ones(len(centres), bool)
    left = np.full(len(centres), np.inf)

    next_flow = np.full(len(centres), np.inf)
    ways: dict[int, list[Place]] = {}

    def sample(i: int) -> None:
        others = [places[k] for k in near[i] if present[k]]
        push = _Push(table, ratio[i], tangents[i], normals[i])
        next_flow[i], ways[i] = _Climb(places[i], others, push, ups[i], marker).needed()

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
            if k in near and present[k] and places[i] in ways[k]:
                sample(k)
    return left


def _neighbours(centres: FloatArray, chosen: BoolArray) -> Iterator[tuple[int, list[int]]]:
    """Some grains, each with those within its reach, in order of their numbers."""
    order = np.argsort(centres[:, 0], kind="stable")
    x, z = centres[order].T
    ranks = np.flatnonzero(chosen[order])
    first, last = np.searchsorted(x, x[ranks] - REACH), np.searchsorted(x, x[ranks] + REACH)
    for rank, a, b in zip(ranks.tolist(), first.tolist(), last.tolist(), strict=True):
        near = np.hypot(x[a:b] - x[rank], z[a:b] - z[rank]) < REACH
        near[rank - a] = False
        yield int(order[rank]), np.sort(order[a:b][near]).tolist()


@dataclass(frozen=True)
class _Push:
    """The flow's force on one grain."""

    table: ForceTable
    ratio: float
    tangent: Sequence[float]
    normal: Sequence[float]

    def flow_to_reach(self, x: float, z: float, goal: float) -> float:
        """The flow at which the force over W along a direction reaches a goal."""
        drag_arm = (self.tangent[0] * x + self.tangent[1] * z) * math.copysign(1.0, self.ratio)
        lift_arm = self.normal[0] * x + self.normal[1] * z
        return self.table.reaching(drag_arm, lift_arm, goal) / abs(self.ratio)


@dataclass(frozen=True)
class _Climb:
    """The way of one grain over its neighbours; lengths in d, forces over W."""

    start: Place
    others: Sequence[Place]
    push: _Push
    along: Sequence[float]
    marker: float

    def needed(self) -> tuple[float, list[Place]]:
        """The least flow that takes it to the criterion, and the neighbours that it rolls over."""
        place, pivot = self.start, self._foremost()
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

    def _foremost(self) -> Place | None:
        """The contact that lies farthest round towards downstream, from below."""
        touching = (k for k in self.others if math.dist(k, self.start) < 1 + TOUCH)
        return max(touching, key=lambda k: _lean(self.start, k), default=None)

    def _flow_to_leave(self, place: Place, pivot: Place) -> float:
        """The flow at which the resultant passes through the contact: no moment about it."""
        lean = _lean(place, pivot)
        return self.push.flow_to_reach(math.cos(lean), math.sin(lean), math.sin(lean))

    def _next(self, place: Place, pivot: Place) -> tuple[Place, Place] | None:
        """Where the grain, rolling over its pivot, meets another before the criterion; which."""
        turned = math.atan2(place[1] - pivot[1], place[0] - pivot[0])
        meetings = [m for m in self._meetings(pivot) if -1.0 < m[0] < turned - 1e-9]
        if not meetings:
            return None
        angle, met = max(meetings)
        at = (pivot[0] + math.cos(angle), pivot[1] + math.sin(angle))
        travel = sum((a - b) * t for a, b, t in zip(at, self.start, self.along, strict=True))
        return (at, met) if travel < self.marker - 1e-9 else None

    def _meetings(self, pivot: Place) -> Iterator[tuple[float, Place]]:
        """Direction from the pivot at which a grain on it would touch another, for each other."""
        for other in self.others:
            apart = math.dist(other, pivot)
            if 0 < apart < 2:
                direction = math.atan2(other[1] - pivot[1], other[0] - pivot[0])
                angle = direction + math.acos(apart / 2)
                yield (angle if angle <= math.pi else angle - 2 * math.pi), other


def _lean(place: Place, neighbour: Place) -> float:
    """Direction to a neighbour: 0 below, pi/2 level and downstream."""
    return math.atan2(neighbour[0] - place[0], place[1] - neighbour[1])
