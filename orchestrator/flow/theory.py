"""The stress on the bed without a solver: linear theory of a low hill, or a flat bed's log law.

The theory is that of Jackson and Hunt (1975) as Hunt, Leibovich and Richards (1988) completed it
and Kroy, Sauermann and Herrmann (2002) reduced it for dunes: the stress on a hill z = f(x) is ::

    tau/tau_0 = 1 + A (H(x) + B f'(x)),    H(x) = 1/pi p.v. int f'(x')/(x - x') dx'

with A and B of the half length L at half height over z0. With Lambda = ln(l/z0) of the inner layer,
l ln(l/z0) = 2 kappa^2 L, the middle layer h_m = L/sqrt(ln(L/z0)), and Euler's gamma ::

    b = 1 + Lambda + 2 ln(pi/2) + 4 gamma
    A = 2 b ln(h_m/z0)^2/Lambda^3,    B = pi/b

The hill that the flow sees is the windward face and the separation streamline behind it: a cubic
that leaves the crest smoothly, meets the bed smoothly and falls by 14 degrees at most. Under it the
stress is zero (`LASTS` says from where). So is it where the theory gives less than nothing, at the
toe of steep faces.

Against the solved flow (h = 0.02 m, z0 = 3.3e-6 ... 1e-4 m) u* has an error of at most 8 % in the
mean over the windward face for 10 to 25 degrees, of 11 % at 30; from 0.3 to 0.98 of the face of
12 % at z0/h up to 1/600 and of 20 % at 1/200. On the lowest tenth it is 7 to 60 % too low at 15
degrees and zero from 25 on. The bare triangle without the streamline is 17 to 31 % too high in the
mean at 15 degrees already, 64 to 103 % at 30. docs/flow.md has the numbers.
"""

from functools import cache
from itertools import pairwise
from math import ceil, log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from orchestrator.bed.line import BedLine
from orchestrator.flow.stress import WallStress
from orchestrator.physics.constants import KARMAN

Array = NDArray[np.float64]

FACES = 100
"""Faces of the bed, per h."""
CHORDS = 100
"""Of the separation streamline."""
LASTS = 0.05
"""The stress of the crest lasts for this far behind it, h: in the solved flow it falls to half
within 0.01 to 0.12, and a grain on the crest is not half in the lee."""
STEEPEST = 0.25
"""Slope of the separation streamline."""


@cache
def flat(line: BedLine) -> WallStress:
    """The undisturbed stress, tau = tau_0, on a bed line (m)."""
    edges = _edges(line)
    return _wall_stress(line, edges, np.ones(len(edges) - 1))


@cache
def hill(line: BedLine, roughness_m: float) -> WallStress:
    """The stress on the bed of a pile by the linear theory, averaged over each face exactly.

    Parameters
    ----------
    line : BedLine
        Of the pile, m.
    roughness_m : float
        z0, m.
    """
    edges, height = _edges(line), float(line.crest[1])
    x, z = seen_by_the_flow(line)
    strength, asymmetry = coefficients(_half_length(x, z, height) / roughness_m)
    rise = np.diff(np.interp(edges, x, z)) / np.diff(edges)
    tau = 1 + strength * (hilbert(edges, x, z) + asymmetry * rise)
    middle = (edges[1:] + edges[:-1]) / 2
    under = (middle > x[1] + LASTS * height) & (middle < x[-1])
    return _wall_stress(line, edges, np.where(under, 0, np.maximum(tau, 0)))


def coefficients(length_over_roughness: float) -> tuple[float, float]:
    """A and B for a hill's half length L over z0."""
    inner = asked = 2 * KARMAN**2 * length_over_roughness
    for _ in range(40):  # Newton's iteration for l ln(l/z0) = 2 kappa^2 L
        inner = (inner + asked) / (1 + log(inner))
    depth = log(inner)
    middle = log(length_over_roughness / sqrt(log(length_over_roughness)))
    b = 1 + depth + 2 * log(pi / 2) + 4 * np.euler_gamma
    return 2 * b * middle**2 / depth**3, pi / b


def hilbert(edges: Array, x: Array, z: Array) -> Array:
    """Mean of H over each interval between edges, for a polyline that ends on the flat bed.

    Each corner, where the slope jumps by c, gives c/pi times the mean of ln|x - corner|.
    """
    jumps = np.diff(np.diff(z) / np.diff(x), prepend=0, append=0)
    from_corner = edges[:, None] - x
    distance = np.where(from_corner == 0, 1, np.abs(from_corner))
    integral = from_corner * (np.log(distance) - 1)
    return np.asarray(np.diff(integral @ jumps) / np.diff(edges) / pi)


def seen_by_the_flow(line: BedLine) -> tuple[Array, Array]:
    """Corners x, z (m) of the windward face and of the separation streamline behind it."""
    crest, height_m = line.crest
    slope = height_m / crest
    ratio = slope / STEEPEST / 4
    # to second order in the ratio; the exact length grows without bounds towards 37 degrees
    length = 1.5 * height_m / STEEPEST * (1 + ratio + 2 * ratio**2)
    t = np.linspace(0, 1, CHORDS + 1)
    rise = slope * length
    z = (1 - t) ** 2 * (height_m * (1 + 2 * t) + rise * t)
    return np.append(0, crest + length * t), np.append(0, z)


def _half_length(x: Array, z: Array, height_m: float) -> float:
    """Half of the hill's length at half of the pile's height, m."""
    top = int(np.argmax(z))
    down = float(np.interp(-height_m / 2, -z[top:], x[top:]))
    return float(down - x[1] / 2) / 2


def _edges(line: BedLine) -> Array:
    height = line.h
    parts = [
        np.linspace(start, end, ceil((end - start) / height * FACES) + 1)[:-1]
        for start, end in pairwise(line.x)
    ]
    return np.append(np.concatenate(parts), line.x[-1])


def _wall_stress(line: BedLine, edges: Array, tau: Array) -> WallStress:
    z = line.height(edges)
    length = np.hypot(np.diff(edges), np.diff(z))
    ends = np.cumsum(length)
    s = ends - length / 2 - ends[np.searchsorted(edges[1:], 0)]
    ustar = np.sqrt(tau)
    return WallStress(
        s_m=s,
        x_m=(edges[1:] + edges[:-1]) / 2,
        z_m=(z[1:] + z[:-1]) / 2,
        length_m=length,
        z_e_m=np.full(len(tau), np.nan),
        tau_wall=tau,
        ustar_over_ustar0_eq10=ustar,
        ustar_over_ustar0_eq10_printed=ustar,
    )
