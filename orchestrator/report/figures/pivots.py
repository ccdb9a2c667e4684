"""The pockets of poured beds: the pivots of their exposed grains."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator.physics import measured
from orchestrator.report import style
from orchestrator.report.figures import FigureKind
from orchestrator.report.results import Results, case_names, split_by
from orchestrator.report.style import Figure

LATTICE_PIVOT_DEG = 30.0
"""Pivot angle of a grain of the lattice, 90 degrees less its entrainment angle."""
CAPTION = (
    "The angle, from the normal of the bed, over which each exposed grain has to "
    "roll. In one plane the grain rolls over the top of its foremost contact. In a "
    "strip in space it rolls through the saddle between two contacts, as on the "
    "measured beds of the dashed line. Above 90° a neighbour stands in the way."
)


def draw(results: Results) -> Iterator[Figure]:
    """Draw the pivots of the exposed grains of poured beds.

    Yields
    ------
    Figure
        One figure, of a study with poured beds.
    """
    if "size_over_d" not in results.tables["pile_grain"]:
        return
    rows = results.joined("pile_grain")
    rows = rows[rows["size_over_d"].notna() & rows["pivot_deg"].notna()]
    title = "Pockets of the exposed grains"
    yield Figure("pivots", title, CAPTION, case_names(results.scenes), _pivots(rows))


def _pivots(rows: pd.DataFrame) -> Canvas:
    """The distribution of pivots of the exposed grains, beside that of natural beds."""
    rows = rows.drop_duplicates(["grain_id", "s_m", "pivot_deg"])
    figure = style.canvas(3.6, style.NARROW)
    ax = figure.subplots()
    widths = rows.assign(width=rows["width"].fillna(0.0))
    for (width,), part in split_by(widths, "width"):
        angles = np.sort(part["pivot_deg"].to_numpy(float))
        percent = 100 * (np.arange(len(angles)) + 0.5) / len(angles)
        beds = f"strips of {width:g} d" if width else "beds in one plane"
        colour = "#d55e00" if width else "black"
        ax.plot(angles, percent, color=colour, label=f"{beds}, {len(angles)} grains")
    percent = np.linspace(0.5, 99.5, 100)
    natural = measured.kirchner_pivot(percent)
    label = "Kirchner et al. (1990), D = D₅₀"
    ax.plot(natural, percent, color="0.5", ls="--", label=label)
    ax.axvline(LATTICE_PIVOT_DEG, color=style.WATER, lw=1, label="lattice, β = 60°")
    ax.set(xlabel="pivot angle of an exposed grain, degrees", xlim=(0, 180))
    ax.set(ylabel="percentile", ylim=(0, 100))
    figure.legend(handles=style.samples([ax]), loc="outside lower center")
    return figure


FIGURE = FigureKind(order=130, draws=draw, needs=("pile_grain",))
