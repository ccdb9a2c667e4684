"""Lines to compare thresholds with: the closed form of one grain, and published curves.

Density, viscosity and gravity say which part of a law's curve in (Re*, tau) the grains are on.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.physics import curves
from orchestrator.physics.curves import Air
from orchestrator.physics.force_law import Exposure
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import LAWS_OF, Threshold, shields_at
from orchestrator.report.results import split
from orchestrator.study import closed_form
from orchestrator.types import BoolArray, FloatArray

PAIR = LAWS_OF["transition"]
"""The two laws of the paper, which hold at no common Re*: their lines need not be told apart."""
Dash = Any
"""A line's style, as matplotlib has it."""
_BROKEN = (0, (4, 1.5))
LOOKS: tuple[tuple[str, Dash], ...] = (
    *(("#5a5a5a", "--"), ("#5a5a5a", "-"), ("#c8102e", "-"), ("#c8102e", _BROKEN)),
    *(("#009e73", "-"), ("#7b3294", "-"), ("#e69f00", "-"), ("#e69f00", _BROKEN)),
    *(("#e377c2", "-"), ("#009e73", _BROKEN), ("#7b3294", _BROKEN)),
)
"""Colour and dash where colours mean laws, in the order of `LAWS`: variants share a colour."""
DASHES: tuple[Dash, ...] = (
    *("-", (0, (5, 1.2)), (0, (6, 1.2, 1, 1.2)), (0, (2.5, 1))),
    *((0, (6, 1, 1, 1, 1, 1)), (0, (9, 1.5)), (0, (4, 1, 4, 1, 1, 1))),
)
"""Dashes where colours mean something else. Dotted is where a law does not hold."""
FEW_LAWS = 3
"""Laws that dashes tell apart; more have colours of their own."""
SWEEP_M = (5e-5, 1e-3)
"""Diameters of the paper; a study with others widens the sweep."""
POINTS = 240
WIDER = 10.0
"""Factor on Re* by which lines go on beyond a study's grains: axes cut them."""
GRAIN = [
    *("d_m", "z0_m", "rho_f_kg_m3", "nu_m2_s", "alpha_s"),
    *("rho_sol_kg_m3", "alpha_deg", "beta_deg", "g_m_s2"),
]
"""Columns of all that the closed form depends on, in the order of `closed_form.SingleGrain`."""
WHOLE = np.geomspace(1e-4, 1e6, 2001)
"""Re* of any grain."""
LEAST_CURVES = 2
"""The band for water is drawn only where at least this many curves were published for."""
BAGNOLD_FROM = 3.5
"""Bagnold's A is 0.1 above this Re* only; it rises below."""
SLOPED = "Shao & Lu 2000"
"""The curve for air that is drawn for sloping beds."""
GAS_RATIO = 100.0
"""Least rho_sol/rho_f of a fluid that curves for air may be compared with."""


def look(name: str) -> tuple[str, Dash]:
    """Colour and dash of a law where colours mean laws."""
    return LOOKS[list(LAWS).index(name) % len(LOOKS)]


def drawn(names: Iterable[str]) -> list[str]:
    """The laws that are drawn for some scenes: of the paper's pair both if either is used."""
    used = set(names)
    pair = set(PAIR) if used & set(PAIR) else set()
    return [name for name in LAWS if name in used | pair]


def many(names: Iterable[str]) -> bool:
    """Whether there are so many laws that colours must tell them apart."""
    return len(set(dashes(names).values())) > FEW_LAWS


def dashes(names: Iterable[str]) -> dict[str, Dash]:
    """A dash for each of the laws that are drawn; the paper's pair has one."""
    listed = drawn(names)
    families = dict.fromkeys(PAIR if name in PAIR else (name,) for name in listed)
    return {name: dash for family, dash in zip(families, DASHES, strict=False) for name in family}


@dataclass(frozen=True)
class Bed:
    """All that the closed form depends on beside Re* and the law; angles in degrees."""

    slope_deg: float
    entrainment_angle_deg: float
    roughness_ratio: float
    lift_coefficient: float


@dataclass(frozen=True)
class Branch:
    """One law's line in the Shields diagram: Re* (rising) and tau at the threshold.

    ``valid`` is where the law holds, ``continued`` where it does not but the study has grains.
    """

    law: str
    reynolds: FloatArray
    shields: FloatArray
    valid: BoolArray
    continued: BoolArray


