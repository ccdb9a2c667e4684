"""Figures of flows: stress along the bed, velocity, mesh, measured hills."""

from collections.abc import Iterator, Sequence
from functools import lru_cache, partial
from itertools import groupby
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle
from numpy.lib.stride_tricks import sliding_window_view

from orchestrator.flow.foam import SolvedFlow
from orchestrator.grains.pile import Pile
from orchestrator.report import labels, style
from orchestrator.report.page import caption
from orchestrator.report.results import Results, measured_hills
from orchestrator.report.style import Figure, Look
from orchestrator.report.subjects import place_of_file
from orchestrator.runs.case import is_whole
from orchestrator.runs.files import state_of
from orchestrator.study import fields
from orchestrator.study.method import Turbulence
from orchestrator.types import FloatArray

ESTIMATES: dict[str, Look] = {
    "wall": {
        "label": "wall stress",
        "color": "black",
        "lw": 1.3,
    },
    "eq10": {
        "label": "Eq. 10, ln((zₑ + z₀)/z₀)",
        "color": "#0072b2",
        "lw": 1.0,
    },
}
"""Looks of the estimates of the friction velocity, by the ending of their column."""
FELT: Look = {
    "label": "as the grains feel it (averaged)",
    "gid": "grains",
    "color": "#f0a35e",
    "lw": 0,
    "marker": ".",
    "ms": 7,
    "zorder": 1.5,
}
REVERSED: Look = {
    "label": "reversed flow",
    "gid": "reversed flow",
    "color": "0.85",
    "lw": 0,
}
MODEL_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
MODELS = dict(zip(get_args(Turbulence), MODEL_COLOURS, strict=True))
"""Colours of the turbulence models."""
USTAR = "u*/u*₀"
SMOOTH = np.hanning(31) / np.hanning(31).sum()
"""Weights of the neighbours of a point that smooth a streamline."""
BACK = np.array([0.9, 0.6, 0.3])
"""Streamlines in reversed flow, over the least value of the stream function."""
Window = tuple[float, float, float, float]
"""Left, right, bottom, top."""


def _solved(directory: Path) -> SolvedFlow:
    """The flow in the directory of a case, as it is now."""
    mesh = directory / "constant" / "polyMesh"
    states = tuple(state_of(mesh / name) for name in ("points", "faces", "owner"))
    return _solved_once(directory, states)


@lru_cache(maxsize=16)
def _solved_once(directory: Path, mesh: tuple[tuple[int, ...], ...]) -> SolvedFlow:
    """The flow in the directory; its mesh is read once, in a fifth of a second."""
    return SolvedFlow(directory)


def _title(results: Results, pile: Pile) -> str:
    """A pile by its slope, height and roughness, and fields in which flows differ.

    That of a profile says where its x/h is zero.
    """
    names = ["alpha_deg", "h_m", "z0_m", *results.flow_fields]
    values = [fields.COLUMNS[name].used(pile.scene) for name in names]
    title = labels.panel(pd.Series(values, names, dtype=object), names)
    profile = pile.bed.profile
    if profile is None:
        return title
    zero = f"x/h from x = {place_of_file(profile.origin[0], profile)} m"
    return f"{title}, {zero} towards {profile.towards}"


def _kinds(results: Results) -> list[list[Pile]]:
    """Piles with flows by slope, height and fields that vary, each by rising z0."""

    def kind(pile: Pile) -> tuple[float, float, str]:
        varied = [
            str(fields.COLUMNS[name].used(pile.scene)) for name in results.flow_fields
        ]
        return pile.bed.slope_deg, pile.bed.height, ", ".join(varied)

    def by_kind_and_roughness(pile: Pile) -> tuple[float, float, str, float]:
        return *kind(pile), pile.bed.roughness

    piles = sorted(results.flows.values(), key=by_kind_and_roughness)
    return [list(alike) for _, alike in groupby(piles, kind)]


def drawn(results: Results) -> list[Pile]:
    """A pile for each kind of flow whose files are kept.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    list of Pile
        The piles.
    """
    found = []
    for kind in _kinds(results):
        kept = [pile for pile in kind if is_whole(pile.flow, results.cases)]
        found += kept[:1]
    return found


