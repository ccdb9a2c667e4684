"""The closed form as lines: the threshold of one grain under a force law, of Re* alone.

In (Re*, tau) a law is a curve that neither density, viscosity nor gravity changes: these only say
which part of the curve the grains of a study are on.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from orchestrator.physics.force_law import Exposure
from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import Threshold, shields_at
from orchestrator.report import laws
from orchestrator.report.results import split
from orchestrator.study import closed_form

FloatArray = NDArray[np.float64]

SWEEP_M = (5e-5, 1e-3)
"""Diameters of the paper; a study with others widens the sweep."""
POINTS = 240
WIDER = 10.0
"""Factor on Re* by which lines go on beyond a study's grains: axes cut them."""
GRAIN = [
    "d_m", "z0_m", "rho_f_kg_m3", "nu_m2_s", "alpha_s",
    "rho_sol_kg_m3", "alpha_deg", "beta_deg", "g_m_s2",
]  # fmt: skip
"""Columns of all that the closed form depends on, in its order."""
WHOLE = np.geomspace(1e-4, 1e6, 2001)
"""Re* of any grain."""


@dataclass(frozen=True)
class Branch:
    """One law's line in the Shields diagram; arrays of one shape, Re* rising.

    Attributes
    ----------
    law : str
        Its name.
    reynolds, shields : ndarray
        Re* and tau at the threshold.
    valid, continued : ndarray of bool
        Where the law holds; where it does not, but the study has grains.
    """

    law: str
    reynolds: FloatArray
    shields: FloatArray
    valid: NDArray[np.bool_]
    continued: NDArray[np.bool_]


def branches(scenes: pd.DataFrame) -> list[Branch]:
    """The lines through scenes of one slope, one entrainment angle and one z0/d."""
    scenes = scenes[[*GRAIN, "z0_over_d", "force_law"]]  # parts of sixty columns are dear
    low, high = span(scenes)
    reynolds = np.geomspace(low / WIDER, high * WIDER, POINTS)
    return [
        branch(law, own, reynolds)
        for _, own in split(scenes, "alpha_s")
        for law in laws.drawn(own["force_law"])
    ]


def branch(law: str, scenes: pd.DataFrame, reynolds: FloatArray) -> Branch:
    """The line of a law at some Re*, for the bed of some scenes."""
    bed, here = bed_of(scenes), scenes[scenes["force_law"] == law]
    first, last = span(here) if len(here) else (np.inf, 0.0)
    valid = law_holds(law, reynolds, bed)
    near = (reynolds >= first / 1.01) & (reynolds <= last * 1.01)
    return Branch(law, reynolds, shields(law, reynolds, bed), valid, near & ~valid)


@dataclass(frozen=True)
class Bed:
    """All that the closed form depends on beside Re* and the law; angles in degrees."""

    slope_deg: float
    entrainment_angle_deg: float
    roughness_ratio: float
    lift_coefficient: float


def bed_of(scenes: pd.DataFrame) -> Bed:
    """The bed of scenes that share it."""
    one = scenes.iloc[0]
    return Bed(*(float(one[c]) for c in ("alpha_deg", "beta_deg", "z0_over_d", "alpha_s")))


def shields(law: str, reynolds: FloatArray, bed: Bed) -> FloatArray:
    """Tau of one grain on a bed whose threshold is at some Re*."""
    return shields_at(
        LAWS[law],
        reynolds,
        slope_deg=bed.slope_deg,
        entrainment_angle_deg=bed.entrainment_angle_deg,
        roughness_ratio=bed.roughness_ratio,
        lift_coefficient=bed.lift_coefficient,
    )


def law_holds(law: str, reynolds: FloatArray, bed: Bed) -> NDArray[np.bool_]:
    """Whether a law holds at some Re*."""
    return LAWS[law].valid(reynolds, _unit(bed.roughness_ratio, bed.lift_coefficient))


def _unit(ratio: float, lift_coefficient: float = 1.0) -> Exposure:
    """In units of d, nu and rho_f the friction velocity is Re*."""
    return Exposure(1.0, ratio, 1.0, 1.0, lift_coefficient)


def span(scenes: pd.DataFrame) -> tuple[float, float]:
    """Least and largest Re* of scenes at the thresholds of their single grains."""
    groups = split(scenes[[*GRAIN, "force_law"]], "force_law")
    found = [one.reynolds for (law,), own in groups for one in thresholds(own, str(law))]
    reynolds = np.array(found, float)
    reynolds = reynolds[np.isfinite(reynolds)]
    return float(reynolds.min()), float(reynolds.max())


def thresholds(scenes: pd.DataFrame, law: str) -> list[Threshold]:
    """The closed form of the single grains of some rows under a law."""
    return closed_form.thresholds(law, list(scenes[GRAIN].itertuples(index=False, name=None)))


def sweep(scenes: pd.DataFrame) -> FloatArray:
    """Diameters of the paper's range, or of the scenes' where that is wider, m."""
    d = scenes["d_m"]
    return np.geomspace(min(SWEEP_M[0], d.min()), max(SWEEP_M[1], d.max()), POINTS)


def drag_law_limit(z0_over_d: float, law: str = "high") -> float:
    """Re* at which the particle Reynolds number V d/nu reaches the end of a law's drag."""
    particle = LAWS[law].particle_reynolds(WHOLE, _unit(z0_over_d))
    return float(np.exp(np.interp(np.log(LAWS[law].drag_end), np.log(particle), np.log(WHOLE))))
