"""The table of scenes: what was asked."""

from collections.abc import Iterator
from typing import Any

from orchestrator.plan import Plan
from orchestrator.study.closed_form import regime_of
from orchestrator.study.scene import PileBed, Scene
from orchestrator.study.study import Study

Row = dict[str, Any]


def rows(study: Study, plan: Plan) -> Iterator[Row]:
    """A row for each scene of each group, in the study's order."""
    cell_of = {scene.id: one.name for one in plan.cells for scene in one.scenes}
    for group in study.groups:
        for asked in group.scenes:
            decision, pile = plan.decisions[asked.id], plan.piles.get(asked.id)
            scene = decision.scene
            runs = [one.name for one in pile.runs] if pile else [cell_of.get(scene.id)]
            yield {
                "scene_id": asked.id,
                "group": group.name,
                "bed": scene.bed.kind,
                **point(scene),
                **_choices(scene),
                "method": scene.protocol.method,
                "why": decision.why,
                "case": runs[-1] if scene.protocol.method == "dem" else None,
                "flow_case": pile.flow.name if pile and pile.model.cases else None,
            }


def point(scene: Scene) -> Row:
    """The columns by which a scene is found in a figure."""
    return {
        "alpha_deg": scene.bed.slope_deg,
        "beta_deg": scene.bed.entrainment_angle_deg,
        "d_m": scene.grain.diameter,
        # rounded: d/30 over d is not 1/30 to the last digit, and figures group by it
        "z0_over_d": round(scene.bed.roughness / scene.grain.diameter, 9),
        "nu_m2_s": scene.fluid.viscosity,
        "closure": scene.flow.closure,
        "regime": regime_of(scene),
    }


def _choices(scene: Scene) -> Row:
    pile = scene.bed if isinstance(scene.bed, PileBed) else None
    return {
        "phi_deg": scene.grain.friction_angle_deg,
        "rho_sol_kg_m3": scene.grain.density,
        "rho_f_kg_m3": scene.fluid.density,
        "g_m_s2": scene.fluid.gravity,
        "z0_m": scene.bed.roughness,
        "h_m": pile.height if pile else None,
        "packing": pile.packing if pile else None,
        "disorder": pile.disorder if pile and pile.packing == "disordered" else None,
        "seed": pile.seed if pile and (pile.packing == "disordered" or pile.is_twin) else None,
        "mobile_layers": pile.mobile_layers if pile else None,
        "flow_model": scene.flow.model if pile else None,
        "stress": scene.flow.stress if pile else None,
        "average": scene.flow.average if pile else None,
        "forced": scene.flow.forced if pile else None,
        "alpha_s": scene.flow.lift_coefficient,
        "stiffness": scene.grain.stiffness,
        "damping": scene.grain.damping,
        "step": scene.protocol.step,
        "quiet": scene.protocol.quiet,
        "marker": scene.protocol.marker,
        "timestep": scene.protocol.timestep,
        "until": scene.protocol.until if pile else None,
        "solve_u_e_m_s": scene.flow.speed if pile else None,
        "solve_z0_m": scene.solve_roughness if pile else None,
        "solve_nu_m2_s": scene.flow.viscosity if pile else None,
        "first_cell_m": scene.first_cell_height if pile else None,
        "cells_per_face": scene.flow.cells_per_face if pile else None,
        "growth": scene.flow.growth if pile else None,
        "turbulence": scene.flow.turbulence if pile else None,
        "convection": scene.flow.convection if pile else None,
        "correctors": scene.flow.correctors if pile else None,
    }
