"""The bed that changes: its line is drawn anew, and the flow solved again, as the grains leave.

All fidelity levels keep the flow of the whole pile until the end, as the paper does. Here, after
each further tenth of the counted grains has left, the bed line sinks to the grains that are there,
OpenFOAM solves the flow over it, and the grains go on by peeling under the new stress.
"""

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import ceil, hypot
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orchestrator import pipeline
from orchestrator.bed.line import BedLine
from orchestrator.flow.case import WALL_STRESS, FlowCase
from orchestrator.flow.stress import WallStress
from orchestrator.grains.loaded_bed import LoadedBed
from orchestrator.grains.motion import Motion
from orchestrator.grains.threshold import PileThreshold, of_pile
from orchestrator.runs.case import Case, is_done
from orchestrator.runs.workspace import Workspace
from orchestrator.study.scene import Scene

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

UPDATE = 0.1
"""Part of the counted grains after which the bed line is drawn anew."""
LAST = 0.7
"""Fraction at which the bed has changed enough."""
EDGE = 2.0
"""Length over which the edge of a bared part is rounded, d."""
SPACING = 0.25
"""Of the places at which the height of the grains is asked, d."""
MOST_CELLS = 200
"""Cells on a face: the edge of a bared part needs two; beds of more diameters are left out."""


@dataclass
class Wear:
    """A pile as it wears.

    Attributes
    ----------
    bed : LoadedBed
        Its grains and their laws.
    lines : list of BedLine
        The bed line of each round, d; the first is that of the whole pile.
    left, speed : ndarray, shape (n,)
        Undisturbed friction velocity at which each grain has left, m/s, infinite before; the local
        one over it at that time.
    reached : float
        The flow of the last one that left, m/s.
    ran : list of str
        The flow cases behind it, by name.
    frozen : ndarray, shape (N,)
        When each counted grain leaves under the flow of the whole pile, m/s.
    """

    bed: LoadedBed
    lines: list[BedLine] = field(default_factory=list)
    left: FloatArray = field(init=False)
    speed: FloatArray = field(init=False)
    first: FloatArray = field(init=False)
    frozen: FloatArray = field(init=False)
    ran: list[str] = field(default_factory=list)
    reached: float = 0.0

    def __post_init__(self) -> None:
        count = len(self.bed.packing.centres)
        self.left, self.speed = np.full(count, np.inf), np.zeros(count)
        self.lines.append(self.bed.line)

    @property
    def fraction(self) -> float:
        """Part of the counted grains that has left."""
        return float(np.isfinite(self.left[self.bed.packing.windward]).mean())

    @property
    def case(self) -> FlowCase:
        """The flow over the bed as it is now."""
        d = self.bed.scene.grain.diameter
        whole = self.bed.flow
        cells = max(whole.cells_per_face, _cells(self.bed.scene))
        line = None if len(self.lines) == 1 else self.lines[-1].scaled(d)
        return replace(whole, line=line or whole.line, cells_per_face=cells)

    def go_on(self, cases: Path) -> None:
        """Let the next tenth leave under the solved flow, and draw the bed line anew."""
        self.ran.append(self.case.name)
        stress = WallStress.from_csv(cases / self.ran[-1] / WALL_STRESS)
        ratio, windward = self.bed.ratio(stress, self.lines[-1]), self.bed.packing.windward
        leaving = self.bed.leaving(ratio, np.isinf(self.left))
        if len(self.lines) == 1:
            self.first, self.frozen = ratio, leaving
        here = np.isinf(self.left[windward])
        counted, flows = np.flatnonzero(windward)[here], np.maximum(leaving[here], self.reached)
        order = np.argsort(flows, kind="stable")
        order = order[np.isfinite(flows[order])]
        total = self.bed.packing.count
        goal = ceil((round(self.fraction / UPDATE) + 1) * UPDATE * total - 1e-9)
        first = order[: max(goal - (total - len(counted)), 0)]
        chosen = counted[first]
        self.left[chosen], self.speed[chosen] = flows[first], ratio[chosen]
        self.reached = float(flows[first].max(initial=self.reached))
        self.lines.append(sunk(self.bed, np.isinf(self.left)))

    def thresholds(self, fraction: float) -> tuple[PileThreshold, PileThreshold]:
        """Under the flow of the whole pile, and with the bed that changes."""
        chosen, density = self.bed.packing.windward, self.bed.scene.fluid.density
        frozen = of_pile(Motion.of_flows(self.frozen), self.first[chosen], fraction, density)
        worn = Motion.of_flows(self.left[chosen])
        return frozen, of_pile(worn, self.speed[chosen], fraction, density)


