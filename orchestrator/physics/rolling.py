"""Sustained motion: when a sphere that has left its pocket rolls and hops on.

Rolling and hopping are one motion, of a sphere over the fixed spheres of poured beds.
Half of the spheres that are laid on a bed come 30 d in a gust, and half of these come
20 d more in the mean flow after it. ``tools/rolling.py`` follows them, and makes the
tables that are read here; docs/model.md has the equations and the choices.

A grain is its Galileo number Ga = sqrt((s - 1) g d^3)/nu and its density ratio s =
rho_sol/rho_f. The table is of level beds, of a deep flow, and of grains among their
like, with z0 = d/30. Factors lead to other beds.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.physics.grain import Grain
from orchestrator.types import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator

TABLE = Path(__file__).with_name("rolling.csv")
"""Shields numbers on level beds."""
FACTORS = Path(__file__).with_name("rolling_factors.csv")
"""By how much they are larger on other beds."""
End = Literal["low", "middle", "high"]
"""Which Shields numbers of the model: the threshold, or an end of its interval.

The ends are of a quarter of the spheres and a second way of 10 d, and of three quarters
of them and 40 d.
"""
COLUMNS: dict[End, tuple[str, str]] = {
    "low": ("start_25", "after_10_25"),
    "middle": ("start_50", "after_20_50"),
    "high": ("start_75", "after_40_75"),
}
"""Columns of the tables: of the flow that starts spheres, and that keeps them going."""


@dataclass(frozen=True, eq=False)
class Sustained:
    """Shields numbers of flows in which spheres go on, arrays of shape (n,).

    They are 0 on a bed so steep that spheres roll without a flow.

    Attributes
    ----------
    start
        Of a flow in which spheres that lie on the bed come the first way.
    after
        Of a mean flow in which those that a gust started come the second way.
    """

    start: FloatArray
    after: FloatArray

    def initiation(self, peak: ArrayLike = 1.0) -> FloatArray:
        """Compute the mean stress from which a gust starts motion that is sustained.

        Parameters
        ----------
        peak
            Stress of the gust over that of the mean flow.

        Returns
        -------
        FloatArray
            Shields numbers of the mean flow, of the broadcast shape.

        Examples
        --------
        >>> of_air = Sustained(start=np.array([0.025]), after=np.array([0.006]))
        >>> print(of_air.initiation([1.0, 2.5, 10.0]))
        [0.025 0.01  0.006]
        """
        return np.asarray(np.maximum(self.start / np.asarray(peak, float), self.after))


def sustained(grains: Grain, end: End = "middle") -> Sustained:
    """Find the flows in which spheres roll and hop on.

    They are interpolated linearly: on level beds the logarithms of the Shields numbers
    over those of Galileo number and density ratio. Beyond the ends of the table the
    numbers of its ends are taken.

    Parameters
    ----------
    grains
        The grains, of shape (n,).
    end
        The threshold, or an end of the model's interval.

    Returns
    -------
    Sustained
        Their Shields numbers.

    Examples
    --------
    1 mm in water, and 0.25 mm in air:

    >>> sand = Grain.of_numbers([127.0, 38.8], [2.65, 2208.0])
    >>> print(sustained(sand).initiation(2.28).round(3))
    [0.027 0.011]
    """
    table, ends = _level(end)
    with np.errstate(divide="ignore", invalid="ignore"):
        point = np.log([grains.galileo, grains.density_ratio])
        excess = grains.density_ratio - 1
        values = {
            "slope_deg": grains.slope_deg,
            "shallow": np.maximum(grains.fall, 0) / excess,
            "relative_size": np.log(grains.relative_size),
            "roughness": np.log(grains.ratio * grains.relative_size * SAND_GRAIN),
        }
    # numbers that are not known stay so
    inside = np.clip(point, ends[:, :1], ends[:, 1:])
    found = np.exp(table(inside.T)).T
    for kind, value in values.items():
        factors = _factors(kind)
        found = found * factors.at(inside, value)
    return Sustained(start=found[0], after=found[1])


class _Factors:
    """Factors of both numbers over a value, Galileo number and density ratio."""

    def __init__(self, axes: list[FloatArray], numbers: FloatArray) -> None:
        """Make them of nodes of value, Galileo number and density ratio."""
        from scipy.interpolate import RegularGridInterpolator  # slow to import

        self.axes = axes
        self.table = RegularGridInterpolator(axes, numbers)

    def at(self, point: FloatArray, value: FloatArray) -> FloatArray:
        """The factors at some points, shape (2, n); beyond the nodes a line goes on."""
        nodes, *others = self.axes
        place = np.clip(np.searchsorted(nodes, value) - 1, 0, len(nodes) - 2)
        low, high = nodes[place], nodes[place + 1]
        inside = [
            np.clip(each, axis[0], axis[-1])
            for each, axis in zip(point, others, strict=True)
        ]
        of_low = self.table(np.column_stack([low, *inside]))
        of_high = self.table(np.column_stack([high, *inside]))
        part = ((value - low) / (high - low))[:, None]
        return np.asarray(np.maximum(of_low + part * (of_high - of_low), 0)).T


@cache
def _level(end: End) -> tuple["RegularGridInterpolator", FloatArray]:
    """Logarithms of both numbers on level beds, and the ends of their axes."""
    from scipy.interpolate import RegularGridInterpolator  # slow to import

    rows = np.genfromtxt(TABLE, delimiter=",", names=True)
    axes = [np.unique(rows[name]) for name in ("galileo", "density_ratio")]
    both = np.column_stack([rows[name] for name in COLUMNS[end]])
    shape = [len(axis) for axis in axes]
    logs = [np.log(axis) for axis in axes]
    table = RegularGridInterpolator(logs, np.log(both).reshape(*shape, 2))
    return table, np.array([[each[0], each[-1]] for each in logs])


@cache
def _factors(kind: str) -> _Factors:
    """The factors of a column of the grains."""
    names = ("value", "galileo", "density_ratio", "start", "after")
    table = np.genfromtxt(FACTORS, delimiter=",", names=True, dtype=None, encoding=None)
    rows = table[table["kind"] == kind]
    value, galileo, density, start, after = (rows[name].astype(float) for name in names)
    is_ratio = kind in {"relative_size", "roughness"}
    if kind == "roughness":
        value = value * SAND_GRAIN
    nodes = [np.unique(np.log(value) if is_ratio else value)]
    axes = [*nodes, np.unique(np.log(galileo)), np.unique(np.log(density))]
    shape = [len(axis) for axis in axes]
    return _Factors(axes, np.column_stack([start, after]).reshape(*shape, 2))
