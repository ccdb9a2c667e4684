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

from orchestrator.grains.deck import POWERS

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Place = tuple[float, float]

TOUCH = 1e-3
"""Two grains closer than this touch, d."""
REACH = 2.4
"""Only grains this near can touch one on its way to the marker, d."""
MOST_STEPS = 8
"""Neighbours that a grain may roll over on its way; more would be a grain that is caught."""
LEAST, MOST = 1e-6, 1e4
"""Flows between which one is looked for."""
ITERATIONS = 200
CLOSE = 1e-14
"""Of a flow: this near to the root is the root."""


def flows(
    centres: FloatArray,
    pushed: BoolArray,
    force: FloatArray,
    *,
    weight: float,
    along: FloatArray,
    marker: float,
) -> FloatArray:
    """The flow at which each grain leaves.

    Parameters
    ----------
    centres : ndarray, shape (n, 2)
        x and z of each grain, diameters.
    pushed : ndarray of bool, shape (n,)
        Grains that carry a force and may leave.
    force : ndarray, shape (len(POWERS), n, 2)
        Vectors F_p: the force is sum_p F_p flow**p, N.
    weight : float
        Submerged weight of a grain, N.
    along : ndarray, shape (2,)
        Unit vector downstream along the bed.
    marker : float
        Displacement along it that counts as motion, diameters.

    Returns
    -------
    ndarray, shape (n,)
        Infinite for grains that never leave.
    """
    places = [(x, z) for x, z in centres.tolist()]
    near = dict(_neighbours(centres, pushed))
    vectors = (force / weight).transpose(1, 0, 2).tolist()
    up = (float(along[0]), float(along[1]))
    present = np.ones(len(centres), bool)
    left = np.full(len(centres), np.inf)

    next_flow = np.full(len(centres), np.inf)
    ways: dict[int, list[Place]] = {}

    def look(i: int) -> None:
        others = [places[k] for k in near[i] if present[k]]
        next_flow[i], ways[i] = _Climb(places[i], others, vectors[i], up, marker).needed()

    for i in near:
        look(i)
    reached = 0.0
    while np.isfinite(lowest := float(next_flow.min())):
        i = int(next_flow.argmin())
        # a grain that is freed late leaves at once
        reached = max(reached, lowest)
        left[i], next_flow[i], present[i] = reached, np.inf, False
        for k in near[i]:
            # whom it would not have rolled over was not on its way
            if k in near and present[k] and places[i] in ways[k]:
                look(k)
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
class _Climb:
    """The way of one grain over its neighbours; lengths in d, forces over W."""

    start: Place
    others: Sequence[Place]
    vectors: Sequence[Sequence[float]]
    along: Place
    marker: float

    def needed(self) -> tuple[float, list[Place]]:
        """The least flow that takes it to the marker, and the neighbours that it rolls over."""
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
        x, z = math.cos(lean), math.sin(lean)
        return _root([vector[0] * x + vector[1] * z for vector in self.vectors], z)

    def _next(self, place: Place, pivot: Place) -> tuple[Place, Place] | None:
        """Where the grain, rolling over its pivot, meets another before the marker, and which."""
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


def _root(coefficients: Sequence[float], goal: float) -> float:
    """The flow at which sum_p c_p flow**p reaches a goal; 0 or infinite if always or never."""
    terms = [(c, p) for c, p in zip(coefficients, POWERS, strict=True) if c != 0]

    def excess(flow: float) -> tuple[float, float]:
        """Above the goal, and its slope in the logarithm of the flow."""
        value = slope = 0.0
        for c, p in terms:
            raised = math.pow(flow, p)
            value += c * raised
            slope += c * p * raised
        return value - goal, slope

    low, high = LEAST, MOST
    if excess(low)[0] >= 0:
        return 0.0
    if excess(high)[0] < 0:
        return math.inf
    flow = min(max(math.sqrt(abs(goal) / sum(abs(c) for c, _ in terms)), low), high)
    for _ in range(ITERATIONS):
        value, slope = excess(flow)
        low, high = (flow, high) if value < 0 else (low, flow)
        # Newton in the logarithm of the flow; where it leaves what encloses the root, halving
        step = value / slope if slope > 0 else math.inf
        guess = flow * math.exp(-step) if abs(step) < 20 else 0.0
        if abs(step) < CLOSE:
            return guess
        flow = guess if low < guess < high else math.sqrt(low * high)
    return flow
