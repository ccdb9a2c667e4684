"""Lines to compare thresholds with: closed form, published curves, and measurements.

A law's line in (Re*, tau) depends on the bed alone; density, viscosity and gravity say
which part of it a grain is on. Measurements judge each line over the Re* that a study
has grains of.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.physics import curves
from orchestrator.physics.constants import GRAIN_COLUMNS
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.physics.measured import BUFFINGTON_MONTGOMERY, MEASURED_SOURCE
from orchestrator.physics.onset import of_grains
from orchestrator.physics.threshold import (
    LAWS_OF,
    shields_at,
)
from orchestrator.report import labels
from orchestrator.report.page import caption
from orchestrator.report.results import Results, split_by
from orchestrator.report.subjects import fluid
from orchestrator.study.criterion import SUSTAINED
from orchestrator.types import BoolArray, FloatArray

PAIR = LAWS_OF["transition"]
"""The two laws of the paper, which hold at no common Re*.

Their lines need not be told apart.
"""
Dash = Any
"""A line's style, as matplotlib has it."""
_BROKEN = (0, (4, 1.5))
_CHAIN = (0, (6, 1.5, 1.2, 1.5))
_SHORT = (0, (2, 1.2))
LOOKS: tuple[tuple[str, Dash], ...] = (
    ("#1d1d1b", "--"),
    ("#1d1d1b", "-"),
    ("#d55e00", "-"),
    ("#d55e00", _BROKEN),
    ("#0072b2", "-"),
    ("#b58900", _CHAIN),
    ("#b58900", _SHORT),
    ("#7b3294", _CHAIN),
    ("#cc79a7", "-"),
    ("#0072b2", _BROKEN),
    ("#7b3294", _SHORT),
)
"""Colour and dash where colours mean laws, in the order of `LAWS`.

Variants share a colour. Those of one dash differ for deuteranopes and protanopes, too.
"""
DASHES: tuple[Dash, ...] = (
    "-",
    (0, (5, 1.2)),
    (0, (6, 1.2, 1, 1.2)),
    (0, (2.5, 1)),
    (0, (6, 1, 1, 1, 1, 1)),
    (0, (9, 1.5)),
    (0, (4, 1, 4, 1, 1, 1)),
)
"""Dashes where colours mean something else. Dotted is where a law does not hold."""
MANY = 3
"""Number of laws that dashes tell apart; more have colours of their own."""
SWEEP_M = (5e-5, 1e-3)
"""Diameters of the curves for air, m; a study with others widens the range."""
POINTS = 240
"""Diameters of a curve for air."""
BED = ["alpha_deg", "beta_deg", "z0_over_d", "alpha_s"]
"""Columns of all that a line depends on beside its law, in the order of
`LineConditions`."""
OF_GOING_ON = (
    *BED,
    "force_law",
    "rho_sol_kg_m3",
    "rho_f_kg_m3",
    "nu_m2_s",
    "g_m_s2",
    "cohesion_n_m",
)
"""Columns that set curves of grains in sustained motion apart."""
SIZES, BESIDE = 25, 4.0
"""Sizes of such a curve, and how far it reaches beyond those of a study, times."""
MOST_FLUIDS = 3
"""Fluids up to which each has an entry of its own in a legend."""
GOING, LEAVING = "sustained motion", "entrainment"
"""What lines are of, by the criterion."""
BAGNOLD_FROM = 3.5  # Bagnold's A is 0.1 above this Re* only; it rises below
GAS_RATIO = (
    100.0  # least rho_sol/rho_f of a fluid that curves for air may be compared with
)

