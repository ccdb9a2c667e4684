"""Mean velocity over a bed: the log law, speed and shear around a grain, van Driest's profile.

Fig. 3 of the paper has two profiles at the scale of a grain: linear in a viscous flow, logarithmic
over a rough wall. Between them viscosity and turbulence carry the stress together (`bridge`).

Van Driest's profile goes from the sublayer to the logarithm. In wall units (y = z ustar/nu):
``U' + l^2 U'^2 = 1``, ``l = 0.41 y (1 - exp(-y/26))``. Roughness shifts y by D of Rotta (1962) in
the correlation of Cebeci and Chang (1978). The shear depends on z + D alone, so that two integrals,
tabulated once, serve every grain. The form and the constants 0.9 and 6 agree with code_saturne
(cs_wall_functions), which cites these authors; 26 is the value commonly quoted of van Driest.
"""

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.constants import GAS_BELOW, INVERSE_KARMAN, KARMAN
from orchestrator.types import FloatArray

SMOOTH_WALL = 1 / 9
"""Roughness length of a smooth wall over nu/u* (Nikuradse 1932: u/u* = 2.5 ln(u* z/nu) + 5.5)."""
ROUGH_FROM = 70 / 30
"""u* z0/nu from which a bed is hydraulically rough: u* k_s/nu = 70, k_s = 30 z0 (Nikuradse)."""
LAMINAR_BELOW = 2000.0
"""U D/nu below which open water may be laminar, and has no logarithmic profile."""
HIDDEN = 1e-9  # least exposed part of a grain: none below the flow divides by zero
DAMPING = 26.0  # van Driest's A+
ROUGHEST = 2000.0  # ks ustar/nu up to which the correlation of the shift is in use
SMOOTHEST, TALLEST = 1e-3, 1e9
"""Wall units between which the integrals are tabulated. Below, the speed is y to 16 digits; above,
the shear is that of the log law to 9."""
STEP = 0.03  # of the table in ln y: interpolation errs by less than 1e-12, relative


def log_law_ustar(
    speed: ArrayLike, height: ArrayLike, roughness: ArrayLike, *, printed: bool = False
) -> FloatArray:
    """Eq. 10: friction velocity (m/s) from the tangential speed at a height above the bed.

    The rough wall's own profile is ``ln((z + z0)/z0)``; the paper prints ``ln(z/z0)``, which
    changes its sign below z0.
    """
    over = np.asarray(height, float) / np.asarray(roughness, float)
    profile = np.log(over) if printed else np.log1p(over)
    return np.asarray(KARMAN * np.asarray(speed, float) / profile)


def log_law_speed(ustar: ArrayLike, height: ArrayLike, roughness: ArrayLike) -> FloatArray:
    """Mean speed (m/s) at a height over a bed of roughness length z0 (m), the inverse of Eq. 10."""
    over = np.asarray(height, float) / np.asarray(roughness, float)
    return np.asarray(np.asarray(ustar, float) / KARMAN * np.log1p(over))


def depth_mean_speed(
    ustar: ArrayLike, depth: ArrayLike, roughness: ArrayLike, *, closed: ArrayLike = False
) -> FloatArray:
    """Depth-averaged speed (m/s) of wide open water of a depth (m) with that profile up to its top.

    The mean of ``ln((z + z0)/z0)`` from 0 to h is ``(1 + z0/h) ln(1 + h/z0) - 1``. For a river
    u* = sqrt(g h S) belongs to it, S the slope of its surface. A closed channel has the profile of
    half its depth on each wall.
    """
    part = np.asarray(roughness, float) / (np.asarray(depth, float) / np.where(closed, 2, 1))
    mean = (1 + part) * np.log1p(1 / part) - 1
    return np.asarray(np.asarray(ustar, float) / KARMAN * mean)


