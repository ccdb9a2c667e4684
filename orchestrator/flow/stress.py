"""The stress that the flow puts on the whole bed, and whether it can be right."""

from collections.abc import Mapping
from dataclasses import Field, dataclass, fields
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from orchestrator.bed.deck import read_texts
from orchestrator.digits import FORMAT
from orchestrator.errors import InputError
from orchestrator.physics.constants import KARMAN
from orchestrator.types import FloatArray, IntArray

BEND = 1e-3
"""Largest part by which the bed between the middles of two faces of one plane is longer
than the straight line between them. Seven digits of the places make 1e-5, a bend of
10 degrees 4e-3."""
APPROACH_ERROR = 0.08
"""Largest relative difference of u* before the inlet from that of the log law.

k-epsilon is within 0.02; other models, whose log law is another, are within 0.07."""
MEAN_SPEED_ERROR = 0.1
"""Largest relative difference of a channel's mean speed from that of the log law."""
SEPARATES_FROM_DEG = 15.0
"""Slope, degrees, from which the flow always separates behind the crest.

It reattaches 5 to 9 h from the crest."""
SHORTEST_BUBBLE = 5.0
"""Least of these lengths, h. Upwind convection gives 3.6 to 4.6, and a part of a cell
of h/3."""
LEAST_Z_E_OVER_Z0 = 0.5
"""Least distance of the first cell's centre from the bed, z0."""
Measure = Literal["wall", "eq10"]
"""Stress on the wall, or that of Eq. 10 from the speed in the first cell."""


AXES = ("x", "y", "z")
APPROACH = "approach_ustar_over_log_law"


class Stress:
    """Stress on each face of a bed, over that of the approaching flow.

    A subclass is a dataclass. Each of its fields is an array with a number, or with the
    three components of a vector, for each face.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    shown: ClassVar[tuple[str, ...]]
    """Properties that `to_csv` writes beside the fields."""
    z_e_m: FloatArray

    @property
    def is_finite(self) -> bool:
        """Whether all of its numbers are."""
        return all(np.isfinite(values).all() for values in self._columns().values())

    def to_csv(self, path: Path) -> None:
        """Write a table of nine digits, which `from_csv` reads.

        Parameters
        ----------
        path
            The file.
        """
        columns = {}
        for name, values in self._columns().items():
            if values.ndim == 1:
                columns[name] = values
                continue
            for axis, component in zip(AXES, values.T, strict=True):
                columns[f"{name}_{axis}"] = component
        for name in self.shown:
            columns[name] = getattr(self, name)
        table = pd.DataFrame(columns)
        table.to_csv(path, index=False, lineterminator="\n", float_format=FORMAT)

    @classmethod
    def from_csv(cls, path: Path) -> Self:
        """Read a table of `to_csv`.

        Parameters
        ----------
        path
            The file.

        Returns
        -------
        Stress
            The stress, with the nine digits of the file.

        Raises
        ------
        SolverError
            If the file is not whole.
        """
        texts = read_texts(path)
        columns = {}
        for one in fields(cls):
            if one.name in texts:
                columns[one.name] = texts[one.name].astype(float)
                continue
            parts = [texts[f"{one.name}_{axis}"].astype(float) for axis in AXES]
            columns[one.name] = np.column_stack(parts)
        return cls(**columns)

    def _columns(self) -> dict[str, FloatArray]:
        """The fields by their names."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


