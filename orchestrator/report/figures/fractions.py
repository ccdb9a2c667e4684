"""The part of the grains that has moved, against the flow, its stress, or its Re*."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.physics.verdict import BOTH, MODEL
from orchestrator.report import (
    answers,
    labels,
    sheets,
    shields,
    single,
    style,
    theory,
    units,
)
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import (
    Results,
    case_names,
    drawable,
    seeds_of,
    split_by,
)
from orchestrator.report.style import (
    ANSWER,
    FLOW,
    INK,
    MEASURED,
    PALE,
    Figure,
    Look,
)
from orchestrator.report.subjects import STRESS, ReportedQuantity

Along = Literal["flow", "shields", "reynolds"]
SHOWN_UP_TO = 0.9
"""n/N up to which the axis of the stress holds every curve."""
MARKERS = 30
"""Largest number of markers of a curve: peeling gives one for each grain."""
AXES: Mapping[Along, str] = {"shields": labels.TAU_AXIS, "reynolds": labels.RE_AXIS}
ENDINGS: Mapping[Along, tuple[str, str, str]] = {
    "flow": ("-flow", "", ""),
    "shields": ("", " against τ of those entrained", "Fig. 14, right"),
    "reynolds": ("-reynolds", " against Re* of those entrained", "Fig. 14, left"),
}
"""Endings of names and titles, and the figure of the paper."""
ADVISED: Look = {"color": ANSWER, "lw": 1.8}
REPLICATE: Look = {
    "label": "replicates (random seeds)",
    "color": ANSWER,
    "lw": 0.6,
}
OF_MODEL: Look = {"color": FLOW, "lw": 1.2, "ls": ":"}
BESIDE: Look = {
    "color": INK,
    "lw": 1.0,
    "ls": MEASURED,
}
SLOPE_OF_PAPER = 15.0
"""Slope of the pile of Fig. 14, degrees."""
OF_THE_CARD = """\
Fraction of the exposed grains that is entrained, against the {{ told }}. Thick: the
numbers of the card; disc: its answer; pale bar: its interval. {% if seeds %}Thin:
replicates (random seeds).{% endif %} {% if beside %}The other line: the same bed and
flow {{ beside }}.{% endif %}"""
LEAD = (
    "Fraction of the exposed grains that is entrained, n/N, of each bed of this slope."
)
"""What stands under the drawing."""
CAPTION = """\
{% from "captions.j2" import laws, protocol, is_open, low_regime %} {% if along ==
"flow" %}Fraction of the N(d) exposed grains that is entrained, n/N, against the {{ told
}} of the undisturbed flow. {% else %}After Fig. 14 of the paper: n/N against {{
{"shields": "τ", "reynolds": "Re*"}[along] }} of the mean {{ about.stress }} over the
entrained grains. The mean falls where the next grains to move feel less stress. {%
endif %}Above n/N = 90 % a curve may leave the frame. Forces: {% if about.is_followed
%}the drag of a grain's velocity relative to the fluid{% else %}{{ laws(about,
"Between the two") }}{% endif %}. {{ protocol(about) }} {{ is_open(about) }}
{{ low_regime(about) }}"""


def draw(results: Results) -> Iterator[Figure]:
    """Draw the part that has moved of the bed of the card, and of all beds.

    Yields
    ------
    Figure
        That of the card, then those of each slope: against the Shields number as the
        right half of Fig. 14 of the paper, against Re* as the left one.
    """
    yield from _of_the_card(results)
    yield from _of_all(results, "flow")
    yield from _of_all(results, "shields")
    yield from _of_all(results, "reynolds")


def _of_the_card(results: Results) -> Iterator[Figure]:
    """The curve of one bed against the flow that its card tells."""
    rows = results.exemplars
    is_other = theory.are_many(results) or answers.is_of_hills(results)
    if rows.empty or is_other or sheets.sizes_sheet(results) is not None:
        return
    if answers.are_several_beds(results.at_fraction):
        return
    row = rows.iloc[0]
    told = single.quantity_of_row(row).name
    others = seeds_of(row, results.at_fraction)
    beside = "" if single.is_level(row) else _other_name(row)
    title = f"Fraction entrained, against the {told}"
    text = filled(OF_THE_CARD, told=told, seeds=others, beside=beside)
    cases = tuple(run.name for run in results.plan.piles[str(row["scene_id"])].runs)
    drawing = _draw_card(row, others, results.tables["pile_curve"])
    yield Figure("share", title, text, cases, drawing, place="under")


def _draw_card(row: pd.Series, others: Sequence[str], table: pd.DataFrame) -> Canvas:
    """The curves of a bed and of its replicates, and its answer."""
    told = single.quantity_of_row(row)
    canvas = style.canvas(2.6, style.NARROW)
    ax = canvas.subplots()
    table = table[np.isfinite(table["ustar0_m_s"]) & (table["ustar0_m_s"] > 0)]
    for scene in others:
        points = table[table["scene_id"] == scene]
        flow = units.told_by(row, points["ustar0_m_s"], told)
        _draw_curve(ax, flow, points["fraction_moved"], REPLICATE)
    points = table[table["scene_id"] == row["scene_id"]]
    moved = points["fraction_moved"]
    reach = []
    for factor, look in curves_of_card(row):
        flow = units.told_by(row, factor * points["ustar0_m_s"], told)
        _draw_curve(ax, flow, moved, look)
        reach += _reach(flow, moved)
    _draw_answer(ax, row, told)
    reach.append(float(row[single.advised_column(row, told)]))
    ax.set(xlim=(0.9 * min(reach), 1.02 * max(reach)), ylim=(0, 1), ylabel="n/N")
    ax.set_xlabel(f"{told.name}, {told.unit}")
    handles = style.samples([ax])
    canvas.legend(handles=handles, loc="outside lower center")
    return canvas


def curves_of_card(row: pd.Series) -> list[tuple[float, Look]]:
    """List the curves of a bed with their looks, the advised one first.

    Parameters
    ----------
    row
        A threshold of the bed with the columns of its scene.

    Returns
    -------
    list of (float, dict)
        The factor on the computed flows, and the look. A level bed has one curve: its
        measured threshold is that of each of its grains.
    """
    if single.is_level(row) or np.isnan(row["compared_ustar0_m_s"]):
        return [(1.0, {**ADVISED, "label": single.MODEL})]
    factor = units.compared_over_computed(row)
    if row["advised"] == MODEL:
        model: Look = {**ADVISED, "label": single.MODEL}
        return [(1.0, model), (factor, {**BESIDE, "label": single.with_threshold(row)})]
    other: Look = {**ADVISED, "label": single.with_threshold(row)}
    return [(factor, other), (1.0, {**OF_MODEL, "label": single.model_name(row)})]


def _other_name(row: pd.Series) -> str:
    """What the second line of the card's figure is called."""
    if row["advised"] == MODEL:
        return single.with_threshold(row)
    return single.model_name(row)


