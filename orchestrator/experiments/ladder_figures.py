"""The charts of speed against accuracy, and of what is gained over the naive route."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from adjustText import adjust_text
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import Normal, Stroke

from orchestrator.experiments.ladder import ERRORS, LEVEL_PAIR
from orchestrator.report import style
from orchestrator.report.style import Look

HEADS = {name: f"$n/N$ = {name[-2:]} %" for name in ERRORS[:-1]} | {ERRORS[-1]: "whole curve"}
"""Columns of errors and the heads of their panels."""
FLOOR = 1e-3
"""Errors below it are drawn on it."""
TOLERANCES = (0.05, 0.2)
MARKERS = {
    "^": "threshold too high",
    "v": "threshold too low",
    "X": "not all fractions reached",
}
REFERENCE: Look = {"color": "0.88", "lw": 0}
MODEL: Look = {"color": "#fdf3dc", "lw": 0}
FRONT: Look = {"color": "0.25", "lw": 0.9, "zorder": 1.5, "gid": "front"}
METHODS = {"pivot": "#009e73", "peeling": "#d55e00", "DEM": "#0072b2"}
"""How the grains were answered; colours that are told apart by all."""
NOTHING = "no pair of levels has been run"
MEASURED: Look = {"fc": "#0072b2", "ec": "#0072b2", "lw": 0.8}
EXTRAPOLATED: Look = {"fc": "white", "ec": "#0072b2", "lw": 0.8, "hatch": "////"}


def against_cost(pairs: pd.DataFrame) -> Canvas:
    """The largest error over the fractions against the cost, a panel for each packing.

    Parameters
    ----------
    pairs : DataFrame
        A row for each pair of levels and packing, as `ladder.together` gives it: packing,
        flow_level, grain_level; piles, how many it was run on; cost_core_s, s of one core;
        error_10 … error_70 and error_curve, relative and signed, NaN where a fraction is not
        reached; reference_error, how well the reference is known; model_floor, half the interval of
        the model, NaN if not measured; same_model; pareto, whether no pair is cheaper and better.
    """
    table = _numbered(pairs)
    fractions = table[list(ERRORS[:-1])].to_numpy(float)
    at = np.nan_to_num(np.abs(fractions)).argmax(axis=1)
    table = table.assign(
        error=fractions[np.arange(len(table)), at], complete=np.isfinite(fractions).all(axis=1)
    )
    parts = [part for _, part in table.groupby("packing", sort=False)]
    figure = style.canvas(2.6 * len(parts) + 0.06 * table["number"].nunique() + 1.0)
    axes = figure.subplots(max(len(parts), 1), 1, sharex=True, squeeze=False)[:, 0].tolist()
    for ax, part in zip(axes, parts, strict=False):
        shown = _points(ax, part)
        front = shown[shown["pareto"].astype(bool)].sort_values("x")
        ax.step(front["x"], front["y"], where="post", **FRONT)
        packing, piles = part["packing"].iloc[0], part["piles"].max()
        title = f"{packing} packing; each pair of levels on at most {piles} piles"
        ax.set_title(title, loc="left")
        ax.text(1, 1.02, _left_out(part), ha="right", transform=ax.transAxes, **style.NOTE)
    for ax in axes:
        ax.set_ylabel("largest error of $τ_c$, %")
    axes[-1].set_xlabel("cost, s of one core")
    _scales(axes, axes, parts)
    line = [Line2D([], [], label="no pair of levels is cheaper and better", **FRONT)]
    looks = [*_looks(parts), *(line if table["pareto"].any() else [])]
    style.legends(figure, _methods(table), [*_key(table), *looks])
    figure.draw_without_rendering()  # labels are placed in a finished layout
    for ax, part in zip(axes, parts, strict=False):
        _label(ax, part, 6.0, names=True)
    return figure


def by_fraction(pairs: pd.DataFrame) -> Canvas:
    """The error at each fraction and of the whole curve against the cost.

    The columns are those of `against_cost`, a row of panels for each packing; the pairs on the
    front are numbered.
    """
    table = _numbered(pairs)
    packings = [part for _, part in table.groupby("packing", sort=False)]
    figure = style.canvas(1.7 * len(packings) + 0.06 * table["number"].nunique() + 1.3)
    grid = figure.subplots(
        max(len(packings), 1), len(HEADS), sharex=True, sharey=True, squeeze=False
    )
    parts = [
        part.assign(error=part[column], complete=True) for part in packings for column in HEADS
    ]
    for ax, part in zip(grid.ravel(), parts, strict=False):
        _points(ax, part)
    for ax, part in zip(grid[:, 0], packings, strict=False):
        ax.set_ylabel(f"{part['packing'].iloc[0]}\nerror of $τ_c$, %")
    for ax, head in zip(grid[0], HEADS.values(), strict=True):
        ax.set_title(head)
    grid[-1, 2].set_xlabel("cost, s of one core")
    _scales(list(grid.ravel()), list(grid[:, -1]), parts)
    key = _key(table[table["pareto"].astype(bool)])
    style.legends(figure, _methods(table), [*key, *_looks(parts)])
    figure.draw_without_rendering()
    for ax, part in zip(grid.ravel(), parts, strict=False):
        _label(ax, part[part["pareto"].astype(bool)], 5.5, names=False)
    return figure


def _numbered(pairs: pd.DataFrame) -> pd.DataFrame:
    """With a number and a name for each pair, in the order in which they come, and its method."""
    parts = [column for column in LEVEL_PAIR if pairs[column].nunique() > 1] or LEVEL_PAIR[-1:]
    return pairs.assign(
        number=pairs.groupby(LEVEL_PAIR, sort=False).ngroup() + 1,
        name=pairs[parts].astype(str).agg(", ".join, axis=1) if len(pairs) else "",
        method=pairs["grain_level"].where(pairs["grain_level"].isin(list(METHODS)), "DEM"),
    )


def _shown(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that have a place in a panel: x, and y on the floor at least."""
    known = rows[(rows["cost_core_s"] > 0) & rows["error"].notna()]
    sign = np.where(known["error"] < 0, "v", "^")
    return known.assign(
        x=known["cost_core_s"],
        y=known["error"].abs().clip(lower=FLOOR),
        marker=np.where(known["complete"], sign, "X"),
    )


