"""Parameters of the closed form of a grain, by every name that they have."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from orchestrator.errors import InputError
from orchestrator.physics.constants import GRAVITY, LIFT_COEFFICIENT


@dataclass(frozen=True)
class Parameter:
    """One number that the closed form depends on.

    Attributes
    ----------
    name : str
        Name of the keyword, also in JSON.
    option : str
        Option of the command line.
    field : str
        Field of a study file; the depth has none.
    column : str
        Column of a table, with the unit.
    label : str
        Symbol and unit, for people.
    default : float or str or None
        None: there is none.
    note : str
        For the help.
    geometric : bool
        Whether a range of it is spaced geometrically.
    """

    name: str
    option: str
    field: str
    column: str
    label: str
    default: float | str | None = None
    note: str = ""
    geometric: bool = False


DIAMETER = Parameter("diameter", "--diameter", "grain.diameter", "d_m", "d, m", geometric=True)
DENSITY = Parameter(
    "density", "--density", "grain.density", "rho_sol_kg_m3", "rho_sol, kg/m3", 2500.0
)
FLUID_DENSITY = Parameter(
    *("fluid_density", "--fluid-density", "fluid.density", "rho_f_kg_m3", "rho_f, kg/m3"),
    default=1.0,
    note="water: 1000",
)
VISCOSITY = Parameter(
    *("viscosity", "--viscosity", "fluid.viscosity", "nu_m2_s", "nu, m2/s"),
    default=1e-5,
    note="kinematic; water: 1e-6",
    geometric=True,
)
SLOPE = Parameter(
    *("slope_deg", "--slope", "bed.slope_deg", "alpha_deg", "alpha, deg"),
    default=0.0,
    note="the flow goes up it",
)
ENTRAINMENT_ANGLE = Parameter(
    *("entrainment_angle_deg", "--entrainment-angle", "bed.entrainment_angle_deg"),
    *("beta_deg", "beta, deg"),
    default=60.0,
)
ROUGHNESS = Parameter(
    *("roughness", "--roughness", "bed.roughness", "z0_m", "z0, m"),
    default="d/30",
    note='or a part of the diameter as "d/10"',
    geometric=True,
)
LIFT = Parameter(
    *("lift_coefficient", "--lift-coefficient", "forces.lift_coefficient", "alpha_s", "alpha_s"),
    default=LIFT_COEFFICIENT,
)
G = Parameter("gravity", "--gravity", "fluid.gravity", "g_m_s2", "g, m/s2", GRAVITY)
DEPTH = Parameter(
    *("depth", "--depth", "depth", "depth_m", "depth, m"),
    note="of a liquid, for its mean velocity",
    geometric=True,
)

SCENE = (
    DIAMETER,
    DENSITY,
    FLUID_DENSITY,
    VISCOSITY,
    SLOPE,
    ENTRAINMENT_ANGLE,
    ROUGHNESS,
    LIFT,
    G,
)
"""Parameters of a scene. The paper's values are the defaults."""
PARAMETERS = (*SCENE, DEPTH)
OPTION_OF = {parameter.field: parameter.option for parameter in PARAMETERS}
"""Options of the command line by the fields of a study file."""


def renamed(error: InputError, names: Mapping[str, str]) -> InputError:
    """The same refusal, with other names for the fields of a study file."""
    prefix, colon, field = error.where.rpartition(": ")

    def named(text: str) -> str:
        return re.sub(r"\b[a-z]+\.[a-z_]+\b", lambda found: names.get(found[0], found[0]), text)

    where = f"{prefix}{colon}{names.get(field, field)}"
    return InputError(named(error.what), where=where, remedy=named(error.remedy))