BINS = BUFFINGTON_MONTGOMERY
MIDDLES = np.array([item.middle for item in BINS])
MEDIANS = np.array([item.median for item in BINS])
FACTORS_FROM = (
    0.3  # Re* from which factors are taken: below it are a dozen measurements
)
EDGES = np.geomspace(BINS[0].low, BINS[-1].high, 2001)
GRID = np.sqrt(
    EDGES[1:] * EDGES[:-1]
)  # Re* at which lines are compared with the measured ranges
_AT = np.searchsorted([item.high for item in BINS], GRID, side="right")
TENTHS = np.array([item.tenth for item in BINS])[_AT]
NINETIETHS = np.array([item.ninetieth for item in BINS])[_AT]
DECADES = float(np.log10(BINS[-1].high / BINS[0].low))
"""Decades of Re* in which there are measurements."""
HEAD = (
    "force law",
    "entrainment angle",
    "roughness",
    "Re* where it is within the measured 10 to 90 %",
    f"decades, of {DECADES:.1f}",
    "factor from the medians: median",
    "worst",
)
"""Head of the table that compares lines with measurements."""


def look(name: str) -> tuple[str, Dash]:
    """Choose the look of a law in a figure whose colours mean laws.

    Parameters
    ----------
    name
        Name of the law.

    Returns
    -------
    colour : str
        Its colour.
    dash : Dash
        Its dash.
    """
    return LOOKS[list(LAWS).index(name) % len(LOOKS)]


def drawn_laws(names: Iterable[str]) -> list[str]:
    """List the laws that are drawn for some scenes.

    Parameters
    ----------
    names
        Names of the laws of the scenes.

    Returns
    -------
    list of str
        The names in the order of `LAWS`; both of the paper's pair if either is used.
    """
    used = set(names)
    if used & set(PAIR):
        used |= set(PAIR)
    return [name for name in LAWS if name in used]


def dashes(names: Iterable[str]) -> dict[str, Dash]:
    """Choose a dash for each law where colours mean something else.

    Parameters
    ----------
    names
        Names of the laws of the scenes.

    Returns
    -------
    dict of str to Dash
        Dashes by law; the paper's pair shares one, and laws beyond the last dash have
        none.
    """
    found: dict[str, Dash] = {}
    free = iter(DASHES)
    for name in drawn_laws(names):
        if name in found:
            continue
        dash = next(free, None)
        if dash is None:
            break
        family = PAIR if name in PAIR else (name,)
        found.update(dict.fromkeys(family, dash))
    return found


class LineConditions(NamedTuple):
    """All that a line depends on beside its law.

    Attributes
    ----------
    slope_deg, entrainment_angle_deg
        Slope of the bed and entrainment angle, degrees.
    roughness_ratio
        Roughness length of the bed, d.
    lift_coefficient
        Coefficient of the lift.
    """

    slope_deg: float
    entrainment_angle_deg: float
    roughness_ratio: float
    lift_coefficient: float