def measurable_speeds(
    ustar: ArrayLike,
    roughness: ArrayLike,
    viscosity: ArrayLike,
    density: ArrayLike,
    depth: ArrayLike,
    *,
    closed: bool = False,
) -> dict[str, FloatArray]:
    """Speeds of an undisturbed flow that are measured, by the column of a table, m/s.

    NaN is what it has not: wind of a liquid, current of a gas, a height above its `depth` (m; NaN:
    none), a mean velocity without a depth or where it may be laminar.
    """
    nu, deep, rho = (np.asarray(x, float) for x in (viscosity, depth, density))
    is_gas = rho < GAS_BELOW
    with np.errstate(divide="ignore", invalid="ignore"):  # without a flow, and without a depth
        z0 = outer_roughness(roughness, ustar, nu)
        at_1, at_10 = (np.where(deep < z, np.nan, log_law_speed(ustar, z, z0)) for z in (1, 10))
        mean = depth_mean_speed(ustar, deep, z0, closed=closed)
        return {
            "wind_1m_m_s": np.where(is_gas, at_1, np.nan),
            "wind_10m_m_s": np.where(is_gas, at_10, np.nan),
            "current_1m_m_s": np.where(is_gas, np.nan, at_1),
            "mean_velocity_m_s": np.where(mean * deep / nu >= LAMINAR_BELOW, mean, np.nan),
        }


def smooth_wall_roughness(ustar: ArrayLike, viscosity: ArrayLike) -> FloatArray:
    """Roughness length (m) of a smooth wall, nu/(9 u*)."""
    return np.asarray(SMOOTH_WALL * np.asarray(viscosity, float) / np.asarray(ustar, float))


