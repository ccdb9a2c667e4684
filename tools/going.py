"""Grains that go on, by LIGGGHTS: the part of a bed that does, against the stress of the flow.

python tools/going.py DIRECTORY [NAME[:SEED] ...]

Each of the `SETS` has as many strips as there are `SEEDS`, of some 240 exposed grains, in three to
ten minutes of one core each. The cases in DIRECTORY run by hand as they lie; those that are done
are not run again. The load steps of the strips that are asked for, by default of all, take the place
of theirs in `TABLE`; then the figure is drawn anew. Without a DIRECTORY it is drawn alone.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator.grains.going import GOING, GoingCase
from orchestrator.grains.loads import Geometry
from orchestrator.physics.constants import GRAVITY
from orchestrator.physics.curves import Air, iversen_white, soulsby_whitehouse
from orchestrator.report import style
from orchestrator.runs import case as cases
from orchestrator.runs import engine
from orchestrator.study.scene import Scene

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
    excess = 2650.0 / fluid["density"] - 1
    if fluid is AIR:
        air = Air(2650.0, fluid["density"], fluid["viscosity"])
        ustar = iversen_white(d, air)
        return float(ustar**2 / (excess * GRAVITY * d))
    dstar = d * (excess * GRAVITY / fluid["viscosity"] ** 2) ** (1 / 3)
    return float(soulsby_whitehouse(dstar))


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
        ax.set_ylabel("grains that go on, %")
    for ax in axes[1]:
        ax.set_xlabel("Shields number $θ$")
    style.legends(canvas, [one, curve, field], [])
    return canvas


if __name__ == "__main__":
    if sys.argv[1:]:
        found = main(Path(sys.argv[1]), asked(sys.argv[2:]))
        found.to_csv(TABLE, index=False, float_format="%.5g")
    with style.settings():
        FIGURE.write_bytes(style.svg(draw(pd.read_csv(TABLE))))
