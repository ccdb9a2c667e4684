"""The domain of the stored known errors, from the scenes of the preset `ladder`.

python tools/domain.py > domain.csv

Where errors are measured, `orchestrator ladder` writes the same beside them. After a
field of study files is new, this is enough: every scene had its default.
"""

import sys

from orchestrator.lab import ladder
from orchestrator.study import study
from orchestrator.tables import csv


def main() -> None:
    """Write the domain of the scenes of the preset."""
    pairs = ladder.decisions(study.load("ladder"))
    sys.stdout.write(csv(ladder.measured_domain(pairs.values())))


if __name__ == "__main__":
    main()
