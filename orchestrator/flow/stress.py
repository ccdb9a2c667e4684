"""The stress that the flow puts on the bed, along the whole of it."""

import csv
import io
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orchestrator.errors import InputError
from orchestrator.physics.velocity import log_law_ustar
from orchestrator.runs.files import write_durably

_DERIVED = "ustar_over_ustar0_wall"

BEND = 1e-3
"""Two faces are in one plane if their middles are as far apart as the bed between them is long,
within this part of it: seven digits of the places make 1e-5 of it, a bend of 10 degrees 4e-3."""

Array = NDArray[np.float64]
Measure = Literal["wall", "eq10"]


def undisturbed_ustar(speed_m_s: float, height_m: float, roughness_m: float) -> float:
    """Friction velocity of the log law with a speed U at a height z: 0.41 U / ln((z + z0)/z0)."""
    return float(log_law_ustar(speed_m_s, height_m, roughness_m))


@dataclass(frozen=True, eq=False)
class WallStress:
    """Stress on each face of the bed, in the order of the flow; every array has shape (F,).

    Stresses are kinematic and in units of u*_0^2, friction velocities in units of u*_0, the
    undisturbed friction velocity; both are positive where the flow at the bed goes downstream.

    Attributes
    ----------
    s_m : array
        Arc length along the bed from the windward toe to the middle of the face, m.
    x_m, z_m : array
        Middle of the face: downstream of the windward toe, above the flat bed, m.
    length_m : array
        Length of the face along the bed, m; the values hold over it.
    z_e_m : array
        Distance of the first cell's centre from the bed, along its normal, m.
    tau_wall : array
        Stress on the wall, from the flow solver.
    ustar_over_ustar0_eq10 : array
        Eq. 10 at the first cell's centre: 0.41 u_t / ln((z_e + z0)/z0).
    ustar_over_ustar0_eq10_printed : array
        Eq. 10 as the paper prints it: 0.41 u_t / ln(z_e/z0).
    """

    s_m: Array
    x_m: Array
    z_m: Array
    length_m: Array
    z_e_m: Array
    tau_wall: Array
    ustar_over_ustar0_eq10: Array
    ustar_over_ustar0_eq10_printed: Array

    @cached_property
    def ustar_over_ustar0_wall(self) -> Array:
        """Friction velocity of the stress on the wall: sign(tau) sqrt(|tau|)."""
        return np.sign(self.tau_wall) * np.sqrt(np.abs(self.tau_wall))

    @cached_property
    def tau_eq10(self) -> Array:
        """Stress of Eq. 10's friction velocity: sign(u*) u*^2."""
        ustar = self.ustar_over_ustar0_eq10
        return ustar * np.abs(ustar)

    @cached_property
    def edges_m(self) -> Array:
        """Ends of the faces along the bed, m; shape (F + 1,)."""
        first = self.s_m[0] - self.length_m[0] / 2.0
        return np.concatenate([[first], first + np.cumsum(self.length_m)])

    def mean_over(self, s_m: ArrayLike, length_m: ArrayLike, measure: Measure = "wall") -> Array:
        """Mean signed stress over a length of bed centred on each place.

        The integral is exact: over each face the stress is linear, with the face's value as its
        mean and the slope that its neighbours give.

        Parameters
        ----------
        s_m : array_like
            Arc lengths along the bed, m.
        length_m : array_like
            Lengths of bed to average over, m; broadcast against `s_m`.
        measure : {"wall", "eq10"}
            The stress on the wall, or that of Eq. 10.

        Returns
        -------
        array
            Mean of tau/u*_0^2, of the broadcast shape.

        Raises
        ------
        InputError
            If a length is not positive, or reaches beyond the bed.
        """
        centre, length = np.broadcast_arrays(np.asarray(s_m, float), np.asarray(length_m, float))
        low, high = centre - length / 2.0, centre + length / 2.0
        self._check_reach(low, high)
        tau = self.tau_wall if measure == "wall" else self.tau_eq10
        gained = self._integral(tau, high) - self._integral(tau, low)
        return np.asarray(gained / length)

    def _integral(self, tau: Array, s_m: Array) -> Array:
        """The integral of the stress from the start of the bed, kinematic and in u*_0^2 m."""
        edges, slope = self.edges_m, self._slopes(tau)
        face = np.clip(np.searchsorted(edges, s_m, side="right") - 1, 0, len(tau) - 1)
        before = np.concatenate([[0.0], np.cumsum(tau * self.length_m)])[face]
        into = s_m - edges[face]
        tilt = slope[face] * (into - self.length_m[face]) / 2.0
        return np.asarray(before + into * (tau[face] + tilt))

    def _slopes(self, tau: Array) -> Array:
        """Change of the stress along each face, 1/m: the mean of those to its two neighbours.

        It is limited so that no face reaches beyond its neighbours' values, none where the stress
        has an extreme; a bend of the bed parts neighbours.
        """
        apart = np.diff(self.s_m)
        steps = np.diff(tau) / apart
        chord = np.hypot(np.diff(self.x_m), np.diff(self.z_m))
        straight = np.abs(chord / apart - 1.0) < BEND
        steps = np.where(straight, steps, np.nan)
        behind, ahead = np.append(np.nan, steps), np.append(steps, np.nan)
        # at a bend, or an end of the bed, the one neighbour that is left counts alone
        behind, ahead = (
            np.where(np.isnan(behind), ahead, behind),
            np.where(np.isnan(ahead), behind, ahead),
        )
        slope = np.where(behind * ahead > 0.0, (behind + ahead) / 2.0, 0.0)
        most = 2.0 * np.minimum(np.abs(behind), np.abs(ahead))
        return np.asarray(np.nan_to_num(np.sign(slope) * np.minimum(np.abs(slope), most)))

    def _check_reach(self, low: Array, high: Array) -> None:
        start, end = self.edges_m[0], self.edges_m[-1]
        if not (np.all(low < high) and np.all(low >= start) and np.all(high <= end)):
            raise InputError(
                "a mean of the stress needs a positive length within the bed, "
                f"which spans s = {start:.4g} ... {end:.4g} m",
            )

    def to_csv(self, path: Path) -> None:
        """Write a table with all digits: `from_csv` gives the same numbers back."""
        names = [field.name for field in fields(self)]
        columns = [getattr(self, name).tolist() for name in names]
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([*names, _DERIVED])
        writer.writerows(zip(*columns, self.ustar_over_ustar0_wall.tolist(), strict=True))
        write_durably(path, text.getvalue())

    @classmethod
    def from_csv(cls, path: Path) -> "WallStress":
        """Read what `to_csv` wrote.

        Raises
        ------
        InputError
            If the file is not such a table.
        """
        names = [field.name for field in fields(cls)]
        lines = path.read_text(encoding="utf-8").splitlines()
        if len(lines) < 2 or lines[0].split(",") != [*names, _DERIVED]:
            raise InputError("not a table of the stress on a bed", where=str(path))
        table = np.loadtxt(lines[1:], delimiter=",", ndmin=2)
        return cls(**dict(zip(names, table.T[: len(names)].copy(), strict=True)))
