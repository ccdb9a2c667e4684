"""Figures of poured beds: where grains go, their pockets, and the hiding of sizes."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm

from orchestrator.bed.packing import Packing
from orchestrator.grains.pile import Pile
from orchestrator.physics import measured
from orchestrator.report import labels, shields, style
from orchestrator.report.page import caption
from orchestrator.report.results import Results, case_names, drawable, split
from orchestrator.report.style import Figure
from orchestrator.types import FloatArray

LONGEST = 45.0
"""Longest part of a poured bed that is drawn, d: of a longer one its middle."""
LYING = "#e6decc"
"""Colour of grains that may move but are not exposed."""
FIXED = "#8c8c8c"
EDGE = "#595959"
HIDING_AXES = ("dᵢ/d₅₀", "$τ_c$ of the size over that of d₅₀")
LATTICE_PIVOT_DEG = 30.0
"""Pivot angle of a grain of the lattice, 90 degrees less its entrainment angle."""


def _wilcock_crowe(size: FloatArray) -> Any:
    """Shields number of a size over that of d50, by Wilcock and Crowe."""
    return measured.wilcock_crowe_hiding(size) / size


def _one_stress(size: FloatArray) -> Any:
    """Shields number of a size over that of d50 if one stress moves all sizes."""
    return 1 / size


HIDING: tuple[tuple[str, Callable[[Any], Any], str], ...] = (
    ("Wilcock and Crowe", _wilcock_crowe, "-"),
    ("Egiazaroff", measured.egiazaroff_hiding, "--"),
    ("one stress moves all sizes", _one_stress, ":"),
)
"""Published functions of the size: label, function and dash of a line."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw poured beds: where grains go, their pockets, and the hiding of sizes.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        The first bed of each method, the pivots, and of mixtures the hiding.
    """
    if "size_over_d" not in results.tables.get("pile_grain", ()):
        return
    rows = results.joined("pile_grain")
    rows = rows[rows["size_over_d"].notna()]
    by_method = rows.drop_duplicates("method").sort_values("method")
    firsts = by_method["scene_id"]
    # a grain that lies loose goes at no flow at all
    goes = rows["scene_id"].isin(firsts) & drawable(rows, "ustar0_m_s")
    flows = rows["ustar0_m_s"][goes]
    if len(flows):
        norm = LogNorm(flows.min(), flows.max() * 1.001)
        for scene_id in firsts:
            pile = results.plan.piles[str(scene_id)]
            yield _bed(pile, rows[rows["scene_id"] == scene_id], norm)
    yield _pivots(results, rows[rows["pivot_deg"].notna()])
    classes = results.joined("size_class")
    is_known = classes["hiding"].notna() & (classes["size_over_d"] != 1)
    if is_known.any():
        yield _hiding(classes)


def _bed(pile: Pile, grains: pd.DataFrame, norm: LogNorm) -> Figure:
    """The middle of a bed, seen from the side, or a strip seen from above."""
    packing = pile.packing
    name = grains["method"].iloc[0]
    method = labels.value("method", name)
    left, right, low, high = _frame(packing)
    drawn_height = style.WIDTH * (high - low) / (right - left)
    figure = style.canvas(max(drawn_height, 1.2) + 1.2)
    ax = figure.subplots()
    flows = grains["ustar0_m_s"].to_numpy(float)
    scale = ScalarMappable(norm, colormaps["viridis_r"])
    _draw_grains(ax, packing, _colours(packing, flows, scale))
    ax.set(
        xlim=(left, right),
        ylim=(low, high),
        aspect="equal",
        xlabel="x/d",
        ylabel="y/d" if packing.width else "z/d",
    )
    bar = figure.colorbar(scale, ax=ax, location="bottom", aspect=60)
    bar.set_label("u*₀ at which the grain goes, m/s; the same colours by every method")
    style.plain_ticks(bar.ax.xaxis)
    size = labels.plain("d_m", pile.scene.grain.diameter)
    return Figure(
        name=f"poured-{name}",
        title=f"Where grains go, by {method}, {size}",
        caption=caption("poured", width=packing.width, count=len(flows), method=method),
        cases=tuple(run.name for run in pile.runs),
        drawing=figure,
        tables=("pile_grain",),
    )


def _frame(packing: Packing) -> tuple[float, float, float, float]:
    """Left, right, lower and upper end of the drawn part of a bed, d."""
    x, z = packing.centres.T
    exposed = x[packing.windward]
    middle = (exposed.min() + exposed.max()) / 2
    left = max(x.min() - 1, middle - LONGEST / 2)
    right = min(x.max() + 1, left + LONGEST)
    if packing.width:
        return left, right, 0.0, packing.width
    inside = z[(x > left) & (x < right)]
    return left, right, inside.min() - 1, inside.max() + 1.5


def _colours(packing: Packing, flows: FloatArray, scale: ScalarMappable) -> Any:
    """The colour of each grain: of an exposed one by the flow at which it goes."""
    colours = np.where(packing.mobile, LYING, FIXED).astype(object)
    for grain, flow in zip(np.flatnonzero(packing.windward), flows, strict=True):
        goes = np.isfinite(flow) and flow > 0
        colours[grain] = scale.to_rgba(flow) if goes else "white"
    return colours


def _draw_grains(ax: Axes, packing: Packing, colours: Any) -> None:
    """Draw all grains as circles of their size."""
    places = packing.centres
    order = np.arange(len(places))
    if packing.width:
        places = packing.places.xyz[:, :2]
        # seen from above the upper grains cover the others
        order = np.argsort(packing.centres[:, 1])
    sizes = packing.sizes[order]
    circles = EllipseCollection(
        sizes,
        sizes,
        np.zeros(len(sizes)),
        units="xy",
        facecolors=list(colours[order]),
        edgecolors=EDGE,
        lw=0.3,
        offsets=places[order],
        offset_transform=ax.transData,
    )
    ax.add_collection(circles)


def _pivots(results: Results, rows: pd.DataFrame) -> Figure:
    """The distribution of pivots of the exposed grains, beside that of natural beds."""
    rows = rows.drop_duplicates(["grain_id", "s_m", "pivot_deg"])
    figure = style.canvas(3.4)
    ax = figure.subplots()
    widths = rows.assign(width=rows["width"].fillna(0.0))
    for (width,), part in split(widths, "width"):
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
    ax.legend(loc="lower right")
    return Figure(
        name="pivots",
        title="Pockets of the exposed grains",
        caption=caption("pivots"),
        cases=case_names(results.scenes),
        drawing=figure,
        tables=("pile_grain",),
    )


def _hiding(rows: pd.DataFrame) -> Figure:
    """Thresholds of size classes over that of the median size, panels by method."""
    keys = ["method"]
    (sheet,) = shields.sheets(rows, keys, 2.7, *HIDING_AXES, columns=3)
    colours = style.palette("fraction", sorted(set(rows["fraction"])))
    known = rows[["hiding", "hiding_low", "hiding_high"]].to_numpy(float)
    known = known[np.isfinite(known) & (known > 0)]
    _, axes = sheet.panels()
    for ax, part in zip(axes, sheet.parts, strict=True):
        part = part[part["hiding"] > 0]
        for (fraction,), of_fraction in split(part, "fraction"):
            _draw_classes(ax, of_fraction, colours[float(str(fraction))])
        sizes = part["size_over_d"]
        ratio = np.geomspace(min(sizes.min(), 0.5), max(sizes.max(), 2), 99)
        for label, formula, dash in HIDING:
            ax.plot(ratio, formula(ratio), color="0.3", ls=dash, lw=1, label=label)
        ax.set(xscale="log", yscale="log", ylim=(known.min() / 1.5, 1.5 * known.max()))
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
    return Figure(
        name="hiding",
        title="Hiding and exposure of sizes",
        caption=caption("hiding"),
        cases=case_names(rows),
        drawing=shields.legends(sheet, "fraction", colours),
        tables=("size_class",),
    )


def _draw_classes(ax: Axes, rows: pd.DataFrame, colour: str) -> None:
    """Draw the means of size classes with intervals, hollow where grains are few."""
    number = np.rint(np.log(rows["size_over_d"]) / np.log(np.sqrt(2)))
    logs = rows[["size_over_d", "hiding"]].map(np.log)
    mean = np.exp(logs.groupby(number).mean())
    classes = rows.groupby(number)
    # an end that is not known is beyond the frame
    low = classes["hiding_low"].min(skipna=False).fillna(0.0)
    high = classes["hiding_high"].max(skipna=False).fillna(shields.BEYOND)
    ax.errorbar(
        mean["size_over_d"],
        mean["hiding"],
        # of one class the mean is an end but for its last digit
        yerr=[
            (mean["hiding"] - low).clip(lower=0.0),
            (high - mean["hiding"]).clip(lower=0.0),
        ],
        marker="o",
        ms=4,
        lw=0.8,
        capsize=2,
        color=colour,
    )
    few = mean[classes["few"].any()]
    ax.plot(few["size_over_d"], few["hiding"], "o", ms=3, color="white", zorder=3)
