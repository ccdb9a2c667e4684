"""A pile of grains and its answer.

Here are the threshold methods, their runs, and the bed that changes.

Without `threshold.update` the flow of the whole pile acts until the last grain has
gone, as in the paper. With it the grains leave in rounds. After each, the bed line
sinks by as much as the upper sides of the grains have, and the flow is solved over it;
what is left goes on under its forces.
"""

from collections.abc import Container, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from orchestrator import digits
from orchestrator.bed import deck
from orchestrator.bed.deck import GrainTable
from orchestrator.bed.line import BedLine
from orchestrator.bed.packing import Packing
from orchestrator.errors import InputError
from orchestrator.flow.case import FlowCase
from orchestrator.flow.run import WALL_STRESS
from orchestrator.flow.stress import WallStress
from orchestrator.grains import motion
from orchestrator.grains.cells import GrainCase
from orchestrator.grains.loads import Geometry, Loads
from orchestrator.grains.motion import Motion
from orchestrator.grains.threshold import PileThreshold, of_grains, of_pile
from orchestrator.physics.gusts import gust_stresses
from orchestrator.runs.case import Case
from orchestrator.solvers.dem import ENGINE
from orchestrator.study import methods
from orchestrator.study.criterion import GOES_ON
from orchestrator.study.methods import ThresholdMethod
from orchestrator.study.parts import Gusts
from orchestrator.study.scene import BEYOND_ASKED, READ_LATER, Scene
from orchestrator.types import BoolArray, FloatArray

MARGIN = 3.0
"""From the outermost grains to the walls of the box, and from a face to the height at
which a grain in flight is gone, diameters."""
EARLY = 0.01
"""Part of the grains of a poured bed that may go before the first load step: a few of
many hundred hardly lie, and load steps from their flow on would take most of the
time."""
REST = 7.0
"""Mean time until the grains of a lattice are at rest in a load step, sqrt(d/g')."""
IN_SPACE = 5.0
"""Cost of a grain in space over that of one in a plane: of contacts, and of fixed
grains around."""
GRAINS = "grains.csv"
"""The grains when a bed line was drawn, in the case of the flow over it; at the end of
a run of LIGGGHTS, in its case."""
EDGE = 2.0  # length over which the edge of a bared part is rounded, d
SPACING = 0.25  # spacing of the places at which the height of the grains is taken, d
NEAREST = 0.25
"""Least distance along x of a new corner from those of the bed line, d: corners that
nearly coincide make cells that are far too short."""
LEVEL = 1e-6  # a bed that is less above the flat bed lies on it, d
FAR = 1e9
HARDLY, STRONGER = 1.1, 2.0
"""Of gusts whose largest stress is less than the first over the mean, the forces are
compared at the second: those of two equal stresses say of no power, 0/0."""


@dataclass(frozen=True)
class Worn:
    """The n grains of a pile that wears, at one time.

    Attributes
    ----------
    places
        x and z of the centres, d, shape (n, 2); NaN for a grain that has gone.
    left
        Undisturbed friction velocity at which a counted grain has moved, m/s, shape
        (n,); infinite for all others.
    speed
        Signed local friction velocity over the undisturbed one, shape (n,), at that
        time or when the grain was last there.
    """

    places: FloatArray
    left: FloatArray
    speed: FloatArray

    @classmethod
    def whole(cls, packing: Packing) -> "Worn":
        """Make the grains as they were packed.

        Parameters
        ----------
        packing
            The packing.

        Returns
        -------
        Worn
            The grains, none of which has left.
        """
        count = len(packing.centres)
        return cls(packing.centres, np.full(count, np.inf), np.zeros(count))

    @property
    def present(self) -> BoolArray:
        """Which grains have not gone, shape (n,)."""
        return ~np.isnan(self.places[:, 0])

    @property
    def moved(self) -> int:
        """How many counted grains have moved."""
        return int(np.isfinite(self.left).sum())

    def to_csv(self, directory: Path) -> None:
        """Write ``grains.csv``.

        Parameters
        ----------
        directory
            The directory of the case.
        """
        table = pd.DataFrame(self.places, columns=["x_d", "z_d"])
        table = table.assign(moved_at_m_s=self.left, ustar_over_ustar0=self.speed)
        table.index = pd.RangeIndex(1, len(table) + 1, name="id")
        table.to_csv(directory / GRAINS, float_format=digits.FORMAT)

    @classmethod
    def from_csv(cls, directory: Path) -> "Worn":
        """Read what `to_csv` wrote.

        Parameters
        ----------
        directory
            The directory of the case.

        Returns
        -------
        Worn
            The grains.
        """
        values = deck.read_table(directory / GRAINS).to_numpy(float)
        return cls(values[:, 1:3], values[:, 3], values[:, 4])


