"""The run of the grains of a pile: the deck, its load steps, and what is read of it."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator.bed import deck
from orchestrator.bed.deck import GrainTable
from orchestrator.errors import InputError
from orchestrator.grains import motion, wear
from orchestrator.grains.bed_state import GRAINS, BedState
from orchestrator.grains.cells import GrainCase
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.loads import Loads, loads_of
from orchestrator.grains.motion import Motion
from orchestrator.grains.wear import WornFlow
from orchestrator.physics.gusts import gust_stresses
from orchestrator.runs.case import Case
from orchestrator.solvers.dem import ENGINE
from orchestrator.study.parts import Gusts
from orchestrator.study.scene import READ_LATER, Scene
from orchestrator.types import FloatArray

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
HARDLY, STRONGER = 1.1, 2.0
"""Of gusts whose largest stress is less than the first over the mean, the forces are
compared at the second: those of two equal stresses say of no power, 0/0."""


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
            asked["threshold"]["goal"] = wear.goal_part(self.scene, self.flow)
        return asked

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        method = self.scene.method.grains
        width = self.geometry.bed.width
        load_steps = (
            np.log(3.5) / np.log1p(method.load_increment) / wear.rounds(self.scene)
        )
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
        grains = grain_table(loads, worn)
        numbers = self._numbers(loads.geometry, grains)
        force = loads.loading.at(rising)
        gusts = deck.STEADY
        if scene.flow.gusts:
            gusts = in_time(scene.flow.gusts, loads, rising[1:])
        margin = MARGIN * scene.grain.diameter
        deck.write_deck(
            directory, grains, numbers, rising, force, margin, self.ranks, gusts
        )

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
            enough = count - wear.goal(geometry, self.flow)
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
        grains = grain_table(loads, worn)
        motion.check_rest(
            directory,
            grains,
            scene.weight,
            scene.method.grains.stiffness,
            all_rest=True,
            remedy=motion.POURED_REMEDY if scene.is_poured else motion.REMEDY,
        )
        criterion = scene.threshold.displacement
        moved = motion.read_motion(directory, grains, criterion, falls_out=False)
        moved.to_csv(directory, grains)
        if not scene.threshold.update:
            return
        # the grains when the run has ended; those that have moved are taken off the bed
        left = worn.left.copy()
        left[grains.counted_ids - 1] = np.where(
            moved.load_step > 0, moved.flow[moved.load_step], np.inf
        )
        steps, rows = ENGINE.read_frames(directory / motion.BED, motion.BED_COLUMNS)
        last = rows[rows["step"] == steps[-1]]
        places = np.where((grains.kind == deck.FIXED)[:, None], worn.places, np.nan)
        places[last["id"] - 1] = last[["x", "z"]] / scene.grain.diameter
        places[np.isfinite(left)] = np.nan
        speed = np.where(worn.present, loads.ratio, worn.speed)
        BedState(places, left, speed).to_csv(directory)

    def _state(self, cases: Path) -> tuple[Loads, BedState]:
        """The grains under the flow when the run begins."""
        geometry = Geometry(self.scene, cases)
        if self.flow is None:
            return loads_of(geometry, cases), BedState.whole(geometry.packing)
        return wear.loads(geometry, self.flow, cases), wear.state(
            geometry, self.flow, cases
        )


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


def grain_table(loads: Loads, worn: BedState) -> GrainTable:
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
