"""Ratios of thresholds of beds with shelter to those of the same beds without it.

Both beds have the same grains, forces, meshes and seeds. What is wrong with both in the
same proportion has no effect on their ratio: it has its own, paired interval.
"""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from orchestrator.physics.reported import REPORTED, in_units
from orchestrator.physics.verdict import codes_of
from orchestrator.study import fields
from orchestrator.tables.columns import several
from orchestrator.tables.facts import needs_run
from orchestrator.tables.usable import ABOVE_TOLERANCE
from orchestrator.types import FloatArray, Row

SHELTER = ("obstacles", "spacing", "forms")
"""Columns of what shelters a bed."""
CANCELS = {"error not known", ABOVE_TOLERANCE}
"""Reasons against a threshold that are of its numerical error: both beds share it."""
SAME = 1e-9
"""Relative difference up to which two flows are one."""
STEMS = {"ustar0": "friction velocity", "stress": "bed shear stress"}
STEMS |= {"wind_10m": "wind at 10 m", "mean_velocity": "mean velocity"}
"""Quantities whose ratios are given."""
ENDS = ("", "_low", "_high")
PAIRED: Mapping[str, str] = {
    **several("scene_id"),
    "without_id": (
        "scene of the same bed without obstacles, of trains that with the widest "
        "spacing"
    ),
    **several("fraction"),
    "pairs": "number of pairs of beds that differ in their seed alone",
    "ratio_usable": (
        "whether nothing speaks against either threshold but its numerical error, "
        "which is taken to be the same in both"
    ),
    **{
        f"{stem}_ratio": f"{name} at the threshold over that without shelter, of "
        "several pairs the mean of their logarithms"
        for stem, name in STEMS.items()
    },
    **{
        f"{stem}_ratio_low": f"lower end of the paired interval of {stem}_ratio: one "
        "grain and one load step more or less in each bed, of all pairs"
        for stem in STEMS
    },
    **{
        f"{stem}_ratio_high": f"upper end of the paired interval of {stem}_ratio"
        for stem in STEMS
    },
}
"""Columns of `paired`."""


def paired(
    thresholds: pd.DataFrame, curves: pd.DataFrame, scenes: pd.DataFrame
) -> pd.DataFrame:
    """Find the ratio of each threshold with shelter to that of its bed without.

    Parameters
    ----------
    thresholds
        Those of piles, with their verdicts.
    curves
        The fraction that has moved at each flow.
    scenes
        Their scenes with their methods, each once.

    Returns
    -------
    DataFrame
        A row for each threshold and each first motion that has such a bed.
    """
    if thresholds.empty:
        return pd.DataFrame()
    lacking = scenes.columns.difference(thresholds.columns, sort=False)
    rows = thresholds.merge(
        scenes[["scene_id", *lacking]], on="scene_id", validate="many_to_one"
    )
    if not _has_shelter(rows):
        return pd.DataFrame()
    of_scene = {str(name): part for name, part in curves.groupby("scene_id")}
    found = pd.DataFrame(_pairs(rows, of_scene))
    if found.empty:
        return found
    # the first motion is that of every fraction
    return _of_seeds(found.drop_duplicates(["scene_id", "without_id", "fraction"]))


def _has_shelter(beds: pd.DataFrame) -> bool:
    """Whether beds differ in what shelters them; single grains have none."""
    return any(beds[name].nunique(dropna=False) > 1 for name in SHELTER)


def _pairs(rows: pd.DataFrame, curves: Mapping[str, pd.DataFrame]) -> Iterator[Row]:
    """The ratios of each pair by itself, with a number that replicates share."""
    keys = [*fields.others(rows, *SHELTER), "fraction"]
    every = fields.others(rows, "seed")
    kinds = rows.groupby(every, dropna=False).ngroup()
    rows = rows.assign(kind=kinds, stepped=needs_run(rows))
    for _, part in rows.groupby(keys, dropna=False, sort=False):
        is_bare = part["obstacles"].fillna("").astype(str).eq("")
        by = part.assign(bare=is_bare).sort_values(
            ["bare", "spacing"], ascending=False, kind="stable"
        )
        without = by.iloc[0]
        if not without["bare"]:
            continue
        for _, row in by.iloc[1:].iterrows():
            yield _pair(row, without, curves, "")
            yield _pair(row, without, curves, "first_")


def _pair(
    row: pd.Series, without: pd.Series, curves: Mapping[str, pd.DataFrame], which: str
) -> Row:
    """The ratio of two thresholds, or of the first motions of their beds."""
    ends = [
        _ends(each, curves[str(each["scene_id"])], which) for each in (row, without)
    ]
    made: Row = {
        "scene_id": row["scene_id"],
        "without_id": without["scene_id"],
        "fraction": np.nan if which else row["fraction"],
        "kind": row["kind"],
        "ratio_usable": all(map(_is_usable, (row, without))),
    }
    # the least of one over the most of the other
    for end, of_row, of_without in zip(ENDS, (0, 1, 2), (0, 2, 1), strict=True):
        above = in_units(ends[0][of_row], row)
        below = in_units(ends[1][of_without], without)
        for stem in STEMS:
            name = f"{stem}{REPORTED[stem]}"
            made[f"{stem}_ratio{end}"] = float(above[name]) / float(below[name])
    return made


def _is_usable(row: pd.Series) -> bool:
    """Whether nothing but its numerical error speaks against a threshold."""
    return codes_of(row["reason"]) <= CANCELS


def _ends(row: pd.Series, curve: pd.DataFrame, which: str) -> FloatArray:
    """A threshold and its ends by one grain and one load step, friction velocities."""
    value = float(row[f"{which}ustar0_m_s"])
    needed = 1 if which else int(np.ceil(row["fraction"] * row["count"] - 1e-9))
    curve = curve.sort_values("ustar0_m_s", kind="stable")
    flows = curve["ustar0_m_s"].to_numpy(float)
    moved = curve["moved"].to_numpy(float)
    low = high = value
    before = np.flatnonzero(moved >= max(needed - 1, 1))
    if len(before) and (needed > 1 or row["stepped"]):
        low = flows[max(int(before[0]) - 1, 0)]
    # grains that go at the same flow are one step
    after = np.flatnonzero((moved >= needed + 1) & (flows > value * (1 + SAME)))
    if len(after):
        high = flows[int(after[0])]
    return np.array([value, min(low, value), max(high, value)])


def _of_seeds(found: pd.DataFrame) -> pd.DataFrame:
    """Pairs whose ratio and interval are those of all replicates."""
    groups = found.groupby(["kind", "fraction"], dropna=False)
    made: dict[str, pd.Series] = {"pairs": groups["scene_id"].transform("size")}
    made["ratio_usable"] = groups["ratio_usable"].transform("all")
    for stem in STEMS:
        name = f"{stem}_ratio"
        logs = np.log(found[name])
        mean = logs.groupby([found["kind"], found["fraction"]], dropna=False)
        made[name] = np.exp(mean.transform("mean"))
        made[f"{name}_low"] = groups[f"{name}_low"].transform("min")
        made[f"{name}_high"] = groups[f"{name}_high"].transform("max")
    return found.assign(**made)[[*PAIRED]]
