"""Known errors of two ladders as one: each the largest of both, or the one that there is.

python tools/levels.py orchestrator/fidelity/calibration/levels.csv results/ladder/tables/levels.csv
> levels.csv adds scenes that were measured by themselves to those of the last whole ladder.
"""

import sys

import pandas as pd

KEY = ["part", "level", "scene_class", "fraction"]


def together(ladders: list[pd.DataFrame]) -> pd.DataFrame:
    """The largest error and uncertainty by class, level and fraction; costs are means of scenes."""
    rows = pd.concat(ladders)
    groups = rows.assign(cost_core_s=rows["cost_core_s"] * rows["scenes"]).groupby(KEY)
    most = groups[["error", "uncertainty"]].max()
    sums = groups[["cost_core_s", "scenes"]].sum()
    joined = most.join(
        sums.assign(cost_core_s=sums["cost_core_s"] / sums["scenes"])
    ).reset_index()
    return joined[ladders[0].columns]


if __name__ == "__main__":
    whole = together([pd.read_csv(path) for path in sys.argv[1:]])
    whole.to_csv(sys.stdout, index=False)
