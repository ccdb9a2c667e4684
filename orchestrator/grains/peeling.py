"""Forces of the flow on grains, and thresholds by geometry, without dynamics: pivots, and peeling.

By a pivot a grain moves when the resultant of flow and weight passes beyond the contacts that it
rests on; each grain is taken by itself. In one plane this is the foremost contact (Eq. 1 for a
grain on two neighbours), in space a side of the pyramid of its contacts: the grain rolls over the
saddle between two of them.

Peeling goes on from there: a grain rolls over its foremost contact, and over whatever it meets on
its way until it is displaced by the criterion. A grain whose way is blocked has to wait until the
blocking one is gone, or for the flow that lifts it over. The flow's forces stay as they were, as in
the deck; rolling needs no friction.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator import digits
from orchestrator.bed.packing import TOUCH, Places
from orchestrator.types import BoolArray, FloatArray, IntArray

REACH = 1.4
"""Only grains whose surfaces are this near can touch one on its way to the displacement criterion,
of its own diameter."""
STEPS = 8
"""Neighbours that a grain may roll over on its way; more would be a grain that is caught."""
FLAT = 1e-9
"""Contacts whose directions are nearer than this to a plane through the centre lie in it."""
Place = tuple[float, float]
Force = Callable[[ArrayLike], FloatArray]
"""Size of a force (N) at local friction velocities (m/s) of at least 0."""
Renew = Callable[[int], "Mapping[int, ForceTable]"]
"""Tables of the grains whose forces change when a grain, by its number, has left."""

RANGE = 1e-4, 1e4
"""Local friction velocities of a table of forces, over that at which a grain goes by itself."""
PLACES, FEWER = 4001, 501
"""Places of a table. Fewer are within 1e-8 of the force law and take a tenth of the time."""


@dataclass(frozen=True)
class Loading:
    """Forces on n grains, by the force law of the scene: of n local friction velocities, or of one.

    `ratio`, shape (n,), is the local friction velocity over the undisturbed one; negative where the
    flow runs back, 0 for a grain that carries no force. `along` and `outward`, shape (n, 2), are
    the unit vectors downstream along the bed and out of it. Drag follows the flow's direction, lift
    is never negative.
    """

    drag: Force
    lift: Force
    ratio: FloatArray
    along: FloatArray
    outward: FloatArray

    def at(self, ustar0: ArrayLike) -> FloatArray:
        """Force on each grain (N) at undisturbed friction velocities (m/s), shape (..., n, 2)."""
        loaded = self.ratio != 0
        local = (
            np.where(loaded, np.abs(self.ratio), 1.0)
            * np.asarray(ustar0, float)[..., None]
        )
        drag, lift = self.drag(local) * np.sign(self.ratio), self.lift(local)
        force = drag[..., None] * self.along + lift[..., None] * self.outward
        return np.where(loaded[:, None], force, 0.0)


class ForceTable:
    """Drag and lift over the weight, tabulated so that thousands of grains ask in turn.

    Between its places each is a power of the friction velocity times a small correction, a cubic
    spline of the logarithms: with all places it reproduces the force laws within 1e-12.
    """

    def __init__(
        self, log_ustar: FloatArray, forces: FloatArray, pieces: FloatArray
    ) -> None:
        self._log_ustar, self._forces, self._pieces = log_ustar, forces, pieces
        self._reached: dict[tuple[float, float, float], float] = {}

    @classmethod
    def of(
        cls, drag: Force, lift: Force, weights: FloatArray, ustar: FloatArray
    ) -> "list[ForceTable]":
        """The tables of n grains; the weights (N) are of the shape (n,).

        Drag and lift are laws that take the friction velocities `ustar` (m/s) of the tables, shape
        (places,), for all grains, and give forces (N), shape (n, places), or alike for all.
        """
        shape = len(weights), len(ustar)
        each = (np.broadcast_to(law(ustar), shape) for law in (drag, lift))
        forces = np.stack(list(each), axis=1) / weights[:, None, None]
        # a law without lift has none anywhere
        logs = np.log(np.where(forces > 0, forces, 1e-300))
        from scipy.interpolate import CubicSpline

        pieces = CubicSpline(np.log(ustar), logs, axis=2).c.transpose(2, 1, 3, 0)
        given = zip(forces, np.ascontiguousarray(pieces), strict=True)
        return [cls(np.log(ustar), *values) for values in given]

    def reaching(self, drag_arm: float, lift_arm: float, goal: float) -> float:
        """The local friction velocity at which drag and lift times their arms reach a goal.

        In m/s; 0 where they always do, infinite where they never do.
        """
        asked = drag_arm, lift_arm, goal
        # a grain asks again when a neighbour has left
        if asked not in self._reached:
            self._reached[asked] = self._solved(*asked)
        return self._reached[asked]

    def _solved(self, drag_arm: float, lift_arm: float, goal: float) -> float:
        moment = drag_arm * self._forces[0] + lift_arm * self._forces[1]
        above = int((moment >= goal).argmax())
        if moment[above] < goal:
            return math.inf
        if above == 0:
            return 0.0
        start, end = self._log_ustar[above - 1 : above + 1].tolist()
        (a, b, c, d), (e, f, g, h) = self._pieces[above - 1].tolist()

        def excess(log_ustar: float) -> float:
            x = log_ustar - start
            drag = math.exp(((a * x + b) * x + c) * x + d)
            lift = math.exp(((e * x + f) * x + g) * x + h)
            return drag_arm * drag + lift_arm * lift - goal

        # round-off at the places themselves
        if excess(start) >= 0 or excess(end) <= 0:
            return math.exp(start if excess(start) >= 0 else end)
        from scipy.optimize import brentq

        return math.exp(brentq(excess, start, end, xtol=1e-15))


class Disc(NamedTuple):
    """A grain in the plane of the flow."""

    x: float
    z: float
    radius: float


@dataclass(frozen=True)
class _Roller:
    """A grain that the flow pushes towards +x, and its neighbours by their numbers; lengths in d.

    `along` and `outward` are the unit vectors of that way and out of the bed; `bond` is the pull of
    a contact between two grains of d over their weight.
    """

    start: Disc
    others: dict[int, Disc]
    ratio: float
    along: Sequence[float]
    outward: Sequence[float]
    bond: float = 0.0

    def flow_over(
        self, place: Place, pivot: Disc, numbers: Iterable[int], table: ForceTable
    ) -> float:
        """The flow (u*_0) at which the resultant passes through a contact: no moment about it."""
        lean = _lean(place, pivot[:2])
        x, z = math.cos(lean), math.sin(lean)
        drag_arm = self.along[0] * x + self.along[1] * z
        lift_arm = self.outward[0] * x + self.outward[1] * z
        goal = z + (self._held(place, lean, numbers) if self.bond else 0.0)
        return table.reaching(drag_arm, lift_arm, goal) / self.ratio

    def _held(self, place: Place, lean: float, numbers: Iterable[int]) -> float:
        """Moment over weight and radius with which contacts pull a grain back from its pivot."""
        size = 2 * self.start.radius
        moment = 0.0
        for other in (self.others[k] for k in numbers):
            if math.dist(other[:2], place) < (1 + TOUCH) * (
                self.start.radius + other.radius
            ):
                pull = self.bond * _pull(size, 2 * other.radius)
                moment += pull * math.sin(lean - _lean(place, other[:2]))
        return moment

    def way(
        self, numbers: Sequence[int], table: ForceTable, criterion: float
    ) -> tuple[float, list[int]]:
        """The least flow that takes it to the criterion, and the neighbours that it rolls over."""
        place, pivot = self.start[:2], _foremost(self.start, self.others, numbers)
        flow, rolled = 0.0, []
        while pivot is not None:
            rolled.append(pivot)
            if len(rolled) > STEPS:
                return math.inf, rolled
            flow = max(flow, self.flow_over(place, self.others[pivot], numbers, table))
            met = self._next(place, self.others[pivot], numbers)
            if met is None or math.isinf(flow):
                break
            place, pivot = met
            travel = sum(
                (a - b) * t
                for a, b, t in zip(place, self.start[:2], self.along, strict=True)
            )
            if travel >= (criterion - 1e-9) * 2 * self.start.radius:
                break
        return flow, rolled

    def _next(
        self, place: Place, pivot: Disc, numbers: Sequence[int]
    ) -> tuple[Place, int] | None:
        """Where the grain, rolling over its pivot, touches another neighbour, and which."""
        arm = self.start.radius + pivot.radius
        turned = math.atan2(place[1] - pivot.z, place[0] - pivot.x)
        nearest: tuple[float, int] | None = None
        for k in numbers:
            other = self.others[k]
            apart, touch = (
                math.dist(other[:2], pivot[:2]),
                self.start.radius + other.radius,
            )
            if not abs(arm - touch) < apart < arm + touch:
                continue
            cosine = (arm * arm + apart * apart - touch * touch) / (2 * arm * apart)
            angle = math.atan2(other.z - pivot.z, other.x - pivot.x) + math.acos(cosine)
            angle = angle if angle <= math.pi else angle - 2 * math.pi
            if -1.0 < angle < turned - 1e-9 and (nearest is None or angle > nearest[0]):
                nearest = angle, k
        if nearest is None:
            return None
        angle, k = nearest
        return (pivot.x + arm * math.cos(angle), pivot.z + arm * math.sin(angle)), k


def _pull(size: FloatArray | float, other: FloatArray | float) -> Any:
    """Pull of a contact over the weight of the grain of a size (d), for a bond of 1."""
    return 2 * other / (size + other) / size**2


def flows(
    places: Places,
    sizes: FloatArray,
    loading: Loading,
    tables: Mapping[int, ForceTable],
    criterion: float,
    present: BoolArray | None = None,
    bond: float = 0.0,
    renew: Renew | None = None,
) -> FloatArray:
    """The flow (u*_0, m/s) at which each of n grains in one plane leaves by peeling, shape (n,).

    It is infinite for grains that never leave. The places and the diameters, shape (n,), are in one
    unit of length; grains that have a table, by their numbers, may leave: it is that of their force
    law over their own submerged weight. The criterion is the displacement along the bed that counts
    as motion, of the grain's own diameter. `present`, shape (n,), has the grains that have not left
    yet; by default all. `bond` is the pull of a contact between two grains of d over their weight.
    `renew` gives the tables that change when a grain has left, also of others.
    """
    present = np.ones(len(sizes), bool) if present is None else present.copy()
    rollers, known = dict(_rollers(places, sizes, loading, present, bond)), dict(tables)
    left, next_flow = np.full(len(sizes), np.inf), np.full(len(sizes), np.inf)
    # of two grains that go at one flow no last digit says which is first
    turn = np.full(len(sizes), np.inf)
    ways: dict[int, list[int]] = {}

    def sample(i: int) -> None:
        numbers = [k for k in rollers[i].others if present[k]]
        next_flow[i], ways[i] = rollers[i].way(numbers, known[i], criterion)
        turn[i] = digits.rounded(next_flow[i])

    for i in rollers.keys() & known:
        sample(i)
    reached = 0.0
    asked = np.array(list(tables), int)
    while present[asked].any():
        i = int(turn.argmin())
        if math.isinf(turn[i]):
            break
        # a grain that is freed late leaves at once
        reached = max(reached, next_flow[i])
        left[i], turn[i], present[i] = reached, np.inf, False
        # only neighbours whose rolling path crossed grain i are affected by its departure, and
        # those that now bear another force
        affected = {k for k in rollers[i].others if i in ways.get(k, ())}
        if renew is not None:
            changed = renew(i)
            known |= changed
            affected |= changed.keys()
        for k in affected:
            if k in rollers and present[k]:
                sample(k)
    return left


def pivots(
    places: Places,
    sizes: FloatArray,
    loading: Loading,
    tables: Mapping[int, ForceTable],
    bond: float = 0.0,
) -> FloatArray:
    """The flow at which each grain by itself begins to roll; arguments and result as in `flows`.

    It is 0 for a grain that its contacts do not hold. The grains may lie in space.
    """
    least = np.full(len(sizes), np.inf)
    pushed = loading.ratio != 0
    if not places.width:
        for i, roller in _rollers(places, sizes, loading, pushed, bond):
            pivot = _foremost(roller.start, roller.others, roller.others)
            start, near = roller.start[:2], roller.others
            if pivot is None:
                least[i] = 0.0
            else:
                least[i] = roller.flow_over(start, near[pivot], near, tables[i])
        return least
    for i, sides, held in _pyramids(places, sizes, pushed):
        ratio = float(loading.ratio[i])
        drag = -np.sign(ratio) * _in_plane(sides, loading.along[i])
        lift = -_in_plane(sides, loading.outward[i])
        goal = bond * held - sides[:, 2]
        arms = zip(drag.tolist(), lift.tolist(), goal.tolist(), strict=True)
        least[i] = min(
            (tables[i].reaching(*arm) for arm in arms), default=np.inf
        ) / abs(ratio)
    return least


def pivot_angles_deg(
    places: Places, sizes: FloatArray, along: FloatArray, only: int | None = None
) -> FloatArray:
    """Angle from the bed's normal over which each grain has to roll downstream, shape (n,).

    In a plane that of its foremost contact, in space that to which the grain bears a force, as a
    board is tilted until it rolls; `along` has the unit vector downstream along the bed at each
    grain, shape (n, 2). NaN for a grain without contacts, or that no force along the bed moves.
    """
    angles, every = np.full(len(sizes), np.nan), np.ones(len(sizes), bool)
    if only is not None:
        every = np.arange(len(sizes)) == only
    if not places.width:
        discs = _discs(places, sizes, 1.0)
        for i, near in _neighbours(places, sizes, every):
            pivot = _foremost(discs[i], discs, near)
            if pivot is not None:
                slope = math.atan2(along[i, 1], along[i, 0])
                angles[i] = math.degrees(_lean(discs[i][:2], discs[pivot][:2]) - slope)
        return angles
    outward = np.column_stack([-along[:, 1], along[:, 0]])
    for i, sides, _ in _pyramids(places, sizes, every):
        forward, deep = _in_plane(sides, along[i]), -_in_plane(sides, outward[i])
        ahead = forward < 0
        if ahead.any():
            angles[i] = np.degrees(np.arctan2(deep[ahead], -forward[ahead]).min())
    return angles


def _rollers(
    places: Places, sizes: FloatArray, loading: Loading, chosen: BoolArray, bond: float
) -> Iterator[tuple[int, _Roller]]:
    """The chosen grains that carry a force, by their numbers."""
    ahead, behind = (_discs(places, sizes, side) for side in (1.0, -1.0))
    for i, near in _neighbours(places, sizes, chosen & (loading.ratio != 0)):
        ratio = float(loading.ratio[i])
        side, discs = math.copysign(1.0, ratio), ahead if ratio > 0 else behind
        # where the flow runs back, the plane is mirrored: upstream leads towards +x
        along = [float(loading.along[i, 0]), side * float(loading.along[i, 1])]
        outward = [side * float(loading.outward[i, 0]), float(loading.outward[i, 1])]
        others = {k: discs[k] for k in near}
        yield i, _Roller(discs[i], others, abs(ratio), along, outward, bond)


def _discs(places: Places, sizes: FloatArray, side: float) -> list[Disc]:
    """The grains in the plane, seen from the front, 1, or mirrored, -1."""
    rows = np.column_stack([side * places.xyz[:, 0], places.xyz[:, 2], sizes / 2])
    return [Disc(*row) for row in rows.tolist()]


def _neighbours(
    places: Places, sizes: FloatArray, chosen: BoolArray
) -> Iterator[tuple[int, list[int]]]:
    """The chosen grains, each with those within its reach, in order of their numbers."""
    first, second, apart = places.pairs((REACH + 1) * float(sizes.max()))
    reach = REACH * sizes[first] + (sizes[first] + sizes[second]) / 2
    near = np.linalg.norm(apart, axis=1) < reach
    first, second = first[near], second[near]
    for i, rows in _by_grain(first, second, chosen):
        yield i, second[rows].tolist()


def _by_grain(
    first: IntArray, second: IntArray, chosen: BoolArray
) -> Iterator[tuple[int, IntArray]]:
    """The chosen grains, each with the places of its pairs, in order of the other's number."""
    order = np.lexsort((second, first))
    ends = np.searchsorted(first[order], np.arange(len(chosen) + 1))
    for i in np.flatnonzero(chosen).tolist():
        yield i, order[ends[i] : ends[i + 1]]