@dataclass(frozen=True)
class WornFlow(Case):
    """The flow over a worn bed, after a round under another flow.

    Attributes
    ----------
    scene
        The scene of the pile.
    before
        The flow of the round before.
    run
        The run of LIGGGHTS in which grains left in that round; None if they left by
        peeling.
    """

    scene: Scene
    before: "FlowCase | WornFlow"
    run: Case | None
    kind: ClassVar[str] = "worn"
    template: ClassVar[str] = FlowCase.template
    results: ClassVar[tuple[str, ...]] = FlowCase.results
    derived: ClassVar[tuple[str, ...]] = FlowCase.derived
    bulky: ClassVar[tuple[str, ...]] = FlowCase.bulky

    @cached_property
    def geometry(self) -> Geometry:
        """The bed of the pile."""
        return Geometry(self.scene)

    @property
    def needs(self) -> tuple[Case, ...]:
        """The flow and the run of the round before, and the run that poured the bed."""
        runs = () if self.run is None else (self.run,)
        if self.geometry.sides is not self.geometry:
            # which of the grains have left is asked of those that are counted
            runs = (*self.geometry.sides.model.cases, *runs)
        return (self.before, *runs, *self.geometry.pouring)

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        return self.scene.described(exclude=READ_LATER)

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s: that of the whole pile."""
        return self.geometry.flow.cost_s

    def versions(self) -> dict[str, str]:
        """The programs that mesh and solve."""
        return self.geometry.flow.versions()

    def write(self, directory: Path, cases: Path) -> None:
        """Draw the bed line through the grains that are there, and mesh it."""
        if self.run is None:
            worn = peeled(Geometry(self.scene, cases), self.before, cases)
        else:
            worn = Worn.from_csv(cases / self.run.name)
        worn.to_csv(directory)
        self._over(worn, cases).write_from(directory, None)

    def collect(self, directory: Path) -> None:
        """Check the run and write the stress and the diagnostics, as any flow's."""
        self._over(Worn.from_csv(directory), directory.parent).collect(directory)

    def _over(self, worn: Worn, cases: Path) -> FlowCase:
        """The flow over what is left of the bed."""
        line = sunk(Geometry(self.scene, cases), worn).scaled(self.scene.grain.diameter)
        return replace(self.geometry.flow, line=line)


FlowRun = FlowCase | WornFlow


def rounds(scene: Scene) -> int:
    """Count the flows that act on a pile until its last fraction has moved.

    Parameters
    ----------
    scene
        The scene of a pile.

    Returns
    -------
    int
        How many there are.
    """
    update = scene.threshold.update
    return ceil(max(scene.threshold.fractions) / update - 1e-9) if update else 1


def goal_part(scene: Scene, flow: FlowRun | None) -> float:
    """The part of the counted grains that has moved when the round of a flow ends.

    The last round goes on a little beyond the largest fraction that is asked for, whose
    interval ends where half a grain more has moved.

    Parameters
    ----------
    scene
        The scene of a pile.
    flow
        The flow of the round; None over the whole pile.

    Returns
    -------
    float
        The part, of 1.
    """
    number = 1
    while isinstance(flow, WornFlow):
        flow = flow.before
        number += 1
    part = number * scene.threshold.update
    if number == rounds(scene):
        part = max(part, min(max(scene.threshold.fractions) + BEYOND_ASKED, 1.0))
    return round(part, 9)


def goal(geometry: Geometry, flow: FlowRun | None) -> int:
    """Count the grains that have moved when the round of a flow ends.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round; None over the whole pile.

    Returns
    -------
    int
        How many counted grains that are.
    """
    return ceil(goal_part(geometry.scene, flow) * geometry.packing.count - 1e-9)


def grains(geometry: Geometry, flow: FlowRun, cases: Path) -> Worn:
    """Find the grains as they were when the round of a flow began.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round.
    cases
        The directory of the finished runs.

    Returns
    -------
    Worn
        The grains.
    """
    if isinstance(flow, WornFlow):
        return Worn.from_csv(cases / flow.name)
    return Worn.whole(geometry.packing)