def branches(scenes: pd.DataFrame) -> list[Branch]:
    """The lines through scenes of one slope, one entrainment angle and one z0/d."""
    scenes = scenes[[*GRAIN, "z0_over_d", "force_law"]]  # to part sixty columns takes long
    low, high = span(scenes)
    reynolds = np.geomspace(low / WIDER, high * WIDER, POINTS)
    lines = []
    for _, group in split(scenes, "alpha_s"):
        bed = bed_of(group)
        for law in drawn(group["force_law"]):
            here = group[group["force_law"] == law]
            first, last = span(here) if len(here) else (np.inf, 0.0)
            valid = law_holds(law, reynolds, bed)
            near = (reynolds >= first / 1.01) & (reynolds <= last * 1.01) & ~valid
            lines.append(Branch(law, reynolds, shields(law, reynolds, bed), valid, near))
    return lines


def bed_of(scenes: pd.DataFrame) -> Bed:
    """The bed of scenes that share it."""
    item = scenes.iloc[0]
    return Bed(*(float(item[c]) for c in ("alpha_deg", "beta_deg", "z0_over_d", "alpha_s")))


def shields(law: str, reynolds: FloatArray, bed: Bed) -> FloatArray:
    """Tau of one grain on a bed whose threshold is at some Re*."""
    return shields_at(LAWS[law], reynolds, **vars(bed))


def law_holds(law: str, reynolds: FloatArray, bed: Bed) -> BoolArray:
    """Whether a law holds at some Re*."""
    return LAWS[law].valid(reynolds, _unit(bed.roughness_ratio, bed.lift_coefficient))


def _unit(ratio: float, lift_coefficient: float = 1.0) -> Exposure:
    """A grain in units of d, nu and rho_f, in which the friction velocity is Re*."""
    return Exposure(1.0, ratio, 1.0, 1.0, lift_coefficient)


def span(scenes: pd.DataFrame) -> tuple[float, float]:
    """Least and largest Re* of scenes at the thresholds of their single grains."""
    grains: dict[str, list[tuple[float, ...]]] = {}  # without groupby: it is asked for each line
    for law, *grain in set(scenes[["force_law", *GRAIN]].itertuples(index=False, name=None)):
        grains.setdefault(law, []).append(tuple(grain))
    every = (item for law, alike in grains.items() for item in closed_form.thresholds(law, alike))
    reynolds = np.array([item.reynolds for item in every], float)
    reynolds = reynolds[np.isfinite(reynolds) & (reynolds > 0)]
    return float(reynolds.min()), float(reynolds.max())


def thresholds(scenes: pd.DataFrame, law: str) -> list[Threshold]:
    """The closed form of the single grains of some rows under a law."""
    return closed_form.thresholds(law, list(scenes[GRAIN].itertuples(index=False, name=None)))


def drag_law_limit(z0_over_d: float, law: str = "high") -> float:
    """Re* at which the particle Reynolds number V d/nu reaches the end of a law's drag."""
    particle = LAWS[law].particle_reynolds(WHOLE, _unit(z0_over_d))
    return float(np.exp(np.interp(np.log(LAWS[law].drag_end), np.log(particle), np.log(WHOLE))))


def water_band(reynolds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest of the published curves for water at some Re*, NaN below two curves."""
    lines = (np.log(curve.points(2000)) for curve in curves.WATER)
    at, outside = np.log(reynolds), {"left": np.nan, "right": np.nan}
    table = np.exp([np.interp(at, x, y, **outside) for x, y in lines])
    table[:, np.isfinite(table).sum(axis=0) < LEAST_CURVES] = np.nan
    return np.fmin.reduce(table), np.fmax.reduce(table)


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
    lines = {name: air.shields_diagram(d, factor * _ustar(name, air, *ends)) for name in curves.AIR}
    x, y = lines["Bagnold 1941"]
    lines["Bagnold 1941"] = x[x >= BAGNOLD_FROM], y[x >= BAGNOLD_FROM]
    return lines


@cache  # one of the curves is found by iteration, for each panel and slope of a figure anew
def _ustar(name: str, air: Air, first: float, last: float) -> FloatArray:
    """Threshold friction velocity of a curve for air over diameters (m), m/s."""
    return curves.AIR[name](np.geomspace(first, last, POINTS), air)
