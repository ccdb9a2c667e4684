"""The exponent of hiding on poured strips of sand, by the definitions of a class's threshold.

python tools/hiding.py DIRECTORY [STRIPS] > docs/measured/hiding.csv

Strips are those of the preset `validate`, with seeds from 0; each is poured in some 20 s of one core,
and those that are there are not poured again. A row is a model of the forces and a definition: p of
theta_i ~ (D_i/D_50)^p, with the standard deviation of `RESAMPLES` bootstraps of the grains.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator.grains import threshold
from orchestrator.grains.loads import Geometry
from orchestrator.lab import validate
from orchestrator.lab.strips import FEWEST, MOVED, ROUGH, Strips
from orchestrator.runs import case as cases
from orchestrator.runs import engine
from orchestrator.study import study
from orchestrator.types import BoolArray, FloatArray

RESAMPLES = 400
DEFINITIONS = {
    "the same part of all grains": (False, 0.0),
    "the same part of the free grains": (True, 0.0),
    "equal mobility, steps of one length": (True, 1.0),
    "equal mobility, steps as the diameter": (True, 2.0),
}
"""Whether grains count that no free way leads out, and the exponent m of parts D_i^-m."""
MODELS = ("bridged", "bridged, protrusion", "balanced")


def exponent(
    own: FloatArray, sizes: FloatArray, held: BoolArray, power: float
) -> float:
    """The exponent p of the classes; `own` is the Shields number of each grain."""
    points = []
    for _, size, in_class in threshold.classes(sizes):
        counted = held & in_class
        if counted.sum() >= FEWEST:
            part = min(MOVED * size**-power, 1.0)
            found = np.quantile(own[counted], part, method="higher")
            points.append((np.log(size), np.log(found)))
    slope, _ = np.polyfit(*np.array(points).T, 1)
    return float(slope)


def main(directory: Path, count: int) -> pd.DataFrame:
    """Pour the strips, and find the exponents."""
    directory.mkdir(parents=True, exist_ok=True)
    preset = study.load("validate")
    base = next(scene for scene in preset.scenes if scene.is_poured)
    changes = [{"bed.seed": seed} for seed in range(count)]
    scenes = [study.changed(base, change) for change in changes]
    for scene in scenes:
        for bed in Geometry(scene, directory).pouring:
            if cases.done_state(bed, directory) is None:
                engine.execute(bed, directory, 7200.0)
    strips = Strips(scenes, directory)
    random = np.random.default_rng(0)
    rows = []
    for model in validate.MODELS:
        if model.name not in MODELS:
            continue
        found = strips.grains(model.fields, ROUGH)
        sizes = np.concatenate([strip.sizes for strip in found])
        own = np.concatenate([strip.shields for strip in found]) / sizes
        is_free = np.concatenate([strip.is_free for strip in found])
        for name, (free_alone, power) in DEFINITIONS.items():
            held = own > 0
            if free_alone:
                held &= is_free
            draws = random.integers(len(own), size=(RESAMPLES, len(own)))
            others = [exponent(own[i], sizes[i], held[i], power) for i in draws]
            rows.append(
                {
                    "model": model.name,
                    "definition": name,
                    "strips": count,
                    "grains": len(own),
                    "exponent": exponent(own, sizes, held, power),
                    "sd": float(np.std(others)),
                }
            )
    return pd.DataFrame(rows)


if __name__ == "__main__":
    number = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    table = main(Path(sys.argv[1]), number)
    table.to_csv(sys.stdout, index=False, float_format="%.3g")