def stress(results: Results) -> Iterator[Figure]:
    """The friction velocity along beds, for each slope at its least and largest z0.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        The figures.
    """
    piles = []
    for smoothest, *rougher in _kinds(results):
        piles += [smoothest, *rougher[-1:]]
    if not piles:
        return
    names = tuple(pile.flow.name for pile in piles)
    mean, crest = eq10_over_wall(results, names)
    lengths = [
        labels.value("averaging_length", pile.scene.forces.averaging_length)
        for pile in piles
    ]
    averaged = ", ".join(dict.fromkeys(lengths))
    text = caption(
        "stress",
        mean=f"{mean:+.0%}",
        crest=f"{crest:+.0%}",
        averaged=f"max(d, {averaged})",
    )
    title = "Friction velocity over the pile"
    draw = partial(_stress, results, piles)
    tables = ("wall_stress",)
    yield Figure("wall-stress", title, text, names, draw, fold=True, tables=tables)


def _stress(results: Results, piles: list[Pile]) -> Canvas:
    titles = [_title(results, pile) for pile in piles]
    figure, axes = style.grid(titles, 2.6, "x/h", USTAR)
    for ax, pile in zip(axes, piles, strict=True):
        _along(results, pile, ax)
    toes = [pile.model.line.x[-2] / pile.bed.height for pile in piles]
    axes[0].set_xlim(-4, max(toes) + 10)
    style.legends(figure, [], style.samples(axes))
    return figure


def stress_on(pile: Pile, results: Results) -> pd.DataFrame:
    """Find the stress along the bed of a pile whose flow is solved.

    Parameters
    ----------
    pile
        The pile.
    results
        The study with its tables.

    Returns
    -------
    DataFrame
        Rows of the table ``wall_stress``. Scenes may share a flow and be of files with
        other axes: x is that of the pile's.
    """
    table = results.tables.get("wall_stress", pd.DataFrame())
    if table.empty:
        return table
    rows: pd.DataFrame = table[table["flow_case"] == pile.flow.name]
    if rows.empty or not pile.bed.profile:
        return rows
    along = results.flows[pile.flow.name].bed.along(rows["x_m"])
    return rows.assign(x_m=pile.bed.place(along))


def _along(results: Results, pile: Pile, ax: Axes) -> None:
    """Friction velocities along the bed of a pile, over the bed."""
    bed = pile.bed
    h = bed.height
    rows = stress_on(pile, results)
    rows = rows.replace([np.inf, -np.inf], np.nan)
    x = bed.along(rows["x_m"]) / h
    wall = rows["ustar_over_ustar0_wall"].to_numpy()
    for name, look in ESTIMATES.items():
        ax.plot(x, rows[f"ustar_over_ustar0_{name}"], gid=name, **look)
    ax.axhline(0, color="0.4", lw=0.6)
    ax.fill_between(x, wall, 0, where=(wall < 0).tolist(), **REVERSED)
    grains = results.joined("pile_grain")
    if len(grains):
        grains = grains[grains["flow_case"] == pile.flow.name]
    if len(grains):
        # of the scenes that share the flow, the last
        grains = grains[grains["scene_id"] == grains["scene_id"].max()]
        bed = results.plan.piles[str(grains["scene_id"].iloc[0])].bed
        ax.plot(bed.along(grains["x_m"]) / h, grains["ustar_over_ustar0"], **FELT)
    ax.margins(y=0.25)
    line = pile.model.line
    low = min(line.z) / h
    high = max(line.z) / h
    below = ax.twinx()
    below.set(ylim=(low - 0.2, low + 6 * (high - low)), yticks=[])
    _draw_bed(below, pile)
    ax.set(zorder=1, frame_on=False)  # the lines lie over the bed


