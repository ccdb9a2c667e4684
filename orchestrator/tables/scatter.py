"""The scatter of a pile's threshold over packings that differ in their seed alone."""

import pandas as pd

from orchestrator.study import fields

SIMILAR = ["level", "lifted", "alpha_deg", "force_law", "fraction"]
"""Piles that agree in these are taken to scatter alike: rows are level, or lie along the slope;
lift carries grains off, which then collide, or it does not."""


def with_scatter(thresholds: pd.DataFrame, scenes: pd.DataFrame) -> pd.DataFrame:
    """Add the scatter over seeds to the thresholds of piles, and widen their intervals by it.

    Half the range over the seeds, relative to their mean, is found for each set of piles that
    differ in the seed alone: random gaps, or perturbed replicas of a lattice, which differ by
    round-off. A pile gets the largest one of the same rows, slope, force law and fraction, of piles
    that lift off or that do not; where the study ran no seeds, none, and its interval stays.
    """
    if thresholds.empty:
        return thresholds
    of_scene = scenes.drop_duplicates("scene_id").set_index("scene_id")
    ids = thresholds["scene_id"]
    table = thresholds.assign(
        level=ids.map(of_scene["packing"]) == "horizontal",
        lifted=thresholds["share_carried_off"] > 0,
        replicas=ids.map(_twins(of_scene)),
    )
    table = table.merge(_scatter(table), on=SIMILAR, how="left", validate="many_to_one")
    wider = table["scatter"].fillna(0.0)
    return table.drop(columns=["level", "lifted", "replicas"]).assign(
        shields_low=table["shields_low"] * (1 - wider),
        shields_high=table["shields_high"] * (1 + wider),
    )


def _twins(scenes: pd.DataFrame) -> pd.Series:
    """A number that scenes share which differ in the seed alone."""
    return scenes.groupby(fields.others(scenes, "seed"), dropna=False).ngroup()


def _scatter(table: pd.DataFrame) -> pd.DataFrame:
    known = table[table["shields"].notna()]
    groups = known.groupby([*SIMILAR, "replicas"])["shields"]
    spread = (groups.max() - groups.min()) / 2 / groups.mean()
    # one seed has no range
    spread = spread[groups.count() > 1].rename("scatter")
    return spread.groupby(level=SIMILAR).max().reset_index()
