"""The tables of thresholds of grains that hop, at the nodes of `orchestrator.physics.cessation`.

python tools/saltation.py > orchestrator/physics/saltation.csv
python tools/saltation.py roughness > orchestrator/physics/saltation_roughness.csv

The first takes some ten minutes of one core, the second half a minute. Rows are in the order of
Galileo number, density ratio and slope, or z0/d, the last of them fastest.
"""

import sys

import numpy as np

from orchestrator.physics.cessation import (
    DENSITY_NODES,
    GALILEO_NODES,
    OTHER_DENSITY_NODES,
    OTHER_GALILEO_NODES,
    RATIO_NODES,
    SLOPE_NODES_DEG,
)
from orchestrator.physics.grain import Grain
from orchestrator.physics.saltation import cessation_thresholds, thresholds


def of_roughness() -> None:
    """Print the table of beds of other roughness."""
    galileo, density_ratio, ratio = np.meshgrid(
        OTHER_GALILEO_NODES, OTHER_DENSITY_NODES, RATIO_NODES, indexing="ij"
    )
    grains = Grain.of_numbers(galileo, density_ratio, ratio=ratio).flat
    print("cessation")
    for value in cessation_thresholds(grains):
        print(f"{value:.4g}")


def of_slopes() -> None:
    """Print the table of beds of d/30."""
    galileo, density_ratio, slope_deg = np.meshgrid(
        GALILEO_NODES, DENSITY_NODES, SLOPE_NODES_DEG, indexing="ij"
    )
    grains = Grain.of_numbers(galileo, density_ratio, slope_deg=slope_deg).flat
    found = thresholds(grains)
    print("steady,cessation")
    for row in zip(found.steady, found.cessation, strict=True):
        print(",".join(f"{value:.4g}" for value in row))


if __name__ == "__main__":
    of_roughness() if sys.argv[1:] == ["roughness"] else of_slopes()
