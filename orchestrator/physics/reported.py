"""A threshold in the units that people measure: wind, mean velocity and stress.

A friction velocity is turned into them here alone, of numbers and of columns.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.velocity import measurable_speeds
from orchestrator.types import FloatArray

CLOSED_CHANNEL = "closed channel"
"""Word of the column ``flow_top`` for a flow between two walls."""


def in_units(
    ustar: ArrayLike, flow: Any, end: str = "", before: str = ""
) -> dict[str, FloatArray]:
    """Convert friction velocities of undisturbed flows to what is measured of them.

    Parameters
    ----------
    ustar
        Friction velocities, m/s.
    flow
        The columns of fluid and bed, which broadcast with them: density, viscosity,
        roughness length, depth, and ``flow_top`` of a closed channel.
    end, before
        What the names of the columns have before their unit, and at their beginning.

    Returns
    -------
    dict of str to ndarray
        Friction velocity, stress on the bed, and the speeds of `measurable_speeds`,
        each with its unit in its name.

    Examples
    --------
    >>> water = {"rho_f_kg_m3": 1000.0, "nu_m2_s": 1e-6, "z0_m": 1e-4, "depth_m": 0.5}
    >>> low = in_units(0.05, water, "_low", "first_")
    >>> print(low["first_mean_velocity_low_m_s"].round(3))
    0.917
    """
    density = np.asarray(flow["rho_f_kg_m3"], float)
    speeds = measurable_speeds(
        ustar,
        roughness=np.asarray(flow["z0_m"], float),
        fluid_density=density,
        viscosity=np.asarray(flow["nu_m2_s"], float),
        depth=np.asarray(flow["depth_m"], float),
        closed=is_closed(flow),
    )
    speed = np.asarray(ustar, float)
    found = {"ustar0_m_s": speed, "stress_pa": density * speed**2, **speeds}
    columns = {}
    for name, values in found.items():
        for unit in ("_m_s", "_pa"):
            if name.endswith(unit):
                stem = name.removesuffix(unit)
                columns[f"{before}{stem}{end}{unit}"] = values
    return columns


def is_closed(flow: Any) -> Any:
    """Tell which flows are closed channels.

    Parameters
    ----------
    flow
        Columns, among them ``flow_top`` or not.

    Returns
    -------
    bool or ndarray
        Whether each is one.
    """
    if "flow_top" not in flow:
        return False
    return np.asarray(flow["flow_top"], object) == CLOSED_CHANNEL
