"""Beds that are more than one triangle: stress along each, and where motion starts."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.grains.pile import Pile
from orchestrator.report import labels, style
from orchestrator.report.flows import FELT, REVERSED, USTAR, stress_on
from orchestrator.report.page import caption
from orchestrator.report.results import Results
from orchestrator.report.style import Figure, Look
from orchestrator.report.subjects import place_of_file
from orchestrator.report.words import flow_at

BEDS = 4  # more do not fit a page
FIRST = "#c1121f"  # colour of the place where motion starts


def draw(results: Results) -> Iterator[Figure]:
    """Draw each bed by its first scene: stress, thresholds, bed line.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        One figure, or none.
    """
    grains = results.tables.get("pile_grain", pd.DataFrame())
    scenes: dict[str, pd.DataFrame] = {}
    if len(grains):
        scenes = {str(scene_id): rows for scene_id, rows in grains.groupby("scene_id")}
    shown = _first_scenes(results, scenes)[:BEDS]
    if not shown:
        return
    figure = _beds(results, {scene_id: scenes[scene_id] for scene_id in shown})
    piles = [results.plan.piles[scene_id] for scene_id in shown]
    names = tuple(dict.fromkeys(run.name for pile in piles for run in pile.runs))
    is_local = any(pile.length == 0 for pile in piles)
    leads = is_local or bool(piles[0].bed.profile)
    text = caption("where", local=is_local)
    title = "Where motion starts"
    tables = ("pile_grain",)
    yield Figure("where", title, text, names, figure, leads=leads, tables=tables)


def _beds(results: Results, scenes: Mapping[str, pd.DataFrame]) -> Canvas:
    """Three panels for each scene, by the thresholds of its grains."""
    figure = style.canvas(5.0 * len(scenes) + 0.9)
    heights = [1.5, 1.3, 0.7] * len(scenes)
    axes = figure.subplots(3 * len(scenes), 1, height_ratios=heights)
    for panels, (scene_id, rows) in zip(
        axes.reshape(-1, 3), scenes.items(), strict=True
    ):
        dots = _bed(results, scene_id, rows, tuple(panels))
    bar = figure.colorbar(dots, ax=list(axes), location="bottom", aspect=60, pad=0.02)
    bar.set_label("part that has gone by then, n/N")
    style.legends(figure, [], style.samples([*axes]))
    return figure


def _bed(
    results: Results, scene_id: str, rows: pd.DataFrame, panels: tuple[Axes, ...]
) -> Any:
    """The panels of a bed; the dots of its thresholds."""
    top, middle, below = panels
    pile = results.plan.piles[scene_id]
    dots = _thresholds(middle, rows)
    _stress(results, pile, rows, top)
    _bed_line(below, pile)
    ends = pile.model.line.x[1], pile.model.line.x[-2]
    low, high = sorted(pile.bed.place(ends).tolist())
    reach = 0.1 * (high - low)
    for ax in panels:
        ax.set_xlim(low - reach, high + reach)
    for ax in (top, middle):
        ax.tick_params(labelbottom=False)
    _first(results, scene_id, panels)
    return dots


def _first_scenes(results: Results, scenes: Mapping[str, pd.DataFrame]) -> list[str]:
    """The first scene of each bed that is neither the paper's triangle nor level."""
    lines: dict[Any, str] = {}
    for scene_id, pile in results.plan.piles.items():
        line = pile.model.line
        is_level = np.ptp(line.z) == 0
        if scene_id in scenes and not pile.bed.is_triangle and not is_level:
            lines.setdefault(line, scene_id)
    return list(lines.values())


def _bed_line(ax: Axes, pile: Pile) -> None:
    bed = pile.bed
    x = bed.place(pile.model.line.x)
    z = bed.level(pile.model.line.z)
    ax.fill_between(x, z, z.min() - 0.1 * np.ptp(z), color=style.BED, lw=0)
    ax.plot(x, z, color="0.2", lw=0.8, gid="bed")
    where = "x, m, from the foot of the first form"
    if bed.profile:
        towards = f"the flow goes towards {bed.profile.towards}"
        where = f"x of {bed.profile.name}, m; {towards}"
    ax.set(xlabel=where, ylabel="z, m")


