"""Cases of LIGGGHTS on grains; single grains on their two fixed neighbours, many cells in a case.

In units of d, W and sqrt(d/g') a bed knows no scale, so the cells are models of one size: every
grain has the reference diameter, its forces are those of its own scene times the ratio of the
weights. The flow of the deck is the friction velocity over that of the closed form.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator.bed import deck
from orchestrator.grains import motion
from orchestrator.grains.loads import forces
from orchestrator.runs import process
from orchestrator.runs.case import Case
from orchestrator.runs.files import canonical_json
from orchestrator.solvers import liggghts
from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import Grain
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray

DIAMETER, DENSITY, GRAVITY = 1e-3, 2500.0, 9.81
"""The reference grain of a deck, SI; GRAVITY is its g'."""
WEIGHT = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY
LAST = 1.2
"""Flow of the last load step: a grain that still lies then contradicts the closed form by 20 %."""
SPACING = 3.0
"""Spacing of the cells across the flow, in diameters of the largest grain: grains of two cells
never meet."""
UNUSED: dict[str, Any] = {
    "threshold": {"fractions"},
    "method": {"grains": {"final_fraction"}},
}
"""Fields of the protocol that mean nothing to one grain."""
DIFFERENT: dict[str, Any] = {
    "grain": {"diameter", "density", "sizes"},
    "threshold": {"fractions"},
    "method": {"grains": {"final_fraction"}},
}
"""Fields of the grain that change the forces of a cell alone; all others change its contacts."""
REST = 2.5
"""Mean time until the grains are at rest in a load step, sqrt(d/g')."""
BLOCK = 512
"""Most cells of a deck."""


class GrainCase(Case):
    """A case that runs the deck ``in.bed``."""

    template: ClassVar[str] = "liggghts/bed"
    results: ClassVar[tuple[str, ...]] = (
        "settling.csv",
        "samples.csv",
        "passage.dump",
        "bed.dump",
    )
    derived: ClassVar[tuple[str, ...]] = ("load_steps.csv", "motion.csv")
    made: ClassVar[tuple[str, ...]] = ("log.liggghts", "counted.csv")
    bulky: ClassVar[tuple[str, ...]] = ("passage.dump", "bed.dump")

    def versions(self) -> dict[str, str]:
        """The programs that run the case, with their versions."""
        return liggghts.programs(self.ranks)

    def share(self, directory: Path) -> float:
        """Load steps that have begun over those that there may be."""
        step, *_ = process.last_words(directory / "samples.csv").split(",")
        if not step.isdecimal():
            return 0.0
        steps = len((directory / "load_steps.txt").read_text(encoding="ascii").split())
        return min(int(step) / steps, 1.0)