def _draw_answer(ax: Axes, row: pd.Series, told: ReportedQuantity) -> None:
    """The number of the card with its interval; both where they have equal right."""
    fraction = float(row["fraction"])
    column = single.advised_column(row, told)
    at = float(row[column])
    stem = "compared_" if column.startswith("compared_") else ""
    ends = [float(row[f"{stem}{told.column(end)}"]) for end in ("_low", "_high")]
    if np.isfinite(ends).all():
        ax.plot(ends, [fraction] * 2, color=PALE, lw=6, gid="interval", zorder=1)
    ax.plot([at], [fraction], "o", color=ANSWER, ms=6, mec="white", gid="card")
    bold: Look = {"textcoords": "offset points", "color": ANSWER, "weight": "bold"}
    text = f"{at:#.3g} {told.unit}"
    ax.annotate(text, (at, fraction), xytext=(7, -8), **bold)
    if row["advised"] == BOTH:
        model = float(row[told.column()])
        ax.plot([model], [fraction], "o", color=FLOW, ms=6, mec="white", gid="model")
        own: Look = {**bold, "color": FLOW}
        ax.annotate(f"{model:#.3g} {told.unit}", (model, fraction), (7, -8), **own)


def _reach(flow: Any, moved: pd.Series) -> list[float]:
    """The flow of the first grain that has moved, and that of the last."""
    share = moved.to_numpy(float)
    if not (share > 0).any():
        return []
    is_last = share >= 0.999 * share.max()
    return [float(flow[share > 0].min()), float(flow[is_last].min())]


def _of_all(results: Results, along: Along) -> Iterator[Figure]:
    """The figures of n/N along a column of the curves, for each slope."""
    curves = _curves(results)
    scenes = results.scenes[results.scenes["scene_id"].isin(curves)]
    piles = results.beds("pile")
    sizes_of_slopes = scenes.groupby("alpha_deg")["d_m"].nunique()
    has_one_size = (sizes_of_slopes == 1).all()
    by = "nu_m2_s" if has_one_size and piles["nu_m2_s"].nunique() > 1 else "d_m"
    # of the piles alone: single grains have more diameters than there are colours
    colours = style.palette(by, sorted(set(piles[by])))
    least = scenes["alpha_deg"].min()
    for (alpha,), of_slope in split_by(scenes, "alpha_deg"):
        for part in shields.by_stress(of_slope):
            along_flow = _with_flow(part.rows, curves) if along == "flow" else curves
            for figure in _of_slope(part, along_flow, by, colours, along):
                is_shown = figure.place == "" and alpha == least and along == "flow"
                yield replace(figure, place="" if is_shown else "folded")