def eq10_over_wall(
    results: Results, flow_cases: tuple[str, ...]
) -> tuple[float, float]:
    """Compare u* by Eq. 10 with that of the wall stress.

    Parameters
    ----------
    results
        The study with its tables.
    flow_cases
        Names of the flows.

    Returns
    -------
    mean, crest : float
        Relative differences: the mean of windward faces, the largest of their crests.
    """
    table = results.tables["wall_stress"]
    means = []
    crests = []
    for name, rows in table[table["flow_case"].isin(flow_cases)].groupby("flow_case"):
        crest_s = results.flows[str(name)].model.line.crest_s
        face = rows[(rows["s_m"] > 0) & (rows["s_m"] < crest_s)]
        wall = face["ustar_over_ustar0_wall"]
        eq10 = face["ustar_over_ustar0_eq10"]
        means.append(eq10.mean() / wall.mean() - 1)
        crests.append(eq10.max() / wall.max() - 1)
    return float(np.mean(means)), float(np.max(crests))


def over_u_e(
    pile: Pile, cases: Path, window: Window, unit: float, width: int = 800
) -> FloatArray:
    """Velocity over U_e on a grid.

    Parameters
    ----------
    pile
        A pile whose flow is solved.
    cases
        Directory of the cases.
    window
        Left, right, bottom and top, in units of `unit`.
    unit
        A length, m.
    width
        Columns of the grid.

    Returns
    -------
    array of shape (rows, width, 3)
        Rows upwards; NaN outside the mesh.
    """
    left, right, bottom, top = np.multiply(window, unit)
    rows = round(width * (top - bottom) / (right - left))
    x = np.linspace(left, right, width)
    z = np.linspace(bottom, top, rows)
    bed = pile.flow.bed_line
    lid = pile.flow.lid * pile.flow.height_m
    above = z - bed.height(x)[:, None]
    is_beside = (x < bed.x[0]) | (x > bed.x[-1])
    is_outside = (above < 0) | (z > lid) | is_beside[:, None]
    # a height of 1 stands for those that are not used
    heights = np.where(is_outside, 1.0, np.maximum(above, 1e-12))
    values = _solved(cases / pile.flow.name).at("U", x, heights, bed)
    grid = np.where(is_outside[..., None], np.nan, values.reshape(*above.shape, 3))
    return np.asarray(grid.swapaxes(0, 1) / pile.scene.method.flow.speed)


def flow(results: Results) -> Iterator[Figure]:
    """Speed and streamlines: a panel for each slope and height, at its least z0.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        One figure, or none.
    """
    for name, title, shown in style.pages(drawn(results)):
        settings = [pile.scene.method.flow for pile in shown]
        models = [
            labels.value("turbulence_model", each.turbulence_model) for each in settings
        ]
        speeds = [labels.value("solve_u_e_m_s", each.speed) for each in settings]
        text = caption(
            "flow",
            models=", ".join(dict.fromkeys(models)),
            speeds=", ".join(dict.fromkeys(speeds)),
            lid=not any(pile.scene.flow.depth for pile in shown),
        )
        cases = tuple(pile.flow.name for pile in shown)
        figure = _speeds(results, shown)
        title = f"Flow over the pile{title}"
        yield Figure(f"flow{name}", title, text, cases, figure, fold=bool(name))


def _speeds(results: Results, shown: Sequence[Pile]) -> Canvas:
    """A panel for each pile: the speed over U_e in colours, streamlines, the bed."""
    toe = max(pile.model.line.x[-2] / pile.bed.height for pile in shown)
    window = (-2.0, toe + 8.0, 0.0, 3.0)
    left, right, bottom, top = window
    height = (style.WIDTH - sum(style.SIDES)) * (top - bottom) / (right - left)
    titles = [_title(results, pile) for pile in shown]
    figure, axes = style.grid(titles, height, "x/h", "z/h", 1)
    for ax, pile in zip(axes, shown, strict=True):
        velocity = over_u_e(pile, results.cases, window, pile.bed.height)
        speed = np.linalg.norm(velocity, axis=-1)
        image = ax.imshow(
            speed, origin="lower", extent=window, vmin=0, vmax=1.1, interpolation="none"
        )
        _streamlines(ax, window, velocity)
        _draw_bed(ax, pile)
        ax.set(aspect="auto", xlim=(left, right), ylim=(bottom, top), yticks=range(4))
    _speed_bar(figure, image)
    return figure


