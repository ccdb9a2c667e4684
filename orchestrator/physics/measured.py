"""Measured thresholds, pivots of natural beds, hiding in mixtures, flows over hills."""

import csv
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.types import FloatArray


@dataclass(frozen=True)
class Bin:
    """Measured threshold Shields numbers for low <= Re* < high: count, median and percentiles.

    The percentiles are the order statistics of rank int(n/10) + 1 and int(9 n/10) + 1.
    """

    low: float
    high: float
    count: int
    median: float
    tenth: float
    ninetieth: float

    @property
    def middle(self) -> float:
        """Geometric mean of the range of Re*."""
        return float(np.sqrt(self.low * self.high))


def _bins(rows: str) -> tuple[Bin, ...]:
    text = Path(__file__).with_name("flumes.csv").read_text(encoding="utf-8")
    read = [[float(x) for x in row[1:]] for row in csv.reader(text.split()) if row[0] == rows]
    return tuple(Bin(low, high, int(count), *rest) for low, high, count, *rest in read)


BUFFINGTON_MONTGOMERY = _bins("all")
"""Flume measurements in water by many authors, binned by Re*.

Compiled by J. M. Buffington and D. R. Montgomery, Water Resour. Res. 33, 1997,
doi:10.1029/96WR03190; binned from its rows in the data of S. A. Feehan et al., 2023
(github.com/scott-feehan/Quantifying-uncertainty-in-incipient-sediment-motion-thresholds,
Shields_compilation_flume.csv), Re* from their Shields number, median diameter and density with
nu = 1e-6 m2/s and g = 9.81 m/s2. Visual thresholds and those by a reference transport are together.
"""

VISUAL = _bins("visual")
"""Those of them by eye alone: the first motion, as a model has it."""
MEASURED_SOURCE = "flumes, compiled by Buffington & Montgomery 1997"
"""For legends."""


def kirchner_pivot(percentile: ArrayLike, relative_diameter: ArrayLike = 1.0) -> FloatArray:
    """Pivot angle of a natural bed at a percentile, deg: (30 + n/2)(D/D50)^-0.3.

    J. W. Kirchner, W. E. Dietrich, F. Iseya and H. Ikeda, Sedimentology 37, 1990, as in the code
    of E. Yager et al., 2018 (taucrcalc); the article was not at hand. The entrainment angle is 90
    deg less the pivot: beta 60 and 45 are the percentiles 0 and 30 of grains of the median size.
    """
    n, size = np.asarray(percentile, float), np.asarray(relative_diameter, float)
    return np.asarray((30 + 0.5 * n) * size**-0.3)


def wilcock_crowe_hiding(relative_diameter: ArrayLike) -> FloatArray:
    """Threshold stress of a size in a mixture over that of the mean size, of D_i/D_m.

    P. R. Wilcock and J. C. Crowe, J. Hydraul. Eng. 129, 2003,
    doi:10.1061/(ASCE)0733-9429(2003)129:2(120); the exponent agrees with several public codes.
    It was fitted to a reference transport, not to the first motion.
    """
    size = np.asarray(relative_diameter, float)
    return np.asarray(size ** (0.67 / (1 + np.exp(1.5 - size))))


def egiazaroff_hiding(relative_diameter: ArrayLike) -> FloatArray:
    """Threshold Shields number of a size in a mixture over that of the mean size, of D_i/D_m.

    I. V. Egiazaroff, J. Hydraul. Div. 91 (HY4), 1965: (log 19/log(19 D_i/D_m))^2, as in public
    codes. It rises without bound towards D_i/D_m = 1/19 (codes replace it below 0.4, after Ashida
    and Michiue) and means nothing below, where it is NaN. The factor on the stress is it times
    D_i/D_m.
    """
    size = 19 * np.asarray(relative_diameter, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(size > 1, (np.log(19) / np.log(size)) ** 2, np.nan)


NEAR = 0.02
"""Share by which a hill, or ten times by which z0, may differ and still be the experiment's."""
HEIGHT_OVER_ROUGHNESS = 0.117 / 1.57e-4
"""Height of the hills over z0: ERCOFTAC's data begin at 0.157 mm, the z0 of the wall."""


@dataclass(frozen=True)
class MeasuredHill:
    """Where reversed flow ends behind the top of a hill, in heights; 0: there was none in the mean.

    ``aspect`` is the half length over the height; ``verified`` says whether the number was read in
    its source.
    """

    aspect: float
    reattachment: float
    source: str
    verified: bool = True


_SUMMARY = "separated behind the steepest hill alone: EPA-600/S4-81-067"
RUSHIL = (
    MeasuredHill(3.0, 6.5, f"{_SUMMARY}; the length is unverified", verified=False),
    MeasuredHill(5.0, 0.0, _SUMMARY),
    MeasuredHill(8.0, 0.0, _SUMMARY),
)


def rushil_form(aspect: float) -> tuple[FloatArray, FloatArray]:
    """X from the top and z of a hill of RUSHIL over its height, by its half length over that.

    L. H. Khurshudyan, W. H. Snyder and I. V. Nekrasov, EPA-600/4-81-067, 1981, as in ERCOFTAC's
    case 69: xi = a sin(t) runs from one foot to the other.
    """
    t = np.linspace(-np.pi / 2, np.pi / 2, 4001)
    m = 1 / aspect + np.sqrt(1 / aspect**2 + 1)
    q = np.sin(t) ** 2 + m**2 * np.cos(t) ** 2
    xs, zs = aspect / 2 * np.sin(t) * (1 + 1 / q), m * aspect / 2 * np.cos(t) * (1 - 1 / q)
    # equal steps of t would crowd at the feet, where x is level in it
    x = np.linspace(-aspect, aspect, 81)
    return x, np.interp(x, xs, zs)


@cache
def rushil_aspect(slope_deg: float) -> float:
    """Half length over height of the hill of RUSHIL whose steepest slope is given, degrees."""
    from scipy.optimize import brentq

    def steeper(logarithm: float) -> float:
        x, z = rushil_form(math.exp(logarithm))
        return float(np.max(np.diff(z) / np.diff(x))) - math.tan(math.radians(slope_deg))

    # functions of numpy would differ in the last digit, and with it the digests of flows
    return math.exp(brentq(steeper, math.log(0.1), math.log(1e3)))


def rushil_hill(slope_deg: float, height_over_roughness: float) -> MeasuredHill | None:
    """The hill of the experiment that one of this steepest slope and roughness is, if any."""
    if abs(height_over_roughness / HEIGHT_OVER_ROUGHNESS - 1) > 10 * NEAR:
        return None
    aspect = rushil_aspect(slope_deg)
    return next((hill for hill in RUSHIL if abs(aspect / hill.aspect - 1) < NEAR), None)
