"""Answers without DEM beside those of DEM: where the two contradict each other."""

import math
from collections.abc import Mapping

import pandas as pd

from orchestrator.tables.columns import several
from orchestrator.tables.quoted import OF_PILE

KEYS = ["scene_id", "fraction"]
Contradictions = dict[tuple[str, float], str]
"""By the scene and the fraction, what DEM says against an answer."""


AGREEMENT: Mapping[str, str] = {
    **several("shields_numerical_low", "shields_numerical_high"),
    "agree": (
        "whether the interval of shields, which holds the numerical error, and that of "
        "DEM overlap"
    ),
}
"""Columns that `with_agreement` adds."""


def with_agreement(checks: pd.DataFrame, thresholds: pd.DataFrame) -> pd.DataFrame:
    """Add the intervals of the answers to the checks, and whether the two overlap.

    Parameters
    ----------
    checks
        A row for each pile and fraction that DEM checks, with ``shields_dem_low`` and
        ``shields_dem_high``.
    thresholds
        The answers with their numerical intervals, which hold the numerical error of
        the fidelity.

    Returns
    -------
    DataFrame
        The checks with these two columns and with ``agree``. An end that is not known
        is open. Two answers agree also where neither reaches the fraction.
    """
    if checks.empty:
        return checks
    answers = thresholds[[*KEYS, *OF_PILE]].drop_duplicates(KEYS)
    table = checks.merge(answers, on=KEYS, how="left", validate="many_to_one")
    low, high = OF_PILE
    lower = table[[low, "shields_dem_low"]].fillna(0.0).max(axis=1)
    upper = table[[high, "shields_dem_high"]].fillna(float("inf")).min(axis=1)
    is_reached = table["shields"].notna()
    is_reached_by_dem = table["shields_dem"].notna()
    overlap = (lower <= upper) & is_reached & is_reached_by_dem
    neither = ~is_reached & ~is_reached_by_dem
    return table.assign(agree=overlap | neither)


def contradictions(checks: pd.DataFrame) -> Contradictions:
    """Say what DEM has against each answer that it contradicts.

    Parameters
    ----------
    checks
        The checks, by `with_agreement`.

    Returns
    -------
    dict
        A sentence for each scene and fraction.
    """
    if checks.empty:
        return {}
    found: Contradictions = {}
    for row in checks[~checks["agree"]].to_dict("records"):
        here = _told(row["shields"], *(row[name] for name in OF_PILE))
        dem = _told(row["shields_dem"], row["shields_dem_low"], row["shields_dem_high"])
        sentence = f"DEM of this bed contradicts it: it has {dem}, this has {here}"
        found[row["scene_id"], row["fraction"]] = sentence
    return found


def _told(value: float, low: float, high: float) -> str:
    """A Shields number with its interval, in words."""
    if math.isnan(value):
        return "not reached the fraction"
    return f"{value:.3g} ({_end(low)} … {_end(high)})"


def _end(value: float) -> str:
    """An end of an interval; NaN is open."""
    return "open" if math.isnan(value) else f"{value:.3g}"
