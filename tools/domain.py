"""The domain of the stored numerical errors, from the scenes of their calibration.

python tools/domain.py > domain.csv

Where errors are measured, `orchestrator ladder` writes the same beside them. After a
field of study files is new, this is enough: every scene had its default.
"""

import sys

import beside_dem
import random_piles

from orchestrator.fidelity.decision import Decision
from orchestrator.lab import ladder
from orchestrator.study import study
from orchestrator.tables import csv


def pairs() -> list[Decision]:
    """Decide on the pairs of rungs of the preset, and of the random piles.

    Returns
    -------
    list of Decision
        The decisions.
    """
    random = random_piles.load(random_piles.CALIBRATION, "peeling")
    return [
        *ladder.decisions(study.load("ladder")).values(),
        *ladder.decisions(random).values(),
    ]


def main() -> None:
    """Write the domain of the scenes of all pairs, and of those beside DEM."""
    sys.stdout.write(csv(ladder.measured_domain(pairs(), beside_dem.scenes())))


if __name__ == "__main__":
    main()
