"""Figures of piles: fractions that moved, beds that change, and poured beds with their sizes."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure as Canvas

from orchestrator.grains.pile import Pile
from orchestrator.physics import measured
from orchestrator.report import labels, shields, style
from orchestrator.report.page import caption
from orchestrator.report.results import Results, case_names, drawable, split
from orchestrator.report.style import Figure, Look

SHOWN_UP_TO = 0.9  # n/N up to which the axis of the stress holds every curve
MARKERS = 30  # largest number of markers of a curve: peeling gives one for each grain
LONGEST = (
    45.0  # longest part of a poured bed that is drawn, d: of a longer one its middle
)
LYING, FIXED, EDGE = "#e6decc", "#8c8c8c", "#595959"
HIDING = (
    ("Wilcock and Crowe", lambda size: measured.wilcock_crowe_hiding(size) / size, "-"),
    ("Egiazaroff", measured.egiazaroff_hiding, "--"),
    ("one stress moves all sizes", lambda size: 1 / size, ":"),
)


def fractions(results: Results) -> Iterator[Figure]:
    """Fig. 14: n/N against tau, figures of each slope."""
    curve = results.tables.get("pile_curve", pd.DataFrame())
    if len(curve):
        curve = curve[(curve["moved"] > 0) & drawable(curve, "shields")]
    curves = {str(item): group for (item,), group in split(curve, "scene_id")}
    scenes = results.scenes[results.scenes["scene_id"].isin(curves)]
    piles = results.beds(
        "pile"
    )  # single grains have more diameters than there are colours
    sizes = scenes.groupby("alpha_deg")["d_m"].nunique()
    by = "nu_m2_s" if (sizes == 1).all() and piles["nu_m2_s"].nunique() > 1 else "d_m"
    colours = style.palette(by, sorted(set(piles[by])))

    def draw(sheet: shields.Sheet) -> Canvas:
        for ax, part in zip(sheet.panels()[1], sheet.parts, strict=True):
            for _, pile in part.iterrows():
                line, colour = curves[pile["scene_id"]], colours[float(pile[by])]
                look: Look = {
                    "marker": str(pile[shields.SHAPE]),
                    "ms": 3,
                    "mew": 0.7,
                    "lw": 0.8,
                }
                look |= {
                    "markevery": -(-len(line) // MARKERS),
                    "gid": str(pile["scene_id"]),
                }
                look |= {"color": colour, "label": pile[shields.LABEL]}
                if not pile["law_holds"]:
                    look |= {
                        "mfc": "white",
                        "label": "hollow: the force law does not hold",
                    }
                ax.plot(line["shields"], line["fraction_moved"], **look)
        # the last grains of a pile may wait for a hundred times the stress of the others
        stress = pd.concat([curves[item] for item in sheet.rows["scene_id"]])
        last = max(SHOWN_UP_TO, stress["fraction_moved"].min())
        early = stress[stress["fraction_moved"] <= last]["shields"]
        reach = early.min() / 1.2, 1.2 * early.max()
        sheet.panels()[1][0].set(
            xscale="log", xlim=reach, ylim=(0, 1)
        )  # the panels share them
        for ax in sheet.panels()[1]:
            style.plain_ticks(ax.xaxis)
        return shields.legends(sheet, by, colours)

    for (alpha,), rows in split(scenes, "alpha_deg"):
        choices, rows = shields.parted(rows, "alpha_deg", "z0_over_d", "force_law", by)
        for sheet in shields.sheets(
            rows, ["z0_over_d", *choices], 2.3, labels.TAU_AXIS, "n/N"
        ):
            name, where = (
                f"fractions-alpha{alpha:g}{sheet.name}",
                labels.plain("alpha_deg", alpha),
            )
            title = f"Fraction of moving grains, {where}{sheet.title}"
            text = caption("fractions", about=shields.about(sheet.rows))
            fold = bool(sheet.name) or alpha != scenes["alpha_deg"].min()
            drawing = partial(draw, sheet)
            yield Figure(name, title, text, case_names(sheet.rows), drawing, fold=fold)


def wear(results: Results) -> Iterator[Figure]:
    """Beds that change beside the frozen ones, panels by slope, packing and method."""
    rows = results.joined("bed_change")
    if rows.empty:
        return
    colours = style.palette("d_m", sorted(set(rows["d_m"])))
    frozen: Look = {"ls": "--", "lw": 0.9, "label": "flow of the whole pile"}
    worn: Look = {"lw": 1.3, "label": "flow of the bed as it is"}
    apart: Look = {"ls": "", "marker": "o", "ms": 4, "label": "first 5 % apart"}
    keys, axes = ["alpha_deg", "packing", "method"], ("n/N", labels.TAU_AXIS)
    for sheet in shields.sheets(rows, keys, 2.1, *axes):
        for ax, part in zip(sheet.panels()[1], sheet.parts, strict=True):
            for (d, _), group in split(part, "d_m", "scene_id"):
                x, colour = group["fraction_moved"], colours[float(str(d))]
                ax.plot(x, group["shields_frozen"], color=colour, **frozen)
                ax.plot(x, group["shields"], color=colour, **worn)
                end = group[x == group["holds_until"]]
                ax.plot(end["fraction_moved"], end["shields"], color=colour, **apart)
        sheet.panels()[1][0].set(
            xlim=(0, None), ylim=(0, None)
        )  # the panels share both
        canvas = shields.legends(sheet, "d_m", colours)
        cases = tuple(
            results.plan.piles[i].runs[-1].name for i in sheet.rows["scene_id"].unique()
        )
        title = f"Frozen bed and bed that changes{sheet.title}"
        yield Figure(f"wear{sheet.name}", title, caption("wear"), cases, canvas)


def poured(results: Results) -> Iterator[Figure]:
    """Poured beds: the flow at which each grain goes, its pocket, and the hiding of sizes."""
    if "size_over_d" not in results.tables.get("pile_grain", ()):
        return
    rows = results.joined("pile_grain")
    rows = rows[rows["size_over_d"].notna()]
    firsts = rows.drop_duplicates("answered_method").sort_values("answered_method")[
        "scene_id"
    ]
    # a grain that lies loose goes at no flow at all
    reached = rows["ustar0_m_s"][
        rows["scene_id"].isin(firsts) & drawable(rows, "ustar0_m_s")
    ]
    if len(reached):
        norm = LogNorm(reached.min(), reached.max() * 1.001)
        for scene_id in firsts:
            group = rows[rows["scene_id"] == scene_id]
            yield _poured_bed(results.plan.piles[str(scene_id)], group, norm)
    yield _pivots(results, rows[rows["pivot_deg"].notna()])
    classes = results.joined("size_class")
    if (classes["hiding"].notna() & (classes["size_over_d"] != 1)).any():
        yield _hiding(classes)


def _poured_bed(pile: Pile, grains: pd.DataFrame, norm: LogNorm) -> Figure:
    """The middle of a bed, seen from the side, or a strip seen from above."""
    packed, name = pile.packing, grains["answered_method"].iloc[0]
    method, (x, z) = labels.value("method", name), packed.centres.T
    middle = (x[packed.windward].min() + x[packed.windward].max()) / 2
    left = max(x.min() - 1, middle - LONGEST / 2)
    right = min(x.max() + 1, left + LONGEST)
    inside = z[(x > left) & (x < right)]
    low, high = (
        (0.0, packed.width) if packed.width else (inside.min() - 1, inside.max() + 1.5)
    )
    figure = style.canvas(max(style.WIDTH * (high - low) / (right - left), 1.2) + 1.2)
    ax = figure.subplots()
    flows = grains["ustar0_m_s"].to_numpy(float)
    scale = ScalarMappable(norm, colormaps["viridis_r"])
    colours = np.where(packed.mobile, LYING, FIXED).astype(object)
    for place, flow in zip(np.flatnonzero(packed.windward), flows, strict=True):
        colours[place] = (
            scale.to_rgba(flow) if np.isfinite(flow) and flow > 0 else "white"
        )
    # seen from above the upper grains cover the others
    order = np.argsort(z) if packed.width else np.arange(len(x))
    places = packed.places.xyz[:, :2] if packed.width else packed.centres
    sizes = packed.sizes[order]
    look: Look = {"facecolors": list(colours[order]), "edgecolors": EDGE, "lw": 0.3}
    look |= {"offsets": places[order], "offset_transform": ax.transData}
    ax.add_collection(
        EllipseCollection(sizes, sizes, np.zeros_like(x), units="xy", **look)
    )
    up = "y/d" if packed.width else "z/d"
    ax.set(
        xlim=(left, right), ylim=(low, high), aspect="equal", xlabel="x/d", ylabel=up
    )
    bar = figure.colorbar(scale, ax=ax, location="bottom", aspect=60)
    bar.set_label("u*₀ at which the grain goes, m/s; the same colours by every method")
    style.plain_ticks(bar.ax.xaxis)
    title = f"Where grains go, by {method}, {labels.plain('d_m', pile.scene.grain.diameter)}"
    text = caption("poured", width=packed.width, count=len(flows), method=method)
    return Figure(
        f"poured-{name}", title, text, tuple(run.name for run in pile.runs), figure
    )


def _pivots(results: Results, rows: pd.DataFrame) -> Figure:
    """The distribution of pivot angles of the exposed grains, beside that of natural beds."""
    rows = rows.drop_duplicates(["grain_id", "s_m", "pivot_deg"])
    figure = style.canvas(3.4)
    ax = figure.subplots()
    for (width,), part in split(
        rows.assign(width=rows["answered_width"].fillna(0.0)), "width"
    ):
        angles = np.sort(part["pivot_deg"].to_numpy(float))
        percent = 100 * (np.arange(len(angles)) + 0.5) / len(angles)
        beds = f"strips of {width:g} d" if width else "beds in one plane"
        colour = "#d55e00" if width else "black"
        ax.plot(angles, percent, color=colour, label=f"{beds}, {len(angles)} grains")
    percent = np.linspace(0.5, 99.5, 100)
    natural = "Kirchner et al. (1990), D = D₅₀"
    ax.plot(
        measured.kirchner_pivot(percent), percent, color="0.5", ls="--", label=natural
    )
    ax.axvline(30, color=style.WATER, lw=1, label="lattice, β = 60°")
    ax.set(xlabel="pivot angle of an exposed grain, degrees", xlim=(0, 180))
    ax.set(ylabel="percentile", ylim=(0, 100))
    ax.legend(loc="lower right")
    cases = case_names(results.scenes)
    return Figure(
        "pivots", "Pockets of the exposed grains", caption("pivots"), cases, figure
    )


def _hiding(rows: pd.DataFrame) -> Figure:
    """Thresholds of size classes over that of the median size, a panel for each method."""
    axes = "dᵢ/d₅₀", "$τ_c$ of the size over that of d₅₀"
    (sheet,) = shields.sheets(rows, ["answered_method"], 2.7, *axes, columns=3)
    colours = style.palette("fraction", sorted(set(rows["fraction"])))
    known = rows[["hiding", "hiding_low", "hiding_high"]].to_numpy(float)
    known = known[np.isfinite(known) & (known > 0)]
    for ax, part in zip(sheet.panels()[1], sheet.parts, strict=True):
        part = part[part["hiding"] > 0]
        sizes = part["size_over_d"]
        number = np.rint(np.log(sizes) / np.log(np.sqrt(2)))
        for (fraction,), group in split(part, "fraction"):
            logs = (
                group[["size_over_d", "hiding"]]
                .map(np.log)
                .groupby(number[group.index])
            )
            mean, ends = np.exp(logs.mean()), group.groupby(number[group.index])
            # an end that is not known is beyond the frame
            low = ends["hiding_low"].min(skipna=False).fillna(0.0)
            high = ends["hiding_high"].max(skipna=False).fillna(shields.BEYOND)
            reach = [mean["hiding"] - low, high - mean["hiding"]]
            look: Look = {"marker": "o", "ms": 4, "lw": 0.8, "capsize": 2}
            look["color"] = colours[float(str(fraction))]
            ax.errorbar(mean["size_over_d"], mean["hiding"], yerr=reach, **look)
            few = mean[ends["few"].any()]
            ax.plot(
                few["size_over_d"], few["hiding"], "o", ms=3, color="white", zorder=3
            )
        ratio = np.geomspace(min(sizes.min(), 0.5), max(sizes.max(), 2), 99)
        for label, formula, dash in HIDING:
            ax.plot(ratio, formula(ratio), color="0.3", ls=dash, lw=1, label=label)
        ax.set(xscale="log", yscale="log", ylim=(known.min() / 1.5, 1.5 * known.max()))
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
    canvas = shields.legends(sheet, "fraction", colours)
    title, cases = "Hiding and exposure of sizes", case_names(rows)
    return Figure("hiding", title, caption("hiding"), cases, canvas)
