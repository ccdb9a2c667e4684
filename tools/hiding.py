"""The exponent of hiding on poured strips of sand, read where the balance of the drags holds.

python tools/hiding.py DIRECTORY [STRIPS] > orchestrator/lab/measured/hiding.csv

Strips are those of the preset `validate`, with seeds from 0; each is poured in some 25 s of one core,
and those that are there are not poured again. A row is a model of the forces and an exponent m of the
parts D_i^-m of the classes: p of theta_i ~ (D_i/D_50)^p, with the standard deviation of `RESAMPLES`
bootstraps of the strips. `orchestrator.grains.threshold.hiding_exponent` has the rule of the reading.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from orchestrator.bed.poured import BED
from orchestrator.grains.geometry import Geometry
from orchestrator.grains.threshold import MOBILITIES
from orchestrator.lab import validate
from orchestrator.lab.strips import ROUGH, Strips, hiding_of
from orchestrator.runs import engine
from orchestrator.study import study

RESAMPLES = 400
STRIPS = 40
"""Strips by default: with ten the deviation is twice that with forty."""
MODELS = ("bridged", "bridged, protrusion", "balanced")


def main(directory: Path, count: int) -> pd.DataFrame:
    """Pour the strips, and find the exponents."""
    directory.mkdir(parents=True, exist_ok=True)
    preset = study.load("validate")
    base = next(scene for scene in preset.scenes if scene.is_poured)
    changes = [{"bed.seed": seed} for seed in range(count)]
    scenes = [study.changed(base, change) for change in changes]
    for scene in scenes:
        for bed in Geometry(scene, directory).pouring:
            if not (directory / bed.name / BED).exists():
                engine.execute(bed, directory, 7200.0)
    strips = Strips(scenes, directory)
    random = np.random.default_rng(0)
    rows = []
    for model in validate.MODELS:
        if model.name not in MODELS:
            continue
        found = strips.grains(model.fields, ROUGH)
        draws = random.integers(count, size=(RESAMPLES, count))
        for mobility in MOBILITIES:
            others = [hiding_of([found[n] for n in draw], mobility) for draw in draws]
            rows.append(
                {
                    "model": model.name,
                    "mobility": mobility,
                    "strips": count,
                    "grains": sum(len(strip.sizes) for strip in found),
                    "exponent": hiding_of(found, mobility),
                    "sd": float(np.nanstd(others)),
                }
            )
    return pd.DataFrame(rows)


if __name__ == "__main__":
    number = int(sys.argv[2]) if len(sys.argv) > 2 else STRIPS
    table = main(Path(sys.argv[1]), number)
    table.to_csv(sys.stdout, index=False, float_format="%.3g")
