"""Mean velocity over a bed: log law, speed and shear at a grain, van Driest's profile.

Fig. 3 of the paper has two profiles at the scale of a grain: linear in a viscous flow,
logarithmic over a rough wall. Between them viscosity and turbulence carry the stress
together (`bridge`).

Van Driest's profile goes from the sublayer to the logarithm. In wall units
(y = z ustar/nu): ``U' + l^2 U'^2 = 1``, ``l = 0.41 y (1 - exp(-y/26))``. Roughness
shifts y by D of Rotta (1962) in the correlation of Cebeci and Chang (1978). The form
and the constants 0.9 and 6 agree with code_saturne (cs_wall_functions), which cites
these authors; 26 is the value commonly quoted of van Driest.
"""

from functools import cache

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike

from orchestrator.physics.constants import (
    GAS_BELOW,
    INVERSE_KARMAN,
    KARMAN,
    SAND_GRAIN,
)
from orchestrator.types import FloatArray

SMOOTH_WALL = 1 / 9
"""Roughness length of a smooth wall over nu/u*.

Nikuradse 1932: u/u* = 2.5 ln(u* z/nu) + 5.5.
"""
ROUGH_FROM = 70 / 30
"""u* z0/nu from which a bed is hydraulically rough.

u* k_s/nu = 70 with k_s = 30 z0 (Nikuradse).
"""
LAMINAR_BELOW = 2000.0
"""U D/nu below which open water may be laminar, and has no logarithmic profile."""
COARSE = 3.0
"""Nikuradse's roughness of a gravel bed over d84."""
STRICKLER = 21.1
"""Strickler's coefficient of a bed of a median grain of 1 m, m^(1/3)/s."""
HIDDEN = 1e-9
"""Least part of a grain's height that is exposed.

No force divides by zero for a grain below the flow.
"""
DAMPING = 26.0
"""van Driest's A+, wall units."""
ROUGHEST = 2000.0
"""ks ustar/nu up to which the correlation of the shift is in use."""
BUFFER = 5.0
"""Distance from the wall at which the stretched coordinate turns to a logarithm."""
GAUSS_POINTS = 32
"""Points of the quadrature over a layer."""


def log_law_ustar(
    speed: ArrayLike,
    height: ArrayLike,
    roughness: ArrayLike,
) -> FloatArray:
    """Compute the friction velocity from a speed above the bed by the log law (Eq. 10).

    The rough wall's own profile is ``ln((z + z0)/z0)``; the paper prints ``ln(z/z0)``,
    which changes its sign below z0.

    Parameters
    ----------
    speed
        Speed along the bed, m/s.
    height
        Height z above the bed, m.
    roughness
        Roughness length z0 of the bed, m.

    Returns
    -------
    FloatArray
        Friction velocity, m/s, of the broadcast shape.

    Examples
    --------
    >>> print(log_law_ustar(10.0, 1.0, [1e-4, 1e-3]).round(4))
    [0.4451 0.5934]
    """
    over = np.asarray(height, float) / np.asarray(roughness, float)
    return np.asarray(KARMAN * np.asarray(speed, float) / np.log1p(over))


def log_law_speed(
    ustar: ArrayLike,
    height: ArrayLike,
    roughness: ArrayLike,
) -> FloatArray:
    """Compute the mean speed over a bed by the log law, the inverse of Eq. 10.

    Parameters
    ----------
    ustar
        Friction velocity, m/s.
    height
        Height z above the bed, m.
    roughness
        Roughness length z0 of the bed, m.

    Returns
    -------
    FloatArray
        Mean speed, m/s, of the broadcast shape.

    Examples
    --------
    >>> print(log_law_speed(0.5, [1.0, 10.0], 1e-4).round(2))
    [11.23 14.04]
    """
    over = np.asarray(height, float) / np.asarray(roughness, float)
    return np.asarray(np.asarray(ustar, float) / KARMAN * np.log1p(over))


