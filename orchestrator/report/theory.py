"""Lines to compare thresholds with: closed form, published curves, and measurements.

A law's line in (Re*, tau) depends on the bed alone; density, viscosity and gravity say which part
of it a grain is on. Measurements judge each line over the Re* that a study has grains of.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.physics import curves
from orchestrator.physics.curves import Air
from orchestrator.physics.laws import LAWS, Exposure
from orchestrator.physics.measured import BUFFINGTON_MONTGOMERY, MEASURED_SOURCE
from orchestrator.physics.threshold import LAWS_OF, Threshold, shields_at, thresholds_of
from orchestrator.report import labels
from orchestrator.report.page import caption
from orchestrator.report.results import Results, split
from orchestrator.types import BoolArray, FloatArray

PAIR = LAWS_OF["transition"]
"""The two laws of the paper, which hold at no common Re*: their lines need not be told apart."""
Dash = Any
"""A line's style, as matplotlib has it."""
_BROKEN = (0, (4, 1.5))
LOOKS: tuple[tuple[str, Dash], ...] = (
    *(("#5a5a5a", "--"), ("#5a5a5a", "-"), ("#c8102e", "-"), ("#c8102e", _BROKEN)),
    *(("#009e73", "-"), ("#e69f00", "-"), ("#e69f00", _BROKEN)),
    *(("#7b3294", "-"), ("#e377c2", "-"), ("#009e73", _BROKEN), ("#7b3294", _BROKEN)),
)
"""Colour and dash where colours mean laws, in the order of `LAWS`: variants share a colour."""
DASHES: tuple[Dash, ...] = (
    *("-", (0, (5, 1.2)), (0, (6, 1.2, 1, 1.2)), (0, (2.5, 1))),
    *((0, (6, 1, 1, 1, 1, 1)), (0, (9, 1.5)), (0, (4, 1, 4, 1, 1, 1))),
)
"""Dashes where colours mean something else. Dotted is where a law does not hold."""
MANY = 3  # laws that dashes tell apart; more have colours of their own
SWEEP_M = (5e-5, 1e-3)  # diameters (m) of the curves for air; a study with others widens the range
POINTS = 240
GRAIN = [
    *("d_m", "z0_m", "rho_f_kg_m3", "nu_m2_s", "alpha_s"),
    *("rho_sol_kg_m3", "alpha_deg", "beta_deg", "g_m_s2", "cohesion_n_m"),
]
"""Columns of all that the closed form depends on, in the order of `SingleGrain`."""
BED = ["alpha_deg", "beta_deg", "z0_over_d", "alpha_s"]
"""Columns of all that a line depends on beside its law, in the order of `Bed`."""
BAGNOLD_FROM = 3.5  # Bagnold's A is 0.1 above this Re* only; it rises below
GAS_RATIO = 100.0  # least rho_sol/rho_f of a fluid that curves for air may be compared with

BINS = BUFFINGTON_MONTGOMERY
MIDDLES = np.array([item.middle for item in BINS])
MEDIANS = np.array([item.median for item in BINS])
FACTORS_FROM = 0.3  # Re* from which factors are taken: below it are a dozen measurements
EDGES = np.geomspace(BINS[0].low, BINS[-1].high, 2001)
GRID = np.sqrt(EDGES[1:] * EDGES[:-1])  # Re* at which lines are compared with the measured ranges
_AT = np.searchsorted([item.high for item in BINS], GRID, side="right")
TENTHS = np.array([item.tenth for item in BINS])[_AT]
NINETIETHS = np.array([item.ninetieth for item in BINS])[_AT]
DECADES = float(np.log10(BINS[-1].high / BINS[0].low))
"""Decades of Re* in which there are measurements."""
HEAD = (
    *("force law", "entrainment angle", "roughness"),
    *("Re* where it is within the measured 10 to 90 %", f"decades, of {DECADES:.1f}"),
    *("factor from the medians: median", "worst"),
)


def look(name: str) -> tuple[str, Dash]:
    """Colour and dash of a law where colours mean laws."""
    return LOOKS[list(LAWS).index(name) % len(LOOKS)]


def drawn(names: Iterable[str]) -> list[str]:
    """The laws that are drawn for some scenes: of the paper's pair both if either is used."""
    used = set(names)
    return [name for name in LAWS if name in used or (name in PAIR and used & set(PAIR))]


def dashes(names: Iterable[str]) -> dict[str, Dash]:
    """A dash for each of the laws that are drawn; the paper's pair has one."""
    listed = drawn(names)
    families = dict.fromkeys(PAIR if name in PAIR else (name,) for name in listed)
    return {name: dash for family, dash in zip(families, DASHES, strict=False) for name in family}


class Bed(NamedTuple):
    """All that a line depends on beside its law; angles in degrees."""

    slope_deg: float
    entrainment_angle_deg: float
    roughness_ratio: float
    lift_coefficient: float


