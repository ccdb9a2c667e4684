"""The figures of a comparison: the solvers' answers over the expected ones."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.verdict import Contender, ours
from orchestrator.physics import curves
from orchestrator.report import labels, style
from orchestrator.report.figure import Figure

PANELS = 6
"""Most scenes of a kind that are drawn; they are spread over the pack."""
FLOOR = 1e-6
"""Least error that a logarithmic axis shows: exact formulas and reruns have less."""
EXPECTED = "0.25"
"""Colour of what is expected, and of ours."""
LEVELS = {1: "o", 2: "s", 3: "D", 4: "^", 5: "v"}
"""Markers."""
Answers = Sequence[tuple["pd.Series[float]", style.Look]]
"""Each solver's numbers, and how they look."""
Panel = Callable[[Axes, pd.DataFrame, Answers], None]
"""Draws a scene: what is expected, and the answers."""


def beds(pack: Pack, contenders: Sequence[Contender]) -> Iterator[Figure]:
    """The figures of flows and piles for which there are answers."""
    panels: Mapping[str, Panel] = {"flow": _along_bed, "pile": _moved, "line": _moved}
    for kind, panel in panels.items():
        names = [v.scene for v in contenders[0].verdicts if v.kind == kind]
        drawn = [name for name in names if name in _answered(contenders)]
        if drawn:
            yield _panels(pack, contenders, kind, drawn, panel)
    if (contenders[0].rows["quantity"] == "shields").any():
        yield _shields(pack, contenders)


def _answered(contenders: Sequence[Contender]) -> set[str]:
    return {name for one in contenders for name in one.rows["scene"][one.rows["found"].notna()]}


def _looks(contenders: Sequence[Contender]) -> list[style.Look]:
    """A colour for each solver, and rings one in the other: equal answers hide none."""
    colours = style.palette("d_m", range(len(contenders))).values()
    sizes = range(2 * len(contenders) + 1, 1, -2)
    return [
        {"color": colour, "ms": size, "mfc": "none", "mew": 0.7}
        for colour, size in zip(colours, sizes, strict=True)
    ]


def _names(contenders: Sequence[Contender]) -> list[Artist]:
    looks = zip(contenders, _looks(contenders), strict=True)
    return [style.entry(one.name, look["color"]) for one, look in looks]


TITLES = {
    "flow": ("stress", "Friction velocity along the bed"),
    "pile": ("moved", "Grains that have moved, under the given stress"),
    "line": ("moved-line", "Grains that have moved, with the solver's own flow"),
}


