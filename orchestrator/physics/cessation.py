"""When grains that hop come to rest, and when they go on from a pocket, from tables.

The tables hold what `saltation` finds by following trajectories, which takes a second
for each few grains. Numbers and units are those of `saltation`.
"""

from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.physics.grain import Grain
from orchestrator.physics.saltation import HoppingThresholds, thresholds
from orchestrator.types import BoolArray, FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator

TABLE = Path(__file__).with_name("saltation.csv")
"""Thresholds on beds with z0 = d/30 at nodes, made by ``tools/saltation.py``."""
GALILEO_NODES = np.geomspace(0.3, 1e5, 51)
DENSITY_NODES = np.geomspace(1.1, 1e5, 27)
SLOPE_NODES_DEG = np.linspace(-30.0, 30.0, 13)
"""Nodes of the table."""


ROUGHNESS_TABLE = Path(__file__).with_name("saltation_roughness.csv")
"""Thresholds of cessation on level beds of other roughness, by the same tool."""
OTHER_GALILEO_NODES = np.geomspace(0.3, 1e5, 26)
OTHER_DENSITY_NODES = np.array(
    [1.1, 1.3, 1.6, 2.0, 2.65, 4, 8, 20, 60, 200, 700, 2200, 7000, 2.5e4, 1e5]
)
RATIO_NODES = np.concatenate(
    [np.geomspace(1e-3, 0.01, 5), np.geomspace(0.01, 0.1, 10)[1:]]
)
"""Nodes of that table; the last are of z0/d."""


def cessation(grains: Grain) -> FloatArray:
    """Find the thresholds of cessation, also on beds of another roughness, at once.

    That of z0 = d/30 is the table's. On others it has the factor of a level bed of that
    roughness, which is interpolated in logarithms of Galileo number, density ratio and
    z0/d. Of 230 grains at random on level beds this differs from `thresholds` by 0.1 %
    in the median, by 1.2 % or less for 95 % and by 7.5 % at most; of 85 on slopes by 4
    % or less for 95 %, and by 11 % at most. Beyond the tables trajectories are
    followed.

    Parameters
    ----------
    grains
        The grains.

    Returns
    -------
    FloatArray
        Shields numbers, shape (n,), as in `HoppingThresholds`.

    Examples
    --------
    >>> sand = Grain.of_numbers(127.0, 2.65, ratio=[1 / 30, 1 / 10])
    >>> print(cessation(sand).round(3))
    [0.033 0.08 ]
    """
    usual = grains.changed(roughness=grains.diameter / SAND_GRAIN)
    points = np.log([grains.galileo, grains.density_ratio, grains.ratio])
    ends = np.array([[axis[0], axis[-1]] for axis in _OTHER_AXES])
    is_inside = is_tabulated(usual)
    is_inside &= ((points >= ends[:, :1]) & (points <= ends[:, 1:])).all(axis=0)
    found = np.full(len(grains), np.nan)
    inside = np.flatnonzero(is_inside)
    if len(inside):
        of_table = _other_table()
        here = points[:, inside].T
        on_usual = here.copy()
        on_usual[:, 2] = -np.log(SAND_GRAIN)
        factor = np.exp(of_table(here) - of_table(on_usual))
        found[inside] = tabulated(usual.at(inside)).cessation * factor
    outside = np.flatnonzero(~is_inside)
    if len(outside):
        found[outside] = tabulated(grains.at(outside)).cessation
    return found


_OTHER_AXES = (
    np.log(OTHER_GALILEO_NODES),
    np.log(OTHER_DENSITY_NODES),
    np.log(RATIO_NODES),
)


@cache
def _other_table() -> "RegularGridInterpolator":
    """Logarithms of the thresholds of cessation on level beds of other roughness."""
    from scipy.interpolate import RegularGridInterpolator  # slow to import

    numbers = np.loadtxt(ROUGHNESS_TABLE, skiprows=1)
    shape = [len(axis) for axis in _OTHER_AXES]
    return RegularGridInterpolator(_OTHER_AXES, np.log(numbers).reshape(shape))


