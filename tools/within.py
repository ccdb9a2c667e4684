"""How often numerical errors held: a study at tolerances beside the same one by DEM.

python tools/within.py results/paper results/paper-0.05 results/paper-0.2 > docs/measured/coverage.csv

The first directory has the study as it is written, by DEM, each other one the study at
a tolerance. The table has, for each tolerance, for all piles, for those that are no part
of the calibration, and for each packing, how many thresholds both reached, of how many
an error is known, how many of these are within it, how many are known to be within the
tolerance and are, and how many within 5 % whatever is known.
"""

import json
import sys
from collections.abc import Collection, Iterator
from pathlib import Path

import beside_dem
import pandas as pd

from orchestrator.tables import csv
from orchestrator.types import Row

NEAR = 0.05
"""Relative difference from DEM that is counted at each tolerance."""


def thresholds(results: Path) -> pd.DataFrame:
    """Read the thresholds of a finished study.

    Parameters
    ----------
    results
        Its directory.

    Returns
    -------
    DataFrame
        The thresholds, by scene and fraction.
    """
    table = pd.read_csv(results / "tables" / "pile_threshold.csv")
    return table.set_index(["scene_id", "fraction"])


def rows(
    by_dem: pd.DataFrame,
    answers: pd.DataFrame,
    tolerance: float,
    calibrated: Collection[str] = (),
) -> Iterator[Row]:
    """Compare the answers within a tolerance with those of DEM.

    Parameters
    ----------
    by_dem, answers
        Thresholds by DEM and within the tolerance, by `thresholds`. What the study as
        it is written answers without DEM is not compared.
    tolerance
        The tolerance.
    calibrated
        Ids of the scenes of the calibration.

    Yields
    ------
    dict
        A row for all piles, for those that are not in the calibration, and for each
        packing.
    """
    moved = by_dem.loc[by_dem["case"].str.startswith("pile", na=False), "shields"]
    columns = ["packing", "shields", "numerical_error", "usable"]
    found = answers[columns].join(moved.rename("by_dem"), how="inner")
    found = found.dropna(subset=["shields", "by_dem"])
    table = found.assign(off=(found["shields"] / found["by_dem"] - 1).abs())
    is_new = ~table.index.get_level_values("scene_id").isin([*calibrated])
    parts = [("all", table), ("not in the calibration", table[is_new])]
    for name, part in [*parts, *table.groupby("packing")]:
        known = part[part["numerical_error"].notna()]
        within = known[known["numerical_error"] <= tolerance]
        yield {
            "tolerance": tolerance,
            "piles": name,
            "thresholds": len(part),
            "error_known": len(known),
            "within_the_error": int((known["off"] <= known["numerical_error"]).sum()),
            "known_within_the_tolerance": len(within),
            "within_the_tolerance_of_dem": int((within["off"] <= tolerance).sum()),
            "largest_difference_of_these": within["off"].max(),
            "within_5_percent_of_dem": int((part["off"] <= NEAR).sum()),
            "usable": int(part["usable"].sum()),
        }


def main() -> None:
    """Write the table of some directories of results."""
    first, *others = map(Path, sys.argv[1:])
    by_dem = thresholds(first)
    calibrated = {scene.id for scene in beside_dem.scenes()}
    table: list[Row] = []
    for results in others:
        about = json.loads((results / "study.json").read_text(encoding="utf-8"))
        table += rows(by_dem, thresholds(results), about["tolerance"], calibrated)
    sys.stdout.write(csv(pd.DataFrame(table)))


if __name__ == "__main__":
    main()
