"""The picture docs/ladder.png and the tables of docs/ladder.md: numerical errors.

python tools/errors.py

Both are made from the stored measurements,
orchestrator/fidelity/calibration/errors.csv.
"""

from pathlib import Path

import pandas as pd
from matplotlib.axes import Axes

from orchestrator.lab.calibration import USUAL
from orchestrator.report import style

ROOT = Path(__file__).parents[1]
ERRORS = ROOT / "orchestrator" / "fidelity" / "calibration" / "errors.csv"
PICTURE = ROOT / "docs" / "ladder.png"
PAGE = ROOT / "docs" / "ladder.md"
BEGIN, END = "<!-- by tools/errors.py -->\n", "<!-- end -->\n"
"""Lines of the page between which its tables stand."""
MOST_COLUMNS = 6
"""Classes in one table of the page."""
FIDELITIES = {
    "quick": ("o", "#0072b2"),
    "static": ("s", "#009e73"),
    "paper": ("^", "#d55e00"),
    "standard": ("D", "#cc79a7"),
}
"""Marker and colour of each fidelity."""
NAMES = {
    "flow": {
        "wall": "straight sides",
        "wall, small": "small piles",
        "wall, limiting slope": "limiting slope",
        "wall, limiting slope, small": "limiting slope, small piles",
        "wall, channel": "channel",
        "wall, obstacles": "obstacles",
        "wall, curved forms": "curved forms",
        "wall, random beds": "random beds",
        "eq10": "stress by Eq. 10",
    },
    "grains": {
        "aligned": "rows along the slope",
        "aligned, small": "rows, small piles",
        "aligned, limiting slope": "rows, limiting slope",
        "aligned, limiting slope, small": "rows, limiting slope, small piles",
        "aligned, lifted": "rows, lifted",
        "aligned, curved forms": "rows, curved forms",
        "disordered up to 0.02 d": "random gaps to 0.02 d",
        "disordered up to 0.02 d, limiting slope": "random gaps, limiting slope",
        "disordered up to 0.2 d": "random gaps to 0.2 d",
        "horizontal": "horizontal rows",
        "poured": "poured pile",
        "poured, level bed": "poured level bed",
    },
}
"""Names of the classes, in the order of the page."""
FEWEST = 10  # scenes of a class with a known numerical error


def tables() -> str:
    """Write the tables of the page: the widest half width of each fidelity by class.

    Returns
    -------
    str
        The tables. A column for the cost has that of the first class of each part.
    """
    errors = pd.read_csv(ERRORS)
    written = []
    for part, names in NAMES.items():
        classes = list(names)
        for first in range(0, len(classes), MOST_COLUMNS):
            of_part = errors[errors["part"] == part]
            chosen = classes[first : first + MOST_COLUMNS]
            written.append(_table(part, of_part, chosen, classes[0]))
    return "\n".join(written)


def _table(part: str, errors: pd.DataFrame, classes: list[str], first: str) -> str:
    """One table: a row for each fidelity, the reference and the number of scenes."""
    largest = errors.groupby(["rung", "scene_class"]).max(numeric_only=True)
    heads = [NAMES[part][name] for name in classes]
    lines = [
        f"| {part} | core-s | {' | '.join(heads)} |",
        "|---|---|" + "---|" * len(classes),
    ]
    for rung in (*FIDELITIES, "reference"):
        column = "error"
        name = f"`{rung}`"
        if rung == "reference":
            column = "uncertainty"
            name = "uncertainty of the reference"
        cells = [f"{largest.loc[(rung, first), 'cost_core_s']:.2g}"]
        for scene_class in classes:
            row = largest.loc[(rung, scene_class)]
            cell = f"{100 * row[column]:.3g} %"
            if column == "error" and row["confidence"] < USUAL:
                cell += "\\*"
            if column == "uncertainty" and row["uncertainty_scenes"] < FEWEST:
                cell = f"not known ({row['uncertainty_scenes']:.0f} scenes)"
            cells.append(cell)
        lines.append(f"| {name} | {' | '.join(cells)} |")
    counts = [f"{largest.loc[('quick', name), 'scenes']:.0f}" for name in classes]
    lines.append(f"| scenes | | {' | '.join(counts)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Draw the picture, and write the tables into the page."""
    page = PAGE.read_text(encoding="utf-8")
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    PAGE.write_text(f"{before}{BEGIN}{tables()}{END}{after}", encoding="utf-8")
    errors = pd.read_csv(ERRORS)
    with style.settings():
        canvas = style.canvas(6.2)
        heights = [len(names) for names in NAMES.values()]
        panels = canvas.subplots(2, 1, sharex=True, height_ratios=heights)
        for part, axes in zip(NAMES, panels, strict=True):
            _panel(axes, part, errors[errors["part"] == part])
        panels[-1].set_xlabel(
            "half width of τ$_c$ (95 %), largest of n/N = 10 to 70 %, %"
        )
        panels[0].legend(loc="lower left", bbox_to_anchor=(0, 1.06), ncols=5)
        canvas.savefig(PICTURE, dpi=110)


def _panel(axes: Axes, part: str, errors: pd.DataFrame) -> None:
    """The errors of the flow or of the grains, a line for each class."""
    known = errors[errors["scenes"] >= FEWEST]
    columns = ["error", "uncertainty", "uncertainty_scenes"]
    largest = known.groupby(["scene_class", "rung"])[columns].max()
    places = range(len(NAMES[part]))
    for place, scene_class in zip(places, NAMES[part], strict=True):
        of_class = largest.loc[scene_class]
        tried = of_class["uncertainty_scenes"].max() >= FEWEST
        if tried:
            uncertainty = 100 * of_class["uncertainty"].max()
            axes.barh(place, uncertainty, color="0.9", height=0.8, zorder=0)
        for fidelity, (marker, colour) in FIDELITIES.items():
            label = fidelity if place == 0 else None
            error = 100 * of_class.loc[fidelity, "error"]
            axes.plot(error, place, marker, color=colour, label=label, ms=6, alpha=0.8)
    axes.set_yticks(places, NAMES[part].values())
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlim(0.3, 1000)
    axes.grid(axis="x", color="0.85", lw=0.6)
    title = f"error of the {part}; grey: uncertainty of the reference"
    axes.set_title(title, loc="left")


if __name__ == "__main__":
    main()
