"""Figures of single grains: closed form and DEM by entrainment angle, by slope and by force law."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.report import labels, shields, style, theory
from orchestrator.report.page import caption
from orchestrator.report.results import Results, by_dem, case_names, held, split, valid
from orchestrator.report.shields import SHAPE, parted
from orchestrator.report.style import Figure, Sample
from orchestrator.study import fields

CROSS = "beyond the paper"
SHOWN = ("alpha_deg", "beta_deg", "d_m", "nu_m2_s", "force_law")
"""Columns that the axes, colours and markers of these figures tell apart, or lump on purpose."""
DEM = ("reynolds", "shields_dem", "shields_dem_low", "shields_dem_high")


def draw(results: Results) -> Iterator[Figure]:
    """Figs. 5 to 8: on a flat bed by entrainment angle, or of many laws by law; on slopes by slope.

    Ramps of the flow are left out: they give no threshold.
    """
    grains = results.beds("grain")
    scenes = grains[held(grains)]
    dem = by_dem(results.joined("single_grain"))
    dem = dem[held(dem)] if len(dem) else dem
    flat = scenes[scenes["alpha_deg"] == 0]
    if theory.many(flat["force_law"]):
        for (ratio,), own in split(flat, "z0_over_d"):
            yield from _compared(own, dem, labels.ratio_of(float(str(ratio)), "d"))
    elif len(flat):
        yield _figure(results, flat, dem, "beta_deg")
    for _, own in split(scenes, "beta_deg"):
        if (own["alpha_deg"] > 0).any():
            yield _figure(results, own, dem, "alpha_deg")


def _of(dem: pd.DataFrame, scenes: pd.DataFrame) -> pd.DataFrame:
    """The rows of some scenes, with the markers of these."""
    return dem.merge(scenes[["scene_id", SHAPE]], on="scene_id") if len(dem) else dem


def _figure(results: Results, scenes: pd.DataFrame, dem: pd.DataFrame, by: str) -> Figure:
    """The closed form and DEM on it, coloured by entrainment angle or slope, by z0/d and law."""
    choices, scenes, variants = parted(scenes, *SHOWN, "z0_over_d")
    points = _of(dem, scenes)
    if points.empty:  # the closed form depends on nothing that is about its answer
        choices = [one for one in choices if fields.COLUMNS[one].info.about == "question"]
    keys = ["z0_over_d", *choices]
    panels = [part for _, part in split(scenes, *keys)][::-1]
    figure, axes = style.grid(len(panels), 2.4)
    colours = style.palette(by, results.values(by))
    dashes = theory.dashes(scenes["force_law"])
    for ax, part in zip(axes, panels, strict=True):
        published = _panel(ax, part, points, by, colours, dashes)
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    low, high = theory.span(scenes)
    shields.prepare(axes, panels, (low / 2, high * 2))
    shields.mark_drag_law(axes, panels)
    looks: list[Sample] = [
        *shields.within(axes, published),
        *shields.line_entries(scenes, dashes),
    ]
    if len(points):
        looks += [*shields.point_entries(points, variants)]
        if _beyond(points).any():
            label = "crossed: diameter beyond the paper’s"
            looks.append(Line2D([], [], ls="", marker="x", color="0.2", ms=4, label=label))
        looks += variants
    style.legends(figure, _colour_entries(scenes, by, colours), looks)
    flat, alone = by == "beta_deg", points.empty
    stem, beta = ("closed-form" if alone else "dem"), scenes["beta_deg"].iloc[0]
    number = 5 if flat else 7
    text = caption(
        "grain",
        about=shields.about(scenes),
        lines=shields.references(scenes, sloped=not flat),
        by=by,
        number=number,
    )
    if not alone:
        text += f" {caption('grain_dem', about=shields.about(points), number=number + 1)}"
    bed = "horizontal bed" if flat else f"slope, β = {beta:g}°"
    return Figure(
        f"{stem}-horizontal" if flat else f"{stem}-slope-beta{beta:g}",
        f"One grain on a {bed}: closed form" + ("" if alone else " and DEM"),
        text,
        case_names(points),
        figure,
        fold=not flat,
    )


def _panel(
    ax: Axes,
    scenes: pd.DataFrame,
    points: pd.DataFrame,
    by: str,
    colours: dict[float, str],
    dashes: Mapping[str, theory.Dash],
) -> list[Artist]:
    """One z0/d; returns the legend's entries of the references."""
    published: list[Artist] = []
    for (value,), series in split(scenes, by):
        colour = colours[float(str(value))]
        shields.draw_branches(ax, theory.branches(series), colour, dashes)
        if len(points):
            own = points[points["scene_id"].isin(series["scene_id"])]
            shields.draw_points(ax, own, colour, DEM)
            crossed = own[_beyond(own)]
            for filled, cross in ((True, "white"), (False, "0.4")):
                x, y = crossed.loc[valid(crossed) == filled, list(DEM[:2])].to_numpy(float).T
                ax.plot(x, y, "x", color=cross, ms=2.6, mew=0.8, zorder=4, gid=CROSS)
        if by == "alpha_deg":
            published = shields.draw_sloped_air(ax, series, colour)
    if by == "beta_deg":
        published = [*shields.draw_water(ax), *shields.draw_air(ax, scenes)]
    return published


