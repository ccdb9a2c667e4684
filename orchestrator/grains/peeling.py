"""Forces of the flow on grains, and thresholds by geometry, without dynamics.

By a pivot a grain moves when the resultant of flow and weight passes beyond the
contacts that it rests on; each grain is taken by itself. In one plane this is the
foremost contact (Eq. 1 for a grain on two neighbours), in space a side of the pyramid
of its contacts: the grain rolls over the saddle between two of them.

Peeling goes on from there: a grain rolls over its foremost contact, and over whatever
it meets on its way until it is displaced by the criterion. A grain whose way is blocked
has to wait until the blocking one is gone, or for the flow that lifts it over. The
flow's forces stay as they were, as in the deck; rolling needs no friction.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator import digits
from orchestrator.bed.places import TOUCH, Places
from orchestrator.types import BoolArray, FloatArray, IntArray

REACH = 1.4
"""Only grains whose surfaces are this near can touch one on its way to the displacement
criterion, of its own diameter."""
STEPS = 8
"""Neighbours that a grain may roll over on its way; more would be a grain that is
caught."""
FLAT = 1e-9
"""Contacts whose directions are nearer than this to a plane through the centre lie in
it."""
RANGE = (1e-4, 1e4)
"""Local friction velocities of a table of forces, over that at which a grain goes by
itself."""
FINE_TABLE = 4001
"""Places of a table of forces."""
COARSE_TABLE = 501
"""Fewer places are within 1e-8 of the force law and take a tenth of the time."""
Place = tuple[float, float]
Force = Callable[[ArrayLike], FloatArray]
"""Size of a force (N) at local friction velocities (m/s) of at least 0."""
Renew = Callable[[int], "Mapping[int, ForceTable]"]
"""Tables of the grains whose forces change when a grain, by its number, has left."""


@dataclass(frozen=True)
class Loading:
    """Forces on n grains, by the force law of the scene.

    Drag follows the flow's direction, lift is never negative.

    Attributes
    ----------
    drag, lift
        Laws of n local friction velocities, or of one.
    ratio
        Local friction velocity over the undisturbed one, shape (n,); negative where the
        flow runs back, 0 for a grain that carries no force.
    along, outward
        Unit vectors downstream along the bed and out of it, shape (n, 2).
    """

    drag: Force
    lift: Force
    ratio: FloatArray
    along: FloatArray
    outward: FloatArray

    def at(self, ustar0: ArrayLike) -> FloatArray:
        """Find the force on each grain.

        Parameters
        ----------
        ustar0
            Undisturbed friction velocities, m/s, of any shape.

        Returns
        -------
        FloatArray
            Forces, N, shape (..., n, 2).
        """
        is_loaded = self.ratio != 0
        size = np.where(is_loaded, np.abs(self.ratio), 1.0)
        local = size * np.asarray(ustar0, float)[..., None]
        drag = self.drag(local) * np.sign(self.ratio)
        lift = self.lift(local)
        force = drag[..., None] * self.along + lift[..., None] * self.outward
        return np.where(is_loaded[:, None], force, 0.0)


class ForceTable:
    """Drag and lift over the weight, tabulated so that thousands of grains ask in turn.

    Between its places each is a power of the friction velocity times a small
    correction, a cubic spline of the logarithms: with all places it reproduces the
    force laws within 1e-12.

    Parameters
    ----------
    log_ustar
        Logarithms of the friction velocities, shape (places,).
    forces
        Drag and lift over the weight, shape (2, places).
    pieces
        Coefficients of the splines, shape (places - 1, 2, 4).
    """

    def __init__(
        self, log_ustar: FloatArray, forces: FloatArray, pieces: FloatArray
    ) -> None:
        self._log_ustar = log_ustar
        self._forces = forces
        self._pieces = pieces
        self._reached: dict[tuple[float, float, float], float] = {}

    @classmethod
    def of(
        cls, drag: Force, lift: Force, weights: FloatArray, ustar: FloatArray
    ) -> "list[ForceTable]":
        """Make the tables of n grains.

        Parameters
        ----------
        drag, lift
            Laws that take the friction velocities of the tables for all grains, and
            give forces, N, shape (n, places), or alike for all.
        weights
            Weights of the grains, N, shape (n,).
        ustar
            Friction velocities of the tables, m/s, shape (places,).

        Returns
        -------
        list of ForceTable
            The tables.
        """
        shape = (len(weights), len(ustar))
        drags = np.broadcast_to(drag(ustar), shape)
        lifts = np.broadcast_to(lift(ustar), shape)
        forces = np.stack([drags, lifts], axis=1) / weights[:, None, None]
        # a law without lift has none anywhere
        logs = np.log(np.where(forces > 0, forces, 1e-300))
        from scipy.interpolate import CubicSpline

        log_ustar = np.log(ustar)
        pieces = CubicSpline(log_ustar, logs, axis=2).c.transpose(2, 1, 3, 0)
        each = zip(forces, np.ascontiguousarray(pieces), strict=True)
        return [cls(log_ustar, *of_grain) for of_grain in each]

    def reaching(self, drag_arm: float, lift_arm: float, goal: float) -> float:
        """Find the flow at which drag and lift times their arms reach a goal.

        Parameters
        ----------
        drag_arm, lift_arm
            The arms.
        goal
            The moment over the weight.

        Returns
        -------
        float
            The local friction velocity, m/s; 0 where they always do, infinite where
            they never do.
        """
        asked = (drag_arm, lift_arm, goal)
        # a grain asks again when a neighbour has left
        if asked not in self._reached:
            self._reached[asked] = self._solved(*asked)
        return self._reached[asked]

    def _solved(self, drag_arm: float, lift_arm: float, goal: float) -> float:
        """The same, computed."""
        moment = drag_arm * self._forces[0] + lift_arm * self._forces[1]
        above = int((moment >= goal).argmax())
        if moment[above] < goal:
            return math.inf
        if above == 0:
            return 0.0
        start, end = self._log_ustar[above - 1 : above + 1].tolist()
        (a, b, c, d), (e, f, g, h) = self._pieces[above - 1].tolist()

        def excess(log_ustar: float) -> float:
            """Moment over the goal."""
            x = log_ustar - start
            drag = math.exp(((a * x + b) * x + c) * x + d)
            lift = math.exp(((e * x + f) * x + g) * x + h)
            return drag_arm * drag + lift_arm * lift - goal

        # round-off at the places themselves
        if excess(start) >= 0:
            return math.exp(start)
        if excess(end) <= 0:
            return math.exp(end)
        from scipy.optimize import brentq

        return math.exp(brentq(excess, start, end, xtol=1e-15))


class Disc(NamedTuple):
    """A grain in the plane of the flow.

    Attributes
    ----------
    x, z
        Its centre, d.
    radius
        Its radius, d.
    """

    x: float
    z: float
    radius: float


@dataclass(frozen=True)
class _Roller:
    """A grain that the flow pushes towards +x, and its neighbours by their numbers.

    Lengths are in d. `along` and `outward` are the unit vectors of that way and out of
    the bed; `bond` is the pull of a contact between two grains of d over their weight.
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
        """The flow (u*_0) at which the resultant has no moment about a contact."""
        lean = _lean(place, pivot[:2])
        x = math.cos(lean)
        z = math.sin(lean)
        drag_arm = self.along[0] * x + self.along[1] * z
        lift_arm = self.outward[0] * x + self.outward[1] * z
        goal = z
        if self.bond:
            goal += self._held(place, lean, numbers)
        return table.reaching(drag_arm, lift_arm, goal) / self.ratio

    def _held(self, place: Place, lean: float, numbers: Iterable[int]) -> float:
        """Moment over weight and radius with which contacts pull a grain back."""
        size = 2 * self.start.radius
        moment = 0.0
        for number in numbers:
            other = self.others[number]
            touch = self.start.radius + other.radius
            if math.dist(other[:2], place) < (1 + TOUCH) * touch:
                pull = self.bond * _pull(size, 2 * other.radius)
                moment += pull * math.sin(lean - _lean(place, other[:2]))
        return moment

    def way(
        self, numbers: Sequence[int], table: ForceTable, criterion: float
    ) -> tuple[float, list[int]]:
        """The least flow that takes it to the criterion, and what it rolls over."""
        place = self.start[:2]
        pivot = _foremost(self.start, self.others, numbers)
        flow = 0.0
        rolled: list[int] = []
        while pivot is not None:
            rolled.append(pivot)
            if len(rolled) > STEPS:
                return math.inf, rolled
            flow = max(flow, self.flow_over(place, self.others[pivot], numbers, table))
            met = self._next(place, self.others[pivot], numbers)
            if met is None or math.isinf(flow):
                break
            place, pivot = met
            x, z = place
            forward = (x - self.start.x) * self.along[0]
            travel = forward + (z - self.start.z) * self.along[1]
            if travel >= (criterion - 1e-9) * 2 * self.start.radius:
                break
        return flow, rolled

    def _next(
        self, place: Place, pivot: Disc, numbers: Sequence[int]
    ) -> tuple[Place, int] | None:
        """Where the grain, rolling over its pivot, touches another, and which."""
        arm = self.start.radius + pivot.radius
        turned = math.atan2(place[1] - pivot.z, place[0] - pivot.x)
        nearest = -1.0
        met: int | None = None
        for number in numbers:
            other = self.others[number]
            apart = math.dist(other[:2], pivot[:2])
            touch = self.start.radius + other.radius
            if not abs(arm - touch) < apart < arm + touch:
                continue
            cosine = (arm * arm + apart * apart - touch * touch) / (2 * arm * apart)
            angle = math.atan2(other.z - pivot.z, other.x - pivot.x) + math.acos(cosine)
            if angle > math.pi:
                angle -= 2 * math.pi
            if nearest < angle < turned - 1e-9:
                nearest = angle
                met = number
        if met is None:
            return None
        x = pivot.x + arm * math.cos(nearest)
        z = pivot.z + arm * math.sin(nearest)
        return (x, z), met


