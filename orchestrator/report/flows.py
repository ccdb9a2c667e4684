"""Figures of flows: stress along the bed, velocity, mesh, where grains go, measured hills."""

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import gaussian_filter1d

from orchestrator.bed.line import BedLine
from orchestrator.flow.foam import sides
from orchestrator.grains.pile import Pile
from orchestrator.report import labels, style
from orchestrator.report.page import caption
from orchestrator.report.results import Results, measured_hills
from orchestrator.report.style import Figure, Look
from orchestrator.runs.case import is_whole
from orchestrator.solvers.openfoam import read_cells
from orchestrator.study import fields
from orchestrator.study.parts import PileBed, Turbulence
from orchestrator.types import FloatArray

ESTIMATES: dict[str, tuple[str, Look]] = {
    "wall": ("wall stress", {"color": "black", "lw": 1.3}),
    "eq10": ("Eq. 10, $\\ln((z_e+z_0)/z_0)$", {"color": "#0072b2", "lw": 1.0}),
    "eq10_printed": ("Eq. 10 as printed, $\\ln(z_e/z_0)$", {"color": "#56b4e9", "ls": "--"}),
}
GRAINS: Look = {"color": "#f0a35e", "lw": 3.0, "zorder": 1.5, "gid": "grains"}
REVERSED: Look = {"color": "0.85", "lw": 0}
MODELS = dict(zip(get_args(Turbulence), ("#0072b2", "#d55e00", "#009e73", "#cc79a7"), strict=True))
"""Colours of the turbulence models."""
USTAR = r"$u^\star/u^\star_0$"
SPEED = r"speed over that of the approaching flow at 10 h, $|\mathbf{u}|/U_e$"
SOLVED = [name for name, item in fields.COLUMNS.items() if item.info.scope == "solved flows"]
NOTABLE_RATIO = 1.5
"""Ratio of roughness lengths of one slope beyond which both have a panel."""
GAP = 3.0
"""Distance of neighbouring counted grains, over the median one, across which no line joins them."""
FLAT = 0.05
"""Height over the level beside a form up to which the bed belongs to that level, h."""
BEDS = 4
"""Largest number of beds in the map of thresholds."""
Window = tuple[float, float, float, float]
"""Left, right, bottom, top."""


def _kinds(results: Results) -> list[list[Pile]]:
    """Piles with flows, of each slope, height and value of the fields that vary, by rising z0."""
    kinds: dict[tuple[float, float, str], list[Pile]] = {}
    for pile in sorted(results.flows.values(), key=lambda pile: pile.bed.roughness):
        varied = " ".join(map(str, _used(pile, _varied(results))))
        kinds.setdefault((pile.bed.slope_deg, pile.bed.height, varied), []).append(pile)
    return [alike for _, alike in sorted(kinds.items(), key=lambda item: item[0])]


def drawn(results: Results) -> list[Pile]:
    """A pile for each kind of flow whose files are kept."""
    whole = ([p for p in kind if is_whole(p.flow, results.cases)] for kind in _kinds(results))
    return [kind[0] for kind in whole if kind]


def _varied(results: Results) -> list[str]:
    """The fields of the solved flow that the study varies."""
    piles = results.beds("pile")
    return [column for column in SOLVED if piles[column].nunique(dropna=False) > 1]


def _title(results: Results, pile: Pile) -> str:
    """Heading of a panel with one flow."""
    ratio, columns = pile.bed.height / pile.bed.roughness, ["alpha_deg", "h_m"]
    form, varied = (
        labels.panel(_used(pile, names), names) for names in (columns, _varied(results))
    )
    return ", ".join(text for text in (form, f"$z_0$ = h/{ratio:.0f}", varied) if text)


def _used(pile: Pile, columns: list[str]) -> pd.Series:
    """The values of some fields that a pile is answered with."""
    return pd.Series(
        {name: fields.COLUMNS[name].used(pile.scene) for name in columns}, dtype=object
    )


