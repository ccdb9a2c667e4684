"""The scenes of a pack: levels 1 and 2 are formulas, 3 to 5 results of a study."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from orchestrator.bed.deck import POURED_DRAG
from orchestrator.benchmark.mechanics import mechanics, three_grains
from orchestrator.benchmark.pack import OF_POCKET, Problem, expectation
from orchestrator.flow.run import SPEED_HEIGHT
from orchestrator.grains import cells
from orchestrator.grains.forces import forces
from orchestrator.grains.loads import loads_of
from orchestrator.grains.pile import Pile
from orchestrator.grains.pile_case import MARGIN
from orchestrator.grains.threshold import PileThreshold
from orchestrator.study import closed_form as study_form
from orchestrator.study import fields
from orchestrator.study.method import HELD_FROM
from orchestrator.study.scene import Scene
from orchestrator.tables import Tables
from orchestrator.types import Row

FORMULA = 1e-6
"""Relative tolerance of the closed form."""
PIVOT = 0.005
"""Relative tolerance of the threshold of one grain."""
STRESS = 0.10
"""Relative tolerance of the friction velocity along the bed."""
MEAN_STRESS = 0.05
"""Relative tolerance of its mean."""
FACE = (0.1, 0.9)
"""Part of the windward face on which it is judged: toe and crest are mesh points."""
THRESHOLD = {"pile": 0.03, "line": 0.10}
"""Relative tolerances of a pile's thresholds, under the given stress and with one's own
flow."""
SCATTER = 0.10
"""Part of N by which the count of moved grains may differ besides one load step, as
runs do that differ by round-off: grains hold up others, chains go at once
(engines.md)."""
POURED_SCATTER = 0.15
"""The same of poured beds."""
LEVEL_ROWS = 0.35
"""Part of N until which horizontal rows are judged: beyond it a whole step goes at once
or not, as the least detail decides (docs/engines.md)."""
LIFT_OFF = 0.20
"""Tolerance of thresholds where grains are carried off, which collide."""
LIFT_OFF_SCATTER = 0.25
"""Part of N by which the count may differ there."""
FLOWS = (0.5, 0.8, 1.1, 1.4)
"""Friction velocities at which the forces are asked, over that of the threshold."""
_GRAIN = (
    "rho_f_kg_m3 nu_m2_s g_m_s2 d_m rho_sol_kg_m3 alpha_deg beta_deg z0_m force_law"
    " alpha_s regime mass_kg reduced_gravity_m_s2 weight_n"
)
_DEM = (
    "phi_deg stiffness damping spring_n_m time_unit_s time_step"
    " displacement_criterion waiting_time load_increment"
)
_BED = "h_m packing disorder seed flow_model stress update final_fraction"
_FLOW = (
    "mobile_layers averaging_length loaded_grains solve_z0_m solve_nu_m2_s"
    " first_cell_m cells_per_face turbulence_model"
)
ENTRIES = {
    "closed-form": f"{_GRAIN} relative_size",
    OF_POCKET: f"{_GRAIN} relative_size {_DEM}",
    "pile": f"{_GRAIN} {_DEM} {_BED}",
    "line": f"{_GRAIN} {_DEM} {_BED} {_FLOW}",
}
"""Entries of the scenes of a study, by kind: what has an effect on the answer."""


def parameters_of(scene: Scene, kind: str) -> Row:
    """List the entries of a scene in a problem.

    Parameters
    ----------
    scene
        The scene, with its force law decided.
    kind
        The kind of the problem.

    Returns
    -------
    dict
        The entries that the kind has and the scene, too.
    """
    grain = scene.grain
    values = fields.used(scene)
    values |= mechanics(
        grain.diameter,
        grain.density,
        scene.reduced_gravity,
        scene.weight,
        scene.method.grains.stiffness,
    )
    entries = {}
    for key in ENTRIES[kind].split():
        if values.get(key) is not None:
            entries[key] = values[key]
    return entries


def formula_scene(name: str, scene: Scene) -> Problem:
    """Make a problem of level 1: the forces on a grain and its threshold.

    Parameters
    ----------
    name
        Its name.
    scene
        Its scene.

    Returns
    -------
    Problem
        The problem, with exact answers.
    """
    exact = study_form.closed_form(scene)
    ustar = float(exact.friction_velocity)
    flows = [float(f"{ratio * ustar:.4g}") for ratio in FLOWS]
    drag, lift = forces(scene)
    rows = [expectation("drag_n", float(drag(u)), FORMULA, u) for u in flows]
    rows += [expectation("lift_n", float(lift(u)), FORMULA, u) for u in flows]
    rows.append(expectation("ustar_m_s", ustar, FORMULA))
    rows.append(expectation("reynolds", float(exact.reynolds), FORMULA))
    rows.append(expectation("shields", float(exact.shields), FORMULA))
    return Problem(name, "closed-form", parameters_of(scene, "closed-form"), {}, rows)


def pivot(name: str, scene: Scene, ours: float) -> Problem:
    """Make a problem of level 2: one grain on its two neighbours.

    Parameters
    ----------
    name
        Its name.
    scene
        Its scene.
    ours
        The threshold by our DEM, m/s.

    Returns
    -------
    Problem
        The problem, with the exact threshold.
    """
    threshold = float(study_form.closed_form(scene).friction_velocity)
    # the mean of two load steps is within half a step of what lies between them
    half = float(np.sqrt(1 + scene.method.grains.load_increment))
    ends = (threshold / half, threshold * half)
    row = expectation("ustar_m_s", threshold, PIVOT, None, *ends)
    row["ours"] = ours
    centres, _, sizes = cells.cell(scene)
    d = scene.grain.diameter
    rising = cells.cell_flows(scene)
    fx, fz = cells.force(scene, rising).T
    load_steps = pd.DataFrame(
        {
            "load_step": range(len(rising)),
            "ustar_m_s": rising * threshold,
            "fx_n": fx,
            "fz_n": fz,
        }
    )
    grains = three_grains(centres * d, sizes * d)
    tables = {"grains": grains, "load_steps": load_steps}
    return Problem(name, OF_POCKET, parameters_of(scene, OF_POCKET), tables, [row])


def has_pivot(scene: Scene) -> bool:
    """Tell whether the threshold of a grain by load steps is that of the closed form.

    Parameters
    ----------
    scene
        The scene of the grain.

    Returns
    -------
    bool
        Whether it is, and means something.
    """
    threshold = study_form.closed_form(scene)
    # else lift bears the weight before drag can push the grain up the slope: it rolls
    # back
    up_the_slope = np.tan(np.radians(scene.bed.slope_deg))
    rolls = bool(threshold.lift * up_the_slope < threshold.drag)
    is_quiet = scene.method.grains.waiting_time >= HELD_FROM
    return study_form.law_holds(scene) and rolls and is_quiet


def _flow_tables(pile: Pile) -> tuple[Row, dict[str, pd.DataFrame]]:
    """Entries and tables about the flow of a pile."""
    case = pile.flow
    entries = {
        "alpha_deg": case.slope_deg,
        "h_m": case.height_m,
        "z0_m": case.roughness_m,
        "u_e_m_s": case.settings.speed,
        "ustar0_m_s": case.ustar0_m_s,
        "u_e_height_m": SPEED_HEIGHT * case.height_m,
        "lid_height_m": case.lid * case.height_m,
        "solve_nu_m2_s": case.viscosity_m2_s,
        "rho_f_kg_m3": pile.scene.fluid.density,
        "first_cell_m": case.first_cell_m,
        "cells_per_face": case.settings.cells_per_face,
        "turbulence_model": case.settings.turbulence_model,
    }
    corners = pd.DataFrame(case.bed_line.corners, columns=["x_m", "z_m"])
    return entries, {"bed": corners}


def flow_scene(name: str, pile: Pile, results: Tables) -> Problem:
    """Make a problem of level 3: the stress on the bed of a pile whose flow is solved.

    Parameters
    ----------
    name
        Its name.
    pile
        The pile.
    results
        The tables of the study.

    Returns
    -------
    Problem
        The problem; toe and crest are asked and not judged.
    """
    low, high = (part * pile.model.line.crest_s / pile.bed.height for part in FACE)
    stress = results["wall_stress"].set_index("flow_case").loc[[pile.flow.name]]
    diagnostics = results["flow"].set_index("flow_case").loc[[pile.flow.name]]
    mean = float(diagnostics["ustar_mean"].iloc[0])
    rows = [expectation("windward_mean", mean, MEAN_STRESS)]
    for s, u in zip(stress["s_over_h"], stress["ustar_over_ustar0_wall"], strict=True):
        tolerance = STRESS if low <= s <= high else np.nan
        rows.append(expectation("ustar_over_ustar0", u, tolerance, s))
    return Problem(name, "flow", *_flow_tables(pile), rows)


def bed(
    name: str, kind: str, scene_id: str, pile: Pile, results: Tables, cases: Path
) -> Problem:
    """Make a problem of level 4 or 5: the grains of a bed that DEM answered.

    Parameters
    ----------
    name
        Its name.
    kind
        ``pile``, under the given stress, or ``line``, whose flow the solver finds.
    scene_id
        The id of the scene that was asked for, under which the tables have the bed.
    pile
        The bed.
    results
        The tables of the study.
    cases
        The directory of the runs, which are done.

    Returns
    -------
    Problem
        The problem.
    """
    curve = results["pile_curve"].set_index("scene_id").loc[[scene_id]].reset_index()
    thresholds = results["pile_threshold"].set_index("scene_id").loc[[scene_id]]
    end = curve.iloc[-1]
    total = int(end["count"])
    carried_off = int(end["carried_off"])
    judged = _judged(kind, pile, carried_off > 0)
    given = parameters_of(pile.scene, kind)
    tables: dict[str, pd.DataFrame] = {}
    rows = []
    if kind == "line":
        of_flow, tables = _flow_tables(pile)
        given = of_flow | given
        rows.append(expectation("count", total, judged.tolerance))
    tables["load_steps"] = curve[["load_step", "ustar0_m_s", "u_e_m_s"]]
    rows += _counts(curve, judged)
    for _, row in thresholds.dropna(subset="shields").iterrows():
        rows += _threshold(pile, cases, curve, row, judged)
    if carried_off:
        given["lift_off"] = carried_off / int(end["moved"])
    if kind == "pile":
        given["count"] = total
        tables["grains"] = _grains(pile, cases)
        given |= _roof(pile)
        if pile.pouring:
            tables["forces"] = _forces(pile, curve, cases)
            unit = given["mass_kg"] / given["time_unit_s"]
            given["settle_drag_kg_s"] = POURED_DRAG * unit
    return Problem(name, kind, given, tables, rows)


class _Judged(NamedTuple):
    """How a bed is judged.

    `tolerance` is that of its thresholds, `scatter` the part of N by which counts may
    differ, and `until` the part of N until which they are judged.
    """

    tolerance: float
    scatter: float
    until: float = 1.0


def _judged(kind: str, pile: Pile, has_lift_off: bool) -> _Judged:
    """How a bed of a kind is judged."""
    tolerance = THRESHOLD[kind]
    if has_lift_off:
        return _Judged(max(tolerance, LIFT_OFF), LIFT_OFF_SCATTER)
    if pile.bed.packing == "horizontal":
        return _Judged(tolerance, SCATTER, LEVEL_ROWS)
    return _Judged(tolerance, POURED_SCATTER if pile.pouring else SCATTER)


def _roof(pile: Pile) -> Row:
    """Entries of the roof of a bed, above which a grain in flight is gone."""
    if pile.bed.is_triangle:
        return {}
    slope, ridge = pile.line.roof(MARGIN + 0.5)
    x, z = (ridge * pile.scene.grain.diameter).tolist()
    return {"roof_slope_deg": slope, "roof_x_m": x, "roof_z_m": z}


def _counts(curve: pd.DataFrame, judged: _Judged) -> list[Row]:
    """Numbers of grains, with an interval of a load step and the scatter."""
    total = float(curve["count"].iloc[-1])
    end = len(curve) - 1
    scatter = judged.scatter * total

    def counted(quantity: str, step: int) -> Row:
        """How many grains by a load step."""
        numbers = curve[quantity].to_numpy(float)
        near = numbers[step - 1 : step + 2]
        low = max(float(near.min()) - scatter, 0.0)
        high = min(float(near.max()) + scatter, total)
        tolerance = 0.0 if near.max() <= judged.until * total else np.nan
        return expectation(quantity, numbers[step], tolerance, step, low, high)

    # load step 0 is the settling
    rows = [counted("moved", step) for step in range(1, end + 1)]
    last = rows[-1]
    rest = total - last["value"]
    ends = (total - last["high"], total - last["low"])
    rows.append(expectation("not_moved", rest, last["tolerance"], end, *ends))
    if curve["carried_off"].iloc[-1]:
        rows.append(counted("carried_off", end))
    return rows


def _threshold(
    pile: Pile, cases: Path, curve: pd.DataFrame, row: Any, judged: _Judged
) -> list[Row]:
    """The Shields number and the flow at a fraction, with their intervals."""
    fraction = row["fraction"]
    shields = row["shields"]
    flow = row["ustar0_m_s"]
    tolerance = judged.tolerance if fraction <= judged.until else np.nan
    slowest, fastest = _near_flows(curve, flow)
    (ours,) = pile.thresholds(cases, [fraction])
    unit = shields / ours.tau
    last = float(curve["shields"].iloc[-1])

    def upper(at: PileThreshold) -> float:
        """The upper end of an interval; where it is open the load steps end."""
        return last if np.isnan(at.tau_high) else at.tau_high * unit

    seeds = np.nan_to_num(row["scatter"])
    low = ours.tau_low * unit * (1 - seeds)
    high = upper(ours) * (1 + seeds)
    if not pile.bed.is_triangle or pile.pouring:
        # Grains of a poured bed go by chance, and those of a train by turns: n/N stands
        # still for some load steps and leaps in the next. The interval also holds the
        # thresholds of our run at so much less of N, and at more.
        nearby = _near_fractions(curve, fraction, judged.scatter)
        fewer, more = pile.thresholds(cases, nearby)
        low = min(low, fewer.tau_low * unit)
        high = max(high, upper(more))
        slowest = min(slowest, fewer.ustar0)
        fastest = max(fastest, more.ustar0)
    return [
        expectation("shields", shields, tolerance, fraction, low, high),
        expectation("ustar0_m_s", flow, tolerance, fraction, slowest, fastest),
    ]


def _near_fractions(
    curve: pd.DataFrame, fraction: float, scatter: float
) -> tuple[float, float]:
    """So much less of N than a fraction, and more, as far as a run went."""
    most = float(curve["moved"].iloc[-1] / curve["count"].iloc[-1])
    return max(fraction - scatter, 1e-9), min(fraction + scatter, most)


def _near_flows(curve: pd.DataFrame, flow: float) -> tuple[float, float]:
    """A flow that is the mean of two load steps, with one load step to each side."""
    ustar0 = curve["ustar0_m_s"].to_numpy(float)
    step = int(np.searchsorted(ustar0, flow))
    return ustar0[max(step - 2, 0)], ustar0[min(step + 1, len(ustar0) - 1)]


def _grains(pile: Pile, cases: Path) -> pd.DataFrame:
    """The grains of a pile, with slope and local u* of the exposed ones."""
    packing = pile.packing
    d = pile.scene.grain.diameter
    pushed = packing.mobile & packing.lee
    exposed = packing.windward | pushed
    slope_deg = np.degrees(np.arctan2(pile.tangents[:, 1], pile.tangents[:, 0]))
    x, z = packing.centres.T * d
    kinds = [~packing.mobile, packing.windward, pushed]
    columns = {
        "id": np.arange(1, len(x) + 1),
        "x_m": x,
        "z_m": z,
        "d_m": packing.sizes * d,
        "kind": np.select(kinds, ["fixed", "counted", "pushed"], "mobile"),
        "slope_deg": np.where(exposed, slope_deg, np.nan),
        "ustar_over_ustar0": np.where(exposed, loads_of(pile, cases).ratio, np.nan),
    }
    return pd.DataFrame(columns)


def _forces(pile: Pile, curve: pd.DataFrame, cases: Path) -> pd.DataFrame:
    """The flow's force on each exposed grain, which has its own size, by load step."""
    loading = loads_of(pile, cases).loading
    exposed = np.flatnonzero(loading.ratio)
    fx, fz = loading.at(curve["ustar0_m_s"])[:, exposed].reshape(-1, 2).T
    columns = {
        "load_step": np.repeat(curve["load_step"].to_numpy(), len(exposed)),
        "id": np.tile(exposed + 1, len(curve)),
        "fx_n": fx,
        "fz_n": fz,
    }
    return pd.DataFrame(columns)
