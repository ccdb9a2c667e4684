"""Figures of piles: the fraction of grains that moved, and the extended Shields diagram."""

from collections.abc import Iterator, Mapping

import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.report import captions, labels, laws, reference, shields, style, theory
from orchestrator.report.apart import SHAPE, parted
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results, drawable, split

TAU = ("reynolds", "shields", "shields_low", "shields_high")
SHOWN = ("alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "force_law")
"""Columns that figures, panels, axes, colours and markers tell apart."""
DRAWN = (*SHOWN, *TAU, "fraction", "scene_id", "regime", "usable", "answered_method", SHAPE)
"""Columns that the extended diagram is drawn from: each point as a row of a hundred is dear."""

MOST = 6
"""Panels of a figure."""
SHOWN_UP_TO = 0.9
"""n/N up to which the axis of the stress holds every curve."""
MARKERS = 30
"""Most of a curve: peeling gives one for each grain."""


def fractions(results: Results) -> Iterator[Figure]:
    """Fig. 14: n/N against tau, figures of each slope."""
    curve = results.tables.get("pile_curve", pd.DataFrame())
    if len(curve):
        curve = curve[(curve["moved"] > 0) & drawable(curve, "shields")]
    curves = {str(one): own for (one,), own in split(curve, "scene_id")}
    scenes = results.scenes[results.scenes["scene_id"].isin(curves)]
    # of the piles alone: single grains have more diameters than there are colours
    colours = style.palette("d_m", sorted(set(results.beds("pile")["d_m"])))
    for (alpha,), rows in split(scenes, "alpha_deg"):
        choices, rows, variants = parted(rows, *SHOWN)
        keys = ["z0_over_d", *choices]
        for number, panels in enumerate(_sixes(rows, keys)):
            some = pd.concat(panels)
            yield Figure(
                f"fractions-alpha{alpha:g}" + (f"-{number + 1}" if number else ""),
                f"Fraction of moving grains, {labels.plain('alpha_deg', alpha)}" + _part(number),
                captions.fractions(some),
                tuple(sorted(set(some["case"].dropna()))),
                _fractions(panels, keys, curves, colours, variants),
                fold=number > 0 or alpha != scenes["alpha_deg"].min(),
            )


def extended(results: Results) -> Iterator[Figure]:
    """Figs. 15 and 16, the extended Shields diagram by slope, figures for each z0/d."""
    found = results.joined("pile_threshold")
    reached = found[drawable(found, "reynolds", "shields")] if len(found) else found
    colours = style.palette("fraction", sorted(set(reached["fraction"]))) if len(reached) else {}
    for (ratio,), rows in split(reached, "z0_over_d"):
        written = labels.ratio_of(float(str(ratio)), "d")
        choices, rows, variants = parted(rows, *SHOWN, "fraction")
        keys = ["alpha_deg", *choices]
        used = list(dict.fromkeys((*DRAWN, *keys)))
        for number, panels in enumerate(_sixes(rows, keys)):
            some = pd.concat(panels)
            yield Figure(
                f"extended-shields-{written.replace('/', '').replace(' ', '')}"
                + (f"-{number + 1}" if number else ""),
                f"Thresholds of piles by slope, z₀ = {written}" + _part(number),
                captions.extended(some),
                tuple(sorted(set(some["case"].dropna()))),
                _extended(results, [part[used] for part in panels], keys, colours, variants),
                fold=number > 0 or ratio != reached["z0_over_d"].min(),
            )


def _part(number: int) -> str:
    return f", more panels ({number})" if number else ""


def _sixes(rows: pd.DataFrame, keys: list[str]) -> Iterator[list[pd.DataFrame]]:
    """The panels by six, those of the most piles in the first figure, in each by rising keys."""
    panels = [part for _, part in split(rows, *keys)]
    order = sorted(range(len(panels)), key=lambda i: (-panels[i]["scene_id"].nunique(), i))
    for start in range(0, len(panels), MOST):
        yield [panels[i] for i in sorted(order[start : start + MOST])]


def _fractions(
    panels: list[pd.DataFrame],
    keys: list[str],
    curves: Mapping[str, pd.DataFrame],
    colours: dict[float, str],
    variants: list[style.Sample],
) -> Canvas:
    """n/N against tau of the grains that had moved, a panel for each z0/d and variant."""
    figure, axes = style.grid(len(panels), 2.3)
    for ax, part in zip(axes, panels, strict=True):
        for _, pile in part.iterrows():
            _curve(ax, pile, curves[pile["scene_id"]], colours[float(pile["d_m"])])
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
        if (place := ax.get_subplotspec()) is None or place.is_first_col():
            ax.set_ylabel("$n/N$")
    rows = pd.concat(panels)
    axes[0].set(xscale="log", xlim=_reach([curves[one] for one in rows["scene_id"]]), ylim=(0, 1))
    for ax in axes:
        style.plain_ticks(ax.xaxis)
    shields.label_lowest(axes, labels.TAU_AXIS)
    used = set(rows["d_m"])
    entries = [style.entry(labels.written("d_m", d), c) for d, c in colours.items() if d in used]
    style.legends(figure, entries, [*shields.point_entries(rows, variants), *variants])
    return figure


def _reach(curves: list[pd.DataFrame]) -> tuple[float, float]:
    """The stresses that are shown: the last grains of a pile may wait for a hundred times those."""
    rows = pd.concat(curves)
    rows = rows[rows["shields"] > 0]
    shown = rows[rows["fraction_moved"] <= SHOWN_UP_TO]["shields"]
    shown = shown if len(shown) else rows["shields"]
    return float(shown.min()) / 1.2, 1.2 * float(shown.max())


def _curve(ax: Axes, pile: pd.Series, curve: pd.DataFrame, colour: str) -> None:
    face = colour if pile["law_holds"] else "white"
    ax.plot(
        curve["shields"],
        curve["fraction_moved"],
        color=colour,
        lw=0.8,
        ms=3,
        marker=str(pile[SHAPE]),
        markevery=-(-len(curve) // MARKERS),
        mfc=face,
        mew=0.7,
        gid=str(pile["scene_id"]),
    )


def _extended(
    results: Results,
    panels: list[pd.DataFrame],
    keys: list[str],
    colours: dict[float, str],
    variants: list[style.Sample],
) -> Canvas:
    """tau_c against Re* by fraction, the single grain's line beside it."""
    rows = pd.concat(panels)
    figure, axes = style.grid(len(panels), 2.6 if len(panels) > 1 else 3.4)
    dashes = laws.dashes(rows["force_law"])
    for ax, part in zip(axes, panels, strict=True):
        references = _panel(ax, results, part, colours, dashes)
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    # below the first grains lies the threshold of one, which they are held against
    shields.prepare(axes, panels, (rows["reynolds"].min() / 5, rows["reynolds"].max() * 2))
    shields.mark_drag_law(axes, panels)
    entries = [style.entry(labels.written("fraction", f), c) for f, c in colours.items()]
    looks = [
        *shields.within(axes, shields.line_entries(rows, dashes)),
        *shields.point_entries(rows, variants),
        *variants,
        *shields.within(axes, references),
    ]
    style.legends(figure, entries, looks)
    return figure


def _panel(
    ax: Axes,
    results: Results,
    rows: pd.DataFrame,
    colours: dict[float, str],
    dashes: Mapping[str, laws.Dash],
) -> list[Artist]:
    piles = results.scenes[results.scenes["scene_id"].isin(rows["scene_id"])]
    for _, scenes in split(piles, "beta_deg"):
        shields.draw_branches(ax, theory.branches(scenes), "0.2", dashes)
    for (fraction,), points in split(rows, "fraction"):
        colour = colours[float(str(fraction))]
        for _, series in split(points, "nu_m2_s", "force_law", "regime", SHAPE):
            # piles that differ in more than d are a scatter, not a line
            if series["d_m"].is_unique:
                ordered = series.sort_values("reynolds")
                ax.plot(ordered["reynolds"], ordered["shields"], color=colour, lw=0.6, zorder=2)
        shields.draw_points(ax, points, colour, TAU)
    in_air = shields.draw_sloped_air(ax, piles, style.AIR)
    wet = not in_air or not reference.in_gas(piles).all()
    return [*in_air, *(shields.draw_water(ax) + shields.draw_measured(ax) if wet else [])]