def _x_label(pile: Pile) -> str:
    """Places of a shape are counted from its first foot, those of a profile are its own."""
    return "$x/h$" if pile.bed.profile else "$x/h$ from the windward toe"


def corners(line: BedLine) -> dict[str, int]:
    """The corners of a bed line where its forms begin, are highest and end; none of a level bed.

    Before the toe the bed stays near the level of its first end, behind the lee toe near that of
    its last one; a step has one foot only.
    """
    z, near = np.array(line.z), FLAT * line.h
    if np.ptp(z) == 0:
        return {}
    toe = int(np.argmax(np.abs(z - z[0]) > near)) - 1
    lee = len(z) - int(np.argmax(np.abs(z - z[-1])[::-1] > near))
    highest = np.flatnonzero(z == z.max())
    crest = int(highest[0] if highest[0] > 0 else highest[-1])
    marked = {"toe": toe, "crest": crest, "lee toe": lee}
    none = {"toe": toe >= crest, "lee toe": lee <= crest}
    return {name: at for name, at in marked.items() if not none.get(name)}


def stress(results: Results) -> Iterator[Figure]:
    """The friction velocity along the bed, a panel for each slope at its least and largest z0."""
    piles = []
    for least, *others in _kinds(results):
        rougher = [p for p in others[-1:] if p.bed.roughness > NOTABLE_RATIO * least.bed.roughness]
        piles += [least, *rougher]
    if not piles:
        return
    columns = min(len(piles), 2)
    rows = -(-len(piles) // columns)
    figure = style.canvas(3.0 * rows + 0.4)
    panels = figure.subfigures(rows, columns, squeeze=False).ravel()
    for panel, pile in zip(panels, piles, strict=False):
        _stress_panel(panel, results, pile)
    entries = [Line2D([], [], label=text, **look) for text, look in ESTIMATES.values()]
    if "pile_grain" in results.tables:
        entries.append(Line2D([], [], label="as the grains feel it (averaged)", **GRAINS))
    style.legends(figure, [], [*entries, Patch(label="reversed flow", **REVERSED)])
    names = tuple(pile.flow.name for pile in piles)
    mean, crest = (f"{ratio:+.0%}" for ratio in eq10_over_wall(results, names))
    lengths = {labels.value("averaging_length", p.scene.forces.averaging_length): 0 for p in piles}
    text = caption("stress", mean=mean, crest=crest, averaged=f"max(d, {', '.join(lengths)})")
    yield Figure("wall-stress", "Friction velocity over the pile", text, names, figure, fold=True)


def _stress_panel(panel: SubFigure, results: Results, pile: Pile) -> None:
    top, below = panel.subplots(2, 1, sharex=True, height_ratios=[4, 1])
    table = results.tables["wall_stress"]
    rows = table[table["flow_case"] == pile.flow.name]
    line, h = pile.model.line, pile.bed.height
    x, z, wall = (rows[name].to_numpy(float) for name in ("x_m", "z_m", "ustar_over_ustar0_wall"))
    for name, (_, look) in ESTIMATES.items():
        values = rows[f"ustar_over_ustar0_{name}"].replace([np.inf, -np.inf], np.nan)
        top.plot(x / h, values, gid=name, **look)
    _shade_reversed(top, x / h, wall)
    top.set_ylim(top=1.25 * top.get_ylim()[1])
    grains = results.joined("pile_grain")
    group = grains[grains["flow_case"] == pile.flow.name] if len(grains) else grains
    if len(group):  # of the scenes that share the flow, the last
        group = group.sort_values(["stress", "scene_id", "s_m"])
        group = group[group["scene_id"] == group["scene_id"].iloc[-1]]
        place, felt = (group[name].to_numpy(float) for name in ("x_m", "ustar_over_ustar0"))
        step = np.diff(group["s_m"].to_numpy(float), prepend=np.nan)
        behind_gap = np.flatnonzero(step > GAP * np.median(step[1:])) if len(step) > 1 else step[:0]
        place, felt = (np.insert(values, behind_gap, np.nan) for values in (place, felt))
        top.plot(place / h, felt, **GRAINS)
    _draw_bed(below, pile)
    below.text(0.015, 0.6, "flow →", transform=below.transAxes, fontsize=6.5, color="0.35")
    below.set(xlabel=_x_label(pile), ylabel="$z/h$", ylim=(z.min() / h - 0.3, z.max() / h + 0.4))
    for name, at in corners(line).items():
        for ax in (top, below):
            ax.axvline(line.x[at] / h, zorder=0, gid=name, color="0.6", lw=0.6, ls=(0, (4, 2)))
        style.upright_note(top, line.x[at] / h - 0.1, name, at="top")
    top.set(xlim=(-4, line.x[-2] / h + 10), ylabel=USTAR)
    top.set_title(_title(results, pile), loc="left")


def _shade_reversed(ax: Axes, x: FloatArray, ustar: FloatArray) -> None:
    ax.axhline(0, color="0.4", lw=0.6)
    ax.fill_between(x, ustar, 0, where=(ustar < 0).tolist(), gid="reversed flow", **REVERSED)


def eq10_over_wall(results: Results, flow_cases: tuple[str, ...]) -> tuple[float, float]:
    """Relative difference of u* by Eq. 10: mean of the windward faces, largest at their crests."""
    table = results.tables["wall_stress"]
    means, crests = [], []
    for name in flow_cases:
        rows = table[table["flow_case"] == name]
        face = rows[(rows["s_m"] > 0) & (rows["s_m"] < results.flows[name].model.line.crest_s)]
        wall, eq10 = face["ustar_over_ustar0_wall"], face["ustar_over_ustar0_eq10"]
        means.append(eq10.mean() / wall.mean() - 1)
        crests.append(eq10.max() / wall.max() - 1)
    return float(np.mean(means)), float(np.max(crests))


@lru_cache(maxsize=16)
def _cells(case: Path) -> Any:
    """The cells of a finished flow with the velocity at their corners."""
    return read_cells(case, "U").cell_data_to_point_data()


def velocity(case: Path, window: Window, shape: tuple[int, int]) -> FloatArray:
    """The velocity of a finished case on a grid of points.

    The grid has a shape of rows, upwards, and columns in a window (m); the result has the shape
    (rows, columns, 3), m/s, and is NaN outside the mesh.
    """
    import pyvista  # half a second, which only a study with piles waits for

    mesh, (rows, columns), (left, right, bottom, top) = _cells(case), shape, window
    spacing = ((right - left) / (columns - 1), 1.0, (top - bottom) / (rows - 1))
    origin = (left, (mesh.bounds[2] + mesh.bounds[3]) / 2, bottom)
    grid = pyvista.ImageData(dimensions=(columns, 1, rows), spacing=spacing, origin=origin)
    sampled: Any = grid.sample(mesh)
    inside = np.asarray(sampled["vtkValidPointMask"], bool)[:, None]
    values = np.where(inside, np.asarray(sampled.point_data["U"], float), np.nan)
    return values.reshape(rows, columns, 3)


def over_u_e(
    pile: Pile, cases: Path, window: Window, unit: float, columns: int = 800
) -> FloatArray:
    """The velocity over a pile in a window, over U_e; the window is in units of `unit`, m."""
    left, right, bottom, top = (end * unit for end in window)
    shape = round(columns * (top - bottom) / (right - left)), columns
    field = velocity(cases / pile.flow.name, (left, right, bottom, top), shape)
    return field / pile.scene.flow.speed


def flow(results: Results) -> Iterator[Figure]:
    """Speed and streamlines: a panel for each slope and height, at its least z0."""
    for name, title, shown in style.pages(drawn(results)):
        toe = max(pile.model.line.x[-2] / pile.bed.height for pile in shown)
        window = left, right, bottom, top = -2.0, toe + 8.0, 0.0, 3.0
        # as high as to scale, with a title over each panel
        panel = 0.4 + 0.9 * style.WIDTH * (top - bottom) / (right - left)
        figure = style.canvas(panel * len(shown) + 0.9)
        axes = list(figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0])
        for ax, pile in zip(axes, shown, strict=True):
            field = over_u_e(pile, results.cases, window, pile.bed.height)
            speed = np.linalg.norm(field, axis=-1)
            image = ax.imshow(speed, origin="lower", extent=window, vmin=0, vmax=1.1)
            _streamlines(ax, window, field)
            _draw_bed(ax, pile)
            ax.set(ylabel="$z/h$", aspect="equal", xlim=window[:2], ylim=window[2:])
            ax.set_yticks([0, 1, 2, 3])
            ax.set_title(_title(results, pile), loc="left")
        axes[-1].set_xlabel(_x_label(shown[-1]))
        bar = figure.colorbar(image, ax=axes, location="bottom", aspect=60, pad=0.02)
        bar.set_label(SPEED)
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
    """Contours of the stream function.

    Outside the region that runs back it is integrated from above, inside it from the bed: each
    where the flow is smooth and the function small.
    """
    rows, columns, _ = velocity.shape
    x, z = np.linspace(*window[:2], columns), np.linspace(*window[2:], rows)
    u, w = velocity[..., 0], velocity[-1, :, 2]
    above_bed = cumulative_trapezoid(np.nan_to_num(u), z, axis=0, initial=0)
    through_top = above_bed[-1, 0] - cumulative_trapezoid(w, x, initial=0)
    from_above = through_top - (above_bed[-1] - above_bed)
    forward = np.linspace(0, above_bed[-1, 0], 12)[1:]
    back = np.nanmin(above_bed) * np.array([0.9, 0.6, 0.3])
    for psi, levels in ((from_above, forward), (above_bed, back[back < 0])):
        # the grid meets the bed in steps, which the integral from there carries upwards
        inside = np.where(np.isnan(u), np.nan, gaussian_filter1d(psi, 6.0, axis=1))
        ax.contour(x, z, inside, levels, colors="white", linewidths=0.45, linestyles="solid")


