"""The paper's claim that its curves of piles have wiggles from counting few grains."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.paper.claims.base import Claim, Evidence, Verdict, by_share, combined
from orchestrator.paper.claims.piles import curves
from orchestrator.report.results import split

FloatArray = NDArray[np.float64]

FINE_M = 5e-4
"""Diameter above which the paper sees wiggles, m."""
STEEP = 0.2
"""Wiggles are sought above this n/N: below it the curve rises too steeply for load steps."""
SMOOTH = np.array([-3, 12, 17, 12, -3]) / 35
"""Weights of five neighbours whose sum is the value of the parabola that fits them best."""
WINDOW = 0.06
"""Part of the face over which the stress is smoothed, to see what its own steps do."""


def wiggles(evidence: Evidence) -> Claim:
    """Roughness of the curves of the fraction."""
    found = _wiggles(evidence)
    coarse = found["d_m"] > FINE_M
    parts = (("d > 0.5 mm", found[coarse]), ("d ≤ 0.5 mm", found[~coarse]))
    return Claim(
        "Wiggles for d > 0.5 mm, ascribed to counting few grains",
        "3.2, Fig. 14",
        tuple(_said(name, own) for name, own in parts if len(own)),
        "wiggle: rms distance of n/N at a load step from the parabola through its five "
        "neighbours, for "
        f"n/N ≥ {STEEP:.0%}; reproduced: in at least 95 % of the piles with d > 0.5 mm it is above "
        "the median of the others, and below one grain, 1/N; not: in at most 5 % each; else partly",
        _judged(*(own for _, own in parts)),
        "Counting: N falls as 1/d, and a pile of 1 mm has a tenth of the grains of one of 0.1 mm. "
        "With a smooth stress that is all, as the paper says. Here small grains have as rough a "
        "curve for another reason: the stress is linear along each face of the flow’s mesh and "
        "jumps at its ends, so that many small grains on one face go together.",
        ("fractions",),
    )


def _wiggles(evidence: Evidence) -> pd.DataFrame:
    """For each pile the wiggle by DEM, by the closed form and by that with a smooth stress."""
    grains = {key: own for (key,), own in split(evidence.piles("pile_grain"), "scene_id")}
    rows = []
    for own in curves(evidence):
        one = own.iloc[0]
        if one["scene_id"] not in grains:
            continue
        stress = grains[one["scene_id"]].sort_values("s_m")["ustar_over_ustar0"].to_numpy(float)
        fractions = (
            own["fraction_moved"].to_numpy(float),
            _pivot(own, stress),
            _pivot(own, _smoothed(stress)),
        )
        rows.append((one["d_m"], *map(_wiggle, fractions), 1 / one["count"]))
    columns = ["d_m", "dem", "pivot", "smooth", "grain"]
    return pd.DataFrame(rows, columns=columns).astype(float).dropna()


def _wiggle(fraction: FloatArray) -> float:
    fraction = fraction[fraction >= STEEP]
    if len(fraction) < len(SMOOTH):
        return float("nan")
    rest = fraction[2:-2] - np.convolve(fraction, SMOOTH, mode="valid")
    return float(np.sqrt(np.mean(rest**2)))


def _pivot(own: pd.DataFrame, stress: FloatArray) -> FloatArray:
    """The fraction at each load step if a grain goes at one local u*, once those above it are gone.

    That u* is set so that half of the grains have moved at the same flow as by DEM.
    """
    flow = own["ustar0_m_s"].to_numpy(float)
    half = np.interp(0.5, own["fraction_moved"].to_numpy(float), flow)
    with np.errstate(divide="ignore", invalid="ignore"):
        need = np.maximum.accumulate(1 / np.maximum(stress, 0)[::-1])
        need = need * half / need[len(need) // 2]
    return np.asarray([np.mean(need <= at) for at in flow])


def _smoothed(stress: FloatArray) -> FloatArray:
    width = 2 * int(WINDOW * len(stress) / 2) + 1
    padded = np.pad(stress, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1 / width), mode="valid")


def _said(name: str, own: pd.DataFrame) -> str:
    dem, pivot, smooth, grain = (own[c].median() for c in ("dem", "pivot", "smooth", "grain"))
    return (
        f"{name}: n/N departs from a smooth curve by {dem:.2%} (rms, median of {len(own)} piles), "
        f"which is {(own['dem'] / own['grain']).median():.2f} grains of {grain:.2%}; the closed "
        f"form with each grain’s own stress gives {pivot:.2%}, and {smooth:.2%} with that stress "
        f"smoothed over {WINDOW:.0%} of the face"
    )


def _judged(coarse: pd.DataFrame, fine: pd.DataFrame) -> Verdict:
    if coarse.empty or fine.empty:
        return "no data"
    rougher = by_share(coarse["dem"] > fine["dem"].median())
    return combined([rougher, by_share(coarse["dem"] < coarse["grain"])])