def _beyond(points: pd.DataFrame) -> "pd.Series[bool]":
    """Which points are of diameters that the paper does not have."""
    return ~points["d_m"].between(*theory.SWEEP_M)


def _colour_entries(rows: pd.DataFrame, by: str, colours: dict[float, str]) -> list[Artist]:
    used = set(rows[by])
    return [style.entry(labels.written(by, v), c) for v, c in colours.items() if v in used]


def _compared(scenes: pd.DataFrame, dem: pd.DataFrame, ratio: str) -> Iterator[Figure]:
    """Many laws at one z0/d: colours mean laws, a panel for each entrainment angle."""
    choices, scenes, variants = parted(scenes, *SHOWN, "z0_over_d")
    points, keys = _of(dem, scenes), ["beta_deg", *choices]
    panels = [part for _, part in split(scenes, *keys)]
    for start in range(0, len(panels), style.PANELS):
        chosen = panels[start : start + style.PANELS]
        every = pd.concat(chosen)
        own = points[points["scene_id"].isin(every["scene_id"])] if len(points) else points
        lines, about = shields.references(every), shields.about(own)
        yield Figure(
            f"shields-{ratio.replace('/', '')}"
            + (f"-{start // style.PANELS + 1}" if start else ""),
            f"Force laws on a horizontal bed, z₀ = {ratio}",
            caption("compared", about=about, lines=lines),
            case_names(own),
            _laws(chosen, own, keys, variants),
            fold=start > 0,
        )


def _laws(
    panels: list[pd.DataFrame], points: pd.DataFrame, keys: list[str], variants: list[Sample]
) -> Canvas:
    figure, axes = style.grid(len(panels), 2.4)
    for ax, part in zip(axes, panels, strict=True):
        published = shields.draw_water(ax)
        for branch in theory.branches(part):
            colour, dash = theory.look(branch.law)
            shields.draw_branches(ax, [branch], colour, {branch.law: dash})
            if len(points):
                own = points[points["scene_id"].isin(part["scene_id"])]
                shields.draw_points(ax, own[own["force_law"] == branch.law], colour, DEM)
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    every = pd.concat(panels)
    low, high = theory.span(every)
    shields.prepare(axes, panels, (low / 1.5, high * 1.5))
    entries: list[Sample] = []
    for name in theory.drawn(every["force_law"]):
        colour, dash = theory.look(name)
        label = labels.value("force_law", name)
        entries.append(Line2D([], [], color=colour, ls=dash, lw=1.4, label=label))
    marks = shields.point_entries(points) if len(points) else []
    style.legends(figure, [], [*entries, *published, *marks, *variants])
    return figure


def accuracy(results: Results) -> Iterator[Figure]:
    """u* of DEM over that of the closed form, a panel for each increment of the load steps."""
    dem = by_dem(results.joined("single_grain"))
    dem = dem[held(dem) & dem["ustar_m_s"].notna()] if len(dem) else dem
    if dem.empty:
        return
    exact = dem["ustar_closed_form_m_s"]
    names = {"value": "ustar_m_s", "low": "ustar_low_m_s", "high": "ustar_high_m_s"}
    rows = dem.assign(**{name: dem[column] / exact for name, column in names.items()})
    choices, rows, variants = parted(rows, *SHOWN, "z0_over_d", "load_increment")
    keys = ["load_increment", *choices]
    panels = [part for _, part in split(rows, *keys)]
    figure = style.canvas(2.1 * len(panels) + 1.0)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    colours = style.palette("alpha_deg", results.values("alpha_deg"))
    axes[0].set_xscale("log")
    for ax, part in zip(axes, panels, strict=True):
        ax.axhline(1, color="0.3", lw=0.8, zorder=1)
        for (alpha,), own in split(part, "alpha_deg"):
            colour = colours[float(str(alpha))]
            shields.draw_points(ax, own, colour, ("reynolds", "value", "low", "high"))
        for bars in (line for line in ax.lines if line.get_gid() == "intervals"):
            bars.set_alpha(0.3)  # of hundreds of points the bars would hide the markers
        reach = 1.6 * float(np.nanmax(np.abs(part[["value", "low", "high"]] - 1)))
        ax.set(ylim=(1 - reach, 1 + reach), ylabel=r"$u^\star_{DEM}/u^\star_{closed\;form}$")
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    for ax in axes:
        style.plain_ticks(ax.xaxis)
        shields.shade_transition(ax, rows)
    axes[-1].set_xlabel(labels.RE_AXIS)
    entries = _colour_entries(rows, "alpha_deg", colours)
    style.legends(figure, entries, [*shields.point_entries(rows, variants), *variants])
    far, holds = (rows["value"] - 1).abs(), valid(rows)
    deviations = [
        f"{far[chosen].max():.2%} {name}"
        for chosen, name in ((holds, "where its law holds"), (~holds, "where it does not"))
        if chosen.any()
    ]
    text = caption(
        "accuracy",
        about=shields.about(rows),
        several=rows["load_increment"].nunique() > 1,
        deviations=", ".join(deviations),
    )
    yield Figure("accuracy", "DEM over closed form", text, case_names(rows), figure, fold=True)
