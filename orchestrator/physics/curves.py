"""Reference curves of the threshold of motion on a flat bed, with source and range.

A curve is drawn in the Shields diagram, (Re*, theta_c). Many are published in another
variable, the dimensionless diameter D* = d ((s-1) g/nu^2)^(1/3); since
Re* = sqrt(theta) D*^1.5 they need no fluid to be drawn. The curves for air need one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.grain import Grain
from orchestrator.types import FloatArray

Formula = Callable[[FloatArray], FloatArray]
"""The Shields number as a function of Re* or D*."""


@dataclass(frozen=True)
class Curve:
    """One published curve for water: the Shields number as a function of Re* or D*.

    Attributes
    ----------
    name
        Authors and year, for legends.
    variable
        The variable of the formula, Re* or D*.
    low, high
        The range of that variable in which the curve was published. Where its source
        gives none, it is the range in which the curve is drawn.
    formula
        The published formula.

    Examples
    --------
    >>> soulsby = WATER[0]
    >>> reynolds, theta = soulsby.points(3)
    >>> print(theta.round(4))
    [0.268  0.033  0.0552]
    """

    name: str
    variable: Literal["Re*", "D*"]
    low: float
    high: float
    formula: Formula

    def points(self, count: int = 200) -> tuple[FloatArray, FloatArray]:
        """Compute points of the curve for the Shields diagram.

        Parameters
        ----------
        count
            Number of points, evenly spaced in the logarithm of the variable.

        Returns
        -------
        reynolds, theta
            Re* and theta_c along the curve, arrays of shape (count,).
        """
        x = np.geomspace(self.low, self.high, count)
        theta = self.formula(x)
        if self.variable == "Re*":
            return x, theta
        return np.sqrt(theta) * x**1.5, theta


def soulsby_whitehouse(dstar: FloatArray) -> FloatArray:
    """Curve of Soulsby and Whitehouse (1997).

    Parameters
    ----------
    dstar
        Dimensionless diameter D*, an array of any shape.

    Returns
    -------
    FloatArray
        Critical Shields number, of the same shape.

    Examples
    --------
    >>> print(soulsby_whitehouse(np.array([1.0, 10.0, 1000.0])).round(4))
    [0.1375 0.033  0.0552]
    """
    return 0.30 / (1 + 1.2 * dstar) + 0.055 * (1 - np.exp(-0.02 * dstar))


def paphitis(reynolds: FloatArray) -> FloatArray:
    """Mean curve of Paphitis (2001).

    Parameters
    ----------
    reynolds
        Friction Reynolds number Re*, an array of any shape.

    Returns
    -------
    FloatArray
        Critical Shields number, of the same shape.

    Examples
    --------
    >>> print(paphitis(np.array([1.0, 100.0])).round(4))
    [0.1088 0.042 ]
    """
    return 0.188 / (1 + reynolds) + 0.0475 * (1 - 0.699 * np.exp(-0.015 * reynolds))


def brownlie(dstar: FloatArray) -> FloatArray:
    """Curve of Brownlie (1981), whose grain Reynolds number is D*^1.5.

    Parameters
    ----------
    dstar
        Dimensionless diameter D*, an array of any shape.

    Returns
    -------
    FloatArray
        Critical Shields number, of the same shape.

    Examples
    --------
    >>> print(brownlie(np.array([2.0, 100.0])).round(4))
    [0.1179 0.0488]
    """
    y = dstar**-0.9
    return 0.22 * y + 0.06 * 10 ** (-7.7 * y)


def mantz(reynolds: FloatArray) -> FloatArray:
    """Curve of Mantz (1977).

    Parameters
    ----------
    reynolds
        Friction Reynolds number Re*, an array of any shape.

    Returns
    -------
    FloatArray
        Critical Shields number, of the same shape.

    Examples
    --------
    >>> print(mantz(np.array([0.1, 1.0])).round(4))
    [0.1995 0.1   ]
    """
    return 0.1 * reynolds**-0.3


def yalin_karahan(reynolds: FloatArray) -> FloatArray:
    """Curve of Yalin and Karahan (1979), that of Mantz up to Re* = 1.

    Parameters
    ----------
    reynolds
        Friction Reynolds number Re*, an array of any shape.

    Returns
    -------
    FloatArray
        Critical Shields number, of the same shape.

    Examples
    --------
    >>> print(yalin_karahan(np.array([0.5, 10.0, 100.0])).round(4))
    [0.1231 0.0316 0.045 ]
    """
    log = np.log(reynolds)
    middle = np.exp(-2.26 - 0.905 * log + 0.168 * log**2)
    return np.select([reynolds <= 1, reynolds <= 60], [mantz(reynolds), middle], 0.045)


def van_rijn(dstar: FloatArray) -> FloatArray:
    """Curve of van Rijn (1984).

    Parameters
    ----------
    dstar
        Dimensionless diameter D*, an array of any shape.

    Returns
    -------
    FloatArray
        Critical Shields number, of the same shape.

    Examples
    --------
    >>> print(van_rijn(np.array([2.0, 8.0, 15.0, 100.0, 200.0])).round(4))
    [0.12   0.037  0.0305 0.0494 0.055 ]
    """
    return np.select(
        [dstar <= 4, dstar <= 10, dstar <= 20, dstar <= 150],
        [
            0.24 / dstar,
            0.14 * dstar**-0.64,
            0.04 * dstar**-0.1,
            0.013 * dstar**0.29,
        ],
        0.055,
    )


WATER = (
    Curve("Soulsby & Whitehouse 1997", "D*", 0.1, 1000.0, soulsby_whitehouse),
    Curve("Paphitis 2001, mean", "Re*", 0.01, 1e5, paphitis),
    Curve("Brownlie 1981", "D*", 3 ** (2 / 3), 9000 ** (2 / 3), brownlie),
    Curve("Mantz 1977", "Re*", 0.03, 1.0, mantz),
    Curve("Yalin & Karahan 1979", "Re*", 0.03, 1000.0, yalin_karahan),
    Curve("van Rijn 1984", "D*", 1.0, 1000.0, van_rijn),
)
"""Curves fitted to grains in liquids."""


def bagnold(grain: Grain) -> FloatArray:
    """Threshold friction velocity of Bagnold (1941), with A = 0.1.

    Parameters
    ----------
    grain
        The grains in their gas.

    Returns
    -------
    FloatArray
        Threshold friction velocity, m/s, of the shape of the grains.

    Examples
    --------
    >>> air = {"fluid_density": 1.2, "viscosity": 1.5e-5}
    >>> print(bagnold(Grain(diameter=[3e-4], density=2650.0, **air)).round(4))
    [0.2549]
    """
    return np.asarray(0.1 * grain.unit_ustar)


GAMMA = 3e-4
"""Cohesion of the formula of Shao and Lu, N/m.

