"""Figures of flows: stress along the bed, velocity, mesh, measured hills."""

from collections.abc import Iterator
from functools import lru_cache, partial
from itertools import groupby
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Rectangle
from numpy.lib.stride_tricks import sliding_window_view

from orchestrator.flow.foam import SolvedFlow
from orchestrator.grains.pile import Pile
from orchestrator.report import labels, style
from orchestrator.report.page import caption
from orchestrator.report.results import Results, measured_hills
from orchestrator.report.style import Figure, Look
from orchestrator.runs.case import is_whole
from orchestrator.study import fields
from orchestrator.study.parts import Turbulence
from orchestrator.types import FloatArray

ESTIMATES: dict[str, Look] = {
    "wall": {"label": "wall stress", "color": "black", "lw": 1.3},
    "eq10": {"label": "Eq. 10, ln((zₑ + z₀)/z₀)", "color": "#0072b2", "lw": 1.0},
    "eq10_printed": {"label": "Eq. 10 as printed, ln(zₑ/z₀)", "color": "#56b4e9", "ls": "--"},
}
FELT: Look = {"color": "#f0a35e", "lw": 0, "marker": ".", "ms": 7, "zorder": 1.5, "gid": "grains"}
REVERSED: Look = {"color": "0.85", "lw": 0, "gid": "reversed flow", "label": "reversed flow"}
MODELS = dict(zip(get_args(Turbulence), ("#0072b2", "#d55e00", "#009e73", "#cc79a7"), strict=True))
"""Colours of the turbulence models."""
USTAR = "u*/u*₀"
_solved = lru_cache(maxsize=16)(SolvedFlow)  # to read one takes a fifth of a second
SMOOTH = np.hanning(31) / np.hanning(31).sum()
"""Weights of the neighbours of a point that smooth a streamline."""
Window = tuple[float, float, float, float]
"""Left, right, bottom, top."""


def _title(results: Results, pile: Pile) -> str:
    """A pile by its slope, height and roughness, and the fields in which flows differ."""
    names = ["alpha_deg", "h_m", "z0_m", *results.flow_fields]
    values = [fields.COLUMNS[name].used(pile.scene) for name in names]
    return labels.panel(pd.Series(values, names, dtype=object), names)


def _kinds(results: Results) -> list[list[Pile]]:
    """Piles with flows, of each slope, height and value of the fields that vary, by rising z0."""

    def kind(pile: Pile) -> tuple[float, float, str]:
        varied = (fields.COLUMNS[name].used(pile.scene) for name in results.flow_fields)
        return pile.bed.slope_deg, pile.bed.height, ", ".join(map(str, varied))

    piles = sorted(results.flows.values(), key=lambda pile: (*kind(pile), pile.bed.roughness))
    return [list(alike) for _, alike in groupby(piles, kind)]


def drawn(results: Results) -> list[Pile]:
    """A pile for each kind of flow whose files are kept."""
    whole = ([p for p in kind if is_whole(p.flow, results.cases)] for kind in _kinds(results))
    return [kind[0] for kind in whole if kind]


def stress(results: Results) -> Iterator[Figure]:
    """The friction velocity along the bed, a panel for each slope at its least and largest z0."""
    piles = [pile for least, *others in _kinds(results) for pile in (least, *others[-1:])]
    if not piles:
        return
    names = tuple(pile.flow.name for pile in piles)
    mean, crest = (f"{ratio:+.0%}" for ratio in eq10_over_wall(results, names))
    lengths = {labels.value("averaging_length", p.scene.forces.averaging_length): 0 for p in piles}
    text = caption("stress", mean=mean, crest=crest, averaged=f"max(d, {', '.join(lengths)})")
    draw, title = partial(_stress, results, piles), "Friction velocity over the pile"
    yield Figure("wall-stress", title, text, names, draw, fold=True)


