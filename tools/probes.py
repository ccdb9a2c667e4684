"""The solver of sustained motion beside LIGGGHTS: spheres that roll and hop over the same fixed beds.

python tools/probes.py DIRECTORY > docs/measured/probes.csv

At each of the `POINTS` of the table of sustained motion the same spheres are laid at the same places of the
same beds (`tools/rolling.py`), at three stresses around its threshold. The solver and LIGGGHTS
(`templates/liggghts/probes`) follow them: 30 d in the gust, then 20 d in the mean flow. A row is a point and a
stress: how many came the first way, how many both, by each. The cases in DIRECTORY run by hand as they lie;
those that are there are not run again. A case takes 10 to 60 s of one core.
"""

import math
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.physics import rolling as table
from orchestrator.physics import saltation
from orchestrator.physics.constants import GRAVITY, SAND_GRAIN
from orchestrator.physics.grain import Grain
from orchestrator.physics.gusts import PEAK
from orchestrator.runs.case import templates
from orchestrator.solvers.dem import ENGINE
from orchestrator.tables import csv
from orchestrator.types import BoolArray, FloatArray, Row

sys.path.insert(0, str(Path(__file__).parent))
import rolling  # a tool beside this one

POINTS = (
    # Galileo number, density ratio, slope
    (127.0, 2.65, 0.0),
    (1420.0, 2.65, 0.0),
    (20.0, 2.65, 0.0),
    (38.8, 2200.0, 0.0),
    (127.0, 2.65, 20.0),
    (127.0, 2.65, -20.0),
)
"""Sand of 1, 5 and 0.3 mm in water, of 0.25 mm in air, and 1 mm in water on two slopes."""
STRESSES = (0.85, 1.0, 1.18)
"""Stresses over that of the threshold."""
SEEDS = (1,)
COUNT = 96
"""Spheres over each bed."""
DIAMETER, DENSITY = 1e-3, 2650.0
"""Of the spheres, in m and kg/m3: in units of these a point has no scale."""
ROOM = 60.0
"""Height of the box over the bed, d."""
LOOK_WAY = 4.0
"""Way of a sphere as fast as the fluid at its centre between two looks, d, at least."""
FIXED, SPHERE = 1, 4
WAYS = "ways.dump"
MEANING = {
    "diameter": "of the spheres and of the bed, m",
    "grain_density": "kg/m3",
    "fluid_density": "kg/m3",
    "added_mass": "of the fluid that a sphere carries with it, of what it displaces",
    "viscosity": "kinematic, m2/s",
    "sand_grain": "equivalent sand-grain roughness of the bed, m",
    "acceleration": "of gravity, m/s2",
    "slope": "of the bed, up which the flow goes, degrees",
    "friction": "tan(phi)",
    "stiffness": "K d/W, normal and tangential",
    "damping": "ratio of a collision: nothing rebounds",
    "time_step": "sqrt(m/K)",
    "gust": "friction velocity of the gust, m/s",
    "mean": "friction velocity of the mean flow, m/s",
    "gust_level": "zero level in the gust, m",
    "mean_level": "zero level in the mean flow, m",
    "first": "way in the gust, d",
    "last": "way after which a sphere is not followed further, d",
    "look": "time between two looks, sqrt(d/g')",
    "slow": "speed of a sphere that has stopped, sqrt(g' d)",
    "longest": "longest time, sqrt(d/g')",
    "ranks": "processes that share the grains; Allrun reads it",
}
"""Parameters of the deck, with their units."""
CONTACT = {
    "friction": rolling.FRICTION,
    "stiffness": 1e3,
    "damping": 3.0,
    "time_step": 0.02,
}
"""At this damping a collision keeps 2.4 % of its speed. The spin of a sphere that lies on three others is damped by
each of them: a step of 0.1 of so stiff a dashpot throws it off the bed."""
DEEPEST = 2.5
"""Depth under the highest sphere of the bed to which the deck has it, d: none is touched further down."""


class Stress(NamedTuple):
    """Shields numbers of the gust and of the mean flow."""

    gust: float
    mean: float


def threshold(sphere: rolling.Sphere) -> tuple[float, float]:
    """Shields numbers of the table: of the mean flow at the threshold, and of the least gust."""
    grain = Grain.of_numbers(
        sphere.galileo, sphere.density_ratio, slope_deg=sphere.slope_deg
    )
    found = table.sustained(grain.flat)
    return float(found.initiation(PEAK)[0]), float(found.start[0])


def laid(bed: rolling.Bed) -> FloatArray:
    """Centres of the spheres where each touches the bed from above, d, as the solver lays them."""
    places = bed.places(COUNT)
    apart = places[:, None] - bed.centres[None, :, :2]
    apart -= np.round(apart / bed.sides) * bed.sides
    room = ((1 + bed.sizes) / 2) ** 2 - (apart**2).sum(axis=2)
    top = bed.centres[:, 2] + np.sqrt(np.maximum(room, 0))
    return np.column_stack([places, np.where(room > 0, top, -np.inf).max(axis=1)])


