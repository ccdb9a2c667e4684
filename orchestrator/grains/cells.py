"""Single grains on their two fixed neighbours: many cells, one case of LIGGGHTS.

In units of d, W and sqrt(d/g') a bed knows no scale, so the cells are models of one size: every
grain has the reference diameter, its forces are those of its own scene times the ratio of the
weights. The flow of the deck is the friction velocity over that of the closed form.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from orchestrator.grains import deck, motion, protocol, rest
from orchestrator.grains.case import GrainCase
from orchestrator.runs.files import canonical_json
from orchestrator.study.closed_form import closed_form, forces
from orchestrator.study.scene import Scene

FloatArray = NDArray[np.float64]

DIAMETER = 1e-3
DENSITY = 2500.0
GRAVITY = 9.81
WEIGHT = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY
"""The reference grain of a deck, SI; GRAVITY is its g'."""
LAST = 1.2
"""Flow of the last load step: a grain that still lies then contradicts the closed form by 20 %."""
SPACING = 3.0
"""Spacing of the cells across the flow, in diameters of the largest grain: grains of two cells
never meet."""
UNUSED = {"fractions", "final_fraction"}
"""Fields of the protocol that mean nothing to one grain."""
SCALED = {"diameter", "density", "sizes"}
"""Fields of the grain that a cell, whose grain is that of the deck, knows by its forces alone."""
BLOCK = 512
"""Most cells of a deck."""


@dataclass(frozen=True)
class SingleGrainCase(GrainCase):
    """Cells of three grains, one for each scene; all scenes share grain contact and protocol."""

    scenes: tuple[Scene, ...]
    kind: ClassVar[str] = "cells"
    recipe: ClassVar[int] = 7

    @property
    def parameters(self) -> dict[str, Any]:
        """The scenes, but for what only the reading of the results depends on."""
        hidden = {"protocol": UNUSED}
        return {"scenes": [scene.model_dump(mode="json", exclude=hidden) for scene in self.scenes]}

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        rules = self.scenes[0].protocol
        load_steps = np.log(1.02 / protocol.START) / np.log1p(rules.load_increment)
        return protocol.run_cost_s(load_steps, 3 * len(self.scenes), rules, self._grain.stiffness)

    @property
    def _grain(self) -> Any:
        return self.scenes[0].grain

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains with their forces, and the load steps of the protocol."""
        rules = self.scenes[0].protocol
        parameters = {
            "diameter": DIAMETER,
            "smallest": 1.0,
            "density": DENSITY,
            "gravity": GRAVITY,
            **protocol.contact(self._grain, rules),
            **protocol.raising(rules, enough=0),
            # no face, no ceiling, no crest: the planes lie far outside the box
            "slope": 0.0,
            "ceiling_x": 0.0,
            "ceiling_z": 1e3 * DIAMETER,
            "behind": 1e3 * DIAMETER,
        }
        rising = flows(self.scenes[0])
        force = self._forces(rising)
        deck.write(directory, self._grains(), parameters, rising, force, margin=4 * DIAMETER)

    def collect(self, directory: Path) -> None:
        """Check the run and write what each grain did to ``motion.csv``."""
        self.check(directory)
        grains = self._grains()
        marker = self.scenes[0].protocol.displacement_criterion
        rest.check(directory, grains, WEIGHT, self._grain.stiffness, all_rest=False)
        found = motion.read(directory, grains, marker, falls_out=True)
        found.to_csv(directory, grains)

    def _grains(self) -> deck.GrainTable:
        cells = [cell(scene) for scene in self.scenes]
        centres = np.concatenate([one[0] for one in cells]) * DIAMETER
        sizes = np.concatenate([one[2] for one in cells])
        across = np.repeat(np.arange(len(cells)) * SPACING * sizes.max() * DIAMETER, 3)
        return deck.GrainTable(
            position=np.column_stack([centres[:, 0], across, centres[:, 1]]),
            kind=np.tile([deck.FIXED, deck.FIXED, deck.COUNTED], len(cells)),
            along=np.repeat([one[1] for one in cells], 3, axis=0),
            sizes=sizes,
            diameter=DIAMETER,
            density=DENSITY,
        )

    def _forces(self, rising: FloatArray) -> FloatArray:
        """Force on each grain at each flow, shape (flows, 3 cells, 2); on neighbours none."""
        pushes = np.zeros((len(rising), 3 * len(self.scenes), 2))
        for place, scene in enumerate(self.scenes):
            pushes[:, 3 * place + 2] = force(scene, rising) * WEIGHT / scene.weight
        return pushes


def cell(scene: Scene) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Two neighbours and the grain: their centres, shape (3, 2), and sizes, in its diameter.

    Between them the unit vector up the slope, shape (2,).
    """
    alpha = np.radians(scene.bed.slope_deg)
    beta, apart = np.radians(scene.pocket_angle_deg), (1 + 1 / scene.bed.relative_size) / 2
    along = np.array([np.cos(alpha), np.sin(alpha)])
    outward = np.array([-along[1], along[0]])
    behind, ahead = (
        apart * (side * np.cos(beta) * along - np.sin(beta) * outward) for side in (-1, 1)
    )
    neighbour = 1 / scene.bed.relative_size
    return np.vstack([behind, ahead, [0.0, 0.0]]), along, np.array([neighbour, neighbour, 1.0])


def flows(scene: Scene) -> FloatArray:
    """Friction velocity of the settling and of each load step, over that of the closed form."""
    return protocol.flows(protocol.START, LAST, scene.protocol.load_increment)


def force(scene: Scene, rising: FloatArray) -> FloatArray:
    """Force of the flow on the scene's grain at such flows, N, shape (flows, 2)."""
    _, along, _ = cell(scene)
    ustar = rising * float(closed_form(scene).friction_velocity)
    drag, lift = (one(ustar) for one in forces(scene))
    return np.outer(drag, along) + np.outer(lift, [-along[1], along[0]])


def batches(scenes: Iterable[Scene]) -> Iterator[SingleGrainCase]:
    """Cases for the single-grain scenes of a study: those that can share a deck, in fixed blocks.

    The split depends on the study alone, never on what is left to do: a study that was interrupted
    must not differ from one that was not.
    """
    groups: dict[str, list[Scene]] = {}
    for scene in scenes:
        groups.setdefault(_shared_key(scene), []).append(scene)
    for key in sorted(groups):
        members = sorted(groups[key], key=lambda scene: scene.id)
        for start in range(0, len(members), BLOCK):
            yield SingleGrainCase(tuple(members[start : start + BLOCK]))


def _shared_key(scene: Scene) -> str:
    contact = scene.grain.model_dump(mode="json", exclude=SCALED)
    rules = scene.protocol.model_dump(mode="json", exclude=UNUSED)
    return canonical_json([contact, rules])
