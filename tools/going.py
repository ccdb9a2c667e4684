"""Grains that go on, by LIGGGHTS: the part of a bed that does, against the stress of the flow.

python tools/going.py DIRECTORY [NAME ...] > docs/measured/going.csv

Each of the `SETS` has as many strips as there are `SEEDS`, of some 240 exposed grains, in five to
ten minutes of one core each. The cases in DIRECTORY run by hand as they lie; those that are done
are not run again. A row is a load step.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.grains.going import GOING, GoingCase
from orchestrator.grains.loads import Geometry
from orchestrator.runs import case as cases
from orchestrator.runs import engine
from orchestrator.study.scene import Scene

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
        "forces": {"drag": "relative"},
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
    excess = (scene.grain.density - scene.fluid.density) * scene.fluid.gravity * d
    exposed = Geometry(scene, directory).packing.count
    return pd.DataFrame(
        {
            "seed": scene.bed.seed,
            "galileo": np.sqrt(excess * d**2 / scene.fluid.density)
            / scene.fluid.viscosity,
            "density_ratio": scene.grain.density / scene.fluid.density,
            "shields": scene.fluid.density * steps["flow"] ** 2 / excess,
            "closed_form": case.closed_form,
            "exposed": exposed,
            "moved": steps["moved"],
            "went_on": steps["went_on"],
            "level": steps["level"] / d,
            "gust_level": steps["gust_level"] / d,
            "time": steps["time"],
        }
    )


def main(directory: Path, names: list[str]) -> pd.DataFrame:
    """Run the sets, and collect their load steps."""
    directory.mkdir(parents=True, exist_ok=True)
    tables = []
    for name in names:
        for seed in SEEDS:
            rows = run(GoingCase(scene_of(SETS[name], seed)), directory)
            rows.insert(0, "set", name)
            tables.append(rows)
            print(name, seed, file=sys.stderr)
    return pd.concat(tables, ignore_index=True)


if __name__ == "__main__":
    found = main(Path(sys.argv[1]), sys.argv[2:] or list(SETS))
    found.to_csv(sys.stdout, index=False, float_format="%.5g")
