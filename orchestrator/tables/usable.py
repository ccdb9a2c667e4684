"""Whether a threshold may be used, and why not: judged at the Re* of the answer itself."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.flow.case import SPEED_HEIGHT
from orchestrator.physics.force_law import Exposure
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import standing_out, why_not
from orchestrator.study.study import Study

SMOOTH_BELOW = 5 / 30
"""u* z0/nu below which a bed is hydraulically smooth: u* k_s/nu = 5 with k_s = 30 z0 (Nikuradse,
VDI Forschungsheft 361, 1933)."""
TURBULENT_FROM = 2000.0
"""Speed times depth over nu from which a flow is turbulent: of a channel its mean speed and depth,
of a boundary layer U_e and the 10 h at which it is given."""
EXPOSED_FROM = 0.25
"""Part of a grain over the tops of its neighbours from which it is an exposed one."""
CARRIED_OFF = 0.1
"""Share of the moved grains from which a threshold is one of lift-off."""
ROW_HOLD = 1.05
"""u*_0 at which the first grain leaves, over that of the first grain by itself, from which a row
is held by its neighbours."""
Reason = tuple[NDArray[np.bool_], list[str]]
"""Which rows it is true of, and what it says of each row."""


def with_usable(table: pd.DataFrame, scenes: pd.DataFrame, study: Study) -> pd.DataFrame:
    """Add the columns ``usable`` and ``why_not`` to thresholds of piles or of single grains.

    Parameters
    ----------
    table : DataFrame
        Thresholds, with ``reynolds`` at the threshold.
    scenes : DataFrame
        The scenes by their id.
    study : Study
        Whose tolerance the known errors are held against.
    """
    if table.empty:
        return table
    columns = [name for name in scenes if name not in table or name == "scene_id"]
    rows = table.merge(scenes.drop_duplicates("scene_id")[columns], on="scene_id", how="left")
    found = _reasons(rows, study.tolerance)
    said: list[list[str]] = [[] for _ in range(len(rows))]
    for true, texts in found:
        for index in np.flatnonzero(true):
            said[index].append(texts[index])
    why = ["; ".join(one) for one in said]
    return table.assign(usable=[not one for one in why], why_not=why)


def _reasons(rows: pd.DataFrame, tolerance: float | None) -> Iterator[Reason]:
    reynolds = rows["reynolds"]
    if "answered_method" in rows and "reynolds_closed_form" in rows:
        reynolds = reynolds.where(rows["answered_method"] == "dem", rows["reynolds_closed_form"])
    reached = reynolds.notna().to_numpy()
    counted = rows[[name for name in ("highest_fraction", "count") if name in rows]]
    yield ~reached, [_unreached(row) for row in counted.to_dict("records")]
    ustar = (reynolds * rows["nu_m2_s"] / rows["d_m"]).to_numpy(float)
    yield from ((true & reached, texts) for true, texts in _law(rows, ustar))
    yield _hidden(rows)
    if "share_carried_off" in rows:
        yield _smooth(rows, ustar)
        yield _laminar(rows)
        share = rows["share_carried_off"].to_numpy(float)
        yield (
            share > CARRIED_OFF,
            [f"lift carried off {one:.0%} of the moved grains" for one in share],
        )
        yield from _inexact(rows["error_estimate"].to_numpy(float), tolerance)
        yield from _grains(rows)


def _unreached(row: Mapping[object, object]) -> str:
    if "highest_fraction" not in row:
        return "the grain did not move in any load step"
    return f"not reached: at most {row['highest_fraction']:.0%} of {row['count']} grains moved"


def _law(rows: pd.DataFrame, ustar: NDArray[np.float64]) -> Iterator[Reason]:
    """The ranges of each row's force law, with the rows beyond them."""
    for name in sorted(set(rows["force_law"])):
        own = (rows["force_law"] == name).to_numpy()
        d = rows["d_m"].to_numpy(float)
        z0 = rows["z0_over_d"].to_numpy(float) * d
        law = LAWS[name]
        exposure = Exposure(d, z0, *(rows[c] for c in ("rho_f_kg_m3", "nu_m2_s", "alpha_s")))
        of_grain = (("density", "rho_sol_kg_m3"), ("slope_deg", "alpha_deg"), ("gravity", "g_m_s2"))
        single = "share_carried_off" not in rows
        weights = {key: rows[column].to_numpy(float) for key, column in of_grain if single}
        if law.unverified:
            yield own, [f"unverified force law: {law.unverified}"] * len(rows)
        texts = why_not(law, ustar, exposure, **weights)
        yield own & (np.array(texts) != ""), texts


def _smooth(rows: pd.DataFrame, ustar: NDArray[np.float64]) -> Reason:
    """The flow of a pile is over a rough bed; a smooth one has another z0."""
    number = (ustar * rows["z0_over_d"] * rows["d_m"] / rows["nu_m2_s"]).to_numpy(float)
    texts = [
        f"hydraulically smooth bed: u* z0/nu {n:.2g} is below {SMOOTH_BELOW:.2g}" for n in number
    ]
    return number < SMOOTH_BELOW, texts


def _laminar(rows: pd.DataFrame) -> Reason:
    """The flow of a pile is a turbulent one; a laminar one has another stress and mean speed."""
    speed, height = rows["u_e_m_s"], SPEED_HEIGHT * rows["h_m"]
    if "depth_m" in rows and "mean_speed_m_s" in rows:
        speed = rows["mean_speed_m_s"].fillna(speed)
        height = rows["depth_m"].fillna(height)
    number = (speed * height / rows["nu_m2_s"]).to_numpy(float)
    texts = [
        f"laminar flow: speed times depth over nu, {n:.0f}, is below {TURBULENT_FROM:g}"
        for n in number
    ]
    return number < TURBULENT_FROM, texts


def _hidden(rows: pd.DataFrame) -> Reason:
    """A small grain lies lower than its neighbours' tops, and the laws are of exposed grains."""
    part = standing_out(rows["relative_size"], rows["beta_deg"])
    texts = [f"hidden grain: {p:.0%} of it stands out of its neighbours" for p in part]
    return part < EXPOSED_FROM, texts


def _inexact(error: NDArray[np.float64], tolerance: float | None) -> Iterator[Reason]:
    """Levels whose error is not known, or known to be above the tolerance."""
    text = "no interval: the error of its levels on such a pile is not known"
    yield np.isnan(error), [text] * len(error)
    if tolerance:
        texts = [
            f"known error {one:.1%} is above the tolerance of {tolerance:.3g}" for one in error
        ]
        yield error > tolerance * (1 + 1e-9), texts


def _grains(rows: pd.DataFrame) -> Iterator[Reason]:
    """Fractions of less than one grain, and rows that their neighbours hold."""
    fraction, count = (rows[name].to_numpy(float) for name in ("fraction", "count"))
    texts = [
        f"{at:.3g} of {n:.0f} grains is less than one"
        for at, n in zip(fraction, count, strict=True)
    ]
    yield fraction * count < 1 - 1e-9, texts
    if "row_hold" in rows:
        held = rows["row_hold"].to_numpy(float)
        texts = [
            f"the row has no end: its neighbours hold the first grain up to {hold:.2g} times the "
            "u* of a single one"
            for hold in held
        ]
        yield held > ROW_HOLD, texts
