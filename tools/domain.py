"""The domain of the stored numerical errors, from the scenes of their calibration.

python tools/domain.py > domain.csv

Where errors are measured, `orchestrator ladder` writes the same beside them. After a
field of study files is new, this is enough: every scene had its default.
"""

import sys

import beside_dem

from orchestrator.lab import ladder
from orchestrator.study import study
from orchestrator.tables import csv


def main() -> None:
    """Write the domain of the scenes of the preset."""
    pairs = ladder.decisions(study.load("ladder"))
    sys.stdout.write(csv(ladder.measured_domain(pairs.values(), beside_dem.scenes())))


if __name__ == "__main__":
    main()
