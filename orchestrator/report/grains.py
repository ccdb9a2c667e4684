"""Figures of single grains: closed form and DEM by entrainment angle, by slope and by force law."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.lines import Line2D

from orchestrator.report import labels, shields, style, theory
from orchestrator.report.page import caption
from orchestrator.report.results import Results, by_dem, case_names, held, split, valid
from orchestrator.report.shields import SHAPE, parted
from orchestrator.report.style import Figure, Sample
from orchestrator.study import fields

SHOWN = ("alpha_deg", "beta_deg", "d_m", "nu_m2_s", "force_law")
"""Columns that the axes, colours and markers of these figures tell apart, or lump on purpose."""
DEM = ("reynolds", "shields_dem", "shields_dem_low", "shields_dem_high")


def draw(results: Results) -> Iterator[Figure]:
    """Figs. 5 to 8: on a flat bed by entrainment angle, or of many laws by law; on slopes by slope.

    Ramps of the flow are left out: they give no threshold.
    """
    grains = results.beds("grain")
    scenes = grains[held(grains)]
    flat = scenes[scenes["alpha_deg"] == 0]
    if theory.many(flat["force_law"]):
        for _, group in split(flat, "z0_over_d"):
            yield from _diagrams(results, group, "force_law")
    elif len(flat):
        yield from _diagrams(results, flat, "beta_deg")
    for _, group in split(scenes, "beta_deg"):
        if (group["alpha_deg"] > 0).any():
            yield from _diagrams(results, group, "alpha_deg")


def _dem(results: Results) -> pd.DataFrame:
    """Single grains that DEM answered under a held flow."""
    rows = by_dem(results.joined("single_grain"))
    return rows[held(rows)] if len(rows) else rows


def _diagrams(results: Results, scenes: pd.DataFrame, by: str) -> Iterator[Figure]:
    """The closed form and DEM on it, coloured by entrainment angle, slope or force law."""
    choices, scenes, variants = parted(scenes, *SHOWN, "z0_over_d")
    points, of_laws = _dem(results), by == "force_law"
    if len(points):
        points = points.merge(scenes[["scene_id", SHAPE]], on="scene_id")
    if points.empty:  # the closed form depends on nothing that is about its answer
        choices = [item for item in choices if fields.COLUMNS[item].info.about == "question"]
    keys = ["beta_deg" if of_laws else "z0_over_d", *choices]
    panels = [part for _, part in split(scenes, *keys)]
    for ending, _, chosen in style.pages(panels if of_laws else panels[::-1]):
        every = pd.concat(chosen)
        shown = points[points["scene_id"].isin(every["scene_id"])] if len(points) else points
        figure, axes = style.grid(len(chosen), 2.4)
        colours = {} if of_laws else style.palette(by, results.values(by))
        dashes = theory.dashes(every["force_law"])
        for ax, part in zip(axes, chosen, strict=True):
            published: list[Artist] = []
            for (value,), series in split(part, by):
                colour = theory.look(str(value))[0] if of_laws else colours[float(str(value))]
                for branch in theory.branches(series):
                    look = theory.look(branch.law) if of_laws else (colour, dashes[branch.law])
                    shields.draw_branch(ax, branch, *look)
                if by == "alpha_deg":
                    published = shields.draw_sloped_air(ax, series, colour)
                if len(shown):
                    group = shown[shown["scene_id"].isin(series["scene_id"])]
                    shields.draw_points(ax, group, colour, DEM)
            if by != "alpha_deg":
                in_air = [] if of_laws else shields.draw_air(ax, part)
                published = [*shields.draw_water(ax), *in_air]
            ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
        low, high = theory.span(every)
        shields.prepare(axes, chosen, (low / 2, high * 2))
        looks: list[Sample] = [*shields.within(axes, published)]
        if of_laws:
            for law in theory.drawn(every["force_law"]):
                colour, dash = theory.look(law)
                label = labels.value("force_law", law)
                looks.append(Line2D([], [], color=colour, ls=dash, lw=1.4, label=label))
        else:
            shields.mark_drag_law(axes, chosen)
            looks += shields.line_entries(every, dashes)
        if len(shown):
            looks += shields.point_entries(shown, variants)
        style.legends(figure, colour_entries(by, colours, every), [*looks, *variants])
        ratio = labels.ratio_of(float(every["z0_over_d"].iloc[0]), "d")
        lines = shields.references(every, sloped=by == "alpha_deg")
        if of_laws:
            name = f"shields-{ratio.replace('/', '')}"
            title = f"Force laws on a horizontal bed, z₀ = {ratio}"
            text = caption("compared", about=shields.about(shown), lines=lines)
        else:
            beta, dem = every["beta_deg"].iloc[0], "dem" if len(shown) else "closed-form"
            name, bed, number = f"{dem}-horizontal", "horizontal bed", 5
            if by == "alpha_deg":
                name, bed, number = f"{dem}-slope-beta{beta:g}", f"slope, β = {beta:g}°", 7
            title = f"One grain on a {bed}: closed form" + (" and DEM" if len(shown) else "")
            text = caption("grain", about=shields.about(every), lines=lines, by=by, number=number)
            if len(shown):
                text += f" {caption('grain_dem', about=shields.about(shown), number=number + 1)}"
        fold, cases = bool(ending) or by == "alpha_deg", case_names(shown)
        yield Figure(f"{name}{ending}", title, text, cases, figure, fold=fold)


def colour_entries(column: str, colours: dict[float, str], rows: pd.DataFrame) -> list[Artist]:
    """Legend of the colours that some rows have."""
    used = set(rows[column])
    return [style.entry(labels.plain(column, v), c) for v, c in colours.items() if v in used]


def accuracy(results: Results) -> Iterator[Figure]:
    """u* of DEM over that of the closed form, a panel for each increment of the load steps."""
    dem = _dem(results)
    dem = dem[dem["ustar_m_s"].notna()] if len(dem) else dem
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
        for (alpha,), group in split(part, "alpha_deg"):
            colour = colours[float(str(alpha))]
            shields.draw_points(ax, group, colour, ("reynolds", "value", "low", "high"))
        for bars in (line for line in ax.lines if line.get_gid() == "intervals"):
            bars.set_alpha(0.3)  # of hundreds of points the bars would hide the markers
        reach = 1.6 * float(np.nanmax(np.abs(part[["value", "low", "high"]] - 1)))
        ax.set(ylim=(1 - reach, 1 + reach), ylabel=r"$u^\star_{DEM}/u^\star_{closed\;form}$")
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    for ax in axes:
        style.plain_ticks(ax.xaxis)
        shields.shade_transition(ax, rows)
    axes[-1].set_xlabel(labels.RE_AXIS)
    entries = colour_entries("alpha_deg", colours, rows)
    style.legends(figure, entries, [*shields.point_entries(rows, variants), *variants])
    far, holds = (rows["value"] - 1).abs(), valid(rows)
    named = ((holds, "where its law holds"), (~holds, "where it does not"))
    deviations = ", ".join(f"{far[rule].max():.2%} {name}" for rule, name in named if rule.any())
    about, several = shields.about(rows), rows["load_increment"].nunique() > 1
    text = caption("accuracy", about=about, several=several, deviations=deviations)
    yield Figure("accuracy", "DEM over closed form", text, case_names(rows), figure, fold=True)