@dataclass(frozen=True)
class Line:
    """The closed form of one grain by a law on a bed, and the Re* between which a study has grains.

    `first` and `last` are infinite and 0 if it has none of that law.
    """

    law: str
    bed: Bed
    first: float
    last: float

    @property
    def words(self) -> tuple[str, str, str]:
        """Law and bed in words."""
        beta, ratio = self.bed.entrainment_angle_deg, labels.ratio_of(self.bed.roughness_ratio, "d")
        return labels.value("force_law", self.law), f"β = {beta:g}°", f"z₀ = {ratio}"

    @property
    def name(self) -> str:
        """Law and bed for a legend."""
        return ", ".join(self.words)

    def tau(self, reynolds: FloatArray) -> FloatArray:
        """Tau of the grain whose threshold is at some Re*, whether or not the law holds."""
        return shields_at(LAWS[self.law], reynolds, **self.bed._asdict())

    def holds(self, reynolds: FloatArray) -> BoolArray:
        """Whether the law holds at some Re*; in units of d, nu and rho_f they are u*."""
        unit = Exposure(1.0, self.bed.roughness_ratio, 1.0, 1.0, self.bed.lift_coefficient)
        return LAWS[self.law].valid(reynolds, unit)

    def near(self, reynolds: FloatArray) -> BoolArray:
        """Whether the study has grains on both sides of some Re*."""
        return np.asarray((reynolds >= self.first) & (reynolds <= self.last))

    def answers(self, reynolds: FloatArray) -> FloatArray:
        """Tau where the study has grains and the law holds, else NaN."""
        return np.where(self.holds(reynolds) & self.near(reynolds), self.tau(reynolds), np.nan)

    @cached_property
    def met(self) -> BoolArray:
        """Where on `GRID` it is from the tenth to the ninetieth measured percentile."""
        tau = self.answers(GRID)
        return (tau >= TENTHS) & (tau <= NINETIETHS)

    @property
    def decades(self) -> float:
        """Decades of Re* over which it is within the measured range."""
        return DECADES * float(self.met.mean())

    @cached_property
    def factors(self) -> FloatArray:
        """Factor from the median of each range of Re*, above or below; NaN without an answer."""
        ratio = self.answers(MIDDLES) / MEDIANS
        return np.where(MIDDLES >= FACTORS_FROM, np.maximum(ratio, 1 / ratio), np.nan)

    @property
    def median_factor(self) -> float:
        """Median of the factors; infinite if there are none."""
        return float(pd.Series(self.factors).median()) if self.worst[1] else np.inf

    @property
    def worst(self) -> tuple[float, float]:
        """The largest factor and its Re*; infinite and 0 if there are none."""
        at = int(np.argmax(np.nan_to_num(self.factors)))
        factor = float(self.factors[at])
        return (factor, float(MIDDLES[at])) if np.isfinite(factor) else (np.inf, 0.0)


def lines(scenes: pd.DataFrame) -> list[Line]:
    """The lines through some scenes, by rising slope, entrainment angle, z0/d and lift."""
    listed = []
    for key, group in split(scenes[[*GRAIN, "z0_over_d", "force_law"]], *BED):
        for law in drawn(group["force_law"]):
            listed.append(Line(law, Bed._make(key), *span(group[group["force_law"] == law])))
    return listed


def span(scenes: pd.DataFrame) -> tuple[float, float]:
    """Least and largest Re* of scenes at the thresholds of their single grains."""
    laws = scenes["force_law"].unique()
    every = [item for law in laws for item in thresholds(scenes[scenes["force_law"] == law], law)]
    reynolds = np.array([item.reynolds for item in every], float)
    reynolds = reynolds[np.isfinite(reynolds) & (reynolds > 0)]
    return float(reynolds.min(initial=np.inf)), float(reynolds.max(initial=0.0))


def thresholds(scenes: pd.DataFrame, law: str) -> list[Threshold]:
    """The closed form of the single grains of some rows under a law."""
    return thresholds_of(law, list(scenes[GRAIN].itertuples(index=False, name=None)))


def in_gas(scenes: pd.DataFrame) -> "pd.Series[bool]":
    """Which scenes may be compared with curves for air."""
    return scenes["rho_sol_kg_m3"] >= GAS_RATIO * scenes["rho_f_kg_m3"]


