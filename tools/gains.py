"""Draw the costs and errors of the fidelity levels of two calibrations, the older and the newer.

    python tools/gains.py OLDER.csv SECONDS NEWER.csv SECONDS PICTURE

docs/gains.png has those of commits 68c6716 (1.02 s) and f33d66e (0.72 s).

Each table is a calibration/levels.csv, each time that of one fixed calculation on its machine:
costs are in that unit, so that two machines can be compared. A line leads from a level of the
older one to the same level of the newer one.
"""

import sys

import pandas as pd
from adjustText import adjust_text
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from orchestrator.report import style

PANELS = {
    "wall": "Flow",
    "aligned": "Grains, rows along the slope",
    "horizontal": "Grains, level rows",
    "disordered up to 0.02 d": "Grains, random gaps",
}
FLOOR = 1e-3  # smaller errors, and the reference's, which is none, are drawn there; likewise of costs


def read(path: str, unit: str) -> pd.DataFrame:
    """Largest error over the fractions, with its uncertainty, and cost, by class and level."""
    table = pd.read_csv(path)
    table["total"] = (table["error"] ** 2 + table["uncertainty"] ** 2) ** 0.5
    groups = table.groupby(["scene_class", "level"])
    worst = groups.agg(error=("total", "max"), cost=("cost_core_s", "first"))
    return worst.assign(cost=worst["cost"] / float(unit)).clip(lower=FLOOR)


def main() -> None:
    """Read both tables, draw the panels and save the picture."""
    *given, picture = sys.argv[1:]
    older, newer = read(*given[:2]), read(*given[2:])
    with style.settings():
        canvas = Figure(figsize=(8.6, 7.0), layout="constrained")
        for ax, (name, title) in zip(
            canvas.subplots(2, 2).flat, PANELS.items(), strict=True
        ):
            was, now = older.loc[name], newer.loc[name]
            levels = now.index.intersection(was.index)
            ax.set(xscale="log", yscale="log", title=title)
            ax.set(
                xlabel="cost of one run, units", ylabel="largest error of the threshold"
            )
            for level in levels:
                ends = was.loc[level], now.loc[level]
                ax.plot(
                    *([one[x] for one in ends] for x in ("cost", "error")),
                    color="0.8",
                    lw=1,
                )
            ax.plot(
                was["cost"][levels],
                was["error"][levels],
                "o",
                mfc="white",
                mec="0.5",
                ms=4,
            )
            ax.plot(now["cost"], now["error"], "o", color="C0", ms=4)
            ax.margins(0.12)
            for axis in (ax.xaxis, ax.yaxis):
                style.plain_ticks(axis)
            names = [
                ax.text(row.cost, row.error, row.Index, size=6)
                for row in now.itertuples()
            ]
            adjust_text(
                names, ax=ax, arrowprops={"arrowstyle": "-", "color": "C0", "lw": 0.4}
            )
        samples = [
            Line2D([], [], marker="o", ls="", mfc=face, mec=edge, label=label)
            for face, edge, label in (
                ("white", "0.5", "68c6716"),
                ("C0", "C0", "f33d66e"),
            )
        ]
        canvas.legend(handles=samples, loc="outside lower center", ncols=2)
        canvas.savefig(picture, dpi=110)


main()
