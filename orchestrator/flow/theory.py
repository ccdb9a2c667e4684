"""The stress on the bed without a solver: linear theory of a low bed, or a flat bed.

The stress on a bed z = f(x) is, mode by mode of its Fourier transform, ::

    tau/tau_0 = 1 + A H(x) + B f'(x),    H(x) = 1/pi p.v. int f'(x')/(x - x') dx'

The flow model `waves` takes the A0 and B0 of Fourriere, Claudin and Andreotti (J. Fluid
Mech. 649, 2010) for the wavelength lambda of each mode, by the rational fit of a public
dune code in ln(lambda/z0).

The bed that the flow sees has separation streamlines where it falls too steeply or
bends too sharply: cubics that leave it smoothly, land on it level and fall by 14
degrees at most. Under them the stress is zero (`LASTS` says from where). It is zero too
where the theory gives a negative stress, at the toe of steep faces. docs/flow.md
compares the theory with the solved flow.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import pi

import numpy as np

from orchestrator.bed.line import BedLine
from orchestrator.digits import whole_up
from orchestrator.flow.stress import WallStress
from orchestrator.types import FloatArray

FACES = 100
"""Faces of the bed, per h."""
CELLS = 2 * FACES
"""Cells of the transform, per h."""
LASTS = 0.05
"""Distance behind a brink over which its stress lasts, h.

In the solved flow the stress falls to half within 0.01 to 0.12, and a grain on the
brink is not half in the lee."""
STEEPEST = 0.25
"""Slope of a separation streamline, and of a bed that the flow still follows down."""
BRINK_DEG = 15.0
"""Least bend of a brink that the flow does not follow, degrees."""


@cache
def flat(line: BedLine) -> WallStress:
    """The undisturbed stress, tau = tau_0.

    Parameters
    ----------
    line
        The bed line, m.

    Returns
    -------
    WallStress
        The stress over the undisturbed one, on faces of h/100.
    """
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
    seen = seen_by_the_flow(line)
    cell = float(seen.x[1] - seen.x[0])
    shape = response(
        seen.slopes, cell, lambda wavelength: of_wavelength(wavelength / roughness_m)
    )
    tau = np.maximum(1 + shape, 0)
    middle = (seen.x[1:] + seen.x[:-1]) / 2
    for start, end in seen.bubbles:
        tau[(middle > start + LASTS * line.h) & (middle < end)] = 0
    sums = np.append(0, np.cumsum(tau * np.diff(seen.x)))
    return _wall_stress(line, lambda edges: np.interp(edges, seen.x, sums))


def of_wavelength(
    wavelength_over_roughness: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Coefficients A0 and B0 of each wavelength.

    Parameters
    ----------
    wavelength_over_roughness
        lambda/z0; waves shorter than z0 have the coefficients of z0.

    Returns
    -------
    a0, b0
        Arrays of the same shape.

    Examples
    --------
    >>> import numpy as np
    >>> a0, b0 = of_wavelength(np.array([1e4]))
    >>> print(a0.round(2), b0.round(2))
    [4.51] [2.52]
    """
    r = np.log(np.maximum(wavelength_over_roughness, 1))
    a = 1.0702 + 0.093069 * r + 0.10838 * r**2 + 0.024835 * r**3
    b = 0.036989 + 0.15765 * r + 0.11518 * r**2 + 0.0020249 * r**3
    a /= 1 + 0.041603 * r**2 + 0.0010625 * r**4
    b /= 1 + 0.0028725 * r**2 + 0.00053483 * r**4
    return 2 + a, b


@dataclass(frozen=True, eq=False)
class Seen:
    """The bed that the flow sees.

    Attributes
    ----------
    x, z
        Equally distant places, of which a crest is one, and the height there, m; shape
        (N + 1,).
    bubbles
        Places where the flow leaves the bed and where it meets it again, m.
    """

    x: FloatArray
    z: FloatArray
    bubbles: tuple[tuple[float, float], ...]

    @property
    def slopes(self) -> FloatArray:
        """Slopes of the cells between the places; shape (N,)."""
        return np.diff(self.z) / np.diff(self.x)


