"""Single grains on their two fixed neighbours: many cells in a case of LIGGGHTS.

In units of d, W and sqrt(d/g') a bed knows no scale, so the cells are models of one
size: every grain has the reference diameter, its forces are those of its own scene
times the ratio of the weights. The flow of the deck is the friction velocity over that
of the closed form.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from orchestrator.bed import deck
from orchestrator.bed.deck import DENSITY, DIAMETER, GRAVITY, WEIGHT, DeckCase
from orchestrator.grains import motion
from orchestrator.grains.forces import forces
from orchestrator.runs.files import canonical_json
from orchestrator.solvers.dem import ENGINE
from orchestrator.study.closed_form import closed_form
from orchestrator.study.parts import GrainPart
from orchestrator.study.scene import READ_LATER, Scene
from orchestrator.types import FloatArray

LAST = 1.2
"""Flow of the last load step: a grain that still lies then is 20 % off the closed
form."""
SPACING = 3.0
"""Spacing of the cells across the flow, in diameters of the largest grain: grains of
two cells never meet."""
UNUSED: dict[str, Any] = {
    **READ_LATER,
    "method": {"grains": {"final_fraction"}},
}
"""Fields of the protocol that mean nothing to one grain."""
DIFFERENT: dict[str, Any] = {
    "grain": {"diameter", "density", "sizes"},
    "threshold": {"fractions", "criterion"},
    "method": {"grains": {"final_fraction"}},
}
"""Fields that change the forces of a cell, and not its contacts."""
REST = 2.5
"""Mean time until the grains are at rest in a load step, sqrt(d/g')."""
BLOCK = 512
"""Most cells of a deck."""


class GrainCase(DeckCase):
    """A case that runs the deck ``in.bed``."""

    template: ClassVar[str] = f"{ENGINE.TEMPLATES}/bed"
    results: ClassVar[tuple[str, ...]] = (
        "settling.csv",
        "samples.csv",
        "passage.dump",
        "bed.dump",
    )
    derived: ClassVar[tuple[str, ...]] = ("load_steps.csv", "motion.csv")
    bulky: ClassVar[tuple[str, ...]] = ("passage.dump", "bed.dump")

    def share(self, directory: Path) -> float:
        """Load steps that have begun over those that there may be.

        Parameters
        ----------
        directory
            The case.

        Returns
        -------
        float
            The share of the work that is done.
        """
        begun = self.begun(directory)
        if not begun:
            return 0.0
        steps = len((directory / "load_steps.txt").read_text(encoding="ascii").split())
        return min(begun / steps, 1.0)


@dataclass(frozen=True)
class SingleGrainCase(GrainCase):
    """Cells of three grains, one for each scene.

    Attributes
    ----------
    scenes
        The scenes, which share contact and protocol.
    """

    scenes: tuple[Scene, ...]
    kind: ClassVar[str] = "cells"

    @property
    def parameters(self) -> dict[str, Any]:
        """The scenes, but for what only the reading of the results depends on."""
        values = [one.described(exclude=UNUSED) for one in self.scenes]
        return {"scenes": values}

    @property
    def grain(self) -> GrainPart:
        """The grain whose contact law all cells have."""
        return self.scenes[0].grain

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        method = self.scenes[0].method.grains
        load_steps = np.log(1.02 / deck.START) / np.log1p(method.load_increment)
        return deck.cost_s(load_steps, 3 * len(self.scenes), REST, method, self.grain)

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains with their forces, and the load steps of the protocol.

        Parameters
        ----------
        directory
            The case, a copy of the template.
        cases
            The directory of all cases.
        """
        shared = self.scenes[0]
        displacement = shared.threshold.displacement
        parameters = {
            "diameter": DIAMETER,
            "smallest": 1.0,
            "density": DENSITY,
            "gravity": GRAVITY,
            **deck.protocol(shared.grain, shared.method.grains, displacement),
            # a grain that falls out of its cell never comes to rest
            "noise": 0.0,
            # no face, no ceiling, no crest: the planes lie far outside the box
            "slope": 0.0,
            "ceiling_x": 0.0,
            "ceiling_z": 1e3 * DIAMETER,
            "behind": 1e3 * DIAMETER,
        }
        rising = cell_flows(self.scenes[0])
        pushes = np.zeros((len(rising), 3 * len(self.scenes), 2))
        for place, scene in enumerate(self.scenes):
            pushes[:, 3 * place + 2] = force(scene, rising) * WEIGHT / scene.weight
        grains = self._grains()
        deck.write_deck(
            directory, grains, parameters, rising, pushes, margin=4 * DIAMETER
        )

    def collect(self, directory: Path) -> None:
        """Check the run and write what each grain did to ``motion.csv``.

        Parameters
        ----------
        directory
            The case, after `Allrun`.
        """
        ENGINE.check_log(directory)
        grains = self._grains()
        stiffness = self.scenes[0].method.grains.stiffness
        motion.check_rest(directory, grains, WEIGHT, stiffness, all_rest=False)
        criterion = self.scenes[0].threshold.displacement
        moved = motion.read_motion(directory, grains, criterion, falls_out=True)
        moved.to_csv(directory, grains)

    def _grains(self) -> deck.GrainTable:
        """The grains of all cells."""
        cells = [cell(scene) for scene in self.scenes]
        centres = np.concatenate([each.centres for each in cells])
        sizes = np.concatenate([each.sizes for each in cells])
        x, z = centres.T * DIAMETER
        rows = np.arange(len(cells)) * SPACING * sizes.max() * DIAMETER
        return deck.GrainTable(
            position=np.column_stack([x, np.repeat(rows, 3), z]),
            kind=np.tile([deck.FIXED, deck.FIXED, deck.COUNTED], len(cells)),
            along=np.repeat([each.along for each in cells], 3, axis=0),
            sizes=sizes,
            diameter=DIAMETER,
            density=DENSITY,
        )


class Cell(NamedTuple):
    """Two neighbours and the grain, in diameters of the grain.

    Attributes
    ----------
    centres
        Their centres; shape (3, 2).
    along
        Unit vector up the slope; shape (2,).
    sizes
        Their sizes; shape (3,).
    """

    centres: FloatArray
    along: FloatArray
    sizes: FloatArray


def cell(scene: Scene) -> Cell:
    """Place a grain on its two neighbours.

    Parameters
    ----------
    scene
        The scene of the grain.

    Returns
    -------
    Cell
        The neighbours and the grain, which is at the origin.
    """
    alpha = np.radians(scene.bed.slope_deg)
    beta = np.radians(scene.pocket_angle_deg)
    neighbour = 1 / scene.bed.relative_size
    apart = (1 + neighbour) / 2
    along = np.array([np.cos(alpha), np.sin(alpha)])
    outward = np.array([-along[1], along[0]])
    behind = apart * (-1 * np.cos(beta) * along - np.sin(beta) * outward)
    ahead = apart * (np.cos(beta) * along - np.sin(beta) * outward)
    centres = np.vstack([behind, ahead, [0.0, 0.0]])
    return Cell(centres, along, np.array([neighbour, neighbour, 1.0]))


def cell_flows(scene: Scene) -> FloatArray:
    """List the flows of a deck.

    Parameters
    ----------
    scene
        The scene of a grain.

    Returns
    -------
    FloatArray
        Friction velocity of the settling and of each load step, over that of the closed
        form.
    """
    return deck.rising_flows(deck.START, LAST, scene.method.grains.load_increment)


def force(scene: Scene, rising: FloatArray) -> FloatArray:
    """Force of the flow on the grain of a scene.

    Parameters
    ----------
    scene
        The scene.
    rising
        Flows, as `cell_flows` gives them; shape (F,).

    Returns
    -------
    FloatArray
        The force, N; shape (F, 2).
    """
    along = cell(scene).along
    ustar = rising * float(closed_form(scene).friction_velocity)
    drag, lift = (law(ustar) for law in forces(scene))
    return np.outer(drag, along) + np.outer(lift, [-along[1], along[0]])


def batches(scenes: Iterable[Scene]) -> Iterator[SingleGrainCase]:
    """Make the cases for the single-grain scenes of a study.

    The split depends on the study alone, never on what is left to do: a study that was
    interrupted must not differ from one that was not.

    Parameters
    ----------
    scenes
        The scenes.

    Yields
    ------
    SingleGrainCase
        Scenes that can share a deck, in blocks of `BLOCK`.
    """
    groups: dict[str, list[Scene]] = {}
    for scene in scenes:
        alike = scene.described(
            include={"grain", "threshold", "method"}, exclude=DIFFERENT
        )
        groups.setdefault(canonical_json(alike), []).append(scene)
    for _, group in sorted(groups.items()):
        members = sorted(group, key=lambda scene: scene.digest)
        for start in range(0, len(members), BLOCK):
            yield SingleGrainCase(tuple(members[start : start + BLOCK]))
