"""Measured thresholds, pivots of natural beds, hiding in mixtures, flows over hills."""

import csv
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from orchestrator.physics.constants import GAS_BELOW, GRAVITY
from orchestrator.types import FloatArray


@dataclass(frozen=True)
class Bin:
    """Measured critical Shields numbers in a range of Re*.

    Attributes
    ----------
    low, high
        The range, low <= Re* < high.
    count
        Number of measurements.
    median
        Their median Shields number.
    tenth, ninetieth
        Percentiles: the order statistics of rank int(n/10) + 1 and int(9 n/10) + 1.
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
    """Read the bins of a group of rows of ``flumes.csv``."""
    path = Path(__file__).with_name("flumes.csv")
    with path.open(encoding="utf-8", newline="") as stream:
        table = [row for row in csv.DictReader(stream) if row["rows"] == rows]
    return tuple(_bin(row) for row in table)


def _bin(row: dict[str, str]) -> Bin:
    """Make a bin of a row of text."""
    return Bin(
        low=float(row["low"]),
        high=float(row["high"]),
        count=int(row["count"]),
        median=float(row["median"]),
        tenth=float(row["tenth"]),
        ninetieth=float(row["ninetieth"]),
    )


MEASURED_BEDS = Path(__file__).with_name("beds.csv")
"""Measured beds, a row for each: of flumes, rivers and the field."""
_OF_FORMULA = "formula of Iversen and White"
"""The set of rows there that are of a formula."""


def single_beds(*, in_gas: bool) -> tuple[FloatArray, FloatArray]:
    """List every measured bed of `MEASURED_BEDS`.

    Parameters
    ----------
    in_gas
        Whether those in a gas or those in a liquid.

    Returns
    -------
    reynolds, shields : FloatArray
        Re* at the measured threshold and its critical Shields number, shape (n,).

    Examples
    --------
    >>> reynolds, shields = single_beds(in_gas=True)
    >>> bool((reynolds > 0).all()), reynolds.shape == shields.shape
    (True, True)
    """
    d, solid, fluid, viscosity, shields = _rows_of_beds(in_gas)
    ustar = np.sqrt(shields * (solid - fluid) / fluid * GRAVITY * d)
    return ustar * d / viscosity, shields


def measured_sizes(*, in_gas: bool) -> tuple[FloatArray, FloatArray]:
    """List the sizes of the measured beds with their threshold friction velocities.

    Parameters
    ----------
    in_gas
        Whether those in a gas or those in a liquid.

    Returns
    -------
    diameter, ustar : FloatArray
        Diameters, m, and friction velocities, m/s, shape (n,).

    Examples
    --------
    >>> diameter, ustar = measured_sizes(in_gas=False)
    >>> bool((ustar > 0).all()), diameter.shape == ustar.shape
    (True, True)
    """
    d, solid, fluid, _, shields = _rows_of_beds(in_gas)
    return d, np.sqrt(shields * (solid - fluid) / fluid * GRAVITY * d)


@cache
def _rows_of_beds(in_gas: bool) -> FloatArray:
    """Diameter, densities, viscosity and Shields number of each bed, shape (5, n)."""
    with MEASURED_BEDS.open(encoding="utf-8", newline="") as stream:
        table = [row for row in csv.DictReader(stream) if row["set"] != _OF_FORMULA]
    names = ("d_m", "rho_sol_kg_m3", "rho_f_kg_m3", "nu_m2_s", "shields")
    rows = np.array([[float(row[name]) for name in names] for row in table])
    return np.asarray(rows[(rows[:, 2] < GAS_BELOW) == in_gas].T)


BUFFINGTON_MONTGOMERY = _bins("all")
"""Flume measurements in water by many authors, binned by Re*.

