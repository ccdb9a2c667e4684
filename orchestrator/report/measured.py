"""Force laws against measured thresholds of single grains on a flat bed.

A law's threshold depends on Re*, beta and z0/d alone, so each combination of them is judged on its
own line, over the Re* that a study has grains of.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import BUFFINGTON_MONTGOMERY, MEASURED_SOURCE
from orchestrator.report import labels, theory
from orchestrator.report.page import caption
from orchestrator.report.results import Results, split
from orchestrator.report.theory import Bed
from orchestrator.types import BoolArray, FloatArray

BINS = BUFFINGTON_MONTGOMERY
MIDDLES = np.array([item.middle for item in BINS])
MEDIANS = np.array([item.median for item in BINS])
FACTORS_FROM = 0.3
"""Re* from which factors are taken: below it are a dozen measurements."""
EDGES = np.geomspace(BINS[0].low, BINS[-1].high, 2001)
GRID = np.sqrt(EDGES[1:] * EDGES[:-1])
"""Re* at which lines are compared with the measured ranges."""
_AT = np.searchsorted([item.high for item in BINS], GRID, side="right")
TENTHS = np.array([item.tenth for item in BINS])[_AT]
NINETIETHS = np.array([item.ninetieth for item in BINS])[_AT]
DECADES = float(np.log10(BINS[-1].high / BINS[0].low))
"""Decades of Re* in which there are measurements."""
HEAD = (
    *(
        "force law",
        "entrainment angle",
        "roughness",
        "Re* where it is within the measured 10 to 90 %",
    ),
    *(f"decades, of {DECADES:.1f}", "factor from the medians: median", "worst"),
)


@dataclass(frozen=True, eq=False)
class Fit:
    """A force law on a bed, and how it compares with the measurements.

    `first` and `last` are the Re* between which the study has grains.
    """

    law: str
    bed: Bed
    first: float
    last: float

    @property
    def name(self) -> str:
        """The combination in words."""
        return ", ".join((labels.value("force_law", self.law), *self.bed_words))

    @property
    def bed_words(self) -> tuple[str, str]:
        """The bed in words."""
        ratio = labels.ratio_of(self.bed.roughness_ratio, "d")
        return f"β = {self.bed.entrainment_angle_deg:g}°", f"z₀ = {ratio}"

    def line(self, reynolds: FloatArray, *, beyond: bool = False) -> FloatArray:
        """Tau at some Re*; NaN where the law does not hold and, but for `beyond`, no grains are."""
        answers = theory.law_holds(self.law, reynolds, self.bed)
        answers &= beyond | ((reynolds >= self.first) & (reynolds <= self.last))
        return np.where(answers, theory.shields(self.law, reynolds, self.bed), np.nan)

    @cached_property
    def met(self) -> BoolArray:
        """Where on the grid it is from the tenth to the ninetieth percentile."""
        tau = self.line(GRID)
        return (tau >= TENTHS) & (tau <= NINETIETHS)

    @property
    def decades(self) -> float:
        """Decades of Re* over which it is within the measured range."""
        return DECADES * float(self.met.mean())

    @cached_property
    def factors(self) -> FloatArray:
        """Factor from the median of each range of Re*, above or below; NaN without an answer."""
        ratio = self.line(MIDDLES) / MEDIANS
        return np.where(MIDDLES >= FACTORS_FROM, np.maximum(ratio, 1 / ratio), np.nan)

    @property
    def median_factor(self) -> float:
        """Median of the factors; infinite if there are none."""
        finite = self.factors[np.isfinite(self.factors)]
        return float(np.median(finite)) if len(finite) else np.inf

    @property
    def worst(self) -> tuple[float, float]:
        """The largest factor and its Re*; infinite if there are none."""
        at = int(np.argmax(np.nan_to_num(self.factors)))
        factor = float(self.factors[at])
        return (factor, float(MIDDLES[at])) if np.isfinite(factor) else (np.inf, np.nan)


def fits(results: Results) -> list[Fit]:
    """The combinations of a study's single grains on a flat bed: the widest first, then nearest.

    Unverified force laws take no part.
    """
    grains = results.beds("grain")
    verified = grains["force_law"].map({name: not law.unverified for name, law in LAWS.items()})
    flat = grains[(grains["alpha_deg"] == 0) & verified.astype(bool)]
    combinations = [
        Fit(str(law), theory.bed_of(group), *theory.span(group))
        for (law, *_), group in split(flat, "force_law", "beta_deg", "z0_over_d", "alpha_s")
    ]
    return sorted(combinations, key=lambda fit: (-round(fit.decades, 2), fit.median_factor))


def best(ranked: Sequence[Fit]) -> list[Fit]:
    """The first of each law."""
    return [fit for at, fit in enumerate(ranked) if fit.law not in {f.law for f in ranked[:at]}]


def ranges(chosen: BoolArray) -> list[tuple[float, float]]:
    """The ranges of Re* of the chosen points of the grid."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    return [(float(EDGES[a]), float(EDGES[b])) for a, b in edges.reshape(-1, 2)]


