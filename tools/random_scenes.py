"""Coverage of the numerical errors on random piles that no calibration has seen.

python tools/random_scenes.py FOLDER > docs/measured/random_scenes.csv

Sixty piles of all kinds, drawn by one seed within what a study file takes, are answered
by DEM of one mobile layer and load steps 1 % apart, and at two tolerances, one after another in
one directory of results, so that they share their runs. The table has, for each tolerance and packing, how
many thresholds DEM reached, of how many an error is known, how many of these are within
it, and how many are known to be within the tolerance and are.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import random_piles
import within

from orchestrator.tables import csv
from orchestrator.types import Row

TOLERANCES = (0.05, 0.2)


def answers(folder: Path, tolerance: float | None) -> pd.DataFrame:
    """Answer the piles, and read their thresholds.

    Parameters
    ----------
    folder
        Where the studies lie.
    tolerance
        The tolerance; None for DEM as it is usual.

    Returns
    -------
    DataFrame
        The thresholds, by scene and fraction.
    """
    file = folder / "random.toml"
    file.write_text(random_piles.text(random_piles.TEST, "dem"), encoding="utf-8")
    out = folder / "random"
    command = [sys.executable, "-m", "orchestrator", "study", str(file)]
    command += ["--out", str(out), "--workers", "1"]
    if tolerance:
        command += ["--tolerance", str(tolerance)]
    subprocess.run(command, check=False, stdout=sys.stderr)
    return within.thresholds(out)


def rows(folder: Path) -> Iterator[Row]:
    """Compare the answers with those of DEM.

    Parameters
    ----------
    folder
        Where the studies lie.

    Yields
    ------
    dict
        A row for each tolerance and packing.
    """
    by_dem = answers(folder, None)
    for tolerance in TOLERANCES:
        yield from within.rows(by_dem, answers(folder, tolerance), tolerance)


if __name__ == "__main__":
    place = Path(sys.argv[1])
    place.mkdir(parents=True, exist_ok=True)
    sys.stdout.write(csv(pd.DataFrame(rows(place))))
