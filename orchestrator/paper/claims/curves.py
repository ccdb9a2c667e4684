"""The paper's claim of a best fit to Shields: single grains against published curves."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.paper.claims.base import BRIDGED, NAMES, Claim, Evidence, Verdict, combined
from orchestrator.physics import curves
from orchestrator.report import labels, reference
from orchestrator.report.results import split

FloatArray = NDArray[np.float64]
Lines = Mapping[str, tuple[FloatArray, FloatArray]]

FITTED = {**NAMES, BRIDGED: "bridged"}
"""The laws that are judged, and their names in sentences."""
POINTS = 60
"""Re*, evenly spaced in its logarithm, at which a series is compared with the curves."""
BETA = (50.0, 55.0)
Z0_OVER_D = 1 / 30
GOOD = 1.25
"""Mean factor from the curves up to which a fit is called good."""
COLUMNS = (
    "force_law",
    "beta_deg",
    "z0_over_d",
    "factor",
    "bias",
    "worst",
    "worst_at",
    "first",
    "last",
)
"""A series: its mean factor from the curves, with and without sign, the largest and its Re*."""


def best_fit(evidence: Evidence) -> Claim:
    """Single grains on a flat bed against the curves for water, and for air."""
    grains = pd.concat([evidence.held, evidence.bridged])
    flat = grains[(grains["alpha_deg"] == 0) & grains["shields_dem"].notna()].astype(
        {"reynolds": float, "shields_dem": float}
    )
    tables = {name: _distances(flat, lines) for name, lines in _families(evidence, flat).items()}
    return _judged_fit(tables)


def _families(evidence: Evidence, flat: pd.DataFrame) -> dict[str, Lines]:
    if flat.empty:
        return {}
    air = reference.air_lines(evidence.scenes)
    return {
        "water": {curve.name: curve.points(2000) for curve in curves.WATER},
        **({"air": air} if air else {}),
    }


def _distances(flat: pd.DataFrame, lines: Lines) -> pd.DataFrame:
    """Mean factor, its sign and the range of Re* of each series, by law."""
    rows = []
    for law_name in FITTED:
        part = flat[flat["force_law"] == law_name]
        series = [own for _, own in split(part, "beta_deg", "z0_over_d") if len(own) > 1]
        grid = _common(series)
        for own in series if len(grid) else ():
            rows.append((law_name, *_distance(own.sort_values("reynolds"), grid, lines)))
    return pd.DataFrame(rows, columns=list(COLUMNS)).dropna().sort_values("factor", kind="stable")


def _common(series: list[pd.DataFrame]) -> FloatArray:
    """Re* that all series cover."""
    low = max((own["reynolds"].min() for own in series), default=1.0)
    high = min((own["reynolds"].max() for own in series), default=0.0)
    return np.geomspace(low, high, POINTS) if low < high else np.array([])


def _distance(own: pd.DataFrame, grid: FloatArray, lines: Lines) -> tuple[float, ...]:
    tau = _read(own["reynolds"].to_numpy(), own["shields_dem"].to_numpy(), grid)
    table = np.array([_read(x, y, grid) for x, y in lines.values()])
    covered = np.isfinite(table).any(axis=0)
    one = own.iloc[0]
    where = (float(one["beta_deg"]), float(one["z0_over_d"]))
    if not covered.any():
        return (*where, *(np.nan,) * 6)
    away, at = tau[covered] - np.nanmean(table[:, covered], axis=0), grid[covered]
    worst = int(np.abs(away).argmax())
    factors = (float(np.exp(x)) for x in (np.abs(away).mean(), away.mean(), away[worst]))
    return (*where, *factors, float(at[worst]), float(at[0]), float(at[-1]))


def _read(x: FloatArray, y: FloatArray, grid: FloatArray) -> FloatArray:
    """Logarithm of a line at some Re*; NaN beyond its ends."""
    order = np.argsort(x, kind="stable")
    logs = np.log(grid), np.log(x[order]), np.log(y[order])
    return np.asarray(np.interp(*logs, left=np.nan, right=np.nan))


def _judged_fit(tables: Mapping[str, pd.DataFrame]) -> Claim:
    measured = []
    verdicts: dict[str, Verdict] = {}
    for family, table in tables.items():
        for law_name in FITTED:
            own = table[table["force_law"] == law_name]
            if len(own):
                measured.append(_said(family, law_name, own))
                if family == "water":
                    verdicts[law_name] = _judged(own)
    return Claim(
        "Best fit with Shields’ laboratory results: β from 50° to 55° and z₀ ≈ d/30, for small and "
        "for large Re*",
        "3.1, Fig. 6",
        ("off by: mean factor from the curves (mean of τ over theirs; the worst one)", *measured)
        if measured
        else (),
        "in each regime, and by the bridged law where the study has it, against the mean of the "
        "logarithms of the water curves that cover an Re*: reproduced if the best of the study’s β "
        f"and z₀ is one of those named and within a factor {GOOD:g} in the mean; not if neither; "
        "partly if one, or if these differ",
        combined(verdicts.values()) if verdicts.keys() >= NAMES.keys() else "no data",
        "Eq. 3 tends to a constant for Re* → 0, where the curves of water go on rising: no β fits "
        "both ends; the bridged law is Eq. 2 there. And the grains are in air, the curves of "
        "water; against those of air, listed for comparison, the high regime lies far above (their "
        "thresholds are lower in Shields’ terms, and cohesion is in those of small grains).",
        ("dem-horizontal",),
    )


def _judged(own: pd.DataFrame) -> Verdict:
    best = own.iloc[0]
    named = BETA[0] <= best["beta_deg"] <= BETA[1] and _is_named(best["z0_over_d"])
    good = best["factor"] <= GOOD
    return "reproduced" if named and good else "partly" if named or good else "not"


def _is_named(ratio: float) -> bool:
    return abs(ratio / Z0_OVER_D - 1) < 1e-3


def _said(family: str, law_name: str, own: pd.DataFrame) -> str:
    best = own.iloc[0]
    named = own[own["beta_deg"].between(*BETA) & own["z0_over_d"].map(_is_named)]
    rest = [_fit(row) for at, row in named.sort_values("beta_deg").iterrows() if at != best.name]
    return (
        f"{family}, {FITTED[law_name]}, Re* = {best['first']:.2g} … {best['last']:.3g}: best "
        + "; ".join([_fit(best), *rest])
    )


def _fit(row: pd.Series) -> str:
    worst = f"{row['worst']:.2f} at Re* = {_round(row['worst_at'])}"
    return (
        f"β = {row['beta_deg']:g}°, {labels.ratio_of(row['z0_over_d'], 'd')}: off by "
        f"{row['factor']:.2f} ({row['bias']:.2f}; {worst})"
    )


def _round(reynolds: float) -> str:
    return f"{reynolds:.0f}" if reynolds >= 10 else f"{reynolds:.2g}"