def number(reynolds: float) -> str:
    """Re* for a reader."""
    return f"{reynolds:.0f}" if reynolds >= 9.95 else f"{reynolds:.2g}"


def _ranges(chosen: BoolArray) -> str:
    return ", ".join(f"{number(low)} … {number(high)}" for low, high in ranges(chosen))


def section(results: Results) -> dict[str, Any] | None:
    """The words of the page's section on measurements; None without single grains on a flat bed."""
    ranked = fits(results)
    if not ranked:
        return None
    return {
        "source": MEASURED_SOURCE,
        "start": FACTORS_FROM,
        "sentences": list(sentences(results.beds("grain"), ranked)),
        "best": sheet(best(ranked)),
        "every": sheet(ranked),
    }


def sheet(listed: Iterable[Fit]) -> pd.DataFrame:
    """A row for each combination of law, entrainment angle and z0/d."""
    rows = []
    for fit in listed:
        law, (worst, at) = labels.value("force_law", fit.law), fit.worst
        factors = (f"{fit.median_factor:.2f}", f"{worst:.2f} at Re* = {number(at)}")
        factors = factors if worst < np.inf else ("—", "—")
        rows.append(
            (law, *fit.bed_words, _ranges(fit.met) or "nowhere", f"{fit.decades:.1f}", *factors)
        )
    return pd.DataFrame(rows, columns=list(HEAD))


def sentences(grains: pd.DataFrame, ranked: Sequence[Fit]) -> Iterator[str]:
    """Conclusions from the numbers: the best law, ranges that none meets, small Re*, air."""
    first, (worst, at) = ranked[0], ranked[0].worst
    if np.isfinite(worst) and first.decades:
        facts = {"count": len(ranked), "decades": DECADES, "start": FACTORS_FROM}
        yield caption("best_law", fit=first, at=number(at), **facts)
    unmet = np.any([np.isfinite(fit.line(GRID)) for fit in ranked], axis=0)
    unmet &= ~np.any([fit.met for fit in ranked], axis=0)
    if unmet.any():
        yield caption("unmet", ranges=_ranges(unmet))
    # up to which Re* the published curves for water lie above every law
    grid = np.geomspace(min(fit.first for fit in ranked), BINS[-1].high, 1000)
    low, _ = theory.water_band(grid)
    lines = np.array([fit.line(grid, beyond=True) for fit in ranked])
    highest = np.where(np.isfinite(lines), lines, -np.inf).max(axis=0)
    above = np.isfinite(highest) & (low > highest)
    if above[grid < 1].any():
        start = int(above.argmax())
        ends = [start, start + int((~np.append(above[start:], False)).argmax()) - 1]
        curve, law, numbers = low[ends], highest[ends], [number(at) for at in grid[ends]]
        yield caption("small_reynolds", ends=numbers, curve=curve, law=law, begin=BINS[0].low)
    # published curves for air against the medians for water at the same Re*
    read = []
    for x, y in theory.air_lines(grains).values():
        at_x, log_x, log_y = np.argsort(x, kind="stable"), np.log(x), np.log(y)
        values = np.interp(np.log(MIDDLES), log_x[at_x], log_y[at_x], left=np.nan, right=np.nan)
        read.append(values)
    covered = np.isfinite(read).any(axis=0) if read else np.array([False])
    if covered.any():
        reynolds = MIDDLES[covered]
        ratio = np.exp(np.nanmean(np.array(read)[:, covered], axis=0)) / MEDIANS[covered]
        span = f"{number(reynolds[0])} … {number(reynolds[-1])}"
        yield caption("air", ratio=(ratio.min(), np.median(ratio), ratio.max()), span=span)