Compiled by J. M. Buffington and D. R. Montgomery, Water Resour. Res. 33, 1997,
doi:10.1029/96WR03190; binned from its rows in the data of S. A. Feehan et al., 2023
(github.com/scott-feehan/Quantifying-uncertainty-in-incipient-sediment-motion-thresholds,
Shields_compilation_flume.csv), Re* from their Shields number, median diameter and
density with nu = 1e-6 m2/s and g = 9.81 m/s2. Visual thresholds and those by a
reference transport are together.
"""
VISUAL = _bins("visual")
"""Those of them by eye alone: the first motion, as a model has it."""
MEASURED_SOURCE = "flumes, compiled by Buffington & Montgomery 1997"
"""Source of both, for legends."""


def kirchner_pivot(
    percentile: ArrayLike,
    relative_diameter: ArrayLike = 1.0,
) -> FloatArray:
    """Compute the pivot angle of a natural bed: (30 + n/2)(D/D50)^-0.3.

    J. W. Kirchner, W. E. Dietrich, F. Iseya and H. Ikeda, Sedimentology 37, 1990, as in
    the code of E. Yager et al., 2018 (taucrcalc); the article was not at hand. The
    entrainment angle is 90 deg less the pivot: beta 60 and 45 are the percentiles 0 and
    30 of grains of the median size.

    Parameters
    ----------
    percentile
        Percentile n of the pivots of the bed, 0 to 100.
    relative_diameter
        Diameter of the grain over the median of the bed, D/D50.

    Returns
    -------
    FloatArray
        Pivot angle, degrees, of the broadcast shape.

    Examples
    --------
    >>> print(kirchner_pivot([0, 50, 100]))
    [30. 55. 80.]
    """
    n = np.asarray(percentile, float)
    size = np.asarray(relative_diameter, float)
    return np.asarray((30 + 0.5 * n) * size**-0.3)


def wilcock_crowe_hiding(relative_diameter: ArrayLike) -> FloatArray:
    """Compute the threshold stress of a size in a mixture over that of the mean size.

    P. R. Wilcock and J. C. Crowe, J. Hydraul. Eng. 129, 2003,
    doi:10.1061/(ASCE)0733-9429(2003)129:2(120); the exponent agrees with several public
    codes. It was fitted to a reference transport, not to the first motion.

    Parameters
    ----------
    relative_diameter
        Diameter over the mean diameter of the mixture, D_i/D_m.

    Returns
    -------
    FloatArray
        Threshold stress over that of the mean size, of the same shape.

    Examples
    --------
    >>> print(wilcock_crowe_hiding([0.5, 1.0, 2.0]).round(3))
    [0.883 1.    1.335]
    """
    size = np.asarray(relative_diameter, float)
    return np.asarray(size ** (0.67 / (1 + np.exp(1.5 - size))))


def egiazaroff_hiding(relative_diameter: ArrayLike) -> FloatArray:
    """Compute the critical Shields number of a size over that of the mean size.

    I. V. Egiazaroff, J. Hydraul. Div. 91 (HY4), 1965: (log 19/log(19 D_i/D_m))^2, as in
    public codes. It rises without bound towards D_i/D_m = 1/19 (codes replace it below
    0.4, after Ashida and Michiue). The factor on the stress is it times D_i/D_m.

    Parameters
    ----------
    relative_diameter
        Diameter over the mean diameter of the mixture, D_i/D_m.

    Returns
    -------
    FloatArray
        Critical Shields number over that of the mean size, of the same shape. It is
        NaN up to D_i/D_m = 1/19, where the formula means nothing.

    Examples
    --------
    >>> print(egiazaroff_hiding([0.01, 0.5, 1.0, 2.0]).round(3))
    [  nan 1.711 1.    0.655]
    """
    size = 19 * np.asarray(relative_diameter, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = (np.log(19) / np.log(size)) ** 2
    return np.where(size > 1, factor, np.nan)


NEAR = 0.02
"""Relative difference of a hill's aspect up to which it is one of the experiment."""
NEAR_ROUGHNESS = 10 * NEAR
"""The same of the height over the roughness length."""
HEIGHT_OVER_ROUGHNESS = 0.117 / 1.57e-4
"""Height of the hills over z0.

ERCOFTAC's data begin at 0.157 mm, the z0 of the wall.
"""