def line(geometry: Geometry, flow: FlowRun, cases: Path) -> BedLine:
    """Find the bed line of the round of a flow.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round.
    cases
        The directory of the finished runs.

    Returns
    -------
    BedLine
        The line, d.
    """
    if isinstance(flow, WornFlow):
        return sunk(geometry, grains(geometry, flow, cases))
    return geometry.line


def _loads(geometry: Geometry, flow: FlowRun, cases: Path) -> Loads:
    """The grains in the round of a flow."""
    stress = WallStress.from_csv(cases / flow.name / WALL_STRESS)
    if not isinstance(flow, WornFlow):
        return geometry.under(stress)
    worn = line(geometry, flow, cases), grains(geometry, flow, cases).present
    return geometry.under(stress, *worn)


def peeled(geometry: Geometry, flow: FlowRun, cases: Path) -> Worn:
    """Find the grains at the end of a round in which they leave by peeling.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    flow
        The flow of the round.
    cases
        The directory of the finished runs.

    Returns
    -------
    Worn
        The grains.
    """
    worn = grains(geometry, flow, cases)
    loads = _loads(geometry, flow, cases)
    windward = geometry.packing.windward
    reached = worn.left[np.isfinite(worn.left)].max(initial=0.0)
    flows = np.full(len(windward), np.inf)
    rolling = loads.leaving()
    flows[windward] = np.maximum(np.minimum(rolling, loads.lifting(rolling)), reached)
    flows[~worn.present] = np.inf
    least = goal(geometry, flow) - worn.moved
    # those that one grain frees at its flow leave with it
    last = 0.0
    if least > 0:
        last = np.sort(flows)[least - 1]
    leave = np.isfinite(flows) & (flows <= last)
    speed = np.where(worn.present, loads.ratio, worn.speed)
    places = np.where(leave[:, None], np.nan, worn.places)
    return Worn(places, np.where(leave, flows, worn.left), speed)


def sunk(geometry: Geometry, worn: Worn) -> BedLine:
    """Make the bed line over worn grains.

    It is lower by as much as their upper sides are on average.

    Parameters
    ----------
    geometry
        The pile as it was packed.
    worn
        The grains.

    Returns
    -------
    BedLine
        The line, d.
    """
    line = geometry.line
    x = np.arange(line.x[1] - EDGE, line.x[-2] + EDGE - digits.SLACK, SPACING)
    depth = _depth(geometry, worn, x)
    finer = line.with_corners(_bends(line, x, depth).tolist())
    whole = np.array(finer.z)
    z = whole - np.interp(finer.x, x, depth, left=0.0, right=0.0)
    ground = min(line.z[0], line.z[-1])
    # a form wears down to the flat bed around it, unless counted grains lie as low
    low = np.maximum(line.z[1:], line.z[:-1]) <= ground + LEVEL
    low |= np.minimum(line.z[1:], line.z[:-1]) < ground - LEVEL
    if not (low & line.counted(geometry.counts)).any():
        z = np.maximum(z, np.minimum(whole, ground))
    inside = (np.array(finer.x) > line.x[1]) & (np.array(finer.x) < line.x[-2])
    return replace(finer, z=tuple(np.where(inside, z, whole).tolist()))


def _depth(geometry: Geometry, worn: Worn, x: FloatArray) -> FloatArray:
    """How much lower the upper sides of worn grains are at some places, d, averaged."""
    packed = geometry.packing
    present = worn.present
    before = _tops(packed.centres, packed.sizes / 2, x)
    after = _tops(worn.places[present], packed.sizes[present] / 2, x)
    window = np.ones(round(EDGE / SPACING)) * SPACING / EDGE
    return np.convolve(before - after, window, mode="same")


def _bends(line: BedLine, x: FloatArray, depth: FloatArray) -> FloatArray:
    """Places of new corners, one per diameter, where the depth at `x` changes, d."""
    step = round(EDGE / 2 / SPACING)
    is_steep = np.abs(np.gradient(depth)) > 1e-3
    changes = np.convolve(is_steep, np.ones(2 * step + 1), mode="same") > 0
    places = x[changes & (np.arange(len(x)) % step == 0)]
    apart = np.abs(places[:, None] - line.x).min(axis=1) > NEAREST + digits.SLACK
    return np.asarray(places[apart & (places > line.x[0]) & (places < line.x[-1])])