def mesh(results: Results) -> Iterator[Figure]:
    """The mesh of the study's least slope, which stands for all, and its crest."""
    for pile in drawn(results)[:1]:
        edges = read_edges(results.cases / pile.flow.name) / pile.bed.height
        line, h = pile.model.line, pile.bed.height
        x, z = line.crest / h
        windows = [(-2.0, line.x[-2] / h + 2.0, 0.0, 2.5), (x - 0.7, x + 0.7, z - 0.25, z + 0.25)]
        shapes = [(top - bottom) / (right - left) for left, right, bottom, top in windows]
        figure = style.canvas(6.4 * sum(shapes) + 0.8)
        axes = list(figure.subplots(2, 1, height_ratios=shapes))
        for ax, (left, right, bottom, top) in zip(axes, windows, strict=True):
            low, high = edges.min(axis=1), edges.max(axis=1)
            shown = (high >= [left, bottom]).all(axis=1) & (low <= [right, top]).all(axis=1)
            # as one line with gaps: thousands of lines would take seconds and megabytes
            gap = np.full((int(shown.sum()), 1, 2), np.nan)
            ends = np.concatenate([edges[shown], gap], axis=1).reshape(-1, 2)
            ax.plot(*ends.T, color="0.25", lw=0.3, gid="mesh")
            ax.set(xlim=(left, right), ylim=(bottom, top), ylabel="$z/h$", aspect="equal")
            _draw_bed(ax, pile)
        box = Rectangle((left, bottom), right - left, top - bottom, fc="none", ec="#d55e00", lw=1)
        axes[0].add_patch(box)
        axes[0].set_title(_title(results, pile), loc="left")
        axes[1].set_title("the crest", loc="left")
        axes[1].set(xlabel=_x_label(pile))
        first = f"{pile.flow.first_cell_m / pile.bed.roughness:.3g}"
        cells, lid = pile.flow.settings.cells_per_face, not pile.scene.flow.depth
        text = caption("mesh", cells=cells, first=first, lid=lid)
        yield Figure("mesh", "Mesh of the flow", text, (pile.flow.name,), figure, fold=True)