@dataclass(frozen=True)
class Line:
    """The closed form of one grain by a law on a bed, and where a study has grains.

    Attributes
    ----------
    law
        Name of the law.
    bed
        The bed.
    first, last
        Least and largest Re* of the grains of the study by this law; infinite and 0 if
        there are none.
    """

    law: str
    bed: LineConditions
    first: float
    last: float

    @property
    def words(self) -> tuple[str, str, str]:
        """Law and bed in words."""
        law = labels.value("force_law", self.law)
        ratio = labels.ratio_in_words(self.bed.roughness_ratio, "d")
        return law, f"β = {self.bed.entrainment_angle_deg:g}°", f"z₀ = {ratio}"

    @property
    def name(self) -> str:
        """Law and bed for a legend."""
        return ", ".join(self.words)

    def tau(self, reynolds: FloatArray) -> FloatArray:
        """Find the critical Shields number at some Re*, also where no law holds.

        Parameters
        ----------
        reynolds
            Re* at the threshold, shape (n,).

        Returns
        -------
        FloatArray
            tau_c, shape (n,).
        """
        return shields_at(LAWS[self.law], reynolds, **self.bed._asdict())

    def holds(self, reynolds: FloatArray) -> BoolArray:
        """Say where the law holds.

        Parameters
        ----------
        reynolds
            Re* at the threshold, shape (n,).

        Returns
        -------
        BoolArray
            Whether it holds, shape (n,).
        """
        # in units of d, nu and rho_f the friction velocity is Re*
        unit = Grain(
            diameter=1.0,
            roughness=self.bed.roughness_ratio,
            fluid_density=1.0,
            viscosity=1.0,
            lift_coefficient=self.bed.lift_coefficient,
        )
        return LAWS[self.law].valid(reynolds, unit)

    def near(self, reynolds: FloatArray) -> BoolArray:
        """Say where the study has grains on both sides.

        Parameters
        ----------
        reynolds
            Re* at the threshold, shape (n,).

        Returns
        -------
        BoolArray
            Whether it has, shape (n,).
        """
        return np.asarray((reynolds >= self.first) & (reynolds <= self.last))

    def answers(self, reynolds: FloatArray) -> FloatArray:
        """Find the thresholds where the study has grains and the law holds.

        Parameters
        ----------
        reynolds
            Re* at the threshold, shape (n,).

        Returns
        -------
        FloatArray
            tau_c, shape (n,); NaN elsewhere, and for a grain that lies loose, whose
            tau_c is 0.
        """
        tau = self.tau(reynolds)
        is_answered = self.holds(reynolds) & self.near(reynolds) & (tau > 0)
        return np.where(is_answered, tau, np.nan)

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
        """Factor from each measured median, above or below; NaN without an answer."""
        ratio = self.answers(MIDDLES) / MEDIANS
        return np.where(MIDDLES >= FACTORS_FROM, np.maximum(ratio, 1 / ratio), np.nan)

    @property
    def median_factor(self) -> float:
        """Median of the factors; infinite if there are none."""
        _, at = self.worst
        return float(np.nanmedian(self.factors)) if at else np.inf

    @property
    def worst(self) -> tuple[float, float]:
        """The largest factor and its Re*; infinite and 0 if there are none."""
        at = int(np.argmax(np.nan_to_num(self.factors)))
        factor = float(self.factors[at])
        return (factor, float(MIDDLES[at])) if np.isfinite(factor) else (np.inf, 0.0)


class Going(NamedTuple):
    """The thresholds of sustained motion, over sizes of one kind of grain in a fluid.

    Attributes
    ----------
    law, bed, name
        The force law, the bed, and both in words, with the fluid if there are several.
    reynolds, tau
        Re* and tau at the thresholds, shape (n,).
    holds
        Whether the law holds there, shape (n,).
    """

    law: str
    bed: LineConditions
    name: str
    reynolds: FloatArray
    tau: FloatArray
    holds: BoolArray


def sustained_curves(rows: pd.DataFrame) -> list[Going]:
    """Find the curves of the grains among some answers that have to go on.

    Unlike the closed form of a pocket they depend on the grains and the fluid, and not
    on Re* alone.

    Parameters
    ----------
    rows
        Thresholds with the columns of their scenes.

    Returns
    -------
    list of Going
        A curve for each kind of grain.
    """
    found = []
    rows = rows[rows["criterion"] == SUSTAINED]
    fluids = rows[["rho_f_kg_m3", "nu_m2_s"]].drop_duplicates()
    for _, group in split_by(rows, *OF_GOING_ON):
        first = group.iloc[0]
        ends = group["d_m"].min() / BESIDE, group["d_m"].max() * BESIDE
        d = np.geomspace(*ends, SIZES)
        here = pd.DataFrame([first] * SIZES).assign(d_m=d, z0_m=first["z0_over_d"] * d)
        grains = Grain.of_table(here)
        at = of_grains(grains, str(first["force_law"]), SUSTAINED, first["gust"])
        bed = LineConditions._make(first[BED].tolist())
        line = Line(str(first["force_law"]), bed, np.inf, 0.0)
        within = ""
        if len(fluids) > MOST_FLUIDS:
            within = " in each fluid"
        elif len(fluids) > 1:
            within = f" in {fluid(first['rho_f_kg_m3'], first['nu_m2_s'])}"
        name = f"{line.name}{within}"
        holds = line.holds(at.reynolds)
        found.append(Going(line.law, bed, name, at.reynolds, at.shields, holds))
    return found