def _stress(results: Results, pile: Pile, rows: pd.DataFrame, ax: Axes) -> None:
    """Friction velocity along a bed: by the solved flow, and as the grains feel it."""
    if pile.model.cases:
        wall = stress_on(pile, results)
        x = wall["x_m"].to_numpy()
        ustar = wall["ustar_over_ustar0_wall"].to_numpy()
        ax.plot(x, ustar, color="black", lw=1.1, label="wall stress", gid="wall")
        ax.fill_between(x, ustar, 0, where=(ustar < 0).tolist(), **REVERSED)
    felt = {**FELT, "label": "averaged, where the bed is counted"}
    ax.plot(rows["x_m"], rows["ustar_over_ustar0"], **felt)
    ax.axhline(0, color="0.4", lw=0.6)
    ax.set_title(_title(results, pile), loc="left")
    ax.set_ylabel(USTAR)


def _title(results: Results, pile: Pile) -> str:
    """A bed by its shape, height, obstacles, and the fields in which flows differ."""
    bed = pile.bed
    if bed.profile:
        shape = bed.profile.name
    else:
        shape = bed.form.label or bed.shape
        if bed.forms > 1:
            shape = f"{bed.forms} × {shape}"
    names = ["alpha_deg", "d_m", *results.flow_fields]
    first = results.beds("pile").iloc[0]
    values = pd.Series([first[name] for name in names], names, dtype=object)
    values["alpha_deg"] = bed.slope_deg
    values["d_m"] = pile.scene.grain.diameter
    obstacles = [str(obstacle) for obstacle in pile.scene.obstacles]
    title = [shape, f"h = {bed.height:.3g} m", *obstacles, labels.panel(values, names)]
    return ", ".join(title)


def _thresholds(ax: Axes, rows: pd.DataFrame) -> Any:
    """The undisturbed friction velocity at which each place or grain goes."""
    goes = np.isfinite(rows["ustar0_m_s"])
    flow = rows["ustar0_m_s"][goes]
    look: Look = {"s": 5, "cmap": "plasma", "vmin": 0, "vmax": 1, "gid": "thresholds"}
    dots = ax.scatter(
        rows["x_m"][goes], flow, c=flow.rank(method="first") / len(rows), **look
    )
    # one collection: by the method local these may be hundreds
    look = {
        "transform": ax.get_xaxis_transform(),
        "color": "0.75",
        "lw": 0.3,
        "zorder": 0,
    }
    ax.vlines(rows["x_m"][~goes], 0, 1, **look)
    ax.margins(y=0.15)
    ax.set(yscale="log", ylabel=r"threshold $u^\star_0$, m/s")
    style.plain_ticks(ax.yaxis)
    return dots


def _first(results: Results, scene_id: str, axes: tuple[Axes, ...]) -> None:
    """Mark the place where motion starts, with its numbers."""
    table = results.joined("pile_threshold")
    row = table[table["scene_id"] == scene_id].iloc[0]
    x, ustar = row["first_x_m"], row["first_ustar0_m_s"]
    if not np.isfinite(ustar):
        return
    for ax in axes:
        ax.axvline(x, color=FIRST, lw=0.8, zorder=0.5)
    profile = results.plan.piles[scene_id].bed.profile
    place = place_of_file(x, profile) if profile else f"{x:.4g}"
    text = f"x = {place} m\n{flow_at(row, ustar)}"
    text = text.replace(" (", "\n").replace(", ", "\n")
    text = text.rstrip(")").replace("u*₀", r"$u^\star_0$")
    low, high = axes[1].get_xlim()
    has_room = x < low + 0.8 * (high - low)
    look: Look = {
        "textcoords": "offset points",
        "va": "bottom",
        "color": FIRST,
        "fontsize": 7,
    }
    look |= {
        "ha": "left" if has_room else "right",
        "xytext": (8 if has_room else -8, 0),
    }
    axes[1].annotate(text, (x, ustar), gid="first", **look)
    axes[1].plot(
        [x], [ustar], "o", color=FIRST, mfc="none", label="motion starts", gid="start"
    )
