"""The extended Shields diagram of a study: beds, grains, laws and measurements."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.digits import percent
from orchestrator.report import labels, shields, style, theory
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import Results, case_names, drawable, split_by
from orchestrator.report.shields import (
    DEM,
    LABEL,
    PILE,
    RESULT,
    SHAPE,
    DiagramSheet,
    Points,
)
from orchestrator.report.style import Figure
from orchestrator.report.theory import Going, Line
from orchestrator.study.criterion import SUSTAINED
from orchestrator.tables.facts import needs_run

NAME = "shields"
TOLD = ("alpha_deg", "d_m", "z0_over_d", "force_law")
"""Columns that the text of a point always tells of its scene."""
FEW = 8
"""Number of piles up to which every fraction is drawn in the one diagram."""
EXACT = 60
"""Number of single grains up to which those by the closed form are points as well."""
LINES = 3
"""Number of laws beyond which only those near the measurements are drawn."""
LEAD = (
    "Critical Shields number of the beds and grains of this study against the grain "
    "Reynolds number, beside published curves and measurements."
)
"""What stands under the drawing."""
CAPTION = """\
{% from "captions.j2" import is_open, low_regime, references %} {% if piles %} Squares:
beds. The stress is the mean wall stress over the grains that had moved when their
fraction was first {{ fractions }}; {{ piles.methods }}. {{ low_regime(piles) }} {%
endif %} {% if grains %} Dots: single grains; {{ grains.methods }}. {% endif %} Bars are
intervals; an arrow has no upper end. {{ is_open({"is_open": (piles
and piles.is_open) or (grains and grains.is_open)}) }} Lines: one grain on a flat bed
({{ names }}). A line is dotted where the force law does not hold but the study has
grains. {{ references(about) }} Pale grey dots: each bed of
which a threshold was measured, in flumes, in rivers and in wind in the field."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw the one diagram of a study: piles, single grains, laws and measurements.

    Yields
    ------
    Figure
        One figure, or none.
    """
    piles = shown_piles(results)
    grains = _grains_on_the_least_slope(results)
    lines = _lines(results)
    if not lines and piles.empty and grains.empty:
        return
    curves = _curves(lines, pd.concat([grains, piles]))
    canvas, data = _diagram(results, piles, grains, curves)
    text = filled(
        CAPTION,
        piles=shields.about(piles),
        grains=shields.about(grains),
        fractions=", ".join(map(percent, _fractions(piles))),
        names="; ".join(curve.label for curve in curves),
        about={**shields.about(results.scenes), "sloped": ""},
    )
    title = "Extended Shields diagram"
    cases = case_names(piles, grains)
    yield Figure(NAME, title, text, cases, canvas, data=data, place="lead", lead=LEAD)


def _diagram(
    results: Results,
    piles: pd.DataFrame,
    grains: pd.DataFrame,
    curves: Sequence[shields.DrawnCurve],
) -> tuple[Canvas, dict[str, list[list[str]]]]:
    """The drawing, and what the page says of each point."""
    scenes = results.scenes
    panels = cache(partial(style.grid, [""], 3.5, *shields.AXES))
    sheet = DiagramSheet("", "", [scenes], scenes, panels)
    canvas, (ax,) = panels()
    xlim = shields.ends(scenes, piles, grains)
    points = _points(grains, piles, results)
    level = scenes.assign(alpha_deg=0.0)
    shields.draw_single_beds(ax, scenes)
    drawn = shields.diagram(ax, level, xlim, curves, points)
    shields.log_axes(sheet, xlim)
    _legends(canvas, ax)
    return canvas, _titles(drawn, grains, piles)


def _fractions(piles: pd.DataFrame) -> list[float]:
    """The fractions of piles, rising."""
    return sorted(set(piles.get("fraction", [])))


def _points(
    grains: pd.DataFrame, piles: pd.DataFrame, results: Results
) -> list[Points]:
    """The points of single grains and of piles, in the colours of their slopes."""
    shades = style.palette("alpha_deg", results.values("alpha_deg"))
    percents = ", ".join(f"{100 * fraction:g}" for fraction in _fractions(piles))
    name = f"bed at n/N = {percents} %"
    found = []
    for rows, label, columns, shape, size in (
        (grains, "single grain", DEM, "o", 2.4),
        (piles, name, PILE, "s", 3.6),
    ):
        for (alpha,), part in split_by(rows, "alpha_deg"):
            slope = f"{label}, {labels.value_text('alpha_deg', alpha)}"
            marked = part.assign(**{SHAPE: shape, LABEL: slope})
            found.append(Points(marked, shades[float(str(alpha))], columns, size))
    return found


def _titles(
    drawn: Sequence[tuple[Any, pd.DataFrame]],
    grains: pd.DataFrame,
    piles: pd.DataFrame,
) -> dict[str, list[list[str]]]:
    """What the page says of each point, by its group.

    The page's script finds points by the names of groups.
    """
    texts: dict[str, list[list[str]]] = {}
    of_grains = [*TOLD, *labels.varying(grains, *TOLD)] if len(grains) else []
    known = (*TOLD, "fraction")
    of_piles = [*TOLD, *labels.varying(piles, *known)] if len(piles) else []
    for number, (line, rows) in enumerate(drawn):
        is_pile = "fraction" in rows
        columns, telling = (PILE, of_piles) if is_pile else (DEM, of_grains)
        group = f"{NAME}-{number}"
        line.set_gid(group)
        texts[group] = [_texts(row, columns, telling) for _, row in rows.iterrows()]
    return texts


def _legends(canvas: Canvas, ax: Axes) -> None:
    """Legends of the laws above the one diagram, of all else below it."""
    samples = style.samples([ax])
    of_laws = [one for one in samples if one.get_gid() == RESULT[0]]
    others = [one for one in samples if one.get_gid() != RESULT[0]]
    style.legends_below(canvas, of_laws, others)


def _curves(lines: Sequence[Line], answers: pd.DataFrame) -> list[shields.DrawnCurve]:
    """The curves of what is answered, each law with its look."""
    criteria = set(answers.get("criterion", []))
    going: list[Going] = []
    if SUSTAINED in criteria:
        going = theory.sustained_curves(answers.assign(alpha_deg=0.0))
    # a law on another bed has a thinner line
    so_far: list[str] = []

    def look(each: Line | Going) -> tuple[str, theory.Dash, float]:
        colour, dash = theory.look(each.law)
        if isinstance(each, Going):
            return colour, dash, 1.6
        width = 1.4 / (1 + so_far.count(each.law))
        so_far.append(each.law)
        return colour, dash, width

    def name(each: Line | Going) -> str:
        return each.name

    return [*shields.curves_of(lines, going, criteria, name, look)]


def _grains_on_the_least_slope(results: Results) -> pd.DataFrame:
    """The single grains of the one diagram."""
    grains = _few_exact(shields.diagram_rows(results))
    grains = grains[drawable(grains, "reynolds", "shields_dem")]
    is_least: pd.Series[bool] = grains["alpha_deg"] == grains["alpha_deg"].min()
    return grains[is_least]


def _few_exact(grains: pd.DataFrame) -> pd.DataFrame:
    """Single grains, of which few that the closed form answered are points as well."""
    is_answered = "shields_closed_form" in grains
    if grains.empty or len(grains) > EXACT or not is_answered:
        return grains
    is_exact = ~needs_run(grains)
    exact = {
        "shields_dem": "shields_closed_form",
        "reynolds": "reynolds_closed_form",
        "ustar_m_s": "ustar_closed_form_m_s",
    }
    filled = {
        column: grains[column].where(~is_exact, grains[by])
        for column, by in exact.items()
    }
    return grains.assign(**filled)


def shown_piles(results: Results) -> pd.DataFrame:
    """List the thresholds of piles that the one diagram shows.

    Parameters
    ----------
    results
        The study.

    Returns
    -------
    DataFrame
        The thresholds at all fractions of few piles, and at one fraction of many.
    """
    rows = results.joined("pile_threshold")
    if rows.empty:
        return rows
    if rows["scene_id"].nunique() > FEW:
        rows = results.at_fraction
    return rows[drawable(rows, "reynolds", "shields")]


def _lines(results: Results) -> list[Line]:
    """The closed form on a flat bed: the laws of piles on their least and largest z0/d.

    Other laws have one line, on the bed that fits the measurements best; the two laws
    of the paper are one model, on one bed.
    """
    flat = theory.measured_lines(results.beds("pile").assign(alpha_deg=0.0))
    beds = [line.bed for line in flat]
    lines = [line for line in flat if line.bed in (beds[0], beds[-1])]
    drawn = {line.law for line in lines}
    others = [
        line for line in theory.best(theory.ranked(results)) if line.law not in drawn
    ]
    bed_of_pair = next((line.bed for line in others if line.law in theory.PAIR), None)
    near = [line for line in others if line.decades > 0]
    chosen = near if near and len(others) > LINES else others
    for line in chosen:
        if bed_of_pair and line.law in theory.PAIR:
            line = replace(line, bed=bed_of_pair)
        lines.append(line)
    return lines


def _texts(row: pd.Series, columns: Sequence[str], telling: Sequence[str]) -> list[str]:
    """What the page says of a point: scene, threshold, why it is not usable, case."""
    value, low, high = (row[name] for name in columns[1:])
    threshold = f"θ_c = {value:.4g}"
    if pd.notna(low) or pd.notna(high):
        threshold += f" ({labels.interval(low, high, 4, 'g')})"
    if "fraction" in row:
        threshold += f" at n/N = {percent(row['fraction'])}"
    ustar = row["ustar0_m_s"] if "ustar0_m_s" in row else row["ustar_m_s"]
    threshold += f", u*₀ = {ustar:.3g} m/s"
    case = row["case"] if isinstance(row["case"], str) else ""
    scene = ", ".join(labels.told(row, telling))
    return [scene, threshold, str(row["why_not"]), case]


FIGURE = FigureKind(order=60, draws=draw, uses=("pile_threshold", "single_grain"))
