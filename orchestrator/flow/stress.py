"""The stress that the flow puts on the bed, along the whole of it, and whether it can be right."""

from dataclasses import dataclass, fields
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from orchestrator.bed.deck import read_texts
from orchestrator.digits import FORMAT
from orchestrator.errors import InputError
from orchestrator.physics.constants import KARMAN
from orchestrator.types import FloatArray

BEND = 1e-3
"""Two faces are in one plane if their middles are as far apart as the bed between them is long,
within this part of it: seven digits of the places make 1e-5 of it, a bend of 10 degrees 4e-3."""
APPROACH_ERROR = 0.08
"""Largest relative difference of u* in the column before the inlet from the log law's: k-epsilon is
within 0.02, other models, whose log law is another, are within 0.07."""
MEAN_SPEED_ERROR = 0.1
"""Largest relative difference of a channel's mean speed, before the inlet, from the log law's."""
SEPARATES_FROM_DEG = 15.0
"""Slope from which the flow always separates behind the crest, and reattaches 5 to 9 h from it."""
SHORTEST_BUBBLE = 5.0
"""Least of these lengths, h; upwind convection gives 3.6 to 4.6 and a part of a cell of h/3."""
Measure = Literal["wall", "eq10"]


@dataclass(frozen=True, eq=False)
class WallStress:
    """Stress on each face of the bed, in the order of the flow; every array has shape (F,).

    Stresses are kinematic and in units of u*_0^2, friction velocities in units of u*_0, the
    undisturbed friction velocity; both are positive where the flow at the bed goes downstream.
    """

    s_m: FloatArray
    """Arc length along the bed from the windward toe to the middle of the face, m."""
    x_m: FloatArray
    z_m: FloatArray
    """Middle of the face: downstream of the windward toe, above the flat bed, m."""
    length_m: FloatArray
    z_e_m: FloatArray
    """Distance of the first cell's centre from the bed, along its normal, m."""
    tau_wall: FloatArray
    ustar_over_ustar0_eq10: FloatArray
    """Eq. 10 at the first cell's centre: 0.41 u_t / ln((z_e + z0)/z0)."""
    ustar_over_ustar0_eq10_printed: FloatArray
    """Eq. 10 as the paper prints it: 0.41 u_t / ln(z_e/z0)."""

    @cached_property
    def ustar_over_ustar0_wall(self) -> FloatArray:
        """Friction velocity of the stress on the wall: sign(tau) sqrt(|tau|)."""
        return np.sign(self.tau_wall) * np.sqrt(np.abs(self.tau_wall))

    @cached_property
    def edges_m(self) -> FloatArray:
        """Ends of the faces along the bed, m; shape (F + 1,)."""
        first = self.s_m[0] - self.length_m[0] / 2.0
        return np.concatenate([[first], first + np.cumsum(self.length_m)])

    def mean_over(
        self, s_m: ArrayLike, length_m: ArrayLike, measure: Measure = "wall"
    ) -> FloatArray:
        """Mean signed stress tau/u*_0^2 over lengths of bed (m) centred on arc lengths (m).

        The two broadcast. The integral is exact: over each face the stress is linear, with the
        face's value as its mean and the slope that its neighbours give. Raises an InputError if a
        length is not positive, or reaches beyond the bed.
        """
        centre, length = np.broadcast_arrays(
            np.asarray(s_m, float), np.asarray(length_m, float)
        )
        low, high, edges = centre - length / 2.0, centre + length / 2.0, self.edges_m
        if not (
            np.all(low < high) and np.all(low >= edges[0]) and np.all(high <= edges[-1])
        ):
            span = f"s = {edges[0]:.4g} ... {edges[-1]:.4g} m"
            raise InputError(
                f"a mean of the stress needs a length within the bed, {span}"
            )
        ustar = self.ustar_over_ustar0_eq10
        tau = self.tau_wall if measure == "wall" else ustar * np.abs(ustar)
        slope, sums = (
            self._slopes(tau),
            np.concatenate([[0.0], np.cumsum(tau * self.length_m)]),
        )

        def integral(s: FloatArray) -> FloatArray:
            face = np.clip(np.searchsorted(edges, s, side="right") - 1, 0, len(tau) - 1)
            into = s - edges[face]
            tilt = slope[face] * (into - self.length_m[face]) / 2.0
            return np.asarray(sums[face] + into * (tau[face] + tilt))

        return np.asarray((integral(high) - integral(low)) / length)

    def _slopes(self, tau: FloatArray) -> FloatArray:
        """Change of the stress along each face, 1/m: the mean of those to its two neighbours."""
        apart = np.diff(self.s_m)
        steps = np.diff(tau) / apart
        chord = np.hypot(np.diff(self.x_m), np.diff(self.z_m))
        steps = np.where(np.abs(chord / apart - 1.0) < BEND, steps, np.nan)
        sides = np.array([np.append(np.nan, steps), np.append(steps, np.nan)])
        # at a bend, or an end of the bed, the one neighbour that is left counts alone
        behind, ahead = np.where(np.isnan(sides), sides[::-1], sides)
        # limited so that no face reaches beyond its neighbours' values
        slope = np.where(behind * ahead > 0.0, (behind + ahead) / 2.0, 0.0)
        most = 2.0 * np.minimum(np.abs(behind), np.abs(ahead))
        return np.asarray(
            np.nan_to_num(np.sign(slope) * np.minimum(np.abs(slope), most))
        )

    def to_csv(self, path: Path) -> None:
        """Write a table of nine digits, which `from_csv` reads."""
        columns = {one.name: getattr(self, one.name) for one in fields(self)}
        table = pd.DataFrame(
            {**columns, "ustar_over_ustar0_wall": self.ustar_over_ustar0_wall}
        )
        table.to_csv(path, index=False, lineterminator="\n", float_format=FORMAT)

    @classmethod
    def from_csv(cls, path: Path) -> "WallStress":
        """Read a table of `to_csv`."""
        columns = read_texts(path)
        return cls(
            **{each.name: columns[each.name].astype(float) for each in fields(cls)}
        )