def _pull(size: FloatArray | float, other: FloatArray | float) -> Any:
    """Pull of a contact over the weight of the grain of a size (d), for a bond of 1."""
    return 2 * other / (size + other) / size**2


def leaving(
    places: Places,
    sizes: FloatArray,
    loading: Loading,
    tables: Mapping[int, ForceTable],
    criterion: float,
    present: BoolArray | None = None,
    bond: float = 0.0,
    renew: Renew | None = None,
) -> FloatArray:
    """Find the flow at which each of n grains in one plane leaves by peeling.

    Parameters
    ----------
    places
        Centres of the grains, in any unit of length.
    sizes
        Diameters in that unit, shape (n,).
    loading
        Forces on the grains.
    tables
        Grains that may leave, by their numbers: their force law over their own
        submerged weight.
    criterion
        Displacement along the bed that counts as motion, of the grain's own diameter.
    present
        Which grains have not left yet, shape (n,); by default all.
    bond
        Pull of a contact between two grains of d over their weight.
    renew
        Gives the tables that change when a grain has left, also of others.

    Returns
    -------
    FloatArray
        Undisturbed friction velocities, m/s, shape (n,); infinite for grains that never
        leave.
    """
    present = np.ones(len(sizes), bool) if present is None else present.copy()
    rollers = dict(_rollers(places, sizes, loading, present, bond))
    known = dict(tables)
    left = np.full(len(sizes), np.inf)
    next_flow = np.full(len(sizes), np.inf)
    # of two grains that go at one flow no last digit says which is first
    turn = np.full(len(sizes), np.inf)
    ways: dict[int, list[int]] = {}

    def sample(grain: int) -> None:
        """Find the way of a grain among those that are left."""
        roller = rollers[grain]
        numbers = [other for other in roller.others if present[other]]
        next_flow[grain], ways[grain] = roller.way(numbers, known[grain], criterion)
        turn[grain] = digits.rounded(next_flow[grain])

    for grain in rollers.keys() & known:
        sample(grain)
    reached = 0.0
    asked = np.array(list(tables), int)
    while present[asked].any():
        grain = int(turn.argmin())
        if math.isinf(turn[grain]):
            break
        # a grain that is freed late leaves at once
        reached = max(reached, next_flow[grain])
        left[grain] = reached
        turn[grain] = np.inf
        present[grain] = False
        # only neighbours whose rolling path crossed the grain are affected by its
        # departure, and those that now bear another force
        affected = {k for k in rollers[grain].others if grain in ways.get(k, ())}
        if renew is not None:
            changed = renew(grain)
            known |= changed
            affected |= changed.keys()
        for other in affected:
            if other in rollers and present[other]:
                sample(other)
    return left