def _stress(results: Results, piles: list[Pile]) -> Canvas:
    figure, axes = style.grid([_title(results, pile) for pile in piles], 2.6, "x/h", USTAR)
    for ax, pile in zip(axes, piles, strict=True):
        _along(results, pile, ax)
    axes[0].set_xlim(-4, max(pile.model.line.x[-2] / pile.bed.height for pile in piles) + 10)
    style.legends(figure, [], style.samples(axes))
    return figure


def _along(results: Results, pile: Pile, ax: Axes) -> None:
    """Friction velocities along the bed of a pile, over the bed."""
    line, h = pile.model.line, pile.bed.height
    rows, grains = results.tables["wall_stress"], results.joined("pile_grain")
    rows = rows[rows["flow_case"] == pile.flow.name].replace([np.inf, -np.inf], np.nan)
    x, wall = rows["x_m"].to_numpy() / h, rows["ustar_over_ustar0_wall"].to_numpy()
    for name, look in ESTIMATES.items():
        ax.plot(x, rows[f"ustar_over_ustar0_{name}"], gid=name, **look)
    ax.axhline(0, color="0.4", lw=0.6)
    ax.fill_between(x, wall, 0, where=(wall < 0).tolist(), **REVERSED)
    group = grains[grains["flow_case"] == pile.flow.name] if len(grains) else grains
    if len(group):  # of the scenes that share the flow, the last
        group = group[group["scene_id"] == group["scene_id"].max()]
        label = "as the grains feel it (averaged)"
        ax.plot(group["x_m"] / h, group["ustar_over_ustar0"], label=label, **FELT)
    ax.margins(y=0.25)
    below, low, high = ax.twinx(), min(line.z) / h, max(line.z) / h
    below.set(ylim=(low - 0.2, low + 6 * (high - low)), yticks=[])
    _draw_bed(below, pile)
    ax.set(zorder=1, frame_on=False)  # the lines lie over the bed


def eq10_over_wall(results: Results, flow_cases: tuple[str, ...]) -> tuple[float, float]:
    """Relative difference of u* by Eq. 10: mean of the windward faces, largest at their crests."""
    table = results.tables["wall_stress"]
    ratios = []
    for name, rows in table[table["flow_case"].isin(flow_cases)].groupby("flow_case"):
        face = rows[(rows["s_m"] > 0) & (rows["s_m"] < results.flows[str(name)].model.line.crest_s)]
        wall, eq10 = face["ustar_over_ustar0_wall"], face["ustar_over_ustar0_eq10"]
        ratios.append((eq10.mean() / wall.mean() - 1, eq10.max() / wall.max() - 1))
    return float(np.mean(ratios, axis=0)[0]), float(np.max(ratios, axis=0)[1])


def over_u_e(pile: Pile, cases: Path, window: Window, unit: float, width: int = 800) -> FloatArray:
    """Velocity over U_e on a grid, shape (rows, width, 3), rows upwards; NaN outside the mesh.

    The window is in units of `unit`, m.
    """
    left, right, bottom, top = np.multiply(window, unit)
    x = np.linspace(left, right, width)
    z = np.linspace(bottom, top, round(width * (top - bottom) / (right - left)))
    bed, lid = pile.flow.bed_line, pile.flow.lid * pile.flow.height_m
    above = z - bed.height(x)[:, None]
    beyond = (above < 0) | (z > lid) | ((x < bed.x[0]) | (x > bed.x[-1]))[:, None]
    # a height of 1 stands for those that are not used
    heights = np.where(beyond, 1.0, np.maximum(above, 1e-12))
    values = _solved(cases / pile.flow.name).at("U", x, heights, bed)
    grid = np.where(beyond[..., None], np.nan, values.reshape(*above.shape, 3))
    return np.asarray(grid.swapaxes(0, 1) / pile.scene.flow.speed)


