"""The figures of a comparison: the solver's answers over the expected ones."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator import curves
from orchestrator.benchmark.pack import Pack
from orchestrator.benchmark.verdict import Verdict
from orchestrator.report import labels, style
from orchestrator.report.figure import Figure

PANELS = 6
"""Most scenes of a kind that are drawn; they are spread over the pack."""
FLOOR = 1e-6
"""Least error that a logarithmic axis shows: exact formulas and reruns have less."""
EXPECTED, SOLVER = "0.25", "#d55e00"
LEVELS = {1: "#0072b2", 2: "#009e73", 3: "#56b4e9", 4: "#d55e00", 5: "#cc79a7"}


def draw(pack: Pack, verdicts: Sequence[Verdict], rows: pd.DataFrame) -> Iterator[Figure]:
    """The figures for which there are answers."""
    answered = rows[rows["found"].notna()]
    found = {"flow": _along_bed, "pile": _moved, "line": _moved}
    for kind, panel in found.items():
        names = [v.scene for v in verdicts if v.kind == kind]
        drawn = [name for name in names if name in set(answered["scene"])]
        if drawn:
            yield _panels(pack, answered, kind, drawn, panel)
    if (answered["quantity"] == "shields").any():
        yield _shields(pack, answered)
    if any(v.seconds > 0 and v.error == v.error for v in verdicts):
        yield _speed(verdicts, rows)


TITLES = {
    "flow": ("stress", "Friction velocity along the bed"),
    "pile": ("moved", "Grains that have moved, under the given stress"),
    "line": ("moved-line", "Grains that have moved, with the solver's own flow"),
}


def _panels(pack: Pack, rows: pd.DataFrame, kind: str, names: Sequence[str], panel: Any) -> Figure:
    chosen = [names[i] for i in np.unique(np.linspace(0, len(names) - 1, PANELS).astype(int))]
    columns = min(len(chosen), 3)
    lines = -(-len(chosen) // columns)
    canvas = style.canvas(0.4 + 2.0 * lines)
    axes = np.atleast_1d(canvas.subplots(lines, columns, squeeze=False)).ravel()
    for ax, name in zip(axes, chosen, strict=False):
        panel(ax, rows[rows["scene"] == name])
        told = pack.scenes[name]
        size = f"d = {1e3 * told['d_m']:g} mm" if "d_m" in told else f"z₀ = {told['z0_m']:.3g} m"
        ax.set_title(f"{name}: {told['alpha_deg']:g}°, {size}", size=6.5)
    for ax in axes[len(chosen) :]:
        ax.remove()
    style.legends(canvas, [], _legend())
    stem, title = TITLES[kind]
    caption = (
        f"{len(chosen)} of {len(names)} scenes. The line and its band are the expected answer and"
        " its interval, the points are the solver's."
    )
    return Figure(stem, title, caption, (), canvas)


def _legend() -> list[Line2D]:
    return [
        Line2D([], [], color=EXPECTED, label="expected"),
        Line2D([], [], color=SOLVER, marker="o", ls="none", ms=3, label="solver"),
    ]


def _along_bed(ax: Axes, rows: pd.DataFrame) -> None:
    here = rows[rows["quantity"] == "ustar_over_ustar0"]
    s = here["at"].astype(float)
    ax.plot(s, here["value"], color=EXPECTED)
    ax.plot(s, here["found"], "o", color=SOLVER, ms=2)
    ax.set(xlim=(-3, 12), xlabel="s/h", ylabel="u*/u*₀")


def _moved(ax: Axes, rows: pd.DataFrame) -> None:
    here = rows[rows["quantity"] == "moved"]
    hold = here["at"].astype(float)
    rest = rows[rows["quantity"] == "not_moved"]["value"].iloc[-1]
    total = here["value"].iloc[-1] + rest
    ax.fill_between(hold, here["low"] / total, here["high"] / total, color="0.85", lw=0)
    ax.plot(hold, here["value"] / total, color=EXPECTED)
    ax.plot(hold, here["found"] / total, "o", color=SOLVER, ms=2)
    ax.set(ylim=(0, 1), xlabel="hold", ylabel="n/N")


def _shields(pack: Pack, rows: pd.DataFrame) -> Figure:
    here = rows[rows["quantity"] == "shields"]
    told = [pack.scenes[name] for name in here["scene"]]
    # of theta = rho_f u*^2/((rho_sol - rho_f) g d) and Re* = u* d/nu
    unit = np.array([_velocity(one) * one["d_m"] / one["nu_m2_s"] for one in told])
    level = np.array([one["level"] for one in told])
    canvas = style.canvas(3.6)
    ax = canvas.subplots()
    for curve in curves.WATER:
        x, y = curve.points()
        ax.plot(x, y, color=style.WATER, lw=0.8)
    for one in sorted(set(level)):
        chosen = here[level == one]
        scale = unit[level == one]
        theta = chosen["value"].to_numpy(float)
        spread = np.abs(chosen[["low", "high"]].to_numpy(float).T - theta)
        x = scale * np.sqrt(theta)
        ax.errorbar(x, theta, spread, fmt="o", color=LEVELS[one], mfc="none", ms=5, lw=0.6, mew=0.6)
        found = chosen["found"].to_numpy(float)
        found = np.where(found > 0, found, np.nan)
        ax.plot(scale * np.sqrt(found), found, "x", color=LEVELS[one], ms=3, mew=0.8)
    ax.set(xscale="log", yscale="log", xlabel=labels.RE_AXIS, ylabel=labels.TAU_AXIS)
    theta = here["value"].to_numpy(float)
    reynolds = unit * np.sqrt(theta)
    ax.set_xlim(reynolds.min() / 3, reynolds.max() * 3)
    ax.set_ylim(min(theta.min(), 0.02) / 2, max(theta.max(), 0.2) * 2)
    style.plain_ticks(ax.xaxis)
    style.plain_ticks(ax.yaxis)
    samples = [style.entry(f"level {one}", LEVELS[one]) for one in sorted(set(level))]
    marks = [
        Line2D([], [], color="0.3", marker="o", mfc="none", ls="none", label="expected, interval"),
        Line2D([], [], color="0.3", marker="x", ls="none", label="solver"),
        Line2D([], [], color=style.WATER, label="curves for water"),
    ]
    style.legends(canvas, samples, marks)
    caption = "Thresholds in the Shields diagram: rings are expected, crosses are the solver's."
    return Figure("shields", "Thresholds", caption, (), canvas)


def _velocity(told: Any) -> float:
    """The u* at which theta is 1, m/s."""
    excess = (told["rho_sol_kg_m3"] - told["rho_f_kg_m3"]) * told["g_m_s2"] * told["d_m"]
    return float(np.sqrt(excess / told["rho_f_kg_m3"]))


def _speed(verdicts: Sequence[Verdict], rows: pd.DataFrame) -> Figure:
    canvas: Canvas = style.canvas(3.4)
    ax = canvas.subplots()
    ours = _our_errors(rows)
    used = sorted({one.level for one in verdicts})
    for level in used:
        of = [one for one in verdicts if one.level == level]
        x = [one.seconds for one in of]
        y = [max(one.error, FLOOR) if one.error == one.error else np.nan for one in of]
        ax.plot(x, y, "o", color=LEVELS[level], ms=3.5)
        x = [one.ours_seconds for one in of]
        y = [max(ours.get(one.scene, np.nan), FLOOR) for one in of]
        ax.plot(x, y, "o", color=LEVELS[level], mfc="none", ms=4.5, mew=0.7)
    ax.set(xscale="log", yscale="log", xlabel="wall time of a scene, s", ylabel="median error")
    style.plain_ticks(ax.xaxis)
    marks = [
        Line2D([], [], color="0.3", marker="o", ls="none", label="solver"),
        Line2D([], [], color="0.3", marker="o", mfc="none", ls="none", label="ours"),
    ]
    style.legends(canvas, [style.entry(f"level {n}", LEVELS[n]) for n in used], marks)
    caption = (
        "Each point is a scene: wall time, and median relative error of its judged numbers. Errors"
        f" below {FLOOR:g} are drawn there: at levels 3 to 5 the expected answer is our own run."
    )
    return Figure("speed-accuracy", "Time and error", caption, (), canvas)


def _our_errors(rows: pd.DataFrame) -> dict[str, float]:
    judged = rows[rows["tolerance"].notna() & rows["ours"].notna()]
    value = judged["value"].replace(0, 1)
    error = ((judged["ours"] - judged["value"]) / value).abs()
    return {str(name): float(e) for name, e in error.groupby(judged["scene"]).median().items()}
