"""Figures of many force laws on a flat bed: colours mean laws."""

from collections.abc import Iterator, Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.report import captions, labels, laws, shields, style, theory
from orchestrator.report.apart import SHAPE, parted
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results, by_dem, held, split
from orchestrator.report.single import DEM, SHOWN

MOST = 6
"""Panels of a figure."""


def draw(results: Results) -> Iterator[Figure]:
    """The laws by entrainment angle, a figure for each z0/d."""
    grains = results.beds("grain")
    flat = grains[held(grains) & (grains["alpha_deg"] == 0)]
    if not laws.many(flat["force_law"]):
        return
    dem = by_dem(results.joined("single_grain"))
    for (ratio,), scenes in split(flat, "z0_over_d"):
        points = dem[dem["scene_id"].isin(scenes["scene_id"])] if len(dem) else dem
        yield from _by_angle(scenes, points, labels.ratio_of(float(str(ratio)), "d"))


def _entry(law: str, label: str) -> Line2D:
    colour, dash = laws.look(law)
    return Line2D([], [], color=colour, ls=dash, lw=1.4, label=label)


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
            fold=start > 0,
        )


def _panels(
    panels: Sequence[pd.DataFrame],
    points: pd.DataFrame,
    keys: Sequence[str],
    variants: Sequence[style.Sample],
) -> Canvas:
    figure, axes = style.grid(len(panels), 2.4)
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