def measured_lines(scenes: pd.DataFrame) -> list[Line]:
    """Make the lines through the single grains of some scenes.

    Parameters
    ----------
    scenes
        Scenes with the columns of their grains.

    Returns
    -------
    list of Line
        The lines, by rising slope, entrainment angle, roughness and lift coefficient.
    """
    listed = []
    for key, group in split_by(
        scenes[[*GRAIN_COLUMNS.values(), "z0_over_d", "force_law"]], *BED
    ):
        for law in drawn_laws(group["force_law"]):
            of_law = group[group["force_law"] == law]
            first, last = span(of_law)
            listed.append(Line(law, LineConditions._make(key), first, last))
    return listed


def span(scenes: pd.DataFrame) -> tuple[float, float]:
    """Find the range of Re* at the thresholds of the single grains of scenes.

    Parameters
    ----------
    scenes
        Scenes with the columns of their grains.

    Returns
    -------
    least, largest : float
        Its ends; infinite and 0 where no grain has a threshold.
    """
    found = []
    for law, of_law in scenes.groupby("force_law"):
        found.append(of_grains(Grain.of_table(of_law), str(law)).reynolds)
    reynolds = np.concatenate([*found, np.empty(0)])
    reynolds = reynolds[np.isfinite(reynolds) & (reynolds > 0)]
    return float(reynolds.min(initial=np.inf)), float(reynolds.max(initial=0.0))


def in_gas(scenes: pd.DataFrame) -> "pd.Series[bool]":
    """Say which scenes may be compared with curves for air.

    Parameters
    ----------
    scenes
        Scenes with the densities of grains and fluid.

    Returns
    -------
    Series of bool
        Whether the grains are at least `GAS_RATIO` times as dense as the fluid.
    """
    return scenes["rho_sol_kg_m3"] >= GAS_RATIO * scenes["rho_f_kg_m3"]


