"""The table of docs/budget.md: what each choice of the model changes, by scene.

python tools/budget.py results/budget/tables/shares.csv

The largest changes over the fractions are written to docs/measured/budget.csv, and
those of some scenes into the page.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

ROOT = Path(__file__).parents[1]
MEASURED = ROOT / "docs" / "measured" / "budget.csv"
PAGE = ROOT / "docs" / "budget.md"
BEGIN, END = "<!-- by tools/budget.py -->\n", "<!-- end -->\n"
"""Lines of the page between which its table stands."""
AIR = "ρ_f = 1 kg/m³, ν = 1.0 × 10⁻⁵ m²/s"
WATER = "ρ_f = 1000 kg/m³, ν = 1.0 × 10⁻⁶ m²/s"
SCENES = {
    f"15°, 1 mm, {AIR}, bridged, rows along the slope": (
        "15°, 1 mm in air, rows along the slope"
    ),
    f"25°, 1 mm, {AIR}, bridged, horizontal rows": (
        "25°, 1 mm in air, horizontal rows"
    ),
    f"15°, 0.5 mm, {WATER}, bridged, rows along the slope": (
        "15°, 0.5 mm in water, rows along the slope"
    ),
    f"15°, 1 mm, {WATER}, bridged, poured, seed 0": "15°, 1 mm in water, poured",
    f"level, 1 mm, {WATER}, bridged, poured, seed 0": "level, 1 mm in water, poured",
}
"""Scenes of the table, with what the page calls them."""
TOGETHER = {"shields": "**together, θ**", "ustar0": "**together, u\\*₀**"}
"""Rows of all choices together, by the quantity."""


def measured(shares: pd.DataFrame) -> pd.DataFrame:
    """Find the largest changes of each choice over the fractions, %.

    Parameters
    ----------
    shares
        The table ``shares`` of the experiment.

    Returns
    -------
    DataFrame
        A column for each scene of the table, and a row for each choice.
    """
    columns = {}
    for scene, name in SCENES.items():
        of_scene = shares[shares["scene"] == scene]
        largest = of_scene.groupby("choice")[["shields_low", "shields_high"]].max()
        cells = {choice: _cell(*row) for choice, row in largest.iterrows()}
        for quantity, title in TOGETHER.items():
            ends = of_scene.groupby("fraction")[
                [f"{quantity}_low", f"{quantity}_high"]
            ].agg(np.hypot.reduce)
            low, high = ends.max()
            cells[title] = _cell(min(low, 1.0), high)
        columns[name] = cells
    table = pd.DataFrame(columns)
    width = shares.groupby("choice")["shields_high"].max()
    order = width.sort_values(ascending=False).index
    return table.loc[[*order, *TOGETHER.values()]].fillna("–")


def _cell(low: float, high: float) -> str:
    """A change down and up in words, %."""
    ends = [f"{100 * value:.0f}" for value in (low, high)]
    down = "0" if ends[0] == "0" else f"−{ends[0]}"
    up = "0" if ends[1] == "0" else f"+{ends[1]}"
    return "0" if down == up else f"{down} … {up}"


def table() -> str:
    """Write the table of the page from the stored measurements.

    Returns
    -------
    str
        The table.
    """
    stored = pd.read_csv(MEASURED)
    lines = [f"| {' | '.join(stored)} |", "|" + "---|" * len(stored.columns)]
    lines += [f"| {' | '.join(row)} |" for row in stored.astype(str).to_numpy()]
    return "\n".join(lines) + "\n"


def main(shares: Path) -> None:
    """Write the measurements and the table of the page."""
    measured(pd.read_csv(shares)).to_csv(MEASURED, index_label="choice")
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    _, after = rest.split(END)
    PAGE.write_text(f"{before}{BEGIN}{table()}{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
