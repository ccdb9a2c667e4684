"""The charts of speed against accuracy, and of what is gained over the naive route."""

from collections.abc import Mapping
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
MARKERS = {"^": "threshold too high", "v": "threshold too low", "X": "not all fractions reached"}
BANDS: dict[str, Look] = {
    "error of the reference itself": {"color": "0.88", "lw": 0, "zorder": 0.1, "gid": "reference"},
    "the model's own spread: better numerics buy nothing": {
        "color": "#fdf3dc",
        "lw": 0,
        "zorder": 0,
        "gid": "model",
    },
}
FRONT: Look = {"color": "0.25", "lw": 0.9, "zorder": 1.5, "gid": "front"}
METHODS = {"pivot": "#009e73", "peeling": "#d55e00", "DEM": "#0072b2"}
"""How the grains were answered; colours that are told apart by all."""
NOTHING = "no pair of levels has been run"


def against_cost(pairs: pd.DataFrame) -> Canvas:
    """The largest error over the fractions against the cost, a panel for each packing.

    Parameters
    ----------
    pairs : DataFrame
        A row for each pair of levels and packing, as `ladder.together` gives it.
    """
    fractions = pairs[list(ERRORS[:-1])].to_numpy(float)
    at = np.nan_to_num(np.abs(fractions)).argmax(axis=1)
    table = pairs.assign(
        largest=fractions[np.arange(len(pairs)), at], complete=np.isfinite(fractions).all(axis=1)
    )
    return _chart(table, {"largest": ""})


def by_fraction(pairs: pd.DataFrame) -> Canvas:
    """The error at each fraction and of the whole curve against the cost.

    The columns are those of `against_cost`, a row of panels for each packing; the pairs on the
    front are numbered.
    """
    return _chart(pairs.assign(complete=True), HEADS)


def _chart(pairs: pd.DataFrame, columns: Mapping[str, str]) -> Canvas:
    """A panel for each packing and column of errors; a single one has the front and all names."""
    single = len(columns) == 1
    parts = [name for name in LEVEL_PAIR if pairs[name].nunique() > 1] or LEVEL_PAIR[-1:]
    table = pairs.assign(
        number=pairs.groupby(LEVEL_PAIR, sort=False).ngroup() + 1,
        name=pairs[parts].astype(str).agg(", ".join, axis=1) if len(pairs) else "",
        colour=pairs["grain_level"].map(METHODS).fillna(METHODS["DEM"]),
        front=pairs["pareto"].astype(bool),
    )
    packings = [rows for _, rows in table.groupby("packing", sort=False)]
    height = (2.6 if single else 1.7) * len(packings) + 0.06 * table["number"].nunique() + 1.2
    figure, shape = style.canvas(height), (max(len(packings), 1), len(columns))
    grid = figure.subplots(*shape, sharex=True, sharey=not single, squeeze=False)
    panels = [
        (ax, head, _placed(rows, column))
        for row, rows in zip(grid, packings, strict=False)
        for ax, (column, head) in zip(row, columns.items(), strict=True)
    ]
    for ax, head, rows in panels:
        ax.set_title(head)
        for (colour, marker, same), alike in rows.groupby(["colour", "marker", "same_model"]):
            face: Look = {"mfc": colour if same else "white", "mec": colour, "marker": marker}
            ax.plot(alike["x"], alike["y"], ls="", ms=5, mew=0.9, zorder=3, gid="point", **face)
        ends = (rows["reference_error"].max(), rows["model_floor"].min())
        for end, look in zip(ends, BANDS.values(), strict=True):
            if end > FLOOR:
                ax.axhspan(0, float(end), **look)
    for ax, rows in zip(grid[:, 0], packings, strict=False):
        packing = rows["packing"].iloc[0]
        ax.set_ylabel("largest error of $τ_c$, %" if single else f"{packing}\nerror of $τ_c$, %")
        if single:
            piles = rows["piles"].max()
            title = f"{packing} packing; each pair of levels on at most {piles} piles"
            ax.set_title(title, loc="left")
            reasons = {
                "cost not measured": rows["cost_core_s"].isna(),
                "no fraction reached": rows["largest"].isna(),
            }
            lost = [
                f"{why}: {'; '.join(dict.fromkeys(rows['name'][which]))}"
                for why, which in reasons.items()
                if which.any()
            ]
            place: Look = {"ha": "right", "transform": ax.transAxes}
            ax.text(1, 1.02, "\n".join(lost), **place, **style.NOTE)
    if single:
        for ax, _, rows in panels:
            front = rows[rows["front"]].sort_values("x")
            ax.step(front["x"], front["y"], where="post", **FRONT)
    grid[-1, shape[1] // 2].set_xlabel("cost, s of one core")
    drawn = pd.concat([rows for *_, rows in panels]) if panels else pd.DataFrame()
    for ax in grid.ravel():
        _scales(ax, drawn, named=ax in grid[:, -1])
    style.legends(figure, *_entries(table, drawn, single=single))
    figure.draw_without_rendering()  # labels are placed in a finished layout
    for ax, _, rows in panels:
        _label(ax, rows if single else rows[rows["front"]], named=single)
    return figure


def _placed(rows: pd.DataFrame, column: str) -> pd.DataFrame:
    """The rows that have a place in a panel: x, and y on the floor at least."""
    shown = rows[(rows["cost_core_s"] > 0) & rows[column].notna()]
    sign = np.where(shown[column] < 0, "v", "^")
    return shown.assign(
        x=shown["cost_core_s"],
        y=shown[column].abs().clip(lower=FLOOR),
        marker=np.where(shown["complete"], sign, "X"),
    )


def _scales(ax: Axes, drawn: pd.DataFrame, *, named: bool) -> None:
    """Logarithmic axes, and the lines of tolerance, named at the right of some panels."""
    if drawn.empty:
        place: Look = {"ha": "center", "va": "center", "transform": ax.transAxes}
        ax.text(0.5, 0.5, NOTHING, **place, **style.NOTE)
        ax.set(xticks=[], yticks=[])
        return
    x, y = drawn["x"], drawn["y"]
    ax.set(xscale="log", yscale="log", xlim=(x.min() / 1.8, x.max() * 1.8))
    ax.set_ylim(FLOOR / 1.5, max(1.0, 2 * y.max()))
    ax.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g}")
    style.plain_ticks(ax.xaxis)
    for tolerance in TOLERANCES:
        ax.axhline(tolerance, color="0.45", lw=0.7, ls=(0, (4, 2)), zorder=1, gid="tolerance")
        if named:
            place = {"va": "center", "transform": ax.get_yaxis_transform()}
            ax.text(1, tolerance, f" {tolerance:.0%}", **place, **style.NOTE)


