"""The command `threshold`: closed-form thresholds of single grains.

Here are its parameters and results, by every name that they have.
"""

from typing import NamedTuple

from orchestrator.physics import fluids
from orchestrator.physics.constants import (
    CHANNEL,
    GRAIN_COLUMNS,
    GRAVITY,
    LIFT_COEFFICIENT,
    SLOPE,
)


class Parameter(NamedTuple):
    """A number that the closed form depends on.

    Attributes
    ----------
    field
        Its name in a study file; those of `OF_FLOW` are in none.
    column
        Its column of the table, with the unit.
    label
        Its symbol and unit, for people.
    ordinary
        The range in which no limit of a scene can be exceeded.
    default
        Its default: a number, or a part of the diameter.
    note
        What the help of the command adds.
    """

    field: str
    column: str
    label: str
    ordinary: tuple[float, float]
    default: float | str | None = None
    note: str = ""


MOST_POINTS = 100_000
"""Largest number of points of a table."""
PARAMETERS = {
    "diameter": Parameter(
        "grain.diameter", GRAIN_COLUMNS["diameter"], "d, m", (1e-7, 10)
    ),
    "density": Parameter(
        "grain.density", GRAIN_COLUMNS["density"], "rho_sol, kg/m3", (1, 2e4), 2500.0
    ),
    "fluid_density": Parameter(
        "fluid.density",
        GRAIN_COLUMNS["fluid_density"],
        "rho_f, kg/m3",
        (1e-6, 2e4),
        fluids.NUMBERS_OF_PAPER[0],
    ),
    "viscosity": Parameter(
        "fluid.viscosity",
        GRAIN_COLUMNS["viscosity"],
        "nu, m2/s",
        (1e-8, 1e3),
        fluids.NUMBERS_OF_PAPER[1],
    ),
    "slope_deg": Parameter(
        "bed.slope_deg",
        GRAIN_COLUMNS["slope_deg"],
        "alpha, deg",
        (0, 30),
        0.0,
        note="the flow goes up it",
    ),
    "entrainment_angle_deg": Parameter(
        "bed.entrainment_angle_deg",
        GRAIN_COLUMNS["entrainment_angle_deg"],
        "beta, deg",
        (30, 60),
        60.0,
    ),
    "roughness": Parameter(
        "bed.roughness",
        GRAIN_COLUMNS["roughness"],
        "z0, m",
        (1e-12, 1),
        "d/30",
        note='or such a part: "d/10"',
    ),
    "lift_coefficient": Parameter(
        "forces.lift_coefficient",
        GRAIN_COLUMNS["lift_coefficient"],
        "alpha_s",
        (0, 100),
        LIFT_COEFFICIENT,
    ),
    "gravity": Parameter(
        "fluid.gravity", GRAIN_COLUMNS["gravity"], "g, m/s2", (1e-5, 1e4), GRAVITY
    ),
    "cohesion": Parameter(
        "grain.cohesion",
        GRAIN_COLUMNS["cohesion"],
        "cohesion, N/m",
        (0, 1e3),
        0.0,
        note="pull of a contact over d",
    ),
    "depth": Parameter(
        "depth",
        "depth_m",
        "depth, m",
        (0, 0),
        note="of a liquid: its mean speed and its discharge",
    ),
    "bed_slope": Parameter(
        "bed_slope",
        SLOPE,
        "S",
        (0, 0),
        note=(
            "slope at which a channel falls, such as 0.005, whatever its sign: depth "
            "and mean velocity at which its uniform flow starts motion"
        ),
    ),
    "channel_roughness": Parameter(
        "channel_roughness",
        CHANNEL,
        "z0 of the channel or the ground, m",
        (0, 0),
        note=(
            "speeds and discharge follow from it, a thirtieth of Nikuradse's roughness "
            "k_s; default: in a channel d84/10, which is k_s = 3 d84, else that of the "
            "grain's pocket"
        ),
    ),
    "d84": Parameter(
        "d84",
        "d84_m",
        "d84, m",
        (0, 0),
        note="84 % by mass of the bed of a channel are finer; default: the diameter",
    ),
}
"""By keyword, which is also the name in JSON. The paper's values are the defaults."""
OF_FLUID = {"fluid_density": "density", "viscosity": "viscosity"}
"""Parameters that a fluid has by its name, as a table ``[fluid]`` calls them."""
OF_FLOW = ("depth", "bed_slope", "channel_roughness", "d84")
"""Parameters of the flow over the grains, on which no stress depends."""
LARGEST_DEPTH = 1e4
"""Largest depth of a flow, m, as in a study file."""
LENGTHS = ("roughness", "channel_roughness")
"""Parameters that may be parts of the diameter."""
GEOMETRIC = ("diameter", "viscosity", *LENGTHS, "depth", "bed_slope", "d84")
"""Parameters whose ranges are geometric; all others are spaced evenly."""
QUANTITIES = {
    "ustar_m_s": ("friction_velocity", "u*, m/s"),
    "wind_1m_m_s": ("wind_speed_1_m", "wind at 1 m, m/s"),
    "wind_10m_m_s": ("wind_speed_10_m", "wind at 10 m, m/s"),
    "current_1m_m_s": ("current_1_m", "current at 1 m, m/s"),
    "mean_velocity_m_s": ("mean_velocity", "mean velocity, m/s"),
    "discharge_m2_s": ("discharge", "discharge, m2/s"),
    "stress_pa": ("stress", "stress, Pa"),
    "shields": ("shields", "Shields"),
    "reynolds": ("reynolds", "Re*"),
    "drag_n": ("drag", "drag, N"),
    "lift_n": ("lift", "lift, N"),
}
"""Columns of a threshold, each with its name in JSON, and its symbol and unit."""
BESIDE_CHANNEL = {
    "mean_velocity_3d84_m_s": "k_s = 3 d84",
    "mean_velocity_strickler_m_s": "Strickler, 21.1/d^(1/6)",
    "mean_velocity_grains_m_s": "grains alone, pocket z₀",
}
"""Columns of the mean velocity of the same depth by other roughnesses of a channel."""
ENTRAINED, SUSTAINED = "entrained", "sustained"
CRITERIA = (ENTRAINED, SUSTAINED)
"""What a grain must do to count: leave its pocket, or also move on after a gust."""
BY_FLUID = "auto"
"""The criterion that fluid and law decide: `ENTRAINED` in the paper's gas and under its
laws, `SUSTAINED` in all other fluids."""
OF_CRITERION = {
    "shields_entrained": "entrained",
    "shields_sustained": "sustained",
    "shields_sustained_low": "at least",
    "shields_sustained_high": "at most",
    "shields_cessation": "ceases",
    "decides": "decides",
}
"""Columns of a threshold of sustained motion, each with its head for people."""