def _points(ax: Axes, rows: pd.DataFrame) -> pd.DataFrame:
    """Draw the pairs of a panel, and the bands of what is uncertain; the rows that are drawn."""
    shown = _shown(rows)
    for (method, marker, same), alike in shown.groupby(["method", "marker", "same_model"]):
        look: Look = {"mfc": METHODS[str(method)] if same else "white", "mec": METHODS[str(method)]}
        place = alike["x"], alike["y"]
        ax.plot(*place, ls="", ms=5, mew=0.9, zorder=3, gid="point", marker=marker, **look)
    for column, gid, look, zorder in (
        ("reference_error", "reference", REFERENCE, 0.1),
        ("model_floor", "model", MODEL, 0.0),
    ):
        end = rows[column].max() if column == "reference_error" else rows[column].min()
        if end > FLOOR:
            ax.axhspan(0, float(end), zorder=zorder, gid=gid, **look)
    return shown


def _left_out(rows: pd.DataFrame) -> str:
    """Which pairs have no place in a panel, and why."""
    reasons = {
        "cost not measured": rows["cost_core_s"].isna(),
        "no fraction reached": rows["error"].isna(),
    }
    return "\n".join(
        f"{why}: {'; '.join(dict.fromkeys(rows['name'][which]))}"
        for why, which in reasons.items()
        if which.any()
    )


def _scales(axes: Sequence[Axes], last: Sequence[Axes], parts: Sequence[pd.DataFrame]) -> None:
    """Logarithmic axes, and the lines of tolerance, named at the right of some panels."""
    shown = pd.concat([_shown(part) for part in parts]) if parts else pd.DataFrame()
    for ax in axes:
        if shown.empty:
            place: Look = {"ha": "center", "va": "center", "transform": ax.transAxes}
            ax.text(0.5, 0.5, NOTHING, **place, **style.NOTE)
            ax.set(xticks=[], yticks=[])
            continue
        x, y = shown["x"], shown["y"]
        ax.set(xscale="log", yscale="log", xlim=(x.min() / 1.8, x.max() * 1.8))
        ax.set_ylim(FLOOR / 1.5, max(1.0, 2 * y.max()))
        ax.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g}")
        style.plain_ticks(ax.xaxis)
        for tolerance in TOLERANCES:
            ax.axhline(tolerance, color="0.45", lw=0.7, ls=(0, (4, 2)), zorder=1, gid="tolerance")
            if any(ax is other for other in last):
                place = {"va": "center", "transform": ax.get_yaxis_transform()}
                ax.text(1, tolerance, f" {tolerance:.0%}", **place, **style.NOTE)


