"""The run of LIGGGHTS for one pile: its deck, and what its end means."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator.grains import deck, motion, protocol, rest
from orchestrator.grains.case import GrainCase
from orchestrator.grains.loaded_bed import FloatArray, LoadedBed
from orchestrator.runs.case import Case
from orchestrator.study.scene import Scene

MARGIN = 3.0
"""From the outermost grains to the walls of the box, and from a face to the height at which a
grain in flight is gone, diameters."""


@dataclass(frozen=True)
class PileCase(GrainCase):
    """The grains of one pile."""

    scene: Scene
    kind: ClassVar[str] = "pile"
    recipe: ClassVar[int] = 9

    @cached_property
    def loaded(self) -> LoadedBed:
        """Its bed under its flow."""
        return LoadedBed(self.scene)

    @property
    def needs(self) -> tuple[Case, ...]:
        """The runs of its flow model, and the one that pours its bed."""
        return (*self.loaded.model.cases, *self.loaded.pouring)

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        return self.scene.model_dump(mode="json", exclude={"protocol": {"fractions"}})

    @property
    def cost_s(self) -> float:
        """Expected wall time, s."""
        rules, line = self.scene.protocol, self.loaded.line
        # the whole pile is half its rows thick on average
        most = self.loaded.bed.poured_depth if self.loaded.pouring else line.h / 2
        length = line.crest_s if self.loaded.bed.is_wedge else line.x[-2] - line.x[1]
        grains = length * (min(self.loaded.bed.mobile_layers, most) + 3)
        load_steps = np.log(3.5) / np.log1p(rules.load_increment)
        return protocol.run_cost_s(load_steps, int(grains), rules, self.scene.grain.stiffness)

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains with their forces, and the load steps of the protocol."""
        bed = LoadedBed(self.scene, cases)
        ratio = bed.ustar_over_ustar0(cases)
        rising = flows(bed, ratio)
        force = bed.loading(ratio).in_steps(rising.tolist())
        grains, margin = table(bed, ratio), MARGIN * self.scene.grain.diameter
        deck.write(directory, grains, _numbers(bed, grains), rising, force, margin=margin)

    def collect(self, directory: Path) -> None:
        """Check the run and write what each windward grain did to ``motion.csv``."""
        self.check(directory)
        grain, cases = self.scene.grain, directory.parent
        bed = LoadedBed(self.scene, cases)
        grains = table(bed, bed.ustar_over_ustar0(cases))
        rest.check(directory, grains, self.scene.weight, grain.stiffness, all_rest=True)
        found = motion.read(
            directory, grains, self.scene.protocol.displacement_criterion, falls_out=False
        )
        found.to_csv(directory, grains)


def flows(bed: LoadedBed, ratio: FloatArray) -> FloatArray:
    """The flow of the settling, then of each load step: from before the first grain goes."""
    rules = bed.scene.protocol
    thresholds = np.sort(bed.leaving(ratio))
    first = thresholds[0]
    if not bed.bed.is_wedge:
        # a row without an edge holds its grains until they push one another out of it
        first = min(first, bed.pivot_thresholds(ratio[bed.packing.windward])[0])
    if not 0 < thresholds[0] < np.inf or bed.scene.forces.loaded_grains != "exposed":
        # a bed that rolls by itself, or is blocked until its grains push: the deck will tell
        thresholds = bed.pivot_thresholds(ratio[bed.packing.windward])
        first = thresholds[0]
    last = thresholds[int(np.ceil(rules.final_fraction * bed.packing.count)) - 1]
    if not np.isfinite(last):
        last = thresholds[np.isfinite(thresholds)].max(initial=2 * thresholds[0])
    return protocol.flows(protocol.START * first, protocol.BEYOND * last, rules.load_increment)


def table(bed: LoadedBed, ratio: FloatArray) -> deck.GrainTable:
    """The grains of the deck; `ratio` as `flows` takes it."""
    packed, d = bed.packing, bed.scene.grain.diameter
    kind = np.select(
        [~packed.mobile, packed.windward, packed.lee],
        [deck.FIXED, deck.COUNTED, deck.PUSHED],
        deck.MOBILE,
    )
    x, z = packed.centres.T * d
    return deck.GrainTable(
        position=np.column_stack([x, np.zeros_like(x), z]),
        kind=kind,
        along=bed.downflow(ratio),
        sizes=packed.sizes,
        diameter=d,
        density=bed.scene.grain.density,
    )


def _numbers(bed: LoadedBed, grains: deck.GrainTable) -> dict[str, float | int]:
    """The parameters of the deck."""
    rules, d = bed.scene.protocol, bed.scene.grain.diameter
    slope, ridge = bed.line.roof(MARGIN + 0.5)
    return {
        "diameter": d,
        "smallest": grains.smallest,
        "density": bed.scene.grain.density,
        "gravity": bed.scene.reduced_gravity,
        **protocol.contact(bed.scene.grain, rules),
        **protocol.raising(rules, int((1 - rules.final_fraction) * bed.packing.count + 1e-9)),
        "slope": slope,
        "ceiling_x": ridge[0] * d,
        "ceiling_z": ridge[1] * d,
        "behind": grains.last_mobile + protocol.AWAY * d,
    }
