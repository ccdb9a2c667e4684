"""Figures of piles: the fraction of grains that moved, and the extended Shields diagram."""

from collections.abc import Iterator, Mapping

import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.report import captions, labels, laws, shields, style, theory
from orchestrator.report.apart import SHAPE, parted
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results, split, valid

TAU = ("reynolds", "shields", "shields_low", "shields_high")
SHOWN = ("alpha_deg", "z0_over_d", "d_m", "nu_m2_s", "force_law")
"""What figures, panels, axes, colours and markers tell apart."""

MARKERS = 30
"""Most of a curve: peeling gives one for each grain."""


def fractions(results: Results) -> Iterator[Figure]:
    """Fig. 14, one for each slope."""
    curve = results.joined("pile_curve")
    moved = curve[curve["moved"] > 0] if len(curve) else curve
    for (alpha,), rows in split(moved, "alpha_deg"):
        yield Figure(
            f"fractions-alpha{alpha:g}",
            f"Fraction of moving grains, α = {alpha:g}°",
            captions.fractions(rows),
            tuple(sorted(set(rows["case"].dropna()))),
            _fractions(results, rows),
        )


def extended(results: Results) -> Iterator[Figure]:
    """Figs. 15 and 16, the extended Shields diagram, one for each z0/d."""
    found = results.joined("pile_threshold")
    reached = found[found["shields"].notna()] if len(found) else found
    for (ratio,), rows in split(reached, "z0_over_d"):
        written = labels.ratio_of(float(str(ratio)), "d")
        yield Figure(
            f"extended-shields-{written.replace('/', '').replace(' ', '')}",
            f"Extended Shields diagram, z₀ = {written}",
            captions.extended(rows),
            tuple(sorted(set(rows["case"].dropna()))),
            _extended(results, rows),
        )


def _fractions(results: Results, rows: pd.DataFrame) -> Canvas:
    """n/N against Re* and against tau, a row of panels for each z0/d."""
    choices, rows, variants = parted(rows, *SHOWN)
    keys = ["z0_over_d", *choices]
    panels = [part for _, part in split(rows, *keys)][::-1]
    figure = style.canvas(2.3 * len(panels) + 0.9)
    axes = figure.subplots(len(panels), 2, sharex="col", sharey=True, squeeze=False)
    # of the piles alone: single grains have more diameters than there are colours
    diameters = sorted(set(results.beds("pile")["d_m"]))
    colours = style.palette("d_m", diameters)
    for row, part in zip(axes, panels, strict=True):
        for _, curve in split(part, "scene_id"):
            colour = colours[float(curve["d_m"].iloc[0])]
            _curve(row[0], curve, "reynolds", colour)
            _curve(row[1], curve, "shields", colour)
        row[0].set_title(labels.panel(part.iloc[0], ("alpha_deg", *keys)), loc="left")
        row[0].set(ylabel="$n/N$", xscale="log", ylim=(0, 1))
    for ax in axes[:, 0]:
        style.plain_ticks(ax.xaxis)
        shields.shade_transition(ax, rows)
    shields.label_lowest(list(axes[:, 0]), labels.RE_AXIS)
    shields.label_lowest(list(axes[:, 1]), labels.TAU_AXIS)
    used = set(rows["d_m"])
    entries = [style.entry(labels.written("d_m", d), c) for d, c in colours.items() if d in used]
    style.legends(figure, entries, [*shields.point_entries(rows), *variants])
    return figure


def _curve(ax: Axes, curve: pd.DataFrame, column: str, colour: str) -> None:
    face = colour if valid(curve).all() else "white"
    ax.plot(
        curve[column],
        curve["fraction_moved"],
        color=colour,
        lw=0.8,
        ms=3,
        marker=str(curve[SHAPE].iloc[0]),
        markevery=-(-len(curve) // MARKERS),
        mfc=face,
        mew=0.7,
        gid=str(curve["scene_id"].iloc[0]),
    )


def _extended(results: Results, rows: pd.DataFrame) -> Canvas:
    """tau_c against Re* by fraction, a panel for each slope, the single grain's line beside it."""
    choices, rows, variants = parted(rows, *SHOWN, "fraction")
    keys = ["alpha_deg", *choices]
    panels = [part for _, part in split(rows, *keys)]
    columns = min(len(panels), 2)
    lines = -(-len(panels) // columns)
    figure = style.canvas((2.6 if columns == 2 else 3.4) * lines + 0.9)
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
    axes = list(grid[: len(panels)])
    for unused in grid[len(panels) :]:
        unused.remove()
    colours = style.palette("fraction", sorted(set(rows["fraction"])))
    dashes = laws.dashes(rows["force_law"])
    for ax, part in zip(axes, panels, strict=True):
        references = _panel(ax, results, part, colours, dashes)
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    # below the first grains lies the threshold of one, which they are held against
    shields.prepare(axes, panels, (rows["reynolds"].min() / 5, rows["reynolds"].max() * 2))
    shields.mark_drag_law(axes, panels)
    entries = [style.entry(labels.written("fraction", f), c) for f, c in colours.items()]
    looks = [
        *shields.line_entries(rows, dashes),
        *shields.point_entries(rows),
        *variants,
        *references,
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
    return shields.draw_sloped_air(ax, piles, style.AIR)
