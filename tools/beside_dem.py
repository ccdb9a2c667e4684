"""Errors of pivots and peeling beside DEM, on piles of finished studies by DEM.

python tools/beside_dem.py results/paper results/random > beside.csv

The reference of the preset `ladder`, with load steps of 0.4 %, takes an hour on a pile
of 700 grains. Of piles of the preset `paper`, and of random ones (`random_piles.py`),
the errors are those from DEM as the study has it, whose load steps are 3 % and 1 %
apart: they contain its own. `PILES` are the diameters of `paper` from which the
calibration is made; those of other diameters are left for its test.
"""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import pandas as pd
import random_piles

from orchestrator.fidelity.classes import GRAINS, LIFTED, scene_class
from orchestrator.fidelity.fidelities import PAIRS
from orchestrator.grains.pile import Pile
from orchestrator.lab.ladder import geometry
from orchestrator.study import study
from orchestrator.study.parts import PileBed
from orchestrator.study.scene import Scene
from orchestrator.study.study import changed
from orchestrator.tables import csv
from orchestrator.types import Row

PILES = (1e-4, 2e-4, 5e-4)
"""Diameters of the piles of the calibration, m."""
RUNGS = {one.grains.name: one.grains for one in PAIRS}
DONE = "done.json"
"""File of a finished case."""
QUASI_STATIC = ("quick", "static")
"""Rungs that are compared with DEM."""


def scenes() -> Iterator[Scene]:
    """All piles beside whose DEM the calibration is made.

    Yields
    ------
    Scene
        A pile.
    """
    yield from _of_paper()
    yield from _random()


def _of_paper() -> Iterator[Scene]:
    """The piles of the preset `paper` of which the calibration is made.

    Grains that lift carries off are not among them, whose law does not hold; nor are
    level rows, whose chains go as round-off decides.
    """
    for scene in study.load("paper").scenes:
        bed = scene.bed
        if not isinstance(bed, PileBed) or scene.grain.diameter not in PILES:
            continue
        if not scene.method.is_resolved_in_time:
            continue
        name = scene_class(GRAINS, scene)
        if not name.endswith(LIFTED) and bed.packing != "horizontal":
            yield scene


def _random() -> Iterator[Scene]:
    """The random piles of the calibration, but for grains that lift carries off."""
    for scene in random_piles.load(random_piles.CALIBRATION, "dem").scenes:
        if not scene_class(GRAINS, scene).endswith(LIFTED):
            yield scene


def rows(cases: Path, piles: Iterable[Scene]) -> Iterator[Row]:
    """Compare pivots and peeling with DEM, on the same flow, where DEM is done.

    Parameters
    ----------
    cases
        The finished cases of a study.
    piles
        The piles of it that are compared.

    Yields
    ------
    dict
        A row for each rung, pile and fraction, as `ladder.scene_errors` has it.
    """
    for scene in piles:
        assert isinstance(scene.bed, PileBed)
        fractions = scene.threshold.fractions
        by_dem_pile = Pile(scene)
        if not all((cases / run.name / DONE).exists() for run in by_dem_pile.runs):
            continue
        by_dem = by_dem_pile.thresholds(cases, fractions)
        for name in QUASI_STATIC:
            other = Pile(changed(scene, RUNGS[name].changes(scene)))
            found = other.thresholds(cases, fractions)
            for at, dem, one in zip(fractions, by_dem, found, strict=True):
                yield {
                    "part": GRAINS,
                    "rung": name,
                    "fraction": at,
                    "scene_class": scene_class(GRAINS, scene),
                    "pile": scene.id,
                    "geometry": geometry(scene, scene.bed),
                    "cost_core_s": float("nan"),
                    "error": one.tau / dem.tau - 1,
                }


if __name__ == "__main__":
    paper, random = (Path(folder) / "cases" for folder in sys.argv[1:])
    found = [*rows(paper, _of_paper()), *rows(random, _random())]
    sys.stdout.write(csv(pd.DataFrame(found)))
