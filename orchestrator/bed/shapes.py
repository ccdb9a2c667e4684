"""Makers of bed lines: forms, trains of them, obstacles on them, flat bed before and behind.

A form is an array of corners, shape (n, 2), from its foot at the origin to its toe.
"""

from collections.abc import Callable
from functools import cache
from math import cos, exp, log, pi, radians, sin, sqrt, tan

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from orchestrator.bed.line import BedLine
from orchestrator.bed.obstacles import with_obstacles
from orchestrator.study.parts import PileBed, UnfitError

FloatArray = NDArray[np.float64]

UPSTREAM, DOWNSTREAM = 10.0, 20.0
"""Flat bed before and behind the forms, in heights of them."""
CHORDS = 40
"""Chords of the windward side of a form that is a curve."""
GAUSSIAN_END = 3.5
"""Where a Gaussian hill is cut, standard deviations: it is let down by 0.2 % of its height."""
ARC_DEG = 2.0
"""Bend of the bed between two chords of a rounded brink."""


@cache
def of_bed(bed: PileBed) -> BedLine:
    """The bed line that a pile's bed asks for, m."""
    if bed.profile:
        corners = np.column_stack([bed.profile.x, bed.profile.z])
    else:
        form = FORMS[bed.shape](bed)
        corners = train(form, bed.forms, bed.spacing or float(form[-1, 0]))
    for one in bed.obstacles:
        corners = _reaching(corners, one.x - one.reach, one.x + one.reach)
    return with_obstacles(between_flats(corners, bed.relief), bed.obstacles)


@cache
def triangle(slope_deg: float, height: float) -> BedLine:
    """A pile with two faces of one slope (degrees), the paper's bed; of slope 0 the flat bed."""
    face = height / tan(radians(slope_deg)) if slope_deg else 4 * height
    top = height if slope_deg else 0.0
    return between_flats(np.array([[0, 0], [face, top], [2 * face, 0]]), height)


def between_flats(corners: FloatArray, height: float) -> BedLine:
    """A line with flat bed before and behind some corners."""
    (x_first, z_first), (x_last, z_last) = corners[[0, -1]]
    before, behind = (x_first - UPSTREAM * height, z_first), (x_last + DOWNSTREAM * height, z_last)
    x, z = np.vstack([before, corners, behind]).T
    return BedLine(tuple(x.tolist()), tuple(z.tolist()), height)


def _reaching(corners: FloatArray, start: float, end: float) -> FloatArray:
    """Corners with level bed before and behind them as far as some places."""
    if start < corners[0, 0]:
        corners = np.vstack([[start, corners[0, 1]], corners])
    return np.vstack([corners, [end, corners[-1, 1]]]) if end > corners[-1, 0] else corners


def train(form: FloatArray, count: int, spacing: float) -> FloatArray:
    """Several forms in a row, the foot of each a spacing behind that of the one before.

    Raises
    ------
    UnfitError
        If they overlap.
    """
    length = float(form[-1, 0])
    if count > 1 and spacing < length * (1 - 1e-9):
        what = f"forms {length:g} m long overlap at {spacing:g} m"
        raise UnfitError("bed.spacing", what, "raise it, or leave it out: they touch then")
    corners = np.vstack([form + np.array([place * spacing, 0]) for place in range(count)])
    # forms that touch share a corner
    new = np.append(True, np.diff(corners[:, 0]) > 1e-9 * spacing)
    return np.asarray(corners[new])


def _trapezoid(bed: PileBed, top: float = 0.0) -> FloatArray:
    up = bed.height / tan(radians(bed.slope_deg))
    down = bed.height / tan(radians(bed.lee_slope))
    ends = [[up, bed.height], [up + top, bed.height]] if top else [[up, bed.height]]
    return np.array([[0, 0], *ends, [up + top + down, 0]])


def _dune(bed: PileBed) -> FloatArray:
    """A windward side, straight or curved, and a slip face; its brink sharp or rounded."""
    face = bed.height / tan(radians(bed.slope_deg))
    windward = np.array([[0, 0], [face, bed.height]])
    if bed.windward == "curved":
        t = np.linspace(0, 1, CHORDS + 1)
        windward = np.column_stack([pi / 2 * face * t, bed.height / 2 * (1 - np.cos(pi * t))])
    slip = windward[-1] + [bed.height / tan(radians(bed.lee_slope)), -bed.height]
    corners = np.vstack([windward, slip])
    return _rounded(corners, len(windward) - 1, bed.brink_radius) if bed.brink_radius else corners


