"""The rows of single grains, in closed form and by DEM."""

from collections.abc import Iterable, Iterator, Mapping
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from orchestrator.grains import threshold
from orchestrator.grains.cells import SingleGrainCase
from orchestrator.grains.motion import Motion
from orchestrator.plan import Plan
from orchestrator.study.closed_form import closed_form
from orchestrator.study.criterion import SUSTAINED, of_single_grain
from orchestrator.tables.columns import phrases, several
from orchestrator.tables.quantities import ALONE, POINT, point, speeds
from orchestrator.types import Row


class _ByDem(NamedTuple):
    """The threshold of a single grain by DEM, relative to the closed form in u*."""

    value: float = nan
    low: float = nan
    high: float = nan
    fell_upstream: bool = False
    case: str = ""


SINGLE_GRAIN: Mapping[str, str] = {
    **several("scene_id"),
    **phrases(*POINT),
    **several("reynolds"),
    "reynolds_closed_form": (
        "friction Reynolds number u* d/nu at the threshold, closed form"
    ),
    "shields_closed_form": "Shields number at the threshold, closed form",
    **several("shields_dem", "shields_dem_low", "shields_dem_high"),
    "ustar_closed_form_m_s": "friction velocity at the threshold, closed form",
    "ustar_m_s": "friction velocity at the threshold by DEM",
    "ustar_low_m_s": "highest friction velocity without motion, by DEM",
    "ustar_high_m_s": "lowest friction velocity with motion, by DEM",
    "drag_over_weight": "drag over the submerged weight at the threshold, closed form",
    "fell_upstream": (
        "whether the grain fell back before or instead of moving downstream"
    ),
    **phrases("criterion"),
    "shields_entrained": (
        "Shields number of the mean flow whose gust turns the grain over its neighbour"
    ),
    "shields_sustained": (
        "Shields number of the mean flow from which the grain rolls and hops on after "
        "the gust"
    ),
    "shields_sustained_low": (
        "lower end of the threshold: of a quarter of the grains, and half of the way"
    ),
    "shields_sustained_high": (
        "upper end of the threshold: of three quarters of the grains, and twice the way"
    ),
    "shields_cessation": (
        "Shields number below which motion ceases once it is under way"
    ),
    **several("decides", "case"),
}
"""Columns of `single_grain_rows`, beside those of speeds."""


def single_grain_rows(
    plan: Plan, cells: Iterable[SingleGrainCase], cases: Path
) -> Iterator[Row]:
    """List the single grains that a finished case or the closed form answers.

    Parameters
    ----------
    plan
        The plan of the study.
    cells
        The finished cases of single grains.
    cases
        The directory of the cases.

    Yields
    ------
    dict
        A row for each grain.
    """
    by_dem = _single_grains_by_dem(cells, cases)
    for asked, decision in plan.decisions.items():
        scene = decision.scene
        is_missing = scene.method.facts.needs_run and scene.id not in by_dem
        if asked in plan.piles or is_missing:
            continue
        found = by_dem.get(scene.id, _ByDem())
        exact = closed_form(scene)
        ustar = float(exact.friction_velocity)
        shields = float(exact.shields)
        of_criterion = {**ALONE}
        if scene.threshold.criterion == SUSTAINED:
            both = of_single_grain(scene)
            of_criterion = {"criterion": SUSTAINED}
            for column, (value,) in both.columns().items():
                of_criterion[column] = value
            ratio = float(both.shields[0]) / shields
            shields = float(both.shields[0])
            ustar *= ratio**0.5
        reynolds = ustar * scene.grain.diameter / scene.fluid.viscosity
        row = {
            "scene_id": asked,
            **point(scene),
            "reynolds": reynolds * found.value,
            "reynolds_closed_form": reynolds,
            "shields_closed_form": shields,
            "shields_dem": shields * found.value**2,
            "shields_dem_low": shields * found.low**2,
            "shields_dem_high": shields * found.high**2,
            "ustar_closed_form_m_s": ustar,
            "ustar_m_s": ustar * found.value,
            "ustar_low_m_s": ustar * found.low,
            "ustar_high_m_s": ustar * found.high,
            **speeds(scene, ustar if np.isnan(found.value) else ustar * found.value),
            "drag_over_weight": float(exact.drag) / scene.weight,
            "fell_upstream": found.fell_upstream,
            **of_criterion,
        }
        if found.case:
            row["case"] = found.case
        yield row


def _single_grains_by_dem(
    cells: Iterable[SingleGrainCase], cases: Path
) -> dict[str, _ByDem]:
    """The thresholds of single grains by DEM, by the scene."""
    by_dem = {}
    for cell in cells:
        motion = Motion.from_csv(cases / cell.name)
        steps = threshold.of_grains(motion)
        fell = (motion.fallen > 0).tolist()
        numbers = zip(steps.value, steps.low, steps.high, fell, strict=True)
        for scene, (value, low, high, fell_upstream) in zip(
            cell.scenes, numbers, strict=True
        ):
            by_dem[scene.id] = _ByDem(value, low, high, fell_upstream, cell.name)
    return by_dem
