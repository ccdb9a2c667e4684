"""Where the grains of a bed lie, which of them are exposed, and which may move.

A lattice of equal spheres has rows in which the centres are ``2 d cos(beta)`` apart, each row
resting in the pockets of the one below, ``d sin(beta)`` lower. Lengths here are in diameters d of
the scene, with the foot of the form at the origin; each grain has a size of its own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed.disorder import rows as disorder_rows
from orchestrator.bed.line import BedLine
from orchestrator.bed.places import Places
from orchestrator.study.parts import Packing as Pattern

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

TIE = 1e-6
"""Part of a diameter: neighbours of a lattice lie exactly on the limits below, and round-off must
not decide a tie."""
APRON = 10.0
"""Length of the fixed flat bed beyond each toe, diameters."""
STRAY = 0.1
"""Rows of a disordered bed are straight within this, diameters: no neighbour of a row covers
another, and none stands out too far."""
DISORDERED = 4
"""Least rows of a disordered bed that are not a lattice, however few of them may move: the packing
is the same for any number of mobile layers up to it."""
PERTURBATION = 1e-9
"""How far the grains of a lattice's replica lie aside, diameters: as far as matters to nothing but
which grain of a chain goes first."""
LEE_DEPTH = 1.5
"""Thickness of the fixed lee side, layers: no grain falls through it, cut as it may be."""


@dataclass(frozen=True)
class Packing:
    """The grains of a pile, n of them, lengths in diameters.

    Attributes
    ----------
    centres : ndarray, shape (n, 2)
        x and z of each centre.
    sizes : ndarray, shape (n,)
        Diameter of each grain, d.
    mobile : ndarray of bool, shape (n,)
        May move; the others are fixed.
    windward, lee : ndarray of bool, shape (n,)
        Exposed and counted, by default on windward sides; exposed elsewhere.
    arc_length : ndarray, shape (n,)
        Position along the bed line; it means something for exposed grains.
    across : ndarray, shape (n,), or 0
        y of each centre; 0 in one plane.
    width : float
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
        """N(d): how many grains the windward face exposes."""
        return int(self.windward.sum())


def pile(
    line: BedLine,
    *,
    entrainment_angle_deg: float,
    gap: float,
    pattern: Pattern,
    mobile_layers: int,
    disorder: float = 0.0,
    seed: int = 0,
) -> Packing:
    """Pack a pile with straight faces.

    Parameters
    ----------
    line : BedLine
        Bed line of the flow, diameters.
    entrainment_angle_deg : float
        beta of the lattice.
    gap : float
        Height of the exposed grains' lowest points over the bed line, z0/d.
    pattern : {"aligned", "horizontal", "disordered"}
        Rows along the windward face, or level; or along it with random gaps.
    mobile_layers : int
        Layers of the windward face that may move.
    disorder : float
        Largest gap in the row below the mobile ones of a disordered packing, diameters.
    seed : int
        Chooses one disordered packing of many; on a lattice 0 is itself, others are its replicas.
    """
    beta = np.radians(entrainment_angle_deg)
    surface = 0.5 + gap
    row_height = float(np.sin(beta))
    most = int(np.ceil(line.crest[1] / line.tangents[line.windward, 0] / row_height)) + 1
    mobile_layers = min(mobile_layers, most)
    uneven = max(mobile_layers, DISORDERED)
    points = _points(line, pattern, beta, surface, uneven, disorder, seed)
    stray = STRAY if pattern == "disordered" else TIE
    # under a slope's level rows a grain rests on one that lies deeper below the face
    layers = mobile_layers + (pattern == "horizontal")
    body = _shell(points, line, beta, surface, layers, stray)
    buried = body[:, 1] < surface - TIE
    in_layers = line.depth(body, line.windward) + surface < (mobile_layers - 0.5) * row_height
    windward, lee = (face & ~buried for face in exposed(body, line, disorder))
    mobile = (in_layers & ~buried) | windward
    idle = buried & ~_touching(body, mobile)
    body = body[~idle]
    mobile, windward, lee = (chosen[~idle] for chosen in (mobile, windward, lee))
    centres = np.vstack([body, _apron(body, surface)])
    rest = np.zeros(len(centres) - len(body), bool)
    return Packing(
        centres=centres + replica(len(centres), 0 if pattern == "disordered" else seed),
        sizes=np.ones(len(centres)),
        mobile=np.append(mobile, rest),
        windward=np.append(windward, rest),
        lee=np.append(lee, rest),
        arc_length=line.nearest(centres)[1],
    )


def replica(count: int, seed: int) -> FloatArray:
    """How far the grains of a replica lie aside; 0 is the lattice itself."""
    aside = PERTURBATION if seed else 0.0
    return np.random.default_rng(seed).uniform(-aside, aside, (count, 2))


