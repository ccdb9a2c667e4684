"""One grain: its threshold by force law and by size."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.physics.beside import by_formula
from orchestrator.physics.fluids import is_gas
from orchestrator.physics.grain import Grain
from orchestrator.report import answers, sheets, single, style, theory, units
from orchestrator.report.figures import FigureKind
from orchestrator.report.results import Results, case_names
from orchestrator.report.style import (
    ANSWER,
    FLOW,
    INK,
    MEASURED,
    NONE,
    RANGE,
    Figure,
    Look,
)
from orchestrator.report.subjects import ReportedQuantity
from orchestrator.tables.quoted import of_rows
from orchestrator.types import FloatArray

HEIGHT = 3.0
"""Height of a panel with its labels, inches."""
CAPTION = (
    "By law: orange, the answer; blue discs, other laws that hold; grey rings, laws "
    "outside their range. By size: the same law, each size on a bed of identical "
    "grains. Dashed: the formula that is named there, over the sizes that it was "
    "fitted to; shaded: the range of the field sites, or of 80 % of the flumes."
)


def draw(results: Results) -> Iterator[Figure]:
    """Draw the threshold by every law, and by the law that answers for other sizes.

    Yields
    ------
    Figure
        One figure, of a study of one grain.
    """
    grains = sheets.single_grains_sheet(results)
    is_one = results.joined("pile_threshold").empty and answers.is_one_grain(grains)
    if is_one and not theory.are_many(results):
        row = grains.iloc[0]
        told = single.quantity_of_row(row)
        title = f"The {told.name} that moves the grain, by force law and by size"
        cases = case_names(grains)
        wide, narrow = (
            partial(grain_panels, row, width) for width in (style.WIDE, style.NARROW)
        )
        yield Figure("grain", title, CAPTION, cases, wide, place="lead", narrow=narrow)


def grain_panels(row: pd.Series, width: float) -> Canvas:
    """Draw the two panels of a grain, on a narrow page one below the other.

    Parameters
    ----------
    row
        The threshold with the columns of its scene.
    width
        Width of the drawing, inches.

    Returns
    -------
    matplotlib.figure.Figure
        The drawing.
    """
    told = single.quantity_of_row(row)
    here = other_sizes(row, 61)
    d = here["d_m"].to_numpy()
    found = of_rows(here)
    ustar = np.where(found["holds"], found["ustar"], np.nan)
    computed = units.told_by(here, ustar, told)
    grains = Grain.of_table(here)
    compared = units.told_by(here, grains.ustar_at(by_formula(grains)), told)
    curves = pd.DataFrame({"mm": 1e3 * d, "computed": computed, "formula": compared})
    if width < style.WIDE:
        canvas = style.canvas(2 * HEIGHT, width)
        by_law, by_size = canvas.subplots(2, 1)
    else:
        canvas = style.canvas(HEIGHT, width)
        by_law, by_size = canvas.subplots(1, 2)
    _by_law(by_law, row, told)
    _by_size(by_size, row, curves, told)
    return canvas


def other_sizes(row: pd.Series, count: int) -> pd.DataFrame:
    """Change the size of a grain.

    Parameters
    ----------
    row
        The grain with the columns of its scene.
    count
        Number of sizes.

    Returns
    -------
    DataFrame
        Rows of sizes from a sixth to six times its own; of an odd number that one is in
        the middle.
    """
    size = float(row["d_m"])
    d = np.geomspace(size / 6, size * 6, count)
    rows = pd.DataFrame([row] * count)
    return rows.assign(d_m=d, z0_m=row["z0_m"] / size * d)


def _by_law(ax: Axes, row: pd.Series, told: ReportedQuantity) -> None:
    """A line of dots: the threshold under each law."""
    found = []
    for name, (ustar, holds) in answers.by_law(row).items():
        found.append((holds, float(units.told_by(row, ustar, told)), name))
    found.sort(key=lambda one: (one[0], one[1] if one[0] else -one[1]))
    asked = str(row["force_law"])
    compared = float(row[f"compared_{told.column()}"])
    for place, (holds, value, name) in enumerate(found):
        look: Look = {"ms": 4.5, "mew": 1.0}
        if name == asked:
            look |= {"ms": 7, "color": ANSWER}
            is_left = value < compared
            ax.annotate(
                f"{value:.3g}",
                (value, place),
                xytext=(-9 if is_left else 9, 0),
                textcoords="offset points",
                va="center",
                ha="right" if is_left else "left",
                color=ANSWER,
                weight="bold",
            )
        elif holds:
            look["color"] = FLOW
        else:
            look |= {"color": NONE, "mfc": "none"}
        ax.plot([value], [place], "o", **look)
    _compared_lines(ax, row, told)
    ax.set_yticks(range(len(found)), [name for _, _, name in found])
    shown = [value for holds, value, name in found if holds or name == asked]
    least = min(*shown, compared)
    most = max(*shown, compared)
    ax.set_xlim(0.6 * least, 1.25 * most)
    ax.set_ylim(-0.6, len(found) - 0.2)
    ax.set_xlabel(f"{told.name} by force law, {told.unit}")


def _compared_lines(ax: Axes, row: pd.Series, told: ReportedQuantity) -> None:
    """A dashed line at the median of flumes or the formula, and what was measured."""
    compared = float(row[f"compared_{told.column()}"])
    ax.axvline(compared, color=INK, lw=1.1, ls=MEASURED, zorder=1)
    name = "formula" if single.is_by_formula(row) else "flumes"
    look: Look = {
        "xycoords": ax.get_xaxis_transform(),
        "textcoords": "offset points",
        "va": "top",
    }
    ax.annotate(name, (compared, 1.0), xytext=(4, 0), **look)
    if not row["measured_rows"] > 0:
        return
    low, high = (row[f"measured_{told.column(end)}"] for end in ("_low", "_high"))
    ax.axvspan(low, high, color=RANGE, lw=0, zorder=0)
    sites = "field" if is_gas(float(row["rho_f_kg_m3"])) else "80 %"
    ax.annotate(sites, (low, 1.0), xytext=(-4, 0), ha="right", **look)


def _by_size(
    ax: Axes, row: pd.Series, curves: pd.DataFrame, told: ReportedQuantity
) -> None:
    """The threshold by size: by the law where it holds, and by the formula."""
    size = float(row["d_m"])
    mm, computed, compared = curves.to_numpy().T
    ax.plot(mm, computed, color=ANSWER, lw=1.5)
    name = f"formula of {single.formula_of(row)}"
    ax.plot(mm, compared, color=INK, lw=1.1, ls=MEASURED, label=name)
    value = float(row[told.column()])
    ax.plot([1e3 * size], [value], "o", color=ANSWER, ms=6, mec="white")
    # both curves rise to the right: what is below them is free there
    at = _middle(compared)
    is_below = at is None or value < compared[at]
    beside: Look = {"xytext": (8, -6), "va": "top"}
    if not is_below:
        beside = {"xytext": (-8, 6), "va": "bottom", "ha": "right"}
    ax.annotate(
        f"{value:.3g}",
        (1e3 * size, value),
        textcoords="offset points",
        color=ANSWER,
        weight="bold",
        **beside,
    )
    if at is not None:
        ax.legend(loc="upper left", frameon=False)
    style.log_sizes(ax)
    # the name of the formula stands above both curves
    highest = np.nanmax([*computed, *compared, value])
    ax.set(ylim=(0, 1.2 * highest), xlabel="diameter, mm")
    ax.set_ylabel(f"{told.name}, {told.unit}")


def _middle(values: FloatArray) -> int | None:
    """The place in the middle of the known numbers; None if there are none."""
    known = np.flatnonzero(np.isfinite(values))
    return int(known[len(known) // 2]) if len(known) else None


FIGURE = FigureKind(order=20, draws=draw, needs=("single_grain",))
