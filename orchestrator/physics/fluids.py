"""Density and viscosity of water, sea water and air at 1013.25 hPa.

Kell, J. Chem. Eng. Data 20, 97 (1975); Patek et al., J. Phys. Chem. Ref. Data 38, 21
(2009), which is IAPWS SR6-08; Millero and Poisson, Deep-Sea Res. 28A, 625 (1981);
Sharqawy et al., Desalin. Water Treat. 16, 354 (2010), Eq. 22; U.S. Standard Atmosphere
(1976).
"""

import math
from collections.abc import Mapping
from typing import Any

from orchestrator.errors import InputError, shown, suggestion
from orchestrator.physics.constants import GAS_BELOW

PAPER = "paper"
"""The paper's gas, by its name: in it a grain has moved when it has left its pocket.

The word decides that, and no number does."""
NUMBERS_OF_PAPER = (1.0, 1e-5)
"""Density, kg/m3, and viscosity, m2/s, of the paper's gas, which is no air of 15 deg
C. They are the defaults of a fluid of which one number is given, too."""
ALIKE = 0.005
"""Relative difference up to which two numbers are told with the same three digits."""
STANDARD_DEG_C = 15.0
"""Temperature of a fluid that is named without one, as in the standard atmosphere."""
SALINITY = 35.0
"""Salinity of sea water, g/kg."""
ZERO_C = 273.15
"""0 deg C, K."""
PRESSURE = 101_325
"""Pressure of the standard atmosphere, Pa."""
GAS_CONSTANT_OF_AIR = 287.053
"""Gas constant of dry air, J/(kg K)."""
TEMPERATURE = "temperature_deg_c"
"""The field of a temperature in a table ``[fluid]``."""


def is_gas(density: float) -> bool:
    """Say whether a fluid is a gas.

    Parameters
    ----------
    density
        Its density, kg/m3.

    Returns
    -------
    bool
        Whether it is lighter than any liquid.

    Examples
    --------
    >>> is_gas(1.2), is_gas(1000.0)
    (True, False)
    """
    return bool(density < GAS_BELOW)


def water(t: float) -> tuple[float, float]:
    """Density and viscosity of water: Kell (1975), IAPWS SR6-08.

    Parameters
    ----------
    t
        Temperature, deg C.

    Returns
    -------
    density, viscosity : float
        Density, kg/m3, and dynamic viscosity, Pa s.

    Examples
    --------
    >>> density, viscosity = water(20.0)
    >>> round(density, 2), round(viscosity, 7)
    (998.2, 0.0010016)
    """
    density = 999.83952 + 16.945176 * t - 7.9870401e-3 * t**2 - 46.170461e-6 * t**3
    density += 105.56302e-9 * t**4 - 280.54253e-12 * t**5
    terms = ((280.68, 1.9), (511.45, 7.7), (61.131, 19.6), (0.45903, 40.0))
    micro_pa_s = sum(factor * (300 / (t + ZERO_C)) ** power for factor, power in terms)
    return density / (1 + 16.879850e-3 * t), 1e-6 * micro_pa_s


def sea_water(t: float) -> tuple[float, float]:
    """Density and viscosity of sea water.

    Millero and Poisson (1981), which is UNESCO's; Sharqawy et al. (2010).

    Parameters
    ----------
    t
        Temperature, deg C.

    Returns
    -------
    density, viscosity : float
        Density, kg/m3, and dynamic viscosity, Pa s.

    Examples
    --------
    >>> density, viscosity = sea_water(15.0)
    >>> round(density, 2)
    1025.97
    """
    density, viscosity = water(t)
    salt = 0.824493 - 4.0899e-3 * t + 7.6438e-5 * t**2
    salt += -8.2467e-7 * t**3 + 5.3875e-9 * t**4
    density += salt * SALINITY + 4.8314e-4 * SALINITY**2
    density += (-5.72466e-3 + 1.0227e-4 * t - 1.6546e-6 * t**2) * SALINITY**1.5
    s = SALINITY / 1000
    first = 1.541 + 1.998e-2 * t - 9.52e-5 * t**2
    second = 7.974 - 7.561e-2 * t + 4.724e-4 * t**2
    return density, viscosity * (1 + first * s + second * s**2)


def air(t: float) -> tuple[float, float]:
    """Density and viscosity of dry air: an ideal gas, Sutherland's formula.

    U.S. Standard Atmosphere (1976).

    Parameters
    ----------
    t
        Temperature, deg C.

    Returns
    -------
    density, viscosity : float
        Density, kg/m3, and dynamic viscosity, Pa s.

    Examples
    --------
    >>> density, viscosity = air(15.0)
    >>> round(density, 3), round(viscosity, 8)
    (1.225, 1.789e-05)
    """
    kelvin = t + ZERO_C
    density = PRESSURE / (GAS_CONSTANT_OF_AIR * kelvin)
    return density, 1.458e-6 * kelvin**1.5 / (kelvin + 110.4)