def air_lines(scenes: pd.DataFrame, slope: float = 0.0) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Re* and theta_c of the curves for air, by name, for the grains and the gas of some scenes.

    The factor of the slope (degrees) is on u*. Of several gases the one of the least viscosity is
    taken; without a gas there are no lines.
    """
    scenes = scenes[in_gas(scenes)]
    if scenes.empty:
        return {}
    item = scenes.iloc[int(scenes["nu_m2_s"].argmin())]
    air = Air(item["rho_sol_kg_m3"], item["rho_f_kg_m3"], item["nu_m2_s"], item["g_m_s2"])
    ends = min(SWEEP_M[0], scenes["d_m"].min()), max(SWEEP_M[1], scenes["d_m"].max())
    d = np.geomspace(*ends, POINTS)
    factor = curves.slope_factor_on_ustar(np.asarray(slope), item["phi_deg"])
    each = {name: factor * _ustar(name, air, *ends) for name in curves.AIR}
    listed = {name: air.shields_diagram(d, ustar) for name, ustar in each.items()}
    x, y = listed["Bagnold 1941"]
    return {**listed, "Bagnold 1941": (x[x >= BAGNOLD_FROM], y[x >= BAGNOLD_FROM])}


@cache  # one of the curves is found by iteration, for each panel and slope of a figure anew
def _ustar(name: str, air: Air, first: float, last: float) -> FloatArray:
    """Threshold friction velocity of a curve for air over diameters (m), m/s."""
    return curves.AIR[name](np.geomspace(first, last, POINTS), air)


@lru_cache(maxsize=1)
def ranked(results: Results) -> list[Line]:
    """The lines of a study's single grains on a flat bed: the widest within measurements first.

    Equally wide ones go by their factor from the medians.
    """
    grains = results.beds("grain")
    every = lines(grains[grains["alpha_deg"] == 0])
    listed = [line for line in every if line.last]
    return sorted(listed, key=lambda line: (-round(line.decades, 2), line.median_factor))


def best(listed: Sequence[Line]) -> list[Line]:
    """The first of each law."""
    return [line for n, line in enumerate(listed) if line.law not in {x.law for x in listed[:n]}]


def ranges(chosen: BoolArray) -> list[tuple[float, float]]:
    """The ranges of Re* of the chosen points of `GRID`."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    return [(float(EDGES[a]), float(EDGES[b])) for a, b in edges.reshape(-1, 2)]


def _number(reynolds: float) -> str:
    return f"{reynolds:.0f}" if reynolds >= 9.95 else f"{reynolds:.2g}"


def _ranges(chosen: BoolArray) -> str:
    return ", ".join(" … ".join(map(_number, ends)) for ends in ranges(chosen))


def section(results: Results) -> dict[str, Any] | None:
    """The words of the page's section on measurements; None without single grains on a flat bed."""
    listed = ranked(results)
    if not listed:
        return None
    return {
        "source": MEASURED_SOURCE,
        "start": FACTORS_FROM,
        "sentences": nearest(results),
        "best": sheet(best(listed)),
        "every": sheet(listed),
    }


def sheet(listed: Iterable[Line]) -> pd.DataFrame:
    """A row for each line: law, entrainment angle, z0/d, and how it compares with measurements."""
    rows = []
    for line in listed:
        worst, at = line.worst
        factors = (f"{line.median_factor:.2f}", f"{worst:.2f} at Re* = {_number(at)}")
        where, decades = _ranges(line.met) or "nowhere", f"{line.decades:.1f}"
        rows.append((*line.words, where, decades, *(factors if at else ("—", "—"))))
    return pd.DataFrame(rows, columns=list(HEAD))


def nearest(results: Results) -> list[str]:
    """The law and bed nearest to measurements in water, what none meets, the nearest in air."""
    listed, said = ranked(results), []
    first, (_, at) = listed[0], listed[0].worst
    if at and first.decades:
        facts = {"count": len(listed), "decades": DECADES, "start": FACTORS_FROM}
        said.append(caption("best_law", fit=first, at=_number(at), **facts))
    unmet = np.any([np.isfinite(line.answers(GRID)) for line in listed], axis=0)
    unmet &= ~np.any([line.met for line in listed], axis=0)
    if unmet.any():
        said.append(caption("unmet", ranges=_ranges(unmet)))
    outside, logs = {"left": np.nan, "right": np.nan}, np.log(MIDDLES)
    air = air_lines(results.beds("grain")).values()
    read = np.array([np.interp(logs, *np.log(line), **outside) for line in air])
    covered = np.isfinite(read.reshape(-1, len(logs))).any(axis=0)
    if covered.any() and len(listed) > 1:
        mean, x = np.exp(np.nanmean(read[:, covered], axis=0)), MIDDLES[covered]
        ratios = [line.answers(x) / mean for line in listed]
        # infinite where a law does not hold: few of the curves' Re* judge no line
        off = [np.median(np.nan_to_num(np.maximum(r, 1 / r), nan=np.inf)) for r in ratios]
        at_ends, of = f"{_number(x[0])} … {_number(x[-1])}", listed[int(np.argmin(off))]
        said.append(caption("best_in_air", fit=of, off=min(off), of_first=off[0], ends=at_ends))
    return said
