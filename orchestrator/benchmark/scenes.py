"""The scenes of a pack: levels 1 and 2 are formulas, levels 3 to 5 the results of a study."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.bed.deck import POURED_DRAG
from orchestrator.benchmark.pack import Problem, expectation
from orchestrator.flow.case import SPEED_HEIGHT
from orchestrator.grains import cells
from orchestrator.grains.cells import DENSITY, DIAMETER, GRAVITY
from orchestrator.grains.loads import forces
from orchestrator.grains.pile import MARGIN, Pile
from orchestrator.grains.threshold import PileThreshold
from orchestrator.study import closed_form as study_form
from orchestrator.study import fields
from orchestrator.study.parts import Grain
from orchestrator.study.scene import Scene
from orchestrator.tables import Tables
from orchestrator.types import Row

FORMULA, CHECK, PIVOT = 1e-6, 0.01, 0.005
"""Relative tolerances of levels 1 and 2."""
STRESS, MEAN_STRESS, FACE = 0.10, 0.05, (0.1, 0.9)
"""Relative tolerances of the friction velocity along the bed and of its mean, and the part of the
windward face on which it is judged: toe and crest are points of the mesh."""
THRESHOLD = {"pile": 0.03, "line": 0.10}
"""Relative tolerances of a pile's thresholds, under the given stress and with one's own flow."""
SCATTER, POURED_SCATTER = 0.10, 0.15
"""Part of N, also of poured beds, by which the count of moved grains may differ besides one load
step, as runs do that differ by round-off: grains hold up others, chains go at once (engines.md)."""
LEVEL_ROWS = 0.35
"""Part of N until which level rows are judged: then a whole step goes at once or not, as the least
detail decides (docs/engines.md)."""
LIFT_OFF, LIFT_OFF_SCATTER = 0.20, 0.25
"""Tolerance of thresholds and part of the count where grains are carried off, which collide."""
FLOWS = (0.5, 0.8, 1.1, 1.4)
"""Friction velocities at which the forces are asked, over that of the threshold."""
DAMPINGS, INCLINES_DEG = (0.05, 0.1, 0.3), (5.0, 20.0, 45.0, 60.0, 70.0, 75.0)
MEETING, SPEEDS = 0.1, (1.0, 2.0, 5.0)
"""Speeds of each of two colliding grains, and of a grain that begins to slide, sqrt(d g')."""
PASSING_DEG, CRITERION, PUSHES = 60.0, 0.3, (1.5, 2.0, 3.0)
"""Of the grain that passes the criterion: its entrainment angle, its criterion (d), and the forces
on it over that at which it begins to roll."""
STIFFNESS, PASSING_STIFFNESS = 1e4, 1e5
"""K d/W of the check decks' grain; springs of 1e4 would start the one that passes 1 % early."""
UNIT = float(np.sqrt(DIAMETER * GRAVITY))
"""sqrt(d g') of the check decks' grain, m/s."""
LEAST_QUIET = (
    5.0  # load steps shorter than this, sqrt(d/g'), are ramps with other thresholds
)
_GRAIN = """rho_f_kg_m3 nu_m2_s g_m_s2 d_m rho_sol_kg_m3 alpha_deg beta_deg z0_m force_law alpha_s
regime mass_kg reduced_gravity_m_s2 weight_n"""
_DEM = """phi_deg stiffness damping spring_n_m time_unit_s time_step displacement_criterion
waiting_time load_increment"""
_BED = "h_m packing disorder seed flow_model stress update final_fraction"
_FLOW = """mobile_layers averaging_length loaded_grains solve_z0_m solve_nu_m2_s first_cell_m
cells_per_face turbulence_model"""
ENTRIES = {
    "closed-form": f"{_GRAIN} relative_size",
    "pivot": f"{_GRAIN} relative_size {_DEM}",
    "pile": f"{_GRAIN} {_DEM} {_BED}",
    "line": f"{_GRAIN} {_DEM} {_BED} {_FLOW}",
}
"""Entries of the kinds whose scenes are those of a study: what has an effect on the answer."""


def parameters(scene: Scene, kind: str) -> Row:
    """Entries of a scene, with its force law decided, in a problem of a kind."""
    g, weight = scene.reduced_gravity, scene.weight
    grain = mechanics(
        scene.grain.diameter, scene.grain.density, g, weight, scene.grain.stiffness
    )
    values = fields.used(scene) | grain
    return {
        key: values[key] for key in ENTRIES[kind].split() if values.get(key) is not None
    }


def mechanics(
    d: float, density: float, gravity: float, weight: float, stiffness: float
) -> Row:
    """The mechanics of a grain in SI units; gravity is that of the submerged grain."""
    return {
        "mass_kg": density * np.pi / 6 * d**3,
        "reduced_gravity_m_s2": gravity,
        "weight_n": weight,
        "spring_n_m": stiffness * weight / d,
        "time_unit_s": float(np.sqrt(d / gravity)),
    }


def closed_form(name: str, scene: Scene) -> Problem:
    """Level 1: the forces on a grain and its threshold."""
    exact = study_form.closed_form(scene)
    flows = [float(f"{x * float(exact.friction_velocity):.4g}") for x in FLOWS]
    drag, lift = forces(scene)
    rows = [expectation("drag_n", float(drag(u)), FORMULA, u) for u in flows]
    rows += [expectation("lift_n", float(lift(u)), FORMULA, u) for u in flows]
    ends = {"ustar_m_s": exact.friction_velocity, "reynolds": exact.reynolds}
    ends["shields"] = exact.shields
    rows += [
        expectation(quantity, float(value), FORMULA) for quantity, value in ends.items()
    ]
    return Problem(name, "closed-form", parameters(scene, "closed-form"), {}, rows)


def pivot(name: str, scene: Scene, ours: float) -> Problem:
    """Level 2: one grain on its two neighbours; `ours` is the DEM's threshold, m/s."""
    threshold = float(study_form.closed_form(scene).friction_velocity)
    # the mean of two load steps is within half a step of what lies between them
    half = float(np.sqrt(1 + scene.protocol.load_increment))
    row = expectation(
        "ustar_m_s", threshold, PIVOT, None, threshold / half, threshold * half
    )
    centres, _, sizes = cells.cell(scene)
    d, rising = scene.grain.diameter, cells.flows(scene)
    fx, fz = cells.force(scene, rising).T
    steps = {"load_step": range(len(rising)), "ustar_m_s": rising * threshold}
    load_steps = pd.DataFrame({**steps, "fx_n": fx, "fz_n": fz})
    tables = {"grains": _three(centres * d, sizes * d), "load_steps": load_steps}
    return Problem(
        name, "pivot", parameters(scene, "pivot"), tables, [{**row, "ours": ours}]
    )


def has_pivot(scene: Scene) -> bool:
    """Whether the grain's threshold by load steps is the closed form's, and means something."""
    threshold = study_form.closed_form(scene)
    # else lift bears the weight before drag can push the grain up the slope: it rolls back
    rolls = bool(
        threshold.lift * np.tan(np.radians(scene.bed.slope_deg)) < threshold.drag
    )
    return (
        study_form.law_holds(scene)
        and rolls
        and scene.protocol.waiting_time >= LEAST_QUIET
    )


def _three(centres: Any, diameter: Any) -> pd.DataFrame:
    """Two fixed grains and a mobile one; centres in m, shape (3, 2)."""
    x, z = centres.T
    kinds = ["fixed", "fixed", "mobile"]
    return pd.DataFrame(
        {"id": [1, 2, 3], "x_m": x, "z_m": z, "d_m": diameter, "kind": kinds}
    )


def checks() -> Iterator[Problem]:
    """Level 2: the contact law, on the reference grain of the decks; without our answers."""
    friction = float(np.tan(np.radians(Grain(diameter=DIAMETER).friction_angle_deg)))
    listed: list[tuple[str, float, Row, list[tuple[str, float, float | None]]]] = []
    for damping in DAMPINGS:  # two grains meet; the contact ends where the force does
        root = np.sqrt(1 - damping**2)
        restitution = np.exp(-damping / root * (np.pi - 2 * np.arcsin(damping)))
        given = _contact(0.01, damping) | {"speed_m_s": MEETING * UNIT}
        listed.append(
            ("collision", damping, given, [("restitution", restitution, None)])
        )
    for degrees in INCLINES_DEG:  # a grain rolls or slides down a plane
        sin, cos = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        value = 5 / 7 * sin if sin < 3.5 * friction * cos else sin - friction * cos
        given = _contact(0.2) | {"incline_deg": degrees}
        listed.append(
            ("incline", degrees, given, [("acceleration_over_g", value, None)])
        )
    for speed in SPEEDS:  # a grain slides until it rolls
        given = _contact(0.02) | {"speed_m_s": speed * UNIT}
        given["roll_time_s"] = 2 * speed * UNIT / (7 * friction * GRAVITY)
        half, rolls = ("speed_over_start", 6 / 7, 0.5), ("speed_over_start", 5 / 7, 2.0)
        listed.append(
            ("sliding", speed, given, [half, rolls, ("spin_over_start", 5 / 7, 2.0)])
        )
    beta = np.radians(PASSING_DEG)
    x, z = float(np.cos(beta)), -float(np.sin(beta))
    grains = {
        "grains": _three(DIAMETER * np.array([[-x, z], [x, z], [0.0, 0.0]]), DIAMETER)
    }
    for push in PUSHES:  # a grain is pushed over its neighbour
        given = _contact(0.2, stiffness=PASSING_STIFFNESS)
        given |= {
            "alpha_deg": 0.0,
            "beta_deg": PASSING_DEG,
            "displacement_criterion": CRITERION,
        }
        given["force_n"] = push * given["weight_n"] / float(np.tan(beta))
        time = passing_time(push, CRITERION)
        listed.append(("passing", push, given, [("passing_time_over_t", time, None)]))
    for kind, number, given, exact in listed:
        rows = [
            expectation(what, float(x), CHECK, at) | {"ours": np.nan}
            for what, x, at in exact
        ]
        yield Problem(
            f"{kind}-{number:g}", kind, given, grains if kind == "passing" else {}, rows
        )


def _contact(
    time_step: float, damping: float = 0.1, stiffness: float = STIFFNESS
) -> Row:
    """Parameters of the grain of the check decks."""
    weight = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY
    return {
        **{
            "d_m": DIAMETER,
            "rho_sol_kg_m3": DENSITY,
            "time_step": time_step,
            "damping": damping,
        },
        **{
            "phi_deg": Grain(diameter=DIAMETER).friction_angle_deg,
            "stiffness": stiffness,
        },
        **mechanics(DIAMETER, DENSITY, GRAVITY, weight, stiffness),
    }


def passing_time(push: float, criterion: float) -> float:
    """Time, sqrt(d/g'), in which a pushed grain rolls over its neighbour as far as the criterion.

    `push` is the force along the level bed over that at which the grain begins to roll, `criterion`
    the displacement along the bed, d. It rolls without slip on a circle of radius d, from rest: the
    work of the force and of the weight is its energy, (1 + 2/5) v^2/2 by its moment of inertia.
    """
    lean = np.pi / 2 - np.radians(PASSING_DEG)
    force = push * np.tan(lean)
    # the angle from the vertical is lean - u^2: the speed is proportional to u at the start
    end = np.sqrt(lean - np.arcsin(np.sin(lean) - criterion))
    nodes, weights = np.polynomial.legendre.leggauss(40)
    u = end * (nodes + 1) / 2
    angle = lean - u**2
    work = force * (np.sin(lean) - np.sin(angle)) - (np.cos(angle) - np.cos(lean))
    return float(np.sum(end / 2 * weights * 2 * u / np.sqrt(2 * work / (1 + 2 / 5))))


def _flow_tables(pile: Pile) -> tuple[Row, dict[str, pd.DataFrame]]:
    """Entries and tables about the flow of a pile."""
    case = pile.flow
    entries = {
        **{"alpha_deg": case.slope_deg, "h_m": case.height_m, "z0_m": case.roughness_m},
        **{"u_e_m_s": case.settings.speed, "ustar0_m_s": case.ustar0_m_s},
        "u_e_height_m": SPEED_HEIGHT * case.height_m,
        "lid_height_m": case.lid * case.height_m,
        "solve_nu_m2_s": case.viscosity_m2_s,
        "rho_f_kg_m3": pile.scene.fluid.density,
        "first_cell_m": case.first_cell_m,
        "cells_per_face": case.settings.cells_per_face,
        "turbulence_model": case.settings.turbulence_model,
    }
    return entries, {"bed": pd.DataFrame(case.bed_line.corners, columns=["x_m", "z_m"])}


def flow(name: str, pile: Pile, results: Tables) -> Problem:
    """Level 3: the stress on the bed of a pile whose flow is solved."""
    low, high = (x * pile.model.line.crest_s / pile.bed.height for x in FACE)
    stress = results["wall_stress"].set_index("flow_case").loc[[pile.flow.name]]
    diagnostics = results["flow"].set_index("flow_case").loc[[pile.flow.name]]
    rows = [
        expectation(
            "windward_mean", float(diagnostics["ustar_mean"].iloc[0]), MEAN_STRESS
        )
    ]
    for s, u in zip(stress["s_over_h"], stress["ustar_over_ustar0_wall"], strict=True):
        rows.append(
            expectation(
                "ustar_over_ustar0", u, STRESS if low <= s <= high else np.nan, s
            )
        )
    return Problem(name, "flow", *_flow_tables(pile), rows)


def bed(
    name: str, kind: str, scene_id: str, pile: Pile, results: Tables, cases: Path
) -> Problem:
    """Levels 4 and 5: the grains of a bed that DEM answered.

    The kind is ``pile``, under the given stress, or ``line``, whose flow the solver finds.
    `results` are the tables of the study, which have the bed under the id of the scene that was
    asked for; `cases` is the directory of the runs, which are done.
    """
    scene = pile.scene
    curve = results["pile_curve"].set_index("scene_id").loc[[scene_id]].reset_index()
    thresholds = results["pile_threshold"].set_index("scene_id").loc[[scene_id]]
    total, moved, off = (
        int(curve[key].iloc[-1]) for key in ("count", "moved", "carried_off")
    )
    tolerance, until = THRESHOLD[kind], 1.0
    scatter = POURED_SCATTER if pile.pouring else SCATTER
    if off:
        tolerance, scatter = max(tolerance, LIFT_OFF), LIFT_OFF_SCATTER
    elif pile.bed.packing == "horizontal":
        scatter, until = SCATTER, LEVEL_ROWS

    given, tables = _flow_tables(pile) if kind == "line" else ({}, {})
    given = given | parameters(scene, kind)
    tables["load_steps"] = curve[["load_step", "ustar0_m_s", "u_e_m_s"]]
    rows = [expectation("count", total, tolerance)] if kind == "line" else []
    rows += _counts(curve, scatter, until)
    for _, row in thresholds.dropna(subset="shields").iterrows():
        judged = tolerance if row["fraction"] <= until else np.nan
        rows += _threshold(pile, cases, curve, row, judged, scatter)
    if off:
        given["lift_off"] = off / moved
    if kind == "pile":
        given["count"], tables["grains"] = total, _grains(pile, cases)
        if not pile.bed.is_triangle:
            slope, ridge = pile.line.roof(MARGIN + 0.5)
            x, z = (ridge * scene.grain.diameter).tolist()
            given |= {"roof_slope_deg": slope, "roof_x_m": x, "roof_z_m": z}
        if pile.pouring:
            tables["forces"] = _forces(pile, curve, cases)
            given["settle_drag_kg_s"] = (
                POURED_DRAG * given["mass_kg"] / given["time_unit_s"]
            )
    return Problem(name, kind, given, tables, rows)


def _counts(curve: pd.DataFrame, scatter: float, until: float) -> list[Row]:
    """Numbers of grains: the interval is that of a load step earlier or later, and the scatter.

    They are judged while at most the part `until` of N has moved.
    """
    total, end = float(curve["count"].iloc[-1]), len(curve) - 1

    def counted(quantity: str, step: int) -> Row:
        n = curve[quantity].to_numpy(float)
        near = n[step - 1 : step + 2]
        low = max(float(near.min()) - scatter * total, 0.0)
        high = min(float(near.max()) + scatter * total, total)
        judged = 0.0 if near.max() <= until * total else np.nan
        return expectation(quantity, n[step], judged, step, low, high)

    rows = [
        counted("moved", step) for step in range(1, end + 1)
    ]  # load step 0 is the settling
    last = rows[-1]
    rest, low, high = (total - last[key] for key in ("value", "high", "low"))
    rows.append(expectation("not_moved", rest, last["tolerance"], end, low, high))
    return (
        [*rows, counted("carried_off", end)] if curve["carried_off"].iloc[-1] else rows
    )


def _threshold(
    pile: Pile,
    cases: Path,
    curve: pd.DataFrame,
    row: Any,
    tolerance: float,
    part: float,
) -> list[Row]:
    """The Shields number and the flow at a fraction of the moved grains, with their intervals."""
    fraction, shields, flow = row["fraction"], row["shields"], row["ustar0_m_s"]
    # the number is the mean of two load steps: one load step more to each side
    ustar0 = curve["ustar0_m_s"].to_numpy(float)
    step = int(np.searchsorted(ustar0, flow))
    slowest, fastest = ustar0[max(step - 2, 0)], ustar0[min(step + 1, len(ustar0) - 1)]
    (ours,) = pile.thresholds(cases, [fraction])
    unit, seeds = shields / ours.tau, np.nan_to_num(row["scatter"])
    last = float(curve["shields"].iloc[-1])

    def upper(at: PileThreshold) -> float:
        """The upper end of an interval; the load steps of the pack end where it is open."""
        return last if np.isnan(at.tau_high) else at.tau_high * unit

    low, high = ours.tau_low * unit * (1 - seeds), upper(ours) * (1 + seeds)
    if not pile.bed.is_triangle or pile.pouring:
        # Grains of a poured bed go by chance, and those of a train by turns: n/N stands still for
        # some load steps and leaps in the next. The interval also holds the thresholds of our run
        # at so much less of N, and at more.
        most = float(curve["moved"].iloc[-1] / curve["count"].iloc[-1])
        places = max(fraction - part, 1e-9), min(fraction + part, most)
        fewer, more = pile.thresholds(cases, places)
        low, high = min(low, fewer.tau_low * unit), max(high, upper(more))
        slowest, fastest = min(slowest, fewer.ustar0), max(fastest, more.ustar0)
    return [
        expectation("shields", shields, tolerance, fraction, low, high),
        expectation("ustar0_m_s", flow, tolerance, fraction, slowest, fastest),
    ]


def _grains(pile: Pile, cases: Path) -> pd.DataFrame:
    """The grains of a pile, with slope and local friction velocity of the exposed ones."""
    packing, d = pile.packing, pile.scene.grain.diameter
    pushed = packing.mobile & packing.lee
    exposed, tangents = packing.windward | pushed, pile.tangents
    slope = np.degrees(np.arctan2(tangents[:, 1], tangents[:, 0]))
    x, z = packing.centres.T * d
    kinds = [~packing.mobile, packing.windward, pushed]
    columns = {
        **{
            "id": np.arange(1, len(x) + 1),
            "x_m": x,
            "z_m": z,
            "d_m": packing.sizes * d,
        },
        "kind": np.select(kinds, ["fixed", "counted", "pushed"], "mobile"),
        "slope_deg": np.where(exposed, slope, np.nan),
        "ustar_over_ustar0": np.where(exposed, pile.loads(cases).ratio, np.nan),
    }
    return pd.DataFrame(columns)


def _forces(pile: Pile, curve: pd.DataFrame, cases: Path) -> pd.DataFrame:
    """The flow's force on each exposed grain in each load step: each grain has its own size."""
    loading = pile.loads(cases).loading
    exposed = np.flatnonzero(loading.ratio)
    fx, fz = loading.at(curve["ustar0_m_s"])[:, exposed].reshape(-1, 2).T
    steps, ids = np.repeat(curve["load_step"].to_numpy(), len(exposed)), exposed + 1
    columns = {
        "load_step": steps,
        "id": np.tile(ids, len(curve)),
        "fx_n": fx,
        "fz_n": fz,
    }
    return pd.DataFrame(columns)
