"""Grains that go on, by LIGGGHTS: the part of a bed that does, against the stress of the flow.

python tools/going.py DIRECTORY [NAME[:SEED] ...]

A strip of poured grains is cut to a whole number of diameters, and its two ends are made one. The
drag on each grain is that of its velocity relative to the fluid at its place, so that a grain that
is as fast as the fluid feels none. The flow is raised in load steps; in each a gust acts, and a
grain goes on that comes `DISTANCE` downstream after it is over (docs/model.md, "Many grains, by
DEM"). The template is in the folder `going` beside this file.

Each of the `SETS` has as many strips as there are `SEEDS`, of some 240 exposed grains, in three to
ten minutes of one core each. The cases in DIRECTORY run by hand as they lie; those that are done
are not run again. The load steps of the strips that are asked for, by default of all, take the place
of theirs in `TABLE`; then the figure is drawn anew. Without a DIRECTORY it is drawn alone.
"""

import math
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas
from scipy.spatial import cKDTree

from orchestrator import digits
from orchestrator.bed import deck
from orchestrator.bed.packing import Packing, Places, unshadowed
from orchestrator.bed.poured import BED, LAYER, PouredBed
from orchestrator.errors import SolverError
from orchestrator.grains.loads import Geometry
from orchestrator.physics import saltation
from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.physics.curves import iversen_white, soulsby_whitehouse
from orchestrator.physics.grain import Grain
from orchestrator.report import style
from orchestrator.runs import case as cases
from orchestrator.runs import engine
from orchestrator.runs.case import Case
from orchestrator.solvers.dem import ENGINE
from orchestrator.study.closed_form import single_grain
from orchestrator.study.scene import Scene
from orchestrator.types import BoolArray, FloatArray

DOCS = Path(__file__).parents[1] / "docs"
TABLE = DOCS / "measured" / "going.csv"
"""A row for each load step."""
FIGURE = DOCS / "figures" / "going.svg"
DRAWN = ("air 0.25 mm", "air 0.5 mm", "water 1 mm", "water 5 mm")
FIELD = (0.0110, 0.0129)
"""Thresholds of Martin and Kok 2018 at 0.40 to 0.53 mm, drawn in air at 0.5 mm."""
SEEDS = (1, 2, 3)
AIR = {"density": 1.2, "viscosity": 1.5e-5}
WATER = {"density": 1000.0, "viscosity": 1e-6}
GUST = {"intensity": 0.4, "events": 100}
LIMIT_S = 7200.0
FINE, COARSE = 0.05, 0.15
"""Rise of the friction velocity from one load step to the next: in air a whole bed starts at once."""
SETS: dict[str, dict[str, Any]] = {
    "air 0.25 mm": {"fluid": AIR, "diameter": 2.5e-4, "step": FINE, "duration": 10.0},
    "air 0.5 mm": {"fluid": AIR, "diameter": 5e-4, "step": FINE, "duration": 10.0},
    "water 1 mm": {"fluid": WATER, "diameter": 1e-3, "step": COARSE, "duration": 10.0},
    "water 5 mm": {"fluid": WATER, "diameter": 5e-3, "step": COARSE, "duration": 10.0},
    "air 0.25 mm, gust 30": {
        "fluid": AIR,
        "diameter": 2.5e-4,
        "step": FINE,
        "duration": 30.0,
    },
    "water 1 mm, damped": {
        "fluid": WATER,
        "diameter": 1e-3,
        "step": COARSE,
        "duration": 10.0,
        "damping": 0.4,
    },
}
"""Fluid, diameter (m), duration of the gust (sqrt(d/g')) and damping ratio of a collision."""
OVERLAP = 0.02
"""Overlap of two grains where the ends of a strip meet, from which on one is left
out, d: springs open a smaller one while the bed settles."""
DISTANCE = 20.0
"""Way downstream after the gust from which on a grain goes on, d."""
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
    template: ClassVar[str] = "../tools/going"
    results: ClassVar[tuple[str, ...]] = ("settling.csv", "samples.csv", GOING, GONE)

    @cached_property
    def geometry(self) -> Geometry:
        """Its bed."""
        return Geometry(self.scene)

    @property
    def needs(self) -> tuple[PouredBed, ...]:
        """The run that pours the bed."""
        return self.geometry.pouring

    @property
    def length(self) -> float:
        """Length of the strip whose ends are one, a whole number of d."""
        return float(math.floor(self.geometry.length + digits.SLACK))

    def packing(self, cases: Path) -> Packing:
        """The strip, of the bed that is poured among the cases."""
        (bed,) = self.geometry.pouring
        layers = self.scene.method.grains.mobile_layers
        rules = (self.geometry.surface, layers, self.geometry.bed.width)
        return joined(cases / bed.name, self.length, *rules)

    @property
    def parameters(self) -> dict[str, Any]:
        """The scene, but for what only the reading of the results depends on."""
        unused = {"fluid": {"kind"}, "threshold": {"fractions", "criterion"}}
        return self.scene.described(exclude=unused)

    @property
    def cost_s(self) -> float:
        """Expected time of one core, s."""
        grains = self.length * self.geometry.bed.width * 5
        return 60 + 0.1 * grains * len(self.flows)

    def versions(self) -> dict[str, str]:
        """The programs that run the case, with their versions."""
        return ENGINE.programs(self.ranks)

    @property
    def closed_form(self) -> float:
        """Shields number at which one grain goes on by the closed form."""
        scene = self.scene
        grains = single_grain(scene).flat
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
        unit = float(single_grain(scene).unit_ustar)
        first = math.sqrt(FIRST * self.closed_form) * unit
        rise = 1 + scene.method.grains.load_increment
        steps = digits.whole_up(math.log(LAST / FIRST) / 2 / math.log(rise))
        return digits.all_rounded(first * rise ** np.arange(steps + 1))

    def write(self, directory: Path, cases: Path) -> None:
        """Write the grains, the fluid, and the load steps."""
        scene = self.scene
        d = scene.grain.diameter
        packed = self.packing(cases)
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
        ENGINE.write_numbers(directory / "load_steps.txt", self.flows)
        places = packed.places.xyz
        bounds = np.array([places.min(axis=0) - MARGIN, places.max(axis=0) + ROOM])
        bounds[:, 0] = (0.0, self.length)
        bounds[:, 1] = (0.0, packed.width)
        ENGINE.write_grains(
            directory,
            places * d,
            np.where(packed.mobile, 2, 1),
            packed.sizes * d,
            scene.grain.density,
            bounds * d,
            np.argsort(places[:, 0], kind="stable"),
        )

    def collect(self, directory: Path) -> None:
        """Check the run."""
        ENGINE.check_log(directory)
        settling = directory / "settling.csv"
        if deck.read_table(settling)["grains"].nunique() > 1:
            what = "grains were lost before the flow rose"
            remedy = "another bed.seed, or softer springs (method.grains.stiffness)"
            raise SolverError(what, where=str(settling), remedy=remedy)