def pivots(
    places: Places,
    sizes: FloatArray,
    loading: Loading,
    tables: Mapping[int, ForceTable],
    bond: float = 0.0,
) -> FloatArray:
    """Find the flow at which each grain by itself begins to roll.

    Parameters
    ----------
    places, sizes, loading, tables, bond
        As in `leaving`; the grains may lie in space.

    Returns
    -------
    FloatArray
        Undisturbed friction velocities, m/s, shape (n,); 0 for a grain that its
        contacts do not hold, infinite for one without a force.
    """
    least = np.full(len(sizes), np.inf)
    is_pushed = loading.ratio != 0
    if not places.width:
        for grain, roller in _rollers(places, sizes, loading, is_pushed, bond):
            near = roller.others
            pivot = _foremost(roller.start, near, near)
            if pivot is None:
                least[grain] = 0.0
                continue
            start = roller.start[:2]
            least[grain] = roller.flow_over(start, near[pivot], near, tables[grain])
        return least
    for grain, sides, held in _pyramids(places, sizes, is_pushed):
        ratio = float(loading.ratio[grain])
        drag = -np.sign(ratio) * _in_plane(sides, loading.along[grain])
        lift = -_in_plane(sides, loading.outward[grain])
        goal = bond * held - sides[:, 2]
        arms = zip(drag.tolist(), lift.tolist(), goal.tolist(), strict=True)
        flows = [tables[grain].reaching(*arm) for arm in arms]
        least[grain] = min(flows, default=np.inf) / abs(ratio)
    return least


