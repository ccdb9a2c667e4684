"""The closed form as lines: Eqs. 3 and 5 over a sweep of the diameter.

In (Re*, tau) both are curves that neither density, viscosity nor gravity changes: these only say
which part of a curve the grains of a study are on.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.physics import closures
from orchestrator.physics.closures import Closure, Threshold

FloatArray = NDArray[np.float64]

SWEEP_M = (5e-5, 1e-3)
"""Diameters of the paper; a study with others widens the sweep."""
POINTS = 240
PARTICLE_REYNOLDS_LIMIT = 1000.0
"""V_f d/nu up to which the drag law of Eq. 4 (Schiller and Naumann) holds."""


@dataclass(frozen=True)
class Branch:
    """One force law's line in the Shields diagram; arrays of one shape, Re* rising.

    Attributes
    ----------
    force law : {"low", "high"}
        Eq. 3 or Eq. 5.
    reynolds, shields : ndarray
        Re* and tau at the threshold.
    valid, transition : ndarray of bool
        Where the force law holds; where neither force law does.
    """

    law_name: Closure
    reynolds: FloatArray
    shields: FloatArray
    valid: NDArray[np.bool_]
    transition: NDArray[np.bool_]


def branches(scenes: pd.DataFrame) -> list[Branch]:
    """The lines through scenes of one slope, one entrainment angle and one z0/d."""
    found: list[Branch] = []
    for _, same in scenes.groupby("alpha_s"):
        low, high = (_swept(law_name, same) for law_name in closures.CLOSURES)
        transition = closures.regime(low, high) == "transition"
        found += [_branch("low", low, transition), _branch("high", high, transition)]
    return found


def sweep(scenes: pd.DataFrame) -> FloatArray:
    """Diameters of the paper's range, or of the scenes' where that is wider, m."""
    d = scenes["d_m"]
    return np.geomspace(min(SWEEP_M[0], d.min()), max(SWEEP_M[1], d.max()), POINTS)


def _swept(law_name: Closure, scenes: pd.DataFrame) -> Threshold:
    viscosities = np.unique(scenes["nu_m2_s"])
    d, nu = (grid.ravel() for grid in np.meshgrid(sweep(scenes), viscosities))
    one = scenes.iloc[0]
    return closures.threshold(
        law_name,
        diameter=d,
        density=one["rho_sol_kg_m3"],
        fluid_density=one["rho_f_kg_m3"],
        viscosity=nu,
        slope_deg=one["alpha_deg"],
        entrainment_angle_deg=one["beta_deg"],
        roughness=one["z0_over_d"] * d,
        lift_coefficient=one["alpha_s"],
        gravity=one["g_m_s2"],
    )


def _branch(law_name: Closure, found: Threshold, transition: NDArray[np.bool_]) -> Branch:
    order = np.argsort(found.reynolds)
    reynolds, shields = found.reynolds[order], found.shields[order]
    return Branch(law_name, reynolds, shields, found.valid[order], transition[order])


def drag_law_limit(z0_over_d: float) -> float:
    """Re* at which the particle Reynolds number V_f d/nu reaches the limit of the drag law."""
    return PARTICLE_REYNOLDS_LIMIT / float(closures.mean_speed_ratio(1.0, z0_over_d))