def joined(
    directory: Path, length: float, surface: float, layers: int, width: float
) -> Packing:
    """Read a strip of a finished case `PouredBed`, and make its two ends one.

    Where grains of both ends overlap, those that overlap most are left out.

    Parameters
    ----------
    directory
        The directory of the case.
    length
        Length of the strip from x = 0, d; a whole number, as the fixed grains are d
        apart.
    surface
        Height of the highest centres over the level bed, d.
    layers
        Layers that may move.
    width
        Width of the strip, d.

    Returns
    -------
    Packing
        The mobile grains, of which the exposed ones are counted, and a layer under
        them.
    """
    bed = deck.read_table(directory / BED)
    xyz = bed[["x_over_d", "y_over_d", "z_over_d"]].to_numpy(float)
    is_within = (xyz[:, 0] >= 0) & (xyz[:, 0] < length)
    is_within &= surface - xyz[:, 2] < (layers + 1.5) * LAYER
    xyz = xyz[is_within]
    sizes = bed["size"].to_numpy(float)[is_within]
    is_floor = bed["fixed"].to_numpy(bool)[is_within]
    sides = np.array([length, width])
    xyz[:, :2] = np.mod(xyz[:, :2], sides)
    kept = _without_overlaps(xyz, sizes, is_floor, sides)
    xyz = xyz[kept]
    sizes = sizes[kept]
    is_near_top = surface - xyz[:, 2] < (layers - 0.5) * LAYER
    mobile = is_near_top & ~is_floor[kept]
    flat = np.column_stack([xyz[:, 0], np.zeros(len(xyz))])
    places = Places.of(flat, xyz[:, 1], width)
    exposed = unshadowed(places, xyz[:, 2], sizes / 2) & mobile
    return Packing(
        centres=xyz[:, [0, 2]],
        sizes=sizes,
        mobile=mobile,
        windward=exposed,
        lee=np.zeros_like(exposed),
        arc_length=xyz[:, 0],
        across=xyz[:, 1],
        width=width,
    )


def _without_overlaps(
    xyz: FloatArray, sizes: FloatArray, is_floor: BoolArray, sides: FloatArray
) -> BoolArray:
    """Which grains are left where the ends of a strip meet; the whole floor is."""
    tree = cKDTree(xyz, boxsize=np.append(sides, 0.0))
    first, second = tree.query_pairs(float(sizes.max()), output_type="ndarray").T
    apart = xyz[second] - xyz[first]
    is_across = np.abs(apart[:, 0]) > sides[0] / 2
    apart[:, :2] -= sides * np.round(apart[:, :2] / sides)
    overlap = (sizes[first] + sizes[second]) / 2 - np.linalg.norm(apart, axis=1)
    overlap = np.where(is_across & (overlap > OVERLAP), overlap, 0.0)
    kept = np.ones(len(sizes), bool)
    while True:
        total = np.bincount(first, overlap, len(sizes))
        total += np.bincount(second, overlap, len(sizes))
        total[is_floor] = 0.0
        worst = int(np.argmax(digits.all_rounded(total)))
        if not total[worst]:
            return kept
        kept[worst] = False
        overlap[(first == worst) | (second == worst)] = 0.0


