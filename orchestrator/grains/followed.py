"""The run of a level strip whose grains are followed as they roll and hop.

The drag on each grain is that of its velocity relative to the fluid at its place. In
each load step a gust acts, then the mean flow; the motion of a grain is sustained that
comes `DISTANCE` downstream after the gust (docs/model.md, "Many grains, by DEM").
"""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from orchestrator import digits
from orchestrator.bed import deck
from orchestrator.bed.deck import DeckCase, GrainTable
from orchestrator.bed.packing import Packing
from orchestrator.bed.poured import PouredBed
from orchestrator.errors import SolverError
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.motion import MODES, Motion
from orchestrator.physics import saltation
from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.solvers.dem import ENGINE
from orchestrator.study.closed_form import single_grain
from orchestrator.study.criterion import sustaining
from orchestrator.study.scene import READ_LATER, Scene
from orchestrator.types import FloatArray

DISTANCE = 20.0
"""Way downstream after the gust from which on motion is sustained, d."""
LONGEST = 60.0
"""Time for which the mean flow acts after the gust, sqrt(d/g'): three times what a
grain in sustained motion needs in water for `DISTANCE`."""
PAUSE = 400.0
"""Longest time in which the grains come to rest between two load steps, sqrt(d/g'):
one that flies at 40 d sinks for 80."""
SETTLE = 20.0
"""Time in which the bed settles before the first load step, sqrt(d/g')."""
LOOK = 1.0
"""Time between two looks at the grains, sqrt(d/g')."""
REST_ENERGY = 1e-5
"""Kinetic energy of a mean grain below which the grains are at rest, W d."""
STILL_DRAG = 2.0
"""Drag of the still fluid in which they come to rest, m sqrt(g'/d)."""
MARGIN = 2.0
"""Room under the bed, d."""
ROOM = 40.0
"""Height of the box over the bed, d; no grain near its threshold hops so high."""
DROP = 5.0
"""Height over the highest centre of the bed from which grains are dropped, d."""
FIRST, LAST = 0.3, 4.0
"""Shields numbers of the first and of the last load step, over that at which the motion
of one grain is sustained by the table."""
STEPS = "steps.csv"
KEPT = "sustained.dump"
GRAIN_STEPS = 1.2e6
"""Grain-steps a second, measured on strips of 24 by 6 d."""
ACTIVE = 25.0
"""Mean time of a load step, sqrt(d/g')."""

MEANING = {
    "diameter": "d of the units below, m",
    "smallest": "diameter of the smallest grain that may move, d",
    "grain_density": "kg/m3",
    "fluid_density": "kg/m3",
    "added_mass": "of the fluid that a grain carries with it, of what it displaces",
    "viscosity": "kinematic, m2/s",
    "sand_grain": "equivalent sand-grain roughness of the bed, m",
    "acceleration": "of gravity, m/s2",
    "friction": "tan(phi)",
    "stiffness": "K d/W, normal and tangential",
    "damping": "ratio of a collision",
    "time_step": "sqrt(m/K)",
    "rest_energy": "kinetic energy of a mean grain below which is rest, W d",
    "look": "time between two looks, sqrt(d/g')",
    "settle": "time in which the bed settles before the first load step, sqrt(d/g')",
    "still_drag": "of the still fluid in which it settles, m sqrt(g'/d)",
    "gust": "friction velocity of the gust over that of the mean flow",
    "gust_time": "how long it lasts, sqrt(d/g')",
    "longest": "longest time for which the mean flow acts, sqrt(d/g')",
    "pause": "longest time in a still fluid between two load steps, sqrt(d/g')",
    "distance": "way after the gust from which on motion is sustained, d",
    "enough": "the end: the motion of so many counted grains has been sustained",
    "dropped": "grains that are dropped on the bed in each load step",
    "first_dropped": "id of the first of them",
    "balance": "1: the drags on all grains at rest add up to the stress on the bed",
    "level": "zero level of the flow where they need not, m",
    "ranks": "processes that share the grains; Allrun reads it",
}
"""Parameters of the deck, with their units."""
UNUSED: dict[str, Any] = {
    **READ_LATER,
    "threshold": True,
    "forces": True,
    "method": {"flow": True, "grains": {"final_fraction", "waiting_time"}},
}
"""Fields on which the run does not depend: it has a law of drag of its own."""


