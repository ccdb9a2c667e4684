"""The table of single grains: closed form and DEM."""

import math
from collections.abc import Iterable, Iterator
from pathlib import Path

from orchestrator.grains import threshold
from orchestrator.grains.cells import SingleGrainCase
from orchestrator.grains.motion import Motion
from orchestrator.plan import Plan
from orchestrator.study.closed_form import closed_form
from orchestrator.study.scene import Scene
from orchestrator.tables.scenes import Row, point


def rows(plan: Plan, cells: Iterable[SingleGrainCase], cases: Path) -> Iterator[Row]:
    """A row for each scene that a finished case or the closed form answers, in the plan's order."""
    measured: dict[str, Row] = {}
    for one in cells:
        motion = Motion.from_csv(cases / one.name)
        found = threshold.of_grains(motion)
        brackets = zip(found.value, found.low, found.high, strict=True)
        for scene, bracket, fallen in zip(one.scenes, brackets, motion.fallen > 0, strict=True):
            row = _row(scene, bracket)
            measured[scene.id] = {**row, "fell_upstream": bool(fallen), "case": one.name}
    for asked, decision in plan.decisions.items():
        scene = decision.scene
        if scene.id in measured:
            yield {"scene_id": asked, **measured[scene.id]}
        elif asked not in plan.piles and scene.protocol.method != "dem":
            yield {"scene_id": asked, **_row(scene, (math.nan,) * 3), "fell_upstream": False}


def _row(scene: Scene, bracket: tuple[float, float, float]) -> Row:
    exact = closed_form(scene)
    ustar, shields = float(exact.friction_velocity), float(exact.shields)
    value, low, high = bracket
    return {
        **point(scene),
        "answered_method": scene.protocol.method,
        "reynolds": float(exact.reynolds) * value,
        "reynolds_closed_form": float(exact.reynolds),
        "shields_closed_form": shields,
        "shields_dem": shields * value**2,
        "shields_dem_low": shields * low**2,
        "shields_dem_high": shields * high**2,
        "ustar_closed_form_m_s": ustar,
        "ustar_m_s": ustar * value,
        "ustar_low_m_s": ustar * low,
        "ustar_high_m_s": ustar * high,
        "drag_over_weight": float(exact.drag) / scene.weight,
    }
