"""The tables of a study: what was asked, what was measured, with units in the columns' names.

Tables of results hold no time and no path of a machine: the same study gives the same bytes
wherever and whenever it runs. What the runs took is in `timings`.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator import case
from orchestrator.errors import OrchestratorError
from orchestrator.files import write_durably
from orchestrator.flow.stress import WallStress
from orchestrator.grains import threshold
from orchestrator.grains.cells import CellsCase
from orchestrator.grains.motion import MODES, Motion
from orchestrator.grains.pile import PileCase
from orchestrator.plan import Plan
from orchestrator.scene import PileBed, Scene
from orchestrator.study import Study

Row = dict[str, Any]
Tables = dict[str, pd.DataFrame]

COLUMNS: dict[str, str] = {
    "scene_id": "digest of the scene's parameters",
    "group": "group of the study file that asked for the scene",
    "bed": "grain (one on two fixed neighbours) or pile",
    "case": "directory of the case, below cases/",
    "flow_case": "directory of the flow's case, below cases/",
    "alpha_deg": "slope; the flow goes up it",
    "beta_deg": "entrainment angle",
    "phi_deg": "friction angle",
    "d_m": "grain diameter",
    "rho_sol_kg_m3": "density of the grains",
    "rho_f_kg_m3": "density of the fluid",
    "nu_m2_s": "kinematic viscosity that the grains feel",
    "g_m_s2": "gravity",
    "z0_m": "roughness length",
    "z0_over_d": "roughness length over diameter",
    "h_m": "height of the pile's bed line",
    "packing": "pattern of the pile's grains",
    "disorder": "largest gap in the row under the mobile ones, d; of disordered packings",
    "seed": "which of the many disordered packings",
    "mobile_layers": "layers of the windward face that may move",
    "closure": "low: Eqs. 2, 3; high: Eqs. 4, 5",
    "regime": "closure that is valid at the scene's single-grain threshold, or transition",
    "stress": "wall: the flow's wall stress; eq10: Eq. 10 at the first cell",
    "alpha_s": "lift coefficient",
    "stiffness": "K d/W",
    "damping": "damping ratio of a collision",
    "step": "relative rise of u* from hold to hold",
    "quiet": "time without a passage that ends a hold, sqrt(d/g')",
    "marker": "displacement that counts as motion, d",
    "ustar_m_s": "friction velocity at the threshold by DEM",
    "ustar_low_m_s": "no motion at this friction velocity",
    "ustar_high_m_s": "motion at this friction velocity",
    "ustar_closed_form_m_s": "friction velocity at the threshold by Eq. 3 or 5",
    "reynolds": "u* d/nu at the threshold",
    "reynolds_closed_form": "the same by Eq. 3 or 5",
    "shields": "tau_c/((rho_sol - rho_f) g d)",
    "shields_dem": "tau_c/((rho_sol - rho_f) g d) by DEM",
    "shields_dem_low": "lower end of its interval",
    "shields_dem_high": "upper end of its interval",
    "shields_closed_form": "the same by Eq. 3 or 5",
    "shields_low": "lower end of its interval",
    "shields_high": "upper end of its interval",
    "drag_over_weight": "drag over the submerged weight, closed form, at the threshold",
    "s_m": "arc length along the bed line from the windward toe",
    "s_over_h": "the same over h",
    "x_m": "along the flow, from the windward toe",
    "z_m": "above the flat bed",
    "ustar_over_ustar0_wall": "signed friction velocity of the wall stress over ustar0",
    "ustar_over_ustar0_eq10": "the same by Eq. 10 with ln((z_e + z0)/z0)",
    "ustar_over_ustar0_eq10_printed": "the same by Eq. 10 as printed, with ln(z_e/z0)",
    "ustar_over_ustar0": "signed friction velocity at the grain over ustar0",
    "grain_id": "id of the grain in the deck",
    "hold": "number of the hold; 0 is the settling",
    "mode": "how it moved: rolled, slid, lifted (rose by more than 0.3 d) or none",
    "fell_upstream": "whether the grain fell back before or instead of moving downstream",
    "moved_in_hold": "hold in which the grain first passed the marker; 0: never",
    "fallen_in_hold": "hold in which it was first a marker's length upstream; 0: never",
    "u_e_m_s": "speed at the lid, 10 h above the flat bed",
    "ustar0_m_s": "undisturbed friction velocity",
    "count": "N(d), exposed grains of the windward face",
    "moved": "n, grains that had moved",
    "not_moved": "N - n",
    "fallen_upstream": "grains that had been a marker's length upstream",
    "fraction": "n/N at which the threshold is read",
    "fraction_moved": "n/N",
    "highest_fraction": "largest n/N that the holds reached",
    "mean_tau_pa": "mean signed wall stress over the grains that had moved",
    "pivot_ustar0_m_s": "ustar0_m_s by the closed form with each grain's own stress",
    "kind": "kind of the case",
    "solver_s": "wall time of the solvers",
    "outside_s": "wall time of the case outside the solvers",
}
"""Every column of every table, with its meaning; units are in the names."""


def make(study: Study, plan: Plan, cases: Path) -> Tables:
    """The tables of a study that have rows, from the cases that are done; in the study's order."""
    done = {name for name, one in plan.cases.items() if case.is_done(one, cases)}
    piles = {
        key: pile
        for key, pile in plan.piles.items()
        if pile.name in done and pile.flow.name in done
    }
    cells = [one for one in plan.cells if one.name in done]
    flows = {pile.flow.name: pile for pile in plan.piles.values() if pile.flow.name in done}
    made = {
        "scenes": _frame(_scene_rows(study, plan)),
        "single_grain": _single_grain(study, cells, cases),
        "wall_stress": _concat(_wall_stress(flows.values(), cases)),
        "pile_grain": _concat(_pile_grain(pile, cases) for pile in piles.values()),
        "pile_curve": _concat(_pile_curve(pile, cases) for pile in piles.values()),
        "pile_threshold": _frame(row for p in piles.values() for row in _pile_threshold(p, cases)),
    }
    return {name: table for name, table in made.items() if not table.empty}


