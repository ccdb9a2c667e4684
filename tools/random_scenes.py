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

import numpy as np
import pandas as pd

from orchestrator.tables import csv
from orchestrator.types import Row

COUNT, SEED = 60, 20261127
TOLERANCES = (0.05, 0.2)
HEAD = """title = "Random piles"
forces = { law = "bridged" }
method.kind = "dem"
bed.kind = "pile"
method.grains = { mobile_layers = 1, stiffness = 1e3, load_increment = 0.01, waiting_time = 6.0, time_step = 0.3 }
"""
PACKINGS = (*4 * ("aligned",), *3 * ("disordered",), *2 * ("horizontal",), "poured")
FLUIDS = (
    'fluid.kind = "paper"',
    "fluid.viscosity = 1e-3",
    'fluid.kind = "water"\ngrain.density = 2650.0',
)


def groups() -> Iterator[str]:
    """Draw the piles.

    Yields
    ------
    str
        The group of a study file that is one pile.
    """
    rng = np.random.default_rng(SEED)
    for index in range(COUNT):
        packing = str(rng.choice(PACKINGS))
        diameter = float(f"{10 ** rng.uniform(-3.7, -2.7):.3g}")
        most = 12.0 if packing == "poured" else 30.0
        height = float(f"{diameter * rng.uniform(10.0, most):.3g}")
        shape = "triangle"
        if packing == "aligned":
            shape = str(rng.choice(["triangle", "triangle", "dune", "trapezoid"]))
        lines = [
            f"grain.diameter = {diameter}",
            f"bed.slope_deg = {rng.uniform(10.0, 30.0):.1f}",
            f"bed.height = {height}",
            f'bed.roughness = "d/{rng.choice([10, 30])}"',
            f'bed.packing = "{packing}"',
            f'bed.shape = "{shape}"',
            f'forces.stress = "{rng.choice(["wall", "wall", "eq10"])}"',
            str(rng.choice(FLUIDS)),
        ]
        if packing == "disordered":
            lines += [f"bed.disorder = {rng.choice([0.01, 0.02, 0.1])}"]
        if packing in ("disordered", "poured"):
            lines += [f"bed.seed = {index}"]
        if packing == "poured":
            lines += [
                "grain.sizes = { sigma_g = 1.3 }",
                "method.grains.mobile_layers = 4",
            ]
        body = "\n".join(lines)
        yield f'[[group]]\nname = "{index}"\n{body}\nthreshold.criterion = "entrained"\n'


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
    file.write_text(HEAD + "".join(groups()), encoding="utf-8")
    out = folder / "random"
    command = [sys.executable, "-m", "orchestrator", "study", str(file)]
    command += ["--out", str(out), "--workers", "1"]
    if tolerance:
        command += ["--tolerance", str(tolerance)]
    subprocess.run(command, check=False, stdout=sys.stderr)
    table = pd.read_csv(out / "tables" / "pile_threshold.csv")
    return table.set_index(["scene_id", "fraction"])


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
        found = answers(folder, tolerance).join(
            by_dem[["shields"]], rsuffix="_dem", how="inner"
        )
        found = found.dropna(subset=["shields", "shields_dem"])
        off = (found["shields"] / found["shields_dem"] - 1).abs()
        table = found.assign(off=off)
        for packing, part in [("all", table), *table.groupby("packing")]:
            known = part[part["numerical_error"].notna()]
            within = known[known["numerical_error"] <= tolerance]
            yield {
                "tolerance": tolerance,
                "packing": packing,
                "thresholds": len(part),
                "error_known": len(known),
                "within_the_error": int(
                    (known["off"] <= known["numerical_error"]).sum()
                ),
                "known_within_the_tolerance": len(within),
                "within_the_tolerance_of_dem": int((within["off"] <= tolerance).sum()),
                "largest_difference_of_these": within["off"].max(),
                "usable": int(part["usable"].sum()),
            }


if __name__ == "__main__":
    place = Path(sys.argv[1])
    place.mkdir(parents=True, exist_ok=True)
    sys.stdout.write(csv(pd.DataFrame(rows(place))))