FLUIDS = {
    "water": (water, 0.0, 100.0),
    "seawater": (sea_water, 0.0, 40.0),
    "air": (air, -80, 100),
}
"""By name the properties, and the temperatures, deg C, where the formulas hold."""
KINDS = (*FLUIDS, PAPER)
"""Fluids that have a name."""


def is_like_paper(density: float, viscosity: float) -> bool:
    """Say whether the numbers of a fluid are told like those of the paper's gas.

    Only words may depend on it.

    Parameters
    ----------
    density
        Density, kg/m3.
    viscosity
        Kinematic viscosity, m2/s.

    Returns
    -------
    bool
        Whether they differ by less than the digits that are told.

    Examples
    --------
    >>> is_like_paper(1.0, 1e-5), is_like_paper(1.0, 1.00001e-5)
    (True, True)
    """
    pairs = zip((density, viscosity), NUMBERS_OF_PAPER, strict=True)
    return all(math.isclose(one, other, rel_tol=ALIKE) for one, other in pairs)


def numbers_of(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table ``[fluid]`` with numbers in place of the kind of its fluid.

    Parameters
    ----------
    table
        A `kind` with its temperature, deg C, or a density (kg/m3) and a viscosity
        (m2/s). The paper's gas may have other numbers than its own.

    Returns
    -------
    dict
        The table with density and viscosity. Those of a kind have five digits, so that
        who writes them by hand asks for the same scene. The word of the paper's gas
        stays, since it decides what counts as motion.

    Raises
    ------
    InputError
        For a kind that has no formulas, a temperature beyond them, and for what is
        given twice.

    Examples
    --------
    >>> numbers_of({"kind": "water"})
    {'density': 999.1, 'viscosity': 1.1386e-06}
    >>> numbers_of({"kind": "paper", "viscosity": 1e-3})
    {'density': 1.0, 'viscosity': 0.001, 'kind': 'paper'}
    """
    rest = dict(table)
    kind = rest.pop("kind", None)
    is_warm = rest.pop(TEMPERATURE, None) is not None
    if kind is None and not is_warm:
        return rest
    _check_kind(kind)
    if kind == PAPER:
        if is_warm:
            what = "the paper's gas has none"
            raise InputError(what, f"fluid.{TEMPERATURE}", "leave it out")
        own = dict(zip(("density", "viscosity"), NUMBERS_OF_PAPER, strict=True))
        return {**own, **rest, "kind": PAPER}
    temperature = table.get(TEMPERATURE, STANDARD_DEG_C)
    _check_temperature(temperature, str(kind))
    for name in ("density", "viscosity"):
        if name in rest:
            what = f"{kind} has its own"
            raise InputError(what, f"fluid.{name}", "leave out one of the two")
    properties, _, _ = FLUIDS[str(kind)]
    density, viscosity = properties(float(temperature))
    rest["density"] = float(f"{density:.5g}")
    rest["viscosity"] = float(f"{viscosity / density:.5g}")
    return rest


def _check_kind(kind: object) -> None:
    """Refuse a fluid that has no formulas."""
    if kind in [*KINDS]:
        return
    what = f"{shown(kind)} is no fluid that is known by its name"
    if kind is None:
        what = "a temperature needs it"
    near = suggestion(str(kind), KINDS) if isinstance(kind, str) else ""
    names = near or f"write one of {', '.join(KINDS)}."
    remedy = f"{names} Of another fluid give density and viscosity"
    raise InputError(what, "fluid.kind", remedy)


def _check_temperature(temperature: Any, kind: str) -> None:
    """Refuse a temperature at which the formulas of a fluid do not hold."""
    _, low, high = FLUIDS[kind]
    # to Python a truth is a number
    is_number = isinstance(temperature, int | float)
    is_number = is_number and not isinstance(temperature, bool)
    if is_number and low <= temperature <= high:
        return
    what = f"{temperature!r} is no temperature at which the formulas of {kind} hold"
    remedy = f"{low:g} ... {high:g} deg C"
    if is_number and low <= temperature - ZERO_C <= high:
        celsius = f"{temperature - ZERO_C:.4g} deg C"
        remedy = f"did you mean {temperature:g} K, {celsius}? There is {remedy}"
    raise InputError(what, f"fluid.{TEMPERATURE}", remedy)
