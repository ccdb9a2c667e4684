"""Piles answered without DEM, with correction factors from a few piles by DEM.

A factor is that of tau_c by DEM over tau_c without it, one for each stratum of piles
and each fraction. How far corrected thresholds are off is measured on other piles by
DEM, which no factor is made from.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.grains.threshold import first_load_step
from orchestrator.runs.case import Case
from orchestrator.types import FloatArray


class Pair(NamedTuple):
    """A pile that is answered twice.

    Attributes
    ----------
    stratum
        What it shares with the piles of its factor.
    plain
        The pile without DEM.
    by_dem
        The pile by DEM.
    """

    stratum: Hashable
    plain: Pile
    by_dem: Pile


@dataclass(frozen=True, eq=False)
class Correction:
    """Correction factors of some piles, and how far they are off.

    Attributes
    ----------
    fractions
        Fractions n/N, rising, at which there are factors.
    design
        Piles from which the factors are made.
    kept
        Piles kept apart from these, drawn at random from those that are left.
    """

    fractions: tuple[float, ...]
    design: tuple[Pair, ...]
    kept: tuple[Pair, ...]

    @cached_property
    def runs(self) -> tuple[Case, ...]:
        """The cases that the factors and their error are read from."""
        found: dict[str, Case] = {}
        for pair in (*self.design, *self.kept):
            found |= {run.name: run for run in (*pair.plain.runs, *pair.by_dem.runs)}
        return tuple(found.values())

    @property
    def confidence(self) -> float:
        """The share of further piles within the largest error of those kept apart."""
        return len(self.kept) / (len(self.kept) + 1)

    def made_from(self, stratum: Hashable) -> int:
        """Count the piles from which the factors of a stratum are made.

        Parameters
        ----------
        stratum
            The stratum.

        Returns
        -------
        int
            How many.
        """
        return sum(pair.stratum == stratum for pair in self.design)

    def factors(self, stratum: Hashable, cases: Path) -> FloatArray:
        """Find the factors of a stratum.

        Parameters
        ----------
        stratum
            The stratum.
        cases
            The directory of the finished runs.

        Returns
        -------
        FloatArray
            The median of tau_c by DEM over tau_c without it, at each fraction; NaN
            where a pile did not reach it.
        """
        return _factors(self, stratum, cases)

    def errors(self, cases: Path) -> FloatArray:
        """Measure how far corrected thresholds of the piles kept apart are off.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        FloatArray
            The largest relative difference from DEM at each fraction; infinite where a
            pile did not reach it. Of n piles drawn at random it holds n/(n + 1) of all
            such piles, whatever their distribution.
        """
        return _errors(self, cases)

    def error(self, fraction: float, cases: Path) -> float:
        """Find the error at a fraction.

        Parameters
        ----------
        fraction
            Fraction n/N.
        cases
            The directory of the finished runs.

        Returns
        -------
        float
            Between two fractions the larger error; infinite beyond all of them.
        """
        if not self.fractions[0] <= fraction <= self.fractions[-1]:
            return np.inf
        last = int(np.searchsorted(self.fractions, fraction))
        first = int(np.searchsorted(self.fractions, fraction, side="right")) - 1
        return float(self.errors(cases)[first : last + 1].max())


@cache
def _factors(of: Correction, stratum: Hashable, cases: Path) -> FloatArray:
    ratios = []
    for pair in of.design:
        if pair.stratum == stratum:
            tau = _tau(pair.by_dem, of.fractions, cases)
            ratios.append(np.log(tau / _tau(pair.plain, of.fractions, cases)))
    return np.asarray(np.exp(np.median(ratios, axis=0)))


@cache
def _errors(of: Correction, cases: Path) -> FloatArray:
    errors = []
    for pair in of.kept:
        made = corrected(pair.plain, of, pair.stratum)
        tau = _tau(pair.by_dem, of.fractions, cases)
        errors.append(np.abs(_tau(made, of.fractions, cases) / tau - 1))
    worst = np.max(errors, axis=0)
    return np.where(np.isnan(worst), np.inf, worst)


def _tau(pile: Pile, fractions: tuple[float, ...], cases: Path) -> FloatArray:
    return np.array([each.tau for each in pile.thresholds(cases, fractions)])


@dataclass(frozen=True, kw_only=True)
class CorrectedPile(Pile):
    """A pile answered without DEM, whose thresholds are corrected.

    Attributes
    ----------
    scene, cases, part
        As of any pile.
    correction
        The factors.
    stratum
        The stratum of the pile.
    """

    correction: Correction
    stratum: Hashable

    @cached_property
    def runs(self) -> tuple[Case, ...]:
        """The cases that its answer is read from, those of the correction last."""
        return (*self.own_runs, *self.correction.runs)

    def motion(self, cases: Path) -> Motion:
        """Find the motion of the counted grains, with their flows corrected.

        Parameters
        ----------
        cases
            The directory of the finished runs.

        Returns
        -------
        Motion
            When each of them moved.
        """
        motion = super().motion(cases)
        factors = self.correction.factors(self.stratum, cases)
        places, ratios = [], []
        for fraction, factor in zip(self.correction.fractions, factors, strict=True):
            step = first_load_step(motion, fraction)
            if step is not None:
                places.append(float(motion.fraction[step]))
                # a stress is as the square of a friction velocity
                ratios.append(float(factor) ** 0.5)
        return motion.scaled(places, ratios) if places else motion

    def correction_error(self, fraction: float, cases: Path) -> float:
        """Find how far corrected thresholds of the piles kept apart are off.

        Parameters
        ----------
        fraction
            Fraction n/N.
        cases
            The directory of the finished runs.

        Returns
        -------
        float
            `Correction.error`.
        """
        return self.correction.error(fraction, cases)


def corrected(plain: Pile, by: Correction, stratum: Hashable) -> CorrectedPile:
    """Correct a pile.

    Parameters
    ----------
    plain
        The pile without DEM.
    by
        The correction.
    stratum
        The stratum of the pile.

    Returns
    -------
    CorrectedPile
        The pile with corrected thresholds.
    """
    return CorrectedPile(
        plain.scene, plain.cases, plain.part, correction=by, stratum=stratum
    )