def surrounded(places: Places, sizes: FloatArray, chosen: BoolArray) -> BoolArray:
    """Find the grains of a strip that their contacts surround.

    No way leads such a grain out of its place, whatever force acts on it, until one of
    its neighbours has left.

    Parameters
    ----------
    places, sizes
        As in `leaving`.
    chosen
        Which grains are asked about, shape (n,).

    Returns
    -------
    BoolArray
        Which of them, shape (n,); none in one plane.
    """
    found = np.zeros(len(sizes), bool)
    if places.width:
        for grain, sides, _ in _pyramids(places, sizes, chosen):
            found[grain] = not len(sides)
    return found


def pivot_angles_deg(
    places: Places, sizes: FloatArray, along: FloatArray, only: int | None = None
) -> FloatArray:
    """Find the angle from the bed's normal over which each grain rolls downstream.

    In a plane that of its foremost contact, in space that to which the grain bears a
    force, as a board is tilted until it rolls.

    Parameters
    ----------
    places, sizes
        As in `leaving`.
    along
        Unit vector downstream along the bed at each grain, shape (n, 2).
    only
        The one grain that is asked about; by default all.

    Returns
    -------
    FloatArray
        Angles, degrees, shape (n,); NaN for a grain without contacts, or that no force
        along the bed moves.
    """
    angles = np.full(len(sizes), np.nan)
    chosen = np.ones(len(sizes), bool)
    if only is not None:
        chosen = np.arange(len(sizes)) == only
    if not places.width:
        discs = _discs(places, sizes, 1.0)
        for grain, near in _neighbours(places, sizes, chosen):
            pivot = _foremost(discs[grain], discs, near)
            if pivot is not None:
                slope = math.atan2(along[grain, 1], along[grain, 0])
                lean = _lean(discs[grain][:2], discs[pivot][:2])
                angles[grain] = math.degrees(lean - slope)
        return angles
    outward = np.column_stack([-along[:, 1], along[:, 0]])
    for grain, sides, _ in _pyramids(places, sizes, chosen):
        forward = _in_plane(sides, along[grain])
        deep = -_in_plane(sides, outward[grain])
        is_ahead = forward < 0
        if is_ahead.any():
            leans = np.arctan2(deep[is_ahead], -forward[is_ahead])
            angles[grain] = np.degrees(leans.min())
    return angles


