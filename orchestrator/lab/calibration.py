"""From the errors of single scenes to half widths: what a rung is known to be within.

The half width of a rung, on a class of scenes and at a fraction, is a conformal
quantile of the sizes of its errors: of n scenes the one of rank (n + 1) times the
confidence. A further scene of the same kind is within it with that probability,
whatever the distribution.

Classes of one family are pooled where they do not differ: where the half width of the
others holds as many of the scenes of each as chance allows. The coverage is that of
scenes of which no scene of the same geometry was used.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
from scipy import stats

from orchestrator.fidelity.classes import GRAINS, LIMITING, SMALL
from orchestrator.types import FloatArray, Row

USUAL, FEW = 0.95, 0.9
"""Share of the scenes that a half width is to hold; the second one if there are few."""
LEAST_USUAL = 19
"""Scenes from which on a share of 95 % is found."""
CHANCE = 0.05
"""Classes differ if chance alone leaves out so many scenes less often."""
FAMILIES = {
    "rows and slight gaps": ("aligned", "disordered up to 0.02 d"),
}
"""Classes of grains, without the ends of their names, that may be pooled."""
PLACE = ["part", "rung", "fraction"]
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
    return USUAL if scenes >= LEAST_USUAL else FEW


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
    rank = math.ceil((count + 1) * share - 1e-9)
    return float(np.sort(sizes)[min(rank, count) - 1])


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

    Parameters
    ----------
    sizes
        Sizes of the errors of single scenes, by their class.

    Returns
    -------
    list of tuple of str
        The pools. A class whose scenes the half width of the others does not hold, as
        often as chance allows, has none with them.
    """
    left = dict(sizes)
    apart = {}
    while len(left) > 1:
        odds = {name: _odds(name, left) for name in left}
        least = min(odds, key=lambda name: odds[name])
        if odds[least] >= CHANCE:
            break
        apart[least] = left.pop(least)
    found = [tuple(sorted(left))]
    if apart:
        found += pools(apart)
    return found


def _odds(name: str, sizes: dict[str, FloatArray]) -> float:
    """How often chance leaves out so many scenes of a class, or more."""
    others = np.concatenate([sizes[other] for other in sizes if other != name])
    share = confidence(len(others))
    within = int((sizes[name] <= half_width(others, share)).sum())
    return float(stats.binom.cdf(within, len(sizes[name]), share))


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


def table(measured: pd.DataFrame, again: dict[str, str]) -> pd.DataFrame:
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
                    "cost_core_s": by_class[name]["cost_core_s"].mean(),
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