@cache
def seen_by_the_flow(line: BedLine) -> Seen:
    """A bed line with separation streamlines where the flow does not follow it.

    Parameters
    ----------
    line
        The bed line, m.

    Returns
    -------
    Seen
        The bed that the flow sees.
    """
    cell = line.h / CELLS
    crest = float(line.crest[0])
    before = whole_up(abs(line.x[0] - crest) / cell)
    after = whole_up(abs(line.x[-1] - crest) / cell)
    x = crest + cell * np.arange(-before, after + 1, dtype=np.float64)
    z = line.height(x)
    slopes = np.diff(line.z) / np.diff(line.x)
    is_sharp = (line.bends_deg[1:-1] > BRINK_DEG) & (slopes[1:] < 0)
    is_steep = slopes[1:] < -STEEPEST
    bubbles: list[tuple[float, float]] = []
    landed = line.x[0]
    for corner in np.flatnonzero(is_sharp | is_steep) + 1:
        start = line.x[corner]
        if start < landed:
            continue
        streamline = _streamline(x, z, start, line.z[corner], slopes[corner - 1])
        if streamline is None:
            continue
        behind, heights = streamline
        z[behind] = heights
        landed = float(x[behind][-1])
        bubbles.append((start, landed))
    return Seen(x, z, tuple(bubbles))


def _streamline(
    x: FloatArray, z: FloatArray, start: float, top: float, slope: float
) -> tuple[slice, FloatArray] | None:
    """Places under a streamline that leaves the bed with a slope, and its heights."""
    ratio = slope / STEEPEST / 4
    # Length over drop, to second order: the exact one grows without bounds towards 37
    # degrees.
    stretch = 1.5 / STEEPEST * (1 + ratio + 2 * ratio**2)
    first = int(np.searchsorted(x, start, side="right"))
    drop = top - z[first:]
    lands = first + int(np.argmax(x[first:] - start >= stretch * drop))
    if lands - first < 2:
        return None
    behind = slice(first, lands + 1)
    length = x[lands] - start
    t = (x[behind] - start) / length
    fall = top - z[lands]
    rise = slope * length
    return behind, z[lands] + (1 - t) ** 2 * (fall * (1 + 2 * t) + rise * t)


Coefficients = Callable[[FloatArray], tuple[FloatArray | float, FloatArray | float]]
"""A and B of wavelengths, m."""


def response(slopes: FloatArray, cell: float, coefficients: Coefficients) -> FloatArray:
    """Mean of A H + B f' over each of some equal cells.

    Before and behind them the bed is level. H is exact for these slopes: each corner,
    where the slope jumps by c, gives c/pi times the mean of ln(abs(x - corner)).

    Parameters
    ----------
    slopes
        Slope of each cell; shape (N,).
    cell
        Length of a cell, m.
    coefficients
        A and B of wavelengths, m.

    Returns
    -------
    FloatArray
        (tau - tau_0)/tau_0 of each cell; shape (N,).

    Examples
    --------
    A jump in A alone, of one cell of slope 1: H is antisymmetric about it.

    >>> import numpy as np
    >>> slopes = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    >>> response(slopes, 1.0, lambda wavelength: (1.0, 0.0)).round(3) + 0.0
    array([-0.167, -0.441,  0.   ,  0.441,  0.167])
    """
    from scipy.fft import irfft, next_fast_len, rfft

    count = len(slopes)
    # Level bed beside it, so that the next period of the transform is far.
    size = next_fast_len(4 * count, real=True)
    corners = np.arange(-1.0, count + 1)
    integral = corners * (np.log(np.maximum(np.abs(corners), 1)) - 1)
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
    edges = _edges(line)
    heights = line.height(edges)
    tau = np.diff(integral(edges)) / np.diff(edges)
    ustar = np.sqrt(tau)
    length = np.hypot(np.diff(edges), np.diff(heights))
    ends = np.cumsum(length)
    toe = ends[np.searchsorted(edges[1:], 0)]
    return WallStress(
        s_m=ends - length / 2 - toe,
        x_m=(edges[1:] + edges[:-1]) / 2,
        z_m=(heights[1:] + heights[:-1]) / 2,
        length_m=length,
        z_e_m=np.full(len(tau), np.nan),
        tau_wall=tau,
        ustar_over_ustar0_eq10=ustar,
    )


def _edges(line: BedLine) -> FloatArray:
    """Ends of faces of h/100 along a bed line, m; each of its corners is one."""
    pieces = []
    for start, end in zip(line.x[:-1], line.x[1:], strict=True):
        count = whole_up((end - start) / line.h * FACES) + 1
        pieces.append(np.linspace(start, end, count)[:-1])
    pieces.append(np.array([line.x[-1]]))
    return np.concatenate(pieces)