def _speed_bar(figure: Canvas, image: AxesImage) -> None:
    """The bar of the colours of speeds, below the panels."""
    style.extend(figure, 0.0, 0.55)
    inch = 1 / figure.get_figheight()
    place = figure.add_axes((0.1, 0.4 * inch, 0.88, 0.1 * inch))
    bar = figure.colorbar(image, cax=place, orientation="horizontal")
    bar.set_label("speed over that of the approaching flow at 10 h, |u|/Uₑ")


def _draw_bed(ax: Axes, pile: Pile) -> None:
    """The bed under the flow, in h."""
    x, z = pile.model.line.corners.T / pile.bed.height
    ax.fill_between(x, z, z.min() - 1, color=style.BED, lw=0)
    ax.plot(x, z, color="0.2", lw=0.8, gid="bed")


def _streamlines(ax: Axes, window: Window, velocity: FloatArray) -> None:
    """Contours of the stream function.

    It is integrated from above, from the bed where the flow runs back.
    """
    rows, columns, _ = velocity.shape
    left, right, bottom, top = window
    x = np.linspace(left, right, columns)
    z = np.linspace(bottom, top, rows)
    from_above, above_bed = _stream_functions(x, z, velocity)
    forward = np.linspace(0, above_bed[-1, 0], 12)[1:]
    back = np.nanmin(above_bed) * BACK
    look: Look = {"colors": "white", "linewidths": 0.45, "linestyles": "solid"}
    for psi, levels in ((from_above, forward), (above_bed, back[back < 0])):
        inside = np.where(np.isnan(velocity[..., 0]), np.nan, _smooth(psi))
        ax.contour(x, z, inside, levels, **look)


