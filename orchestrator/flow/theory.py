"""The stress on the bed without a solver: linear theory of a low bed, or a flat bed's log law.

The stress on a bed z = f(x) is, mode by mode of its Fourier transform, ::

    tau/tau_0 = 1 + A H(x) + B f'(x),    H(x) = 1/pi p.v. int f'(x')/(x - x') dx'

The flow model `waves` takes the A0 and B0 of Fourriere, Claudin and Andreotti (J. Fluid Mech. 649,
2010) for the wavelength lambda of each mode, by the rational fit of a public dune code in
ln(lambda/z0).

The bed that the flow sees has separation streamlines where it falls too steeply or bends too
sharply: cubics that leave it smoothly, land on it level and fall by 14 degrees at most. Under them
the stress is zero (`LASTS` says from where). So is it where the theory gives a negative stress, at
the toe of steep faces. docs/flow.md compares the theory with the solved flow.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import pi

import numpy as np

from orchestrator.bed.line import BedLine
from orchestrator.digits import whole_up
from orchestrator.flow.stress import WallStress
from orchestrator.types import FloatArray

FACES = 100  # faces of the bed, per h
CELLS = 2 * FACES  # cells of the transform, per h
LASTS = 0.05
"""The stress of a brink lasts for this far behind it, h: in the solved flow it falls to half
within 0.01 to 0.12, and a grain on the brink is not half in the lee."""
STEEPEST = 0.25  # slope of a separation streamline, and of a bed that the flow still follows down
SHARP_DEG = 15.0  # bend of a brink that the flow does not follow


@cache
def flat(line: BedLine) -> WallStress:
    """The undisturbed stress, tau = tau_0, on a bed line (m)."""
    return _wall_stress(line, lambda edges: edges)


@cache
def waves(line: BedLine, roughness_m: float) -> WallStress:
    """The stress on a bed by the theory of each wavelength, averaged over each face.

    Parameters
    ----------
    line
        The bed line, m.
    roughness_m
        The roughness length z0, m.

    Returns
    -------
    WallStress
        The stress over the undisturbed one, on faces of h/100.
    """
    return _stress(line, lambda wavelength: of_wavelength(wavelength / roughness_m))


def of_wavelength(
    wavelength_over_roughness: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """A0 and B0 for wavelengths over z0; waves shorter than z0 have those of z0."""
    r = np.log(np.maximum(wavelength_over_roughness, 1))
    a = 1.0702 + 0.093069 * r + 0.10838 * r**2 + 0.024835 * r**3
    b = 0.036989 + 0.15765 * r + 0.11518 * r**2 + 0.0020249 * r**3
    a /= 1 + 0.041603 * r**2 + 0.0010625 * r**4
    b /= 1 + 0.0028725 * r**2 + 0.00053483 * r**4
    return 2 + a, b


@dataclass(frozen=True, eq=False)
class Seen:
    """The bed that the flow sees, by its height (m) at equally distant places; a crest is one.

    `bubbles` are the places where the flow leaves the bed and where it meets it again, m.
    """

    x: FloatArray
    z: FloatArray
    bubbles: tuple[tuple[float, float], ...]

    @property
    def slopes(self) -> FloatArray:
        """Slopes of the cells between the places."""
        return np.diff(self.z) / np.diff(self.x)


@cache
def seen_by_the_flow(line: BedLine) -> Seen:
    """A bed line with separation streamlines where the flow does not follow it."""
    cell, crest = line.h / CELLS, float(line.crest[0])
    first, last = (whole_up(abs(end - crest) / cell) for end in (line.x[0], line.x[-1]))
    x = crest + cell * np.arange(-first, last + 1, dtype=np.float64)
    z, bubbles = line.height(x), []
    slopes = np.diff(line.z) / np.diff(line.x)
    sharp = (line.bends_deg[1:-1] > SHARP_DEG) & (slopes[1:] < 0)
    end = line.x[0]
    for corner in np.flatnonzero(sharp | (slopes[1:] < -STEEPEST)) + 1:
        start, top = line.x[corner], line.z[corner]
        if (
            start < end
            or (streamline := _streamline(x, z, start, top, slopes[corner - 1])) is None
        ):
            continue
        behind, heights = streamline
        z[behind], end = heights, float(x[behind][-1])
        bubbles.append((start, end))
    return Seen(x, z, tuple(bubbles))


def _streamline(
    x: FloatArray, z: FloatArray, start: float, top: float, slope: float
) -> tuple[slice, FloatArray] | None:
    """Places under a streamline that leaves the bed with a slope, and its heights, if any."""
    ratio = slope / STEEPEST / 4
    # length over drop, to second order; the exact one grows without bounds towards 37 degrees
    stretch = 1.5 / STEEPEST * (1 + ratio + 2 * ratio**2)
    first = int(np.searchsorted(x, start, side="right"))
    drop = top - z[first:]
    lands = first + int(np.argmax(x[first:] - start >= stretch * drop))
    if lands - first < 2:
        return None
    behind = slice(first, lands + 1)
    length = x[lands] - start
    t = (x[behind] - start) / length
    fall, rise = top - z[lands], slope * length
    return behind, z[lands] + (1 - t) ** 2 * (fall * (1 + 2 * t) + rise * t)


Coefficients = Callable[[FloatArray], tuple[FloatArray | float, FloatArray | float]]
"""A and B of wavelengths, m."""


def _stress(line: BedLine, coefficients: Coefficients) -> WallStress:
    seen = seen_by_the_flow(line)
    tau = np.maximum(
        1 + response(seen.slopes, float(seen.x[1] - seen.x[0]), coefficients), 0
    )
    middle = (seen.x[1:] + seen.x[:-1]) / 2
    for start, end in seen.bubbles:
        tau[(middle > start + LASTS * line.h) & (middle < end)] = 0
    sums = np.append(0, np.cumsum(tau * np.diff(seen.x)))
    return _wall_stress(line, lambda edges: np.interp(edges, seen.x, sums))


def response(slopes: FloatArray, cell: float, coefficients: Coefficients) -> FloatArray:
    """Mean of A H + B f' over each of some equal cells (m), from the slope of each.

    Before and behind them the bed is level. H is exact for these slopes: each corner, where the
    slope jumps by c, gives c/pi times the mean of ln|x - corner|.
    """
    count = len(slopes)
    # level bed beside it, so that the transform's next period is far
    from scipy.fft import irfft, next_fast_len, rfft

    size = next_fast_len(4 * count, real=True)
    beyond = np.arange(-1.0, count + 1)
    integral = beyond * (np.log(np.maximum(np.abs(beyond), 1)) - 1)
    kernel = np.zeros(size)
    kernel[:count] = np.diff(integral, 2) / pi
    kernel[-count + 1 :] = -kernel[1:count][::-1]
    modes = rfft(slopes, size)
    wavelengths = size * cell / np.maximum(np.arange(len(modes)), 1)
    a, b = coefficients(wavelengths)
    return np.asarray(irfft((a * rfft(kernel) + b) * modes, size)[:count])


def _wall_stress(
    line: BedLine, integral: Callable[[FloatArray], FloatArray]
) -> WallStress:
    """The stress on faces of h/100 from its integral along x."""
    counts = (whole_up(length / line.h * FACES) + 1 for length in np.diff(line.x))
    pieces = zip(pairwise(line.x), counts, strict=True)
    parts = [np.linspace(*ends, count)[:-1] for ends, count in pieces]
    edges = np.append(np.concatenate(parts), line.x[-1])
    z, tau = line.height(edges), np.diff(integral(edges)) / np.diff(edges)
    length = np.hypot(np.diff(edges), np.diff(z))
    ends = np.cumsum(length)
    s = ends - length / 2 - ends[np.searchsorted(edges[1:], 0)]
    x, z, ustar = (edges[1:] + edges[:-1]) / 2, (z[1:] + z[:-1]) / 2, np.sqrt(tau)
    return WallStress(s, x, z, length, np.full(len(tau), np.nan), tau, ustar, ustar)
