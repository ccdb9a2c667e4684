"""Where a bed in three dimensions begins to move: the closed form on each of its faces.

No grain is packed. Each face has an exposed grain in its pocket, under the stress of
the flow in its own direction on the slope of the face.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from orchestrator.physics.constants import SAND_GRAIN
from orchestrator.physics.grain import Grain
from orchestrator.physics.laws import LAWS
from orchestrator.physics.onset import Criteria
from orchestrator.physics.velocity import log_law_speed
from orchestrator.surface.across import slope_along_deg, threshold_across
from orchestrator.types import FloatArray

WIND_HEIGHT = 10.0
"""Height of the wind, m."""
HOURS = 8760.0
"""Hours of a year."""
STARTS = 0.01
"""Share of the surface above threshold from which motion has started: single faces at
an edge follow the mesh."""


def slopes_deg(normal: FloatArray) -> FloatArray:
    """Find the steepest slope of each face.

    Parameters
    ----------
    normal
        Unit vectors upwards, shape (F, 3).

    Returns
    -------
    FloatArray
        Slopes, degrees, shape (F,).

    Examples
    --------
    >>> print(slopes_deg(np.array([[0.0, 0.0, 1.0], [-0.6, 0.0, 0.8]])).round(2))
    [ 0.   36.87]
    """
    across = np.hypot(normal[:, 0], normal[:, 1])
    return np.asarray(np.degrees(np.arctan2(across, normal[:, 2])))


def headings_deg(normal: FloatArray, tau: FloatArray) -> FloatArray:
    """Find the angle between the stress on each face and the way straight up its slope.

    Parameters
    ----------
    normal
        Unit vectors upwards, shape (F, 3).
    tau
        Stress, which lies in the face, of any unit, shape (F, 3).

    Returns
    -------
    FloatArray
        Angles, degrees from 0 to 180, shape (F,): 0 straight up, 180 straight down, and
        90 on level faces.

    Examples
    --------
    >>> up = np.array([[-0.6, 0.0, 0.8]])
    >>> print(headings_deg(up, np.array([[0.8, 0.0, 0.6]])).round(6))
    [0.]
    """
    rise = np.sin(np.radians(slopes_deg(normal))) * np.linalg.norm(tau, axis=1)
    cosine = np.divide(tau[:, 2], rise, out=np.zeros_like(rise), where=rise > 0)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def with_fall(
    normal: FloatArray, tau: FloatArray, east: float, north: float
) -> tuple[FloatArray, FloatArray]:
    """Put faces over level ground on ground that rises, each upright as it is.

    Parameters
    ----------
    normal
        Unit vectors upwards, shape (F, 3).
    tau
        Stress, which lies in the face, of any unit, shape (F, 3).
    east, north
        Rise of the ground to the east and to the north, m/m.

    Returns
    -------
    normal, tau
        Unit vectors of the faces on this ground, and stresses that lie in them with the
        same horizontal parts, shape (F, 3).

    Examples
    --------
    >>> normal, tau = np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]])
    >>> turned, lifted = with_fall(normal, tau, 0.75, 0.0)
    >>> turned.tolist(), lifted.tolist()
    ([[-0.6, 0.0, 0.8]], [[1.0, 0.0, 0.75]])
    """
    rise = np.array([east, north])
    turned = normal.copy()
    turned[:, :2] -= rise * normal[:, 2:]
    lifted = tau.copy()
    lifted[:, 2] += tau[:, :2] @ rise
    return turned / np.linalg.norm(turned, axis=1)[:, None], lifted


def entrained(
    grain: Grain, law: str, slope_deg: FloatArray, heading_deg: FloatArray
) -> FloatArray:
    """Find the local friction velocity at which a grain leaves its pocket on each face.

    Parameters
    ----------
    grain
        The grain; its own slope does not count.
    law
        Name of the force law.
    slope_deg, heading_deg
        Slope of each face, and angle of the stress to the way up it, shape (F,).

    Returns
    -------
    FloatArray
        Friction velocities, m/s, shape (F,); 0 where the grain rolls by itself.
    """
    on_face = grain.changed(slope_deg=slope_deg)
    return threshold_across(LAWS[law], on_face, heading_deg)


def sustained(
    grain: Grain,
    leaving: FloatArray,
    slope_deg: FloatArray,
    heading_deg: FloatArray,
) -> FloatArray:
    """Find the local friction velocity at which a grain leaves in a gust and goes on.

    It is that of the mean flow, whose gusts have `gusts.PEAK` times its stress, on the
    slope along the stress.

    Parameters
    ----------
    grain
        The grain; its own slope does not count.
    leaving
        Friction velocity at which it leaves its pocket on each face, m/s, shape (F,).
    slope_deg, heading_deg
        Slope of each face, and angle of the stress to the way up it, shape (F,).

    Returns
    -------
    FloatArray
        Friction velocities, m/s, shape (F,): NaN where that is not known.
    """
    along = slope_along_deg(slope_deg, heading_deg)
    # it goes over a bed of identical grains
    going = grain.changed(slope_deg=along, roughness=grain.diameter / SAND_GRAIN)
    both = Criteria(going.shields(leaving), going)
    return going.ustar_at(both.shields)


def wind_of(
    ustar0: ArrayLike, roughness: float, height: float = WIND_HEIGHT
) -> FloatArray:
    """Compute the wind, or the current, at a height over flat ground.

    Parameters
    ----------
    ustar0
        Undisturbed friction velocity, m/s.
    roughness
        Roughness length z0 of the ground, m.
    height
        The height, m; by default that of winds.

    Returns
    -------
    FloatArray
        Wind, m/s, of the same shape.
    """
    return log_law_speed(ustar0, height, roughness)


def undisturbed(local: FloatArray, ratio: FloatArray) -> FloatArray:
    """Find the undisturbed friction velocities that make local ones.

    Parameters
    ----------
    local
        Local friction velocity of each face, m/s, shape (F,).
    ratio
        Local over undisturbed friction velocity, shape (F,).

    Returns
    -------
    FloatArray
        Undisturbed friction velocities, m/s, shape (F,); infinite where there is no
        stress.
    """
    found = np.full_like(local, np.inf)
    return np.divide(local, ratio, out=found, where=ratio > 0)


@dataclass(frozen=True)
class Shares:
    """The share of a surface that is above threshold, against the wind.

    Attributes
    ----------
    wind
        Winds at which parts of the surface begin to move, m/s, rising.
    share
        Share of the surface that moves at each, rising to 1 at most.
    """

    wind: FloatArray
    share: FloatArray

    @classmethod
    def of(cls, wind: FloatArray, area: FloatArray) -> "Shares":
        """Sum up the areas of faces by the wind at which they move.

        Parameters
        ----------
        wind
            Wind at which each face moves, m/s, shape (F,).
        area
            Its area, of any unit, shape (F,).

        Returns
        -------
        Shares
            The shares.
        """
        order = np.argsort(wind, kind="stable")
        return cls(wind[order], np.cumsum(area[order]) / area.sum())

    def at(self, wind: ArrayLike) -> FloatArray:
        """Read the share that moves in winds.

        Parameters
        ----------
        wind
            Winds, m/s.

        Returns
        -------
        FloatArray
            Shares, of the same shape.
        """
        place = np.searchsorted(self.wind, np.asarray(wind, float), side="right")
        return np.concatenate([[0.0], self.share])[place]

    def wind_for(self, share: float) -> float:
        """Find the least wind in which a share of the surface moves.

        Parameters
        ----------
        share
            The share, of 1.

        Returns
        -------
        float
            The wind, m/s.
        """
        place = int(np.searchsorted(self.share, share * (1 - 1e-12)))
        if place == len(self.wind):
            return float("inf")
        return float(self.wind[place])


def interpolated(first: ArrayLike, second: ArrayLike, part: float) -> FloatArray:
    """Interpolate winds at which parts of a bed move, between those of two directions.

    Linear is the inverse of the wind, which is as the friction velocity on the bed.

    Parameters
    ----------
    first, second
        The winds of both, m/s, of one shape; NaN where there is none.
    part
        The part of the second, 0 to 1.

    Returns
    -------
    FloatArray
        The winds, of the same shape; NaN where one of them is.

    Examples
    --------
    >>> print(interpolated([4.0, np.inf], [12.0, 10.0], 0.5))
    [ 6. 20.]
    """
    one, other = np.asarray(first, float), np.asarray(second, float)
    if part in (0, 1):
        return one if part == 0 else other
    with np.errstate(divide="ignore"):
        return np.asarray(1 / ((1 - part) / one + part / other))


def hours(
    winds: Mapping[float, FloatArray], rose: pd.DataFrame, factor: float = 1.0
) -> FloatArray:
    """Count the hours a year in which winds move parts of a bed.

    Parameters
    ----------
    winds
        Wind from each direction of a flow, degrees, at which each part moves, m/s, of
        one shape; NaN where there is none.
    rose
        A wind rose with the columns ``speed_m_s`` and ``share``, and the flows beside
        each row: ``first_deg``, ``second_deg`` and ``second_part``.
    factor
        What the winds at which parts move are multiplied by.

    Returns
    -------
    FloatArray
        Hours a year, of the shape of the winds; NaN where these are.
    """
    total: FloatArray = np.zeros(np.shape(next(iter(winds.values()))))
    flows = ["first_deg", "second_deg", "second_part"]
    for _, rows in rose.groupby(flows):
        first, second, part = rows[flows].to_numpy(float)[0].tolist()
        wind = factor * interpolated(winds[first], winds[second], part)
        ordered = rows.sort_values("speed_m_s")
        above = np.cumsum(ordered["share"].to_numpy(float)[::-1])[::-1]
        place = np.searchsorted(ordered["speed_m_s"].to_numpy(float), wind)
        found = HOURS * np.concatenate([above, [0.0]])[place]
        total = total + np.where(np.isnan(wind), np.nan, found)
    return total
