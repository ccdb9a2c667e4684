"""The page's section on force laws against measured thresholds."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pandas as pd

from orchestrator.report import labels, reference
from orchestrator.report.facts import Sheet
from orchestrator.report.fits import (
    BINS,
    DECADES,
    FACTORS_FROM,
    MEDIANS,
    MIDDLES,
    Fit,
    FloatArray,
    Range,
    runs,
)

HEAD = (
    "force law",
    "β",
    "z₀",
    "Re* where it is within the measured 10 to 90 %",
    f"decades, of {DECADES:.1f}",
    "factor from the medians: median",
    "worst",
)


def sheet(found: Iterable[Fit]) -> Sheet:
    """A row for each combination of law, entrainment angle and z0/d."""
    return Sheet(HEAD, tuple(map(_row, found)))


def _row(fit: Fit) -> tuple[str, ...]:
    worst, at = fit.worst
    return (
        labels.value("force_law", fit.law),
        f"{fit.bed.entrainment_angle_deg:g}°",
        labels.ratio_of(fit.bed.roughness_ratio, "d"),
        written(runs(fit.met)) or "nowhere",
        f"{fit.decades:.1f}",
        f"{fit.median_factor:.2f}" if np.isfinite(worst) else "—",
        f"{worst:.2f} at Re* = {number(at)}" if np.isfinite(worst) else "—",
    )


def number(reynolds: float) -> str:
    """Re* for a reader."""
    return f"{reynolds:.0f}" if reynolds >= 9.95 else f"{reynolds:.2g}"


def written(ranges: Iterable[Range]) -> str:
    """Ranges of Re* for a reader."""
    return ", ".join(f"{number(low)} … {number(high)}" for low, high in ranges)


def sentences(grains: pd.DataFrame, found: Sequence[Fit]) -> list[str]:
    """Conclusions from the numbers: the best law, ranges that none meets, small Re*, air."""
    return [*_best(found), *_unmet(found), *_small(found), *_air(grains, found)]


def _best(found: Sequence[Fit]) -> Iterator[str]:
    widest = found[0]
    worst, at = widest.worst
    if np.isfinite(worst) and widest.decades:
        yield (
            f"Of {len(found)} combinations of force law, β and z₀ the one within the measured 10 "
            f"to 90 % over the widest range of Re* is {widest.name}: over {widest.decades:.1f} of "
            f"{DECADES:.1f} decades. From Re* = {FACTORS_FROM:g} on it is off the medians by a "
            f"factor of {widest.median_factor:.2f} in the median and of {worst:.2f} at worst, at "
            f"Re* = {number(at)}."
        )


def _unmet(found: Sequence[Fit]) -> Iterator[str]:
    """Where there are measurements that no combination meets."""
    asked = np.any([fit.asked for fit in found], axis=0)
    met = np.any([fit.met for fit in found], axis=0)
    if (asked & ~met).any():
        yield (
            "Where this study has answers, none is within the measured 10 to 90 % at Re* = "
            f"{written(runs(asked & ~met))}."
        )


def _small(found: Sequence[Fit]) -> Iterator[str]:
    """Up to which Re* the published curves for water lie above every law."""
    grid = np.geomspace(min(fit.first for fit in found), BINS[-1].high, 1000)
    band, lines = reference.water_band(grid), np.array([fit.law_line(grid) for fit in found])
    highest = np.where(np.isfinite(lines), lines, -np.inf).max(axis=0)
    above = np.isfinite(highest) & (band.low > highest)
    if above[grid < 1].any():
        first = int(above.argmax())
        last = first + int((~np.append(above[first:], False)).argmax()) - 1
        yield (
            f"Up to Re* = {number(grid[last])} no law gives as much as the published curves for "
            f"water: at Re* = {number(grid[first])} the lowest curve is "
            f"{band.low[first] / highest[first]:.1f} times the highest law; from there on it falls "
            f"by {1 - band.low[last] / band.low[first]:.0%}, the highest law by "
            f"{1 - highest[last] / highest[first]:.0%}. The measurements begin at Re* = "
            f"{BINS[0].low:g}."
        )


def _air(grains: pd.DataFrame, found: Sequence[Fit]) -> Iterator[str]:
    """Published curves for air against the medians for water at the same Re*."""
    curves = [_read(*line) for line in reference.air_lines(grains).values()]
    known = np.isfinite(curves).any(axis=0) if curves else np.array([False])
    if not known.any():
        return
    at, water = MIDDLES[known], MEDIANS[known]
    air = np.exp(np.nanmean(np.log(np.array(curves)[:, known]), axis=0))
    said = "; ".join(_from_air(found, at, air, water))
    yield (
        f"At the same Re* the published curves for air lie at {np.median(air / water):.2f} of the "
        f"medians for water ({(air / water).min():.2f} … {(air / water).max():.2f}, Re* = "
        f"{number(at[0])} … {number(at[-1])}; mean of their logarithms). The fluid enters every "
        f"law here by Re* alone, so one line has to serve both{f': {said}' if said else ''}."
    )


def _from_air(
    found: Sequence[Fit], at: FloatArray, air: FloatArray, water: FloatArray
) -> Iterator[str]:
    """How far the best line for water and the best for air are from the curves for air."""
    off = [_off(fit.line(at), air) for fit in found]
    if np.isfinite(off[0]):
        yield f"the one widest in water is off the curves for air by a factor of {off[0]:.2f}"
    nearest = int(np.argmin(off))
    if np.isfinite(off[nearest]):
        fit = found[nearest]
        yield (
            f"nearest to them is {fit.name}, off by {off[nearest]:.2f}, and off the medians for "
            f"water by {_off(fit.line(at), water):.2f} (medians of these factors)"
        )


def _off(tau: FloatArray, other: FloatArray) -> float:
    """Median factor between two lines, above or below; infinite if the first has less than half."""
    ratio = (tau / other)[np.isfinite(tau)]
    if 2 * len(ratio) < len(tau):
        return np.inf
    return float(np.median(np.maximum(ratio, 1 / ratio)))


def _read(reynolds: FloatArray, shields: FloatArray) -> FloatArray:
    """A published line at the middles of the measured ranges; NaN beyond its ends."""
    order = np.argsort(reynolds, kind="stable")
    x, y = np.log(reynolds[order]), np.log(shields[order])
    return np.asarray(np.exp(np.interp(np.log(MIDDLES), x, y, left=np.nan, right=np.nan)))
