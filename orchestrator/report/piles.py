"""Figures of piles: the fractions of grains that moved, and beds that change."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.report import labels, shields, style
from orchestrator.report.page import caption
from orchestrator.report.results import Results, case_names, drawable, split
from orchestrator.report.style import Figure, Look

SHOWN_UP_TO = 0.9
"""n/N up to which the axis of the stress holds every curve."""
MARKERS = 30
"""Largest number of markers of a curve: peeling gives one for each grain."""
FROZEN: Look = {"ls": "--", "lw": 0.9, "label": "flow of the whole pile"}
WORN: Look = {"lw": 1.3, "label": "flow of the bed as it is"}
APART: Look = {"ls": "", "marker": "o", "ms": 4, "label": "first 5 % apart"}


def fractions(results: Results) -> Iterator[Figure]:
    """Draw the right half of Fig. 14: n/N against the Shields number.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        The figures of each slope; those of the least slope first, which are not folded.
    """
    title = "Fraction of moving grains"
    yield from _fractions(results, "shields", "fractions", title)


def fractions_by_reynolds(results: Results) -> Iterator[Figure]:
    """Draw the left half of Fig. 14: n/N against Re*.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        The figures of each slope, which are all folded.
    """
    title = "Fraction of moving grains against Re*"
    for figure in _fractions(results, "reynolds", "fractions-reynolds", title):
        yield replace(figure, fold=True)


def _fractions(results: Results, along: str, name: str, title: str) -> Iterator[Figure]:
    """The figures of n/N along a column of the curves."""
    curves = _curves(results)
    scenes = results.scenes[results.scenes["scene_id"].isin(curves)]
    piles = results.beds("pile")
    sizes_of_slopes = scenes.groupby("alpha_deg")["d_m"].nunique()
    has_one_size = (sizes_of_slopes == 1).all()
    by = "nu_m2_s" if has_one_size and piles["nu_m2_s"].nunique() > 1 else "d_m"
    # of the piles alone: single grains have more diameters than there are colours
    colours = style.palette(by, sorted(set(piles[by])))
    x = labels.TAU_AXIS if along == "shields" else labels.RE_AXIS
    for (alpha,), of_slope in split(scenes, "alpha_deg"):
        choices, rows = shields.parted(
            of_slope, "alpha_deg", "z0_over_d", "force_law", by
        )
        is_first = alpha == scenes["alpha_deg"].min()
        slope = labels.plain("alpha_deg", alpha)
        for sheet in shields.sheets(rows, ["z0_over_d", *choices], 2.3, x, "n/N"):
            yield Figure(
                name=f"{name}-alpha{alpha:g}{sheet.name}",
                title=f"{title}, {slope}{sheet.title}",
                caption=caption(
                    "fractions", about=shields.about(sheet.rows), along=along
                ),
                cases=case_names(sheet.rows),
                drawing=partial(_draw_fractions, sheet, curves, by, colours, along),
                fold=bool(sheet.name) or not is_first,
                tables=("pile_curve",),
            )


def _curves(results: Results) -> dict[str, pd.DataFrame]:
    """The points of each pile's curve that have a place on the axes, by scene."""
    table = results.tables.get("pile_curve", pd.DataFrame())
    if table.empty:
        return {}
    points = table[(table["moved"] > 0) & drawable(table, "shields")]
    return {str(scene_id): rows for (scene_id,), rows in split(points, "scene_id")}


def _draw_fractions(
    sheet: shields.Sheet,
    curves: Mapping[str, pd.DataFrame],
    by: str,
    colours: dict[float, str],
    along: str,
) -> Canvas:
    """Draw the curves of a sheet along a column, in colours by another."""
    _, axes = sheet.panels()
    for ax, rows in zip(axes, sheet.parts, strict=True):
        for _, pile in rows.iterrows():
            colour = colours[float(pile[by])]
            _draw_curve(ax, pile, curves[pile["scene_id"]], colour, along)
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


def _draw_curve(
    ax: Axes, pile: pd.Series, points: pd.DataFrame, colour: str, along: str
) -> None:
    """Draw the curve of one pile, hollow where its force law does not hold."""
    look: Look = {
        "marker": str(pile[shields.SHAPE]),
        "ms": 3,
        "mew": 0.7,
        "lw": 0.8,
        "markevery": -(-len(points) // MARKERS),
        "gid": str(pile["scene_id"]),
        "color": colour,
        "label": pile[shields.LABEL],
    }
    if not pile["law_holds"]:
        look["mfc"] = "white"
        look["label"] = "hollow: the force law does not hold"
    ax.plot(points[along], points["fraction_moved"], **look)


def wear(results: Results) -> Iterator[Figure]:
    """Draw beds that change beside the frozen ones.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    Figure
        Figures with panels by slope, packing and method.
    """
    rows = results.joined("bed_change")
    if rows.empty:
        return
    colours = style.palette("d_m", sorted(set(rows["d_m"])))
    keys = ["alpha_deg", "packing", "method"]
    for sheet in shields.sheets(rows, keys, 2.1, "n/N", labels.TAU_AXIS):
        _, axes = sheet.panels()
        for ax, part in zip(axes, sheet.parts, strict=True):
            for (d, _), of_pile in split(part, "d_m", "scene_id"):
                _draw_wear(ax, of_pile, colours[float(str(d))])
        # the panels share both axes
        axes[0].set(xlim=(0, None), ylim=(0, None))
        cases = []
        for scene_id in sheet.rows["scene_id"].unique():
            cases.append(results.plan.piles[scene_id].runs[-1].name)
        yield Figure(
            name=f"wear{sheet.name}",
            title=f"Frozen bed and bed that changes{sheet.title}",
            caption=caption("wear"),
            cases=tuple(cases),
            drawing=shields.legends(sheet, "d_m", colours),
            tables=("bed_change",),
        )


def _draw_wear(ax: Axes, rows: pd.DataFrame, colour: str) -> None:
    """Draw the curves of one pile as it was, and as it is when grains have gone."""
    fraction = rows["fraction_moved"]
    ax.plot(fraction, rows["shields_frozen"], color=colour, **FROZEN)
    ax.plot(fraction, rows["shields"], color=colour, **WORN)
    end = rows[fraction == rows["holds_until"]]
    ax.plot(end["fraction_moved"], end["shields"], color=colour, **APART)