def _label(ax: Axes, rows: pd.DataFrame, *, named: bool) -> None:
    """Number the pairs of a panel; with their names where they are on the front."""
    look: Look = {"fontsize": 6.0 if named else 5.5, "color": "0.1", "zorder": 5, "gid": "tag"}
    look["path_effects"] = [Stroke(linewidth=1.8, foreground="white"), Normal()]
    each: Any = rows.itertuples(index=False)
    texts = [
        ax.text(row.x, row.y, f"{row.number}" + f": {row.name}" * (named and row.front), **look)
        for row in each
    ]
    if texts:
        arrow = {"arrowstyle": "-", "lw": 0.4, "color": "0.5"}
        place = rows["x"].to_numpy(float), rows["y"].to_numpy(float)
        adjust_text(texts, *place, ax=ax, arrowprops=arrow, expand=(1.15, 1.4), iter_lim=100)
    for text in texts:
        text.set_in_layout(False)


def _entries(
    table: pd.DataFrame, drawn: pd.DataFrame, *, single: bool
) -> tuple[list[Artist], list[Artist]]:
    """Legends: the methods, the numbers of the pairs, the markers and bands that are drawn."""
    used = set(table["colour"])
    methods: list[Artist] = [
        style.entry(name, colour) for name, colour in METHODS.items() if colour in used
    ]
    rows: Any = (table if single else table[table["front"]]).drop_duplicates("number").itertuples()
    looks: list[Artist] = [
        Line2D([], [], ls="", marker=f"${r.number}$", ms=5, label=r.name, color=r.colour)
        for r in rows
    ]
    if drawn.empty:
        return methods, looks
    shared: Look = {"ls": "", "ms": 5, "mec": "0.2", "mew": 0.9}
    for marker, label in MARKERS.items():
        if (drawn["marker"] == marker).any():
            looks.append(Line2D([], [], marker=marker, mfc="0.2", label=label, **shared))
    if not drawn["same_model"].all():
        label = "hollow: another turbulence model, contact or bed"
        looks.append(Line2D([], [], marker="^", mfc="white", label=label, **shared))
    for column, (label, look) in zip(
        ("reference_error", "model_floor"), BANDS.items(), strict=True
    ):
        if (drawn[column] > FLOOR).any():
            looks.append(Patch(label=label, color=look["color"], lw=0))
    if single and table["front"].any():
        looks.append(Line2D([], [], label="no pair of levels is cheaper and better", **FRONT))
    return methods, looks


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
    look: Look = {"ec": "#0072b2", "lw": 0.8}
    ax.set(xscale="log", xlabel="times cheaper than the naive route")
    for y, (gain, extrapolated) in enumerate(zip(factor, routes["extrapolated"], strict=True)):
        if not np.isfinite(gain):
            ax.text(1, y, " not measured", va="center", **style.NOTE)
            continue
        face: Look = {"fc": "white", "hatch": "////"} if extrapolated else {"fc": "#0072b2"}
        ax.barh(y, gain - 1, left=1, height=0.62, gid="gain", **look, **face)
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
        sample = Patch(label="extrapolated, not run", fc="white", hatch="////", **look)
        style.legends(figure, [], [sample])
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