def depth_mean_speed(
    ustar: ArrayLike,
    depth: ArrayLike,
    roughness: ArrayLike,
    *,
    closed: ArrayLike = False,
) -> FloatArray:
    """Compute the depth-averaged speed of wide water with the log profile.

    The mean of ``ln((z + z0)/z0)`` from 0 to h is ``(1 + z0/h) ln(1 + h/z0) - 1``. For
    a river u* = sqrt(g h S) belongs to it, S the slope of its surface. A closed channel
    has the profile of half its depth on each wall.

    Parameters
    ----------
    ustar
        Friction velocity, m/s.
    depth
        Depth h, m.
    roughness
        Roughness length z0 of the bed, m.
    closed
        Whether the water is a closed channel; else its top is open.

    Returns
    -------
    FloatArray
        Depth-averaged speed, m/s, of the broadcast shape.

    Examples
    --------
    >>> print(depth_mean_speed(0.05, 1.0, 1e-4, closed=[False, True]).round(4))
    [1.0014 0.917 ]
    """
    profiles = np.where(closed, 2, 1)
    part = np.asarray(roughness, float) / (np.asarray(depth, float) / profiles)
    mean = (1 + part) * np.log1p(1 / part) - 1
    return np.asarray(np.asarray(ustar, float) / KARMAN * mean)


def coarse_roughness(d84: ArrayLike) -> FloatArray:
    """Compute the roughness length of a channel from the coarse grains of its bed.

    Nikuradse's roughness of a gravel bed is about 3 d84, several times that of equal
    grains: coarse grains, clusters and small forms take a part in it.

    Parameters
    ----------
    d84
        Diameter that 84 % by mass of the bed are finer than, m.

    Returns
    -------
    FloatArray
        Roughness length z0 = 3 d84/30, m, of the same shape.

    Examples
    --------
    >>> print(coarse_roughness([0.03, 0.053]).round(6))
    [0.003  0.0053]
    """
    return np.asarray(COARSE * np.asarray(d84, float) / SAND_GRAIN)


def strickler_speed(
    ustar: ArrayLike, depth: ArrayLike, diameter: ArrayLike, gravity: ArrayLike
) -> FloatArray:
    """Compute the depth-averaged speed of wide water by Strickler's formula.

    ``U = K h^(2/3) S^(1/2)`` with ``K = 21.1/d^(1/6)`` in SI units, and the slope
    ``S = ustar^2/(g h)`` of the stress.

    Parameters
    ----------
    ustar
        Friction velocity, m/s.
    depth
        Depth h, m.
    diameter
        Median diameter d of the bed, m.
    gravity
        Acceleration of gravity, m/s2.

    Returns
    -------
    FloatArray
        Depth-averaged speed, m/s, of the broadcast shape.

    Examples
    --------
    >>> print(strickler_speed(0.154, 0.6, 0.03, 9.81).round(2))
    1.71
    """
    coefficient = STRICKLER / np.asarray(diameter, float) ** (1 / 6)
    of_depth = np.asarray(depth, float) ** (1 / 6) / np.sqrt(gravity)
    return np.asarray(coefficient * of_depth * np.asarray(ustar, float))