def _of_slope(
    part: shields.OfStress,
    curves: Mapping[str, pd.DataFrame],
    by: str,
    colours: Mapping[float, str],
    along: Along,
) -> Iterator[Figure]:
    """The figures of piles of one slope, of which further panels are folded."""
    scenes = part.rows
    choices, rows = shields.parted(scenes, "alpha_deg", "z0_over_d", "force_law", by)
    alpha = float(scenes["alpha_deg"].iloc[0])
    slope = labels.value_text("alpha_deg", alpha)
    name, title, follows = ENDINGS[along]
    is_of_paper = np.isclose(alpha, SLOPE_OF_PAPER)
    keys = ["z0_over_d", *choices]
    told = told_of(scenes)
    axis = AXES.get(along, f"{told.name}, {told.unit}")
    against = f", against the {told.name}" if along == "flow" else title
    for sheet in shields.sheets(rows, keys, 2.3, axis, "n/N"):
        yield Figure(
            name=f"fractions{name}-alpha{alpha:g}{part.name}{sheet.name}",
            title=f"Fraction entrained, n/N{against}, {slope}{part.title}{sheet.title}",
            caption=filled(
                CAPTION, about=shields.about(sheet.rows), along=along, told=told.name
            ),
            cases=case_names(sheet.rows),
            drawing=partial(_draw_panels, sheet, curves, by, colours, along),
            place="folded" if sheet.name else "",
            follows=follows + part.after if is_of_paper and not sheet.name else "",
            lead=LEAD,
        )


def told_of(scenes: pd.DataFrame) -> ReportedQuantity:
    """Choose the quantity by which the flows of several beds are told.

    Parameters
    ----------
    scenes
        The scenes.

    Returns
    -------
    ReportedQuantity
        That of each bed where it is one, else the bed shear stress.
    """
    every = {single.quantity_of_row(row) for _, row in scenes.iterrows()}
    return every.pop() if len(every) == 1 else STRESS


def _with_flow(
    scenes: pd.DataFrame, curves: Mapping[str, pd.DataFrame]
) -> dict[str, pd.DataFrame]:
    """The curves with the undisturbed flow of each point, in one quantity."""
    told = told_of(scenes)
    found = {}
    for _, row in scenes.iterrows():
        points = curves[row["scene_id"]]
        flow = units.told_by(row, points["ustar0_m_s"], told)
        found[str(row["scene_id"])] = points.assign(flow=flow)
    return found


def _curves(results: Results) -> dict[str, pd.DataFrame]:
    """The points of each pile's curve that have a place on the axes, by scene."""
    table = results.tables["pile_curve"]
    points = table[(table["moved"] > 0) & drawable(table, "shields")]
    return {str(scene_id): rows for (scene_id,), rows in split_by(points, "scene_id")}


def _draw_panels(
    sheet: shields.DiagramSheet,
    curves: Mapping[str, pd.DataFrame],
    by: str,
    colours: Mapping[float, str],
    along: Along,
) -> Canvas:
    """Draw the curves of a sheet along a column, in colours by another.

    A curve is open where its force law does not hold.
    """
    _, axes = sheet.panels()
    for ax, rows in zip(axes, sheet.parts, strict=True):
        for _, pile in rows.iterrows():
            points = curves[pile["scene_id"]]
            look: Look = {"color": colours[float(pile[by])], "lw": 0.8}
            look |= {"marker": str(pile[shields.SHAPE]), "label": pile[shields.LABEL]}
            look["gid"] = str(pile["scene_id"])
            if not pile["law_holds"]:
                look |= {"mfc": "white", "label": "open: the force law does not hold"}
            _draw_curve(ax, points[along], points["fraction_moved"], look)
    # the last grains of a pile may wait for a hundred times the stress of the others
    points = pd.concat([curves[scene_id] for scene_id in sheet.rows["scene_id"]])
    last = max(SHOWN_UP_TO, points["fraction_moved"].min())
    early = points[along][points["fraction_moved"] <= last]
    # the panels share the axes
    axes[0].set(
        xscale="log",
        xlim=(early.min() / 1.2, 1.2 * early.max()),
        ylim=(0, 1),
    )
    for ax in axes:
        style.plain_ticks(ax.xaxis)
    return shields.legends(sheet, by, colours)


def _draw_curve(ax: Axes, x: Any, moved: pd.Series, look: Look) -> None:
    """Draw the curve of one bed, with some of its flows as markers."""
    some = -(-len(moved) // MARKERS)
    ax.plot(x, moved, **{"ms": 3, "mew": 0.7, "markevery": some, **look})


FIGURE = FigureKind(order=70, draws=draw, needs=("pile_curve", "pile_threshold"))