def _label(ax: Axes, rows: pd.DataFrame, size: float, *, names: bool) -> None:
    """Number the pairs of a panel; with their names where they are on the front."""
    shown = _shown(rows)
    halo = [Stroke(linewidth=1.8, foreground="white"), Normal()]
    each: Any = shown.itertuples(index=False)
    texts = [
        ax.text(
            row.x,
            row.y,
            f"{row.number}: {row.name}" if names and row.pareto else str(row.number),
            fontsize=size,
            color="0.1",
            zorder=5,
            gid="tag",
            path_effects=halo,
        )
        for row in each
    ]
    if texts:
        points = _shown(rows)
        arrow = {"arrowstyle": "-", "lw": 0.4, "color": "0.5"}
        adjust_text(
            texts, points["x"].to_numpy(), points["y"].to_numpy(), ax=ax, arrowprops=arrow,
            expand=(1.15, 1.4), iter_lim=300,
        )  # fmt: skip
    for text in texts:
        text.set_in_layout(False)


def _methods(table: pd.DataFrame) -> list[Artist]:
    used = set(table["method"])
    return [style.entry(name, colour) for name, colour in METHODS.items() if name in used]


def _key(table: pd.DataFrame) -> list[Artist]:
    rows: Any = table.drop_duplicates("number").itertuples(index=False)
    return [
        Line2D([], [], ls="", marker=f"${r.number}$", ms=5, label=r.name, color=METHODS[r.method])
        for r in rows
    ]


def _looks(parts: Sequence[pd.DataFrame]) -> list[Artist]:
    """Legend of the markers and bands that are drawn."""
    if not parts:
        return []
    rows = _shown(pd.concat(parts))
    shared: Look = {"ls": "", "ms": 5, "mec": "0.2", "mew": 0.9}
    entries: list[Artist] = [
        Line2D([], [], marker=marker, mfc="0.2", label=label, **shared)
        for marker, label in MARKERS.items()
        if (rows["marker"] == marker).any()
    ]
    if not rows["same_model"].all():
        label = "hollow: another turbulence model, contact or bed"
        entries.append(Line2D([], [], marker="^", mfc="white", label=label, **shared))
    if (rows["reference_error"] > FLOOR).any():
        entries.append(Patch(label="error of the reference itself", **REFERENCE))
    if (rows["model_floor"] > FLOOR).any():
        label = "the model's own spread: better numerics buy nothing"
        entries.append(Patch(label=label, **MODEL))
    return entries


def gains(routes: pd.DataFrame) -> Canvas:
    """How many times cheaper each route is than the naive one.

    Parameters
    ----------
    routes : DataFrame
        route, core_s, extrapolated; the first row is the naive route. A NaN was not measured.
    """
    figure = style.canvas(0.34 * len(routes) + 0.75)
    ax = figure.subplots()
    cost = routes["core_s"].to_numpy(float)
    factor = cost[0] / cost
    ax.set(xscale="log", xlabel="times cheaper than the naive route")
    for y, (gain, extrapolated) in enumerate(zip(factor, routes["extrapolated"], strict=True)):
        if not np.isfinite(gain):
            ax.text(1, y, " not measured", va="center", **style.NOTE)
            continue
        look = EXTRAPOLATED if extrapolated else MEASURED
        ax.barh(y, gain - 1, left=1, height=0.62, gid="gain", **look)
        text = f" {_rounded(gain)} × ({duration(cost[y])})"
        ax.text(max(gain, 1), y, text, va="center", fontsize=7, gid="gain's text")
    ax.axvline(1, color="0.3", lw=0.6)
    ax.set_yticks(range(len(routes)), routes["route"])
    ax.invert_yaxis()
    known = factor[np.isfinite(factor)]
    # the texts beyond the bars need a third of the width
    ax.set_xlim(known.min(initial=0.8), known.max(initial=10.0) ** 1.5)
    ax.spines[["top", "right"]].set_visible(False)
    if routes["extrapolated"].any():
        style.legends(figure, [], [Patch(label="extrapolated, not run", **EXTRAPOLATED)])
    return figure


def duration(seconds: float) -> str:
    """A time of one core, in the unit that suits it."""
    for unit, size in {"years": 3.156e7, "days": 86400.0, "h": 3600.0, "min": 60.0}.items():
        if seconds >= 1.5 * size:
            return f"{_rounded(seconds / size)} {unit}"
    return f"{_rounded(seconds)} s"


def _rounded(value: float) -> str:
    """A number to two digits, such as 0.35, 12 or 46 000."""
    return f"{float(f'{value:.2g}'):,.0f}".replace(",", " ") if value >= 10 else f"{value:.2g}"