def _tops(centres: FloatArray, radii: FloatArray, x: FloatArray) -> FloatArray:
    """Height of the grains' upper sides at some places, d.

    It is far below where there are no grains.
    """
    tops = np.full(len(x), -FAR)
    for (xc, zc), radius in zip(centres.tolist(), radii.tolist(), strict=True):
        # as wide as half the way to the next: the gaps of a row do not count
        ends = np.array([xc - 2 * radius, xc + 2 * radius])
        first, last = np.searchsorted(x, ends - digits.SLACK)
        tops[first:last] = np.maximum(tops[first:last], zc + radius)
    return tops


@dataclass(frozen=True)
class PileCase(GrainCase):
    """The run of LIGGGHTS of the grains of one pile or of one round.

    Attributes
    ----------
    scene
        The scene of the pile.
    flow
        The flow of the round; None over the whole pile.
    before
        The run that it goes on from; None if it is the first.
    """

    scene: Scene
    flow: WornFlow | None = None
    before: "PileCase | None" = None
    kind: ClassVar[str] = "pile"
    derived: ClassVar[tuple[str, ...]] = (*GrainCase.derived, GRAINS)

    @cached_property
    def geometry(self) -> Geometry:
        """Its bed, whose grains are not known before they are poured."""
        return Geometry(self.scene)

    @property
    def needs(self) -> tuple[Case, ...]:
        """The runs that it needs.

        They are those of its flow model, the one that it goes on from, and the one that
        pours its grains.
        """
        flows = self.geometry.solved if self.flow is None else (self.flow,)
        return (
            *flows,
            *((self.before,) if self.before else ()),
            *self.geometry.pouring,
        )

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        asked = self.scene.described(exclude=READ_LATER)
        asked["method"]["grains"]["final_fraction"] = self.scene.last_fraction
        if self.scene.threshold.update:
            asked["threshold"]["goal"] = goal_part(self.scene, self.flow)
        return asked

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        method = self.scene.method.grains
        width = self.geometry.bed.width
        load_steps = np.log(3.5) / np.log1p(method.load_increment) / rounds(self.scene)
        # of a lattice the layers that may move take the time, and decks of one of four
        # were timed
        size = 4 * self._length * self._layers
        exposed = np.nan
        if self.geometry.pouring:
            size = self._size
            exposed = self._length * (width or 1)
            if width:
                size *= IN_SPACE
        grain = self.scene.grain
        return deck.cost_s(load_steps, size, REST, method, grain, exposed)

    @property
    def ranks(self) -> int:
        """Processes that the solver is run with."""
        return ENGINE.ranks(self._size)

    @property
    def _size(self) -> int:
        """About how many grains the deck has, from the lengths of the bed alone."""
        return int(self._length * (self._layers + 3) * (self.geometry.bed.width or 1))

    @property
    def _layers(self) -> float:
        """Mobile layers: at most the whole bed.

        A pile is half its rows thick on average.
        """
        bed = self.geometry.bed
        most = self.geometry.line.h / 2
        if self.geometry.pouring:
            most = bed.poured_depth
        return min(self.scene.method.grains.mobile_layers, most)

    @property
    def _length(self) -> float:
        """Length of the bed whose grains may move, d."""
        geometry = self.geometry
        if geometry.bed.is_wedge:
            return geometry.line.crest_s
        return geometry.length

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains with their forces, and the load steps of the protocol."""
        scene = self.scene
        loads, worn = self._state(cases)
        rising = self._rising(loads, cases)
        grains = table(loads, worn)
        numbers = self._numbers(loads.geometry, grains)
        force = loads.loading.at(rising)
        gusts = deck.STEADY
        if scene.flow.gusts:
            gusts = in_time(scene.flow.gusts, loads, rising[1:])
        margin = MARGIN * scene.grain.diameter
        deck.write(directory, grains, numbers, rising, force, margin, self.ranks, gusts)

    def _rising(self, loads: Loads, cases: Path) -> FloatArray:
        """The flow of the settling and of each load step, u*_0 in m/s."""
        if self.before is None:
            return flows(loads)
        reached = float(Motion.from_csv(cases / self.before.name).flow[-1])
        # the run goes on from the flow that the one before has reached
        thresholds = loads.leaving()
        step = self.scene.method.grains.load_increment
        last = thresholds[np.isfinite(thresholds)].max(initial=reached)
        highest = max(deck.BEYOND * last, reached * (1 + step))
        rising = deck.rising_flows(reached, highest, step)
        if self.scene.is_poured:
            # poured without a flow, it rests without one: some that were hidden go
            rising[0] = 0.0
        return rising

    def _numbers(self, geometry: Geometry, grains: deck.GrainTable) -> dict[str, Any]:
        """The numbers of the deck."""
        scene = self.scene
        d = scene.grain.diameter
        count = geometry.packing.count
        enough = int((1 - scene.last_fraction) * count + 1e-9)
        if scene.threshold.update:
            enough = count - goal(geometry, self.flow)
        slope, ridge = geometry.packed_line.roof(MARGIN + 0.5)
        mobile = grains.kind > deck.FIXED
        smallest = float(grains.sizes[mobile].min())
        protocol = deck.protocol(
            scene.grain,
            scene.method.grains,
            scene.threshold.displacement,
            enough,
            smallest,
            scene.flow.gusts,
        )
        return {
            "diameter": d,
            "smallest": smallest,
            "density": scene.grain.density,
            "gravity": scene.reduced_gravity,
            **protocol,
            "settle_drag": deck.POURED_DRAG if scene.is_poured else 0.0,
            "slope": slope,
            "ceiling_x": ridge[0] * d,
            "ceiling_z": ridge[1] * d,
            "behind": grains.position[mobile, 0].max() + deck.AWAY * d,
        }

    def collect(self, directory: Path) -> None:
        """Check the run and write what each counted grain did to ``motion.csv``."""
        ENGINE.check_log(directory)
        scene = self.scene
        loads, worn = self._state(directory.parent)
        grains = table(loads, worn)
        motion.check_rest(
            directory,
            grains,
            scene.weight,
            scene.method.grains.stiffness,
            all_rest=True,
            remedy=motion.POURED_REMEDY if scene.is_poured else motion.REMEDY,
        )
        criterion = scene.threshold.displacement
        moved = motion.read(directory, grains, criterion, falls_out=False)
        moved.to_csv(directory, grains)
        if not scene.threshold.update:
            return
        # the grains when the run has ended; those that have moved are taken off the bed
        left = worn.left.copy()
        left[grains.counted_ids - 1] = np.where(
            moved.level > 0, moved.flow[moved.level], np.inf
        )
        steps, rows = ENGINE.read_frames(directory / motion.BED, motion.BED_COLUMNS)
        last = rows[rows["step"] == steps[-1]]
        places = np.where((grains.kind == deck.FIXED)[:, None], worn.places, np.nan)
        places[last["id"] - 1] = last[["x", "z"]] / scene.grain.diameter
        places[np.isfinite(left)] = np.nan
        speed = np.where(worn.present, loads.ratio, worn.speed)
        Worn(places, left, speed).to_csv(directory)

    def _state(self, cases: Path) -> tuple[Loads, Worn]:
        """The grains under the flow when the run begins."""
        geometry = Geometry(self.scene, cases)
        if self.flow is None:
            return geometry.loads(cases), Worn.whole(geometry.packing)
        return _loads(geometry, self.flow, cases), grains(geometry, self.flow, cases)


def flows(loads: Loads) -> FloatArray:
    """Find the flow of the settling, then of each load step.

    They begin before the first grain goes.

    Parameters
    ----------
    loads
        The grains under their forces.

    Returns
    -------
    FloatArray
        Undisturbed friction velocities u*_0, m/s, that rise from 0 or more.

    Raises
    ------
    InputError
        If no counted grain is held by its contacts and can leave them.
    """
    geometry = loads.geometry
    pivots = np.sort(loads.alone())
    if geometry.packing.width:
        # no peeling in space says which grain frees which
        thresholds = pivots[(pivots > 0) & np.isfinite(pivots)]
        first = _first(thresholds, geometry)
        asked = int(geometry.scene.last_fraction * len(pivots))
        place = min(asked, len(thresholds) - 1)
    else:
        thresholds = np.sort(loads.leaving())
        first = _first(thresholds, geometry)
        if not 0 < first < np.inf or geometry.scene.forces.loaded_grains != "exposed":
            # a bed that rolls by itself, or is blocked until its grains push: DEM
            # decides
            thresholds = pivots
            first = _first(pivots, geometry)
        elif not geometry.bed.is_wedge:
            # on a bed without a free end no grain can be peeled first
            first = min(first, _first(pivots, geometry))
        place = int(np.ceil(geometry.scene.last_fraction * geometry.packing.count)) - 1
    if not 0 < first < np.inf:
        what = "no exposed grain lies in a pocket that lets it go"
        remedy = "a longer or wider bed, or another bed.seed"
        raise InputError(what, where=f"scene {geometry.scene.id}: bed", remedy=remedy)
    last = thresholds[place]
    if not np.isfinite(last):
        last = thresholds[np.isfinite(thresholds)].max(initial=2 * first)
    # so few grains may be asked for that all of them lie loose
    last = max(last, first)
    # gusts that are too short do nothing: then the mean stress moves the grains
    beyond = deck.BEYOND * np.sqrt(geometry.scene.gust)
    step = geometry.scene.method.grains.load_increment
    return deck.rising_flows(deck.START * first, beyond * last, step)


def in_time(gusts: Gusts, loads: Loads, rising: FloatArray) -> FloatArray:
    """Compute the force in each event and after the last over the largest one.

    The force is a power of the stress, which is found between the mean and the largest
    stress, or one that is `STRONGER` where the largest is hardly above the mean.

    Parameters
    ----------
    gusts
        The gusts.
    loads
        The grains under the forces of the largest stress.
    rising
        Flows of the load steps, u*_0 in m/s, shape (K,).

    Returns
    -------
    FloatArray
        The ratios of the forces.
    """
    peak = loads.geometry.scene.gust
    mean = rising / np.sqrt(peak)
    span = peak if peak > HARDLY else STRONGER
    ratio = _size(loads, mean * np.sqrt(span)) / _size(loads, mean)
    power = np.log(ratio) / np.log(span)
    stress = gust_stresses(
        gusts.intensity, gusts.events, len(rising), loads.geometry.bed.seed
    )
    with_mean = np.pad(stress, ((0, 0), (0, 1)), constant_values=1.0)
    each = (with_mean / peak) ** power[:, None]
    settling = peak ** -power[0]
    return np.concatenate([[settling], each.ravel()])


def _size(loads: Loads, flows: FloatArray) -> FloatArray:
    """Sum of the absolute components of all grains' forces, N, of shape (flows,)."""
    return np.asarray(np.abs(loads.loading.at(flows)).sum(axis=(1, 2)))


