"""The tables of scenes, of single grains and of flows."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from orchestrator.flow.stress import bubble
from orchestrator.grains import threshold
from orchestrator.grains.cells import SingleGrainCase
from orchestrator.grains.motion import Motion
from orchestrator.grains.pile import Pile
from orchestrator.physics.measured import MeasuredHill, rushil_hill
from orchestrator.plan import Plan
from orchestrator.study import fields
from orchestrator.study.closed_form import closed_form, law_holds
from orchestrator.study.scene import Scene
from orchestrator.study.shapes import rushil_aspect
from orchestrator.study.study import Study
from orchestrator.types import Row

POINT = ("alpha_deg", "beta_deg", "d_m", "z0_over_d", "nu_m2_s", "force_law", "regime")
"""Columns by which a scene is found in a figure; tables of results have them too."""
WAY_UP = ("ustar_foot", "ustar_quarter", "ustar_half", "ustar_three_quarters", "ustar_top")
"""Columns of u*/u*_0 at equal parts of the way along the bed from the foot to the top."""


def point(scene: Scene) -> Row:
    """The columns by which a scene is found in a figure."""
    return {column: fields.COLUMNS[column].asked(scene) for column in POINT}


def rows(study: Study, plan: Plan) -> Iterator[Row]:
    """A row for each scene of each group, in the study's order: as asked, and as answered."""
    cell_of = {scene.id: cell.name for cell in plan.cells for scene in cell.scenes}
    for group in study.groups:
        for asked in group.scenes:
            decision, pile = plan.decisions[asked.id], plan.piles.get(asked.id)
            scene = decision.scene
            runs = [case.name for case in pile.runs] if pile else [cell_of.get(scene.id)]
            yield {
                "scene_id": asked.id,
                "group": group.name,
                **fields.asked(asked),
                **fields.answered(scene),
                "law_holds": law_holds(asked),
                "why": decision.why,
                "case": runs[-1] if scene.protocol.method == "dem" else None,
                "flow_case": pile.flow.name if pile and pile.model.cases else None,
            }


def single_grains(plan: Plan, cells: Iterable[SingleGrainCase], cases: Path) -> Iterator[Row]:
    """A row for each single grain that a finished case or the closed form answers."""
    # u* by DEM over that of the closed form, with its interval
    ratios: dict[str, tuple[float, ...]] = {}
    beside: dict[str, Row] = {}
    for cell in cells:
        motion = Motion.from_csv(cases / cell.name)
        steps = threshold.of_grains(motion)
        ids = [scene.id for scene in cell.scenes]
        ratios |= zip(ids, zip(steps.value, steps.low, steps.high, strict=True), strict=True)
        for name, fell in zip(ids, motion.fallen > 0, strict=True):
            beside[name] = {"fell_upstream": bool(fell), "case": cell.name}
    for asked, decision in plan.decisions.items():
        scene = decision.scene
        if asked in plan.piles or (scene.id not in ratios and scene.protocol.method == "dem"):
            continue
        value, low, high = ratios.get(scene.id, (np.nan, np.nan, np.nan))
        exact = closed_form(scene)
        ustar, shields = float(exact.friction_velocity), float(exact.shields)
        yield {
            "scene_id": asked,
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
            **beside.get(scene.id, {"fell_upstream": False}),
        }


def wall_stress(pile: Pile, cases: Path) -> Row:
    """Columns of the friction velocity along the bed, for the solved flow of a pile."""
    stress = pile.stress(cases)
    names = ("x_m", "z_m", *(f"ustar_over_ustar0_{kind}" for kind in ("wall", "eq10")))
    return {
        "flow_case": pile.flow.name,
        "alpha_deg": pile.bed.slope_deg,
        "h_m": pile.bed.height,
        "z0_m": pile.flow.roughness_m,
        "s_m": stress.s_m,
        "s_over_h": stress.s_m / pile.bed.height,
        **{name: getattr(stress, name) for name in (*names, "ustar_over_ustar0_eq10_printed")},
    }


def flow(pile: Pile, cases: Path) -> Row:
    """The solved flow of a pile: its settings, its separation and its speed-up."""
    case, stress, line = pile.flow, pile.stress(cases), pile.model.line
    separation, reattachment = bubble(stress, line.h) or (np.nan, np.nan)
    ustar, way = stress.ustar_over_ustar0_wall, np.linspace(0, line.crest_s, len(WAY_UP))
    windward = (stress.s_m > 0) & (stress.s_m < line.crest_s)
    length, hill = stress.length_m[windward], measured_hill(pile)
    row = {
        "flow_case": case.name,
        "bed_shape": pile.bed.shape if not pile.bed.profile else "profile",
        "alpha_deg": pile.bed.slope_deg,
        "h_m": case.height_m,
        "z0_m": case.roughness_m,
        "turbulence_model": case.settings.turbulence_model,
        "first_cell_m": case.first_cell_m,
        "lid_over_h": case.lid,
        "upstream_over_h": case.settings.upstream,
        "downstream_over_h": case.settings.downstream,
        "separation_over_h": separation,
        "reattachment_over_h": reattachment,
        **dict(zip(WAY_UP, np.interp(way, stress.s_m, ustar).tolist(), strict=True)),
        "ustar_mean": float(np.average(ustar[windward], weights=length)) if length.size else np.nan,
        "ustar_largest": float(ustar.max()),
    }
    if hill is not None:
        row["measured_reattachment_over_h"] = hill.reattachment or np.nan
        row |= {"measured_verified": hill.verified, "measured_source": hill.source}
    return row


def measured_hill(pile: Pile) -> MeasuredHill | None:
    """The hill of a wind tunnel that a pile is, if any."""
    bed, case = pile.bed, pile.flow
    if bed.shape != "rushil" or bed.profile or bed.forms > 1 or bed.obstacles:
        return None
    return rushil_hill(rushil_aspect(bed.slope_deg), case.height_m / case.roughness_m)
