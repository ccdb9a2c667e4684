"""Pictures of how much of a bed moves: the share of the grains, and each size."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Canvas

from orchestrator.digits import percent
from orchestrator.physics.grain import Grain
from orchestrator.report import answers, single
from orchestrator.report.drawing import (
    ANSWER,
    GROUND,
    INK,
    PALE,
    Head,
    figure,
    in_units,
    margins,
    ratio,
)
from orchestrator.report.results import Results, seeds_of
from orchestrator.report.style import Look
from orchestrator.report.subjects import Quantity
from orchestrator.types import BoolArray, FloatArray


def shares(row: pd.Series, results: Results) -> Head | None:
    """Draw the share of the counted grains that has moved against the flow.

    Parameters
    ----------
    row
        The threshold of the card, with the columns of its scene.
    results
        The study with its tables.

    Returns
    -------
    Head or None
        The picture; None without a curve.
    """
    curves = _curves(row, results)
    if not curves:
        return None
    told = single.quantity(row)
    (flows, share), *_ = curves
    measured = flows if single.is_level(row) else _measured(row, results, told)
    percent = 100 * float(row["fraction"])
    at = single.in_unit(row, float(row["ustar0_m_s"]), told)
    title = f"Share of the grains that has moved against the {told.name}"
    caption = f"How the share that has moved grows with the {told.name}."
    if len(curves) > 1:
        caption += " Thin: other beds that differ in chance alone; disc: their mean."
    if not single.is_level(row):
        caption += " Dashed: with the measured threshold of one grain."

    def draw(narrow: bool) -> Canvas:
        canvas = figure(narrow, 150)
        ax = canvas.subplots()
        margins(canvas, 36, 10, 22, 24)
        for others in curves[1:]:
            ax.step(*others, where="post", color=ANSWER, lw=0.8)
        ax.step(flows, share, where="post", color=ANSWER, lw=2)
        if not single.is_level(row):
            ax.step(measured, share, where="post", color=INK, lw=1.2, ls=(0, (4, 2)))
        ax.plot([at], [percent], "o", color=ANSWER, ms=7, mec=GROUND)
        text = f"{percent:.0f} % at {at:.3g} {told.unit}"
        look: Look = {"textcoords": "offset points", "color": ANSWER, "weight": "bold"}
        ax.annotate(text, (at, percent), xytext=(9, -9), **look)
        least = min(float(measured[share > 0].min(initial=at)), at)
        late = flows[share >= 0.999 * share.max()]
        ax.set_xlim(0.9 * least, 1.02 * float(late.min(initial=flows.max())))
        ax.set(ylim=(0, 100), yticks=(0, 50, 100))
        long = f"Share of the grains that has moved, %, against the {told.name}"
        short = f"Share moved, %, against the {told.name}"
        ax.set_title(f"{short if narrow else long}, {told.unit}")
        return canvas

    return Head(draw, title, caption)


def _curves(row: pd.Series, results: Results) -> list[tuple[Any, Any]]:
    """Flows and shares (%) of a bed, and of those that chance alone sets apart."""
    table = results.tables.get("pile_curve", pd.DataFrame())
    if table.empty:
        return []
    told = single.quantity(row)
    scenes = [str(row["scene_id"]), *seeds_of(row, results.at_fraction)]
    found = []
    for scene in scenes:
        curve = table[table["scene_id"] == scene]
        flows = in_units(row, curve["ustar0_m_s"], told)
        share = 100 * curve["fraction_moved"].to_numpy(float)
        is_known = np.isfinite(flows) & (flows > 0)
        found.append((flows[is_known], share[is_known]))
    return found


def _measured(row: pd.Series, results: Results, told: Quantity) -> Any:
    """The flows of a bed with the measured threshold of one grain."""
    table = results.tables["pile_curve"]
    ustar = table.loc[table["scene_id"] == row["scene_id"], "ustar0_m_s"]
    ustar = ustar[np.isfinite(ustar) & (ustar > 0)]
    return in_units(row, ratio(row) * ustar, told)


class _Sizes(NamedTuple):
    """The stresses that move each size of a mixture, Pa, and their names."""

    names: list[str]
    value: FloatArray
    low: FloatArray
    high: FloatArray
    few: BoolArray
    """Whether few grains stand for a size."""
    measured: list[float]
    together: float
    """The stress that moves the same part of all sizes together."""


def sizes(row: pd.Series, results: Results) -> Head:
    """Draw the stress that moves each size of a mixture, beside the measured hiding.

    Parameters
    ----------
    row
        The threshold of the card, with the columns of its scene.
    results
        The study with its tables.

    Returns
    -------
    Head
        The picture.
    """
    title = "The stress that moves each size of the mixture"
    caption = (
        "Orange: computed, with the interval that so few grains leave; rings: fewer "
        "than ten grains. Squares: the function that Wilcock and Crowe (2003) fitted "
        "to transport, at the measured stress of d50. An interval that reaches the "
        "frame is open."
    )
    found = _stresses_of_sizes(row, results)
    name = f"Stress that moves {percent(row['fraction'])} of a size, Pa"
    return Head(partial(_draw_sizes, found, name), title, caption)


def _stresses_of_sizes(row: pd.Series, results: Results) -> _Sizes:
    """The stresses of each size at the fraction of the card."""
    classes = results.joined("size_class")
    here = classes[classes["fraction"] == row["fraction"]]
    here = here[here["scene_id"] == row["scene_id"]].sort_values("size_over_d")
    weight = Grain.of_table(row).layer_weight * here["size_over_d"].to_numpy(float)
    names = []
    for size, count in zip(here["size_over_d"], here["count"], strict=True):
        grains = f"{count:.0f} grains" if count != 1 else "1 grain"
        names.append(f"{1e3 * float(row['d_m']) * size:.3g} mm, {grains}")
    return _Sizes(
        names,
        value=weight * here["shields_own"].to_numpy(float),
        low=weight * here["shields_own_low"].to_numpy(float),
        high=weight * here["shields_own_high"].to_numpy(float),
        few=here["few"].to_numpy(bool),
        measured=[answers.measured_of_size(row, size) for size in here["size_over_d"]],
        together=float(row["rho_f_kg_m3"]) * float(row["ustar0_m_s"]) ** 2,
    )


def _draw_sizes(found: _Sizes, name: str, narrow: bool) -> Canvas:
    """A line for each size: its interval, its stress, and the measured one."""
    count = len(found.names)
    canvas = figure(narrow, 60 + 26 * count)
    ax = canvas.subplots()
    margins(canvas, 128, 12, 24, 24)
    value = found.value
    at = found.together
    top = 1.15 * np.nanmax([*value[np.isfinite(value)], *found.measured, at])
    places = np.arange(count)[::-1]
    left = np.nan_to_num(found.low, nan=0.0)
    right = np.nan_to_num(found.high, nan=2 * top)
    ax.hlines(places, left, right, color=PALE, lw=11, zorder=1)
    few = found.few
    ax.plot(value[~few], places[~few], "o", color=ANSWER, ms=8)
    ax.plot(value[few], places[few], "o", color=ANSWER, mfc=GROUND, mew=1.6, ms=8)
    ax.plot(found.measured, places, "s", color=INK, ms=6)
    ax.axvline(at, color=ANSWER, lw=1, ls=(0, (2, 2)), zorder=0.5)
    ax.set_yticks(places, found.names)
    ax.set(xlim=(0, top), ylim=(-0.6, count - 0.4))
    if narrow:
        ax.set_title(name, x=-0.5)
    else:
        ax.set_title(f"{name}; line: all sizes together, {at:.3g}")
    return canvas
