"""Plain words for grains, fluids and flows, for answer cards; nothing here is slow."""

import math
from typing import NamedTuple

from orchestrator import digits
from orchestrator.digits import plain_number
from orchestrator.physics.fluids import is_gas, is_like_paper
from orchestrator.study.profile import Profile

SIZES = (
    (6.3e-5, "silt"),
    (2e-3, "sand"),
    (6.4e-2, "gravel"),
    (math.inf, "cobbles"),
)
"""Names of grains below some diameters, m, as in soil mechanics (ISO 14688)."""
QUARTZ = 2650.0
"""Density of quartz, kg/m3."""
AIR = ((0.9, 1.5), (1.1e-5, 2.0e-5))
"""Densities (kg/m3) and viscosities (m2/s) of air near the ground."""
WATER = ((985.0, 1035.0), (5e-7, 2e-6))
"""The same of water in rivers and the sea."""
TERMS = {
    "u*": "friction velocity u*: √(τ_b/ρ), with the bed shear stress τ_b and the "
    "density ρ of the fluid",
    "shields": "Shields number θ: τ_b/((ρ_s − ρ) g d), with the density ρ_s of the "
    "grains",
    "shields_of_bed": "Shields number θ: the mean wall stress on the entrained grains "
    "over (ρ_s − ρ) g d, with the density ρ_s of the grains; on a form it is not that "
    "of the undisturbed flow",
    "re": "grain Reynolds number Re*: u*d/ν",
}
"""Terms in plain words."""


class ReportedQuantity(NamedTuple):
    """What a flow is told by.

    Attributes
    ----------
    stem
        Its column, without ending and unit.
    unit
        Its unit.
    flow
        The flow that has it, in questions: wind, flow.
    name
        The quantity in words.
    place
        Where it is measured.
    """

    stem: str
    unit: str
    flow: str
    name: str
    place: str

    def column(self, end: str = "") -> str:
        """Name its column.

        Parameters
        ----------
        end
            Ending such as ``_low``.

        Returns
        -------
        str
            The name, with its unit.
        """
        unit = {"m/s": "m_s", "Pa": "pa", "m": "m"}[self.unit]
        return f"{self.stem}{end}_{unit}"


WIND_HEIGHT_M = 10.0
"""Height above the ground at which a wind is told, m."""
WIND = ReportedQuantity("wind_10m", "m/s", "wind", "wind", "10 m above the ground")
MEAN = ReportedQuantity(
    "mean_velocity", "m/s", "flow", "mean velocity", "over the depth"
)
STRESS = ReportedQuantity("stress", "Pa", "flow", "stress", "of the undisturbed flow")
DEPTH = ReportedQuantity("depth", "m", "flow", "depth", "of the flow")
USTAR = ReportedQuantity(
    "ustar0", "m/s", "flow", "friction velocity", "of the flow upstream"
)


def has_wind(density: float, depth: float) -> bool:
    """Say whether a flow is a wind that is told 10 m above the ground.

    Parameters
    ----------
    density
        Density of the fluid, kg/m3.
    depth
        Depth of the flow, m; NaN where it has none.

    Returns
    -------
    bool
        Whether it is of a gas, and that high.

    Examples
    --------
    >>> has_wind(1.225, float("nan")), has_wind(1.225, 0.1), has_wind(1000.0, 20.0)
    (True, False, False)
    """
    return is_gas(density) and not depth < WIND_HEIGHT_M


def fluid(density: float, viscosity: float) -> str:
    """Name a fluid.

    Parameters
    ----------
    density
        Its density, kg/m3.
    viscosity
        Its kinematic viscosity, m2/s.

    Returns
    -------
    str
        Its name with an article where it needs one, and its numbers where it has none.

    Examples
    --------
    >>> fluid(1.225, 1.46e-5), fluid(1000.0, 1e-6), fluid(1.0, 1e-5)
    ('air', 'water', 'the article’s gas (1 kg/m³, 1.0 × 10⁻⁵ m²/s), close to air')
    """
    numbers = f"{plain_number(density, 4)} kg/m³, {plain_number(viscosity)} m²/s"
    if is_like_paper(density, viscosity):
        return f"the article’s gas ({numbers}), close to air"
    kind = "gas" if is_gas(density) else "liquid"
    return name_of_fluid(density, viscosity) or f"a {kind} of {numbers}"


def name_of_fluid(density: float, viscosity: float) -> str:
    """Name air and water.

    Parameters
    ----------
    density
        Density of a fluid, kg/m3.
    viscosity
        Its kinematic viscosity, m2/s.

    Returns
    -------
    str
        The name; empty of another fluid.

    Examples
    --------
    >>> name_of_fluid(1.225, 1.46e-5), name_of_fluid(1.0, 1e-5)
    ('air', '')
    """
    if is_like_paper(density, viscosity):
        return ""
    for name, (densities, viscosities) in (("air", AIR), ("water", WATER)):
        is_dense = densities[0] <= density <= densities[1]
        is_viscous = viscosities[0] <= viscosity <= viscosities[1]
        if is_dense and is_viscous:
            return name
    return ""


def length(metres: float) -> str:
    """Write a length: in metres from 1 m on, else in millimetres.

    Parameters
    ----------
    metres
        The length, m.

    Returns
    -------
    str
        The text.

    Examples
    --------
    >>> length(40.0), length(3e-4)
    ('40 m', '0.3 mm')
    """
    return digits.metres(metres)


def digits_of_place(profile: Profile) -> int:
    """Count the digits behind the point that places on a profile are told with, m.

    They are known to a hundredth or a thousandth of its length.

    Returns
    -------
    int
        The count.
    """
    return max(0, 2 - math.floor(math.log10(profile.x[-1])))


def place_of_file(x: float, profile: Profile) -> str:
    """Write x of the file of a profile with the digits that matter.

    Parameters
    ----------
    x
        The place, m.
    profile
        The profile.

    Returns
    -------
    str
        The number.
    """
    return f"{x:.{digits_of_place(profile)}f}"


def kind_of_grain(diameter: float) -> str:
    """Name grains of a diameter.

    Parameters
    ----------
    diameter
        Their diameter, m.

    Returns
    -------
    str
        One of `SIZES`.

    Examples
    --------
    >>> kind_of_grain(3e-4)
    'sand'
    """
    return next(name for limit, name in SIZES if diameter < limit)


def solid(density: float) -> str:
    """Name what grains are of.

    Parameters
    ----------
    density
        Their density, kg/m3.

    Returns
    -------
    str
        Quartz, or the density.

    Examples
    --------
    >>> solid(2650.0), solid(7800.0)
    ('quartz', '7800 kg/m³')
    """
    return "quartz" if density == QUARTZ else f"{density:g} kg/m³"
