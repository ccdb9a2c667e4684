"""Reference curves of the threshold of motion on a flat bed, each with its source and range.

A curve is drawn in the Shields diagram, (Re*, theta_c). Many are published in another variable,
the dimensionless diameter D* = d ((s-1) g/nu^2)^(1/3); since Re* = sqrt(theta) D*^1.5 they need no
fluid to be drawn. The curves for air need one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from orchestrator.physics.constants import GRAVITY
from orchestrator.types import FloatArray

Formula = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Curve:
    """One published curve for water: the Shields number as a function of Re* or D*.

    ``low`` and ``high`` are the range of that variable in which the curve was published; where its
    source gives none, the range in which it is drawn.
    """

    name: str
    variable: Literal["Re*", "D*"]
    low: float
    high: float
    formula: Formula

    def points(self, count: int = 200) -> tuple[FloatArray, FloatArray]:
        """Re* and theta_c along the curve, arrays of shape (count,)."""
        x = np.geomspace(self.low, self.high, count)
        theta = self.formula(x)
        return (x if self.variable == "Re*" else np.sqrt(theta) * x**1.5), theta


def soulsby_whitehouse(dstar: FloatArray) -> FloatArray:
    """Soulsby and Whitehouse (1997), of D*."""
    return 0.30 / (1 + 1.2 * dstar) + 0.055 * (1 - np.exp(-0.02 * dstar))


def paphitis(reynolds: FloatArray) -> FloatArray:
    """Paphitis (2001), the mean curve, of Re*."""
    return 0.188 / (1 + reynolds) + 0.0475 * (1 - 0.699 * np.exp(-0.015 * reynolds))


def brownlie(dstar: FloatArray) -> FloatArray:
    """Brownlie (1981), of D*; his grain Reynolds number is D*^1.5."""
    y = dstar**-0.9
    return 0.22 * y + 0.06 * 10 ** (-7.7 * y)


def mantz(reynolds: FloatArray) -> FloatArray:
    """Mantz (1977), of Re*."""
    return 0.1 * reynolds**-0.3


def yalin_karahan(reynolds: FloatArray) -> FloatArray:
    """Yalin and Karahan (1979), of Re*."""
    log = np.log(reynolds)
    middle = np.exp(-2.26 - 0.905 * log + 0.168 * log**2)
    return np.where(reynolds <= 1, mantz(reynolds), np.where(reynolds <= 60, middle, 0.045))


def van_rijn(dstar: FloatArray) -> FloatArray:
    """Curve of van Rijn (1984), of D*."""
    return np.select(
        [dstar <= 4, dstar <= 10, dstar <= 20, dstar <= 150],
        [0.24 / dstar, 0.14 * dstar**-0.64, 0.04 * dstar**-0.1, 0.013 * dstar**0.29],
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


@dataclass(frozen=True)
class Air:
    """The grains and the gas that a curve for air is drawn for; SI units."""

    density: float | FloatArray
    fluid_density: float | FloatArray
    viscosity: float | FloatArray
    gravity: float | FloatArray = GRAVITY

    def shields_diagram(self, d: FloatArray, ustar: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Re* and theta_c of grains of a diameter (m) that move at a friction velocity (m/s)."""
        excess = (self.density - self.fluid_density) * self.gravity * d
        return ustar * d / self.viscosity, self.fluid_density * ustar**2 / excess


def bagnold(diameter: FloatArray, air: Air) -> FloatArray:
    """Bagnold's threshold friction velocity with A = 0.1, m/s."""
    excess = air.density / air.fluid_density - 1
    return 0.1 * np.sqrt(excess * air.gravity * diameter)


def shao_lu(diameter: FloatArray, air: Air) -> FloatArray:
    """Shao and Lu (2000), threshold friction velocity with cohesion 3e-4 N/m, m/s."""
    ratio = air.density / air.fluid_density
    cohesion = 3e-4 / (air.fluid_density * diameter)
    return np.sqrt(0.0123 * (ratio * air.gravity * diameter + cohesion))


def iversen_white(diameter: FloatArray, air: Air) -> FloatArray:
    """Iversen and White (1982), threshold friction velocity, m/s; it is implicit in Re*."""
    ratio = air.density / air.fluid_density
    cohesion = 1 + 6e-7 / (air.density * air.gravity * diameter**2.5)
    scale = np.sqrt(ratio * air.gravity * diameter * cohesion)
    ustar = 0.12 * scale
    for _ in range(200):
        reynolds = np.maximum(ustar * diameter / air.viscosity, 0.03)
        # the root is bounded below inside its own branch only: 1.928 Re^0.092 > 1 for Re > 0.001
        slow = 0.129 * scale / np.sqrt(1.928 * np.minimum(reynolds, 10) ** 0.092 - 1)
        fast = 0.12 * scale * (1 - 0.0858 * np.exp(-0.0617 * (np.maximum(reynolds, 10) - 10)))
        ustar = np.where(reynolds <= 10, slow, fast)
    return ustar


AIR: dict[str, Callable[[FloatArray, Air], FloatArray]] = {
    "Bagnold 1941": bagnold,
    "Shao & Lu 2000": shao_lu,
    "Iversen & White 1982": iversen_white,
}
"""Curves for grains in air, cohesion included where their authors do."""


def slope_factor_on_ustar(slope_deg: FloatArray, friction_angle_deg: float) -> FloatArray:
    """Factor on the threshold friction velocity in air for flow up a slope."""
    alpha = np.radians(slope_deg)
    factor = np.cos(alpha) + np.sin(alpha) / np.tan(np.radians(friction_angle_deg))
    return np.asarray(np.sqrt(factor))
