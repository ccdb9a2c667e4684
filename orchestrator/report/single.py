"""Figures of single grains: closed form and DEM by entrainment angle and by slope, accuracy."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.report import captions, labels, laws, shields, style, theory
from orchestrator.report.apart import SHAPE, parted
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results, by_dem, held, split, valid
from orchestrator.study import fields

CROSS = "beyond the paper"
SHOWN = ("alpha_deg", "beta_deg", "d_m", "nu_m2_s", "force_law")
"""Columns that the axes, colours and markers of these figures tell apart, or lump on purpose."""
DEM = ("reynolds", "shields_dem", "shields_dem_low", "shields_dem_high")


def by_angle(results: Results) -> Iterator[Figure]:
    """Figs. 5 and 6: single grains on a flat bed by entrainment angle, of one force law."""
    flat = _held(results)
    flat = flat[flat["alpha_deg"] == 0]
    if len(flat) and not laws.many(flat["force_law"]):
        yield from _pair(results, flat, _dem(results), "beta_deg", "horizontal bed")


def by_slope(results: Results) -> Iterator[Figure]:
    """Figs. 7 and 8: single grains on slopes, a figure for each entrainment angle."""
    dem = _dem(results)
    for (beta,), scenes in split(_held(results), "beta_deg"):
        if (scenes["alpha_deg"] > 0).any():
            yield from _pair(results, scenes, dem, "alpha_deg", f"slope, β = {beta:g}°")


def _held(results: Results) -> pd.DataFrame:
    """The scenes of single grains whose flow is held; ramps are not thresholds."""
    grains = results.beds("grain")
    return grains[held(grains)]


def _dem(results: Results) -> pd.DataFrame:
    """Their thresholds by DEM under a held flow."""
    dem = by_dem(results.joined("single_grain"))
    return dem[held(dem)] if len(dem) else dem


def _pair(
    results: Results, scenes: pd.DataFrame, dem: pd.DataFrame, by: str, bed: str
) -> Iterator[Figure]:
    """The closed form and, where there are results, DEM on it."""
    stem = "horizontal" if by == "beta_deg" else f"slope-beta{scenes['beta_deg'].iloc[0]:g}"
    number = 5 if by == "beta_deg" else 7
    points = dem[dem["scene_id"].isin(scenes["scene_id"])] if len(dem) else dem
    alone = points.empty
    yield Figure(
        f"closed-form-{stem}" if alone else f"dem-{stem}",
        f"One grain on a {bed}: closed form" + ("" if alone else " and DEM"),
        captions.closed_form(scenes, by, number)
        + ("" if alone else f" {captions.grain_dem(points, number + 1)}"),
        () if alone else tuple(sorted(set(points["case"].dropna()))),
        _diagram(results, scenes, points, by),
        fold=by == "alpha_deg",
    )


def _diagram(results: Results, scenes: pd.DataFrame, points: pd.DataFrame, by: str) -> Canvas:
    """A panel for each z0/d; lines and points coloured by entrainment angle or slope."""
    choices, scenes, variants = parted(scenes, *SHOWN, "z0_over_d")
    if len(points):
        points = points.merge(scenes[["scene_id", SHAPE]], on="scene_id", validate="one_to_one")
    else:  # the closed form depends on nothing that is about its answer
        choices = [one for one in choices if fields.COLUMNS[one].info.about == "question"]
    keys = ["z0_over_d", *choices]
    panels = [part for _, part in split(scenes, *keys)][::-1]
    figure, axes = style.grid(len(panels), 2.4)
    colours, dashes = style.palette(by, results.values(by)), laws.dashes(scenes["force_law"])
    for ax, part in zip(axes, panels, strict=True):
        references = _panel(ax, part, points, by, colours, dashes)
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    low, high = theory.span(scenes)
    shields.prepare(axes, panels, (low / 2, high * 2))
    shields.mark_drag_law(axes, panels)
    looks: list[style.Sample] = [
        *shields.within(axes, references),
        *shields.line_entries(scenes, dashes),
    ]
    if len(points):
        looks += [*_point_entries(points, variants), *variants]
    style.legends(figure, _colour_entries(scenes, by, colours), looks)
    return figure


def _beyond(points: pd.DataFrame) -> "pd.Series[bool]":
    """Which points are of diameters that the paper does not have."""
    low, high = theory.SWEEP_M
    return ~points["d_m"].between(low, high)


def _cross(ax: Axes, points: pd.DataFrame) -> None:
    """Cross out the markers of some points: white on a full marker, grey in a hollow one."""
    for filled, colour in ((True, "white"), (False, "0.4")):
        own = points[valid(points) == filled]
        ax.plot(own[DEM[0]], own[DEM[1]], "x", color=colour, ms=2.6, mew=0.8, zorder=4, gid=CROSS)


def _point_entries(points: pd.DataFrame, variants: list[style.Sample]) -> list[style.Sample]:
    entries = shields.point_entries(points, variants)
    if _beyond(points).any():
        label = "crossed: diameter beyond the paper’s"
        entries.append(Line2D([], [], ls="", marker="x", color="0.2", ms=4, label=label))
    return entries


def _colour_entries(scenes: pd.DataFrame, by: str, colours: dict[float, str]) -> list[Artist]:
    used = set(scenes[by])
    return [style.entry(labels.written(by, v), c) for v, c in colours.items() if v in used]


def _panel(
    ax: Axes,
    scenes: pd.DataFrame,
    points: pd.DataFrame,
    by: str,
    colours: dict[float, str],
    dashes: Mapping[str, laws.Dash],
) -> list[Artist]:
    """One z0/d; returns the legend's entries of the references."""
    references: list[Artist] = []
    for (value,), series in split(scenes, by):
        colour = colours[float(str(value))]
        shields.draw_branches(ax, theory.branches(series), colour, dashes)
        if len(points):
            own = points[points["scene_id"].isin(series["scene_id"])]
            shields.draw_points(ax, own, colour, DEM)
            _cross(ax, own[_beyond(own)])
        if by == "alpha_deg":
            references = shields.draw_sloped_air(ax, series, colour)
    if by == "beta_deg":
        water = shields.draw_water(ax) + shields.draw_measured(ax)
        references = water + shields.draw_air(ax, scenes)
    return references