@dataclass(frozen=True)
class MeasuredHill:
    """Where the reversed flow behind a hill of the wind tunnel RUSHIL ends.

    Attributes
    ----------
    aspect
        Half length over height.
    reattachment
        Distance from the crest to the end of the reversed flow, in heights; 0 if the
        mean flow was not reversed.
    source
        Where the number is from.
    verified
        Whether the number was read in its source.
    """

    aspect: float
    reattachment: float
    source: str
    verified: bool = True


_SUMMARY = "separated behind the steepest hill alone: EPA-600/S4-81-067"
_UNVERIFIED = f"{_SUMMARY}; the length is unverified"
RUSHIL = (
    MeasuredHill(3.0, 6.5, _UNVERIFIED, verified=False),
    MeasuredHill(5.0, 0.0, _SUMMARY),
    MeasuredHill(8.0, 0.0, _SUMMARY),
)
"""The three hills of the experiment."""
_PARAMETERS = 4001
"""Values of the parameter t at which the form of a hill is computed."""
_POINTS = 81
"""Points of a hill's form, evenly spaced along x."""


def rushil_form(aspect: float) -> tuple[FloatArray, FloatArray]:
    """Compute the form of a hill of RUSHIL.

    L. H. Khurshudyan, W. H. Snyder and I. V. Nekrasov, EPA-600/4-81-067, 1981, as in
    ERCOFTAC's case 69: xi = a sin(t) runs from one foot to the other.

    Parameters
    ----------
    aspect
        Half length over height of the hill, a/H.

    Returns
    -------
    x, z
        Distance from the crest and height over the toe, both over the height of the
        hill, arrays of shape (81,).

    Examples
    --------
    >>> x, z = rushil_form(3.0)
    >>> print(x[[0, 40, 80]], z[[0, 40, 80]].round(6))
    [-3.  0.  3.] [0. 1. 0.]
    """
    t = np.linspace(-np.pi / 2, np.pi / 2, _PARAMETERS)
    m = 1 / aspect + np.sqrt(1 / aspect**2 + 1)
    q = np.sin(t) ** 2 + m**2 * np.cos(t) ** 2
    form_x = aspect / 2 * np.sin(t) * (1 + 1 / q)
    form_z = m * aspect / 2 * np.cos(t) * (1 - 1 / q)
    # equal steps of t would crowd at the feet, where dx/dt is 0
    x = np.linspace(-aspect, aspect, _POINTS)
    return x, np.interp(x, form_x, form_z)


@cache
def rushil_aspect(slope_deg: float) -> float:
    """Find the hill of RUSHIL that has a steepest slope.

    Parameters
    ----------
    slope_deg
        Steepest slope of the hill, degrees.

    Returns
    -------
    float
        Half length over height of that hill.

    Raises
    ------
    ValueError
        If no hill with an aspect from 0.1 to 1000 has this slope.

    Examples
    --------
    >>> round(rushil_aspect(26.175), 2)
    3.0
    """
    from scipy.optimize import brentq

    tangent = math.tan(math.radians(slope_deg))

    def steeper(logarithm: float) -> float:
        x, z = rushil_form(math.exp(logarithm))
        return float(np.max(np.diff(z) / np.diff(x))) - tangent

    # numpy's functions would differ in the last digit, and with it the digests of flows
    return math.exp(brentq(steeper, math.log(0.1), math.log(1e3)))


def rushil_hill(
    slope_deg: float,
    height_over_roughness: float,
) -> MeasuredHill | None:
    """Look up the hill of the experiment that a given hill is.

    Parameters
    ----------
    slope_deg
        Steepest slope of the given hill, degrees.
    height_over_roughness
        Its height over the roughness length of its wall.

    Returns
    -------
    MeasuredHill or None
        The hill of the experiment; None if the given one is none of them.

    Examples
    --------
    >>> rushil_hill(26.175, 745.0).reattachment
    6.5
    >>> print(rushil_hill(26.175, 100.0))
    None
    """
    roughness_ratio = height_over_roughness / HEIGHT_OVER_ROUGHNESS
    if abs(roughness_ratio - 1) > NEAR_ROUGHNESS:
        return None
    aspect = rushil_aspect(slope_deg)
    near = (hill for hill in RUSHIL if abs(aspect / hill.aspect - 1) < NEAR)
    return next(near, None)