def _first(thresholds: FloatArray, geometry: Geometry) -> float:
    """The first of sorted flows above 0, which is that of loose grains.

    It is 0 if there is none.

    Of a poured bed it is that of the first grain but a few.
    """
    held = thresholds[thresholds > 0]
    if not len(held):
        return 0.0
    if geometry.pouring:
        return float(held[int(EARLY * len(held))])
    return float(held[0])


def table(loads: Loads, worn: Worn) -> GrainTable:
    """Make the grains of the deck.

    Parameters
    ----------
    loads
        The grains under their forces.
    worn
        The grains as they are.

    Returns
    -------
    GrainTable
        The grains.
    """
    packed = loads.geometry.packing
    grain = loads.geometry.scene.grain
    d = grain.diameter
    x, z = worn.places.T
    kind = np.select(
        [~worn.present, ~packed.mobile, packed.windward, loads.exposed],
        [deck.GONE, deck.FIXED, deck.COUNTED, deck.PUSHED],
        deck.MOBILE,
    )
    return GrainTable(
        position=np.column_stack([x * d, packed.places.xyz[:, 1] * d, z * d]),
        kind=kind,
        along=loads.along,
        sizes=packed.sizes,
        diameter=d,
        density=grain.density,
        width=packed.width,
    )


@dataclass(frozen=True)
class Method:
    """A way to find out when the counted grains of a bed move.

    Each method is a subclass.

    Attributes
    ----------
    geometry
        The pile.
    """

    geometry: Geometry

    @property
    def cases(self) -> tuple[Case, ...]:
        """The runs that it needs besides those of the flow over the whole pile."""
        return ()

    def motion(self, cases: Path) -> Motion:
        """Find the motion of the counted grains.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        Motion
            When each of them moved.
        """
        raise NotImplementedError

    def last(self, cases: Path) -> Worn:
        """Find the grains of a bed that changes when the last round has ended.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        Worn
            The grains.
        """
        raise NotImplementedError