def sunk(bed: LoadedBed, there: BoolArray) -> BedLine:
    """The bed line where some grains are gone, d: as much lower as the grains' upper sides are.

    The difference is averaged over `EDGE`, so that the lattice does not show in it.
    """
    line = bed.line
    x = np.arange(line.x[1] - EDGE, line.toe[0] + EDGE, SPACING)
    centres, radii = bed.packing.centres, bed.packing.sizes / 2
    depth = _height(centres, radii, x) - _height(centres[there], radii[there], x)
    window = np.ones(round(EDGE / SPACING)) * SPACING / EDGE
    depth = np.convolve(depth, window, mode="same")
    places = x[_corners(depth)]
    finer = line.with_corners(places[(places > line.x[0]) & (places < line.x[-1])].tolist())
    z = np.array(finer.z) - np.interp(finer.x, x, depth, left=0.0, right=0.0)
    # no corner of the whole pile's flat bed moves
    return replace(finer, z=tuple(np.maximum(z, 0.0).tolist()))


def _corners(depth: FloatArray) -> BoolArray:
    """Where the depth changes, at every second diameter's half."""
    step = round(EDGE / 2 / SPACING)
    changing = np.abs(np.gradient(depth)) > 1e-3
    near = np.convolve(changing, np.ones(2 * step + 1), mode="same") > 0
    return np.asarray(near & (np.arange(len(depth)) % step == 0))


def _height(centres: FloatArray, radii: FloatArray, x: FloatArray) -> FloatArray:
    """Height of the grains' upper sides at some places, d; 0 where there are none."""
    found = np.zeros(len(x))
    for (xc, zc), radius in zip(centres.tolist(), radii.tolist(), strict=True):
        # as wide as half the way to the next: the gaps of a row do not count
        first, last = np.searchsorted(x, [xc - 2 * radius, xc + 2 * radius])
        found[first:last] = np.maximum(found[first:last], zc + radius)
    return found


def _cells(scene: Scene) -> int:
    """Cells of a face, two for the edge of a bared part."""
    bed = LoadedBed(scene)
    line = bed.line
    return ceil(hypot(float(line.crest[0]), float(line.crest[1])) * 2 / EDGE)


def wears(scenes: Mapping[str, Scene], cases: Path, done: Container[str]) -> dict[str, Wear]:
    """The piles whose grains the mesh can resolve, by the ids of their scenes.

    A poured bed has to be among the cases that are done, by name.
    """
    beds = {name: LoadedBed(scene, cases) for name, scene in scenes.items()}
    return {
        name: Wear(bed)
        for name, bed in beds.items()
        if _cells(bed.scene) <= MOST_CELLS and all(run.name in done for run in bed.pouring)
    }


def run(piles: Mapping[str, Wear], space: Workspace, *, workers: int, limit_s: float) -> None:
    """Wear some piles side by side, until `LAST` of each has left or a flow has no answer."""
    going = dict(piles)
    while going:
        asked: dict[str, Case] = {one.case.name: one.case for one in going.values()}
        todo = {name: case for name, case in asked.items() if not is_done(case, space.cases)}
        lost = pipeline.complete(todo, space, workers=workers, limit_s=limit_s)
        going = dict(_next(going, set(lost), space.cases))


def _next(going: Mapping[str, Wear], lost: set[str], cases: Path) -> Iterator[tuple[str, Wear]]:
    for name, one in going.items():
        if one.case.name in lost:
            continue
        before = one.fraction
        one.go_on(cases)
        if before < one.fraction < LAST - 1e-9:
            yield name, one