def accuracy(results: Results) -> Iterator[Figure]:
    """u* of DEM over that of the closed form, a panel for each increment of the load steps."""
    dem = _dem(results)
    if dem.empty or not dem["ustar_m_s"].notna().any():
        return
    ratio = dem["ustar_closed_form_m_s"]
    rows = dem.assign(
        value=dem["ustar_m_s"] / ratio,
        low=dem["ustar_low_m_s"] / ratio,
        high=dem["ustar_high_m_s"] / ratio,
    )
    choices, rows, variants = parted(rows, *SHOWN, "z0_over_d", "load_increment")
    keys = ["load_increment", *choices]
    panels = [part for _, part in split(rows, *keys)]
    figure = style.canvas(2.1 * len(panels) + 1.0)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    colours = style.palette("alpha_deg", results.values("alpha_deg"))
    axes[0].set_xscale("log")
    for ax, part in zip(axes, panels, strict=True):
        _ratios(ax, part, colours)
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    for ax in axes:
        style.plain_ticks(ax.xaxis)
        shields.shade_transition(ax, rows)
    axes[-1].set_xlabel(labels.RE_AXIS)
    entries = _colour_entries(rows, "alpha_deg", colours)
    style.legends(figure, entries, [*shields.point_entries(rows, variants), *variants])
    cases = tuple(sorted(set(dem["case"])))
    yield Figure(
        "accuracy", "DEM over closed form", captions.accuracy(dem), cases, figure, fold=True
    )


def _ratios(ax: Axes, rows: pd.DataFrame, colours: dict[float, str]) -> None:
    ax.axhline(1, color="0.3", lw=0.8, zorder=1)
    for alpha, colour in colours.items():
        own = rows[rows["alpha_deg"] == alpha]
        shields.draw_points(ax, own, colour, ("reynolds", "value", "low", "high"))
    for bars in (line for line in ax.lines if line.get_gid() == "intervals"):
        bars.set_alpha(0.3)  # there are hundreds: the points are to be seen
    reach = 1.6 * float(np.nanmax(np.abs(rows[["value", "low", "high"]] - 1)))
    ax.set(ylim=(1 - reach, 1 + reach), ylabel=r"$u^\star_{DEM}/u^\star_{closed\;form}$")