class Pivot(Method):
    """The closed form.

    Each grain, or place on the bed line, moves by itself under its own stress.

    Attributes
    ----------
    geometry
        The pile.
    """

    def motion(self, cases: Path) -> Motion:
        """Motion at the flows of Eq. 3 or 5, or at those that lift a grain before."""
        loads = self.geometry.loads(cases)
        return Motion.of_flows(rolling := loads.alone(), loads.lifting(rolling))


class Peeling(Method):
    """Pivots that free one another, without dynamics.

    A grain that lift takes off frees none.

    Attributes
    ----------
    geometry
        The pile.
    """

    @property
    def cases(self) -> tuple[WornFlow, ...]:
        """The flows over a bed that changes."""
        scene = self.geometry.scene
        runs: list[WornFlow] = []
        for _ in range(1, rounds(scene)):
            before = runs[-1] if runs else self.geometry.flow
            runs.append(WornFlow(scene, before, None))
        return tuple(runs)

    def motion(self, cases: Path) -> Motion:
        """Motion at the flows that `orchestrator.grains.peeling` finds."""
        if self.geometry.scene.threshold.update:
            left = self.last(cases).left
            return Motion.of_flows(left[self.geometry.packing.windward])
        loads = self.geometry.loads(cases)
        rolling = loads.leaving()
        return Motion.of_flows(rolling, loads.lifting(rolling))

    def last(self, cases: Path) -> Worn:
        """The grains of a bed that changes, when the last round has ended."""
        flow: FlowRun = self.geometry.flow
        runs = self.cases
        if runs:
            flow = runs[-1]
        return peeled(self.geometry, flow, cases)


