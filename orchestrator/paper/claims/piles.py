"""Claims of the paper on the thresholds of piles (section 3.2)."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.paper.claims.base import (
    BY_SHARE,
    NAMES,
    Claim,
    Evidence,
    by_regime,
    by_share,
    combined,
    others,
    pairs,
    up,
)
from orchestrator.physics.exposure import Exposure
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import threshold
from orchestrator.report.results import split

FloatArray = NDArray[np.float64]

LATER = 1.5
"""Saturation: n/N is read at this many times the stress that moves 30 %."""


def slope(evidence: Evidence) -> Claim:
    """Thresholds of piles and the slope."""
    found = pairs(evidence.piles("pile_threshold"), "alpha_deg", "shields")
    return Claim(
        "Threshold stress of piles increases with the slope",
        "3.2, Figs. 15 and 16",
        by_regime(found, "from one slope to the next steeper, at the same d and n/N"),
        BY_SHARE,
        up(found),
        "Each grain’s own pivot asks for more, cos(α − β), as for one grain; the mean is taken "
        "over the grains that have moved, at the stress each of them feels.",
        ("extended-shields",),
    )


def above_single(evidence: Evidence) -> Claim:
    """Thresholds of piles over that of one grain."""
    table = evidence.piles("pile_threshold")
    ratio = pd.Series(dtype=float) if table.empty else table["shields"] / _one_grain(table)
    found = table.assign(ratio=ratio).dropna(subset=["ratio"])
    silent = len(table) - len(found)
    measured = tuple(
        f"{NAMES[law_name]}: τ over that of one grain (closed form, same slope, d and z₀), median "
        + ", ".join(
            f"{own['ratio'].median():.2f} at n/N = {float(str(part)):.0%} (above 1 in "
            f"{int((own['ratio'] > 1).sum())} of {len(own)})"
            for (part,), own in split(found[found["force_law"] == law_name], "fraction")
        )
        for law_name in NAMES
        if (found["force_law"] == law_name).any()
    )
    return Claim(
        "Piles behave as one grain does, with higher limiting values due to the averaging",
        "3.2, Figs. 15 and 16",
        (*measured, f"{silent} thresholds were not reached") if silent else measured,
        BY_SHARE.replace("comparisons", "thresholds"),
        combined(by_share(part["ratio"] > 1) for _, part in split(found, "force_law")),
        "The grains that go first stand in the strongest stress; by the time the next ones go, the "
        "first feel far more than they need, and the mean over all that have moved rises with n/N. "
        "Near n/N → 0 it is the threshold of one grain.",
        ("extended-shields",),
    )


def _one_grain(table: pd.DataFrame) -> pd.Series:
    found = pd.Series(np.nan, index=table.index)
    for law_name, own in table.groupby("force_law"):
        z0 = own["z0_over_d"] * own["d_m"]
        grains = Exposure(own["d_m"], z0, own["rho_f_kg_m3"], own["nu_m2_s"], own["alpha_s"])
        exact = threshold(
            LAWS[str(law_name)],
            grains,
            density=own["rho_sol_kg_m3"],
            slope_deg=own["alpha_deg"],
            entrainment_angle_deg=own["beta_deg"],
            gravity=own["g_m_s2"],
        )
        found[own.index] = exact.shields
    return found


def roughness(evidence: Evidence) -> Claim:
    """Thresholds of piles and z0."""
    found = pairs(evidence.piles("pile_threshold"), "z0_over_d", "shields")
    return Claim(
        "Higher bed roughness needs higher stress to move the same percentage",
        "3.2, Figs. 14 to 16",
        by_regime(found, "from the smaller z₀ to the larger, at the same d and n/N"),
        BY_SHARE,
        up(found),
        "As for one grain: Eq. 4’s drag falls with z₀, Eq. 2’s grows with the gap δ = z₀.",
        ("extended-shields", "fractions"),
    )


def curves(evidence: Evidence) -> Iterator[pd.DataFrame]:
    """Each pile's load steps in which something had moved, in their order."""
    table = evidence.piles("pile_curve")
    for _, own in split(table, "scene_id"):
        moved = own[own["moved"] > 0].sort_values("load_step")
        if moved["fraction_moved"].nunique() > 2:
            yield moved


def _stress_at(own: pd.DataFrame, fraction: float) -> float:
    """Shields number at which a fraction had moved, between load steps; NaN if not reached."""
    return float(
        np.interp(fraction, own["fraction_moved"], own["shields"], left=np.nan, right=np.nan)
    )


def _fraction_at(own: pd.DataFrame, shields: float) -> float:
    """The fraction that had moved when the mean stress first reached a value."""
    stress = np.maximum.accumulate(own["shields"].to_numpy(float))
    return float(np.interp(shields, stress, own["fraction_moved"].to_numpy(float), left=0.0))


