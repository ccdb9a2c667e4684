"""The run of LIGGGHTS for one pile: its deck, and what its end means."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator.errors import InputError
from orchestrator.grains import deck, dump, motion, protocol, rest, wear
from orchestrator.grains.case import GrainCase
from orchestrator.grains.deck import GrainTable
from orchestrator.grains.loaded_bed import FloatArray, LoadedBed
from orchestrator.grains.motion import Motion
from orchestrator.grains.wear import BoolArray, Worn, WornFlow
from orchestrator.runs.case import Case
from orchestrator.solvers import liggghts
from orchestrator.study.scene import Scene

MARGIN = 3.0
"""From the outermost grains to the walls of the box, and from a face to the height at which a
grain in flight is gone, diameters."""
EARLY = 0.01
"""Part of the grains of a poured bed that may go before the first load step: a few of many hundred
hardly lie, and load steps from their flow on would take most of the time."""

IN_SPACE = 5.0
"""Cost of a grain in space over that of one in a plane: of contacts, and of fixed grains around."""


@dataclass(frozen=True)
class PileCase(GrainCase):
    """The grains of one pile, or those that are there in one of its rounds.

    Attributes
    ----------
    scene : Scene
        Scene of the pile.
    flow : WornFlow or None
        The flow of the round; None: that of the whole pile.
    before : PileCase or None
        The run that this one goes on from.
    """

    scene: Scene
    flow: WornFlow | None = None
    before: "PileCase | None" = None
    kind: ClassVar[str] = "pile"
    recipe: ClassVar[int] = 11
    derived: ClassVar[tuple[str, ...]] = (*GrainCase.derived, wear.GRAINS)

    @cached_property
    def loaded(self) -> LoadedBed:
        """Its bed under its flow."""
        return LoadedBed(self.scene)

    @property
    def needs(self) -> tuple[Case, ...]:
        """The runs of its flow model, the one that it goes on from, and the one that pours."""
        flows = self.loaded.model.cases if self.flow is None else (self.flow,)
        return (*flows, *((self.before,) if self.before else ()), *self.loaded.pouring)

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        return self.scene.model_dump(mode="json", exclude={"protocol": {"fractions"}})

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        rules, grain = self.scene.protocol, self.scene.grain
        load_steps = np.log(3.5) / np.log1p(rules.load_increment) / wear.rounds(self.scene)
        if self.loaded.pouring:
            exposed = self._length * (self.loaded.bed.width or 1)
            size = self._size * (IN_SPACE if self.loaded.bed.width else 1)
            return protocol.poured_cost_s(load_steps, size, exposed, rules, grain)
        return protocol.run_cost_s(load_steps, self._size, rules, grain.stiffness)

    @property
    def ranks(self) -> int:
        """Processes that the solver is run with."""
        return liggghts.ranks(self._size)

    @property
    def _size(self) -> int:
        """How many grains the deck has, about: before any is poured."""
        bed = self.loaded.bed
        # the whole pile is half its rows thick on average
        most = bed.poured_depth if self.loaded.pouring else self.loaded.line.h / 2
        layers = min(bed.mobile_layers, most) + 3
        return int(self._length * layers * (bed.width or 1))

    @property
    def _length(self) -> float:
        """Length of the bed whose grains may move, d."""
        line = self.loaded.line
        return line.crest_s if self.loaded.bed.is_wedge else float(line.x[-2] - line.x[1])

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains with their forces, and the load steps of the protocol."""
        bed = LoadedBed(self.scene, cases)
        ratio, worn = self._state(bed, cases)
        if self.before is None:
            rising = flows(bed, ratio)
        else:
            reached = float(Motion.from_csv(cases / self.before.name).flow[-1])
            rising = flows_from(reached, bed, ratio, worn.there)
        force = bed.loading(ratio).in_steps(rising.tolist())
        grains, margin = table(bed, ratio, worn), MARGIN * self.scene.grain.diameter
        numbers = _numbers(bed, grains, self._enough(bed))
        deck.write(directory, grains, numbers, rising, force, margin=margin, ranks=self.ranks)

    def collect(self, directory: Path) -> None:
        """Check the run and write what each windward grain did to ``motion.csv``."""
        self.check(directory)
        grain, cases = self.scene.grain, directory.parent
        bed = LoadedBed(self.scene, cases)
        ratio, worn = self._state(bed, cases)
        grains = table(bed, ratio, worn)
        rest.check(directory, grains, self.scene.weight, grain.stiffness, all_rest=True)
        found = motion.read(
            directory, grains, self.scene.protocol.displacement_criterion, falls_out=False
        )
        found.to_csv(directory, grains)
        if self.scene.protocol.update:
            self._after(directory, worn, ratio, found, grains).to_csv(directory)

    def _state(self, bed: LoadedBed, cases: Path) -> tuple[FloatArray, Worn]:
        """The flow on each grain, and the grains, when the run begins."""
        if self.flow is None:
            return bed.ustar_over_ustar0(cases), Worn.whole(bed)
        return wear.ratio(bed, self.flow, cases), wear.grains(bed, self.flow, cases)

    def _enough(self, bed: LoadedBed) -> int:
        """How many counted grains may still lie when the run ends."""
        if self.scene.protocol.update:
            round_ = wear.number(self.flow) if self.flow else 0
            return bed.packing.count - wear.goal(bed, round_)
        return int((1 - self.scene.protocol.final_fraction) * bed.packing.count + 1e-9)

    def _after(
        self, directory: Path, worn: Worn, ratio: FloatArray, found: Motion, grains: GrainTable
    ) -> Worn:
        """The grains when the run has ended; those that have moved are taken off the bed."""
        counted = grains.counted_ids - 1
        left = worn.left.copy()
        left[counted] = np.where(found.level > 0, found.flow[found.level], np.inf)
        places = dump.last_places(directory) / self.scene.grain.diameter
        seen = np.where((grains.kind == deck.FIXED)[:, None], worn.places, np.nan)
        seen[places.index - 1] = places
        seen[np.isfinite(left)] = np.nan
        return Worn(seen, left, np.where(worn.there, ratio, worn.speed))