def diagnostics(
    stress: WallStress,
    approach: float,
    reynolds: float,
    slope_deg: float,
    height: float,
    roughness: float,
    *,
    mean_speed: float | None = None,
) -> pd.DataFrame:
    """A few numbers of a solved flow beside the ranges in which sound flows have them.

    `approach` and, of a channel, `mean_speed` are the friction velocity and the mean speed before
    the inlet over those of the log law; `reynolds` is u*_0 over the solve's nu, 1/m. Lengths in m.
    """
    centre = float(np.median(stress.z_e_m))
    shortest = SHORTEST_BUBBLE if slope_deg >= SEPARATES_FROM_DEG else 0.0
    rows = {
        # y+: the eddy viscosity is kappa y+ times the molecular one
        "y_plus": (reynolds * centre, 1 / KARMAN, inf),
        "z_e_over_z0": (centre / roughness, 0.5, inf),
        "approach_ustar_over_log_law": (
            approach,
            1 - APPROACH_ERROR,
            1 + APPROACH_ERROR,
        ),
        "reattachment_over_h": (
            (bubble(stress, height) or (0.0, 0.0))[1],
            shortest,
            inf,
        ),
    }
    if mean_speed is not None:
        rows["mean_speed_over_log_law"] = (
            mean_speed,
            1 - MEAN_SPEED_ERROR,
            1 + MEAN_SPEED_ERROR,
        )
    columns = ["value", "sound_from", "sound_to"]
    table = pd.DataFrame.from_dict(rows, orient="index", columns=columns)
    sound = table["value"].between(table["sound_from"], table["sound_to"])
    return table.assign(sound=np.where(sound, "yes", "no")).rename_axis("quantity")


def bubble(stress: WallStress, height: float) -> tuple[float, float] | None:
    """Where the reversed flow behind the top begins and ends, h downstream of it.

    A stretch of less than h that runs forward within it is a corner's eddy. None where no flow is
    reversed.
    """
    x, tau = stress.x_m, stress.tau_wall
    top = x[int(np.argmax(stress.z_m))]
    faces = np.flatnonzero((x > top) & (tau < 0))
    if not faces.size:
        return None
    ends = np.flatnonzero(np.diff(x[faces]) > height)
    first, last = faces[0], faces[ends[0]] if ends.size else faces[-1]
    # where the stress changes its sign between two faces: cells of h/3 lie there
    pairs = [first, first - 1], [last, min(last + 1, len(x) - 1)]
    begins, stops = (float(np.interp(0.0, tau[pair], x[pair])) for pair in pairs)
    return (begins - top) / height, (stops - top) / height
