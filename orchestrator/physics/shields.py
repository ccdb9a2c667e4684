"""The Shields number of the columns of a table, and back."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.types import FloatArray


def layer_weight(table: Any) -> FloatArray:
    """Compute the weight of a layer of grains under their fluid.

    Parameters
    ----------
    table
        The columns of densities, gravity and diameter.

    Returns
    -------
    FloatArray
        (rho_sol - rho_f) g d, Pa: a stress over it is a Shields number.
    """
    density = np.asarray(table["rho_f_kg_m3"], float)
    excess = np.asarray(table["rho_sol_kg_m3"], float) - density
    diameter = np.asarray(table["d_m"], float)
    return np.asarray(excess * np.asarray(table["g_m_s2"], float) * diameter)


def ustar_of(shields: ArrayLike, table: Any) -> FloatArray:
    """Compute the friction velocity of a Shields number.

    Parameters
    ----------
    shields
        Shields numbers.
    table
        The columns of grains and fluids.

    Returns
    -------
    FloatArray
        Friction velocities, m/s.
    """
    density = np.asarray(table["rho_f_kg_m3"], float)
    stress = np.asarray(shields, float) * layer_weight(table)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(stress / density))


def shields_of(ustar: ArrayLike, table: Any) -> FloatArray:
    """Compute the Shields number of a friction velocity.

    Parameters
    ----------
    ustar
        Friction velocities, m/s.
    table
        The columns of grains and fluids.

    Returns
    -------
    FloatArray
        Shields numbers.
    """
    density = np.asarray(table["rho_f_kg_m3"], float)
    return np.asarray(density * np.asarray(ustar, float) ** 2 / layer_weight(table))