@dataclass(frozen=True)
class FollowedCase(DeckCase):
    """The run of LIGGGHTS of a level strip whose grains are followed.

    Attributes
    ----------
    scene
        A level strip of poured grains in gusts.
    """

    scene: Scene
    kind: ClassVar[str] = "followed"
    template: ClassVar[str] = f"{ENGINE.TEMPLATES}/followed"
    results: ClassVar[tuple[str, ...]] = ("settling.csv", "samples.csv", STEPS, KEPT)
    derived: ClassVar[tuple[str, ...]] = ("load_steps.csv", "motion.csv")

    @cached_property
    def geometry(self) -> Geometry:
        """Its bed."""
        return Geometry(self.scene)

    @property
    def needs(self) -> tuple[PouredBed, ...]:
        """The run that pours the bed."""
        return self.geometry.pouring

    def packing(self, cases: Path) -> Packing:
        """Read the grains of the strip, of the bed that is poured among the cases.

        Parameters
        ----------
        cases
            The directory of all cases.

        Returns
        -------
        Packing
            The grains, whose ends are one.
        """
        return Geometry(self.scene, cases).packing

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        asked = self.scene.described(exclude=UNUSED)
        asked["method"]["grains"]["final_fraction"] = self.scene.last_fraction
        return asked

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        method = self.scene.method.grains
        area = self.geometry.closed_length * self.geometry.bed.width
        grains = area * method.mobile_layers
        steps = ACTIVE * math.sqrt(method.stiffness) / method.time_step
        return 10 + len(self.flows) * grains * steps / GRAIN_STEPS

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
        return min(self.begun(directory) / len(self.flows), 1.0)

    @property
    def gust_time(self) -> float:
        """How long the gust lasts, sqrt(d/g')."""
        gusts = self.scene.flow.gusts
        return gusts.duration if gusts else 0.0

    @cached_property
    def flows(self) -> FloatArray:
        """Friction velocity of the mean flow in each load step, m/s."""
        unit = float(single_grain(self.scene).unit_ustar)
        (alone,) = sustaining(self.scene, 0.0, 1.0).tolist()
        rise = 1 + self.scene.method.grains.load_increment
        steps = digits.whole_up(math.log(LAST / FIRST) / 2 / math.log(rise))
        first = math.sqrt(FIRST * alone) * unit
        return digits.all_rounded(first * rise ** np.arange(steps + 1))

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains, the fluid, and the load steps.

        Parameters
        ----------
        directory
            The case, a copy of the template.
        cases
            The directory of all cases.
        """
        scene = self.scene
        bed = self.geometry.bed
        d = scene.grain.diameter
        packed = self.packing(cases)
        table = followed_table(scene, packed)
        length = self.geometry.closed_length
        dropped = bed.dropped_grains
        numbers: dict[str, float | int] = {
            "diameter": d,
            "smallest": min(float(packed.sizes[packed.mobile].min()), 1.0),
            "grain_density": scene.grain.density,
            "fluid_density": scene.fluid.density,
            "added_mass": saltation.ADDED_MASS,
            "viscosity": scene.fluid.viscosity,
            "sand_grain": SAND_GRAIN * bed.roughness,
            "acceleration": scene.fluid.gravity,
            "friction": math.tan(math.radians(scene.grain.friction_angle_deg)),
            "stiffness": scene.method.grains.stiffness,
            "damping": scene.method.grains.damping,
            "time_step": scene.method.grains.time_step,
            "rest_energy": REST_ENERGY,
            "look": LOOK,
            "settle": SETTLE,
            "still_drag": STILL_DRAG,
            "gust": math.sqrt(scene.gust),
            "gust_time": self.gust_time,
            "longest": LONGEST,
            "pause": PAUSE,
            "distance": DISTANCE,
            "enough": digits.whole_up(scene.last_fraction * packed.count),
            "dropped": dropped,
            "first_dropped": len(packed.sizes) + 1,
            "balance": 1,
            "level": 0.0,
            "ranks": self.ranks,
        }
        ENGINE.write_parameters(directory, numbers, MEANING)
        ENGINE.write_numbers(directory / "load_steps.txt", self.flows)
        places = packed.places.xyz
        bounds = np.array([places.min(axis=0) - MARGIN, places.max(axis=0) + ROOM])
        bounds[:, 0] = (0.0, length)
        bounds[:, 1] = (0.0, packed.width)
        falling = self._falling(places[:, 2].max(), length, packed.width)
        for axis, column in zip("xyz", falling.T, strict=True):
            # without any the deck still opens the files
            numbers_of_axis = column if dropped else np.zeros(1)
            ENGINE.write_numbers(directory / f"dropped.{axis}.txt", numbers_of_axis * d)
        in_order = np.argsort(places[:, 0], kind="stable")
        ENGINE.write_grains(
            directory,
            np.vstack([table.position, falling[:dropped] * d]),
            np.append(table.kind, np.full(dropped, deck.PUSHED)),
            np.append(packed.sizes, np.ones(dropped)) * d,
            scene.grain.density,
            bounds * d,
            np.append(in_order, len(places) + np.arange(dropped)),
        )

    def _falling(self, top: float, length: float, width: float) -> FloatArray:
        """Places of the dropped grains, d, of each load step one after the other."""
        bed = self.geometry.bed
        random = np.random.default_rng(bed.seed)
        count = bed.dropped_grains * len(self.flows)
        flat = random.uniform(size=(count, 2)) * [length, width]
        return np.column_stack([flat, np.full(count, top + DROP)])

    def collect(self, directory: Path) -> None:
        """Check the run, and write which counted grains kept moving to ``motion.csv``.

        Parameters
        ----------
        directory
            The case.

        Raises
        ------
        SolverError
            If grains were lost while the bed settled, or a load step has no frame.
        """
        ENGINE.check_log(directory)
        settling = directory / "settling.csv"
        if deck.read_table(settling)["grains"].nunique() > 1:
            what = "grains were lost before the flow rose"
            remedy = "another bed.seed, or softer springs (method.grains.stiffness)"
            raise SolverError(what, where=str(settling), remedy=remedy)
        table = followed_table(self.scene, self.packing(directory.parent))
        read_kept(directory, table).to_csv(directory, table)


def followed_table(scene: Scene, packed: Packing) -> GrainTable:
    """List the grains of the strip as the deck has them, but for dropped ones.

    Parameters
    ----------
    scene
        The scene.
    packed
        Its grains.

    Returns
    -------
    GrainTable
        The grains.
    """
    kind = np.select(
        [~packed.mobile, packed.windward], [deck.FIXED, deck.COUNTED], deck.MOBILE
    )
    return GrainTable(
        position=packed.places.xyz * scene.grain.diameter,
        kind=kind,
        along=np.tile([1.0, 0.0], (len(kind), 1)),
        sizes=packed.sizes,
        diameter=scene.grain.diameter,
        density=scene.grain.density,
        width=packed.width,
    )


def read_kept(directory: Path, grains: GrainTable) -> Motion:
    """Read in which load step the motion of each counted grain was first sustained.

    Parameters
    ----------
    directory
        The directory of the run.
    grains
        The grains of the deck.

    Returns
    -------
    Motion
        The motion under the mean flow of each load step.

    Raises
    ------
    SolverError
        If a load step has no frame.
    """
    steps = deck.read_table(directory / STEPS)
    frames, kept = ENGINE.read_frames(directory / KEPT, ("id", "way"))
    if len(frames) != len(steps):
        what = f"{len(steps)} load steps and {len(frames)} frames"
        raise SolverError(what, where=str(directory / KEPT), remedy="run it again")
    flow = steps["flow"].to_numpy()
    step_of = kept["step"].map({step: n + 1 for n, step in enumerate(frames)})
    first = step_of.groupby(kept["id"]).min()
    load_step = first.reindex(grains.counted_ids, fill_value=0).to_numpy(np.int64)
    never = np.zeros_like(load_step)
    mode = np.where(load_step > 0, MODES.index("rolled"), 0)
    rising = np.concatenate([flow[:1] * deck.SETTLE_FLOW, flow])
    return Motion(rising, load_step, never, never.astype(bool), mode)