def _stream_functions(
    x: FloatArray, z: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The stream function integrated from above, and that from the bed."""
    w_at_top = velocity[-1, :, 2]
    above_bed = np.cumsum(np.nan_to_num(velocity[..., 0]), axis=0) * (z[1] - z[0])
    through_top = above_bed[-1, 0] - np.cumsum(w_at_top) * (x[1] - x[0])
    return through_top - (above_bed[-1] - above_bed), above_bed


def _smooth(psi: FloatArray) -> FloatArray:
    """A stream function without the steps in which the grid meets the bed.

    The integral from there carries them upwards.
    """
    half = SMOOTH.size // 2
    wide = np.pad(psi, ((0, 0), (half, half)), "symmetric")
    return np.asarray(sliding_window_view(wide, SMOOTH.size, axis=1) @ SMOOTH)


def mesh(results: Results) -> Iterator[Figure]:
    """The mesh of the study's least slope, which stands for all, and its crest.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        One figure, or none.
    """
    for pile in drawn(results)[:1]:
        first_over_z0 = pile.flow.first_cell_m / pile.bed.roughness
        text = caption(
            "mesh",
            cells=pile.flow.settings.cells_per_face,
            first=f"{first_over_z0:.3g}",
            lid=not pile.scene.flow.depth,
        )
        draw = partial(_mesh, results, pile)
        yield Figure(
            "mesh", "Mesh of the flow", text, (pile.flow.name,), draw, fold=True
        )


def _mesh(results: Results, pile: Pile) -> Canvas:
    line = pile.model.line
    h = pile.bed.height
    x, z = line.crest / h
    whole = (-2.0, line.x[-2] / h + 2.0, 0.0, 2.5)
    crest = (x - 0.7, x + 0.7, z - 0.25, z + 0.25)
    shapes = [
        (top - bottom) / (right - left) for left, right, bottom, top in (whole, crest)
    ]
    figure = style.canvas(6.4 * sum(shapes) + 0.8)
    axes = list(figure.subplots(2, 1, height_ratios=shapes))
    edges = read_edges(results.cases / pile.flow.name) / h
    for ax, window in zip(axes, (whole, crest), strict=True):
        _draw_edges(ax, edges, window)
        _draw_bed(ax, pile)
    left, right, bottom, top = crest
    look: Look = {"fc": "none", "ec": "#d55e00", "lw": 1}
    axes[0].add_patch(Rectangle((left, bottom), right - left, top - bottom, **look))
    axes[0].set_title(_title(results, pile), loc="left")
    axes[1].set_title("the crest", loc="left")
    return figure


def _draw_edges(ax: Axes, edges: FloatArray, window: Window) -> None:
    """The edges of a mesh, of shape (E, 2, 2), that reach into a window."""
    left, right, bottom, top = window
    low = edges.min(axis=1)
    high = edges.max(axis=1)
    is_shown = (high >= [left, bottom]).all(axis=1) & (low <= [right, top]).all(axis=1)
    # as one line with gaps: thousands of lines would take seconds and megabytes
    after_each = ((0, 0), (0, 1), (0, 0))
    ends = np.pad(edges[is_shown], after_each, constant_values=np.nan)
    ax.plot(*ends.reshape(-1, 2).T, color="0.25", lw=0.3, gid="mesh")
    ax.set(xlim=(left, right), ylim=(bottom, top))
    ax.set(aspect="equal", xlabel="x/h", ylabel="z/h")


def read_edges(case: Path) -> FloatArray:
    """The edges of a mesh one cell deep, seen across the flow.

    Parameters
    ----------
    case
        Directory of a flow.

    Returns
    -------
    array of shape (E, 2, 2)
        x and z of both ends of each edge, m.
    """
    import pyvista  # half a second, for which a page without this figure does not wait

    reader = pyvista.POpenFOAMReader(str(case / "system" / "controlDict"))
    # the fields at the start have expressions that VTK cannot read, and are not needed
    reader.skip_zero_time = True
    cells: Any = reader.read()["internalMesh"]
    edges = cells.extract_all_edges()
    ends: FloatArray = np.asarray(edges.points, float)[
        edges.lines.reshape(-1, 3)[:, 1:]
    ]
    is_front = (ends[..., 1] < ends[..., 1].mean()).all(axis=1)
    return np.asarray(ends[is_front][..., [0, 2]])


def hills(results: Results) -> Iterator[Figure]:
    """Draw hills over which others measured the flow: computed beside measured.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        One figure with a panel for each hill, or none.
    """
    listed = list(measured_hills(results))
    if not listed:
        return
    flows = pd.concat([rows for _, rows in listed])
    titles = []
    for half_length, rows in listed:
        titles.append(
            f"half length {half_length:g} h, {rows['alpha_deg'].iloc[0]:.3g}°"
        )
    figure, axes = style.grid(titles, 2.1, "x/h from the top", USTAR, 1)
    label = "measured end of the reversed flow"
    if not flows["measured_verified"].all():
        label += " (unverified)"
    for ax, (_, rows) in zip(axes, listed, strict=True):
        _draw_hill(ax, results, rows)
        end = rows["measured_reattachment_over_h"].iloc[0]
        if end > 0:
            ax.axvline(end, color="black", lw=1.2, gid="measured", label=label)
        ax.axhline(0, color="0.4", lw=0.6)
    axes[0].set_xlim(-9, 13)
    used = set(flows["turbulence_model"])
    colours = []
    for name, colour in MODELS.items():
        if name in used:
            colours.append(style.entry(labels.value("turbulence_model", name), colour))
    style.legends(figure, colours, style.samples(axes))
    cases = tuple(flows["flow_case"])
    title = "Hills that others measured"
    text = caption("hills")
    yield Figure("hills", title, text, cases, figure, leads=True, tables=("flow",))


def _draw_hill(ax: Axes, results: Results, rows: pd.DataFrame) -> None:
    """The stress on one hill and the reversed flow behind it, by turbulence model."""
    table = results.tables["wall_stress"]
    for place, (_, row) in enumerate(rows.iterrows()):
        stress = table[table["flow_case"] == row["flow_case"]]
        line = results.flows[row["flow_case"]].model.line
        x = (stress["x_m"].to_numpy(float) - line.crest[0]) / line.h
        colour = MODELS[row["turbulence_model"]]
        ax.plot(x, stress["ustar_over_ustar0_wall"], lw=1.0, gid="stress", color=colour)
        ends = [row["separation_over_h"], row["reattachment_over_h"]]
        level = -0.7 - 0.15 * place
        ax.plot(ends, [level, level], lw=3, gid="reversed flow", color=colour)