def _points(
    line: BedLine,
    pattern: Pattern,
    beta: float,
    surface: float,
    uneven: int,
    disorder: float,
    seed: int,
) -> FloatArray:
    """Where grains of the pattern may lie, one of them on the crest."""
    face = line.tangents[line.windward]
    direction = np.array([1.0, 0.0]) if pattern == "horizontal" else face
    apex = line.crest + np.array([0, surface / face[0]])
    lattice = _lattice(line, apex, direction, beta)
    if pattern != "disordered":
        return lattice
    columns = int(np.ceil(line.crest_s / np.cos(beta) / 2)) + uneven + 4
    rows = disorder_rows(columns, uneven, beta=beta, size=disorder, seed=seed)
    normal = line.normals[line.windward]
    upper = apex + np.vstack(rows) @ np.vstack([direction, normal])
    below = (apex - lattice) @ normal > (uneven + 0.5) * np.sin(beta)
    return np.vstack([upper, lattice[below]])


def _shell(
    points: FloatArray,
    line: BedLine,
    beta: float,
    surface: float,
    layers: int,
    stray: float,
) -> FloatArray:
    """Grains near both faces, and some below the ground.

    Below the layers that hold mobile grains one is enough: a grain touches no deeper one.
    """
    depths = [line.depth(points, face) + surface for face in (line.windward, line.lee)]
    depth, level = np.minimum(*depths), points[:, 1] - surface
    windward_shell = depths[0] < (layers + 0.5) * np.sin(beta)
    lee_shell = depths[1] < LEE_DEPTH * np.sin(beta)
    inside = (depth >= -stray) & (windward_shell | lee_shell)
    covered = (level < -TIE) & (depth > 0.5 * np.sin(beta))
    return np.asarray(points[inside & ((level >= -TIE) | (covered & (level > -1.3)))])


def _touching(points: FloatArray, chosen: BoolArray) -> BoolArray:
    """Which points touch one of the chosen ones."""
    wanted = points[chosen]
    order = np.argsort(wanted[:, 0])
    wanted = wanted[order]
    reach = 1 + 1e-3
    start = np.searchsorted(wanted[:, 0], points[:, 0] - reach)
    stop = np.searchsorted(wanted[:, 0], points[:, 0] + reach)
    return np.array(
        [
            bool(np.any(np.hypot(*(wanted[low:high] - point).T) < reach))
            for point, low, high in zip(points, start, stop, strict=True)
        ]
    )


def exposed(centres: FloatArray, line: BedLine, slack: float = 0.0) -> tuple[BoolArray, BoolArray]:
    """Which grains are exposed on the windward and on the lee face.

    A grain is exposed when no other centre lies higher along the normal of its face within d/2 of
    the line along that normal through its own centre. A slit narrower than `slack` (diameters)
    between two grains does not expose the one under it.
    """
    side = centres[:, 0] <= line.crest[0] + TIE
    found = []
    for face, own in ((line.windward, side), (line.lee, ~side)):
        normal = line.normals[face]
        along = centres @ np.array([normal[1], -normal[0]])
        height = centres @ normal
        free = _unshadowed(along, height, 0.5 + slack + TIE, STRAY if slack else TIE)
        found.append(free & own)
    return found[0], found[1]


def _unshadowed(along: FloatArray, height: FloatArray, reach: float, stray: float) -> BoolArray:
    """Which points have none that is higher within a reach along the face."""
    order = np.argsort(along, kind="stable")
    x, z = along[order], height[order]
    free = np.ones(len(x), bool)
    # neighbours by place: first each point with the next one, then with the one after that
    for apart in range(1, len(x)):
        near = np.flatnonzero(x[apart:] - x[:-apart] <= reach)
        if not len(near):
            break
        first, second = near, near + apart
        free[first] &= z[second] <= z[first] + stray
        free[second] &= z[first] <= z[second] + stray
    found = np.empty_like(free)
    found[order] = free
    return found


def _lattice(line: BedLine, anchor: FloatArray, direction: FloatArray, beta: float) -> FloatArray:
    """Every lattice point within the form's corners, with a margin."""
    normal = np.array([-direction[1], direction[0]])
    corners = np.array([np.zeros(2), line.toe, line.crest]) - anchor
    along, down = corners @ direction / np.cos(beta) / 2, -corners @ normal / np.sin(beta)
    rows = np.arange(0, np.ceil(down.max()) + 3)
    columns = np.arange(np.floor(along.min()) - 3, np.ceil(along.max()) + 4)
    row, column = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
    offset = (2 * column + row % 2) * np.cos(beta)
    return anchor + np.outer(offset, direction) - np.outer(row * np.sin(beta), normal)


def _apron(body: FloatArray, surface: float) -> FloatArray:
    """Two flat rows of touching fixed grains, each starting where it touches the pile."""
    drop = np.abs(body[:, 1] - surface)
    near = body[drop < 1]
    clearance = np.sqrt(1 - drop[drop < 1] ** 2)
    first = (near[:, 0] - clearance).min(), (near[:, 0] + clearance).max()
    steps = np.arange(0, APRON)
    x = np.concatenate([first[0] - steps, first[1] + steps])
    return np.column_stack([x, np.full(len(x), surface)])
