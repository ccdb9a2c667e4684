"""The scenes of level 2 that check the contact law, on the grain of the decks."""

from collections.abc import Iterator

import numpy as np

from orchestrator.bed.deck import DENSITY, DIAMETER, GRAVITY
from orchestrator.benchmark.mechanics import mechanics, three_grains
from orchestrator.benchmark.pack import Problem, expectation
from orchestrator.study.parts import GrainPart
from orchestrator.types import Row

CHECK = 0.01
"""Relative tolerance of the answers."""
DAMPINGS = (0.05, 0.1, 0.3)
"""Damping ratios of collisions."""
INCLINES_DEG = (5.0, 20.0, 45.0, 60.0, 70.0, 75.0)
MEETING = 0.1
"""Speed of each of two colliding grains, sqrt(d g')."""
SPEEDS = (1.0, 2.0, 5.0)
"""Speeds of a grain that begins to slide, sqrt(d g')."""
PASSING_DEG = 60.0
"""Entrainment angle of the grain that passes the criterion."""
CRITERION = 0.3
"""Its displacement criterion, d."""
PUSHES = (1.5, 2.0, 3.0)
"""Forces on it over that at which it begins to roll."""
STIFFNESS = 1e4
"""K d/W of the decks' grain."""
PASSING_STIFFNESS = 1e5
"""That of the grain that passes: springs of 1e4 would start it 1 % early."""
UNIT = float(np.sqrt(DIAMETER * GRAVITY))
"""sqrt(d g') of the decks' grain, m/s."""
Question = tuple[str, float, float | None]
"""Quantity, exact value, and the argument of a quantity that is a function."""


def all_checks() -> Iterator[Problem]:
    """Make the scenes that check the contact law.

    Yields
    ------
    Problem
        The scenes, with exact answers and without ours.
    """
    friction_deg = GrainPart(diameter=DIAMETER).friction_angle_deg
    friction = float(np.tan(np.radians(friction_deg)))
    for damping in DAMPINGS:
        yield _collision(damping)
    for degrees in INCLINES_DEG:
        yield _incline(degrees, friction)
    for speed in SPEEDS:
        yield _sliding(speed, friction)
    for push in PUSHES:
        yield _passing(push)


def _collision(damping: float) -> Problem:
    """Two grains meet; the contact ends where the force does."""
    root = np.sqrt(1 - damping**2)
    restitution = np.exp(-damping / root * (np.pi - 2 * np.arcsin(damping)))
    given = _contact(0.01, damping) | {"speed_m_s": MEETING * UNIT}
    return _problem("collision", damping, given, ("restitution", restitution, None))


def _incline(degrees: float, friction: float) -> Problem:
    """A grain rolls or slides down a plane."""
    sin = np.sin(np.radians(degrees))
    cos = np.cos(np.radians(degrees))
    rolls = sin < 3.5 * friction * cos
    value = 5 / 7 * sin if rolls else sin - friction * cos
    given = _contact(0.2) | {"incline_deg": degrees}
    return _problem("incline", degrees, given, ("acceleration_over_g", value, None))


def _sliding(speed: float, friction: float) -> Problem:
    """A grain slides until it rolls."""
    given = _contact(0.02) | {"speed_m_s": speed * UNIT}
    given["roll_time_s"] = 2 * speed * UNIT / (7 * friction * GRAVITY)
    return _problem(
        "sliding",
        speed,
        given,
        ("speed_over_start", 6 / 7, 0.5),
        ("speed_over_start", 5 / 7, 2.0),
        ("spin_over_start", 5 / 7, 2.0),
    )


def _passing(push: float) -> Problem:
    """A grain is pushed over its neighbour."""
    beta = np.radians(PASSING_DEG)
    x = float(np.cos(beta))
    z = -float(np.sin(beta))
    given = _contact(0.2, stiffness=PASSING_STIFFNESS)
    given["alpha_deg"] = 0.0
    given["beta_deg"] = PASSING_DEG
    given["displacement_criterion"] = CRITERION
    given["force_n"] = push * given["weight_n"] / float(np.tan(beta))
    time = passing_time(push, CRITERION)
    problem = _problem("passing", push, given, ("passing_time_over_t", time, None))
    centres = DIAMETER * np.array([[-x, z], [x, z], [0.0, 0.0]])
    return problem.with_table("grains", three_grains(centres, DIAMETER))


def _problem(kind: str, number: float, given: Row, *questions: Question) -> Problem:
    """A check deck of a kind, which a number tells from others."""
    rows = []
    for quantity, exact, at in questions:
        row = expectation(quantity, float(exact), CHECK, at)
        row["ours"] = np.nan
        rows.append(row)
    return Problem(f"{kind}-{number:g}", kind, given, {}, rows)


def _contact(
    time_step: float, damping: float = 0.1, stiffness: float = STIFFNESS
) -> Row:
    """Parameters of the grain of the check decks."""
    weight = DENSITY * np.pi / 6 * DIAMETER**3 * GRAVITY
    return {
        "d_m": DIAMETER,
        "rho_sol_kg_m3": DENSITY,
        "time_step": time_step,
        "damping": damping,
        "phi_deg": GrainPart(diameter=DIAMETER).friction_angle_deg,
        "stiffness": stiffness,
        **mechanics(DIAMETER, DENSITY, GRAVITY, weight, stiffness),
    }


def passing_time(push: float, criterion: float) -> float:
    """Find the time in which a pushed grain rolls over its neighbour.

    It rolls without slip on a circle of radius d, from rest: the work of the force and
    of the weight is its energy, (1 + 2/5) v^2/2 by its moment of inertia.

    Parameters
    ----------
    push
        The force along the level bed over that at which the grain begins to roll.
    criterion
        The displacement along the bed, d.

    Returns
    -------
    float
        The time, sqrt(d/g').
    """
    lean = np.pi / 2 - np.radians(PASSING_DEG)
    force = push * np.tan(lean)
    # the angle from the vertical is lean - u^2: the speed is proportional to u at the
    # start
    end = np.sqrt(lean - np.arcsin(np.sin(lean) - criterion))
    nodes, weights = np.polynomial.legendre.leggauss(40)
    u = end * (nodes + 1) / 2
    angle = lean - u**2
    work = force * (np.sin(lean) - np.sin(angle)) - (np.cos(angle) - np.cos(lean))
    speed = np.sqrt(2 * work / (1 + 2 / 5))
    return float(np.sum(end / 2 * weights * 2 * u / speed))