def _panels(
    pack: Pack, contenders: Sequence[Contender], kind: str, names: Sequence[str], panel: Panel
) -> Figure:
    chosen = [names[i] for i in np.unique(np.linspace(0, len(names) - 1, PANELS).astype(int))]
    columns = min(len(chosen), 3)
    lines = -(-len(chosen) // columns)
    canvas = style.canvas(0.6 + 2.0 * lines)
    axes = np.atleast_1d(canvas.subplots(lines, columns, squeeze=False)).ravel()
    for ax, name in zip(axes, chosen, strict=False):
        rows = contenders[0].rows[contenders[0].rows["scene"] == name]
        found = [one.rows["found"][rows.index] for one in contenders]
        panel(ax, rows, list(zip(found, _looks(contenders), strict=True)))
        ax.set_title(f"{name}\n{pack.about(name)}", size=6.5)
    for ax in axes[len(chosen) :]:
        ax.remove()
    expected = Line2D([], [], color=EXPECTED, label="expected, interval")
    style.legends(canvas, [*_names(contenders), expected], [])
    stem, title = TITLES[kind]
    caption = (
        f"{len(chosen)} of {len(names)} scenes. The line and its band are the expected answer and"
        " its interval, the rings are the solvers'."
    )
    return Figure(stem, title, caption, (), canvas)


def _along_bed(ax: Axes, rows: pd.DataFrame, answers: Answers) -> None:
    here = rows[rows["quantity"] == "ustar_over_ustar0"]
    s = here["at"].astype(float)
    ax.plot(s, here["value"], color=EXPECTED)
    for found, look in answers:
        ax.plot(s, found[here.index], "o", **look)
    ax.set(xlim=(-3, 12), xlabel="s/h", ylabel="u*/u*₀")


def _moved(ax: Axes, rows: pd.DataFrame, answers: Answers) -> None:
    here = rows[rows["quantity"] == "moved"]
    load_step = here["at"].astype(float)
    rest = rows[rows["quantity"] == "not_moved"]["value"].iloc[-1]
    total = here["value"].iloc[-1] + rest
    ax.fill_between(load_step, here["low"] / total, here["high"] / total, color="0.85", lw=0)
    ax.plot(load_step, here["value"] / total, color=EXPECTED)
    for found, look in answers:
        ax.plot(load_step, found[here.index] / total, "o", **look)
    ax.set(ylim=(0, 1), xlabel="load_step", ylabel="n/N")


def _shields(pack: Pack, contenders: Sequence[Contender]) -> Figure:
    rows = contenders[0].rows
    here = rows[rows["quantity"] == "shields"]
    told = [pack.scenes[name] for name in here["scene"]]
    # of theta = rho_f u*^2/((rho_sol - rho_f) g d) and Re* = u* d/nu
    unit = np.array([_velocity(one) * one["d_m"] / one["nu_m2_s"] for one in told])
    level = np.array([one["level"] for one in told])
    canvas = style.canvas(3.8)
    ax = canvas.subplots()
    for curve in curves.WATER:
        x, y = curve.points()
        ax.plot(x, y, color=style.WATER, lw=0.8)
    theta = here["value"].to_numpy(float)
    spread = np.abs(here[["low", "high"]].to_numpy(float).T - theta)
    ax.errorbar(unit * np.sqrt(theta), theta, spread, fmt="none", ecolor=EXPECTED, elinewidth=0.7)
    for one, look in zip(contenders, _looks(contenders), strict=True):
        found = one.rows["found"][here.index].to_numpy(float)
        found = np.where(found > 0, found, np.nan)
        for number in sorted(set(level)):
            at = level == number
            ax.plot(unit[at] * np.sqrt(found[at]), found[at], LEVELS[number], **look)
    ax.set(xscale="log", yscale="log", xlabel=labels.RE_AXIS, ylabel=labels.TAU_AXIS)
    reynolds = unit * np.sqrt(theta)
    ax.set_xlim(reynolds.min() / 3, reynolds.max() * 3)
    ax.set_ylim(min(theta.min(), 0.02) / 2, max(theta.max(), 0.2) * 2)
    style.plain_ticks(ax.xaxis)
    style.plain_ticks(ax.yaxis)
    expected = style.entry("expected, interval", EXPECTED)
    water = Line2D([], [], color=style.WATER, label="curves for water")
    style.legends(canvas, [*_names(contenders), expected], [*_level_entries(level), water])
    caption = "Thresholds in the Shields diagram: bars are the intervals of the expected answers."
    return Figure("shields", "Thresholds", caption, (), canvas)


def _velocity(told: Mapping[str, Any]) -> float:
    """The u* at which theta is 1, m/s."""
    excess = (told["rho_sol_kg_m3"] - told["rho_f_kg_m3"]) * told["g_m_s2"] * told["d_m"]
    return float(np.sqrt(excess / told["rho_f_kg_m3"]))


def _level_entries(levels: Any) -> list[Artist]:
    return [
        Line2D([], [], color="0.3", marker=LEVELS[n], mfc="none", ls="none", label=f"level {n}")
        for n in sorted(set(levels))
    ]


def speed(contenders: Sequence[Contender]) -> Iterator[Figure]:
    """Error against CPU time, each solver's and ours, where times are known."""
    verdicts = [v for one in contenders for v in one.verdicts]
    if not any(v.cpu_s > 0 and v.worst == v.worst for v in verdicts):
        return
    levels = sorted({v.level for v in verdicts})
    canvas = style.canvas(3.8)
    ax = canvas.subplots()
    own: style.Look = {"color": EXPECTED, "ms": 3, "mew": 0.7}
    looks = [own, *({**look, "ms": 4} for look in _looks(contenders))]
    for one, look in zip((ours(contenders), *contenders), looks, strict=True):
        for level in levels:
            of = [v for v in one.verdicts if v.level == level]
            error = [max(v.worst, FLOOR) if v.worst == v.worst else np.nan for v in of]
            ax.plot([v.cpu_s for v in of], error, LEVELS[level], **look)
    ax.set(xscale="log", yscale="log", xlabel="CPU time of a scene, s", ylabel="largest error")
    style.plain_ticks(ax.xaxis)
    names = [style.entry("ours", EXPECTED), *_names(contenders)]
    style.legends(canvas, names, _level_entries(levels))
    caption = (
        "Each point is a scene: CPU time, and largest relative error of its judged numbers; ours is"
        f" filled. Errors below {FLOOR:g} are drawn there: at levels 3 to 5 the expected answer is"
        " our own run."
    )
    yield Figure("speed-accuracy", "Speed and accuracy", caption, (), canvas)
