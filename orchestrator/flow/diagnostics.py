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

BEHIND_INLET = 1.0
"""Where the bed is undisturbed yet, h behind the inlet: a pile slows the flow by 4 % at 5 h before
its toe, and the inlet is at 10."""
UPSTREAM_ERROR = 0.02
"""Of u* there: sound runs are within 0.011, whatever the mesh and the turbulence model; below 4 z0
or without turbulence in the first cell it is 0.025 to 0.1."""
SEPARATES_FROM_DEG = 15.0
"""Slope from which the flow always separates behind the crest, and reattaches 5 to 9 h from it."""
SHORTEST_BUBBLE = 4.8
"""Least of these lengths, h; upwind convection gives 3.5 to 4.6."""


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
    stress: WallStress, *, slope_deg: float, height: float, roughness: float, reynolds: float
) -> dict[str, Diagnostic]:
    """The diagnostics of a stress, by their quantity.

    Parameters
    ----------
    stress : WallStress
        Of the solved flow.
    slope_deg, height, roughness : float
        Of the pile, degrees and m.
    reynolds : float
        u*_0 over the solve's nu, 1/m.
    """
    centre = float(np.median(stress.z_e_m))
    upstream = float(stress.mean_over(stress.edges_m[0] + BEHIND_INLET * height, 0.5 * height))
    bubble = SHORTEST_BUBBLE if slope_deg >= SEPARATES_FROM_DEG else 0.0
    found = (
        # y+: the eddy viscosity is kappa y+ times the molecular one
        Diagnostic("y_plus", reynolds * centre, 1 / KARMAN, inf),
        Diagnostic("z_e_over_z0", centre / roughness, 9.0, inf),
        Diagnostic(
            "upstream_ustar_over_ustar0",
            float(np.sign(upstream) * np.sqrt(abs(upstream))),
            1 - UPSTREAM_ERROR,
            1 + UPSTREAM_ERROR,
        ),
        Diagnostic("reattachment_over_h", reattachment(stress, height), bubble, inf),
    )
    return {one.quantity: one for one in found}


def reattachment(stress: WallStress, height: float) -> float:
    """Where the reversed flow behind the crest ends, h downstream of it; 0 where there is none."""
    crest = stress.x_m[int(np.argmax(stress.z_m))]
    reversed_at = stress.x_m[(stress.x_m > crest) & (stress.tau_wall < 0)]
    return float(reversed_at.max(initial=crest) - crest) / height


def to_csv(found: dict[str, Diagnostic], path: Path) -> None:
    """Write the diagnostics as a table."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["quantity", "value", "sound_from", "sound_to", "sound"])
    for one in found.values():
        row = [one.quantity, f"{one.value:.6g}", one.low, one.high, "yes" if one.sound else "no"]
        writer.writerow(row)
    write_durably(path, text.getvalue())