@dataclass(frozen=True, eq=False)
class WallStress(Stress):
    """Stress on each face of the bed, in the order of the flow.

    Stresses are kinematic and in units of u*_0^2, friction velocities in units of u*_0,
    the undisturbed friction velocity. Both are positive where the flow at the bed goes
    downstream.

    Attributes
    ----------
    s_m
        Arc length along the bed from the windward toe to the middle of the face, m;
        shape (F,), as that of each array here.
    x_m, z_m
        Middle of the face, downstream of the windward toe and above the flat bed, m.
    length_m
        Length of the face, m.
    z_e_m
        Distance of the first cell's centre from the bed, along its normal, m.
    tau_wall
        Stress on the wall, u*_0^2.
    ustar_over_ustar0_eq10
        Eq. 10 at the first cell's centre, 0.41 u_t / ln((z_e + z0)/z0), in units of
        u*_0.
    """

    shown: ClassVar[tuple[str, ...]] = ("ustar_over_ustar0_wall",)
    s_m: FloatArray
    x_m: FloatArray
    z_m: FloatArray
    length_m: FloatArray
    z_e_m: FloatArray
    tau_wall: FloatArray
    ustar_over_ustar0_eq10: FloatArray

    @cached_property
    def ustar_over_ustar0_wall(self) -> FloatArray:
        """Friction velocity of the stress on the wall, sign(tau) sqrt(abs(tau))."""
        return np.sign(self.tau_wall) * np.sqrt(np.abs(self.tau_wall))

    @cached_property
    def edges_m(self) -> FloatArray:
        """Ends of the faces along the bed, m; shape (F + 1,)."""
        first = self.s_m[0] - self.length_m[0] / 2.0
        return np.concatenate([[first], first + np.cumsum(self.length_m)])

    def tau(self, measure: Measure) -> FloatArray:
        """Stress by a measure.

        Parameters
        ----------
        measure
            ``"wall"`` or ``"eq10"``.

        Returns
        -------
        FloatArray
            Signed stress on each face, u*_0^2; shape (F,).
        """
        if measure == "wall":
            return self.tau_wall
        ustar = self.ustar_over_ustar0_eq10
        return ustar * np.abs(ustar)

    def mean_over(
        self, s_m: ArrayLike, length_m: ArrayLike, measure: Measure = "wall"
    ) -> FloatArray:
        """Mean signed stress over lengths of bed.

        The integral is exact for a stress that is linear on each face, with the value
        of the face as its mean and the slope that the two neighbours give.

        Parameters
        ----------
        s_m
            Arc lengths in the middle of the lengths of bed, m.
        length_m
            The lengths, m. The two broadcast.
        measure
            ``"wall"`` or ``"eq10"``.

        Returns
        -------
        FloatArray
            Mean of tau, u*_0^2, in the shape that both have together.

        Raises
        ------
        InputError
            If a length is not positive, or reaches beyond the bed.
        """
        centre, length = np.broadcast_arrays(
            np.asarray(s_m, float), np.asarray(length_m, float)
        )
        start = centre - length / 2.0
        end = centre + length / 2.0
        edges = self.edges_m
        inside = (start < end) & (start >= edges[0]) & (end <= edges[-1])
        if not np.all(inside):
            span = f"s = {edges[0]:.4g} ... {edges[-1]:.4g} m"
            what = f"a mean of the stress needs a length within the bed, {span}"
            raise InputError(what)
        tau = self.tau(measure)
        integral = self._integral(tau, end) - self._integral(tau, start)
        return np.asarray(integral / length)

    def _integral(self, tau: FloatArray, s_m: FloatArray) -> FloatArray:
        """Integral of the stress from the start of the bed to arc lengths, m u*_0^2."""
        edges = self.edges_m
        before_face = np.concatenate([[0.0], np.cumsum(tau * self.length_m)])
        face = np.searchsorted(edges, s_m, side="right") - 1
        face = np.clip(face, 0, len(tau) - 1)
        into = s_m - edges[face]
        tilt = self._slopes(tau)[face] * (into - self.length_m[face]) / 2.0
        return np.asarray(before_face[face] + into * (tau[face] + tilt))

    def _slopes(self, tau: FloatArray) -> FloatArray:
        """Change of the stress along each face, 1/m: the mean of those on its sides."""
        apart = np.diff(self.s_m)
        chord = np.hypot(np.diff(self.x_m), np.diff(self.z_m))
        is_straight = np.abs(chord / apart - 1.0) < BEND
        steps = np.where(is_straight, np.diff(tau) / apart, np.nan)
        sides = np.array([np.append(np.nan, steps), np.append(steps, np.nan)])
        # At a bend, or an end of the bed, the one neighbour that is left counts alone.
        behind, ahead = np.where(np.isnan(sides), sides[::-1], sides)
        # Limited so that no face reaches beyond the values of its neighbours.
        slope = np.where(behind * ahead > 0.0, (behind + ahead) / 2.0, 0.0)
        most = 2.0 * np.minimum(np.abs(behind), np.abs(ahead))
        limited = np.sign(slope) * np.minimum(np.abs(slope), most)
        return np.asarray(np.nan_to_num(limited))


