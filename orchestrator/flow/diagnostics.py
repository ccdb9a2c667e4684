"""Whether a solved flow can be right: a few numbers of the run beside the range of sound ones."""

import csv
import io
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from orchestrator.flow.stress import WallStress
from orchestrator.physics.constants import KARMAN
from orchestrator.runs.files import write_durably

APPROACH_ERROR = 0.08
"""Largest relative difference of u* in the column before the inlet from the log law: k-epsilon is
within 0.02, other models, whose log law is another, are within 0.07."""
SEPARATES_FROM_DEG = 15.0
"""Slope from which the flow always separates behind the crest, and reattaches 5 to 9 h from it."""
SHORTEST_BUBBLE = 5.0
"""Least of these lengths, h; upwind convection gives 3.6 to 4.6 and a part of a cell of h/3."""


@dataclass(frozen=True)
class Diagnostic:
    """One number of a run, with the range in which sound runs have it."""

    quantity: str
    value: float
    low: float
    high: float

    @property
    def sound(self) -> bool:
        """Whether the number is within its range; NaN is not."""
        return self.low <= self.value <= self.high


def of(
    stress: WallStress,
    *,
    approach: float,
    slope_deg: float,
    height: float,
    roughness: float,
    reynolds: float,
) -> dict[str, Diagnostic]:
    """The diagnostics of a stress, by their quantity.

    Parameters
    ----------
    stress : WallStress
        The stress of the solved flow.
    approach : float
        Friction velocity before the inlet over that of the log law.
    slope_deg, height, roughness : float
        Slope of the pile, degrees; its height and roughness length, m.
    reynolds : float
        u*_0 over the solve's nu, 1/m.
    """
    centre = float(np.median(stress.z_e_m))
    bubble = SHORTEST_BUBBLE if slope_deg >= SEPARATES_FROM_DEG else 0.0
    found = (
        # y+: the eddy viscosity is kappa y+ times the molecular one
        Diagnostic("y_plus", reynolds * centre, 1 / KARMAN, inf),
        Diagnostic("z_e_over_z0", centre / roughness, 0.5, inf),
        Diagnostic("approach_ustar_over_log_law", approach, 1 - APPROACH_ERROR, 1 + APPROACH_ERROR),
        Diagnostic("reattachment_over_h", reattachment(stress, height), bubble, inf),
    )
    return {one.quantity: one for one in found}


def reattachment(stress: WallStress, height: float) -> float:
    """Where the reversed flow behind the top ends, h downstream of it; 0 where there is none."""
    found = bubble(stress, height)
    return found[1] if found else 0.0


def bubble(stress: WallStress, height: float) -> tuple[float, float] | None:
    """Where the reversed flow behind the top begins and ends, h downstream of it.

    A stretch of less than h that runs forward within it is a corner's eddy. None where no flow is
    reversed.
    """
    top = stress.x_m[int(np.argmax(stress.z_m))]
    faces = np.flatnonzero((stress.x_m > top) & (stress.tau_wall < 0))
    if not faces.size:
        return None
    ends = np.flatnonzero(np.diff(stress.x_m[faces]) > height)
    first, last = faces[0], faces[ends[0]] if ends.size else faces[-1]
    begins = _without_stress(stress, first, first - 1)
    stops = _without_stress(stress, last, min(last + 1, len(stress.x_m) - 1))
    return (begins - top) / height, (stops - top) / height


def _without_stress(stress: WallStress, backward: int, forward: int) -> float:
    """Place between two faces where the stress changes its sign, m: cells of h/3 lie there."""
    pair = [backward, forward]
    return float(np.interp(0.0, stress.tau_wall[pair], stress.x_m[pair]))


def to_csv(found: dict[str, Diagnostic], path: Path) -> None:
    """Write the diagnostics as a table."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["quantity", "value", "sound_from", "sound_to", "sound"])
    for one in found.values():
        row = [one.quantity, f"{one.value:.6g}", one.low, one.high, "yes" if one.sound else "no"]
        writer.writerow(row)
    write_durably(path, text.getvalue())
