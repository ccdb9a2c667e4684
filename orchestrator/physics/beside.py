"""What was measured beside a threshold, on level beds: flumes in a liquid, wind in a gas."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.constants import GAS_BELOW
from orchestrator.physics.curves import Air, shao_lu, soulsby_whitehouse
from orchestrator.physics.measured import VISUAL
from orchestrator.types import BoolArray, FloatArray

FIELD = (0.0110, 0.0126, 0.0129)
"""Shields numbers of the fluid threshold at three sites, by R. L. Martin and J. F. Kok, 2018,
doi:10.1029/2017JF004416: sand of 0.40 to 0.53 mm."""
FIELD_REYNOLDS, FIELD_RATIO = (8.77, 13.5), (2170.0, 2290.0)
"""Their Re* and their densities of the grains over that of the air."""
NEAR = 2.0
"""Factor on either up to which a threshold in a gas is near these rows."""


COLUMNS = {
    "diameter": "d_m",
    "density": "rho_sol_kg_m3",
    "fluid_density": "rho_f_kg_m3",
    "viscosity": "nu_m2_s",
    "gravity": "g_m_s2",
}
"""Columns of tables that have the parameters of `beside`."""


class Beside(NamedTuple):
    """Measured Shields numbers beside some thresholds, arrays of one shape.

    `curve` is that of Soulsby and Whitehouse in a liquid, of Shao and Lu in a gas, for the same
    grain. `median`, `low` and `high` are of the rows near the threshold's Re*, by eye in flumes
    (10 to 90 %) or in the field (the ends); NaN where there are no `rows`.
    """

    curve: FloatArray
    median: FloatArray
    low: FloatArray
    high: FloatArray
    rows: FloatArray


def beside(
    reynolds: ArrayLike,
    *,
    diameter: ArrayLike,
    density: ArrayLike,
    fluid_density: ArrayLike,
    viscosity: ArrayLike,
    gravity: ArrayLike,
) -> Beside:
    """What was measured beside thresholds at some Re*; SI units, the arguments broadcast."""
    given = (reynolds, diameter, density, fluid_density, viscosity, gravity)
    re, d, rho_s, rho, nu, g = np.broadcast_arrays(*(np.asarray(each, float) for each in given))
    excess, is_gas = (rho_s / rho - 1) * g, rho < GAS_BELOW
    in_gas = shao_lu(d, Air(rho_s, rho, nu, g)) ** 2 / (excess * d)
    in_liquid = soulsby_whitehouse(d * (excess / nu**2) ** (1 / 3))
    none = (np.nan, np.nan, np.nan, 0.0)
    bins = [none, *((b.median, b.tenth, b.ninetieth, float(b.count)) for b in VISUAL), none]
    edges = [VISUAL[0].low, *(each.high for each in VISUAL)]
    flumes = np.array(bins)[np.searchsorted(edges, re, side="right")]
    near = _near(re, FIELD_REYNOLDS) & _near(rho_s / rho, FIELD_RATIO)
    ends = (float(np.median(FIELD)), min(FIELD), max(FIELD), float(len(FIELD)))
    field = np.where(near[..., None], ends, none)
    rows = np.where(is_gas[..., None], field, flumes)
    return Beside(np.where(is_gas, in_gas, in_liquid), *np.moveaxis(rows, -1, 0))


def _near(value: FloatArray, ends: tuple[float, float]) -> BoolArray:
    return np.asarray((value > ends[0] / NEAR) & (value < ends[1] * NEAR))


def sentence(shields: float, reynolds: float, **grain: float) -> str:
    """Say what was measured beside one threshold; its parameters are those of `beside`."""
    at = beside(reynolds, **grain)
    if grain["fluid_density"] >= GAS_BELOW:
        curve = f"the curve of Soulsby and Whitehouse {at.curve:.3f}"
        if not at.rows:
            return f"measured beside it: {curve}; no flume has rows at Re* {reynolds:.3g}"
        rows = f"θ {at.median:.3f}, 10 to 90 % {at.low:.3f} to {at.high:.3f}, {at.rows:g} rows"
        return f"measured at this Re* on level beds in flumes, by eye: {rows}; {curve}"
    over, ustar = shields / at.curve, (shields / at.curve) ** 0.5
    curve = f"the curve of Shao and Lu has θ {at.curve:.4f}, this is {over:.2g} times it"
    curve = f"{curve}, {ustar:.3g} times in u*"
    if at.rows:
        ends = f"{at.low:.3f} to {at.high:.3f} at {at.rows:g} sites (Martin and Kok 2018)"
        over = shields / at.median
        return (
            f"measured in air on level beds: {curve}; in the field {ends}, this is {over:.2g} times"
        )
    ratio, (low, high) = grain["density"] / grain["fluid_density"], FIELD_RATIO
    rows = (
        f"Re* {FIELD_REYNOLDS[0]:.0f} to {FIELD_REYNOLDS[1]:.0f} and densities {low:g} to {high:g}"
    )
    here = f"this has Re* {reynolds:.3g} and {ratio:.3g}"
    return f"{curve}; no field rows are near it: they have {rows} times the gas's, {here}"
