"""Levels 1 and 2: scenes whose answers are formulas, and the parameters of all scenes."""

import time
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from orchestrator.benchmark.pack import Problem, expectation, table_of
from orchestrator.grains import cells
from orchestrator.grains.cells import DENSITY, DIAMETER, GRAVITY
from orchestrator.study import closed_form as study_form
from orchestrator.study import fields
from orchestrator.study.closed_form import forces, law_holds
from orchestrator.study.parts import Grain
from orchestrator.study.scene import Scene
from orchestrator.types import Row

FORMULA, CHECK, PIVOT = 1e-6, 0.01, 0.005
"""Relative tolerances."""
FLOWS = (0.5, 0.8, 1.1, 1.4)
"""Friction velocities at which the forces are asked, over that of the threshold."""
DAMPINGS = (0.05, 0.1, 0.3)
INCLINES_DEG = (5.0, 20.0, 45.0, 60.0, 70.0, 75.0)
SPEEDS = (1.0, 2.0, 5.0)
"""Starts of a sliding grain, sqrt(d g')."""
STIFFNESS = 1e4
"""K d/W of the check decks' grain."""
UNIT = float(np.sqrt(DIAMETER * GRAVITY))
"""sqrt(d g') of the check decks' grain, m/s."""
MEETING = 0.1
"""Speed of each of two colliding grains, sqrt(d g')."""
PUSHES = (1.5, 2.0, 3.0)
"""Forces on the grain that passes the criterion, over that at which it begins to roll."""
PASSING_DEG, CRITERION, PASSING_STIFFNESS = 60.0, 0.3, 1e5
"""Its entrainment angle, its criterion (d), and K d/W: springs of 1e4 would start it 1 % early."""
LEAST_QUIET = 5.0
"""Load steps shorter than this, sqrt(d/g'), are ramps: their threshold is not the closed form's."""


def closed_form(scene: Scene) -> Problem:
    """Level 1: the forces on a grain and its threshold."""
    started = time.perf_counter()
    threshold = study_form.closed_form(scene)
    flows = [float(f"{x * float(threshold.friction_velocity):.4g}") for x in FLOWS]
    rows = [
        expectation(quantity, float(force(u)), FORMULA, u)
        for quantity, force in zip(("drag_n", "lift_n"), forces(scene), strict=True)
        for u in flows
    ]
    thresholds = {
        "ustar_m_s": threshold.friction_velocity,
        "reynolds": threshold.reynolds,
        "shields": threshold.shields,
    }
    rows += [expectation(name, float(value), FORMULA) for name, value in thresholds.items()]
    seconds = time.perf_counter() - started
    asked = table_of(rows).assign(ours=lambda table: table["value"])
    return Problem(scene.id, "closed-form", parameters(scene, "closed-form"), {}, asked, seconds)


def pivot(scene: Scene, ours: float = float("nan")) -> Problem:
    """Level 2: one grain on its two neighbours; `ours` is the DEM's threshold, m/s."""
    threshold = float(study_form.closed_form(scene).friction_velocity)
    # the mean of two load steps is within half a step of what lies between them
    half = float(np.sqrt(1 + scene.protocol.load_increment))
    interval = threshold / half, threshold * half
    asked = table_of([expectation("ustar_m_s", threshold, PIVOT, interval=interval, ours=ours)])
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
    return law_holds(scene) and rolls and scene.protocol.waiting_time >= LEAST_QUIET


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
        given = _contact(damping) | {"speed_m_s": MEETING * UNIT, "time_step": 0.01}
        yield _check("collision", damping, given, [("restitution", restitution, None)])
    friction = float(np.tan(np.radians(_contact()["phi_deg"])))
    for degrees in INCLINES_DEG:  # a grain rolls or slides down a plane
        sin, cos = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        value = 5 / 7 * sin if sin < 3.5 * friction * cos else sin - friction * cos
        given = _contact() | {"incline_deg": degrees, "time_step": 0.2}
        yield _check("incline", degrees, given, [("acceleration_over_g", value, None)])
    for speed in SPEEDS:  # a grain slides until it rolls
        given = _contact() | {"speed_m_s": speed * UNIT, "time_step": 0.02}
        given["roll_time_s"] = 2 * speed * UNIT / (7 * friction * GRAVITY)
        names = ("speed_over_start", "speed_over_start", "spin_over_start")
        rows = zip(names, (6 / 7, 5 / 7, 5 / 7), (0.5, 2.0, 2.0), strict=True)
        yield _check("sliding", speed, given, rows)
    beta = np.radians(PASSING_DEG)
    x, z = float(np.cos(beta)), -float(np.sin(beta))
    grains = _three(DIAMETER * np.array([[-x, z], [x, z], [0.0, 0.0]]), DIAMETER)
    for push in PUSHES:  # a grain is pushed over its neighbour
        given = _contact(stiffness=PASSING_STIFFNESS) | {
            "alpha_deg": 0.0,
            "beta_deg": PASSING_DEG,
            "displacement_criterion": CRITERION,
            "time_step": 0.2,
        }
        given["force_n"] = push * given["weight_n"] / float(np.tan(beta))
        time_of_passing = ("passing_time_over_t", passing_time(push, CRITERION), None)
        yield _check("passing", push, given, [time_of_passing], {"grains": grains})


