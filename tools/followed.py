"""The load steps of strips that DEM follows, of a finished study of them.

python tools/followed.py results/strips > followed.csv

The study is docs/strips.toml. A row is a load step; the table of the program,
orchestrator/lab/measured/followed.csv, has those of the strips that were run. A strip
of an older version is listed only if the present one writes the same inputs for it.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from orchestrator.bed import deck
from orchestrator.grains.followed import STEPS, FollowedCase
from orchestrator.runs import reuse
from orchestrator.runs.case import Case
from orchestrator.study import study
from orchestrator.study.closed_form import single_grain
from orchestrator.tables import csv
from orchestrator.types import Row

STUDY = Path(__file__).parents[1] / "docs" / "strips.toml"


def rows(cases: Path) -> Iterator[Row]:
    """List the load steps of the strips of the study that are done."""
    groups = study.load(str(STUDY)).groups
    strips = {
        scene.id: FollowedCase(scene) for group in groups for scene in group.scenes
    }
    asked: dict[str, Case] = {
        case.name: case for strip in strips.values() for case in (*strip.needs, strip)
    }
    done = reuse.done(asked, cases, holds=False)
    for group in groups:
        for scene in group.scenes:
            case = strips[scene.id]
            if case.name not in done:
                continue
            grain = single_grain(scene)
            d = scene.grain.diameter
            count = case.packing(cases).count
            for step in deck.read_table(cases / case.name / STEPS).to_dict("records"):
                yield {
                    "set": group.name,
                    "seed": case.geometry.bed.seed,
                    "dropped_grains": case.geometry.bed.dropped_grains,
                    "stiffness": scene.method.grains.stiffness,
                    "galileo": float(grain.galileo),
                    "density_ratio": float(grain.density_ratio),
                    "shields": float(grain.shields(step["flow"])),
                    "exposed": count,
                    "moved": int(step["moved"]),
                    "sustained": int(step["sustained"]),
                    "level_over_d": step["level"] / d,
                    "gust_level_over_d": step["gust_level"] / d,
                }


if __name__ == "__main__":
    sys.stdout.write(csv(pd.DataFrame(rows(Path(sys.argv[1]) / "cases"))))
