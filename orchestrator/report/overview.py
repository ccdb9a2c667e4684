"""The extended Shields diagram: piles, single grains, force laws and measurements in one frame."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from orchestrator.report import captions, fits, labels, laws, shields, style, theory
from orchestrator.report.apart import SHAPES, varying
from orchestrator.report.figure import Figure
from orchestrator.report.fits import Fit
from orchestrator.report.results import Results, by_dem, held, split, valid

NAME = "shields"
FRACTION = 0.3
"""n/N of the piles where there are many."""
SAID = ("alpha_deg", "d_m", "z0_over_d", "force_law", "fraction")
"""Columns that a point tells of its scene."""
FEW = 8
"""Piles of which every fraction is drawn."""
LAWS = 3
"""Laws beyond which only the nearest to the measurements are drawn."""
GRAIN = ("shields_dem", "shields_dem_low", "shields_dem_high")
PILE = ("shields", "shields_low", "shields_high")


def draw(results: Results) -> Iterator[Figure]:
    """The one diagram of a study; none of one without thresholds and without lines."""
    piles, grains = shown_piles(results), _grains(results)
    scenes = results.scenes
    if len(fits_ := _lines(results)) == 0 and piles.empty and grains.empty:
        return
    figure = style.canvas(4.4)
    ax = figure.subplots()
    references = [
        *shields.draw_water(ax),
        *shields.draw_measured(ax),
        *shields.draw_air(ax, scenes),
    ]
    told = Told(ax)
    shades = style.palette("alpha_deg", results.values("alpha_deg"))
    entries = [
        *_points(told, grains, "grain", GRAIN, shades),
        *_points(told, piles, "pile", PILE, shades),
    ]
    reach = [*theory.span(scenes), *_known(piles, "reynolds"), *_known(grains, "reynolds")]
    low, high = min(reach) / 1.6, max(reach) * 1.6
    reynolds = np.geomspace(low / 2, high * 2, theory.POINTS)
    lines = [_law(ax, fit, reynolds) for fit in fits_]
    shields.prepare([ax], [scenes], (low, high))
    tau = [*_known(piles, "shields"), *_known(grains, "shields_dem")]
    bottom, top = ax.get_ylim()
    ax.set_ylim(min([bottom, *(t / 1.4 for t in tau)]), max([top, *(1.4 * t for t in tau)]))
    style.plain_ticks(ax.yaxis)
    style.legends(figure, [], [*entries, *lines, *shields.within([ax], references)])
    cases = tuple(sorted(set(_known(piles, "case")) | set(_known(grains, "case"))))
    caption = captions.overview(results, fits_, piles, grains)
    yield Figure(NAME, "Extended Shields diagram", caption, cases, figure, data=told.groups)


def shown_piles(results: Results) -> pd.DataFrame:
    """The thresholds of piles that are drawn: of many piles at one fraction."""
    found = results.joined("pile_threshold")
    if found.empty:
        return found
    if found["scene_id"].nunique() > FEW:
        found = found[found["fraction"] == nearest_fraction(found)]
    return found[found["shields"].notna()]


def nearest_fraction(thresholds: pd.DataFrame) -> float:
    """The fraction nearest to 30 %."""
    fractions = thresholds["fraction"].unique().tolist()
    return float(min(fractions, key=lambda one: abs(one - FRACTION)))


def _grains(results: Results) -> pd.DataFrame:
    """Single grains that moved in DEM under a held flow, on the study's least slope."""
    grains = by_dem(results.joined("single_grain"))
    if grains.empty:
        return grains
    here = held(grains) & (grains["alpha_deg"] == grains["alpha_deg"].min())
    chosen: pd.DataFrame = grains[here & grains["shields_dem"].notna()]
    return chosen


def _lines(results: Results) -> list[Fit]:
    """A line for each law: where a study has a flat bed, on the bed that fits best."""
    flat = fits.best(fits.fits(results))
    used = set(results.scenes["force_law"])
    if flat:
        return flat if len(flat) <= LAWS else [one for one in flat if one.decades > 0] or flat
    scenes = results.scenes.assign(alpha_deg=0.0)
    groups = ((name, scenes[scenes["force_law"] == name]) for name in laws.drawn(used))
    return [Fit(name, theory.bed_of(own), *theory.span(own)) for name, own in groups if len(own)]