class Dem(Method):
    """A run of LIGGGHTS under a flow that is raised in steps.

    Attributes
    ----------
    geometry
        The pile.
    """

    @property
    def cases(self) -> tuple[Case, ...]:
        """The run.

        A bed that changes has a run for each flow, which goes on from the last one.
        """
        return tuple(
            case for run in self.runs for case in (run.flow, run) if case is not None
        )

    @cached_property
    def runs(self) -> tuple[PileCase, ...]:
        """The runs of LIGGGHTS."""
        scene = self.geometry.scene
        runs = [PileCase(scene)]
        for _ in range(1, rounds(scene)):
            before = runs[-1]
            flow = WornFlow(scene, before.flow or self.geometry.flow, before)
            runs.append(PileCase(scene, flow, before))
        return tuple(runs)

    def motion(self, cases: Path) -> Motion:
        """The motion that the finished runs left."""
        motions = [Motion.from_csv(cases / run.name) for run in self.runs]
        if len(motions) == 1:
            return motions[0]
        windward = self.geometry.packing.windward
        parts = []
        for run, part in zip(self.runs, motions, strict=True):
            begun = grains(self.geometry, run.flow or self.geometry.flow, cases)
            parts.append((begun.present[windward], part))
        return Motion.chained(parts)

    def last(self, cases: Path) -> Worn:
        """The grains of a bed that changes, when the last round has ended."""
        return Worn.from_csv(cases / self.runs[-1].name)


METHODS: dict[ThresholdMethod, type[Method]]
METHODS = {
    methods.LOCAL: Pivot,
    methods.PIVOT: Pivot,
    methods.PEELING: Peeling,
    methods.DEM: Dem,
}
"""The method of each kind."""


