"""The scatter of a pile's threshold over packings that differ in their disorder alone."""

import pandas as pd

SIMILAR = ["alpha_deg", "closure", "fraction"]
"""Piles that agree in these are taken to scatter alike."""


def with_scatter(thresholds: pd.DataFrame, scenes: pd.DataFrame) -> pd.DataFrame:
    """Add the scatter over seeds to the thresholds of piles, and widen their intervals by it.

    Half the range over the seeds, relative to their mean, is found for each set of disordered
    piles that differ in the seed alone. A pile gets the largest one of the same slope, closure and
    fraction; where the study ran no seeds, none, and its interval stays as it is.
    """
    if thresholds.empty:
        return thresholds
    found = _scatter(thresholds, scenes)
    table = thresholds.merge(found, on=SIMILAR, how="left", validate="many_to_one")
    wider = table["scatter"].fillna(0.0)
    return table.assign(
        shields_low=table["shields_low"] * (1 - wider),
        shields_high=table["shields_high"] * (1 + wider),
    )


def _scatter(thresholds: pd.DataFrame, scenes: pd.DataFrame) -> pd.DataFrame:
    of_scene = scenes.drop_duplicates("scene_id")[["scene_id", "seed", "disorder"]]
    table = thresholds.merge(of_scene, on="scene_id", validate="many_to_one")
    seeds = table[table["seed"].notna() & table["shields"].notna()]
    alike = [*SIMILAR, "d_m", "z0_over_d", "nu_m2_s", "stress", "disorder"]
    groups = seeds.groupby(alike, sort=True)["shields"]
    spread = (groups.max() - groups.min()) / 2 / groups.mean()
    # one seed has no range
    spread = spread[groups.count() > 1].rename("scatter")
    return spread.groupby(level=SIMILAR).max().reset_index()