def air_lines(
    scenes: pd.DataFrame, slope: float = 0.0
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Compute the published curves for air for the grains of some scenes.

    Of several gases the one of the least viscosity is taken.

    Parameters
    ----------
    scenes
        The scenes.
    slope
        Slope of the bed, degrees; its factor is on u*.

    Returns
    -------
    dict of str to tuple
        Re* and critical Shields number of each curve, by its name; empty without a
        gas.
    """
    scenes = scenes[in_gas(scenes)]
    if scenes.empty:
        return {}
    item = scenes.iloc[int(scenes["nu_m2_s"].argmin())]
    columns = ("rho_sol_kg_m3", "rho_f_kg_m3", "nu_m2_s", "g_m_s2")
    of_air = tuple(float(item[column]) for column in columns)
    first = min(SWEEP_M[0], scenes["d_m"].min())
    last = max(SWEEP_M[1], scenes["d_m"].max())
    sizes = _sizes_in_air(of_air, first, last)
    factor = curves.slope_factor_on_ustar(np.asarray(slope), item["phi_deg"])
    listed = {}
    for name in curves.AIR:
        ustar = factor * _ustar(name, of_air, first, last)
        x = sizes.reynolds(ustar)
        y = sizes.shields(ustar)
        if name == "Bagnold 1941":
            y = y[x >= BAGNOLD_FROM]
            x = x[x >= BAGNOLD_FROM]
        listed[name] = (x, y)
    return listed


def _sizes_in_air(of_air: tuple[float, ...], first: float, last: float) -> Grain:
    """Grains between two diameters, m, by densities, viscosity and gravity."""
    density, fluid_density, viscosity, gravity = of_air
    return Grain(
        diameter=np.geomspace(first, last, POINTS),
        density=density,
        fluid_density=fluid_density,
        viscosity=viscosity,
        gravity=gravity,
    )


# one of the curves is found by iteration, for each panel and slope of a figure anew
@cache
def _ustar(
    name: str, of_air: tuple[float, ...], first: float, last: float
) -> FloatArray:
    """Threshold friction velocity of a curve for air over diameters (m), m/s."""
    return curves.AIR[name](_sizes_in_air(of_air, first, last))


def ranked(results: Results) -> list[Line]:
    """List the lines of a study's single grains on a flat bed, the nearest first.

    Parameters
    ----------
    results
        The study.

    Returns
    -------
    list of Line
        The line that is within the measured range over most decades comes first; equal
        ones are in the order of their factor from the medians.
    """

    def make() -> list[Line]:
        grains = results.beds("grain")
        every = measured_lines(grains[grains["alpha_deg"] == 0])
        listed = [line for line in every if line.last]
        return sorted(
            listed, key=lambda line: (-round(line.decades, 2), line.median_factor)
        )

    return results.once("ranked", make)


def best(listed: Sequence[Line]) -> list[Line]:
    """Take the first line of each law.

    Parameters
    ----------
    listed
        The lines.

    Returns
    -------
    list of Line
        One for each law.
    """
    firsts: dict[str, Line] = {}
    for line in listed:
        firsts.setdefault(line.law, line)
    return list(firsts.values())


def are_many(results: Results) -> bool:
    """Say whether a study compares more force laws than dashes tell apart.

    Parameters
    ----------
    results
        The study.

    Returns
    -------
    bool
        Whether it does.
    """
    return len(best(ranked(results))) > MANY


def ranges(chosen: BoolArray) -> list[tuple[float, float]]:
    """Find the ranges of Re* of the chosen points of `GRID`.

    Parameters
    ----------
    chosen
        Which points are chosen, shape (2000,).

    Returns
    -------
    list of tuple
        Both ends of each range.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]])))
    return [(float(EDGES[a]), float(EDGES[b])) for a, b in edges.reshape(-1, 2)]


def _number(reynolds: float) -> str:
    if reynolds >= 9.95:
        return f"{reynolds:.0f}"
    return f"{reynolds:.2g}"


def _ranges(chosen: BoolArray) -> str:
    written = [f"{_number(first)} … {_number(last)}" for first, last in ranges(chosen)]
    return ", ".join(written)


def theory_section(results: Results) -> dict[str, Any] | None:
    """Make what the page's section on measurements shows.

    Parameters
    ----------
    results
        The study.

    Returns
    -------
    dict or None
        Its source, sentences and tables, by name. None without single grains on a flat
        bed that leave their pockets: what is compared is the closed form of these.
    """
    listed = ranked(results)
    answers = results.joined("single_grain")
    if not listed or (len(answers) and (answers["criterion"] == SUSTAINED).all()):
        return None
    return {
        "source": MEASURED_SOURCE,
        "start": FACTORS_FROM,
        "sentences": [each.sentence for each in nearest_lines(results)],
        "best": theory_sheet(best(listed)),
        "every": theory_sheet(listed),
    }


def theory_sheet(listed: Iterable[Line]) -> pd.DataFrame:
    """Make the table that compares lines with measurements.

    Parameters
    ----------
    listed
        The lines.

    Returns
    -------
    DataFrame
        A row of texts for each line, with the columns `HEAD`.
    """
    rows = []
    for line in listed:
        worst, at = line.worst
        has_factors = at > 0
        row = [*line.words]
        row.append(_ranges(line.met) or "nowhere")
        row.append(f"{line.decades:.1f}")
        row.append(f"{line.median_factor:.2f}" if has_factors else "—")
        row.append(f"{worst:.2f} at Re* = {_number(at)}" if has_factors else "—")
        rows.append(row)
    return pd.DataFrame(rows, columns=list(HEAD))