@dataclass(frozen=True)
class Pile(Geometry):
    """The pile of a scene: its bed, the flow over it, and its threshold method.

    Attributes
    ----------
    scene
        The scene.
    cases
        The directory of the finished runs; only the grains of a poured bed, and the
        flow over a profile, are read there.
    part
        The part of the bed on which grains are packed, a range of x in diameters; by
        default all.
    """

    @cached_property
    def method(self) -> Method:
        """How its threshold is found.

        The scene's method is not left open (``auto``).
        """
        return METHODS[self.scene.method.facts](self)

    @cached_property
    def runs(self) -> tuple[Case, ...]:
        """The cases that its answer is read from, those of the flow first."""
        return (*self.solved, *self.pouring, *self.method.cases)

    @property
    def last_run(self) -> str | None:
        """Name of the last of these cases; None without a run."""
        runs = self.runs
        if not runs:
            return None
        return runs[-1].name

    def is_run(self, done: Container[str]) -> bool:
        """Whether all of its runs are among those that are done, by name.

        Parameters
        ----------
        done
            Names of the cases that are done.

        Returns
        -------
        bool
            Whether all are.
        """
        return all(run.name in done for run in self.runs)

    @property
    def by_dem(self) -> bool:
        """Whether LIGGGHTS moves its grains."""
        return isinstance(self.method, Dem)

    @property
    def case(self) -> Case:
        """The last run of LIGGGHTS, of a scene that asks for DEM."""
        assert isinstance(self.method, Dem)
        return self.method.runs[-1]

    @property
    def flows(self) -> tuple[FlowRun, ...]:
        """The runs of the flow, one after another on a bed that changes."""
        worn = (run for run in self.method.cases if isinstance(run, WornFlow))
        return (*self.model.cases, *worn)

    @property
    def solves(self) -> "dict[str, Pile]":
        """The pile by the name of its solved flow, if its flow is solved."""
        return {run.name: self for run in self.model.cases}

    def stress(self, cases: Path) -> WallStress:
        """Read the stress along the whole bed.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        WallStress
            The stress.
        """
        return self.model.stress(cases)

    def speed(self, cases: Path) -> FloatArray:
        """Find the signed local friction velocity over u*_0 of the counted grains.

        On a bed that changes it is that of the round in which a grain moved.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        FloatArray
            The ratios, shape (N,).
        """
        changes = bool(self.scene.threshold.update)
        ratio = self.method.last(cases).speed if changes else self.loads(cases).ratio
        return np.asarray(ratio[self.packing.windward])

    def first(self, motion: Motion) -> tuple[float, float]:
        """Find where a motion starts.

        Grains that lie loose, and go in still fluid, say nothing of it.

        Parameters
        ----------
        motion
            The motion of the counted grains.

        Returns
        -------
        x, ustar0 : float
            The place, m, and the undisturbed friction velocity, m/s.
        """
        flows = of_grains(motion).value
        flows = np.where(flows > 0, flows, np.nan)
        least = np.flatnonzero(flows == np.nanmin(flows, initial=np.inf))
        if not len(least):
            return np.nan, np.nan
        at = int(
            least[len(least) // 2]
        )  # of places that go at one flow the one in the middle
        x = self.packing.centres[self.packing.windward, 0]
        return float(x[at]) * self.scene.grain.diameter, float(flows[at])

    def pivot_thresholds(self, speed: FloatArray) -> FloatArray:
        """Find the friction velocities at which counted grains move by themselves.

        Parameters
        ----------
        speed
            Local friction velocity of each over the undisturbed one, shape (N,).

        Returns
        -------
        FloatArray
            Undisturbed friction velocities, m/s, sorted, shape (N,).
        """
        ratio = np.zeros(len(self.packing.sizes))
        ratio[self.packing.windward] = speed
        return np.sort(Loads(self, ratio, np.ones(len(ratio), bool)).alone())

    def motion(self, cases: Path) -> Motion:
        """Find the motion of the counted grains.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        Motion
            When each of them moved.
        """
        motion = self.method.motion(cases)
        if not self.goes_on:
            return motion
        return motion.until(*self.loads(cases).going_on())

    @property
    def goes_on(self) -> bool:
        """Whether its grains must go on, not only leave their pockets."""
        return self.scene.threshold.criterion == GOES_ON

    def hops_decide(self, cases: Path) -> BoolArray:
        """Find the counted grains that hopping on holds longer than their pockets.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        BoolArray
            Which they are, shape (N,).
        """
        further, over = self.loads(cases).going_on()
        return np.asarray(self.method.motion(cases).flows / over < further)

    def thresholds(
        self, cases: Path, fractions: Iterable[float]
    ) -> list[PileThreshold]:
        """Find its thresholds at some fractions.

        Parameters
        ----------
        cases
            The directory of the finished runs.
        fractions
            Fractions n/N of the counted grains.

        Returns
        -------
        list of PileThreshold
            A threshold for each.
        """
        motion, speed = self.motion(cases), self.speed(cases)
        return [of_pile(motion, speed, n, self.scene.fluid.density) for n in fractions]
