"""Grains thrown at poured beds by LIGGGHTS: how they rebound, and how many are trapped.

python tools/rebound.py DIRECTORY [RESTITUTION ...] > docs/measured/rebounds.csv

Each restitution has two beds of equal grains and `SHOTS` shots at each, in some ten minutes of one
core. The cases in DIRECTORY run by hand as they lie; those that are there are not run again. Each
row is a shot, in units of d and sqrt(g d): speed of the impact and its part normal to the bed, and
both of the flight upwards after it that is highest; they are empty where the grain makes none.
"""

import math
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from orchestrator.bed import poured
from orchestrator.bed.deck import DENSITY, DIAMETER, GRAVITY
from orchestrator.bed.line import BedLine
from orchestrator.bed.poured import PouredBed
from orchestrator.runs import engine
from orchestrator.runs.case import templates
from orchestrator.solvers.dem import ENGINE

RESTITUTIONS = (0.9, 0.55)
"""Of single grains of quartz, and as simulations of sand in bulk take it."""
FRICTION = 0.5
SEEDS = (1, 2)
SHOTS = 110
"""Shots at each bed."""
SPEEDS = (2.0, 25.0)
"""Least and largest speed, sqrt(g d); they are spread geometrically."""
ANGLES_DEG = (8.0, 75.0)
"""Least and largest angle with the bed; their sines are spread evenly."""
LENGTH, WIDTH, DEPTH = 9.0, 9.0, 4.0
"""Of the bed, d."""
OVERLAP = 0.02
"""Overlap of two grains in a head-on collision at the speed of the shot, d."""
TIME_STEP = 0.1
"""Time step, sqrt(m/K)."""
AFTER, WAY = 2.0, 8.0
"""Time after the impact for which a grain is followed, sqrt(d/g), and its way at the speed of the
impact, d: the smaller of the two."""
LOOK = 0.02
"""Way between two looks at the speed of the impact, d."""
FREE = 4
"""Looks without a contact that make a flight."""
NOISE = 1e-4
"""Change of the speed between two looks, over that of the impact, that is a contact."""

MEANING = {
    "diameter": "d, m",
    "density": "kg/m3",
    "gravity": "m/s2",
    "friction": "tan(phi)",
    "damping": "ratio of a collision",
    "time_step": "sqrt(m/K)",
    "shots": "lines of the tables",
    "ranks": "processes that share the grains; Allrun reads it",
}
"""Parameters of the deck, with their units."""


def damping(restitution: float) -> float:
    """The damping ratio of a restitution, of contacts that may not pull."""

    def excess(ratio: float) -> float:
        root = math.sqrt(1 - ratio**2)
        return math.exp(-ratio / root * (math.pi - 2 * math.asin(ratio))) - restitution

    return float(brentq(excess, 0.0, 0.999))


def bed_of(seed: int) -> PouredBed:
    """A level bed of equal grains with periodic sides."""
    line = BedLine((-1.0, 0.0, LENGTH, LENGTH + 1.0), (0.0, 0.0, 0.0, 0.0), 1.0)
    angle = math.degrees(math.atan(FRICTION))
    return PouredBed(line, DEPTH, 0.5, None, 1.0, angle, seed, WIDTH)


def shots_of(seed: int, top: float) -> pd.DataFrame:
    """Places, speeds and angles of the shots at a bed whose highest centre is at `top`, d."""
    random = np.random.default_rng(seed)
    part = random.permutation(np.arange(SHOTS) + 0.5) / SHOTS
    speed = SPEEDS[0] * (SPEEDS[1] / SPEEDS[0]) ** part
    sines = np.sin(np.radians(ANGLES_DEG))
    sine = random.uniform(*sines, SHOTS)
    stiffness = np.maximum((speed / OVERLAP) ** 2, 1e5)
    step = TIME_STEP / np.sqrt(stiffness)
    # a grain over the highest one falls by at most two diameters to its impact
    fall = 2 / (speed * sine)
    follow = np.minimum(WAY / speed, AFTER)
    return pd.DataFrame(
        {
            "speed": speed,
            "sine": sine,
            "x": random.uniform(2.0, LENGTH - 2.0, SHOTS),
            "y": random.uniform(0.0, WIDTH, SHOTS),
            "z": np.full(SHOTS, top + 1.05),
            "vy": speed * np.sqrt(1 - sine**2),
            "vz": -speed * sine,
            "stiffness": stiffness,
            "time_step": step,
            "steps": np.ceil((np.minimum(fall, 2.0) + follow) / step),
            "every": np.maximum(np.floor(LOOK / speed / step), 1),
        }
    )