def _known(table: pd.DataFrame, column: str) -> list[Any]:
    return table[column].dropna().tolist() if len(table) else []


class Told:
    """Points that answer a pointer: what is said of each, by the group that the drawing has."""

    def __init__(self, ax: Axes) -> None:
        self.ax = ax
        self.groups: dict[str, list[list[str]]] = {}

    def plot(
        self, rows: pd.DataFrame, columns: Sequence[str], said: list[list[str]], **look: Any
    ) -> None:
        """Draw the points of some rows, their intervals, and remember what is said of them."""
        gid = f"{NAME}-{len(self.groups)}"
        x = rows["reynolds"].to_numpy(float)
        y, low, high = (rows[column].to_numpy(float) for column in columns)
        self.ax.vlines(x, low, high, color=look["mec"], lw=0.6, zorder=2.5)
        self.ax.plot(x, y, ls="", zorder=3, gid=gid, **look)
        self.groups[gid] = said


def _points(
    told: Told,
    rows: pd.DataFrame,
    bed: str,
    columns: Sequence[str],
    shades: Mapping[float, str],
) -> list[Artist]:
    """Colours are slopes, shapes kinds of bed, hollow is not usable; entries for a legend."""
    if rows.empty:
        return []
    shape, size = ("o", 2.4) if bed == "grain" else (SHAPES[1], 3.6)
    shown = [column for column in SAID if column in rows]
    extra = varying(rows, *shown)
    for (alpha, usable), own in split(rows.assign(valid=valid(rows)), "alpha_deg", "valid"):
        colour = shades[float(str(alpha))]
        said = [_said(row, columns, extra) for _, row in own.iterrows()]
        face = colour if usable else "white"
        told.plot(own, columns, said, marker=shape, ms=size, mec=colour, mew=0.6, mfc=face)
    name = "single grain" if bed == "grain" else "pile"
    if bed == "pile" and rows["fraction"].nunique() == 1:
        name += f" at n/N = {rows['fraction'].iloc[0]:.0%}"
    entries: list[Artist] = [
        Line2D([], [], ls="", marker=shape, color=colour, ms=4, label=f"{name}, {_slope(alpha)}")
        for alpha, colour in shades.items()
        if (rows["alpha_deg"] == alpha).any()
    ]
    if not valid(rows).all():
        look: style.Look = {"ls": "", "marker": shape, "ms": 4, "mfc": "white", "mec": "0.2"}
        entries.append(Line2D([], [], label="hollow: not usable", **look))
    return entries


def _slope(alpha: float) -> str:
    return labels.written("alpha_deg", alpha)


def _said(row: pd.Series, columns: Sequence[str], extra: Sequence[str]) -> list[str]:
    """Scene, threshold with its interval, what speaks against it, case."""
    told = (*SAID[:-1], *extra)
    scene = ", ".join(labels.told(row, told))
    value, low, high = (row[column] for column in columns)
    ustar = row["ustar0_m_s"] if "ustar0_m_s" in row else row["ustar_m_s"]
    where = f" at n/N = {row['fraction']:.0%}" if "fraction" in row else ""
    threshold = f"τ_c = {value:.4g} ({low:.4g} … {high:.4g}){where}, u*₀ = {ustar:.3g} m/s"
    case = row["case"] if isinstance(row["case"], str) else ""
    return [scene, threshold, str(row["why_not"]), case]


def _law(ax: Axes, fit: Fit, reynolds: theory.FloatArray) -> Line2D:
    """The line of a law on one bed; returns its entry for a legend."""
    colour, dash = laws.look(fit.law)
    tau, holds = (
        theory.shields(fit.law, reynolds, fit.bed),
        theory.load_steps(fit.law, reynolds, fit.bed),
    )
    own: style.Look = {"color": colour, "gid": shields.RESULT[0]}
    ax.plot(reynolds, np.where(holds, tau, np.nan), ls=dash, lw=1.4, **own)
    if fit.law not in laws.PAIR:
        ax.plot(reynolds, np.where(holds, np.nan, tau), ls=":", lw=0.9, **own)
    return Line2D([], [], color=colour, ls=dash, lw=1.4, label=fit.name)
