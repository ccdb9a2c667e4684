"""The rows of answers without DEM beside those of DEM."""

from collections.abc import Container, Iterator, Mapping
from pathlib import Path

from orchestrator.plan import Plan
from orchestrator.tables.columns import phrases, several
from orchestrator.tables.quantities import POINT, point, shields
from orchestrator.types import Row

CHECK: Mapping[str, str] = {
    **several("scene_id"),
    **phrases(*POINT),
    **phrases("packing"),
    **several(
        "fraction", "shields", "shields_dem", "shields_dem_low", "shields_dem_high"
    ),
    "difference": "shields over shields_dem, less 1",
    **several("case"),
}
"""Columns of `check_rows`."""


def check_rows(plan: Plan, cases: Path, done: Container[str]) -> Iterator[Row]:
    """Compare piles with DEM of the same, where both are run.

    Parameters
    ----------
    plan
        The plan of the study.
    cases
        The directory of the cases.
    done
        Names of the cases that are done.

    Yields
    ------
    dict
        A row for each pile and fraction.
    """
    for asked, dem in plan.checks.items():
        pile = plan.piles[asked]
        if not (pile.is_run(done) and dem.is_run(done)):
            continue
        scene = pile.scene
        fractions = scene.threshold.fractions
        found = pile.thresholds(cases, fractions)
        by_dem = dem.thresholds(cases, fractions)
        for ours, theirs in zip(found, by_dem, strict=True):
            yield {
                "scene_id": asked,
                **point(scene),
                "packing": dem.bed.packing,
                "fraction": ours.fraction,
                "shields": shields(scene, ours.tau),
                "shields_dem": shields(scene, theirs.tau),
                "shields_dem_low": shields(scene, theirs.tau_low),
                "shields_dem_high": shields(scene, theirs.tau_high),
                "difference": ours.tau / theirs.tau - 1,
                "case": dem.case.name,
            }
