"""The friction velocity along the bed of a pile, over the undisturbed one."""

from collections.abc import Iterator

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.figure import SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from orchestrator.bed.line import BedLine
from orchestrator.grains.pile import Pile
from orchestrator.report import captions, labels, style
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results
from orchestrator.report.style import Look
from orchestrator.study import fields

FloatArray = NDArray[np.float64]

ESTIMATES: dict[str, tuple[str, Look]] = {
    "ustar_over_ustar0_wall": ("wall stress", {"color": "black", "lw": 1.3}),
    "ustar_over_ustar0_eq10": ("Eq. 10, $\\ln((z_e+z_0)/z_0)$", {"color": "#0072b2", "lw": 1.0}),
    "ustar_over_ustar0_eq10_printed": (
        "Eq. 10 as printed, $\\ln(z_e/z_0)$",
        {"color": "#56b4e9", "lw": 1.0, "ls": "--"},
    ),
}
GRAINS: Look = {"color": "#f0a35e", "lw": 3.0}
REVERSED: Look = {"color": "0.85", "lw": 0}
BEFORE, BEHIND = 4.0, 10.0
"""Bed shown before the windward and behind the lee toe, h."""
GAP = 3.0
"""Distance of neighbouring counted grains, over the median one, across which no line joins them."""
FLAT = 0.05
"""Height over the level beside a form up to which the bed belongs to that level, h."""
Kind = tuple[float, float, str]
SOLVED = [name for name, one in fields.COLUMNS.items() if one.info.scope == "solved flows"]
NOTABLE_RATIO = 1.5
"""Roughness lengths of one slope that differ by less share their panel's story."""


def draw(results: Results) -> Iterator[Figure]:
    """One figure with a panel for each slope, at its least and largest z0."""
    chosen = choose(results)
    if not chosen:
        return
    rows = -(-len(chosen) // 2) if len(chosen) > 1 else 1
    figure = style.canvas(3.0 * rows + 0.4)
    panels = figure.subfigures(rows, 2 if len(chosen) > 1 else 1, squeeze=False).ravel()
    for panel, pile in zip(panels, chosen, strict=False):
        _panel(panel, results, pile)
    _legend(figure, felt="pile_grain" in results.tables)
    names = tuple(pile.flow.name for pile in chosen)
    caption = captions.stress(results, chosen)
    yield Figure(
        "wall-stress", "Friction velocity over the pile", caption, names, figure, fold=True
    )


def choose(results: Results) -> list[Pile]:
    """Piles whose flows stand for all.

    Each kind gives its pile with the least z0, and the one with the largest if that differs much.
    """
    found: dict[Kind, list[Pile]] = {}
    for pile in results.flows.values():
        found.setdefault(kind(results, pile), []).append(pile)
    chosen = []
    for _, piles in sorted(found.items(), key=lambda item: item[0]):
        piles.sort(key=lambda pile: pile.bed.roughness)
        chosen.append(piles[0])
        if piles[-1].bed.roughness > NOTABLE_RATIO * piles[0].bed.roughness:
            chosen.append(piles[-1])
    return chosen


def kind(results: Results, pile: Pile) -> Kind:
    """The key of the flow over a pile but for its z0: slope, height, own fields."""
    row = results.asked(pile)
    chosen = " ".join(str(row[column]) for column in _own_fields(results))
    return pile.bed.slope_deg, pile.bed.height, chosen


def _own_fields(results: Results) -> list[str]:
    """The fields of the solved flow that the study varies."""
    piles = results.beds("pile")
    return [column for column in SOLVED if piles[column].nunique(dropna=False) > 1]


def _panel(panel: SubFigure, results: Results, pile: Pile) -> None:
    top, below = panel.subplots(2, 1, sharex=True, height_ratios=[4, 1])
    table = results.tables["wall_stress"]
    rows = table[table["flow_case"] == pile.flow.name]
    h = pile.bed.height
    x = rows["x_m"].to_numpy(float) / h
    for column, (_, look) in ESTIMATES.items():
        values = rows[column].to_numpy(float)
        top.plot(x, np.where(np.isfinite(values), values, np.nan), gid=column, **look)
    _shade_reversed(top, x, rows["ustar_over_ustar0_wall"].to_numpy(float))
    top.set_ylim(top=1.25 * top.get_ylim()[1])
    _draw_grains(top, results, pile)
    _profile(below, x, rows["z_m"].to_numpy(float) / h)
    _mark_corners((top, below), pile)
    toe = pile.model.line.x[-2] / h
    top.set(xlim=(-BEFORE, toe + BEHIND), ylabel=r"$u^\star/u^\star_0$")
    top.set_title(title(results, pile), loc="left")


def title(results: Results, pile: Pile) -> str:
    """Heading of a panel with one flow."""
    row, ratio = results.asked(pile), pile.bed.height / pile.bed.roughness
    own = labels.panel(row, _own_fields(results))
    said = labels.panel(row, ["alpha_deg", "h_m"]), f"$z_0$ = h/{ratio:.0f}", own
    return ", ".join(text for text in said if text)


def _shade_reversed(ax: Axes, x: FloatArray, ustar: FloatArray) -> None:
    ax.axhline(0, color="0.4", lw=0.6)
    ax.fill_between(x, ustar, 0, where=(ustar < 0).tolist(), gid="reversed flow", **REVERSED)


def _draw_grains(ax: Axes, results: Results, pile: Pile) -> None:
    """Draw the stress on the grains, averaged over a length of the bed."""
    grains = results.joined("pile_grain")
    if grains.empty:
        return
    own = grains[grains["flow_case"] == pile.flow.name]
    if own.empty:
        return
    own = own.sort_values(["stress", "scene_id", "s_m"])
    one = own[own["scene_id"].isin(own["scene_id"].tail(1))]
    x, felt = (one[name].to_numpy(float) for name in ("x_m", "ustar_over_ustar0"))
    step = np.diff(one["s_m"].to_numpy(float), prepend=np.nan)
    first = step > GAP * np.nanmedian(step)  # of the counted grains behind a gap
    x, felt = (np.insert(values, np.flatnonzero(first), np.nan) for values in (x, felt))
    ax.plot(x / pile.bed.height, felt, gid="grains", zorder=1.5, **GRAINS)


def _profile(ax: Axes, x: FloatArray, z: FloatArray) -> None:
    ax.fill_between(x, z, -0.3, color=style.BED, lw=0)
    ax.plot(x, z, color="0.3", lw=0.8, gid="bed")
    ax.text(0.015, 0.6, "flow →", transform=ax.transAxes, fontsize=6.5, color="0.35")
    ax.set(xlabel="$x/h$ from the windward toe", ylabel="$z/h$", ylim=(-0.3, 1.4))
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))


def _mark_corners(axes: tuple[Axes, Axes], pile: Pile) -> None:
    line, h = pile.model.line, pile.bed.height
    for name, at in corners(line).items():
        x = line.x[at] / h
        for ax in axes:
            ax.axvline(x, color="0.6", lw=0.6, ls=(0, (4, 2)), zorder=0, gid=name)
        style.upright_note(axes[0], x - 0.1, name, at="top")


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


def _legend(figure: Canvas, felt: bool) -> None:
    entries: list[Artist] = [
        Line2D([], [], label=text, **look) for text, look in ESTIMATES.values()
    ]
    if felt:
        entries.append(Line2D([], [], label="as the grains feel it (averaged)", **GRAINS))
    entries.append(Patch(label="reversed flow", **REVERSED))
    style.legends(figure, [], entries)