def _contact(damping: float = 0.1, stiffness: float = STIFFNESS) -> Row:
    """Parameters of the grain of the check decks."""
    weight = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY
    return {
        "d_m": DIAMETER,
        "rho_sol_kg_m3": DENSITY,
        "phi_deg": Grain(diameter=DIAMETER).friction_angle_deg,
        "stiffness": stiffness,
        "damping": damping,
        **mechanics(DIAMETER, DENSITY, GRAVITY, weight, stiffness),
    }


def _check(
    kind: str,
    number: float,
    given: Row,
    rows: Iterable[tuple[str, float, float | None]],
    tables: Mapping[str, pd.DataFrame] | None = None,
) -> Problem:
    """A check of a kind, named by its number; each row is a quantity, its value and its place."""
    asked = table_of(expectation(name, float(value), CHECK, at) for name, value, at in rows)
    return Problem(f"{kind}-{number:g}", kind, given, tables or {}, asked)


def push_of(scene: Mapping[str, Any]) -> float:
    """The push of a passing, from the parameters of its scene."""
    return float(scene["force_n"] * np.tan(np.radians(scene["beta_deg"])) / scene["weight_n"])


def passing_time(push: float, criterion: float) -> float:
    """Time, sqrt(d/g'), in which a pushed grain rolls over its neighbour as far as the criterion.

    It rolls without slip on a circle of radius d, from rest: the work of the force and of the
    weight is its energy, (1 + 2/5) v^2/2 by its moment of inertia.

    Parameters
    ----------
    push : float
        Force along the level bed over that at which the grain begins to roll.
    criterion : float
        Displacement along the bed, d; the grain is over its neighbour at cos(beta).
    """
    lean = np.pi / 2 - np.radians(PASSING_DEG)
    force = push * np.tan(lean)
    # the angle from the vertical is lean - u^2: the speed is proportional to u at the start
    end = np.sqrt(lean - np.arcsin(np.sin(lean) - criterion))
    nodes, weights = np.polynomial.legendre.leggauss(40)
    u = end * (nodes + 1) / 2
    angle = lean - u**2
    work = force * (np.sin(lean) - np.sin(angle)) - (np.cos(angle) - np.cos(lean))
    speed = np.sqrt(2 * work / (1 + 2 / 5))
    return float(np.sum(end / 2 * weights * 2 * u / speed))


_CONTACT = {"phi_deg", "stiffness", "damping", "spring_n_m", "time_unit_s", "time_step"}
_PROTOCOL = {"displacement_criterion", "waiting_time", "load_increment"}
_SOURCE = {"averaging_length", "loaded_grains", "mobile_layers", "turbulence_model"}
_SOLVED = {"solve_u_e_m_s", "solve_z0_m", "solve_nu_m2_s", "first_cell_m", "cells_per_face"}
_HIDDEN = {
    # settings of our meshes and methods; the domain is given by bed line and height
    *("expansion_ratio", "lid", "upstream", "downstream", "convection_scheme"),
    *("non_orthogonal_correctors", "method", "z0_over_d", "bed"),
    # what bed line, grains, stress and forces follow from: a pack has the results
    *("sizes", "poured_depth", "width", "exposure"),
    *("bed_shape", "windward", "lee_slope_deg", "brink_radius", "length", "forms", "spacing"),
    *("profile", "smoothing", "obstacles", "counted", "flow_top", "depth_m"),
}
WITHOUT_EFFECT: Mapping[str, set[str]] = {
    "closed-form": _CONTACT | _PROTOCOL,
    "pivot": set(),
    "pile": _SOURCE | _SOLVED,
    "line": {"solve_u_e_m_s"},  # the speed of the approaching flow is in the entries of level 3
}
"""Parameters of a scene without effect on the answer to a kind."""


def parameters(scene: Scene, kind: str) -> Row:
    """Parameters of a scene with its force law decided, for a problem of a kind."""
    grain = scene.grain
    values = fields.used(scene) | mechanics(
        grain.diameter, grain.density, scene.reduced_gravity, scene.weight, grain.stiffness
    )
    hidden = _HIDDEN | WITHOUT_EFFECT[kind]
    return {key: value for key, value in values.items() if value is not None and key not in hidden}


def mechanics(
    diameter: float, density: float, gravity: float, weight: float, stiffness: float
) -> dict[str, float]:
    """The mechanics of a grain in SI units; gravity is that of the submerged grain."""
    return {
        "mass_kg": density * np.pi / 6 * diameter**3,
        "reduced_gravity_m_s2": gravity,
        "weight_n": weight,
        "spring_n_m": stiffness * weight / diameter,
        "time_unit_s": float(np.sqrt(diameter / gravity)),
    }