def _foremost(
    grain: Disc, discs: dict[int, Disc] | list[Disc], numbers: Iterable[int]
) -> int | None:
    """The contact of a grain, of some others, that lies farthest round towards +x, from below."""
    touching = [
        k
        for k in numbers
        if math.dist(discs[k][:2], grain[:2])
        < (1 + TOUCH) * (grain.radius + discs[k].radius)
    ]
    return max(touching, key=lambda k: _lean(grain[:2], discs[k][:2]), default=None)


def _lean(place: Place, neighbour: Place) -> float:
    """Direction to a neighbour: 0 below, pi/2 level and towards +x."""
    return math.atan2(neighbour[0] - place[0], place[1] - neighbour[1])


def _pyramids(
    places: Places, sizes: FloatArray, chosen: BoolArray
) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """The chosen grains, each with the inward normals of the pyramid of its contacts, (k, 3).

    Beside them is what its contacts pull along each normal, over the weight for a bond of 1, (k,).
    """
    first, second, apart = places.contacts(sizes)
    directions = apart / np.linalg.norm(apart, axis=1)[:, None]
    for i, rows in _by_grain(first, second, chosen):
        touching, sides = directions[rows], []
        for a, b in combinations(range(len(touching)), 2):
            normal = np.cross(touching[a], touching[b])
            others = touching @ normal
            if (others > -FLAT).all() or (others < FLAT).all():
                sides.append(normal * (1 if others.sum() > 0 else -1))
        # a pyramid of fewer than three contacts contains no direction: its one side faces up
        normals = np.array(sides if len(touching) > 2 else [[0.0, 0.0, 1.0]]).reshape(
            -1, 3
        )
        pull = _pull(sizes[i], sizes[second[rows]])
        yield i, normals, normals @ (pull[:, None] * touching).sum(axis=0)


def _in_plane(sides: FloatArray, direction: FloatArray) -> FloatArray:
    """Part of each side's normal along a direction of the plane of the flow, shape (k,)."""
    return np.asarray(sides[:, 0] * direction[0] + sides[:, 2] * direction[1])