def measurable_speeds(
    ustar: ArrayLike,
    *,
    roughness: ArrayLike,
    fluid_density: ArrayLike,
    viscosity: ArrayLike,
    depth: ArrayLike,
    closed: ArrayLike = False,
) -> dict[str, FloatArray]:
    """Compute the speeds of an undisturbed flow that are measured.

    Parameters
    ----------
    ustar
        Friction velocity, m/s.
    roughness
        Roughness length z0 of the bed, m.
    fluid_density
        Density of the fluid, kg/m3.
    viscosity
        Kinematic viscosity of the fluid, m2/s.
    depth
        Depth of the flow, m; NaN where it has none.
    closed
        Whether the flow is a closed channel.

    Returns
    -------
    dict
        Speeds, m/s, of the broadcast shape, by the column of a table: of a wind at 1
        and at 10 m, of a current at 1 m, and the depth-averaged one. NaN is what the
        flow has not: the wind of a liquid, the current of a gas, a height above its
        depth, a mean velocity without a depth or where the flow may be laminar.

    Examples
    --------
    >>> water = {"fluid_density": 1000.0, "viscosity": 1e-6, "roughness": 1e-4}
    >>> speeds = measurable_speeds(0.05, **water, depth=0.5)
    >>> print(speeds["current_1m_m_s"], speeds["mean_velocity_m_s"].round(3))
    nan 0.917
    """
    nu = np.asarray(viscosity, float)
    deep = np.asarray(depth, float)
    is_gas = np.asarray(fluid_density, float) < GAS_BELOW
    # without a flow, and without a depth, numbers are divided by zero or not numbers
    with np.errstate(divide="ignore", invalid="ignore"):
        z0 = outer_roughness(roughness, ustar, nu)
        at_1 = np.where(deep < 1, np.nan, log_law_speed(ustar, 1, z0))
        at_10 = np.where(deep < 10, np.nan, log_law_speed(ustar, 10, z0))
        mean = depth_mean_speed(ustar, deep, z0, closed=closed)
        is_turbulent = mean * deep / nu >= LAMINAR_BELOW
    return {
        "wind_1m_m_s": np.where(is_gas, at_1, np.nan),
        "wind_10m_m_s": np.where(is_gas, at_10, np.nan),
        "current_1m_m_s": np.where(is_gas, np.nan, at_1),
        "mean_velocity_m_s": np.where(is_turbulent, mean, np.nan),
    }


def open_water_reynolds(
    ustar: ArrayLike,
    *,
    roughness: ArrayLike,
    viscosity: ArrayLike,
    depth: ArrayLike,
    closed: ArrayLike = False,
) -> FloatArray:
    """Compute the Reynolds number of a channel, its mean speed times its depth over nu.

    Parameters
    ----------
    ustar
        Friction velocity on the bed, m/s.
    roughness
        Roughness length z0 of the bed, m.
    viscosity
        Kinematic viscosity of the fluid, m2/s.
    depth
        Depth of the flow, m; NaN where it has none.
    closed
        Whether it is a closed channel.

    Returns
    -------
    FloatArray
        The number, of the broadcast shape; NaN without a depth. Below `LAMINAR_BELOW`
        the flow may be laminar.

    Examples
    --------
    >>> water = {"roughness": 1e-4, "viscosity": 1e-6, "depth": 0.5}
    >>> print(open_water_reynolds(0.05, **water).round(-3))
    458000.0
    """
    z0 = outer_roughness(roughness, ustar, viscosity)
    mean = depth_mean_speed(ustar, depth, z0, closed=closed)
    deep = np.asarray(depth, float)
    return np.asarray(mean * deep / np.asarray(viscosity, float))


def laminar(reynolds: float) -> str:
    """Say why a flow below `LAMINAR_BELOW` has no logarithmic law.

    Parameters
    ----------
    reynolds
        Reynolds number of the flow, speed times depth over nu.

    Returns
    -------
    str
        The reason.

    Examples
    --------
    >>> "below 2000" in laminar(117.0)
    True
    """
    said = f"speed times depth over nu, {reynolds:.0f}, is below {LAMINAR_BELOW:g}"
    return f"laminar flow: {said}"


def smooth_wall_roughness(ustar: ArrayLike, viscosity: ArrayLike) -> FloatArray:
    """Compute the roughness length of a smooth wall, nu/(9 u*).

    Parameters
    ----------
    ustar
        Friction velocity, m/s.
    viscosity
        Kinematic viscosity, m2/s.

    Returns
    -------
    FloatArray
        Roughness length, m, of the broadcast shape.

    Examples
    --------
    >>> print(f"{smooth_wall_roughness(0.01, 1e-6):.3e}")
    1.111e-05
    """
    nu = np.asarray(viscosity, float)
    return np.asarray(SMOOTH_WALL * nu / np.asarray(ustar, float))