class Diagnostic(NamedTuple):
    """A number of a solved flow beside the range in which sound flows have it.

    Attributes
    ----------
    value
        The number.
    sound_from, sound_to
        The ends of the range.
    """

    value: float
    sound_from: float = 0.0
    sound_to: float = inf


def diagnostics(
    stress: Stress,
    approach: float,
    reynolds: float,
    roughness: float,
    iterations: int,
    more: Mapping[str, Diagnostic],
) -> pd.DataFrame:
    """A few numbers of a solved flow beside the ranges in which sound flows have them.

    Parameters
    ----------
    stress
        The stress on the bed.
    approach
        Friction velocity before the inlet over that of the log law.
    reynolds
        u*_0 over the viscosity of the solve, 1/m.
    roughness
        Roughness length z0, m.
    iterations
        Iterations until the flow had converged.
    more
        Those of this kind of bed.

    Returns
    -------
    DataFrame
        A row for each quantity, with the columns value, sound_from, sound_to and sound,
        which is "yes" or "no".
    """
    centre = float(np.median(stress.z_e_m))
    rows = {
        # y+: the eddy viscosity is kappa y+ times the molecular one.
        "y_plus": Diagnostic(reynolds * centre, 1 / KARMAN),
        "z_e_over_z0": Diagnostic(centre / roughness, LEAST_Z_E_OVER_Z0),
        APPROACH: near_one(approach, APPROACH_ERROR),
        **more,
        "iterations": Diagnostic(iterations),
    }
    columns = list(Diagnostic._fields)
    table = pd.DataFrame.from_dict(rows, orient="index", columns=columns)
    is_sound = table["value"].between(table["sound_from"], table["sound_to"])
    table["sound"] = np.where(is_sound, "yes", "no")
    return table.rename_axis("quantity")


def near_one(ratio: float, error: float) -> Diagnostic:
    """Put a ratio beside the range in which a sound flow has it.

    Parameters
    ----------
    ratio
        The ratio.
    error
        Its largest difference from 1.

    Returns
    -------
    Diagnostic
        Both.
    """
    return Diagnostic(ratio, 1 - error, 1 + error)


def reattachment(stress: WallStress, slope_deg: float, height: float) -> Diagnostic:
    """Find where the flow reattaches behind the crest, and how soon it may.

    Parameters
    ----------
    stress
        The stress on the bed.
    slope_deg
        Steepest slope of the windward faces, degrees.
    height
        Height h of the forms, m.

    Returns
    -------
    Diagnostic
        The place, h downstream of the crest; 0 where no flow is reversed.
    """
    reversed_flow = bubble(stress, height)
    reattaches = 0.0 if reversed_flow is None else reversed_flow[1]
    shortest = SHORTEST_BUBBLE if slope_deg >= SEPARATES_FROM_DEG else 0.0
    return Diagnostic(reattaches, shortest)


def bubble(stress: WallStress, height: float) -> tuple[float, float] | None:
    """Where the reversed flow behind the crest begins and ends.

    A stretch of less than h that runs forward within it is the eddy of a corner.

    Parameters
    ----------
    stress
        The stress on the bed.
    height
        Height h of the forms, m.

    Returns
    -------
    tuple of float, or None
        Start and end, h downstream of the crest; None where no flow is reversed.
    """
    top = stress.x_m[int(np.argmax(stress.z_m))]
    is_reversed = (stress.x_m > top) & (stress.tau_wall < 0)
    faces = np.flatnonzero(is_reversed)
    if not faces.size:
        return None
    gaps = np.flatnonzero(np.diff(stress.x_m[faces]) > height)
    first = faces[0]
    last = faces[gaps[0]] if gaps.size else faces[-1]
    after = min(last + 1, len(stress.x_m) - 1)
    begins = _sign_changes_at(stress, np.array([first, first - 1]))
    ends = _sign_changes_at(stress, np.array([last, after]))
    return (begins - top) / height, (ends - top) / height


def _sign_changes_at(stress: WallStress, pair: IntArray) -> float:
    """Place at which the stress is 0 between two faces, m: cells of h/3 lie there."""
    return float(np.interp(0.0, stress.tau_wall[pair], stress.x_m[pair]))