NEAREST_IN_AIR = "Nearest to the published curves for air"
"""To what the line of the last finding is nearest."""


class LineFinding(NamedTuple):
    """What measurements say of the lines of a study.

    Attributes
    ----------
    of
        To what a line is nearest; empty where none is.
    text
        Which line it is, or what no line meets.
    name, factor
        In air the line, and its median misfit; empty and NaN of other findings.
    of_first
        There the median misfit of the line that is nearest in water; NaN where it has
        no thresholds.
    """

    of: str
    text: str
    name: str = ""
    factor: float = np.nan
    of_first: float = np.nan

    @property
    def sentence(self) -> str:
        """The finding as a text of its own."""
        return f"{self.of} is {self.text}" if self.of else self.text


def nearest_lines(results: Results) -> list[LineFinding]:
    """Write which line is nearest to measurements.

    Parameters
    ----------
    results
        The study.

    Returns
    -------
    list of Finding
        The nearest line in water, the Re* at which no line is within the measured
        range, and the nearest line in air.
    """
    listed = ranked(results)
    in_air = _nearest_in_air(results, listed)
    return [*_nearest_in_water(listed), *_unmet(listed), *in_air]


def _nearest_in_water(listed: Sequence[Line]) -> list[LineFinding]:
    """The sentence on the line that is within measured ranges over most decades."""
    first = listed[0]
    _, at = first.worst
    if not (at and first.decades):
        return []
    sentence = caption(
        "best_law",
        fit=first,
        at=_number(at),
        count=len(listed),
        decades=DECADES,
        start=FACTORS_FROM,
    )
    return [LineFinding("Nearest to the measurements in water", sentence)]


def _unmet(listed: Sequence[Line]) -> list[LineFinding]:
    """The sentence on the Re* at which lines answer, none within measured ranges."""
    is_answered = np.any([np.isfinite(line.answers(GRID)) for line in listed], axis=0)
    is_met = np.any([line.met for line in listed], axis=0)
    unmet = is_answered & ~is_met
    if not unmet.any():
        return []
    return [LineFinding("", caption("unmet", ranges=_ranges(unmet)))]


def _nearest_in_air(results: Results, listed: Sequence[Line]) -> list[LineFinding]:
    """The sentence on the line that is nearest to the mean of the curves for air."""
    logs = np.log(MIDDLES)
    read = []
    for curve in air_lines(results.beds("grain")).values():
        x, y = np.log(curve)
        read.append(np.interp(logs, x, y, left=np.nan, right=np.nan))
    if not read or len(listed) < 2:
        return []
    is_covered = np.isfinite(read).any(axis=0)
    if not is_covered.any():
        return []
    mean = np.exp(np.nanmean(np.array(read)[:, is_covered], axis=0))
    x = MIDDLES[is_covered]
    ends = f"{_number(x[0])} … {_number(x[-1])}"
    off = []
    answered = []
    for line in listed:
        ratio = line.answers(x) / mean
        factors = np.maximum(ratio, 1 / ratio)
        answered.append(int(np.isfinite(factors).sum()))
        # infinite where a law does not hold: few of the curves' Re* judge no line
        off.append(float(np.median(np.nan_to_num(factors, nan=np.inf))))
    if np.isinf(min(off)):
        most = f"{max(answered)} of {len(x)}"
        said = caption("none_in_air", count=len(listed), ends=ends, most=most)
        return [LineFinding("", said)]
    of_first = np.nan if np.isinf(off[0]) else off[0]
    fit = listed[int(np.argmin(off))]
    said = caption("best_in_air", fit=fit, off=min(off), of_first=of_first, ends=ends)
    return [LineFinding(NEAREST_IN_AIR, said, fit.name, min(off), of_first)]
