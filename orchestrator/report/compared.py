"""Figures of many force laws on a flat bed: colours mean laws."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.report import captions, fits, labels, laws, reference, shields, style, theory
from orchestrator.report.apart import SHAPE, SHAPES, parted
from orchestrator.report.figure import Figure
from orchestrator.report.fits import Fit
from orchestrator.report.results import Results, by_dem, held, split, valid
from orchestrator.report.single import DEM, SHOWN

MOST = 6
"""Panels of a figure."""
LIQUID = "#08519c"
"""Of piles in a liquid; those in a gas are brown as its curves are."""
PILE = "pile"


def draw(results: Results) -> Iterator[Figure]:
    """One picture of all laws with the piles, and the laws by entrainment angle."""
    grains = results.beds("grain")
    flat = grains[held(grains) & (grains["alpha_deg"] == 0)]
    if not laws.many(flat["force_law"]):
        return
    found = fits.best(fits.fits(results))
    yield Figure(
        "shields",
        "Shields diagram of all force laws",
        captions.overview(results, found),
        (),
        _overview(results, found, flat),
    )
    dem = by_dem(results.joined("single_grain"))
    for (ratio,), scenes in split(flat, "z0_over_d"):
        points = dem[dem["scene_id"].isin(scenes["scene_id"])] if len(dem) else dem
        yield from _by_angle(scenes, points, labels.ratio_of(float(str(ratio)), "d"))


def _overview(results: Results, found: Sequence[Fit], flat: pd.DataFrame) -> Canvas:
    figure = style.canvas(6.6)
    ax = figure.subplots()
    references = [*shields.draw_water(ax), *shields.draw_measured(ax), *shields.draw_air(ax, flat)]
    piles = results.joined("pile_threshold")
    piles = piles[valid(piles) & piles["shields"].notna()] if len(piles) else piles
    marks = _piles(ax, piles) if len(piles) else []
    low, high = _reach(flat, piles)
    reynolds = np.geomspace(low / 2, high * 2, theory.POINTS)
    entries = [_law(ax, fit, reynolds) for fit in found]
    shields.prepare([ax], [flat], (low / 1.2, high * 1.2))
    air = [tau.min() / 1.3 for _, tau in reference.air_lines(flat).values()]
    ax.set_ylim(bottom=min([ax.get_ylim()[0], *air]))
    style.plain_ticks(ax.yaxis)
    style.legends(figure, [], [*entries, *references, *marks])
    return figure


def _reach(flat: pd.DataFrame, piles: pd.DataFrame) -> tuple[float, float]:
    """Least and largest Re* of some grains and piles."""
    own = [*theory.span(flat), *(piles["reynolds"] if len(piles) else ())]
    return min(own), max(own)


def _law(ax: Axes, fit: Fit, reynolds: theory.FloatArray) -> Line2D:
    """The line of a law on one bed; returns its entry for a legend."""
    colour, dash = laws.look(fit.law)
    tau = theory.shields(fit.law, reynolds, fit.bed)
    load_steps = theory.load_steps(fit.law, reynolds, fit.bed)
    own: style.Look = {"color": colour, "gid": shields.RESULT[0]}
    ax.plot(reynolds, np.where(load_steps, tau, np.nan), ls=dash, lw=1.4, **own)
    if fit.law not in laws.PAIR:
        ax.plot(reynolds, np.where(load_steps, np.nan, tau), ls=":", lw=0.9, **own)
    return _entry(fit.law, fit.name)


def _entry(law: str, label: str) -> Line2D:
    colour, dash = laws.look(law)
    return Line2D([], [], color=colour, ls=dash, lw=1.4, label=label)


def _piles(ax: Axes, rows: pd.DataFrame) -> list[Artist]:
    """The thresholds of piles, joined from the least fraction to the largest."""
    gas = rows["rho_sol_kg_m3"] >= reference.GAS_RATIO * rows["rho_f_kg_m3"]
    slopes = sorted(set(rows["alpha_deg"]))
    for (_, alpha, is_gas), own in split(rows.assign(gas=gas), "scene_id", "alpha_deg", "gas"):
        own = own.sort_values("fraction")
        ax.plot(
            own["reynolds"],
            own["shields"],
            "-",
            marker=SHAPES[slopes.index(alpha)],
            color=style.AIR if is_gas else LIQUID,
            ms=3,
            lw=0.6,
            zorder=3,
            gid=PILE,
        )
    return [*_slopes(slopes), *_fluids(gas)]


def _slopes(slopes: Sequence[float]) -> Iterator[Line2D]:
    for shape, alpha in zip(SHAPES, slopes, strict=False):
        label = f"pile, {labels.written('alpha_deg', alpha)}"
        yield Line2D([], [], ls="", marker=shape, color="0.2", ms=3.5, label=label)


def _fluids(gas: "pd.Series[bool]") -> Iterator[Line2D]:
    for colour, there, label in (
        (LIQUID, ~gas, "pile in a liquid"),
        (style.AIR, gas, "pile in a gas"),
    ):
        if there.any():
            yield Line2D([], [], color=colour, lw=2.5, label=label)


def _by_angle(scenes: pd.DataFrame, points: pd.DataFrame, ratio: str) -> Iterator[Figure]:
    """The laws at one z0/d, a panel for each entrainment angle, at most six of them in a figure."""
    choices, scenes, variants = parted(scenes, *SHOWN, "z0_over_d")
    if len(points):
        points = points.merge(scenes[["scene_id", SHAPE]], on="scene_id", validate="one_to_one")
    keys = ["beta_deg", *choices]
    panels = [part for _, part in split(scenes, *keys)]
    for start in range(0, len(panels), MOST):
        some = panels[start : start + MOST]
        own = (
            points[points["scene_id"].isin(pd.concat(some)["scene_id"])] if len(points) else points
        )
        yield Figure(
            f"shields-{ratio.replace('/', '')}" + (f"-{start // MOST + 1}" if start else ""),
            f"Force laws on a horizontal bed, z₀ = {ratio}",
            captions.by_angle(scenes, own),
            tuple(sorted(set(own["case"].dropna()))) if len(own) else (),
            _panels(some, own, keys, variants),
        )


def _panels(
    panels: Sequence[pd.DataFrame],
    points: pd.DataFrame,
    keys: Sequence[str],
    variants: Sequence[style.Sample],
) -> Canvas:
    columns = min(len(panels), 2)
    figure = style.canvas(2.4 * -(-len(panels) // columns) + 1.3)
    grid = figure.subplots(
        -(-len(panels) // columns), columns, sharex=True, sharey=True, squeeze=False
    ).ravel()
    for unused in grid[len(panels) :]:
        unused.remove()
    axes = list(grid[: len(panels)])
    for ax, part in zip(axes, panels, strict=True):
        references = [*shields.draw_water(ax), *shields.draw_measured(ax)]
        _laws(ax, part, points)
        ax.set_title(labels.panel(part.iloc[0], keys), loc="left")
    every = pd.concat(panels)
    low, high = theory.span(every)
    shields.prepare(axes, panels, (low / 1.5, high * 1.5))
    names = laws.drawn(every["force_law"])
    colours = [_entry(name, labels.value("force_law", name)) for name in names]
    looks = [*colours, *references, *(shields.point_entries(points) if len(points) else [])]
    style.legends(figure, [], [*looks, *variants])
    return figure


def _laws(ax: Axes, scenes: pd.DataFrame, points: pd.DataFrame) -> None:
    """The lines of the laws of one panel and their grains by DEM."""
    for branch in theory.branches(scenes):
        colour, _ = laws.look(branch.law)
        shields.draw_branches(ax, [branch], colour, {branch.law: laws.look(branch.law)[1]})
        if len(points):
            own = points[points["scene_id"].isin(scenes["scene_id"])]
            shields.draw_points(ax, own[own["force_law"] == branch.law], colour, DEM)