They give 1.65e-4 to 5e-4. This is the number of Y. Shao's own routine of June 2000, as
public models of dust have it, and so the one that is meant by the formula's name.
"""


def shao_lu(grain: Grain) -> FloatArray:
    """Threshold friction velocity of Shao and Lu (2000), with the cohesion `GAMMA`.

    Parameters
    ----------
    grain
        The grains in their gas.

    Returns
    -------
    FloatArray
        Threshold friction velocity, m/s, of the shape of the grains.

    Examples
    --------
    >>> air = {"fluid_density": 1.2, "viscosity": 1.5e-5}
    >>> print(shao_lu(Grain(diameter=[5e-5, 3e-4], density=2650.0, **air)).round(4))
    [0.2735 0.3003]
    """
    cohesion = GAMMA / (grain.fluid_density * grain.diameter)
    of_weight = grain.density_ratio * grain.gravity * grain.diameter
    return np.asarray(np.sqrt(0.0123 * (of_weight + cohesion)))


ITERATIONS = 200
"""Steps of the fixed-point iteration of `iversen_white`."""


def iversen_white(grain: Grain) -> FloatArray:
    """Threshold friction velocity of Iversen and White (1982), implicit in Re*.

    The root is found by fixed-point iteration over Re* = u* d/nu.

    Parameters
    ----------
    grain
        The grains in their gas.

    Returns
    -------
    FloatArray
        Threshold friction velocity, m/s, of the shape of the grains.

    Examples
    --------
    >>> air = {"fluid_density": 1.2, "viscosity": 1.5e-5}
    >>> sand = Grain(diameter=[5e-5, 3e-4], density=2650.0, **air)
    >>> print(iversen_white(sand).round(4))
    [0.2183 0.2941]
    """
    diameter = grain.diameter
    cohesion = 1 + 6e-7 / (grain.density * grain.gravity * diameter**2.5)
    scale = np.sqrt(grain.density_ratio * grain.gravity * diameter * cohesion)
    ustar = 0.12 * scale
    for _ in range(ITERATIONS):
        reynolds = np.maximum(grain.reynolds(ustar), 0.03)
        # each branch is bounded to its own range: 1.928 Re^0.092 > 1 for Re > 0.001
        slow_reynolds = np.minimum(reynolds, 10)
        fast_reynolds = np.maximum(reynolds, 10)
        slow = 0.129 * scale / np.sqrt(1.928 * slow_reynolds**0.092 - 1)
        fast = 0.12 * scale * (1 - 0.0858 * np.exp(-0.0617 * (fast_reynolds - 10)))
        ustar = np.where(reynolds <= 10, slow, fast)
    return ustar


AIR: dict[str, Callable[[Grain], FloatArray]] = {
    "Bagnold 1941": bagnold,
    "Shao & Lu 2000": shao_lu,
    "Iversen & White 1982": iversen_white,
}
"""Curves for grains in air, cohesion included where their authors do."""


def slope_factor_on_ustar(
    slope_deg: FloatArray,
    friction_angle_deg: float,
) -> FloatArray:
    """Compute the factor on the threshold friction velocity in air on a slope.

    It is ``sqrt(cos(alpha) + sin(alpha)/tan(phi))``.

    Parameters
    ----------
    slope_deg
        Slope alpha, degrees, positive where the flow goes up it.
    friction_angle_deg
        Friction angle phi of the grains, degrees.

    Returns
    -------
    FloatArray
        Factor on u*, of the shape of the slope.

    Examples
    --------
    >>> print(slope_factor_on_ustar(np.array([0.0, 15.0]), 30.0).round(4))
    [1.     1.1892]
    """
    alpha = np.radians(slope_deg)
    factor = np.cos(alpha) + np.sin(alpha) / np.tan(np.radians(friction_angle_deg))
    return np.asarray(np.sqrt(factor))


def of_medium(grain: Grain) -> FloatArray:
    """Find the threshold on a level bed by the formula of the grains' medium.

    It is that of Soulsby and Whitehouse in a liquid and that of Shao and Lu in a gas,
    also beyond what they were fitted to.

    Parameters
    ----------
    grain
        The grains in their fluids.

    Returns
    -------
    FloatArray
        Shields numbers, of the shape of the grains.

    Examples
    --------
    >>> fluids = {"fluid_density": [1000.0, 1.2], "viscosity": [1e-6, 1.5e-5]}
    >>> print(of_medium(Grain(diameter=1e-3, density=2650.0, **fluids)).round(4))
    [0.0314 0.0124]
    """
    in_liquid = soulsby_whitehouse(grain.dimensionless_diameter)
    in_gas = grain.shields(shao_lu(grain))
    return np.where(grain.fluid_density < GAS_BELOW, in_gas, in_liquid)