@dataclass(frozen=True)
class SingleGrainCase(GrainCase):
    """Cells of three grains, one for each scene; all scenes share grain contact and protocol."""

    scenes: tuple[Scene, ...]
    kind: ClassVar[str] = "cells"
    recipe: ClassVar[int] = 11

    @property
    def parameters(self) -> dict[str, Any]:
        """The scenes, but for what only the reading of the results depends on."""
        scenes = []
        for scene in self.scenes:
            scenes.append(scene.model_dump(mode="json", exclude=UNUSED))
        return {"scenes": scenes}

    @property
    def grain(self) -> Grain:
        """The grain whose contact law all cells have."""
        return self.scenes[0].grain

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        method = self.scenes[0].method.grains
        load_steps = np.log(1.02 / deck.START) / np.log1p(method.load_increment)
        return deck.cost_s(load_steps, 3 * len(self.scenes), REST, method, self.grain)

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains with their forces, and the load steps of the protocol."""
        shared = self.scenes[0]
        parameters = {
            **{
                "diameter": DIAMETER,
                "smallest": 1.0,
                "density": DENSITY,
                "gravity": GRAVITY,
            },
            **deck.protocol(
                shared.grain, shared.method.grains, shared.threshold.displacement
            ),
            # a grain that falls out of its cell never comes to rest
            "noise": 0.0,
            # no face, no ceiling, no crest: the planes lie far outside the box
            **{"slope": 0.0, "ceiling_x": 0.0, "ceiling_z": 1e3 * DIAMETER},
            "behind": 1e3 * DIAMETER,
        }
        rising = flows(self.scenes[0])
        pushes = np.zeros((len(rising), 3 * len(self.scenes), 2))
        for place, scene in enumerate(self.scenes):
            pushes[:, 3 * place + 2] = force(scene, rising) * WEIGHT / scene.weight
        deck.write(
            directory, self._grains(), parameters, rising, pushes, margin=4 * DIAMETER
        )

    def collect(self, directory: Path) -> None:
        """Check the run and write what each grain did to ``motion.csv``."""
        liggghts.check_log(directory)
        grains = self._grains()
        motion.check_rest(
            directory,
            grains,
            WEIGHT,
            self.scenes[0].method.grains.stiffness,
            all_rest=False,
        )
        criterion = self.scenes[0].threshold.displacement
        motion.read(directory, grains, criterion, falls_out=True).to_csv(
            directory, grains
        )

    def _grains(self) -> deck.GrainTable:
        centres, along, sizes = zip(
            *(cell(scene) for scene in self.scenes), strict=True
        )
        x, z = np.concatenate(centres).T * DIAMETER
        largest = np.concatenate(sizes).max()
        across = np.repeat(np.arange(len(centres)) * SPACING * largest * DIAMETER, 3)
        return deck.GrainTable(
            position=np.column_stack([x, across, z]),
            kind=np.tile([deck.FIXED, deck.FIXED, deck.COUNTED], len(centres)),
            along=np.repeat(along, 3, axis=0),
            sizes=np.concatenate(sizes),
            diameter=DIAMETER,
            density=DENSITY,
        )


def cell(scene: Scene) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Two neighbours and the grain: their centres, shape (3, 2), and sizes, in its diameter.

    Between them the unit vector up the slope, shape (2,).
    """
    alpha = np.radians(scene.bed.slope_deg)
    beta, apart = (
        np.radians(scene.pocket_angle_deg),
        (1 + 1 / scene.bed.relative_size) / 2,
    )
    along = np.array([np.cos(alpha), np.sin(alpha)])
    outward = np.array([-along[1], along[0]])
    behind, ahead = (
        apart * (side * np.cos(beta) * along - np.sin(beta) * outward)
        for side in (-1, 1)
    )
    neighbour = 1 / scene.bed.relative_size
    return (
        np.vstack([behind, ahead, [0.0, 0.0]]),
        along,
        np.array([neighbour, neighbour, 1.0]),
    )


def flows(scene: Scene) -> FloatArray:
    """Friction velocity of the settling and of each load step, over that of the closed form."""
    return deck.rising_flows(deck.START, LAST, scene.method.grains.load_increment)


def force(scene: Scene, rising: FloatArray) -> FloatArray:
    """Force of the flow on the scene's grain at such flows, N, shape (flows, 2)."""
    _, along, _ = cell(scene)
    ustar = rising * float(closed_form(scene).friction_velocity)
    drag, lift = (law(ustar) for law in forces(scene))
    return np.outer(drag, along) + np.outer(lift, [-along[1], along[0]])


def batches(scenes: Iterable[Scene]) -> Iterator[SingleGrainCase]:
    """Cases for the single-grain scenes of a study: those that can share a deck, in fixed blocks.

    The split depends on the study alone, never on what is left to do: a study that was interrupted
    must not differ from one that was not.
    """
    groups: dict[str, list[Scene]] = {}
    for scene in scenes:
        alike = scene.model_dump(
            mode="json", include={"grain", "threshold", "method"}, exclude=DIFFERENT
        )
        groups.setdefault(canonical_json(alike), []).append(scene)
    for _, group in sorted(groups.items()):
        members = sorted(group, key=lambda scene: scene.id)
        for start in range(0, len(members), BLOCK):
            yield SingleGrainCase(tuple(members[start : start + BLOCK]))