def outer_roughness(roughness: ArrayLike, ustar: ArrayLike, viscosity: ArrayLike) -> FloatArray:
    """Roughness length (m) that the flow high above a bed has: z0 + nu/(9 u*), if not rough.

    Colebrook's sum of the rough and the smooth wall (J. Inst. Civ. Eng. 11, 1939); Nikuradse's sand
    lies a little below it. It is z0 on a rough bed, and without a friction velocity.
    """
    z0 = np.asarray(roughness, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        number = np.asarray(ustar) * z0 / np.asarray(viscosity)
        is_smoothed = (number > 0) & (number < ROUGH_FROM)
        return np.where(is_smoothed, z0 + smooth_wall_roughness(ustar, viscosity), z0)


def viscous_length(diameter: FloatArray, gap: FloatArray) -> FloatArray:
    """Mean of the height above the bed over the height of a grain, m.

    The mean speed of the linear profile of Eq. 2 is ustar^2/nu times it: d/2 + z0 for a grain whose
    lowest point lies a gap z0 above the bed. Parts of a grain below the bed feel nothing.
    """
    bottom = np.maximum(gap, 0.0)
    part = np.maximum(1 - (bottom - gap) / diameter, HIDDEN)
    return np.asarray(part * (part * diameter / 2 + bottom))


def rough_speed(diameter: FloatArray, roughness: FloatArray, gap: FloatArray) -> FloatArray:
    """V_f/ustar of Eq. 4: ``2.5 ln(z/z0)`` averaged over the height of a grain above z0.

    For a gap of z0 it is ``2.5 ((1 + z0/d) ln(1 + d/z0) - 1)``.
    """
    bottom = np.maximum(gap, roughness)
    part = np.maximum(1 - (bottom - gap) / diameter, HIDDEN)
    ratio, low = roughness / diameter, bottom / roughness
    high = low + part / ratio
    mean = ratio * (high * np.log(high) - low * np.log(low)) - part
    return np.asarray(np.maximum(INVERSE_KARMAN * mean, HIDDEN))


def rough_gradient(diameter: FloatArray, roughness: FloatArray, gap: FloatArray) -> FloatArray:
    """(du/dz)/ustar of Eq. 4, averaged alike, 1/m."""
    bottom = np.maximum(gap, roughness)
    part = np.maximum(1 - (bottom - gap) / diameter, HIDDEN)
    return np.asarray(INVERSE_KARMAN * np.log1p(part * diameter / bottom) / diameter)


def bridge(ustar: FloatArray, viscous: FloatArray, rough: FloatArray) -> FloatArray:
    """The positive root x of ``ustar^2 = viscous x + (x/rough)^2``.

    `viscous` is nu over a length (m/s) for a speed x, nu (m2/s) for a gradient; `rough` is x/ustar
    where turbulence carries the whole stress. Without the difference of two near numbers the root
    is right to the last digits where either term is negligible.
    """
    return np.asarray(2 * ustar**2 / (viscous + np.hypot(viscous, 2 * ustar / rough)))


def shift(roughness: FloatArray) -> FloatArray:
    """Shift D of the wall in wall units, of ks ustar/nu; none below 4.535, where it is smooth."""
    k = roughness
    rotta = 0.9 * (np.sqrt(k) - k * np.exp(-k / 6))
    # the correlation is positive again below 1.9, outside of its range
    return np.where(k > 4, np.maximum(rotta, 0), 0)


def layer(base: FloatArray, top: FloatArray, moved: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean speed U/ustar and mean shear nu U'/ustar^2 of van Driest's profile over a layer.

    Its ends above the bed and the shift of the wall are in wall units.
    """
    depth = top - base
    speed = (_speed_integral(top + moved) - _speed_integral(base + moved)) / depth - _speed(moved)
    return speed, (_speed(top + moved) - _speed(base + moved)) / depth


def shear(y: FloatArray) -> FloatArray:
    """Shear nu U'/ustar^2 at a distance from the shifted wall (wall units)."""
    return 2 / (1 + np.sqrt(1 + 4 * _mixing_length(y) ** 2))


def _mixing_length(y: FloatArray) -> FloatArray:
    return -KARMAN * y * np.expm1(-y / DAMPING)


def _log_above(y: FloatArray) -> FloatArray:
    """Speed of the log law over that at the end of the table."""
    return np.log(np.maximum(y / TALLEST, 1)) / KARMAN


def _speed(y: FloatArray) -> FloatArray:
    """Integral of the shear from the shifted wall."""
    return np.where(y < SMOOTHEST, y, _read(0, y) + _log_above(y))


def _speed_integral(y: FloatArray) -> FloatArray:
    """Integral of the speed from the shifted wall."""
    above = np.maximum(y - TALLEST, 0) * (_read(0, np.asarray(TALLEST)) - 1 / KARMAN)
    return np.where(y < SMOOTHEST, y**2 / 2, _read(1, y) + above + y * _log_above(y))


def _read(which: int, y: FloatArray) -> FloatArray:
    """The value of a table at y, between its ends."""
    place = np.log(np.clip(y, SMOOTHEST, TALLEST) / SMOOTHEST) / STEP
    node = np.floor(place).astype(int)
    *rest, value = (coefficient[node] for coefficient in _tables()[which])
    for coefficient in reversed(rest):
        value = value * (place - node) + coefficient
    return np.asarray(value)


@cache
def _tables() -> tuple[FloatArray, FloatArray]:
    """Speed and its integral: at equal steps of ln y the six coefficients of a polynomial.

    It has the exact value and two exact derivatives at either node.
    """
    x = np.arange(np.log(SMOOTHEST), np.log(TALLEST) + 2 * STEP, STEP)
    y, g = np.exp(x), shear(np.exp(x))
    root, weight = np.polynomial.legendre.leggauss(12)
    width = np.diff(y)[:, None]
    inside = y[:-1, None] + width * (root + 1) / 2
    area = weight * width / 2 * shear(inside)
    speed = SMOOTHEST + np.concatenate([[0], np.cumsum(area.sum(axis=1))])
    # integration by parts: the shear within an interval adds to the integral of the speed
    rise = speed[:-1] * width[:, 0] + (area * (y[1:, None] - inside)).sum(axis=1)
    integral = SMOOTHEST**2 / 2 + np.concatenate([[0], np.cumsum(rise)])
    length = _mixing_length(y)
    slope = -KARMAN * np.expm1(-y / DAMPING) + KARMAN * y / DAMPING * np.exp(-y / DAMPING)
    bend = -2 * length * slope * g**2 / np.sqrt(1 + 4 * length**2)
    tables = []
    for nodes in ((speed, y * g, y * g + y**2 * bend), (integral, y * speed, y * speed + y**2 * g)):
        c0, c1, c2 = (node * STEP**n / max(n, 1) for n, node in enumerate(nodes))
        # what is left of value and derivatives at the next node
        d = (c0[1:] - (c0 + c1 + c2)[:-1], c1[1:] - (c1 + 2 * c2)[:-1], (c2[1:] - c2[:-1]) * 2)
        third = (10 * d[0] - 4 * d[1] + d[2] / 2, -15 * d[0] + 7 * d[1] - d[2])
        fifth = 6 * d[0] - 3 * d[1] + d[2] / 2
        tables.append(np.array([c0[:-1], c1[:-1], c2[:-1], *third, fifth]))
    return tables[0], tables[1]