def timings(plan: Plan, cases: Path) -> pd.DataFrame:
    """Wall times of the finished cases."""
    rows = []
    for name, one in plan.cases.items():
        state = case.done_state(one, cases)
        if state:
            outside = state["wall_s"] - state["solver_s"]
            rows.append(
                {
                    "case": name,
                    "kind": one.kind,
                    "solver_s": state["solver_s"],
                    "outside_s": outside,
                }
            )
    return pd.DataFrame(rows)


def write(tables: Mapping[str, pd.DataFrame], folder: Path) -> None:
    """Write each table as CSV and as Parquet, and what the columns mean; nothing else stays."""
    folder.mkdir(exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for name, table in tables.items():
        write_durably(folder / f"{name}.csv", table.to_csv(index=False))
        write_durably(folder / f"{name}.parquet", table.to_parquet(index=False))
    used = sorted({str(column) for table in tables.values() for column in table})
    rows = [{"column": column, "meaning": COLUMNS[column]} for column in used]
    write_durably(folder / "columns.csv", pd.DataFrame(rows).to_csv(index=False))


def read(folder: Path) -> Tables:
    """Read the tables that `write` wrote.

    Raises
    ------
    OrchestratorError
        If there are none.
    """
    tables = {path.stem: pd.read_parquet(path) for path in sorted(folder.glob("*.parquet"))}
    if not tables:
        raise OrchestratorError(
            "there are no tables", where=str(folder), remedy="run the study first"
        )
    return tables


def _scene_rows(study: Study, plan: Plan) -> Iterator[Row]:
    cell_of = {scene.id: one.name for one in plan.cells for scene in one.scenes}
    for group in study.groups:
        for scene in group.scenes:
            pile = plan.piles.get(scene.id)
            yield {
                "scene_id": scene.id,
                "group": group.name,
                "bed": scene.bed.kind,
                **_point(scene),
                **_choices(scene),
                "case": pile.name if pile else cell_of[scene.id],
                "flow_case": pile.flow.name if pile else None,
            }


def _point(scene: Scene) -> Row:
    """The columns by which a scene is found in a figure."""
    return {
        "alpha_deg": scene.bed.slope_deg,
        "beta_deg": scene.bed.entrainment_angle_deg,
        "d_m": scene.grain.diameter,
        # rounded: d/30 over d is not 1/30 to the last digit, and figures group by it
        "z0_over_d": round(scene.bed.roughness / scene.grain.diameter, 9),
        "nu_m2_s": scene.fluid.viscosity,
        "closure": scene.closure,
        "regime": scene.regime,
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
        "seed": pile.seed if pile and pile.packing == "disordered" else None,
        "mobile_layers": pile.mobile_layers if pile else None,
        "stress": scene.flow.stress if pile else None,
        "alpha_s": scene.flow.lift_coefficient,
        "stiffness": scene.grain.stiffness,
        "damping": scene.grain.damping,
        "step": scene.protocol.step,
        "quiet": scene.protocol.quiet,
        "marker": scene.protocol.marker,
    }


def _single_grain(study: Study, cells: Iterable[CellsCase], cases: Path) -> pd.DataFrame:
    rows: dict[str, Row] = {}
    for one in cells:
        motion = Motion.from_csv(cases / one.name)
        found = threshold.of_grains(motion)
        brackets = zip(found.value, found.low, found.high, strict=True)
        for scene, bracket, fallen in zip(one.scenes, brackets, motion.fallen > 0, strict=True):
            row = {**_single_row(scene, bracket), "fell_upstream": bool(fallen)}
            rows[scene.id] = {**row, "case": one.name}
    return _frame(rows[scene.id] for scene in study.scenes if scene.id in rows)


def _single_row(scene: Scene, bracket: tuple[float, float, float]) -> Row:
    exact = scene.closed_form(scene.closure)
    ustar, shields = float(exact.friction_velocity), float(exact.shields)
    value, low, high = bracket
    return {
        "scene_id": scene.id,
        **_point(scene),
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


def _wall_stress(piles: Iterable[PileCase], cases: Path) -> Iterator[pd.DataFrame]:
    for pile in piles:
        stress = WallStress.from_csv(cases / pile.flow.name / "wall_stress.csv")
        yield pd.DataFrame(
            {
                "flow_case": pile.flow.name,
                "alpha_deg": pile.bed.slope_deg,
                "h_m": pile.bed.height,
                "z0_m": pile.bed.roughness,
                "s_m": stress.s_m,
                "s_over_h": stress.s_m / pile.bed.height,
                "x_m": stress.x_m,
                "z_m": stress.z_m,
                "ustar_over_ustar0_wall": stress.ustar_over_ustar0_wall,
                "ustar_over_ustar0_eq10": stress.ustar_over_ustar0_eq10,
                "ustar_over_ustar0_eq10_printed": stress.ustar_over_ustar0_eq10_printed,
            }
        )


def _pile_grain(pile: PileCase, cases: Path) -> pd.DataFrame:
    motion, face = Motion.from_csv(cases / pile.name), pile.face(cases)
    found = threshold.of_grains(motion)
    return pd.DataFrame(
        {
            "scene_id": pile.scene.id,
            "grain_id": face.ids,
            "s_m": face.arc_length,
            "ustar_over_ustar0": face.speed,
            "moved_in_hold": motion.level,
            "fallen_in_hold": motion.fallen,
            "mode": [MODES[mode] for mode in motion.mode],
            "ustar0_m_s": found.value,
        }
    )


def _pile_curve(pile: PileCase, cases: Path) -> pd.DataFrame:
    scene, motion = pile.scene, Motion.from_csv(cases / pile.name)
    curve = threshold.curve(motion, pile.face(cases).speed, scene.fluid.density)
    moved = np.rint(curve.fraction * motion.count).astype(int)
    holds = np.arange(len(motion.flow))
    return pd.DataFrame(
        {
            "scene_id": scene.id,
            "hold": holds,
            "u_e_m_s": curve.ustar0 * _lid_speed_ratio(pile),
            "ustar0_m_s": curve.ustar0,
            "count": motion.count,
            "moved": moved,
            "not_moved": motion.count - moved,
            "fallen_upstream": [
                int(((motion.fallen > 0) & (motion.fallen <= k)).sum()) for k in holds
            ],
            "fraction_moved": curve.fraction,
            "mean_tau_pa": curve.mean_tau,
            "shields": _shields(scene, curve.mean_tau),
            "reynolds": _reynolds(scene, curve.mean_tau),
        }
    )


def _pile_threshold(pile: PileCase, cases: Path) -> Iterator[Row]:
    scene, motion = pile.scene, Motion.from_csv(cases / pile.name)
    speed = pile.face(cases).speed
    pivot = pile.pivot_thresholds(speed)
    for fraction in scene.protocol.fractions:
        found = threshold.of_pile(motion, speed, fraction, scene.fluid.density)
        yield {
            "scene_id": scene.id,
            **_point(scene),
            "packing": pile.bed.packing,
            "stress": scene.flow.stress,
            "fraction": fraction,
            "shields": _shields(scene, found.tau),
            "shields_low": _shields(scene, found.tau_low),
            "shields_high": _shields(scene, found.tau_high),
            "reynolds": _reynolds(scene, found.tau),
            "ustar0_m_s": found.ustar0,
            "u_e_m_s": found.ustar0 * _lid_speed_ratio(pile),
            "pivot_ustar0_m_s": pivot[int(np.ceil(fraction * motion.count - 1e-9)) - 1],
            "count": motion.count,
            "highest_fraction": motion.fraction[-1],
            "case": pile.name,
        }


def _lid_speed_ratio(pile: PileCase) -> float:
    return pile.flow.speed_m_s / pile.flow.ustar0_m_s


def _shields(scene: Scene, tau: Any) -> Any:
    return tau * np.pi / 6 * scene.grain.diameter**2 / scene.weight


def _reynolds(scene: Scene, tau: Any) -> Any:
    ustar = np.sqrt(tau / scene.fluid.density)
    return ustar * scene.grain.diameter / scene.fluid.viscosity


def _frame(rows: Iterable[Row]) -> pd.DataFrame:
    return pd.DataFrame(list(rows))


def _concat(frames: Iterable[pd.DataFrame]) -> pd.DataFrame:
    listed = list(frames)
    return pd.concat(listed, ignore_index=True) if listed else pd.DataFrame()