def _rollers(
    places: Places, sizes: FloatArray, loading: Loading, chosen: BoolArray, bond: float
) -> Iterator[tuple[int, _Roller]]:
    """The chosen grains that carry a force, by their numbers."""
    ahead = _discs(places, sizes, 1.0)
    behind = _discs(places, sizes, -1.0)
    for i, near in _neighbours(places, sizes, chosen & (loading.ratio != 0)):
        ratio = float(loading.ratio[i])
        side = math.copysign(1.0, ratio)
        discs = ahead if ratio > 0 else behind
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
    """The chosen grains, each with those within its reach, by rising numbers."""
    first, second, apart = places.pairs((REACH + 1) * float(sizes.max()))
    reach = REACH * sizes[first] + (sizes[first] + sizes[second]) / 2
    is_near = np.linalg.norm(apart, axis=1) < reach
    first = first[is_near]
    second = second[is_near]
    for i, rows in _by_grain(first, second, chosen):
        yield i, second[rows].tolist()


def _by_grain(
    first: IntArray, second: IntArray, chosen: BoolArray
) -> Iterator[tuple[int, IntArray]]:
    """The chosen grains, each with the places of its pairs, by the other's number."""
    order = np.lexsort((second, first))
    ends = np.searchsorted(first[order], np.arange(len(chosen) + 1))
    for i in np.flatnonzero(chosen).tolist():
        yield i, order[ends[i] : ends[i + 1]]


def _foremost(
    grain: Disc, discs: dict[int, Disc] | list[Disc], numbers: Iterable[int]
) -> int | None:
    """The contact of a grain that lies farthest round towards +x, from below."""
    place = grain[:2]
    foremost: int | None = None
    largest = -math.inf
    for number in numbers:
        other = discs[number]
        touch = grain.radius + other.radius
        if math.dist(other[:2], place) < (1 + TOUCH) * touch:
            lean = _lean(place, other[:2])
            if lean > largest:
                largest = lean
                foremost = number
    return foremost


def _lean(place: Place, neighbour: Place) -> float:
    """Direction to a neighbour: 0 below, pi/2 level and towards +x."""
    return math.atan2(neighbour[0] - place[0], place[1] - neighbour[1])


def _pyramids(
    places: Places, sizes: FloatArray, chosen: BoolArray
) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """The chosen grains, each with the inward normals of its contacts' pyramid, (k, 3).

    Beside them is what its contacts pull along each normal, over the weight for a bond
    of 1, (k,).
    """
    first, second, apart = places.contacts(sizes)
    directions = apart / np.linalg.norm(apart, axis=1)[:, None]
    for i, rows in _by_grain(first, second, chosen):
        touching = directions[rows]
        sides = []
        for a, b in combinations(range(len(touching)), 2):
            normal = np.cross(touching[a], touching[b])
            others = touching @ normal
            if (others > -FLAT).all() or (others < FLAT).all():
                sides.append(normal * (1 if others.sum() > 0 else -1))
        # a pyramid of fewer than three contacts contains no direction: its one side
        # faces up
        if len(touching) < 3:
            sides = [np.array([0.0, 0.0, 1.0])]
        normals = np.array(sides).reshape(-1, 3)
        pull = _pull(sizes[i], sizes[second[rows]])
        yield i, normals, normals @ (pull[:, None] * touching).sum(axis=0)


def _in_plane(sides: FloatArray, direction: FloatArray) -> FloatArray:
    """Part of each side's normal along a direction of the flow's plane, shape (k,)."""
    return np.asarray(sides[:, 0] * direction[0] + sides[:, 2] * direction[1])