def flow(results: Results) -> Iterator[Figure]:
    """Speed and streamlines: a panel for each slope and height, at its least z0."""
    for name, title, shown in style.pages(drawn(results)):
        toe = max(pile.model.line.x[-2] / pile.bed.height for pile in shown)
        window = left, right, bottom, top = -2.0, toe + 8.0, 0.0, 3.0
        panel = (style.WIDTH - sum(style.SIDES)) * (top - bottom) / (right - left)
        figure, axes = style.grid([_title(results, p) for p in shown], panel, "x/h", "z/h", 1)
        for ax, pile in zip(axes, shown, strict=True):
            field = over_u_e(pile, results.cases, window, pile.bed.height)
            speed = np.linalg.norm(field, axis=-1)
            image = ax.imshow(speed, origin="lower", extent=window, vmin=0, vmax=1.1)
            _streamlines(ax, window, field)
            _draw_bed(ax, pile)
            ax.set(aspect="auto", xlim=window[:2], ylim=window[2:], yticks=range(4))
        style.extend(figure, 0.0, 0.55)
        at = (0.1, 0.4 / figure.get_figheight(), 0.88, 0.1 / figure.get_figheight())
        bar = figure.colorbar(image, cax=figure.add_axes(at), orientation="horizontal")
        bar.set_label("speed over that of the approaching flow at 10 h, |u|/Uₑ")
        flows, lid = [pile.scene.flow for pile in shown], not any(p.scene.flow.depth for p in shown)
        models = {labels.value("turbulence_model", flow.turbulence_model): 0 for flow in flows}
        speeds = {labels.value("solve_u_e_m_s", flow.speed): 0 for flow in flows}
        text = caption("flow", models=", ".join(models), speeds=", ".join(speeds), lid=lid)
        names, title = tuple(pile.flow.name for pile in shown), f"Flow over the pile{title}"
        yield Figure(f"flow{name}", title, text, names, figure, fold=bool(name))


def _draw_bed(ax: Axes, pile: Pile) -> None:
    """The bed under the flow, in h."""
    x, z = pile.model.line.corners.T / pile.bed.height
    ax.fill_between(x, z, z.min() - 1, color=style.BED, lw=0)
    ax.plot(x, z, color="0.2", lw=0.8, gid="bed")


