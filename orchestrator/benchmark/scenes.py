"""The scenes of a pack: levels 1 and 2 are formulas, levels 3 to 5 the results of a study."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.bed.deck import POURED_DRAG
from orchestrator.benchmark.pack import COLUMNS, Problem, expectation
from orchestrator.flow.case import SPEED_HEIGHT
from orchestrator.grains import cells
from orchestrator.grains.cells import DENSITY, DIAMETER, GRAVITY
from orchestrator.grains.pile import MARGIN, Pile
from orchestrator.study import closed_form as study_form
from orchestrator.study import fields
from orchestrator.study.parts import Grain
from orchestrator.study.scene import Scene
from orchestrator.tables import Tables
from orchestrator.types import Row

FORMULA, CHECK, PIVOT = 1e-6, 0.01, 0.005
"""Relative tolerances of levels 1 and 2."""
STRESS, MEAN_STRESS = 0.10, 0.05
"""Relative tolerances of the friction velocity along the bed, and of its mean."""
FACE = (0.1, 0.9)
"""Part of the windward face on which it is judged: toe and crest are points of the mesh."""
THRESHOLD = {"pile": 0.03, "line": 0.10}
"""Relative tolerances of a pile's thresholds, under the given stress and with one's own flow."""
SCATTER = 0.10
"""Part of the count by which the number of moved grains may differ, besides one load step: three
engines with one contact law do so by up to 13 % where a chain of grains goes at once
(docs/engines.md)."""
LEVEL_ROWS = 0.35
"""Part of N: level rows are judged until so many have moved. Then a whole step goes at once or not,
as the least detail decides: runs that differ in the time step, the dashpots or places by 1e-3 d
are up to 20 % of N and six load steps apart (docs/engines.md)."""
POURED_SCATTER = 0.15
"""Part of N on poured beds. Runs that differ by round-off are 6 to 15 % apart beyond a load step in
nine of ten pairs, where a grain that goes or stays holds up others (docs/engines.md)."""
LIFT_OFF, LIFT_OFF_SCATTER = 0.20, 0.25
"""The same tolerances where grains are carried off, which collide on their way: runs that differ by
round-off are up to 16 % beyond the interval of a threshold and 22 % of N beyond a load step."""
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
LEAST_QUIET = 5.0
"""Load steps shorter than this, sqrt(d/g'), are ramps: their threshold is not the closed form's."""
_GRAIN = (
    *("rho_f_kg_m3", "nu_m2_s", "g_m_s2", "d_m", "rho_sol_kg_m3", "alpha_deg", "beta_deg", "z0_m"),
    *("force_law", "alpha_s", "regime", "mass_kg", "reduced_gravity_m_s2", "weight_n"),
)
_DEM = (
    *("phi_deg", "stiffness", "damping", "spring_n_m", "time_unit_s", "time_step"),
    *("displacement_criterion", "waiting_time", "load_increment"),
)
_BED = ("h_m", "packing", "disorder", "seed", "flow_model", "stress", "update", "final_fraction")
_FLOW = (
    *("mobile_layers", "averaging_length", "loaded_grains", "solve_z0_m", "solve_nu_m2_s"),
    *("first_cell_m", "cells_per_face", "turbulence_model"),
)
ENTRIES: Mapping[str, Sequence[str]] = {
    "closed-form": (*_GRAIN, "relative_size"),
    "pivot": (*_GRAIN, "relative_size", *_DEM),
    "pile": (*_GRAIN, *_DEM, *_BED),
    "line": (*_GRAIN, *_DEM, *_BED, *_FLOW),
}
"""Entries of the kinds whose scenes are those of a study: what has an effect on the answer."""


def parameters(scene: Scene, kind: str) -> Row:
    """Entries of a scene, with its force law decided, in a problem of a kind."""
    g, weight = scene.reduced_gravity, scene.weight
    grain = mechanics(scene.grain.diameter, scene.grain.density, g, weight, scene.grain.stiffness)
    values = fields.used(scene) | grain
    return {key: values[key] for key in ENTRIES[kind] if values.get(key) is not None}


def mechanics(d: float, density: float, gravity: float, weight: float, stiffness: float) -> Row:
    """The mechanics of a grain in SI units; gravity is that of the submerged grain."""
    return {
        "mass_kg": density * np.pi / 6 * d**3,
        "reduced_gravity_m_s2": gravity,
        "weight_n": weight,
        "spring_n_m": stiffness * weight / d,
        "time_unit_s": float(np.sqrt(d / gravity)),
    }


def _asked(rows: Iterable[Row]) -> pd.DataFrame:
    return pd.DataFrame(list(rows), columns=COLUMNS)


def closed_form(scene: Scene) -> Problem:
    """Level 1: the forces on a grain and its threshold."""
    exact = study_form.closed_form(scene)
    flows = [float(f"{x * float(exact.friction_velocity):.4g}") for x in FLOWS]
    laws = zip(("drag_n", "lift_n"), study_form.forces(scene), strict=True)
    values: list[Any] = [(name, float(force(u)), u) for name, force in laws for u in flows]
    values += [("ustar_m_s", float(exact.friction_velocity), None)]
    values += [(name, float(getattr(exact, name)), None) for name in ("reynolds", "shields")]
    asked = _asked(expectation(name, x, FORMULA, at, ours=x) for name, x, at in values)
    return Problem(scene.id, "closed-form", parameters(scene, "closed-form"), {}, asked)


def pivot(scene: Scene, ours: float = np.nan) -> Problem:
    """Level 2: one grain on its two neighbours; `ours` is the DEM's threshold, m/s."""
    threshold = float(study_form.closed_form(scene).friction_velocity)
    # the mean of two load steps is within half a step of what lies between them
    half = float(np.sqrt(1 + scene.protocol.load_increment))
    interval = threshold / half, threshold * half
    asked = _asked([expectation("ustar_m_s", threshold, PIVOT, interval=interval, ours=ours)])
    centres, _, sizes = cells.cell(scene)
    d, rising = scene.grain.diameter, cells.flows(scene)
    fx, fz = cells.force(scene, rising).T
    steps = {
        "load_step": range(len(rising)),
        "ustar_m_s": rising * threshold,
        "fx_n": fx,
        "fz_n": fz,
    }
    tables = {"grains": _three(centres * d, sizes * d), "load_steps": pd.DataFrame(steps)}
    return Problem(scene.id, "pivot", parameters(scene, "pivot"), tables, asked)


def has_pivot(scene: Scene) -> bool:
    """Whether the grain's threshold by load steps is the closed form's, and means something."""
    threshold = study_form.closed_form(scene)
    # else lift bears the weight before drag can push the grain up the slope: it rolls back
    rolls = bool(threshold.lift * np.tan(np.radians(scene.bed.slope_deg)) < threshold.drag)
    return study_form.law_holds(scene) and rolls and scene.protocol.waiting_time >= LEAST_QUIET


def _three(centres: Any, diameter: Any) -> pd.DataFrame:
    """Two fixed grains and a mobile one; centres in m, shape (3, 2)."""
    x, z = centres.T
    kinds = ["fixed", "fixed", "mobile"]
    return pd.DataFrame({"id": [1, 2, 3], "x_m": x, "z_m": z, "d_m": diameter, "kind": kinds})


def checks() -> Iterator[Problem]:
    """Level 2: the contact law, on the reference grain of the decks."""
    for damping in DAMPINGS:  # two grains meet; the contact ends where the force does
        root = np.sqrt(1 - damping**2)
        restitution = np.exp(-damping / root * (np.pi - 2 * np.arcsin(damping)))
        given = _contact(0.01, damping) | {"speed_m_s": MEETING * UNIT}
        yield _check("collision", damping, given, [("restitution", restitution, None)])
    friction = float(np.tan(np.radians(Grain(diameter=DIAMETER).friction_angle_deg)))
    for degrees in INCLINES_DEG:  # a grain rolls or slides down a plane
        sin, cos = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        value = 5 / 7 * sin if sin < 3.5 * friction * cos else sin - friction * cos
        given = _contact(0.2) | {"incline_deg": degrees}
        yield _check("incline", degrees, given, [("acceleration_over_g", value, None)])
    for speed in SPEEDS:  # a grain slides until it rolls
        roll_time = 2 * speed * UNIT / (7 * friction * GRAVITY)
        given = _contact(0.02) | {"speed_m_s": speed * UNIT, "roll_time_s": roll_time}
        half, rolls = ("speed_over_start", 6 / 7, 0.5), ("speed_over_start", 5 / 7, 2.0)
        yield _check("sliding", speed, given, [half, rolls, ("spin_over_start", 5 / 7, 2.0)])
    beta = np.radians(PASSING_DEG)
    x, z = float(np.cos(beta)), -float(np.sin(beta))
    grains = _three(DIAMETER * np.array([[-x, z], [x, z], [0.0, 0.0]]), DIAMETER)
    for push in PUSHES:  # a grain is pushed over its neighbour
        given = _contact(0.2, stiffness=PASSING_STIFFNESS)
        given |= {"alpha_deg": 0.0, "beta_deg": PASSING_DEG, "displacement_criterion": CRITERION}
        given["force_n"] = push * given["weight_n"] / float(np.tan(beta))
        passing = ("passing_time_over_t", passing_time(push, CRITERION), None)
        yield _check("passing", push, given, [passing], {"grains": grains})


def _contact(time_step: float, damping: float = 0.1, stiffness: float = STIFFNESS) -> Row:
    """Parameters of the grain of the check decks."""
    weight = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY
    return {
        "d_m": DIAMETER,
        "rho_sol_kg_m3": DENSITY,
        "phi_deg": Grain(diameter=DIAMETER).friction_angle_deg,
        "stiffness": stiffness,
        "damping": damping,
        **mechanics(DIAMETER, DENSITY, GRAVITY, weight, stiffness),
        "time_step": time_step,
    }


def _check(
    kind: str,
    number: float,
    given: Row,
    rows: Iterable[tuple[str, float, float | None]],
    tables: Mapping[str, pd.DataFrame] | None = None,
) -> Problem:
    """A check of a kind, named by its number; each row is a quantity, its value and its place."""
    asked = _asked(expectation(name, float(value), CHECK, at) for name, value, at in rows)
    return Problem(f"{kind}-{number:g}", kind, given, tables or {}, asked)


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


def _flow_entries(pile: Pile) -> Row:
    """Entries about the flow of a pile."""
    case = pile.flow
    return {
        **{"alpha_deg": case.slope_deg, "h_m": case.height_m, "z0_m": case.roughness_m},
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


def _bed_line(pile: Pile) -> pd.DataFrame:
    return pd.DataFrame(pile.flow.bed_line.corners, columns=["x_m", "z_m"])


def flow(pile: Pile, results: Tables) -> Problem:
    """Level 3: the stress on the bed of a pile whose flow is solved."""
    name, crest = pile.flow.name, pile.model.line.crest_s / pile.bed.height
    stress, diagnostics = (
        results[table][results[table]["flow_case"] == name] for table in ("wall_stress", "flow")
    )
    mean = float(diagnostics["ustar_mean"].iloc[0])
    rows = [expectation("windward_mean", mean, MEAN_STRESS, ours=mean)]
    for s, u in zip(stress["s_over_h"], stress["ustar_over_ustar0_wall"], strict=True):
        tolerance = STRESS if FACE[0] * crest <= s <= FACE[1] * crest else np.nan
        rows.append(expectation("ustar_over_ustar0", u, tolerance, s, ours=u))
    return Problem(
        pile.flow.id[:12], "flow", _flow_entries(pile), {"bed": _bed_line(pile)}, _asked(rows)
    )


def bed(kind: str, pile: Pile, results: Tables, cases: Path) -> Problem:
    """Levels 4 and 5: the grains of a bed that DEM answered.

    The kind is ``pile``, under the given stress, or ``line``, whose flow the solver finds.
    `results` are the tables of the study, `cases` is the directory of the runs, which are done.
    """
    scene, d = pile.scene, pile.scene.grain.diameter
    curve, thresholds = (
        results[table][results[table]["scene_id"] == scene.id]
        for table in ("pile_curve", "pile_threshold")
    )
    last = curve.iloc[-1]
    total, carried = (
        float(last["count"]),
        float(last["carried_off"]) / max(float(last["moved"]), 1.0),
    )
    tolerance, until = THRESHOLD[kind], 1.0
    scatter = POURED_SCATTER if pile.pouring else SCATTER
    if carried:
        tolerance, scatter = max(tolerance, LIFT_OFF), LIFT_OFF_SCATTER
    elif pile.bed.packing == "horizontal":
        scatter, until = SCATTER, LEVEL_ROWS

    def counted(quantity: str, step: int) -> Row:
        """A number of grains: that of a load step earlier or later, and the scatter."""
        n = curve[quantity].to_numpy(float)
        near = n[step - 1 : step + 2]
        low = max(float(near.min()) - scatter * total, 0.0)
        high = min(float(near.max()) + scatter * total, total)
        judged = 0.0 if near.max() <= until * total else np.nan
        return expectation(quantity, n[step], judged, step, (low, high), n[step])

    rows = [counted("moved", step) for step in range(1, len(curve))]  # load step 0 is the settling
    moved, end = rows[-1], len(curve) - 1
    interval, rest = (total - moved["high"], total - moved["low"]), total - moved["value"]
    rows.append(expectation("not_moved", rest, moved["tolerance"], end, interval, rest))
    if carried:
        rows.append(counted("carried_off", end))
    for row in thresholds.dropna(subset="shields").to_dict("records"):
        judged = tolerance if row["fraction"] <= until else np.nan
        rows += _threshold(pile, cases, curve, row, judged, scatter)

    given = parameters(scene, kind) | ({"lift_off": carried} if carried else {})
    tables = {"load_steps": curve[["load_step", "ustar0_m_s", "u_e_m_s"]]}
    if kind == "line":
        given, tables["bed"] = _flow_entries(pile) | given, _bed_line(pile)
        rows.insert(0, expectation("count", total, tolerance, ours=total))
        return Problem(scene.id, kind, given, tables, _asked(rows))
    given["count"], tables["grains"] = int(total), _grains(pile, cases)
    if not pile.bed.is_triangle:
        slope, ridge = pile.line.roof(MARGIN + 0.5)
        x, z = (ridge * d).tolist()
        given |= {"roof_slope_deg": slope, "roof_x_m": x, "roof_z_m": z}
    if pile.pouring:
        tables["forces"] = _forces(pile, curve, cases)
        given["settle_drag_kg_s"] = POURED_DRAG * given["mass_kg"] / given["time_unit_s"]
    return Problem(scene.id, kind, given, tables, _asked(rows))


def _threshold(
    pile: Pile,
    cases: Path,
    curve: pd.DataFrame,
    row: Mapping[Any, Any],
    tolerance: float,
    part: float,
) -> list[Row]:
    """The Shields number and the flow at a fraction of the moved grains, with their intervals."""
    fraction, shields, flow = row["fraction"], row["shields"], row["ustar0_m_s"]
    # the number is the mean of two load steps: one load step more to each side
    ustar0 = curve["ustar0_m_s"].to_numpy(float)
    step = int(np.searchsorted(ustar0, flow))
    flows = ustar0[max(step - 2, 0)], ustar0[min(step + 1, len(ustar0) - 1)]
    (ours,) = pile.thresholds(cases, [fraction])
    unit, seeds = shields / ours.tau, np.nan_to_num(row["scatter"])
    low, high = ours.tau_low * unit * (1 - seeds), ours.tau_high * unit * (1 + seeds)
    if not pile.bed.is_triangle or pile.pouring:
        # Grains of a poured bed go by chance, and those of a train by turns: n/N stands still for
        # some load steps and leaps in the next. The interval also holds the thresholds of our run
        # at so much less of N, and at more.
        most = float(curve["moved"].iloc[-1] / curve["count"].iloc[-1])
        places = max(fraction - part, 1e-9), min(fraction + part, most)
        fewer, more = pile.thresholds(cases, places)
        low, high = min(low, fewer.tau_low * unit), max(high, more.tau_high * unit)
        flows = min(flows[0], fewer.ustar0), max(flows[1], more.ustar0)
    return [
        expectation("shields", shields, tolerance, fraction, (low, high), shields),
        expectation("ustar0_m_s", flow, tolerance, fraction, flows, flow),
    ]


def _grains(pile: Pile, cases: Path) -> pd.DataFrame:
    packing, d = pile.packing, pile.scene.grain.diameter
    pushed = packing.mobile & packing.lee
    exposed, tangents = packing.windward | pushed, pile.tangents
    slope = np.degrees(np.arctan2(tangents[:, 1], tangents[:, 0]))
    x, z = packing.centres.T * d
    kinds = [~packing.mobile, packing.windward, pushed]
    return pd.DataFrame(
        {
            "id": np.arange(1, len(x) + 1),
            "x_m": x,
            "z_m": z,
            "d_m": packing.sizes * d,
            "kind": np.select(kinds, ["fixed", "counted", "pushed"], "mobile"),
            "slope_deg": np.where(exposed, slope, np.nan),
            "ustar_over_ustar0": np.where(exposed, pile.loads(cases).ratio, np.nan),
        }
    )


def _forces(pile: Pile, curve: pd.DataFrame, cases: Path) -> pd.DataFrame:
    """The flow's force on each exposed grain in each load step: each grain has its own size."""
    loading = pile.loads(cases).loading
    exposed = np.flatnonzero(loading.ratio)
    fx, fz = loading.in_steps(curve["ustar0_m_s"].tolist())[:, exposed].reshape(-1, 2).T
    steps, ids = np.repeat(curve["load_step"].to_numpy(), len(exposed)), exposed + 1
    return pd.DataFrame(
        {"load_step": steps, "id": np.tile(ids, len(curve)), "fx_n": fx, "fz_n": fz}
    )
