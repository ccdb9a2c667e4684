"""From the errors of single scenes to half widths: what a rung is known to be within.

The half width of a rung, on a class of scenes and at a fraction, is a conformal
quantile of the sizes of its errors: of n scenes the one of rank (n + 1) times the
confidence. A further scene of the same kind is within it with that probability,
whatever the distribution.

Classes of one family are pooled where they do not differ: where the half width of the
narrower ones leaves out no more of the scenes of the next one than chance does. The
coverage is that of scenes of which no scene of the same geometry was used.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
from scipy import stats

from orchestrator.fidelity.classes import GRAINS, LIMITING, SMALL
from orchestrator.types import FloatArray, Row

USUAL, FEW = 0.95, 0.9
"""Share of the scenes that a half width is to hold; the second one if there are few:
the largest error of n scenes holds n in n + 1, which of fewer than 9 is less."""
LEAST_USUAL = 19
"""Scenes from which on a share of 95 % is found."""
CHANCE = 0.05
"""Classes differ if chance alone leaves out so many scenes more seldom."""
FAMILIES = {
    "rows and slight gaps": ("aligned", "disordered up to 0.02 d"),
}
"""Classes of grains, without the ends of their names, that may be pooled."""
COLUMNS = [
    "part",
    "rung",
    "scene_class",
    "fraction",
    "error",
    "confidence",
    "coverage",
    "scenes",
    "pool",
    "uncertainty",
    "uncertainty_scenes",
    "cost_core_s",
]
"""Columns of the table, which `orchestrator.fidelity.measured` reads."""


def confidence(scenes: int) -> float:
    """Find the share of scenes that a half width of so many can hold.

    Parameters
    ----------
    scenes
        Number of measured scenes.

    Returns
    -------
    float
        The share.
    """
    if scenes >= LEAST_USUAL:
        return USUAL
    return min(FEW, scenes / (scenes + 1))


def rank(scenes: int, share: float) -> int:
    """Find the rank of the error that holds a share of further scenes.

    Parameters
    ----------
    scenes
        Number of measured scenes.
    share
        The share.

    Returns
    -------
    int
        The rank, from 1; the last one where too few scenes were measured.
    """
    return min(math.ceil((scenes + 1) * share - 1e-9), scenes)


def half_width(sizes: FloatArray, share: float) -> float:
    """Find the conformal quantile of the sizes of errors.

    Parameters
    ----------
    sizes
        Sizes of the errors of single scenes.
    share
        The share of further scenes that it is to hold.

    Returns
    -------
    float
        The half width; the largest size where too few scenes were measured, NaN
        without any.
    """
    count = len(sizes)
    if not count:
        return math.nan
    return float(np.sort(sizes)[rank(count, share) - 1])


def coverage(sizes: FloatArray, geometries: FloatArray) -> float:
    """Find the share of scenes within the half width of all other geometries.

    Parameters
    ----------
    sizes
        Sizes of the errors of single scenes.
    geometries
        A name or number of the geometry of each.

    Returns
    -------
    float
        The share; NaN where all scenes have one geometry.
    """
    share = confidence(len(sizes))
    within = 0
    for one in np.unique(geometries):
        left_out = geometries == one
        if left_out.all():
            return math.nan
        width = half_width(sizes[~left_out], share)
        within += int((sizes[left_out] <= width).sum())
    return within / len(sizes)


def pools(sizes: dict[str, FloatArray]) -> list[tuple[str, ...]]:
    """Put classes together that do not differ.

    The class with the least errors begins a pool. Each further one, by its own half
    width, joins it unless the half width of the pool leaves out more of its scenes than
    chance does; then it begins the next pool.

    Parameters
    ----------
    sizes
        Sizes of the errors of single scenes, by their class.

    Returns
    -------
    list of tuple of str
        The pools, from those of the least errors.
    """
    widths = {name: half_width(of_class, FEW) for name, of_class in sizes.items()}
    found: list[list[str]] = []
    for name in sorted(sizes, key=lambda one: (widths[one], one)):
        if found:
            pool = np.concatenate([sizes[one] for one in found[-1]])
            if _left_out(sizes[name], pool) >= CHANCE:
                found[-1].append(name)
                continue
        found.append([name])
    return [tuple(sorted(pool)) for pool in found]


def _left_out(sizes: FloatArray, others: FloatArray) -> float:
    """How often chance leaves so many, or more, outside the half width of others.

    The share of a distribution below an order statistic of n of its values has a beta
    distribution, whatever the distribution.
    """
    count = len(others)
    found = rank(count, confidence(count))
    within = int((sizes <= half_width(others, confidence(count))).sum())
    return float(stats.betabinom.cdf(within, len(sizes), found, count + 1 - found))


def family(part: str, scene_class: str) -> str:
    """Name the family of classes with which a class may be pooled.

    Parameters
    ----------
    part
        Part of a pile.
    scene_class
        Its class.

    Returns
    -------
    str
        The family: classes that differ in the number of grains and the limiting slope
        alone, and rows with slight gaps beside those without.
    """
    name = scene_class.removesuffix(SMALL).removesuffix(LIMITING)
    if part == GRAINS:
        for several, members in FAMILIES.items():
            if name in members:
                return several
    return name


def half_widths(measured: pd.DataFrame, again: dict[str, str]) -> pd.DataFrame:
    """Make the table of half widths of single scenes.

    Parameters
    ----------
    measured
        A row for each part, rung, scene and fraction: ``scene_class``, ``scene_id``,
        ``geometry``, ``fraction``, ``error``, ``cost_core_s``. Infinite where only one
        of rung and reference reached the fraction.
    again
        By part, the rung that is as good as the reference: its half width is the
        uncertainty of the reference.

    Returns
    -------
    DataFrame
        The table, with `COLUMNS`.
    """
    rows = pd.DataFrame(_rows(measured), columns=COLUMNS[:9] + COLUMNS[-1:])
    is_again = rows["rung"] == rows["part"].map(again)
    place = ["part", "scene_class", "fraction"]
    names = {"error": "uncertainty", "scenes": "uncertainty_scenes"}
    tried = rows.loc[is_again, [*place, *names]].rename(columns=names)
    rows = rows.merge(tried, "left", place)
    counts = rows["uncertainty_scenes"].fillna(0).astype(int)
    rows = rows.assign(uncertainty_scenes=counts)[COLUMNS]
    return rows.sort_values(["part", "rung", "scene_class", "fraction"])


def _rows(measured: pd.DataFrame) -> Iterator[Row]:
    families = [
        family(part, name)
        for part, name in zip(measured["part"], measured["scene_class"], strict=True)
    ]
    sized = measured.assign(size=measured["error"].abs(), family=families)
    for (part, rung, _, fraction), alike in sized.groupby(
        ["part", "rung", "family", "fraction"]
    ):
        by_class = {str(name): rows for name, rows in alike.groupby("scene_class")}
        sizes = {name: rows["size"].to_numpy(float) for name, rows in by_class.items()}
        for pool in pools(sizes):
            held = _held([by_class[name] for name in pool])
            for name in pool:
                yield {
                    "part": part,
                    "rung": rung,
                    "scene_class": name,
                    "fraction": fraction,
                    **held,
                    "pool": "; ".join(pool),
                    "cost_core_s": by_class[name]["cost_core_s"]
                    .replace(0.0, np.nan)
                    .mean(),
                }


def _held(classes: Sequence[pd.DataFrame]) -> Row:
    """The half width of the scenes of some classes, and how often it held."""
    rows = pd.concat(classes)
    sizes = rows["size"].to_numpy(float)
    share = confidence(len(sizes))
    return {
        "error": half_width(sizes, share),
        "confidence": share,
        "coverage": coverage(sizes, rows["geometry"].to_numpy()),
        "scenes": len(sizes),
    }
