"""Results of the ladder's points: errors against the dearest levels, the front, known errors."""

import math
from collections.abc import Hashable, Iterator
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.experiments.ladder.pairs import (
    AGAIN,
    BESIDE,
    FINER,
    LEVEL_AGAIN,
    LEVEL_REFERENCE,
    REFERENCE,
)
from orchestrator.fidelity import calibration
from orchestrator.fidelity.levels import Part
from orchestrator.report.results import split

Row = dict[str, Any]
REFERENCES = ((REFERENCE, AGAIN), (LEVEL_REFERENCE, LEVEL_AGAIN), ((REFERENCE[0], BESIDE), FINER))
"""The dearest pair of a scene, the first of these that it has, and one as good."""
ERRORS = ("error_10", "error_30", "error_50", "error_70", "error_curve")
TAU, CURVE = "tau_", "curve_"
"""Beginnings of the columns of thresholds: at the asked fractions, and along the curve."""


def errors(found: pd.DataFrame) -> pd.DataFrame:
    """The points with their relative errors against the dearest pair that their scene has.

    For scenes without DEM that is the dearest flow, by peeling. `reference_error` is how far the
    reference itself moved when all of its numbers were changed.
    """
    parts = [_against(own) for _, own in found.groupby("scene_id", sort=False)]
    return pd.concat(parts, ignore_index=True)


def _columns(table: pd.DataFrame, start: str) -> list[str]:
    return [str(name) for name in table.columns if str(name).startswith(start)]


def _against(own: pd.DataFrame) -> pd.DataFrame:
    pairs = list(zip(own["flow_level"], own["grain_level"], strict=True))
    by_pair = dict(zip(pairs, own.index, strict=True))
    dearest, again = next((one for one in REFERENCES if one[0] in by_pair), REFERENCES[0])
    if dearest not in by_pair:
        return own.iloc[:0]
    taus, curve = _columns(own, TAU), _columns(own, CURVE)
    relative = own[[*taus, *curve]].astype(float)
    relative = relative / relative.loc[by_pair[dearest]] - 1
    unsure = relative.loc[by_pair[again], taus].abs().max() if again in by_pair else math.nan
    named = {f"error_{round(100 * float(name[len(TAU) :]))}": relative[name] for name in taus}
    return own.assign(
        **named,
        error_curve=relative[curve].abs().mean(axis=1),
        cost_core_s=own["flow_s"] + own["grains_s"],
        reference_error=unsure,
    )


def with_front(table: pd.DataFrame) -> pd.DataFrame:
    """Mark the pairs that no other of their packing beats in both cost and error.

    A pair counts with its mean cost and its largest error over the scenes.
    """
    worst = table.filter(regex=r"^error_\d+$").abs().max(axis=1, skipna=False)
    rows = table.assign(worst=worst)[table["same_model"] & (table["asked"] == "dem")]
    front: set[tuple[Hashable, ...]] = set()
    for (packing,), own in split(rows, "packing"):
        pairs = own.groupby(["flow_level", "grain_level"])
        both = pairs.agg({"cost_core_s": "mean", "worst": _largest})
        names = both[_undominated(both.to_numpy(float))].index
        front |= {(packing, *name) for name in names}
    columns = (table[name] for name in ("packing", "flow_level", "grain_level"))
    return table.assign(pareto=[key in front for key in zip(*columns, strict=True)])


def together(points: pd.DataFrame) -> pd.DataFrame:
    """One row for each pair and packing: the mean cost, the largest errors with their signs."""
    groups = points.groupby(["packing", "flow_level", "grain_level"], sort=False)
    table = groups[list(ERRORS)].agg(_worst)
    table = table.assign(
        piles=groups.size(),
        cost_core_s=groups["cost_core_s"].mean(),
        reference_error=groups["reference_error"].max(),
        model_floor=groups["model_floor"].min(),
        same_model=groups["same_model"].first(),
        pareto=groups["pareto"].first(),
    )
    return table.reset_index()


def _worst(values: pd.Series) -> float:
    """The value of the largest size; NaN where a fraction was not reached in one of the scenes."""
    return math.nan if values.isna().any() else float(max(values, key=abs))


def _largest(values: pd.Series) -> float:
    """With a NaN among them it is NaN: a fraction was not reached."""
    return float(values.max(skipna=False))


def _undominated(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.array(
        [
            np.isfinite(one).all()
            and not any((other <= one).all() and (other < one).any() for other in values)
            for one in values
        ],
        dtype=bool,
    )


def known(found: pd.DataFrame) -> pd.DataFrame:
    """Known error of each level, by class of scene and fraction; `calibration` reads it.

    The error is the largest over the scenes, infinite where one of the two did not reach the
    fraction; the uncertainty is how far the reference itself moved on scenes of that class.
    """
    level = found["class_flow"] == calibration.LEVEL
    beside = level.map({True: LEVEL_REFERENCE[0], False: REFERENCE[0]})
    grains = found[(found["flow_level"] == beside) & (found["asked"] == "dem")]
    flow = found[(found["grain_level"] == BESIDE) & found["same_model"]]
    rows = [
        *_known("grains", "grain_level", grains, REFERENCE[1], AGAIN[1]),
        *_known("flow", "flow_level", flow, REFERENCE[0], FINER[0]),
    ]
    return pd.DataFrame(rows).sort_values(["part", "level", "scene_class", "fraction"])


def _known(part: Part, name: str, table: pd.DataFrame, dearest: str, again: str) -> Iterator[Row]:
    for scene_class, alike in table.groupby(f"class_{part}", sort=True):
        by_level = {level: rows.set_index("scene_id") for level, rows in alike.groupby(name)}
        # without the reference nothing is known of the others
        for level, rows in by_level.items() if dearest in by_level else ():
            for column in _columns(table, TAU):
                # a flow that is finer still is run on small piles alone; other grains on every one
                uncertainty = 0.0 if part == "flow" else math.inf
                if again in by_level:
                    uncertainty = _shift(by_level[again], by_level[dearest], column)
                yield {
                    "part": part,
                    "level": level,
                    "scene_class": scene_class,
                    "fraction": float(column[len(TAU) :]),
                    "error": _shift(rows, by_level[dearest], column),
                    "uncertainty": uncertainty,
                    "cost_core_s": float(rows[f"{part}_s"].mean()),
                    "scenes": len(rows),
                }


def _shift(own: pd.DataFrame, reference: pd.DataFrame, column: str) -> float:
    """The largest relative difference over the scenes that both have; infinite if there is none."""
    both = own.index.intersection(reference.index)
    if both.empty:
        return math.inf
    value, base = own.loc[both, column], reference.loc[both, column]
    # where neither reaches the fraction they agree; where one does, they could not differ more
    apart = (value / base - 1).abs().fillna(math.inf).where(value.notna() | base.notna(), 0.0)
    return float(apart.max())
