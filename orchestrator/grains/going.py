"""Grains that go on, by LIGGGHTS: a level strip without an end under gusts.

A strip of poured grains is cut to a whole number of diameters, and its two ends are
made one. The drag on each grain is that of its velocity relative to the fluid at its
place, so that a grain that is as fast as the fluid feels none. The flow is raised in
load steps; in each a gust acts, and a grain goes on that comes `DISTANCE` downstream
after it is over.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from orchestrator import digits
from orchestrator.bed import deck
from orchestrator.bed.deck import GrainTable
from orchestrator.bed.packing import Packing
from orchestrator.bed.poured import PouredBed
from orchestrator.errors import SolverError
from orchestrator.grains.loads import Geometry
from orchestrator.grains.motion import MODES, Motion
from orchestrator.physics import saltation
from orchestrator.physics.laws import SAND_GRAIN
from orchestrator.runs.case import Case
from orchestrator.solvers import liggghts
from orchestrator.study.scene import Scene
from orchestrator.types import FloatArray

DISTANCE = 20.0
"""Way downstream after the gust from which on a grain goes on, d."""
LONGEST = 60.0
"""Time for which the mean flow acts after the gust, sqrt(d/g'): three times what a
grain that goes on needs in water for `DISTANCE`."""
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
FIRST, LAST = 0.4, 4.0
"""Shields numbers of the first and of the last load step over the threshold of the
closed form."""
GOING = "going.csv"
GONE = "gone.dump"


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
    "distance": "way after the gust from which on a grain goes on, d",
    "enough": "the end: so many grains have gone on in one load step",
    "balance": "1: the drags on all grains at rest add up to the stress on the bed",
    "level": "zero level of the flow where they need not, m",
    "ranks": "processes that share the grains; Allrun reads it",
}
"""Parameters of the deck, with their units."""


def write_parameters(directory: Path, values: dict[str, float | int]) -> None:
    """Write ``parameters.liggghts`` of a deck ``in.going``.

    Parameters
    ----------
    directory
        The directory of the deck.
    values
        A number for each name of `MEANING`.
    """
    lines = []
    for name, meaning in MEANING.items():
        value = values[name]
        text = f"{value}" if isinstance(value, int) else digits.text(value)
        lines.append(f"variable        {name} equal {text}  # {meaning}\n")
    path = directory / "parameters.liggghts"
    path.write_text("".join(lines), encoding="utf-8")


@dataclass(frozen=True)
class GoingCase(Case):
    """The run of LIGGGHTS of the grains of a strip that go on.

    Attributes
    ----------
    scene
        A level strip of poured grains.
    """

    scene: Scene
    kind: ClassVar[str] = "going"
    template: ClassVar[str] = "liggghts/going"
    recipe: ClassVar[int] = 1
    results: ClassVar[tuple[str, ...]] = ("settling.csv", "samples.csv", GOING, GONE)
    derived: ClassVar[tuple[str, ...]] = ("load_steps.csv", "motion.csv")

    @cached_property
    def geometry(self) -> Geometry:
        """Its bed."""
        return Geometry(self.scene)

    @property
    def needs(self) -> tuple[PouredBed, ...]:
        """The run that pours the bed."""
        return self.geometry.pouring

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        unused = {"fluid": {"kind"}, "threshold": {"fractions"}}
        return self.scene.described(exclude=unused)

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        grains = self.geometry.length * self.geometry.bed.width * 5
        return 60 + 0.1 * grains * len(self.flows)

    def versions(self) -> dict[str, str]:
        """The programs that run the case, with their versions."""
        return liggghts.programs(self.ranks)

    @property
    def closed_form(self) -> float:
        """Shields number at which one grain goes on by the closed form."""
        scene = self.scene
        fluid = scene.fluid
        grains = saltation.Grains.of(
            scene.grain.diameter,
            density=scene.grain.density,
            fluid_density=fluid.density,
            viscosity=fluid.viscosity,
            roughness=scene.bed.roughness,
            gravity=fluid.gravity,
        )
        found = saltation.under_gust(grains, scene.gust, self.gust_time)
        return float(found[0])

    @property
    def gust_time(self) -> float:
        """How long the gust lasts, sqrt(d/g')."""
        gusts = self.scene.flow.gusts
        return gusts.duration if gusts else 0.0

    @cached_property
    def flows(self) -> FloatArray:
        """Friction velocity of each load step, m/s."""
        scene = self.scene
        excess = scene.grain.density / scene.fluid.density - 1
        unit = math.sqrt(excess * scene.fluid.gravity * scene.grain.diameter)
        first = math.sqrt(FIRST * self.closed_form) * unit
        rise = 1 + scene.method.grains.load_increment
        steps = digits.whole_up(math.log(LAST / FIRST) / 2 / math.log(rise))
        return digits.all_rounded(first * rise ** np.arange(steps + 1))

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains, the fluid, and the load steps."""
        scene = self.scene
        d = scene.grain.diameter
        packed = Geometry(scene, cases).packing
        numbers: dict[str, float | int] = {
            "diameter": d,
            "smallest": float(packed.sizes[packed.mobile].min()),
            "grain_density": scene.grain.density,
            "fluid_density": scene.fluid.density,
            "added_mass": saltation.ADDED_MASS,
            "viscosity": scene.fluid.viscosity,
            "sand_grain": SAND_GRAIN * scene.bed.roughness,
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
            "balance": 1,
            "level": 0.0,
            "ranks": self.ranks,
        }
        write_parameters(directory, numbers)
        deck.write_numbers(directory / "load_steps.txt", self.flows)
        places = packed.places.xyz
        bounds = np.array([places.min(axis=0) - MARGIN, places.max(axis=0) + ROOM])
        bounds[:, 0] = (0.0, self.geometry.joined_length)
        bounds[:, 1] = (0.0, packed.width)
        deck.write_grains(
            directory,
            places * d,
            np.where(packed.mobile, 2, 1),
            packed.sizes * d,
            scene.grain.density,
            bounds * d,
            np.argsort(places[:, 0], kind="stable"),
        )

    def collect(self, directory: Path) -> None:
        """Check the run, and write when grains went on to ``motion.csv``."""
        liggghts.check_log(directory)
        settling = directory / "settling.csv"
        if deck.read_table(settling)["grains"].nunique() > 1:
            what = "grains were lost before the flow rose"
            remedy = "another bed.seed, or softer springs (method.grains.stiffness)"
            raise SolverError(what, where=str(settling), remedy=remedy)
        packed = Geometry(self.scene, directory.parent).packing
        grains = _table(self.scene, packed)
        flow = deck.read_table(directory / GOING)["flow"].to_numpy(float)
        frames, rows = deck.read_dump(directory / GONE, ("id", "way"))
        step = np.searchsorted(frames, rows["step"]) + 1
        first = pd.Series(step).groupby(rows["id"].to_numpy()).min()
        level = first.reindex(grains.counted_ids, fill_value=0).to_numpy(np.int64)
        never = np.zeros_like(level)
        motion = Motion(
            flow=np.append(deck.SETTLE_FLOW * flow[0], flow),
            level=level,
            fallen=never,
            carried=never > 0,
            mode=np.where(level > 0, MODES.index("lifted"), 0),
        )
        motion.to_csv(directory, grains)


def _table(scene: Scene, packed: Packing) -> GrainTable:
    """The grains of the deck."""
    kind = np.where(packed.mobile, deck.MOBILE, deck.FIXED)
    return GrainTable(
        position=packed.places.xyz * scene.grain.diameter,
        kind=np.where(packed.windward, deck.COUNTED, kind),
        along=np.tile([1.0, 0.0], (len(kind), 1)),
        sizes=packed.sizes,
        diameter=scene.grain.diameter,
        density=scene.grain.density,
        width=packed.width,
    )