def by_solver(
    sphere: rolling.Sphere, bed: rolling.Bed, stress: Stress
) -> tuple[BoolArray, BoolArray]:
    """Which spheres come the first way, and which both."""
    first, then = rolling.ways(sphere, [bed], stress, COUNT, then=rolling.WAYS[1])
    has_started = first >= sphere.first
    return has_started, has_started & (then >= rolling.WAYS[1])


def by_liggghts(
    directory: Path, sphere: rolling.Sphere, bed: rolling.Bed, stress: Stress
) -> tuple[BoolArray, BoolArray]:
    """The same by LIGGGHTS, in a case of its own."""
    if not (directory / WAYS).exists():
        shutil.rmtree(directory, ignore_errors=True)
        write(directory, sphere, bed, stress)
        subprocess.run(["./Allrun"], cwd=directory, check=True)
    _, rows = ENGINE.read_frames(directory / WAYS, ("id", "way"))
    way = np.full(COUNT, np.inf)
    # a sphere that is lost has flown out of the box
    way[rows["id"].to_numpy(int) - 1] = rows["way"] / DIAMETER
    return way >= sphere.first, way >= sphere.first + rolling.WAYS[1]


def write(
    directory: Path, sphere: rolling.Sphere, bed: rolling.Bed, stress: Stress
) -> None:
    """Write a case of LIGGGHTS."""
    shutil.copytree(templates() / "liggghts/probes", directory, symlinks=False)
    s = sphere.density_ratio
    unit = math.sqrt((s - 1) * GRAVITY * DIAMETER)
    levels = [sphere.level(bed, each, math.inf) * DIAMETER for each in stress]
    height = 0.8
    speed = float(sphere.speed(np.array(height), stress.mean, math.inf))
    numbers = {
        "diameter": DIAMETER,
        "grain_density": DENSITY,
        "fluid_density": DENSITY / s,
        "added_mass": saltation.ADDED_MASS,
        "viscosity": unit * DIAMETER / sphere.galileo,
        "sand_grain": SAND_GRAIN * sphere.roughness * DIAMETER,
        "acceleration": GRAVITY,
        "slope": sphere.slope_deg,
        **CONTACT,
        "gust": math.sqrt(stress.gust) * unit,
        "mean": math.sqrt(stress.mean) * unit,
        "gust_level": levels[0],
        "mean_level": levels[1],
        "first": sphere.first,
        "last": sphere.first + rolling.WAYS[1],
        "look": max(LOOK_WAY, 1 / speed),
        "slow": 0.002,
        "longest": 200 + 500 / speed,
        "ranks": 1,
    }
    ENGINE.write_parameters(directory, numbers, MEANING)
    heights = bed.centres[:, 2]
    touched = bed.centres[heights > heights.max() - DEEPEST]
    places = np.vstack([laid(bed), touched])
    kind: NDArray[np.int64] = np.repeat([SPHERE, FIXED], [COUNT, len(touched)])
    bounds = np.array([[0, 0, places[:, 2].min() - 2], [*bed.sides, ROOM]])
    ENGINE.write_grains(
        directory,
        places * DIAMETER,
        kind,
        np.full(len(places), DIAMETER),
        DENSITY,
        bounds * DIAMETER,
        np.arange(len(places)),
    )


def rows(directory: Path) -> Iterator[Row]:
    """Compare both at each point and stress."""
    over = rolling.beds(directory, SEEDS)
    for galileo, density_ratio, slope in POINTS:
        sphere = rolling.Sphere(galileo, density_ratio, slope)
        shields, least_gust = threshold(sphere)
        for factor in STRESSES:
            mean = factor * shields
            # as in the table: a gust that starts less than half of the spheres decides nothing
            stress = Stress(max(PEAK * mean, factor * least_gust), mean)
            ours, theirs = [], []
            for bed in over:
                name = f"{galileo:g}-{density_ratio:g}-{slope:g}-{factor:g}-{bed.seed}"
                ours.append(by_solver(sphere, bed, stress))
                theirs.append(by_liggghts(directory / name, sphere, bed, stress))
            solver, liggghts = (
                np.hstack([*map(np.array, each)]) for each in (ours, theirs)
            )
            yield {
                "galileo": galileo,
                "density_ratio": density_ratio,
                "slope_deg": slope,
                "shields": mean,
                "over_threshold": factor,
                "spheres": solver.shape[1],
                "started_solver": int(solver[0].sum()),
                "started_liggghts": int(liggghts[0].sum()),
                "sustained_solver": int(solver[1].sum()),
                "sustained_liggghts": int(liggghts[1].sum()),
                "same": int((solver[1] == liggghts[1]).sum()),
            }
            print(galileo, density_ratio, slope, factor, file=sys.stderr)


if __name__ == "__main__":
    sys.stdout.write(csv(pd.DataFrame(rows(Path(sys.argv[1])))))
