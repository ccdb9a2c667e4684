"""The thresholds at which motion ceases in wind, with the drag of spheres and of natural grains.

python tools/cessation.py > docs/measured/cessation_drag.csv

It takes some twenty seconds. The drag law of Ferguson and Church (2004,
doi:10.1306/051204740933), written as a coefficient, is C_D = (sqrt(24/Re) + sqrt(C_2))^2 with the
C_2 of 0.4 of smooth spheres and that of 1.0 of natural grains. The model itself has the drag of
spheres of Clift and Gauvin.
"""

import sys
from unittest.mock import patch

import numpy as np
import pandas as pd

from orchestrator.lab.validate import FOLDER, measured_grains
from orchestrator.physics import saltation
from orchestrator.physics.laws import SphereDrag
from orchestrator.types import FloatArray

SET = "wind tunnel, cessation"
LEVELS = {"ferguson_church_spheres": 0.4, "ferguson_church_natural": 1.0}
"""C_2 by the column of the table."""
RATIO = 30.0
"""d/z0, as in `validate`."""


def drag_of(level: float) -> SphereDrag:
    """The drag law of Ferguson and Church with a C_2."""

    def factor(reynolds: FloatArray) -> FloatArray:
        stokes = 24 / np.maximum(reynolds, 1e-9)
        coefficient = (np.sqrt(stokes) + np.sqrt(level)) ** 2
        return np.asarray(coefficient / stokes)

    return SphereDrag("Ferguson and Church", factor, 1e5)


def main() -> pd.DataFrame:
    """Model over measurement of each row, by drag law."""
    rows = pd.read_csv(FOLDER / "cessation.csv")
    rows = rows[rows["set"] == SET].sort_values("d_m", ignore_index=True)
    grains = measured_grains(rows, RATIO)
    table = rows[["source", "d_m", "shields"]].copy()
    table["clift_gauvin"] = saltation.thresholds(grains).cessation / rows["shields"]
    for column, level in LEVELS.items():
        with patch.object(saltation, "CLIFT_GAUVIN", drag_of(level)):
            found = saltation.thresholds(grains).cessation
        table[column] = found / rows["shields"]
    return table


if __name__ == "__main__":
    main().to_csv(sys.stdout, index=False, float_format="%.3g")