def read_edges(case: Path) -> FloatArray:
    """The edges of a mesh one cell deep, seen across the flow: x and z of ends, (E, 2, 2), m."""
    corners = sides(case)
    front = corners[(corners[..., 1] < corners[..., 1].mean()).all(axis=1)]
    places = front[..., 0] + 1j * front[..., 2]  # complex numbers have an order
    ends = np.stack([places, np.roll(places, 1, axis=1)], axis=2).reshape(-1, 2)
    edges = np.unique(np.sort(ends, axis=1), axis=0)
    return np.stack([edges.real, edges.imag], axis=2)


def where(results: Results) -> Iterator[Figure]:
    """Beds that are more than one triangle, each by its first scene: stress, flow, thresholds."""
    grains = results.tables.get("pile_grain", pd.DataFrame())
    done = set() if grains.empty else set(grains["scene_id"])
    lines: dict[BedLine, tuple[str, Pile]] = {}
    for scene_id, pile in results.plan.piles.items():
        if scene_id in done and not pile.bed.is_triangle and np.ptp(pile.model.line.z) > 0:
            lines.setdefault(pile.model.line, (scene_id, pile))
    beds = list(lines.values())[:BEDS]
    if not beds:
        return
    heights = [*[3.2] * len(beds), 0.6]
    canvas = style.canvas(sum(heights))
    *parts, last = canvas.subfigures(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    for part, (scene_id, pile) in zip(parts, beds, strict=True):
        _where_bed(part, results, pile, grains[grains["scene_id"] == scene_id])
    bar = canvas.colorbar(ScalarMappable(cmap="plasma"), last.subplots(), orientation="horizontal")
    bar.set_label("$n/N$ by then")
    names = tuple(dict.fromkeys(run.name for _, pile in beds for run in pile.runs))
    yield Figure("where", "Where grains go", caption("where"), names, canvas)


def _where_bed(part: SubFigure, results: Results, pile: Pile, grains: pd.DataFrame) -> None:
    top, bed, map_ = part.subplots(3, 1, sharex=True, height_ratios=[1.1, 1, 1.5])
    h, line = pile.bed.height, pile.model.line
    window = line.x[1] / h - 4.0, line.x[-2] / h + 4.0
    along = pile.stress(results.cases)
    top.plot(along.x_m / h, along.ustar_over_ustar0_wall, color="black", lw=1.0, gid="stress")
    _shade_reversed(top, along.x_m / h, along.ustar_over_ustar0_wall)
    top.set(ylabel=USTAR, xlim=window)
    top.set_title(f"{shape(pile.bed)}, {_title(results, pile)}", loc="left")
    low, high = min(line.z) / h - 0.2, max(line.z) / h + 2.5
    if pile.model.cases and is_whole(pile.flow, results.cases):
        extent = (*window, low + 0.2, high)
        speed = np.linalg.norm(over_u_e(pile, results.cases, extent, h, 500), axis=-1)
        bed.imshow(speed, origin="lower", extent=extent, vmin=0, vmax=1.1, aspect="auto")
    _draw_bed(bed, pile)
    bed.set(ylim=(low, high), ylabel="$z/h$")

    grains = grains.assign(x=grains["x_m"] / h)
    goes = grains[np.isfinite(grains["ustar0_m_s"])]
    share = goes["ustar0_m_s"].rank(method="first") / len(grains)
    look: Look = {"s": 5, "cmap": "plasma", "vmin": 0, "vmax": 1, "gid": "thresholds"}
    map_.scatter(goes["x"], goes["ustar0_m_s"], c=share, **look)
    for at in grains["x"].drop(goes.index):
        map_.axvline(at, color="0.75", lw=0.3, zorder=0)
    first = goes[goes["ustar0_m_s"] > 0].nsmallest(1, "ustar0_m_s")
    for at, value in first[["x", "ustar0_m_s"]].to_numpy():
        map_.plot(at, value, "v", ms=7, mfc="none", mec="#d55e00", gid="first")
        text = f"first, at {value:.3g} m/s"
        map_.annotate(text, (at, value), (0, 9), textcoords="offset points")
    map_.margins(y=0.15)
    map_.set_yscale("log")
    style.plain_ticks(map_.yaxis)
    map_.set(xlabel=_x_label(pile), ylabel=r"goes at $u^\star_0$, m/s")


def shape(bed: PileBed) -> str:
    """A bed line in a few words."""
    words = [str(bed.profile or bed.form.label or bed.shape), *map(str, bed.obstacles)]
    if bed.forms > 1:
        every = f" every {bed.spacing:g} m" if bed.spacing else ""
        words[0] = f"{bed.forms} × {words[0]}{every}"
    return ", ".join(words)


def hills(results: Results) -> Iterator[Figure]:
    """Hills over which others measured the flow, a panel each: computed beside measured."""
    listed = list(measured_hills(results))
    if not listed:
        return
    flows, table = pd.concat([rows for _, rows in listed]), results.tables["wall_stress"]
    canvas = style.canvas(2.7 * len(listed) + 0.3)
    panels = canvas.subplots(2 * len(listed), 1, sharex=True, height_ratios=[3, 1] * len(listed))
    measured: Look = {"color": "black", "lw": 1.2, "gid": "measured"}
    for number, (aspect, rows) in enumerate(listed):
        along, back = panels[2 * number : 2 * number + 2]
        for place, (_, row) in enumerate(rows.iterrows()):
            stress = table[table["flow_case"] == row["flow_case"]]
            line = results.flows[row["flow_case"]].model.line
            x = (stress["x_m"].to_numpy(float) - line.crest[0]) / line.h
            colour = MODELS[row["turbulence_model"]]
            along.plot(x, stress["ustar_over_ustar0_wall"], color=colour, lw=1.0, gid="stress")
            ends = [row["separation_over_h"], row["reattachment_over_h"]]
            back.plot(ends, [place, place], color=colour, lw=3, gid="reversed flow")
        end = rows["measured_reattachment_over_h"].iloc[0]
        if end > 0:
            back.axvline(end, **measured)
        if rows["reattachment_over_h"].isna().all():
            back.text(0.5, 0.5, "no reversed flow", transform=back.transAxes, **style.NOTE)
        along.axhline(0, color="0.4", lw=0.6)
        along.set(ylabel=USTAR)
        along.set_title(f"half length {aspect:g} h, {rows['alpha_deg'].iloc[0]:.3g}°", loc="left")
        back.set(yticks=[], ylim=(len(rows) - 0.3, -0.7), ylabel="reversed")
    panels[-1].set(xlabel="$x/h$ from the top", xlim=(-9, 13))
    names = [name for name in MODELS if name in set(flows["turbulence_model"])]
    colours = [style.entry(labels.value("turbulence_model", name), MODELS[name]) for name in names]
    unverified = "" if flows["measured_verified"].all() else " (unverified)"
    entry = Line2D([], [], label=f"measured end of the reversed flow{unverified}", **measured)
    has_end = (flows["measured_reattachment_over_h"] > 0).any()
    style.legends(canvas, colours, [entry] if has_end else [])
    cases, title = tuple(flows["flow_case"]), "Hills that others measured"
    yield Figure("hills", title, caption("hills"), cases, canvas, first=True)
