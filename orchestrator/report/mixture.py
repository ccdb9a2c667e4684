"""Figures of poured beds: the flow at which each grain goes, its pocket, and its size."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D

from orchestrator.grains.pile import Pile
from orchestrator.physics import measured
from orchestrator.report import labels, style
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results, drawable, split

SHOWN = 45.0
"""Longest part of a bed that is drawn in one row, d: of a longer one its middle."""
POURED = "size_over_d"
"""A column of the grains that those of poured beds alone have."""
LYING, FIXED, EDGE = "#e6decc", "#8c8c8c", "#595959"
LINES = (
    ("Wilcock and Crowe", lambda size: measured.wilcock_crowe_hiding(size) / size, "-"),
    ("Egiazaroff", measured.egiazaroff_hiding, "--"),
)


def draw(results: Results) -> Iterator[Figure]:
    """The figures of a study with poured beds; none without."""
    if POURED in results.tables.get("pile_grain", pd.DataFrame()):
        yield from _beds(results)
        yield _pivots(results)
        rows = results.joined("size_class")
        if (rows["hiding"].notna() & (rows["size_over_d"] != 1)).any():
            yield _hiding(rows)


def _beds(results: Results) -> Iterator[Figure]:
    """The first poured bed by each threshold method."""
    rows = results.joined("pile_grain")
    rows = rows[rows[POURED].notna()]
    firsts = rows.drop_duplicates("answered_method").sort_values("answered_method")["scene_id"]
    shown = rows[rows["scene_id"].isin(firsts)]
    # one that its pocket does not hold goes at no flow at all
    reached = shown["ustar0_m_s"][drawable(shown, "ustar0_m_s")]
    if reached.empty:
        return
    norm = LogNorm(reached.min(), reached.max() * 1.001)
    for scene_id in firsts:
        yield _bed(results.plan.piles[scene_id], shown[shown["scene_id"] == scene_id], norm)


def _bed(pile: Pile, grains: pd.DataFrame, norm: LogNorm) -> Figure:
    method = _method(grains)
    packed = pile.packing
    x, z = packed.centres.T
    middle = (x[packed.windward].min() + x[packed.windward].max()) / 2
    left = max(x.min() - 1, middle - SHOWN / 2)
    window = (left, min(x.max() + 1, left + SHOWN))
    there = (x > window[0]) & (x < window[1])
    low, high = (0.0, packed.width) if packed.width else (z[there].min() - 1, z[there].max() + 1.5)
    figure = style.canvas(max(style.WIDTH * (high - low) / (window[1] - window[0]), 1.2) + 1.2)
    ax = figure.subplots()
    flows = grains["ustar0_m_s"].to_numpy(float)
    scale = ScalarMappable(norm, colormaps["viridis_r"])
    colours = np.where(packed.mobile, LYING, FIXED).astype(object)
    for place, flow in zip(np.flatnonzero(packed.windward), flows, strict=True):
        colours[place] = scale.to_rgba(flow) if np.isfinite(flow) else "white"
    # seen from above the upper grains cover the others
    order = np.argsort(z) if packed.width else np.arange(len(x))
    places = packed.places.xyz[:, :2] if packed.width else packed.centres
    sizes = packed.sizes[order]
    discs = EllipseCollection(
        sizes, sizes, np.zeros_like(x), units="xy", offsets=places[order],
        offset_transform=ax.transData, facecolors=list(colours[order]), edgecolors=EDGE, lw=0.3,
    )  # fmt: skip
    ax.add_collection(discs)
    up = "$y/d$" if packed.width else "$z/d$"
    ax.set(xlim=window, ylim=(low, high), aspect="equal", xlabel="$x/d$", ylabel=up)
    bar = figure.colorbar(scale, ax=ax, location="bottom", aspect=60)
    bar.set_label(r"$u^\star_0$ at which the grain goes, m/s; the same colours by every method")
    style.plain_ticks(bar.ax.xaxis)
    seen = f", a strip of {packed.width:g} d seen from above" if packed.width else ""
    caption = (
        f"Poured bed{seen}, {len(flows)} exposed grains, by {method}: colour is the undisturbed "
        "friction velocity at which each exposed grain goes, white one that does not go within the "
        "flows; "
        "pale grains are mobile, grey ones fixed."
    )
    asked = labels.plain("d_m", pile.scene.grain.diameter)
    runs = tuple(run.name for run in pile.runs)
    name = f"poured-{grains['answered_method'].iloc[0]}"
    title = f"Where grains go, by {method}, {asked}"
    return Figure(name, title, caption, runs, figure)


def _method(rows: pd.DataFrame) -> str:
    return labels.value("method", rows["answered_method"].iloc[0])


def _pivots(results: Results) -> Figure:
    rows = results.joined("pile_grain")
    rows = rows[rows["pivot_deg"].notna()].drop_duplicates(["grain_id", "s_m", "pivot_deg"])
    rows = rows.assign(width=rows["answered_width"].fillna(0.0))
    figure = style.canvas(3.4)
    ax = figure.subplots()
    for (width,), part in split(rows, "width"):
        angles = np.sort(part["pivot_deg"].to_numpy(float))
        percent = 100 * (np.arange(len(angles)) + 0.5) / len(angles)
        beds = f"strips of {width:g} d" if width else "beds in one plane"
        colour = "#d55e00" if width else "black"
        ax.plot(angles, percent, color=colour, label=f"{beds}, {len(angles)} grains")
    percent = np.linspace(0.5, 99.5, 100)
    ax.plot(
        measured.kirchner_pivot(percent), percent, color="0.5", ls="--",
        label="Kirchner et al. (1990), $D = D_{50}$",
    )  # fmt: skip
    ax.axvline(30, color=style.WATER, lw=1, label="lattice, β = 60°")
    ax.set(xlabel="pivot angle of an exposed grain, degrees", ylabel="percentile", ylim=(0, 100))
    ax.set_xlim(0, 120)
    ax.legend(loc="lower right")
    caption = (
        "Angle from the normal of the bed over which each exposed grain has to roll: in one plane "
        "over the top of its foremost contact, in a strip in space through the saddle between two, "
        "as on the measured beds of the dashed line. Above 90° a neighbour stands in its way."
    )
    cases = tuple(dict.fromkeys(str(one) for one in results.scenes["case"].dropna()))
    return Figure("pivots", "Pockets of the exposed grains", caption, cases, figure)


def _hiding(rows: pd.DataFrame) -> Figure:
    methods = [part for _, part in split(rows, "answered_method")]
    figure = style.canvas(3.6)
    axes = list(figure.subplots(1, len(methods), sharex=True, sharey=True, squeeze=False)[0])
    colours = style.palette("fraction", sorted(set(rows["fraction"])))
    for ax, part in zip(axes, methods, strict=True):
        _hiding_panel(ax, part, colours)
        ax.set_title(_method(part), loc="left")
        ax.set_xlabel("$d_i/d_{50}$")
    axes[0].set_ylabel(r"$\theta_i/\theta_{50}$")
    for ax in axes:
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
    entries = [style.entry(labels.written("fraction", f), c) for f, c in colours.items()]
    looks = [Line2D([], [], color="0.3", ls=dash, label=name) for name, _, dash in LINES]
    looks.append(Line2D([], [], color="0.3", ls=":", label="one stress moves all sizes"))
    style.legends(figure, entries, looks)
    caption = (
        "Shields number of a size class, in its own diameter, where a fraction of its exposed "
        "grains has moved, over that of the class around the median. Markers: geometric mean over "
        "the beds of the study; bars: their range. Lines: published hiding functions, of the flow "
        "over beds in space and of transport rates, not of first motion."
    )
    return Figure("hiding", "Hiding and exposure of sizes", caption, (), figure)


def _hiding_panel(ax: Axes, rows: pd.DataFrame, colours: dict[float, str]) -> None:
    rows = rows[rows["hiding"] > 0]
    number = np.rint(np.log(rows["size_over_d"]) / np.log(np.sqrt(2)))
    for fraction, colour in colours.items():
        part = rows[rows["fraction"] == fraction]
        groups = part[["size_over_d", "hiding"]].map(np.log).groupby(number)
        mean, low, high = (np.exp(one) for one in (groups.mean(), groups.min(), groups.max()))
        reach = [mean["hiding"] - low["hiding"], high["hiding"] - mean["hiding"]]
        ax.errorbar(
            mean["size_over_d"], mean["hiding"], yerr=reach, color=colour, marker="o", ms=4, lw=0.8,
            capsize=2,
        )  # fmt: skip
    ratio = np.geomspace(min(rows["size_over_d"].min(), 0.5), max(rows["size_over_d"].max(), 2), 99)
    for _, formula, dash in LINES:
        ax.plot(ratio, formula(ratio), color="0.3", ls=dash, lw=1)
    ax.plot(ratio, 1 / ratio, color="0.3", ls=":", lw=1)
    ax.set(xscale="log", yscale="log")
