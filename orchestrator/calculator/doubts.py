"""Questions about numbers that are usual in another unit: millimetres for metres, and the like."""

from collections.abc import Iterator, Mapping

import numpy as np

from orchestrator.calculator.parameters import VISCOSITY
from orchestrator.calculator.table import GAS_BELOW

LARGEST_USUAL = 0.05
"""Diameter from which one in millimetres is likelier, m: the finest sand has 0.06 mm."""
MICROMETRES_FROM = 20.0
LIGHTEST = 30.0
"""Density of a grain below which g/cm3 are likelier, kg/m3; fresh snow has 50."""
STRONGEST = 50.0
"""Gravity above which cm/s2 are likelier, m/s2."""
RADIANS = {"slope_deg": (0.05, 0.55), "entrainment_angle_deg": (0.0, np.pi / 2)}
"""Degrees that are a usual angle in radians."""
GAS, LIQUID = (3e-6, 1e-4), (1e-4, 0.1)
"""Usual dynamic viscosities, Pa s."""


def questions(largest: Mapping[str, float]) -> dict[str, str]:
    """Questions on parameters that look like another unit, by name.

    Parameters
    ----------
    largest : mapping
        The largest value of each parameter, so that a range is asked about as a whole.
    """
    asked = {
        "diameter": _diameter(largest["diameter"]),
        "density": _density(largest["density"]),
        "viscosity": _fluid(largest["fluid_density"], largest["viscosity"]),
        "slope_deg": _angle("--slope", "slope_deg", largest),
        "entrainment_angle_deg": _angle("--entrainment-angle", "entrainment_angle_deg", largest),
        "lift_coefficient": _lift(largest["lift_coefficient"]),
        "gravity": _gravity(largest["gravity"]),
    }
    return {name: question for name, question in asked.items() if question}


def _diameter(d: float) -> str:
    if d < LARGEST_USUAL:
        return ""
    unit, factor = ("mm", 1e-3) if d < MICROMETRES_FROM else ("um", 1e-6)
    return f"{d:g} m: did you mean {d:g} {unit}, --diameter {d * factor:g}?"


def _density(rho: float) -> str:
    if not 0 < rho < LIGHTEST:
        return ""
    return f"{rho:g} kg/m3: did you mean {rho:g} g/cm3, --density {rho * 1000:g}?"


def _angle(option: str, name: str, largest: Mapping[str, float]) -> str:
    angle, (low, high) = largest[name], RADIANS[name]
    if not low < angle <= high:
        return ""
    return f"{angle:g} deg: did you mean {angle:g} rad, {option} {np.degrees(angle):.3g}?"


def _lift(alpha: float) -> str:
    if not 6 < alpha < 7:
        return ""
    return f"{alpha:g}: did you mean Saffman's for the radius, --lift-coefficient {alpha / 4:g}?"


def _gravity(g: float) -> str:
    if g < STRONGEST:
        return ""
    return f"{g:g} m/s2: did you mean {g:g} cm/s2, --gravity {g / 100:g}?"


def _fluid(rho: float, nu: float) -> str:
    """A fluid is known by its dynamic viscosity; a liquid with that of air has been forgotten."""
    if not (rho > 0 and nu > 0):
        return ""
    if _is_usual(rho, nu):
        forgotten = rho >= GAS_BELOW and nu == VISCOSITY.default
        return f"{nu:g} m2/s is air's: did you mean water, --viscosity 1e-06?" if forgotten else ""
    meant = " or ".join(_other_units(rho, nu))
    kind = "gas" if rho < GAS_BELOW else "liquid"
    unusual = f"{nu:g} m2/s, or {rho * nu:.3g} Pa s, is unusual for a {kind} of {rho:g} kg/m3"
    return f"{unusual}: did you mean {meant}?" if meant else f"{unusual}: is it right?"


def _other_units(rho: float, nu: float) -> Iterator[str]:
    """Units in which the same numbers are a usual fluid."""
    if _is_usual(rho * 1000, nu):
        yield f"{rho:g} g/cm3, --fluid-density {rho * 1000:g}"
    for factor, said in (
        (1 / rho, f"{nu:g} Pa s"),
        (1e-6, f"{nu:g} mm2/s"),
        (1e-5, f"{nu:g}e-5 m2/s"),
        (1e-4, f"{nu:g} cm2/s"),
    ):
        if _is_usual(rho, nu * factor):
            yield f"{said}, --viscosity {nu * factor:.4g}"


def _is_usual(rho: float, nu: float) -> bool:
    low, high = GAS if rho < GAS_BELOW else LIQUID
    return low <= rho * nu <= high
