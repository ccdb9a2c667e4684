"""The threshold friction velocity against the size, in air and in water."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.physics.grain import Grain
from orchestrator.physics.measured import measured_sizes
from orchestrator.report import labels, sheets, style, theory
from orchestrator.report.figures import FigureKind
from orchestrator.report.figures.grain import other_sizes
from orchestrator.report.results import Results, case_names, split_by
from orchestrator.report.style import ANSWER, FLOW, Figure, Look
from orchestrator.report.subjects import fluid
from orchestrator.tables.quoted import of_rows

SIZES = 41
"""Sizes of a curve."""
FLUIDS = 2
"""Most fluids of a study that have a curve each."""
GREYS: tuple[tuple[bool, str, str], ...] = (
    (True, "measured in air", "^"),
    (False, "measured in water", "o"),
)
"""Measured beds: whether in a gas, what they are called, and their markers."""
LOOKS: tuple[Look, ...] = (
    {"color": ANSWER, "ls": "-"},
    {"color": FLOW, "ls": (0, (5, 2))},
)
"""Looks of the curves of fluids."""
CAPTION = (
    "The friction velocity at which grains are entrained, against their size. Lines: "
    "the force law and criterion of this study on a level bed, each size on its like, "
    "where the law holds. Large points: the level grains of this study; open: not "
    "usable. Grey: every measured bed, of flumes, of rivers and of wind in the field, "
    "each with its own densities."
)


def draw(results: Results) -> Iterator[Figure]:
    """Draw the friction velocity of single grains and of measured beds.

    Yields
    ------
    Figure
        One figure, of a study of single grains on a level bed.
    """
    if theory.are_many(results) or not results.joined("pile_threshold").empty:
        return
    grains = sheets.single_grains_sheet(results)
    grains = grains[(grains["alpha_deg"] == 0) & (grains["shields"] > 0)]
    if grains.empty:
        return
    title = "Threshold friction velocity against the grain size"
    yield Figure("friction", title, CAPTION, case_names(grains), _friction(grains))


def _friction(grains: pd.DataFrame) -> Canvas:
    """The points and curves of all fluids."""
    canvas = style.canvas(3.6, style.NARROW)
    ax = canvas.subplots()
    for in_gas, label, marker in GREYS:
        d, ustar = measured_sizes(in_gas=in_gas)
        look: Look = {"ls": "", "marker": marker, "ms": 3, "mfc": "none", "mew": 0.5}
        ax.plot(1e3 * d, ustar, color="0.65", label=label, gid="single beds", **look)
    of_fluids = [rows for _, rows in split_by(grains, "rho_f_kg_m3", "nu_m2_s")]
    for rows, look in zip(of_fluids[:FLUIDS], LOOKS, strict=False):
        _fluid(ax, rows, look)
    style.log_sizes(ax)
    ax.set(yscale="log", xlabel="diameter, mm", ylabel="threshold u*, m/s")
    style.plain_ticks(ax.yaxis)
    canvas.legend(handles=style.samples([ax]), loc="outside lower center")
    return canvas


def _fluid(ax: Axes, rows: pd.DataFrame, look: Look) -> None:
    """The curve of a fluid and the grains of the study in it."""
    first = rows.iloc[0]
    here = other_sizes(first, SIZES)
    found = of_rows(here)
    ustar = np.where(found["holds"], found["ustar"], np.nan)
    law = labels.value("force_law", first["force_law"])
    name = f"{law}, {fluid(first['rho_f_kg_m3'], first['nu_m2_s'])}"
    ax.plot(1e3 * here["d_m"], ustar, lw=1.6, label=name, gid="closed form", **look)
    grain = Grain.of_table(rows)
    own = grain.ustar_at(rows["shields"].to_numpy(float))
    usable = rows["usable"].to_numpy(bool)
    point: Look = {"ls": "", "marker": "o", "ms": 6, "color": look["color"]}
    d = 1e3 * rows["d_m"].to_numpy(float)
    ax.plot(d[usable], own[usable], gid="points", mec="white", **point)
    ax.plot(d[~usable], own[~usable], gid="points", mfc="white", **point)


FIGURE = FigureKind(order=105, draws=draw, needs=("single_grain",))
