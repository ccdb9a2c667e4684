"""The table of thresholds of grains that go on, at the nodes of `orchestrator.physics.saltation`.

python tools/saltation.py > orchestrator/physics/saltation.csv

It takes some ten minutes of one core. Rows are in the order of Galileo number, density ratio and
slope, the last of them fastest.
"""

import numpy as np

from orchestrator.physics.saltation import (
    DENSITY_NODES,
    GALILEO_NODES,
    SLOPE_NODES_DEG,
    Grains,
    thresholds,
)

if __name__ == "__main__":
    nodes = np.meshgrid(GALILEO_NODES, DENSITY_NODES, SLOPE_NODES_DEG, indexing="ij")
    found = thresholds(Grains(*nodes))
    print("steady,cessation")
    for steady, cessation in zip(found.steady, found.cessation, strict=True):
        print(f"{steady:.4g},{cessation:.4g}")
