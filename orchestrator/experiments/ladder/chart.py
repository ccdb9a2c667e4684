"""The chart of speed against accuracy: cheaper fidelity levels against the dearest ones."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from orchestrator.experiments.ladder import tags
from orchestrator.experiments.ladder.ranking import ERRORS
from orchestrator.experiments.ladder.tags import Tag
from orchestrator.report import labels, style
from orchestrator.report.results import split
from orchestrator.report.style import Look

*AT_FRACTIONS, OF_CURVE = ERRORS
HEADS = {
    **{name: labels.written("fraction", int(name[-2:]) / 100) for name in AT_FRACTIONS},
    OF_CURVE: "whole curve",
}
"""Columns of errors and the heads of their panels."""
FLOOR = 1e-3
"""Errors below it are drawn on it."""
TOLERANCES = (0.05, 0.2)
HIGH, LOW, MISSING = "^", "v", "X"
"""Markers: the threshold is too high, too low; a fraction was not reached."""
REFERENCE: Look = {"color": "0.88", "lw": 0}
MODEL: Look = {"color": "#fdf3dc", "lw": 0}
FRONT: Look = {"color": "0.25", "lw": 0.9, "zorder": 1.5, "gid": "front"}
PAIR = ["flow_level", "grain_level"]
METHODS = {"pivot": "#009e73", "peeling": "#d55e00", "DEM": "#0072b2"}
"""How the grains were answered; colours that are told apart by all."""
NOTHING = "no pair of levels has been run"


def against_cost(pairs: pd.DataFrame) -> Canvas:
    """The largest error over the fractions against the cost, a panel for each packing.

    Parameters
    ----------
    pairs : DataFrame
        A row for each pair of levels and packing: packing, flow_level, grain_level; piles, how many
        it was run on; cost_core_s, s of one core; error_10 … error_70 and error_curve, relative and
        signed, of the threshold stress at a fraction and of the whole curve, NaN where it is not
        reached; reference_error, how well the reference itself is known; model_floor, half the
        model's own interval, NaN if not measured; same_model, whether the
        turbulence model is the reference's; pareto, whether no other pair is both cheaper and
        better.
    """
    table = _marked(pairs)
    parts = [_with_largest(part) for _, part in split(table, "packing")]
    figure = style.canvas(2.6 * len(parts) + 0.06 * table["number"].nunique() + 1.0)
    axes = list(figure.subplots(max(len(parts), 1), 1, sharex=True, squeeze=False)[:, 0])
    for ax, part in zip(axes, parts, strict=False):
        _points(ax, part)
        _front(ax, part)
        ax.set_title(_title(part), loc="left")
        _left_out(ax, part)
    for ax in axes:
        ax.set_ylabel("largest error of $τ_c$, %")
    axes[-1].set_xlabel("cost, s of one core")
    _scales(axes, axes, parts)
    front = [Line2D([], [], label="no pair of levels is cheaper and better", **FRONT)]
    looks = [*_look_entries(parts), *(front if table["pareto"].any() else [])]
    style.legends(figure, _method_entries(table), [*_key(table), *looks])
    figure.draw_without_rendering()  # tags are written into a finished layout
    for ax, part in zip(axes, parts, strict=False):
        _write_tags(ax, part, 6.0, _name_of_front)
    return figure


def by_fraction(pairs: pd.DataFrame) -> Canvas:
    """The error at each fraction and of the whole curve against the cost.

    Pairs on the front of `against_cost` are numbered.

    The columns are those of `against_cost`; a row of panels for each packing.
    """
    table = _marked(pairs)
    packings = [part for _, part in split(table, "packing")]
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
    style.legends(figure, _method_entries(table), [*key, *_look_entries(parts)])
    figure.draw_without_rendering()
    for ax, part in zip(grid.ravel(), parts, strict=False):
        _write_tags(ax, part, 5.5, _number_of_front)
    return figure


def _marked(pairs: pd.DataFrame) -> pd.DataFrame:
    """With a number and a name for each pair, in the order in which they come, and its method."""
    parts = [column for column in PAIR if pairs[column].nunique() > 1] or PAIR[-1:]
    return pairs.assign(
        number=pairs.groupby(PAIR, sort=False).ngroup() + 1,
        name=pairs[parts].astype(str).agg(", ".join, axis=1) if len(pairs) else "",
        method=[name if name in METHODS else "DEM" for name in pairs["grain_level"]],
    )


def _with_largest(rows: pd.DataFrame) -> pd.DataFrame:
    """With the error that is largest in size, and whether it is that of all fractions."""
    errors = rows[AT_FRACTIONS]
    largest = errors.abs().fillna(0).to_numpy().argmax(axis=1)
    error = errors.to_numpy(float)[np.arange(len(rows)), largest]
    return rows.assign(error=error, complete=errors.notna().all(axis=1))


def _shown(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that have a place in a panel: x, and y on the floor at least."""
    known = rows[(rows["cost_core_s"] > 0) & rows["error"].notna()]
    sign = np.where(known["error"] < 0, LOW, HIGH)
    return known.assign(
        x=known["cost_core_s"],
        y=known["error"].abs().clip(lower=FLOOR),
        marker=np.where(known["complete"], sign, MISSING),
    )