def outer_roughness(
    roughness: ArrayLike,
    ustar: ArrayLike,
    viscosity: ArrayLike,
) -> FloatArray:
    """Compute the roughness length of the flow high above a bed.

    It is z0 + nu/(9 u*) where the bed is not hydraulically rough: Colebrook's sum of
    the rough and the smooth wall (J. Inst. Civ. Eng. 11, 1939); Nikuradse's sand lies a
    little below it.

    Parameters
    ----------
    roughness
        Roughness length z0 of the bed, m.
    ustar
        Friction velocity, m/s.
    viscosity
        Kinematic viscosity, m2/s.

    Returns
    -------
    FloatArray
        Roughness length, m, of the broadcast shape. It is z0 on a rough bed, and
        without a friction velocity.

    Examples
    --------
    >>> print(outer_roughness([1e-6, 3e-4], 0.01, 1e-6).round(9))
    [1.2111e-05 3.0000e-04]
    """
    z0 = np.asarray(roughness, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        number = np.asarray(ustar) * z0 / np.asarray(viscosity)
        is_smoothed = (number > 0) & (number < ROUGH_FROM)
        smoothed = z0 + smooth_wall_roughness(ustar, viscosity)
    return np.where(is_smoothed, smoothed, z0)


def viscous_length(diameter: FloatArray, gap: FloatArray) -> FloatArray:
    """Compute the mean of the height above the bed over the height of a grain.

    The mean speed of the linear profile of Eq. 2 is ustar^2/nu times it: d/2 + z0 for a
    grain whose lowest point lies a gap z0 above the bed. Parts of a grain below the bed
    feel nothing.

    Parameters
    ----------
    diameter
        Diameter of the grain, m.
    gap
        Height of its lowest point above the bed, m; negative below it.

    Returns
    -------
    FloatArray
        The mean height, m, of the broadcast shape.

    Examples
    --------
    >>> print(viscous_length(np.array(1e-3), np.array([1e-4, 0.0, -5e-4])))
    [0.0006   0.0005   0.000125]
    """
    bottom = np.maximum(gap, 0.0)
    part = np.maximum(1 - (bottom - gap) / diameter, HIDDEN)
    return np.asarray(part * (part * diameter / 2 + bottom))


def rough_speed(
    diameter: FloatArray,
    roughness: FloatArray,
    gap: FloatArray,
) -> FloatArray:
    """Compute V_f/ustar of Eq. 4: ``2.5 ln(z/z0)`` averaged over a grain's height.

    The speed is 0 below z0. For a gap of z0 the mean is
    ``2.5 ((1 + z0/d) ln(1 + d/z0) - 1)``.

    Parameters
    ----------
    diameter
        Diameter of the grain, m.
    roughness
        Roughness length z0 of the bed, m.
    gap
        Height of the grain's lowest point above the bed, m.

    Returns
    -------
    FloatArray
        Mean speed over ustar, of the broadcast shape.

    Examples
    --------
    >>> z0 = np.array(1e-3 / 30)
    >>> print(rough_speed(np.array(1e-3), z0, z0).round(4))
    6.3711
    """
    bottom = np.maximum(gap, roughness)
    part = np.maximum(1 - (bottom - gap) / diameter, HIDDEN)
    ratio = roughness / diameter
    low = bottom / roughness
    high = low + part / ratio
    mean = ratio * (high * np.log(high) - low * np.log(low)) - part
    return np.asarray(np.maximum(INVERSE_KARMAN * mean, HIDDEN))


def rough_gradient(
    diameter: FloatArray,
    roughness: FloatArray,
    gap: FloatArray,
) -> FloatArray:
    """Compute (du/dz)/ustar of Eq. 4, averaged over a grain's height.

    Parameters
    ----------
    diameter
        Diameter of the grain, m.
    roughness
        Roughness length z0 of the bed, m.
    gap
        Height of the grain's lowest point above the bed, m.

    Returns
    -------
    FloatArray
        Mean shear over ustar, 1/m, of the broadcast shape.

    Examples
    --------
    >>> z0 = np.array(1e-3 / 30)
    >>> print(rough_gradient(np.array(1e-3), z0, z0).round(1))
    8585.0
    """
    bottom = np.maximum(gap, roughness)
    part = np.maximum(1 - (bottom - gap) / diameter, HIDDEN)
    return np.asarray(INVERSE_KARMAN * np.log1p(part * diameter / bottom) / diameter)


def bridge(ustar: FloatArray, viscous: FloatArray, rough: FloatArray) -> FloatArray:
    """Compute the positive root x of ``ustar^2 = viscous x + (x/rough)^2``.

    Without the difference of two near numbers the root is right to the last digits
    where either term is negligible.

    Parameters
    ----------
    ustar
        Friction velocity, m/s.
    viscous
        nu over a length, m/s, for a speed x; nu, m2/s, for a gradient.
    rough
        x/ustar where turbulence carries the whole stress.

    Returns
    -------
    FloatArray
        The speed, m/s, or the gradient, 1/s, of the broadcast shape.

    Examples
    --------
    >>> print(bridge(np.array(1.0), np.array([0.0, 1.0, 1e9]), np.array(5.0)))
    [5.00000000e+00 9.62912018e-01 1.00000000e-09]
    """
    root = np.hypot(viscous, 2 * ustar / rough)
    return np.asarray(2 * ustar**2 / (viscous + root))


def law_of_the_wall(height: FloatArray, roughness: FloatArray) -> FloatArray:
    """Compute the mean speed over a smooth, rough or transitional wall, in closed form.

    On a smooth wall it is H. Reichardt's profile (Z. Angew. Math. Mech. 31, 1951), as
    public codes have it, from the sublayer ``U = y`` to the logarithm. The roughness
    lowers the speed by ``ln(1 + 0.3 k (1 - exp(-k/26)))/kappa``, as T. Pahtz and O.
    Duran have it (arXiv 1602.07079): nothing on a smooth wall, and on a rough one so
    much that the profile is that over ``z0 = k_s/33``. It lies within 0.45 ustar of
    Nikuradse's sand in between, where Colebrook's sum (`outer_roughness`) is up to 2
    ustar lower.

    Parameters
    ----------
    height
        Height above the zero level, y = z ustar/nu.
    roughness
        Equivalent sand-grain roughness, k = k_s ustar/nu.

    Returns
    -------
    FloatArray
        Speed over ustar, of the broadcast shape; not negative.

    Examples
    --------
    >>> y = np.array([0.1, 10.0, 1000.0])
    >>> print(law_of_the_wall(y, np.array(0.0)).round(2))
    [ 0.1   8.38 22.48]
    """
    log_layer = np.log1p(KARMAN * height) / KARMAN
    buffer = 1 - np.exp(-height / 11) - height / 11 * np.exp(-height / 3)
    lowered = np.log1p(0.3 * roughness * -np.expm1(-roughness / 26)) / KARMAN
    return np.asarray(np.maximum(log_layer + 7.8 * buffer - lowered, 0))


def shallow_defect(part: FloatArray) -> FloatArray:
    """Compute how far the speed lags the log law since the stress falls to the surface.

    In an open uniform flow the stress falls linearly to zero at the surface. With the
    mixing length ``kappa z`` the speed's gradient is ``sqrt(1 - z/h)`` of that of a
    constant stress, and the integral of what lacks has the closed form
    ``2 (1 - r) + 2 ln((1 + r)/2)`` over kappa, with ``r = sqrt(1 - z/h)``.

    Parameters
    ----------
    part
        Height over the depth of the flow, z/h, between 0 and 1.

    Returns
    -------
    FloatArray
        What the speed lacks, over ustar, of the same shape.

    Examples
    --------
    >>> print(shallow_defect(np.array([0.0, 0.5, 1.0])).round(3))
    [0.    0.656 1.497]
    """
    root = np.sqrt(1 - np.asarray(part))
    return np.asarray((2 * (1 - root) + 2 * np.log((1 + root) / 2)) / KARMAN)


def shift(roughness: FloatArray) -> FloatArray:
    """Compute the shift D of the wall by its roughness, in wall units.

    ``D = 0.9 (sqrt(k) - k exp(-k/6))`` (Rotta 1962; Cebeci and Chang 1978).

    Parameters
    ----------
    roughness
        Equivalent sand-grain roughness k = ks ustar/nu.

    Returns
    -------
    FloatArray
        Shift, of the same shape; 0 below k = 4.535, where the wall is smooth.

    Examples
    --------
    >>> print(shift(np.array([1.0, 10.0, 100.0])).round(4))
    [0.     1.1462 9.    ]
    """
    rotta = 0.9 * (np.sqrt(roughness) - roughness * np.exp(-roughness / 6))
    # the correlation is positive again below 1.9, outside of its range
    return np.where(roughness > 4, np.maximum(rotta, 0), 0)


def layer(
    base: FloatArray,
    top: FloatArray,
    moved: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Average van Driest's profile over a layer.

    With the shear S the speed at the base is the integral of S from the wall, and the
    mean speed over the layer exceeds it by that of ``(top - y) S / (top - base)``. Both
    are taken by Gauss's quadrature in ``asinh(y/5)``, which is y in the sublayer and
    its logarithm above: 32 points are right to 1e-11 from the sublayer to y = 1e8.

    Parameters
    ----------
    base, top
        Heights of the layer's ends above the bed, wall units.
    moved
        Shift of the wall, wall units.

    Returns
    -------
    speed, shear
        Mean speed U/ustar and mean shear nu U'/ustar^2, of the broadcast shape.

    Examples
    --------
    >>> speed, shear = layer(np.array(0.0), np.array([1.0, 100.0]), np.array(0.0))
    >>> print(speed.round(3), shear.round(3))
    [ 0.5   13.434] [1.    0.165]
    """
    low, high = base + moved, top + moved
    _, rise_below = _nodes(moved, low)
    inside, rise = _nodes(low, high)
    depth = top - base
    above = (high[..., None] - inside) / np.asarray(depth)[..., None]
    at_base = rise_below.sum(axis=-1)
    speed = at_base + (above * rise).sum(axis=-1)
    return np.asarray(speed), np.asarray(rise.sum(axis=-1) / depth)


def _nodes(start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points between two distances from the wall, and the rise of the speed at each.

    Both have the points of the quadrature along their last axis.
    """
    root, weight = _quadrature()
    first = np.arcsinh(start / BUFFER)
    width = np.arcsinh(end / BUFFER) - first
    stretched = first[..., None] + width[..., None] * (root + 1) / 2
    y = BUFFER * np.sinh(stretched)
    step = width[..., None] * weight / 2 * BUFFER * np.cosh(stretched)
    return y, step * shear(y)


@cache
def _quadrature() -> tuple[FloatArray, FloatArray]:
    """Points and weights of Gauss's quadrature, from -1 to 1."""
    return leggauss(GAUSS_POINTS)


def shear(y: FloatArray) -> FloatArray:
    """Compute the shear nu U'/ustar^2 of van Driest's profile.

    Parameters
    ----------
    y
        Distance from the shifted wall, wall units.

    Returns
    -------
    FloatArray
        Shear, of the same shape.

    Examples
    --------
    >>> print(shear(np.array([0.0, 5.0, 100.0])).round(4))
    [1.     0.8966 0.0246]
    """
    return 2 / (1 + np.sqrt(1 + 4 * _mixing_length(y) ** 2))


def _mixing_length(y: FloatArray) -> FloatArray:
    """Mixing length of van Driest, l = 0.41 y (1 - exp(-y/26)), wall units."""
    return -KARMAN * y * np.expm1(-y / DAMPING)