def tabulated(grains: Grain) -> HoppingThresholds:
    """Find the thresholds of grains from the table, or by `thresholds` where it ends.

    The thresholds are interpolated linearly: their logarithms over the logarithms of
    Galileo number and density ratio, themselves over the slope.

    Parameters
    ----------
    grains
        The grains, which rebound as `BEADS`.

    Returns
    -------
    HoppingThresholds
        The thresholds, arrays of shape (n,).

    Examples
    --------
    1 mm in water, and 0.25 mm in air:

    >>> sand = Grain.of_numbers([127.0, 38.8], [2.65, 2208.0])
    >>> print(tabulated(sand).steady.round(3))
    [0.033 0.028]
    """
    is_inside = is_tabulated(grains)
    found = np.full((2, len(grains)), np.nan)
    found[:, is_inside] = _interpolated(grains.at(is_inside))
    outside = np.flatnonzero(~is_inside)
    if len(outside):
        beyond = _beyond_table(grains.at(outside))
        found[0, outside] = beyond.steady
        found[1, outside] = beyond.cessation
    return HoppingThresholds(steady=found[0], cessation=found[1])


_AXES = (np.log(GALILEO_NODES), np.log(DENSITY_NODES), SLOPE_NODES_DEG)
"""Axes of the table, in which it is linear."""


def _points(grains: Grain) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The places of grains on the axes of the table; NaN where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        galileo = np.log(grains.galileo)
        density = np.log(grains.density_ratio)
    return galileo, density, grains.slope_deg


def is_tabulated(grains: Grain) -> BoolArray:
    """Tell whether the table holds each grain: its bed, its flow and its place.

    Parameters
    ----------
    grains
        The grains.

    Returns
    -------
    ndarray
        Truth values, shape (n,); others take a second for each few grains.

    Examples
    --------
    >>> print(is_tabulated(Grain.of_numbers(38.8, 2208.0, ratio=[1 / 30, 0.1])))
    [ True False]
    """
    is_inside = np.isclose(grains.ratio * SAND_GRAIN, 1, rtol=1e-6, atol=0)
    is_inside &= (grains.fall <= 0) & (grains.relative_size == 1)
    for nodes, point in zip(_AXES, _points(grains), strict=True):
        is_inside &= (point >= nodes[0]) & (point <= nodes[-1])
    return is_inside


def _interpolated(grains: Grain) -> FloatArray:
    """Thresholds of grains that the table holds, of shape (2, n)."""
    galileo, density, slope = _points(grains)
    below = np.searchsorted(SLOPE_NODES_DEG, slope, side="right") - 1
    below = np.minimum(below, len(SLOPE_NODES_DEG) - 2)
    ends = SLOPE_NODES_DEG[below], SLOPE_NODES_DEG[below + 1]
    table = _table()
    gentle, steep = (np.exp(table((galileo, density, end))).T for end in ends)
    part = (slope - ends[0]) / (ends[1] - ends[0])
    return np.asarray(gentle + part * (steep - gentle))


def _beyond_table(grains: Grain) -> HoppingThresholds:
    """The thresholds of grains that the table does not hold, of alike ones once."""
    numbers = (
        grains.galileo,
        grains.density_ratio,
        grains.slope_deg,
        grains.ratio,
        grains.fall,
        grains.relative_size,
    )
    rows = [*zip(*(values.tolist() for values in numbers), strict=True)]
    unlike: dict[tuple[float, ...], int] = {}
    places = [unlike.setdefault(row, len(unlike)) for row in rows]
    found = _of_unlike(tuple(unlike))
    return HoppingThresholds(found.steady[places], found.cessation[places])


@lru_cache(maxsize=64)  # tables, cards and pictures ask for the same grains
def _of_unlike(rows: tuple[tuple[float, ...], ...]) -> HoppingThresholds:
    """The same of grains by the numbers of each."""
    galileo, density_ratio, slope_deg, ratio, fall, relative_size = np.array(rows).T
    grains = Grain.of_numbers(
        galileo,
        density_ratio,
        slope_deg=slope_deg,
        ratio=ratio,
        fall=fall,
        relative_size=relative_size,
    )
    return thresholds(grains)


LOG_OF_NOTHING = -1e300
"""Logarithm of a threshold of 0, which any part of makes one of 0."""


@cache
def _table() -> "RegularGridInterpolator":
    """Logarithms of the thresholds, steady and of cessation, on the table's axes."""
    from scipy.interpolate import RegularGridInterpolator  # slow to import

    both = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    with np.errstate(divide="ignore"):  # of 0, below `LEAST`
        logarithms = np.maximum(np.log(both), LOG_OF_NOTHING)
    shape = [len(nodes) for nodes in _AXES]
    return RegularGridInterpolator(_AXES, logarithms.reshape(*shape, 2))