def _rounded(corners: FloatArray, brink: int, radius: float) -> FloatArray:
    """A form with an arc in place of its brink, which touches the line before and behind it."""
    steps = np.diff(corners, axis=0)
    rise = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    behind = rise[brink]
    # the arc begins on the chord from which it can reach the slip face
    for first in range(brink - 1, -1, -1):
        start, direction = corners[first], rise[first]
        meet = _crossing(start, direction, corners[brink], behind)
        cut = radius * tan((direction - behind) / 2)
        if cut <= np.hypot(*(meet - start)) or first == 0:
            break
    count = int(np.ceil(np.degrees(direction - behind) / ARC_DEG)) + 1
    angles = np.linspace(direction, behind, count)
    begin = meet - cut * np.array([cos(direction), sin(direction)])
    centre = begin + radius * np.array([sin(direction), -cos(direction)])
    arc = centre + radius * np.column_stack([-np.sin(angles), np.cos(angles)])
    # no sliver between a corner and the arc
    near = np.hypot(*(arc[0] - corners[first])) < np.hypot(*(arc[1] - arc[0])) / 2
    return np.vstack([corners[: first + (not near or not first)], arc, corners[brink + 1 :]])


def _crossing(one: FloatArray, way: float, other: FloatArray, along: float) -> FloatArray:
    """Where a line through one point crosses a line through another; directions in rad."""
    ways = np.array([[cos(way), -cos(along)], [sin(way), -sin(along)]])
    return np.asarray(one + np.linalg.solve(ways, other - one)[0] * ways[:, 0])


def _cosine(bed: PileBed) -> FloatArray:
    """One wave of a cosine, from trough to trough; its steepest slope is the bed's."""
    t = np.linspace(0, 1, 2 * CHORDS + 1)
    length = pi * bed.height / tan(radians(bed.slope_deg))
    return np.column_stack([length * t, bed.height / 2 * (1 - np.cos(2 * pi * t))])


def _gaussian(bed: PileBed) -> FloatArray:
    """A Gaussian hill; its steepest slope is the bed's."""
    t = np.linspace(-GAUSSIAN_END, GAUSSIAN_END, 3 * CHORDS + 1)
    deviation = bed.height / tan(radians(bed.slope_deg)) / sqrt(exp(1))
    end = exp(-(GAUSSIAN_END**2) / 2)
    z = bed.height * (np.exp(-(t**2) / 2) - end) / (1 - end)
    return np.column_stack([deviation * (t + GAUSSIAN_END), z])


def _rushil(bed: PileBed) -> FloatArray:
    """A hill of the experiment RUSHIL; its steepest slope is the bed's."""
    x, z = rushil_hill(rushil_aspect(bed.slope_deg))
    return bed.height * np.column_stack([x - x[0], z])


def rushil_hill(aspect: float) -> tuple[FloatArray, FloatArray]:
    """X from the top and z of a hill of RUSHIL over its height, by its half length over that.

    L. H. Khurshudyan, W. H. Snyder and I. V. Nekrasov, EPA-600/4-81-067, 1981, as in ERCOFTAC's
    case 69: xi = a sin(t) runs from one foot to the other.
    """
    t = np.linspace(-pi / 2, pi / 2, 100 * CHORDS + 1)
    m = 1 / aspect + sqrt(1 / aspect**2 + 1)
    q = np.sin(t) ** 2 + m**2 * np.cos(t) ** 2
    xs, zs = aspect / 2 * np.sin(t) * (1 + 1 / q), m * aspect / 2 * np.cos(t) * (1 - 1 / q)
    # equal steps of t would crowd at the feet, where x is level in it
    x = np.linspace(-aspect, aspect, 2 * CHORDS + 1)
    return x, np.interp(x, xs, zs)


@cache
def rushil_aspect(slope_deg: float) -> float:
    """Half length over height of the hill of RUSHIL that is so steep, degrees."""

    def steeper(logarithm: float) -> float:
        x, z = rushil_hill(exp(logarithm))
        return float(np.max(np.diff(z) / np.diff(x))) - tan(radians(slope_deg))

    return exp(brentq(steeper, log(0.1), log(1e3)))


def _step_up(bed: PileBed) -> FloatArray:
    face = bed.height / tan(radians(bed.slope_deg))
    return np.array([[0, 0], [face, bed.height], [face + bed.level_length, bed.height]])


def _step_down(bed: PileBed) -> FloatArray:
    face = bed.height / tan(radians(bed.lee_slope))
    brink = bed.level_length
    return np.array([[0, 0], [brink, 0], [brink + face, -bed.height]])


FORMS: dict[str, Callable[[PileBed], FloatArray]] = {
    "triangle": _trapezoid,
    "dune": _dune,
    "cosine": _cosine,
    "gaussian": _gaussian,
    "rushil": _rushil,
    "trapezoid": lambda bed: _trapezoid(bed, bed.level_length),
    "step up": _step_up,
    "step down": _step_down,
    "flat": lambda bed: np.array([[0, 0], [bed.level_length, 0]]),
}
"""Makers of one form, by what a study file calls its shape."""
