"""A threshold in the units that people measure: wind, mean velocity and stress.

A friction velocity is turned into them here alone, of numbers and of columns. Here are
also the intervals that a threshold of grains has.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.beside import SUSTAINED
from orchestrator.physics.constants import CHANNEL, GAS_BELOW, SLOPE
from orchestrator.physics.grain import Grain
from orchestrator.physics.velocity import measurable_speeds
from orchestrator.types import BoolArray, FloatArray

CLOSED_CHANNEL = "closed channel"
"""Word of the column ``flow_top`` for a flow between two walls."""
REPORTED = {
    "ustar0": "_m_s",
    "stress": "_pa",
    "wind_10m": "_m_s",
    "mean_velocity": "_m_s",
    "depth": "_m",
    "discharge": "_m2_s",
}
"""Quantities by which thresholds are reported, with the unit in names of columns."""
OF_CHANNELS = ("depth", "discharge")
"""Those of `REPORTED` that a channel alone has, of the calculator."""
MEASURED, NUMERICAL, CHOICES, SEEDS, OF_LAWS = (
    "measured thresholds",
    "numerical",
    "numerical and choices",
    "seeds",
    "force laws",
)
"""What an interval is of, in the column ``interval_of``."""
IN_GAS = "field sites and a formula"
"""The same of measured thresholds in a gas."""
COUNT = "interval_laws"
"""Column of the number of force laws whose range an interval is."""
WIDTH = 1.02
"""Ratio of the ends from which force laws have a range: below they are the same."""


def every_unit(ustar: ArrayLike, flow: Any) -> dict[str, FloatArray]:
    """Convert friction velocities of undisturbed flows to all that is measured of them.

    Parameters
    ----------
    ustar
        Friction velocities, m/s.
    flow
        A table, a row or a mapping of columns of fluid and bed, which broadcast with
        them: density, viscosity, roughness length, depth, ``flow_top`` of a closed
        channel, `CHANNEL` of a bed with two roughnesses, and `SLOPE` of a channel whose
        depth follows from the flow.

    Returns
    -------
    dict of str to ndarray
        Friction velocity, stress on the bed, depth of the flow of a slope, the speeds
        of `measurable_speeds`, and over a `CHANNEL` the discharge for each metre of
        width, by their columns.

    Examples
    --------
    >>> water = {"rho_f_kg_m3": 1000.0, "nu_m2_s": 1e-6, "z0_m": 1e-4, "g_m_s2": 9.81}
    >>> river = every_unit(0.05, {**water, "depth_m": 1.0, "bed_slope": 1e-3})
    >>> print(river["depth_m"].round(3), river["mean_velocity_m_s"].round(3))
    0.255 0.835
    """
    density = np.asarray(flow["rho_f_kg_m3"], float)
    speed = np.asarray(ustar, float)
    depth = np.asarray(flow["depth_m"], float)
    found = {"ustar0_m_s": speed, "stress_pa": density * speed**2}
    if SLOPE in flow:
        # the stress of a wide channel of depth h that falls by S is rho g h S
        gravity = np.asarray(flow["g_m_s2"], float)
        depth = speed**2 / (gravity * np.asarray(flow[SLOPE], float))
        found["depth_m"] = depth
    is_closed = False
    if "flow_top" in flow:
        is_closed = np.asarray(flow["flow_top"], object) == CLOSED_CHANNEL
    roughness = flow[CHANNEL] if CHANNEL in flow else flow["z0_m"]
    speeds = measurable_speeds(
        speed,
        roughness=np.asarray(roughness, float),
        fluid_density=density,
        viscosity=np.asarray(flow["nu_m2_s"], float),
        depth=depth,
        closed=is_closed,
    )
    if CHANNEL in flow:
        found["discharge_m2_s"] = np.asarray(speeds["mean_velocity_m_s"] * depth)
    return found | speeds


def in_units(
    ustar: ArrayLike, flow: Any, end: str = "", before: str = ""
) -> dict[str, FloatArray]:
    """Make the columns of friction velocities in every unit that is reported.

    Parameters
    ----------
    ustar, flow
        As `every_unit` takes them.
    end, before
        What the names of the columns have before their unit, and at their beginning.

    Returns
    -------
    dict of str to ndarray
        Those of `REPORTED`, with the depth of the flow of a slope and the discharge
        over a `CHANNEL`.

    Examples
    --------
    >>> water = {"rho_f_kg_m3": 1000.0, "nu_m2_s": 1e-6, "z0_m": 1e-4, "depth_m": 0.5}
    >>> low = in_units(0.05, water, "_low", "first_")
    >>> print(low["first_mean_velocity_low_m_s"].round(3))
    0.917
    """
    found = every_unit(ustar, flow)
    columns = {}
    for stem, unit in REPORTED.items():
        if stem + unit in found:
            columns[f"{before}{stem}{end}{unit}"] = found[stem + unit]
    return columns


class Interval(NamedTuple):
    """Intervals of n friction velocities, m/s, and what they are of.

    Attributes
    ----------
    low, high
        Their ends; NaN where one is not known.
    of
        A word for what each is of; None without an interval.
    laws
        Number of force laws whose range it is; NaN where it is none.
    """

    low: FloatArray
    high: FloatArray
    of: Any
    laws: FloatArray

    @classmethod
    def tested(cls, table: Any, ustar: FloatArray) -> "Interval":
        """Take the tested interval of each threshold, where it has one.

        Parameters
        ----------
        table
            The columns of grains and fluids, and those of `beside`.
        ustar
            The friction velocities, m/s.

        Returns
        -------
        Interval
            Their intervals.
        """
        theta = np.asarray(table["shields"], float)
        with np.errstate(invalid="ignore", divide="ignore"):
            low = ustar * np.sqrt(np.asarray(table["tested_low"], float) / theta)
            high = ustar * np.sqrt(np.asarray(table["tested_high"], float) / theta)
        is_tested = np.asarray(table["tested_rows"], float) > 0
        of = np.full(len(ustar), None, object)
        of[is_tested] = tested_word(table)[is_tested]
        return cls(low, high, of, np.full(len(ustar), np.nan))

    def or_of_laws(self, by_law: Iterable[tuple[FloatArray, BoolArray]]) -> "Interval":
        """Take the range of force laws where there is no other interval.

        Parameters
        ----------
        by_law
            Friction velocities by each law that takes part, m/s, and whether it holds.

        Returns
        -------
        Interval
            The intervals; none of laws that agree.
        """
        held = np.array([np.where(holds, ustar, np.nan) for ustar, holds in by_law])
        low = np.fmin.reduce(held)
        high = np.fmax.reduce(held)
        count = np.isfinite(held).sum(axis=0)
        is_none = np.array([word is None for word in self.of], bool)
        taken = is_none & (high > WIDTH * low)
        of = self.of.copy()
        of[taken] = OF_LAWS
        return Interval(
            np.where(taken, low, self.low),
            np.where(taken, high, self.high),
            of,
            np.where(taken, count, self.laws),
        )

    def columns(self, table: Any) -> dict[str, Any]:
        """Make the columns of the intervals in every unit.

        Parameters
        ----------
        table
            The columns of grains, fluids and beds.

        Returns
        -------
        dict of str to ndarray
            The columns.
        """
        made: dict[str, Any] = {}
        grains = Grain.of_table(table)
        for end, at in (("_low", self.low), ("_high", self.high)):
            made |= in_units(at, table, end)
            made[f"shields{end}"] = grains.shields(at)
        return {**made, "interval_of": self.of, COUNT: self.laws}


def tested_word(table: Any) -> Any:
    """Say what the tested intervals of thresholds are of.

    Parameters
    ----------
    table
        Columns, among them the density of the fluid.

    Returns
    -------
    ndarray
        `MEASURED`, or `IN_GAS`.
    """
    is_gas = np.asarray(table["rho_f_kg_m3"], float) < GAS_BELOW
    return np.where(is_gas, IN_GAS, MEASURED).astype(object)


def has_no_law(table: Any, count: int) -> BoolArray:
    """Tell which thresholds depend on no force law: those that going on decides.

    Parameters
    ----------
    table
        Columns, among them ``decides`` or not.
    count
        Number of the thresholds.

    Returns
    -------
    ndarray
        Truth values, shape (n,).
    """
    if "decides" not in table:
        return np.zeros(count, bool)
    return np.asarray(np.asarray(table["decides"], object) == SUSTAINED)


def compared_columns(
    table: Any,
    ustar: FloatArray,
    is_level: Any = False,
    which: str = "",
) -> dict[str, FloatArray]:
    """Make the columns of a flow with other thresholds in place of the computed one.

    Those are the threshold of flumes or of a formula that it is compared with, and the
    ends of what was measured.

    Parameters
    ----------
    table
        The columns of grains, fluids and beds, those of `beside`, and the friction
        velocities of one grain on a level bed, computed and compared with.
    ustar
        The flow, m/s: it goes with the threshold of the grain.
    is_level
        Whether each bed is level: its flow has the stress of the grain everywhere.
    which
        ``first_`` for the flow that moves the first grains.

    Returns
    -------
    dict of str to ndarray
        The columns in every unit: ``compared_…`` of the threshold that it is compared
        with, ``measured_…_low`` and ``measured_…_high`` of the ends of what was
        measured.
    """
    level = np.asarray(table["level_ustar_m_s"], float)
    grains = Grain.of_table(table)
    of_grain = {
        "": np.asarray(table["compared_level_ustar_m_s"], float),
        "_low": grains.ustar_at(table["measured_low"]),
        "_high": grains.ustar_at(table["measured_high"]),
    }
    made: dict[str, FloatArray] = {}
    for end, at in of_grain.items():
        with np.errstate(invalid="ignore", divide="ignore"):
            there = np.where(is_level, at, ustar * at / level)
        word = "measured_" if end else "compared_"
        made |= in_units(there, table, end, word + which)
    return made


def compared_range(
    columns: Any, ustar: FloatArray, usable: BoolArray, which: str = ""
) -> tuple[FloatArray, FloatArray]:
    """Find the intervals of flows with other thresholds in place of computed ones.

    Each contains the flow, the computed one, the ends of what was measured, and the
    interval of the computed one: as it is where it is of measured thresholds or of
    force laws, else in proportion, since such an error is relative. Of a computed flow
    that is not usable nothing is left but what was measured and the other flow.

    Parameters
    ----------
    columns
        The columns of `compared` and of the intervals of the computed flows.
    ustar
        The computed flows, m/s, shape (n,).
    usable
        Whether these are usable, shape (n,).
    which
        ``first_`` for the flows that move the first grains.

    Returns
    -------
    low, high : ndarray
        Friction velocities, m/s; NaN where an end is open, or there is no flow.
    """
    there, low, high, least, most = (
        np.asarray(columns[name], float)
        for name in (
            f"compared_{which}ustar0_m_s",
            f"{which}ustar0_low_m_s",
            f"{which}ustar0_high_m_s",
            f"measured_{which}ustar0_low_m_s",
            f"measured_{which}ustar0_high_m_s",
        )
    )
    of = np.asarray(columns["interval_of"], object).astype(str)
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = np.where(np.isin(of, [MEASURED, IN_GAS, OF_LAWS]), 1.0, there / ustar)
    is_known = np.isfinite(low) | np.isfinite(high)
    own = np.where(usable, ustar, np.nan)
    found = []
    for end, of_rows, outer, beyond in (
        (low * scale, least, np.fmin, -np.inf),
        (high * scale, most, np.fmax, np.inf),
    ):
        # an end that is open stays open
        at = np.where(is_known & ~np.isfinite(end), beyond, end)
        held = np.where(usable, outer(outer(at, own), there), np.nan)
        # of a formula the other flow may lie outside what was measured
        held = outer(
            held, np.where(np.isfinite(of_rows), outer(of_rows, there), np.nan)
        )
        found.append(np.where(np.isfinite(held) & np.isfinite(there), held, np.nan))
    return found[0], found[1]
