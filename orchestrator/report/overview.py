"""The extended Shields diagram: piles, single grains, force laws and measurements in one frame."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
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
from orchestrator.report.results import (
    Results,
    by_dem,
    drawable,
    held,
    nearest_fraction,
    split,
    valid,
)

NAME = "shields"
SAID = ("alpha_deg", "d_m", "z0_over_d", "force_law", "fraction")
"""Columns that a point tells of its scene."""
FEW = 8
"""Piles of which every fraction is drawn."""
BED = ("beta_deg", "z0_over_d", "alpha_s")
"""Columns of all that a line depends on beside its law, on a flat bed."""
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
    thin = [[one.law for one in fits_[:at]].count(fit.law) for at, fit in enumerate(fits_)]
    lines = [_law(ax, fit, reynolds, 1.4 / (1 + n)) for fit, n in zip(fits_, thin, strict=True)]
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
    return found[drawable(found, "reynolds", "shields")]


def _grains(results: Results) -> pd.DataFrame:
    """Single grains that moved in DEM under a held flow, on the study's least slope."""
    grains = by_dem(results.joined("single_grain"))
    if grains.empty:
        return grains
    here = held(grains) & (grains["alpha_deg"] == grains["alpha_deg"].min())
    chosen: pd.DataFrame = grains[here & drawable(grains, "reynolds", "shields_dem")]
    return chosen


def _lines(results: Results) -> list[Fit]:
    """The closed form of a flat bed as lines, of no other roughness than the points beside them.

    The laws of piles have lines for the entrainment angle and the z0/d of the piles, of many z0/d
    for the least and the largest. Other laws have one line, on the bed that fits the measurements
    best. The two laws of the paper are one model: both have the same bed.
    """
    beds = [own for _, own in split(results.beds("pile").assign(alpha_deg=0.0), *BED)]
    beds = beds if len(beds) <= 2 else [beds[0], beds[-1]]
    of_piles = [
        Fit(name, theory.bed_of(own), *theory.span(own))
        for own in beds
        for name in laws.drawn(own["force_law"])
    ]
    ranked = fits.fits(results)
    best = fits.best(ranked)
    best = best if len(best) <= LAWS else [fit for fit in best if fit.decades > 0] or best
    shared = next((fit.bed for fit in best if fit.law in laws.PAIR), None)
    drawn = {fit.law for fit in of_piles}
    others = [
        replace(fit, bed=shared) if shared and fit.law in laws.PAIR else fit
        for fit in best
        if fit.law not in drawn
    ]
    return [*of_piles, *others]


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


def _law(ax: Axes, fit: Fit, reynolds: theory.FloatArray, width: float) -> Line2D:
    """The line of a law on one bed; returns its entry for a legend."""
    colour, dash = laws.look(fit.law)
    tau, holds = (
        theory.shields(fit.law, reynolds, fit.bed),
        theory.law_holds(fit.law, reynolds, fit.bed),
    )
    own: style.Look = {"color": colour, "gid": shields.RESULT[0]}
    ax.plot(reynolds, np.where(holds, tau, np.nan), ls=dash, lw=width, **own)
    if fit.law not in laws.PAIR:
        ax.plot(reynolds, np.where(holds, np.nan, tau), ls=":", lw=0.9, **own)
    return Line2D([], [], color=colour, ls=dash, lw=width, label=fit.name)