def _streamlines(ax: Axes, window: Window, velocity: FloatArray) -> None:
    """Contours of the stream function, integrated from above; from the bed where flow runs back."""
    rows, columns, _ = velocity.shape
    x, z = np.linspace(*window[:2], columns), np.linspace(*window[2:], rows)
    u, w = velocity[..., 0], velocity[-1, :, 2]
    above_bed = np.cumsum(np.nan_to_num(u), axis=0) * (z[1] - z[0])
    through_top = above_bed[-1, 0] - np.cumsum(w) * (x[1] - x[0])
    from_above = through_top - (above_bed[-1] - above_bed)
    forward = np.linspace(0, above_bed[-1, 0], 12)[1:]
    back = np.nanmin(above_bed) * np.array([0.9, 0.6, 0.3])
    for psi, levels in ((from_above, forward), (above_bed, back[back < 0])):
        # the grid meets the bed in steps, which the integral from there carries upwards
        wide = np.pad(psi, ((0, 0), (SMOOTH.size // 2,) * 2), "symmetric")
        smooth = sliding_window_view(wide, SMOOTH.size, axis=1) @ SMOOTH
        inside = np.where(np.isnan(u), np.nan, smooth)
        ax.contour(x, z, inside, levels, colors="white", linewidths=0.45, linestyles="solid")


def mesh(results: Results) -> Iterator[Figure]:
    """The mesh of the study's least slope, which stands for all, and its crest."""
    for pile in drawn(results)[:1]:
        first, lid = f"{pile.flow.first_cell_m / pile.bed.roughness:.3g}", not pile.scene.flow.depth
        text = caption("mesh", cells=pile.flow.settings.cells_per_face, first=first, lid=lid)
        draw = partial(_mesh, results, pile)
        yield Figure("mesh", "Mesh of the flow", text, (pile.flow.name,), draw, fold=True)


def _mesh(results: Results, pile: Pile) -> Canvas:
    line, h = pile.model.line, pile.bed.height
    x, z = line.crest / h
    windows = [(-2.0, line.x[-2] / h + 2.0, 0.0, 2.5), (x - 0.7, x + 0.7, z - 0.25, z + 0.25)]
    shapes = [(top - bottom) / (right - left) for left, right, bottom, top in windows]
    figure = style.canvas(6.4 * sum(shapes) + 0.8)
    axes = list(figure.subplots(2, 1, height_ratios=shapes))
    edges = read_edges(results.cases / pile.flow.name) / h
    low, high = edges.min(axis=1), edges.max(axis=1)
    for ax, (left, right, bottom, top) in zip(axes, windows, strict=True):
        shown = (high >= [left, bottom]).all(axis=1) & (low <= [right, top]).all(axis=1)
        # as one line with gaps: thousands of lines would take seconds and megabytes
        ends = np.pad(edges[shown], ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
        ax.plot(*ends.reshape(-1, 2).T, color="0.25", lw=0.3, gid="mesh")
        ax.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", xlabel="x/h", ylabel="z/h")
        _draw_bed(ax, pile)
    box = Rectangle((left, bottom), right - left, top - bottom, fc="none", ec="#d55e00", lw=1)
    axes[0].add_patch(box)
    axes[0].set_title(_title(results, pile), loc="left")
    axes[1].set_title("the crest", loc="left")
    return figure


def read_edges(case: Path) -> FloatArray:
    """The edges of a mesh one cell deep, seen across the flow: x and z of ends, (E, 2, 2), m."""
    import pyvista  # half a second, for which a page without this figure does not wait

    reader = pyvista.POpenFOAMReader(str(case / "system" / "controlDict"))
    cells: Any = reader.read()["internalMesh"]
    edges = cells.extract_all_edges()
    ends: FloatArray = np.asarray(edges.points, float)[edges.lines.reshape(-1, 3)[:, 1:]]
    front = (ends[..., 1] < ends[..., 1].mean()).all(axis=1)
    return np.asarray(ends[front][..., [0, 2]])


def hills(results: Results) -> Iterator[Figure]:
    """Hills over which others measured the flow, a panel each: computed beside measured."""
    listed = list(measured_hills(results))
    if not listed:
        return
    flows, table = pd.concat([rows for _, rows in listed]), results.tables["wall_stress"]
    titles = [f"half length {a:g} h, {rows['alpha_deg'].iloc[0]:.3g}°" for a, rows in listed]
    canvas, panels = style.grid(titles, 2.1, "x/h from the top", USTAR, 1)
    unverified = "" if flows["measured_verified"].all() else " (unverified)"
    measured: Look = {"color": "black", "lw": 1.2, "gid": "measured"}
    measured["label"] = f"measured end of the reversed flow{unverified}"
    for ax, (_, rows) in zip(panels, listed, strict=True):
        for place, (_, row) in enumerate(rows.iterrows()):
            stress = table[table["flow_case"] == row["flow_case"]]
            line = results.flows[row["flow_case"]].model.line
            x = (stress["x_m"].to_numpy(float) - line.crest[0]) / line.h
            look: Look = {"color": MODELS[row["turbulence_model"]]}
            ax.plot(x, stress["ustar_over_ustar0_wall"], lw=1.0, gid="stress", **look)
            ends = [row["separation_over_h"], row["reattachment_over_h"]]
            ax.plot(ends, [-0.7 - 0.15 * place] * 2, lw=3, gid="reversed flow", **look)
        end = rows["measured_reattachment_over_h"].iloc[0]
        if end > 0:
            ax.axvline(end, **measured)
        ax.axhline(0, color="0.4", lw=0.6)
    panels[0].set_xlim(-9, 13)
    names = [name for name in MODELS if name in set(flows["turbulence_model"])]
    colours = [style.entry(labels.value("turbulence_model", name), MODELS[name]) for name in names]
    style.legends(canvas, colours, style.samples(panels))
    cases, title = tuple(flows["flow_case"]), "Hills that others measured"
    yield Figure("hills", title, caption("hills"), cases, canvas, leads=True)
