"""The table of thresholds of grains that hop, at the nodes of `orchestrator.physics.saltation`.

python tools/saltation.py > orchestrator/physics/saltation.csv

It takes some ten minutes of one core. Rows are in the order of Galileo number, density ratio and
slope, the last of them fastest.
"""

import numpy as np

from orchestrator.physics.grain import Grain
from orchestrator.physics.saltation import (
    DENSITY_NODES,
    GALILEO_NODES,
    SLOPE_NODES_DEG,
    thresholds,
)

if __name__ == "__main__":
    galileo, density_ratio, slope_deg = np.meshgrid(
        GALILEO_NODES, DENSITY_NODES, SLOPE_NODES_DEG, indexing="ij"
    )
    grains = Grain.of_numbers(galileo, density_ratio, slope_deg=slope_deg).flat
    found = thresholds(grains)
    print("steady,cessation")
    for row in zip(found.steady, found.cessation, strict=True):
        print(",".join(f"{value:.4g}" for value in row))