def saturation(evidence: Evidence) -> Claim:
    """How the fraction's rise slows down."""
    rows = [
        own.iloc[[0]].assign(bend=_bend(own), later=_fraction_at(own, LATER * _stress_at(own, 0.3)))
        for own in curves(evidence)
    ]
    found = pd.concat(rows) if rows else evidence.joined("none").assign(bend=[], later=[])
    keep = found.drop(columns=["fraction_moved"], errors="ignore")
    by_size, by_slope = (
        pairs(_ends(keep, along), along, "later") for along in ("d_m", "alpha_deg")
    )
    slows = found["bend"].dropna() < 1
    verdicts = [by_share(slows), *(by_share(p["ratio"].dropna() < 1) for p in (by_size, by_slope))]
    return Claim(
        "n/N saturates smoothly at the highest stresses, especially for larger grains, and at "
        "lower percentages for steeper piles",
        "3.2, Fig. 14",
        () if found.empty else _saturation_measured(found, by_size, by_slope),
        f"reproduced: in at least 95 % of the comparisons the curve is flatter above n/N = 50 % "
        f"than below, and n/N at {LATER:g} times τ₃₀ is lower for the largest grains than for the "
        "smallest and for the steepest pile than for the flattest; not: in at most 5 % each; else "
        "partly",
        "no data" if "no data" in verdicts else combined(verdicts),
        "n/N maps the stress along the face: the foot lies in slow flow, the more so the steeper "
        "the pile. There is a tail, no plateau: the flow is raised until about 90 % have moved, "
        "and they do. Grains of all sizes see nearly the same field; the largest differ by their "
        "larger z₀ and averaging length.",
        ("fractions",),
    )


def _bend(own: pd.DataFrame) -> float:
    """Slope of n/N against tau from 50 to 80 %, over that from 20 to 50 %."""
    low, middle, high = (_stress_at(own, fraction) for fraction in (0.2, 0.5, 0.8))
    return (middle - low) / (high - middle)


def _ends(table: pd.DataFrame, along: str) -> pd.DataFrame:
    """The rows at both ends of a column, for each combination of the others."""
    ends = table.groupby(others(table, along), sort=True, dropna=False)[along]
    return table[(table[along] == ends.transform("min")) | (table[along] == ends.transform("max"))]


def _saturation_measured(
    found: pd.DataFrame, by_size: pd.DataFrame, by_slope: pd.DataFrame
) -> tuple[str, ...]:
    bend = found["bend"].dropna()
    texts = [
        f"slope of n/N against τ from 50 to 80 % over that from 20 to 50 %: {bend.median():.2f} in "
        f"the median ({bend.min():.2f} … {bend.max():.2f}), below 1 in {int((bend < 1).sum())} of "
        f"{len(bend)} piles"
    ]
    for pair, name in (
        (by_size, "largest against smallest d"),
        (by_slope, "steepest against flattest"),
    ):
        ratio = pair["ratio"].dropna()
        if len(ratio):
            texts.append(
                f"n/N at {LATER:g} τ₃₀, {name}: lower in {int((ratio < 1).sum())} of {len(ratio)}, "
                f"by a factor of {ratio.median():.2f} in the median"
            )
    slopes = "; ".join(
        f"{float(str(alpha)):g}°: {own['later'].median():.0%}"
        for (alpha,), own in split(found, "alpha_deg")
    )
    return (*texts, f"n/N at {LATER:g} τ₃₀ by slope, median: {slopes}")


def fraction(evidence: Evidence) -> Claim:
    """The fraction at one stress, by slope."""
    found = {own["scene_id"].iloc[0]: own for own in curves(evidence)}
    firsts = pd.concat([own.iloc[[0]] for own in found.values()]) if found else pd.DataFrame()
    rows = []
    for _, same in split(firsts, *others(firsts, "alpha_deg")):
        ordered = [found[key] for key in same.sort_values("alpha_deg")["scene_id"]]
        for flat, steep in pairwise(ordered):
            rows.append((flat["force_law"].iloc[0], _fraction_at(steep, _stress_at(flat, 0.5))))
    table = pd.DataFrame(rows, columns=["force_law", "steep"])
    return Claim(
        "At the same stress, the fraction of moving grains decreases with the slope",
        "3.2, Figs. 15 and 16",
        tuple(
            f"{NAMES[law_name]}: at the τ that moves 50 % of a pile, the next steeper one has "
            f"{own['steep'].median():.0%} (median; {own['steep'].min():.0%} … "
            f"{own['steep'].max():.0%}), less in {int((own['steep'] < 0.5).sum())} of {len(own)}"
            for law_name in NAMES
            if len(own := table[table["force_law"] == law_name].dropna())
        ),
        BY_SHARE,
        combined(by_share(own["steep"] < 0.5) for _, own in split(table.dropna(), "force_law")),
        "Gravity resists more on the steeper face, and its stress falls off faster from the crest, "
        "so that the mean over the grains that moved is reached by fewer.",
        ("fractions", "extended-shields"),
    )
