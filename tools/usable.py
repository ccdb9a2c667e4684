"""Which answers on quartz are usable by default: the table docs/measured/usable.csv.

python tools/usable.py DIRECTORY > docs/measured/usable.csv

Ten sizes in air and in water, on a level bed, on a pile with straight faces and on two dunes with a curved
windward side; on flows over curved forms as flat as the second no error was measured. The studies leave open whatever a study may leave open. DIRECTORY keeps them, and a second
call runs none again: some minute of one core.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import orchestrator
from orchestrator.physics.fluids import is_gas

FILE = Path(__file__).parents[1] / "docs" / "measured" / "usable.csv"
SIZES = tuple(float(f"{d:.2g}") for d in np.geomspace(1e-4, 2e-3, 10))
"""m."""
FLUIDS = ("air", "water")
LEVEL = "level"
FORM = {"kind": "pile", "height": 0.02}
"""A form as high as the paper's."""
BEDS: dict[str, dict[str, Any]] = {
    LEVEL: {"kind": "grain"},
    "pile": {**FORM, "slope_deg": 15.0},
    "dune": {**FORM, "slope_deg": 15.0, "shape": "dune", "windward": "curved"},
    "flat dune": {**FORM, "slope_deg": 10.0, "shape": "dune", "windward": "curved"},
}
"""Table `bed` of each study."""
FRACTION = 0.1
"""Of the grains of a form that have moved."""
COLUMNS = [
    *("bed", "fluid", "d_m", "shields", "ustar0_m_s", "decides", "usable", "reason"),
    "why_not",
]


def study(bed: str, sizes: Iterable[float]) -> dict[str, Any]:
    """The study of a bed, with the tables of a study file."""
    made: dict[str, Any] = {
        "title": f"Usable answers on a {bed}",
        "grain": {"density": 2650.0},
        "bed": BEDS[bed],
        "axes": {"fluid.kind": list(FLUIDS), "grain.diameter": list(sizes)},
    }
    if bed != LEVEL:
        made["threshold"] = {"fractions": [FRACTION]}
    return made


def main(
    directory: Path, beds: Iterable[str] = BEDS, sizes: Iterable[float] = SIZES
) -> pd.DataFrame:
    """Run the studies, and list their thresholds.

    Parameters
    ----------
    directory
        The directory of their results.
    beds
        Names of beds.
    sizes
        Diameters of the grains, m.

    Returns
    -------
    DataFrame
        A row for each bed, fluid and size: the threshold, whether it is usable, and why not.
    """
    found = []
    for bed in beds:
        run = orchestrator.run(study(bed, sizes), out=directory / bed, workers=1)
        # a single grain has the threshold of the closed form in a column of its own
        names = {"shields_closed_form": "shields"} if bed == LEVEL else {}
        found.append(run.thresholds.rename(columns=names).assign(bed=bed))
    rows = pd.concat(found, ignore_index=True)
    gas, liquid = FLUIDS
    is_of_gas = rows["rho_f_kg_m3"].map(is_gas)
    rows["fluid"] = np.where(is_of_gas, gas, liquid)
    return rows[COLUMNS].sort_values(["bed", "fluid", "d_m"], ignore_index=True)


if __name__ == "__main__":
    table = main(Path(sys.argv[1]))
    table.to_csv(sys.stdout, index=False, float_format="%.4g")