def flows(bed: LoadedBed, ratio: FloatArray) -> FloatArray:
    """The flow of the settling, then of each load step: from before the first grain goes."""
    rules = bed.scene.protocol
    if bed.packing.width:
        return _flows_of_pockets(bed, ratio)
    thresholds = np.sort(bed.leaving(ratio))
    first = going = _first(bed, thresholds)
    if not bed.bed.is_wedge:
        # a row without an edge holds its grains until they push one another out of it
        first = min(first, _first(bed, bed.pivot_thresholds(ratio[bed.packing.windward])))
    if not 0 < going < np.inf or bed.scene.forces.loaded_grains != "exposed":
        # a bed that rolls by itself, or is blocked until its grains push: the deck will tell
        thresholds = bed.pivot_thresholds(ratio[bed.packing.windward])
        first = _first(bed, thresholds)
    if not 0 < first < np.inf:
        raise _none_leaves(bed)
    last = thresholds[int(np.ceil(rules.final_fraction * bed.packing.count)) - 1]
    if not np.isfinite(last):
        last = thresholds[np.isfinite(thresholds)].max(initial=2 * first)
    return protocol.flows(protocol.START * first, protocol.BEYOND * last, rules.load_increment)


def _first(bed: LoadedBed, thresholds: FloatArray) -> float:
    """The first of sorted flows; of a poured bed that of the first grain but a few."""
    held = thresholds[thresholds > 0]
    if not bed.pouring or not len(held):
        return float(thresholds[0])
    return float(held[int(EARLY * len(held))])


def _flows_of_pockets(bed: LoadedBed, ratio: FloatArray) -> FloatArray:
    """The same of a strip in space: no peeling says who frees whom."""
    rules = bed.scene.protocol
    thresholds = bed.pivot_thresholds(ratio[bed.packing.windward])
    held = thresholds[(thresholds > 0) & np.isfinite(thresholds)]
    if not len(held):
        raise _none_leaves(bed)
    last = held[min(int(rules.final_fraction * len(thresholds)), len(held) - 1)]
    first = _first(bed, held)
    return protocol.flows(protocol.START * first, protocol.BEYOND * last, rules.load_increment)


def _none_leaves(bed: LoadedBed) -> InputError:
    return InputError(
        "no exposed grain lies in a pocket that lets it go",
        where=f"scene {bed.scene.id}: bed",
        remedy="a longer or wider bed, or another bed.seed",
    )


def flows_from(reached: float, bed: LoadedBed, ratio: FloatArray, there: BoolArray) -> FloatArray:
    """The same where a run goes on from the flow that the one before has reached."""
    step = bed.scene.protocol.load_increment
    thresholds = bed.leaving(ratio, there)
    last = thresholds[np.isfinite(thresholds)].max(initial=reached)
    return protocol.flows(reached, max(protocol.BEYOND * last, reached * (1 + step)), step)


def table(bed: LoadedBed, ratio: FloatArray, worn: Worn) -> GrainTable:
    """The grains of the deck; `ratio` as `flows` takes it."""
    packed, d = bed.packing, bed.scene.grain.diameter
    kind = np.select(
        [~worn.there, ~packed.mobile, packed.windward, packed.lee],
        [deck.GONE, deck.FIXED, deck.COUNTED, deck.PUSHED],
        deck.MOBILE,
    )
    x, z = worn.places.T * d
    return GrainTable(
        position=np.column_stack([x, packed.places.xyz[:, 1] * d, z]),
        kind=kind,
        along=bed.downflow(ratio),
        sizes=packed.sizes,
        diameter=d,
        density=bed.scene.grain.density,
        width=packed.width,
    )


def _numbers(bed: LoadedBed, grains: GrainTable, enough: int) -> dict[str, float | int]:
    """The parameters of the deck."""
    rules, d = bed.scene.protocol, bed.scene.grain.diameter
    slope, ridge = bed.line.roof(MARGIN + 0.5)
    return {
        "diameter": d,
        "smallest": grains.smallest,
        "density": bed.scene.grain.density,
        "gravity": bed.scene.reduced_gravity,
        **protocol.contact(bed.scene.grain, rules),
        **protocol.raising(rules, enough, smallest=grains.smallest, is_poured=bed.scene.is_poured),
        "slope": slope,
        "ceiling_x": ridge[0] * d,
        "ceiling_z": ridge[1] * d,
        "behind": grains.last_mobile + protocol.AWAY * d,
    }
