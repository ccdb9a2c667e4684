"""Figures of piles: fractions that moved, extended Shields diagram, changing and poured beds."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.grains.pile import Pile
from orchestrator.physics import measured
from orchestrator.report import labels, shields, style, theory
from orchestrator.report.grains import colour_entries
from orchestrator.report.page import caption
from orchestrator.report.results import Results, case_names, drawable, split
from orchestrator.report.shields import SHAPE, parted
from orchestrator.report.style import Figure

TAU = ("reynolds", "shields", "shields_low", "shields_high")
SHOWN = ("alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "force_law")
"""Columns that figures, panels, axes, colours and markers tell apart."""
SHOWN_UP_TO = 0.9
"""n/N up to which the axis of the stress holds every curve."""
MARKERS = 30
"""Largest number of markers of a curve: peeling gives one for each grain."""
LONGEST = 45.0
"""Longest part of a poured bed that is drawn, d: of a longer one its middle."""
LYING, FIXED, EDGE = "#e6decc", "#8c8c8c", "#595959"
HIDING = (
    ("Wilcock and Crowe", lambda size: measured.wilcock_crowe_hiding(size) / size, "-"),
    ("Egiazaroff", measured.egiazaroff_hiding, "--"),
    ("one stress moves all sizes", lambda size: 1 / size, ":"),
)
Panels = list[tuple[Axes, pd.DataFrame]]


def _figures(
    rows: pd.DataFrame, keys: list[str], height: float
) -> Iterator[tuple[str, str, Canvas, Panels, pd.DataFrame]]:
    """Figures of panels by keys, those of the most piles first, in each figure by rising keys.

    Yields the endings of the figure's name and title, the figure, axes with their rows, all rows.
    """
    panels = [part for _, part in split(rows, *keys)]
    order = sorted(range(len(panels)), key=lambda i: (-panels[i]["scene_id"].nunique(), i))
    for name, title, chosen in style.pages(order):
        parts = [panels[i] for i in sorted(chosen)]
        figure, axes = style.grid(len(parts), height)
        for ax, part in zip(axes, parts, strict=True):
            ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
        yield name, title, figure, list(zip(axes, parts, strict=True)), pd.concat(parts)


def fractions(results: Results) -> Iterator[Figure]:
    """Fig. 14: n/N against tau, figures of each slope."""
    curve = results.tables.get("pile_curve", pd.DataFrame())
    if len(curve):
        curve = curve[(curve["moved"] > 0) & drawable(curve, "shields")]
    curves = {str(item): group for (item,), group in split(curve, "scene_id")}
    scenes = results.scenes[results.scenes["scene_id"].isin(curves)]
    # of the piles alone: single grains have more diameters than there are colours
    colours = style.palette("d_m", sorted(set(results.beds("pile")["d_m"])))
    for (alpha,), rows in split(scenes, "alpha_deg"):
        choices, rows, variants = parted(rows, *SHOWN)
        keys = ["z0_over_d", *choices]
        for name, title, figure, panels, shown in _figures(rows, keys, 2.3):
            for ax, part in panels:
                for _, pile in part.iterrows():
                    line, colour = curves[pile["scene_id"]], colours[float(pile["d_m"])]
                    look: style.Look = {"marker": str(pile[SHAPE]), "ms": 3, "mew": 0.7, "lw": 0.8}
                    look |= {"mfc": colour if pile["law_holds"] else "white", "color": colour}
                    look |= {"markevery": -(-len(line) // MARKERS), "gid": str(pile["scene_id"])}
                    ax.plot(line["shields"], line["fraction_moved"], **look)
            axes = [ax for ax, _ in panels]
            for ax in axes[::2]:
                ax.set_ylabel("$n/N$")
            # the last grains of a pile may wait for a hundred times the stress of the others
            stress = pd.concat([curves[item] for item in shown["scene_id"]])
            early = stress[stress["fraction_moved"] <= SHOWN_UP_TO]["shields"]
            early = early if len(early) else stress["shields"]
            axes[0].set(xscale="log", xlim=(early.min() / 1.2, 1.2 * early.max()), ylim=(0, 1))
            for ax in axes:
                style.plain_ticks(ax.xaxis)
            shields.label_lowest(axes, labels.TAU_AXIS)
            looks = [*shields.point_entries(shown, variants), *variants]
            style.legends(figure, colour_entries("d_m", colours, shown), looks)
            title = f"Fraction of moving grains, {labels.plain('alpha_deg', alpha)}{title}"
            text = caption("fractions", about=shields.about(shown))
            fold = bool(name) or alpha != scenes["alpha_deg"].min()
            name = f"fractions-alpha{alpha:g}{name}"
            yield Figure(name, title, text, case_names(shown), figure, fold=fold)


def extended(results: Results) -> Iterator[Figure]:
    """Figs. 15 and 16, the extended Shields diagram by slope, figures for each z0/d."""
    every = results.joined("pile_threshold")
    reached = every[drawable(every, "reynolds", "shields")] if len(every) else every
    colours = style.palette("fraction", sorted(set(reached["fraction"]))) if len(reached) else {}
    for (ratio,), rows in split(reached, "z0_over_d"):
        written = labels.ratio_of(float(str(ratio)), "d")
        choices, rows, variants = parted(rows, *SHOWN, "fraction")
        keys, height = ["alpha_deg", *choices], 2.6 if rows["alpha_deg"].nunique() > 1 else 3.4
        for name, title, figure, panels, shown in _figures(rows, keys, height):
            dashes = theory.dashes(shown["force_law"])
            for ax, part in panels:
                published = _thresholds(ax, results, part, colours, dashes)
            axes, parts = [ax for ax, _ in panels], [part for _, part in panels]
            # below the first grains lies the threshold of one, which they are compared with
            reach = shown["reynolds"].min() / 5, shown["reynolds"].max() * 2
            shields.prepare(axes, parts, reach)
            shields.mark_drag_law(axes, parts)
            looks = [
                *shields.within(axes, shields.line_entries(shown, dashes)),
                *shields.point_entries(shown, variants),
                *variants,
                *shields.within(axes, published),
            ]
            style.legends(figure, colour_entries("fraction", colours, reached), looks)
            lines = shields.references(shown, sloped=True)
            text = caption("extended", about=shields.about(shown), lines=lines)
            title = f"Thresholds of piles by slope, z₀ = {written}{title}"
            fold = bool(name) or ratio != reached["z0_over_d"].min()
            name = f"extended-shields-{written.replace('/', '').replace(' ', '')}{name}"
            yield Figure(name, title, text, case_names(shown), figure, fold=fold)


def _thresholds(
    ax: Axes,
    results: Results,
    rows: pd.DataFrame,
    colours: dict[float, str],
    dashes: dict[str, theory.Dash],
) -> list[Artist]:
    """Thresholds of one slope beside the closed form; returns the legend of the references."""
    piles = results.scenes[results.scenes["scene_id"].isin(rows["scene_id"])]
    for _, scenes in split(piles, "beta_deg"):
        for branch in theory.branches(scenes):
            shields.draw_branch(ax, branch, "0.2", dashes[branch.law])
    columns = [*dict.fromkeys((*SHOWN, *TAU, "fraction", "regime", "usable", SHAPE))]
    for (fraction,), points in split(rows[columns], "fraction"):
        colour = colours[float(str(fraction))]
        for _, series in split(points, "nu_m2_s", "force_law", "regime", SHAPE):
            # piles that differ in more than d are a scatter, not a line
            if series["d_m"].is_unique:
                ordered = series.sort_values("reynolds")
                ax.plot(ordered["reynolds"], ordered["shields"], color=colour, lw=0.6, zorder=2)
        shields.draw_points(ax, points, colour, TAU)
    in_air = shields.draw_sloped_air(ax, piles, style.AIR)
    wet = not in_air or not theory.in_gas(piles).all()
    return [*in_air, *(shields.draw_water(ax) if wet else [])]


def wear(results: Results) -> Iterator[Figure]:
    """Beds that change beside the frozen ones, panels by slope, packing and method."""
    rows = results.joined("bed_change")
    if rows.empty:
        return
    colours = style.palette("d_m", sorted(set(rows["d_m"])))
    grey: style.Look = {"color": "0.2"}
    looks = [
        Line2D([], [], ls="--", lw=0.9, label="flow of the whole pile", **grey),
        Line2D([], [], lw=1.3, label="flow of the bed as it is", **grey),
        Line2D([], [], ls="", marker="o", ms=4, label="first 5 % apart", **grey),
    ]
    keys = ["alpha_deg", "packing", "method"]
    for name, title, figure, panels, shown in _figures(rows, keys, 2.1):
        for ax, part in panels:
            for (d, _), group in split(part, "d_m", "scene_id"):
                x, colour = group["fraction_moved"], colours[float(str(d))]
                ax.plot(x, group["shields_frozen"], color=colour, ls="--", lw=0.9)
                ax.plot(x, group["shields"], color=colour, lw=1.3)
                end = group[x == group["holds_until"]]
                ax.plot(end["fraction_moved"], end["shields"], "o", color=colour, ms=4)
        axes = [ax for ax, _ in panels]
        axes[0].set(xlim=(0, None), ylim=(0, None))  # the panels share both
        shields.label_lowest(axes, "$n/N$")
        for ax in axes[::2]:
            ax.set_ylabel("Shields number $θ$")
        style.legends(figure, colour_entries("d_m", colours, rows), looks)
        cases = tuple(results.plan.piles[i].runs[-1].name for i in shown["scene_id"].unique())
        heading = f"Frozen bed and bed that changes{title}"
        yield Figure(f"wear{name}", heading, caption("wear"), cases, figure)


def poured(results: Results) -> Iterator[Figure]:
    """Poured beds: the flow at which each grain goes, its pocket, and the hiding of sizes."""
    rows = results.joined("pile_grain")
    if "size_over_d" not in rows:
        return
    rows = rows[rows["size_over_d"].notna()]
    firsts = rows.drop_duplicates("answered_method").sort_values("answered_method")["scene_id"]
    shown = rows[rows["scene_id"].isin(firsts)]
    # a grain that lies loose goes at no flow at all
    reached = shown["ustar0_m_s"][drawable(shown, "ustar0_m_s")]
    if len(reached):
        norm = LogNorm(reached.min(), reached.max() * 1.001)
        for scene_id in firsts:
            group = shown[shown["scene_id"] == scene_id]
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
    there = (x > left) & (x < right)
    low, high = (0.0, packed.width) if packed.width else (z[there].min() - 1, z[there].max() + 1.5)
    figure = style.canvas(max(style.WIDTH * (high - low) / (right - left), 1.2) + 1.2)
    ax = figure.subplots()
    flows = grains["ustar0_m_s"].to_numpy(float)
    scale = ScalarMappable(norm, colormaps["viridis_r"])
    colours = np.where(packed.mobile, LYING, FIXED).astype(object)
    for place, flow in zip(np.flatnonzero(packed.windward), flows, strict=True):
        colours[place] = scale.to_rgba(flow) if np.isfinite(flow) and flow > 0 else "white"
    # seen from above the upper grains cover the others
    order = np.argsort(z) if packed.width else np.arange(len(x))
    places = packed.places.xyz[:, :2] if packed.width else packed.centres
    sizes, look = packed.sizes[order], {"facecolors": list(colours[order]), "edgecolors": EDGE}
    discs = EllipseCollection(
        sizes, sizes, np.zeros_like(x), units="xy", offsets=places[order],
        offset_transform=ax.transData, lw=0.3, **look,
    )  # fmt: skip
    ax.add_collection(discs)
    up = "$y/d$" if packed.width else "$z/d$"
    ax.set(xlim=(left, right), ylim=(low, high), aspect="equal", xlabel="$x/d$", ylabel=up)
    bar = figure.colorbar(scale, ax=ax, location="bottom", aspect=60)
    bar.set_label(r"$u^\star_0$ at which the grain goes, m/s; the same colours by every method")
    style.plain_ticks(bar.ax.xaxis)
    title = f"Where grains go, by {method}, {labels.plain('d_m', pile.scene.grain.diameter)}"
    text = caption("poured", width=packed.width, count=len(flows), method=method)
    return Figure(f"poured-{name}", title, text, tuple(run.name for run in pile.runs), figure)


def _pivots(results: Results, rows: pd.DataFrame) -> Figure:
    """The distribution of pivot angles of the exposed grains, beside that of natural beds."""
    rows = rows.drop_duplicates(["grain_id", "s_m", "pivot_deg"])
    figure = style.canvas(3.4)
    ax = figure.subplots()
    for (width,), part in split(rows.assign(width=rows["answered_width"].fillna(0.0)), "width"):
        angles = np.sort(part["pivot_deg"].to_numpy(float))
        percent = 100 * (np.arange(len(angles)) + 0.5) / len(angles)
        beds = f"strips of {width:g} d" if width else "beds in one plane"
        colour = "#d55e00" if width else "black"
        ax.plot(angles, percent, color=colour, label=f"{beds}, {len(angles)} grains")
    percent = np.linspace(0.5, 99.5, 100)
    natural = "Kirchner et al. (1990), $D = D_{50}$"
    ax.plot(measured.kirchner_pivot(percent), percent, color="0.5", ls="--", label=natural)
    ax.axvline(30, color=style.WATER, lw=1, label="lattice, β = 60°")
    ax.set(xlabel="pivot angle of an exposed grain, degrees", ylabel="percentile")
    ax.set(xlim=(0, 120), ylim=(0, 100))
    ax.legend(loc="lower right")
    title, cases = "Pockets of the exposed grains", case_names(results.scenes)
    return Figure("pivots", title, caption("pivots"), cases, figure)


def _hiding(rows: pd.DataFrame) -> Figure:
    """Thresholds of size classes over that of the median size, a panel for each method."""
    methods = [part for _, part in split(rows, "answered_method")]
    figure = style.canvas(3.6)
    axes = list(figure.subplots(1, len(methods), sharex=True, sharey=True, squeeze=False)[0])
    colours = style.palette("fraction", sorted(set(rows["fraction"])))
    for ax, part in zip(axes, methods, strict=True):
        ax.set_title(labels.value("method", part["answered_method"].iloc[0]), loc="left")
        part = part[part["hiding"] > 0]
        sizes = part["size_over_d"]
        number = np.rint(np.log(sizes) / np.log(np.sqrt(2)))
        for (fraction,), group in split(part, "fraction"):
            logs = group[["size_over_d", "hiding"]].map(np.log).groupby(number[group.index])
            mean, low, high = (np.exp(item) for item in (logs.mean(), logs.min(), logs.max()))
            reach = [mean["hiding"] - low["hiding"], high["hiding"] - mean["hiding"]]
            look: style.Look = {"marker": "o", "ms": 4, "lw": 0.8, "capsize": 2}
            colour = colours[float(str(fraction))]
            ax.errorbar(mean["size_over_d"], mean["hiding"], yerr=reach, color=colour, **look)
        ratio = np.geomspace(min(sizes.min(), 0.5), max(sizes.max(), 2), 99)
        for _, formula, dash in HIDING:
            ax.plot(ratio, formula(ratio), color="0.3", ls=dash, lw=1)
        ax.set(xscale="log", yscale="log", xlabel="$d_i/d_{50}$")
        style.plain_ticks(ax.xaxis)
        style.plain_ticks(ax.yaxis)
    axes[0].set_ylabel(r"$\theta_i/\theta_{50}$")
    looks = [Line2D([], [], color="0.3", ls=dash, label=name) for name, _, dash in HIDING]
    style.legends(figure, colour_entries("fraction", colours, rows), looks)
    return Figure("hiding", "Hiding and exposure of sizes", caption("hiding"), (), figure)