def write(
    directory: Path, bed: pd.DataFrame, shots: pd.DataFrame, restitution: float
) -> None:
    """Write the case of the shots at a bed."""
    shutil.copytree(templates() / "liggghts/rebound", directory, symlinks=False)
    lines = {
        "diameter": DIAMETER,
        "density": DENSITY,
        "gravity": GRAVITY,
        "friction": FRICTION,
        "damping": damping(restitution),
        "time_step": TIME_STEP,
        "shots": len(shots),
        "ranks": 1,
    }
    text = ""
    for name, value in lines.items():
        text += f"variable        {name} equal {value!r}  # {MEANING[name]}\n"
    (directory / "parameters.liggghts").write_text(text, encoding="utf-8")
    velocity = math.sqrt(GRAVITY * DIAMETER)
    units = {
        "x": DIAMETER,
        "y": DIAMETER,
        "z": DIAMETER,
        "vy": velocity,
        "vz": velocity,
    }
    for name in ("x", "y", "z", "vy", "vz", "stiffness", "steps", "every"):
        values = (shots[name] * units.get(name, 1.0)).tolist()
        rows = "".join(f"{value:.9g}\n" for value in values)
        (directory / f"shot.{name}.txt").write_text(rows, encoding="utf-8")
    centres = bed[["x_over_d", "y_over_d", "z_over_d"]].to_numpy(float)
    low, high = centres.min(axis=0) - 3, centres.max(axis=0) + 3
    low[1], high[1] = 0.0, WIDTH
    high[2] += 12
    ENGINE.write_grains(
        directory,
        centres * DIAMETER,
        np.where(bed["fixed"] == 1, 1, 2),
        np.full(len(bed), DIAMETER),
        DENSITY,
        np.array([low, high]) * DIAMETER,
        np.arange(len(bed)),
    )


def flights(directory: Path, shots: pd.DataFrame) -> pd.DataFrame:
    """What became of each shot of a case: the impact, and the first flight upwards after it."""
    velocity, time = math.sqrt(GRAVITY * DIAMETER), math.sqrt(DIAMETER / GRAVITY)
    looks = pd.read_csv(directory / "flights.csv", comment="#")
    rows = []
    for number, shot in looks.groupby("shot"):
        speeds = shot[["vx", "vy", "vz"]].to_numpy(float) / velocity
        clock = shot["time"].to_numpy(float) / time
        height = shot["z"].to_numpy(float) / DIAMETER
        change = np.diff(speeds, axis=0)
        change[:, 2] += np.diff(clock)
        scale = float(shots["speed"][number - 1])
        is_free = np.linalg.norm(change, axis=1) < NOISE * scale
        row = {"shot": number}
        if not is_free.all():
            hit = int(np.argmin(is_free))
            before = speeds[hit]
            row |= {"speed": np.linalg.norm(before), "normal": -before[2]}
            free_looks = np.convolve(is_free[hit:], np.ones(FREE), "valid")
            starts = hit + np.flatnonzero(free_looks > FREE - 0.5)
            rising = starts[speeds[starts, 2] > 0]
            if len(rising):
                apex = height[rising] + speeds[rising, 2] ** 2 / 2
                first = rising[np.argmax(apex)]
                after = speeds[first]
                row |= {"speed_after": np.linalg.norm(after), "normal_after": after[2]}
                row |= {"along_after": after[1], "height_after": height[first]}
                row |= {"height": height[hit]}
        rows.append(row)
    return pd.DataFrame(rows)


def law(rows: pd.DataFrame) -> pd.DataFrame:
    """Fit the rebound law of each restitution: both ratios linear in the sine, least squares."""
    fits = []
    for restitution, part in rows.dropna().groupby("restitution"):
        sines = np.column_stack([np.ones(len(part)), -part["normal"] / part["speed"]])
        row = {"restitution": restitution, "rebounds": len(part)}
        for name, after in (("whole", "speed_after"), ("normal", "normal_after")):
            ratio = part[after] / part["speed"]
            fit, *_ = np.linalg.lstsq(sines, ratio, rcond=None)
            row |= {f"{name}_0": fit[0], f"{name}_1": fit[1]}
            row[f"{name}_sd"] = float(np.std(ratio - sines @ fit))
        fits.append(row)
    return pd.DataFrame(fits)


def main(directory: Path, restitutions: tuple[float, ...]) -> pd.DataFrame:
    """Throw at all beds, and collect the shots."""
    tables = []
    for seed in SEEDS:
        bed = bed_of(seed)
        if not (directory / bed.name / poured.BED).exists():
            engine.execute(bed, directory, 1200.0)
        grains = pd.read_csv(directory / bed.name / poured.BED)
        mobile = grains[grains["fixed"] == 0]
        top = float(mobile["z_over_d"].max())
        shots = shots_of(seed, top)
        for restitution in restitutions:
            case = directory / f"shots-{seed}-{restitution:g}"
            if not (case / "flights.csv").exists():
                write(case, grains, shots, restitution)
                subprocess.run(["./Allrun"], cwd=case, check=True)
            found = flights(case, shots).assign(seed=seed, restitution=restitution)
            tables.append(found)
    return pd.concat(tables, ignore_index=True)


if __name__ == "__main__":
    given = tuple(float(text) for text in sys.argv[2:]) or RESTITUTIONS
    rows = main(Path(sys.argv[1]), given)
    rows.to_csv(sys.stdout, index=False, float_format="%.5g")
    print(law(rows).to_string(index=False, float_format="%.3f"), file=sys.stderr)
