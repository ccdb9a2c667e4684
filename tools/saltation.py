"""The table of thresholds of sustained motion, at the nodes of `orchestrator.physics.saltation`.

python tools/saltation.py > orchestrator/physics/saltation.csv

It takes some twenty minutes of one core. Rows are in the order of Galileo number, density ratio and
slope, the last of them fastest.
"""

import numpy as np

from orchestrator.physics.grain import Grain
from orchestrator.physics.saltation import (
    DENSITY_NODES,
    GALILEO_NODES,
    SLOPE_NODES_DEG,
    thresholds,
    weakest_thresholds,
)

if __name__ == "__main__":
    galileo, density_ratio, slope_deg = np.meshgrid(
        GALILEO_NODES, DENSITY_NODES, SLOPE_NODES_DEG, indexing="ij"
    )
    grains = Grain.of_numbers(galileo, density_ratio, slope_deg=slope_deg).flat
    found = thresholds(grains)
    at_most = weakest_thresholds(grains)
    columns = (found.steady, found.cessation, at_most.steady, at_most.cessation)
    print("steady,cessation,steady_high,cessation_high")
    for row in zip(*columns, strict=True):
        print(",".join(f"{value:.4g}" for value in row))