def scene_of(given: dict[str, Any], seed: int) -> Scene:
    """The strip of one of the sets."""
    d = given["diameter"]
    parts = {
        "fluid": given["fluid"],
        "grain": {
            "diameter": d,
            "density": 2650.0,
            "sizes": {"sigma_g": 1.3},
        },
        "bed": {
            "kind": "pile",
            "shape": "flat",
            "length": 24 * d,
            "width": 6.0,
            "packing": "poured",
            "poured_depth": 5.0,
            "roughness": d / 30,
            "seed": seed,
        },
        "flow": {"gusts": {**GUST, "duration": given["duration"]}},
        "threshold": {"fractions": [0.01, 0.03, 0.1]},
        "method": {
            "kind": "dem",
            "flow": {"model": "flat"},
            "grains": {
                "damping": given.get("damping", 0.1),
                "load_increment": given["step"],
                "final_fraction": 0.3,
            },
        },
    }
    return Scene.model_validate(parts)


def run(case: GoingCase, directory: Path) -> pd.DataFrame:
    """Run a case, if it is not done, and read its load steps."""
    for each in (*case.needs, case):
        if cases.done_state(each, directory) is None:
            engine.execute(each, directory, LIMIT_S)
    steps = pd.read_csv(directory / case.name / GOING, comment="#")
    scene = case.scene
    d = scene.grain.diameter
    grain = single_grain(scene)
    exposed = case.packing(directory).count
    return pd.DataFrame(
        {
            "seed": scene.bed.seed,
            "galileo": float(grain.galileo),
            "density_ratio": float(grain.density_ratio),
            "shields": grain.shields(steps["flow"]),
            "closed_form": case.closed_form,
            "exposed": exposed,
            "moved": steps["moved"],
            "went_on": steps["went_on"],
            "level": steps["level"] / d,
            "gust_level": steps["gust_level"] / d,
            "time": steps["time"],
        }
    )


def asked(texts: list[str]) -> list[tuple[str, int]]:
    """Names and seeds of the strips that are asked for."""
    strips = []
    for text in texts or list(SETS):
        name, _, seed = text.partition(":")
        seeds = (int(seed),) if seed else SEEDS
        strips += [(name, each) for each in seeds]
    return strips


def main(directory: Path, strips: list[tuple[str, int]]) -> pd.DataFrame:
    """Run strips, and put their load steps into the table."""
    directory.mkdir(parents=True, exist_ok=True)
    table = pd.read_csv(TABLE)
    for name, seed in strips:
        rows = run(GoingCase(scene_of(SETS[name], seed)), directory)
        rows.insert(0, "set", name)
        former = (table["set"] == name) & (table["seed"] == seed)
        table = pd.concat([table[~former], rows])
        print(name, seed, file=sys.stderr)
    return table.sort_values(["set", "seed", "shields"], ignore_index=True)


def measured(name: str) -> float:
    """The measured threshold of a set, by a curve: of wind tunnels, or of flumes."""
    given = SETS[name]
    d = np.array(given["diameter"])
    fluid = given["fluid"]
    grain = Grain(
        diameter=d,
        density=2650.0,
        fluid_density=fluid["density"],
        viscosity=fluid["viscosity"],
    )
    if fluid is AIR:
        return float(grain.shields(iversen_white(grain)))
    return float(soulsby_whitehouse(grain.dimensionless_diameter))


def draw(table: pd.DataFrame) -> Canvas:
    """Draw the part that goes on against the stress, a panel for each set."""
    canvas = style.canvas(4.6)
    axes = canvas.subplots(2, 2, sharey=True)
    for ax, name in zip(axes.flat, DRAWN, strict=True):
        rows = table[table["set"] == name]
        for _, strip in rows.groupby("seed"):
            part = 100 * strip["went_on"] / strip["exposed"]
            ax.plot(strip["shields"], part, "o-", color="#0072b2", ms=3)
        alone = rows["closed_form"].iloc[0]
        one = ax.axvline(alone, color="#c24e00", label="one grain, closed form")
        curved = measured(name)
        curve = ax.axvline(curved, color="0.3", ls="--", label="measured, curve")
        if name == "air 0.5 mm":
            label = "measured, three sites in the field"
            field = ax.axvspan(*FIELD, color="0.88", zorder=0, label=label)
        ax.set(title=name, xscale="log")
        style.plain_ticks(ax.xaxis)
    for ax in axes[:, 0]:
        ax.set_ylabel("grains in sustained motion, %")
    for ax in axes[1]:
        ax.set_xlabel("Shields number $θ$")
    style.legends_below(canvas, [one, curve, field], [])
    return canvas


if __name__ == "__main__":
    if sys.argv[1:]:
        found = main(Path(sys.argv[1]), asked(sys.argv[2:]))
        found.to_csv(TABLE, index=False, float_format="%.5g")
    with style.settings():
        FIGURE.write_bytes(style.svg(draw(pd.read_csv(TABLE))))
