"""Force laws against measured thresholds of single grains on a flat bed.

A law's threshold depends on Re*, beta and z0/d alone, so each combination of them is judged on its
own line, over the Re* that a study has grains of.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import BUFFINGTON_MONTGOMERY
from orchestrator.report import labels, theory
from orchestrator.report.results import Results, split
from orchestrator.report.theory import Bed

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Range = tuple[float, float]

BINS = BUFFINGTON_MONTGOMERY
MIDDLES = np.array([one.middle for one in BINS])
MEDIANS = np.array([one.median for one in BINS])
FACTORS_FROM = 0.3
"""Re* from which factors are taken: below there are a dozen measurements."""
EDGES = np.geomspace(BINS[0].low, BINS[-1].high, 2001)
GRID = np.sqrt(EDGES[1:] * EDGES[:-1])
"""Re* at which lines are held against the measured ranges."""
_AT = np.searchsorted([one.high for one in BINS], GRID, side="right")
TENTHS = np.array([one.tenth for one in BINS])[_AT]
NINETIETHS = np.array([one.ninetieth for one in BINS])[_AT]
DECADES = float(np.log10(BINS[-1].high / BINS[0].low))
"""Decades of Re* in which there are measurements."""


@dataclass(frozen=True, eq=False)
class Fit:
    """One force law, entrainment angle and z0/d, and how it compares.

    Attributes
    ----------
    law : str
        Name of the force law.
    bed : Bed
        The bed.
    first, last : float
        Re* between which the study has grains.
    """

    law: str
    bed: Bed
    first: float
    last: float

    @property
    def name(self) -> str:
        """The combination in words."""
        beta, ratio = self.bed.entrainment_angle_deg, self.bed.roughness_ratio
        law = labels.value("force_law", self.law)
        return f"{law}, β = {beta:g}°, z₀ = {labels.ratio_of(ratio, 'd')}"

    def law_line(self, reynolds: FloatArray) -> FloatArray:
        """Tau at some Re*; NaN where the law does not hold."""
        holds = theory.law_holds(self.law, reynolds, self.bed)
        return np.where(holds, theory.shields(self.law, reynolds, self.bed), np.nan)

    def line(self, reynolds: FloatArray) -> FloatArray:
        """The same, NaN also where the study has no grains."""
        answers = (reynolds >= self.first) & (reynolds <= self.last)
        return np.where(answers, self.law_line(reynolds), np.nan)

    @cached_property
    def asked(self) -> BoolArray:
        """Where on the grid it has an answer."""
        return np.isfinite(self.line(GRID))

    @cached_property
    def met(self) -> BoolArray:
        """Where on the grid it is from the tenth to the ninetieth percentile."""
        tau = self.line(GRID)
        return (tau >= TENTHS) & (tau <= NINETIETHS)

    @property
    def decades(self) -> float:
        """Over how many decades of Re* it is there."""
        return DECADES * float(self.met.mean())

    @cached_property
    def factors(self) -> FloatArray:
        """Factor from the median of each range of Re*, above or below; NaN without an answer."""
        ratio = self.line(MIDDLES) / MEDIANS
        return np.where(MIDDLES >= FACTORS_FROM, np.maximum(ratio, 1 / ratio), np.nan)

    @property
    def median_factor(self) -> float:
        """Median of the factors; infinite if there are none."""
        known = self.factors[np.isfinite(self.factors)]
        return float(np.median(known)) if len(known) else np.inf

    @property
    def worst(self) -> tuple[float, float]:
        """The largest factor and its Re*; infinite if there are none."""
        if not np.isfinite(self.factors).any():
            return np.inf, np.nan
        at = int(np.nanargmax(self.factors))
        return float(self.factors[at]), float(MIDDLES[at])


def fits(results: Results) -> list[Fit]:
    """The combinations of a study's single grains on a flat bed: the widest first, then nearest.

    Unverified force laws take no part.
    """
    grains = results.beds("grain")
    grains = grains[~grains["force_law"].isin([n for n, law in LAWS.items() if law.unverified])]
    found = [
        Fit(str(law), theory.bed_of(own), *theory.span(own))
        for (law, *_), own in split(
            grains[grains["alpha_deg"] == 0], "force_law", "beta_deg", "z0_over_d", "alpha_s"
        )
    ]
    return sorted(found, key=lambda fit: (-round(fit.decades, 2), fit.median_factor))


def best(found: Sequence[Fit]) -> list[Fit]:
    """The first of each law."""
    firsts: dict[str, Fit] = {}
    for fit in found:
        firsts.setdefault(fit.law, fit)
    return list(firsts.values())


def runs(chosen: BoolArray) -> list[Range]:
    """The ranges of the grid that are chosen."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    return [(float(EDGES[a]), float(EDGES[b])) for a, b in edges.reshape(-1, 2)]