def _points(ax: Axes, rows: pd.DataFrame) -> None:
    shown = _shown(rows)
    for (method, marker, same), own in split(shown, "method", "marker", "same_model"):
        colour = METHODS[str(method)]
        look: Look = {"mfc": colour if same else "white", "mec": colour, "marker": marker}
        ax.plot(own["x"], own["y"], ls="", ms=5, mew=0.9, zorder=3, gid="point", **look)
    reference = float(rows["reference_error"].max())
    if reference > FLOOR:
        ax.axhspan(0, reference, zorder=0.1, gid="reference", **REFERENCE)
    model = float(rows["model_floor"].min())
    if model > FLOOR:
        ax.axhspan(0, model, zorder=0, gid="model", **MODEL)


def _front(ax: Axes, rows: pd.DataFrame) -> None:
    shown = _shown(rows)
    front = shown[shown["pareto"].astype(bool)].sort_values("x")
    ax.step(front["x"], front["y"], where="post", **FRONT)


def _title(rows: pd.DataFrame) -> str:
    packing, piles = rows["packing"].iloc[0], rows["piles"].max()
    return f"{packing} packing; each pair of levels on at most {piles} piles"


def _left_out(ax: Axes, rows: pd.DataFrame) -> None:
    """Say which pairs have no place in a panel, and why."""
    texts = []
    for why, which in (
        ("cost not measured", rows["cost_core_s"].isna()),
        ("no fraction reached", rows["error"].isna()),
    ):
        if which.any():
            texts.append(f"{why}: {'; '.join(dict.fromkeys(rows['name'][which]))}")
    ax.text(1, 1.02, "\n".join(texts), ha="right", transform=ax.transAxes, **style.NOTE)


def _scales(axes: Sequence[Axes], last: Sequence[Axes], parts: Sequence[pd.DataFrame]) -> None:
    """Logarithmic, and the lines of tolerance, named at the right of some panels."""
    shown = pd.concat([_shown(part) for part in parts]) if parts else pd.DataFrame()
    if shown.empty:
        for ax in axes:
            _empty(ax)
        return
    x, y = shown["x"], shown["y"]
    for ax in axes:
        ax.set(xscale="log", yscale="log", xlim=(x.min() / 1.8, x.max() * 1.8))
        ax.set_ylim(FLOOR / 1.5, max(1.0, 2 * y.max()))
        ax.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g}")
        style.plain_ticks(ax.xaxis)
        for tolerance in TOLERANCES:
            ax.axhline(tolerance, color="0.45", lw=0.7, ls=(0, (4, 2)), zorder=1, gid="tolerance")
    for ax in last:
        for tolerance in TOLERANCES:
            place = ax.get_yaxis_transform()
            text = f" {tolerance:.0%}"
            ax.text(1, tolerance, text, va="center", transform=place, **style.NOTE)


def _empty(ax: Axes) -> None:
    ax.text(0.5, 0.5, NOTHING, ha="center", va="center", transform=ax.transAxes, **style.NOTE)
    ax.set(xticks=[], yticks=[])


def _write_tags(ax: Axes, rows: pd.DataFrame, size: float, text: Callable[[Any], str]) -> None:
    """Tag each pair that has a text."""
    shown = _shown(rows)
    each: Any = shown.sort_values("x").itertuples(index=False)
    found = [Tag(text(row), row.x, row.y, METHODS[row.method]) for row in each]
    # the long ones first: the short ones fit in between
    written = sorted((tag for tag in found if tag.text), key=lambda tag: -len(tag.text))
    tags.write(ax, written, shown[["x", "y"]].to_numpy(float), size)


def _name_of_front(row: Any) -> str:
    return f"{row.number}: {row.name}" if row.pareto else str(row.number)


def _number_of_front(row: Any) -> str:
    return str(row.number) if row.pareto else ""


def _method_entries(table: pd.DataFrame) -> list[Artist]:
    used = set(table["method"])
    return [style.entry(name, colour) for name, colour in METHODS.items() if name in used]


def _key(table: pd.DataFrame) -> list[Artist]:
    rows: Any = table.drop_duplicates("number").itertuples(index=False)
    return [
        Line2D([], [], ls="", marker=f"${r.number}$", ms=5, label=r.name, color=METHODS[r.method])
        for r in rows
    ]


def _look_entries(parts: Sequence[pd.DataFrame]) -> list[Artist]:
    """Legend of the markers and lines that are there."""
    if not parts:
        return []
    rows = _shown(pd.concat(parts))
    marks = {
        HIGH: "threshold too high",
        LOW: "threshold too low",
        MISSING: "not all fractions reached",
    }
    shared: Look = {"ls": "", "ms": 5, "mec": "0.2", "mew": 0.9}
    entries: list[Artist] = [
        Line2D([], [], marker=marker, mfc="0.2", label=label, **shared)
        for marker, label in marks.items()
        if (rows["marker"] == marker).any()
    ]
    if not rows["same_model"].all():
        label = "hollow: another turbulence model, contact or bed"
        entries.append(Line2D([], [], marker=HIGH, mfc="white", label=label, **shared))
    if (rows["reference_error"] > FLOOR).any():
        entries.append(Patch(label="error of the reference itself", **REFERENCE))
    if (rows["model_floor"] > FLOOR).any():
        label = "the model's own spread: better numerics buy nothing"
        entries.append(Patch(label=label, **MODEL))
    return entries
